//! Errors of the encoder.

use std::io;

/// The largest width and height that the format can hold.
pub(crate) const LONGEST_SIDE: u32 = 65_535;

/// An error of the encoder. Frames are counted from 1.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The frame rate is not a number above 0, or so low that the format cannot hold the delay.
    #[error("{fps} frames a second: a GIF can hold rates from 0.00153 up")]
    FrameRate {
        /// The rate that was requested.
        fps: f64,
    },
    /// Frames have times of their own, but some of them would be dropped.
    #[error("{fps} frames a second: where frames have times of their own, a GIF can hold at most 50")]
    TooFastForDelays {
        /// The rate that was requested.
        fps: f64,
    },
    /// A frame has another size than the frames before it.
    #[error("frame {frame} is {} x {} pixels, the frames before it are {} x {}", found.0, found.1, expected.0, expected.1)]
    UnlikeSize {
        /// The number of the frame.
        frame: u64,
        /// The width and height of the frame.
        found: (u32, u32),
        /// The width and height of the first frame.
        expected: (u32, u32),
    },
    /// A frame has no pixels, or a side longer than the format can hold.
    #[error("frame {frame} is {} x {} pixels, a GIF can hold 1 to {LONGEST_SIDE} on each side", found.0, found.1)]
    Size {
        /// The number of the frame.
        frame: u64,
        /// The width and height of the frame.
        found: (u32, u32),
    },
    /// [`Encoder::finish`](crate::Encoder::finish) was called before any [`Encoder::push`](crate::Encoder::push).
    #[error("an animation needs at least one frame")]
    NoFrames,
    /// The writer failed.
    #[error("cannot write frame {frame}")]
    Write {
        /// The frame that was being written.
        frame: u64,
        /// The error of the writer.
        source: io::Error,
    },
    /// [`Encoder::resume`](crate::Encoder::resume) got the state of another version of the encoder, whose bytes may
    /// differ. Encode the animation from its beginning.
    #[error("the state is of another version of the encoder")]
    StateVersion,
    /// [`Encoder::resume`](crate::Encoder::resume) got bytes that are no state, or a damaged one.
    #[error("the state of the animation cannot be read")]
    State {
        /// The reason.
        source: io::Error,
    },
}
