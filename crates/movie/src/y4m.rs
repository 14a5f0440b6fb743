//! YUV4MPEG2: raw frames with a line of text before each, which every video encoder reads from a pipe.
//!
//! Colours are Y'CbCr by ITU-R BT.601 in the limited range (luma 16 to 235, chroma 16 to 240), with one sample of each
//! per pixel (4:4:4). Programs that read only the size from the header assume this. `XCOLORRANGE` states the range for
//! other programs. The header cannot name the matrix.

use std::io::{self, Write};

use image::RgbImage;

use crate::rate::fraction;

/// The number of fixed-point units in 1.
const ONE: i32 = 1 << 16;

/// The factors from R', G' and B' levels to Y', Cb and Cr, in fixed-point units, and the values at black. They are
/// those of BT.601, with weights .299, .587 and .114, scaled to 219 and 224 levels.
const MATRIX: [([i32; 3], i32); 3] =
    [([16_829, 33_039, 6_416], 16), ([-9_714, -19_071, 28_785], 128), ([28_784, -24_103, -4_681], 128)];

/// A writer of frames.
#[derive(Debug)]
pub(crate) struct Y4m<W> {
    out: W,
    planes: Vec<u8>,
}

impl<W: Write> Y4m<W> {
    /// Starts a file with this number of columns and rows, at this frame rate.
    ///
    /// # Errors
    /// The writer's.
    pub(crate) fn new(mut out: W, size: (u32, u32), fps: f64) -> io::Result<Self> {
        let ((width, height), (frames, seconds)) = (size, fraction(fps));
        writeln!(out, "YUV4MPEG2 W{width} H{height} F{frames}:{seconds} Ip A1:1 C444 XCOLORRANGE=LIMITED")?;
        Ok(Self { out, planes: Vec::new() })
    }

    /// Continues a file after its header or a frame.
    pub(crate) fn resume(out: W) -> Self {
        Self { out, planes: Vec::new() }
    }

    /// Writes the next frame, which has the size of the others.
    ///
    /// # Errors
    /// The writer's.
    pub(crate) fn push(&mut self, frame: &RgbImage) -> io::Result<()> {
        self.planes.clear();
        for row in &MATRIX {
            self.planes.extend(frame.pixels().map(|pixel| level(row, pixel.0)));
        }
        self.out.write_all(b"FRAME\n")?;
        self.out.write_all(&self.planes)
    }

    /// # Errors
    /// The writer's.
    pub(crate) fn finish(mut self) -> io::Result<()> {
        self.out.flush()
    }
}

fn level((weights, black): &([i32; 3], i32), rgb: [u8; 3]) -> u8 {
    let sum: i32 = weights.iter().zip(rgb).map(|(weight, level)| weight * i32::from(level)).sum();
    (black + ((sum + ONE / 2) >> 16)).clamp(0, 255) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_fractions() {
        let mut header = Vec::new();
        Y4m::new(&mut header, (4, 3), 30_000.0 / 1_001.0).unwrap();
        assert!(header.starts_with(b"YUV4MPEG2 W4 H3 F30000:1001 "));
    }

    /// Values of ITU-R BT.601 for black, white, and the primary colours at full saturation.
    #[test]
    fn colours_are_those_of_the_recommendation() {
        let known = [
            ([0, 0, 0], [16, 128, 128]),
            ([255, 255, 255], [235, 128, 128]),
            ([255, 0, 0], [81, 90, 240]),
            ([0, 255, 0], [145, 54, 34]),
            ([0, 0, 255], [41, 240, 110]),
        ];
        for (rgb, ycc) in known {
            assert_eq!(MATRIX.each_ref().map(|row| level(row, rgb)), ycc, "{rgb:?}");
        }
        for grey in 0..=255 {
            assert_eq!(
                MATRIX.each_ref().map(|row| level(row, [grey; 3]))[1..],
                [128, 128],
                "grey has no colour"
            );
        }
    }
}
