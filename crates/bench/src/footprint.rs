//! `rayfold-bench footprint`: the memory and processor time of the shipped functions, by the size of an animation.
//!
//! The program puts all frames of an animation but the last into a bucket without events. The real functions then do
//! the rest, one invocation each in a process that is almost new: render draws the last frame, folds and claims;
//! assemble builds the GIF; a sweep checks the whole bucket. Writes `docs/reports/footprint.md`, its figures and its
//! plot.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use bytes::Bytes;
use futures_util::stream::{self, StreamExt, TryStreamExt};
use rayfold_local::invoker::{Invoker, Settings};
use rayfold_local::observation::{Observation, Requests, Seen};
use rayfold_local::routes::Function;
use rayfold_local::{Functions, S3Server, StoreKind, any_port};
use rayfold_pipeline::keys::Animation;
use rayfold_pipeline::store::{ListRequest, S3Store, Store};
use serde_json::json;
use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};

use crate::pipeline::put;
use crate::plot::{Labels, Series, log_log};
use crate::report_folder::ReportFolder;
use crate::scale::{ASSEMBLE_MB, LONGEST, RENDER_MB};

/// The numbers of frames of the animations, and the sizes of their pictures.
const SIZES: [(u64, [u32; 2]); 7] = [
    (10, SMALL),
    (100, SMALL),
    (1_000, SMALL),
    (10_000, SMALL),
    (30_000, SMALL),
    (100_000, SMALL),
    (100, [1920, 1080]),
];

/// The size of pictures whose own cost is negligible.
const SMALL: [u32; 2] = [64, 48];

/// The number of concurrent puts.
const PUTS: usize = 64;

/// The unit of processor time on Linux is a second divided by this.
const TICKS: f64 = 100.0;

const BUCKET: &str = "footprint";

/// Options of `rayfold-bench footprint`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Leave out animations with more frames; the report then says so
    #[arg(long)]
    most: Option<u64>,
    #[command(flatten)]
    output: ReportFolder,
}

/// The cost of one invocation.
#[derive(Clone, Copy)]
struct Cost {
    /// The peak memory of the process, in MiB.
    memory: f64,
    /// The processor time of the process in seconds.
    processor: f64,
    requests: Requests,
}

/// The costs of an animation's last frame, its GIF, and a sweep.
struct Row {
    frames: u64,
    size: [u32; 2],
    costs: [Cost; 3],
}

/// The names of the cost columns.
const STEPS: [&str; 3] = ["render", "assemble", "sweep"];

/// Measures and writes the report.
///
/// # Errors
/// Fails if the store or the functions cannot be started, an invocation fails, or the report cannot be written.
pub fn run(args: &Args) -> Result<()> {
    args.output.prepare()?;
    let functions = Functions::locate(&mut |line| eprintln!("{line}"))?;
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build()?;
    let mut rows = Vec::new();
    for (frames, size) in SIZES {
        if args.most.is_none_or(|most| frames <= most) {
            let row = runtime.block_on(measure(&functions, frames, size))?;
            eprintln!("{}", line(&row));
            rows.push(row);
        }
    }
    write_report(args, &rows)
}

async fn measure(functions: &Functions, frames: u64, size: [u32; 2]) -> Result<Row> {
    let data = tempfile::tempdir()?;
    let say = &mut |line: &str| eprintln!("{line}");
    let server = S3Server::start(StoreKind::BuiltIn, data.path(), any_port(), None, say).await?;
    let store = S3Store::at(&server.connection(), BUCKET);
    store.create_bucket().await?;
    let animation = Animation::new("long")?;

    let (mut working, _) = Working::start(functions, &server).await?;
    put(&store, animation.settings(), json!({ "frames": frames }).to_string().into()).await?;
    let script = |number: u64| format!("{}{number}.txt", animation.scripts());
    let text = Bytes::from(text_of(size));
    put(&store, script(1), text.clone()).await?;
    working.wake(Function::Render, &script(1)).await?;
    fill(&store, &animation, frames, &text).await?;
    put(&store, script(frames), text).await?;
    let rendering = working.wake(Function::Render, &script(frames)).await?;
    let claims = ListRequest::all(format!("assemblies/{animation}/"));
    let claim = store.list(claims).await?.objects.pop().context("the last frame claims")?;
    let assembling = working.wake(Function::Assemble, &claim.key).await?;
    store.head(&animation.gif()).await.context("the assembler builds the GIF")?;
    working.invoker.stop().await;

    // The sweep at the start of an invoker, in a new process.
    let (working, sweeping) = Working::start(functions, &server).await?;
    working.invoker.stop().await;
    server.stop().await;
    Ok(Row { frames, size, costs: [rendering, assembling, sweeping] })
}

/// Returns the script of a sphere on a slab, in this picture size.
fn text_of([width, height]: [u32; 2]) -> String {
    let high = 0.4 * f64::from(height) / f64::from(width);
    format!(
        "Screen {width} {height}\n\
         Camera 0 4.4 8.4  0 -3.95 -8.4  0 1 0  1  -0.4 -{high}  0.4 {high}\n\
         Background 0.09 0.1 0.16\n\
         Sphere 1.15  0 1.15 0  0.1 0.04 0.03  0.88 0.36 0.22  0.22 0.22 0.24\n\
         Box -2.6 -0.35 -2.6  2.6 0 2.6  0.14 0.13 0.12  0.86 0.82 0.74\n\
         Ilight 0.95 0.9 0.8  -1 -0.85 0\n\
         Trace\n"
    )
}

/// Puts all frames between the first and the last one as copies of the first.
async fn fill(store: &S3Store, animation: &Animation, frames: u64, text: &Bytes) -> Result<()> {
    let drawn = store.list(ListRequest::all(animation.frames())).await?.objects;
    let drawn = drawn.into_iter().map(|object| object.key).find(|key| key.ends_with(".png"));
    let first = drawn.context("the first frame is drawn")?;
    let image = store.get(&first).await?.body;
    let (folder, result) = first.split_once("/1@").context("a result is called after its script")?;
    let puts = (2..frames).map(|number| {
        let (script, frame) =
            (format!("{}{number}.txt", animation.scripts()), format!("{folder}/{number}@{result}"));
        let image = image.clone();
        async move {
            put(store, script, text.clone()).await?;
            put(store, frame, image).await
        }
    });
    stream::iter(puts).map(Ok).try_for_each_concurrent(PUTS, |put| put).await
}

/// An invoker of the functions, and its observations.
struct Working {
    invoker: Invoker,
    seen: UnboundedReceiver<Observation>,
    /// The processor time of each process so far, in seconds.
    taken: BTreeMap<u32, f64>,
}

impl Working {
    /// Starts an invoker. Returns it and the cost of the sweep that it runs at its start.
    async fn start(functions: &Functions, server: &S3Server) -> Result<(Self, Cost)> {
        let token = "no events come".to_owned();
        let mut settings = Settings::new(functions.clone(), Some(server.address()), any_port(), token);
        settings.environment = server.environment();
        settings.environment.push(("RAYFOLD_BUCKET".into(), BUCKET.into()));
        (settings.sweep_every, settings.timeout) = (None, LONGEST);
        let (sender, seen) = unbounded_channel();
        let invoker = Invoker::start(settings, Some(sender)).await?;
        invoker.idle().await;
        let mut working = Working { invoker, seen, taken: BTreeMap::new() };
        let sweep = working.cost()?;
        Ok((working, sweep))
    }

    /// Invokes a function with an event for an object.
    async fn wake(&mut self, function: Function, key: &str) -> Result<Cost> {
        let record = json!({
            "eventSource": "aws:s3", "eventName": "ObjectCreated:Put", "eventTime": "2026-01-01T00:00:00.000Z",
            "userIdentity": {}, "requestParameters": {}, "responseElements": {},
            "s3": { "bucket": { "name": BUCKET }, "object": { "key": key } },
        });
        self.invoker.invoke(function, json!({ "Records": [record] }).to_string()).await;
        self.cost()
    }

    /// Returns the cost of the last invocation, whose process now waits for the next one.
    fn cost(&mut self) -> Result<Cost> {
        let mut last = None;
        while let Ok(Observation { seen, .. }) = self.seen.try_recv() {
            if let Seen::Finished { attempt, outcome, requests, .. } = seen {
                ensure!(outcome.is_success(), "{}: {outcome:?}", attempt.function);
                last = Some((attempt.pid, requests));
            }
        }
        let (process, requests) = last.context("an invocation has ended")?;
        let (memory, processor) = (most_memory(process)?, processor_time(process)?);
        let before = self.taken.insert(process, processor).unwrap_or_default();
        Ok(Cost { memory, processor: processor - before, requests })
    }
}

/// Returns the peak memory of a process, in MiB.
fn most_memory(process: u32) -> Result<f64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status"))?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kib = line.and_then(|line| line.trim().strip_suffix(" kB")).context("Linux tells the peak")?;
    Ok(kib.parse::<f64>()? / 1024.0)
}

/// Returns the processor time of all threads of a process, in seconds.
fn processor_time(process: u32) -> Result<f64> {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat"))?;
    // The name, which may have spaces, is in parentheses. The state is the third field; user and system time are the
    // 14th and 15th.
    let (_, fields) = stat.rsplit_once(')').context("Linux tells the name")?;
    let times = fields.split_whitespace().skip(11).take(2).map(str::parse::<f64>);
    let ticks = times.sum::<Result<f64, _>>()?;
    Ok(ticks / TICKS)
}

const HEADER: &str = "# Memory and time of the functions

Written by `cargo run --release -p rayfold-bench -- footprint` with the built-in store. The program puts all frames of an
animation but the last into the bucket. Then the shipped functions do the rest, in one invocation each: *render* draws the last
frame, lists everything, writes the manifest, lists again and claims; *assemble* builds the GIF, frame by frame; *sweep* checks
whether any work is left. This is the largest amount of work of one invocation for an animation of that size.

*Memory* is the peak memory of the process, in MiB. By default, Lambda gives 1,769 to render and 3,008 to assemble, which also
sweeps. *Processor* is the time of all its threads in seconds, with a resolution of 10 ms. It depends on the machine and on its
other load. *Requests* are those that S3 bills. All pictures show the same sphere on a slab.

";

fn line(row: &Row) -> String {
    let [width, height] = row.size;
    let costs = row.costs.map(|Cost { memory, processor, requests }| {
        format!("{memory:.0} | {processor:.2} | {}", requests.billed())
    });
    format!("| {} | {width} x {height} | {} |", row.frames, costs.join(" | "))
}

/// Compares the figures with the limits.
fn conclusions(rows: &[Row]) -> String {
    let most = |of: usize| rows.iter().max_by(|a, b| a.costs[of].memory.total_cmp(&b.costs[of].memory));
    let (Some(rendered), Some(assembled), Some(largest)) =
        (most(0), most(1), rows.iter().max_by_key(|row| row.frames))
    else {
        return String::new();
    };
    let share = |row: &Row, of: usize, given: f64| row.costs[of].memory / given * 100.0;
    let [fold, build, _] = largest.costs;
    format!(
        "
- **Memory.** Render used at most {:.0} % of its memory, with {} frames; assemble {:.0} %, with {} frames of {} x {}.
- **Processor.** A fold of {} frames takes {:.2} s beyond drawing, including two complete listings. The GIF takes {:.2} ms per
  frame of {} x {}.
",
        share(rendered, 0, RENDER_MB),
        rendered.frames,
        share(assembled, 1, ASSEMBLE_MB),
        assembled.frames,
        assembled.size[0],
        assembled.size[1],
        largest.frames,
        fold.processor,
        build.processor * 1e3 / largest.frames as f64,
        largest.size[0],
        largest.size[1],
    )
}

fn write_report(args: &Args, rows: &[Row]) -> Result<()> {
    let mut page = HEADER.to_owned();
    let columns = STEPS.map(|step| format!("{step}: memory | processor | requests"));
    writeln!(page, "| frames | pictures | {} |", columns.join(" | "))?;
    writeln!(page, "| --- | --- |{}", " --- |".repeat(3 * STEPS.len()))?;
    for row in rows {
        writeln!(page, "{}", line(row))?;
    }
    if let Some(most) = args.most {
        writeln!(page, "\nAnimations with more than {most} frames were not measured.")?;
    }
    page.push_str("\n![Memory of the functions](footprint.svg)\n");
    page.push_str(&conclusions(rows));
    let mut figures = csv::Writer::from_writer(Vec::new());
    let columns =
        STEPS.map(|step| ["mib", "cpu_s", "get", "put", "list"].map(|what| format!("{step}_{what}")));
    figures.write_record(
        ["frames", "width", "height"].map(str::to_owned).iter().chain(columns.iter().flatten()),
    )?;
    for Row { frames, size: [width, height], costs } in rows {
        let costs = costs.map(|Cost { memory, processor, requests: Requests { get, put, list, .. } }| {
            [memory.to_string(), processor.to_string(), get.to_string(), put.to_string(), list.to_string()]
        });
        let sizes = [frames.to_string(), width.to_string(), height.to_string()];
        figures.write_record(sizes.iter().chain(costs.iter().flatten()))?;
    }
    for (name, bytes) in [("footprint.md", page.into_bytes()), ("footprint.csv", figures.into_inner()?)] {
        args.output.write(name, bytes)?;
    }
    plot(&args.output.path("footprint.svg"), rows)
}

fn plot(path: &Path, rows: &[Row]) -> Result<()> {
    let series = [0, 1, 2].map(|of: usize| Series {
        name: STEPS[of].to_owned(),
        points: rows
            .iter()
            .filter(|row| row.size == SMALL)
            .map(|row| (row.frames as f64, row.costs[of].memory))
            .collect(),
        joined: true,
    });
    let labels = Labels { title: "memory of the functions", x: "frames of the animation", y: "MiB" };
    log_log(path, &labels, &series)
}
