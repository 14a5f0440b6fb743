//! The numbers of a line, as they are read and written.

use std::fmt::{self, Formatter};

use glam::{DVec2, DVec3};

use super::Scripted;
use crate::model::Material;

/// The numbers of a line, taken parameter by parameter; those that were left out are 0.
pub(crate) struct Numbers<'a> {
    rest: &'a [f64],
    /// How many of the rest were written.
    written: usize,
    /// The material that was named in the place of numbers.
    surface: Option<&'a Material>,
}

impl<'a> Numbers<'a> {
    /// At least as many as the form has, of which the first `written` were; `surface` if a material was named in the
    /// place of the others.
    pub(crate) fn new(values: &'a [f64], written: usize, surface: Option<&'a Material>) -> Self {
        Self { rest: values, written, surface }
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

    /// `None` if it was left out.
    pub(crate) fn optional_number(&mut self) -> Option<f64> {
        (self.written > 0).then(|| self.number())
    }

    /// `None` if it was left out.
    pub(crate) fn optional_vector(&mut self) -> Option<DVec3> {
        (self.written > 0).then(|| self.vector())
    }

    /// The material that stands for all further numbers, if one was named.
    pub(crate) fn surface(&self) -> Option<&'a Material> {
        self.surface
    }

    fn take<const N: usize>(&mut self) -> [f64; N] {
        let Some((taken, rest)) = self.rest.split_first_chunk() else {
            unreachable!("more numbers are read than the form has")
        };
        self.rest = rest;
        self.written = self.written.saturating_sub(N);
        *taken
    }
}

/// A line that is being written.
pub(crate) struct Line<'a, 'b> {
    f: &'a mut Formatter<'b>,
    /// The name of the material that is written in the place of its numbers.
    surface: Option<&'a str>,
}

impl<'a, 'b> Line<'a, 'b> {
    pub(crate) fn new(f: &'a mut Formatter<'b>, surface: Option<&'a str>) -> Self {
        Self { f, surface }
    }

    /// A blank and the shortest decimal that reads back as `x`.
    pub(crate) fn number(&mut self, x: f64) -> fmt::Result {
        self.f.write_str(" ")?;
        write_number(self.f, x)
    }

    pub(crate) fn pair(&mut self, v: DVec2) -> fmt::Result {
        v.to_array().iter().try_for_each(|x| self.number(*x))
    }

    pub(crate) fn vector(&mut self, v: DVec3) -> fmt::Result {
        v.to_array().iter().try_for_each(|x| self.number(*x))
    }

    pub(crate) fn word(&mut self, word: &str) -> fmt::Result {
        write!(self.f, " {word}")
    }

    /// The name that is written in the place of a material's numbers.
    pub(crate) fn surface(&self) -> Option<&'a str> {
        self.surface
    }
}

/// The shortest decimal that reads back as `x`.
pub(crate) fn write_number(f: &mut Formatter<'_>, x: f64) -> fmt::Result {
    if x == 0.0 || (1e-5..1e16).contains(&x.abs()) { write!(f, "{x}") } else { write!(f, "{x:e}") }
}

/// A line of a script, with its end; `surface` is the name of its material, if it has one.
pub(crate) fn write_line<T: Scripted>(f: &mut Formatter<'_>, item: &T, surface: Option<&str>) -> fmt::Result {
    f.write_str(T::FORM.name)?;
    item.write(&mut Line::new(f, surface))?;
    f.write_str("\n")
}
