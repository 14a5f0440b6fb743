//! Frames as the bucket keeps them: PNG files of exactly an image's RGB pixels.

use std::io::Cursor;

use bytes::Bytes;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder, ImageFormat, ImageResult, RgbImage};

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
/// What is wrong with the file.
pub(crate) fn decode(png: &[u8]) -> ImageResult<RgbImage> {
    let mut reader = image::ImageReader::with_format(Cursor::new(png), ImageFormat::Png);
    // The frames are the pipeline's own; their size is limited where they are drawn.
    reader.no_limits();
    Ok(reader.decode()?.into_rgb8())
}
