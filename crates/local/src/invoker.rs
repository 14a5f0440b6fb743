//! Lambda's part on one machine: runs the unmodified function binaries like Lambda does.
//!
//! Each process gets its own Runtime API and a proxy to the store that counts its requests. The invoker has no
//! knowledge of the functions' work: it sees events, replies and exit codes.
//!
//! Invariants: at most as many processes of a function run at once as the concurrency allows. All attempts at an event
//! have the same request id. A process that crashed, or was killed at its deadline, is never used again. Dropping the
//! invoker kills every process that it started.

mod chaos;
mod events;
mod failures;
mod listing;
mod members;
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
pub use settings::{Listing, Settings};

use crate::error::{Error, Result};
use crate::http::{Server, listen};
use crate::observation::{Observation, Observer, Outcome};
use crate::routes::Function;
use events::{Delivery, Pools};
use listing::Watcher;
use members::Members;
use pool::Workers;
use queue::{Caller, Job, Pending, Pool};

/// The event that the schedule of `infra/terraform` sends.
const SWEEP: &str = r#"{"sweep":true}"#;

/// The event for a sweep after a time in which the invoker did not receive events: pending work is not in progress.
const CATCH_UP: &str = r#"{"sweep":true,"catch_up":true}"#;

/// The time between two checks whether everything has ended.
const LOOK: Duration = Duration::from_millis(5);

/// A running invoker of the functions.
pub struct Invoker {
    pools: Pools,
    pending: Pending,
    webhook: SocketAddr,
    watcher: Option<Watcher>,
    members: Option<Arc<Members>>,
    server: Server,
    tasks: JoinSet<()>,
}

impl Invoker {
    /// Listens for events, and sweeps to catch up on missed ones.
    ///
    /// # Errors
    /// [`Error::NoFunction`] if a binary is missing, and [`Error::Listen`] if the address is not available.
    pub async fn start(settings: Settings, observer: Option<UnboundedSender<Observation>>) -> Result<Self> {
        let (listener, _) = listen(settings.webhook).await?;
        Self::start_on(listener, settings, observer)
    }

    /// Starts an invoker on an existing listener.
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
        let delivery = Delivery::start(pools.clone(), dice, observer.clone(), pending.clone(), &mut tasks);
        let hearing = delivery.clone();
        let (mut watcher, mut members) = (None, None);
        if let Some(listing) = &settings.listing {
            let shared = Members::start(
                listing,
                settings.concurrency,
                pools.assemble.clone(),
                observer.clone(),
                &mut tasks,
            );
            let catch_up = pools.assemble.clone();
            watcher = Some(Watcher::start(
                listing.clone(),
                shared.clone(),
                delivery,
                pending.clone(),
                move || catch_up.submit(Job::event(CATCH_UP)),
                &mut tasks,
            ));
            members = Some(shared);
        } else {
            match settings.kept_events {
                None => pools.assemble.submit(Job::event(CATCH_UP)),
                Some(soon) => {
                    pending.add();
                    tasks.spawn(catch_up_after(soon, pools.assemble.clone(), pending.clone()));
                }
            }
        }
        let hint = watcher.as_ref().map(Watcher::hint);
        let server = events::receive(listener, &settings.webhook_token, move |name, key, payload| {
            match &hint {
                // Each listed change is delivered once, by one of the invokers.
                Some(hint) => hint.notify_one(),
                None => hearing.take(name, key, payload),
            }
        });
        if let Some(pause) = settings.sweep_every {
            let (assemble, members) = (pools.assemble.clone(), members.clone());
            tasks.spawn(async move {
                loop {
                    tokio::time::sleep(pause).await;
                    // One sweep is enough for all invokers of a bucket.
                    if members.as_ref().is_none_or(|members| members.leads()) {
                        assemble.submit(Job::event(SWEEP));
                    }
                }
            });
        }
        Ok(Self { pools, pending, webhook, watcher, members, server, tasks })
    }

    /// Kills every process. No event is received after this returns.
    pub async fn stop(mut self) {
        self.tasks.shutdown().await;
        self.server.stop().await;
        if let Some(members) = self.members {
            members.leave().await;
        }
    }

    /// Returns the address at which events are received.
    pub fn webhook(&self) -> SocketAddr {
        self.webhook
    }

    /// Sends the schedule's event now.
    pub fn sweep(&self) {
        self.pools.assemble.submit(Job::event(SWEEP));
    }

    /// Invokes a function like an event does: failures are retried, then delivered to the failure queue.
    pub fn send(&self, function: Function, payload: impl Into<Bytes>) {
        self.pools.of(function).submit(Job::event(payload));
    }

    /// Invokes a function once and waits for the end of this attempt.
    pub async fn invoke(&self, function: Function, payload: impl Into<Bytes>) -> Outcome {
        let (done, outcome) = oneshot::channel();
        self.pools.of(function).submit(Job { caller: Caller::Waiting(done), ..Job::event(payload) });
        outcome.await.unwrap_or_else(|_| Outcome::Crashed("the invoker stopped".into()))
    }

    /// Returns when the events of all changes before the call are delivered. Returns at once if the store sends events.
    pub async fn look(&self) {
        if let Some(watcher) = &self.watcher {
            watcher.look().await;
        }
    }

    /// Returns when no invocation is queued, running, or waiting for a retry.
    pub async fn idle(&self) {
        self.pending.none().await;
    }

    /// Returns the number of invocations that are queued, running, or waiting for a retry.
    pub fn pending(&self) -> usize {
        self.pending.count()
    }
}

/// Sweeps after the events that the store had kept were received and all resulting invocations have ended.
async fn catch_up_after(soon: Duration, assemble: Pool, pending: Pending) {
    tokio::time::sleep(soon).await;
    // This sweep is counted, so that the invoker does not appear idle before it.
    while pending.count() > 1 {
        tokio::time::sleep(LOOK).await;
    }
    assemble.submit(Job::event(CATCH_UP));
    pending.remove();
}
