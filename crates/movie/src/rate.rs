//! Frame rates as fractions, as containers store them.

/// The largest number that every program reads.
const LARGEST: u64 = (1 << 31) - 1;

/// Returns the rate as a number of frames and a number of seconds, both whole: the simplest fraction that equals `fps`.
///
/// For example it recovers 30000/1001, which a floating-point number only approximates.
pub(crate) fn fraction(fps: f64) -> (u64, u64) {
    // Each convergent of the continued fraction is the last one times a term, plus the one before.
    let (mut last, mut before) = ((1_u64, 0_u64), (0_u64, 1_u64));
    let mut rest = fps;
    loop {
        let term = rest.floor();
        let next = |last: u64, before: u64| {
            let next = term * last as f64 + before as f64;
            (next <= LARGEST as f64).then_some(next as u64)
        };
        let (Some(frames), Some(seconds)) = (next(last.0, before.0), next(last.1, before.1)) else {
            return last;
        };
        (last, before) = ((frames, seconds), last);
        if frames as f64 / seconds as f64 == fps || rest == term {
            return last;
        }
        rest = (rest - term).recip();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_the_simplest_fractions() {
        let rates = [25.0, 12.5, 29.97, 0.01, 0.7, 1_000.0].map(fraction);
        assert_eq!(rates, [(25, 1), (25, 2), (2_997, 100), (1, 100), (7, 10), (1_000, 1)]);
        for (frames, seconds) in [(30_000, 1_001), (24_000, 1_001), (60_000, 1_001), (1_000, 3), (1, 7)] {
            assert_eq!(fraction(frames as f64 / seconds as f64), (frames, seconds));
        }
    }

    #[test]
    fn numbers_of_a_fraction_are_bounded() {
        for fps in [std::f64::consts::PI, 12.345_678_901_234, 999.999_999_999_9, 0.010_000_000_000_1] {
            let (frames, seconds) = fraction(fps);
            assert!(frames <= LARGEST && seconds <= LARGEST && seconds > 0, "{fps}");
            // One of two neighbouring convergents has a denominator over LARGEST · fps.
            assert!((frames as f64 / seconds as f64 / fps - 1.0).abs() < 1e-9, "{fps}: {frames}/{seconds}");
        }
    }
}
