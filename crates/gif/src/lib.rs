//! An encoder that turns a sequence of images into an animated GIF, streaming.
//!
//! A GIF has 256 colours per frame and delays in hundredths of a second; this crate makes the best of both. It
//! knows nothing of scenes, files or stores: images come in one by one through [`Encoder::push`], and bytes go
//! out to a [`std::io::Write`].
//!
//! Guarantees:
//!
//! - Every frame is in the file, in order and for its time, also one that equals its predecessor. Only above 50
//!   frames per second are frames dropped, never the last, and [`Summary`] counts them.
//! - Memory does not grow with the number of frames. It holds two frames, the canvas, and a block; above 50 frames per
//!   second, two more frames. [`Encoder::push`] writes the frame before the one that it takes.
//! - Between two frames an animation can be [suspended](Encoder::suspend) and continued in another process. The
//!   bytes are the same.
//! - The bytes depend on frames and settings alone, not on threads or time. Work is spread over the rayon pool in
//!   which [`Encoder::push`] is called, by fork and join only. A pool of one thread is enough, inside or outside.
//! - A frame with at most 256 colours is kept exactly. There is one exception: frames of more than 100,000 pixels in
//!   which the picture drifts. At least an eighth of such a picture changes from one frame to the next, and three
//!   quarters of that by less than three levels, as in a slow fade of a gradient. Such a frame, and those after it
//!   until much changes clearly, are off by at most 4 levels; the first is exact. With [`Settings::exact`] all are
//!   exact.
//! - Frames may have alpha. A GIF has no alpha, so each pixel is drawn or clear. Of partly covered pixels, an ordered
//!   pattern is drawn. From the first such frame on, each frame is drawn alone.
//! - No pixel of another frame is further off than 1.25 times the worst pixel of that frame encoded alone, measured
//!   as the largest difference of a level, however many frames come before it.
//!
//! ```
//! use image::{Rgb, RgbImage};
//! use rayfold_gif::{Encoder, Settings};
//!
//! let mut gif = Vec::new();
//! let mut encoder = Encoder::new(&mut gif, Settings { fps: 25.0, ..Settings::default() })?;
//! for brightness in [0, 100, 200] {
//!     encoder.push(RgbImage::from_pixel(16, 16, Rgb([brightness; 3])))?;
//! }
//! let summary = encoder.finish()?;
//! assert_eq!(summary.frames, 3);
//! assert!(gif.starts_with(b"GIF89a"));
//! # Ok::<(), rayfold_gif::Error>(())
//! ```
//!
//! # Inside
//!
//! `encoder` checks frames and writes. `quantise` calls the steps.
//!
//! Preparing a frame:
//!
//! 1. `exact` keeps a frame of at most 256 colours without loss, unless it is large and drifts.
//! 2. `update_map` compares the frame with the picture that a viewer will see before it. Each pixel is drawn, left or
//!    refined.
//! 3. `refine_budget` limits the refinement.
//! 4. `bound` computes the largest error that a pixel may have, from a palette for this frame alone.
//! 5. `plan` makes a histogram of the drawn colours (`histogram`), and a palette by splitting, then k-means
//!    (`palette`). It finds the nearest entry of each colour (`nearest`), and smaller palettes within the bound
//!    (`quantised`).
//!
//! Drawing it:
//!
//! 1. `stripe` chooses the indices while `lzw` reads them, so that strings get long. `ahead` looks for the cheapest
//!    string of the next pixels. A pixel that the next frame changes may have a larger error. Errors are diffused in
//!    smooth surroundings only.
//! 2. `block` writes the format.
//!
//! `alone` draws frames with alpha, each on a canvas that the block before has cleared. `state` suspends an animation.
//! `timeline` sets delays. `thinning` drops frames. `colour` defines the measure of errors.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

mod ahead;
mod alone;
mod block;
mod bound;
mod colour;
mod encoder;
mod error;
mod exact;
mod histogram;
mod lzw;
mod nearest;
mod palette;
mod plan;
mod quantise;
mod quantised;
mod refine_budget;
mod state;
mod stripe;
mod thinning;
mod timeline;
mod update_map;

pub use encoder::{Encoder, Plays, Settings, Summary};
pub use error::Error;
pub use thinning::Thinning;

/// The example of the README is compiled and run with the tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
