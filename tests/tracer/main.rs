//! The tracer from outside: packets against the plain tracer, committed frames, means of samples, and bands.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may panic, and says what it measured")]

mod bands;
mod covers;
mod dice;
mod fast_glass;
mod fast_language;
mod fast_path;
mod first_hits;
mod golden;
mod hold;
mod images;
mod light;
mod meshes;
#[path = "../stage/one_in.rs"]
mod one_in;
mod sampled;
mod sampled_small;
mod skies;
