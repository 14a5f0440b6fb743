//! The user: changes animations continually, records which changes arrived, and checks the results.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use fastrand::Rng;
use rayfold_pipeline::assemble::generation_of;
use rayfold_pipeline::keys::Animation;
use rayfold_pipeline::manifest::{Fault, FrameState, Manifest, Reason, Status};
use rayfold_pipeline::store::{PutOptions, S3Store, Store};
use rayfold_scene::{Container, parse_settings};

use crate::stage::{big_scene, locally_as, scene};

/// The number of attempts of a request.
const ASKS: usize = 5;

/// The time limit for a reply.
const PATIENCE: Duration = Duration::from_secs(5);

pub(crate) const ANIMATIONS: [&str; 3] = ["one", "two", "deep/three"];

/// The animation whose frames are drawn in bands.
const BIG: &str = "deep/three";

const SCRIPTS: [&str; 4] = ["1.txt", "2.txt", "10.txt", "3.txt"];
const SETTINGS: &str = "animation.json";

/// A script that cannot be drawn, so its error must be reported.
const FAULTY: &str = "Screen 24 18\nSpere 6\nTrace\n";

/// The files that settings ask for.
const OUTPUTS: [&str; 4] = [
    "",
    ", \"outputs\": [\"gif\", \"webp\"]",
    ", \"outputs\": [\"apng\"]",
    ", \"outputs\": [\"y4m\", \"gif\"]",
];

/// Settings that cannot be parsed.
const FAULTY_SETTINGS: &str = "{\"fps\": ";

/// The line by which a script has several frames.
const THREE: &str = "Frames 3\n";

/// The messages by which functions report that they gave up a frame or a set because of faults.
const GIVEN_UP: [&str; 3] = ["in each of", "is no frame, though drawn", "frames were assembled in the"];

/// The files that the user wants, and those of them that may not have arrived.
#[derive(Default)]
pub(crate) struct Wishes {
    files: BTreeMap<String, String>,
    unsure: BTreeSet<String>,
    pub(crate) acts: u64,
}

/// The outcome of a request of the user.
#[derive(PartialEq, Eq)]
enum Sent {
    Done,
    Refused,
    /// The request may still take effect, after the user's next action.
    Unknown,
}

impl Wishes {
    /// Changes something. If there is no reply, the state of the file is unknown.
    pub(crate) async fn act(&mut self, random: &mut Rng, store: &S3Store) {
        let animation = random.choice(ANIMATIONS).unwrap();
        let is_settings = random.u32(0..10) == 0;
        let file = if is_settings { SETTINGS } else { random.choice(SCRIPTS).unwrap() };
        let key = format!("scripts/{animation}/{file}");
        let text = match random.u32(0..12) {
            0..=2 => None,
            3 => Some(if is_settings { FAULTY_SETTINGS.to_owned() } else { FAULTY.to_owned() }),
            4 if !is_settings => Some(three_frames(animation)),
            _ if is_settings => {
                let outputs = random.choice(OUTPUTS).unwrap();
                Some(format!("{{\"frames\": {}, \"fps\": 5{outputs}}}", random.u32(1..4)))
            }
            // There are few contents, so that changes often restore a former state.
            _ => Some(frame(animation, f64::from(random.u32(1..4)) * 4.0)),
        };
        match text {
            Some(text) => drop(self.files.insert(key.clone(), text)),
            None => drop(self.files.remove(&key)),
        }
        self.acts += 1;
        for _ in 0..ASKS {
            match self.send(&key, store).await {
                Sent::Done => return,
                Sent::Refused => {}
                Sent::Unknown => drop(self.unsure.insert(key.clone())),
            }
        }
        self.unsure.insert(key);
    }

    async fn send(&self, key: &str, store: &S3Store) -> Sent {
        let request = async {
            match self.files.get(key) {
                Some(text) => store.put(key, text.clone().into(), PutOptions::always()).await.is_ok(),
                None => store.delete(key).await.is_ok(),
            }
        };
        match tokio::time::timeout(PATIENCE, request).await {
            Ok(true) => Sent::Done,
            Ok(false) => Sent::Refused,
            Err(_) => Sent::Unknown,
        }
    }

    /// Repeats the requests that may not have arrived. Returns their number.
    pub(crate) async fn make_sure(&mut self, store: &S3Store) -> usize {
        for key in &self.unsure {
            assert!(self.send(key, store).await == Sent::Done, "{key} cannot be sent in a calm world");
        }
        std::mem::take(&mut self.unsure).len()
    }

    /// Returns the files of an animation.
    pub(crate) fn of(&self, animation: &str) -> Vec<(&str, String)> {
        let prefix = format!("scripts/{animation}/");
        let mine =
            self.files.iter().filter_map(|(key, text)| Some((key.strip_prefix(&prefix)?, text.clone())));
        mine.collect()
    }
}

/// Returns a script of one frame, which depends on `x`. All frames of an animation have one size.
fn frame(animation: &str, x: f64) -> String {
    if animation == BIG { big_scene(10.0 * x) } else { scene(x) }
}

fn three_frames(animation: &str) -> String {
    let [from, to] = [2.0, 8.0].map(|x| frame(animation, x));
    // The number that differs becomes a curve.
    let moved = from
        .split(' ')
        .zip(to.split(' '))
        .map(|(first, last)| if first == last { first.to_owned() } else { format!("(1:{first} 3:{last})") });
    moved.collect::<Vec<_>>().join(" ").replace("Trace\n", &format!("{THREE}Trace\n"))
}

/// Returns the status that an animation of these files must reach.
fn expected(files: &[(&str, String)]) -> Status {
    let scripts: Vec<&str> =
        files.iter().filter(|(name, _)| *name != SETTINGS).map(|(_, text)| text.as_str()).collect();
    let settings = files.iter().find(|(name, _)| *name == SETTINGS);
    let settings = settings.map(|(name, text)| parse_settings(name, text.as_bytes()).settings);
    let awaited =
        settings.as_ref().and_then(Option::as_ref).and_then(|settings| settings.frames()).unwrap_or(0);
    let frames: u64 = scripts.iter().map(|text| if text.contains(THREE) { 3 } else { 1 }).sum();
    let is_faulty = settings == Some(None) || scripts.contains(&FAULTY);
    match (scripts.is_empty(), frames < awaited, is_faulty) {
        (true, _, _) => Status::Empty,
        (false, true, _) => Status::Waiting,
        (false, false, true) => Status::Failed,
        (false, false, false) => Status::Done,
    }
}

/// Describes the remaining difference between an animation and its files. Returns `None` if there is none.
pub(crate) async fn wrong(store: &S3Store, name: &str, files: &[(&str, String)]) -> Option<String> {
    let animation = Animation::new(name).unwrap();
    let mut made = BTreeMap::new();
    for output in Container::ALL {
        if let Ok(file) = store.get(&animation.output(output)).await {
            made.insert(output, file);
        }
    }
    let expected = expected(files);
    let Some(Manifest { head, frames }) = manifest(store, &animation).await else {
        let is_nothing = expected == Status::Empty && made.is_empty();
        return (!is_nothing).then(|| format!("{name}: no manifest of {files:?}"));
    };
    if head.status != expected {
        return Some(format!("{name}: {:?}, not {expected:?}: {frames:?}", head.status));
    }
    let wrong = |output: Container| {
        let (file, kind) = (made.get(&output), output.name());
        let is_wanted = expected == Status::Done && head.outputs().contains(&output);
        let generation = generation_of(file.map(|file| &file.info));
        match file {
            // While frames are missing, the last files stay.
            _ if expected == Status::Waiting => None,
            Some(file) if is_wanted && file.body == locally_as(output, files) => {
                (generation != Some(head.generation.as_str())).then(|| format!("{name}: an old {kind}"))
            }
            Some(_) if is_wanted => Some(format!("{name}: a {kind}, not the local one")),
            None if is_wanted => Some(format!("{name}: no {kind}")),
            Some(_) => Some(format!("{name}: a {kind} of what is {expected:?}, with {:?}", head.outputs())),
            None => None,
        }
    };
    Container::ALL.into_iter().find_map(wrong)
}

async fn manifest(store: &S3Store, animation: &Animation) -> Option<Manifest> {
    let object = store.get(&animation.manifest()).await.ok()?;
    Manifest::decode(animation, &object.body).ok()
}

/// Returns the names of the items of an animation that functions have given up because of faults.
pub(crate) async fn given_up(store: &S3Store, name: &str, files: &[(&str, String)]) -> Vec<String> {
    let Some(manifest) = manifest(store, &Animation::new(name).unwrap()).await else { return Vec::new() };
    let is_good =
        |script: &str| files.iter().any(|(file, text)| *file == format!("{script}.txt") && text != FAULTY);
    let faults = manifest.frames.iter().filter_map(|frame| match &frame.state {
        FrameState::Failed(fault) if is_good(frame.script.as_str()) => Some(fault),
        FrameState::Failed(_) | FrameState::Pending | FrameState::Waiting(_) | FrameState::Done { .. } => {
            None
        }
    });
    let faults = faults.chain(&manifest.head.refusal);
    let named = |fault: &Fault| fault.reason.as_ref().map(|reason: &Reason| reason.message.clone());
    faults.filter_map(named).filter(|message| GIVEN_UP.iter().any(|how| message.contains(how))).collect()
}
