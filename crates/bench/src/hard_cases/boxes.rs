//! Rays along the faces of boxes, and boxes without thickness. These are decided without rounding, so the answer must
//! be exact.

use anyhow::Result;
use glam::DVec3;
use rayfold_scene::{Cuboid, Material, Object};

use super::figures::{Figures, Size};
use super::setup::{from_eyes, truths};
use crate::backends::{Backend, Ray};

fn cuboid(corners: [DVec3; 2]) -> Result<Object> {
    Ok(Object::Cuboid(Cuboid::new(corners, Material::default())?))
}

/// Returns rays along each axis and rays askew in the plane of two axes. Their coordinates on the other axes are
/// outside the box, on a face, and inside; zero components have both signs.
fn along_faces(corners: [DVec3; 2]) -> Vec<Ray> {
    let mut rays = Vec::new();
    for axis in 0..3 {
        let places = |axis: usize| {
            let (min, max) = (corners[0][axis], corners[1][axis]);
            let next = f64::from(f32::EPSILON) * 4.0;
            [min - next, min, 0.5 * (min + max), max, max + next, max + 1.0]
        };
        for &p in &places((axis + 1) % 3) {
            for &q in &places((axis + 2) % 3) {
                for from in
                    [corners[0][axis] - 4.0, corners[1][axis] + 4.0, 0.5 * (corners[0] + corners[1])[axis]]
                {
                    let mut origin = DVec3::ZERO;
                    origin[axis] = from;
                    origin[(axis + 1) % 3] = p;
                    origin[(axis + 2) % 3] = q;
                    for zeros in [[0.0, 0.0], [0.0, -0.0], [-0.0, 0.0], [-0.0, -0.0]] {
                        for forwards in [1.0, -1.0] {
                            let mut towards = DVec3::ZERO;
                            towards[axis] = forwards;
                            towards[(axis + 1) % 3] = zeros[0];
                            towards[(axis + 2) % 3] = zeros[1];
                            rays.push(Ray { origin, direction: towards });
                            towards[(axis + 1) % 3] = 0.75;
                            rays.push(Ray { origin, direction: towards });
                        }
                    }
                }
            }
        }
    }
    rays
}

fn wrong(backends: &[Backend], boxes: &[[DVec3; 2]], figures: &mut Figures) -> Result<()> {
    for backend in backends {
        let (mut decisions, mut normals, mut distance, mut count) = (0, 0, 0f64, 0);
        for &corners in boxes {
            let object = cuboid(corners)?;
            let rays = along_faces(corners);
            let truths = truths(std::slice::from_ref(&object), &rays);
            for ((ray, truth), hit) in rays.iter().zip(truths).zip(from_eyes(backend, object.clone(), &rays)?)
            {
                count += 1;
                match (truth, hit) {
                    (Some(truth), Some(hit)) => {
                        let ulps = (hit.t - truth.t).abs() / backend.ulp(truth.t);
                        distance = distance.max(ulps);
                        // On an edge the normal of either face is right.
                        let faces = hit.normal.abs().max_element() == 1.0 && hit.normal.length() == 1.0;
                        let point = ray.origin + truth.t * ray.direction;
                        let on = |p: DVec3| (p - corners[0]).abs().min((p - corners[1]).abs());
                        let touched = on(point).to_array().iter().filter(|&&d| d < 1e-5).count();
                        let right = faces && (touched > 1 || hit.normal == truth.normal);
                        normals += usize::from(!right);
                    }
                    (None, None) => {}
                    _ => decisions += 1,
                }
            }
        }
        figures.add(backend, "wrong hits and misses", count, decisions as f64, 0.0);
        figures.add(backend, "wrong normals", count, normals as f64, 0.0);
        figures.add(backend, "t, ulp", count, distance, 4.0);
    }
    Ok(())
}

/// Measures rays parallel to one or two pairs of faces: outside, on and between them.
pub(super) fn parallel(backends: &[Backend], _: Size, figures: &mut Figures) -> Result<()> {
    let boxes =
        [[DVec3::splat(-1.0), DVec3::splat(1.0)], [DVec3::new(0.0, 1.0, -8.0), DVec3::new(2.0, 1.5, -0.5)]];
    wrong(backends, &boxes, figures)
}

/// Measures rays along the faces of boxes that are a rectangle, a segment or a point.
pub(super) fn flat(backends: &[Backend], _: Size, figures: &mut Figures) -> Result<()> {
    let mut boxes = Vec::new();
    for axis in 0..3 {
        let mut upper = DVec3::new(1.0, 2.0, 3.0);
        upper[axis] = -1.0;
        boxes.push([DVec3::splat(-1.0), upper]);
        let mut segment = DVec3::splat(-1.0);
        segment[axis] = 2.0;
        boxes.push([DVec3::splat(-1.0), segment]);
    }
    boxes.push([DVec3::splat(0.5); 2]);
    wrong(backends, &boxes, figures)
}
