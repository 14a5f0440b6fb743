//! Collects diagnostics: places them in the text and keeps their number bounded.

use std::ops::Range;

use crate::diagnostic::{Code, Diagnostic, Excerpt, Severity};

/// A line of the text that is being parsed, without its line end.
#[derive(Clone, Copy)]
pub(super) struct Line<'a> {
    /// From 1.
    pub(super) number: usize,
    /// Where it starts in the text as it was given.
    pub(super) offset: usize,
    pub(super) bytes: &'a [u8],
}

/// What is wrong, apart from where.
pub(super) struct Fault {
    pub(super) code: Code,
    pub(super) message: String,
    pub(super) expected: Option<String>,
    pub(super) help: Option<String>,
}

impl Fault {
    pub(super) fn new(code: Code, message: impl Into<String>) -> Self {
        Self { code, message: message.into(), expected: None, help: None }
    }

    pub(super) fn expected(mut self, expected: impl Into<String>) -> Self {
        self.expected = Some(expected.into());
        self
    }

    pub(super) fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

/// The diagnostics of one text.
pub(super) struct Report<'a> {
    file: &'a str,
    /// How many of each severity are kept.
    max_described: usize,
    kept: Vec<Diagnostic>,
    errors: Tally,
    warnings: Tally,
}

/// How many there were, and the first that was not described.
#[derive(Default)]
struct Tally {
    count: usize,
    first_left_out: Option<Diagnostic>,
}

impl<'a> Report<'a> {
    pub(super) fn new(file: &'a str, max_described: usize) -> Self {
        Self { file, max_described, kept: Vec::new(), errors: Tally::default(), warnings: Tally::default() }
    }

    pub(super) fn has_errors(&self) -> bool {
        self.errors.count > 0
    }

    /// `span` counts from the start of the line.
    pub(super) fn error(&mut self, line: Line<'_>, span: Range<usize>, fault: Fault) {
        self.add(Severity::Error, line, span, fault);
    }

    /// `span` counts from the start of the line.
    pub(super) fn warning(&mut self, line: Line<'_>, span: Range<usize>, fault: Fault) {
        self.add(Severity::Warning, line, span, fault);
    }

    fn add(&mut self, severity: Severity, line: Line<'_>, span: Range<usize>, fault: Fault) {
        let tally = match severity {
            Severity::Error => &mut self.errors,
            Severity::Warning => &mut self.warnings,
        };
        tally.count += 1;
        if tally.first_left_out.is_some() {
            return;
        }
        let Fault { code, message, expected, help } = fault;
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
        };
        if tally.count > self.max_described {
            tally.first_left_out = Some(diagnostic);
        } else {
            self.kept.push(diagnostic);
        }
    }

    /// All diagnostics in the order of the text; what was not described is counted at the place where it starts.
    pub(super) fn finish(mut self) -> Vec<Diagnostic> {
        for (tally, name) in [(self.errors, "error"), (self.warnings, "warning")] {
            if let Some(first) = tally.first_left_out {
                let left_out = tally.count - self.max_described;
                let s = if left_out == 1 { "" } else { "s" };
                self.kept.push(Diagnostic {
                    code: Code::TooManyFaults,
                    message: format!("{left_out} more {name}{s} from here on"),
                    expected: None,
                    help: None,
                    ..first
                });
            }
        }
        self.kept.sort_by_key(|d| (d.span.start, d.span.end));
        self.kept
    }
}

/// A piece of the text for a message: short, and with nothing in it that cannot be seen.
pub(super) fn quoted(text: &str) -> String {
    const LONGEST: usize = 40;
    let mut quoted = String::from("`");
    for (i, c) in text.chars().enumerate() {
        if i == LONGEST {
            quoted.push('…');
            break;
        }
        match c {
            '\'' | '"' | '\\' => quoted.push(c),
            _ => quoted.extend(c.escape_debug()),
        }
    }
    quoted.push('`');
    quoted
}

/// A count as people write it: 64,000,000.
pub(super) fn grouped(count: u64) -> String {
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
