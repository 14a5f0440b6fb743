//! Objects, which rays can hit.
//!
//! Each shape has a file with its checking constructor and its syntax. This file only lists them; for a new shape,
//! the compiler reports the missing parts.

mod cone;
mod cuboid;
mod cylinder;
mod disc;
mod instance;
mod plane;
mod sphere;
mod torus;
mod triangle;

use std::fmt::{self, Formatter};

use glam::DVec3;

pub use cone::Cone;
pub use cuboid::Cuboid;
pub use cylinder::Cylinder;
pub use disc::Disc;
pub(crate) use instance::USE;
pub use instance::{Instance, Placement};
pub use plane::Plane;
pub use sphere::Sphere;
pub use torus::Torus;
pub use triangle::Triangle;

use super::invalid::{InvalidValue, Lint};
use super::material::Material;
use crate::form::write_line;

/// An object that a ray can hit.
#[expect(missing_docs, reason = "the types have the documentation")]
#[derive(Clone, Debug, PartialEq)]
pub enum Object {
    Sphere(Sphere),
    Triangle(Triangle),
    /// A box whose edges are parallel to the axes.
    Cuboid(Cuboid),
    /// An infinite plane.
    Plane(Plane),
    Disc(Disc),
    /// A cylinder that is closed at both ends.
    Cylinder(Cylinder),
    /// A closed cone or truncated cone.
    Cone(Cone),
    /// A ring (torus).
    Torus(Torus),
    /// An object of a group, as it is drawn.
    Instance(Instance),
}

impl Object {
    /// Returns the material of the surface.
    pub fn material(&self) -> &Material {
        match self {
            Self::Sphere(o) => o.material(),
            Self::Triangle(o) => o.material(),
            Self::Cuboid(o) => o.material(),
            Self::Plane(o) => o.material(),
            Self::Disc(o) => o.material(),
            Self::Cylinder(o) => o.material(),
            Self::Cone(o) => o.material(),
            Self::Torus(o) => o.material(),
            Self::Instance(o) => o.material(),
        }
    }

    /// Moves every position by `place`, which scales all distances by `scale` and keeps directions.
    ///
    /// # Errors
    /// Fails if a number overflows or a length vanishes.
    pub fn placed(&self, scale: f64, place: impl Fn(DVec3) -> DVec3) -> Result<Self, InvalidValue> {
        match self {
            Self::Sphere(o) => o.placed(scale, place).map(Self::from),
            Self::Triangle(o) => o.placed(place).map(Self::from),
            Self::Cuboid(o) => o.placed(place).map(Self::from),
            Self::Plane(o) => o.placed(place).map(Self::Plane),
            Self::Disc(o) => o.placed(scale, place).map(Self::Disc),
            Self::Cylinder(o) => o.placed(scale, place).map(Self::Cylinder),
            Self::Cone(o) => o.placed(scale, place).map(Self::Cone),
            Self::Torus(o) => o.placed(scale, place).map(Self::Torus),
            Self::Instance(o) => o.placed(scale, place).map(Self::Instance),
        }
    }

    /// Returns a valid property that is probably a mistake.
    pub(crate) fn lint(&self) -> Option<Lint> {
        match self {
            Self::Triangle(o) => o.is_degenerate().then_some(Lint::DegenerateTriangle),
            Self::Sphere(_)
            | Self::Cuboid(_)
            | Self::Plane(_)
            | Self::Disc(_)
            | Self::Cylinder(_)
            | Self::Cone(_)
            | Self::Torus(_)
            | Self::Instance(_) => None,
        }
    }

    /// Writes a line of a script. `surface` is the name of its material, if it has one.
    pub(crate) fn write(&self, f: &mut Formatter<'_>, surface: Option<&str>) -> fmt::Result {
        match self {
            Self::Sphere(o) => write_line(f, o, surface),
            Self::Triangle(o) => write_line(f, o, surface),
            Self::Cuboid(o) => write_line(f, o, surface),
            Self::Plane(o) => write_line(f, o, surface),
            Self::Disc(o) => write_line(f, o, surface),
            Self::Cylinder(o) => write_line(f, o, surface),
            Self::Cone(o) => write_line(f, o, surface),
            Self::Torus(o) => write_line(f, o, surface),
            // An object of a group is written with its group.
            Self::Instance(_) => Err(fmt::Error),
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

impl From<Plane> for Object {
    fn from(plane: Plane) -> Self {
        Self::Plane(plane)
    }
}

impl From<Disc> for Object {
    fn from(disc: Disc) -> Self {
        Self::Disc(disc)
    }
}

impl From<Cylinder> for Object {
    fn from(cylinder: Cylinder) -> Self {
        Self::Cylinder(cylinder)
    }
}

impl From<Cone> for Object {
    fn from(cone: Cone) -> Self {
        Self::Cone(cone)
    }
}

impl From<Torus> for Object {
    fn from(torus: Torus) -> Self {
        Self::Torus(torus)
    }
}

impl From<Instance> for Object {
    fn from(instance: Instance) -> Self {
        Self::Instance(instance)
    }
}
