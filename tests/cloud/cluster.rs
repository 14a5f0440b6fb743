//! `rayfold dev --endpoint`: the functions on a bucket of an S3 server that is running already, by one invoker or two.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use super::stage::stores::on_every_store;
use super::stage::{PATIENCE, frames, functions_beside, locally};
use rayfold_local::{S3Server, StoreKind, any_port};
use rayfold_pipeline::store::{ListRequest, PutOptions, S3Store, Store};

const RAYFOLD: &str = env!("CARGO_BIN_EXE_rayfold");
const BUCKET: &str = "films";

/// An S3 server that knows nothing of any invoker.
struct Server {
    server: S3Server,
    store: S3Store,
    _data: tempfile::TempDir,
}

impl Server {
    async fn start(kind: StoreKind) -> Self {
        let data = tempfile::tempdir().unwrap();
        let mut say = |line: &str| eprintln!("{line}");
        let server = S3Server::start(kind, data.path(), any_port(), None, &mut say).await.unwrap();
        let store = S3Store::at(&server.connection(), BUCKET);
        store.create_bucket().await.unwrap();
        Self { server, store, _data: data }
    }

    fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(RAYFOLD);
        let keys = self.server.environment().into_iter().filter(|(name, _)| name != "AWS_ENDPOINT_URL");
        command
            .args(["dev", "--endpoint", &self.server.endpoint(), "--concurrency", "1"])
            .args(args)
            .envs(keys)
            .env("RAYFOLD_FUNCTIONS", functions_beside(Path::new(RAYFOLD)))
            .stdin(Stdio::null());
        command
    }

    fn invoker(&self) -> Invoker {
        let mut child = self.command(&["--bucket", BUCKET]).stderr(Stdio::piped()).spawn().unwrap();
        let lines = BufReader::new(child.stderr.take().unwrap()).lines();
        let said = Arc::new(Mutex::new(Vec::new()));
        let says = said.clone();
        std::thread::spawn(move || {
            for line in lines.map_while(Result::ok) {
                says.lock().unwrap().push(line);
            }
        });
        Invoker { child, said }
    }

    async fn upload(&self, animation: &str, files: &[(&str, String)]) {
        for (name, text) in files {
            let key = format!("scripts/{animation}/{name}");
            self.store.put(&key, text.clone().into(), PutOptions::always()).await.unwrap();
        }
    }

    /// Counts the drawn frames.
    async fn frames(&self) -> usize {
        let page = self.store.list(ListRequest::all("frames/")).await.unwrap();
        page.objects.iter().filter(|object| object.key.ends_with(".png")).count()
    }

    async fn gif(&self, animation: &str, invokers: &[&Invoker]) -> bytes::Bytes {
        let start = Instant::now();
        loop {
            match self.store.get(&format!("animations/{animation}.gif")).await {
                Ok(object) => return object.body,
                Err(error) => assert!(error.is_not_found(), "{error:?}"),
            }
            if start.elapsed() > PATIENCE {
                let manifest = self.store.get(&format!("manifests/{animation}.json")).await;
                let said: Vec<_> = invokers.iter().map(|invoker| invoker.said()).collect();
                panic!("no GIF: {manifest:?}\n{said:#?}");
            }
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
    }
}

/// A process of `rayfold dev --endpoint`.
struct Invoker {
    child: Child,
    said: Arc<Mutex<Vec<String>>>,
}

impl Invoker {
    fn said(&self) -> Vec<String> {
        self.said.lock().unwrap().clone()
    }

    fn says(&self, words: &str) -> bool {
        self.said().iter().any(|line| line.contains(words))
    }

    fn drawn(&self) -> usize {
        self.said().iter().filter(|line| line.contains(": drawn in ")).count()
    }

    async fn until_it_says(&self, words: &str) {
        let start = Instant::now();
        while !self.says(words) {
            assert!(start.elapsed() < PATIENCE, "{words}: {:#?}", self.said());
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    }

    /// Sends a signal to the process, by its id.
    fn signal(&self, signal: &str) {
        let status = Command::new("kill").args([signal, &self.child.id().to_string()]).status().unwrap();
        assert!(status.success());
    }
}

impl Drop for Invoker {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Frames that take long enough for two invokers to meet.
fn film(count: usize) -> Vec<(&'static str, String)> {
    let script = |number: usize| {
        let name: &'static str = format!("{number}.txt").leak();
        let text = format!(
            "Screen 320 240\nSamples 8 0\nBackground .1 .2 .3\nSphere 60 {} 120 -90 .2 .2 .2 .7 .6 .5 .3 .3 .3\n\
             Sphere 30 90 200 -70 .1 .2 .1 .3 .8 .5\nIlight 1 1 1 .2 -.3 -1\nTrace\n",
            20 + number * 5
        );
        (name, text)
    };
    (1..=count).map(script).chain([frames(count)]).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn one_invoker_makes_what_is_in_the_bucket_into_a_gif_and_follows_changes() {
    on_every_store(async |store| {
        let server = Server::start(store).await;
        let mut files = film(3);
        // Before there is an invoker: the sweep at its start finds it.
        server.upload("a b/ü+1", &files).await;
        let mut invoker = server.invoker();
        assert!(server.gif("a b/ü+1", &[&invoker]).await == locally(&files), "the GIF is not the local one");

        // A deletion is an event as well.
        server.store.delete("scripts/a b/ü+1/2.txt").await.unwrap();
        files.remove(1);
        files[2] = frames(2);
        server.upload("a b/ü+1", &files[2..]).await;
        let (start, expected) = (Instant::now(), locally(&files));
        while server.gif("a b/ü+1", &[&invoker]).await != expected {
            assert!(start.elapsed() < PATIENCE, "the GIF keeps a deleted script: {:#?}", invoker.said());
            tokio::time::sleep(Duration::from_millis(100)).await;
        }

        invoker.signal("-INT");
        assert!(invoker.child.wait().unwrap().success(), "{:#?}", invoker.said());
        let left = server.store.list(ListRequest::all("invokers/")).await.unwrap();
        assert!(left.objects.is_empty(), "{left:?}");
    })
    .await;
}

/// The frames of the animation that two invokers share.
const FRAMES: usize = 40;

/// Starts two invokers on one bucket and uploads an animation, whose files are returned.
async fn two_invokers_with_a_film(
    store: StoreKind,
) -> (Server, Invoker, Invoker, Vec<(&'static str, String)>) {
    let server = Server::start(store).await;
    let (a, b) = (server.invoker(), server.invoker());
    a.until_it_says("shares the work").await;
    b.until_it_says("shares the work").await;
    let files = film(FRAMES);
    server.upload("film", &files).await;
    (server, a, b, files)
}

#[tokio::test(flavor = "multi_thread")]
async fn two_invokers_share_the_frames_of_an_animation() {
    on_every_store(async |store| {
        let (server, a, b, files) = two_invokers_with_a_film(store).await;
        assert!(server.gif("film", &[&a, &b]).await == locally(&files), "the GIF is not the local one");
        let drawn = [a.drawn(), b.drawn()];
        eprintln!("{FRAMES} frames on {store}: drawn {drawn:?}");
        assert!(drawn.iter().all(|drawn| *drawn >= FRAMES / 5), "one has done the work: {drawn:?}");
        assert!(drawn.iter().sum::<usize>() <= FRAMES + FRAMES / 10, "frames were drawn twice: {drawn:?}");
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_work_of_a_killed_invoker_is_taken_over() {
    on_every_store(async |store| {
        let (server, a, b, files) = two_invokers_with_a_film(store).await;
        let start = Instant::now();
        while b.drawn() == 0 || server.frames().await < FRAMES / 5 {
            assert!(start.elapsed() < PATIENCE, "{:#?} {:#?}", a.said(), b.said());
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
        b.signal("-KILL");
        let at = server.frames().await;
        assert!(at < FRAMES, "all was drawn before the kill");
        assert!(server.gif("film", &[&a, &b]).await == locally(&files), "the GIF is not the local one");
        let drawn = [a.drawn(), b.drawn()];
        eprintln!("{FRAMES} frames on {store}, one killed after {at}: drawn {drawn:?}");
        assert!(a.says("has gone"), "{:#?}", a.said());
    })
    .await;
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[tokio::test(flavor = "multi_thread")]
async fn what_keeps_it_from_starting_is_said() {
    on_every_store(async |store| {
        let server = Server::start(store).await;
        let missing = server.command(&["--bucket", "missing"]).output().unwrap();
        let expected = format!("aws s3 mb s3://missing --endpoint-url {}", server.server.endpoint());
        assert_eq!(missing.status.code(), Some(1));
        assert!(said(&missing).contains(&expected), "{}", said(&missing));

        let wrong =
            server.command(&["--bucket", BUCKET]).env("AWS_SECRET_ACCESS_KEY", "wrong").output().unwrap();
        assert_eq!(wrong.status.code(), Some(1));
        for part in ["refuses access to the bucket films", "AWS_SECRET_ACCESS_KEY", "SignatureDoesNotMatch"] {
            assert!(said(&wrong).contains(part), "{}", said(&wrong));
        }

        let mut nowhere = server.command(&["--bucket", BUCKET]);
        server.server.stop().await;
        let nowhere = nowhere.output().unwrap();
        assert_eq!(nowhere.status.code(), Some(1));
        assert!(said(&nowhere).contains("cannot reach http://127.0.0.1:"), "{}", said(&nowhere));
    })
    .await;
    let no_url = Command::new(RAYFOLD).args(["dev", "--endpoint", "127.0.0.1:9000"]).output().unwrap();
    assert_eq!(no_url.status.code(), Some(2));
    assert!(said(&no_url).contains("http://"), "{}", said(&no_url));
}
