//! PNG and TIFF files as frames: one that is a picture, or all frames of an animated PNG and all pages of a TIFF.
//!
//! What a file says of its pixels is obeyed as far as a GIF can show it: its gamma, its orientation, its transparency.

use std::cell::Cell;
use std::fs::File;
use std::io::{BufReader, Seek};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use image::codecs::png::PngDecoder;
use image::codecs::tiff::TiffDecoder;
use image::metadata::Orientation;
use image::{AnimationDecoder, DynamicImage, ImageDecoder, Limits, Rgb, RgbImage};

use super::tiff::{self, PageReader};

/// The gamma of what is shown; a file's gamma so near to it changes nothing that could be seen (libpng's threshold).
const DISPLAY_GAMMA: f64 = 2.2;
const GAMMA_THRESHOLD: f64 = 0.05;

/// What a PNG file begins with.
const PNG_SIGNATURE: [u8; 8] = *b"\x89PNG\r\n\x1a\n";

/// A picture of a file, or the frames of one that is animated.
#[derive(Clone, Debug)]
pub(super) struct Picture {
    /// Its file.
    pub(super) path: PathBuf,
    /// How many frames it is.
    pub(super) frames: u64,
    kind: Kind,
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    Png { gamma: Option<f64> },
    AnimatedPng { gamma: Option<f64> },
    TiffPage { at: u64 },
}

/// What takes the frames of a file, one after the other.
type Take<'a> = &'a mut dyn FnMut(RgbImage) -> anyhow::Result<()>;

impl Picture {
    /// Looks into a file: whether it is a PNG or TIFF image, and of how many frames.
    ///
    /// # Errors
    /// When it is none, or cannot be read; the file is named.
    pub(super) fn all_of(path: &Path) -> anyhow::Result<Vec<Self>> {
        named(path, || {
            ensure!(!path.is_dir(), "it is a folder, expected its images, such as {0}/*.png", path.display());
            let file = rayfold_files::open(path)?;
            let of = |frames, kind| Self { path: path.to_path_buf(), frames, kind };
            // Of a file that is shorter there is nothing to see.
            let header = tiff::header(&mut &file).unwrap_or_default();
            (&file).rewind()?;
            match header {
                header if header == PNG_SIGNATURE => {
                    let reader = png::Decoder::new(BufReader::new(&file)).read_info()?;
                    let gamma = gamma(reader.info());
                    Ok(vec![match reader.info().animation_control {
                        Some(animation) if animation.num_frames > 1 => {
                            of(animation.num_frames.into(), Kind::AnimatedPng { gamma })
                        }
                        _ => of(1, Kind::Png { gamma }),
                    }])
                }
                header if tiff::is_tiff(&header) => {
                    let pages = tiff::pages(&mut BufReader::new(&file))?;
                    Ok(pages.into_iter().map(|at| of(1, Kind::TiffPage { at })).collect())
                }
                _ => bail!("it is neither a PNG nor a TIFF image"),
            }
        })
    }

    /// Columns and rows, as it is shown.
    ///
    /// # Errors
    /// When its header cannot be read; the file is named.
    pub(super) fn size(&self) -> anyhow::Result<(u32, u32)> {
        named(&self.path, || match self.kind {
            Kind::Png { .. } | Kind::AnimatedPng { .. } => shown_size(self.png()?),
            Kind::TiffPage { at } => shown_size(self.tiff(at)?),
        })
    }

    /// Decodes it, if it is one frame.
    ///
    /// # Errors
    /// When it cannot be decoded; the file is named.
    pub(super) fn decode(&self) -> anyhow::Result<Option<RgbImage>> {
        named(&self.path, || {
            Ok(match self.kind {
                Kind::AnimatedPng { .. } => None,
                Kind::Png { gamma } => Some(shown(self.png()?, gamma)?),
                Kind::TiffPage { at } => Some(shown(self.tiff(at)?, None)?),
            })
        })
    }

    /// Decodes the frames of an animated PNG, each as a whole picture.
    ///
    /// # Errors
    /// When they cannot be decoded, with the file's name, and those of `take`.
    pub(super) fn decode_each(&self, take: Take<'_>) -> anyhow::Result<()> {
        let Kind::AnimatedPng { gamma } = self.kind else { return Ok(()) };
        let (orientation, mut frames) = named(&self.path, || {
            let orientation = self.png()?.orientation()?;
            Ok((orientation, self.png()?.apng()?.into_frames()))
        })?;
        for number in 1..=self.frames {
            let next = named(&self.path, || {
                let frame =
                    frames.next().with_context(|| format!("frame {number} of {} is missing", self.frames))?;
                let mut image = DynamicImage::ImageRgba8(frame?.into_buffer());
                image.apply_orientation(orientation);
                Ok(opaque(image, gamma))
            })?;
            take(next)?;
        }
        Ok(())
    }

    fn png(&self) -> anyhow::Result<PngDecoder<BufReader<File>>> {
        Ok(PngDecoder::with_limits(BufReader::new(rayfold_files::open(&self.path)?), Limits::default())?)
    }

    fn tiff(&self, at: u64) -> anyhow::Result<TiffDecoder<BufReader<PageReader<File>>>> {
        let page = PageReader::new(rayfold_files::open(&self.path)?, at)?;
        let mut decoder = TiffDecoder::new(BufReader::new(page))?;
        decoder.set_limits(Limits::default())?;
        Ok(decoder)
    }
}

/// Does what reads a file. A decoder that panics, as some do on files that are out of the ordinary, is an error.
fn named<T>(path: &Path, read: impl FnOnce() -> anyhow::Result<T>) -> anyhow::Result<T> {
    let read = quietly(read).unwrap_or_else(|| bail!("the decoder cannot cope with it"));
    // The decoders' words say already what their causes say again.
    read.map_err(|error| anyhow::anyhow!("{error}"))
        .with_context(|| format!("cannot read {}", path.display()))
}

thread_local! {
    static QUIET: Cell<bool> = const { Cell::new(false) };
}

/// Calls `work`; `None` if it panics, which is not reported here.
fn quietly<T>(work: impl FnOnce() -> T) -> Option<T> {
    static HOOK: std::sync::Once = std::sync::Once::new();
    HOOK.call_once(|| {
        let report = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            if !QUIET.get() {
                report(panic);
            }
        }));
    });
    let before = QUIET.replace(true);
    let done = catch_unwind(AssertUnwindSafe(work));
    QUIET.set(before);
    done.ok()
}

/// The exponent that a PNG's samples were encoded by, if it is not that of the display. What says more about the colours
/// counts instead.
fn gamma(info: &png::Info<'_>) -> Option<f64> {
    let says_more =
        info.srgb.is_some() || info.icc_profile.is_some() || info.coding_independent_code_points.is_some();
    let gamma = f64::from(info.gama_chunk?.into_scaled()) / 100_000.0;
    let is_far = (gamma * DISPLAY_GAMMA - 1.0).abs() > GAMMA_THRESHOLD;
    (gamma > 0.0 && is_far && !says_more).then_some(gamma)
}

fn shown_size(mut decoder: impl ImageDecoder) -> anyhow::Result<(u32, u32)> {
    let (width, height) = decoder.dimensions();
    Ok(match decoder.orientation()? {
        Orientation::Rotate90
        | Orientation::Rotate270
        | Orientation::Rotate90FlipH
        | Orientation::Rotate270FlipH => (height, width),
        Orientation::NoTransforms
        | Orientation::Rotate180
        | Orientation::FlipHorizontal
        | Orientation::FlipVertical => (width, height),
    })
}

fn shown(mut decoder: impl ImageDecoder, gamma: Option<f64>) -> anyhow::Result<RgbImage> {
    let orientation = decoder.orientation()?;
    let mut image = DynamicImage::from_decoder(decoder)?;
    image.apply_orientation(orientation);
    Ok(opaque(image, gamma))
}

/// A GIF's pixel is there or not; what is half there is shown over black.
fn opaque(image: DynamicImage, gamma: Option<f64>) -> RgbImage {
    let image = match gamma {
        Some(gamma) => with_gamma(image, gamma),
        None => image,
    };
    if !image.color().has_alpha() {
        return image.into_rgb8();
    }
    let image = image.into_rgba8();
    RgbImage::from_fn(image.width(), image.height(), |x, y| {
        let [r, g, b, alpha] = image.get_pixel(x, y).0;
        let over = |level: u8| ((u32::from(level) * u32::from(alpha) + 127) / 255) as u8;
        Rgb([over(r), over(g), over(b)])
    })
}

/// Samples that were encoded by an exponent, as sRGB (IEC 61966-2-1) encodes them.
fn with_gamma(image: DynamicImage, gamma: f64) -> DynamicImage {
    let mut image = image.into_rgba16();
    let levels: Vec<u16> = (0..=u16::MAX)
        .map(|level| {
            let light = (f64::from(level) / 65_535.0).powf(1.0 / gamma);
            let encoded =
                if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 };
            (65_535.0 * encoded).round() as u16
        })
        .collect();
    for pixel in image.pixels_mut() {
        for level in &mut pixel.0[..3] {
            *level = levels[usize::from(*level)];
        }
    }
    DynamicImage::ImageRgba16(image)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transparent_pixels_are_over_black() {
        let image =
            image::RgbaImage::from_fn(3, 1, |x, _| image::Rgba([200, 100, 50, [0, 128, 255][x as usize]]));
        let shown = opaque(DynamicImage::ImageRgba8(image), None);
        assert_eq!(shown.into_raw(), [0, 0, 0, 100, 50, 25, 200, 100, 50]);
    }

    #[test]
    fn linear_light_is_encoded() {
        let image =
            image::ImageBuffer::from_fn(4, 1, |x, _| image::Luma([[0_u16, 205, 14_030, 65_535][x as usize]]));
        let shown = opaque(DynamicImage::ImageLuma16(image), Some(1.0));
        // 205 is on the straight part: 12.92 * 205 / 257; 14,030 is the light of sRGB's 127.5 or so.
        let levels: Vec<u8> = shown.pixels().map(|pixel| pixel.0[0]).collect();
        assert_eq!(levels, [0, 10, 128, 255]);
    }

    #[test]
    fn a_panic_is_an_error_with_the_files_name() {
        let error = named::<()>(Path::new("a.tif"), || panic!("index out of bounds")).unwrap_err();
        assert_eq!(format!("{error:#}"), "cannot read a.tif: the decoder cannot cope with it");
    }
}
