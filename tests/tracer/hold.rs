//! Random scenes with all features of the language, and the check of the packets' pictures: they equal the plain
//! tracer's, and they do not depend on the instruction set or the search structure.

use std::sync::Arc;

use glam::{DMat3, DVec3};
use image::RgbImage;
use rayfold_scene::model::{Finish, Glass};
use rayfold_scene::{
    Background, Camera, Coefficients, Cone, Cuboid, Cylinder, Depth, DirectionalLight, Disc, Instance, Lamp,
    Light, Limits, Look, Material, Object, Placement, Plane, Scene, Screen, SharedSlice, Sphere, Tone, Torus,
    Triangle, parse,
};
use rayfold_tracer::{Level, Precision, RenderOptions, reference, render};

use crate::dice::Dice;

/// The share of pixels of all pictures at outlines that rounding may assign to another object.
const ISOLATED: f64 = 4e-4;

impl Dice {
    /// Returns a sphere, a box or a triangle, any of which may be a mirror.
    pub(crate) fn object(&mut self) -> Object {
        let at = self.point(3.0);
        let material = self.material();
        match self.0.u8(0..3) {
            0 => Sphere::new(self.within(0.1, 0.8), at, material).unwrap().into(),
            1 => Cuboid::new([at, at + self.point(0.8)], material).unwrap().into(),
            _ => Triangle::new([at, at + self.point(1.5), at + self.point(1.5)], material).unwrap().into(),
        }
    }

    pub(crate) fn scene(&mut self, objects: Vec<Object>) -> Scene {
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
        match self.0.bool() {
            true => scene.background = Background::sky(self.color(), self.color()).unwrap(),
            false => scene.set_background(self.color()).unwrap(),
        }
        scene.tone = if self.0.bool() { Tone::Srgb } else { Tone::Plain };
        scene.depth = Depth::new(self.0.u32(0..8)).unwrap();
        scene.lights = (0..self.0.usize(0..4))
            .map(|_| Light::Directional(DirectionalLight::new(0.6 * self.color(), self.point(1.0)).unwrap()))
            .collect();
        scene
    }

    /// Returns objects of any kind; of glass are `glass` of four.
    pub(crate) fn objects_and_glass(&mut self, count: usize, glass: u8) -> Vec<Object> {
        let material = |dice: &mut Self| {
            if dice.0.u8(0..4) >= glass {
                return dice.material();
            }
            let glass = Glass::new(dice.color(), dice.within(0.7, 1.8)).unwrap();
            Material::finished(Coefficients::default(), Finish { glass: Some(glass), ..Finish::default() })
        };
        (0..count)
            .map(|_| {
                let material = material(self);
                self.any(material)
            })
            .collect()
    }

    /// Returns an object of any kind of this material, in a group or not.
    pub(crate) fn any(&mut self, material: Material) -> Object {
        let (at, about) = (self.point(3.0), self.point(1.0));
        let end = at + self.within(0.2, 2.0) / about.length() * about;
        let radius = self.within(0.2, 0.9);
        let floor = DVec3::new(0.0, -2.0, 0.0);
        let object: Object = match self.0.u8(0..8) {
            0 => Disc::new(radius, at, about, material).unwrap().into(),
            1 => Cylinder::new(radius, [at, end], material).unwrap().into(),
            2 => Cone::new([radius, 0.3], [at, end], material).unwrap().into(),
            3 => Torus::new(radius, 0.4 * radius, at, about, material).unwrap().into(),
            4 => Plane::new(floor, DVec3::new(0.137, 1.0, 0.0713), material).unwrap().into(),
            5 => Sphere::new(radius, at, material).unwrap().into(),
            6 => Cuboid::new([at, end], material).unwrap().into(),
            _ => Triangle::new([at, end, at + self.point(1.5)], material).unwrap().into(),
        };
        if self.0.u8(0..3) == 0 { placed(self, object) } else { object }
    }

    /// Adds lamps to the suns of a scene.
    pub(crate) fn add_lamps(&mut self, scene: &mut Scene) {
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

/// Returns the object in a group of one, moved, rotated and scaled.
pub(crate) fn placed(dice: &mut Dice, object: Object) -> Object {
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

pub(crate) fn draw(scene: &Scene, options: RenderOptions) -> RgbImage {
    render(scene, &options).unwrap()
}

pub(crate) fn levels() -> Vec<(&'static str, Level)> {
    let best = Level::new();
    let mut levels = vec![("the best", best)];
    #[cfg(target_arch = "x86_64")]
    {
        levels.extend(best.as_avx2().map(|level| ("AVX2", Level::Avx2(level))));
        levels.extend(best.as_sse4_2().map(|level| ("SSE4.2", Level::Sse4_2(level))));
    }
    levels
}

/// Returns the number of pixels that are off by more than one level in a channel.
pub(crate) fn off(a: &RgbImage, b: &RgbImage) -> usize {
    assert_eq!(a.dimensions(), b.dimensions());
    a.pixels().zip(b.pixels()).filter(|(p, q)| (0..3).any(|c| p[c].abs_diff(q[c]) > 1)).count()
}

/// Compares the packets with the plain tracer, and with each other: all precisions, all instruction sets, any tile and
/// tree.
pub(crate) fn hold(scenes: &[Scene]) {
    let (mut differ, mut pixels) = (0, 0);
    for (number, scene) in scenes.iter().enumerate() {
        let expected = reference::render(scene, &RenderOptions::default()).unwrap();
        let mut before = None;
        for precision in [Precision::Auto, Precision::F32, Precision::F64] {
            let options = RenderOptions { precision, ..Default::default() };
            let drawn = draw(scene, options);
            // An equal picture needs no second comparison.
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

pub(crate) fn scripted(view: &str, objects: &str) -> Scene {
    let text = format!("{view}\n{objects}\nTrace\n");
    let parsed = parse("scene.txt", text.as_bytes(), &Limits::default());
    let script = parsed.script.unwrap_or_else(|| panic!("{text}\n{:?}", parsed.diagnostics));
    script.frame(0).unwrap()
}

/// Checks that a scene with a `Look` has the same picture in units of any power of two.
pub(crate) fn check_powers_of_two(scene: &Scene) {
    let Camera::Look(look) = scene.camera else { return };
    let expected = draw(scene, RenderOptions::default());
    for exponent in [-300, -9, 7, 300] {
        let scale = 2f64.powi(exponent);
        let mut scaled = scene.clone();
        scaled.objects = scene.objects.iter().map(|o| o.placed(scale, |p| scale * p).unwrap()).collect();
        let (eye, target) = (scale * look.eye(), scale * look.target());
        scaled.camera = Camera::Look(Look::new(eye, target, look.field_of_view(), Some(look.up())).unwrap());
        assert!(expected == draw(&scaled, RenderOptions::default()), "2^{exponent}");
    }
}
