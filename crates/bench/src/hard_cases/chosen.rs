//! Scenes in which single precision was chosen and its errors were visible, or in which `f64` had errors too. The
//! oracle checks each backend pixel by pixel, as in [`super::nasty`].

use anyhow::Result;
use fastrand::Rng;
use glam::{DVec2, DVec3};
use rayfold_scene::{Camera, Cuboid, Material, Object, Pinhole, Scene, Screen, Sphere, Triangle};
use rayfold_tracer::precision;

use super::figures::{Figures, Size};
use super::nasty::{Kind, first_seed, judge_kinds, power, within};
use super::setup::direction;
use crate::backends::{Arithmetic, Backend};
use crate::scenes::light;

/// The share of pixels that may be wrong.
const FEW: f64 = 1e-4;

/// The share for whole numbers, which hit edges and corners exactly. There the last bit of any arithmetic decides.
const FEW_OF_WHOLE_NUMBERS: f64 = 5e-4;

/// Measures shadows whose occluder is up to 1e9 times as far away as the receiver.
pub(super) fn far_shadows(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    judge_kinds(&[("shadows of what is far away", far_shadow)], FEW, backends, size, figures)
}

/// Measures triangles as wide as the last bits of their corners.
pub(super) fn slivers(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    judge_kinds(&[("slivers", sliver)], FEW, backends, size, figures)
}

/// Measures spheres that are large compared with the objects on them.
pub(super) fn big_balls(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    let kinds: &[Kind] = &[
        ("things on a planet", planet),
        ("things on a mirror planet", mirror_planet),
        ("a room of mirror balls", mirror_room),
    ];
    judge_kinds(kinds, FEW, backends, size, figures)
}

/// Measures triangles in one slanted plane.
pub(super) fn one_plane(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    let kinds: &[Kind] = &[("triangles in one slanted plane", coplanar)];
    judge_kinds(kinds, FEW_OF_WHOLE_NUMBERS, backends, size, figures)
}

/// Measures needles that fill a telescope's view.
pub(super) fn telescopes(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    judge_kinds(&[("needles through a telescope", telescope)], FEW, backends, size, figures)
}

/// Measures rays through the edges of rectangles, parallel rays over large distances, and floors much larger than the
/// objects on them.
pub(super) fn edges(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    let kinds: &[Kind] = &[
        ("edges of rectangles", rectangles),
        ("far triangles in parallel rays", far_parallel),
        ("steep planes in parallel rays", steep_parallel),
        ("floors without an end", endless_floor),
    ];
    judge_kinds(kinds, FEW, backends, size, figures)
}

/// Checks that the chosen precision does not depend on the order of the objects.
pub(super) fn orders(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    let makes = [planet, mirror_planet, mirror_room, far_shadow, bubbles];
    let count = size.pick(300, 20_000);
    let (mut changed, mut single) = (0, 0);
    for seed in first_seed()..first_seed() + count {
        let mut rng = Rng::with_seed(seed);
        let mut scene = makes[(seed % makes.len() as u64) as usize](&mut rng)?;
        let chosen = precision(&scene);
        single += usize::from(chosen == rayfold_tracer::Precision::F32);
        for _ in 0..4 {
            let mut objects = scene.objects.to_vec();
            rng.shuffle(&mut objects);
            scene.objects = objects.into();
            changed += usize::from(precision(&scene) != chosen);
        }
    }
    anyhow::ensure!((count as usize / 50..count as usize).contains(&single), "{single} of {count} in `f32`");
    for backend in backends.iter().filter(|backend| backend.arithmetic == Arithmetic::Chosen).take(1) {
        figures.add(backend, "choices that depend on the order", 4 * count as usize, changed as f64, 0.0);
    }
    Ok(())
}

fn matte(rng: &mut Rng) -> Result<Material> {
    let mut color = || DVec3::new(rng.f64(), rng.f64(), rng.f64());
    Ok(Material::new(0.1 + 0.1 * color(), 0.3 + 0.5 * color(), DVec3::ZERO)?)
}

fn mirror(rng: &mut Rng) -> Result<Material> {
    let mut color = || DVec3::new(rng.f64(), rng.f64(), rng.f64());
    Ok(Material::new(0.1 * color(), 0.3 * color(), 0.3 + 0.6 * color())?)
}

/// Returns a direction towards the light, not near the horizon.
fn upwards(rng: &mut Rng) -> DVec3 {
    loop {
        let towards = direction(rng);
        if towards.y > 0.3 {
            return towards;
        }
    }
}

/// Returns a picture from a camera at the side, about 3 above the ground.
fn picture(rng: &mut Rng, objects: Vec<Object>, towards: DVec3) -> Result<Scene> {
    let eye = DVec3::new(within(rng, -1.0, 1.0), within(rng, 1.5, 3.5), 6.0);
    let screen = Screen::new(48, 36)?;
    let (low, high) = (DVec2::new(-0.4, -0.3), DVec2::new(0.4, 0.3));
    let camera = Pinhole::new(eye, DVec3::new(0.0, 0.3, 0.0) - eye, DVec3::Y, 1.0, low, high)?;
    let mut scene = Scene::new(screen, Camera::Pinhole(camera));
    scene.set_background(DVec3::new(0.2, 0.3, 0.5))?;
    scene.lights = vec![light(0.8, (-towards).to_array())?].into();
    let mut objects = objects;
    rng.shuffle(&mut objects);
    scene.objects = objects.into();
    Ok(scene)
}

fn floor(rng: &mut Rng) -> Result<Object> {
    Ok(Cuboid::new([DVec3::new(-3.0, -0.2, -3.0), DVec3::new(3.0, 0.0, 3.0)], matte(rng)?)?.into())
}

/// Makes a scene in which the edge of a shadow is among the visible objects.
fn far_shadow(rng: &mut Rng) -> Result<Scene> {
    let towards = upwards(rng);
    let mut objects = vec![floor(rng)?];
    for _ in 0..rng.usize(1..3) {
        let distance = power(rng, 1.0, 9.0);
        let size = distance * power(rng, -4.0, 0.0);
        let place = DVec3::new(within(rng, -2.0, 2.0), 0.0, within(rng, -2.0, 2.0)) + towards * distance;
        let aside = direction(rng).cross(towards).normalize_or_zero();
        let surface = matte(rng)?;
        objects.push(match rng.u32(0..3) {
            0 => Sphere::new(size, place + aside * size, surface)?.into(),
            1 => {
                // A vertical edge passes through the point.
                let far = place + DVec3::new(size, size * within(rng, 0.0, 1.0), size);
                Cuboid::new([place, far], surface)?.into()
            }
            _ => {
                let (u, v) = towards.any_orthonormal_pair();
                Triangle::new([place, place + size * u, place + size * (v - u)], surface)?.into()
            }
        });
    }
    let ball = DVec3::new(within(rng, -1.0, 1.0), 0.5, within(rng, -1.0, 1.0));
    objects.push(Sphere::new(0.5, ball, matte(rng)?)?.into());
    picture(rng, objects, towards)
}

/// Returns a number a few roundoffs away from `x`, or `x`.
fn shaken(rng: &mut Rng, x: f64) -> f64 {
    let most = [0, 0, 1, 2, 8][rng.usize(0..5)];
    if x == 0.0 { x } else { f64::from_bits((x.to_bits() as i64 + rng.i64(-most..=most)) as u64) }
}

fn sliver(rng: &mut Rng) -> Result<Scene> {
    let mut objects = vec![floor(rng)?];
    for _ in 0..rng.usize(1..4) {
        let mut corner = || {
            let tenth = |rng: &mut Rng, from: i32, to: i32| f64::from(rng.i32(from..to)) / 10.0;
            DVec3::new(tenth(rng, -30, 31), tenth(rng, 1, 12), tenth(rng, -30, 31))
        };
        let (a, b) = (corner(), corner());
        let along = [0.0, 0.0, 1.0, 1.0, 0.5, 0.3][rng.usize(0..6)];
        let near = a.lerp(b, along).to_array().map(|x| shaken(rng, x));
        objects.push(Triangle::new([a, b, near.into()], matte(rng)?)?.into());
    }
    let towards = upwards(rng);
    picture(rng, objects, towards)
}

/// Returns objects of about the size 1 on the top of a ball, at the origin or just above it.
fn things_on(rng: &mut Rng, ball: Sphere) -> Result<Vec<Object>> {
    let mut objects: Vec<Object> = Vec::new();
    for _ in 0..rng.usize(1..5) {
        let place = DVec3::new(within(rng, -2.0, 2.0), 0.0, within(rng, -2.0, 2.0));
        let gap = if rng.bool() { 0.0 } else { power(rng, -8.0, -1.0) };
        // The ball's surface below or above the plane y = 0.
        let on = |p: DVec3| {
            let sink = (p.x * p.x + p.z * p.z) / (2.0 * ball.radius());
            p + (gap - sink) * DVec3::Y
        };
        let size = within(rng, 0.3, 1.5);
        let surface = matte(rng)?;
        objects.push(match rng.u32(0..4) {
            0 => {
                let radius = 0.5 * size;
                Sphere::new(radius, on(place) + radius * DVec3::Y, surface)?.into()
            }
            1 => {
                let corner = place + gap * DVec3::Y;
                Cuboid::new([corner, corner + DVec3::new(size, 0.0, size)], surface)?.into()
            }
            2 => {
                let corner = on(place);
                Cuboid::new([corner, corner + DVec3::new(size, 0.3 * size, size)], surface)?.into()
            }
            _ => {
                let corners = [place, place + size * DVec3::X, place + size * DVec3::Z].map(on);
                Triangle::new(corners, surface)?.into()
            }
        });
    }
    objects.push(ball.into());
    Ok(objects)
}

fn planet(rng: &mut Rng) -> Result<Scene> {
    let radius = power(rng, 2.0, 6.0);
    let ball = Sphere::new(radius, -radius * DVec3::Y, matte(rng)?)?;
    let (objects, towards) = (things_on(rng, ball)?, upwards(rng));
    picture(rng, objects, towards)
}

fn mirror_planet(rng: &mut Rng) -> Result<Scene> {
    let radius = power(rng, 2.0, 6.0);
    let ball = Sphere::new(radius, -radius * DVec3::Y, mirror(rng)?)?;
    let (objects, towards) = (things_on(rng, ball)?, upwards(rng));
    picture(rng, objects, towards)
}

/// Makes a room whose walls are spheres that are almost planes.
fn mirror_room(rng: &mut Rng) -> Result<Scene> {
    let mut objects = Vec::new();
    for wall in [DVec3::NEG_Y, DVec3::X, DVec3::NEG_X, DVec3::NEG_Z] {
        let radius = power(rng, 2.0, 5.0);
        let surface = if rng.bool() { mirror(rng)? } else { matte(rng)? };
        let away = if wall == DVec3::NEG_Y { 0.0 } else { 3.0 };
        objects.push(Sphere::new(radius, (radius + away) * wall, surface)?.into());
    }
    for _ in 0..rng.usize(1..4) {
        let radius = within(rng, 0.2, 0.7);
        let place = DVec3::new(within(rng, -1.5, 1.5), radius, within(rng, -1.5, 1.5));
        let surface = if rng.bool() { mirror(rng)? } else { matte(rng)? };
        objects.push(Sphere::new(radius, place, surface)?.into());
    }
    let towards = upwards(rng);
    picture(rng, objects, towards)
}

/// Makes spheres of all sizes that almost touch each other from within.
fn bubbles(rng: &mut Rng) -> Result<Scene> {
    let mut objects = Vec::new();
    let top = DVec3::new(within(rng, -0.5, 0.5), 0.0, within(rng, -0.5, 0.5));
    let gap = power(rng, -8.0, -1.0);
    for k in 0..rng.usize(2..6) {
        let radius = power(rng, -0.5, 4.0);
        let center = top - DVec3::Y * (radius + f64::from(k as u32) * gap);
        objects.push(Sphere::new(radius, center, matte(rng)?)?.into());
    }
    let towards = upwards(rng);
    picture(rng, objects, towards)
}

/// Makes triangles with whole coordinates in one plane, seen from a position in multiples of 0.1.
fn coplanar(rng: &mut Rng) -> Result<Scene> {
    let whole =
        |rng: &mut Rng, most: i32| DVec3::from_array([(); 3].map(|()| f64::from(rng.i32(-most..=most))));
    let (start, u, v) = (whole(rng, 2), whole(rng, 3), whole(rng, 3));
    let mut objects: Vec<Object> = Vec::new();
    for k in 0..rng.usize(2..7) {
        let mut corner = || start + f64::from(rng.i32(-2..3)) * u + f64::from(rng.i32(-2..3)) * v;
        let corners = [corner(), corner(), corner()];
        let shown = DVec3::new(f64::from(k as u32 & 1), f64::from(k as u32 >> 1 & 1), 0.3 + 0.1 * k as f64);
        objects.push(Triangle::new(corners, Material::new(shown, DVec3::ZERO, DVec3::ZERO)?)?.into());
    }
    let mut tenth = |far: i32| f64::from(rng.i32(-far..=far)) / 10.0;
    let eye = DVec3::new(tenth(60), tenth(60), 14.0 + tenth(20));
    let target = start + DVec3::new(tenth(10), tenth(10), tenth(10));
    let (low, high) = (DVec2::new(-0.4, -0.3), DVec2::new(0.4, 0.3));
    let camera = Pinhole::new(eye, target - eye, DVec3::Y, 1.0, low, high)?;
    let mut scene = Scene::new(Screen::new(48, 36)?, Camera::Pinhole(camera));
    scene.objects = objects.into();
    Ok(scene)
}

fn telescope(rng: &mut Rng) -> Result<Scene> {
    let pixel = power(rng, -7.0, -4.0);
    let screen = Screen::new(48, 36)?;
    let away = power(rng, 0.0, 3.0);
    let (eye, gaze) = (direction(rng) * away, direction(rng));
    let target = eye + away * gaze;
    let (x, y) = gaze.any_orthonormal_pair();
    let width = pixel * 48.0 * away;
    let mut objects: Vec<Object> = Vec::new();
    for _ in 0..rng.usize(2..8) {
        let mut beside = || (rng.f64() - 0.5) * width;
        let tip = target + beside() * x + beside() * y;
        let thick = width * within(rng, 0.05, 0.3);
        let turn = DVec2::from_angle(within(rng, 0.0, std::f64::consts::TAU));
        let (along, across) = (turn.x * x + turn.y * y, turn.x * y - turn.y * x);
        let long = power(rng, 0.0, 2.0) * width;
        let slope = within(rng, -0.7, 0.7) * gaze;
        let base = tip + long * (along + slope);
        objects.push(Triangle::new([tip, base, base + thick * across], matte(rng)?)?.into());
    }
    let half = DVec2::new(24.0, 18.0) * pixel;
    let up = if gaze.y.abs() < 0.9 { DVec3::Y } else { DVec3::X };
    let camera = Pinhole::new(eye, gaze, up, 1.0, -half, half)?;
    let mut scene = Scene::new(screen, Camera::Pinhole(camera));
    scene.lights = vec![light(0.5, gaze.to_array())?].into();
    scene.objects = objects.into();
    Ok(scene)
}

/// Makes vertical and horizontal rectangles whose edges are hit by the rays of entire columns and rows, lit so that a
/// wrong normal is visible.
fn rectangles(rng: &mut Rng) -> Result<Scene> {
    let mut objects: Vec<Object> = Vec::new();
    for _ in 0..rng.usize(1..5) {
        let mut whole = || f64::from(rng.i32(-4..5));
        let (mut u, v) = (DVec3::new(whole(), whole(), whole()), DVec3::new(whole(), whole(), whole()));
        let flat = rng.usize(0..3);
        u[flat] = v[flat];
        if (0..3).all(|axis| axis == flat || u[axis] != v[axis]) {
            objects.push(Cuboid::new([u, v], matte(rng)?)?.into());
        }
    }
    let axis = rng.usize(0..3);
    let (back, up) = (DVec3::AXES[axis], DVec3::AXES[(axis + 1) % 3]);
    let camera = Pinhole::new(8.0 * back, -back, up, 1.0, DVec2::splat(-0.5), DVec2::splat(0.5))?;
    let mut scene = Scene::new(Screen::new(33, 33)?, Camera::Pinhole(camera));
    scene.lights =
        vec![light(0.8, direction(rng).to_array())?, light(0.8, direction(rng).to_array())?].into();
    scene.objects = objects.into();
    Ok(scene)
}

fn far_parallel(rng: &mut Rng) -> Result<Scene> {
    let away = power(rng, 0.0, 20.0);
    let mut objects: Vec<Object> = Vec::new();
    for _ in 0..rng.usize(2..8) {
        let mut corner = || DVec3::new(within(rng, -5.0, 40.0), within(rng, -5.0, 30.0), -away);
        let corners = [corner(), corner(), corner()];
        objects.push(Triangle::new(corners, matte(rng)?)?.into());
    }
    let mut scene = Scene::new(Screen::new(36, 27)?, Camera::Orthographic);
    scene.lights = vec![light(0.8, [0.2, 0.3, -1.0])?].into();
    scene.objects = objects.into();
    Ok(scene)
}

/// Makes triangles that are steep to parallel rays, over any distance. The planes of some contain the rays of a row.
fn steep_parallel(rng: &mut Rng) -> Result<Scene> {
    let away = power(rng, 0.0, 13.0);
    let mut objects: Vec<Object> = Vec::new();
    for _ in 0..rng.usize(1..6) {
        let level = rng.bool();
        let mut corner = || {
            let y = if rng.usize(0..3) == 0 { 0.0 } else { within(rng, -5.0, 30.0) };
            DVec3::new(within(rng, -5.0, 40.0), y, -away * within(rng, 0.1, 1.0))
        };
        let (a, b, mut c) = (corner(), corner(), corner());
        if level {
            c = DVec3::new(c.x, 0.0, 0.0);
        }
        objects.push(Triangle::new([a, b, c], matte(rng)?)?.into());
    }
    let mut scene = Scene::new(Screen::new(36, 27)?, Camera::Orthographic);
    scene.lights = vec![light(0.8, [0.2, 0.3, -1.0])?, light(0.8, direction(rng).to_array())?].into();
    scene.objects = objects.into();
    Ok(scene)
}

/// Makes rectangles and triangles at height 0 of sizes up to 1e20, and small objects on them.
fn endless_floor(rng: &mut Rng) -> Result<Scene> {
    let far = power(rng, 1.0, 20.0);
    let mut objects: Vec<Object> = Vec::new();
    if rng.bool() {
        let corner = DVec3::new(far * within(rng, 0.1, 1.0), 0.0, far * within(rng, 0.1, 1.0));
        objects.push(Cuboid::new([-corner, corner], matte(rng)?)?.into());
    } else {
        let mut corner = |x: f64, z: f64| {
            DVec3::new(x * far * within(rng, 0.5, 1.0), 0.0, z * far * within(rng, 0.5, 1.0))
        };
        let corners = [corner(-1.0, 1.0), corner(1.0, 1.0), corner(0.0, -1.0)];
        objects.push(Triangle::new(corners, matte(rng)?)?.into());
    }
    for _ in 0..rng.usize(0..4) {
        let (radius, x, z) = (within(rng, 0.1, 0.8), within(rng, -2.0, 2.0), within(rng, -3.0, 2.0));
        objects.push(Sphere::new(radius, DVec3::new(x, radius, z), matte(rng)?)?.into());
    }
    let towards = upwards(rng);
    picture(rng, objects, towards)
}
