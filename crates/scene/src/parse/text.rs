//! Text to lines and words.

use std::ops::Range;

use crate::command::MAX_NUMBERS;
use crate::report::{BYTE_ORDER_MARK, Line};

/// The lines of a text without their ends and without the byte-order mark. The last one is empty when the text ends
/// with a line feed.
pub(super) fn lines(bytes: &[u8]) -> impl Iterator<Item = Line<'_>> {
    let mut offset = if bytes.starts_with(BYTE_ORDER_MARK) { BYTE_ORDER_MARK.len() } else { 0 };
    bytes[offset..].split(|&b| b == b'\n').enumerate().map(move |(i, whole)| {
        let line = Line { number: i + 1, offset, bytes: whole.strip_suffix(b"\r").unwrap_or(whole) };
        offset += whole.len() + 1;
        line
    })
}

/// The words of a line, as bytes of it: its command and the parameters, of which those beyond the most that any
/// command takes are only counted.
#[derive(Debug, PartialEq)]
pub(super) struct Words {
    pub(super) command: Range<usize>,
    parameters: [Range<usize>; MAX_NUMBERS],
    count: usize,
    /// End of the last word.
    end: usize,
}

impl Words {
    /// `None` for a line without a command.
    pub(super) fn of(line: &[u8]) -> Option<Self> {
        const NOWHERE: Range<usize> = 0..0;
        let mut at = 0;
        let mut next = || {
            while at < line.len() && is_separator(line[at]) {
                at += 1;
            }
            let start = at;
            while at < line.len() && !is_separator(line[at]) && line[at] != b'#' {
                at += 1;
            }
            (at > start).then_some(start..at)
        };
        let command = next()?;
        let mut words = Self { end: command.end, command, parameters: [NOWHERE; MAX_NUMBERS], count: 0 };
        while let Some(word) = next() {
            words.end = word.end;
            if let Some(slot) = words.parameters.get_mut(words.count) {
                *slot = word;
            }
            words.count += 1;
        }
        Some(words)
    }

    /// How many parameters there are.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// The parameters, without those that no command has.
    pub(super) fn parameters(&self) -> &[Range<usize>] {
        &self.parameters[..self.count.min(MAX_NUMBERS)]
    }

    /// From the first to the last of some parameters.
    pub(super) fn span(&self, parameters: Range<usize>) -> Range<usize> {
        self.parameters[parameters.start].start..self.parameters[parameters.end - 1].end
    }

    /// Behind the last word.
    pub(super) fn end(&self) -> Range<usize> {
        self.end..self.end
    }

    /// From parameter `first` to the last word.
    pub(super) fn rest(&self, first: usize) -> Range<usize> {
        self.parameters.get(first).map_or(self.end, |word| word.start)..self.end
    }
}

fn is_separator(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | b',')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_lose_their_ends_and_the_byte_order_mark() {
        let check = |text: &str, expect: &[(usize, &str)]| {
            let got: Vec<_> = lines(text.as_bytes()).map(|l| (l.offset, l.bytes)).collect();
            let expect: Vec<_> = expect.iter().map(|(offset, text)| (*offset, text.as_bytes())).collect();
            assert_eq!(got, expect, "{text:?}");
        };
        check("", &[(0, "")]);
        check("a\nb", &[(0, "a"), (2, "b")]);
        check("a\r\nb\r\n", &[(0, "a"), (3, "b"), (6, "")]);
        check("\u{feff}a\n\u{feff}b", &[(3, "a"), (5, "\u{feff}b")]);
        check("a\rb\r", &[(0, "a\rb")]);
    }

    #[test]
    fn words_are_what_blanks_tabs_commas_and_comments_leave() {
        let check = |line: &str, expect: &[&str]| {
            let words = Words::of(line.as_bytes());
            let got: Vec<_> = words
                .iter()
                .flat_map(|w| std::iter::once(&w.command).chain(w.parameters()))
                .map(|word| &line[word.clone()])
                .collect();
            assert_eq!(got, expect, "{line:?}");
        };
        check("", &[]);
        check(" \t,, # Trace", &[]);
        check("Trace", &["Trace"]);
        check("\tScreen 4,\t3 # small", &["Screen", "4", "3"]);
        check("Screen,4,,3,", &["Screen", "4", "3"]);
        check("Screen 4#3", &["Screen", "4"]);
        check("a\u{a0}b c", &["a\u{a0}b", "c"]);
    }

    #[test]
    fn surplus_words_are_counted() {
        let line = format!("Clear{}", " 1".repeat(100));
        let words = Words::of(line.as_bytes()).unwrap();
        assert_eq!((words.count(), words.parameters().len()), (100, MAX_NUMBERS));
        assert_eq!((words.rest(0), words.end()), (6..line.len(), line.len()..line.len()));
    }
}
