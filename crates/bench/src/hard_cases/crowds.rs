//! Thousands of objects in one place: prepared in `n log n`, and drawn like the plain tracer draws them.

use anyhow::Result;
use fastrand::Rng;
use glam::{DVec2, DVec3};
use rayfold_scene::{Camera, Material, Object, Pinhole, Scene, Screen, Sphere, Triangle};
use rayfold_tracer::{Drawing, RenderOptions};

use super::figures::{Figures, Size};
use super::images::off_by_more_than;
use super::setup::{direction, random};
use crate::backends::{Arithmetic, Backend, reference};
use crate::cpu_time;
use crate::scenes::light;

/// From a quarter of the largest number to all, `n log n` grows with the exponent 1.06. The rest allows for caches,
/// which favour the smaller number.
const EXPONENT: f64 = 1.4;

/// A function that makes an object; its number is the position among all, from 0 to 1.
type Kind = (&'static str, fn(&mut Rng, f64) -> Result<Object>);

const KINDS: &[Kind] = &[
    ("the same sphere", |rng, _| Ok(Sphere::new(1.0, DVec3::ZERO, matte(rng)?)?.into())),
    ("the same triangle", |rng, _| {
        let corners = [DVec3::new(-1.0, -1.0, 0.0), DVec3::new(1.0, -1.0, 0.3), DVec3::new(0.2, 1.0, 0.1)];
        Ok(Triangle::new(corners, matte(rng)?)?.into())
    }),
    ("shells", |rng, part| Ok(Sphere::new(1.0 + 0.01 * part, DVec3::ZERO, matte(rng)?)?.into())),
    ("a fan", |rng, part| {
        let rim = |part: f64| {
            let turn = DVec2::from_angle(std::f64::consts::TAU * part);
            2.0 * DVec3::new(turn.x, 0.1 * turn.x, turn.y)
        };
        Ok(Triangle::new([DVec3::ZERO, rim(part), rim(part + 1e-4)], matte(rng)?)?.into())
    }),
    ("needles", |rng, _| {
        let tip = DVec3::new(-2.0, 0.0, 0.0);
        let mut base = || DVec3::X * 2.0 + 0.01 * direction(rng);
        let corners = [tip, base(), base()];
        Ok(Triangle::new(corners, matte(rng)?)?.into())
    }),
    ("mirrors around the eye", |rng, _| {
        let color = DVec3::new(rng.f64(), rng.f64(), rng.f64());
        let surface = Material::new(0.2 * color, 0.3 * color, DVec3::splat(0.4))?;
        Ok(Sphere::new(9.0 + rng.f64(), direction(rng), surface)?.into())
    }),
];

fn matte(rng: &mut Rng) -> Result<Material> {
    let color = DVec3::new(rng.f64(), rng.f64(), rng.f64());
    Ok(Material::new(0.2 * color, 0.6 * color, DVec3::ZERO)?)
}

fn crowd(kind: &Kind, count: usize) -> Result<Scene> {
    let mut rng = random(38);
    let (_, make) = kind;
    let objects: Result<Vec<_>> = (0..count).map(|k| make(&mut rng, k as f64 / count as f64)).collect();
    let half = DVec2::new(0.4, 0.3);
    let eye = DVec3::new(0.1, 1.5, 5.0);
    let camera = Pinhole::new(eye, DVec3::new(0.0, 0.1, 0.0) - eye, DVec3::Y, 1.0, -half, half)?;
    let mut scene = Scene::new(Screen::new(16, 12)?, Camera::Pinhole(camera));
    scene.lights = vec![light(0.8, [0.3, -1.0, -0.4])?].into();
    scene.objects = objects?.into();
    Ok(scene)
}

/// Compares every backend with the plain tracer, and measures the growth of the time of preparation.
pub(super) fn crowds(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    for kind in KINDS {
        let scene = crowd(kind, 5000)?;
        let plain = reference().render(&scene)?;
        for backend in backends.iter().filter(|backend| backend.arithmetic != Arithmetic::Single) {
            let off = off_by_more_than(2, &plain, &backend.render(&scene)?);
            let pixels = plain.pixels().len();
            figures.add(backend, format!("{}: pixels off by > 2 levels", kind.0), pixels, off as f64, 0.0);
        }
    }
    let most = size.pick(80_000, 1_000_000);
    let chosen = backends.iter().filter(|backend| backend.arithmetic == Arithmetic::Chosen);
    for backend in chosen.take(1) {
        for kind in KINDS {
            let seconds = |count: usize| {
                let scene = crowd(kind, count)?;
                let options = RenderOptions::default();
                let (seconds, drawing) = cpu_time::of(|| Drawing::new(&scene, &options).map(drop))?;
                drawing?;
                Ok::<f64, anyhow::Error>(seconds)
            };
            let (quarter, all) = (seconds(most / 4)?, seconds(most)?);
            let exponent = (all / quarter).log(4.0);
            let bound = match size {
                // On a busy machine these times show quadratic growth at best.
                Size::Quick => None,
                Size::Full => Some(EXPONENT),
            };
            figures.add(backend, format!("{}: exponent of preparation", kind.0), most, exponent, bound);
            figures.add(backend, format!("{}: seconds of preparation", kind.0), most, all, None);
        }
    }
    Ok(())
}
