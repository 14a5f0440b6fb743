//! The invariants of every diagnostic, whatever text it is about.

use rayfold_scene::Diagnostic;

/// Panics unless the diagnostics lie where they say, and can be shown and stored.
pub fn check_places(text: &[u8], diagnostics: &[Diagnostic]) {
    let valid = std::str::from_utf8(text).ok();
    let start = if text.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
    let mut last = 0;
    for diagnostic in diagnostics {
        let span = diagnostic.span.clone();
        assert!(span.start <= span.end && span.end <= text.len(), "{diagnostic:?}");
        assert!(last <= span.start, "not in order: {diagnostic:?}");
        last = span.start;
        let before = &text[..span.start];
        let line_start = before.iter().rposition(|&b| b == b'\n').map_or(start, |at| at + 1);
        assert_eq!(diagnostic.line, before.iter().filter(|&&b| b == b'\n').count() + 1, "{diagnostic:?}");
        assert!(!text[span.clone()].contains(&b'\n'), "{diagnostic:?}");
        if let Some(valid) = valid {
            assert!(valid.get(span.clone()).is_some(), "not on character boundaries: {diagnostic:?}");
            let column = valid[line_start.min(span.start)..span.start].chars().count() + 1;
            assert_eq!(diagnostic.column, column, "{diagnostic:?}");
        }
        let excerpt = &diagnostic.excerpt;
        assert!(excerpt.text.get(excerpt.marked.clone()).is_some(), "{diagnostic:?}");
        assert!(excerpt.text.len() < 10_000 && !excerpt.text.contains('\n'), "{diagnostic:?}");
        for color in [false, true] {
            assert!(!diagnostic.render(color).is_empty());
        }
        let stored = serde_json::to_string(diagnostic).expect("a diagnostic can be stored");
        assert_eq!(serde_json::from_str::<Diagnostic>(&stored).expect("and read again"), *diagnostic);
    }
}
