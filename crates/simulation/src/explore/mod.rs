//! Searches small worlds instead of drawing them at random: all interleavings of the real steps, or those that are most
//! likely to show errors.
//!
//! [`explore`] visits every state that a [`World`] can reach. Requests of invocations come in any order. Within the
//! world's budget there are kills before and after any request, writes that take effect after their sender was killed,
//! lost replies, and events that come twice or never. States are distinguished by a hash of 64 bits. If a request
//! cannot interact with any other, only that request is followed (partial-order reduction, which misses nothing in a
//! world that always comes to rest). States that need few preemptions come first. [`provoke`] runs schedules that are
//! chosen to provoke errors, with preemptions and faults aimed at writes.
//!
//! The invariants are those that [`super::run`] checks. Revisions grow by one. No function writes below `scripts/`. No
//! GIF is replaced by one from an older listing. When nothing is left to do, manifest and GIF follow from the scripts,
//! after sweeps if something happened that only a sweep repairs.
//!
//! The search does not cover listings that mix two moments, deadlines, or time: the store's clock advances only with
//! the user's actions, and other clocks stand still. The seeds of [`super::run`] cover these.

mod order;
mod process;
mod search;
mod state;
#[cfg(test)]
mod tests;
mod worlds;

use order::{Kind, MAX_WRITES, Order, pick};
use process::Memo;
use rayfold_pipeline::{Mutation, Randomness};
pub use search::explore;
use state::{Choice, Fate, Offer, State};
pub use worlds::{World, provoking, worlds};

/// The number of faults of each kind in a world.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Budget {
    /// The number of invocations killed.
    pub kills: u8,
    /// The maximum number of these kills after which a write still takes effect.
    pub ghosts: u8,
    /// Writes whose replies are lost.
    pub losses: u8,
    /// Events that are delivered twice.
    pub doubles: u8,
    /// Events that are never delivered.
    pub drops: u8,
}

/// The result of a search.
#[derive(Debug, Clone, Default)]
pub struct Explored {
    /// The number of different states.
    pub states: u64,
    /// The number of states in which nothing is left to do.
    pub rests: u64,
    /// The number of different situations: the contents of the bucket, and the next request of every invocation.
    pub situations: u64,
    /// A hash of all these.
    pub all_situations: u64,
    /// The number of steps from one state to another.
    pub steps: u64,
    /// The largest number of steps to a state of rest, on the path on which that state was reached first.
    pub depth: usize,
    /// The largest weight of the preemptions and faults on the path on which a state was reached first: 1 before a
    /// write, 2 elsewhere. If the search ended at its limit, the smallest weight of a path that it did not follow.
    pub price: usize,
    /// Whether there was nothing more to visit; otherwise the search ended at its limit.
    pub complete: bool,
}

impl Explored {
    /// Returns whether both searches reached the same situations, and the same number of states of rest.
    pub fn saw_the_same_as(&self, other: &Explored) -> bool {
        let seen = |of: &Explored| (of.situations, of.all_situations, of.rests);
        seen(self) == seen(other)
    }
}

/// A violated guarantee, and the steps that led to it.
#[derive(Debug, Clone, thiserror::Error)]
#[error("{world}: {what}\n{}", steps.join("\n"))]
pub struct Counterexample {
    /// The name of the world.
    pub world: &'static str,
    /// The invariant that does not hold.
    pub what: String,
    /// The steps that led there, in order, as text.
    pub steps: Vec<String>,
    /// The number of states that were visited before; 0 in a schedule.
    pub states: u64,
    /// The weight of the preemptions and faults on the path; not counted in a schedule.
    pub price: usize,
}

/// The number of schedules of each kind that a seed runs in each world.
const SCHEDULES: usize = 2;

/// Runs a few schedules of each kind in each world.
///
/// # Errors
///
/// The first guarantee that does not hold.
pub fn provoke(worlds: &[World], seed: u64, mutation: Option<Mutation>) -> Result<(), Box<Counterexample>> {
    let random = Randomness::seeded(seed.wrapping_mul(0x2545_f491_4f6c_dd1d) ^ 0x70_6374);
    worlds.iter().try_for_each(|world| {
        let mut memo = Memo::new(world, mutation);
        let begin = State::begin(world, &mut memo);
        let begin = begin.map_err(|what| counterexample_of_schedule(world, what, &[]))?;
        let kinds = Kind::ALL.repeat(SCHEDULES);
        kinds.into_iter().try_for_each(|kind| {
            schedule(world, begin.clone(), &mut memo, Order::new(&random, kind), &random)
        })
    })
}

/// The points at which faults happen.
enum Aim {
    /// At one of this number of steps, on average.
    Anywhere(u64),
    /// At this write, counted from 0.
    Write(u64),
}

impl Aim {
    fn new(random: &Randomness) -> Self {
        match random.one_in(2) {
            true => Aim::Write(random.below(MAX_WRITES)),
            false => Aim::Anywhere(1 + random.below(12)),
        }
    }

    /// Returns whether a fault happens now, after `writes` begun writes.
    fn is_met(&self, is_write: bool, writes: u64, random: &Randomness) -> bool {
        match self {
            Aim::Anywhere(seldom) => random.one_in(*seldom),
            Aim::Write(number) => is_write && writes == *number,
        }
    }
}

fn counterexample_of_schedule(world: &World, what: String, steps: &[String]) -> Box<Counterexample> {
    Box::new(Counterexample { world: world.name, what, steps: steps.to_vec(), states: 0, price: 0 })
}

fn schedule(
    world: &World,
    mut state: State,
    memo: &mut Memo,
    mut order: Order,
    random: &Randomness,
) -> Result<(), Box<Counterexample>> {
    let mut steps = Vec::new();
    let failed = |what: String, steps: &[String]| counterexample_of_schedule(world, what, steps);
    let (aim, mut writes) = (Aim::new(random), 0);
    let lands_last = random.one_in(2);
    loop {
        let Offer { mut choices, is_alone } = state.offer(world);
        if lands_last && choices.iter().any(|choice| !matches!(choice, Choice::Ghost(_))) {
            choices.retain(|choice| !matches!(choice, Choice::Ghost(_)));
        }
        // A request that meets no other is no turn of its own.
        let alone = choices.first().filter(|_| is_alone).map(|choice| state.actor(*choice));
        let Some(actor) = alone.or_else(|| order.next(&state, &choices, random)) else { break };
        let mine = choices.into_iter().filter(|choice| state.actor(*choice) == actor);
        let (plain, mut awkward): (Vec<Choice>, Vec<Choice>) = mine.partition(|choice| is_plain(*choice));
        // A schedule in which a write lands last needs it to be on its way.
        if lands_last && awkward.iter().any(|choice| is_late(*choice)) {
            awkward.retain(|choice| is_late(*choice));
        }
        let is_write = plain.iter().any(|choice| state.is_write(*choice));
        let is_awkward = !awkward.is_empty() && (plain.is_empty() || aim.is_met(is_write, writes, random));
        writes += u64::from(is_write);
        let choice = pick(if is_awkward { &awkward } else { &plain }, random);
        let Some(choice) = choice.copied() else { break };
        order.done(&state, choice);
        steps.push(state.describe(world, choice));
        state = state.after(world, memo, choice).map_err(|what| failed(what, &steps))?;
    }
    state.judge(world, memo).map_err(|what| failed(what, &steps))
}

/// Returns whether a write takes effect later because of it.
fn is_late(choice: Choice) -> bool {
    matches!(choice, Choice::Request { fate: Fate::KilledAndLate, .. })
}

/// Returns whether it contains no fault.
fn is_plain(choice: Choice) -> bool {
    use state::Delivery;
    match choice {
        Choice::User(delivery) => delivery == Delivery::Once,
        Choice::Request { fate, .. } => fate == Fate::Answered(Delivery::Once),
        Choice::Ghost(_) => true,
    }
}
