//! The scene of the report on speed as pictures whose pixels are means: the time to an error, beside other renderers.

use std::fmt::Write as _;

use anyhow::Result;
use rayfold_scene::{Samples, Scene};
use rayfold_tracer::RenderOptions;

use super::scenes::Picture;
use super::{Args, measure, shortest, truth};
use crate::backends::levels;
use crate::scenes::table;

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

pub(super) fn run(args: &Args) -> Result<()> {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    for work in WORKS.iter().filter(|work| args.only.as_ref().is_none_or(|only| only == work.name)) {
        let picture = work.picture()?;
        let truth = truth(&picture, args.truth)?;
        for (level_name, level) in levels().into_iter().take(2) {
            let options = RenderOptions { level: Some(level), ..RenderOptions::default() };
            let single = one.install(|| shortest(&picture, Samples::default(), &options))?;
            eprintln!("{:8} {level_name:8} one ray a pixel: {:.2} ms", work.name, 1e3 * single);
            for (most, error) in ASKED {
                let way = if error > 0.0 { "adaptive" } else { "uniform" };
                let asked = Samples::new(most, error)?;
                let row = one.install(|| measure(work.name, way, &picture, asked, &options, &truth.means))?;
                eprintln!(
                    "{:8} {level_name:8} {:8} {most:5} {error:5}: {:8.2} ms {:7.2} rays, {:5.1} ns a ray, error {:6.3}, {:.3} % off",
                    row.effect,
                    row.way,
                    1e3 * row.seconds,
                    row.rays,
                    1e9 * row.seconds / (row.rays * f64::from(work.size.0 * work.size.1)),
                    row.error,
                    100.0 * row.off,
                );
            }
        }
    }
    Ok(())
}
