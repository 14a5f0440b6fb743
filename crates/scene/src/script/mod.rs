//! A parsed script: a sequence of frames, each built on request.
//!
//! Frames share their common data. All objects of the script are in one list, in the order of the text. A `Clear`
//! starts a new range of it, each command adds to the range, and a `Trace` records its end in a [`Shot`], which is
//! one frame or many. So a frame is a few numbers, and any frame can be built without replaying the frames before
//! it. Items without curves are stored as they are drawn. Items with curves are stored as lines, and evaluated at
//! each requested moment (`moment`).
//!
//! Invariants: every range is within its list. Items that no frame sees are not stored. No two neighbours in `views`
//! or in `shots` are equal. Materials and groups refer only to earlier ones.

mod moment;
mod of_scene;
mod origins;
mod recorder;
mod source_lines;
mod write;

use std::ops::Range;

use crate::command::Command;
use crate::curve::{Curve, QUICK};
use crate::model::{
    Background, Camera, Clause, Depth, Fog, FrameNumbers, Image, Indirect, InvalidValue, Lens, Light,
    Material, Mesh, Object, PictureFile, Samples, Scene, Screen, Shutter, SkyColors, SkyTurn, Tone,
};
use crate::row::{Number, Row};
use crate::shared_slice::SharedSlice;

pub use origins::Origin;
use origins::Origins;
pub(crate) use recorder::{GroupRecorder, Recorder};
use source_lines::SourceLines;

/// A parsed script, with at least one frame.
///
/// ```
/// let text = b"Screen 4 3\nSphere (1:1 25:3) 0 0 -5 1 0 0 0 0 0\nFrames 50\nTrace\nClear\nFrames 1\nTrace";
/// let script = rayfold_scene::parse("a.txt", text, &Default::default()).script.unwrap();
/// assert_eq!(script.frame_count(), 51);
/// assert_eq!((script.frame_numbers(49), script.frame_numbers(50)), (Some((1, 50)), Some((1, 1))));
/// let rayfold_scene::Object::Sphere(sphere) = &script.frame(12).unwrap().objects[0] else { unreachable!() };
/// assert_eq!(sphere.radius(), 2.0);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Script {
    materials: Vec<NamedMaterial>,
    groups: Vec<Group>,
    objects: Objects,
    lights: Sequence<Light, Template>,
    views: Vec<View>,
    shots: Vec<Shot>,
    /// Whether a curve can have neighbouring keys close to each other.
    is_quick: bool,
}

/// A summary of one `Trace`, or of several consecutive Traces with the same scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShotSummary {
    /// The number of frames.
    pub frame_count: usize,
    /// The size of the images.
    pub screen: Screen,
    /// Whether the camera is `Orthocamera`.
    pub is_orthographic: bool,
    /// Whether there is no background ([`Background::NONE`]).
    pub is_clear: bool,
    /// The largest number of objects that a frame draws.
    pub objects: usize,
}

/// The settings of a frame, without its objects and lights.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct View {
    pub(crate) screen: Screen,
    pub(crate) camera: Value<Camera>,
    pub(crate) background: Value<Background>,
    pub(crate) sky: Option<SkyLine>,
    pub(crate) lens: Value<Lens>,
    pub(crate) fog: Value<Fog>,
    pub(crate) samples: Samples,
    pub(crate) shutter: Shutter,
    pub(crate) tone: Tone,
    pub(crate) depth: Depth,
    pub(crate) indirect: Indirect,
}

/// A value that is the same in all frames, or evaluated for each.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Value<T> {
    Constant(T),
    Animated(Template),
}

/// The sky of a view.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum SkyLine {
    Colors(Value<SkyColors>),
    Picture(PictureFile, Value<SkyTurn>),
}

/// A line that is evaluated at each requested moment.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Template {
    pub(crate) command: Command,
    pub(crate) row: Row,
}

/// The data of one `Trace`, or of several consecutive Traces with the same scene.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Shot {
    view: usize,
    objects: Extent,
    lights: Extent,
    numbers: FrameNumbers,
    /// The number of Traces.
    times: usize,
    /// The number of frames before it.
    before: usize,
    /// The largest number of objects that a frame draws.
    drawn: usize,
}

/// Items in the order of the text: those that are the same in all frames, and the others between them.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Sequence<T, M> {
    still: SharedSlice<T>,
    /// The other items, each with the number of constant items before it.
    others: Vec<(usize, M)>,
}

/// A range of a sequence.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Extent {
    still: Range<usize>,
    others: Range<usize>,
}

/// Objects in the order of the text.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Objects {
    list: Sequence<Object, Drawn>,
    /// The named material of the constant objects from an index on.
    surfaces: Vec<(usize, Option<usize>)>,
    /// The lines of the constant objects and of the others.
    lines: [SourceLines; 2],
}

/// A drawn item that is no constant object.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Drawn {
    /// An object that is evaluated at each moment, with its numbers or a named material.
    Object { template: Template, surface: Option<usize> },
    /// A group that is drawn.
    Use { group: usize, row: Row },
    /// A mesh whose surface is evaluated at each moment: a named material, or numbers.
    Mesh { mesh: Mesh, surface: Option<usize>, row: Row },
}

/// A named material with its clauses.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct NamedMaterial {
    pub(crate) name: Box<str>,
    pub(crate) clauses: Vec<ClauseLine>,
    /// The material, if it has no curves.
    pub(crate) still: Option<Material>,
}

/// A clause as in the script.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ClauseLine {
    pub(crate) clause: Clause,
    pub(crate) row: Row,
    /// The material that a pattern names.
    pub(crate) other: Option<usize>,
    /// The picture of a clause `image`; its width is in the row.
    pub(crate) image: Option<Image>,
}

impl ClauseLine {
    /// Returns whether it is `rough` with anything but the number 0.
    pub(crate) fn is_rough(&self) -> bool {
        self.clause == Clause::Rough && !matches!(self.row.numbers(), [Number::Constant(0.0)])
    }
}

/// A named group with its objects.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Group {
    name: Box<str>,
    objects: Objects,
    /// The largest number of objects that one use of it draws.
    drawn: usize,
}

impl Script {
    /// Returns the number of frames.
    pub fn frame_count(&self) -> usize {
        self.shots.last().map_or(0, |shot| shot.before.saturating_add(shot.frame_count()))
    }

    /// Returns the scene of frame `k`, counted from 0, in the middle of its exposure, or `None` after the last frame.
    /// Copies no object of a frame without motion.
    pub fn frame(&self, k: usize) -> Option<Scene> {
        let (shot, number) = self.shot_of(k)?;
        let mut scene = self.scene(shot, number).ok()?;
        scene.shortest_step = self.shortest_step(k, number, scene.shutter.open());
        Some(scene)
    }

    /// Returns the number of frame `k`, counted from 0, which is the time at which its curves are evaluated.
    pub fn frame_number(&self, k: usize) -> Option<f64> {
        self.shot_of(k).map(|(_, number)| number)
    }

    /// Returns the first and the last number of the frames that share the `Trace` of frame `k`, counted from 0.
    pub fn frame_numbers(&self, k: usize) -> Option<(u32, u32)> {
        self.shot_of(k).map(|(shot, _)| (shot.numbers.first, shot.numbers.last))
    }

    /// Returns the scene of frame `k`, counted from 0, at another moment of its exposure. `time` is within half of
    /// the shutter's share around [`Self::frame_number`]. Returns `None` after the last frame.
    ///
    /// # Errors
    /// Returns the error at that moment. Constraints on several numbers are only known to hold when the shutter opens
    /// and closes and in the middle, so there is no error at these three times.
    pub fn frame_at(&self, k: usize, time: f64) -> Option<Result<Scene, InvalidValue>> {
        let (shot, _) = self.shot_of(k)?;
        Some(self.scene(shot, time).map_err(|faults| faults.0[0]))
    }

    /// Returns frame `k`, counted from 0, at a time in frames after the middle of its exposure (before it, if
    /// negative), within half of the shutter's share. If a constraint on several numbers fails at that moment,
    /// returns the frame in the middle of its exposure. Returns `None` after the last frame.
    pub fn frame_after(&self, k: usize, frames: f64) -> Option<Scene> {
        let (shot, number) = self.shot_of(k)?;
        self.scene(shot, number + frames).or_else(|_| self.scene(shot, number)).ok()
    }

    /// Returns the origins of the objects of [frame](Self::frame) `k`, in their order, or `None` after the last frame.
    ///
    /// ```
    /// let text = b"Screen 4 3\nGroup pair\nSphere 1 0 0 0 1 0 0 0 0 0\nSphere 1 2 0 0 1 0 0 0 0 0\nEnd\n\
    ///     Sphere (1:0 2:1) 0 0 -5 1 0 0 0 0 0\nUse pair 0 0 0\nFrames 2\nTrace";
    /// let script = rayfold_scene::parse("a.txt", text, &Default::default()).script.unwrap();
    /// let origins = script.origins(0).unwrap();
    /// // The first sphere is hidden, but keeps its number.
    /// assert_eq!(origins.iter().map(|origin| origin.number).collect::<Vec<_>>(), [2, 3]);
    /// assert_eq!((&*origins[0].uses, origins[0].line), ([7].as_slice(), 3));
    /// ```
    pub fn origins(&self, k: usize) -> Option<Vec<Origin>> {
        let (shot, number) = self.shot_of(k)?;
        let mut origins = Origins::new(self);
        let tone = self.views[shot.view].tone;
        self.objects_at(&shot.objects, number, tone, Some(&mut origins)).ok()?;
        Some(origins.all)
    }

    /// Returns the scenes of all frames in order. The iterator builds each on request.
    pub fn frames(&self) -> impl DoubleEndedIterator<Item = Scene> + ExactSizeIterator + '_ {
        (0..self.frame_count()).map(|k| {
            let scene = self.frame(k);
            scene.unwrap_or_else(|| unreachable!("frame {k} was found to be in order when it was parsed"))
        })
    }

    /// Returns the summaries of the `Trace` commands in order. Their cost does not depend on the number of frames.
    pub fn shots(&self) -> impl Iterator<Item = ShotSummary> + '_ {
        self.shots.iter().map(|shot| {
            let view = &self.views[shot.view];
            ShotSummary {
                frame_count: shot.frame_count(),
                screen: view.screen,
                is_orthographic: view.camera == Value::Constant(Camera::Orthographic),
                is_clear: view.background == Value::Constant(Background::NONE),
                objects: shot.drawn,
            }
        })
    }

    /// Returns the script of frame `k` alone, counted from 0, or `None` after the last frame. It has the pixels of
    /// that frame, and is written with its curves and its number.
    pub fn only(&self, k: usize) -> Option<Self> {
        let (shot, number) = self.shot_of(k)?;
        let number = number as u32;
        let (objects, lights) = (self.objects.part(&shot.objects), self.lights.part(&shot.lights));
        let shot = Shot {
            view: 0,
            objects: objects.list.whole(),
            lights: lights.whole(),
            numbers: FrameNumbers { first: number, last: number },
            times: 1,
            before: 0,
            drawn: shot.drawn,
        };
        let script = Self {
            materials: self.materials.clone(),
            groups: self.groups.clone(),
            objects,
            lights,
            views: vec![self.views[self.shot_of(k)?.0.view].clone()],
            shots: vec![shot],
            is_quick: self.is_quick,
        };
        Some(script.settled())
    }

    /// Returns the script without the items that it does not use.
    fn settled(mut self) -> Self {
        self.forget_unused();
        let is_quick = self.is_quick && self.rows().flat_map(Row::curves).any(Curve::is_quick);
        Self { is_quick, ..self }
    }

    /// Returns [`Scene::shortest_step`] of frame `k`, which depends on no line that the frame does not use.
    fn shortest_step(&self, k: usize, number: f64, open: f64) -> Option<f64> {
        if !self.is_quick {
            return None;
        }
        let only = self.only(k)?;
        let (from, to) = (number - 0.5 * open, number + 0.5 * open);
        let steps = only.rows().flat_map(Row::curves).filter_map(|curve| curve.shortest_step(from, to));
        steps.filter(|step| *step < QUICK * open).reduce(f64::min)
    }

    /// Returns the numbers of all lines that can have curves.
    fn rows(&self) -> impl Iterator<Item = &Row> {
        let objects = self.groups.iter().map(|group| &group.objects).chain([&self.objects]);
        let views = self.views.iter().flat_map(View::rows);
        let lights = self.lights.others.iter().map(|(_, template)| &template.row);
        let drawn = objects.flat_map(|objects| &objects.list.others).map(|(_, drawn)| drawn.row());
        let clauses = self.materials.iter().flat_map(|material| &material.clauses).map(|line| &line.row);
        views.chain(lights).chain(drawn).chain(clauses)
    }

    /// Returns whether any object is rough, even if it is hidden.
    fn is_rough(&self, extent: &Extent) -> bool {
        let rough: Vec<bool> =
            self.materials.iter().map(|m| m.clauses.iter().any(ClauseLine::is_rough)).collect();
        if !rough.contains(&true) {
            return false;
        }
        let mut groups: Vec<bool> = Vec::with_capacity(self.groups.len());
        for group in &self.groups {
            let is_rough = group.objects.are_rough(&group.objects.list.whole(), &rough, &groups);
            groups.push(is_rough);
        }
        self.objects.are_rough(extent, &rough, &groups)
    }

    /// Returns the shot of frame `k`, and its frame number.
    fn shot_of(&self, k: usize) -> Option<(&Shot, f64)> {
        let shot = &self.shots[self.shots.partition_point(|shot| shot.before <= k).checked_sub(1)?];
        let place = k - shot.before;
        let number = f64::from(shot.numbers.first) + (place % shot.numbers.count() as usize) as f64;
        (place < shot.frame_count()).then_some((shot, number))
    }

    /// Removes materials and groups without references, and renumbers the others.
    fn forget_unused(&mut self) {
        if self.materials.is_empty() && self.groups.is_empty() {
            return;
        }
        let (mut materials, mut groups) = (vec![false; self.materials.len()], vec![false; self.groups.len()]);
        self.objects.refer(&mut materials, &mut groups);
        for (i, group) in self.groups.iter().enumerate().rev() {
            if groups[i] {
                group.objects.refer(&mut materials, &mut groups);
            }
        }
        for (i, material) in self.materials.iter().enumerate().rev() {
            if materials[i] {
                material.clauses.iter().filter_map(|clause| clause.other).for_each(|k| materials[k] = true);
            }
        }
        let (materials, groups) = (renumbered(&materials), renumbered(&groups));
        let mut i = 0..;
        self.materials.retain(|_| i.next().is_some_and(|i: usize| materials[i].is_some()));
        let mut i = 0..;
        self.groups.retain(|_| i.next().is_some_and(|i: usize| groups[i].is_some()));
        let new = |old: &mut usize, numbers: &[Option<usize>]| *old = numbers[*old].unwrap_or(*old);
        for material in &mut self.materials {
            material.clauses.iter_mut().filter_map(|c| c.other.as_mut()).for_each(|k| new(k, &materials));
        }
        let all = self.groups.iter_mut().map(|group| &mut group.objects).chain([&mut self.objects]);
        for objects in all {
            objects.surfaces.iter_mut().filter_map(|(_, k)| k.as_mut()).for_each(|k| new(k, &materials));
            for (_, drawn) in &mut objects.list.others {
                match drawn {
                    Drawn::Object { surface, .. } | Drawn::Mesh { surface, .. } => {
                        surface.iter_mut().for_each(|k| new(k, &materials));
                    }
                    Drawn::Use { group, .. } => new(group, &groups),
                }
            }
        }
    }
}

impl View {
    fn rows(&self) -> impl Iterator<Item = &Row> {
        let sky = self.sky.as_ref().and_then(|sky| match sky {
            SkyLine::Colors(colors) => colors.row(),
            SkyLine::Picture(_, turn) => turn.row(),
        });
        [self.camera.row(), self.background.row(), self.lens.row(), self.fog.row(), sky].into_iter().flatten()
    }
}

impl<T> Value<T> {
    /// Returns the numbers, if they have curves.
    fn row(&self) -> Option<&Row> {
        match self {
            Self::Constant(_) => None,
            Self::Animated(template) => Some(&template.row),
        }
    }
}

impl Drawn {
    fn row(&self) -> &Row {
        match self {
            Self::Object { template, .. } => &template.row,
            Self::Use { row, .. } | Self::Mesh { row, .. } => row,
        }
    }
}

/// Returns the new number of each item that is kept.
fn renumbered(kept: &[bool]) -> Vec<Option<usize>> {
    let mut next = 0..;
    kept.iter().map(|kept| if *kept { next.next() } else { None }).collect()
}

impl Shot {
    fn frame_count(&self) -> usize {
        usize::try_from(self.numbers.count()).unwrap_or(usize::MAX).saturating_mul(self.times)
    }
}

impl<T, M> Sequence<T, M> {
    fn whole(&self) -> Extent {
        Extent { still: 0..self.still.len(), others: 0..self.others.len() }
    }
}

impl<T, M: Clone> Sequence<T, M> {
    fn part(&self, extent: &Extent) -> Self {
        let others = self.others[extent.others.clone()].iter();
        Self {
            still: self.still.part(extent.still.clone()),
            others: others.map(|(before, other)| (before - extent.still.start, other.clone())).collect(),
        }
    }
}

impl<T, M> Default for Sequence<T, M> {
    fn default() -> Self {
        Self { still: SharedSlice::default(), others: Vec::new() }
    }
}

impl Objects {
    fn part(&self, extent: &Extent) -> Self {
        let Range { start, end } = extent.still;
        let mut surfaces: Vec<_> = (self.surfaces.iter())
            .filter(|(from, _)| (start + 1..end).contains(from))
            .map(|(from, surface)| (from - start, *surface))
            .collect();
        if let Some(surface) = self.surface_of(start)
            && start < end
        {
            surfaces.insert(0, (0, Some(surface)));
        }
        let [still, others] = &self.lines;
        let lines = [still.part(extent.still.clone()), others.part(extent.others.clone())];
        Self { list: self.list.part(extent), surfaces, lines }
    }

    /// Returns whether one of these objects is rough. `rough` holds this for each material, and `groups` for each
    /// group.
    fn are_rough(&self, extent: &Extent, rough: &[bool], groups: &[bool]) -> bool {
        let Range { start, end } = extent.still;
        let has = |surface: &Option<usize>| surface.is_some_and(|material| rough[material]);
        start < end && has(&self.surface_of(start))
            || self.surfaces.iter().any(|(from, surface)| (start + 1..end).contains(from) && has(surface))
            || self.list.others[extent.others.clone()].iter().any(|(_, drawn)| match drawn {
                Drawn::Object { surface, .. } | Drawn::Mesh { surface, .. } => has(surface),
                Drawn::Use { group, .. } => groups.get(*group).is_some_and(|is_rough| *is_rough),
            })
    }

    /// Returns the named material of constant object `i`.
    fn surface_of(&self, i: usize) -> Option<usize> {
        let run = self.surfaces.partition_point(|(from, _)| *from <= i).checked_sub(1)?;
        self.surfaces[run].1
    }

    /// Marks the materials and groups that the objects refer to.
    fn refer(&self, materials: &mut [bool], groups: &mut [bool]) {
        self.surfaces.iter().filter_map(|(_, surface)| *surface).for_each(|k| materials[k] = true);
        for (_, drawn) in &self.list.others {
            match drawn {
                Drawn::Object { surface, .. } | Drawn::Mesh { surface, .. } => {
                    surface.iter().for_each(|k| materials[*k] = true);
                }
                Drawn::Use { group, .. } => groups[*group] = true,
            }
        }
    }
}

impl<T: Default> Default for Value<T> {
    fn default() -> Self {
        Self::Constant(T::default())
    }
}
