//! `rayfold-bench scale`: time and cost of animations of 10 to 100,000 frames, and of many at once, in a simulated
//! world with the limits of AWS.
//!
//! Time is simulated, so the figures do not depend on the machine. The cost of a frame follows from the counted
//! requests, the time of the invocations and `infra/prices.json`. Writes `docs/reports/scale.md`, its figures and its
//! plots.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::Context as _;
use rayfold_simulation::{Scale, ScaleReport, measure};
use rayon::prelude::*;
use serde::Deserialize;

use crate::plot::{Labels, Series, log_log};
use crate::report_folder::ReportFolder;

/// The memory of the functions in MiB, by the defaults of the stack.
pub(crate) const RENDER_MB: f64 = 1_769.0;
pub(crate) const ASSEMBLE_MB: f64 = 3_008.0;

/// The assembler's time per frame of 512 x 512 (`docs/decisions/gif-in-one-piece.md`).
const PUSH: Duration = Duration::from_millis(6);

/// The assembler's time per frame of 1920 x 1080.
const PUSH_LARGE: Duration = Duration::from_millis(30);

/// The time limit of an invocation: the maximum of Lambda.
pub(crate) const LONGEST: Duration = Duration::from_secs(900);

/// The scripts uploaded per second: some 40 connections at 40 ms per put. At 1,000 concurrent invocations as many
/// frames complete per second.
const UPLOADED: u64 = 1_000;

/// The goal: the mean cost of a frame in requests.
const GOAL: f64 = 12.0;

/// The number of concurrent invocations of both functions, by default for an account.
const PLACES: usize = 1_000;

/// The numbers of frames and of animations, and the assembler's time per frame.
const SIZES: [(u64, u64, Duration); 10] = [
    (10, 1, PUSH),
    (100, 1, PUSH),
    (1_000, 1, PUSH),
    (10_000, 1, PUSH),
    (30_000, 1, PUSH),
    (100_000, 1, PUSH),
    (10, 1_000, PUSH),
    (100, 1_000, PUSH),
    (30_000, 1, PUSH_LARGE),
    (100_000, 1, PUSH_LARGE),
];

/// The rows by places: frames, and places for both functions.
const BY_PLACES: ([u64; 4], [usize; 6]) = ([10, 50, 300, 1_000], [1, 2, 4, 10, 100, 1_000]);

/// The number of worlds over which each of these rows is a mean.
const WORLDS: u64 = 5;

/// Options of `rayfold-bench scale`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Leave out sizes with more frames; the report then says so
    #[arg(long)]
    most: Option<u64>,
    /// Read the prices from this file
    #[arg(long, default_value = "infra/prices.json")]
    prices: PathBuf,
    #[command(flatten)]
    output: ReportFolder,
}

#[derive(Deserialize)]
struct Prices {
    lambda: LambdaPrices,
    s3: S3Prices,
}

#[derive(Deserialize)]
struct LambdaPrices {
    request: f64,
    gb_second_x86_64: f64,
}

#[derive(Deserialize)]
struct S3Prices {
    put_copy_post_list: f64,
    get_and_other: f64,
}

/// The results for one size.
struct Row {
    frames: u64,
    animations: u64,
    push: Duration,
    report: ScaleReport,
    dollars_a_frame: f64,
}

/// The value of a row that a plot shows.
type Value = fn(&Row) -> f64;

/// Measures and writes the report.
///
/// # Errors
///
/// Fails if an animation's result is wrong, or if the report cannot be written.
#[expect(clippy::print_stdout, reason = "a measurement tells what it finds")]
pub fn run(args: &Args) -> anyhow::Result<()> {
    args.output.prepare()?;
    let text = std::fs::read_to_string(&args.prices)
        .with_context(|| format!("cannot read {}", args.prices.display()))?;
    let prices: Prices = serde_json::from_str(&text)?;
    let is_wanted = |(frames, animations, _): &(u64, u64, Duration)| {
        args.most.is_none_or(|most| frames * animations <= most)
    };
    // Each size is simulated in its own world.
    let rows = SIZES.into_par_iter().filter(is_wanted).map(|(frames, animations, push)| {
        let start = Instant::now();
        let scale = Scale::on_aws(frames, animations, UPLOADED, PLACES, push);
        let report = measure(scale).map_err(anyhow::Error::msg)?;
        let dollars_a_frame = dollars(&report, frames * animations, &prices);
        let row = Row { frames, animations, push, report, dollars_a_frame };
        println!("{} {:.0} s", line(&row), start.elapsed().as_secs_f64());
        Ok(row)
    });
    let rows = rows.collect::<anyhow::Result<Vec<_>>>()?;
    let (frames, places) = BY_PLACES;
    let cases: Vec<_> = frames.iter().flat_map(|frames| places.map(|places| (*frames, places))).collect();
    let by_places = cases.into_par_iter().map(|(frames, places)| {
        let line = line_of_places(frames, places, &prices)?;
        println!("{line}");
        Ok(line)
    });
    let by_places = by_places.collect::<anyhow::Result<Vec<_>>>()?;
    write_report(args, &rows, &by_places)
}

const PLACES_HEADER: &str = "
## By places

One animation runs as above, but both functions together have a limited number of *places* (concurrent invocations).
The figures are means of 5 worlds; *tail* is that of the worst world. *Puts, lists* and *gets* are the requests of both
functions per frame. *USD* is the cost of 1,000 frames: these requests, and the time beyond drawing.

| frames | places | requests a frame | puts, lists | gets | beyond, ms | tail, ms | manifests written | USD |
| --- | --- | --- | --- | --- | --- | --- | --- | --- |
";

fn line_of_places(frames: u64, places: usize, prices: &Prices) -> anyhow::Result<String> {
    let mut reports = Vec::new();
    for seed in 1..=WORLDS {
        let scale = Scale { seed, ..Scale::on_aws(frames, 1, UPLOADED, places, PUSH) };
        reports.push(measure(scale).map_err(anyhow::Error::msg)?);
    }
    let mean = |value: fn(&ScaleReport) -> f64| reports.iter().map(value).sum::<f64>() / WORLDS as f64;
    let requests = mean(|report| report.requests_a_frame);
    let [gets, puts, _, lists] = [0, 1, 2, 3].map(|kind: usize| {
        reports.iter().map(|report| report.kinds_a_frame[kind]).sum::<f64>() / WORLDS as f64
    });
    let beyond = mean(|report| report.beyond_drawing.as_secs_f64());
    let tail = reports.iter().map(|report| report.tail.as_millis()).max().unwrap_or_default();
    let manifests = mean(|report| report.revisions as f64);
    let waiting = beyond * RENDER_MB / 1_024.0 * prices.lambda.gb_second_x86_64;
    let dollars = (puts + lists) * prices.s3.put_copy_post_list + gets * prices.s3.get_and_other + waiting;
    Ok(format!(
        "| {frames} | {places} | {requests:.2} | {:.2} | {gets:.2} | {:.0} | {tail} | {manifests:.0} | {:.4} |",
        puts + lists,
        beyond * 1000.0,
        dollars * 1000.0,
    ))
}

/// Returns the cost of a frame in USD: requests and functions. Excludes the upload, the download and storage.
fn dollars(report: &ScaleReport, frames: u64, prices: &Prices) -> f64 {
    let [get, put, _, list] = report.kinds_a_frame;
    let [render, assemble] = report.invocations.map(|count| count as f64);
    let rendering = (report.drawing + report.beyond_drawing).as_secs_f64() * render * RENDER_MB / 1_024.0;
    let assembling = report.assembling_time.as_secs_f64() * ASSEMBLE_MB / 1_024.0;
    let lambda = (render + assemble) * prices.lambda.request
        + (rendering + assembling) * prices.lambda.gb_second_x86_64;
    (put + list) * prices.s3.put_copy_post_list + get * prices.s3.get_and_other + lambda / frames as f64
}

const HEADER: &str = "# Animations of any size

Written by `cargo run --release -p rayfold-bench -- scale`, in simulated time, so the figures do not depend on the machine. The
real steps use a bucket that accepts 3,500 writes and 5,500 reads per second, for all its keys together. It replies to the
others with 503, and S3's client sends a request up to three times. GET takes 10-25 ms, PUT 25-60 ms, LIST 20-40 ms per 1,000
names, and bodies are transferred at 80 MB/s (assumed). Lambda runs at most 1,000 concurrent invocations of both functions, the
account's default. 1,000 scripts per second are uploaded, with `frames` set. A frame is drawn in 800 to 1,200 ms and encoded in
6 ms (512 x 512) or 30 ms (1920 x 1080). An invocation has 15 minutes. A GIF that takes longer is built by several
invocations, one after the other. The model omits the processor time of the folds, the transfer of the encoder's state
from one assembler to the next (some 5 MB at 1080p), and late events. Memory and processor time of the functions are
[measured separately](footprint.md).

*Requests* are those of the render function, including 503s. *Beyond* is the mean time of its invocations except drawing; Lambda
bills it. *Tail* is the time from the last frame's put to the render function's last claim. *Waited* is the time until an
invocation could start, mean and maximum. *Assembling* is the time of all assemblers together. *In pieces* is the number of
assemblers that built a GIF, each continuing from its predecessor's checkpoint. *Cost* is the cost of 1,000 frames in
USD, for the requests and for both functions.
";

const TABLE: &str = "
| frames | animations | ms to encode one | requests per frame | LIST per frame | 503 per frame | beyond, ms | tail, ms | claims | manifests written | largest manifest, KB | first GIF, s | last GIF, s | assembling, s | in pieces | render waited, s | assemble waited, s | cost of 1,000 |
| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |
";

fn line(row: &Row) -> String {
    let Row { frames, animations, push, report, dollars_a_frame } = row;
    let ScaleReport { requests_a_frame, tail, claims, revisions, throttled, .. } = report;
    let seconds = |time: Duration| time.as_secs_f64();
    let waits = report.waits.map(|[mean, most]| format!("{:.2}, {:.1}", seconds(mean), seconds(most)));
    format!(
        "| {frames} | {animations} | {} | {requests_a_frame:.2} | {:.2} | {throttled:.2} | {} | {} | {claims} | {revisions} | {:.0} | \
         {:.1} | {:.1} | {:.1} | {} | {} | {} | {:.4} |",
        push.as_millis(),
        report.kinds_a_frame[3],
        report.beyond_drawing.as_millis(),
        tail.as_millis(),
        report.manifest as f64 / 1000.0,
        seconds(report.first),
        seconds(report.whole),
        seconds(report.assembling_time),
        pieces(row),
        waits[0],
        waits[1],
        dollars_a_frame * 1000.0,
    )
}

/// Returns the mean number of invocations that built a GIF.
fn pieces(row: &Row) -> u64 {
    1 + row.report.left / row.animations
}

const PLOTS: &str = "
![Requests per frame](scale-requests.svg)
![Seconds to the GIF](scale-time.svg)
![USD for 1,000 frames](scale-cost.svg)
";

/// Compares the figures with the limits.
fn conclusions(rows: &[Row]) -> String {
    let of_one: Vec<&Row> = rows.iter().filter(|row| row.animations == 1).collect();
    let (Some(largest), Some(longest_built), Some(dearest)) = (
        of_one.iter().filter(|row| row.push == PUSH).max_by_key(|row| row.frames),
        of_one.iter().max_by_key(|row| row.report.assembling_time),
        rows.iter().max_by(|a, b| a.report.requests_a_frame.total_cmp(&b.report.requests_a_frame)),
    ) else {
        return String::new();
    };
    let fit = |push: Duration| LONGEST.as_millis() / push.as_millis();
    let Row { frames, report, .. } = largest;
    let most_refused = rows.iter().max_by(|a, b| a.report.throttled.total_cmp(&b.report.throttled));
    let most_refused = most_refused.unwrap_or(dearest);
    let longest = rows.iter().max_by_key(|row| row.report.waits[1][1]).unwrap_or(dearest);
    let many = |row: &Row| match row.animations {
        1 => format!("one animation of {} frames", row.frames),
        count => format!("{count} animations of {} frames", row.frames),
    };
    format!(
        "
## Figures near a limit

- **The assembler's 15 minutes.** Encoding alone fills them with {} frames at 6 ms (512 x 512), and with {} at 30 ms (1080p). A
  longer GIF is built in [pieces](../decisions/gif-in-one-piece.md#a-cut-in-time): {} frames at {} ms by {} invocations in {:.0}
  s together. The next limit is a day, after which the bucket's rules remove an unfinished upload: 90 pieces, some 13 million
  frames at 6 ms, 2.7 million at 30 ms.
- **Requests.** {frames} frames take {:.2} requests per frame, of {GOAL} allowed; the largest number is {:.2}, with {}. Almost
  every invocation stops while another frame is to come ([pipeline](../pipeline.md#folding)). In all there are {:.2} listings
  per frame; one of them looks for a result before drawing.
- **The manifest** has {:.0} bytes per frame at {frames} frames, {:.1} MB in all, and was written {} times: while frames
  complete, as often as the time to list and to put it allows.
- **The bucket's limits.** The largest number of 503s is {:.2} per frame, with {}; each request is repeated after a pause.
- **Concurrency.** An assembler waited at most {:.1} s until it could start, with {}: invocations of both functions share the
  limit, in the order of their events.
",
        fit(PUSH),
        fit(PUSH_LARGE),
        longest_built.frames,
        longest_built.push.as_millis(),
        pieces(longest_built),
        longest_built.report.assembling_time.as_secs_f64(),
        report.requests_a_frame,
        dearest.report.requests_a_frame,
        many(dearest),
        report.kinds_a_frame[3],
        report.manifest as f64 / *frames as f64,
        report.manifest as f64 / 1e6,
        report.revisions,
        most_refused.report.throttled,
        many(most_refused),
        longest.report.waits[1][1].as_secs_f64(),
        many(longest),
    )
}

fn write_report(args: &Args, rows: &[Row], by_places: &[String]) -> anyhow::Result<()> {
    let mut page = HEADER.to_owned();
    page.push_str(TABLE);
    for row in rows {
        writeln!(page, "{}", line(row))?;
    }
    if let Some(most) = args.most {
        writeln!(page, "\nSizes with more than {most} frames in all were not run.")?;
    }
    page.push_str(PLACES_HEADER);
    for line in by_places {
        writeln!(page, "{line}")?;
    }
    page.push_str(PLOTS);
    page.push_str(&conclusions(rows));
    let mut figures = csv::Writer::from_writer(Vec::new());
    figures.write_record([
        "frames",
        "animations",
        "encoding_ms",
        "requests_a_frame",
        "get",
        "put",
        "list",
        "throttled",
        "bytes_a_frame",
        "beyond_ms",
        "tail_ms",
        "claims",
        "revisions",
        "manifest_bytes",
        "first_s",
        "whole_s",
        "assembling_s",
        "pieces",
        "render_wait_s",
        "assemble_wait_s",
        "at_once",
        "dollars_a_frame",
    ])?;
    for row in rows {
        let Row { frames, animations, push, report, dollars_a_frame } = row;
        let [get, put, _, list] = report.kinds_a_frame;
        let seconds = |time: Duration| time.as_secs_f64().to_string();
        figures.write_record([
            frames.to_string(),
            animations.to_string(),
            push.as_millis().to_string(),
            report.requests_a_frame.to_string(),
            get.to_string(),
            put.to_string(),
            list.to_string(),
            report.throttled.to_string(),
            report.bytes_a_frame.to_string(),
            report.beyond_drawing.as_millis().to_string(),
            report.tail.as_millis().to_string(),
            report.claims.to_string(),
            report.revisions.to_string(),
            report.manifest.to_string(),
            seconds(report.first),
            seconds(report.whole),
            seconds(report.assembling_time),
            pieces(row).to_string(),
            seconds(report.waits[0][0]),
            seconds(report.waits[1][0]),
            report.at_once.to_string(),
            dollars_a_frame.to_string(),
        ])?;
    }
    for (name, bytes) in [("scale.md", page.into_bytes()), ("scale.csv", figures.into_inner()?)] {
        args.output.write(name, bytes)?;
    }
    let plots: [(&str, &str, Value); 3] = [
        ("requests", "requests per frame", |row| row.report.requests_a_frame),
        ("time", "seconds to the GIF", |row| row.report.whole.as_secs_f64()),
        ("cost", "USD for 1,000 frames", |row| row.dollars_a_frame * 1000.0),
    ];
    for (name, y, value) in plots {
        let alone = rows.iter().filter(|row| row.animations == 1 && row.push == PUSH);
        let series = [Series {
            name: "one animation".to_owned(),
            points: alone.map(|row| (row.frames as f64, value(row))).collect(),
            joined: true,
        }];
        let labels = Labels { title: y, x: "frames of the animation", y };
        log_log(&args.output.path(format!("scale-{name}.svg")), &labels, &series)?;
    }
    Ok(())
}
