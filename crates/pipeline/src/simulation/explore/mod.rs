//! Small worlds searched instead of drawn by lot: all interleavings of the real steps, or those that provoke most.
//!
//! [`explore`] visits every state that a [`World`] can come to: invocations' requests in any order, and within the world's
//! budget kills before and after any request, writes that land after their sender's death, lost answers, and events that
//! come twice or never. States are told apart by a hash of 64 bits; a request that can meet no other is taken alone
//! (partial-order reduction: in a world that always comes to rest nothing is missed by it). [`provoke`] runs schedules that
//! are chosen to provoke, with the faults aimed at writes.
//!
//! What must hold is what [`super::run`] checks: revisions grow by one, no function writes below `scripts/`, no GIF gives
//! way to one from an older listing, and at rest manifest and GIF are what the scripts say, after sweeps where something
//! happened that only they heal.
//!
//! Not searched: listings that mix two moments, time (clocks move with the user's acts alone), the deadline. The seeds of
//! [`super::run`] have these.

mod order;
mod process;
mod state;
#[cfg(test)]
mod tests;
mod worlds;

use std::collections::BTreeSet;

use crate::{Mutation, Randomness};
use order::{Order, pick};
use process::Memo;
use state::{Choice, Fate, State};
pub use worlds::{World, provoking, worlds};

/// How often what may go wrong in a world.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Budget {
    /// Invocations killed.
    pub kills: u8,
    /// Of these, writes that land after their sender is dead.
    pub ghosts: u8,
    /// Answers to writes lost.
    pub losses: u8,
    /// Events that come twice.
    pub doubles: u8,
    /// Events that never come.
    pub drops: u8,
}

/// What a search has seen.
#[derive(Debug, Clone, Default)]
pub struct Explored {
    /// States that differ.
    pub states: u64,
    /// States in which nothing is left to happen.
    pub rests: u64,
    /// Steps from one state to another.
    pub steps: u64,
    /// The most steps to a state of rest.
    pub depth: usize,
    /// There was no more to see; else the search ended at its limit.
    pub complete: bool,
}

/// A guarantee that does not hold, and how it came to that.
#[derive(Debug, Clone, thiserror::Error)]
#[error("{world}: {what}\n{}", steps.join("\n"))]
pub struct Counterexample {
    /// The world.
    pub world: &'static str,
    /// What does not hold.
    pub what: String,
    /// What happened, one thing after the other.
    pub steps: Vec<String>,
    /// How many states were seen before; none by a schedule.
    pub states: u64,
}

/// A state on the way, and what of it is still to be tried.
struct Stop {
    state: State,
    choices: Vec<Choice>,
    next: usize,
}

/// Searches a world to its end, or until it has seen `most` states, with a rule broken on purpose if asked for.
///
/// # Errors
///
/// The first guarantee that does not hold.
pub fn explore(
    world: &World,
    mutation: Option<Mutation>,
    most: u64,
) -> Result<Explored, Box<Counterexample>> {
    let mut memo = Memo::new(mutation);
    let mut path: Vec<Stop> = Vec::new();
    let mut seen = BTreeSet::new();
    let mut explored = Explored::default();
    let mut next = State::begin(world, &mut memo).map_err(|what| counterexample(world, what, &[], 0))?;
    loop {
        if seen.insert(next.hash()) {
            let choices = next.choices(world);
            explored.states += 1;
            if choices.is_empty() {
                explored.rests += 1;
                explored.depth = explored.depth.max(path.len());
                next.judge(world, &mut memo)
                    .map_err(|what| counterexample(world, what, &path, explored.states))?;
            }
            path.push(Stop { state: next, choices, next: 0 });
        }
        loop {
            let Some(stop) = path.last_mut() else {
                explored.complete = true;
                return Ok(explored);
            };
            if explored.states >= most {
                return Ok(explored);
            }
            let Some(choice) = stop.choices.get(stop.next).copied() else {
                path.pop();
                continue;
            };
            stop.next += 1;
            explored.steps += 1;
            let after = stop.state.after(world, &mut memo, choice);
            next = after.map_err(|what| counterexample(world, what, &path, explored.states))?;
            break;
        }
    }
}

fn counterexample(world: &World, what: String, path: &[Stop], states: u64) -> Box<Counterexample> {
    let steps = path.iter().filter_map(|Stop { state, choices, next }| {
        Some(state.describe(world, *choices.get(next.checked_sub(1)?)?))
    });
    Box::new(Counterexample { world: world.name, what, steps: steps.collect(), states })
}

/// Schedules of a seed in each world.
const SCHEDULES: u64 = 4;

/// Runs a few schedules in each world, half of them by priorities, half by turns.
///
/// # Errors
///
/// The first guarantee that does not hold.
pub fn provoke(worlds: &[World], seed: u64, mutation: Option<Mutation>) -> Result<(), Box<Counterexample>> {
    let random = Randomness::seeded(seed.wrapping_mul(0x2545_f491_4f6c_dd1d) ^ 0x70_6374);
    worlds.iter().try_for_each(|world| {
        (0..SCHEDULES)
            .try_for_each(|number| schedule(world, &random, Order::new(&random, number % 2 == 0), mutation))
    })
}

fn schedule(
    world: &World,
    random: &Randomness,
    mut order: Order,
    mutation: Option<Mutation>,
) -> Result<(), Box<Counterexample>> {
    let mut memo = Memo::new(mutation);
    let mut steps = Vec::new();
    let failed = |what: String, steps: &[String]| {
        Box::new(Counterexample { world: world.name, what, steps: steps.to_vec(), states: 0 })
    };
    let mut state = State::begin(world, &mut memo).map_err(|what| failed(what, &steps))?;
    // How seldom something goes wrong that may.
    let calm = 1 + random.below(12);
    loop {
        let choices = state.choices(world);
        let Some(actor) = order.next(&state, &choices, random) else { break };
        let mine = choices.into_iter().filter(|choice| state.actor(*choice) == actor);
        let (plain, awkward): (Vec<Choice>, Vec<Choice>) = mine.partition(|choice| is_plain(*choice));
        let is_awkward = !awkward.is_empty() && (random.one_in(calm) || plain.is_empty());
        let choice = pick(if is_awkward { &awkward } else { &plain }, random);
        let Some(choice) = choice.copied() else { break };
        order.done(&state, choice);
        steps.push(state.describe(world, choice));
        state = state.after(world, &mut memo, choice).map_err(|what| failed(what, &steps))?;
    }
    state.judge(world, &mut memo).map_err(|what| failed(what, &steps))
}

/// Whether nothing goes wrong in it.
fn is_plain(choice: Choice) -> bool {
    use state::Delivery;
    match choice {
        Choice::User(delivery) => delivery == Delivery::Once,
        Choice::Request { fate, .. } => fate == Fate::Answered(Delivery::Once),
        Choice::Ghost(_) => true,
    }
}
