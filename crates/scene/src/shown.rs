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

/// Words of other tools, without hyphens, and what they are called here.
const SYNONYMS: [(&str, &str); 24] = [
    ("center", "centre"),
    ("middle", "centre"),
    ("ease", "smooth"),
    ("sine", "smooth"),
    ("easein", "in"),
    ("easeout", "out"),
    ("easeinout", "inout"),
    ("spring", "elastic"),
    ("hold", "step"),
    ("constant", "step"),
    ("loop", "cycle"),
    ("roughness", "rough"),
    ("color", "diffuse"),
    ("colour", "diffuse"),
    ("specular", "shine"),
    ("phong", "shine"),
    ("reflection", "mirror"),
    ("reflective", "mirror"),
    ("emission", "glow"),
    ("emissive", "glow"),
    ("transparent", "glass"),
    ("refraction", "glass"),
    ("texture", "image"),
    ("checkerboard", "checker"),
];

/// Returns the word that was probably meant: what it is called in other tools, one that begins with it, or one with a similar
/// spelling, in any letter case.
pub(crate) fn nearest<'a>(word: &str, words: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    // A longer word is no typo, and the distance takes quadratic time.
    if word.len() > 40 {
        return None;
    }
    let word = word.to_lowercase();
    let words: Vec<&str> = words.collect();
    let bare = word.replace(['-', '_'], "");
    let meant = SYNONYMS.iter().find(|(other, _)| *other == bare).map(|(_, meant)| *meant);
    let is_start = |known: &&&str| word.len() > 2 && known.to_lowercase().starts_with(&word);
    if let Some(known) =
        words.iter().find(|known| meant == Some(**known)).or_else(|| words.iter().find(is_start))
    {
        return Some(known);
    }
    let near = words.into_iter().map(|known| (strsim::osa_distance(&word, &known.to_lowercase()), known));
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
    fn words_of_other_tools_and_starts_are_known() {
        let modes = ["linear", "smooth", "in", "inout", "elastic"];
        let check = |word, near| assert_eq!(nearest(word, modes.into_iter()), near, "{word}");
        check("lin", Some("linear"));
        check("Ease-In", Some("in"));
        check("ease_in_out", Some("inout"));
        check("smoth", Some("smooth"));
        check("center", None);
        check("wobble", None);
    }

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
