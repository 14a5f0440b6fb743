//! Formats numbers for people.

use std::fmt;

/// Returns `1 frame` or `2 frames`.
pub(crate) fn number(count: u64, of: &str) -> String {
    format!("{count} {of}{}", if count == 1 { "" } else { "s" })
}

/// Formats bytes in the unit that leaves one to three digits before the point.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_agree_with_their_nouns() {
        assert_eq!((number(1, "frame"), number(0, "frame")), ("1 frame".into(), "0 frames".into()));
    }

    #[test]
    fn bytes_are_rounded() {
        assert_eq!(
            (Size(999).to_string(), Size(1_234_567).to_string()),
            ("999 bytes".into(), "1.2 MB".into())
        );
    }
}
