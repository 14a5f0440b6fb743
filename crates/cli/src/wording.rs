//! Numbers as people read them.

use std::fmt;
use std::time::Duration;

/// `1 frame`, `2 frames`.
pub(crate) fn number(count: u64, of: &str) -> String {
    format!("{count} {of}{}", if count == 1 { "" } else { "s" })
}

/// Bytes in the unit that leaves one to three digits before the point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Size(pub(crate) u64);

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            n @ 0..1000 => write!(f, "{}", number(n, "byte")),
            n @ 1000..1_000_000 => write!(f, "{:.1} kB", n as f64 / 1e3),
            n @ 1_000_000..1_000_000_000 => write!(f, "{:.1} MB", n as f64 / 1e6),
            n => write!(f, "{:.1} GB", n as f64 / 1e9),
        }
    }
}

/// How old something is, in the unit that leaves a small number: `3 minutes`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Age(pub(crate) Duration);

impl fmt::Display for Age {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (count, unit) = match self.0.as_secs() {
            seconds @ 0..120 => (seconds, "second"),
            seconds @ 120..7_200 => (seconds / 60, "minute"),
            seconds @ 7_200..172_800 => (seconds / 3_600, "hour"),
            seconds => (seconds / 86_400, "day"),
        };
        f.write_str(&number(count, unit))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_agree_with_their_nouns() {
        assert_eq!((number(1, "frame"), number(0, "frame")), ("1 frame".into(), "0 frames".into()));
    }

    #[test]
    fn ages_are_told_in_one_unit() {
        let ages =
            [1, 119, 120, 7_199, 7_200, 172_799, 172_800].map(|s| Age(Duration::from_secs(s)).to_string());
        assert_eq!(
            ages,
            ["1 second", "119 seconds", "2 minutes", "119 minutes", "2 hours", "47 hours", "2 days"]
        );
    }

    #[test]
    fn bytes_are_rounded() {
        assert_eq!(
            (Size(999).to_string(), Size(1_234_567).to_string()),
            ("999 bytes".into(), "1.2 MB".into())
        );
    }
}
