//! The syntax of a command: its name and its parameters, but not its effect.
//!
//! Each type that a line of a script can hold defines its syntax once ([`Scripted`]). The parser, the writer, the
//! hints, editors and the documentation's test use only this definition. [`crate::Command`] lists all commands;
//! this module knows none.
//!
//! Invariants: optional parameters follow required ones. Written numbers read back bit for bit.

mod color;
mod line;

use std::fmt::{self, Display, Formatter};
use std::ops::Range;

pub use color::color_levels;
pub use line::quoted_word;
pub(crate) use line::{Line, Numbers, write_line, write_number};

use crate::model::{Faults, Parameter};

/// The syntax of a command, or of a clause of a material.
#[derive(Debug)]
pub struct Form {
    /// The name. Scripts may write it in any letter case.
    pub name: &'static str,
    /// The name before the numbers, if there is one.
    pub subject: Option<Subject>,
    /// The parameters in order, the optional ones last.
    pub fields: &'static [Field],
    /// The constraints on several numbers.
    pub constraints: &'static [Constraint],
    /// Whether the numbers may be curves.
    pub curves: bool,
    /// The name after the numbers, if there is one.
    pub ends_with: Option<Names>,
    /// A word that may stand in place of all numbers.
    pub word: Option<&'static str>,
    /// The numbers, as indices, that hide the object if all of them are 0.
    radii: &'static [usize],
    /// The count of required numbers.
    required: usize,
    /// The largest count of numbers.
    most: usize,
    /// The first number that the name of a material may replace, together with all that follow.
    surface: Option<usize>,
    /// Whether the numbers of the surface may be omitted together.
    may_be_bare: bool,
    /// The words among the numbers of a clause.
    pub words: Option<Words>,
    /// The words that may follow the numbers, each with its own arguments.
    pub options: &'static [&'static str],
    /// The count of numbers at the start that are never curves.
    fixed: usize,
    /// The usage, if it is not derived from the parameters.
    usage: Option<&'static str>,
}

/// A name that follows the command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subject {
    /// The line defines the name.
    Defines(Names),
    /// The line refers to a name defined before.
    Refers(Names),
    /// The word is in quotes.
    Quotes(Quotes),
}

/// The meaning of a word in quotes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quotes {
    /// The plain name of a file in the script's own folder.
    File,
    /// Words that are drawn as letters.
    Words,
}

/// A kind of named items. Each kind has its own names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Names {
    /// The names of materials.
    Materials,
    /// The names of groups.
    Groups,
}

/// The words among the numbers of a clause: one before them, and one after them.
#[derive(Debug)]
pub struct Words {
    /// The word before the numbers.
    pub before: Field,
    /// The only value of `before` after which there are more words and numbers.
    pub with_numbers: &'static str,
    /// The word behind the numbers.
    pub behind: Field,
}

/// A parameter of a command: a number or the components of a vector.
#[derive(Debug)]
pub struct Field {
    /// The meaning of the parameter.
    pub parameter: Parameter,
    /// The names of its numbers.
    pub names: &'static [&'static str],
    /// The quantity that its numbers measure.
    pub kind: Kind,
    /// The allowed values, all of which are finite.
    pub values: Values,
    /// Whether the parameter is optional.
    pub presence: Presence,
}

/// Whether a parameter is optional, and its default.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Presence {
    /// The parameter is required.
    Required,
    /// The parameter is given whole or omitted.
    Optional(&'static str),
    /// The numbers may be omitted one by one, from the end.
    FromTheEnd(&'static str),
}

/// The quantity that numbers measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A count in this unit.
    Count(Unit),
    /// A length in world units.
    Length,
    /// A position in the world.
    Position,
    /// A position in the plane of the camera's window.
    WindowPosition,
    /// A direction, of any length.
    Direction,
    /// An angle in degrees.
    Angle,
    /// Angles about the three axes.
    Rotation,
    /// A number without unit.
    Plain,
    /// Red, green and blue.
    Color,
    /// The share of light that a surface scatters, reflects or transmits, for red, green and blue.
    Coefficients,
    /// An error of a picture.
    Error,
    /// A word instead of a number.
    Word,
}

/// The unit of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Pixels of the image.
    Pixels,
    /// Rays of a pixel.
    Rays,
    /// Reflections and refractions of a ray.
    Bounces,
    /// Frames of the animation.
    Frames,
    /// Levels of a channel, from 0 to 255.
    Levels,
    /// Lengths in world units, which the script chooses.
    World,
    /// Brightness on the screen: 0 is black, 1 the brightest.
    Display,
    /// Degrees of an angle.
    Degrees,
    /// A number without unit.
    One,
}

/// The allowed values of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Values {
    /// All numbers.
    Any,
    /// All numbers; below 0 they count as 0, and above 1 as 1.
    Clamped,
    /// Numbers greater than 0.
    Positive,
    /// Numbers of at least 0.
    NotNegative,
    /// Numbers of at least 1.
    AtLeastOne,
    /// Numbers from 0 to 1.
    Share,
    /// Numbers from 0 to below 180.
    HalfTurn,
    /// Numbers above 0 and below 180.
    FieldOfView,
    /// Vectors with a component other than 0.
    NotZero,
    /// Whole numbers in a range.
    Whole(u32, u32),
    /// One of some words, in any letter case. It is stored as its index.
    OneOf(&'static [&'static str]),
}

/// A constraint on several parameters, given by their field indices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Constraint {
    /// Two positions or numbers differ.
    Differ(usize, usize),
    /// Two positions differ in every component.
    DifferEverywhere(usize, usize),
    /// Two directions are not parallel.
    NotParallel(usize, usize),
    /// The direction from the first position to the second is not parallel to the third field, if
    /// that direction is given.
    LooksAside(usize, usize, usize),
    /// The first number is greater than the second.
    Greater(usize, usize),
    /// Twice the first number is at most the difference of the two positions, in every component.
    FitsTwice(usize, usize, usize),
    /// Whole numbers: the first is at most the second.
    InOrder(usize, usize),
}

/// An item of the model that a line of a script holds.
pub(crate) trait Scripted: Sized {
    /// The syntax of the line.
    const FORM: Form;

    /// Makes the item from the numbers of a line, or returns all errors in them.
    fn read(numbers: &mut Numbers<'_>) -> Result<Self, Faults>;

    /// Writes the numbers in the order of the form.
    fn write(&self, line: &mut Line<'_, '_>) -> fmt::Result;
}

impl Form {
    pub(crate) const fn new(name: &'static str, fields: &'static [Field]) -> Self {
        let (mut required, mut most, mut surface, mut i) = (0, 0, None, 0);
        while i < fields.len() {
            let count = fields[i].names.len();
            let needed = matches!(fields[i].presence, Presence::Required);
            assert!(!needed || required == most, "what may be left out comes last");
            if matches!(fields[i].parameter, Parameter::Ambient) && i > 0 {
                surface = Some(most);
            }
            required += if needed { count } else { 0 };
            most += count;
            i += 1;
        }
        let (subject, constraints, curves, ends_with, word, radii) = (None, &[], true, None, None, &[]);
        Self {
            name,
            subject,
            fields,
            constraints,
            curves,
            ends_with,
            word,
            radii,
            required,
            most,
            surface,
            may_be_bare: false,
            words: None,
            options: &[],
            fixed: 0,
            usage: None,
        }
    }

    /// Sets the usage, for a line that is more than a row of numbers.
    pub(crate) const fn with_usage(self, usage: &'static str) -> Self {
        Self { usage: Some(usage), ..self }
    }

    /// Allows the numbers of the surface to be omitted together.
    pub(crate) const fn with_optional_surface(self) -> Self {
        let surface = match self.surface {
            Some(first) => first,
            None => 0,
        };
        Self { surface: Some(surface), may_be_bare: true, ..self }
    }

    /// Adds words before and behind the numbers.
    pub(crate) const fn with_words(self, words: Words) -> Self {
        Self { words: Some(words), ..self }
    }

    /// Adds words that may follow the numbers.
    pub(crate) const fn with_options(self, options: &'static [&'static str]) -> Self {
        Self { options, ..self }
    }

    /// Adds a name before the numbers.
    pub(crate) const fn with_subject(self, subject: Subject) -> Self {
        Self { subject: Some(subject), ..self }
    }

    /// Adds the name of a material after the numbers.
    pub(crate) const fn ending_with(self, names: Names) -> Self {
        Self { ends_with: Some(names), ..self }
    }

    /// Adds constraints on several parameters.
    pub(crate) const fn with(self, constraints: &'static [Constraint]) -> Self {
        Self { constraints, ..self }
    }

    /// Names the numbers, by their indices, that hide the object if all of them are 0.
    pub(crate) const fn hidden_by(self, radii: &'static [usize]) -> Self {
        Self { radii, ..self }
    }

    /// Allows a word in place of all numbers.
    pub(crate) const fn or_word(self, word: &'static str) -> Self {
        Self { word: Some(word), ..self }
    }

    /// Forbids curves.
    pub(crate) const fn fixed(self) -> Self {
        Self { curves: false, ..self }
    }

    /// Forbids curves in the first numbers.
    pub(crate) const fn fixed_first(self, fixed: usize) -> Self {
        Self { fixed, ..self }
    }

    /// Returns whether number `i` may be a curve.
    pub const fn takes_curve(&self, i: usize) -> bool {
        self.curves && i >= self.fixed
    }

    /// Returns whether a word is one of those that may follow the numbers.
    pub fn is_option(&self, word: &str) -> bool {
        self.options.iter().any(|option| option.eq_ignore_ascii_case(word))
    }

    /// Returns whether this count of numbers omits those of the surface, which may be omitted together.
    pub fn is_bare(&self, count: usize) -> bool {
        self.may_be_bare && self.surface == Some(count)
    }

    /// Returns whether number `i` is one of a surface that may be omitted.
    pub fn is_of_optional_surface(&self, i: usize) -> bool {
        self.may_be_bare && self.surface.is_some_and(|first| i >= first)
    }

    /// Returns the default of a parameter of a surface that may be omitted. Without further information, .9 of the
    /// colour .8 is diffuse, and .1 ambient.
    pub fn surface_default(&self, field: &Field) -> Option<&'static str> {
        match (self.subject, field.parameter) {
            _ if !self.may_be_bare => None,
            (Some(Subject::Quotes(Quotes::File)), _) => Some("that of the file"),
            (_, Parameter::Ambient) => Some("0.08"),
            (_, Parameter::Diffuse) => Some("0.72"),
            _ => None,
        }
    }

    /// Returns whether an object with these numbers is hidden, because its radii are 0.
    pub fn hides(&self, numbers: &[f64]) -> bool {
        !self.radii.is_empty() && self.radii.iter().all(|&i| numbers.get(i) == Some(&0.0))
    }

    /// Gives a hidden object a radius, so that its other numbers can be checked.
    pub(crate) fn show(&self, numbers: &mut [f64]) {
        if self.hides(numbers) {
            self.radii.iter().for_each(|&i| numbers[i] = 1.0);
        }
    }

    /// Returns the least and the largest count of numbers.
    pub const fn arity(&self) -> (usize, usize) {
        let least = match self.surface {
            Some(surface) if self.may_be_bare => surface,
            _ => self.required,
        };
        (least, self.most)
    }

    /// Returns the count of numbers of the required parameters, if there is any number of the surface.
    pub const fn required(&self) -> usize {
        self.required
    }

    /// Returns whether this count of numbers is allowed.
    pub fn takes(&self, count: usize) -> bool {
        if self.is_bare(count) {
            return true;
        }
        if self.required == self.most {
            return count == self.most;
        }
        let mut end = 0;
        count >= self.required
            && self.fields.iter().any(|field| {
                let start = end;
                end += field.names.len();
                count == end
                    || matches!(field.presence, Presence::FromTheEnd(_)) && (start..end).contains(&count)
                    || count == 0 && !matches!(field.presence, Presence::Required)
            })
    }

    /// Returns all allowed counts of numbers.
    pub fn counts(&self) -> impl Iterator<Item = usize> {
        (self.arity().0..=self.most).filter(|count| self.takes(*count))
    }

    /// Returns the first number that the name of a material may replace, together with all that follow.
    pub const fn surface(&self) -> Option<usize> {
        self.surface
    }

    /// Returns the numbers in order, each with its name and its field.
    pub fn numbers(&self) -> impl Iterator<Item = (&'static str, &'static Field)> {
        self.fields.iter().flat_map(|field| field.names.iter().map(move |name| (*name, field)))
    }

    /// Returns the name of number `i`, and its field.
    ///
    /// # Panics
    /// Panics if there are not as many numbers.
    pub(crate) fn number(&self, i: usize) -> (&'static str, &'static Field) {
        let number = self.numbers().nth(i);
        number.unwrap_or_else(|| unreachable!("`{}` has no number {i}", self.name))
    }

    /// Returns all parameters in the order of the line, including words among the numbers.
    pub fn parameters(&self) -> impl Iterator<Item = &Field> {
        let (before, behind) = self.words.as_ref().map(|words| (&words.before, &words.behind)).unzip();
        before.into_iter().chain(self.fields).chain(behind)
    }

    /// Returns the parameters of a line that has this word after the name in quotes.
    pub fn parameters_behind(&self, first: &str) -> impl Iterator<Item = &Field> {
        let is_alone =
            self.words.as_ref().is_some_and(|words| !words.with_numbers.eq_ignore_ascii_case(first));
        self.parameters().take(if is_alone { 1 } else { usize::MAX })
    }

    /// Returns the range of field `i`'s numbers among all.
    pub(crate) fn span(&self, i: usize) -> Range<usize> {
        let start = self.fields[..i].iter().map(|field| field.names.len()).sum();
        start..start + self.fields[i].names.len()
    }

    /// Returns the range from the first to the last number for which `concerns` holds, given their name and
    /// parameter. Returns all if it holds for none.
    pub(crate) fn place(&self, concerns: impl Fn(&str, Parameter) -> bool) -> Range<usize> {
        let mut concerned =
            self.numbers().enumerate().filter(|(_, (name, field))| concerns(name, field.parameter));
        let Some((first, _)) = concerned.next() else { return 0..self.most };
        first..concerned.last().map_or(first, |(last, _)| last) + 1
    }
}

/// Writes the usage: `Sphere R cx cy cz ar ag ab rr rg rb [sr sg sb]` or `Fog r g b d or none`.
impl Display for Form {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        if let Some(usage) = self.usage {
            return f.write_str(usage);
        }
        f.write_str(self.name)?;
        if self.subject.is_some() {
            f.write_str(" NAME")?;
        }
        let mut open = 0;
        for field in self.fields {
            let optional = !matches!(field.presence, Presence::Required);
            open += usize::from(optional);
            f.write_str(if optional { " [" } else { " " })?;
            f.write_str(&field.names.join(" "))?;
        }
        f.write_str(&"]".repeat(open))?;
        f.write_str(if self.ends_with.is_some() { " NAME" } else { "" })?;
        self.word.map_or(Ok(()), |word| write!(f, " or {word}"))
    }
}

impl Field {
    pub(crate) const fn new(
        parameter: Parameter,
        names: &'static [&'static str],
        kind: Kind,
        values: Values,
    ) -> Self {
        Self { parameter, names, kind, values, presence: Presence::Required }
    }

    /// Makes the field optional as a whole, with a default.
    pub(crate) const fn optional(self, default: &'static str) -> Self {
        Self { presence: Presence::Optional(default), ..self }
    }

    /// Makes the numbers of the field optional from the end, with a default.
    pub(crate) const fn omittable(self, default: &'static str) -> Self {
        Self { presence: Presence::FromTheEnd(default), ..self }
    }
}

impl Presence {
    /// Returns the default of an omitted parameter.
    pub fn default(self) -> Option<&'static str> {
        match self {
            Self::Required => None,
            Self::Optional(default) | Self::FromTheEnd(default) => Some(default),
        }
    }
}

impl Values {
    /// Returns whether a number may have all values from `low` to `high`. Ignores constraints on several components.
    pub fn take(self, low: f64, high: f64) -> bool {
        match self {
            Self::Any | Self::Clamped | Self::NotZero => low.is_finite() && high.is_finite(),
            Self::Positive => low > 0.0,
            Self::NotNegative => low >= 0.0,
            Self::AtLeastOne => low >= 1.0,
            Self::Share => low >= 0.0 && high <= 1.0,
            Self::HalfTurn => low >= 0.0 && high < 180.0,
            Self::FieldOfView => low > 0.0 && high < 180.0,
            Self::Whole(least, most) => {
                low == high && low.fract() == 0.0 && (f64::from(least)..=f64::from(most)).contains(&low)
            }
            Self::OneOf(words) => low == high && low >= 0.0 && low < words.len() as f64,
        }
    }
}

impl Kind {
    /// Returns the unit of the numbers.
    pub fn unit(self) -> Unit {
        match self {
            Self::Count(unit) => unit,
            Self::Length | Self::Position | Self::WindowPosition => Unit::World,
            Self::Color => Unit::Display,
            Self::Angle | Self::Rotation => Unit::Degrees,
            Self::Error => Unit::Levels,
            Self::Direction | Self::Coefficients | Self::Plain | Self::Word => Unit::One,
        }
    }
}

impl Display for Kind {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Count(_) => "number",
            Self::Length => "length",
            Self::Position => "position",
            Self::WindowPosition => "position in the window",
            Self::Direction => "direction",
            Self::Angle => "angle",
            Self::Rotation => "angles about the axes",
            Self::Plain => "number",
            Self::Color => "colour",
            Self::Coefficients => "coefficients",
            Self::Error => "error",
            Self::Word => "word",
        })
    }
}

impl Display for Unit {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Pixels => "pixels",
            Self::Rays => "rays",
            Self::Bounces => "bounces",
            Self::Frames => "frames",
            Self::Levels => "levels",
            Self::World => "world units",
            Self::Display => "display values",
            Self::Degrees => "degrees",
            Self::One => "plain numbers",
        })
    }
}

impl Display for Values {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Any => f.write_str("any"),
            Self::Clamped => f.write_str("clamped to 0..1"),
            Self::Positive => f.write_str("greater than 0"),
            Self::NotNegative => f.write_str("at least 0"),
            Self::AtLeastOne => f.write_str("at least 1"),
            Self::Share => f.write_str("from 0 to 1"),
            Self::HalfTurn => f.write_str("from 0 to below 180"),
            Self::FieldOfView => f.write_str("above 0 and below 180"),
            Self::NotZero => f.write_str("not all 0"),
            Self::Whole(least, u32::MAX) => write!(f, "whole, from {least}"),
            Self::Whole(least, most) => write!(f, "whole, from {least} to {most}"),
            Self::OneOf(words) => f.write_str(&words.join(" or ")),
        }
    }
}

impl Display for Presence {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(self.default().unwrap_or("must stand"))
    }
}

impl Names {
    /// Returns the noun for an item with such a name.
    pub fn noun(self) -> &'static str {
        match self {
            Self::Materials => "material",
            Self::Groups => "group",
        }
    }
}

impl Constraint {
    /// Describes the constraint in words, with the names of the parameters of `form`.
    pub fn describe(self, form: &Form) -> String {
        let names = |field: usize| format!("`{}`", form.fields[field].names.join(" "));
        match self {
            Self::Differ(a, b) => format!("{} and {} differ", names(a), names(b)),
            Self::DifferEverywhere(a, b) => format!("{} and {} differ in every number", names(a), names(b)),
            Self::NotParallel(a, b) => format!("{} and {} are not parallel", names(a), names(b)),
            Self::LooksAside(from, to, up) => {
                format!("from {} to {} is not parallel to {}, if given", names(from), names(to), names(up))
            }
            Self::Greater(a, b) => format!("{} is greater than {}", names(a), names(b)),
            Self::FitsTwice(a, u, v) => {
                format!("{} is at most half of each side from {} to {}", names(a), names(u), names(v))
            }
            Self::InOrder(a, b) => format!("{} is at most {}", names(a), names(b)),
        }
    }
}
