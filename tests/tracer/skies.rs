//! Skies: the directions and levels of pictures, as the language defines them, in the packets and in the plain tracer, with
//! mirrors, glass, groups, samples, and hidden by `Background none`.
//!
//! Scenes are random; a failure prints the seed. `RAYFOLD_SEED` sets another one.

use std::io::Cursor;
use std::sync::{Arc, LazyLock};

use glam::DVec3;
use image::{DynamicImage, ImageFormat, Rgb};
use rayfold_scene::assets::{Library, MemoryFiles, Picture, Purpose};
use rayfold_scene::{
    Background, Camera, Limits, PictureFile, Scene, Sky, SkyColors, SkyTurn, Tone, parse_with_files,
};
use rayfold_tracer::{Drawing, Exposure, Precision, RenderOptions, reference};

use super::dice::Dice;
use super::hold::hold;

const SEED: u64 = 20_261_127;

/// The share of pixels at outlines that rounding may assign to another object.
const ISOLATED: f64 = 1e-3;

/// A panorama of 4 x 2 pixels, no two alike; a large one; and one of light.
static LIBRARY: LazyLock<Library> = LazyLock::new(|| {
    let png = |width, height, level: fn(u32, u32) -> [u8; 3]| {
        let image = image::RgbImage::from_fn(width, height, |x, y| Rgb(level(x, y)));
        let mut bytes = Cursor::new(Vec::new());
        DynamicImage::from(image).write_to(&mut bytes, ImageFormat::Png).unwrap();
        bytes.into_inner()
    };
    let mut light = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 3 +X 5\n".to_vec();
    light.extend((0..15u8).flat_map(|k| [10 * k, 255 - 9 * k, 40 + k, 124 + k]));
    Library::new(MemoryFiles::from([
        ("eight.png", png(4, 2, |x, y| [x as u8 * 60, y as u8 * 200, 30])),
        (
            "large.png",
            png(200, 100, |x, y| [(x * 5 % 256) as u8, (y * 11 % 256) as u8, ((x + y) % 200) as u8]),
        ),
        ("light.hdr", light),
    ]))
});

fn picture(name: &str) -> Arc<Picture> {
    LIBRARY.picture(name, Purpose::Sky).unwrap()
}

fn scene(lines: &str) -> Scene {
    let text = format!("Screen 32 24\n{lines}\nTrace\n");
    let parsed = parse_with_files("skies", text.as_bytes(), &Limits::default(), &LIBRARY);
    parsed.script.unwrap_or_else(|| panic!("{:?}", parsed.diagnostics)).frame(0).unwrap()
}

/// Returns what a ray sees straight ahead: the middle of a picture of one pixel.
fn ahead(sky: &str, target: [f64; 3]) -> DVec3 {
    let [x, y, z] = target;
    let up = if x == 0.0 && z == 0.0 { "1 0 0" } else { "0 1 0" };
    let scene = scene(&format!("Screen 1 1\nTone srgb\nSky {sky}\nLook 0 0 0 {x} {y} {z} 1e-6 {up}"));
    let light = Drawing::new(&scene, &RenderOptions::default()).unwrap().draw_light().unwrap();
    DVec3::new(light[0].into(), light[1].into(), light[2].into())
}

/// Returns the unit direction to a place on a panorama, from the language reference.
fn towards(u: f64, v: f64, turn: f64) -> [f64; 3] {
    let (longitude, angle) = ((u - 0.5) * 360.0 - turn, v * 180.0);
    let (longitude, angle) = (longitude.to_radians(), angle.to_radians());
    [longitude.sin() * angle.sin(), angle.cos(), -longitude.cos() * angle.sin()]
}

#[test]
fn the_middles_of_pixels_have_their_levels() {
    let picture = picture("eight.png");
    for turn in [0.0, 90.0, -37.5, 720.0] {
        for (column, row) in (0..8).map(|k| (k % 4, k / 4)) {
            let direction = towards((f64::from(column) + 0.5) / 4.0, (f64::from(row) + 0.5) / 2.0, turn);
            let seen = ahead(&format!("\"eight.png\" 1 {turn}"), direction);
            let level = picture.level(column, row, true);
            assert!((seen - level).abs().max_element() < 1e-6, "{turn} {column} {row}: {seen} {level}");
        }
    }
}

#[test]
fn the_middle_is_at_negative_z_and_right_is_positive_x() {
    let picture = picture("eight.png");
    let mean =
        |a: (u32, u32), b: (u32, u32)| 0.5 * (picture.level(a.0, a.1, true) + picture.level(b.0, b.1, true));
    let near = |seen: DVec3, level: DVec3| (seen - level).abs().max_element() < 1e-6;
    let all: DVec3 = [(1, 0), (2, 0), (1, 1), (2, 1)].iter().map(|p| picture.level(p.0, p.1, true)).sum();
    assert!(near(ahead("\"eight.png\"", [0.0, 0.0, -1.0]), 0.25 * all));
    let right =
        0.25 * [(2, 0), (3, 0), (2, 1), (3, 1)].iter().map(|p| picture.level(p.0, p.1, true)).sum::<DVec3>();
    assert!(near(ahead("\"eight.png\"", [1.0, 0.0, 0.0]), right));
    // Turned by a quarter, as Blender shows it, the middle is at +x.
    assert!(near(ahead("\"eight.png\" 1 -90", [1.0, 0.0, 0.0]), 0.25 * all));
    // Above is the top row, whatever the longitude; the seam joins the last column and the first.
    let top = ahead("\"eight.png\"", [0.0, 1.0, 0.0]);
    assert!(near(top * DVec3::Y, picture.level(0, 0, true) * DVec3::Y));
    let seam = 0.5 * (mean((3, 0), (0, 0)) + mean((3, 1), (0, 1)));
    assert!(near(ahead("\"eight.png\"", [0.0, 0.0, 1.0]), seam));
    // A quarter of the way between two middles.
    let between = towards(1.75 / 4.0, 0.25, 0.0);
    let expected = 0.75 * picture.level(1, 0, true) + 0.25 * picture.level(2, 0, true);
    assert!(near(ahead("\"eight.png\"", between), expected));
}

#[test]
fn strength_multiplies_and_light_is_not_decoded() {
    let middle = towards(0.5, 0.5, 0.0);
    let level = picture("light.hdr").level(2, 1, false);
    for tone in ["plain", "srgb"] {
        let scene = scene(&format!(
            "Screen 1 1\nTone {tone}\nSky \"light.hdr\" .01\nLook 0 0 0 {} {} {} 1e-6",
            middle[0], middle[1], middle[2]
        ));
        let light = Drawing::new(&scene, &RenderOptions::default()).unwrap().draw_light().unwrap();
        let seen = DVec3::new(light[0].into(), light[1].into(), light[2].into());
        assert!((seen - (0.01 * level).min(DVec3::ONE)).abs().max_element() < 1e-6, "{seen} {level}");
    }
}

#[test]
fn mirrors_show_more_than_the_brightest_pixel() {
    let lines = "Sky 8 4 2\nLook 0 0 5 0 0 0 10\nDisc 9 0 0 0 0 0 1  0 0 0  0 0 0  .1 .1 .1";
    for scene in [scene(lines), scene(&format!("Samples 4 0\n{lines}"))] {
        let picture = rayfold_tracer::render(&scene, &RenderOptions::default()).unwrap();
        assert_eq!(picture.get_pixel(16, 12).0, [204, 102, 51]);
    }
}

#[test]
fn a_sky_of_colours_up_to_1_is_that_background() {
    for (sky, background) in
        [("Sky .2 .5 1", "Background .2 .5 1"), ("Sky 1 0 0 0 .5 1", "Background 1 0 0 0 .5 1")]
    {
        let of = |line: &str| {
            let lines =
                "Look 0 1 6 0 0 0 50\nSphere 1 0 0 0 .1 .1 .1 .4 .4 .4 .5 .5 .5\nIlight 1 1 1 -1 -1 -1";
            rayfold_tracer::render(&scene(&format!("{line}\n{lines}")), &RenderOptions::default()).unwrap()
        };
        assert!(of(sky) == of(background), "{sky}");
    }
}

impl Dice {
    /// Returns a sky: a picture, or colours.
    fn sky(&mut self) -> Sky {
        if self.0.u8(0..4) == 0 {
            let high = self.0.bool().then(|| 3.0 * self.color().abs());
            return Sky::Colors(SkyColors::new(3.0 * self.color().abs(), high).unwrap());
        }
        let name = ["eight.png", "large.png", "light.hdr"][self.0.usize(0..3)];
        let strength = if name == "light.hdr" { 0.01 } else { 1.0 };
        let turn = SkyTurn::new(strength * self.within(0.2, 1.5), self.within(-400.0, 400.0)).unwrap();
        Sky::Picture(PictureFile::new(name, picture(name)), turn)
    }

    fn scene_below_a_sky(&mut self, count: usize, glass: u8) -> Scene {
        let objects = self.objects_and_glass(count, glass);
        let mut scene = self.scene(objects);
        if self.0.bool() {
            self.add_lamps(&mut scene);
        }
        scene.sky = Some(self.sky());
        scene.background = Background::default();
        scene.tone = if self.0.bool() { Tone::Srgb } else { Tone::Plain };
        scene
    }
}

/// Returns the pixels that differ in a channel by more than so much, of light and cover.
fn apart(a: &[f32], b: &[f32], by: f32) -> usize {
    let is_off = |(a, b): (&[f32; 4], &[f32; 4])| a.iter().zip(b).any(|(a, b)| (a - b).abs() > by);
    a.as_chunks().0.iter().zip(b.as_chunks().0).filter(|pair| is_off(*pair)).count()
}

#[test]
fn the_packets_show_the_sky_of_the_plain_tracer() {
    let mut dice = Dice::new("skies", SEED);
    let scenes: Vec<Scene> = [(0, 0), (1, 0), (6, 0), (90, 0), (1, 4), (3, 2), (8, 3)]
        .into_iter()
        .flat_map(|kind| [kind; 5])
        .map(|(count, glass)| dice.scene_below_a_sky(count, glass))
        .collect();
    hold(&scenes);
}

#[test]
fn the_packets_hide_the_sky_of_the_plain_tracer() {
    let mut dice = Dice::new("hidden skies", SEED);
    let (mut pixels, mut off) = (0, 0);
    for k in 0..40 {
        let mut scene = dice.scene_below_a_sky(k % 9, (k % 4) as u8);
        scene.background = Background::NONE;
        let options = RenderOptions::default();
        let plain = reference::light_and_cover(Exposure::still(&scene), &options).unwrap();
        let lit = |options| Drawing::new(&scene, &options).unwrap().draw_light_and_cover().unwrap();
        let drawn = lit(options);
        off += apart(&drawn, &plain, 2.0 / 255.0);
        pixels += plain.len() / 4;
        for tile in [(4, 4), (32, 8)] {
            assert!(lit(RenderOptions { tile: Some(tile), ..options }) == drawn, "scene {k}, {tile:?}");
        }
    }
    println!("{off} of {pixels} pixels differ");
    assert!((off as f64) < ISOLATED * pixels as f64, "{off} of {pixels} pixels");
}

#[test]
fn samples_and_precisions_see_the_same_sky() {
    let lines = "Sky \"large.png\" 1 20\nLook 0 1 6 0 0 0 50\nSphere 1 0 0 0 .1 .1 .1 .4 .4 .4 .5 .5 .5\nIlight 1 1 1 -1 -1 -1";
    let scene = scene(&format!("Samples 4 0\n{lines}"));
    let of = |precision| {
        let options = RenderOptions { precision, ..RenderOptions::default() };
        rayfold_tracer::render(&scene, &options).unwrap()
    };
    let (auto, double) = (of(Precision::Auto), of(Precision::F64));
    assert!(auto == double);
    let plain = reference::render_exposed(Exposure::still(&scene), &RenderOptions::default()).unwrap();
    let off = auto.as_raw().iter().zip(plain.as_raw()).filter(|(a, b)| a.abs_diff(**b) > 1).count();
    assert!(off <= 6, "{off} levels");
}

#[test]
fn a_hidden_sky_is_seen_in_mirrors_and_not_by_the_camera() {
    let lines = "Background none\nLook 0 0 6 0 0 0 40\nSphere 1 0 0 0  0 0 0  0 0 0  1 1 1";
    let picture = |sky: &str| {
        let scene = scene(&format!("{sky}\n{lines}"));
        Drawing::new(&scene, &RenderOptions::default()).unwrap().draw_picture().unwrap().into_rgba8()
    };
    for sky in ["Sky .2 .4 .6", "Sky .2 .4 .6 .2 .4 .6", "Sky \"eight.png\""] {
        let shown = picture(sky);
        assert_eq!(shown.get_pixel(0, 0).0, [0; 4], "{sky}");
        let middle = shown.get_pixel(16, 12).0;
        assert!(middle[3] == 255 && middle[2] > 0, "{sky}: {middle:?}");
    }
    assert_eq!(picture("Sky .2 .4 .6").get_pixel(16, 12).0, [51, 102, 153, 255]);
    // An orthographic camera has rays of another kind.
    let flat = scene("Screen 32 24\nOrthocamera\nSky \"eight.png\"\nBackground none");
    assert_eq!(flat.camera, Camera::Orthographic);
    let clear = Drawing::new(&flat, &RenderOptions::default()).unwrap().draw_picture().unwrap();
    assert!(clear.into_bytes().iter().all(|level| *level == 0));
}
