//! The offer of a submission: the project is checked and counted, and sample frames are rendered
//! to estimate the cost.

use std::sync::Arc;
use std::time::{Duration, Instant};

use bytes::Bytes;
use rayfold_client::cost::{Prices, Section, Workload, estimate, render_ms};
use rayfold_client::{Content, File, Submission, settings_with_frames};
use rayfold_pipeline::keys::{Animation, ScriptName};
use rayfold_scene::{AnimationSettings, Screen, Script};
use rayfold_tracer::{RenderOptions, picture_of_frame};
use serde::Serialize;

use crate::error::words;
use crate::output::png;
use crate::project::Project;

/// The number of sample frames, spread evenly over the animation. Each is rendered twice.
const SAMPLES: usize = 8;

/// The time limit for the samples. The first is rendered in any case.
const PATIENCE: Duration = Duration::from_secs(3);

/// The valid scripts of a project, as they are on the page.
#[derive(Debug)]
pub(super) struct Ready {
    scripts: Vec<(ScriptName, Bytes, Arc<Script>)>,
    settings: AnimationSettings,
    frames: u64,
    size: Screen,
}

/// The reason why nothing is uploaded.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Refusal {
    /// The reason as text.
    pub(super) why: String,
    /// The script with the error.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) script: Option<String>,
    /// Line and column, from 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) place: Option<(usize, usize)>,
    /// Scripts in the bucket that would have to be deleted.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) delete: Vec<String>,
}

/// The time and the cost of an animation on AWS.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Estimate {
    /// The number of frames.
    pub(super) frames: u64,
    /// The width and height of the frames.
    pub(super) size: (u32, u32),
    /// The time to render a frame on one thread of this machine, in milliseconds.
    pub(super) drawing_ms: f64,
    /// The region and the date of the prices.
    pub(super) prices: String,
    /// The lines of the bill, by section.
    pub(super) sections: Vec<Section>,
}

impl Refusal {
    pub(super) fn new(why: impl Into<String>) -> Self {
        Self { why: why.into(), ..Self::default() }
    }

    pub(super) fn of(error: &dyn std::error::Error) -> Self {
        Self::new(words(error))
    }
}

/// Returns the script name for a file of the project.
fn script_name(file: &str) -> &str {
    file.strip_suffix(".txt").unwrap_or(file)
}

impl Ready {
    /// Collects the scripts of a project.
    ///
    /// # Errors
    /// Returns the first error of the scripts.
    pub(super) fn of(project: &Project) -> Result<Self, Refusal> {
        let mut scripts = Vec::new();
        let mut size: Option<(Screen, &str)> = None;
        let mut frames = 0_u64;
        for file in &project.files {
            let name = script_name(&file.name);
            let refused = |why: String| Refusal { script: Some(name.to_owned()), ..Refusal::new(why) };
            if let Some(fault) = file.diagnostics.iter().find(|diagnostic| diagnostic.is_error()) {
                let why = format!("{}:{}:{}: {}", file.name, fault.line, fault.column, fault.message);
                return Err(Refusal { place: Some((fault.line, fault.column)), ..refused(why) });
            }
            let Some(script) = &file.script else {
                return Err(refused(format!("{} is not a script", file.name)));
            };
            for shot in script.shots() {
                match size {
                    Some((first, of)) if first != shot.screen => {
                        return Err(refused(format!(
                            "an animation has one size, but {of} is {} x {} and {} is {} x {}: give their scripts the \
                             same Screen",
                            first.width(),
                            first.height(),
                            file.name,
                            shot.screen.width(),
                            shot.screen.height()
                        )));
                    }
                    Some(_) => {}
                    None => size = Some((shot.screen, &file.name)),
                }
            }
            frames += script.frame_count() as u64;
            let script_name = ScriptName::new(name).map_err(|error| refused(words(&error)))?;
            scripts.push((script_name, file.document.bytes().into(), Arc::clone(script)));
        }
        let Some((size, _)) = size else { return Err(Refusal::new("nothing is rendered: expected a Trace")) };
        match project.settings().frames() {
            Some(expected) if frames < expected => Err(Refusal::new(format!(
                "animation.json says {expected} frames, but the scripts give {frames}"
            ))),
            _ => Ok(Self { scripts, settings: project.settings(), frames, size }),
        }
    }

    /// Returns the wanted content of the bucket's folder.
    ///
    /// # Errors
    /// Fails if the bucket does not allow a name.
    pub(super) fn submission(&self, animation: Animation) -> Result<Submission, Refusal> {
        let refused = |error: rayfold_client::Error| Refusal::of(&error);
        let frames = self.settings.frames().unwrap_or(self.frames);
        let settings = settings_with_frames(&self.settings, frames).map_err(refused)?;
        let scripts = self
            .scripts
            .iter()
            .map(|(name, text, _)| Ok((name.clone(), File::new(Content::Bytes(text.clone()))?)));
        let scripts: Vec<_> = scripts.collect::<rayfold_client::Result<_>>().map_err(refused)?;
        Submission::new(animation, scripts, settings).map_err(refused)
    }

    /// Renders sample frames on one thread, for a few seconds at most.
    ///
    /// # Errors
    /// Fails if a frame cannot be rendered.
    pub(super) fn estimate(&self) -> Result<Estimate, Refusal> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
        let pool = pool.map_err(|error| Refusal::of(&error))?;
        let prices = Prices::built_in().map_err(|error| Refusal::of(&error))?;
        let (mut seconds, mut bytes, mut drawn) = (0.0, 0, 0_u32);
        let begun = Instant::now();
        for at in self.sampled() {
            if drawn > 0 && begun.elapsed() > PATIENCE {
                break;
            }
            let (shortest, size) = pool.install(|| self.draw(at, begun))?;
            seconds += shortest;
            bytes += size;
            drawn += 1;
        }
        let drawn = f64::from(drawn.max(1));
        let drawing_ms = 1e3 * seconds / drawn;
        let mut work = Workload::new(self.frames, self.size, 0.0);
        work.ms = render_ms(self.frames, None, drawing_ms, work.memory_mb);
        work.frame_kb = bytes as f64 / drawn / 1e3;
        Ok(Estimate {
            frames: self.frames,
            size: (self.size.width(), self.size.height()),
            drawing_ms,
            prices: format!("{} on {}, in {}", prices.region, prices.as_of, prices.currency),
            sections: estimate(&work, &prices),
        })
    }

    /// Returns the indices of the sample frames, from 0.
    fn sampled(&self) -> impl Iterator<Item = usize> {
        let frames = usize::try_from(self.frames).unwrap_or(usize::MAX);
        (0..frames).step_by(frames.div_ceil(SAMPLES).max(1))
    }

    /// Renders a frame, twice if there is time. Returns the shorter time in seconds, and the size of its file.
    fn draw(&self, at: usize, begun: Instant) -> Result<(f64, usize), Refusal> {
        let mut left = at;
        let place = self.scripts.iter().find_map(|(_, _, script)| {
            let found = (left < script.frame_count()).then_some((script, left));
            left = left.saturating_sub(script.frame_count());
            found
        });
        let Some((script, frame)) = place else { return Err(Refusal::new("there is no such frame")) };
        let (mut shortest, mut size) = (f64::INFINITY, 0);
        for again in [false, true] {
            if again && begun.elapsed() > PATIENCE {
                break;
            }
            let start = Instant::now();
            let Some(image) = picture_of_frame(script, frame, &RenderOptions::default()) else { break };
            let image = image.map_err(|error| Refusal::of(&error))?;
            size = png(&image).map_err(|error| Refusal::of(&error))?.len();
            shortest = shortest.min(start.elapsed().as_secs_f64());
        }
        Ok((shortest, size))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn project(files: &[(&str, &str)]) -> (tempfile::TempDir, Project) {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in files {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        let project = Project::open(folder.path()).unwrap();
        (folder, project)
    }

    const BALL: &str = "Screen 24 16\nSphere 6 12 8 -9 .2 .2 .2 .7 .6 .5\nTrace\n";

    #[test]
    fn what_would_be_refused_by_the_functions_is_refused_here_with_its_place() {
        let (_folder, project) = project(&[("a.txt", BALL), ("b.txt", "Screen 24 16\nSpere 6\nTrace\n")]);
        let refusal = Ready::of(&project).unwrap_err();
        assert_eq!((refusal.script.as_deref(), refusal.place), (Some("b"), Some((2, 1))));
        assert!(refusal.why.starts_with("b.txt:2:1: "), "{}", refusal.why);
    }

    #[test]
    fn frames_of_unlike_sizes_and_too_few_frames_are_refused() {
        let (_folder, unlike) = project(&[("a.txt", BALL), ("b.txt", &BALL.replace("24", "25"))]);
        assert!(Ready::of(&unlike).unwrap_err().why.contains("a.txt is 24 x 16 and b.txt is 25 x 16"));
        let (_folder, few) = project(&[("a.txt", BALL), ("animation.json", r#"{"frames": 2}"#)]);
        assert!(Ready::of(&few).unwrap_err().why.contains("says 2 frames, but the scripts give 1"));
    }

    #[test]
    fn an_estimate_counts_all_frames_and_draws_some() {
        let many = BALL.to_owned() + &"Trace\n".repeat(49);
        let (_folder, project) = project(&[("a.txt", &many), ("b.txt", BALL)]);
        let ready = Ready::of(&project).unwrap();
        assert_eq!(ready.sampled().collect::<Vec<_>>(), [0, 7, 14, 21, 28, 35, 42, 49]);
        let estimate = ready.estimate().unwrap();
        assert_eq!((estimate.frames, estimate.size), (51, (24, 16)));
        assert!(estimate.drawing_ms > 0.0 && estimate.sections.len() == 3);
        let submission = ready.submission(Animation::new("film").unwrap()).unwrap();
        assert_eq!(submission.animation().as_str(), "film");
    }
}
