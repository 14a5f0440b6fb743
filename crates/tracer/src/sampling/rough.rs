//! Rough mirrors and rough glass: microfacets of isotropic GGX, as the language defines them.
//!
//! The normals of microfacets are drawn from those that are visible (Heitz, "Sampling the GGX Distribution of Visible Normals",
//! 2018). `E`, the share of light that microfacets do not hide, is integrated when a scene is prepared, once for each width.

use std::collections::HashMap;
use std::sync::Arc;

use glam::DVec3;
use rayfold_scene::{Object, Scene};
use rayon::prelude::*;

use super::places::on_disc;

/// The number of steps of a table of `E`.
const STEPS: usize = 32;

/// The points at which `E` is integrated: of the radius of a disc, and of half a turn.
const RADII: usize = 128;
const TURNS: usize = 48;

/// The share of light that microfacets of a width do not hide, by the cosine of the view.
#[derive(Debug)]
pub(crate) struct Energy {
    /// The table is indexed by `(1 + α)·c/(c + α)` of a cosine c, because it changes most at cosines around α.
    table: [f64; STEPS + 1],
}

/// The microfacets of all widths of some scenes.
#[derive(Clone, Debug, Default)]
pub(crate) struct Energies(Arc<HashMap<u64, Arc<Energy>>>);

/// The microfacets of a surface.
#[derive(Clone, Debug)]
pub(crate) struct Microfacets {
    /// The width, above 0.
    alpha: f64,
    energy: Arc<Energy>,
}

impl Energies {
    /// Integrates `E` for the rough objects of the same scene at its moments, where light goes round.
    pub(crate) fn of(moments: &[Scene]) -> Self {
        let widths = moments.iter().filter(|scene| scene.goes_round()).flat_map(|scene| scene.objects.iter());
        let mut bits: Vec<u64> = widths.map(alpha).filter(|alpha| *alpha > 0.0).map(f64::to_bits).collect();
        bits.sort_unstable();
        bits.dedup();
        let energy = |bits: u64| (bits, Arc::new(Energy::new(f64::from_bits(bits))));
        Self(Arc::new(bits.into_par_iter().map(energy).collect()))
    }

    /// Returns the microfacets of an object, unless it is smooth.
    pub(crate) fn microfacets(&self, object: &Object) -> Option<Microfacets> {
        let alpha = alpha(object);
        let energy = self.0.get(&alpha.to_bits()).filter(|_| alpha > 0.0)?;
        Some(Microfacets { alpha, energy: energy.clone() })
    }
}

/// Returns the width of an object's microfacets, or 0.
fn alpha(object: &Object) -> f64 {
    let rough = object.material().finish().and_then(|finish| finish.rough);
    rough.map_or(0.0, |rough| rough.alpha())
}

impl Energy {
    fn new(alpha: f64) -> Self {
        let at = |step: usize| {
            let x = step as f64 / STEPS as f64;
            integrated(alpha, (alpha * x / (1.0 + alpha - x)).max(1e-9))
        };
        Self { table: core::array::from_fn(at) }
    }

    fn at(&self, alpha: f64, cosine: f64) -> f64 {
        let x = ((1.0 + alpha) * cosine / (cosine + alpha)).clamp(0.0, 1.0) * STEPS as f64;
        let step = (x as usize).min(STEPS - 1);
        let part = x - step as f64;
        (1.0 - part) * self.table[step] + part * self.table[step + 1]
    }
}

/// Returns the mean of G1 of the mirrored direction, 0 where that is below the surface, over the visible normals. They are a
/// disc's points, whose radius is the sine of an angle here: so the steps are fine at the rim, where GGX has its tail.
fn integrated(alpha: f64, cosine: f64) -> f64 {
    let view = DVec3::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
    let (mut sum, mut weights) = (0.0, 0.0);
    for radius in 0..RADII {
        let angle = (radius as f64 + 0.5) / RADII as f64 * core::f64::consts::FRAC_PI_2;
        let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
        let weight = sine * cosine;
        for turn in 0..TURNS {
            let turn = ((turn as f64 + 0.5) / TURNS as f64 - 0.5) * core::f64::consts::PI;
            let normal = visible(alpha, view, (sine * libm::cos(turn), sine * libm::sin(turn)));
            let towards = 2.0 * normal.dot(view) * normal - view;
            sum += weight * masking(alpha, towards.z);
        }
        weights += weight * TURNS as f64;
    }
    sum / weights
}

/// Returns Smith's masking G1 of GGX for a direction by the cosine to the normal; 0 for one below the surface.
#[inline(always)]
fn masking(alpha: f64, cosine: f64) -> f64 {
    if cosine <= 0.0 {
        return 0.0;
    }
    let squared = cosine * cosine;
    2.0 / (1.0 + (1.0 + alpha * alpha * (1.0 - squared).max(0.0) / squared).sqrt())
}

/// Returns the visible normal for a point of the unit disc, in coordinates in which z is the normal of the surface.
#[inline(always)]
fn visible(alpha: f64, view: DVec3, (across, along): (f64, f64)) -> DVec3 {
    let view = DVec3::new(alpha * view.x, alpha * view.y, view.z).normalize();
    let squared = view.x * view.x + view.y * view.y;
    let x = if squared > 0.0 { DVec3::new(-view.y, view.x, 0.0) / squared.sqrt() } else { DVec3::X };
    let y = view.cross(x);
    let half = 0.5 * (1.0 + view.z);
    let along = (1.0 - half) * (1.0 - across * across).max(0.0).sqrt() + half * along;
    let up = (1.0 - across * across - along * along).max(0.0).sqrt();
    let normal = across * x + along * y + up * view;
    DVec3::new(alpha * normal.x, alpha * normal.y, normal.z.max(0.0)).normalize()
}

impl Microfacets {
    /// Returns G1 of a direction by the cosine to the normal; 0 for one below the surface.
    #[inline(always)]
    pub(crate) fn masking(&self, cosine: f64) -> f64 {
        masking(self.alpha, cosine)
    }

    /// Returns the share of light that is not hidden, by the cosine of the view.
    #[inline(always)]
    pub(crate) fn energy(&self, cosine: f64) -> f64 {
        self.energy.at(self.alpha, cosine.max(0.0))
    }

    /// Returns the normal of a visible microfacet of a surface with this normal. `view` points back along the ray. `u` and `v`
    /// are random numbers from 0 to 1.
    #[inline(always)]
    pub(crate) fn normal(&self, view: DVec3, normal: DVec3, (u, v): (f64, f64)) -> DVec3 {
        // Without a sign of zeros, on which the pair depends.
        let (x, y) = (normal + DVec3::ZERO).any_orthonormal_pair();
        let local = DVec3::new(view.dot(x), view.dot(y), view.dot(normal).max(0.0));
        let at = on_disc(u, v);
        let facet = visible(self.alpha, local, (at.x, at.y));
        (facet.x * x + facet.y * y + facet.z * normal).normalize()
    }

    /// Returns the factor of a light's colour times `mirror` in the highlight that it makes: π·D·G1(v)·G1(l)/(4·(n·v)·E). `view`
    /// points back along the ray, `towards` to the light, above the surface.
    #[inline(always)]
    pub(crate) fn highlight(&self, normal: DVec3, view: DVec3, towards: DVec3) -> f64 {
        let (seen, lit) = (normal.dot(view), normal.dot(towards));
        if seen <= 0.0 || lit <= 0.0 {
            return 0.0;
        }
        let halfway = (view + towards).normalize();
        let squared = self.alpha * self.alpha;
        let cosine = normal.dot(halfway);
        // 1 + cos²·(α² - 1), from the sine, which is more accurate where the highlight is.
        let below = normal.cross(halfway).length_squared() + squared * cosine * cosine;
        let density = squared / (below * below);
        density * self.masking(seen) * self.masking(lit) / (4.0 * seen * self.energy(seen))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_energy_is_the_mean_of_what_microfacets_do_not_hide() {
        // Means over a fine grid of other points: polar, and even in the squared radius.
        for alpha in [1.0 / 1024.0, 0.01, 0.05, 0.1, 0.3, 0.6, 1.0] {
            let energy = Energy::new(alpha);
            for cosine in [1e-3, 0.01, 0.03, 0.1, 0.3, 0.5, 0.77, 0.93, 1.0] {
                let view = DVec3::new((1.0f64 - cosine * cosine).sqrt(), 0.0, cosine);
                let (count, mut sum) = (700, 0.0);
                for k in 0..count * count {
                    let part = |k: u32| (f64::from(k) + 0.5) / f64::from(count);
                    let (radius, turn) = (part(k % count).sqrt(), part(k / count) * core::f64::consts::TAU);
                    let normal = visible(alpha, view, (radius * libm::cos(turn), radius * libm::sin(turn)));
                    sum += masking(alpha, (2.0 * normal.dot(view) * normal - view).z);
                }
                let mean = sum / f64::from(count * count);
                let apart = energy.at(alpha, cosine) - mean;
                assert!(apart.abs() < 1.0 / 1024.0, "{alpha} {cosine}: {apart}");
            }
        }
    }

    #[test]
    fn visible_normals_have_the_density_of_ggx() {
        // Seen from above, that of a normal is D·cos; of the share with a cosine above c it is (1 - c²)/(1 - c²·(1 - α²)).
        let facets = Microfacets { alpha: 0.4, energy: Arc::new(Energy { table: [1.0; STEPS + 1] }) };
        let mut dice = fastrand::Rng::with_seed(8);
        let normal = DVec3::new(0.2, 0.5, -0.4).normalize();
        let (count, mut above) = (100_000, [0; 3]);
        let limits = [0.95, 0.8, 0.5];
        for _ in 0..count {
            let facet = facets.normal(normal, normal, (dice.f64(), dice.f64()));
            for (above, limit) in above.iter_mut().zip(limits) {
                *above += u32::from(facet.dot(normal) > limit);
            }
        }
        for (above, limit) in above.into_iter().zip(limits) {
            let share = f64::from(above) / f64::from(count);
            let squared = limit * limit;
            let exact = (1.0 - squared) / (1.0 - squared * (1.0 - 0.4 * 0.4));
            assert!((share - exact).abs() < 0.006, "{limit}: {share} {exact}");
        }
    }
}
