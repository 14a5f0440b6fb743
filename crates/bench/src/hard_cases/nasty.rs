//! Random scenes that are difficult for ray tracers. The oracle checks each backend pixel by pixel.
//!
//! A pixel is wrong if its colour is off by more than 2 levels from every colour that the oracle sees within a
//! sixteenth of a pixel. An outline, the edge of a shadow or a chain of mirrors may therefore amplify a rounding error
//! up to that distance.

use anyhow::Result;
use fastrand::Rng;
use glam::{DVec2, DVec3};
use image::RgbImage;
use rayfold_scene::{Camera, Cuboid, Material, Object, Pinhole, Scene, Screen, Sphere, Triangle};
use rayon::prelude::*;

use super::figures::{Figures, Size, unless_single};
use super::setup::direction;
use crate::backends::{Backend, reference};
use crate::oracle;
use crate::scenes::{light, moved};

/// The tolerated displacement, in pixels.
const BESIDE: f64 = 1.0 / 16.0;

/// The tolerated difference of a colour, in levels.
const LEVELS: f64 = 2.0;

/// The name of a kind of scenes, and the function that makes one.
pub(super) type Kind = (&'static str, fn(&mut Rng) -> Result<Scene>);

/// The share of pixels that may be wrong. These are rays that hit corners or the edges of needles exactly, where the
/// last bit of any arithmetic decides which object is nearer.
const FEW: f64 = 5e-4;

pub(super) const KINDS: &[Kind] = &[
    ("objects of all scales", of_all_scales),
    ("faces in one plane", coplanar),
    ("faces almost in one plane", almost_coplanar),
    ("slanted faces and spheres almost in one place", almost_coincident),
    ("an eye within objects", from_within),
    ("mirrors face to face", mirrors),
    ("needles", needles),
    ("equal objects", equal),
    ("far from the origin", far_off),
    ("in other units", in_other_units),
    ("views of all angles", of_all_angles),
    ("images of odd shapes", odd_screens),
    ("whole numbers", whole_numbers),
    ("parallel rays", parallel),
    ("bright lights", bright),
];

/// Returns the random scene of a seed and its name.
fn scene(seed: u64) -> Result<(&'static str, Scene)> {
    let (name, make) = KINDS[(seed % KINDS.len() as u64) as usize];
    Ok((name, make(&mut Rng::with_seed(seed))?))
}

/// Returns a scene of each kind, large enough to look at.
pub(crate) fn one_of_each(side: u32) -> Result<Vec<(&'static str, Scene)>> {
    let first = super::SEED / KINDS.len() as u64 * KINDS.len() as u64;
    (first..first + KINDS.len() as u64)
        .map(|seed| {
            let (name, mut scene) = scene(seed)?;
            if scene.screen.width().min(scene.screen.height()) > 20 {
                scene.screen = Screen::new(side, side)?;
            }
            Ok((name, scene))
        })
        .collect()
}

/// Returns the seed of the first scene: [`super::SEED`], unless `RAYFOLD_SEED` overrides it.
pub(super) fn first_seed() -> u64 {
    std::env::var("RAYFOLD_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(super::SEED)
}

/// Checks every backend on every kind of scene.
pub(super) fn scenes(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    judge_kinds(KINDS, FEW, backends, size, figures)
}

/// Checks every backend on scenes of these kinds. `few` is the share of pixels that may be wrong.
pub(super) fn judge_kinds(
    kinds: &[Kind],
    few: f64,
    backends: &[Backend],
    size: Size,
    figures: &mut Figures,
) -> Result<()> {
    let rounds = size.pick(2, 60);
    let first = first_seed() / kinds.len() as u64 * kinds.len() as u64;
    for (kind, (name, make)) in (0..).zip(kinds) {
        let mut wrong = vec![Vec::new(); backends.len()];
        let mut pixels = 0;
        for round in 0..rounds {
            let seed = first + round * kinds.len() as u64 + kind;
            let scene = make(&mut Rng::with_seed(seed))?;
            pixels += scene.screen.pixels() as usize;
            let drawn = backends.iter().map(|backend| backend.render(&scene)).collect::<Result<Vec<_>>>()?;
            for (wrong, count) in wrong.iter_mut().zip(judge(&scene, &drawn, size.pick(30, 100), seed)?) {
                if count > 0 {
                    wrong.push((seed, count));
                }
            }
        }
        for (backend, wrong) in backends.iter().zip(wrong) {
            let count: usize = wrong.iter().map(|(_, count)| count).sum();
            let bound = few * pixels as f64;
            let seeds: Vec<String> = wrong.iter().take(4).map(|(seed, _)| seed.to_string()).collect();
            let seeds = if seeds.is_empty() { String::new() } else { format!(", seeds {}", seeds.join(" ")) };
            figures.add(
                backend,
                format!("{name}: wrong pixels{seeds}"),
                pixels,
                count as f64,
                unless_single(backend, bound),
            );
        }
    }
    Ok(())
}

/// Returns the number of wrong pixels of each image. Checks the pixels at which an image differs from the plain
/// tracer's, and `samples` others.
fn judge(scene: &Scene, images: &[RgbImage], samples: usize, seed: u64) -> Result<Vec<usize>> {
    let plain = reference().render(scene)?;
    let (width, height) = plain.dimensions();
    let mut rng = Rng::with_seed(!seed);
    let mut doubtful: Vec<(u32, u32)> = plain
        .enumerate_pixels()
        .filter(|(x, y, pixel)| images.iter().any(|image| apart(image.get_pixel(*x, *y), pixel) > 2))
        .map(|(x, y, _)| (x, y))
        .collect();
    doubtful.extend((0..samples).map(|_| (rng.u32(0..width), rng.u32(0..height))));
    doubtful.sort_unstable();
    doubtful.dedup();
    let verdicts: Vec<Vec<bool>> = doubtful
        .into_par_iter()
        .map(|(x, y)| {
            let (i, j) = (f64::from(x), f64::from(height - 1 - y));
            let exact = shown(scene, i, j);
            let is_off = |image: &RgbImage, range| is_off(image.get_pixel(x, y).0, range);
            if images.iter().all(|image| !is_off(image, (exact, exact))) {
                return vec![false; images.len()];
            }
            let range = around(scene, (i, j), exact);
            images.iter().map(|image| is_off(image, range)).collect()
        })
        .collect();
    let count = |image: usize| verdicts.iter().filter(|verdict| verdict[image]).count();
    Ok((0..images.len()).map(count).collect())
}

/// Returns whether a pixel's colour is wrong. Its row counts from the top.
pub(crate) fn is_wrong_at(scene: &Scene, (x, y): (u32, u32), color: [u8; 3]) -> bool {
    let (i, j) = (f64::from(x), f64::from(scene.screen.height() - 1 - y));
    let exact = exact_at(scene, (x, y));
    is_off(color, (exact, exact)) && is_off(color, around(scene, (i, j), exact))
}

/// Returns the oracle's colour of a pixel, as levels before rounding.
pub(crate) fn exact_at(scene: &Scene, (x, y): (u32, u32)) -> DVec3 {
    shown(scene, f64::from(x), f64::from(scene.screen.height() - 1 - y))
}

/// Returns whether a channel of the colour is outside the range of these two by more than [`LEVELS`].
fn is_off(color: [u8; 3], (from, to): (DVec3, DVec3)) -> bool {
    let color = DVec3::from_array(color.map(f64::from));
    (from - color).max(color - to).max_element() > LEVELS
}

/// Returns the least and the greatest value of each channel over the colours that the oracle sees at a pixel (`exact`)
/// and beside it.
fn around(scene: &Scene, (i, j): (f64, f64), exact: DVec3) -> (DVec3, DVec3) {
    let (mut from, mut to) = (exact, exact);
    for turn in 0..8 {
        let aside = DVec2::from_angle(f64::from(turn) * std::f64::consts::TAU / 8.0) * BESIDE;
        let beside = shown(scene, i + aside.x, j + aside.y);
        (from, to) = (from.min(beside), to.max(beside));
    }
    (from, to)
}

/// Returns the oracle's colour as levels before rounding.
fn shown(scene: &Scene, x: f64, y: f64) -> DVec3 {
    oracle::shown(scene.tone, oracle::color_at(scene, x, y))
}

fn apart(a: &image::Rgb<u8>, b: &image::Rgb<u8>) -> u8 {
    a.0.iter().zip(b.0).map(|(a, b)| a.abs_diff(b)).max().unwrap_or(0)
}

pub(super) fn within(rng: &mut Rng, from: f64, to: f64) -> f64 {
    from + (to - from) * rng.f64()
}

/// Returns a random number whose logarithm is uniformly distributed.
pub(super) fn power(rng: &mut Rng, from: f64, to: f64) -> f64 {
    10f64.powf(within(rng, from, to))
}

pub(super) fn point(rng: &mut Rng, size: f64) -> DVec3 {
    DVec3::new(rng.f64() - 0.5, rng.f64() - 0.5, rng.f64() - 0.5) * 2.0 * size
}

pub(super) fn color(rng: &mut Rng) -> DVec3 {
    DVec3::new(rng.f64(), rng.f64(), rng.f64())
}

fn matte(rng: &mut Rng) -> Result<Material> {
    Ok(Material::new(0.3 * color(rng), 0.6 * color(rng), DVec3::ZERO)?)
}

fn shiny(rng: &mut Rng) -> Result<Material> {
    Ok(Material::new(0.2 * color(rng), 0.5 * color(rng), 0.6 * color(rng))?)
}

fn sphere(rng: &mut Rng, radius: f64, center: DVec3) -> Result<Object> {
    let surface = if rng.bool() { shiny(rng)? } else { matte(rng)? };
    Ok(Object::Sphere(Sphere::new(radius, center, surface)?))
}

fn cuboid(rng: &mut Rng, u: DVec3, v: DVec3) -> Result<Object> {
    Ok(Object::Cuboid(Cuboid::new([u, v], matte(rng)?)?))
}

fn triangle(rng: &mut Rng, vertices: [DVec3; 3]) -> Result<Object> {
    Ok(Object::Triangle(Triangle::new(vertices, matte(rng)?)?))
}

/// Returns a random object of about this size.
fn any(rng: &mut Rng, at: DVec3, size: f64) -> Result<Object> {
    match rng.u32(0..3) {
        0 => sphere(rng, 0.5 * size, at),
        1 => {
            let reach = point(rng, 0.7 * size);
            cuboid(rng, at, at + reach)
        }
        _ => {
            let vertices = [at, at + point(rng, size), at + point(rng, size)];
            triangle(rng, vertices)
        }
    }
}

fn seen_from(eye: DVec3, target: DVec3, half: f64, screen: Screen) -> Result<Camera> {
    let half = DVec2::new(1.0, f64::from(screen.height()) / f64::from(screen.width())) * half;
    Ok(Camera::Pinhole(Pinhole::new(eye, target - eye, DVec3::new(0.1, 1.0, 0.05), 1.0, -half, half)?))
}

/// Returns a picture of the objects, lit.
fn picture(rng: &mut Rng, objects: Vec<Object>, eye: DVec3, target: DVec3) -> Result<Scene> {
    let screen = Screen::new(rng.u32(24..48), rng.u32(24..48))?;
    let mut scene = Scene::new(screen, seen_from(eye, target, 0.5, screen)?);
    scene.set_background(color(rng))?;
    scene.objects = objects.into();
    let lights: Result<Vec<_>, _> =
        (0..rng.u32(1..3)).map(|_| light(0.7, direction(rng).to_array())).collect();
    scene.lights = lights?.into();
    Ok(scene)
}

fn heap(rng: &mut Rng, count: usize) -> Result<Vec<Object>> {
    (0..count)
        .map(|_| {
            let (at, size) = (point(rng, 2.0), within(rng, 0.3, 1.5));
            any(rng, at, size)
        })
        .collect()
}

fn of_all_scales(rng: &mut Rng) -> Result<Scene> {
    let range = [3.0, 6.0, 12.0, 30.0][rng.usize(0..4)];
    let objects: Result<Vec<_>> = (0..rng.usize(2..24))
        .map(|_| {
            let size = power(rng, -range, 0.0);
            let at = (direction(rng) + DVec3::NEG_Z) * size * within(rng, 1.0, 5.0);
            any(rng, at, size)
        })
        .collect();
    picture(rng, objects?, DVec3::ZERO, DVec3::NEG_Z)
}

/// Returns boxes, rectangles and triangles whose faces lie in a few planes. The object that comes first in the script
/// is visible.
fn stack(rng: &mut Rng, gap: f64) -> Result<Vec<Object>> {
    let levels = [-1.0, -0.3, 0.4];
    (0..rng.usize(3..20))
        .map(|k| {
            let low = levels[rng.usize(0..3)] + gap * k as f64;
            let (from, to) = (point(rng, 2.0), point(rng, 2.0));
            let (u, v) = (DVec3::new(from.x, low, from.z), DVec3::new(to.x, low, to.z));
            match rng.u32(0..3) {
                0 => cuboid(rng, u, v),
                1 => cuboid(rng, u, v - DVec3::Y * 0.5),
                _ => {
                    let third = DVec3::new(from.x, low, to.z);
                    triangle(rng, [u, v, third])
                }
            }
        })
        .collect()
}

fn coplanar(rng: &mut Rng) -> Result<Scene> {
    let objects = stack(rng, 0.0)?;
    let eye = DVec3::new(within(rng, -2.0, 2.0), within(rng, -2.0, 4.0), 6.0);
    picture(rng, objects, eye, DVec3::ZERO)
}

fn almost_coplanar(rng: &mut Rng) -> Result<Scene> {
    let gap = power(rng, -12.0, -2.0);
    let mut objects = stack(rng, gap)?;
    if rng.bool() {
        objects.push(sphere(rng, 1.0, DVec3::new(0.0, 1.5, -1.0))?);
    }
    let eye = DVec3::new(within(rng, -2.0, 2.0), within(rng, -2.0, 4.0), 6.0);
    picture(rng, objects, eye, DVec3::ZERO)
}

fn almost_coincident(rng: &mut Rng) -> Result<Scene> {
    let gap = power(rng, -12.0, -2.0);
    let normal = direction(rng);
    let (u, v) = normal.any_orthonormal_pair();
    let mut objects = Vec::new();
    for layer in 0..rng.usize(2..12) {
        let corner = |rng: &mut Rng| within(rng, -2.0, 2.0) * u + within(rng, -2.0, 2.0) * v;
        let vertices = [corner(rng), corner(rng), corner(rng)].map(|p| p + gap * layer as f64 * normal);
        objects.push(triangle(rng, vertices)?);
    }
    let (center, radius) = (point(rng, 1.0), within(rng, 0.3, 1.0));
    for layer in 0..rng.usize(1..4) {
        let surface = matte(rng)?;
        let center = center + direction(rng) * gap * rng.f64();
        objects.push(Object::Sphere(Sphere::new(radius + gap * layer as f64, center, surface)?));
    }
    let eye = DVec3::new(within(rng, -2.0, 2.0), within(rng, -2.0, 4.0), 6.0);
    picture(rng, objects, eye, DVec3::ZERO)
}

fn from_within(rng: &mut Rng) -> Result<Scene> {
    let eye = point(rng, 1.0);
    let mut objects = heap(rng, 6)?;
    let size = power(rng, 0.2, 3.0);
    let aside = direction(rng) * size;
    objects.push(match rng.u32(0..3) {
        0 => sphere(rng, 2.0 * size, eye + aside)?,
        1 => cuboid(rng, eye - DVec3::new(size, 1.5, 3.0), eye + DVec3::new(2.0, size, 0.5))?,
        // The eye is on the surface.
        _ => sphere(rng, size, eye + size * DVec3::Y)?,
    });
    let target = eye + direction(rng);
    picture(rng, objects, eye, target)
}

fn mirrors(rng: &mut Rng) -> Result<Scene> {
    let mut objects = heap(rng, 8)?;
    for side in [DVec3::X, DVec3::NEG_X, DVec3::NEG_Z] {
        let radius = power(rng, 0.3, 3.0);
        let bright = Material::new(DVec3::splat(0.02), DVec3::splat(0.1), DVec3::splat(0.85))?;
        objects.push(Object::Sphere(Sphere::new(radius, side * (radius + 2.5), bright)?));
    }
    picture(rng, objects, DVec3::new(0.3, 0.2, 2.4), DVec3::ZERO)
}

fn needles(rng: &mut Rng) -> Result<Scene> {
    let objects: Result<Vec<_>> = (0..rng.usize(10..90))
        .map(|_| {
            let (tip, along, thickness) = (point(rng, 2.0), direction(rng), power(rng, -9.0, -1.0));
            let across = direction(rng) * thickness;
            let vertices = [tip, tip + 3.0 * along, tip + 3.0 * along + across];
            triangle(rng, vertices)
        })
        .collect();
    let mut objects = objects?;
    objects.push(sphere(rng, 1.0, DVec3::NEG_Z)?);
    picture(rng, objects, DVec3::new(0.0, 1.0, 6.0), DVec3::ZERO)
}

fn equal(rng: &mut Rng) -> Result<Scene> {
    let shapes = heap(rng, 5)?;
    let count = [10, 60, 300][rng.usize(0..3)];
    let objects: Result<Vec<_>> = (0..count)
        .map(|_| {
            let surface = matte(rng)?;
            let object = &shapes[rng.usize(0..shapes.len())];
            Ok(match object {
                Object::Sphere(s) => Object::Sphere(Sphere::new(s.radius(), s.center(), surface)?),
                Object::Cuboid(c) => Object::Cuboid(Cuboid::new(*c.corners(), surface)?),
                Object::Triangle(t) => Object::Triangle(Triangle::new(*t.vertices(), surface)?),
                _ => unreachable!("not drawn here: {object:?}"),
            })
        })
        .collect();
    picture(rng, objects?, DVec3::new(0.0, 1.0, 6.0), DVec3::ZERO)
}

fn far_off(rng: &mut Rng) -> Result<Scene> {
    let objects = heap(rng, 12)?;
    let scene = picture(rng, objects, DVec3::new(0.0, 1.0, 6.0), DVec3::ZERO)?;
    let offset = direction(rng) * power(rng, 4.0, 14.0);
    moved(&scene, 1.0, offset)
}

fn in_other_units(rng: &mut Rng) -> Result<Scene> {
    let objects = heap(rng, 12)?;
    let scene = picture(rng, objects, DVec3::new(0.0, 1.0, 6.0), DVec3::ZERO)?;
    let scale = power(rng, -305.0, 305.0);
    moved(&scene, scale, DVec3::ZERO)
}

fn of_all_angles(rng: &mut Rng) -> Result<Scene> {
    let objects = heap(rng, 12)?;
    let eye = direction(rng) * 6.0;
    let mut scene = picture(rng, objects, eye, DVec3::ZERO)?;
    let half = power(rng, -8.0, 3.0);
    scene.camera = seen_from(eye, DVec3::ZERO, half, scene.screen)?;
    Ok(scene)
}

fn odd_screens(rng: &mut Rng) -> Result<Scene> {
    let objects = heap(rng, 12)?;
    let mut scene = picture(rng, objects, DVec3::new(0.0, 1.0, 6.0), DVec3::ZERO)?;
    let (width, height) = [(1, 1), (1, 200), (200, 1), (3, 2), (8, 300), (300, 5), (17, 33)][rng.usize(0..7)];
    scene.screen = Screen::new(width, height)?;
    let Camera::Pinhole(p) = scene.camera else { return Ok(scene) };
    // As the language allows: mirrored, and off the axis.
    let (a, b) = (DVec2::new(0.6, -0.3), DVec2::new(-0.2, 0.5));
    scene.camera = Camera::Pinhole(Pinhole::new(p.eye(), p.gaze(), p.up(), 1.0, a, b)?);
    Ok(scene)
}

/// Makes a scene with rays that hit edges, corners and planes exactly.
fn whole_numbers(rng: &mut Rng) -> Result<Scene> {
    let whole = |rng: &mut Rng| DVec3::from_array([(); 3].map(|()| f64::from(rng.i32(-4..5))));
    let objects: Result<Vec<_>> = (0..rng.usize(2..40))
        .map(|_| match rng.u32(0..3) {
            0 => {
                let (radius, center) = (f64::from(rng.u32(1..4)), whole(rng));
                sphere(rng, radius, center)
            }
            1 => {
                let (u, v) = (whole(rng), whole(rng));
                cuboid(rng, u, v)
            }
            _ => {
                let vertices = [whole(rng), whole(rng), whole(rng)];
                triangle(rng, vertices)
            }
        })
        .collect();
    let screen = Screen::new(33, 33)?;
    let axis = rng.usize(0..3);
    let (back, up) = (DVec3::AXES[axis], DVec3::AXES[(axis + 1) % 3]);
    let eye = 8.0 * back;
    let camera = Pinhole::new(eye, -back, up, 1.0, DVec2::splat(-0.5), DVec2::splat(0.5))?;
    let mut scene = Scene::new(screen, Camera::Pinhole(camera));
    scene.set_background(color(rng))?;
    scene.objects = objects?.into();
    scene.lights = vec![light(0.5, [-1.0, -1.0, -1.0])?, light(0.4, [0.0, -1.0, 0.0])?].into();
    Ok(scene)
}

fn parallel(rng: &mut Rng) -> Result<Scene> {
    let scale = power(rng, 0.0, 2.0);
    let objects: Result<Vec<_>> = (0..rng.usize(2..100))
        .map(|_| {
            let at = point(rng, 30.0) + DVec3::new(20.0, 20.0, -40.0 * scale);
            let size = power(rng, 0.0, 1.5);
            any(rng, at, size)
        })
        .collect();
    let mut scene = picture(rng, objects?, DVec3::ZERO, DVec3::NEG_Z)?;
    scene.camera = Camera::Orthographic;
    Ok(scene)
}

fn bright(rng: &mut Rng) -> Result<Scene> {
    let glare = power(rng, 0.0, 8.0);
    let signed = |rng: &mut Rng| (color(rng) * 2.0 - 1.0) * glare;
    let objects: Result<Vec<_>> = heap(rng, 10)?
        .into_iter()
        .map(|object| {
            let (ambient, diffuse) = (signed(rng), signed(rng));
            let mirror = if rng.bool() { signed(rng) } else { DVec3::ZERO };
            Ok(match object {
                Object::Sphere(s) => {
                    let surface = Material::new(ambient, diffuse, mirror)?;
                    Object::Sphere(Sphere::new(s.radius(), s.center(), surface)?)
                }
                Object::Cuboid(c) => {
                    let surface = Material::new(ambient, diffuse, DVec3::ZERO)?;
                    Object::Cuboid(Cuboid::new(*c.corners(), surface)?)
                }
                Object::Triangle(t) => {
                    let surface = Material::new(ambient, diffuse, DVec3::ZERO)?;
                    Object::Triangle(Triangle::new(*t.vertices(), surface)?)
                }
                _ => unreachable!("not drawn here: {object:?}"),
            })
        })
        .collect();
    picture(rng, objects?, DVec3::new(0.0, 1.0, 6.0), DVec3::ZERO)
}
