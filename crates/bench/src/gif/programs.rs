//! The programs that are measured: rayfold and whatever peers this machine has.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, bail, ensure};
use image::RgbImage;

use crate::measure::Cost;

/// A way to turn PNG files into a GIF.
pub(super) struct Program {
    pub(super) name: String,
    pub(super) version: String,
    command: Box<Build>,
}

/// The command that does a job.
type Build = dyn Fn(&Job<'_>) -> Command;

/// Frames to encode, all in one folder as 0001.png and so on.
pub(super) struct Job<'a> {
    pub(super) frames: &'a [PathBuf],
    pub(super) size: (u32, u32),
    pub(super) fps: u32,
    pub(super) out: &'a Path,
}

impl Program {
    fn new(name: &str, version: String, command: impl Fn(&Job<'_>) -> Command + 'static) -> Self {
        Self { name: name.to_owned(), version, command: Box::new(command) }
    }

    /// What its GIFs are called.
    pub(super) fn file_name(&self) -> String {
        format!("{}.gif", self.name.replace([' ', ','], ""))
    }

    /// Encodes and measures.
    ///
    /// Through a small process of its own: the memory of whoever starts a program counts as the program's, else.
    pub(super) fn run(&self, job: &Job<'_>) -> anyhow::Result<Cost> {
        let command = (self.command)(job);
        let output = Command::new(std::env::current_exe()?)
            .args(["measure", "--"])
            .arg(command.get_program())
            .args(command.get_args())
            .output()
            .with_context(|| format!("cannot start {}", self.name))?;
        let told = String::from_utf8_lossy(&output.stderr);
        ensure!(output.status.success(), "{} failed: {told}", self.name);
        Ok(serde_json::from_slice(&output.stdout)?)
    }
}

/// Builds the rayfold to measure.
pub(super) fn build() -> anyhow::Result<PathBuf> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let status = Command::new(cargo).args(["build", "--release", "-p", "rayfold"]).status()?;
    ensure!(status.success(), "cannot build rayfold");
    Ok(PathBuf::from("target/release/rayfold"))
}

/// rayfold first, then the peers found.
pub(super) fn all(rayfold: &Path) -> Vec<Program> {
    let rayfold = rayfold.to_path_buf();
    let version = version(&rayfold.to_string_lossy(), "--version").unwrap_or_default();
    let mut programs = vec![Program::new("rayfold", version, move |&Job { frames, fps, out, .. }| {
        let mut command = Command::new(&rayfold);
        command.arg("encode").args(frames).arg("-o").arg(out).args(["--quiet", "--fps", &fps.to_string()]);
        command
    })];
    if let Some(found) = self::version("gifski", "--version") {
        for (name, flags) in
            [("gifski --quality 100", &["--quality", "100"][..]), ("gifski --fast", &["--fast"])]
        {
            programs.push(Program::new(name, found.clone(), move |&Job { frames, size, fps, out }| {
                let mut command = Command::new("gifski");
                command.args(["--width", &size.0.to_string(), "--height", &size.1.to_string()]);
                command.args(flags).args(["--quiet", "--no-sort", "--fps", &fps.to_string(), "-o"]);
                command.arg(out).args(frames);
                command
            }));
        }
    }
    if let Some(found) = self::version("ffmpeg", "-version") {
        programs.push(Program::new("ffmpeg, one palette", found, |&Job { frames, fps, out, .. }| {
            let mut command = Command::new("ffmpeg");
            let pattern = frames[0].with_file_name("%04d.png");
            command.args(["-y", "-v", "error", "-framerate", &fps.to_string(), "-i"]).arg(pattern);
            command.args(["-vf", "split[a][b];[a]palettegen[p];[b][p]paletteuse"]).arg(out);
            command
        }));
    }
    if let Some(found) = self::version("convert", "--version") {
        programs.push(Program::new("ImageMagick", found, |&Job { frames, fps, out, .. }| {
            let mut command = Command::new("convert");
            command.args(["-delay", &format!("{}", 100 / fps), "-loop", "0"]);
            command.args(frames).args(["-layers", "optimize"]).arg(out);
            command
        }));
    }
    let pillow = "import PIL; print('Pillow', PIL.__version__)";
    if let Some(found) = output("python3", &["-c", pillow]) {
        programs.push(Program::new("Pillow", found, |&Job { frames, fps, out, .. }| {
            let mut command = Command::new("python3");
            let script = "import sys; from PIL import Image; \
                frames = [Image.open(p) for p in sys.argv[3:]]; \
                frames[0].save(sys.argv[1], save_all=True, append_images=frames[1:], \
                duration=1000 / int(sys.argv[2]), loop=0)";
            command.args(["-c", script]).arg(out).arg(fps.to_string()).args(frames);
            command
        }));
    }
    programs
}

fn output(program: &str, args: &[&str]) -> Option<String> {
    let output = Command::new(program).args(args).stderr(Stdio::null()).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

fn version(program: &str, flag: &str) -> Option<String> {
    let words = |line: &str| line.split(" Copyright").next().unwrap_or(line).to_owned();
    output(program, &[flag]).map(|text| words(text.lines().next().unwrap_or_default()))
}

/// What FFmpeg shows of a GIF, frame by frame, and each frame's time in hundredths of a second.
pub(super) fn decode(gif: &Path, size: (u32, u32)) -> anyhow::Result<(Vec<RgbImage>, Vec<u32>)> {
    let output = Command::new("ffmpeg")
        .args(["-v", "error", "-min_delay", "0", "-i"])
        .arg(gif)
        .args(["-fps_mode", "passthrough", "-f", "rawvideo", "-pix_fmt", "rgb24", "-"])
        .output()
        .context("cannot start ffmpeg, which decodes the results")?;
    if !output.status.success() {
        bail!("ffmpeg cannot decode {}: {}", gif.display(), String::from_utf8_lossy(&output.stderr));
    }
    let frames = output
        .stdout
        .chunks(3 * size.0 as usize * size.1 as usize)
        .map(|bytes| RgbImage::from_raw(size.0, size.1, bytes.to_vec()).context("ffmpeg gave half a frame"));
    let frames = frames.collect::<anyhow::Result<Vec<_>>>()?;
    let probe = Command::new("ffprobe")
        .args(["-v", "error", "-min_delay", "0", "-show_entries", "packet=duration_time", "-of", "csv=p=0"])
        .arg(gif)
        .output()
        .context("cannot start ffprobe")?;
    let times = String::from_utf8(probe.stdout)?;
    let delays = times
        .lines()
        .map(|line| Ok((line.trim().trim_end_matches(',').parse::<f64>()? * 100.0).round() as u32))
        .collect::<anyhow::Result<Vec<_>>>()?;
    Ok((frames, delays))
}
