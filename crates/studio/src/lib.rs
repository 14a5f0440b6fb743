//! The studio: an editor for scenes in a browser, whose viewport shows the renderer's pictures.
//!
//! The script is the only copy of the scene: a document is the lines of a script. An edit on the page rewrites
//! numbers of one line, or adds, removes and moves lines; every other byte stays. The page displays messages of the
//! server and sends requests. Parsing, writing, picking, dragging and rendering happen here, in `scene` and `tracer`.
//! The parser's tables define the parameters of a command.
//!
//! Begin at [`Server`] (the connection of a page) and `session` (its requests and their effects). `document` and
//! `line` are pure, and `project` does all file access. `runs` handles animations in a bucket, over any store.
//!
//! Invariants: the studio reads and writes only what it was opened with; it listens on loopback only; undoing
//! everything restores the original bytes.

mod arrange;
pub mod browser;
mod clauses;
mod clock;
#[cfg(feature = "server")]
mod disk;
mod document;
#[cfg(feature = "server")]
mod door;
mod edits;
mod error;
mod examples;
mod extent;
mod frame;
mod groups;
mod handles;
mod line;
mod materials;
mod names;
mod output;
#[cfg(feature = "server")]
mod outputs;
mod pace;
mod packing;
#[cfg(feature = "server")]
mod page;
#[cfg(feature = "server")]
mod pictures;
#[cfg(feature = "server")]
mod pipe;
mod project;
mod protocol;
mod rotate_handles;
#[cfg(feature = "server")]
mod runs;
mod scale_handles;
#[cfg(feature = "server")]
mod server;
mod session;
mod settings;
mod silhouette;
mod snap_to_boxes;
mod snap_to_ground;
mod source_map;
#[cfg(feature = "server")]
mod start;
mod steps;
mod storage;
mod tables;
mod text_edit;
mod tracks;
mod values;
mod view;
mod wanted;

pub use document::{Document, Splice};
pub use error::Error;
pub use line::Line;
#[cfg(feature = "server")]
pub use page::Page;
pub use project::{Opened, Project, Saved};
#[cfg(feature = "server")]
pub use runs::Cloud;
#[cfg(feature = "server")]
pub use server::Server;
#[cfg(feature = "server")]
pub use start::{Choice, Recent, Start};
