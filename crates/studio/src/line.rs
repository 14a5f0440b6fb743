//! A line of a script as words and the bytes between them, so that one word can be replaced and
//! every other byte stays.
//!
//! Does not validate a line; the parser does. Invariants: the spans of a line lie within it, in order and without
//! overlap. [`Line::with`] changes nothing outside the spans that it is given.

use std::ops::Range;

use rayfold_scene::{Command, color_levels};

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
    /// The parameters. A curve in brackets is one, and a colour such as `#ff8000` three with the same span.
    pub parameters: Vec<Range<usize>>,
    /// The words behind the surface of a mesh or a text, such as `smooth 40`.
    pub options: Option<Range<usize>>,
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
        let (word, rest) = word.split_at(end.unwrap_or(word.len()));
        let command = Command::from_name(std::str::from_utf8(word).ok()?)?;
        let first = rest.split(|&byte| is_separator(byte)).find(|word| !word.is_empty());
        Some(command.with_first_word(first.and_then(|word| std::str::from_utf8(word).ok())))
    }

    /// Returns the positions of the words, or `None` for a line without a command.
    pub fn words(&self) -> Option<Words> {
        let body = self.body();
        let start = if body.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
        let mut comment = None;
        let mut words = Vec::new();
        let mut at = start;
        // A `#` in quotes begins no comment.
        while at < body.len() {
            if is_separator(body[at]) {
                at += 1;
                continue;
            }
            let from = at;
            if body[at] == b'#' {
                if color_levels(&body[at..]).is_none() || !self.takes_color(&words) {
                    comment = Some(at);
                    break;
                }
                at += "#rrggbb".len();
                words.extend([from..at, from..at]);
            } else if body[at] == b'(' {
                let code =
                    body[at..].iter().position(|&byte| byte == b'#').map_or(body.len(), |end| at + end);
                at = body[at..code].iter().position(|&byte| byte == b')').map_or(code, |end| at + end + 1);
            } else {
                while at < body.len() && !is_separator(body[at]) && !matches!(body[at], b'(' | b'#') {
                    at = if body[at] == b'"' { behind_quotes(body, at) } else { at + 1 };
                }
            }
            words.push(from..at);
        }
        let mut words = words.into_iter();
        let command = words.next()?;
        let has_subject = self.command().is_some_and(|command| command.form().subject.is_some());
        let subject = if has_subject { words.next() } else { None };
        let comment = comment.map(|at| at..body.len());
        let mut parameters: Vec<_> = words.collect();
        let form = self.command().map(Command::form);
        let is_option = |word: &Range<usize>| form.is_some_and(|form| form.is_option(self.word(word)));
        let mut options = None;
        if let Some(first) = parameters.iter().position(is_option) {
            options = parameters.last().map(|last| parameters[first].start..last.end);
            parameters.truncate(first);
        }
        Some(Words { command, subject, parameters, options, comment })
    }

    /// Returns whether a colour such as `#ff8000` may follow these words, the first of which is the command.
    fn takes_color(&self, words: &[Range<usize>]) -> bool {
        let Some(command) = self.command() else { return false };
        let first = 1 + usize::from(command.form().subject.is_some());
        let parameters: Vec<_> = words.iter().skip(first).map(|word| self.word(word)).collect();
        words.len() >= first && command.takes_color(&parameters)
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

    /// Returns the number of a word; `None` for a curve, a name, a colour such as `#ff8000`, and anything else.
    pub fn number(&self, word: &Range<usize>) -> Option<f64> {
        self.word(word).parse().ok().filter(|number: &f64| number.is_finite())
    }

    /// Returns the number of a parameter, also that of a channel of a colour such as `#ff8000`: a share of 255.
    pub fn parameter(&self, words: &Words, at: usize) -> Option<f64> {
        let word = words.parameters.get(at)?;
        match color_levels(self.word(word).as_bytes()) {
            Some(levels) => Some(f64::from(levels[words.channel(at)]) / LEVELS),
            None => self.number(word),
        }
    }

    /// Returns whether a parameter is a channel of a colour such as `#ff8000`.
    pub fn is_level(&self, words: &Words, at: usize) -> bool {
        words.parameters.get(at).is_some_and(|word| color_levels(self.word(word).as_bytes()).is_some())
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
        let last = words.options.as_ref().unwrap_or(words.last()).end;
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
            let same = self.parameter(&words, at) == Some(value);
            (!same).then(|| (at, written(value)))
        });
        self.with_words(&changes.collect::<Vec<_>>())
    }

    /// Returns the line with other words for some parameters, given in order. Those beyond the last are added after it. A
    /// number that replaces a channel of a colour such as `#ff8000` is rounded to a level.
    #[must_use]
    pub fn with_words(&self, changes: &[(usize, String)]) -> Option<Self> {
        let words = self.words()?;
        let last = words.last().end;
        let mut spans = Vec::with_capacity(changes.len());
        let mut rest = changes.iter().peekable();
        while let Some((at, text)) = rest.next() {
            let Some(word) = words.parameters.get(*at) else {
                spans.push((last..last, format!(" {text}")));
                continue;
            };
            let Some(levels) = color_levels(self.word(word).as_bytes()) else {
                spans.push((word.clone(), text.clone()));
                continue;
            };
            let mut channels = levels.map(|level| format!("{level:02x}"));
            channels[words.channel(*at)] = level(text)?;
            while let Some((next, text)) = rest.next_if(|(next, _)| words.parameters.get(*next) == Some(word))
            {
                channels[words.channel(*next)] = level(text)?;
            }
            spans.push((word.clone(), format!("#{}", channels.concat())));
        }
        Some(self.with(&spans))
    }

    /// Returns the line without the parameters from `from` on.
    #[must_use]
    pub fn cut(&self, from: usize) -> Option<Self> {
        let count = self.words()?.parameters.len();
        if from < count { self.without(from..count) } else { Some(self.clone()) }
    }

    /// Returns the line without some of its parameters, of which there is one at least.
    #[must_use]
    pub fn without(&self, which: Range<usize>) -> Option<Self> {
        let words = self.words()?;
        let before = match which.start.checked_sub(1) {
            Some(before) => words.parameters.get(before)?.end,
            None => words.subject.as_ref().unwrap_or(&words.command).end,
        };
        let last = words.parameters.get(which.end.checked_sub(1)?)?.end;
        debug_assert!(before <= last);
        Some(self.with(&[(before..last, String::new())]))
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
    /// Returns the position of a parameter among those with the same span, which are the channels of a colour.
    fn channel(&self, at: usize) -> usize {
        self.parameters[..at].iter().rev().take_while(|before| **before == self.parameters[at]).count()
    }

    /// Returns the last word before the options and the comment.
    fn last(&self) -> &Range<usize> {
        self.parameters.last().or(self.subject.as_ref()).unwrap_or(&self.command)
    }
}

/// The largest level of a channel.
const LEVELS: f64 = 255.0;

/// Returns the two digits of the level that is nearest to a number from 0 to 1.
fn level(number: &str) -> Option<String> {
    let share: f64 = number.parse().ok()?;
    Some(format!("{:02x}", (LEVELS * share.clamp(0.0, 1.0)).round() as u8))
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

/// Returns the end of quotes that begin at `at`; that of the line if they are not closed.
fn behind_quotes(body: &[u8], at: usize) -> usize {
    let mut next = at + 1;
    while next < body.len() {
        match body[next] {
            b'"' => return next + 1,
            b'\\' => next += 2,
            _ => next += 1,
        }
    }
    body.len()
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
    fn a_text_keeps_its_words_and_its_options() {
        let text = line("Text \"a #1, (b) \\\"c\\\" left\" 1 .2 red centre font \"x y.ttf\"  # sign");
        let words = text.words().unwrap();
        assert_eq!(text.subject(), Some("\"a #1, (b) \\\"c\\\" left\""));
        let parameters: Vec<_> = words.parameters.iter().map(|word| text.word(word)).collect();
        assert_eq!(parameters, ["1", ".2", "red"]);
        assert_eq!(text.name().as_deref(), Some("sign"));
        let other = text.with_subject("\"d\"").unwrap().with_words(&[(1, "0".into())]).unwrap();
        assert_eq!(other.text(), "Text \"d\" 1 0 red centre font \"x y.ttf\"  # sign");
    }

    #[test]
    fn a_mesh_keeps_its_file_and_its_options() {
        let mesh = line("Mesh \"a #1, b.obj\" red smooth 40  # pot");
        let words = mesh.words().unwrap();
        assert_eq!(mesh.subject(), Some("\"a #1, b.obj\""));
        assert_eq!(words.parameters.iter().map(|word| mesh.word(word)).collect::<Vec<_>>(), ["red"]);
        assert_eq!(mesh.name().as_deref(), Some("pot"));
        assert_eq!(mesh.named("").unwrap().text(), "Mesh \"a #1, b.obj\" red smooth 40");
        assert_eq!(mesh.named("cup").unwrap().text(), "Mesh \"a #1, b.obj\" red smooth 40  # cup");
        let bare = mesh.cut(0).unwrap();
        assert_eq!(bare.text(), "Mesh \"a #1, b.obj\" smooth 40  # pot");
        let dressed = bare.with_words(&[(0, "blue".into())]).unwrap();
        assert_eq!(dressed.text(), "Mesh \"a #1, b.obj\" blue smooth 40  # pot");
        assert_eq!(line("Mesh \"a.obj\" flat").named("x").unwrap().text(), "Mesh \"a.obj\" flat   # x");
        assert_eq!(line("Mesh \"a.obj\" #ff8000 #ff8000 flat").words().unwrap().parameters.len(), 6);
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
    fn a_colour_by_its_digits_is_three_numbers_and_no_comment() {
        let ball = line("Sphere 1 0 0 0  #ff8000 #000000  # ball");
        let words = ball.words().unwrap();
        assert_eq!((words.parameters.len(), ball.name().as_deref()), (10, Some("ball")));
        let numbers: Vec<_> = (4..10).map(|at| ball.parameter(&words, at).unwrap()).collect();
        assert_eq!(numbers, [1.0, 128.0 / 255.0, 0.0, 0.0, 0.0, 0.0]);
        let green = ball.with_numbers(4, &[0.0, 1.0, 0.3]).unwrap();
        assert_eq!(green.text(), "Sphere 1 0 0 0  #00ff4d #000000  # ball");
        assert_eq!(ball.with_numbers(8, &[2.0]).unwrap().text(), "Sphere 1 0 0 0  #ff8000 #00ff00  # ball");
        assert_eq!(ball.with_numbers(4, &numbers).unwrap(), ball);
        assert_eq!(line("Sphere 1 0 0 0 red #ff8000").name().as_deref(), Some("ff8000"));
        let red = line("Material red diffuse #ff0000 shine #ffffff 60 # it");
        assert_eq!((red.words().unwrap().parameters.len(), red.name().as_deref()), (9, Some("it")));
        assert_eq!(line("Background .1 .2 .3 #ff8000").words().unwrap().parameters.len(), 3);
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
