//! The functions' platform. Events come late, twice or never. Invocations run concurrently up to a limit, and are
//! killed and tried again under the same request id. An event that is given up is recorded.

use std::collections::{BTreeSet, VecDeque};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, Weak};
use std::time::Duration;

use super::bucket::{Actor, Fate, SimEnvironment, WorldStore};
use super::engine::{TaskId, WorldClock, lock};
use super::timed::{FakeAnimator, Pace, TimedRenderer};
use rayfold_pipeline::failure::{End, Failure};
use rayfold_pipeline::fold::Folded;
use rayfold_pipeline::render::Outcome;
use rayfold_pipeline::retry::{Scope, retry};
use rayfold_pipeline::store::ETag;
use rayfold_pipeline::sweep::Visit;
use rayfold_pipeline::{
    Clock, Error, Invocation, Mutation, Policy, Randomness, Timestamp, assemble, record_failure,
    render_frame, sweep,
};

/// The rates of the platform's faults: one in this many, or never if 0.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Chaos {
    /// An event is lost.
    pub(super) drop: u64,
    /// An event is delivered twice, or an invocation that succeeded is run again.
    pub(super) duplicate: u64,
    /// An invocation is killed.
    pub(super) kill: u64,
    /// An event waits until it is too old.
    pub(super) too_old: u64,
    /// The longest delay of an event, in milliseconds.
    pub(super) delay_ms: u64,
    /// The largest time by which a function's clock is ahead of the bucket's, in milliseconds.
    pub(super) skew_ms: u64,
}

/// The event that an invocation works on.
#[derive(Debug, Clone)]
pub(super) enum Work {
    /// An object event of the render function.
    Render(String, Option<ETag>),
    /// The key of a claim.
    Assemble(String),
    /// A tick of the schedule.
    Sweep,
    /// A record of the on-failure destination.
    Record(Failure),
    /// A call of `rayfold retry`.
    Retry(rayfold_pipeline::keys::Animation),
}

#[derive(Debug, Clone)]
struct Job {
    work: Work,
    request_id: String,
    attempt: u64,
    /// The time when it was queued, in microseconds.
    queued_us: u64,
}

/// The history of a run, for the predicates.
#[derive(Debug, Default)]
pub(super) struct Diary {
    /// Whether something happened that by design only the sweep can repair.
    pub(super) needs_sweep: Option<&'static str>,
    /// The number of events that were given up.
    pub(super) given_up: u64,
    /// The number of GIFs that an invocation left unfinished to the next one.
    pub(super) left: u64,
    /// The visits of the last sweep.
    pub(super) last_sweep: Vec<Visit>,
    /// An error that no invocation should have.
    pub(super) bug: Option<String>,
    /// The number of requests of invocations that found everything done, with the frequency of each number.
    pub(super) idle: Vec<u64>,
    /// The number of invocations by kind: render, assemble.
    pub(super) invocations: [u64; 2],
    /// The time of the render function's invocations without drawing, and the time of drawing.
    pub(super) beyond_drawing: Duration,
    pub(super) drawing: Duration,
    /// The time that events waited for a free place: the longest, and the sum, by function.
    pub(super) longest_wait: [Duration; 2],
    pub(super) waits: [Duration; 2],
    /// The most invocations at once.
    pub(super) at_once: usize,
    /// The time of finished assemblers, and the largest number of concurrent assemblers.
    pub(super) assembling: Duration,
    pub(super) assemblers_at_once: u64,
    assemblers: u64,
    /// The time when an invocation last ended, in microseconds.
    pub(super) last_end_us: u64,
}

impl Diary {
    fn begins(&mut self, job: &Job, now_us: u64, running: usize) {
        let function = usize::from(!matches!(job.work, Work::Render(..)));
        let waited = Duration::from_micros(now_us - job.queued_us);
        self.waits[function] += waited;
        self.longest_wait[function] = self.longest_wait[function].max(waited);
        self.at_once = self.at_once.max(running);
    }

    fn assembler_begins(&mut self) {
        self.invocations[1] += 1;
        self.assemblers += 1;
        self.assemblers_at_once = self.assemblers_at_once.max(self.assemblers);
    }

    fn assembler_ends(&mut self, took_us: u64) {
        self.assemblers -= 1;
        self.assembling += Duration::from_micros(took_us);
    }
}

struct State {
    queue: VecDeque<Job>,
    running: BTreeSet<u64>,
    tokens: u64,
}

pub(super) struct Platform {
    pub(super) env: Arc<SimEnvironment>,
    pub(super) policy: Arc<Policy>,
    pub(super) chaos: Mutex<Chaos>,
    pub(super) diary: Mutex<Diary>,
    pub(super) mutation: Option<Mutation>,
    pub(super) concurrency: usize,
    /// The number of places at the beginning, and the number added every 10 seconds, up to the concurrency; `None` for
    /// all at once.
    pub(super) ramp: Mutex<Option<usize>>,
    pub(super) timeout: Duration,
    pub(super) draw_ms: (u64, u64),
    pub(super) pace: Pace,
    state: Mutex<State>,
    me: Weak<Platform>,
}

impl Platform {
    pub(super) fn new(
        env: Arc<SimEnvironment>,
        policy: Policy,
        mutation: Option<Mutation>,
        concurrency: usize,
        timeout: Duration,
        draw_ms: (u64, u64),
        pace: Pace,
    ) -> Arc<Self> {
        Arc::new_cyclic(|me| Platform {
            env,
            policy: Arc::new(policy),
            chaos: Mutex::default(),
            diary: Mutex::default(),
            mutation,
            concurrency,
            ramp: Mutex::default(),
            timeout,
            draw_ms,
            pace,
            state: Mutex::new(State { queue: VecDeque::new(), running: BTreeSet::new(), tokens: 0 }),
            me: me.clone(),
        })
    }

    /// An object changed: the events that follow.
    pub(super) fn object_event(&self, key: &str, etag: Option<ETag>) {
        let work = match key.split('/').next() {
            Some("scripts") => Work::Render(key.to_owned(), etag),
            Some("parts" | "retries") if etag.is_some() => Work::Render(key.to_owned(), etag),
            Some("assemblies") if etag.is_some() => Work::Assemble(key.to_owned()),
            _ => return,
        };
        let chaos = *lock(&self.chaos);
        if self.env.chance(chaos.drop) {
            self.only_the_sweep_heals("an event was lost");
            return;
        }
        let copies = 1 + u64::from(self.env.chance(chaos.duplicate));
        for _ in 0..copies {
            let delay = self.env.between_ms(0..chaos.delay_ms + 15);
            self.submit(work.clone(), delay);
        }
    }

    /// Starts work after a delay, as a separate event.
    pub(super) fn submit(&self, work: Work, delay: Duration) {
        let request_id = format!("{:016x}", self.env.random.bits());
        self.enqueue(Job { work, request_id, attempt: 1, queued_us: 0 }, delay);
    }

    fn enqueue(&self, mut job: Job, delay: Duration) {
        let Some(me) = self.me.upgrade() else { return };
        self.env.engine.after(delay, move || {
            job.queued_us = me.env.engine.now_us();
            lock(&me.state).queue.push_back(job);
            me.launch();
        });
    }

    fn launch(&self) {
        loop {
            let mut state = lock(&self.state);
            if state.running.len() >= self.places() {
                return;
            }
            let Some(job) = state.queue.pop_front() else { return };
            state.tokens += 1;
            let token = state.tokens;
            state.running.insert(token);
            let running = state.running.len();
            drop(state);
            lock(&self.diary).begins(&job, self.env.engine.now_us(), running);
            self.start(job, token);
        }
    }

    /// Returns the number of invocations that may run now.
    fn places(&self) -> usize {
        let tens = usize::try_from(self.env.engine.now_us() / 10_000_000).unwrap_or(usize::MAX);
        let ramp = lock(&self.ramp).map_or(usize::MAX, |step| step.saturating_mul(tens.saturating_add(1)));
        self.concurrency.min(ramp)
    }

    fn start(&self, job: Job, token: u64) {
        let Some(me) = self.me.upgrade() else { return };
        let env = &self.env;
        let chaos = *lock(&self.chaos);
        let is_user = matches!(job.work, Work::Retry(_));
        if !is_user && env.chance(chaos.too_old) {
            me.end(&job, token, Err(Some(End::TooOld)));
            return;
        }
        let countdown = match env.chance(chaos.kill) && !is_user {
            true => 1 + u32::try_from(env.random.below(14)).unwrap_or(0),
            false => 0,
        };
        let late = env.between_ms(1..if env.random.one_in(4) { 8_000 } else { 80 });
        let fate = Arc::new(Fate::new(countdown, env.random.one_in(2), late));
        let task = Arc::new(Mutex::new(None::<TaskId>));
        let die: Arc<dyn Fn() + Send + Sync> = {
            let (me, job, task) = (self.me.clone(), job.clone(), task.clone());
            Arc::new(move || {
                if let (Some(me), Some(task)) = (me.upgrade(), *lock(&task)) {
                    me.env.engine.kill(task);
                    me.end(&job, token, Err(Some(End::Died)));
                }
            })
        };
        {
            let (me, job, task, fate) = (self.me.clone(), job.clone(), task.clone(), fate.clone());
            env.engine.after(self.timeout, move || {
                if let (Some(me), Some(task)) = (me.upgrade(), *lock(&task))
                    && lock(&me.state).running.contains(&token)
                {
                    fate.kill();
                    me.env.engine.kill(task);
                    me.end(&job, token, Err(Some(End::TimedOut)));
                }
            });
        }
        env.note(|| format!("{:.6} starts attempt {} at {:?}", job.request_id, job.attempt, job.work));
        let skew = env.between_ms(0..chaos.skew_ms + 1);
        let clock = WorldClock { engine: env.engine.clone(), skew };
        let deadline = clock.now().after(self.timeout);
        let id = env.engine.spawn(async move {
            let result = me.work(&job, clock, deadline, fate, die).await;
            me.end(&job, token, result.map_err(|error| me.end_of(&error)));
        });
        *lock(&task) = Some(id);
    }

    async fn work(
        &self,
        job: &Job,
        clock: WorldClock,
        deadline: Timestamp,
        fate: Arc<Fate>,
        die: Arc<dyn Fn() + Send + Sync>,
    ) -> Result<(), Error> {
        let actor = match job.work {
            Work::Render(..) => Actor::Render,
            Work::Retry(_) => Actor::User,
            _ => Actor::Assemble,
        };
        let env = self.env.clone();
        let store = WorldStore {
            env: env.clone(),
            actor,
            name: job.request_id.clone(),
            fate: fate.clone(),
            die: die.clone(),
        };
        let random = Randomness::seeded(env.random.bits());
        let invocation = Invocation::new(&store, &clock, &random, &self.policy, &job.request_id)
            .until(deadline)
            .breaking(self.mutation);
        match &job.work {
            Work::Render(key, _) => {
                let actress = TimedRenderer { env, fate: fate.clone(), die, draw_ms: self.draw_ms };
                lock(&self.diary).invocations[0] += 1;
                let rendered = render_frame(&invocation, &actress, key).await?;
                let stages = rendered.stages;
                lock(&self.diary).beyond_drawing += stages.read + stages.put + stages.fold;
                lock(&self.diary).drawing += stages.draw;
                let draws_nothing = matches!(
                    rendered.outcome,
                    Outcome::Present | Outcome::Superseded | Outcome::Gone | Outcome::Settings
                );
                if draws_nothing && rendered.folded == Folded::Covered {
                    lock(&self.diary).idle.push(fate.requests());
                }
            }
            Work::Assemble(key) => {
                let lister = FakeAnimator { engine: env.engine.clone(), pace: self.pace };
                let start_us = env.engine.now_us();
                lock(&self.diary).assembler_begins();
                let assembled = assemble(&invocation, &lister, key).await?;
                lock(&self.diary).left +=
                    u64::from(assembled.is_some_and(|assembled| assembled.left_after.is_some()));
                lock(&self.diary).assembler_ends(env.engine.now_us() - start_us);
            }
            Work::Sweep => {
                let swept = sweep(&invocation).await?;
                let mut visits = Vec::new();
                for (_, visit) in swept.visits {
                    visits.push(visit?);
                }
                lock(&self.diary).last_sweep = visits;
            }
            Work::Record(failure) => {
                record_failure(&invocation, failure).await?;
            }
            Work::Retry(animation) => {
                retry(&invocation, animation, Scope::Failed).await?;
            }
        }
        Ok(())
    }

    /// Returns the end that the platform sees for an error, or `None` for an error that a retry cannot fix.
    fn end_of(&self, error: &Error) -> Option<End> {
        match error {
            Error::Key { .. } => None,
            Error::OutOfTime { .. } => Some(End::TimedOut),
            Error::Invariant { .. } | Error::Malformed { .. } | Error::Refused { .. } => {
                lock(&self.diary).bug = Some(error.to_string());
                None
            }
            error => Some(End::Error(error.to_string())),
        }
    }

    fn end(&self, job: &Job, token: u64, result: Result<(), Option<End>>) {
        if !lock(&self.state).running.remove(&token) {
            return;
        }
        self.env.note(|| format!("{:.6} ends: {result:?}", job.request_id));
        lock(&self.diary).last_end_us = self.env.engine.now_us();
        let chaos = *lock(&self.chaos);
        let backoff = self.env.between_ms(200..3_000);
        match (result, &job.work) {
            (Err(None), _) | (_, Work::Retry(_)) => {}
            (Ok(()), _) => {
                if self.env.chance(chaos.duplicate) {
                    self.enqueue(job.clone(), backoff);
                }
            }
            (Err(Some(end)), work) => {
                let tries = if matches!(work, Work::Record(_)) { 20 } else { 3 };
                if end != End::TooOld && job.attempt < tries {
                    self.enqueue(Job { attempt: job.attempt + 1, ..job.clone() }, backoff);
                } else {
                    self.give_up(job, end);
                }
            }
        }
        self.launch();
    }

    fn give_up(&self, job: &Job, end: End) {
        let (key, version) = match &job.work {
            Work::Render(key, version) => (key.clone(), version.clone()),
            Work::Assemble(key) => (key.clone(), None),
            _ => {
                self.only_the_sweep_heals("a record or a sweep was given up");
                return;
            }
        };
        lock(&self.diary).given_up += 1;
        self.only_the_sweep_heals("an event was given up");
        let failure =
            Failure { key, version, attempts: job.attempt, end, request_id: job.request_id.clone() };
        self.submit(Work::Record(failure), Duration::from_millis(100));
    }

    pub(super) fn only_the_sweep_heals(&self, what: &'static str) {
        lock(&self.diary).needs_sweep.get_or_insert(what);
    }

    /// Returns whether a write took effect after its writer was killed.
    pub(super) fn has_late_writes(&self) -> bool {
        self.env.late_writes.load(Ordering::Relaxed) > 0
    }
}
