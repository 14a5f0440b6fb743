//! A scene in the coordinates that the kernels work in.
//!
//! The origin is brought to the eye, so that numbers are as small as what is seen is near, and lengths are scaled by a
//! power of two, so that everything lies in -1..=1: no product overflows, and a scene scaled by a power of two is the
//! same scene bit for bit. All of it is `f64`; nothing here knows how precise the kernels are.

use std::sync::Arc;

use glam::DVec3;
use rayfold_scene::model::unit;
use rayfold_scene::{Camera, Lamp, Light, Object, Scene};

use super::bodies;
use super::bounds::{Bounds, join};
use super::lens::Lens;
use super::lights::lamp::Place;
use super::lights::sun::Direction;
use super::placed::{Placed, nearest_within};
use super::planes;
use super::shapes::{Shape, Solid, reach};
use super::shared::SharedSurfaces;
use super::tree::{Branches, Copies, Part, group};
use super::view::{View, middle, view};
use crate::RenderError;
use crate::parallel::map;
use crate::sampling::places::spread;
use crate::scale::below_inverse;

/// A scene, recentred and scaled.
#[derive(Clone, Debug)]
pub(super) struct Geometry {
    pub(super) view: View,
    /// In the order of the script, or in that of `branches`.
    pub(super) solids: Arc<Vec<Solid>>,
    /// How a tree groups the solids, if they are to be found down a tree.
    pub(super) branches: Option<Branches>,
    /// What has axes of its own, in the order of the script.
    pub(super) bodies: Vec<bodies::Solid>,
    pub(super) suns: Vec<Direction>,
    pub(super) lamps: Vec<Place>,
    /// Where rays start, if not at the eye alone: in pictures of several samples a pixel.
    pub(super) lens: Option<Lens>,
    /// Whether surfaces have more than coefficients.
    pub(super) is_finished: bool,
    /// The objects that share surfaces, once they are [looked for](Self::with_shared_surfaces).
    pub(super) shared: Option<SharedSurfaces>,
    /// A length of the scene times this is a length in here.
    pub(super) scale: f64,
    /// Where the origin of these coordinates is in the scene: `(point - center) * scale` is a point in here.
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
            Camera::Look(look) => look.eye(),
            Camera::Orthographic => middle(scene.screen),
        };
        let reaches = map(&scene.objects, |object| reach(object, center));
        let reach = reaches.into_iter().fold(0.0, f64::max);
        let has_bodies = scene.objects.iter().any(is_body);
        let of_bodies =
            scene.objects.iter().filter(|_| has_bodies).map(|object| bodies::reach(object, center));
        let of_lamps =
            lamps(scene).map(|lamp| (lamp.position() - center).abs().max_element() + lamp.radius());
        let lens = Lens::of(scene);
        let of_lens = lens.map(|lens| lens.radius);
        let reach = of_bodies.chain(of_lamps).chain(of_lens).fold(reach, f64::max);
        let reach = match scene.camera {
            Camera::Pinhole(_) | Camera::Look(_) => reach,
            Camera::Orthographic => reach.max(center.max_element()),
        };
        if !reach.is_finite() {
            return Err(RenderError::TooVast);
        }
        let scale = below_inverse(reach);
        let view = view(scene, scale);
        let shapes = map(&scene.objects, |object| Shape::new(object, center, scale));
        let solids = shapes.into_iter().enumerate();
        let solids = solids.filter_map(|(order, shape)| Some(Solid { shape: shape?, order: order as u32 }));
        let mut solids: Vec<Solid> = solids.collect();
        let is_finished = scene.objects.iter().any(|object| object.material().finish().is_some());
        // Of those at one distance what is not of glass is seen.
        let copies = if is_finished { Copies::Kept } else { Copies::Dropped };
        let branches = group(&mut solids, tree, copies);
        let orders = scene.objects.iter().filter(|_| has_bodies).zip(0..);
        let bodies =
            orders.filter_map(|(object, order)| bodies::body(object, order, center, scale)).collect();
        let lamps = lamps(scene).map(|lamp| Place::new(lamp, center, scale)).collect();
        let suns = scene.lights.iter().filter_map(|light| match light {
            Light::Directional(light) => Some(Direction {
                towards: -unit(light.direction()),
                color: light.color(),
                spread: spread(light.angle()),
            }),
            Light::Lamp(_) => None,
        });
        Ok(Self {
            view,
            solids: solids.into(),
            branches,
            bodies,
            suns: suns.collect(),
            lamps,
            lens: lens.map(|lens| lens.scaled(scale)),
            is_finished,
            shared: None,
            scale,
            center,
        })
    }
}

impl Geometry {
    /// With the same numbers for all triangles in one plane, where it matters which of them is seen.
    pub(super) fn with_shared_planes(mut self, scene: &Scene) -> Self {
        let first = scene.objects.first().map(Object::material);
        if scene.objects.iter().any(|object| Some(object.material()) != first) {
            let solids: &mut Vec<Solid> = Arc::make_mut(&mut self.solids);
            planes::share(solids);
        }
        self
    }

    /// How near to the origin a solid's surface comes, at least.
    pub(super) fn nearest(&self) -> f64 {
        let of = |solids: &[Solid]| solids.iter().map(|s| s.shape.nearest()).fold(f64::INFINITY, f64::min);
        let Some(branches) = &self.branches else { return of(&self.solids) };
        let (mut nearest, mut pending) = (f64::INFINITY, vec![0]);
        while let Some(at) = pending.pop() {
            if nearest_within(branches.bounds(at)) < nearest {
                match branches.part(at) {
                    Part::Solids(range) => nearest = nearest.min(of(&self.solids[range])),
                    Part::Children(first, second) => pending.extend([first, second]),
                }
            }
        }
        nearest
    }

    /// The box of all solids.
    pub(super) fn whole(&self) -> Bounds {
        match &self.branches {
            Some(branches) => branches.bounds(0),
            None => self.solids.iter().map(|solid| solid.shape.bounds()).reduce(join).unwrap_or_default(),
        }
    }
}

/// Whether an object may be a body.
fn is_body(object: &Object) -> bool {
    match object {
        Object::Sphere(_) | Object::Triangle(_) | Object::Cuboid(_) => false,
        Object::Plane(_)
        | Object::Disc(_)
        | Object::Cylinder(_)
        | Object::Cone(_)
        | Object::Torus(_)
        | Object::Instance(_) => true,
    }
}

fn lamps(scene: &Scene) -> impl Iterator<Item = &Lamp> {
    scene.lights.iter().filter_map(|light| match light {
        Light::Lamp(lamp) => Some(lamp),
        Light::Directional(_) => None,
    })
}
