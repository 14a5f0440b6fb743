//! A renderer and an animator for tests, small enough to simulate a million runs: a script is one line, a frame is a
//! line that names what it shows, an animation is the list of its frames.
//!
//! | script      | gives                                   |
//! | ----------- | --------------------------------------- |
//! | `frame N`   | one frame                               |
//! | `split K N` | K frames                                |
//! | `bad N`     | a fault                                 |
//! | `hang N`    | nothing, ever: the deadline comes       |
//! | `crash N`   | the death of the process that draws it  |
//! | `big …`     | the same, each frame of it in bands     |
//! | `with A,B …` | the same, drawn from these files; a file `also C` refers to C, which may be absent |

use std::collections::BTreeSet;
use std::num::NonZeroU64;
use std::time::Duration;

use bytes::Bytes;
use rayfold_scene::{AnimationSettings, Container};
use serde::{Deserialize, Serialize};

use crate::Result;
use crate::keys::{Band, Part, ScriptName};
use crate::manifest::Reason;
use crate::render::{BandJoiner, Drawing, File, Files, Renderer, Source};
use crate::store::Patch;

/// The request that a script makes to the fakes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Play {
    /// The script is a single frame.
    Frame,
    /// A script of this many frames.
    Split(NonZeroU64),
    /// The script has a fault.
    Bad,
    /// A drawing that never ends.
    Hang,
    /// The death of the process that draws.
    Crash,
}

impl Play {
    /// Parses the text of a script.
    pub fn of(script: &[u8]) -> Play {
        let text = String::from_utf8_lossy(script);
        let text = text.strip_prefix(BIG).unwrap_or(&text);
        let mut words = without_files(text).split(' ');
        match words.next() {
            Some("frame") => Play::Frame,
            Some("split") => words.next().and_then(|count| count.parse().ok()).map_or(Play::Bad, Play::Split),
            Some("hang") => Play::Hang,
            Some("crash") => Play::Crash,
            _ => Play::Bad,
        }
    }
}

/// The first word of a script that names files, after `big ` if it has that.
const WITH: &str = "with ";

/// The first word of a file that refers to another one.
const ALSO: &str = "also ";

fn without_files(text: &str) -> &str {
    text.strip_prefix(WITH).and_then(|rest| rest.split_once(' ')).map_or(text, |(_, rest)| rest)
}

/// Returns the names of files in a script, each of which must exist for its drawing.
pub fn named(script: &[u8]) -> Vec<String> {
    let text = String::from_utf8_lossy(script);
    let text = text.strip_prefix(BIG).unwrap_or(&text);
    let names = text.strip_prefix(WITH).and_then(|rest| rest.split_once(' '));
    names.map_or(Vec::new(), |(names, _)| names.split(',').map(str::to_owned).collect())
}

/// Returns the name of the file that a file refers to.
pub fn referred(file: &[u8]) -> Option<String> {
    String::from_utf8_lossy(file).strip_prefix(ALSO).map(str::to_owned)
}

/// Returns the text that a drawing shows: the script with the files from which it is drawn, or the name of a file that
/// is absent.
///
/// # Errors
///
/// The name of the first absent file that the script names.
pub fn drawn_text(script: &[u8], file: impl Fn(&str) -> Option<Vec<u8>>) -> Result<Vec<u8>, String> {
    let mut text = script.to_vec();
    let mut names: Vec<(String, bool)> = named(script).into_iter().map(|name| (name, true)).collect();
    let mut seen = BTreeSet::new();
    while let Some((name, is_needed)) = names.pop() {
        // Files may refer to each other.
        if !seen.insert(name.clone()) {
            continue;
        }
        match file(&name) {
            Some(body) => {
                text.extend(format!(" | {name} = {}", String::from_utf8_lossy(&body)).bytes());
                names.extend(referred(&body).map(|name| (name, false)));
            }
            None if is_needed => return Err(name),
            None => text.extend(format!(" | no {name}").bytes()),
        }
    }
    Ok(text)
}

/// The first word of a script whose frames are too big for one invocation.
pub const BIG: &str = "big ";

/// Returns whether a script's frames are drawn in bands.
pub fn is_big(script: &[u8]) -> bool {
    script.starts_with(BIG.as_bytes())
}

/// A band of a picture.
fn strip(name: &ScriptName, script: &[u8], part: Part, band: Band) -> String {
    format!("{band} of {}", picture(name, script, part))
}

/// Bands that are joined from top to bottom. The result is the picture if they are all of its bands; otherwise it is
/// incomplete.
pub struct Paste {
    picture: String,
    strips: Vec<String>,
}

impl Paste {
    fn of(name: &ScriptName, script: &[u8], part: Part) -> Self {
        Paste { picture: picture(name, script, part), strips: Vec::new() }
    }
}

impl BandJoiner for Paste {
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

/// A body that another writer puts in the place of a frame.
pub const GARBLED: &str = "garbled";

/// The picture of a frame.
pub fn picture(name: &ScriptName, script: &[u8], part: Part) -> String {
    let number = part.map_or(0, NonZeroU64::get);
    format!("{name}:{number}:{}", String::from_utf8_lossy(script))
}

/// The file of an animation.
pub fn film(settings: &AnimationSettings, output: Container, pictures: &[String]) -> String {
    let film = first_lines(output, (settings.fps(), settings.loops())) + &lines(pictures);
    film.replacen(LENGTH, &length(film.len()), 1)
}

/// A placeholder for the length of a file that begins with it, until the length is known.
const LENGTH: &str = "of ........ bytes";

fn length(bytes: usize) -> String {
    format!("of {bytes:08} bytes")
}

fn first_lines(output: Container, (fps, loops): (f64, u16)) -> String {
    let first = match output {
        Container::Gif => String::new(),
        Container::Webp => format!("{LENGTH}\nwebp\n"),
        Container::Apng | Container::Y4m => format!("{}\n", output.ending()),
    };
    format!("{first}fps {fps} loop {loops}\n")
}

fn lines(pictures: &[String]) -> String {
    pictures.iter().flat_map(|picture| [picture, "\n"]).collect()
}

/// A renderer that draws at once.
pub struct InstantRenderer {
    /// The number of bands of a frame that is too big; with one band it is drawn whole.
    pub bands: NonZeroU64,
}

impl Renderer for InstantRenderer {
    type BandJoiner = Paste;

    fn most_bytes(&self) -> u64 {
        1_000
    }

    fn most_file_bytes(&self) -> u64 {
        1_000
    }

    async fn needed(&self, _: &ScriptName, script: Bytes, files: Files) -> Result<Vec<String>> {
        let mut needed = named(&script);
        let mut at = 0;
        while let Some(name) = needed.get(at) {
            let file = files.get(name).and_then(Option::as_ref);
            let referred = file.and_then(|file| referred(&file.body)).filter(|name| !needed.contains(name));
            needed.extend(referred);
            at += 1;
        }
        Ok(needed)
    }

    async fn draw(&self, source: Source, _: Option<Duration>) -> Result<Drawing> {
        let Source { name, script, part, .. } = &source;
        let text = match text_of(&source) {
            Ok(text) => text,
            Err(absent) => return Ok(Drawing::Waits(Reason::new(format!("{name}.txt waits for {absent}")))),
        };
        Ok(match (Play::of(script), *part) {
            (Play::Frame, None) | (Play::Split(_), Some(_)) if is_big(script) && self.bands.get() > 1 => {
                Drawing::Cut(self.bands)
            }
            (Play::Frame, None) | (Play::Split(_), Some(_)) => {
                Drawing::Frame(picture(name, &text, *part).into())
            }
            (Play::Split(count), None) => Drawing::Split(count),
            (Play::Bad | Play::Hang | Play::Crash | Play::Frame, _) => {
                Drawing::Fault(Reason::new(format!("{name}.txt:1:1: bad")))
            }
        })
    }

    async fn draw_band(&self, source: Source, band: Band) -> Result<Result<Bytes, Reason>> {
        let text = text_of(&source).unwrap_or_default();
        Ok(Ok(strip(&source.name, &text, source.part, band).into()))
    }

    async fn join(&self, source: Source, _: NonZeroU64) -> Result<Result<Paste, Reason>> {
        let text = text_of(&source).unwrap_or_default();
        Ok(Ok(Paste::of(&source.name, &text, source.part)))
    }
}

fn text_of(source: &Source) -> Result<Vec<u8>, String> {
    let body = |file: &Option<File>| file.as_ref().map(|file| file.body.to_vec());
    drawn_text(&source.script, |name| source.files.get(name).and_then(body))
}

/// The encoder's state, as another process needs it.
#[derive(Serialize, Deserialize)]
pub struct Listed {
    settings: (f64, u16),
    output: Container,
    /// The number of bytes that were taken.
    taken: usize,
    pictures: Vec<String>,
}

impl Listed {
    /// An animation without frames.
    pub fn new(settings: &AnimationSettings, output: Container) -> Self {
        let settings = (settings.fps(), settings.loops());
        Listed { settings, output, taken: 0, pictures: Vec::new() }
    }

    /// Appends a frame to the list.
    pub fn push(&mut self, frame: &[u8]) {
        self.pictures.push(String::from_utf8_lossy(frame).into_owned());
    }

    /// Takes the bytes that were not yet sent.
    pub fn take(&mut self) -> Bytes {
        let pictures = std::mem::take(&mut self.pictures);
        let mut text = lines(&pictures);
        if self.taken == 0 {
            text.insert_str(0, &first_lines(self.output, self.settings));
        }
        self.taken += text.len();
        text.into()
    }

    /// Takes the last bytes, and the length of the whole file if the file begins with it.
    pub fn finish(&mut self) -> (Bytes, Option<Patch>) {
        let rest = self.take();
        let bytes = length(self.taken).into();
        (rest, (self.output == Container::Webp).then_some(Patch { at: 0, bytes }))
    }

    /// # Errors
    ///
    /// Cannot fail.
    pub fn suspend(&self) -> Result<Bytes, Reason> {
        serde_json::to_vec(self).map(Bytes::from).map_err(|error| Reason::new(error.to_string()))
    }

    /// # Errors
    ///
    /// Fails if it is none.
    pub fn resume(state: &[u8]) -> Result<Self, Reason> {
        serde_json::from_slice(state).map_err(|error| Reason::new(error.to_string()))
    }
}
