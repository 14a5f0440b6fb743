//! Tests of `rayfold split`.

use snapbox::str;

use crate::{BALL, Folder, ball_at};

/// Returns a script of three frames: a sphere, a second beside it, and after a Clear a third on another background.
fn flight() -> String {
    format!(
        "{BALL}Sphere 1 2 0 0 .1 .1 .1 0 .5 0\nTrace\nClear\nBackground 0 0 1\nSphere .5 0 0 0 1 1 0 0 0 0\nTrace\n"
    )
}

#[test]
fn the_parts_draw_what_the_whole_draws() {
    let folder = Folder::with("flight.txt", flight());
    folder.rayfold("split flight.txt parts").assert().code(0).stdout_eq("").stderr_eq(str![[r#"
3 scripts: parts/flight-1.txt and on

"#]]);
    assert_eq!(folder.list("parts"), ["flight-1.txt", "flight-2.txt", "flight-3.txt"]);
    folder.rayfold("render flight.txt -o whole.gif").assert().code(0);
    folder.rayfold("render parts -o parts.gif").assert().code(0);
    assert_eq!(folder.read("whole.gif"), folder.read("parts.gif"));
}

#[test]
fn many_parts_are_in_order_for_programs_too() {
    let script: String = (0..12).map(|step| format!("Clear\n{}", ball_at(step))).collect();
    let folder = Folder::new();
    folder.rayfold("split - parts").stdin(script).assert().code(0);
    let names = folder.list("parts");
    assert_eq!((names.len(), names[0].as_str(), names[11].as_str()), (12, "frame-01.txt", "frame-12.txt"));
    assert!(String::from_utf8(folder.read("parts/frame-12.txt")).unwrap().contains("Sphere"));
}

#[test]
fn again_is_fine_but_strangers_are_not() {
    let folder = Folder::with("flight.txt", flight());
    folder.rayfold("split flight.txt parts").assert().code(0);
    folder.rayfold("split flight.txt parts").assert().code(0);
    folder.write("parts/other.txt", BALL);
    folder.rayfold("split flight.txt parts").assert().code(1).stderr_eq(str![[r#"
error: parts already holds other.txt, which would be part of the same animation: expected a folder without scripts

"#]]);
}

#[test]
fn a_bad_script_writes_nothing() {
    let folder = Folder::with("a.txt", "Screen 4 3\nTrace x\n");
    folder.rayfold("split a.txt parts").assert().code(1).stderr_eq(str![[r#"
error: `Trace` takes no parameters, found 1
 --> a.txt:2:7
  |
2 | Trace x
  |       ^ expected the end of the line
  |
  = help: write `Trace`

error: nothing was written: 1 error

"#]]);
    assert_eq!(folder.list("."), ["a.txt"]);
}

/// A sphere that grows over some frames, a sphere whose material changes from frame to frame, and a second shot.
const WAVE: &str = "\
Screen 16 12
Look 0 0 9 0 (1:0 6:1) 0 40
Material skin diffuse (1:1 6:0) .2 (smooth 1:0 6:1)
Ilight 1 1 1 0 -1 -1
Sphere (smooth 1:1 6:2) 0 0 0 skin
Frames 2 6
Trace
Clear
Ilight 1 1 1 0 -1 -1
Sphere 1 (cycle 1:0 4:3) 0 0 .1 .1 .1 0 .5 0
Frames 3
Trace
";

#[test]
fn a_script_with_curves_is_split_into_its_frames() {
    let folder = Folder::with("wave.txt", WAVE);
    folder.rayfold("split wave.txt parts").assert().code(0).stderr_eq(str![[r#"
8 scripts: parts/wave-1.txt and on

"#]]);
    let part = |k: usize| String::from_utf8(folder.read(&format!("parts/wave-{k}.txt"))).unwrap();
    assert!(part(1).contains("\nFrames 2 2\n") && part(1).contains("(smooth 1:1 6:2)"), "{}", part(1));
    assert!(part(6).contains("\nFrames 1\nTrace"), "{}", part(6));
    assert!(part(7).contains("\nFrames 2 2\n") && !part(7).contains("skin"), "{}", part(7));
    folder.rayfold("check parts").assert().code(0).stderr_eq(str![[r#"
8 files, 8 frames: no errors

"#]]);
    folder.rayfold("render wave.txt -o whole.gif").assert().code(0);
    folder.rayfold("render parts -o parts.gif").assert().code(0);
    assert_eq!(folder.read("whole.gif"), folder.read("parts.gif"));
    folder.rayfold("render wave.txt --frame 3 -o third.png").assert().code(0);
    folder.rayfold("render parts/wave-3.txt -o part.png").assert().code(0);
    assert_eq!(folder.read("third.png"), folder.read("part.png"));
}
