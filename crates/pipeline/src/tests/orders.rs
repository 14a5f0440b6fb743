//! The order of requests. A request that comes too early sees the old state, and an invocation that is killed between
//! two requests must leave a state that can be repaired.

use super::assemblies::{CHECKPOINT, GIF, LEASE, seconds};
use super::*;

const SCRIPT: &str = "scripts/film/1.txt";
const MANIFEST: &str = "manifests/film.json";

/// The requests that were sent, in their order.
#[derive(Clone, Default)]
struct Sent(Arc<Mutex<Vec<String>>>);

impl Sent {
    /// Returns the positions of the requests that begin with one text and contain another.
    fn places(&self, start: &str, within: &str) -> Vec<usize> {
        let sent = self.0.lock().unwrap();
        let is_it = |request: &String| request.starts_with(start) && request.contains(within);
        let places: Vec<_> =
            (0..).zip(&*sent).filter(|(_, request)| is_it(request)).map(|(k, _)| k).collect();
        assert!(!places.is_empty(), "no {start}…{within} among {sent:?}");
        places
    }

    /// Checks that the last request of the first kind comes before the first request of the other kind.
    #[track_caller]
    fn comes_before(&self, (start, within): (&str, &str), (next, within_next): (&str, &str)) {
        let (first, then) = (self.places(start, within), self.places(next, within_next));
        assert!(first.last() < then.first(), "{:?}", self.0.lock().unwrap());
    }
}

impl World {
    fn sent(&self) -> Sent {
        let sent = Sent::default();
        let listener = sent.0.clone();
        self.refuse(move |request| {
            listener.lock().unwrap().push(request.to_owned());
            None
        });
        sent
    }

    fn version(&self, key: &str) -> ETag {
        self.store.bucket.lock().unwrap().head(key).unwrap().etag
    }
}

/// An invocation that finds a script split triggers only parts that are late.
#[tokio::test]
async fn a_script_is_split_when_its_parts_are_there() {
    let world = World::new();
    let sent = world.sent();
    world.upload("1.txt", "split 3 1").await;
    sent.comes_before(("put parts/", ".json"), ("put frames/", ".split-3"));
}

/// A band that comes before the cut finds no invocation that triggers the others.
#[tokio::test]
async fn a_frame_is_cut_before_its_bands_are_woken() {
    let world = World::new();
    let sent = world.sent();
    world.upload("1.txt", "big frame 1").await;
    sent.comes_before(("put frames/", ".cut-3"), ("put parts/", ".band-0.json"));
}

/// A GIF that appears after the listing belongs to a later one, and would be overwritten.
#[tokio::test]
async fn an_assembler_reads_the_manifest_then_the_gif_and_then_lists() {
    let world = World::new();
    let claim = world.announced(1).await;
    world.put_gif(world.manifest().head.generation.as_str());
    let sent = world.sent();
    assert_eq!(world.assemble(&world.joiner(), &claim).await.unwrap().built, 0);
    sent.comes_before(("get ", MANIFEST), ("head ", GIF));
    sent.comes_before(("head ", GIF), ("list ", "film/"));
}

/// An invocation in between either reads a valid manifest, or one that is already set aside.
#[tokio::test]
async fn what_cannot_be_read_is_set_aside_before_its_place_is_taken() {
    let world = World::new();
    world.put(MANIFEST, "garbage");
    let sent = world.sent();
    world.upload("1.txt", "frame 1").await;
    sent.comes_before(("put manifests/", ".json~"), ("put assemblies/", ""));
    let puts = sent.places("put manifests/", "");
    assert_eq!(sent.places("put manifests/", ".json~"), puts[..1]);
}

/// An assembler that is invoked too early finds the lease taken, and exits.
#[tokio::test]
async fn the_next_assembler_is_woken_when_the_lease_is_free() {
    let mut world = World::new();
    world.policy.spare_frames = 1;
    let claim = world.announced(12).await;
    world.deadline = Some(world.store.clock.now().after(seconds(60)));
    let sent = world.sent();
    let assembled = world.assemble(&world.slow(seconds(10)), &claim).await.unwrap();
    assert_eq!(assembled.left_after, Some(5));
    sent.comes_before(("put checkpoints/", ""), ("put assemblies/", ""));
    sent.comes_before(("put ", LEASE), ("put assemblies/", ""));

    let mut world = World::new();
    world.upload("1.txt", "frame 1").await;
    let claim = world.keys("assemblies/").pop().unwrap();
    world.deadline = Some(world.store.clock.now().after(world.policy.margin));
    let sent = world.sent();
    assert_eq!(world.assemble(&world.joiner(), &claim).await.unwrap().built, 0);
    sent.comes_before(("delete ", LEASE), ("put assemblies/", ""));
}

/// Once the lease is free, the checkpoint may belong to another assembler.
#[tokio::test]
async fn what_is_unfinished_is_given_up_before_the_lease() {
    let mut world = World::new();
    world.policy.spare_frames = 1;
    let claim = world.announced(6).await;
    world.deadline = Some(world.store.clock.now().after(seconds(60)));
    world.assemble(&world.slow(seconds(10)), &claim).await.unwrap();
    world.deadline = None;
    world.upload("1.txt", "bad 1").await;
    let sent = world.sent();
    world.assemble(&world.joiner(), &claim).await.unwrap();
    sent.comes_before(("delete ", CHECKPOINT), ("delete ", LEASE));
    sent.comes_before(("abort ", GIF), ("delete ", LEASE));
}

/// An invocation that is triggered too early finds the result that is about to be deleted, and draws nothing.
#[tokio::test]
async fn what_is_to_be_drawn_again_is_deleted_before_it_is_woken() {
    let world = World::new();
    let claim = world.announced(1).await;
    let frame = world.keys("frames/film/1@").pop().unwrap();
    world.put(&frame, "garbled");
    let sent = world.sent();
    world.assemble(&world.joiner(), &claim).await.unwrap();
    sent.comes_before(("delete frames/", ".png"), ("put retries/", ""));

    let world = World::new();
    let version = world.put(SCRIPT, "bad 1");
    world.put(&format!("frames/film/1@{version}-p1.error.json"), "garbage");
    let sent = world.sent();
    assert_eq!(world.visit().await.woken, 1);
    sent.comes_before(("delete frames/", ".error.json"), ("put retries/", ""));

    let world = World::new();
    world.upload("1.txt", "bad 1").await;
    let version = world.version(SCRIPT);
    world.put(&format!("retries/film/1@{version}-p1/1"), "");
    world.put(&format!("frames/film/1@{version}-p1.begun-1"), "");
    let sent = world.sent();
    world.with(async |invocation| retry(invocation, &World::film(), Scope::Failed).await.unwrap()).await;
    sent.comes_before(("delete ", ""), ("put retries/", ""));
    sent.comes_before(("put retries/", ""), ("put manifests/", ""));
}
