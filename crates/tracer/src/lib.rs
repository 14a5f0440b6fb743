//! Scenes to images, deterministically.
//!
//! What a pixel shows is decided by the scene language's rules of seeing and shading alone: the same scene gives the
//! same image for any number of threads. The crate knows the typed scene and nothing of text, files or clocks.
//!
//! Invariants: no length is compared with an absolute epsilon, what keeps a ray off the surface that it leaves is a
//! bound on the rounding error there; a hit is a function of ray and object alone; of hits within that bound of each other
//! the object that comes first wins; a direction in here is a unit vector.
//!
//! ```
//! use rayfold_scene::{Camera, Scene, Screen};
//!
//! let scene = Scene::new(Screen::new(4, 3)?, Camera::Orthographic);
//! let image = rayfold_tracer::render(&scene, &rayfold_tracer::RenderOptions::default())?;
//! assert_eq!(image.dimensions(), (4, 3));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod camera;
mod cut_light;
mod exposure;
mod fast;
#[cfg(feature = "accuracy")]
mod nans;
mod parallel;
pub mod reference;
mod sampling;
mod scale;

pub use camera::pixel_ray;
pub use cut_light::{CutLight, cut_light};
pub use exposure::Exposure;
#[cfg(feature = "accuracy")]
pub use fast::Means;
pub use fast::{Drawing, probe};
#[cfg(feature = "accuracy")]
pub use nans::take as take_nans;

use std::sync::atomic::AtomicBool;

pub use fearless_simd::Level;
use image::RgbImage;
use rayfold_scene::{Scene, Script};
pub use sampling::Sampler;

/// Raised whenever any scene's pixels change, so that a picture can be known to be out of date.
pub const PIXEL_VERSION: u32 = 3;

/// How often light is mirrored before the mirror term is dropped, where a script does not say it.
pub const MAX_BOUNCES: u32 = 5;

/// The numbers that a picture is computed with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// `f32` where bounds on its rounding errors say that they cannot be seen, otherwise `f64`.
    #[default]
    Auto,
    /// Single precision, about twice as fast; double where it cannot hold the scene's numbers at all, and for what has no
    /// kernels in single precision: lamps, finishes, and shapes with axes of their own.
    F32,
    /// Double precision.
    F64,
}

/// How to render; the default renders to the end, as fast as the scene and the machine allow.
///
/// `level`, `tile` and `tree` change nothing that can be seen; they are there to prove it and to measure what they cost.
#[derive(Clone, Copy, Debug, Default)]
pub struct RenderOptions<'a> {
    /// Stops the rendering soon after it turns true.
    pub cancel: Option<&'a AtomicBool>,
    /// The numbers to compute with.
    pub precision: Precision,
    /// The instructions to use; the best that the machine has when not set.
    pub level: Option<Level>,
    /// Columns and rows of the tiles that are drawn at once, multiples of 4 with a product of at most 256.
    pub tile: Option<(u32, u32)>,
    /// Whether to look for objects down a tree; always done for more than 64 objects.
    pub tree: Option<bool>,
    /// How many mirrorings and refractions are followed: the scene's own depth when not set.
    pub bounces: Option<u32>,
    /// How samples are arranged.
    pub sampler: Sampler,
}

impl RenderOptions<'_> {
    pub(crate) fn bounces(&self, scene: &Scene) -> u32 {
        self.bounces.unwrap_or(scene.depth.bounces())
    }
}

/// Why there is no image.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// The flag of [`RenderOptions::cancel`] was raised.
    #[error("rendering was cancelled")]
    Cancelled,
    /// Of single rays alone: the coordinates are so large that their differences are not finite.
    #[error("the scene is too vast: distances in it are not finite numbers")]
    TooVast,
    /// The image does not fit into this machine's address space.
    #[error("an image of {width} x {height} pixels does not fit into memory")]
    TooLarge {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// The scene needs a part of the tracer that this build was told to leave out.
    #[error("the scene needs {feature}, and this build of the tracer is without (a cargo feature)")]
    LeftOut {
        /// The cargo feature.
        feature: &'static str,
    },
}

/// The numbers that [`Precision::Auto`] chooses for a scene.
pub fn precision(scene: &Scene) -> Precision {
    fast::precision(scene)
}

/// Draws a scene, its first row at the top, on the current rayon pool.
///
/// # Errors
/// When the rendering was cancelled or the image cannot be held in memory.
pub fn render(scene: &Scene, options: &RenderOptions) -> Result<RgbImage, RenderError> {
    Drawing::new(scene, options)?.draw()
}

/// Draws a scene that may move while the shutter is open, on the current rayon pool.
///
/// # Errors
/// Those of [`render`].
pub fn render_exposed(exposure: Exposure, options: &RenderOptions) -> Result<RgbImage, RenderError> {
    Drawing::exposed(exposure, options)?.draw()
}

/// Draws frame `k` of a script, counted from 0, on the current rayon pool; `None` beyond the last.
///
/// # Errors
/// Those of [`render`].
pub fn render_frame(
    script: &Script,
    k: usize,
    options: &RenderOptions,
) -> Option<Result<RgbImage, RenderError>> {
    let scene = script.frame(k)?;
    let after = |frames| script.frame_after(k, frames).unwrap_or_else(|| scene.clone());
    Some(render_exposed(Exposure::moving(&scene, &after), options))
}

/// As [`render`] in single precision, by textbook formulas without any regard for rounding: what robustness is measured
/// against. The machinery around them is the same.
///
/// # Errors
/// Those of [`render`].
#[cfg(feature = "accuracy")]
pub fn render_naive(scene: &Scene, options: &RenderOptions) -> Result<RgbImage, RenderError> {
    fast::render_naive(scene, options)
}
