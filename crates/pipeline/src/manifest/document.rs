//! The manifest as bytes. A reader can read the first line, or find the line of a frame, without all of the document.
//!
//! The first line is the [`Head`] with the `places`. At regular distances, a place is a script and the offset of its
//! lines, counted from the end of the second line. A reader that needs one frame reads the beginning, and then the few
//! lines between two places.

use std::ops::Range;

use bytes::Bytes;
use serde::{Deserialize, Serialize};

use super::{Frame, FrameState, Head, Manifest, SCHEMA};
use crate::keys::{Animation, Part, ScriptName};
use crate::{Error, Result};

/// The second line, after which the frames follow.
const FRAMES: &str = "\"frames\":[\n";

/// The maximum number of pending frames that a large manifest lists at its beginning. They also take at most an eighth
/// of the bytes that a reader reads first.
const MAX_AWAITED: usize = 32;

/// The maximum number of places in a manifest, so that its head does not grow with the number of frames.
const MAX_PLACES: usize = 200;

/// The largest revision that every reader of JSON represents exactly. At a thousand revisions per second it is 285,000
/// years away.
const LAST_REVISION: u64 = 1 << 53;

/// The offset at which the lines of a frame begin.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct Place {
    script: ScriptName,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    part: Part,
    at: u64,
}

/// The content of the first bytes of a document.
#[derive(Debug, Clone)]
pub(crate) struct Beginning {
    /// All data but the frames.
    pub(crate) head: Head,
    places: Vec<Place>,
    /// Some of the pending frames.
    pub(crate) awaited: Vec<Frame>,
    frames_at: u64,
}

#[derive(Serialize)]
struct FirstLine<'a> {
    #[serde(flatten)]
    head: &'a Head,
    #[serde(skip_serializing_if = "<[Place]>::is_empty")]
    places: &'a [Place],
    #[serde(skip_serializing_if = "<[&Frame]>::is_empty")]
    awaited: &'a [&'a Frame],
}

#[derive(Deserialize)]
struct Places {
    schema: u32,
    #[serde(default)]
    places: Vec<Place>,
    #[serde(default)]
    awaited: Vec<Frame>,
}

impl Manifest {
    /// Encodes the document. If its frames take more than half of `glimpse`, the number of bytes that a reader reads
    /// first, the head contains places, at least an eighth of `glimpse` apart, and some pending frames.
    ///
    /// # Errors
    ///
    /// [`Error::Malformed`] if it cannot be written as JSON.
    pub fn encode(&self, glimpse: u64) -> Result<Bytes> {
        let key = self.head.animation.manifest();
        let malformed =
            |source: serde_json::Error| Error::Malformed { key: key.clone(), source: source.into() };
        let (mut lines, mut starts) = (String::new(), Vec::with_capacity(self.frames.len()));
        for (place, frame) in self.frames.iter().enumerate() {
            lines.push_str(if place == 0 { "" } else { ",\n" });
            starts.push(lines.len() as u64);
            lines.push_str(&serde_json::to_string(frame).map_err(malformed)?);
        }
        let length = lines.len() as u64;
        let apart = (glimpse / 8).max(length / MAX_PLACES as u64 + 1);
        let (mut places, mut awaited): (Vec<Place>, Vec<&Frame>) = Default::default();
        if length > glimpse / 2 {
            let ends = starts.iter().skip(1).chain([&length]);
            let lines = self.frames.iter().zip(starts.iter().zip(ends));
            let pending: Vec<_> = lines.filter(|(frame, _)| frame.state == FrameState::Pending).collect();
            let (step, mut bytes) = (pending.len().div_ceil(MAX_AWAITED).max(1), 0);
            for (frame, (start, end)) in pending.into_iter().step_by(step) {
                bytes += end - start;
                if bytes <= glimpse / 8 {
                    awaited.push(frame);
                }
            }
            for (frame, &at) in self.frames.iter().zip(&starts) {
                if places.last().is_none_or(|last| at >= last.at + apart) {
                    places.push(Place { script: frame.script.clone(), part: frame.part, at });
                }
            }
        }
        let first = FirstLine { head: &self.head, places: &places, awaited: &awaited };
        let mut text = serde_json::to_string(&first).map_err(malformed)?;
        text.pop();
        text.push_str(",\n");
        text.push_str(FRAMES);
        text.push_str(&lines);
        text.push_str("\n]}\n");
        Ok(Bytes::from(text))
    }

    /// Parses a whole document.
    ///
    /// # Errors
    ///
    /// [`Error::Malformed`] if it is no manifest, or of a later schema.
    pub fn decode(animation: &Animation, body: &[u8]) -> Result<Self> {
        let malformed = |source| Error::Malformed { key: animation.manifest(), source };
        let beginning = Beginning::decode(animation, body)?;
        let Some(Beginning { head, frames_at, .. }) = beginning else {
            return Err(malformed("the first line does not end".into()));
        };
        // The list is read as one value, from its bracket on; behind it there is the document's last brace.
        let list = usize::try_from(frames_at).unwrap_or(usize::MAX).saturating_sub("[\n".len());
        let list = body.get(list..).unwrap_or_default();
        let frames = serde_json::Deserializer::from_slice(list).into_iter::<Vec<Frame>>().next();
        match frames {
            Some(Ok(frames)) => Ok(Manifest { head, frames }),
            Some(Err(source)) => Err(malformed(source.into())),
            None => Err(malformed("the list of frames is missing".into())),
        }
    }
}

impl Beginning {
    /// Decodes the first bytes of a document. Returns `None` if the head is longer.
    ///
    /// # Errors
    ///
    /// [`Error::Malformed`] if they are no manifest, or of a later schema.
    pub(crate) fn decode(animation: &Animation, body: &[u8]) -> Result<Option<Self>> {
        let malformed = |source| Error::Malformed { key: animation.manifest(), source };
        let Some(end) = body.iter().position(|byte| *byte == b'\n') else { return Ok(None) };
        let frames_at = end + 1 + FRAMES.len();
        let Some(second) = body.get(end + 1..frames_at) else { return Ok(None) };
        let Some(line) = body[..end].strip_suffix(b",").filter(|_| second == FRAMES.as_bytes()) else {
            return Err(malformed("the first line is not a manifest's".into()));
        };
        let line = [line, b"}"].concat();
        let Places { schema, places, awaited } =
            serde_json::from_slice(&line).map_err(|source| malformed(source.into()))?;
        if schema > SCHEMA {
            return Err(malformed(format!("schema {schema} is newer than {SCHEMA}").into()));
        }
        let head: Head = serde_json::from_slice(&line).map_err(|source| malformed(source.into()))?;
        if head.animation != *animation {
            return Err(malformed(format!("it is that of {}", head.animation).into()));
        }
        if head.revision > LAST_REVISION {
            return Err(malformed(format!("revision {} is beyond {LAST_REVISION}", head.revision).into()));
        }
        Ok(Some(Beginning { head, places, awaited, frames_at: frames_at as u64 }))
    }

    /// Returns the range of bytes that contains the lines about a script's frame, if there are any, in a document of
    /// `size` bytes. Without a number these are the lines about its first or only frame.
    pub(crate) fn lines_of(&self, name: &ScriptName, part: Part, size: u64) -> Range<u64> {
        let number = part.map_or(1, std::num::NonZeroU64::get);
        let is_before = |place: &Place| {
            let (a, b) = (place.script.as_str(), name.as_str());
            let order = rayfold_scene::natural_cmp(a, b).then_with(|| a.cmp(b));
            order.then(place.part.map_or(0, std::num::NonZeroU64::get).cmp(&number)).is_le()
        };
        let next = self.places.partition_point(is_before);
        let at = |place: Option<&Place>| place.map(|place| self.frames_at + place.at);
        let start = next.checked_sub(1).and_then(|last| at(self.places.get(last)));
        start.unwrap_or(self.frames_at)..at(self.places.get(next)).unwrap_or(size)
    }
}

/// Decodes the frames in whole lines of a document.
///
/// # Errors
///
/// [`Error::Malformed`] if they are no frames.
pub(crate) fn frames_of(animation: &Animation, lines: &[u8]) -> Result<Vec<Frame>> {
    let lines = lines.split(|byte| *byte == b'\n').map(|line| line.strip_suffix(b",").unwrap_or(line));
    lines
        .filter(|line| line.starts_with(b"{"))
        .map(|line| {
            serde_json::from_slice(line)
                .map_err(|source| Error::Malformed { key: animation.manifest(), source: source.into() })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::manifest::{Settings, part};
    use crate::reconcile::{Results, ScriptFound, Scripts, reconcile};
    use crate::store::ETag;

    /// Scripts with names of all lengths, some of them with parts.
    fn manifest(scripts: usize) -> Manifest {
        let animation = Animation::new("film").unwrap();
        let found = (0..scripts).map(|n| ScriptFound {
            name: ScriptName::new(&format!("{}{n}", "x".repeat(n % 7))).unwrap(),
            version: ETag::new("v"),
            modified: crate::Timestamp(0),
        });
        let scripts = Scripts { found: found.collect(), ..Scripts::default() };
        let mut manifest = reconcile(&animation, &scripts, &Results::default(), &Settings::absent());
        let frames = std::mem::take(&mut manifest.frames).into_iter().enumerate();
        manifest.frames = frames
            .flat_map(|(place, frame)| {
                let parts = if place % 5 == 0 { 1..=place as u64 / 5 + 2 } else { 0..=0 };
                parts.map(move |number| Frame { part: part(number), ..frame.clone() })
            })
            .collect();
        manifest
    }

    #[test]
    fn a_document_reads_back_the_same() {
        for scripts in [0, 1, 40] {
            let manifest = manifest(scripts);
            for glimpse in [1, 2_000, 1 << 20] {
                let body = manifest.encode(glimpse).unwrap();
                assert_eq!(Manifest::decode(&manifest.head.animation, &body).unwrap(), manifest);
                serde_json::from_slice::<serde_json::Value>(&body).expect("the whole is one JSON document");
            }
        }
    }

    /// The listed frames are spread over all frames, and never so many that the head exceeds the first read.
    #[test]
    fn the_beginning_of_a_large_document_tells_some_frames_to_come() {
        let manifest = manifest(60);
        let animation = &manifest.head.animation;
        let pending = manifest.frames.len();
        for (glimpse, expected) in [(1, 0..=0), (2_000, 2..=5), (16_000, 18..=30), (1 << 20, 0..=0)] {
            let body = manifest.encode(glimpse).unwrap();
            let awaited = Beginning::decode(animation, &body).unwrap().unwrap().awaited;
            assert!(expected.contains(&awaited.len()), "{glimpse}: {} of {pending}", awaited.len());
            assert!(awaited.iter().all(|frame| manifest.frames.contains(frame)), "{glimpse}");
        }
        let mut manifest = manifest;
        for frame in &mut manifest.frames {
            frame.state = FrameState::Done { pixels: 1 };
        }
        let body = manifest.encode(16_000).unwrap();
        assert!(Beginning::decode(&manifest.head.animation, &body).unwrap().unwrap().awaited.is_empty());
    }

    #[test]
    fn every_frame_is_found_by_the_places() {
        let manifest = manifest(60);
        let animation = &manifest.head.animation;
        for glimpse in [1, 800, 8_000, 1 << 20] {
            let body = manifest.encode(glimpse).unwrap();
            let size = body.len() as u64;
            let beginning = Beginning::decode(animation, &body).unwrap().unwrap();
            assert!(beginning.places.len() <= MAX_PLACES + 1, "{}", beginning.places.len());
            for frame in &manifest.frames {
                let lines = beginning.lines_of(&frame.script, frame.part, size);
                let lines = lines.start as usize..lines.end as usize;
                let found = frames_of(animation, &body[lines]).unwrap();
                assert!(found.contains(frame), "{frame:?}");
                if frame.part.is_none_or(|number| number.get() == 1) {
                    let lines = beginning.lines_of(&frame.script, None, size);
                    let lines = lines.start as usize..lines.end as usize;
                    assert!(frames_of(animation, &body[lines]).unwrap().contains(frame), "{frame:?}");
                }
                assert_eq!(frame.state, FrameState::Pending);
            }
        }
    }

    #[test]
    fn a_head_that_is_cut_off_is_no_beginning() {
        let manifest = manifest(10);
        let body = manifest.encode(100).unwrap();
        let animation = &manifest.head.animation;
        let head = body.iter().position(|byte| *byte == b'\n').unwrap() + 1 + FRAMES.len();
        for length in [0, 1, head / 2, head - 1] {
            assert!(Beginning::decode(animation, &body[..length]).unwrap().is_none(), "{length}");
        }
        assert!(Beginning::decode(animation, &body[..head]).unwrap().is_some());
        assert!(Beginning::decode(animation, b"[]\n\"frames\":[\n").is_err());
    }

    #[test]
    fn what_is_no_manifest_of_the_animation_is_refused() {
        let manifest = manifest(1);
        let refused = |manifest: &Manifest, animation: &str| {
            let body = manifest.encode(100).unwrap();
            let error = Manifest::decode(&Animation::new(animation).unwrap(), &body).unwrap_err();
            std::error::Error::source(&error).unwrap().to_string()
        };
        assert_eq!(refused(&manifest, "other"), "it is that of film");
        let mut last = manifest.clone();
        last.head.revision = LAST_REVISION;
        Manifest::decode(&manifest.head.animation, &last.encode(100).unwrap()).unwrap();
        last.head.revision += 1;
        assert!(refused(&last, "film").contains("beyond"));
    }

    #[test]
    fn a_later_schema_is_refused() {
        let mut manifest = manifest(1);
        manifest.head.schema = SCHEMA + 1;
        let body = manifest.encode(100).unwrap();
        let error = Manifest::decode(&manifest.head.animation, &body).unwrap_err();
        assert!(std::error::Error::source(&error).unwrap().to_string().contains("newer"), "{error:?}");
    }

    #[test]
    fn places_stand_apart_and_only_where_frames_are_many() {
        let manifest = manifest(60);
        let lines: Vec<String> =
            manifest.frames.iter().map(|frame| serde_json::to_string(frame).unwrap()).collect();
        // A line ends with a comma and a line feed, but for the last one.
        let length = lines.iter().map(|line| line.len() as u64 + 2).sum::<u64>() - 2;
        let starts = |lines: &[String]| lines.iter().map(|line| line.len() as u64 + 2).sum::<u64>();
        for glimpse in [1, 800, 8_000, 2 * length - 2, 2 * length, 1 << 20] {
            let body = manifest.encode(glimpse).unwrap();
            let places = Beginning::decode(&manifest.head.animation, &body).unwrap().unwrap().places;
            assert_eq!(places.is_empty(), glimpse / 2 >= length, "{glimpse} of {length}");
            let apart = (glimpse / 8).max(length / MAX_PLACES as u64 + 1);
            let mut expected = Vec::new();
            for (number, frame) in manifest.frames.iter().enumerate() {
                let at = starts(&lines[..number]);
                if expected.last().is_none_or(|(_, last)| at - last >= apart) {
                    expected.push((frame, at));
                }
            }
            if !places.is_empty() {
                let same = |(place, (frame, at)): (&Place, &(&Frame, u64))| {
                    place.at == *at && place.script == frame.script && place.part == frame.part
                };
                assert!(
                    places.len() == expected.len() && places.iter().zip(&expected).all(same),
                    "{glimpse}"
                );
            }
        }
    }
}
