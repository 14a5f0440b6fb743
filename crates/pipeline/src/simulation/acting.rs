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

use std::num::NonZeroU64;
use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use rayfold_scene::AnimationSettings;

use super::bucket::{Fate, Grounds};
use super::engine::Engine;
use crate::Result;
use crate::assemble::{Animator, Encoding, Unfit};
use crate::keys::{Part, ScriptName};
use crate::manifest::Reason;
use crate::render::{Drawing, Renderer};

/// What a script asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Play {
    Frame,
    Split(NonZeroU64),
    Bad,
    Hang,
    Crash,
}

impl Play {
    pub(crate) fn of(script: &[u8]) -> Play {
        let text = String::from_utf8_lossy(script);
        let mut words = text.split(' ');
        match words.next() {
            Some("frame") => Play::Frame,
            Some("split") => words.next().and_then(|count| count.parse().ok()).map_or(Play::Bad, Play::Split),
            Some("hang") => Play::Hang,
            Some("crash") => Play::Crash,
            _ => Play::Bad,
        }
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
    let mut file = format!("fps {} loop {}\n", settings.fps(), settings.loops());
    for picture in pictures {
        file.push_str(picture);
        file.push('\n');
    }
    file
}

/// Draws in simulated time.
pub(super) struct Actress {
    pub(super) grounds: Arc<Grounds>,
    pub(super) fate: Arc<Fate>,
    pub(super) die: Arc<dyn Fn() + Send + Sync>,
    /// Milliseconds that a frame takes, from and to.
    pub(super) draw_ms: (u64, u64),
}

impl Renderer for Actress {
    fn most_bytes(&self) -> u64 {
        1_000
    }

    async fn draw(&self, name: &ScriptName, script: Bytes, part: Part) -> Result<Drawing> {
        let engine = &self.grounds.engine;
        engine.sleep(self.grounds.between_ms(self.draw_ms.0..self.draw_ms.1)).await;
        match (Play::of(&script), part) {
            (Play::Frame, None) | (Play::Split(_), Some(_)) => {
                Ok(Drawing::Frame(picture(name, &script, part).into()))
            }
            (Play::Split(count), None) => Ok(Drawing::Split(count)),
            (Play::Hang, _) => std::future::pending().await,
            (Play::Crash, _) => {
                let (fate, die) = (self.fate.clone(), self.die.clone());
                engine.after(Duration::ZERO, move || {
                    fate.kill();
                    die();
                });
                std::future::pending().await
            }
            (Play::Bad | Play::Frame, _) => Ok(Drawing::Fault(Reason::new(format!("{name}.txt:1:1: bad")))),
        }
    }
}

/// Lists frames, in simulated time.
pub(super) struct Lister {
    pub(super) engine: Engine,
    /// How long a frame takes.
    pub(super) push: Duration,
}

/// A list in the making.
pub(super) struct List {
    engine: Engine,
    push: Duration,
    settings: AnimationSettings,
    pictures: Vec<String>,
}

impl Animator for Lister {
    type Encoding = List;

    fn begin(&self, settings: &AnimationSettings) -> Result<List, Reason> {
        let (engine, push) = (self.engine.clone(), self.push);
        Ok(List { engine, push, settings: *settings, pictures: Vec::new() })
    }
}

impl Encoding for List {
    async fn push(&mut self, frame: Bytes) -> Result<Bytes, Unfit> {
        self.engine.sleep(self.push).await;
        if frame == GARBLED {
            return Err(Unfit::Corrupt(Reason::new("no picture")));
        }
        self.pictures.push(String::from_utf8_lossy(&frame).into_owned());
        Ok(Bytes::new())
    }

    async fn finish(self) -> Result<Bytes, Reason> {
        Ok(film(&self.settings, &self.pictures).into())
    }
}
