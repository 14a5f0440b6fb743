//! Any bytes as a scene script.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rayfold_fuzz::check_places;
use rayfold_scene::{Code, Limits, parse};

fuzz_target!(|text: &[u8]| {
    // Small limits, so that the fuzzer reaches them.
    let limits = Limits { max_objects: 8, max_lights: 4, max_described: 20, ..Limits::default() };
    let parsed = parse("fuzzed.txt", text, &limits);
    let errors = parsed.diagnostics.iter().filter(|d| d.is_error()).count();
    assert_eq!(parsed.script.is_some(), errors == 0);
    assert!(parsed.diagnostics.len() <= 2 * (limits.max_described + 1));
    check_places(text, &parsed.diagnostics);
    if let Some(script) = parsed.script {
        assert!(script.frame_count() > 0);
        assert_eq!(script.frames().count(), script.frame_count());
        let written = script.to_string();
        let again = parse("written.txt", written.as_bytes(), &limits);
        let only_flat = again
            .diagnostics
            .iter()
            .all(|d| d.code == Code::DegenerateTriangle || d.code == Code::TooManyFaults);
        assert!(only_flat, "{written}\n{:?}", again.diagnostics);
        assert_eq!(again.script.as_ref(), Some(&script), "{written}");
        let scene = script.frame(script.frame_count() - 1).expect("there is a last frame");
        let alone =
            parse("scene.txt", scene.to_string().as_bytes(), &limits).script.expect("a scene is a script");
        assert_eq!(alone.frame(0), Some(scene));
    }
});
