//! Scripts that name models: `render`, `check` and `split` with files beside them.

use crate::Folder;

/// A script that draws the model in `corner.obj`.
const SCRIPT: &str =
    "Screen 8 6\nLook 2 2 3 .3 .3 0 40\nIlight 1 1 1 -1 -2 -1\nMesh \"corner.obj\"\nTrace\nTrace\n";

const CORNER: &str = "mtllib colours.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n";

const COLORS: &str = "newmtl red\nKd 1 0 0\n";

#[test]
fn a_model_is_read_from_the_folder_of_its_script() {
    let folder = Folder::with("film/1.txt", SCRIPT);
    folder.write("film/corner.obj", CORNER);
    folder.write("film/colours.mtl", COLORS);
    folder.rayfold("render film -o film.gif").assert().code(0);
    folder.rayfold("render film/1.txt -o script.gif").assert().code(0);
    assert_eq!(folder.read("film.gif"), folder.read("script.gif"));
    folder.write("film/colours.mtl", "newmtl red\nKd 0 0 1\n");
    folder.rayfold("render film -o blue.gif").assert().code(0);
    assert_ne!(folder.read("film.gif"), folder.read("blue.gif"));
}

#[test]
fn missing_files_and_other_letter_case_are_errors() {
    let folder = Folder::with("film/1.txt", SCRIPT);
    let said = |folder: &Folder| {
        let output = folder.rayfold("check film").assert().code(1).get_output().stderr.clone();
        String::from_utf8(output).unwrap()
    };
    assert!(said(&folder).contains("there is no file `corner.obj` in the script's folder"));
    folder.write("film/Corner.OBJ", CORNER);
    assert!(said(&folder).contains("there is `Corner.OBJ`: names are compared byte for byte"));
}

#[test]
fn models_that_no_script_names_are_warnings() {
    let folder = Folder::with("film/1.txt", SCRIPT);
    folder.write("film/corner.obj", CORNER);
    folder.write("film/colours.mtl", COLORS);
    folder.write("film/other.stl", "solid");
    folder.write("film/notes.md", "no model");
    let output = folder.rayfold("check film").assert().code(0).get_output().stderr.clone();
    let said = String::from_utf8(output).unwrap();
    assert!(said.contains("other.stl: no script names this file"), "{said}");
    assert!(
        !said.contains("corner.obj") && !said.contains("colours.mtl") && !said.contains("notes"),
        "{said}"
    );
}

#[test]
fn split_copies_the_files() {
    let folder = Folder::with("1.txt", SCRIPT);
    folder.write("corner.obj", CORNER);
    folder.write("colours.mtl", COLORS);
    folder.rayfold("split 1.txt parts").assert().code(0);
    assert_eq!(folder.list("parts"), ["1-1.txt", "1-2.txt", "colours.mtl", "corner.obj"]);
    folder.rayfold("render 1.txt -o whole.gif").assert().code(0);
    folder.rayfold("render parts -o parts.gif").assert().code(0);
    assert_eq!(folder.read("whole.gif"), folder.read("parts.gif"));
    folder.rayfold("split 1.txt parts").assert().code(0);
    folder.write("parts/corner.obj", "v 0 0 0");
    let output = folder.rayfold("split 1.txt parts").assert().code(1).get_output().stderr.clone();
    assert!(String::from_utf8(output).unwrap().contains("corner.obj holds another file already"));
}

/// A script with a sky and a picture on a ball.
const PICTURES: &str = "Screen 8 6\nLook 0 0 5 0 0 0 40\nIlight 1 1 1 -1 -2 -1\nSky \"sky.hdr\" 1 (1:0 2:90)\n\
    Material m diffuse 1 1 1 image \"my map.png\" ball\nSphere 1 0 0 0 m\nFrames 2\nTrace\n";

/// A picture of light: 4 x 1 pixels, flat.
const LIGHT: &[u8] = b"#?RADIANCE\n\n-Y 1 +X 4\n\x80\0\0\x80\0\x80\0\x80\0\0\x80\x80\x80\x80\x80\x80";

#[test]
fn pictures_are_read_copied_and_missed_as_models_are() {
    let folder = Folder::with("film/1.txt", PICTURES);
    let said = |code: i32| {
        let output = folder.rayfold("check film").assert().code(code).get_output().stderr.clone();
        String::from_utf8(output).unwrap()
    };
    assert!(said(1).contains("there is no file `sky.hdr` in the script's folder"));
    folder.write("film/sky.hdr", LIGHT);
    assert!(said(1).contains("there is no file `my map.png` in the script's folder"));
    let map = include_bytes!("../../crates/scene/tests/pixel.png");
    folder.write("film/my map.png", map);
    folder.write("film/unused.exr", "no picture");
    folder.write("film/unused.otf", "no font");
    folder.write("film/0001.depth.exr", "a pass");
    let text = said(0);
    for unused in ["unused.exr", "unused.otf"] {
        assert!(text.contains(&format!("{unused}: no script names this file")), "{text}");
    }
    assert!(!text.contains("depth.exr"), "{text}");
    assert!(text.contains("`sky.hdr` has 4 x 1 pixels, and is stretched around the scene"), "{text}");
    assert!(!text.contains("sky.hdr: ") && !text.contains("my map.png"), "{text}");
    folder.rayfold("render film -o film.gif").assert().code(0);
    folder.rayfold("split film/1.txt parts").assert().code(0);
    assert_eq!(folder.list("parts"), ["1-1.txt", "1-2.txt", "my map.png", "sky.hdr"]);
    folder.rayfold("render parts -o parts.gif").assert().code(0);
    assert_eq!(folder.read("film.gif"), folder.read("parts.gif"));
    folder.write("film/sky.hdr", &LIGHT[..20]);
    assert!(said(1).contains("`sky.hdr`: its header has no end"), "{}", said(1));
}

#[test]
fn no_output_replaces_a_picture_or_a_model_that_is_read() {
    let folder = Folder::with(
        "a.txt",
        "Screen 8 6\nMaterial m ambient 1 1 1 image \"a.albedo.png\" ball\nSphere 1 0 0 -5 m\nMesh \"a.obj\"\nIlight 1 1 1 0 0 -1\nTrace\n",
    );
    let map = include_bytes!("../../crates/scene/tests/pixel.png");
    folder.write("a.albedo.png", map);
    folder.write("a.obj", CORNER);
    folder.write("colours.mtl", COLORS);
    for args in ["-o a.png --pass albedo --pass-format png", "-o a.albedo.png"] {
        let run = folder.rayfold(&format!("render a.txt {args}")).output().unwrap();
        let said = String::from_utf8(run.stderr).unwrap();
        assert_eq!(run.status.code(), Some(2), "{said}");
        assert!(said.contains("a.albedo.png would replace"), "{said}");
        assert_eq!(folder.read("a.albedo.png"), map, "{args}");
    }
    folder.rayfold("render a.txt -o b.png --pass albedo --pass-format png").assert().code(0);
}
