//! Scripts in a bucket become an animation: keys, stores, the manifest protocol and its steps.
//!
//! `docs/pipeline.md` is the protocol's reference. This crate knows the bucket only as a [`store::Store`], time only
//! as a [`clock::Clock`] and chance only as [`clock::Randomness`]; it starts no threads and no tasks.

mod animator;
pub mod assemble;
mod build;
mod checkpoint;
pub mod clock;
mod error;
pub mod failure;
pub mod fold;
pub mod invariants;
mod invocation;
pub mod keys;
mod lease;
pub mod manifest;
mod observe;
pub mod reconcile;
pub mod render;
pub mod retry;
#[cfg(any(test, feature = "simulation"))]
pub mod simulation;
pub mod store;
pub mod sweep;
#[cfg(test)]
mod tests;
mod wakings;

pub use animator::{Animator, Encoding, Unfit};
pub use assemble::assemble;
pub use clock::{Clock, Randomness, SystemClock, Timestamp};
pub use error::{Cause, Error, Result, found};
pub use failure::record_failure;
pub use fold::fold;
#[cfg(any(test, feature = "simulation"))]
pub(crate) use invocation::Carried;
pub use invocation::{Invocation, Mutation, Policy};
pub use reconcile::reconcile;
pub use render::{Drawing, Joining, Renderer, render_frame};
pub use retry::retry;
pub use sweep::sweep;
