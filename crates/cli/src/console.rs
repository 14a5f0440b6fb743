//! The program's output: standard output for data, standard error for people.
//!
//! It resolves colour, progress and silence from the global flags and the environment, so no subcommand needs to.
//! Errors are never silenced.

use std::io::{IsTerminal, Write};

use clap::ValueEnum;

/// When to write in colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Color {
    #[default]
    Auto,
    Always,
    Never,
}

/// The format in which a subcommand shows its findings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// For people
    #[default]
    Text,
    /// For programs, on standard output
    Json,
}

/// The console, resolved once from the flags, the environment and the kinds of the streams.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Console {
    /// Whether progress and remarks are hidden.
    pub(crate) quiet: bool,
    /// Whether standard error may have colour.
    pub(crate) color: bool,
    /// Whether standard error is a terminal that can show a moving bar.
    pub(crate) animate: bool,
}

impl Console {
    /// Reads the environment; no other code does.
    pub(crate) fn resolve(quiet: bool, color: Color) -> Self {
        let terminal = std::io::stderr().is_terminal();
        let dumb = std::env::var_os("TERM").is_some_and(|term| term == "dumb");
        let no_color = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
        let color = match color {
            Color::Always => true,
            Color::Never => false,
            Color::Auto => terminal && !dumb && !no_color,
        };
        Self { quiet, color, animate: terminal && !dumb && !quiet }
    }

    /// Writes data to standard output. A reader that has had enough (`| head`) is no error.
    ///
    /// # Errors
    /// Fails if standard output cannot be written.
    pub(crate) fn print(&self, data: impl AsRef<[u8]>) -> anyhow::Result<()> {
        let mut out = std::io::stdout().lock();
        match out.write_all(data.as_ref()).and_then(|()| out.flush()) {
            Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => {
                Err(anyhow::Error::new(e).context("cannot write to standard output"))
            }
            _ => Ok(()),
        }
    }

    /// Prints a remark for people, unless they asked for quiet. It may contain names that others have chosen.
    pub(crate) fn note(&self, text: impl std::fmt::Display) {
        if !self.quiet {
            self.say(visible(&text.to_string()));
        }
    }

    /// Prints an error and its causes on one line: `error: cannot read a.txt: permission denied`.
    pub(crate) fn error(&self, error: &anyhow::Error) {
        self.say(format_args!("{}: {}", self.label(), visible(&describe(error))));
    }

    /// Prints an error that was found elsewhere: `error: <what>: <why>`.
    pub(crate) fn fault(&self, what: &str, why: &str) {
        self.say(format_args!("{}: {}: {}", self.label(), visible(what), visible(why)));
    }

    /// Warns of a likely mistake, unless the user asked for quiet.
    pub(crate) fn warn(&self, text: impl std::fmt::Display) {
        if !self.quiet {
            let label = if self.color { "\x1b[1;33mwarning\x1b[0m" } else { "warning" };
            self.say(format_args!("{label}: {}", visible(&text.to_string())));
        }
    }

    fn label(&self) -> &'static str {
        if self.color { "\x1b[1;31merror\x1b[0m" } else { "error" }
    }

    /// Returns whether there is a user at a terminal who sees the output and can answer.
    #[cfg(feature = "network")]
    pub(crate) fn can_ask(&self) -> bool {
        std::io::stdin().is_terminal() && std::io::stderr().is_terminal()
    }

    /// Prints a question. The cursor stays behind it.
    #[cfg(feature = "network")]
    pub(crate) fn ask(&self, question: &str) {
        let mut err = std::io::stderr().lock();
        let _ = write!(err, "{question} ").and_then(|()| err.flush());
    }

    /// Prints diagnostics and other text that must be seen. If standard error is closed, the failure cannot be
    /// reported, so it is ignored.
    pub(crate) fn say(&self, text: impl std::fmt::Display) {
        let _ = writeln!(std::io::stderr().lock(), "{text}");
    }
}

/// Returns the text with control characters written as escapes, so that no name can command a terminal. Ends of lines
/// are kept.
pub(crate) fn visible(text: &str) -> String {
    let is_command = |c: char| (c.is_control() && c != '\n') || is_formatting(c);
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        if is_command(c) {
            shown.extend(c.escape_unicode());
        } else {
            shown.push(c);
        }
    }
    shown
}

/// Returns whether a character changes the direction of text, which can make a name look like another one.
fn is_formatting(c: char) -> bool {
    matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// Returns an error and its causes as text.
pub(crate) fn describe(error: &anyhow::Error) -> String {
    let causes: Vec<String> = error.chain().map(without_number).collect();
    causes.join(": ")
}

/// Returns the message of an error without the system's error number.
fn without_number(error: &(dyn std::error::Error + 'static)) -> String {
    let mut text = error.to_string();
    if text.ends_with(')')
        && let Some(end) = text.rfind(" (os error ")
    {
        text.truncate(end);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_command_no_terminal() {
        assert_eq!(visible("a \x1b[31mred\x07\u{9b}2J\r"), "a \\u{1b}[31mred\\u{7}\\u{9b}2J\\u{d}");
        assert_eq!(visible("\u{202e}fig.olleh"), "\\u{202e}fig.olleh");
        assert_eq!(visible("über\n  日本 🎞"), "über\n  日本 🎞");
    }
}
