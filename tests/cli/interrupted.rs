//! Output is complete or absent: on Ctrl-C, if the disk is full, if a file may not grow. Waiting ends with the first
//! signal.

#![cfg(unix)]

use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use crate::{BALL, Folder, RAYFOLD};

/// Longer than a loaded machine needs to start or to stop.
const PATIENCE: Duration = Duration::from_secs(60);

/// Returns a folder with a thousand frames that take minutes.
fn long() -> Folder {
    let script = BALL.replace("24, 16", "2000, 2000") + &"Trace\n".repeat(999);
    Folder::with("a.txt", script)
}

/// The running program. It ends with the test.
struct Running(Child);

impl Running {
    fn start(folder: &Folder, args: &[&str]) -> Self {
        let mut command = Command::new(RAYFOLD);
        command.args(args).stdin(Stdio::null());
        Self::of(folder, command)
    }

    fn of(folder: &Folder, mut command: Command) -> Self {
        command.current_dir(folder.path()).stdout(Stdio::null()).stderr(Stdio::null());
        Self(command.spawn().unwrap())
    }

    fn signal(&self, name: &str) {
        let id = self.0.id().to_string();
        assert!(Command::new("kill").args([name, &id]).status().unwrap().success());
    }

    fn end(&mut self) -> ExitStatus {
        let mut status = None;
        wait_until("the program ends", || {
            status = self.0.try_wait().unwrap();
            status.is_some()
        });
        status.unwrap()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn wait_until(what: &str, mut holds: impl FnMut() -> bool) {
    let start = Instant::now();
    while !holds() {
        assert!(start.elapsed() < PATIENCE, "waited in vain until {what}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn parts(folder: &Folder) -> Vec<String> {
    folder.list(".").into_iter().filter(|name| name.ends_with(".part")).collect()
}

#[test]
fn ctrl_c_leaves_no_animation() {
    for (name, code) in [("-INT", 130), ("-TERM", 143), ("-HUP", 129)] {
        let folder = long();
        folder.write("out.gif", "old");
        let mut rayfold = Running::start(&folder, &["render", "a.txt", "-o", "out.gif"]);
        wait_until("a file is being written", || {
            let before = parts(&folder);
            // A temporary file that disappears at once is only the check that the folder can be written to.
            std::thread::sleep(Duration::from_millis(200));
            !before.is_empty() && before == parts(&folder)
        });
        rayfold.signal(name);
        assert_eq!(rayfold.end().code(), Some(code));
        assert_eq!(folder.list("."), ["a.txt", "out.gif"]);
        assert_eq!(folder.read("out.gif"), b"old");
    }
}

#[test]
fn ctrl_c_leaves_only_whole_images() {
    let folder = long();
    std::fs::create_dir(folder.join("frames")).unwrap();
    let mut rayfold = Running::start(&folder, &["render", "a.txt", "-o", "frames/%d.png"]);
    wait_until("an image is there", || folder.join("frames/1.png").exists());
    rayfold.signal("-INT");
    assert_eq!(rayfold.end().code(), Some(130));
    let names = folder.list("frames");
    assert!(!names.is_empty() && names.len() < 1000);
    for name in names {
        assert_eq!(folder.image(&format!("frames/{name}")).dimensions(), (2000, 2000), "{name}");
    }
}

#[test]
fn ctrl_c_leaves_only_whole_passes_and_no_image_without_them() {
    for (signal, format) in [("-INT", "exr"), ("-TERM", "png"), ("-KILL", "exr")] {
        let script = BALL.replace("24, 16", "400, 300") + &"Trace\n".repeat(999);
        let folder = Folder::with("a.txt", script);
        std::fs::create_dir(folder.join("frames")).unwrap();
        let out = ["-o", "frames/%d.png", "--pass", "depth,normal", "--pass-format", format];
        let mut rayfold = Running::start(&folder, &[&["render", "a.txt"], &out[..]].concat());
        wait_until("an image is there", || folder.join("frames/1.png").exists());
        rayfold.signal(signal);
        assert!(!rayfold.end().success());
        let names: Vec<_> =
            folder.list("frames").into_iter().filter(|name| !name.ends_with(".part")).collect();
        for name in &names {
            let file = folder.read(&format!("frames/{name}"));
            if name.ends_with(".exr") {
                let image =
                    exr::prelude::read_first_flat_layer_from_file(folder.join(&format!("frames/{name}")));
                assert_eq!(image.unwrap().layer_data.size, exr::prelude::Vec2(400, 300), "{name}");
            } else {
                let image = image::load_from_memory(&file).unwrap();
                assert_eq!((image.width(), image.height()), (400, 300), "{name}");
            }
            if let Some(number) = name.strip_suffix(".png").filter(|number| number.parse::<u32>().is_ok()) {
                for pass in ["depth", "normal"] {
                    assert!(names.contains(&format!("{number}.{pass}.{format}")), "{name} without {pass}");
                }
            }
        }
        assert!(names.contains(&"1.png".to_owned()) && names.len() < 3000);
    }
}

/// Runs `rayfold` with a limit on the size of files. The unit of `ulimit -f` is 512 or 1024 bytes, depending on the
/// shell.
fn with_file_limit(folder: &Folder, args: &str) -> std::process::Output {
    let command = format!("ulimit -f 8; exec {RAYFOLD} {args}");
    Command::new("sh").args(["-c", &command]).current_dir(folder.path()).output().unwrap()
}

#[test]
fn a_file_size_limit_leaves_nothing_and_is_named() {
    let folder = Folder::with("a.txt", BALL.replace("24, 16", "600, 400"));
    for out in ["a.gif", "a.tif", "%d.tif"] {
        let output = with_file_limit(&folder, &format!("render a.txt -o {out}"));
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.contains("cannot write ") && said.ends_with(": File too large\n"), "{said}");
        assert_eq!(folder.list("."), ["a.txt"]);
    }
}

/// The device `/dev/full` replaces a full disk: a separate file system needs more rights than a test has.
#[cfg(target_os = "linux")]
#[test]
fn standard_output_on_a_full_disk_is_an_error() {
    for args in [&["completions", "bash"][..], &["--help"], &["render", "--help"], &["--version"]] {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let output = Command::new(RAYFOLD).args(args).stdout(full).output().unwrap();
        assert_eq!(output.status.code(), Some(1), "{args:?}");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(
            said.starts_with("error: cannot write to standard output: No space left on device"),
            "{said}"
        );
    }
}

/// Returns whether a program has worked for a tenth of a second of processor time.
#[cfg(target_os = "linux")]
fn is_at_work(rayfold: &Running) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{}/stat", rayfold.0.id())).unwrap();
    // Hundredths of a second.
    let time = stat.rsplit(')').next().unwrap().split_whitespace().nth(11).unwrap();
    time.parse::<u64>().unwrap() >= 10
}

/// A run that reads a large script ends at a signal. Regression test: it went on.
#[cfg(target_os = "linux")]
#[test]
fn a_run_that_looks_at_no_signal_is_ended() {
    let folder = Folder::with("a.txt", "Sphere\n".repeat(200_000));
    for (name, code) in [("-INT", 130), ("-TERM", 143)] {
        let mut rayfold = Running::start(&folder, &["check", "a.txt", "--threads", "1"]);
        wait_until("it works", || is_at_work(&rayfold));
        rayfold.signal(name);
        assert_eq!(rayfold.end().code(), Some(code));
    }
}

/// Glass that mirrors, too, sends on two rays at each hit, so that no picture of great depth ends. Regression test: the
/// look for light that the depth cuts off did not end, and a signal had `check` say that there are no errors.
#[cfg(target_os = "linux")]
#[test]
fn a_check_ends_whatever_a_great_depth_would_cost() {
    let folder = Folder::with(
        "a.txt",
        "Screen 64 48\nLook 0 1 5 0 0 0 40\nMaterial m mirror .5 .5 .5 glass 1 1 1 1.5\nSphere 1 -.9 0 0 m\n\
         Sphere 1 .9 0 0 m\nBox -3 -1.2 -3 3 -1 3 .1 .1 .1 .5 .5 .5 .3 .3 .3\nTrace\n",
    );
    assert_eq!(Running::start(&folder, &["check", "a.txt"]).end().code(), Some(0));
    let mut rayfold = Running::start(&folder, &["check", "a.txt"]);
    wait_until("it works", || is_at_work(&rayfold));
    rayfold.signal("-INT");
    assert_eq!(rayfold.end().code(), Some(130));
}

/// The commands wait for input, from a terminal or from another program. Regression test: a second Ctrl-C was needed,
/// and SIGTERM took effect only at the end of the input.
#[test]
fn waiting_for_input_ends_with_the_first_signal() {
    let folder = Folder::new();
    let fifo = folder.join("prices.json");
    assert!(Command::new("mkfifo").arg(&fifo).status().unwrap().success());
    for args in [
        &["check", "-"][..],
        &["render", "-", "-o", "a.gif"],
        &["split", "-", "parts"],
        &["check", "/dev/fd/0"],
        &["cost", "--frames", "9", "--ms", "9", "--prices", "prices.json"],
    ] {
        for (name, code) in [("-INT", 130), ("-TERM", 143), ("-HUP", 129)] {
            let mut command = Command::new(RAYFOLD);
            command.args(args).stdin(Stdio::piped());
            let mut rayfold = Running::of(&folder, command);
            // Its standard input stays open as long as `rayfold` exists.
            let _input = rayfold.0.stdin.take();
            wait_until("it waits", || is_asleep(&rayfold));
            rayfold.signal(name);
            assert_eq!(rayfold.end().code(), Some(code), "{args:?} {name}");
        }
    }
    assert_eq!(folder.list("."), ["prices.json"]);
}

/// Returns whether the program waits for its input, which a thread of this name does.
#[cfg(target_os = "linux")]
fn is_asleep(rayfold: &Running) -> bool {
    let tasks = std::fs::read_dir(format!("/proc/{}/task", rayfold.0.id())).unwrap();
    let mut names = tasks.flatten().filter_map(|task| std::fs::read_to_string(task.path().join("comm")).ok());
    names.any(|name| name.trim() == "waiting")
}

#[cfg(not(target_os = "linux"))]
fn is_asleep(_: &Running) -> bool {
    std::thread::sleep(Duration::from_millis(500));
    true
}

/// The reader of the pipe stops reading without closing it.
#[test]
fn waiting_for_a_reader_ends_with_the_first_signal() {
    let folder = Folder::with("a.txt", BALL.replace("24, 16", "600, 400") + &"Trace\n".repeat(9));
    let mut command = Command::new(RAYFOLD);
    command.args(["render", "a.txt", "-o", "-"]).stdin(Stdio::null()).current_dir(folder.path());
    let mut rayfold = Running(command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap());
    wait_until("it waits", || is_asleep(&rayfold));
    rayfold.signal("-TERM");
    assert_eq!(rayfold.end().code(), Some(143));
}

#[test]
fn signals_that_were_ignored_at_the_start_stay_ignored() {
    let folder = Folder::new();
    for name in ["HUP", "INT"] {
        let mut command = Command::new("sh");
        command.args(["-c", &format!("trap '' {name}; exec {RAYFOLD} check -")]).stdin(Stdio::piped());
        let mut rayfold = Running::of(&folder, command);
        let _input = rayfold.0.stdin.take();
        wait_until("it waits", || is_asleep(&rayfold));
        rayfold.signal(&format!("-{name}"));
        rayfold.signal(&format!("-{name}"));
        std::thread::sleep(Duration::from_millis(300));
        assert!(rayfold.0.try_wait().unwrap().is_none(), "{name} ended it");
        rayfold.signal("-TERM");
        assert_eq!(rayfold.end().code(), Some(143));
    }
}

/// In a container every run has the same process id. Regression test: a file that a killed run left blocked all later
/// runs.
#[test]
fn what_a_killed_run_left_goes_with_the_next() {
    let folder = long();
    let mut rayfold = Running::start(&folder, &["render", "a.txt", "-o", "out.gif"]);
    wait_until("a file is being written", || {
        let before = parts(&folder);
        std::thread::sleep(Duration::from_millis(200));
        !before.is_empty() && before == parts(&folder)
    });
    rayfold.signal("-KILL");
    rayfold.end();
    let left = parts(&folder);
    assert_eq!(left.len(), 1);
    folder.write("a.txt", BALL);
    // On systems without names, it must be old.
    if !cfg!(target_os = "linux") {
        let file = std::fs::File::options().write(true).open(folder.join(&left[0])).unwrap();
        file.set_modified(std::time::SystemTime::now() - Duration::from_secs(2 * 60 * 60)).unwrap();
    }
    folder.rayfold("render a.txt -o out.gif").assert().code(0);
    assert_eq!(folder.list("."), ["a.txt", "out.gif"]);
}
