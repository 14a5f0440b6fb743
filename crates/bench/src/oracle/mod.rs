//! What the scene language says, without rounding.
//!
//! A second implementation of hits, normals and shading, in numbers of 640 bits and the most direct formulas. Where a
//! tracer and the oracle differ, the tracer has rounded. It shares no code with the tracers, is slow (some 10 µs an
//! object and ray) and knows nothing of how they work.
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

mod line;
mod real;
mod shapes;

use glam::DVec3;
use image::RgbImage;
use rayfold_scene::{Light, Object, Scene};
use rayfold_tracer::MAX_BOUNCES;
use rayon::prelude::*;

pub use line::Line;
pub use real::{Real, Vector};
pub use shapes::{edge_clearance, sphere_clearance};

/// Where a ray meets an object first.
#[derive(Clone, Debug)]
pub struct Hit {
    /// Position of the object in the script.
    pub object: usize,
    /// In lengths of the direction.
    pub t: Real,
    /// Unit normal, facing the ray. On the edge of a box that of the first axis which leads there.
    pub normal: Vector,
}

/// The nearest hit of the ray exactly as given.
pub fn nearest(objects: &[Object], origin: DVec3, direction: DVec3) -> Option<Hit> {
    nearest_on(objects, &Line { origin: origin.into(), direction: direction.into() }, &Real::zero())
}

/// The nearest hit farther than `start`, in lengths of the direction, of a ray that is itself without rounding.
pub fn nearest_beyond(objects: &[Object], origin: &Vector, direction: &Vector, start: &Real) -> Option<Hit> {
    nearest_on(objects, &Line { origin: origin.clone(), direction: direction.clone() }, start)
}

/// The nearest hit farther away than `start`; of hits at the same distance that of the first object. Distances that
/// differ by less than one part in 2^400 are the same: roots are rounded.
fn nearest_on(objects: &[Object], line: &Line, start: &Real) -> Option<Hit> {
    let mut best: Option<(usize, Real)> = None;
    for (index, object) in objects.iter().enumerate() {
        let Some(t) = shapes::first(object, line, start) else { continue };
        let nearer = best.as_ref().is_none_or(|(_, least)| t < *least && &t + &t.shifted(-400) < *least);
        if nearer {
            best = Some((index, t));
        }
    }
    let (object, t) = best?;
    let normal = shapes::normal(&objects[object], line, &t);
    Some(Hit { object, t, normal })
}

/// The colour of a pixel, unclamped; `i` counts from the left, `j` from the bottom.
pub fn color(scene: &Scene, i: u32, j: u32) -> DVec3 {
    color_at(scene, f64::from(i), f64::from(j))
}

/// The colour beside a pixel, where the ray of a fractional index goes.
pub fn color_at(scene: &Scene, x: f64, y: f64) -> DVec3 {
    color_along(scene, &Line::of_pixel(&scene.camera, scene.screen, x, y), &Real::zero(), 0)
        .map_or_else(|| plain_background(scene), |color| color.to_dvec3())
}

/// Which object a pixel shows, and its normal there.
pub fn first_hit(scene: &Scene, i: u32, j: u32) -> Option<(usize, DVec3)> {
    let line = Line::of_pixel(&scene.camera, scene.screen, f64::from(i), f64::from(j));
    nearest_on(&scene.objects, &line, &Real::zero()).map(|hit| (hit.object, hit.normal.to_dvec3()))
}

/// The whole image, its first row at the top.
pub fn image(scene: &Scene) -> RgbImage {
    let (width, height) = (scene.screen.width(), scene.screen.height());
    let pixels: Vec<_> = (0..width * height)
        .into_par_iter()
        .flat_map_iter(|k| levels(color(scene, k % width, height - 1 - k / width)))
        .collect();
    RgbImage::from_raw(width, height, pixels).unwrap_or_default()
}

/// Display values as the language makes levels of them.
pub fn levels(color: DVec3) -> [u8; 3] {
    color.to_array().map(|c| (255.0 * c.clamp(0.0, 1.0)).round() as u8)
}

/// `None` where the ray meets nothing.
fn color_along(scene: &Scene, line: &Line, start: &Real, bounces: u32) -> Option<Vector> {
    let hit = nearest_on(&scene.objects, line, start)?;
    let material = scene.objects[hit.object].material();
    let point = line.origin.plus(&hit.t, &line.direction);
    // A point on a surface is irrational: the ray that leaves it meets the surface again next to its start.
    let start = Real::from(shapes::extent(&scene.objects)).shifted(-300);
    let mut color = Vector::from(material.ambient());
    for light in scene.lights.iter() {
        let Light::Directional(light) = light else {
            unreachable!("the oracle is not asked about {light:?}")
        };
        let towards = Vector::from(light.direction()).opposite().unit();
        let cosine = hit.normal.dot(&towards);
        let shadow = Line { origin: point.clone(), direction: towards };
        if cosine.sign() > 0
            && !scene.objects.iter().any(|object| shapes::first(object, &shadow, &start).is_some())
        {
            let scattered = Vector::from(material.diffuse());
            let arriving = Vector::from(light.color());
            for axis in 0..3 {
                let term = &(&arriving.0[axis] * &scattered.0[axis]) * &cosine;
                color.0[axis] = &color.0[axis] + &term;
            }
        }
    }
    if bounces < MAX_BOUNCES && material.mirror() != DVec3::ZERO {
        let mirrored = reflected(&line.direction, &hit.normal);
        let next = Line { origin: point, direction: mirrored.unit() };
        let seen = color_along(scene, &next, &start, bounces + 1)
            .unwrap_or_else(|| Vector::from(plain_background(scene)));
        let mirror = Vector::from(material.mirror());
        for axis in 0..3 {
            color.0[axis] = &color.0[axis] + &(&mirror.0[axis] * &seen.0[axis]);
        }
    }
    Some(color)
}

fn plain_background(scene: &Scene) -> DVec3 {
    scene.background.color().unwrap_or_else(|| unreachable!("the oracle is not asked about skies"))
}

/// The direction mirrored at a surface of this unit normal.
pub fn reflected(direction: &Vector, normal: &Vector) -> Vector {
    let twice = direction.dot(normal).shifted(1);
    direction.plus(&-&twice, normal)
}
