//! The numbers of samples that a pixel can have (the chain), and the largest variance of the samples of a pixel that
//! has enough.

use rayfold_scene::{Samples, Tone};

use super::curve::SlopeBounds;
use super::pixel::Pixel;

/// The number of samples per pixel before any decision, and the number from which on variances are significant.
const FIRST: u32 = 1;
const SECOND: u32 = 4;

/// The error of a mean of n samples is estimated as their deviation times n to this power. It is steeper than the -1/2
/// of independent samples, and less steep than that of edges and penumbrae (docs/reports/sampling.md).
pub(super) const SLOPE: f64 = -0.65;

/// The slope and the share for scenes in which surfaces light each other, where all pixels vary. Light that comes in by
/// chance has a slope of -0.5, and other light one of -0.7 (docs/decisions/tracer-paths.md).
const SLOPE_OF_PATHS: f64 = -0.6;
const SPARED_OF_PATHS: f64 = 1.4;

/// In such scenes the neighbours of a pixel get more samples if its error is more than this many times that of a
/// settled pixel.
const LOUD: f64 = 2.0;

/// The error that a pixel may have, as a multiple of the requested error. Most other pixels have less. The more of the
/// pixels around it vary ([`super::density`]), the fewer others have less.
pub(super) const SPARED: [f64; 3] = [3.0, 1.6, 0.9];

/// An edge in a pixel may reach into an even neighbour, and all samples of that neighbour may miss it. The error of the
/// neighbour is then about the pixel's deviation divided by the number of samples to this power. With more samples, the
/// part that they miss is smaller, and a miss is less likely.
pub(super) const MISSED: f64 = 1.5;

/// An even neighbour gets more samples if that error is more than this many times the requested error.
pub(super) const CALM: f64 = 0.4;

/// The largest deviation, in levels, of samples that are clamped.
const MAX_DEVIATION: f64 = 256.0;

/// A pixel is even if its samples deviate by less than this many times the requested error.
pub(super) const EVEN: f64 = 0.5;

/// A pixel varies if its estimated error after [`SECOND`] samples is more than this many times the requested error.
pub(super) const VARYING: f64 = 1.5;

/// The number of moments of the first samples.
const FEW_MOMENTS: u32 = 16;

#[derive(Debug)]
pub(super) struct SampleSchedule {
    samples: Samples,
    /// The largest number of samples that a pass adds to a pixel.
    pub(super) step: u32,
    /// Whether the first samples are of few moments.
    pub(super) has_few_moments: bool,
    tone: Tone,
    /// Whether samples are not clamped, as in scenes in which surfaces light each other.
    is_unclamped: bool,
    /// The largest variance of the samples of a settled pixel. It depends on the density around the pixel and on the
    /// logarithm of the number of samples to the base 2.
    limits: [[f64; u32::BITS as usize]; SPARED.len()],
    /// For each number of samples from the second of the chain on: the largest variance of a pixel's samples beside
    /// which even pixels with this number get no more.
    calm: Vec<f64>,
    /// The largest variance of the samples of an even pixel.
    even: f64,
    /// The largest variance of the [`SECOND`] samples of a pixel that does not vary.
    still: f64,
    /// The bounds of slopes for the sRGB curve, whose powers are slow to compute.
    slopes: Option<Box<SlopeBounds>>,
}

/// The conclusion from the samples of a pixel.
pub(crate) struct Verdict {
    /// Whether the pixel needs more samples.
    pub(crate) is_unsettled: bool,
    /// The count of numbers of the chain, from the second on, from which even neighbours go on because of this pixel.
    /// If samples are not clamped, 1 means that all neighbours get more samples.
    pub(crate) reach: usize,
    /// Whether the samples differ.
    pub(crate) is_uneven: bool,
    /// Whether the pixel counts as varying when densities are computed.
    pub(crate) is_varying: bool,
}

impl SampleSchedule {
    pub(super) fn new(samples: Samples, tone: Tone, step: u32, is_unclamped: bool) -> Self {
        // Where light goes round all pixels vary.
        let (slope, spared) =
            if is_unclamped { (SLOPE_OF_PATHS, [SPARED_OF_PATHS; _]) } else { (SLOPE, SPARED) };
        let limit = |spared: f64, count: u32| {
            let limit = spared * samples.error() * libm::pow(f64::from(count), -slope);
            limit * limit
        };
        let limits = spared.map(|spared| core::array::from_fn(|at| limit(spared, 1 << at)));
        let numbers = (0..u32::BITS - 2)
            .map(|at| SECOND << at)
            .take_while(|&count| count == SECOND || count < samples.most());
        let calm = numbers.map(|count| CALM * samples.error() * libm::pow(f64::from(count), MISSED));
        let calm = calm.take_while(|&calm| calm < MAX_DEVIATION && !is_unclamped);
        let calm = calm.map(|calm| calm * calm).collect();
        let even = limit(EVEN, 1);
        let still = limit(VARYING, SECOND);
        let slopes = (tone == Tone::Srgb && !is_unclamped && samples.error() > 0.0)
            .then(|| Box::new(SlopeBounds::new()));
        Self {
            samples,
            step,
            has_few_moments: samples.error() > 0.0,
            tone,
            is_unclamped,
            limits,
            calm,
            even,
            still,
            slopes,
        }
    }

    /// Returns whether samples are not clamped.
    pub(super) fn is_unclamped(&self) -> bool {
        self.is_unclamped
    }

    /// Returns whether an error is requested. Otherwise all pixels get the first number of samples only.
    pub(super) fn has_error(&self) -> bool {
        self.samples.error() > 0.0
    }

    pub(super) fn tone(&self) -> Tone {
        self.tone
    }

    pub(super) fn error(&self) -> f64 {
        self.samples.error()
    }

    pub(super) fn most(&self) -> u32 {
        self.samples.most()
    }

    pub(super) fn number(&self, at: usize) -> u32 {
        let most = self.most();
        match at {
            _ if !self.has_error() => most,
            0 => FIRST,
            _ => u32::try_from(u64::from(SECOND) << (at - 1).min(32)).unwrap_or(u32::MAX).min(most),
        }
    }

    /// Returns the number of samples after a pass of a pixel that has `count` samples and gets some in the pass.
    #[inline(always)]
    pub(super) fn goal(&self, count: u32) -> u32 {
        let most = self.most();
        let next = if !self.has_error() {
            most
        } else if count < SECOND {
            if count < FIRST { FIRST } else { SECOND }
        } else {
            count.checked_add(1).and_then(u32::checked_next_power_of_two).unwrap_or(most)
        };
        next.min(most).min(count.saturating_add(self.step))
    }

    /// Returns the number of moments, out of `all`, from which a sample takes one.
    #[inline(always)]
    pub(super) fn moments(&self, sample: u32, all: u32) -> u32 {
        if self.has_few_moments {
            sample.saturating_add(1).checked_next_power_of_two().unwrap_or(all).max(FEW_MOMENTS).min(all)
        } else {
            all
        }
    }

    /// Judges a pixel by its samples and by the density around it. Between two numbers of the chain a pixel is never
    /// unsettled.
    #[inline(never)]
    pub(super) fn verdict(&self, pixel: &Pixel, density: usize) -> Verdict {
        let count = pixel.count();
        let is_number = count == self.most() || count.is_power_of_two();
        // No number that is asked about is above the largest power of two.
        let limit = self.limits[density][count.trailing_zeros() as usize % self.limits[density].len()];
        let variance = if is_number { self.variance(pixel, limit) } else { 0.0 };
        let is_asked = is_number && count < self.most();
        let reach = if self.is_unclamped {
            usize::from(is_asked && variance > LOUD * LOUD * limit)
        } else {
            self.calm.iter().take_while(|&&calm| variance > calm).count()
        };
        Verdict {
            is_unsettled: is_asked && variance > limit,
            reach,
            is_uneven: variance > self.even,
            is_varying: is_asked && variance > self.still,
        }
    }

    /// Returns the largest possible [`Verdict::reach`].
    pub(super) fn reaches(&self) -> usize {
        self.calm.len() + usize::from(self.is_unclamped)
    }

    /// Returns the variance of the samples of a pixel, or another number that compares alike with all limits of a
    /// verdict.
    #[inline(always)]
    fn variance(&self, pixel: &Pixel, limit: f64) -> f64 {
        if self.is_unclamped {
            return pixel.unclamped_variance(self.tone);
        }
        let bounds = self.slopes.as_ref().and_then(|slopes| pixel.variance_bounds(slopes));
        let compared = || self.calm.iter().chain([&limit, &self.even, &self.still]);
        match bounds {
            Some((least, most)) if !compared().any(|with| (least..=most).contains(with)) => least,
            _ => pixel.variance(self.tone),
        }
    }
}
