//! Scenes without background: what the pixels cover, in the packets and in the plain tracer, in bands, with many samples, and
//! by hand from the language reference.
//!
//! Scenes are random; a failure prints the seed. `RAYFOLD_SEED` sets another one.

use image::DynamicImage;
use rayfold_scene::{Background, Camera, Fog, Limits, Scene, Screen, Script, parse};
use rayfold_tracer::{Drawing, Exposure, Precision, RenderOptions, reference};

use super::dice::Dice;
use super::hold::{levels, scripted};

const SEED: u64 = 20_261_126;

/// The share of pixels at outlines that rounding may assign to another object.
const ISOLATED: f64 = 1e-3;

impl Dice {
    fn open_scene(&mut self, count: usize, glass: u8) -> Scene {
        let objects = self.objects_and_glass(count, glass);
        let mut scene = self.scene(objects);
        if scene.camera != Camera::Orthographic {
            scene.screen = Screen::new(self.0.u32(20..40), self.0.u32(20..40)).unwrap();
        }
        if self.0.bool() {
            self.add_lamps(&mut scene);
        }
        if self.0.u8(0..3) == 0 {
            let unit = if scene.camera == Camera::Orthographic { 12.0 } else { 1.0 };
            scene.fog = Fog::new(self.color(), unit * self.within(0.5, 20.0)).unwrap();
        }
        scene.background = Background::NONE;
        scene
    }
}

fn lit(scene: &Scene, options: RenderOptions) -> Vec<f32> {
    Drawing::new(scene, &options).unwrap().draw_light_and_cover().unwrap()
}

/// Returns the pixels that differ in a channel or in their cover.
fn apart(a: &[f32], b: &[f32], by: f32) -> usize {
    assert_eq!(a.len(), b.len());
    let pixels = a.chunks_exact(4).zip(b.chunks_exact(4));
    pixels.filter(|(a, b)| a.iter().zip(*b).any(|(a, b)| (a - b).abs() > by)).count()
}

#[test]
fn light_and_cover_are_the_references() {
    let mut dice = Dice::new("covers", SEED);
    let (mut differ, mut pixels, mut partial) = (0, 0, 0);
    for (count, glass) in [(0, 0), (1, 0), (6, 0), (90, 0), (1, 4), (3, 2), (8, 3), (80, 1)] {
        for _ in 0..4 {
            let scene = dice.open_scene(count, glass);
            let still = Exposure::still(&scene);
            let expected = reference::light_and_cover(still, &RenderOptions::default()).unwrap();
            partial += expected.chunks_exact(4).filter(|pixel| (0.01..0.99).contains(&pixel[3])).count();
            for precision in [Precision::Auto, Precision::F32, Precision::F64] {
                let options = RenderOptions { precision, ..Default::default() };
                let drawn = lit(&scene, options);
                differ += apart(&drawn, &expected, 1.5 / 255.0);
                pixels += drawn.len() / 4;
                for (name, level) in levels() {
                    let other = lit(&scene, RenderOptions { level: Some(level), ..options });
                    assert!(name == "SSE4.2" || other == drawn, "{name}, {precision:?}");
                }
                let tiles = [(4, 4), (32, 8)].map(|tile| RenderOptions { tile: Some(tile), ..options });
                let trees = [true, false].map(|tree| RenderOptions { tree: Some(tree), ..options });
                for options in tiles.into_iter().chain(trees) {
                    assert!(lit(&scene, options) == drawn, "{:?} {:?}", options.tile, options.tree);
                }
            }
        }
    }
    println!("{differ} of {pixels} pixels differ; {partial} are covered in part");
    assert!(differ as f64 <= ISOLATED * pixels as f64, "{differ} of {pixels}");
    assert!(partial > 500, "{partial}");
}

/// Returns the colour and the cover of the only pixel of a scene.
fn pixel(objects: &str) -> [f64; 4] {
    let scene = scripted("Screen 1 1\nDepth 4\nLook 0 0 4  0 0 0  10\nBackground none", objects);
    let plain = reference::light_and_cover(Exposure::still(&scene), &RenderOptions::default()).unwrap();
    let drawn = lit(&scene, RenderOptions::default());
    assert!(apart(&plain, &drawn, 1e-6) == 0, "{plain:?} {drawn:?}");
    [0, 1, 2, 3].map(|k: usize| f64::from(drawn[k]))
}

fn near(found: [f64; 4], color: f64, cover: f64) {
    assert!((found[0] - color).abs() < 1e-6 && (found[3] - cover).abs() < 1e-6, "{found:?}");
}

#[test]
fn what_reaches_nothing_has_no_cover() {
    near(pixel(""), 0.0, 0.0);
    let disc = "Disc 1  0 0 0  0 0 1  .2 .2 .2  0 0 0";
    near(pixel(disc), 0.2, 1.0);
    // Fog is seen on what the ray reaches, and not where it reaches nothing.
    let clear = (-4f64 / 8.0).exp();
    near(pixel("Fog 1 1 1 8"), 0.0, 0.0);
    near(pixel(&format!("Fog 1 1 1 8\n{disc}")), clear * 0.2 + 1.0 - clear, 1.0);
    // A mirror covers. What it shows of nothing is black, or fog.
    let mirror = "Disc 1  0 0 0  0 0 1  0 0 0  0 0 0  .5 .5 .5";
    near(pixel(mirror), 0.0, 1.0);
    near(pixel(&format!("Fog 1 1 1 8\n{mirror}")), clear * 0.5 + 1.0 - clear, 1.0);
    // The background comes back.
    near(pixel("Background .3 .3 .3"), 0.3, 1.0);
}

#[test]
fn glass_covers_as_much_as_it_takes_and_mirrors() {
    // An index of 1 reflects nothing.
    let pane = |color: &str, ior: f64| format!("Material pane  glass {color} {ior}\nDisc 1 0 0 0 0 0 1 pane");
    near(pixel(&pane("1 1 1", 1.0)), 0.0, 0.0);
    near(pixel(&pane(".9 .6 .3", 1.0)), 0.0, 0.4);
    near(pixel(&pane("1 1 1", 1.5)), 0.0, 0.04);
    let two = format!("{}\nDisc 1 0 0 -1 0 0 1 pane", pane(".9 .6 .3", 1.0));
    near(pixel(&two), 0.0, 1.0 - 0.36);
    // Behind the glass is something; fog is seen on it and on the glass.
    let seen = format!("{}\nDisc 9 0 0 -1 0 0 1 .5 .5 .5 0 0 0", pane(".9 .6 .3", 1.0));
    near(pixel(&seen), 0.45, 1.0);
    let clear = (-4f64 / 8.0).exp();
    near(pixel(&format!("Fog 1 1 1 8\n{}", pane("1 1 1", 1.0))), 1.0 - clear, 0.0);
    // Rays that are not followed cover: beyond the depth, and the faint.
    near(pixel(&format!("Depth 0\n{}", pane("1 1 1", 1.0))), 0.0, 1.0);
    near(pixel(&pane(".0001 .0001 .0001", 1.0)), 0.0, 1.0);
    // What is mirrored by glass covers, also where it reaches nothing through a second glass.
    let ball = "Material ball  glass 1 1 1 1.5\nSphere 1 0 0 0 ball\nSphere .5 0 0 9 ball";
    let share = 0.96f64 * 0.96;
    near(pixel(ball), 0.0, 1.0 - share);
}

fn moving(samples: u32, error: f64) -> Script {
    let text = format!(
        "Screen 61 47\nSamples {samples} {error}\nShutter .8\nTone srgb\nLook 0 1 7 0 .5 0 40\nLens .1 7\nBackground none\n\
         Ilight .8 .8 .8 -1 -2 -1 8\nMaterial pane glass .9 .6 .5 1.4\nSphere 1 (1:-1.5 3:1.5) .5 0  0 0 0 0 0 0\n\
         Sphere .8 1.8 .8 0 pane\nBox -2.5 0 -1 -1.2 1.2 1  .1 .1 .1 .6 .5 .4\nTorus .6 .03 0 1.8 0 0 1 1 .5 .1 .1 0 0 0\nFrames 2 2\nTrace\n"
    );
    let parsed = parse("a.txt", text.as_bytes(), &Limits::default());
    parsed.script.unwrap_or_else(|| panic!("{:?}\n{text}", parsed.diagnostics))
}

fn with<T>(script: &Script, options: &RenderOptions, draw: impl FnOnce(&Drawing) -> T) -> T {
    let scene = script.frame(0).unwrap();
    let after = |frames| script.frame_after(0, frames).unwrap();
    draw(&Drawing::exposed(Exposure::moving(&scene, &after), options).unwrap())
}

#[test]
fn packets_take_the_samples_that_the_plain_tracer_takes() {
    let script = moving(16, 0.0);
    let scene = script.frame(0).unwrap();
    let after = |frames| script.frame_after(0, frames).unwrap();
    let exposure = Exposure::moving(&scene, &after);
    let plain = reference::light_and_cover(exposure, &RenderOptions::default()).unwrap();
    for precision in [Precision::Auto, Precision::F64] {
        let options = RenderOptions { precision, ..Default::default() };
        let drawn = with(&script, &options, |drawing| drawing.draw_light_and_cover().unwrap());
        let share = apart(&drawn, &plain, 1.5 / 255.0) as f64 / (61.0 * 47.0);
        assert!(share < 0.01, "{precision:?}: {share}");
    }
}

#[test]
fn pixels_at_an_outline_get_the_samples_that_their_cover_needs() {
    // The ball that moves is black: only the cover tells it from nothing.
    let all = with(&moving(256, 0.0), &RenderOptions::default(), |d| d.draw_light_and_cover().unwrap());
    let some = with(&moving(256, 1.0), &RenderOptions::default(), |d| d.draw_light_and_cover().unwrap());
    let squares: f64 = all.iter().zip(&some).map(|(a, b)| f64::from(a - b).powi(2)).sum();
    let error = 255.0 * (squares / all.len() as f64).sqrt();
    println!("error of {error:.2} levels");
    assert!(error < 1.0, "{error}");
}

#[test]
fn bands_are_the_whole_picture() {
    for (samples, error) in [(1, 0.0), (8, 0.0), (32, 1.0)] {
        let script = moving(samples, error);
        for matte in [None, Some([200, 30, 90])] {
            let options = RenderOptions { matte, ..Default::default() };
            let whole = with(&script, &options, |drawing| drawing.draw_picture().unwrap());
            assert_eq!(whole.color().has_alpha(), matte.is_none());
            let band = |rows| with(&script, &options, |drawing| drawing.draw_picture_rows(rows).unwrap());
            let joined: Vec<u8> =
                [0..5, 5..6, 6..30, 30..90].map(band).iter().flat_map(|b| b.as_bytes().to_vec()).collect();
            assert!(joined == whole.as_bytes(), "{samples} {error} {matte:?}");
            let last = with(&script, &options, |drawing| drawing.draw_progressively(|_| Ok(())).unwrap());
            assert!(last == whole);
        }
    }
}

#[test]
fn an_image_without_alpha_shows_the_matte() {
    let script = moving(8, 0.0);
    let draw = |matte| {
        let options = RenderOptions { matte, ..Default::default() };
        with(&script, &options, |drawing| drawing.draw().unwrap())
    };
    let (black, red) = (draw(None), draw(Some([255, 0, 0])));
    assert_eq!(black.get_pixel(0, 0).0, [0; 3]);
    assert_eq!(red.get_pixel(0, 0).0, [255, 0, 0]);
    // Where all is covered no matte is seen: the box.
    assert_eq!(black.get_pixel(14, 28), red.get_pixel(14, 28));
    let DynamicImage::ImageRgba8(clear) =
        with(&script, &RenderOptions::default(), |d| d.draw_picture().unwrap())
    else {
        panic!("no alpha");
    };
    assert_eq!((clear.get_pixel(0, 0).0, clear.get_pixel(14, 28)[3]), ([0; 4], 255));
}
