//! The limits of a script.
//!
//! Scripts come from unknown users: without limits, one line could request more memory than the machine has. Every
//! limit is a setting. The defaults are generous for both hand-written and generated scenes.

/// The largest quantities that a script may use. A script that exceeds one gets a diagnostic that names it.
///
/// ```
/// let limits = rayfold_scene::Limits { max_pixels: 1 << 30, ..Default::default() };
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// The size of a script's text in bytes.
    pub max_script_bytes: usize,
    /// The objects of one scene, as seen by a `Trace`.
    pub max_objects: usize,
    /// The lights of one scene.
    pub max_lights: usize,
    /// The pixels of an image, width times height.
    pub max_pixels: u64,
    /// The frames of one script. With `None` it may have any number of `Trace` commands, and up to
    /// [`Self::FRAMES`] frames through `Frames`.
    pub max_frames: Option<usize>,
    /// The largest number of errors, and of warnings, that are described individually. The others are counted.
    pub max_described: usize,
}

impl Limits {
    /// 256 MiB: two to three million triangles.
    pub const SCRIPT_BYTES: usize = 256 << 20;
    /// As many objects as fit into a few gigabytes together with the acceleration structures.
    pub const OBJECTS: usize = 4_000_000;
    /// The triangles of models that a frame draws. Each model counts as often as it is drawn.
    pub(crate) const DRAWN_TRIANGLES: usize = 16_000_000;
    /// The largest number of drawn groups per allowed object: groups that only use others cost time, too.
    pub(crate) const USES_PER_OBJECT: usize = 4;
    /// Every light needs a shadow ray at every hit, so this is far more than is practical.
    pub const LIGHTS: usize = 1024;
    /// 64 megapixels, 8000 x 8000.
    pub const PIXELS: u64 = 64_000_000;
    /// Eleven hours at 24 frames per second: more is probably a typo.
    pub const FRAMES: u64 = 1_000_000;
    /// More than a person reads, and few enough to fit into memory if every line of a large file is wrong.
    pub const DESCRIBED: usize = 100_000;
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            max_script_bytes: Self::SCRIPT_BYTES,
            max_objects: Self::OBJECTS,
            max_lights: Self::LIGHTS,
            max_pixels: Self::PIXELS,
            max_frames: None,
            max_described: Self::DESCRIBED,
        }
    }
}
