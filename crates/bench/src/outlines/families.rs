//! The families of scenes: closed bodies of triangles that turn, and shapes whose edges are hard for narrow numbers.

use anyhow::Result;
use fastrand::Rng;
use glam::{DMat3, DVec3, EulerRot};
use rayfold_scene::{
    Camera, Cuboid, DirectionalLight, Light, Look, Material, Object, Scene, Screen, Triangle,
};

use crate::scenes::icosphere;

/// The content of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Family {
    Polyhedron,
    Ball,
    Crowd,
    Boxes,
    Shadow,
    Mirrored,
    Fan,
    Grazing,
}

pub(super) const FAMILIES: [Family; 8] = [
    Family::Polyhedron,
    Family::Ball,
    Family::Crowd,
    Family::Boxes,
    Family::Shadow,
    Family::Mirrored,
    Family::Fan,
    Family::Grazing,
];

impl Family {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Polyhedron => "a polyhedron that turns, of 4 to 20 faces",
            Self::Ball => "a ball of 20 to 20,480 triangles",
            Self::Crowd => "a crowd of 20 to 100 polyhedra",
            Self::Boxes => "30 boxes of triangles on a mirror",
            Self::Shadow => "shadows of polyhedra on a floor",
            Self::Mirrored => "polyhedra in a mirror",
            Self::Fan => "a fan of 30 to 100,000 needles",
            Self::Grazing => "a plane from 1e-9 to 0.1 above",
        }
    }

    /// Returns whether wrong pixels are counted, and not dots at outlines.
    pub(super) fn is_of_needles(self) -> bool {
        matches!(self, Self::Fan | Self::Grazing)
    }

    /// Returns a scene of the family.
    pub(super) fn scene(self, rng: &mut Rng, (width, height): (u32, u32)) -> Result<Scene> {
        let mut objects = Vec::new();
        let mut eye = DVec3::new(within(rng, -2.0, 2.0), within(rng, 1.0, 3.0), 7.0);
        let mut target = DVec3::new(0.0, 0.3, 0.0);
        match self {
            Self::Polyhedron => {
                add(&mut objects, &solid(rng), rng, DVec3::ZERO, 1.6)?;
                some_floor(&mut objects, rng)?;
            }
            Self::Ball => {
                let faces = icosphere(20 << (2 * rng.u32(0..6)));
                add(&mut objects, &faces, rng, DVec3::ZERO, 1.6)?;
                some_floor(&mut objects, rng)?;
            }
            Self::Crowd => {
                for _ in 0..rng.u32(20..100) {
                    let (faces, at) = (solid(rng), point(rng, DVec3::new(3.0, 2.0, 2.0)));
                    add(&mut objects, &faces, rng, at, 0.35)?;
                }
                some_floor(&mut objects, rng)?;
            }
            Self::Boxes => {
                for _ in 0..30 {
                    let at = point(rng, DVec3::new(3.0, 1.2, 2.0));
                    add(&mut objects, &cube(), rng, at, 0.4)?;
                }
                floor(&mut objects, 0.7)?;
            }
            Self::Shadow => {
                eye = DVec3::new(within(rng, -1.0, 1.0), 6.0, 3.0);
                target = DVec3::new(1.0, -1.5, -1.0);
                for _ in 0..8 {
                    let (faces, at) = (solid(rng), point(rng, DVec3::new(2.5, 0.6, 2.0)));
                    add(&mut objects, &faces, rng, at, 0.5)?;
                }
                floor(&mut objects, 0.0)?;
            }
            Self::Mirrored => {
                let wall = |y: f64| DVec3::new(0.0, y, -3.0);
                let [a, b] = [wall(-3.0), wall(4.0)].map(|v| [v - 5.0 * DVec3::X, v + 5.0 * DVec3::X]);
                let mirror = Material::new(DVec3::splat(0.05), DVec3::splat(0.1), DVec3::splat(0.8))?;
                for corners in [[a[0], a[1], b[1]], [a[0], b[1], b[0]]] {
                    objects.push(Triangle::new(corners, mirror.clone())?.into());
                }
                for _ in 0..12 {
                    let (faces, at) = (solid(rng), point(rng, DVec3::new(3.0, 2.0, 1.5)));
                    add(&mut objects, &faces, rng, at, 0.5)?;
                }
            }
            Self::Fan => fan(&mut objects, rng)?,
            Self::Grazing => {
                let above = 10f64.powf(within(rng, -9.0, -1.0));
                (eye, target) = grazing(&mut objects, rng, above)?;
            }
        }
        let look = Look::new(eye, target, within(rng, 30.0, 45.0), None)?;
        let mut scene = Scene::new(Screen::new(width, height)?, Camera::Look(look));
        scene.set_background(DVec3::new(0.8, 0.9, 1.0))?;
        scene.objects = objects.into();
        let light = |color: f64, direction| {
            DirectionalLight::new(DVec3::splat(color), direction).map(Light::Directional)
        };
        let aslant = DVec3::new(within(rng, -0.5, 0.5), -1.0, within(rng, -0.9, -0.4));
        scene.lights = vec![light(0.9, aslant)?].into();
        Ok(scene)
    }
}

fn within(rng: &mut Rng, from: f64, to: f64) -> f64 {
    from + (to - from) * rng.f64()
}

fn point(rng: &mut Rng, reach: DVec3) -> DVec3 {
    reach * DVec3::from_array([(); 3].map(|()| within(rng, -1.0, 1.0)))
}

fn color(rng: &mut Rng) -> DVec3 {
    DVec3::from_array([(); 3].map(|()| within(rng, 0.2, 1.0)))
}

fn matt(color: DVec3) -> Result<Material> {
    Ok(Material::new(0.05 * color, 0.9 * color, DVec3::ZERO)?)
}

type Face = [DVec3; 3];

/// Returns a tetrahedron, a cube, an octahedron or an icosahedron.
fn solid(rng: &mut Rng) -> Vec<Face> {
    match rng.u32(0..4) {
        0 => tetrahedron(),
        1 => cube(),
        2 => octahedron(),
        _ => icosphere(20),
    }
}

fn tetrahedron() -> Vec<Face> {
    let corner = |x: f64, y: f64, z: f64| DVec3::new(x, y, z) / 3f64.sqrt();
    let [a, b, c, d] =
        [corner(1.0, 1.0, 1.0), corner(1.0, -1.0, -1.0), corner(-1.0, 1.0, -1.0), corner(-1.0, -1.0, 1.0)];
    vec![[a, b, c], [a, b, d], [a, c, d], [b, c, d]]
}

fn octahedron() -> Vec<Face> {
    let signs = [-1.0, 1.0];
    let faces = signs.into_iter().flat_map(|x| signs.map(|y| (x, y)));
    faces.flat_map(|(x, y)| signs.map(|z| [x * DVec3::X, y * DVec3::Y, z * DVec3::Z])).collect()
}

fn cube() -> Vec<Face> {
    let mut faces = Vec::new();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let corner = |a: f64, b: f64| {
                let mut at = [0.0; 3];
                (at[axis], at[(axis + 1) % 3], at[(axis + 2) % 3]) = (side, a, b);
                DVec3::from_array(at) / 3f64.sqrt()
            };
            faces.push([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0)]);
            faces.push([corner(-1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]);
        }
    }
    faces
}

/// Adds a body, turned at random.
fn add(objects: &mut Vec<Object>, faces: &[Face], rng: &mut Rng, at: DVec3, size: f64) -> Result<()> {
    let angles = [(); 3].map(|()| within(rng, 0.0, std::f64::consts::TAU));
    let turned = DMat3::from_euler(EulerRot::XYZ, angles[0], angles[1], angles[2]);
    let material = matt(color(rng))?;
    for face in faces {
        objects.push(Triangle::new(face.map(|v| turned * v * size + at), material.clone())?.into());
    }
    Ok(())
}

/// Adds two triangles that may mirror a part of the light.
fn floor(objects: &mut Vec<Object>, mirror: f64) -> Result<()> {
    let corner = |x: f64, z: f64| DVec3::new(9.0 * x, -1.7, 9.0 * z);
    let material = Material::new(DVec3::splat(0.4), DVec3::splat(0.3), DVec3::splat(mirror))?;
    for third in [corner(1.0, -1.0), corner(-1.0, 1.0)] {
        objects.push(Triangle::new([corner(-1.0, -1.0), corner(1.0, 1.0), third], material.clone())?.into());
    }
    Ok(())
}

/// Adds no floor, a floor, or one that mirrors.
fn some_floor(objects: &mut Vec<Object>, rng: &mut Rng) -> Result<()> {
    match rng.u32(0..3) {
        0 => Ok(()),
        1 => floor(objects, 0.0),
        _ => floor(objects, 0.7),
    }
}

/// Adds needles around a hub, each with its own colour: flat, or as the spokes of a shallow cone.
fn fan(objects: &mut Vec<Object>, rng: &mut Rng) -> Result<()> {
    let count = (30.0 * 10f64.powf(within(rng, 0.0, 3.5))) as u32;
    let (radius, depth) = (within(rng, 0.5, 3.0), if rng.bool() { 0.0 } else { within(rng, 0.1, 1.0) });
    let hub = point(rng, DVec3::splat(0.5));
    let tilt =
        DMat3::from_rotation_x(within(rng, -0.8, 0.8)) * DMat3::from_rotation_y(within(rng, -0.8, 0.8));
    let rim = |k: u32| {
        let angle = std::f64::consts::TAU * f64::from(k % count) / f64::from(count);
        hub + tilt * DVec3::new(radius * angle.cos(), radius * angle.sin(), -depth)
    };
    for k in 0..count {
        objects.push(Triangle::new([hub, rim(k), rim(k + 1)], matt(color(rng))?)?.into());
    }
    Ok(())
}

/// Makes a plane of triangles, or the top of a box, with bodies on it. The eye is only a little above it, and looks
/// horizontally or nearly so.
fn grazing(objects: &mut Vec<Object>, rng: &mut Rng, above: f64) -> Result<(DVec3, DVec3)> {
    if rng.bool() {
        for x in -4..4 {
            for z in -4..4 {
                let corner = |a: i32, b: i32| DVec3::new(f64::from(x + a) * 2.0, 0.0, f64::from(z + b) * 2.0);
                let material = matt(color(rng))?;
                for third in [corner(1, 0), corner(0, 1)] {
                    objects
                        .push(Triangle::new([corner(0, 0), corner(1, 1), third], material.clone())?.into());
                }
            }
        }
    } else {
        let corners = [DVec3::new(-8.0, -1.0, -8.0), DVec3::new(8.0, 0.0, 8.0)];
        objects.push(Cuboid::new(corners, matt(color(rng))?)?.into());
    }
    for _ in 0..rng.u32(0..6) {
        let at = point(rng, DVec3::new(3.0, 0.0, 3.0));
        let size = within(rng, 0.1, 0.8);
        objects.push(Cuboid::new([at, at + DVec3::splat(size)], matt(color(rng))?)?.into());
    }
    let eye = DVec3::new(within(rng, -2.0, 2.0), above, within(rng, 4.0, 7.0));
    let down = match rng.u32(0..3) {
        0 => 0.0,
        1 => above,
        _ => within(rng, -0.5, 0.5),
    };
    Ok((eye, DVec3::new(within(rng, -1.0, 1.0), above - down, 0.0)))
}
