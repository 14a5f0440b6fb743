//! What version 2 of the language brings is drawn by the packets as the plain tracer draws it, whatever it is drawn with.
//!
//! Scenes are drawn at random; a failure prints the seed. `RAYFOLD_SEED` tries another one.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may panic, and says what it measured")]

use std::sync::Arc;

use glam::{DMat3, DVec3};
use image::RgbImage;
use rayfold_scene::model::{Finish, Pattern, Shine, Weight};
use rayfold_scene::{
    Background, Camera, Cone, Cuboid, Cylinder, Depth, DirectionalLight, Disc, Instance, Lamp, Light, Look,
    Material, Object, Placement, Plane, Scene, Screen, SharedSlice, Sphere, Tone, Torus, Triangle,
};
use rayfold_tracer::{Level, Precision, RenderOptions, reference, render};

/// Pixels of all pictures that rounding may put on the other side of an outline, as a share.
const ISOLATED: f64 = 4e-4;

struct Dice(fastrand::Rng);

impl Dice {
    fn new(test: &str) -> Self {
        let seed =
            std::env::var("RAYFOLD_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(20_261_122);
        println!("{test}: RAYFOLD_SEED={seed}");
        Self(fastrand::Rng::with_seed(seed))
    }

    fn within(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * self.0.f64()
    }

    fn point(&mut self, size: f64) -> DVec3 {
        DVec3::new(self.within(-size, size), self.within(-size, size), self.within(-size, size))
    }

    fn color(&mut self) -> DVec3 {
        self.point(0.5) + 0.5
    }

    fn material(&mut self) -> Material {
        let mirror = if self.0.bool() { 0.6 * self.color() } else { DVec3::ZERO };
        Material::new(0.1 * self.color(), self.color(), mirror).unwrap()
    }

    /// A sphere, a box or a triangle, any of which may be a mirror.
    fn object(&mut self) -> Object {
        let at = self.point(3.0);
        let material = self.material();
        match self.0.u8(0..3) {
            0 => Sphere::new(self.within(0.1, 0.8), at, material).unwrap().into(),
            1 => Cuboid::new([at, at + self.point(0.8)], material).unwrap().into(),
            _ => Triangle::new([at, at + self.point(1.5), at + self.point(1.5)], material).unwrap().into(),
        }
    }

    fn scene(&mut self, objects: Vec<Object>) -> Scene {
        let eye = self.point(1.0).normalize() * 9.0;
        let up = if self.0.bool() { Some(self.point(1.0)) } else { None };
        let look = Look::new(eye, self.point(0.5), self.within(35.0, 70.0), up).unwrap();
        let screen = Screen::new(self.0.u32(50..90), self.0.u32(50..90)).unwrap();
        let camera = if self.0.u8(0..4) == 0 { Camera::Orthographic } else { Camera::Look(look) };
        let mut scene = Scene::new(screen, camera);
        if camera == Camera::Orthographic {
            let place = |p: DVec3| p * 12.0 + DVec3::new(35.0, 35.0, -80.0);
            scene.objects = objects.iter().map(|object| object.placed(12.0, place).unwrap()).collect();
        } else {
            scene.objects = objects.into();
        }
        scene.background = Background::sky(self.color(), self.color()).unwrap();
        scene.tone = if self.0.bool() { Tone::Srgb } else { Tone::Plain };
        scene.depth = Depth::new(self.0.u32(0..8)).unwrap();
        scene.lights = (0..self.0.usize(0..4))
            .map(|_| Light::Directional(DirectionalLight::new(0.6 * self.color(), self.point(1.0)).unwrap()))
            .collect();
        scene
    }
}

fn draw(scene: &Scene, options: RenderOptions) -> RgbImage {
    render(scene, &options).unwrap()
}

fn levels() -> Vec<(&'static str, Level)> {
    let best = Level::new();
    let mut levels = vec![("the best", best)];
    #[cfg(target_arch = "x86_64")]
    {
        levels.extend(best.as_avx2().map(|level| ("AVX2", Level::Avx2(level))));
        levels.extend(best.as_sse4_2().map(|level| ("SSE4.2", Level::Sse4_2(level))));
    }
    levels
}

/// Pixels that are off by more than one level in a channel.
fn off(a: &RgbImage, b: &RgbImage) -> usize {
    assert_eq!(a.dimensions(), b.dimensions());
    a.pixels().zip(b.pixels()).filter(|(p, q)| (0..3).any(|c| p[c].abs_diff(q[c]) > 1)).count()
}

/// Holds the packets to the plain tracer, and to themselves: in all numbers, on all instructions, for any tile and tree.
fn hold(scenes: &[Scene]) {
    let (mut differ, mut pixels) = (0, 0);
    for (number, scene) in scenes.iter().enumerate() {
        let expected = reference::render(scene, &RenderOptions::default()).unwrap();
        let mut before = None;
        for precision in [Precision::Auto, Precision::F32, Precision::F64] {
            let options = RenderOptions { precision, ..Default::default() };
            let drawn = draw(scene, options);
            // What is drawn with the same numbers needs no second look.
            if before.as_ref() == Some(&drawn) {
                continue;
            }
            before = Some(drawn.clone());
            let wrong = off(&expected, &drawn);
            if wrong > 0 {
                println!("scene {number}, {precision:?}: {wrong} of {} pixels are off", drawn.pixels().len());
            }
            differ += wrong;
            pixels += drawn.pixels().len();
            for (name, level) in levels() {
                let other = draw(scene, RenderOptions { level: Some(level), ..options });
                if name == "SSE4.2" {
                    differ += off(&drawn, &other);
                } else {
                    assert!(drawn == other, "scene {number} on {name}, {precision:?}");
                }
            }
            let tiles = [(4, 4), (32, 8)].map(|tile| RenderOptions { tile: Some(tile), ..options });
            let trees = [true, false].map(|tree| RenderOptions { tree: Some(tree), ..options });
            for options in tiles.into_iter().chain(trees) {
                let other = draw(scene, options);
                assert!(
                    drawn == other,
                    "scene {number}, {:?} {:?} {precision:?}",
                    options.tile,
                    options.tree
                );
            }
        }
    }
    println!("{differ} of {pixels} pixels are off by more than one level");
    assert!(differ as f64 <= ISOLATED * pixels as f64, "{differ} of {pixels} pixels");
}

#[test]
fn skies_tones_depths_and_mirrors_of_all_kinds_are_the_references() {
    let mut dice = Dice::new("sky");
    let scenes: Vec<Scene> = [0, 1, 6, 30, 90]
        .into_iter()
        .cycle()
        .take(10)
        .map(|count| {
            let objects = (0..count).map(|_| dice.object()).collect();
            dice.scene(objects)
        })
        .collect();
    hold(&scenes);
}

/// An object of a group of one, moved, turned and scaled.
fn placed(dice: &mut Dice, object: Object) -> Object {
    let right_angles = dice.0.bool();
    let turns = DVec3::from_array(
        [(); 3].map(|()| if right_angles { f64::from(dice.0.u8(0..4)) } else { dice.within(0.0, 4.0) }),
    );
    // Right angles are exact.
    let (cosine, sine) = (
        turns
            .to_array()
            .map(|turn| if right_angles { [1.0, 0.0, -1.0, 0.0][turn as usize] } else { turn.cos() }),
        turns
            .to_array()
            .map(|turn| if right_angles { [0.0, 1.0, 0.0, -1.0][turn as usize] } else { turn.sin() }),
    );
    let x =
        DMat3::from_cols(DVec3::X, DVec3::new(0.0, cosine[0], sine[0]), DVec3::new(0.0, -sine[0], cosine[0]));
    let y =
        DMat3::from_cols(DVec3::new(cosine[1], 0.0, -sine[1]), DVec3::Y, DVec3::new(sine[1], 0.0, cosine[1]));
    let z =
        DMat3::from_cols(DVec3::new(cosine[2], sine[2], 0.0), DVec3::new(-sine[2], cosine[2], 0.0), DVec3::Z);
    let placement = Placement::new(dice.point(1.0), z * y * x, dice.within(0.3, 1.5)).unwrap();
    let objects: SharedSlice<Object> = vec![object].into();
    Instance::new(&objects, 0, &Arc::new(placement)).into()
}

#[test]
fn groups_are_the_references() {
    let mut dice = Dice::new("groups");
    let scenes: Vec<Scene> = [1, 6, 30, 90]
        .into_iter()
        .cycle()
        .take(12)
        .map(|count| {
            let objects = (0..count)
                .map(|_| {
                    let object = dice.object();
                    placed(&mut dice, object)
                })
                .collect();
            dice.scene(objects)
        })
        .collect();
    hold(&scenes);
}

impl Dice {
    /// A plane, a disc, a cylinder, a cone, a torus, or an object of version 1, any of which may be turned with a group.
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

    /// Beside its suns.
    fn add_lamps(&mut self, scene: &mut Scene) {
        let (size, middle) = match scene.camera {
            Camera::Orthographic => (50.0, DVec3::new(35.0, 35.0, -60.0)),
            Camera::Pinhole(_) | Camera::Look(_) => (5.0, DVec3::ZERO),
        };
        let mut lights = scene.lights.to_vec();
        for _ in 0..self.0.usize(1..4) {
            let reach = if self.0.bool() { self.within(0.2, 0.8) * size } else { 0.0 };
            let lamp = Lamp::new(0.6 * self.color(), middle + self.point(size), 0.0, reach).unwrap();
            let at = self.0.usize(0..=lights.len());
            lights.insert(at, Light::Lamp(lamp));
        }
        scene.lights = lights.into();
    }
}

#[test]
fn shapes_with_axes_of_their_own_are_the_references() {
    let mut dice = Dice::new("bodies");
    let mut scenes: Vec<Scene> = vec![];
    for (count, kinds) in [(1, 4), (1, 5), (3, 5), (8, 6), (20, 8), (40, 4), (100, 8)] {
        scenes.extend([(); 3].map(|()| dice.bodies(count, kinds)));
    }
    hold(&scenes);
}

#[test]
fn lamps_are_the_references() {
    let mut dice = Dice::new("lamps");
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
    /// Coefficients with highlights, a pattern, or both.
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
        Material::finished(own, Finish { shine, glass: None, pattern })
    }

    /// An object of any kind with a finish, in a group or not.
    fn finished_object(&mut self) -> Object {
        let (at, about) = (self.point(3.0), self.point(1.0));
        let end = at + self.within(0.2, 2.0) / about.length() * about;
        let radius = self.within(0.2, 0.9);
        let material = self.finished();
        let floor = DVec3::new(0.0, -2.0, 0.0);
        let object: Object = match self.0.u8(0..8) {
            0 => Disc::new(radius, at, about, material).unwrap().into(),
            1 => Cylinder::new(radius, [at, end], material).unwrap().into(),
            2 => Cone::new([radius, 0.3], [at, end], material).unwrap().into(),
            3 => Torus::new(radius, 0.4 * radius, at, about, material).unwrap().into(),
            4 => Plane::new(floor, DVec3::Y, material).unwrap().into(),
            5 => Sphere::new(radius, at, material).unwrap().into(),
            6 => Cuboid::new([at, end], material).unwrap().into(),
            _ => Triangle::new([at, end, at + self.point(1.5)], material).unwrap().into(),
        };
        if self.0.u8(0..3) == 0 { placed(self, object) } else { object }
    }
}

#[test]
fn highlights_and_patterns_are_the_references() {
    let mut dice = Dice::new("finishes");
    let mut scenes: Vec<Scene> = vec![];
    for count in [1, 3, 10, 30, 90] {
        scenes.extend([(); 2].map(|()| {
            let objects = (0..count).map(|_| dice.finished_object()).collect();
            let mut scene = dice.scene(objects);
            dice.add_lamps(&mut scene);
            scene
        }));
    }
    hold(&scenes);
}
