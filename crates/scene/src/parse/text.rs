//! Splits text into lines and words.

use std::ops::Range;

use crate::command::MAX_NUMBERS;
use crate::form::{Form, color_levels};
use crate::report::{BYTE_ORDER_MARK, Line};

/// Returns the lines of a text without their ends and without the byte-order mark. The last one is empty if the text
/// ends with a line feed.
pub(super) fn lines(bytes: &[u8]) -> impl Iterator<Item = Line<'_>> {
    let mut next = Some(if bytes.starts_with(BYTE_ORDER_MARK) { BYTE_ORDER_MARK.len() } else { 0 });
    (1..).map_while(move |number| {
        let offset = next?;
        let whole = match memchr::memchr(b'\n', &bytes[offset..]) {
            Some(length) => {
                next = Some(offset + length + 1);
                &bytes[offset..offset + length]
            }
            None => {
                next = None;
                &bytes[offset..]
            }
        };
        Some(Line { number, offset, bytes: whole.strip_suffix(b"\r").unwrap_or(whole) })
    })
}

/// The class of a byte within a line.
#[derive(Clone, Copy, PartialEq)]
enum Class {
    Word,
    Separator,
    Comment,
    /// A word on its own.
    Mark,
    /// The start of a word in quotes.
    Quote,
}

/// The classes of all bytes, so that a line is split with one lookup per byte.
const CLASSES: [Class; 256] = {
    let mut classes = [Class::Word; 256];
    classes[b' ' as usize] = Class::Separator;
    classes[b'\t' as usize] = Class::Separator;
    classes[b',' as usize] = Class::Separator;
    classes[b'#' as usize] = Class::Comment;
    classes[b'(' as usize] = Class::Mark;
    classes[b')' as usize] = Class::Mark;
    classes[b':' as usize] = Class::Mark;
    classes[b'"' as usize] = Class::Quote;
    classes
};

/// Returns the next word of `line` from byte `at` on, and moves `at` to its end.
#[inline]
pub(super) fn next_word(line: &[u8], at: &mut usize) -> Option<Range<usize>> {
    let behind = |start: usize, class: Class| {
        let mut bytes = line[start..].iter();
        start + bytes.position(|&b| CLASSES[usize::from(b)] != class).unwrap_or(line.len() - start)
    };
    let start = behind(*at, Class::Separator);
    let mut end = behind(start, Class::Word);
    if end < line.len() {
        match CLASSES[usize::from(line[end])] {
            Class::Mark if end == start => end += 1,
            Class::Quote => end = behind_quotes(line, end),
            Class::Mark | Class::Separator | Class::Comment | Class::Word => {}
        }
    }
    *at = end;
    (end > start).then_some(start..end)
}

/// Returns the end of a word with quotes from `at` on. Characters directly after the quotes belong to it, so that they
/// can be reported.
#[cold]
fn behind_quotes(line: &[u8], mut at: usize) -> usize {
    while at < line.len() {
        match CLASSES[usize::from(line[at])] {
            Class::Quote => match closing_quote(line, at) {
                Some(end) => at = end + 1,
                None => return line.len(),
            },
            Class::Word => at += 1,
            Class::Separator | Class::Comment | Class::Mark => break,
        }
    }
    at
}

/// Returns the place of the quote that closes the one at `at`.
fn closing_quote(line: &[u8], at: usize) -> Option<usize> {
    let mut next = at + 1;
    while next < line.len() {
        match line[next] {
            b'"' => return Some(next),
            b'\\' => next += 2,
            _ => next += 1,
        }
    }
    None
}

/// A fault of a word in quotes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum QuoteFault {
    /// The closing quote is missing.
    Open,
    /// Characters come directly before or after the quotes.
    Glued,
    /// A backslash before another character.
    Escape(char),
}

/// Returns the text of a word in quotes.
pub(super) fn unquoted(word: &str) -> Result<String, QuoteFault> {
    let Some(rest) = word.strip_prefix('"') else { return Err(QuoteFault::Glued) };
    let (mut text, mut chars) = (String::with_capacity(rest.len()), rest.chars());
    loop {
        match chars.next() {
            None => return Err(QuoteFault::Open),
            Some('"') if chars.as_str().is_empty() => return Ok(text),
            Some('"') => return Err(QuoteFault::Glued),
            Some('\\') => text.push(match chars.next() {
                None => return Err(QuoteFault::Open),
                Some(c @ ('"' | '\\')) => c,
                Some('n') => '\n',
                Some(c) => return Err(QuoteFault::Escape(c)),
            }),
            Some(c) => text.push(c),
        }
    }
}

/// Returns the text of a word in quotes, or `None` if it is malformed.
///
/// ```
/// assert_eq!(rayfold_scene::unquoted_word(r#""one\ntwo""#).as_deref(), Some("one\ntwo"));
/// assert_eq!(rayfold_scene::unquoted_word("one"), None);
/// ```
pub fn unquoted_word(word: &str) -> Option<String> {
    unquoted(word).ok()
}

/// Returns the next parameter: a word, or a curve from its opening bracket to the closing one. If that is missing,
/// the curve ends with the last word.
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

/// The parameters of a line from a byte on, up to a comment.
pub(super) struct Parameters<'a> {
    line: &'a [u8],
    pub(super) words: Vec<Range<usize>>,
    end: usize,
}

impl<'a> Parameters<'a> {
    pub(super) fn read(line: &'a [u8], at: usize) -> Self {
        let mut parameters = Self { line, words: Vec::new(), end: at };
        parameters.read_on();
        parameters
    }

    fn read_on(&mut self) {
        self.words.extend(std::iter::from_fn(|| next_parameter(self.line, &mut self.end)));
    }

    /// Continues after a colour such as `#ff8000`, if one comes next. The colour becomes three equal words.
    pub(super) fn read_color(&mut self) {
        let start = self.end;
        if color_levels(&self.line[start..]).is_some() {
            self.end = start + COLOR;
            self.words.extend([start..self.end, start..self.end, start..self.end]);
            self.read_on();
        }
    }

    /// Returns the comment at the end.
    pub(super) fn comment(&self) -> &'a [u8] {
        &self.line[self.end..]
    }
}

/// The number of bytes of a colour such as `#ff8000`.
const COLOR: usize = 7;

/// The words of a line, as ranges of its bytes: its command and its parameters. Parameters beyond the largest number
/// of any command are only counted. A curve is one parameter, and a colour such as `#ff8000` three with the same range.
///
/// One value is reused for all lines of a text, because it is too large to be passed by value.
#[derive(Debug)]
pub(super) struct Words {
    pub(super) command: Range<usize>,
    parameters: [Range<usize>; MAX_NUMBERS],
    count: usize,
    /// The end of the last word.
    end: usize,
    /// The start of the comment, or the end of the line.
    comment: usize,
}

impl Words {
    const NOWHERE: Range<usize> = 0..0;

    /// Makes the words of an empty line.
    pub(super) const fn new() -> Self {
        Self {
            command: Self::NOWHERE,
            parameters: [Self::NOWHERE; MAX_NUMBERS],
            count: 0,
            end: 0,
            comment: 0,
        }
    }

    /// Splits another line. Returns whether it has a command.
    pub(super) fn read(&mut self, line: &[u8]) -> bool {
        self.count = 0;
        let mut at = 0;
        let command = next_word(line, &mut at);
        let is_there = command.is_some();
        self.command = command.unwrap_or(Self::NOWHERE);
        self.end = self.command.end;
        self.read_on(line, at);
        is_there
    }

    fn read_on(&mut self, line: &[u8], mut at: usize) {
        while let Some(word) = next_parameter(line, &mut at) {
            self.push(word);
        }
        self.comment = at;
    }

    fn push(&mut self, word: Range<usize>) {
        self.end = word.end;
        if let Some(slot) = self.parameters.get_mut(self.count) {
            *slot = word;
        }
        self.count += 1;
    }

    /// Continues after colours such as `#ff8000`, if the command accepts them. A `#` elsewhere begins a comment.
    pub(super) fn read_colors(&mut self, line: &[u8], form: &Form) {
        let mut is_behind_color = false;
        while self.comment < line.len()
            && form.takes_color(self.count, is_behind_color)
            && color_levels(&line[self.comment..]).is_some()
        {
            let start = self.comment;
            (0..3).for_each(|_| self.push(start..start + COLOR));
            self.read_on(line, start + COLOR);
            is_behind_color = self.end == start + COLOR;
        }
    }

    /// Returns the start of the comment, or the end of the line.
    pub(super) fn comment(&self) -> usize {
        self.comment
    }

    /// Returns the number of parameters.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// Returns the parameters, without those beyond the largest number of any command.
    pub(super) fn parameters(&self) -> &[Range<usize>] {
        &self.parameters[..self.count.min(MAX_NUMBERS)]
    }

    /// Removes and returns the first parameter.
    pub(super) fn take_first(&mut self) -> Option<Range<usize>> {
        let first = self.parameters().first()?.clone();
        self.parameters.rotate_left(1);
        self.count -= 1;
        Some(first)
    }

    /// Removes and returns the parameters from the first one on for which `is_first` holds.
    pub(super) fn split_off(&mut self, is_first: impl Fn(Range<usize>) -> bool) -> Vec<Range<usize>> {
        let Some(first) = self.parameters().iter().position(|word| is_first(word.clone())) else {
            return Vec::new();
        };
        let rest = self.parameters()[first..].to_vec();
        self.count = first;
        if let Some(last) = first.checked_sub(1) {
            self.end = self.parameters[last].end;
        }
        rest
    }

    /// Returns the range from the first to the last of some parameters, as far as they exist.
    pub(super) fn span(&self, parameters: Range<usize>) -> Range<usize> {
        if parameters.start >= self.count {
            return Self::NOWHERE;
        }
        let last = parameters.end.min(self.count).max(parameters.start + 1) - 1;
        self.parameters[parameters.start].start..self.parameters[last].end
    }

    /// Returns the empty range after the last word.
    pub(super) fn end(&self) -> Range<usize> {
        self.end..self.end
    }

    /// Returns the range from parameter `first` to the last word.
    pub(super) fn rest(&self, first: usize) -> Range<usize> {
        self.parameters().get(first).map_or(self.end, |word| word.start)..self.end
    }
}

/// Returns whether a word can be the name of a material or a group.
pub fn is_name(word: &str) -> bool {
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
            let mut words = Words::new();
            let command = words.read(line.as_bytes()).then_some(&words.command);
            let got: Vec<_> =
                command.into_iter().chain(words.parameters()).map(|word| &line[word.clone()]).collect();
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
        check(r#"Mesh "a b, #1.obj" x # c"#, &["Mesh", r#""a b, #1.obj""#, "x"]);
        check(r#"Mesh "a\"b" c"d e"f"#, &["Mesh", r#""a\"b""#, r#"c"d e"f"#]);
        check(r#"Mesh "open # x"#, &["Mesh", r#""open # x"#]);
        check(r##"Mesh "a#b" # c"##, &["Mesh", r##""a#b""##]);
    }

    #[test]
    fn surplus_words_are_counted() {
        let line = format!("Clear{}", " 1".repeat(100));
        let mut words = Words::new();
        assert!(words.read(line.as_bytes()));
        assert_eq!((words.count(), words.parameters().len()), (100, MAX_NUMBERS));
        assert_eq!((words.rest(0), words.end()), (6..line.len(), line.len()..line.len()));
    }

    #[test]
    fn nothing_is_left_of_the_line_before() {
        let mut words = Words::new();
        assert!(words.read(b"Sphere 1 2 3"));
        assert!(words.read(b"Trace"));
        assert_eq!((words.count(), words.parameters().len(), words.end()), (0, 0, 5..5));
        assert_eq!(words.span(0..2), 0..0);
        assert!(!words.read(b"  # nothing"));
    }

    #[test]
    fn words_in_quotes_have_three_escapes() {
        assert_eq!(unquoted(r#""a\"b\\c\nd""#).as_deref(), Ok("a\"b\\c\nd"));
        assert_eq!(unquoted(r#""ü #,()""#).as_deref(), Ok("ü #,()"));
        for (word, fault) in [
            (r#""a"#, QuoteFault::Open),
            (r#""a\""#, QuoteFault::Open),
            (r#""a"b"#, QuoteFault::Glued),
            (r#"a"b""#, QuoteFault::Glued),
            (r#""a""b""#, QuoteFault::Glued),
            (r#""a\tb""#, QuoteFault::Escape('t')),
        ] {
            assert_eq!(unquoted(word), Err(fault), "{word}");
        }
    }
}
