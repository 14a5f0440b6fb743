//! Compares the 256 colours that `rayfold-gif` chooses for a frame with those of `quantette`, a well-known crate.
//!
//! Both get the same pixels. Only the palette is compared: every pixel is shown in the nearest of its colours.

use std::collections::HashMap;
use std::path::Path;

use anyhow::{Result, anyhow};
use image::RgbImage;
use quantette::deps::palette::Srgb;
use quantette::{ImageBuf, Pipeline, QuantizeMethod};
use rayfold_gif::{Encoder, Settings};
use rayon::prelude::*;

use super::metrics::{difference_1976, lab_of};
use super::viewer::Viewer;
use crate::cpu_time;

/// The number of runs, of which the fastest counts.
const ROUNDS: usize = 3;

/// The results of both.
pub(super) struct Palettes {
    pub(super) ours: Judged,
    pub(super) theirs: Judged,
}

/// The cost and the quality of a palette.
pub(super) struct Judged {
    /// Processor time in seconds from pixels to a GIF of one frame.
    pub(super) cpu: f64,
    pub(super) bytes: usize,
    pub(super) psnr: f64,
    /// CIE 1976 colour difference.
    pub(super) de76: f64,
}

/// Compares both palettes. Returns `None` for a frame of at most 256 colours, which needs no choice.
///
/// # Errors
/// Fails if the frame cannot be encoded or decoded.
pub(super) fn compare(frame: &RgbImage, folder: &Path) -> Result<Option<Palettes>> {
    let mut counts = HashMap::<[u8; 3], u64>::new();
    for &rgb in frame.as_raw().as_chunks::<3>().0 {
        *counts.entry(rgb).or_default() += 1;
    }
    if counts.len() <= 256 {
        return Ok(None);
    }
    let counts = counts.into_iter().collect::<Vec<_>>();
    let judge = |draw: &(dyn Fn() -> Result<Vec<u8>> + Sync)| -> Result<Judged> {
        let (mut cpu, gif) = cpu_time::of(draw)?;
        for _ in 1..ROUNDS {
            cpu = cpu.min(cpu_time::of(draw)?.0);
        }
        let (gif, path) = (gif?, folder.join("one.gif"));
        std::fs::write(&path, &gif)?;
        let mut viewer = Viewer::open(&path, frame.dimensions())?;
        let (psnr, de76) = in_nearest(&counts, viewer.at(0)?);
        viewer.close()?;
        Ok(Judged { cpu, bytes: gif.len(), psnr, de76 })
    };
    let ours = judge(&|| encode(frame.clone()))?;
    let theirs = judge(&|| {
        let pixels = frame.as_raw().as_chunks::<3>().0.iter().map(|&[r, g, b]| Srgb::new(r, g, b)).collect();
        let image = ImageBuf::new(frame.width(), frame.height(), pixels);
        let image = image.map_err(|_| anyhow!("as many pixels as the frame has"))?;
        let pipeline = Pipeline::new().quantize_method(QuantizeMethod::kmeans()).ditherer(None);
        let drawn = pipeline.input_image(image.as_ref()).output_srgb8_image().into_inner();
        let drawn = drawn.into_iter().flat_map(|c| [c.red, c.green, c.blue]).collect();
        let drawn = RgbImage::from_raw(frame.width(), frame.height(), drawn);
        // There are few colours, so the encoder keeps them unchanged.
        encode(drawn.unwrap_or_default())
    })?;
    Ok(Some(Palettes { ours, theirs }))
}

fn encode(frame: RgbImage) -> Result<Vec<u8>> {
    let mut gif = Vec::new();
    let mut encoder = Encoder::new(&mut gif, Settings::default())?;
    encoder.push(frame)?;
    encoder.finish()?;
    Ok(gif)
}

/// Returns the PSNR and the mean colour difference of pixels that are shown in the nearest colour of `drawn`. `counts`
/// holds the number of pixels of each colour.
fn in_nearest(counts: &[([u8; 3], u64)], drawn: &RgbImage) -> (f64, f64) {
    let mut palette = drawn.as_raw().as_chunks::<3>().0.to_vec();
    palette.sort_unstable();
    palette.dedup();
    let palette = palette.into_iter().map(|rgb| (rgb, lab_of(rgb))).collect::<Vec<_>>();
    let error = |&(rgb, count): &([u8; 3], u64)| {
        let lab = lab_of(rgb);
        let distances = palette.iter().map(|&(other, at)| (difference_1976(lab, at), other));
        let (nearest, other) = distances.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((0.0, rgb));
        let square = (0..3).map(|k| u64::from(rgb[k].abs_diff(other[k])).pow(2)).sum::<u64>();
        (count as f64 * square as f64, count as f64 * f64::from(nearest), count as f64)
    };
    let sum = |a: (f64, f64, f64), b: (f64, f64, f64)| (a.0 + b.0, a.1 + b.1, a.2 + b.2);
    let (square, difference, pixels) = counts.par_iter().map(error).reduce(|| (0.0, 0.0, 0.0), sum);
    (10.0 * (65_025.0 * 3.0 * pixels / square).log10(), difference / pixels)
}
