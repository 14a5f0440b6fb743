//! `rayfold encode`: images that are already there to an animation.

use std::io::BufWriter;
use std::path::{Path, PathBuf};

use anyhow::Context;
use image::{DynamicImage, ImageReader, Rgb, RgbImage};
use rayfold_gif::{Encoder, Error, Settings};

use crate::console::Console;
use crate::interrupt;
use crate::outcome::{Outcome, Usage};
use crate::output::{OutputError, OutputFile, probe};
use crate::progress::Progress;
use crate::render::{ahead, tell};
use crate::threads::Threads;

/// Frames that are read ahead of the encoder.
const AHEAD: usize = 2;

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
    #[arg(long, value_name = "N", default_value_t = Settings::default().fps)]
    fps: f64,
    /// How often to repeat; 0 is for ever
    #[arg(long = "loop", value_name = "TIMES", default_value_t = Settings::default().loops)]
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
    args.threads.start()?;
    let mut out = BufWriter::with_capacity(1 << 20, OutputFile::create(path)?);
    let settings = Settings { fps: args.fps, loops: args.loops };
    let mut encoder =
        Encoder::new(&mut out, settings).map_err(|error| Usage(format!("--fps {}: {error}", args.fps)))?;
    let mut progress = Progress::start(console, "frames", args.frames.len() as u64);
    let mut frames = args.frames.iter().zip(1..);
    ahead::in_order(
        args.frames.iter(),
        AHEAD,
        |frame| read(frame),
        |image| {
            anyhow::ensure!(!interrupt::stopping(), "interrupted");
            let (frame, done) = frames.next().context("an image for each frame")?;
            encoder.push(image).map_err(|error| explain(error, frame, path))?;
            progress.set(console, done);
            Ok(())
        },
    )?;
    let summary = encoder.finish().map_err(|error| explain(error, path, path))?;
    let took = progress.finish();
    let failed = |source| OutputError::Io { path: path.clone(), source };
    out.into_inner().map_err(|error| failed(error.into_error()))?.finish(true)?;
    tell(path, &summary, args.fps, took, console);
    Ok(Outcome::Done)
}

/// Names the file that is at fault.
fn explain(error: Error, frame: &Path, output: &Path) -> anyhow::Error {
    match error {
        Error::Write { source, .. } => OutputError::Io { path: output.to_path_buf(), source }.into(),
        other => anyhow::Error::new(other).context(frame.display().to_string()),
    }
}

fn read(path: &Path) -> anyhow::Result<RgbImage> {
    let read = || Ok::<_, anyhow::Error>(ImageReader::open(path)?.with_guessed_format()?.decode()?);
    let image = read().with_context(|| format!("cannot read {}", path.display()))?;
    Ok(opaque(image))
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
