//! Frames of at most 256 colours, which lose nothing.

use crate::block::Block;

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
    for (now, seen) in pixels.iter().zip(&*seen) {
        if now != seen
            && let Err(at) = drawn.binary_search(now)
        {
            drawn.insert(at, *now);
        }
    }
    let (colours, clear) = match u8::try_from(drawn.len()) {
        Ok(clear) if !first => (drawn, Some(clear)),
        _ => (frame_colours, None),
    };
    let index = |now: &[u8; 3]| colours.binary_search(now).unwrap_or(0) as u8;
    let indices = pixels.iter().zip(seen).map(|(now, seen)| {
        let right = *now == *seen;
        *seen = *now;
        clear.filter(|_| right).unwrap_or_else(|| index(now))
    });
    Block::cut(indices.collect(), width, &colours, clear, delay_cs)
}
