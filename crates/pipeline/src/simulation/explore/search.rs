//! All states of a world, those first that few preemptions and faults lead to.
//!
//! A preemption is that somebody goes on though whoever went on before still could; that the user pauses after an act, and
//! that somebody goes on where another one has ended or died, is none. What is wrong with a protocol mostly shows after one
//! or two (iterative context bounding; Musuvathi and Qadeer, PLDI 2007), before a write rather than before a read, so it is
//! found long before the search has come to its end. Each state is visited once, from whichever side it is reached first:
//! nothing is left out for the order's sake.

use std::collections::BTreeSet;
use std::rc::Rc;

use super::process::Memo;
use super::state::{Choice, State, USER};
use super::{Counterexample, Explored, World, is_plain};
use crate::Mutation;

/// What a preemption or a fault weighs before a write, and elsewhere.
const PRICES: [usize; 2] = [1, 2];

/// How a state was reached: from which visited one, and by what.
struct Step {
    from: usize,
    choice: Choice,
    depth: usize,
}

/// A step that is still to be tried.
struct Open {
    state: Rc<State>,
    step: Step,
    /// Who goes on after it, if nobody is preempted.
    current: u64,
}

/// What is still to be tried, by what its preemptions and faults weigh; the newest first among equals.
#[derive(Default)]
struct Frontier(Vec<Vec<Open>>);

impl Frontier {
    fn push(&mut self, price: usize, open: Open) {
        if self.0.len() <= price {
            self.0.resize_with(price + 1, Vec::new);
        }
        self.0[price].push(open);
    }

    fn pop(&mut self) -> Option<(usize, Open)> {
        let price = self.0.iter().position(|of_a_price| !of_a_price.is_empty())?;
        self.0[price].pop().map(|open| (price, open))
    }
}

/// The search of one world.
struct Search<'a> {
    world: &'a World,
    memo: Memo,
    mutation: Option<Mutation>,
    seen: BTreeSet<u64>,
    /// By the number of the state that they led to; none to the beginning.
    steps: Vec<Option<Step>>,
    frontier: Frontier,
    explored: Explored,
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
    let mut memo = Memo::new(world, mutation);
    let failed =
        |what| Box::new(Counterexample { world: world.name, what, steps: Vec::new(), states: 0, price: 0 });
    let begin = State::begin(world, &mut memo).map_err(failed)?;
    let (seen, explored) = (BTreeSet::new(), Explored::default());
    let (steps, frontier) = (Vec::new(), Frontier::default());
    let mut search = Search { world, memo, mutation, seen, steps, frontier, explored };
    search.visit(begin, None, USER, 0)?;
    while search.explored.states < most {
        let Some((price, Open { state, step, current })) = search.frontier.pop() else {
            search.explored.complete = true;
            break;
        };
        search.explored.steps += 1;
        match state.after(world, &mut search.memo, step.choice) {
            Ok(next) => search.visit(next, Some(step), current, price)?,
            Err(what) => return Err(search.counterexample(what, Some(&step), price)),
        }
    }
    Ok(search.explored)
}

impl Search<'_> {
    /// Judges a state in which nothing is left to happen; of another one notes what can happen next.
    fn visit(
        &mut self,
        state: State,
        step: Option<Step>,
        current: u64,
        price: usize,
    ) -> Result<(), Box<Counterexample>> {
        if !self.seen.insert(state.hash()) {
            return Ok(());
        }
        let depth = step.as_ref().map_or(0, |step| step.depth);
        self.explored.states += 1;
        self.explored.price = self.explored.price.max(price);
        let offer = state.offer(self.world);
        if offer.choices.is_empty() {
            self.explored.rests += 1;
            self.explored.depth = self.explored.depth.max(depth);
            if let Err(what) = state.judge(self.world, &mut self.memo) {
                return Err(self.counterexample(what, step.as_ref(), price));
            }
        }
        let place = self.steps.len();
        self.steps.push(step);
        let state = Rc::new(state);
        let of_current = || offer.choices.iter().filter(|choice| state.actor(**choice) == current);
        let goes_on = of_current().next().is_some();
        let weight = |is_write: bool| if is_write { PRICES[0] } else { PRICES[1] };
        let preemption = weight(of_current().any(|choice| state.is_write(*choice)));
        for choice in offer.choices.iter().copied().rev() {
            let actor = state.actor(choice);
            let is_preempted = !offer.is_alone && goes_on && actor != current && current != USER;
            let preemption = if is_preempted { preemption } else { 0 };
            let fault = if is_plain(choice) { 0 } else { weight(state.is_write(choice)) };
            // What meets nobody is no turn of its own.
            let current = if offer.is_alone { current } else { actor };
            let step = Step { from: place, choice, depth: depth + 1 };
            let open = Open { state: state.clone(), step, current };
            self.frontier.push(price + preemption + fault, open);
        }
        Ok(())
    }

    /// Lives through the way to a state again, to tell it.
    fn counterexample(&self, what: String, last: Option<&Step>, price: usize) -> Box<Counterexample> {
        let mut choices = Vec::new();
        let mut step = last;
        while let Some(Step { from, choice, .. }) = step {
            choices.push(*choice);
            step = self.steps.get(*from).and_then(Option::as_ref);
        }
        let mut memo = Memo::new(self.world, self.mutation);
        let mut told = Vec::new();
        let mut state = State::begin(self.world, &mut memo).ok();
        for choice in choices.into_iter().rev() {
            let Some(before) = state else { break };
            told.push(before.describe(self.world, choice));
            state = before.after(self.world, &mut memo, choice).ok();
        }
        let (world, states) = (self.world.name, self.explored.states);
        Box::new(Counterexample { world, what, steps: told, states, price })
    }
}
