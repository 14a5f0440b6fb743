//! The messages about faults in a script: the problem, the expected text, and advice.

use super::curve::CurveFault;
use super::number::{self, NumberFault};
use super::text::Words;
use crate::command::Command;
use crate::curve::{CYCLE, Mode, Moment};
use crate::diagnostic::Code;
use crate::form::{Field, Form, Kind, Names, Unit, Values};
use crate::model::{Clause, InvalidValue, Lint, Parameter, Screen};
use crate::report::Fault;
use crate::shown::{grouped, nearest, quoted};

mod files;

pub(super) use files::{
    bad_smooth_angle, blank_text, malformed_quote, model_doubt, no_file_name, no_font, no_image_file,
    no_image_width, no_map, no_quotes, no_smooth_angle, no_uv, open_glass, own_without_file, sky_in_fog,
    text_option_again, too_many_mesh_options, two_paths, unknown_option, unknown_text_option, unusable_file,
    unusable_letters,
};

/// The help text about `Trace`.
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

pub(super) fn not_text(what: &str) -> Fault {
    if what == super::foreign::UTF_16 {
        return utf16();
    }
    let hint = if what.ends_with("model") { ": `Mesh \"FILE\"` in a script draws it" } else { "" };
    Fault::new(Code::NotText, format!("this is {what}, not a scene script{hint}"))
        .expected("expected a text file with commands such as `Screen 640 480`")
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
        "a command and all its parameters must be on one line".to_string()
    } else if ["//", "/*", ";", "%", "--"].iter().any(|mark| name.starts_with(mark)) {
        "a comment starts with `#`".to_string()
    } else {
        let mut names: Vec<_> = Command::ALL.iter().map(|c| format!("`{}`", c.name())).collect();
        names.dedup();
        format!("the commands are {}", names.join(", "))
    };
    Fault::new(Code::UnknownCommand, format!("unknown command {}", quoted(name)))
        .expected("expected a command")
        .help(help)
}

/// Describes `word` in place of `parameter`. `is_surface`: only the name of a material is allowed there.
pub(super) fn bad_number(fault: NumberFault, parameter: &str, word: &str, is_surface: bool) -> Fault {
    match fault {
        NumberFault::TooLarge => Fault::new(Code::NumberTooLarge, format!("{} is too large", quoted(word)))
            .expected(format!("expected `{parameter}`, a number up to 1.79e308")),
        NumberFault::Malformed => {
            let fault = Fault::new(Code::NotANumber, format!("{} is not a number", quoted(word)))
                .expected(format!("expected `{parameter}`, a number such as 2, -.5 or 1e-3"));
            match hint(word) {
                Some(hint) => fault.help(hint),
                None if is_surface => fault.help("the name of a material replaces all coefficients"),
                None => fault,
            }
        }
    }
}

/// Explains a typo or the number format of another program.
fn hint(word: &str) -> Option<String> {
    // Longer words are no typos.
    if word.len() > 100 {
        return None;
    }
    if Command::from_name(word).is_some() {
        return Some("each command needs a line of its own".to_string());
    }
    if matches!(word, ":" | ")") {
        return Some(format!("{} is allowed only in a curve, as in `(1:0 25:3)`", quoted(word)));
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

/// Describes missing parameters. `comma` is a parameter that was probably written with a decimal comma.
///
/// `color` is the colour in a comment, in the notation of other languages.
pub(super) fn too_few(
    command: Command,
    words: &Words,
    comma: Option<&str>,
    color: Option<[f64; 3]>,
) -> Fault {
    let (missing, _) = command.form().number(words.count());
    let fault = miscounted(Code::TooFewParameters, command, words, comma)
        .expected(format!("expected `{missing}` here"));
    match color {
        Some(color) => fault.help(format!("`#` begins a comment; {}", color_help(color))),
        None => fault,
    }
}

/// Describes extra parameters. `first` is the first of them, and `comma` a parameter that was probably written
/// with a decimal comma.
pub(super) fn too_many(command: Command, words: &Words, first: &str, comma: Option<&str>) -> Fault {
    let fault =
        miscounted(Code::TooManyParameters, command, words, comma).expected("expected the end of the line");
    if Command::from_name(first).is_some() {
        fault.help("each command needs a line of its own")
    } else {
        fault
    }
}

fn miscounted(code: Code, command: Command, words: &Words, comma: Option<&str>) -> Fault {
    let takes = counts_of(command.form());
    let found = match words.count() {
        0 => "none".to_string(),
        count => grouped(count as u64),
    };
    Fault::new(code, format!("`{command}` takes {takes}, found {found}")).help(match comma {
        Some(comma) => format!("{}; write `{}`", two_numbers(comma), usage(command)),
        None => format!("write `{}`", usage(command)),
    })
}

/// Describes the number of parameters of a command.
fn counts_of(form: &Form) -> String {
    let counts: Vec<_> = form.counts().collect();
    let (first, last) = (counts[0], counts[counts.len() - 1]);
    let what = match form.fields {
        [Field { kind: Kind::Word, .. }] => "word",
        _ => "number",
    };
    match counts[..] {
        [0] => "no parameters".to_string(),
        [1] => format!("1 {what}"),
        [count] => format!("{count} {what}s"),
        _ if last - first + 1 == counts.len() && counts.len() > 2 => format!("{first} to {last} {what}s"),
        _ => {
            let others: Vec<_> = counts[..counts.len() - 1].iter().map(usize::to_string).collect();
            format!("{} or {last} {what}s", others.join(", "))
        }
    }
}

/// Describes a number that was probably written with a decimal comma.
pub(super) fn decimal_comma(comma: &str) -> Fault {
    Fault::new(Code::DecimalComma, format!("{} is read as two numbers", quoted(comma)))
        .expected(format!("expected {}, or a space after the comma", quoted(&comma.replace(',', "."))))
        .help("the decimal sign is a point, a comma separates numbers")
}

fn two_numbers(comma: &str) -> String {
    let one = comma.replace(',', ".");
    format!("a comma separates numbers: if {} is to be one, it is {}", quoted(comma), quoted(&one))
}

/// Describes an invalid value. `word` is the first of its numbers, in place of `name` of `field`.
pub(super) fn invalid(fault: InvalidValue, name: &str, field: &Field, word: &str) -> Fault {
    if let InvalidValue::NotWhole(_, least, most) = fault {
        return not_whole(least, most, name, field, word);
    }
    if let InvalidValue::OutOfRange(parameter, ..) = fault {
        let values = field.values;
        return Fault::new(Code::InvalidValue, format!("{parameter} must be {values}"))
            .expected(format!("expected a number {values}"));
    }
    let is_hidden = number::parse(word) == Ok(0.0);
    vanishing(
        Fault::new(Code::InvalidValue, fault.to_string()).expected(expectation(fault)),
        field,
        is_hidden,
    )
}

/// Adds to a fault of a size the advice how to make an object vanish.
fn vanishing(fault: Fault, field: &Field, is_hidden: bool) -> Fault {
    if is_hidden
        && field.kind == Kind::Length
        && field.values == Values::Positive
        && is_of_shape(field.parameter)
    {
        fault.help("to make an object vanish, put it into a group: the scale of its `Use` may shrink to 0")
    } else {
        fault
    }
}

fn is_of_shape(parameter: Parameter) -> bool {
    matches!(parameter, Parameter::Radius | Parameter::Thickness)
}

/// Describes a value of a line with curves that is invalid at a time.
pub(super) fn invalid_at(fault: InvalidValue, frame: f64) -> Fault {
    Fault::new(Code::InvalidValue, format!("{fault}, which fails at frame {frame}"))
        .expected(format!("{} at frame {frame}", expectation(fault)))
}

fn expectation(fault: InvalidValue) -> String {
    match fault {
        InvalidValue::NotFinite(_) => "expected finite numbers".into(),
        InvalidValue::NotPositive(_) => "expected a number greater than 0".into(),
        InvalidValue::ZeroDirection(_) => "expected three numbers that are not all 0".into(),
        InvalidValue::GazeParallelToUp => "expected two directions that span a plane".into(),
        InvalidValue::EmptyWindowWidth => "expected `au` and `bu` to differ".into(),
        InvalidValue::EmptyWindowHeight => "expected `av` and `bv` to differ".into(),
        InvalidValue::Zero(_) => "expected a number from 1".into(),
        InvalidValue::NotWhole(_, least, most) => format!("expected a whole number from {least} to {most}"),
        InvalidValue::OutOfRange(_, least, most) => format!("expected a number from {least} to {most}"),
        InvalidValue::Negative(_) => "expected a number from 0".into(),
        InvalidValue::TooSmall(_, least) => format!("expected a number from {least}"),
        InvalidValue::Outputs => "expected one file or more, each once".into(),
        InvalidValue::NoAxis => "expected two points that differ".into(),
        InvalidValue::NoRadius => "expected a number greater than 0 at one end at least".into(),
        InvalidValue::ThickTorus => "expected `r` to be less than `R`".into(),
        InvalidValue::TooRound(most) => {
            format!("expected `r` to be at most half of the shortest side, {most}")
        }
        InvalidValue::NoGaze => "expected a target apart from the eye".into(),
        InvalidValue::FramesBackwards => "expected `a` to be at most `b`".into(),
        InvalidValue::EmptyGradient => "expected `a` and `b` to differ".into(),
    }
}

fn not_whole(least: u32, most: u32, name: &str, field: &Field, word: &str) -> Fault {
    let too_large = number::parse(word).is_ok_and(|value| value > most.into());
    let range = if too_large { format!("up to {}", grouped(most.into())) } else { format!("from {least}") };
    let what = match field.kind.unit() {
        Unit::Rays => "rays",
        Unit::Bounces => "bounces",
        Unit::Frames => "frames",
        _ => "pixels",
    };
    Fault::new(Code::InvalidValue, format!("{} is not a number of {what}", quoted(word)))
        .expected(format!("expected `{name}`, a whole number {range}"))
}

/// Describes an error in the curve in place of `parameter`.
pub(super) fn curve(fault: CurveFault, parameter: &str) -> Fault {
    let malformed = |message: String| Fault::new(Code::MalformedCurve, message);
    let modes = || Mode::ALL.iter().map(|mode| mode.name()).chain([CYCLE]);
    match fault {
        CurveFault::Unclosed => malformed("the curve is not closed".into())
            .expected("expected a `)` after this, on the same line"),
        CurveFault::NoKey => malformed("the curve has no key".into())
            .expected(format!("expected frames and values of `{parameter}`, such as `1:0 25:3`")),
        CurveFault::NotAMode(word) => {
            let help = match nearest(&word, modes()) {
                Some(near) => format!("did you mean `{near}`?"),
                None => format!("the modes are {}", listed(modes())),
            };
            malformed(format!("unknown curve mode {}", quoted(&word)))
                .expected("expected a mode, or a key such as `25:3`")
                .help(help)
        }
        CurveFault::MisplacedMode(word) => {
            malformed(format!("{} must come before the keys, and only once", quoted(&word)))
                .expected("expected a key such as `25:3`")
                .help(format!(
                    "a curve starts with at most one of {}, and `{CYCLE}`",
                    listed(Mode::ALL.iter().map(|mode| mode.name()))
                ))
        }
        CurveFault::Stray(mark) => malformed(format!("unexpected {} in a curve", quoted(&mark)))
            .expected("expected a key such as `25:3`, or `)`"),
        CurveFault::NoValue => malformed("a key lacks its value".into())
            .expected(format!("expected `:` and `{parameter}` after this frame")),
        CurveFault::FewNumbers => malformed("`bezier` lacks its four numbers".into())
            .expected("expected four numbers after this, then the keys")
            .help("as CSS's cubic-bezier: `(bezier .25 .1 .25 1  1:0 25:3)`"),
        CurveFault::OutsideShare(name, value) => {
            malformed(format!("`{name}` of `bezier` must not be {value}"))
                .expected(format!("expected `{name}`, 0 to 1: the time of a control point"))
        }
        CurveFault::BadNumber(fault, name @ ("frame" | "a" | "b" | "c" | "d"), word) => {
            bad_number(fault, name, &word, false)
        }
        CurveFault::BadNumber(fault, _, word) => bad_number(fault, parameter, &word, false),
        CurveFault::OutOfOrder(last, frame) => {
            malformed(format!("frame {frame} must be greater than frame {last}"))
                .expected(format!("expected a frame greater than {last}"))
        }
        CurveFault::ShortCycle => malformed("a cycle of one key has no length".into())
            .expected("expected two keys at least, the last where it starts again"),
        CurveFault::Overflow(from, to) => Fault::new(
            Code::CurveOverflow,
            format!("the curve becomes too large between frames {from} and {to}"),
        )
        .expected("expected values closer together, or keys further apart"),
    }
}

/// Describes a curve where none is allowed.
pub(super) fn unwanted_curve(command: Command, parameter: &str) -> Fault {
    let message = match command.form().curves {
        true => format!("{parameter} of `{command}` cannot be a curve"),
        false => format!("`{command}` takes no curves"),
    };
    Fault::new(Code::UnwantedCurve, message).expected(format!("expected `{parameter}`, a number"))
}

/// Describes a value of a curve that `field` does not allow. The curve is visible `from` one time `to` another.
pub(super) fn wrong_at(field: &Field, moment: Moment, from: f64, to: f64) -> Fault {
    let Moment { frame, value } = moment;
    let takes = match field.values {
        Values::Positive => "a number greater than 0".to_string(),
        Values::NotNegative => "a number from 0".to_string(),
        Values::AtLeastOne => "a number from 1".to_string(),
        Values::FieldOfView => "a number above 0 and below 180".to_string(),
        Values::HalfTurn => "a number from 0 to below 180".to_string(),
        Values::Share
        | Values::Any
        | Values::Clamped
        | Values::NotZero
        | Values::Whole(..)
        | Values::OneOf(_) => field.values.to_string(),
    };
    let when = if from == to { format!("at frame {from}") } else { format!("from frame {from} to {to}") };
    let fault = Fault::new(Code::InvalidValue, format!("{} is {value} at frame {frame}", field.parameter))
        .expected(format!("expected {takes} {when}"));
    vanishing(fault, field, true)
}

/// Reports that checking the constraints of a line with curves would take too long.
pub(super) fn too_much_work() -> Fault {
    Fault::new(Code::LimitExceeded, "too many frames to check this line in every frame")
        .expected("expected fewer frames, or curves that stay well within the allowed range")
        .help("split the frames among several scripts")
}

/// Describes a `word` that `field` does not allow.
pub(super) fn no_such_word(word: &str, words: &[&str], field: &Field) -> Fault {
    let fault = Fault::new(Code::InvalidValue, format!("unknown {} {}", field.names[0], quoted(word)))
        .expected(format!("expected {}", words.join(" or ")));
    match nearest(word, words.iter().copied()) {
        Some(near) => fault.help(format!("did you mean `{near}`?")),
        None => fault,
    }
}

/// Joins words to a list: `a`, `b`, `c`.
fn listed<'a>(words: impl Iterator<Item = &'a str>) -> String {
    words.map(|word| format!("`{word}`")).collect::<Vec<_>>().join(", ")
}

/// The help text about names.
const NAME_HELP: &str = "a name is a letter or `_`, then letters, digits, `_` and `-`";

pub(super) fn no_name(command: Command, names: Names) -> Fault {
    Fault::new(Code::MalformedName, format!("`{command}` lacks the name of a {}", names.noun()))
        .expected("expected a name here")
        .help(format!("write `{}`", usage(command)))
}

fn usage(command: Command) -> String {
    match command {
        Command::Material => format!("{} CLAUSE ...", command.form()),
        _ => command.form().to_string(),
    }
}

pub(super) fn bad_name(word: &str, names: Names) -> Fault {
    Fault::new(Code::MalformedName, format!("invalid name {}", quoted(word)))
        .expected(format!("expected the name of a {}", names.noun()))
        .help(NAME_HELP)
}

/// Describes an unknown name. `later` is the line in which it is defined, and `nearest` a name that
/// may have been meant.
pub(super) fn unknown_name(names: Names, name: &str, later: Option<usize>, nearest: Option<&str>) -> Fault {
    let noun = names.noun();
    let message = match later {
        Some(line) => format!("the {noun} {} is not known before line {line}", quoted(name)),
        None => format!("unknown {noun} {}", quoted(name)),
    };
    let fault = Fault::new(Code::UnknownName, message)
        .expected(format!("expected a {noun} that is defined before this"));
    match (later, nearest) {
        (Some(line), _) => fault.help(format!("move line {line} up, before this")),
        (None, Some(near)) => fault.help(format!("did you mean `{near}`?")),
        (None, None) => fault,
    }
}

pub(super) fn uses_itself(name: &str) -> Fault {
    Fault::new(Code::UnknownName, format!("the group {} cannot use itself", quoted(name)))
        .expected("expected a group that is defined before this")
}

/// Describes a second definition. `first` is the line of the first one.
pub(super) fn defined_twice(names: Names, name: &str, first: usize) -> Fault {
    let noun = names.noun();
    Fault::new(Code::DuplicateName, format!("there is a {noun} {} already, in line {first}", quoted(name)))
        .expected("expected another name")
}

pub(super) fn unused_name(names: Names) -> Fault {
    let noun = names.noun();
    Fault::new(Code::Unused, format!("this {noun} is not used"))
        .expected(format!("expected something that uses this {noun}"))
}

pub(super) fn no_clause() -> Fault {
    Fault::new(Code::TooFewParameters, "this material has no clauses")
        .expected("expected a clause, such as `diffuse .8 .2 .1`")
        .help(format!("the clauses are {}", listed(Clause::ALL.iter().map(|clause| clause.name()))))
}

pub(super) fn unknown_clause(word: &str) -> Fault {
    let names = || Clause::ALL.iter().map(|clause| clause.name());
    let help = match nearest(word, names()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("the clauses are {}", listed(names())),
    };
    Fault::new(Code::UnknownClause, format!("unknown material clause {}", quoted(word)))
        .expected("expected a clause")
        .help(help)
}

pub(super) fn clause_twice(clause: Clause, first: Clause) -> Fault {
    let message = if clause == first {
        format!("a material has one `{}` only", clause.name())
    } else {
        format!("a material has one pattern only, and this one has `{}`", first.name())
    };
    Fault::new(Code::DuplicateClause, message).expected("expected another clause")
}

/// Describes a clause with `found` numbers that lacks the one called `name`. `color` is the colour in a comment.
pub(super) fn clause_too_short(clause: Clause, name: &str, found: usize, color: Option<[f64; 3]>) -> Fault {
    let found = if found == 0 { "none".to_string() } else { found.to_string() };
    let takes = counts_of(clause.form());
    Fault::new(Code::TooFewParameters, format!("`{}` takes {takes}, found {found}", clause.name()))
        .expected(format!("expected `{name}` here"))
        .help(match color {
            Some(color) => format!("`#` begins a comment; {}", color_help(color)),
            None => format!("write `{}`", clause.form()),
        })
}

pub(super) fn no_pattern_material(clause: Clause) -> Fault {
    Fault::new(Code::MalformedName, format!("`{}` lacks the name of a material", clause.name()))
        .expected("expected a name here")
        .help(format!("write `{}`", clause.form()))
}

pub(super) fn unfit_material(name: &str) -> Fault {
    Fault::new(Code::UnfitMaterial, format!(
            "the material {} cannot be part of a pattern: it has clauses other than `ambient`, `diffuse` and `mirror`",
            quoted(name)
        ))
        .expected("expected a material of `ambient`, `diffuse` and `mirror` only")
}

pub(super) fn end_without_group() -> Fault {
    Fault::new(Code::Misplaced, "`End` without a `Group`").expected("expected a `Group` before this")
}

/// Describes a command that is not allowed in the group that started in line `number`.
pub(super) fn not_in_group(command: Command, name: &str, number: usize) -> Fault {
    Fault::new(Code::Misplaced, format!("`{command}` is not allowed in a group"))
        .expected("expected an object, `Use` or `End`")
        .help(format!("the group {} starts in line {number}; is its `End` missing?", quoted(name)))
}

pub(super) fn group_not_ended() -> Fault {
    Fault::new(Code::UnclosedGroup, "this group has no end").expected("expected an `End` after its objects")
}

pub(super) fn too_far() -> Fault {
    Fault::new(Code::NumberTooLarge, "the group's position or scale overflows")
        .expected("expected values up to 1.79e308")
}

pub(super) fn lens_without_effect() -> Fault {
    Fault::new(Code::Unused, "the lens has no effect with `Orthocamera`")
        .expected("expected a `Look` or `Camera` beside this")
}

/// Describes a setting without effect at one ray per pixel.
pub(super) fn needs_samples(what: &str) -> Fault {
    Fault::new(Code::NeedsSamples, format!("{what} has no effect: there is one ray per pixel"))
        .expected("expected `Samples` before the `Trace`")
        .help("write for example `Samples 64`")
}

pub(super) fn curve_without_frames() -> Fault {
    Fault::new(Code::NoEffect, "this changes from frame to frame, but there is one frame only")
        .expected("expected `Frames` before the `Trace`")
        .help("write for example `Frames 1 50`")
}

pub(super) fn no_panorama(name: &str, [width, height]: [u32; 2]) -> Fault {
    Fault::new(
        Code::UnusedPart,
        format!("`{name}` has {width} x {height} pixels, and is stretched around the scene"),
    )
    .expected("expected a panorama, twice as wide as high")
}

pub(super) fn no_light() -> Fault {
    Fault::new(Code::NoLight, "there is no light: diffuse colours are black")
        .expected("expected an `Ilight` or `Plight` before this")
        .help("write for example `Ilight 1 1 1  -1 -2 -1`")
}

pub(super) fn glass_panes() -> Fault {
    Fault::new(
        Code::GlassPanes,
        "triangles of glass do not refract: each is a thin pane, also where they close a body",
    )
    .expected("expected a shape with an inside")
    .help("bodies refract, such as `Sphere`, `Box`, `Cylinder` and closed meshes; the index 1 says that panes are meant")
}

pub(super) fn narrow_view(angle: f64) -> Fault {
    let degrees = short(angle.to_degrees());
    Fault::new(Code::NarrowView, "a very narrow field of view: the angle is in degrees")
        .expected("expected an angle such as 40")
        .help(format!("if {} is in radians, it is {degrees} degrees", short(angle)))
}

/// Describes a colour that is probably written as levels.
pub(super) fn far_above_one(written: &str) -> Fault {
    let fault = Fault::new(Code::FarAboveOne, "this is far above 1, which is full brightness")
        .expected("expected numbers from 0 to 1");
    let levels: Option<Vec<f64>> = written
        .split([' ', '\t', ','])
        .filter(|word| !word.is_empty())
        .map(|word| word.parse().ok())
        .collect();
    match levels.filter(|levels| levels.iter().all(|level| (0.0..=255.0).contains(level))) {
        Some(levels) => {
            let shares: Vec<_> = levels.iter().map(|level| share(level / 255.0)).collect();
            fault.help(format!("levels from 0 to 255 are divided by 255: `{}`", shares.join(" ")))
        }
        None => fault,
    }
}

/// Describes a `#` directly after a word. `color` is its meaning in other languages.
pub(super) fn glued_comment(color: Option<[f64; 3]>) -> Fault {
    let fault = Fault::new(Code::GluedComment, "`#` begins a comment: nothing from here on counts");
    match color {
        Some(color) => fault
            .expected("expected a colour only where one is needed, or right behind another as `#rrggbb`")
            .help(color_help(color)),
        None => fault.expected("expected a blank before the comment"),
    }
}

fn color_help(color: [f64; 3]) -> String {
    let digits: String = color.iter().map(|share| format!("{:02x}", (255.0 * share).round() as u8)).collect();
    format!("this colour is `#{digits}`, or `{}` as numbers", color.map(share).join(" "))
}

/// Formats a share with three digits.
fn share(x: f64) -> String {
    format!("{x:.3}").parse::<f64>().unwrap_or(x).to_string()
}

/// Warns of pixels that are not square. `better` is a window with square pixels.
pub(super) fn non_square_pixels(screen: Screen, better: [f64; 4]) -> Fault {
    let better: Vec<_> = better.iter().map(|x| short(*x)).collect();
    Fault::new(Code::SquashedImage, "the pixels are not square: a sphere looks like an ellipse")
        .expected(format!("expected a window of the shape {} : {}", screen.width(), screen.height()))
        .help(format!("write for example `{}`", better.join(" ")))
}

/// Formats a number with six digits.
fn short(x: f64) -> String {
    format!("{x:.5e}").parse::<f64>().unwrap_or(x).to_string()
}

/// Describes more frames than the limit of a script.
pub(super) fn too_many_frames(frames: u64, limit: u64) -> Fault {
    let more = if frames == limit + 1 {
        "this is one more".to_string()
    } else {
        format!("with this there are {}", grouped(frames))
    };
    let limit = grouped(limit);
    Fault::new(Code::LimitExceeded, format!("more than {limit} frames"))
        .expected(format!("expected at most {limit}, {more}"))
}

pub(super) fn too_many_pixels(pixels: u64, limit: u64) -> Fault {
    let [pixels, limit] = [pixels, limit].map(grouped);
    Fault::new(Code::LimitExceeded, format!("the image has {pixels} pixels, the limit is {limit}"))
        .expected("expected a smaller image")
        .help("make the image smaller or raise the limit")
}

/// Describes a limit that is exceeded. The last `added` items make the total `count`.
pub(super) fn beyond_limit(added: usize, count: usize, limit: usize, what: &str) -> Fault {
    let limit_text = grouped(limit as u64);
    let more = if added == 1 && count == limit + 1 {
        "this is one more".to_string()
    } else if count == usize::MAX {
        "with this there are many more".to_string()
    } else {
        format!("with this there are {}", grouped(count as u64))
    };
    Fault::new(Code::LimitExceeded, format!("more than {limit_text} {what}"))
        .expected(format!("expected at most {limit_text}, {more}"))
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

pub(super) fn lint_fault(lint: Lint) -> Fault {
    match lint {
        Lint::NoRadius => Fault::new(Code::Unused, "nothing is drawn: the radius is 0")
            .expected("expected a number greater than 0, or a curve that is not always 0"),
        Lint::DegenerateTriangle => {
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

/// Returns the colour for a comment that is a colour in other languages: `#ff8000` or `#f80`.
pub(super) fn color_at(comment: &str) -> Option<[f64; 3]> {
    let digits = comment.strip_prefix('#')?.split([' ', '\t', ',']).next()?;
    if !digits.bytes().all(|b| b.is_ascii_hexdigit()) {
        return None;
    }
    let level = |i: usize, length: usize| {
        let digits = &digits[i * length..(i + 1) * length];
        let level = u32::from_str_radix(digits, 16).unwrap_or_default();
        f64::from(if length == 1 { 17 * level } else { level }) / 255.0
    };
    let is_number = digits.bytes().any(|b| b.is_ascii_digit());
    let is_one_letter = || digits.bytes().all(|b| digits.as_bytes()[0].eq_ignore_ascii_case(&b));
    match digits.len() {
        // Words such as `add` are comments.
        _ if !is_number && !is_one_letter() => None,
        3 => Some([0, 1, 2].map(|i| level(i, 1))),
        6 | 8 => Some([0, 1, 2].map(|i| level(i, 2))),
        _ => None,
    }
}
