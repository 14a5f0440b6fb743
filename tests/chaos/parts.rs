//! The real parts as processes that can be killed. They are this test program, started again as the store or as the
//! invoker.
//!
//! A part ends with its test in any case: it runs only as long as the test holds a pipe open.

use std::io::{BufRead, BufReader};
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use fastrand::Rng;
use rayfold_local::invoker::{Chaos, Fate, Fates, Invoker, Listing, Settings};
use rayfold_local::observation::{Observation, Outcome, Seen};
use rayfold_local::routes::Routes;
use rayfold_local::{Functions, S3Server, StoreKind, Webhook, any_port};
use rayfold_pipeline::store::{Connection, S3Store};

use crate::stage::{ALL_ITS_TIME, SMALL_MB};
use crate::tally::noting;

/// The variables for the part that a process is, and for its folder.
const PART: &str = "RAYFOLD_CHAOS_PART";
const FOLDER: &str = "RAYFOLD_CHAOS_FOLDER";

/// The variable for the store, with the values of `rayfold dev --store`. The processes inherit it.
const STORE: &str = "RAYFOLD_CHAOS_STORE";

/// The variable for further parameters, as JSON.
const CONFIG: &str = "RAYFOLD_CHAOS_CONFIG";

/// The prefix of a part's output. The test runner writes other text on the same line.
const SAYS: &str = "the part says: ";

/// The token that the store sends to the invoker with each event.
const TOKEN: &str = "chaos";

const BUCKET: &str = "rayfold";

/// The time limit for the start of a part on a loaded machine. On a full disk a part may never start.
const START: Duration = Duration::from_secs(60);

/// The paths of the library that falsifies the time, in Debian's package `libfaketime`.
const LYING_CLOCKS: [&str; 2] = [
    "/usr/lib/x86_64-linux-gnu/faketime/libfaketime.so.1",
    "/usr/lib/aarch64-linux-gnu/faketime/libfaketime.so.1",
];

/// Returns the library that falsifies the time, if it is installed.
pub(crate) fn lying_clock() -> Option<&'static Path> {
    LYING_CLOCKS.map(Path::new).into_iter().find(|path| path.exists())
}

/// Returns the store of the round: the built-in one unless the environment names another.
pub(crate) fn store_kind() -> StoreKind {
    let Ok(name) = std::env::var(STORE) else { return StoreKind::default() };
    StoreKind::named(&name).unwrap_or_else(|| panic!("{STORE}={name}: expected built-in, minio or seaweedfs"))
}

/// The conditions in which a part's process is started.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Ground {
    /// The largest size of a file, in blocks of 1,024 bytes. A larger write fails like on a full disk.
    pub(crate) largest_file: Option<u64>,
    /// Whether [`set_clock`] controls its clock.
    pub(crate) lying_clock: bool,
}

/// The parameters of the invoker.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct InvokerConfig {
    /// The address of the store.
    pub(crate) store: SocketAddr,
    pub(crate) region: String,
    pub(crate) access_key: String,
    pub(crate) secret_key: String,
    /// Whether GIFs are built by several assemblers, each of which adds a frame.
    pub(crate) in_pieces: bool,
    /// The seed of the faults; `None` for no faults.
    pub(crate) seed: Option<u64>,
}

pub(crate) struct Part {
    child: Child,
    /// The process id of a server that it has started, which is killed before it.
    server: Option<u32>,
    /// The part runs while this is open.
    _line: ChildStdin,
}

impl Part {
    /// Starts the store. Returns `None` if it ends before it replies, like on a full disk. Also returns its owner's
    /// connection.
    pub(crate) fn store(folder: &Path, webhook: SocketAddr, ground: Ground) -> Option<(Self, Connection)> {
        let (mut part, said) = start("store", folder, &webhook.to_string(), ground)?;
        let mut words = said.split(' ').map(str::to_owned);
        let mut word = || words.next().unwrap_or_default();
        let (endpoint, region, access_key, secret_key) = (word(), word(), word(), word());
        part.server = word().parse().ok();
        Some((part, Connection { endpoint, region, access_key, secret_key, session_token: None }))
    }

    /// Starts the invoker. Also returns the address at which it receives events.
    pub(crate) fn invoker(folder: &Path, config: &InvokerConfig, ground: Ground) -> (Self, SocketAddr) {
        let config = serde_json::to_string(config).unwrap();
        let (part, said) = start("invoker", folder, &config, ground).expect("the invoker does not start");
        (part, said.parse().unwrap())
    }

    /// Kills the process by `kill -9`.
    pub(crate) fn kill(mut self) {
        if let Some(pid) = self.server {
            // It may have ended by itself.
            let _ = Command::new("kill").args(["-9", &pid.to_string()]).status().unwrap();
        }
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

/// Sets the clock of a part, and of the processes that it has started, ahead by a number of seconds.
pub(crate) fn set_clock(folder: &Path, name: &str, ahead: i64) {
    let file = clock_file(folder, name);
    let next = file.with_extension("next");
    std::fs::write(&next, format!("{ahead:+}s\n")).unwrap();
    std::fs::rename(&next, &file).unwrap();
}

/// Returns the environment in which a program reads its clock from a file.
fn lies(folder: &Path, name: &str) -> Vec<(String, String)> {
    let Some(library) = lying_clock() else { return Vec::new() };
    let file = clock_file(folder, name);
    let pairs = [
        ("LD_PRELOAD", library.to_str().unwrap()),
        ("FAKETIME_TIMESTAMP_FILE", file.to_str().unwrap()),
        ("FAKETIME_CACHE_DURATION", "1"),
        // Monotonic clocks are not changed, because timers do not depend on the time of day.
        ("FAKETIME_DONT_FAKE_MONOTONIC", "1"),
    ];
    pairs.map(|(name, value)| (name.to_owned(), value.to_owned())).to_vec()
}

fn start(name: &str, folder: &Path, config: &str, ground: Ground) -> Option<(Part, String)> {
    let limit = ground.largest_file.map_or("unlimited".to_owned(), |blocks| blocks.to_string());
    // The limit that the shell sets persists after it, like the ignored signal.
    let script = format!("trap '' XFSZ; ulimit -f {limit}; exec env \"$@\"");
    let mut command = Command::new("bash");
    command.args(["-c", &script, "part"]);
    if ground.lying_clock {
        command.args(lies(folder, name).iter().map(|(name, value)| format!("{name}={value}")));
    }
    command.arg(std::env::current_exe().unwrap()).args([crate::TEST, "--exact", "--nocapture"]);
    command.env(PART, name).env(FOLDER, folder).env(CONFIG, config);
    command.env("RAYFOLD_CHAOS_LIES", if ground.lying_clock { "yes" } else { "no" });
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    let line = child.stdin.take().unwrap();
    let lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let (say, said) = mpsc::channel();
    std::thread::spawn(move || {
        // Reads to the end, so that the part never writes into a closed pipe.
        for line in lines.map_while(Result::ok) {
            if let Some((_, says)) = line.split_once(SAYS) {
                // If the part came too late, the receiver is gone.
                let _ = say.send(says.to_owned());
            }
        }
    });
    let part = Part { child, server: None, _line: line };
    let said = said.recv_timeout(START).ok()?;
    Some((part, said))
}

/// Runs the part that this process was started as. Returns whether it is one.
pub(crate) async fn is_part() -> bool {
    let Ok(part) = std::env::var(PART) else { return false };
    let folder = PathBuf::from(std::env::var(FOLDER).unwrap());
    let config = std::env::var(CONFIG).unwrap();
    match part.as_str() {
        "store" => be_store(&folder, &config).await,
        "invoker" => be_invoker(&folder, &serde_json::from_str(&config).unwrap()).await,
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
    if let Some(queue) = server.queue_arn() {
        rayfold_local::notify(&store, &Routes::shared().notifications(queue)).await.unwrap();
    }
    let Connection { endpoint, region, access_key, secret_key, .. } = connection;
    let pid = server.pid().map(|pid| pid.to_string()).unwrap_or_default();
    say_and_stay(&format!("{endpoint} {region} {access_key} {secret_key} {pid}")).await;
}

async fn be_invoker(folder: &Path, config: &InvokerConfig) {
    let note = noting(folder);
    let functions = Path::new(env!("CARGO_BIN_EXE_rayfold-render")).parent().unwrap();
    let functions = Functions::in_folder(functions);
    let mut settings = Settings::new(functions, Some(config.store), any_port(), TOKEN.into());
    if store_kind() == StoreKind::SeaweedFs {
        let connection = Connection {
            endpoint: format!("http://{}", config.store),
            region: config.region.clone(),
            access_key: config.access_key.clone(),
            secret_key: config.secret_key.clone(),
            session_token: None,
        };
        settings.listing = Some(Listing::new(S3Store::at(&connection, BUCKET), "chaos"));
    }
    settings.concurrency = 4;
    settings.memory_mb = SMALL_MB;
    settings.timeout = Duration::from_secs(20);
    settings.retry_pauses = vec![Duration::from_millis(50), Duration::from_millis(100)];
    settings.sweep_every = Some(Duration::from_secs(3));
    settings.kept_events = Some(Duration::from_millis(1_200));
    let environment = [
        ("AWS_REGION", config.region.as_str()),
        ("AWS_ACCESS_KEY_ID", &config.access_key),
        ("AWS_SECRET_ACCESS_KEY", &config.secret_key),
        ("RAYFOLD_BUCKET", BUCKET),
        ("RAYFOLD_QUIET_MS", "300"),
        ("RAYFOLD_STUCK_AFTER_MS", "2000"),
    ];
    settings.environment = environment.map(|(name, value)| (name.to_owned(), value.to_owned())).to_vec();
    if config.in_pieces {
        settings.environment.push(("RAYFOLD_SPARE_FRAMES".into(), ALL_ITS_TIME.into()));
    }
    if std::env::var("RAYFOLD_CHAOS_LIES").is_ok_and(|lies| lies == "yes") {
        settings.environment.extend(lies(folder, "invoker"));
    }
    if let Some(seed) = config.seed {
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
                Seen::Finished { .. }
                | Seen::Event { .. }
                | Seen::Requested { .. }
                | Seen::Joined { .. }
                | Seen::Lost { .. } => {}
            }
        }
    });
    let invoker = Invoker::start(settings, Some(sender)).await.unwrap();
    say_and_stay(&invoker.webhook().to_string()).await;
}

/// Returns the name under which a line of a function's log is counted.
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
