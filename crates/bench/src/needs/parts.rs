//! The parts of the tracer that a build can be without, and which builds are made.
//!
//! A part of version 1 has a build of its own, without it. Those of version 2 are left out several at a time, in such a way that
//! for each scene and each part that it does not use there is a build without the part that draws the scene: a build for each
//! of so many parts would take too long for what every change must pass.

use glam::DVec3;
use rayfold_scene::{Light, Object, Scene, Tone};

/// A part: its cargo feature, and which scenes use it.
pub(super) struct Part {
    pub(super) feature: &'static str,
    pub(super) is_used: fn(&Scene) -> bool,
}

/// All parts that can be left out.
pub(super) const PARTS: [Part; 22] = [
    Part { feature: "boxes", is_used: |scene| has(scene, |o| matches!(o, Object::Cuboid(_))) },
    Part { feature: "triangles", is_used: |scene| has(scene, |o| matches!(o, Object::Triangle(_))) },
    Part { feature: "mirrors", is_used: |scene| scene.objects.iter().any(is_mirror) || uses("glass", scene) },
    Part { feature: "shadows", is_used: |scene| !scene.lights.is_empty() && !is_one_ball(scene) },
    Part { feature: "tree", is_used: |scene| scene.objects.len() > 64 },
    Part { feature: "beyond", is_used: has_more_than_version_1 },
    Part { feature: "planes", is_used: |scene| has(scene, |o| matches!(o, Object::Plane(_))) },
    Part { feature: "discs", is_used: |scene| has(scene, |o| matches!(o, Object::Disc(_))) },
    Part {
        feature: "cones",
        is_used: |scene| has(scene, |o| matches!(o, Object::Cylinder(_) | Object::Cone(_))),
    },
    Part { feature: "tori", is_used: |scene| has(scene, |o| matches!(o, Object::Torus(_))) },
    Part { feature: "turned-boxes", is_used: |scene| scene.objects.iter().any(is_turned_box) },
    Part {
        feature: "groups",
        is_used: |scene| scene.objects.iter().any(|o| matches!(o, Object::Instance(_))),
    },
    Part { feature: "highlights", is_used: |scene| is_made(scene, |f| f.shine.is_some()) },
    Part { feature: "patterns", is_used: |scene| is_made(scene, |f| f.pattern.is_some()) },
    Part { feature: "glass", is_used: |scene| is_made(scene, |f| f.glass.is_some()) },
    Part { feature: "lamps", is_used: |scene| scene.lights.iter().any(|l| matches!(l, Light::Lamp(_))) },
    Part { feature: "skies", is_used: |scene| scene.background.color().is_none() },
    Part { feature: "srgb", is_used: |scene| scene.tone == Tone::Srgb },
    Part { feature: "samples", is_used: is_sampled },
    Part { feature: "lenses", is_used: |scene| is_sampled(scene) && scene.lens.radius() > 0.0 },
    Part { feature: "shutters", is_used: |scene| is_sampled(scene) && scene.shutter.open() > 0.0 },
    Part { feature: "extents", is_used: |scene| is_sampled(scene) && scene.lights.iter().any(has_extent) },
];

/// All of version 2.
pub(super) const VERSION_2: &[&str] = &[
    "beyond",
    "planes",
    "discs",
    "cones",
    "tori",
    "turned-boxes",
    "groups",
    "highlights",
    "patterns",
    "glass",
    "lamps",
    "skies",
    "srgb",
    "samples",
    "lenses",
    "shutters",
    "extents",
];

/// Halves of version 2, or less: whichever two of its parts are taken, there is one that has the first and not the second.
/// Six are enough for 16 parts, and fewer are not (Spencer, "Minimal completely separating systems", 1970). One of the six is
/// here in two, since its nine parts together cost a cylinder more than one part may (0.59 %), and neither half does.
const OF_VERSION_2: [&[&str]; 7] = [
    &["planes", "groups", "highlights", "glass", "skies", "extents"],
    &["planes", "discs", "highlights", "patterns", "lenses"],
    &["tori", "turned-boxes", "groups", "srgb"],
    &["turned-boxes", "patterns", "lamps", "samples", "lenses", "shutters", "extents"],
    &["cones", "tori", "turned-boxes", "groups", "glass", "lamps", "skies", "srgb", "shutters"],
    &["discs", "cones", "tori", "highlights", "patterns", "lamps", "skies", "extents"],
    &["planes", "discs", "cones", "glass", "srgb", "samples", "lenses", "shutters"],
];

/// A build of the tracer.
pub(super) struct Build {
    /// What it is without, for people.
    pub(super) name: String,
    pub(super) without: Vec<&'static str>,
    /// Whether it is there for scenes of version 2, and not for those of version 1.
    pub(super) is_of_version_2: bool,
}

/// All builds but the whole one.
pub(super) fn builds() -> Vec<Build> {
    // They are compiled in half the time without version 2, which the scenes that they draw do not use either.
    let of_version_1 = ["boxes", "triangles", "mirrors", "shadows", "tree"].map(|part| Build {
        name: part.to_owned(),
        without: [&[part], VERSION_2].concat(),
        is_of_version_2: false,
    });
    let all = Build { name: "version 2".to_owned(), without: VERSION_2.to_vec(), is_of_version_2: false };
    let of_version_2 = OF_VERSION_2.iter().map(|without| Build {
        name: without.join(", "),
        without: without.to_vec(),
        is_of_version_2: true,
    });
    of_version_1.into_iter().chain([all]).chain(of_version_2).collect()
}

/// Whether a scene uses the part of this name.
pub(super) fn uses(feature: &str, scene: &Scene) -> bool {
    PARTS.iter().any(|part| part.feature == feature && (part.is_used)(scene))
}

fn has(scene: &Scene, is_it: fn(&Object) -> bool) -> bool {
    scene.objects.iter().any(|object| match object {
        // A box that is turned is another shape.
        Object::Instance(instance) => !is_turned_box(object) && is_it(instance.object()),
        object => is_it(object),
    })
}

pub(super) fn is_mirror(object: &Object) -> bool {
    let pattern = object.material().finish().and_then(|finish| finish.pattern);
    object.material().mirror() != DVec3::ZERO || pattern.is_some_and(|p| p.other.mirror() != DVec3::ZERO)
}

fn is_turned_box(object: &Object) -> bool {
    let Object::Instance(instance) = object else { return false };
    let is_along_axes = |x: &f64| *x == 0.0 || x.abs() == 1.0;
    matches!(instance.object(), Object::Cuboid(_))
        && !instance.placement().rotation().to_cols_array().iter().all(is_along_axes)
}

fn is_made(scene: &Scene, is_it: fn(&rayfold_scene::model::Finish) -> bool) -> bool {
    scene.objects.iter().any(|object| object.material().finish().is_some_and(is_it))
}

/// Skies, lamps, finishes, and shapes with axes of their own.
fn has_more_than_version_1(scene: &Scene) -> bool {
    let is_old = |object: &Object| match object {
        Object::Sphere(_) | Object::Cuboid(_) | Object::Triangle(_) => true,
        Object::Instance(instance) => {
            !is_turned_box(object)
                && matches!(instance.object(), Object::Sphere(_) | Object::Cuboid(_) | Object::Triangle(_))
        }
        Object::Plane(_) | Object::Disc(_) | Object::Cylinder(_) | Object::Cone(_) | Object::Torus(_) => {
            false
        }
    };
    scene.background.color().is_none()
        || scene.lights.iter().any(|light| matches!(light, Light::Lamp(_)))
        || scene.objects.iter().any(|object| !is_old(object) || object.material().finish().is_some())
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

/// Nothing is in the light of a ball alone.
fn is_one_ball(scene: &Scene) -> bool {
    matches!(scene.objects[..], [Object::Sphere(_)])
}

#[cfg(test)]
mod tests {
    use super::super::subjects::subjects;
    use super::*;

    #[test]
    fn for_each_scene_there_is_a_build_without_each_part_that_it_does_not_use() {
        let (subjects, builds) = (subjects().unwrap(), builds());
        for Part { feature, .. } in &PARTS {
            assert!(
                builds.iter().any(|build| build.without.contains(feature)),
                "no build is without {feature}"
            );
        }
        for subject in &subjects {
            let is_its = |build: &&Build| {
                build.is_of_version_2 == subject.is_of_version_2
                    && !build.without.iter().any(|part| uses(part, &subject.scene))
            };
            // No other part of version 2 is there without `beyond`: that is for scenes of version 1.
            let parts = PARTS.iter().map(|part| part.feature);
            let of_its_version =
                parts.filter(|part| VERSION_2.contains(part) == subject.is_of_version_2 && *part != "beyond");
            for feature in of_its_version.filter(|feature| !uses(feature, &subject.scene)) {
                let has_one = builds.iter().filter(is_its).any(|build| build.without.contains(&feature));
                assert!(has_one, "{}: no build without {feature}", subject.name);
            }
        }
    }

    #[test]
    fn each_part_is_used_by_a_scene_and_not_by_another() {
        let subjects = subjects().unwrap();
        for Part { feature, is_used } in &PARTS {
            let count = subjects.iter().filter(|subject| is_used(&subject.scene)).count();
            assert!((1..subjects.len()).contains(&count), "{feature}: {count}");
        }
    }
}
