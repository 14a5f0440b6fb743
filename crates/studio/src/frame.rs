//! A frame of a script, as the page requests it repeatedly: its scene, its lines, and the bounds of its objects.
//! Computed once, and kept as long as the text does not change.

use std::sync::OnceLock;

use glam::DVec3;
use rayfold_scene::{Scene, Script};

use crate::extent;
use crate::line::Line;
use crate::source_map::SourceMap;
use crate::view::Bounds;

/// A frame of a script.
#[derive(Debug)]
pub(crate) struct Frame {
    /// The scene in the script's size; `None` if there is nothing to draw.
    pub(crate) scene: Option<Scene>,
    /// The lines of the frame.
    pub(crate) source_map: SourceMap,
    /// The frame number, at which curves are evaluated.
    pub(crate) time: f64,
    boxes: OnceLock<Vec<Bounds>>,
    bounds: OnceLock<Option<Bounds>>,
}

impl Frame {
    /// Makes frame `frame` of a script, counted from 0. `lines` are those of the script, or newer ones with an error.
    pub(crate) fn new(script: Option<&Script>, lines: &[Line], frame: usize) -> Self {
        let time = script.and_then(|script| script.frame_number(frame)).unwrap_or(1.0);
        Self {
            scene: script.and_then(|script| script.frame(frame)),
            source_map: SourceMap::of(lines, frame, time),
            time,
            boxes: OnceLock::new(),
            bounds: OnceLock::new(),
        }
    }

    /// Returns a box around each object of the scene.
    pub(crate) fn boxes(&self) -> &[Bounds] {
        self.boxes.get_or_init(|| self.scene.as_ref().map(boxes).unwrap_or_default())
    }

    /// Returns the box around all bounded objects, or `None` without any.
    pub(crate) fn bounds(&self) -> Option<Bounds> {
        let whole = || {
            let ends = |bounds: &&Bounds| bounds.low.is_finite() && bounds.high.is_finite();
            self.boxes().iter().filter(ends).copied().reduce(Bounds::with)
        };
        *self.bounds.get_or_init(whole)
    }
}

/// Returns a box around each object of a scene. The box of an unbounded object is infinite.
pub(crate) fn boxes(scene: &Scene) -> Vec<Bounds> {
    let endless = Bounds { low: DVec3::NEG_INFINITY, high: DVec3::INFINITY };
    scene.objects.iter().map(|object| extent::bounds([object]).unwrap_or(endless)).collect()
}
