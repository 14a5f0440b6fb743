//! `rayfold encode`: images that are already there to an animation.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use anyhow::Context;
use image::{DynamicImage, ImageFormat, ImageReader, Rgb, RgbImage};
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

/// Files at fault that are named, at most.
const MOST_TOLD: usize = 20;

/// Memory that images ahead of the encoder may take, in bytes: two of 1920 x 1080.
const AHEAD: u64 = 14 << 20;

/// Turn images into an animated GIF
///
/// Every image is a frame, and all are of one size. What is transparent is shown over black.
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
    /// Frames a second; above 50 some are left out, because a GIF cannot show them
    #[arg(long, value_name = "RATE", default_value_t = Settings::default().fps, value_parser = values::rate, allow_negative_numbers = true)]
    fps: f64,
    #[command(flatten)]
    playback: Playback,
    #[command(flatten)]
    threads: Threads,
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    must_be_gif(&args.output)?;
    probe(&args.output)?;
    let fps = args.fps;
    Encoder::new(std::io::sink(), Settings { fps, ..Settings::default() })
        .map_err(|error| Usage(format!("--fps {fps}: {error}")))?;
    check(&args.frames, console)?;
    let files = in_order(args, console);
    args.threads.start()?;
    let movie = Movie {
        size: size(&files)?,
        frames: files.len() as u64,
        fps,
        plays: args.playback.plays(Plays::Endless),
        last_delay_cs: args.playback.last_delay_cs(),
    };
    let mut progress = Progress::start(console, "frames", movie.frames);
    let place = Place::File(args.output.clone());
    let written = movie::write(&place, Container::Gif, movie, |push| {
        let (mut names, mut done) = (files.iter(), 0);
        let take = |image| {
            anyhow::ensure!(!interrupt::stopping(), "interrupted");
            let file = names.next().context("a file for each image")?;
            push(image).map_err(|error| explain(error, file))?;
            done += 1;
            progress.set(console, done);
            Ok(())
        };
        // On a thread of the pool: it need not wait for another one to encode.
        rayon::scope(|_| ahead::in_order(files.iter(), window(movie.size), |file| read(file), take))
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

/// Columns and rows of the first image.
fn size(files: &[PathBuf]) -> anyhow::Result<(u32, u32)> {
    let first = files.first().context("at least one frame")?;
    open(first)?
        .into_dimensions()
        .map_err(|error| anyhow::anyhow!("cannot read {}: {error}", first.display()))
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

/// Looks at all files before any is encoded: that each is there, and by its first bytes a PNG or TIFF image.
///
/// # Errors
/// When one is not; each is told.
fn check(frames: &[PathBuf], console: &Console) -> anyhow::Result<()> {
    let faults = frames.iter().filter_map(|path| open(path).err()).collect::<Vec<_>>();
    if faults.is_empty() {
        return Ok(());
    }
    faults.iter().take(MOST_TOLD).for_each(|fault| console.error(fault));
    anyhow::bail!("{} of {} cannot be used", faults.len(), number(frames.len() as u64, "frame"))
}

fn open(path: &Path) -> anyhow::Result<ImageReader<BufReader<File>>> {
    let opened = || {
        anyhow::ensure!(
            !path.is_dir(),
            "it is a folder, expected its images, such as {0}/*.png",
            path.display()
        );
        let reader = ImageReader::new(BufReader::new(rayfold_files::open(path)?)).with_guessed_format()?;
        match reader.format() {
            Some(ImageFormat::Png | ImageFormat::Tiff) => Ok(reader),
            _ => anyhow::bail!("it is neither a PNG nor a TIFF image"),
        }
    };
    opened().with_context(|| format!("cannot read {}", path.display()))
}

fn read(path: &Path) -> anyhow::Result<RgbImage> {
    // The decoder's words say already what its cause says again.
    let decoded = open(path)?.decode().map_err(|error| anyhow::anyhow!("{error}"));
    Ok(opaque(decoded.with_context(|| format!("cannot read {}", path.display()))?))
}

/// A GIF's pixel is there or not; what is half there is shown over black.
fn opaque(image: DynamicImage) -> RgbImage {
    if !image.color().has_alpha() {
        return image.into_rgb8();
    }
    let image = image.into_rgba8();
    RgbImage::from_fn(image.width(), image.height(), |x, y| {
        let [r, g, b, alpha] = image.get_pixel(x, y).0;
        let over = |level: u8| ((u32::from(level) * u32::from(alpha) + 127) / 255) as u8;
        Rgb([over(r), over(g), over(b)])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transparent_pixels_are_over_black() {
        let image =
            image::RgbaImage::from_fn(3, 1, |x, _| image::Rgba([200, 100, 50, [0, 128, 255][x as usize]]));
        let shown = opaque(DynamicImage::ImageRgba8(image));
        assert_eq!(shown.into_raw(), [0, 0, 0, 100, 50, 25, 200, 100, 50]);
    }
}
