//! The commands that need a bucket or start one, with an S3 server, the local invoker and the function binaries.

#![allow(clippy::print_stderr, reason = "says what was measured, and what a test that failed was doing")]
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails, also in the functions that tests share")]

mod cluster;
mod commands;
mod dev;
#[path = "../stage/mod.rs"]
mod stage;
mod users;
