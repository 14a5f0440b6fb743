//! Spheres.

use std::fmt;

use glam::DVec3;

use super::{Motion, Outline, Shape};
use crate::form::{Field, Form, Kind, Line, Numbers, Scripted, Values};
use crate::model::invalid::{Faults, InvalidValue, Parameter, finite, not_negative, positive};
use crate::model::material::Material;
use crate::model::surface;

/// A sphere of positive radius.
#[derive(Clone, Debug, PartialEq)]
pub struct Sphere {
    radius: f64,
    center: DVec3,
    material: Material,
}

impl Sphere {
    /// Makes a sphere.
    ///
    /// # Errors
    /// Fails if the radius is not positive or a number is not finite.
    pub fn new(radius: f64, center: DVec3, material: Material) -> Result<Self, InvalidValue> {
        positive(Parameter::Radius, radius)?;
        finite(Parameter::Center, center)?;
        Ok(Self { radius, center, material })
    }

    /// Returns the radius, greater than 0.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Returns the centre of the sphere.
    pub fn center(&self) -> DVec3 {
        self.center
    }

    /// Returns the material of the surface.
    pub fn material(&self) -> &Material {
        &self.material
    }
}

impl Shape for Sphere {
    fn moved(&self, motion: &impl Motion, material: Material) -> Result<Self, InvalidValue> {
        Self::new(motion.length(self.radius), motion.point(self.center), material)
    }

    fn support(&self, direction: DVec3) -> Option<f64> {
        Some(self.center.dot(direction) + self.radius * direction.length())
    }

    fn outline(&self) -> Outline {
        Outline::Ball { center: self.center, radius: self.radius }
    }
}

impl Scripted for Sphere {
    const FORM: Form = Form::new(
        "Sphere",
        &[
            Field::new(Parameter::Radius, &["R"], Kind::Length, Values::NotNegative),
            Field::new(Parameter::Center, &["cx", "cy", "cz"], Kind::Position, Values::Any),
            surface::AMBIENT,
            surface::DIFFUSE,
            surface::MIRROR,
        ],
    )
    .hidden_by(&[0]);

    fn read(numbers: &mut Numbers<'_>) -> Result<Self, Faults> {
        let radius = not_negative(Parameter::Radius, numbers.number())?;
        Ok(Self::new(radius, numbers.vector(), Material::read(numbers)?)?)
    }

    fn write(&self, line: &mut Line<'_, '_>) -> fmt::Result {
        line.number(self.radius)?;
        line.vector(self.center)?;
        self.material.write(line)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sphere_has_a_radius() {
        let sphere = |radius| Sphere::new(radius, DVec3::ZERO, Material::default());
        for radius in [0.0, -0.0, -1.0] {
            assert_eq!(sphere(radius), Err(InvalidValue::NotPositive(Parameter::Radius)));
        }
        assert_eq!(sphere(f64::INFINITY), Err(InvalidValue::NotFinite(Parameter::Radius)));
        assert_eq!(sphere(5e-324).unwrap().radius(), 5e-324);
    }

    #[test]
    fn every_number_is_finite() {
        for bad in [DVec3::NAN, DVec3::INFINITY] {
            let sphere = Sphere::new(1.0, bad, Material::default());
            assert_eq!(sphere, Err(InvalidValue::NotFinite(Parameter::Center)));
        }
    }
}
