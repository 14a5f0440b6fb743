//! Capsules.

use std::fmt;

use glam::DVec3;

use super::{Motion, Outline, Shape};
use crate::form::{Field, Form, Kind, Line, Numbers, Scripted, Values};
use crate::model::invalid::{Faults, InvalidValue, Parameter, finite, not_negative, positive};
use crate::model::material::Material;
use crate::model::surface;
use crate::model::vector::furthest;

/// A cylinder with a half sphere at each end: all points within a distance of a line segment. With equal ends it is a
/// sphere.
#[derive(Clone, Debug, PartialEq)]
pub struct Capsule {
    radius: f64,
    ends: [DVec3; 2],
    material: Material,
}

impl Capsule {
    /// Makes a capsule around the segment between two points.
    ///
    /// # Errors
    /// Fails if the radius is not positive or a number is not finite.
    pub fn new(radius: f64, ends: [DVec3; 2], material: Material) -> Result<Self, InvalidValue> {
        positive(Parameter::Radius, radius)?;
        finite(Parameter::AxisEnd, ends[0])?;
        finite(Parameter::AxisEnd, ends[1])?;
        Ok(Self { radius, ends, material })
    }

    /// Returns the radius, greater than 0.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Returns the ends a and b of the segment, which may be equal.
    pub fn ends(&self) -> [DVec3; 2] {
        self.ends
    }

    /// Returns the material of the surface.
    pub fn material(&self) -> &Material {
        &self.material
    }
}

impl Shape for Capsule {
    fn moved(&self, motion: &impl Motion, material: Material) -> Result<Self, InvalidValue> {
        Self::new(motion.length(self.radius), self.ends.map(|end| motion.point(end)), material)
    }

    fn support(&self, direction: DVec3) -> Option<f64> {
        Some(furthest(&self.ends, direction) + self.radius * direction.length())
    }

    fn outline(&self) -> Outline {
        Outline::Rod { radii: [self.radius; 2], ends: self.ends, is_round: true }
    }
}

impl Scripted for Capsule {
    const FORM: Form = Form::new(
        "Capsule",
        &[
            Field::new(Parameter::Radius, &["R"], Kind::Length, Values::NotNegative),
            Field::new(Parameter::AxisEnd, &["ax", "ay", "az"], Kind::Position, Values::Any),
            Field::new(Parameter::AxisEnd, &["bx", "by", "bz"], Kind::Position, Values::Any),
            surface::AMBIENT,
            surface::DIFFUSE,
            surface::MIRROR,
        ],
    )
    .hidden_by(&[0]);

    fn read(numbers: &mut Numbers<'_>) -> Result<Self, Faults> {
        let (radius, ends) = (numbers.number(), [numbers.vector(), numbers.vector()]);
        not_negative(Parameter::Radius, radius)?;
        Ok(Self::new(radius, ends, Material::read(numbers)?)?)
    }

    fn write(&self, line: &mut Line<'_, '_>) -> fmt::Result {
        line.number(self.radius)?;
        self.ends.iter().try_for_each(|end| line.vector(*end))?;
        self.material.write(line)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_capsule_has_a_radius_and_may_be_a_ball() {
        let capsule = |radius| Capsule::new(radius, [DVec3::X; 2], Material::default());
        assert_eq!(capsule(0.0), Err(InvalidValue::NotPositive(Parameter::Radius)));
        let ball = capsule(2.0).unwrap();
        assert_eq!((ball.support(DVec3::X), ball.support(DVec3::NEG_Y)), (Some(3.0), Some(2.0)));
    }
}
