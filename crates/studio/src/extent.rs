//! The box around objects.

use rayfold_scene::Object;

use crate::view::Bounds;

/// Returns the box around some objects, or `None` if none of them is bounded.
pub(crate) fn bounds<'a>(objects: impl IntoIterator<Item = &'a Object>) -> Option<Bounds> {
    let of = |object: &Object| object.bounds().map(|[low, high]| Bounds { low, high });
    objects.into_iter().filter_map(of).reduce(Bounds::with)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use rayfold_scene::parse;
    use rayfold_tracer::probe::nearest_hits;
    use rayfold_tracer::{Precision, RenderOptions};

    /// From all directions, the tracer's hits lie within the extent of each shape, and come close to it.
    #[test]
    fn what_is_hit_lies_within_the_support() {
        let shapes = [
            "Sphere 0.7  0.1 0.2 -0.3",
            "Triangle -1 0 0  1 0.5 0  0 1 1",
            "Box -0.5 0 0.2  1 0.7 -0.4",
            "Disc 0.8  0.1 0.2 0.3  1 2 -0.5",
            "Cylinder 0.3  -0.6 0 0  0.5 0.9 0.2",
            "Cone 0.6 0.1  0 -0.4 0  0.3 0.8 -0.2",
            "Torus 0.7 0.2  0.1 0 0  0.2 1 0.3",
            "Capsule 0.3  -0.6 0 0  0.5 0.9 0.2",
            "Capsule 0.3  -0.6 0 0  -0.6 0 0",
            "Roundbox -0.5 0 0.2  1 0.7 -0.4  0.2",
        ];
        for shape in shapes {
            for place in ["Use a", "Use a  0.3 -0.2 0.5  30 50 -70  1.5"] {
                let text =
                    format!("Screen 2 2\nMaterial m ambient 1 1 1\nGroup a\n{shape} m\nEnd\n{place}\nTrace");
                let scene =
                    parse("a", text.as_bytes(), &Default::default()).script.unwrap().frame(0).unwrap();
                for direction in [DVec3::Y, DVec3::NEG_Y, DVec3::X, DVec3::new(0.6, 0.0, -0.8)] {
                    let most = scene.objects[0].support(direction).unwrap();
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
