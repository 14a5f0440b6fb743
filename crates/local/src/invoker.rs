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

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use tokio::net::TcpListener;
use tokio::sync::mpsc::{UnboundedSender, unbounded_channel};
use tokio::sync::oneshot;
use tokio::task::JoinSet;

pub use chaos::{Chaos, Fate, Fates};
pub use pool::Ramp;

use crate::functions::Functions;
use crate::http::{Server, listen};

use crate::observation::{Observation, Observer, Outcome};
use crate::routes::Function;
use crate::{Error, Result};
use events::Pools;
use pool::{Caller, Job, Pending, Workers};

/// What the schedule of `infra/terraform` sends.
const SWEEP: &str = r#"{"sweep":true}"#;

/// The same when nobody has listened for events: what is pending is not on its way.
const CATCH_UP: &str = r#"{"sweep":true,"catch_up":true}"#;

/// What an invoker needs to know.
#[derive(Clone)]
pub struct Settings {
    /// The binaries.
    pub functions: Functions,
    /// The processes' environment, beyond what Lambda sets.
    pub environment: Vec<(String, String)>,
    /// What differs by function, such as credentials of its own.
    pub environment_of: BTreeMap<Function, Vec<(String, String)>>,
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
            environment_of: BTreeMap::new(),
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
    server: Server,
    tasks: JoinSet<()>,
}

impl Invoker {
    /// Listens for events, and sweeps what was missed before.
    ///
    /// # Errors
    /// [`Error::NoFunction`], [`Error::Listen`].
    pub async fn start(settings: Settings, observer: Option<UnboundedSender<Observation>>) -> Result<Self> {
        let (listener, _) = listen(settings.webhook).await?;
        Self::start_on(listener, settings, observer)
    }

    /// The same on a listener that is there already.
    pub(crate) fn start_on(
        listener: TcpListener,
        settings: Settings,
        observer: Option<UnboundedSender<Observation>>,
    ) -> Result<Self> {
        settings.functions.check()?;
        let webhook = listener
            .local_addr()
            .map_err(|source| Error::Listen { address: settings.webhook.to_string(), source })?;
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
        let server = events::receive(
            listener,
            &settings.webhook_token,
            pools.clone(),
            dice,
            observer,
            pending.clone(),
            &mut tasks,
        );
        pools.assemble.submit(Job::event(CATCH_UP));
        if let Some(pause) = settings.sweep_every {
            let assemble = pools.assemble.clone();
            tasks.spawn(async move {
                loop {
                    tokio::time::sleep(pause).await;
                    assemble.submit(Job::event(SWEEP));
                }
            });
        }
        Ok(Self { pools, pending, webhook, server, tasks })
    }

    /// Kills every process, and returns when no event can be heard any more.
    pub async fn stop(mut self) {
        self.tasks.shutdown().await;
        self.server.stop().await;
    }

    /// Where events are heard.
    pub fn webhook(&self) -> SocketAddr {
        self.webhook
    }

    /// The schedule's event, now.
    pub fn sweep(&self) {
        self.pools.assemble.submit(Job::event(SWEEP));
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
