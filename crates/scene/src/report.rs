//! A collector of diagnostics, which places them in the text and bounds their number.
//!
//! Knows neither the language nor JSON. Faults beyond the bound are counted but never formatted, so a large file in
//! which every line is wrong takes no longer than a correct one.

use std::ops::Range;

use crate::diagnostic::{Code, Diagnostic, Excerpt, Severity};
use crate::shown::grouped;

/// The bytes that some editors write before UTF-8 text.
pub(crate) const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// A line of the parsed text, without its line end.
#[derive(Clone, Copy)]
pub(crate) struct Line<'a> {
    /// The line number, from 1.
    pub(crate) number: usize,
    /// The position of its start in the original text.
    pub(crate) offset: usize,
    pub(crate) bytes: &'a [u8],
}

impl<'a> Line<'a> {
    /// Returns the line of `text` that contains the byte at `offset`, and the position within it.
    pub(crate) fn around(text: &'a [u8], offset: usize) -> (Self, usize) {
        let start = text[..offset].iter().rposition(|&b| b == b'\n').map_or(0, |at| at + 1);
        let end = text[offset..].iter().position(|&b| b == b'\n').map_or(text.len(), |at| offset + at);
        let number = text[..start].iter().filter(|&&b| b == b'\n').count() + 1;
        (Line { number, offset: start, bytes: &text[start..end] }, offset - start)
    }
}

/// The content of a diagnostic without its place.
pub(crate) struct Fault {
    pub(crate) code: Code,
    pub(crate) message: String,
    pub(crate) expected: Option<String>,
    pub(crate) help: Option<String>,
}

impl Fault {
    pub(crate) fn new(code: Code, message: impl Into<String>) -> Self {
        Self { code, message: message.into(), expected: None, help: None }
    }

    /// Makes a fault about bytes `fault` of the line. `what` names the kind of text.
    pub(crate) fn not_utf8(line: Line<'_>, fault: Range<usize>, what: &str) -> Self {
        let bytes: Vec<_> = line.bytes[fault].iter().map(|b| format!("0x{b:02X}")).collect();
        Self::new(Code::NotUtf8, format!("this is not UTF-8 text: {}", bytes.join(" ")))
            .expected("expected UTF-8")
            .help(format!("save the {what} as UTF-8"))
    }

    pub(crate) fn expected(mut self, expected: impl Into<String>) -> Self {
        self.expected = Some(expected.into());
        self
    }

    pub(crate) fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

/// The diagnostics of one text.
pub(crate) struct Report<'a> {
    file: &'a str,
    /// The largest number of diagnostics of each severity.
    max_described: usize,
    kept: Vec<Diagnostic>,
    errors: Tally,
    warnings: Tally,
}

/// The number of faults, and the first that was not described.
#[derive(Default)]
struct Tally {
    count: usize,
    first_left_out: Option<Diagnostic>,
}

impl<'a> Report<'a> {
    pub(crate) fn new(file: &'a str, max_described: usize) -> Self {
        Self { file, max_described, kept: Vec::new(), errors: Tally::default(), warnings: Tally::default() }
    }

    pub(crate) fn error_count(&self) -> usize {
        self.errors.count
    }

    pub(crate) fn has_errors(&self) -> bool {
        self.errors.count > 0
    }

    /// Returns whether another error would be described.
    pub(crate) fn describes_next(&self) -> bool {
        self.errors.first_left_out.is_none()
    }

    /// Adds an error. `span` counts from the start of the line.
    pub(crate) fn error(&mut self, line: Line<'_>, span: Range<usize>, fault: impl FnOnce() -> Fault) {
        self.add(Severity::Error, line, span, fault);
    }

    /// Adds a warning. `span` counts from the start of the line.
    pub(crate) fn warning(&mut self, line: Line<'_>, span: Range<usize>, fault: impl FnOnce() -> Fault) {
        self.add(Severity::Warning, line, span, fault);
    }

    fn add(&mut self, severity: Severity, line: Line<'_>, span: Range<usize>, fault: impl FnOnce() -> Fault) {
        let tally = match severity {
            Severity::Error => &mut self.errors,
            Severity::Warning => &mut self.warnings,
        };
        tally.count += 1;
        if tally.first_left_out.is_some() {
            return;
        }
        let Fault { code, message, expected, help } = fault();
        let before = String::from_utf8_lossy(&line.bytes[..span.start]);
        let diagnostic = Diagnostic {
            severity,
            code,
            file: self.file.to_string(),
            line: line.number,
            column: before.chars().count() + 1,
            excerpt: Excerpt::new(line.bytes, span.clone()),
            span: line.offset + span.start..line.offset + span.end,
            message,
            expected,
            help,
            count: 1,
        };
        if tally.count > self.max_described {
            tally.first_left_out = Some(diagnostic);
        } else {
            self.kept.push(diagnostic);
        }
    }

    /// Describes fewer faults of each severity, and counts the others.
    pub(crate) fn describe_at_most(&mut self, most: usize) {
        for (severity, tally) in
            [(Severity::Error, &mut self.errors), (Severity::Warning, &mut self.warnings)]
        {
            let mut described = 0;
            self.kept.retain(|diagnostic| {
                let is_kept = diagnostic.severity != severity || described < most;
                described += usize::from(diagnostic.severity == severity);
                if !is_kept && described == most + 1 {
                    tally.first_left_out = Some(diagnostic.clone());
                }
                is_kept
            });
        }
        self.max_described = self.max_described.min(most);
    }

    /// Returns all diagnostics in the order of the text. Those not described are counted at the place of the first.
    pub(crate) fn finish(mut self) -> Vec<Diagnostic> {
        for (tally, name) in [(self.errors, "error"), (self.warnings, "warning")] {
            if let Some(first) = tally.first_left_out {
                let count = tally.count - self.max_described;
                let s = if count == 1 { "" } else { "s" };
                let left_out = grouped(count as u64);
                self.kept.push(Diagnostic {
                    code: Code::TooManyFaults,
                    message: format!("{left_out} more {name}{s} from here on"),
                    expected: None,
                    help: None,
                    count,
                    ..first
                });
            }
        }
        self.kept.sort_by_key(|d| (d.span.start, d.span.end));
        self.kept
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_found_around_an_offset() {
        let check = |offset, number, text: &str, at| {
            let (line, start) = Line::around("ab\ncä\n".as_bytes(), offset);
            assert_eq!((line.number, line.bytes, start), (number, text.as_bytes(), at), "{offset}");
        };
        check(0, 1, "ab", 0);
        check(2, 1, "ab", 2);
        check(3, 2, "cä", 0);
        check(6, 2, "cä", 3);
        check(7, 3, "", 0);
    }

    #[test]
    fn faults_beyond_the_bound_are_counted() {
        let line = Line { number: 7, offset: 100, bytes: b"abc" };
        let mut report = Report::new("a.txt", 2);
        for at in 0..3 {
            report.error(line, at..at + 1, || Fault::new(Code::NotANumber, "wrong"));
            report.warning(line, at..at, || Fault::new(Code::Unused, "odd"));
        }
        report.error(line, 0..3, || unreachable!("never put into words"));
        assert!(report.has_errors());
        let all = report.finish();
        assert_eq!(all.iter().map(|d| d.count).sum::<usize>(), 7);
        let lines: Vec<_> = all.into_iter().map(|d| (d.message, d.column)).collect();
        let lines: Vec<_> = lines.iter().map(|(message, column)| (message.as_str(), *column)).collect();
        assert_eq!(
            lines,
            [
                ("odd", 1),
                ("wrong", 1),
                ("odd", 2),
                ("wrong", 2),
                ("1 more warning from here on", 3),
                ("2 more errors from here on", 3)
            ]
        );
    }
}
