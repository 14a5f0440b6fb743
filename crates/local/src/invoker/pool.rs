//! The processes of one function, and the queue of its asynchronous invocations.
//!
//! It follows Lambda's rules. At most `concurrency` processes run at once, and new ones start no faster than the ramp
//! allows. The process used last is used next. A failed event is tried twice more, after pauses, and then goes to the
//! failure destination.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc};
use tokio::task::JoinSet;

use super::chaos::Dice;
use super::queue::{Caller, Failure, Job, Pending, Pool};
use super::ramp::Tokens;
use super::runtime_api::Handout;
use super::sandbox::Sandbox;
use super::settings::Settings;
use crate::error::Result;
use crate::observation::{Observer, Outcome};
use crate::region::REGION;
use crate::routes::Function;

/// The time without work after which a process is stopped.
const IDLE_TIMEOUT: Duration = Duration::from_secs(120);

/// The part of the pool that runs as a task.
pub(crate) struct Workers {
    function: Function,
    settings: Arc<Settings>,
    dice: Arc<Dice>,
    observer: Observer,
    pending: Pending,
    failures: mpsc::UnboundedSender<Failure>,
    idle: Arc<Mutex<VecDeque<Sandbox>>>,
    ramp: Mutex<Tokens>,
}

impl Workers {
    pub(crate) fn start(
        function: Function,
        settings: Arc<Settings>,
        dice: Arc<Dice>,
        observer: Observer,
        pending: Pending,
        failures: mpsc::UnboundedSender<Failure>,
        tasks: &mut JoinSet<()>,
    ) -> Pool {
        let (jobs, queue) = mpsc::unbounded_channel();
        let ramp = Mutex::new(Tokens::new(settings.ramp));
        let idle = Arc::default();
        let workers = Arc::new(Self {
            function,
            settings,
            dice,
            observer,
            pending: pending.clone(),
            failures,
            idle,
            ramp,
        });
        let pool = Pool::new(jobs, pending);
        tasks.spawn(workers.dispatch(queue, pool.clone()));
        pool
    }

    async fn dispatch(self: Arc<Self>, mut queue: mpsc::UnboundedReceiver<Job>, pool: Pool) {
        let slots = Arc::new(Semaphore::new(self.settings.concurrency));
        let mut running = JoinSet::new();
        while let Some(job) = queue.recv().await {
            while running.try_join_next().is_some() {}
            let Ok(slot) = slots.clone().acquire_owned().await else { return };
            running.spawn(self.clone().run(job, slot, pool.clone()));
        }
    }

    async fn run(self: Arc<Self>, job: Job, slot: OwnedSemaphorePermit, pool: Pool) {
        let handout = Handout {
            request_id: job.request_id.clone(),
            payload: job.payload.clone(),
            timeout: self.settings.timeout,
            function_arn: format!("arn:aws:lambda:{REGION}:000000000000:function:rayfold-{}", self.function),
            trace_id: trace_id(&job.request_id),
        };
        let outcome = match self.sandbox().await {
            Ok(mut sandbox) => {
                let kill_after = self.dice.kill_after();
                let end = sandbox.invoke(handout, job.attempt, kill_after, &self.observer).await;
                if end.is_reusable {
                    self.idle().push_front(sandbox);
                }
                end.outcome
            }
            Err(error) => Outcome::Failed(error.to_string()),
        };
        drop(slot);
        self.conclude(job, outcome, &pool).await;
        self.pending.remove();
    }

    /// Returns the process used last, or a new one as soon as the ramp allows it.
    async fn sandbox(&self) -> Result<Sandbox> {
        loop {
            {
                let mut idle = self.idle();
                while idle.back().is_some_and(|oldest| oldest.idle_since.elapsed() > IDLE_TIMEOUT) {
                    idle.pop_back();
                }
                while let Some(mut sandbox) = idle.pop_front() {
                    if sandbox.is_alive() {
                        return Ok(sandbox);
                    }
                }
            }
            if self.ramp.lock().unwrap_or_else(PoisonError::into_inner).take(Instant::now()) {
                return Sandbox::start(self.function, &self.settings, &self.observer).await;
            }
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    }

    async fn conclude(&self, mut job: Job, outcome: Outcome, pool: &Pool) {
        match job.caller {
            Caller::Waiting(caller) => {
                // A caller who left does not want to know.
                let _ = caller.send(outcome);
            }
            Caller::Event if outcome.is_success() => {}
            Caller::Event => match self.settings.retry_pauses.get(job.attempt as usize - 1) {
                Some(pause) => {
                    tokio::time::sleep(*pause).await;
                    job.attempt += 1;
                    pool.submit(job);
                }
                None => {
                    let failure = Failure {
                        function: self.function,
                        request_id: job.request_id,
                        payload: job.payload,
                        attempts: job.attempt,
                        outcome,
                    };
                    self.pending.add();
                    if self.failures.send(failure).is_err() {
                        self.pending.remove();
                    }
                }
            },
        }
    }

    fn idle(&self) -> std::sync::MutexGuard<'_, VecDeque<Sandbox>> {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn trace_id(request_id: &str) -> String {
    let hex: String =
        request_id.chars().filter(char::is_ascii_hexdigit).chain("0".repeat(32).chars()).collect();
    format!("Root=1-{}-{};Parent={};Sampled=0", &hex[..8], &hex[8..32], &hex[..16])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trace_ids_have_the_shape_of_x_ray() {
        let trace = trace_id("0123");
        assert_eq!(trace, "Root=1-01230000-000000000000000000000000;Parent=0123000000000000;Sampled=0");
    }
}
