//! Texts in scripts: their words, sizes, places and fonts, and what is said about them.

use rayfold_scene::assets::{Align, Library, MemoryFiles};
use rayfold_scene::{Limits, Mesh, Object, Parsed, Scene, Source, parse, parse_with_files};

fn library() -> Library {
    let font = std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/src/lib.rs")).unwrap();
    Library::new(MemoryFiles::from([
        ("bold.ttf", notosans::BOLD_TTF.to_vec()),
        ("italic.ttf", notosans::ITALIC_TTF.to_vec()),
        ("no.ttf", font),
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

fn scene(lines: &str) -> Scene {
    let parsed = parsed(lines);
    let script = parsed.script.unwrap_or_else(|| panic!("{lines}: {:?}", parsed.diagnostics));
    script.frame(0).unwrap()
}

fn mesh(lines: &str) -> Mesh {
    match &scene(lines).objects[0] {
        Object::Mesh(mesh) => mesh.clone(),
        other => panic!("{other:?}"),
    }
}

/// Returns the lowest and the highest x.
fn width(mesh: &Mesh) -> [f64; 2] {
    let all = || mesh.model().positions().iter().map(|p| p.x);
    [all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max)]
}

#[test]
fn a_text_has_words_a_size_a_depth_and_options() {
    let material = "Material red diffuse 1 0 0\nMaterial left diffuse 0 1 0\n";
    for (line, align, font) in [
        ("Text \"Hi\" 2 .5", Align::Left, None),
        ("text \"Hi\" 2 .5 red", Align::Left, None),
        ("Text \"Hi\" 2 .5 left", Align::Left, None),
        ("Text \"Hi\",2,.5,CENTRE # seen", Align::Center, None),
        ("Text \"Hi\" 2 .5 red right", Align::Right, None),
        ("Text \"Hi\" 2 .5 font \"italic.ttf\"", Align::Left, Some("italic.ttf")),
        ("Text \"Hi\" 2 .5 red Font \"italic.ttf\" centre", Align::Center, Some("italic.ttf")),
        ("Text \"Hi\" 2 .5 #ff0000 #00ff00 centre", Align::Center, None),
    ] {
        let mesh = mesh(&format!("{material}{line}"));
        let Source::Text(text) = mesh.source() else { panic!("{line}") };
        assert_eq!((text.text.as_str(), text.size, text.depth), ("Hi", 2.0, 0.5), "{line}");
        assert_eq!((text.align, text.font.as_deref()), (align, font), "{line}");
        assert_eq!(mesh.has_material(), line.contains("red") || line.contains("#ff"), "{line}");
    }
    assert_eq!(parsed("Text \"a\" 1 0 font \"bold.ttf\"").files, ["bold.ttf"]);
    let [left, right] = width(&mesh("Text \"Hi\" 2 .5 font \"bold.ttf\""));
    assert_eq!(width(&mesh("Text \"Hi\" 2 .5")), [left, right], "the font of the program is that one");
    assert!(width(&mesh("Text \"Hi\" 2 .5 centre"))[0] < -0.4 * right);
}

#[test]
fn quotes_and_ends_of_lines_are_words() {
    let mesh = mesh(r##"Text "say \"#1\"\n\\ and (1:2)" 1 .2"##);
    let Source::Text(text) = mesh.source() else { panic!("{mesh:?}") };
    assert_eq!(text.text, "say \"#1\"\n\\ and (1:2)");
}

#[test]
fn the_surface_is_that_of_other_objects() {
    let neutral = mesh("Text \"a\" 1 .2");
    assert!(neutral.material().finish().unwrap().own);
    for colors in [".1 .2 .3 .4 .5 .6", ".1 .2 .3 .4 .5 .6 .7 .8 .9", "#102030 #ff8000 #010203"] {
        let scene = scene(&format!("Tone srgb\nText \"a\" 1 .2 {colors} right\nSphere 1 0 0 -9 {colors}"));
        assert_eq!(scene.objects[0].material(), scene.objects[1].material(), "{colors}");
    }
    let moving = parsed("Frames 3\nText \"a\" 1 .2 (1:0 3:.5) 0 0  0 (1:0 3:1) 0 centre");
    assert_eq!(moving.diagnostics, []);
    let script = moving.script.unwrap();
    assert_eq!(script.frame(1).unwrap().objects[0].material().diffuse().y, 0.5);
    assert_eq!(script.frame(2).unwrap().objects[0].material().ambient().x, 0.5);
}

#[test]
fn what_is_written_reads_back() {
    let lines = "Material red diffuse 1 0 0 own\nMaterial moving diffuse (1:0 2:1) 0 0\nText \"a \\\"b\\\"\\n\\\\\" 1.5 0 red \
                 centre font \"italic.ttf\"\nText \"c\" 1e-7 2e20 moving\nText \"d\" 1 2 (1:0 2:.5) 0 0  1 1 1 right\nGroup \
                 g\nText \"e\" 1 2\nEnd\nUse g 1 2 3\nFrames 2";
    let library = library();
    let text = format!("Screen 4 3\nIlight 1 1 1 0 0 -1\n{lines}\nTrace");
    let read = |text: &str| {
        let parsed = parse_with_files("a.txt", text.as_bytes(), &Limits::default(), &library);
        parsed.script.unwrap_or_else(|| panic!("{text}\n{:?}", parsed.diagnostics))
    };
    let script = read(&text);
    let written = script.to_string();
    assert_eq!(read(&written), script, "{written}");
    let scene = script.frame(1).unwrap();
    assert_eq!(scene.objects.len(), 4);
    let back = read(&scene.to_string());
    let again = back.frame(0).unwrap();
    for (a, b) in scene.objects.iter().zip(again.objects.iter()) {
        assert_eq!(a.material(), b.material(), "{scene}");
    }
}

#[test]
fn faults_are_placed() {
    check(
        "Text\nText Hi 1 0\nText \"Hi\nText \"a\"\nText \"a\" 1\nText \"a\" 0 -1\nText \"a\" (1:1 2:2) 0\nText \"a\" 1 (1:0 2:1)",
        &[
            (3, 5, "`Text` has no words"),
            (4, 6, "`Hi` is not in quotes"),
            (5, 6, "the quotes are not closed"),
            (6, 9, "`Text` takes 2, 8, 9, 10 or 11 numbers, found none"),
            (7, 11, "`Text` takes 2, 8, 9, 10 or 11 numbers, found 1"),
            (8, 10, "the size of the letters must be greater than zero"),
            (8, 12, "the depth of the letters must not be negative"),
            (9, 10, "SIZE of `Text` cannot be a curve"),
            (10, 12, "DEPTH of `Text` cannot be a curve"),
        ],
    );
    check(
        "Text \"a\" 1 0 1 2 3\nText \"a\" 1 0 center\nText \"a\" 1 0 left right\nText \"a\" 1 0 font\nText \"a\" 1 0 font bold.ttf\nText \"a\" 1 0 font \"b/c\"\nText \"a\" 1 0 font \"no.ttf\"\nText \"a\" 1 0 font \"Bold.ttf\"\nText \"a\" 1 0 left red\nText \"a\" 1 0 red blue",
        &[
            (3, 19, "`Text` takes 2, 8, 9, 10 or 11 numbers, found 5"),
            (4, 14, "`center` is none of `left`, `centre`, `right` and `font`"),
            (5, 19, "`right` is one word too many"),
            (6, 18, "`font` names no file"),
            (7, 19, "`bold.ttf` is not in quotes"),
            (8, 19, "the name of a file has no '/': files are in the script's own folder"),
            (9, 19, "`no.ttf`: it is no font: a font is TrueType or OpenType"),
            (10, 19, "there is no file `Bold.ttf` in the script's folder"),
            (11, 19, "`red` is none of `left`, `centre`, `right` and `font`"),
            (12, 18, "`blue` is neither a material nor `left`, `centre`, `right` or `font`"),
        ],
    );
    check(
        "Text \"a日\" 1 0\nText \"a\tb\" 1 0\nText \" \\n\" 1 0",
        &[
            (3, 6, "the font that comes with rayfold has no letter `日` (U+65E5)"),
            (4, 6, "the control character U+0009 cannot be drawn"),
            (5, 6, "nothing is drawn: the text has no letter with an outline"),
        ],
    );
}

#[test]
fn a_text_needs_no_files() {
    let text = "Screen 4 3\nIlight 1 1 1 0 0 -1\nText \"a\" 1 .2\nTrace";
    assert_eq!(parse("a.txt", text.as_bytes(), &Limits::default()).diagnostics, []);
    let text = text.replace(".2\n", ".2 font \"a.ttf\"\n");
    let said = &parse("a.txt", text.as_bytes(), &Limits::default()).diagnostics[0];
    assert!(said.message.contains("files are not read here: `a.ttf`"), "{}", said.message);
}

#[test]
fn glass_letters_are_bodies_where_they_have_a_depth() {
    check("Material g glass 1 1 1 1.5\nText \"a\" 1 .1 g", &[]);
    let said = parsed("Material g glass 1 1 1 1.5\nText \"a\" 1 0 g").diagnostics;
    assert!(said[0].message.starts_with("the text without depth is open at the edge from"), "{said:?}");
}

#[test]
fn triangles_of_letters_count() {
    let parsed = parsed("Text \"i\" 1 0\nText \"i\" 1 .1");
    let scene = parsed.script.unwrap().frame(0).unwrap();
    let count = |object: &Object| match object {
        Object::Mesh(mesh) => mesh.model().triangle_count(),
        _ => 0,
    };
    let counts: Vec<_> = scene.objects.iter().map(count).collect();
    assert!(counts[1] > 2 * counts[0]);
}
