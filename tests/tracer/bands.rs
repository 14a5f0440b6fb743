//! Rows of a picture that are drawn separately equal those of the whole picture, bit for bit. This holds for any
//! division and any scene, with one ray per pixel, with many, and with adaptive sampling.
//!
//! Scenes and divisions are random; a failure prints the seed. `RAYFOLD_SEED` sets another one.

use std::fmt::Write as _;
use std::ops::Range;

use super::dice::Dice;
use glam::DVec3;
use image::RgbImage;
use rayfold_scene::{Limits, Samples, Script, parse};
use rayfold_tracer::{Drawing, Exposure, Level, Precision, RenderOptions};

const SEED: u64 = 20_261_123;

/// Returns three numbers of a line.
fn triple(v: DVec3) -> String {
    format!(" {:.4} {:.4} {:.4}", v.x, v.y, v.z)
}

impl Dice {
    fn paint(&mut self) -> String {
        let (ambient, diffuse, mirror) = (0.1 * self.color(), self.color(), 0.6 * self.color());
        let mirror = if self.0.u8(0..3) == 0 { triple(mirror) } else { String::new() };
        format!("{}{}{mirror}", triple(ambient), triple(diffuse))
    }

    fn object_line(&mut self, is_moving: bool) -> String {
        let at = self.point(2.5);
        let paint = self.paint();
        let place = if is_moving {
            let x = format!(" (1:{:.4} 3:{:.4})", at.x, at.x + self.within(-2.0, 2.0));
            format!("{x} {:.4} {:.4}", at.y, at.z)
        } else {
            triple(at)
        };
        match self.0.u8(0..6) {
            0 | 1 => format!("Sphere {:.4}{place}{paint}", self.within(0.1, 0.8)),
            2 => format!("Box{}{}{paint}", triple(at), triple(at + 0.2 + 0.8 * self.color())),
            3 => format!(
                "Triangle{}{}{}{paint}",
                triple(at),
                triple(at + self.point(1.5)),
                triple(at + self.point(1.5))
            ),
            4 => format!("Cone .4 .1{}{}{paint}", triple(at), triple(at + DVec3::Y)),
            _ => format!("Sphere {:.4}{place} pane", self.within(0.2, 0.6)),
        }
    }

    /// Returns a script of random size with random features.
    fn script(&mut self, samples: (u32, f64)) -> String {
        let (columns, rows) = (self.0.u32(1..130), self.0.u32(1..260));
        let mut text = format!("Screen {columns} {rows}\n");
        match self.0.u8(0..5) {
            0 => text.push_str("Orthocamera\n"),
            _ => writeln!(text, "Look{}  0 0 0  50", triple(8.0 * self.point(1.0).normalize())).unwrap(),
        }
        let (n, error) = samples;
        writeln!(text, "Samples {n} {error}\nDepth {}", self.0.u8(0..6)).unwrap();
        writeln!(text, "Background{}{}", triple(self.color()), triple(self.color())).unwrap();
        let is_moving = self.0.u8(0..3) == 0;
        for line in ["Lens .1 8", "Tone srgb"] {
            if self.0.u8(0..3) == 0 {
                writeln!(text, "{line}").unwrap();
            }
        }
        if is_moving {
            text.push_str("Shutter .8\n");
        }
        text.push_str("Material pane glass .9 .95 .9 1.5\n");
        for _ in 0..self.0.u8(0..3) {
            let light = match self.0.u8(0..3) {
                0 => "Ilight .6 .6 .5  1 -1.7 -1",
                1 => "Ilight .6 .6 .5  1 -1.7 -1  9",
                _ => "Plight .9 .8 .6  -2.5 4 3  .6",
            };
            writeln!(text, "{light}").unwrap();
        }
        if self.0.bool() {
            text.push_str("Plane 0 -2 0  0 1 0  .1 .1 .1  .6 .6 .6\n");
        }
        let count = [1, 4, 20, 120][self.0.usize(0..4)];
        for _ in 0..count {
            writeln!(text, "{}", self.object_line(is_moving)).unwrap();
        }
        // Objects narrower than a pixel.
        for _ in 0..self.0.u8(0..3) {
            let (a, b, c) = (self.point(3.0), self.point(3.0), self.point(2.0));
            writeln!(text, "Cylinder .002{}{}{}", triple(a), triple(b), self.paint()).unwrap();
            writeln!(text, "Sphere .005{}{}", triple(c), self.paint()).unwrap();
        }
        text.push_str("Frames 2 2\nTrace\n");
        text
    }

    /// Returns random ranges of rows, some of them adjacent.
    fn cut(&mut self, height: u32) -> Vec<Range<u32>> {
        let mut edges: Vec<u32> = (0..self.0.usize(1..6)).map(|_| self.0.u32(0..=height)).collect();
        edges.extend([0, height]);
        edges.sort_unstable();
        edges.dedup();
        edges.windows(2).map(|edge| edge[0]..edge[1]).collect()
    }
}

fn script(text: &str) -> Script {
    let parsed = parse("a.txt", text.as_bytes(), &Limits::default());
    parsed.script.unwrap_or_else(|| panic!("{:?}\n{text}", parsed.diagnostics))
}

fn with_drawing<T>(script: &Script, options: &RenderOptions, then: impl FnOnce(&Drawing) -> T) -> T {
    let scene = script.frame(0).unwrap();
    let after = |frames| script.frame_after(0, frames).unwrap();
    then(&Drawing::exposed(Exposure::moving(&scene, &after), options).unwrap())
}

/// Returns bands joined below each other.
fn joined(bands: &[RgbImage]) -> Vec<u8> {
    bands.iter().flat_map(|band| band.as_raw()).copied().collect()
}

fn hold(dice: &mut Dice, text: &str, options: &RenderOptions) {
    let script = script(text);
    with_drawing(&script, options, |drawing| {
        let whole = drawing.draw().unwrap();
        let cut = dice.cut(whole.height());
        // Each band is drawn separately, like by another process.
        let draw = |rows: &Range<u32>| {
            with_drawing(&script, options, |drawing| drawing.draw_rows(rows.clone()).unwrap())
        };
        let bands: Vec<RgbImage> = cut.iter().map(draw).collect();
        for (rows, band) in cut.iter().zip(&bands) {
            assert_eq!(band.dimensions(), (whole.width(), rows.end - rows.start), "{rows:?}");
        }
        let is_same = joined(&bands) == *whole.as_raw();
        assert!(is_same, "{cut:?} of\n{text}");
    });
}

fn options(dice: &mut Dice) -> RenderOptions<'static> {
    RenderOptions {
        precision: [Precision::Auto, Precision::F32, Precision::F64][dice.0.usize(0..3)],
        tile: [None, None, Some((16, 16)), Some((4, 4)), Some((8, 32))][dice.0.usize(0..5)],
        ..Default::default()
    }
}

#[test]
fn bands_of_one_ray_a_pixel_are_the_whole() {
    let mut dice = Dice::new("bands of one ray", SEED);
    for _ in 0..150 {
        let (text, options) = (dice.script((1, 0.0)), options(&mut dice));
        hold(&mut dice, &text, &options);
    }
}

#[test]
fn bands_of_many_rays_a_pixel_are_the_whole() {
    let mut dice = Dice::new("bands of many rays", SEED);
    for _ in 0..20 {
        let (text, options) = (dice.script((5, 0.0)), options(&mut dice));
        hold(&mut dice, &text, &options);
    }
}

#[test]
fn bands_of_as_many_rays_as_neighbours_ask_for_are_the_whole() {
    let mut dice = Dice::new("bands of adaptive rays", SEED);
    for _ in 0..40 {
        let most = 1 << dice.0.u32(1..8);
        let error = dice.within(0.3, 4.0);
        let (text, options) = (dice.script((most, error)), options(&mut dice));
        hold(&mut dice, &text, &options);
    }
}

/// Along slivers the requests for more rays spread from pixel to pixel, from top to bottom, across every division.
#[test]
fn what_goes_on_from_neighbour_to_neighbour_goes_on_over_a_cut() {
    let mut dice = Dice::new("slivers over cuts", SEED);
    for tilt in [0.0, 0.3, 2.5] {
        let text = format!(
            "Screen 24 900\nCamera 0 0 10  0 0 -1  0 1 0  1  -.02 -.6 .02 .6\nSamples 64 1\n\
             Triangle -.01 -9 0  .01 -9 0  {tilt} 9 0  1 1 1  0 0 0\nTrace\n"
        );
        hold(&mut dice, &text, &RenderOptions::default());
    }
}

/// Few pixels see a thin line at first. Adaptive sampling follows the line, but from each pixel no farther than a
/// band's margin, so a division anywhere changes nothing.
#[test]
fn what_would_go_on_for_ever_ends_at_the_margin() {
    let mut dice = Dice::new("a thin line over cuts", SEED);
    for width in [2e-5, 4e-5, 8e-5] {
        let text = format!(
            "Screen 9 1500\nCamera 0 0 10  0 0 -1  0 1 0  1  -.006 -1 .006 1\nSamples 1024 .1\n\
             Box -{width} -12 -1  {width} 12 0  1 1 1  0 0 0\nTrace\n"
        );
        for _ in 0..3 {
            hold(&mut dice, &text, &RenderOptions::default());
        }
    }
}

/// The plain tracer draws scenes whose values the kernels cannot represent.
#[test]
fn bands_of_the_plain_tracer_are_the_whole() {
    let mut dice = Dice::new("bands of the plain tracer", SEED);
    for samples in [1, 3] {
        let text = format!(
            "Screen 30 41\nOrthocamera\nSamples {samples}\nSphere 1e300 0 0 -1e301  .3 .3 .3 .5 .5 .5\n\
             Sphere 5 0 0 -9  .1 .2 .3 .5 .5 .5\nIlight 1 1 1 0 -1 -1\nTrace\n"
        );
        hold(&mut dice, &text, &RenderOptions::default());
    }
    #[cfg(target_arch = "x86_64")]
    {
        let text = dice.script((3, 1.0));
        let level = Some(Level::baseline());
        hold(&mut dice, &text, &RenderOptions { level, ..Default::default() });
    }
}

#[test]
fn rows_beside_a_band_are_asked_for_only_where_they_have_a_say() {
    let text = "Screen 64 64\nLook 0 0 8  0 0 0  40\nSamples 64 1\nSphere 2 0 0 0  .3 .3 .3 .6 .6 .6\nIlight 1 1 1  1 -1 -1  12\nTrace\n";
    let script = script(text);
    with_drawing(&script, &RenderOptions::default(), |drawing| {
        assert!(drawing.margin() > 0);
        assert_eq!(drawing.draw_rows(20..20).unwrap().height(), 0);
        assert_eq!(drawing.draw_rows(60..99).unwrap().height(), 4);
        drawing.sketch_rows(16..32).unwrap();
    });
    let mut plain = script.frame(0).unwrap();
    plain.samples = Samples::new(64, 0.0).unwrap();
    let options = RenderOptions::default();
    assert_eq!(Drawing::new(&plain, &options).unwrap().margin(), 0);
}
