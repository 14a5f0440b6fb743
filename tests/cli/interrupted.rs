//! Output appears whole or not at all: on Ctrl-C, when the disk is full, when a file may not grow.

#![cfg(unix)]

use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use crate::{BALL, Folder, RAYFOLD};

/// Longer than a loaded machine needs to begin or to stop.
const PATIENCE: Duration = Duration::from_secs(60);

/// A thousand frames that take minutes.
fn long() -> Folder {
    let script = BALL.replace("24, 16", "2000, 2000") + &"Trace\n".repeat(999);
    Folder::with("a.txt", script)
}

/// The program at work; it does not outlive the test.
struct Running(Child);

impl Running {
    fn start(folder: &Folder, args: &[&str]) -> Self {
        let mut command = Command::new(RAYFOLD);
        command
            .args(args)
            .current_dir(folder.path())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null());
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
    for (name, code) in [("-INT", 130), ("-TERM", 143)] {
        let folder = long();
        folder.write("out.gif", "old");
        let mut rayfold = Running::start(&folder, &["render", "a.txt", "-o", "out.gif"]);
        wait_until("a file is being written", || {
            let before = parts(&folder);
            // One that goes at once only shows whether the folder can be written to.
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

/// `ulimit -f` counts in units of 512 or 1024 bytes, by shell.
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

/// The device that is always full stands for the disk: a file system of its own needs more rights than a test has.
#[cfg(target_os = "linux")]
#[test]
fn standard_output_on_a_full_disk_is_an_error() {
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let output = Command::new(RAYFOLD).args(["completions", "bash"]).stdout(full).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(
        String::from_utf8_lossy(&output.stderr),
        "error: cannot write to standard output: No space left on device\n"
    );
}
