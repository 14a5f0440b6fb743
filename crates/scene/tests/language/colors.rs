//! Colours that are written as `#rrggbb`: where they stand, what they mean under each tone, and how they are written.

use glam::DVec3;
use rayfold_scene::{Light, Limits, Object, Scene, Script, parse};

fn script(text: &str) -> Script {
    let parsed = parse("a.txt", text.as_bytes(), &Limits::default());
    let shown: Vec<_> = parsed.diagnostics.iter().map(|d| d.render(false)).collect();
    parsed.script.unwrap_or_else(|| panic!("{text}\n{}", shown.join("\n")))
}

fn messages(text: &str) -> Vec<String> {
    parse("a.txt", text.as_bytes(), &Limits::default()).diagnostics.into_iter().map(|d| d.message).collect()
}

fn first(scene: &Scene) -> (DVec3, DVec3, DVec3) {
    let material = scene.objects[0].material();
    (material.ambient(), material.diffuse(), material.mirror())
}

/// Linear light of a level by the standard's formula, without its constants' rounding.
fn linear(level: u8) -> f64 {
    let share = f64::from(level) / 255.0;
    if share <= 0.040_45 { share / 12.92 } else { ((share + 0.055) / 1.055).powf(2.4) }
}

#[test]
fn a_colour_is_a_share_of_255_and_under_srgb_linear_light() {
    let text = "Screen 4 3\nBackground #ff8000 #000a0b\nIlight #102030 0 -1 0\nPlight #ffffff 1 2 3 .5\n\
                Sphere 1 0 0 -5 #010203 #0b0a80 #ff00ff\nTrace\nTone srgb\nTrace";
    let script = script(text);
    let levels = |of: [u8; 3], channel: fn(u8) -> f64| DVec3::from_array(of.map(channel));
    let plain = |level: u8| f64::from(level) / 255.0;
    for (frame, channel) in [(0, plain as fn(u8) -> f64), (1, linear)] {
        let scene = script.frame(frame).unwrap();
        let near = |found: DVec3, of: [u8; 3]| {
            let expected = levels(of, channel);
            assert!(found.distance(expected) < 1e-15, "{frame}: {found} {expected}");
        };
        let (low, high) = scene.background.colors();
        near(low, [255, 128, 0]);
        near(high.unwrap(), [0, 10, 11]);
        near(scene.lights[0].color(), [16, 32, 48]);
        near(scene.lights[1].color(), [255; 3]);
        let Light::Lamp(lamp) = &scene.lights[1] else { panic!("a lamp") };
        assert_eq!(lamp.radius(), 0.5);
        let (ambient, diffuse, mirror) = first(&scene);
        near(ambient, [1, 2, 3]);
        near(diffuse, [11, 10, 128]);
        near(mirror, [255, 0, 255]);
    }
}

#[test]
fn the_tone_is_that_of_the_trace_also_in_groups_materials_and_patterns() {
    let text = "Screen 4 3\nMaterial dark diffuse #404040\nMaterial tiles ambient #808080 checker 1 dark shine #ffffff 60 \
                glass #80ff80 1.5\nGroup balls\nSphere 1 0 0 -5 tiles\nSphere 1 0 0 -7 #808080 .1 .2 .3\nEnd\n\
                Use balls\nSphere 1 1 1 1 tiles\nTrace\nTone srgb\nTrace\nTone plain\nTrace";
    let script = script(text);
    for (frame, grey, dark) in
        [(0, 128.0 / 255.0, 64.0 / 255.0), (1, linear(128), linear(64)), (2, 128.0 / 255.0, 64.0 / 255.0)]
    {
        let scene = script.frame(frame).unwrap();
        assert_eq!(scene.objects.len(), 3);
        assert!(matches!(scene.objects[0], Object::Instance(_)));
        for object in scene.objects.iter() {
            assert!((object.material().ambient().x - grey).abs() < 1e-15, "{frame}");
        }
        for at in [0, 2] {
            let finish = scene.objects[at].material().finish().unwrap();
            assert!((finish.pattern.unwrap().other.diffuse().y - dark).abs() < 1e-15);
            assert!((finish.glass.unwrap().color().x - grey).abs() < 1e-15);
            assert_eq!((finish.shine.unwrap().color(), finish.glass.unwrap().ior()), (DVec3::ONE, 1.5));
        }
        assert_eq!(scene.objects[1].material().diffuse(), DVec3::new(0.1, 0.2, 0.3));
    }
}

#[test]
fn a_number_sign_elsewhere_begins_a_comment() {
    let same = |a: &str, b: &str| {
        let [a, b] = [a, b].map(|line| script(&format!("Screen 4 3\n{line}\nTrace")));
        assert_eq!(a, b);
    };
    same("Background .1 .2 .3 #ffffff", "Background .1 .2 .3");
    same("Background #102030 # 40 50 60", "Background #102030");
    same("Background #102030 #4050607", "Background #102030");
    same("Sphere 1 0 0 -5 .1 .1 .1 .2 .2 .2 #ffffff", "Sphere 1 0 0 -5 .1 .1 .1 .2 .2 .2");
    same("Sphere 1 0 0 -5 #010203 .2 .2 .2 #ffffff", "Sphere 1 0 0 -5 #010203 .2 .2 .2");
    same("Sphere 1,0,0,-5#010203#040506#070809#", "Sphere 1 0 0 -5 #010203 #040506 #070809");
    same("Plane 0 0 0 0 1 0 #ABCDEF 1 1 1", "Plane 0 0 0 0 1 0 #abcdef 1 1 1");
    for (text, message) in [
        ("Background #10203", "`Background` takes 3 or 6 numbers, found none"),
        ("Background .1 #102030", "`Background` takes 3 or 6 numbers, found 1"),
        ("Background #102030 1", "`Background` takes 3 or 6 numbers, found 4"),
        ("Ilight #102030", "`Ilight` takes 6 or 7 numbers, found 3"),
        ("Sphere 1 0 0 (1:#102030 2:3) 1 1 1 1 1 1", "the curve is not closed"),
        ("Material m diffuse #10203 ambient 1 1 1", "`diffuse` takes 3 numbers, found none"),
        ("Material m diffuse #102030 .5", "unknown material clause `.5`"),
        ("Material m shine #102030", "`shine` takes 4 numbers, found 3"),
    ] {
        let found = messages(&format!("Screen 4 3\n{text}\nTrace"));
        assert_eq!(found.first().map(String::as_str), Some(message), "{text}: {found:?}");
    }
}

#[test]
fn colours_stand_beside_curves_and_are_checked_at_once() {
    let text = "Screen 4 3\nMaterial m diffuse #ff0000 shine #ffffff (1:1 9:5)\n\
                Sphere (1:1 9:2) 0 0 -5 #102030 #405060\nSphere 1 1 1 1 m\nFrames 9\nTrace";
    let script = script(text);
    let Object::Sphere(sphere) = &script.frame(4).unwrap().objects[0] else { panic!("a sphere") };
    assert_eq!((sphere.radius(), sphere.material().ambient().x), (1.5, 16.0 / 255.0));
    assert_eq!(
        script.frame(4).unwrap().objects[1].material().finish().unwrap().shine.unwrap().exponent(),
        3.0
    );
    for (line, message) in [
        ("Sphere -1 0 0 -5 #102030 #405060", "the radius must not be negative"),
        ("Ilight #102030 0 0 0", "the light's direction must not be zero"),
        ("Material m glass #ffffff 0", "the index of refraction must be greater than zero"),
    ] {
        let found = messages(&format!("Screen 4 3\n{line}\nTrace"));
        assert_eq!(found.first().map(String::as_str), Some(message), "{line}: {found:?}");
    }
}

#[test]
fn colours_are_written_as_they_were() {
    let text = "Screen 4 3\nMaterial m ambient #010203 glass #ff00ff 1.5\nGroup g\nSphere 1 0 0 0 #0a0b0c 0 0 0\nEnd\n\
                Background #102030 #405060\nPlight #ffffff (1:0 3:1) 0 0\nSphere 1 2 3 4 m\n\
                Sphere 1 2 3 (1:0 2:1) #102030 #405060 #708090\nUse g\nFrames 3\nTrace\nTone srgb\nTrace";
    let script = script(text);
    let written = script.to_string();
    for part in
        ["#010203", "#ff00ff 1.5", "#0a0b0c 0 0 0", "#102030 #405060\n", "#ffffff (1:0 3:1)", "#708090"]
    {
        assert!(written.contains(part), "{part}: {written}");
    }
    let parsed = parse("b.txt", written.as_bytes(), &Limits::default());
    assert_eq!(parsed.script, Some(script.clone()), "{written}");
    assert_eq!(script.only(4).unwrap().frame(0), script.frame(4));
    // The scene of a frame is written with its numbers.
    let scene = script.frame(3).unwrap();
    let again = parse("c.txt", scene.to_string().as_bytes(), &Limits::default()).script.unwrap();
    assert_eq!(again.frame(0).unwrap().objects[0].material(), scene.objects[0].material());
}
