//! Parses the text of a curve: `(smooth 1:0 25:3)`.

use std::ops::Range;

use super::number::{self, NumberFault};
use super::text::next_word;
use crate::curve::{CYCLE, Curve, Key, Mode, Overflow};
use crate::row::Number;

/// The error in a curve.
#[derive(Debug, PartialEq)]
pub(super) enum CurveFault {
    /// The closing bracket is missing.
    Unclosed,
    /// There is no key.
    NoKey,
    /// A word is neither a key nor a mode.
    NotAMode(String),
    /// A mode comes after another mode or after a key.
    MisplacedMode(String),
    /// A character is unexpected: a second `(`, or a `:` without a frame before it.
    Stray(String),
    /// A frame has no `:` and value.
    NoValue,
    /// Four numbers do not follow `bezier`.
    FewNumbers,
    /// A number of `bezier` that must be 0 to 1 is not: its name and its value.
    OutsideShare(&'static str, f64),
    /// A frame or a value is no number.
    BadNumber(NumberFault, &'static str, String),
    /// A frame is not greater than the one before it.
    OutOfOrder(f64, f64),
    /// A cycle has only one key.
    ShortCycle,
    /// The numbers overflow between two keys.
    Overflow(f64, f64),
}

/// Parses a word of a line as a curve, from its opening bracket to the closing one. Accepts a single key, which a
/// scene treats as a constant number. Returns `None` for any other word.
pub fn parse_curve(word: &str) -> Option<Curve> {
    let is_one = word.starts_with('(') && word.find(')').is_some_and(|end| end + 1 == word.len());
    if is_one { read(word, 0..word.len()).ok() } else { None }
}

/// Parses the curve that `text` holds at `span`, from its opening bracket on. A curve of one key
/// is a constant number.
///
/// # Errors
/// Returns the first fault and its place.
pub(super) fn parse(text: &str, span: Range<usize>) -> Result<Number, (Range<usize>, CurveFault)> {
    read(text, span).map(|curve| match *curve.keys() {
        [key] => Number::Constant(key.value),
        _ => Number::Animated(Box::new(curve)),
    })
}

fn read(text: &str, span: Range<usize>) -> Result<Curve, (Range<usize>, CurveFault)> {
    let bytes = &text.as_bytes()[..span.end];
    if !text[span.clone()].ends_with(')') {
        return Err((span.start..span.start + 1, CurveFault::Unclosed));
    }
    let mut at = span.start + 1;
    let mut mode = None;
    let mut cycle = false;
    let mut keys: Vec<Key> = Vec::new();
    let mut places: Vec<Range<usize>> = Vec::new();
    loop {
        let Some(word) = next_word(bytes, &mut at) else { return Err((span, CurveFault::Unclosed)) };
        let word_text = &text[word.clone()];
        match word_text {
            ")" => break,
            "(" | ":" => return Err((word, CurveFault::Stray(word_text.to_owned()))),
            _ => {}
        }
        if word_text.starts_with(|c: char| c.is_ascii_alphabetic()) {
            let known = Mode::ALL.iter().copied().find(|mode| mode.name().eq_ignore_ascii_case(word_text));
            let is_cycle = word_text.eq_ignore_ascii_case(CYCLE);
            let is_again = if is_cycle { cycle } else { mode.is_some() };
            match known {
                None if !is_cycle => return Err((word, CurveFault::NotAMode(word_text.to_owned()))),
                _ if is_again || !keys.is_empty() => {
                    return Err((word, CurveFault::MisplacedMode(word_text.to_owned())));
                }
                None => cycle = true,
                Some(Mode::Bezier(_)) => mode = Some(Mode::Bezier(read_points(text, bytes, word, &mut at)?)),
                Some(known) => mode = Some(known),
            }
            continue;
        }
        let read = |word, name| read_number(text, word, name);
        let frame = read(word.clone(), "frame")?;
        let colon = next_word(bytes, &mut at);
        if colon.is_none_or(|colon| &text[colon] != ":") {
            return Err((word, CurveFault::NoValue));
        }
        let value = match next_word(bytes, &mut at) {
            Some(value) if !matches!(&text[value.clone()], "(" | ")" | ":") => read(value.clone(), "value")?,
            _ => return Err((word, CurveFault::NoValue)),
        };
        if let Some(last) = keys.last()
            && last.frame >= frame
        {
            return Err((word, CurveFault::OutOfOrder(last.frame, frame)));
        }
        keys.push(Key { frame, value });
        places.push(word.start..at);
    }
    match keys[..] {
        [] => Err((span, CurveFault::NoKey)),
        [_] if cycle => Err((span, CurveFault::ShortCycle)),
        _ => match Curve::new(mode.unwrap_or_default(), cycle, keys.clone()) {
            Ok(curve) => Ok(curve),
            Err(Overflow(i)) => {
                let place = places[i].start..places[i + 1].end;
                Err((place, CurveFault::Overflow(keys[i].frame, keys[i + 1].frame)))
            }
        },
    }
}

fn read_number(
    text: &str,
    word: Range<usize>,
    name: &'static str,
) -> Result<f64, (Range<usize>, CurveFault)> {
    let word_text = &text[word.clone()];
    number::parse(word_text).map_err(|fault| (word, CurveFault::BadNumber(fault, name, word_text.to_owned())))
}

/// Reads the four numbers after `bezier`, which is at `mode`.
fn read_points(
    text: &str,
    bytes: &[u8],
    mode: Range<usize>,
    at: &mut usize,
) -> Result<[f64; 4], (Range<usize>, CurveFault)> {
    let is_mark = |word: &Range<usize>| matches!(&text[word.clone()], "(" | ")" | ":");
    let mut points = [0.0; 4];
    for (point, name) in points.iter_mut().zip(["a", "b", "c", "d"]) {
        let Some(word) = next_word(bytes, at).filter(|word| !is_mark(word)) else {
            return Err((mode, CurveFault::FewNumbers));
        };
        // A number before a colon is the frame of a key.
        if next_word(bytes, &mut at.clone()).is_some_and(|next| &text[next] == ":") {
            return Err((mode, CurveFault::FewNumbers));
        }
        *point = read_number(text, word.clone(), name)?;
        if matches!(name, "a" | "c") && !(0.0..=1.0).contains(point) {
            return Err((word, CurveFault::OutsideShare(name, *point)));
        }
    }
    Ok(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Result<String, (Range<usize>, CurveFault)> {
        parse(text, 0..text.len()).map(|number| match number {
            Number::Constant(value) => value.to_string(),
            Number::Animated(curve) => curve.to_string(),
            Number::Level(_) => unreachable!("a curve has no levels"),
        })
    }

    #[test]
    fn curves_are_read_as_they_are_written() {
        let check = |text: &str, written: &str| assert_eq!(parsed(text).as_deref(), Ok(written), "{text}");
        check("(1:0 2:3)", "(1:0 2:3)");
        check("( LINEAR 1 : 0,2:3 )", "(1:0 2:3)");
        check("(cycle Smooth -1e3:.5\t7:1e-9)", "(smooth cycle -1000:0.5 7:1e-9)");
        check("(step Cycle 1:0 2:3 4:-0)", "(step cycle 1:0 2:3 4:-0)");
        check("(5:3)", "3");
        check("(InOut 1:0 2:3)", "(inout 1:0 2:3)");
        check("(bezier .25 -1 .25 2.5 cycle 1:0 2:3)", "(bezier 0.25 -1 0.25 2.5 cycle 1:0 2:3)");
        check("(cycle bezier 0,0,1,1,1:0 2:3)", "(bezier 0 0 1 1 cycle 1:0 2:3)");
        check("(bezier 0 0 1 1 5:3)", "3");
        check("(smooth 5:3)", "3");
    }

    #[test]
    fn a_word_alone_is_read_to_its_end() {
        assert_eq!(parse_curve("(smooth 5:3)").unwrap().to_string(), "(smooth 5:3)");
        assert_eq!(parse_curve("(CYCLE 1:0 2:3)").unwrap().to_string(), "(cycle 1:0 2:3)");
        for none in ["", "3", "(", "()", "(cycle 1:0)", "(1:0 2:3", "(1:0) 2", "(1:0)(2:0)", "x(1:0)"] {
            assert_eq!(parse_curve(none), None, "{none}");
        }
    }

    #[test]
    fn faults_have_their_place() {
        let check = |text: &str, place: &str, fault: CurveFault| {
            let (span, found) = parsed(text).unwrap_err();
            assert_eq!((&text[span], found), (place, fault), "{text}");
        };
        check("(1:0 2:3", "(", CurveFault::Unclosed);
        check("()", "()", CurveFault::NoKey);
        check("(smooth)", "(smooth)", CurveFault::NoKey);
        check("(smoth 1:0)", "smoth", CurveFault::NotAMode("smoth".into()));
        check("(smooth step 1:0)", "step", CurveFault::MisplacedMode("step".into()));
        check("(cycle cycle 1:0)", "cycle", CurveFault::MisplacedMode("cycle".into()));
        check("(1:0 smooth 2:1)", "smooth", CurveFault::MisplacedMode("smooth".into()));
        check("(bezier 1:0 2:1)", "bezier", CurveFault::FewNumbers);
        check("(bezier .1 .2 .3 1:0 2:1)", "bezier", CurveFault::FewNumbers);
        check("(bezier .1 .2 .3)", "bezier", CurveFault::FewNumbers);
        check("(bezier .1 (1:0 2:1) .3 1 1:0)", "bezier", CurveFault::FewNumbers);
        check("(bezier .1 .2 1.5 1 1:0 2:1)", "1.5", CurveFault::OutsideShare("c", 1.5));
        check(
            "(bezier .1 x .5 1 1:0 2:1)",
            "x",
            CurveFault::BadNumber(NumberFault::Malformed, "b", "x".into()),
        );
        check("(back elastic 1:0)", "elastic", CurveFault::MisplacedMode("elastic".into()));
        check("(1:0 (2:1)", "(", CurveFault::Stray("(".into()));
        check("(1:0 :1)", ":", CurveFault::Stray(":".into()));
        check("(1:0 2)", "2", CurveFault::NoValue);
        check("(1:0 2:)", "2", CurveFault::NoValue);
        check("(1 0 2 1)", "1", CurveFault::NoValue);
        check("(1:0 1:1)", "1", CurveFault::OutOfOrder(1.0, 1.0));
        check("(cycle 1:0)", "(cycle 1:0)", CurveFault::ShortCycle);
        check("(0:0 1:-1e308 2:1e308)", "1:-1e308 2:1e308", CurveFault::Overflow(1.0, 2.0));
    }
}
