//! What is billed for an animation and for the stack that it is made on, line by line.
//!
//! Invariants: free allowances are left out, so that a bill is never higher for them; what is not known beforehand
//! (requests a frame, sizes) is a named constant with its reason, or the caller's.

use rayfold_scene::Screen;
use serde::Serialize;

use super::prices::Prices;

/// Memory with which a function has one processor, in MB, and that of the render function.
const PROCESSOR_MB: f64 = 1769.0;

/// Memory of the assemble function, in MB.
const ASSEMBLE_MEMORY_MB: f64 = 3008.0;

/// Minutes between two sweeps.
const SWEEP_MINUTES: f64 = 15.0;

/// What an invocation waits for requests and pauses, in milliseconds, which Lambda bills: measured at these numbers of
/// frames (`docs/reports/simulation.md`), and in between taken to grow evenly.
const WAITING_MS: [(f64, f64); 2] = [(50.0, 258.0), (1_000.0, 427.0)];

/// Bytes of a frame's PNG, a pixel: about twice what `scenes/hello` gives.
const FRAME_BYTES_A_PIXEL: f64 = 0.15;

/// Bytes of the GIF, a pixel of a frame: about twice what `scenes/hello` gives.
const GIF_BYTES_A_PIXEL: f64 = 0.06;

/// Time that the assemble function takes for a pixel: decoding, quantising, encoding. Measured: 14 to 23 ns of a
/// processor, more for small frames (`docs/decisions/gif-in-one-piece.md`); Lambda's may be slower.
const ASSEMBLE_NS_A_PIXEL: f64 = 30.0;

/// Requests a frame while it is made, of the kind that is billed as PUT, COPY, POST or LIST: the upload, the look for
/// a result, the result, and the listings, manifests and claims of a fold, of which many frames share one. Measured with
/// the upload, at 50 frames and more: 3.5 to 5.2 (`docs/reports/simulation.md`, `pipeline.md`).
const PUTS_AND_LISTS_A_FRAME: f64 = 6.0;

/// The same, of the kind that is billed as GET: the script, the manifest before and after the pause, and the assembler's
/// reading of the frame. Measured: 4.2 to 4.7.
const GETS_A_FRAME: f64 = 5.0;

/// Keys in a page of a listing.
const PAGE: f64 = 1000.0;

/// The part of a GIF that one request uploads.
const UPLOAD_PART_MB: f64 = 8.0;

/// The quiet before the assembler starts, or its rounds of listings.
const ASSEMBLE_OVERHEAD_MS: f64 = 1000.0;

/// Log lines of an invocation, the platform's own among them.
const LOG_BYTES: f64 = 1500.0;

/// Of the invocations that X-Ray samples by its default rule, beyond the first of each second.
const TRACED: f64 = 0.05;

/// Metrics that the stack's 21 alarms look at; each is billed. `infra/terraform` tests the number.
const ALARMS: f64 = 24.0;

/// A sweep of a bucket in which nothing is amiss.
const SWEEP_S: f64 = 0.5;

/// Lambda keeps five readers waiting at a queue, each asking every 20 s.
const QUEUE_POLLS_A_MONTH: f64 = 5.0 * MINUTES_A_MONTH * 3.0;

const MINUTES_A_MONTH: f64 = 30.0 * 24.0 * 60.0;

/// What is to be made, and on what.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Workload {
    /// How many frames.
    pub frames: u64,
    /// Milliseconds of the render function, a frame.
    pub ms: f64,
    /// Of a frame, in pixels.
    pub width: usize,
    /// Of a frame, in pixels.
    pub height: usize,
    /// Memory of the render function.
    pub memory_mb: f64,
    /// Memory of the assemble function.
    pub assemble_memory_mb: f64,
    /// Whether the functions run on arm64, or on x86_64.
    pub arm64: bool,
    /// Milliseconds of the assemble function, a frame.
    pub assemble_ms: f64,
    /// A frame's PNG, in the mean.
    pub frame_kb: f64,
    /// The GIF.
    pub gif_mb: f64,
    /// Between two sweeps.
    pub sweep_minutes: f64,
    /// Whether the stack has a key of its own.
    pub customer_managed_key: bool,
}

impl Workload {
    /// Frames of one size, each of which takes the render function so many milliseconds, on a stack as it is set up when
    /// nobody says otherwise. Sizes of files are guessed from the pixels.
    pub fn new(frames: u64, size: Screen, ms: f64) -> Self {
        let pixels = size.pixels() as f64;
        Self {
            frames,
            ms,
            width: size.width() as usize,
            height: size.height() as usize,
            memory_mb: PROCESSOR_MB,
            assemble_memory_mb: ASSEMBLE_MEMORY_MB,
            arm64: false,
            assemble_ms: pixels * ASSEMBLE_NS_A_PIXEL / 1e6,
            frame_kb: pixels * FRAME_BYTES_A_PIXEL / 1e3,
            gif_mb: frames as f64 * pixels * GIF_BYTES_A_PIXEL / 1e6,
            sweep_minutes: SWEEP_MINUTES,
            customer_managed_key: false,
        }
    }

    /// How long the assemble function runs, in seconds.
    pub fn assembling_s(&self) -> f64 {
        (self.frames as f64 * self.assemble_ms + ASSEMBLE_OVERHEAD_MS) / 1e3
    }
}

/// Lines under one heading.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Section {
    /// What it is about.
    pub title: &'static str,
    /// What is billed.
    pub lines: Vec<Line>,
    /// Together, in US dollars.
    pub usd: f64,
}

/// So much of something, and what it costs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Line {
    /// What is billed.
    pub item: &'static str,
    /// How much of it.
    pub amount: f64,
    /// What that counts; empty for pieces.
    pub unit: &'static str,
    /// In US dollars.
    pub usd: f64,
}

impl Section {
    fn new(title: &'static str, lines: Vec<Line>) -> Self {
        let usd = lines.iter().map(|line| line.usd).sum();
        Self { title, lines, usd }
    }
}

/// What an invocation waits for requests and pauses, in milliseconds, while so many frames are made.
pub fn waiting_ms(frames: u64) -> f64 {
    let [(few, short), (many, long)] = WAITING_MS;
    short + (long - short) * ((frames as f64 - few) / (many - few)).clamp(0.0, 1.0)
}

/// Milliseconds that the render function takes for one of so many frames, if drawing it takes `drawing_ms` on one
/// processor and the function has `memory_mb`.
pub fn render_ms(frames: u64, drawing_ms: f64, memory_mb: f64) -> f64 {
    drawing_ms * PROCESSOR_MB / memory_mb + waiting_ms(frames)
}

/// Everything, in the order in which it is asked about.
pub fn estimate(work: &Workload, prices: &Prices) -> Vec<Section> {
    vec![making(work, prices), keeping(work, prices), stack(work, prices)]
}

fn line(item: &'static str, amount: f64, unit: &'static str, price: f64) -> Line {
    Line { item, amount, unit, usd: amount * price }
}

fn gb_second(work: &Workload, prices: &Prices) -> f64 {
    if work.arm64 { prices.lambda.gb_second_arm64 } else { prices.lambda.gb_second_x86_64 }
}

/// Lambda counts a GB as 1,024 MB.
fn gb_seconds(memory_mb: f64, ms: f64) -> f64 {
    memory_mb / 1024.0 * ms / 1000.0
}

fn making(work: &Workload, prices: &Prices) -> Section {
    let frames = work.frames as f64;
    let compute = gb_second(work, prices);
    let uploads = (work.gif_mb / UPLOAD_PART_MB).ceil() + 2.0;
    let invocations = frames + 1.0;
    Section::new(
        "Making it, once",
        vec![
            line("Lambda: invocations", invocations, "", prices.lambda.request),
            line("Lambda: rendering", frames * gb_seconds(work.memory_mb, work.ms), "GB-s", compute),
            line(
                "Lambda: assembling",
                gb_seconds(work.assemble_memory_mb, 1e3 * work.assembling_s()),
                "GB-s",
                compute,
            ),
            line(
                "S3: puts and lists",
                frames * PUTS_AND_LISTS_A_FRAME + uploads,
                "",
                prices.s3.put_copy_post_list,
            ),
            line("S3: gets", frames * GETS_A_FRAME, "", prices.s3.get_and_other),
            line("Logs", invocations * LOG_BYTES / 1e9, "GB", prices.cloudwatch.log_gb),
            line("Traces", invocations * TRACED, "", prices.xray_trace),
            line("Downloading the GIF once", work.gif_mb / 1e3, "GB", prices.transfer_out_gb),
        ],
    )
}

fn keeping(work: &Workload, prices: &Prices) -> Section {
    let frames = work.frames as f64;
    let sweeps = MINUTES_A_MONTH / work.sweep_minutes;
    let pages = (frames / PAGE).ceil();
    // Its scripts among everybody's, its scripts, and its frames; then its manifest and the head of its GIF.
    let (lists, gets) = (frames / PAGE + 2.0 * pages, 2.0);
    Section::new(
        "Keeping it, each month",
        vec![
            line(
                "S3: frames and GIF",
                (frames * work.frame_kb / 1e3 + work.gif_mb) / 1e3,
                "GB",
                prices.s3.standard_gb_month,
            ),
            line("S3: lists of the sweep", sweeps * lists, "", prices.s3.put_copy_post_list),
            line("S3: gets of the sweep", sweeps * gets, "", prices.s3.get_and_other),
        ],
    )
}

fn stack(work: &Workload, prices: &Prices) -> Section {
    let sweeps = MINUTES_A_MONTH / work.sweep_minutes;
    let mut lines = vec![
        line("Alarms", ALARMS, "", prices.cloudwatch.alarm_month),
        line("Dashboard", 1.0, "", prices.cloudwatch.dashboard_month),
        line("Schedule of the sweep", sweeps, "", prices.scheduler_invocation),
        line("Lambda: sweep invocations", sweeps, "", prices.lambda.request),
        line(
            "Lambda: sweeping",
            sweeps * gb_seconds(work.assemble_memory_mb, SWEEP_S * 1000.0),
            "GB-s",
            gb_second(work, prices),
        ),
        line("S3: lists of the sweep", 2.0 * sweeps, "", prices.s3.put_copy_post_list),
        line("Reading the failure queue", QUEUE_POLLS_A_MONTH, "", prices.sqs_request),
    ];
    if work.customer_managed_key {
        lines.push(line("Key", 1.0, "", prices.kms_key_month));
    }
    Section::new("The stack, each month, however many animations", lines)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn prices() -> Prices {
        Prices::built_in().unwrap()
    }

    fn work(frames: u64, ms: f64) -> Workload {
        Workload {
            frames,
            ms,
            width: 512,
            height: 512,
            memory_mb: 1024.0,
            assemble_memory_mb: 2048.0,
            arm64: false,
            assemble_ms: 10.0,
            frame_kb: 30.0,
            gif_mb: 16.0,
            sweep_minutes: 15.0,
            customer_managed_key: false,
        }
    }

    fn find<'a>(section: &'a Section, item: &str) -> &'a Line {
        section.lines.iter().find(|line| line.item == item).unwrap()
    }

    fn near(a: f64, b: f64) {
        assert!((a - b).abs() <= 1e-9 * b.abs().max(1e-6), "{a} is not {b}");
    }

    /// By hand: 1,000 frames x 2 s x 1 GB = 2,000 GB-s, at 0.0000166667.
    #[test]
    fn rendering_is_memory_times_time() {
        let making = making(&work(1000, 2000.0), &prices());
        near(find(&making, "Lambda: rendering").amount, 2000.0);
        near(find(&making, "Lambda: rendering").usd, 0.033_333_4);
        near(find(&making, "Lambda: invocations").amount, 1001.0);
    }

    /// By hand: 2 GB x (1,000 x 10 ms + 1 s) = 22 GB-s.
    #[test]
    fn assembling_takes_its_own_memory() {
        near(find(&making(&work(1000, 2000.0), &prices()), "Lambda: assembling").amount, 22.0);
    }

    #[test]
    fn arm64_is_cheaper_for_the_same_time() {
        let (x86, arm) = (work(10, 100.0), Workload { arm64: true, ..work(10, 100.0) });
        let cost = |work| find(&making(work, &prices()), "Lambda: rendering").usd;
        near(cost(&arm) / cost(&x86), 0.000_013_333_4 / 0.000_016_666_7);
    }

    /// By hand: 16 MB in parts of 8, begun and completed: 4 requests beside the frames'.
    #[test]
    fn requests_grow_with_frames() {
        let small = making(&work(100, 1.0), &prices());
        near(find(&small, "S3: puts and lists").amount, 100.0 * PUTS_AND_LISTS_A_FRAME + 4.0);
        near(find(&small, "S3: gets").amount, 100.0 * GETS_A_FRAME);
    }

    /// By hand: 2,880 sweeps a month, each lists its 2 pages of scripts and 2 of frames and is 1.5 pages of all scripts.
    #[test]
    fn a_kept_animation_is_visited_by_each_sweep() {
        let keeping = keeping(&work(1500, 1.0), &prices());
        near(find(&keeping, "S3: lists of the sweep").amount, 2880.0 * 5.5);
        near(find(&keeping, "S3: gets of the sweep").amount, 2880.0 * 2.0);
        near(find(&keeping, "S3: frames and GIF").amount, (1500.0 * 0.03 + 16.0) / 1000.0);
    }

    #[test]
    fn a_key_is_billed_by_the_month() {
        let with = Workload { customer_managed_key: true, ..work(10, 100.0) };
        near(stack(&with, &prices()).usd - stack(&work(10, 100.0), &prices()).usd, 1.0);
    }

    #[test]
    fn sections_are_the_sums_of_their_lines() {
        for section in estimate(&work(1000, 300.0), &prices()) {
            near(section.usd, section.lines.iter().map(|line| line.usd).sum());
            assert!(section.lines.iter().all(|line| line.usd > 0.0), "{section:?}");
        }
    }

    #[test]
    fn waiting_is_what_was_measured_and_between() {
        assert_eq!([1, 50, 525, 1_000, 1_000_000].map(waiting_ms), [258.0, 258.0, 342.5, 427.0, 427.0]);
        assert_eq!(render_ms(50, 10.0, 2.0 * PROCESSOR_MB), 263.0);
    }

    #[test]
    fn the_prices_that_come_with_the_program_are_whole() {
        let prices = prices();
        assert_eq!(prices.region, "us-east-1");
        assert!(prices.sources.iter().all(|page| page.starts_with("https://aws.amazon.com/")));
    }
}
