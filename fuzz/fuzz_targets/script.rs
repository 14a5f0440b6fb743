//! Any bytes as a scene script.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rayfold_fuzz::check_places;
use rayfold_scene::{Code, Limits, Object, parse};

/// Frames that are made of a script that has more.
const MOST_FRAMES: usize = 8;

fuzz_target!(|text: &[u8]| {
    // Small limits, so that the fuzzer reaches them.
    let limits = Limits {
        max_objects: 8,
        max_lights: 4,
        max_frames: Some(1000),
        max_described: 20,
        ..Limits::default()
    };
    let parsed = parse("fuzzed.txt", text, &limits);
    let errors = parsed.diagnostics.iter().filter(|d| d.is_error()).count();
    assert_eq!(parsed.script.is_some(), errors == 0);
    assert!(parsed.diagnostics.len() <= 2 * (limits.max_described + 1));
    check_places(text, &parsed.diagnostics);
    let Some(script) = parsed.script else { return };
    let count = script.frame_count();
    assert!(count > 0 && script.frame(count).is_none());
    assert_eq!(script.shots().map(|shot| shot.frame_count).sum::<usize>(), count);
    let written = script.to_string();
    let again = parse("written.txt", written.as_bytes(), &limits);
    let only_doubts = again.diagnostics.iter().all(|d| {
        matches!(d.code, Code::DegenerateTriangle | Code::SquashedImage | Code::Unused | Code::TooManyFaults)
    });
    assert!(only_doubts, "{written}\n{:?}", again.diagnostics);
    assert_eq!(again.script.as_ref(), Some(&script), "{written}");
    for k in (0..count.min(MOST_FRAMES)).chain([count - 1]) {
        let scene = script.frame(k).expect("a frame that is counted is there");
        let number = script.frame_number(k).expect("it has a number");
        let half = 0.5 * scene.shutter.open();
        for time in [number - half, number + half] {
            let moment = script.frame_at(k, time).expect("it is there at any time");
            assert!(moment.is_ok(), "{written}\n{time}: {moment:?}");
        }
        let only = script.only(k).expect("it can be had alone");
        let alone = parse("only.txt", only.to_string().as_bytes(), &limits).script;
        assert_eq!(alone.as_ref(), Some(&only), "{only}");
        assert_eq!(only.frame(0).as_ref(), Some(&scene), "{only}");
        // Turned objects are written as angles, which round.
        if !scene.objects.iter().any(|object| matches!(object, Object::Instance(_))) {
            let alone = parse("scene.txt", scene.to_string().as_bytes(), &limits).script;
            assert_eq!(alone.expect("a scene is a script").frame(0), Some(scene));
        }
    }
});
