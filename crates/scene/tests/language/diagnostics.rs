//! The diagnostics of scripts with faults, word for word.
//!
//! After a deliberate change, `UPDATE_EXPECT=1 cargo test -p rayfold-scene` renews the expected texts.

use expect_test::expect;
use rayfold_scene::Limits;

use super::diagnostic_text::{check, check_limited};

#[test]
fn a_misspelt_command() {
    check(
        "Screen 4 3\nSpere 1 0 0 -5 1 0 0 0 0 0\nTrace",
        expect![[r#"
        error: unknown command `Spere`
         --> a.txt:2:1
          |
        2 | Spere 1 0 0 -5 1 0 0 0 0 0
          | ^^^^^ expected a command
          |
          = help: did you mean `Sphere`?"#]],
    );
}

#[test]
fn a_word_that_is_like_no_command() {
    check(
        "Screen 4 3\nRotate 90 0 1 0\nTrace",
        expect![[r#"
            error: unknown command `Rotate`
             --> a.txt:2:1
              |
            2 | Rotate 90 0 1 0
              | ^^^^^^ expected a command
              |
              = help: the commands are `Screen`, `Orthocamera`, `Camera`, `Look`, `Lens`, `Background`, `Sky`, `Fog`, `Samples`, `Shutter`, `Tone`, `Depth`, `Indirect`, `Sphere`, `Triangle`, `Box`, `Plane`, `Disc`, `Cylinder`, `Cone`, `Torus`, `Capsule`, `Roundbox`, `Mesh`, `Text`, `Material`, `Group`, `End`, `Use`, `Ilight`, `Plight`, `Frames`, `Clear`, `Trace`"#]],
    );
}

#[test]
fn a_command_that_cannot_be_seen_to_be_misspelt() {
    check(
        "Screen 4 3\n\u{feff}Clear\nTrace\u{1b}[31m",
        expect![[r#"
            error: unknown command `\u{feff}Clear`
             --> a.txt:2:1
              |
            2 | ﻿Clear
              | ^^^^^ expected a command
              |
              = help: did you mean `Clear`?

            error: unknown command `Trace\u{1b}[31m`
             --> a.txt:3:1
              |
            3 | Trace␛[31m
              | ^^^^^^^^^^ expected a command
              |
              = help: the commands are `Screen`, `Orthocamera`, `Camera`, `Look`, `Lens`, `Background`, `Sky`, `Fog`, `Samples`, `Shutter`, `Tone`, `Depth`, `Indirect`, `Sphere`, `Triangle`, `Box`, `Plane`, `Disc`, `Cylinder`, `Cone`, `Torus`, `Capsule`, `Roundbox`, `Mesh`, `Text`, `Material`, `Group`, `End`, `Use`, `Ilight`, `Plight`, `Frames`, `Clear`, `Trace`

            error: nothing is rendered: there is no `Trace`
             --> a.txt:3:11
              |
            3 | Trace␛[31m
              |           ^ expected a `Trace`
              |
              = help: `Trace` renders a frame of everything that stands before it"#]],
    );
}

#[test]
fn a_comment_of_another_language() {
    check(
        "// a scene\nScreen 4 3\nTrace",
        expect![[r#"
        error: unknown command `//`
         --> a.txt:1:1
          |
        1 | // a scene
          | ^^ expected a command
          |
          = help: a comment starts with `#`"#]],
    );
}

#[test]
fn parameters_on_the_next_line() {
    check(
        "Screen 4 3\nSphere 1 0 0 -5 1 0 0\n 0 0 0\nTrace",
        expect![[r#"
            error: `Sphere` takes 10 to 13 numbers, found 7
             --> a.txt:2:22
              |
            2 | Sphere 1 0 0 -5 1 0 0
              |                      ^ expected `rr` here
              |
              = help: write `Sphere R cx cy cz ar ag ab rr rg rb [sr sg sb]`

            error: unknown command `0`
             --> a.txt:3:2
              |
            3 |  0 0 0
              |  ^ expected a command
              |
              = help: a command and all its parameters must be on one line"#]],
    );
}

#[test]
fn missing_parameters() {
    check(
        "Screen\nBackground 1 1 # red\nTrace",
        expect![[r#"
            error: `Screen` takes 2 numbers, found none
             --> a.txt:1:7
              |
            1 | Screen
              |       ^ expected `nx` here
              |
              = help: write `Screen nx ny`

            error: `Background` takes 3 or 6 numbers, found 2
             --> a.txt:2:15
              |
            2 | Background 1 1 # red
              |               ^ expected `b` here
              |
              = help: write `Background r g b [R G B] or none`"#]],
    );
}

#[test]
fn surplus_parameters() {
    check(
        "Screen 4 3 Trace\nTriangle 0 0 0 1 0 0 0 1 0 1 1 1 0 0 0 .5 .5 .5 .5\nTrace 1",
        expect![[r#"
            error: `Screen` takes 2 numbers, found 3
             --> a.txt:1:12
              |
            1 | Screen 4 3 Trace
              |            ^^^^^ expected the end of the line
              |
              = help: each command needs a line of its own

            error: `Triangle` takes 15 to 18 numbers, found 19
             --> a.txt:2:51
              |
            2 | Triangle 0 0 0 1 0 0 0 1 0 1 1 1 0 0 0 .5 .5 .5 .5
              |                                                   ^ expected the end of the line
              |
              = help: write `Triangle ux uy uz vx vy vz wx wy wz ar ag ab rr rg rb [sr sg sb]`

            error: `Trace` takes no parameters, found 1
             --> a.txt:3:7
              |
            3 | Trace 1
              |       ^ expected the end of the line
              |
              = help: write `Trace`"#]],
    );
}

#[test]
fn words_that_are_no_numbers() {
    check(
        "Screen 4 3\nSphere one 0x10 nan -inf 1.2.3 1 1 1e 1 1\nTrace",
        expect![[r#"
        error: `one` is not a number
         --> a.txt:2:8
          |
        2 | Sphere one 0x10 nan -inf 1.2.3 1 1 1e 1 1
          |        ^^^ expected `R`, a number such as 2, -.5 or 1e-3

        error: `0x10` is not a number
         --> a.txt:2:12
          |
        2 | Sphere one 0x10 nan -inf 1.2.3 1 1 1e 1 1
          |            ^^^^ expected `cx`, a number such as 2, -.5 or 1e-3

        error: `nan` is not a number
         --> a.txt:2:17
          |
        2 | Sphere one 0x10 nan -inf 1.2.3 1 1 1e 1 1
          |                 ^^^ expected `cy`, a number such as 2, -.5 or 1e-3

        error: `-inf` is not a number
         --> a.txt:2:21
          |
        2 | Sphere one 0x10 nan -inf 1.2.3 1 1 1e 1 1
          |                     ^^^^ expected `cz`, a number such as 2, -.5 or 1e-3

        error: `1.2.3` is not a number
         --> a.txt:2:26
          |
        2 | Sphere one 0x10 nan -inf 1.2.3 1 1 1e 1 1
          |                          ^^^^^ expected `ar`, a number such as 2, -.5 or 1e-3

        error: `1e` is not a number
         --> a.txt:2:36
          |
        2 | Sphere one 0x10 nan -inf 1.2.3 1 1 1e 1 1
          |                                    ^^ expected `rr`, a number such as 2, -.5 or 1e-3"#]],
    );
}

#[test]
fn signs_and_blanks_of_a_word_processor() {
    check(
        "Screen 4 3\nBackground \u{2212}1 1\u{a0}0 0,5 0\nTrace",
        expect![[r#"
            error: `−1` is not a number
             --> a.txt:2:12
              |
            2 | Background −1 1 0 0,5 0
              |            ^^ expected `r`, a number such as 2, -.5 or 1e-3
              |
              = help: the minus sign is `-`, this one is U+2212

            error: `1\u{a0}0` is not a number
             --> a.txt:2:15
              |
            2 | Background −1 1 0 0,5 0
              |               ^^^ expected `g`, a number such as 2, -.5 or 1e-3
              |
              = help: blanks, tabs and commas separate parameters, U+00A0 does not

            error: `Background` takes 3 or 6 numbers, found 5
             --> a.txt:2:24
              |
            2 | Background −1 1 0 0,5 0
              |                        ^ expected `B` here
              |
              = help: write `Background r g b [R G B] or none`"#]],
    );
}

#[test]
fn a_number_too_large_for_a_float() {
    check(
        "Screen 4 3\nBackground 1e999 0 0\nTrace",
        expect![[r#"
        error: `1e999` is too large
         --> a.txt:2:12
          |
        2 | Background 1e999 0 0
          |            ^^^^^ expected `r`, a number up to 1.79e308"#]],
    );
}

#[test]
fn a_screen_without_pixels() {
    check(
        "Screen 0 101.5\nScreen -4 1e10\nTrace",
        expect![[r#"
            error: `0` is not a number of pixels
             --> a.txt:1:8
              |
            1 | Screen 0 101.5
              |        ^ expected `nx`, a whole number from 1

            error: `101.5` is not a number of pixels
             --> a.txt:1:10
              |
            1 | Screen 0 101.5
              |          ^^^^^ expected `ny`, a whole number from 1

            error: `-4` is not a number of pixels
             --> a.txt:2:8
              |
            2 | Screen -4 1e10
              |        ^^ expected `nx`, a whole number from 1

            error: `1e10` is not a number of pixels
             --> a.txt:2:11
              |
            2 | Screen -4 1e10
              |           ^^^^ expected `ny`, a whole number up to 4,294,967,295"#]],
    );
}

#[test]
fn a_radius_of_nothing() {
    check(
        "Screen 4 3\nSphere 0 0 0 -5 1 0 0 0 0 0\nSphere -1, 0 0 -5, 1 0 0, 0 0 0\nTrace",
        expect![[r#"
            warning: nothing is drawn: the radius is 0
             --> a.txt:2:8
              |
            2 | Sphere 0 0 0 -5 1 0 0 0 0 0
              |        ^ expected a number greater than 0, or a curve that is not always 0

            error: the radius must not be negative
             --> a.txt:3:8
              |
            3 | Sphere -1, 0 0 -5, 1 0 0, 0 0 0
              |        ^^ expected a number from 0"#]],
    );
}

#[test]
fn everything_wrong_with_a_camera() {
    check(
        "Screen 4 3\nCamera 0 0 5  0 0 0  0 1 0  0  -1 -1 -1 -1\nTrace",
        expect![[r#"
        error: the gaze must not be zero
         --> a.txt:2:15
          |
        2 | Camera 0 0 5  0 0 0  0 1 0  0  -1 -1 -1 -1
          |               ^^^^^ expected three numbers that are not all 0

        error: the window's distance s must be greater than zero
         --> a.txt:2:29
          |
        2 | Camera 0 0 5  0 0 0  0 1 0  0  -1 -1 -1 -1
          |                             ^ expected a number greater than 0

        error: the window must not be empty: au equals bu
         --> a.txt:2:32
          |
        2 | Camera 0 0 5  0 0 0  0 1 0  0  -1 -1 -1 -1
          |                                ^^^^^^^^ expected `au` and `bu` to differ

        error: the window must not be empty: av equals bv
         --> a.txt:2:35
          |
        2 | Camera 0 0 5  0 0 0  0 1 0  0  -1 -1 -1 -1
          |                                   ^^^^^^^^ expected `av` and `bv` to differ"#]],
    );
}

#[test]
fn a_gaze_along_the_view_up() {
    check(
        "Screen 4 3\nCamera 0 0 5  0 0.1 0  0 -7 0  1  -1 -1 1 1\nTrace",
        expect![[r#"
        error: the gaze and the view-up must not be parallel
         --> a.txt:2:15
          |
        2 | Camera 0 0 5  0 0.1 0  0 -7 0  1  -1 -1 1 1
          |               ^^^^^^^^^^^^^^^ expected two directions that span a plane"#]],
    );
}

#[test]
fn an_orbit_s_eye_above_the_target_but_for_rounding() {
    // The cosine of 90° as programs write it.
    for eye in ["3.06e-16 5 0", "0 -5 3.06e-16"] {
        let script = format!("Screen 4 3\nLook {eye} 0 0 0 40\nTrace");
        let parsed = rayfold_scene::parse("a.txt", script.as_bytes(), &rayfold_scene::Limits::default());
        assert!(parsed.script.is_some(), "{eye}: {:?}", parsed.diagnostics);
    }
    check(
        "Screen 4 3\nLook 3.06e-16 5 0  0 0 0  40  0 1 0\nTrace",
        expect![[r#"
            error: the gaze and the view-up must not be parallel
             --> a.txt:2:31
              |
            2 | Look 3.06e-16 5 0  0 0 0  40  0 1 0
              |                               ^^^^^ expected two directions that span a plane"#]],
    );
}

#[test]
fn a_light_that_travels_nowhere() {
    check(
        "Screen 4 3\nIlight 1 1 1 0 0 -0\nTrace",
        expect![[r#"
        error: the light's direction must not be zero
         --> a.txt:2:14
          |
        2 | Ilight 1 1 1 0 0 -0
          |              ^^^^^^ expected three numbers that are not all 0"#]],
    );
}

#[test]
fn a_triangle_of_no_area_is_a_warning() {
    check(
        "Screen 4 3\nTriangle 0 0 0 .1 .2 .3 .2 .4 .6 1 1 1 0 0 0\nTrace",
        expect![[r#"
        warning: a triangle of no area is never hit
         --> a.txt:2:10
          |
        2 | Triangle 0 0 0 .1 .2 .3 .2 .4 .6 1 1 1 0 0 0
          |          ^^^^^^^^^^^^^^^^^^^^^^^ expected three points that are not on a line"#]],
    );
}

#[test]
fn no_screen_is_told_once() {
    check(
        "Trace\nTrace",
        expect![[r#"
        error: the size of the image is not known
         --> a.txt:1:1
          |
        1 | Trace
          | ^^^^^ expected a `Screen` before this
          |
          = help: write for example `Screen 640 480`"#]],
    );
}

#[test]
fn no_trace() {
    check(
        "Screen 4 3\nSphere 1 0 0 -5 1 0 0 0 0 0\n",
        expect![[r#"
        error: nothing is rendered: there is no `Trace`
         --> a.txt:3:1
          |
        3 |
          | ^ expected a `Trace`
          |
          = help: `Trace` renders a frame of everything that stands before it"#]],
    );
}

#[test]
fn nothing_at_all() {
    check(
        "",
        expect![[r#"
        error: nothing is rendered: there is no `Trace`
         --> a.txt:1:1
          |
        1 |
          | ^ expected a `Trace`
          |
          = help: `Trace` renders a frame of everything that stands before it"#]],
    );
}

#[test]
fn a_faulty_screen_or_trace_is_not_a_missing_one() {
    check(
        "Scren 4 3\nTrase",
        expect![[r#"
        error: unknown command `Scren`
         --> a.txt:1:1
          |
        1 | Scren 4 3
          | ^^^^^ expected a command
          |
          = help: did you mean `Screen`?

        error: unknown command `Trase`
         --> a.txt:2:1
          |
        2 | Trase
          | ^^^^^ expected a command
          |
          = help: did you mean `Trace`?"#]],
    );
}

#[test]
fn what_stands_behind_the_last_trace() {
    check(
        "Screen 4 3\nTrace\nClear\nBackground 1 1 1\nSphere 1 0 0 -5 1 0 0 0 0 0",
        expect![[r#"
        warning: this has no effect: no `Trace` follows
         --> a.txt:4:1
          |
        4 | Background 1 1 1
          | ^^^^^^^^^^ expected a `Trace` after this
          |
          = help: `Trace` renders a frame of everything that stands before it"#]],
    );
}

#[test]
fn an_image_beyond_the_limit() {
    check(
        "Screen 8000 8000\nScreen 8000 8001\nTrace",
        expect![[r#"
        error: the image has 64,008,000 pixels, the limit is 64,000,000
         --> a.txt:2:8
          |
        2 | Screen 8000 8001
          |        ^^^^^^^^^ expected a smaller image
          |
          = help: make the image smaller or raise the limit"#]],
    );
}

#[test]
fn more_objects_lights_and_frames_than_the_limits() {
    let limits = Limits { max_objects: 1, max_lights: 1, max_frames: Some(2), ..Limits::default() };
    let sphere = "Sphere 1 0 0 -5 1 0 0 0 0 0\n";
    let light = "Ilight 1 1 1 0 0 -1\n";
    let scene = format!("{sphere}{light}Trace\n");
    check_limited(format!("Screen 4 3\n{scene}Clear\n{scene}"), limits, expect![]);
    check_limited(
        format!("Screen 4 3\n{scene}{scene}{scene}"),
        limits,
        expect![[r#"
            error: more than 1 objects in a scene
             --> a.txt:5:1
              |
            5 | Sphere 1 0 0 -5 1 0 0 0 0 0
              | ^^^^^^ expected at most 1, this is one more

            error: more than 1 lights in a scene
             --> a.txt:6:1
              |
            6 | Ilight 1 1 1 0 0 -1
              | ^^^^^^ expected at most 1, this is one more

            error: more than 2 frames
              --> a.txt:10:1
               |
            10 | Trace
               | ^^^^^ expected at most 2, this is one more"#]],
    );
}

#[test]
fn a_script_larger_than_the_limit() {
    let limits = Limits { max_script_bytes: 16, ..Limits::default() };
    check_limited("Screen 4 3\nTrace", limits, expect![]);
    check_limited(
        "Screen 4 3\nTrace\n",
        limits,
        expect![[r#"
            error: the script is larger than 16 bytes
             --> a.txt:1:1
              |
            1 | Screen 4 3
              | ^ expected a smaller script
              |
              = help: split it into several scripts or raise the limit"#]],
    );
}

#[test]
fn more_faults_than_are_told() {
    let limits = Limits { max_described: 1, ..Limits::default() };
    check_limited(
        "Screen 4 3\nTrace 1 # ä\nx\nTrace ä\nTrace 1\n",
        limits,
        expect![[r#"
        error: `Trace` takes no parameters, found 1
         --> a.txt:2:7
          |
        2 | Trace 1 # ä
          |       ^ expected the end of the line
          |
          = help: write `Trace`

        error: 3 more errors from here on
         --> a.txt:3:1
          |
        3 | x
          | ^"#]],
    );
}

#[test]
fn text_that_is_not_utf8() {
    check(
        b"Screen 4 3 # sch\xc3\xb6n\n# sch\xf6n\nTrace # \xe2\x82",
        expect![[r#"
            error: this is not UTF-8 text: 0xF6
             --> a.txt:2:6
              |
            2 | # sch�n
              |      ^ expected UTF-8
              |
              = help: save the script as UTF-8

            error: this is not UTF-8 text: 0xE2 0x82
             --> a.txt:3:9
              |
            3 | Trace # �
              |         ^ expected UTF-8
              |
              = help: save the script as UTF-8"#]],
    );
}

#[test]
fn utf16_text() {
    check(
        b"\xff\xfeT\0r\0a\0c\0e\0",
        expect![[r#"
        error: the script is UTF-16 text
         --> a.txt:1:1
          |
        1 | ��
          | ^^ expected UTF-8
          |
          = help: save the script as UTF-8"#]],
    );
}

#[test]
fn line_ends_of_the_last_century() {
    check(
        "Screen 4 3\rTrace\r",
        expect![[r#"
            error: a carriage return without a line feed
             --> a.txt:1:11
              |
            1 | Screen 4 3␍Trace
              |           ^ expected a line feed after this
              |
              = help: lines end with LF or CR LF; save the script with either"#]],
    );
    check(
        "Screen 4 3 # small\rTrace\r\nTrace\r\n",
        expect![[r#"
            error: a carriage return without a line feed
             --> a.txt:1:19
              |
            1 | Screen 4 3 # small␍Trace
              |                   ^ expected a line feed after this
              |
              = help: lines end with LF or CR LF; save the script with either"#]],
    );
}

#[test]
fn a_place_counts_in_characters() {
    check(
        "\u{feff}# ä\r\nScreen 4 3\r\n\tÄÖÜ 日本\r\nTrace\r\n",
        expect![[r#"
            error: unknown command `ÄÖÜ`
             --> a.txt:3:2
              |
            3 |     ÄÖÜ 日本
              |     ^^^ expected a command
              |
              = help: the commands are `Screen`, `Orthocamera`, `Camera`, `Look`, `Lens`, `Background`, `Sky`, `Fog`, `Samples`, `Shutter`, `Tone`, `Depth`, `Indirect`, `Sphere`, `Triangle`, `Box`, `Plane`, `Disc`, `Cylinder`, `Cone`, `Torus`, `Capsule`, `Roundbox`, `Mesh`, `Text`, `Material`, `Group`, `End`, `Use`, `Ilight`, `Plight`, `Frames`, `Clear`, `Trace`"#]],
    );
}

#[test]
fn a_long_line_is_cut_around_the_fault() {
    check(
        format!("Screen 4 3\nBackground{} x{} # {}\nTrace", " ".repeat(600), " 1".repeat(2), "-".repeat(300)),
        expect![[r#"
            error: `x` is not a number
             --> a.txt:2:612
              |
             ::: 
            2 | ...                                         x 1 1 # ---------------------------------------------------------------------------------...
              |                                             ^ expected `r`, a number such as 2, -.5 or 1e-3"#]],
    );
    check(
        format!("Screen 4 3\nTrace {}\n", "x".repeat(10_000)),
        expect![[r#"
        error: `Trace` takes no parameters, found 1
         --> a.txt:2:7
          |
        2 | Trace xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx…
          |       ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^ expected the end of the line
          |
          = help: write `Trace`"#]],
    );
}

#[test]
fn what_a_clear_removes_before_a_trace_has_no_effect() {
    check(
        "Screen 4 3\nTrace\nSphere 1 0 0 -5 1 0 0 0 0 0\nIlight 1 1 1 0 0 -1\nClear",
        expect![[r#"
        warning: this has no effect: a `Clear` removes it before a `Trace` shows it
         --> a.txt:3:1
          |
        3 | Sphere 1 0 0 -5 1 0 0 0 0 0
          | ^^^^^^ expected a `Trace` between this and the `Clear`
          |
          = help: `Trace` renders a frame of everything that stands before it"#]],
    );
    check(
        "Screen 4 3\nBackground 1 1 1\nCamera 0 0 5 0 0 -1 0 1 0 1 -1 -1 1 1\nClear\nTrace",
        expect![[r#"
            warning: this has no effect: a `Clear` removes it before a `Trace` shows it
             --> a.txt:2:1
              |
            2 | Background 1 1 1
              | ^^^^^^^^^^ expected a `Trace` between this and the `Clear`
              |
              = help: `Trace` renders a frame of everything that stands before it

            warning: the pixels are not square: a sphere looks like an ellipse
             --> a.txt:3:29
              |
            3 | Camera 0 0 5 0 0 -1 0 1 0 1 -1 -1 1 1
              |                             ^^^^^^^^^ expected a window of the shape 4 : 3
              |
              = help: write for example `-1.33333 -1 1.33333 1`"#]],
    );
    check(
        "Screen 4 3\nTrace\nCamera 0 0 5 0 0 -1 0 1 0 1 -1 -1 1 1\nClear",
        expect![[r#"
        warning: this has no effect: no `Trace` follows
         --> a.txt:3:1
          |
        3 | Camera 0 0 5 0 0 -1 0 1 0 1 -1 -1 1 1
          | ^^^^^^ expected a `Trace` after this
          |
          = help: `Trace` renders a frame of everything that stands before it"#]],
    );
    check("Screen 4 3\nBackground 1 1 1\nTrace\nClear\nClear\nTrace", expect![]);
}

#[test]
fn a_comma_as_decimal_sign() {
    check(
        "Screen 4 3\nBackground 0,5 1 0\nTrace",
        expect![[r#"
            error: `Background` takes 3 or 6 numbers, found 4
             --> a.txt:2:19
              |
            2 | Background 0,5 1 0
              |                   ^ expected `G` here
              |
              = help: a comma separates numbers: if `0,5` is to be one, it is `0.5`; write `Background r g b [R G B] or none`"#]],
    );
    check(
        "Screen 4 3\nSphere 1,5 0 0 -5 1 0 0 0 0 0 # as 1.5\nTrace",
        expect![[r#"
            warning: `1,5` is read as two numbers
             --> a.txt:2:8
              |
            2 | Sphere 1,5 0 0 -5 1 0 0 0 0 0 # as 1.5
              |        ^^^ expected `1.5`, or a space after the comma
              |
              = help: the decimal sign is a point, a comma separates numbers"#]],
    );
    check(
        "Screen 4 3\nSphere 1 -0,5 0 -5 1,5 0 0 0 0 0,25\nTrace",
        expect![[r#"
            warning: `-0,5` is read as two numbers
             --> a.txt:2:10
              |
            2 | Sphere 1 -0,5 0 -5 1,5 0 0 0 0 0,25
              |          ^^^^ expected `-0.5`, or a space after the comma
              |
              = help: the decimal sign is a point, a comma separates numbers"#]],
    );
}

#[test]
fn commas_that_separate_are_no_decimal_signs() {
    check(
        "Screen 4,3\nSphere 1 0,0,-5 1,0,0 0,0,0 1,1,1\nSphere 1, 0, 0, -5, 1, 0, 0, 0, 0, 0, 1\nTrace",
        expect![],
    );
    check(
        "Screen,4,3\nSphere,1,0,0,-5,1,0,0,0,0,0,1\nBackground 0,5,1,0\nTrace",
        expect![[r#"
            error: `Background` takes 3 or 6 numbers, found 4
             --> a.txt:3:19
              |
            3 | Background 0,5,1,0
              |                   ^ expected `G` here
              |
              = help: write `Background r g b [R G B] or none`"#]],
    );
}
