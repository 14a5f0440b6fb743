//! Prints where MinIO is, and installs it from source where there is none (needs Go): the tests then run on it too.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "it is a program of the command line")]

use std::process::ExitCode;

fn main() -> ExitCode {
    match rayfold_local::minio::find_or_install(&mut |line| eprintln!("{line}")) {
        Ok(binary) => {
            println!("{}", binary.display());
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
