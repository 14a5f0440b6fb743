//! Scripts in a bucket become an animation: keys, stores, the manifest protocol and its steps.
//!
//! `docs/pipeline.md` is the protocol's reference. Each step takes an [`Invocation`]: store, clock, randomness, policy
//! and request id. This crate knows the bucket only as a [`store::Store`], time only as a [`clock::Clock`], and random
//! numbers only as [`clock::Randomness`]. It starts no threads and no tasks. Its `clippy.toml` bans wall clocks,
//! ambient randomness and spawning.
//!
//! Modules beside the steps:
//!
//! - `keys` parses and formats every key.
//! - `store` has the trait (one call, one request), a memory store, and the S3 store (feature `s3`). An upload may hold
//!   back its start and change it at the end (`Patch`).
//! - `observe` lists an animation. `reconcile` turns a listing into a manifest, a pure function.
//! - `manifest` is the document. `invariants` has the rules that are checked before each write.
//! - `survey` decides whether an invocation may stop because another frame is still to come.
//! - `outputs` decides which files an animation has, and which are to be built or deleted, a pure function.
//! - `lease` admits one assembler and one deleting sweep at a time. `build` makes an output, and `checkpoint` is its
//!   state between two invocations.
//! - `fakes` has a renderer and an animator for tests (feature `simulation`).

mod animator;
pub mod assemble;
mod build;
mod checkpoint;
pub mod clock;
mod error;
pub mod failure;
#[cfg(any(test, feature = "simulation"))]
pub mod fakes;
mod files;
pub mod fold;
pub mod invariants;
mod invocation;
pub mod keys;
mod lease;
pub mod manifest;
mod observe;
mod outputs;
pub mod reconcile;
pub mod render;
pub mod retry;
pub mod store;
mod survey;
pub mod sweep;
#[cfg(test)]
mod tests;
mod wake_count;

pub use animator::{Animator, Encoding, Unfit};
pub use assemble::assemble;
pub use clock::{Clock, Randomness, SystemClock, Timestamp};
pub use error::{Cause, Error, Result, found};
pub use failure::record_failure;
pub use fold::fold;
#[cfg(any(test, feature = "simulation"))]
pub use invocation::ReplayState;
pub use invocation::{Invocation, Mutation, Policy};
pub use observe::script_versions;
pub use reconcile::reconcile;
pub use render::{BandJoiner, Drawing, File, Files, Renderer, Source, render_frame};
pub use retry::retry;
pub use sweep::sweep;
