//! The pipeline's simulation at full size: many seeds, broken rules, and what frames cost at scale.
//!
//! Everything is measured in simulated time, so the figures are the same on every machine; only the seconds that the
//! runs themselves take are not.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use rayfold_files::OutputFile;
use rayfold_pipeline::Mutation;
use rayfold_pipeline::simulation::{Run, Scale, ScaleReport, Violation, measure, replay, run as run_seed};

/// How many violations are told one by one.
const TOLD: usize = 20;

/// What a whole report has, unless a part is asked for by itself.
const SEEDS: u64 = 100_000;
const HUNT: u64 = 60_000;
const SIZES: [(u64, usize); 5] = [(10, 10), (50, 50), (1_000, 1_000), (2_500, 250), (10_000, 1_000)];

/// Seeds that notice a broken rule, after which the hunt for more ends.
const ENOUGH: u64 = 5;

/// Options of `rayfold-bench simulate`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Without --seeds, --hunt and --scale: all three at full size, and the report is written."
)]
pub struct Args {
    /// How many seeds to run
    #[arg(long)]
    seeds: Option<u64>,
    /// The first seed
    #[arg(long, default_value_t = 0)]
    from: u64,
    /// Threads; all cores when left out
    #[arg(long)]
    threads: Option<usize>,
    /// For each rule of the protocol, the first seeds that notice when it is broken, among so many
    #[arg(long, value_name = "SEEDS")]
    hunt: Option<u64>,
    /// Frames, and invocations at once, to measure requests and tail at: 1000x1000; may be given several times
    #[arg(long, value_name = "FRAMESxCONCURRENCY", value_parser = parse_size)]
    scale: Vec<(u64, usize)>,
    /// Run this seed alone and print what happens
    #[arg(long)]
    seed: Option<u64>,
    /// Where to write a whole report
    #[arg(long, default_value = "docs/reports/simulation.md")]
    output: PathBuf,
}

/// Runs the simulation.
///
/// # Errors
///
/// When a guarantee does not hold, or the report cannot be written.
#[expect(clippy::print_stdout, reason = "a measurement tells what it finds")]
pub fn run(args: &Args) -> anyhow::Result<()> {
    if let Some(seed) = args.seed {
        let mut log = Vec::new();
        let outcome = replay(seed, None, &mut log);
        println!("{}", log.join("\n"));
        println!("{:#?}", outcome?);
        return Ok(());
    }
    let is_whole = args.seeds.is_none() && args.hunt.is_none() && args.scale.is_empty();
    let threads =
        args.threads.or_else(|| std::thread::available_parallelism().ok().map(usize::from)).unwrap_or(1);
    let mut report = String::from(HEADER);
    let mut violation = None;
    if let Some(seeds) = args.seeds.or(is_whole.then_some(SEEDS)) {
        let campaign = run_seeds(args.from, seeds, threads, None, u64::MAX);
        describe_campaign(&mut report, (args.from, seeds), &campaign);
        violation = campaign.violations.into_iter().next();
    }
    if let Some(seeds) = args.hunt.or(is_whole.then_some(HUNT)) {
        write!(report, "{HUNT_HEADER}")?;
        for rule in Mutation::ALL {
            let hunt = run_seeds(args.from, seeds, threads, Some(rule), ENOUGH);
            let noticed: Vec<String> = hunt.violations.iter().map(|v| v.seed.to_string()).collect();
            let line = format!("| {rule:?} | {} | {} | {} |", hunt.runs, hunt.broken, noticed.join(", "));
            println!("{line}");
            writeln!(report, "{line}")?;
        }
    }
    let sizes = if is_whole { SIZES.to_vec() } else { args.scale.clone() };
    if !sizes.is_empty() {
        report.push_str(SCALE_HEADER);
        for (frames, concurrency) in sizes {
            let line = scale_line(frames, concurrency)?;
            println!("{line}");
            writeln!(report, "{line}")?;
        }
    }
    println!("{report}");
    if is_whole {
        let output = &args.output;
        OutputFile::write(output, &report, false)?;
    }
    violation.map_or(Ok(()), |violation| Err(violation.into()))
}

const HEADER: &str = "# The protocol in the simulated world

Written by `cargo run --release -p rayfold-bench -- simulate`. A run makes up a story of uploads and a world that fails
in its own ways, both from one seed, and checks what [pipeline.md](../pipeline.md) guarantees. Simulated time: the
figures do not depend on the machine.
";

const HUNT_HEADER: &str = "
## Broken rules

The same predicates, with one rule of the protocol broken on purpose; the hunt for seeds that notice ends with a few. One
of each is a test (`crates/pipeline/src/simulation/tests.rs`).

| broken rule | seeds run | that noticed | which |
| --- | --- | --- | --- |
";

const SCALE_HEADER: &str = "
## Requests and the tail

One animation of single-frame scripts, uploaded within 200 ms with `frames` set, drawn in 800 to 1,200 ms each; GET takes
10-25 ms, PUT 25-60 ms, LIST 20-40 ms a page. Requests are those of the render function, and so are the bytes of objects
that it reads; GET, PUT and LIST are of both functions together. The time beyond drawing, which Lambda bills too, is the
mean of the render function's invocations: requests and pauses. The tail is from the last frame's put to the render function's last claim.
The worst of the seeds.

| frames | at once | seeds | requests a frame | KB read a frame | GET | PUT | LIST a frame | beyond drawing, ms | tail, ms | claims | manifests written | assembler's requests | requests when all is done |
| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |
";

/// What many runs were like.
#[derive(Default)]
struct Campaign {
    total: Run,
    without_sweep: u64,
    with_given_up: u64,
    with_late_writes: u64,
    runs: u64,
    broken: u64,
    violations: Vec<Violation>,
    permissions: BTreeSet<String>,
    seconds: f64,
}

/// Runs seeds until `enough` have found a guarantee broken.
fn run_seeds(from: u64, seeds: u64, threads: usize, rule: Option<Mutation>, enough: u64) -> Campaign {
    let start = Instant::now();
    let next = AtomicU64::new(from);
    let stop = AtomicBool::new(false);
    let campaign = Mutex::new(Campaign::default());
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                while !stop.load(Ordering::Relaxed) {
                    let seed = next.fetch_add(1, Ordering::Relaxed);
                    if seed >= from + seeds {
                        break;
                    }
                    let outcome = run_seed(seed, rule);
                    let mut campaign = campaign.lock().unwrap_or_else(PoisonError::into_inner);
                    campaign.add(outcome);
                    stop.fetch_or(campaign.broken >= enough, Ordering::Relaxed);
                }
            });
        }
    });
    let mut campaign = campaign.into_inner().unwrap_or_else(PoisonError::into_inner);
    campaign.violations.sort_by_key(|violation| violation.seed);
    campaign.seconds = start.elapsed().as_secs_f64();
    campaign
}

impl Campaign {
    fn add(&mut self, outcome: Result<Run, Violation>) {
        self.runs += 1;
        match outcome {
            Err(violation) => {
                self.broken += 1;
                self.violations.push(violation);
                self.violations.sort_by_key(|violation| violation.seed);
                self.violations.truncate(TOLD);
            }
            Ok(run) => {
                self.total.requests += run.requests;
                self.total.invocations[0] += run.invocations[0];
                self.total.invocations[1] += run.invocations[1];
                self.without_sweep += u64::from(run.without_sweep);
                self.with_given_up += u64::from(run.given_up > 0);
                self.with_late_writes += u64::from(run.late_writes > 0);
                self.permissions.extend(run.permissions);
            }
        }
    }
}

fn describe_campaign(report: &mut String, (from, seeds): (u64, u64), campaign: &Campaign) {
    let Campaign { total, without_sweep, with_given_up, with_late_writes, broken, .. } = campaign;
    let [render, assemble] = total.invocations;
    let _ = write!(
        report,
        "\n## Seeds\n\n| | |\n| --- | --- |\n| seeds | {from} to {} |\n| runs in which a guarantee did not hold | {broken} |\n\
         | runs that had to come right, and did, without a sweep | {without_sweep} |\n\
         | runs in which events were given up after their attempts | {with_given_up} |\n\
         | runs in which a write landed after its writer was killed | {with_late_writes} |\n\
         | requests | {} |\n| invocations of render, of assemble | {render}, {assemble} |\n\
         | seconds (on a machine that others used, too) | {:.0} |\n",
        from + seeds.saturating_sub(1),
        total.requests,
        campaign.seconds,
    );
    for violation in &campaign.violations {
        let _ = write!(report, "\n- seed {}: {}\n", violation.seed, violation.what);
    }
}

fn scale_line(frames: u64, concurrency: usize) -> anyhow::Result<String> {
    let seeds = if frames > 2_000 { 1 } else { 10 };
    let mut worst = ScaleReport::default();
    for seed in 0..seeds {
        let report = measure(Scale::unlimited(frames, concurrency, seed)).map_err(anyhow::Error::msg)?;
        worst = ScaleReport {
            requests_a_frame: worst.requests_a_frame.max(report.requests_a_frame),
            kinds_a_frame: [0, 1, 2, 3].map(|kind| worst.kinds_a_frame[kind].max(report.kinds_a_frame[kind])),
            beyond_drawing: worst.beyond_drawing.max(report.beyond_drawing),
            bytes_a_frame: worst.bytes_a_frame.max(report.bytes_a_frame),
            tail: worst.tail.max(report.tail),
            claims: worst.claims.max(report.claims),
            revisions: worst.revisions.max(report.revisions),
            assembling: worst.assembling.max(report.assembling),
            idle: worst.idle.max(report.idle),
            ..worst
        };
    }
    let [get, put, _, list] = worst.kinds_a_frame;
    let ScaleReport { requests_a_frame, tail, claims, revisions, assembling, idle, .. } = worst;
    let (tail, beyond, kb) =
        (tail.as_millis(), worst.beyond_drawing.as_millis(), worst.bytes_a_frame / 1000.0);
    Ok(format!(
        "| {frames} | {concurrency} | {seeds} | {requests_a_frame:.2} | {kb:.1} | {get:.2} | {put:.2} | {list:.2} | \
         {beyond} | {tail} | {claims} | {revisions} | {assembling} | {idle} |"
    ))
}

fn parse_size(text: &str) -> Result<(u64, usize), String> {
    let (frames, concurrency) = text.split_once('x').ok_or("expected FRAMESxCONCURRENCY, like 1000x1000")?;
    let number = |text: &str| text.parse::<u64>().map_err(|error| format!("{text}: {error}"));
    Ok((number(frames)?, usize::try_from(number(concurrency)?).map_err(|error| error.to_string())?))
}
