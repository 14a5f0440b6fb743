//! The traits of an encoder of animations, which the program that runs the assembler implements. The module knows no
//! bucket.

use std::future::Future;

use bytes::Bytes;
use rayfold_scene::{AnimationSettings, Container};

use crate::manifest::Reason;
use crate::store::Patch;

/// A maker of encoders. The assemble function provides those of all containers, the simulation a smaller one.
pub trait Animator: Send + Sync {
    /// An animation being encoded.
    type Encoding: Encoding;

    /// Starts an animation, whose frames may have alpha if `alpha` says so. Fails with the reason why there can be
    /// none.
    fn begin(
        &self,
        settings: &AnimationSettings,
        output: Container,
        alpha: bool,
    ) -> Result<Self::Encoding, Reason>;

    /// Continues an animation that was [suspended](Encoding::suspend), with the same bytes. Fails with the reason: the
    /// state is damaged, or of another version of the encoder.
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

    /// Returns the rest of the file, and the bytes of its start that are known only at the end.
    ///
    /// # Errors
    ///
    /// The reason why these frames make no animation, which would be the same next time.
    fn finish(self) -> impl Future<Output = Result<(Bytes, Option<Patch>), Reason>> + Send;

    /// Stops between two frames. Returns a state from which another process can continue.
    ///
    /// # Errors
    ///
    /// The reason why these frames make no animation.
    fn suspend(self) -> impl Future<Output = Result<Bytes, Reason>> + Send;
}

/// The reason why a frame cannot be added to an animation.
#[derive(Debug, Clone, PartialEq)]
pub enum Unfit {
    /// The object is no frame, because another writer has replaced it. Drawing it again may help.
    Corrupt(Reason),
    /// The frame does not fit the others. This would be the same next time.
    Unlike(Reason),
    /// The frame has alpha, but the file was begun without.
    Alpha,
}
