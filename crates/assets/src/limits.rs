//! Limits of the files that scripts name. What is beyond a limit is refused before memory is spent.

/// The files that a script may name, those that its models refer to included.
pub const FILES: usize = 64;

/// The bytes of a file.
pub const FILE_BYTES: u64 = 256 << 20;

/// The triangles of all models of a frame, each model counted once.
pub const TRIANGLES: usize = 10_000_000;

/// The vertices of a model, which may be three for each triangle.
pub(crate) const VERTICES: usize = 3 * TRIANGLES;

/// The pixels of a picture.
pub const PIXELS: u64 = 1 << 26;

/// The pixels of all pictures of a model together.
pub const MODEL_PIXELS: u64 = 1 << 28;

/// The code points of a text, ends of lines counted.
pub const CODE_POINTS: usize = 10_000;

/// The bytes of decoded models, and those of pictures, that a [`Library`](crate::Library) keeps although no script uses them.
pub(crate) const KEPT_BYTES: usize = 512 << 20;

/// The nodes of a glTF file, its materials, and the items of an accessor that has no data.
pub(crate) const NODES: usize = 1 << 20;
