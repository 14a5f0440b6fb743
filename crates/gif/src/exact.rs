//! Frames of at most 256 colours, which lose nothing.

use crate::block::{Area, Block};
use crate::stripe;

/// The colours of a frame in order, if there are at most 256.
pub(crate) fn few_colours(pixels: &[[u8; 3]]) -> Option<Vec<[u8; 3]>> {
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

/// Draws whatever is not seen right; all of the frame if it is the first or no index is left to mean nothing.
pub(crate) fn draw(
    pixels: &[[u8; 3]],
    width: usize,
    first: bool,
    seen: &mut [[u8; 3]],
    frame_colours: Vec<[u8; 3]>,
    delay_cs: u16,
) -> Block {
    let mut drawn = Vec::with_capacity(256);
    let mut wrong = vec![false; pixels.len()];
    let mut last = None;
    for ((now, seen), wrong) in pixels.iter().zip(&*seen).zip(&mut wrong) {
        *wrong = now != seen;
        if *wrong && last != Some(now) {
            last = Some(now);
            if let Err(at) = drawn.binary_search(now) {
                drawn.insert(at, *now);
            }
        }
    }
    let (colours, clear) = match u8::try_from(drawn.len()) {
        Ok(clear) if !first => (drawn, Some(clear)),
        _ => (frame_colours, None),
    };
    let area = match clear {
        Some(_) => Area::around(&wrong, width, |&wrong| wrong),
        None => Some(Area::whole(width, pixels.len())),
    };
    let Some(area) = area else { return Block::nothing(delay_cs) };
    let (block, _) =
        stripe::in_stripes(area, width, seen, &colours, clear, delay_cs, |writer, first_row, seen| {
            let mut last = ([0; 3], colours.binary_search(&[0; 3]).ok());
            for (y, seen) in (first_row..).zip(seen.chunks_exact_mut(width)) {
                for x in area.left..area.right {
                    let now = pixels[y * width + x];
                    if last.0 != now {
                        last = (now, colours.binary_search(&now).ok());
                    }
                    // What is seen right may be drawn or left, whichever LZW knows.
                    let right = clear.filter(|_| now == seen[x]);
                    let index = last.1.map(|index| index as u8);
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
