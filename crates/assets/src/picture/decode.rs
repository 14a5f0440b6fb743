//! A picture from the bytes of its file, whose content decides what it is.

use std::io::Cursor;
use std::sync::OnceLock;

use image::codecs::jpeg::JpegDecoder;
use image::codecs::png::PngDecoder;
use image::codecs::webp::WebPDecoder;
use image::metadata::Orientation;
use image::{ColorType, ImageDecoder, ImageError};

use super::size::check_size;
use super::{Levels, Picture, exr, hdr, jpeg};
use crate::error::{AssetError, Fault};

/// The first bytes of formats, and their names.
const PNG: &[u8] = b"\x89PNG\r\n\x1a\n";
const JPEG: &[u8] = b"\xff\xd8\xff";
const OTHERS: [(&[u8], &str); 8] = [
    (b"GIF8", "a GIF"),
    (b"BM", "a BMP"),
    (b"II*\0", "a TIFF"),
    (b"MM\0*", "a TIFF"),
    (b"qoif", "a QOI"),
    (b"8BPS", "a Photoshop file"),
    (b"<svg", "an SVG"),
    (b"\xabKTX", "a KTX"),
];

/// The bytes that the parts of a PNG beside its pixels may take, and one of its rows.
const PNG_EXTRAS: u64 = 64 << 20;

/// Makes a picture of the bytes of the file with this name.
///
/// # Errors
/// Fails if the content is faulty, or is no picture of a known kind.
pub(crate) fn decode(name: &str, bytes: &[u8]) -> Result<Picture, AssetError> {
    read(bytes).map_err(|fault| AssetError::Picture { name: name.into(), what: fault.what })
}

fn read(bytes: &[u8]) -> Result<Picture, Fault> {
    if bytes.starts_with(PNG) {
        return read_png(bytes);
    }
    if bytes.starts_with(JPEG) {
        jpeg::check(bytes)?;
        return read_encoded(JpegDecoder::new(Cursor::new(bytes)).map_err(fault)?, bytes, None);
    }
    if bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP") {
        return read_encoded(WebPDecoder::new(Cursor::new(bytes)).map_err(fault)?, bytes, None);
    }
    if bytes.starts_with(b"#?") {
        return hdr::read(bytes);
    }
    if bytes.starts_with(b"\x76\x2f\x31\x01") {
        return exr::read(bytes);
    }
    let is_avif = bytes.get(4..8) == Some(b"ftyp");
    let other = OTHERS.iter().find(|(start, _)| bytes.starts_with(start)).map(|(_, name)| *name);
    let what = other.or(is_avif.then_some("an AVIF, HEIC or film")).unwrap_or("no picture");
    Err(Fault::new(format!("it is {what}")))
}

fn read_png(bytes: &[u8]) -> Result<Picture, Fault> {
    let mut limit = image::Limits::no_limits();
    limit.max_alloc = Some(PNG_EXTRAS);
    let decoder = PngDecoder::with_limits(Cursor::new(bytes), limit).map_err(fault)?;
    let (width, height) = decoder.dimensions();
    check_size(width, height)?;
    // Deflated data are at most 1032 times as long without.
    let promised = u64::from(width) * u64::from(height) / 8;
    if promised > 1032 * bytes.len() as u64 {
        return Err(Fault::new(format!(
            "its header promises {width} x {height} pixels, but it has only {} bytes",
            bytes.len()
        )));
    }
    read_encoded(decoder, bytes, png_turn(bytes))
}

/// Returns the orientation of a PNG. Its EXIF data may come after its pixels.
fn png_turn(bytes: &[u8]) -> Option<Orientation> {
    let mut rest = bytes.get(PNG.len()..)?;
    loop {
        let (head, data) = rest.split_at_checked(8)?;
        let length = u32::from_be_bytes([head[0], head[1], head[2], head[3]]) as usize;
        let (data, behind) = data.split_at_checked(length)?;
        if &head[4..] == b"eXIf" {
            return Orientation::from_exif_chunk(data);
        }
        rest = behind.get(4..)?;
    }
}

/// Reads a picture whose levels are encoded. `turn` is that of the file, if it is known already.
fn read_encoded(
    mut decoder: impl ImageDecoder,
    bytes: &[u8],
    turn: Option<Orientation>,
) -> Result<Picture, Fault> {
    let (width, height) = decoder.dimensions();
    check_size(width, height)?;
    // Faulty EXIF is as none.
    let orientation = turn.or_else(|| decoder.orientation().ok()).unwrap_or(Orientation::NoTransforms);
    let (count, is_wide) = match decoder.color_type() {
        ColorType::L8 => (1, false),
        ColorType::La8 => (2, false),
        ColorType::Rgb8 => (3, false),
        ColorType::Rgba8 => (4, false),
        ColorType::L16 => (1, true),
        ColorType::La16 => (2, true),
        ColorType::Rgb16 => (3, true),
        ColorType::Rgba16 => (4, true),
        other => return Err(Fault::new(format!("its pixels are {other:?}, which is not read"))),
    };
    let numbers = count * width as usize * height as usize;
    let mut read = vec![0; if is_wide { 2 * numbers } else { numbers }];
    if read.len() as u64 != decoder.total_bytes() {
        return Err(Fault::new(format!("its {} bytes contradict their header", bytes.len())));
    }
    decoder.read_image(&mut read).map_err(fault)?;
    let levels = if is_wide {
        Levels::Words(count, read.as_chunks().0.iter().map(|pair| u16::from_ne_bytes(*pair)).collect())
    } else {
        Levels::Bytes(count, read)
    };
    Ok(Picture {
        stored: [width, height],
        levels,
        orientation,
        largest: 1.0,
        warnings: Vec::new(),
        is_opaque: OnceLock::new(),
    })
}

fn fault(error: ImageError) -> Fault {
    let source = std::error::Error::source(&error).map(ToString::to_string);
    let what = match &error {
        ImageError::Limits(_) => "what stands beside its pixels takes too much memory".into(),
        ImageError::IoError(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => {
            "the file is cut off".into()
        }
        _ => source.unwrap_or_else(|| error.to_string()),
    };
    Fault::new(format!("it cannot be decoded: {}", what.trim_end_matches(['.', '\n'])))
}
