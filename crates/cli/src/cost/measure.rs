//! Estimates the time that the render function would take for the frames of a folder, by drawing some of them.

use std::fs;
use std::path::PathBuf;
use std::time::Instant;

use anyhow::Context;
use rayfold_client::cost::{render_ms, waiting_ms};
use rayfold_files::named_by_scripts;
use rayfold_scene::{Container, Limits, Screen};

use crate::console::Console;
use crate::input::Input;
use crate::plan::{Plan, Wishes};
use crate::render::draw;
use crate::render::target::Format;
use crate::wording::{Size, number};

/// The number of frames that are drawn, spread evenly over the animation.
const SAMPLES: u64 = 8;

/// The number of times that each of them is drawn.
const TRIES: usize = 2;

/// The measurements of an animation after some of its frames have been drawn.
#[derive(Debug)]
pub(super) struct Measured {
    pub(super) frames: u64,
    pub(super) size: Screen,
    /// The time of the render function, per frame.
    pub(super) ms: f64,
    /// The mean size of a frame's PNG.
    pub(super) frame_kb: f64,
    /// The outputs that the settings ask for.
    pub(super) outputs: Vec<Container>,
    /// The number of the files that the scripts name, and of those that they refer to.
    pub(super) files: u64,
    pub(super) files_mb: f64,
}

/// Draws some frames of `input`, for functions with `memory_mb` and this number of places.
///
/// # Errors
/// Fails if a script has an error, or the scripts are no animation.
pub(super) fn measure(
    input: &[PathBuf],
    memory_mb: f64,
    places: Option<u64>,
    console: &Console,
) -> anyhow::Result<Measured> {
    let limits = Limits::default();
    let input = Input::animation(input, &limits)?;
    let plan = match Plan::new(&input, &limits, &Wishes::default(), console)? {
        Ok(plan) => plan,
        Err(faults) => anyhow::bail!("nothing was measured: {}", faults.count()),
    };
    let (frames, size) = (plan.len(), plan.one_size()?);
    let step = frames.div_ceil(SAMPLES).max(1);
    let jobs: Vec<_> = plan.jobs().step_by(usize::try_from(step)?).collect();
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let one_thread = one_thread.context("cannot start a thread")?;
    let (seconds, bytes) = one_thread.install(|| {
        let (mut seconds, mut bytes) = (0.0, 0);
        for job in &jobs {
            // The shorter of two tries: whatever else the machine does makes it longer, never shorter.
            let mut shortest = f64::INFINITY;
            for _ in 0..TRIES {
                let start = Instant::now();
                let file = Format::Png.encode(&draw(&plan, job, None)?)?;
                shortest = shortest.min(start.elapsed().as_secs_f64());
                bytes += file.len();
            }
            seconds += shortest;
        }
        anyhow::Ok((seconds, bytes / TRIES))
    })?;
    let drawing_ms = 1e3 * seconds / jobs.len() as f64;
    let bytes = bytes as f64 / jobs.len() as f64;
    let waiting_ms = waiting_ms(frames, places);
    console.note(format_args!(
        "drawn here on one thread: {} of {frames}, {drawing_ms:.1} ms each, a PNG of {} each; requests and pauses add \
         {waiting_ms:.0} ms",
        number(jobs.len() as u64, "frame"),
        Size(bytes as u64)
    ));
    let ms = render_ms(frames, places, drawing_ms, memory_mb);
    // What a model refers to may be absent.
    let sizes =
        named_by_scripts().into_iter().filter_map(|path| fs::metadata(path).ok()).map(|file| file.len());
    let (files, files_bytes) = sizes.fold((0, 0), |(count, bytes), size| (count + 1, bytes + size));
    let outputs = plan.settings.outputs().to_vec();
    Ok(Measured {
        frames,
        size,
        ms,
        frame_kb: bytes / 1e3,
        outputs,
        files,
        files_mb: files_bytes as f64 / 1e6,
    })
}
