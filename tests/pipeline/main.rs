//! The pipeline with the real renderer and encoder: its steps on a store in memory, and end to end with the function binaries.

#![allow(clippy::print_stderr, reason = "says what a test that failed was doing")]
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails, also in the functions that tests share")]
// Futures of the end-to-end tests hold those of the SDK.
#![recursion_limit = "256"]

mod faults;
mod pieces;
#[path = "../stage/mod.rs"]
mod stage;
mod steps;
mod whole;
