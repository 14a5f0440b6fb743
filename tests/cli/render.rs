//! `rayfold render` to an animation.

use snapbox::str;

use crate::{BALL, Folder, ball_at, decode_gif};

fn balls(count: usize) -> Folder {
    let folder = Folder::new();
    for step in 1..=count {
        folder.write(&format!("balls/f{step}.txt"), ball_at(step));
    }
    folder
}

#[test]
fn a_folder_is_an_animation_in_natural_order() {
    let folder = balls(12);
    folder.rayfold("render balls -o balls.gif").assert().code(0).stdout_eq("").stderr_eq(str![[r#"
balls.gif: 12 frames of 24 x 16, [..]B, in [..] s

"#]]);
    let frames = decode_gif(&folder.read("balls.gif"));
    assert_eq!(frames.len(), 12);
    for (step, (shown, delay)) in (1..).zip(&frames) {
        folder.rayfold(&format!("render balls/f{step}.txt -o f.png")).assert().code(0);
        assert_eq!(*shown, folder.image("f.png"), "frame {step}, of less than 256 colours");
        assert_eq!(*delay, 10);
    }
}

#[test]
fn scripts_come_in_the_given_order_and_share_nothing() {
    let folder = balls(2);
    folder.write("bare.txt", "Screen 24 16\nTrace");
    folder.rayfold("render balls/f2.txt bare.txt balls/f1.txt -o out.gif").assert().code(0);
    let frames = decode_gif(&folder.read("out.gif"));
    assert!(frames[1].0.pixels().all(|p| p.0 == [0, 0, 0]), "the second script sees nothing of the first");
    folder.rayfold("render balls/f1.txt -o f1.png").assert().code(0);
    assert_eq!(frames[2].0, folder.image("f1.png"));
}

#[test]
fn standard_input_is_a_script() {
    let folder = Folder::new();
    folder.rayfold("render - -o a.png").stdin(BALL).assert().code(0);
    folder.write("a.txt", BALL);
    folder.rayfold("render a.txt -o b.png").assert().code(0);
    assert_eq!(folder.read("a.png"), folder.read("b.png"));
    folder.rayfold("render - -o c.png").stdin("Trace").assert().code(1).stderr_eq(str![[r#"
error: the size of the image is not known
 --> <stdin>:1:1
  |
1 | Trace
  | ^^^^^ expected a `Screen` before this
  |
  = help: write for example `Screen 640 480`

error: nothing was written: 1 error

"#]]);
}

#[test]
fn settings_of_the_folder_hold_unless_flags_say_otherwise() {
    let folder = balls(3);
    folder.write("balls/animation.json", "{\"frames\": 3, \"fps\": 4, \"loop\": 2}");
    let delays = |name: &str| decode_gif(&folder.read(name)).iter().map(|f| f.1).collect::<Vec<_>>();
    let repeats = |name: &str| {
        let gif = folder.read(name);
        let at = gif.windows(11).position(|w| w == b"NETSCAPE2.0").unwrap() + 13;
        u16::from_le_bytes([gif[at], gif[at + 1]])
    };
    folder.rayfold("render balls -o a.gif").assert().code(0);
    assert_eq!((delays("a.gif"), repeats("a.gif")), (vec![25, 25, 25], 2));
    folder.rayfold("render balls -o b.gif --fps 30 --loop 0").assert().code(0);
    assert_eq!((delays("b.gif").iter().sum::<u16>(), repeats("b.gif")), (10, 0));
}

#[test]
fn frames_that_a_gif_has_no_time_for_are_reported() {
    balls(4).rayfold("render balls -o a.gif --fps 100").assert().code(0).stderr_eq(str![[r#"
a.gif: 2 frames of 24 x 16, [..]B, in [..] s
2 frames left out: a GIF shows at most 50 frames a second, not 100

"#]]);
}

#[test]
fn a_range_of_frames() {
    let folder = balls(5);
    folder.rayfold("render balls -o all.gif").assert().code(0);
    folder.rayfold("render balls -o some.gif --frame 2..4").assert().code(0);
    folder.rayfold("render balls -o rest.gif --frame 4..").assert().code(0);
    let shown = |name| decode_gif(&folder.read(name)).into_iter().map(|f| f.0).collect::<Vec<_>>();
    let all = shown("all.gif");
    assert_eq!(shown("some.gif"), all[1..4]);
    assert_eq!(shown("rest.gif"), all[3..]);
}

#[test]
fn the_same_bytes_on_any_number_of_threads() {
    let folder = balls(9);
    for threads in ["1", "2", "7"] {
        folder.rayfold(&format!("render balls -o {threads}.gif --threads {threads}")).assert().code(0);
        assert_eq!(folder.read("1.gif"), folder.read(&format!("{threads}.gif")));
    }
}

#[test]
fn more_frames_than_fit_ahead_come_out_in_order() {
    let script: String = (0..150).map(|step| format!("Clear\n{}", ball_at(step % 7))).collect();
    let folder = Folder::with("a.txt", script);
    folder.rayfold("render a.txt -o a.gif --threads 3").assert().code(0);
    let frames = decode_gif(&folder.read("a.gif"));
    assert_eq!(frames.len(), 150);
    for (index, (frame, _)) in frames.iter().enumerate().skip(7) {
        assert_eq!(*frame, frames[index % 7].0, "frame {index}");
    }
}

#[test]
fn quiet_says_nothing() {
    balls(2).rayfold("render balls -o a.gif --quiet").assert().code(0).stdout_eq("").stderr_eq("");
}

#[test]
fn an_existing_file_is_replaced_and_a_link_followed() {
    let folder = Folder::with("a.txt", BALL);
    folder.write("there.gif", "old");
    folder.rayfold("render a.txt -o there.gif").assert().code(0);
    assert!(folder.read("there.gif").starts_with(b"GIF89a"));
    assert_eq!(folder.list("."), ["a.txt", "there.gif"]);
}
