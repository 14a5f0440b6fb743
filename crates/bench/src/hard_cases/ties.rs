//! Objects at the same distance.

use anyhow::Result;
use glam::DVec3;
use rayfold_scene::{Cuboid, Material, Object, Screen, Sphere, Triangle};

use super::figures::{Figures, Size};
use super::setup::{aimed, direction, objects_only, objects_seen, random};
use crate::backends::Backend;

/// Checks scenes in which each object appears several times, in mixed order: every hit is that of the first copy.
pub(super) fn identical(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    let mut rng = random(24);
    for copies in [2, 30] {
        let mut kinds = Vec::new();
        for k in 0..9 {
            let spot = 3.0 * direction(&mut rng);
            let surface = Material::default();
            let corner = |rng: &mut fastrand::Rng| spot + direction(rng);
            let vertices = [corner(&mut rng), corner(&mut rng), corner(&mut rng)];
            kinds.push(match k % 3 {
                0 => Object::Sphere(Sphere::new(0.8, spot, surface)?),
                1 => Object::Cuboid(Cuboid::new([spot - 0.7, spot + 0.7], surface)?),
                _ => Object::Triangle(Triangle::new(vertices, surface)?),
            });
        }
        let mut order: Vec<usize> = (0..kinds.len() * copies).map(|k| k % kinds.len()).collect();
        rng.shuffle(&mut order);
        let scene = objects_only(order.iter().map(|&kind| kinds[kind].clone()).collect())?;
        let rays: Vec<_> = (0..size.pick(4000, 1_000_000))
            .map(|_| aimed(7.0 * direction(&mut rng), 3.0 * direction(&mut rng)))
            .collect();
        let first = |object: usize| order.iter().position(|&kind| kind == order[object]);
        for backend in backends {
            let hits = backend.nearest(&scene, &rays)?;
            let late = hits.iter().flatten().filter(|hit| first(hit.object) != Some(hit.object)).count();
            figures.add(
                backend,
                format!("hits on a later copy, {} objects", order.len()),
                rays.len(),
                late as f64,
                0.0,
            );
            anyhow::ensure!(4 * hits.iter().flatten().count() > rays.len(), "too few rays meet anything");
        }
    }
    faces(backends, size, figures)?;
    pictures(backends, size, figures)
}

/// Checks pictures in which later copies are bright and first ones are dark. The number of threads must not matter.
fn pictures(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    let mut rng = random(241);
    let side = size.pick(70, 500);
    let mut scenes = Vec::new();
    for copies in [3, 6, 40] {
        let spots: Vec<DVec3> = (0..9).map(|_| 3.0 * direction(&mut rng)).collect();
        let mut order: Vec<usize> = (0..9 * copies).map(|k| k % 9).collect();
        rng.shuffle(&mut order);
        let objects: Result<Vec<_>> = order
            .iter()
            .enumerate()
            .map(|(at, &kind)| {
                let late = order[..at].contains(&kind);
                let shown = DVec3::splat(if late { 1.0 } else { 0.25 });
                let surface = Material::new(shown, DVec3::ZERO, DVec3::ZERO)?;
                let spot = spots[kind];
                Ok(match kind % 3 {
                    0 => Object::Sphere(Sphere::new(0.8, spot, surface)?),
                    1 => Object::Cuboid(Cuboid::new([spot - 0.7, spot + 0.7], surface)?),
                    _ => {
                        let vertices = [spot + DVec3::X, spot - DVec3::X, spot + DVec3::new(0.2, 1.0, 0.4)];
                        Object::Triangle(Triangle::new(vertices, surface)?)
                    }
                })
            })
            .collect();
        let mut scene = objects_seen(objects?, DVec3::new(0.5, 1.0, 8.0), DVec3::ZERO, 1.2)?;
        scene.screen = Screen::new(side, side)?;
        scenes.push(scene);
    }
    for threads in [1, 2, 5] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        for backend in backends {
            let (mut late, mut seen) = (0, 0);
            for scene in &scenes {
                let image = pool.install(|| backend.render(scene))?;
                late += image.pixels().filter(|pixel| pixel.0[0] > 64).count();
                seen += image.pixels().filter(|pixel| pixel.0[0] > 0).count();
            }
            anyhow::ensure!(seen > 0, "the pictures are empty");
            figures.add(
                backend,
                format!("pixels of a later copy, {threads} threads"),
                seen,
                late as f64,
                0.0,
            );
        }
    }
    Ok(())
}

/// Checks faces of two boxes and two triangles in one plane that is perpendicular to the rays: computed distances are
/// equal.
fn faces(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    let surface = Material::default();
    let cuboid =
        |u: [f64; 3], v: [f64; 3]| Cuboid::new([u.into(), v.into()], surface.clone()).map(Object::Cuboid);
    let big = cuboid([-4.0, -4.0, -2.0], [4.0, 4.0, 0.0])?;
    let small = cuboid([-1.0, -1.0, -1.0], [1.0, 1.0, 0.0])?;
    let ball = Object::Sphere(Sphere::new(1.0, DVec3::new(3.0, 3.0, -1.0), surface)?);
    let mut rng = random(240);
    let rays: Vec<_> = (0..size.pick(500, 100_000))
        .map(|k| {
            let place = DVec3::new(rng.f64() * 2.0 - 1.0, rng.f64() * 2.0 - 1.0, 5.0);
            let from = if k % 50 == 0 { DVec3::new(3.0, 3.0, 5.0) } else { place };
            aimed(from, from - DVec3::Z)
        })
        .collect();
    for backend in backends {
        let mut late = 0;
        for order in [[&big, &small, &ball], [&small, &ball, &big], [&ball, &small, &big]] {
            let objects = order.map(Object::clone).to_vec();
            let at = |object: &Object| objects.iter().position(|o| o == object);
            let scene = objects_only(objects.clone())?;
            for (ray, hit) in rays.iter().zip(backend.nearest(&scene, &rays)?) {
                let other = if ray.origin.x == 3.0 { &ball } else { &small };
                late += usize::from(hit.map(|hit| hit.object) != at(&big).min(at(other)));
            }
        }
        figures.add(backend, "not the first of those in one plane", 3 * rays.len(), late as f64, 0.0);
    }
    Ok(())
}
