//! Checks of the diagnostics of a script, word for word.

use expect_test::Expect;
use rayfold_scene::{Limits, parse};

pub(crate) fn check(script: impl AsRef<[u8]>, expect: Expect) {
    check_limited(script, Limits::default(), expect);
}

pub(crate) fn check_limited(script: impl AsRef<[u8]>, limits: Limits, expect: Expect) {
    let parsed = parse("a.txt", script.as_ref(), &limits);
    assert_eq!(parsed.script.is_some(), !parsed.diagnostics.iter().any(|d| d.is_error()));
    let shown: Vec<_> = parsed.diagnostics.iter().map(|d| d.render(false)).collect();
    expect.assert_eq(&shown.join("\n\n"));
}
