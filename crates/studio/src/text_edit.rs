//! Changes of a text by the line numbers of a text editor, converted to splices of a document's lines.
//!
//! An editor shows an empty last line after a line end at the end of a text, and one empty line for an empty text. A
//! document has neither. Invariant: a line whose text stays the same keeps its bytes, and a line that replaces another
//! keeps its line end.

use serde::Deserialize;

use crate::document::Splice;
use crate::line::Line;

/// A replacement of some lines of an editor by others.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct TextChange {
    /// The index of the first line, from 0.
    pub(crate) at: usize,
    /// The number of removed lines, at least 1.
    pub(crate) removed: usize,
    /// The texts of the inserted lines, at least one.
    pub(crate) lines: Vec<String>,
}

/// Returns whether the last line has a line end, after which an editor shows an empty line.
pub(crate) fn ends(lines: &[Line]) -> bool {
    lines.last().is_none_or(|line| !line.end().is_empty())
}

/// Returns the splice of a change, or `None` if these lines do not include the changed ones.
pub(crate) fn splice(lines: &[Line], change: &TextChange) -> Option<Splice> {
    let count = lines.len() + usize::from(ends(lines));
    let end = change.at.checked_add(change.removed).filter(|&end| change.removed > 0 && end <= count)?;
    let texts = &change.lines;
    if texts.is_empty() || texts.iter().any(|text| text.contains('\n')) {
        return None;
    }
    let old = &lines[change.at..end.min(lines.len())];
    let text = |at: usize| old.get(at).map_or_else(String::new, Line::text);
    let most = change.removed.min(texts.len());
    let same = (0..most).take_while(|&i| text(i) == texts[i]).count();
    let rest = (1..=most - same).take_while(|&i| text(change.removed - i) == texts[texts.len() - i]).count();
    let usual: &[u8] = if lines.first().is_some_and(|line| line.end() == b"\r\n") { b"\r\n" } else { b"\n" };
    let mut inserted = Vec::with_capacity(texts.len());
    for (i, new) in texts.iter().enumerate() {
        let from = if i < same {
            old.get(i)
        } else if i + rest >= texts.len() {
            old.get(change.removed + i - texts.len())
        } else {
            // Of the changed lines, each takes the end of the one that it replaces.
            old.get(i).filter(|_| i + rest < change.removed)
        };
        let is_last = end == count && i + 1 == texts.len();
        if is_last && new.is_empty() {
            break;
        }
        let end = match from.map(Line::end) {
            _ if is_last => b"",
            Some(end) if !end.is_empty() => end,
            _ => usual,
        };
        let kept = from.filter(|line| line.text() == *new).cloned();
        inserted.push(kept.unwrap_or_else(|| Line::new(new)).with_end(end));
    }
    // Lines that stay are no part of the change.
    let first = old.iter().zip(&inserted).take_while(|(a, b)| a == b).count();
    let (old, mut inserted) = (&old[first..], inserted.split_off(first));
    let last = old.iter().rev().zip(inserted.iter().rev()).take_while(|(a, b)| a == b).count();
    inserted.truncate(inserted.len() - last);
    Some(Splice { at: change.at + first, removed: old.len() - last, inserted })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use proptest::test_runner::{Config, TestRunner};

    use super::*;
    use crate::document::Document;

    fn change(at: usize, removed: usize, lines: &[&str]) -> TextChange {
        TextChange { at, removed, lines: lines.iter().map(|&line| line.into()).collect() }
    }

    fn check(text: &[u8], of: TextChange, expected: &[u8]) {
        let mut document = Document::new(text);
        let splice = splice(document.lines(), &of).unwrap();
        document.apply_exactly(splice, None);
        assert_eq!(document.bytes(), expected, "{:?}", String::from_utf8_lossy(&document.bytes()));
        document.undo(&mut 10.0);
        assert_eq!(document.bytes(), text);
    }

    #[test]
    fn lines_keep_their_bytes_and_ends() {
        check(b"", change(0, 1, &["a"]), b"a");
        check(b"", change(0, 1, &["a", ""]), b"a\n");
        check(b"a\n", change(0, 2, &[""]), b"");
        check(b"a\n", change(1, 1, &["b"]), b"a\nb");
        check(b"a\nb", change(0, 2, &["a"]), b"a");
        check(b"a\nb", change(1, 1, &["b", ""]), b"a\nb\n");
        check(b"a\r\nb\n", change(0, 1, &["a", "c"]), b"a\r\nc\r\nb\n");
        check(b"a\r\nb\nc", change(0, 2, &["x", "b"]), b"x\r\nb\nc");
        check(
            b"a\xff\r\nb\xfe\nc",
            change(0, 3, &["a\u{fffd}", "new", "b\u{fffd}", "c"]),
            b"a\xff\r\nnew\r\nb\xfe\nc",
        );
    }

    #[test]
    fn a_change_of_other_lines_is_refused() {
        let lines = Line::split(b"a\nb");
        for of in [change(2, 1, &["x"]), change(0, 0, &["x"]), change(0, 1, &[]), change(0, 1, &["x\ny"])] {
            assert_eq!(splice(&lines, &of), None);
        }
        assert_eq!(splice(&lines, &change(1, usize::MAX, &["x"])), None);
    }

    /// The document has the text that an editor has after the same changes.
    #[test]
    fn a_document_follows_an_editor() {
        let line = "[a-b\\xff]{0,2}(\n|\r\n)";
        let bytes = (prop::collection::vec(line, 0..6), "[a-b]{0,1}")
            .prop_map(|(lines, last)| lines.concat() + &last);
        let edits =
            prop::collection::vec((0..8usize, 0..4usize, prop::collection::vec("[a-c]{0,2}", 1..4)), 1..20);
        TestRunner::new(Config::default())
            .run(&(bytes, edits), |(text, edits)| {
                let mut document = Document::new(text.as_bytes());
                let shown = |document: &Document| {
                    let mut texts: Vec<_> = document.lines().iter().map(Line::text).collect();
                    texts.extend(ends(document.lines()).then(String::new));
                    texts
                };
                let mut editor = shown(&document);
                for (at, removed, lines) in edits {
                    let at = at.min(editor.len() - 1);
                    let removed = (removed + 1).min(editor.len() - at);
                    let of = TextChange { at, removed, lines: lines.clone() };
                    let splice = splice(document.lines(), &of).unwrap();
                    document.apply_exactly(splice, None);
                    editor.splice(at..at + removed, lines);
                    prop_assert_eq!(&shown(&document), &editor);
                }
                while document.can_undo() {
                    document.undo(&mut 10.0);
                }
                prop_assert_eq!(document.bytes(), text.as_bytes());
                Ok(())
            })
            .unwrap();
    }
}
