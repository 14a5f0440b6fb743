//! `rayfold render`: scripts to an animation, to one image, or to many, on this machine.
//!
//! Everything is checked before the first frame is drawn, and nothing is written when a script has an error. Frames
//! are drawn ahead of the encoder within a bound ([`crate::ahead`]), so that memory does not grow with their number.

use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use anyhow::Context;
use image::RgbImage;
use rayfold_gif::{Encoder, Settings, Summary};
use rayfold_scene::{AnimationSettings, Limits, Screen};
use rayfold_tracer::{Precision, RenderOptions};

use crate::ahead;
use crate::console::Console;
use crate::input::Input;
use crate::interrupt;
use crate::outcome::{Outcome, Usage};
use crate::output::{OutputError, OutputFile, probe};
use crate::plan::{Job, Plan, Wishes};
use crate::progress::Progress;
use crate::threads::Threads;
use crate::wording::{Size, number};

pub(crate) mod target;

use target::{Format, Pattern, Target};

/// Render scripts to an animation, to one image, or to many
///
/// A script draws a frame with each Trace. All scripts are checked first; if one has an error, all errors are shown
/// and nothing is written. Files appear whole or not at all.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  rayfold render scenes/hello -o hello.gif             a folder, as an animation
  rayfold render a.txt b.txt -o ab.gif --fps 25        scripts in the given order
  rayfold render scenes/hello -o hello.png --frame 7   one frame
  rayfold render scenes/hello -o 'frames/%04d.png'     each frame: frames/0001.png and on
  generate | rayfold render - -o out.gif               a script from another program")]
pub(crate) struct Args {
    /// A folder (its *.txt in natural order), script files (in the given order), or - for standard input
    #[arg(required = true)]
    input: Vec<PathBuf>,
    /// What to write: .gif for an animation; .png, .tif or .tiff for one frame, with %04d in the name for many
    #[arg(long, short, value_name = "OUT")]
    output: PathBuf,
    /// Frames a second [default: what animation.json says, or 10]
    #[arg(long, value_name = "RATE")]
    fps: Option<f64>,
    /// How often to repeat the animation, 0 for ever [default: what animation.json says, or 0]
    #[arg(long = "loop", value_name = "TIMES")]
    loops: Option<u16>,
    /// Draw every frame in this size, such as 640x480, instead of that of its Screen
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<Screen>,
    /// Draw frame N, or frames A to B, counted from 1
    #[arg(long, value_name = "N|A..B", value_parser = parse_frames)]
    frame: Option<Frames>,
    /// The numbers to compute with; auto takes f32 where its errors cannot be seen
    #[arg(long, value_name = "WHICH", value_parser = parse_precision, default_value = "auto")]
    precision: Precision,
    #[command(flatten)]
    threads: Threads,
    /// The largest image that a script may ask for, in pixels
    #[arg(long, value_name = "N", default_value_t = Limits::PIXELS)]
    max_pixels: u64,
}

/// First and last frame, where they are given.
type Frames = (Option<u64>, Option<u64>);

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    let target = Target::parse(&args.output)?;
    if !matches!(target, Target::Gif(_)) && (args.fps.is_some() || args.loops.is_some()) {
        return Err(Usage(
            "--fps and --loop are for animations: expected an output that ends in .gif".into(),
        )
        .into());
    }
    if let Some(size) = args.size
        && size.pixels() > args.max_pixels
    {
        return Err(Usage(format!(
            "--size asks for {} pixels, more than the limit of {} (--max-pixels)",
            size.pixels(),
            args.max_pixels
        ))
        .into());
    }
    args.threads.start()?;
    let wishes =
        Wishes { size: args.size, frames: args.frame.unwrap_or_default(), precision: args.precision };
    match &target {
        Target::Gif(path) | Target::Image(path, _) => probe(path)?,
        Target::Images(pattern, _) => probe(&pattern.path(wishes.frames.0.unwrap_or(1)))?,
    }
    let limits = Limits { max_pixels: args.max_pixels, ..Limits::default() };
    let input = Input::animation(&args.input, &limits)?;
    let plan = match Plan::new(&input, &limits, &wishes, console)? {
        Ok(plan) => plan,
        Err(faults) => anyhow::bail!("nothing was written: {}", faults.count()),
    };
    match &target {
        Target::Gif(path) => animation(path, &plan, &settings(args, &plan)?, console)?,
        Target::Image(path, format) => image(path, *format, &plan, console)?,
        Target::Images(pattern, format) => images(pattern, *format, &plan, console)?,
    }
    Ok(Outcome::Done)
}

fn settings(args: &Args, plan: &Plan) -> anyhow::Result<AnimationSettings> {
    let of_folder = plan.settings;
    let fps = args.fps.unwrap_or(of_folder.fps());
    AnimationSettings::new(of_folder.frames(), fps, args.loops.unwrap_or(of_folder.loops()))
        .map_err(|e| Usage(format!("--fps {fps}: {e}")).into())
}

fn animation(
    path: &Path,
    plan: &Plan,
    settings: &AnimationSettings,
    console: &Console,
) -> anyhow::Result<()> {
    plan.one_size()?;
    let mut out = BufWriter::with_capacity(1 << 20, OutputFile::create(path)?);
    let failed = |error| match error {
        rayfold_gif::Error::Write { source, .. } => {
            OutputError::Io { path: path.to_path_buf(), source }.into()
        }
        other => anyhow::Error::new(other),
    };
    let gif_settings = Settings { fps: settings.fps(), loops: settings.loops() };
    let mut encoder = Encoder::new(&mut out, gif_settings).map_err(failed)?;
    let mut progress = Progress::start(console, "frames", plan.len());
    let mut done = 0;
    ahead::in_order(
        plan.jobs(),
        plan.window(),
        |job| draw(plan, &job),
        |frame| {
            anyhow::ensure!(!interrupt::stopping(), "interrupted");
            encoder.push(frame).map_err(failed)?;
            done += 1;
            progress.set(console, done);
            Ok(())
        },
    )?;
    let summary = encoder.finish().map_err(failed)?;
    let took = progress.finish();
    let out =
        out.into_inner().map_err(|e| OutputError::Io { path: path.to_path_buf(), source: e.into_error() })?;
    out.finish(true)?;
    tell(path, &summary, settings.fps(), took, console);
    Ok(())
}

/// Says what was written.
pub(crate) fn tell(path: &Path, summary: &Summary, fps: f64, took: Duration, console: &Console) {
    console.note(format_args!(
        "{}: {} of {} x {}, {}, in {:.2} s",
        path.display(),
        number(summary.frames, "frame"),
        summary.size.0,
        summary.size.1,
        Size(summary.bytes),
        took.as_secs_f64()
    ));
    if summary.dropped > 0 {
        console.note(format_args!(
            "{} left out: a GIF shows at most 50 frames a second, not {}",
            number(summary.dropped, "frame"),
            fps
        ));
    }
}

fn image(path: &Path, format: Format, plan: &Plan, console: &Console) -> anyhow::Result<()> {
    let mut jobs = plan.jobs();
    let (Some(job), None) = (jobs.next(), jobs.next()) else {
        anyhow::bail!(
            "{} frames do not fit into {}: expected --frame N, a pattern such as %04d.png, or .gif",
            plan.len(),
            path.display()
        );
    };
    let progress = Progress::start(console, "frames", 1);
    // On a thread of the pool, so that it is not idle while the image is drawn.
    let file = rayon::scope(|_| format.encode(&draw(plan, &job)?))?;
    OutputFile::write(path, &file, true)?;
    let took = progress.finish().as_secs_f64();
    console.note(format_args!("{}: {}, in {took:.2} s", path.display(), Size(file.len() as u64)));
    Ok(())
}

fn images(pattern: &Pattern, format: Format, plan: &Plan, console: &Console) -> anyhow::Result<()> {
    let mut progress = Progress::start(console, "frames", plan.len());
    let (mut done, mut bytes) = (0, 0);
    let files = AtomicU64::new(0);
    let written = ahead::in_order(
        plan.jobs(),
        plan.window(),
        |job| {
            let file = format.encode(&draw(plan, &job)?)?;
            OutputFile::write(pattern.path(job.number), &file, false)?;
            files.fetch_add(1, Ordering::Relaxed);
            Ok(file.len() as u64)
        },
        |size| {
            done += 1;
            bytes += size;
            progress.set(console, done);
            Ok(())
        },
    );
    let took = progress.finish().as_secs_f64();
    written.with_context(|| format!("{} of {} written", files.into_inner(), number(plan.len(), "frame")))?;
    let path = |job: Option<Job>| pattern.path(job.map_or(1, |job| job.number));
    console.note(format_args!(
        "{} to {}: {}, {}, in {took:.2} s",
        path(plan.jobs().next()).display(),
        path(plan.jobs().last()).display(),
        number(plan.len(), "frame"),
        Size(bytes)
    ));
    Ok(())
}

fn parse_precision(text: &str) -> Result<Precision, String> {
    match text {
        "auto" => Ok(Precision::Auto),
        "f32" => Ok(Precision::F32),
        "f64" => Ok(Precision::F64),
        _ => Err("expected auto, f32 or f64".into()),
    }
}

fn draw(plan: &Plan, job: &Job) -> anyhow::Result<RgbImage> {
    anyhow::ensure!(!interrupt::stopping(), "interrupted");
    let scene = plan.scene(job)?;
    let options =
        RenderOptions { cancel: Some(interrupt::flag()), precision: plan.precision, ..Default::default() };
    rayfold_tracer::render(&scene, &options)
        .with_context(|| format!("cannot render frame {} ({})", job.number, plan.name(job)))
}

/// Width and height, as `640x480`.
pub(crate) fn parse_size(text: &str) -> Result<Screen, String> {
    let sides = text.split_once(['x', 'X']).and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    let (width, height) = sides.ok_or("expected width and height in pixels, such as 640x480")?;
    Screen::new(width, height).map_err(|e| e.to_string())
}

fn parse_frames(text: &str) -> Result<Frames, String> {
    let expected = "expected a frame such as 7, or a range such as 3..9, counted from 1";
    let number = |text: &str| text.parse().ok().filter(|n| *n >= 1).ok_or(expected);
    let end = |text: &str| if text.is_empty() { Ok(None) } else { number(text).map(Some) };
    let Some((first, last)) = text.split_once("..") else {
        let only = number(text)?;
        return Ok((Some(only), Some(only)));
    };
    let (first, last) = (end(first)?, end(last)?);
    match (first, last) {
        (Some(first), Some(last)) if first > last => {
            Err(format!("the range is empty; did you mean {last}..{first}?"))
        }
        _ => Ok((first, last)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_one_or_a_range() {
        assert_eq!(parse_frames("7"), Ok((Some(7), Some(7))));
        assert_eq!(parse_frames("3..9"), Ok((Some(3), Some(9))));
        assert_eq!(parse_frames("3.."), Ok((Some(3), None)));
        for wrong in ["", "0", "-1", "1.5", "9..3", "0..3", "a..b", "1...3", "1..=3"] {
            assert!(parse_frames(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn sizes_are_two_whole_numbers() {
        assert_eq!(parse_size("640x480"), Ok(Screen::new(640, 480).unwrap()));
        for wrong in ["", "640", "640x", "0x480", "640x480x3", "-1x2", "6.4x3"] {
            assert!(parse_size(wrong).is_err(), "{wrong}");
        }
    }
}
