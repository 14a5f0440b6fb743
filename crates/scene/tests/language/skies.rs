//! Skies: colours and pictures, with backgrounds, `Background none` and fog; what is written reads back.

use std::sync::LazyLock;

use glam::DVec3;
use rayfold_scene::assets::{Library, MemoryFiles};
use rayfold_scene::{Background, Limits, Parsed, Scene, Script, Sky, SkyTurn, parse_with_files};

static LIBRARY: LazyLock<Library> = LazyLock::new(|| {
    let picture = include_bytes!("../pixel.png").to_vec();
    Library::new(MemoryFiles::from([
        ("a.png", picture.clone()),
        ("b \"c\".png", picture),
        ("no.png", vec![]),
    ]))
});

fn parsed(text: &str) -> Parsed {
    parse_with_files("a.txt", text.as_bytes(), &Limits::default(), &LIBRARY)
}

fn script(text: &str) -> Script {
    let Parsed { script, diagnostics, .. } = parsed(text);
    script.unwrap_or_else(|| panic!("{text}\n{diagnostics:?}"))
}

fn messages(text: &str) -> Vec<String> {
    parsed(text).diagnostics.into_iter().map(|diagnostic| diagnostic.message).collect()
}

/// Describes what rays see that hit nothing, and whether those from the camera do.
fn seen(scene: &Scene) -> String {
    let around = match &scene.sky {
        Some(Sky::Colors(colors)) => format!("sky {}", colors.colors().0.x),
        Some(Sky::Picture(file, turn)) => format!("{} {} {}", file.file(), turn.strength(), turn.degrees()),
        None => format!("colour {}", scene.background.colors().0.x),
    };
    format!("{around}{}", if scene.background.is_none() { ", hidden" } else { "" })
}

/// Returns what each frame sees, after the script was written and read again.
fn frames(lines: &str) -> Vec<String> {
    let script = script(&format!("Screen 4 3\n{lines}"));
    let text = script.to_string();
    assert_eq!(self::script(&text), script, "{text}");
    script.frames().map(|scene| seen(&scene)).collect()
}

#[test]
fn the_last_command_counts() {
    let lines = "Sky 2 2 2\nTrace\nBackground .5 .5 .5\nTrace\nSky \"a.png\" 3 40\nTrace\nSky 4 4 4 0 0 0\nTrace\nClear\nTrace\n";
    assert_eq!(frames(lines), ["sky 2", "colour 0.5", "a.png 3 40", "sky 4", "colour 0"]);
}

#[test]
fn background_none_takes_away_a_colour_and_hides_a_sky() {
    let lines = "Background .5 .5 .5\nTrace\nBackground none\nTrace\nSky 2 2 2\nTrace\nSky 3 3 3\nTrace\n\
                 Background .25 0 0\nTrace\nSky 3 3 3\nTrace\nBackground none\nTrace\nClear\nTrace\n";
    let expected = [
        "colour 0.5",
        "colour 0, hidden",
        "sky 2, hidden",
        "sky 3, hidden",
        "colour 0.25",
        "sky 3",
        "sky 3, hidden",
        "colour 0",
    ];
    assert_eq!(frames(lines), expected);
    // Each state after each other, also those that differ in one thing.
    let states =
        ["Background .5 0 0", "Background none", "Sky 2 2 2", "Sky \"a.png\"", "Sky (1:2 3:2) 2 2", "Clear"];
    for a in states {
        for b in states {
            for c in states {
                frames(&format!("{a}\nTrace\n{b}\nTrace\n{c}\nTrace\n{a}\nTrace\n{b}\n{c}\nTrace\n"));
            }
        }
    }
}

#[test]
fn the_numbers_of_a_sky_may_be_curves_and_levels() {
    let text = "Screen 4 3\nFrames 3\nSky \"b \\\"c\\\".png\" (1:1 3:3) (1:0 3:90)\nTrace\n";
    let moving = script(text);
    let scene = moving.frame(1).unwrap();
    let Some(Sky::Picture(file, turn)) = &scene.sky else { panic!("a picture") };
    assert_eq!((file.file(), *turn), ("b \"c\".png", SkyTurn::new(2.0, 45.0).unwrap()));
    assert_eq!(script(&moving.to_string()), moving);
    assert_eq!(script(&scene.to_string()).frame(0).unwrap().sky, scene.sky);
    let levels = script("Screen 4 3\nTone srgb\nSky #ffffff #808080\nTrace\n");
    let scene = levels.frame(0).unwrap();
    let (low, high) = scene.surroundings().colors();
    assert_eq!(low, DVec3::ONE);
    assert!((high.unwrap().x - 0.215_86).abs() < 1e-5);
    assert_eq!(script(&levels.to_string()), levels);
}

#[test]
fn a_sky_is_not_clamped_and_fog_hides_it() {
    let bright = script("Screen 4 3\nSky 5 6 7\nTrace\n").frame(0).unwrap();
    assert_eq!(bright.surroundings().color(), Some(DVec3::new(5.0, 6.0, 7.0)));
    let foggy = script("Screen 4 3\nSky \"a.png\"\nFog .5 .5 .5 9\nTrace\n").frame(0).unwrap();
    assert_eq!(foggy.surroundings().color(), Some(DVec3::splat(0.5)));
    assert!(foggy.sky_picture().is_none());
    let warnings = messages("Screen 4 3\nSky \"a.png\"\nFog .5 .5 .5 9\nTrace\nTrace\n");
    assert_eq!(warnings, ["the sky has no effect: fog hides it"]);
    assert_eq!(messages("Screen 4 3\nFog .5 .5 .5 9\nSky 1 1 1\nFog none\nTrace\n"), [""; 0]);
    assert_eq!(messages("Screen 4 3\nFog .5 .5 .5 9\nSky 1 1 1\nBackground 1 1 1\nTrace\n"), [""; 0]);
}

#[test]
fn what_is_wrong_is_said() {
    let fault = |line: &str| {
        let messages = messages(&format!("Screen 4 3\n{line}\nTrace\n"));
        assert_eq!(messages.len(), 1, "{line}: {messages:?}");
        messages[0].clone()
    };
    assert!(fault("Sky 1 1").contains("takes 3 or 6 numbers, found 2"));
    assert!(fault("Sky 1 -1 1").starts_with("the sky must"), "{}", fault("Sky 1 -1 1"));
    assert!(fault("Sky \"a.png\" -1").contains("strength"));
    assert!(fault("Sky a.png").contains("not in quotes"));
    assert!(fault("Sky \"c.png\"").contains("no file `c.png`"));
    assert!(fault("Sky \"A.png\"").contains("no file `A.png`"));
    assert!(fault("Sky \"no.png\"").contains("`no.png`: it is no picture"));
    assert!(fault("Sky \"a.png\" 1 2 3").contains("takes"));
    assert!(fault("Sky \"../a.png\"").contains("own folder"));
    assert!(fault("Sky 90 90 90").contains("far above 1"));
    assert!(fault("Group a\nSky 1 1 1\nEnd\nUse a").contains("not allowed in a group"));
    assert!(fault("Sky (1:-1 2:1) 0 0\nFrames 2").contains("sky"));
    let parsed = parsed("Screen 4 3\nSky \"c.png\"\nTrace\n");
    assert_eq!(parsed.files, ["c.png"]);
    let unread = rayfold_scene::parse("a.txt", b"Screen 4 3\nSky \"a.png\"\nTrace\n", &Limits::default());
    assert!(unread.diagnostics[0].message.contains("files are not read here"), "{:?}", unread.diagnostics);
}

#[test]
fn a_scene_with_a_hidden_sky_is_clear() {
    let hidden = script("Screen 4 3\nSky 1 2 3\nBackground none\nTrace\n");
    assert!(hidden.shots().all(|shot| shot.is_clear));
    assert_eq!(hidden.frame(0).unwrap().background, Background::NONE);
    assert_eq!(hidden.frame(0).unwrap().surroundings().color(), Some(DVec3::new(1.0, 2.0, 3.0)));
}

#[test]
fn a_sky_that_is_no_panorama_is_stretched_with_a_warning() {
    let warnings = |width: usize, height: usize| {
        let header = format!("#?RGBE\n\n-Y {height} +X {width}\n").into_bytes();
        let picture = [header, [1, 3, 5, 128].repeat(width * height)].concat();
        let library = Library::new(MemoryFiles::from([("a.hdr", picture)]));
        let text = b"Screen 4 3\nSky \"a.hdr\"\nTrace\n";
        let parsed = parse_with_files("a.txt", text, &Limits::default(), &library);
        assert!(parsed.script.is_some(), "{:?}", parsed.diagnostics);
        parsed.diagnostics.into_iter().map(|diagnostic| diagnostic.message).collect::<Vec<_>>()
    };
    for (width, height) in [(40, 20), (41, 20), (39, 20)] {
        assert!(warnings(width, height).is_empty(), "{width} x {height}");
    }
    for (width, height) in [(30, 20), (20, 20), (60, 20), (5, 1)] {
        let message = format!("`a.hdr` has {width} x {height} pixels, and is stretched around the scene");
        assert_eq!(warnings(width, height), [message]);
    }
}
