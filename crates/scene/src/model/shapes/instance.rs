//! Instances: objects of a group as a `Use` draws them.

use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::{Motion, Object};
use crate::form::{Field, Form, Kind, Names, Numbers, Subject, Values};
use crate::model::invalid::{Faults, InvalidValue, Parameter, finite, not_negative, positive};
use crate::model::material::Material;
use crate::shared_slice::SharedSlice;

/// The command that draws a group.
pub(crate) const USE: Form = Form::new(
    "Use",
    &[
        Field::new(Parameter::Translation, &["tx", "ty", "tz"], Kind::Position, Values::Any).optional("0"),
        Field::new(Parameter::Rotation, &["rx", "ry", "rz"], Kind::Rotation, Values::Any).optional("0"),
        Field::new(Parameter::Scale, &["s"], Kind::Plain, Values::NotNegative).optional("1"),
    ],
)
.with_subject(Subject::Refers(Names::Groups));

/// A placement that moves, rotates and scales: p' = t + s·R·p.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    translation: DVec3,
    rotation: DMat3,
    scale: f64,
}

impl Placement {
    /// Makes a placement. `rotation` is orthonormal with determinant 1, and `scale` is greater than 0.
    ///
    /// # Errors
    /// Fails if the scale is not positive or a number is not finite.
    pub fn new(translation: DVec3, rotation: DMat3, scale: f64) -> Result<Self, InvalidValue> {
        finite(Parameter::Translation, translation)?;
        positive(Parameter::Scale, scale)?;
        Ok(Self { translation, rotation, scale })
    }

    /// Reads the numbers of a [`USE`]. Returns `None` if a scale of 0 hides the group.
    pub(crate) fn read(numbers: &mut Numbers<'_>) -> Result<Option<Self>, Faults> {
        let (translation, degrees) = (numbers.vector(), numbers.vector());
        let scale = not_negative(Parameter::Scale, numbers.optional_number().unwrap_or(1.0))?;
        if scale == 0.0 {
            return Ok(None);
        }
        Ok(Some(Self::new(translation, turned(degrees), scale)?))
    }

    /// Returns the translation t.
    pub fn translation(&self) -> DVec3 {
        self.translation
    }

    /// Returns the rotation R.
    pub fn rotation(&self) -> DMat3 {
        self.rotation
    }

    /// Returns the scale s, greater than 0.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Returns the position in the world of a point of the group.
    pub fn point(&self, p: DVec3) -> DVec3 {
        self.translation + self.scale * (self.rotation * p)
    }

    /// Returns the position in the group of a point of the world.
    pub fn local_point(&self, p: DVec3) -> DVec3 {
        (self.rotation.transpose() * (p - self.translation)) / self.scale
    }

    /// Combines two placements: first this one, then `outer`.
    ///
    /// # Errors
    /// Fails if a number overflows or the scale vanishes.
    pub fn within(&self, outer: &Self) -> Result<Self, InvalidValue> {
        Self::new(outer.point(self.translation), outer.rotation * self.rotation, outer.scale * self.scale)
    }
}

/// Returns Rz·Ry·Rx for angles in degrees, right-handed. Multiples of 90 are exact.
fn turned(degrees: DVec3) -> DMat3 {
    let [x, y, z] = degrees.to_array().map(cos_sin);
    let about_x = DMat3::from_cols_array(&[1.0, 0.0, 0.0, 0.0, x.0, x.1, 0.0, -x.1, x.0]);
    let about_y = DMat3::from_cols_array(&[y.0, 0.0, -y.1, 0.0, 1.0, 0.0, y.1, 0.0, y.0]);
    let about_z = DMat3::from_cols_array(&[z.0, z.1, 0.0, -z.1, z.0, 0.0, 0.0, 0.0, 1.0]);
    about_z * about_y * about_x
}

/// Returns cosine and sine of an angle in degrees, the same on every machine.
fn cos_sin(degrees: f64) -> (f64, f64) {
    // Both steps are exact, and the rest is within 45 degrees of a multiple of 90.
    let turn = degrees % 360.0;
    let quarters = (turn / 90.0).round();
    let (sin, cos) = libm::sincos((turn - 90.0 * quarters).to_radians());
    match (quarters as i32).rem_euclid(4) {
        0 => (cos, sin),
        1 => (-sin, cos),
        2 => (-cos, -sin),
        _ => (sin, -cos),
    }
}

/// An object of a group, as drawn by one `Use`. The object has the numbers of the group.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// The objects of the group, none of which is an instance.
    objects: SharedSlice<Object>,
    index: usize,
    placement: Arc<Placement>,
}

impl Instance {
    /// Makes an instance of object `index` of the group's `objects`, placed by `placement`.
    ///
    /// # Panics
    /// Panics if there is no such object, or if it is an instance itself.
    pub fn new(objects: &SharedSlice<Object>, index: usize, placement: &Arc<Placement>) -> Self {
        assert!(!matches!(objects[index], Object::Instance(_)), "an instance of an instance");
        Self { objects: objects.clone(), index, placement: placement.clone() }
    }

    /// Returns the object with the numbers that it has in its group; never an instance.
    pub fn object(&self) -> &Object {
        &self.objects[self.index]
    }

    /// Returns the placement from the group's coordinates to the world's.
    pub fn placement(&self) -> &Placement {
        &self.placement
    }

    /// Returns the placement, which the objects of one drawn group share.
    pub fn shared_placement(&self) -> &Arc<Placement> {
        &self.placement
    }

    /// Returns the material of the surface. A pattern is in the group's coordinates.
    pub fn material(&self) -> &Material {
        self.object().material()
    }

    pub(super) fn moved(&self, motion: &impl Motion) -> Result<Self, InvalidValue> {
        let Placement { translation, rotation, scale } = *self.placement;
        let [x, y, z] =
            [rotation.x_axis, rotation.y_axis, rotation.z_axis].map(|axis| motion.direction(axis));
        let rotation = DMat3::from_cols(x, y, z);
        let placement = Placement::new(motion.point(translation), rotation, motion.length(scale))?;
        Ok(Self { placement: Arc::new(placement), ..self.clone() })
    }

    pub(super) fn support(&self, direction: DVec3) -> Option<f64> {
        let Placement { translation, rotation, scale } = *self.placement;
        let support = self.object().support(rotation.transpose() * direction)?;
        Some(translation.dot(direction) + scale * support)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quarter_turns_are_exact_and_right_handed() {
        let turn = |x, y, z| turned(DVec3::new(x, y, z));
        assert_eq!(turn(90.0, 0.0, 0.0) * DVec3::Y, DVec3::Z);
        assert_eq!(turn(0.0, 90.0, 0.0) * DVec3::Z, DVec3::X);
        assert_eq!(turn(0.0, 0.0, 90.0) * DVec3::X, DVec3::Y);
        assert_eq!(turn(0.0, 0.0, -270.0) * DVec3::X, DVec3::Y);
        assert_eq!(turn(0.0, 0.0, 36_000_000_000_180.0) * DVec3::X, DVec3::NEG_X);
        assert_eq!(turn(90.0, 90.0, 0.0) * DVec3::Y, DVec3::X, "about x first");
        assert_eq!(turn(90.0, 0.0, 90.0) * DVec3::X, DVec3::Y, "about z last");
    }

    #[test]
    fn other_turns_are_close_and_keep_lengths() {
        for k in -1000..1000 {
            let degrees = f64::from(k) * 0.7311;
            let (cos, sin) = cos_sin(degrees);
            let (expect_sin, expect_cos) = degrees.to_radians().sin_cos();
            assert!((cos - expect_cos).abs() < 4e-15 && (sin - expect_sin).abs() < 4e-15, "{degrees}");
            assert!((cos * cos + sin * sin - 1.0).abs() < 4e-16, "{degrees}");
        }
    }
}
