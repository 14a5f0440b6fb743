//! The works for which the times to an error are measured: the scene of the report on speed with more and more effects,
//! and the options with which POV-Ray draws it.

use std::fmt::Write as _;

use anyhow::Result;
use rayfold_scene::Scene;

use super::scenes::Picture;
use crate::scenes::table;

/// A scene that is drawn, with its size.
pub(super) struct Work {
    pub(super) name: &'static str,
    pub(super) about: &'static str,
    pub(super) size: (u32, u32),
    /// The apparent diameter of the suns in degrees.
    pub(super) sun: f64,
    pub(super) lens: f64,
    pub(super) moves: bool,
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
    /// Returns the scene at rest, for renderers that do not read our language.
    pub(super) fn scene(&self) -> Result<Scene> {
        table(self.size.0, self.size.1)
    }

    /// Returns the scene with all effects of the work.
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

/// The options of POV-Ray that smooth edges.
pub(super) const PEER: [&[&str]; 8] = [
    &["+A0.3", "+AM1", "+R2", "-J"],
    &["+A0.1", "+AM1", "+R2", "-J"],
    &["+A0.03", "+AM1", "+R2", "-J"],
    &["+A0.1", "+AM1", "+R3", "-J"],
    &["+A0.03", "+AM1", "+R4", "-J"],
    &["+A0.1", "+AM2", "+R2", "-J"],
    &["+A0.03", "+AM2", "+R3", "-J"],
    &["+A0.01", "+AM1", "+R6", "-J"],
];
