//! The camera that looks at a target.

use std::fmt;

use glam::DVec3;

use super::invalid::{Faults, InvalidValue, Parameter, finite};
use super::vector::{cross, is_parallel, level, unit};
use crate::form::{Field, Form, Kind, Line, Numbers, Scripted, Together, Values};

/// A pinhole camera at an eye that looks at a target, with square pixels: the ray of column i and row j goes
/// tan(fov/2)·((2i + 1 - nx)·u + (2j + 1 - ny)·v)/ny - w, in the frame of [`Look::basis`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    eye: DVec3,
    target: DVec3,
    field_of_view: f64,
    up: Option<DVec3>,
}

impl Look {
    /// `eye` and `target` are positions, `field_of_view` is the vertical angle in degrees; `up` a direction of any
    /// length: if it is not given, y, or -z for a gaze straight up or down.
    ///
    /// # Errors
    /// When eye and target are the same, the angle is not above 0 and below 180, up is zero or along the gaze, or a
    /// number is not finite.
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
        } else if faults.is_empty() && is_parallel(look.gaze(), look.up()) {
            faults.push(InvalidValue::GazeParallelToUp);
        }
        if faults.is_empty() { Ok(look) } else { Err(faults) }
    }

    /// Where the rays start.
    pub fn eye(&self) -> DVec3 {
        self.eye
    }

    /// Where it looks.
    pub fn target(&self) -> DVec3 {
        self.target
    }

    /// The vertical angle in degrees, above 0 and below 180.
    pub fn field_of_view(&self) -> f64 {
        self.field_of_view
    }

    /// From the eye to the target, in a scale of its own.
    pub fn gaze(&self) -> DVec3 {
        // Halves, so that the difference of two finite numbers is finite.
        0.5 * self.target - 0.5 * self.eye
    }

    /// From the eye to the target, in world units.
    pub fn distance(&self) -> f64 {
        2.0 * self.gaze().length()
    }

    /// View-up, of any length.
    pub fn up(&self) -> DVec3 {
        let gaze = self.gaze();
        self.up.unwrap_or(if gaze.x == 0.0 && gaze.z == 0.0 { DVec3::NEG_Z } else { DVec3::Y })
    }

    /// The orthonormal frame (u, v, w): u to the right, v up, w against the gaze, as [`super::Pinhole::basis`].
    pub fn basis(&self) -> (DVec3, DVec3, DVec3) {
        let w = -unit(self.gaze());
        let u = unit(cross(level(self.gaze()), level(self.up())));
        (u, w.cross(u), w)
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
    .with(&[Together::Differ(0, 1), Together::LooksAside(0, 1, 3)]);

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
