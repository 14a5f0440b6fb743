//! Frames of at most 256 colours, which lose nothing unless the picture drifts: where much of it [changes](change)
//! slightly from frame to frame, to draw all that would cost several times the bytes.

use rayon::prelude::*;

use crate::block::{Area, Block};
use crate::colour;
use crate::look::GLARING;
use crate::stripe::{self, Sheet};

/// Colours, at most 256, and their numbers in order of appearance.
#[derive(Debug)]
pub(crate) struct FewColours {
    pub(crate) colours: Vec<[u8; 3]>,
    /// Number + 1 of a colour where its hash puts it, 0 where there is none.
    slots: Box<[u16; SLOTS]>,
}

const SLOTS: usize = 1024;
/// How many pixels in a row are looked at, and of how many such rows one is, to see how a frame changes: a prime,
/// so that they are not below each other.
const PROBE: usize = 61;
const ONE_IN: usize = 4;
/// Much changes where one pixel in so many does.
const MUCH: usize = 8;
/// Parts of a frame that are looked at side by side.
const PARTS: usize = 2;

impl FewColours {
    fn new() -> Self {
        Self { colours: Vec::with_capacity(256), slots: Box::new([0; SLOTS]) }
    }

    /// The number of a colour, or the slot to put it in.
    fn find(&self, rgb: [u8; 3]) -> Result<u8, usize> {
        let key = u32::from_le_bytes([rgb[0], rgb[1], rgb[2], 0]);
        let mut at = (key.wrapping_mul(0x9E37_79B1) >> 22) as usize % SLOTS;
        loop {
            match self.slots[at] {
                0 => return Err(at),
                number if self.colours[usize::from(number) - 1] == rgb => return Ok((number - 1) as u8),
                _ => at = (at + 1) % SLOTS,
            }
        }
    }

    /// Says whether there was room.
    fn add(&mut self, rgb: [u8; 3]) -> bool {
        let Err(at) = self.find(rgb) else { return true };
        if self.colours.len() == 256 {
            return false;
        }
        self.colours.push(rgb);
        self.slots[at] = self.colours.len() as u16;
        true
    }
}

/// The colours of a frame, if there are at most 256.
pub(crate) fn few_colours(pixels: &[[u8; 3]]) -> Option<FewColours> {
    let mut colours = FewColours::new();
    let mut last = None;
    for now in pixels {
        if last != Some(now) {
            last = Some(now);
            if !colours.add(*now) {
                return None;
            }
        }
    }
    Some(colours)
}

/// What becomes of a frame in the next one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Change {
    /// Most of it stays.
    Little,
    /// Much changes, most of that by no more than a viewer may miss, as in a slow fade of a gradient.
    Slight,
    /// Much changes, and clearly.
    Large,
}

/// How a frame differs from the one before it.
pub(crate) fn change(pixels: &[[u8; 3]], before: &[[u8; 3]]) -> Change {
    let probes = pixels.chunks(PROBE).zip(before.chunks(PROBE)).step_by(ONE_IN);
    let (mut probed, mut changed, mut slightly) = (0, 0, 0);
    for (now, was) in probes {
        probed += now.len();
        for (&now, &was) in now.iter().zip(was) {
            if now != was {
                changed += 1;
                slightly += usize::from(colour::level_error(now, was) as f32 <= GLARING);
            }
        }
    }
    if changed * MUCH < probed {
        Change::Little
    } else if slightly * 4 >= changed * 3 {
        Change::Slight
    } else {
        Change::Large
    }
}

/// Draws whatever is not seen right; all of the frame if it is the first or no index is left to mean nothing.
pub(crate) fn draw(
    pixels: &[[u8; 3]],
    width: usize,
    first: bool,
    seen: &mut [[u8; 3]],
    frame_colours: &FewColours,
    delay_cs: u16,
) -> Block {
    let mut wrong = vec![false; pixels.len()];
    let part = pixels.len().div_ceil(PARTS);
    let parts = wrong.par_chunks_mut(part).zip(pixels.par_chunks(part)).zip(seen.par_chunks(part));
    let drawn = parts.map(|((wrong, pixels), seen)| {
        let mut drawn = FewColours::new();
        let mut last = None;
        for ((now, seen), wrong) in pixels.iter().zip(seen).zip(wrong) {
            *wrong = now != seen;
            if *wrong && last != Some(now) {
                last = Some(now);
                // There is room: all are colours of the frame.
                drawn.add(*now);
            }
        }
        drawn
    });
    let mut parts = drawn.collect::<Vec<_>>().into_iter();
    let mut drawn = parts.next().unwrap_or_else(FewColours::new);
    for rgb in parts.flat_map(|part| part.colours) {
        drawn.add(rgb);
    }
    let (colours, clear) = match u8::try_from(drawn.colours.len()) {
        Ok(clear) if !first => (&drawn, Some(clear)),
        _ => (frame_colours, None),
    };
    let area = match clear {
        Some(_) => Area::around(&wrong, width, |&wrong| wrong),
        None => Some(Area::whole(width, pixels.len())),
    };
    let Some(area) = area else { return Block::nothing(delay_cs) };
    let sheet = Sheet { area, width, colours: &colours.colours, clear, delay_cs, stripes: 1 };
    let (block, _) = stripe::in_stripes(sheet, seen, |writer, first_row, seen| {
        let mut last = ([0; 3], colours.find([0; 3]).ok());
        for (y, seen) in (first_row..).zip(seen.chunks_exact_mut(width)) {
            for x in area.left..area.right {
                let now = pixels[y * width + x];
                if last.0 != now {
                    last = (now, colours.find(now).ok());
                }
                // What is seen right may be drawn or left, whichever LZW knows.
                let right = clear.filter(|_| now == seen[x]);
                let index = last.1;
                match (right, index) {
                    (None, index) => writer.put(index.unwrap_or(0)),
                    (Some(clear), Some(index)) => {
                        if !writer.extend(clear) && !writer.extend(index) {
                            writer.put(clear);
                        }
                    }
                    (Some(clear), None) => writer.put(clear),
                }
                seen[x] = now;
            }
        }
    });
    block
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_are_told_apart() {
        let before = (0..10_000_u32).map(|k| [(k / 64) as u8, 10, 20]).collect::<Vec<_>>();
        let with = |part: usize, by: u8| {
            let mut now = before.clone();
            now.iter_mut().take(10_000 / part).for_each(|[_, g, _]| *g += by);
            now
        };
        assert_eq!(change(&before, &before), Change::Little);
        assert_eq!(change(&with(20, 1), &before), Change::Little);
        assert_eq!(change(&with(20, 100), &before), Change::Little);
        assert_eq!(change(&with(2, 1), &before), Change::Slight);
        assert_eq!(change(&with(2, 100), &before), Change::Large);
    }
}
