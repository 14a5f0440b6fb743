//! The packets draw the features of version 2 of the language like the plain tracer does, with any instruction set and
//! search structure.
//!
//! Scenes are random; a failure prints the seed. `RAYFOLD_SEED` sets another one.

use glam::DVec3;
use rayfold_scene::model::{Finish, Pattern, Shine, Weight};
use rayfold_scene::{
    Camera, Capsule, Cone, Cylinder, Disc, Fog, Lamp, Lens, Light, Material, Object, Plane, Roundbox,
    Samples, Scene, Torus,
};
use rayfold_tracer::{Precision, RenderOptions, reference};

use super::dice::Dice;
use super::hold::{check_powers_of_two, draw, hold, off, placed, scripted};

const SEED: u64 = 20_261_122;

/// Compares `count` scenes with the reference. The numbers of objects are those of `counts`, in turn.
fn hold_each(
    dice: &mut Dice,
    (counts, count): (&[usize], usize),
    mut scene: impl FnMut(&mut Dice, usize) -> Scene,
) {
    let scenes: Vec<Scene> = counts.iter().cycle().take(count).map(|&count| scene(dice, count)).collect();
    hold(&scenes);
}

#[test]
fn skies_tones_depths_and_mirrors_of_all_kinds_are_the_references() {
    hold_each(&mut Dice::new("sky", SEED), (&[0, 1, 6, 30, 90], 10), |dice, count| {
        let objects = (0..count).map(|_| dice.object()).collect();
        dice.scene(objects)
    });
}

#[test]
fn a_background_of_one_colour_has_its_tone() {
    hold_each(&mut Dice::new("background", SEED), (&[0, 1, 6, 90], 12), |dice, count| {
        let objects = (0..count).map(|_| dice.object()).collect();
        let mut scene = dice.scene(objects);
        scene.set_background(dice.color()).unwrap();
        scene
    });
}

#[test]
fn groups_are_the_references() {
    hold_each(&mut Dice::new("groups", SEED), (&[1, 6, 30, 90], 12), |dice, count| {
        let objects = (0..count)
            .map(|_| {
                let object = dice.object();
                placed(dice, object)
            })
            .collect();
        dice.scene(objects)
    });
}

impl Dice {
    /// Returns a plane, a disc, a cylinder, a cone, a torus, or an object of version 1, possibly rotated by a group.
    fn body(&mut self, kinds: u8) -> Object {
        let at = self.point(3.0);
        let material = self.material();
        // Also along the axes and about them.
        let about = match self.0.u8(0..4) {
            0 => DVec3::AXES[self.0.usize(0..3)],
            _ => self.point(1.0),
        };
        let length = self.within(0.2, 2.0) / about.length();
        let radius = self.within(0.1, 0.8);
        let body: Object = match self.0.u8(0..kinds) {
            0 => Disc::new(radius, at, about, material).unwrap().into(),
            1 => Cylinder::new(radius, [at, at + length * about], material).unwrap().into(),
            2 => {
                let other = if self.0.bool() { 0.0 } else { self.within(0.0, 1.0) };
                let radii = if self.0.bool() { [radius, other] } else { [other, radius] };
                Cone::new(radii, [at, at + length * about], material).unwrap().into()
            }
            3 => {
                let thickness = radius * self.within(0.05, 0.95);
                Torus::new(radius, thickness, at, about, material).unwrap().into()
            }
            4 => Plane::new(2.0 * at, about, material).unwrap().into(),
            _ => self.object(),
        };
        if self.0.u8(0..3) == 0 { placed(self, body) } else { body }
    }

    fn bodies(&mut self, count: usize, kinds: u8) -> Scene {
        let objects = (0..count).map(|_| self.body(kinds)).collect();
        self.scene(objects)
    }
}

#[test]
fn shapes_with_axes_of_their_own_are_the_references() {
    let mut dice = Dice::new("bodies", SEED);
    let mut scenes: Vec<Scene> = vec![];
    for (count, kinds) in [(1, 4), (1, 5), (3, 5), (8, 6), (20, 8), (40, 4), (100, 8)] {
        scenes.extend([(); 3].map(|()| dice.bodies(count, kinds)));
    }
    hold(&scenes);
}

/// Returns bodies that no ray hits. With them there are too many for the bits of a word.
fn specks() -> Vec<Object> {
    let material = Material::new(DVec3::ONE, DVec3::ONE, DVec3::ZERO).unwrap();
    let disc =
        |k: u32| Disc::new(1e-12, DVec3::splat(1.0 + 0.01 * f64::from(k)), DVec3::ONE, material.clone());
    (0..65).map(|k| disc(k).unwrap().into()).collect()
}

#[test]
fn few_bodies_are_drawn_as_they_are_among_many() {
    let mut dice = Dice::new("few bodies", SEED);
    for round in 0..48 {
        let count = dice.0.usize(1..30);
        let mut scene = dice.bodies(count, 6);
        if dice.0.bool() {
            dice.add_lamps(&mut scene);
        }
        if dice.0.bool() {
            scene.set_background(DVec3::splat(0.5)).unwrap();
        }
        if round % 2 == 1 {
            scene.samples = Samples::new(4, 0.0).unwrap();
            scene.lens = Lens::new(if dice.0.bool() { 0.3 } else { 0.0 }, None).unwrap();
            let lights = scene.lights.iter().map(|light| match light {
                Light::Directional(sun) => sun.spanning(20.0).unwrap().into(),
                Light::Lamp(lamp) => {
                    Lamp::new(lamp.color(), lamp.position(), 0.5, lamp.reach()).unwrap().into()
                }
            });
            scene.lights = lights.collect();
        }
        let mut among_many = scene.clone();
        among_many.objects = scene.objects.iter().cloned().chain(specks()).collect();
        let [few, many] = [&scene, &among_many].map(|scene| draw(scene, RenderOptions::default()));
        let most = few.iter().zip(many.iter()).map(|(a, b)| a.abs_diff(*b)).max();
        let differ = few.pixels().zip(many.pixels()).filter(|(a, b)| a != b).count();
        assert_eq!(differ, 0, "round {round}: {count} bodies, by {most:?}");
    }
}

#[test]
fn lamps_are_the_references() {
    let mut dice = Dice::new("lamps", SEED);
    let mut scenes: Vec<Scene> = vec![];
    for (count, kinds) in [(1, 6), (3, 6), (10, 8), (30, 8), (90, 9)] {
        scenes.extend([(); 2].map(|()| {
            let mut scene = dice.bodies(count, kinds);
            dice.add_lamps(&mut scene);
            scene
        }));
    }
    hold(&scenes);
}

impl Dice {
    /// Returns a material with highlights, a pattern, or both.
    fn finished(&mut self) -> Material {
        let own = self.material().coefficients();
        let shine = if self.0.bool() {
            Some(Shine::new(self.color(), self.within(1.0, 80.0)).unwrap())
        } else {
            None
        };
        let other = self.material().coefficients();
        let size = self.within(0.2, 1.0);
        let weight = match self.0.u8(0..6) {
            0 => Some(Weight::Checker(size)),
            1 => Some(Weight::Stripes(size)),
            2 => Some(Weight::Noise(size)),
            3 => Some(Weight::Gradient(-size, 2.0 * size)),
            _ => None,
        };
        let pattern = weight.map(|weight| Pattern { weight, other });
        // By dice of its own, so that the others stay as they are.
        let mut dice = Self(self.0.clone());
        let glow = if dice.0.bool() { dice.color() } else { DVec3::ZERO };
        Material::finished(
            own,
            Finish { shine, glass: None, pattern, image: None, own: false, glow, rough: None },
        )
    }
}

#[test]
fn highlights_and_patterns_are_the_references() {
    let mut dice = Dice::new("finishes", SEED);
    let mut scenes: Vec<Scene> = vec![];
    for count in [1, 3, 10, 30, 90] {
        scenes.extend([(); 2].map(|()| {
            let objects = (0..count)
                .map(|_| {
                    let material = dice.finished();
                    dice.any(material)
                })
                .collect();
            let mut scene = dice.scene(objects);
            dice.add_lamps(&mut scene);
            scene
        }));
    }
    hold(&scenes);
}

#[test]
fn capsules_are_the_references() {
    let mut dice = Dice::new("capsules", SEED);
    let mut scenes: Vec<Scene> = vec![];
    for count in [1, 3, 10, 30, 90] {
        scenes.extend([(); 3].map(|()| {
            let objects = (0..count)
                .map(|_| {
                    let (at, material) = (dice.point(3.0), dice.finished());
                    let way = match dice.0.u8(0..5) {
                        0 => DVec3::AXES[dice.0.usize(0..3)],
                        1 => DVec3::ZERO,
                        _ => dice.point(1.5),
                    };
                    let radius = dice.within(0.05, 0.7);
                    let capsule = Capsule::new(radius, [at, at + way], material).unwrap().into();
                    match dice.0.u8(0..4) {
                        0 => placed(&mut dice, capsule),
                        1 => dice.body(6),
                        _ => capsule,
                    }
                })
                .collect();
            let mut scene = dice.scene(objects);
            dice.add_lamps(&mut scene);
            scene
        }));
    }
    hold(&scenes);
}

#[test]
fn boxes_with_round_edges_are_the_references() {
    let mut dice = Dice::new("boxes with round edges", SEED);
    let mut scenes: Vec<Scene> = vec![];
    for count in [1, 3, 10, 30, 90] {
        scenes.extend([(); 3].map(|()| {
            let objects = (0..count)
                .map(|_| {
                    let (at, material) = (dice.point(3.0), dice.finished());
                    let half = DVec3::from([(); 3].map(|()| dice.within(0.05, 0.9)));
                    let half = if dice.0.u8(0..5) == 0 { DVec3::splat(half.x) } else { half };
                    let share = [1.0, 1e-9, 1e-3, dice.within(0.0, 1.0)][dice.0.usize(0..4)];
                    let radius = share * half.min_element();
                    let roundbox = Roundbox::new([at - half, at + half], radius, material).unwrap().into();
                    match dice.0.u8(0..4) {
                        0 => placed(&mut dice, roundbox),
                        1 => dice.body(6),
                        _ => roundbox,
                    }
                })
                .collect();
            let mut scene = dice.scene(objects);
            dice.add_lamps(&mut scene);
            scene
        }));
    }
    hold(&scenes);
}

#[test]
fn bodies_around_one_another_are_the_references() {
    let mut dice = Dice::new("bodies around one another", SEED);
    let mut scenes: Vec<Scene> = vec![];
    for kinds in [0..1, 1..2, 2..3, 3..4, 4..5, 5..6, 0..6] {
        scenes.extend([(); 3].map(|()| {
            let objects = (0..90)
                .map(|_| {
                    let (at, about, material) = (dice.point(0.2), dice.point(1.0), dice.finished());
                    let radius = dice.within(1.0, 6.0);
                    let ends = [-1.0, 1.0].map(|side| at + side * radius * about.normalize());
                    let body: Object = match dice.0.u8(kinds.clone()) {
                        0 => Torus::new(radius, 0.1 * radius, at, about, material).unwrap().into(),
                        1 => Cylinder::new(radius, ends, material).unwrap().into(),
                        2 => Cone::new([radius, 0.3 * radius], ends, material).unwrap().into(),
                        3 => Capsule::new(radius, ends, material).unwrap().into(),
                        4 => {
                            let corners = [at - radius, at + radius];
                            Roundbox::new(corners, 0.2 * radius, material).unwrap().into()
                        }
                        _ => Disc::new(radius, ends[0], about, material).unwrap().into(),
                    };
                    if dice.0.u8(0..3) == 0 { placed(&mut dice, body) } else { body }
                })
                .collect();
            let mut scene = dice.scene(objects);
            dice.add_lamps(&mut scene);
            scene
        }));
    }
    hold(&scenes);
}

#[test]
fn fog_is_the_references() {
    let mut dice = Dice::new("fog", SEED);
    let mut scenes: Vec<Scene> = vec![];
    for count in [0, 1, 6, 30, 90] {
        scenes.extend([(); 3].map(|()| {
            let objects = (0..count)
                .map(|_| match dice.0.u8(0..3) {
                    0 => dice.object(),
                    1 => dice.body(6),
                    _ => {
                        let material = dice.finished();
                        dice.any(material)
                    }
                })
                .collect();
            let mut scene = dice.scene(objects);
            if dice.0.bool() {
                dice.add_lamps(&mut scene);
            }
            let unit = if scene.camera == Camera::Orthographic { 12.0 } else { 1.0 };
            scene.fog = Fog::new(1.5 * dice.color() - 0.2, unit * dice.within(0.5, 20.0)).unwrap();
            scene
        }));
    }
    hold(&scenes);
}

#[test]
fn fog_mixes_in_by_the_length_of_each_ray() {
    let view = "Screen 1 1\nDepth 2\nLook 0 0 4  0 0 0  10";
    let color = |objects: &str| {
        let scene = scripted(view, objects);
        let drawn = draw(&scene, RenderOptions::default());
        assert_eq!(drawn, reference::render(&scene, &RenderOptions::default()).unwrap(), "{objects}");
        (reference::color(&scene, 0, 0), drawn.get_pixel(0, 0).0)
    };
    let near = |found: (DVec3, [u8; 3]), expected: f64| {
        assert!((found.0.x - expected).abs() < 1e-12, "{found:?} {expected}");
        assert_eq!(found.1[0], (255.0 * expected.clamp(0.0, 1.0)).round() as u8);
    };
    let disc = "Disc 1  0 0 0  0 0 1  .2 .2 .2  0 0 0";
    let clear = (-4f64 / 8.0).exp();
    near(color(&format!("Fog 1 1 1 8\n{disc}")), clear * 0.2 + 1.0 - clear);
    // What hits nothing is all fog, which hides the background.
    near(color("Fog .6 .6 .6 8\nBackground 0 1 0  1 0 0"), 0.6);
    near(color("Background .3 0 0\nFog .6 .6 .6 8\nFog none"), 0.3);
    // A mirror: fog on the way to it, and on the way from it to what is 6 away.
    let mirror = "Disc 1  0 0 0  0 0 1  0 0 0  0 0 0  .5 .5 .5\nDisc 9  0 0 6  0 0 1  .8 .8 .8  0 0 0";
    let beyond = (-6f64 / 8.0).exp();
    near(color(&format!("Fog 1 1 1 8\n{mirror}")), clear * 0.5 * (beyond * 0.8 + 1.0 - beyond) + 1.0 - clear);
    // Beyond the depth all is black, fog too.
    near(color(&format!("Depth 0\nFog 1 1 1 8\n{mirror}")), 1.0 - clear);
    // Glass: in front of it, within it and behind it.
    let glass =
        "Material pane  glass .5 .5 .5 1\nBox -1 -1 -2  1 1 0  pane\nDisc 9  0 0 -5  0 0 1  .8 .8 .8  0 0 0";
    let (within, behind) = ((-2f64 / 8.0).exp(), (-3f64 / 8.0).exp());
    let last = behind * 0.8 + 1.0 - behind;
    near(
        color(&format!("Fog 1 1 1 8\n{glass}")),
        clear * 0.5 * (within * 0.5 * last + 1.0 - within) + 1.0 - clear,
    );
    // Light comes through fog undimmed, also from a lamp.
    let lit = "Plight 1 1 1  0 0 3.9\nDisc 1  0 0 0  0 0 1  0 0 0  .5 .5 .5";
    near(color(&format!("Fog 0 0 0 8\n{lit}")), clear * 0.5);
}

const FROM_THE_FRONT: &str = "Screen 41 41\nLook 0 0 9  0 0 0  50\nBackground 0.1 0.2 0.3  0.5 0.7 0.9\n\
                              Ilight 0.6 0.6 0.6  -1 -2 -3";
const PARALLEL: &str =
    "Screen 41 41\nOrthocamera\nIlight 0.6 0.6 0.6  -1 -2 -3\nPlight 0.3 0.2 0.1  20 30 -10";

/// Cases in which an almost correct formula fails.
const EDGES: [(&str, &str, &str); 24] = [
    (
        "eye in a cylinder",
        FROM_THE_FRONT,
        "Cylinder 3  0 -2 8.5  0 2 8.5  0.2 0.1 0.1  0.5 0.5 0.5\nPlight 1 1 1  1 1 8",
    ),
    (
        "eye in a cone",
        FROM_THE_FRONT,
        "Cone 3 0.5  0 -2 8.5  0 2 8.5  0.2 0.1 0.1  0.5 0.5 0.5\nPlight 1 1 1  0 1 8",
    ),
    (
        "eye in a capsule",
        FROM_THE_FRONT,
        "Capsule 3  0 -2 8.5  0 2 8.5  0.2 0.1 0.1  0.5 0.5 0.5\nPlight 1 1 1  1 1 8",
    ),
    (
        "eye on a capsule",
        FROM_THE_FRONT,
        "Capsule 0.5  0.3 -2 9.4  0.3 2 9.4  1 0 0  0 0 0\nSphere 1  0 0 0  0.1 0.1 0.1  0.7 0.7 0.7",
    ),
    (
        "capsules along the rays, and one on a ball and a cylinder of its own",
        PARALLEL,
        "Capsule 8  20 20 -60  20 20 -20  0.1 0.2 0.3  0.5 0.5 0.5\nSphere 5  6 30 -40  0.3 0.2 0.1  0.5 0.5 0.5\n\
         Capsule 5  6 30 -40  6 12 -40  0.1 0.1 0.3  0.5 0.5 0.5\nCylinder 5  6 25 -40  6 8 -40  0.1 0.3 0.1  0.5 0.5 0.5",
    ),
    (
        "eye in a box with round edges",
        FROM_THE_FRONT,
        "Roundbox -3 -2 -4  3 2.5 9.5  1.2  0.2 0.1 0.1  0.5 0.5 0.5\nPlight 1 1 1  1 1 8",
    ),
    (
        "eye on a box with round edges",
        FROM_THE_FRONT,
        "Roundbox -0.5 -2 9  0.5 2 9.4  0.2  1 0 0  0 0 0\nSphere 1  0 0 0  0.1 0.1 0.1  0.7 0.7 0.7",
    ),
    (
        "boxes with round edges along the rays, and one on a box, a ball and a cylinder of its own",
        PARALLEL,
        "Roundbox 2 2 -60  18 14 -20  4  0.1 0.2 0.3  0.5 0.5 0.5\nBox 22 2 -50  38 14 -20  0.3 0.2 0.1  0.5 0.5 0.5\n\
         Roundbox 22 2 -50  38 14 -20  4  0.1 0.3 0.1  0.5 0.5 0.5\nRoundbox 4 20 -50  20 36 -20  5  0.1 0.1 0.3  0.5 0.5 0.5\n\
         Sphere 5  9 25 -25  0.3 0.1 0.3  0.5 0.5 0.5\nCylinder 5  15 26 -25  15 30 -25  0.3 0.3 0.1  0.5 0.5 0.5",
    ),
    (
        "a row of boxes whose edges are hardly round",
        FROM_THE_FRONT,
        "Roundbox -2.03 -1 -1  -1.03 1 0  1e-9  0.1 0.1 0.1  0.6 0.5 0.4  0.3 0.3 0.3\n\
         Roundbox -1.03 -1 -1  -0.03 1 0  1e-15  0.1 0.1 0.1  0.5 0.6 0.4  0.3 0.3 0.3\n\
         Roundbox -0.03 -1 -1  0.97 1 0  1e-300  0.1 0.1 0.1  0.5 0.5 0.6  0.3 0.3 0.3",
    ),
    (
        "eye in the tube of a torus",
        FROM_THE_FRONT,
        "Torus 9 1  0 0 0  0 1 0  0.2 0.1 0.1  0.5 0.5 0.5\nPlight 1 1 1  9 0 0",
    ),
    (
        "eye in the middle of a torus",
        FROM_THE_FRONT,
        "Torus 3 1  0 0 9  0 1 0.3  0.2 0.1 0.1  0.5 0.5 0.5  0.2 0.2 0.2",
    ),
    (
        "eye on a plane",
        FROM_THE_FRONT,
        "Plane 0 0 9  0 0 1  1 0 0  0 0 0\nSphere 1  0 0 0  0.1 0.1 0.1  0.7 0.7 0.7",
    ),
    (
        "eye on a slanted plane",
        FROM_THE_FRONT,
        "Plane 0.1 0.7 9.3  0.3 0.6 -1.5  1 0 0  0 0 0\nSphere 1  0 0 0  0.1 0.1 0.1  0.7 0.7 0.7",
    ),
    (
        "eye on a cylinder",
        FROM_THE_FRONT,
        "Cylinder 0.5  0.3 -2 9.4  0.3 2 9.4  1 0 0  0 0 0\nSphere 1  0 0 0  0.1 0.1 0.1  0.7 0.7 0.7",
    ),
    (
        "the horizon",
        FROM_THE_FRONT,
        "Plane 0 -1 0  0 1 0  0.1 0.1 0.1  0.7 0.7 0.7  0.3 0.3 0.3\nSphere 1  0 0 0  0.1 0.1 0.1  0.7 0.7 0.7",
    ),
    (
        "a lamp on the floor",
        FROM_THE_FRONT,
        "Plane 0 -1 0  0 1 0  0.1 0.1 0.1  0.7 0.7 0.7\nSphere 1  0 0 0  0.1 0.1 0.1  0.7 0.7 0.7\nPlight 1 1 1  2 -1 2  0 3",
    ),
    (
        "a lamp on a ball",
        FROM_THE_FRONT,
        "Sphere 1  0 0 0  0.1 0.1 0.1  0.7 0.7 0.7\nPlight 1 1 1  0 0 1\nTorus 3 0.5  0 0 0  1 1 1  0.1 0.1 0.1  0.7 0.7 0.7",
    ),
    (
        "a lamp in a ball",
        FROM_THE_FRONT,
        "Sphere 1  0 0 0  0.1 0.1 0.1  0.7 0.7 0.7\nPlight 1 1 1  0 0 0\nBox -3 -3 -3  3 3 -2  0.1 0.1 0.1  0.7 0.7 0.7",
    ),
    ("rays along a cylinder", PARALLEL, "Cylinder 10  20 20 -30  20 20 -60  0.1 0.2 0.3  0.7 0.7 0.7"),
    ("rays along a cone", PARALLEL, "Cone 10 0  20 20 -60  20 20 -30  0.1 0.2 0.3  0.7 0.7 0.7"),
    (
        "rays along and square to tori",
        PARALLEL,
        "Torus 10 5  20 20 -30  0 0 1  0.1 0.2 0.3  0.7 0.7 0.7\nTorus 12 3  20 20 -30  0 1 0  0.3 0.2 0.1  0.7 0.7 0.7",
    ),
    (
        "discs edge on",
        PARALLEL,
        "Disc 10  20 20 -30  0 1 0  1 0 0  0 0 0\nDisc 10  20 20 -30  1 0 0  1 0 0  0 0 0\nDisc 10  20 20 -40  0 0 1  0 1 0  0 0 0",
    ),
    (
        "lying cylinders touch rays",
        PARALLEL,
        "Cylinder 10  5 20 -30  35 20 -30  0.1 0.2 0.3  0.7 0.7 0.7\nCylinder 5  20 5 -60  20 35 -60  0.1 0.2 0.3  0.7 0.7 0.7",
    ),
    (
        "mirrors that face each other",
        FROM_THE_FRONT,
        "Plane 0 -1.5 0  0 1 0  0.1 0.1 0.1  0 0 0  0.9 0.9 0.9\nPlane 0 1.5 0  0 1 0  0.1 0.1 0.2  0 0 0  0.9 0.9 0.9\nTorus 1 0.3  0 0 0  0 1 1  0.5 0.2 0.1  0.7 0.7 0.7  0.3 0.3 0.3",
    ),
];

#[test]
fn edges_of_bodies_and_lamps_are_where_the_reference_has_them() {
    for (name, view, objects) in EDGES {
        let scene = scripted(view, objects);
        let expected = reference::render(&scene, &RenderOptions::default()).unwrap();
        let drawn = draw(&scene, RenderOptions::default());
        for (x, y, pixel) in drawn.enumerate_pixels() {
            let wanted = expected.get_pixel(x, y);
            if (0..3).any(|c| pixel[c].abs_diff(wanted[c]) > 1) {
                println!("{name}: {pixel:?} and not {wanted:?} at {x}, {y}");
            }
        }
        assert!(off(&expected, &drawn) <= 1, "{name}: {} pixels", off(&expected, &drawn));
    }
}

#[test]
fn a_power_of_two_changes_no_byte() {
    let mut dice = Dice::new("powers", SEED);
    for count in [1, 5, 20] {
        let objects: Vec<Object> = (0..count).map(|_| dice.body(8)).collect();
        let scene = dice.scene(objects);
        check_powers_of_two(&scene);
    }
}

#[test]
fn a_group_is_its_copy_written_out() {
    let body = "Cylinder 0.5  0 0 0  0 1 0  0.1 0.2 0.3  0.7 0.7 0.7\nTorus 1 0.25  0 0 0  0 1 0  0.3 0.2 0.3  0.7 0.7 0.7\n\
                Box 1 0 0  1.5 0.5 2  0.1 0.4 0.3  0.7 0.7 0.7\nCone 0.5 0  -1 0 0  -1 1 0  0.1 0.2 0.6  0.7 0.7 0.7\n\
                Disc 0.5  0 2 0  0 1 0  0.5 0.2 0.3  0.7 0.7 0.7\nSphere 0.5  1 2 0  0.1 0.2 0.3  0.7 0.7 0.7  0.5 0.5 0.5\n";
    // (x, y, z) to (1 - 2z, -2 + 2y, 0.5 + 2x): a quarter turn about y, twice the size.
    let written = "Cylinder 1  1 -2 0.5  1 0 0.5  0.1 0.2 0.3  0.7 0.7 0.7\nTorus 2 0.5  1 -2 0.5  0 1 0  0.3 0.2 0.3  0.7 0.7 0.7\n\
                   Box 1 -2 2.5  -3 -1 3.5  0.1 0.4 0.3  0.7 0.7 0.7\nCone 1 0  1 -2 -1.5  1 0 -1.5  0.1 0.2 0.6  0.7 0.7 0.7\n\
                   Disc 1  1 2 0.5  0 1 0  0.5 0.2 0.3  0.7 0.7 0.7\nSphere 1  1 2 2.5  0.1 0.2 0.3  0.7 0.7 0.7  0.5 0.5 0.5\n";
    let grouped = scripted(FROM_THE_FRONT, &format!("Group g\n{body}End\nUse g  1 -2 0.5  0 -90 0  2"));
    let written = scripted(FROM_THE_FRONT, written);
    assert!(draw(&grouped, RenderOptions::default()) == draw(&written, RenderOptions::default()));
}

#[test]
fn of_faces_in_one_plane_the_first_is_seen() {
    // Each covers the centre of the picture at z = 0.3, up to x and y of 0.5 at least.
    let flat = [
        "Plane 5 5 0.3  0 0 -7",
        "Disc 2  0 0 0.3  0 0 1",
        "Box -2 -2 -2  2 2 0.3",
        "Box -2 -2 0.3  2 2 0.3",
        "Cylinder 2  0 0 -1  0 0 0.3",
        "Cylinder 2  0.1 0 0.3  0.1 0 -5",
        "Cone 1 2  0 0 -1.1  0 0 0.3",
        "Cone 2 0  0 0 0.3  0 0 -7",
        "Triangle -3 -3 0.3  3 -3 0.3  0 3 0.3",
    ];
    let grouped = |object: &str| format!("Group g\n{}\nEnd\nUse g  0 0 0  0 0 90", object);
    let view = "Screen 33 33\nLook 0 0 9  0 0 0.3  6";
    for one in flat {
        for other in flat {
            if one == other {
                continue;
            }
            let (red, green) = (format!("{one}  1 0 0  0 0 0"), format!("{other}  0 1 0  0 0 0"));
            for objects in [format!("{red}\n{green}"), format!("{red}\n{}", grouped(&green))] {
                for precision in [Precision::Auto, Precision::F64] {
                    let scene = scripted(view, &objects);
                    let drawn = draw(&scene, RenderOptions { precision, ..Default::default() });
                    assert!(drawn.pixels().all(|pixel| pixel.0 == [255, 0, 0]), "{objects}");
                }
            }
        }
    }
}
