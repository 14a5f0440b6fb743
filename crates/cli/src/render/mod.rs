//! `rayfold render`: scripts to an animation, to one image, or to many, on this machine.
//!
//! Everything is checked before the first frame is drawn, and nothing is written when a script has an error. Frames
//! are drawn ahead of the encoder within a bound ([`crate::ahead`]), so that memory does not grow with their number.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use anyhow::Context;
use clap::ValueEnum;
use image::DynamicImage;
use rayfold_files::{OutputFile, named_by_scripts, probe};
use rayfold_movie::{Container, Movie, Plays};
use rayfold_scene::{AnimationSettings, Camera, Limits, Samples, Screen};
use rayfold_tracer::{Precision, Progress as Work, RenderOptions};

use crate::ahead;
use crate::console::Console;
use crate::input::{Input, is_stdin, must_be_new, must_not_replace};
use crate::interrupt;
use crate::outcome::{Outcome, Usage};
use crate::plan::{Job, Plan, Wishes};
use crate::playback::Playback;
use crate::progress::Progress;
use crate::threads::Threads;
use crate::values;
use crate::wording::{Size, number};

pub(crate) mod fit;
pub(crate) mod movie;
pub(crate) mod passes;
pub(crate) mod target;
mod watch;

use movie::{MovieError, Push};
use passes::{PassArgs, Passes};
use target::{Format, Pattern, Place, Target};

/// Render scripts to an animation, to one image, or to many
///
/// A script draws a frame with each Trace. All scripts are checked first; if one has an error, all errors are shown
/// and nothing is written. Files appear whole or not at all.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  rayfold render scenes/hello -o hello.gif
      a folder, as an animation
  rayfold render a.txt b.txt -o ab.gif --fps 25
      scripts in the given order
  rayfold render scenes/hello -o hello.png --frame 7
      one frame
  rayfold render scenes/hello -o 'frames/%04d.png'
      each frame: frames/0001.png and on
  rayfold render scenes/hello -o 'frames/%04d.png' --pass depth,normal
      with frames/0001.depth.exr and frames/0001.normal.exr beside it
  rayfold render my-scene -o my.gif --watch
      again whenever a script is saved
  rayfold render scenes/hello -o - | ffplay -
      to another program; see docs/video.md
  generate | rayfold render - -o out.gif
      a script from another program")]
pub(crate) struct Args {
    /// A folder (its *.txt in natural order), script files (in the given order), or - for standard input
    #[arg(required = true)]
    input: Vec<PathBuf>,
    /// File to write: .gif, .apng, .webp or .y4m for an animation (- is .y4m to standard output); .png, .tif or .tiff for one
    /// frame, with %04d in the name for many, whose folder is made
    #[arg(long, short, value_name = "OUT")]
    output: PathBuf,
    /// Format of an animation, whatever the ending of OUT [default: by the ending; for -, y4m]
    #[arg(long, value_name = "FORMAT", value_parser = values::container())]
    format: Option<Container>,
    /// Leave a file that is there already, and fail
    #[arg(long, conflicts_with_all = ["watch", "skip_existing"])]
    no_clobber: bool,
    /// Frames a second, such as 25, 12.5 or 30000/1001 [default: what animation.json says, or 10]
    #[arg(long, value_name = "RATE", value_parser = values::rate, allow_negative_numbers = true)]
    fps: Option<f64>,
    #[command(flatten)]
    playback: Playback,
    /// Reduce the levels of colours until the .gif or .webp has at most this size, such as 8M or 500k. Frames are drawn once
    #[arg(long, value_name = "SIZE", value_parser = values::bytes, allow_negative_numbers = true)]
    max_size: Option<u64>,
    /// In a .gif, keep every frame of at most 256 colours exactly. Without this flag, a slow fade of a large image (more than 100,000
    /// pixels) may be off by up to 4 levels of 255, in a file several times smaller
    #[arg(long)]
    exact: bool,
    /// Colour behind the objects where a script says Background none, such as '#ffffff' [default: transparent; black in a .y4m]
    #[arg(long, value_name = "#RRGGBB", value_parser = values::color)]
    matte: Option<[u8; 3]>,
    #[command(flatten)]
    passes: PassArgs,
    /// Draw every frame in this size, such as 640x480, instead of that of its Screen
    #[arg(long, value_name = "WxH", value_parser = values::size, allow_negative_numbers = true)]
    size: Option<Screen>,
    /// Draw frame N, or frames A to B, counted from 1
    #[arg(long, value_name = "N|A..B", value_parser = parse_frames, allow_negative_numbers = true)]
    frame: Option<Frames>,
    /// Draw at most N rays a pixel, fewer where the error is below E levels [default: 1], instead of what Samples says
    #[arg(long, value_name = "N[,E]", value_parser = values::samples, allow_negative_numbers = true)]
    samples: Option<Samples>,
    /// Leave frames that are there already, whole and of the right size: goes on where Ctrl-C stopped. Files of scripts
    /// that have changed since are left, too
    #[arg(long, conflicts_with = "watch")]
    skip_existing: bool,
    /// Draw again whenever a script changes, until Ctrl-C
    #[arg(long)]
    watch: bool,
    /// The numbers to compute with; auto takes f32 where its errors cannot be seen
    #[arg(long, value_name = "WHICH", value_enum, default_value_t)]
    precision: Numbers,
    #[command(flatten)]
    threads: Threads,
    /// The largest image that a script may ask for, in pixels
    #[arg(long, value_name = "N", value_parser = values::count::<u64>, allow_negative_numbers = true, default_value_t = Limits::PIXELS)]
    max_pixels: u64,
}

/// The values of `--precision`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Numbers {
    #[default]
    Auto,
    F32,
    F64,
}

impl From<Numbers> for Precision {
    fn from(numbers: Numbers) -> Self {
        match numbers {
            Numbers::Auto => Self::Auto,
            Numbers::F32 => Self::F32,
            Numbers::F64 => Self::F64,
        }
    }
}

/// The first and the last frame, if given.
type Frames = (Option<u64>, Option<u64>);

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    let target = Target::parse(&args.output, args.format)?;
    check(args, &target)?;
    let passes = args.passes.passes(&target)?;
    args.threads.tell(console);
    args.threads.start()?;
    if args.watch {
        watch::draw_again(&args.input, console, || draw_all(args, &target, &passes, console))
    } else {
        draw_all(args, &target, &passes, console)?;
        Ok(Outcome::Done)
    }
}

/// Checks the rules that clap cannot check by itself.
fn check(args: &Args, target: &Target) -> Result<(), Usage> {
    let usage = |message: &str| Err(Usage(message.into()));
    match target {
        Target::Animation(Container::Gif | Container::Apng | Container::Webp, _) => {}
        Target::Animation(Container::Y4m, _) if args.playback.is_given() => {
            return usage(
                "--loop, --once and --final-delay are for .gif, .apng and .webp: a .y4m holds frames and their rate alone",
            );
        }
        Target::Animation(Container::Y4m, _) => {}
        Target::Image(..) | Target::Images(..) if args.fps.is_some() || args.playback.is_given() => {
            return usage(
                "--fps, --loop, --once and --final-delay are for animations: expected an output that ends in .gif, .apng or .webp",
            );
        }
        Target::Image(..) | Target::Images(..) => {}
    }
    if args.exact && !matches!(target, Target::Animation(Container::Gif, _)) {
        return usage("--exact is for .gif: every other output keeps all colours of a frame");
    }
    check_max_size(args.max_size, target)?;
    if args.skip_existing && !matches!(target, Target::Images(..)) {
        return usage("--skip-existing is for a file a frame: expected a pattern such as frames/%04d.png");
    }
    if args.watch {
        if args.input.iter().any(|input| is_stdin(input)) {
            return usage("--watch looks at files: standard input (-) does not change");
        }
        if matches!(target, Target::Animation(_, Place::StandardOutput)) {
            return usage("--watch writes the same file again: expected one instead of standard output (-)");
        }
    }
    match args.size {
        Some(size) if size.pixels() > args.max_pixels => Err(Usage(format!(
            "--size asks for {} pixels, more than the limit of {} (--max-pixels)",
            size.pixels(),
            args.max_pixels
        ))),
        _ => Ok(()),
    }
}

/// # Errors
/// Fails if a size is given for an output that has only one quality.
pub(crate) fn check_max_size(max_size: Option<u64>, target: &Target) -> Result<(), Usage> {
    match target {
        _ if max_size.is_none() => Ok(()),
        Target::Animation(Container::Gif | Container::Webp, _) => Ok(()),
        _ => Err(Usage("--max-size is for .gif and .webp: other outputs keep all that is in a frame".into())),
    }
}

fn draw_all(args: &Args, target: &Target, passes: &Passes, console: &Console) -> anyhow::Result<()> {
    let wishes = Wishes {
        size: args.size,
        samples: args.samples,
        frames: args.frame.unwrap_or_default(),
        precision: args.precision.into(),
        matte: match target {
            // It has no alpha.
            Target::Animation(Container::Y4m, _) => Some(args.matte.unwrap_or_default()),
            _ => args.matte,
        },
        has_passes: !passes.is_empty(),
    };
    let files = files(target, passes);
    if args.no_clobber {
        files.iter().try_for_each(|path| must_be_new(path))?;
    }
    files.iter().try_for_each(|path| probe(path))?;
    let patterns = patterns(target, passes);
    // If all frames are there already, nothing is written.
    if !args.skip_existing {
        patterns.iter().try_for_each(|pattern| pattern.probe(wishes.frames.0.unwrap_or(1)))?;
    }
    let limits = Limits { max_pixels: args.max_pixels, ..Limits::default() };
    let input = Input::animation(&args.input, &limits)?;
    files.iter().try_for_each(|path| must_not_replace(path, input.files()))?;
    if let Some(taken) = input.files().find(|file| patterns.iter().any(|pattern| pattern.names(file))) {
        must_not_replace(taken, std::iter::once(taken))?;
    }
    let plan = match Plan::new(&input, &limits, &wishes, console)? {
        Ok(plan) => plan,
        Err(faults) => anyhow::bail!("nothing was written: {}", faults.count()),
    };
    // Pictures and models are known once the scripts are read.
    let named = named_by_scripts();
    let named = || named.iter().map(PathBuf::as_path);
    files.iter().try_for_each(|path| must_not_replace(path, named()))?;
    if let Some(taken) = named().find(|file| patterns.iter().any(|pattern| pattern.names(file))) {
        must_not_replace(taken, std::iter::once(taken))?;
    }
    if let Some(size) = args.size {
        warn_if_squashed(&plan, size, console)?;
    }
    if args.matte.is_some() && !plan.has_clear_frames() {
        console.warn("--matte has no effect: no frame has `Background none`");
    }
    if !console.quiet
        && let Some(warning) = plan.light_cut_off()?
    {
        console.warn(warning);
    }
    match target {
        Target::Animation(container, place) => animation(args, *container, place, &plan, console),
        Target::Image(path, format) => image(path, *format, passes, &plan, console),
        Target::Images(pattern, format) => {
            if args.no_clobber {
                let mut paths =
                    plan.jobs().flat_map(|job| patterns.iter().map(move |of| of.path(job.number)));
                paths.try_for_each(|path| must_be_new(&path))?;
            }
            images((pattern, *format), passes, args.skip_existing, &plan, console)
        }
    }
}

/// Returns the files that are written, unless there are some for each frame.
fn files(target: &Target, passes: &Passes) -> Vec<PathBuf> {
    match target {
        Target::Animation(_, Place::File(path)) => vec![path.clone()],
        Target::Animation(_, Place::StandardOutput) | Target::Images(..) => Vec::new(),
        Target::Image(path, _) => {
            let beside = passes.beside(path).into_iter().map(|(_, path)| path);
            std::iter::once(path.clone()).chain(beside).collect()
        }
    }
}

/// Returns the patterns of the files that are written for each frame.
fn patterns(target: &Target, passes: &Passes) -> Vec<Pattern> {
    match target {
        Target::Animation(..) | Target::Image(..) => Vec::new(),
        Target::Images(pattern, _) => {
            std::iter::once(pattern.clone()).chain(passes.patterns(pattern)).collect()
        }
    }
}

/// A script's window has the aspect ratio of its `Screen`; another size may have another.
fn warn_if_squashed(plan: &Plan, size: Screen, console: &Console) -> anyhow::Result<()> {
    let Some(first) = plan.jobs().next() else { return Ok(()) };
    if let Camera::Pinhole(camera) = plan.scene(&first)?.camera
        && let Some([au, av, bu, bv]) = camera.unsquashed(size)
    {
        let (name, width, height) = (plan.name(&first), size.width(), size.height());
        console.warn(format_args!(
            "{name}: at {width} x {height} the picture is squashed: a ball is no circle in it; the window that would not: \
             {au:.4} {av:.4} {bu:.4} {bv:.4}"
        ));
    }
    Ok(())
}

fn animation(
    args: &Args,
    container: Container,
    place: &Place,
    plan: &Plan,
    console: &Console,
) -> anyhow::Result<()> {
    let size = match (plan.one_size(), args.size) {
        (Err(error), None) => anyhow::bail!("{error}: give them one with --size"),
        (size, _) => size?,
    };
    let fps = args.fps.unwrap_or(plan.settings.fps());
    // The bounds are the language's.
    AnimationSettings::new(None, fps, 0).map_err(|error| Usage(format!("--fps {fps}: {error}")))?;
    let movie = Movie {
        size: (size.width(), size.height()),
        frames: Some(plan.shown_count()),
        fps,
        plays: args.playback.plays(Plays::repeated(plan.settings.loops())),
        last_delay_cs: args.playback.last_delay_cs(),
        exact: args.exact,
        alpha: plan.has_clear_frames() && plan.matte.is_none(),
    };
    let durations = plan.durations()?;
    if container == Container::Y4m && !durations.is_empty() {
        console.warn("durations are left out: a .y4m holds frames and their rate alone");
    }
    let progress = Progress::of_frames(console, plan.shown_count());
    let mut done = 0;
    let fill = |push: Push<'_>| {
        ahead::in_order(
            plan.shown(),
            plan.window(),
            |job| draw(plan, &job, progress.drawn()),
            |frame| {
                anyhow::ensure!(!interrupt::stopping(), "interrupted");
                push(frame, durations.get(&done).copied())?;
                done += 1;
                progress.set(console, done);
                Ok(())
            },
        )
    };
    let written = progress.watch(console, || match args.max_size {
        None => movie::write(place, container, movie, fill),
        Some(limit) => fit::write(place, container, movie, limit, console, fill),
    });
    let took = progress.finish();
    match written {
        Ok(written) => movie::tell(place, &written, fps, took, console),
        Err(error) if matches!(error.downcast_ref(), Some(MovieError::Closed)) => {
            console.note(format_args!("{error} after {}", number(done, "frame")));
        }
        Err(error) => return Err(error),
    }
    Ok(())
}

fn image(path: &Path, format: Format, passes: &Passes, plan: &Plan, console: &Console) -> anyhow::Result<()> {
    let mut jobs = plan.jobs();
    let (Some(job), None) = (jobs.next(), jobs.next()) else {
        anyhow::bail!(
            "{} frames do not fit into {}: expected --frame N, a pattern such as frames/%04d.png, or .gif",
            plan.len(),
            path.display()
        );
    };
    let progress = Progress::of_frames(console, 1);
    let draw_image = || -> anyhow::Result<_> {
        let file = format.encode(&draw(plan, &job, progress.drawn())?)?;
        Ok((file, passes.encode(plan, &job, passes.beside(path))?))
    };
    // On a thread of the pool, so that it is not idle while the image is drawn.
    let drawing = || rayon::scope(|_| draw_image());
    let (file, beside) = progress.watch(console, drawing)?;
    let sizes: Vec<_> = beside.iter().map(|(path, file)| (path.clone(), file.len() as u64)).collect();
    passes::write(beside, true)?;
    OutputFile::write(path, &file, true)?;
    let took = progress.finish().as_secs_f64();
    console.note(format_args!("{}: {}, in {took:.2} s", path.display(), Size(file.len() as u64)));
    for (path, size) in sizes {
        console.note(format_args!("{}: {}", path.display(), Size(size)));
    }
    Ok(())
}

/// The result of a frame that is to be a file.
enum Drawn {
    /// The numbers of bytes of the image and of its passes.
    Written(u64, u64),
    /// The image existed already.
    Skipped,
}

fn images(
    (pattern, format): (&Pattern, Format),
    passes: &Passes,
    skip_existing: bool,
    plan: &Plan,
    console: &Console,
) -> anyhow::Result<()> {
    pattern.make_folder()?;
    let progress = Progress::of_frames(console, plan.len());
    let (mut done, mut bytes, mut of_passes, mut skipped) = (0, 0, 0, 0);
    let files = AtomicU64::new(0);
    let draw_frame = |job: Job| {
        let path = pattern.path(job.number);
        let mut beside = passes.beside(&path);
        let mut is_there = false;
        if skip_existing {
            let screen = plan.scene(&job)?.screen;
            is_there = is_drawn(&path, format, screen);
            beside.retain(|(of, path)| !passes.is_whole(*of, path, screen));
            if is_there && beside.is_empty() {
                return Ok(Drawn::Skipped);
            }
            let missing = beside.iter().map(|(_, path)| path);
            missing.chain((!is_there).then_some(&path)).try_for_each(|path| probe(path))?;
        }
        let image = match is_there {
            true => None,
            false => Some(format.encode(&draw(plan, &job, progress.drawn())?)?),
        };
        // An image is written after its passes: where it is, they are.
        let of_passes = passes::write(passes.encode(plan, &job, beside)?, false)?;
        let size = image.as_ref().map_or(0, Vec::len) as u64;
        if let Some(image) = image {
            OutputFile::write(path, &image, false)?;
        }
        files.fetch_add(1, Ordering::Relaxed);
        Ok(Drawn::Written(size, of_passes))
    };
    let drawing = || {
        ahead::in_order(plan.jobs(), plan.window(), draw_frame, |drawn| {
            match drawn {
                Drawn::Written(image, beside) => (bytes, of_passes) = (bytes + image, of_passes + beside),
                Drawn::Skipped => skipped += 1,
            }
            done += 1;
            progress.set(console, done);
            Ok(())
        })
    };
    let written = progress.watch(console, drawing);
    let took = progress.finish().as_secs_f64();
    written.with_context(|| format!("{} of {} written", files.into_inner(), number(plan.len(), "frame")))?;
    let number_of = |job: Option<Job>| job.map_or(1, |job| job.number);
    let (first, last) = (number_of(plan.jobs().next()), number_of(plan.jobs().last()));
    let there = if skipped > 0 { format!(" ({skipped} were there)") } else { String::new() };
    console.note(format_args!(
        "{}: {}{there}, {}, in {took:.2} s",
        pattern.range(first, last),
        number(plan.len(), "frame"),
        Size(bytes)
    ));
    if !passes.is_empty() {
        let patterns = passes.patterns(pattern).map(|pattern| pattern.range(first, last));
        console.note(format_args!("{}: {}", patterns.collect::<Vec<_>>().join(", "), Size(of_passes)));
    }
    pattern.warn_of_older(plan.total(), console);
    passes.patterns(pattern).for_each(|pattern| pattern.warn_of_older(plan.total(), console));
    Ok(())
}

/// Returns whether there is a complete image of this size.
fn is_drawn(path: &Path, format: Format, screen: Screen) -> bool {
    let mut file = Vec::new();
    let read = rayfold_files::open(path).and_then(|mut from| from.read_to_end(&mut file));
    let image = read.ok().and_then(|_| format.decode(&file));
    image.is_some_and(|image| (image.width(), image.height()) == (screen.width(), screen.height()))
}

/// Draws a frame, unless the run is stopping. `progress` counts its work.
///
/// # Errors
/// Fails if the run is stopping, or with the errors of the renderer.
pub(crate) fn draw(plan: &Plan, job: &Job, progress: Option<&Work>) -> anyhow::Result<DynamicImage> {
    anyhow::ensure!(!interrupt::stopping(), "interrupted");
    let options = RenderOptions {
        cancel: Some(interrupt::flag()),
        progress,
        precision: plan.precision,
        matte: plan.matte,
        ..Default::default()
    };
    plan.expose(job, |exposure| rayfold_tracer::render_picture(exposure, &options))?
        .with_context(|| format!("cannot render frame {} ({})", job.number, plan.name(job)))
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
}
