//! The files that scripts name, from bytes to models and pictures, and letters.
//!
//! Knows no other crate of the project and does no I/O. A caller implements [`Files`], which hands over files as bytes by
//! name, and asks a [`Library`] for models and pictures, and for letters cut out of a plate. The content decides what a file is,
//! not its name.
//!
//! Invariants: what a file claims about its size is compared with its bytes and with [`limits`] before memory is spent.
//! Numbers of a [`Model`] and a [`Picture`] are finite, and indices in range. Foreign bytes never cause a panic.
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
