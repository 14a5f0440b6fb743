//! Scenes that need what a build is without are refused.
//!
//! That is looked at in builds that lack something alone, so that it costs nothing in the others.

use rayfold_scene::{Light, Material, Object, Scene, Tone};

use super::parts::BUILT;
use super::shapes::instance::turned_box;
use crate::{Exposure, RenderError};

/// Whether it is built, its cargo feature, and whether it is needed.
type Part = (bool, &'static str, fn(&Exposure) -> bool);

const PARTS: [Part; 15] = [
    (BUILT.planes, "planes", |shot| has(shot, |o| matches!(o, Object::Plane(_)))),
    (BUILT.discs, "discs", |shot| has(shot, |o| matches!(o, Object::Disc(_)))),
    (BUILT.cones, "cones", |shot| has(shot, |o| matches!(o, Object::Cylinder(_) | Object::Cone(_)))),
    (BUILT.tori, "tori", |shot| has(shot, |o| matches!(o, Object::Torus(_)))),
    (BUILT.turned_boxes, "turned-boxes", |shot| shot.scene().objects.iter().any(is_turned_box)),
    (BUILT.groups, "groups", |shot| shot.scene().objects.iter().any(|o| matches!(o, Object::Instance(_)))),
    (BUILT.highlights, "highlights", |shot| is_made(shot, |m| m.finish().is_some_and(|f| f.shine.is_some()))),
    (BUILT.patterns, "patterns", |shot| is_made(shot, |m| m.finish().is_some_and(|f| f.pattern.is_some()))),
    (BUILT.lamps, "lamps", |shot| shot.scene().lights.iter().any(|light| matches!(light, Light::Lamp(_)))),
    (BUILT.skies, "skies", |shot| shot.scene().background.color().is_none()),
    (BUILT.srgb, "srgb", |shot| shot.scene().tone == Tone::Srgb),
    (BUILT.samples, "samples", |shot| is_sampled(shot.scene())),
    (BUILT.lenses, "lenses", |shot| is_sampled(shot.scene()) && shot.scene().lens.radius() > 0.0),
    (BUILT.shutters, "shutters", |shot| shot.is_moving()),
    (BUILT.extents, "extents", |shot| is_sampled(shot.scene()) && shot.scene().lights.iter().any(has_extent)),
];

/// # Errors
/// When the build lacks what a scene has.
pub(super) fn check(shot: &Exposure) -> Result<(), RenderError> {
    // Known when it is compiled: nothing is left of this in a build that has all.
    if PARTS.iter().all(|(is_built, ..)| *is_built) {
        return Ok(());
    }
    let missing = PARTS.iter().find(|(is_built, _, is_needed)| !is_built && is_needed(shot));
    missing.map_or(Ok(()), |&(_, feature, _)| Err(RenderError::LeftOut { feature }))
}

fn has(shot: &Exposure, is_it: fn(&Object) -> bool) -> bool {
    let is_in = |object: &Object| match object {
        Object::Instance(instance) => is_it(instance.object()),
        object => is_it(object),
    };
    shot.scene().objects.iter().any(is_in)
}

fn is_made(shot: &Exposure, is_it: fn(&Material) -> bool) -> bool {
    shot.scene().objects.iter().any(|object| is_it(object.material()))
}

fn is_turned_box(object: &Object) -> bool {
    match object {
        Object::Instance(instance) => turned_box(instance).is_some(),
        Object::Sphere(_)
        | Object::Triangle(_)
        | Object::Cuboid(_)
        | Object::Plane(_)
        | Object::Disc(_)
        | Object::Cylinder(_)
        | Object::Cone(_)
        | Object::Torus(_) => false,
    }
}

fn is_sampled(scene: &Scene) -> bool {
    scene.samples.most() > 1
}

fn has_extent(light: &Light) -> bool {
    match light {
        Light::Directional(sun) => sun.angle() > 0.0,
        Light::Lamp(lamp) => lamp.radius() > 0.0,
    }
}
