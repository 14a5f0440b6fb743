//! Runs the `rayfold` command like a user's shell does.
//!
//! The tests contain the expected output; `SNAPSHOTS=overwrite cargo test -p rayfold --test cli` updates it.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails, also in the functions that tests share")]

mod bad_input;
mod check;
mod clear;
mod cost;
mod documented;
mod encode;
mod encode_files;
mod encode_foreign;
mod encode_formats;
#[cfg(unix)]
mod files;
mod images;
mod interrupted;
mod models;
mod movies;
mod newcomer;
#[path = "../stage/one_in.rs"]
mod one_in;
mod pages;
mod passes;
mod render;
mod split;
mod timing;
mod usage;
#[cfg(unix)]
mod watch;
mod wrong_turns;

use std::path::{Path, PathBuf};

use snapbox::cmd::Command;

/// The program under test.
pub(crate) const RAYFOLD: &str = env!("CARGO_BIN_EXE_rayfold");

/// A red sphere on grey, 24 x 16 pixels.
pub(crate) const BALL: &str = "\
Screen 24, 16
Camera 0 0 5  0 0 -1  0 1 0  1  -.3 -.2 .3 .2
Background .2 .2 .2
Sphere 1  0 0 0  .1 .1 .1  .8 .2 .1
Ilight 1 1 1  -1 -1 -1
Trace
";

/// A folder that is deleted after the test.
pub(crate) struct Folder(tempfile::TempDir);

impl Folder {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    /// Makes a folder with one file.
    pub(crate) fn with(name: &str, text: impl AsRef<[u8]>) -> Self {
        let folder = Self::new();
        folder.write(name, text);
        folder
    }

    /// Writes a file and its parent folders.
    pub(crate) fn write(&self, name: &str, text: impl AsRef<[u8]>) {
        let path = self.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }

    pub(crate) fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    pub(crate) fn path(&self) -> &Path {
        self.0.path()
    }

    pub(crate) fn join(&self, name: &str) -> PathBuf {
        self.path().join(name)
    }

    /// Returns the sorted names in a folder, including hidden files.
    pub(crate) fn list(&self, name: &str) -> Vec<String> {
        let entries = std::fs::read_dir(self.join(name)).unwrap();
        let mut names: Vec<_> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// Returns the command `rayfold` with arguments that are separated by spaces.
    pub(crate) fn rayfold(&self, args: &str) -> Command {
        Command::new(RAYFOLD)
            .args(args.split_whitespace())
            .current_dir(self.path())
            .env_remove("NO_COLOR")
            .env("COLUMNS", "100")
    }

    pub(crate) fn image(&self, name: &str) -> image::RgbImage {
        image::load_from_memory(&self.read(name)).unwrap().into_rgb8()
    }
}

/// Returns a script with a sphere that moves to the right by a twelfth of its size per frame.
pub(crate) fn ball_at(step: usize) -> String {
    BALL.replace("0 0 0  .1", &format!("{} 0 0  .1", step as f64 / 6.0))
}

/// Decodes an animation as a viewer shows it: its frames with their delays in hundredths of a second.
pub(crate) fn decode_gif(bytes: &[u8]) -> Vec<(image::RgbImage, u16)> {
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(bytes).unwrap();
    let mut shown = image::RgbImage::new(decoder.width().into(), decoder.height().into());
    let mut frames = Vec::new();
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        assert!(matches!(frame.dispose, gif::DisposalMethod::Keep | gif::DisposalMethod::Any));
        for (index, pixel) in frame.buffer.chunks_exact(4).enumerate() {
            let (x, y) = (index % usize::from(frame.width), index / usize::from(frame.width));
            if pixel[3] == 255 {
                let place = (x as u32 + u32::from(frame.left), y as u32 + u32::from(frame.top));
                shown.put_pixel(place.0, place.1, image::Rgb([pixel[0], pixel[1], pixel[2]]));
            }
        }
        frames.push((shown.clone(), frame.delay));
    }
    frames
}
