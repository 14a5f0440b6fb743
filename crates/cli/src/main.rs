//! The `rayfold` command.
//!
//! One module a subcommand, each with its flags (`Args`) and a `run` that takes them together with the `Console`,
//! which holds what the global flags and the environment resolved to. Data goes to standard output, everything for
//! people to standard error. Exit codes: see [`outcome`].

use std::process::ExitCode;

mod ahead;
mod app;
mod check;
mod cloud;
mod completions;
mod console;
mod cost;
#[cfg(unix)]
mod dev;
mod encode;
mod input;
mod interrupt;
mod outcome;
mod output;
mod plan;
mod playback;
mod progress;
mod render;
mod split;
mod studio;
mod survey;
mod threads;
mod values;
mod wording;

fn main() -> ExitCode {
    app::run(std::env::args_os())
}
