//! What the first sample of each pixel saw: the one by which most pixels are done with.

use core::ops::Range;
use std::sync::LazyLock;

use super::bits::{WORD, zeroed};
use super::pixel::{ONE, quantised};
use crate::parallel::CHANNELS;
use crate::reference::encoded;
use rayfold_scene::Tone;

/// Row by row from the top.
#[derive(Debug)]
pub(crate) struct First {
    /// [`quantised`].
    pub(super) colors: [Vec<u16>; CHANNELS],
    /// Equal numbers for equal objects; among more than 65,535 a few share one.
    objects: Vec<u16>,
}

/// The same of some rows of the image.
pub(crate) struct FirstRows<'a> {
    colors: [&'a mut [u16]; CHANNELS],
    objects: &'a mut [u16],
}

impl First {
    /// `None` where there is no memory for it.
    pub(super) fn new(pixels: usize) -> Option<Self> {
        let plane = || zeroed(pixels);
        Some(Self { colors: [plane()?, plane()?, plane()?], objects: plane()? })
    }

    /// The colours of pixels that lie side by side.
    #[inline(always)]
    pub(super) fn run(&self, places: Range<usize>) -> impl Iterator<Item = [u16; CHANNELS]> {
        let [red, green, blue] = self.colors.each_ref().map(|plane| &plane[places.clone()]);
        red.iter().zip(green).zip(blue).map(|((&red, &green), &blue)| [red, green, blue])
    }

    /// In bands of so many pixels.
    pub(super) fn bands(&mut self, pixels: usize) -> impl Iterator<Item = FirstRows<'_>> {
        let [red, green, blue] = &mut self.colors;
        let colors = red.chunks_mut(pixels).zip(green.chunks_mut(pixels)).zip(blue.chunks_mut(pixels));
        colors
            .zip(self.objects.chunks_mut(pixels))
            .map(|(((red, green), blue), objects)| FirstRows { colors: [red, green, blue], objects })
    }

    /// Which pixels of some rows see another object than one beside them, or a channel that differs from it by more than
    /// `limit`, in parts of [`ONE`] as they are shown: a bit each, in words.
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
        let band = Band { colors, objects, width, limit };
        let mut flags = vec![0; width];
        for (row, words) in rows.clone().zip(into.chunks_exact_mut(width.div_ceil(WORD))) {
            flags.fill(0);
            for other in row.saturating_sub(1)..(row + 2).min(all) {
                band.mark(&mut flags, row - top, other - top);
            }
            for (word, flags) in words.iter_mut().zip(flags.chunks(WORD)) {
                *word = packed(flags);
            }
        }
    }
}

/// At most 64 flags of 0 or 1 as bits, the first the lowest.
fn packed(flags: &[u8]) -> u64 {
    let mut word = 0;
    for (k, flags) in flags.chunks(8).enumerate() {
        let mut eight = [0; 8];
        eight[..flags.len()].copy_from_slice(flags);
        // The product has flag k, which is bit 8 k, at bit 56 + k, and nothing carries into there.
        let bits = u64::from_le_bytes(eight).wrapping_mul(0x0102_0408_1020_4080) >> 56;
        word |= bits << (8 * k);
    }
    word
}

/// The sRGB curve of each [`quantised`] channel.
static SHOWN: LazyLock<Vec<u16>> = LazyLock::new(|| {
    (0..=u16::MAX).map(|channel| quantised(encoded(f64::from(channel) / ONE)) as u16).collect()
});

struct Band<'a> {
    colors: [&'a [u16]; CHANNELS],
    objects: &'a [u16],
    width: usize,
    limit: u16,
}

impl Band<'_> {
    /// Marks the pixels of a row that differ from those of another in the same column or one beside it.
    fn mark(&self, flags: &mut [u8], row: usize, other: usize) {
        let last = self.width - 1;
        let (row, other) = (row * self.width, other * self.width);
        self.mark_run(flags, row, other);
        self.mark_run(&mut flags[..last], row, other + 1);
        self.mark_run(&mut flags[1..], row + 1, other);
    }

    /// The pixels from one place on beside those from another on.
    fn mark_run(&self, flags: &mut [u8], from: usize, other: usize) {
        let count = flags.len();
        let [red, green, blue] =
            self.colors.map(|plane| (&plane[from..from + count], &plane[other..other + count]));
        let objects = (&self.objects[from..from + count], &self.objects[other..other + count]);
        let limit = self.limit;
        for (k, flag) in flags.iter_mut().enumerate() {
            let differs = (red.0[k].abs_diff(red.1[k]) > limit)
                | (green.0[k].abs_diff(green.1[k]) > limit)
                | (blue.0[k].abs_diff(blue.1[k]) > limit)
                | (objects.0[k] != objects.1[k]);
            *flag |= u8::from(differs);
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
            let flags: Vec<u8> = (0..dice.usize(0..=WORD)).map(|_| u8::from(dice.bool())).collect();
            let expected = flags.iter().rev().fold(0, |word, &flag| word << 1 | u64::from(flag));
            assert_eq!(packed(&flags), expected, "{flags:?}");
        }
    }
}
