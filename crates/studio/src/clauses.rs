//! The clauses of a material: the positions of their numbers and words in the line, and changes of a word.
//!
//! Knows clauses only by their forms. Invariant: a word changes to one of those that its parameter offers.

use std::ops::Range;

use rayfold_scene::{Clause, Field, Form, Kind, Parameter, Presence, Quotes, Subject, quoted_word};

use crate::line::Line;
use crate::tables::FieldTable;

/// The names that words of a clause may refer to.
pub(crate) struct Offers {
    /// The materials that have only coefficients and are defined before the line.
    pub(crate) materials: Vec<String>,
    /// The pictures beside the script.
    pub(crate) pictures: Vec<String>,
}

/// Returns the clauses of a material, each with its words, given the words from its name on.
pub(crate) fn clauses(line: &Line) -> Vec<(Clause, Range<usize>)> {
    let Some(words) = line.words() else { return Vec::new() };
    let found = words.parameters.iter().enumerate();
    let found = found.filter_map(|(at, word)| Some((at, Clause::from_name(line.word(word))?)));
    let starts: Vec<_> = found.collect();
    let ends = starts.iter().skip(1).map(|(at, _)| *at).chain([words.parameters.len()]);
    starts.iter().zip(ends).map(|(&(at, clause), end)| (clause, at..end)).collect()
}

/// Returns the parameters of a clause, each with the position of its first number or word. An omitted one has the
/// position at which it would be.
fn parameters(line: &Line, clause: Clause, span: &Range<usize>) -> Vec<(usize, &'static Field)> {
    let form: &'static Form = clause.form();
    let start = span.start + 1 + usize::from(form.subject.is_some());
    let place = |next: &mut usize, field: &'static Field| {
        let at = *next;
        *next += field.names.len();
        Some((at, field))
    };
    form.parameters_behind(word(line, start)).scan(start, place).collect()
}

/// Returns the parameters of a material that are numbers, each with the position of its first one.
pub(crate) fn numbers(line: &Line) -> Vec<(usize, &'static Field)> {
    let all = clauses(line).into_iter().flat_map(|(clause, span)| {
        let within = span.end;
        parameters(line, clause, &span).into_iter().filter(move |(at, _)| *at < within)
    });
    all.filter(|(_, field)| field.kind != Kind::Word).collect()
}

/// Returns the parameters of a material for the page, in the order of its line.
pub(crate) fn fields(line: &Line, offers: &Offers) -> Vec<FieldTable> {
    let mut fields = Vec::new();
    for (clause, span) in clauses(line) {
        let form = clause.form();
        if form.subject == Some(Subject::Quotes(Quotes::File)) {
            let pictures = offers.pictures.iter().map(|name| quoted_word(name)).collect();
            fields.push(FieldTable::of_names("picture", span.start + 1, pictures));
        }
        let stands = |(at, field): &(usize, &Field)| *at < span.end || field.kind == Kind::Word;
        let all = parameters(line, clause, &span).into_iter().filter(stands);
        fields.extend(all.map(|(at, field)| FieldTable::new(at, field)));
        if form.ends_with.is_some() {
            fields.push(FieldTable::of_names("other material", span.end - 1, offers.materials.clone()));
        }
    }
    fields
}

/// Returns a line with another word at a position, which one of its `fields` offers.
pub(crate) fn with_word(line: &Line, fields: &[FieldTable], at: usize, to: &str) -> Option<Line> {
    let offered = |field: &&FieldTable| field.first == at && field.words.iter().any(|word| word == to);
    let field = fields.iter().find(offered)?;
    let all = clauses(line);
    let Some((clause, span)) = all.into_iter().find(|(_, span)| (span.start..=span.end).contains(&at)) else {
        return line.with_words(&[(at, to.to_owned())]);
    };
    let form = clause.form();
    let is_before = at == span.start + 1 + usize::from(form.subject.is_some());
    if let Some(words) = form.words.as_ref().filter(|_| is_before) {
        let alone = if at + 1 < span.end { line.without(at + 1..span.end)? } else { line.clone() };
        return match (words.with_numbers == to, words.with_numbers.eq_ignore_ascii_case(word(line, at))) {
            (true, true) => Some(line.clone()),
            (true, false) => alone.with_words(&[(at, initial(form).join(" "))]),
            (false, _) => alone.with_words(&[(at, to.to_owned())]),
        };
    }
    let now = word(line, at);
    let is_omitted = field.optional && !field.words.iter().any(|word| word.eq_ignore_ascii_case(now));
    // An omitted word comes before that of another clause.
    let text =
        if is_omitted && at < line.words()?.parameters.len() { format!("{to} {now}") } else { to.to_owned() };
    line.with_words(&[(at, text)])
}

/// Returns the words and numbers with which a new clause begins.
pub(crate) fn initial(form: &Form) -> Vec<String> {
    let stands = |field: &&Field| form.words.is_some() || field.presence == Presence::Required;
    let numbers = form.fields.iter().filter(stands).flat_map(|field| {
        let value = match field.parameter {
            Parameter::ShineExponent => "60",
            Parameter::Ior => "1.5",
            Parameter::GradientStart => "0",
            Parameter::GradientEnd | Parameter::PictureWidth | Parameter::Glow => "1",
            Parameter::Glass => "0.95",
            Parameter::Ambient => "0.1",
            Parameter::Roughness => "0.2",
            _ => "0.5",
        };
        vec![value.to_owned(); field.names.len()]
    });
    form.words.iter().map(|words| words.with_numbers.to_owned()).chain(numbers).collect()
}

fn word(line: &Line, at: usize) -> &str {
    let word = line.words().and_then(|words| words.parameters.get(at).cloned());
    word.map_or("", |word| line.word(&word))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "Material m  diffuse 1 1 1  image \"a b.png\"  flat (1:1 9:2)  rough .5   # wall";

    fn offers() -> Offers {
        let texts = |all: &[&str]| all.iter().map(|&text| text.to_owned()).collect();
        Offers { materials: texts(&["dark", "red"]), pictures: texts(&["a b.png", "c.png"]) }
    }

    fn set(text: &str, at: usize, to: &str) -> Option<String> {
        let line = Line::new(text);
        Some(with_word(&line, &fields(&line, &offers()), at, to)?.text())
    }

    #[test]
    fn every_word_of_a_clause_is_a_field() {
        let line = Line::new(TEXT);
        let found: Vec<_> =
            fields(&line, &offers()).into_iter().map(|field| (field.first, field.label)).collect();
        let expected =
            [(1, "diffuse coefficient"), (5, "picture"), (6, "mapping"), (7, "width s"), (8, "axes")];
        let expected = expected.into_iter().chain([(9, "roughness a")]);
        assert!(found.iter().map(|(at, label)| (*at, label.as_str())).eq(expected), "{found:?}");
        let numbers: Vec<_> = numbers(&line).into_iter().map(|(at, _)| at).collect();
        assert_eq!(numbers, [1, 7, 9]);
        let ball = Line::new("Material m image \"c.png\" BALL");
        assert_eq!(fields(&ball, &offers()).len(), 2);
        let checks = Line::new("Material m checker .5 dark own");
        assert_eq!(fields(&checks, &offers())[1].words, ["dark", "red"]);
    }

    #[test]
    fn a_word_changes_and_brings_or_takes_what_stands_behind_it() {
        assert_eq!(set(TEXT, 5, "\"c.png\"").unwrap(), TEXT.replace("a b", "c"));
        assert_eq!(set(TEXT, 8, "zy").unwrap(), TEXT.replace("  rough", "  zy rough"));
        let ball = set(TEXT, 6, "ball").unwrap();
        assert_eq!(ball, TEXT.replace("flat (1:1 9:2)", "ball"));
        assert_eq!(set(&ball, 6, "flat").unwrap(), TEXT.replace("(1:1 9:2)", "1"));
        assert_eq!(set(TEXT, 6, "flat").unwrap(), TEXT);
        let last = "Material m image \"c.png\" flat 2";
        let named = set(last, 4, "xz").unwrap();
        assert_eq!(named, format!("{last} xz"));
        assert_eq!(set(&named, 4, "xy").unwrap(), format!("{last} xy"));
        assert_eq!(set(&named, 2, "uv").unwrap(), "Material m image \"c.png\" uv");
        assert_eq!(set("Material m checker .5 dark own", 2, "red").unwrap(), "Material m checker .5 red own");
    }

    #[test]
    fn only_what_is_offered_is_set() {
        for (at, word) in [(5, "\"d.png\""), (5, "c.png"), (6, "cube"), (7, "2"), (9, "red"), (99, "uv")] {
            assert_eq!(set(TEXT, at, word), None, "{at} {word}");
        }
    }
}
