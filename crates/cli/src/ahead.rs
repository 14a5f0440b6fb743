//! Makes frames ahead of their consumer, which takes them in order.
//!
//! Frames are made side by side on the rayon pool, while the caller's thread takes the finished ones in order. If that
//! thread belongs to the pool, it also makes frames while there is none to take. The number of frames that are being
//! made or waiting is bounded, so that memory does not grow with the number of frames, however slow the taker is.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, TryRecvError};
use std::time::Duration;

use rayon::Yield;

use crate::interrupt;

/// The time that a thread of the pool sleeps when it has nothing to do. Other threads may create work meanwhile.
const NAP: Duration = Duration::from_millis(1);

/// Runs `work` on every item of `items`, at most `window` at once, and passes the results to `take` in order.
///
/// The first error, of an item, of its work or of taking it, ends everything: work in progress is stopped
/// ([`interrupt::stop`]) and awaited.
///
/// # Errors
/// The first error, as above.
pub(crate) fn in_order<I: Send, T: Send>(
    items: impl Iterator<Item = I>,
    window: usize,
    work: impl Fn(I) -> anyhow::Result<T> + Sync,
    mut take: impl FnMut(T) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let mut items = items.enumerate().fuse();
    let (sender, receiver) = mpsc::channel();
    let work = &work;
    rayon::in_place_scope(|scope| {
        let mut waiting = BTreeMap::new();
        let (mut started, mut taken) = (0, 0);
        let mut run = || {
            loop {
                while started - taken < window.max(1) {
                    let Some((index, item)) = items.next() else { break };
                    started += 1;
                    let sender = sender.clone();
                    scope.spawn(move |_| {
                        // A panic must not leave the taker waiting for ever.
                        let result = catch_unwind(AssertUnwindSafe(|| work(item)))
                            .unwrap_or_else(|_| Err(anyhow::anyhow!("frame {} ran into a bug", index + 1)));
                        // The receiver is gone if the whole has failed.
                        let _ = sender.send((index, result));
                    });
                }
                if let Some(next) = waiting.remove(&taken) {
                    taken += 1;
                    take(next)?;
                    continue;
                }
                if started == taken {
                    return Ok(());
                }
                let (index, result) = next(&receiver)?;
                waiting.insert(index, result?);
            }
        };
        let result = run();
        if result.is_err() {
            interrupt::stop();
        }
        result
    })
}

/// Waits for the next item. A thread of the pool works on other tasks of the pool meanwhile.
fn next<T>(receiver: &Receiver<T>) -> anyhow::Result<T> {
    loop {
        match receiver.try_recv() {
            Err(TryRecvError::Empty) => {}
            received => return Ok(received?),
        }
        match rayon::yield_now() {
            None => return Ok(receiver.recv()?),
            Some(Yield::Executed) => {}
            Some(Yield::Idle) => match receiver.recv_timeout(NAP) {
                Err(RecvTimeoutError::Timeout) => {}
                received => return Ok(received?),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::time::Duration;

    use super::*;

    #[test]
    fn results_come_in_order_and_never_more_than_the_window() {
        let (under_way, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let mut taken = Vec::new();
        in_order(
            0..100_u64,
            5,
            |n| {
                most.fetch_max(under_way.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
                std::thread::sleep(Duration::from_micros(n * 7919 % 500));
                Ok(n)
            },
            |n| {
                under_way.fetch_sub(1, Ordering::SeqCst);
                taken.push(n);
                Ok(())
            },
        )
        .unwrap();
        assert_eq!(taken, (0..100).collect::<Vec<_>>());
        assert!(most.into_inner() <= 5);
    }

    #[test]
    fn a_pool_of_one_thread_that_takes_as_well_is_enough() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let taken = pool.install(|| {
            let mut taken = Vec::new();
            let take = |n| {
                taken.push(n);
                Ok(())
            };
            in_order(0..20, 3, Ok, take).unwrap();
            taken
        });
        assert_eq!(taken, (0..20).collect::<Vec<_>>());
    }

    #[test]
    fn nothing_to_do_is_done() {
        in_order(0..0, 3, Ok, |_: i32| panic!("nothing to take")).unwrap();
    }
}
