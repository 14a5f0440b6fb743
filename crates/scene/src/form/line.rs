//! Reading and writing the numbers of a line.

use std::fmt::{self, Formatter};

use glam::{DVec2, DVec3};

use super::Scripted;
use crate::model::Material;

/// A reader of the numbers of a line, parameter by parameter. Omitted numbers are 0.
#[derive(Clone)]
pub(crate) struct Numbers<'a> {
    rest: &'a [f64],
    /// The count of remaining numbers that the script contains.
    written: usize,
    /// The material whose name replaces numbers.
    surface: Option<&'a Material>,
}

impl<'a> Numbers<'a> {
    /// Makes a reader of at least as many numbers as the form has. The first `written` were in the script. `surface`
    /// is the material whose name replaces the others.
    pub(crate) fn new(values: &'a [f64], written: usize, surface: Option<&'a Material>) -> Self {
        Self { rest: values, written, surface }
    }

    /// Returns whether the form's word replaces all numbers.
    pub(crate) fn is_word(&self) -> bool {
        self.written == 0
    }

    /// Returns the count of numbers of the script that were not read yet.
    pub(crate) fn count(&self) -> usize {
        self.written
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

    /// Returns the next number, or `None` if it was omitted.
    pub(crate) fn optional_number(&mut self) -> Option<f64> {
        (self.written > 0).then(|| self.number())
    }

    /// Returns the next vector, or `None` if it was omitted.
    pub(crate) fn optional_vector(&mut self) -> Option<DVec3> {
        (self.written > 0).then(|| self.vector())
    }

    /// Returns the material that replaces all further numbers, if one was named.
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
    /// The name of the material that is written in place of its numbers.
    surface: Option<&'a str>,
}

impl<'a, 'b> Line<'a, 'b> {
    pub(crate) fn new(f: &'a mut Formatter<'b>, surface: Option<&'a str>) -> Self {
        Self { f, surface }
    }

    /// Writes a space and the shortest decimal that reads back as `x`.
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

    /// Returns the name that is written in place of a material's numbers.
    pub(crate) fn surface(&self) -> Option<&'a str> {
        self.surface
    }
}

/// Writes the shortest decimal that reads back as `x`.
pub(crate) fn write_number(f: &mut Formatter<'_>, x: f64) -> fmt::Result {
    if x == 0.0 || (1e-5..1e16).contains(&x.abs()) { write!(f, "{x}") } else { write!(f, "{x:e}") }
}

/// Writes a line of a script with its end. `surface` is the name of its material, if it has one.
pub(crate) fn write_line<T: Scripted>(f: &mut Formatter<'_>, item: &T, surface: Option<&str>) -> fmt::Result {
    f.write_str(T::FORM.name)?;
    item.write(&mut Line::new(f, surface))?;
    f.write_str("\n")
}

/// Returns a text as a word in quotes, which reads back as the text.
///
/// ```
/// assert_eq!(rayfold_scene::quoted_word("my \"best\" pot.obj"), r#""my \"best\" pot.obj""#);
/// ```
pub fn quoted_word(text: &str) -> String {
    let mut word = String::with_capacity(text.len() + 2);
    word.push('"');
    for c in text.chars() {
        match c {
            '"' => word.push_str("\\\""),
            '\\' => word.push_str("\\\\"),
            '\n' => word.push_str("\\n"),
            c => word.push(c),
        }
    }
    word.push('"');
    word
}
