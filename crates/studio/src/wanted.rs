//! Requests for pictures, which the session makes and the painter draws.

use std::sync::Arc;

use rayfold_scene::model::Indirect;
use rayfold_scene::{Camera, Scene, Screen, Script};

use crate::project::Place;
use crate::view::Orbit;

/// The largest number of pixels of a picture.
pub(crate) const PIXELS: u64 = 8 << 20;

/// A request for a picture.
#[derive(Clone, Debug)]
pub(crate) struct Wanted {
    /// The scene to draw. Its screen is the size of the picture.
    pub(crate) scene: Scene,
    /// The motion of the scene while its shutter is open.
    pub(crate) motion: Option<Motion>,
    /// Something is being dragged, so speed matters more than quality.
    pub(crate) moving: bool,
    /// The number by which the page knows the picture.
    pub(crate) number: u32,
    /// The frame of the scene.
    pub(crate) place: Place,
    /// The view that made the frame the scene.
    pub(crate) view: ViewSettings,
}

/// The view of the viewport: with it, a frame of a script is the scene of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ViewSettings {
    /// The size of the viewport in pixels.
    pub(crate) size: (u32, u32),
    /// The free camera, if it is in use.
    pub(crate) free: Option<Orbit>,
    /// Indirect light is left out.
    pub(crate) is_draft: bool,
}

impl ViewSettings {
    /// Returns the scene of a frame in this view, or `None` if there is no picture of it.
    pub(crate) fn of(&self, mut scene: Scene) -> Option<Scene> {
        if self.is_draft {
            scene.indirect = Indirect::default();
        }
        let (width, height) = (f64::from(self.size.0), f64::from(self.size.1));
        match (&self.free, &scene.camera) {
            (Some(orbit), _) => {
                scene.screen = fitted(width, height)?;
                scene.camera = Camera::Pinhole(orbit.camera(width / height).ok()?);
            }
            // Its pixels are world units.
            (None, Camera::Orthographic) => {}
            (None, _) => {
                let (columns, rows) = (f64::from(scene.screen.width()), f64::from(scene.screen.height()));
                let scale = (width / columns).min(height / rows);
                scene.screen = fitted(columns * scale, rows * scale)?;
            }
        }
        Some(scene)
    }
}

/// A frame of a script that can be evaluated at other moments.
#[derive(Clone, Debug)]
pub(crate) struct Motion {
    /// The script of the frame.
    pub(crate) script: Arc<Script>,
    /// The index of the frame, from 0.
    pub(crate) frame: usize,
    /// The view is that of the free camera, which does not move.
    pub(crate) is_free: bool,
}

impl Wanted {
    /// Returns whether the same picture is requested, at the same quality.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        let is_same_motion = match (&self.motion, &other.motion) {
            (Some(own), Some(other)) => own.is_same(other),
            (own, other) => own.is_none() && other.is_none(),
        };
        self.moving == other.moving && is_same_motion && self.scene == other.scene
    }
}

impl Motion {
    fn is_same(&self, other: &Self) -> bool {
        let of = |motion: &Self| (motion.frame, motion.is_free);
        Arc::ptr_eq(&self.script, &other.script) && of(self) == of(other)
    }

    /// Returns the scene this many frames after the frame.
    pub(crate) fn after(&self, scene: &Scene, frames: f64) -> Scene {
        let Some(then) = self.script.frame_after(self.frame, frames) else { return scene.clone() };
        let camera = if self.is_free { scene.camera } else { then.camera };
        Scene { screen: scene.screen, camera, indirect: scene.indirect, ..then }
    }
}

/// Returns a screen of this size, or a smaller one if it would be too large.
fn fitted(width: f64, height: f64) -> Option<Screen> {
    let scale = (PIXELS as f64 / (width * height)).sqrt().min(1.0);
    let side = |side: f64| (side * scale).round().max(1.0) as u32;
    Screen::new(side(width), side(height)).ok()
}
