//! The scene of the report on speed as pictures whose pixels are means: the time to an error, beside other renderers.

use std::fmt::Write as _;

use anyhow::Result;
use glam::DVec3;
use rayfold_scene::{Samples, Scene};
use rayfold_tracer::RenderOptions;

use super::measure::{Args, measure, root_mean_square, shortest, truth};
use super::scenes::Picture;
use crate::backends::levels;
use crate::plot::{Labels, Series, log_log};
use crate::scenes::table;
use crate::speed::povray;

/// What is drawn, and how large.
pub(super) struct Work {
    pub(super) name: &'static str,
    pub(super) about: &'static str,
    pub(super) size: (u32, u32),
    /// Degrees across the suns.
    sun: f64,
    lens: f64,
    moves: bool,
}

pub(super) const WORKS: [Work; 4] = [
    Work {
        name: "edges",
        about: "edges, the full frame",
        size: (1024, 768),
        sun: 0.0,
        lens: 0.0,
        moves: false,
    },
    Work {
        name: "soft",
        about: "edges and soft shadows, a quarter of it",
        size: (512, 384),
        sun: 4.0,
        lens: 0.0,
        moves: false,
    },
    Work {
        name: "lens",
        about: "edges, soft shadows and a lens, a quarter of it",
        size: (512, 384),
        sun: 4.0,
        lens: 0.05,
        moves: false,
    },
    Work {
        name: "motion",
        about: "edges, soft shadows, a lens and motion, a quarter of it",
        size: (512, 384),
        sun: 4.0,
        lens: 0.05,
        moves: true,
    },
];

impl Work {
    /// The scene at rest, for renderers that share no language with us.
    pub(super) fn scene(&self) -> Result<Scene> {
        table(self.size.0, self.size.1)
    }

    /// The scene with all that the work has.
    pub(super) fn picture(&self) -> Result<Picture> {
        let mut text = String::new();
        let mut balls = 0;
        for line in self.scene()?.to_string().lines() {
            let words: Vec<&str> = line.split_whitespace().collect();
            match words[..] {
                ["Ilight", ..] if self.sun > 0.0 => writeln!(text, "{line} {}", self.sun)?,
                // Every fourth ball rolls a little to the right.
                ["Sphere", radius, x, ref others @ ..] if self.moves => {
                    balls += 1;
                    if balls % 4 == 1 {
                        let x: f64 = x.parse()?;
                        writeln!(text, "Sphere {radius} (1:{} 2:{}) {}", x - 0.2, x + 0.2, others.join(" "))?;
                    } else {
                        writeln!(text, "{line}")?;
                    }
                }
                ["Trace"] => {
                    if self.lens > 0.0 {
                        writeln!(text, "Lens {} 9.5", self.lens)?;
                    }
                    writeln!(text, "{line}")?;
                }
                _ => writeln!(text, "{line}")?,
            }
        }
        if self.moves {
            text = format!("Frames 2 2\nShutter .6\n{text}");
        }
        Picture::new(self.name, &text)
    }
}

/// What pictures are asked for: at most so many rays a pixel, and an error.
const ASKED: [(u32, f64); 10] = [
    (4, 0.0),
    (16, 0.0),
    (64, 0.0),
    (16, 8.0),
    (16, 4.0),
    (64, 3.0),
    (64, 2.0),
    (256, 1.5),
    (256, 1.0),
    (256, 0.7),
];

/// The ways of POV-Ray to smooth edges.
const PEER: [&[&str]; 8] = [
    &["+A0.3", "+AM1", "+R2", "-J"],
    &["+A0.1", "+AM1", "+R2", "-J"],
    &["+A0.03", "+AM1", "+R2", "-J"],
    &["+A0.1", "+AM1", "+R3", "-J"],
    &["+A0.03", "+AM1", "+R4", "-J"],
    &["+A0.1", "+AM2", "+R2", "-J"],
    &["+A0.03", "+AM2", "+R3", "-J"],
    &["+A0.01", "+AM1", "+R6", "-J"],
];

/// The errors at which times are given.
const ERRORS: [f64; 4] = [2.0, 1.0, 0.5, 0.25];

/// Times and errors of a way to draw a work.
struct Curve {
    work: &'static str,
    way: String,
    /// Milliseconds, rays a pixel where they are known, error, share of pixels off by more than 4 levels.
    points: Vec<(f64, f64, f64, f64)>,
}

impl Curve {
    /// The least time for an error, between neighbours on the curve by powers; none where it does not reach there.
    fn time(&self, error: f64) -> Option<f64> {
        let mut points: Vec<(f64, f64)> = self.points.iter().map(|&(ms, _, error, _)| (ms, error)).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        // What is slower and no better does not count.
        let mut best = f64::INFINITY;
        points.retain(|&(_, error)| error < best && ((best = error), true).1);
        if points.first().is_some_and(|&(_, first)| first <= error) {
            return points.first().map(|&(ms, _)| ms);
        }
        points.windows(2).find(|pair| pair[1].1 <= error).map(|pair| {
            let [(t0, e0), (t1, e1)] = [pair[0], pair[1]];
            t0 * (t1 / t0).powf((error / e0).ln() / (e1 / e0).ln())
        })
    }
}

pub(super) fn run(args: &Args) -> Result<()> {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let (mut curves, mut singles) = (vec![], vec![]);
    for work in WORKS.iter().filter(|work| args.only.as_ref().is_none_or(|only| only == work.name)) {
        let picture = work.picture()?;
        let truth = truth(&picture, args.truth)?;
        for (level_name, level) in levels().into_iter().take(2) {
            let options = RenderOptions { level: Some(level), ..RenderOptions::default() };
            let single = 1e3 * one.install(|| shortest(&picture, Samples::default(), &options))?;
            singles.push((work.name, level_name, single));
            for way in ["adaptive", "uniform"] {
                let mut curve =
                    Curve { work: work.name, way: format!("{way}, {level_name}"), points: vec![] };
                for (most, error) in
                    ASKED.into_iter().filter(|(_, error)| (*error > 0.0) == (way == "adaptive"))
                {
                    let asked = Samples::new(most, error)?;
                    let row =
                        one.install(|| measure(work.name, way, &picture, asked, &options, &truth.means))?;
                    eprintln!(
                        "{:8} {:18} {most:4} {error:4}: {:8.2} ms {:7.2} rays, error {:6.3}, {:.3} % off",
                        work.name,
                        curve.way,
                        1e3 * row.seconds,
                        row.rays,
                        row.error,
                        100.0 * row.off
                    );
                    curve.points.push((1e3 * row.seconds, row.rays, row.error, row.off));
                }
                curves.push(curve);
            }
        }
        if work.name == "edges" && povray::is_here() {
            curves.push(peer(work, &truth.means)?);
        }
    }
    if args.check { Ok(()) } else { write(args, &curves, &singles) }
}

/// POV-Ray's times, without those of starting and reading the scene, and its errors.
fn peer(work: &Work, truth: &[DVec3]) -> Result<Curve> {
    let folder = tempfile::tempdir()?;
    let scene = work.scene()?;
    let mut curve = Curve { work: work.name, way: "POV-Ray".to_owned(), points: vec![] };
    for options in PEER {
        let start = povray::render_as(&scene, folder.path(), (8, 6), options)?.0;
        let (seconds, image) = povray::render_as(&scene, folder.path(), work.size, options)?;
        let levels = image.pixels().map(|pixel| DVec3::from_array(pixel.0.map(f64::from)));
        let errors: Vec<DVec3> = levels.zip(truth).map(|(levels, truth)| levels - 255.0 * *truth).collect();
        let off = errors.iter().filter(|error| error.abs().max_element() > 4.0).count() as f64
            / errors.len() as f64;
        let (ms, error) = (1e3 * (seconds - start), root_mean_square(&errors));
        eprintln!(
            "{:8} POV-Ray {options:?}: {ms:.0} ms, error {error:.3}, {:.3} % off",
            work.name,
            100.0 * off
        );
        curve.points.push((ms, f64::NAN, error, off));
    }
    Ok(curve)
}

fn write(args: &Args, curves: &[Curve], singles: &[(&str, &str, f64)]) -> Result<()> {
    let mut table = csv::Writer::from_path(args.output.join("time-to-error.csv"))?;
    table.write_record(["work", "way", "ms", "rays a pixel", "error", "off by > 4 %"])?;
    for curve in curves {
        for &(ms, rays, error, off) in &curve.points {
            let numbers = [ms, rays, error, 100.0 * off].map(|number| format!("{number:.4}"));
            table.write_record([curve.work.to_owned(), curve.way.clone()].into_iter().chain(numbers))?;
        }
    }
    table.flush()?;
    let mut page = format!(
        "# Time to an error\n\n\
         Written by `rayfold-bench sampling --targets`; all figures are in [time-to-error.csv](time-to-error.csv). The scene of \
         the [report on speed](speed.md): 26 objects, two suns, mirrors. One thread, processor time of preparing and drawing, the \
         shortest of three runs; the full frame is 1024 x 768, a quarter of it 512 x 384. Soft shadows are those of suns of 4 \
         degrees; the lens has a radius of .05 at a distance of about 10; every fourth ball moves. An error is the root mean square \
         over pixels and channels in levels (0..255) from the truth, the same picture in `f64` with {} samples in every pixel. \
         Times are read off the line between neighbouring measurements; a dash stands where none was as good.\n\n\
         Of POV-Ray the best of {} settings (`+A`, `+AM`, `+R`, `-J`) counts, drawing alone; its picture has whole levels, which \
         are an error of .29.\n\n",
        args.truth,
        PEER.len()
    );
    for work in &WORKS {
        let own: Vec<&Curve> = curves.iter().filter(|curve| curve.work == work.name).collect();
        if own.is_empty() {
            continue;
        }
        let single: Vec<String> = singles
            .iter()
            .filter(|(name, ..)| *name == work.name)
            .map(|(_, level, ms)| format!("{ms:.1} ms with {level}"))
            .collect();
        writeln!(page, "## {}\n\nOne ray a pixel takes {}.\n", work.about, single.join(", "))?;
        page += "| ms to an error of | 2 | 1 | .5 | .25 |\n| --- | --- | --- | --- | --- |\n";
        for curve in &own {
            write!(page, "| {} |", curve.way)?;
            for error in ERRORS {
                let time = curve.time(error).map_or("–".to_owned(), |ms| format!("{ms:.0}"));
                write!(page, " {time} |")?;
            }
            page += "\n";
        }
        if let (Some(peer), Some(first)) = (own.iter().find(|curve| curve.way == "POV-Ray"), own.first()) {
            write!(page, "| POV-Ray / {} |", first.way)?;
            for error in ERRORS {
                let ratio = peer
                    .time(error)
                    .zip(first.time(error))
                    .map(|(theirs, ours)| format!("{:.1}", theirs / ours));
                write!(page, " {} |", ratio.unwrap_or("–".to_owned()))?;
            }
            page += "\n";
        }
        let series: Vec<Series> = own
            .iter()
            .map(|curve| Series {
                name: curve.way.clone(),
                points: curve.points.iter().map(|&(ms, _, error, _)| (ms, error)).collect(),
                joined: curve.way != "POV-Ray",
            })
            .collect();
        let file = format!("time-to-error-{}.svg", work.name);
        let labels = Labels { title: work.about, x: "processor time, ms", y: "error, levels" };
        log_log(&args.output.join(&file), &labels, &series)?;
        writeln!(page, "\n![{}]({file})\n", work.about)?;
    }
    std::fs::write(args.output.join("time-to-error.md"), page.trim_end().to_owned() + "\n")?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_read_off_the_best_measurements() {
        let points = [(10.0, 0.0, 2.0, 0.0), (15.0, 0.0, 3.0, 0.0), (40.0, 0.0, 0.5, 0.0)];
        let curve = Curve { work: "", way: String::new(), points: points.to_vec() };
        assert_eq!(curve.time(2.5), Some(10.0));
        assert!((curve.time(1.0).unwrap() - 20.0).abs() < 1e-9);
        assert_eq!(curve.time(0.4), None);
    }
}
