//! A scene in the coordinates of the kernels.
//!
//! The origin is moved to the eye, so that numbers are small for objects that are near. Lengths are scaled by a power
//! of two, so that everything is in -1..=1: no product overflows, and a scene scaled by a power of two is the same
//! scene bit for bit. All of it is `f64` and independent of the precision of the kernels.

use std::sync::Arc;

use glam::DVec3;
use rayfold_scene::model::unit;
use rayfold_scene::{Camera, Lamp, Light, Object, Scene};

use crate::RenderError;
use crate::fast::acceleration::tree::{Branches, Copies, Part, group};
use crate::fast::bodies;
use crate::fast::lights::lamp::Place;
use crate::fast::lights::sun::Direction;
use crate::fast::placement::lens::Lens;
use crate::fast::placement::planes;
use crate::fast::rays::bounds::{Bounds, join};
use crate::fast::rays::placed::{RenderSpaceShape, nearest_within};
use crate::fast::rays::view::{View, middle, view};
use crate::fast::shapes::{Shape, Solid, reach};
use crate::fast::shared::SharedSurfaces;
use crate::meshes::Faces;
use crate::parallel::{map, map_numbered};
use crate::sampling::guide::Guide;
use crate::sampling::places::spread;
use crate::sampling::rough::Energies;
use crate::scale::below_inverse;

/// A scene, recentred and scaled.
#[derive(Clone, Debug)]
pub(crate) struct Geometry {
    pub(crate) view: View,
    /// The solids, in the order of the script or in that of `branches`.
    pub(crate) solids: Arc<Vec<Solid>>,
    /// The grouping of the solids by a tree, if one is used to find them.
    pub(crate) branches: Option<Branches>,
    /// The shapes that have their own axes, in the order of the script.
    pub(crate) bodies: Vec<bodies::Solid>,
    pub(crate) suns: Vec<Direction>,
    pub(crate) lamps: Vec<Place>,
    /// The lens, if rays do not all start at the eye: in pictures of several samples per pixel.
    pub(crate) lens: Option<Lens>,
    /// Whether any surface has a finish in addition to its coefficients.
    pub(crate) is_finished: bool,
    /// The microfacets of rough objects, where light goes round.
    pub(crate) energies: Energies,
    /// The guide of scattered rays to bright light.
    pub(crate) guide: Option<Guide>,
    /// Whether light goes round.
    pub(crate) goes_round: bool,
    /// Whether there is fog.
    pub(crate) is_foggy: bool,
    /// The objects that share surfaces, after [the search for them](Self::with_shared_surfaces).
    pub(crate) shared: Option<SharedSurfaces>,
    /// The positions of objects that have all materials and all kinds of shapes, in a scene of meshes. Their faces are many.
    examples: Option<Vec<u32>>,
    /// The faces of triangles that have data beyond their triangle.
    pub(crate) faces: Option<Arc<Faces>>,
    /// The holes of faces, if any face can have holes. Faces with holes are among the bodies.
    pub(crate) holes: Option<Arc<bodies::Holes>>,
    /// A length of the scene times this is a length in these coordinates.
    pub(crate) scale: f64,
    /// The origin of these coordinates in the scene: `(point - center) * scale` is a point in these coordinates.
    pub(crate) center: DVec3,
}

impl Geometry {
    /// Converts a scene whose triangles are no faces of meshes. `tree` sets whether objects are found by a tree, if it matters.
    ///
    /// # Errors
    /// Fails if the scene is so large that its size is not a finite number.
    pub(crate) fn new(scene: &Scene, tree: Option<bool>) -> Result<Self, RenderError> {
        Self::with_faces(scene, None, tree)
    }

    /// Converts a scene, of which some triangles may be faces of meshes.
    ///
    /// # Errors
    /// The errors of [`Self::new`].
    pub(crate) fn with_faces(
        scene: &Scene,
        faces: Option<&Arc<Faces>>,
        tree: Option<bool>,
    ) -> Result<Self, RenderError> {
        let center = match &scene.camera {
            Camera::Pinhole(pinhole) => pinhole.eye(),
            Camera::Look(look) => look.eye(),
            Camera::Orthographic => middle(scene.screen),
        };
        let examples = faces.map(|faces| faces.examples(scene.objects.len()));
        let examples_of = |scene| each_example(scene, examples.as_deref());
        let reaches = map(&scene.objects, |object| reach(object, center));
        let reach = reaches.into_iter().fold(0.0, f64::max);
        let has_bodies = examples_of(scene).any(is_body);
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
        let solid = |(order, object): (usize, &Object)| {
            Some(Solid { shape: Shape::new(object, center, scale)?, order: order as u32 })
        };
        let solids: Vec<Option<Solid>> = map_numbered(&scene.objects, solid);
        // In the same memory.
        let mut solids: Vec<Solid> = solids.into_iter().flatten().collect();
        let holes = faces.filter(|faces| faces.have_holes());
        let holes = holes.map(|faces| Arc::new(bodies::Holes { faces: faces.clone(), center, scale }));
        let cutouts = holes.iter().flat_map(|holes| take_cutouts(&mut solids, &holes.faces)).collect();
        let is_finished = examples_of(scene).any(|object| object.material().finish().is_some());
        // If objects are at the same distance, one that is not glass is visible.
        let copies = if is_finished { Copies::Kept } else { Copies::Dropped };
        let branches = group(&mut solids, tree, copies);
        let is_drawn = |order| !faces.is_some_and(|faces| faces.is_further_look(order));
        let orders = scene.objects.iter().filter(|_| has_bodies).zip(0..);
        let orders = orders.filter(|(_, order)| is_drawn(*order as usize));
        let bodies = orders.filter_map(|(object, order)| bodies::body(object, order, center, scale));
        let bodies = merged(bodies.collect(), cutouts);
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
            energies: Energies::default(),
            guide: None,
            goes_round: scene.goes_round(),
            is_foggy: scene.fog.get().is_some(),
            shared: None,
            examples,
            faces: faces.filter(|faces| faces.are_shaded()).cloned(),
            holes,
            scale,
            center,
        })
    }
}

impl Geometry {
    /// Adds the microfacets of rough objects, and the guide of scattered rays.
    pub(crate) fn with_paths(self, energies: &Energies, guide: Option<Guide>) -> Self {
        Self { energies: energies.clone(), guide, ..self }
    }

    /// Gives all triangles in one plane the same plane numbers, if it matters which of them is visible.
    pub(crate) fn with_shared_planes(mut self, scene: &Scene) -> Self {
        if self.are_distinct() || !self.have_one_material(scene) {
            let solids: &mut Vec<Solid> = Arc::make_mut(&mut self.solids);
            planes::share(solids);
        }
        self
    }

    /// Returns objects that have all materials and all kinds of shapes of the scene.
    pub(crate) fn examples<'a>(&'a self, scene: &'a Scene) -> impl Iterator<Item = &'a Object> {
        each_example(scene, self.examples.as_deref())
    }

    /// Returns whether all objects have the same material.
    pub(crate) fn have_one_material(&self, scene: &Scene) -> bool {
        let first = scene.objects.first().map(Object::material);
        self.examples(scene).all(|object| Some(object.material()) == first)
    }

    /// Returns whether surfaces of one material can have unlike colours.
    pub(crate) fn are_distinct(&self) -> bool {
        self.faces.as_ref().is_some_and(|faces| faces.have_colors())
    }

    /// Returns a lower bound of the distance between the origin and a solid's surface.
    pub(crate) fn nearest(&self) -> f64 {
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

    /// Returns the bounding box of all solids.
    pub(crate) fn whole(&self) -> Bounds {
        match &self.branches {
            Some(branches) => branches.bounds(0),
            None => self.solids.iter().map(|solid| solid.shape.bounds()).reduce(join).unwrap_or_default(),
        }
    }
}

/// Removes the triangles that can have holes from some solids, and returns them.
fn take_cutouts(solids: &mut Vec<Solid>, faces: &Faces) -> Vec<bodies::Solid> {
    let mut cutouts = Vec::new();
    solids.retain(|solid| match solid.shape {
        Shape::Triangle(triangle) if faces.can_have_holes(solid.order as usize) => {
            cutouts.push(bodies::cutout(triangle, solid.order));
            false
        }
        Shape::Triangle(_) | Shape::Sphere(_) | Shape::Cuboid(_) => true,
    });
    cutouts
}

/// Returns bodies of two kinds in the order of the script.
fn merged(mut bodies: Vec<bodies::Solid>, cutouts: Vec<bodies::Solid>) -> Vec<bodies::Solid> {
    if !cutouts.is_empty() {
        bodies.extend(cutouts);
        bodies.sort_by_key(bodies::Solid::order);
    }
    bodies
}

/// Returns the objects at the positions of `examples`, or all objects.
fn each_example<'a>(scene: &'a Scene, examples: Option<&'a [u32]>) -> impl Iterator<Item = &'a Object> {
    let some = examples.into_iter().flatten().map(|&at| &scene.objects[at as usize]);
    let all = examples.is_none().then_some(scene.objects.iter()).into_iter().flatten();
    some.chain(all)
}

/// Returns whether an object may be a body.
fn is_body(object: &Object) -> bool {
    !matches!(object, Object::Sphere(_) | Object::Triangle(_) | Object::Cuboid(_))
}

fn lamps(scene: &Scene) -> impl Iterator<Item = &Lamp> {
    scene.lights.iter().filter_map(|light| match light {
        Light::Lamp(lamp) => Some(lamp),
        Light::Directional(_) => None,
    })
}
