//! How a command is written: its name and its parameters, apart from what they do.
//!
//! Each thing that a line of a script can hold says here once how ([`Scripted`]): that is all that the parser, the
//! writer, the hints and the documentation's test know of it. The list of all commands is [`crate::Command`]. Knows no
//! command itself.
//!
//! Invariants: what may be left out stands behind what may not; what is written reads back bit for bit.

use std::fmt::{self, Display, Formatter};
use std::ops::{Range, RangeInclusive};

use glam::{DVec2, DVec3};

use crate::model::{Faults, Parameter};

/// How a command is written.
#[derive(Debug)]
pub struct Form {
    /// Its name; scripts may write it in any letter case.
    pub name: &'static str,
    /// Its parameters in their order, the optional ones last.
    pub fields: &'static [Field],
    /// How many numbers must stand.
    required: usize,
    /// How many numbers may stand.
    most: usize,
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
    /// Whether it may be left out; it is 0 then.
    pub optional: bool,
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
    /// A plain number.
    Plain,
    /// Red, green and blue.
    Color,
    /// What share of the light a surface sends on, for red, green and blue.
    Coefficients,
}

/// What a number counts by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Pixels of the image.
    Pixels,
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
        let (mut required, mut most, mut i) = (0, 0, 0);
        while i < fields.len() {
            let count = fields[i].names.len();
            assert!(fields[i].optional || required == most, "what may be left out comes last");
            required += if fields[i].optional { 0 } else { count };
            most += count;
            i += 1;
        }
        Self { name, fields, required, most }
    }

    /// How many numbers it takes; those that may be left out are left out from the end.
    pub const fn arity(&self) -> RangeInclusive<usize> {
        self.required..=self.most
    }

    /// Its numbers in their order, each with its name and the parameter that it belongs to.
    pub fn numbers(&self) -> impl Iterator<Item = (&'static str, Parameter)> {
        self.fields.iter().flat_map(|field| field.names.iter().map(|name| (*name, field.parameter)))
    }

    /// The name of number `i`, and the parameter that it belongs to.
    ///
    /// # Panics
    /// When there are not as many.
    pub(crate) fn number(&self, i: usize) -> (&'static str, Parameter) {
        let number = self.numbers().nth(i);
        number.unwrap_or_else(|| unreachable!("`{}` has no number {i}", self.name))
    }

    /// From the first to the last of the numbers for which `concerns` holds, given their name and parameter; all of
    /// them if it holds for none.
    pub(crate) fn place(&self, concerns: impl Fn(&str, Parameter) -> bool) -> Range<usize> {
        let mut concerned =
            self.numbers().enumerate().filter(|(_, (name, parameter))| concerns(name, *parameter));
        let Some((first, _)) = concerned.next() else { return 0..self.most };
        first..concerned.last().map_or(first, |(last, _)| last) + 1
    }
}

/// `Sphere R cx cy cz ar ag ab rr rg rb [sr sg sb]`.
impl Display for Form {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)?;
        for (i, (name, _)) in self.numbers().enumerate() {
            f.write_str(if i == self.required { " [" } else { " " })?;
            f.write_str(name)?;
        }
        f.write_str(if self.required < self.most { "]" } else { "" })
    }
}

impl Field {
    pub(crate) const fn new(
        parameter: Parameter,
        names: &'static [&'static str],
        kind: Kind,
        values: Values,
    ) -> Self {
        Self { parameter, names, kind, values, optional: false }
    }

    /// The same, but it may be left out.
    pub(crate) const fn optional(self) -> Self {
        Self { optional: true, ..self }
    }
}

impl Kind {
    /// What its numbers count by.
    pub fn unit(self) -> Unit {
        match self {
            Self::Count(unit) => unit,
            Self::Length | Self::Position | Self::WindowPosition => Unit::World,
            Self::Color => Unit::Display,
            Self::Angle => Unit::Degrees,
            Self::Direction | Self::Coefficients | Self::Plain => Unit::One,
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
            Self::Plain => "number",
            Self::Color => "colour",
            Self::Coefficients => "coefficients",
        })
    }
}

impl Display for Unit {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Pixels => "pixels",
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
        }
    }
}

/// The numbers of a line, taken parameter by parameter; those that were left out are 0.
pub(crate) struct Numbers<'a>(&'a [f64]);

impl<'a> Numbers<'a> {
    /// At least as many as the form has.
    pub(crate) fn new(values: &'a [f64]) -> Self {
        Self(values)
    }

    pub(crate) fn number(&mut self) -> f64 {
        let [x] = self.take();
        x
    }

    pub(crate) fn pair(&mut self) -> DVec2 {
        DVec2::from_array(self.take())
    }

    pub(crate) fn vector(&mut self) -> DVec3 {
        DVec3::from_array(self.take())
    }

    fn take<const N: usize>(&mut self) -> [f64; N] {
        let Some((taken, rest)) = self.0.split_first_chunk() else {
            unreachable!("more numbers are read than the form has")
        };
        self.0 = rest;
        *taken
    }
}

/// A line that is being written.
pub(crate) struct Line<'a, 'b>(&'a mut Formatter<'b>);

impl Line<'_, '_> {
    /// A blank and the shortest decimal that reads back as `x`.
    pub(crate) fn number(&mut self, x: f64) -> fmt::Result {
        if x == 0.0 || (1e-5..1e16).contains(&x.abs()) {
            write!(self.0, " {x}")
        } else {
            write!(self.0, " {x:e}")
        }
    }

    pub(crate) fn pair(&mut self, v: DVec2) -> fmt::Result {
        v.to_array().iter().try_for_each(|x| self.number(*x))
    }

    pub(crate) fn vector(&mut self, v: DVec3) -> fmt::Result {
        v.to_array().iter().try_for_each(|x| self.number(*x))
    }
}

/// A line of a script, with its end.
pub(crate) fn write_line<T: Scripted>(f: &mut Formatter<'_>, item: &T) -> fmt::Result {
    f.write_str(T::FORM.name)?;
    item.write(&mut Line(f))?;
    f.write_str("\n")
}
