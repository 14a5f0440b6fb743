//! A line of a script as words and the bytes between them, so that one word can be replaced and
//! every other byte stays.
//!
//! Does not validate a line; the parser does. Invariants: the spans of a line lie within it, in order and without
//! overlap. [`Line::with`] changes nothing outside the spans that it is given.

use std::ops::Range;

use rayfold_scene::Command;

/// A line with its end: a line feed, with or without a carriage return, or nothing at the end of a text.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Line(Vec<u8>);

/// The positions of the words of a line, in bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Words {
    /// The command word.
    pub command: Range<usize>,
    /// The name of a group or material before the parameters.
    pub subject: Option<Range<usize>>,
    /// The parameters. A curve in brackets is one.
    pub parameters: Vec<Range<usize>>,
    /// The comment, from its sign to the end of the text.
    pub comment: Option<Range<usize>>,
}

impl Line {
    /// Splits a text into lines. Their concatenation is the text.
    pub fn split(text: &[u8]) -> Vec<Self> {
        text.split_inclusive(|&byte| byte == b'\n').map(|line| Self(line.to_vec())).collect()
    }

    /// Makes a line without an end; its document adds one.
    pub fn new(text: &str) -> Self {
        Self(text.into())
    }

    /// Returns all bytes of the line.
    pub fn bytes(&self) -> &[u8] {
        &self.0
    }

    /// Returns the text before the line end, with U+FFFD for bytes that are not UTF-8.
    pub fn text(&self) -> String {
        String::from_utf8_lossy(self.body()).into_owned()
    }

    /// Returns the line end: `\n`, `\r\n` or nothing.
    pub fn end(&self) -> &[u8] {
        &self.0[self.body().len()..]
    }

    /// Returns the bytes before the line end.
    fn body(&self) -> &[u8] {
        let line = self.0.strip_suffix(b"\n").unwrap_or(&self.0);
        line.strip_suffix(b"\r").unwrap_or(line)
    }

    /// Returns another text with the end of this line.
    #[must_use]
    pub fn with_text(&self, text: &str) -> Self {
        Self([text.as_bytes(), self.end()].concat())
    }

    /// Returns the same text with another end.
    #[must_use]
    pub fn with_end(&self, end: &[u8]) -> Self {
        Self([self.body(), end].concat())
    }

    /// Returns the command, if the first word is one.
    pub fn command(&self) -> Option<Command> {
        let body = self.body();
        let body = body.strip_prefix(b"\xef\xbb\xbf").unwrap_or(body);
        let start = body.iter().position(|&byte| !is_separator(byte))?;
        let word = &body[start..];
        let end = word.iter().position(|&byte| is_separator(byte) || matches!(byte, b'#' | b'('));
        Command::from_name(std::str::from_utf8(&word[..end.unwrap_or(word.len())]).ok()?)
    }

    /// Returns the positions of the words, or `None` for a line without a command.
    pub fn words(&self) -> Option<Words> {
        let body = self.body();
        let start = if body.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
        let comment = body.iter().position(|&byte| byte == b'#');
        let code = comment.unwrap_or(body.len());
        let mut words = Vec::new();
        let mut at = start;
        while at < code {
            if is_separator(body[at]) {
                at += 1;
                continue;
            }
            let from = at;
            if body[at] == b'(' {
                at = body[at..code].iter().position(|&byte| byte == b')').map_or(code, |end| at + end + 1);
            } else {
                while at < code && !is_separator(body[at]) && body[at] != b'(' {
                    at += 1;
                }
            }
            words.push(from..at);
        }
        let mut words = words.into_iter();
        let command = words.next()?;
        let has_subject = self.command().is_some_and(|command| command.form().subject.is_some());
        let subject = if has_subject { words.next() } else { None };
        let comment = comment.map(|at| at..body.len());
        Some(Words { command, subject, parameters: words.collect(), comment })
    }

    /// Returns a word; empty if it is not UTF-8.
    pub fn word(&self, word: &Range<usize>) -> &str {
        std::str::from_utf8(&self.0[word.clone()]).unwrap_or_default()
    }

    /// Returns the name of a group or material before the parameters.
    pub fn subject(&self) -> Option<&str> {
        Some(self.word(&self.words()?.subject?))
    }

    /// Returns the line with another name before the parameters, or `None` if it has none.
    #[must_use]
    pub fn with_subject(&self, name: &str) -> Option<Self> {
        let subject = self.words()?.subject?;
        Some(self.with(&[(subject, name.to_owned())]))
    }

    /// Returns the number of a word; `None` for a curve, a name, and anything else.
    pub fn number(&self, word: &Range<usize>) -> Option<f64> {
        self.word(word).parse().ok().filter(|number: &f64| number.is_finite())
    }

    /// Returns the name of the line, which is the comment after a command.
    pub fn name(&self) -> Option<String> {
        let comment = self.words()?.comment?;
        let name = String::from_utf8_lossy(&self.0[comment]).trim_start_matches('#').trim().to_owned();
        (!name.is_empty()).then_some(name)
    }

    /// Returns the line with another name; an empty one removes it. The rest of the line stays unchanged.
    #[must_use]
    pub fn named(&self, name: &str) -> Option<Self> {
        let words = self.words()?;
        let name: String = name.chars().filter(|c| !c.is_control()).collect();
        let name = name.trim().trim_start_matches('#').trim();
        let last = words.last().end;
        let body = self.body().len();
        Some(match (&words.comment, name) {
            (Some(_), "") => self.with(&[(last..body, String::new())]),
            (None, "") => self.clone(),
            (Some(comment), name) => self.with(&[(comment.clone(), format!("# {name}"))]),
            (None, name) => self.with(&[(body..body, format!("   # {name}"))]),
        })
    }

    /// Returns the line with numbers from parameter `first` on. If the line has fewer, they are added
    /// after its last word.
    #[must_use]
    pub fn with_numbers(&self, first: usize, numbers: &[f64]) -> Option<Self> {
        let words = self.words()?;
        if numbers.is_empty() {
            return Some(self.clone());
        }
        // Optional numbers between the last word and the first new one were omitted from the end: they are 0.
        let at = words.parameters.len().min(first)..first + numbers.len();
        let changes = at.filter_map(|at| {
            let value = at.checked_sub(first).and_then(|i| numbers.get(i)).copied().unwrap_or(0.0);
            let same = words.parameters.get(at).is_some_and(|word| self.number(word) == Some(value));
            (!same).then(|| (at, written(value)))
        });
        self.with_words(&changes.collect::<Vec<_>>())
    }

    /// Returns the line with other words for some parameters, given in order. Those beyond the last
    /// are added after it.
    #[must_use]
    pub fn with_words(&self, changes: &[(usize, String)]) -> Option<Self> {
        let words = self.words()?;
        let last = words.last().end;
        let changes: Vec<_> = changes
            .iter()
            .map(|(at, text)| match words.parameters.get(*at) {
                Some(word) => (word.clone(), text.clone()),
                None => (last..last, format!(" {text}")),
            })
            .collect();
        Some(self.with(&changes))
    }

    /// Returns the line without the parameters from `from` on.
    #[must_use]
    pub fn cut(&self, from: usize) -> Option<Self> {
        let words = self.words()?;
        let Some(first) = words.parameters.get(from) else { return Some(self.clone()) };
        let before = match from.checked_sub(1) {
            Some(before) => words.parameters[before].end,
            None => words.subject.as_ref().unwrap_or(&words.command).end,
        };
        debug_assert!(before <= first.start);
        Some(self.with(&[(before..words.last().end, String::new())]))
    }

    /// Returns the line with other bytes for some spans, given in order.
    fn with(&self, changes: &[(Range<usize>, String)]) -> Self {
        let mut bytes = Vec::with_capacity(self.0.len() + 16);
        let mut at = 0;
        for (span, text) in changes {
            bytes.extend_from_slice(&self.0[at..span.start]);
            bytes.extend_from_slice(text.as_bytes());
            at = span.end;
        }
        bytes.extend_from_slice(&self.0[at..]);
        Self(bytes)
    }
}

impl Words {
    /// Returns the last word before the comment.
    fn last(&self) -> &Range<usize> {
        self.parameters.last().or(self.subject.as_ref()).unwrap_or(&self.command)
    }
}

/// Returns the shortest decimal that parses to this number.
pub(crate) fn written(number: f64) -> String {
    let number = number + 0.0;
    if number == 0.0 || (1e-5..1e16).contains(&number.abs()) {
        number.to_string()
    } else {
        format!("{number:e}")
    }
}

fn is_separator(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | b',')
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(text: &str) -> Line {
        Line::split(text.as_bytes()).remove(0)
    }

    #[test]
    fn lines_put_together_are_the_text() {
        for text in ["", "\n", "a", "a\nb", "a\r\n\r\nb\r\n", "\u{feff}Trace\n", "\n\n\n"] {
            let lines = Line::split(text.as_bytes());
            assert_eq!(lines.iter().flat_map(|l| l.bytes()).copied().collect::<Vec<_>>(), text.as_bytes());
        }
        assert_eq!(Line::split(b"\xff\xfe\n")[0].bytes(), b"\xff\xfe\n");
    }

    #[test]
    fn the_command_is_the_first_word() {
        let lines = [
            "Trace",
            "\u{feff} trace,1",
            "\t, Sphere(1:1 9:2)",
            "# Trace",
            "",
            "Spere 1",
            "(Trace)",
            "Tr#ace",
            "1 Trace",
        ];
        for text in lines {
            let line = line(&format!("{text}\n"));
            let first = line.words().and_then(|words| {
                Command::from_name(std::str::from_utf8(&line.bytes()[words.command]).unwrap())
            });
            assert_eq!(line.command(), first, "{text}");
        }
        assert_eq!(line("\t, Sphere(1:1 9:2)").command(), Some(Command::Sphere));
    }

    #[test]
    fn a_number_is_exchanged_and_all_else_stays() {
        let sphere = line("  sphere\t1.50 , 0 1e0 0   .1 .1 .1 1 1 1  # a ball\r\n");
        let moved = sphere.with_numbers(1, &[2.0, 1.0, -0.25]).unwrap();
        assert_eq!(moved.bytes(), b"  sphere\t1.50 , 2 1e0 -0.25   .1 .1 .1 1 1 1  # a ball\r\n");
        assert_eq!(
            sphere.with_numbers(1, &[0.0, 1.0, 0.0]).unwrap(),
            sphere,
            "what is equal is not rewritten"
        );
    }

    #[test]
    fn what_was_left_out_is_added_behind_the_last_word() {
        let sphere = line("Sphere 1 0 0 0 0 0 0 1 1 1   # ball\n");
        let shiny = sphere.with_numbers(10, &[0.5, 0.5, 0.5]).unwrap();
        assert_eq!(shiny.text(), "Sphere 1 0 0 0 0 0 0 1 1 1 0.5 0.5 0.5   # ball");
        let last = sphere.with_numbers(12, &[0.5]).unwrap();
        assert_eq!(last.text(), "Sphere 1 0 0 0 0 0 0 1 1 1 0 0 0.5   # ball");
    }

    #[test]
    fn the_name_is_the_comment_at_the_end() {
        assert_eq!(line("Trace#x").name().as_deref(), Some("x"));
        assert_eq!(line("# no command").name(), None);
        let named = line("Trace\n").named(" a # b\n").unwrap();
        assert_eq!((named.text().as_str(), named.name().as_deref()), ("Trace   # a # b", Some("a # b")));
        assert_eq!(named.named("c").unwrap().text(), "Trace   # c");
        assert_eq!(named.named("").unwrap().text(), "Trace");
    }

    #[test]
    fn a_curve_is_one_word() {
        let sphere = line("Sphere (1:1 9:2)0 1 2 red # (");
        let words = sphere.words().unwrap();
        assert_eq!(words.parameters.len(), 5);
        assert_eq!(sphere.number(&words.parameters[0]), None);
        assert_eq!(sphere.with_numbers(1, &[7.0]).unwrap().text(), "Sphere (1:1 9:2)7 1 2 red # (");
    }

    #[test]
    fn a_name_before_the_numbers_is_none_of_them() {
        let table = line("Use table  1 (1:0 9:2) 3   # it\n");
        assert_eq!((table.subject(), table.words().unwrap().parameters.len()), (Some("table"), 3));
        assert_eq!(table.with_numbers(0, &[7.0]).unwrap().text(), "Use table  7 (1:0 9:2) 3   # it");
        assert_eq!(line("Use table#").with_numbers(0, &[1.0, 2.0, 3.0]).unwrap().text(), "Use table 1 2 3#");
        assert_eq!(table.cut(1).unwrap().text(), "Use table  1   # it");
        assert_eq!(table.cut(0).unwrap().text(), "Use table   # it");
        assert_eq!(line("Use").subject(), None);
    }

    #[test]
    fn numbers_are_written_as_they_read_back() {
        for number in [0.0, -0.0, 1.0, -2.5, 1e-7, 1e300, 0.1 + 0.2] {
            assert_eq!(written(number).parse::<f64>().unwrap(), number);
        }
        assert_eq!(written(-0.0), "0");
    }
}
