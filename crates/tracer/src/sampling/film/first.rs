//! The first sample of each pixel. Most pixels get no other.

use core::ops::Range;
use std::sync::LazyLock;

use fearless_simd::{Level, dispatch};

use super::bits::{WORD, zeroed};
use super::pixel::{ONE, quantised};
use crate::parallel::CHANNELS;
use crate::reference::encoded;
use rayfold_scene::Tone;

/// The samples, row by row from the top.
#[derive(Debug)]
pub(crate) struct First {
    /// [`quantised`].
    pub(super) colors: [Vec<u16>; CHANNELS],
    /// Numbers of objects, equal for equal objects. Among more than 65,535 objects, some share a number.
    pub(super) objects: Vec<u16>,
}

/// The first samples of some rows of the image.
pub(crate) struct FirstRows<'a> {
    colors: [&'a mut [u16]; CHANNELS],
    objects: &'a mut [u16],
}

impl First {
    /// Returns `None` if there is not enough memory.
    pub(super) fn new(pixels: usize) -> Option<Self> {
        let plane = || zeroed(pixels);
        Some(Self { colors: [plane()?, plane()?, plane()?], objects: plane()? })
    }

    /// Returns the colours of consecutive pixels of a row.
    #[inline(always)]
    pub(super) fn run(&self, places: Range<usize>) -> impl Iterator<Item = [u16; CHANNELS]> {
        let [red, green, blue] = self.colors.each_ref().map(|plane| &plane[places.clone()]);
        red.iter().zip(green).zip(blue).map(|((&red, &green), &blue)| [red, green, blue])
    }

    /// Returns the samples in bands of `pixels` pixels.
    pub(super) fn bands(&mut self, pixels: usize) -> impl Iterator<Item = FirstRows<'_>> {
        let [red, green, blue] = &mut self.colors;
        let colors = red.chunks_mut(pixels).zip(green.chunks_mut(pixels)).zip(blue.chunks_mut(pixels));
        colors
            .zip(self.objects.chunks_mut(pixels))
            .map(|(((red, green), blue), objects)| FirstRows { colors: [red, green, blue], objects })
    }

    /// Sets a bit in `words` for each pixel of some rows that contrasts with a neighbour: it shows another object, or
    /// one of its channels differs by more than `limit`, as displayed, in parts of [`ONE`].
    pub(super) fn contrasts(
        &self,
        width: usize,
        rows: Range<usize>,
        (limit, tone): (u16, Tone),
        into: &mut [u64],
    ) {
        let all = self.objects.len() / width;
        // With the rows above and below.
        let top = rows.start.saturating_sub(1);
        let with_neighbours = top * width..(rows.end + 1).min(all) * width;
        let objects = &self.objects[with_neighbours.clone()];
        let converted;
        let linear = self.colors.each_ref().map(|plane| &plane[with_neighbours.clone()]);
        let colors = match tone {
            Tone::Plain => linear,
            Tone::Srgb => {
                let shown: &[u16] = &SHOWN;
                converted = linear.map(|plane| {
                    plane.iter().map(|&channel| shown[usize::from(channel)]).collect::<Vec<u16>>()
                });
                converted.each_ref().map(Vec::as_slice)
            }
        };
        let band = Band { colors, objects, limit };
        let (mut flags, mut apart) = (vec![0; objects.len()], vec![0; width]);
        let inner = (rows.start - top) * width;
        // With the machine's widest instructions: the comparisons are the same with any.
        dispatch!(Level::new(), _simd => {
            for row in (0..objects.len()).step_by(width) {
                band.mark(&mut flags, &mut apart[1..], (row, row + 1));
                let below = row + width;
                if below < objects.len() {
                    band.mark(&mut flags, &mut apart, (row, below));
                    band.mark(&mut flags, &mut apart[1..], (row, below + 1));
                    band.mark(&mut flags, &mut apart[1..], (row + 1, below));
                }
            }
            let words = into.chunks_exact_mut(width.div_ceil(WORD));
            for (words, flags) in words.zip(flags[inner..].chunks_exact(width)) {
                for (word, flags) in words.iter_mut().zip(flags.chunks(WORD)) {
                    *word |= packed(flags);
                }
            }
        });
    }

    /// Writes the nearest of 256 levels of consecutive pixels of a row, without any curve.
    #[inline(always)]
    pub(super) fn put_levels(&self, places: Range<usize>, bytes: &mut [u8]) {
        let [red, green, blue] = self.colors.each_ref().map(|plane| &plane[places.clone()]);
        let (pixels, _) = bytes.as_chunks_mut::<CHANNELS>();
        for (pixel, ((&red, &green), &blue)) in pixels.iter_mut().zip(red.iter().zip(green).zip(blue)) {
            *pixel = [level(red), level(green), level(blue)];
        }
    }
}

/// Returns the nearest of 256 levels of a [`quantised`] channel. That has 65,536 levels, of which 257 make one step.
#[inline(always)]
pub(super) const fn level(channel: u16) -> u8 {
    ((channel as u32 * 255 + 32_895) >> 16) as u8
}

/// Returns at most 64 flags as bits, the first flag as the lowest bit. A bit is set if its flag is not zero.
#[inline(always)]
fn packed(flags: &[u16]) -> u64 {
    let mut set = [0; WORD];
    for (set, &flag) in set.iter_mut().zip(flags) {
        *set = u8::from(flag != 0);
    }
    let (eights, _) = set.as_chunks::<8>();
    // Each product has flag k, which is bit 8 k, at bit 56 + k, and nothing carries into there.
    let bits =
        eights.iter().map(|eight| u64::from_le_bytes(*eight).wrapping_mul(0x0102_0408_1020_4080) >> 56);
    bits.enumerate().fold(0, |word, (k, bits)| word | bits << (8 * k))
}

/// The sRGB curve of each [`quantised`] channel.
static SHOWN: LazyLock<Vec<u16>> = LazyLock::new(|| {
    (0..=u16::MAX).map(|channel| quantised(encoded(f64::from(channel) / ONE)) as u16).collect()
});

/// Rows of a picture.
struct Band<'a> {
    colors: [&'a [u16]; CHANNELS],
    objects: &'a [u16],
    limit: u16,
}

impl Band<'_> {
    /// Marks the pixels, from two places on, that differ from each other, for as many pixels as `apart` has room for.
    #[inline(always)]
    fn mark(&self, flags: &mut [u16], apart: &mut [u16], places: (usize, usize)) {
        let runs = [places.0, places.1].map(|place| place..place + apart.len());
        let [[red, green, blue], [red_2, green_2, blue_2]] =
            runs.each_ref().map(|run| self.colors.map(|plane| &plane[run.clone()]));
        let [objects, objects_2] = runs.each_ref().map(|run| &self.objects[run.clone()]);
        // Not zero where they differ by more than the limit.
        let beyond = |a: u16, b: u16| a.abs_diff(b).saturating_sub(self.limit);
        for (k, apart) in apart.iter_mut().enumerate() {
            let colors = beyond(red[k], red_2[k]) | beyond(green[k], green_2[k]) | beyond(blue[k], blue_2[k]);
            *apart = colors | objects[k] ^ objects_2[k];
        }
        for place in [places.0, places.1] {
            for (flag, apart) in flags[place..].iter_mut().zip(&*apart) {
                *flag |= apart;
            }
        }
    }
}

impl FirstRows<'_> {
    #[inline(always)]
    pub(crate) fn put(&mut self, place: usize, color: [u32; CHANNELS], object: u32) {
        for (plane, channel) in self.colors.iter_mut().zip(color) {
            plane[place] = channel as u16;
        }
        self.objects[place] = object as u16;
    }

    /// Stores the first samples of consecutive pixels of a row.
    #[inline(always)]
    pub(crate) fn put_run(&mut self, place: usize, colors: [&[u32]; CHANNELS], objects: &[u32]) {
        let put = |plane: &mut [u16], of: &[u32]| {
            plane[place..place + of.len()].iter_mut().zip(of).for_each(|(into, &of)| *into = of as u16);
        };
        self.colors.iter_mut().zip(colors).for_each(|(plane, levels)| put(plane, levels));
        put(self.objects, objects);
    }

    #[inline(always)]
    pub(crate) fn color(&self, place: usize) -> [u32; CHANNELS] {
        self.colors.each_ref().map(|plane| u32::from(plane[place]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_become_bits() {
        let mut dice = fastrand::Rng::with_seed(4);
        for _ in 0..1000 {
            let flags: Vec<u16> = (0..dice.usize(0..=WORD)).map(|_| dice.u16(..) * dice.u16(..2)).collect();
            let expected = flags.iter().rev().fold(0, |word, &flag| word << 1 | u64::from(flag != 0));
            assert_eq!(packed(&flags), expected, "{flags:?}");
        }
    }
}
