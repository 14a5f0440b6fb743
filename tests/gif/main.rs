//! The encoder against another decoder.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may panic, and says what it measured")]

mod any_frames;
mod clear;
mod fades;
mod generator;
mod round_trip;
mod suspended;
