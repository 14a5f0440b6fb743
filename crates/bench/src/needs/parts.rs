//! The parts of the tracer that a build can be without, and which builds are made.
//!
//! Each part of version 1 has a build without it. Parts of version 2 are left out several at a time, because a build
//! for each would take too long for a check that every change must pass. Still, for each scene and each part that it
//! does not use, one of these builds lacks the part and draws the scene.

use glam::DVec3;
use rayfold_scene::{Light, Object, Scene};
use rayfold_tracer::parts::{PARTS, is_turned_box};

/// Returns whether a scene uses a part.
type IsUsed = fn(&Scene) -> bool;

/// The parts of version 1, and those that all shapes of version 2 share: their cargo features, and the scenes that use
/// them.
const OF_VERSION_1: [(&str, IsUsed); 7] = [
    ("boxes", |scene| has(scene, |o| matches!(o, Object::Cuboid(_)))),
    ("triangles", |scene| has(scene, |o| matches!(o, Object::Triangle(_) | Object::Mesh(_)))),
    ("mirrors", |scene| scene.objects.iter().any(is_mirror) || uses("glass", scene)),
    ("shadows", |scene| !scene.lights.is_empty() && !is_one_ball(scene)),
    ("tree", |scene| scene.objects.len() > 64),
    ("beyond", has_more_than_version_1),
    ("glass", |scene| {
        scene.objects.iter().any(|o| o.material().finish().is_some_and(|finish| finish.glass.is_some()))
    }),
];

/// Returns all parts that can be left out, each with the scenes that use it.
pub(crate) fn parts() -> impl Iterator<Item = (&'static str, IsUsed)> {
    OF_VERSION_1.into_iter().chain(PARTS.iter().map(|part| (part.feature, part.is_used)))
}

/// All parts of version 2.
pub(super) const VERSION_2: &[&str] = &[
    "beyond",
    "planes",
    "discs",
    "cones",
    "tori",
    "capsules",
    "roundboxes",
    "turned-boxes",
    "groups",
    "meshes",
    "highlights",
    "patterns",
    "glass",
    "lamps",
    "skies",
    "pictures",
    "srgb",
    "samples",
    "lenses",
    "shutters",
    "extents",
    "fogs",
    "covers",
    "glows",
    "paths",
];

/// Sets of parts of version 2, each with at most half of them. For any two parts, one of the sets has the first and not
/// the second. Six sets are enough for 20 parts, and five are not enough for 16 (Spencer, "Minimal completely
/// separating systems", 1970). Some of the six are split further: leaving out `planes` and `highlights` together would
/// cost discs 0.82 % and lamplight 0.57 %, where a part may cost 0.5 %.
const OF_VERSION_2: [&[&str]; 10] = [
    &["planes", "groups", "meshes", "pictures"],
    &["planes", "discs", "capsules", "lenses"],
    &["highlights"],
    &["tori", "capsules", "roundboxes", "turned-boxes", "groups", "meshes", "srgb", "glows", "paths"],
    &["highlights", "patterns", "fogs", "covers", "paths"],
    &["roundboxes", "glass", "skies", "pictures", "extents", "covers", "glows"],
    &[
        "capsules",
        "turned-boxes",
        "patterns",
        "pictures",
        "lamps",
        "samples",
        "lenses",
        "shutters",
        "extents",
        "fogs",
    ],
    &[
        "cones",
        "tori",
        "turned-boxes",
        "groups",
        "glass",
        "lamps",
        "skies",
        "srgb",
        "shutters",
        "fogs",
        "covers",
    ],
    &["discs", "cones", "tori", "roundboxes", "highlights", "patterns", "lamps", "skies", "extents"],
    &[
        "planes", "discs", "cones", "meshes", "glass", "srgb", "samples", "lenses", "shutters", "glows",
        "paths",
    ],
];

/// A build of the tracer.
pub(super) struct Build {
    /// The parts that it lacks, for people.
    pub(super) name: String,
    pub(super) without: Vec<&'static str>,
    /// Whether it is built for scenes of version 2, and not for those of version 1.
    pub(super) is_of_version_2: bool,
}

/// Returns all builds but the whole one.
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

/// Returns whether a scene uses the part of this name.
pub(super) fn uses(feature: &str, scene: &Scene) -> bool {
    parts().any(|(part, is_used)| part == feature && is_used(scene))
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

/// Returns whether a scene has skies, lamps, finishes, or shapes with axes of their own.
fn has_more_than_version_1(scene: &Scene) -> bool {
    let is_old = |object: &Object| match object {
        Object::Sphere(_) | Object::Cuboid(_) | Object::Triangle(_) => true,
        Object::Instance(instance) => {
            !is_turned_box(object)
                && matches!(instance.object(), Object::Sphere(_) | Object::Cuboid(_) | Object::Triangle(_))
        }
        _ => false,
    };
    scene.one_color().is_none()
        || scene.fog.get().is_some()
        || scene.lights.iter().any(|light| matches!(light, Light::Lamp(_)))
        || scene.objects.iter().any(|object| !is_old(object) || object.material().finish().is_some())
}

/// Returns whether a scene is a single ball, which has nothing in its light.
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
        for (feature, _) in parts() {
            assert!(
                builds.iter().any(|build| build.without.contains(&feature)),
                "no build is without {feature}"
            );
        }
        for subject in &subjects {
            let is_its = |build: &&Build| {
                build.is_of_version_2 == subject.is_of_version_2
                    && !build.without.iter().any(|part| uses(part, &subject.scene))
            };
            // No other part of version 2 is there without `beyond`: that is for scenes of version 1.
            let of_its_version = parts()
                .map(|(feature, _)| feature)
                .filter(|part| VERSION_2.contains(part) == subject.is_of_version_2 && *part != "beyond");
            for feature in of_its_version.filter(|feature| !uses(feature, &subject.scene)) {
                let has_one = builds.iter().filter(is_its).any(|build| build.without.contains(&feature));
                assert!(has_one, "{}: no build without {feature}", subject.name);
            }
        }
    }

    #[test]
    fn each_part_is_used_by_a_scene_and_not_by_another() {
        let subjects = subjects().unwrap();
        for (feature, is_used) in parts() {
            let count = subjects.iter().filter(|subject| is_used(&subject.scene)).count();
            assert!((1..subjects.len()).contains(&count), "{feature}: {count}");
        }
    }
}
