//! The `rayfold` command: all of its code is in the library beside this file.
//!
//! So the command is compiled while the tracer still is; only linking waits for the tracer.

use std::process::ExitCode;

fn main() -> ExitCode {
    rayfold_cli::run(std::env::args_os())
}
