//! `rayfold-bench simulate`: the pipeline's simulation at full size, with many seeds, broken rules, and the cost of
//! frames at scale.
//!
//! Everything is measured in simulated time, so the figures are the same on every machine. The exceptions are the times
//! of the runs themselves.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use rayfold_files::OutputFile;
use rayfold_pipeline::Mutation;
use rayfold_simulation::{Run, Scale, ScaleReport, Violation, measure, replay, run as run_seed};

/// The number of violations that are printed individually.
const MAX_PRINTED: usize = 20;

/// The sizes of a whole report, unless a part is requested separately.
const SEEDS: u64 = 100_000;
const HUNT: u64 = 60_000;
const SIZES: [(u64, usize); 5] = [(10, 10), (50, 50), (1_000, 1_000), (2_500, 250), (10_000, 1_000)];

/// The search for seeds that detect a broken rule ends after this many.
const ENOUGH: u64 = 5;

/// Options of `rayfold-bench simulate`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Without --seeds, --hunt and --scale: all three at full size, and the report is written."
)]
pub struct Args {
    /// Run this many seeds
    #[arg(long)]
    seeds: Option<u64>,
    /// Start with this seed
    #[arg(long, default_value_t = 0)]
    from: u64,
    /// Number of threads [default: all cores]
    #[arg(long)]
    threads: Option<usize>,
    /// For each rule of the protocol, find the first seeds that detect its violation, among this many
    #[arg(long, value_name = "SEEDS")]
    hunt: Option<u64>,
    /// Measure requests and tail with this many frames and concurrent invocations: 1000x1000; may be given several
    /// times
    #[arg(long, value_name = "FRAMESxCONCURRENCY", value_parser = parse_size)]
    scale: Vec<(u64, usize)>,
    /// Run only this seed and print its events
    #[arg(long)]
    seed: Option<u64>,
    /// Write a whole report to this file
    #[arg(long, default_value = "docs/reports/simulation.md")]
    output: PathBuf,
}

/// Runs the simulation and writes its reports.
///
/// # Errors
///
/// Fails if a guarantee does not hold, or the report cannot be written.
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

Written by `cargo run --release -p rayfold-bench -- simulate`. A run generates a sequence of uploads and a world with its own
faults, both from one seed, and checks the guarantees of [pipeline.md](../pipeline.md). Time is simulated, so the figures do not
depend on the machine.
";

const HUNT_HEADER: &str = "
## Broken rules

The predicates are the same, but one rule of the protocol is broken on purpose. The search for seeds that detect this ends after
a few. One seed of each rule is a test (`crates/simulation/src/tests.rs`).

| broken rule | seeds run | number that detected it | which |
| --- | --- | --- | --- |
";

const SCALE_HEADER: &str = "
## Requests and the tail

One animation of single-frame scripts is uploaded within 200 ms with `frames` set, and each frame is drawn in 800 to 1,200 ms.
GET takes 10-25 ms, PUT 25-60 ms, LIST 20-40 ms per page. Requests, and the bytes of objects read, are those of the render
function; GET, PUT and LIST are those of both functions together. The time beyond drawing, which Lambda bills too, is the mean
of the render function's invocations: requests and pauses. The tail is the time from the last frame's put to the render
function's last claim. Each figure is the worst of the seeds.

| frames | at once | seeds | requests per frame | KB read per frame | GET | PUT | LIST per frame | beyond drawing, ms | tail, ms | claims | manifests written | assembler's requests | requests when all is done |
| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |
";

/// The summary of many runs.
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

/// Runs seeds until `enough` of them have found a violated guarantee.
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
                self.violations.truncate(MAX_PRINTED);
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
        "\n\
         ## Seeds\n\n\
         | | |\n\
         | --- | --- |\n\
         | seeds | {from} to {} |\n\
         | runs in which a guarantee was violated | {broken} |\n\
         | runs that had to end right without a sweep, and did | {without_sweep} |\n\
         | runs in which events were given up after their attempts | {with_given_up} |\n\
         | runs in which a write took effect after its writer was killed | {with_late_writes} |\n\
         | requests | {} |\n\
         | invocations of render, of assemble | {render}, {assemble} |\n\
         | seconds (on a machine with other load) | {:.0} |\n",
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
