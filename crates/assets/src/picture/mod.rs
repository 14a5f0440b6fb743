//! Pictures: levels in rows, whatever the format of the file.

mod decode;
mod exr;
mod hdr;
mod jpeg;
mod size;

use std::array;
use std::sync::{LazyLock, OnceLock};

use glam::DVec3;
use image::metadata::Orientation;

pub(crate) use decode::decode;
pub use jpeg::jpeg_fault;

use crate::error::AssetError;
use crate::srgb::decoded;

/// A picture. Its rows go down from its top, its columns from its left edge to the right.
#[derive(Debug)]
pub struct Picture {
    /// The columns and rows as the file has them, before it is turned.
    stored: [u32; 2],
    levels: Levels,
    orientation: Orientation,
    /// The largest level.
    largest: f64,
    warnings: Vec<String>,
    is_opaque: OnceLock<bool>,
}

/// The levels in the order of the file, a few numbers for each pixel.
#[derive(Debug)]
enum Levels {
    /// Encoded levels of 8 bits, with 1 to 4 numbers for each pixel: grey or colours, then alpha if their number is even.
    Bytes(usize, Vec<u8>),
    /// Encoded levels of 16 bits.
    Words(usize, Vec<u16>),
    /// Light: red, green and blue with a common exponent.
    Shared(Vec<[u8; 4]>),
    /// Light as finite numbers of at least 0.
    Floats(Vec<[f32; 3]>),
}

/// The linear light of each encoded level.
static BYTES: LazyLock<[f64; 256]> = LazyLock::new(|| array::from_fn(|level| linear(level, 255)));
static WORDS: LazyLock<Vec<f64>> = LazyLock::new(|| (0..=65535).map(|level| linear(level, 65535)).collect());

/// Each encoded level of 8 bits as a share of the largest.
static SHARES: [f64; 256] = {
    let mut shares = [0.0; 256];
    let mut level = 0;
    while level < 256 {
        shares[level] = level as f64 * (1.0 / 255.0);
        level += 1;
    }
    shares
};

fn linear(level: usize, most: u32) -> f64 {
    decoded(level as f64 / f64::from(most))
}

/// Returns a picture if it can lie on a surface: if its levels are from 0 to 1.
pub(crate) fn surface(name: &str, picture: Picture) -> Result<Picture, AssetError> {
    if picture.is_light() { Err(AssetError::Light { name: name.into() }) } else { Ok(picture) }
}

impl Picture {
    /// Returns the columns, at least 1.
    pub fn width(&self) -> u32 {
        self.stored[usize::from(self.is_on_its_side())]
    }

    /// Returns the rows, at least 1.
    pub fn height(&self) -> u32 {
        self.stored[usize::from(!self.is_on_its_side())]
    }

    /// Returns whether the levels are linear light (HDR, EXR), and not encoded.
    pub fn is_light(&self) -> bool {
        matches!(self.levels, Levels::Shared(_) | Levels::Floats(_))
    }

    /// Returns the levels of a pixel without its alpha. Encoded levels are from 0 to 1, and decoded if `linear`; light is at
    /// least 0.
    ///
    /// # Panics
    /// Panics if there is no such pixel.
    pub fn level(&self, column: u32, row: u32, linear: bool) -> DVec3 {
        self.pixel(column, row, linear).0
    }

    /// Returns the factor by which a pixel multiplies a colour: with its alpha α, (1 - α) + α·level.
    ///
    /// # Panics
    /// Panics if there is no such pixel.
    pub fn factor(&self, column: u32, row: u32, linear: bool) -> DVec3 {
        let (level, alpha) = self.pixel(column, row, linear);
        // Without alpha the level itself, to the last bit.
        if alpha == 1.0 { level } else { (1.0 - alpha) + alpha * level }
    }

    /// Returns the numbers of the pixels, row after row, and the level of each number, in the most frequent case: red, green
    /// and blue of 8 bits each.
    pub fn bytes_of_opaque(&self, linear: bool) -> Option<(&[u8], &'static [f64; 256])> {
        match (&self.levels, self.orientation) {
            (Levels::Bytes(3, levels), Orientation::NoTransforms) => {
                Some((levels, if linear { &BYTES } else { &SHARES }))
            }
            _ => None,
        }
    }

    /// Returns the alpha of a pixel, from 0 to 1.
    ///
    /// # Panics
    /// Panics if there is no such pixel.
    pub fn alpha(&self, column: u32, row: u32) -> f64 {
        self.pixel(column, row, false).1
    }

    /// Returns whether the alpha of all pixels is 1.
    pub(crate) fn is_opaque(&self) -> bool {
        *self.is_opaque.get_or_init(|| match &self.levels {
            Levels::Bytes(count @ (2 | 4), levels) => {
                levels.chunks_exact(*count).all(|p| p[count - 1] == u8::MAX)
            }
            Levels::Words(count @ (2 | 4), levels) => {
                levels.chunks_exact(*count).all(|p| p[count - 1] == u16::MAX)
            }
            Levels::Bytes(..) | Levels::Words(..) | Levels::Shared(_) | Levels::Floats(_) => true,
        })
    }

    /// Returns a bound of all levels, at least 1.
    pub fn largest(&self) -> f64 {
        self.largest
    }

    /// Returns descriptions of levels that are not taken as they stand.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Returns the memory that the picture takes, in bytes.
    pub(crate) fn bytes(&self) -> usize {
        match &self.levels {
            Levels::Bytes(_, levels) => levels.len(),
            Levels::Words(_, levels) => 2 * levels.len(),
            Levels::Shared(levels) => 4 * levels.len(),
            Levels::Floats(levels) => 12 * levels.len(),
        }
    }

    /// Returns the levels and the alpha of a pixel.
    fn pixel(&self, column: u32, row: u32, linear: bool) -> (DVec3, f64) {
        let at = self.place(column, row);
        match &self.levels {
            Levels::Bytes(count, levels) => {
                let light = linear.then(|| &BYTES[..]);
                mixed(&levels[count * at..count * (at + 1)], 1.0 / 255.0, light)
            }
            Levels::Words(count, levels) => {
                let light = linear.then(|| &WORDS[..]);
                mixed(&levels[count * at..count * (at + 1)], 1.0 / 65535.0, light)
            }
            Levels::Shared(levels) => {
                let [r, g, b, _] = levels[at].map(f64::from);
                (DVec3::new(r, g, b) * unit(levels[at][3]), 1.0)
            }
            Levels::Floats(levels) => (DVec3::from_array(levels[at].map(f64::from)), 1.0),
        }
    }

    fn is_on_its_side(&self) -> bool {
        matches!(
            self.orientation,
            Orientation::Rotate90
                | Orientation::Rotate270
                | Orientation::Rotate90FlipH
                | Orientation::Rotate270FlipH
        )
    }

    /// Returns the place of a pixel in the order of the file.
    fn place(&self, column: u32, row: u32) -> usize {
        assert!(column < self.width() && row < self.height(), "a picture has no pixel {column}, {row}");
        let [width, height] = self.stored;
        let (x, y) = match self.orientation {
            Orientation::NoTransforms => (column, row),
            Orientation::FlipHorizontal => (width - 1 - column, row),
            Orientation::Rotate180 => (width - 1 - column, height - 1 - row),
            Orientation::FlipVertical => (column, height - 1 - row),
            // Mirrored at the diagonal from the upper left.
            Orientation::Rotate90FlipH => (row, column),
            Orientation::Rotate90 => (row, height - 1 - column),
            Orientation::Rotate270FlipH => (width - 1 - row, height - 1 - column),
            Orientation::Rotate270 => (width - 1 - row, column),
        };
        y as usize * width as usize + x as usize
    }
}

/// Returns the light that the number 1 stands for in a pixel with a common exponent: two to the power of the exponent
/// less 136.
fn unit(exponent: u8) -> f64 {
    f64::from_bits((u64::from(exponent) + 1023 - 136) << 52)
}

/// Returns colour and alpha from a pixel's 1 to 4 numbers. The largest possible number times `unit` is 1. `light` has
/// the linear light of each number.
fn mixed<T: Copy + Into<u32>>(numbers: &[T], unit: f64, light: Option<&[f64]>) -> (DVec3, f64) {
    let share = |number: T| f64::from(number.into()) * unit;
    let level = |number: T| light.map_or_else(|| share(number), |light| light[number.into() as usize]);
    match *numbers {
        [grey] => (DVec3::splat(level(grey)), 1.0),
        [grey, alpha] => (DVec3::splat(level(grey)), share(alpha)),
        [r, g, b] => (DVec3::new(level(r), level(g), level(b)), 1.0),
        [r, g, b, alpha] => (DVec3::new(level(r), level(g), level(b)), share(alpha)),
        _ => unreachable!("a pixel has 1 to 4 numbers"),
    }
}
