//! Warnings about valid scripts that probably do not show what was meant, word for word.
//!
//! After a deliberate change, `UPDATE_EXPECT=1 cargo test -p rayfold-scene` renews the expected texts.

use expect_test::expect;
use rayfold_scene::{Limits, parse};

use super::diagnostic_text::check;

/// A lit ball.
const BALL: &str = "Sphere 1 0 0 -5 1 0 0 1 0 0\nIlight 1 1 1 0 -1 0\n";

fn ball(before: &str, after: &str) -> String {
    format!("Screen 4 3\nLook 0 0 5 0 0 0 40\n{before}{BALL}{after}Trace")
}

#[test]
fn a_lens_with_one_ray_per_pixel() {
    check(
        ball("Lens .1\n", ""),
        expect![[r#"
        warning: the lens has no effect: there is one ray per pixel
         --> a.txt:3:1
          |
        3 | Lens .1
          | ^^^^ expected `Samples` before the `Trace`
          |
          = help: write for example `Samples 64`"#]],
    );
    check(ball("Lens .1\nSamples 64\n", ""), expect![[""]]);
    check(ball("Lens 0\n", ""), expect![[""]]);
    // The orthographic camera has no lens anyway.
    check(
        "Screen 4 3\nOrthocamera\nLens .1\nTrace",
        expect![[r#"
        warning: the lens has no effect with `Orthocamera`
         --> a.txt:3:1
          |
        3 | Lens .1
          | ^^^^ expected a `Look` or `Camera` beside this"#]],
    );
}

#[test]
fn indirect_light_with_one_ray_per_pixel_and_beside_light_from_nowhere() {
    check(
        ball("Indirect 2\n", ""),
        expect![[r#"
        warning: indirect light has no effect: there is one ray per pixel
         --> a.txt:3:1
          |
        3 | Indirect 2
          | ^^^^^^^^ expected `Samples` before the `Trace`
          |
          = help: write for example `Samples 64`"#]],
    );
    check(ball("Indirect 0\n", ""), expect![[""]]);
    check(
        ball("Indirect 2\nSamples 16\n", ""),
        expect![[r#"
        warning: ambient light comes from nowhere, beside the light that `Indirect` sends round
         --> a.txt:5:1
          |
        5 | Sphere 1 0 0 -5 1 0 0 1 0 0
          | ^^^^^^ expected `ambient` 0 0 0"#]],
    );
    check(ball("Indirect 0\nSamples 16\n", ""), expect![[""]]);
    // The ball's warning comes once, and nothing is dark beside what goes round.
    check(
        "Screen 4 3\nIndirect 2\nSamples 16\nBackground 1 1 1\nMaterial m ambient .1 0 0 diffuse 1 1 1\nGroup g\nSphere 1 0 0 0 m\nEnd\n\
         Use g\nTrace\nUse g\nTrace",
        expect![[r#"
            warning: ambient light comes from nowhere, beside the light that `Indirect` sends round
             --> a.txt:9:1
              |
            9 | Use g
              | ^^^ expected `ambient` 0 0 0"#]],
    );
    check(
        "Screen 4 3\nIndirect 2\nSamples 16\nMaterial m diffuse 1 1 1\nSphere 1 0 0 0 m\nSphere 1 2 0 0 0 0 0 1 1 1\nTrace",
        expect![[""]],
    );
    check(
        "Screen 4 3\nIndirect 17\nTrace",
        expect![[r#"
        error: `17` is not a number of bounces
         --> a.txt:2:10
          |
        2 | Indirect 17
          |          ^^ expected `n`, a whole number up to 16"#]],
    );
}

#[test]
fn a_shutter_with_one_ray_per_pixel() {
    check(
        ball("Shutter .5\n", ""),
        expect![[r#"
        warning: the shutter has no effect: there is one ray per pixel
         --> a.txt:3:1
          |
        3 | Shutter .5
          | ^^^^^^^ expected `Samples` before the `Trace`
          |
          = help: write for example `Samples 64`"#]],
    );
    check(ball("Shutter 0\n", ""), expect![[""]]);
    check(ball("Shutter .5\nSamples 2\n", ""), expect![[""]]);
}

#[test]
fn soft_lights_with_one_ray_per_pixel() {
    check(
        ball("Ilight 1 1 1 0 -1 0 5\n", ""),
        expect![[r#"
        warning: the size of the light has no effect: there is one ray per pixel
         --> a.txt:3:21
          |
        3 | Ilight 1 1 1 0 -1 0 5
          |                     ^ expected `Samples` before the `Trace`
          |
          = help: write for example `Samples 64`"#]],
    );
    check(
        ball("Plight 1 1 1 0 5 0 (1:1 2:3)\nIlight 1 1 1 0 -1 0 5\n", ""),
        expect![[r#"
            warning: the size of the light has no effect: there is one ray per pixel
             --> a.txt:3:20
              |
            3 | Plight 1 1 1 0 5 0 (1:1 2:3)
              |                    ^^^^^^^^^ expected `Samples` before the `Trace`
              |
              = help: write for example `Samples 64`

            warning: this changes from frame to frame, but there is one frame only
             --> a.txt:3:20
              |
            3 | Plight 1 1 1 0 5 0 (1:1 2:3)
              |                    ^^^^^^^^^ expected `Frames` before the `Trace`
              |
              = help: write for example `Frames 1 50`"#]],
    );
    check(ball("Plight 1 1 1 0 5 0 1\nSamples 16\n", ""), expect![[""]]);
    check(
        ball("Plight 1 1 1 0 5 0 1\nSamples 0\n", ""),
        expect![[r#"
        error: `0` is not a number of rays
         --> a.txt:4:9
          |
        4 | Samples 0
          |         ^ expected `n`, a whole number from 1"#]],
    );
}

#[test]
fn a_scene_without_light() {
    check(
        "Screen 4 3\nSphere 1 0 0 -5 .1 0 0 1 0 0\nTrace\nTrace",
        expect![[r#"
        warning: there is no light: diffuse colours are black
         --> a.txt:3:1
          |
        3 | Trace
          | ^^^^^ expected an `Ilight` or `Plight` before this
          |
          = help: write for example `Ilight 1 1 1  -1 -2 -1`"#]],
    );
    check("Screen 4 3\nSphere 1 0 0 -5 1 0 0 0 0 0\nTrace", expect![[""]]);
    check("Screen 4 3\nMaterial m mirror 1 1 1\nSphere 1 0 0 -5 m\nTrace", expect![[""]]);
    check(
        "Screen 4 3\nMaterial m diffuse (1:0 3:1) 0 0\nGroup g\nSphere 1 0 0 -5 m\nEnd\nUse g\nTrace",
        expect![[r#"
            warning: this changes from frame to frame, but there is one frame only
             --> a.txt:2:20
              |
            2 | Material m diffuse (1:0 3:1) 0 0
              |                    ^^^^^^^^^ expected `Frames` before the `Trace`
              |
              = help: write for example `Frames 1 50`

            warning: there is no light: diffuse colours are black
             --> a.txt:7:1
              |
            7 | Trace
              | ^^^^^ expected an `Ilight` or `Plight` before this
              |
              = help: write for example `Ilight 1 1 1  -1 -2 -1`"#]],
    );
    check(
        "Screen 4 3\nGroup g\nSphere (1:1 2:2) 0 0 -5 0 0 0 1 1 1\nEnd\nUse g\nClear\nTrace",
        expect![[r#"
            warning: this changes from frame to frame, but there is one frame only
             --> a.txt:3:8
              |
            3 | Sphere (1:1 2:2) 0 0 -5 0 0 0 1 1 1
              |        ^^^^^^^^^ expected `Frames` before the `Trace`
              |
              = help: write for example `Frames 1 50`

            warning: this has no effect: a `Clear` removes it before a `Trace` shows it
             --> a.txt:5:1
              |
            5 | Use g
              | ^^^ expected a `Trace` between this and the `Clear`
              |
              = help: `Trace` renders a frame of everything that stands before it"#]],
    );
    check(
        "Screen 4 3\nSphere 1 0 0 -5 .1 0 0 1 0 0\nIlite 1 1 1 0 -1 0\nTrace",
        expect![[r#"
            error: unknown command `Ilite`
             --> a.txt:3:1
              |
            3 | Ilite 1 1 1 0 -1 0
              | ^^^^^ expected a command
              |
              = help: the commands are `Screen`, `Orthocamera`, `Camera`, `Look`, `Lens`, `Background`, `Sky`, `Fog`, `Samples`, `Shutter`, `Tone`, `Depth`, `Indirect`, `Sphere`, `Triangle`, `Box`, `Plane`, `Disc`, `Cylinder`, `Cone`, `Torus`, `Capsule`, `Roundbox`, `Mesh`, `Text`, `Material`, `Group`, `End`, `Use`, `Ilight`, `Plight`, `Frames`, `Clear`, `Trace`"#]],
    );
}

#[test]
fn bodies_of_triangles_of_glass() {
    let face = |i: usize| format!("Triangle 0 0 {i} 1 0 0 0 1 0 g\n");
    let script = |glass: &str, faces: usize| {
        let faces: String = (1..=faces).map(face).collect();
        format!("Screen 4 3\nMaterial g {glass}\n{faces}Trace")
    };
    check(
        script("glass 1 1 1 1.5", 5),
        expect![[r#"
            warning: triangles of glass do not refract: each is a thin pane, also where they close a body
             --> a.txt:3:1
              |
            3 | Triangle 0 0 1 1 0 0 0 1 0 g
              | ^^^^^^^^ expected a shape with an inside
              |
              = help: bodies refract, such as `Sphere`, `Box`, `Cylinder` and closed meshes; the index 1 says that panes are meant"#]],
    );
    check(script("glass 1 1 1 1.5", 3), expect![[""]]);
    check(script("glass 1 1 1 1", 5), expect![[""]]);
}

#[test]
fn a_field_of_view_in_radians() {
    check(
        "Screen 4 3\nLook 0 0 5 0 0 0 .7\nTrace",
        expect![[r#"
        warning: a very narrow field of view: the angle is in degrees
         --> a.txt:2:18
          |
        2 | Look 0 0 5 0 0 0 .7
          |                  ^^ expected an angle such as 40
          |
          = help: if 0.7 is in radians, it is 40.107 degrees"#]],
    );
    check(
        "Screen 4 3\nLook 0 0 5 0 0 0 (1:.7 2:.8)\nFrames 2\nTrace",
        expect![[r#"
        warning: a very narrow field of view: the angle is in degrees
         --> a.txt:2:18
          |
        2 | Look 0 0 5 0 0 0 (1:.7 2:.8)
          |                  ^^^^^^^^^^^ expected an angle such as 40
          |
          = help: if 0.8 is in radians, it is 45.8366 degrees"#]],
    );
    check("Screen 4 3\nLook 0 0 5 0 0 0 (1:40 9:1)\nFrames 9\nTrace", expect![[""]]);
}

#[test]
fn colours_as_levels() {
    check(
        ball("Background 255 128 0\n", ""),
        expect![[r#"
        warning: this is far above 1, which is full brightness
         --> a.txt:3:12
          |
        3 | Background 255 128 0
          |            ^^^^^^^^^ expected numbers from 0 to 1
          |
          = help: levels from 0 to 255 are divided by 255: `1 0.502 0`"#]],
    );
    check(
        ball("", "Sphere 1 0 0 -5 0 0 0 200 20 2\n"),
        expect![[r#"
        warning: this is far above 1, which is full brightness
         --> a.txt:5:23
          |
        5 | Sphere 1 0 0 -5 0 0 0 200 20 2
          |                       ^^^^^^^^ expected numbers from 0 to 1
          |
          = help: levels from 0 to 255 are divided by 255: `0.784 0.078 0.008`"#]],
    );
    check(
        ball("", "Sphere (1:1 2:2) 0 0 -5 0 0 0 (1:0 2:255) 20 2\n"),
        expect![[r#"
            warning: this changes from frame to frame, but there is one frame only
             --> a.txt:5:8
              |
            5 | Sphere (1:1 2:2) 0 0 -5 0 0 0 (1:0 2:255) 20 2
              |        ^^^^^^^^^ expected `Frames` before the `Trace`
              |
              = help: write for example `Frames 1 50`

            warning: this is far above 1, which is full brightness
             --> a.txt:5:31
              |
            5 | Sphere (1:1 2:2) 0 0 -5 0 0 0 (1:0 2:255) 20 2
              |                               ^^^^^^^^^^^^^^^^ expected numbers from 0 to 1"#]],
    );
    check(
        ball("Material m diffuse 255 0 300 shine 1 1 1 200\n", "Sphere 1 0 0 -5 m\n"),
        expect![[r#"
        warning: this is far above 1, which is full brightness
         --> a.txt:3:20
          |
        3 | Material m diffuse 255 0 300 shine 1 1 1 200
          |                    ^^^^^^^^^ expected numbers from 0 to 1"#]],
    );
    check(ball("", "Ilight 20 20 20 0 -1 0\n"), expect![[""]]);
    check(
        ball("", "Ilight 255 255 255 0 -1 0\n"),
        expect![[r#"
        warning: this is far above 1, which is full brightness
         --> a.txt:5:8
          |
        5 | Ilight 255 255 255 0 -1 0
          |        ^^^^^^^^^^^ expected numbers from 0 to 1
          |
          = help: levels from 0 to 255 are divided by 255: `1 1 1`"#]],
    );
    check(ball("", "Plight 200 200 200 0 5 0 0 .1\n"), expect![[""]]);
}

#[test]
fn comments_glued_to_words() {
    check(
        "Screen 4 3# small\nTrace",
        expect![[r#"
        warning: `#` begins a comment: nothing from here on counts
         --> a.txt:1:11
          |
        1 | Screen 4 3# small
          |           ^ expected a blank before the comment"#]],
    );
    check("Screen 4 3 #small\n#Sphere 1\n #ff0000\nTrace #add", expect![""]);
    check(
        "Screen 4 3\nBackground 0 0 0 #ff8000\nTrace",
        expect![[r#"
            warning: `#` begins a comment: nothing from here on counts
             --> a.txt:2:18
              |
            2 | Background 0 0 0 #ff8000
              |                  ^^^^^^^ expected a colour only where one is needed, or right behind another as `#rrggbb`
              |
              = help: this colour is `#ff8000`, or `1 0.502 0` as numbers"#]],
    );
    check("Screen 4 3\nBackground #ff8000\nTrace", expect![""]);
    check(
        "Screen 4 3\nMaterial m diffuse #f80\nTrace",
        expect![[r#"
            error: `diffuse` takes 3 numbers, found none
             --> a.txt:2:19
              |
            2 | Material m diffuse #f80
              |                   ^ expected `rr` here
              |
              = help: `#` begins a comment; this colour is `#ff8800`, or `1 0.533 0` as numbers"#]],
    );
}

#[test]
fn a_size_that_shrinks_to_nothing() {
    check(
        "Screen 4 3\nSphere 0 0 0 -5 1 0 0 0 0 0\nTrace",
        expect![[r#"
            warning: nothing is drawn: the radius is 0
             --> a.txt:2:8
              |
            2 | Sphere 0 0 0 -5 1 0 0 0 0 0
              |        ^ expected a number greater than 0, or a curve that is not always 0"#]],
    );
    check("Screen 4 3\nDisc (1:1 9:0) 0 0 0 0 0 1 1 0 0 0 0 0\nFrames 9\nTrace", expect![""]);
    check(
        "Screen 4 3\nSphere -1 0 0 -5 1 0 0 0 0 0\nTrace",
        expect![[r#"
            error: the radius must not be negative
             --> a.txt:2:8
              |
            2 | Sphere -1 0 0 -5 1 0 0 0 0 0
              |        ^^ expected a number from 0"#]],
    );
    check(
        "Screen 4 3\nGroup g\nSphere 1 0 0 -5 1 0 0 0 0 0\nEnd\nUse g 0 0 0 0 0 0 (1:1 9:0)\nFrames 9\nTrace",
        expect![[""]],
    );
}

#[test]
fn files_that_are_no_text() {
    check(
        "GIF89a\u{1}\0\u{1}\0\n\n\n",
        expect![[r#"
        error: this is a GIF image, not a scene script
         --> a.txt:1:1
          |
        1 |
          | ^ expected a text file with commands such as `Screen 640 480`"#]],
    );
    check(
        "Screen 4 3\nTrace\n\0",
        expect![[r#"
        error: this is a binary file, not a scene script
         --> a.txt:1:1
          |
        1 |
          | ^ expected a text file with commands such as `Screen 640 480`"#]],
    );
    check(
        "S\0c\0r\0e\0e\0n\0",
        expect![[r#"
        error: the script is UTF-16 text
         --> a.txt:1:1
          |
        1 |
          | ^ expected UTF-8
          |
          = help: save the script as UTF-8"#]],
    );
}

#[test]
fn of_another_language_ten_errors_are_described() {
    let other: String = (0..1_000).map(|i| format!("p {i} 0 0\n")).collect();
    let described = |text: &str| {
        let parsed = parse("a.txt", text.as_bytes(), &Limits::default());
        assert!(parsed.script.is_none());
        parsed.diagnostics.iter().map(|d| d.message.clone()).collect::<Vec<_>>()
    };
    let messages = described(&other);
    assert_eq!(messages.len(), 11);
    assert_eq!(messages[10], "991 more errors from here on");
    // In a script, every error is described.
    let script = format!("Screen 4 3\n{}{}Trace", BALL.repeat(10), "Sphere\n".repeat(15));
    assert_eq!(described(&script).len(), 15);
}

#[test]
fn a_curve_without_frames_is_a_warning() {
    let warnings = |frames: &str, curve: &str| {
        let text = format!("Screen 4 3\n{frames}Sphere 1 {curve} 0 -5  1 0 0  0 0 0\nTrace\n");
        let parsed = parse("a.txt", text.as_bytes(), &Limits::default());
        parsed
            .diagnostics
            .iter()
            .map(|d| format!("{}:{} {}", d.line, d.column, d.message))
            .collect::<Vec<_>>()
    };
    let warning = ["3:10 this changes from frame to frame, but there is one frame only"];
    assert_eq!(warnings("\n", "(1:0 9:3)"), warning);
    assert!(warnings("\n", "(1:2 9:2)").is_empty(), "it does not change");
    for frames in ["Frames 1 9\n", "Frames 3\n", "Samples 4\nShutter .5\n"] {
        assert!(warnings(frames, "(1:0 9:3)").is_empty(), "{frames}");
    }
}

#[test]
fn names_may_be_used_in_faulty_lines() {
    for line in
        ["Text \"Logo\" .5 -.1 red", "Sphere 1 0 0 (1:0 red", "Text \"Logo\" .5 .1 red font \"none.ttf\""]
    {
        let text = format!("Screen 4 3\nMaterial red diffuse .8 .2 .1\n{line}\nTrace\n");
        let parsed = parse("a.txt", text.as_bytes(), &Limits::default());
        assert!(parsed.diagnostics.iter().all(|d| d.is_error()), "{:?}", parsed.diagnostics);
    }
}

#[test]
fn models_and_data_are_no_scripts() {
    for (text, what) in [
        (
            "# made by a modeller\nmtllib a.mtl\nv 0 0 0\n",
            "this is an OBJ model, not a scene script: `Mesh \"FILE\"` in a script draws it",
        ),
        ("{\"fps\": 25}", "this is JSON, not a scene script"),
    ] {
        let parsed = parse("a.txt", text.as_bytes(), &Limits::default());
        let [diagnostic] = &parsed.diagnostics[..] else { panic!("{:?}", parsed.diagnostics) };
        assert_eq!(diagnostic.message, what);
    }
}
