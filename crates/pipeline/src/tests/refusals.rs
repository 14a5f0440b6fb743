//! Tests of how steps react to a store that refuses: a transient error is tried again, a permanent one is reported at
//! once.

use super::*;
use crate::fold::Folded;
use crate::lease::HeldLease;

/// Returns the errors after which a conditional put may succeed once everything is read again.
fn passing() -> [Error; 5] {
    let (key, source) = ("k".to_owned(), || "x".into());
    [
        Error::PreconditionFailed { key: key.clone() },
        Error::Conflict { key: key.clone() },
        Error::NotFound { key: key.clone() },
        Error::Throttled { key: key.clone(), source: source() },
        Error::Ambiguous { key, source: source() },
    ]
}

fn refused() -> Error {
    Error::Refused { key: "k".into(), source: "no".into() }
}

impl World {
    /// Makes the `nth` request of this name, counted from 1, fail with this error.
    fn answer(&self, request: &'static str, nth: u32, error: Error) {
        let (mut count, mut error) = (0, Some(error));
        self.refuse(move |asked| {
            count += u32::from(asked == request);
            if asked == request && count == nth { error.take() } else { None }
        });
    }
}

const LEASE: &str = "frames/film/@assembler.json";
const PUT_LEASE: &str = "put frames/film/@assembler.json";
const PUT_MANIFEST: &str = "put manifests/film.json";

/// The first put is that of a new lease; the second one takes over an existing one.
#[tokio::test]
async fn a_lease_that_is_over_is_taken_though_the_first_attempt_at_it_fails() {
    for error in passing() {
        let (world, what) = (World::new(), format!("{error:?}"));
        world.put(LEASE, r#"{"assembler":"a","until":1000}"#);
        world.answer(PUT_LEASE, 2, error);
        let taken = world.with(async |invocation| invocation.take_lease(&World::film()).await).await;
        assert!(taken.unwrap().is_some(), "{what}");
    }
}

#[tokio::test]
async fn a_lease_that_may_not_be_put_is_said_at_once() {
    for nth in [1, 2] {
        let world = World::new();
        world.put(LEASE, r#"{"assembler":"a","until":1000}"#);
        world.answer(PUT_LEASE, nth, refused());
        let taken = world.with(async |invocation| invocation.take_lease(&World::film()).await).await;
        assert!(matches!(taken, Err(Error::Refused { .. })), "{nth}: {taken:?}");
    }
}

#[tokio::test]
async fn ones_own_lease_need_not_be_renewed() {
    let world = World::new();
    // The first request's.
    world.put(LEASE, r#"{"assembler":"request-0","until":9000000}"#);
    world.refuse(|request| {
        (request == PUT_LEASE).then(|| Error::PreconditionFailed { key: LEASE.to_owned() })
    });
    let taken = world.with(async |invocation| invocation.take_lease(&World::film()).await).await;
    assert!(taken.unwrap().is_some());
}

/// The put succeeded and its reply was lost. An assembler that mistook this lease for another's would exit, and the
/// lease would keep all others from working.
#[tokio::test]
async fn a_left_lease_that_was_taken_without_an_answer_is_ones_own() {
    const TAKEN: &str = r#"{"assembler":"request-0","until":9000000,"checkpoint":true}"#;
    let world = World::new();
    world.put(LEASE, r#"{"assembler":"","until":0,"checkpoint":true}"#);
    world.meddle(|request, bucket, now| {
        if request == PUT_LEASE {
            bucket.put(now, LEASE, TAKEN.into(), PutOptions::always()).unwrap();
        }
    });
    let taken = world.with(async |invocation| invocation.reclaim_lease(&World::film()).await).await;
    assert_eq!(taken.unwrap(), Some(HeldLease { has_checkpoint: true }));
    assert_eq!(world.store.bucket.lock().unwrap().get(LEASE).unwrap().body, TAKEN);
}

#[tokio::test]
async fn a_manifest_that_somebody_else_may_have_written_is_looked_at_anew() {
    for nth in [1, 2] {
        for error in passing() {
            let (world, what) = (World::new(), format!("{nth}: {error:?}"));
            if nth == 2 {
                world.upload("1.txt", "frame 1").await;
            }
            world.answer(PUT_MANIFEST, 1, error);
            world.put("scripts/film/2.txt", "frame 2");
            let rendered = world.try_render("scripts/film/2.txt").await.unwrap();
            assert_eq!((rendered.outcome, rendered.folded), (Outcome::Drawn, Folded::Claimed), "{what}");
            assert_eq!(world.manifest().head.revision, nth, "{what}");
        }
    }
}

#[tokio::test]
async fn a_manifest_that_may_not_be_put_is_said_at_once() {
    let world = World::new();
    world.answer(PUT_MANIFEST, 1, refused());
    world.put("scripts/film/1.txt", "frame 1");
    let rendering = world.try_render("scripts/film/1.txt").await;
    assert!(matches!(rendering, Err(Error::Refused { .. })), "{rendering:?}");
    assert_eq!(world.keys("assemblies/"), [""; 0]);
}

/// The platform's next attempt at an event runs until a later time. No other assembler may take the lease from it
/// before that.
#[tokio::test]
async fn a_lease_is_ones_own_for_as_long_as_one_may_run() {
    for there in
        [None, Some(r#"{"assembler":"request-0","until":1000}"#), Some(r#"{"assembler":"a","until":1000}"#)]
    {
        let mut world = World::new();
        let deadline = world.store.clock.now().after(Duration::from_secs(900));
        world.deadline = Some(deadline);
        if let Some(there) = there {
            world.put(LEASE, there);
        }
        let taken = world.with(async |invocation| invocation.take_lease(&World::film()).await).await;
        assert!(taken.unwrap().is_some(), "{there:?}");
        let body = world.store.bucket.lock().unwrap().get(LEASE).unwrap().body;
        assert_eq!(body, format!(r#"{{"assembler":"request-0","until":{}}}"#, deadline.0), "{there:?}");
    }
}
