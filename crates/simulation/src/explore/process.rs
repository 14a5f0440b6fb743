//! An invocation as a function: from the replies that it has received to the requests that it waits for, or to its end.
//!
//! The real steps run against a store that replies to nothing by itself. The next requests of an invocation depend only
//! on its event, its request id, the time that its clock shows, and the replies so far. So a hash of these identifies
//! its state, the state is computed once ([`Memo`]), and states of the world can be copied and compared. At some places
//! a step declares the values from which it continues ([`Invocation::forget_history_before`]). Its history is then
//! dropped, and two invocations that reached the same values in different ways become equal. Clocks of invocations
//! stand still, and pauses end at once: a pause only delays the next request of its invocation, which the search covers
//! anyway.

use std::collections::BTreeMap;
use std::future::Future;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::num::NonZeroU64;
use std::ops::Range;
use std::pin::Pin;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::task::{Context, Poll, Wake, Waker};
use std::time::Duration;

use bytes::{Bytes, BytesMut};
use rayfold_scene::{AnimationSettings, Container};

use crate::PIXELS;
use crate::engine::lock;
use crate::explore::World;
use rayfold_pipeline::fakes::{InstantRenderer, Listed};
use rayfold_pipeline::manifest::Reason;
use rayfold_pipeline::store::{
    ETag, ListPage, ListRequest, Object, ObjectInfo, Patch, PutOptions, Store, UnfinishedUpload, Upload,
};
use rayfold_pipeline::{Animator, Encoding, Unfit};
use rayfold_pipeline::{
    Clock, Error, Invocation, Mutation, Policy, Randomness, ReplayState, Result, Timestamp, assemble,
    render_frame, sweep,
};

/// The time limit of an invocation.
const TIMEOUT: Duration = Duration::from_secs(900);

/// The time that a frame takes if there is no time for a second one.
const LONG_PUSH: Duration = Duration::from_secs(300);

/// The event that an invocation works on.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) enum Work {
    /// An object event of the render function.
    Render(String),
    /// The key of a claim.
    Assemble(String),
    /// A tick of the schedule.
    Sweep,
}

/// A request that waits to take effect.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Request {
    Get(String, Range<u64>),
    Put(String, Bytes, PutOptions),
    Delete(String),
    List(ListRequest),
}

/// The answer to a request.
#[derive(Debug, Clone)]
pub(super) enum Answer {
    Object(Object),
    ETag(ETag),
    Deleted,
    Page(ListPage),
    NotFound,
    PreconditionFailed,
    /// The connection broke: the request may have taken effect.
    Lost,
}

/// The state that an invocation has reached.
#[derive(Debug, PartialEq)]
pub(super) struct Standing {
    /// The requests whose replies it waits for, each with its number.
    pub(super) requests: Vec<(u32, Request)>,
    /// The end of the invocation. An error is the one that the platform sees.
    pub(super) end: Option<Result<(), End>>,
    /// The hash of its requests.
    pub(super) asks: u64,
    /// The hash of the values from which it continues, if the last reply has led to a place where it declares them.
    carried: Option<u64>,
}

/// The end of an invocation that failed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum End {
    /// The platform tries again.
    TryAgain,
    /// An error of the program, with which no invocation should end.
    Bug(String),
}

/// An answer, and to which request.
#[derive(Debug, Clone)]
pub(super) struct Event {
    slot: u32,
    answer: Arc<Answer>,
    /// The hash of everything that has happened up to it.
    hash: u64,
}

/// An invocation: its event, and everything that has happened to it.
#[derive(Debug, Clone)]
pub(super) struct Process {
    pub(super) work: Work,
    /// The request id, which the platform's attempts at the event share.
    pub(super) request_id: Arc<str>,
    /// The number of the attempt, from 1.
    pub(super) attempt: u32,
    start: Timestamp,
    /// The hash of all the above.
    begun: u64,
    history: Vec<Event>,
    /// The index of the first reply that has had no effect yet. It waits for the replies to the requests that were sent
    /// together with its own.
    silent: usize,
    /// The hash of all that has happened.
    pub(super) hash: u64,
    pub(super) standing: Arc<Standing>,
    /// The time when it last listed the scripts, if it writes GIFs.
    pub(super) listed: Timestamp,
}

/// The known states of invocations, by the hash of their history.
#[derive(Debug)]
pub(super) struct Memo {
    standings: BTreeMap<u64, Arc<Standing>>,
    /// The states by the hash of the earlier history and of a reply.
    answered: BTreeMap<u64, Arc<Process>>,
    manner: Manner,
}

/// The configuration of the steps in a world.
#[derive(Debug, Clone, Copy)]
struct Manner {
    mutation: Option<Mutation>,
    /// Whether an assembler has time for only one frame.
    is_cut: bool,
    /// Whether no history is dropped.
    remembers: bool,
}

pub(super) fn hash_of(what: &impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    what.hash(&mut hasher);
    hasher.finish()
}

impl Memo {
    pub(super) fn new(world: &World, mutation: Option<Mutation>) -> Self {
        let manner = Manner { mutation, is_cut: world.is_cut, remembers: world.remembers };
        let (standings, answered) = (BTreeMap::new(), BTreeMap::new());
        Memo { standings, answered, manner }
    }

    /// Begins an invocation, whose clock shows `start` all the time.
    pub(super) fn begin(
        &mut self,
        work: Work,
        request_id: Arc<str>,
        attempt: u32,
        start: Timestamp,
    ) -> Arc<Process> {
        let standing = Arc::new(Standing { requests: Vec::new(), end: None, asks: 0, carried: None });
        let (history, hash) = (Vec::new(), hash_of(&(&work, &request_id, attempt, start)));
        let (begun, silent, listed) = (hash, 0, Timestamp(0));
        let mut process =
            Process { work, request_id, attempt, start, begun, history, silent, hash, standing, listed };
        process.standing = self.standing(&process);
        Arc::new(process)
    }

    /// Passes the reply to one of its requests to an invocation, at the time `now` of the store's clock.
    pub(super) fn answer(
        &mut self,
        process: &Process,
        slot: u32,
        answer: Answer,
        now: Timestamp,
    ) -> Arc<Process> {
        let asked = process.standing.requests.iter().find(|(of, _)| *of == slot);
        let listed = match (&process.work, asked) {
            (Work::Assemble(_), Some((_, Request::List(request))))
                if request.prefix.starts_with("scripts/") =>
            {
                now
            }
            _ => process.listed,
        };
        let mut hasher = DefaultHasher::new();
        (process.hash, slot, listed).hash(&mut hasher);
        answer.hash_into(&mut hasher);
        let hash = hasher.finish();
        if let Some(known) = self.answered.get(&hash) {
            return known.clone();
        }
        let mut next = self.work_out(Process { listed, ..process.clone() }, slot, answer);
        if let Some(carried) = next.standing.carried.filter(|_| !self.manner.remembers) {
            self.forget(&mut next, carried);
        }
        let next = Arc::new(next);
        self.answered.insert(hash, next.clone());
        next
    }

    /// Drops the history of a process, which is then equal to any other one that continues from the same state.
    fn forget(&mut self, process: &mut Process, carried: u64) {
        process.hash = hash_of(&(process.begun, process.listed, carried));
        process.silent = process.history.len();
        if let Some(last) = process.history.last_mut() {
            last.hash = process.hash;
        }
        let standing = process.standing.clone();
        let known = self.standings.entry(process.hash).or_insert(standing);
        assert_eq!(*known, process.standing, "more than is said makes a difference");
    }

    /// Replies that are awaited together are stored in the order of their requests and not of their arrival, if the
    /// result is the same, because the invocation cannot distinguish the orders.
    fn work_out(&mut self, process: Process, slot: u32, answer: Answer) -> Process {
        let asked = process.standing.requests.len();
        let mut next = process;
        next.history.push(Event { slot, answer: Arc::new(answer), hash: 0 });
        let last = next.history.len() - 1;
        next.rehash_from(last);
        next.standing = self.standing(&next);
        let later = |event: &&Event| event.slot > slot;
        let passed = next.history[next.silent..last].iter().rev().take_while(later).count();
        if passed > 0 {
            let mut sorted = next.clone();
            sorted.history[last - passed..].rotate_right(1);
            sorted.rehash_from(last - passed);
            sorted.standing = self.standing(&sorted);
            if sorted.standing == next.standing {
                next = sorted;
            }
        }
        let is_silent = next.standing.end.is_none() && next.standing.requests.len() + 1 == asked;
        if !is_silent {
            next.silent = next.history.len();
        }
        next
    }

    fn standing(&mut self, process: &Process) -> Arc<Standing> {
        if let Some(known) = self.standings.get(&process.hash) {
            return known.clone();
        }
        let standing = Arc::new(relive(process, self.manner));
        self.standings.insert(process.hash, standing.clone());
        standing
    }
}

impl Process {
    /// Hashes everything that has happened from this reply on.
    fn rehash_from(&mut self, place: usize) {
        let before = place.checked_sub(1).and_then(|before| self.history.get(before));
        let mut hash = before.map_or(self.begun, |event| event.hash);
        for event in &mut self.history[place..] {
            let mut hasher = DefaultHasher::new();
            (hash, event.slot).hash(&mut hasher);
            event.answer.hash_into(&mut hasher);
            hash = hasher.finish();
            event.hash = hash;
        }
        self.hash = hash;
    }
}

impl Answer {
    fn hash_into(&self, hasher: &mut impl Hasher) {
        match self {
            Answer::Object(Object { info, body }) => {
                (0_u8, info.etag.as_str(), info.size, info.modified, &info.metadata).hash(hasher);
                body.hash(hasher);
            }
            Answer::ETag(etag) => (1_u8, etag.as_str()).hash(hasher),
            Answer::Deleted => 2_u8.hash(hasher),
            Answer::Page(page) => {
                3_u8.hash(hasher);
                for object in &page.objects {
                    (&object.key, object.etag.as_str(), object.modified).hash(hasher);
                }
                page.prefixes.hash(hasher);
            }
            Answer::NotFound => 4_u8.hash(hasher),
            Answer::PreconditionFailed => 5_u8.hash(hasher),
            Answer::Lost => 6_u8.hash(hasher),
        }
    }

    fn outcome(self, key: &str) -> Result<Answer> {
        let key = || key.to_owned();
        match self {
            Answer::NotFound => Err(Error::NotFound { key: key() }),
            Answer::PreconditionFailed => Err(Error::PreconditionFailed { key: key() }),
            Answer::Lost => Err(Error::Ambiguous { key: key(), source: "connection reset".into() }),
            answer => Ok(answer),
        }
    }
}

/// Runs the real step again from its beginning, with the replies in their order.
fn relive(process: &Process, manner: Manner) -> Standing {
    let (start, now) = (process.start, process.start);
    let slots = Arc::new(Mutex::new(Slots { start, now, ..Slots::default() }));
    let board = Board { slots, carried: Arc::default() };
    let mut task = step(process.work.clone(), process.request_id.clone(), board.clone(), manner);
    let mut end = poll(&mut task);
    for Event { slot, answer, .. } in &process.history {
        board.answer(*slot, Answer::clone(answer));
        end = poll(&mut task);
    }
    let mut slots = lock(&board.slots);
    let requests = std::mem::take(&mut slots.waiting);
    let requests: Vec<_> = requests.into_iter().map(|(slot, (request, _))| (slot, request)).collect();
    let asks = hash_of(&format!("{:?}", requests.iter().map(|(_, request)| request).collect::<Vec<_>>()));
    Standing { requests, end, asks, carried: slots.carried }
}

type Task = Pin<Box<dyn Future<Output = Result<(), End>> + Send>>;

fn step(work: Work, request_id: Arc<str>, board: Board, manner: Manner) -> Task {
    Box::pin(async move {
        let (random, policy) = (Randomness::seeded(1), Policy::new(PIXELS));
        let clock = BoardClock(board.clone());
        let joiner =
            Joiner { board: board.clone(), push: if manner.is_cut { LONG_PUSH } else { Duration::ZERO } };
        let carried = board.carried.clone();
        let store = BoardStore(board);
        let deadline = clock.now().after(TIMEOUT);
        let invocation = Invocation::new(&store, &clock, &random, &policy, &request_id)
            .until(deadline)
            .breaking(manner.mutation)
            .leaving(&carried);
        let result = match &work {
            Work::Render(key) => {
                render_frame(&invocation, &InstantRenderer { bands: BANDS }, key).await.map(drop)
            }
            Work::Assemble(key) => assemble(&invocation, &joiner, key).await.map(drop),
            Work::Sweep => match sweep(&invocation).await {
                Ok(swept) => swept.visits.into_iter().try_for_each(|(_, visit)| visit.map(drop)),
                Err(error) => Err(error),
            },
        };
        result.map_err(|error| match error {
            Error::Key { .. } | Error::Invariant { .. } | Error::Malformed { .. } | Error::Refused { .. } => {
                End::Bug(error.to_string())
            }
            _ => End::TryAgain,
        })
    })
}

/// Polls a step until it waits for a reply.
fn poll(task: &mut Task) -> Option<Result<(), End>> {
    struct Flag(AtomicBool);
    impl Wake for Flag {
        fn wake(self: Arc<Self>) {
            self.0.store(true, Ordering::Relaxed);
        }
    }
    let flag = Arc::new(Flag(AtomicBool::new(true)));
    let waker = Waker::from(flag.clone());
    while flag.0.swap(false, Ordering::Relaxed) {
        if let Poll::Ready(end) = task.as_mut().poll(&mut Context::from_waker(&waker)) {
            return Some(end);
        }
    }
    None
}

/// The board on which a step leaves its requests and finds the replies.
#[derive(Clone)]
struct Board {
    slots: Arc<Mutex<Slots>>,
    carried: Arc<ReplayState>,
}

#[derive(Default)]
struct Slots {
    start: Timestamp,
    now: Timestamp,
    next: u32,
    carried: Option<u64>,
    waiting: BTreeMap<u32, (Request, Waker)>,
    answers: BTreeMap<u32, Answer>,
}

impl Board {
    async fn request(&self, key: &str, request: Request) -> Result<Answer> {
        let mut slot = None;
        let mut request = Some(request);
        let answer = std::future::poll_fn(|context| {
            let mut slots = lock(&self.slots);
            if let Some(request) = request.take() {
                if let Some(carried) = self.carried.take() {
                    // From here on requests are numbered from the start: nothing tells how many there were.
                    assert!(slots.waiting.is_empty(), "what is asked for is forgotten");
                    slots.next = 0;
                    slots.carried = Some(hash_of(&carried));
                }
                slots.next += 1;
                let number = slots.next;
                slot = Some(number);
                slots.waiting.insert(number, (request, context.waker().clone()));
                return Poll::Pending;
            }
            match slot.and_then(|slot| slots.answers.remove(&slot)) {
                Some(answer) => Poll::Ready(answer),
                None => {
                    if let Some((_, waker)) = slot.and_then(|slot| slots.waiting.get_mut(&slot)) {
                        waker.clone_from(context.waker());
                    }
                    Poll::Pending
                }
            }
        });
        answer.await.outcome(key)
    }

    fn answer(&self, slot: u32, answer: Answer) {
        let waiting = {
            let mut slots = lock(&self.slots);
            slots.now = slots.start;
            slots.carried = None;
            slots.answers.insert(slot, answer);
            slots.waiting.remove(&slot)
        };
        if let Some((_, waker)) = waiting {
            waker.wake();
        }
    }
}

struct BoardClock(Board);

impl Clock for BoardClock {
    fn now(&self) -> Timestamp {
        lock(&self.0.slots).now
    }

    async fn sleep(&self, _: Duration) {}
}

struct BoardStore(Board);

fn wrong_answer(key: &str) -> Error {
    Error::Refused { key: key.to_owned(), source: "an answer to another request".into() }
}

impl Store for BoardStore {
    type Upload = BoardUpload;

    async fn get(&self, key: &str) -> Result<Object> {
        self.get_range(key, 0..u64::MAX).await
    }

    async fn get_range(&self, key: &str, range: Range<u64>) -> Result<Object> {
        match self.0.request(key, Request::Get(key.to_owned(), range)).await? {
            Answer::Object(object) => Ok(object),
            _ => Err(wrong_answer(key)),
        }
    }

    async fn head(&self, key: &str) -> Result<ObjectInfo> {
        self.get_range(key, 0..0).await.map(|object| object.info)
    }

    async fn put(&self, key: &str, body: Bytes, options: PutOptions) -> Result<ETag> {
        match self.0.request(key, Request::Put(key.to_owned(), body, options)).await? {
            Answer::ETag(etag) => Ok(etag),
            _ => Err(wrong_answer(key)),
        }
    }

    async fn delete(&self, key: &str) -> Result<()> {
        self.0.request(key, Request::Delete(key.to_owned())).await.map(drop)
    }

    async fn list(&self, request: ListRequest) -> Result<ListPage> {
        let prefix = request.prefix.clone();
        match self.0.request(&prefix, Request::List(request)).await? {
            Answer::Page(page) => Ok(page),
            _ => Err(wrong_answer(&prefix)),
        }
    }

    /// To begin an upload and send its parts changes nothing that anyone can see, so it is no request here.
    async fn upload(&self, key: &str, options: PutOptions) -> Result<BoardUpload> {
        Ok(self.take_up(key, options, UnfinishedUpload::default()))
    }

    fn take_up(&self, key: &str, options: PutOptions, unfinished: UnfinishedUpload) -> BoardUpload {
        let (store, key) = (BoardStore(self.0.clone()), key.to_owned());
        BoardUpload { store, key, options, body: unfinished.tail.into() }
    }
}

struct BoardUpload {
    store: BoardStore,
    key: String,
    options: PutOptions,
    body: BytesMut,
}

impl Upload for BoardUpload {
    async fn write(&mut self, bytes: Bytes) -> Result<()> {
        self.body.extend_from_slice(&bytes);
        Ok(())
    }

    async fn finish(mut self, patch: Option<Patch>) -> Result<ETag> {
        patch.iter().for_each(|patch| patch.apply(&mut self.body));
        self.store.put(&self.key, self.body.freeze(), self.options).await
    }

    async fn abort(self) -> Result<()> {
        Ok(())
    }

    /// No part has been sent yet.
    fn leave(self) -> UnfinishedUpload {
        UnfinishedUpload { tail: self.body.freeze(), ..UnfinishedUpload::default() }
    }
}

/// The bands of a frame that is too big.
const BANDS: NonZeroU64 = NonZeroU64::new(2).expect("two is not zero");

/// An animator that lists frames, at once or in the time of one.
struct Joiner {
    board: Board,
    push: Duration,
}

struct Joined {
    board: Board,
    push: Duration,
    listed: Listed,
}

impl Joiner {
    fn joined(&self, listed: Listed) -> Joined {
        Joined { board: self.board.clone(), push: self.push, listed }
    }
}

impl Animator for Joiner {
    type Encoding = Joined;

    fn begin(&self, settings: &AnimationSettings, output: Container, _: bool) -> Result<Joined, Reason> {
        Ok(self.joined(Listed::new(settings, output)))
    }

    async fn resume(&self, _: &AnimationSettings, _: Container, state: Bytes) -> Result<Joined, Reason> {
        Listed::resume(&state).map(|listed| self.joined(listed))
    }
}

impl Encoding for Joined {
    async fn push(&mut self, frame: Bytes) -> Result<Bytes, Unfit> {
        let mut slots = lock(&self.board.slots);
        slots.now = slots.now.after(self.push);
        self.listed.push(&frame);
        Ok(Bytes::new())
    }

    async fn finish(mut self) -> Result<(Bytes, Option<Patch>), Reason> {
        Ok(self.listed.finish())
    }

    async fn suspend(self) -> Result<Bytes, Reason> {
        self.listed.suspend()
    }
}
