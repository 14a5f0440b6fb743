//! Defects that a new user found.

use serde_json::Value;
use snapbox::str;

use crate::{BALL, Folder, ball_at, decode_gif};

fn balls(count: usize) -> Folder {
    let folder = Folder::new();
    for step in 1..=count {
        folder.write(&format!("balls/f{step}.txt"), ball_at(step));
    }
    folder
}

/// Returns the messages of a run, which must end with `code`.
fn said(folder: &Folder, args: &str, code: i32) -> String {
    let output = folder.rayfold(args).assert().code(code).get_output().stderr.clone();
    String::from_utf8(output).unwrap()
}

#[test]
fn check_passed_fewer_frames_than_the_settings_say() {
    let folder = balls(1);
    folder.write("balls/animation.json", "{\"frames\": 50}");
    folder.rayfold("check balls").assert().code(1).stdout_eq("").stderr_eq(str![[r#"
error: balls: animation.json says 50 frames, but the scripts give 1
1 error

"#]]);
    folder.rayfold("render balls -o a.gif").assert().code(1);
}

#[test]
fn check_passed_frames_of_unlike_size() {
    let folder = balls(1);
    folder.write("balls/f2.txt", BALL.replace("24, 16", "12, 8"));
    folder.rayfold("check balls").assert().code(1).stderr_eq(str![[r#"
error: balls: an animation has one size, but frame 1 (balls/f1.txt) is 24 x 16 and frame 2 (balls/f2.txt) is 12 x 8
1 error

"#]]);
    let report = folder.rayfold("check balls --format json").assert().code(1).get_output().stdout.clone();
    let report: Value = serde_json::from_slice(&report).unwrap();
    assert_eq!((&report["errors"], &report["conflicts"][0]["input"]), (&1.into(), &"balls".into()));
    assert_eq!(report["conflicts"][0]["severity"], "error");
    // A single script may be meant as separate pictures.
    folder.write("pair.txt", BALL.replace("Trace", "Trace\nScreen 6 4\nTrace"));
    let output = said(&folder, "check pair.txt", 0);
    assert!(output.starts_with("warning: pair.txt: an animation has one size"), "{output}");
    assert!(output.ends_with("1 file, 2 frames: no errors, 1 warning\n"), "{output}");
    folder.rayfold("render pair.txt -o %d.png").assert().code(0);
}

#[test]
fn check_passed_a_side_that_no_gif_can_hold() {
    let folder = Folder::with("wide/a.txt", "Screen 65536 1\nTrace\n");
    for command in ["check wide", "render wide -o a.gif"] {
        let output = said(&folder, command, 1);
        assert!(
            output.contains("65535 pixels on a side at most, but frame 1 (wide/a.txt) is 65536 x 1"),
            "{output}"
        );
    }
    assert_eq!(folder.list("."), ["wide"]);
}

#[test]
fn submit_recommended_flags_that_it_lacked() {
    let folder = balls(1);
    folder.write("balls/f2.txt", BALL.replace("24, 16", "12, 8"));
    let output = said(&folder, "submit balls --bucket nowhere", 1);
    assert!(
        output.contains("is 12 x 8: give their scripts the same Screen") && !output.contains("--size"),
        "{output}"
    );
    // The recommended option exists.
    folder.write("balls/f2.txt", BALL.replace("24, 16", "8001, 8000"));
    let output = said(&folder, "submit balls --bucket nowhere", 1);
    assert!(output.contains("--max-pixels sets the limit on pixels"), "{output}");
    let output = said(&folder, "submit balls --bucket nowhere --max-pixels 100000000", 1);
    assert!(!output.contains("--max-pixels"), "{output}");
}

#[test]
fn submit_listed_endings_that_it_refused() {
    let folder = balls(1);
    folder.rayfold("submit balls --bucket nowhere -o x.mp4").assert().code(2).stderr_eq(str![[r#"
error: cannot write x.mp4: expected a name that ends in .gif, .apng, .webp or .y4m

"#]]);
    folder.rayfold("fetch film --bucket nowhere -o x.mp4").assert().code(2).stderr_eq(str![[r#"
error: cannot write x.mp4: expected .gif, .webp, .apng or .y4m, or a pattern such as frames/%04d.png (or .tif)

"#]]);
}

#[test]
fn encode_played_files_as_the_shell_sorts_them() {
    let folder = balls(11);
    folder.rayfold("render balls -o f%d.png").assert().code(0);
    folder.rayfold("render balls -o balls.gif").assert().code(0);
    let as_the_shell_does = "f1.png f10.png f11.png f2.png f3.png f4.png f5.png f6.png f7.png f8.png f9.png";
    let output = said(&folder, &format!("encode {as_the_shell_does} -o sorted.gif"), 0);
    assert!(
        output.starts_with(
            "sorted by name, from f1.png to f11.png; --no-sort keeps the order of the command line\n"
        ),
        "{output}"
    );
    assert_eq!(folder.read("sorted.gif"), folder.read("balls.gif"));
    let output = said(&folder, &format!("encode {as_the_shell_does} --no-sort -o given.gif"), 0);
    assert!(!output.contains("sorted"), "{output}");
    assert_eq!(decode_gif(&folder.read("given.gif"))[1].0, folder.image("f10.png"));
    // No message if nothing changes.
    assert!(!said(&folder, "encode f2.png f10.png -o two.gif", 0).contains("sorted"));
}

#[test]
fn the_folder_of_frames_had_to_be_there() {
    let folder = balls(2);
    folder.rayfold("render balls -o new/frames/%04d.png").assert().code(0);
    assert_eq!(folder.list("new/frames"), ["0001.png", "0002.png"]);
    // No hint for scripts that cannot be drawn.
    folder.write("balls/f3.txt", "Trce");
    folder.rayfold("render balls -o other/%d.png").assert().code(1);
    assert_eq!(folder.list("."), ["balls", "new"]);
    let output = said(&folder, "render balls -o balls/f1.txt/%d.png", 1);
    assert!(output.starts_with("error: cannot write balls/f1.txt/1.png"), "{output}");
}

#[test]
fn rendering_began_anew_after_ctrl_c() {
    let folder = balls(6);
    folder.rayfold("render balls -o f/%d.png").assert().code(0);
    let whole: Vec<_> = (1..=6).map(|n| folder.read(&format!("f/{n}.png"))).collect();
    std::fs::remove_file(folder.join("f/2.png")).unwrap();
    folder.write("f/3.png", &whole[2][..whole[2].len() / 2]);
    folder.rayfold("render balls/f4.txt -o f/4.png --size 6x4").assert().code(0);
    folder.write("f/5.png", "no image");
    // A complete picture stays, whatever its content.
    folder.write("f/6.png", &whole[0]);
    let output = said(&folder, "render balls -o f/%d.png --skip-existing", 0);
    assert!(output.starts_with("f/1.png to f/6.png: 6 frames (2 were there), "), "{output}");
    for (number, file) in (1..=5).zip(&whole) {
        assert!(folder.read(&format!("f/{number}.png")) == *file, "frame {number}");
    }
    assert!(folder.read("f/6.png") == whole[0]);
    let output = said(&folder, "render balls -o a.gif --skip-existing", 2);
    assert!(output.contains("expected a pattern such as frames/%04d.png"), "{output}");
}

#[test]
fn an_animation_could_not_be_played_once_nor_hold_its_last_frame() {
    let folder = balls(3);
    let repeats = |name: &str| folder.read(name).windows(11).any(|word| word == b"NETSCAPE2.0");
    let delays = |name: &str| decode_gif(&folder.read(name)).iter().map(|f| f.1).collect::<Vec<_>>();
    folder.write("balls/animation.json", "{\"loop\": 7}");
    folder.rayfold("render balls -o f%d.png").assert().code(0);
    for (command, name) in [("render balls", "render"), ("encode f1.png f2.png f3.png", "encode")] {
        folder.rayfold(&format!("{command} -o {name}.gif")).assert().code(0);
        assert!(repeats(&format!("{name}.gif")));
        folder.rayfold(&format!("{command} -o {name}.gif --once --final-delay 1.5")).assert().code(0);
        assert!(!repeats(&format!("{name}.gif")));
        assert_eq!(delays(&format!("{name}.gif")), [10, 10, 150]);
        folder.rayfold(&format!("{command} -o x.gif --once --loop 2")).assert().code(2);
        let output = said(&folder, &format!("{command} -o x.gif --final-delay 0"), 2);
        assert!(output.contains("expected seconds from 0.02 to 655.35, such as 1.5"), "{output}");
    }
}

#[test]
fn wrong_values_were_answered_in_the_words_of_rust() {
    let folder = balls(1);
    for (flags, expected) in [
        ("--threads 0", "expected a whole number, 1 or more"),
        ("--threads x", "expected a whole number, 1 or more"),
        ("--fps 15.5.5", "expected a number, such as 25 or 12.5, or a fraction, such as 30000/1001"),
        ("--loop -1", "expected a whole number from 0, which is for ever, to 65535"),
        ("--max-pixels many", "expected a whole number, 1 or more"),
        ("--precision f16", "[possible values: auto, f32, f64]"),
        ("--color pink", "[possible values: auto, always, never]"),
    ] {
        let output = said(&folder, &format!("render balls -o a.gif {flags}"), 2);
        assert!(output.contains(expected), "{flags}: {output}");
        assert!(
            !output.contains("digit") && !output.contains("float") && !output.contains("non-zero"),
            "{output}"
        );
    }
    let help = folder.rayfold("render --help").assert().code(0).get_output().stdout.clone();
    let help = String::from_utf8(help).unwrap();
    assert!(help.contains("auto, f32, f64") && help.contains("auto, always, never"), "{help}");
}

#[test]
fn a_missing_region_was_called_a_refusal_of_the_store() {
    let folder = balls(1);
    let mut command = folder.rayfold("status --bucket some-bucket");
    for name in ["AWS_REGION", "AWS_DEFAULT_REGION", "AWS_PROFILE", "AWS_ENDPOINT_URL"] {
        command = command.env_remove(name);
    }
    let none = folder.join("none").display().to_string();
    command
        .env("AWS_CONFIG_FILE", &none)
        .env("AWS_SHARED_CREDENTIALS_FILE", &none)
        .env("AWS_EC2_METADATA_DISABLED", "true")
        .assert()
        .code(1)
        .stderr_eq(str![[r#"
error: found no AWS region: set AWS_REGION, or a region in the AWS profile

"#]]);
}

#[test]
fn cost_needed_a_duration_that_a_newcomer_does_not_have() {
    let folder = balls(12);
    let output = said(&folder, "cost balls", 0);
    assert!(output.starts_with("drawn here on one thread: 6 frames of 12, "), "{output}");
    let report = |flags: &str| -> Value {
        let out = folder.rayfold(&format!("cost balls --format json {flags}")).assert().code(0);
        serde_json::from_slice(&out.get_output().stdout).unwrap()
    };
    let work = &report("")["workload"];
    assert_eq!((&work["frames"], &work["width"], &work["height"]), (&12.into(), &24.into(), &16.into()));
    // Requests and pauses alone are 240 ms; drawing 24 x 16 pixels takes almost no time.
    let ms = work["ms"].as_f64().unwrap();
    assert!((240.0..1_000.0).contains(&ms), "{ms}");
    assert!(work["frame_kb"].as_f64().unwrap() < 1.0);
    assert_eq!(report("--ms 123")["workload"]["ms"], 123.0);
    folder.write("balls/f3.txt", "Trce");
    assert!(said(&folder, "cost balls", 1).ends_with("nothing was measured: 1 error in 1 of 12 files\n"));
}

#[test]
fn cost_showed_no_total_but_rows_of_nothing() {
    let folder = Folder::new();
    let out = folder.rayfold("cost --frames 50 --ms 250").assert().code(0).get_output().stdout.clone();
    let text = String::from_utf8(out).unwrap();
    assert!(!text.contains(" 0.0000"), "{text}");
    let number = |line: &str| line.split_whitespace().last().unwrap().parse::<f64>().unwrap();
    let of = |start: &str| {
        text.lines().filter(|l| l.trim_start().starts_with(start)).map(number).collect::<Vec<_>>()
    };
    let (together, first, later) = (of("Together"), of("The first month"), of("Each month after"));
    assert_eq!(together.len(), 3);
    assert!((together.iter().sum::<f64>() - first[0]).abs() < 2e-4, "{text}");
    assert!((together[1] + together[2] - later[0]).abs() < 2e-4, "{text}");
}

#[test]
fn cost_did_not_say_that_an_assembly_would_not_fit() {
    let folder = Folder::new();
    let output = said(&folder, "cost --frames 2000000 --ms 400 --size 1920x1080", 0);
    let expected = "warning: assembling takes about 124,417 s, and what takes more than 81,000 s is refused";
    assert!(output.starts_with(expected), "{output}");
    assert_eq!(said(&folder, "cost --frames 1000000 --ms 400 --size 1920x1080", 0), "");
}

#[test]
fn another_size_squashed_the_picture_without_a_word() {
    let folder = Folder::new();
    folder.write("a.txt", "Screen 40 30\nCamera 0 0 5 0 0 -1 0 1 0 1 -.4 -.3 .4 .3\nTrace");
    let output = said(&folder, "render a.txt -o a.png --size 90x30", 0);
    let expected = "warning: a.txt: at 90 x 30 the picture is squashed: a ball is no circle in it; the window that would \
                    not: -0.9000 -0.3000 0.9000 0.3000";
    assert!(output.contains(expected), "{output}");
    assert!(!said(&folder, "render a.txt -o a.png --size 80x60", 0).contains("squashed"));
}
