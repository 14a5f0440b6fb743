//! The conversion of colours to levels by the sRGB curve (IEC 61966-2-1).
//!
//! A level is the number of thresholds that are at most the colour. The thresholds are computed at compile time, with
//! sums, products and quotients alone, so that they are the same on every machine.

use rayfold_scene::Tone;

use glam::DVec3;

use crate::parallel::CHANNELS;

/// The smallest linear light of each level; [`f64::INFINITY`] after the last, so that each search ends.
static THRESHOLDS: [f64; 257] = thresholds();

/// The number of intervals of 0..1 whose first level is tabulated. An interval contains at most two levels.
const PARTS: usize = 4096;

static FIRST: [u8; PARTS + 1] = first_levels();

const fn thresholds() -> [f64; 257] {
    let mut thresholds = [f64::NEG_INFINITY; 257];
    let mut level = 1;
    while level < 256 {
        let encoded = (level as f64 - 0.5) / 255.0;
        thresholds[level] =
            if encoded <= 0.04045 { encoded / 12.92 } else { power((encoded + 0.055) / 1.055) };
        level += 1;
    }
    thresholds[256] = f64::INFINITY;
    thresholds
}

/// Returns `x` to the power of 2.4, for 0 < x <= 1: x² times the fifth root of x², by Newton's method.
const fn power(x: f64) -> f64 {
    let square = x * x;
    let mut root = 1.0;
    let mut step = 0;
    while step < 40 {
        let fourth = root * root * root * root;
        root -= (fourth * root - square) / (5.0 * fourth);
        step += 1;
    }
    square * root
}

const fn first_levels() -> [u8; PARTS + 1] {
    let mut first = [0; PARTS + 1];
    let (mut part, mut level) = (0, 0);
    while part <= PARTS {
        while THRESHOLDS[level + 1] <= part as f64 / PARTS as f64 {
            level += 1;
        }
        first[part] = level as u8;
        part += 1;
    }
    first
}

/// Returns the level of a channel of linear light. A NaN is black.
#[inline(always)]
pub(crate) fn encoded(channel: f64) -> u8 {
    let light = if channel > 0.0 { channel.min(1.0) } else { 0.0 };
    let mut level = usize::from(FIRST[(light * PARTS as f64) as usize]);
    while THRESHOLDS[level + 1] <= light {
        level += 1;
    }
    level as u8
}

/// Returns the levels of a colour.
pub(crate) fn levels(color: DVec3, tone: Tone) -> [u8; CHANNELS] {
    match tone {
        Tone::Plain => crate::reference::levels(color),
        Tone::Srgb => color.to_array().map(encoded),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(light: f64) -> f64 {
        if light <= 0.0031308 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 }
    }

    #[test]
    fn levels_are_those_of_the_curve() {
        let mut dice = fastrand::Rng::with_seed(7);
        for k in 0..300_000 {
            let light = if k % 2 == 0 { dice.f64() } else { f64::from(k) / 300_000.0 };
            let exact = 255.0 * curve(light);
            let level = f64::from(encoded(light));
            assert!((level - exact).abs() <= 0.5 + 1e-9, "{light}: {level} for {exact}");
        }
    }

    #[test]
    fn light_beyond_the_ends_is_black_or_white() {
        for dark in [f64::NAN, f64::NEG_INFINITY, -1.0, -0.0, 0.0, 1e-300] {
            assert_eq!(encoded(dark), 0, "{dark}");
        }
        for bright in [1.0, 1.5, f64::INFINITY] {
            assert_eq!(encoded(bright), 255, "{bright}");
        }
    }

    #[test]
    fn thresholds_rise_and_levels_begin_at_them() {
        for level in 1..256 {
            let at = THRESHOLDS[level];
            assert!(THRESHOLDS[level - 1] < at && at < 1.0);
            assert_eq!(usize::from(encoded(at)), level);
            assert_eq!(usize::from(encoded(at * (1.0 - f64::EPSILON))), level - 1);
        }
    }
}
