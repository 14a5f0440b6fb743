//! The small worlds of the pipeline searched to their ends, and schedules that provoke: what is noticed of broken rules.
//!
//! Prints sections for `docs/reports/simulation.md`. States and seeds do not depend on the machine; seconds do.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use rayfold_pipeline::Mutation;
use rayfold_pipeline::simulation::explore::{Counterexample, Explored, World, explore, provoke, worlds};

/// Options of `rayfold-bench explore`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// States of a world after which its search ends; its line then says so
    #[arg(long, default_value_t = 3_000_000)]
    most: u64,
    /// States of a world after which the search for a broken rule goes on with the next world
    #[arg(long, default_value_t = 400_000)]
    most_of_a_rule: u64,
    /// Only worlds whose name holds this
    #[arg(long, default_value = "")]
    world: String,
    /// Seeds of schedules that provoke
    #[arg(long, default_value_t = 20_000)]
    seeds: u64,
    /// Threads; all cores when left out
    #[arg(long)]
    threads: Option<usize>,
}

/// Searches.
///
/// # Errors
///
/// When a guarantee does not hold: what happened, step by step.
#[expect(clippy::print_stdout, reason = "a measurement tells what it finds")]
pub fn run(args: &Args) -> anyhow::Result<()> {
    let threads =
        args.threads.or_else(|| std::thread::available_parallelism().ok().map(usize::from)).unwrap_or(1);
    let all: Vec<World> = worlds().into_iter().filter(|world| world.name.contains(&args.world)).collect();
    println!("{WORLDS}");
    let found: Mutex<Option<Box<Counterexample>>> = Mutex::new(None);
    side_by_side(threads, all.len(), |place| {
        let start = Instant::now();
        match explore(&all[place], None, args.most) {
            Ok(explored) => println!("{}", line(all[place].name, &explored, start.elapsed().as_secs_f64())),
            Err(counterexample) => {
                println!("{counterexample}");
                *found.lock().unwrap_or_else(PoisonError::into_inner) = Some(counterexample);
            }
        }
    });
    println!("{RULES}");
    side_by_side(threads, Mutation::ALL.len(), |place| {
        let rule = Mutation::ALL[place];
        println!("{}", rule_line(rule, &all, args));
    });
    let violations = (0..args.seeds).filter_map(|seed| provoke(&all, seed, None).err()).collect::<Vec<_>>();
    println!("\nSchedules with no rule broken: {} of {} seeds found anything.", violations.len(), args.seeds);
    let found = found.into_inner().unwrap_or_else(PoisonError::into_inner);
    match found.or_else(|| violations.into_iter().next()) {
        Some(counterexample) => Err(counterexample.into()),
        None => Ok(()),
    }
}

const WORLDS: &str = "
| world | states | at rest | steps | depth | searched | seconds |
| --- | --- | --- | --- | --- | --- | --- |";

const RULES: &str = "
| broken rule | noticed by the search of | steps to it | schedules that noticed, of 1,000 |
| --- | --- | --- | --- |";

fn line(name: &str, explored: &Explored, seconds: f64) -> String {
    let Explored { states, rests, steps, depth, complete } = explored;
    let searched = if *complete { "all" } else { "to the limit" };
    format!("| {name} | {states} | {rests} | {steps} | {depth} | {searched} | {seconds:.0} |")
}

fn rule_line(rule: Mutation, worlds: &[World], args: &Args) -> String {
    let noticed: Vec<_> =
        worlds.iter().filter_map(|world| explore(world, Some(rule), args.most_of_a_rule).err()).collect();
    let shortest = noticed.iter().min_by_key(|counterexample| counterexample.steps.len());
    let (steps, example) = shortest.map_or((0, "none"), |found| (found.steps.len(), found.world));
    let broken = (0..args.seeds).filter(|seed| provoke(worlds, *seed, Some(rule)).is_err()).count();
    let thousandth = broken as f64 * 1000.0 / args.seeds.max(1) as f64;
    let (worlds, of) = (noticed.len(), worlds.len());
    format!("| {rule:?} | {worlds} of {of} worlds, as in: {example} | {steps} | {thousandth:.1} |")
}

/// Does so many pieces of work on so many threads.
fn side_by_side(threads: usize, pieces: usize, work: impl Fn(usize) + Sync) {
    let next = AtomicUsize::new(0);
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                loop {
                    let piece = next.fetch_add(1, Ordering::Relaxed);
                    if piece >= pieces {
                        break;
                    }
                    work(piece);
                }
            });
        }
    });
}
