//! Mitsuba 3 as a peer, if it is installed for Python: camera and shadow rays against spheres, discs and cylinders.
//!
//! Its LLVM variant intersects shapes as Embree's user geometry, with kernels that it compiles for the machine.

use std::io::Write as _;
use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};
use rayfold_scene::{Camera, Light, Object, Scene};
use serde_json::{Value, json};

const PROGRAM: &str = include_str!("mitsuba_peer.py");

/// The processor time on one thread, without shading.
pub(crate) struct Seconds {
    /// The time of camera rays and shadow rays together.
    pub(crate) seconds: f64,
    /// The number of camera rays and shadow rays.
    pub(crate) rays: f64,
}

/// Returns whether Python finds Mitsuba.
pub(crate) fn is_here() -> bool {
    let asked = Command::new("python3").args(["-c", "import mitsuba, numpy"]).stderr(Stdio::null()).status();
    asked.is_ok_and(|status| status.success())
}

/// Runs the peer on a scene with a sun and a pinhole camera. Returns `None` if Mitsuba lacks a shape.
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

/// Runs a Python program with JSON as its input, and returns its output.
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

/// Returns the numbers of a shape; `None` if Mitsuba has no such shape. Its cylinders are open.
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
        _ => None,
    }
}
