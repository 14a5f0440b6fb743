//! Scripts in a bucket become an animation: keys, stores, the manifest protocol and its steps.
//!
//! `docs/pipeline.md` is the protocol's reference. This crate knows the bucket only as a [`store::Store`], time only
//! as a [`clock::Clock`] and chance only as [`clock::Randomness`]; it starts no threads and no tasks.

pub mod clock;
mod error;
pub mod keys;
pub mod store;

pub use clock::{Clock, Randomness, SystemClock, Timestamp};
pub use error::{Cause, Error, Result};
