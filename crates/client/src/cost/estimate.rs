//! An estimate of the bill for an animation and for its stack, line by line.
//!
//! Invariants: free allowances are not subtracted, so a real bill is at most lower because of them. A quantity that is
//! not known beforehand (requests per frame, sizes) is a named constant with its reason, or comes from the caller.

use rayfold_scene::{Container, Screen};
use serde::Serialize;

use super::prices::Prices;

/// The memory in MB with which a function has one processor, and that of the render function.
const PROCESSOR_MB: f64 = 1769.0;

/// The memory of the assemble function, in MB.
const ASSEMBLE_MEMORY_MB: f64 = 3008.0;

/// The minutes between two sweeps.
const SWEEP_MINUTES: f64 = 15.0;

/// The time that an invocation waits for requests and pauses, in milliseconds, which Lambda bills, if the frames are drawn one
/// after the other. Simulated: 147 to 209, the most for few frames (`docs/reports/scale.md`).
const WAITING_MS: f64 = 210.0;

/// The time of `WAITING_MS` if all frames are drawn at once. Simulated: 208 to 235.
const WAITING_AT_ONCE_MS: f64 = 240.0;

/// The places of an account, unless it requests more.
const PLACES: u64 = 1_000;

/// An animation of fewer frames takes more requests for each.
const FEW_FRAMES: u64 = 50;

/// The size of a frame's PNG in bytes per pixel: about twice that of `scenes/hello`.
const FRAME_BYTES_A_PIXEL: f64 = 0.15;

/// The size of the GIF in bytes per pixel of a frame: about twice that of `scenes/hello`.
const GIF_BYTES_A_PIXEL: f64 = 0.06;

/// The size of a Y4M in bytes per pixel of a frame: its planes are as large as the frame.
const Y4M_BYTES_A_PIXEL: f64 = 3.0;

/// The time of the assemble function per pixel: decoding, quantising, encoding. Measured: 14 to 23 ns of processor
/// time, more for small frames (`docs/decisions/gif-in-one-piece.md`); Lambda's processors may be slower.
const ASSEMBLE_NS_A_PIXEL: f64 = 30.0;

/// The requests per frame that are billed as PUT, COPY, POST or LIST: the upload, the check for a result, the result,
/// and a share of the listings, manifests and claims of a fold. Simulated with the upload, at 50 frames and more: 4.2
/// to 5.3 (`docs/reports/simulation.md`).
const PUTS_AND_LISTS_A_FRAME: f64 = 6.0;

/// The requests per frame billed as PUT or LIST for an animation of few frames. Simulated for 10: 6.6 to 7.5.
const PUTS_AND_LISTS_OF_FEW: f64 = 8.0;

/// The requests per frame that are billed as GET: the script, the manifest, the other frame's script, and the
/// assembler's read of the frame. Simulated: 4.0 to 5.3.
const GETS_A_FRAME: f64 = 5.0;

/// The number of keys in a page of a listing.
const PAGE: f64 = 1000.0;

/// The size of the part of a GIF that one request uploads.
const UPLOAD_PART_MB: f64 = 8.0;

/// The quiet period before the assembler starts, or its rounds of listings.
const ASSEMBLE_OVERHEAD_MS: f64 = 1000.0;

/// The log lines of an invocation in bytes, including the platform's own.
const LOG_BYTES: f64 = 1500.0;

/// The share of invocations that X-Ray samples by its default rule, beyond the first of each second.
const TRACED: f64 = 0.05;

/// The metrics that the stack's 21 alarms watch; each is billed. A test of `infra/terraform` checks the number.
const ALARMS: f64 = 24.0;

/// The seconds of a sweep of a bucket in which nothing is wrong.
const SWEEP_S: f64 = 0.5;

/// Lambda polls a queue with five readers, each every 20 s.
const QUEUE_POLLS_A_MONTH: f64 = 5.0 * MINUTES_A_MONTH * 3.0;

const MINUTES_A_MONTH: f64 = 30.0 * 24.0 * 60.0;

/// The animation and the stack for which a bill is estimated.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Workload {
    /// The number of frames.
    pub frames: u64,
    /// The time of the render function per frame, in milliseconds.
    pub ms: f64,
    /// The number of invocations of the render function at once, if given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub places: Option<u64>,
    /// The width of a frame in pixels.
    pub width: usize,
    /// The height of a frame in pixels.
    pub height: usize,
    /// The memory of the render function.
    pub memory_mb: f64,
    /// The memory of the assemble function.
    pub assemble_memory_mb: f64,
    /// The functions run on arm64, not on x86_64.
    pub arm64: bool,
    /// The time of the assemble function per frame, in milliseconds.
    pub assemble_ms: f64,
    /// The mean size of a frame's PNG.
    pub frame_kb: f64,
    /// The size of the GIF.
    pub gif_mb: f64,
    /// The files that are assembled.
    pub outputs: Vec<Container>,
    /// The number of the files that the scripts name, and of those that they refer to.
    pub files: u64,
    /// The size of all of these files.
    pub files_mb: f64,
    /// The minutes between two sweeps.
    pub sweep_minutes: f64,
    /// The stack has a customer-managed key.
    pub customer_managed_key: bool,
}

impl Workload {
    /// Makes a workload of frames of one size, each of which takes the render function `ms` milliseconds, on a stack
    /// with default settings. File sizes are estimated from the pixels.
    pub fn new(frames: u64, size: Screen, ms: f64) -> Self {
        let pixels = size.pixels() as f64;
        Self {
            frames,
            ms,
            places: None,
            width: size.width() as usize,
            height: size.height() as usize,
            memory_mb: PROCESSOR_MB,
            assemble_memory_mb: ASSEMBLE_MEMORY_MB,
            arm64: false,
            assemble_ms: pixels * ASSEMBLE_NS_A_PIXEL / 1e6,
            frame_kb: pixels * FRAME_BYTES_A_PIXEL / 1e3,
            gif_mb: frames as f64 * pixels * GIF_BYTES_A_PIXEL / 1e6,
            outputs: vec![Container::Gif],
            files: 0,
            files_mb: 0.0,
            sweep_minutes: SWEEP_MINUTES,
            customer_managed_key: false,
        }
    }

    /// Returns the time until all frames are drawn, in seconds.
    pub fn rendering_s(&self) -> f64 {
        let places = self.places.unwrap_or(PLACES).max(1);
        self.frames.div_ceil(places) as f64 * self.ms / 1e3
    }

    /// Returns the running time of the assemble function for an output, in seconds.
    pub fn assembling_s(&self) -> f64 {
        (self.frames as f64 * self.assemble_ms + ASSEMBLE_OVERHEAD_MS) / 1e3
    }

    /// Returns the size of an output in MB. What is lossless is at most as large as its frames as PNG.
    fn output_mb(&self, output: Container) -> f64 {
        let frames = self.frames as f64;
        match output {
            Container::Gif => self.gif_mb,
            Container::Apng | Container::Webp => frames * self.frame_kb / 1e3,
            Container::Y4m => frames * (self.width * self.height) as f64 * Y4M_BYTES_A_PIXEL / 1e6,
        }
    }

    /// Returns the size of all outputs in MB.
    fn outputs_mb(&self) -> f64 {
        self.outputs.iter().map(|&output| self.output_mb(output)).sum()
    }

    fn is_gif_alone(&self) -> bool {
        self.outputs == [Container::Gif]
    }
}

/// The lines under one heading.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Section {
    /// The heading of the section.
    pub title: &'static str,
    /// The items that are billed.
    pub lines: Vec<Line>,
    /// The sum in US dollars.
    pub usd: f64,
}

/// A billed quantity and its price.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Line {
    /// The item that is billed.
    pub item: &'static str,
    /// The amount of the item.
    pub amount: f64,
    /// The unit of the amount; empty for pieces.
    pub unit: &'static str,
    /// The price of the amount in US dollars.
    pub usd: f64,
}

impl Section {
    fn new(title: &'static str, lines: Vec<Line>) -> Self {
        let usd = lines.iter().map(|line| line.usd).sum();
        Self { title, lines, usd }
    }
}

/// Returns the time that an invocation waits for requests and pauses, in milliseconds, for an animation of `frames`
/// frames on `places` places, or on those of an account.
pub fn waiting_ms(frames: u64, places: Option<u64>) -> f64 {
    let is_at_once = places.unwrap_or(PLACES).saturating_mul(2) > frames;
    if is_at_once { WAITING_AT_ONCE_MS } else { WAITING_MS }
}

/// Returns the milliseconds that the render function takes per frame of an animation of `frames` frames on `places`
/// places, if drawing a frame takes `drawing_ms` on one processor and the function has `memory_mb`.
pub fn render_ms(frames: u64, places: Option<u64>, drawing_ms: f64, memory_mb: f64) -> f64 {
    drawing_ms * PROCESSOR_MB / memory_mb + waiting_ms(frames, places)
}

/// Estimates all sections: making the animation, keeping it, and the stack.
pub fn estimate(work: &Workload, prices: &Prices) -> Vec<Section> {
    vec![making(work, prices), keeping(work, prices), stack(work, prices)]
}

fn line(item: &'static str, amount: f64, unit: &'static str, price: f64) -> Line {
    Line { item, amount, unit, usd: amount * price }
}

fn gb_second(work: &Workload, prices: &Prices) -> f64 {
    if work.arm64 { prices.lambda.gb_second_arm64 } else { prices.lambda.gb_second_x86_64 }
}

/// Returns the GB-seconds of `ms` milliseconds. Lambda counts a GB as 1,024 MB.
fn gb_seconds(memory_mb: f64, ms: f64) -> f64 {
    memory_mb / 1024.0 * ms / 1000.0
}

fn making(work: &Workload, prices: &Prices) -> Section {
    let frames = work.frames as f64;
    let compute = gb_second(work, prices);
    let outputs = work.outputs.len() as f64;
    let parts = |&output: &Container| (work.output_mb(output) / UPLOAD_PART_MB).ceil() + 2.0;
    let uploads = work.outputs.iter().map(parts).sum::<f64>() + work.files as f64;
    // A process keeps the files for its next frames. The assembler reads each frame again for each further output.
    let processes = work.frames.min(work.places.unwrap_or(PLACES));
    let gets = frames * (GETS_A_FRAME + outputs - 1.0) + (processes * work.files) as f64;
    let invocations = frames + 1.0;
    let is_of_few = work.frames < FEW_FRAMES;
    let puts_and_lists = if is_of_few { PUTS_AND_LISTS_OF_FEW } else { PUTS_AND_LISTS_A_FRAME };
    Section::new(
        "Making it, once",
        vec![
            line("Lambda: invocations", invocations, "", prices.lambda.request),
            line("Lambda: rendering", frames * gb_seconds(work.memory_mb, work.ms), "GB-s", compute),
            line(
                "Lambda: assembling",
                gb_seconds(work.assemble_memory_mb, 1e3 * outputs * work.assembling_s()),
                "GB-s",
                compute,
            ),
            line("S3: puts and lists", frames * puts_and_lists + uploads, "", prices.s3.put_copy_post_list),
            line("S3: gets", gets, "", prices.s3.get_and_other),
            line("Logs", invocations * LOG_BYTES / 1e9, "GB", prices.cloudwatch.log_gb),
            line("Traces", invocations * TRACED, "", prices.xray_trace),
            line(
                if work.is_gif_alone() { "Downloading the GIF once" } else { "Downloading outputs once" },
                work.outputs_mb() / 1e3,
                "GB",
                prices.transfer_out_gb,
            ),
        ],
    )
}

fn keeping(work: &Workload, prices: &Prices) -> Section {
    let frames = work.frames as f64;
    let sweeps = MINUTES_A_MONTH / work.sweep_minutes;
    let pages = (frames / PAGE).ceil();
    // The listings of all scripts, of its scripts and of its frames; then its manifest and the head of each output.
    let (lists, gets) = (frames / PAGE + 2.0 * pages, 1.0 + work.outputs.len() as f64);
    let stored = if work.is_gif_alone() && work.files == 0 {
        "S3: frames and GIF"
    } else {
        "S3: frames, outputs, files"
    };
    Section::new(
        "Keeping it, each month",
        vec![
            line(
                stored,
                (frames * work.frame_kb / 1e3 + work.outputs_mb() + work.files_mb) / 1e3,
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
            places: None,
            width: 512,
            height: 512,
            memory_mb: 1024.0,
            assemble_memory_mb: 2048.0,
            arm64: false,
            assemble_ms: 10.0,
            frame_kb: 30.0,
            gif_mb: 16.0,
            outputs: vec![Container::Gif],
            files: 0,
            files_mb: 0.0,
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

    /// By hand: 16 MB in parts of 8 MB, begun and completed: 4 requests besides the frames'.
    #[test]
    fn requests_grow_with_frames() {
        let small = making(&work(100, 1.0), &prices());
        near(find(&small, "S3: puts and lists").amount, 100.0 * PUTS_AND_LISTS_A_FRAME + 4.0);
        near(find(&small, "S3: gets").amount, 100.0 * GETS_A_FRAME);
        let few = making(&work(49, 1.0), &prices());
        near(find(&few, "S3: puts and lists").amount, 49.0 * PUTS_AND_LISTS_OF_FEW + 4.0);
    }

    /// By hand: 2,880 sweeps per month. Each lists its 2 pages of scripts and 2 of frames, and its share of the
    /// listing of all scripts is 1.5 pages.
    #[test]
    fn a_kept_animation_is_visited_by_each_sweep() {
        let keeping = keeping(&work(1500, 1.0), &prices());
        near(find(&keeping, "S3: lists of the sweep").amount, 2880.0 * 5.5);
        near(find(&keeping, "S3: gets of the sweep").amount, 2880.0 * 2.0);
        near(find(&keeping, "S3: frames and GIF").amount, (1500.0 * 0.03 + 16.0) / 1000.0);
    }

    /// By hand: 100 frames of 30 kB are an APNG of 3 MB in one part. 4 files are put once, and read by 100 processes.
    #[test]
    fn files_and_further_outputs_are_counted() {
        let outputs = vec![Container::Gif, Container::Apng];
        let more = Workload { outputs, files: 4, files_mb: 50.0, ..work(100, 1.0) };
        let (once, months) = (making(&more, &prices()), keeping(&more, &prices()));
        near(find(&once, "S3: puts and lists").amount, 100.0 * PUTS_AND_LISTS_A_FRAME + 4.0 + 3.0 + 4.0);
        near(find(&once, "S3: gets").amount, 100.0 * (GETS_A_FRAME + 1.0) + 400.0);
        near(find(&once, "Lambda: assembling").amount, 2.0 * 2.0 * 2.0);
        near(find(&once, "Downloading outputs once").amount, 0.019);
        near(find(&months, "S3: frames, outputs, files").amount, 0.003 + 0.019 + 0.05);
        near(find(&months, "S3: gets of the sweep").amount, 2880.0 * 3.0);
        near(more.output_mb(Container::Y4m), 100.0 * 512.0 * 512.0 * 3.0 / 1e6);
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
        for (frames, places, expected) in [
            (1, None, 240.0),
            (10, Some(1), 210.0),
            (300, Some(4), 210.0),
            (300, Some(300), 240.0),
            (1_000_000, None, 210.0),
        ] {
            assert_eq!(waiting_ms(frames, places), expected, "{frames} {places:?}");
        }
        assert_eq!(render_ms(50, None, 10.0, 2.0 * PROCESSOR_MB), 245.0);
    }

    /// By hand: 100 frames on 8 places are 13 rounds of 2 s.
    #[test]
    fn the_time_of_all_frames_is_that_of_the_fullest_place() {
        assert_eq!(Workload { places: Some(8), ..work(100, 2_000.0) }.rendering_s(), 26.0);
        assert_eq!(work(1_000, 2_000.0).rendering_s(), 2.0);
    }

    #[test]
    fn the_prices_that_come_with_the_program_are_whole() {
        let prices = prices();
        assert_eq!(prices.region, "us-east-1");
        assert!(prices.sources.iter().all(|page| page.starts_with("https://aws.amazon.com/")));
    }
}
