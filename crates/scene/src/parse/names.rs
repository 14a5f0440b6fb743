//! The names of materials and groups: definitions, references, and corrections of misspelt names.

use std::collections::HashMap;
use std::ops::Range;

use crate::report::Line;

/// The largest number of names that are compared with unknown ones in a whole script: far more than a person defines,
/// and few enough that a large script with only unknown names takes no longer than another.
const MAX_COMPARED: usize = 1 << 20;

/// The named items of one kind.
pub(super) struct Names<'a, T> {
    numbers: HashMap<&'a str, usize>,
    all: Vec<Named<'a, T>>,
    compared: usize,
}

/// A named item and its definition.
pub(super) struct Named<'a, T> {
    pub(super) name: &'a str,
    pub(super) line: Line<'a>,
    /// The range of the name in the line.
    pub(super) span: Range<usize>,
    pub(super) is_used: bool,
    /// The item, or `None` if its definition is faulty.
    pub(super) value: Option<T>,
}

impl<'a, T> Names<'a, T> {
    pub(super) fn new() -> Self {
        Self { numbers: HashMap::new(), all: Vec::new(), compared: 0 }
    }

    /// Defines a name.
    ///
    /// # Errors
    /// Returns the line in which the name was defined before.
    pub(super) fn define(
        &mut self,
        name: &'a str,
        line: Line<'a>,
        span: Range<usize>,
        value: Option<T>,
    ) -> Result<usize, usize> {
        if let Some(&first) = self.numbers.get(name) {
            return Err(self.all[first].line.number);
        }
        let number = self.all.len();
        self.numbers.insert(name, number);
        self.all.push(Named { name, line, span, is_used: false, value });
        Ok(number)
    }

    /// Returns the line in which a name was defined.
    pub(super) fn line_of(&self, name: &str) -> Option<usize> {
        self.numbers.get(name).map(|&i| self.all[i].line.number)
    }

    /// Returns the number of a named item, and marks it as used.
    pub(super) fn refer(&mut self, name: &str) -> Option<usize> {
        let number = *self.numbers.get(name)?;
        self.all[number].is_used = true;
        Some(number)
    }

    pub(super) fn get(&self, number: usize) -> &Named<'a, T> {
        &self.all[number]
    }

    pub(super) fn value_mut(&mut self, number: usize) -> Option<&mut T> {
        self.all[number].value.as_mut()
    }

    pub(super) fn all(&self) -> &[Named<'a, T>] {
        &self.all
    }

    /// Returns the name that was probably meant: one with a similar spelling, in any letter case.
    pub(super) fn nearest(&mut self, name: &str) -> Option<&'a str> {
        // A longer word is no typo, and the distance takes quadratic time.
        if name.len() > 40 {
            return None;
        }
        let lower = name.to_lowercase();
        let left = MAX_COMPARED.saturating_sub(self.compared);
        self.compared += self.all.len();
        let candidates = self.all.iter().take(left).filter(|named| named.name.len() <= 80);
        let near = candidates
            .map(|named| (strsim::osa_distance(&lower, &named.name.to_lowercase()), named.name))
            .min_by_key(|(distance, _)| *distance);
        near.filter(|(distance, near)| *distance <= near.len().div_ceil(3).min(name.len().saturating_sub(1)))
            .map(|(_, near)| near)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_means_near() {
        let line = Line { number: 1, offset: 0, bytes: b"" };
        let mut names: Names<'_, ()> = Names::new();
        for name in ["red", "dark-red", "Lamp_1"] {
            names.define(name, line, 0..0, Some(())).unwrap();
        }
        let mut check = |name, nearest| assert_eq!(names.nearest(name), nearest, "{name}");
        check("Red", Some("red"));
        check("rde", Some("red"));
        check("darkred", Some("dark-red"));
        check("lamp-1", Some("Lamp_1"));
        check("blue", None);
        check("x", None);
        assert_eq!(names.define("red", line, 0..0, None), Err(1));
    }
}
