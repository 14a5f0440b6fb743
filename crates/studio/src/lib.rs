//! The studio: scenes in a browser, where the viewport is the renderer.
//!
//! The text is the truth: a document is the lines of a script, and whatever is done on the page rewrites numbers of one
//! line, or adds, removes and moves lines; every other byte stays. The page shows what it is told and says what it
//! wants; parsing, writing, picking, dragging and drawing are done here, by `scene` and `tracer`. What a command has
//! for parameters the parser's own tables say.
//!
//! Start at [`Server`] (a page's connection) and `session` (what a page wants, and what follows). `document` and `line`
//! are pure, `project` is all that touches files. `runs` are animations in a bucket, over any store.
//!
//! Invariants: it reads and writes what it was opened with and nothing else; it listens on loopback only; undoing
//! everything gives the bytes that were there.

mod document;
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
mod output;
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
mod snap_to_ground;
mod source_map;
mod tables;
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
