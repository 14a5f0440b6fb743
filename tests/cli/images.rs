//! `rayfold render` to one image and to several.

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
    // Samples are on the window's corners, so every second one of the large image is one of the small.
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

#[test]
fn frames_of_a_longer_run_are_reported_and_stay() {
    let folder = Folder::with("a.txt", BALL.to_owned() + &"Trace\n".repeat(5));
    folder.rayfold("render a.txt -o fr/%04d.png").assert().code(0);
    folder.write("a.txt", BALL.to_owned() + "Trace\n");
    folder.write("fr/0009.tif", "");
    for more in ["", " --frame 1", " --skip-existing"] {
        let out = folder.rayfold(&format!("render a.txt -o fr/%04d.png{more}")).output().unwrap();
        let said = String::from_utf8(out.stderr).unwrap();
        let warning = "\nwarning: 4 frames of an earlier run left beside them: fr/0003.png to fr/0006.png\n";
        assert!(out.status.success() && said.ends_with(warning), "{said}");
    }
    assert_eq!(folder.list("fr").len(), 7);
    folder.rayfold("render a.txt -o other/%04d.png").assert().code(0).stderr_eq(str![[r#"
other/0001.png to other/0002.png: 2 frames, [..]B, in [..] s

"#]]);
}

/// Regression test: the error named a file and a folder that the user had not specified.
#[test]
fn a_pattern_below_a_file_is_refused_by_its_own_name() {
    let folder = Folder::with("a.txt", BALL);
    for out in ["a.txt/%d.png", "a.txt/deep/%d.png"] {
        let said = folder.rayfold(&format!("render a.txt -o {out}")).output().unwrap();
        let said = String::from_utf8(said.stderr).unwrap();
        let expected = format!("error: cannot write {}: a.txt is no folder\n", out.replace("%d", "1"));
        assert_eq!(said, expected);
    }
    let said = folder.rayfold("render a.txt -o a.txt/a.gif").output().unwrap().stderr;
    assert_eq!(String::from_utf8(said).unwrap(), "error: cannot write a.txt/a.gif: a.txt is no folder\n");
}

/// Regression test: a folder without write access was an error even if nothing had to be written.
#[cfg(unix)]
#[test]
fn where_all_frames_are_there_nothing_need_be_written() {
    let folder = Folder::with("a.txt", BALL.to_owned() + "Trace\n");
    folder.rayfold("render a.txt -o fr/%d.png").assert().code(0);
    let read_only = |name: &str, mode| {
        let mode = std::os::unix::fs::PermissionsExt::from_mode(mode);
        std::fs::set_permissions(folder.join(name), mode).unwrap();
    };
    // Root can write into the folder nevertheless, but replaces no read-only file.
    for (name, mode) in [("fr/1.png", 0o444), ("fr/2.png", 0o444), ("fr", 0o555)] {
        read_only(name, mode);
    }
    folder.rayfold("render a.txt -o fr/%d.png --skip-existing").assert().code(0);
    read_only("fr", 0o755);
    read_only("fr/2.png", 0o644);
    folder.write("fr/2.png", "half a picture");
    read_only("fr/2.png", 0o444);
    let said = folder.rayfold("render a.txt -o fr/%d.png --skip-existing").output().unwrap();
    let said = String::from_utf8(said.stderr).unwrap();
    assert!(said.contains("cannot write fr/2.png: it is read-only"), "{said}");
}
