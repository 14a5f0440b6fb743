//! The messages about words in quotes: files, and the letters of a text.

use rayfold_assets::{AssetError, Closure, LetterError, NameFault};

use crate::command::Command;
use crate::diagnostic::Code;
use crate::form::Quotes;
use crate::model::Clause;
use crate::parse::text::QuoteFault;
use crate::report::Fault;
use crate::shown::quoted;

/// Describes a missing word in quotes, or `word` in its place.
pub(in crate::parse) fn no_quotes(command: Command, quotes: Quotes, word: Option<&str>) -> Fault {
    let (lacks, expected) = match quotes {
        Quotes::File => ("names no file", "expected the name of a file in quotes, as in `\"teapot.obj\"`"),
        Quotes::Words => ("has no words", "expected words in quotes, as in `\"Hello\"`"),
    };
    let message = match word {
        None => format!("`{command}` {lacks}"),
        Some(word) => format!("{} is not in quotes", quoted(word)),
    };
    Fault::new(Code::MalformedQuote, message)
        .expected(expected)
        .help(format!("a line is `{}`", command.form()))
}

pub(in crate::parse) fn malformed_quote(fault: QuoteFault) -> Fault {
    let (message, expected) = match fault {
        QuoteFault::Open => {
            ("the quotes are not closed".to_string(), "expected `\"` before the end of the line")
        }
        QuoteFault::Glued => ("quotes within a word".to_string(), "expected blanks around a word in quotes"),
        QuoteFault::Escape(c) => {
            (format!("`\\{c}` means nothing in quotes"), "expected `\\\"`, `\\\\` or `\\n`")
        }
    };
    Fault::new(Code::MalformedQuote, message).expected(expected)
}

pub(in crate::parse) fn no_file_name(fault: NameFault) -> Fault {
    Fault::new(Code::MalformedQuote, fault.to_string())
        .expected("expected the plain name of a file in the script's own folder, as in `\"teapot.obj\"`")
}

pub(in crate::parse) fn unusable_file(error: &AssetError) -> Fault {
    let code = match error {
        AssetError::Absent { .. } => Code::AbsentFile,
        _ => Code::UnusableFile,
    };
    let fault = Fault::new(code, error.to_string());
    match error.help() {
        Some(help) => fault.help(help),
        None => fault,
    }
}

pub(in crate::parse) fn two_paths(one: &str, other: &str) -> Fault {
    Fault::new(Code::UnusableFile, format!("`{one}` and `{other}` would be one file in the script's folder"))
        .help("rename one of them, and export the model again")
}

pub(in crate::parse) fn model_doubt(file: &str, warning: &str) -> Fault {
    Fault::new(Code::UnusedPart, format!("`{file}`: {warning}"))
}

/// Describes glass of triangles that close no body. `what` is the text of the word in quotes.
pub(in crate::parse) fn open_glass(what: &str, closure: &Closure) -> Fault {
    let why = match closure {
        Closure::Open([a, b]) => {
            format!("is open at the edge from {} {} {} to {} {} {}", a.x, a.y, a.z, b.x, b.y, b.z)
        }
        Closure::InsideOut => "is inside out: its faces are seen clockwise from outside".to_string(),
        Closure::NoVolume | Closure::Closed => "has no volume".to_string(),
    };
    let help = match closure {
        Closure::Open(_) => {
            "a closed model refracts. Points that differ by roundoff leave a gap: merge them by distance before the export"
        }
        _ => "a closed model, whose faces are seen counterclockwise from outside, refracts",
    };
    Fault::new(Code::GlassPanes, format!("{what} {why}, so its glass is panes that do not refract"))
        .help(help)
}

pub(in crate::parse) fn own_without_file(command: Command) -> Fault {
    Fault::new(Code::NoEffect, format!("`own` has no effect on a `{command}`"))
        .help("the colours of a file are those of a `Mesh`")
}

pub(in crate::parse) fn no_image_file(word: Option<&str>) -> Fault {
    let message = match word {
        None => "`image` names no file".to_string(),
        Some(word) => format!("{} is not in quotes", quoted(word)),
    };
    Fault::new(Code::MalformedQuote, message)
        .expected("expected the name of a picture in quotes, as in `\"earth.png\"`")
        .help(format!("write `{}`", Clause::Image.form()))
}

pub(in crate::parse) fn no_map(word: Option<&str>) -> Fault {
    let fault = match word {
        None => Fault::new(Code::TooFewParameters, "`image` does not say how the picture lies"),
        Some(word) => {
            Fault::new(Code::InvalidValue, format!("{} is no way in which a picture lies", quoted(word)))
        }
    };
    fault.expected("expected `uv`, `flat` or `ball`").help(format!("write `{}`", Clause::Image.form()))
}

pub(in crate::parse) fn no_image_width() -> Fault {
    Fault::new(Code::TooFewParameters, "`flat` lacks the width of the picture")
        .expected("expected a length, as in `flat 2`")
}

pub(in crate::parse) fn no_uv(command: Command, file: Option<&str>) -> Fault {
    let what = match file {
        Some(file) => format!("the model `{file}` has no texture coordinates"),
        None => format!("a `{command}` has no texture coordinates"),
    };
    Fault::new(Code::UnfitMaterial, format!("{what}, which a picture with `uv` needs"))
        .help("`flat` and `ball` place a picture on any object")
}

pub(in crate::parse) fn sky_in_fog() -> Fault {
    Fault::new(Code::NoEffect, "the sky has no effect: fog hides it")
        .help("`Fog none` ends the fog, and `Background` the sky")
}

pub(in crate::parse) fn no_smooth_angle() -> Fault {
    Fault::new(Code::TooFewParameters, "`smooth` lacks its angle")
        .expected("expected an angle from 0 to 180 degrees, as in `smooth 30`")
}

pub(in crate::parse) fn bad_smooth_angle(word: &str) -> Fault {
    Fault::new(Code::InvalidValue, format!("{} is no angle of `smooth`", quoted(word)))
        .expected("expected a number from 0 to 180, not a curve")
}

/// Describes a word after the surface that is not one of the command's.
pub(in crate::parse) fn unknown_option(command: Command, word: &str) -> Fault {
    let options: Vec<_> = command.form().options.iter().map(|option| format!("`{option}`")).collect();
    let (last, others) = options.split_last().map_or(("", &[][..]), |(last, others)| (last, others));
    let message = format!("{} is neither a material nor {} or {last}", quoted(word), others.join(", "));
    Fault::new(Code::TooManyParameters, message)
        .help(format!("a line is `{}`; a `Use` moves what it draws", command.form()))
}

pub(in crate::parse) fn too_many_mesh_options() -> Fault {
    Fault::new(Code::TooManyParameters, "there is more behind the normals of the mesh")
        .help("a line is `Mesh \"FILE\" [M] [smooth a or flat]`")
}

pub(in crate::parse) fn unusable_letters(error: &LetterError) -> Fault {
    let fault = Fault::new(Code::UnusableFile, error.to_string());
    match error.help() {
        Some(help) => fault.help(help),
        None => fault,
    }
}

pub(in crate::parse) fn blank_text() -> Fault {
    Fault::new(Code::Unused, "nothing is drawn: the text has no letter with an outline")
}

/// Describes a word after `font` that names no file, or the lack of one.
pub(in crate::parse) fn no_font(word: Option<&str>) -> Fault {
    let message = match word {
        None => "`font` names no file".to_string(),
        Some(word) => format!("{} is not in quotes", quoted(word)),
    };
    Fault::new(Code::MalformedQuote, message)
        .expected("expected the name of a font's file in quotes, as in `font \"Lora.ttf\"`")
}

pub(in crate::parse) fn text_option_again(word: &str) -> Fault {
    Fault::new(Code::TooManyParameters, format!("{} is one word too many", quoted(word)))
        .expected("expected one of `left`, `centre` and `right`, and one font")
}

pub(in crate::parse) fn unknown_text_option(word: &str) -> Fault {
    let fault = Fault::new(
        Code::TooManyParameters,
        format!("{} is none of `left`, `centre`, `right` and `font`", quoted(word)),
    );
    if word.eq_ignore_ascii_case("center") {
        return fault.help("write `centre`");
    }
    fault.help("the size, the depth and the material stand before these words")
}
