//! The layout of the bucket. Every key that the pipeline reads or writes is parsed and formatted here, and only here.
//!
//! A key that parses is canonical: formatting it gives the same text back. `docs/pipeline.md` has the table.
//!
//! ```
//! use rayfold_pipeline::keys::Key;
//! let key: Key = "scripts/films/hello/0007.txt".parse()?;
//! assert!(matches!(&key, Key::Script { animation, name }
//!     if animation.as_str() == "films/hello" && name.as_str() == "0007"));
//! assert_eq!(key.to_string(), "scripts/films/hello/0007.txt");
//! # Ok::<(), rayfold_pipeline::Error>(())
//! ```

use std::fmt;
use std::num::NonZeroU64;
use std::str::FromStr;

use rayfold_scene::{Container, Name, SETTINGS_FILE};
use serde::{Deserialize, Serialize};

use crate::store::ETag;
use crate::{Error, Result};

mod band;
mod event;
mod files;
mod names;
mod output;

pub use band::Band;
pub use event::decode_event_key;
pub use files::{Entry, FileList, NameHash, VersionHash};
pub use names::{Uploaded, goes_with, misplaced};

/// The maximum length of a key below `scripts/` in bytes: S3 allows 1,024, and a receipt's key adds a tag to the
/// script's.
pub const LONGEST_SCRIPT_KEY: usize = 900;

/// The folder of the scripts.
pub const SCRIPTS: &str = "scripts/";
/// The folder of the manifests.
pub const MANIFESTS: &str = "manifests/";

/// The name of a lease's file. No receipt has this ending.
const LEASE_FILE: &str = "@assembler.json";
const SWEEP_LEASE_FILE: &str = "@sweep.json";

/// The name of the object that triggers a script whose files have changed.
const WAKE_FILE: &str = "files.json";

/// The folder of unfinished GIFs, and the ending of their names.
const CHECKPOINTS: &str = "checkpoints/";
const CHECKPOINT_END: &str = ".state";

/// An animation's name: path segments joined by `/`, none of them empty, `.` or `..`.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Animation(String);

/// A script's name within its animation: the file's name without `.txt`. Not empty, without `/`.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct ScriptName(String);

/// The identity of a frame's pixels: a script's version and the version of the renderer that draws them.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Tag {
    /// The script's version, its entity tag.
    pub version: ETag,
    /// The renderer's pixel version.
    pub pixels: u32,
}

/// The number of a frame in a script with several, counted from 1; `None` if the script is one frame.
pub type Part = Option<NonZeroU64>;

/// The identity of a set of frames and settings, for a manifest, a claim and a GIF: 32 hexadecimal digits.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Generation(String);

/// A key of the pipeline.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[expect(missing_docs, reason = "fields without a comment are named after their types")]
pub enum Key {
    /// `scripts/<animation>/<name>.txt`
    Script { animation: Animation, name: ScriptName },
    /// `scripts/<animation>/animation.json`
    Settings { animation: Animation },
    /// `parts/<animation>/<name>@<tag>/<number>.json`
    Part {
        animation: Animation,
        name: ScriptName,
        tag: Tag,
        /// The number of the frame in its script.
        number: NonZeroU64,
    },
    /// `parts/<animation>/<name>@<tag>/<band>.band-<attempt>.json`, of a part
    /// `parts/<animation>/<name>@<tag>/<number>/<band>.band-<attempt>.json`
    Band {
        animation: Animation,
        name: ScriptName,
        /// The script's version, and that of the renderer that cut the frame.
        tag: Tag,
        /// The frame in its script.
        part: Part,
        /// The rows of the frame.
        band: Band,
        /// The retry that triggered the band; 0 if the invocation that cut the frame did.
        attempt: u64,
    },
    /// `parts/<animation>/<name>@<tag>/files.json`: a file that the script names has changed.
    Wake {
        animation: Animation,
        name: ScriptName,
        /// The version that the script is expected to have with its files in their current state.
        tag: Tag,
    },
    /// An object below `frames/`: the result of a script, of a part, or of the whole set.
    Receipt { animation: Animation, receipt: Receipt },
    /// `frames/<animation>/@assembler.json`: the lease of the invocation that waits for the set to settle, or builds
    /// its GIF.
    Lease { animation: Animation },
    /// `frames/<animation>/@sweep.json`: the lease of the sweep that deletes results which may have to be drawn again.
    SweepLease { animation: Animation },
    /// `manifests/<animation>.json`
    Manifest { animation: Animation },
    /// `manifests/<animation>.json~<version>`: a manifest that could not be read, set aside when a
    /// new one was written.
    SetAside {
        animation: Animation,
        /// The version that the manifest had in its place.
        version: ETag,
    },
    /// `assemblies/<animation>/<revision>-<generation>.json`
    Claim {
        animation: Animation,
        /// The manifest's revision that is claimed for.
        revision: u64,
        /// The generation that the claim is for.
        generation: Generation,
    },
    /// `retries/<animation>/<name>@<tag>/<attempt>`, of a part `retries/<animation>/<name>@<tag>/<number>/<attempt>`
    Retry {
        animation: Animation,
        name: ScriptName,
        tag: Tag,
        /// The frame in its script.
        part: Part,
        /// The number of the attempt, from 1.
        attempt: NonZeroU64,
    },
    /// `checkpoints/<animation>.state`: the progress of a GIF that several invocations build, one after the other.
    Checkpoint { animation: Animation },
    /// `animations/<animation>.gif`, or another ending: a file that is made of the animation.
    Output { animation: Animation, output: Container },
    /// `frames/<animation>/@output.<ending>`: there may be such a file of the animation. A GIF needs none.
    OutputMark { animation: Animation, output: Container },
}

/// The part of a receipt's key below `frames/<animation>/`.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[expect(missing_docs, reason = "fields without a comment are named after their types")]
pub enum Receipt {
    /// `<name>@<tag>.png`, of a part `<name>@<tag>/<number>.png`
    Frame {
        name: ScriptName,
        tag: Tag,
        /// The frame in its script.
        part: Part,
    },
    /// `<name>@<tag>.error.json`, of a part `<name>@<tag>/<number>.error.json`
    Fault {
        name: ScriptName,
        tag: Tag,
        /// The frame in its script.
        part: Part,
    },
    /// `<name>@<tag>.begun-<attempt>`, of a part `<name>@<tag>/<number>.begun-<attempt>`: an invocation that a retry
    /// triggered has begun.
    Begun {
        name: ScriptName,
        tag: Tag,
        /// The frame in its script.
        part: Part,
        /// The number of the retry's attempt.
        attempt: NonZeroU64,
    },
    /// `<name>@<tag>.split-<k>`
    Split {
        name: ScriptName,
        tag: Tag,
        /// The number of frames in the script.
        count: NonZeroU64,
    },
    /// `<name>@<tag>.cut-<k>`, of a part `<name>@<tag>/<number>.cut-<k>`: the frame is drawn in bands.
    Cut {
        name: ScriptName,
        tag: Tag,
        /// The frame in its script.
        part: Part,
        /// The number of bands of the cut.
        count: NonZeroU64,
    },
    /// `<name>@<tag>.<band>.band`, of a part `<name>@<tag>/<number>.<band>.band`: rows of a frame, as PNG.
    Band {
        name: ScriptName,
        tag: Tag,
        /// The frame in its script.
        part: Part,
        /// The rows of the frame.
        band: Band,
    },
    /// `<name>@<tag>.files-<i>-of-<n>-<entries>`: the files from which this version of the script is drawn.
    Files { name: ScriptName, tag: Tag, list: FileList },
    /// `<name>@<tag>.taken`: an invocation draws this version. Its files were still current after its set was put.
    Taken { name: ScriptName, tag: Tag },
    /// `<name>@<tag>.waits.json`: the frame cannot be drawn before files arrive that the script names.
    Waits { name: ScriptName, tag: Tag },
    /// `@<generation>.error.json`: this set of frames gives no GIF; of another file `@<generation>.<ending>.error.json`
    Refusal {
        /// The set that was refused.
        generation: Generation,
        output: Container,
    },
}

impl Animation {
    /// Checks the name of an animation.
    pub fn new(name: &str) -> Result<Self> {
        for segment in name.split('/') {
            match segment {
                "" => return Err(Error::key(name, "an animation's name has an empty segment")),
                "." | ".." => return Err(Error::key(name, "an animation's name has a segment . or ..")),
                _ => {}
            }
        }
        let longest = LONGEST_SCRIPT_KEY - SCRIPTS.len() - "/a.txt".len();
        if name.len() > longest {
            return Err(Error::key(name, "an animation's name is too long"));
        }
        Ok(Animation(name.to_owned()))
    }

    /// Returns the name as text.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// Returns the folder `scripts/<animation>/`.
    pub fn scripts(&self) -> String {
        format!("{SCRIPTS}{self}/")
    }

    /// Returns the folder `frames/<animation>/`.
    pub fn frames(&self) -> String {
        format!("frames/{self}/")
    }

    /// Returns the folder `retries/<animation>/`.
    pub fn retries(&self) -> String {
        format!("retries/{self}/")
    }

    /// Returns the folder `parts/<animation>/`.
    pub fn parts(&self) -> String {
        format!("parts/{self}/")
    }

    /// Returns the key `manifests/<animation>.json`.
    pub fn manifest(&self) -> String {
        format!("{MANIFESTS}{self}.json")
    }

    /// Returns the key `animations/<animation>.<ending>`.
    pub fn output(&self, output: Container) -> String {
        format!("animations/{self}.{}", output.ending())
    }

    /// Returns the key `animations/<animation>.gif`.
    pub fn gif(&self) -> String {
        self.output(Container::Gif)
    }

    /// Returns the key `checkpoints/<animation>.state`.
    pub fn checkpoint(&self) -> String {
        format!("{CHECKPOINTS}{self}{CHECKPOINT_END}")
    }

    /// Returns the key `scripts/<animation>/animation.json`.
    pub fn settings(&self) -> String {
        format!("{SCRIPTS}{self}/{SETTINGS_FILE}")
    }

    /// Returns the key `scripts/<animation>/<name>.txt`.
    pub fn script(&self, name: &ScriptName) -> String {
        format!("{SCRIPTS}{self}/{name}.txt")
    }

    /// Returns the key `scripts/<animation>/<name>` of a file that scripts name.
    pub(crate) fn file(&self, name: &str) -> String {
        format!("{SCRIPTS}{self}/{name}")
    }

    /// A key below `frames/<animation>/`.
    pub fn receipt(&self, receipt: &Receipt) -> String {
        format!("frames/{self}/{receipt}")
    }
}

impl ScriptName {
    /// Checks the name of a script.
    pub fn new(name: &str) -> Result<Self> {
        if name.is_empty() {
            return Err(Error::key(name, "the script has no name before its ending"));
        }
        if name.contains('/') {
            return Err(Error::key(name, "a script's name holds no slash"));
        }
        Ok(ScriptName(name.to_owned()))
    }

    /// Returns the name as text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl Tag {
    /// Returns the prefix of the receipts of all versions of a script with this entity tag, whatever its files.
    pub(crate) fn receipts_of_script(name: &ScriptName, script: &ETag) -> String {
        format!("{name}@{}", escape(script))
    }

    /// Returns the prefix of the receipts of a script's version, for all renderers: `<name>@<version>-p`.
    pub fn receipts_of(name: &ScriptName, version: &ETag) -> String {
        format!("{name}@{}-p", escape(version))
    }

    fn parse(text: &str) -> Option<Self> {
        let (version, pixels) = text.rsplit_once("-p")?;
        Some(Tag { version: unescape(version)?, pixels: canonical(pixels)? })
    }
}

impl Generation {
    /// Parses 32 hexadecimal digits in lower case.
    pub fn new(text: &str) -> Result<Self> {
        let digit = |byte: &u8| byte.is_ascii_digit() || (b'a'..=b'f').contains(byte);
        if text.len() != 32 || !text.as_bytes().iter().all(digit) {
            return Err(Error::key(text, "a generation is 32 hexadecimal digits"));
        }
        Ok(Generation(text.to_owned()))
    }

    /// Wraps digits that this crate has just made.
    pub(crate) fn of_hash(digits: String) -> Self {
        Generation(digits)
    }

    /// Returns the hexadecimal digits.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl Key {
    /// The animation that it belongs to.
    pub fn animation(&self) -> &Animation {
        match self {
            Key::Script { animation, .. }
            | Key::Settings { animation }
            | Key::Part { animation, .. }
            | Key::Band { animation, .. }
            | Key::Wake { animation, .. }
            | Key::Receipt { animation, .. }
            | Key::Lease { animation }
            | Key::SweepLease { animation }
            | Key::Manifest { animation }
            | Key::SetAside { animation, .. }
            | Key::Claim { animation, .. }
            | Key::Retry { animation, .. }
            | Key::Checkpoint { animation }
            | Key::Output { animation, .. }
            | Key::OutputMark { animation, .. } => animation,
        }
    }
}

impl FromStr for Key {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let unknown = || Error::key(text, "not a key of the pipeline");
        let (folder, rest) = text.split_once('/').ok_or_else(unknown)?;
        let key = match folder {
            "scripts" => script(text, rest)?,
            "parts" if rest.rsplit_once('/').is_some_and(|(_, file)| file.contains(".band-")) => {
                let (above, file) = rest.rsplit_once('/').ok_or_else(unknown)?;
                let (band, attempt) = file.rsplit_once(".band-").ok_or_else(unknown)?;
                let (animation, name, tag, part) = scripted_part(above).ok_or_else(unknown)?;
                let attempt = attempt.strip_suffix(".json").and_then(canonical).ok_or_else(unknown)?;
                let band = Band::parse(band).ok_or_else(unknown)?;
                Key::Band { animation: Animation::new(animation)?, name, tag, part, band, attempt }
            }
            "parts" => {
                let (animation, scripted, file) = beneath_tag(rest).ok_or_else(unknown)?;
                let (name, tag) = name_and_tag(scripted).ok_or_else(unknown)?;
                if file == WAKE_FILE {
                    return Ok(Key::Wake { animation: Animation::new(animation)?, name, tag });
                }
                let number = file.strip_suffix(".json").and_then(canonical).ok_or_else(unknown)?;
                Key::Part { animation: Animation::new(animation)?, name, tag, number }
            }
            "frames" if rest.ends_with(LEASE_FILE) => {
                Key::Lease { animation: above(rest, LEASE_FILE).ok_or_else(unknown)? }
            }
            "frames" if rest.ends_with(SWEEP_LEASE_FILE) => {
                Key::SweepLease { animation: above(rest, SWEEP_LEASE_FILE).ok_or_else(unknown)? }
            }
            "frames" if output::of_mark(rest).is_some() => {
                let (animation, output) = output::of_mark(rest).ok_or_else(unknown)?;
                Key::OutputMark { animation: Animation::new(animation)?, output }
            }
            "frames" => {
                let (animation, receipt) = receipt(rest).ok_or_else(unknown)?;
                Key::Receipt { animation: Animation::new(animation)?, receipt }
            }
            "manifests" => {
                // An escaped version has no full stop, so that no key is both.
                if let Some(animation) = rest.strip_suffix(".json") {
                    Key::Manifest { animation: Animation::new(animation)? }
                } else {
                    let (animation, version) = rest.rsplit_once(".json~").ok_or_else(unknown)?;
                    let version = unescape(version).ok_or_else(unknown)?;
                    Key::SetAside { animation: Animation::new(animation)?, version }
                }
            }
            "assemblies" => {
                let (animation, file) = rest.rsplit_once('/').ok_or_else(unknown)?;
                let (revision, generation) =
                    file.strip_suffix(".json").and_then(|stem| stem.split_once('-')).ok_or_else(unknown)?;
                Key::Claim {
                    animation: Animation::new(animation)?,
                    revision: canonical(revision).ok_or_else(unknown)?,
                    generation: Generation::new(generation)?,
                }
            }
            "retries" => {
                let (above, attempt) = rest.rsplit_once('/').ok_or_else(unknown)?;
                let attempt = canonical(attempt).ok_or_else(unknown)?;
                let (animation, name, tag, part) = scripted_part(above).ok_or_else(unknown)?;
                Key::Retry { animation: Animation::new(animation)?, name, tag, part, attempt }
            }
            "checkpoints" => {
                let animation = rest.strip_suffix(CHECKPOINT_END).ok_or_else(unknown)?;
                Key::Checkpoint { animation: Animation::new(animation)? }
            }
            "animations" => {
                let (animation, ending) = rest.rsplit_once('.').ok_or_else(unknown)?;
                let output = ending.parse().map_err(|_| unknown())?;
                Key::Output { animation: Animation::new(animation)?, output }
            }
            _ => return Err(unknown()),
        };
        Ok(key)
    }
}

impl Receipt {
    /// Returns the script and the version that the receipt is about.
    pub(crate) fn subject(&self) -> Option<(&ScriptName, &ETag)> {
        match self {
            Receipt::Frame { name, tag, .. }
            | Receipt::Fault { name, tag, .. }
            | Receipt::Begun { name, tag, .. }
            | Receipt::Cut { name, tag, .. }
            | Receipt::Band { name, tag, .. }
            | Receipt::Split { name, tag, .. }
            | Receipt::Files { name, tag, .. }
            | Receipt::Taken { name, tag }
            | Receipt::Waits { name, tag } => Some((name, &tag.version)),
            Receipt::Refusal { .. } => None,
        }
    }

    /// Returns whether it is about a version of a script with this entity tag, whatever its files.
    pub(crate) fn is_of_script(&self, script: &ScriptName, etag: &ETag) -> bool {
        self.subject().is_some_and(|(name, version)| name == script && version.script() == etag.as_str())
    }

    /// Returns whether it is about this version of a script, whatever renderer drew it.
    pub fn is_of(&self, script: &ScriptName, version: &ETag) -> bool {
        self.subject() == Some((script, version))
    }
}

impl FromStr for Receipt {
    type Err = Error;

    /// Parses the part of a key below `frames/<animation>/`.
    fn from_str(text: &str) -> Result<Self> {
        let unknown = || Error::key(text, "not a receipt");
        match receipt(&format!("a/{text}")).ok_or_else(unknown)? {
            ("a", receipt) => Ok(receipt),
            _ => Err(unknown()),
        }
    }
}

fn script(text: &str, rest: &str) -> Result<Key> {
    let class = match Name::below_scripts(rest, 0) {
        class @ (Name::Script(_) | Name::Settings) => class,
        Name::NearMiss(problem) | Name::Misplaced(problem) => return Err(Error::key(text, problem)),
        Name::Ignored => return Err(Error::key(text, "what systems leave in folders is ignored")),
        Name::Other => return Err(Error::key(text, "neither a script (.txt) nor animation.json")),
    };
    if text.len() > LONGEST_SCRIPT_KEY {
        return Err(Error::key(text, "the key is longer than 900 bytes"));
    }
    let animation = Animation::new(rest.rsplit_once('/').map_or("", |(animation, _)| animation));
    let animation = animation.map_err(|error| match error {
        Error::Key { problem, .. } => Error::key(text, problem),
        other => other,
    })?;
    Ok(match class {
        Name::Script(name) => Key::Script { animation, name: ScriptName(name.to_owned()) },
        _ => Key::Settings { animation },
    })
}

/// The animation of `<animation>/<file>`.
fn above(rest: &str, file: &str) -> Option<Animation> {
    Animation::new(rest.strip_suffix(file)?.strip_suffix('/')?).ok()
}

/// Splits `<animation>/<name>@<tag>/<file>` at the slashes.
fn beneath_tag(rest: &str) -> Option<(&str, &str, &str)> {
    let (above, file) = rest.rsplit_once('/')?;
    let (animation, scripted) = above.rsplit_once('/')?;
    Some((animation, scripted, file))
}

/// Formats `<animation>/<name>@<tag>`, for a part `<animation>/<name>@<tag>/<number>`.
fn scripted_part(above: &str) -> Option<(&str, ScriptName, Tag, Part)> {
    let (animation, last) = above.rsplit_once('/')?;
    if let Some((name, tag)) = name_and_tag(last) {
        return Some((animation, name, tag, None));
    }
    let part = canonical(last)?;
    let (animation, scripted) = animation.rsplit_once('/')?;
    let (name, tag) = name_and_tag(scripted)?;
    Some((animation, name, tag, Some(part)))
}

fn name_and_tag(text: &str) -> Option<(ScriptName, Tag)> {
    let (name, tag) = text.rsplit_once('@')?;
    Some((ScriptName::new(name).ok()?, Tag::parse(tag)?))
}

fn receipt(rest: &str) -> Option<(&str, Receipt)> {
    let (above, file) = rest.rsplit_once('/')?;
    if file.contains('@') {
        // A script's name may start with `@`, too; but nothing more follows a generation.
        let refused = file.strip_prefix('@').and_then(|file| file.strip_suffix(".error.json"));
        if let Some((generation, output)) = refused.and_then(output::of_refusal) {
            return Some((above, Receipt::Refusal { generation, output }));
        }
        // A name may hold whatever ends a receipt; a tag holds no dot.
        let (name, rest) = file.rsplit_once('@')?;
        let (tag, kind) = rest.split_once('.')?;
        let (name, tag) = (ScriptName::new(name).ok()?, Tag::parse(tag)?);
        return Some((above, receipt_of_kind(name, tag, None, kind)?));
    }
    let (animation, scripted) = above.rsplit_once('/')?;
    let (name, tag) = name_and_tag(scripted)?;
    let (number, kind) = file.split_once('.')?;
    Some((animation, receipt_of_kind(name, tag, Some(canonical(number)?), kind)?))
}

/// Parses the rest after the dot that follows the tag, or the part's number.
fn receipt_of_kind(name: ScriptName, tag: Tag, part: Part, kind: &str) -> Option<Receipt> {
    let numbered = |what: &str| kind.strip_prefix(what).map(canonical);
    Some(match kind {
        "png" => Receipt::Frame { name, tag, part },
        "error.json" => Receipt::Fault { name, tag, part },
        "taken" => part.is_none().then_some(Receipt::Taken { name, tag })?,
        "waits.json" => part.is_none().then_some(Receipt::Waits { name, tag })?,
        _ if kind.starts_with("files-") => {
            part.is_none().then_some(Receipt::Files { name, tag, list: FileList::parse(kind)? })?
        }
        _ => {
            if let Some(attempt) = numbered("begun-") {
                Receipt::Begun { name, tag, part, attempt: attempt? }
            } else if let Some(count) = numbered("cut-") {
                Receipt::Cut { name, tag, part, count: count? }
            } else if let Some(count) = numbered("split-") {
                // A part is not split.
                part.is_none().then_some(Receipt::Split { name, tag, count: count? })?
            } else {
                Receipt::Band { name, tag, part, band: Band::parse(kind.strip_suffix(".band")?)? }
            }
        }
    })
}

/// Parses a number that is written in its only canonical form.
fn canonical<N: FromStr + ToString>(text: &str) -> Option<N> {
    text.parse().ok().filter(|number: &N| number.to_string() == text)
}

/// Encodes a tag: letters, digits, `-` and `_` stay; other bytes become `~` and two hexadecimal digits.
fn escape(etag: &ETag) -> String {
    let mut text = String::new();
    for &byte in etag.as_str().as_bytes() {
        if byte.is_ascii_alphanumeric() || byte == b'-' || byte == b'_' {
            text.push(char::from(byte));
        } else {
            text.push_str(&format!("~{byte:02x}"));
        }
    }
    text
}

fn unescape(text: &str) -> Option<ETag> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.bytes();
    while let Some(byte) = rest.next() {
        match byte {
            b'~' => {
                let digits = [rest.next()?, rest.next()?];
                bytes.push(u8::from_str_radix(std::str::from_utf8(&digits).ok()?, 16).ok()?);
            }
            byte => bytes.push(byte),
        }
    }
    let etag = ETag::new(std::str::from_utf8(&bytes).ok()?);
    (!etag.as_str().is_empty() && escape(&etag) == text).then_some(etag)
}

impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Key::Script { animation, name } => f.write_str(&animation.script(name)),
            Key::Settings { animation } => f.write_str(&animation.settings()),
            Key::Part { animation, name, tag, number } => {
                write!(f, "parts/{animation}/{name}@{tag}/{number}.json")
            }
            Key::Band { animation, name, tag, part: None, band, attempt } => {
                write!(f, "parts/{animation}/{name}@{tag}/{band}.band-{attempt}.json")
            }
            Key::Band { animation, name, tag, part: Some(number), band, attempt } => {
                write!(f, "parts/{animation}/{name}@{tag}/{number}/{band}.band-{attempt}.json")
            }
            Key::Wake { animation, name, tag } => write!(f, "parts/{animation}/{name}@{tag}/{WAKE_FILE}"),
            Key::Receipt { animation, receipt } => f.write_str(&animation.receipt(receipt)),
            Key::Lease { animation } => write!(f, "{}{LEASE_FILE}", animation.frames()),
            Key::SweepLease { animation } => write!(f, "{}{SWEEP_LEASE_FILE}", animation.frames()),
            Key::Manifest { animation } => f.write_str(&animation.manifest()),
            Key::SetAside { animation, version } => {
                write!(f, "{}~{}", animation.manifest(), escape(version))
            }
            Key::Claim { animation, revision, generation } => {
                write!(f, "assemblies/{animation}/{revision}-{generation}.json")
            }
            Key::Retry { animation, name, tag, part: None, attempt } => {
                write!(f, "retries/{animation}/{name}@{tag}/{attempt}")
            }
            Key::Retry { animation, name, tag, part: Some(number), attempt } => {
                write!(f, "retries/{animation}/{name}@{tag}/{number}/{attempt}")
            }
            Key::Checkpoint { animation } => f.write_str(&animation.checkpoint()),
            Key::Output { animation, output } => f.write_str(&animation.output(*output)),
            Key::OutputMark { animation, output } => {
                write!(f, "{}{}", animation.frames(), output::mark(*output))
            }
        }
    }
}

impl fmt::Display for Receipt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Receipt::Frame { name, tag, part: None } => write!(f, "{name}@{tag}.png"),
            Receipt::Frame { name, tag, part: Some(number) } => write!(f, "{name}@{tag}/{number}.png"),
            Receipt::Fault { name, tag, part: None } => write!(f, "{name}@{tag}.error.json"),
            Receipt::Fault { name, tag, part: Some(number) } => write!(f, "{name}@{tag}/{number}.error.json"),
            Receipt::Begun { name, tag, part: None, attempt } => write!(f, "{name}@{tag}.begun-{attempt}"),
            Receipt::Begun { name, tag, part: Some(number), attempt } => {
                write!(f, "{name}@{tag}/{number}.begun-{attempt}")
            }
            Receipt::Split { name, tag, count } => write!(f, "{name}@{tag}.split-{count}"),
            Receipt::Cut { name, tag, part: None, count } => write!(f, "{name}@{tag}.cut-{count}"),
            Receipt::Cut { name, tag, part: Some(number), count } => {
                write!(f, "{name}@{tag}/{number}.cut-{count}")
            }
            Receipt::Band { name, tag, part: None, band } => write!(f, "{name}@{tag}.{band}.band"),
            Receipt::Band { name, tag, part: Some(number), band } => {
                write!(f, "{name}@{tag}/{number}.{band}.band")
            }
            Receipt::Files { name, tag, list } => write!(f, "{name}@{tag}.{list}"),
            Receipt::Taken { name, tag } => write!(f, "{name}@{tag}.taken"),
            Receipt::Waits { name, tag } => write!(f, "{name}@{tag}.waits.json"),
            Receipt::Refusal { generation, output } => {
                write!(f, "@{}.error.json", output::refusal(generation, *output))
            }
        }
    }
}

impl fmt::Display for Tag {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}-p{}", escape(&self.version), self.pixels)
    }
}

impl fmt::Display for Animation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl fmt::Display for ScriptName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl fmt::Display for Generation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl TryFrom<String> for Animation {
    type Error = Error;
    fn try_from(name: String) -> Result<Self> {
        Animation::new(&name)
    }
}

impl TryFrom<String> for ScriptName {
    type Error = Error;
    fn try_from(name: String) -> Result<Self> {
        ScriptName::new(&name)
    }
}

impl TryFrom<String> for Generation {
    type Error = Error;
    fn try_from(text: String) -> Result<Self> {
        Generation::new(&text)
    }
}

impl From<Animation> for String {
    fn from(animation: Animation) -> String {
        animation.0
    }
}

impl From<ScriptName> for String {
    fn from(name: ScriptName) -> String {
        name.0
    }
}

impl From<Generation> for String {
    fn from(generation: Generation) -> String {
        generation.0
    }
}

#[cfg(test)]
mod tests;
