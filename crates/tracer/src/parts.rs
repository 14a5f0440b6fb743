//! The parts of version 2 of the language that a build can leave out, in one table.
//!
//! A part that is left out is not compiled into the steps. Scenes that use it are rejected. `rayfold-bench needs` reads
//! the same table. The parts of version 1 are in `features`.

use rayfold_scene::model::Finish;
use rayfold_scene::{Light, Object, Scene, Tone};

use crate::RenderError;
use crate::reference::turns_axes_to_axes;

/// A part that a build can leave out.
#[derive(Clone, Copy)]
pub struct Part {
    /// The cargo feature of the part.
    pub feature: &'static str,
    /// Returns whether a scene uses the part.
    pub is_used: fn(&Scene) -> bool,
    is_built: bool,
}

/// Defines the table from its rows: a name, the cargo feature, and the scenes that use the part.
macro_rules! parts {
    ($($name:ident, $feature:tt, $is_used:expr;)*) => {
        /// Whether each part is compiled in.
        pub(crate) struct Built {
            $(pub(crate) $name: bool,)*
        }

        /// The parts of this build.
        pub(crate) const BUILT: Built = Built { $($name: cfg!(feature = $feature),)* };

        /// All parts of version 2.
        pub const PARTS: &[Part] =
            &[$(Part { feature: $feature, is_used: $is_used, is_built: BUILT.$name },)*];
    };
}

parts! {
    meshes, "meshes", |scene| has(scene, |o| matches!(o, Object::Mesh(_)));
    planes, "planes", |scene| has(scene, |o| matches!(o, Object::Plane(_)));
    discs, "discs", |scene| has(scene, |o| matches!(o, Object::Disc(_)));
    cones, "cones", |scene| has(scene, |o| matches!(o, Object::Cylinder(_) | Object::Cone(_)));
    tori, "tori", |scene| has(scene, |o| matches!(o, Object::Torus(_)));
    capsules, "capsules", |scene| has(scene, |o| matches!(o, Object::Capsule(_)));
    roundboxes, "roundboxes", |scene| has(scene, |o| matches!(o, Object::Roundbox(_)));
    // Boxes in groups that are rotated by other than right angles.
    turned_boxes, "turned-boxes", |scene| scene.objects.iter().any(is_turned_box);
    groups, "groups", |scene| scene.objects.iter().any(|o| matches!(o, Object::Instance(_)));
    highlights, "highlights", |scene| is_made(scene, |f| f.shine.is_some());
    patterns, "patterns", |scene| is_made(scene, |f| f.pattern.is_some());
    lamps, "lamps", |scene| scene.lights.iter().any(|light| matches!(light, Light::Lamp(_)));
    skies, "skies", |scene| scene.surroundings().color().is_none();
    // Pictures as the sky, on surfaces, and of models; and holes of models.
    pictures, "pictures", |scene| {
        scene.sky_picture().is_some() || is_made(scene, |f| f.image.is_some()) || scene.objects.iter().any(is_textured)
    };
    srgb, "srgb", |scene| scene.tone == Tone::Srgb;
    samples, "samples", is_sampled;
    lenses, "lenses", |scene| is_sampled(scene) && scene.lens.radius() > 0.0;
    shutters, "shutters", |scene| is_sampled(scene) && scene.shutter.open() > 0.0;
    // Lights that have an extent.
    extents, "extents", |scene| is_sampled(scene) && scene.lights.iter().any(|light| light.has_extent());
    glows, "glows", |scene| is_made(scene, |f| f.glow != glam::DVec3::ZERO);
    paths, "paths", Scene::goes_round;
    fogs, "fogs", |scene| scene.fog.get().is_some();
    covers, "covers", |scene| scene.background.is_none();
}

/// Rejects a scene that uses a part which this build lacks.
///
/// # Errors
/// If the build lacks a part that the scene uses.
pub(crate) fn check(scene: &Scene) -> Result<(), RenderError> {
    // A constant, so that a build with all parts compiles no check.
    if const { has_all() } {
        return Ok(());
    }
    let missing = PARTS.iter().find(|part| !part.is_built && (part.is_used)(scene));
    missing.map_or(Ok(()), |part| Err(RenderError::LeftOut { feature: part.feature }))
}

const fn has_all() -> bool {
    let mut i = 0;
    while i < PARTS.len() {
        if !PARTS[i].is_built {
            return false;
        }
        i += 1;
    }
    true
}

fn has(scene: &Scene, is_it: fn(&Object) -> bool) -> bool {
    scene.objects.iter().any(|object| match object {
        Object::Instance(instance) => is_it(instance.object()),
        object => is_it(object),
    })
}

/// Returns whether an object shows pictures of its model, or has holes.
fn is_textured(object: &Object) -> bool {
    match object {
        Object::Instance(instance) => is_textured(instance.object()),
        Object::Mesh(mesh) => {
            let is_own = mesh.material().finish().is_some_and(|finish| finish.own);
            is_own && mesh.model().has_pictures() || mesh.model().has_holes()
        }
        _ => false,
    }
}

fn is_made(scene: &Scene, has_it: fn(&Finish) -> bool) -> bool {
    scene.objects.iter().any(|object| object.material().finish().is_some_and(has_it))
}

/// Returns whether an object is a box in a group that is rotated by other than right angles.
pub fn is_turned_box(object: &Object) -> bool {
    let Object::Instance(instance) = object else { return false };
    matches!(instance.object(), Object::Cuboid(_)) && !turns_axes_to_axes(instance.placement())
}

/// Returns whether a pixel of a scene has several rays.
pub fn is_sampled(scene: &Scene) -> bool {
    scene.samples.most() > 1
}
