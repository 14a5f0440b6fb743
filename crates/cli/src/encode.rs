//! `rayfold encode`: images that are already there to an animation.

use std::fs::File;
use std::io::{BufReader, BufWriter};
use std::path::{Path, PathBuf};

use anyhow::Context;
use image::{DynamicImage, ImageFormat, ImageReader, Rgb, RgbImage};
use rayfold_gif::{Encoder, Error, Settings};

use crate::ahead;
use crate::console::Console;
use crate::interrupt;
use crate::outcome::{Outcome, Usage};
use crate::output::{OutputError, OutputFile, probe};
use crate::progress::Progress;
use crate::render::tell;
use crate::threads::Threads;
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
  rayfold encode a.png b.png a.png -o blink.gif --fps 2 --loop 3")]
pub(crate) struct Args {
    /// PNG or TIFF files, in the order in which they are shown
    #[arg(required = true, value_name = "FRAME")]
    frames: Vec<PathBuf>,
    /// The GIF to write
    #[arg(long, short, value_name = "OUT")]
    output: PathBuf,
    /// Frames a second; above 50 some are left out, because a GIF cannot show them
    #[arg(long, value_name = "N", default_value_t = Settings::default().fps, allow_negative_numbers = true)]
    fps: f64,
    /// How often to repeat; 0 is for ever
    #[arg(long = "loop", value_name = "TIMES", default_value_t = Settings::default().loops, allow_negative_numbers = true)]
    loops: u16,
    #[command(flatten)]
    threads: Threads,
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    let path = &args.output;
    if !path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("gif")) {
        let message = format!("cannot write {}: its name does not end in .gif", path.display());
        return Err(Usage(message).into());
    }
    probe(path)?;
    check(&args.frames, console)?;
    args.threads.start()?;
    let mut out = BufWriter::with_capacity(1 << 16, OutputFile::create(path)?);
    let settings = Settings { fps: args.fps, loops: args.loops };
    let mut encoder =
        Encoder::new(&mut out, settings).map_err(|error| Usage(format!("--fps {}: {error}", args.fps)))?;
    let mut progress = Progress::start(console, "frames", args.frames.len() as u64);
    let window = window(&args.frames)?;
    let (mut frames, mut done) = (args.frames.iter(), 0);
    let take = |image| {
        anyhow::ensure!(!interrupt::stopping(), "interrupted");
        let frame = frames.next().context("a file for each image")?;
        encoder.push(image).map_err(|error| explain(error, frame, path))?;
        done += 1;
        progress.set(console, done);
        Ok(())
    };
    // On a thread of the pool: it need not wait for another one to encode.
    rayon::scope(|_| ahead::in_order(args.frames.iter(), window, |frame| read(frame), take))?;
    let summary = encoder.finish().map_err(|error| explain(error, path, path))?;
    let took = progress.finish();
    let failed = |source| OutputError::Io { path: path.clone(), source };
    out.into_inner().map_err(|error| failed(error.into_error()))?.finish(true)?;
    tell(path, &summary, args.fps, took, console);
    Ok(Outcome::Done)
}

/// How many images may be read before the encoder takes them.
fn window(frames: &[PathBuf]) -> anyhow::Result<usize> {
    let first = frames.first().context("at least one frame")?;
    let dimensions = open(first)?.into_dimensions();
    let (width, height) =
        dimensions.map_err(|error| anyhow::anyhow!("cannot read {}: {error}", first.display()))?;
    let most = rayon::current_num_threads() + 2;
    let images = AHEAD / (3 * u64::from(width) * u64::from(height)).max(1);
    Ok(usize::try_from(images).unwrap_or(most).clamp(1, most))
}

/// Names the file that is at fault.
fn explain(error: Error, frame: &Path, output: &Path) -> anyhow::Error {
    match error {
        Error::Write { source, .. } => OutputError::Io { path: output.to_path_buf(), source }.into(),
        other => anyhow::Error::new(other).context(frame.display().to_string()),
    }
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
        let reader = ImageReader::new(BufReader::new(File::open(path)?)).with_guessed_format()?;
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
