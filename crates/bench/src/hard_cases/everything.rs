//! Random scenes with all features of the language: every shape, material, pattern, light and camera. The oracle checks
//! each backend pixel by pixel, as in [`super::nasty`].

use std::sync::Arc;

use anyhow::Result;
use fastrand::Rng;
use glam::{DMat3, DVec3, Vec3Swizzles};
use rayfold_scene::model::{Finish, Glass, Pattern, Shine, Weight};
use rayfold_scene::{
    Background, Camera, Capsule, Coefficients, Cone, Cuboid, Cylinder, Depth, Disc, Fog, Instance, Lamp,
    Light, Look, Material, Object, Placement, Plane, Roundbox, Scene, Screen, Sphere, Tone, Torus, Triangle,
};

use super::figures::{Figures, Size};
use super::images::off_by_more_than;
use super::nasty::{Kind, color, first_seed, judge_kinds, point, power, within};
use super::setup::direction;
use crate::backends::Backend;
use crate::scenes::{light, moved};

/// The share of pixels that may be wrong: rays that hit rims, tips and walls between cells exactly.
const FEW: f64 = 5e-4;

pub(super) const KINDS: &[Kind] = &[
    ("all shapes", all_shapes),
    ("glass", of_glass),
    ("panes in stacks and glass in glass", stacked),
    ("patterns", patterned),
    ("patterns on the walls of cells", on_walls),
    ("groups", grouped),
    ("groups and their copies", copies),
    ("lamps among surfaces", lamps),
    ("an eye within and on curved bodies", from_within),
    ("whole numbers", whole_numbers),
    ("tori, thick and thin", tori),
    ("curved mirrors in a chain", mirrors),
    ("planes to the horizon", horizon),
    ("far and tiny", far_and_tiny),
    ("parallel rays", parallel),
    ("needles and flat cones", slender),
];

/// Checks every backend on every kind of scene.
pub(super) fn scenes(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    judge_kinds(KINDS, FEW, backends, size, figures)
}

/// Checks that pictures are the same bit for bit if the unit changes by a power of two.
pub(super) fn scaled_by_two(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    let mut rng = Rng::with_seed(first_seed());
    let exponents = size.pick(vec![-300, -1, 40], (-500..=500).step_by(50).collect());
    // Pixels of a parallel projection have the size 1, and the scenes named "far and tiny" have fixed sizes.
    let made = KINDS.iter().filter(|(name, _)| !["parallel rays", "far and tiny"].contains(name));
    let scenes: Vec<Scene> = made.map(|(_, make)| make(&mut rng)).collect::<Result<_>>()?;
    for backend in backends {
        let (mut different, mut pixels) = (0, 0);
        for scene in &scenes {
            let image = backend.render(scene)?;
            for &exponent in &exponents {
                let other = backend.render(&scaled(scene, 2f64.powi(exponent))?)?;
                different += off_by_more_than(0, &image, &other);
                pixels += image.pixels().len();
            }
        }
        let what = format!("pixels that differ at all, seed {}", first_seed());
        figures.add(backend, what, pixels, different as f64, 0.0);
    }
    Ok(())
}

/// Returns the scene in another unit.
pub(crate) fn scaled(scene: &Scene, scale: f64) -> Result<Scene> {
    let place = |p: DVec3| scale * p;
    let mut scaled = scene.clone();
    let look = match &scene.camera {
        Camera::Look(look) => look,
        Camera::Pinhole(_) => return moved(scene, scale, DVec3::ZERO),
        Camera::Orthographic => anyhow::bail!("only a camera with an eye is scaled"),
    };
    let up = Some(look.up());
    let look = Look::new(place(look.eye()), place(look.target()), look.field_of_view(), up)?;
    scaled.camera = Camera::Look(look);
    let objects = scene.objects.iter().map(|object| with_cells(object.placed(scale, place)?, scale));
    scaled.objects = objects.collect::<Result<Vec<_>>>()?.into();
    let lights = scene.lights.iter().map(|light| match light {
        Light::Lamp(lamp) => {
            let (radius, reach) = (scale * lamp.radius(), scale * lamp.reach());
            Ok(Lamp::new(lamp.color(), place(lamp.position()), radius, reach)?.into())
        }
        Light::Directional(_) => Ok(*light),
    });
    scaled.lights = lights.collect::<Result<Vec<_>>>()?.into();
    scaled.fog = fog_scaled(scene, scale)?;
    Ok(scaled)
}

/// Returns the fog of a scene in another unit.
pub(crate) fn fog_scaled(scene: &Scene, scale: f64) -> Result<Fog> {
    Ok(match scene.fog.get() {
        Some((color, distance)) => Fog::new(color, scale * distance)?,
        None => scene.fog,
    })
}

/// Returns the object with the cells of its pattern scaled. Those of groups are in the units of the group.
fn with_cells(object: Object, scale: f64) -> Result<Object> {
    let material = object.material();
    let Some(finish) = material.finish() else { return Ok(object) };
    let Some(pattern) = finish.pattern else { return Ok(object) };
    let weight = match pattern.weight {
        Weight::Checker(size) => Weight::Checker(scale * size),
        Weight::Stripes(size) => Weight::Stripes(scale * size),
        Weight::Noise(size) => Weight::Noise(scale * size),
        Weight::Gradient(start, end) => Weight::Gradient(scale * start, scale * end),
    };
    let pattern = Some(Pattern { weight: weight.checked()?, ..pattern });
    let material = Material::finished(material.coefficients(), Finish { pattern, ..finish.clone() });
    Ok(object.with_material(material)?)
}

fn coefficients(rng: &mut Rng, mirror: f64) -> Result<Coefficients> {
    Ok(Coefficients::new(0.3 * color(rng), 0.6 * color(rng), mirror * color(rng))?)
}

fn shine(rng: &mut Rng) -> Result<Shine> {
    Ok(Shine::new(0.6 * color(rng), power(rng, 0.0, 4.0))?)
}

fn weight(rng: &mut Rng) -> Result<Weight> {
    let size = power(rng, -1.0, 0.5);
    let weight = match rng.u32(0..4) {
        0 => Weight::Checker(size),
        1 => Weight::Stripes(size),
        2 => Weight::Noise(size),
        _ => Weight::Gradient(within(rng, -1.0, 0.0), within(rng, 0.1, 1.0)),
    };
    Ok(weight.checked()?)
}

fn plain(rng: &mut Rng) -> Result<Material> {
    let mirror = if rng.bool() { 0.5 } else { 0.0 };
    let shine = if rng.u8(0..3) == 0 { Some(shine(rng)?) } else { None };
    let coefficients = coefficients(rng, mirror)?;
    Ok(Material::finished(coefficients, Finish { shine, ..Finish::default() }))
}

fn pattern(rng: &mut Rng) -> Result<Material> {
    let pattern = Pattern { weight: weight(rng)?, other: coefficients(rng, 0.3)? };
    let coefficients = coefficients(rng, 0.0)?;
    Ok(Material::finished(coefficients, Finish { pattern: Some(pattern), ..Finish::default() }))
}

fn glass(rng: &mut Rng) -> Result<Material> {
    let ior = [1.5, 1.33, 2.4, 0.7, 1.0][rng.usize(0..5)];
    let glass = Glass::new(0.5 + 0.5 * color(rng), ior)?;
    let shine = if rng.bool() { Some(shine(rng)?) } else { None };
    let coefficients = Coefficients::new(0.05 * color(rng), 0.1 * color(rng), DVec3::ZERO)?;
    Ok(Material::finished(coefficients, Finish { glass: Some(glass), shine, ..Finish::default() }))
}

fn some(rng: &mut Rng) -> Result<Material> {
    // By dice of its own, so that a seed keeps its other numbers.
    let mut dice = rng.clone();
    let material = match rng.u8(0..4) {
        0 => glass(rng),
        1 => pattern(rng),
        _ => plain(rng),
    }?;
    if dice.u8(0..8) != 7 {
        return Ok(material);
    }
    let finish = Finish { glow: 0.4 * color(&mut dice), ..material.finish().cloned().unwrap_or_default() };
    Ok(Material::finished(material.coefficients(), finish))
}

/// Returns a random object of about this size.
fn any(rng: &mut Rng, at: DVec3, size: f64, material: Material) -> Result<Object> {
    // By dice of its own, so that a seed keeps its other numbers.
    let mut dice = rng.clone();
    let rare = dice.u8(0..8);
    let object: Object = match rng.u32(0..8) {
        0 => Sphere::new(0.5 * size, at, material)?.into(),
        1 => Cuboid::new([at, at + point(rng, 0.7 * size)], material)?.into(),
        2 => Triangle::new([at, at + point(rng, size), at + point(rng, size)], material)?.into(),
        3 => Disc::new(0.5 * size, at, direction(rng), material)?.into(),
        4 => Cylinder::new(within(rng, 0.05, 0.5) * size, [at, at + size * direction(rng)], material)?.into(),
        5 => {
            let radii = [within(rng, 0.1, 0.6) * size, 0.0];
            Cone::new(radii, [at, at + size * direction(rng)], material)?.into()
        }
        6 => {
            let radii = [within(rng, 0.1, 0.6) * size, within(rng, 0.0, 0.6) * size];
            Cone::new(radii, [at, at + size * direction(rng)], material)?.into()
        }
        _ => {
            let radius = 0.4 * size;
            Torus::new(radius, within(rng, 0.05, 0.95) * radius, at, direction(rng), material)?.into()
        }
    };
    if rare == 1 {
        let half = 0.5 * size * DVec3::new(dice.f64(), dice.f64(), dice.f64()).max(DVec3::splat(0.05));
        let share = [0.0, 1e-9, 1.0, within(&mut dice, 0.01, 1.0)][dice.usize(0..4)];
        let radius = share * half.min_element();
        return Ok(Roundbox::new([at - half, at + half], radius, object.material().clone())?.into());
    }
    if rare != 0 {
        return Ok(object);
    }
    let (radius, end) = (within(&mut dice, 0.05, 0.5) * size, at + size * direction(&mut dice));
    let end = if dice.u8(0..8) == 0 { at } else { end };
    Ok(Capsule::new(radius, [at, end], object.material().clone())?.into())
}

type Surface = fn(&mut Rng) -> Result<Material>;

fn heap(rng: &mut Rng, count: usize, surface: Surface) -> Result<Vec<Object>> {
    (0..count)
        .map(|_| {
            let (at, size) = (point(rng, 1.6), within(rng, 0.3, 1.6));
            let material = surface(rng)?;
            any(rng, at, size, material)
        })
        .collect()
}

fn floor(rng: &mut Rng, height: f64) -> Result<Object> {
    let material = pattern(rng)?;
    Ok(Plane::new(DVec3::new(0.0, height, 0.0), DVec3::Y * within(rng, 0.1, 3.0), material)?.into())
}

/// Returns a picture of the objects with suns and lamps.
fn picture(rng: &mut Rng, objects: Vec<Object>, eye: DVec3, target: DVec3) -> Result<Scene> {
    let screen = Screen::new(rng.u32(16..32), rng.u32(16..32))?;
    let look = Look::new(eye, target, within(rng, 20.0, 90.0), Some(DVec3::new(0.1, 1.0, 0.05)))?;
    let mut scene = Scene::new(screen, Camera::Look(look));
    match rng.bool() {
        true => scene.background = Background::sky(color(rng), color(rng))?,
        false => scene.set_background(color(rng))?,
    }
    scene.objects = objects.into();
    let mut lights = Vec::new();
    for _ in 0..rng.u32(0..3) {
        lights.push(light(0.6, direction(rng).to_array())?);
    }
    for _ in 0..rng.u32(0..3) {
        let reach = if rng.bool() { within(rng, 0.5, 4.0) } else { 0.0 };
        lights.push(Lamp::new(color(rng), point(rng, 3.0), 0.0, reach)?.into());
    }
    scene.lights = lights.into();
    scene.tone = if rng.u8(0..4) == 0 { Tone::Srgb } else { Tone::Plain };
    scene.depth = Depth::new(rng.u32(0..7))?;
    // By dice of its own, so that a seed keeps its other numbers.
    let mut dice = rng.clone();
    if dice.u8(0..5) == 0 {
        scene.fog = Fog::new(color(&mut dice), power(&mut dice, 0.0, 1.5))?;
    }
    if dice.u8(0..6) == 0 {
        scene.background = Background::NONE;
    }
    Ok(scene)
}

const EYE: DVec3 = DVec3::new(0.3, 1.1, 5.0);

fn all_shapes(rng: &mut Rng) -> Result<Scene> {
    let mut objects = heap(rng, 10, plain)?;
    objects.push(floor(rng, -1.8)?);
    picture(rng, objects, EYE, DVec3::ZERO)
}

fn of_glass(rng: &mut Rng) -> Result<Scene> {
    let mut objects = heap(rng, 5, glass)?;
    objects.extend(heap(rng, 3, plain)?);
    objects.push(floor(rng, -1.8)?);
    picture(rng, objects, EYE, DVec3::ZERO)
}

/// Makes boxes, discs and panes with faces in few planes, and bodies within bodies.
fn stacked(rng: &mut Rng) -> Result<Scene> {
    let heights = [-1.0, -0.5, 0.0, 0.5, 1.0];
    let mut objects = Vec::new();
    for _ in 0..rng.usize(3..8) {
        let (low, high) = (heights[rng.usize(0..5)], heights[rng.usize(0..5)]);
        let half = [0.5, 1.0, 1.5][rng.usize(0..3)];
        let material = if rng.u8(0..3) == 0 { plain(rng)? } else { glass(rng)? };
        let (u, v) = (DVec3::new(-half, low, -half), DVec3::new(half, high, half));
        objects.push(match rng.u8(0..4) {
            0 => Disc::new(half, DVec3::Y * low, DVec3::Y, material)?.into(),
            1 if low != high => Cylinder::new(half, [DVec3::Y * low, DVec3::Y * high], material)?.into(),
            2 => Sphere::new(half, DVec3::Y * low, material)?.into(),
            _ => Cuboid::new([u, v], material)?.into(),
        });
    }
    objects.push(floor(rng, -1.0)?);
    let eye = DVec3::new(within(rng, -2.0, 2.0), within(rng, 0.0, 3.0), 4.0);
    picture(rng, objects, eye, DVec3::ZERO)
}

fn patterned(rng: &mut Rng) -> Result<Scene> {
    let mut objects = heap(rng, 9, pattern)?;
    objects.push(floor(rng, -1.8)?);
    picture(rng, objects, EYE, DVec3::ZERO)
}

/// Makes faces at multiples of the size of the cells, written as decimals that are rounded.
fn on_walls(rng: &mut Rng) -> Result<Scene> {
    let size = [0.1, 0.3, 0.7, 1.0][rng.usize(0..4)];
    let cell = |rng: &mut Rng| DVec3::from_array([(); 3].map(|()| f64::from(rng.i32(-4..5)) * size));
    let mut objects = Vec::new();
    for _ in 0..8 {
        let weight = if rng.bool() { Weight::Checker(size) } else { Weight::Stripes(size) };
        let pattern = Pattern { weight: weight.checked()?, other: coefficients(rng, 0.0)? };
        let finish = Finish { pattern: Some(pattern), ..Finish::default() };
        let material = Material::finished(coefficients(rng, 0.0)?, finish);
        let (at, to, axis) = (cell(rng), cell(rng), DVec3::AXES[rng.usize(0..3)]);
        objects.push(match rng.u8(0..5) {
            0 => Disc::new(2.0 * size, at, axis, material)?.into(),
            1 => Plane::new(at - 3.0 * size * DVec3::Y, DVec3::Y, material)?.into(),
            2 => Cylinder::new(size, [at, at + 2.0 * size * axis], material)?.into(),
            3 => {
                let (across, along) = (axis.zxy() * size * 3.0, axis.yzx() * size * 3.0);
                Triangle::new([at, at + across, at + along], material)?.into()
            }
            _ => Cuboid::new([at, to], material)?.into(),
        });
    }
    let mut scene = picture(rng, objects, DVec3::new(1.0, 1.5, 7.0) * size * 2.0, DVec3::ZERO)?;
    scene.depth = Depth::new(1)?;
    Ok(scene)
}

fn turned(rng: &mut Rng) -> Result<Placement> {
    let quarter = |rng: &mut Rng| {
        let turns = [
            DMat3::IDENTITY,
            DMat3::from_cols(DVec3::Y, DVec3::NEG_X, DVec3::Z),
            DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::NEG_Y),
            DMat3::from_cols(DVec3::NEG_Z, DVec3::Y, DVec3::X),
        ];
        turns[rng.usize(0..4)]
    };
    let rotation = if rng.bool() {
        quarter(rng) * quarter(rng)
    } else {
        DMat3::from_rotation_y(rng.f64() * 6.0) * DMat3::from_rotation_x(rng.f64() * 6.0)
    };
    let scale = if rng.bool() { power(rng, -0.5, 0.3) } else { [0.5, 1.0, 2.0][rng.usize(0..3)] };
    Ok(Placement::new(point(rng, 1.5), rotation, scale)?)
}

fn grouped(rng: &mut Rng) -> Result<Scene> {
    let group = heap(rng, 4, some)?.into();
    let mut objects = Vec::new();
    for _ in 0..3 {
        let placement = Arc::new(turned(rng)?);
        objects.extend((0..4).map(|index| Object::from(Instance::new(&group, index, &placement))));
    }
    objects.push(floor(rng, -1.8)?);
    picture(rng, objects, EYE, DVec3::ZERO)
}

/// Makes copies moved by exact numbers. The object that comes first in the script is visible.
fn copies(rng: &mut Rng) -> Result<Scene> {
    let whole = |rng: &mut Rng| DVec3::from_array([(); 3].map(|()| f64::from(rng.i32(-6..7)) / 4.0));
    let mut objects = Vec::new();
    for _ in 0..5 {
        let (at, size, offset) = (whole(rng), whole(rng), whole(rng));
        let scale = [0.5, 1.0, 2.0][rng.usize(0..3)];
        let brick = |at: DVec3, size: DVec3, material| Cuboid::new([at, at + size], material);
        let group = vec![Object::from(brick(at, size, plain(rng)?)?)].into();
        let placement = Arc::new(Placement::new(offset, DMat3::IDENTITY, scale)?);
        let instance = Object::from(Instance::new(&group, 0, &placement));
        let copy = Object::from(brick(offset + scale * at, scale * size, plain(rng)?)?);
        objects.extend(if rng.bool() { [instance, copy] } else { [copy, instance] });
    }
    picture(rng, objects, EYE, DVec3::ZERO)
}

/// Makes lamps in rooms, in bodies, on surfaces. No material has highlights, because for a lamp in the plane of a
/// surface the sign of a cosine of 0 would decide whether there is one.
fn lamps(rng: &mut Rng) -> Result<Scene> {
    let mut objects = heap(rng, 6, pattern)?;
    objects.push(floor(rng, -1.5)?);
    let mut scene = picture(rng, objects, EYE, DVec3::ZERO)?;
    let mut lights = Vec::new();
    for _ in 0..3 {
        let place = match rng.u8(0..3) {
            // On the floor, and on the objects that stand there.
            0 => DVec3::new(within(rng, -2.0, 2.0), -1.5, within(rng, -2.0, 2.0)),
            1 => match &scene.objects[rng.usize(0..6)] {
                Object::Sphere(sphere) => sphere.center() + sphere.radius() * DVec3::Y,
                Object::Cuboid(cuboid) => cuboid.min(),
                Object::Triangle(triangle) => triangle.vertices()[0],
                Object::Disc(disc) => disc.center(),
                Object::Cylinder(cylinder) => cylinder.ends()[0],
                Object::Cone(cone) => cone.ends()[1],
                Object::Torus(torus) => torus.center(),
                Object::Capsule(capsule) => capsule.ends()[0],
                Object::Roundbox(roundbox) => roundbox.min(),
                _ => DVec3::ZERO,
            },
            _ => point(rng, 1.5),
        };
        lights.push(Lamp::new(0.7 * color(rng), place, 0.0, within(rng, 0.0, 2.0))?.into());
    }
    scene.lights = lights.into();
    Ok(scene)
}

fn from_within(rng: &mut Rng) -> Result<Scene> {
    let mut objects = heap(rng, 5, plain)?;
    let material = some(rng)?;
    let (eye, object): (DVec3, Object) = match rng.u8(0..6) {
        0 => (DVec3::new(2.0, 0.5, 0.0), Cylinder::new(2.0, [DVec3::NEG_Y, DVec3::Y], material)?.into()),
        1 => (DVec3::new(0.5, 1.0, 0.25), Cylinder::new(2.0, [DVec3::NEG_Y, DVec3::Y], material)?.into()),
        2 => (DVec3::new(1.2, 0.5, 1.6), Cylinder::new(2.0, [DVec3::NEG_Y, DVec3::Y], material)?.into()),
        3 => (DVec3::new(1.0, 0.0, 0.0), Cone::new([2.0, 0.0], [DVec3::NEG_Y, DVec3::Y], material)?.into()),
        4 => (DVec3::new(3.0, 0.0, 0.0), Torus::new(2.0, 1.0, DVec3::ZERO, DVec3::Y, material)?.into()),
        _ => {
            let at = point(rng, 1.0);
            let body = any(rng, at, 5.0, material)?;
            (at + 0.1 * direction(rng), body)
        }
    };
    objects.push(object);
    let target = eye + direction(rng);
    picture(rng, objects, eye, target)
}

/// Makes a scene with rays that hit rims, caps and tips exactly.
fn whole_numbers(rng: &mut Rng) -> Result<Scene> {
    let whole = |rng: &mut Rng| DVec3::from_array([(); 3].map(|()| f64::from(rng.i32(-3..4))));
    let mut objects = Vec::new();
    for _ in 0..rng.usize(2..9) {
        let material = some(rng)?;
        let (at, axis) = (whole(rng), DVec3::AXES[rng.usize(0..3)]);
        let (small, large) = (f64::from(rng.u32(1..3)), f64::from(rng.u32(3..5)));
        objects.push(match rng.u8(0..6) {
            0 => Disc::new(large, at, axis, material)?.into(),
            1 => Cylinder::new(small, [at, at + large * axis], material)?.into(),
            2 => Cone::new([small, 0.0], [at, at + large * axis], material)?.into(),
            3 => Torus::new(large, small, at, axis, material)?.into(),
            4 => Plane::new(4.0 * DVec3::NEG_Y, DVec3::Y, material)?.into(),
            _ => Cuboid::new([at, whole(rng)], material)?.into(),
        });
    }
    let axis = rng.usize(0..3);
    let (back, up) = (DVec3::AXES[axis], DVec3::AXES[(axis + 1) % 3]);
    let mut scene = picture(rng, objects, 9.0 * back, DVec3::ZERO)?;
    scene.screen = Screen::new(25, 25)?;
    scene.camera = Camera::Look(Look::new(9.0 * back, DVec3::ZERO, 60.0, Some(up))?);
    Ok(scene)
}

fn tori(rng: &mut Rng) -> Result<Scene> {
    let mut objects = Vec::new();
    for _ in 0..5 {
        let (radius, at, normal) = (within(rng, 0.3, 1.5), point(rng, 1.0), direction(rng));
        let thickness = [0.999_9, 0.5, 0.1, 0.01, 1e-4][rng.usize(0..5)] * radius;
        objects.push(Torus::new(radius, thickness, at, normal, some(rng)?)?.into());
    }
    picture(rng, objects, EYE, DVec3::ZERO)
}

fn mirrors(rng: &mut Rng) -> Result<Scene> {
    let bright = Material::new(DVec3::splat(0.02), DVec3::splat(0.1), DVec3::splat(0.85))?;
    let mut objects = heap(rng, 4, plain)?;
    let height = DVec3::Y * 2.0;
    objects
        .push(Cylinder::new(3.0, [DVec3::X * 4.0 - height, DVec3::X * 4.0 + height], bright.clone())?.into());
    objects.push(
        Cone::new([2.5, 1.0], [DVec3::X * -4.0 - height, DVec3::X * -4.0 + height], bright.clone())?.into(),
    );
    objects.push(Torus::new(2.0, 1.0, DVec3::NEG_Z * 3.0, DVec3::Z, bright)?.into());
    picture(rng, objects, DVec3::new(0.1, 0.2, 3.0), DVec3::ZERO)
}

fn horizon(rng: &mut Rng) -> Result<Scene> {
    let mut objects = vec![floor(rng, -1.0)?];
    if rng.bool() {
        let material = some(rng)?;
        objects.push(Plane::new(DVec3::new(0.0, 3.0, -9.0), direction(rng), material)?.into());
    }
    objects.extend(heap(rng, 3, some)?);
    let height = power(rng, -8.0, 3.0);
    let eye = DVec3::new(0.3, height - 1.0, 5.0);
    let target = eye + DVec3::new(within(rng, -1.0, 1.0), 0.0, -1.0);
    picture(rng, objects, eye, target)
}

fn far_and_tiny(rng: &mut Rng) -> Result<Scene> {
    let (scale, offset) = if rng.bool() {
        (power(rng, -200.0, 200.0), DVec3::ZERO)
    } else {
        (1.0, direction(rng) * power(rng, 2.0, 9.0))
    };
    let place = |p: DVec3| scale * p + offset;
    let objects: Result<Vec<_>, _> =
        heap(rng, 8, plain)?.iter().map(|object| object.placed(scale, place)).collect();
    let mut scene = picture(rng, objects?, place(EYE), place(DVec3::ZERO))?;
    let lights = scene.lights.iter().map(|light| match light {
        Light::Lamp(lamp) => {
            let (color, position) = (lamp.color(), place(lamp.position()));
            Lamp::new(color, position, 0.0, scale * lamp.reach()).map(Light::Lamp)
        }
        Light::Directional(_) => Ok(*light),
    });
    let lights: Result<Vec<_>, _> = lights.collect();
    scene.lights = lights?.into();
    Ok(scene)
}

fn parallel(rng: &mut Rng) -> Result<Scene> {
    let objects: Result<Vec<_>> = (0..10)
        .map(|_| {
            let at = DVec3::new(within(rng, 0.0, 30.0), within(rng, 0.0, 30.0), within(rng, -60.0, -10.0));
            let (size, material) = (within(rng, 2.0, 20.0), some(rng)?);
            any(rng, at.round(), size, material)
        })
        .collect();
    let mut scene = picture(rng, objects?, EYE, DVec3::ZERO)?;
    scene.camera = Camera::Orthographic;
    Ok(scene)
}

/// Makes objects that are long and thin, or wide and flat.
fn slender(rng: &mut Rng) -> Result<Scene> {
    let mut objects = Vec::new();
    for _ in 0..10 {
        let (at, along) = (point(rng, 1.5), direction(rng));
        let (thin, material) = (power(rng, -7.0, -1.0), some(rng)?);
        objects.push(match rng.u8(0..4) {
            0 => Cylinder::new(thin, [at, at + 2.0 * along], material)?.into(),
            1 => Cylinder::new(0.5, [at, at + thin * along], material)?.into(),
            2 => Cone::new([thin, 0.0], [at, at + 2.0 * along], material)?.into(),
            _ => Cone::new([0.6, 0.0], [at, at + thin * along], material)?.into(),
        });
    }
    picture(rng, objects, EYE, DVec3::ZERO)
}
