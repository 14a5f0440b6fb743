//! Spheres that are far away, huge, barely hit, or around the eye.

use anyhow::Result;
use glam::DVec3;
use rayfold_scene::{Cuboid, Material, Object, Sphere};

use super::figures::{Figures, Size, unless_single, worse};
use super::setup::{aimed, direction, from_eyes, objects_only, objects_seen, random, truths};
use crate::backends::{Arithmetic, Backend, Ray};
use crate::oracle::{nearest, sphere_clearance};
use crate::scenes::single;

fn sphere(radius: f64, center: DVec3) -> Result<Sphere> {
    Ok(Sphere::new(radius, center, Material::default())?)
}

/// Checks that hits and misses are wrong only within 4 ulp of the limb (ulp of the distance from the origin, the
/// largest number involved). Also measures the error of the distance for rays through the inner 0.99 r.
pub(super) fn distant(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    for distance in [1e1, 1e2, 1e3, 1e4, 1e6] {
        let mut rng = random(1);
        let (spheres, each) = (size.pick(5, 100), size.pick(40, 200));
        let mut worst = vec![(0f64, 0f64); backends.len()];
        for _ in 0..spheres {
            let origin = single(direction(&mut rng));
            let ball = sphere(1.0, single(origin + distance * direction(&mut rng)))?;
            let objects = [Object::Sphere(ball.clone())];
            let rays: Vec<Ray> = (0..each)
                .map(|k| {
                    // Every other ray aims at the limb, where random rays are rare.
                    let reach = if k % 2 == 0 { rng.f64().sqrt() } else { 0.98 + 0.04 * rng.f64() };
                    let aside = direction(&mut rng).cross((ball.center() - origin).normalize());
                    aimed(origin, ball.center() + reach * aside.normalize_or_zero())
                })
                .collect();
            let truths = truths(&objects, &rays);
            let scene = objects_seen(objects.to_vec(), origin, ball.center(), 2.5 / distance)?;
            for (backend, worst) in backends.iter().zip(&mut worst) {
                for ((ray, truth), hit) in rays.iter().zip(&truths).zip(backend.nearest(&scene, &rays)?) {
                    let clearance = sphere_clearance(&ball, ray.origin, ray.direction);
                    match (truth, hit) {
                        (Some(truth), Some(hit)) if clearance < -0.01 => {
                            let error = (hit.t - truth.t).abs() * ray.direction.length();
                            worst.1 = worse(worst.1, error);
                        }
                        (Some(_), Some(_)) | (None, None) => {}
                        _ => worst.0 = worse(worst.0, clearance.abs() / backend.ulp(distance)),
                    }
                }
            }
        }
        for (backend, (limb, error)) in backends.iter().zip(worst) {
            let all = spheres * each;
            // Beyond 1e4 radii nothing is promised for forced `f32`: the program chooses `f64` there.
            let near = distance <= 1e4;
            let double = backend.arithmetic == Arithmetic::Double || !near;
            let bound = if double { 1e-8 } else { 1e-6 * distance };
            let promised = |bound| if near { Some(bound) } else { unless_single(backend, bound) };
            figures.add(
                backend,
                format!("at {distance:e} r, wrong hit or miss off the limb, ulp of the distance"),
                all,
                limb,
                promised(4.0),
            );
            figures.add(backend, format!("at {distance:e} r, dt/r"), all, error, promised(bound));
        }
    }
    Ok(())
}

/// Measures the relative error of the distance to the ground.
pub(super) fn horizon(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    const RADIUS: f64 = 1e7;
    let objects = [Object::Sphere(sphere(RADIUS, DVec3::new(0.0, -RADIUS, 0.0))?)];
    let scene = objects_seen(objects.to_vec(), DVec3::Y, DVec3::new(1.0, 0.5, 0.0), 1.0)?;
    let mut rng = random(3);
    // The horizon is at a depression of 4.5e-4. Forced `f32` is bounded only from a depression of 0.1.
    for (what, least) in [("steeper than 0.1", 0.1f64), ("down to 1.1 of the horizon's depression", 4.92e-4)]
    {
        let rays: Vec<Ray> = (0..size.pick(400, 20_000))
            .map(|_| {
                let depression = least * (1.5 / least).powf(rng.f64());
                let turn = rng.f64() * std::f64::consts::TAU;
                let along = DVec3::new(turn.cos(), 0.0, turn.sin()) * depression.cos();
                aimed(DVec3::Y, DVec3::Y + along - DVec3::Y * depression.sin())
            })
            .collect();
        let truths = truths(&objects, &rays);
        for backend in backends {
            let worst =
                truths.iter().zip(backend.nearest(&scene, &rays)?).fold(0.0, |worst, pair| match pair {
                    (Some(truth), Some(hit)) => worse(worst, (hit.t - truth.t).abs() / truth.t),
                    (None, None) => worst,
                    _ => f64::INFINITY,
                });
            let bound = if least < 0.1 { unless_single(backend, 5e-6) } else { Some(5e-6) };
            figures.add(backend, format!("relative t, {what}"), rays.len(), worst, bound);
        }
    }
    Ok(())
}

/// Measures rays whose line passes the centre at r + k ulp: along the axes, where the ray is exact, and askew.
pub(super) fn tangent(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    for backend in backends {
        let (mut axial, mut askew, mut invalid, mut count) = (0f64, 0f64, 0, 0);
        let mut rng = random(4);
        for radius in [1.0, 3.0, single(DVec3::splat(0.1)).x, 1e3, 12_345.0] {
            let ball = sphere(radius, DVec3::ZERO)?;
            let objects = [Object::Sphere(ball.clone())];
            let scene = objects_only(objects.to_vec())?;
            let ulp = backend.ulp(radius);
            let mut rays = Vec::new();
            for k in -16..=16 {
                let aside = radius + f64::from(k) * ulp;
                for axis in 0..3 {
                    for far in [1.5, 8.0] {
                        let origin = DVec3::AXES[axis] * aside + DVec3::AXES[(axis + 1) % 3] * far * radius;
                        rays.push(Ray { origin, direction: -DVec3::AXES[(axis + 1) % 3] });
                    }
                }
            }
            let exact = rays.len();
            for _ in 0..size.pick(200, 20_000) {
                let towards = direction(&mut rng);
                let aside = direction(&mut rng).cross(towards).normalize_or_zero();
                let graze = 1.0 + (rng.f64() - 0.5) * 64.0 * ulp / radius;
                let (eye, goal) = (radius * (1.5 * towards), radius * (graze * aside - 0.2 * towards));
                rays.push(match backend.arithmetic {
                    Arithmetic::Double => Ray { origin: eye, direction: (goal - eye).normalize() },
                    Arithmetic::Single | Arithmetic::Chosen => aimed(eye, goal),
                });
            }
            let truths = truths(&objects, &rays);
            for (k, ((ray, truth), hit)) in
                rays.iter().zip(&truths).zip(backend.nearest(&scene, &rays)?).enumerate()
            {
                count += 1;
                if hit.is_some_and(|hit| !hit.t.is_finite() || !hit.normal.is_finite()) {
                    invalid += 1;
                }
                if hit.is_some() != truth.is_some() {
                    let off = sphere_clearance(&ball, ray.origin, ray.direction).abs() / ulp;
                    let worst = if k < exact { &mut axial } else { &mut askew };
                    *worst = worse(*worst, off);
                }
            }
        }
        figures.add(backend, "along an axis, wrong at k ulp of r", count, axial, 4.0);
        figures.add(backend, "askew, wrong at k ulp of r", count, askew, 4.0);
        figures.add(backend, "NaN", count, f64::from(invalid), 0.0);
    }
    Ok(())
}

/// Checks that the right one of two roots is returned, for rays from points exactly on the surface and from the inside.
pub(super) fn inside(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    let mut rng = random(5);
    let mut sets: Vec<(Object, Vec<Ray>)> = Vec::new();
    for (radius, center) in [(5.0, DVec3::ZERO), (5.0, DVec3::new(64.0, -3.0, 8.0)), (0.625, DVec3::Y)] {
        let on = [[3.0, 4.0, 0.0], [0.0, -3.0, 4.0], [-5.0, 0.0, 0.0], [-4.0, 0.0, 3.0]];
        let on = on.map(|p| DVec3::from(p) * (radius / 5.0));
        let mut rays = Vec::new();
        let mut around = |origin: DVec3, rng: &mut fastrand::Rng, count: usize| {
            rays.extend((0..count).map(|_| Ray { origin, direction: single(direction(rng)) }));
            rays.push(Ray { origin, direction: center - origin });
        };
        for p in on {
            around(center + p, &mut rng, size.pick(60, 20_000));
        }
        for _ in 0..size.pick(10, 300) {
            let depth = radius * rng.f64() * 0.99;
            let within = single(center + depth * direction(&mut rng));
            around(within, &mut rng, 16);
        }
        // Rays into the sphere that are increasingly tangential to its surface: down to 16 roundoffs of f32.
        for p in on {
            let (u, v) = p.normalize().any_orthonormal_pair();
            for k in 0..size.pick(40, 2000) {
                let along = u * f64::from(k).cos() + v * f64::from(k).sin();
                let into = 10f64.powf(-6.0 * rng.f64()) * p.normalize();
                rays.push(Ray { origin: center + p, direction: single((along - into).normalize()) });
            }
        }
        sets.push((Object::Sphere(sphere(radius, center)?), rays));
    }
    let corners = [DVec3::new(-1.0, -2.0, -3.0), DVec3::new(1.0, 2.0, 4.0)];
    let mut rays = Vec::new();
    for _ in 0..size.pick(20, 500) {
        let part = DVec3::new(rng.f64(), rng.f64(), rng.f64());
        let within = single(corners[0] + (corners[1] - corners[0]) * part);
        let mut origins = vec![within];
        for axis in 0..3 {
            let mut on = within;
            on[axis] = corners[rng.usize(0..2)][axis];
            origins.push(on);
        }
        for origin in origins {
            rays.extend((0..16).map(|_| Ray { origin, direction: single(direction(&mut rng)) }));
            rays.extend(DVec3::AXES.map(|direction| Ray { origin, direction }));
        }
    }
    sets.push((Object::Cuboid(Cuboid::new(corners, Material::default())?), rays));
    for backend in backends {
        let (mut wrong, mut count) = (0, 0);
        for (object, rays) in &sets {
            for (ray, hit) in rays.iter().zip(from_eyes(backend, object.clone(), rays)?) {
                count += 1;
                let truth = nearest(std::slice::from_ref(object), ray.origin, ray.direction)
                    .map(|hit| hit.t.to_f64());
                let right = match (truth, hit) {
                    (Some(t), Some(hit)) => (hit.t - t).abs() * ray.direction.length() < 1e-4,
                    (None, None) => true,
                    _ => false,
                };
                wrong += usize::from(!right);
            }
        }
        figures.add(backend, "wrong roots", count, wrong as f64, 0.0);
    }
    Ok(())
}

/// Checks that each pixel shows an object that the oracle sees within half a pixel of it.
pub(super) fn giant_and_dwarf(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    let objects = [
        Object::Sphere(sphere(1e7, DVec3::new(0.0, -1e7, 0.0))?),
        Object::Sphere(sphere(1.0, DVec3::new(0.5, 1.5, -6.0))?),
    ];
    let eye = DVec3::new(0.0, 2.0, 0.0);
    let scene = objects_seen(objects.to_vec(), eye, eye - DVec3::Z, 1.0)?;
    let side = size.pick(96, 512);
    let pixel = 0.8 / f64::from(side);
    let ray = |i: f64, j: f64| {
        let across = DVec3::new((i + 0.5) * pixel - 0.4, (j + 0.5) * pixel - 0.4, -1.0);
        Ray { origin: eye, direction: across.normalize() }
    };
    let seen = |ray: Ray| nearest(&objects, ray.origin, ray.direction).map(|hit| hit.object);
    let places: Vec<(f64, f64)> =
        (0..side * side).map(|k| (f64::from(k % side), f64::from(k / side))).collect();
    let rays: Vec<Ray> = places.iter().map(|&(i, j)| ray(i, j)).collect();
    let truths: Vec<_> = rays.iter().map(|&ray| seen(ray)).collect();
    for backend in backends {
        let hits = backend.nearest(&scene, &rays)?;
        let off = places.iter().zip(&truths).zip(&hits).filter(|((place, truth), hit)| {
            let shown = hit.map(|hit| hit.object);
            let near = |turn: f64| ray(place.0 + 0.5 * turn.cos(), place.1 + 0.5 * turn.sin());
            shown != **truth
                && (0..32).all(|k| seen(near(f64::from(k) * std::f64::consts::TAU / 32.0)) != shown)
        });
        figures.add(backend, "pixels off by more than half a pixel", places.len(), off.count() as f64, 0.0);
    }
    Ok(())
}
