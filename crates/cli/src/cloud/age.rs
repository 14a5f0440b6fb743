//! The age of something in a bucket, as text for people.

use std::fmt;
use std::time::Duration;

use crate::wording::number;

/// An age in the unit that leaves a small number: `3 minutes`.
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
    fn ages_are_shown_in_one_unit() {
        let ages =
            [1, 119, 120, 7_199, 7_200, 172_799, 172_800].map(|s| Age(Duration::from_secs(s)).to_string());
        assert_eq!(
            ages,
            ["1 second", "119 seconds", "2 minutes", "119 minutes", "2 hours", "47 hours", "2 days"]
        );
    }
}
