//! POV-Ray as a peer: translates the scene to its language, and measures its processor time.

use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};
use glam::{DMat3, DVec3};
use image::RgbImage;
use rayfold_scene::model::Weight;
use rayfold_scene::{Camera, Light, Material, Object, Roundbox, Scene};
use rayfold_tracer::MAX_BOUNCES;

use crate::cpu_time;

/// Returns whether the program is installed.
pub(crate) fn is_here() -> bool {
    let asked = Command::new("povray").arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    asked.is_ok()
}

/// Draws the scene on one thread, without anti-aliasing. Returns the processor time of the entire program in seconds,
/// and the image.
pub(crate) fn render(scene: &Scene, folder: &Path, size: (u32, u32)) -> Result<(f64, RgbImage)> {
    render_as(scene, folder, size, &["-A"])
}

/// Draws the scene like [`render`], with the given options for anti-aliasing.
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

/// Decodes a binary portable pixmap of 8 bits.
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

/// Translates the scene so that the picture is the same: light is linear, shadows are hard, a mirror adds its light,
/// and no ray is dropped for a small weight.
fn translated(scene: &Scene) -> Result<String> {
    let Camera::Pinhole(pinhole) = scene.camera else { anyhow::bail!("only a pinhole camera is translated") };
    let (u, v, w) = pinhole.basis();
    let (a, b) = (pinhole.lower_left(), pinhole.upper_right());
    let middle = 0.5 * (a + b);
    // POV-Ray samples at the centres of pixels. Here the outermost samples are at the corners of the window.
    let wider = |n: u32| f64::from(n) / f64::from(n.max(2) - 1);
    let right = u * (b.x - a.x) * wider(scene.screen.width());
    let up = v * (b.y - a.y) * wider(scene.screen.height());
    let direction = middle.x * u + middle.y * v - pinhole.distance() * w;
    let mut text = format!(
        "#version 3.7;\nglobal_settings {{ assumed_gamma 1 max_trace_level {} adc_bailout 0 }}\n\
         background {{ rgb {} }}\n\
         camera {{ perspective location {} direction {} right {} up {} }}\n",
        MAX_BOUNCES + 1,
        vector(scene.one_color().context("a sky is not translated")?),
        vector(pinhole.eye()),
        vector(direction),
        vector(right),
        vector(up)
    );
    for light in scene.lights.iter() {
        let color = vector(light.color());
        match light {
            Light::Directional(sun) => {
                let from = vector(-1e4 * sun.direction());
                writeln!(text, "light_source {{ {from} rgb {color} parallel point_at 0 }}")?;
            }
            Light::Lamp(lamp) => {
                ensure!(lamp.reach() == 0.0, "a lamp's reach is not translated");
                writeln!(text, "light_source {{ {} rgb {color} }}", vector(lamp.position()))?;
            }
        }
    }
    for object in scene.objects.iter() {
        let surface = surface(object.material())?;
        match object {
            Object::Instance(instance) => {
                let placement = instance.placement();
                let axes = placement.rotation() * placement.scale();
                let inner = shape(instance.object())?;
                // The pattern is in the group's coordinates.
                writeln!(text, "{inner} {surface} {} }}", matrix(axes, placement.translation()))?;
            }
            object => writeln!(text, "{} {surface} }}", shape(object)?)?,
        }
    }
    Ok(text)
}

/// Returns the shape, without its closing brace.
fn shape(object: &Object) -> Result<String> {
    Ok(match object {
        Object::Sphere(s) => format!("sphere {{ {}, {:e}", vector(s.center()), s.radius()),
        Object::Cuboid(c) => format!("box {{ {}, {}", vector(c.min()), vector(c.max())),
        Object::Triangle(t) => {
            let [u, v, w] = t.vertices().map(vector);
            format!("triangle {{ {u}, {v}, {w}")
        }
        Object::Plane(p) => {
            let normal = p.normal().normalize();
            format!("plane {{ {}, {:e}", vector(normal), normal.dot(p.point()))
        }
        Object::Disc(d) => {
            format!("disc {{ {}, {}, {:e}", vector(d.center()), vector(d.normal()), d.radius())
        }
        Object::Cylinder(c) => {
            let [a, b] = c.ends().map(vector);
            format!("cylinder {{ {a}, {b}, {:e}", c.radius())
        }
        Object::Cone(c) => {
            let ([a, b], [from, to]) = (c.ends().map(vector), c.radii());
            format!("cone {{ {a}, {from:e}, {b}, {to:e}")
        }
        Object::Capsule(c) => {
            let ([a, b], r) = (c.ends().map(vector), c.radius());
            format!(
                "merge {{ sphere {{ {a}, {r:e} }} sphere {{ {b}, {r:e} }} cylinder {{ {a}, {b}, {r:e} open }}"
            )
        }
        Object::Roundbox(r) => roundbox(r),
        Object::Torus(t) => {
            // POV-Ray's tori are around the second axis.
            let y = t.normal().normalize();
            let (x, z) = y.any_orthonormal_pair();
            let axes = matrix(DMat3::from_cols(x, y, z), t.center());
            format!("torus {{ {:e}, {:e} {axes}", t.radius(), t.thickness())
        }
        Object::Mesh(_) => anyhow::bail!("a mesh is not translated"),
        Object::Instance(_) => anyhow::bail!("an object of a group in a group"),
    })
}

/// Returns three boxes, the cylinders of the edges and the spheres of the corners, as POV-Ray's `Round_Box_Union` does;
/// where the inside is seen, those that `Round_Box_Merge` joins.
fn roundbox(roundbox: &Roundbox) -> String {
    let (min, max, radius) = (roundbox.min(), roundbox.max(), roundbox.radius());
    let (low, high) = (min + radius, (max - radius).max(min + radius));
    let has_glass = roundbox.material().finish().is_some_and(|finish| finish.glass.is_some());
    let mut text = String::from(if has_glass { "merge {" } else { "union {" });
    for axis in DVec3::AXES {
        let _ = write!(text, " box {{ {}, {} }}", vector(low - radius * axis), vector(high + radius * axis));
    }
    let corner = |k: usize| {
        let ends = [low, high];
        DVec3::new(ends[k & 1].x, ends[k >> 1 & 1].y, ends[k >> 2].z)
    };
    for k in 0..8 {
        let _ = write!(text, " sphere {{ {}, {radius:e} }}", vector(corner(k)));
        for other in [k | 1, k | 2, k | 4].into_iter().filter(|&other| corner(other) != corner(k)) {
            let ends = [corner(k), corner(other)].map(vector);
            let _ = write!(text, " cylinder {{ {}, {}, {radius:e} open }}", ends[0], ends[1]);
        }
    }
    text
}

fn matrix(axes: DMat3, origin: DVec3) -> String {
    let columns = [axes.x_axis, axes.y_axis, axes.z_axis, origin].map(|v| v.to_array()).concat();
    let numbers: Vec<String> = columns.iter().map(|x| format!("{x:e}")).collect();
    format!("matrix <{}>", numbers.join(","))
}

/// Returns the material. The colours agree if the ratio of ambient to diffuse is equal in both materials of a pattern.
/// POV-Ray's noise differs: so does the picture, but the work is similar.
fn surface(material: &Material) -> Result<String> {
    let diffuse = material.diffuse();
    // POV-Ray multiplies emission by the pigment.
    let part = |a: f64, r: f64| if r == 0.0 { 0.0 } else { a / r };
    let ambient = material.ambient();
    let emission =
        DVec3::new(part(ambient.x, diffuse.x), part(ambient.y, diffuse.y), part(ambient.z, diffuse.z));
    let mirror = if material.mirror() == DVec3::ZERO {
        String::new()
    } else {
        format!(" reflection {{ rgb {} }}", vector(material.mirror()))
    };
    let finish = material.finish();
    if let Some(glass) = finish.and_then(|finish| finish.glass) {
        let color = glass.color().to_array().map(|x| format!("{x:e}")).join(",");
        return Ok(format!(
            "pigment {{ rgbf <{color},1> }} interior {{ ior {:e} }} \
             finish {{ ambient 0 diffuse 0 reflection {{ 0, 1 fresnel on }} conserve_energy }}",
            glass.ior()
        ));
    }
    let shine = match finish.and_then(|finish| finish.shine) {
        None => String::new(),
        Some(shine) => {
            let color = shine.color();
            ensure!(color.min_element() == color.max_element(), "only a grey highlight is translated");
            format!(" specular {:e} roughness {:e}", color.x, 1.0 / shine.exponent())
        }
    };
    let own = vector(diffuse);
    let pigment = match finish.and_then(|finish| finish.pattern) {
        None => format!("rgb {own}"),
        Some(pattern) => {
            let other = vector(pattern.other.diffuse());
            match pattern.weight {
                Weight::Checker(size) => format!("checker rgb {own}, rgb {other} scale {size:e}"),
                Weight::Stripes(size) => {
                    let both = format!("[0 rgb {own}][0.5 rgb {own}][0.5 rgb {other}][1 rgb {other}]");
                    format!("gradient x color_map {{ {both} }} scale {:e}", 2.0 * size)
                }
                Weight::Gradient(from, to) => format!(
                    "gradient y color_map {{ [0 rgb {own}][1 rgb {other}] }} scale {:e} translate <0,{from:e},0>",
                    to - from
                ),
                Weight::Noise(size) => {
                    format!("bozo color_map {{ [0 rgb {own}][1 rgb {other}] }} scale {size:e}")
                }
            }
        }
    };
    Ok(format!(
        "pigment {{ {pigment} }} finish {{ ambient 0 diffuse 1 emission rgb {}{mirror}{shine} }}",
        vector(emission)
    ))
}
