//! What of the language the kernels draw; the rest is left to [`crate::reference`].

use rayfold_scene::Scene;

/// Whether the kernels know all that the scene has.
pub(super) fn is_drawn_by_kernels(scene: &Scene) -> bool {
    scene.objects.iter().all(|object| object.material().finish().is_none_or(|finish| finish.glass.is_none()))
}
