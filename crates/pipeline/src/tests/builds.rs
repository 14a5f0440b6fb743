//! Tests of a GIF whose upload fails, and of one that an earlier assembler left unfinished.

use super::assemblies::{CHECKPOINT, GIF, seconds};
use super::*;

const PART: &str = "part animations/film.gif";
const FINISH: &str = "finish animations/film.gif";

fn throttled() -> Error {
    Error::Throttled { key: "k".into(), source: "busy".into() }
}

fn not_found() -> Error {
    Error::NotFound { key: "k".into() }
}

fn refused() -> Error {
    Error::Refused { key: "k".into(), source: "no".into() }
}

/// Returns whether two errors are of the same kind.
fn is_like(error: &Error, other: &Error) -> bool {
    std::mem::discriminant(error) == std::mem::discriminant(other)
}

impl World {
    /// Takes five of twelve frames and leaves the GIF unfinished. Returns the claim.
    async fn unfinished(&mut self) -> String {
        self.policy.spare_frames = 1;
        let claim = self.announced(12).await;
        self.deadline = Some(self.store.clock.now().after(seconds(60)));
        let assembled = self.assemble(&self.slow(seconds(10)), &claim).await.unwrap();
        assert_eq!(assembled.left_after, Some(5));
        self.deadline = None;
        claim
    }

    /// Makes the requests of this name fail with this error, from the `nth` on, counted from 1, `times` times.
    fn answers(&self, request: &'static str, nth: u32, times: u32, error: fn() -> Error) {
        let mut count = 0;
        self.refuse(move |asked| {
            count += u32::from(asked == request);
            (asked == request && (nth..nth + times).contains(&count)).then(error)
        });
    }

    fn uploads(&self) -> usize {
        self.store.bucket.lock().unwrap().unfinished_uploads()
    }

    /// Makes the next assembler the platform's next attempt at the last one's event.
    fn try_again(&self) {
        self.requests.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Returns the number of parts of the GIF, if the first ones are sent already.
async fn parts(is_begun: bool) -> u32 {
    let mut world = World::new();
    let claim = if is_begun { world.unfinished().await } else { world.announced(2).await };
    let counted = Arc::new(AtomicU64::new(0));
    let counter = counted.clone();
    world.refuse(move |asked| {
        counter.fetch_add(u64::from(asked == PART), Ordering::Relaxed);
        None
    });
    world.assemble(&world.joiner(), &claim).await.unwrap();
    counted.load(Ordering::Relaxed) as u32
}

#[tokio::test]
async fn a_gif_that_somebody_else_may_have_put_is_looked_at_anew() {
    let errors: [fn() -> Error; 5] = [
        throttled,
        not_found,
        || Error::PreconditionFailed { key: "k".into() },
        || Error::Conflict { key: "k".into() },
        || Error::Ambiguous { key: "k".into(), source: "x".into() },
    ];
    for error in errors {
        let world = World::new();
        let claim = world.announced(2).await;
        world.answers(FINISH, 1, 1, error);
        let assembled = world.assemble(&world.joiner(), &claim).await.unwrap();
        assert_eq!((assembled.rounds, assembled.built), (3, 1), "{:?}", error());
        assert_eq!(world.gif(), Some(world.film_of(2)));
    }
    let world = World::new();
    let claim = world.announced(2).await;
    world.answers(FINISH, 1, 1, refused);
    let error = world.assemble(&world.joiner(), &claim).await.unwrap_err();
    assert!(is_like(&error, &refused()), "{error:?}");
}

/// Tested in the middle of a GIF, and at its last part.
#[tokio::test]
async fn a_gif_whose_parts_cannot_be_sent_is_given_up_and_why_is_said() {
    let last = parts(false).await;
    assert!(last > 3, "{last}");
    for nth in [1, last] {
        for error in [throttled as fn() -> Error, not_found, refused] {
            let world = World::new();
            let claim = world.announced(2).await;
            world.answers(PART, nth, 1, error);
            let found = world.assemble(&world.joiner(), &claim).await.unwrap_err();
            assert!(is_like(&found, &error()), "{found:?}");
            assert_eq!(world.uploads(), 0, "{nth}: {found:?}");
            // The platform tries again.
            world.try_again();
            assert_eq!(world.assemble(&world.joiner(), &claim).await.unwrap().built, 1);
            assert_eq!(world.gif(), Some(world.film_of(2)));
            assert!(world.is_at_rest());
        }
    }
}

/// Tested at any part, also of a file that is continued.
#[tokio::test]
async fn a_file_that_is_larger_than_an_upload_may_be_is_refused() {
    let too_large = || Error::TooLarge { key: "animations/film.gif".into(), limit_gb: 83 };
    for nth in [1, parts(false).await] {
        let world = World::new();
        let claim = world.announced(2).await;
        world.answers(PART, nth, u32::MAX - nth, too_large);
        let assembled = world.assemble(&world.joiner(), &claim).await.unwrap();
        assert_eq!((assembled.built, assembled.status), (0, Status::Refused));
        let reason = world.manifest().head.refusal.unwrap().reason.unwrap();
        assert!(reason.message.contains("83 GB"), "{}", reason.message);
        assert_eq!((world.gif(), world.uploads()), (None, 0));
        assert!(world.is_at_rest());
    }
}

/// After a transient error the next attempt continues it. If the upload is gone, it is started again. All other errors
/// are reported.
#[tokio::test]
async fn an_unfinished_gif_is_gone_on_with_unless_its_upload_is_gone() {
    let last = parts(true).await;
    for nth in [1, last] {
        for (error, stands) in [(throttled as fn() -> Error, true), (refused, false)] {
            let mut world = World::new();
            let claim = world.unfinished().await;
            world.answers(PART, nth, 1, error);
            let found = world.assemble(&world.joiner(), &claim).await.unwrap_err();
            assert!(is_like(&found, &error()), "{found:?}");
            assert_eq!(world.keys(CHECKPOINT).len(), usize::from(stands), "{nth}: {found:?}");
            assert_eq!(world.uploads(), usize::from(stands), "{nth}: {found:?}");
            world.try_again();
            let assembled = world.assemble(&world.slow(seconds(10)), &claim).await.unwrap();
            let expected = if stands { 70 } else { 120 };
            assert_eq!((assembled.built, assembled.building), (1, seconds(expected)), "{nth}");
            assert_eq!(world.gif(), Some(world.film_of(12)));
            assert!(world.is_at_rest());
        }
        let mut world = World::new();
        let claim = world.unfinished().await;
        world.answers(PART, nth, 1, not_found);
        assert_eq!(world.assemble(&world.joiner(), &claim).await.unwrap().built, 1);
        assert_eq!(world.gif(), Some(world.film_of(12)));
        assert!(world.is_at_rest());
    }
}

/// Either a frame cannot be read, however often it is requested, or an invocation had no time left for its first frame.
#[tokio::test]
async fn an_unfinished_gif_stands_when_an_invocation_comes_no_further() {
    let mut world = World::new();
    let claim = world.unfinished().await;
    world.refuse(|asked| asked.starts_with("get frames/film/7@").then(throttled));
    let error = world.assemble(&world.joiner(), &claim).await.unwrap_err();
    assert!(error.is_retryable() && world.keys(CHECKPOINT).len() == 1, "{error:?}");
    world.deadline = Some(world.store.clock.now().after(seconds(60)));
    let clock = world.store.clock.clone();
    world.refuse(move |asked| {
        clock.0.fetch_add(if asked.starts_with("get checkpoints/") { 50_000 } else { 0 }, Ordering::Relaxed);
        None
    });
    world.try_again();
    let error = world.assemble(&world.slow(seconds(10)), &claim).await.unwrap_err();
    assert!(error.is_out_of_time() && world.keys(CHECKPOINT).len() == 1, "{error:?}");
    world.refuse(|_| None);
    world.deadline = None;
    world.try_again();
    assert_eq!(world.assemble(&world.slow(seconds(10)), &claim).await.unwrap().building, seconds(70));
    assert_eq!(world.gif(), Some(world.film_of(12)));
    assert!(world.is_at_rest());
}

#[tokio::test]
async fn only_what_makes_the_same_gif_is_gone_on_with() {
    for (what, expected) in
        [("all is the same", 70), ("another set", 120), ("another GIF", 120), ("garbage", 120)]
    {
        let mut world = World::new();
        let claim = world.unfinished().await;
        match what {
            "another set" => drop(world.upload("1.txt", "frame 13").await),
            "another GIF" => world.put_gif("another"),
            "garbage" => drop(world.put(CHECKPOINT, "garbage")),
            _ => {}
        }
        let assembled = world.assemble(&world.slow(seconds(10)), &claim).await.unwrap();
        assert_eq!((assembled.built, assembled.building), (1, seconds(expected)), "{what}");
        assert!(world.keys(CHECKPOINT).is_empty());
        // The upload in garbage is unknown: the bucket's rule clears it away.
        assert_eq!(world.uploads(), usize::from(what == "garbage"), "{what}");
    }
}

/// The GIF is put only over the GIF that was read.
#[tokio::test]
async fn a_gif_that_comes_while_another_is_built_is_not_written_over_unseen() {
    for has_one in [false, true] {
        let world = World::new();
        let claim = world.announced(2).await;
        if has_one {
            world.put_gif("older");
        }
        let generation = world.manifest().head.generation.as_str().to_owned();
        let mut done = false;
        world.meddle(move |asked, bucket, now| {
            if asked.starts_with("get frames/film/2@") && !std::mem::replace(&mut done, true) {
                let options = PutOptions::always().metadata("generation", &generation);
                bucket.put(now, GIF, "another assembler's".into(), options).unwrap();
            }
        });
        let assembled = world.assemble(&world.joiner(), &claim).await.unwrap();
        assert_eq!(assembled.built, 0, "{has_one}");
        assert_eq!(world.gif().unwrap(), "another assembler's");
        assert!(world.is_at_rest());
    }
}
