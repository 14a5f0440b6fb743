//! The `rayfold` command, as a library for its `main` alone.
//!
//! Each subcommand is a module with its flags (`Args`) and a function `run`. `run` takes the flags and the `Console`,
//! which holds the resolved global flags and environment. Data goes to standard output, everything for people to
//! standard error. Exit codes: see `outcome`.

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
