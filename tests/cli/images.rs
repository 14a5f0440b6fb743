//! `rayfold render` to one image and to many.

use snapbox::str;

use crate::{BALL, Folder, ball_at};

#[test]
fn png_and_tiff_hold_the_same_rgb_pixels() {
    let folder = Folder::with("a.txt", BALL);
    for name in ["a.png", "a.tif", "a.tiff", "A.PNG"] {
        folder.rayfold(&format!("render a.txt -o {name}")).assert().code(0);
        let decoded = image::load_from_memory(&folder.read(name)).unwrap();
        assert_eq!(decoded.color(), image::ColorType::Rgb8);
        assert_eq!(decoded.into_rgb8(), folder.image("a.png"));
    }
    let image = folder.image("a.png");
    assert_eq!(image.dimensions(), (24, 16));
    assert_eq!(image.get_pixel(0, 0).0, [51, 51, 51], "the background");
    assert!(image.get_pixel(14, 6).0[0] > 100, "the ball, lit from the upper right");
    assert!(image.get_pixel(14, 6).0[0] > image.get_pixel(9, 9).0[0], "its far side is darker");
}

#[test]
fn a_pattern_is_a_file_a_frame_counted_from_one() {
    let folder = Folder::new();
    for step in 1..=11 {
        folder.write(&format!("balls/f{step}.txt"), ball_at(step));
    }
    std::fs::create_dir(folder.join("frames")).unwrap();
    folder.rayfold("render balls -o frames/%04d.png").assert().code(0).stdout_eq("").stderr_eq(str![[r#"
frames/0001.png to frames/0011.png: 11 frames, [..]B, in [..] s

"#]]);
    let names: Vec<_> = (1..=11).map(|n| format!("{n:04}.png")).collect();
    assert_eq!(folder.list("frames"), names);
    folder.rayfold("render balls -o one.png --frame 10").assert().code(0);
    assert_eq!(folder.read("one.png"), folder.read("frames/0010.png"));

    std::fs::create_dir(folder.join("some")).unwrap();
    folder.rayfold("render balls -o some/b%d.tif --frame 9..10").assert().code(0);
    assert_eq!(folder.list("some"), ["b10.tif", "b9.tif"], "a frame keeps its number");
}

#[test]
fn images_of_different_sizes_are_fine() {
    let folder = Folder::with("a.txt", BALL.replace("Trace", "Trace\nScreen 6 4\nTrace"));
    folder.rayfold("render a.txt -o %d.png").assert().code(0);
    assert_eq!(folder.image("1.png").dimensions(), (24, 16));
    assert_eq!(folder.image("2.png").dimensions(), (6, 4));
}

#[test]
fn another_size_shows_the_same_picture() {
    let folder = Folder::with("a.txt", BALL);
    folder.rayfold("render a.txt -o small.png").assert().code(0);
    folder.rayfold("render a.txt -o large.png --size 47x31").assert().code(0);
    let (small, large) = (folder.image("small.png"), folder.image("large.png"));
    assert_eq!(large.dimensions(), (47, 31));
    // Samples sit on the window's corners, so every second one of the large image is one of the small.
    for (x, y, pixel) in small.enumerate_pixels() {
        let other = large.get_pixel(2 * x, 2 * y);
        assert!((0..3).all(|c| pixel[c].abs_diff(other[c]) <= 1), "({x}, {y}): {pixel:?}, {other:?}");
    }
}

#[test]
fn a_bad_script_leaves_no_image() {
    let folder = Folder::with("a.txt", BALL);
    folder.write("b.txt", "Trace");
    folder.rayfold("render a.txt b.txt -o %d.png").assert().code(1);
    assert_eq!(folder.list("."), ["a.txt", "b.txt"]);
}
