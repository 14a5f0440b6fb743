//! Maps from numbers in a cube to places. All of them map equal volumes to equal areas or volumes.

use glam::{DVec2, DVec3};

/// Returns a point of the disc of radius 1, by the map of Shirley and Chiu (1997), which keeps squares compact.
///
/// Both numbers are between 0 and 1, and not both in the middle.
#[inline(always)]
pub(crate) fn on_disc(u: f64, v: f64) -> DVec2 {
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    let is_wide = a.abs() > b.abs();
    // One division for both cases, so that many points are worked out in packets.
    let (radius, other) = if is_wide { (a, b) } else { (b, a) };
    let angle = core::f64::consts::FRAC_PI_4 * (other / radius);
    let (sine, cosine) = (radius * sine(angle), radius * cosine(angle));
    if is_wide { DVec2::new(cosine, sine) } else { DVec2::new(sine, cosine) }
}

/// Returns a unit vector in a cone around z, uniform in its solid angle. `spread` is 1 - cos of the cone's half angle,
/// at most 2.
#[inline(always)]
pub(crate) fn in_cone(u: f64, v: f64, spread: f64) -> DVec3 {
    let disc = on_disc(u, v);
    // 1 - z of equal areas is uniform, as the square of a disc's radius is.
    let depth = spread * disc.length_squared();
    let across = (spread * (2.0 - depth)).max(0.0).sqrt();
    DVec3::new(disc.x * across, disc.y * across, 1.0 - depth)
}

/// Returns a point of the ball of radius 1.
#[inline(always)]
pub(crate) fn in_ball(u: f64, v: f64, w: f64) -> DVec3 {
    in_cone(u, v, 2.0) * cube_root(w)
}

/// Returns 1 - cos of half an angle in degrees.
pub(crate) fn spread(degrees: f64) -> f64 {
    let sine = libm::sin(degrees.to_radians() / 4.0);
    2.0 * sine * sine
}

/// Returns the sine of an angle of up to 45 degrees, with an error of at most 1e-11, by Taylor's series.
#[inline(always)]
fn sine(x: f64) -> f64 {
    let s = x * x;
    let tail = -1.0 / 5040.0 + s * (1.0 / 362_880.0 + s * (-1.0 / 39_916_800.0));
    x * (1.0 + s * (-1.0 / 6.0 + s * (1.0 / 120.0 + s * tail)))
}

#[inline(always)]
fn cosine(x: f64) -> f64 {
    let s = x * x;
    let tail = 1.0 / 40_320.0 + s * (-1.0 / 3_628_800.0 + s * (1.0 / 479_001_600.0));
    1.0 + s * (-0.5 + s * (1.0 / 24.0 + s * (-1.0 / 720.0 + s * tail)))
}

/// Returns the cube root of a number above 0 and below 1, with a relative error of at most 1e-15: an estimate from its
/// exponent, and three steps of Halley's method.
#[inline(always)]
fn cube_root(x: f64) -> f64 {
    let mut root = f64::from_bits(x.to_bits() / 3 + (0x3ff << 52) / 3 * 2);
    let mut step = 0;
    while step < 3 {
        let cube = root * root * root;
        root *= (cube + 2.0 * x) / (2.0 * cube + x);
        step += 1;
    }
    root
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dice() -> fastrand::Rng {
        fastrand::Rng::with_seed(11)
    }

    #[test]
    fn series_and_steps_are_exact_enough() {
        let mut dice = dice();
        for _ in 0..100_000 {
            let angle = core::f64::consts::FRAC_PI_4 * (2.0 * dice.f64() - 1.0);
            assert!((sine(angle) - libm::sin(angle)).abs() < 1e-11, "{angle}");
            assert!((cosine(angle) - libm::cos(angle)).abs() < 1e-12, "{angle}");
            let x = dice.f64().powi(4) + 1e-11;
            assert!((cube_root(x) / libm::cbrt(x) - 1.0).abs() < 4e-15, "{x}");
        }
    }

    /// Returns the difference of chi-squared of the counts of equal cells from its mean, in standard deviations.
    fn unevenness(cells: usize, cell: impl Fn(&mut fastrand::Rng) -> usize) -> f64 {
        let (mut counts, mut dice) = (vec![0u32; cells], dice());
        let mean = 1000.0;
        for _ in 0..cells * 1000 {
            counts[cell(&mut dice)] += 1;
        }
        let chi_squared: f64 = counts.iter().map(|&c| (f64::from(c) - mean).powi(2) / mean).sum();
        (chi_squared - cells as f64) / (2.0 * cells as f64).sqrt()
    }

    fn part(x: f64, of: usize) -> usize {
        ((x * of as f64) as usize).min(of - 1)
    }

    fn turn(x: f64, y: f64) -> f64 {
        libm::atan2(y, x) / core::f64::consts::TAU + 0.5
    }

    #[test]
    fn discs_cones_and_balls_are_filled_evenly() {
        let disc = unevenness(64, |dice| {
            let p = on_disc(dice.f64(), dice.f64());
            8 * part(p.length_squared(), 8) + part(turn(p.x, p.y), 8)
        });
        assert!(disc.abs() < 4.0, "{disc}");
        for degrees in [0.01, 5.0, 90.0, 179.0] {
            let spread = spread(degrees);
            let cone = unevenness(64, |dice| {
                let p = in_cone(dice.f64(), dice.f64(), spread);
                assert!((p.length() - 1.0).abs() < 1e-14);
                // From the sine where the cosine says little.
                let depth = (p.x * p.x + p.y * p.y) / (1.0 + p.z) / spread;
                8 * part(depth, 8) + part(turn(p.x, p.y), 8)
            });
            assert!(cone.abs() < 4.0, "{degrees}: {cone}");
        }
        let ball = unevenness(512, |dice| {
            let p = in_ball(dice.f64(), dice.f64(), dice.f64());
            let radius = p.length();
            64 * part(radius.powi(3), 8) + 8 * part(0.5 + 0.5 * p.z / radius, 8) + part(turn(p.x, p.y), 8)
        });
        assert!(ball.abs() < 4.0, "{ball}");
    }

    #[test]
    fn a_cone_of_no_angle_is_its_axis_and_of_all_a_hemisphere() {
        assert_eq!(in_cone(0.3, 0.9, 0.0), DVec3::Z);
        assert!((spread(180.0) - 1.0).abs() < 1e-15);
        assert!((spread(1e-6) / (0.5 * 0.5e-6f64.to_radians().powi(2)) - 1.0).abs() < 1e-9);
    }
}
