//! The plan of the frames, made before the first is drawn.
//!
//! Every script is parsed once for its faults, its number of frames and their properties. Small scripts are kept;
//! beyond [`KEPT_TEXT`] they are parsed again when their turn comes, so that memory does not grow with their number.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::Duration;

use rayfold_scene::{
    AnimationSettings, Depth, Limits, Origin, SETTINGS_FILE, Samples, Scene, Screen, Script, Severity,
};
use rayfold_tracer::{CutLight, Exposure, Precision, RenderOptions};

use crate::console::Console;
use crate::input::{Input, ScriptFile};
use crate::interrupt;
use crate::survey::{Faults, parse_all};
use crate::wording::number;

/// The number of bytes of text up to which parsed scripts are kept; they take about as much again.
const KEPT_TEXT: usize = 64 << 20;

/// The memory in bytes for frames that are ahead of the encoder: two images of 1920 x 1080 while they are drawn.
const AHEAD: u64 = 192 << 20;

/// The time limit of the search for light that a depth cuts off.
const LOOKING: Duration = Duration::from_secs(3);

/// The bytes per pixel while a frame is drawn: its samples, its levels, and its share of the encoded file.
const OF_PIXEL: u64 = 48;

/// The bytes per pixel while passes are made: its hit, and the numbers of four passes twice.
const OF_PASSES: u64 = 96;

/// The minimum number of frames at once: one is drawn while another is encoded.
const FEWEST: usize = 2;

/// The maximum width and height of a GIF.
const LONGEST_SIDE: u32 = 65_535;

/// Frames in order, and the options for drawing them.
#[derive(Debug)]
pub(crate) struct Plan {
    parts: Vec<Part>,
    limits: Limits,
    size: Option<Screen>,
    samples: Option<Samples>,
    selected: RangeInclusive<u64>,
    /// The settings of the animation in the folder.
    pub(crate) settings: AnimationSettings,
    /// The numbers to compute with.
    pub(crate) precision: Precision,
    /// The levels of the colour behind the objects of frames without background; `None` for alpha.
    pub(crate) matte: Option<[u8; 3]>,
    /// Whether passes are made beside the pictures.
    has_passes: bool,
}

/// A frame to draw.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Job {
    /// The number of the frame, counted from 1 over all scripts.
    pub(crate) number: u64,
    part: usize,
    index: usize,
}

#[derive(Debug)]
struct Part {
    file: ScriptFile,
    /// Neighbouring frames of the same shape are counted together.
    runs: Vec<(usize, Shape)>,
    frames: usize,
    kept: Option<Arc<Script>>,
    used: Mutex<Weak<Script>>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Shape {
    screen: Screen,
    orthographic: bool,
    /// Without background.
    clear: bool,
    /// The value is rounded up to a power of two, so that a growing scene has few runs.
    objects: usize,
}

/// The frames that the user wants, and their options.
#[derive(Clone, Debug, Default)]
pub(crate) struct Wishes {
    /// The size of the pictures, in place of the scripts' own.
    pub(crate) size: Option<Screen>,
    /// The number of rays per pixel, in place of the scripts' own.
    pub(crate) samples: Option<Samples>,
    /// The first and the last frame; `None` for the ends of the animation.
    pub(crate) frames: (Option<u64>, Option<u64>),
    /// The numbers to compute with.
    pub(crate) precision: Precision,
    /// The levels of the colour behind the objects of frames without background, which have alpha if it is not given.
    pub(crate) matte: Option<[u8; 3]>,
    /// Whether passes are made beside the pictures.
    pub(crate) has_passes: bool,
}

/// The reason why the frames cannot be drawn although each script is correct.
#[derive(Debug, thiserror::Error)]
pub(crate) enum PlanError {
    #[error("the input has {}: there is no frame {wanted}", number(*.frames, "frame"))]
    NoSuchFrame { frames: u64, wanted: u64 },
    #[error("{SETTINGS_FILE} says {}, but the scripts give {frames}", number(*.expected, "frame"))]
    TooFew { frames: u64, expected: u64 },
    #[error("{SETTINGS_FILE} gives frame {frame} a duration, but there are {}", number(*.frames, "frame"))]
    NoFrameToTime { frames: u64, frame: u64 },
    #[error(
        "--size needs a pinhole camera: frame {frame} ({name}) is drawn by Orthocamera, whose pixels are world units"
    )]
    Orthographic { frame: u64, name: String },
    #[error("an animation has {LONGEST_SIDE} pixels on a side at most, but frame {frame} ({name}) is {} x {}", .size.width(), .size.height())]
    TooLong { frame: u64, name: String, size: Screen },
    #[error(
        "an animation has one size, but frame {first} ({first_name}) is {} x {} and frame {frame} ({name}) is {} x {}",
        .first_size.width(), .first_size.height(), .size.width(), .size.height()
    )]
    UnlikeSizes { first: u64, first_name: String, first_size: Screen, frame: u64, name: String, size: Screen },
}

impl Plan {
    /// Parses everything and shows the faults. Returns the faults if a script has an error.
    ///
    /// # Errors
    /// Fails if the scripts are correct but the options cannot be satisfied.
    pub(crate) fn new(
        input: &Input,
        limits: &Limits,
        wishes: &Wishes,
        console: &Console,
    ) -> anyhow::Result<Result<Self, Faults>> {
        let (faults, plan) = Self::survey(input, limits, wishes)?;
        faults.show(console);
        Ok(match plan {
            Some(plan) => Ok(plan?),
            None => Err(faults),
        })
    }

    /// Parses everything, and returns the faults. Returns a plan, or the reason why there is none, if and only if no
    /// script has an error.
    ///
    /// # Errors
    /// An error only if the run was asked to stop.
    pub(crate) fn survey(
        input: &Input,
        limits: &Limits,
        wishes: &Wishes,
    ) -> anyhow::Result<(Faults, Option<Result<Self, PlanError>>)> {
        let kept = AtomicUsize::new(0);
        let parsed = parse_all(&input.scripts, limits, |file, parsed| {
            let mut faults = Faults::default();
            let part = faults.script(parsed).map(|script| {
                let text = file.path().and_then(|p| p.metadata().ok()).map_or(0, |m| m.len() as usize);
                let keep = kept.fetch_add(text, Ordering::Relaxed) + text <= KEPT_TEXT;
                Part::new(file.clone(), script, keep)
            });
            (faults, part)
        })?;
        let mut faults = Faults::default();
        for not_read in &input.not_read {
            faults.conflict(&not_read.path, Severity::Warning, not_read);
        }
        let settings = input.settings.as_ref().map(|path| faults.settings(path));
        let mut parts = Vec::with_capacity(parsed.len());
        for (found, part) in parsed {
            faults.add(found);
            parts.extend(part);
        }
        if wishes.samples.is_some_and(|samples| samples.most() > 1) {
            faults.samples_are_asked_for();
        }
        let settings = settings.flatten().unwrap_or_default();
        let plan = (faults.bad == 0).then(|| Self::of(parts, settings, limits, wishes));
        Ok((faults, plan))
    }

    fn of(
        parts: Vec<Part>,
        settings: AnimationSettings,
        limits: &Limits,
        wishes: &Wishes,
    ) -> Result<Self, PlanError> {
        let frames: u64 = parts.iter().map(|part| part.frames as u64).sum();
        if let Some(expected) = settings.frames()
            && frames < expected
        {
            return Err(PlanError::TooFew { frames, expected });
        }
        if let Some((&frame, _)) = settings.durations().range(frames + 1..).next() {
            return Err(PlanError::NoFrameToTime { frames, frame });
        }
        let (first, last) = (wishes.frames.0.unwrap_or(1), wishes.frames.1.unwrap_or(frames));
        if let Some(wanted) = [first, last].into_iter().find(|n| *n < 1 || *n > frames) {
            return Err(PlanError::NoSuchFrame { frames, wanted });
        }
        let plan = Self {
            parts,
            limits: *limits,
            size: wishes.size,
            samples: wishes.samples,
            selected: first..=last,
            settings,
            precision: wishes.precision,
            matte: wishes.matte,
            has_passes: wishes.has_passes,
        };
        if plan.size.is_some()
            && let Some((frame, part, _)) = plan.runs().find(|(_, _, shape)| shape.orthographic)
        {
            return Err(PlanError::Orthographic { frame, name: part.file.name.clone() });
        }
        Ok(plan)
    }

    /// Returns whether a frame that is drawn has no background.
    pub(crate) fn has_clear_frames(&self) -> bool {
        self.runs().any(|(_, _, shape)| shape.clear)
    }

    /// Returns the number of frames that are to be drawn.
    pub(crate) fn len(&self) -> u64 {
        self.selected.end() + 1 - self.selected.start()
    }

    /// Returns the number of frames, drawn or not.
    pub(crate) fn total(&self) -> u64 {
        self.parts.iter().map(|part| part.frames as u64).sum()
    }

    /// # Errors
    /// When the frames have several sizes, or one that no GIF can have.
    pub(crate) fn one_size(&self) -> Result<Screen, PlanError> {
        let mut runs = self.runs();
        let (first, first_part, shape) = runs.next().expect("a plan has a frame");
        let first_size = self.size.unwrap_or(shape.screen);
        if first_size.width().max(first_size.height()) > LONGEST_SIDE {
            let name = first_part.file.name.clone();
            return Err(PlanError::TooLong { frame: first, name, size: first_size });
        }
        match runs.find(|(_, _, shape)| self.size.is_none() && shape.screen != first_size) {
            None => Ok(first_size),
            Some((frame, part, shape)) => Err(PlanError::UnlikeSizes {
                first,
                first_name: first_part.file.name.clone(),
                first_size,
                frame,
                name: part.file.name.clone(),
                size: shape.screen,
            }),
        }
    }

    /// Returns the number of frames that may be under way at once.
    pub(crate) fn window(&self) -> usize {
        let bytes = |shape: &Shape| {
            let pixels = self.size.unwrap_or(shape.screen).pixels();
            let of_pixel = if self.has_passes { OF_PIXEL + OF_PASSES } else { OF_PIXEL };
            // The objects, and the structures that find them quickly.
            of_pixel * pixels + 400 * shape.objects as u64
        };
        let largest = self.runs().map(|(_, _, shape)| bytes(shape)).max().unwrap_or(1);
        let most = 4 * rayon::current_num_threads();
        usize::try_from(AHEAD / largest).unwrap_or(most).clamp(FEWEST, most)
    }

    /// The frames to draw, in order.
    pub(crate) fn jobs(&self) -> impl Iterator<Item = Job> + '_ {
        let skip = *self.selected.start() as usize - 1;
        (self.parts.iter().enumerate())
            .flat_map(|(part, p)| (0..p.frames).map(move |index| (part, index)))
            .zip(1..)
            .map(|((part, index), number)| Job { number, part, index })
            .skip(skip)
            .take(self.len() as usize)
    }

    /// Returns the frames to draw, in the order in which an animation shows them. With `bounce` it runs back after the
    /// last frame.
    pub(crate) fn shown(&self) -> impl Iterator<Item = Job> + '_ {
        let back = if self.settings.bounces() {
            let inner = usize::try_from(self.len().saturating_sub(2)).unwrap_or(usize::MAX);
            self.jobs().skip(1).take(inner).collect()
        } else {
            Vec::new()
        };
        self.jobs().chain(back.into_iter().rev())
    }

    /// Returns the number of frames that an animation shows.
    pub(crate) fn shown_count(&self) -> u64 {
        self.settings.shown_count(self.len())
    }

    /// Returns the durations of frames in seconds. Frames are counted from 0 among those that an animation shows.
    ///
    /// # Errors
    /// Cannot fail: the times were checked before.
    pub(crate) fn durations(&self) -> anyhow::Result<BTreeMap<u64, f64>> {
        let selected = self.settings.durations().range(self.selected.clone());
        let own = selected.map(|(frame, seconds)| (frame + 1 - self.selected.start(), *seconds)).collect();
        Ok(self.settings.clone().with_durations(own)?.shown_durations(self.len()))
    }

    /// Returns the scene that a frame is drawn from.
    ///
    /// # Errors
    /// Fails if the script cannot be read again, or if it has an error that it did not have when it was checked.
    pub(crate) fn scene(&self, job: &Job) -> anyhow::Result<Scene> {
        let part = &self.parts[job.part];
        let script = part.script(&self.limits)?;
        let mut scene = script.frame(job.index).ok_or_else(|| part.changed())?;
        if let Some(size) = self.size {
            scene.screen = size;
        }
        if let Some(samples) = self.samples {
            scene.samples = samples;
        }
        Ok(scene)
    }

    /// Returns the origins of the objects of a frame, in their order.
    ///
    /// # Errors
    /// The errors of [`Self::scene`].
    pub(crate) fn origins(&self, job: &Job) -> anyhow::Result<Vec<Origin>> {
        let part = &self.parts[job.part];
        part.script(&self.limits)?.origins(job.index).ok_or_else(|| part.changed())
    }

    /// Returns the text of the script of a frame.
    ///
    /// # Errors
    /// Fails if the script cannot be read again.
    pub(crate) fn text(&self, job: &Job) -> anyhow::Result<Cow<'_, [u8]>> {
        self.parts[job.part].file.read(&self.limits)
    }

    /// Draws a frame with `draw`, which gets the scene in the middle of its exposure and at other moments.
    ///
    /// # Errors
    /// The errors of [`Self::scene`].
    pub(crate) fn expose<T>(&self, job: &Job, draw: impl FnOnce(Exposure) -> T) -> anyhow::Result<T> {
        let scene = self.scene(job)?;
        let script = self.parts[job.part].script(&self.limits)?;
        let after = |frames: f64| Scene {
            screen: scene.screen,
            ..script.frame_after(job.index, frames).unwrap_or_else(|| scene.clone())
        };
        Ok(draw(Exposure::moving(&scene, &after)))
    }

    /// Checks in the first, the middle and the last frame whether their depth cuts off light, and reports the depth
    /// that would show it. Gives up after some seconds, because glass that also mirrors takes very long at great
    /// depths.
    ///
    /// # Errors
    /// The errors of [`Self::scene`], and an error if a signal came.
    pub(crate) fn light_cut_off(&self) -> anyhow::Result<Option<String>> {
        let warning = interrupt::within(LOOKING, |flag| self.light_cut_off_until(flag))?;
        anyhow::ensure!(!interrupt::signalled(), "interrupted");
        Ok(warning)
    }

    fn light_cut_off_until(&self, flag: &AtomicBool) -> anyhow::Result<Option<String>> {
        let last = self.len() - 1;
        let mut looked_at = vec![0, last / 2, last];
        looked_at.dedup();
        let options = RenderOptions { cancel: Some(flag), ..Default::default() };
        for nth in looked_at {
            let Some(job) = self.jobs().nth(nth as usize) else { continue };
            let scene = self.scene(&job)?;
            // A scene that cannot be drawn is an error when it is.
            let Ok(Some(CutLight { share, enough })) = rayfold_tracer::cut_light(&scene, &options) else {
                continue;
            };
            let depth = scene.depth.bounces();
            let advice = match enough {
                Some(enough) => format!("`Depth {enough}` shows all but a thousandth of it"),
                None => format!("`Depth {}`, the greatest, still misses more than a thousandth", Depth::MOST),
            };
            let percent = (share * 100.0).max(0.1);
            let digits = if percent < 10.0 { 1 } else { 0 };
            return Ok(Some(format!(
                "frame {} ({}): `Depth {depth}` cuts off {percent:.digits$} % of the light: what is seen after more mirrors \
                 and glass is black; {advice}",
                job.number,
                self.name(&job),
            )));
        }
        Ok(None)
    }

    /// The name of the frame's script in messages.
    pub(crate) fn name(&self, job: &Job) -> &str {
        &self.parts[job.part].file.name
    }

    /// Returns the runs of selected frames of one shape, each with the number of its first frame.
    fn runs(&self) -> impl Iterator<Item = (u64, &Part, &Shape)> {
        let mut next = 1;
        self.parts.iter().flat_map(|part| part.runs.iter().map(move |run| (part, run))).filter_map(
            move |(part, (count, shape))| {
                let (first, last) = (next, next + *count as u64 - 1);
                next = last + 1;
                let seen = first <= *self.selected.end() && last >= *self.selected.start();
                seen.then(|| (first.max(*self.selected.start()), part, shape))
            },
        )
    }
}

impl Part {
    fn new(file: ScriptFile, script: Script, keep: bool) -> Self {
        let mut runs: Vec<(usize, Shape)> = Vec::new();
        for shot in script.shots() {
            let shape = Shape {
                screen: shot.screen,
                orthographic: shot.is_orthographic,
                clear: shot.is_clear,
                objects: shot.objects.next_power_of_two(),
            };
            match runs.last_mut() {
                Some((count, last)) if *last == shape => *count += shot.frame_count,
                _ => runs.push((shot.frame_count, shape)),
            }
        }
        let frames = script.frame_count();
        // A script from standard input stays in memory anyhow.
        let kept = (keep || file.path().is_none()).then(|| Arc::new(script));
        Self { file, runs, frames, kept, used: Mutex::default() }
    }

    /// Returns the script if it is kept or in use by another frame; otherwise parses it again.
    fn script(&self, limits: &Limits) -> anyhow::Result<Arc<Script>> {
        if let Some(script) = &self.kept {
            return Ok(Arc::clone(script));
        }
        let mut used = self.used.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(script) = used.upgrade() {
            return Ok(script);
        }
        let script = Arc::new(self.file.parse(limits)?.script.ok_or_else(|| self.changed())?);
        *used = Arc::downgrade(&script);
        Ok(script)
    }

    fn changed(&self) -> anyhow::Error {
        anyhow::anyhow!("{} has changed while it was being rendered", self.file.name)
    }
}
