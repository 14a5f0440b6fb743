//! Meshes in scripts: words in quotes, the names of files, and what is said about them.

use rayfold_scene::assets::{Library, MemoryFiles, Smoothing};
use rayfold_scene::{Limits, Object, Parsed, Source, parse, parse_with_files};

const CORNER: &[u8] = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 3 4\n";
const COLORED: &[u8] = b"mtllib colours.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nl 1 2\n";

const SHOWN: &[u8] =
    b"mtllib shown.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3\n";

fn library() -> Library {
    Library::new(MemoryFiles::from([
        ("corner.obj", CORNER.to_vec()),
        ("colored.obj", COLORED.to_vec()),
        ("colours.mtl", b"newmtl a\nKd 1 0 0\n".to_vec()),
        ("with \"quotes\", #1.obj", CORNER.to_vec()),
        ("lacks.obj", b"mtllib none.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".to_vec()),
        ("U\u{308}.obj", CORNER.to_vec()),
        ("shown.obj", SHOWN.to_vec()),
        ("shown.mtl", b"newmtl a\nmap_Kd maps/a b.png\nnewmtl b\nmap_Kd unused.png\n".to_vec()),
        ("broken.obj", String::from_utf8_lossy(SHOWN).replace("shown.mtl", "broken.mtl").into_bytes()),
        ("broken.mtl", b"newmtl a\nmap_Kd c.png\n".to_vec()),
        ("c.png", b"GIF89a".to_vec()),
    ]))
}

fn parsed(lines: &str) -> Parsed {
    let text = format!("Screen 4 3\nIlight 1 1 1 0 0 -1\n{lines}\nTrace");
    parse_with_files("a.txt", text.as_bytes(), &Limits::default(), &library())
}

/// Checks what is said about lines, the first of which is line 3: its line, its column and the message.
fn check(lines: &str, expected: &[(usize, usize, &str)]) {
    let diagnostics = parsed(lines).diagnostics;
    let said: Vec<_> = diagnostics.iter().map(|d| (d.line, d.column, d.message.as_str())).collect();
    assert_eq!(said, expected);
}

#[test]
fn a_mesh_has_a_file_and_options() {
    let material = "Material red diffuse 1 0 0\n";
    for (line, smoothing) in [
        ("Mesh \"corner.obj\"", Smoothing::OfFile),
        ("mesh \"corner.obj\" red", Smoothing::OfFile),
        ("Mesh \"corner.obj\" red smooth 30", Smoothing::Within(30.0)),
        ("Mesh \"corner.obj\" SMOOTH 180", Smoothing::Within(180.0)),
        ("Mesh \"corner.obj\",flat # seen", Smoothing::Flat),
    ] {
        let parsed = parsed(&format!("{material}{line}"));
        let script = parsed.script.unwrap_or_else(|| panic!("{:?}", parsed.diagnostics));
        let scene = script.frame(0).unwrap();
        let Object::Mesh(mesh) = &scene.objects[0] else { panic!("{line}") };
        assert_eq!(*mesh.source(), Source::File { name: "corner.obj".into(), smoothing }, "{line}");
        assert_eq!(mesh.has_material(), line.contains("red"));
        assert_eq!(parsed.files, ["corner.obj"]);
    }
}

#[test]
fn numbers_curves_and_colours_are_a_surface_as_of_other_objects() {
    let lines =
        |line: &str| format!("{line}\nSphere 1 0 0 -9 {}", line.trim_start_matches("Mesh \"corner.obj\" "));
    for (line, most) in [
        ("Mesh \"corner.obj\" .1 .2 .3 .4 .5 .6", 1.0),
        ("Mesh \"corner.obj\" .1 .2 .3 .4 .5 .6 .7 .8 .9", 1.0),
        ("Mesh \"corner.obj\" #102030 #ff8000 #010203", 1.0),
        ("Mesh \"corner.obj\" (1:0 3:.5) 0 0  0 (1:0 3:1) 0", 1.0),
    ] {
        let text = format!("Frames 3\nTone srgb\n{}", lines(line));
        let parsed = parsed(&text);
        let script = parsed.script.unwrap_or_else(|| panic!("{line}: {:?}", parsed.diagnostics));
        assert_eq!(parsed.diagnostics, [], "{line}");
        for k in 0..3 {
            let scene = script.frame(k).unwrap();
            let [mesh, ball] = [0, 1].map(|i| scene.objects[i].material().clone());
            assert_eq!(mesh, ball, "{line}, frame {k}");
            assert!(mesh.diffuse().max_element() <= most);
        }
        let written = script.to_string();
        let again =
            parse_with_files("b.txt", written.as_bytes(), &Limits::default(), &library()).script.unwrap();
        assert_eq!(again.to_string(), written, "{line}");
        let scene = script.frame(1).unwrap();
        let text = scene.to_string();
        let back = parse_with_files("c.txt", text.as_bytes(), &Limits::default(), &library()).script.unwrap();
        assert_eq!(back.frame(0).unwrap().objects[0].material(), scene.objects[0].material(), "{text}");
    }
    let smooth = parsed("Mesh \"corner.obj\" 0 0 0  1 0 0  smooth 30").script.unwrap().frame(0).unwrap();
    let Object::Mesh(mesh) = &smooth.objects[0] else { panic!("{smooth}") };
    let smoothing = Smoothing::Within(30.0);
    assert_eq!(*mesh.source(), Source::File { name: "corner.obj".into(), smoothing });
    assert_eq!(mesh.material().diffuse().x, 1.0);
    check(
        "Mesh \"corner.obj\" 1 2 3\nMesh \"corner.obj\" 0 0 0 1 1 99\nMesh \"corner.obj\" #ff8000 smooth 2\nMesh \"corner.obj\" x y",
        &[
            (3, 24, "`Mesh` takes 0, 6, 7, 8 or 9 numbers, found 3"),
            (4, 25, "this is far above 1, which is full brightness"),
            (5, 26, "`Mesh` takes 0, 6, 7, 8 or 9 numbers, found 3"),
            (6, 21, "`y` is neither a material nor `smooth` or `flat`"),
        ],
    );
}

#[test]
fn what_is_written_reads_back() {
    let lines = "Material red diffuse 1 0 0 own\nMaterial moving diffuse (1:0 2:1) 0 0\nMesh \"with \\\"quotes\\\", #1.obj\" red \
                 smooth 30.5\nMesh \"colored.obj\" moving flat\nGroup g\nMesh \"corner.obj\"\nMesh \"corner.obj\" \
                 moving\nEnd\nUse g 1 2 3\nFrames 2";
    let library = library();
    let text = format!("Screen 4 3\nIlight 1 1 1 0 0 -1\n{lines}\nTrace");
    let read = |text: &str| {
        let parsed = parse_with_files("a.txt", text.as_bytes(), &Limits::default(), &library);
        parsed.script.unwrap_or_else(|| panic!("{:?}", parsed.diagnostics))
    };
    let script = read(&text);
    let written = script.to_string();
    assert_eq!(read(&written), script, "{written}");
    assert_eq!(script.frame(1).unwrap().objects.len(), 4);
    let scene = script.frame(1).unwrap();
    assert_eq!(read(&scene.to_string()).frame(0).unwrap().objects.len(), 4);
    let own = &scene.objects[0].material();
    assert!(own.finish().is_some_and(|finish| finish.own));
}

#[test]
fn words_in_quotes_are_whole() {
    check(
        "Mesh\nMesh corner.obj\nMesh \"corner.obj\nMesh \"corner.obj\"x\nMesh \"a\\tb\"\nMesh \"\"",
        &[
            (3, 5, "`Mesh` names no file"),
            (4, 6, "`corner.obj` is not in quotes"),
            (5, 6, "the quotes are not closed"),
            (6, 6, "quotes within a word"),
            (7, 6, "`\\t` means nothing in quotes"),
            (8, 6, "the name of a file is empty"),
        ],
    );
}

#[test]
fn files_have_plain_names_and_are_there() {
    check(
        "Mesh \"models/corner.obj\"\nMesh \".hidden\"\nMesh \"notes.TXT\"\nMesh \"Corner.obj\"\nMesh \"\u{dc}.obj\"\nMesh \"none.obj\"",
        &[
            (3, 6, "the name of a file has no '/': files are in the script's own folder"),
            (4, 6, "the name of a file does not begin with a dot"),
            (5, 6, "a file is neither a script (.txt) nor the settings (animation.json)"),
            (6, 6, "there is no file `Corner.obj` in the script's folder"),
            (7, 6, "there is no file `\u{dc}.obj` in the script's folder"),
            (8, 6, "there is no file `none.obj` in the script's folder"),
        ],
    );
}

#[test]
fn options_of_a_mesh_are_explained() {
    check(
        "Mesh \"corner.obj\" smooth\nMesh \"corner.obj\" smooth 181\nMesh \"corner.obj\" smooth (1:0 2:3)\nMesh \"corner.obj\" red smoth 3\nMesh \"corner.obj\" flat red\nMesh \"corner.obj\" unknown",
        &[
            (3, 25, "`smooth` lacks its angle"),
            (4, 26, "`181` is no angle of `smooth`"),
            (5, 26, "`(1:0 2:3)` is no angle of `smooth`"),
            (6, 23, "`smoth` is neither a material nor `smooth` or `flat`"),
            (7, 24, "there is more behind the normals of the mesh"),
            (8, 19, "unknown material `unknown`"),
        ],
    );
}

#[test]
fn doubts_about_a_mesh_are_warnings() {
    check(
        "Material glassy glass 1 1 1 1.5\nMaterial file diffuse 1 1 1 own\nMesh \"corner.obj\" glassy\nMesh \"lacks.obj\"\nMesh \"colored.obj\"\nSphere 1 0 0 0 file",
        &[
            (
                5,
                6,
                "`corner.obj` is open at the edge from 0 0 0 to 1 0 0, so its glass is panes that do not refract",
            ),
            (6, 6, "`lacks.obj`: there is no file `none.mtl`: what has its materials is grey"),
            (7, 6, "`colored.obj`: lines are left out"),
            (8, 16, "`own` has no effect on a `Sphere`"),
        ],
    );
}

/// Programs write the two ends of a seam, or the points of a pole, with roundoff between them.
#[test]
fn glass_with_a_hairline_gap_says_how_to_close_it() {
    let said = parsed("Material g glass 1 1 1 1.5\nMesh \"corner.obj\" g").diagnostics;
    let help = said[0].help.as_deref().unwrap();
    assert!(help.contains("merge them by distance"), "{help}");
}

#[test]
fn a_caller_without_files_says_who_reads_them() {
    let parsed = parse("a.txt", b"Screen 4 3\nMesh \"corner.obj\"\nTrace", &Limits::default());
    assert!(parsed.script.is_none());
    let message = &parsed.diagnostics[0].message;
    assert!(message.contains("files are not read here"), "{message}");
    assert_eq!(parsed.files, ["corner.obj"]);
}

#[test]
fn files_that_models_refer_to_are_named_too() {
    assert_eq!(
        parsed("Mesh \"colored.obj\"\nMesh \"lacks.obj\"").files,
        ["colored.obj", "colours.mtl", "lacks.obj", "none.mtl"]
    );
    // A picture is among them although it is missing, or spoils the model.
    assert_eq!(parsed("Mesh \"shown.obj\"").files, ["a b.png", "shown.mtl", "shown.obj"]);
    assert_eq!(parsed("Mesh \"broken.obj\"").files, ["broken.mtl", "broken.obj", "c.png"]);
}

#[test]
fn pictures_of_models_are_missed_and_refused() {
    let missed = "`shown.obj`: there is no file `maps/a b.png`: what has this picture is grey";
    check("Mesh \"shown.obj\"", &[(3, 6, missed)]);
    check("Mesh \"broken.obj\"", &[(3, 6, "`c.png`: it is a GIF")]);
}

#[test]
fn a_script_names_at_most_64_files() {
    let lines = |count: usize| (0..count).map(|k| format!("Mesh \"{k}.obj\"\n")).collect::<String>();
    let many = |count: usize| {
        let files = parsed(&lines(count)).diagnostics;
        files.iter().filter(|d| d.message.contains("files that a script names")).count()
    };
    assert_eq!((many(64), many(65), many(70)), (0, 1, 1));
}
