//! A tracer in its simplest form: `f32` throughout, textbook formulas, an epsilon against self-intersection.
//!
//! It shows that the hard cases detect rounding errors. The cost of robustness is measured with packets of the same
//! formulas, [`rayfold_tracer::render_naive`].

use glam::{DVec3, Vec3};
use image::RgbImage;
use rayfold_scene::{Light, Object, Scene};
use rayfold_tracer::MAX_BOUNCES;

use crate::backends::{Arithmetic, Backend, Hit, Ray};
use crate::scenes::pixel_ray;

/// The distance from a surface at which a ray starts, in world units. It does not depend on the size of the scene.
const EPSILON: f32 = 1e-4;

/// The name of the backend in reports.
pub(crate) const NAME: &str = "f32 naive, scalar";

/// Returns the naive backend.
pub(crate) fn backend() -> Backend {
    Backend::new(
        NAME,
        Arithmetic::Single,
        |scene, rays| {
            let objects: Vec<Shape> = scene.objects.iter().map(Shape::from).collect();
            Ok(rays.iter().map(|ray| hit(&objects, ray)).collect())
        },
        |scene| Ok(render(scene)),
    )
}

fn hit(objects: &[Shape], ray: &Ray) -> Option<Hit> {
    let direction = ray.direction.as_vec3();
    let (object, t) = nearest(objects, ray.origin.as_vec3(), direction, 0.0)?;
    let point = ray.origin.as_vec3() + t * direction;
    let normal = objects[object].normal(point, direction).as_dvec3();
    Some(Hit { object, t: f64::from(t), normal })
}

enum Shape {
    Sphere { center: Vec3, radius: f32 },
    Triangle { corner: Vec3, edges: [Vec3; 2] },
    Cuboid { min: Vec3, max: Vec3 },
}

impl From<&Object> for Shape {
    fn from(object: &Object) -> Self {
        match object {
            Object::Sphere(s) => Self::Sphere { center: s.center().as_vec3(), radius: s.radius() as f32 },
            Object::Triangle(t) => {
                let [u, v, w] = t.vertices().map(|p| p.as_vec3());
                Self::Triangle { corner: u, edges: [v - u, w - u] }
            }
            Object::Cuboid(c) => Self::Cuboid { min: c.min().as_vec3(), max: c.max().as_vec3() },
            _ => unreachable!("the scenes that are compared have no {object:?}"),
        }
    }
}

impl Shape {
    fn meet(&self, origin: Vec3, direction: Vec3, start: f32) -> Option<f32> {
        match *self {
            Self::Sphere { center, radius } => {
                let m = origin - center;
                let (a, b, c) = (direction.dot(direction), m.dot(direction), m.dot(m) - radius * radius);
                let root = (b * b - a * c).sqrt();
                [(-b - root) / a, (-b + root) / a].into_iter().find(|&t| t > start)
            }
            // Möller and Trumbore, "Fast, minimum storage ray/triangle intersection", 1997.
            Self::Triangle { corner, edges: [p, q] } => {
                let across = direction.cross(q);
                let determinant = p.dot(across);
                let m = origin - corner;
                let u = m.dot(across) / determinant;
                let over = m.cross(p);
                let v = direction.dot(over) / determinant;
                let t = q.dot(over) / determinant;
                (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > start).then_some(t)
            }
            Self::Cuboid { min, max } => {
                let (a, b) = ((min - origin) / direction, (max - origin) / direction);
                let (enter, leave) = (a.min(b).max_element(), a.max(b).min_element());
                if enter > leave {
                    return None;
                }
                [enter, leave].into_iter().find(|&t| t > start)
            }
        }
    }

    fn normal(&self, point: Vec3, direction: Vec3) -> Vec3 {
        let normal = match *self {
            Self::Sphere { center, .. } => (point - center).normalize(),
            Self::Triangle { edges: [p, q], .. } => p.cross(q).normalize(),
            Self::Cuboid { min, max } => {
                let off = (point - min).abs().min((point - max).abs());
                Vec3::AXES[off.min_position()]
            }
        };
        if normal.dot(direction) > 0.0 { -normal } else { normal }
    }
}

fn nearest(objects: &[Shape], origin: Vec3, direction: Vec3, start: f32) -> Option<(usize, f32)> {
    let mut best: Option<(usize, f32)> = None;
    for (index, object) in objects.iter().enumerate() {
        if let Some(t) = object.meet(origin, direction, start)
            && best.is_none_or(|(_, least)| t < least)
        {
            best = Some((index, t));
        }
    }
    best
}

fn render(scene: &Scene) -> RgbImage {
    let objects: Vec<Shape> = scene.objects.iter().map(Shape::from).collect();
    RgbImage::from_fn(scene.screen.width(), scene.screen.height(), |x, y| {
        let ray = pixel_ray(scene, x, scene.screen.height() - 1 - y);
        let color = color(scene, &objects, ray.origin.as_vec3(), ray.direction.as_vec3(), 0);
        image::Rgb(color.to_array().map(|c| (255.0 * c.clamp(0.0, 1.0)).round() as u8))
    })
}

fn color(scene: &Scene, objects: &[Shape], origin: Vec3, direction: Vec3, bounces: u32) -> Vec3 {
    let start = if bounces == 0 { 0.0 } else { EPSILON };
    let Some((object, t)) = nearest(objects, origin, direction, start) else {
        return scene.surroundings().along(direction.as_dvec3()).as_vec3();
    };
    let point = origin + t * direction;
    let normal = objects[object].normal(point, direction);
    let material = scene.objects[object].material();
    let mut sum = material.ambient().as_vec3();
    for light in scene.lights.iter() {
        let Light::Directional(light) = light else {
            unreachable!("the scenes that are compared have no {light:?}")
        };
        let towards = -light.direction().as_vec3().normalize();
        let cosine = normal.dot(towards);
        if cosine > 0.0 && !objects.iter().any(|o| o.meet(point, towards, EPSILON).is_some()) {
            sum += light.color().as_vec3() * material.diffuse().as_vec3() * cosine;
        }
    }
    if bounces < MAX_BOUNCES && material.mirror() != DVec3::ZERO {
        let mirrored = direction - 2.0 * direction.dot(normal) * normal;
        sum += material.mirror().as_vec3() * color(scene, objects, point, mirrored, bounces + 1);
    }
    sum
}
