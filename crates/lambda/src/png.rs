//! Frames in the form in which the bucket stores them: PNG files of exactly an image's pixels, RGB or RGB and alpha. The bytes of a
//! file depend on its pixels alone, not on the number of rows per write.

use std::io::{Cursor, Write};
use std::sync::{Arc, Mutex, PoisonError};

use bytes::Bytes;
use image::codecs::png::PngDecoder;
use image::error::{LimitError, LimitErrorKind};
use image::{DynamicImage, ImageDecoder, ImageError, ImageResult};
use png::{BitDepth, ColorType, Compression, Encoder, EncodingError, Filter, StreamWriter};

/// The size of a chunk of the file in bytes.
const CHUNK: usize = 1 << 16;

/// The largest number of bytes per pixel of a PNG: 16 bits each of red, green, blue and alpha.
const BYTES_A_PIXEL: u64 = 8;

/// Encodes an image of eight bits per channel, RGB or RGB and alpha, as PNG.
///
/// # Errors
/// An error if the image cannot be stored as PNG, which is always possible for one with pixels.
pub(crate) fn encode(image: &DynamicImage) -> Result<Bytes, EncodingError> {
    let mut rows = Rows::begin(image.width(), image.height(), image.color().has_alpha())?;
    rows.push(image.as_bytes())?;
    rows.finish()
}

/// A PNG that is written from the top. Takes memory for its file and a few rows.
pub(crate) struct Rows {
    writer: StreamWriter<'static, Sink>,
    sink: Sink,
}

impl Rows {
    /// Begins an image of this many columns and rows, with or without alpha.
    ///
    /// # Errors
    /// An error if there are none, or more than the format allows.
    pub(crate) fn begin(width: u32, height: u32, has_alpha: bool) -> Result<Self, EncodingError> {
        let sink = Sink::default();
        let mut encoder = Encoder::new(sink.clone(), width, height);
        encoder.set_color(if has_alpha { ColorType::Rgba } else { ColorType::Rgb });
        encoder.set_depth(BitDepth::Eight);
        encoder.set_compression(Compression::Fast);
        encoder.set_filter(Filter::Adaptive);
        let writer = encoder.write_header()?.into_stream_writer_with_size(CHUNK)?;
        Ok(Self { writer, sink })
    }

    /// Adds the pixels of the next rows.
    ///
    /// # Errors
    /// An error if the image has fewer rows.
    pub(crate) fn push(&mut self, pixels: &[u8]) -> Result<(), EncodingError> {
        Ok(self.writer.write_all(pixels)?)
    }

    /// Returns the finished file.
    ///
    /// # Errors
    /// An error if rows are missing.
    pub(crate) fn finish(self) -> Result<Bytes, EncodingError> {
        self.writer.finish()?;
        Ok(std::mem::take(&mut *self.sink.0.lock().unwrap_or_else(PoisonError::into_inner)).into())
    }
}

/// A buffer in which the encoder, which owns its writer, leaves the file.
#[derive(Clone, Default)]
struct Sink(Arc<Mutex<Vec<u8>>>);

impl Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Decodes the pixels of a PNG: eight bits each of red, green and blue, and of alpha if it has that.
///
/// # Errors
/// The error of the decoder. A file of more than `most_pixels` is refused before anything is decoded.
pub(crate) fn decode(png: &[u8], most_pixels: u64) -> ImageResult<DynamicImage> {
    let mut decoder = PngDecoder::new(Cursor::new(png))?;
    let (width, height) = decoder.dimensions();
    if u64::from(width) * u64::from(height) > most_pixels {
        return Err(ImageError::Limits(LimitError::from_kind(LimitErrorKind::DimensionError)));
    }
    // Anything besides the image (profiles, texts) may take no more memory than the largest image.
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(most_pixels.saturating_mul(BYTES_A_PIXEL));
    decoder.set_limits(limits)?;
    let image = DynamicImage::from_decoder(decoder)?;
    Ok(if image.color().has_alpha() { image.into_rgba8().into() } else { image.into_rgb8().into() })
}

#[cfg(test)]
mod tests {
    use image::{RgbImage, RgbaImage};

    use super::*;

    #[test]
    fn an_image_reads_back_up_to_the_limit_and_not_beyond() {
        let opaque = RgbImage::from_fn(5, 3, |x, y| image::Rgb([x as u8, y as u8, 7]));
        let clear = RgbaImage::from_fn(5, 3, |x, y| image::Rgba([x as u8, y as u8, 7, 60 * x as u8]));
        for image in [DynamicImage::from(opaque), clear.into()] {
            let png = encode(&image).unwrap();
            assert_eq!(decode(&png, 15).unwrap(), image);
            assert!(matches!(decode(&png, 14), Err(ImageError::Limits(_))));
            for end in 0..png.len() - 12 {
                assert!(decode(&png[..end], 15).is_err(), "{end} of {} bytes", png.len());
            }
        }
    }

    /// Bands of any height give the same file as the whole image, for compressible and incompressible pixels.
    #[test]
    fn the_bytes_do_not_depend_on_how_rows_come_in() {
        let mut dice = fastrand::Rng::with_seed(7);
        for noise in [0, 1, 255] {
            let image = RgbImage::from_fn(301, 200, |x, y| {
                image::Rgb(
                    [x as u8, (y / 3) as u8, 9].map(|level: u8| level.wrapping_add(dice.u8(0..=noise))),
                )
            });
            let whole = encode(&image.clone().into()).unwrap();
            assert_eq!(decode(&whole, u64::MAX >> 3).unwrap(), image.clone().into());
            for _ in 0..20 {
                let mut rows = Rows::begin(301, 200, false).unwrap();
                let mut rest = &image.as_raw()[..];
                while !rest.is_empty() {
                    // The pieces need not be whole rows.
                    let (piece, after) = rest.split_at(dice.usize(1..=rest.len()));
                    rows.push(piece).unwrap();
                    rest = after;
                }
                assert!(rows.finish().unwrap() == whole, "noise {noise}");
            }
        }
        let mut short = Rows::begin(301, 200, false).unwrap();
        short.push(&[0; 301 * 3 * 199]).unwrap();
        assert!(short.finish().is_err(), "a row is missing");
    }

    /// A file of a few bytes whose header says 4 gigapixels.
    #[test]
    fn a_picture_that_claims_to_be_huge_is_refused_by_its_header() {
        let mut png = encode(&RgbImage::new(1, 1).into()).unwrap().to_vec();
        let header = png.windows(4).position(|bytes| bytes == b"IHDR").unwrap();
        png[header + 4..header + 12].copy_from_slice(&[0, 1, 0, 0, 0, 1, 0, 0]);
        let sum = crc(&png[header..header + 17]);
        png[header + 17..header + 21].copy_from_slice(&sum.to_be_bytes());
        assert!(matches!(decode(&png, 64_000_000), Err(ImageError::Limits(_))));
    }

    /// Returns the checksum of a PNG's chunk (ISO 3309), bit by bit.
    fn crc(bytes: &[u8]) -> u32 {
        let step = |sum: u32| (sum >> 1) ^ (0xedb8_8320 * (sum & 1));
        let byte = |sum: u32, byte: &u8| (0..8).fold(sum ^ u32::from(*byte), |sum, _| step(sum));
        !bytes.iter().fold(!0, byte)
    }
}
