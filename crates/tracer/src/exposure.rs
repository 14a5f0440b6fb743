//! A frame: a scene, and what becomes of it while the shutter is open.

use rayfold_scene::Scene;

/// The moments at which a scene that moves is drawn, for each sample that all pixels have.
const MOMENTS_FOR_A_SAMPLE: u32 = 2;

/// The same where few pixels have as many as they may.
const MOMENTS_IF_ADAPTIVE: u32 = 1;

/// How many there are at least and at most.
const MOMENTS: (u32, u32) = (16, 256);

/// Objects at all moments together, beyond which there are fewer moments: each is prepared and kept.
const OBJECTS: usize = 1 << 22;

/// A scene in the middle of its exposure, and how to ask for it at other moments.
#[derive(Clone, Copy)]
pub struct Exposure<'a> {
    scene: &'a Scene,
    at: Option<&'a (dyn Fn(f64) -> Scene + Sync)>,
}

impl<'a> Exposure<'a> {
    /// A scene that does not move, whatever its shutter.
    pub fn still(scene: &'a Scene) -> Self {
        Self { scene, at: None }
    }

    /// A scene that moves: `at` says what it is so many frames after the middle of its exposure, from minus a half of its
    /// shutter's share to a half. How many samples a pixel has is said by the scene alone.
    pub fn moving(scene: &'a Scene, at: &'a (dyn Fn(f64) -> Scene + Sync)) -> Self {
        Self { scene, at: Some(at) }
    }

    /// In the middle of the exposure.
    pub(crate) fn scene(&self) -> &'a Scene {
        self.scene
    }

    /// What it is at other moments, if they count.
    pub(crate) fn motion(&self) -> Option<&'a (dyn Fn(f64) -> Scene + Sync)> {
        self.at.filter(|_| cfg!(feature = "shutters") && self.is_moving())
    }

    /// Whether it may be something else at other moments that count.
    pub(crate) fn is_moving(&self) -> bool {
        self.at.is_some() && self.scene.samples.most() > 1 && self.scene.shutter.open() > 0.0
    }

    /// What the scene is at a share of its exposure, from 0 (the shutter opens) to 1 (it closes).
    pub(crate) fn at(&self, share: f64) -> Scene {
        match self.motion() {
            Some(at) => {
                Scene { samples: self.scene.samples, ..at(self.scene.shutter.open() * (share - 0.5)) }
            }
            None => self.scene.clone(),
        }
    }

    /// The scene at moments that stand for equal parts of the exposure; it alone where nothing moves.
    pub(crate) fn moments(&self) -> Vec<Scene> {
        if self.motion().is_none() {
            return vec![self.scene.clone()];
        }
        let (least, most) = MOMENTS;
        let samples = self.scene.samples;
        let for_a_sample = if samples.error() > 0.0 { MOMENTS_IF_ADAPTIVE } else { MOMENTS_FOR_A_SAMPLE };
        let wanted = samples.most().saturating_mul(for_a_sample).min(most).next_power_of_two();
        let few = (OBJECTS / self.scene.objects.len().max(1)).clamp(least as usize, most as usize) as u32;
        let count = wanted.clamp(least, most).min(1 << few.ilog2());
        let moments: Vec<Scene> =
            (0..count).map(|k| self.at((f64::from(k) + 0.5) / f64::from(count))).collect();
        if moments.iter().all(|moment| moment == &moments[0]) { moments[..1].to_vec() } else { moments }
    }
}
