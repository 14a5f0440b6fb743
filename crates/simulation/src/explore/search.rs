//! Visits all states of a world, beginning with those that need few preemptions and faults.
//!
//! A preemption is a switch to another process although the current one could continue. It is no preemption if the user
//! pauses after an action, or if the current process has ended or was killed. Most errors of a protocol show after one
//! or two preemptions (iterative context bounding; Musuvathi and Qadeer, PLDI 2007), before a write rather than before
//! a read. So they are found long before the search ends. Each state is visited once, on the first path that reaches
//! it. The order of the search leaves no state out.
//!
//! For a state that has been visited, its hash and the step that led to it are kept. Whole states are kept only while
//! some of their steps are untried. If these become too many, the newest ones are tried first, which keeps their number
//! small.

use std::hash::{BuildHasherDefault, Hasher};
use std::rc::Rc;

use super::process::Memo;
use super::state::{Choice, State, USER};
use super::{Counterexample, Explored, World, is_plain};
use rayfold_pipeline::Mutation;

/// The weight of a preemption or a fault before a write, and elsewhere.
const PRICES: [usize; 2] = [1, 2];

/// The number of untried steps above which the newest ones are tried first.
const MANY: usize = 1_000_000;

/// The link to the predecessor of a state: the visited state before it, and the number of its choice. It is small,
/// because there is one per state.
#[derive(Clone, Copy)]
struct Step {
    from: u32,
    choice: u16,
}

/// The way to a state.
#[derive(Clone, Copy)]
struct Way {
    /// The last step of it.
    step: Step,
    /// The number of steps from the beginning.
    depth: usize,
    /// The weight of its preemptions and faults.
    price: usize,
    /// The process that continues after it, if none is preempted.
    current: u64,
}

/// A step that is untried.
struct Open {
    state: Rc<State>,
    choice: Choice,
    way: Way,
}

/// The untried steps, by the weight of their preemptions and faults; the newest first among equals.
#[derive(Default)]
struct Frontier {
    by_price: Vec<Vec<Open>>,
    len: usize,
}

impl Frontier {
    fn push(&mut self, open: Open) {
        let price = open.way.price;
        if self.by_price.len() <= price {
            self.by_price.resize_with(price + 1, Vec::new);
        }
        self.by_price[price].push(open);
        self.len += 1;
    }

    /// Returns the weight of the cheapest one.
    fn cheapest(&self) -> usize {
        self.by_price.iter().position(|of_a_price| !of_a_price.is_empty()).unwrap_or_default()
    }

    /// Returns the cheapest one, or the most expensive one if there are many.
    fn pop(&mut self) -> Option<Open> {
        let is_some = |of_a_price: &Vec<Open>| !of_a_price.is_empty();
        let price = match self.len {
            0..MANY => self.by_price.iter().position(is_some)?,
            _ => self.by_price.iter().rposition(is_some)?,
        };
        self.len -= 1;
        self.by_price[price].pop()
    }
}

/// The hashes of the visited states, which serve as keys without another hash.
#[expect(clippy::disallowed_types, reason = "nothing is drawn by lot here, and there are many millions")]
type Seen = std::collections::HashSet<u64, BuildHasherDefault<AsItIs>>;

/// A number is its own hash.
#[derive(Default)]
struct AsItIs(u64);

impl Hasher for AsItIs {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|byte| self.0 = self.0.rotate_left(8) ^ u64::from(*byte));
    }

    fn write_u64(&mut self, number: u64) {
        self.0 = number;
    }
}

/// The search of one world.
struct Search<'a> {
    world: &'a World,
    memo: Memo,
    mutation: Option<Mutation>,
    seen: Seen,
    situations: Seen,
    /// The links, by the number of the state that they lead to. No link leads to the beginning, so it has a
    /// placeholder.
    steps: Vec<Step>,
    frontier: Frontier,
    explored: Explored,
}

/// Searches a world to its end, or until it has visited `most` states. `mutation` is a rule that is broken on purpose.
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
    let (seen, situations, explored) = (Seen::default(), Seen::default(), Explored::default());
    let (steps, frontier) = (Vec::new(), Frontier::default());
    let mut search = Search { world, memo, mutation, seen, situations, steps, frontier, explored };
    let nowhere = Step { from: 0, choice: 0 };
    search.visit(begin, Way { step: nowhere, depth: 0, price: 0, current: USER })?;
    loop {
        if search.explored.states >= most.min(u64::from(u32::MAX)) {
            search.explored.price = search.frontier.cheapest();
            break;
        }
        let Some(Open { state, choice, way }) = search.frontier.pop() else {
            search.explored.complete = true;
            break;
        };
        search.explored.steps += 1;
        match state.after(world, &mut search.memo, choice) {
            Ok(next) => search.visit(next, way)?,
            Err(what) => return Err(search.counterexample(what, way)),
        }
    }
    Ok(search.explored)
}

impl Search<'_> {
    /// Checks a state in which nothing is left to do; records the choices of any other state.
    fn visit(&mut self, state: State, way: Way) -> Result<(), Box<Counterexample>> {
        if !self.seen.insert(state.hash()) {
            return Ok(());
        }
        let Way { step, depth, price, current } = way;
        let situation = state.hash_of_situation();
        if self.situations.insert(situation) {
            self.explored.situations += 1;
            self.explored.all_situations ^= situation;
        }
        self.explored.states += 1;
        self.explored.price = self.explored.price.max(price);
        let offer = state.offer(self.world);
        if offer.choices.is_empty() {
            self.explored.rests += 1;
            self.explored.depth = self.explored.depth.max(depth);
            if let Err(what) = state.judge(self.world, &mut self.memo) {
                return Err(self.counterexample(what, way));
            }
        }
        let from = u32::try_from(self.steps.len()).unwrap_or(u32::MAX);
        self.steps.push(step);
        let state = Rc::new(state);
        let of_current = || offer.choices.iter().filter(|choice| state.actor(**choice) == current);
        let goes_on = of_current().next().is_some();
        let weight = |is_write: bool| if is_write { PRICES[0] } else { PRICES[1] };
        let preemption = weight(of_current().any(|choice| state.is_write(*choice)));
        for (number, choice) in offer.choices.iter().copied().enumerate().rev() {
            let actor = state.actor(choice);
            let is_preempted = !offer.is_alone && goes_on && actor != current && current != USER;
            let preemption = if is_preempted { preemption } else { 0 };
            let fault = if is_plain(choice) { 0 } else { weight(state.is_write(choice)) };
            // A request that meets no other is no turn of its own.
            let current = if offer.is_alone { current } else { actor };
            let step = Step { from, choice: u16::try_from(number).unwrap_or(u16::MAX) };
            let way = Way { step, depth: depth + 1, price: price + preemption + fault, current };
            self.frontier.push(Open { state: state.clone(), choice, way });
        }
        Ok(())
    }

    /// Repeats the steps to a state, to describe them.
    fn counterexample(&self, what: String, way: Way) -> Box<Counterexample> {
        let before = |step: &Step| self.steps.get(step.from as usize).copied();
        let mut steps: Vec<Step> = std::iter::successors(Some(way.step), before).take(way.depth).collect();
        steps.reverse();
        let mut memo = Memo::new(self.world, self.mutation);
        let mut steps_in_words = Vec::new();
        let mut state = State::begin(self.world, &mut memo).ok();
        for Step { choice, .. } in steps {
            let Some(before) = state else { break };
            let choice = before.offer(self.world).choices[usize::from(choice)];
            steps_in_words.push(before.describe(self.world, choice));
            state = before.after(self.world, &mut memo, choice).ok();
        }
        let (world, states) = (self.world.name, self.explored.states);
        Box::new(Counterexample { world, what, steps: steps_in_words, states, price: way.price })
    }
}
