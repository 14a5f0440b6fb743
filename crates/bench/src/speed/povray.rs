//! POV-Ray as a peer: the scene in its language, and its processor time.

use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};
use glam::DVec3;
use image::RgbImage;
use rayfold_scene::{Camera, Light, Material, Object, Scene};
use rayfold_tracer::MAX_BOUNCES;

use crate::cpu_time;

/// Whether the program is on this machine.
pub(crate) fn is_here() -> bool {
    let asked = Command::new("povray").arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    asked.is_ok()
}

/// Draws the scene on one thread, without anti-aliasing. Returns the processor time of the whole program in seconds,
/// and the image.
pub(crate) fn render(scene: &Scene, folder: &Path, size: (u32, u32)) -> Result<(f64, RgbImage)> {
    render_as(scene, folder, size, &["-A"])
}

/// The same with options of its own for anti-aliasing.
pub(crate) fn render_as(
    scene: &Scene,
    folder: &Path,
    (width, height): (u32, u32),
    options: &[&str],
) -> Result<(f64, RgbImage)> {
    let (input, output) = (folder.join("scene.pov"), folder.join("scene.ppm"));
    std::fs::write(&input, translated(scene)?)?;
    let (seconds, run) = cpu_time::of_children(|| {
        Command::new("povray")
            .arg(format!("+I{}", input.display()))
            .arg(format!("+O{}", output.display()))
            .args([format!("+W{width}"), format!("+H{height}")])
            .args(["+FP8", "File_Gamma=1.0", "-D", "-GA", "+WT1"])
            .args(options)
            .env("HOME", folder)
            .output()
    })?;
    let run = run.context("povray")?;
    ensure!(run.status.success(), "povray: {}", String::from_utf8_lossy(&run.stderr));
    let image = portable_pixmap(&std::fs::read(&output)?).context("an image of POV-Ray's")?;
    Ok((seconds, image))
}

/// A binary portable pixmap of 8 bits.
fn portable_pixmap(bytes: &[u8]) -> Option<RgbImage> {
    let mut numbers = Vec::new();
    let mut at = bytes.strip_prefix(b"P6").map(|_| 2)?;
    while numbers.len() < 3 {
        at += bytes[at..].iter().position(|b| !b.is_ascii_whitespace())?;
        let end = at + bytes[at..].iter().position(u8::is_ascii_whitespace)?;
        if bytes[at] == b'#' {
            at += bytes[at..].iter().position(|&b| b == b'\n')?;
            continue;
        }
        numbers.push(std::str::from_utf8(&bytes[at..end]).ok()?.parse::<u32>().ok()?);
        at = end;
    }
    RgbImage::from_raw(numbers[0], numbers[1], bytes[at + 1..].to_vec())
}

fn vector(v: DVec3) -> String {
    format!("<{:e},{:e},{:e}>", v.x, v.y, v.z)
}

/// The same picture: light is linear, shadows are hard, a mirror adds, and nothing is cut off for being faint.
fn translated(scene: &Scene) -> Result<String> {
    let Camera::Pinhole(pinhole) = scene.camera else { anyhow::bail!("only a pinhole camera is translated") };
    let (u, v, w) = pinhole.basis();
    let (a, b) = (pinhole.lower_left(), pinhole.upper_right());
    let middle = 0.5 * (a + b);
    // Samples in pixels' centres there, on the window's corners here.
    let wider = |n: u32| f64::from(n) / f64::from(n.max(2) - 1);
    let right = u * (b.x - a.x) * wider(scene.screen.width());
    let up = v * (b.y - a.y) * wider(scene.screen.height());
    let direction = middle.x * u + middle.y * v - pinhole.distance() * w;
    let mut text = format!(
        "#version 3.7;\nglobal_settings {{ assumed_gamma 1 max_trace_level {} adc_bailout 0 }}\n\
         background {{ rgb {} }}\n\
         camera {{ perspective location {} direction {} right {} up {} }}\n",
        MAX_BOUNCES + 1,
        vector(scene.background.color().context("a sky is not translated")?),
        vector(pinhole.eye()),
        vector(direction),
        vector(right),
        vector(up)
    );
    for light in scene.lights.iter() {
        let Light::Directional(light) = light else { anyhow::bail!("{light:?} is not translated") };
        let from = vector(-1e4 * light.direction());
        writeln!(text, "light_source {{ {from} rgb {} parallel point_at 0 }}", vector(light.color()))?;
    }
    for object in scene.objects.iter() {
        let surface = surface(object.material());
        match object {
            Object::Sphere(s) => {
                writeln!(text, "sphere {{ {}, {:e} {surface} }}", vector(s.center()), s.radius())?;
            }
            Object::Cuboid(c) => {
                writeln!(text, "box {{ {}, {} {surface} }}", vector(c.min()), vector(c.max()))?
            }
            Object::Triangle(t) => {
                let [u, v, w] = t.vertices().map(vector);
                writeln!(text, "triangle {{ {u}, {v}, {w} {surface} }}")?;
            }
            Object::Plane(_)
            | Object::Disc(_)
            | Object::Cylinder(_)
            | Object::Cone(_)
            | Object::Torus(_)
            | Object::Instance(_) => anyhow::bail!("{object:?} is not translated"),
        }
    }
    Ok(text)
}

fn surface(material: &Material) -> String {
    let diffuse = material.diffuse();
    // Emission is multiplied by the pigment.
    let part = |a: f64, r: f64| if r == 0.0 { 0.0 } else { a / r };
    let ambient = material.ambient();
    let emission =
        DVec3::new(part(ambient.x, diffuse.x), part(ambient.y, diffuse.y), part(ambient.z, diffuse.z));
    let mirror = if material.mirror() == DVec3::ZERO {
        String::new()
    } else {
        format!(" reflection {{ rgb {} }}", vector(material.mirror()))
    };
    format!(
        "pigment {{ rgb {} }} finish {{ ambient 0 diffuse 1 emission rgb {}{mirror} }}",
        vector(diffuse),
        vector(emission)
    )
}
