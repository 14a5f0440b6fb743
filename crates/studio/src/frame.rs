//! A frame of a script as the page asks for it again and again: its scene, the lines that it is made of, and where its objects
//! are. Worked out once, and kept as long as the text stays.

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
    /// In the script's size; none where there is nothing to draw.
    pub(crate) scene: Option<Scene>,
    /// The lines that it is made of.
    pub(crate) source_map: SourceMap,
    /// Its number, at which curves are read.
    pub(crate) time: f64,
    boxes: OnceLock<Vec<Bounds>>,
    bounds: OnceLock<Option<Bounds>>,
}

impl Frame {
    /// Frame `frame` of a script, from 0, and of the lines that it is, or was before it had an error.
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

    /// A box around each object of its scene.
    pub(crate) fn boxes(&self) -> &[Bounds] {
        self.boxes.get_or_init(|| self.scene.as_ref().map(boxes).unwrap_or_default())
    }

    /// The box around all that ends; none where nothing does.
    pub(crate) fn bounds(&self) -> Option<Bounds> {
        let whole = || {
            let ends = |bounds: &&Bounds| bounds.low.is_finite() && bounds.high.is_finite();
            self.boxes().iter().filter(ends).copied().reduce(Bounds::with)
        };
        *self.bounds.get_or_init(whole)
    }
}

/// A box around each object of a scene, without end around what has none.
pub(crate) fn boxes(scene: &Scene) -> Vec<Bounds> {
    let endless = Bounds { low: DVec3::NEG_INFINITY, high: DVec3::INFINITY };
    scene.objects.iter().map(|object| extent::bounds([object]).unwrap_or(endless)).collect()
}
