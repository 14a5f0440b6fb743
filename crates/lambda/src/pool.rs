//! Long work on the rayon pool, so that the runtime stays free for requests.

use tokio::sync::oneshot;

/// Runs work on the pool. Returns `None` if it panicked.
pub(crate) async fn run<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> Option<T> {
    let (send, receive) = oneshot::channel();
    rayon::spawn(move || {
        let work = std::panic::AssertUnwindSafe(work);
        if let Ok(value) = std::panic::catch_unwind(work) {
            // If this fails, the invocation was stopped and nothing waits for the result.
            let _ = send.send(value);
        }
    });
    receive.await.ok()
}
