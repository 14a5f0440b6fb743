//! A state of a small world, its possible next steps, and its invariants.
//!
//! A request takes effect and is answered at one moment. Its sender may be killed before it, after it, or so that the
//! write takes effect later. Its reply may be lost. A read whose reply is lost is sent again, which is the same as a
//! late read.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use super::process::{Answer, End, Memo, Process, Request, Work, hash_of};
use super::{Budget, World};
use crate::expected::{Expected, follows};
use rayfold_pipeline::keys::{Animation, Key};
use rayfold_pipeline::manifest::Manifest;
use rayfold_pipeline::store::{Bucket, ETag, PutOptions};
use rayfold_pipeline::{Error, Timestamp};
use rayfold_scene::Container;

/// The time when the story begins.
const EPOCH: Timestamp = Timestamp(1_000_000_000_000);

/// The time between two actions of the user, which alone advance the store's clock.
const APART: Duration = Duration::from_secs(1);

/// The time between two sweeps when nothing else is left to do: longer than the sweep waits for any frame.
const SWEEPS_APART: Duration = Duration::from_secs(4 * 3600);

/// The number of sweeps that must suffice.
const SWEEPS: u32 = 6;

/// The number of times that the platform tries an event.
const ATTEMPTS: u32 = 3;

/// The number of steps after which a world counts as never coming to rest.
const MAX_STEPS: u32 = 100_000;

/// The user among those who act.
pub(super) const USER: u64 = 0;

/// A possible next step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Choice {
    /// The user does the next thing.
    User(Delivery),
    /// A request of an invocation takes effect.
    Request { process: usize, slot: u32, fate: Fate },
    /// A write lands whose sender is dead.
    Ghost(usize),
}

/// The choices for the next step.
#[derive(Debug)]
pub(super) struct Offer {
    /// Each choice is followed.
    pub(super) choices: Vec<Choice>,
    /// The choices are the outcomes of one request that interacts with no other.
    pub(super) is_alone: bool,
}

/// The number of deliveries of an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Delivery {
    Once,
    Twice,
    Never,
}

/// The outcome of a request, and of its sender.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fate {
    /// The request takes effect and is answered. If it fires an event, the event is delivered in this way.
    Answered(Delivery),
    /// The reply is lost, after the effect or without one.
    Lost { effect: bool },
    /// The sender is killed, after the effect or before it.
    Killed { effect: bool },
    /// The sender is killed, and the write takes effect later.
    KilledAndLate,
}

/// The bucket, with a hash that is updated on each change, and the number of times that each key has fired.
#[derive(Debug, Clone, Default)]
struct Contents {
    bucket: Bucket,
    fired: BTreeMap<String, u32>,
    hash: u64,
}

/// A write that has not taken effect yet.
#[derive(Debug)]
struct Ghost {
    request: Request,
    listed: Timestamp,
    hash: u64,
}

/// A moment of a small world.
#[derive(Debug, Clone)]
pub(super) struct State {
    contents: Arc<Contents>,
    acted: usize,
    /// The time by which the clock has been advanced for the sweeps.
    ahead: Duration,
    processes: Vec<Arc<Process>>,
    ghosts: Vec<Arc<Ghost>>,
    budget: Budget,
    needs_sweep: bool,
    /// The time when the scripts of each file were listed.
    files_of: BTreeMap<Container, Timestamp>,
}

impl State {
    /// Returns the first state: the world's past happens step by step before it.
    pub(super) fn begin(world: &World, memo: &mut Memo) -> Result<Self, String> {
        let mut state = State {
            contents: Arc::default(),
            acted: 0,
            ahead: Duration::ZERO,
            processes: Vec::new(),
            ghosts: Vec::new(),
            budget: Budget::default(),
            needs_sweep: false,
            files_of: BTreeMap::new(),
        };
        while state.acted < world.past {
            state = state.after(world, memo, Choice::User(Delivery::Once))?.at_rest(world, memo)?;
        }
        if world.is_claimed_again {
            let claims = state.contents.bucket.keys().filter(|key| key.starts_with("assemblies/"));
            let claim = claims.last().unwrap_or_default().to_owned();
            state.changed(memo, &claim, true, None, Delivery::Once)?;
        }
        state.budget = world.budget;
        Ok(state)
    }

    /// Returns a hash that distinguishes states.
    pub(super) fn hash(&self) -> u64 {
        let spread = |hash: u64| hash.wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(31);
        let listed = |process: &Arc<Process>| process.hash ^ process.listed.0;
        let processes = self.processes.iter().map(listed).map(spread).fold(0, u64::wrapping_add);
        let ghosts = self.ghosts.iter().map(|ghost| ghost.hash).map(spread).fold(1, u64::wrapping_add);
        let State { acted, ahead, budget, needs_sweep, files_of, .. } = self;
        hash_of(&(self.contents.hash, acted, ahead, budget, needs_sweep, files_of, processes, ghosts))
    }

    /// Returns a hash of all that can be seen from outside: the contents of the bucket, and the next
    /// request of every invocation.
    pub(super) fn hash_of_situation(&self) -> u64 {
        let asks =
            |process: &Arc<Process>| hash_of(&(&process.request_id, process.attempt, process.standing.asks));
        let asked = self.processes.iter().map(asks).fold(0, u64::wrapping_add);
        hash_of(&(self.contents.hash, self.acted, self.budget, self.needs_sweep, asked, self.ghosts.len()))
    }

    /// Returns the time of the store's clock.
    fn now(&self) -> Timestamp {
        EPOCH.after(APART * u32::try_from(self.acted).unwrap_or(u32::MAX) + self.ahead)
    }

    /// Returns the time of an invocation's clock, which stays the same from its beginning to its end, behind the
    /// store's clock.
    fn start(&self) -> Timestamp {
        EPOCH.after(self.ahead)
    }

    /// Returns all possible next steps; none if the world has come to rest. If a request interacts with no other, now
    /// or later, returns only that one, because anything else could as well happen after it.
    pub(super) fn offer(&self, world: &World) -> Offer {
        let mut choices = Vec::new();
        for (place, process) in self.processes.iter().enumerate() {
            for (slot, request) in &process.standing.requests {
                if self.meets_no_other(world, request) {
                    choices.clear();
                    self.add_fates(place, process, *slot, request, &mut choices);
                    return Offer { choices, is_alone: true };
                }
                self.add_fates(place, process, *slot, request, &mut choices);
            }
        }
        choices.extend((0..self.ghosts.len()).map(Choice::Ghost));
        if self.acted < world.acts.len() {
            choices.extend(self.deliveries().map(Choice::User));
        }
        Offer { choices, is_alone: false }
    }

    /// Returns whether nothing that can happen until the world's end changes the reply to the request, or sees its
    /// effect.
    fn meets_no_other(&self, world: &World, request: &Request) -> bool {
        let user_is_done = self.acted == world.acts.len();
        match request {
            // Scripts are the user's alone.
            Request::List(request) => user_is_done && request.prefix.starts_with("scripts/"),
            // A frame is never changed, and here none is deleted.
            Request::Get(key, _) if key.ends_with(".png") => self.contents.bucket.head(key).is_ok(),
            Request::Get(key, _) => user_is_done && key.starts_with("scripts/"),
            // No function reads claims, and no two are called the same.
            Request::Put(key, ..) => {
                key.starts_with("assemblies/") && self.contents.bucket.head(key).is_err()
            }
            Request::Delete(_) => false,
        }
    }

    fn deliveries(&self) -> impl Iterator<Item = Delivery> + use<> {
        let Budget { doubles, drops, .. } = self.budget;
        [(Delivery::Once, true), (Delivery::Twice, doubles > 0), (Delivery::Never, drops > 0)]
            .into_iter()
            .filter_map(|(delivery, may)| may.then_some(delivery))
    }

    fn add_fates(
        &self,
        place: usize,
        process: &Process,
        slot: u32,
        request: &Request,
        choices: &mut Vec<Choice>,
    ) {
        let (is_write, fires) = match request {
            Request::Get(..) | Request::List(_) => (false, false),
            Request::Put(key, ..) => (true, work_of(key, true).is_some()),
            Request::Delete(_) => (true, false),
        };
        let mut add = |fate: Fate| choices.push(Choice::Request { process: place, slot, fate });
        if fires {
            self.deliveries().for_each(|delivery| add(Fate::Answered(delivery)));
        } else {
            add(Fate::Answered(Delivery::Once));
        }
        if self.budget.losses > 0 && is_write {
            add(Fate::Lost { effect: true });
            add(Fate::Lost { effect: false });
        }
        if self.budget.kills > 0 && process.attempt < ATTEMPTS {
            add(Fate::Killed { effect: false });
            if is_write {
                add(Fate::Killed { effect: true });
                if self.budget.ghosts > 0 {
                    add(Fate::KilledAndLate);
                }
            }
        }
    }

    /// The state after something has happened.
    ///
    /// # Errors
    ///
    /// The guarantee that it breaks.
    pub(super) fn after(&self, world: &World, memo: &mut Memo, choice: Choice) -> Result<State, String> {
        let mut next = self.clone();
        match choice {
            Choice::User(delivery) => {
                let (key, text) = &world.acts[self.acted];
                next.acted += 1;
                let request = match text {
                    Some(text) => Request::Put(key.clone(), (*text).into(), PutOptions::always()),
                    None => Request::Delete(key.clone()),
                };
                next.apply(memo, request, None, delivery)?;
            }
            Choice::Ghost(place) => {
                let ghost = next.ghosts.swap_remove(place);
                next.needs_sweep = true;
                next.apply(memo, ghost.request.clone(), Some(ghost.listed), Delivery::Once)?;
            }
            Choice::Request { process: place, slot, fate } => {
                let process = self.processes[place].clone();
                let Some((_, request)) = process.standing.requests.iter().find(|(of, _)| *of == slot) else {
                    return Err("a request that nobody has sent".to_owned());
                };
                next.meet(memo, (place, &process), (slot, request.clone()), fate)?;
            }
        }
        Ok(next)
    }

    fn meet(
        &mut self,
        memo: &mut Memo,
        (place, process): (usize, &Arc<Process>),
        (slot, request): (u32, Request),
        fate: Fate,
    ) -> Result<(), String> {
        let listed = Some(process.listed);
        let answer = match fate {
            Fate::Answered(delivery) => Some(self.apply(memo, request, listed, delivery)?),
            Fate::Lost { effect } => {
                self.budget.losses -= 1;
                if effect {
                    self.apply(memo, request, listed, Delivery::Once)?;
                }
                Some(Answer::Lost)
            }
            Fate::Killed { effect } => {
                self.budget.kills -= 1;
                if effect {
                    self.apply(memo, request, listed, Delivery::Once)?;
                }
                None
            }
            Fate::KilledAndLate => {
                self.budget.kills -= 1;
                self.budget.ghosts -= 1;
                let hash = process.hash ^ u64::from(slot);
                self.ghosts.push(Arc::new(Ghost { request, listed: process.listed, hash }));
                None
            }
        };
        let (now, start) = (self.now(), self.start());
        let (work, id, attempt) = (process.work.clone(), process.request_id.clone(), process.attempt + 1);
        let next = match answer {
            Some(answer) => memo.answer(process, slot, answer, now),
            None => memo.begin(work.clone(), id.clone(), attempt, start),
        };
        match &next.standing.end {
            None => self.processes[place] = next,
            Some(Ok(())) => _ = self.processes.swap_remove(place),
            Some(Err(End::Bug(what))) => return Err(format!("an invocation failed for good: {what}")),
            Some(Err(End::TryAgain)) if attempt <= ATTEMPTS => {
                self.processes[place] = memo.begin(work, id, attempt, start);
            }
            Some(Err(End::TryAgain)) => {
                self.processes.swap_remove(place);
                self.needs_sweep = true;
            }
        }
        Ok(())
    }

    /// Lets a request take effect, and fires the resulting events.
    fn apply(
        &mut self,
        memo: &mut Memo,
        request: Request,
        listed: Option<Timestamp>,
        delivery: Delivery,
    ) -> Result<Answer, String> {
        let now = self.now();
        match request {
            Request::Get(key, range) => Ok(match self.contents.bucket.get_range(&key, range) {
                Ok(object) => Answer::Object(object),
                Err(_) => Answer::NotFound,
            }),
            Request::List(request) => Ok(Answer::Page(self.contents.bucket.list(&request))),
            Request::Delete(key) => {
                if Arc::make_mut(&mut self.contents).delete(&key) {
                    self.changed(memo, &key, false, listed, delivery)?;
                }
                Ok(Answer::Deleted)
            }
            Request::Put(key, body, options) => {
                let before =
                    self.contents.bucket.get(&key).ok().map(|object| (object.info.etag, object.body));
                match Arc::make_mut(&mut self.contents).put(now, &key, body, options) {
                    Ok(etag) => {
                        if let Some(listed) = listed {
                            self.watch(&key, &etag, before, listed)?;
                        }
                        self.changed(memo, &key, true, listed, delivery)?;
                        Ok(Answer::ETag(etag))
                    }
                    Err(Error::NotFound { .. }) => Ok(Answer::NotFound),
                    Err(_) => Ok(Answer::PreconditionFailed),
                }
            }
        }
    }

    fn changed(
        &mut self,
        memo: &mut Memo,
        key: &str,
        there: bool,
        listed: Option<Timestamp>,
        delivery: Delivery,
    ) -> Result<(), String> {
        if listed.is_some() && key.starts_with("scripts/") {
            return Err(format!("a function wrote {key}"));
        }
        let Some(work) = work_of(key, there) else { return Ok(()) };
        let copies = match delivery {
            Delivery::Once => 1,
            Delivery::Twice => {
                self.budget.doubles -= 1;
                2
            }
            Delivery::Never => {
                self.budget.drops -= 1;
                self.needs_sweep = true;
                0
            }
        };
        for _ in 0..copies {
            let number = Arc::make_mut(&mut self.contents).fire(key);
            let id = format!("{key}#{number}").into();
            let process = memo.begin(work.clone(), id, 1, self.start());
            self.processes.push(process);
        }
        Ok(())
    }

    /// Checks the invariants of every write of a function.
    fn watch(
        &mut self,
        key: &str,
        etag: &ETag,
        before: Option<(ETag, bytes::Bytes)>,
        listed: Timestamp,
    ) -> Result<(), String> {
        match key.parse::<Key>() {
            Err(_) => Err(format!("{key} was written, which is no key")),
            Ok(Key::Manifest { animation }) => {
                let before = before.and_then(|(_, body)| Manifest::decode(&animation, &body).ok());
                let body = self.contents.bucket.get(key).map(|object| object.body).unwrap_or_default();
                let next = Manifest::decode(&animation, &body).map_err(|error| error.to_string())?;
                follows(&next, before.as_ref())
            }
            Ok(Key::Output { output, .. }) => {
                let is_same = before.as_ref().is_some_and(|(of, _)| of == etag);
                let file_of = self.files_of.entry(output).or_default();
                if before.is_some() && !is_same && listed < *file_of {
                    return Err(format!("a {} gave way to one from an older listing", output.name()));
                }
                *file_of = if is_same { listed.min(*file_of) } else { listed };
                Ok(())
            }
            Ok(_) => Ok(()),
        }
    }

    /// Checks the invariants that hold when nothing is left to do: after sweeps, if something happened that only a
    /// sweep repairs.
    pub(super) fn judge(&self, world: &World, memo: &mut Memo) -> Result<(), String> {
        let animation = Animation::new("a").map_err(|error| error.to_string())?;
        let check = |state: &State| {
            Expected::of(&state.contents.bucket, &animation).check(&state.contents.bucket, &animation)
        };
        if !self.needs_sweep {
            check(self).map_err(|what| format!("without a sweep: {what}"))?;
            if self.contents.bucket.keys().any(|key| matches!(key.parse(), Ok(Key::Lease { .. }))) {
                return Err("a lease is left".to_owned());
            }
            return Ok(());
        }
        let mut state = self.clone();
        for _ in 0..SWEEPS {
            state.ahead += SWEEPS_APART;
            let number = Arc::make_mut(&mut state.contents).fire("sweep");
            let id = format!("sweep#{number}").into();
            let sweep = memo.begin(Work::Sweep, id, 1, state.start());
            state.processes.push(sweep);
            state = state.at_rest(world, memo)?;
        }
        check(&state).map_err(|what| format!("after {SWEEPS} sweeps: {what}"))
    }

    /// Runs all invocations to their ends, one after the other, without faults.
    fn at_rest(mut self, world: &World, memo: &mut Memo) -> Result<Self, String> {
        for _ in 0..MAX_STEPS {
            let Some(process) = self.processes.first() else { return Ok(self) };
            let Some((slot, _)) = process.standing.requests.first() else {
                return Err("an invocation waits for nothing".to_owned());
            };
            let fate = Fate::Answered(Delivery::Once);
            self = self.after(world, memo, Choice::Request { process: 0, slot: *slot, fate })?;
        }
        Err("the world does not come to rest".to_owned())
    }

    /// Returns the actor of a choice: the user, an attempt at an event, or the pending write of a killed sender.
    pub(super) fn actor(&self, choice: Choice) -> u64 {
        match choice {
            Choice::User(_) => USER,
            Choice::Ghost(place) => self.ghosts[place].hash,
            Choice::Request { process, .. } => {
                let process = &self.processes[process];
                hash_of(&(&process.request_id, process.attempt))
            }
        }
    }

    /// Returns whether an invocation is about to write.
    pub(super) fn is_write(&self, choice: Choice) -> bool {
        let Choice::Request { process, slot, .. } = choice else { return false };
        let request = self.processes[process].standing.requests.iter().find(|(of, _)| *of == slot);
        matches!(request, Some((_, Request::Put(..) | Request::Delete(_))))
    }

    /// Describes a choice in words, for the reader of a counterexample.
    pub(super) fn describe(&self, world: &World, choice: Choice) -> String {
        match choice {
            Choice::User(delivery) => {
                let (key, text) = &world.acts[self.acted];
                format!("the user: {key} {text:?}, event {delivery:?}")
            }
            Choice::Ghost(place) => format!("lands late: {}", words(&self.ghosts[place].request)),
            Choice::Request { process, slot, fate } => {
                let process = &self.processes[process];
                let request = process.standing.requests.iter().find(|(of, _)| *of == slot);
                let request = request.map_or_else(String::new, |(_, request)| words(request));
                format!("{} ({}): {request}: {fate:?}", process.request_id, process.attempt)
            }
        }
    }
}

impl Contents {
    fn put(
        &mut self,
        now: Timestamp,
        key: &str,
        body: bytes::Bytes,
        options: PutOptions,
    ) -> rayfold_pipeline::Result<ETag> {
        let before = self.hash_of(key);
        let etag = self.bucket.put(now, key, body, options)?;
        self.hash ^= before ^ self.hash_of(key);
        Ok(etag)
    }

    fn delete(&mut self, key: &str) -> bool {
        self.hash ^= self.hash_of(key);
        self.bucket.delete(key)
    }

    /// Returns the number of times that the key has fired, including this time.
    fn fire(&mut self, key: &str) -> u32 {
        let count = self.fired.entry(key.to_owned()).or_default();
        *count += 1;
        let count = *count;
        self.hash ^= hash_of(&("fired", key, count));
        count
    }

    fn hash_of(&self, key: &str) -> u64 {
        let Ok(info) = self.bucket.head(key) else { return 0 };
        hash_of(&(key, info.etag.as_str(), info.modified, &info.metadata))
    }
}

/// Returns the work that is triggered when an object is created or deleted.
fn work_of(key: &str, there: bool) -> Option<Work> {
    match key.split('/').next() {
        Some("scripts") => Some(Work::Render(key.to_owned())),
        Some("parts" | "retries") if there => Some(Work::Render(key.to_owned())),
        Some("assemblies") if there => Some(Work::Assemble(key.to_owned())),
        _ => None,
    }
}

fn words(request: &Request) -> String {
    match request {
        Request::Get(key, range) if range.end == 0 => format!("head {key}"),
        Request::Get(key, _) => format!("get {key}"),
        Request::Put(key, _, options) => format!("put {key} {:?}", options.condition),
        Request::Delete(key) => format!("delete {key}"),
        Request::List(request) => format!("list {}", request.prefix),
    }
}
