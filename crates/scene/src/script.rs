//! A script that was understood: a sequence of frames, each made when it is asked for.
//!
//! Frames share what they have in common. All objects of the script lie in one list, in the order of the text; a
//! `Clear` starts a new range of it, each command adds to the range, and a `Trace` notes how far it reaches. So a
//! frame is a handful of numbers, and any frame can be had without replaying those before it.
//!
//! Invariants: every range lies within its list; what no frame sees is not kept; no two neighbours in `views` are equal.

use std::ops::Range;

use crate::model::{Background, Camera, Light, Object, Scene, Screen};
use crate::shared_slice::SharedSlice;

/// The frames of a script, one for each `Trace`, at least one.
///
/// ```
/// let parsed = rayfold_scene::parse("a.txt", b"Screen 4 3\nTrace\nBackground 1 1 1\nTrace", &Default::default());
/// let script = parsed.script.unwrap();
/// assert_eq!(script.frame_count(), 2);
/// assert!(script.frames().all(|scene| scene.screen.width() == 4));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Script {
    objects: SharedSlice<Object>,
    lights: SharedSlice<Light>,
    views: Vec<View>,
    frames: Vec<Frame>,
}

/// What a frame has beside its objects and lights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct View {
    pub(crate) screen: Screen,
    pub(crate) camera: Camera,
    pub(crate) background: Background,
}

/// What a `Trace` sees: an index into the views, ranges of the lists.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Frame {
    pub(crate) view: usize,
    pub(crate) objects: Range<usize>,
    pub(crate) lights: Range<usize>,
}

impl Script {
    /// How many frames there are.
    pub fn frame_count(&self) -> usize {
        self.frames.len()
    }

    /// The scene of frame `k`, counted from 0; `None` beyond the last. Costs the same for any frame and copies no
    /// object.
    pub fn frame(&self, k: usize) -> Option<Scene> {
        self.frames.get(k).map(|frame| self.scene(frame))
    }

    /// The scenes of all frames in order, each made when the iterator comes to it.
    pub fn frames(&self) -> impl DoubleEndedIterator<Item = Scene> + ExactSizeIterator + '_ {
        self.frames.iter().map(|frame| self.scene(frame))
    }

    pub(crate) fn parts(&self) -> impl Iterator<Item = (&View, &Frame)> {
        self.frames.iter().map(|frame| (&self.views[frame.view], frame))
    }

    pub(crate) fn objects(&self) -> &[Object] {
        &self.objects
    }

    pub(crate) fn lights(&self) -> &[Light] {
        &self.lights
    }

    fn scene(&self, frame: &Frame) -> Scene {
        let view = &self.views[frame.view];
        let mut scene = Scene::new(view.screen, view.camera);
        scene.background = view.background;
        scene.objects = self.objects.part(frame.objects.clone());
        scene.lights = self.lights.part(frame.lights.clone());
        scene
    }
}

/// The state that commands change, and the frames noted so far.
#[derive(Debug, Default)]
pub(crate) struct Recorder {
    objects: List<Object>,
    lights: List<Light>,
    camera: Camera,
    background: Background,
    views: Vec<View>,
    frames: Vec<Frame>,
}

impl Recorder {
    pub(crate) fn add_object(&mut self, object: Object) {
        self.objects.items.push(object);
    }

    pub(crate) fn add_light(&mut self, light: Light) {
        self.lights.items.push(light);
    }

    pub(crate) fn set_camera(&mut self, camera: Camera) {
        self.camera = camera;
    }

    pub(crate) fn set_background(&mut self, background: Background) {
        self.background = background;
    }

    pub(crate) fn clear(&mut self) {
        self.objects.clear();
        self.lights.clear();
        self.background = Background::default();
    }

    pub(crate) fn trace(&mut self, screen: Screen) {
        let view = View { screen, camera: self.camera, background: self.background };
        if self.views.last() != Some(&view) {
            self.views.push(view);
        }
        let frame =
            Frame { view: self.views.len() - 1, objects: self.objects.note(), lights: self.lights.note() };
        self.frames.push(frame);
    }

    /// The frames; `None` when there are none.
    pub(crate) fn finish(mut self) -> Option<Script> {
        self.objects.clear();
        self.lights.clear();
        let Self { objects, lights, views, frames, .. } = self;
        let script = Script { objects: objects.items.into(), lights: lights.items.into(), views, frames };
        (!script.frames.is_empty()).then_some(script)
    }
}

/// The items of all frames in the order of the script; those since the last `Clear` are the current ones.
#[derive(Debug)]
struct List<T> {
    items: Vec<T>,
    /// Where the current ones start.
    start: usize,
    /// How far the frames noted so far see.
    seen: usize,
}

impl<T> List<T> {
    fn note(&mut self) -> Range<usize> {
        self.seen = self.items.len();
        self.start..self.seen
    }

    fn clear(&mut self) {
        self.items.truncate(self.seen);
        self.start = self.seen;
    }
}

impl<T> Default for List<T> {
    fn default() -> Self {
        Self { items: Vec::new(), start: 0, seen: 0 }
    }
}
