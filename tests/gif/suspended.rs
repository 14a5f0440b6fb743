//! An animation that is suspended between frames and resumed has the same bytes as one that is encoded at once.
//!
//! The frames are random, of kinds for which the encoder keeps state: gradients that drift, noise, few colours, parts
//! that stay while their colours are still refined. A failure prints the seed; `RAYFOLD_SEED` sets another one.

use std::io::{Read, Write};
use std::num::NonZeroU16;

use super::generator::Fade;
use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use image::{Rgb, RgbImage};
use rayfold_gif::{Encoder, Error, Plays, Settings, Summary};

/// The number of animations.
const ANIMATIONS: usize = 60;

struct Animation {
    settings: Settings,
    frames: Vec<RgbImage>,
}

/// Draws the next frame over the last one.
fn draw(image: &mut RgbImage, dice: &mut fastrand::Rng) {
    let (width, height) = image.dimensions();
    let rgb = |dice: &mut fastrand::Rng| [dice.u8(..), dice.u8(..), dice.u8(..)];
    match dice.u8(0..9) {
        0 => {}
        1 => {
            let colour = rgb(dice);
            image.pixels_mut().for_each(|pixel| *pixel = Rgb(colour));
        }
        2 => {
            let (a, b, c) = (rgb(dice), rgb(dice), rgb(dice));
            for (x, y, pixel) in image.enumerate_pixels_mut() {
                let part = |k: usize| x * u32::from(b[k]) / width + y * u32::from(c[k]) / height;
                *pixel = Rgb([0, 1, 2].map(|k| (u32::from(a[k]) + part(k)) as u8));
            }
        }
        3 => {
            let mask = [0xff, 0x81, 0xc0][dice.usize(0..3)];
            image.iter_mut().for_each(|level| *level = dice.u8(..) & mask);
        }
        // A slow fade.
        4 | 5 => image.pixels_mut().for_each(|pixel| pixel.0 = pixel.0.map(|level| level.wrapping_add(1))),
        // A block moves over parts that stay: the rest is refined.
        6 | 7 => {
            let (left, top, colour) = (dice.u32(0..width), dice.u32(0..height), rgb(dice));
            for y in top..height.min(top + 12) {
                for x in left..width.min(left + 12) {
                    image.put_pixel(x, y, Rgb(colour.map(|level| level.wrapping_add((x * 3 + y) as u8))));
                }
            }
        }
        _ => image.rotate_left(3 * dice.usize(0..(width * height) as usize)),
    }
}

fn animation(dice: &mut fastrand::Rng) -> Animation {
    let plays = match dice.u8(0..3) {
        0 => Plays::Endless,
        1 => Plays::Once,
        _ => Plays::Repeated(NonZeroU16::new(dice.u16(1..)).unwrap()),
    };
    // Above 50 per second frames are dropped.
    let fps = f64::from(dice.u32(1..9_000)) / 100.0;
    let last_delay_cs = dice.bool().then(|| dice.u16(..));
    let settings = Settings { fps, plays, last_delay_cs, exact: dice.bool(), ..Settings::default() };
    let mut image = RgbImage::new(dice.u32(1..120), dice.u32(1..120));
    // Noise, so that there are errors to refine from the beginning.
    if dice.bool() {
        image.iter_mut().for_each(|level| *level = dice.u8(..));
    }
    let frames = (0..dice.usize(1..14)).map(|_| {
        draw(&mut image, dice);
        image.clone()
    });
    let frames = frames.collect();
    Animation { settings, frames }
}

impl Animation {
    fn whole(&self) -> (Vec<u8>, Summary) {
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, self.settings.clone()).unwrap();
        self.frames.iter().for_each(|frame| encoder.push(frame.clone()).unwrap());
        let summary = encoder.finish().unwrap();
        (bytes, summary)
    }

    /// Encodes the animation, suspended before each frame of `cuts`, which may include the end.
    fn in_pieces(&self, cuts: impl Fn(usize) -> bool) -> (Vec<u8>, Summary) {
        let (mut bytes, mut state) = (Vec::new(), None::<Vec<u8>>);
        let mut at = 0;
        loop {
            let mut piece = Vec::new();
            let mut encoder = match &state {
                None => Encoder::new(&mut piece, self.settings.clone()).unwrap(),
                Some(state) => Encoder::resume(&mut piece, state).unwrap(),
            };
            let first = at;
            while at < self.frames.len() && (at == first && state.is_some() || !cuts(at)) {
                encoder.push(self.frames[at].clone()).unwrap();
                at += 1;
            }
            if at == self.frames.len() && !(cuts(at) && at > first) {
                let summary = encoder.finish().unwrap();
                bytes.append(&mut piece);
                return (bytes, summary);
            }
            state = Some(encoder.suspend().unwrap());
            bytes.append(&mut piece);
        }
    }
}

#[test]
fn whatever_an_animation_is_cut_after_its_bytes_are_the_same() {
    let seed = std::env::var("RAYFOLD_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(20_261_123);
    println!("whatever_an_animation_is_cut_after_its_bytes_are_the_same: RAYFOLD_SEED={seed}");
    let mut dice = fastrand::Rng::with_seed(seed);
    for number in 0..ANIMATIONS {
        let animation = animation(&mut dice);
        let whole = animation.whole();
        let frames = animation.frames.len();
        for cut in 0..=frames {
            let found = animation.in_pieces(|at| at == cut);
            assert!(found == whole, "animation {number}, cut after {cut} of {frames} frames");
        }
        assert!(animation.in_pieces(|_| true) == whole, "animation {number}, cut after each frame");
        let lot = dice.u64(..);
        assert!(animation.in_pieces(|at| lot >> at & 1 == 1) == whole, "animation {number}, cut at {lot:b}");
    }
}

/// Frames that are large enough to drift, and then do not.
#[test]
fn a_large_slow_fade_that_is_cut_has_the_same_bytes() {
    let sky = |k: u32| {
        let level = |x: u32, y: u32| 40 + (x + y) / 8 + k;
        RgbImage::from_fn(400, 300, |x, y| Rgb([level(x, y) as u8, 60, if k < 5 { 9 } else { x as u8 }]))
    };
    for exact in [false, true] {
        let settings = Settings { exact, ..Settings::default() };
        let animation = Animation { settings, frames: (0..8).map(sky).collect() };
        let whole = animation.whole();
        for cut in 1..8 {
            assert!(animation.in_pieces(|at| at == cut) == whole, "cut after {cut} frames, exact: {exact}");
        }
        assert!(animation.in_pieces(|_| true) == whole, "cut after each frame, exact: {exact}");
    }
}

/// A fade whose pixels are left until their error is too large. A decision that depends on the previous drawn frame is
/// the same in another process.
#[test]
fn slow_fades_that_are_cut_have_the_same_bytes() {
    let mut dice = fastrand::Rng::with_seed(3);
    for number in 0..4 {
        let fade = Fade::at_random(&mut dice);
        let frames = (0..fade.frames.min(12)).map(|k| fade.frame(k)).collect();
        let animation = Animation { settings: Settings::default(), frames };
        let whole = animation.whole();
        assert!(animation.in_pieces(|_| true) == whole, "fade {number}, cut after each frame: {fade:?}");
        let lot = dice.u64(..);
        assert!(animation.in_pieces(|at| lot >> (at % 64) & 1 == 1) == whole, "fade {number}: {fade:?}");
    }
}

fn state() -> Vec<u8> {
    let mut encoder = Encoder::new(Vec::new(), Settings::default()).unwrap();
    let mut dice = fastrand::Rng::with_seed(7);
    let mut image = RgbImage::new(12, 10);
    for _ in 0..3 {
        image.iter_mut().for_each(|level| *level = dice.u8(..));
        encoder.push(image.clone()).unwrap();
    }
    encoder.suspend().unwrap()
}

fn refused(state: &[u8]) -> Error {
    Encoder::resume(Vec::new(), state).err().expect("it is refused")
}

#[test]
fn a_state_of_another_version_is_refused_as_that() {
    let mut state = state();
    state[8] ^= 1;
    assert!(matches!(refused(&state), Error::StateVersion));
}

/// A state that is truncated at any byte is rejected. One with a flipped bit is rejected too, except for a few bits
/// without meaning.
#[test]
fn a_damaged_state_is_refused() {
    let whole = state();
    for end in 0..whole.len() {
        assert!(matches!(refused(&whole[..end]), Error::State { .. }), "cut off after {end}");
    }
    assert!(matches!(refused(b"GIF89a"), Error::State { .. }));
    let (mut found, mut missed) = (0, 0);
    for at in 0..whole.len() {
        for bit in 0..8 {
            let mut damaged = whole.clone();
            damaged[at] ^= 1 << bit;
            match Encoder::resume(Vec::new(), &damaged) {
                Err(Error::StateVersion | Error::State { .. }) => found += 1,
                Err(error) => panic!("bit {bit} of byte {at}: {error}"),
                Ok(encoder) => {
                    assert!(encoder.suspend().unwrap() == whole, "bit {bit} of byte {at}");
                    missed += 1;
                }
            }
        }
    }
    println!("{found} damages found, {missed} without effect");
    // The time and the system in gzip's header, and deflate's padding.
    assert!(missed < 150 && found > 20 * missed, "{found} found, {missed} missed");
}

/// A state with a correct checksum and random content is rejected or encoded to an end.
#[test]
fn a_state_of_any_content_breaks_nothing() {
    let mut dice = fastrand::Rng::with_seed(11);
    let whole = state();
    let (start, packed) = whole.split_at(16);
    let mut body = Vec::new();
    GzDecoder::new(packed).read_to_end(&mut body).unwrap();
    let (mut refused, mut finished) = (0, 0);
    for _ in 0..20_000 {
        let mut body = body.clone();
        for _ in 0..dice.usize(1..4) {
            // Usually the numbers before the pixels.
            let most = if dice.u8(0..4) > 0 { body.len().min(140) } else { body.len() };
            let at = dice.usize(0..most);
            body[at] = [dice.u8(..), 0, 0x7f, 0xff][dice.usize(0..4)];
        }
        let mut state = GzEncoder::new(start.to_vec(), Compression::none());
        state.write_all(&body).unwrap();
        match Encoder::resume(Vec::new(), &state.finish().unwrap()) {
            Err(Error::State { .. }) => refused += 1,
            Err(error) => panic!("{error}"),
            Ok(mut encoder) => {
                let frame = RgbImage::from_fn(12, 10, |_, _| Rgb([dice.u8(..), dice.u8(..), dice.u8(..)]));
                let _ = encoder.push(frame);
                encoder.finish().unwrap();
                finished += 1;
            }
        }
    }
    assert!(refused > 1_000 && finished > 1_000, "{refused} refused, {finished} finished");
}

/// The errors for later frames do not depend on the suspension.
#[test]
fn a_resumed_animation_refuses_what_it_refused_before() {
    let mut encoder = Encoder::resume(Vec::new(), &state()).unwrap();
    let error = encoder.push(RgbImage::new(4, 4)).unwrap_err();
    assert!(matches!(error, Error::UnlikeSize { frame: 4, found: (4, 4), expected: (12, 10) }), "{error:?}");
}
