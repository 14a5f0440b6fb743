//! The frames of an animated WebP, as they are shown: RFC 9649, sections 2.7.1 and 2.7.1.1.
//!
//! `image-webp` decodes the picture of each frame. This module composes the frames, because that crate (0.2.4) keeps
//! frames that are to be disposed of, and blends one level too dark. As in browsers, the canvas begins transparent and
//! a disposed frame leaves it so, whatever background colour the file suggests.

use std::io::Cursor;

use anyhow::{Context, ensure};
use image::{Rgba, RgbaImage};
use image_webp::WebPDecoder;

/// The lengths of the header of the file and of that of a chunk.
const FILE_HEADER: usize = 12;
const CHUNK_HEADER: usize = 8;

/// The length of the fields of a frame, before its picture.
const FRAME_HEADER: usize = 16;

/// Flags of a frame.
const DISPOSES: u8 = 1;
const OVERWRITES: u8 = 2;

/// The flag of a picture with alpha in a chunk of its own.
const ALPHA: u8 = 1 << 4;

/// A reader of frames.
pub(super) struct Frames {
    bytes: Vec<u8>,
    /// The offset of the next chunk.
    at: usize,
    canvas: RgbaImage,
    /// The frame that is removed before the next one is shown.
    disposed: Option<Place>,
}

/// The place of a frame on the canvas: left, top, width and height.
#[derive(Clone, Copy)]
struct Place([u32; 4]);

impl Frames {
    /// Starts from the bytes of a file, and the columns and rows in its header.
    pub(super) fn new(bytes: Vec<u8>, (width, height): (u32, u32)) -> Self {
        Self { bytes, at: FILE_HEADER, canvas: RgbaImage::new(width, height), disposed: None }
    }

    /// Returns the canvas with the next frame, and the frame's milliseconds; `None` after the last frame.
    ///
    /// # Errors
    /// When the frame is cut off, faulty, or beyond the canvas.
    pub(super) fn next(&mut self) -> anyhow::Result<Option<(RgbaImage, u32)>> {
        while let Some((kind, from, length)) = chunk(&self.bytes, self.at) {
            self.at = from + length + length % 2;
            if kind == *b"ANMF" {
                return self.show(from, length).map(Some);
            }
        }
        Ok(None)
    }

    fn show(&mut self, from: usize, length: usize) -> anyhow::Result<(RgbaImage, u32)> {
        let frame = self.bytes.get(from..from + length).context("a frame is cut off")?;
        let (numbers, picture) = frame.split_at_checked(FRAME_HEADER).context("a frame is cut off")?;
        let number = |k: usize| u32::from_le_bytes([numbers[k], numbers[k + 1], numbers[k + 2], 0]);
        let place @ Place([left, top, width, height]) =
            Place([2 * number(0), 2 * number(3), number(6) + 1, number(9) + 1]);
        ensure!(
            left + width <= self.canvas.width() && top + height <= self.canvas.height(),
            "a frame of {width} x {height} pixels at {left}, {top} is beyond the picture"
        );
        let (ms, flags) = (number(12), numbers[15]);
        let picture = decode(picture, (width, height))?;
        if let Some(Place([left, top, width, height])) = self.disposed.take() {
            for y in top..top + height {
                (left..left + width).for_each(|x| self.canvas.put_pixel(x, y, Rgba([0; 4])));
            }
        }
        for (x, y, &pixel) in picture.enumerate_pixels() {
            let below = self.canvas.get_pixel_mut(left + x, top + y);
            *below = if flags & OVERWRITES != 0 { pixel } else { blended(pixel, *below) };
        }
        self.disposed = (flags & DISPOSES != 0).then_some(place);
        Ok((self.canvas.clone(), ms))
    }
}

/// Returns the kind of the chunk at an offset, the start of its data, and their length.
fn chunk(bytes: &[u8], at: usize) -> Option<([u8; 4], usize, usize)> {
    let header = bytes.get(at..at + CHUNK_HEADER)?;
    let (kind, length) = header.split_first_chunk()?;
    let length = u32::from_le_bytes(length.try_into().ok()?);
    Some((*kind, at + CHUNK_HEADER, length as usize))
}

/// Decodes the chunks of a frame's picture, as a file of their own.
fn decode(chunks: &[u8], (width, height): (u32, u32)) -> anyhow::Result<RgbaImage> {
    let mut file = b"RIFF\0\0\0\0WEBP".to_vec();
    if chunks.starts_with(b"ALPH") {
        file.extend(b"VP8X\x0a\0\0\0");
        file.extend([ALPHA, 0, 0, 0]);
        for side in [width, height] {
            file.extend(&(side - 1).to_le_bytes()[..3]);
        }
    }
    file.extend(chunks);
    let length = u32::try_from(file.len() - CHUNK_HEADER).context("a frame is larger than 4 GB")?;
    file[4..8].copy_from_slice(&length.to_le_bytes());
    let mut decoder = WebPDecoder::new(Cursor::new(file))?;
    ensure!(
        decoder.dimensions() == (width, height),
        "a frame of {width} x {height} pixels has a picture of another size"
    );
    let mut pixels = vec![0; decoder.output_buffer_size().context("a frame is too large")?];
    decoder.read_image(&mut pixels)?;
    if !decoder.has_alpha() {
        pixels =
            pixels.as_chunks().0.iter().flat_map(|&[red, green, blue]| [red, green, blue, 255]).collect();
    }
    RgbaImage::from_raw(width, height, pixels).context("a frame lacks pixels")
}

/// Puts a pixel over another; their colours are not multiplied by alpha (RFC 9649, "blending method"). Rounds to the
/// nearest level.
fn blended(above: Rgba<u8>, below: Rgba<u8>) -> Rgba<u8> {
    let [over, under] = [above, below].map(|pixel| u32::from(pixel.0[3]));
    match over {
        255 => return above,
        0 => return below,
        _ => {}
    }
    // In parts of 255².
    let (own, rest) = (255 * over, under * (255 - over));
    let alpha = own + rest;
    let channel = |k: usize| {
        let sum = u32::from(above.0[k]) * own + u32::from(below.0[k]) * rest;
        ((sum + alpha / 2) / alpha) as u8
    };
    Rgba([channel(0), channel(1), channel(2), ((alpha + 127) / 255) as u8])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opaque_and_clear_pixels_stay_as_they_are() {
        let below = Rgba([255, 254, 1, 255]);
        assert_eq!(blended(Rgba([9, 8, 7, 255]), below), Rgba([9, 8, 7, 255]));
        assert_eq!(blended(Rgba([9, 8, 7, 0]), below), below);
        assert_eq!(blended(Rgba([255, 254, 1, 77]), below), below, "a colour over itself");
        assert_eq!(blended(Rgba([100, 0, 0, 51]), Rgba([0, 0, 0, 0])), Rgba([100, 0, 0, 51]));
    }

    /// Computed by hand: half red over half blue has a cover of 3/4, of which 2/3 is red.
    #[test]
    fn halves_are_mixed_by_their_cover() {
        assert_eq!(blended(Rgba([255, 0, 0, 128]), Rgba([0, 0, 255, 128])), Rgba([170, 0, 85, 192]));
    }
}
