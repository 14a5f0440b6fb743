//! A wrong command line has exit code 2 and a message about the expected one.

use snapbox::str;

use crate::{BALL, Folder};

#[test]
fn version() {
    let version = format!("rayfold {}\n", env!("CARGO_PKG_VERSION"));
    Folder::new().rayfold("--version").assert().code(0).stdout_eq(version).stderr_eq("");
}

#[test]
fn help() {
    Folder::new()
        .rayfold("--help")
        .assert()
        .code(0)
        .stdout_eq(str![[r#"
Ray-traced animations from a folder of scene scripts

Usage: rayfold [OPTIONS] <COMMAND>

Commands:
  render       Render scripts to an animation, to one image, or to many
  check        Show what is wrong with scripts, without rendering them
  split        Split a script with many Traces into one script a frame
...

Options:
  -q, --quiet         Say nothing but errors
      --color <WHEN>  When to write in colour; auto: on a terminal, unless NO_COLOR is set [default:
                      auto] [possible values: auto, always, never]
  -h, --help          Print help
  -V, --version       Print version

Examples:
  rayfold render scenes/hello -o hello.gif
      render a folder of scripts to an animation
  rayfold check scenes/hello
      show what is wrong with its scripts
  rayfold submit scenes/hello --bucket my-bucket
      render it in the cloud

Exit codes: 0 done, 1 the input or the rendering failed, 2 wrong usage, 130 interrupted.

"#]])
        .stderr_eq("");
}

#[test]
fn every_subcommand_has_help_with_examples() {
    let help = Folder::new().rayfold("--help").output().unwrap();
    let help = String::from_utf8(help.stdout).unwrap();
    let names = help.lines().skip_while(|l| *l != "Commands:").skip(1).take_while(|l| !l.is_empty());
    let names: Vec<_> = names.filter_map(|l| l.split_whitespace().next()).filter(|n| *n != "help").collect();
    assert!(names.contains(&"render") && names.contains(&"check"), "{names:?}");
    for name in names {
        let help = Folder::new().rayfold(&format!("{name} --help")).output().unwrap();
        let help = String::from_utf8(help.stdout).unwrap();
        assert!(
            help.contains("\nExamples:\n  ") && help.contains(&format!("rayfold {name}")),
            "{name}: {help}"
        );
        assert!(help.lines().all(|line| line.chars().count() <= 100), "{name}: {help}");
    }
}

#[test]
fn no_subcommand_shows_the_help() {
    Folder::new().rayfold("").assert().code(2).stdout_eq("").stderr_eq(str![[r#"
...
Usage: rayfold [OPTIONS] <COMMAND>
...
"#]]);
}

#[test]
fn unknown_subcommand() {
    Folder::new().rayfold("rendr").assert().code(2).stderr_eq(str![[r#"
error: unrecognized subcommand 'rendr'

  tip: some similar subcommands exist: [..]'render'

Usage: rayfold [OPTIONS] <COMMAND>

For more information, try '--help'.

"#]]);
}

#[test]
fn no_output() {
    Folder::with("a.txt", BALL).rayfold("render a.txt").assert().code(2).stderr_eq(str![[r#"
error: the following required arguments were not provided:
  --output <OUT>

Usage: rayfold render --output <OUT> <INPUT>...

For more information, try '--help'.

"#]]);
}

#[test]
fn unknown_output_ending() {
    let folder = Folder::with("a.txt", BALL);
    folder.rayfold("render a.txt -o a.jpg").assert().code(2).stderr_eq(str![[r#"
error: cannot tell from its ending what a.jpg should be: expected .gif, .apng, .webp or .y4m for an animation, .png, .tif or .tiff for one frame, or a pattern such as frames/%04d.png for many

"#]]);
    folder.rayfold("render a.txt -o a").assert().code(2).stderr_eq(str![[r#"
error: cannot tell from its ending what a should be: expected .gif, .apng, .webp or .y4m for an animation, .png, .tif or .tiff for one frame, or a pattern such as frames/%04d.png for many

"#]]);
    assert_eq!(folder.list("."), ["a.txt"]);
}

#[test]
fn many_frames_for_one_image() {
    let folder = Folder::with("a.txt", BALL.to_owned() + "Trace");
    folder.rayfold("render a.txt -o a.png").assert().code(1).stderr_eq(str![[r#"
error: 2 frames do not fit into a.png: expected --frame N, a pattern such as frames/%04d.png, or .gif

"#]]);
}

#[test]
fn frame_beyond_the_last() {
    let folder = Folder::with("a.txt", BALL);
    folder.rayfold("render a.txt -o a.png --frame 2").assert().code(1).stderr_eq(str![[r#"
error: the input has 1 frame: there is no frame 2

"#]]);
    folder.rayfold("render a.txt -o a.png --frame 0").assert().code(2).stderr_eq(str![[r#"
error: invalid value '0' for '--frame <N|A..B>': expected a frame such as 7, or a range such as 3..9, counted from 1

For more information, try '--help'.

"#]]);
    folder.rayfold("render a.txt -o a.png --frame 5..3").assert().code(2).stderr_eq(str![[r#"
error: invalid value '5..3' for '--frame <N|A..B>': the range is empty; did you mean 3..5?

For more information, try '--help'.

"#]]);
}

#[test]
fn size_of_an_orthocamera() {
    let folder = Folder::with("a.txt", "Screen 4 3\nOrthocamera\nTrace\n");
    folder.rayfold("render a.txt -o a.png --size 8x6").assert().code(1).stderr_eq(str![[r#"
error: --size needs a pinhole camera: frame 1 (a.txt) is drawn by Orthocamera, whose pixels are world units

"#]]);
}

#[test]
fn senseless_sizes_and_rates() {
    let folder = Folder::with("a.txt", BALL);
    folder.rayfold("render a.txt -o a.gif --size 8").assert().code(2).stderr_eq(str![[r#"
error: invalid value '8' for '--size <WxH>': expected width and height in pixels, such as 640x480

For more information, try '--help'.

"#]]);
    folder.rayfold("render a.txt -o a.gif --size 9000x9000").assert().code(2).stderr_eq(str![[r#"
error: --size asks for 81000000 pixels, more than the limit of 64000000 (--max-pixels)

"#]]);
    folder.rayfold("render a.txt -o a.gif --fps 0").assert().code(2).stderr_eq(str![[r#"
error: --fps 0: `fps` must be from 0.01 to 1000

"#]]);
    folder.rayfold("render a.txt -o a.gif --threads 0").assert().code(2).stderr_eq(str![[r#"
error: invalid value '0' for '--threads <N>': expected a whole number, 1 or more

For more information, try '--help'.

"#]]);
    folder.rayfold("render a.txt -o a.png --fps 20").assert().code(2).stderr_eq(str![[r#"
error: --fps, --loop, --once and --final-delay are for animations: expected an output that ends in .gif, .apng or .webp

"#]]);
}

#[test]
fn folders_do_not_mix() {
    let folder = Folder::with("scenes/a.txt", BALL);
    folder.write("b.txt", BALL);
    folder.rayfold("render scenes b.txt -o a.gif").assert().code(2).stderr_eq(str![[r#"
error: scenes is a folder, which is an animation by itself: give it alone, or give script files

"#]]);
    folder.rayfold("render - - -o a.gif").assert().code(2).stderr_eq(str![[r#"
error: standard input (-) can be read only once

"#]]);
}

#[test]
fn completions_know_the_subcommands() {
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let out = Folder::new().rayfold(&format!("completions {shell}")).output().unwrap();
        let script = String::from_utf8(out.stdout).unwrap();
        assert!(out.status.success() && script.contains("max-pixels"), "{shell}: {script}");
    }
    Folder::new().rayfold("completions cmd.exe").assert().code(2);
}

#[test]
fn there_is_a_manual_page_for_each_subcommand() {
    let folder = Folder::new();
    for _ in 0..2 {
        folder.rayfold("man pages/man1").assert().code(0);
    }
    let text = |name: &str| String::from_utf8(folder.read(&format!("pages/man1/{name}"))).unwrap();
    assert!(text("rayfold.1").contains(".TH rayfold 1"));
    assert!(text("rayfold-render.1").contains("max\\-pixels"));
    let help = folder.rayfold("--help").output().unwrap();
    let help = String::from_utf8(help.stdout).unwrap();
    let mut names: Vec<String> = help
        .lines()
        .skip_while(|line| *line != "Commands:")
        .skip(1)
        .take_while(|line| !line.is_empty())
        .filter(|line| !line.starts_with("   "))
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != "help")
        .map(|name| format!("rayfold-{name}.1"))
        .collect();
    names.push("rayfold.1".into());
    names.sort();
    let mut there = folder.list("pages/man1");
    there.sort();
    assert_eq!(there, names);
    folder.write("file", "");
    folder.rayfold("man file").assert().code(1);
}

#[cfg(unix)]
#[test]
fn a_reader_that_has_had_enough_is_no_error() {
    let status = std::process::Command::new("sh")
        .args([
            "-c",
            &format!("{} completions bash | head -n 1 >/dev/null; exit ${{PIPESTATUS:-0}}", crate::RAYFOLD),
        ])
        .status()
        .unwrap();
    assert!(status.success());
}
