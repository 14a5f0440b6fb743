//! Every kind of bad input is reported precisely, with exit code 1, and nothing is written.

use snapbox::str;

use crate::{BALL, Folder};

/// Renders `script`, which must fail. Returns the output.
fn render(script: impl AsRef<[u8]>) -> snapbox::cmd::OutputAssert {
    let folder = Folder::with("a.txt", script);
    let assert = folder.rayfold("render a.txt -o a.gif").assert().code(1).stdout_eq("");
    assert_eq!(folder.list("."), ["a.txt"], "something was written");
    assert
}

#[test]
fn missing_file() {
    Folder::new().rayfold("render nope.txt -o a.gif").assert().code(1).stderr_eq(str![[r#"
error: cannot read nope.txt: No such file or directory
error: nothing was written: 1 error

"#]]);
}

#[test]
fn several_missing_files_are_all_named() {
    let folder = Folder::with("a.txt", BALL);
    folder.rayfold("render nope.txt a.txt neither.txt -o a.gif").assert().code(1).stderr_eq(str![[r#"
error: cannot read nope.txt: No such file or directory
error: cannot read neither.txt: No such file or directory
error: nothing was written: 2 errors in 2 of 3 files

"#]]);
}

#[test]
fn empty_folder() {
    let folder = Folder::new();
    std::fs::create_dir(folder.join("scenes")).unwrap();
    folder.rayfold("render scenes -o a.gif").assert().code(1).stderr_eq(str![[r#"
error: the folder scenes is empty: expected scene scripts (*.txt)

"#]]);
}

#[test]
fn folder_without_scripts() {
    let folder = Folder::with("scenes/readme.md", "# Scenes");
    folder.rayfold("render scenes -o a.gif").assert().code(1).stderr_eq(str![[r#"
error: the folder scenes holds no scene scripts (*.txt)

"#]]);
}

#[test]
fn not_utf8() {
    render(b"Screen 4 3\nSphere 1 \xff\xfe 0\nTrace\n").stderr_eq(str![[r#"
error: this is not UTF-8 text: 0xFF
 --> a.txt:2:10
  |
2 | Sphere 1 �� 0
  |          ^ expected UTF-8
  |
  = help: save the script as UTF-8

error: nothing was written: 1 error

"#]]);
}

#[test]
fn unknown_command() {
    render(BALL.replace("Sphere", "Shpere")).stderr_eq(str![[r#"
error: unknown command `Shpere`
 --> a.txt:4:1
  |
4 | Shpere 1  0 0 0  .1 .1 .1  .8 .2 .1
  | ^^^^^^ expected a command
  |
  = help: did you mean `Sphere`?

error: nothing was written: 1 error

"#]]);
}

#[test]
fn too_few_parameters() {
    render(BALL.replace(".8 .2 .1", "")).stderr_eq(str![[r#"
error: `Sphere` takes 10 to 13 numbers, found 7
 --> a.txt:4:26
  |
4 | Sphere 1  0 0 0  .1 .1 .1  
  |                          ^ expected `rr` here
  |
  = help: write `Sphere R cx cy cz ar ag ab rr rg rb [sr sg sb]`

error: nothing was written: 1 error

"#]]);
}

#[test]
fn too_many_parameters() {
    render(BALL.replace("Screen 24, 16", "Screen 24, 16, 8")).stderr_eq(str![[r#"
error: `Screen` takes 2 numbers, found 3
 --> a.txt:1:16
  |
1 | Screen 24, 16, 8
  |                ^ expected the end of the line
  |
  = help: write `Screen nx ny`

error: nothing was written: 1 error

"#]]);
}

#[test]
fn parameter_that_is_no_number() {
    render(BALL.replace("Sphere 1", "Sphere one")).stderr_eq(str![[r#"
error: `one` is not a number
 --> a.txt:4:8
  |
4 | Sphere one  0 0 0  .1 .1 .1  .8 .2 .1
  |        ^^^ expected `R`, a number such as 2, -.5 or 1e-3

error: nothing was written: 1 error

"#]]);
}

#[test]
fn parameters_that_are_not_finite() {
    render(
        BALL.replace("Sphere 1", "Sphere inf").replace("Ilight 1", "Ilight NaN").replace("-1 -1", "1e999 -1"),
    )
    .stderr_eq(str![[r#"
error: `inf` is not a number
 --> a.txt:4:8
  |
4 | Sphere inf  0 0 0  .1 .1 .1  .8 .2 .1
  |        ^^^ expected `R`, a number such as 2, -.5 or 1e-3

error: `NaN` is not a number
 --> a.txt:5:8
  |
5 | Ilight NaN 1 1  1e999 -1 -1
  |        ^^^ expected `lr`, a number such as 2, -.5 or 1e-3

error: `1e999` is too large
 --> a.txt:5:17
  |
5 | Ilight NaN 1 1  1e999 -1 -1
  |                 ^^^^^ expected `dx`, a number up to 1.79e308

error: nothing was written: 3 errors

"#]]);
}

#[test]
fn no_screen() {
    render(BALL.replace("Screen 24, 16", "")).stderr_eq(str![[r#"
error: the size of the image is not known
 --> a.txt:6:1
  |
6 | Trace
  | ^^^^^ expected a `Screen` before this
  |
  = help: write for example `Screen 640 480`

error: nothing was written: 1 error

"#]]);
}

#[test]
fn no_trace() {
    render(BALL.replace("Trace", "")).stderr_eq(str![[r#"
error: nothing is rendered: there is no `Trace`
 --> a.txt:7:1
  |
7 |
  | ^ expected a `Trace`
  |
  = help: `Trace` renders a frame of everything that stands before it

error: nothing was written: 1 error

"#]]);
}

#[test]
fn empty_script() {
    render("").stderr_eq(str![[r#"
error: nothing is rendered: there is no `Trace`
 --> a.txt:1:1
  |
1 |
  | ^ expected a `Trace`
  |
  = help: `Trace` renders a frame of everything that stands before it

error: nothing was written: 1 error

"#]]);
}

#[test]
fn negative_radius() {
    render(BALL.replace("Sphere 1", "Sphere -1")).stderr_eq(str![[r#"
error: the radius must not be negative
 --> a.txt:4:8
  |
4 | Sphere -1  0 0 0  .1 .1 .1  .8 .2 .1
  |        ^^ expected a number from 0

error: nothing was written: 1 error

"#]]);
}

#[test]
fn a_radius_of_zero_is_drawn_as_nothing_with_a_warning() {
    let folder = Folder::with("a.txt", BALL.replace("Sphere 1", "Sphere 0"));
    folder.rayfold("check a.txt").assert().success().stderr_eq(str![[r#"
warning: nothing is drawn: the radius is 0
 --> a.txt:4:8
  |
4 | Sphere 0  0 0 0  .1 .1 .1  .8 .2 .1
  |        ^ expected a number greater than 0, or a curve that is not always 0

1 file, 1 frame: no errors, 1 warning

"#]]);
}

#[test]
fn zero_light_direction() {
    render(BALL.replace("-1 -1 -1", "0 0 0")).stderr_eq(str![[r#"
error: the light's direction must not be zero
 --> a.txt:5:15
  |
5 | Ilight 1 1 1  0 0 0
  |               ^^^^^ expected three numbers that are not all 0

error: nothing was written: 1 error

"#]]);
}

#[test]
fn zero_gaze() {
    render(BALL.replace("0 0 -1  0 1 0", "0 0 0  0 1 0")).stderr_eq(str![[r#"
error: the gaze must not be zero
 --> a.txt:2:15
  |
2 | Camera 0 0 5  0 0 0  0 1 0  1  -.3 -.2 .3 .2
  |               ^^^^^ expected three numbers that are not all 0

error: nothing was written: 1 error

"#]]);
}

#[test]
fn gaze_parallel_to_up() {
    render(BALL.replace("0 0 -1  0 1 0", "0 0 -1  0 0 2")).stderr_eq(str![[r#"
error: the gaze and the view-up must not be parallel
 --> a.txt:2:15
  |
2 | Camera 0 0 5  0 0 -1  0 0 2  1  -.3 -.2 .3 .2
  |               ^^^^^^^^^^^^^ expected two directions that span a plane

error: nothing was written: 1 error

"#]]);
}

#[test]
fn empty_window() {
    render(BALL.replace("-.3 -.2 .3 .2", "-.3 -.2 -.3 .2")).stderr_eq(str![[r#"
error: the window must not be empty: au equals bu
 --> a.txt:2:33
  |
2 | Camera 0 0 5  0 0 -1  0 1 0  1  -.3 -.2 -.3 .2
  |                                 ^^^^^^^^^^^ expected `au` and `bu` to differ

error: nothing was written: 1 error

"#]]);
}

#[test]
fn image_beyond_the_limit() {
    render(BALL.replace("24, 16", "8001, 8000")).stderr_eq(str![[r#"
error: the image has 64,008,000 pixels, the limit is 64,000,000
 --> a.txt:1:8
  |
1 | Screen 8001, 8000
  |        ^^^^^^^^^^ expected a smaller image
  |
  = help: make the image smaller or raise the limit

--max-pixels sets the limit on pixels
error: nothing was written: 1 error

"#]]);
}

#[test]
fn image_beyond_a_limit_of_ones_own() {
    let folder = Folder::with("a.txt", BALL);
    folder.rayfold("render a.txt -o a.png --max-pixels 384").assert().code(0);
    folder.rayfold("render a.txt -o b.png --max-pixels 383").assert().code(1).stderr_eq(str![[r#"
error: the image has 384 pixels, the limit is 383
 --> a.txt:1:8
  |
1 | Screen 24, 16
  |        ^^^^^^ expected a smaller image
  |
  = help: make the image smaller or raise the limit

--max-pixels sets the limit on pixels
error: nothing was written: 1 error

"#]]);
    assert_eq!(folder.list("."), ["a.png", "a.txt"]);
}

#[test]
fn one_bad_script_among_fifty() {
    let folder = Folder::new();
    for step in 1..=50 {
        folder.write(&format!("scenes/f{step}.txt"), BALL);
    }
    folder.write("scenes/f37.txt", BALL.replace("Sphere 1", "Spere 1").replace("Ilight 1", "Ilight x"));
    folder.write("out.gif", "what was there before");
    folder.rayfold("render scenes -o out.gif").assert().code(1).stdout_eq("").stderr_eq(str![[r#"
error: unknown command `Spere`
 --> scenes/f37.txt:4:1
  |
4 | Spere 1  0 0 0  .1 .1 .1  .8 .2 .1
  | ^^^^^ expected a command
  |
  = help: did you mean `Sphere`?

error: `x` is not a number
 --> scenes/f37.txt:5:8
  |
5 | Ilight x 1 1  -1 -1 -1
  |        ^ expected `lr`, a number such as 2, -.5 or 1e-3

error: nothing was written: 2 errors in 1 of 50 files

"#]]);
    assert_eq!(folder.read("out.gif"), b"what was there before");
    assert_eq!(folder.list("."), ["out.gif", "scenes"]);
}

#[test]
fn all_errors_of_all_scripts_are_shown() {
    let folder = Folder::with("scenes/f1.txt", "Screen 4 3\nTrce\n");
    folder.write("scenes/f2.txt", BALL);
    folder.write("scenes/f10.txt", "Trace\n");
    folder.write("scenes/animation.json", "{\"fsp\": 25}");
    folder.rayfold("render scenes -o out.gif").assert().code(1).stderr_eq(str![[r#"
error: [..]`fsp`[..]
 --> scenes/animation.json:1:[..]
  |
1 | {"fsp": 25}
  |  ^^^^^ expected a field's name
  |
  = help: did you mean `fps`?

error: unknown command `Trce`
 --> scenes/f1.txt:2:1
  |
2 | Trce
  | ^^^^ expected a command
  |
  = help: did you mean `Trace`?

error: the size of the image is not known
 --> scenes/f10.txt:1:1
  |
1 | Trace
  | ^^^^^ expected a `Screen` before this
  |
  = help: write for example `Screen 640 480`

error: nothing was written: 3 errors in 3 of 4 files

"#]]);
}

#[test]
fn fewer_frames_than_the_settings_say() {
    let folder = Folder::with("scenes/f1.txt", BALL);
    folder.write("scenes/animation.json", "{\"frames\": 50}");
    folder.rayfold("render scenes -o out.gif").assert().code(1).stderr_eq(str![[r#"
error: animation.json says 50 frames, but the scripts give 1

"#]]);
    assert_eq!(folder.list("."), ["scenes"]);
}

#[test]
fn frames_of_different_sizes_do_not_make_a_gif() {
    let folder = Folder::with("a.txt", BALL);
    folder.write("b.txt", BALL.replace("24, 16", "12, 8"));
    folder.rayfold("render a.txt b.txt -o out.gif").assert().code(1).stderr_eq(str![[r#"
error: an animation has one size, but frame 1 (a.txt) is 24 x 16 and frame 2 (b.txt) is 12 x 8: give them one with --size

"#]]);
    folder.rayfold("render a.txt b.txt -o out.gif --size 6x4").assert().code(0);
}

#[test]
fn output_folder_missing() {
    let folder = Folder::with("a.txt", BALL);
    folder.rayfold("render a.txt -o no/such/a.gif").assert().code(1).stderr_eq(str![[r#"
error: cannot write no/such/a.gif: the folder no/such does not exist

"#]]);
}

#[test]
fn output_is_a_folder() {
    let folder = Folder::with("a.txt", BALL);
    std::fs::create_dir(folder.join("out.gif")).unwrap();
    folder.rayfold("render a.txt -o out.gif").assert().code(1).stderr_eq(str![[r#"
error: cannot write out.gif: it is a folder

"#]]);
}

/// Root may write almost everywhere, but not into `/proc`.
#[cfg(target_os = "linux")]
#[test]
fn output_folder_not_writable() {
    let folder = Folder::with("a.txt", BALL);
    folder
        .rayfold("render a.txt -o /proc/a.gif")
        .assert()
        .code(1)
        .stderr_eq("error: cannot write /proc/a.gif: [..]\n");
}

#[cfg(unix)]
#[test]
fn output_is_a_device() {
    let folder = Folder::with("a.txt", BALL);
    std::os::unix::fs::symlink("/dev/null", folder.join("null.gif")).unwrap();
    folder.rayfold("render a.txt -o null.gif").assert().code(1).stderr_eq(str![[r#"
error: cannot write null.gif: it is not a regular file

"#]]);
    assert!(std::fs::metadata("/dev/null").unwrap().len() == 0, "the device is still there");
}

#[cfg(unix)]
#[test]
fn file_that_may_not_be_read() {
    let folder = Folder::new();
    std::fs::create_dir(folder.join("a.txt")).unwrap();
    folder.write("a.txt/b.md", "");
    folder.rayfold("render a.txt -o a.gif").assert().code(1).stderr_eq(str![[r#"
error: the folder a.txt holds no scene scripts (*.txt)

"#]]);
}
