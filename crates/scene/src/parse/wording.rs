//! What a person is told about a fault in a script: what is wrong, what was expected, what to do.

use super::number::{self, NumberFault};
use super::text::Words;
use crate::command::Command;
use crate::diagnostic::Code;
use crate::model::{Doubt, InvalidValue};
use crate::report::Fault;
use crate::shown::{grouped, quoted};

/// What `Trace` is for.
const TRACE_HELP: &str = "`Trace` renders a frame of everything that stands before it";

pub(super) fn too_large(limit: usize) -> Fault {
    let limit = grouped(limit as u64);
    Fault::new(Code::TextTooLarge, format!("the script is larger than {limit} bytes"))
        .expected("expected a smaller script")
        .help("split it into several scripts or raise the limit")
}

pub(super) fn utf16() -> Fault {
    Fault::new(Code::NotUtf8, "the script is UTF-16 text")
        .expected("expected UTF-8")
        .help("save the script as UTF-8")
}

pub(super) fn lone_carriage_return() -> Fault {
    Fault::new(Code::LoneCarriageReturn, "a carriage return without a line feed")
        .expected("expected a line feed after this")
        .help("lines end with LF or CR LF; save the script with either")
}

pub(super) fn unknown_command(name: &str, nearest: Option<Command>) -> Fault {
    let help = if let Some(command) = nearest {
        format!("did you mean `{}`?", command.name())
    } else if number::parse(name).is_ok() {
        "a command and all its parameters stand on one line".to_string()
    } else if ["//", "/*", ";", "%", "--"].iter().any(|mark| name.starts_with(mark)) {
        "a comment starts with `#`".to_string()
    } else {
        let names: Vec<_> = Command::ALL.iter().map(|c| format!("`{}`", c.name())).collect();
        format!("the commands are {}", names.join(", "))
    };
    Fault::new(Code::UnknownCommand, format!("unknown command {}", quoted(name)))
        .expected("expected a command")
        .help(help)
}

/// About `word`, which stands in the place of `parameter`.
pub(super) fn bad_number(fault: NumberFault, parameter: &str, word: &str) -> Fault {
    match fault {
        NumberFault::TooLarge => Fault::new(Code::NumberTooLarge, format!("{} is too large", quoted(word)))
            .expected(format!("expected `{parameter}`, a number up to 1.79e308")),
        NumberFault::Malformed => {
            let fault = Fault::new(Code::NotANumber, format!("{} is not a number", quoted(word)))
                .expected(format!("expected `{parameter}`, a number such as 2, -.5 or 1e-3"));
            match hint(word) {
                Some(hint) => fault.help(hint),
                None => fault,
            }
        }
    }
}

/// What a slip of the keyboard or of another program would explain.
fn hint(word: &str) -> Option<String> {
    // Longer words are no slips.
    if word.len() > 100 {
        return None;
    }
    if Command::from_name(word).is_some() {
        return Some("every command stands on a line of its own".to_string());
    }
    let odd = word.chars().find(|c| !c.is_ascii_graphic())?;
    let code = u32::from(odd);
    let is_dash = |c| matches!(c, '\u{2010}'..='\u{2015}' | '\u{2212}' | '\u{fe63}' | '\u{ff0d}');
    if is_dash(odd) && number::parse(&word.replace(is_dash, "-")).is_ok() {
        return Some(format!("the minus sign is `-`, this one is U+{code:04X}"));
    }
    if odd.is_whitespace() {
        return Some(format!("blanks, tabs and commas separate parameters, U+{code:04X} does not"));
    }
    None
}

pub(super) fn too_few(command: Command, words: &Words) -> Fault {
    let (missing, _) = command.form().number(words.count());
    miscounted(Code::TooFewParameters, command, words, None).expected(format!("expected `{missing}` here"))
}

/// `first` is the first word that is too much; `comma` a parameter that was probably written with a comma for a point.
pub(super) fn too_many(command: Command, words: &Words, first: &str, comma: Option<&str>) -> Fault {
    let fault =
        miscounted(Code::TooManyParameters, command, words, comma).expected("expected the end of the line");
    if Command::from_name(first).is_some() {
        fault.help("every command stands on a line of its own")
    } else {
        fault
    }
}

fn miscounted(code: Code, command: Command, words: &Words, comma: Option<&str>) -> Fault {
    let (least, most) = command.form().arity().into_inner();
    let takes = match (least, most) {
        (0, 0) => "no parameters".to_string(),
        (a, b) if a == b => format!("{a} numbers"),
        (a, b) => format!("{a} to {b} numbers"),
    };
    let found = match words.count() {
        0 => "none".to_string(),
        count => grouped(count as u64),
    };
    Fault::new(code, format!("`{}` takes {takes}, found {found}", command.name())).help(match comma {
        Some(comma) => format!("{}; write `{}`", two_numbers(comma), command.form()),
        None => format!("write `{}`", command.form()),
    })
}

/// About a number that was probably written with a comma for a point.
pub(super) fn decimal_comma(comma: &str) -> Fault {
    Fault::new(Code::DecimalComma, format!("{} is two numbers", quoted(comma)))
        .expected(format!("expected {}, or a blank behind the comma", quoted(&comma.replace(',', "."))))
        .help("the decimal sign is a point, a comma separates numbers")
}

fn two_numbers(comma: &str) -> String {
    let one = comma.replace(',', ".");
    format!("a comma separates numbers: if {} is to be one, it is {}", quoted(comma), quoted(&one))
}

/// `word` is the first of the numbers that it is about, in the place of `name`.
pub(super) fn invalid(fault: InvalidValue, name: &str, word: &str) -> Fault {
    let told = |expected: &str| Fault::new(Code::InvalidValue, fault.to_string()).expected(expected);
    match fault {
        InvalidValue::NotFinite(_) => told("expected finite numbers"),
        InvalidValue::NotPositive(_) => told("expected a number greater than 0"),
        InvalidValue::ZeroDirection(_) => told("expected three numbers that are not all 0"),
        InvalidValue::GazeParallelToUp => told("expected two directions that span a plane"),
        InvalidValue::EmptyWindowWidth => told("expected `au` and `bu` to differ"),
        InvalidValue::EmptyWindowHeight => told("expected `av` and `bv` to differ"),
        InvalidValue::Zero(_) => told("expected a number from 1"),
        InvalidValue::NotWhole(_, least, most) => not_whole(least, most, name, word),
        InvalidValue::OutOfRange(_, least, most) => {
            told(&format!("expected a number from {least} to {most}"))
        }
        InvalidValue::Negative(_) => told("expected a number from 0"),
        InvalidValue::TooSmall(_, least) => told(&format!("expected a number from {least}")),
        InvalidValue::NoAxis => told("expected two points that differ"),
        InvalidValue::NoRadius => told("expected a number greater than 0 at one end at least"),
        InvalidValue::ThickTorus => told("expected `r` to be less than `R`"),
        InvalidValue::NoGaze => told("expected a target apart from the eye"),
        InvalidValue::EmptyGradient => told("expected `a` and `b` to differ"),
    }
}

fn not_whole(least: u32, most: u32, name: &str, word: &str) -> Fault {
    let too_large = number::parse(word).is_ok_and(|value| value > most.into());
    let range = if too_large { format!("up to {}", grouped(most.into())) } else { format!("from {least}") };
    Fault::new(Code::InvalidValue, format!("{} is not a number of pixels", quoted(word)))
        .expected(format!("expected `{name}`, a whole number {range}"))
}

pub(super) fn too_many_pixels(pixels: u64, limit: u64) -> Fault {
    let [pixels, limit] = [pixels, limit].map(grouped);
    Fault::new(Code::LimitExceeded, format!("the image has {pixels} pixels, the limit is {limit}"))
        .expected("expected a smaller image")
        .help("make the image smaller or raise the limit")
}

pub(super) fn beyond_limit(limit: usize, what: &str) -> Fault {
    let limit = grouped(limit as u64);
    Fault::new(Code::LimitExceeded, format!("more than {limit} {what}"))
        .expected(format!("expected at most {limit}, this is one more"))
}

pub(super) fn no_screen() -> Fault {
    Fault::new(Code::NoScreen, "the size of the image is not known")
        .expected("expected a `Screen` before this")
        .help("write for example `Screen 640 480`")
}

pub(super) fn no_trace() -> Fault {
    Fault::new(Code::NoTrace, "nothing is rendered: there is no `Trace`")
        .expected("expected a `Trace`")
        .help(TRACE_HELP)
}

pub(super) fn doubtful(doubt: Doubt) -> Fault {
    match doubt {
        Doubt::DegenerateTriangle => {
            Fault::new(Code::DegenerateTriangle, "a triangle of no area is never hit")
                .expected("expected three points that are not on a line")
        }
    }
}

pub(super) fn cleared() -> Fault {
    Fault::new(Code::Unused, "this has no effect: a `Clear` removes it before a `Trace` shows it")
        .expected("expected a `Trace` between this and the `Clear`")
        .help(TRACE_HELP)
}

pub(super) fn unused() -> Fault {
    Fault::new(Code::Unused, "this has no effect: no `Trace` follows")
        .expected("expected a `Trace` after this")
        .help(TRACE_HELP)
}
