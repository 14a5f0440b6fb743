//! Mitsuba 3 as a peer, if Python has it: the scene for its path tracer, and the time and the error of its pictures.
//!
//! Its kernels need a newer LLVM than some systems have: 19 is enough, 15 lacks an instruction. `DRJIT_LIBLLVM_PATH`
//! names the library.

use std::f64::consts::PI;

use anyhow::{Context, Result, ensure};
use glam::DVec3;
use rayfold_scene::model::Finish;
use rayfold_scene::{Camera, Light, Material, Object, Scene};
use serde_json::{Value, json};

use super::curve::{Curve, Point};
use super::measure::ROUNDS;
use crate::oracle;
use crate::speed::mitsuba::ask;

pub(super) const NAME: &str = "Mitsuba";

const PROGRAM: &str = include_str!("mitsuba_peer.py");

/// The number of samples of its truth.
const TRUTH: u32 = 2048;

/// The results of Mitsuba's samplers.
pub(super) struct Drawn {
    /// One curve per sampler.
    pub(super) curves: Vec<Curve>,
    pub(super) truth: Truth,
}

/// The picture from which its errors are measured.
pub(super) struct Truth {
    pub(super) version: String,
    pub(super) samples: u32,
    /// Half of the root mean square difference of its two halves.
    pub(super) error: f64,
    /// The mean level of the picture.
    pub(super) level: f64,
}

/// Draws the scene with each of its samplers until one has an error of `enough` levels. With `pairs`, errors are
/// computed from pairs of pictures; without, from a truth with many samples.
pub(super) fn draw(work: &'static str, scene: &Scene, enough: f64, pairs: bool) -> Result<Drawn> {
    let answer = ask(PROGRAM, &describe(scene, enough, pairs)?)?;
    eprint!("{answer}");
    read(work, &answer).with_context(|| format!("the Mitsuba peer says {answer}"))
}

fn read(work: &'static str, answer: &str) -> Option<Drawn> {
    let mut lines = answer.lines();
    let words: Vec<&str> = lines.next()?.split_whitespace().collect();
    let [version, samples, error, level] = words[..] else { return None };
    let truth = Truth {
        version: version.to_owned(),
        samples: samples.parse().ok()?,
        error: error.parse().ok()?,
        level: level.parse().ok()?,
    };
    let mut curves: Vec<Curve> = vec![];
    for line in lines {
        let (sampler, numbers) = line.split_once(' ')?;
        let numbers: Vec<f64> = numbers.split(' ').map(str::parse).collect::<Result<_, _>>().ok()?;
        let [rays, seconds, error, off] = numbers[..] else { return None };
        let point = Point { ms: 1e3 * seconds, rays, error, off };
        let way = format!("{NAME}, {sampler}");
        match curves.iter_mut().find(|curve| curve.way == way) {
            Some(curve) => curve.points.push(point),
            None => curves.push(Curve { work, peer: Some(NAME), way, points: vec![point] }),
        }
    }
    Some(Drawn { curves, truth })
}

/// Describes the scene in numbers: light, material and camera as in this project. Mitsuba's pixels are square; ours are
/// higher by a thousandth.
pub(super) fn describe(scene: &Scene, enough: f64, pairs: bool) -> Result<Value> {
    let seen = seen(scene)?;
    let bounces = match scene.indirect.bounces() {
        0 => scene.depth.bounces(),
        // Light that lamps or suns sent has one more way to go in this language.
        indirect => indirect - 1,
    };
    let shapes: Result<Vec<Value>> = scene.objects.iter().map(|object| shape(object, seen.eye)).collect();
    let suns: Result<Vec<Value>> = scene.lights.iter().map(sun).collect();
    Ok(json!({
        "shapes": shapes?,
        "suns": suns?,
        "sky": sky(scene),
        "bounces": bounces,
        "sampled": scene.indirect.bounces() > 0,
        "size": [scene.screen.width(), scene.screen.height()],
        "eye": seen.eye.to_array(),
        "target": seen.target.to_array(),
        "up": seen.up.to_array(),
        "fov": 2.0 * seen.half.atan().to_degrees(),
        "lens": scene.lens.radius(),
        "focus": scene.lens.distance().unwrap_or(1.0),
        "truth": if pairs { TRUTH / 16 } else { TRUTH },
        "pairs": pairs,
        "rounds": ROUNDS,
        "enough": enough,
    }))
}

/// Mitsuba's camera.
struct Seen {
    eye: DVec3,
    target: DVec3,
    up: DVec3,
    /// Half of the width that it sees, per unit of distance.
    half: f64,
}

fn seen(scene: &Scene) -> Result<Seen> {
    let (width, height) = (f64::from(scene.screen.width()), f64::from(scene.screen.height()));
    match scene.camera {
        Camera::Look(look) => {
            let half = (0.5 * look.field_of_view()).to_radians().tan() * width / height;
            Ok(Seen { eye: look.eye(), target: look.target(), up: look.up(), half })
        }
        Camera::Pinhole(pinhole) => {
            let (a, b) = (pinhole.lower_left(), pinhole.upper_right());
            ensure!((a + b).length() < 1e-9, "only a window around the gaze is translated");
            // Samples in pixels' centres there, on the window's corners here.
            let window = (b.x - a.x) * width / (width.max(2.0) - 1.0);
            let target = pinhole.eye() + pinhole.gaze();
            Ok(Seen { eye: pinhole.eye(), target, up: pinhole.up(), half: 0.5 * window / pinhole.distance() })
        }
        _ => anyhow::bail!("only a pinhole camera is translated"),
    }
}

/// Returns a colour, or the colours of a panorama.
fn sky(scene: &Scene) -> Value {
    if let Some(color) = scene.one_color() {
        return json!(color.to_array());
    }
    let (width, height) = if scene.sky_picture().is_some() { (1024, 512) } else { (8, 256) };
    let rows: Vec<Vec<[f64; 3]>> = (0..height)
        .map(|y| {
            let latitude = PI * (0.5 - (f64::from(y) + 0.5) / f64::from(height));
            let row = (0..width).map(|x| {
                let longitude = 2.0 * PI * ((f64::from(x) + 0.5) / f64::from(width) - 0.5);
                let (s, c) = longitude.sin_cos();
                let along = DVec3::new(latitude.cos() * s, latitude.sin(), -latitude.cos() * c);
                oracle::sky_along(scene, along).to_array()
            });
            row.collect()
        })
        .collect();
    json!(rows)
}

fn sun(light: &Light) -> Result<Value> {
    let Light::Directional(sun) = light else { anyhow::bail!("a lamp is not translated") };
    let towards = (-sun.direction().normalize()).to_array();
    Ok(json!({"color": sun.color().to_array(), "towards": towards, "angle": sun.angle()}))
}

fn shape(object: &Object, eye: DVec3) -> Result<Value> {
    let mut description = surface(object.material())?;
    let shape = match object {
        Object::Sphere(o) => {
            json!({"kind": "sphere", "center": o.center().to_array(), "radius": o.radius()})
        }
        Object::Cuboid(o) => {
            json!({"kind": "cube", "low": o.min().to_array(), "high": o.max().to_array()})
        }
        Object::Disc(o) => {
            let normal = o.normal().normalize().to_array();
            json!({"kind": "disk", "center": o.center().to_array(), "normal": normal, "radius": o.radius()})
        }
        Object::Triangle(o) => {
            let [u, mut v, mut w] = *o.vertices();
            // The light that it emits leaves its front alone.
            if (v - u).cross(w - u).dot(eye - u) < 0.0 {
                (v, w) = (w, v);
            }
            let corners = [u, v, w].map(|corner| corner.to_array());
            json!({"kind": "triangle", "corners": corners})
        }
        _ => anyhow::bail!("only spheres, boxes, discs and triangles are translated"),
    };
    if let (Value::Object(description), Value::Object(shape)) = (&mut description, shape) {
        description.extend(shape);
    }
    Ok(description)
}

fn surface(material: &Material) -> Result<Value> {
    let (glow, rough) = material.finish().map_or((DVec3::ZERO, None), |finish| (finish.glow, finish.rough));
    let known = Finish { glow, rough, ..Finish::default() };
    ensure!(
        material.finish().is_none_or(|finish| *finish == known),
        "highlights, patterns and glass are not translated"
    );
    let colors =
        [material.ambient(), material.diffuse(), material.mirror(), glow].map(|color| color.to_array());
    let rough = rough.map_or(0.0, |rough| rough.alpha());
    Ok(
        json!({"ambient": colors[0], "diffuse": colors[1], "mirror": colors[2], "glow": colors[3], "rough": rough}),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenes::table;

    #[test]
    fn the_description_has_the_whole_scene() {
        let description = describe(&table(512, 384).unwrap(), 0.5, false).unwrap();
        assert_eq!(description["shapes"].as_array().unwrap().len(), 26);
        assert_eq!(description["suns"].as_array().unwrap().len(), 2);
        assert!((description["fov"].as_f64().unwrap() - 57.72).abs() < 0.01);
    }

    #[test]
    fn what_it_says_is_read() {
        let drawn =
            read("edges", "3.9 64 0.5 80\nsobol 4 0.25 2 0.125\nother 4 1 1 0\nsobol 16 1 1 0\n").unwrap();
        assert_eq!((drawn.truth.version.as_str(), drawn.truth.samples), ("3.9", 64));
        let ways: Vec<(&str, usize)> =
            drawn.curves.iter().map(|curve| (curve.way.as_str(), curve.points.len())).collect();
        assert_eq!(ways, [("Mitsuba, sobol", 2), ("Mitsuba, other", 1)]);
        let first = drawn.curves[0].points[0];
        assert_eq!((first.ms, first.rays, first.error, first.off), (250.0, 4.0, 2.0, 0.125));
        assert!(read("edges", "3.9 64 0.5 80\nsobol 4\n").is_none());
    }
}
