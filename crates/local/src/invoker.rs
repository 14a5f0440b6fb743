//! Lambda's part on one machine: it runs the function binaries, unmodified, on Lambda's own terms.
//!
//! Each process gets a Runtime API of its own and a proxy to the store that counts its requests. Refuses to know what
//! the functions do: it sees events, answers and exit codes.
//!
//! Invariants: no more processes of a function run at once than the concurrency allows; an event's tries share its
//! request id; a process that crashed, or was killed at its deadline, is never used again; dropping the invoker kills
//! every process it started.

mod chaos;
mod events;
mod failures;
mod pool;
mod runtime_api;
mod sandbox;

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use bytes::Bytes;
use serde_json::json;
use tokio::sync::mpsc::{UnboundedSender, unbounded_channel};
use tokio::sync::oneshot;
use tokio::task::JoinSet;

pub use chaos::{Chaos, Fate, Fates};
pub use pool::Ramp;

use crate::Result;
use crate::functions::Functions;
use crate::http::Server;
use crate::minio::REGION;
use crate::observation::{Observation, Observer, Outcome};
use crate::routes::Function;
use events::Pools;
use pool::{Caller, Job, Pending, Workers};

/// What an invoker needs to know.
#[derive(Clone)]
pub struct Settings {
    /// The binaries.
    pub functions: Functions,
    /// The processes' environment, beyond what Lambda sets.
    pub environment: Vec<(String, String)>,
    /// The store's S3 endpoint.
    pub store: SocketAddr,
    /// Where to listen for events.
    pub webhook: SocketAddr,
    /// What events have to carry.
    pub webhook_token: String,
    /// Processes of a function at once.
    pub concurrency: usize,
    /// How fast new ones may start.
    pub ramp: Ramp,
    /// What the processes are told of their memory.
    pub memory_mb: u32,
    /// From the handing out to the kill.
    pub timeout: Duration,
    /// Before each further try of an event that failed; Lambda's are one and two minutes.
    pub retry_pauses: Vec<Duration>,
    /// Between the sweeps after the one at the start.
    pub sweep_every: Option<Duration>,
    /// What goes wrong on purpose with events and processes.
    pub chaos: Chaos,
    /// What goes wrong on purpose with requests to the store.
    pub fates: Option<Fates>,
}

impl Settings {
    /// Those of a laptop.
    pub fn new(functions: Functions, store: SocketAddr, webhook: SocketAddr, webhook_token: String) -> Self {
        Self {
            functions,
            environment: Vec::new(),
            store,
            webhook,
            webhook_token,
            concurrency: 10,
            ramp: Ramp::default(),
            memory_mb: 1769,
            timeout: Duration::from_secs(300),
            retry_pauses: vec![Duration::from_millis(500), Duration::from_secs(1)],
            sweep_every: Some(Duration::from_secs(30)),
            chaos: Chaos::default(),
            fates: None,
        }
    }
}

/// A running invoker.
pub struct Invoker {
    pools: Pools,
    pending: Pending,
    webhook: SocketAddr,
    _server: Server,
    _tasks: JoinSet<()>,
}

impl Invoker {
    /// Listens for events, and sweeps what was missed before.
    ///
    /// # Errors
    /// [`Error::NoFunction`](crate::Error::NoFunction), [`Error::Listen`](crate::Error::Listen).
    pub async fn start(settings: Settings, observer: Option<UnboundedSender<Observation>>) -> Result<Self> {
        settings.functions.check()?;
        let observer = Observer(observer);
        let dice = Arc::new(chaos::Dice::new(settings.chaos.clone()));
        let pending = Pending::default();
        let mut tasks = JoinSet::new();
        let (failures, failed) = unbounded_channel();
        let settings = Arc::new(settings);
        let [render, assemble] = Function::ALL.map(|function| {
            Workers::start(
                function,
                settings.clone(),
                dice.clone(),
                observer.clone(),
                pending.clone(),
                failures.clone(),
                &mut tasks,
            )
        });
        tasks.spawn(failures::deliver(failed, assemble.clone(), pending.clone(), observer.clone()));
        let pools = Pools { render, assemble };
        let (server, webhook) = events::receive(
            settings.webhook,
            &settings.webhook_token,
            pools.clone(),
            dice,
            observer,
            pending.clone(),
            &mut tasks,
        )
        .await?;
        pools.assemble.submit(Job::event(schedule()));
        if let Some(pause) = settings.sweep_every {
            let assemble = pools.assemble.clone();
            tasks.spawn(async move {
                loop {
                    tokio::time::sleep(pause).await;
                    assemble.submit(Job::event(schedule()));
                }
            });
        }
        Ok(Self { pools, pending, webhook, _server: server, _tasks: tasks })
    }

    /// Where events are heard.
    pub fn webhook(&self) -> SocketAddr {
        self.webhook
    }

    /// The schedule's event, now.
    pub fn sweep(&self) {
        self.pools.assemble.submit(Job::event(schedule()));
    }

    /// Invokes as an event does: tried again when it fails, then delivered to the failure queue.
    pub fn send(&self, function: Function, payload: impl Into<Bytes>) {
        self.pools.of(function).submit(Job::event(payload));
    }

    /// Invokes and waits for the end of the one attempt.
    pub async fn invoke(&self, function: Function, payload: impl Into<Bytes>) -> Outcome {
        let (done, outcome) = oneshot::channel();
        self.pools.of(function).submit(Job { caller: Caller::Waiting(done), ..Job::event(payload) });
        outcome.await.unwrap_or_else(|_| Outcome::Crashed("the invoker stopped".into()))
    }

    /// Returns when nothing is queued, running, or waiting for another try.
    pub async fn idle(&self) {
        self.pending.none().await;
    }

    /// Invocations that are queued, running, or waiting for another try.
    pub fn pending(&self) -> usize {
        self.pending.count()
    }
}

/// What EventBridge Scheduler sends when a schedule gives no input of its own.
fn schedule() -> String {
    json!({
        "version": "0",
        "id": random_id(),
        "detail-type": "Scheduled Event",
        "source": "aws.scheduler",
        "account": "000000000000",
        "time": failures::timestamp(SystemTime::now()),
        "region": REGION,
        "resources": [format!("arn:aws:scheduler:{REGION}:000000000000:schedule/default/rayfold-sweep")],
        "detail": "{}",
    })
    .to_string()
}

/// An identifier in the shape of a version-4 UUID.
fn random_id() -> String {
    let bits = fastrand::u128(..) & !(0xf000 << 64) & !(0xc << 60) | (0x4000 << 64) | (0x8 << 60);
    let hex = format!("{bits:032x}");
    [&hex[..8], &hex[8..12], &hex[12..16], &hex[16..20], &hex[20..]].join("-")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_version_4_uuids() {
        let id = random_id();
        let parts: Vec<&str> = id.split('-').collect();
        assert_eq!(parts.iter().map(|part| part.len()).collect::<Vec<_>>(), [8, 4, 4, 4, 12]);
        assert!(parts[2].starts_with('4') && parts[3].starts_with(['8', '9', 'a', 'b']), "{id}");
        assert_ne!(id, random_id());
    }
}
