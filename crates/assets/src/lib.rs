//! The files that scripts name, from bytes to models and pictures, and letters.
//!
//! The crate does no I/O and uses no other crate of the project. A caller implements [`Files`], which returns a file's
//! bytes by its name; [`NoFiles`] is for callers that read no files. A [`Library`] makes models and pictures of files.
//! It also makes letters of words, cut out of a plate, with a font of a file or the program's own. It makes each of
//! these once, until a file changes. [`decode`] makes a model from bytes. The content of a file decides its format, not
//! its name.
//!
//! Invariants:
//!
//! - Sizes that a file claims are compared with its length and with [`limits`] before memory is allocated.
//! - Numbers of a [`Model`] and a [`Picture`] are finite, and indices are in range.
//! - Foreign bytes never cause a panic.
//! - Letters with a depth are closed: front, back and sides have the same points of an exact grid.
//!
//! ```
//! use rayfold_assets::{Library, MemoryFiles, Smoothing};
//!
//! let corners = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
//! let library = Library::new(MemoryFiles::from([("corner.obj", corners.to_vec())]));
//! let model = library.model("corner.obj", Smoothing::OfFile)?;
//! assert_eq!(model.triangle_count(), 1);
//! # Ok::<(), rayfold_assets::AssetError>(())
//! ```
//!
//! # Inside
//!
//! - `files` has the trait and the rules of names. `limits` has the limits.
//! - `library` is a cache. One thread decodes a model while others wait for it.
//! - `decode` recognises the format of a file. `referred` has the files that it refers to. `text` handles marks and
//!   line ends of other systems.
//! - `obj`, `ply`, `stl` and `gltf` are the decoders of models. `obj` reads chunks of lines side by side.
//! - `picture` decodes PNG, JPEG and WebP by the crate `image` (`decode`), Radiance HDR (`hdr`), and OpenEXR by the
//!   crate `exr`.
//! - `texture` has the pictures of a model, and their positions on its faces.
//! - `letters` turns words into glyphs (`shaping`), and these into contours on a grid (`outline`). It joins and
//!   triangulates the contours (`plate`).
//! - `model` has the checked triangles. `normals` averages their normals for `smooth`. `closure` decides whether they
//!   close a body.
//!
//! `tests/files/hostile.rs` and the fuzz targets `model`, `picture` and `font` try foreign bytes.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

mod closure;
mod decode;
mod error;
mod files;
mod gltf;
mod letters;
mod library;
pub mod limits;
mod model;
mod normals;
mod obj;
mod picture;
mod ply;
mod referred;
mod srgb;
mod stl;
mod text;
mod texture;

pub use closure::Closure;
pub use decode::decode;
pub use error::AssetError;
pub use files::{FileInfo, Files, MemoryFiles, NameFault, NoFiles, file_name, same_but_for_case};
#[cfg(all(target_arch = "wasm32", target_os = "unknown"))]
pub use letters::provide_font;
pub use letters::{Align, LetterError, Lettering};
pub use library::{Library, Purpose};
pub use model::{Colors, Look, Model, Smoothing};
pub use picture::{Picture, jpeg_fault};
pub use referred::Referred;
pub use texture::{Slot, Texture, Wrap};

/// The example of the README is compiled and run with the tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
