//! The programs that are measured: rayfold and those of its peers that this machine has.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, ensure};

use crate::measure::Cost;

/// The program that the goals compare with.
pub(super) const RIVAL: &str = "gifski 100";

/// A way to turn PNG files into a GIF.
pub(super) struct Program {
    pub(super) name: &'static str,
    /// The version that the program prints; `None` if it is not on this machine.
    pub(super) version: Option<String>,
    /// The program's options, for the report.
    pub(super) how: &'static str,
    command: Box<Build>,
}

/// A function that returns the command for a job.
type Build = dyn Fn(&Job<'_>) -> Command;

pub(super) struct Job<'a> {
    pub(super) frames: &'a [PathBuf],
    pub(super) size: (u32, u32),
    pub(super) fps: u32,
    pub(super) out: &'a Path,
}

impl Program {
    /// Returns the file name of its GIFs.
    pub(super) fn file_name(&self) -> String {
        format!("{}.gif", self.name.replace([' ', ','], ""))
    }

    /// Encodes the frames of a job and measures it.
    ///
    /// # Errors
    /// Fails if the program cannot be started or fails.
    pub(super) fn run(&self, job: &Job<'_>) -> anyhow::Result<Cost> {
        cost_of(&(self.command)(job))
    }
}

/// Runs a command and measures it. A small process of its own starts the command, because the system counts the memory
/// of the starting process as the program's.
///
/// # Errors
/// Fails if the program cannot be started or fails.
pub(super) fn cost_of(command: &Command) -> anyhow::Result<Cost> {
    let output = Command::new(std::env::current_exe()?)
        .args(["measure", "--"])
        .arg(command.get_program())
        .args(command.get_args())
        .output()
        .with_context(|| format!("cannot start {}", command.get_program().display()))?;
    let messages = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "{} failed: {messages}", command.get_program().display());
    Ok(serde_json::from_slice(&output.stdout)?)
}

/// Builds the rayfold to measure.
///
/// # Errors
/// Fails if the build fails.
pub(super) fn build() -> anyhow::Result<PathBuf> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let status =
        Command::new(cargo).args(["build", "--release", "-p", "rayfold"]).current_dir(&root).status()?;
    ensure!(status.success(), "cannot build rayfold");
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), PathBuf::from);
    Ok(target.join("release/rayfold"))
}

/// Returns the command of `rayfold encode` for these frames.
pub(super) fn rayfold(program: &Path, &Job { frames, fps, out, .. }: &Job<'_>) -> Command {
    let mut command = Command::new(program);
    command.arg("encode").args(frames).arg("-o").arg(out).args(["--quiet", "--fps", &fps.to_string()]);
    command
}

/// Returns rayfold, then the program that the goals compare with, then the other peers, including those that are not on
/// this machine.
pub(super) fn all(path: &Path) -> Vec<Program> {
    let path = path.to_path_buf();
    let ours = version(&path.to_string_lossy(), "--version");
    let gifski = version("gifski", "--version");
    let ffmpeg = version("ffmpeg", "-version");
    let magick = version("convert", "--version");
    let gifsicle = version("gifsicle", "--version").zip(magick.clone()).map(|(sicle, _)| sicle);
    let pillow = output("python3", &["-c", "import PIL; print('Pillow', PIL.__version__)"]);
    let program = |name, version, how, command: Box<Build>| Program { name, version, how, command };
    vec![
        program("rayfold", ours, "`rayfold encode`", Box::new(move |job| rayfold(&path, job))),
        program(
            RIVAL,
            gifski.clone(),
            "`--quality 100`",
            Box::new(|job| by_gifski(job, &["--quality", "100"])),
        ),
        program("gifski fast", gifski, "`--fast`", Box::new(|job| by_gifski(job, &["--fast"]))),
        program(
            "ffmpeg",
            ffmpeg,
            "one palette for all frames: `split[a][b];[a]palettegen[p];[b][p]paletteuse`",
            Box::new(by_ffmpeg),
        ),
        program("ImageMagick", magick, "`convert -layers optimize`", Box::new(by_imagemagick)),
        program("gifsicle", gifsicle, "`-O3`, of ImageMagick's GIF: it takes no PNG", Box::new(by_gifsicle)),
        program("Pillow", pillow, "`save(save_all=True)`", Box::new(by_pillow)),
    ]
}

fn by_gifski(&Job { frames, size, fps, out }: &Job<'_>, flags: &[&str]) -> Command {
    let mut command = Command::new("gifski");
    command.args(["--width", &size.0.to_string(), "--height", &size.1.to_string()]);
    command.args(flags).args(["--quiet", "--no-sort", "--fps", &fps.to_string(), "-o"]);
    command.arg(out).args(frames);
    command
}

fn by_ffmpeg(&Job { frames, fps, out, .. }: &Job<'_>) -> Command {
    let mut command = Command::new("ffmpeg");
    let pattern = frames[0].with_file_name("%04d.png");
    command.args(["-y", "-v", "error", "-framerate", &fps.to_string(), "-i"]).arg(pattern);
    command.args(["-vf", "split[a][b];[a]palettegen[p];[b][p]paletteuse"]).arg(out);
    command
}

fn by_imagemagick(&Job { frames, fps, out, .. }: &Job<'_>) -> Command {
    let mut command = Command::new("convert");
    command.args(["-delay", &format!("{}", 100 / fps), "-loop", "0"]);
    command.args(frames).args(["-layers", "optimize"]).arg(out);
    command
}

fn by_gifsicle(&Job { frames, fps, out, .. }: &Job<'_>) -> Command {
    let mut command = Command::new("sh");
    let script = r#"delay=$1; out=$2; shift 2
        convert -delay "$delay" -loop 0 "$@" gif:- | gifsicle --no-warnings -O3 -o "$out""#;
    command.args(["-ec", script, "sh", &format!("{}", 100 / fps)]).arg(out).args(frames);
    command
}

fn by_pillow(&Job { frames, fps, out, .. }: &Job<'_>) -> Command {
    let mut command = Command::new("python3");
    let script = "import sys; from PIL import Image; \
        frames = [Image.open(p) for p in sys.argv[3:]]; \
        frames[0].save(sys.argv[1], save_all=True, append_images=frames[1:], \
        duration=1000 / int(sys.argv[2]), loop=0)";
    command.args(["-c", script]).arg(out).arg(fps.to_string()).args(frames);
    command
}

fn output(program: &str, args: &[&str]) -> Option<String> {
    let output = Command::new(program).args(args).stderr(Stdio::null()).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

fn version(program: &str, flag: &str) -> Option<String> {
    let words = |line: &str| line.split(" Copyright").next().unwrap_or(line).to_owned();
    output(program, &[flag]).map(|text| words(text.lines().next().unwrap_or_default()))
}
