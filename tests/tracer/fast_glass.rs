//! The packets draw glass like the plain tracer does, with any instruction set and search structure. Simple scenes are
//! also compared with results computed by hand from the language reference.
//!
//! Scenes are random; a failure prints the seed. `RAYFOLD_SEED` sets another one.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use glam::{DMat3, DVec3};
use image::Rgb;
use rayfold_scene::model::{Finish, Glass, Pattern, Shine, Weight};
use rayfold_scene::{
    Camera, Coefficients, Cuboid, Depth, DirectionalLight, Fog, Instance, Lamp, Light, Look, Material,
    Object, Placement, Plane, Scene, Screen, Sphere, Triangle,
};
use rayfold_tracer::probe::nearest_hits;
use rayfold_tracer::{RenderError, RenderOptions, reference, render};

use super::dice::Dice;
use super::hold::{check_powers_of_two, draw, hold, off, placed, scripted};

const SEED: u64 = 20_261_123;

impl Dice {
    /// Returns glass, alone or with a mirror, a highlight or a pattern.
    fn glass(&mut self) -> Material {
        let ior = [1.5, 1.33, 2.4, 0.7, 1.0, self.within(0.4, 3.0)][self.0.usize(0..6)];
        let glass = Some(Glass::new(0.4 + 0.6 * self.color(), ior).unwrap());
        let shine = if self.0.u8(0..3) == 0 { Some(Shine::new(self.color(), 20.0).unwrap()) } else { None };
        let other = self.material().coefficients();
        let pattern = if self.0.u8(0..4) == 0 {
            Some(Pattern { weight: Weight::Noise(self.within(0.2, 1.0)), other })
        } else {
            None
        };
        let mirror = if self.0.u8(0..4) == 0 { 0.3 * self.color() } else { DVec3::ZERO };
        let own = Coefficients::new(0.05 * self.color(), 0.2 * self.color(), mirror).unwrap();
        Material::finished(
            own,
            Finish { shine, glass, pattern, image: None, own: false, glow: DVec3::ZERO, rough: None },
        )
    }

    /// Returns a scene of this many objects, half of them of glass, and a floor.
    fn glass_scene(&mut self, count: usize) -> Scene {
        let mut objects: Vec<Object> = (0..count)
            .map(|_| {
                let material = if self.0.bool() { self.glass() } else { self.material() };
                self.any(material)
            })
            .collect();
        let at = self.0.usize(0..=count);
        // The floor is slightly inclined, so that no ray that refraction turns only by rounding lies in its plane.
        let upwards = DVec3::new(0.137, 1.0, 0.0713);
        let floor = Plane::new(DVec3::new(0.0, -2.5, 0.0), upwards, self.material()).unwrap();
        objects.insert(at, floor.into());
        let mut scene = self.scene(objects);
        if scene.camera != Camera::Orthographic {
            scene.screen = Screen::new(self.0.u32(20..40), self.0.u32(20..40)).unwrap();
        }
        self.add_lamps(&mut scene);
        scene
    }
}

#[test]
fn glass_of_all_shapes_is_the_references() {
    let mut dice = Dice::new("glass", SEED);
    let mut scenes: Vec<Scene> = vec![];
    for count in [1, 1, 2, 2, 4, 8, 16] {
        scenes.extend([(); 3].map(|()| dice.glass_scene(count)));
    }
    hold(&scenes);
}

#[test]
fn glass_in_fog_is_the_references() {
    let mut dice = Dice::new("glass in fog", SEED);
    let mut scenes: Vec<Scene> = vec![];
    for count in [1, 2, 4, 8] {
        scenes.extend([(); 3].map(|()| {
            let mut scene = dice.glass_scene(count);
            let unit = if scene.camera == Camera::Orthographic { 12.0 } else { 1.0 };
            scene.fog = Fog::new(dice.color(), unit * dice.within(1.0, 20.0)).unwrap();
            scene
        }));
    }
    hold(&scenes);
}

#[test]
fn a_mesh_of_glass_and_many_balls_are_the_references() {
    let mut dice = Dice::new("meshes", SEED);
    let (glass, floor) = (dice.glass(), dice.material());
    let mut objects: Vec<Object> = vec![Plane::new(DVec3::NEG_Y, DVec3::Y, floor).unwrap().into()];
    // A hilly sheet, and spheres in and over it: more objects than a mask has bits.
    let point = |x: i32, z: i32| {
        let (x, z) = (f64::from(x) * 0.5, f64::from(z) * 0.5);
        DVec3::new(x, 0.3 * (x * 3.0).sin() * (z * 2.0).cos(), z)
    };
    for (x, z) in (-4..4).flat_map(|x| (-4..4).map(move |z| (x, z))) {
        let [a, b, c, d] = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(u, v)| point(x + u, z + v));
        for corners in [[a, b, c], [a, c, d]] {
            objects.push(Triangle::new(corners, glass.clone()).unwrap().into());
        }
    }
    for _ in 0..20 {
        let (at, material) = (dice.point(2.0), if dice.0.bool() { dice.glass() } else { dice.material() });
        objects.push(Sphere::new(0.3, at, material).unwrap().into());
    }
    let mut scene = dice.scene(objects);
    let eye = DVec3::new(2.0, 3.0, 6.0);
    scene.camera = Camera::Look(Look::new(eye, DVec3::new(0.03, 0.05, 0.01), 45.0, None).unwrap());
    scene.screen = Screen::new(37, 29).unwrap();
    scene.depth = Depth::new(6).unwrap();
    dice.add_lamps(&mut scene);
    hold(&[scene]);
}

const FROM_THE_FRONT: &str = "Screen 41 41\nLook 0.13 0.21 9  0.02 0.03 0  50\nBackground 0.1 0.2 0.3  0.5 0.7 0.9\n\
                              Ilight 0.6 0.6 0.6  -1 -2 -3\nMaterial clear glass 0.9 0.95 1  1.5\n\
                              Material dark glass 0.5 0.4 0.3  1.33\nMaterial matte diffuse 0.7 0.7 0.7 ambient 0.1 0.1 0.1\n\
                              Material blue diffuse 0.2 0.2 0.6\nMaterial floor diffuse 0.7 0.7 0.7 noise 0.5 blue";

/// Cases in which an almost correct formula fails.
const EDGES: [(&str, &str); 21] = [
    ("glass in glass", "Sphere 2  0 0 0  clear\nSphere 1  0.3 0 0  dark\nSphere 0.5  0.3 0.1 0  matte"),
    ("air in glass", "Sphere 2  0 0 0  clear\nMaterial air glass 1 1 1  0.667\nSphere 1.9  0 0 0  air"),
    ("the same ball twice", "Sphere 2  0 0 0  clear\nSphere 2  0 0 0  dark\nPlane 0 -2 0  0 1 0  floor"),
    (
        "stacked panes",
        "Box -2 -2 0  2 2 1  clear\nBox -2 -2 -1  2 2 0  dark\nBox -2 -2 -2  2 2 -1  clear\nSphere 1  0 0 -4  matte",
    ),
    (
        "a water glass",
        "Cylinder 1.5  0 -2 0  0 2 0  clear\nCylinder 1.25  0 -1.75 0  0 1 0  dark\nPlane 0 -2 0  0 1 0  floor",
    ),
    ("total reflection", "Box -3 -3 -3  3 3 3  clear\nSphere 1  0 0 0  matte\nPlane 0 -4 0  0 1 0  floor"),
    (
        "out of a denser medium",
        "Material air glass 1 1 1  0.5\nSphere 2.5  0 0 0  air\nPlane 0 -3 0  0 1 0  floor",
    ),
    ("eye in the middle of glass", "Sphere 3  0.13 0.21 9  clear\nSphere 1  0 0 0  matte"),
    ("eye in glass", "Sphere 3  0 0 9  clear\nSphere 1  0 0 0  matte\nPlane 0 -2 0  0 1 0  floor"),
    ("eye in a box of glass", "Box -2 -2 7  2 2 11  clear\nTorus 1 0.4  0 0 0  1 1 1  matte"),
    (
        "eye in the tube of a torus",
        "Torus 9 1  0 0 0  0 1 0  dark\nSphere 1  0 0 0  matte\nPlane 0 -2 0  0 1 0  floor",
    ),
    (
        "a box with round edges",
        "Roundbox -1.5 -1 -0.8  1 1.5 0.9  0.5  clear\nPlane 0 -3 0  0 1 0  floor\nPlight 0.6 0.5 0.4  1 4 2",
    ),
    (
        "a capsule",
        "Capsule 1.2  -1 -1 0  1 1.5 0.4  clear\nPlane 0 -3 0  0 1 0  floor\nPlight 0.6 0.5 0.4  1 4 2",
    ),
    ("a torus", "Torus 2 0.9  0 0 0  1 2 3  clear\nPlane 0 -3 0  0 1 0  floor\nPlight 0.6 0.5 0.4  1 4 2"),
    (
        "cones",
        "Cone 2 0  0 -2 0  0 2 0  clear\nCone 0.5 1.5  3 -2 -1  3 2 -1  dark\nPlane 0 -2 0  0 1 0  floor",
    ),
    (
        "a pane edge on",
        "Triangle -2 0 -2  2 0 -2  0 0 2  clear\nDisc 2  0 0 0  1 0 0  dark\nSphere 1  0 0 -4  matte",
    ),
    ("flat boxes", "Box -2 -2 1  2 2 1  clear\nBox -2 0.5 -2  2 0.5 2  dark\nSphere 1  0 0 -4  matte"),
    (
        "groups, turned and scaled",
        "Group g\nBox -1 -1 -1  1 1 1  clear\nDisc 0.5  0 0 0  0 0 1  dark\nBox -1 -1 2  1 1 2  dark\nCylinder 0.3  0 0 0  0 2 0  dark\nEnd\n\
         Use g  -1 0 0  10 20 30  1.5\nUse g  2 1 0  0 90 0\nPlane 0 -2 0  0 1 0  floor",
    ),
    (
        "a hall of 17 surfaces",
        "Depth 16\nGroup pane\nBox -2 -2 -0.125  2 2 0.125  clear\nEnd\nUse pane 0 0 3\nUse pane 0 0 2\nUse pane 0 0 1\nUse pane\n\
         Use pane 0 0 -1\nUse pane 0 0 -2\nUse pane 0 0 -3\nUse pane 0 0 -4\nSphere 1  0 0 -6  matte",
    ),
    (
        "shadows of glass, by a sun and by a lamp in glass",
        "Plane 0 -2 0  0 1 0  floor\nSphere 1  0 0 0  dark\nTorus 2 0.4  0 0 0  0.2 1 0  clear\nTriangle -3 1 -3  3 1 -3  0 1 3  dark\n\
         Sphere 0.5  2 2 2  clear\nPlight 0.5 0.6 0.7  2 2 2\nSphere 0.3  0 1.5 0  matte\nPlight 0.3 0.3 0.3  0 0 0",
    ),
    (
        "a lamp on a pane",
        "Plane 0 -2 0  0 1 0  floor\nDisc 2  0 1 0  0 1 0  dark\nPlight 0.8 0.8 0.8  0 1 0  0 3\nBox -1 -1 -1  1 0 1  clear",
    ),
];

#[test]
fn edges_of_glass_are_where_the_reference_has_them() {
    for (name, objects) in EDGES {
        for tone in ["plain", "srgb"] {
            let scene = scripted(&format!("{FROM_THE_FRONT}\nTone {tone}"), objects);
            let expected = reference::render(&scene, &RenderOptions::default()).unwrap();
            let drawn = draw(&scene, RenderOptions::default());
            let wrong = off(&expected, &drawn);
            println!("{name}, {tone}: {wrong} pixels are off");
            for (x, y, pixel) in drawn.enumerate_pixels() {
                let wanted = expected.get_pixel(x, y);
                if (0..3).any(|c| pixel[c].abs_diff(wanted[c]) > 1) {
                    println!("{name}: {pixel:?} and not {wanted:?} at {x}, {y}");
                }
            }
            assert!(wrong <= 1, "{name}: {wrong} pixels");
        }
    }
}

/// Returns the colour of a vertical ray onto the centre of a floor that is white without any light.
fn down(objects: &str) -> [u8; 3] {
    let view = "Screen 1 1\nLook 0 9 0  0 0 0  1\nDisc 9  0 0 0  0 1 0  1 1 1  0 0 0\nBackground 0 0 0";
    draw(&scripted(view, objects), RenderOptions::default()).get_pixel(0, 0).0
}

#[test]
fn panes_let_through_what_they_do_not_mirror() {
    let pane = |color: &str| format!("Material pane glass {color}\n");
    // An index of 1 reflects nothing: each surface contributes its coefficient.
    assert_eq!(down(&(pane("0.5 0.25 1  1") + "Disc 5  0 1 0  0 1 0  pane")), [128, 64, 255]);
    assert_eq!(down(&(pane("0.5 0.25 1  1") + "Box -5 1 -5  5 2 5  pane")), [64, 16, 255]);
    assert_eq!(down(&(pane("0.5 0.25 1  1") + "Sphere 2  0 3 0  pane")), [64, 16, 255]);
    // Surfaces at one position are passed together.
    let stacked = "Box -5 1 -5  5 2 5  pane\nBox -5 2 -5  5 3 5  pane";
    assert_eq!(down(&(pane("0.5 0.25 1  1") + stacked)), [32, 4, 255]);
    // 4 % at the front of a pane. It reflects black here.
    assert_eq!(down(&(pane("1 1 1  1.5") + "Disc 5  0 1 0  0 1 0  pane")), [245; 3]);
    assert_eq!(down(&(pane("1 1 1  1.5") + "Disc 5  0 0 0  0 1 0  pane")), [255; 3], "on the floor");
    // Faint rays are not traced; with `Tone srgb` the limit is lower.
    let bright = "Disc 5  0 0.5 0  0 1 0  4096 4096 4096  0 0 0\n";
    let faint =
        |share: f64| down(&format!("{bright}{}Disc 5  0 1 0  0 1 0  pane", pane(&format!("{share} 0 0  1"))));
    assert_eq!((faint(1.0 / 4096.0), faint(1.0 / 4097.0)), ([255, 0, 0], [0; 3]));
    assert_eq!(down(&(pane("1 1 1  1") + "Depth 0\nDisc 5  0 1 0  0 1 0  pane")), [0; 3]);
    assert_eq!(down(&(pane("1 1 1  1") + "Depth 1\nDisc 5  0 1 0  0 1 0  pane")), [255; 3]);
}

#[test]
fn shadows_are_as_dark_as_the_glass_on_the_way() {
    let lit = |light: &str, objects: &str| {
        let view = "Screen 1 1\nLook 0 9 0  0 0 0  1\nDisc 9  0 0 0  0 1 0  0 0 0  1 1 1\n\
                    Material pane glass 0.6 1 0.25  1.5";
        draw(&scripted(view, &format!("{light}\n{objects}")), RenderOptions::default()).get_pixel(0, 0).0
    };
    // Both come from the side by 3 : 4, so that nothing is in front of the eye.
    for light in ["Ilight 1 1 1  -3 -4 0", "Plight 1 1 1  6 8 0"] {
        assert_eq!(lit(light, ""), [204; 3]);
        assert_eq!(lit(light, "Box 2 2 -1  4 5 1  pane"), [73, 204, 13]);
        assert_eq!(lit(light, "Disc 1  3 4 0  3 4 0  pane"), [122, 204, 51]);
        assert_eq!(lit(light, "Sphere 1  3 4 0  pane\nDisc 0.5  3 4 0  3 4 0  pane"), [44, 204, 3]);
        assert_eq!(lit(light, "Torus 1 0.25  3 4 0  -4 3 0  pane"), [26, 204, 1]);
        assert_eq!(lit(light, "Sphere 1  3 4 0  pane\nDisc 0.5  3 4 0  3 4 0  0 0 0  1 1 1"), [0; 3]);
        assert_eq!(lit(light, "Disc 1  3 4 0  3 4 0  pane\nDisc 1  3 4 0  3 4 0  0 0 0  1 1 1"), [0; 3]);
    }
    // Objects beyond the lamp do not dim it.
    assert_eq!(lit("Plight 1 1 1  3 4 0", "Sphere 1  6 8 0  pane"), [204; 3]);
}

#[test]
fn what_bends_and_mirrors_nothing_cannot_be_seen() {
    let mut dice = Dice::new("nothing", SEED);
    let nothing = Finish { glass: Some(Glass::new(DVec3::ONE, 1.0).unwrap()), ..Finish::default() };
    let nothing = Material::finished(Coefficients::default(), nothing);
    let (mut differ, mut pixels) = (0, 0);
    for _ in 0..20 {
        let mut objects: Vec<Object> = (0..6)
            .map(|_| {
                let material = Material::new(0.1 * dice.color(), dice.color(), DVec3::ZERO).unwrap();
                dice.any(material)
            })
            .collect();
        let mut scene = dice.scene(objects.clone());
        dice.add_lamps(&mut scene);
        let expected = draw(&scene, RenderOptions::default());
        objects = scene.objects.to_vec();
        for _ in 0..2 {
            let at = dice.0.usize(0..=objects.len());
            objects.insert(at, dice.any(nothing.clone()));
        }
        scene.objects = objects.into();
        // A line hits each of the two four times at most.
        scene.depth = Depth::new(8).unwrap();
        let drawn = draw(&scene, RenderOptions::default());
        differ += off(&expected, &drawn);
        pixels += drawn.pixels().len();
    }
    println!("{differ} of {pixels} pixels are off");
    assert!(pixels > 20_000 && differ as f64 <= 4e-4 * pixels as f64, "{differ} of {pixels}");
}

#[test]
fn a_power_of_two_changes_no_byte() {
    let mut dice = Dice::new("powers", SEED);
    for count in [1, 4, 9, 12] {
        let mut objects: Vec<Object> = (0..count)
            .map(|_| {
                let at = dice.point(2.0);
                let material = Material::finished(
                    Coefficients::default(),
                    Finish { glass: Some(Glass::new(dice.color(), 1.5).unwrap()), ..Finish::default() },
                );
                match dice.0.u8(0..2) {
                    0 => Sphere::new(0.8, at, material).unwrap().into(),
                    _ => Cuboid::new([at, at + 0.8 * DVec3::ONE], material).unwrap().into(),
                }
            })
            .collect();
        objects.extend((0..count).map(|_| dice.object()));
        let scene = dice.scene(objects);
        check_powers_of_two(&scene);
    }
}

#[test]
fn the_order_of_lines_and_the_number_of_threads_change_no_byte() {
    let mut dice = Dice::new("order", SEED);
    for count in [2, 5, 9] {
        // Without planes at the same position.
        let objects: Vec<Object> = (0..count)
            .map(|_| {
                let (material, at) = (dice.glass(), dice.point(2.0));
                let ball = Sphere::new(dice.within(0.3, 1.0), at, material).unwrap().into();
                placed(&mut dice, ball)
            })
            .collect();
        let mut scene = dice.scene(objects);
        dice.add_lamps(&mut scene);
        let expected = draw(&scene, RenderOptions::default());
        let mut shuffled = scene.objects.to_vec();
        dice.0.shuffle(&mut shuffled);
        let other = Scene { objects: shuffled.into(), ..scene.clone() };
        assert!(expected == draw(&other, RenderOptions::default()), "{count} balls in another order");
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
        assert!(expected == pool.install(|| draw(&scene, RenderOptions::default())), "on three threads");
    }
}

#[test]
fn a_group_of_glass_is_its_copy_written_out() {
    let grouped = "Group g\nCylinder 0.5  0 0 0  0 1 0  clear\nTorus 1 0.25  0 0 0  0 1 0  dark\nBox 1 0 0  1.5 0.5 2  clear\n\
                   Cone 0.5 0  -1 0 0  -1 1 0  dark\nSphere 0.5  1 2 0  clear\nEnd\nUse g  1 -2 0.5  0 -90 0  2\n";
    // (x, y, z) to (1 - 2z, -2 + 2y, 0.5 + 2x): a quarter turn about y, twice the size.
    let written = "Cylinder 1  1 -2 0.5  1 0 0.5  clear\nTorus 2 0.5  1 -2 0.5  0 1 0  dark\nBox 1 -2 2.5  -3 -1 3.5  clear\n\
                   Cone 1 0  1 -2 -1.5  1 0 -1.5  dark\nSphere 1  1 2 2.5  clear\n";
    let [grouped, written] = [grouped, written].map(|objects| {
        let floor = format!("{objects}Plane 0 -2.1 0  0.1 1 0.07  floor");
        draw(&scripted(FROM_THE_FRONT, &floor), RenderOptions::default())
    });
    assert!(grouped == written);
}

#[test]
fn a_scene_turned_by_a_right_angle_is_the_same() {
    let mut dice = Dice::new("turned", SEED);
    // (x, y, z) to (z, y, -x)
    let quarter = DMat3::from_cols(DVec3::NEG_Z, DVec3::Y, DVec3::X);
    let placement = Arc::new(Placement::new(DVec3::ZERO, quarter, 1.0).unwrap());
    let (mut differ, mut pixels) = (0, 0);
    for count in [1, 2, 4, 8].into_iter().cycle().take(24) {
        let mut scene = dice.glass_scene(count);
        let Camera::Look(look) = scene.camera else { continue };
        let is_grouped = |object: &Object| matches!(object, Object::Instance(_));
        let objects: Vec<Object> = scene.objects.iter().filter(|o| !is_grouped(o)).cloned().collect();
        scene.objects = objects.into();
        let expected = draw(&scene, RenderOptions::default());
        let turn = |k| Instance::new(&scene.objects, k, &placement).into();
        let lights = scene.lights.iter().map(|light| match light {
            Light::Directional(sun) => {
                DirectionalLight::new(sun.color(), quarter * sun.direction()).unwrap().into()
            }
            Light::Lamp(lamp) => {
                let position = quarter * lamp.position();
                Lamp::new(lamp.color(), position, lamp.radius(), lamp.reach()).unwrap().into()
            }
        });
        let (eye, target, up) = (quarter * look.eye(), quarter * look.target(), quarter * look.up());
        let turned = Scene {
            objects: (0..scene.objects.len()).map(turn).collect(),
            lights: lights.collect(),
            camera: Camera::Look(Look::new(eye, target, look.field_of_view(), Some(up)).unwrap()),
            ..scene.clone()
        };
        let drawn = draw(&turned, RenderOptions::default());
        differ += off(&expected, &drawn);
        pixels += drawn.pixels().len();
    }
    println!("{differ} of {pixels} pixels are off");
    assert!(pixels > 10_000 && differ as f64 <= 4e-4 * pixels as f64, "{differ} of {pixels}");
}

#[test]
fn of_faces_in_one_plane_that_without_glass_is_seen() {
    let flat = [
        "Plane 5 5 0.3  0 0 -7",
        "Disc 2  0 0 0.3  0 0 1",
        "Box -2 -2 -2  2 2 0.3",
        "Box -2 -2 0.3  2 2 0.3",
        "Cylinder 2  0 0 -1  0 0 0.3",
        "Cone 2 0  0 0 0.3  0 0 -7",
        "Triangle -3 -3 0.3  3 -3 0.3  0 3 0.3",
    ];
    let view = "Screen 17 17\nLook 0 0 9  0 0 0.3  6\nMaterial pane glass 1 1 1  1.5";
    for one in flat {
        for other in flat.into_iter().filter(|other| *other != one) {
            let (pane, red) = (format!("{one}  pane"), format!("{other}  1 0 0  0 0 0"));
            for objects in [format!("{pane}\n{red}"), format!("{red}\n{pane}")] {
                let drawn = draw(&scripted(view, &objects), RenderOptions::default());
                assert!(drawn.pixels().all(|pixel| *pixel == Rgb([255, 0, 0])), "{objects}");
            }
        }
    }
}

#[test]
fn single_rays_name_objects_by_their_place_in_the_script() {
    let view = "Screen 3 3\nLook 0 0 9  0 0 0  50\nMaterial pane glass 1 1 1  1.5";
    let pane_and_wall =
        "Disc 2  0 0 1  0 0 1  pane\nDisc 5  0 0 0  0 0 1  1 0 0  0 0 0\nDisc 1  0 0 0  0 0 1  pane";
    let rays = [DVec3::new(0.0, 0.0, 9.0), DVec3::new(3.0, 0.0, 9.0), DVec3::new(0.5, 0.0, 0.5)];
    let rays = rays.map(|origin| (origin, DVec3::NEG_Z));
    let found = nearest_hits(&scripted(view, pane_and_wall), &rays, &RenderOptions::default()).unwrap();
    assert_eq!(found.into_iter().map(|hit| hit.unwrap().object).collect::<Vec<_>>(), [0, 1, 1]);
}

#[test]
fn a_picture_of_endless_glass_can_be_interrupted() {
    let shells: String = (1..40).map(|k| format!("Sphere {k}  0 0 0  shell\n")).collect();
    let view = "Screen 16 16\nLook 0 0 0.1  0 0 0  50\nDepth 16\nTone srgb\nMaterial shell glass 1 1 1  3 mirror 1 1 1";
    let scene = scripted(view, &shells);
    let flag = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            std::thread::sleep(Duration::from_millis(300));
            flag.store(true, Ordering::Relaxed);
        });
        let drawn = render(&scene, &RenderOptions { cancel: Some(&flag), ..Default::default() });
        assert!(matches!(drawn, Err(RenderError::Cancelled)), "all of it was drawn");
    });
}
