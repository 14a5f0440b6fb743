//! `--max-size`: the best quality that fits.
//!
//! A file gets smaller with fewer levels of each channel: neighbouring pixels are then more often alike, and pixels
//! change less often. The frames are drawn once and kept in an unnamed temporary file.

use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Seek, Write};

use anyhow::Context;
use image::DynamicImage;
use rayfold_movie::{Container, Movie};

use super::movie::{self, Encoded, MovieError, Push, Written};
use super::target::{Format, Place};
use crate::console::Console;
use crate::interrupt;
use crate::wording::Size;

/// The numbers of levels of a channel, from the best quality to the worst.
const LEVELS: [u16; 16] = [256, 129, 86, 65, 52, 43, 33, 26, 21, 17, 14, 11, 9, 7, 5, 4];

/// The part of a step by which a pixel may differ and still keep its level, so that noise changes no pixel.
const KEPT: f32 = 0.75;

/// Writes an animation as [`movie::write`] does, in at most `limit` bytes.
///
/// # Errors
/// The errors of [`movie::write`], and one if even the worst quality is larger.
pub(crate) fn write(
    place: &Place,
    container: Container,
    movie: Movie,
    limit: u64,
    console: &Console,
    fill: impl FnOnce(Push<'_>) -> anyhow::Result<()>,
) -> anyhow::Result<Written> {
    let mut store = Store::new(place)?;
    let (mut is_full, mut best) = (false, None);
    let whole = movie::encode(place, container, movie, Some(limit), |push| {
        fill(&mut |frame, seconds| {
            store.add(&frame, seconds).map_err(MovieError::Store)?;
            // The frames are still needed.
            if is_full {
                return Ok(());
            }
            match push(frame, seconds) {
                Err(MovieError::Full) => {
                    is_full = true;
                    Ok(())
                }
                other => other,
            }
        })?;
        anyhow::ensure!(!is_full, MovieError::Full);
        Ok(())
    });
    if let Some(whole) = unless_full(whole)? {
        return Ok(whole.keep(place)?);
    }
    // `worst` is the best quality known to fit, if any. No quality before `from` fits.
    let (mut from, mut worst) = (1, LEVELS.len());
    while from < worst {
        let middle = if best.is_none() && from == 1 { 4 } else { (from + worst) / 2 };
        let of_levels = movie::encode(place, container, movie, Some(limit), |push| {
            let mut rounding = Rounding::new(LEVELS[middle]);
            store.each(|frame, seconds| Ok(push(rounding.apply(frame), seconds)?))
        });
        match unless_full(of_levels)? {
            Some(encoded) => (best, worst) = (Some((encoded, LEVELS[middle])), middle),
            None => from = middle + 1,
        }
    }
    let Some((encoded, levels)) = best else {
        anyhow::bail!(
            "the file would be larger than {} even with {} levels a channel: expected frames of fewer pixels, fewer frames, or a \
             larger --max-size",
            Size(limit),
            LEVELS[LEVELS.len() - 1]
        );
    };
    let written = encoded.keep(place)?;
    console.note(format_args!("with {levels} levels a channel, of 256, it is at most {}", Size(limit)));
    Ok(written)
}

/// Returns `None` if the limit was reached.
fn unless_full(encoded: anyhow::Result<Encoded>) -> anyhow::Result<Option<Encoded>> {
    match encoded {
        Err(error) if matches!(error.downcast_ref(), Some(MovieError::Full)) => Ok(None),
        other => other.map(Some),
    }
}

/// A temporary file with frames, as PNG.
struct Store {
    file: BufWriter<File>,
    frames: Vec<(usize, Option<f64>)>,
}

impl Store {
    fn new(place: &Place) -> anyhow::Result<Self> {
        let folder = match place {
            Place::File(path) => path.parent().filter(|folder| !folder.as_os_str().is_empty()),
            Place::StandardOutput => None,
        };
        let file = match (folder, place) {
            (Some(folder), _) => tempfile::tempfile_in(folder),
            (None, Place::File(_)) => tempfile::tempfile_in("."),
            (None, Place::StandardOutput) => tempfile::tempfile(),
        };
        let file = file.context("cannot make a temporary file")?;
        Ok(Self { file: BufWriter::new(file), frames: Vec::new() })
    }

    fn add(&mut self, frame: &DynamicImage, seconds: Option<f64>) -> anyhow::Result<()> {
        let file = Format::Png.encode(frame)?;
        self.file.write_all(&file).context("cannot write a temporary file")?;
        self.frames.push((file.len(), seconds));
        Ok(())
    }

    fn each(
        &mut self,
        mut take: impl FnMut(DynamicImage, Option<f64>) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        let cannot = "cannot read a temporary file";
        self.file.flush().context(cannot)?;
        let file = self.file.get_mut();
        file.rewind().context(cannot)?;
        let mut file = BufReader::new(file);
        for (length, seconds) in &self.frames {
            anyhow::ensure!(!interrupt::stopping(), "interrupted");
            let mut bytes = vec![0; *length];
            file.read_exact(&mut bytes).context(cannot)?;
            take(Format::Png.decode(&bytes).context(cannot)?, *seconds)?;
        }
        Ok(())
    }
}

/// Rounds the levels of frames in order.
struct Rounding {
    /// The step from one level to the next, and the nearest level of each.
    step: f32,
    nearest: [u8; 256],
    before: Option<DynamicImage>,
}

impl Rounding {
    fn new(levels: u16) -> Self {
        let step = 255.0 / f32::from(levels - 1);
        let nearest = std::array::from_fn(|level| ((level as f32 / step).round() * step).round() as u8);
        Self { step, nearest, before: None }
    }

    /// Alpha is not rounded.
    fn apply(&mut self, frame: DynamicImage) -> DynamicImage {
        let Self { step, nearest, before } = self;
        let channels = usize::from(frame.color().channel_count());
        let is_like = |before: &&DynamicImage| {
            (before.width(), before.height(), before.color())
                == (frame.width(), frame.height(), frame.color())
        };
        let round = |levels: &mut [u8]| match before.as_ref().filter(is_like) {
            Some(before) => {
                let pixels = levels.chunks_exact_mut(channels).zip(before.as_bytes().chunks_exact(channels));
                for (level, before) in pixels.flat_map(|(now, before)| now[..3].iter_mut().zip(before)) {
                    let is_kept = f32::from(level.abs_diff(*before)) <= KEPT * *step;
                    *level = if is_kept { *before } else { nearest[usize::from(*level)] };
                }
            }
            None => {
                let pixels = levels.chunks_exact_mut(channels);
                pixels
                    .flat_map(|pixel| &mut pixel[..3])
                    .for_each(|level| *level = nearest[usize::from(*level)]);
            }
        };
        let frame = if channels == 4 {
            let mut frame = frame.clone().into_rgba8();
            round(&mut frame);
            frame.into()
        } else {
            let mut frame = frame.clone().into_rgb8();
            round(&mut frame);
            DynamicImage::from(frame)
        };
        *before = Some(frame.clone());
        frame
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn black_and_white_stay_and_noise_goes() {
        for levels in LEVELS {
            let mut rounding = Rounding::new(levels);
            assert_eq!((rounding.nearest[0], rounding.nearest[255]), (0, 255));
            let image = |level: u8| image::RgbImage::from_pixel(1, 1, image::Rgb([level; 3])).into();
            let shown = [100, 101, 99, 100, 250].map(|level| rounding.apply(image(level)).as_bytes()[0]);
            let off = |shown: u8, meant: u8| f32::from(shown.abs_diff(meant));
            assert!(
                off(shown[3], 100) <= KEPT * rounding.step + 0.5
                    && off(shown[4], 250) <= 0.5 * rounding.step + 0.5
            );
            let clear =
                rounding.apply(image::RgbaImage::from_pixel(1, 1, image::Rgba([101, 0, 0, 77])).into());
            assert_eq!(clear.as_bytes()[3], 77);
            assert!(levels > 52 || shown[..4].iter().all(|level| *level == shown[0]), "{levels}: {shown:?}");
        }
    }
}
