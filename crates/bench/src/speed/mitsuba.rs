//! Mitsuba 3 as a peer, where Python has it: camera and shadow rays against spheres, discs and cylinders.
//!
//! Its LLVM variant finds shapes by Embree's user geometry, with kernels that it compiles for the machine.

use std::io::Write as _;
use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};
use rayfold_scene::{Camera, Light, Object, Scene};
use serde_json::{Value, json};

const PROGRAM: &str = include_str!("mitsuba_peer.py");

/// Processor time on one thread, without shading.
pub(crate) struct Seconds {
    /// Of camera rays and shadow rays together.
    pub(crate) seconds: f64,
    /// How many these are.
    pub(crate) rays: f64,
}

/// Whether Python finds it.
pub(crate) fn is_here() -> bool {
    let asked = Command::new("python3").args(["-c", "import mitsuba, numpy"]).stderr(Stdio::null()).status();
    asked.is_ok_and(|status| status.success())
}

/// Runs the peer on a scene of shapes that it knows, in a sun, seen by a pinhole camera; none for another.
pub(crate) fn run(scene: &Scene, rounds: u32) -> Result<Option<Seconds>> {
    let Some(shapes) = scene.objects.iter().map(shape).collect::<Option<Vec<Value>>>() else {
        return Ok(None);
    };
    let Camera::Pinhole(pinhole) = scene.camera else { anyhow::bail!("only a pinhole camera") };
    let [Light::Directional(sun)] = scene.lights[..] else { return Ok(None) };
    let (u, v, w) = pinhole.basis();
    let (a, b) = (pinhole.lower_left(), pinhole.upper_right());
    let size = [scene.screen.width(), scene.screen.height()];
    let told = json!({
        "shapes": shapes,
        "size": size,
        "eye": pinhole.eye().to_array(),
        "corner": (a.x * u + a.y * v - pinhole.distance() * w).to_array(),
        "right": ((b.x - a.x) / f64::from(size[0] - 1) * u).to_array(),
        "up": ((b.y - a.y) / f64::from(size[1] - 1) * v).to_array(),
        "towards": (-sun.direction().normalize()).to_array(),
        "rounds": rounds,
    });
    let answer = ask(PROGRAM, &told)?;
    let numbers: Vec<f64> = answer.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    let [camera, shadow, lit] = numbers[..] else { anyhow::bail!("the Mitsuba peer says {answer}") };
    let rays = scene.screen.pixels() as f64 + lit;
    Ok(Some(Seconds { seconds: camera + shadow, rays }))
}

/// What a Python program prints that is told so much.
pub(crate) fn ask(program: &str, told: &Value) -> Result<String> {
    let mut child = Command::new("python3")
        .args(["-c", program])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .context("python3")?;
    child.stdin.take().context("its input")?.write_all(told.to_string().as_bytes())?;
    let run = child.wait_with_output()?;
    ensure!(run.status.success(), "the Mitsuba peer: {}", run.status);
    Ok(String::from_utf8(run.stdout)?)
}

/// Its numbers; none if Mitsuba has no such shape. A cylinder is open there.
fn shape(object: &Object) -> Option<Value> {
    match object {
        Object::Sphere(o) => {
            Some(json!({"kind": "sphere", "center": o.center().to_array(), "radius": o.radius()}))
        }
        Object::Disc(o) => {
            let normal = o.normal().normalize().to_array();
            Some(
                json!({"kind": "disk", "center": o.center().to_array(), "normal": normal, "radius": o.radius()}),
            )
        }
        Object::Cylinder(o) => {
            let [a, b] = o.ends().map(|end| end.to_array());
            Some(json!({"kind": "cylinder", "a": a, "b": b, "radius": o.radius()}))
        }
        Object::Triangle(_)
        | Object::Cuboid(_)
        | Object::Plane(_)
        | Object::Cone(_)
        | Object::Torus(_)
        | Object::Instance(_) => None,
    }
}
