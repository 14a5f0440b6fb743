//! Tests of `rayfold render --watch`.

use std::io::{BufRead, BufReader};
use std::process::{Child, ChildStderr, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use crate::{BALL, Folder, RAYFOLD, ball_at};

/// Longer than a loaded machine needs.
const PATIENCE: Duration = Duration::from_secs(60);

/// The running program. It ends with the test.
struct Watching {
    rayfold: Child,
    lines: Receiver<String>,
}

impl Watching {
    fn start(folder: &Folder, args: &[&str]) -> Self {
        let mut rayfold = Command::new(RAYFOLD)
            .args(args)
            .current_dir(folder.path())
            .stdin(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let lines = lines(rayfold.stderr.take().unwrap());
        Self { rayfold, lines }
    }

    /// Waits until the program waits for a change. Returns its output since then.
    fn until_it_waits(&self) -> String {
        let mut said = String::new();
        loop {
            let line =
                self.lines.recv_timeout(PATIENCE).unwrap_or_else(|_| panic!("it does not wait: {said}"));
            if line.starts_with("waiting for a script to change") {
                return said;
            }
            said += &(line + "\n");
        }
    }
}

impl Drop for Watching {
    fn drop(&mut self) {
        let _ = self.rayfold.kill();
        let _ = self.rayfold.wait();
    }
}

fn lines(stderr: ChildStderr) -> Receiver<String> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        for line in BufReader::new(stderr).lines().map_while(Result::ok) {
            let _ = sender.send(line);
        }
    });
    receiver
}

#[test]
fn a_script_that_is_saved_is_drawn_again() {
    let folder = Folder::with("balls/f1.txt", BALL);
    let mut watching = Watching::start(&folder, &["render", "balls", "-o", "out.gif", "--watch"]);
    assert!(watching.until_it_waits().starts_with("out.gif: 1 frame of 24 x 16"));
    let first = folder.read("out.gif");

    folder.write("balls/f1.txt", ball_at(3));
    assert!(watching.until_it_waits().starts_with("out.gif: 1 frame"));
    assert_ne!(folder.read("out.gif"), first);

    // A fault is reported, the last picture stays, and the correction is detected.
    let second = folder.read("out.gif");
    folder.write("balls/f2.txt", "Trce");
    let said = watching.until_it_waits();
    assert!(said.contains("did you mean `Trace`?") && said.contains("nothing was written"), "{said}");
    assert_eq!(folder.read("out.gif"), second);
    folder.write("balls/f2.txt", BALL.replace("24, 16", "12, 8"));
    let said = watching.until_it_waits();
    assert!(said.contains("an animation has one size"), "{said}");
    folder.write("balls/f2.txt", BALL);
    assert!(watching.until_it_waits().starts_with("out.gif: 2 frames"));

    // Ctrl-C ends the program without an error.
    let id = watching.rayfold.id().to_string();
    assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    assert_eq!(watching.rayfold.wait().unwrap().code(), Some(0));
}

#[test]
fn what_never_changes_cannot_be_watched() {
    let folder = Folder::with("a.txt", BALL);
    for args in ["render - -o a.gif --watch", "render a.txt -o - --watch"] {
        folder.rayfold(args).stdin("").assert().code(2);
    }
}

#[test]
fn a_file_that_a_script_names_is_watched() {
    let script = "Screen 8 6\nLook 2 2 3 .3 .3 0 40\nMesh \"corner.obj\"\nTrace\n";
    let folder = Folder::with("scene.txt", script);
    folder.write("corner.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let watching = Watching::start(&folder, &["render", "--watch", "scene.txt", "-o", "out.gif"]);
    watching.until_it_waits();
    let before = folder.read("out.gif");
    folder.write("corner.obj", "v 0 0 0\nv 2 0 0\nv 0 2 0\nv 0 0 2\nf 1 2 3\nf 1 3 4\n");
    watching.until_it_waits();
    assert_ne!(folder.read("out.gif"), before);
}
