//! The diagnostics of curves, frames and settings with faults, word for word.
//!
//! After a deliberate change, `UPDATE_EXPECT=1 cargo test -p rayfold-scene` renews the expected texts.

use expect_test::expect;
use rayfold_scene::Limits;

use super::diagnostic_text::{check, check_limited};

#[test]
fn a_radius_that_is_negative_at_a_frame() {
    check(
        "Screen 4 3\nSphere (1:1 17:-.2 20:1) 0 0 -5 1 0 0 0 0 0\nFrames 50\nTrace",
        expect![[r#"
            error: the radius is -0.2 at frame 17
             --> a.txt:2:8
              |
            2 | Sphere (1:1 17:-.2 20:1) 0 0 -5 1 0 0 0 0 0
              |        ^^^^^^^^^^^^^^^^^ expected a number from 0 from frame 1 to 50"#]],
    );
}

#[test]
fn a_radius_that_is_zero_between_frames_while_the_shutter_is_open() {
    check(
        "Screen 4 3\nShutter .5\nSphere (smooth 1:1 2.25:0 2.3:1) 0 0 -5 1 0 0 0 0 0\nFrames 2\nTrace",
        expect![[r#"
            warning: the shutter has no effect: there is one ray per pixel
             --> a.txt:2:1
              |
            2 | Shutter .5
              | ^^^^^^^ expected `Samples` before the `Trace`
              |
              = help: write for example `Samples 64`"#]],
    );
}

#[test]
fn a_radius_that_overshoots_below_zero_between_its_keys() {
    check(
        "Screen 4 3\nSphere (elastic 1:1 11:.1) 0 0 -5 1 0 0 0 0 0\nSphere (bounce 1:1 11:.1) 0 0 -5 1 0 0 0 0 0\nSphere (bezier .2 .2 1.2 1 1:1 2:2) 0 0 -5 1 0 0 0 0 0\nSphere (bezier .2 .2 1:1 2:2) 0 0 -5 1 0 0 0 0 0\nFrames 11\nTrace",
        expect![[r#"
            error: the radius is -0.125 at frame 2
             --> a.txt:2:8
              |
            2 | Sphere (elastic 1:1 11:.1) 0 0 -5 1 0 0 0 0 0
              |        ^^^^^^^^^^^^^^^^^^^ expected a number from 0 from frame 1 to 11

            error: `c` of `bezier` must not be 1.2
             --> a.txt:4:22
              |
            4 | Sphere (bezier .2 .2 1.2 1 1:1 2:2) 0 0 -5 1 0 0 0 0 0
              |                      ^^^ expected `c`, 0 to 1: the time of a control point

            error: `bezier` lacks its four numbers
             --> a.txt:5:9
              |
            5 | Sphere (bezier .2 .2 1:1 2:2) 0 0 -5 1 0 0 0 0 0
              |         ^^^^^^ expected four numbers after this, then the keys
              |
              = help: as CSS's cubic-bezier: `(bezier .25 .1 .25 1  1:0 25:3)`"#]],
    );
}

#[test]
fn a_cycle_that_comes_near_its_last_key() {
    check(
        "Screen 4 3\nSphere (cycle 0:1 10:-1) 0 0 -5 1 0 0 0 0 0\nFrames 20\nTrace",
        expect![[r#"
            error: the radius is -0.8 at frame 9
             --> a.txt:2:8
              |
            2 | Sphere (cycle 0:1 10:-1) 0 0 -5 1 0 0 0 0 0
              |        ^^^^^^^^^^^^^^^^^ expected a number from 0 from frame 1 to 20"#]],
    );
}

#[test]
fn a_curve_is_in_order_where_it_is_not_seen() {
    check("Screen 4 3\nSphere (1:1 10:1 11:-1) 0 0 -5 1 0 0 0 0 0\nFrames 10\nTrace", expect![[""]]);
}

#[test]
fn a_curve_of_one_key_is_a_number() {
    check(
        "Screen 4 3\nSphere (1:-1) 0 0 -5 1 0 0 0 0 0\nTrace",
        expect![[r#"
            error: the radius must not be negative
             --> a.txt:2:8
              |
            2 | Sphere (1:-1) 0 0 -5 1 0 0 0 0 0
              |        ^^^^^^ expected a number from 0"#]],
    );
}

#[test]
fn gaze_and_view_up_that_meet_at_a_frame() {
    check(
        "Screen 4 3\nCamera 0 0 5 0 (1:0 9:1) (1:-1 9:0) 0 1 0 1 -2 -1.5 2 1.5\nFrames 9\nTrace",
        expect![[r#"
            error: the gaze and the view-up must not be parallel, which fails at frame 9
             --> a.txt:2:14
              |
            2 | Camera 0 0 5 0 (1:0 9:1) (1:-1 9:0) 0 1 0 1 -2 -1.5 2 1.5
              |              ^^^^^^^^^^^^^^^^^^^^^^^^^^^^ expected two directions that span a plane at frame 9"#]],
    );
}

#[test]
fn an_eye_that_passes_over_the_target() {
    let look = "Look (1:-1 3:1) 5 (1:3e-16 3:-3e-16)  0 0 0  40";
    let read = |line: &str| {
        let script = format!("Screen 4 3\nFrames 3\n{line}\nTrace");
        rayfold_scene::parse("a.txt", script.as_bytes(), &rayfold_scene::Limits::default()).script
    };
    let script = read(look).expect("a script");
    let camera = |frame: usize| script.frame(frame).expect("a frame").camera;
    let rayfold_scene::Camera::Look(middle) = camera(1) else { panic!("a look") };
    let (right, up, _) = middle.basis();
    assert_eq!((right.to_array(), up.to_array()), ([1.0, 0.0, 0.0], [0.0, 0.0, -1.0]));
    // Before and after it, y is up, as elsewhere on the way.
    for (frame, side) in [(0, 1.0), (2, -1.0)] {
        let rayfold_scene::Camera::Look(look) = camera(frame) else { panic!("a look") };
        assert!((look.basis().1.x - side).abs() < 0.1, "{frame}");
    }
    assert!(read(&format!("{look} 0 1 0")).is_none());
}

#[test]
fn a_target_that_the_eye_passes() {
    check(
        "Screen 4 3\nLook 0 0 (1:0 11:10) 0 0 4 40\nFrames 11\nTrace",
        expect![[r#"
            error: the eye and the target must differ, which fails at frame 5
             --> a.txt:2:22
              |
            2 | Look 0 0 (1:0 11:10) 0 0 4 40
              |                      ^^^^^ expected a target apart from the eye at frame 5"#]],
    );
}

#[test]
fn a_ring_that_grows_too_thick() {
    check(
        "Screen 4 3\nTorus (1:2 101:1) (1:.5 101:1.2) 0 0 -5 0 1 0 1 0 0 0 0 0\nFrames 101\nTrace",
        expect![[r#"
            error: the thickness r must be less than the radius R, which fails at frame 90
             --> a.txt:2:19
              |
            2 | Torus (1:2 101:1) (1:.5 101:1.2) 0 0 -5 0 1 0 1 0 0 0 0 0
              |                   ^^^^^^^^^^^^^^ expected `r` to be less than `R` at frame 90"#]],
    );
}

#[test]
fn a_window_that_vanishes() {
    check(
        "Screen 4 3\nCamera 0 0 5 0 0 -1 0 1 0 1 (1:-2 3:2) -1.5 2 1.5\nFrames 3\nTrace",
        expect![[r#"
            error: the window must not be empty: au equals bu, which fails at frame 3
             --> a.txt:2:29
              |
            2 | Camera 0 0 5 0 0 -1 0 1 0 1 (1:-2 3:2) -1.5 2 1.5
              |                             ^^^^^^^^^^^^^^^^^ expected `au` and `bu` to differ at frame 3"#]],
    );
}

#[test]
fn a_triangle_that_is_flat_for_a_moment_is_in_order() {
    check("Screen 4 3\nTriangle 0 0 0 1 0 0 0 (1:-1 3:1) 0 1 1 1 0 0 0\nFrames 3\nTrace", expect![[""]]);
}

#[test]
fn brackets() {
    check(
        "Screen 4 3\nSphere (1:0 25:3 0 0 -5 1 0 0 0 0 0\nSphere 1) 0 0 -5 1 0 0 0 0 0\nSphere () 0 0 -5 1 0 0 0 0 0\nSphere (1:1 (2:2)) 0 0 -5 1 0 0 0 0\nSphere 1:1 0 0 -5 1 0 0 0\nTrace",
        expect![[r#"
            error: the curve is not closed
             --> a.txt:2:8
              |
            2 | Sphere (1:0 25:3 0 0 -5 1 0 0 0 0 0
              |        ^ expected a `)` after this, on the same line

            error: `)` is not a number
             --> a.txt:3:9
              |
            3 | Sphere 1) 0 0 -5 1 0 0 0 0 0
              |         ^ expected `cx`, a number such as 2, -.5 or 1e-3
              |
              = help: `)` is allowed only in a curve, as in `(1:0 25:3)`

            error: the curve has no key
             --> a.txt:4:8
              |
            4 | Sphere () 0 0 -5 1 0 0 0 0 0
              |        ^^ expected frames and values of `R`, such as `1:0 25:3`

            error: unexpected `(` in a curve
             --> a.txt:5:13
              |
            5 | Sphere (1:1 (2:2)) 0 0 -5 1 0 0 0 0
              |             ^ expected a key such as `25:3`, or `)`

            error: `)` is not a number
             --> a.txt:5:18
              |
            5 | Sphere (1:1 (2:2)) 0 0 -5 1 0 0 0 0
              |                  ^ expected `cx`, a number such as 2, -.5 or 1e-3
              |
              = help: `)` is allowed only in a curve, as in `(1:0 25:3)`

            error: `:` is not a number
             --> a.txt:6:9
              |
            6 | Sphere 1:1 0 0 -5 1 0 0 0
              |         ^ expected `cx`, a number such as 2, -.5 or 1e-3
              |
              = help: `:` is allowed only in a curve, as in `(1:0 25:3)`"#]],
    );
}

#[test]
fn modes() {
    check(
        "Screen 4 3\nSphere (smoth 1:1 2:2) 0 0 -5 1 0 0 0 0 0\nSphere (wild 1:1 2:2) 0 0 -5 1 0 0 0 0 0\nSphere (smooth step 1:1 2:2) 0 0 -5 1 0 0 0 0 0\nSphere (1:1 cycle 2:2) 0 0 -5 1 0 0 0 0 0\nSphere (cycle 1:1) 0 0 -5 1 0 0 0 0 0\nTrace",
        expect![[r#"
            error: unknown curve mode `smoth`
             --> a.txt:2:9
              |
            2 | Sphere (smoth 1:1 2:2) 0 0 -5 1 0 0 0 0 0
              |         ^^^^^ expected a mode, or a key such as `25:3`
              |
              = help: did you mean `smooth`?

            error: unknown curve mode `wild`
             --> a.txt:3:9
              |
            3 | Sphere (wild 1:1 2:2) 0 0 -5 1 0 0 0 0 0
              |         ^^^^ expected a mode, or a key such as `25:3`
              |
              = help: the modes are `linear`, `smooth`, `step`, `in`, `out`, `inout`, `back`, `elastic`, `bounce`, `bezier`, `cycle`

            error: `step` must come before the keys, and only once
             --> a.txt:4:16
              |
            4 | Sphere (smooth step 1:1 2:2) 0 0 -5 1 0 0 0 0 0
              |                ^^^^ expected a key such as `25:3`
              |
              = help: a curve starts with at most one of `linear`, `smooth`, `step`, `in`, `out`, `inout`, `back`, `elastic`, `bounce`, `bezier`, and `cycle`

            error: `cycle` must come before the keys, and only once
             --> a.txt:5:13
              |
            5 | Sphere (1:1 cycle 2:2) 0 0 -5 1 0 0 0 0 0
              |             ^^^^^ expected a key such as `25:3`
              |
              = help: a curve starts with at most one of `linear`, `smooth`, `step`, `in`, `out`, `inout`, `back`, `elastic`, `bounce`, `bezier`, and `cycle`

            error: a cycle of one key has no length
             --> a.txt:6:8
              |
            6 | Sphere (cycle 1:1) 0 0 -5 1 0 0 0 0 0
              |        ^^^^^^^^^^^ expected two keys at least, the last where it starts again"#]],
    );
}

#[test]
fn keys() {
    check(
        "Screen 4 3\nSphere (1:1 25:3 17:2) 0 0 -5 1 0 0 0 0 0\nSphere (1 1 2 2) 0 0 -5 1 0 0 0 0 0\nSphere (1:) 0 0 -5 1 0 0 0 0 0\nSphere (1:1e999) 0 0 -5 1 0 0 0 0 0\nSphere (.:1) 0 0 -5 1 0 0 0 0 0\nTrace",
        expect![[r#"
            error: frame 17 must be greater than frame 25
             --> a.txt:2:18
              |
            2 | Sphere (1:1 25:3 17:2) 0 0 -5 1 0 0 0 0 0
              |                  ^^ expected a frame greater than 25

            error: a key lacks its value
             --> a.txt:3:9
              |
            3 | Sphere (1 1 2 2) 0 0 -5 1 0 0 0 0 0
              |         ^ expected `:` and `R` after this frame

            error: a key lacks its value
             --> a.txt:4:9
              |
            4 | Sphere (1:) 0 0 -5 1 0 0 0 0 0
              |         ^ expected `:` and `R` after this frame

            error: `1e999` is too large
             --> a.txt:5:11
              |
            5 | Sphere (1:1e999) 0 0 -5 1 0 0 0 0 0
              |           ^^^^^ expected `R`, a number up to 1.79e308

            error: `.` is not a number
             --> a.txt:6:9
              |
            6 | Sphere (.:1) 0 0 -5 1 0 0 0 0 0
              |         ^ expected `frame`, a number such as 2, -.5 or 1e-3"#]],
    );
}

#[test]
fn a_curve_that_overflows() {
    check(
        "Screen 4 3\nSphere 1 (1:-1e308 2:1e308) 0 -5 1 0 0 0 0 0\nFrames 2\nTrace",
        expect![[r#"
            error: the curve becomes too large between frames 1 and 2
             --> a.txt:2:11
              |
            2 | Sphere 1 (1:-1e308 2:1e308) 0 -5 1 0 0 0 0 0
              |           ^^^^^^^^^^^^^^^^ expected values closer together, or keys further apart"#]],
    );
}

#[test]
fn curves_where_none_may_stand() {
    check(
        "Screen (1:4 2:5) 3\nSamples (1:4 2:5)\nDepth (1:1 2:2)\nShutter (1:0 2:1)\nFrames (1:4)\nTone (1:0)\nTrace",
        expect![[r#"
            error: `Screen` takes no curves
             --> a.txt:1:8
              |
            1 | Screen (1:4 2:5) 3
              |        ^^^^^^^^^ expected `nx`, a number

            error: `Samples` takes no curves
             --> a.txt:2:9
              |
            2 | Samples (1:4 2:5)
              |         ^^^^^^^^^ expected `n`, a number

            error: `Depth` takes no curves
             --> a.txt:3:7
              |
            3 | Depth (1:1 2:2)
              |       ^^^^^^^^^ expected `n`, a number

            error: `Shutter` takes no curves
             --> a.txt:4:9
              |
            4 | Shutter (1:0 2:1)
              |         ^^^^^^^^^ expected `f`, a number

            error: `Frames` takes no curves
             --> a.txt:5:8
              |
            5 | Frames (1:4)
              |        ^^^^^ expected `a`, a number

            error: unknown tone `(1:0)`
             --> a.txt:6:6
              |
            6 | Tone (1:0)
              |      ^^^^^ expected plain or srgb"#]],
    );
}

#[test]
fn settings_out_of_their_range() {
    check(
        "Screen 4 3\nSamples 0 -1\nShutter 1.5\nTone gamma\nTone rgb\nDepth 65\nLens -1 0\nFrames 2.5\nFrames 9 3\nFrames 0\nTrace",
        expect![[r#"
            error: `0` is not a number of rays
             --> a.txt:2:9
              |
            2 | Samples 0 -1
              |         ^ expected `n`, a whole number from 1

            error: the error e must not be negative
             --> a.txt:2:11
              |
            2 | Samples 0 -1
              |           ^^ expected a number from 0

            error: the shutter must be from 0 to 1
             --> a.txt:3:9
              |
            3 | Shutter 1.5
              |         ^^^ expected a number from 0 to 1

            error: unknown tone `gamma`
             --> a.txt:4:6
              |
            4 | Tone gamma
              |      ^^^^^ expected plain or srgb

            error: unknown tone `rgb`
             --> a.txt:5:6
              |
            5 | Tone rgb
              |      ^^^ expected plain or srgb
              |
              = help: did you mean `srgb`?

            error: `65` is not a number of bounces
             --> a.txt:6:7
              |
            6 | Depth 65
              |       ^^ expected `n`, a whole number up to 64

            error: the lens's radius must not be negative
             --> a.txt:7:6
              |
            7 | Lens -1 0
              |      ^^ expected a number from 0

            error: the lens's distance must be greater than zero
             --> a.txt:7:9
              |
            7 | Lens -1 0
              |         ^ expected a number greater than 0

            error: `2.5` is not a number of frames
             --> a.txt:8:8
              |
            8 | Frames 2.5
              |        ^^^ expected `a`, a whole number from 1

            error: the first frame must not be greater than the last
             --> a.txt:9:8
              |
            9 | Frames 9 3
              |        ^^^ expected `a` to be at most `b`

            error: `0` is not a number of frames
              --> a.txt:10:8
               |
            10 | Frames 0
               |        ^ expected `a`, a whole number from 1"#]],
    );
}

#[test]
fn part_of_what_stands_whole_or_not_at_all() {
    check(
        "Screen 4 3\nBackground 1 1 1 0 0\nLook 0 0 5 0 0 0 40 0 1\nGroup a\nSphere 1 0 0 0 1 0 0 0 0 0\nEnd\nUse a 1 2\nUse a 1 2 3 4 5\nUse a 1 2 3 4 5 6 7 8\nTrace",
        expect![[r#"
            error: `Background` takes 3 or 6 numbers, found 5
             --> a.txt:2:21
              |
            2 | Background 1 1 1 0 0
              |                     ^ expected `B` here
              |
              = help: write `Background r g b [R G B] or none`

            error: `Look` takes 7 or 10 numbers, found 9
             --> a.txt:3:24
              |
            3 | Look 0 0 5 0 0 0 40 0 1
              |                        ^ expected `upz` here
              |
              = help: write `Look ex ey ez tx ty tz fov [upx upy upz]`

            error: `Use` takes 0, 3, 6 or 7 numbers, found 2
             --> a.txt:7:10
              |
            7 | Use a 1 2
              |          ^ expected `tz` here
              |
              = help: write `Use NAME [tx ty tz [rx ry rz [s]]]`

            error: `Use` takes 0, 3, 6 or 7 numbers, found 5
             --> a.txt:8:16
              |
            8 | Use a 1 2 3 4 5
              |                ^ expected `rz` here
              |
              = help: write `Use NAME [tx ty tz [rx ry rz [s]]]`

            error: `Use` takes 0, 3, 6 or 7 numbers, found 8
             --> a.txt:9:21
              |
            9 | Use a 1 2 3 4 5 6 7 8
              |                     ^ expected the end of the line
              |
              = help: write `Use NAME [tx ty tz [rx ry rz [s]]]`"#]],
    );
}

#[test]
fn values_of_the_new_commands() {
    check(
        "Screen 4 3\nLook 0 0 5 0 0 5 180\nDisc 0 0 0 0 0 0 0 1 1 1 0 0 0\nCylinder 1 0 0 0 0 0 0 1 1 1 0 0 0\nCone 0 0 0 0 0 0 1 0 1 1 1 0 0 0\nCone -1 1 0 0 0 0 1 0 1 1 1 0 0 0\nTorus 1 1 0 0 0 0 1 0 1 1 1 0 0 0\nIlight 1 1 1 0 0 -1 180\nPlight 1 1 1 0 0 0 -1 -2\nTrace",
        expect![[r#"
            error: the eye and the target must differ
             --> a.txt:2:12
              |
            2 | Look 0 0 5 0 0 5 180
              |            ^^^^^ expected a target apart from the eye

            error: the field of view must be above 0 and below 180
             --> a.txt:2:18
              |
            2 | Look 0 0 5 0 0 5 180
              |                  ^^^ expected a number above 0 and below 180

            error: the normal must not be zero
             --> a.txt:3:14
              |
            3 | Disc 0 0 0 0 0 0 0 1 1 1 0 0 0
              |              ^^^^^ expected three numbers that are not all 0

            error: the ends of the axis must differ
             --> a.txt:4:12
              |
            4 | Cylinder 1 0 0 0 0 0 0 1 1 1 0 0 0
              |            ^^^^^^^^^^^ expected two points that differ

            warning: nothing is drawn: the radius is 0
             --> a.txt:5:6
              |
            5 | Cone 0 0 0 0 0 0 1 0 1 1 1 0 0 0
              |      ^^^ expected a number greater than 0, or a curve that is not always 0

            error: the radius Ra must not be negative
             --> a.txt:6:6
              |
            6 | Cone -1 1 0 0 0 0 1 0 1 1 1 0 0 0
              |      ^^ expected a number from 0

            error: the thickness r must be less than the radius R
             --> a.txt:7:9
              |
            7 | Torus 1 1 0 0 0 0 1 0 1 1 1 0 0 0
              |         ^ expected `r` to be less than `R`

            error: the sun's angle must be from 0 to below 180
             --> a.txt:8:21
              |
            8 | Ilight 1 1 1 0 0 -1 180
              |                     ^^^ expected a number from 0 to below 180

            error: the lamp's radius must not be negative
             --> a.txt:9:20
              |
            9 | Plight 1 1 1 0 0 0 -1 -2
              |                    ^^ expected a number from 0"#]],
    );
}

#[test]
fn a_squashed_picture() {
    check(
        "Screen 640 480\nCamera 0 0 5 0 0 -1 0 1 0 1 -1 -1 1 1\nTrace\nTrace\nCamera 0 0 5 0 0 -1 0 1 0 1 -.4 -.3 .4 .3\nTrace",
        expect![[r#"
            warning: the pixels are not square: a sphere looks like an ellipse
             --> a.txt:2:29
              |
            2 | Camera 0 0 5 0 0 -1 0 1 0 1 -1 -1 1 1
              |                             ^^^^^^^^^ expected a window of the shape 640 : 480
              |
              = help: write for example `-1.33333 -1 1.33333 1`"#]],
    );
}

#[test]
fn a_lens_without_effect() {
    check(
        "Screen 4 3\nLens .5\nTrace\nTrace",
        expect![[r#"
            warning: the lens has no effect with `Orthocamera`
             --> a.txt:2:1
              |
            2 | Lens .5
              | ^^^^ expected a `Look` or `Camera` beside this"#]],
    );
}

#[test]
fn more_frames_than_the_limit() {
    let limits = Limits { max_frames: Some(10), ..Limits::default() };
    check_limited(
        "Screen 4 3\nFrames 8\nTrace\nFrames 3 5\nTrace\nTrace",
        limits,
        expect![[r#"
        error: more than 10 frames
         --> a.txt:5:1
          |
        5 | Trace
          | ^^^^^ expected at most 10, this is one more"#]],
    );
    check(
        "Screen 4 3\nFrames 4000000000\nTrace\nFrames 1\nTrace",
        expect![[r#"
        error: more than 1,000,000 frames
         --> a.txt:3:1
          |
        3 | Trace
          | ^^^^^ expected at most 1,000,000, with this there are 4,000,000,000"#]],
    );
}

#[test]
fn more_frames_than_can_be_looked_at() {
    let limits = Limits { max_frames: Some(usize::MAX), ..Limits::default() };
    // The radii nearly meet at every frame.
    check_limited(
        "Screen 4 3\nTorus (cycle 0:1 .1:2 .3:1) (cycle 0:.9999999999999 .1:1.9999999999999 .3:.9999999999999) 0 0 -5 0 1 0 1 \
         0 0 0 0 0\nFrames 4000000000\nTrace",
        limits,
        expect![[r#"
            error: too many frames to check this line in every frame
             --> a.txt:2:7
              |
            2 | Torus (cycle 0:1 .1:2 .3:1) (cycle 0:.9999999999999 .1:1.9999999999999 .3:.9999999999999) 0 0 -5 0 1 0 1 0…
              |       ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^ expected fewer frames, or curves that stay well within the allowed range
              |
              = help: split the frames among several scripts"#]],
    );
}
