//! Random frames through the encoder and an independent decoder. All frames are present in order, for their time, and
//! exact if they have at most 256 colours.
//!
//! This is a short version of the fuzz target `gif`. A failure prints the seed; `RAYFOLD_SEED` sets another one.

use std::collections::HashSet;

use image::{Rgb, RgbImage};
use rayfold_gif::{Encoder, Settings};

/// The number of animations.
const ANIMATIONS: usize = 100;

/// Draws the next frame over the last one.
fn draw(image: &mut RgbImage, dice: &mut fastrand::Rng) {
    let (width, height) = image.dimensions();
    let mut rgb = || [dice.u8(..), dice.u8(..), dice.u8(..)];
    let (a, b, c) = (rgb(), rgb(), rgb());
    match dice.u8(0..7) {
        0 => {}
        1 => image.pixels_mut().for_each(|pixel| *pixel = Rgb(a)),
        2 => {
            for (x, y, pixel) in image.enumerate_pixels_mut() {
                let part = |k: usize| x * u32::from(b[k]) / width + y * u32::from(c[k]) / height;
                *pixel = Rgb([0, 1, 2].map(|k| (u32::from(a[k]) + part(k)) as u8));
            }
        }
        3 => {
            let mask = [dice.u8(..), 0xff, 0x81][dice.usize(0..3)];
            image.iter_mut().for_each(|level| *level = dice.u8(..) & mask);
        }
        4 => image.put_pixel(dice.u32(0..width), dice.u32(0..height), Rgb(a)),
        5 => {
            image.pixels_mut().for_each(|pixel| pixel.0 = pixel.0.map(|level| level.saturating_sub(a[0] % 4)))
        }
        _ => image.rotate_left(3 * dice.usize(0..(width * height) as usize)),
    }
}

/// Returns the frames that a viewer shows, and their times in hundredths of a second.
fn decode(bytes: &[u8], size: (u32, u32)) -> Vec<(RgbImage, u64)> {
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    options.check_frame_consistency(true);
    let mut decoder = options.read_info(bytes).unwrap();
    let mut canvas = RgbImage::new(size.0, size.1);
    let mut shown = Vec::new();
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        for (k, rgba) in frame.buffer.chunks_exact(4).enumerate() {
            let x = u32::from(frame.left) + k as u32 % u32::from(frame.width);
            let y = u32::from(frame.top) + k as u32 / u32::from(frame.width);
            if rgba[3] > 0 {
                canvas.put_pixel(x, y, Rgb([rgba[0], rgba[1], rgba[2]]));
            } else {
                assert!(!shown.is_empty(), "a hole in the first frame");
            }
        }
        shown.push((canvas.clone(), u64::from(frame.delay)));
    }
    shown
}

/// Returns the mean squared error.
fn error(a: &RgbImage, b: &RgbImage) -> f64 {
    let sum = a.iter().zip(b.iter()).map(|(&a, &b)| f64::from(a.abs_diff(b)).powi(2)).sum::<f64>();
    sum / a.len() as f64
}

#[test]
fn any_frames_come_back() {
    let seed = std::env::var("RAYFOLD_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(20_261_121);
    println!("any_frames_come_back: RAYFOLD_SEED={seed}");
    let mut dice = fastrand::Rng::with_seed(seed);
    let (mut exact, mut near) = (0, 0);
    for animation in 0..ANIMATIONS {
        let size = (dice.u32(1..90), dice.u32(1..90));
        let fps = f64::from(dice.u32(1..5_000)) / 100.0;
        let mut image = RgbImage::new(size.0, size.1);
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, Settings { fps, ..Settings::default() }).unwrap();
        let meant = (0..dice.usize(1..12)).map(|_| {
            draw(&mut image, &mut dice);
            encoder.push(image.clone()).unwrap();
            image.clone()
        });
        let frames = meant.collect::<Vec<_>>();
        let summary = encoder.finish().unwrap();
        assert_eq!((summary.size, summary.frames), (size, frames.len() as u64), "animation {animation}");
        let shown = decode(&bytes, size);
        assert_eq!(shown.len(), frames.len(), "animation {animation}");
        let mut end = 0;
        for (k, (meant, (seen, delay))) in frames.iter().zip(&shown).enumerate() {
            end += delay;
            let time = (k + 1) as f64 * 100.0 / fps;
            assert!(
                (end as f64 - time).abs() <= 0.5 + 1e-6,
                "animation {animation}, frame {k}: {end} for {time}"
            );
            let few = meant.pixels().collect::<HashSet<_>>().len() <= 256;
            if few {
                assert!(meant == seen, "animation {animation}, frame {k} of {size:?} is not exact");
                exact += 1;
            } else {
                let error = error(meant, seen);
                assert!(error < 900.0, "animation {animation}, frame {k}: mean squared error {error}");
                near += 1;
            }
        }
    }
    assert!(exact > 50 && near > 50, "{exact} exact frames, {near} others: too few to tell");
}
