//! The `rayfold` command, as a library for its `main` alone.
//!
//! `app` parses the flags. `Console` holds the global flags and the environment, resolved once. Each subcommand is a
//! module with its flags (`Args`) and a function `run`, which takes both and returns the exit code (`Outcome`).
//!
//! - `render` first reads all scripts (`plan`, `survey`). `render/movie` writes the container (GIF, APNG, WebP, Y4M).
//!   `render/fit` finds the quality that fits into a size. `render/passes` writes the files beside images
//!   (`docs/passes.md`).
//! - `encode` reads images and videos (`encode/picture`).
//! - `cloud` is the command-line interface to `client`.
//! - Without the feature `network` (on by default), only the subcommands that need no network are built. `elsewhere`
//!   has the message for the others.
//!
//! `docs/commands` has the help of each subcommand, and a test compares them.

mod ahead;
mod app;
mod check;
#[cfg(feature = "network")]
mod cloud;
mod completions;
mod console;
#[cfg(feature = "network")]
mod cost;
#[cfg(all(unix, feature = "network"))]
mod dev;
#[cfg(any(test, not(feature = "network")))]
mod elsewhere;
mod encode;
mod input;
mod interrupt;
mod man;
#[cfg(feature = "network")]
mod network;
mod outcome;
mod plan;
mod playback;
mod progress;
mod render;
mod split;
#[cfg(feature = "network")]
mod studio;
mod survey;
mod threads;
mod values;
mod wording;

pub use app::run;
