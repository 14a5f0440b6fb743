//! Special files: files that are no scripts, picture names that are taken, links, secret and read-only places.

#![cfg(unix)]

use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};
use std::process::Command;

use snapbox::str;

use crate::{BALL, Folder};

fn make_pipe(folder: &Folder, name: &str) {
    assert!(Command::new("mkfifo").arg(folder.join(name)).status().unwrap().success());
}

/// Regression test: every command that read the folder waited for ever.
#[test]
fn a_pipe_among_the_scripts_is_refused_by_name() {
    let folder = Folder::with("scenes/1.txt", BALL);
    make_pipe(&folder, "scenes/7.txt");
    folder.rayfold("check scenes").assert().code(1).stderr_eq(str![[r#"
error: cannot read scenes/7.txt: expected a file, found a pipe
1 error in 1 of 2 files

"#]]);
    folder.rayfold("render scenes -o a.gif").assert().code(1).stderr_eq(str![[r#"
error: cannot read scenes/7.txt: expected a file, found a pipe
error: nothing was written: 1 error in 1 of 2 files

"#]]);
    for args in [
        "render scenes/7.txt -o a.gif",
        "split scenes/7.txt parts",
        "submit scenes --bucket none",
        "studio scenes --no-open",
        "encode scenes/7.txt -o a.gif",
    ] {
        let out = folder.rayfold(args).timeout(std::time::Duration::from_secs(60)).output().unwrap();
        let said = String::from_utf8(out.stderr).unwrap();
        assert!(
            out.status.code() == Some(1) && said.contains("scenes/7.txt: expected a file, found a pipe"),
            "{said}"
        );
    }
    std::fs::remove_file(folder.join("scenes/7.txt")).unwrap();
    make_pipe(&folder, "scenes/animation.json");
    for args in ["check scenes", "check scenes/animation.json", "render scenes -o a.gif"] {
        let out = folder.rayfold(args).output().unwrap();
        let said = String::from_utf8(out.stderr).unwrap();
        assert!(said.contains("scenes/animation.json: expected a file, found a pipe"), "{said}");
    }
    assert_eq!(folder.list("."), ["scenes"]);
}

/// With `--skip-existing` an existing picture is read.
#[test]
fn a_pipe_in_a_picture_s_place_is_refused_by_name() {
    let folder = Folder::with("a.txt", BALL);
    make_pipe(&folder, "1.png");
    let out = folder.rayfold("render a.txt -o %d.png --skip-existing").output().unwrap();
    let said = String::from_utf8(out.stderr).unwrap();
    assert!(said.contains("cannot write 1.png: it is not a regular file"), "{said}");
}

#[test]
fn a_script_comes_through_a_pipe_of_the_shell() {
    let folder = Folder::with("a.txt", BALL);
    let command = format!("cat a.txt | {} check /dev/stdin", crate::RAYFOLD);
    let out = Command::new("sh").args(["-c", &command]).current_dir(folder.path()).output().unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
}

#[test]
fn what_is_replaced_keeps_its_mode_and_a_link_leads_on() {
    let folder = Folder::with("a.txt", BALL);
    folder.write("secret.gif", "old");
    std::fs::set_permissions(folder.join("secret.gif"), PermissionsExt::from_mode(0o600)).unwrap();
    symlink("later.gif", folder.join("link.gif")).unwrap();
    let long = "n".repeat(251) + ".gif";
    for out in ["secret.gif", "link.gif", &long] {
        folder.rayfold(&format!("render a.txt -o {out}")).assert().code(0);
    }
    assert_eq!(folder.join("secret.gif").metadata().unwrap().mode() & 0o777, 0o600);
    assert!(folder.join("link.gif").symlink_metadata().unwrap().is_symlink());
    assert_eq!(folder.read("later.gif"), folder.read("secret.gif"));
    assert_eq!(folder.list("."), ["a.txt", "later.gif", "link.gif", &long, "secret.gif"]);
}

#[test]
fn a_read_only_file_is_not_replaced() {
    let folder = Folder::with("a.txt", BALL);
    for name in ["a.gif", "a.png", "1.tif"] {
        folder.write(name, "old");
        std::fs::set_permissions(folder.join(name), PermissionsExt::from_mode(0o444)).unwrap();
        let out = if name == "1.tif" { "%d.tif" } else { name };
        let said = folder.rayfold(&format!("render a.txt -o {out}")).output().unwrap();
        assert_eq!(said.status.code(), Some(1));
        let said = String::from_utf8(said.stderr).unwrap();
        assert!(said.contains(&format!("cannot write {name}: it is read-only")), "{said}");
        assert_eq!(folder.read(name), b"old");
    }
}

/// Regression test: everything was drawn and the output was lost without an error.
#[cfg(target_os = "linux")]
#[test]
fn a_closed_standard_output_is_an_error() {
    let folder = Folder::with("a.txt", BALL);
    let run = |redirect: &str| {
        let command = format!("{} render a.txt -o - {redirect}", crate::RAYFOLD);
        Command::new("sh").args(["-c", &command]).current_dir(folder.path()).output().unwrap()
    };
    let closed = run(">&-");
    let said = String::from_utf8(closed.stderr).unwrap();
    assert!(closed.status.code() == Some(1) && said.contains("standard output: it is closed"), "{said}");
    assert_eq!(run("> /dev/null").status.code(), Some(0));
    assert_eq!(run("> a.y4m").status.code(), Some(0));
}
