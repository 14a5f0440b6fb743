//! Parallel work on bands of an image, or on many objects.
//!
//! This module is independent of the picture's contents: it gives each worker its own rows, and checks the cancel flag
//! between them. The picture does not depend on which worker draws a band.

use core::ops::Range;
use std::sync::atomic::Ordering;

use image::RgbImage;
use rayfold_scene::Screen;
use rayon::prelude::*;

use crate::{RenderError, RenderOptions};

/// The number of bytes of an RGB pixel.
pub(crate) const CHANNELS: usize = 3;

/// The number of items below which parallel work is slower.
const SHARED: usize = 4096;

/// Returns `items.iter().map(f).collect()`, computed on all cores if there are many items.
pub(crate) fn map<T: Sync, U: Send>(items: &[T], f: impl Fn(&T) -> U + Send + Sync) -> Vec<U> {
    if items.len() < SHARED { items.iter().map(f).collect() } else { items.par_iter().map(f).collect() }
}

/// Draws these rows of an image, counted from the top, in bands of `side` rows, the first of which begins at the top of
/// the image. `draw` gets the buffers that `scratch` makes for a worker, the first row of its band, and the band's
/// bytes.
pub(crate) fn bands<T>(
    screen: Screen,
    rows: Range<u32>,
    side: u32,
    options: &RenderOptions,
    scratch: impl Fn() -> T + Send + Sync,
    draw: impl Fn(&mut T, u32, &mut [u8]) + Sync,
) -> Result<RgbImage, RenderError> {
    let mut rows_drawn = Ok(());
    let whole = whole_bands(&rows, side, screen.height());
    if let Some(progress) = options.progress {
        progress.set(0, u64::from(screen.width()) * u64::from(whole.end - whole.start));
    }
    let image = image((screen.width(), whole.end - whole.start), |buffer| {
        let band = (screen.width() as usize).saturating_mul(side as usize).saturating_mul(CHANNELS);
        rows_drawn =
            buffer.par_chunks_mut(band).enumerate().try_for_each_init(scratch, |scratch, (index, band)| {
                if options.cancel.is_some_and(|flag| flag.load(Ordering::Relaxed)) {
                    return Err(RenderError::Cancelled);
                }
                draw(scratch, whole.start + index as u32 * side, band);
                if let Some(progress) = options.progress {
                    progress.add((band.len() / CHANNELS) as u64);
                }
                Ok(())
            });
    })?;
    rows_drawn.map(|()| cut(image, rows.start - whole.start..rows.end - whole.start))
}

/// Returns the rows of all bands of `side` rows that contain any of these rows, in an image of `height` rows.
pub(crate) fn whole_bands(rows: &Range<u32>, side: u32, height: u32) -> Range<u32> {
    rows.start / side * side..(rows.end.div_ceil(side).saturating_mul(side)).min(height)
}

/// Returns some rows of an image, in its memory.
fn cut(image: RgbImage, rows: Range<u32>) -> RgbImage {
    let width = image.width();
    let place = |row: u32| row as usize * width as usize * CHANNELS;
    let mut bytes = image.into_raw();
    bytes.truncate(place(rows.end));
    bytes.drain(..place(rows.start));
    // There are exactly as many bytes as these rows have.
    RgbImage::from_raw(width, rows.end - rows.start, bytes).unwrap_or_default()
}

/// Makes an image of this width and height, whose bytes `draw` fills.
///
/// # Errors
/// If the image does not fit into memory.
pub(crate) fn image(
    (width, height): (u32, u32),
    draw: impl FnOnce(&mut [u8]),
) -> Result<RgbImage, RenderError> {
    let too_large = || RenderError::TooLarge { width, height };
    let pixels = usize::try_from(u64::from(width) * u64::from(height)).map_err(|_| too_large())?;
    let bytes = pixels.checked_mul(CHANNELS).ok_or_else(too_large)?;
    let mut buffer = Vec::new();
    buffer.try_reserve_exact(bytes).map_err(|_| too_large())?;
    buffer.resize(bytes, 0);
    draw(&mut buffer);
    RgbImage::from_raw(width, height, buffer).ok_or_else(too_large)
}
