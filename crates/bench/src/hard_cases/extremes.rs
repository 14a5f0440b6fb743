//! Numbers at the ends of the range: an error or the right image, but always a result.

use anyhow::Result;
use glam::DVec3;
use rayfold_scene::{Camera, DirectionalLight, Light, Limits, Material, Object, Scene, Screen, Sphere};

use super::figures::{Figures, Size};
use super::images::off_by_more_than;
use crate::backends::Backend;
use crate::oracle;
use crate::scenes::{light, looking_at, moved, table};

/// Checks that infinite inputs are errors, and that scenes of any size and colours of any brightness look as the oracle
/// draws them.
pub(super) fn inputs(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    let accepted = infinite_inputs();
    let side = size.pick(48, 192);
    let scene = table(side, side)?;
    for backend in backends {
        figures.add(backend, "infinite inputs accepted", accepted.1, accepted.0 as f64, 0.0);
        let image = backend.render(&scene)?;
        for exponent in [-1000, -500, -140, 140, 500, 1000] {
            let other = backend.render(&moved(&scene, 2f64.powi(exponent), DVec3::ZERO)?)?;
            let off = off_by_more_than(2, &image, &other);
            let what = format!("pixels off by > 2 levels, scaled by 2^{exponent}");
            figures.add(
                backend,
                what,
                image.pixels().len(),
                off as f64,
                0.0005 * image.pixels().len() as f64,
            );
        }
        for (what, scene) in bright_and_dim()? {
            let truth = oracle::image(&scene);
            let off = off_by_more_than(2, &truth, &backend.render(&scene)?);
            figures.add(
                backend,
                format!("pixels off by > 2 levels, {what}"),
                truth.pixels().len(),
                off as f64,
                0.0,
            );
        }
    }
    Ok(())
}

/// Returns how many infinite or NaN inputs are accepted, and the number of inputs.
fn infinite_inputs() -> (usize, usize) {
    let scripts = [
        "Sphere 1e999 0 0 0 0 0 0 1 1 1",
        "Sphere 1 inf 0 0 0 0 0 1 1 1",
        "Sphere nan 0 0 0 0 0 0 1 1 1",
        "Triangle 0 0 0 1e400 0 0 0 1 0 0 0 0 1 1 1",
        "Box 0 0 0 -1e999 1 1 0 0 0 1 1 1",
        "Ilight 1 1 1 0 0 -1e999",
        "Camera 0 0 0 0 0 -1 0 1 0 1e999 -1 -1 1 1",
        "Background 1e999 0 0",
    ];
    let read = |line: &str| {
        let text = format!("Screen 2 2\n{line}\nTrace");
        rayfold_scene::parse("huge.txt", text.as_bytes(), &Limits::default()).script.is_some()
    };
    let mut accepted = scripts.iter().filter(|line| read(line)).count();
    for bad in [f64::INFINITY, f64::NEG_INFINITY, f64::NAN] {
        accepted += usize::from(Sphere::new(bad, DVec3::ZERO, Material::default()).is_ok());
        accepted += usize::from(Sphere::new(1.0, DVec3::splat(bad), Material::default()).is_ok());
        accepted += usize::from(Material::new(DVec3::splat(bad), DVec3::ZERO, DVec3::ZERO).is_ok());
        accepted += usize::from(DirectionalLight::new(DVec3::ONE, DVec3::splat(bad)).is_ok());
    }
    (accepted, scripts.len() + 12)
}

/// Returns small scenes of one sphere on a background.
fn bright_and_dim() -> Result<Vec<(&'static str, Scene)>> {
    let screen = Screen::new(24, 24)?;
    let camera = looking_at(DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO, 0.8, screen)?;
    let lit =
        |camera: Camera, radius: f64, center: DVec3, material: Material, light: Light| -> Result<Scene> {
            let mut scene = Scene::new(screen, camera);
            scene.set_background(DVec3::new(0.2, 0.4, 0.6))?;
            scene.objects = vec![Object::Sphere(Sphere::new(radius, center, material)?)].into();
            scene.lights = vec![light].into();
            Ok(scene)
        };
    let matte = Material::new(DVec3::splat(0.1), DVec3::splat(0.7), DVec3::ZERO)?;
    let tiny = f64::from_bits(1);
    let bright = Material::new(DVec3::splat(-1e308), DVec3::splat(1e308), DVec3::splat(1e308))?;
    Ok(vec![
        (
            "a light of subnormal direction",
            lit(camera, 1.0, DVec3::ZERO, matte.clone(), light(1.0, [-tiny, -tiny, -tiny])?)?,
        ),
        (
            "a light of huge direction",
            lit(camera, 1.0, DVec3::ZERO, matte.clone(), light(1.0, [-1e308, -1e308, -1e308])?)?,
        ),
        (
            "a sphere of subnormal radius",
            lit(camera, tiny, DVec3::ZERO, matte.clone(), light(1.0, [0.0, -1.0, 0.0])?)?,
        ),
        (
            "a sphere of huge radius around all",
            lit(camera, 1e308, DVec3::ZERO, matte.clone(), light(1.0, [0.0, -1.0, 0.0])?)?,
        ),
        (
            "a sphere of huge radius far off",
            lit(camera, 1e300, DVec3::new(0.0, 0.0, -1e301), matte, light(1.0, [0.0, -1.0, -0.2])?)?,
        ),
        ("huge colours", lit(camera, 1.0, DVec3::ZERO, bright, light(1e308, [-1.0, -1.0, -1.0])?)?),
    ])
}
