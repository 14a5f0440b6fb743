//! Tests of `rayfold check`.

use serde_json::Value;
use snapbox::str;

use crate::{BALL, Folder};

#[test]
fn nothing_wrong() {
    let folder = Folder::with("scenes/a.txt", BALL.to_owned() + "Trace");
    folder.write("scenes/b.txt", BALL);
    folder.write("scenes/animation.json", "{\"fps\": 25}");
    folder.rayfold("check scenes").assert().code(0).stdout_eq("").stderr_eq(str![[r#"
3 files, 3 frames: no errors

"#]]);
    folder.rayfold("check scenes --quiet").assert().code(0).stdout_eq("").stderr_eq("");
}

#[test]
fn a_warning_is_no_failure() {
    let folder = Folder::with("a.txt", BALL.to_owned() + "Background 1 0 0\n");
    folder.rayfold("check a.txt").assert().code(0).stderr_eq(str![[r#"
warning: this has no effect: no `Trace` follows
 --> a.txt:7:1
  |
7 | Background 1 0 0
  | ^^^^^^^^^^ expected a `Trace` after this
  |
  = help: `Trace` renders a frame of everything that stands before it

1 file, 1 frame: no errors, 1 warning

"#]]);
}

#[test]
fn several_inputs_each_with_its_faults() {
    let folder = Folder::with("one/a.txt", "Sreen 4 3\nTrace\n");
    folder.write("two/b.md", "");
    folder.write("c.txt", BALL);
    folder.rayfold("check one two c.txt nope.txt").assert().code(1).stdout_eq("").stderr_eq(str![[r#"
error: the folder two holds no scene scripts (*.txt)
error: cannot read nope.txt: No such file or directory
error: unknown command `Sreen`
 --> one/a.txt:1:1
  |
1 | Sreen 4 3
  | ^^^^^ expected a command
  |
  = help: did you mean `Screen`?

3 errors in 3 of 4 files

"#]]);
}

#[test]
fn standard_input() {
    let folder = Folder::new();
    folder.rayfold("check -").stdin(BALL).assert().code(0);
    folder.rayfold("check -").stdin("Screen 4\nTrace").assert().code(1).stderr_eq(str![[r#"
error: `Screen` takes 2 numbers, found 1
 --> <stdin>:1:9
  |
1 | Screen 4
  |         ^ expected `ny` here
  |
  = help: write `Screen nx ny`

1 error

"#]]);
}

#[test]
fn settings() {
    let folder = Folder::with("animation.json", "{\n  \"fps\": \"fast\"\n}\n");
    folder.rayfold("check animation.json").assert().code(1).stderr_eq(str![[r#"
error: [..]
 --> animation.json:2:[..]
...
1 error

"#]]);
}

#[test]
fn json_for_editors() {
    let folder = Folder::with("a.txt", "Screen 4 3\nTrace now\n");
    let out = folder.rayfold("check a.txt nope.txt --format json").output().unwrap();
    assert_eq!(out.status.code(), Some(1));
    assert_eq!(String::from_utf8_lossy(&out.stderr), "");
    let report: Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!((&report["errors"], &report["warnings"], &report["files"]), (&2.into(), &0.into(), &2.into()));
    let fault = &report["diagnostics"][0];
    assert_eq!((&fault["file"], &fault["severity"]), (&"a.txt".into(), &"error".into()));
    assert_eq!((&fault["line"], &fault["column"]), (&2.into(), &7.into()));
    assert_eq!(fault["span"], serde_json::json!({"start": 17, "end": 20}));
    assert!(fault["message"].as_str().unwrap().contains("Trace"), "{fault}");
    assert_eq!(report["unreadable"], serde_json::json!(["cannot read nope.txt: No such file or directory"]));

    folder.write("a.txt", BALL);
    let out = folder.rayfold("check a.txt --format json").output().unwrap();
    let report: Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!((out.status.code(), &report["errors"], &report["frames"]), (Some(0), &0.into(), &1.into()));
}

#[test]
fn json_has_the_table_of_the_language() {
    let folder = Folder::with("a.txt", BALL);
    let out = folder.rayfold("check a.txt --format json").output().unwrap();
    let report: Value = serde_json::from_slice(&out.stdout).unwrap();
    let language = &report["language"];
    assert_eq!(language["version"], 2);
    let commands = language["commands"].as_array().unwrap();
    let entry = |name: &str| commands.iter().find(|command| command["name"] == name).unwrap();
    let scale = &entry("Use")["parameters"][2];
    assert_eq!(
        (&scale["names"][0], &scale["range"], &scale["default"]),
        (&"s".into(), &"at least 0".into(), &"1".into())
    );
    assert_eq!(entry("Use")["subject"], serde_json::json!({"role": "refers", "of": "group"}));
    assert_eq!(entry("Sphere")["material_instead_from"], "ar");
    assert_eq!(entry("Tone")["parameters"][0]["words"], serde_json::json!(["plain", "srgb"]));
    let names = |list: &str| -> Vec<&str> {
        language[list].as_array().unwrap().iter().map(|entry| entry["name"].as_str().unwrap()).collect()
    };
    let modes = names("curve_modes");
    assert!(
        ["linear", "smooth", "step", "bounce", "bezier", "cycle"].iter().all(|mode| modes.contains(mode))
    );
    assert!(names("clauses").contains(&"checker"));
}

#[test]
fn a_script_of_very_many_frames_is_refused_at_once() {
    let folder = Folder::with("a.txt", BALL.replace("Trace", "Frames 4000000000\nTrace"));
    let out = folder.rayfold("check a.txt --format json").output().unwrap();
    let report: Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!((&report["errors"], &report["diagnostics"][0]["code"]), (&1.into(), &"limit-exceeded".into()));
}

#[test]
fn colour_only_where_it_is_wanted() {
    let folder = Folder::with("a.txt", "Trace");
    let plain = folder.rayfold("check a.txt").output().unwrap().stderr;
    assert!(!plain.contains(&b'\x1b'));
    let colored = folder.rayfold("check a.txt --color always").output().unwrap().stderr;
    assert!(colored.contains(&b'\x1b'));
}

/// Regression test: a hidden copy counted as a frame, a file of macOS made the animation fail, and upper case in a name
/// shortened the animation silently.
#[test]
fn what_systems_leave_is_ignored_and_what_is_misnamed_is_a_warning() {
    let folder = Folder::new();
    for name in ["1.txt", ".old.txt", "3.TXT", "5.txt ", "Animation.json", "notes.md"] {
        folder.write(&format!("scenes/{name}"), BALL);
    }
    for name in
        ["._1.txt", ".#1.txt", ".ipynb_checkpoints/1.txt", "__MACOSX/._1.txt", "Thumbs.db", "9.txt/1.txt"]
    {
        folder.write(&format!("scenes/{name}"), b"\0\x05\x16\x07");
    }
    let warnings = "\
warning: scenes/3.TXT: not read: expected the ending .txt in small letters
warning: scenes/5.txt : not read: expected no blanks around the name and its ending .txt
warning: scenes/9.txt: not read: expected a script, found a folder
warning: scenes/Animation.json: not read: expected animation.json, in small letters and without blanks
";
    let said = warnings.to_owned() + "1 file, 1 frame: no errors, 4 warnings\n";
    folder.rayfold("check scenes").assert().code(0).stderr_eq(said);
    let out = folder.rayfold("check scenes --format json").output().unwrap();
    let report: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!((&report["frames"], &report["warnings"]), (&1.into(), &4.into()));
    assert_eq!(report["conflicts"][0]["input"], "scenes/3.TXT");
    let out = folder.rayfold("render scenes -o a.gif").output().unwrap();
    assert_eq!(out.status.code(), Some(0));
    assert!(String::from_utf8(out.stderr).unwrap().starts_with(warnings));
    // `split` classifies the files of its output folder in the same way.
    folder.write("parts/.old.txt", "");
    folder.write("parts/3.TXT", "");
    folder.rayfold("split scenes/1.txt parts").assert().code(0);
    folder.write("near/3.TXT", BALL);
    folder.rayfold("check near").assert().code(1).stderr_eq(str![[r#"
error: the folder near holds no scene scripts (*.txt); near/3.TXT: not read: expected the ending .txt in small letters
1 error

"#]]);
}

#[test]
fn standard_input_is_read_once() {
    for args in ["check - -", "render - - -o a.gif"] {
        Folder::new().rayfold(args).stdin(BALL).assert().code(2).stderr_eq(str![[r#"
error: standard input (-) can be read only once

"#]]);
    }
}
