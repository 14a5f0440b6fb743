//! `rayfold-bench sampling --light`: the time to an error of pictures with indirect light, compared with Mitsuba.

use std::f64::consts::PI;
use std::fmt::Write as _;

use anyhow::Result;
use fastrand::Rng;
use glam::DVec3;
use rayfold_scene::Samples;
use rayfold_scene::assets::{Library, MemoryFiles};
use rayfold_tracer::{RenderOptions, Sampler};

use super::curve::{Curve, Point, gathered};
use super::measure::{Args, means, measure};
use super::mitsuba::{self, Truth};
use super::scenes::Picture;
use crate::speed;

/// A picture with indirect light or rough mirrors.
struct Work {
    name: &'static str,
    about: &'static str,
    /// The errors in levels at which times are compared, and the goal for each as a multiple of Mitsuba's speed.
    errors: &'static [f64],
    asked: f64,
    /// The differences of Mitsuba's picture from ours.
    differs: &'static str,
    script: fn() -> String,
}

const WORKS: [Work; 5] = [
    Work {
        name: "window",
        about: "a closed room of 40 objects, sky and sun through a window, `Indirect 4`",
        errors: &[8.0, 4.0],
        asked: 20.0,
        differs: "Sunlight has one bounce less in Mitsuba, because Mitsuba's paths have the same length for all \
                  light.",
        script: || {
            room(
                "Sky 5 6 7\nIlight 12 11 9 1 -.9 -.35 .5\n",
                "Box -2.2 -.1 -3.1 -2 1 3.1 white\nBox -2.2 2.2 -3.1 -2 3 3.1 white\n\
                 Box -2.2 1 -3.1 -2 2.2 -.8 white\nBox -2.2 1 .8 -2 2.2 3.1 white\n",
            )
        },
    },
    Work {
        name: "pane",
        about: "the same room without the window, lit by a disc that glows, `Indirect 4`",
        errors: &[4.0],
        asked: 5.0,
        differs: "",
        script: || {
            room(
                "Material lit glow 9 8.5 7.5\n",
                "Box -2.2 -.1 -3.1 -2 3 3.1 white\nDisc .5 0 2.7999 0 0 -1 0 lit\n",
            )
        },
    },
    Work {
        name: "open",
        about: "30 balls on a floor under a sky of two colours, `Indirect 1`",
        errors: &[1.0],
        asked: 12.0,
        differs: "",
        script: || {
            let mut text = "Indirect 1\nSky .25 .25 .3 .8 .9 1\nLook 0 2.4 7 0 .4 0 40\n".to_owned() + FLOOR;
            let mut dice = Rng::with_seed(30);
            for k in 0..30 {
                let (x, z) = (f64::from(k % 6) - 2.5, f64::from(k / 6) - 2.0);
                let radius = 0.2 + 0.25 * dice.f64();
                let [r, g, b] = [(); 3].map(|()| 0.2 + 0.6 * dice.f64());
                let _ = writeln!(
                    text,
                    "Sphere {radius:.3} {:.3} {radius:.3} {:.3} 0 0 0 {r:.2} {g:.2} {b:.2}",
                    x + 0.3 * dice.f64(),
                    z + 0.3 * dice.f64()
                );
            }
            text
        },
    },
    Work {
        name: "mirrors",
        about: "10 rough mirrors of .2 on a floor, two suns and a sky, no indirect light",
        errors: &[1.0],
        asked: 8.0,
        differs: "Mitsuba's rough mirrors lose the light that their microfacets block, about a fiftieth. The floor is \
                  a Python class that is lit by suns only.",
        script: || {
            let mut text =
                "Depth 4\nSky .3 .35 .4 .6 .7 .8\nIlight .4 .4 .35 1 -1.7 -1\nIlight .25 .25 .3 -1 -1.2 -.4\n\
                            Look 0 2.4 7 0 .4 0 40\nMaterial brushed mirror .8 .75 .7 rough .2\n"
                    .to_owned() + FLOOR;
            for k in 0..10 {
                let (x, z) = (1.2 * f64::from(k % 5) - 2.4, 1.6 * f64::from(k / 5) - 1.0);
                let _ = if k % 3 == 2 {
                    writeln!(text, "Box {} 0 {} {} .9 {} brushed", x - 0.4, z - 0.4, x + 0.4, z + 0.4)
                } else {
                    writeln!(text, "Sphere .5 {x} .5 {z} brushed")
                };
            }
            text
        },
    },
    Work {
        name: "sun",
        about: "diffuse balls and boxes under the picture of a sky with a sun 10,000 times its mean (.0002 sr), `Indirect 1`",
        errors: &[1.0],
        asked: 8.0,
        differs: "",
        script: || {
            "Indirect 1\nSky \"sun.hdr\"\nLook 0 2.4 7 0 .4 0 40\n".to_owned()
                + FLOOR
                + "Material clay diffuse .6 .35 .25\nMaterial slate diffuse .3 .4 .5\nSphere .7 -1.4 .7 0 clay\n\
                   Sphere .5 .2 .5 .8 slate\nBox 1 0 -.6 1.9 1.5 .3 clay\nBox -.6 0 -1.6 .3 1 -.8 slate\nSphere .3 1.4 .3 1.3 slate\n"
        },
    },
];

const FLOOR: &str = "Box -30 -1 -30 30 0 30 0 0 0 .6 .6 .55\n";

/// Returns a room of 36 or more objects with a camera inside.
fn room(lights: &str, wall: &str) -> String {
    let mut text = format!(
        "Indirect 4\n{lights}Look .9 1.5 2.8 -.3 1 -1 62\nMaterial white diffuse .75 .75 .75\n\
         Material red diffuse .7 .2 .15\n{wall}Box -2.2 -.1 -3.1 2.2 0 3.1 white\nBox -2.2 2.8 -3.1 2.2 3 3.1 white\n\
         Box -2.2 -.1 -3.2 2.2 3 -3 white\nBox -2.2 -.1 3 2.2 3 3.2 white\nBox 2 -.1 -3.1 2.2 3 3.1 red\n"
    );
    let mut dice = Rng::with_seed(40);
    for k in 0..31 {
        let (x, z) = (0.55 * f64::from(k % 6) - 1.6, 0.6 * f64::from(k / 6) - 2.6);
        let size = 0.1 + 0.12 * dice.f64();
        let colors = [(); 3].map(|()| 0.2 + 0.6 * dice.f64()).map(|c| format!("{c:.2}")).join(" ");
        let _ = if k % 2 == 0 {
            writeln!(text, "Sphere {size:.3} {x:.3} {size:.3} {z:.3} 0 0 0 {colors}")
        } else {
            let height = 0.3 + 0.7 * dice.f64();
            let (low, high) = ([x - size, 0.0, z - size], [x + size, height, z + size]);
            let corners =
                [low, high].concat().iter().map(|c| format!("{c:.3}")).collect::<Vec<_>>().join(" ");
            writeln!(text, "Box {corners} 0 0 0 {colors}")
        };
    }
    text
}

/// The picture of a sky with a small sun, as a file.
fn sun() -> Vec<u8> {
    let (width, height) = (1024u32, 512u32);
    let towards = DVec3::new(0.5, 0.6, 0.62).normalize();
    let rim = 1.0 - 2e-4 / (2.0 * PI);
    let mut file = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n").into_bytes();
    for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
        let latitude = PI * (0.5 - (f64::from(y) + 0.5) / f64::from(height));
        let longitude = 2.0 * PI * ((f64::from(x) + 0.5) / f64::from(width) - 0.5);
        let level = latitude.cos();
        let along = DVec3::new(level * longitude.sin(), latitude.sin(), -level * longitude.cos());
        let base = if along.y > 0.0 { 0.3 + 0.5 * along.y } else { 0.12 };
        let light = if along.dot(towards) > rim {
            DVec3::new(3000.0, 2700.0, 2400.0)
        } else {
            base * DVec3::new(0.8, 0.9, 1.0)
        };
        let exponent = light.max_element().log2().floor() + 1.0;
        let parts = light * (256.0 / exponent.exp2());
        file.extend(parts.to_array().map(|part| part as u8));
        file.push((exponent + 128.0) as u8);
    }
    file
}

impl Work {
    fn picture(&self, (width, height): (u32, u32)) -> Result<Picture> {
        let text = format!("Screen {width} {height}\n{}Trace\n", (self.script)());
        Picture::with_files(self.name, &text, &Library::new(MemoryFiles::from([("sun.hdr", sun())])))
    }
}

/// Returns the maximum number of samples of a pixel, and an error, which also depends on the work.
fn limits(work: &Work) -> Vec<(&'static str, (u32, f64))> {
    let mut limits: Vec<_> = [4, 16, 64, 256].map(|count| ("uniform", (count, 0.0))).into();
    let least = work.errors.iter().copied().fold(f64::INFINITY, f64::min);
    limits.extend([4.0, 2.0, 1.0].map(|factor| ("adaptive", (4096, factor * least))));
    limits
}

/// A work that we have drawn, and Mitsuba if it is installed.
struct Compared {
    work: &'static Work,
    curves: Vec<Curve>,
    peer: Option<Truth>,
    /// The mean level of our picture.
    level: f64,
}

/// Measures and writes the report.
///
/// # Errors
/// Fails if a picture cannot be drawn, or a file cannot be written.
pub(super) fn run(args: &Args) -> Result<()> {
    let size = (args.width, args.width * 3 / 4);
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut all = vec![];
    for work in WORKS.iter().filter(|work| args.only.as_ref().is_none_or(|only| only == work.name)) {
        let picture = work.picture(size)?;
        let others = RenderOptions { sampler: Sampler::Others(1), ..RenderOptions::default() };
        let truth = means(&picture, Samples::new(args.truth, 0.0)?, &others)?;
        let shown = truth.means.iter().map(|mean| mean.clamp(DVec3::ZERO, DVec3::ONE).element_sum());
        let level = 255.0 * shown.sum::<f64>() / (3 * truth.means.len()) as f64;
        let mut curves: Vec<Curve> = vec![];
        let least = work.errors.iter().copied().fold(f64::INFINITY, f64::min);
        for (way, (most, error)) in limits(work) {
            let good = |curve: &Curve| curve.points.iter().any(|point| point.error < least);
            if curves.iter().any(|curve| curve.way == way && good(curve)) {
                continue;
            }
            let asked = Samples::new(most, error)?;
            let row = one.install(|| {
                measure(work.name, way, &picture, asked, &RenderOptions::default(), &truth.means)
            })?;
            let ms = 1e3 * row.seconds;
            eprintln!(
                "{:8} {way:9} {most:4} {error:4}: {ms:9.1} ms {:7.2} rays, error {:6.3}",
                work.name, row.rays, row.error
            );
            let point = Point { ms, rays: row.rays, error: row.error, off: row.off };
            match curves.iter_mut().find(|curve| curve.way == way) {
                Some(curve) => curve.points.push(point),
                None => {
                    curves.push(Curve {
                        work: work.name,
                        peer: None,
                        way: way.to_owned(),
                        points: vec![point],
                    });
                }
            }
        }
        let peer = if speed::mitsuba::is_here() {
            let drawn = mitsuba::draw(work.name, &picture.scene, least, true)?;
            curves.extend(drawn.curves);
            Some(drawn.truth)
        } else {
            None
        };
        all.push(Compared { work, curves, peer, level });
    }
    let page = page(args, size, &all)?;
    if args.check {
        eprint!("{page}");
        return Ok(());
    }
    args.output.write("light.md", page)
}

fn page(args: &Args, (width, height): (u32, u32), all: &[Compared]) -> Result<String> {
    let mut page = format!(
        "# Indirect light and rough mirrors: the time to an error\n\n\
         Written by `rayfold-bench sampling --light`. Pictures have {width} x {height} pixels and are drawn on one \
         thread. Times are processor times of preparation and drawing, the shortest of three runs. The error is the \
         root mean square over pixels and channels in levels (0..255) of the clamped means. It is measured against the \
         same picture with {} other samples in every pixel. *Adaptive* pictures use `Samples 4096 e`. Times are \
         interpolated between neighbouring measurements. A dash means that no measurement reached the error. *Asked* \
         is the goal for the ratio.\n\n",
        args.truth
    );
    let Some(version) = all.iter().find_map(|one| Some(&one.peer.as_ref()?.version)) else {
        page += "Mitsuba is not on this machine: not measured.\n\n";
        return Ok(page);
    };
    write!(
        page,
        "Mitsuba {version} (LLVM variant, single precision, box filter) draws with `path` without Russian roulette, \
         and the best of its samplers counts. Its time is that of drawing alone; its kernels are compiled before. Its \
         surfaces are `diffuse` and `roughconductor` (GGX, without a material, so that it reflects everything). Its \
         lights are `area`, `constant` and `envmap`; suns are a Python class. Its error is estimated from pairs of \
         pictures with different seeds.\n\n\
         | picture | mean level, ours | Mitsuba's | error | ours, ms | way | Mitsuba, ms | Mitsuba / ours | asked |\n\
         | --- | ---: | ---: | ---: | ---: | --- | ---: | ---: | ---: |\n"
    )?;
    for Compared { work, curves, peer, level } in all {
        let ways = gathered(curves, work.name);
        for &error in work.errors {
            let of = |is_peer: bool| {
                let times = ways
                    .iter()
                    .filter(|curve| curve.peer.is_some() == is_peer)
                    .filter_map(|curve| Some((curve.time(error)?, &curve.way)));
                times.min_by(|a, b| a.0.total_cmp(&b.0))
            };
            let number =
                |number: Option<f64>| number.map_or("–".to_owned(), |number| format!("{number:.0}"));
            let (ours, theirs) = (of(false), of(true));
            let ratio = ours.zip(theirs).map_or("–".to_owned(), |(a, b)| format!("{:.1}", b.0 / a.0));
            writeln!(
                page,
                "| {} | {level:.1} | {} | {error} | {} | {} | {} | {ratio} | {} |",
                work.about,
                peer.as_ref().map_or("–".to_owned(), |peer| format!("{:.1}", peer.level)),
                number(ours.map(|(ms, _)| ms)),
                ours.map_or("–", |(_, way)| way),
                number(theirs.map(|(ms, _)| ms)),
                work.asked
            )?;
        }
    }
    page.push('\n');
    for one in all.iter().filter(|one| !one.work.differs.is_empty()) {
        writeln!(page, "{}: {}\n", one.work.about, one.work.differs)?;
    }
    Ok(page.trim_end().to_owned() + "\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_work_is_drawn_and_described() {
        for work in &WORKS {
            let picture = work.picture((16, 12)).unwrap();
            mitsuba::describe(&picture.scene, 1.0, true).unwrap();
            let asked = Samples::new(4, 0.0).unwrap();
            let drawn = super::super::measure::means(&picture, asked, &RenderOptions::default()).unwrap();
            let mean = drawn.means.iter().map(|mean| mean.element_sum()).sum::<f64>() / (3.0 * 192.0);
            assert!((0.1..0.9).contains(&mean), "{}: {mean}", work.name);
        }
    }
}
