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

use anyhow::Context as _;
use rayfold_pipeline::Mutation;
use rayfold_pipeline::simulation::{Run, Scale, ScaleReport, Violation, measure, replay, run as run_seed};

/// How many violations are told one by one.
const TOLD: usize = 20;

/// Options of `rayfold-bench simulate`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// How many seeds to run
    #[arg(long, default_value_t = 100_000)]
    seeds: u64,
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
    /// Where to write the report
    #[arg(long)]
    output: Option<PathBuf>,
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
    let threads =
        args.threads.or_else(|| std::thread::available_parallelism().ok().map(usize::from)).unwrap_or(1);
    let mut report = String::from(HEADER);
    let campaign = run_seeds(args.from, args.seeds, threads, None);
    describe_campaign(&mut report, args, &campaign);
    if let Some(seeds) = args.hunt {
        report.push_str("\n## Broken rules\n\n");
        report.push_str("The same predicates, with one rule of the protocol broken on purpose.\n\n");
        report
            .push_str("| broken rule | seeds run | that noticed | the first |\n| --- | --- | --- | --- |\n");
        for rule in Mutation::ALL {
            let hunt = run_seeds(args.from, seeds, threads, Some(rule));
            let first =
                hunt.violations.first().map_or("-".to_owned(), |violation| violation.seed.to_string());
            writeln!(report, "| {rule:?} | {seeds} | {} | {first} |", hunt.broken)?;
            println!("{rule:?}: {} of {seeds}, first {first}", hunt.broken);
        }
    }
    if !args.scale.is_empty() {
        report.push_str(SCALE_HEADER);
        for &(frames, concurrency) in &args.scale {
            let line = scale_line(frames, concurrency)?;
            println!("{line}");
            report.push_str(&line);
            report.push('\n');
        }
    }
    println!("{report}");
    if let Some(output) = &args.output {
        std::fs::write(output, &report).with_context(|| format!("cannot write {}", output.display()))?;
    }
    match campaign.violations.first() {
        Some(violation) => Err(anyhow::anyhow!("{} of {} runs: {violation}", campaign.broken, args.seeds)),
        None => Ok(()),
    }
}

const HEADER: &str = "# The protocol in the simulated world

Written by `cargo run --release -p rayfold-bench -- simulate`. A run makes up a story of uploads and a world that fails in
its own ways, both from one seed, and checks what [pipeline.md](../pipeline.md) guarantees. Simulated time: the figures
do not depend on the machine.

";

const SCALE_HEADER: &str = "
## Requests and the tail

One animation of single-frame scripts, uploaded within 200 ms with `frames` set, drawn in 800 to 1,200 ms each; GET takes
10-25 ms, PUT 25-60 ms, LIST 20-40 ms a page. Requests are those of the render function; the tail is from the last
frame's put to the last claim's. The worst of the seeds.

| frames | at once | seeds | requests a frame | tail, ms | claims | manifests written | assembler's requests | requests when all is done |
| --- | --- | --- | --- | --- | --- | --- | --- | --- |
";

/// What many runs were like.
#[derive(Default)]
struct Campaign {
    total: Run,
    without_sweep: u64,
    with_given_up: u64,
    with_late_writes: u64,
    broken: u64,
    violations: Vec<Violation>,
    permissions: BTreeSet<String>,
    seconds: f64,
}

fn run_seeds(from: u64, seeds: u64, threads: usize, rule: Option<Mutation>) -> Campaign {
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
                    campaign.lock().unwrap_or_else(PoisonError::into_inner).add(outcome);
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

fn describe_campaign(report: &mut String, args: &Args, campaign: &Campaign) {
    let Campaign { total, without_sweep, with_given_up, with_late_writes, broken, .. } = campaign;
    let Args { from, seeds, .. } = args;
    let [render, assemble] = total.invocations;
    let _ = write!(
        report,
        "## Seeds\n\n| | |\n| --- | --- |\n| seeds | {from} to {} |\n| runs in which a guarantee did not hold | {broken} |\n\
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
        let scale = Scale { frames, concurrency, draw_ms: (800, 1_200), upload_ms: 200, seed };
        let report = measure(scale).map_err(anyhow::Error::msg)?;
        worst = ScaleReport {
            requests_a_frame: worst.requests_a_frame.max(report.requests_a_frame),
            tail: worst.tail.max(report.tail),
            claims: worst.claims.max(report.claims),
            revisions: worst.revisions.max(report.revisions),
            assembling: worst.assembling.max(report.assembling),
            idle: worst.idle.max(report.idle),
            whole: worst.whole.max(report.whole),
        };
    }
    let ScaleReport { requests_a_frame, tail, claims, revisions, assembling, idle, .. } = worst;
    let tail = tail.as_millis();
    Ok(format!(
        "| {frames} | {concurrency} | {seeds} | {requests_a_frame:.2} | {tail} | {claims} | {revisions} | {assembling} | {idle} |"
    ))
}

fn parse_size(text: &str) -> Result<(u64, usize), String> {
    let (frames, concurrency) = text.split_once('x').ok_or("expected FRAMESxCONCURRENCY, like 1000x1000")?;
    let number = |text: &str| text.parse::<u64>().map_err(|error| format!("{text}: {error}"));
    Ok((number(frames)?, usize::try_from(number(concurrency)?).map_err(|error| error.to_string())?))
}
