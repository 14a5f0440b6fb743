//! How a command is written: its name and its parameters, apart from what they do.
//!
//! Each thing that a line of a script can hold says here once how ([`Scripted`]): that is all that the parser, the
//! writer, the hints, editors and the documentation's test know of it. The list of all commands is [`crate::Command`].
//! Knows no command itself.
//!
//! Invariants: what may be left out stands behind what may not; what is written reads back bit for bit.

mod line;

use std::fmt::{self, Display, Formatter};
use std::ops::Range;

pub(crate) use line::{Line, Numbers, write_line, write_number};

use crate::model::{Faults, Parameter};

/// How a command, or a clause of a material, is written.
#[derive(Debug)]
pub struct Form {
    /// Its name; scripts may write it in any letter case.
    pub name: &'static str,
    /// The name that stands before its numbers, if one does.
    pub subject: Option<Subject>,
    /// Its parameters in their order, the optional ones last.
    pub fields: &'static [Field],
    /// What several of its numbers must keep together.
    pub constraints: &'static [Constraint],
    /// Whether its numbers may be curves.
    pub curves: bool,
    /// The name that stands behind its numbers, if one does.
    pub ends_with: Option<Names>,
    /// How many numbers must stand.
    required: usize,
    /// How many numbers may stand.
    most: usize,
    /// The number in whose place, and that of all that follow, the name of a material may stand.
    surface: Option<usize>,
}

/// A name that a line starts with, behind its command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subject {
    /// It is given here.
    Defines(Names),
    /// It has been given before.
    Refers(Names),
}

/// What has names; those of one kind are apart from those of the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Names {
    /// Of materials.
    Materials,
    /// Of groups.
    Groups,
}

/// A parameter of a command: a number or the components of a vector.
#[derive(Debug)]
pub struct Field {
    /// What it is.
    pub parameter: Parameter,
    /// The names of its numbers.
    pub names: &'static [&'static str],
    /// What its numbers measure.
    pub kind: Kind,
    /// Which values it may have; all are finite.
    pub values: Values,
    /// Whether it may be left out.
    pub presence: Presence,
}

/// Whether a parameter may be left out, and what holds then.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Presence {
    /// It must stand.
    Required,
    /// It stands whole or not at all.
    Optional(&'static str),
    /// Its numbers may be left out one by one, from the end.
    FromTheEnd(&'static str),
}

/// What numbers measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// How many of something.
    Count(Unit),
    /// A length.
    Length,
    /// A position in the world.
    Position,
    /// A position in the plane of the camera's window.
    WindowPosition,
    /// A direction, of any length.
    Direction,
    /// An angle.
    Angle,
    /// Angles about the axes.
    Rotation,
    /// A plain number.
    Plain,
    /// Red, green and blue.
    Color,
    /// What share of the light a surface sends on, for red, green and blue.
    Coefficients,
    /// An error of a picture.
    Error,
    /// A word.
    Word,
}

/// What a number counts by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Pixels of the image.
    Pixels,
    /// Rays of a pixel.
    Rays,
    /// Times that a ray is sent on.
    Bounces,
    /// Frames of the animation.
    Frames,
    /// Levels of a channel, from 0 to 255.
    Levels,
    /// Lengths of the world, which the script chooses.
    World,
    /// Brightness on the screen: 0 is black, 1 the brightest.
    Display,
    /// Degrees of an angle.
    Degrees,
    /// A plain number.
    One,
}

/// Which values a parameter may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Values {
    /// Any.
    Any,
    /// Any; taken as 0 below 0 and as 1 above 1.
    Clamped,
    /// Greater than 0.
    Positive,
    /// At least 0.
    NotNegative,
    /// At least 1.
    AtLeastOne,
    /// From 0 to 1.
    Share,
    /// From 0 to below 180.
    HalfTurn,
    /// Above 0 and below 180.
    FieldOfView,
    /// Not all components 0.
    NotZero,
    /// Whole numbers in a range.
    Whole(u32, u32),
    /// One of some words, in any letter case; its number is its place among them.
    OneOf(&'static [&'static str]),
}

/// A condition on several parameters, which it names by their place among the fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Constraint {
    /// Two positions or numbers are not the same.
    Differ(usize, usize),
    /// Two positions differ in every component.
    DifferEverywhere(usize, usize),
    /// Two directions are not parallel.
    NotParallel(usize, usize),
    /// From the first position to the second is not parallel to the third, a direction, where that is given.
    LooksAside(usize, usize, usize),
    /// The first number is greater than the second.
    Greater(usize, usize),
    /// One of two numbers that are at least 0 is greater than 0.
    NotBothZero(usize, usize),
    /// Whole numbers: the first is at most the second.
    InOrder(usize, usize),
}

/// A thing of the model that a line of a script holds.
pub(crate) trait Scripted: Sized {
    /// The line's command.
    const FORM: Form;

    /// From the numbers of a line; all that is wrong with them.
    fn read(numbers: &mut Numbers<'_>) -> Result<Self, Faults>;

    /// Its numbers, in the order of the form.
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
        let (subject, constraints, curves, ends_with) = (None, &[], true, None);
        Self { name, subject, fields, constraints, curves, ends_with, required, most, surface }
    }

    /// The same, with a name before its numbers.
    pub(crate) const fn with_subject(self, subject: Subject) -> Self {
        Self { subject: Some(subject), ..self }
    }

    /// The same, with the name of a material behind its numbers.
    pub(crate) const fn ending_with(self, names: Names) -> Self {
        Self { ends_with: Some(names), ..self }
    }

    /// The same, with conditions on several parameters.
    pub(crate) const fn with(self, constraints: &'static [Constraint]) -> Self {
        Self { constraints, ..self }
    }

    /// The same, without curves.
    pub(crate) const fn fixed(self) -> Self {
        Self { curves: false, ..self }
    }

    /// The least and the most numbers that it takes.
    pub const fn arity(&self) -> (usize, usize) {
        (self.required, self.most)
    }

    /// Whether it takes as many numbers.
    pub fn takes(&self, count: usize) -> bool {
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

    /// All counts of numbers that it takes.
    pub fn counts(&self) -> impl Iterator<Item = usize> {
        (self.required..=self.most).filter(|count| self.takes(*count))
    }

    /// The number in whose place, and that of all that follow, the name of a material may stand.
    pub const fn surface(&self) -> Option<usize> {
        self.surface
    }

    /// Its numbers in their order, each with its name and its field.
    pub fn numbers(&self) -> impl Iterator<Item = (&'static str, &'static Field)> {
        self.fields.iter().flat_map(|field| field.names.iter().map(move |name| (*name, field)))
    }

    /// The name of number `i`, and the field that it belongs to.
    ///
    /// # Panics
    /// When there are not as many.
    pub(crate) fn number(&self, i: usize) -> (&'static str, &'static Field) {
        let number = self.numbers().nth(i);
        number.unwrap_or_else(|| unreachable!("`{}` has no number {i}", self.name))
    }

    /// Where the numbers of field `i` stand among all.
    pub(crate) fn span(&self, i: usize) -> Range<usize> {
        let start = self.fields[..i].iter().map(|field| field.names.len()).sum();
        start..start + self.fields[i].names.len()
    }

    /// From the first to the last of the numbers for which `concerns` holds, given their name and parameter; all of
    /// them if it holds for none.
    pub(crate) fn place(&self, concerns: impl Fn(&str, Parameter) -> bool) -> Range<usize> {
        let mut concerned =
            self.numbers().enumerate().filter(|(_, (name, field))| concerns(name, field.parameter));
        let Some((first, _)) = concerned.next() else { return 0..self.most };
        first..concerned.last().map_or(first, |(last, _)| last) + 1
    }
}

/// `Sphere R cx cy cz ar ag ab rr rg rb [sr sg sb]`.
impl Display for Form {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
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
        f.write_str(if self.ends_with.is_some() { " NAME" } else { "" })
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

    /// The same, but it may be left out, as a whole; what holds then.
    pub(crate) const fn optional(self, default: &'static str) -> Self {
        Self { presence: Presence::Optional(default), ..self }
    }

    /// The same, but its numbers may be left out from the end; what holds then.
    pub(crate) const fn omittable(self, default: &'static str) -> Self {
        Self { presence: Presence::FromTheEnd(default), ..self }
    }
}

impl Presence {
    /// What holds where it is left out.
    pub fn default(self) -> Option<&'static str> {
        match self {
            Self::Required => None,
            Self::Optional(default) | Self::FromTheEnd(default) => Some(default),
        }
    }
}

impl Values {
    /// Whether a number may have all values from `low` to `high`; conditions on several components are not looked at.
    pub(crate) fn take(self, low: f64, high: f64) -> bool {
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
    /// What its numbers count by.
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
    /// One thing that has such a name.
    pub fn noun(self) -> &'static str {
        match self {
            Self::Materials => "material",
            Self::Groups => "group",
        }
    }
}

impl Constraint {
    /// As a person reads it, of the names of the parameters of `form`.
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
            Self::NotBothZero(a, b) => format!("{} and {} are not both 0", names(a), names(b)),
            Self::InOrder(a, b) => format!("{} is at most {}", names(a), names(b)),
        }
    }
}
