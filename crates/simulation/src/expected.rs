//! The contents that a bucket must have when nothing is left to do, computed from its scripts alone, and the manifests
//! that may follow one another.

use std::num::NonZeroU64;

use rayfold_scene::{AnimationSettings, Container, SETTINGS_FILE, parse_settings};

use rayfold_pipeline::fakes::{Play, drawn_text, film, picture};
use rayfold_pipeline::keys::{Animation, Key, Part, ScriptName};
use rayfold_pipeline::manifest::{Frame, FrameState, Head, Manifest, Status};
use rayfold_pipeline::store::{Bucket, ETag, Object};

/// The state that an animation must have reached.
pub(super) struct Expected {
    /// The frames of the animation, in order.
    frames: Vec<Shot>,
    settings: Option<AnimationSettings>,
}

/// A frame as it must be.
struct Shot {
    script: ScriptName,
    version: ETag,
    part: Part,
    /// `None` if it cannot be drawn.
    picture: Option<String>,
    /// Whether a file that the frame's script names is absent.
    waits: bool,
}

impl Expected {
    pub(super) fn of(bucket: &Bucket, animation: &Animation) -> Self {
        let mut scripts: Vec<(ScriptName, ETag, Vec<u8>)> = Vec::new();
        let mut settings = Some(AnimationSettings::default());
        for key in bucket.keys().filter(|key| key.starts_with("scripts/")) {
            let Ok(Object { info, body }) = bucket.get(key) else { continue };
            match key.parse() {
                Ok(Key::Script { animation: of, name }) if of == *animation => {
                    scripts.push((name, info.etag, body.to_vec()));
                }
                Ok(Key::Settings { animation: of }) if of == *animation => {
                    settings = parse_settings(SETTINGS_FILE, &body).settings;
                }
                _ => {}
            }
        }
        // The names in these stories are numbers, with letters after them at most.
        scripts.sort_by_key(|(name, ..)| {
            let digits: String = name.as_str().chars().take_while(char::is_ascii_digit).collect();
            (digits.parse::<u64>().unwrap_or(u64::MAX), name.clone())
        });
        let mut frames = Vec::new();
        for (script, version, body) in scripts {
            let file = |name: &str| {
                let key = format!("{}{name}", animation.scripts());
                bucket.get(&key).ok().map(|object| object.body.to_vec())
            };
            let text = drawn_text(&body, file);
            let shot = |part: Part, is_drawn: bool| Shot {
                script: script.clone(),
                version: version.clone(),
                part,
                picture: text.as_ref().ok().filter(|_| is_drawn).map(|text| picture(&script, text, part)),
                waits: false,
            };
            match Play::of(&body) {
                _ if text.is_err() => frames.push(Shot { waits: true, ..shot(None, false) }),
                Play::Frame => frames.push(shot(None, true)),
                Play::Split(count) => {
                    frames.extend((1..=count.get()).map(|number| shot(NonZeroU64::new(number), true)));
                }
                Play::Bad | Play::Hang | Play::Crash => frames.push(shot(None, false)),
            }
        }
        Expected { frames, settings }
    }

    /// Returns the status. After a long time a sweep fails the frames whose files have not arrived.
    fn status(&self, manifest: Option<&Manifest>) -> Status {
        let waits = manifest.is_some_and(|manifest| manifest.head.waiting > 0);
        let expects = self.settings.as_ref().and_then(|settings| settings.frames()).unwrap_or(0);
        if self.frames.is_empty() {
            Status::Empty
        } else if (self.frames.len() as u64) < expects || waits && self.frames.iter().any(|shot| shot.waits) {
            Status::Waiting
        } else if self.settings.is_none() || self.frames.iter().any(|shot| shot.picture.is_none()) {
            Status::Failed
        } else {
            Status::Done
        }
    }

    /// Errors that may remain: frames that the manifest reports as failed although they can be drawn, and a GIF that it
    /// reports as refused although it can be made.
    pub(super) fn wrongly_given_up(&self, manifest: &Manifest) -> usize {
        let good =
            |name: &ScriptName| self.frames.iter().any(|shot| shot.script == *name && shot.picture.is_some());
        let failed = |state: &FrameState| matches!(state, FrameState::Failed(_));
        let refused = usize::from(manifest.head.status == Status::Refused);
        refused + manifest.frames.iter().filter(|frame| failed(&frame.state) && good(&frame.script)).count()
    }

    /// Returns an error that says what differs.
    pub(super) fn check(&self, bucket: &Bucket, animation: &Animation) -> Result<(), String> {
        let manifest = match bucket.get(&animation.manifest()) {
            Ok(object) => Some(Manifest::decode(animation, &object.body).map_err(|error| error.to_string())?),
            Err(_) => None,
        };
        let status = self.status(manifest.as_ref());
        let file = |output: Container| bucket.get(&animation.output(output)).ok();
        let Some(manifest) = manifest else {
            return match (self.frames.is_empty(), Container::ALL.into_iter().find_map(file)) {
                (true, None) => Ok(()),
                _ => Err("there is no manifest".to_owned()),
            };
        };
        let listed: Vec<_> = manifest
            .frames
            .iter()
            .map(|frame| {
                (
                    &frame.script,
                    frame.version.script(),
                    frame.part,
                    matches!(frame.state, FrameState::Done { .. }),
                )
            })
            .collect();
        let wanted: Vec<_> = self
            .frames
            .iter()
            .map(|shot| (&shot.script, shot.version.as_str(), shot.part, shot.picture.is_some()))
            .collect();
        if listed != wanted {
            return Err(format!("the manifest has the frames {listed:?}, not {wanted:?}"));
        }
        if let Some(frame) = manifest.frames.iter().find(|frame| frame.state == FrameState::Pending) {
            return Err(format!("{} is pending for ever", frame.script));
        }
        let waits = |frame: &Frame| {
            self.frames.iter().any(|shot| (&shot.script, shot.waits) == (&frame.script, true))
        };
        let mut waiting =
            manifest.frames.iter().filter(|frame| matches!(frame.state, FrameState::Waiting(_)));
        if let Some(frame) = waiting.find(|frame| !waits(frame)) {
            return Err(format!("{} waits for what is there", frame.script));
        }
        if manifest.head.status != status {
            return Err(format!("the manifest is {:?}, not {status:?}", manifest.head.status));
        }
        let settings = self.settings.as_ref().filter(|_| status == Status::Done);
        for output in Container::ALL {
            let film = settings.filter(|settings| settings.outputs().contains(&output)).map(|settings| {
                let pictures: Vec<String> =
                    self.frames.iter().filter_map(|shot| shot.picture.clone()).collect();
                film(settings, output, &pictures)
            });
            let name = output.name();
            match (film, file(output)) {
                (Some(film), Some(file)) if file.body != film => {
                    let body = String::from_utf8_lossy(&file.body);
                    return Err(format!("the {name} is from another set:\n{body}\nnot\n{film}"));
                }
                (Some(_), None) => return Err(format!("there is no {name}")),
                // While more frames are to be uploaded the last files stay.
                (None, Some(_)) if status != Status::Waiting => {
                    return Err(format!("there is a {name} that nobody asks for: {status:?}"));
                }
                _ => {}
            }
        }
        Ok(())
    }
}

/// Checks that a manifest follows its predecessor as the next revision, or changes only the recorded files.
pub(super) fn follows(next: &Manifest, before: Option<&Manifest>) -> Result<(), String> {
    let revision = before.map_or(0, |before| before.head.revision);
    let is_record = before.is_some_and(|before| {
        let (gif, outputs) = (next.head.gif.clone(), next.head.outputs.clone());
        let head = Head { gif, outputs, ..before.head.clone() };
        head != before.head && next.head == head && next.frames == before.frames
    });
    if next.head.revision == revision + 1 || is_record {
        return Ok(());
    }
    Err(format!("revision {} follows {revision}", next.head.revision))
}
