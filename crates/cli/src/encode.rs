//! `rayfold encode`: turns existing images into an animation.

use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};

use anyhow::Context;
use image::DynamicImage;
use rayfold_files::probe;
use rayfold_gif::{Encoder, Settings};
use rayfold_movie::{Container, Movie, Plays};
use rayfold_scene::{SETTINGS_FILE, natural_cmp};

use crate::ahead;
use crate::console::Console;
use crate::input::{is_stdin, must_be_new, must_not_replace, stdin_once};
use crate::interrupt;
use crate::outcome::{Outcome, Usage};
use crate::playback::Playback;
use crate::progress::Progress;
use crate::render::movie::{self, MovieError, Push};
use crate::render::target::{Place, Target};
use crate::render::{check_max_size, fit};
use crate::threads::Threads;
use crate::values;
use crate::wording::number;

mod durations;
mod picture;
mod source;
mod tiff;
mod video;
mod webp;

use picture::Picture;

/// The largest number of faulty files that are named.
const MAX_LISTED: usize = 20;

/// The largest memory for images that wait for the encoder, in bytes: two of 1920 x 1080.
const AHEAD: u64 = 14 << 20;

/// Turn images into an animation
///
/// Every image is a frame, and all are of one size; of an animated GIF, PNG or WebP and of a .y4m each frame is one, of
/// a TIFF each page. What is transparent stays so; a .gif shows a pixel or does not, and a .y4m shows black there.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  rayfold encode frames/*.png -o hello.gif
  rayfold encode a.png b.png a.png --no-sort -o blink.gif --fps 2 --loop 3
  rayfold encode old.gif -o new.apng
      every frame keeps its time
  ffmpeg -i film.mp4 -pix_fmt yuv444p -f yuv4mpegpipe - | rayfold encode - -o film.gif
      from another program; see docs/video.md")]
pub(crate) struct Args {
    /// PNG, JPEG, GIF, WebP, TIFF or .y4m files, or - for standard input; they are shown in natural order of their
    /// names: f2.png before f10.png
    #[arg(required = true, value_name = "FRAME")]
    frames: Vec<PathBuf>,
    /// File to write: .gif, .apng, .webp or .y4m; - is standard output
    #[arg(long, short, value_name = "OUT")]
    output: PathBuf,
    /// Format of the file, whatever the ending of OUT [default: by the ending; for -, gif]
    #[arg(long, value_name = "FORMAT", value_parser = values::container())]
    format: Option<Container>,
    /// Leave a file that is there already, and fail
    #[arg(long)]
    no_clobber: bool,
    /// Show the files in the order in which they are given
    #[arg(long)]
    no_sort: bool,
    /// Frames a second, such as 25, 12.5 or 30000/1001; above 50 some are left out, because a GIF cannot show them, but
    /// never the last [default: the times of an animated file, the rate of a .y4m, or 10]
    #[arg(long, value_name = "RATE", value_parser = values::rate, allow_negative_numbers = true)]
    fps: Option<f64>,
    /// Durations of frames, as JSON: {"5": 0.5} shows the fifth for half a second. Of an animation.json, its
    /// "durations" are read
    #[arg(long, value_name = "FILE")]
    durations: Option<PathBuf>,
    /// Colour behind what is transparent, such as '#ffffff'
    #[arg(long, value_name = "#RRGGBB", value_parser = values::color)]
    matte: Option<[u8; 3]>,
    #[command(flatten)]
    playback: Playback,
    /// Reduce the levels of colours until the .gif or .webp has at most this size, such as 8M or 500k
    #[arg(long, value_name = "SIZE", value_parser = values::bytes, allow_negative_numbers = true)]
    max_size: Option<u64>,
    /// In a .gif, keep every frame of at most 256 colours exactly. Without this flag, a slow fade of a large image (more than 100,000
    /// pixels) may be off by up to 4 levels of 255, in a file several times smaller
    #[arg(long)]
    exact: bool,
    #[command(flatten)]
    threads: Threads,
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    let (container, place) = target(args)?;
    stdin_once(&args.frames)?;
    if let Place::File(path) = &place {
        if args.no_clobber {
            must_be_new(path)?;
        }
        must_not_replace(path, args.frames.iter().map(PathBuf::as_path))?;
        probe(path)?;
    }
    if let Some(fps) = args.fps {
        Encoder::new(std::io::sink(), Settings { fps, ..Settings::default() })
            .map_err(|error| Usage(format!("--fps {fps}: {error}")))?;
    }
    let durations =
        args.durations.as_deref().map(|path| durations::read(path, console)).transpose()?.unwrap_or_default();
    tell_of_settings(args, console);
    let of_file = pictures(&args.frames, console)?;
    let pictures: Vec<&Picture> = in_order(args, console).iter().flat_map(|file| &of_file[file]).collect();
    args.threads.tell(console);
    args.threads.start()?;
    let frames = pictures.iter().map(|picture| picture.frames).sum::<Option<u64>>();
    if let (Some(frames), Some((&frame, _))) = (frames, durations.last_key_value())
        && frame > frames
    {
        anyhow::bail!("--durations gives frame {frame} a time, but there are {}", number(frames, "frame"));
    }
    let fps = args.fps.or_else(|| pictures.iter().find_map(|picture| picture.fps()));
    let fps = fps.unwrap_or(Settings::default().fps);
    let movie = Movie {
        size: pictures.first().context("at least one frame")?.size()?,
        frames,
        fps,
        plays: args.playback.plays(plays_of(&pictures)),
        last_delay_cs: args.playback.last_delay_cs(),
        exact: args.exact,
        alpha: args.matte.is_none() && pictures.iter().any(|picture| picture.has_alpha),
    };
    let progress = Progress::start(console, "frames", frames.unwrap_or_default());
    let fill = |push: Push<'_>| {
        let (mut of_images, mut done) = (pictures.iter(), 0);
        let take = |image: Option<DynamicImage>| {
            let picture = of_images.next().context("a picture for each image")?;
            let mut take_one = |image: DynamicImage, own: Option<f64>| {
                anyhow::ensure!(!interrupt::stopping(), "interrupted");
                done += 1;
                let image = match args.matte {
                    Some(matte) => rayfold_movie::over(image, matte).into(),
                    None => image,
                };
                let seconds = durations.get(&done).copied().or(own.filter(|_| args.fps.is_none()));
                push(image, seconds).map_err(|error| explain(error, &picture.name()))?;
                progress.set(console, done);
                Ok(())
            };
            match image {
                Some(image) => take_one(image, None),
                // Each frame needs the one before it.
                None => picture.decode_each(&mut take_one),
            }
        };
        // On a thread of the pool, so that it need not wait for another thread to encode.
        rayon::scope(|_| {
            ahead::in_order(pictures.iter(), window(movie.size), |picture| picture.decode(), take)
        })
    };
    let written = match args.max_size {
        None => movie::write(&place, container, movie, fill),
        Some(limit) => fit::write(&place, container, movie, limit, console, fill),
    };
    let took = progress.finish();
    match written {
        Ok(written) => movie::tell(&place, &written, fps, took, console),
        Err(error) if matches!(error.downcast_ref(), Some(MovieError::Closed)) => console.note(error),
        Err(error) => return Err(error),
    }
    Ok(Outcome::Done)
}

/// Returns how often a single animated file is shown; other files are shown for ever.
fn plays_of(pictures: &[&Picture]) -> Plays {
    match pictures {
        [picture] => picture.plays().unwrap_or(Plays::Endless),
        _ => Plays::Endless,
    }
}

/// Returns the container to write, and the destination.
fn target(args: &Args) -> Result<(Container, Place), Usage> {
    let shown = args.output.display();
    let format = args.format.or_else(|| is_stdin(&args.output).then_some(Container::Gif));
    let target = Target::parse(&args.output, format)?;
    check_max_size(args.max_size, &target)?;
    let Target::Animation(container, place) = target else {
        return Err(Usage(format!(
            "cannot write {shown}: an animation is expected, such as .gif or .apng; images are made already"
        )));
    };
    if container == Container::Y4m && args.playback.is_given() {
        return Err(Usage(
            "--loop, --once and --final-delay are for .gif, .apng and .webp: a .y4m holds frames and their rate alone"
                .into(),
        ));
    }
    if args.exact && container != Container::Gif {
        return Err(Usage("--exact is for .gif: every other output keeps all colours of a frame".into()));
    }
    Ok((container, place))
}

/// Reports an animation.json beside the images, which is for scripts and is not read here.
fn tell_of_settings(args: &Args, console: &Console) {
    let folders: BTreeSet<&Path> = args.frames.iter().filter_map(|file| file.parent()).collect();
    for folder in folders {
        let settings = folder.join(SETTINGS_FILE);
        if settings.is_file() && args.durations.as_ref() != Some(&settings) {
            console.note(format_args!(
                "{} is not read: --fps, --loop and --durations say how to show images",
                settings.display()
            ));
        }
    }
}

/// Returns the files in the order in which they are shown, and reports if that is not the order in which they were
/// given.
fn in_order(args: &Args, console: &Console) -> Vec<PathBuf> {
    let mut files = args.frames.clone();
    if !args.no_sort {
        let name = |path: &PathBuf| path.with_extension("").to_string_lossy().into_owned();
        files.sort_by(|a, b| natural_cmp(&name(a), &name(b)));
    }
    if let [first, .., last] = files.as_slice()
        && files != args.frames
    {
        console.note(format_args!(
            "sorted by name, from {} to {}; --no-sort keeps the order of the command line",
            first.display(),
            last.display()
        ));
    }
    files
}

/// Returns how many images may be read before the encoder takes them.
fn window((width, height): (u32, u32)) -> usize {
    let most = rayon::current_num_threads() + 2;
    let images = AHEAD / (3 * u64::from(width) * u64::from(height)).max(1);
    usize::try_from(images).unwrap_or(most).clamp(1, most)
}

/// Adds the name of the faulty file to an error.
fn explain(error: MovieError, name: &str) -> anyhow::Error {
    let of_the_frame = matches!(error, MovieError::Gif(_) | MovieError::Size(_));
    let error = anyhow::Error::new(error);
    if of_the_frame { error.context(name.to_owned()) } else { error }
}

/// Examines all files before any is encoded: the kind of each, and its number of frames.
///
/// # Errors
/// Fails if a file cannot be shown; each such file is reported.
fn pictures(files: &[PathBuf], console: &Console) -> anyhow::Result<HashMap<PathBuf, Vec<Picture>>> {
    let mut pictures = HashMap::new();
    let mut faults = Vec::new();
    for path in files {
        let all = if is_stdin(path) { Picture::all_of_stdin() } else { Picture::all_of(path) };
        match all {
            Ok(all) => _ = pictures.insert(path.clone(), all),
            Err(error) if interrupt::signalled() => return Err(error),
            Err(fault) => faults.push(fault),
        }
    }
    if faults.is_empty() {
        return Ok(pictures);
    }
    faults.iter().take(MAX_LISTED).for_each(|fault| console.error(fault));
    anyhow::bail!("{} of {} cannot be used", faults.len(), number(files.len() as u64, "file"))
}
