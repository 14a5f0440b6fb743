//! Objects: what a ray can hit, and how it answers light.

use glam::{DVec2, DVec3, Vec3Swizzles};

use super::invalid::{InvalidValue, Parameter, finite, positive};
use super::to_unit_scale;

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
            Self::Sphere(o) => &o.material,
            Self::Triangle(o) => &o.material,
            Self::Cuboid(o) => &o.material,
        }
    }
}

/// A sphere of positive radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    radius: f64,
    center: DVec3,
    material: Material,
}

impl Sphere {
    /// # Errors
    /// When the radius is not positive or a number is not finite.
    pub fn new(radius: f64, center: DVec3, material: Material) -> Result<Self, InvalidValue> {
        positive(Parameter::Radius, radius)?;
        finite(Parameter::Center, center)?;
        Ok(Self { radius, center, material })
    }

    /// Greater than zero.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Its middle.
    pub fn center(&self) -> DVec3 {
        self.center
    }

    /// How its surface answers light.
    pub fn material(&self) -> &Material {
        &self.material
    }
}

/// A two-sided triangle; one of no area is allowed and never hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    vertices: [DVec3; 3],
    material: Material,
}

impl Triangle {
    /// # Errors
    /// When a number is not finite or the material mirrors.
    pub fn new(vertices: [DVec3; 3], material: Material) -> Result<Self, InvalidValue> {
        finite(Parameter::Vertex, vertices[0])?;
        finite(Parameter::Vertex, vertices[1])?;
        finite(Parameter::Vertex, vertices[2])?;
        matte(&material)?;
        Ok(Self { vertices, material })
    }

    /// Whether it has no area: its vertices lie on a line or coincide, decided exactly.
    pub fn is_degenerate(&self) -> bool {
        let [u, v, w] = self.vertices;
        // Each axis gets a power of two of its own, which keeps points on a line on a line, so that the products of
        // the predicate neither overflow nor vanish.
        let scale = u.abs().max(v.abs()).max(w.abs()).map(to_unit_scale);
        let [u, v, w] = [u, v, w].map(|p| p * scale);
        let area = |x: fn(DVec3) -> DVec2| {
            let [a, b, c] = [x(u), x(v), x(w)].map(|p| robust::Coord { x: p.x, y: p.y });
            robust::orient2d(a, b, c)
        };
        area(|p| p.truncate()) == 0.0 && area(|p| p.zy()) == 0.0 && area(|p| p.xz()) == 0.0
    }

    /// u, v, w in the order of the script.
    pub fn vertices(&self) -> &[DVec3; 3] {
        &self.vertices
    }

    /// How its surface answers light.
    pub fn material(&self) -> &Material {
        &self.material
    }
}

/// An axis-aligned box, closed: its faces, edges and corners belong to it. One without thickness is a rectangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cuboid {
    corners: [DVec3; 2],
    material: Material,
}

impl Cuboid {
    /// From any two opposite corners.
    ///
    /// # Errors
    /// When a number is not finite or the material mirrors.
    pub fn new(corners: [DVec3; 2], material: Material) -> Result<Self, InvalidValue> {
        finite(Parameter::Corner, corners[0])?;
        finite(Parameter::Corner, corners[1])?;
        matte(&material)?;
        Ok(Self { corners, material })
    }

    /// The two corners as the script gave them.
    pub fn corners(&self) -> &[DVec3; 2] {
        &self.corners
    }

    /// The corner with the smallest coordinates.
    pub fn min(&self) -> DVec3 {
        self.corners[0].min(self.corners[1])
    }

    /// The corner with the largest coordinates.
    pub fn max(&self) -> DVec3 {
        self.corners[0].max(self.corners[1])
    }

    /// How its surface answers light.
    pub fn material(&self) -> &Material {
        &self.material
    }
}

/// Coefficients of a surface, a channel each; any finite numbers.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Material {
    ambient: DVec3,
    diffuse: DVec3,
    mirror: DVec3,
}

impl Material {
    /// # Errors
    /// When a number is not finite.
    pub fn new(ambient: DVec3, diffuse: DVec3, mirror: DVec3) -> Result<Self, InvalidValue> {
        finite(Parameter::Ambient, ambient)?;
        finite(Parameter::Diffuse, diffuse)?;
        finite(Parameter::Mirror, mirror)?;
        Ok(Self { ambient, diffuse, mirror })
    }

    /// The colour that needs no light.
    pub fn ambient(&self) -> DVec3 {
        self.ambient
    }

    /// What is scattered of the light that arrives (Lambert).
    pub fn diffuse(&self) -> DVec3 {
        self.diffuse
    }

    /// What is mirrored of the colour along the reflected ray.
    pub fn mirror(&self) -> DVec3 {
        self.mirror
    }
}

fn matte(material: &Material) -> Result<(), InvalidValue> {
    if material.mirror == DVec3::ZERO { Ok(()) } else { Err(InvalidValue::MirrorOnFlat) }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

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
    fn only_spheres_mirror() {
        let mirror = Material::new(DVec3::ZERO, DVec3::ZERO, DVec3::Z).unwrap();
        assert!(Sphere::new(1.0, DVec3::ZERO, mirror).is_ok());
        assert_eq!(Triangle::new([DVec3::ZERO; 3], mirror), Err(InvalidValue::MirrorOnFlat));
        assert_eq!(Cuboid::new([DVec3::ZERO; 2], mirror), Err(InvalidValue::MirrorOnFlat));
    }

    #[test]
    fn every_number_is_finite() {
        let matte = Material::default();
        for bad in [DVec3::NAN, DVec3::INFINITY] {
            let fault = |parameter| InvalidValue::NotFinite(parameter);
            assert_eq!(Sphere::new(1.0, bad, matte), Err(fault(Parameter::Center)));
            assert_eq!(Triangle::new([DVec3::ZERO, DVec3::X, bad], matte), Err(fault(Parameter::Vertex)));
            assert_eq!(Cuboid::new([bad, DVec3::X], matte), Err(fault(Parameter::Corner)));
            assert_eq!(Material::new(bad, DVec3::X, DVec3::X), Err(fault(Parameter::Ambient)));
            assert_eq!(Material::new(DVec3::X, bad, DVec3::X), Err(fault(Parameter::Diffuse)));
            assert_eq!(Material::new(DVec3::X, DVec3::X, bad), Err(fault(Parameter::Mirror)));
        }
    }

    #[test]
    fn corners_of_a_box_come_in_any_order() {
        let cuboid =
            Cuboid::new([DVec3::new(1.0, -2.0, 3.0), DVec3::new(-1.0, 2.0, 3.0)], Material::default());
        let cuboid = cuboid.unwrap();
        assert_eq!((cuboid.min(), cuboid.max()), (DVec3::new(-1.0, -2.0, 3.0), DVec3::new(1.0, 2.0, 3.0)));
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
