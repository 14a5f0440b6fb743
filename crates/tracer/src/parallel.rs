//! Parallel work on bands of an image, or on many objects.
//!
//! This module is independent of the picture's contents. It gives each worker its own rows, and checks the cancel flag
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

/// Does as [`map`] does, with the index of each item.
pub(crate) fn map_numbered<T: Sync, U: Send>(
    items: &[T],
    f: impl Fn((usize, &T)) -> U + Send + Sync,
) -> Vec<U> {
    if items.len() < SHARED {
        items.iter().enumerate().map(f).collect()
    } else {
        items.par_iter().enumerate().map(f).collect()
    }
}

/// Returns `items.iter().all(f)`, computed on all cores if there are many items.
pub(crate) fn all<T: Sync>(items: &[T], f: impl Fn(&T) -> bool + Send + Sync) -> bool {
    if items.len() < SHARED {
        items.iter().all(f)
    } else {
        items.par_chunks(SHARED).all(|items| items.iter().all(&f))
    }
}

/// Draws these rows of an image, counted from the top, in bands of `side` rows. The first band begins at the top of the
/// image. `draw` gets the buffers that `scratch` makes for a worker, the first row of its band, and the band's bytes.
pub(crate) fn bands<T>(
    screen: Screen,
    rows: Range<u32>,
    side: u32,
    options: &RenderOptions,
    scratch: impl Fn() -> T + Send + Sync,
    draw: impl Fn(&mut T, u32, &mut [u8]) + Sync,
) -> Result<RgbImage, RenderError> {
    let size = (screen.width(), rows.end - rows.start);
    let bytes = bands_of::<T, u8, CHANNELS>(screen, rows, side, options, scratch, draw)?;
    // There are exactly as many bytes as these rows have.
    Ok(RgbImage::from_raw(size.0, size.1, bytes).unwrap_or_default())
}

/// Draws bands as [`bands`] does, of pixels that are `EACH` values.
pub(crate) fn bands_of<T, P: Copy + Default + Send, const EACH: usize>(
    screen: Screen,
    rows: Range<u32>,
    side: u32,
    options: &RenderOptions,
    scratch: impl Fn() -> T + Send + Sync,
    draw: impl Fn(&mut T, u32, &mut [P]) + Sync,
) -> Result<Vec<P>, RenderError> {
    let whole = whole_bands(&rows, side, screen.height());
    if let Some(progress) = options.progress {
        progress.set(0, u64::from(screen.width()) * u64::from(whole.end - whole.start));
    }
    let mut buffer = values::<P>((screen.width(), whole.end - whole.start), EACH)?;
    let band = (screen.width() as usize).saturating_mul(side as usize).saturating_mul(EACH);
    buffer.par_chunks_mut(band).enumerate().try_for_each_init(scratch, |scratch, (index, band)| {
        if options.cancel.is_some_and(|flag| flag.load(Ordering::Relaxed)) {
            return Err(RenderError::Cancelled);
        }
        draw(scratch, whole.start + index as u32 * side, band);
        if let Some(progress) = options.progress {
            progress.add((band.len() / EACH) as u64);
        }
        Ok(())
    })?;
    // Those rows alone, in the same memory.
    let place = |row: u32| (row - whole.start) as usize * screen.width() as usize * EACH;
    buffer.truncate(place(rows.end));
    buffer.drain(..place(rows.start));
    Ok(buffer)
}

/// Returns the rows of all bands of `side` rows that contain any of these rows, in an image of `height` rows.
pub(crate) fn whole_bands(rows: &Range<u32>, side: u32, height: u32) -> Range<u32> {
    rows.start / side * side..(rows.end.div_ceil(side).saturating_mul(side)).min(height)
}

/// Makes an image of this width and height, whose bytes `draw` fills.
///
/// # Errors
/// If the image does not fit into memory.
pub(crate) fn image(
    (width, height): (u32, u32),
    draw: impl FnOnce(&mut [u8]),
) -> Result<RgbImage, RenderError> {
    let mut buffer = values((width, height), CHANNELS)?;
    draw(&mut buffer);
    RgbImage::from_raw(width, height, buffer).ok_or(RenderError::TooLarge { width, height })
}

/// Makes the values of an image of this width and height, `each` per pixel.
///
/// # Errors
/// If they do not fit into memory.
pub(crate) fn values<P: Copy + Default>(
    (width, height): (u32, u32),
    each: usize,
) -> Result<Vec<P>, RenderError> {
    let too_large = || RenderError::TooLarge { width, height };
    let pixels = usize::try_from(u64::from(width) * u64::from(height)).map_err(|_| too_large())?;
    let count = pixels.checked_mul(each).ok_or_else(too_large)?;
    let mut buffer = Vec::new();
    buffer.try_reserve_exact(count).map_err(|_| too_large())?;
    buffer.resize(count, P::default());
    Ok(buffer)
}
