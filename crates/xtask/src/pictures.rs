//! `cargo xtask pictures`: draws the pictures of the language page from the scripts in it.
//!
//! The `rayfold` program of this checkout draws them, so xtask builds without a renderer. A picture is written only
//! if it differs, so an unchanged page changes no file.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, bail, ensure};
use image::{DynamicImage, ImageFormat};
use rayfold_files::library_beside;
use rayfold_scene::{Limits, Script, parse_with_files};

use crate::manual::{Example, MODELS, PAGE, PICTURES, examples};
use crate::plot;
use crate::toolchain::say;

/// The options of `cargo xtask pictures`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Names of the pictures to draw; all of them, and none that is left over, when not given
    names: Vec<String>,
    /// The program that draws; this checkout's, built first, when not given
    #[arg(long, value_name = "PROGRAM")]
    rayfold: Option<PathBuf>,
}

/// Draws all pictures and writes those that differ.
///
/// # Errors
/// Fails if a script has an error, a name is unknown, or a file cannot be written.
pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let root = root();
    let page = fs::read_to_string(root.join(PAGE)).context(PAGE)?;
    let examples = examples(&page).context(PAGE)?;
    if let Some(unknown) =
        args.names.iter().find(|name| examples.iter().all(|example| example.name != **name))
    {
        bail!("{PAGE} has no script `{unknown}`: its block would start with \"```scene {unknown}\"");
    }
    let folder = root.join(PICTURES);
    fs::create_dir_all(&folder).context(PICTURES)?;
    let is_meant = |example: &&Example| args.names.is_empty() || args.names.contains(&example.name);
    for example in examples.iter().filter(is_meant) {
        let picture = draw(example, args.rayfold.as_deref())
            .with_context(|| format!("{PAGE}: the script `{}`", example.name))?;
        write(&folder.join(example.file()), &picture)?;
    }
    if args.names.is_empty() {
        remove_others(&folder, &examples)?;
    }
    Ok(())
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Returns the bytes of the picture's file.
fn draw(example: &Example, rayfold: Option<&Path>) -> anyhow::Result<Vec<u8>> {
    let script = script(example)?;
    if example.is_curve() {
        return plot::svg(&script).map(String::into_bytes);
    }
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("script.txt");
    fs::write(&path, &example.script)?;
    for model in fs::read_dir(root().join(MODELS)).context(MODELS)? {
        let model = model?;
        fs::copy(model.path(), folder.path().join(model.file_name()))?;
    }
    let status = match rayfold {
        Some(program) => Command::new(program),
        None => cargo_run(),
    }
    .args(["render", "--quiet", "--output"])
    .arg(folder.path().join("%d.png"))
    .arg(&path)
    .status()
    .context("rayfold could not be run")?;
    ensure!(status.success(), "it could not be drawn");
    // The frames of an animation are placed side by side.
    let frame = |k: usize| Ok(image::open(folder.path().join(format!("{k}.png")))?);
    let frames: Vec<DynamicImage> = (1..=script.frame_count()).map(frame).collect::<anyhow::Result<_>>()?;
    let mut png = std::io::Cursor::new(Vec::new());
    side_by_side(&frames)?.write_to(&mut png, ImageFormat::Png)?;
    Ok(png.into_inner())
}

/// Returns the command that runs the program of this checkout.
fn cargo_run() -> Command {
    let mut command = Command::new(env!("CARGO"));
    command.args(["run", "--quiet", "--package", "rayfold", "--"]);
    command
}

fn script(example: &Example) -> anyhow::Result<Script> {
    let models = library_beside(&root().join(MODELS).join("script.txt"));
    let parsed = parse_with_files(&example.name, example.script.as_bytes(), &Limits::default(), &models);
    let faults = || parsed.diagnostics.iter().map(|d| d.render(false)).collect::<String>();
    parsed.script.with_context(faults)
}

/// Joins pictures of the same height, all with alpha or all without, from left to right.
fn side_by_side(pictures: &[DynamicImage]) -> anyhow::Result<DynamicImage> {
    let first = pictures.first().context("a script has a frame")?;
    let width = pictures.iter().map(DynamicImage::width).sum();
    let mut strip = DynamicImage::new(width, first.height(), first.color());
    let mut left = 0;
    for picture in pictures {
        image::imageops::replace(&mut strip, picture, left, 0);
        left += i64::from(picture.width());
    }
    Ok(strip)
}

/// Writes a file unless it has this content already.
fn write(path: &PathBuf, bytes: &[u8]) -> anyhow::Result<()> {
    if fs::read(path).is_ok_and(|there| there == bytes) {
        return Ok(());
    }
    fs::write(path, bytes).with_context(|| path.display().to_string())?;
    say(&format!("{}", path.file_name().unwrap_or_default().display()));
    Ok(())
}

/// Removes pictures that belong to no script.
fn remove_others(folder: &Path, examples: &[Example]) -> anyhow::Result<()> {
    for entry in fs::read_dir(folder).context(PICTURES)? {
        let entry = entry?;
        if examples.iter().all(|example| entry.file_name() != example.file().as_str()) {
            fs::remove_file(entry.path()).with_context(|| entry.path().display().to_string())?;
            say(&format!("{} is removed", entry.file_name().display()));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use image::RgbImage;
    use rayfold_tracer::{RenderOptions, picture_of_frame};

    use super::*;

    /// The difference in levels that rounding may cause on another machine.
    const TOLERANCE: u8 = 1;

    #[test]
    fn no_picture_is_stale() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let examples = examples(&fs::read_to_string(root.join(PAGE)).unwrap()).unwrap();
        let mut stale = Vec::new();
        for example in &examples {
            let path = root.join(PICTURES).join(example.file());
            let script = script(example).unwrap();
            let is_drawn = if example.is_curve() {
                fs::read_to_string(&path).unwrap() == plot::svg(&script).unwrap()
            } else {
                let drawn = |k| picture_of_frame(&script, k, &RenderOptions::default()).unwrap().unwrap();
                let frames: Vec<DynamicImage> = (0..script.frame_count()).map(drawn).collect();
                are_alike(&image::open(&path).unwrap(), &side_by_side(&frames).unwrap())
            };
            if !is_drawn {
                stale.push(example.file());
            }
        }
        assert!(stale.is_empty(), "cargo xtask pictures: {}", stale.join(", "));
    }

    fn are_alike(a: &DynamicImage, b: &DynamicImage) -> bool {
        let near = |(a, b): (&u8, &u8)| a.abs_diff(*b) <= TOLERANCE;
        let form = |image: &DynamicImage| (image.width(), image.height(), image.color());
        form(a) == form(b) && a.as_bytes().iter().zip(b.as_bytes()).all(near)
    }

    #[test]
    fn another_picture_is_not_alike() {
        let grey = RgbImage::from_pixel(3, 2, image::Rgb([100; 3]));
        let mut other = grey.clone();
        let alike = |a: &RgbImage, b: &RgbImage| are_alike(&a.clone().into(), &b.clone().into());
        assert!(alike(&grey, &other));
        other.put_pixel(2, 1, image::Rgb([100, 102, 100]));
        assert!(!alike(&grey, &other));
        assert!(!alike(&grey, &RgbImage::from_pixel(2, 3, image::Rgb([100; 3]))));
        assert!(!are_alike(&grey.clone().into(), &DynamicImage::from(grey).into_rgba8().into()));
    }
}
