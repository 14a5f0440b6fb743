//! A renderer and an animator small enough to simulate a million runs: a script is one line, a frame is a line that
//! names what it shows, an animation is the list of its frames.
//!
//! | script      | gives                                   |
//! | ----------- | --------------------------------------- |
//! | `frame N`   | one frame                               |
//! | `split K N` | K frames                                |
//! | `bad N`     | a fault                                 |
//! | `hang N`    | nothing, ever: the deadline comes       |
//! | `crash N`   | the death of the process that draws it  |
//! | `big …`     | the same, each frame of it in bands     |

use std::num::NonZeroU64;
use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use rayfold_scene::AnimationSettings;
use serde::{Deserialize, Serialize};

use super::bucket::{Fate, Grounds};
use super::engine::Engine;
use crate::Result;
use crate::animator::{Animator, Encoding, Unfit};
use crate::keys::{Band, Part, ScriptName};
use crate::manifest::Reason;
use crate::render::{Drawing, Joining, Renderer};

/// What a script asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Play {
    Frame,
    Split(NonZeroU64),
    Bad,
    Hang,
    Crash,
}

impl Play {
    pub(super) fn of(script: &[u8]) -> Play {
        let text = String::from_utf8_lossy(script);
        let mut words = text.strip_prefix(BIG).unwrap_or(&text).split(' ');
        match words.next() {
            Some("frame") => Play::Frame,
            Some("split") => words.next().and_then(|count| count.parse().ok()).map_or(Play::Bad, Play::Split),
            Some("hang") => Play::Hang,
            Some("crash") => Play::Crash,
            _ => Play::Bad,
        }
    }
}

/// What a script starts with whose frames are too big for one invocation.
pub(super) const BIG: &str = "big ";

/// Whether a script's frames are to be drawn in bands.
fn is_big(script: &[u8]) -> bool {
    script.starts_with(BIG.as_bytes())
}

/// A band of a picture.
fn strip(name: &ScriptName, script: &[u8], part: Part, band: Band) -> String {
    format!("{band} of {}", picture(name, script, part))
}

/// Bands being laid one below the other. What they show is the picture if they are all of its bands; else it is torn.
pub(crate) struct Paste {
    picture: String,
    strips: Vec<String>,
}

impl Paste {
    fn of(name: &ScriptName, script: &[u8], part: Part) -> Self {
        Paste { picture: picture(name, script, part), strips: Vec::new() }
    }
}

impl Joining for Paste {
    async fn push(&mut self, band: Bytes) -> Result<(), Reason> {
        if band == GARBLED {
            return Err(Reason::new("no picture"));
        }
        self.strips.push(String::from_utf8_lossy(&band).into_owned());
        Ok(())
    }

    async fn finish(self) -> Result<Bytes, Reason> {
        let Paste { picture, strips } = self;
        let (last, count) = (strips.last(), strips.len());
        let is_whole = last.is_some_and(|last| last.starts_with(&format!("{count}-of-{count} ")))
            && strips.iter().zip(1..).all(|(strip, k)| *strip == format!("{k}-of-{count} of {picture}"));
        Ok(if is_whole { picture } else { format!("{picture}, torn: {}", strips.join("; ")) }.into())
    }
}

/// What strangers put in the place of a frame.
pub(super) const GARBLED: &str = "garbled";

/// The picture of a frame.
pub(crate) fn picture(name: &ScriptName, script: &[u8], part: Part) -> String {
    let number = part.map_or(0, NonZeroU64::get);
    format!("{name}:{number}:{}", String::from_utf8_lossy(script))
}

/// The file of an animation.
pub(crate) fn film(settings: &AnimationSettings, pictures: &[String]) -> String {
    first_line((settings.fps(), settings.loops())) + &lines(pictures)
}

fn first_line((fps, loops): (f64, u16)) -> String {
    format!("fps {fps} loop {loops}\n")
}

fn lines(pictures: &[String]) -> String {
    pictures.iter().flat_map(|picture| [picture, "\n"]).collect()
}

/// Draws at once.
pub(crate) struct Drawer {
    /// Of a frame that is too big: with one it is drawn whole.
    pub(crate) bands: NonZeroU64,
}

impl Renderer for Drawer {
    type Joining = Paste;

    fn most_bytes(&self) -> u64 {
        1_000
    }

    async fn draw(
        &self,
        name: &ScriptName,
        script: Bytes,
        part: Part,
        _: Option<Duration>,
    ) -> Result<Drawing> {
        Ok(match (Play::of(&script), part) {
            (Play::Frame, None) | (Play::Split(_), Some(_)) if is_big(&script) && self.bands.get() > 1 => {
                Drawing::Cut(self.bands)
            }
            (Play::Frame, None) | (Play::Split(_), Some(_)) => {
                Drawing::Frame(picture(name, &script, part).into())
            }
            (Play::Split(count), None) => Drawing::Split(count),
            (Play::Bad | Play::Hang | Play::Crash | Play::Frame, _) => {
                Drawing::Fault(Reason::new(format!("{name}.txt:1:1: bad")))
            }
        })
    }

    async fn draw_band(
        &self,
        name: &ScriptName,
        script: Bytes,
        part: Part,
        band: Band,
    ) -> Result<Result<Bytes, Reason>> {
        Ok(Ok(strip(name, &script, part, band).into()))
    }

    async fn join(
        &self,
        name: &ScriptName,
        script: Bytes,
        part: Part,
        _: NonZeroU64,
    ) -> Result<Result<Paste, Reason>> {
        Ok(Ok(Paste::of(name, &script, part)))
    }
}

/// Draws in simulated time.
pub(super) struct Actress {
    pub(super) grounds: Arc<Grounds>,
    pub(super) fate: Arc<Fate>,
    pub(super) die: Arc<dyn Fn() + Send + Sync>,
    /// Milliseconds that a frame takes, from and to.
    pub(super) draw_ms: (u64, u64),
}

impl Actress {
    async fn take_time(&self) {
        self.grounds.engine.sleep(self.grounds.between_ms(self.draw_ms.0..self.draw_ms.1)).await;
    }

    /// Measured anew it is not always cut the same, and a frame at the edge is drawn after all.
    fn drawer(&self, script: &[u8]) -> Drawer {
        let bands = if is_big(script) { self.grounds.random.below(6) } else { 1 };
        Drawer { bands: NonZeroU64::new(bands).unwrap_or(NonZeroU64::MIN) }
    }
}

impl Renderer for Actress {
    type Joining = Paste;

    fn most_bytes(&self) -> u64 {
        Drawer { bands: NonZeroU64::MIN }.most_bytes()
    }

    async fn draw(
        &self,
        name: &ScriptName,
        script: Bytes,
        part: Part,
        time: Option<Duration>,
    ) -> Result<Drawing> {
        self.take_time().await;
        match Play::of(&script) {
            Play::Hang => std::future::pending().await,
            Play::Crash => {
                let (fate, die) = (self.fate.clone(), self.die.clone());
                self.grounds.engine.after(Duration::ZERO, move || {
                    fate.kill();
                    die();
                });
                std::future::pending().await
            }
            Play::Frame | Play::Split(_) | Play::Bad => {
                self.drawer(&script).draw(name, script, part, time).await
            }
        }
    }

    async fn draw_band(
        &self,
        name: &ScriptName,
        script: Bytes,
        part: Part,
        band: Band,
    ) -> Result<Result<Bytes, Reason>> {
        self.take_time().await;
        self.drawer(&script).draw_band(name, script, part, band).await
    }

    async fn join(
        &self,
        name: &ScriptName,
        script: Bytes,
        part: Part,
        bands: NonZeroU64,
    ) -> Result<Result<Paste, Reason>> {
        self.drawer(&script).join(name, script, part, bands).await
    }
}

/// How an animation is assembled.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Pace {
    /// How long a frame takes.
    pub(super) push: Duration,
    /// Whether a frame goes out when the next one comes, as of a GIF; else all do at the end.
    pub(super) is_eager: bool,
}

/// Lists frames, in simulated time.
pub(super) struct Lister {
    pub(super) engine: Engine,
    pub(super) pace: Pace,
}

/// A list in the making.
pub(super) struct List {
    engine: Engine,
    pace: Pace,
    listed: Listed,
}

/// What of it another process needs.
#[derive(Serialize, Deserialize)]
pub(crate) struct Listed {
    settings: (f64, u16),
    is_begun: bool,
    pictures: Vec<String>,
}

impl Listed {
    pub(crate) fn new(settings: &AnimationSettings) -> Self {
        Listed { settings: (settings.fps(), settings.loops()), is_begun: false, pictures: Vec::new() }
    }

    pub(crate) fn push(&mut self, frame: &[u8]) {
        self.pictures.push(String::from_utf8_lossy(frame).into_owned());
    }

    /// What has not gone out.
    pub(crate) fn take(&mut self) -> Bytes {
        let pictures = std::mem::take(&mut self.pictures);
        let mut text = lines(&pictures);
        if !std::mem::replace(&mut self.is_begun, true) {
            text.insert_str(0, &first_line(self.settings));
        }
        text.into()
    }

    /// # Errors
    ///
    /// Never, in fact.
    pub(crate) fn suspend(&self) -> Result<Bytes, Reason> {
        serde_json::to_vec(self).map(Bytes::from).map_err(|error| Reason::new(error.to_string()))
    }

    /// # Errors
    ///
    /// When it is none.
    pub(crate) fn resume(state: &[u8]) -> Result<Self, Reason> {
        serde_json::from_slice(state).map_err(|error| Reason::new(error.to_string()))
    }
}

impl Animator for Lister {
    type Encoding = List;

    fn begin(&self, settings: &AnimationSettings) -> Result<List, Reason> {
        Ok(self.list(Listed::new(settings)))
    }

    async fn resume(&self, state: Bytes) -> Result<List, Reason> {
        Listed::resume(&state).map(|listed| self.list(listed))
    }
}

impl Lister {
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

    async fn finish(mut self) -> Result<Bytes, Reason> {
        Ok(self.listed.take())
    }

    async fn suspend(self) -> Result<Bytes, Reason> {
        self.listed.suspend()
    }
}
