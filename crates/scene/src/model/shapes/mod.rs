//! Objects: what a ray can hit.
//!
//! A shape is a file: its checked constructor, and how a script writes it. Here stands only which there are; the
//! compiler lists what a new one lacks.

mod cuboid;
mod sphere;
mod triangle;

use std::fmt::{self, Formatter};

use glam::DVec3;

pub use cuboid::Cuboid;
pub use sphere::Sphere;
pub use triangle::Triangle;

use super::invalid::{Doubt, InvalidValue};
use super::material::Material;
use crate::form::write_line;

/// Something that a ray can hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Object {
    /// A sphere.
    Sphere(Sphere),
    /// A triangle.
    Triangle(Triangle),
    /// An axis-aligned box.
    Cuboid(Cuboid),
}

impl Object {
    /// How its surface answers light.
    pub fn material(&self) -> &Material {
        match self {
            Self::Sphere(o) => o.material(),
            Self::Triangle(o) => o.material(),
            Self::Cuboid(o) => o.material(),
        }
    }

    /// The same with every position moved by `place`, which scales all distances by `scale` and keeps directions.
    ///
    /// # Errors
    /// When a number leaves the range of those that are finite, or a length vanishes.
    pub fn placed(&self, scale: f64, place: impl Fn(DVec3) -> DVec3) -> Result<Self, InvalidValue> {
        match self {
            Self::Sphere(o) => o.placed(scale, place).map(Self::from),
            Self::Triangle(o) => o.placed(place).map(Self::from),
            Self::Cuboid(o) => o.placed(place).map(Self::from),
        }
    }

    /// What is hardly meant about it.
    pub(crate) fn doubt(&self) -> Option<Doubt> {
        match self {
            Self::Triangle(o) => o.is_degenerate().then_some(Doubt::DegenerateTriangle),
            Self::Sphere(_) | Self::Cuboid(_) => None,
        }
    }

    /// As a line of a script.
    pub(crate) fn write(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sphere(o) => write_line(f, o),
            Self::Triangle(o) => write_line(f, o),
            Self::Cuboid(o) => write_line(f, o),
        }
    }
}

impl From<Sphere> for Object {
    fn from(sphere: Sphere) -> Self {
        Self::Sphere(sphere)
    }
}

impl From<Triangle> for Object {
    fn from(triangle: Triangle) -> Self {
        Self::Triangle(triangle)
    }
}

impl From<Cuboid> for Object {
    fn from(cuboid: Cuboid) -> Self {
        Self::Cuboid(cuboid)
    }
}
