//! How much a script may ask for.
//!
//! Scripts come from strangers: without limits one line could ask for more memory than the machine has. Every limit
//! is a setting; the defaults are generous for hand-written and generated scenes alike.

/// What a script may ask for at most; a script that exceeds one gets a diagnostic that names it.
///
/// ```
/// let limits = rayfold_scene::Limits { max_pixels: 1 << 30, ..Default::default() };
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Size of a script's text in bytes.
    pub max_script_bytes: usize,
    /// Objects of one scene: those that a `Trace` sees.
    pub max_objects: usize,
    /// Lights of one scene.
    pub max_lights: usize,
    /// Pixels of an image, width times height.
    pub max_pixels: u64,
    /// Frames of one script; with `None` it may have any number of `Trace` commands, and up to [`Self::FRAMES`] frames
    /// where `Frames` makes many of one.
    pub max_frames: Option<usize>,
    /// How many errors, and how many warnings, are described one by one. Those beyond are counted.
    pub max_described: usize,
}

impl Limits {
    /// 256 MiB: two to three million triangles.
    pub const SCRIPT_BYTES: usize = 256 << 20;
    /// What fits into a few gigabytes together with what speeds up tracing.
    pub const OBJECTS: usize = 4_000_000;
    /// Every light is a shadow ray at every hit: far beyond what can be waited for.
    pub const LIGHTS: usize = 1024;
    /// 64 megapixels, 8000 x 8000.
    pub const PIXELS: u64 = 64_000_000;
    /// Eleven hours at 24 frames a second: more is a slip of the finger.
    pub const FRAMES: u64 = 1_000_000;
    /// More than anybody reads, less than what fills the memory when every line of a large file is wrong.
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
