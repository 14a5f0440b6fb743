//! Light that goes round: surfaces that give off light, and surfaces that throw light on each other.

use glam::DVec3;
use image::RgbImage;
use rayfold_scene::{Limits, Samples, Scene, parse};
use rayfold_tracer::reference::{self, estimate};
use rayfold_tracer::{Drawing, Exposure, Level, RenderOptions, render, render_exposed};

fn scene(script: &str) -> Scene {
    let parsed = parse("a.txt", script.as_bytes(), &Limits::default());
    assert!(parsed.diagnostics.iter().all(|d| !d.is_error()), "{script}{:?}", parsed.diagnostics);
    parsed.script.and_then(|script| script.frame(0)).unwrap_or_else(|| panic!("{script}"))
}

/// Returns the pixel in the middle, as both tracers draw it.
fn middle(script: &str) -> [u8; 3] {
    let (scene, options) = (scene(script), RenderOptions::default());
    let [fast, plain] = [render(&scene, &options), reference::render(&scene, &options)].map(Result::unwrap);
    let (x, y) = (scene.screen.width() / 2, scene.screen.height() / 2);
    assert_eq!(fast.get_pixel(x, y), plain.get_pixel(x, y), "{script}");
    fast.get_pixel(x, y).0
}

const BEFORE: &str = "Screen 5 5\nLook 0 0 5 0 0 0 20\nBackground 0 0 0\n";

#[test]
fn glow_is_added_to_what_a_surface_shows_on_both_sides() {
    let with = |lines: &str| middle(&format!("{BEFORE}{lines}Trace\n"));
    for direction in ["1", "-1"] {
        let disc = format!("Material lit ambient .1 .2 0 glow .2 .1 .4\nDisc 2 0 0 0 0 0 {direction} lit\n");
        assert_eq!(with(&disc), [77, 77, 102], "{direction}");
    }
    // In a mirror of a half, and behind glass that lets half through.
    let mirrored =
        "Material lit glow .22 .1 .4\nDisc 2 0 0 9 0 0 1 lit\nDisc 2 0 0 0 0 0 1 0 0 0 0 0 0 .5 .5 .5\n";
    assert_eq!(with(mirrored), [28, 13, 51]);
    let behind = "Material lit glow .22 .1 .4\nMaterial pane glass .5 .5 .5 1\nDisc 2 0 0 0 0 0 1 lit\nDisc 2 0 0 1 0 0 1 pane\n";
    assert_eq!(with(behind), [28, 13, 51]);
    // In fog that leaves 1/e.
    let foggy = "Fog 0 0 0 5\nMaterial lit glow .2 .1 1\nDisc 2 0 0 0 0 0 1 lit\n";
    assert_eq!(with(foggy), [19, 9, 94]);
}

#[test]
fn no_pattern_and_no_file_changes_glow() {
    let lines = "Material other ambient 1 1 1\nMaterial board ambient 0 0 0 glow .2 .1 .4 stripes 1 other\n";
    let at = |x: f64| middle(&format!("{BEFORE}{lines}Box {x} -2 -2 {} 2 0 board\nTrace\n", x + 4.0));
    assert_eq!(at(-2.5), [255; 3], "ambient 1 and the glow");
    let moved =
        middle(&format!("{BEFORE}{lines}Group g\nBox -1.5 -2 -2 2.5 2 0 board\nEnd\nUse g -1 0 0\nTrace\n"));
    assert_eq!(moved, [51, 26, 102]);
}

#[test]
fn glow_lights_nothing_by_itself() {
    let lines = "Material lit glow 1 1 1\nSphere 1 0 3 0 lit\nDisc 2 0 0 0 0 0 1 0 0 0 .9 .9 .9\n";
    assert_eq!(middle(&format!("{BEFORE}{lines}Trace\n")), [0; 3]);
}

#[test]
fn glow_is_a_finite_colour_of_a_material() {
    let named = scene("Screen 2 2\nMaterial lit glow #ff0000\nSphere 1 0 0 0 lit\nTrace\n");
    let finish = named.objects[0].material().finish().cloned().unwrap_or_default();
    assert_eq!(finish.glow, DVec3::X);
}

/// Returns the means of the pixels before they become levels, row by row from the top.
fn light(scene: &Scene) -> Vec<DVec3> {
    let options = RenderOptions::default();
    let light = Drawing::new(scene, &options).unwrap().draw_light().unwrap();
    light.as_chunks::<3>().0.iter().map(|pixel| DVec3::from_array(pixel.map(f64::from))).collect()
}

/// A room: floor, walls of two colours, and a ceiling with a hole.
const ROOM: &str = "Look 0 1 3.4 0 1 0 50
Material white diffuse .75 .75 .75
Material red diffuse .75 .1 .1
Material green diffuse .1 .7 .15
Box -1.1 -.1 -1.1 1.1 0 3.6 white
Box -1.1 0 -1.1 1.1 2 -1 white
Box -1.1 0 -1.1 -1 2 3.6 red
Box 1 0 -1.1 1.1 2 3.6 green
Box -1.1 2 .4 1.1 2.1 3.6 white
Box -1.1 0 3.5 1.1 2 3.6 white
Sphere .35 -.4 .35 -.3 white
";

/// Returns scripts in which light goes round, with a screen of this size.
fn rounds(size: &str) -> Vec<(&'static str, String)> {
    let of = |settings: &str, things: &str| format!("Screen {size}\n{settings}\n{ROOM}{things}\nTrace\n");
    let pane = "Material pane glass .9 .95 .9 1.5\nMaterial chrome mirror .8 .7 .6 diffuse .1 .1 .1\n\
                Sphere .3 .5 .3 .3 pane\nSphere .25 .3 .25 -.6 chrome\nDisc .3 -.6 .9 .6 .3 .1 1 pane\n";
    let rough = "Material brushed mirror .8 .7 .6 rough .2\nMaterial satin diffuse .2 .2 .2 mirror .5 .5 .5 rough .6\n\
                 Material frost glass .9 .95 .9 1.5 rough .15\nMaterial other mirror .1 .2 .4\n\
                 Material mixed diffuse .3 .2 .2 mirror .5 .4 .3 rough .3 checker .2 other\n\
                 Sphere .3 .5 .3 .3 frost\nSphere .3 -.4 .3 .5 brushed\nBox .2 0 -.7 .7 .8 -.3 satin\nSphere .2 0 .2 1.2 mixed\n\
                 Disc .3 -.6 1.2 .6 .3 .1 1 frost\n";
    let lit = "Ilight .6 .6 .5 .2 -1 -.6\nPlight .5 .4 .4 0 1.5 .5 0 .8\n";
    vec![
        ("rough", of("Background .9 1 1\nDepth 4", &format!("{rough}{lit}"))),
        (
            "rough and indirect",
            of("Indirect 2\nBackground .6 .7 .7", &format!("{rough}Ilight .4 .4 .4 .2 -1 -.6 5")),
        ),
        ("sky", of("Indirect 3\nBackground .9 1 1", "")),
        ("lamp", of("Indirect 2", "Plight .9 .8 .7 0 1.5 .5 0 .8")),
        ("wide lamp", of("Indirect 1", "Plight .9 .8 .7 0 1.5 .5 .2 .8")),
        ("sun", of("Indirect 2\nBackground .2 .3 .5", "Ilight 1 .9 .8 .2 -1 .3 4")),
        ("a pane that glows", of("Indirect 2", "Material lit glow 3 2.5 2\nDisc .4 0 1.9 0 0 1 0 lit")),
        ("glass and mirrors", of("Indirect 2\nDepth 4\nBackground .9 1 1", pane)),
        ("sky of two colours", of("Indirect 1\nBackground .8 .5 .2 .4 .8 1", "")),
        ("srgb", of("Indirect 2\nTone srgb\nBackground .5 .6 .7", pane)),
        ("fog", of("Indirect 2\nFog .3 .2 .1 6", "Plight .9 .8 .7 0 1.5 .5 0 .8")),
        (
            "pattern",
            of(
                "Indirect 2\nBackground .9 1 1",
                "Material dark diffuse .1 .2 .6\nMaterial tiles diffuse .7 .7 .3 checker .3 dark\nSphere .4 .4 .4 0 tiles",
            ),
        ),
    ]
}

fn with_samples(script: &str, most: u32, error: f64) -> Scene {
    let mut scene = scene(script);
    scene.samples = Samples::new(most, error).unwrap();
    scene
}

/// Returns the share of pixels of which a channel differs by more than `levels`.
fn apart(a: &RgbImage, b: &RgbImage, levels: u8) -> f64 {
    let differ = |(a, b): &(&image::Rgb<u8>, &image::Rgb<u8>)| {
        a.0.iter().zip(b.0).any(|(a, b)| a.abs_diff(b) > levels)
    };
    a.pixels().zip(b.pixels()).filter(differ).count() as f64 / f64::from(a.width() * a.height())
}

#[test]
fn packets_take_the_paths_that_the_plain_tracer_takes() {
    for (name, text) in rounds("32 24") {
        let scene = with_samples(&text, 8, 0.0);
        let options = RenderOptions::default();
        let plain = reference::render_exposed(Exposure::still(&scene), &options).unwrap();
        let drawn = render(&scene, &options).unwrap();
        let (some, many) = (apart(&drawn, &plain, 1), apart(&drawn, &plain, 16));
        println!("{name}: {:.2} % of the pixels differ by more than a level", 100.0 * some);
        assert!(some <= 0.01 && many <= 0.003, "{name}: {some} {many}");
    }
}

/// The differences of the means of all blocks of 4 x 4 pixels, in standard errors, are those of chance.
#[test]
fn means_of_blocks_are_those_of_independent_paths() {
    let (mut all, mut counts) = (0.0, 0.0);
    for (name, text) in rounds("16 12") {
        let scene = with_samples(&text, 256, 0.0);
        let drawn = light(&scene);
        let truth = estimate(Exposure::still(&scene), 256, 5);
        let (mut sum, mut count, mut worst) = (0.0, 0.0, 0f64);
        for block in 0..12 {
            let (left, top) = (block % 4 * 4, block / 4 * 4);
            let places = (0..16).map(|k| (top + k / 4) * 16 + left + k % 4);
            // The means of the picture are clamped.
            let places = places.filter(|&place| truth.means[place].max_element() < 0.9);
            let (mut difference, mut variance) = (DVec3::ZERO, DVec3::ZERO);
            for place in places {
                difference += drawn[place] - truth.means[place];
                // Both have this error, the picture with a better arrangement of its samples.
                // Half a level is for what is so rare that no sample shows it.
                let rare = DVec3::splat((0.5f64 / 255.0).powi(2));
                variance += 2.0 * truth.errors[place] * truth.errors[place] + rare;
            }
            for channel in 0..3 {
                if variance[channel] > 0.0 {
                    let apart = difference[channel] / variance[channel].sqrt();
                    sum += apart * apart;
                    count += 1.0;
                    worst = worst.max(apart.abs());
                }
            }
        }
        println!("{name}: mean square {:.3}, worst {worst:.2}", sum / count);
        // Channels are alike, so that a dozen numbers are independent.
        assert!(count > 10.0 && sum / count < 2.4 && worst < 4.0, "{name}: {} {worst}", sum / count);
        (all, counts) = (all + sum, counts + count);
    }
    assert!(all / counts < 1.25, "{}", all / counts);
}

#[test]
fn pictures_of_paths_are_the_same_whatever_they_are_drawn_with() {
    for (name, text) in rounds("50 37") {
        let scene = with_samples(&text, 32, 4.0);
        let options = RenderOptions::default();
        let expected = render(&scene, &options).unwrap();
        let mut ways = vec![
            RenderOptions { tile: Some((8, 8)), ..options },
            RenderOptions { tile: Some((32, 8)), ..options },
            RenderOptions { tree: Some(true), ..options },
        ];
        let level = Level::new();
        #[cfg(target_arch = "x86_64")]
        ways.extend(level.as_avx2().map(|simd| RenderOptions { level: Some(Level::Avx2(simd)), ..options }));
        #[cfg(not(target_arch = "x86_64"))]
        ways.push(RenderOptions { level: Some(level), ..options });
        for way in ways {
            assert!(render(&scene, &way).unwrap() == expected, "{name}: {way:?}");
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
        assert!(pool.install(|| render(&scene, &options)).unwrap() == expected, "{name}: three threads");
        let drawing = Drawing::new(&scene, &options).unwrap();
        let band = drawing.draw_rows(9..20).unwrap();
        let rows = image::imageops::crop_imm(&expected, 0, 9, 50, 11).to_image();
        assert!(band == rows, "{name}: a band");
    }
}

/// In a closed ball each point sees the mean of all, so what arrives after n reflections is known.
#[test]
fn light_in_a_ball_is_what_theory_says() {
    for bounces in [1, 4, 16] {
        let script = format!(
            "Screen 24 18\nLook 0 .2 .3 .3 .4 -1 80\nIndirect {bounces}\nMaterial top diffuse .9 .9 .9\nMaterial wall diffuse .1 .1 .1 \
             glow .3 .2 .1 gradient -1 1 top\nSphere 1 0 0 0 wall\nTrace\n"
        );
        let scene = with_samples(&script, 256, 0.0);
        let glow = DVec3::new(0.3, 0.2, 0.1);
        let arriving = 2.0 * (1.0 - 0.5f64.powi(bounces));
        let (mut sum, mut squares, mut count) = (DVec3::ZERO, DVec3::ZERO, 0.0);
        for (place, mean) in (0..).zip(light(&scene)) {
            let (column, row) = (place % 24, place / 24);
            // The mean of the diffuse coefficient over the pixel.
            let (mut diffuse, side) = (0.0, 8);
            for k in 0..side * side {
                let at = |k: u32| (f64::from(k) + 0.5) / f64::from(side) - 0.5;
                let (x, y) = (f64::from(column) + at(k % side), f64::from(17 - row) + at(k / side));
                let (origin, direction) = rayfold_tracer::pixel_ray(&scene, x, y);
                let (b, c) = (origin.dot(direction), origin.length_squared() - 1.0);
                let height = (origin + (-b + (b * b - c).sqrt()) * direction).y;
                diffuse += (0.1 + 0.8 * (0.5 + 0.5 * height)) / f64::from(side * side);
            }
            let difference = mean - glow * (1.0 + diffuse * arriving);
            sum += difference;
            squares += difference * difference;
            count += 1.0;
        }
        let error = (squares / count / count).map(f64::sqrt);
        let mean = sum / count;
        println!("{bounces} reflections: {} +- {}", mean, error);
        for channel in 0..3 {
            assert!(mean[channel].abs() < 3.0 * error[channel] + 1e-5, "{bounces}: {mean} {error}");
        }
        assert!(error.max_element() < 0.002, "{error}");
    }
}

#[test]
fn a_plane_under_an_even_sky_has_its_diffuse_colour() {
    let plane = "Screen 4 3\nLook 0 2 5 0 0 0 40\nBackground 1 1 1\nIndirect 1\nPlane 0 0 0 0 1 0 0 0 0 .5 .25 .2\nTrace\n";
    let drawn = render(&with_samples(plane, 16, 0.0), &RenderOptions::default()).unwrap();
    assert!(drawn.pixels().all(|pixel| pixel.0 == [128, 64, 51]), "{:?}", drawn.get_pixel(0, 0));
    // With one sample nothing goes round.
    let single = render(&with_samples(plane, 1, 0.0), &RenderOptions::default()).unwrap();
    assert!(single.pixels().all(|pixel| pixel.0 == [0; 3]));
}

#[test]
fn light_that_goes_round_is_not_clamped_before_the_mean() {
    // A quarter of each pixel glows at 2, and the mean is a half.
    let script = "Screen 2 2\nOrthocamera\nIndirect 1\nMaterial lit glow 2 2 2\nBox -.5 -.5 -9 0 0 -1 lit\nBox .5 -.5 -9 1 0 -1 lit\n\
                  Box -.5 .5 -9 0 1 -1 lit\nBox .5 .5 -9 1 1 -1 lit\nTrace\n";
    let mean = light(&with_samples(script, 256, 0.0))[0].x;
    assert!((mean - 0.5).abs() < 0.01, "{mean}");
    let closed = light(&with_samples(&script.replace("Indirect 1\n", ""), 256, 0.0))[0].x;
    assert!((closed - 0.25).abs() < 0.01, "{closed}");
}

#[test]
fn without_an_error_to_reach_or_with_one_a_picture_is_near_the_truth() {
    for (name, text) in rounds("48 36").into_iter().take(3) {
        let exact = light(&with_samples(&text, 1024, 0.0));
        let drawn = light(&with_samples(&text, 1024, 4.0));
        let squares: f64 = exact.iter().zip(&drawn).map(|(a, b)| (*a - *b).length_squared() / 3.0).sum();
        let error = 255.0 * (squares / exact.len() as f64).sqrt();
        println!("{name}: {error:.2} levels");
        assert!((0.1..5.0).contains(&error), "{name}: {error}");
    }
}

#[test]
fn a_scene_without_background_has_the_same_cover_where_light_goes_round() {
    let script = "Screen 24 18\nLook 0 0 5 0 0 0 30\nBackground none\nIlight .5 .5 .5 -1 -1 -1\n\
                  Material pane glass .9 .8 .7 1.5\nSphere 1 -.3 0 0 0 0 0 .7 .7 .7\nBox .4 -.8 0 1.4 .8 1 pane\n";
    let cover = |settings: &str| {
        let scene = with_samples(&format!("{script}{settings}Trace\n"), 64, 0.0);
        let options = RenderOptions::default();
        let lit = Drawing::new(&scene, &options).unwrap().draw_light_and_cover().unwrap();
        lit.as_chunks::<4>().0.iter().map(|pixel| f64::from(pixel[3])).collect::<Vec<_>>()
    };
    let (closed, open) = (cover(""), cover("Indirect 1\n"));
    let apart: f64 = closed.iter().zip(&open).map(|(a, b)| (a - b).abs()).sum::<f64>() / closed.len() as f64;
    assert!(closed.iter().any(|cover| (0.3..0.9).contains(cover)) && apart < 0.01, "{apart}");
    let scene = with_samples(&format!("{script}Indirect 1\nTrace\n"), 16, 0.0);
    let options = RenderOptions::default();
    let plain = reference::light_and_cover(Exposure::still(&scene), &options).unwrap();
    let fast = Drawing::new(&scene, &options).unwrap().draw_light_and_cover().unwrap();
    let far = plain.iter().zip(&fast).filter(|(a, b)| (**a - **b).abs() > 0.02).count();
    assert!(far * 50 < plain.len(), "{far} of {}", plain.len());
    assert!(render_exposed(Exposure::still(&scene), &options).is_ok());
}

/// In a white sky, what comes back of a rough mirror is its coefficient, at all angles.
#[test]
fn rough_mirrors_lose_nothing() {
    for alpha in [0.0005, 0.05, 0.1, 0.3, 0.6, 1.0] {
        let script = format!(
            "Screen 33 33\nLook 0 0 9 0 0 0 13\nBackground 1 1 1\nMaterial metal mirror .8 .4 .2 rough {alpha}\nSphere 1 0 0 0 metal\nTrace\n"
        );
        let scene = with_samples(&script, 1024, 0.0);
        let light = light(&scene);
        // Rings of pixels inside the outline, by the sine of the angle at which they are seen.
        let mut rings = [(0.0, 0.0, 0.0); 8];
        for (place, mean) in (0..).zip(light) {
            let (x, y) = (f64::from(place % 33) - 16.0, f64::from(place / 33) - 16.0);
            let radius = x.hypot(y) / 16.0;
            if radius < 0.93 {
                let ring = &mut rings[(radius / 0.93 * 8.0) as usize];
                let mean = mean / DVec3::new(0.8, 0.4, 0.2);
                *ring = (ring.0 + 1.0, ring.1 + mean.x, ring.2 + mean.x * mean.x);
                assert!((mean.x - mean.y).abs() < 1e-4 && (mean.x - mean.z).abs() < 2e-4, "{mean}");
            }
        }
        for (count, sum, squares) in rings {
            let mean: f64 = sum / count;
            let error = ((squares / count - mean * mean).max(0.0) / count).sqrt();
            println!("{alpha}: {mean:.5} +- {error:.5}");
            assert!((mean - 1.0).abs() < 3.0 * error + 1.0 / 1024.0, "{alpha}: {mean} +- {error}");
        }
    }
}

/// As a roughness becomes small, a rough mirror and rough glass look like smooth ones.
#[test]
fn what_is_hardly_rough_looks_smooth() {
    let of = |rough: &str| {
        let script = format!(
            "Screen 40 30\nLook 0 .5 5 0 0 0 40\nBackground .2 .3 .4 .8 .9 1\nIndirect 1\nMaterial metal mirror .8 .7 .6 {rough}\n\
             Material pane glass .9 .9 .8 1.5 {rough}\nPlane 0 -1 0 0 1 0 0 0 0 .6 .3 .2\nSphere .9 -1 0 0 metal\nSphere .9 1 0 0 pane\n\
             Disc .6 0 .2 1.6 .3 .1 1 pane\nTrace\n"
        );
        light(&with_samples(&script, 256, 0.0))
    };
    let (smooth, rough) = (of(""), of("rough .0001"));
    let apart = smooth.iter().zip(&rough).map(|(a, b)| (*a - *b).abs().max_element());
    let mean: f64 = apart.sum::<f64>() / smooth.len() as f64;
    assert!(mean < 0.004, "{mean}");
}

#[test]
fn a_roughness_of_nothing_changes_nothing_and_a_curve_that_is_none_opens_the_frame() {
    let of = |rough: &str| {
        let script = format!(
            "Screen 20 15\nLook 0 0 5 0 0 0 40\nMaterial metal mirror .8 .7 .6 glow .9 .9 .9 {rough}\nBackground .5 .5 .5\n\
             Sphere .9 0 0 0 metal\nFrames 1\nTrace\n"
        );
        with_samples(&script, 16, 0.0)
    };
    let options = RenderOptions::default();
    let draw = |rough: &str| render(&of(rough), &options).unwrap();
    assert!(draw("") == draw("rough 0") && draw("") == draw("rough (1:0)"));
    assert!(!of("rough (1:0)").goes_round() && of("rough (1:0 2:1)").goes_round());
    // What is brighter than white counts at the outline then.
    assert!(draw("") != draw("rough (1:0 2:1)"));
    // So does what is hidden.
    let hidden =
        "Screen 4 3\nSamples 4\nMaterial metal mirror 1 1 1 rough .5\nSphere (1:0 2:1) 0 0 0 metal\nTrace\n";
    assert!(scene(hidden).goes_round() && scene(hidden).objects.is_empty());
}
