//! Searches the pipeline's small worlds and runs provoking schedules: shows which guarantees hold, and how soon a
//! broken rule is detected.
//!
//! Writes `docs/reports/search.md` and its figures. States and seeds do not depend on the machine. Seconds do, and are
//! only printed.

use std::fmt::Write as _;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use rayfold_pipeline::Mutation;
use rayfold_simulation::explore::{Counterexample, Explored, World, explore, provoke, provoking, worlds};

use crate::report_folder::ReportFolder;

/// Options of `rayfold-bench explore`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// End the search of a world after this many states; its line then says so
    #[arg(long, default_value_t = 7_000_000)]
    most: u64,
    /// Search a world of at most this many states again with the full history, to compare the results
    #[arg(long, default_value_t = 1_000_000)]
    most_remembered: u64,
    /// After this many states of a world, continue the search for a broken rule with the next world
    #[arg(long, default_value_t = 20_000)]
    most_of_a_rule: u64,
    /// Search only worlds whose name contains this, and write no report
    #[arg(long, default_value = "")]
    world: String,
    /// Number of seeds of provoking schedules, for each broken rule and for none
    #[arg(long, default_value_t = 1_000)]
    seeds: u64,
    /// Number of threads [default: all cores]
    #[arg(long)]
    threads: Option<usize>,
    #[command(flatten)]
    output: ReportFolder,
}

/// Runs the searches and writes the report.
///
/// # Errors
///
/// Fails if a guarantee does not hold (the error lists the steps), if a broken rule is not detected, or if the report
/// cannot be written.
pub fn run(args: &Args) -> anyhow::Result<()> {
    args.output.prepare()?;
    let threads =
        args.threads.or_else(|| std::thread::available_parallelism().ok().map(usize::from)).unwrap_or(1);
    let all: Vec<World> = worlds().into_iter().filter(|world| world.name.contains(&args.world)).collect();
    let searched = side_by_side(threads, all.len(), |place| search(&all[place], args));
    let rules = side_by_side(threads, Mutation::ALL.len(), |place| hunt(Mutation::ALL[place], &all, args));
    let batches = side_by_side(threads, 10, |batch| {
        let seeds = (0..args.seeds).filter(|seed| seed % 10 == batch as u64);
        seeds.filter_map(|seed| provoke(&provoking(), seed, None).err()).collect::<Vec<_>>()
    });
    let mut violations: Vec<Box<Counterexample>> = batches.into_iter().flatten().collect();
    let found = violations.len();
    violations.extend(searched.iter().filter_map(|searched| searched.as_ref().err().cloned()));
    if let Some(counterexample) = violations.into_iter().next() {
        return Err(counterexample.into());
    }
    let searched: Vec<(&World, Searched)> = all.iter().zip(searched.into_iter().flatten()).collect();
    if let Some((world, both)) = searched.iter().find(|(_, searched)| !searched.agrees()) {
        anyhow::bail!("{}: what is forgotten makes a difference: {both:?}", world.name);
    }
    if args.world.is_empty() {
        write_report(args, &searched, &rules, found)?;
    }
    match rules.iter().find(|noticed| noticed.first.is_none() || noticed.seeds == 0) {
        Some(noticed) => anyhow::bail!("{:?} is not noticed: {noticed:?}", noticed.rule),
        None => Ok(()),
    }
}

/// The result of a search, and of one that forgets no history, if that completed.
#[derive(Debug)]
struct Searched {
    explored: Explored,
    remembering: Option<Explored>,
}

impl Searched {
    /// Returns whether both searches reached the same situations.
    fn agrees(&self) -> bool {
        self.remembering.as_ref().is_none_or(|remembering| remembering.saw_the_same_as(&self.explored))
    }
}

#[expect(clippy::print_stdout, reason = "a measurement tells what it finds")]
fn search(world: &World, args: &Args) -> Result<Searched, Box<Counterexample>> {
    let start = Instant::now();
    let searched = explore(world, None, args.most).and_then(|explored| {
        let worth_it = explored.complete && explored.states < args.most_remembered;
        let most = if worth_it { args.most_remembered } else { 0 };
        let remembering = explore(&world.remembering(), None, most)?;
        let remembering = Some(remembering).filter(|remembering| remembering.complete);
        Ok(Searched { explored, remembering })
    });
    let seconds = start.elapsed().as_secs_f64();
    match &searched {
        Ok(searched) => println!("{} {seconds:.0} s", line(world.name, searched)),
        Err(counterexample) => println!("{counterexample}"),
    }
    searched
}

/// The detection of a broken rule.
#[derive(Debug)]
struct Noticed {
    rule: Mutation,
    /// The counterexample from the world that needs the fewest states.
    first: Option<Box<Counterexample>>,
    /// The number of worlds in which the search detects it.
    worlds: usize,
    /// The number of seeds of schedules that detect it.
    seeds: u64,
}

#[expect(clippy::print_stdout, reason = "a measurement tells what it finds")]
fn hunt(rule: Mutation, worlds: &[World], args: &Args) -> Noticed {
    let found: Vec<_> =
        worlds.iter().filter_map(|world| explore(world, Some(rule), args.most_of_a_rule).err()).collect();
    let in_worlds = found.len();
    let first = found.into_iter().min_by_key(|counterexample| counterexample.states);
    let places = provoking();
    let seeds = (0..args.seeds).filter(|seed| provoke(&places, *seed, Some(rule)).is_err()).count() as u64;
    let noticed = Noticed { rule, first, worlds: in_worlds, seeds };
    println!("{}", rule_line(&noticed, worlds.len()));
    if let Some(first) = &noticed.first {
        println!("{first}");
    }
    noticed
}

const HEADER: &str = "# Small worlds, searched

Written by `cargo run --release -p rayfold-bench -- explore`. The search covers every interleaving of the real steps' requests
in small worlds (`crates/simulation/src/explore`). A world has one to three frames, the invocations that their events
start, and the assemblers. Its name lists the faults: a user who overwrites, changes back and deletes at any moment; an
invocation killed before or after any request; a write that takes effect after its sender was killed; a lost reply; an event
delivered twice or never. The search visits states that need few preemptions and faults first. *Price* is the largest weight of
these on the path to a state; a preemption is a switch to another invocation although the current one could continue. *Depth* is
the largest number of requests and user actions on the path to a state of rest. Both refer to the path on which a state was
reached first. If the search ended at its limit, all paths with a weight less than *price* are covered.

At some points the steps declare the values that their remaining behaviour depends on (`forget_history_before`). The search then drops
the invocation's earlier history, which has no effect on later requests. Small enough worlds were searched again with the full
history; the number of states is in the column *nothing forgotten*. Both searches reached the same *situations* (the contents of
the bucket and the next request of every invocation).

The search does not cover listings that mix two moments, or time: the store's clock advances only with the user's actions, the
clocks of invocations stand still, a pause ends at once, and no deadline expires. The [simulation](simulation.md) covers these.

No state violated a guarantee.

| world | states | nothing forgotten | situations | at rest | steps | depth | price | searched |
| --- | --- | --- | --- | --- | --- | --- | --- | --- |
";

const RULES: &str = "
## Broken rules

The predicates are the same, but one rule of the protocol is broken on purpose. *States* is the number of states visited until
the search detects this, in the world that needs the fewest. *Seeds* are those of provoking schedules. Each seed runs two
schedules of each of three kinds in each of the worlds of `provoking`: by priorities that change a few times, in turns with
pauses before writes, and in turns with at most two preemptions. Faults are aimed at one write, or occur anywhere.

| broken rule | states until detection | price | in the world | worlds that detect it | seeds that detect it |
| --- | --- | --- | --- | --- | --- |
";

fn write_report(
    args: &Args,
    searched: &[(&World, Searched)],
    rules: &[Noticed],
    found: usize,
) -> anyhow::Result<()> {
    let mut page = HEADER.to_owned();
    let mut figures = csv::Writer::from_writer(Vec::new());
    figures.write_record([
        "world",
        "states",
        "states_if_nothing_is_forgotten",
        "situations",
        "at_rest",
        "steps",
        "depth",
        "price",
        "complete",
    ])?;
    for (world, searched) in searched {
        writeln!(page, "{}", line(world.name, searched))?;
        let Explored { states, rests, situations, steps, depth, price, complete, .. } = &searched.explored;
        let remembered = searched.remembering.as_ref().map_or_else(String::new, |of| of.states.to_string());
        let numbers = [*situations, *rests, *steps, *depth as u64, *price as u64];
        let name = [world.name.to_owned(), states.to_string(), remembered].into_iter();
        let numbers = numbers.into_iter().map(|number| number.to_string());
        figures.write_record(name.chain(numbers).chain([complete.to_string()]))?;
    }
    page.push_str(RULES);
    for noticed in rules {
        writeln!(page, "{}", rule_line(noticed, searched.len()))?;
    }
    let seeds = args.seeds;
    writeln!(
        page,
        "\n\
     The number of seeds is {seeds}. With no rule broken {found} of {seeds} found a violation."
    )?;
    let Args { most, most_of_a_rule, .. } = args;
    writeln!(
        page,
        "Limits: {most} states per world, {most_of_a_rule} states per world for each broken rule."
    )?;
    let files = [("search.md", page.into_bytes()), ("search.csv", figures.into_inner()?)];
    for (name, bytes) in files {
        args.output.write(name, bytes)?;
    }
    Ok(())
}

fn line(name: &str, Searched { explored, remembering }: &Searched) -> String {
    let Explored { states, rests, situations, steps, depth, price, complete, .. } = explored;
    let remembered = remembering.as_ref().map_or_else(|| "-".to_owned(), |of| of.states.to_string());
    let searched = if *complete { "all" } else { "to the limit" };
    format!(
        "| {name} | {states} | {remembered} | {situations} | {rests} | {steps} | {depth} | {price} | {searched} |"
    )
}

fn rule_line(noticed: &Noticed, of: usize) -> String {
    let Noticed { rule, first, worlds, seeds } = noticed;
    let (states, price, name) =
        first.as_ref().map_or((0, 0, "none"), |found| (found.states, found.price, found.world));
    format!("| {rule:?} | {states} | {price} | {name} | {worlds} of {of} | {seeds} |")
}

/// Runs `pieces` pieces of work on this many threads, and returns their results in order.
fn side_by_side<T: Send>(threads: usize, pieces: usize, work: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let done: Mutex<Vec<(usize, T)>> = Mutex::default();
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                loop {
                    let piece = next.fetch_add(1, Ordering::Relaxed);
                    if piece >= pieces {
                        break;
                    }
                    let came = work(piece);
                    done.lock().unwrap_or_else(PoisonError::into_inner).push((piece, came));
                }
            });
        }
    });
    let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_by_key(|(piece, _)| *piece);
    done.into_iter().map(|(_, came)| came).collect()
}
