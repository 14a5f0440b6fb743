//! The pipeline's small worlds searched, and schedules that provoke: what holds, and how soon a broken rule is noticed.
//!
//! Writes `docs/reports/search.md` and its figures. States and seeds do not depend on the machine; seconds do, and are only
//! printed.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use rayfold_files::OutputFile;
use rayfold_pipeline::Mutation;
use rayfold_pipeline::simulation::explore::{
    Counterexample, Explored, World, explore, provoke, provoking, worlds,
};

/// Options of `rayfold-bench explore`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// States of a world after which its search ends; its line then says so
    #[arg(long, default_value_t = 7_000_000)]
    most: u64,
    /// States of a world up to which it is searched once more, with nothing forgotten, to see the same
    #[arg(long, default_value_t = 1_000_000)]
    most_remembered: u64,
    /// States of a world after which the search for a broken rule goes on with the next world
    #[arg(long, default_value_t = 20_000)]
    most_of_a_rule: u64,
    /// Only worlds whose name holds this; then no report is written
    #[arg(long, default_value = "")]
    world: String,
    /// Seeds of schedules that provoke, for each broken rule and for none
    #[arg(long, default_value_t = 1_000)]
    seeds: u64,
    /// Threads; all cores when left out
    #[arg(long)]
    threads: Option<usize>,
    /// Folder of the report
    #[arg(long, default_value = "docs/reports")]
    output: PathBuf,
}

/// Searches.
///
/// # Errors
///
/// When a guarantee does not hold: what happened, step by step. When a broken rule is not noticed. When the report cannot be
/// written.
pub fn run(args: &Args) -> anyhow::Result<()> {
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

/// What a search has seen, and another one that forgets nothing, if it came to its end.
#[derive(Debug)]
struct Searched {
    explored: Explored,
    remembering: Option<Explored>,
}

impl Searched {
    /// Whether both have come to the same situations.
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

/// How a broken rule is noticed.
#[derive(Debug)]
struct Noticed {
    rule: Mutation,
    /// By the search of the world that needs the fewest states.
    first: Option<Box<Counterexample>>,
    /// Worlds in which the search notices.
    worlds: usize,
    /// Seeds of schedules that notice.
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

Written by `cargo run --release -p rayfold-bench -- explore`. Small worlds are searched for every interleaving of the real
steps' requests (`crates/pipeline/src/simulation/explore`): one to three frames, the invocations that their events wake, and
the assemblers; a user who overwrites, changes back and deletes at any moment; an invocation killed before or after any
request, a write that lands after its sender's death, a lost answer, an event that comes twice or never, as the world's name
says. States that few preemptions and faults lead to are visited first (*price*: the most that they weigh on the way to a state; a
preemption is that somebody goes on though whoever went on before still could). *Depth* is the most requests and acts on the
way to a state of rest. Both are of the way on which a state was reached first. Where the search ended at its limit, all ways
that weigh less than *price* were gone.

The steps say at some places what they go on with (`goes_on_with`), and what has happened to an invocation before is then
forgotten: it makes no difference to what comes. Worlds that are small enough were searched once more with *nothing forgotten*:
the figure is how many states that makes. Both searches came to the same *situations* (what the bucket holds and what every
invocation asks for next).

Not searched: listings that mix two moments, and time: the store's clock moves with the user's acts alone, those of invocations
stand still, a pause ends at once, the deadline does not come. The [seeds](simulation.md) have these.

No state broke a guarantee.

| world | states | nothing forgotten | situations | at rest | steps | depth | price | searched |
| --- | --- | --- | --- | --- | --- | --- | --- | --- |
";

const RULES: &str = "
## Broken rules

The same predicates, with one rule of the protocol broken on purpose. *States* are those that the search has seen when it
notices, in the world that shows it soonest. *Seeds* are of schedules that provoke: each runs two of each of three kinds in
each of the worlds that `provoking` names, by priorities that change a few times, by turns with pauses before writes, and by
turns with at most two preemptions; faults are aimed at one write, or strike anywhere.

| broken rule | states until the search notices | price | in the world | worlds that notice | seeds that notice |
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
    writeln!(page, "\nSeeds are of {seeds}. With no rule broken {found} of {seeds} found anything.")?;
    let Args { most, most_of_a_rule, .. } = args;
    writeln!(
        page,
        "The limits: worlds to {most} states, each broken rule to {most_of_a_rule} states a world."
    )?;
    let files = [("search.md", page.into_bytes()), ("search.csv", figures.into_inner()?)];
    for (name, bytes) in files {
        let path = args.output.join(name);
        OutputFile::write(&path, bytes, false)?;
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

/// Does so many pieces of work on so many threads, and gives what came of each, in their order.
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
