//! Scenes for measurements, made from a seed.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use glam::{DVec2, DVec3};
use rayfold_scene::{
    Camera, Cuboid, DirectionalLight, InvalidValue, Light, Limits, Material, Object, Pinhole, Scene, Screen,
    Script, Sphere, Triangle, natural_cmp, parse,
};

use crate::backends::Ray;

/// Returns a camera at `eye` that looks at `target` and sees `width` world units per unit of distance from side to
/// side.
///
/// # Errors
/// Fails if eye and target coincide or are on a vertical line.
pub fn looking_at(eye: DVec3, target: DVec3, width: f64, screen: Screen) -> Result<Camera, InvalidValue> {
    let half = DVec2::new(0.5, 0.5 * f64::from(screen.height()) / f64::from(screen.width())) * width;
    Pinhole::new(eye, target - eye, DVec3::Y, 1.0, -half, half).map(Camera::Pinhole)
}

/// Returns the ray of column `i` from the left and row `j` from the bottom, of unit length.
pub fn pixel_ray(scene: &Scene, i: u32, j: u32) -> Ray {
    let (origin, direction) = rayfold_tracer::pixel_ray(scene, f64::from(i), f64::from(j));
    Ray { origin, direction }
}

/// Returns the middle frame of an animation in `scenes/`.
///
/// # Errors
/// Fails if its script cannot be read.
pub fn example(name: &str) -> Result<Scene> {
    let scripts = scripts(name)?;
    first_frame(name, scripts.get(scripts.len() / 2).context("a folder without scripts")?)
}

/// Returns the names of the scripts of an animation in `scenes/`, in order.
///
/// # Errors
/// Fails if the folder does not exist.
pub(crate) fn scripts(animation: &str) -> Result<Vec<String>> {
    let folder = folder(animation);
    let mut scripts: Vec<String> = std::fs::read_dir(&folder)
        .with_context(|| folder.display().to_string())?
        .map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned()))
        .collect::<Result<_>>()?;
    scripts.retain(|name| name.ends_with(".txt"));
    scripts.sort_by(|a, b| natural_cmp(a, b));
    Ok(scripts)
}

/// Returns the first frame of a script of an animation in `scenes/`.
///
/// # Errors
/// Fails if the script cannot be read.
pub(crate) fn first_frame(animation: &str, script: &str) -> Result<Scene> {
    let text = std::fs::read(folder(animation).join(script))?;
    let parsed = parse(script, &text, &Limits::default());
    parsed
        .script
        .and_then(|script| script.frame(0))
        .with_context(|| format!("{script}: {:?}", parsed.diagnostics))
}

fn folder(animation: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").join(animation)
}

/// The animations in `scenes/` in version 1 of the language.
pub const EXAMPLES: [&str; 5] = ["sphere_light", "moving_up", "artistic", "artisticsss", "hello"];

/// The animations in `scenes/` in version 2. Each is one script with curves.
pub const MOVING_EXAMPLES: [&str; 5] = ["clockwork", "glass", "lamp", "marbles", "planets"];

/// Returns the middle script of an animation in `scenes/`.
///
/// # Errors
/// Fails if the script cannot be read.
pub fn script(animation: &str) -> Result<Script> {
    let names = scripts(animation)?;
    let name = names.get(names.len() / 2).context("a folder without scripts")?;
    let parsed = parse(name, &std::fs::read(folder(animation).join(name))?, &Limits::default());
    parsed.script.with_context(|| format!("{name}: {:?}", parsed.diagnostics))
}

/// Returns a material that is both diffuse and a mirror.
///
/// # Errors
/// Fails if a number is not finite.
pub fn material(diffuse: DVec3, mirror: f64) -> Result<Material, InvalidValue> {
    Material::new(0.15 * diffuse, diffuse, DVec3::splat(mirror))
}

/// Returns a sun of one grey level.
///
/// # Errors
/// Fails if the direction is zero.
pub fn light(color: f64, direction: [f64; 3]) -> Result<Light, InvalidValue> {
    DirectionalLight::new(DVec3::splat(color), direction.into()).map(Light::Directional)
}

/// Returns 22 spheres, most of them mirrors, over a floor, with 2 boxes, 2 triangles and 2 lights.
///
/// # Errors
/// Does not fail for a screen of ordinary size.
pub fn table(width: u32, height: u32) -> Result<Scene> {
    let screen = Screen::new(width, height)?;
    let mut scene = Scene::new(screen, looking_at(DVec3::new(0.0, 4.5, 9.0), DVec3::ZERO, 1.1, screen)?);
    scene.set_background(DVec3::new(0.25, 0.35, 0.55))?;
    let mut objects = vec![
        cuboid([-6.0, -1.2, -6.0], [6.0, -1.0, 6.0], DVec3::new(0.6, 0.6, 0.55))?,
        cuboid([-3.4, -1.0, -4.4], [-2.6, 1.6, -3.6], DVec3::new(0.7, 0.3, 0.2))?,
        triangle([[2.0, -1.0, -4.5], [4.5, -1.0, -3.0], [3.2, 2.2, -4.0]], DVec3::new(0.2, 0.5, 0.3))?,
        triangle([[-5.5, -0.9, 1.0], [-4.2, -0.9, 2.4], [-4.9, 1.4, 1.6]], DVec3::new(0.5, 0.5, 0.1))?,
    ];
    let mut rng = fastrand::Rng::with_seed(22);
    for k in 0..22 {
        let radius = 0.35 + 0.3 * rng.f64();
        let spot = DVec3::new(f64::from(k % 6) * 1.5 - 3.7, radius - 1.0, f64::from(k / 6) * 1.6 - 2.4);
        let jitter = DVec3::new(rng.f64() - 0.5, 0.0, rng.f64() - 0.5) * 0.4;
        let color = DVec3::new(rng.f64(), rng.f64(), rng.f64()) * 0.6 + 0.1;
        let mirror = if k % 4 == 3 { 0.0 } else { 0.2 + 0.4 * rng.f64() };
        objects.push(Object::Sphere(Sphere::new(radius, spot + jitter, material(color, mirror)?)?));
    }
    scene.objects = objects.into();
    scene.lights = vec![light(0.7, [-1.0, -2.0, -1.0])?, light(0.4, [1.5, -1.0, -0.5])?].into();
    Ok(scene)
}

/// Returns `count` spheres that fill a cube. The number of visible spheres hardly depends on `count`, because more
/// spheres are smaller.
///
/// # Errors
/// Does not fail for a screen of ordinary size.
pub fn cloud(count: u32, width: u32, height: u32) -> Result<Scene> {
    let screen = Screen::new(width, height)?;
    let mut scene = Scene::new(screen, looking_at(DVec3::new(0.0, 0.5, 6.0), DVec3::ZERO, 0.8, screen)?);
    scene.set_background(DVec3::splat(0.1))?;
    let mut rng = fastrand::Rng::with_seed(u64::from(count));
    let radius = 0.9 / f64::from(count).cbrt();
    let objects: Result<Vec<_>> = (0..count)
        .map(|k| {
            let center = DVec3::new(rng.f64(), rng.f64(), rng.f64()) * 4.0 - 2.0;
            let color = DVec3::new(rng.f64(), rng.f64(), rng.f64());
            let mirror = if k % 4 == 0 { 0.3 } else { 0.0 };
            Ok(Object::Sphere(Sphere::new(radius, center, material(color, mirror)?)?))
        })
        .collect();
    scene.objects = objects?.into();
    scene.lights = vec![light(0.9, [-1.0, -2.0, -1.5])?].into();
    Ok(scene)
}

/// Returns a closed, wrinkled surface around the origin of at least `count` triangles, seen and lit from outside.
///
/// # Errors
/// Does not fail for a screen of ordinary size.
pub fn rock(count: usize, width: u32, height: u32) -> Result<Scene> {
    let screen = Screen::new(width, height)?;
    let mut scene = Scene::new(screen, looking_at(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, 0.8, screen)?);
    scene.set_background(DVec3::splat(0.1))?;
    let surface = material(DVec3::new(0.7, 0.65, 0.5), 0.0)?;
    let faces = icosphere(count);
    let objects: Result<Vec<_>> = faces
        .iter()
        .map(|face| Ok(Object::Triangle(Triangle::new(face.map(|p| single(wrinkled(p))), surface.clone())?)))
        .collect();
    scene.objects = objects?.into();
    scene.lights = vec![light(0.9, [-1.0, -2.0, -1.5])?].into();
    Ok(scene)
}

/// Returns an icosahedron whose faces are subdivided into four until there are at least `count`. The corners are on the
/// unit sphere, and neighbours share them bit for bit.
pub fn icosphere(count: usize) -> Vec<[DVec3; 3]> {
    let golden = 0.5 + 1.25f64.sqrt();
    let corners: Vec<DVec3> = [(-1.0, golden), (1.0, golden), (-1.0, -golden), (1.0, -golden)]
        .into_iter()
        .flat_map(|(a, b)| [DVec3::new(a, b, 0.0), DVec3::new(0.0, a, b), DVec3::new(b, 0.0, a)])
        .map(DVec3::normalize)
        .collect();
    // The faces are the 20 triples of mutual neighbours: no other corners are as near to each other.
    let near = |a: DVec3, b: DVec3| a.distance(b) < 1.1;
    let mut faces = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                let [p, q, r] = [corners[a], corners[b], corners[c]];
                if near(p, q) && near(q, r) && near(r, p) {
                    faces.push([p, q, r]);
                }
            }
        }
    }
    while faces.len() < count {
        faces = faces.into_iter().flat_map(quartered).collect();
    }
    faces
}

fn quartered([p, q, r]: [DVec3; 3]) -> [[DVec3; 3]; 4] {
    // A sum of two is commutative, so both neighbours get the same midpoint.
    let [a, b, c] = [(p + q).normalize(), (q + r).normalize(), (r + p).normalize()];
    [[p, a, c], [a, q, b], [c, b, r], [a, b, c]]
}

fn wrinkled(p: DVec3) -> DVec3 {
    let waves =
        (7.0 * p.x + 3.0 * p.y).sin() * (5.0 * p.y - 4.0 * p.z).sin() + 0.3 * (31.0 * p.z + 17.0 * p.x).sin();
    p * (1.0 + 0.08 * waves)
}

/// Returns the nearest vector of `f32`s, which every arithmetic represents exactly.
pub fn single(v: DVec3) -> DVec3 {
    v.as_vec3().as_dvec3()
}

/// Returns the scene with every position `p` moved to `scale · p + offset`, including the eye.
///
/// # Errors
/// Fails if a number overflows, or if the camera is not a pinhole.
pub fn moved(scene: &Scene, scale: f64, offset: DVec3) -> Result<Scene> {
    let place = |p: DVec3| scale * p + offset;
    let Camera::Pinhole(pinhole) = scene.camera else { anyhow::bail!("only a pinhole camera moves") };
    let mut moved = scene.clone();
    moved.camera = Camera::Pinhole(Pinhole::new(
        place(pinhole.eye()),
        pinhole.gaze(),
        pinhole.up(),
        pinhole.distance(),
        pinhole.lower_left(),
        pinhole.upper_right(),
    )?);
    let objects: Result<Vec<_>, _> = scene.objects.iter().map(|object| object.placed(scale, place)).collect();
    moved.objects = objects.context("the moved scene")?.into();
    Ok(moved)
}

fn cuboid(u: [f64; 3], v: [f64; 3], color: DVec3) -> Result<Object> {
    Ok(Object::Cuboid(Cuboid::new([u.into(), v.into()], material(color, 0.0)?)?))
}

fn triangle(vertices: [[f64; 3]; 3], color: DVec3) -> Result<Object> {
    Ok(Object::Triangle(Triangle::new(vertices.map(DVec3::from), material(color, 0.0)?)?))
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use super::*;

    #[test]
    fn an_icosphere_is_closed() {
        for count in [20, 21, 320] {
            let faces = icosphere(count);
            assert!(faces.len() >= count && faces.len() < 4 * count.max(20));
            let bits = |p: DVec3| p.to_array().map(f64::to_bits);
            let mut edges: HashMap<_, u32> = HashMap::new();
            for [p, q, r] in faces {
                for (a, b) in [(p, q), (q, r), (r, p)] {
                    *edges
                        .entry(if bits(a) < bits(b) { (bits(a), bits(b)) } else { (bits(b), bits(a)) })
                        .or_default() += 1;
                }
            }
            assert!(edges.values().all(|&uses| uses == 2));
        }
    }
}
