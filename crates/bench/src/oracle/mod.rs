//! The oracle: the scene language without rounding errors.
//!
//! A second implementation of hits, normals and shading, in numbers of 640 bits and with the most direct formulas. If a
//! tracer differs from the oracle, the tracer has rounded. The oracle shares no code with the tracers and is slow: some
//! 10 µs per object and ray, a hundred times that for a torus. Only values that may have an error of 2⁻²⁰ (noise,
//! powers, the sRGB curve) are computed in `f64`.
//!
//! ```
//! use glam::DVec3;
//! use rayfold_bench::oracle;
//! use rayfold_scene::{Material, Object, Sphere};
//!
//! let sphere = Object::Sphere(Sphere::new(1.0, DVec3::ZERO, Material::default())?);
//! let hit = oracle::nearest(&[sphere], DVec3::new(0.0, 0.0, 5.0), DVec3::NEG_Z).ok_or("missed")?;
//! assert_eq!((hit.object, hit.t.to_f64()), (0, 4.0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod glass;
mod hit;
mod image;
mod light;
mod line;
mod model_color;
mod noise;
mod pattern;
mod real;
mod rough;
mod shapes;
mod sky;

use std::cell::RefCell;

use ::image::RgbImage;
use fastrand::Rng;
use glam::DVec3;
use rayfold_scene::{Object, Scene, Tone};
use rayon::prelude::*;

use hit::{glass_of, nearest_on};

pub use glass::reflected;
pub use hit::{Hit, nearest, nearest_beyond};
pub use line::Line;
pub use real::{Real, Vector};
pub use shapes::{edge_clearance, sphere_clearance};
pub(crate) use sky::along as sky_along;

/// Returns the colour of a pixel, unclamped. `i` counts from the left, `j` from the bottom.
pub fn color(scene: &Scene, i: u32, j: u32) -> DVec3 {
    color_at(scene, f64::from(i), f64::from(j))
}

/// Returns the colour at fractional pixel indices.
pub fn color_at(scene: &Scene, x: f64, y: f64) -> DVec3 {
    let line = Line::of_pixel(&scene.camera, scene.screen, x, y);
    seen_along(scene, &line, &Path::of_camera(scene, None)).color.to_dvec3()
}

/// Returns the cover of a pixel of a scene without background; 1 with one.
pub fn cover(scene: &Scene, i: u32, j: u32) -> f64 {
    let line = Line::of_pixel(&scene.camera, scene.screen, f64::from(i), f64::from(j));
    1.0 - seen_along(scene, &line, &Path::of_camera(scene, None)).clear
}

/// Returns the colour of a path of light through fractional pixel indices, unclamped. It is one random sample of the
/// expectation that the language defines. Lights are points.
pub fn path_at(scene: &Scene, x: f64, y: f64, dice: &RefCell<Rng>) -> DVec3 {
    let line = Line::of_pixel(&scene.camera, scene.screen, x, y);
    seen_along(scene, &line, &Path::of_camera(scene, Some(dice))).color.to_dvec3()
}

/// Returns the position of the object that a pixel shows, and its normal there.
pub fn first_hit(scene: &Scene, i: u32, j: u32) -> Option<(usize, DVec3)> {
    let line = Line::of_pixel(&scene.camera, scene.screen, f64::from(i), f64::from(j));
    nearest_on(&scene.objects, &line, &Real::zero()).map(|hit| (hit.object, hit.normal.to_dvec3()))
}

/// Returns the entire image, its first row at the top.
pub fn image(scene: &Scene) -> RgbImage {
    let (width, height) = (scene.screen.width(), scene.screen.height());
    let pixels: Vec<_> = (0..width * height)
        .into_par_iter()
        .flat_map_iter(|k| levels(scene.tone, color(scene, k % width, height - 1 - k / width)))
        .collect();
    RgbImage::from_raw(width, height, pixels).unwrap_or_default()
}

/// Converts a colour to levels by the language's rule, before they are rounded.
pub fn shown(tone: Tone, color: DVec3) -> DVec3 {
    let encoded = |light: f64| match tone {
        Tone::Plain => light,
        Tone::Srgb if light <= 0.003_130_8 => 12.92 * light,
        Tone::Srgb => 1.055 * light.powf(1.0 / 2.4) - 0.055,
    };
    255.0 * DVec3::from_array(color.to_array().map(|c| encoded(c.clamp(0.0, 1.0))))
}

/// Returns the levels of a pixel.
pub fn levels(tone: Tone, color: DVec3) -> [u8; 3] {
    shown(tone, color).to_array().map(|level| level.round() as u8)
}

/// The state of a ray at its start.
struct Path<'a> {
    /// The dice of a path of light, where light goes round.
    dice: Option<&'a RefCell<Rng>>,
    /// The number of diffuse reflections so far.
    scattered: u32,
    /// Hits nearer than this are ignored.
    start: Real,
    bounces: u32,
    /// The product of the absolute values of all factors.
    weight: Vector,
    has_met_glass: bool,
    /// The share of the pixel that stays clear if the ray hits nothing; `None` for rays that see the surroundings.
    clear: Option<f64>,
}

impl<'a> Path<'a> {
    fn of_camera(scene: &Scene, dice: Option<&'a RefCell<Rng>>) -> Self {
        let clear = scene.background.is_none().then_some(1.0);
        Self {
            dice,
            scattered: 0,
            start: Real::zero(),
            bounces: 0,
            weight: DVec3::ONE.into(),
            has_met_glass: false,
            clear,
        }
    }
}

/// The light of a ray: its colour, and the share of its pixel that it leaves clear.
struct Seen {
    color: Vector,
    clear: f64,
}

impl From<Vector> for Seen {
    fn from(color: Vector) -> Self {
        Self { color, clear: 0.0 }
    }
}

fn seen_along(scene: &Scene, line: &Line, path: &Path<'_>) -> Seen {
    let Some(hit) = nearest_on(&scene.objects, line, &path.start) else {
        if let Some(clear) = path.clear {
            return Seen { color: DVec3::ZERO.into(), clear };
        }
        return Vector::from(sky::along(scene, line.direction.unit().to_dvec3())).into();
    };
    let Some((fog, distance)) = scene.fog.get() else { return seen_at_hit(scene, line, path, &hit) };
    // The exponential has an error of some roundoffs.
    let length = &hit.t * &line.direction.dot(&line.direction).root();
    let left = (-length.over(&Real::from(distance)).to_f64()).exp();
    let weight = path.weight.times(&DVec3::splat(left).into());
    let Seen { color, clear } =
        seen_at_hit(scene, line, &Path { start: path.start.clone(), weight, ..*path }, &hit);
    let color = color.times(&DVec3::splat(left).into()).plus(&Real::from(1.0 - left), &fog.into());
    Seen { color, clear }
}

/// Returns the light that a hit sends back along the line.
fn seen_at_hit(scene: &Scene, line: &Line, path: &Path<'_>, hit: &Hit) -> Seen {
    let object = &scene.objects[hit.object];
    let material = object.material();
    let (place, face) = shapes::place(object, line, &hit.t);
    let [mut ambient, mut diffuse, mirror] = pattern::coefficients(material, &place, face);
    if scene.indirect_bounces() > 0 && shapes::is_of_file(object) {
        (ambient, diffuse) = (DVec3::ZERO.into(), DVec3::ONE.into());
    }
    if let Some(factor) = image::factor(object, &place.to_dvec3(), line, hit, scene.tone == Tone::Srgb) {
        (ambient, diffuse) = (ambient.times(&factor.into()), diffuse.times(&factor.into()));
    }
    let shaded = shapes::shaded(object, line, hit, scene.tone == Tone::Srgb);
    if let Some(shaded) = &shaded {
        let color = Vector::from(shaded.color);
        if shaded.unlit {
            (ambient, diffuse) = (color, DVec3::ZERO.into());
        } else {
            ambient = ambient.times(&color).plus(&Real::from(1.0), &shaded.glow.into());
            diffuse = diffuse.times(&color);
        }
    }
    let normal = shaded.as_ref().map_or(&hit.normal, |shaded| &shaded.normal);
    let lift = shaded.as_ref().map(|shaded| &shaded.lift);
    let point = line.at(&hit.t);
    // A point on a surface is rounded, so the ray that leaves it hits the surface again next to its start.
    let farthest = point.to_dvec3().abs().max_element();
    let start = Real::from(shapes::extent(&scene.objects).max(farthest)).shifted(-300);

    let finish = material.finish();
    let glow = finish.map_or(DVec3::ZERO, |finish| finish.glow);
    let mut color = ambient.plus(&Real::from(1.0), &glow.into());
    let shine = finish.and_then(|finish| finish.shine);
    let rough = finish.and_then(|finish| finish.rough).map_or(0.0, |rough| rough.alpha());
    let rough = (rough > 0.0 && path.dice.is_some()).then_some(rough);
    let view = line.direction.unit().opposite().to_dvec3();
    for light in scene.lights.iter() {
        let Some(arriving) = light::arriving(scene, light, (&point, lift), normal, &start) else { continue };
        let cosine = normal.dot(&arriving.towards);
        let mut answer = diffuse.times(&Vector([cosine.clone(), cosine.clone(), cosine]));
        if let Some(shine) = shine {
            let towards_eye = line.direction.unit().opposite();
            let part = light::highlight(shine.exponent(), normal, &arriving.towards, &towards_eye);
            answer = answer.plus(&Real::from(part), &shine.color().into());
        }
        if let Some(alpha) = rough {
            let part = rough::highlight(alpha, normal.to_dvec3(), view, arriving.towards.to_dvec3());
            answer = answer.plus(&Real::from(part), &mirror);
        }
        color = color.plus(&Real::from(1.0), &arriving.color.times(&answer));
    }

    let one = Real::from(1.0);
    if let Some(dice) = path.dice
        && path.scattered < scene.indirect.bounces()
        && diffuse.0.iter().any(|channel| channel.sign() != 0)
    {
        let direction = scattered(normal, &hit.normal, dice);
        let next = Line { origin: point.clone(), direction };
        let weight = path.weight.times(&diffuse.magnitude());
        let path = Path { start: start.clone(), scattered: path.scattered + 1, weight, clear: None, ..*path };
        color = color.plus(&one, &diffuse.times(&seen_along(scene, &next, &path).color));
    }
    let onwards = match (rough, path.dice) {
        (Some(alpha), Some(dice)) => {
            let normal = normal.unit().to_dvec3();
            let rough::Facet { normal: facet, weight } = rough::random_facet(alpha, view, normal, dice);
            let energy = rough::energy(alpha, normal.dot(view));
            from_facet(line, hit, object, (alpha, normal), (facet, weight), (&mirror, energy), path.clear)
        }
        _ => from_surface(line, hit, object, normal, mirror, path.clear),
    };
    let mut left_clear = 0.0;
    for (factor, direction, clear) in onwards.into_iter().flatten() {
        let weight = path.weight.times(&factor.magnitude());
        let has_met_glass = path.has_met_glass || glass_of(object).is_some();
        let least = match scene.tone {
            Tone::Plain => 2f64.powi(-12),
            Tone::Srgb => 2f64.powi(-16),
        };
        let counts = weight.0.iter().any(|w| {
            if has_met_glass && path.dice.is_none() { *w >= Real::from(least) } else { w.sign() > 0 }
        });
        if path.bounces < scene.depth.bounces() && counts {
            let next = Line { origin: point.clone(), direction };
            let bounces = path.bounces + 1;
            let path = Path { start: start.clone(), bounces, weight, has_met_glass, clear, ..*path };
            let seen = seen_along(scene, &next, &path);
            color = color.plus(&one, &factor.times(&seen.color));
            left_clear += seen.clear;
        }
    }
    Seen { color, clear: left_clear }
}

/// The rays that a hit spawns: their factors and directions, and the shares of the pixel that they leave clear.
type Onwards = [Option<(Vector, Vector, Option<f64>)>; 2];

/// Returns the rays that a smooth surface spawns.
fn from_surface(
    line: &Line,
    hit: &Hit,
    object: &Object,
    normal: &Vector,
    mirror: Vector,
    clear: Option<f64>,
) -> Onwards {
    let one = Real::from(1.0);
    let normal = onward_normal(line, normal, hit, object);
    let mut mirrored = mirror;
    let mut through = None;
    let glass = glass_of(object);
    if let Some(glass) = glass {
        let ior = Real::from(glass.ior());
        let index = if hit.leaves && shapes::has_inside(object) { one.over(&ior) } else { ior };
        let direction = line.direction.unit();
        let (share, bent) = glass::refracted(&direction, &normal, &index);
        mirrored = Vector(mirrored.0.map(|channel| &channel + &share));
        through = bent.map(|bent| {
            let factor = Vector::from(DVec3::ZERO).plus(&(&one - &share), &glass.color().into());
            let mean = (glass.color().x + glass.color().y + glass.color().z) / 3.0;
            let left = (1.0 - share.to_f64()) * mean.clamp(0.0, 1.0);
            let clear = clear.map(|clear| left * clear);
            (factor, if shapes::has_inside(object) { bent } else { direction }, clear)
        });
    }
    [Some((mirrored, reflected(&line.direction, &normal).unit(), None)), through]
}

/// Returns the rays that a microfacet spawns, on a surface with this normal. The microfacet has been drawn with this
/// weight.
fn from_facet(
    line: &Line,
    hit: &Hit,
    object: &Object,
    (alpha, normal): (f64, DVec3),
    (facet, weight): (DVec3, f64),
    (mirror, energy): (&Vector, f64),
    clear: Option<f64>,
) -> Onwards {
    let (direction, face) = (line.direction.unit(), hit.normal.unit().to_dvec3());
    let facet = Vector::from(facet);
    let towards = reflected(&direction, &facet).unit();
    let flat = towards.to_dvec3();
    let shown = if flat.dot(face) > 0.0 { rough::masking(alpha, flat.dot(normal)) } else { 0.0 };
    let nothing = Vector::from(DVec3::ZERO);
    let mut mirrored = nothing.plus(&Real::from(shown * weight / energy), mirror);
    let through = glass_of(object).and_then(|glass| {
        let (one, ior) = (Real::from(1.0), Real::from(glass.ior()));
        let index = if hit.leaves && shapes::has_inside(object) { one.over(&ior) } else { ior };
        let (share, bent) = glass::refracted(&direction, &facet, &index);
        let share = share.to_f64();
        mirrored = mirrored.plus(&Real::from(share * shown * weight), &DVec3::ONE.into());
        let bent = match shapes::has_inside(object) {
            true => bent?.to_dvec3(),
            false => flat - 2.0 * flat.dot(normal) * normal,
        };
        let left = if bent.dot(face) < 0.0 { rough::masking(alpha, -bent.dot(normal)) } else { 0.0 };
        let left = (1.0 - share) * left * weight;
        let factor = nothing.plus(&Real::from(left), &glass.color().into());
        let mean = (glass.color().element_sum() / 3.0).clamp(0.0, 1.0);
        Some((factor, Vector::from(bent).unit(), clear.map(|clear| clear * left * mean)))
    });
    [Some((mirrored, towards, None)), through]
}

/// Returns a random unit vector around a normal, with a density in proportion to the cosine: the normal and a point of the
/// unit sphere, added. One below the face is mirrored to above it.
fn scattered(normal: &Vector, face: &Vector, dice: &RefCell<Rng>) -> Vector {
    let normal = normal.unit().to_dvec3();
    let face = face.unit().to_dvec3();
    let mut dice = dice.borrow_mut();
    let direction = loop {
        let within = DVec3::new(dice.f64(), dice.f64(), dice.f64()) * 2.0 - 1.0;
        let length = within.length();
        if length > 1e-6 && length <= 1.0 && (normal + within / length).length() > 1e-9 {
            break (normal + within / length).normalize();
        }
    };
    let below = direction.dot(face).min(0.0);
    Vector::from(direction - 2.0 * below * face).unit()
}

/// Returns the normal at which a ray continues: that of the face if a ray would otherwise leave on the wrong side of
/// it.
fn onward_normal(line: &Line, normal: &Vector, hit: &Hit, object: &Object) -> Vector {
    if reflected(&line.direction, normal).dot(&hit.normal).sign() <= 0 {
        return hit.normal.clone();
    }
    let Some(glass) = glass_of(object).filter(|_| shapes::has_inside(object)) else { return normal.clone() };
    let ior = Real::from(glass.ior());
    let index = if hit.leaves { Real::from(1.0).over(&ior) } else { ior };
    let (_, bent) = glass::refracted(&line.direction.unit(), normal, &index);
    let is_above = bent.is_some_and(|bent| bent.dot(&hit.normal).sign() >= 0);
    if is_above { hit.normal.clone() } else { normal.clone() }
}

#[cfg(test)]
mod tests {
    use rayfold_scene::{Limits, parse};
    use rayfold_tracer::{Exposure, RenderOptions, reference};

    use super::*;

    #[test]
    fn the_plain_tracer_covers_what_the_oracle_covers() {
        let objects = "Material pane glass .9 .7 .5 1.5\nMaterial soap glass 1 1 .8 1.1\nSphere 1 -.6 0 0 pane\n\
                       Box .2 -.6 -1 1.3 .9 .4 soap\nDisc .7 .4 .3 1.4 0 .2 1 pane\nSphere .4 -.4 .2 -2 .2 .2 .2 .5 .5 .5\n\
                       Torus .5 .15 1.2 -.8 .5 0 1 1 .1 .1 .1 .2 .2 .2 .4 .4 .4\nIlight .7 .7 .7 -1 -2 -1\n";
        // With one bounce, only the disc is seen through.
        for (settings, least) in
            [("", 40), ("Tone srgb\nDepth 9\n", 40), ("Fog .4 .5 .6 8\n", 40), ("Depth 1\n", 4)]
        {
            let text =
                format!("Screen 24 18\nLook .3 .4 5 0 0 0 40\nBackground none\n{settings}{objects}Trace\n");
            let parsed = parse("a.txt", text.as_bytes(), &Limits::default());
            let scene = parsed.script.and_then(|script| script.frame(0)).unwrap();
            let plain =
                reference::light_and_cover(Exposure::still(&scene), &RenderOptions::default()).unwrap();
            let mut partial = 0;
            for (k, pixel) in (0..).zip(plain.as_chunks::<4>().0) {
                let (i, j) = (k % 24, 17 - k / 24);
                let (color, cover) =
                    (color(&scene, i, j).clamp(DVec3::ZERO, DVec3::ONE), cover(&scene, i, j));
                let [red, green, blue, alpha] = pixel.map(f64::from);
                let apart = (color - DVec3::new(red, green, blue)).abs().max_element();
                assert!(
                    apart < 1e-6 && (cover - alpha).abs() < 1e-6,
                    "{settings} {i} {j}: {pixel:?} {cover}"
                );
                partial += usize::from((0.05..0.95).contains(&cover));
            }
            assert!(partial > least, "{settings} {partial}");
        }
    }
}
