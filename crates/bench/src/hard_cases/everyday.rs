//! Random scenes like those that users write: objects that stand on a floor and touch, lights vertical or parallel to
//! the floor, many objects, meshes among mirrors. All numbers have one decimal place.

use anyhow::Result;
use fastrand::Rng;
use glam::DVec3;
use rayfold_scene::{Camera, Cuboid, Material, Object, Pinhole, Scene, Screen, Sphere, Triangle};

use super::figures::{Figures, Size};
use super::nasty::{Kind, judge_kinds};
use super::setup::direction;
use crate::backends::Backend;
use crate::scenes::{icosphere, light, looking_at};

pub(super) const KINDS: &[Kind] = &[
    ("things at rest on a floor", at_rest),
    ("a room of boxes that touch", room),
    ("lights along faces", grazing_lights),
    ("a crowd", crowd),
    ("a mesh among mirrors", mesh),
    ("things without volume", flat),
    ("through a telescope", telescope),
    ("pixels as units", in_pixels),
];

/// The share of pixels that may be wrong.
const FEW: f64 = 1e-4;

/// Checks every backend on every kind of scene.
pub(super) fn scenes(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    judge_kinds(KINDS, FEW, backends, size, figures)
}

/// Returns a number with one decimal place.
fn tenths(rng: &mut Rng, from: i32, to: i32) -> f64 {
    f64::from(rng.i32(from..=to)) / 10.0
}

fn place(rng: &mut Rng) -> DVec3 {
    DVec3::new(tenths(rng, -30, 30), 0.0, tenths(rng, -30, 30))
}

fn surface(rng: &mut Rng, mirrors: bool) -> Result<Material> {
    let mut color = |most| DVec3::new(tenths(rng, 0, most), tenths(rng, 0, most), tenths(rng, 0, most));
    let (ambient, diffuse, mirror) = (color(2), color(8), color(6));
    Ok(Material::new(ambient, diffuse, if mirrors { mirror } else { DVec3::ZERO })?)
}

fn ball(rng: &mut Rng, radius: f64, center: DVec3) -> Result<Object> {
    let mirrors = rng.bool();
    Ok(Object::Sphere(Sphere::new(radius, center, surface(rng, mirrors)?)?))
}

fn brick(rng: &mut Rng, low: DVec3, high: DVec3) -> Result<Object> {
    Ok(Object::Cuboid(Cuboid::new([low, high], surface(rng, false)?)?))
}

fn tile(rng: &mut Rng, vertices: [DVec3; 3]) -> Result<Object> {
    Ok(Object::Triangle(Triangle::new(vertices, surface(rng, false)?)?))
}

/// Returns a floor: a box's top or two triangles, at height 0.
fn floor(rng: &mut Rng) -> Result<Vec<Object>> {
    let corner = |x: f64, z: f64| DVec3::new(x, 0.0, z);
    let (low, high) = (corner(-5.0, -5.0), corner(5.0, 5.0));
    Ok(match rng.u32(0..3) {
        0 => vec![brick(rng, low - DVec3::Y, high)?],
        1 => vec![brick(rng, low, high)?],
        _ => vec![tile(rng, [low, corner(5.0, -5.0), high])?, tile(rng, [low, high, corner(-5.0, 5.0)])?],
    })
}

fn toward(rng: &mut Rng) -> DVec3 {
    match rng.u32(0..6) {
        0 => DVec3::NEG_Y,
        1 => DVec3::new(tenths(rng, -10, 10), 0.0, tenths(rng, -10, 10) + 0.05),
        2 => DVec3::new(1.0, -1.0, 0.0),
        3 => DVec3::new(tenths(rng, -10, 10), -0.001, 1.0),
        _ => DVec3::new(tenths(rng, -10, 10), tenths(rng, -10, -1), tenths(rng, -10, 10)),
    }
}

fn seen(rng: &mut Rng, objects: Vec<Object>) -> Result<Scene> {
    let eye = DVec3::new(tenths(rng, -40, 40), tenths(rng, 2, 50), 8.0);
    let screen = Screen::new(rng.u32(24..48), rng.u32(24..48))?;
    let target = DVec3::new(0.0, tenths(rng, -5, 10), 0.0);
    let mut scene = Scene::new(screen, looking_at(eye, target, 1.0, screen)?);
    scene.set_background(DVec3::new(0.2, 0.3, 0.5))?;
    scene.objects = objects.into();
    let lights: Result<Vec<_>> =
        (0..rng.u32(1..3)).map(|_| Ok(light(0.7, toward(rng).to_array())?)).collect();
    scene.lights = lights?.into();
    Ok(scene)
}

/// Returns objects that stand at the height of `at`.
fn standing(rng: &mut Rng, at: DVec3) -> Result<Vec<Object>> {
    let size = tenths(rng, 2, 12);
    Ok(match rng.u32(0..3) {
        0 => vec![ball(rng, size, at + size * DVec3::Y)?],
        1 => {
            let high = at + DVec3::new(size, tenths(rng, 1, 20), size);
            vec![brick(rng, at, high)?]
        }
        // A pyramid.
        _ => {
            let corners = [DVec3::X, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Z].map(|side| at + size * side);
            let tip = at + DVec3::new(0.0, tenths(rng, 3, 20), 0.0);
            let sides: Result<Vec<_>> =
                (0..4).map(|k| tile(rng, [corners[k], corners[(k + 1) % 4], tip])).collect();
            sides?
        }
    })
}

fn at_rest(rng: &mut Rng) -> Result<Scene> {
    let mut objects = floor(rng)?;
    for _ in 0..rng.usize(1..8) {
        let at = place(rng);
        objects.extend(standing(rng, at)?);
    }
    seen(rng, objects)
}

/// Makes boxes side by side and on top of each other, walls of triangles.
fn room(rng: &mut Rng) -> Result<Scene> {
    let mut objects = floor(rng)?;
    let wall = |x: f64, y: f64| DVec3::new(x, y, -3.0);
    objects.push(tile(rng, [wall(-5.0, 0.0), wall(5.0, 0.0), wall(5.0, 4.0)])?);
    objects.push(tile(rng, [wall(-5.0, 0.0), wall(5.0, 4.0), wall(-5.0, 4.0)])?);
    let mut at = DVec3::new(-3.0, 0.0, -3.0);
    for _ in 0..rng.usize(2..7) {
        let size = DVec3::new(tenths(rng, 3, 15), tenths(rng, 3, 15), tenths(rng, 3, 30));
        objects.push(brick(rng, at, at + size)?);
        if rng.bool() {
            let top = at + DVec3::Y * size.y;
            objects.extend(standing(rng, top + DVec3::new(0.2, 0.0, 0.2))?);
        }
        at.x += size.x;
    }
    seen(rng, objects)
}

fn grazing_lights(rng: &mut Rng) -> Result<Scene> {
    let mut scene = at_rest(rng)?;
    let along = [DVec3::X, DVec3::NEG_Z, DVec3::new(1.0, -1e-7, 0.0), DVec3::new(0.6, 0.0, -0.8)];
    scene.lights = vec![light(0.8, along[rng.usize(0..4)].to_array())?, light(0.3, [0.0, -1.0, 0.0])?].into();
    Ok(scene)
}

fn crowd(rng: &mut Rng) -> Result<Scene> {
    let mut objects = floor(rng)?;
    let count = [70, 150, 600][rng.usize(0..3)];
    while objects.len() < count {
        let at = place(rng) + DVec3::Y * tenths(rng, 0, 25);
        let size = tenths(rng, 1, 3);
        objects.push(match rng.u32(0..3) {
            0 => ball(rng, size, at + size * DVec3::Y)?,
            1 => brick(rng, at, at + DVec3::splat(size))?,
            _ => {
                let along = DVec3::new(size, tenths(rng, -3, 3), 0.1);
                let vertices = [at, at + along, at + DVec3::new(along.y, along.z, along.x)];
                tile(rng, vertices)?
            }
        });
    }
    seen(rng, objects)
}

fn mesh(rng: &mut Rng) -> Result<Scene> {
    let mut objects = floor(rng)?;
    let count = [20, 80, 320, 1280][rng.usize(0..4)];
    let (size, turn) = (tenths(rng, 8, 16), direction(rng));
    let skin = surface(rng, false)?;
    for face in icosphere(count) {
        let vertices = face.map(|p| (p + 0.2 * (3.0 * p.dot(turn)).sin() * p) * size + DVec3::Y * size);
        objects.push(Object::Triangle(Triangle::new(vertices, skin.clone())?));
    }
    for _ in 0..rng.usize(1..4) {
        let (radius, at) = (tenths(rng, 3, 10), place(rng));
        let mirror = Material::new(DVec3::ZERO, DVec3::splat(0.1), DVec3::splat(0.8))?;
        objects.push(Object::Sphere(Sphere::new(radius, at + radius * DVec3::Y, mirror)?));
    }
    seen(rng, objects)
}

/// Makes rectangles, lines and points as boxes, and triangles without area.
fn flat(rng: &mut Rng) -> Result<Scene> {
    let mut objects = floor(rng)?;
    for _ in 0..rng.usize(3..20) {
        let at = place(rng) + DVec3::Y * tenths(rng, 0, 20);
        let mut size = DVec3::new(tenths(rng, 3, 20), tenths(rng, 3, 20), tenths(rng, 3, 20));
        for axis in 0..3 {
            if rng.bool() {
                size[axis] = 0.0;
            }
        }
        objects.push(if rng.u32(0..4) == 0 {
            tile(rng, [at, at + size, at + 2.0 * size])?
        } else {
            brick(rng, at, at + size)?
        });
    }
    seen(rng, objects)
}

fn telescope(rng: &mut Rng) -> Result<Scene> {
    let mut scene = at_rest(rng)?;
    let away = 10f64.powi(rng.i32(2..7));
    let Camera::Pinhole(near) = &scene.camera else { return Ok(scene) };
    let (eye, half) = (near.eye() * away, near.upper_right() / away);
    scene.camera = Camera::Pinhole(Pinhole::new(eye, -eye, DVec3::Y, 1.0, -half, half)?);
    Ok(scene)
}

/// Makes a scene in parallel projection whose corners, edges and outlines have whole coordinates, like the rays.
fn in_pixels(rng: &mut Rng) -> Result<Scene> {
    let whole = |rng: &mut Rng| DVec3::from_array([(); 3].map(|()| f64::from(rng.i32(0..40))));
    let objects: Result<Vec<_>> = (0..rng.usize(2..20))
        .map(|_| match rng.u32(0..3) {
            0 => {
                let (radius, center) = (f64::from(rng.u32(2..15)), whole(rng));
                ball(rng, radius, center - DVec3::Z * 50.0)
            }
            1 => {
                let (low, high) = (whole(rng), whole(rng));
                brick(rng, low - DVec3::Z * 50.0, high - DVec3::Z * 50.0)
            }
            _ => {
                let corners = [whole(rng), whole(rng), whole(rng)];
                tile(rng, corners.map(|corner| corner - DVec3::Z * 50.0))
            }
        })
        .collect();
    let mut scene = seen(rng, objects?)?;
    scene.camera = Camera::Orthographic;
    Ok(scene)
}
