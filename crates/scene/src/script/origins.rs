//! The origins of a frame's objects: the lines of the text that draw them, and numbers that they keep in all frames.

use std::sync::Arc;

use super::{Drawn, Objects, Script};

/// The origin of an object of a frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Origin {
    /// The number of the object, counted from 1, among all objects that the script draws since its start or the last
    /// `Clear`, including those hidden in this frame.
    pub number: usize,
    /// The lines, counted from 1, of the `Use` commands that draw the groups of the object, from the outermost group
    /// inwards.
    pub uses: Arc<[usize]>,
    /// The line of its own command. A line is 0 if it comes from no text, as in a script that is made from a scene.
    pub line: usize,
}

/// The origins of objects in the order in which they are drawn.
pub(super) struct Origins {
    /// The number of objects that each group draws, including hidden ones.
    sizes: Vec<usize>,
    pub(super) all: Vec<Origin>,
}

/// The numbers and lines of the objects at one level of groups.
#[derive(Clone, Debug, Default)]
pub(super) struct Counter {
    next: usize,
    uses: Arc<[usize]>,
}

impl Origins {
    pub(super) fn new(script: &Script) -> Self {
        let mut sizes: Vec<usize> = Vec::with_capacity(script.groups.len());
        for group in &script.groups {
            let list = &group.objects.list;
            let of = |drawn: &Drawn| match drawn {
                Drawn::Object { .. } | Drawn::Mesh { .. } => 1,
                Drawn::Use { group, .. } => sizes[*group],
            };
            let others = list.others.iter().map(|(_, drawn)| of(drawn));
            sizes.push(others.fold(list.still.len(), usize::saturating_add));
        }
        Self { sizes, all: Vec::new() }
    }
}

impl Counter {
    /// Starts at number 1, outside of all groups.
    pub(super) fn start() -> Self {
        Self { next: 1, ..Self::default() }
    }

    /// Adds the constant objects of a range.
    pub(super) fn add_still(&mut self, objects: &Objects, range: std::ops::Range<usize>, into: &mut Origins) {
        into.all.extend(range.map(|i| self.take(objects.lines[0].line_of(i))));
    }

    /// Adds the object of another line, unless it is hidden.
    pub(super) fn add_other(&mut self, objects: &Objects, i: usize, is_seen: bool, into: &mut Origins) {
        let origin = self.take(objects.lines[1].line_of(i));
        into.all.extend(is_seen.then_some(origin));
    }

    /// Returns the counter of a group that another line draws, and continues after its objects.
    pub(super) fn enter(&mut self, objects: &Objects, i: usize, group: usize, origins: &Origins) -> Self {
        let uses = self.uses.iter().copied().chain([objects.lines[1].line_of(i)]).collect();
        let inner = Self { next: self.next, uses };
        self.next = self.next.saturating_add(origins.sizes[group]);
        inner
    }

    fn take(&mut self, line: usize) -> Origin {
        let number = self.next;
        self.next = number.saturating_add(1);
        Origin { number, uses: Arc::clone(&self.uses), line }
    }
}
