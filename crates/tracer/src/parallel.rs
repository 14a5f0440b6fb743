//! Work on bands of an image, or on many objects, side by side.
//!
//! Knows nothing of what is drawn: it hands each worker rows that are its own and looks at the cancel flag between
//! them. Which worker draws a band cannot be seen in the picture.

use std::sync::atomic::Ordering;

use image::RgbImage;
use rayfold_scene::Screen;
use rayon::prelude::*;

use crate::{RenderError, RenderOptions};

/// Bytes of an RGB pixel.
pub(crate) const CHANNELS: usize = 3;

/// Fewer items than this are not worth sharing out.
const SHARED: usize = 4096;

/// `items.iter().map(f).collect()`, on all cores where there are many items.
pub(crate) fn map<T: Sync, U: Send>(items: &[T], f: impl Fn(&T) -> U + Send + Sync) -> Vec<U> {
    if items.len() < SHARED { items.iter().map(f).collect() } else { items.par_iter().map(f).collect() }
}

/// Draws an image in bands of `rows` rows; `draw` gets memory that `scratch` makes for a worker, the first row of its
/// band, counted from the top, and the band's bytes.
pub(crate) fn bands<T>(
    screen: Screen,
    rows: u32,
    options: &RenderOptions,
    scratch: impl Fn() -> T + Send + Sync,
    draw: impl Fn(&mut T, u32, &mut [u8]) + Sync,
) -> Result<RgbImage, RenderError> {
    let mut rows_drawn = Ok(());
    let image = image(screen, |buffer| {
        let band = (screen.width() as usize).saturating_mul(rows as usize).saturating_mul(CHANNELS);
        rows_drawn =
            buffer.par_chunks_mut(band).enumerate().try_for_each_init(scratch, |scratch, (index, band)| {
                if options.cancel.is_some_and(|flag| flag.load(Ordering::Relaxed)) {
                    return Err(RenderError::Cancelled);
                }
                draw(scratch, index as u32 * rows, band);
                Ok(())
            });
    })?;
    rows_drawn.map(|()| image)
}

/// An image whose bytes `draw` fills.
///
/// # Errors
/// When it cannot be held in memory.
pub(crate) fn image(screen: Screen, draw: impl FnOnce(&mut [u8])) -> Result<RgbImage, RenderError> {
    let (width, height) = (screen.width(), screen.height());
    let too_large = || RenderError::TooLarge { width, height };
    let pixels = usize::try_from(screen.pixels()).map_err(|_| too_large())?;
    let bytes = pixels.checked_mul(CHANNELS).ok_or_else(too_large)?;
    let mut buffer = Vec::new();
    buffer.try_reserve_exact(bytes).map_err(|_| too_large())?;
    buffer.resize(bytes, 0);
    draw(&mut buffer);
    RgbImage::from_raw(width, height, buffer).ok_or_else(too_large)
}
