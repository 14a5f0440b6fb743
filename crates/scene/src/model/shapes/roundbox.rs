//! Boxes along the axes with round edges and corners.

use std::fmt;

use glam::DVec3;

use super::{Cuboid, Motion, Object, Outline, Shape};
use crate::form::{Constraint, Field, Form, Kind, Line, Numbers, Scripted, Values};
use crate::model::invalid::{Faults, InvalidValue, Parameter, finite, not_negative};
use crate::model::material::Material;
use crate::model::surface;

/// An axis-aligned box whose edges and corners are round: all points within a radius of the box that is smaller by the
/// radius on each side. With a radius of 0 it becomes a [`Cuboid`] as an [`Object`].
#[derive(Clone, Debug, PartialEq)]
pub struct Roundbox {
    corners: [DVec3; 2],
    radius: f64,
    material: Material,
}

/// The rounding error of a side that is given by two coordinates, relative to the largest.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Returns half of the shortest side of a box.
fn most(corners: [DVec3; 2]) -> f64 {
    0.5 * (corners[1] - corners[0]).abs().min_element()
}

impl Roundbox {
    /// Makes a rounded box from two opposite corners of the box around it.
    ///
    /// # Errors
    /// Fails if the radius is negative or more than half of the shortest side, or a number is not finite. A radius may
    /// exceed half of it by a rounding error of the coordinates. So a side from .8 to 1 allows a radius of .1.
    pub fn new(corners: [DVec3; 2], radius: f64, material: Material) -> Result<Self, InvalidValue> {
        let made = Self::unchecked(corners, radius, material)?;
        let largest = corners[0].abs().max(corners[1].abs()).max_element();
        if radius > most(corners) + ROUNDING * largest {
            return Err(InvalidValue::TooRound(most(corners)));
        }
        Ok(made)
    }

    /// Makes one whose radius may exceed half of the shortest side.
    fn unchecked(corners: [DVec3; 2], radius: f64, material: Material) -> Result<Self, InvalidValue> {
        finite(Parameter::Corner, corners[0])?;
        finite(Parameter::Corner, corners[1])?;
        not_negative(Parameter::Radius, radius)?;
        Ok(Self { corners, radius, material })
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

    /// Returns the radius of the edges and corners, at most half of the shortest side.
    pub fn radius(&self) -> f64 {
        self.radius.min(most(self.corners))
    }

    /// Returns the material of the surface.
    pub fn material(&self) -> &Material {
        &self.material
    }
}

impl Shape for Roundbox {
    /// A side may be shorter than two radii because of rounding.
    fn moved(&self, motion: &impl Motion, material: Material) -> Result<Self, InvalidValue> {
        let corners = self.corners.map(|corner| motion.point(corner));
        Self::unchecked(corners, motion.length(self.radius), material)
    }

    fn support(&self, direction: DVec3) -> Option<f64> {
        let corner = DVec3::select(direction.cmpgt(DVec3::ZERO), self.max(), self.min());
        Some(corner.dot(direction) - self.radius() * (direction.abs().element_sum() - direction.length()))
    }

    fn outline(&self) -> Outline {
        Outline::Box { corners: [self.min(), self.max()], radius: self.radius() }
    }

    fn simpler(&self) -> Option<Object> {
        let cuboid = || Cuboid::new(self.corners, self.material.clone()).ok();
        if self.radius() == 0.0 { cuboid().map(Object::Cuboid) } else { None }
    }
}

impl Scripted for Roundbox {
    const FORM: Form = Form::new(
        "Roundbox",
        &[
            Field::new(Parameter::Corner, &["ux", "uy", "uz"], Kind::Position, Values::Any),
            Field::new(Parameter::Corner, &["vx", "vy", "vz"], Kind::Position, Values::Any),
            Field::new(Parameter::Radius, &["r"], Kind::Length, Values::NotNegative),
            surface::AMBIENT,
            surface::DIFFUSE,
            surface::MIRROR,
        ],
    )
    .with(&[Constraint::FitsTwice(2, 0, 1)]);

    fn read(numbers: &mut Numbers<'_>) -> Result<Self, Faults> {
        let (corners, radius) = ([numbers.vector(), numbers.vector()], numbers.number());
        Ok(Self::new(corners, radius, Material::read(numbers)?)?)
    }

    fn write(&self, line: &mut Line<'_, '_>) -> fmt::Result {
        self.corners.iter().try_for_each(|corner| line.vector(*corner))?;
        line.number(self.radius)?;
        self.material.write(line)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn roundbox(low: f64, high: DVec3, radius: f64) -> Result<Roundbox, InvalidValue> {
        Roundbox::new([high, DVec3::splat(low)], radius, Material::default())
    }

    #[test]
    fn a_radius_is_at_most_half_of_the_shortest_side() {
        let high = DVec3::new(3.0, 2.0, 4.0);
        assert_eq!(roundbox(0.0, high, 1.0).unwrap().radius(), 1.0);
        assert_eq!(roundbox(0.0, high, 1.01), Err(InvalidValue::TooRound(1.0)));
        assert_eq!(roundbox(0.0, high, -1.0), Err(InvalidValue::Negative(Parameter::Radius)));
        assert_eq!(roundbox(f64::NAN, high, 1.0), Err(InvalidValue::NotFinite(Parameter::Corner)));
        assert_eq!(roundbox(0.0, high, f64::NAN), Err(InvalidValue::NotFinite(Parameter::Radius)));
        // 1 - .8 is less than .2.
        let slight = roundbox(0.8, DVec3::ONE, 0.1).unwrap();
        assert!(slight.radius() < 0.1 && slight.radius() > 0.0999);
    }

    #[test]
    fn a_radius_of_0_makes_a_box() {
        let sharp = Object::from(roundbox(-1.0, DVec3::ONE, 0.0).unwrap());
        let cuboid = Cuboid::new([DVec3::ONE, DVec3::NEG_ONE], Material::default()).unwrap();
        assert_eq!(sharp, cuboid.into());
        // A box without thickness has room for no other.
        let flat = Object::from(roundbox(1.0, DVec3::new(3.0, 1.0, 4.0), 0.0).unwrap());
        assert!(matches!(flat, Object::Cuboid(_)));
        assert!(matches!(Object::from(roundbox(-1.0, DVec3::ONE, 0.5).unwrap()), Object::Roundbox(_)));
    }

    #[test]
    fn it_reaches_less_far_aslant() {
        let ball = roundbox(-1.0, DVec3::ONE, 1.0).unwrap();
        let aslant = DVec3::new(2.0, -1.0, 2.0);
        assert_eq!(ball.support(aslant), Some(3.0));
        assert_eq!(roundbox(-1.0, DVec3::ONE, 0.5).unwrap().support(aslant), Some(4.0));
        assert_eq!(roundbox(-1.0, DVec3::ONE, 0.5).unwrap().support(DVec3::NEG_Y), Some(1.0));
    }
}
