//! Prints where an S3 server is, and installs it from source where there is none (needs Go): the tests then run on it too.
//!
//! `cargo run -p rayfold-local --example stores seaweedfs`, or `minio`.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "it is a program of the command line")]

use std::process::ExitCode;

use rayfold_local::StoreKind;

fn main() -> ExitCode {
    let name = std::env::args().nth(1).unwrap_or_default();
    let Some(program) = StoreKind::named(&name).and_then(StoreKind::program) else {
        eprintln!("usage: stores seaweedfs|minio");
        return ExitCode::FAILURE;
    };
    match program.find_or_install(&mut |line| eprintln!("{line}")) {
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
