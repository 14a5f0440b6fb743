//! Boxes along the axes. The code says cuboid, because `Box` has another meaning in Rust.

use std::fmt;

use glam::DVec3;

use super::{Motion, Outline, Shape};
use crate::form::{Field, Form, Kind, Line, Numbers, Scripted, Values};
use crate::model::invalid::{Faults, InvalidValue, Parameter, finite};
use crate::model::material::Material;
use crate::model::surface;

/// An axis-aligned, closed box: its faces, edges and corners belong to it. A box without thickness is a rectangle.
#[derive(Clone, Debug, PartialEq)]
pub struct Cuboid {
    corners: [DVec3; 2],
    material: Material,
}

impl Cuboid {
    /// Makes a box from two opposite corners.
    ///
    /// # Errors
    /// Fails if a number is not finite.
    pub fn new(corners: [DVec3; 2], material: Material) -> Result<Self, InvalidValue> {
        finite(Parameter::Corner, corners[0])?;
        finite(Parameter::Corner, corners[1])?;
        Ok(Self { corners, material })
    }

    /// Returns the two corners as in the script.
    pub fn corners(&self) -> &[DVec3; 2] {
        &self.corners
    }

    /// Returns the corner with the smallest coordinates.
    pub fn min(&self) -> DVec3 {
        self.corners[0].min(self.corners[1])
    }

    /// Returns the corner with the largest coordinates.
    pub fn max(&self) -> DVec3 {
        self.corners[0].max(self.corners[1])
    }

    /// Returns the material of the surface.
    pub fn material(&self) -> &Material {
        &self.material
    }
}

impl Shape for Cuboid {
    fn moved(&self, motion: &impl Motion, material: Material) -> Result<Self, InvalidValue> {
        Self::new(self.corners.map(|corner| motion.point(corner)), material)
    }

    fn support(&self, direction: DVec3) -> Option<f64> {
        Some(DVec3::select(direction.cmpgt(DVec3::ZERO), self.max(), self.min()).dot(direction))
    }

    fn outline(&self) -> Outline {
        Outline::Box { corners: [self.min(), self.max()], radius: 0.0 }
    }
}

impl Scripted for Cuboid {
    const FORM: Form = Form::new(
        "Box",
        &[
            Field::new(Parameter::Corner, &["ux", "uy", "uz"], Kind::Position, Values::Any),
            Field::new(Parameter::Corner, &["vx", "vy", "vz"], Kind::Position, Values::Any),
            surface::AMBIENT,
            surface::DIFFUSE,
            surface::MIRROR,
        ],
    );

    fn read(numbers: &mut Numbers<'_>) -> Result<Self, Faults> {
        let corners = [numbers.vector(), numbers.vector()];
        Ok(Self::new(corners, Material::read(numbers)?)?)
    }

    fn write(&self, line: &mut Line<'_, '_>) -> fmt::Result {
        self.corners.iter().try_for_each(|corner| line.vector(*corner))?;
        self.material.write(line)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_is_finite() {
        for bad in [DVec3::NAN, DVec3::INFINITY] {
            let cuboid = Cuboid::new([bad, DVec3::X], Material::default());
            assert_eq!(cuboid, Err(InvalidValue::NotFinite(Parameter::Corner)));
        }
    }

    #[test]
    fn corners_of_a_box_come_in_any_order() {
        let cuboid =
            Cuboid::new([DVec3::new(1.0, -2.0, 3.0), DVec3::new(-1.0, 2.0, 3.0)], Material::default());
        let cuboid = cuboid.unwrap();
        assert_eq!((cuboid.min(), cuboid.max()), (DVec3::new(-1.0, -2.0, 3.0), DVec3::new(1.0, 2.0, 3.0)));
    }
}
