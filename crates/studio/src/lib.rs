//! The studio: an editor for scenes in a browser, whose viewport shows the renderer's pictures.
//!
//! The script is the only copy of the scene: a document is the lines of a script. An edit on the page rewrites numbers
//! of one line, or adds, removes and moves lines; every other byte stays. The page displays messages of the server and
//! sends requests. Parsing, writing, picking, dragging and rendering happen here, in `scene` and `tracer`.
//!
//! A request of the page passes these modules:
//!
//! 1. `server` accepts requests. `door` checks the address's token, host and origin. Without a path, `start` serves the
//!    start page, which opens a studio for the user's choice.
//! 2. `session` turns a request of the page (`ClientMessage` in `protocol`) into edits, and answers with
//!    `ServerMessage`. It knows no socket, so its tests need no browser.
//! 3. `project` holds the scripts, and does all access to their files. A `document` is `line`s, and both are pure.
//!    Every edit is a splice with an inverse.
//! 4. `pictures` draws the newest request on a thread of its own. While something moves, `pace` chooses the size that
//!    can be drawn in time. `packing` sends the difference from the picture before.
//!
//! Others:
//!
//! - `tables` and `handles` derive palette, inspector and handles from the parser's forms, so that a new command
//!   appears there by itself.
//! - `clauses` has the numbers and words of a material's clauses. `arrange` aligns and pastes lines.
//! - `values` writes a changed number as a number or as a key of a curve. `tracks` edits keys.
//! - `source_map` maps lines to the tracer's objects. `silhouette` finds the object under a pixel.
//! - `runs` handles animations in a bucket, over any `Store`.
//! - [`browser`] has the session and the drawing without a server, for `crates/web`.
//!
//! Invariants: the studio reads and writes only what it was opened with. It listens on loopback only. Undoing
//! everything restores the original bytes.
//!
//! # The page
//!
//! `protocol.ts` in `web/src` is made of the Rust types by `ts-rs`, and a test compares the two. `web/dist` is the
//! built page, and `page` makes it a part of the program. So only developers who change the page need Node. `.ci/run`
//! compares `web/dist` with a new build.
//!
//! The script's editor (`web/src/script`) is CodeMirror. Its text may be ahead of the server's. Each change is sent at
//! once with the version of the text that it changes (`ClientMessage::Edit`, `text_edit`), and does not wait for a
//! reply. The version changes with every other change of the text, such as a drag or undo. The server refuses changes
//! of an old version. The page rebases them and sends them again, so typed text is never lost.
//!
//! The page uses CodeMirror's packages for view, commands and search. It does not use those for syntax trees,
//! completion and lint, because a language of lines needs less (`language`, `completion`, `folding`, `problems`), and
//! the page is limited to 133 kB compressed. `lean.mjs` leaves out CodeMirror's code for other browsers. `shorten.mjs`
//! shortens the names of properties that only CodeMirror uses.

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
