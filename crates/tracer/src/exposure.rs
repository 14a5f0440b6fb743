//! A frame: a scene and its changes while the shutter is open.

use rayfold_scene::Scene;

use crate::meshes::expanded_count;

/// The number of moments at which a moving scene is drawn, per sample that each pixel has.
const MOMENTS_FOR_A_SAMPLE: u32 = 2;

/// The number of moments per sample with adaptive sampling, where few pixels take as many samples as they may.
const MOMENTS_IF_ADAPTIVE: u32 = 1;

/// The smallest and the largest number of moments.
const MOMENTS: (u32, u32) = (16, 256);

/// The number of samples of a pixel, on average, while a change happens that is short compared with the exposure.
const SAMPLES_OF_A_STEP: f64 = 2.0;

/// The largest number of objects at all moments together. Scenes with more objects have fewer moments, because each
/// moment is prepared and kept in memory.
const OBJECTS: usize = 1 << 22;

/// A scene in the middle of its exposure, and a function that returns it at other moments.
#[derive(Clone, Copy)]
pub struct Exposure<'a> {
    scene: &'a Scene,
    at: Option<&'a (dyn Fn(f64) -> Scene + Sync)>,
}

impl<'a> Exposure<'a> {
    /// Makes the exposure of a scene that does not move, whatever its shutter.
    pub fn still(scene: &'a Scene) -> Self {
        Self { scene, at: None }
    }

    /// Makes the exposure of a moving scene. `at` returns the scene at a time in frames after the middle of its
    /// exposure, from minus half of the shutter's share to plus half. The number of samples per pixel is taken from
    /// `scene` alone.
    pub fn moving(scene: &'a Scene, at: &'a (dyn Fn(f64) -> Scene + Sync)) -> Self {
        Self { scene, at: Some(at) }
    }

    /// Returns the scene in the middle of the exposure.
    pub(crate) fn scene(&self) -> &'a Scene {
        self.scene
    }

    /// Returns the function that gives the scene at other moments, if they matter.
    pub(crate) fn motion(&self) -> Option<&'a (dyn Fn(f64) -> Scene + Sync)> {
        self.at.filter(|_| cfg!(feature = "shutters") && self.is_moving())
    }

    /// Returns whether the scene may differ at other moments that matter.
    pub(crate) fn is_moving(&self) -> bool {
        self.at.is_some() && self.scene.samples.most() > 1 && self.scene.shutter.open() > 0.0
    }

    /// Returns the scene at a share of its exposure, from 0 (the shutter opens) to 1 (it closes).
    pub(crate) fn at(&self, share: f64) -> Scene {
        match self.motion() {
            Some(at) => {
                Scene { samples: self.scene.samples, ..at(self.scene.shutter.open() * (share - 0.5)) }
            }
            None => self.scene.clone(),
        }
    }

    /// Returns the scene at moments that stand for equal parts of the exposure, or the scene alone if nothing moves.
    pub(crate) fn moments(&self) -> Vec<Scene> {
        if self.motion().is_none() {
            return vec![self.scene.clone()];
        }
        let (least, most) = MOMENTS;
        let samples = self.scene.samples;
        let for_a_sample = if samples.error() > 0.0 { MOMENTS_IF_ADAPTIVE } else { MOMENTS_FOR_A_SAMPLE };
        let wanted = samples.most().saturating_mul(for_a_sample).min(most).next_power_of_two();
        let few = (OBJECTS / expanded_count(&self.scene.objects).max(1)).clamp(least as usize, most as usize)
            as u32;
        let wanted = if fewest_samples(self.scene) > 1 { most } else { wanted };
        let count = wanted.clamp(least, most).min(1 << few.ilog2());
        let moments: Vec<Scene> =
            (0..count).map(|k| self.at((f64::from(k) + 0.5) / f64::from(count))).collect();
        if moments.iter().all(|moment| moment == &moments[0]) { moments[..1].to_vec() } else { moments }
    }
}

/// Returns the number of samples that each pixel of a moving scene needs so that some see the shortest change: a power of two,
/// 1 if nothing changes in a small part of the exposure. They need all moments.
pub(crate) fn fewest_samples(scene: &Scene) -> u32 {
    // The conversion saturates.
    let wanted = |step: f64| (SAMPLES_OF_A_STEP * scene.shutter.open() / step).ceil() as u32;
    scene.shortest_step.map_or(1, |step| wanted(step).clamp(1, MOMENTS.1).next_power_of_two())
}
