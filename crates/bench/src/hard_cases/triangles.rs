//! Edges, vertices, needles, and triangles seen edge-on.

use anyhow::Result;
use glam::DVec3;
use rayfold_scene::{Code, Limits, Material, Object, Triangle};
use rayon::prelude::*;

use super::figures::{Figures, Size, unless_single, worse};
use super::setup::{aimed, direction, objects_only, objects_seen, random, truths};
use crate::backends::{Arithmetic, Backend, Ray};
use crate::oracle::edge_clearance;
use crate::scenes::{icosphere, single};

fn triangle(vertices: [DVec3; 3]) -> Result<Object> {
    Ok(Object::Triangle(Triangle::new(vertices, Material::default())?))
}

/// The number of rays per batch, limited by memory.
const BATCH: usize = 1 << 16;

/// Returns a closed surface around the eye, with corners that are exact in all arithmetics.
fn shell(count: usize, rng: &mut fastrand::Rng) -> Result<(Vec<[DVec3; 3]>, Vec<Object>)> {
    let offset = DVec3::new(rng.f64(), rng.f64(), rng.f64()) * 4.0;
    let faces: Vec<_> =
        icosphere(count).into_iter().map(|face| face.map(|p| single(3.0 * p + offset))).collect();
    let objects = faces.iter().map(|&face| triangle(face)).collect::<Result<_>>()?;
    Ok((faces, objects))
}

/// Counts the rays that escape from a closed surface. `target` returns a point of a face.
fn escapes(
    backends: &[Backend],
    (count, rays): (usize, usize),
    seed: u64,
    what: &str,
    figures: &mut Figures,
    target: impl Fn(&[DVec3; 3], &mut fastrand::Rng) -> DVec3 + Sync,
) -> Result<()> {
    let (faces, objects) = shell(count, &mut random(seed))?;
    let centre = faces.iter().flatten().sum::<DVec3>() / (3 * faces.len()) as f64;
    let scene = objects_seen(objects, single(centre), faces[0][0], 1.0)?;
    let escaped = in_batches(backends, rays, seed, |backend, rng, rays| {
        let batch: Vec<Ray> = (0..rays)
            .map(|_| aimed(centre + direction(rng), target(&faces[rng.usize(0..faces.len())], rng)))
            .collect();
        Ok(backend.nearest(&scene, &batch)?.iter().filter(|hit| hit.is_none()).count())
    })?;
    for (backend, (rays, escaped)) in backends.iter().zip(escaped) {
        figures.add(backend, format!("cracks in {} faces, {what}", faces.len()), rays, escaped as f64, 0.0);
    }
    Ok(())
}

/// The number of rays that every backend traces.
const BY_ALL: usize = 1_000_000;

/// Returns for each backend the number of rays that it traced, up to `total`, and the number that `wrong` counts. Runs
/// batch by batch on all cores. A batch has its own random numbers, the same for every backend.
///
/// The backend that draws pictures for users traces all rays. Backends that differ from it only in precision, vector
/// width or tiles stop after [`BY_ALL`].
fn in_batches(
    backends: &[Backend],
    total: usize,
    seed: u64,
    wrong: impl Fn(&Backend, &mut fastrand::Rng, usize) -> Result<usize> + Sync,
) -> Result<Vec<(usize, usize)>> {
    let chosen = backends.iter().position(|backend| backend.arithmetic == Arithmetic::Chosen);
    backends
        .iter()
        .enumerate()
        .map(|(k, backend)| {
            let total = if Some(k) == chosen { total } else { total.min(BY_ALL) };
            let wrong = (0..total.div_ceil(BATCH))
                .into_par_iter()
                .map(|batch| {
                    let mut rng = random(seed * 1_000_000 + batch as u64);
                    wrong(backend, &mut rng, BATCH.min(total - batch * BATCH))
                })
                .sum::<Result<usize>>()?;
            Ok((total, wrong))
        })
        .collect()
}

/// Measures rays from inside a closed surface towards its edges.
pub(super) fn shared_edges(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    for sizes in [(20, size.pick(40_000, 100_000_000)), (size.pick(320, 20_480), size.pick(8_000, 100_000))] {
        escapes(backends, sizes, 10, "towards edges", figures, |face, rng| {
            let k = rng.usize(0..3);
            face[k].lerp(face[(k + 1) % 3], rng.f64())
        })?;
    }
    Ok(())
}

/// Measures rays from inside a closed surface towards its corners.
pub(super) fn shared_vertices(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    for sizes in [(20, size.pick(20_000, 10_000_000)), (size.pick(320, 20_480), size.pick(4_000, 20_000))] {
        escapes(backends, sizes, 11, "towards corners", figures, |face, rng| face[rng.usize(0..3)])?;
    }
    Ok(())
}

/// Measures long thin triangles in any position: hits agree with the oracle's except within 4 ulp of an edge, distances
/// to 16 ulp.
pub(super) fn needles(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    let mut rng = random(12);
    let mut worst = vec![(0f64, 0f64, 0f64); backends.len()];
    let (needles, each) = (size.pick(40, 1000), size.pick(40, 200));
    for _ in 0..needles {
        let tip = direction(&mut rng);
        let along = direction(&mut rng);
        let across = direction(&mut rng).cross(along).normalize_or_zero() * 1e-6;
        let vertices = [tip, tip + along, tip + along + across].map(single);
        let needle = Triangle::new(vertices, Material::default())?;
        if needle.is_degenerate() {
            continue;
        }
        let objects = [Object::Triangle(needle.clone())];
        let eye = single(3.0 * direction(&mut rng));
        let scene = objects_seen(objects.to_vec(), eye, tip, 1e-3)?;
        let rays: Vec<Ray> = (0..each)
            .map(|_| aimed(eye, tip + rng.f64() * along + (rng.f64() * 1.4 - 0.2) * across))
            .collect();
        let truths = truths(&objects, &rays);
        for (backend, worst) in backends.iter().zip(&mut worst) {
            for ((ray, truth), hit) in rays.iter().zip(&truths).zip(backend.nearest(&scene, &rays)?) {
                let largest = vertices.iter().fold(0.0, |m: f64, v| m.max((*v - ray.origin).length()));
                match (truth, hit) {
                    (Some(truth), Some(hit)) => {
                        let off = (hit.t - truth.t).abs() / backend.ulp(truth.t);
                        let sine = truth.normal.dot(ray.direction).abs();
                        worst.1 = worse(worst.1, off);
                        worst.2 = worse(worst.2, off * sine);
                    }
                    (None, None) => {}
                    _ => {
                        let off = edge_clearance(&needle, ray.origin, ray.direction).unwrap_or(0.0);
                        worst.0 = worse(worst.0, off / backend.ulp(largest));
                    }
                }
            }
        }
    }
    for (backend, (edge, t, plane)) in backends.iter().zip(worst) {
        figures.add(
            backend,
            "wrong hit or miss off the edge, ulp",
            needles * each,
            edge,
            unless_single(backend, 4.0),
        );
        figures.add(backend, "t, ulp", needles * each, t, unless_single(backend, 16.0));
        // The distance of the hit from the true plane. The error of `t` is this, including the roundoff of a unit
        // normal, divided by the sine of the angle to the plane, which has no lower bound here.
        let off_plane = "t times the sine to the plane, ulp";
        figures.add(backend, off_plane, needles * each, plane, unless_single(backend, 16.0));
    }
    Ok(())
}

/// Checks triangles with collinear corners: the parser warns, and no ray hits them.
pub(super) fn degenerate(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    let mut rng = random(13);
    let mut flat: Vec<[DVec3; 3]> = vec![
        [DVec3::ZERO; 3],
        [DVec3::splat(0.1), DVec3::splat(0.2), DVec3::splat(0.3)].map(single),
        [DVec3::ZERO, DVec3::X, DVec3::X],
    ];
    for _ in 0..30 {
        let whole = |rng: &mut fastrand::Rng| {
            DVec3::from_array(std::array::from_fn(|_| f64::from(rng.i32(-999..999))))
        };
        let (start, step) = (whole(&mut rng), whole(&mut rng));
        flat.push([start, start + f64::from(rng.i32(1..9)) * step, start + f64::from(rng.i32(-9..0)) * step]);
    }
    let mut unreported = 0;
    for vertices in &flat {
        let [u, v, w] = vertices.map(|p| format!("{:?} {:?} {:?}", p.x, p.y, p.z));
        let text = format!("Screen 2 2\nTriangle {u} {v} {w} 0 0 0 1 1 1\nTrace");
        let parsed = rayfold_scene::parse("flat.txt", text.as_bytes(), &Limits::default());
        let reports = parsed.diagnostics.iter().filter(|d| d.code == Code::DegenerateTriangle);
        unreported += usize::from(parsed.script.is_none() || reports.count() != 1);
    }
    let mut sets = Vec::new();
    for vertices in &flat {
        let rays: Vec<Ray> = (0..size.pick(100, 20_000))
            .map(|_| {
                let on = vertices[0].lerp(vertices[1], rng.f64());
                let eye = on + (1.0 + 10.0 * rng.f64()) * direction(&mut rng);
                aimed(eye, on)
            })
            .collect();
        sets.push((objects_only(vec![triangle(*vertices)?])?, rays));
    }
    for backend in backends {
        let mut hits = 0;
        for (scene, rays) in &sets {
            hits += backend.nearest(scene, rays)?.iter().flatten().count();
        }
        let rays = sets.iter().map(|(_, rays)| rays.len()).sum();
        figures.add(backend, "hits", rays, hits as f64, 0.0);
        figures.add(backend, "not reported when read", flat.len(), unreported as f64, 0.0);
    }
    Ok(())
}

/// Measures rays that lie in the plane exactly, also after their direction is normalised: along axes and diagonals.
pub(super) fn in_plane(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    let mut rng = random(14);
    let mut sets = Vec::new();
    for axis in 0..3 {
        let (right, up) = (DVec3::AXES[(axis + 1) % 3], DVec3::AXES[(axis + 2) % 3]);
        let level = 0.375 * DVec3::AXES[axis];
        let square = [level, level + 2.0 * right, level + 2.0 * up];
        // The plane x + y + z = 3 contains the diagonals.
        let tilted = [DVec3::new(3.0, 0.0, 0.0), DVec3::new(0.0, 3.0, 0.0), DVec3::new(0.0, 0.0, 3.0)];
        let mut rays = [Vec::new(), Vec::new()];
        for _ in 0..size.pick(100, 10_000) {
            let (p, q) = (single(DVec3::splat(rng.f64())).x, single(DVec3::splat(rng.f64())).x);
            for sign in [1.0, -1.0] {
                let origin = level + p * right + q * up;
                let towards = [right, up, right + up, right - up, right + single(DVec3::splat(q)).x * up];
                rays[0].extend(towards.map(|d| Ray { origin: origin - 3.0 * d * sign, direction: d * sign }));
                let (a, b) = (f64::from(rng.i32(-5..6)), f64::from(rng.i32(-5..6)));
                let origin = DVec3::new(a, b, 3.0 - a - b);
                rays[1].push(Ray { origin, direction: (right - up) * sign });
            }
        }
        for (vertices, rays) in [square, tilted].into_iter().zip(rays) {
            let objects = vec![triangle(vertices)?];
            anyhow::ensure!(truths(&objects, &rays).iter().all(Option::is_none), "a ray out of the plane");
            sets.push((objects_only(objects)?, rays));
        }
    }
    for backend in backends {
        let mut hits = 0;
        for (scene, rays) in &sets {
            hits += backend.nearest(scene, rays)?.iter().flatten().count();
        }
        let rays = sets.iter().map(|(_, rays)| rays.len()).sum();
        figures.add(backend, "hits", rays, hits as f64, 0.0);
    }
    Ok(())
}

/// Compares the nearest hit among 1,000 triangles, found by a tree, with the nearest of 20 searches of 50 triangles
/// each, without a tree.
pub(super) fn tree_or_not(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    const EACH: usize = 50;
    let mut rng = random(17);
    let objects: Vec<Object> = (0..1000)
        .map(|_| {
            let spot = 4.0 * direction(&mut rng);
            let reach = 0.1 + rng.f64();
            triangle([(); 3].map(|()| single(spot + reach * direction(&mut rng))))
        })
        .collect::<Result<_>>()?;
    let scene = objects_only(objects.clone())?;
    let parts = objects.chunks(EACH).map(|part| objects_only(part.to_vec())).collect::<Result<Vec<_>>>()?;
    let different = in_batches(backends, size.pick(4000, 100_000_000), 17, |backend, rng, rays| {
        let rays: Vec<Ray> = (0..rays).map(|_| aimed(8.0 * direction(rng), 4.0 * direction(rng))).collect();
        let mut nearest: Vec<Option<(usize, f64)>> = vec![None; rays.len()];
        for (k, part) in parts.iter().enumerate() {
            for (best, hit) in nearest.iter_mut().zip(backend.nearest(part, &rays)?) {
                let hit = hit.map(|hit| (k * EACH + hit.object, hit.t));
                *best = match (*best, hit) {
                    (Some(best), Some(hit)) => Some(if hit.1 < best.1 { hit } else { best }),
                    (best, hit) => best.or(hit),
                };
            }
        }
        let down_the_tree = backend.nearest(&scene, &rays)?;
        let pairs = down_the_tree.iter().zip(&nearest);
        Ok(pairs.filter(|(a, b)| a.map(|a| a.object) != b.map(|b| b.0)).count())
    })?;
    for (backend, (rays, different)) in backends.iter().zip(different) {
        figures.add(backend, "another object than without a tree", rays, different as f64, 0.0);
    }
    Ok(())
}
