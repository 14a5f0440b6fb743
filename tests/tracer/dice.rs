//! Random numbers, positions and materials for scenes, from a seed that is printed.

use glam::DVec3;
use rayfold_scene::Material;

/// A generator with the seed `RAYFOLD_SEED`, or with the test's own seed.
pub(crate) struct Dice(pub(crate) fastrand::Rng);

impl Dice {
    pub(crate) fn new(test: &str, own: u64) -> Self {
        let seed = std::env::var("RAYFOLD_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(own);
        println!("{test}: RAYFOLD_SEED={seed}");
        Self(fastrand::Rng::with_seed(seed))
    }

    pub(crate) fn within(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * self.0.f64()
    }

    pub(crate) fn point(&mut self, size: f64) -> DVec3 {
        DVec3::new(self.within(-size, size), self.within(-size, size), self.within(-size, size))
    }

    pub(crate) fn color(&mut self) -> DVec3 {
        self.point(0.5) + 0.5
    }

    pub(crate) fn material(&mut self) -> Material {
        let mirror = if self.0.bool() { 0.6 * self.color() } else { DVec3::ZERO };
        Material::new(0.1 * self.color(), self.color(), mirror).unwrap()
    }
}
