//! Triangles.

use std::fmt;

use glam::{DVec2, DVec3, Vec3Swizzles};

use super::{Motion, Outline, Shape};
use crate::form::{Field, Form, Kind, Line, Numbers, Scripted, Values};
use crate::model::invalid::{Faults, InvalidValue, Lint, Parameter, finite};
use crate::model::material::Material;
use crate::model::surface;
use crate::model::vector::{furthest, to_unit_scale};

/// A two-sided triangle. One without area is allowed and never hit.
#[derive(Clone, Debug, PartialEq)]
pub struct Triangle {
    vertices: [DVec3; 3],
    material: Material,
}

impl Triangle {
    /// Makes a triangle.
    ///
    /// # Errors
    /// Fails if a number is not finite.
    pub fn new(vertices: [DVec3; 3], material: Material) -> Result<Self, InvalidValue> {
        finite(Parameter::Vertex, vertices[0])?;
        finite(Parameter::Vertex, vertices[1])?;
        finite(Parameter::Vertex, vertices[2])?;
        Ok(Self { vertices, material })
    }

    /// Returns whether the triangle has no area, that is, its vertices are collinear or coincide. The test is exact.
    pub fn is_degenerate(&self) -> bool {
        let [u, v, w] = self.vertices;
        // Each axis is scaled by its own power of two, which keeps collinear points collinear, so that the products
        // of the predicate neither overflow nor underflow.
        let scale = u.abs().max(v.abs()).max(w.abs()).map(to_unit_scale);
        let [u, v, w] = [u, v, w].map(|p| p * scale);
        let area = |x: fn(DVec3) -> DVec2| {
            let [a, b, c] = [x(u), x(v), x(w)].map(|p| robust::Coord { x: p.x, y: p.y });
            robust::orient2d(a, b, c)
        };
        area(|p| p.truncate()) == 0.0 && area(|p| p.zy()) == 0.0 && area(|p| p.xz()) == 0.0
    }

    /// Returns u, v, w in the order of the script.
    pub fn vertices(&self) -> &[DVec3; 3] {
        &self.vertices
    }

    /// Returns the material of the surface.
    pub fn material(&self) -> &Material {
        &self.material
    }
}

impl Shape for Triangle {
    fn moved(&self, motion: &impl Motion, material: Material) -> Result<Self, InvalidValue> {
        Self::new(self.vertices.map(|vertex| motion.point(vertex)), material)
    }

    fn support(&self, direction: DVec3) -> Option<f64> {
        Some(furthest(&self.vertices, direction))
    }

    fn outline(&self) -> Outline {
        Outline::Triangle(self.vertices)
    }

    fn lint(&self) -> Option<Lint> {
        self.is_degenerate().then_some(Lint::DegenerateTriangle)
    }
}

impl Scripted for Triangle {
    const FORM: Form = Form::new(
        "Triangle",
        &[
            Field::new(Parameter::Vertex, &["ux", "uy", "uz"], Kind::Position, Values::Any),
            Field::new(Parameter::Vertex, &["vx", "vy", "vz"], Kind::Position, Values::Any),
            Field::new(Parameter::Vertex, &["wx", "wy", "wz"], Kind::Position, Values::Any),
            surface::AMBIENT,
            surface::DIFFUSE,
            surface::MIRROR,
        ],
    );

    fn read(numbers: &mut Numbers<'_>) -> Result<Self, Faults> {
        let vertices = [numbers.vector(), numbers.vector(), numbers.vector()];
        Ok(Self::new(vertices, Material::read(numbers)?)?)
    }

    fn write(&self, line: &mut Line<'_, '_>) -> fmt::Result {
        self.vertices.iter().try_for_each(|vertex| line.vector(*vertex))?;
        self.material.write(line)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_triangle_is_finite() {
        for bad in [DVec3::NAN, DVec3::INFINITY] {
            let triangle = Triangle::new([DVec3::ZERO, DVec3::X, bad], Material::default());
            assert_eq!(triangle, Err(InvalidValue::NotFinite(Parameter::Vertex)));
        }
    }

    fn is_flat(u: [f64; 3], v: [f64; 3], w: [f64; 3]) -> bool {
        Triangle::new([u, v, w].map(DVec3::from), Material::default()).unwrap().is_degenerate()
    }

    #[test]
    fn no_area_is_decided_exactly() {
        assert!(is_flat([1.0, 2.0, 3.0], [1.0, 2.0, 3.0], [4.0, 5.0, 6.0]), "two corners coincide");
        assert!(is_flat([0.0, 0.0, 0.0], [1.0, 2.0, 3.0], [3.0, 6.0, 9.0]), "a line through the origin");
        assert!(is_flat([1e9, 0.0, 7.0], [1e9 + 0.5, 0.5, 7.0], [1e9 + 8.0, 8.0, 7.0]), "a line far away");
        let hair = 1.0 + f64::EPSILON;
        assert!(!is_flat([0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [1.0, 1.0, hair]), "one bit off the line");
        assert!(!is_flat([1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.0, 5e-324]), "the narrowest of triangles");
    }

    proptest! {
        #[test]
        fn scale_does_not_matter(
            u in [-9..=9i32, -9..=9, -9..=9], v in [-9..=9i32, -9..=9, -9..=9], w in [-9..=9i32, -9..=9, -9..=9],
            exponent in -1000..=1000i32,
        ) {
            let (p, q) = ([0, 1, 2].map(|i| v[i] - u[i]), [0, 1, 2].map(|i| w[i] - u[i]));
            let flat = (0..3).all(|i| p[i] * q[(i + 1) % 3] == p[(i + 1) % 3] * q[i]);
            let scaled = |x: [i32; 3]| x.map(|x| f64::from(x) * 2f64.powi(exponent));
            prop_assert_eq!(is_flat(scaled(u), scaled(v), scaled(w)), flat);
        }
    }
}
