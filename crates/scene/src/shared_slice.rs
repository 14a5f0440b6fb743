//! A range of a list that many frames share.
//!
//! A script that adds one object per frame makes a thousand scenes whose lists have common beginnings. Each holds a
//! range of the single list, so a scene costs the same with ten objects or a million. Knows nothing of scenes.
//!
//! ```
//! use rayfold_scene::SharedSlice;
//!
//! let all = SharedSlice::from(vec![1, 2, 3]);
//! assert_eq!(all.part(0..2).iter().sum::<i32>(), 3);
//! ```

use std::fmt;
use std::ops::{Deref, Range};
use std::sync::Arc;

/// A range of a shared list. Cloning copies no item. Dereferences to a slice.
pub struct SharedSlice<T> {
    all: Arc<Vec<T>>,
    /// The range within `all`.
    range: Range<usize>,
}

impl<T> SharedSlice<T> {
    /// Returns the items of `range`, counted from the start of this range, in the same list.
    ///
    /// # Panics
    /// Panics if the range is not within this one, as for slices.
    pub fn part(&self, range: Range<usize>) -> Self {
        assert!(range.start <= range.end && range.end <= self.len(), "range out of a shared slice");
        let start = self.range.start;
        Self { all: Arc::clone(&self.all), range: start + range.start..start + range.end }
    }

    /// Returns whether both are the same items of the same list in memory, so that data derived from one is
    /// valid for the other.
    pub fn is_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.all, &other.all) && self.range == other.range
    }
}

impl<T> Deref for SharedSlice<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.all[self.range.clone()]
    }
}

impl<T> From<Vec<T>> for SharedSlice<T> {
    fn from(items: Vec<T>) -> Self {
        Self { range: 0..items.len(), all: Arc::new(items) }
    }
}

impl<T> FromIterator<T> for SharedSlice<T> {
    fn from_iter<I: IntoIterator<Item = T>>(items: I) -> Self {
        Vec::from_iter(items).into()
    }
}

impl<'a, T> IntoIterator for &'a SharedSlice<T> {
    type Item = &'a T;
    type IntoIter = std::slice::Iter<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl<T> Default for SharedSlice<T> {
    fn default() -> Self {
        Vec::new().into()
    }
}

impl<T> Clone for SharedSlice<T> {
    fn clone(&self) -> Self {
        Self { all: Arc::clone(&self.all), range: self.range.clone() }
    }
}

impl<T: PartialEq> PartialEq for SharedSlice<T> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl<T: fmt::Debug> fmt::Debug for SharedSlice<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        (**self).fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_count_from_their_own_start() {
        let all = SharedSlice::from(vec![0, 1, 2, 3, 4]);
        let middle = all.part(1..4);
        assert_eq!(*middle, [1, 2, 3]);
        assert_eq!(*middle.part(1..3), [2, 3]);
        assert!(middle.part(0..3).is_same(&middle));
        assert!(!middle.is_same(&all));
        assert_eq!(middle, SharedSlice::from(vec![1, 2, 3]), "equal by items, wherever they lie");
    }

    #[test]
    #[should_panic(expected = "range out of a shared slice")]
    fn a_part_never_reaches_beyond_its_slice() {
        SharedSlice::from(vec![0, 1, 2]).part(0..2).part(0..3);
    }
}
