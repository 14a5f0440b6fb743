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

/// What a byte is to the words of a line.
#[derive(Clone, Copy, PartialEq)]
enum Class {
    Word,
    Separator,
    Comment,
    /// A word of its own.
    Mark,
}

/// Of all bytes, so that a line is read with one look at each.
const CLASSES: [Class; 256] = {
    let mut classes = [Class::Word; 256];
    classes[b' ' as usize] = Class::Separator;
    classes[b'\t' as usize] = Class::Separator;
    classes[b',' as usize] = Class::Separator;
    classes[b'#' as usize] = Class::Comment;
    classes[b'(' as usize] = Class::Mark;
    classes[b')' as usize] = Class::Mark;
    classes[b':' as usize] = Class::Mark;
    classes
};

/// The next word of `line` from byte `at` on; `at` comes to stand behind it.
#[inline]
pub(super) fn next_word(line: &[u8], at: &mut usize) -> Option<Range<usize>> {
    let mut end = *at;
    while end < line.len() && CLASSES[usize::from(line[end])] == Class::Separator {
        end += 1;
    }
    let start = end;
    while end < line.len() && CLASSES[usize::from(line[end])] == Class::Word {
        end += 1;
    }
    if end == start && end < line.len() && CLASSES[usize::from(line[end])] == Class::Mark {
        end += 1;
    }
    *at = end;
    (end > start).then_some(start..end)
}

/// The next parameter: a word, or a curve from its opening bracket to the closing one or, where that lacks, the end of
/// the last word.
#[inline]
fn next_parameter(line: &[u8], at: &mut usize) -> Option<Range<usize>> {
    let first = next_word(line, at)?;
    if line[first.start] != b'(' {
        return Some(first);
    }
    let mut end = first.end;
    while let Some(word) = next_word(line, at) {
        end = word.end;
        if line[word.start] == b')' {
            break;
        }
    }
    Some(first.start..end)
}

/// All parameters of a line behind byte `at`.
pub(super) fn parameters(line: &[u8], mut at: usize) -> Vec<Range<usize>> {
    std::iter::from_fn(|| next_parameter(line, &mut at)).collect()
}

/// The words of a line, as bytes of it: its command and the parameters, of which those beyond the most that any
/// command takes are only counted. A curve is one parameter.
#[derive(Clone, Debug, PartialEq)]
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
        let command = next_word(line, &mut at)?;
        let mut words = Self { end: command.end, command, parameters: [NOWHERE; MAX_NUMBERS], count: 0 };
        while let Some(word) = next_parameter(line, &mut at) {
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

    /// The first parameter, which then is one no more.
    pub(super) fn take_first(&mut self) -> Option<Range<usize>> {
        let first = self.parameters().first()?.clone();
        self.parameters.rotate_left(1);
        self.count -= 1;
        Some(first)
    }

    /// From the first to the last of some parameters, of those that are there.
    pub(super) fn span(&self, parameters: Range<usize>) -> Range<usize> {
        let last = parameters.end.min(self.count).max(parameters.start + 1) - 1;
        self.parameters[parameters.start].start..self.parameters[last].end
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

/// Whether it can be the name of a material or a group.
pub(super) fn is_name(word: &str) -> bool {
    word.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
        && word.bytes().all(|b| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'-'))
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
        check("Sphere(1:2 3:4)5", &["Sphere", "(1:2 3:4)", "5"]);
        check("a ( 1:2#)", &["a", "( 1:2"]);
        check("a)b:c", &["a", ")", "b", ":", "c"]);
        check("a (1 (2) 3", &["a", "(1 (2)", "3"]);
    }

    #[test]
    fn surplus_words_are_counted() {
        let line = format!("Clear{}", " 1".repeat(100));
        let words = Words::of(line.as_bytes()).unwrap();
        assert_eq!((words.count(), words.parameters().len()), (100, MAX_NUMBERS));
        assert_eq!((words.rest(0), words.end()), (6..line.len(), line.len()..line.len()));
    }
}
