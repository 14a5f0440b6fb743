//! Parses a line of the text to a statement: its command, its numbers, and its names.

use std::ops::Range;
use std::str::Utf8Error;

use super::text::{Words, is_name, unquoted};
use super::{Parser, curve, number, wording};
use crate::command::{Command, Effect, MAX_NUMBERS};
use crate::form::{Quotes, Subject, Values, color_levels};
use crate::model::Tone;
use crate::report::{Fault, Line};
use crate::row::{Number, Row};

/// A command with valid numbers and names, as many as it takes.
pub(super) struct Statement<'a, 'w> {
    pub(super) line: Line<'a>,
    /// The text of the line, without bytes in the comment that are not UTF-8.
    pub(super) text: &'a str,
    pub(super) command: Command,
    /// The words without the name before the numbers.
    pub(super) words: &'w Words,
    /// The name before the numbers.
    pub(super) subject: Option<Range<usize>>,
    /// The values of the parameters; 0 for omitted ones and for curves.
    pub(super) values: &'w [f64; MAX_NUMBERS],
    /// The parameters, if one of them is a curve or a colour such as `#ff8000`.
    pub(super) row: Option<Row>,
    /// The name of a material in place of numbers.
    pub(super) surface: Option<Range<usize>>,
    /// Whether the word of the command's form replaces all numbers.
    pub(super) is_word: bool,
    /// The words after the surface of a mesh or a text.
    pub(super) options: Vec<Range<usize>>,
}

/// The parts of a line's parameters that are not plain numbers.
#[derive(Default)]
struct Parameters {
    row: Option<Row>,
    surface: Option<Range<usize>>,
    is_word: bool,
}

impl<'a> Statement<'a, '_> {
    /// Returns the place of the command.
    pub(super) fn place(&self) -> (Line<'a>, Range<usize>) {
        (self.line, self.words.command.clone())
    }

    /// Returns the count of numbers.
    pub(super) fn count(&self) -> usize {
        if self.is_word { 0 } else { self.words.count() - usize::from(self.surface.is_some()) }
    }

    /// Returns the numbers, if none is a curve.
    pub(super) fn still_row(&self) -> Row {
        Row::new(self.values[..self.count()].iter().copied().map(Number::Constant).collect())
    }

    /// Returns the name before the numbers.
    pub(super) fn name(&self) -> Option<&'a str> {
        self.subject.clone().map(|span| &self.text[span])
    }
}

/// Returns the first parameter that was probably written with a decimal comma: `1,5`, in a line that would have the
/// right number of numbers if only spaces separated them.
pub(super) fn decimal_comma(text: &str, command: Command, words: &Words) -> Option<Range<usize>> {
    // Most lines have no comma, which this test finds quickly.
    if !text.contains(',') {
        return None;
    }
    let form = command.form();
    // A comma in quotes is none of a number.
    if matches!(form.subject, Some(Subject::Quotes(_))) {
        return None;
    }
    let start = words.command.end;
    let parameters = text[start..].split('#').next().unwrap_or_default();
    let is_decimal = |part: &&str| {
        let digits = |part: &str| part.bytes().all(|b| b.is_ascii_digit()) && !part.is_empty();
        part.split_once(',')
            .is_some_and(|(whole, fraction)| digits(whole.trim_start_matches(['+', '-'])) && digits(fraction))
    };
    let parts = || parameters.split([' ', '\t']).filter(|part| !part.is_empty());
    let first = parts().find(is_decimal)?;
    let at = first.as_ptr().addr() - text.as_ptr().addr();
    let count = parts().filter(|part| *part != ",").count();
    let numbers = count.checked_sub(usize::from(form.subject.is_some()))?;
    form.takes(numbers).then_some(at..at + first.len())
}

impl<'a> Parser<'a> {
    /// Parses a line and applies its effect, unless it has a fault, which is reported.
    pub(super) fn line(&mut self, line: Line<'a>, words: &mut Words) {
        let mut values = [0.0; MAX_NUMBERS];
        if let Some(statement) = self.statement(line, words, &mut values) {
            self.read += 1;
            let errors_before = self.report.error_count();
            self.run(&statement);
            if self.report.error_count() == errors_before {
                self.doubt_line(&statement);
            }
        }
    }

    /// Returns `None` for a line without a command, and for one with a fault, which is reported.
    fn statement<'w>(
        &mut self,
        line: Line<'a>,
        words: &'w mut Words,
        values: &'w mut [f64; MAX_NUMBERS],
    ) -> Option<Statement<'a, 'w>> {
        let text = match self.whole {
            Some(whole) => &whole[line.offset..line.offset + line.bytes.len()],
            None => match std::str::from_utf8(line.bytes) {
                Ok(text) => text,
                Err(error) => self.not_utf8(line, error)?,
            },
        };
        if self.has_returns
            && let Some(at) = memchr::memchr(b'\r', text.as_bytes())
        {
            self.report.error(line, at..at + 1, wording::lone_carriage_return);
            self.expect_no_more();
            return None;
        }
        if !words.read(text.as_bytes()) {
            return None;
        }
        let name = &text[words.command.clone()];
        let Some(command) = Command::from_name(name) else {
            self.unknown_command(line, text, words);
            return None;
        };
        let first = words.parameters().first().map(|word| &text[word.clone()]);
        let command = command.with_first_word(first);
        let subject = match command.form().subject {
            None => None,
            Some(subject) => match self.subject(line, text, command, subject, words) {
                Some(name) => Some(name),
                None => {
                    self.faulty_line(line, text, command, None, words);
                    return None;
                }
            },
        };
        words.read_colors(text.as_bytes(), command.form());
        if matches!(command.effect(), Effect::Material) {
            let (row, surface, is_word, options) = (None, None, false, Vec::new());
            return Some(Statement {
                line,
                text,
                command,
                words,
                subject,
                values,
                row,
                surface,
                is_word,
                options,
            });
        }
        let form = command.form();
        let options = match form.options {
            [] => Vec::new(),
            _ => words.split_off(|word| form.is_option(&text[word])),
        };
        let behind_surface = form.surface().map_or(0, |first| first + 1);
        if !form.options.is_empty()
            && let Some(word) =
                words.parameters().iter().skip(behind_surface).find(|word| is_name(&text[(*word).clone()]))
        {
            self.report.error(line, word.clone(), || wording::unknown_option(command, &text[word.clone()]));
            self.faulty_line(line, text, command, subject, words);
            return None;
        }
        let Some(Parameters { row, surface, is_word }) = self.parameters(line, text, command, words, values)
        else {
            self.faulty_line(line, text, command, subject, words);
            return None;
        };
        if words.count() > command.form().arity().0
            && row.is_none()
            && let Some(comma) = decimal_comma(text, command, words)
        {
            self.report.warning(line, comma.clone(), || wording::decimal_comma(&text[comma]));
        }
        Some(Statement { line, text, command, words, subject, values, row, surface, is_word, options })
    }

    /// Returns the name before the numbers. If it is missing or malformed, returns `None` and reports that.
    fn subject(
        &mut self,
        line: Line<'a>,
        text: &str,
        command: Command,
        subject: Subject,
        words: &mut Words,
    ) -> Option<Range<usize>> {
        let names = match subject {
            Subject::Defines(names) | Subject::Refers(names) => names,
            Subject::Quotes(quotes) => return self.quotes(line, text, command, quotes, words),
        };
        let Some(name) = words.take_first() else {
            self.report.error(line, words.end(), || wording::no_name(command, names));
            return None;
        };
        if !is_name(&text[name.clone()]) {
            self.report.error(line, name.clone(), || wording::bad_name(&text[name], names));
            return None;
        }
        Some(name)
    }

    /// Returns the word in quotes before the numbers. If it is missing, returns `None` and reports that.
    fn quotes(
        &mut self,
        line: Line<'a>,
        text: &str,
        command: Command,
        quotes: Quotes,
        words: &mut Words,
    ) -> Option<Range<usize>> {
        let Some(word) = words.take_first() else {
            self.report.error(line, words.end(), || wording::no_quotes(command, quotes, None));
            return None;
        };
        if !text[word.clone()].starts_with('"') {
            let found = &text[word.clone()];
            self.report.error(line, word, || wording::no_quotes(command, quotes, Some(found)));
            return None;
        }
        if let Err(fault) = unquoted(&text[word.clone()]) {
            self.report.error(line, word, || wording::malformed_quote(fault));
            return None;
        }
        Some(word)
    }

    /// Records that there was a faulty line with this command, so that its absence is not reported.
    fn faulty_line(
        &mut self,
        line: Line<'a>,
        text: &'a str,
        command: Command,
        subject: Option<Range<usize>>,
        words: &Words,
    ) {
        self.expect_no_more_of(command);
        if command.form().surface().is_some() {
            for name in words.parameters().iter().map(|span| &text[span.clone()]).filter(|word| is_name(word))
            {
                self.materials.refer(name);
            }
        }
        self.define_faulty(line, text, command, subject);
    }

    /// Returns the readable start of the line if only its comment is faulty.
    fn not_utf8(&mut self, line: Line<'a>, error: Utf8Error) -> Option<&'a str> {
        let start = error.valid_up_to();
        let end = error.error_len().map_or(line.bytes.len(), |length| start + length);
        self.report.error(line, start..end, || Fault::not_utf8(line, start..end, "script"));
        let text = std::str::from_utf8(&line.bytes[..start]).ok().filter(|text| text.contains('#'));
        if text.is_none() {
            self.expect_no_more();
        }
        text
    }

    fn unknown_command(&mut self, line: Line<'a>, text: &'a str, words: &mut Words) {
        let name = &text[words.command.clone()];
        // This search takes longer than parsing a line.
        let nearest = if self.report.describes_next() { Command::nearest(name) } else { None };
        self.report.error(line, words.command.clone(), || wording::unknown_command(name, nearest));
        self.unknown += 1;
        if let Some(command) = nearest {
            let subject = words.take_first().filter(|span| is_name(&text[span.clone()]));
            self.faulty_line(line, text, command, subject, words);
        }
    }

    /// Parses the parameters, with their numbers into `values`, which are initially 0. If there is a fault in them or
    /// in their number, returns `None` and reports it.
    fn parameters(
        &mut self,
        line: Line<'a>,
        text: &str,
        command: Command,
        words: &Words,
        values: &mut [f64; MAX_NUMBERS],
    ) -> Option<Parameters> {
        let form = command.form();
        let mut parameters = Parameters::default();
        if let ([word], Some(known)) = (words.parameters(), form.word)
            && text[word.clone()].eq_ignore_ascii_case(known)
        {
            return Some(Parameters { is_word: true, ..parameters });
        }
        let mut others: Vec<(usize, Number)> = Vec::new();
        let (mut good, mut is_countable) = (true, true);
        let (_, most) = form.arity();
        let takes_words = matches!(form.fields.first().map(|field| field.values), Some(Values::OneOf(_)));
        for (i, span) in words.parameters()[..words.parameters().len().min(most)].iter().enumerate() {
            let word = &text[span.clone()];
            let result = match number::parse(word) {
                Ok(value) if !takes_words => {
                    values[i] = value;
                    continue;
                }
                result => result,
            };
            let (name, field) = form.number(i);
            if let Values::OneOf(words) = field.values {
                match words.iter().position(|known| known.eq_ignore_ascii_case(word)) {
                    Some(place) => values[i] = place as f64,
                    None => {
                        good = false;
                        self.report.error(line, span.clone(), || wording::no_such_word(word, words, field));
                    }
                }
                continue;
            }
            let Err(fault) = result else { continue };
            if word.starts_with('(') {
                match curve::parse(text, span.clone()) {
                    _ if !form.takes_curve(i) => {
                        good = false;
                        self.report.error(line, span.clone(), || wording::unwanted_curve(command, name));
                    }
                    Ok(Number::Constant(value)) => values[i] = value,
                    Ok(curve) => others.push((i, curve)),
                    Err((place, fault)) => {
                        good = false;
                        // Then the unclosed curve may contain the missing numbers.
                        is_countable &= fault != curve::CurveFault::Unclosed;
                        self.report.error(line, place, || wording::curve(fault, name));
                    }
                }
            } else if let Some(levels) = color_levels(word.as_bytes()) {
                let channel =
                    words.parameters()[..i].iter().rev().take_while(|before| *before == span).count();
                values[i] = Tone::Plain.light(levels[channel]);
                others.push((i, Number::Level(levels[channel])));
            } else if form.surface() == Some(i) && words.count() == i + 1 && is_name(word) {
                parameters.surface = Some(span.clone());
            } else {
                good = false;
                let is_surface = form.surface() == Some(i) && is_name(word);
                is_countable &= !is_surface;
                self.report.error(line, span.clone(), || wording::bad_number(fault, name, word, is_surface));
            }
        }
        let count = words.count();
        if count > most {
            good = false;
            self.report.error(line, words.rest(most), || {
                let first = words.parameters().get(most).map_or("", |span| &text[span.clone()]);
                wording::too_many(
                    command,
                    words,
                    first,
                    decimal_comma(text, command, words).map(|comma| &text[comma]),
                )
            });
        } else if parameters.surface.is_none() && is_countable && !form.takes(count) {
            good = false;
            self.report.error(line, words.end(), || {
                wording::too_few(
                    command,
                    words,
                    decimal_comma(text, command, words).map(|comma| &text[comma]),
                    wording::color_at(&text[words.comment()..]),
                )
            });
        }
        if !others.is_empty() {
            let count = count.min(most) - usize::from(parameters.surface.is_some());
            let mut numbers: Vec<_> = values[..count].iter().copied().map(Number::Constant).collect();
            others.into_iter().for_each(|(i, number)| numbers[i] = number);
            parameters.row = Some(Row::new(numbers));
        }
        good.then_some(parameters)
    }
}
