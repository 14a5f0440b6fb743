//! The pictures for which sampling is measured: each effect alone, and all together.

use anyhow::{Context, Result};
use rayfold_scene::assets::Library;
use rayfold_scene::{Limits, Scene, Script, parse_with_files};

/// A picture and its purpose.
pub(super) struct Effect {
    pub(super) name: &'static str,
    pub(super) about: &'static str,
    text: &'static str,
}

/// A picture, and its scene at other moments.
pub(super) struct Picture {
    script: Script,
    pub(super) scene: Scene,
}

impl Picture {
    /// Returns the first frame of a script.
    pub(super) fn new(name: &str, text: &str) -> Result<Self> {
        Self::with_files(name, text, &Library::none())
    }

    /// Returns the first frame of a script that names files.
    pub(super) fn with_files(name: &str, text: &str, library: &Library) -> Result<Self> {
        let parsed = parse_with_files(name, text.as_bytes(), &Limits::default(), library);
        let script = parsed.script.with_context(|| format!("{name}: {:?}", parsed.diagnostics))?;
        let scene = script.frame(0).context("no frame")?;
        Ok(Self { script, scene })
    }

    /// Returns the scene this many frames after the middle of the exposure.
    pub(super) fn after(&self, frames: f64) -> Scene {
        let moment = self.script.frame_after(0, frames).unwrap_or_else(|| self.scene.clone());
        Scene { screen: self.scene.screen, ..moment }
    }
}

impl Effect {
    pub(super) fn picture(&self, (width, height): (u32, u32)) -> Result<Picture> {
        Picture::new(self.name, &format!("Screen {width} {height}\n{}Trace\n", self.text))
    }
}

/// Balls, bricks and a tent on a floor, two lights, a mirror: the scene for edges, and for all effects together.
macro_rules! table {
    ($sun:literal, $lamp:literal, $camera:literal, $ball:literal) => {
        concat!(
            "Look 0 3.4 8  0 .7 0  34\n",
            $camera,
            "Background .55 .65 .8\n",
            "Ilight .6 .6 .55  1 -1.7 -1",
            $sun,
            "\n",
            $lamp,
            "Box -30 -1 -30 30 0 30  .1 .1 .1 .5 .5 .45\n",
            "Sphere .9 -1.6 .9 -.4  .04 .04 .04 .2 .2 .2 .6 .6 .6\n",
            "Sphere .5 ",
            $ball,
            " 1.2  .08 .02 .02 .8 .2 .15\n",
            "Sphere .35 -.6 .35 1.9  .02 .06 .02 .2 .7 .3\n",
            "Sphere .6 2.1 .6 -1  .06 .05 .02 .7 .6 .2\n",
            "Box 1.2 0 -2.4 2.0 1.9 -1.6  .02 .03 .08 .2 .35 .8\n",
            "Box -.5 0 -3 .3 1.2 -2.2  .06 .02 .06 .6 .25 .6\n",
            "Triangle -3.2 0 -2  -2.6 2.6 -2.2  -1.9 0 -2.4  .1 .1 .02 .7 .7 .2\n",
            "Triangle 2.4 0 .6  2.9 1.4 .2  3.3 0 .9  .02 .1 .1 .2 .7 .7\n",
        )
    };
}

/// The effects that are measured.
pub(super) const EFFECTS: [Effect; 8] = [
    Effect {
        name: "edges",
        about: "hard edges and shadows, and their mirror images",
        text: table!("", "", "", ".55 .5"),
    },
    Effect {
        name: "horizon",
        about: "a checkered plane to the horizon",
        text: "Look 0 1 0  0 .85 -1  50\nBackground .6 .7 .9\nMaterial dark ambient .1 .1 .1\n\
               Material floor ambient .9 .9 .9 checker 1 dark\nPlane 0 0 0 0 1 0 floor\n",
    },
    Effect {
        name: "thin",
        about: "wires and slivers thinner than a pixel",
        text: "Look 0 0 10  0 0 0  30\nBackground .1 .1 .15\nIlight .9 .9 .9 -.3 -.5 -1\n\
               Cylinder .006 -2.4 -1.9 0  2.2 2.0 0  .3 .3 .3 .6 .6 .6\nCylinder .003 -2.4 1.3 0  2.4 -.4 0  .3 .3 .3 .6 .6 .6\n\
               Triangle -2 -2 0  -1.9 2 0  -1.995 -2 0  .9 .8 .2 0 0 0\nTriangle .5 -2 0  1.7 2 0  .51 -2 0  .2 .9 .8 0 0 0\n\
               Triangle -1 -2.4 1  -.6 2.4 1  -1.001 -2.4 1  1 1 1 0 0 0\n",
    },
    Effect {
        name: "sun",
        about: "the penumbrae of a sun of 6 degrees",
        text: table!(" 6", "", "", ".55 .5"),
    },
    Effect {
        name: "lamp",
        about: "the penumbrae of a lamp",
        text: table!("", "Plight .6 .5 .4  -2.5 4 3  .5\n", "", ".55 .5"),
    },
    Effect {
        name: "lens",
        about: "a lens that is in focus at one ball",
        text: table!("", "", "Lens .12 8\n", ".55 .5"),
    },
    Effect {
        name: "motion",
        about: "a ball that bounces past",
        text: table!("", "", "Frames 2 2\nShutter .6\n", "(1:-.6 3:1.6) (1:.5 2:.9 3:.5)"),
    },
    Effect {
        name: "all",
        about: "soft lights, lens and motion together",
        text: table!(
            " 6",
            "Plight .6 .5 .4  -2.5 4 3  .5\n",
            "Lens .06 8\nFrames 2 2\nShutter .6\n",
            "(1:-.6 3:1.6) (1:.5 2:.9 3:.5)"
        ),
    },
];
