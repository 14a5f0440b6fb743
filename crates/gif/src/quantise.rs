//! A frame and what a viewer sees before it, to the block that turns the one into the other.
//!
//! Pixels that are as in the frame before are left alone, and so are pixels that a viewer sees right by chance. For the
//! others a palette is made. Each colour is drawn with the palette's nearest, or with a pattern of that and another
//! where the mean over the pattern is so much better that the coarser grain is worth it.
//!
//! The pattern: let `t` be a colour, drawn with `a` except for a part `f` of its pixels, which get `b`. The mean squared
//! error of the pixels is `E = (1 - f) |t - a|² + f |t - b|²`, that of a neighbourhood's mean `B = |t - (1 - f) a - f b|²`.
//! `E + BLEND B` is least at `f = p + (p - 1/2) / BLEND`, with `p = (t - a)(b - a) / |b - a|²`, cut to 0..1: plain error
//! diffusion's `p` for large `BLEND`, no pattern for small. Which pixels get `b` says a fixed threshold map, so a colour
//! that stays is drawn alike in every frame.

use image::RgbImage;

use crate::block::Block;
use crate::colour::{self, DIMENSIONS, Point};
use crate::histogram::Histogram;
use crate::palette::{Palette, Sample};

/// How much the error of a neighbourhood's mean counts against that of its pixels.
const BLEND: f32 = 1.0;

/// Turns frames into blocks, one after the other.
#[derive(Debug)]
pub(crate) struct Quantiser {
    last: Option<Last>,
    histogram: Histogram,
}

#[derive(Debug)]
struct Last {
    /// The frame before.
    frame: RgbImage,
    /// What a viewer sees of it.
    seen: RgbImage,
}

/// What colours of a bin are drawn with.
#[derive(Debug, Clone, Copy)]
struct Ink {
    plain: u8,
    other: u8,
    /// The part of pixels, in 1/256, that get `other` rather than `plain`, of the levels: `base + rgb * slope`.
    base: f32,
    slope: [f32; 3],
}

impl Quantiser {
    pub(crate) fn new() -> Self {
        Self { last: None, histogram: Histogram::new() }
    }

    /// The block that shows `frame` after all those given before.
    pub(crate) fn quantise(&mut self, frame: RgbImage, delay_cs: u16) -> Block {
        let width = frame.width() as usize;
        let pixels = frame.as_raw().as_chunks::<3>().0;
        let Some(mut last) = self.last.take() else {
            return self.first(frame, delay_cs);
        };
        let before = last.frame.as_raw().as_chunks::<3>().0;
        let (seen, _) = last.seen.as_chunks_mut::<3>();
        if let Some(colours) = few_colours(pixels) {
            let block = exact(pixels, width, seen, colours, delay_cs);
            last.frame = frame;
            self.last = Some(last);
            return block;
        }
        self.histogram.clear();
        for ((now, before), seen) in pixels.iter().zip(before).zip(&*seen) {
            if now != before && now != seen {
                self.histogram.add(*now, 1);
            }
        }
        let block = if self.histogram.bins().is_empty() {
            Block::nothing(delay_cs)
        } else {
            let palette = self.palette(255);
            let inks = self.inks(&palette);
            let clear = palette.colours.len() as u8;
            let mut indices = vec![clear; pixels.len()];
            for (at, (now, index)) in pixels.iter().zip(&mut indices).enumerate() {
                if *now != before[at] && *now != seen[at] {
                    let ink = &inks[self.histogram.find(*now).unwrap_or(0)];
                    let drawn = ink.draw(*now, at % width, at / width);
                    let colour = palette.colours[usize::from(drawn)];
                    if colour != seen[at] {
                        seen[at] = colour;
                        *index = drawn;
                    }
                }
            }
            let colours = palette.colours.iter().chain([&[0; 3]]).flatten().copied().collect();
            Block::cut(&indices, width, colours, Some(clear), delay_cs)
        };
        last.frame = frame;
        self.last = Some(last);
        block
    }

    fn first(&mut self, frame: RgbImage, delay_cs: u16) -> Block {
        let width = frame.width() as usize;
        let mut seen = frame.clone();
        let (pixels, _) = seen.as_chunks_mut::<3>();
        for now in &*pixels {
            self.histogram.add(*now, 1);
        }
        let palette = self.palette(256);
        let inks = self.inks(&palette);
        let mut indices = vec![0; pixels.len()];
        for (at, (now, index)) in pixels.iter_mut().zip(&mut indices).enumerate() {
            let ink = &inks[self.histogram.find(*now).unwrap_or(0)];
            *index = ink.draw(*now, at % width, at / width);
            *now = palette.colours[usize::from(*index)];
        }
        self.last = Some(Last { frame, seen });
        let colours = palette.colours.iter().flatten().copied().collect();
        Block::cut(&indices, width, colours, None, delay_cs)
    }

    fn palette(&self, size: usize) -> Palette {
        let samples = self.histogram.bins().iter().map(Sample::from).collect::<Vec<_>>();
        if self.histogram.is_exact() && samples.len() <= size {
            let mut colours = samples.iter().map(|s| s.rgb.map(|level| level as u8)).collect::<Vec<_>>();
            colours.sort_unstable();
            return Palette::new(colours);
        }
        Palette::of(&samples, size)
    }

    fn inks(&self, palette: &Palette) -> Vec<Ink> {
        let mut guess = 0;
        self.histogram
            .bins()
            .iter()
            .map(|bin| {
                let ink = Ink::of(&colour::point(bin.mean()), palette, guess);
                guess = ink.plain;
                ink
            })
            .collect()
    }
}

/// The colours of a frame that has at most 256.
fn few_colours(pixels: &[[u8; 3]]) -> Option<Vec<[u8; 3]>> {
    let mut colours = Vec::with_capacity(256);
    let mut last = None;
    for now in pixels {
        if last == Some(now) {
            continue;
        }
        last = Some(now);
        if let Err(at) = colours.binary_search(now) {
            if colours.len() == 256 {
                return None;
            }
            colours.insert(at, *now);
        }
    }
    Some(colours)
}

/// Draws whatever is not seen right; all of the rectangle around it if no index is left to mean nothing.
fn exact(
    pixels: &[[u8; 3]],
    width: usize,
    seen: &mut [[u8; 3]],
    frame_colours: Vec<[u8; 3]>,
    delay_cs: u16,
) -> Block {
    let mut drawn = Vec::with_capacity(256);
    for (now, seen) in pixels.iter().zip(&*seen) {
        if now != seen
            && let Err(at) = drawn.binary_search(now)
        {
            drawn.insert(at, *now);
        }
    }
    let (colours, clear) = match u8::try_from(drawn.len()) {
        Ok(clear) => (drawn, Some(clear)),
        Err(_) => (frame_colours, None),
    };
    let index = |now: &[u8; 3]| colours.binary_search(now).unwrap_or(0) as u8;
    let indices = pixels.iter().zip(seen).map(|(now, seen)| {
        let right = *now == *seen;
        *seen = *now;
        clear.filter(|_| right).unwrap_or_else(|| index(now))
    });
    let indices = indices.collect::<Vec<_>>();
    let filler = clear.map(|_| [0; 3]);
    let palette = colours.iter().chain(&filler).flatten().copied().collect();
    Block::cut(&indices, width, palette, clear, delay_cs)
}

impl Ink {
    fn of(target: &Point, palette: &Palette, guess: u8) -> Self {
        let plain = palette.nearest(target, guess);
        let a = &palette.points[usize::from(plain)];
        let mut least = (1.0 + BLEND) * colour::error(target, a);
        let mut ink = Self { plain, other: plain, base: 0.0, slope: [0.0; 3] };
        if least == 0.0 {
            return ink;
        }
        for neighbour in palette.neighbours(plain) {
            let b = &palette.points[usize::from(neighbour.index)];
            let mut along = 0.0;
            for k in 0..DIMENSIONS {
                along += (target[k] - a[k]) * (b[k] - a[k]);
            }
            let p = along / neighbour.apart;
            let f = (p + (p - 0.5) / BLEND).clamp(0.0, 1.0);
            if f == 0.0 {
                continue;
            }
            let from_a = colour::error(target, a);
            let pixels = from_a + f * (neighbour.apart - 2.0 * along);
            let mean = from_a - 2.0 * f * along + f * f * neighbour.apart;
            let cost = pixels + BLEND * mean;
            if cost < least {
                least = cost;
                ink.other = neighbour.index;
                ink.base = f * 256.0;
            }
        }
        ink
    }

    fn draw(&self, rgb: [u8; 3], x: usize, y: usize) -> u8 {
        let [r, g, b] = rgb.map(f32::from);
        let part = self.base + self.slope[0] * r + self.slope[1] * g + self.slope[2] * b;
        if part > threshold(x, y) { self.other } else { self.plain }
    }
}

/// Bayer's 8 x 8 map, at the middle of each of its 64 steps of 4.
fn threshold(x: usize, y: usize) -> f32 {
    let mut value = 0;
    for bit in 0..3 {
        let (x, y) = (x >> bit & 1, y >> bit & 1);
        value |= ((x ^ y) << 1 | y) << (2 * (2 - bit));
    }
    value as f32 * 4.0 + 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threshold_map_has_each_step_once() {
        let mut steps = (0..64).map(|k| threshold(k % 8, k / 8) as u32).collect::<Vec<_>>();
        steps.sort_unstable();
        assert!(steps.iter().enumerate().all(|(k, &step)| step == k as u32 * 4 + 2));
    }
}
