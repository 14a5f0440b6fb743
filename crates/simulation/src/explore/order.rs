//! The order in which processes continue in a provoking schedule.

use std::collections::{BTreeMap, BTreeSet};

use super::state::{Choice, State};
use rayfold_pipeline::Randomness;

/// The number of times that priorities change in a schedule.
const CHANGES: u32 = 4;

/// The maximum number of preemptions of a schedule with few.
const FEW: u64 = 2;

/// The number of writes of a schedule, from its start, at which preemptions and faults can be aimed. Schedules of most
/// worlds have no more writes.
pub(super) const MAX_WRITES: u64 = 12;

/// Random priorities are above this; changed priorities are below.
const DRAWN: u64 = 1 << 63;

/// A way to choose who goes on.
#[derive(Debug)]
pub(super) enum Order {
    /// The process with the highest priority continues. Priorities are random; the user gets a new one after each
    /// action. A few times a priority falls below all others, mostly before a write (probabilistic concurrency testing;
    /// Burckhardt et al., ASPLOS 2010).
    Priorities { priorities: BTreeMap<u64, u64>, changes: u32, lowest: u64, pauses: Pauses },
    /// The process that continued before goes on up to a pause; then a random one continues.
    Turns { current: Option<u64>, pauses: Pauses },
    /// The process that continued before goes on to its end, except for a few writes before which a random other one
    /// continues (context bounding; Musuvathi and Qadeer, PLDI 2007). `writes` counts the writes so far.
    Few { current: Option<u64>, preempted: Vec<u64>, writes: u64 },
}

/// The kinds of orders.
#[derive(Debug, Clone, Copy)]
pub(super) enum Kind {
    Priorities,
    Turns,
    Few,
}

impl Kind {
    pub(super) const ALL: [Kind; 3] = [Kind::Priorities, Kind::Turns, Kind::Few];
}

/// A process is suspended before one in this many writes, and at one in this many other steps.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pauses {
    before_writes: u64,
    elsewhere: u64,
}

impl Order {
    pub(super) fn new(random: &Randomness, kind: Kind) -> Self {
        let pauses = Pauses { before_writes: 2 + random.below(3), elsewhere: 15 + random.below(80) };
        match kind {
            Kind::Priorities => {
                Order::Priorities { priorities: BTreeMap::new(), changes: CHANGES, lowest: DRAWN - 1, pauses }
            }
            Kind::Turns => Order::Turns { current: None, pauses },
            Kind::Few => {
                let preempted = (0..random.below(FEW + 1)).map(|_| random.below(MAX_WRITES)).collect();
                Order::Few { current: None, preempted, writes: 0 }
            }
        }
    }

    /// Returns the process that continues, or `None` if nothing is left to do.
    pub(super) fn next(&mut self, state: &State, choices: &[Choice], random: &Randomness) -> Option<u64> {
        let actors: BTreeSet<u64> = choices.iter().map(|choice| state.actor(*choice)).collect();
        let actors: Vec<u64> = actors.into_iter().collect();
        let is_writing = |actor: u64| {
            choices.iter().any(|choice| state.actor(*choice) == actor && state.is_write(*choice))
        };
        let pauses = |actor: u64, pauses: &Pauses| {
            random.one_in(if is_writing(actor) { pauses.before_writes } else { pauses.elsewhere })
        };
        match self {
            Order::Turns { current, pauses: at } => {
                let stays = current.filter(|current| actors.contains(current) && !pauses(*current, at));
                *current = stays.or_else(|| pick(&actors, random).copied());
                *current
            }
            Order::Few { current, preempted, writes } => {
                let goes_on = current.filter(|current| actors.contains(current));
                let first = goes_on.or_else(|| pick(&actors, random).copied())?;
                let is_preempted = is_writing(first) && preempted.contains(writes);
                *writes += u64::from(is_writing(first));
                let others: Vec<u64> = actors.iter().copied().filter(|actor| *actor != first).collect();
                *current = pick(&others, random).copied().filter(|_| is_preempted).or(Some(first));
                *current
            }
            Order::Priorities { priorities, changes, lowest, pauses: at } => loop {
                let priority = |actor: &u64| {
                    (*priorities.entry(*actor).or_insert_with(|| random.bits() | DRAWN), *actor)
                };
                let (_, first) = actors.iter().map(priority).max()?;
                if *changes == 0 || !pauses(first, at) {
                    return Some(first);
                }
                *changes -= 1;
                *lowest -= 1;
                priorities.insert(first, *lowest);
            },
        }
    }

    /// Records the choice that was made.
    pub(super) fn done(&mut self, state: &State, choice: Choice) {
        if let Choice::User(_) = choice {
            match self {
                Order::Priorities { priorities, .. } => _ = priorities.remove(&state.actor(choice)),
                Order::Turns { current, .. } | Order::Few { current, .. } => *current = None,
            }
        }
    }
}

/// Returns any of them at random, or `None` if there is none.
pub(super) fn pick<'a, T>(from: &'a [T], random: &Randomness) -> Option<&'a T> {
    from.get(usize::try_from(random.below(from.len() as u64)).unwrap_or(0))
}
