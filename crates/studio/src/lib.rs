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
mod document;
mod door;
mod edits;
mod error;
mod examples;
mod extent;
mod files;
mod frame;
mod groups;
mod handles;
mod line;
mod materials;
mod names;
mod output;
mod pace;
mod packing;
mod page;
mod pictures;
mod pipe;
mod project;
mod protocol;
mod rotate_handles;
mod runs;
mod server;
mod session;
mod settings;
mod silhouette;
mod snap_to_boxes;
mod snap_to_ground;
mod source_map;
mod start;
mod tables;
mod text_edit;
mod tracks;
mod values;
mod view;

pub use document::{Document, Splice};
pub use error::Error;
pub use line::Line;
pub use page::Page;
pub use project::{Opened, Project, Saved};
pub use runs::Cloud;
pub use server::Server;
pub use start::{Choice, Recent, Start};
