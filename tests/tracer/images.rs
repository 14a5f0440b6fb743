//! Pictures on surfaces: places and factors, as the language defines them, in the packets and in the plain tracer, in groups and on
//! meshes.
//!
//! Scenes are random; a failure prints the seed. `RAYFOLD_SEED` sets another one.

use std::io::Cursor;
use std::sync::{Arc, LazyLock};

use glam::DVec3;
use image::{DynamicImage, ImageFormat, Rgba};
use rayfold_scene::assets::{Library, MemoryFiles, Picture, Purpose};
use rayfold_scene::model::Finish;
use rayfold_scene::{
    Axes, Camera, Coefficients, Image, ImageMap, Limits, Material, PictureFile, Scene, Tone, parse_with_files,
};
use rayfold_tracer::{Drawing, RenderOptions, render};

use super::dice::Dice;
use super::hold::hold;

const SEED: u64 = 20_261_128;

/// A square of two triangles whose texture coordinates are those of a whole picture, and with others beyond one.
const SQUARE: &str =
    "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
const BEYOND: &str = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt -1 .5\nvt 2 .2\nvt 2 3\nvt -.5 2\nvn .3 0 1\nf 1/1/1 2/2 3/3/1 4/4\n";

/// The square as glTF, with (0, 0) in the upper left corner of the picture.
fn gltf() -> Vec<u8> {
    let numbers: Vec<f32> = [
        [-1.0, -1.0, 0.0, 1.0, -1.0, 0.0, 1.0, 1.0, 0.0, -1.0, 1.0, 0.0].as_slice(),
        &[0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0],
    ]
    .concat();
    let mut bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend([0u8, 1, 2, 0, 2, 3, 0, 0]);
    let json = br#"{"asset":{"version":"2.0"},"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0,
"TEXCOORD_0":1},"indices":2}]}],"accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},{"bufferView":1,
"componentType":5126,"count":4,"type":"VEC2"},{"bufferView":2,"componentType":5121,"count":6,"type":"SCALAR"}],"bufferViews":[{
"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":32},{"buffer":0,"byteOffset":80,"byteLength":6}],"buffers":[{
"byteLength":88}]}"#;
    let mut json = json.to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut file = b"glTF\x02\0\0\0".to_vec();
    file.extend((28 + json.len() as u32 + bytes.len() as u32).to_le_bytes());
    for (kind, part) in [(b"JSON", &json), (b"BIN\0", &bytes)] {
        file.extend((part.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(part);
    }
    file
}

static LIBRARY: LazyLock<Library> = LazyLock::new(|| {
    let png = |width, height, level: fn(u32, u32) -> [u8; 4]| {
        let image = image::RgbaImage::from_fn(width, height, |x, y| Rgba(level(x, y)));
        let mut bytes = Cursor::new(Vec::new());
        DynamicImage::from(image).write_to(&mut bytes, ImageFormat::Png).unwrap();
        bytes.into_inner()
    };
    Library::new(MemoryFiles::from([
        ("small.png", png(4, 2, |x, y| [x as u8 * 60, y as u8 * 200, 30, 255 - x as u8 * 50])),
        (
            "large.png",
            png(90, 70, |x, y| [(x * 5 % 256) as u8, (y * 11 % 256) as u8, ((x + y) % 200) as u8, 255]),
        ),
        ("square.obj", SQUARE.into()),
        ("square.glb", gltf()),
        ("beyond.obj", BEYOND.into()),
    ]))
});

fn picture(name: &str) -> Arc<Picture> {
    LIBRARY.picture(name, Purpose::Surface).unwrap()
}

fn scene(lines: &str) -> Scene {
    let text = format!("Screen 33 33\n{lines}\nTrace\n");
    let parsed = parse_with_files("images", text.as_bytes(), &Limits::default(), &LIBRARY);
    parsed.script.unwrap_or_else(|| panic!("{text}\n{:?}", parsed.diagnostics)).frame(0).unwrap()
}

/// Returns the factors of ambient light along a ray through an object.
fn factor(way: &str, object: &str, from: DVec3, to: DVec3) -> DVec3 {
    let up = if (to - from).normalize().y.abs() > 0.9 { "0 0 -1" } else { "0 1 0" };
    let scene = scene(&format!(
        "Screen 1 1\nTone srgb\nMaterial m ambient 1 1 1 image {way}\n{object} m\nLook {} {} {} {} {} {} 1e-6 {up}",
        from.x, from.y, from.z, to.x, to.y, to.z
    ));
    let light = Drawing::new(&scene, &RenderOptions::default()).unwrap().draw_light().unwrap();
    DVec3::new(light[0].into(), light[1].into(), light[2].into())
}

fn assert_near(found: DVec3, expected: DVec3, what: &str) {
    assert!((found - expected).abs().max_element() < 1e-5, "{what}: {found} is not {expected}");
}

#[test]
fn the_middles_of_pixels_have_their_factors() {
    let small = picture("small.png");
    for (column, row) in (0..8).map(|k| (k % 4, k / 4)) {
        let expected = small.factor(column, row, true);
        let (u, up) = ((f64::from(column) + 0.5) / 4.0, 1.0 - (f64::from(row) + 0.5) / 2.0);
        let what = format!("{column} {row}");
        // A picture of 2 to 1: 2 wide and 1 high. It repeats.
        let at = DVec3::new(2.0 * u + 2.0, up - 3.0, 0.0);
        let plane = "Disc 50 0 0 0 0 0 1";
        assert_near(factor("\"small.png\" flat 2", plane, at + DVec3::Z, at), expected, &what);
        let at = DVec3::new(2.0 * u - 4.0, 0.0, -up);
        let floor = "Plane 0 0 0 0 1 0";
        assert_near(factor("\"small.png\" flat 2 xz", floor, at + DVec3::Y, at), expected, &what);
        let at = DVec3::new(0.0, up, 2.0 * u);
        let wall = "Disc 50 0 0 0 1 0 0";
        assert_near(factor("\"small.png\" flat 2 zy", wall, at - DVec3::X, at), expected, &what);
        // From outside of a ball, right is right.
        let (longitude, angle) = ((u - 0.5) * std::f64::consts::TAU, (1.0 - up) * std::f64::consts::PI);
        let way = DVec3::new(longitude.sin() * angle.sin(), angle.cos(), longitude.cos() * angle.sin());
        let center = DVec3::new(3.0, -1.0, 2.0);
        assert_near(
            factor("\"small.png\" ball", "Sphere 2 3 -1 2", center + 5.0 * way, center),
            expected,
            &what,
        );
        assert_near(
            factor("\"small.png\" ball", "Box -1 -1 -1 1 1 1", 5.0 * way, DVec3::ZERO),
            expected,
            &what,
        );
        for square in ["Mesh \"square.obj\"", "Mesh \"square.glb\""] {
            let at = DVec3::new(2.0 * u - 1.0, 2.0 * up - 1.0, 0.0);
            assert_near(factor("\"small.png\" uv", square, at + DVec3::Z, at), expected, square);
        }
    }
}

#[test]
fn factors_between_pixels_are_interpolated() {
    let small = picture("small.png");
    let at = DVec3::new(1.75 / 2.0, 0.6, 0.0);
    let seen = factor("\"small.png\" flat 2", "Disc 50 0 0 0 0 0 1", at + DVec3::Z, at);
    // 1.75/4 across is a quarter behind the second middle; .4 down is 15/100 of a row behind the first one.
    let row = |row| 0.75 * small.factor(1, row, true) + 0.25 * small.factor(2, row, true);
    assert_near(seen, 0.7 * row(0) + 0.3 * row(1), "between");
    // The seam.
    let seen = factor(
        "\"small.png\" flat 2",
        "Disc 50 0 0 0 0 0 1",
        DVec3::new(0.0, 0.75, 1.0),
        DVec3::new(0.0, 0.75, 0.0),
    );
    assert_near(seen, 0.5 * (small.factor(3, 0, true) + small.factor(0, 0, true)), "the seam");
    // Beyond the first and the last row of a ball there is nothing else.
    let pole = factor("\"small.png\" ball", "Sphere 1 0 0 0", DVec3::new(0.0, 5.0, 1e-9), DVec3::ZERO);
    assert!((pole.y - small.factor(0, 0, true).y).abs() < 1.0);
}

#[test]
fn a_picture_moves_with_its_group() {
    let small = picture("small.png");
    let scene = scene(
        "Screen 1 1\nTone srgb\nMaterial m ambient 1 1 1 image \"small.png\" flat 2\nGroup g\nDisc 50 0 0 0 0 0 1 m\nEnd\n\
         Use g 1 2 3 0 90 0 2\nLook 9 3.5 2.5 1 3.5 2.5 1e-6",
    );
    let light = Drawing::new(&scene, &RenderOptions::default()).unwrap().draw_light().unwrap();
    let seen = DVec3::new(light[0].into(), light[1].into(), light[2].into());
    // Turned by 90 degrees around y, +x of the group is -z: (.25, .75) of the group's numbers.
    assert_near(seen, small.factor(0, 0, true), "in a group");
}

#[test]
fn a_pattern_of_one_colour_is_that_colour() {
    let mesh = "Ilight 1 1 1 -1 -2 -3\nLook 0 0 5 0 0 0 40";
    let drawn = |lines: &str| render(&scene(&format!("{mesh}\n{lines}")), &RenderOptions::default()).unwrap();
    let plain = drawn("Material m ambient .1 .1 .1 diffuse .5 .5 .5\nMesh \"square.obj\" m");
    let pictured =
        drawn("Material m ambient .1 .1 .1 diffuse .5 .5 .5 image \"small.png\" uv\nMesh \"square.obj\" m");
    assert!(plain != pictured);
    let own = drawn(
        "Material m ambient .1 .1 .1 diffuse .5 .5 .5 own image \"small.png\" uv\nMesh \"square.obj\" m",
    );
    assert!(own != pictured, "the file's grey multiplies");
}

impl Dice {
    fn image(&mut self) -> Image {
        let name = ["small.png", "large.png"][self.0.usize(0..2)];
        let axes = [Axes::Xy, Axes::Xz, Axes::Zy][self.0.usize(0..3)];
        let map = if self.0.bool() { ImageMap::Ball } else { ImageMap::Flat(self.within(0.3, 3.0), axes) };
        Image::new(PictureFile::new(name, picture(name)), map).unwrap()
    }

    fn scene_with_pictures(&mut self, count: usize) -> Scene {
        let objects = (0..count)
            .map(|_| {
                let material = self.material();
                let coefficients =
                    Coefficients::new(0.3 * self.color(), material.diffuse(), material.mirror());
                let image = (self.0.u8(0..4) > 0).then(|| self.image());
                self.any(Material::finished(coefficients.unwrap(), Finish { image, ..Finish::default() }))
            })
            .collect();
        let mut scene = self.scene(objects);
        scene.tone = if self.0.bool() { Tone::Srgb } else { Tone::Plain };
        if scene.camera != Camera::Orthographic && self.0.bool() {
            self.add_lamps(&mut scene);
        }
        scene
    }
}

#[test]
fn the_packets_show_the_pictures_of_the_plain_tracer() {
    let mut dice = Dice::new("images", SEED);
    let counts = [1, 1, 2, 4, 8, 90].into_iter().flat_map(|count| [count; 5]);
    let scenes: Vec<Scene> = counts.map(|count| dice.scene_with_pictures(count)).collect();
    hold(&scenes);
}

#[test]
fn the_packets_show_the_pictures_of_meshes() {
    let stage =
        "Look 1 2 5 .013 0 0 40\nIlight .9 .8 .7 -1 -2 -3\nPlane 0 -1.2 0 0 1 0 .1 .1 .1 .3 .3 .3 .4 .4 .4";
    let mut scenes = Vec::new();
    for (way, mesh) in [
        ("uv", "square.obj"),
        ("uv", "square.glb"),
        ("uv", "beyond.obj"),
        ("ball", "beyond.obj"),
        ("flat .4 zy", "beyond.obj"),
    ] {
        for tone in ["plain", "srgb"] {
            for file in ["small.png", "large.png"] {
                let material =
                    format!("Material m ambient .2 .2 .2 diffuse .8 .8 .8 own image \"{file}\" {way}");
                let line = format!("Mesh \"{mesh}\" m");
                scenes.push(scene(&format!("Tone {tone}\n{stage}\n{material}\n{line}")));
                scenes.push(scene(&format!(
                    "Tone {tone}\n{stage}\n{material}\nGroup g\n{line}\nEnd\nUse g .3 .1 -.4 10 20 30 .8\nUse g -1 0 0 0 70 0"
                )));
            }
        }
    }
    hold(&scenes);
}
