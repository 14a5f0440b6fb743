//! Lossless drawing of frames of at most 256 colours.
//!
//! Large frames that drift are an exception: much of the picture [changes](change) slightly from frame to
//! frame. Drawing all of that would cost several times the bytes. So these are drawn like frames of more
//! colours, and no pixel is off by more than [a few levels](crate::bound::DRIFTING). In small frames the saving
//! is not worth the error.

use rayon::prelude::*;

use crate::block::{Area, Block};
use crate::colour;
use crate::stripe::{self, Layout};
use crate::update_map::MAX_SKIPPED_ERROR;

/// At most 256 colours, numbered in order of appearance.
#[derive(Debug)]
pub(crate) struct FewColours {
    pub(crate) colours: Vec<[u8; 3]>,
    /// A hash table: the number of a colour plus 1, or 0 in an empty slot.
    slots: Box<[u16; SLOTS]>,
}

const SLOTS: usize = 1024;
/// The length of the runs of pixels by which the change of a frame is sampled. One run in `ONE_IN` is compared. The
/// length is a prime, so that the runs of successive rows do not lie below each other.
const PROBE: usize = 61;
const ONE_IN: usize = 4;
/// Much of a frame changes if one pixel in this many does.
const MUCH: usize = 8;
/// Only frames of more pixels than this may drift.
const LARGE: usize = 100_000;
/// The number of parts of a frame that are compared in parallel.
const PARTS: usize = 2;

impl FewColours {
    fn new() -> Self {
        Self { colours: Vec::with_capacity(256), slots: Box::new([0; SLOTS]) }
    }

    /// Returns the number of a colour, or the slot where it belongs.
    pub(crate) fn find(&self, rgb: [u8; 3]) -> Result<u8, usize> {
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

    /// Adds a colour unless it is there already. Returns whether there was room for it.
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

/// Returns the colours of a frame, or `None` if there are more than 256.
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

/// The amount by which a frame differs from the one before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Change {
    /// Most of the frame stays.
    Little,
    /// Much changes, but most of it by so little that a viewer may miss it, as in a slow fade of a gradient.
    Slight,
    /// Much changes by more than that.
    Large,
}

/// Compares a frame with the one before it.
fn change(pixels: &[[u8; 3]], before: &[[u8; 3]]) -> Change {
    let probes = pixels.chunks(PROBE).zip(before.chunks(PROBE)).step_by(ONE_IN);
    let (mut probed, mut changed, mut slightly) = (0, 0, 0);
    for (now, was) in probes {
        probed += now.len();
        for (&now, &was) in now.iter().zip(was) {
            if now != was {
                changed += 1;
                slightly += usize::from(colour::level_error(now, was) as f32 <= MAX_SKIPPED_ERROR);
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

/// The properties of a frame that decide how it is drawn.
#[derive(Debug)]
pub(crate) struct Kind {
    /// The colours of the frame if it is drawn without loss.
    pub(crate) few: Option<FewColours>,
    /// The frame has at most 256 colours but drifts, so it is drawn like frames of more.
    pub(crate) drifts: bool,
    pub(crate) change: Change,
}

impl Kind {
    /// Classifies a frame. `previous`: the pixels of the frame before it, and whether that one drifts.
    /// `exact`: no frame drifts.
    pub(crate) fn of(pixels: &[[u8; 3]], previous: Option<(&[[u8; 3]], bool)>, exact: bool) -> Self {
        let few = few_colours(pixels);
        let change = match previous {
            Some((before, _)) if few.is_some() && !exact && pixels.len() > LARGE => change(pixels, before),
            _ => Change::Large,
        };
        let drifts = match change {
            Change::Little => previous.is_some_and(|(_, drifts)| drifts),
            Change::Slight => true,
            Change::Large => false,
        };
        Self { few: few.filter(|_| !drifts), drifts, change }
    }
}

/// The largest palette of a file: an index is left for transparent.
const MAX_OF_FILE: usize = 255;

/// Returns the palette of a file, which its first frame decides; `None` if that has too many colours.
pub(crate) fn palette_of_file(first: &[[u8; 3]]) -> Option<FewColours> {
    few_colours(first).filter(|few| few.colours.len() <= MAX_OF_FILE)
}

/// Draws the pixels whose seen colour is wrong. Draws all of the frame if it is the first, or if no index
/// is left for transparent. A block uses the palette of the file if that makes the file smaller.
pub(crate) fn draw(
    pixels: &[[u8; 3]],
    width: usize,
    first: bool,
    seen: &mut [[u8; 3]],
    frame_colours: &FewColours,
    of_file: Option<&FewColours>,
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
                // There is always room, because all are colours of the frame.
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
    let (colours, transparent) = match u8::try_from(drawn.colours.len()) {
        Ok(transparent) if !first => (&drawn, Some(transparent)),
        _ => (frame_colours, None),
    };
    let area = match transparent {
        Some(_) => Area::around(&wrong, width, |&wrong| wrong),
        None => Some(Area::whole(width, pixels.len())),
    };
    let Some(area) = area else { return Block::nothing(delay_cs) };
    if first && of_file.is_some() {
        // The palette of the file is just that of its first frame.
        return block(pixels, width, area, seen, colours, transparent, delay_cs).of_file();
    }
    let of_file = of_file.filter(|of_file| {
        transparent.is_some() && colours.colours.iter().all(|rgb| of_file.find(*rgb).is_ok())
    });
    let with_file = of_file.map(|of_file| {
        let index = of_file.colours.len() as u8;
        block(pixels, width, area, &mut seen.to_vec(), of_file, Some(index), delay_cs).of_file()
    });
    let own = block(pixels, width, area, seen, colours, transparent, delay_cs);
    match with_file {
        Some(with_file) if with_file.bytes() <= own.bytes() => with_file,
        _ => own,
    }
}

/// Draws a block of a frame with these colours.
fn block(
    pixels: &[[u8; 3]],
    width: usize,
    area: Area,
    seen: &mut [[u8; 3]],
    colours: &FewColours,
    transparent: Option<u8>,
    delay_cs: u16,
) -> Block {
    let layout = Layout { area, width, colours: &colours.colours, transparent, delay_cs, stripes: 1 };
    let (block, _) = stripe::in_stripes(layout, seen, |writer, first_row, seen| {
        let mut last = ([0; 3], colours.find([0; 3]).ok());
        for (y, seen) in (first_row..).zip(seen.chunks_exact_mut(width)) {
            for x in area.left..area.right {
                let now = pixels[y * width + x];
                if last.0 != now {
                    last = (now, colours.find(now).ok());
                }
                // A pixel that is seen right may be drawn or left. The choice is what continues the string.
                let right = transparent.filter(|_| now == seen[x]);
                let index = last.1;
                match (right, index) {
                    (None, index) => writer.put(index.unwrap_or(0)),
                    (Some(transparent), Some(index)) => {
                        if !writer.extend(transparent) && !writer.extend(index) {
                            writer.put(transparent);
                        }
                    }
                    (Some(transparent), None) => writer.put(transparent),
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

    #[test]
    fn a_frame_drifts_from_the_first_slight_change_to_the_next_large_one() {
        let colours =
            |by: u32| (0..=LARGE as u32).map(|k| [((k + by) / 640) as u8, 10, 20]).collect::<Vec<_>>();
        let kind = |previous: Option<(u32, bool)>, now: u32, exact: bool| {
            let before = previous.map(|(by, drifts)| (colours(by), drifts));
            let before = before.as_ref().map(|(before, drifts)| (&before[..], *drifts));
            let kind = Kind::of(&colours(now), before, exact);
            (kind.few.is_some(), kind.drifts)
        };
        assert_eq!(kind(None, 0, false), (true, false));
        assert_eq!(kind(Some((0, false)), 0, false), (true, false));
        assert_eq!(kind(Some((0, false)), 640, false), (false, true));
        assert_eq!(kind(Some((0, false)), 640, true), (true, false));
        assert_eq!(kind(Some((640, true)), 640, false), (false, true));
        assert_eq!(kind(Some((640, true)), 640 * 90, false), (true, false));
        // A frame of many colours never drifts, whatever came before.
        let many = (0..300_u32).map(|k| [k as u8, (k / 256) as u8, 0]).collect::<Vec<_>>();
        let kind = Kind::of(&many, Some((&many, true)), false);
        assert!(kind.few.is_none() && !kind.drifts);
    }

    #[test]
    fn a_small_frame_does_not_drift() {
        let colours =
            |by: u32| (0..LARGE as u32).map(|k| [((k + by) / 640) as u8, 10, 20]).collect::<Vec<_>>();
        let kind = Kind::of(&colours(640), Some((&colours(0), false)), false);
        assert!(kind.few.is_some() && !kind.drifts);
    }
}
