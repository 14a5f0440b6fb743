//! What a bucket must hold once everything has come to rest, worked out from its scripts alone.

use std::num::NonZeroU64;

use rayfold_scene::{AnimationSettings, SETTINGS_FILE, parse_settings};

use super::acting::{Play, film, picture};
use crate::keys::{Animation, Key, Part, ScriptName};
use crate::manifest::{FrameState, Manifest, Status};
use crate::store::Bucket;

/// What an animation must have come to.
pub(super) struct Expected {
    /// Frames in order, each with its picture or `None` when it cannot be drawn.
    frames: Vec<(ScriptName, Part, Option<String>)>,
    settings: Option<AnimationSettings>,
}

impl Expected {
    pub(super) fn of(bucket: &Bucket, animation: &Animation) -> Self {
        let mut scripts: Vec<(ScriptName, Vec<u8>)> = Vec::new();
        let mut settings = Some(AnimationSettings::default());
        for key in bucket.keys().filter(|key| key.starts_with("scripts/")) {
            let body = bucket.get(key).map(|object| object.body).unwrap_or_default();
            match key.parse() {
                Ok(Key::Script { animation: of, name }) if of == *animation => {
                    scripts.push((name, body.to_vec()));
                }
                Ok(Key::Settings { animation: of }) if of == *animation => {
                    settings = parse_settings(SETTINGS_FILE, &body).settings;
                }
                _ => {}
            }
        }
        // The names in these stories are numbers, with letters after them at most.
        scripts.sort_by_key(|(name, _)| {
            let digits: String = name.as_str().chars().take_while(char::is_ascii_digit).collect();
            (digits.parse::<u64>().unwrap_or(u64::MAX), name.clone())
        });
        let mut frames = Vec::new();
        for (name, body) in scripts {
            match Play::of(&body) {
                Play::Frame => frames.push((name.clone(), None, Some(picture(&name, &body, None)))),
                Play::Split(count) => {
                    for number in (1..=count.get()).map(NonZeroU64::new) {
                        frames.push((name.clone(), number, Some(picture(&name, &body, number))));
                    }
                }
                Play::Bad | Play::Hang | Play::Crash => frames.push((name, None, None)),
            }
        }
        Expected { frames, settings }
    }

    fn status(&self) -> Status {
        let expects = self.settings.and_then(|settings| settings.frames()).unwrap_or(0);
        if self.frames.is_empty() {
            Status::Empty
        } else if (self.frames.len() as u64) < expects {
            Status::Waiting
        } else if self.settings.is_none() || self.frames.iter().any(|(_, _, picture)| picture.is_none()) {
            Status::Failed
        } else {
            Status::Done
        }
    }

    /// Frames that the manifest says cannot be drawn though they can, and a GIF that cannot be made though it can.
    pub(super) fn wrongly_given_up(&self, manifest: &Manifest) -> usize {
        let good =
            |name: &ScriptName| self.frames.iter().any(|(of, _, picture)| of == name && picture.is_some());
        let failed = |state: &FrameState| matches!(state, FrameState::Failed(_));
        let refused = usize::from(manifest.head.status == Status::Refused);
        refused + manifest.frames.iter().filter(|frame| failed(&frame.state) && good(&frame.script)).count()
    }

    /// Says what differs.
    pub(super) fn check(&self, bucket: &Bucket, animation: &Animation) -> Result<(), String> {
        let manifest = match bucket.get(&animation.manifest()) {
            Ok(object) => Some(Manifest::decode(animation, &object.body).map_err(|error| error.to_string())?),
            Err(_) => None,
        };
        let status = self.status();
        let gif = bucket.get(&animation.gif()).ok();
        let Some(manifest) = manifest else {
            return match (self.frames.is_empty(), gif) {
                (true, None) => Ok(()),
                _ => Err("there is no manifest".to_owned()),
            };
        };
        let listed: Vec<_> = manifest
            .frames
            .iter()
            .map(|frame| (frame.script.clone(), frame.part, matches!(frame.state, FrameState::Done { .. })))
            .collect();
        let wanted: Vec<_> = self
            .frames
            .iter()
            .map(|(name, part, picture)| (name.clone(), *part, picture.is_some()))
            .collect();
        if listed != wanted {
            return Err(format!("the manifest has the frames {listed:?}, not {wanted:?}"));
        }
        if let Some(frame) = manifest.frames.iter().find(|frame| frame.state == FrameState::Pending) {
            return Err(format!("{} is pending for ever", frame.script));
        }
        if manifest.head.status != status {
            return Err(format!("the manifest is {:?}, not {status:?}", manifest.head.status));
        }
        let film = self.settings.filter(|_| status == Status::Done).map(|settings| {
            let pictures: Vec<String> =
                self.frames.iter().filter_map(|(_, _, picture)| picture.clone()).collect();
            film(&settings, &pictures)
        });
        match (film, gif) {
            (Some(film), Some(gif)) if gif.body != film => Err(format!(
                "the GIF is from another set:\n{}\nnot\n{film}",
                String::from_utf8_lossy(&gif.body)
            )),
            (Some(_), None) => Err("there is no GIF".to_owned()),
            // While more frames are to be uploaded the last GIF stays.
            (None, Some(_)) if status != Status::Waiting => {
                Err(format!("there is a GIF of what is {status:?}"))
            }
            _ => Ok(()),
        }
    }
}
