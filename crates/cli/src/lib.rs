//! The `rayfold` command, as a library for its `main` alone.
//!
//! One module a subcommand, each with its flags (`Args`) and a `run` that takes them together with the `Console`,
//! which holds what the global flags and the environment resolved to. Data goes to standard output, everything for
//! people to standard error. Exit codes: see `outcome`.

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
