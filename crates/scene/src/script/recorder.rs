//! The recorder: applies commands to the state, and stores the shots.

use super::{
    Drawn, Extent, Group, NamedMaterial, Objects, Script, Sequence, Shot, SkyLine, SourceLines, Template,
    Value, View,
};
use crate::model::{
    Background, Camera, Depth, Fog, FrameNumbers, Indirect, Lens, Light, Object, Samples, Screen, Shutter,
    Tone,
};

/// The state that commands change, and the shots so far.
#[derive(Debug, Default)]
pub(crate) struct Recorder {
    materials: Vec<NamedMaterial>,
    groups: Vec<Group>,
    objects: List<Object, Drawn>,
    surfaces: Surfaces,
    /// The lines of the constant objects and of the others.
    lines: [SourceLines; 2],
    /// The line of the next item, counted from 1; 0 if it comes from no text.
    pub(crate) line: usize,
    lights: List<Light, Template>,
    camera: Value<Camera>,
    background: Value<Background>,
    sky: Option<SkyLine>,
    lens: Value<Lens>,
    fog: Value<Fog>,
    /// The current settings. The screen is passed to each `Trace`.
    pub(crate) samples: Samples,
    pub(crate) shutter: Shutter,
    pub(crate) tone: Tone,
    pub(crate) depth: Depth,
    pub(crate) indirect: Indirect,
    pub(crate) numbers: FrameNumbers,
    views: Vec<View>,
    shots: Vec<Shot>,
}

/// The objects of a group that is being defined.
#[derive(Debug, Default)]
pub(crate) struct GroupRecorder {
    still: Vec<Object>,
    others: Vec<(usize, Drawn)>,
    surfaces: Surfaces,
    /// The lines of the constant objects and of the others.
    lines: [SourceLines; 2],
    /// The line of the next item, counted from 1; 0 if it comes from no text.
    pub(crate) line: usize,
}

/// Runs of constant objects with the same named material.
#[derive(Debug, Default)]
struct Surfaces(Vec<(usize, Option<usize>)>);

impl Surfaces {
    /// Records the material of object `i`, which is the last so far.
    fn add(&mut self, i: usize, surface: Option<usize>) {
        if self.0.last().and_then(|(_, last)| *last) != surface {
            self.0.push((i, surface));
        }
    }

    /// Removes the entries from object `count` on.
    fn truncate(&mut self, count: usize) {
        self.0.truncate(self.0.partition_point(|(from, _)| *from < count));
    }
}

impl GroupRecorder {
    pub(crate) fn add_object(&mut self, object: Object, surface: Option<usize>) {
        self.surfaces.add(self.still.len(), surface);
        self.lines[0].add(self.still.len(), self.line);
        self.still.push(object);
    }

    pub(crate) fn add_drawn(&mut self, drawn: Drawn) {
        self.lines[1].add(self.others.len(), self.line);
        self.others.push((self.still.len(), drawn));
    }

    /// Finishes the group. `drawn` is the largest number of objects that one use of it draws.
    pub(crate) fn finish(self, name: &str, drawn: usize) -> Group {
        let list = Sequence { still: self.still.into(), others: self.others };
        let objects = Objects { list, surfaces: self.surfaces.0, lines: self.lines };
        Group { name: name.into(), objects, drawn }
    }
}

impl Recorder {
    /// Adds the next material. They are numbered from 0.
    pub(crate) fn add_material(&mut self, material: NamedMaterial) {
        self.materials.push(material);
    }

    /// Adds the next group. They are numbered from 0.
    pub(crate) fn add_group(&mut self, group: Group) {
        self.groups.push(group);
    }

    /// Adds an object. `surface` is the number of its material if that is named.
    pub(crate) fn add_object(&mut self, object: Object, surface: Option<usize>) {
        self.surfaces.add(self.objects.still.len(), surface);
        self.lines[0].add(self.objects.still.len(), self.line);
        self.objects.still.push(object);
    }

    pub(crate) fn add_drawn(&mut self, drawn: Drawn) {
        self.lines[1].add(self.objects.others.len(), self.line);
        self.objects.others.push((self.objects.still.len(), drawn));
    }

    pub(crate) fn add_light(&mut self, light: Value<Light>) {
        match light {
            Value::Constant(light) => self.lights.still.push(light),
            Value::Animated(template) => self.lights.others.push((self.lights.still.len(), template)),
        }
    }

    pub(crate) fn set_camera(&mut self, camera: Value<Camera>) {
        set(&mut self.camera, camera);
    }

    pub(crate) fn set_background(&mut self, background: Value<Background>) {
        // None takes away a colour, and no sky.
        if background != Value::Constant(Background::NONE) {
            self.sky = None;
        }
        set(&mut self.background, background);
    }

    pub(crate) fn set_sky(&mut self, sky: SkyLine) {
        if self.background != Value::Constant(Background::NONE) {
            self.background = Value::default();
        }
        set(&mut self.sky, Some(sky));
    }

    pub(crate) fn set_lens(&mut self, lens: Value<Lens>) {
        set(&mut self.lens, lens);
    }

    pub(crate) fn set_fog(&mut self, fog: Value<Fog>) {
        set(&mut self.fog, fog);
    }

    /// Drops everything except the settings of a `Trace`.
    pub(crate) fn forget(&mut self) {
        *self = Self { shutter: self.shutter, numbers: self.numbers, ..Self::default() };
    }

    pub(crate) fn clear(&mut self) {
        self.objects.clear();
        self.surfaces.truncate(self.objects.still.len());
        self.lines[0].truncate(self.objects.still.len());
        self.lines[1].truncate(self.objects.others.len());
        self.lights.clear();
        self.background = Value::default();
        self.sky = None;
    }

    /// Records a `Trace`. `drawn` is the largest number of objects that a frame draws.
    pub(crate) fn trace(&mut self, screen: Screen, drawn: usize) {
        if !self.views.last().is_some_and(|view| self.is_seen_by(view, screen)) {
            self.views.push(View {
                screen,
                camera: self.camera.clone(),
                background: self.background.clone(),
                sky: self.sky.clone(),
                lens: self.lens.clone(),
                fog: self.fog.clone(),
                samples: self.samples,
                shutter: self.shutter,
                tone: self.tone,
                depth: self.depth,
                indirect: self.indirect,
            });
        }
        let (objects, lights) = (self.objects.note(), self.lights.note());
        if let Some(last) = self.shots.last_mut()
            && (last.view, last.numbers) == (self.views.len() - 1, self.numbers)
            && (&last.objects, &last.lights) == (&objects, &lights)
        {
            last.times += 1;
            return;
        }
        let before = self.shots.last().map_or(0, |shot| shot.before.saturating_add(shot.frame_count()));
        self.shots.push(Shot {
            view: self.views.len() - 1,
            objects,
            lights,
            numbers: self.numbers,
            times: 1,
            before,
            drawn,
        });
    }

    /// Returns whether `view` equals the current state, which is the common case.
    fn is_seen_by(&self, view: &View, screen: Screen) -> bool {
        let View {
            screen: size,
            camera,
            background,
            sky,
            lens,
            fog,
            samples,
            shutter,
            tone,
            depth,
            indirect,
        } = view;
        *size == screen
            && *camera == self.camera
            && *background == self.background
            && *sky == self.sky
            && *lens == self.lens
            && *fog == self.fog
            && (*samples, *shutter, *tone) == (self.samples, self.shutter, self.tone)
            && (*depth, *indirect) == (self.depth, self.indirect)
    }

    /// Returns the script, or `None` if there are no frames.
    pub(crate) fn finish(mut self) -> Option<Script> {
        self.clear();
        let Self { materials, groups, objects, surfaces, lines, lights, views, shots, .. } = self;
        let objects = Objects { list: objects.finish(), surfaces: surfaces.0, lines };
        let lights = lights.finish();
        let script = Script { materials, groups, objects, lights, views, shots, is_quick: true }.settled();
        (!script.shots.is_empty()).then_some(script)
    }
}

/// Replaces the value unless it is equal. Equal values stay shared, so that views are compared quickly.
fn set<T: PartialEq>(old: &mut T, new: T) {
    if *old != new {
        *old = new;
    }
}

/// The items of all frames in the order of the script. Those since the last `Clear` are the current ones.
#[derive(Debug)]
struct List<T, M> {
    still: Vec<T>,
    others: Vec<(usize, M)>,
    /// The start of the current items.
    start: (usize, usize),
    /// The end of the items that the shots so far see.
    seen: (usize, usize),
}

impl<T, M> List<T, M> {
    fn note(&mut self) -> Extent {
        self.seen = (self.still.len(), self.others.len());
        Extent { still: self.start.0..self.seen.0, others: self.start.1..self.seen.1 }
    }

    fn clear(&mut self) {
        self.still.truncate(self.seen.0);
        self.others.truncate(self.seen.1);
        self.start = self.seen;
    }

    fn finish(self) -> Sequence<T, M> {
        Sequence { still: self.still.into(), others: self.others }
    }
}

impl<T, M> Default for List<T, M> {
    fn default() -> Self {
        Self { still: Vec::new(), others: Vec::new(), start: (0, 0), seen: (0, 0) }
    }
}
