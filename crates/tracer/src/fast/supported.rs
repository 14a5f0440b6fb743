//! What of the language the kernels draw; the rest is left to [`crate::reference`].

use rayfold_scene::{Light, Object, Scene};

/// Whether the kernels know all that the scene has.
pub(super) fn is_drawn_by_kernels(scene: &Scene) -> bool {
    let objects = || scene.objects.iter();
    objects().all(|object| matches!(object, Object::Sphere(_) | Object::Triangle(_) | Object::Cuboid(_)))
        && objects().all(|object| object.material().finish().is_none())
        && scene.lights.iter().all(|light| matches!(light, Light::Directional(_)))
}
