//! The output of a tile: its place in the image, and the bytes of its pixels.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;
use rayfold_scene::Tone;

use crate::cover::{Lit, NOTHING};
use crate::fast::arithmetic::real::{Fused, Lanes, Real, Vec3, constant};
use crate::fast::film::tone::{encoded, levels};
use crate::fast::rays::bounce::{Column, Columns, packet_shape};
use crate::parallel::CHANNELS;

/// A rectangle of the image, counted from its upper left corner.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tile {
    pub(crate) left: u32,
    pub(crate) top: u32,
    pub(crate) width: u32,
    pub(crate) height: u32,
    /// The objects that it can show, as bits. With a tree: nonzero if it can show anything.
    pub(crate) candidates: u64,
    /// The bodies that it can show, as bits.
    pub(crate) bodies: u64,
    /// The column and row of the tile in the grid of tiles.
    pub(crate) place: (usize, usize),
    /// The number of bounces that are followed.
    pub(crate) bounces: u32,
}

/// The destination of a tile's pixels: the bytes of its rows, from the image's left edge.
pub(crate) struct Band<'a> {
    pub(crate) bytes: &'a mut [u8],
    /// The pixels of its rows, instead of the bytes, in scenes without background.
    pub(crate) lit: &'a mut [Lit],
    pub(crate) rows: u32,
    /// The columns and rows of the whole image.
    pub(crate) size: (u32, u32),
    /// The background colour, for pixels that show no object.
    pub(crate) background: FlatBackground,
    /// The conversion of colours to levels.
    pub(crate) tone: Tone,
}

/// A background of one colour: its level in each channel, and the colour that becomes these levels in each writer.
#[derive(Clone, Copy)]
pub(crate) struct FlatBackground {
    levels: [u8; CHANNELS],
    color: [f64; CHANNELS],
}

impl FlatBackground {
    pub(crate) fn new<E: Real>(color: DVec3, tone: Tone) -> Self {
        match tone {
            Tone::Plain => {
                let levels = levels(color, tone);
                Self { levels, color: levels.map(|level| f64::from(level) / 255.0) }
            }
            Tone::Srgb => {
                let color = color.to_array().map(|channel| E::narrow(channel.clamp(0.0, 1.0)).widen());
                Self { levels: levels(DVec3::from_array(color), tone), color }
            }
        }
    }
}

impl Band<'_> {
    /// Returns the colour of rays that hit nothing.
    #[inline(always)]
    pub(crate) fn background<E: Real>(&self) -> [E; 3] {
        self.background.color.map(E::narrow)
    }
}

/// Returns how many rays the packets of a tile have, including those beyond its edges, given its columns and rows.
#[inline(always)]
pub(crate) fn rays_of<S: Simd, E: Real>((columns, rows): (u32, u32)) -> usize {
    let (width, height) = packet_shape::<S, E>();
    (columns as usize).next_multiple_of(width) * (rows as usize).next_multiple_of(height)
}

/// Fills a tile with the background.
pub(crate) fn fill(tile: Tile, band: &mut Band) {
    let stride = band.size.0 as usize * CHANNELS;
    let (from, to) = (tile.left as usize * CHANNELS, (tile.left + tile.width) as usize * CHANNELS);
    for row in band.bytes.chunks_exact_mut(stride) {
        row[from..to].as_chunks_mut().0.fill(band.background.levels);
    }
    for row in band.lit.chunks_exact_mut(band.size.0 as usize) {
        row[tile.left as usize..(tile.left + tile.width) as usize].fill(NOTHING);
    }
}

/// Writes colours to the bytes of the image.
#[inline(never)]
pub(crate) fn write_pixels<S: Simd, E: Real>(simd: S, tile: Tile, colors: &Columns<E>, band: &mut Band) {
    simd.vectorize(
        #[inline(always)]
        || {
            let (width, height) = packet_shape::<S, E>();
            let stride = band.size.0 as usize * CHANNELS;
            let mut at = 0;
            for top in (0..tile.height as usize).step_by(height) {
                for left in (0..tile.width as usize).step_by(width) {
                    let mut packed = [0; 16];
                    let Vec3 { x, y, z } = Vec3::<S, E>::load(simd, colors, at);
                    #[cfg(feature = "accuracy")]
                    for channel in [x, y, z] {
                        crate::nans::add(channel.simd_ne(channel).to_bitmask().count_ones());
                    }
                    E::pack::<S>(
                        [level::<S, E>(simd, x), level::<S, E>(simd, y), level::<S, E>(simd, z)],
                        &mut packed,
                    );
                    let rows = top..(top + height).min(tile.height as usize);
                    for (row, pixels) in rows.zip(packed.chunks_exact(width)) {
                        let from = row * stride + (tile.left as usize + left) * CHANNELS;
                        let columns = tile.width as usize - left;
                        if columns >= width {
                            write(pixels, &mut band.bytes[from..from + width * CHANNELS]);
                        } else {
                            write(&pixels[..columns], &mut band.bytes[from..from + columns * CHANNELS]);
                        }
                    }
                    at += Lanes::<S, E>::LEN;
                }
            }
        },
    );
}

/// Writes colours to the bytes of the image, encoded by the sRGB curve.
#[inline(never)]
pub(crate) fn write_encoded<S: Simd, E: Real>(tile: Tile, colors: &Columns<E>, band: &mut Band) {
    let stride = band.size.0 as usize * CHANNELS;
    each_pixel::<S, E>(tile, |(column, row), at| {
        let from = row * stride + (tile.left as usize + column) * CHANNELS;
        for (byte, channel) in band.bytes[from..from + CHANNELS].iter_mut().zip(colors) {
            *byte = encoded(channel.0[at].widen());
        }
    });
}

/// Writes colours and covers to the pixels of a scene without background.
#[inline(never)]
pub(crate) fn write_lit<S: Simd, E: Real>(
    tile: Tile,
    colors: &Columns<E>,
    cover: &Column<E>,
    band: &mut Band,
) {
    let stride = band.size.0 as usize;
    each_pixel::<S, E>(tile, |(column, row), at| {
        let [red, green, blue] = colors.each_ref().map(|channel| {
            let light = channel.0[at].widen();
            // A NaN is black.
            if light > 0.0 { light.min(1.0) as f32 } else { 0.0 }
        });
        let cover = cover.0[at].widen().clamp(0.0, 1.0) as f32;
        band.lit[row * stride + tile.left as usize + column] = [red, green, blue, cover];
    });
}

/// Calls `each` with the column and row of each pixel of a tile, and the index of its ray.
#[inline(always)]
fn each_pixel<S: Simd, E: Real>(tile: Tile, mut each: impl FnMut((usize, usize), usize)) {
    let (width, height) = packet_shape::<S, E>();
    let packets_in_row = (tile.width as usize).div_ceil(width);
    for row in 0..tile.height as usize {
        for column in 0..tile.width as usize {
            let packet = row / height * packets_in_row + column / width;
            each((column, row), packet * (width * height) + row % height * width + column % width);
        }
    }
}

/// Writes the three bytes of each pixel, two pixels at a time.
#[inline(always)]
fn write(pixels: &[u32], bytes: &mut [u8]) {
    let (pairs, last) = pixels.as_chunks();
    let (two, one) = bytes.as_chunks_mut::<{ 2 * CHANNELS }>();
    for (bytes, &[first, second]) in two.iter_mut().zip(pairs) {
        let both = (u64::from(first) | u64::from(second) << 24).to_le_bytes();
        bytes.copy_from_slice(&both[..2 * CHANNELS]);
    }
    if let [last] = last {
        one.copy_from_slice(&last.to_le_bytes()[..CHANNELS]);
    }
}

/// Returns a level plus a half, so that truncation rounds it. A NaN becomes black.
#[inline(always)]
fn level<S: Simd, E: Real>(simd: S, channel: Lanes<S, E>) -> Lanes<S, E> {
    let (zero, one) = (constant::<S, E>(simd, 0.0), constant::<S, E>(simd, 1.0));
    let known = channel.simd_eq(channel).select(channel, zero);
    known.max(zero).min(one).fused_mul_add(constant::<S, E>(simd, 255.0), constant::<S, E>(simd, 0.5))
}
