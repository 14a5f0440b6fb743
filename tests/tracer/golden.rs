//! Golden frames: small pictures of the scenes in `scenes/`, committed in `tests/golden/`.
//!
//! Every frame must agree with its golden one within one level in each channel, both for the renderer and for the
//! reference. A failure writes the golden frame, the drawn one and their difference side by side. After an intended
//! change of the picture run `RAYFOLD_RENEW=1 cargo test -p rayfold-tracer golden`, then check the changes in
//! `git diff`.

use std::fs;
use std::path::{Path, PathBuf};

use image::{GenericImage as _, Rgb, RgbImage};
use rayfold_scene::assets::{Library, MemoryFiles};
use rayfold_scene::{Limits, Samples, Scene, Screen, parse_with_files};
use rayfold_tracer::{RenderOptions, reference, render};

/// The tolerance in levels: a result at the border between two levels may round either way.
const TOLERANCE: u8 = 1;
/// The side of a golden frame in pixels.
const SIDE: u32 = 96;

#[test]
fn sphere_light() {
    check("sphere_light", &["frame01", "frame04", "frame08"]);
}

#[test]
fn moving_up() {
    check("moving_up", &["frame01", "frame03", "frame06"]);
}

#[test]
fn artistic() {
    check("artistic", &["frame01", "frame08", "frame15"]);
}

#[test]
fn artisticsss() {
    check("artisticsss", &["frame01", "frame08", "frame15"]);
}

#[test]
fn hello() {
    check("hello", &["frame01", "frame17", "frame34", "frame50"]);
}

#[test]
fn marbles() {
    check_curves("marbles", &[1, 20]);
}

#[test]
fn glass() {
    check_curves("glass", &[1, 31]);
}

#[test]
fn clockwork() {
    check_curves("clockwork", &[1, 7]);
}

#[test]
fn planets() {
    check_curves("planets", &[1, 21]);
}

#[test]
fn lamp() {
    check_curves("lamp", &[1, 13]);
}

#[test]
fn logo() {
    check_curves("logo", &[1, 26]);
}

#[test]
fn grove() {
    check_curves("grove", &[12]);
}

#[test]
fn globe() {
    check_curves("globe", &[1, 18]);
}

#[test]
fn chess() {
    check_curves("chess", &[5]);
}

#[test]
fn package() {
    check_curves("package", &[9]);
}

#[test]
fn pendulum() {
    check_curves("pendulum", &[1, 9]);
}

// Of the scenes of indirect light one ray per pixel shows what suns, glow and smooth mirrors do.

#[test]
fn room() {
    check_curves("room", &[1]);
}

#[test]
fn still() {
    check_curves("still", &[1]);
}

#[test]
fn neon() {
    check_curves("neon", &[1]);
}

#[test]
fn every_scene_is_shown_and_has_golden_frames() {
    let readme = fs::read_to_string(root().join("scenes/README.md")).unwrap();
    let mut count = 0;
    for entry in fs::read_dir(root().join("scenes")).unwrap() {
        let entry = entry.unwrap();
        if !entry.file_type().unwrap().is_dir() {
            continue;
        }
        count += 1;
        let name = entry.file_name().into_string().unwrap();
        assert!(root().join("tests/golden").join(&name).is_dir(), "{name} has no golden frames");
        assert!(readme.contains(&format!("| `{name}`")), "scenes/README.md does not tell of {name}");
        let pictures = ["gif", "png"].map(|ending| root().join(format!("docs/images/{name}.{ending}")));
        let picture =
            pictures.iter().find(|path| path.exists()).unwrap_or_else(|| panic!("no picture of {name}"));
        let size = fs::metadata(picture).unwrap().len();
        assert!(size < 1_000_000, "{} has {size} bytes", picture.display());
    }
    assert_eq!(count, 19);
}

/// Checks some frames of a folder with a script per frame.
fn check(folder: &str, scripts: &[&str]) {
    for script in scripts {
        compare_all(folder, script, &load(&format!("scenes/{folder}/{script}.txt"), 0));
    }
}

/// Checks some frames, counted from 1, of a folder with one script for all frames.
fn check_curves(folder: &str, frames: &[usize]) {
    for frame in frames {
        let scene = load(&format!("scenes/{folder}/{folder}.txt"), frame - 1);
        compare_all(folder, &format!("frame{frame:02}"), &scene);
    }
}

fn compare_all(folder: &str, frame: &str, scene: &Scene) {
    let golden_path = root().join("tests/golden").join(folder).join(format!("{frame}.png"));
    if std::env::var_os("RAYFOLD_RENEW").is_some() {
        fs::create_dir_all(golden_path.parent().unwrap()).unwrap();
        by_reference(scene).save(&golden_path).unwrap();
    }
    let golden =
        image::open(&golden_path).unwrap_or_else(|e| panic!("{}: {e}", golden_path.display())).into_rgb8();
    let name = format!("{folder}/{frame}");
    compare(&format!("{name} by the reference"), &golden, &by_reference(scene));
    compare(&name, &golden, &render(scene, &RenderOptions::default()).unwrap());
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn by_reference(scene: &Scene) -> RgbImage {
    reference::render(scene, &RenderOptions::default()).unwrap()
}

/// Loads frame `k`, counted from 0, of a script and the files beside it, at the size of golden frames.
fn load(script: &str, k: usize) -> Scene {
    let text = fs::read(root().join(script)).unwrap_or_else(|e| panic!("{script}: {e}"));
    let mut files = MemoryFiles::default();
    for entry in fs::read_dir(root().join(script).parent().unwrap()).unwrap() {
        let entry = entry.unwrap();
        files.insert(&entry.file_name().into_string().unwrap(), fs::read(entry.path()).unwrap());
    }
    let parsed = parse_with_files(script, &text, &Limits::default(), &Library::new(files));
    let parsed_script = parsed.script.unwrap_or_else(|| panic!("{script}: {:?}", parsed.diagnostics));
    let mut scene = parsed_script.frame(k).unwrap();
    scene.screen = Screen::new(SIDE, SIDE).unwrap();
    // One ray per pixel: `sampled` tests several.
    scene.samples = Samples::default();
    scene
}

fn compare(name: &str, golden: &RgbImage, drawn: &RgbImage) {
    assert_eq!(golden.dimensions(), drawn.dimensions(), "{name}: size");
    let off = |a: &Rgb<u8>, b: &Rgb<u8>| (0..3).map(|c| a[c].abs_diff(b[c])).max().unwrap();
    let bad = golden.pixels().zip(drawn.pixels()).filter(|(a, b)| off(a, b) > TOLERANCE).count();
    if bad == 0 {
        return;
    }
    let mut difference = RgbImage::new(SIDE, SIDE);
    for (x, y, pixel) in difference.enumerate_pixels_mut() {
        let level = off(golden.get_pixel(x, y), drawn.get_pixel(x, y));
        *pixel = if level > TOLERANCE { Rgb([255, level, 0]) } else { Rgb([0, 0, level * 80]) };
    }
    let mut panels = RgbImage::new(3 * SIDE, SIDE);
    for (k, panel) in [golden, drawn, &difference].into_iter().enumerate() {
        panels.copy_from(panel, k as u32 * SIDE, 0).unwrap();
    }
    let path =
        PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("{}.png", name.replace(['/', ' '], "-")));
    panels.save(&path).unwrap();
    panic!(
        "{name}: {bad} pixels are off by more than {TOLERANCE} level; golden, drawn and difference: {}\n\
         if the change is meant: RAYFOLD_RENEW=1 cargo test -p rayfold-tracer golden",
        path.display()
    );
}
