//! The picture does not depend on the instruction set, the tile, the tree or the threads, and equals the reference's.
//!
//! Scenes are random; a failure prints the seed. `RAYFOLD_SEED` sets another one.

use std::path::Path;

use glam::{DVec2, DVec3};
use image::RgbImage;
use rayfold_scene::{
    Camera, Cuboid, DirectionalLight, Light, Limits, Material, Object, Pinhole, Scene, Screen, Sphere,
    Triangle, parse,
};
use rayfold_tracer::{Level, Precision, RenderOptions, reference, render};

use super::dice::Dice;

/// The share of pixels at outlines that rounding may assign to another object.
const ISOLATED: f64 = 1e-4;

const SEED: u64 = 20_261_121;

impl Dice {
    fn plain_object(&mut self, kinds: u8) -> Object {
        let at = self.point(3.0);
        let material = self.material();
        match self.0.u8(0..kinds) {
            0 => Object::Sphere(Sphere::new(self.within(0.1, 0.8), at, material).unwrap()),
            1 => {
                let material = Material::new(material.ambient(), material.diffuse(), DVec3::ZERO).unwrap();
                Object::Cuboid(Cuboid::new([at, at + self.point(0.8)], material).unwrap())
            }
            _ => {
                let material = Material::new(material.ambient(), material.diffuse(), DVec3::ZERO).unwrap();
                let vertices = [at, at + self.point(1.5), at + self.point(1.5)];
                Object::Triangle(Triangle::new(vertices, material).unwrap())
            }
        }
    }

    fn plain_scene(&mut self, objects: usize, kinds: u8) -> Scene {
        let eye = self.point(1.0).normalize() * 9.0;
        let corner = DVec2::splat(0.5);
        let camera = Pinhole::new(eye, self.point(0.5) - eye, self.point(1.0), 1.0, -corner, corner).unwrap();
        let screen = Screen::new(self.0.u32(90..140), self.0.u32(90..140)).unwrap();
        let mut scene = Scene::new(screen, Camera::Pinhole(camera));
        scene.set_background(self.color()).unwrap();
        scene.objects = (0..objects).map(|_| self.plain_object(kinds)).collect();
        let lights = self.0.usize(0..4);
        scene.lights = (0..lights)
            .map(|_| Light::Directional(DirectionalLight::new(0.6 * self.color(), self.point(1.0)).unwrap()))
            .collect();
        scene
    }

    /// Returns scenes for every kernel.
    fn scenes(&mut self) -> Vec<Scene> {
        [(1, 1), (5, 1), (12, 2), (20, 3), (60, 3), (300, 3), (400, 1)]
            .map(|(n, kinds)| self.plain_scene(n, kinds))
            .into()
    }
}

fn draw(scene: &Scene, options: RenderOptions) -> RgbImage {
    render(scene, &options).unwrap()
}

/// Returns the share of the pixels that are off by more than one level in a channel.
fn off(a: &RgbImage, b: &RgbImage) -> f64 {
    off_by_more_than(1, a, b) as f64 / a.pixels().len() as f64
}

fn off_by_more_than(levels: u8, a: &RgbImage, b: &RgbImage) -> usize {
    assert_eq!(a.dimensions(), b.dimensions());
    a.pixels().zip(b.pixels()).filter(|(p, q)| (0..3).any(|c| p[c].abs_diff(q[c]) > levels)).count()
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

#[test]
fn widths_with_fused_multiply_add_agree_bit_for_bit_and_others_but_for_isolated_pixels() {
    let (mut differ, mut pixels) = (0.0, 0.0);
    for scene in Dice::new("widths", SEED).scenes() {
        for precision in [Precision::F32, Precision::F64] {
            let options = RenderOptions { precision, ..Default::default() };
            let best = draw(&scene, options);
            for (name, level) in levels() {
                let other = draw(&scene, RenderOptions { level: Some(level), ..options });
                if name == "SSE4.2" {
                    let share = off(&best, &other);
                    assert!(share <= 2.0 * ISOLATED, "{name} {precision:?}: {share}");
                    differ += off_by_more_than(1, &best, &other) as f64;
                    pixels += best.pixels().len() as f64;
                } else {
                    assert!(best == other, "{name} {precision:?}");
                }
            }
        }
    }
    println!("{differ} of {pixels} pixels differ without fused multiply-add");
    assert!(differ <= ISOLATED * pixels, "{differ} of {pixels}");
}

/// Returns one frame of each animation in `scenes/`.
fn examples() -> Vec<(&'static str, Scene)> {
    let frames = [
        ("sphere_light", "frame04"),
        ("moving_up", "frame03"),
        ("artistic", "frame08"),
        ("artisticsss", "frame15"),
        ("hello", "frame17"),
    ];
    frames
        .map(|(folder, frame)| {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").join(folder);
            let text = std::fs::read(path.join(format!("{frame}.txt"))).unwrap();
            let script = parse(frame, &text, &Limits::default()).script.unwrap();
            (folder, script.frame(0).unwrap())
        })
        .into()
}

#[test]
fn the_five_scenes_are_as_in_double_precision_at_any_size() {
    for (name, mut scene) in examples() {
        assert_eq!(rayfold_tracer::precision(&scene), Precision::F32, "{name} is no scene for f64");
        for (width, height) in [(97, 61), (400, 400), (640, 360), (1024, 1024)] {
            scene.screen = Screen::new(width, height).unwrap();
            let exact = draw(&scene, RenderOptions { precision: Precision::F64, ..Default::default() });
            for (width_name, level) in levels() {
                let drawn = draw(&scene, RenderOptions { level: Some(level), ..Default::default() });
                let differ = off_by_more_than(2, &exact, &drawn);
                println!("{name} at {width} x {height} on {width_name}: {differ} pixels");
                assert!(differ as f64 <= ISOLATED * exact.pixels().len() as f64, "{name}: {differ} pixels");
            }
        }
    }
}

#[test]
fn no_dark_dot_is_seen_at_the_outline_of_a_body() {
    // The back of the crystal, between its front and the sky.
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/artistic/frame12.txt");
    let script = parse("frame12", &std::fs::read(path).unwrap(), &Limits::default()).script.unwrap();
    let scene = script.frame(0).unwrap();
    let exact = draw(&scene, RenderOptions { precision: Precision::F64, ..Default::default() });
    let drawn = draw(&scene, RenderOptions { precision: Precision::F32, ..Default::default() });
    let is_near = |x: u32, y: u32| {
        let pixel = drawn.get_pixel(297, 167);
        (0..3).all(|channel| pixel[channel].abs_diff(exact.get_pixel(x, y)[channel]) <= 16)
    };
    assert!((296..299).any(|x| (166..169).any(|y| is_near(x, y))), "{:?}", drawn.get_pixel(297, 167));
}

#[test]
fn needles_finer_than_pixels_are_told_apart_as_in_double_precision() {
    let mut dice = Dice::new("needles", SEED);
    for needles in [300, 3_000, 30_000] {
        let look = rayfold_scene::Look::new(DVec3::new(0.2, 0.3, 6.0), DVec3::ZERO, 40.0, None).unwrap();
        let mut scene = Scene::new(Screen::new(160, 120).unwrap(), Camera::Look(look));
        let rim = |k: u32| {
            let angle = std::f64::consts::TAU * f64::from(k % needles) / f64::from(needles);
            DVec3::new(1.9 * angle.cos(), 1.9 * angle.sin(), 0.3 * angle.sin())
        };
        scene.objects = (0..needles)
            .map(|k| {
                let material = Material::new(dice.color(), DVec3::ZERO, DVec3::ZERO).unwrap();
                let corners = [DVec3::new(0.1, 0.07, 0.0), rim(k), rim(k + 1)];
                Object::Triangle(Triangle::new(corners, material).unwrap())
            })
            .collect();
        let exact = draw(&scene, RenderOptions { precision: Precision::F64, ..Default::default() });
        let drawn = draw(&scene, RenderOptions { precision: Precision::F32, ..Default::default() });
        let differ = off_by_more_than(2, &exact, &drawn);
        println!("{needles} needles: {differ} pixels");
        assert!(differ <= 1, "{needles} needles: {differ} pixels");
    }
}

#[test]
fn a_face_seen_edge_on_is_met_by_the_middle_column_and_a_level_one_by_no_row() {
    let read =
        |text: &str| parse("edge.txt", text.as_bytes(), &Limits::default()).script.unwrap().frame(0).unwrap();
    let each = |text: &str, pixel: (u32, u32), is_met: bool| {
        let scene = read(text);
        for precision in [Precision::F32, Precision::F64] {
            let drawn = draw(&scene, RenderOptions { precision, ..Default::default() });
            assert_eq!(drawn.get_pixel(pixel.0, pixel.1)[0] == 255, is_met, "{precision:?} {text}");
        }
        let plain = reference::render(&scene, &RenderOptions::default()).unwrap();
        assert_eq!(plain.get_pixel(pixel.0, pixel.1)[0] == 255, is_met, "{text}");
    };
    for width in (3..120).step_by(2) {
        let middle = width / 2;
        // A box without thickness in the plane of the eye, along the view direction: its face is edge-on.
        let face = "Box 0 -1 -3  0 1 3  1 0 0  0 0 0";
        for camera in [
            "Camera 0 0.2 6  0 -0.1 -1  0 1 0  1  -0.3 -0.225  0.3 0.225",
            "Camera 0 0.2 6  0 0 -1  0 1 0  1.7  -0.41 -0.3  0.41 0.3",
            "Look 0 0.2 6  0 0 0  37",
        ] {
            each(&format!("Screen {width} 21\n{camera}\n{face}\nTrace"), (middle, 10), true);
        }
        // A horizontal view direction, not along an axis, above and below planes that are parallel to it.
        for level in [
            "Plane 0 0 0  0 1 0  1 0 0  0 0 0",
            "Box -90 -1 -90  90 0 90  1 0 0  0 0 0",
            "Triangle -900 0 -90  900 0 -90  0 0 900  1 0 0  0 0 0",
        ] {
            let camera = "Look 1.3 0.7 4.1  -0.4 0.7 -0.9  40";
            for i in [0, 3, middle] {
                each(&format!("Screen 101 {width}\n{camera}\n{level}\nTrace"), (i, middle), false);
            }
        }
    }
}

/// Regression test: letters on a floor of a million units took minutes, because each shadow was decided exactly.
#[test]
fn many_small_triangles_in_a_large_scene_are_drawn_in_double() {
    let chosen = |count: u32, floor: f64, light: &str| {
        let triangles: String =
            (0..count).map(|k| format!("Triangle {k} 0 0 {k}.5 0 0 {k} .5 0 1 0 0 0 1 0\n")).collect();
        let script = format!(
            "Screen 32 24\nLook 0 1 5 0 0 0 40\n{light}\n{triangles}Box -{floor} -2 -{floor} {floor} -1 {floor} 1 0 0 0 1 0\n\
             Trace\n"
        );
        let script = parse("small.txt", script.as_bytes(), &Limits::default()).script.unwrap();
        rayfold_tracer::precision(&script.frame(0).unwrap())
    };
    let sun = "Ilight 1 1 1 -1 -2 -1";
    assert_eq!(chosen(100, 1e6, sun), Precision::F64);
    assert_eq!(chosen(100, 1e3, sun), Precision::F32, "the scene is not so large");
    assert_eq!(chosen(20, 1e6, sun), Precision::F32, "they are few");
    assert_eq!(chosen(100, 1e6, ""), Precision::F32, "there is no shadow");
}

#[test]
fn surfaces_that_single_precision_cannot_tell_apart_are_drawn_in_double() {
    const NOTE: &str = "-1 -1 {z} 1 -1 {z} 0 1 {z}";
    const SLANT: &str = "-1 -1 {x} 1 -1 {z} 0 1 {y}";
    let red = "0.5 0 0  0 0 0";
    let (near, far) = (Precision::F64, Precision::F32);
    let chosen = |objects: &str| {
        let view = "Screen 320 240\nCamera 0 0 5  0 0 -1  0 1 0  1  -0.4 -0.3  0.4 0.3\n";
        let script = format!("{view}{objects}\nIlight 0.8 0.8 0.8  1 -1 -0.5\nTrace\n");
        let script = parse("near.txt", script.as_bytes(), &Limits::default()).script.unwrap();
        rayfold_tracer::precision(&script.frame(0).unwrap())
    };
    let at = |shape: &str, x: f64, y: f64, z: f64| {
        let place = |name: &str, value: f64| (name.to_owned(), format!("{value:?}"));
        [place("{x}", x), place("{y}", y), place("{z}", z)]
            .iter()
            .fold(shape.to_owned(), |text, (name, value)| text.replace(name, value))
    };
    for (gap, expected) in [(1e-7, near), (1e-5, far), (0.0, far)] {
        let green = "0 0.5 0  0 0 0";
        let pairs = [
            ("in a plane of the axes", at(NOTE, 0.0, 0.0, 0.0), at(NOTE, 0.0, 0.0, gap)),
            ("slanted", at(SLANT, 0.1, 0.4, 0.2), at(SLANT, 0.1 + gap, 0.4 + gap, 0.2 + gap)),
        ];
        for (name, one, other) in pairs {
            let objects = format!("Triangle {one} {red}\nTriangle {other} {green}");
            assert_eq!(chosen(&objects), expected, "{name}, {gap} apart");
            let objects = format!("Triangle {one} {red}\nTriangle {other} {red}");
            assert_eq!(chosen(&objects), far, "{name}, {gap} apart, of one colour");
            // The same triangles among many objects, found by a tree.
            let balls: String = (0..100).map(|k| format!("Sphere 0.01 {k} 3 -9 {red}\n")).collect();
            let objects = format!("Triangle {one} {red}\n{balls}Triangle {other} {green}");
            assert_eq!(chosen(&objects), expected, "{name}, {gap} apart, among many");
        }
        let objects = format!("Sphere 1  0 0 0 {red}\nSphere {:?}  0 0 0 {green}", 1.0 + gap);
        assert_eq!(chosen(&objects), expected, "spheres, {gap} apart");
    }
    for (height, expected) in [(1e-5, near), (1e-2, far)] {
        let objects =
            format!("Box -2 -2 -1  2 2 0 {red}\nTriangle -1 -1 {height:?}  1 -1 0  0 1 0  0 0.5 0  0 0 0");
        assert_eq!(chosen(&objects), expected, "on a box, one corner raised by {height}");
    }
    // Neighbours that share an edge, or are separate in one plane, do not shadow each other.
    for other in ["1 -1 0  3 1 0  0 1 1e-7", "2 -1 1e-7  4 -1 1e-7  3 1 1e-7"] {
        let objects = format!("Triangle -1 -1 0  1 -1 0  0 1 0 {red}\nTriangle {other} 0 0.5 0  0 0 0");
        assert_eq!(chosen(&objects), far, "{other}");
    }
}

#[test]
fn a_surface_is_not_in_the_shadow_of_what_touches_it_with_a_corner() {
    // Column 0 and row 24 show a corner of the triangle, which touches the box.
    let script = "Screen 33 33\nCamera 8 0 0  -1 0 0  0 1 0  1  -0.5 -0.5  0.5 0.5\nIlight 0.5 0.5 0.5  -1 -1 -1\n\
                  Box 4 2 -1  3 -3 3  0 0 0.2  0.4 0.6 0.1\nTriangle 0 -4 0  4 -1 2  -1 -3 -1  0.2 0.1 0.2  0.4 0.2 0.4\n\
                  Trace\n";
    let scene = parse("corner.txt", script.as_bytes(), &Limits::default()).script.unwrap().frame(0).unwrap();
    let expected = rayfold_tracer::reference::render(&scene, &RenderOptions::default()).unwrap();
    for precision in [Precision::F32, Precision::F64] {
        for tile in [(4, 4), (16, 16), (64, 4)] {
            let drawn = draw(&scene, RenderOptions { precision, tile: Some(tile), ..Default::default() });
            assert_eq!(drawn.get_pixel(0, 24), expected.get_pixel(0, 24), "{precision:?}, tiles of {tile:?}");
        }
    }
}

#[test]
fn a_ray_that_starts_on_a_sphere_sees_it_from_within() {
    // 5² + 12² = 13²: the rays of four pixels start exactly on the sphere, and those of four others touch it.
    let script = "Screen 27 27\nBackground 1 1 1\nSphere 13  13 13 -12  0 0 0  0.2 0.4 0.5  0.2 0.4 0.6\n\
                  Ilight 1 1 1  -0.6 -0.5 0.8\nTrace\n";
    let scene = parse("on.txt", script.as_bytes(), &Limits::default()).script.unwrap().frame(0).unwrap();
    let plain = reference::render(&scene, &RenderOptions::default()).unwrap();
    for precision in [Precision::F32, Precision::F64] {
        let image = draw(&scene, RenderOptions { precision, ..Default::default() });
        assert_eq!(off_by_more_than(1, &image, &plain), 0, "{precision:?}");
    }
}

#[test]
fn tiles_trees_and_threads_cannot_be_seen() {
    for scene in Dice::new("tiles", SEED).scenes() {
        for precision in [Precision::F32, Precision::F64] {
            let options = RenderOptions { precision, ..Default::default() };
            let expected = draw(&scene, options);
            for tile in [(4, 4), (8, 8), (32, 8), (64, 4)] {
                let tile = Some(tile);
                assert!(expected == draw(&scene, RenderOptions { tile, ..options }), "tiles of {tile:?}");
            }
            for tree in [Some(true), Some(false)] {
                assert!(
                    expected == draw(&scene, RenderOptions { tree, ..options }),
                    "{tree:?} {precision:?}"
                );
            }
            let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
            assert!(expected == alone.install(|| draw(&scene, options)), "one thread");
        }
    }
}

#[test]
fn the_reference_draws_the_same() {
    let mut dice = Dice::new("reference", SEED);
    let mut scenes = dice.scenes();
    let orthographic = |scene: &Scene| {
        let mut scene = scene.clone();
        scene.camera = Camera::Orthographic;
        let place = |p: DVec3| p * 20.0 + DVec3::new(50.0, 50.0, -100.0);
        scene.objects = scene.objects.iter().map(|object| object.placed(20.0, place).unwrap()).collect();
        scene
    };
    scenes.extend(scenes.iter().map(orthographic).collect::<Vec<_>>());
    for precision in [Precision::F32, Precision::F64] {
        let (mut differ, mut pixels) = (0.0, 0.0);
        for scene in &scenes {
            let expected = reference::render(scene, &RenderOptions::default()).unwrap();
            let drawn = draw(scene, RenderOptions { precision, ..Default::default() });
            let share = off(&expected, &drawn);
            differ += share * expected.pixels().len() as f64;
            pixels += expected.pixels().len() as f64;
        }
        println!("{precision:?}: {differ} of {pixels} pixels are off by more than one level");
        assert!(differ <= 4.0 * ISOLATED * pixels, "{precision:?}: {differ} of {pixels}");
    }
}

#[test]
fn a_scene_without_objects_is_its_background() {
    for screen in [(1, 1), (1, 50), (33, 17)] {
        let mut scene = Scene::new(Screen::new(screen.0, screen.1).unwrap(), Camera::Orthographic);
        scene.set_background(DVec3::new(0.1, 0.5, 0.9)).unwrap();
        for tree in [None, Some(true)] {
            let image = draw(&scene, RenderOptions { tree, ..Default::default() });
            assert!(image.pixels().all(|pixel| pixel.0 == [26, 128, 230]));
        }
    }
}
