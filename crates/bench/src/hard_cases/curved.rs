//! Rays that barely hit discs, cylinders, cones, tori and planes: tangents, rims, tips, edge-on, from the surface.

use anyhow::Result;
use glam::DVec3;
use rayfold_scene::{Capsule, Cone, Cylinder, Disc, Material, Object, Plane, Roundbox, Torus};

use super::figures::{Figures, Size, unless_single, worse};
use super::setup::{direction, from_eyes, random, truths};
use crate::backends::{Backend, Ray};
use crate::oracle;
use crate::scenes::single;

/// The smallest distance that a backend must resolve, in roundoffs of the largest number of body and ray.
const APART: f64 = 16.0;

/// A function that makes a body grown by a small part of its size.
type Grown = fn(f64) -> Result<Object>;

const CENTER: DVec3 = DVec3::new(0.25, -0.5, 0.125);
const ALONG: DVec3 = DVec3::new(0.0, 2.0, 0.0);
const ASLANT: DVec3 = DVec3::new(1.0, 2.0, -2.0);

fn surface() -> Material {
    Material::default()
}

fn cylinder(axis: DVec3, radius: f64, grown: f64) -> Result<Object> {
    let ends = [CENTER - grown * axis, CENTER + (1.0 + grown) * axis];
    Ok(Cylinder::new(radius * (1.0 + grown), ends, surface())?.into())
}

fn cone(axis: DVec3, radii: [f64; 2], grown: f64) -> Result<Object> {
    let ends = [CENTER - grown * axis, CENTER + (1.0 + grown) * axis];
    let radii = radii.map(|radius| if radius == 0.0 { radius } else { radius + 2.0 * grown });
    Ok(Cone::new(radii, ends, surface())?.into())
}

fn capsule(axis: DVec3, grown: f64) -> Result<Object> {
    Ok(Capsule::new(0.75 + grown, [CENTER, CENTER + 0.5 * axis], surface())?.into())
}

fn roundbox(half: DVec3, radius: f64, grown: f64) -> Result<Object> {
    let half = half + grown;
    Ok(Roundbox::new([CENTER - half, CENTER + half], radius + grown, surface())?.into())
}

const BODIES: &[(&str, Grown)] = &[
    ("disc", |grown| Ok(Disc::new(1.25 + grown, CENTER, ALONG, surface())?.into())),
    ("disc aslant", |grown| Ok(Disc::new(1.25 + grown, CENTER, ASLANT, surface())?.into())),
    ("cylinder", |grown| cylinder(ALONG, 0.75, grown)),
    ("cylinder aslant", |grown| cylinder(ASLANT, 0.75, grown)),
    ("cone", |grown| cone(ALONG, [1.0, 0.0], grown)),
    ("cone aslant", |grown| cone(ASLANT, [1.0, 0.5], grown)),
    ("torus", |grown| Ok(Torus::new(1.0, 0.25 + grown, CENTER, ALONG, surface())?.into())),
    ("torus aslant", |grown| Ok(Torus::new(1.0, 0.625 + grown, CENTER, ASLANT, surface())?.into())),
    ("capsule", |grown| capsule(ALONG, grown)),
    ("capsule aslant", |grown| capsule(ASLANT, grown)),
    ("box with round edges", |grown| roundbox(DVec3::new(1.25, 0.75, 1.0), 0.25, grown)),
    ("box that is a ball", |grown| roundbox(DVec3::ONE, 1.0, grown)),
    ("box with hardly round edges", |grown| roundbox(DVec3::new(1.0, 0.75, 0.5), 1e-3, grown)),
];

/// Returns rays that pass a body at all distances from its outline, on all sides of it.
fn rays(rng: &mut fastrand::Rng, body: &Object, count: usize) -> Vec<Ray> {
    let mut rays = Vec::new();
    while rays.len() < count {
        let eye = single(CENTER + 4.0 * direction(rng));
        let target = CENTER + 1.5 * direction(rng) * rng.f64();
        let aside = 3.0 * direction(rng);
        // Bisects to the point where the ray begins to miss.
        let hits = |part: f64| {
            let towards = target + part * aside - eye;
            oracle::nearest(std::slice::from_ref(body), eye, towards).is_some()
        };
        if !hits(0.0) || hits(1.0) {
            continue;
        }
        let (mut within, mut beyond) = (0.0, 1.0);
        for _ in 0..rng.u32(4..56) {
            let middle = 0.5 * (within + beyond);
            if hits(middle) { within = middle } else { beyond = middle }
        }
        for part in [within, beyond] {
            rays.push(Ray { origin: eye, direction: target + part * aside - eye });
        }
    }
    rays
}

/// Checks that each backend agrees with the oracle, except for rays whose answer changes if the body grows or shrinks
/// by some roundoffs.
pub(super) fn outlines(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    let mut rng = random(29);
    for (name, grown) in BODIES {
        let body = grown(0.0)?;
        let rays = rays(&mut rng, &body, size.pick(100, 20_000));
        let truths = truths(std::slice::from_ref(&body), &rays);
        for backend in backends {
            let ulp = backend.ulp(4.0);
            let (mut wrong, mut place, mut normals) = (0, 0f64, 0);
            let hits = from_eyes(backend, body.clone(), &rays)?;
            for ((ray, truth), hit) in rays.iter().zip(&truths).zip(hits) {
                let (Some(truth), Some(hit)) = (truth, hit) else {
                    if truth.is_some() != hit.is_some() {
                        let other = grown(if hit.is_some() { APART * ulp } else { -APART * ulp })?;
                        let found = oracle::nearest(&[other], ray.origin, ray.direction);
                        wrong += usize::from(found.is_some() != hit.is_some());
                    }
                    continue;
                };
                // The distance perpendicular to the surface. The position of a tangent along itself is not determined.
                let apart = (hit.t - truth.t).abs() * truth.normal.dot(ray.direction).abs();
                let near = (hit.t - truth.t).abs() * ray.direction.length() < 1e-3;
                if near {
                    place = worse(place, apart / ulp);
                }
                normals += usize::from(hit.normal.dot(ray.direction) > 1e-6 * ray.direction.length());
            }
            let bound = |bound| unless_single(backend, bound);
            figures.add(
                backend,
                format!("{name}: wrong beside the outline"),
                rays.len(),
                wrong as f64,
                bound(0.0),
            );
            figures.add(backend, format!("{name}: off the surface, ulp"), rays.len(), place, bound(APART));
            figures.add(
                backend,
                format!("{name}: normals that turn away"),
                rays.len(),
                normals as f64,
                bound(0.0),
            );
        }
    }
    Ok(())
}

/// A description, a body, the origin and direction of a ray, and the distance of the hit, in units of the length of the
/// direction.
type Exact<'a> = (&'a str, &'a Object, [f64; 3], [f64; 3], Option<f64>);

/// Compares hits that are decided without rounding, and their distances.
pub(super) fn exact(backends: &[Backend], _: Size, figures: &mut Figures) -> Result<()> {
    let up = DVec3::Y;
    let can: Object = Cylinder::new(2.0, [DVec3::ZERO, 4.0 * up], surface())?.into();
    let tip: Object = Cone::new([2.0, 0.0], [DVec3::ZERO, 4.0 * up], surface())?.into();
    let ring: Object = Torus::new(3.0, 1.0, DVec3::ZERO, up, surface())?.into();
    let pill: Object = Capsule::new(2.0, [DVec3::ZERO, 4.0 * up], surface())?.into();
    let soap: Object =
        Roundbox::new([DVec3::new(-4.0, 0.0, -5.0), DVec3::new(4.0, 6.0, 5.0)], 2.0, surface())?.into();
    let plate: Object = Disc::new(5.0, DVec3::ZERO, up, surface())?.into();
    let ground: Object = Plane::new(DVec3::ZERO, up, surface())?.into();
    let cases: &[Exact] = &[
        ("along an axis", &can, [0.0, 9.0, 0.0], [0.0, -1.0, 0.0], Some(5.0)),
        ("in a cap's plane", &can, [6.0, 4.0, 0.0], [-1.0, 0.0, 0.0], Some(4.0)),
        ("above a cap's plane", &can, [6.0, 4.0 + 1e-5, 0.0], [-1.0, 0.0, 0.0], None),
        ("along a side", &can, [2.0, 9.0, 0.0], [0.0, -1.0, 0.0], Some(5.0)),
        ("tangent to a side", &can, [2.0, 1.0, 6.0], [0.0, 0.0, -1.0], Some(6.0)),
        ("from a side outwards", &can, [2.0, 1.0, 0.0], [1.0, 0.0, 0.0], None),
        ("from a side inwards", &can, [2.0, 1.0, 0.0], [-1.0, 0.0, 0.0], Some(4.0)),
        ("from a cap upwards", &can, [1.0, 4.0, 0.0], [0.0, 1.0, 0.0], None),
        ("from a cap downwards", &can, [1.0, 4.0, 0.0], [0.0, -1.0, 0.0], Some(4.0)),
        ("onto a tip", &tip, [0.0, 9.0, 0.0], [0.0, -1.0, 0.0], Some(5.0)),
        ("across a tip", &tip, [8.0, 4.0, 0.0], [-1.0, 0.0, 0.0], Some(8.0)),
        ("above a tip", &tip, [8.0, 4.0 + 1e-5, 0.0], [-1.0, 0.0, 0.0], None),
        ("above a tip, in the other half", &tip, [8.0, 5.0, 0.0], [-1.0, 0.0, 0.0], None),
        ("from within a cone", &tip, [0.5, 0.0, 0.0], [0.0, 1.0, 0.0], Some(3.0)),
        ("through the hole", &ring, [0.0, 9.0, 0.0], [0.0, -1.0, 0.0], None),
        ("beside the hole", &ring, [2.0, 9.0, 0.0], [0.0, -1.0, 0.0], Some(9.0)),
        ("across the hole", &ring, [2.0, 0.0, 0.0], [-1.0, 0.0, 0.0], Some(4.0)),
        ("on the top of a torus", &ring, [9.0, 1.0, 0.0], [-1.0, 0.0, 0.0], Some(6.0)),
        ("from a torus outwards", &ring, [4.0, 0.0, 0.0], [1.0, 0.0, 0.0], None),
        ("from a torus inwards", &ring, [4.0, 0.0, 0.0], [-1.0, 0.0, 0.0], Some(2.0)),
        ("onto the end of a capsule", &pill, [0.0, 9.0, 0.0], [0.0, -1.0, 0.0], Some(3.0)),
        ("tangent to a capsule", &pill, [2.0, 1.0, 6.0], [0.0, 0.0, -1.0], Some(6.0)),
        ("tangent to its end", &pill, [9.0, 6.0, 0.0], [-1.0, 0.0, 0.0], Some(9.0)),
        ("above its end", &pill, [9.0, 6.0 + 1e-5, 0.0], [-1.0, 0.0, 0.0], None),
        ("from a capsule outwards", &pill, [2.0, 1.0, 0.0], [1.0, 0.0, 0.0], None),
        ("from a capsule inwards", &pill, [2.0, 1.0, 0.0], [-1.0, 0.0, 0.0], Some(4.0)),
        ("from its end inwards", &pill, [0.0, 6.0, 0.0], [0.0, -1.0, 0.0], Some(8.0)),
        ("onto a face of a round box", &soap, [1.0, 9.0, 1.0], [0.0, -1.0, 0.0], Some(3.0)),
        ("onto the seam of a face", &soap, [2.0, 9.0, 3.0], [0.0, -1.0, 0.0], Some(3.0)),
        ("beside an edge", &soap, [4.0, 1.0, 9.0], [0.0, 0.0, -1.0], None),
        ("along a face", &soap, [4.0, 3.0, 9.0], [0.0, 0.0, -1.0], Some(6.0)),
        ("above a face", &soap, [4.0 + 1e-5, 3.0, 9.0], [0.0, 0.0, -1.0], None),
        ("onto an edge", &soap, [9.0, 5.6, 0.0], [-1.0, 0.0, 0.0], Some(5.8)),
        ("from a round box outwards", &soap, [4.0, 3.0, 0.0], [1.0, 0.0, 0.0], None),
        ("from a round box inwards", &soap, [4.0, 3.0, 0.0], [-1.0, 0.0, 0.0], Some(8.0)),
        ("onto a rim", &plate, [3.0, 7.0, 4.0], [0.0, -1.0, 0.0], Some(7.0)),
        ("beside a rim", &plate, [3.0, 7.0, 4.0 + 1e-5], [0.0, -1.0, 0.0], None),
        ("edge on", &plate, [9.0, 0.0, 0.0], [-1.0, 0.0, 0.0], None),
        ("from a disc", &plate, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], None),
        ("along a plane", &ground, [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], None),
        ("above a plane", &ground, [1.0, 1.0, 0.0], [0.0, 0.0, 1.0], None),
        ("from a plane", &ground, [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], None),
        (
            "to the horizon",
            &ground,
            [0.0, 1.0, 0.0],
            [1.0, -1.0 / (1u64 << 30) as f64, 0.0],
            Some(2f64.powi(30)),
        ),
    ];
    for backend in backends {
        let mut wrong = Vec::new();
        for (name, object, origin, towards, expected) in cases {
            let ray = Ray { origin: (*origin).into(), direction: (*towards).into() };
            let truth = oracle::nearest(std::slice::from_ref(*object), ray.origin, ray.direction);
            anyhow::ensure!(truth.map(|hit| hit.t.to_f64()) == *expected, "the oracle errs {name}");
            let hit = from_eyes(backend, (*object).clone(), &[ray])?[0].map(|hit| hit.t);
            let right = match (hit, *expected) {
                (Some(t), Some(expected)) => (t - expected).abs() <= APART * backend.ulp(expected),
                (None, None) => true,
                _ => false,
            };
            if !right {
                wrong.push(*name);
            }
        }
        let what = format!("wrong{}{}", if wrong.is_empty() { "" } else { ": " }, wrong.join(", "));
        figures.add(backend, what, cases.len(), wrong.len() as f64, 0.0);
    }
    Ok(())
}
