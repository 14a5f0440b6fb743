//! The delay of each frame.
//!
//! A GIF counts in hundredths of a second, and players slow a delay below two of them down to ten. So frame
//! `k` starts at `100 k / fps` rounded, which carries the rounding error from frame to frame (30 fps gives 3,
//! 4, 3, ...). Above 50 frames per second some are [dropped](crate::Thinning), and each of the others is
//! shown for two hundredths.

use crate::error::Error;

/// The shortest delay that players respect, in hundredths of a second.
const SHORTEST_DELAY_CS: u64 = 2;
/// The longest delay that the format can hold, in hundredths of a second.
const LONGEST_DELAY_CS: f64 = 65_535.0;
/// The largest frame rate for which [`SHORTEST_DELAY_CS`] leaves room.
pub(crate) const MAX_FPS: f64 = 100.0 / SHORTEST_DELAY_CS as f64;

/// A source of delays for frames in order.
#[derive(Debug, Clone)]
pub(crate) struct Timeline {
    fps: f64,
    next: u64,
}

impl Timeline {
    pub(crate) fn new(fps: f64) -> Result<Self, Error> {
        if !(fps.is_finite() && fps > 0.0 && 100.0 / fps <= LONGEST_DELAY_CS) {
            return Err(Error::FrameRate { fps });
        }
        Ok(Self { fps, next: 0 })
    }

    /// Returns a timeline that has already handed out `frames` delays.
    pub(crate) fn after(self, frames: u64) -> Self {
        Self { next: frames, ..self }
    }

    /// Returns the number of frames that have a delay.
    pub(crate) fn handed_out(&self) -> u64 {
        self.next
    }

    /// Returns the delay of the next frame in hundredths of a second.
    pub(crate) fn advance(&mut self) -> u16 {
        let k = self.next;
        self.next += 1;
        let start = |k: u64| (k as f64 * 100.0 / self.fps.min(MAX_FPS)).round();
        (start(k + 1) - start(k)).min(LONGEST_DELAY_CS) as u16
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn delays(fps: f64, frames: usize) -> Vec<u16> {
        let mut timeline = Timeline::new(fps).unwrap();
        (0..frames).map(|_| timeline.advance()).collect()
    }

    #[test]
    fn thirty_a_second_is_three_four_three() {
        assert_eq!(delays(30.0, 6), [3, 4, 3, 3, 4, 3]);
    }

    #[test]
    fn rounding_never_drifts() {
        for fps in [0.7, 7.0, 12.5, 23.976, 24.0, 29.97, 33.0, 47.3, 50.0] {
            let mut at = 0.0;
            for (k, delay) in delays(fps, 2_000).into_iter().enumerate() {
                assert!((at - k as f64 * 100.0 / fps).abs() <= 0.5 + 1e-6, "{fps} fps, frame {k}");
                at += f64::from(delay);
            }
        }
    }

    #[test]
    fn above_fifty_a_second_each_is_shown_for_two_hundredths() {
        for fps in [50.1, 60.0, 100.0, 144.0, 1_000.0] {
            assert!(delays(fps, 1_000).iter().all(|&cs| cs == 2), "{fps} fps");
        }
    }

    #[test]
    fn slowest_rate_that_fits() {
        assert_eq!(delays(100.0 / 65_535.0, 1), [65_535]);
        for fps in [0.0, -1.0, 0.0015, f64::NAN, f64::INFINITY] {
            assert!(matches!(Timeline::new(fps), Err(Error::FrameRate { .. })), "{fps}");
        }
    }
}
