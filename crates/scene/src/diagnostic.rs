//! Diagnostics: the errors and warnings of a text, with their places and corrections.
//!
//! A diagnostic contains the excerpt of the text that it is about, so it can be stored, sent and shown without the
//! text itself. Messages are for people; programs distinguish diagnostics by [`Code`].
//!
//! Invariants: lines and columns count from 1, columns in characters. The size of a diagnostic is bounded, however
//! long the line is.
//!
//! ```
//! let parsed = rayfold_scene::parse("a.txt", b"Screen 4 3\nTrace now", &Default::default());
//! let shown = parsed.diagnostics[0].render(false);
//! assert!(shown.contains("a.txt:2:7"));
//! assert!(shown.contains("2 | Trace now"));
//! ```

use std::ops::Range;

use annotate_snippets::{AnnotationKind, Level, Origin, Renderer, Snippet};
use serde::{Deserialize, Serialize};

use crate::shown::visible;

/// The severity of a diagnostic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// The script is not rendered.
    Error,
    /// The script is rendered, but perhaps not as intended.
    Warning,
}

/// The kind of a fault. Unlike the message, it is stable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Code {
    /// The text is larger than the limit.
    TextTooLarge,
    /// Bytes that are not UTF-8.
    NotUtf8,
    /// A carriage return without a line feed after it.
    LoneCarriageReturn,
    /// The first word of a line is no command.
    UnknownCommand,
    /// A command lacks parameters.
    TooFewParameters,
    /// A command has parameters left over.
    TooManyParameters,
    /// A parameter is not a decimal number.
    NotANumber,
    /// A number beyond what a 64-bit float holds.
    NumberTooLarge,
    /// A number, or a combination of numbers, that is not allowed.
    InvalidValue,
    /// More objects, lights, pixels or frames than the limit.
    LimitExceeded,
    /// A `Trace` before any `Screen`.
    NoScreen,
    /// Nothing is rendered.
    NoTrace,
    /// A triangle without area, which is never hit.
    DegenerateTriangle,
    /// A command without effect, because no `Trace` follows it before a `Clear` or the end.
    Unused,
    /// A number that was probably written with a decimal comma, and is read as two numbers.
    DecimalComma,
    /// A malformed curve.
    MalformedCurve,
    /// A curve where none is allowed.
    UnwantedCurve,
    /// A curve whose numbers overflow.
    CurveOverflow,
    /// A malformed or missing name.
    MalformedName,
    /// A name that is not defined, or not before this line.
    UnknownName,
    /// A name that is defined twice.
    DuplicateName,
    /// A word that is no clause of a material.
    UnknownClause,
    /// A clause that a material has already.
    DuplicateClause,
    /// A pattern's material with clauses other than coefficients.
    UnfitMaterial,
    /// A command in a wrong place: in a group, or an `End` outside of one.
    Misplaced,
    /// A group without an `End`.
    UnclosedGroup,
    /// A picture with pixels that are not square.
    SquashedImage,
    /// A word in quotes that is malformed, or is no name of a file.
    MalformedQuote,
    /// A file that a script names and that is absent.
    AbsentFile,
    /// A file that a script names and that cannot be used.
    UnusableFile,
    /// A part of a file that is not drawn as its author may expect.
    UnusedPart,
    /// A command without effect, or a clause without effect on an object.
    NoEffect,
    /// A file that is no text.
    NotText,
    /// A lens, a shutter or the size of a light, with one ray per pixel.
    NeedsSamples,
    /// Colours that need light in a scene without lights.
    NoLight,
    /// Surfaces have ambient light in addition to that of `Indirect`.
    AmbientLight,
    /// Several triangles of glass, which do not refract.
    GlassPanes,
    /// A field of view that is probably in radians.
    NarrowView,
    /// A colour that is probably written as levels from 0 to 255.
    FarAboveOne,
    /// A `#` that begins a comment directly after a word, or a colour such as `#ff8000`.
    GluedComment,
    /// More faults than are described individually.
    TooManyFaults,
    /// Settings that are not JSON, or not an object.
    MalformedSettings,
    /// A field that settings do not have.
    UnknownField,
    /// A field that occurs twice.
    DuplicateField,
    /// A field with a value of the wrong type or range.
    InvalidField,
}

/// An error or a warning about a text.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Diagnostic {
    /// Whether it makes the text unusable.
    pub severity: Severity,
    /// The kind of the fault.
    pub code: Code,
    /// The name under which the text was parsed.
    pub file: String,
    /// The line of the fault, from 1.
    pub line: usize,
    /// The column of its first character, from 1, in characters.
    pub column: usize,
    /// The range of its bytes in the original text; empty for a place between two characters.
    pub span: Range<usize>,
    /// The description of the problem, without a full stop.
    pub message: String,
    /// The correct text in its place.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expected: Option<String>,
    /// Advice for a correction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub help: Option<String>,
    /// The text around the fault.
    pub excerpt: Excerpt,
    /// The number of faults that it stands for: more than one for those that are only counted.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub count: usize,
}

fn one() -> usize {
    1
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_one(count: &usize) -> bool {
    *count == 1
}

/// The line of a fault, or its part around the fault if the line is long.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Excerpt {
    /// The text, at most one line. Bytes that are not UTF-8 are replaced by U+FFFD.
    pub text: String,
    /// The range of the fault's bytes in `text`.
    pub marked: Range<usize>,
}

impl Diagnostic {
    /// Returns whether the diagnostic makes the text unusable.
    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }

    /// Formats the diagnostic for people: message, place, the line with the fault underlined, and help. The result
    /// has several lines without a final line feed. `color` adds ANSI escapes.
    pub fn render(&self, color: bool) -> String {
        let renderer = if color { Renderer::styled() } else { Renderer::plain() };
        let level = match self.severity {
            Severity::Error => Level::ERROR,
            Severity::Warning => Level::WARNING,
        };
        let marked = self.excerpt.marked();
        let from_line_start = self.excerpt.text[..marked.start].chars().count() + 1 == self.column;
        let snippet = Snippet::source(&self.excerpt.text)
            .line_start(self.line)
            .fold(false)
            .annotation(AnnotationKind::Primary.span(marked).label(self.expected.as_deref()));
        let title = level.primary_title(&self.message);
        let group = if from_line_start {
            title.element(snippet.path(visible(&self.file)))
        } else {
            title
                .element(Origin::path(visible(&self.file)).line(self.line).char_column(self.column))
                .element(snippet)
        };
        let group = match &self.help {
            Some(help) => group.element(Level::HELP.message(help)),
            None => group,
        };
        renderer.render(&[group])
    }
}

impl Excerpt {
    /// The number of characters kept before a fault: more than the longest command has.
    const BEFORE: usize = 500;
    /// The number of characters kept of the fault itself, and of the text after it.
    const REACH: usize = 100;

    /// Makes the excerpt of `line`, which holds no line feed, around its bytes `fault`.
    pub(crate) fn new(line: &[u8], fault: Range<usize>) -> Self {
        let before = last_chars(&line[..fault.start], Self::BEFORE);
        let inside = first_chars(&line[fault.clone()], Self::REACH);
        let after = first_chars(&line[fault.end..], Self::REACH);
        let mut text = String::new();
        if before.len() < fault.start {
            text.push('…');
        }
        text.push_str(&String::from_utf8_lossy(before));
        let start = text.len();
        text.push_str(&String::from_utf8_lossy(inside));
        let end = text.len();
        if inside.len() < fault.len() {
            text.push('…');
        } else {
            text.push_str(&String::from_utf8_lossy(after));
            if after.len() < line.len() - fault.end {
                text.push('…');
            }
        }
        Self { text, marked: start..end }
    }

    /// Returns the marked bytes; empty if a foreign excerpt does not fit its text.
    fn marked(&self) -> Range<usize> {
        if self.text.get(self.marked.clone()).is_some() { self.marked.clone() } else { 0..0 }
    }
}

fn is_char_start(byte: u8) -> bool {
    byte & 0xc0 != 0x80
}

/// Returns the first `count` characters. In text that is not UTF-8, returns at most four times as many bytes.
fn first_chars(text: &[u8], count: usize) -> &[u8] {
    let reach = &text[..text.len().min(4 * count + 1)];
    match reach.iter().enumerate().filter(|&(_, &b)| is_char_start(b)).nth(count) {
        Some((end, _)) => &text[..end],
        None => &text[..text.len().min(4 * count)],
    }
}

/// Returns the last `count` characters. In text that is not UTF-8, returns at most four times as many bytes.
fn last_chars(text: &[u8], count: usize) -> &[u8] {
    let reach = &text[text.len().saturating_sub(4 * count)..];
    match reach.iter().enumerate().rev().filter(|&(_, &b)| is_char_start(b)).nth(count - 1) {
        Some((start, _)) => &reach[start..],
        None => reach,
    }
}
