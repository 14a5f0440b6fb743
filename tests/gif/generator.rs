//! Random fades: a picture whose levels change slowly, in one channel or in all, alone or beside parts that stay or
//! move.

use image::{Rgb, RgbImage};

/// An animation that is drawn frame by frame.
#[derive(Debug)]
pub(crate) struct Fade {
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) frames: u32,
    picture: Picture,
    seed: u32,
    base: [f64; 3],
    /// The increase in levels from left to right and from top to bottom.
    across: [f64; 3],
    down: [f64; 3],
    /// The change in levels per frame.
    slope: [f64; 3],
    /// The number of frames after which the slope changes its sign.
    turn: u32,
    /// Whether brighter pixels change more.
    scales: bool,
    /// The movement of the picture in pixels per frame.
    speed: f64,
    /// The share of the picture's width that does not change.
    still: f64,
    /// Whether a ball moves over the picture.
    ball: bool,
    /// The number of frames in which a patch of bright noise covers a part.
    patch: u32,
}

#[derive(Debug, Clone, Copy)]
enum Picture {
    Gradient,
    Glow,
    Noise,
    /// Noise that is new in each frame.
    Grain,
    Texture,
    /// A gradient with noise of a few levels.
    Dithered,
}

impl Fade {
    /// Chooses the picture and its changes.
    pub(crate) fn at_random(dice: &mut fastrand::Rng) -> Self {
        let picture = [
            Picture::Gradient,
            Picture::Gradient,
            Picture::Glow,
            Picture::Noise,
            Picture::Grain,
            Picture::Texture,
            Picture::Dithered,
        ][dice.usize(0..7)];
        let slope = [0.125, 0.25, 0.4, 0.5, 0.6, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0][dice.usize(0..11)]
            * if dice.bool() { 1.0 } else { -1.0 };
        let of = |dice: &mut fastrand::Rng, most: f64| {
            let all = dice.f64() * most;
            match dice.u8(0..3) {
                0 => [all; 3],
                1 => {
                    let mut one = [0.0; 3];
                    one[dice.usize(0..3)] = all;
                    one
                }
                _ => [dice.f64() * most, dice.f64() * most, dice.f64() * most],
            }
        };
        let weights = of(dice, 1.0);
        let most = weights.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        let slope = weights.map(|weight| slope * weight / most);
        let rising = slope.iter().sum::<f64>() > 0.0;
        let base = of(dice, 120.0).map(|level| if rising { level } else { 255.0 - level });
        // Large pictures have more colours than the encoder counts individually.
        let large = dice.u8(0..16) == 0;
        let side = if large { 150..260 } else { 8..120 };
        Self {
            width: dice.u32(side.clone()),
            height: dice.u32(side),
            frames: dice.u32(if large { 3..8 } else { 6..60 }),
            picture,
            seed: dice.u32(..),
            base,
            across: of(dice, 200.0).map(|levels| if rising { levels } else { -levels }),
            down: of(dice, 200.0).map(|levels| if dice.bool() { levels } else { -levels }),
            slope,
            turn: [u32::MAX, dice.u32(3..40)][dice.usize(0..2)],
            scales: dice.u8(0..3) == 0,
            speed: if dice.u8(0..3) == 0 { dice.f64() * 2.0 } else { 0.0 },
            still: if dice.u8(0..3) == 0 { dice.f64() } else { 0.0 },
            ball: dice.u8(0..4) == 0,
            patch: if dice.u8(0..4) == 0 { dice.u32(1..12) } else { 0 },
        }
    }

    /// Returns the frame of a number, from 0.
    pub(crate) fn frame(&self, number: u32) -> RgbImage {
        RgbImage::from_fn(self.width, self.height, |x, y| {
            let (radius, centre) = (f64::from(self.height) / 5.0, f64::from(number) * 1.7);
            let (dx, dy) = (f64::from(x) - centre, f64::from(y) - f64::from(self.height) / 2.0);
            let far = (dx * dx + dy * dy).sqrt() / radius;
            if self.ball && far < 1.0 {
                let light = (1.0 - far * far).sqrt();
                return Rgb([(250.0 * light) as u8, (150.0 * light) as u8, 60]);
            }
            if number < self.patch && x < self.width / 4 && y % 4 < 3 {
                return Rgb([0, 8, 16].map(|shift| (scatter(x << 16 ^ y ^ self.seed) >> shift) as u8));
            }
            let changes = f64::from(x) >= self.still * f64::from(self.width);
            let time = if changes { number } else { 0 };
            let shift = f64::from(time) * self.speed;
            let (u, v) =
                ((f64::from(x) + shift) / f64::from(self.width), f64::from(y) / f64::from(self.height));
            let steps = match time.checked_div(self.turn).unwrap_or(0) % 2 {
                0 => time.checked_rem(self.turn).unwrap_or(time),
                _ => self.turn - time % self.turn,
            };
            let random = |time: u32, k: u32| {
                let at = (x + shift as u32) | y << 12;
                f64::from(scatter(scatter(scatter(at) ^ self.seed ^ time << 24) + k) & 0xffff) / 65_535.0
            };
            let level = |k: usize| {
                let (across, down, number) = (self.across[k], self.down[k], k as u32);
                let picture = match self.picture {
                    Picture::Gradient => across * u + down * v,
                    Picture::Glow => across / (1.0 + 6.0 * ((u - 0.5).powi(2) + (v - 0.4).powi(2))),
                    Picture::Noise => across * random(0, number),
                    Picture::Grain => across * u + 0.2 * down * random(time, number),
                    Picture::Texture => {
                        let (x, y) = (8.0 * u, 8.0 * v);
                        across * cloud(x, y, self.seed) + down * cloud(y + 30.0, x, self.seed)
                    }
                    Picture::Dithered => across * u + down * v + 4.0 * random(0, number),
                };
                let lit = if self.scales { (self.base[k] + picture) / 128.0 } else { 1.0 };
                self.base[k] + picture + lit * self.slope[k] * f64::from(steps)
            };
            Rgb([0, 1, 2].map(|k| level(k).round().clamp(0.0, 255.0) as u8))
        })
    }
}

fn scatter(k: u32) -> u32 {
    let k = (k ^ k >> 16).wrapping_mul(0x7feb_352d);
    let k = (k ^ k >> 15).wrapping_mul(0x846c_a68b);
    k ^ k >> 16
}

/// Returns value noise of four octaves, from 0 to 1.
fn cloud(x: f64, y: f64, seed: u32) -> f64 {
    let octave = |octave: i32| {
        let (x, y) = (x * f64::from(1 << octave), y * f64::from(1 << octave));
        let (left, top) = (x.floor(), y.floor());
        let (fx, fy) = (x - left, y - top);
        let (sx, sy) = (fx * fx * (3.0 - 2.0 * fx), fy * fy * (3.0 - 2.0 * fy));
        let at = |dx: i32, dy: i32| {
            let (x, y) = (left as i32 + dx, top as i32 + dy);
            f64::from(scatter(x as u32 ^ scatter(y as u32 ^ scatter(seed ^ octave as u32))) & 0xffff)
                / 65_535.0
        };
        let row = |dy| at(0, dy) + (at(1, dy) - at(0, dy)) * sx;
        (row(0) + (row(1) - row(0)) * sy) * 0.5_f64.powi(octave + 1)
    };
    (0..4).map(octave).sum()
}
