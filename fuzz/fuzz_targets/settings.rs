//! Any bytes as an `animation.json`.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rayfold_fuzz::check_places;
use rayfold_scene::parse_settings;

fuzz_target!(|text: &[u8]| {
    let parsed = parse_settings("fuzzed.json", text);
    assert_eq!(parsed.settings.is_some(), parsed.diagnostics.is_empty());
    assert!(parsed.diagnostics.iter().all(|d| d.is_error()));
    check_places(text, &parsed.diagnostics);
    if let Some(settings) = parsed.settings {
        let written = serde_json::to_string(&settings).expect("settings can be written");
        assert_eq!(parse_settings("written.json", written.as_bytes()).settings, Some(settings));
    }
});
