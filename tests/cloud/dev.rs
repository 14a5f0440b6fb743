//! `rayfold dev` from the user's side: started, used through the SDK, interrupted, killed, started again.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use super::stage::stores::on_every_store;
use rayfold_local::StoreKind;
use rayfold_pipeline::store::{Connection, PutOptions, S3Store, Store};

const RAYFOLD: &str = env!("CARGO_BIN_EXE_rayfold");

/// Longer than anything here takes on a loaded machine, including a build of the functions.
const PATIENCE: Duration = Duration::from_secs(600);

/// Returns the command with the functions that were built with this test. Without them `rayfold dev` builds them
/// itself.
fn dev() -> Command {
    let mut command = Command::new(RAYFOLD);
    command.arg("dev");
    let beside = Path::new(RAYFOLD).parent().unwrap();
    if beside.join("rayfold-render").is_file() && beside.join("rayfold-assemble").is_file() {
        command.env("RAYFOLD_FUNCTIONS", beside);
    }
    command
}

struct Dev {
    child: Child,
    exports: BTreeMap<String, String>,
    sync: String,
}

impl Dev {
    fn start(store: StoreKind, data: &Path) -> Self {
        let mut command = dev();
        command.arg("--data").arg(data).args(["--address", "127.0.0.1:0", "--concurrency", "4"]);
        match store {
            // The default, without an option.
            StoreKind::BuiltIn => {}
            StoreKind::Minio | StoreKind::SeaweedFs => drop(command.args(["--store", store.name()])),
        }
        Self::of(command)
    }

    /// Reads the environment variables that the program prints, up to the line with the next step.
    fn of(mut command: Command) -> Self {
        let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let mut exports = BTreeMap::new();
        let sync = loop {
            let line = lines.next().expect("it prints what to set").unwrap();
            match line.strip_prefix("export ").and_then(|pair| pair.split_once('=')) {
                Some((name, value)) => drop(exports.insert(name.to_owned(), value.to_owned())),
                None => break line,
            }
        };
        Self { child, exports, sync }
    }

    fn store(&self) -> S3Store {
        let of = |name: &str| self.exports[name].clone();
        let connection = Connection {
            endpoint: of("AWS_ENDPOINT_URL"),
            region: of("AWS_REGION"),
            access_key: of("AWS_ACCESS_KEY_ID"),
            secret_key: of("AWS_SECRET_ACCESS_KEY"),
            session_token: None,
        };
        S3Store::at(&connection, "rayfold")
    }

    /// Sends a signal to the process id, like a terminal's Ctrl-C or an administrator.
    fn signal(&self, signal: &str) {
        let status = Command::new("kill").args([signal, &self.child.id().to_string()]).status().unwrap();
        assert!(status.success());
    }
}

impl Drop for Dev {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

async fn put(store: &S3Store, key: &str, body: Vec<u8>) {
    store.put(key, body.into(), PutOptions::always()).await.unwrap();
}

async fn gif(store: &S3Store, key: &str) -> bytes::Bytes {
    let start = Instant::now();
    loop {
        match store.get(key).await {
            Ok(object) => return object.body,
            Err(error) => assert!(error.is_not_found() && start.elapsed() < PATIENCE, "{key}: {error:?}"),
        }
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
}

/// Returns whether the S3 server replies.
async fn answers(store: &S3Store) -> bool {
    store.check().await.is_ok()
}

#[tokio::test]
async fn it_goes_on_where_it_was_after_a_kill_and_leaves_nothing_behind() {
    on_every_store(async |store| {
        let folder = tempfile::tempdir().unwrap();
        let data = folder.path().join("data");
        let ball = "Screen 24 16\nBackground .2 .2 .2\nSphere 6 12 8 -9 .2 .2 .2 .7 .6 .5\nTrace\n";

        let dev = Dev::start(store, &data);
        assert_eq!(dev.sync, "aws s3 sync scenes/hello s3://rayfold/scripts/hello/");
        let bucket = dev.store();
        put(&bucket, "scripts/ball/animation.json", b"{\"frames\": 2}".to_vec()).await;
        put(&bucket, "scripts/ball/a.txt", ball.into()).await;
        dev.signal("-KILL");
        let start = Instant::now();
        while answers(&bucket).await {
            assert!(start.elapsed() < PATIENCE, "the S3 server outlives a killed `rayfold dev`");
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
        let exports = dev.exports.clone();
        drop(dev);

        let mut dev = Dev::start(store, &data);
        assert_eq!(
            dev.exports["AWS_SECRET_ACCESS_KEY"], exports["AWS_SECRET_ACCESS_KEY"],
            "credentials are kept"
        );
        let bucket = dev.store();
        assert_eq!(bucket.get("scripts/ball/a.txt").await.unwrap().body, ball, "objects are kept");
        put(&bucket, "scripts/ball/b.txt", ball.replace("12 8", "8 8").into()).await;
        assert!(gif(&bucket, "animations/ball.gif").await.starts_with(b"GIF89a"));
        dev.signal("-INT");
        assert!(dev.child.wait().unwrap().success());
        assert!(!answers(&bucket).await, "Ctrl-C stops the S3 server too");
    })
    .await;
}

/// Returns the names and the ids of the processes that a process has started.
#[cfg(target_os = "linux")]
fn children(of: u32) -> Vec<(String, u32)> {
    let stats = std::fs::read_dir("/proc").unwrap().flatten();
    let stats = stats.filter_map(|entry| std::fs::read_to_string(entry.path().join("stat")).ok());
    let child = |stat: String| {
        let (pid, rest) = stat.split_once(" (")?;
        let (name, rest) = rest.rsplit_once(") ")?;
        let parent: u32 = rest.split(' ').nth(1)?.parse().ok()?;
        (parent == of).then(|| (name.to_owned(), pid.parse().unwrap()))
    };
    stats.filter_map(child).collect()
}

/// The functions of a killed `rayfold dev` drew on, for minutes and on all cores.
#[cfg(target_os = "linux")]
#[tokio::test]
async fn functions_end_with_a_killed_invoker_also_while_they_draw() {
    let folder = tempfile::tempdir().unwrap();
    let dev = Dev::start(StoreKind::BuiltIn, &folder.path().join("data"));
    let ball = "Screen 4000 4000\nSamples 4096 0\nSphere 6 12 8 -9 .2 .2 .2 .7 .6 .5\nTrace\n";
    put(&dev.store(), "scripts/ball/1.txt", ball.into()).await;
    let start = Instant::now();
    let render = loop {
        assert!(start.elapsed() < PATIENCE, "no function is started");
        let children = children(dev.child.id());
        if let Some((_, pid)) = children.iter().find(|(name, _)| name.starts_with("rayfold-render")) {
            break *pid;
        }
        tokio::time::sleep(Duration::from_millis(50)).await;
    };
    // It draws.
    tokio::time::sleep(Duration::from_secs(2)).await;
    dev.signal("-KILL");
    let start = Instant::now();
    while Path::new("/proc").join(render.to_string()).join("exe").read_link().is_ok() {
        assert!(start.elapsed() < Duration::from_secs(20), "the function outlives a killed `rayfold dev`");
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
}

/// A folder of scripts, a path for the GIF, and a folder for temporary files.
struct Once {
    folder: tempfile::TempDir,
}

impl Once {
    fn new(frames: u32, screen: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        for name in ["ball", "temporary"] {
            std::fs::create_dir(folder.path().join(name)).unwrap();
        }
        for frame in 1..=frames {
            let text = format!("Screen {screen}\nSphere 6 {frame} 8 -9 .2 .2 .2 .7 .6 .5\nTrace\n");
            std::fs::write(folder.path().join(format!("ball/{frame}.txt")), text).unwrap();
        }
        Self { folder }
    }

    fn command(&self) -> Command {
        let mut command = dev();
        command.current_dir(self.folder.path()).env("TMPDIR", self.folder.path().join("temporary"));
        command.args(["ball", "-o", "out.gif"]);
        command
    }

    fn names(&self, below: &str) -> Vec<String> {
        let entries = std::fs::read_dir(self.folder.path().join(below)).unwrap();
        let mut names: Vec<_> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// Checks that there are no new files except the GIF, if there should be one.
    #[track_caller]
    fn leaves(&self, has_gif: bool) {
        assert_eq!(self.names("temporary"), [""; 0]);
        let expected: &[&str] =
            if has_gif { &["ball", "out.gif", "temporary"] } else { &["ball", "temporary"] };
        assert_eq!(self.names(""), expected);
    }
}

#[test]
fn one_command_makes_a_folder_into_its_gif_and_leaves_nothing_else() {
    let once = Once::new(3, "24 16");
    let done = once.command().output().unwrap();
    let said = String::from_utf8(done.stderr).unwrap();
    assert!(done.status.success(), "{said}");
    assert!(done.stdout.is_empty() && said.contains("out.gif"), "{said}");
    once.leaves(true);
    let made = std::fs::read(once.folder.path().join("out.gif")).unwrap();
    let by_hand = once.folder.path().join("rendered.gif");
    let status = Command::new(RAYFOLD)
        .arg("render")
        .arg(once.folder.path().join("ball"))
        .arg("-o")
        .arg(&by_hand)
        .status()
        .unwrap();
    assert!(status.success());
    assert!(made == std::fs::read(by_hand).unwrap(), "the GIF is another one than that of `rayfold render`");
}

/// The functions reject the script, or it is rejected before anything starts.
#[test]
fn one_command_that_fails_says_why_and_leaves_nothing() {
    let once = Once::new(2, "24 16");
    let failed = once.command().env("RAYFOLD_MAX_PIXELS", "100").output().unwrap();
    let said = String::from_utf8(failed.stderr).unwrap();
    assert_eq!(failed.status.code(), Some(1), "{said}");
    assert!(said.contains("ball is failed") && said.contains("1.txt"), "{said}");
    once.leaves(false);
    std::fs::write(once.folder.path().join("ball/2.txt"), "Sphere\n").unwrap();
    let refused = once.command().output().unwrap();
    let said = String::from_utf8(refused.stderr).unwrap();
    assert!(refused.status.code() == Some(1) && said.contains("2.txt"), "{said}");
    once.leaves(false);
}

#[test]
fn one_command_that_is_interrupted_leaves_nothing() {
    let once = Once::new(200, "640 480");
    let mut child = once.command().stderr(Stdio::null()).spawn().unwrap();
    let start = Instant::now();
    while once.names("temporary").is_empty() {
        assert!(start.elapsed() < PATIENCE, "it does not start");
        std::thread::sleep(Duration::from_millis(20));
    }
    std::thread::sleep(Duration::from_secs(1));
    let status = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(status.success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    once.leaves(false);
}

#[tokio::test]
async fn one_command_that_is_kept_serves_on_until_it_is_interrupted() {
    let once = Once::new(2, "24 16");
    let mut command = once.command();
    command.arg("--keep");
    let mut dev = Dev::of(command);
    assert!(once.names("").contains(&"out.gif".to_owned()), "the GIF comes first");
    let bucket = dev.store();
    assert!(bucket.get("animations/ball.gif").await.unwrap().body.starts_with(b"GIF89a"));
    dev.signal("-INT");
    assert!(dev.child.wait().unwrap().success());
    once.leaves(true);
}
