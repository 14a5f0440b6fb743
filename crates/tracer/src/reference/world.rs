//! A scene for the reference tracer: with the eye at the origin, and groups expanded where that is exact.

use std::borrow::Cow;

use glam::DVec3;
use rayfold_scene::{Camera, Glass, Light, Object, Scene};

use super::Hit;
use super::shapes::{self, Surface};
use crate::camera::{Ray, Rays, Single};
use crate::meshes::{Expanded, FaceHit, Faces, Shading};
use crate::parallel::map;
use crate::pictures::Panorama;
use crate::sampling::lights;

/// The world that rays are traced through.
pub(super) struct World<'a> {
    /// The scene of the script.
    pub(super) scene: &'a Scene,
    pub(super) rays: Rays,
    /// The objects in the order of the script, in coordinates whose origin is `center`.
    pub(super) objects: Cow<'a, [Object]>,
    /// The lights in the order of the script, in the same coordinates.
    pub(super) lights: Cow<'a, [Light]>,
    /// The origin of these coordinates in those of the script.
    center: DVec3,
    pub(super) has_glass: bool,
    /// The picture all around.
    panorama: Option<Panorama>,
    /// The faces that triangles are.
    faces: Option<&'a Faces>,
}

impl<'a> World<'a> {
    /// Returns a point in the coordinates of the scene.
    pub(super) fn in_scene(&self, point: DVec3) -> DVec3 {
        point + self.center
    }

    /// Makes the world with the eye at the origin, so that coordinates are small for objects that are near. Keeps the
    /// coordinates of the script if the scene cannot be moved, or if rounding would move the eye through a surface.
    pub(super) fn of(expanded: &'a Expanded) -> Self {
        Self { faces: expanded.faces.as_deref(), ..Self::new(&expanded.scene) }
    }

    /// Makes the world of a scene without meshes, as [`Self::of`] does.
    pub(super) fn new(scene: &'a Scene) -> Self {
        let rays = Rays::new(&scene.camera, scene.screen, Single::of(scene));
        let has_groups = scene.objects.iter().any(|object| matches!(object, Object::Instance(_)));
        let objects: Cow<[Object]> = if has_groups {
            scene.objects.iter().map(|object| shapes::in_world(object).into_owned()).collect()
        } else {
            Cow::Borrowed(&scene.objects)
        };
        let world = Self {
            scene,
            rays,
            objects,
            lights: Cow::Borrowed(&scene.lights),
            center: DVec3::ZERO,
            has_glass: scene.objects.iter().any(|object| glass(object).is_some()),
            panorama: Panorama::of(scene),
            faces: None,
        };
        world.seen_from_eye().unwrap_or(world)
    }

    fn seen_from_eye(&self) -> Option<Self> {
        let eye = match &self.scene.camera {
            Camera::Orthographic => return None,
            Camera::Pinhole(pinhole) => pinhole.eye(),
            Camera::Look(look) => look.eye(),
        };
        let objects = map(&self.objects, |object| shapes::seen_from(object, eye));
        let lights = self.lights.iter().map(|light| lights::shape(light).seen_from(eye));
        Some(Self {
            objects: objects.into_iter().collect::<Option<Vec<_>>>()?.into(),
            lights: lights.collect::<Option<Vec<_>>>()?.into(),
            rays: self.rays.with_eye_at_origin(),
            center: eye,
            panorama: self.panorama.clone(),
            ..*self
        })
    }

    /// Returns the centre of each light.
    pub(super) fn middles(&self) -> Vec<DVec3> {
        self.lights.iter().map(|light| lights::shape(light).middle()).collect()
    }

    /// Returns the light of the surroundings in the direction of a ray that hits nothing.
    pub(super) fn around(&self, direction: DVec3) -> DVec3 {
        match &self.panorama {
            Some(panorama) => panorama.along(direction),
            None => self.scene.surroundings().along(direction),
        }
    }

    /// Returns the data that a face of a mesh adds to the surface of a hit.
    pub(super) fn shading(&self, hit: &Hit, direction: DVec3) -> Option<Shading> {
        let Surface { point, normal: face, .. } = hit.surface;
        let material = self.scene.objects[hit.object].material();
        let at = FaceHit { point, center: self.center, scale: 1.0, direction, face };
        self.faces?.shading(hit.object as f64, material, at)
    }

    /// Returns whether an object that is not an instance is a body that glass fills.
    pub(super) fn has_inside(&self, order: usize, object: &Object) -> bool {
        shapes::has_inside(object) || self.faces.is_some_and(|faces| faces.is_filled(order))
    }

    pub(super) fn nearest(&self, ray: Ray) -> Option<Hit> {
        nearest(&self.objects, ray, self.center, self.faces)
    }

    /// Returns the distance to the nearest hit of a ray with the object at `index`.
    pub(super) fn distance(&self, index: usize, ray: Ray) -> Option<f64> {
        distance(&self.objects[index], ray, (index, self.center, self.faces))
    }

    /// Returns the object, which is not an instance, and the hit point and its normal in the coordinates of the
    /// object's numbers.
    pub(super) fn in_script(&self, object: usize, surface: &Surface) -> (&Object, DVec3, DVec3) {
        let Object::Instance(of_group) = &self.scene.objects[object] else {
            return (&self.scene.objects[object], surface.point + self.center, surface.normal);
        };
        // An object that is drawn as an instance is transformed by the drawn instance, whose coordinates are nearer to
        // the eye.
        let placed = match &self.objects[object] {
            Object::Instance(drawn) => {
                let (drawn, own) = (drawn.placement(), of_group.placement());
                // Where the group's own numbers count from the eye.
                let eye = own.local_point(self.center) - drawn.local_point(DVec3::ZERO);
                drawn.local_point(surface.point) + eye
            }
            _ => of_group.placement().local_point(surface.point + self.center),
        };
        (of_group.object(), placed, of_group.placement().rotation().transpose() * surface.normal)
    }
}

/// The distance within which hits count as equal, in roundoffs of the distance and of numbers that were rounded before:
/// the offset of new rays from curved surfaces.
const EQUAL: f64 = 32.0 * f64::EPSILON;

/// The sine of the angle between two surfaces above which they cross and do not coincide.
const PARALLEL: f64 = 1.0 / (1u64 << 20) as f64;

/// The distance, relative to the numbers in the computation, above which hits are not compared further.
const APART: f64 = 1.0 / (1u64 << 30) as f64;

/// Returns the distance to the nearest hit of a ray with the object at position `index`. There is no hit in the hole of
/// a face.
fn distance(
    object: &Object,
    ray: Ray,
    (index, center, faces): (usize, DVec3, Option<&Faces>),
) -> Option<f64> {
    let distance = shapes::distance(object, ray)?;
    let is_hole = faces.filter(|faces| faces.can_have_holes(index)).is_some_and(|faces| {
        faces.is_hole(index, shapes::surface(object, ray, distance).point, (center, 1.0))
    });
    (!is_hole).then_some(distance)
}

/// Returns the nearest hit; see [`super::nearest`]. No object is an instance that could be expanded into the world. The
/// objects' own numbers were rounded when they were moved by `center`.
///
/// Hits are equal to the nearest if they are no farther from its surface than the offsets of new rays from both, and
/// the surfaces are parallel there. The start of a new ray is outside all of them.
pub(super) fn nearest(objects: &[Object], ray: Ray, center: DVec3, faces: Option<&Faces>) -> Option<Hit> {
    let rank = |index: usize| (glass(&objects[index]).is_some(), index);
    let mut best: Option<(usize, f64)> = None;
    let mut others: Vec<(usize, f64)> = vec![];
    for (index, object) in objects.iter().enumerate() {
        let Some(distance) = distance(object, ray, (index, center, faces)) else { continue };
        let is_before =
            |(other, least): (usize, f64)| distance < least || distance == least && rank(index) < rank(other);
        match best {
            Some(known) if !is_before(known) => others.push((index, distance)),
            known => {
                others.extend(known);
                best = Some((index, distance));
            }
        }
    }
    let (object, distance) = best?;
    let surface = shapes::surface(&objects[object], ray, distance);
    let mut hit = Hit { object, distance, surface };
    let climb = surface.normal.dot(ray.direction).abs();
    let rounded = DVec3::select(surface.normal.cmpeq(DVec3::ZERO), DVec3::ZERO, center.abs()).element_sum();
    let slack = EQUAL * (distance + rounded);
    let extent = shapes::extent(&objects[object], ray) + distance + rounded;
    for (index, far) in others {
        let apart = (far - distance) * climb;
        if apart > APART * (extent + shapes::extent(&objects[index], ray)) {
            continue;
        }
        let other = shapes::surface(&objects[index], ray, far);
        let bound = slack + surface.offset + other.offset;
        if apart > bound || other.normal.cross(surface.normal).length() > PARALLEL {
            continue;
        }
        let offset = hit.surface.offset.max(bound);
        if rank(index) < rank(hit.object) {
            hit = Hit { object: index, distance: far, surface: other };
        }
        hit.surface.offset = offset;
    }
    Some(hit)
}

/// Returns the glass of an object.
pub(super) fn glass(object: &Object) -> Option<Glass> {
    object.material().finish().and_then(|finish| finish.glass)
}
