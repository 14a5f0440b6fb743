//! The real parts as processes that can be killed: this test program, started again to be the store or the invoker.
//!
//! A part ends with its test, however that ends: it lives as long as a pipe that the test holds.

use std::io::{BufRead, BufReader};
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use fastrand::Rng;
use rayfold_local::invoker::{Chaos, Fate, Fates, Invoker, Settings};
use rayfold_local::observation::{Observation, Outcome, Seen};
use rayfold_local::routes::Routes;
use rayfold_local::{Functions, S3Server, StoreKind, Webhook, any_port};
use rayfold_pipeline::store::{Connection, S3Store};

use crate::stage::{ALL_ITS_TIME, SMALL_MB};
use crate::tally::noting;

/// What a process of this program is to be, and in which folder.
const PART: &str = "RAYFOLD_CHAOS_PART";
const FOLDER: &str = "RAYFOLD_CHAOS_FOLDER";

/// On which store, as `rayfold dev --store` has it; the processes inherit it.
const STORE: &str = "RAYFOLD_CHAOS_STORE";

/// What it is told besides, as JSON.
const TOLD: &str = "RAYFOLD_CHAOS_TOLD";

/// Comes before what a part says; the test runner says other things on the same line.
const SAYS: &str = "the part says: ";

/// What the store tells the invoker with each event.
const TOKEN: &str = "chaos";

const BUCKET: &str = "rayfold";

/// How long a part may take to start on a loaded machine. One that starts on a full disk may never come.
const START: Duration = Duration::from_secs(60);

/// Where Debian's package `libfaketime` has the library that lies about the time.
const LYING_CLOCKS: [&str; 2] = [
    "/usr/lib/x86_64-linux-gnu/faketime/libfaketime.so.1",
    "/usr/lib/aarch64-linux-gnu/faketime/libfaketime.so.1",
];

/// The library that lies about the time, if it is installed.
pub(crate) fn lying_clock() -> Option<&'static Path> {
    LYING_CLOCKS.map(Path::new).into_iter().find(|path| path.exists())
}

/// The store that the round is on: the one built in unless the environment names another.
pub(crate) fn store_kind() -> StoreKind {
    let Ok(name) = std::env::var(STORE) else { return StoreKind::default() };
    StoreKind::named(&name).unwrap_or_else(|| panic!("{STORE}={name}: expected built-in or minio"))
}

/// How a part's process is started.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Ground {
    /// No file grows beyond so many blocks of 1,024 bytes: beyond it a write fails as on a full disk.
    pub(crate) largest_file: Option<u64>,
    /// Its clock is what [`set_clock`] says.
    pub(crate) lying_clock: bool,
}

/// What the invoker is told.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct InvokerTold {
    /// The way to the store.
    pub(crate) store: SocketAddr,
    pub(crate) region: String,
    pub(crate) access_key: String,
    pub(crate) secret_key: String,
    /// GIFs are built by several assemblers, each of which adds a frame.
    pub(crate) in_pieces: bool,
    /// Of what goes wrong; nothing does without.
    pub(crate) seed: Option<u64>,
}

/// A process.
pub(crate) struct Part {
    child: Child,
    /// While it is open the part lives.
    _line: ChildStdin,
}

impl Part {
    /// Starts the store; nothing if it ends before it answers, as on a full disk. Also says how its owner reaches it.
    pub(crate) fn store(folder: &Path, webhook: SocketAddr, ground: Ground) -> Option<(Self, Connection)> {
        let (part, said) = start("store", folder, &webhook.to_string(), ground)?;
        let mut words = said.split(' ').map(str::to_owned);
        let mut word = || words.next().unwrap_or_default();
        let (endpoint, region, access_key, secret_key) = (word(), word(), word(), word());
        Some((part, Connection { endpoint, region, access_key, secret_key, session_token: None }))
    }

    /// Starts the invoker. Also says where it hears events.
    pub(crate) fn invoker(folder: &Path, told: &InvokerTold, ground: Ground) -> (Self, SocketAddr) {
        let told = serde_json::to_string(told).unwrap();
        let (part, said) = start("invoker", folder, &told, ground).expect("the invoker does not start");
        (part, said.parse().unwrap())
    }

    /// As `kill -9` does.
    pub(crate) fn kill(mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }
}

impl Drop for Part {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn clock_file(folder: &Path, name: &str) -> PathBuf {
    folder.join(format!("clock-{name}"))
}

/// Sets the clock of a part, and of what it has started, so many seconds ahead.
pub(crate) fn set_clock(folder: &Path, name: &str, ahead: i64) {
    let file = clock_file(folder, name);
    let next = file.with_extension("next");
    std::fs::write(&next, format!("{ahead:+}s\n")).unwrap();
    std::fs::rename(&next, &file).unwrap();
}

/// The environment in which a program's clock is what a file says.
fn lies(folder: &Path, name: &str) -> Vec<(String, String)> {
    let Some(library) = lying_clock() else { return Vec::new() };
    let file = clock_file(folder, name);
    let pairs = [
        ("LD_PRELOAD", library.to_str().unwrap()),
        ("FAKETIME_TIMESTAMP_FILE", file.to_str().unwrap()),
        ("FAKETIME_CACHE_DURATION", "1"),
        // Steady clocks stay steady: timers know nothing of the time of day.
        ("FAKETIME_DONT_FAKE_MONOTONIC", "1"),
    ];
    pairs.map(|(name, value)| (name.to_owned(), value.to_owned())).to_vec()
}

fn start(name: &str, folder: &Path, told: &str, ground: Ground) -> Option<(Part, String)> {
    let limit = ground.largest_file.map_or("unlimited".to_owned(), |blocks| blocks.to_string());
    // The shell's limit outlives it, and so does the signal that it ignores.
    let script = format!("trap '' XFSZ; ulimit -f {limit}; exec env \"$@\"");
    let mut command = Command::new("bash");
    command.args(["-c", &script, "part"]);
    if ground.lying_clock {
        command.args(lies(folder, name).iter().map(|(name, value)| format!("{name}={value}")));
    }
    command.arg(std::env::current_exe().unwrap()).args([crate::TEST, "--exact", "--nocapture"]);
    command.env(PART, name).env(FOLDER, folder).env(TOLD, told);
    command.env("RAYFOLD_CHAOS_LIES", if ground.lying_clock { "yes" } else { "no" });
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    let line = child.stdin.take().unwrap();
    let lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let (say, said) = mpsc::channel();
    std::thread::spawn(move || {
        // To the end, so that nobody writes into a pipe that is closed.
        for line in lines.map_while(Result::ok) {
            if let Some((_, says)) = line.split_once(SAYS) {
                // Nobody waits any more for a part that came too late.
                let _ = say.send(says.to_owned());
            }
        }
    });
    let part = Part { child, _line: line };
    let said = said.recv_timeout(START).ok()?;
    Some((part, said))
}

/// Is the part that this process was started to be; says whether it was one.
pub(crate) async fn is_part() -> bool {
    let Ok(part) = std::env::var(PART) else { return false };
    let folder = PathBuf::from(std::env::var(FOLDER).unwrap());
    let told = std::env::var(TOLD).unwrap();
    match part.as_str() {
        "store" => be_store(&folder, &told).await,
        "invoker" => be_invoker(&folder, &serde_json::from_str(&told).unwrap()).await,
        other => panic!("there is no part {other}"),
    }
    true
}

#[expect(clippy::print_stdout, reason = "what the test listens to")]
async fn say_and_stay(what: &str) {
    println!("{SAYS}{what}");
    tokio::task::spawn_blocking(|| std::io::stdin().read_line(&mut String::new())).await.unwrap().unwrap();
}

async fn be_store(folder: &Path, webhook: &str) {
    let hook = Webhook { url: format!("http://{webhook}/events"), token: TOKEN.into() };
    let data = folder.join("data");
    let server = S3Server::start(store_kind(), &data, any_port(), Some(hook), &mut |_| {}).await;
    let server = server.unwrap();
    let connection = server.connection();
    let store = S3Store::at(&connection, BUCKET);
    store.create_bucket().await.unwrap();
    let notifications = Routes::shared().notifications(server.queue_arn());
    rayfold_local::notify(&store, &notifications).await.unwrap();
    let Connection { endpoint, region, access_key, secret_key, .. } = connection;
    say_and_stay(&format!("{endpoint} {region} {access_key} {secret_key}")).await;
}

async fn be_invoker(folder: &Path, told: &InvokerTold) {
    let note = noting(folder);
    let functions = Path::new(env!("CARGO_BIN_EXE_rayfold-render")).parent().unwrap();
    let functions = Functions::in_folder(functions);
    let mut settings = Settings::new(functions, told.store, any_port(), TOKEN.into());
    settings.concurrency = 4;
    settings.memory_mb = SMALL_MB;
    settings.timeout = Duration::from_secs(20);
    settings.retry_pauses = vec![Duration::from_millis(50), Duration::from_millis(100)];
    settings.sweep_every = Some(Duration::from_secs(3));
    settings.kept_events = Some(Duration::from_millis(1_200));
    let environment = [
        ("AWS_REGION", told.region.as_str()),
        ("AWS_ACCESS_KEY_ID", &told.access_key),
        ("AWS_SECRET_ACCESS_KEY", &told.secret_key),
        ("RAYFOLD_BUCKET", BUCKET),
        ("RAYFOLD_QUIET_MS", "300"),
        ("RAYFOLD_STUCK_AFTER_MS", "2000"),
    ];
    settings.environment = environment.map(|(name, value)| (name.to_owned(), value.to_owned())).to_vec();
    if told.in_pieces {
        settings.environment.push(("RAYFOLD_SPARE_FRAMES".into(), ALL_ITS_TIME.into()));
    }
    if std::env::var("RAYFOLD_CHAOS_LIES").is_ok_and(|lies| lies == "yes") {
        settings.environment.extend(lies(folder, "invoker"));
    }
    if let Some(seed) = told.seed {
        settings.chaos = chaos(seed);
        settings.fates = Some(fates(seed, note.clone()));
    }
    let (sender, mut seen) = tokio::sync::mpsc::unbounded_channel::<Observation>();
    tokio::spawn(async move {
        while let Some(observation) = seen.recv().await {
            match observation.seen {
                Seen::Started(_) => note("invocations"),
                Seen::Finished { outcome: Outcome::Crashed(_), .. } => note("functions killed"),
                Seen::Finished { outcome: Outcome::TimedOut, .. } => note("functions out of time"),
                Seen::Finished { outcome: Outcome::Failed(_), .. } => note("invocations failed"),
                Seen::DeadLetter { .. } => note("dead letters"),
                Seen::Log { line, .. } => note_of(&line).into_iter().for_each(&note),
                Seen::Finished { .. } | Seen::Event { .. } | Seen::Requested { .. } => {}
            }
        }
    });
    let invoker = Invoker::start(settings, Some(sender)).await.unwrap();
    say_and_stay(&invoker.webhook().to_string()).await;
}

/// What a line of a function's log is counted as.
fn note_of(line: &str) -> Option<&'static str> {
    let line: serde_json::Value = serde_json::from_str(line).ok()?;
    let outcome = line["outcome"].as_str().unwrap_or_default();
    if line.get("left_after").is_some_and(|after| !after.is_null()) {
        return Some("GIFs left for the next assembler");
    }
    outcome.starts_with("cut into").then_some("frames cut into bands")
}

fn chaos(seed: u64) -> Chaos {
    Chaos {
        seed,
        duplicate: 0.1,
        delay: 0.2,
        delay_up_to: Duration::from_millis(500),
        reverse_after: None,
        drop: 0.04,
        kill: 0.05,
        kill_within: Duration::from_millis(300),
    }
}

fn fates(seed: u64, note: impl Fn(&str) + Send + Sync + 'static) -> Fates {
    let dice = Mutex::new(Rng::with_seed(seed ^ 2));
    Arc::new(move |_, _| match dice.lock().unwrap().u32(0..100) {
        0 => Fate::KillBefore,
        1 => Fate::KillAfter,
        2 | 3 => {
            note("functions: answers lost");
            Fate::LoseAnswer
        }
        4 | 5 => {
            note("functions: 503s");
            Fate::SlowDown
        }
        _ => Fate::Pass,
    })
}
