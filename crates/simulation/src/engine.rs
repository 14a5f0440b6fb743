//! A simulated world: time is a number, and everything runs in one thread, in an order that the seed decides.
//!
//! Tasks are futures; they wait on nothing but [`Engine::sleep`]. When no task can continue, time jumps to the next
//! timer. The engine knows nothing of stores or functions.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap, VecDeque};
use std::future::Future;
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Wake, Waker};
use std::time::Duration;

use rayfold_pipeline::{Clock, Timestamp};

/// The name of a task.
pub(super) type TaskId = u64;

type Task = Pin<Box<dyn Future<Output = ()> + Send>>;
type Call = Box<dyn FnOnce() + Send>;

/// The time and the tasks of a world. Clones share the same world.
#[derive(Clone, Default)]
pub(super) struct Engine {
    inner: Arc<Mutex<Inner>>,
    ready: Arc<Mutex<VecDeque<TaskId>>>,
}

#[derive(Default)]
struct Inner {
    now_us: u64,
    sequence: u64,
    timers: BinaryHeap<Reverse<(u64, u64)>>,
    actions: BTreeMap<u64, Action>,
    tasks: BTreeMap<TaskId, Option<Task>>,
    next_task: TaskId,
}

enum Action {
    Wake(Waker),
    Call(Call),
}

struct TaskWaker {
    id: TaskId,
    ready: Arc<Mutex<VecDeque<TaskId>>>,
}

impl Wake for TaskWaker {
    fn wake(self: Arc<Self>) {
        lock(&self.ready).push_back(self.id);
    }
}

impl Engine {
    /// Microseconds since the world began.
    pub(super) fn now_us(&self) -> u64 {
        lock(&self.inner).now_us
    }

    /// Calls `call` after `delay`.
    pub(super) fn after(&self, delay: Duration, call: impl FnOnce() + Send + 'static) {
        lock(&self.inner).add(delay, Action::Call(Box::new(call)));
    }

    /// Starts a task; it first runs when the current one waits.
    pub(super) fn spawn(&self, task: impl Future<Output = ()> + Send + 'static) -> TaskId {
        let mut inner = lock(&self.inner);
        inner.next_task += 1;
        let id = inner.next_task;
        inner.tasks.insert(id, Some(Box::pin(task)));
        lock(&self.ready).push_back(id);
        id
    }

    /// Ends a task at its current await.
    pub(super) fn kill(&self, id: TaskId) {
        let task = lock(&self.inner).tasks.remove(&id);
        // Its destructors may come back to the engine.
        drop(task);
    }

    /// Ends the world by dropping all pending work, which refers to the world and would keep it alive.
    pub(super) fn end(&self) {
        let mut inner = lock(&self.inner);
        let (tasks, actions) = (std::mem::take(&mut inner.tasks), std::mem::take(&mut inner.actions));
        drop(inner);
        drop((tasks, actions));
    }

    /// Waits for a time of the simulated clock.
    pub(super) fn sleep(&self, duration: Duration) -> Sleep {
        let until_us = self.now_us() + micros(duration);
        Sleep { engine: self.clone(), until_us, waker: None }
    }

    /// Runs until nothing is left to do, or until `limit`. Returns whether nothing is left.
    pub(super) fn run(&self, limit: Duration) -> bool {
        let limit_us = micros(limit);
        loop {
            let next = lock(&self.ready).pop_front();
            if let Some(id) = next {
                self.poll(id);
                continue;
            }
            let mut inner = lock(&self.inner);
            let Some(Reverse((time_us, key))) = inner.timers.peek().copied() else { return true };
            if time_us > limit_us {
                inner.now_us = inner.now_us.max(limit_us);
                return false;
            }
            inner.timers.pop();
            inner.now_us = time_us;
            let action = inner.actions.remove(&key);
            drop(inner);
            match action {
                Some(Action::Wake(waker)) => waker.wake(),
                Some(Action::Call(call)) => call(),
                None => {}
            }
        }
    }

    fn poll(&self, id: TaskId) {
        let Some(mut task) = lock(&self.inner).tasks.get_mut(&id).and_then(Option::take) else { return };
        let waker = Waker::from(Arc::new(TaskWaker { id, ready: self.ready.clone() }));
        let done = task.as_mut().poll(&mut Context::from_waker(&waker)).is_ready();
        let mut inner = lock(&self.inner);
        if done {
            inner.tasks.remove(&id);
        } else if let Some(slot) = inner.tasks.get_mut(&id) {
            *slot = Some(task);
            return;
        }
        // Killed by itself while it ran, or done: either way dropped outside of the lock.
        drop(inner);
        drop(task);
    }
}

impl Inner {
    fn add(&mut self, delay: Duration, action: Action) {
        self.sequence += 1;
        let time_us = self.now_us + micros(delay);
        self.timers.push(Reverse((time_us, self.sequence)));
        self.actions.insert(self.sequence, action);
    }
}

/// A future that is ready at its time.
pub(super) struct Sleep {
    engine: Engine,
    until_us: u64,
    waker: Option<Waker>,
}

impl Future for Sleep {
    type Output = ();

    fn poll(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<()> {
        let engine = self.engine.clone();
        let mut inner = lock(&engine.inner);
        if inner.now_us >= self.until_us {
            return Poll::Ready(());
        }
        if !self.waker.as_ref().is_some_and(|waker| waker.will_wake(context.waker())) {
            self.waker = Some(context.waker().clone());
            let delay = Duration::from_micros(self.until_us - inner.now_us);
            inner.add(delay, Action::Wake(context.waker().clone()));
        }
        Poll::Pending
    }
}

/// The clock of a function, which is slightly ahead of the world's time or behind it.
#[derive(Clone)]
pub(super) struct WorldClock {
    pub(super) engine: Engine,
    pub(super) skew: Duration,
}

/// The world's time at the beginning, late enough that slow clocks do not show a negative time.
const EPOCH: Timestamp = Timestamp(1_000_000_000_000);

impl WorldClock {
    /// Returns a clock that shows the store's time.
    pub(super) fn exact(engine: &Engine) -> Self {
        WorldClock { engine: engine.clone(), skew: Duration::ZERO }
    }
}

impl Clock for WorldClock {
    fn now(&self) -> Timestamp {
        EPOCH.after(Duration::from_micros(self.engine.now_us()) + self.skew)
    }

    async fn sleep(&self, duration: Duration) {
        self.engine.sleep(duration).await;
    }
}

fn micros(duration: Duration) -> u64 {
    u64::try_from(duration.as_micros()).unwrap_or(u64::MAX)
}

pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
