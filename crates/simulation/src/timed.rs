//! The [fakes](rayfold_pipeline::fakes) in simulated time.

use std::num::NonZeroU64;
use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use rayfold_pipeline::store::Patch;
use rayfold_scene::{AnimationSettings, Container};

use super::bucket::{Fate, SimEnvironment};
use super::engine::Engine;
use rayfold_pipeline::Result;
use rayfold_pipeline::fakes::{GARBLED, InstantRenderer, Listed, Paste, Play, is_big};
use rayfold_pipeline::keys::{Band, ScriptName};
use rayfold_pipeline::manifest::Reason;
use rayfold_pipeline::render::{Drawing, Files, Renderer, Source};
use rayfold_pipeline::{Animator, Encoding, Unfit};

/// Draws in simulated time.
pub(super) struct TimedRenderer {
    pub(super) env: Arc<SimEnvironment>,
    pub(super) fate: Arc<Fate>,
    pub(super) die: Arc<dyn Fn() + Send + Sync>,
    /// The minimum and the maximum milliseconds that a frame takes.
    pub(super) draw_ms: (u64, u64),
}

impl TimedRenderer {
    async fn take_time(&self) {
        self.env.engine.sleep(self.env.between_ms(self.draw_ms.0..self.draw_ms.1)).await;
    }

    /// A frame that is measured again may get another number of bands, and a frame at the limit may be drawn after all.
    fn drawer(&self, script: &[u8]) -> InstantRenderer {
        let bands = if is_big(script) { self.env.random.below(6) } else { 1 };
        InstantRenderer { bands: NonZeroU64::new(bands).unwrap_or(NonZeroU64::MIN) }
    }
}

impl Renderer for TimedRenderer {
    type BandJoiner = Paste;

    fn most_bytes(&self) -> u64 {
        InstantRenderer { bands: NonZeroU64::MIN }.most_bytes()
    }

    fn most_file_bytes(&self) -> u64 {
        InstantRenderer { bands: NonZeroU64::MIN }.most_file_bytes()
    }

    async fn needed(&self, name: &ScriptName, script: Bytes, files: Files) -> Result<Vec<String>> {
        InstantRenderer { bands: NonZeroU64::MIN }.needed(name, script, files).await
    }

    async fn draw(&self, source: Source, time: Option<Duration>) -> Result<Drawing> {
        self.take_time().await;
        match Play::of(&source.script) {
            Play::Hang => std::future::pending().await,
            Play::Crash => {
                let (fate, die) = (self.fate.clone(), self.die.clone());
                self.env.engine.after(Duration::ZERO, move || {
                    fate.kill();
                    die();
                });
                std::future::pending().await
            }
            Play::Frame | Play::Split(_) | Play::Bad => self.drawer(&source.script).draw(source, time).await,
        }
    }

    async fn draw_band(&self, source: Source, band: Band) -> Result<Result<Bytes, Reason>> {
        self.take_time().await;
        self.drawer(&source.script).draw_band(source, band).await
    }

    async fn join(&self, source: Source, bands: NonZeroU64) -> Result<Result<Paste, Reason>> {
        self.drawer(&source.script).join(source, bands).await
    }
}

/// The time that an assembler takes per frame.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Pace {
    /// The time that a frame takes.
    pub(super) push: Duration,
    /// Whether a frame is output when the next one comes, as in a GIF; otherwise all are output at the end.
    pub(super) is_eager: bool,
}

/// An animator that lists frames, in simulated time.
pub(super) struct FakeAnimator {
    pub(super) engine: Engine,
    pub(super) pace: Pace,
}

/// A list in the making.
pub(super) struct List {
    engine: Engine,
    pace: Pace,
    listed: Listed,
}

impl Animator for FakeAnimator {
    type Encoding = List;

    fn begin(&self, settings: &AnimationSettings, output: Container, _: bool) -> Result<List, Reason> {
        Ok(self.list(Listed::new(settings, output)))
    }

    async fn resume(&self, _: &AnimationSettings, _: Container, state: Bytes) -> Result<List, Reason> {
        Listed::resume(&state).map(|listed| self.list(listed))
    }
}

impl FakeAnimator {
    fn list(&self, listed: Listed) -> List {
        List { engine: self.engine.clone(), pace: self.pace, listed }
    }
}

impl Encoding for List {
    async fn push(&mut self, frame: Bytes) -> Result<Bytes, Unfit> {
        self.engine.sleep(self.pace.push).await;
        if frame == GARBLED {
            return Err(Unfit::Corrupt(Reason::new("no picture")));
        }
        let before = if self.pace.is_eager { self.listed.take() } else { Bytes::new() };
        self.listed.push(&frame);
        Ok(before)
    }

    async fn finish(mut self) -> Result<(Bytes, Option<Patch>), Reason> {
        Ok(self.listed.finish())
    }

    async fn suspend(self) -> Result<Bytes, Reason> {
        self.listed.suspend()
    }
}
