//! The traits of an encoder of animations, which the program that runs the assembler implements. The module knows no
//! bucket.

use std::future::Future;

use bytes::Bytes;
use rayfold_scene::{AnimationSettings, Container};

use crate::manifest::Reason;
use crate::store::Patch;

/// Makes encoders. The assemble function brings those of all containers, the simulation a smaller one.
pub trait Animator: Send + Sync {
    /// An animation being encoded.
    type Encoding: Encoding;

    /// Starts an animation, whose frames may have alpha if `alpha` says so; the reason when it cannot be.
    fn begin(
        &self,
        settings: &AnimationSettings,
        output: Container,
        alpha: bool,
    ) -> Result<Self::Encoding, Reason>;

    /// Goes on with an animation that was [suspended](Encoding::suspend), with the bytes that it would have had; the reason
    /// when that cannot be: the state is damaged, or of another version of the encoder.
    fn resume(
        &self,
        settings: &AnimationSettings,
        output: Container,
        state: Bytes,
    ) -> impl Future<Output = Result<Self::Encoding, Reason>> + Send;
}

/// An animation being encoded: frames in, pieces of the file out.
pub trait Encoding: Send {
    /// Adds the next frame, a PNG, and returns the bytes of the file that are ready.
    ///
    /// # Errors
    ///
    /// The problem of this frame, or of all frames together.
    fn push(&mut self, frame: Bytes) -> impl Future<Output = Result<Bytes, Unfit>> + Send;

    /// Gives the rest of the file, and what is known of its start only at its end.
    ///
    /// # Errors
    ///
    /// The reason why these frames make no animation; it would be the same next time.
    fn finish(self) -> impl Future<Output = Result<(Bytes, Option<Patch>), Reason>> + Send;

    /// Stops between two frames: gives a state that another process can go on with.
    ///
    /// # Errors
    ///
    /// The reason why these frames make no animation.
    fn suspend(self) -> impl Future<Output = Result<Bytes, Reason>> + Send;
}

/// Why a frame cannot be added to an animation.
#[derive(Debug, Clone, PartialEq)]
pub enum Unfit {
    /// The body is no frame: another writer has put something else in its place. Drawn again it may be one.
    Corrupt(Reason),
    /// The frame does not go with the others; it would be the same next time.
    Unlike(Reason),
    /// The frame has alpha, and the file was begun without.
    Alpha,
}
