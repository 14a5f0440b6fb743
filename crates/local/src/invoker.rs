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
mod meter;
mod pool;
mod queue;
mod ramp;
mod runtime_api;
mod sandbox;
mod settings;

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use tokio::net::TcpListener;
use tokio::sync::mpsc::{UnboundedSender, unbounded_channel};
use tokio::sync::oneshot;
use tokio::task::JoinSet;

pub use chaos::{Chaos, Fate, Fates};
pub use ramp::Ramp;
pub use settings::Settings;

use crate::error::{Error, Result};
use crate::http::{Server, listen};
use crate::observation::{Observation, Observer, Outcome};
use crate::routes::Function;
use events::Pools;
use pool::Workers;
use queue::{Caller, Job, Pending, Pool};

/// What the schedule of `infra/terraform` sends.
const SWEEP: &str = r#"{"sweep":true}"#;

/// The same when nobody has listened for events: what is pending is not on its way.
const CATCH_UP: &str = r#"{"sweep":true,"catch_up":true}"#;

/// Between two looks at whether everything has ended.
const LOOK: Duration = Duration::from_millis(5);

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
        match settings.kept_events {
            None => pools.assemble.submit(Job::event(CATCH_UP)),
            Some(soon) => {
                pending.add();
                tasks.spawn(catch_up_after(soon, pools.assemble.clone(), pending.clone()));
            }
        }
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

/// Sweeps when the events that the store has kept were heard, and all that they woke has ended.
async fn catch_up_after(soon: Duration, assemble: Pool, pending: Pending) {
    tokio::time::sleep(soon).await;
    // This sweep itself is one of them, so that nobody takes the invoker for idle before.
    while pending.count() > 1 {
        tokio::time::sleep(LOOK).await;
    }
    assemble.submit(Job::event(CATCH_UP));
    pending.remove();
}
