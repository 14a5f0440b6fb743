//! Shows a GIF as a viewer would, by FFmpeg's decoder.

use std::io::{ErrorKind, Read};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};

use anyhow::{Context, ensure};
use image::RgbImage;

/// A GIF being shown.
pub(super) struct Viewer {
    decoder: Child,
    pixels: ChildStdout,
    shown: RgbImage,
    /// The time for which each frame is shown, in hundredths of a second.
    pub(super) delays: Vec<u32>,
    /// The frame that is shown, from 0, and the time at which it ends.
    number: usize,
    end: u32,
}

impl Viewer {
    /// Shows the first frame.
    ///
    /// # Errors
    /// Fails if FFmpeg is missing or cannot decode the file.
    pub(super) fn open(gif: &Path, size: (u32, u32)) -> anyhow::Result<Self> {
        let probe = Command::new("ffprobe")
            .args([
                "-v",
                "error",
                "-min_delay",
                "0",
                "-show_entries",
                "packet=duration_time",
                "-of",
                "csv=p=0",
            ])
            .arg(gif)
            .output()
            .context("cannot start ffprobe, which reads the delays")?;
        let times = String::from_utf8(probe.stdout)?;
        let delays = times
            .lines()
            .map(|line| Ok((line.trim().trim_end_matches(',').parse::<f64>()? * 100.0).round() as u32))
            .collect::<anyhow::Result<Vec<_>>>()?;
        let end = *delays.first().with_context(|| format!("{} has no frame", gif.display()))?;
        let mut decoder = Command::new("ffmpeg")
            .args(["-v", "error", "-min_delay", "0", "-i"])
            .arg(gif)
            .args(["-fps_mode", "passthrough", "-f", "rawvideo", "-pix_fmt", "rgb24", "-"])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .context("cannot start ffmpeg, which decodes the results")?;
        let pixels = decoder.stdout.take().context("ffmpeg's output")?;
        let mut viewer =
            Self { decoder, pixels, shown: RgbImage::new(size.0, size.1), delays, number: 0, end };
        ensure!(viewer.advance()?, "{} has no frame", gif.display());
        Ok(viewer)
    }

    /// Returns the picture on the screen at a time in hundredths of a second, which must not be before the last
    /// requested one.
    ///
    /// # Errors
    /// Fails if FFmpeg ends within a frame.
    pub(super) fn at(&mut self, time: u32) -> anyhow::Result<&RgbImage> {
        while time >= self.end && self.number + 1 < self.delays.len() && self.advance()? {
            self.number += 1;
            self.end += self.delays[self.number];
        }
        Ok(&self.shown)
    }

    /// Reads to the end and returns the number of frames.
    ///
    /// # Errors
    /// Fails if FFmpeg fails, or if the numbers of frames and delays differ.
    pub(super) fn close(mut self) -> anyhow::Result<usize> {
        let mut frames = self.number + 1;
        while self.advance()? {
            frames += 1;
        }
        ensure!(self.decoder.wait()?.success(), "ffmpeg could not decode everything");
        ensure!(frames == self.delays.len(), "{frames} frames with {} delays", self.delays.len());
        Ok(frames)
    }

    /// Advances to the next frame. Returns whether there was one.
    fn advance(&mut self) -> anyhow::Result<bool> {
        let buffer: &mut [u8] = &mut self.shown;
        match self.pixels.read_exact(&mut buffer[..1]) {
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => return Ok(false),
            other => other?,
        }
        self.pixels.read_exact(&mut buffer[1..]).context("ffmpeg gave half a frame")?;
        Ok(true)
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        // The decoder has ended already, unless an error occurred. Then it must not wait for a reader for ever.
        let _ = self.decoder.kill();
        let _ = self.decoder.wait();
    }
}
