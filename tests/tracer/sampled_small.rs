//! Objects smaller than a pixel contribute their light, whatever the requested error: thin objects of all shapes, their
//! shadows, their images in mirrors and through glass, sparks, stars that drift, narrow highlights, and pictures of one
//! pixel. Patterned floors and random scenes have the requested error.
//!
//! Scenes are random; a failure prints the seed. `RAYFOLD_SEED` sets another one.

use std::fmt::Write as _;

use super::dice::Dice;
use image::RgbImage;
use rayfold_scene::{Limits, Samples, Scene, Script, parse};
use rayfold_tracer::{Exposure, RenderOptions, render_exposed};

const SEED: u64 = 20_261_125;

/// Returns a white wire on black, this many pixels wide, in a picture of 320 x 120.
fn wire(width: f64) -> String {
    let radius = width / 120.0 * 5.0 * (22.5f64).to_radians().tan();
    format!("Screen 320 120\nLook 0 0 5 0 0 0 45\nCylinder {radius} -5 .35 0 5 -.35 0 1 1 1 0 0 0\nTrace\n")
}

fn script(text: &str) -> Script {
    let parsed = parse("a.txt", text.as_bytes(), &Limits::default());
    parsed.script.unwrap_or_else(|| panic!("{:?}\n{text}", parsed.diagnostics))
}

fn frame(script: &Script, k: usize, samples: u32, error: f64) -> RgbImage {
    let scene = Scene { samples: Samples::new(samples, error).unwrap(), ..script.frame(k).unwrap() };
    let after = |frames| script.frame_after(k, frames).unwrap();
    render_exposed(Exposure::moving(&scene, &after), &RenderOptions::default()).unwrap()
}

fn draw(text: &str, samples: u32, error: f64) -> RgbImage {
    frame(&script(text), 0, samples, error)
}

/// Returns the sum of all levels.
fn light(image: &RgbImage) -> f64 {
    image.as_raw().iter().map(|&level| f64::from(level)).sum()
}

/// Returns the root mean square of the differences of levels.
fn apart(a: &RgbImage, b: &RgbImage) -> f64 {
    let squares = a.as_raw().iter().zip(b.as_raw()).map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2));
    (squares.sum::<f64>() / a.as_raw().len() as f64).sqrt()
}

/// Returns the mean of the differences of levels.
fn off(a: &RgbImage, b: &RgbImage) -> f64 {
    let sum: f64 = a.as_raw().iter().zip(b.as_raw()).map(|(a, b)| f64::from(*a) - f64::from(*b)).sum();
    sum / a.as_raw().len() as f64
}

/// Returns the sum of the differences between the pictures with and without the thin object: its effect.
fn effect(with: &RgbImage, without: &RgbImage) -> f64 {
    with.as_raw().iter().zip(without.as_raw()).map(|(a, b)| f64::from(a.abs_diff(*b))).sum()
}

#[test]
fn a_wire_has_its_light_whatever_its_width_and_the_error() {
    for width in [0.01, 0.03, 0.1, 0.3, 1.0] {
        for samples in [64, 256] {
            let text = wire(width);
            let exact = light(&draw(&text, samples, 0.0));
            for error in [4.0, 1.0, 0.25] {
                let share = light(&draw(&text, samples, error)) / exact;
                println!("{width} pixels, {samples} samples, an error of {error}: {share:.3} of the light");
                assert!((0.97..=1.03).contains(&share), "{width} {samples} {error}: {share}");
            }
        }
    }
}

#[test]
fn a_wire_has_no_gap_where_samples_are_enough() {
    for (width, samples) in [(0.01, 1024), (0.05, 256), (0.2, 64), (1.0, 64)] {
        for error in [4.0, 0.25] {
            let image = draw(&wire(width), samples, error);
            let lit: Vec<bool> = (0..image.width())
                .map(|x| (0..image.height()).any(|y| image.get_pixel(x, y)[0] > 0))
                .collect();
            let (first, last) = (lit.iter().position(|&lit| lit), lit.iter().rposition(|&lit| lit));
            let (first, last) = (first.unwrap(), last.unwrap());
            assert!(last - first > 280, "{width} {samples} {error}: from {first} to {last}");
            let gaps: Vec<usize> = (first..last).filter(|&x| !lit[x]).collect();
            assert!(gaps.is_empty(), "{width} {samples} {error}: {gaps:?}");
        }
    }
}

/// Each shape with a thickness of a tenth of a pixel, in a picture of 160 x 120 that shows 4 x 3 at the origin.
const THIN: [(&str, &str); 15] = [
    (
        "balls",
        "Sphere .0025 -.4 .3 0 M\nSphere .0025 .5 -.2 0 M\nSphere .0025 .1 .6 0 M\nSphere .0025 1 .8 0 M",
    ),
    ("a cylinder", "Cylinder .00125 -1.5 -.8 0 1.4 .9 0 M"),
    ("a cylinder that goes far away", "Cylinder .006 -1 -1 3 8 9 -60 M"),
    ("a cone", "Cone .002 .0005 -1.5 -.8 0 1.4 .9 0 M"),
    ("a box", "Box -1.5 -.301 -.001 1.5 -.2985 .001 M"),
    ("a plate seen from its edge", "Box -1.5 -.001 -2 1.5 .0015 .5 M"),
    ("a turned box", "Group rod\nBox -1.5 -.00125 -.00125 1.5 .00125 .00125 M\nEnd\nUse rod 0 0 0 10 20 33"),
    ("a triangle", "Triangle -1.5 -.8 0 1.4 .9 0 1.4 .9025 0 M"),
    (
        "a strip of triangles",
        "Triangle -1.5 -.8 0 1.4 .9 0 1.4 .9025 0 M\nTriangle -1.5 -.8 0 1.4 .9025 0 -1.5 -.7975 0 M",
    ),
    ("a torus", "Torus 1 .00125 0 0 0 .2 .3 1 M"),
    ("a capsule", "Capsule .00125 -1 .2 0 1 .3 .4 M"),
    ("a box with round edges", "Roundbox -1.5 -.301 -.00125 1.5 -.2985 .00125 .0008 M"),
    (
        "such a box, turned",
        "Group rod\nRoundbox -1.5 -.00125 -.00125 1.5 .00125 .00125 .001 M\nEnd\nUse rod 0 0 0 10 20 33",
    ),
    ("a disc from its edge", "Disc 1 0 0 0 .3 1 .0015 M"),
    ("a hoop in a group", "Group hoop\nTorus .5 .0006 0 0 0 .2 .3 1 M\nEnd\nUse hoop .1 0 0 10 20 30 2"),
];

#[test]
fn thin_things_of_all_shapes_have_their_light() {
    for (name, object) in THIN {
        let text =
            format!("Screen 160 120\nLook 0 0 5 0 0 0 33.4\n{}\nTrace\n", object.replace('M', "1 1 1 0 0 0"));
        let exact = light(&draw(&text, 256, 0.0));
        for error in [4.0, 1.0] {
            let share = light(&draw(&text, 256, error)) / exact;
            println!("{name}, an error of {error}: {share:.3} of {exact}");
            assert!((0.97..=1.03).contains(&share), "{name}, {error}: {share} of {exact}");
        }
    }
}

/// Effects of thin objects that are not visible themselves: a shadow on a floor and a wall, an image in a mirror, an
/// object behind panes.
const BEHIND: [(&str, &str); 5] = [
    (
        "a shadow",
        "Look 0 2 5 0 .4 0 33\nIlight 1 1 1 .1 -1 -.3\nPlane 0 0 0 0 1 0 .1 .1 .1 .8 .8 .8\nPlane 0 0 -2 0 0 1 .1 .1 .1 .8 .8 .8\n\
         THIN Cylinder .002 -4 2.9 .3 4 2.4 .3 0 0 0 0 0 0",
    ),
    (
        "a lamp's shadow",
        "Look 0 2 5 0 .4 0 33\nPlight 1 1 1 0 4 1\nPlane 0 0 0 0 1 0 .1 .1 .1 .8 .8 .8\n\
         THIN Cylinder .0015 -4 2.5 .3 4 2.3 .3 0 0 0 0 0 0",
    ),
    (
        "a mirror",
        "Look 0 1 5 0 .7 0 33\nPlane 0 0 0 0 1 0 0 0 0 0 0 0 1 1 1\nPlane 0 0 -3 0 0 1 0 0 0 0 0 0\n\
         THIN Cylinder .002 -3 .95 -1 3 .85 -1 1 1 1 0 0 0",
    ),
    (
        "a glass pane",
        "Look 0 0 5 0 0 0 33\nMaterial pane glass .9 .9 .9 1.5\nBox -1 -1 1 1 1 1.1 pane\n\
         THIN Cylinder .002 -3 -.5 -1 3 .6 -1 1 1 1 0 0 0",
    ),
    (
        "a lens out of focus",
        "Look 0 0 5 0 0 0 33\nLens .03 4\nTHIN Cylinder .003 -3 -.5 -1 3 .6 -1 1 1 1 0 0 0",
    ),
];

#[test]
fn shadows_and_images_of_thin_things_have_their_light() {
    for (name, text) in BEHIND {
        let with = format!("Screen 160 120\n{}\nTrace\n", text.replace("THIN ", ""));
        let without = format!("Screen 160 120\n{}\nTrace\n", text.split("THIN").next().unwrap());
        let without = draw(&without, 256, 0.0);
        let exact_picture = draw(&with, 256, 0.0);
        let exact = effect(&exact_picture, &without);
        assert!(exact > 1000.0, "{name}: {exact}");
        for error in [4.0, 1.0] {
            let drawn = draw(&with, 256, error);
            let share = (light(&drawn) - light(&without)) / (light(&exact_picture) - light(&without));
            println!("{name}, an error of {error}: {share:.3} of {exact}");
            assert!((0.95..=1.05).contains(&share), "{name}, {error}: {share} of {exact}");
        }
    }
}

#[test]
fn narrow_highlights_of_small_balls_have_their_light() {
    let mut text =
        "Screen 160 120\nLook 0 0 5 0 0 0 33.4\nIlight 1 1 1 -.5 -1 -1\nMaterial bead shine 1 1 1 500\n"
            .to_owned();
    for k in 0..40 {
        writeln!(
            text,
            "Sphere .07 {:.2} {:.2} 0 bead",
            0.37 * f64::from(k % 8) - 1.3,
            0.37 * f64::from(k / 8) - 0.74
        )
        .unwrap();
    }
    text.push_str("Trace\n");
    let exact = light(&draw(&text, 256, 0.0));
    assert!(exact > 1000.0);
    for error in [4.0, 1.0] {
        let share = light(&draw(&text, 256, error)) / exact;
        println!("an error of {error}: {share:.3} of {exact}");
        assert!((0.97..=1.03).contains(&share), "{error}: {share}");
    }
}

#[test]
fn a_picture_of_one_pixel_is_the_mean_of_what_is_in_it() {
    let text = "Screen 1 1\nLook 0 0 5 0 0 0 20\nSphere .5 0 0 0 1 0 0 0 0 0\nTrace\n";
    // The tolerance for the samples' own noise, in levels.
    for (samples, noise) in [(64, 12), (256, 5), (1024, 3)] {
        let level = i32::from(draw(text, samples, 1.0).get_pixel(0, 0)[0]);
        println!("{samples}: {level}");
        assert!((level - 65).abs() <= noise, "{samples}: {level}");
    }
}

#[test]
fn a_star_that_drifts_is_there_in_every_frame() {
    let script = script(
        "Screen 24 24\nSphere .3 (1:8 41:13.48) (1:10.37 41:12.37) -50 1 1 1 0 0 0\nFrames 40\nTrace\n",
    );
    for k in 0..40 {
        let image = frame(&script, k, 256, 1.0);
        let sum: u32 = image.pixels().map(|pixel| u32::from(pixel[0])).sum();
        assert!((62..=82).contains(&sum), "frame {}: {sum}", k + 1);
    }
}

/// The stars move by two pixels and more from one sampled moment to the next.
#[test]
fn stars_that_are_fast_leave_traces_without_gaps() {
    for way in [2.0, 30.0, 90.0] {
        let mut text = "Screen 64 48\nLook 0 0 5 0 0 0 40\nShutter .5\nFrames 3\n".to_owned();
        for k in 0..12 {
            let y = 3.3 * f64::from(k) - 18.0;
            writeln!(text, "Sphere .45 (1:-{way} 3:{way}) (1:{y:.1} 3:{:.1}) -60 1 1 1 0 0 0", y + 2.0)
                .unwrap();
        }
        text.push_str("Trace\n");
        let script = script(&text);
        let exact = light(&frame(&script, 1, 256, 0.0));
        for error in [4.0, 1.0] {
            let share = light(&frame(&script, 1, 256, error)) / exact;
            println!("{way}, an error of {error}: {share:.3} of {exact}");
            assert!((0.95..=1.05).contains(&share), "{way} {error}: {share} of {exact}");
        }
    }
}

#[test]
fn a_fence_far_away_stands_whole() {
    let mut text =
        "Screen 160 100\nBackground .7 .8 .9\nLook 0 1.6 6 0 .9 0 40\nIlight .8 .8 .8 -.4 -1 -.5\n\
                    Plane 0 0 0 0 1 0 .1 .1 .1 .4 .5 .3\n"
            .to_owned();
    for k in 0..200 {
        let x = -30.0 + 0.3 * f64::from(k);
        writeln!(text, "Box {x:.2} 0 -40 {:.2} 1 -39.98 .9 .2 .2 .1 .1 .1", x + 0.02).unwrap();
    }
    text.push_str("Trace\n");
    let exact = draw(&text, 256, 0.0);
    for error in [4.0, 1.0] {
        let drawn = draw(&text, 256, error);
        let (rmse, mean) = (apart(&drawn, &exact), off(&drawn, &exact));
        println!("an error of {error}: {rmse:.3}, mean {mean:.3}");
        assert!(mean.abs() < 0.05 && rmse < 0.5 * error.min(2.0), "{error}: {rmse} {mean}");
    }
}

impl Dice {
    fn rgb(&mut self, low: f64, high: f64) -> String {
        format!("{:.3} {:.3} {:.3}", self.within(low, high), self.within(low, high), self.within(low, high))
    }

    /// Returns a checkered or striped floor to the horizon, with or without spheres, a lens and soft light.
    fn floor(&mut self) -> String {
        let mut text = format!("Screen 80 60\nTone srgb\nBackground {}\n", self.rgb(0.2, 0.9));
        let (height, target) = (self.within(0.6, 2.0), self.within(0.2, 0.9));
        writeln!(
            text,
            "Look 0 {height:.3} 5 {:.2} {target:.2} 0 {:.1}",
            self.within(-1.0, 1.0),
            self.within(35.0, 65.0)
        )
        .unwrap();
        if self.0.bool() {
            writeln!(text, "Lens {:.3} {:.2}", self.within(0.01, 0.06), self.within(3.0, 8.0)).unwrap();
        }
        let (dark, bright) = (self.rgb(0.0, 0.3), self.rgb(0.4, 1.0));
        let kind = ["checker", "stripes"][self.0.usize(0..2)];
        writeln!(text, "Material dark ambient .02 .02 .03 diffuse {dark}\nMaterial floor ambient .1 .1 .1 diffuse {bright} {kind} {:.3} dark", self.within(0.1, 1.0)).unwrap();
        writeln!(
            text,
            "Plane 0 0 0 0 1 0 floor\nIlight .8 .8 .7 {:.2} -1 {:.2} {:.2}",
            self.within(-1.0, 1.0),
            self.within(-1.0, 0.0),
            self.within(0.0, 8.0)
        )
        .unwrap();
        for _ in 0..self.0.u8(0..4) {
            let (r, color) = (self.within(0.2, 0.7), self.rgb(0.2, 0.9));
            writeln!(
                text,
                "Sphere {r:.3} {:.3} {r:.3} {:.3} .1 .1 .1 {color} .2 .2 .2",
                self.within(-2.0, 2.0),
                self.within(-3.0, 1.0)
            )
            .unwrap();
        }
        text.push_str("Trace\n");
        text
    }
}

/// The error is at most the requested one plus that of rounding to levels.
#[test]
fn patterned_floors_have_the_error_that_is_asked_for() {
    let mut dice = Dice::new("patterned floors", SEED);
    for _ in 0..3 {
        let text = dice.floor();
        let (exact, all) = (draw(&text, 1024, 0.0), draw(&text, 512, 0.0));
        for error in [4.0f64, 1.0] {
            let drawn = draw(&text, 512, error);
            let wanted = error.max(apart(&all, &exact));
            let (rmse, mean) = (apart(&drawn, &exact), off(&drawn, &exact));
            println!("an error of {error}: {rmse:.3}, mean {mean:.3}");
            assert!(rmse <= (1.15 * wanted).hypot(0.4), "{error}: {rmse} of\n{text}");
            assert!(mean.abs() < 0.05 * error.max(1.0) + 0.03, "{error}: {mean} of\n{text}");
        }
    }
}

/// The plain tracer, which accepts numbers of any size, draws 230.
#[test]
fn a_faint_lamp_of_a_far_reach_lights_as_it_says() {
    let text = "Screen 9 9\nLook 0 0 5 0 0 0 40\nPlight 1e-200 1e-200 1e-200 0 0 1 0 1e100\nBox -9 -9 -1 9 9 0 0 0 0 .9 .9 .9\nTrace\n";
    let scene = script(text).frame(0).unwrap();
    let plain = rayfold_tracer::reference::render(&scene, &RenderOptions::default()).unwrap();
    assert_eq!(plain.get_pixel(4, 4).0, [230; 3]);
    assert_eq!(rayfold_tracer::render(&scene, &RenderOptions::default()).unwrap(), plain);
}
