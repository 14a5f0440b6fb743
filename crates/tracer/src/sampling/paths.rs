//! Paths of light: the directions in which rays go on from a surface, and the choice of rays that are followed.
//!
//! In scenes in which surfaces light each other, a hit can send on several rays, and no ray is dropped because its
//! factor is small. A ray with a small factor is followed with a chance in proportion to it, and counts for more then.
//! So the expectation is exact, and the number of rays of a sample is bounded.

use glam::DVec3;

use super::places::on_disc;
use super::{Dimensions, independent};

/// The ways in which a ray goes on from a hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Way {
    Mirrored,
    Refracted,
    /// In a random direction, from a surface that scatters light.
    Scattered,
}

impl Way {
    /// The number of ways.
    pub(crate) const COUNT: usize = 3;

    /// Returns the factor below which a ray is followed only with a chance. It is a power of two.
    const fn enough(self) -> f64 {
        match self {
            Self::Mirrored | Self::Refracted => 1.0 / 32.0,
            Self::Scattered => 1.0 / 8.0,
        }
    }

    /// Returns the chance with which a ray of this factor is followed: 0 for a factor of 0, at most 1.
    #[inline(always)]
    pub(crate) fn chance(self, weight: DVec3) -> f64 {
        (weight.abs().max_element() / self.enough()).min(1.0)
    }
}

/// Returns the first of the two dimensions of the direction in which a path continues after `hits` hits.
#[inline(always)]
pub(crate) fn direction_dimension(dimensions: &Dimensions, hits: u32) -> usize {
    dimensions.count + 2 * hits as usize
}

/// Returns the number from 0 to 1 that decides whether a path continues in this way after `hits` hits.
#[inline(always)]
pub(crate) fn choice(pixel_seed: u32, sample: u32, hits: u32, way: Way) -> f64 {
    independent(pixel_seed, sample, choice_dimension(hits, way))
}

/// Returns the dimension of that number, beyond those of all directions.
#[inline(always)]
pub(crate) const fn choice_dimension(hits: u32, way: Way) -> usize {
    0x2000 + Way::COUNT * hits as usize + way as usize
}

/// Returns a unit vector on the side of `normal`, with a density in proportion to the cosine of the angle between them.
/// `u` and `v` are its random numbers, from 0 to 1. A vector below the `face` is mirrored to above it.
#[inline(always)]
pub(crate) fn scattered((u, v): (f64, f64), normal: DVec3, face: DVec3) -> DVec3 {
    let at = on_disc(u, v);
    let height = (1.0 - at.length_squared()).max(0.0).sqrt();
    // Without a sign of zeros, on which the pair depends.
    let (x, y) = (normal + DVec3::ZERO).any_orthonormal_pair();
    let direction = at.x * x + at.y * y + height * normal;
    let below = direction.dot(face).min(0.0);
    (direction - 2.0 * below * face).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scattered_rays_have_the_density_of_the_cosine() {
        let mut dice = fastrand::Rng::with_seed(5);
        let normal = DVec3::new(0.3, -0.5, 0.7).normalize();
        let (mut sum, mut squares) = (DVec3::ZERO, 0.0);
        let count = 200_000;
        for _ in 0..count {
            let direction = scattered((dice.f64(), dice.f64()), normal, normal);
            assert!((direction.length() - 1.0).abs() < 1e-14 && direction.dot(normal) >= 0.0);
            sum += direction;
            squares += direction.dot(normal).powi(2);
        }
        // The means of cos and cos² under cos/π are 2/3 and 1/2.
        assert!((sum / f64::from(count) - normal * 2.0 / 3.0).length() < 0.005);
        assert!((squares / f64::from(count) - 0.5).abs() < 0.003);
    }

    #[test]
    fn no_scattered_ray_is_below_its_face() {
        let mut dice = fastrand::Rng::with_seed(6);
        let (normal, face) = (DVec3::new(0.9, 0.1, 0.0).normalize(), DVec3::Y);
        for _ in 0..10_000 {
            assert!(scattered((dice.f64(), dice.f64()), normal, face).dot(face) >= 0.0);
        }
    }

    #[test]
    fn a_ray_counts_on_average_for_its_factor() {
        for weight in [0.0, 0.001, 0.02, 0.1, 1.0, 3.0] {
            for way in [Way::Mirrored, Way::Refracted, Way::Scattered] {
                let chance = way.chance(DVec3::new(weight, 0.0, -0.5 * weight));
                let count = 40_000;
                let followed = (0..count).filter(|&sample| choice(77, sample, 3, way) < chance).count();
                let mean = followed as f64 / f64::from(count);
                assert!((mean - chance).abs() < 0.01, "{weight} {way:?}: {mean} {chance}");
            }
        }
    }
}
