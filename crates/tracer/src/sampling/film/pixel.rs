//! The sums of a pixel's samples.

use glam::DVec3;
use rayfold_scene::Tone;

use super::curve::{BENT, LINEAR, SlopeBounds, slope};
use crate::parallel::CHANNELS;
use crate::reference::encoded;

/// Sums of channels count in parts of this, as integers, so that they do not depend on the order of the samples.
pub(super) const ONE: f64 = 65535.0;

/// The samples of a pixel so far.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pixel {
    /// Signed if samples are not clamped.
    sum: [u64; CHANNELS],
    /// The bits of an `f64` if samples are not clamped: the squares of bright samples are too large for integers. The
    /// samples of a pixel always come in the same order.
    squares: [u64; CHANNELS],
    count: u32,
}

/// An upper bound of the relative rounding errors of a variance and of its bounds.
const ROUNDED: f64 = 1e-5;

/// The brightest sample in pictures without clamping, in parts of [`ONE`].
const BRIGHTEST: f64 = (1u64 << 46) as f64;

/// 2^52. Adding it to a number rounds that number to an integer, which is then in the lowest bits.
const WHOLE: f64 = 4_503_599_627_370_496.0;

/// Returns a channel of a colour in parts of [`ONE`]. A NaN becomes black.
#[inline(always)]
pub(crate) fn quantised(channel: f64) -> u32 {
    let channel = if channel > 0.0 { channel } else { 0.0 };
    (channel.min(1.0) * ONE + WHOLE).to_bits() as u32
}

impl Pixel {
    /// Adds samples: their [`quantised`] channels.
    #[inline(always)]
    pub(crate) fn add(&mut self, channels: [&[u32]; CHANNELS]) {
        for ((sum, squares), levels) in self.sum.iter_mut().zip(&mut self.squares).zip(channels) {
            for &level in levels {
                *sum += u64::from(level);
                // At most 32 bits.
                *squares += u64::from(level.wrapping_mul(level));
            }
        }
        self.count += channels[0].len() as u32;
    }

    /// Adds `count` samples of the same [`quantised`] colour.
    // By itself, so that it is compiled alike whatever parts of the tracer surround it.
    #[inline(never)]
    pub(crate) fn add_equal(&mut self, color: [u32; CHANNELS], count: u32) {
        for ((sum, squares), level) in self.sum.iter_mut().zip(&mut self.squares).zip(color) {
            let level = u64::from(level);
            *sum += level * u64::from(count);
            *squares += level * level * u64::from(count);
        }
        self.count += count;
    }

    /// Adds `count` samples of the same colour without clamping.
    pub(crate) fn add_unclamped(&mut self, color: DVec3, count: u32) {
        let of_each = color.to_array();
        for ((sum, squares), channel) in self.sum.iter_mut().zip(&mut self.squares).zip(of_each) {
            // What is not a number is black.
            let level = (channel * ONE).round().clamp(-BRIGHTEST, BRIGHTEST) as i64;
            *sum = sum.wrapping_add_signed(level * i64::from(count));
            *squares =
                (f64::from_bits(*squares) + (level as f64) * (level as f64) * f64::from(count)).to_bits();
        }
        self.count += count;
    }

    #[inline(always)]
    pub(crate) fn count(&self) -> u32 {
        self.count
    }

    /// Returns the mean of all samples, in 0..1.
    pub(crate) fn mean(&self) -> DVec3 {
        let mean =
            DVec3::from_array(self.sum.map(|sum| sum as i64 as f64)) / (ONE * f64::from(self.count.max(1)));
        mean.clamp(DVec3::ZERO, DVec3::ONE)
    }

    /// Returns the mean before the sRGB curve. The curve would display means with errors too dark on average, so the
    /// mean is raised by the second-order term of that error.
    pub(crate) fn mean_before_curve(&self) -> DVec3 {
        let (count, mean) = (f64::from(self.count), self.mean());
        // The variance of a mean of n is that of its samples times about n^(-5/4).
        let of_mean = 1.0 / (count * count.sqrt().sqrt() * (ONE * ONE));
        let raised = core::array::from_fn(|channel| {
            let light = mean[channel];
            if light < LINEAR || self.count < 2 {
                return light;
            }
            (light + BENT * of_mean * self.spread(channel) / (2.0 * light)).min(1.0)
        });
        DVec3::from_array(raised)
    }

    /// Returns the variance of the samples of a channel, in squares of parts.
    #[inline(always)]
    fn spread(&self, channel: usize) -> f64 {
        let mean = self.sum[channel] as f64 * (1.0 / f64::from(self.count));
        let spread = (self.squares[channel] as f64 - self.sum[channel] as f64 * mean).max(0.0);
        spread / (f64::from(self.count) - 1.0)
    }

    /// Returns the variance of samples that are not clamped, in squares of levels: the mean over the channels. If the
    /// mean is far beyond black or white, the variance has no effect.
    pub(super) fn unclamped_variance(&self, tone: Tone) -> f64 {
        let count = f64::from(self.count);
        let mut sum = 0.0;
        for channel in 0..CHANNELS {
            let mean = self.sum[channel] as i64 as f64 / count;
            let spread = (f64::from_bits(self.squares[channel]) / count - mean * mean).max(0.0) / (ONE * ONE);
            let spread = spread * count / (count - 1.0);
            // The error of the mean, and what it makes of what is shown.
            let error = (spread / count).sqrt();
            let shown = |light: f64| match tone {
                Tone::Plain => light.clamp(0.0, 1.0),
                Tone::Srgb => encoded(light.clamp(0.0, 1.0)),
            };
            let mean = mean / ONE;
            let apart = if error < 1e-9 { 0.0 } else { shown(mean + error) - shown(mean - error) };
            let slope = if error < 1e-9 { 0.0 } else { apart / (2.0 * error) };
            sum += spread * slope * slope;
        }
        255.0 * 255.0 * sum / CHANNELS as f64
    }

    /// Returns a lower and an upper bound of the variance under the sRGB curve, or `None` if it must be computed.
    pub(super) fn variance_bounds(&self, bounds: &SlopeBounds) -> Option<(f64, f64)> {
        let of_count = 1.0 / f64::from(self.count);
        let (mut least, mut most) = (0.0, 0.0);
        for channel in 0..CHANNELS {
            let mean = self.sum[channel] as f64 * of_count;
            let spread = self.spread(channel);
            if spread > 0.0 {
                let (flat, steep) = bounds.of(mean / ONE, spread.sqrt() / ONE)?;
                least += spread * flat * flat;
                most += spread * steep * steep;
            }
        }
        let scale = (255.0 * 255.0) / (ONE * ONE * CHANNELS as f64);
        Some((scale * (1.0 - ROUNDED) * least, scale * (1.0 + ROUNDED) * most))
    }

    /// Returns the variance of the samples in squares of levels: the mean over the channels.
    pub(super) fn variance(&self, tone: Tone) -> f64 {
        let of_count = 1.0 / f64::from(self.count);
        let mut sum = 0.0;
        for channel in 0..CHANNELS {
            let mean = self.sum[channel] as f64 * of_count;
            let spread = self.spread(channel);
            let slope = match tone {
                Tone::Plain => 1.0,
                Tone::Srgb => slope(mean / ONE, spread.sqrt() / ONE),
            };
            sum += spread * slope * slope;
        }
        (255.0 * 255.0) / (ONE * ONE) * sum / CHANNELS as f64
    }
}
