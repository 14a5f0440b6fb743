//! Slow fades through the encoder and an independent decoder. No pixel of a frame is further off than 1.25 times the
//! worst pixel of that frame encoded alone, however many frames precede it. So errors do not accumulate.
//!
//! A failure prints the seed; `RAYFOLD_SEED` sets another one, and `RAYFOLD_FADES=1000` the number of animations.

use std::collections::HashSet;

use super::generator::Fade;
use image::{Rgb, RgbImage};
use rayfold_gif::{Encoder, Settings};

/// The number of animations.
const ANIMATIONS: usize = 24;

fn from_environment<T: std::str::FromStr>(name: &str, otherwise: T) -> T {
    std::env::var(name).ok().and_then(|value| value.parse().ok()).unwrap_or(otherwise)
}

fn encode(frames: &[RgbImage]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, Settings::default()).unwrap();
    frames.iter().for_each(|frame| encoder.push(frame.clone()).unwrap());
    encoder.finish().unwrap();
    bytes
}

/// Returns the frames that a viewer shows.
fn decode(bytes: &[u8]) -> Vec<RgbImage> {
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(bytes).unwrap();
    let mut canvas = RgbImage::new(decoder.width().into(), decoder.height().into());
    let mut shown = Vec::new();
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        for (k, rgba) in frame.buffer.chunks_exact(4).enumerate() {
            let x = u32::from(frame.left) + k as u32 % u32::from(frame.width);
            let y = u32::from(frame.top) + k as u32 / u32::from(frame.width);
            if rgba[3] > 0 {
                canvas.put_pixel(x, y, Rgb([rgba[0], rgba[1], rgba[2]]));
            }
        }
        shown.push(canvas.clone());
    }
    shown
}

/// Returns the largest difference of a level.
fn worst(meant: &RgbImage, seen: &RgbImage) -> u8 {
    meant.iter().zip(seen.iter()).map(|(a, b)| a.abs_diff(*b)).max().unwrap()
}

/// Returns the largest error of a frame that is encoded alone.
fn worst_alone(frame: &RgbImage) -> u8 {
    worst(frame, &decode(&encode(std::slice::from_ref(frame)))[0])
}

/// Returns the largest ratio of a frame's worst error to that of the frame alone; `None` if one is too far off.
fn ratio(frames: &[RgbImage]) -> Option<f64> {
    let shown = decode(&encode(frames));
    assert_eq!(shown.len(), frames.len());
    let mut most = 0.0_f64;
    for (number, (meant, seen)) in frames.iter().zip(&shown).enumerate() {
        let (found, alone) = (f64::from(worst(meant, seen)), f64::from(worst_alone(meant)));
        let few = meant.pixels().collect::<HashSet<_>>().len() <= 256;
        assert!(!few || alone == 0.0, "frame {number} of few colours is not exact alone");
        if found > 1.25 * alone {
            println!("frame {number} is off by {found} levels, alone by {alone}");
            return None;
        }
        most = most.max(if found > 0.0 { found / alone } else { 0.0 });
    }
    Some(most)
}

#[test]
fn no_fade_is_further_off_than_its_frames_alone() {
    let seed = from_environment("RAYFOLD_SEED", 20_261_125);
    let animations = from_environment("RAYFOLD_FADES", ANIMATIONS);
    println!("no_fade_is_further_off_than_its_frames_alone: RAYFOLD_SEED={seed}");
    let mut dice = fastrand::Rng::with_seed(seed);
    let (mut frames, mut most, mut failed) = (0, 0.0_f64, 0);
    for number in 0..animations {
        let fade = Fade::at_random(&mut dice);
        let drawn = (0..fade.frames).map(|k| fade.frame(k)).collect::<Vec<_>>();
        frames += drawn.len();
        match ratio(&drawn) {
            Some(ratio) => most = most.max(ratio),
            None => {
                failed += 1;
                println!("animation {number}: {fade:?}");
            }
        }
    }
    println!("{animations} animations, {frames} frames: at most {most} times as far off as alone");
    assert_eq!(failed, 0, "animations with a pixel that is too far off");
}

/// A floor under three lamps of different colours, which brighten from black by about half a level per frame.
#[test]
fn a_slow_fade_leaves_no_fingerprints() {
    let lamps = [(40.0, 20.0), (120.0, 25.0), (80.0, 90.0)];
    let floor = |number: u32| {
        RgbImage::from_fn(160, 120, |x, y| {
            let light = lamps.map(|(left, top)| {
                let (dx, dy) = (f64::from(x) - left, f64::from(y) - top);
                0.6 / (1.0 + (dx * dx + dy * dy) / 4_000.0)
            });
            Rgb(light.map(|light| (light * f64::from(number) + 0.5) as u8))
        })
    };
    let frames = (1..=100).map(floor).collect::<Vec<_>>();
    let most = ratio(&frames);
    assert!(most.is_some_and(|most| most <= 1.25), "{most:?}");
}
