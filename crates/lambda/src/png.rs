//! Frames as the bucket keeps them: PNG files of exactly an image's RGB pixels.

use std::io::Cursor;

use bytes::Bytes;
use image::codecs::png::{CompressionType, FilterType, PngDecoder, PngEncoder};
use image::error::{LimitError, LimitErrorKind};
use image::{ExtendedColorType, ImageDecoder, ImageEncoder, ImageError, ImageResult, RgbImage};

/// Of what a PNG can hold at most, 16 bits of red, green, blue and alpha.
const BYTES_A_PIXEL: u64 = 8;

/// An image as a PNG.
///
/// # Errors
/// When the image cannot be held as PNG, which one with pixels always can.
pub(crate) fn encode(image: &RgbImage) -> ImageResult<Bytes> {
    let mut png = Vec::new();
    PngEncoder::new_with_quality(&mut png, CompressionType::Fast, FilterType::Adaptive).write_image(
        image.as_raw(),
        image.width(),
        image.height(),
        ExtendedColorType::Rgb8,
    )?;
    Ok(png.into())
}

/// The RGB pixels of a PNG.
///
/// # Errors
/// What is wrong with the file; one of more than `most_pixels` is refused before anything is decoded.
pub(crate) fn decode(png: &[u8], most_pixels: u64) -> ImageResult<RgbImage> {
    let mut decoder = PngDecoder::new(Cursor::new(png))?;
    let (width, height) = decoder.dimensions();
    if u64::from(width) * u64::from(height) > most_pixels {
        return Err(ImageError::Limits(LimitError::from_kind(LimitErrorKind::DimensionError)));
    }
    // What is not the image (profiles, texts) takes no more than the largest image would.
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(most_pixels.saturating_mul(BYTES_A_PIXEL));
    decoder.set_limits(limits)?;
    Ok(image::DynamicImage::from_decoder(decoder)?.into_rgb8())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_reads_back_up_to_the_limit_and_not_beyond() {
        let image = RgbImage::from_fn(5, 3, |x, y| image::Rgb([x as u8, y as u8, 7]));
        let png = encode(&image).unwrap();
        assert_eq!(decode(&png, 15).unwrap(), image);
        assert!(matches!(decode(&png, 14), Err(ImageError::Limits(_))));
        for end in 0..png.len() - 12 {
            assert!(decode(&png[..end], 15).is_err(), "{end} of {} bytes", png.len());
        }
    }

    /// A few bytes that say they are 4 gigapixels.
    #[test]
    fn a_picture_that_claims_to_be_huge_is_refused_by_its_header() {
        let mut png = encode(&RgbImage::new(1, 1)).unwrap().to_vec();
        let header = png.windows(4).position(|bytes| bytes == b"IHDR").unwrap();
        png[header + 4..header + 12].copy_from_slice(&[0, 1, 0, 0, 0, 1, 0, 0]);
        let sum = crc(&png[header..header + 17]);
        png[header + 17..header + 21].copy_from_slice(&sum.to_be_bytes());
        assert!(matches!(decode(&png, 64_000_000), Err(ImageError::Limits(_))));
    }

    /// The checksum of a PNG's chunk (ISO 3309), bit by bit.
    fn crc(bytes: &[u8]) -> u32 {
        let step = |sum: u32| (sum >> 1) ^ (0xedb8_8320 * (sum & 1));
        let byte = |sum: u32, byte: &u8| (0..8).fold(sum ^ u32::from(*byte), |sum, _| step(sum));
        !bytes.iter().fold(!0, byte)
    }
}
