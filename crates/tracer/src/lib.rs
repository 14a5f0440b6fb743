//! Renders scenes to images, deterministically.
//!
//! The scene language's rules of visibility and shading alone decide each pixel: the same scene gives the same image
//! for any number of threads. The crate takes the typed scene, and uses no text, files or clocks.
//!
//! Invariants:
//!
//! - No length is compared with an absolute epsilon. A ray is kept off the surface that it starts on by a bound on the
//!   rounding error there.
//! - A hit is a function of the ray and the object alone.
//! - If two hits are within the bound on rounding errors of each other, the object that comes first wins.
//! - A direction in this crate is a unit vector.
//!
//! ```
//! use rayfold_scene::{Camera, Scene, Screen};
//!
//! let scene = Scene::new(Screen::new(4, 3)?, Camera::Orthographic);
//! let image = rayfold_tracer::render(&scene, &rayfold_tracer::RenderOptions::default())?;
//! assert_eq!(image.dimensions(), (4, 3));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Inside
//!
//! `docs/tracer.md` in the repository describes the phases and the modules.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

mod camera;
mod cover;
mod cut_light;
mod exposure;
mod fast;
mod first_hits;
mod meshes;
#[cfg(feature = "accuracy")]
mod nans;
mod parallel;
pub mod parts;
mod pictures;
mod progress;
pub mod reference;
mod sampling;
mod scale;

pub use camera::pixel_ray;
pub use cut_light::{CutLight, cut_light};
pub use exposure::Exposure;
#[cfg(feature = "accuracy")]
pub use fast::Means;
pub use fast::{Drawing, probe};
pub use first_hits::{FirstHit, first_hits};
#[cfg(feature = "accuracy")]
pub use nans::take as take_nans;

use std::sync::atomic::AtomicBool;

pub use fearless_simd::Level;
use image::{DynamicImage, RgbImage};
pub use progress::Progress;
use rayfold_scene::{Scene, Script};
pub use sampling::Sampler;

/// The version of the pixels. It is raised whenever any scene's pixels change, so that outdated pictures can be
/// detected.
pub const PIXEL_VERSION: u32 = 9;

/// The number of reflections after which the mirror term is dropped, unless a script sets it.
pub const MAX_BOUNCES: u32 = 5;

/// The precision that a picture is computed with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// `f32` if bounds on its rounding errors prove them invisible, otherwise `f64`.
    #[default]
    Auto,
    /// Single precision, about twice as fast. Double precision is used for scenes whose numbers it cannot represent,
    /// and for features without kernels in single precision: lamps, finishes, and shapes with axes of their own.
    F32,
    /// Double precision, `f64`, about half as fast.
    F64,
}

/// The options of rendering. By default, renders to the end, as fast as the scene and the machine allow.
///
/// `level`, `tile` and `tree` do not change the picture. They exist for tests of that, and to measure their cost.
#[derive(Clone, Copy, Debug, Default)]
pub struct RenderOptions<'a> {
    /// Stops the rendering soon after it becomes true.
    pub cancel: Option<&'a AtomicBool>,
    /// Counts the work as it is done.
    pub progress: Option<&'a Progress>,
    /// The precision to compute with.
    pub precision: Precision,
    /// The instruction set. Default: the best of the machine.
    pub level: Option<Level>,
    /// The columns and rows of the tiles that are drawn at once, multiples of 4 with a product of at most 256.
    pub tile: Option<(u32, u32)>,
    /// Whether objects are found by a tree. It is always used for more than 64 objects.
    pub tree: Option<bool>,
    /// Whether the tree of a model is made once for all its meshes, and kept with it for further pictures. By default it is
    /// for models of at least 100,000 triangles, all meshes counted. It never is for models of glass, with patterns or with
    /// holes.
    pub models: Option<bool>,
    /// The largest number of reflections and refractions that a ray follows. Default: the scene's own depth.
    pub bounces: Option<u32>,
    /// The arrangement of samples.
    pub sampler: Sampler,
    /// The levels of the colour behind the objects of a scene without background. Default: pictures have alpha, and
    /// images show black.
    pub matte: Option<[u8; 3]>,
}

impl RenderOptions<'_> {
    pub(crate) fn bounces(&self, scene: &Scene) -> u32 {
        self.bounces.unwrap_or(scene.depth.bounces())
    }
}

/// The reason why there is no image.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// The flag of [`RenderOptions::cancel`] was set.
    #[error("rendering was cancelled")]
    Cancelled,
    /// The coordinates are so large that their differences are not finite. Only functions for single rays return it.
    #[error("the scene is too vast: distances in it are not finite numbers")]
    TooVast,
    /// The image does not fit into this machine's address space.
    #[error("an image of {width} x {height} pixels does not fit into memory")]
    TooLarge {
        /// The width of the image in pixels.
        width: u32,
        /// The height of the image in pixels.
        height: u32,
    },
    /// The scene needs a part of the tracer that this build leaves out.
    #[error("the scene needs {feature}, and this build of the tracer is without (a cargo feature)")]
    LeftOut {
        /// The cargo feature of the part.
        feature: &'static str,
    },
}

/// Returns the precision that [`Precision::Auto`] selects for a scene.
pub fn precision(scene: &Scene) -> Precision {
    fast::precision(scene)
}

/// Draws a scene, its first row at the top, on the current rayon pool.
///
/// # Errors
/// If the rendering was cancelled or the image does not fit into memory.
pub fn render(scene: &Scene, options: &RenderOptions) -> Result<RgbImage, RenderError> {
    Drawing::new(scene, options)?.draw()
}

/// Draws a scene that may move while the shutter is open, on the current rayon pool.
///
/// # Errors
/// The errors of [`render`].
pub fn render_exposed(exposure: Exposure, options: &RenderOptions) -> Result<RgbImage, RenderError> {
    Drawing::exposed(exposure, options)?.draw()
}

/// Draws a picture as [`render_exposed`] draws an image: of a scene without background with alpha
/// ([`Drawing::draw_picture`]).
///
/// # Errors
/// The errors of [`render`].
pub fn render_picture(exposure: Exposure, options: &RenderOptions) -> Result<DynamicImage, RenderError> {
    Drawing::exposed(exposure, options)?.draw_picture()
}

/// Draws frame `k` of a script as a picture, counted from 0, on the current rayon pool ([`Drawing::draw_picture`]). Returns
/// `None` after the last frame.
///
/// # Errors
/// The errors of [`render`].
pub fn picture_of_frame(
    script: &Script,
    k: usize,
    options: &RenderOptions,
) -> Option<Result<DynamicImage, RenderError>> {
    let scene = script.frame(k)?;
    let after = |frames| script.frame_after(k, frames).unwrap_or_else(|| scene.clone());
    Some(render_picture(Exposure::moving(&scene, &after), options))
}

/// Draws frame `k` of a script, counted from 0, on the current rayon pool. Returns `None` after the last frame.
///
/// # Errors
/// The errors of [`render`].
pub fn render_frame(
    script: &Script,
    k: usize,
    options: &RenderOptions,
) -> Option<Result<RgbImage, RenderError>> {
    let scene = script.frame(k)?;
    let after = |frames| script.frame_after(k, frames).unwrap_or_else(|| scene.clone());
    Some(render_exposed(Exposure::moving(&scene, &after), options))
}

/// Draws the light of frame `k` of a script, counted from 0, on the current rayon pool: three numbers for each pixel
/// ([`Drawing::draw_light`]), or four if the frame has no background ([`Drawing::draw_light_and_cover`]). Returns `None` after
/// the last frame.
///
/// # Errors
/// The errors of [`render`].
pub fn light_of_frame(
    script: &Script,
    k: usize,
    options: &RenderOptions,
) -> Option<Result<Vec<f32>, RenderError>> {
    let scene = script.frame(k)?;
    let after = |frames| script.frame_after(k, frames).unwrap_or_else(|| scene.clone());
    let exposure = Exposure::moving(&scene, &after);
    let draw = |drawing: Drawing| match scene.background.is_none() {
        true => drawing.draw_light_and_cover(),
        false => drawing.draw_light(),
    };
    Some(Drawing::exposed(exposure, options).and_then(draw))
}

/// Draws a scene like [`render`] in single precision, by textbook formulas that ignore rounding errors. It is the
/// baseline for measuring the cost of robustness. All other code is the same.
///
/// # Errors
/// The errors of [`render`].
#[cfg(feature = "accuracy")]
pub fn render_naive(scene: &Scene, options: &RenderOptions) -> Result<RgbImage, RenderError> {
    fast::render_naive(scene, options)
}

/// The example of the README is compiled and run with the tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
