//! The exact extent of the tracer's objects in a direction: the support function of each shape.

use glam::DVec3;
use rayfold_scene::Object;

use crate::view::Bounds;

/// Returns the maximum of p·d over all points p of an object, or `None` if the object is unbounded.
pub(crate) fn reach(object: &Object, d: DVec3) -> Option<f64> {
    // The support of a disc of radius 1 perpendicular to an axis.
    let across = |axis: DVec3| {
        let axis = axis.normalize_or_zero();
        (d - d.dot(axis) * axis).length()
    };
    let furthest = |points: &[DVec3]| points.iter().map(|p| p.dot(d)).fold(f64::NEG_INFINITY, f64::max);
    Some(match object {
        Object::Sphere(sphere) => sphere.center().dot(d) + sphere.radius() * d.length(),
        Object::Triangle(triangle) => furthest(triangle.vertices()),
        Object::Cuboid(cuboid) => {
            let (min, max) = (cuboid.min(), cuboid.max());
            DVec3::select(d.cmpgt(DVec3::ZERO), max, min).dot(d)
        }
        Object::Plane(_) => return None,
        Object::Disc(disc) => disc.center().dot(d) + disc.radius() * across(disc.normal()),
        Object::Cylinder(cylinder) => {
            let [a, b] = cylinder.ends();
            furthest(&[a, b]) + cylinder.radius() * across(b - a)
        }
        Object::Cone(cone) => {
            let ([a, b], [at_a, at_b]) = (cone.ends(), cone.radii());
            let across = across(b - a);
            (a.dot(d) + at_a * across).max(b.dot(d) + at_b * across)
        }
        Object::Torus(torus) => {
            let ring = torus.radius() * across(torus.normal());
            torus.center().dot(d) + ring + torus.thickness() * d.length()
        }
        Object::Instance(instance) => {
            let placement = instance.placement();
            let own = reach(instance.object(), placement.rotation().transpose() * d)?;
            placement.translation().dot(d) + placement.scale() * own
        }
    })
}

/// Returns the box around some objects, or `None` if none of them is bounded.
pub(crate) fn bounds<'a>(objects: impl IntoIterator<Item = &'a Object>) -> Option<Bounds> {
    let of = |object: &Object| {
        let most = |d: DVec3| reach(object, d);
        let high = DVec3::new(most(DVec3::X)?, most(DVec3::Y)?, most(DVec3::Z)?);
        let low = -DVec3::new(most(DVec3::NEG_X)?, most(DVec3::NEG_Y)?, most(DVec3::NEG_Z)?);
        Some(Bounds { low, high })
    };
    objects.into_iter().filter_map(of).reduce(Bounds::with)
}

#[cfg(test)]
mod tests {
    use rayfold_scene::parse;
    use rayfold_tracer::probe::nearest_hits;
    use rayfold_tracer::{Precision, RenderOptions};

    use super::*;

    /// From all directions, the tracer's hits lie within the extent of each shape, and come close to it.
    #[test]
    fn what_is_hit_lies_within_reach() {
        let shapes = [
            "Sphere 0.7  0.1 0.2 -0.3",
            "Triangle -1 0 0  1 0.5 0  0 1 1",
            "Box -0.5 0 0.2  1 0.7 -0.4",
            "Disc 0.8  0.1 0.2 0.3  1 2 -0.5",
            "Cylinder 0.3  -0.6 0 0  0.5 0.9 0.2",
            "Cone 0.6 0.1  0 -0.4 0  0.3 0.8 -0.2",
            "Torus 0.7 0.2  0.1 0 0  0.2 1 0.3",
        ];
        for shape in shapes {
            for place in ["Use a", "Use a  0.3 -0.2 0.5  30 50 -70  1.5"] {
                let text =
                    format!("Screen 2 2\nMaterial m ambient 1 1 1\nGroup a\n{shape} m\nEnd\n{place}\nTrace");
                let scene =
                    parse("a", text.as_bytes(), &Default::default()).script.unwrap().frame(0).unwrap();
                for direction in [DVec3::Y, DVec3::NEG_Y, DVec3::X, DVec3::new(0.6, 0.0, -0.8)] {
                    let most = reach(&scene.objects[0], direction).unwrap();
                    let (right, up) = direction.any_orthonormal_pair();
                    let rays: Vec<_> = (0..200 * 200)
                        .map(|at| {
                            let (i, j) = (f64::from(at % 200) - 100.0, f64::from(at / 200) - 100.0);
                            (10.0 * direction + 0.025 * (i * right + j * up), -direction)
                        })
                        .collect();
                    let options = RenderOptions { precision: Precision::F64, ..RenderOptions::default() };
                    let hits = nearest_hits(&scene, &rays, &options).unwrap();
                    let seen = hits.iter().flatten().map(|hit| 10.0 - hit.distance);
                    let seen = seen.fold(f64::NEG_INFINITY, f64::max);
                    assert!(seen <= most + 1e-6 && seen > most - 0.06, "{shape} {place}: {seen} of {most}");
                }
            }
        }
    }
}
