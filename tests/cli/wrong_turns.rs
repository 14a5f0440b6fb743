//! Mistakes of new users, and the program's messages for them.

use snapbox::str;

use crate::{BALL, Folder};

/// Runs the program, which must exit with `code`, and returns its standard error.
fn said(folder: &Folder, args: &str, code: i32) -> String {
    let output = folder.rayfold(args).assert().code(code).get_output().stderr.clone();
    String::from_utf8(output).unwrap()
}

#[test]
fn millions_of_threads_were_started() {
    let folder = Folder::with("a.txt", BALL);
    let said = said(&folder, "render a.txt -o a.gif --threads 9999999", 0);
    assert!(said.starts_with("warning: "), "{said}");
    assert!(said.contains(" threads are used instead of 9999999: at most 4 for each processor\n"), "{said}");
    assert!(folder.join("a.gif").exists());
}

#[test]
fn lenses_and_shutters_had_no_effect_and_nobody_said_so() {
    let folder = Folder::with("a.txt", BALL.replace("Background", "Lens .1\nShutter .5\nBackground"));
    let message = said(&folder, "check a.txt", 0);
    assert!(message.contains("warning: the lens has no effect: there is one ray per pixel"), "{message}");
    assert!(message.contains("warning: the shutter has no effect: there is one ray per pixel"), "{message}");
    assert!(message.ends_with("1 file, 1 frame: no errors, 2 warnings\n"), "{message}");
    assert!(said(&folder, "render a.txt -o a.png", 0).contains("write for example `Samples 64`"));
    // The command line asks for them.
    let message = said(&folder, "render a.txt -o a.png --samples 4", 0);
    assert!(!message.contains("no effect"), "{message}");
}

#[test]
fn an_image_as_input_was_answered_by_an_error_for_each_line() {
    let folder = Folder::with("a.txt", BALL);
    folder.rayfold("render a.txt -o a.gif").assert().code(0);
    folder.rayfold("render a.gif -o b.gif").assert().code(1).stderr_eq(str![[r#"
error: a.gif: this is a GIF image, not a scene script
error: nothing was written: 1 error

"#]]);
    let model: String = (0..1_000).map(|i| format!("v {i} 0 0\nf {i} 1 2\n")).collect();
    folder.write("a.obj", model);
    let message = said(&folder, "check a.obj", 1);
    assert!(
        message.starts_with(
            "error: a.obj: this is an OBJ model, not a scene script: `Mesh \"FILE\"` in a script draws it\n"
        ),
        "{message}"
    );
    let other: String = (0..1_000).map(|i| format!("moveto {i} 0\nlineto {i} 1\n")).collect();
    folder.write("a.ps", other);
    let message = said(&folder, "check a.ps", 1);
    assert_eq!(message.matches("error: unknown command").count(), 10, "{message}");
    assert!(message.contains("error: 1,991 more errors from here on"), "{message}");
    assert!(message.contains("2001 errors"), "{message}");
}

#[test]
fn a_video_was_an_unknown_ending() {
    let folder = Folder::with("a.txt", BALL);
    folder.rayfold("render a.txt -o a.mp4").assert().code(2).stderr_eq(str![[r#"
error: rayfold writes no .mp4, but ffmpeg does: rayfold ... -o - --format y4m | ffmpeg -i - -pix_fmt yuv420p a.mp4 (docs/video.md has more)

"#]]);
}

#[test]
fn tips_misled() {
    let folder = Folder::with("a.txt", BALL);
    for (args, expected) in [
        ("render a.txt -o a.gif --samples -1", "expected rays a pixel, 1 or more"),
        ("render a.txt -o a.gif --size -1", "expected width and height in pixels"),
        ("render a.txt -o a.gif --frame -1", "expected a frame such as 7"),
        ("render a.txt -o a.gif --threads -1", "expected a whole number, 1 or more"),
        ("render a.txt -o a.gif --max-pixels -1", "expected a whole number, 1 or more"),
        ("check a.txt --max-pixels -1", "expected a whole number, 1 or more"),
        ("check a.txt --json", "--format json"),
        ("status --json --bucket nowhere", "--format json"),
    ] {
        let message = said(&folder, args, 2);
        assert!(message.contains(expected) && !message.contains("to pass"), "{args}: {message}");
    }
    for args in ["help --help", "help render --help"] {
        let help = folder.rayfold(args).assert().code(0).get_output().stdout.clone();
        let help = String::from_utf8(help).unwrap();
        assert!(help.contains("Usage: rayfold") && help.contains("Examples:"), "{args}: {help}");
    }
}

#[test]
fn an_output_replaced_its_input() {
    let folder = Folder::with("a.gif", BALL);
    folder.write("f1.png", BALL);
    folder.write("b.txt", BALL);
    for (args, named) in [
        ("render a.gif -o a.gif", "a.gif would replace its input"),
        ("render a.gif -o ./a.gif", "./a.gif would replace the input a.gif"),
        ("render f1.png -o f%d.png", "f1.png would replace its input"),
        ("encode a.gif -o a.gif", "a.gif would replace its input"),
    ] {
        let message = said(&folder, args, 2);
        assert!(message.contains(named), "{args}: {message}");
    }
    assert_eq!(folder.read("a.gif"), BALL.as_bytes());
    assert_eq!(folder.read("f1.png"), BALL.as_bytes());
    // Another frame's file is no input.
    folder.rayfold("render b.txt -o f%d.tif").assert().code(0);
}

#[cfg(unix)]
#[test]
fn a_link_as_output_is_followed() {
    let folder = Folder::with("a.txt", BALL);
    folder.write("there/old.gif", "old");
    for (link, target) in [("link.gif", "there/old.gif"), ("new.gif", "there/none.gif")] {
        std::os::unix::fs::symlink(target, folder.join(link)).unwrap();
        folder.rayfold(&format!("render a.txt -o {link}")).assert().code(0);
        assert!(folder.join(link).symlink_metadata().unwrap().is_symlink());
        assert!(folder.read(target).starts_with(b"GIF89a"));
    }
    assert_eq!(folder.list("there"), ["none.gif", "old.gif"]);
}

#[cfg(target_os = "linux")]
#[test]
fn the_folder_that_cannot_be_made_was_not_named() {
    let folder = Folder::with("a.txt", BALL);
    let message = said(&folder, "render a.txt -o /proc/none/frames/%d.png", 1);
    assert!(message.starts_with("error: cannot make the folder /proc/none/frames: "), "{message}");
    let message = said(&folder, "split a.txt /proc/none", 1);
    assert!(message.starts_with("error: cannot make the folder /proc/none: "), "{message}");
}

#[test]
fn settings_beside_images_were_silently_left_out() {
    let folder = Folder::with("frames/a.txt", BALL);
    folder.write("frames/animation.json", r#"{"fps": 25, "durations": {"1": 0.5}}"#);
    folder.rayfold("render frames -o frames/a.png").assert().code(0);
    let message = said(&folder, "encode frames/a.png -o a.gif", 0);
    assert!(
        message.starts_with("frames/animation.json is not read: --fps, --loop and --durations"),
        "{message}"
    );
    let message = said(&folder, "encode frames/a.png -o a.gif --durations frames/animation.json", 0);
    assert!(!message.contains("not read"), "{message}");
}

#[test]
fn submit_refused_a_single_script() {
    let folder = Folder::with("a.txt", "Trce");
    let message = said(&folder, "submit a.txt --bucket nowhere", 1);
    assert!(message.ends_with("error: nothing was uploaded: 1 error\n"), "{message}");
}
