//! When each frame is shown.
//!
//! A GIF counts in hundredths of a second, and players slow a delay below two of them down to ten. So frame `k` starts
//! at `100 k / fps` rounded, which carries the rounding error from frame to frame (30 fps gives 3, 4, 3, ...), and above
//! 50 frames a second the first frame of each fiftieth of a second is kept, the others are dropped.

use crate::error::Error;

/// The shortest delay that players keep to, in hundredths of a second.
const SHORTEST_DELAY_CS: u64 = 2;
/// The longest delay that the format can hold, in hundredths of a second.
const LONGEST_DELAY_CS: f64 = 65_535.0;
/// The most frames a second that [`SHORTEST_DELAY_CS`] leaves room for.
const MOST_FPS: f64 = 100.0 / SHORTEST_DELAY_CS as f64;

/// Hands out delays for frames in order.
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

    /// The same, with so many frames handed out.
    pub(crate) fn after(self, frames: u64) -> Self {
        Self { next: frames, ..self }
    }

    /// The delay of the next frame in hundredths of a second; `None` if it is dropped.
    pub(crate) fn advance(&mut self) -> Option<u16> {
        let k = self.next;
        self.next += 1;
        if self.fps > MOST_FPS {
            let slot = |k: u64| (k as f64 * MOST_FPS / self.fps).floor();
            return (k == 0 || slot(k) > slot(k - 1)).then_some(SHORTEST_DELAY_CS as u16);
        }
        let start = |k: u64| (k as f64 * 100.0 / self.fps).round();
        Some((start(k + 1) - start(k)).min(LONGEST_DELAY_CS) as u16)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn delays(fps: f64, frames: usize) -> Vec<Option<u16>> {
        let mut timeline = Timeline::new(fps).unwrap();
        (0..frames).map(|_| timeline.advance()).collect()
    }

    #[test]
    fn thirty_a_second_is_three_four_three() {
        assert_eq!(delays(30.0, 6), [3, 4, 3, 3, 4, 3].map(Some));
    }

    #[test]
    fn rounding_never_drifts() {
        for fps in [0.7, 7.0, 12.5, 23.976, 24.0, 29.97, 33.0, 47.3, 50.0] {
            let mut at = 0.0;
            for (k, delay) in delays(fps, 2_000).into_iter().enumerate() {
                assert!((at - k as f64 * 100.0 / fps).abs() <= 0.5 + 1e-6, "{fps} fps, frame {k}");
                at += f64::from(delay.unwrap());
            }
        }
    }

    #[test]
    fn above_fifty_a_second_frames_are_dropped_and_time_is_kept() {
        for fps in [50.1, 60.0, 100.0, 144.0, 1_000.0] {
            let kept = delays(fps, 10 * fps as usize).into_iter().flatten().collect::<Vec<_>>();
            assert!(kept.iter().all(|&cs| cs == 2));
            assert!((kept.len() as i64 - 500).abs() <= 1, "{fps} fps: {} of 500", kept.len());
        }
    }

    #[test]
    fn slowest_rate_that_fits() {
        assert_eq!(delays(100.0 / 65_535.0, 1), [Some(65_535)]);
        for fps in [0.0, -1.0, 0.0015, f64::NAN, f64::INFINITY] {
            assert!(matches!(Timeline::new(fps), Err(Error::FrameRate { .. })), "{fps}");
        }
    }
}
