//! `rayfold encode`: images that are already there to an animation.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use anyhow::Context;
use image::RgbImage;
use rayfold_files::probe;
use rayfold_gif::{Encoder, Plays, Settings};
use rayfold_scene::natural_cmp;

use crate::ahead;
use crate::console::Console;
use crate::interrupt;
use crate::outcome::{Outcome, Usage};
use crate::playback::Playback;
use crate::progress::Progress;
use crate::render::movie::{self, MovieError};
use crate::render::target::{Container, Movie, Place, must_be_gif};
use crate::threads::Threads;
use crate::values;
use crate::wording::number;

mod picture;
mod tiff;

use picture::Picture;

/// Files at fault that are named, at most.
const MOST_TOLD: usize = 20;

/// Memory that images ahead of the encoder may take, in bytes: two of 1920 x 1080.
const AHEAD: u64 = 14 << 20;

/// Turn images into an animated GIF
///
/// Every image is a frame, and all are of one size; of an animated PNG each frame is one, of a TIFF each page. What is
/// transparent is shown over black.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  rayfold encode frames/*.png -o hello.gif
  rayfold encode a.png b.png a.png --no-sort -o blink.gif --fps 2 --loop 3")]
pub(crate) struct Args {
    /// PNG or TIFF files; they are shown in natural order of their names: f2.png before f10.png
    #[arg(required = true, value_name = "FRAME")]
    frames: Vec<PathBuf>,
    /// The GIF to write
    #[arg(long, short, value_name = "OUT.gif")]
    output: PathBuf,
    /// Show the files in the order in which they are given
    #[arg(long)]
    no_sort: bool,
    /// Frames a second; above 50 some are left out, because a GIF cannot show them, but never the last
    #[arg(long, value_name = "RATE", default_value_t = Settings::default().fps, value_parser = values::rate, allow_negative_numbers = true)]
    fps: f64,
    #[command(flatten)]
    playback: Playback,
    /// Keep every frame of at most 256 colours exactly. Without this flag, a slow fade of a large image (more than 100,000
    /// pixels) may be off by up to 4 levels of 255, in a file several times smaller
    #[arg(long)]
    exact: bool,
    #[command(flatten)]
    threads: Threads,
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    must_be_gif(&args.output)?;
    probe(&args.output)?;
    let fps = args.fps;
    Encoder::new(std::io::sink(), Settings { fps, ..Settings::default() })
        .map_err(|error| Usage(format!("--fps {fps}: {error}")))?;
    let of_file = pictures(&args.frames, console)?;
    let pictures: Vec<&Picture> = in_order(args, console).iter().flat_map(|file| &of_file[file]).collect();
    args.threads.start()?;
    let movie = Movie {
        size: pictures.first().context("at least one frame")?.size()?,
        frames: pictures.iter().map(|picture| picture.frames).sum(),
        fps,
        plays: args.playback.plays(Plays::Endless),
        last_delay_cs: args.playback.last_delay_cs(),
        exact: args.exact,
    };
    let mut progress = Progress::start(console, "frames", movie.frames);
    let place = Place::File(args.output.clone());
    let written = movie::write(&place, Container::Gif, movie, |push| {
        let (mut of_images, mut done) = (pictures.iter(), 0);
        let take = |image: Option<RgbImage>| {
            let picture = of_images.next().context("a picture for each image")?;
            let mut take_one = |image| {
                anyhow::ensure!(!interrupt::stopping(), "interrupted");
                push(image).map_err(|error| explain(error, &picture.path))?;
                done += 1;
                progress.set(console, done);
                Ok(())
            };
            match image {
                Some(image) => take_one(image),
                // Each frame needs the one before it.
                None => picture.decode_each(&mut take_one),
            }
        };
        // On a thread of the pool: it need not wait for another one to encode.
        rayon::scope(|_| {
            ahead::in_order(pictures.iter(), window(movie.size), |picture| picture.decode(), take)
        })
    })?;
    movie::tell(&place, &written, fps, progress.finish(), console);
    Ok(Outcome::Done)
}

/// The files as they are shown. That they are not in the order in which they were given is told.
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

/// How many images may be read before the encoder takes them.
fn window((width, height): (u32, u32)) -> usize {
    let most = rayon::current_num_threads() + 2;
    let images = AHEAD / (3 * u64::from(width) * u64::from(height)).max(1);
    usize::try_from(images).unwrap_or(most).clamp(1, most)
}

/// Names the file that is at fault.
fn explain(error: MovieError, file: &Path) -> anyhow::Error {
    let of_the_frame = matches!(error, MovieError::Gif(_));
    let error = anyhow::Error::new(error);
    if of_the_frame { error.context(file.display().to_string()) } else { error }
}

/// Looks at all files before any is encoded: that each is there, and a PNG or TIFF image of how many frames.
///
/// # Errors
/// When one is not; each is reported.
fn pictures(files: &[PathBuf], console: &Console) -> anyhow::Result<HashMap<PathBuf, Vec<Picture>>> {
    let mut pictures = HashMap::new();
    let mut faults = Vec::new();
    for path in files {
        match Picture::all_of(path) {
            Ok(all) => _ = pictures.insert(path.clone(), all),
            Err(fault) => faults.push(fault),
        }
    }
    if faults.is_empty() {
        return Ok(pictures);
    }
    faults.iter().take(MOST_TOLD).for_each(|fault| console.error(fault));
    anyhow::bail!("{} of {} cannot be used", faults.len(), number(files.len() as u64, "file"))
}
