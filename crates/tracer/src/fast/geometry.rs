//! A scene in the coordinates that the kernels work in.
//!
//! The origin is brought to the eye, so that numbers are as small as what is seen is near, and lengths are scaled by a
//! power of two, so that everything lies in -1..=1: no product overflows, and a scene scaled by a power of two is the
//! same scene bit for bit. All of it is `f64`; nothing here knows how precise the kernels are.

use std::sync::Arc;

use glam::DVec3;
use rayfold_scene::model::unit;
use rayfold_scene::{Camera, Light, Object, Scene, Screen};

use super::tree::{Branches, group, join};
use crate::RenderError;
use crate::parallel::map;
use crate::reference::{normal_and_width, power, triangle_normal};
use crate::scale::below_inverse;

/// The shape of an object.
#[derive(Clone, Copy, Debug)]
pub(super) enum Shape {
    /// `power` is that of the eye: |center|² - radius², as exact as a number can be.
    Sphere {
        center: DVec3,
        radius: f64,
        power: f64,
    },
    Cuboid {
        min: DVec3,
        max: DVec3,
    },
    Triangle {
        vertices: [DVec3; 3],
        normal: DVec3,
    },
}

/// An object and its position in the script.
#[derive(Clone, Copy, Debug)]
pub(super) struct Solid {
    pub(super) shape: Shape,
    pub(super) order: u32,
}

/// Where the rays of the pixels come from.
#[derive(Clone, Copy, Debug)]
pub(super) enum View {
    /// The eye is the origin; `right`, `up` and `back` are orthonormal. The ray of column `i` and row `j` (from the
    /// bottom) goes along `(x.0 + i·x.1)·right + (y.0 + j·y.1)·up - back`.
    Pinhole { right: DVec3, up: DVec3, back: DVec3, x: (f64, f64), y: (f64, f64) },
    /// The ray starts at `corner + (i·pixel, j·pixel, 0)` and goes along `(0, 0, -1)`.
    Parallel { corner: DVec3, pixel: f64 },
}

/// A light at infinity: the unit vector towards it, and its colour.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sun {
    pub(super) towards: DVec3,
    pub(super) color: DVec3,
}

/// A scene, recentred and scaled.
#[derive(Clone, Debug)]
pub(super) struct Geometry {
    pub(super) view: View,
    /// In the order of the script, or in that of `branches`.
    pub(super) solids: Arc<Vec<Solid>>,
    /// How a tree groups the solids, if they are to be found down a tree.
    pub(super) branches: Option<Branches>,
    pub(super) suns: Vec<Sun>,
    /// A length of the scene times this is a length in here.
    pub(super) scale: f64,
    /// What the scene calls its origin's opposite: `(point - center) * scale` is a point in here.
    pub(super) center: DVec3,
}

impl Geometry {
    /// `tree` says whether to look for objects down a tree, if it matters.
    ///
    /// # Errors
    /// When the scene is so large that its size is not a number.
    pub(super) fn new(scene: &Scene, tree: Option<bool>) -> Result<Self, RenderError> {
        let center = match &scene.camera {
            Camera::Pinhole(pinhole) => pinhole.eye(),
            Camera::Orthographic => middle(scene.screen),
        };
        let reaches = map(&scene.objects, |object| reach(object, center));
        let reach = reaches.into_iter().fold(0.0, f64::max);
        let reach = match scene.camera {
            Camera::Pinhole(_) => reach,
            Camera::Orthographic => reach.max(center.max_element()),
        };
        if !reach.is_finite() {
            return Err(RenderError::TooVast);
        }
        let scale = below_inverse(reach);
        let view = view(scene, scale);
        let place = |point: DVec3| (point - center) * scale;
        let shapes = map(&scene.objects, |object| shape(object, place, center, scale));
        let solids = shapes.into_iter().enumerate();
        let solids = solids.filter_map(|(order, shape)| Some(Solid { shape: shape?, order: order as u32 }));
        let mut solids: Vec<Solid> = solids.collect();
        let branches = group(&mut solids, tree);
        let suns = scene
            .lights
            .iter()
            .map(|Light::Directional(light)| Sun { towards: -unit(light.direction()), color: light.color() });
        Ok(Self { view, solids: solids.into(), branches, suns: suns.collect(), scale, center })
    }
}

impl Geometry {
    /// The box of all solids.
    pub(super) fn whole(&self) -> Solid {
        let (min, max) = match &self.branches {
            Some(branches) => branches.bounds(0),
            None => self.solids.iter().map(Solid::bounds).reduce(join).unwrap_or_default(),
        };
        Solid { shape: Shape::Cuboid { min, max }, order: 0 }
    }
}

impl Solid {
    /// Masks count the kinds one after another: spheres, boxes, triangles.
    pub(super) fn kind_rank(&self) -> u8 {
        match self.shape {
            Shape::Sphere { .. } => 0,
            Shape::Cuboid { .. } => 1,
            Shape::Triangle { .. } => 2,
        }
    }

    /// The least box around it.
    pub(super) fn bounds(&self) -> (DVec3, DVec3) {
        match self.shape {
            Shape::Sphere { center, radius, .. } => (center - radius, center + radius),
            Shape::Cuboid { min, max } => (min, max),
            Shape::Triangle { vertices: [a, b, c], .. } => (a.min(b).min(c), a.max(b).max(c)),
        }
    }

    /// The largest coordinate of its points, at least: what its rounding errors are relative to.
    pub(super) fn magnitude(&self) -> f64 {
        let (min, max) = self.bounds();
        min.abs().max(max.abs()).max_element()
    }

    /// How far the solid reaches along `direction`: the largest `direction · point`.
    pub(super) fn support(&self, direction: DVec3) -> f64 {
        match self.shape {
            Shape::Sphere { center, radius, .. } => direction.dot(center) + radius * direction.length(),
            Shape::Cuboid { min, max } => (direction * min).max(direction * max).element_sum(),
            Shape::Triangle { vertices, .. } => {
                vertices.iter().map(|v| direction.dot(*v)).fold(f64::NEG_INFINITY, f64::max)
            }
        }
    }
}

fn middle(screen: Screen) -> DVec3 {
    DVec3::new(f64::from(screen.width()), f64::from(screen.height()), 0.0) / 2.0
}

/// The largest distance along an axis from `center` to a point of the object.
fn reach(object: &Object, center: DVec3) -> f64 {
    let from = |point: DVec3| (point - center).abs().max_element();
    match object {
        Object::Sphere(sphere) => from(sphere.center()) + sphere.radius(),
        Object::Cuboid(cuboid) => from(cuboid.min()).max(from(cuboid.max())),
        Object::Triangle(triangle) => triangle.vertices().iter().map(|v| from(*v)).fold(0.0, f64::max),
    }
}

fn shape(object: &Object, place: impl Fn(DVec3) -> DVec3, eye: DVec3, scale: f64) -> Option<Shape> {
    Some(match object {
        Object::Sphere(sphere) => Shape::Sphere {
            center: place(sphere.center()),
            radius: sphere.radius() * scale,
            power: power(eye, sphere, scale),
        },
        Object::Cuboid(cuboid) => Shape::Cuboid { min: place(cuboid.min()), max: place(cuboid.max()) },
        Object::Triangle(triangle) => {
            let vertices = triangle.vertices().map(&place);
            // Its own size decides whether it has an area, wherever it lies.
            let (own, width) = normal_and_width(triangle.vertices());
            if own == DVec3::ZERO {
                return None;
            }
            // A needle turns when its corners are rounded; rays meet it as it is here.
            let here = if width < NEEDLE { triangle_normal(&vertices) } else { own };
            Shape::Triangle { vertices, normal: if here == DVec3::ZERO { own } else { here } }
        }
    })
}

/// The width of a triangle, for its length, below which its normal is worked out from where its corners are rounded to.
const NEEDLE: f64 = 0.1;

fn view(scene: &Scene, scale: f64) -> View {
    let axis = |from: f64, to: f64, samples: u32| {
        if samples == 1 { (0.5 * from + 0.5 * to, 0.0) } else { (from, (to - from) / f64::from(samples - 1)) }
    };
    match &scene.camera {
        Camera::Orthographic => View::Parallel { corner: -middle(scene.screen) * scale, pixel: scale },
        Camera::Pinhole(pinhole) => {
            let (right, up, back) = pinhole.basis();
            let from = pinhole.lower_left() / pinhole.distance();
            let to = pinhole.upper_right() / pinhole.distance();
            let x = axis(from.x, to.x, scene.screen.width());
            let y = axis(from.y, to.y, scene.screen.height());
            View::Pinhole { right, up, back, x, y }
        }
    }
}
