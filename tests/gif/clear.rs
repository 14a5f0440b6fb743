//! Frames with alpha in a GIF: what a viewer sees of each, decoded by the `gif` crate and put together by the rules of GIF89a.
//!
//! Animations are random; a failure prints the seed. `RAYFOLD_SEED` sets another one.

use image::{DynamicImage, Rgba, RgbaImage};
use rayfold_gif::{Encoder, Settings};

/// Returns what a viewer sees: each frame on the canvas that the one before it has left.
fn shown(file: &[u8]) -> Vec<RgbaImage> {
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(file).unwrap();
    let mut canvas = RgbaImage::new(decoder.width().into(), decoder.height().into());
    let mut seen = vec![];
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        let (left, top, width) = (u32::from(frame.left), u32::from(frame.top), u32::from(frame.width));
        let place = |at: usize| (left + at as u32 % width, top + at as u32 / width);
        let (pixels, _) = frame.buffer.as_chunks::<4>();
        for (at, &pixel) in pixels.iter().enumerate().filter(|(_, pixel)| pixel[3] > 0) {
            canvas.put_pixel(place(at).0, place(at).1, Rgba(pixel));
        }
        seen.push(canvas.clone());
        match frame.dispose {
            gif::DisposalMethod::Keep | gif::DisposalMethod::Any => {}
            gif::DisposalMethod::Background => {
                (0..pixels.len()).for_each(|at| canvas.put_pixel(place(at).0, place(at).1, Rgba([0; 4])));
            }
            gif::DisposalMethod::Previous => panic!("not used"),
        }
    }
    seen
}

fn encoded(frames: &[DynamicImage], suspended: bool) -> Vec<u8> {
    let mut file = vec![];
    let mut state = Encoder::new(&mut file, Settings::default()).unwrap().suspend().unwrap();
    if suspended {
        for frame in frames {
            let mut encoder = Encoder::resume(&mut file, &state).unwrap();
            encoder.push(frame.clone()).unwrap();
            state = encoder.suspend().unwrap();
        }
        Encoder::resume(&mut file, &state).unwrap().finish().unwrap();
    } else {
        let mut encoder = Encoder::new(&mut file, Settings::default()).unwrap();
        frames.iter().for_each(|frame| encoder.push(frame.clone()).unwrap());
        encoder.finish().unwrap();
    }
    file
}

/// Returns a frame with a disc whose rim is covered in part.
fn disc(dice: &mut fastrand::Rng, (width, height): (u32, u32), colours: u32) -> RgbaImage {
    let (x, y, radius) = (dice.f32() * width as f32, dice.f32() * height as f32, 2.0 + dice.f32() * 20.0);
    RgbaImage::from_fn(width, height, |i, j| {
        let far = (i as f32 - x).hypot(j as f32 - y);
        let alpha = (255.0 * ((radius - far) / 4.0 + 0.5).clamp(0.0, 1.0)) as u8;
        let level = |k: u32| ((i * 7 + j * 13 + k * 31) % colours * 255 / colours) as u8;
        if alpha == 0 { Rgba([0; 4]) } else { Rgba([level(0), level(1), level(2), alpha]) }
    })
}

#[test]
fn a_viewer_sees_what_is_covered_and_through_the_rest() {
    let seed = std::env::var("RAYFOLD_SEED").map_or(20_261_126, |seed| seed.parse().unwrap());
    println!("seed {seed}");
    let mut dice = fastrand::Rng::with_seed(seed);
    for case in 0..60 {
        let size = (dice.u32(1..90), dice.u32(1..90));
        // Few colours are kept exactly.
        let colours = [3, 200, 2000][case % 3];
        let frames: Vec<DynamicImage> = (0..dice.usize(1..9))
            .map(|_| {
                let frame = disc(&mut dice, size, colours);
                // Frames without alpha, and frames whose alpha covers all.
                match dice.u8(0..6) {
                    0 => DynamicImage::ImageRgba8(frame).into_rgb8().into(),
                    1 => DynamicImage::from(DynamicImage::ImageRgba8(frame).into_rgb8()).into_rgba8().into(),
                    2 => RgbaImage::new(size.0, size.1).into(),
                    _ => frame.into(),
                }
            })
            .collect();
        let file = encoded(&frames, false);
        assert!(encoded(&frames, true) == file, "case {case}");
        let seen = shown(&file);
        assert_eq!(seen.len(), frames.len(), "case {case}");
        for (number, (frame, seen)) in frames.iter().zip(&seen).enumerate() {
            let frame = frame.to_rgba8();
            let mut drawn = 0.0;
            for (pixel, seen) in frame.pixels().zip(seen.pixels()) {
                match pixel[3] {
                    0 => assert_eq!(seen[3], 0, "case {case}, frame {number}"),
                    255 => assert_eq!(seen[3], 255, "case {case}, frame {number}"),
                    _ => {}
                }
                drawn += f64::from(seen[3]) - f64::from(pixel[3]);
                if seen[3] == 255 && colours == 3 {
                    assert_eq!(seen.0[..3], pixel.0[..3], "case {case}, frame {number}");
                }
                if seen[3] == 255 {
                    let apart = (0..3).map(|k| seen[k].abs_diff(pixel[k])).max().unwrap();
                    assert!(apart < 128, "case {case}, frame {number}: {apart}");
                }
            }
            // The pattern draws as much as is covered.
            assert!(drawn.abs() / 255.0 < 20.0, "case {case}, frame {number}: {drawn}");
        }
    }
}

#[test]
fn opaque_frames_with_alpha_make_the_file_of_frames_without() {
    let mut dice = fastrand::Rng::with_seed(5);
    let frames: Vec<_> =
        (0..5).map(|_| DynamicImage::ImageRgba8(disc(&mut dice, (60, 40), 500)).into_rgb8()).collect();
    let plain: Vec<DynamicImage> = frames.iter().map(|frame| frame.clone().into()).collect();
    let covered: Vec<DynamicImage> =
        plain.iter().map(|frame| DynamicImage::ImageRgba8(frame.to_rgba8())).collect();
    assert!(encoded(&plain, false) == encoded(&covered, false));
}

#[test]
fn rests_of_frames_above_fifty_a_second_are_held_with_their_alpha() {
    let mut dice = fastrand::Rng::with_seed(6);
    let frames: Vec<DynamicImage> = (0..20).map(|_| disc(&mut dice, (30, 20), 90).into()).collect();
    let settings = Settings { fps: 120.0, ..Settings::default() };
    let mut whole = vec![];
    let mut encoder = Encoder::new(&mut whole, settings.clone()).unwrap();
    frames.iter().for_each(|frame| encoder.push(frame.clone()).unwrap());
    encoder.finish().unwrap();
    let mut parts = vec![];
    let mut state = Encoder::new(&mut parts, settings).unwrap().suspend().unwrap();
    for frame in &frames {
        let mut encoder = Encoder::resume(&mut parts, &state).unwrap();
        encoder.push(frame.clone()).unwrap();
        state = encoder.suspend().unwrap();
    }
    Encoder::resume(&mut parts, &state).unwrap().finish().unwrap();
    assert!(whole == parts);
    // The last frame is there, with the alpha that it has.
    let (seen, last) = (shown(&whole).pop().unwrap(), frames[19].to_rgba8());
    assert!(seen.pixels().zip(last.pixels()).all(|(seen, last)| last[3] != 255 || seen[3] == 255));
}
