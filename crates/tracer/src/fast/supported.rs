//! What of the language the kernels draw; the rest is left to [`crate::reference`].

use rayfold_scene::{Light, Object, Scene};

use super::shapes::instance::turned_box;

/// Whether the kernels know all that the scene has.
pub(super) fn is_drawn_by_kernels(scene: &Scene) -> bool {
    let objects = || scene.objects.iter();
    objects().all(is_drawn)
        && objects().all(|object| object.material().finish().is_none())
        && scene.lights.iter().all(|light| matches!(light, Light::Directional(_)))
}

fn is_drawn(object: &Object) -> bool {
    match object {
        Object::Sphere(_) | Object::Triangle(_) | Object::Cuboid(_) => true,
        Object::Instance(instance) => turned_box(instance).is_none() && is_drawn(instance.object()),
        Object::Plane(_) | Object::Disc(_) | Object::Cylinder(_) | Object::Cone(_) | Object::Torus(_) => {
            false
        }
    }
}
