//! Objects, which rays can hit.
//!
//! Each shape has a file with its checking constructor, its extent, its outline and its syntax. A new shape needs a file,
//! and here its `mod` and a line in `with_shapes`. A parameter that no other shape has is added to `Parameter`.

mod capsule;
mod cone;
mod cuboid;
mod cylinder;
mod disc;
mod instance;
mod mesh;
mod outline;
mod plane;
mod roundbox;
mod sphere;
mod torus;
mod triangle;

use std::fmt::{self, Formatter};

use glam::DVec3;

pub(crate) use instance::USE;
pub use instance::{Instance, Placement};
pub(crate) use mesh::{FLAT, FONT, MESH, TEXT, align_from_word, letter_plate, letter_surface, mesh_surface};
pub use mesh::{Mesh, Source};
pub use outline::Outline;

use super::invalid::{InvalidValue, Lint};
use super::material::Material;
use crate::form::write_line;

/// Passes the list of the shapes to a macro, after some other tokens: the file, the type and a summary of each. The
/// type's name is also that of its command. The order is that of the documentation.
macro_rules! with_shapes {
    ($callback:ident! { $($before:tt)* }) => {
        $callback! {
            $($before)*
            shapes {
                sphere::Sphere: "A sphere.";
                triangle::Triangle: "A triangle.";
                cuboid::Cuboid: "A box along the axes.";
                plane::Plane: "An infinite plane.";
                disc::Disc: "A flat, round disc.";
                cylinder::Cylinder: "A closed cylinder.";
                cone::Cone: "A closed cone or truncated cone.";
                torus::Torus: "A ring (torus).";
                capsule::Capsule: "A cylinder with round ends.";
                roundbox::Roundbox: "A box with round edges.";
            }
        }
    };
}
pub(crate) use with_shapes;

/// The properties of a shape that every kind of object has.
trait Shape: Sized {
    /// Moves the shape, and gives it a material.
    fn moved(&self, motion: &impl Motion, material: Material) -> Result<Self, InvalidValue>;

    /// Returns the maximum of p·`direction` over all points p, or `None` if the shape is unbounded.
    fn support(&self, direction: DVec3) -> Option<f64>;

    /// Returns a simple solid that encloses it closely.
    fn outline(&self) -> Outline;

    /// Returns a valid property that is probably a mistake.
    fn lint(&self) -> Option<Lint> {
        None
    }

    /// Returns the object of another shape with the same points, if there is one that is simpler.
    fn simpler(&self) -> Option<Object> {
        None
    }
}

/// Defines [`Object`], with a variant for each shape and one for instances.
macro_rules! objects {
    (shapes { $($module:ident::$Shape:ident: $summary:literal;)* }) => {
        $(pub use $module::$Shape;)*

        /// An object that a ray can hit.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Object {
            $(#[doc = $summary] $Shape($Shape),)*
            /// An object of a group, as it is drawn.
            Instance(Instance),
            /// The triangles of a model, or of letters.
            Mesh(Mesh),
        }

        $(impl From<$Shape> for Object {
            fn from(shape: $Shape) -> Self {
                shape.simpler().unwrap_or(Self::$Shape(shape))
            }
        })*

        impl From<Instance> for Object {
            fn from(instance: Instance) -> Self {
                Self::Instance(instance)
            }
        }

        impl From<Mesh> for Object {
            fn from(mesh: Mesh) -> Self {
                Self::Mesh(mesh)
            }
        }

        impl Object {
            /// Returns the material of the surface.
            pub fn material(&self) -> &Material {
                match self {
                    $(Self::$Shape(shape) => shape.material(),)*
                    Self::Instance(instance) => instance.material(),
                    Self::Mesh(mesh) => mesh.material(),
                }
            }

            /// Moves the object, and gives it a material. An instance keeps its own.
            ///
            /// # Errors
            /// Fails if a number overflows or a length vanishes.
            pub fn moved(&self, motion: &impl Motion, material: Material) -> Result<Self, InvalidValue> {
                match self {
                    $(Self::$Shape(shape) => shape.moved(motion, material).map(Self::from),)*
                    Self::Instance(instance) => instance.moved(motion).map(Self::Instance),
                    Self::Mesh(mesh) => mesh.moved(motion, material).map(Self::Mesh),
                }
            }

            /// Returns the maximum of p·`direction` over all points p of the object (its support function), or `None` if
            /// the object is unbounded.
            pub fn support(&self, direction: DVec3) -> Option<f64> {
                match self {
                    $(Self::$Shape(shape) => shape.support(direction),)*
                    Self::Instance(instance) => instance.support(direction),
                    Self::Mesh(mesh) => mesh.support(direction),
                }
            }

            /// Returns a simple solid that encloses the object closely; `None` for an object of a group and for a
            /// model.
            pub fn outline(&self) -> Option<Outline> {
                match self {
                    $(Self::$Shape(shape) => Some(shape.outline()),)*
                    Self::Instance(_) | Self::Mesh(_) => None,
                }
            }

            /// Returns a valid property that is probably a mistake.
            pub(crate) fn lint(&self) -> Option<Lint> {
                match self {
                    $(Self::$Shape(shape) => shape.lint(),)*
                    Self::Instance(_) | Self::Mesh(_) => None,
                }
            }

            /// Writes a line of a script. `surface` is the name of its material, if it has one.
            pub(crate) fn write(&self, f: &mut Formatter<'_>, surface: Option<&str>) -> fmt::Result {
                match self {
                    $(Self::$Shape(shape) => write_line(f, shape, surface),)*
                    // An object of a group is written with its group.
                    Self::Instance(_) => Err(fmt::Error),
                    Self::Mesh(mesh) => mesh.write(f, surface),
                }
            }
        }
    };
}

with_shapes! { objects! {} }

impl Object {
    /// Moves every position by `place`, which scales all distances by `scale` and keeps directions.
    ///
    /// # Errors
    /// Fails if a number overflows or a length vanishes.
    pub fn placed(&self, scale: f64, place: impl Fn(DVec3) -> DVec3) -> Result<Self, InvalidValue> {
        self.moved(&Shift { scale, place }, self.material().clone())
    }

    /// Gives the object a material. An instance keeps its own.
    ///
    /// # Errors
    /// Cannot fail for an object that could be made.
    pub fn with_material(&self, material: Material) -> Result<Self, InvalidValue> {
        if let Self::Mesh(mesh) = self {
            return Ok(mesh.with_material(material).into());
        }
        self.moved(&Shift { scale: 1.0, place: |position| position }, material)
    }

    /// Returns the lowest and the highest corner of the box around the object, or `None` if it is unbounded.
    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        if let Self::Mesh(mesh) = self {
            return Some(mesh.model().bounds());
        }
        let corner = |sign: f64| {
            let [x, y, z] = DVec3::AXES.map(|axis| self.support(sign * axis));
            Some(sign * DVec3::new(x?, y?, z?))
        };
        Some([corner(-1.0)?, corner(1.0)?])
    }
}

/// A motion of space that keeps angles. A result that cannot be represented is NaN, which no shape accepts.
pub trait Motion {
    /// Returns the moved position.
    fn point(&self, position: DVec3) -> DVec3;

    /// Returns the rotated direction, of the same length.
    fn direction(&self, direction: DVec3) -> DVec3;

    /// Returns the scaled length.
    fn length(&self, length: f64) -> f64;
}

/// Group coordinates to world coordinates.
impl Motion for Placement {
    fn point(&self, position: DVec3) -> DVec3 {
        Self::point(self, position)
    }

    fn direction(&self, direction: DVec3) -> DVec3 {
        self.rotation() * direction
    }

    fn length(&self, length: f64) -> f64 {
        self.scale() * length
    }
}

/// A motion without rotation.
struct Shift<F> {
    scale: f64,
    place: F,
}

impl<F: Fn(DVec3) -> DVec3> Motion for Shift<F> {
    fn point(&self, position: DVec3) -> DVec3 {
        (self.place)(position)
    }

    fn direction(&self, direction: DVec3) -> DVec3 {
        direction
    }

    fn length(&self, length: f64) -> f64 {
        self.scale * length
    }
}
