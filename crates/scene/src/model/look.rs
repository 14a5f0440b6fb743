//! The camera that looks at a target.

use std::fmt;

use glam::DVec3;

use super::invalid::{Faults, InvalidValue, Parameter, finite};
use super::vector::{cross, is_parallel, level, unit};
use crate::form::{Constraint, Field, Form, Kind, Line, Numbers, Scripted, Values};

/// A pinhole camera at an eye that looks at a target, with square pixels. The ray of column i and row j has the
/// direction tan(fov/2)·((2i + 1 - nx)·u + (2j + 1 - ny)·v)/ny - w, in the frame of [`Look::basis`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    eye: DVec3,
    target: DVec3,
    field_of_view: f64,
    up: Option<DVec3>,
}

impl Look {
    /// Makes a camera. `eye` and `target` are positions, and `field_of_view` is the vertical angle in degrees. `up`
    /// is a direction of any length. Default: y, or -z if the view direction is parallel to y, which is then
    /// treated as exactly parallel.
    ///
    /// # Errors
    /// Fails if eye and target are the same, the angle is not above 0 and below 180, `up` is zero or parallel to the
    /// view direction, or a number is not finite.
    pub fn new(
        eye: DVec3,
        target: DVec3,
        field_of_view: f64,
        up: Option<DVec3>,
    ) -> Result<Self, InvalidValue> {
        Self::checked(eye, target, field_of_view, up).map_err(|faults| faults[0])
    }

    fn checked(
        eye: DVec3,
        target: DVec3,
        field_of_view: f64,
        up: Option<DVec3>,
    ) -> Result<Self, Vec<InvalidValue>> {
        let mut faults: Vec<_> = [finite(Parameter::Eye, eye), finite(Parameter::Target, target)]
            .into_iter()
            .chain(up.map(|up| super::invalid::direction(Parameter::Up, up)))
            .filter_map(Result::err)
            .collect();
        if !(field_of_view > 0.0 && field_of_view < 180.0) {
            faults.push(InvalidValue::OutOfRange(Parameter::FieldOfView, 0.0, 180.0));
        }
        let look = Self { eye, target, field_of_view, up };
        if eye == target {
            faults.push(InvalidValue::NoGaze);
        } else if faults.is_empty() && up.is_some_and(|up| is_parallel(look.gaze(), up)) {
            faults.push(InvalidValue::GazeParallelToUp);
        }
        if faults.is_empty() { Ok(look) } else { Err(faults) }
    }

    /// Returns the origin of the rays.
    pub fn eye(&self) -> DVec3 {
        self.eye
    }

    /// Returns the target of the camera.
    pub fn target(&self) -> DVec3 {
        self.target
    }

    /// Returns the vertical angle in degrees, above 0 and below 180.
    pub fn field_of_view(&self) -> f64 {
        self.field_of_view
    }

    /// Returns the vector from the eye to the target, at half length.
    pub fn gaze(&self) -> DVec3 {
        // Halves, so that the difference of two finite numbers is finite.
        0.5 * self.target - 0.5 * self.eye
    }

    /// Returns the distance from the eye to the target, in world units.
    pub fn distance(&self) -> f64 {
        2.0 * self.gaze().length()
    }

    /// Returns the view-up direction, of any length.
    pub fn up(&self) -> DVec3 {
        self.gaze_and_up().1
    }

    /// Returns the orthonormal frame (u, v, w): u to the right, v up, w against the
    /// view direction, like [`super::Pinhole::basis`].
    pub fn basis(&self) -> (DVec3, DVec3, DVec3) {
        let (gaze, up) = self.gaze_and_up();
        let w = -unit(gaze);
        let u = unit(cross(level(gaze), level(up)));
        (u, w.cross(u), w)
    }

    /// Without an own `up`, a view direction parallel to y is replaced by y, so that rounding does
    /// not affect the frame.
    fn gaze_and_up(&self) -> (DVec3, DVec3) {
        let gaze = self.gaze();
        match self.up {
            Some(up) => (gaze, up),
            None if is_parallel(gaze, DVec3::Y) => (DVec3::new(0.0, gaze.y, 0.0), DVec3::NEG_Z),
            None => (gaze, DVec3::Y),
        }
    }
}

impl Scripted for Look {
    const FORM: Form = Form::new(
        "Look",
        &[
            Field::new(Parameter::Eye, &["ex", "ey", "ez"], Kind::Position, Values::Any),
            Field::new(Parameter::Target, &["tx", "ty", "tz"], Kind::Position, Values::Any),
            Field::new(Parameter::FieldOfView, &["fov"], Kind::Angle, Values::FieldOfView),
            Field::new(Parameter::Up, &["upx", "upy", "upz"], Kind::Direction, Values::NotZero)
                .optional("0 1 0, or 0 0 -1 for a gaze along y"),
        ],
    )
    .with(&[Constraint::Differ(0, 1), Constraint::LooksAside(0, 1, 3)]);

    fn read(numbers: &mut Numbers<'_>) -> Result<Self, Faults> {
        let (eye, target, field_of_view) = (numbers.vector(), numbers.vector(), numbers.number());
        let up = numbers.optional_vector();
        Self::checked(eye, target, field_of_view, up).map_err(Faults)
    }

    fn write(&self, line: &mut Line<'_, '_>) -> fmt::Result {
        line.vector(self.eye)?;
        line.vector(self.target)?;
        line.number(self.field_of_view)?;
        self.up.map_or(Ok(()), |up| line.vector(up))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn look(eye: DVec3, up: Option<DVec3>) -> Result<Look, InvalidValue> {
        Look::new(eye, DVec3::ZERO, 40.0, up)
    }

    #[test]
    fn a_gaze_that_is_parallel_to_y_within_rounding_is_that_from_exactly_above_or_below() {
        for side in [1.0, -1.0] {
            let exact = look(DVec3::new(0.0, 5.0 * side, 0.0), None).unwrap().basis();
            assert_eq!(exact.0, side * DVec3::X);
            assert_eq!(exact.1, DVec3::NEG_Z);
            for sine in [3.06e-16, -1e-13, 0.99 / (1u64 << 40) as f64] {
                for aside in [DVec3::X, DVec3::Z, DVec3::new(0.6, 0.0, -0.8)] {
                    let eye = DVec3::new(0.0, 5.0 * side, 0.0) + 5.0 * sine * aside;
                    assert_eq!(look(eye, None).unwrap().basis(), exact, "{sine:e} along {aside}");
                }
            }
        }
    }

    #[test]
    fn frames_beside_the_pole_of_an_orbit_look_as_the_orbit_does() {
        // Over the pole from +z to -z, as close as is not parallel: the picture's right is that of the orbit.
        for sine in [1e-3, 1e-9, 1.01 / (1u64 << 40) as f64] {
            for (side, right) in [(1.0, DVec3::X), (-1.0, DVec3::NEG_X)] {
                let (u, v, w) = look(DVec3::new(0.0, 5.0, 5.0 * side * sine), None).unwrap().basis();
                assert_eq!(u, right, "{sine:e}");
                assert!(v.distance(DVec3::new(0.0, sine, -side)) < 1e-5 && w.y > 0.99, "{sine:e}");
            }
        }
    }

    #[test]
    fn an_up_of_its_own_along_the_gaze_is_an_error_within_the_same_rounding() {
        let above = |x: f64| DVec3::new(x, 5.0, 0.0);
        let near = 0.99 * 5.0 / (1u64 << 40) as f64;
        for (eye, up) in
            [(above(3.06e-16), DVec3::Y), (above(near), DVec3::Y), (above(0.0), DVec3::NEG_Y * 1e200)]
        {
            assert_eq!(look(eye, Some(up)), Err(InvalidValue::GazeParallelToUp), "{eye} {up}");
        }
        assert!(look(above(1.02 / 0.99 * near), Some(DVec3::Y)).is_ok());
    }
}
