//! Which S3 servers the tests run on: always the one built in, and MinIO where there is one.
//!
//! A run says which, once a test program, on standard error past the test runner's capture: what was not tried must not
//! look like a success.

use std::io::Write;
use std::sync::OnceLock;

use rayfold_local::{StoreKind, minio};

/// Both, or the one built in where no MinIO is found. None is installed here.
fn stores() -> &'static [StoreKind] {
    static STORES: OnceLock<Vec<StoreKind>> = OnceLock::new();
    STORES.get_or_init(|| {
        let (stores, line) = match minio::find() {
            Ok(binary) => {
                (StoreKind::ALL.to_vec(), format!("the store built in, and MinIO ({})", binary.display()))
            }
            Err(why) => (vec![StoreKind::BuiltIn], format!("the store built in, and NOT on MinIO: {why}")),
        };
        // The macros that print are captured, and shown for tests that fail alone.
        let _ = writeln!(std::io::stderr(), "these tests run on {line}");
        stores
    })
}

/// A test on each of them, one after the other.
pub(crate) async fn on_every_store(test: impl AsyncFn(StoreKind)) {
    for &store in stores() {
        eprintln!("on {store}:");
        test(store).await;
    }
}
