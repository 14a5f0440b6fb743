//! The readers of models, pictures and letters from outside, with hostile files too.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod formats;
mod hostile;
mod letters;
mod pictures;
mod textures;
