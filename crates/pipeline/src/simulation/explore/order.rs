//! Who goes on next in a schedule that is to provoke.

use std::collections::{BTreeMap, BTreeSet};

use super::state::{Choice, State};
use crate::Randomness;

/// How often priorities change in a schedule.
const CHANGES: u32 = 4;

/// Priorities that are drawn by lot are above this, those that have changed below.
const DRAWN: u64 = 1 << 63;

/// A way to choose who goes on.
#[derive(Debug)]
pub(super) enum Order {
    /// Whoever has the highest priority. Priorities are drawn by lot, the user's anew after each act, and fall below all
    /// others a few times, mostly before a write (probabilistic concurrency testing; Burckhardt et al., ASPLOS 2010).
    Priorities { priorities: BTreeMap<u64, u64>, changes: u32, lowest: u64, pauses: Pauses },
    /// Whoever went on before, up to a pause; then whoever the lot falls on.
    Turns { current: Option<u64>, pauses: Pauses },
}

/// How seldom somebody is put off.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pauses {
    before_writes: u64,
    elsewhere: u64,
}

impl Order {
    pub(super) fn new(random: &Randomness, by_priorities: bool) -> Self {
        let pauses = Pauses { before_writes: 2 + random.below(3), elsewhere: 15 + random.below(80) };
        if by_priorities {
            Order::Priorities { priorities: BTreeMap::new(), changes: CHANGES, lowest: DRAWN - 1, pauses }
        } else {
            Order::Turns { current: None, pauses }
        }
    }

    /// Who goes on; nobody when nothing is left to happen.
    pub(super) fn next(&mut self, state: &State, choices: &[Choice], random: &Randomness) -> Option<u64> {
        let actors: BTreeSet<u64> = choices.iter().map(|choice| state.actor(*choice)).collect();
        let actors: Vec<u64> = actors.into_iter().collect();
        let pauses = |actor: u64, pauses: &Pauses| {
            let writes = |choice: &&Choice| state.actor(**choice) == actor && state.is_write(**choice);
            let seldom = choices.iter().find(writes).map_or(pauses.elsewhere, |_| pauses.before_writes);
            random.one_in(seldom)
        };
        match self {
            Order::Turns { current, pauses: at } => {
                let stays = current.filter(|current| actors.contains(current) && !pauses(*current, at));
                *current = stays.or_else(|| pick(&actors, random).copied());
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

    /// Says what has been chosen.
    pub(super) fn done(&mut self, state: &State, choice: Choice) {
        if let Choice::User(_) = choice {
            match self {
                Order::Priorities { priorities, .. } => _ = priorities.remove(&state.actor(choice)),
                Order::Turns { current, .. } => *current = None,
            }
        }
    }
}

/// Any of them; none if there is none.
pub(super) fn pick<'a, T>(from: &'a [T], random: &Randomness) -> Option<&'a T> {
    from.get(usize::try_from(random.below(from.len() as u64)).unwrap_or(0))
}
