//! The commands beside the pictures of `scenes/README.md` write these pictures.
//!
//! The first frames of each animation are rendered. The part of a GIF for a frame depends only on the frames up to
//! it, so the beginning of the file must be the same, byte for byte, up to the last of these frames. Then the rest
//! of the file can only differ if a later frame does; the last frame of the file is compared as a picture, within
//! the error that a GIF has. `RAYFOLD_PICTURES=overwrite cargo test -p rayfold --test cli documented` renders them
//! again as a whole. A picture of a single frame is a PNG and is compared as a whole. Each run compares a third of the pictures,
//! drawn at random; `RAYFOLD_TESTS=all` compares all.

use std::path::{Path, PathBuf};

use snapbox::cmd::Command;

use crate::{Folder, RAYFOLD, decode_gif};

/// Frames that are rendered of each animation.
const FRAMES: usize = 3;

/// The largest difference of a level that a picture may have from its last frame, on average.
const NEAR: f64 = 4.0;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The animations and pictures of the page: the file in `docs/images` of each, and the flags of its command.
fn documented() -> Vec<(String, String)> {
    let page = std::fs::read_to_string(root().join("scenes/README.md")).unwrap();
    // Above this heading pictures are whole, below it they are made by the command that is there.
    let (whole, small) = page.split_once("## One script per frame").unwrap();
    let (_, command) = small.split_once("(`rayfold render scenes/artistic -o\nartistic.gif ").unwrap();
    let (flags, _) = command.split_once("`)").unwrap();
    let names = |text: &str| -> Vec<String> {
        let images = text.split("(../docs/images/").skip(1);
        images.filter_map(|image| Some(image.split_once(')')?.0.to_owned())).collect()
    };
    let mut all: Vec<_> = names(whole).into_iter().map(|name| (name, String::new())).collect();
    all.extend(names(small).into_iter().map(|name| (name, flags.to_owned())));
    // The one of the project's own page.
    all.push(("hello.gif".into(), String::new()));
    all
}

fn render(folder: &Folder, name: &str, flags: &str, out: &Path) {
    Command::new(RAYFOLD)
        .args(["render", "--quiet", "-o"])
        .arg(out)
        .arg(root().join("scenes").join(name))
        .args(flags.split_whitespace())
        .current_dir(folder.path())
        .assert()
        .code(0);
}

/// Returns the offset of each frame's first block in a GIF.
fn frames_of(gif: &[u8]) -> Vec<usize> {
    let table = |flags: u8| if flags & 0x80 == 0 { 0 } else { 3 << ((flags & 7) + 1) };
    // Behind a sequence of sub-blocks.
    let behind = |mut at: usize| {
        while gif[at] != 0 {
            at += 1 + usize::from(gif[at]);
        }
        at + 1
    };
    let mut at = 13 + table(gif[10]);
    let mut frames = Vec::new();
    loop {
        match gif[at] {
            0x21 => {
                if gif[at + 1] == 0xf9 {
                    frames.push(at);
                }
                at = behind(at + 2);
            }
            0x2c => at = behind(at + 10 + table(gif[at + 9]) + 1),
            _ => return frames,
        }
    }
}

#[test]
fn documented_pictures_are_what_their_commands_write() {
    let folder = Folder::new();
    let documented = documented();
    assert_eq!(documented.len(), 19, "{documented:?}");
    let mut stale = Vec::new();
    let is_overwriting = std::env::var_os("RAYFOLD_PICTURES").is_some();
    let is_taken = crate::one_in::one_in(3);
    let taken = documented.into_iter().enumerate().filter(|&(k, _)| is_overwriting || is_taken(k));
    for (_, (file, flags)) in taken {
        println!("{file}");
        let (name, ending) = file.split_once('.').unwrap();
        let path = root().join("docs/images").join(&file);
        if is_overwriting {
            render(&folder, name, &flags, &path);
            continue;
        }
        let whole = std::fs::read(&path).unwrap();
        if ending == "png" {
            let single = folder.join("single.png");
            render(&folder, name, &flags, &single);
            if std::fs::read(single).unwrap() != whole {
                stale.push(name.to_owned());
            }
            continue;
        }
        let starts = frames_of(&whole);
        assert!(starts.len() >= 10, "{name}: {} frames", starts.len());
        let first = folder.join("first.gif");
        render(&folder, name, &format!("{flags} --frame 1..{FRAMES}"), &first);
        let first = std::fs::read(first).unwrap();
        // The last of these frames is drawn as that of an animation that ends.
        let end = frames_of(&first)[FRAMES - 1];
        if whole[..starts[FRAMES - 1]] != first[..end] {
            stale.push(format!("{name}: its first {} frames", FRAMES - 1));
        }
        let last = folder.join("last.png");
        render(&folder, name, &format!("{flags} --frame {}", starts.len()), &last);
        let (shown, _) = decode_gif(&whole).pop().unwrap();
        let drawn = folder.image("last.png");
        let off: f64 = shown.iter().zip(drawn.iter()).map(|(a, b)| f64::from(a.abs_diff(*b))).sum();
        let off = off / shown.len() as f64;
        if off > NEAR {
            stale.push(format!("{name}: its last frame by {off:.1} levels"));
        }
    }
    assert!(
        stale.is_empty(),
        "pictures in docs/images are not what the commands of scenes/README.md write: {stale:#?}; \
         RAYFOLD_PICTURES=overwrite cargo test -p rayfold --test cli documented renders them anew"
    );
}
