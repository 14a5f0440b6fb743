//! Formatting of text excerpts and counts for messages.

/// Formats an excerpt for a message: in quotes, short, and without invisible characters.
pub(crate) fn quoted(text: &str) -> String {
    const LONGEST: usize = 40;
    let end = text.char_indices().nth(LONGEST).map_or(text.len(), |(end, _)| end);
    let more = if end < text.len() { "…" } else { "" };
    format!("`{}{more}`", visible(&text[..end]))
}

/// Escapes control characters and other invisible characters.
pub(crate) fn visible(text: &str) -> String {
    let mut visible = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '\'' | '"' | '\\' => visible.push(c),
            _ => visible.extend(c.escape_debug()),
        }
    }
    visible
}

/// Formats a count with separators: 64,000,000.
pub(crate) fn grouped(count: u64) -> String {
    let digits = count.to_string();
    let mut grouped = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    grouped
}

/// Returns the word that was probably meant: one with a similar spelling, in any letter case.
pub(crate) fn nearest<'a>(word: &str, words: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    // A longer word is no typo, and the distance takes quadratic time.
    if word.len() > 40 {
        return None;
    }
    let word = word.to_lowercase();
    let near = words.map(|known| (strsim::osa_distance(&word, &known.to_lowercase()), known));
    near.min_by_key(|(distance, _)| *distance)
        .filter(|(distance, known)| {
            *distance <= known.len().div_ceil(3).min(word.chars().count().saturating_sub(1))
        })
        .map(|(_, known)| known)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_seen_is_escaped() {
        assert_eq!(quoted("a\u{feff}b\u{1b}[31m\"\\"), r#"`a\u{feff}b\u{1b}[31m"\`"#);
        assert_eq!(quoted(&"ä".repeat(41)), format!("`{}…`", "ä".repeat(40)));
    }

    #[test]
    fn counts_are_grouped() {
        assert_eq!([0, 999, 1000, 64_000_000].map(grouped), ["0", "999", "1,000", "64,000,000"]);
    }
}
