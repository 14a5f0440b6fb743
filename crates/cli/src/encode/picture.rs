//! Files as frames: a picture is one frame, an animated file has all its frames, and a TIFF all its pages.
//!
//! The gamma and the orientation of a file are applied. Its transparency is kept.

use std::cell::Cell;
use std::io::{Cursor, Read};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, bail, ensure};
use image::codecs::gif::GifDecoder;
use image::codecs::jpeg::JpegDecoder;
use image::codecs::png::PngDecoder;
use image::codecs::tiff::TiffDecoder;
use image::codecs::webp::WebPDecoder;
use image::metadata::Orientation;
use image::{AnimationDecoder, DynamicImage, ImageDecoder, Limits, RgbaImage};
use image_webp::LoopCount;
use rayfold_movie::Plays;
use rayfold_scene::assets::jpeg_fault;

use super::source::{Reader, Source};
use super::tiff::{self, PageReader};
use super::video::{SIGNATURE, Video};
use super::webp;
use crate::interrupt;

/// The gamma of the display. If a file's gamma is this near to it, the difference is invisible (libpng's threshold).
const DISPLAY_GAMMA: f64 = 2.2;
const GAMMA_THRESHOLD: f64 = 0.05;

/// The first bytes of each kind of file.
const PNG_SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";
const JPEG_SIGNATURE: &[u8] = b"\xff\xd8\xff";
const GIF_SIGNATURE: &[u8] = b"GIF8";
const WEBP_SIGNATURE: &[u8] = b"RIFF";

/// The time for which players show a frame of an animated file if its own time is zero or too short for them.
const USUAL_SECONDS: f64 = 0.1;
const LEAST_SECONDS: f64 = 0.011;

/// A picture in a file, or the frames of an animated file.
#[derive(Clone, Debug)]
pub(super) struct Picture {
    source: Source,
    /// The number of frames; `None` for a video, where it is not known.
    pub(super) frames: Option<u64>,
    /// Whether pixels may be transparent.
    pub(super) has_alpha: bool,
    kind: Kind,
}

#[derive(Clone, Debug)]
enum Kind {
    Png { gamma: Option<f64> },
    Jpeg,
    WebP,
    TiffPage { at: u64 },
    Animated { format: Animated, gamma: Option<f64>, plays: Plays },
    Video(Video),
}

#[derive(Clone, Copy, Debug)]
enum Animated {
    Png,
    Gif,
    WebP,
}

/// The frames of an animated file, each with its duration in seconds.
type Frames<'a> = Box<dyn Iterator<Item = anyhow::Result<(DynamicImage, f64)>> + 'a>;

/// The function that takes the frames of a file in order, each with its duration in seconds.
type Take<'a> = &'a mut dyn FnMut(DynamicImage, Option<f64>) -> anyhow::Result<()>;

impl Picture {
    /// Examines a file: its kind, and its number of frames.
    ///
    /// # Errors
    /// When the file cannot be shown or read; the error names it.
    pub(super) fn all_of(path: &Path) -> anyhow::Result<Vec<Self>> {
        let source = Source::File(path.to_path_buf());
        named(&source.name(), || {
            ensure!(!path.is_dir(), "it is a folder, expected its images, such as {0}/*.png", path.display());
            checked(Self::of(&source)?)
        })
    }

    /// Reads standard input: a picture or an animation as a whole, a video frame by frame.
    ///
    /// # Errors
    /// When the input cannot be shown, or a signal came during the wait for it.
    pub(super) fn all_of_stdin() -> anyhow::Result<Vec<Self>> {
        let read = interrupt::wait_for(|| {
            let mut bytes = Vec::new();
            let mut stdin = std::io::stdin();
            stdin.by_ref().take(SIGNATURE.len() as u64).read_to_end(&mut bytes)?;
            if bytes != SIGNATURE {
                stdin.read_to_end(&mut bytes)?;
            }
            Ok::<_, std::io::Error>(bytes)
        })?;
        let name = Source::Memory(Arc::default()).name();
        named(&name, || {
            let bytes = read?;
            let is_video = bytes == SIGNATURE;
            let source = Source::Memory(bytes.into());
            if !is_video {
                return checked(Self::of(&source)?);
            }
            let video = Video::read(Box::new(SIGNATURE.as_slice().chain(std::io::stdin())))?;
            Ok(vec![Self { source, frames: None, has_alpha: false, kind: Kind::Video(video) }])
        })
    }

    fn of(source: &Source) -> anyhow::Result<Vec<Self>> {
        let of =
            |frames, has_alpha, kind| Self { source: source.clone(), frames: Some(frames), has_alpha, kind };
        let animated = |frames, has_alpha, animation, still| {
            of(frames, has_alpha, if frames > 1 { animation } else { still })
        };
        let mut reader = source.open()?;
        // A shorter file has no picture.
        let header = tiff::header(&mut reader).unwrap_or_default();
        std::io::Seek::rewind(&mut reader)?;
        let begins = |with: &[u8]| header.starts_with(with);
        Ok(if begins(PNG_SIGNATURE) {
            let reader = png::Decoder::new(reader).read_info()?;
            let gamma = gamma(reader.info());
            let info = reader.info();
            let has_alpha = info.trns.is_some()
                || matches!(info.color_type, png::ColorType::Rgba | png::ColorType::GrayscaleAlpha);
            let frames = info.animation_control.map_or(1, |animation| animation.num_frames.max(1));
            let plays = plays_of(info.animation_control.map_or(0, |animation| animation.num_plays));
            let animation = Kind::Animated { format: Animated::Png, gamma, plays };
            vec![animated(frames.into(), has_alpha, animation, Kind::Png { gamma })]
        } else if begins(JPEG_SIGNATURE) {
            JpegDecoder::new(reader)?;
            vec![of(1, false, Kind::Jpeg)]
        } else if begins(GIF_SIGNATURE) {
            let (frames, plays) = survey_of_gif(reader)?;
            // Frames of an animation leave pixels out, so that their alpha is not known before they are decoded.
            vec![of(frames, true, Kind::Animated { format: Animated::Gif, gamma: None, plays })]
        } else if begins(WEBP_SIGNATURE) {
            let decoder = image_webp::WebPDecoder::new(reader)?;
            let frames = if decoder.is_animated() { decoder.num_frames().into() } else { 1 };
            let plays = match decoder.loop_count() {
                LoopCount::Forever => Plays::Endless,
                LoopCount::Times(times) => plays_of(times.get().into()),
            };
            let animation = Kind::Animated { format: Animated::WebP, gamma: None, plays };
            vec![animated(frames, decoder.has_alpha(), animation, Kind::WebP)]
        } else if begins(SIGNATURE) {
            vec![Self {
                source: source.clone(),
                frames: None,
                has_alpha: false,
                kind: Kind::Video(Video::read(Box::new(reader))?),
            }]
        } else if tiff::is_tiff(&header) {
            let pages = tiff::pages(&mut reader)?;
            let page = |at| {
                let mut page = of(1, false, Kind::TiffPage { at });
                page.has_alpha = page.tiff(at)?.color_type().has_alpha();
                Ok(page)
            };
            pages.into_iter().map(page).collect::<anyhow::Result<_>>()?
        } else {
            bail!("it is no image: expected PNG, APNG, JPEG, GIF, WebP, TIFF or .y4m")
        })
    }

    /// Returns the name for messages.
    pub(super) fn name(&self) -> String {
        self.source.name()
    }

    /// Returns the frames per second of a video, or `None` for other files.
    pub(super) fn fps(&self) -> Option<f64> {
        match &self.kind {
            Kind::Video(video) => Some(video.fps),
            _ => None,
        }
    }

    /// Returns the number of times that an animated file is shown, or `None` for other files.
    pub(super) fn plays(&self) -> Option<Plays> {
        match self.kind {
            Kind::Animated { plays, .. } if self.frames > Some(1) => Some(plays),
            _ => None,
        }
    }

    /// Returns the columns and rows of the picture as it is shown.
    ///
    /// # Errors
    /// When the header cannot be read; the error names the file.
    pub(super) fn size(&self) -> anyhow::Result<(u32, u32)> {
        named(&self.name(), || self.stored_size())
    }

    fn stored_size(&self) -> anyhow::Result<(u32, u32)> {
        match &self.kind {
            Kind::Png { .. } | Kind::Animated { format: Animated::Png, .. } => shown_size(self.png()?),
            Kind::Jpeg => shown_size(JpegDecoder::new(self.source.open()?)?),
            Kind::WebP | Kind::Animated { format: Animated::WebP, .. } => {
                shown_size(WebPDecoder::new(self.source.open()?)?)
            }
            Kind::Animated { format: Animated::Gif, .. } => shown_size(GifDecoder::new(self.source.open()?)?),
            Kind::TiffPage { at } => shown_size(self.tiff(*at)?),
            Kind::Video(video) => Ok(video.size),
        }
    }

    /// Decodes the picture if it is a single frame.
    ///
    /// # Errors
    /// When the picture cannot be decoded; the error names the file.
    pub(super) fn decode(&self) -> anyhow::Result<Option<DynamicImage>> {
        named(&self.name(), || {
            Ok(match &self.kind {
                Kind::Animated { .. } | Kind::Video(_) => None,
                Kind::Png { gamma } => Some(shown(self.png()?, *gamma)?),
                Kind::Jpeg => {
                    let mut bytes = Vec::new();
                    self.source.open()?.read_to_end(&mut bytes)?;
                    // The decoder draws what is missing in grey.
                    if let Some(fault) = jpeg_fault(&bytes) {
                        bail!("{fault}");
                    }
                    Some(shown(JpegDecoder::new(Cursor::new(bytes))?, None)?)
                }
                Kind::WebP => Some(shown(WebPDecoder::new(self.source.open()?)?, None)?),
                Kind::TiffPage { at } => Some(shown(self.tiff(*at)?, None)?),
            })
        })
    }

    /// Decodes the frames of an animation or a video, each as a whole picture.
    ///
    /// # Errors
    /// Fails if the frames cannot be decoded (the error names the file), or if `take` fails.
    pub(super) fn decode_each(&self, take: Take<'_>) -> anyhow::Result<()> {
        let (format, gamma) = match &self.kind {
            Kind::Animated { format, gamma, .. } => (*format, *gamma),
            Kind::Video(video) => {
                let mut taken = Ok(());
                let read = video.each(|image| {
                    taken = take(image.into(), None);
                    anyhow::ensure!(taken.is_ok());
                    Ok(())
                });
                // An error of `take` is not about the file.
                taken?;
                return named(&self.name(), || read);
            }
            _ => return Ok(()),
        };
        let (orientation, mut frames) = named(&self.name(), || self.animation(format))?;
        for number in 1..=self.frames.unwrap_or_default() {
            let (next, seconds) = named(&self.name(), || {
                let (mut image, seconds) = frames.next().with_context(|| {
                    format!("frame {number} of {} is missing", self.frames.unwrap_or_default())
                })??;
                image.apply_orientation(orientation);
                Ok((levels(image, gamma), if seconds < LEAST_SECONDS { USUAL_SECONDS } else { seconds }))
            })?;
            take(next, Some(seconds))?;
        }
        Ok(())
    }

    fn animation(&self, format: Animated) -> anyhow::Result<(Orientation, Frames<'static>)> {
        let mut reader = self.source.open()?;
        Ok(match format {
            Animated::Png => (self.png()?.orientation()?, frames(self.png()?.apng()?)),
            Animated::Gif => (Orientation::NoTransforms, frames(GifDecoder::new(reader)?)),
            Animated::WebP => {
                let mut decoder = WebPDecoder::new(self.source.open()?)?;
                let (orientation, size) = (decoder.orientation()?, decoder.dimensions());
                let mut bytes = Vec::new();
                reader.read_to_end(&mut bytes)?;
                let mut frames = webp::Frames::new(bytes, size);
                let next = move || frames.next().transpose();
                let shown = |(image, ms): (RgbaImage, u32)| (image.into(), f64::from(ms) / 1_000.0);
                (orientation, Box::new(std::iter::from_fn(next).map(move |frame| frame.map(shown))))
            }
        })
    }

    fn png(&self) -> anyhow::Result<PngDecoder<Reader>> {
        Ok(PngDecoder::with_limits(self.source.open()?, Limits::default())?)
    }

    fn tiff(&self, at: u64) -> anyhow::Result<TiffDecoder<std::io::BufReader<PageReader<Reader>>>> {
        let page = PageReader::new(self.source.open()?, at)?;
        let mut decoder = TiffDecoder::new(std::io::BufReader::new(page))?;
        decoder.set_limits(Limits::default())?;
        Ok(decoder)
    }
}

/// Returns the frames of a decoder with their seconds.
fn frames<'a>(decoder: impl AnimationDecoder<'a>) -> Frames<'a> {
    Box::new(decoder.into_frames().map(|frame| {
        let frame = frame?;
        let (parts, whole) = frame.delay().numer_denom_ms();
        // Rounded once, so that a time such as 1001/30000 s is known again.
        let seconds = f64::from(parts) / (1_000.0 * f64::from(whole.max(1)));
        Ok((frame.into_buffer().into(), seconds))
    }))
}

/// Returns the number of times that an animation is shown, from the number in its file: 0 is for ever.
fn plays_of(times: u32) -> Plays {
    match times {
        0 => Plays::Endless,
        1 => Plays::Once,
        _ => Plays::repeated(u16::try_from(times - 1).unwrap_or(u16::MAX)),
    }
}

/// Counts the frames of a GIF without decoding them, and returns how often it is shown.
fn survey_of_gif(reader: Reader) -> anyhow::Result<(u64, Plays)> {
    let mut options = gif::DecodeOptions::new();
    options.skip_frame_decoding(true);
    let mut decoder = options.read_info(reader)?;
    let mut count = 0;
    while let Some(frame) = decoder.next_frame_info()? {
        check_size(frame.width.into(), frame.height.into())?;
        count += 1;
    }
    ensure!(count > 0, "it has no frame");
    let plays = match decoder.repeat() {
        gif::Repeat::Infinite => Plays::Endless,
        gif::Repeat::Finite(0) => Plays::Once,
        gif::Repeat::Finite(times) => Plays::repeated(times),
    };
    Ok((count, plays))
}

/// Refuses pictures that are larger than a frame may be, before memory is spent on them.
fn checked(pictures: Vec<Picture>) -> anyhow::Result<Vec<Picture>> {
    for picture in &pictures {
        let (width, height) = picture.stored_size()?;
        check_size(width, height)?;
    }
    Ok(pictures)
}

fn check_size(width: u32, height: u32) -> anyhow::Result<()> {
    let most = rayfold_scene::Limits::PIXELS;
    ensure!(
        u64::from(width) * u64::from(height) <= most,
        "it has {width} x {height} pixels: expected at most {most}"
    );
    Ok(())
}

/// Runs `read`, and names the file in its error. Some decoders panic on unusual files; a panic is returned as an error.
fn named<T>(name: &str, read: impl FnOnce() -> anyhow::Result<T>) -> anyhow::Result<T> {
    let read = quietly(read).unwrap_or_else(|| bail!("the decoder cannot cope with it"));
    // The decoders' messages already contain those of their causes.
    read.map_err(|error| anyhow::anyhow!("{}", error.to_string().trim()))
        .with_context(|| format!("cannot read {name}"))
}

thread_local! {
    static QUIET: Cell<bool> = const { Cell::new(false) };
}

/// Runs `work`. Returns `None` if it panics; the panic is not reported here.
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

/// Returns the exponent by which the samples of a PNG were encoded, if it is not that of the display. Chunks with more
/// information on the colours take precedence.
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

fn shown(mut decoder: impl ImageDecoder, gamma: Option<f64>) -> anyhow::Result<DynamicImage> {
    let orientation = decoder.orientation()?;
    let mut image = DynamicImage::from_decoder(decoder)?;
    image.apply_orientation(orientation);
    Ok(levels(image, gamma))
}

/// Converts an image to eight bits per channel, with alpha if it has that.
fn levels(image: DynamicImage, gamma: Option<f64>) -> DynamicImage {
    let has_alpha = image.color().has_alpha();
    let image = match gamma {
        Some(gamma) => with_gamma(image, gamma),
        None => image,
    };
    if has_alpha { image.into_rgba8().into() } else { image.into_rgb8().into() }
}

/// Converts samples that were encoded by an exponent to sRGB (IEC 61966-2-1).
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
    fn transparent_pixels_stay_transparent() {
        let image =
            image::RgbaImage::from_fn(3, 1, |x, _| image::Rgba([200, 100, 50, [0, 128, 255][x as usize]]));
        let image = DynamicImage::ImageRgba8(image);
        assert_eq!(levels(DynamicImage::ImageRgba16(image.to_rgba16()), None), image);
        assert_eq!(levels(image.clone(), Some(1.0)).as_bytes()[3], 0);
    }

    #[test]
    fn linear_light_is_encoded() {
        let image =
            image::ImageBuffer::from_fn(4, 1, |x, _| image::Luma([[0_u16, 205, 14_030, 65_535][x as usize]]));
        let shown = levels(DynamicImage::ImageLuma16(image), Some(1.0)).into_rgb8();
        // 205 is on the straight part: 12.92 * 205 / 257; 14,030 is the light of sRGB's 127.5 or so.
        let levels: Vec<u8> = shown.pixels().map(|pixel| pixel.0[0]).collect();
        assert_eq!(levels, [0, 10, 128, 255]);
    }

    #[test]
    fn a_panic_is_an_error_with_the_files_name() {
        let error = named::<()>("a.tif", || panic!("index out of bounds")).unwrap_err();
        assert_eq!(format!("{error:#}"), "cannot read a.tif: the decoder cannot cope with it");
    }
}
