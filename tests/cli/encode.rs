//! Tests of `rayfold encode`.

use image::{DynamicImage, GrayAlphaImage, ImageBuffer, Luma, LumaA, Rgb, RgbImage, Rgba};
use snapbox::str;

use crate::{BALL, Folder, ball_at, decode_gif};

#[test]
fn encoded_images_are_the_rendered_animation() {
    let script: String = (0..4).map(|step| format!("Clear\n{}", ball_at(step))).collect();
    let folder = Folder::with("balls.txt", script);
    folder.rayfold("render balls.txt -o whole.gif --fps 30 --loop 2").assert().code(0);
    folder.rayfold("render balls.txt -o %d.png").assert().code(0);
    folder.rayfold("render balls.txt -o %d.tif").assert().code(0);
    folder
        .rayfold("encode 1.png 2.tif 3.png 4.png -o parts.gif --fps 30 --loop 2 --threads 1")
        .assert()
        .code(0);
    assert_eq!(folder.read("whole.gif"), folder.read("parts.gif"));
}

#[test]
fn the_image_at_fault_is_named_and_nothing_is_written() {
    let folder = Folder::with("ball.txt", BALL);
    folder.rayfold("render ball.txt -o a.png").assert().code(0);
    folder.rayfold("render ball.txt -o b.png --size 30x20").assert().code(0);
    folder.write("text.png", "this is no image");
    for (frames, fault) in [
        ("a.png b.png", "b.png: frame 2 is 30 x 20 pixels, the frames before it are 24 x 16"),
        ("a.png text.png", "text.png"),
        ("none.png", "none.png"),
    ] {
        let out = folder.rayfold(&format!("encode {frames} -o out.gif")).output().unwrap();
        let said = String::from_utf8(out.stderr).unwrap();
        assert!(out.status.code() == Some(1) && said.contains(fault), "{said}");
    }
    folder.rayfold("encode a.png -o out.png").assert().code(2);
    folder.rayfold("encode a.png -o out.gif --fps 0").assert().code(2);
    assert_eq!(folder.list("."), ["a.png", "b.png", "ball.txt", "text.png"]);
}

#[test]
fn all_unusable_files_are_reported_before_anything_is_encoded() {
    let folder = Folder::with("text.png", "this is no image");
    folder.write("empty.tif", "");
    folder.write("frames/note.txt", "no image either");
    // The first bytes of a JPEG.
    folder.write("photo.png", b"\xff\xd8\xff\xe0\0\x10JFIF\0\x01\x01\0\0\x01\0\x01\0\0");
    RgbImage::new(9, 9).save(folder.join("a.png")).unwrap();
    folder
        .rayfold("encode a.png text.png empty.tif frames none.png photo.png -o out.gif")
        .assert()
        .code(1)
        .stdout_eq("")
        .stderr_eq(str![[r#"
error: cannot read text.png: it is no image: expected PNG, APNG, JPEG, GIF, WebP, TIFF or .y4m
error: cannot read empty.tif: it is no image: expected PNG, APNG, JPEG, GIF, WebP, TIFF or .y4m
error: cannot read frames: it is a folder, expected its images, such as frames/*.png
error: cannot read none.png: No such file or directory
error: cannot read photo.png: [..]
error: 5 of 6 files cannot be used

"#]]);
    assert_eq!(folder.list("."), ["a.png", "empty.tif", "frames", "photo.png", "text.png"]);
}

#[test]
fn grey_deep_and_transparent_images_are_frames_too() {
    let folder = Folder::new();
    let images: [(&str, DynamicImage, [u8; 3]); 6] = [
        ("grey.png", ImageBuffer::from_pixel(3, 2, Luma([77_u8])).into(), [77; 3]),
        ("deep.png", ImageBuffer::from_pixel(3, 2, Luma([0x8000_u16])).into(), [128; 3]),
        ("rgb.png", ImageBuffer::from_pixel(3, 2, Rgb([0_u16, 0x8000, 0xffff])).into(), [0, 128, 255]),
        ("half.png", ImageBuffer::from_pixel(3, 2, Rgba([200_u8, 100, 50, 128])).into(), [100, 50, 25]),
        ("none.png", GrayAlphaImage::from_pixel(3, 2, LumaA([200, 0])).into(), [0; 3]),
        ("deep.tif", ImageBuffer::from_pixel(3, 2, Rgb([0_u16, 0x8000, 0xffff])).into(), [0, 128, 255]),
    ];
    for (name, image, _) in &images {
        image.save(folder.join(name)).unwrap();
    }
    let names = images.each_ref().map(|(name, ..)| *name).join(" ");
    folder.rayfold(&format!("encode {names} --no-sort --matte #000000 -o out.gif")).assert().code(0);
    let shown = decode_gif(&folder.read("out.gif"));
    assert_eq!(shown.len(), images.len());
    for ((name, _, expected), (frame, _)) in images.iter().zip(&shown) {
        assert!(frame.pixels().all(|pixel| pixel.0 == *expected), "{name}: {:?}", frame.get_pixel(0, 0));
    }
}

#[test]
fn a_thousand_frames_are_all_there() {
    let folder = Folder::new();
    for number in 0..4_u8 {
        RgbImage::from_pixel(5, 4, Rgb([60 * number; 3]))
            .save(folder.join(&format!("{number}.png")))
            .unwrap();
    }
    let frames = "0.png 1.png 2.png 3.png ".repeat(250);
    folder.rayfold(&format!("encode {frames} --no-sort -o out.gif --fps 20")).assert().code(0);
    let shown = decode_gif(&folder.read("out.gif"));
    assert_eq!(shown.len(), 1_000);
    assert!(
        shown
            .iter()
            .enumerate()
            .all(|(k, (frame, delay))| { frame.get_pixel(0, 0).0 == [60 * (k % 4) as u8; 3] && *delay == 5 })
    );
}

#[test]
fn a_side_that_a_gif_cannot_hold_is_an_error() {
    let folder = Folder::new();
    RgbImage::new(65_536, 1).save(folder.join("wide.png")).unwrap();
    folder.rayfold("encode wide.png -o out.gif").assert().code(1).stderr_eq(str![[r#"
error: wide.png: frame 1 is 65536 x 1 pixels, a GIF can hold 1 to 65535 on each side

"#]]);
    assert_eq!(folder.list("."), ["wide.png"]);
}

#[test]
fn a_rate_below_zero_is_reported_as_such() {
    let folder = Folder::new();
    RgbImage::new(2, 2).save(folder.join("a.png")).unwrap();
    folder.rayfold("encode a.png -o out.gif --fps -1").assert().code(2).stderr_eq(str![[r#"
error: --fps -1: -1 frames a second: a GIF can hold rates from 0.00153 up

"#]]);
}

#[test]
fn the_last_image_is_held_also_where_frames_are_left_out() {
    let folder = Folder::new();
    let level = |k: u8| Rgb([20 * k, 0, 0]);
    for k in 0..12_u8 {
        RgbImage::from_pixel(9, 5, level(k)).save(folder.join(&format!("f{k:02}.png"))).unwrap();
    }
    let files = (0..12).map(|k| format!("f{k:02}.png")).collect::<Vec<_>>().join(" ");
    for (fps, count) in [(50, 12), (100, 6), (1_000, 1)] {
        folder.rayfold(&format!("encode {files} -o a.gif --fps {fps} --final-delay 2")).assert().code(0);
        let shown = decode_gif(&folder.read("a.gif"));
        assert_eq!(shown.len(), count, "{fps} frames a second");
        let (image, delay) = shown.last().unwrap();
        assert_eq!((image.get_pixel(0, 0), *delay), (&level(11), 200), "{fps} frames a second");
    }
}

#[test]
fn a_slow_fade_of_few_colours_is_exact_where_that_is_asked_for() {
    let folder = Folder::new();
    let frame = |k: u32| RgbImage::from_fn(400, 300, |x, y| Rgb([(40 + (x + y) / 16 + k) as u8, 60, 90]));
    for k in 0..4 {
        frame(k).save(folder.join(&format!("{k}.png"))).unwrap();
    }
    let shown = |flag: &str| {
        folder.rayfold(&format!("encode 0.png 1.png 2.png 3.png -o a.gif {flag}")).assert().code(0);
        decode_gif(&folder.read("a.gif")).into_iter().map(|(image, _)| image).collect::<Vec<_>>()
    };
    let meant = (0..4).map(frame).collect::<Vec<_>>();
    assert!(shown("--exact") == meant);
    assert!(shown("") != meant, "by default such a fade is near, and smaller");
}
