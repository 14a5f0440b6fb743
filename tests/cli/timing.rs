//! The durations of frames, their order, and the destination of an animation.

use std::io::Cursor;

use image::AnimationDecoder;
use image::codecs::png::PngDecoder;
use snapbox::str;

use crate::{BALL, Folder, ball_at, decode_gif};

fn balls(count: usize, settings: &str) -> Folder {
    let folder = Folder::new();
    for step in 1..=count {
        folder.write(&format!("balls/f{step}.txt"), ball_at(step));
    }
    folder.rayfold("render balls -o %d.png").assert().code(0);
    folder.write("balls/animation.json", settings);
    folder
}

fn delays(folder: &Folder, name: &str) -> Vec<u16> {
    decode_gif(&folder.read(name)).iter().map(|(_, delay)| *delay).collect()
}

/// The frames of a GIF or an APNG are these images.
fn assert_shows(folder: &Folder, name: &str, numbers: &[usize]) {
    let file = folder.read(name);
    let frames: Vec<image::RgbImage> = if name.ends_with("gif") {
        decode_gif(&file).into_iter().map(|(image, _)| image).collect()
    } else {
        let frames = PngDecoder::new(Cursor::new(&file)).unwrap().apng().unwrap().into_frames();
        let frames = frames.collect_frames().unwrap().into_iter();
        frames.map(|frame| image::DynamicImage::ImageRgba8(frame.into_buffer()).into_rgb8()).collect()
    };
    assert_eq!(frames.len(), numbers.len(), "{name}");
    for (frame, number) in frames.iter().zip(numbers) {
        assert_eq!(*frame, folder.image(&format!("{number}.png")), "{name}: frame {number}");
    }
}

#[test]
fn frames_have_times_of_their_own() {
    let folder = balls(4, r#"{"fps": 20, "durations": {"1": 0.5, "4": 2.345}}"#);
    folder.rayfold("render balls -o a.gif").assert().code(0);
    assert_eq!(delays(&folder, "a.gif"), [50, 5, 5, 235]);
    folder.rayfold("render balls -o a.gif --frame 2..4").assert().code(0);
    assert_eq!(delays(&folder, "a.gif"), [5, 5, 235]);
    folder.rayfold("render balls -o a.gif --final-delay 1").assert().code(0);
    assert_eq!(delays(&folder, "a.gif"), [50, 5, 5, 100]);
    folder.rayfold("render balls -o a.apng").assert().code(0);
    let file = folder.read("a.apng");
    let frames = PngDecoder::new(Cursor::new(&file)).unwrap().apng().unwrap().into_frames();
    let times = frames.map(|frame| frame.unwrap().delay().numer_denom_ms());
    let times: Vec<f64> = times.map(|(parts, whole)| f64::from(parts) / f64::from(whole)).collect();
    assert_eq!(times, [500.0, 50.0, 50.0, 2_345.0]);
    let out = folder.rayfold("render balls -o a.y4m").assert().code(0);
    let said = String::from_utf8_lossy(&out.get_output().stderr).into_owned();
    assert!(said.contains("durations are left out: a .y4m holds frames and their rate alone"), "{said}");
}

#[test]
fn times_of_frames_that_are_not_there_are_an_error() {
    let folder = balls(2, r#"{"durations": {"3": 1}}"#);
    for command in ["check balls", "render balls -o a.gif"] {
        let out = folder.rayfold(command).assert().code(1);
        let said = String::from_utf8_lossy(&out.get_output().stderr).into_owned();
        assert!(said.contains("animation.json gives frame 3 a duration, but there are 2 frames"), "{said}");
    }
    folder.write("balls/animation.json", r#"{"fps": 60, "durations": {"2": 1}}"#);
    let out = folder.rayfold("render balls -o a.gif").assert().code(1);
    let said = String::from_utf8_lossy(&out.get_output().stderr).into_owned();
    assert!(said.contains("where frames have times of their own, a GIF can hold at most 50"), "{said}");
    assert!(!folder.join("a.gif").exists());
}

#[test]
fn there_and_back() {
    let folder = balls(4, r#"{"bounce": true, "fps": 10, "durations": {"2": 0.3}}"#);
    for name in ["a.gif", "a.apng"] {
        folder.rayfold(&format!("render balls -o {name}")).assert().code(0);
        assert_shows(&folder, name, &[1, 2, 3, 4, 3, 2]);
    }
    assert_eq!(delays(&folder, "a.gif"), [10, 30, 10, 10, 10, 30]);
    folder.rayfold("render balls -o a.gif --frame 2..3").assert().code(0);
    assert_shows(&folder, "a.gif", &[2, 3]);
    // Files of frames are not shown.
    folder.rayfold("render balls -o f%d.png").assert().code(0);
    assert!(!folder.join("f5.png").exists());
}

#[test]
fn rates_are_exact() {
    let folder = balls(2, r#"{"fps": "24000/1001"}"#);
    let header = |args: &str| {
        let out = folder.rayfold(&format!("render balls -o - {args}")).assert().code(0);
        String::from_utf8_lossy(&out.get_output().stdout).lines().next().unwrap().to_owned()
    };
    assert!(header("").contains(" F24000:1001 "), "{}", header(""));
    assert!(header("--fps 30000/1001").contains(" F30000:1001 "));
    assert!(header("--fps 29.97").contains(" F2997:100 "));
    folder.rayfold("render balls -o a.gif --fps 30000/0").assert().code(2);
}

#[test]
fn encode_takes_times_from_a_file() {
    let folder = balls(3, r#"{"durations": {"1": 0.7}, "fps": 5}"#);
    folder.write("times.json", "{\"2\": 1.5,\n\"3\": 0.02}");
    folder.rayfold("encode 1.png 2.png 3.png -o a.gif --durations times.json").assert().code(0);
    assert_eq!(delays(&folder, "a.gif"), [10, 150, 2]);
    folder.rayfold("encode 1.png 2.png -o a.gif --durations balls/animation.json").assert().code(0);
    assert_eq!(delays(&folder, "a.gif"), [70, 10]);
    for (text, expected) in [
        (
            "{\"2\": 1,\n\"x\": 1}",
            "wrong.json:2: `x` is no frame: expected the number of a frame, from \"1\"",
        ),
        ("{\"2\": 0}", "wrong.json:1: frame 2 cannot be shown for `0`: expected seconds from 0.02 to 655.35"),
        ("{\"9\": 1}", "--durations gives frame 9 a time, but there are 3 frames"),
        ("5", "wrong.json:1: `durations` cannot be `5`: expected seconds by frame"),
    ] {
        folder.write("wrong.json", text);
        let out = folder.rayfold("encode 1.png 2.png 3.png -o b.gif --durations wrong.json").assert().code(1);
        let said = String::from_utf8_lossy(&out.get_output().stderr).into_owned();
        assert!(said.contains(expected), "{text}: {said}");
    }
    assert!(!folder.join("b.gif").exists());
}

#[test]
fn standard_output_is_any_animation() {
    let folder = balls(3, "{}");
    for format in ["gif", "apng", "webp", "y4m"] {
        folder.rayfold(&format!("render balls -o file.{format}")).assert().code(0);
        let out = folder.rayfold(&format!("render balls -o - --format {format}")).assert().code(0);
        assert!(out.get_output().stdout == folder.read(&format!("file.{format}")), "{format}");
    }
    folder.rayfold("render balls -o odd --format gif").assert().code(0);
    assert!(folder.read("odd") == folder.read("file.gif"));
    let out = folder.rayfold("encode 1.png 2.png 3.png -o -").assert().code(0);
    assert!(out.get_output().stdout == folder.read("file.gif"));
}

#[test]
fn a_file_that_is_there_can_be_kept() {
    let folder = Folder::with("a.txt", BALL);
    folder.rayfold("render a.txt -o a.png --no-clobber").assert().code(0);
    folder.write("a.gif", "old");
    folder.write("f1.png", "old");
    folder.rayfold("render a.txt -o a.gif --no-clobber").assert().code(1).stderr_eq(str![[r#"
error: a.gif exists already, and --no-clobber keeps it

"#]]);
    folder.rayfold("render a.txt -o f%d.png --no-clobber").assert().code(1);
    folder.rayfold("encode a.png -o a.gif --no-clobber").assert().code(1);
    assert_eq!((folder.read("a.gif"), folder.read("f1.png")), (b"old".to_vec(), b"old".to_vec()));
    folder.rayfold("render a.txt -o f%d.png --no-clobber --skip-existing").assert().code(2);
}

/// A picture with much detail that moves.
fn noisy(folder: &Folder) -> String {
    for k in 0..6_u32 {
        let level = |x: u32, y: u32, c: u32| ((x + k) * (y + 3) * (7 + c) % 97 + x + y) as u8;
        let image = image::RgbImage::from_fn(120, 80, |x, y| image::Rgb([0, 1, 2].map(|c| level(x, y, c))));
        image.save(folder.join(&format!("n{k}.png"))).unwrap();
    }
    (0..6).map(|k| format!("n{k}.png")).collect::<Vec<_>>().join(" ")
}

#[test]
fn a_file_fits_into_the_size_that_is_given() {
    let folder = Folder::new();
    let images = noisy(&folder);
    for ending in ["gif", "webp"] {
        folder.rayfold(&format!("encode {images} -o whole.{ending}")).assert().code(0);
        let whole = folder.read(&format!("whole.{ending}")).len();
        // A file that fits is not changed.
        folder.rayfold(&format!("encode {images} -o same.{ending} --max-size 1M")).assert().code(0);
        assert!(folder.read(&format!("same.{ending}")) == folder.read(&format!("whole.{ending}")));
        let limit = whole * 7 / 10;
        let out =
            folder.rayfold(&format!("encode {images} -o a.{ending} --max-size {limit}")).assert().code(0);
        let said = String::from_utf8_lossy(&out.get_output().stderr).into_owned();
        assert!(said.contains(" levels a channel, of 256, it is at most "), "{said}");
        let size = folder.read(&format!("a.{ending}")).len();
        assert!(size <= limit && size > limit / 3, "{ending}: {size} of {limit}, {whole}");
        // To a pipe the same.
        let piped = format!("encode {images} -o - --format {ending} --max-size {limit}");
        let out = folder.rayfold(&piped).assert().code(0);
        assert!(out.get_output().stdout == folder.read(&format!("a.{ending}")));
        let out = folder.rayfold(&format!("encode {images} -o b.{ending} --max-size 100")).assert().code(1);
        let said = String::from_utf8_lossy(&out.get_output().stderr).into_owned();
        assert!(
            said.contains("the file would be larger than 100 bytes even with 4 levels a channel"),
            "{said}"
        );
        assert!(!folder.join(&format!("b.{ending}")).exists());
    }
    folder.rayfold(&format!("encode {images} -o a.apng --max-size 1M")).assert().code(2);
    assert!(folder.list(".").iter().all(|name| !name.starts_with('.')), "{:?}", folder.list("."));
}
