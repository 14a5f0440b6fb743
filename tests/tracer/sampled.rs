//! Pictures with several samples per pixel. The packets draw them like the plain tracer does, with any instruction set
//! and search structure, and their pixels are the means that the language defines.

use image::RgbImage;
use rayfold_scene::{Limits, Samples, Scene, Script, parse};
use rayfold_tracer::reference::{self, estimate};
use rayfold_tracer::{Drawing, Exposure, Level, Precision, RenderOptions, render, render_exposed};

/// Returns a script with spheres, boxes, a tent, a floor and mirrors. `extra` goes before the lights, which it may
/// replace.
fn table(size: &str, extra: &str, sun: &str) -> String {
    format!(
        "Screen {size}\nLook 0 3.4 8  0 .7 0  34\nBackground .55 .65 .8\n{extra}\n{sun}\n\
         Box -30 -1 -30 30 0 30  .1 .1 .1 .5 .5 .45\n\
         Sphere .9 -1.6 .9 -.4  .04 .04 .04 .2 .2 .2 .6 .6 .6\n\
         Sphere .5 (1:-.6 3:1.6) .5 1.2  .08 .02 .02 .8 .2 .15\n\
         Box 1.2 0 -2.4 2.0 1.9 -1.6  .02 .03 .08 .2 .35 .8\n\
         Triangle -3.2 0 -2  -2.6 2.6 -2.2  -1.9 0 -2.4  .1 .1 .02 .7 .7 .2\nFrames 2 2\nTrace\n"
    )
}

const SUN: &str = "Ilight .6 .6 .55  1 -1.7 -1";
const WIDE_SUN: &str = "Ilight .6 .6 .55  1 -1.7 -1  9";
const LAMP: &str = "Plight .9 .8 .6  -2.5 4 3  .6";

/// Returns scripts with every effect alone, and with all together.
fn effects(size: &str) -> Vec<(&'static str, String)> {
    let bodies = "Cone .5 .1  2.6 0 .8  2.6 1 .8  .1 .1 .1 .5 .3 .6\nTorus .5 .15  -.3 .6 -2  0 1 1  .1 .1 .1 .3 .6 .6 .2 .2 .2\n\
                  Material tiles ambient .1 .1 .1 diffuse .6 .6 .6 shine .5 .5 .5 40 checker .3 dark\n\
                  Sphere .4 3 .4 2  tiles\n";
    let dark = "Material dark diffuse .1 .1 .3\n";
    let glass = "Material pane glass .9 .95 .9 1.5 shine .4 .4 .4 60\nSphere .5 .2 .5 2.4 pane\nBox -1.6 0 1.6 -1.5 1.2 2.4 pane";
    let all = format!("Lens .1 8\nShutter .7\nTone srgb\n{dark}{bodies}{LAMP} 5\nIlight .3 .3 .3 -1 -2 0");
    let many: String = (0..90)
        .map(|k| {
            format!(
                "Sphere .1 {} .1 {}  .1 .1 .1 .6 .4 .2\n",
                f64::from(k % 10) - 4.5,
                f64::from(k / 10) / 2.0 - 1.0
            )
        })
        .collect();
    vec![
        ("edges", table(size, "", SUN)),
        ("sun", table(size, "", WIDE_SUN)),
        ("lamp", table(size, "", LAMP)),
        ("a lamp of a fading light", table(size, "", &format!("{LAMP} 5"))),
        ("lens", table(size, "Lens .15 7", SUN)),
        ("lens at its own distance", table(size, "Lens .15", SUN)),
        ("motion", table(size, "Shutter .8", SUN)),
        ("srgb", table(size, "Tone srgb", WIDE_SUN)),
        (
            "parallel",
            table(
                size,
                "Orthocamera\nGroup all\nSphere 3 4 4 -9 1 .5 .2 .1 .1 .1\nEnd\nUse all\nPlane 0 0 -20 0 .3 1 .1 .1 .1 .6 .6 .6",
                WIDE_SUN,
            ),
        ),
        ("bodies", table(size, &format!("{dark}{bodies}"), WIDE_SUN)),
        ("glass", table(size, glass, WIDE_SUN)),
        ("glass before a lamp", table(size, &format!("Lens .1 8\nShutter .7\n{dark}{bodies}{glass}"), LAMP)),
        (
            "fog",
            table(size, &format!("Shutter .7\nFog 1.2 (1:.8 3:.2) -.1 9\n{dark}{bodies}{glass}"), WIDE_SUN),
        ),
        ("many", table(size, &many, WIDE_SUN)),
        ("many, seen by a lens", table(size, &format!("Lens .1 8\n{many}"), LAMP)),
        ("all", table(size, &all, WIDE_SUN)),
        ("one column", table("1 20", "Camera 0 2 7  0 -.2 -1  0 1 0  1  -.4 -.3 .4 .3", WIDE_SUN)),
    ]
}

/// A frame and its script.
struct Frame {
    script: Script,
    scene: Scene,
}

impl Frame {
    fn new(text: &str, samples: u32, error: f64) -> Self {
        let parsed = parse("a.txt", text.as_bytes(), &Limits::default());
        let script = parsed.script.unwrap_or_else(|| panic!("{:?}\n{text}", parsed.diagnostics));
        let mut scene = script.frame(0).unwrap();
        scene.samples = Samples::new(samples, error).unwrap();
        Self { script, scene }
    }

    fn with<T>(&self, draw: impl FnOnce(Exposure) -> T) -> T {
        let after = |frames| self.script.frame_after(0, frames).unwrap();
        draw(Exposure::moving(&self.scene, &after))
    }

    fn draw(&self, options: &RenderOptions) -> RgbImage {
        self.with(|exposure| render_exposed(exposure, options)).unwrap()
    }
}

/// Returns the share of pixels of which a channel differs by more than `levels`.
fn apart(a: &RgbImage, b: &RgbImage, levels: u8) -> f64 {
    assert_eq!(a.dimensions(), b.dimensions());
    let differ =
        |(a, b): (&image::Rgb<u8>, &image::Rgb<u8>)| a.0.iter().zip(b.0).any(|(a, b)| a.abs_diff(b) > levels);
    let count = a.pixels().zip(b.pixels()).filter(|&pair| differ(pair)).count();
    count as f64 / f64::from(a.width() * a.height())
}

#[test]
fn packets_take_the_samples_that_the_plain_tracer_takes() {
    for (name, text) in effects("40 30") {
        let frame = Frame::new(&text, 16, 0.0);
        let plain =
            frame.with(|exposure| reference::render_exposed(exposure, &RenderOptions::default())).unwrap();
        for precision in [Precision::Auto, Precision::F64] {
            let drawn = frame.draw(&RenderOptions { precision, ..Default::default() });
            // If one ray of sixteen hits the other side of an edge, the pixel changes by a few levels.
            let (some, many) = (apart(&drawn, &plain, 1), apart(&drawn, &plain, 16));
            println!(
                "{name}, {precision:?}: {:.2} % of the pixels differ by more than a level",
                100.0 * some
            );
            assert!(some <= 0.01 && many <= 0.002, "{name}, {precision:?}: {some} {many}");
        }
    }
}

#[test]
fn means_are_those_of_independent_samples() {
    for (name, text) in effects("16 12") {
        let frame = Frame::new(&text, 256, 0.0);
        let drawn = frame.draw(&RenderOptions::default());
        let truth = frame.with(|exposure| estimate(exposure, 400, 9));
        let (mut sum, mut count) = (0.0, 0.0);
        for ((pixel, mean), error) in drawn.pixels().zip(&truth.means).zip(&truth.errors) {
            for channel in 0..3 {
                let level = f64::from(pixel[channel]) / 255.0;
                let level = match frame.scene.tone {
                    rayfold_scene::Tone::Plain => level,
                    rayfold_scene::Tone::Srgb => linear(level),
                };
                // Besides the error of the true value: the error of the picture, of its rounding, and of details that
                // no sample has hit.
                let error = error[channel].hypot(1.5 / 255.0);
                sum += ((level - mean[channel]) / error).powi(2);
                count += 1.0;
            }
        }
        println!("{name}: mean square {:.3}", sum / count);
        assert!(
            sum / count < 1.3,
            "{name}: the mean square of the difference is {} standard errors",
            sum / count
        );
    }
}

fn linear(level: f64) -> f64 {
    if level <= 0.04045 { level / 12.92 } else { ((level + 0.055) / 1.055).powf(2.4) }
}

#[test]
fn pictures_are_the_same_whatever_they_are_drawn_with() {
    for (name, text) in effects("50 37") {
        let frame = Frame::new(&text, 32, 1.0);
        let expected = frame.draw(&RenderOptions::default());
        let options = RenderOptions::default();
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
            assert!(frame.draw(&way) == expected, "{name}: {way:?}");
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
        assert!(pool.install(|| frame.draw(&options)) == expected, "{name}: three threads");
    }
}

#[test]
fn with_one_sample_nothing_has_an_extent() {
    let plain = Frame::new(&table("60 45", "", SUN), 1, 1.0).draw(&RenderOptions::default());
    let soft = Frame::new(&table("60 45", "Lens .2\nShutter 1", WIDE_SUN), 1, 1.0);
    assert!(soft.draw(&RenderOptions::default()) == plain);
    assert!(render(&soft.scene, &RenderOptions::default()).unwrap() == plain);
}

#[test]
fn a_short_flash_counts_for_the_time_that_it_lasts() {
    // The expected levels are 255 times the share of the exposure.
    let flashes = [
        ("(step .5:0 1.2:1 1.21:0)", 0.01),
        ("(step .5:0 .98:1 1.02:0)", 0.04),
        ("(1:0 1.03:1 1.06:0)", 0.03),
        // Twice in the exposure.
        ("(step cycle 0:1 .015:0 .5:0)", 0.03),
    ];
    for (curve, share) in flashes {
        for (samples, error) in [(1024, 1.0), (1024, 8.0), (256, 2.0), (256, 0.0)] {
            let text = format!(
                "Screen 64 48\nCamera 0 0 0  0 0 -1  0 1 0  1  -1 -.75 1 .75\nShutter 1\n\
                 Plane 0 0 -5  0 0 1  {curve} 0 0  0 0 0  0 0 0\nTrace"
            );
            let image = Frame::new(&text, samples, error).draw(&RenderOptions::default());
            let wanted = 255.0 * share;
            for (x, y, pixel) in image.enumerate_pixels() {
                let off = (f64::from(pixel[0]) - wanted).abs();
                assert!(
                    off < 2.0 + error,
                    "{curve}, {samples} {error}: {} at {x} {y}, not {wanted}",
                    pixel[0]
                );
            }
            let mean = image.pixels().map(|pixel| f64::from(pixel[0])).sum::<f64>() / (64.0 * 48.0);
            assert!(
                (mean - wanted).abs() < 1.0,
                "{curve}, {samples} {error}: {mean} on average, not {wanted}"
            );
        }
    }
}

#[test]
fn what_does_not_change_does_not_flicker() {
    let text = |ball: &str| table("96 72", ball, WIDE_SUN);
    let (before, after) = (text("Sphere .3 3 .3 2 1 0 0 0 0 0"), text("Sphere .3 3.1 .3 2 1 0 0 0 0 0"));
    let draw = |text: &str| Frame::new(text, 64, 1.0).draw(&RenderOptions::default());
    let (before, after) = (draw(&before), draw(&after));
    // The ball moves at the right edge: no pixel left of the centre changes.
    for (x, y, pixel) in before.enumerate_pixels().filter(|(x, ..)| *x < 48) {
        assert_eq!(pixel, after.get_pixel(x, y), "{x} {y}");
    }
    assert!(before != after);
}

#[test]
fn each_pass_is_a_picture_and_the_last_is_the_one_that_is_drawn() {
    let frame = Frame::new(&table("64 48", "Lens .1 8", WIDE_SUN), 256, 0.5);
    let mut passes = vec![];
    let last = frame.with(|exposure| {
        let options = RenderOptions::default();
        Drawing::exposed(exposure, &options)
            .unwrap()
            .draw_progressively(|image| {
                passes.push(image()?.into_rgb8());
                Ok(())
            })
            .unwrap()
            .into_rgb8()
    });
    assert!(last == frame.draw(&RenderOptions::default()));
    assert!(passes.len() > 5, "{}", passes.len());
    let errors: Vec<f64> = passes.iter().map(|pass| apart(pass, &last, 8)).collect();
    assert!(errors[0] > 0.1 && errors[passes.len() - 1] < 0.01, "{errors:?}");
}

#[test]
fn fewer_rays_where_less_is_asked_for() {
    let text = table("64 48", "", WIDE_SUN);
    let exact = Frame::new(&text, 1024, 0.0).draw(&RenderOptions::default());
    let off = |error: f64| apart(&Frame::new(&text, 256, error).draw(&RenderOptions::default()), &exact, 2);
    let (rough, fine) = (off(8.0), off(0.5));
    assert!(rough > 2.0 * fine && fine < 0.03, "{rough} {fine}");
}

#[test]
fn a_shutter_smears_what_moves_and_nothing_else() {
    let sharp = Frame::new(&table("96 72", "", SUN), 64, 0.0);
    let smeared = Frame::new(&table("96 72", "Shutter 1", SUN), 64, 0.0);
    let (sharp, smeared) = (sharp.draw(&RenderOptions::default()), smeared.draw(&RenderOptions::default()));
    // The ball passes the centre; the tent at the left edge does not move.
    let differs = |columns: std::ops::Range<u32>| {
        sharp.enumerate_pixels().any(|(x, y, pixel)| columns.contains(&x) && pixel != smeared.get_pixel(x, y))
    };
    assert!(differs(40..60) && !differs(0..12));
}
