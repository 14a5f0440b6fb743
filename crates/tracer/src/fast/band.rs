//! Where a tile's pixels lie in the image, and their bytes.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;
use rayfold_scene::Tone;

use super::bounce::{Columns, packet_shape};
use super::real::{Lanes, Real, Vec3, constant};
use super::tone::{encoded, levels};
use crate::parallel::CHANNELS;

/// A rectangle of the image, counted from its upper left corner.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tile {
    pub(super) left: u32,
    pub(super) top: u32,
    pub(super) width: u32,
    pub(super) height: u32,
    /// What it can show, by bits; with a tree, whether it can show anything.
    pub(super) candidates: u64,
    /// The same of bodies.
    pub(super) bodies: u64,
    /// Columns and rows of tiles before it.
    pub(super) place: (usize, usize),
    /// Bounces that are followed.
    pub(super) bounces: u32,
}

/// Where a tile's pixels go: the bytes of its rows, from the image's left edge.
pub(super) struct Band<'a> {
    pub(super) bytes: &'a mut [u8],
    /// Columns and rows of the whole image.
    pub(super) size: (u32, u32),
    /// What a pixel shows that shows nothing.
    pub(super) background: Nothing,
    /// From colours to levels.
    pub(super) tone: Tone,
}

/// A background of one colour: a level a channel, and the colour that becomes these levels, whoever writes them.
#[derive(Clone, Copy)]
pub(super) struct Nothing {
    levels: [u8; CHANNELS],
    color: [f64; CHANNELS],
}

impl Nothing {
    pub(super) fn new<E: Real>(color: DVec3, tone: Tone) -> Self {
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
    /// The colour of what shows nothing.
    #[inline(always)]
    pub(super) fn background<E: Real>(&self) -> [E; 3] {
        self.background.color.map(E::narrow)
    }
}

/// How many rays the packets of a tile of so many columns and rows have, those beyond its edges included.
#[inline(always)]
pub(super) fn rays_of<S: Simd, E: Real>((columns, rows): (u32, u32)) -> usize {
    let (width, height) = packet_shape::<S, E>();
    (columns as usize).next_multiple_of(width) * (rows as usize).next_multiple_of(height)
}

/// Nothing but background.
pub(super) fn fill(tile: Tile, band: &mut Band) {
    let stride = band.size.0 as usize * CHANNELS;
    let (from, to) = (tile.left as usize * CHANNELS, (tile.left + tile.width) as usize * CHANNELS);
    for row in band.bytes.chunks_exact_mut(stride) {
        row[from..to].as_chunks_mut().0.fill(band.background.levels);
    }
}

/// Colours to the bytes of the image.
#[inline(never)]
pub(super) fn write_pixels<S: Simd, E: Real>(simd: S, tile: Tile, colors: &Columns<E>, band: &mut Band) {
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

/// Colours to the bytes of the image, encoded by the sRGB curve.
#[inline(never)]
pub(super) fn write_encoded<S: Simd, E: Real>(tile: Tile, colors: &Columns<E>, band: &mut Band) {
    let (width, height) = packet_shape::<S, E>();
    let stride = band.size.0 as usize * CHANNELS;
    let packets_in_row = (tile.width as usize).div_ceil(width);
    for row in 0..tile.height as usize {
        for column in 0..tile.width as usize {
            let packet = row / height * packets_in_row + column / width;
            let at = packet * (width * height) + row % height * width + column % width;
            let from = row * stride + (tile.left as usize + column) * CHANNELS;
            for (byte, channel) in band.bytes[from..from + CHANNELS].iter_mut().zip(colors) {
                *byte = encoded(channel.0[at].widen());
            }
        }
    }
}

/// The three bytes of each pixel, two pixels at a time.
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

/// A level and a half a level, so that cutting off the fraction rounds; what is not a number is black.
#[inline(always)]
fn level<S: Simd, E: Real>(simd: S, channel: Lanes<S, E>) -> Lanes<S, E> {
    let (zero, one) = (constant::<S, E>(simd, 0.0), constant::<S, E>(simd, 1.0));
    let known = channel.simd_eq(channel).select(channel, zero);
    known.max(zero).min(one).mul_add(constant::<S, E>(simd, 255.0), constant::<S, E>(simd, 0.5))
}
