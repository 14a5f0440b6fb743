//! Selects the S3 servers for the tests: always the built-in one, and each other one that is found. `RAYFOLD_STORE` names
//! the only one.
//!
//! Each test program prints its servers once, on standard error, so that the test runner does not capture the line. A
//! store that was not tested must not look like a success.

use std::io::Write;
use std::sync::OnceLock;

use rayfold_local::StoreKind;

/// Names the only server for the tests, as the flag `--store` does.
const ONLY: &str = "RAYFOLD_STORE";

/// Returns the built-in one and those that are found. Installs nothing. A server that is named must be there.
fn stores() -> &'static [StoreKind] {
    static STORES: OnceLock<Vec<StoreKind>> = OnceLock::new();
    STORES.get_or_init(|| {
        let mut stores = Vec::new();
        // The printing macros are captured, and their output is shown only for failed tests.
        let say = |line: String| drop(writeln!(std::io::stderr(), "{line}"));
        let only = std::env::var(ONLY).ok();
        let is_named = |kind: &StoreKind| only.as_ref().is_none_or(|name| *name == kind.name());
        assert!(
            StoreKind::ALL.iter().any(is_named),
            "{ONLY}={}: there is no such store",
            only.unwrap_or_default()
        );
        for kind in StoreKind::ALL.into_iter().filter(is_named) {
            match kind.program().map(|program| program.find()) {
                None => say(format!("these tests run on {kind}")),
                Some(Ok(binary)) => say(format!("these tests run on {kind} ({})", binary.display())),
                Some(Err(why)) if only.is_some() => panic!("{kind}: {why}"),
                Some(Err(why)) => {
                    say(format!("NOT RUN: these tests on {kind}: {why}"));
                    continue;
                }
            }
            stores.push(kind);
        }
        stores
    })
}

/// Runs a test on each of them, one after the other.
pub(crate) async fn on_every_store(test: impl AsyncFn(StoreKind)) {
    for &store in stores() {
        eprintln!("on {store}:");
        test(store).await;
    }
}

/// Runs a test on the servers that issue temporary credentials with a policy. SeaweedFS issues none to its owner.
#[allow(dead_code, reason = "a module of several test files, which use each a part of it")]
pub(crate) async fn on_every_store_with_roles(test: impl AsyncFn(StoreKind)) {
    on_every_store(async |store| match store {
        StoreKind::BuiltIn | StoreKind::Minio => test(store).await,
        StoreKind::SeaweedFs => {
            let _ = writeln!(
                std::io::stderr(),
                "NOT RUN: roles on {store}, which has no AssumeRole with a policy"
            );
        }
    })
    .await;
}
