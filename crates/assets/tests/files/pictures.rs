//! Pictures in each format: levels, alpha, turns, light, and those that are refused.

use std::io::Cursor;

use exr::prelude::{Compression, Encoding, Image, Layer, LayerAttributes, SpecificChannels, WritableImage};
use glam::DVec3;
use image::metadata::Orientation;
use image::{DynamicImage, ExtendedColorType, ImageEncoder, Luma, LumaA, Rgb, Rgba};
use rayfold_assets::{AssetError, Library, MemoryFiles, Picture, Purpose};

fn picture(bytes: Vec<u8>) -> Result<std::sync::Arc<Picture>, AssetError> {
    Library::new(MemoryFiles::from([("x", bytes)])).picture("x", Purpose::Sky)
}

fn error(bytes: impl Into<Vec<u8>>) -> String {
    picture(bytes.into()).map(|picture| picture.width()).unwrap_err().to_string()
}

fn encoded(image: impl Into<DynamicImage>, format: image::ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.into().write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

fn png(image: impl Into<DynamicImage>) -> Vec<u8> {
    encoded(image, image::ImageFormat::Png)
}

/// Returns the linear light of an encoded level, from the definition of sRGB.
fn light(level: f64) -> f64 {
    if level <= 0.04045 { level / 12.92 } else { ((level + 0.055) / 1.055).powf(2.4) }
}

fn assert_near(a: DVec3, b: DVec3) {
    assert!(a.abs_diff_eq(b, 1e-12), "{a} is not {b}");
}

#[test]
fn levels_are_those_of_the_pixels() {
    let image = image::RgbImage::from_fn(3, 2, |x, y| Rgb([x as u8 * 100, y as u8 * 200, 7]));
    for format in [image::ImageFormat::Png, image::ImageFormat::WebP] {
        let picture = picture(encoded(image.clone(), format)).unwrap();
        assert_eq!((picture.width(), picture.height(), picture.is_light()), (3, 2, false));
        for (x, y, Rgb(levels)) in image.enumerate_pixels() {
            let expected = DVec3::from_array(levels.map(|level| f64::from(level) / 255.0));
            assert_near(picture.level(x, y, false), expected);
            assert_near(picture.factor(x, y, false), expected);
            assert_near(picture.level(x, y, true), expected.map(light));
        }
    }
}

#[test]
fn grey_is_three_channels_and_alpha_mixes_with_white() {
    let grey = picture(png(image::GrayImage::from_pixel(1, 1, Luma([51])))).unwrap();
    assert_near(grey.level(0, 0, false), DVec3::splat(0.2));
    let faint = picture(png(image::GrayAlphaImage::from_pixel(1, 1, LumaA([51, 102])))).unwrap();
    assert_near(faint.level(0, 0, false), DVec3::splat(0.2));
    assert_near(faint.factor(0, 0, false), DVec3::splat(0.6 + 0.4 * 0.2));
    assert_near(faint.factor(0, 0, true), DVec3::splat(0.6 + 0.4 * light(0.2)));
    let clear = picture(png(image::RgbaImage::from_pixel(1, 1, Rgba([9, 9, 9, 0])))).unwrap();
    assert_near(clear.factor(0, 0, true), DVec3::ONE);
}

#[test]
fn sixteen_bits_are_kept() {
    let wide = image::ImageBuffer::from_pixel(1, 1, Rgba([1u16, 32768, 65535, 13107]));
    let picture = picture(png(DynamicImage::ImageRgba16(wide))).unwrap();
    let levels = DVec3::new(1.0, 32768.0, 65535.0) / 65535.0;
    assert_near(picture.level(0, 0, false), levels);
    assert_near(picture.factor(0, 0, true), 0.8 + 0.2 * levels.map(light));
}

#[test]
fn a_jpeg_errs_by_two_levels() {
    // Smooth, so that the compression loses little.
    let image = image::RgbImage::from_fn(64, 48, |x, y| Rgb([x as u8 * 3, y as u8 * 4, 90]));
    let mut bytes = Vec::new();
    image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 100).encode_image(&image).unwrap();
    let picture = picture(bytes.clone()).unwrap();
    for (x, y, Rgb(levels)) in image.enumerate_pixels() {
        let off = picture.level(x, y, false) * 255.0 - DVec3::from_array(levels.map(f64::from));
        assert!(off.abs().max_element() <= 2.0, "{x} {y}: {off}");
    }
    for end in [bytes.len() - 2, bytes.len() / 2, 700, 100, 10] {
        assert!(error(&bytes[..end]).contains("cut off"), "{}", error(&bytes[..end]));
    }
    let frame = bytes.windows(2).position(|pair| pair == [0xff, 0xc0]).unwrap();
    let mut inks = bytes.clone();
    inks[frame + 9] = 4;
    assert!(error(inks).contains("CMYK"));
    let mut deep = bytes.clone();
    deep[frame + 4] = 12;
    assert!(error(deep).contains("12 bits"));
    let mut huge = bytes;
    huge[frame + 5..frame + 9].fill(0xff);
    assert!(error(huge).contains("65535 x 65535 pixels, more than 67108864"));
}

/// Returns the EXIF that turns a picture.
fn exif(orientation: u8) -> Vec<u8> {
    let mut exif = b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0".to_vec();
    exif.extend([orientation, 0, 0, 0, 0, 0, 0]);
    exif
}

#[test]
fn turns_are_obeyed() {
    let image = image::RgbImage::from_fn(3, 2, |x, y| Rgb([x as u8 * 100, y as u8 * 200, 7]));
    for orientation in 1..=8 {
        let mut turned = DynamicImage::from(image.clone());
        turned.apply_orientation(Orientation::from_exif(orientation).unwrap());
        let turned = turned.into_rgb8();
        let mut files = Vec::new();
        let mut bytes = Vec::new();
        let mut encoder = image::codecs::png::PngEncoder::new(&mut bytes);
        encoder.set_exif_metadata(exif(orientation)).unwrap();
        encoder.write_image(&image, 3, 2, ExtendedColorType::Rgb8).unwrap();
        files.push(bytes);
        let mut bytes = Vec::new();
        let mut encoder = image::codecs::webp::WebPEncoder::new_lossless(&mut bytes);
        encoder.set_exif_metadata(exif(orientation)).unwrap();
        encoder.write_image(&image, 3, 2, ExtendedColorType::Rgb8).unwrap();
        files.push(bytes);
        // Behind the pixels, as some programs write it.
        let mut bytes = png(image.clone());
        let end = bytes.len() - 12;
        let chunk = exif(orientation);
        let mut late = (chunk.len() as u32).to_be_bytes().to_vec();
        late.extend(b"eXIf");
        late.extend(&chunk);
        let sum = crc(&late[4..]);
        late.extend(sum.to_be_bytes());
        bytes.splice(end..end, late);
        files.push(bytes);
        for bytes in files {
            let picture = picture(bytes).unwrap();
            assert_eq!((picture.width(), picture.height()), turned.dimensions());
            for (x, y, Rgb(levels)) in turned.enumerate_pixels() {
                let expected = DVec3::from_array(levels.map(|level| f64::from(level) / 255.0));
                assert_near(picture.level(x, y, false), expected);
            }
        }
    }
    // Of a JPEG, by its shape alone.
    let mut bytes = Vec::new();
    let mut encoder = image::codecs::jpeg::JpegEncoder::new(&mut bytes);
    encoder.set_exif_metadata(exif(6)).unwrap();
    encoder.write_image(&image, 3, 2, ExtendedColorType::Rgb8).unwrap();
    let picture = picture(bytes).unwrap();
    assert_eq!((picture.width(), picture.height()), (2, 3));
}

/// The check sum of a PNG's part.
fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc: u32, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| (crc >> 1) ^ (0xedb8_8320 * (crc & 1)))
    })
}

#[test]
fn headers_promise_no_more_than_there_is() {
    let mut bytes = png(image::RgbImage::new(2, 2));
    bytes[16..24].copy_from_slice(&[0, 0, 0x20, 0, 0, 0, 0x20, 0]);
    let sum = crc(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&sum.to_be_bytes());
    assert!(error(bytes.clone()).contains("its header promises 8192 x 8192 pixels, but it has only"));
    bytes[16] = 1;
    let sum = crc(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&sum.to_be_bytes());
    assert!(error(bytes.clone()).contains("more than 67108864"));
    bytes[16..20].fill(0);
    let sum = crc(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&sum.to_be_bytes());
    assert!(picture(bytes).is_err());
    assert!(error("#?RADIANCE\n\n-Y 10000 +X 10000\n").contains("more than 67108864"));
    assert!(error("#?RADIANCE\n\n-Y 8192 +X 8192\n").contains("cut off, in row 1 of 8192"));
}

#[test]
fn what_is_no_picture_says_what_it_is() {
    assert!(error("GIF89a").contains("it is a GIF"));
    assert!(error("\0\0\0\x1cftypavif").contains("AVIF"));
    assert!(error("v 0 0 0\n").contains("it is no picture"));
    assert!(error("").contains("no picture"));
    let help = picture(Vec::new()).unwrap_err().help().unwrap();
    assert!(help.contains("PNG, JPEG and WebP"), "{help}");
}

fn hdr(size: &str, pixels: &[u8]) -> Vec<u8> {
    [b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2\n\n", size.as_bytes(), b"\n", pixels].concat()
}

#[test]
fn an_hdr_is_light_as_it_stands() {
    let flat = picture(hdr("-Y 1 +X 3", &[255, 128, 0, 130, 1, 1, 1, 2])).unwrap();
    assert!(flat.is_light());
    for x in 0..3 {
        assert_eq!(flat.level(x, 0, true), DVec3::new(255.0, 128.0, 0.0) / 64.0);
        assert_eq!(flat.level(x, 0, false), flat.level(x, 0, true));
    }
    let mut rows = Vec::new();
    for row in 0..2u8 {
        rows.extend([2, 2, 0, 9, 128 + 9, 7, 9, 1, 2, 3, 4, 5, 6, 7, 8, 9, 128 + 4, row, 5, 1, 1, 1, 1, 1]);
        rows.extend([128 + 9, 136]);
    }
    let runs = picture(hdr("-Y 2 +X 9", &rows)).unwrap();
    assert_eq!(runs.level(0, 1, true), DVec3::new(7.0, 1.0, 1.0));
    assert_eq!(runs.level(3, 0, true), DVec3::new(7.0, 4.0, 0.0));
    assert_eq!(runs.level(8, 1, true), DVec3::new(7.0, 9.0, 1.0));
    let ends = picture(hdr("-Y 1 +X 2", &[255, 0, 0, 255, 255, 1, 0, 0])).unwrap();
    assert_eq!(ends.level(0, 0, true).x, 255.0 * 2f64.powi(119));
    assert_eq!(ends.level(1, 0, true).x, 255.0 * 2f64.powi(-136));
}

#[test]
fn faulty_hdrs_are_refused() {
    assert!(error(hdr("+Y 1 +X 3", &[0; 12])).contains("its size is `+Y 1 +X 3`"));
    assert!(error(hdr("-Y 1 +X 3", &[0; 11])).contains("cut off, in row 1 of 1"));
    assert!(error(hdr("-Y 1 +X 3", &[1, 1, 1, 1])).contains("a run of nothing"));
    assert!(error(hdr("-Y 1 +X 3", &[9, 9, 9, 9, 1, 1, 1, 3])).contains("longer than its row"));
    assert!(error(hdr("-Y 1 +X 9", &[2, 2, 0, 9, 128 + 10, 7])).contains("longer than its row"));
    assert!(error(hdr("-Y 1 +X 9", &[2, 2, 0, 8, 128 + 10, 7])).contains("another width"));
    assert!(error(hdr("-Y 1 +X 9", &[2, 2, 0, 9, 0])).contains("a run is empty"));
    assert!(error("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n0000").contains("32-bit_rle_xyze"));
    assert!(error("#?RADIANCE\n").contains("no end"));
    let runs = [&[9, 9, 9, 9][..], &[1, 1, 1, 0].repeat(9)].concat();
    assert!(error(hdr("-Y 1 +X 3", &runs)).contains("longer than its row"));
}

fn exr(compression: Compression, levels: impl Fn(usize, usize) -> (f32, f32, f32) + Sync) -> Vec<u8> {
    let channels = SpecificChannels::rgb(|at: exr::math::Vec2<usize>| levels(at.0, at.1));
    let encoding = Encoding { compression, ..Encoding::UNCOMPRESSED };
    let image = Image::from_layer(Layer::new((5, 3), LayerAttributes::named("a"), encoding, channels));
    let mut bytes = Cursor::new(Vec::new());
    image.write().non_parallel().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

#[test]
fn an_exr_is_light_as_it_stands() {
    let levels = |x: usize, y: usize| (x as f32, y as f32 * 0.5, 1e6);
    for compression in [Compression::Uncompressed, Compression::RLE, Compression::ZIP16, Compression::PIZ] {
        let picture = picture(exr(compression, levels)).unwrap();
        assert!(picture.is_light() && picture.warnings().is_empty());
        assert_eq!((picture.width(), picture.height()), (5, 3));
        assert_eq!(picture.level(3, 1, true), DVec3::new(3.0, 0.5, 1e6));
        assert_eq!(picture.factor(0, 2, false), DVec3::new(0.0, 1.0, 1e6));
    }
}

#[test]
fn levels_that_are_no_light_are_changed_with_a_warning() {
    let levels = |x: usize, _| [(-1.0, 2.0, 3.0), (f32::INFINITY, f32::NEG_INFINITY, 0.0)][x % 2];
    let picture = picture(exr(Compression::ZIP1, levels)).unwrap();
    assert_eq!(picture.level(0, 0, true), DVec3::new(0.0, 2.0, 3.0));
    assert_eq!(picture.level(1, 0, true), DVec3::new(65504.0, 0.0, 0.0));
    assert_eq!(
        picture.warnings(),
        ["15 of its levels are negative, and count as 0", "6 of its levels are infinite, and count as 65504"]
    );
    let brighter = exr(Compression::ZIP1, |x, _| (if x == 0 { f32::INFINITY } else { 1e5 }, 0.0, 0.0));
    let library = Library::new(MemoryFiles::from([("x", brighter)]));
    assert_eq!(library.picture("x", Purpose::Sky).unwrap().level(0, 0, true).x, 1e5);
    let refused = library.picture("x", Purpose::Surface).unwrap_err();
    assert!(refused.to_string().contains("only a `Sky`"), "{refused}");
    assert!(
        error(exr(Compression::RLE, |x, _| (0.0, if x == 4 { f32::NAN } else { 0.0 }, 0.0))).contains("NaN")
    );
}

#[test]
fn compressions_that_are_not_read_are_named() {
    let bytes = exr(Compression::ZIP1, |_, _| (0.0, 0.0, 0.0));
    let at = bytes.windows(12).position(|part| part == b"compression\0").unwrap() + 28;
    for (number, name) in [(8, "DWAA"), (9, "DWAB"), (10, "HTJ2K256"), (77, "number 77")] {
        let mut other = bytes.clone();
        other[at] = number;
        assert!(error(other.clone()).contains(&format!("its compression is {name}")), "{}", error(other));
    }
    assert!(error(&bytes[..bytes.len() - 9]).contains("cut off"));
}

#[test]
fn a_picture_is_decoded_once_until_its_file_changes() {
    let library = Library::new(MemoryFiles::from([("x", png(image::RgbImage::new(2, 2)))]));
    let first = library.picture("x", Purpose::Surface).unwrap();
    let second = library.picture("x", Purpose::Sky).unwrap();
    assert!(std::sync::Arc::ptr_eq(&first, &second));
    assert!(matches!(library.picture("y", Purpose::Sky), Err(AssetError::Absent { .. })));
    assert!(matches!(Library::none().picture("x", Purpose::Sky), Err(AssetError::NotHere { .. })));
}
