//! Any frames through the GIF encoder and another's decoder.
#![no_main]

use std::collections::HashSet;

use arbitrary::{Arbitrary, Unstructured};
use image::{Rgb, RgbImage};
use libfuzzer_sys::fuzz_target;
use rayfold_gif::{Encoder, Error, Settings};

/// The most pixels of a frame.
const PIXELS: u32 = 1 << 14;

#[derive(Debug, Arbitrary)]
struct Animation {
    width: u16,
    height: u16,
    /// Frames in a hundred seconds.
    pace: u32,
    loops: u16,
    frames: Vec<Frame>,
}

/// The difference between a frame and the one before, which at first is black.
#[derive(Debug, Arbitrary)]
enum Frame {
    Same,
    Plain([u8; 3]),
    Gradient { from: [u8; 3], across: [u8; 3], down: [u8; 3] },
    Noise { seed: u32, mask: [u8; 3] },
    Dots(Vec<(u16, [u8; 3])>),
    Darker(u8),
    Moved(u16),
    /// A frame of another size, which is to be refused.
    Odd { width: u8, height: u8 },
}

impl Frame {
    fn draw(&self, image: &mut RgbImage) {
        let (width, height) = image.dimensions();
        match self {
            Self::Same | Self::Odd { .. } => {}
            Self::Plain(rgb) => image.pixels_mut().for_each(|pixel| *pixel = Rgb(*rgb)),
            Self::Gradient { from, across, down } => {
                for (x, y, pixel) in image.enumerate_pixels_mut() {
                    let level = |k: usize| {
                        let (x, y) = (x * u32::from(across[k]) / width, y * u32::from(down[k]) / height);
                        (u32::from(from[k]) + x + y) as u8
                    };
                    *pixel = Rgb([level(0), level(1), level(2)]);
                }
            }
            Self::Noise { seed, mask } => {
                let mut state = *seed | 1;
                for pixel in image.pixels_mut() {
                    state = state.wrapping_mul(0x9E37_79B1).rotate_left(13) ^ 0x85EB_CA6B;
                    let [r, g, b, _] = state.to_le_bytes();
                    *pixel = Rgb([r & mask[0], g & mask[1], b & mask[2]]);
                }
            }
            Self::Dots(dots) => {
                for (at, rgb) in dots {
                    let at = u32::from(*at) % (width * height);
                    image.put_pixel(at % width, at / width, Rgb(*rgb));
                }
            }
            Self::Darker(by) => {
                image.pixels_mut().for_each(|pixel| pixel.0 = pixel.0.map(|level| level.saturating_sub(*by)));
            }
            Self::Moved(by) => {
                let by = 3 * usize::from(*by) % image.len();
                image.rotate_left(by);
            }
        }
    }
}

fuzz_target!(|data: &[u8]| {
    let Ok(animation) = Animation::arbitrary(&mut Unstructured::new(data)) else { return };
    let width = u32::from(animation.width) % 1000 + 1;
    let height = u32::from(animation.height) % (PIXELS / width).clamp(1, 1000) + 1;
    let fps = f64::from(animation.pace % 20_000) / 100.0;
    let settings = Settings::new(fps, animation.loops);

    let mut bytes = Vec::new();
    let Ok(mut encoder) = Encoder::new(&mut bytes, settings.clone()) else {
        assert!(fps < 0.01, "{fps} frames a second refused");
        return;
    };
    let mut image = RgbImage::new(width, height);
    let mut meant = Vec::new();
    for frame in animation.frames.iter().take(40) {
        if let Frame::Odd { width: w, height: h } = frame {
            let size = (u32::from(*w), u32::from(*h));
            if size == (width, height) || (meant.is_empty() && size.0 > 0 && size.1 > 0) {
                continue;
            }
            match encoder.push(RgbImage::new(size.0, size.1)) {
                Err(Error::Size { frame, found }) => {
                    assert!(frame == meant.len() as u64 + 1 && found == size && size.0.min(size.1) == 0);
                }
                Err(Error::UnlikeSize { frame, found, expected }) => {
                    assert!(frame == meant.len() as u64 + 1 && found == size && expected == (width, height));
                }
                other => panic!("a frame of {size:?} in {width} x {height}: {other:?}"),
            }
            continue;
        }
        frame.draw(&mut image);
        encoder.push(image.clone()).expect("a frame as large as the others");
        meant.push(image.clone());
    }
    let summary = match encoder.finish() {
        Err(Error::NoFrames) => {
            assert!(meant.is_empty());
            return;
        }
        other => other.expect("memory takes any number of bytes"),
    };
    assert_eq!(summary.size, (width, height));
    assert_eq!(summary.frames + summary.dropped, meant.len() as u64);
    assert_eq!(summary.bytes, bytes.len() as u64);

    // Above 50 frames a second the first of each fiftieth of a second is kept, but of the last one the last.
    let kept = |k: usize| {
        let slot = |k: usize| (k as f64 * 50.0 / fps).floor();
        fps <= 50.0 || k == 0 || slot(k) > slot(k - 1)
    };
    let mut expected = (0..meant.len()).filter(|&k| kept(k)).collect::<Vec<_>>();
    if let Some(last) = expected.last_mut() {
        *last = meant.len() - 1;
    }
    let (shown, duration) = decode(&bytes, (width, height));
    assert_eq!(shown.len(), expected.len());
    assert_eq!(shown.len() as u64, summary.frames);
    assert_eq!(duration, summary.duration_cs);
    let time = if fps > 50.0 { 2.0 * shown.len() as f64 } else { meant.len() as f64 * 100.0 / fps };
    assert!((duration as f64 - time).abs() <= 0.5 + 1e-6, "{duration} for {time}");
    for (k, seen) in expected.into_iter().zip(&shown) {
        let colours = meant[k].pixels().collect::<HashSet<_>>().len();
        // Frames are too small to drift.
        if colours <= 256 {
            assert!(meant[k] == *seen, "frame {} of {colours} colours is not exact", k + 1);
        } else {
            let error = error(&meant[k], seen);
            assert!(error < 30.0 * 30.0, "frame {}: mean squared error {error}", k + 1);
        }
    }
});

/// Returns the frames that a viewer sees, and their total time in hundredths of a second.
fn decode(bytes: &[u8], size: (u32, u32)) -> (Vec<RgbImage>, u64) {
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    options.check_frame_consistency(true);
    let mut decoder = options.read_info(bytes).expect("a GIF");
    assert_eq!((u32::from(decoder.width()), u32::from(decoder.height())), size);
    let mut canvas = RgbImage::new(size.0, size.1);
    let (mut shown, mut duration) = (Vec::new(), 0);
    while let Some(frame) = decoder.read_next_frame().expect("a frame") {
        assert_eq!(frame.dispose, gif::DisposalMethod::Keep);
        for (k, rgba) in frame.buffer.chunks_exact(4).enumerate() {
            let x = u32::from(frame.left) + k as u32 % u32::from(frame.width);
            let y = u32::from(frame.top) + k as u32 / u32::from(frame.width);
            match rgba[3] {
                0 => assert!(!shown.is_empty(), "a hole in the first frame"),
                _ => canvas.put_pixel(x, y, Rgb([rgba[0], rgba[1], rgba[2]])),
            }
        }
        duration += u64::from(frame.delay);
        shown.push(canvas.clone());
    }
    (shown, duration)
}

/// The mean squared difference of levels.
fn error(a: &RgbImage, b: &RgbImage) -> f64 {
    let sum = a.iter().zip(b.iter()).map(|(&a, &b)| u64::from(a.abs_diff(b)).pow(2)).sum::<u64>();
    sum as f64 / a.len() as f64
}
