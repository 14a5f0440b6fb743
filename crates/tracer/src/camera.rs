//! The ray of each pixel.
//!
//! Only this module knows how the language numbers its pixels: i from the left, j from the bottom, the outermost
//! samples on the window's corners. The reference tracer, the packets, and callers who ask for the ray of a pixel all
//! use it. A position between two pixels is a fraction: column `i + dx` and row `j + dy` have a ray like any other.

use glam::{DVec2, DVec3};
use rayfold_scene::model::unit;
use rayfold_scene::{Camera, Look, Scene, Screen};

use crate::scale::below_inverse;

/// A ray: a half-line whose direction is a unit vector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ray {
    pub(crate) origin: DVec3,
    pub(crate) direction: DVec3,
}

/// The positions of an image's samples along one of its axes.
///
/// They are computed relative to the sample nearest to zero, or to the midpoint between two. So a ray straight ahead is
/// exact, and rounding errors are proportional to the coordinate itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Axis {
    /// The index from which the others are counted: a whole number, or halfway between two.
    pub(crate) anchor: f64,
    /// The coordinate of the anchor.
    pub(crate) at_anchor: f64,
    /// The distance from one sample to the next; 0 if there is only one and its pixel is a point.
    pub(crate) step: f64,
    /// The rounding error of the step: the exact step is `step + rest`.
    pub(crate) rest: f64,
}

impl Axis {
    /// Returns the axis whose samples are at `start + index · step`.
    pub(crate) fn along(start: f64, step: f64) -> Self {
        Self { anchor: 0.0, at_anchor: start, step, rest: 0.0 }
    }

    /// Returns the axis that runs from the first of `pixels` pixels to the last. A single one is in the middle.
    fn between(from: f64, to: f64, pixels: u32, single: Single) -> Self {
        // A window may be so small, for its distance, that it underflows to nothing.
        if pixels == 1 || from == to {
            let step = match single {
                Single::IsAPoint => 0.0,
                Single::IsAll => to - from,
            };
            return Self::along(0.5 * from + 0.5 * to, step);
        }
        let last = f64::from(pixels - 1);
        // Half a sample is near enough. The middle of a symmetric window is itself a multiple of half a sample.
        let twice = (2.0 * last * (-from / (to - from))).round().clamp(0.0, 2.0 * last);
        let (step, rest) = quotient(sum(to, -from), last);
        let (high, low) = quotient(add(product(from, 2.0 * last - twice), product(to, twice)), 2.0 * last);
        Self { anchor: 0.5 * twice, at_anchor: high + low, step, rest }
    }

    /// Returns the coordinate of a sample. `index` counts from the first and may be a fraction.
    pub(crate) fn at(self, index: f64) -> f64 {
        let index = index - self.anchor;
        index.mul_add(self.step, index.mul_add(self.rest, self.at_anchor))
    }

    /// Returns the index at a coordinate, approximately.
    pub(crate) fn index(self, at: f64) -> f64 {
        (at - self.at_anchor) / self.step + self.anchor
    }

    /// Returns the axis counted from its other end; it has `samples` samples.
    pub(crate) fn reversed(self, samples: u32) -> Self {
        let anchor = f64::from(samples - 1) - self.anchor;
        Self { anchor, step: -self.step, rest: -self.rest, ..self }
    }
}

/// A double-double number: a value and its rounding error.
type DoubleDouble = (f64, f64);

/// Returns the exact sum of two numbers (Knuth's two-sum).
fn sum(a: f64, b: f64) -> DoubleDouble {
    let sum = a + b;
    let of_b = sum - a;
    (sum, (a - (sum - of_b)) + (b - of_b))
}

fn product(a: f64, b: f64) -> DoubleDouble {
    let product = a * b;
    (product, a.mul_add(b, -product))
}

fn add(a: DoubleDouble, b: DoubleDouble) -> DoubleDouble {
    let (high, low) = sum(a.0, b.0);
    (high, low + a.1 + b.1)
}

fn quotient((high, low): DoubleDouble, by: f64) -> DoubleDouble {
    let quotient = high / by;
    (quotient, ((-quotient).mul_add(by, high) + low) / by)
}

/// The extent of a pixel that is the only one of its row or column. If pixels are points, it is at the middle of the
/// window. If they have an extent, it fills the window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Single {
    IsAPoint,
    IsAll,
}

impl Single {
    /// Returns the extent with which the scene is drawn.
    pub(crate) fn of(scene: &Scene) -> Self {
        if scene.samples.most() > 1 { Self::IsAll } else { Self::IsAPoint }
    }
}

/// Returns the samples of an image in a window from its lower left to its upper right corner: the columns from the
/// left, the rows from the bottom.
pub(crate) fn grid(lower_left: DVec2, upper_right: DVec2, screen: Screen, single: Single) -> (Axis, Axis) {
    (
        Axis::between(lower_left.x, upper_right.x, screen.width(), single),
        Axis::between(lower_left.y, upper_right.y, screen.height(), single),
    )
}

/// Returns the samples of a camera that looks at a target, in its window at distance 1:
/// `U = tan(fov/2)·(2i + 1 - nx)/ny`, `V = tan(fov/2)·(2j + 1 - ny)/ny`.
pub(crate) fn look_grid(look: &Look, screen: Screen) -> (Axis, Axis) {
    let slope = half_angle_slope(look.field_of_view());
    let (step, rest) = quotient((2.0 * slope, 0.0), f64::from(screen.height()));
    let axis = |samples: u32| Axis { anchor: 0.5 * f64::from(samples - 1), at_anchor: 0.0, step, rest };
    (axis(screen.width()), axis(screen.height()))
}

/// Returns tan(angle/2) of an angle in degrees above 0 and below 180. For a wide angle the complement is more accurate
/// than the angle.
fn half_angle_slope(degrees: f64) -> f64 {
    let tangent = |degrees: f64| libm::tan(degrees.to_radians() / 2.0);
    if degrees <= 90.0 { tangent(degrees) } else { 1.0 / tangent(180.0 - degrees) }
}

/// Returns the ray of column `i` from the left and row `j` from the bottom, which may be fractions: its origin, and its
/// direction of length 1.
pub fn pixel_ray(scene: &Scene, i: f64, j: f64) -> (DVec3, DVec3) {
    let Ray { origin, direction } = Rays::new(&scene.camera, scene.screen, Single::of(scene)).ray(i, j);
    (origin, direction)
}

/// The rays of a camera's pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Rays {
    Parallel,
    /// A perspective camera: `direction = x.at(i)·right + y.at(j)·up - back`, not of unit length.
    Pinhole {
        eye: DVec3,
        right: DVec3,
        up: DVec3,
        back: DVec3,
        x: Axis,
        y: Axis,
    },
}

impl Rays {
    pub(crate) fn new(camera: &Camera, screen: Screen, single: Single) -> Self {
        let pinhole = match camera {
            Camera::Orthographic => return Self::Parallel,
            Camera::Look(look) => {
                let (right, up, back) = look.basis();
                let (x, y) = look_grid(look, screen);
                return Self::Pinhole { eye: look.eye(), right, up, back, x, y };
            }
            Camera::Pinhole(pinhole) => pinhole,
        };
        let (right, up, back) = pinhole.basis();
        // Only the window's proportions matter, so it is scaled until no product can overflow.
        let (a, b, distance) = (pinhole.lower_left(), pinhole.upper_right(), pinhole.distance());
        let scale = below_inverse(a.abs().max(b.abs()).max_element().max(distance));
        let (a, b, distance) = (a * scale, b * scale, (distance * scale).max(f64::MIN_POSITIVE));
        let (x, y) = grid(a, b, screen, single);
        Self::Pinhole { eye: pinhole.eye(), right, up, back: distance * back, x, y }
    }

    /// Returns these rays in coordinates whose origin is the eye.
    pub(crate) fn with_eye_at_origin(mut self) -> Self {
        match &mut self {
            Self::Parallel => {}
            Self::Pinhole { eye, .. } => *eye = DVec3::ZERO,
        }
        self
    }

    /// Returns the direction of the view axis, of length 1.
    pub(crate) fn forward(&self) -> DVec3 {
        match *self {
            Self::Parallel => DVec3::NEG_Z,
            Self::Pinhole { back, .. } => -unit(back),
        }
    }

    /// Returns the ray of column `i` from the left and row `j` from the bottom, which may be fractions.
    pub(crate) fn ray(&self, i: f64, j: f64) -> Ray {
        match *self {
            Self::Parallel => Ray { origin: DVec3::new(i, j, 0.0), direction: DVec3::NEG_Z },
            Self::Pinhole { eye, right, up, back, x, y } => {
                Ray { origin: eye, direction: unit(x.at(i) * right + (y.at(j) * up - back)) }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;
    use rayfold_scene::Pinhole;

    use super::*;

    fn pinhole(lower_left: DVec2, upper_right: DVec2) -> Camera {
        let camera = Pinhole::new(DVec3::Z, DVec3::NEG_Z, DVec3::Y, 1.0, lower_left, upper_right);
        Camera::Pinhole(camera.unwrap())
    }

    #[test]
    fn samples_sit_on_the_corners_of_the_window() {
        let screen = Screen::new(3, 2).unwrap();
        let rays =
            Rays::new(&pinhole(DVec2::new(-1.0, -2.0), DVec2::new(1.0, 2.0)), screen, Single::IsAPoint);
        assert_eq!(rays.ray(0.0, 0.0).direction, unit(DVec3::new(-1.0, -2.0, -1.0)));
        assert_eq!(rays.ray(2.0, 1.0).direction, unit(DVec3::new(1.0, 2.0, -1.0)));
        assert_eq!(rays.ray(1.0, 1.0).direction, unit(DVec3::new(0.0, 2.0, -1.0)));
    }

    #[test]
    fn between_two_pixels_lie_fractions() {
        let screen = Screen::new(3, 2).unwrap();
        let rays =
            Rays::new(&pinhole(DVec2::new(-1.0, -2.0), DVec2::new(1.0, 2.0)), screen, Single::IsAPoint);
        assert_eq!(rays.ray(1.5, 0.25).direction, unit(DVec3::new(0.5, -1.0, -1.0)));
        assert_eq!(rays.ray(-0.5, 1.5).direction, unit(DVec3::new(-1.5, 4.0, -1.0)));
        let parallel = Rays::new(&Camera::Orthographic, screen, Single::IsAPoint);
        assert_eq!(parallel.ray(1.5, 0.25).origin, DVec3::new(1.5, 0.25, 0.0));
    }

    #[test]
    fn rays_of_a_look_go_through_square_pixels() {
        let look = Look::new(DVec3::Z, DVec3::ZERO, 90.0, None).unwrap();
        let rays = Rays::new(&Camera::Look(look), Screen::new(4, 2).unwrap(), Single::IsAPoint);
        let check = |i: f64, j: f64, x: f64, y: f64| {
            let expected = unit(DVec3::new(x, y, -1.0));
            assert!((rays.ray(i, j).direction - expected).length() < 1e-15, "{i} {j}");
        };
        check(0.0, 0.0, -1.5, -0.5);
        check(3.0, 1.0, 1.5, 0.5);
        check(1.5, 0.5, 0.0, 0.0);
        for degrees in [1e-300, 1.0, 90.0, 120.0, 179.0, 179.999_999_999_999_97] {
            let slope = half_angle_slope(degrees);
            assert!(slope > 0.0 && slope.is_finite(), "{degrees}");
        }
        assert!((half_angle_slope(120.0) - 3f64.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn a_single_sample_is_the_middle() {
        let rays = Rays::new(
            &pinhole(DVec2::new(1.0, 3.0), DVec2::new(2.0, 5.0)),
            Screen::new(1, 1).unwrap(),
            Single::IsAPoint,
        );
        assert_eq!(rays.ray(0.0, 0.0).direction, unit(DVec3::new(1.5, 4.0, -1.0)));
    }

    #[test]
    fn the_widest_and_the_narrowest_views_have_directions() {
        let screen = Screen::new(3, 3).unwrap();
        for (distance, half, expected) in [(1e-300, 1e300, DVec2::ONE), (1e300, 1e-300, DVec2::ZERO)] {
            let half = DVec2::splat(half);
            let camera = Pinhole::new(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, distance, -half, half).unwrap();
            let rays = Rays::new(&Camera::Pinhole(camera), screen, Single::IsAPoint);
            assert_eq!(rays.ray(1.0, 1.0).direction, DVec3::NEG_Z);
            let corner = rays.ray(2.0, 2.0).direction;
            assert!((corner.truncate() - expected.normalize_or_zero()).length() < 1e-15, "{corner}");
        }
    }

    #[test]
    fn swapped_corners_mirror_the_image() {
        let screen = Screen::new(2, 2).unwrap();
        let rays =
            Rays::new(&pinhole(DVec2::new(1.0, -1.0), DVec2::new(-1.0, 1.0)), screen, Single::IsAPoint);
        assert!(rays.ray(0.0, 0.0).direction.x > 0.0 && rays.ray(1.0, 0.0).direction.x < 0.0);
    }

    /// Returns au + (bu - au)·i/(nx - 1) to 100 bits and more, from whole numbers. The window's corners are `a` and `b`
    /// multiples of 2^-40.
    fn formula(a: i64, b: i64, i: u32, pixels: u32) -> f64 {
        let (a, b, i, last) = (i128::from(a), i128::from(b), i128::from(i), i128::from(pixels - 1));
        let numerator = (a * (last - i) + b * i) << 40;
        let (whole, rest) = (numerator / last, numerator % last);
        // Below 2^100, cut off at 2^-40. The remainder only breaks ties.
        let sticky = i128::from(rest != 0);
        ((whole << 1) + whole.signum() * sticky) as f64 / 2f64.powi(81)
    }

    #[test]
    fn the_columns_of_a_camera_are_those_of_the_formula_rounded_once() {
        let mut rng = fastrand::Rng::with_seed(35);
        let unit = 2f64.powi(-40);
        for round in 0..2000 {
            let a = rng.i64(-(1 << 40)..1 << 40);
            let b = if round % 2 == 0 { -a } else { rng.i64(-(1 << 40)..1 << 40) };
            if a == b {
                continue;
            }
            let pixels = rng.u32(2..3000);
            let axis = Axis::between(a as f64 * unit, b as f64 * unit, pixels, Single::IsAPoint);
            for i in [0, pixels - 1, pixels / 2, rng.u32(0..pixels)] {
                let (ours, right) = (axis.at(f64::from(i)), formula(a, b, i, pixels));
                // If the middle of the view is not a sample, or is far away, two roundings need not give the result of
                // one.
                let slack = match () {
                    () if a == -b => 0.0,
                    () if a.signum() == b.signum() => 2.0 * f64::EPSILON,
                    () => f64::EPSILON,
                };
                assert!(
                    (ours - right).abs() <= slack * right.abs(),
                    "{a} {b}, {i} of {pixels}: {ours:e} {right:e}"
                );
            }
        }
    }

    #[test]
    fn the_middle_of_an_odd_width_lies_straight_ahead() {
        for pixels in (1..400).step_by(2) {
            let screen = Screen::new(pixels, pixels).unwrap();
            let middle = f64::from(pixels / 2);
            for half in [0.1, 0.6, 0.414_213_562_373, 7e-3] {
                let half = DVec2::new(half, 0.75 * half);
                let rays = Rays::new(&pinhole(-half, half), screen, Single::IsAPoint);
                assert_eq!(rays.ray(middle, middle).direction, DVec3::NEG_Z, "{pixels}");
            }
            for degrees in [20.0, 40.0, 77.7] {
                let look =
                    Look::new(DVec3::new(0.3, 1.0, 2.9), DVec3::new(-1.1, 1.0, 0.2), degrees, None).unwrap();
                let rays = Rays::new(&Camera::Look(look), screen, Single::IsAPoint);
                for i in [0.0, middle, 0.3 * middle] {
                    assert_eq!(rays.ray(i, middle).direction.y, 0.0, "{pixels}");
                }
            }
        }
    }

    #[test]
    fn a_window_s_corner_as_high_as_it_is_far_is_met_at_half_a_right_angle() {
        // The camera looks 45 degrees downwards, so the rays of the top row are horizontal.
        for pixels in 2..300 {
            let camera = Pinhole::new(
                DVec3::ZERO,
                DVec3::new(0.0, -1.0, -1.0),
                DVec3::Y,
                0.7,
                -0.7 * DVec2::ONE,
                0.7 * DVec2::ONE,
            );
            let screen = Screen::new(pixels, pixels).unwrap();
            let rays = Rays::new(&Camera::Pinhole(camera.unwrap()), screen, Single::IsAPoint);
            for i in 0..pixels {
                assert_eq!(rays.ray(f64::from(i), f64::from(pixels - 1)).direction.y, 0.0, "{pixels}");
            }
        }
    }
}
