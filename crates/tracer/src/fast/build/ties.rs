//! The winner among equal hits: hits without glass come before those with glass, and within each group the first in the
//! script wins.
//!
//! The kernels take the hit with the lowest order. So the objects are sorted by precedence before.

use std::borrow::Cow;
use std::sync::Arc;

use rayfold_scene::{Object, Scene};

use crate::meshes::{Expanded, Faces, Shared};
use crate::parts::BUILT;

/// A scene whose objects are in the order of precedence of equal hits.
#[derive(Debug)]
pub(crate) struct Ranked<'a> {
    pub(crate) scene: Cow<'a, Scene>,
    /// The faces that its triangles are.
    pub(crate) faces: Option<Arc<Faces>>,
    /// The positions in the script, if they differ from that order.
    places: Option<Vec<usize>>,
}

impl<'a> Ranked<'a> {
    pub(crate) fn new(scene: &'a Scene, shared: Shared) -> Self {
        if scene.objects.is_sorted_by_key(is_glass) {
            let Expanded { scene, faces } = expanded(Cow::Borrowed(scene), shared);
            return Self { scene, faces, places: None };
        }
        let mut places: Vec<usize> = (0..scene.objects.len()).collect();
        places.sort_by_key(|&place| is_glass(&scene.objects[place]));
        let objects = places.iter().map(|&place| scene.objects[place].clone()).collect();
        let scene = Cow::Owned(Scene { objects, ..scene.clone() });
        let Expanded { scene, faces } = expanded(scene, shared);
        Self { scene, faces, places: Some(places) }
    }

    /// Returns the position of an object in the script.
    pub(crate) fn in_script(&self, order: usize) -> usize {
        let order = self.faces.as_ref().map_or(order, |faces| faces.origin(order));
        self.places.as_ref().map_or(order, |places| places[order])
    }
}

/// Expands meshes, in builds that have them.
fn expanded(scene: Cow<'_, Scene>, shared: Shared) -> Expanded<'_> {
    if BUILT.meshes { Expanded::new(scene, shared) } else { Expanded { scene, faces: None } }
}

fn is_glass(object: &Object) -> bool {
    object.material().finish().is_some_and(|finish| finish.glass.is_some())
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use rayfold_scene::model::{Finish, Glass};
    use rayfold_scene::{Camera, Coefficients, Material, Screen, Sphere};

    use super::*;

    #[test]
    fn glass_counts_last() {
        let glass = Some(Glass::new(DVec3::ONE, 1.5).unwrap());
        let glass = Material::finished(Coefficients::default(), Finish { glass, ..Finish::default() });
        let ball = |radius: f64, material: &Material| {
            Object::from(Sphere::new(radius, DVec3::ZERO, material.clone()).unwrap())
        };
        let opaque = Material::default();
        let mut scene = Scene::new(Screen::new(1, 1).unwrap(), Camera::Orthographic);
        scene.objects = vec![ball(1.0, &opaque), ball(2.0, &glass)].into();
        assert!(matches!(Ranked::new(&scene, Shared::NONE).scene, Cow::Borrowed(_)));
        scene.objects =
            vec![ball(1.0, &glass), ball(2.0, &opaque), ball(3.0, &glass), ball(4.0, &opaque)].into();
        let ranked = Ranked::new(&scene, Shared::NONE);
        assert_eq!([0, 1, 2, 3].map(|order| ranked.in_script(order)), [1, 3, 0, 2]);
        assert_eq!(ranked.scene.objects[2], scene.objects[0]);
    }
}
