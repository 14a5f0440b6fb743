//! Cameras: the mapping from pixels to rays.

use std::fmt::{self, Formatter};

use glam::{DVec2, DVec3};

use super::invalid::{Faults, InvalidValue, Parameter, direction, finite, positive};
use super::look::Look;
use super::screen::Screen;
use super::vector::{cross, is_parallel, level, unit};
use crate::form::{Constraint, Field, Form, Kind, Line, Numbers, Scripted, Values, write_line};

/// The command of the orthographic camera.
pub(crate) const ORTHOCAMERA: Form = Form::new("Orthocamera", &[]);

/// The mapping from a pixel to the origin and the direction of its ray.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum Camera {
    /// The ray of column i, row j (from the bottom) starts at (i, j, 0) and goes (0, 0, -1).
    #[default]
    Orthographic,
    /// All rays start at the eye.
    Pinhole(Pinhole),
    /// All rays start at the eye, and the middle one points at a target.
    Look(Look),
}

impl Camera {
    /// Writes a line of a script.
    pub(crate) fn write(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Orthographic => writeln!(f, "{}", ORTHOCAMERA.name),
            Self::Pinhole(pinhole) => write_line(f, pinhole, None),
            Self::Look(look) => write_line(f, look, None),
        }
    }
}

impl From<Pinhole> for Camera {
    fn from(pinhole: Pinhole) -> Self {
        Self::Pinhole(pinhole)
    }
}

impl From<Look> for Camera {
    fn from(look: Look) -> Self {
        Self::Look(look)
    }
}

/// A pinhole camera: the window is perpendicular to the view direction, at a distance in front of the eye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pinhole {
    eye: DVec3,
    gaze: DVec3,
    up: DVec3,
    distance: f64,
    lower_left: DVec2,
    upper_right: DVec2,
}

impl Pinhole {
    /// Makes a camera. `eye` is a position. `gaze` and `up` are directions of any length. `distance` is that of the
    /// window from the eye. `lower_left` (au, av) and `upper_right` (bu, bv) are the window's corners in its own
    /// plane. A window with swapped corners mirrors the image.
    ///
    /// # Errors
    /// Fails if a number is not finite, gaze or up is zero, the two are parallel, the distance is not positive, or
    /// the window is empty.
    pub fn new(
        eye: DVec3,
        gaze: DVec3,
        up: DVec3,
        distance: f64,
        lower_left: DVec2,
        upper_right: DVec2,
    ) -> Result<Self, InvalidValue> {
        Self::checked(eye, gaze, up, distance, lower_left, upper_right).map_err(|faults| faults[0])
    }

    /// Checks like [`Pinhole::new`], but returns all errors.
    fn checked(
        eye: DVec3,
        gaze: DVec3,
        up: DVec3,
        distance: f64,
        lower_left: DVec2,
        upper_right: DVec2,
    ) -> Result<Self, Vec<InvalidValue>> {
        let (a, b) = (lower_left, upper_right);
        let gaze_and_up = [direction(Parameter::Gaze, gaze), direction(Parameter::Up, up)];
        let parallel = gaze_and_up.iter().all(Result::is_ok) && is_parallel(gaze, up);
        let faults: Vec<_> = gaze_and_up
            .into_iter()
            .chain([
                finite(Parameter::Eye, eye),
                positive(Parameter::WindowDistance, distance).map(|_| eye),
                finite(Parameter::WindowCorner, a.extend(0.0)),
                finite(Parameter::WindowCorner, b.extend(0.0)),
            ])
            .filter_map(Result::err)
            .chain(parallel.then_some(InvalidValue::GazeParallelToUp))
            .chain((a.x == b.x).then_some(InvalidValue::EmptyWindowWidth))
            .chain((a.y == b.y).then_some(InvalidValue::EmptyWindowHeight))
            .collect();
        if faults.is_empty() {
            Ok(Self { eye, gaze, up, distance, lower_left, upper_right })
        } else {
            Err(faults)
        }
    }

    /// Returns the origin of the rays.
    pub fn eye(&self) -> DVec3 {
        self.eye
    }

    /// Returns the view direction, of any length.
    pub fn gaze(&self) -> DVec3 {
        self.gaze
    }

    /// Returns the view-up direction, of any length.
    pub fn up(&self) -> DVec3 {
        self.up
    }

    /// Returns the distance of the window from the eye, greater than 0.
    pub fn distance(&self) -> f64 {
        self.distance
    }

    /// Returns the window's lower-left corner (au, av).
    pub fn lower_left(&self) -> DVec2 {
        self.lower_left
    }

    /// Returns the window's upper-right corner (bu, bv).
    pub fn upper_right(&self) -> DVec2 {
        self.upper_right
    }

    /// Returns the window (au, av, bu, bv) with square pixels on a screen, with the same height and centre. Returns
    /// `None` if this window has square pixels already, to within 2 %.
    pub fn unsquashed(&self, screen: Screen) -> Option<[f64; 4]> {
        let (a, b) = (self.lower_left, self.upper_right);
        unsquashed([a.x, a.y, b.x, b.y], screen)
    }

    /// Returns the orthonormal frame (u, v, w): u to the right, v up, w against the view direction.
    ///
    /// w = -g/|g|, u = (up x w)/|up x w|, v = w x u.
    pub fn basis(&self) -> (DVec3, DVec3, DVec3) {
        let w = -unit(self.gaze);
        // Equal to up x w, but computed from the exact numbers of the script.
        let u = unit(cross(level(self.gaze), level(self.up)));
        (u, w.cross(u), w)
    }
}

impl Scripted for Pinhole {
    const FORM: Form = Form::new(
        "Camera",
        &[
            Field::new(Parameter::Eye, &["ex", "ey", "ez"], Kind::Position, Values::Any),
            Field::new(Parameter::Gaze, &["gx", "gy", "gz"], Kind::Direction, Values::NotZero),
            Field::new(Parameter::Up, &["upx", "upy", "upz"], Kind::Direction, Values::NotZero),
            Field::new(Parameter::WindowDistance, &["s"], Kind::Length, Values::Positive),
            Field::new(Parameter::WindowCorner, &["au", "av"], Kind::WindowPosition, Values::Any),
            Field::new(Parameter::WindowCorner, &["bu", "bv"], Kind::WindowPosition, Values::Any),
        ],
    )
    .with(&[Constraint::NotParallel(1, 2), Constraint::DifferEverywhere(4, 5)]);

    fn read(numbers: &mut Numbers<'_>) -> Result<Self, Faults> {
        let [eye, gaze, up] = [numbers.vector(), numbers.vector(), numbers.vector()];
        Self::checked(eye, gaze, up, numbers.number(), numbers.pair(), numbers.pair()).map_err(Faults)
    }

    fn write(&self, line: &mut Line<'_, '_>) -> fmt::Result {
        [self.eye, self.gaze, self.up].iter().try_for_each(|v| line.vector(*v))?;
        line.number(self.distance)?;
        line.pair(self.lower_left)?;
        line.pair(self.upper_right)
    }
}

/// The largest relative difference between the aspect ratios of window and image. A window's outer pixels lie on its
/// border, so its shape is between nx : ny and (nx - 1) : (ny - 1). Users also round the numbers that they write.
const TOLERANCE: f64 = 0.02;

/// Returns the window with square pixels, with the same height and centre, or `None` if this one has them.
pub(crate) fn unsquashed([au, av, bu, bv]: [f64; 4], screen: Screen) -> Option<[f64; 4]> {
    let (nx, ny) = (f64::from(screen.width()), f64::from(screen.height()));
    // A single column or row shows the middle of the window, whatever its shape.
    if screen.width() == 1 || screen.height() == 1 {
        return None;
    }
    let shape = ((bu - au) / (bv - av)).abs();
    let is_near = |other: f64| (shape / other - 1.0).abs() <= TOLERANCE;
    if is_near(nx / ny) || is_near((nx - 1.0) / (ny - 1.0)) || !(shape > 0.0 && shape.is_finite()) {
        return None;
    }
    let (middle, half) = (0.5 * au + 0.5 * bu, (0.5 * bv - 0.5 * av).abs() * nx / ny * (bu - au).signum());
    let better = [middle - half, av, middle + half, bv];
    better.iter().all(|x| x.is_finite()).then_some(better)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn windows_of_the_image_s_shape_are_in_order() {
        let check = |corners, nx, ny, expect| {
            assert_eq!(unsquashed(corners, Screen::new(nx, ny).unwrap()), expect, "{corners:?} {nx} x {ny}");
        };
        check([-0.6, -0.45, 0.6, 0.45], 640, 480, None);
        check([-1.0, -1.0, 1.0, 1.0], 4, 4, None);
        check([-3.0, -2.0, 3.0, 2.0], 4, 3, None);
        check([1.0, -1.0, -1.0, 1.0], 100, 100, None);
        check([-1.778, -1.0, 1.778, 1.0], 1920, 1080, None);
        check([-1.0, -1.0, 1.0, 1.0], 640, 1, None);
        check([-1.0, -1.0, 1.0, 1.0], 200, 100, Some([-2.0, -1.0, 2.0, 1.0]));
        check([2.0, 0.0, 0.0, 2.0], 200, 100, Some([3.0, 0.0, -1.0, 2.0]));
    }

    fn pinhole(gaze: DVec3, up: DVec3) -> Result<Pinhole, InvalidValue> {
        Pinhole::new(DVec3::ZERO, gaze, up, 1.0, DVec2::NEG_ONE, DVec2::ONE)
    }

    #[test]
    fn every_parameter_is_checked() {
        let check = |e: DVec3, g: DVec3, s: f64, a: DVec2, b: DVec2, expect: &[InvalidValue]| {
            let faults = Pinhole::checked(e, g, DVec3::Y, s, a, b).err().unwrap_or_default();
            assert_eq!(faults, expect);
        };
        let (e, g, a, b) = (DVec3::ZERO, DVec3::NEG_Z, DVec2::NEG_ONE, DVec2::ONE);
        check(e, g, 1.0, a, b, &[]);
        check(e, g, 1.0, b, a, &[]);
        check(e, g, 0.0, a, b, &[InvalidValue::NotPositive(Parameter::WindowDistance)]);
        check(e, g, f64::NAN, a, b, &[InvalidValue::NotFinite(Parameter::WindowDistance)]);
        check(e, DVec3::ZERO, 1.0, a, b, &[InvalidValue::ZeroDirection(Parameter::Gaze)]);
        check(DVec3::NAN, g, 1.0, a, b, &[InvalidValue::NotFinite(Parameter::Eye)]);
        check(e, g, 1.0, DVec2::NAN, b, &[InvalidValue::NotFinite(Parameter::WindowCorner)]);
        check(e, g, 1.0, a, DVec2::new(-1.0, 1.0), &[InvalidValue::EmptyWindowWidth]);
        check(
            e,
            g,
            -1.0,
            a,
            a,
            &[
                InvalidValue::NotPositive(Parameter::WindowDistance),
                InvalidValue::EmptyWindowWidth,
                InvalidValue::EmptyWindowHeight,
            ],
        );
    }

    #[test]
    fn the_basis_is_that_of_the_language() {
        let camera = pinhole(DVec3::NEG_Z * 1e-200, DVec3::new(0.0, 1e200, 1e200)).unwrap();
        let (u, v, w) = camera.basis();
        assert!(u.distance(DVec3::X) < 1e-15 && v.distance(DVec3::Y) < 1e-15 && w == DVec3::Z);
    }

    proptest! {
        #[test]
        fn what_is_parallel_as_written_is_found_parallel(
            x in -1000..=1000i32, y in -1000..=1000i32, z in 1..=1000i32,
            factor in prop_oneof![-1000..=-1i32, 1..=1000i32],
            scale in -300..=300i32,
        ) {
            // The decimals that a script holds: parallel on paper, but each rounded when it is read.
            let read = |n: i32, exponent: i32| format!("{n}e{exponent}").parse::<f64>().unwrap();
            let gaze = DVec3::new(read(x, -3), read(y, -3), read(z, -3));
            let up = DVec3::new(read(x * factor, scale), read(y * factor, scale), read(z * factor, scale));
            prop_assert_eq!(pinhole(gaze, up), Err(InvalidValue::GazeParallelToUp));
        }

        #[test]
        fn what_is_a_billionth_apart_is_not_parallel(
            x in -1000..=1000i32, y in -1000..=1000i32, z in 1..=1000i32, scale in -280..=280i32,
        ) {
            let gaze = DVec3::new(x.into(), y.into(), z.into());
            let up = (gaze + gaze.any_orthogonal_vector().normalize() * gaze.length() * 1e-9) * 10f64.powi(scale);
            let (u, v, w) = pinhole(gaze, up).unwrap().basis();
            for (a, b) in [(u, v), (v, w), (w, u)] {
                prop_assert!(a.dot(b).abs() < 1e-14 && (a.length() - 1.0).abs() < 1e-14);
            }
        }
    }
}
