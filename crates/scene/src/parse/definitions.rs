//! Materials and groups: their definitions, references to them, and the visibility of their contents.

use std::ops::Range;

use super::doubts::{Looks, rough_without_mirror};
use super::line::Statement;
use super::meshes::Models;
use super::text::{Parameters, is_name};
use super::visibility::{Animated, Origin, Suffix, VisibleSpan, join};
use super::{Parser, curve, number, wording};
use crate::command::{Command, Effect};
use crate::form::{Names as Kinds, Numbers, color_levels};
use crate::model::{Clause, Coefficients, Material, Tone};
use crate::report::Line;
use crate::row::{Number, Row};
use crate::script::{ClauseLine, GroupRecorder, NamedMaterial};

/// The parser's data about a material.
pub(super) struct MaterialInfo {
    /// The material, if it has no curves.
    pub(super) still: Option<Material>,
    /// Whether it has only coefficients.
    is_plain: bool,
    pub(super) looks: Looks,
    /// The material of its pattern.
    other: Option<usize>,
    /// The lines of its clauses with curves, as indices of all lines with curves.
    moving: Vec<usize>,
    visible_span: Option<VisibleSpan>,
}

/// The parser's data about a group.
pub(super) struct GroupInfo {
    /// The largest number of objects that one use of the group draws.
    pub(super) drawn: usize,
    /// The largest number of groups that one use of the group draws.
    pub(super) uses: usize,
    /// The looks of its objects.
    pub(super) looks: Looks,
    pub(super) reach: Reach,
    /// The models that it draws.
    pub(super) models: Models,
    contents: Contents,
    visible_span: Option<VisibleSpan>,
}

/// Bounds on the translation and the scale of the groups that a group uses.
#[derive(Clone, Copy)]
pub(super) struct Reach {
    distance: f64,
    scale: f64,
}

/// The contents that are visible whenever the group is.
#[derive(Default)]
struct Contents {
    moving: Vec<usize>,
    materials: Vec<usize>,
    groups: Vec<usize>,
}

/// A group that is being defined.
pub(super) struct OpenGroup<'a> {
    name: &'a str,
    line: Line<'a>,
    command: Range<usize>,
    subject: Range<usize>,
    pub(super) recorder: GroupRecorder,
    pub(super) drawn: usize,
    pub(super) uses: usize,
    pub(super) looks: Looks,
    reach: Reach,
    pub(super) models: Models,
    contents: Contents,
}

/// The parts of the current scene whose visibility is not recorded yet, each with the number of Traces before it.
#[derive(Default)]
pub(super) struct Pending {
    pub(super) camera: Option<(Option<usize>, usize)>,
    pub(super) lens: Option<(Option<usize>, usize)>,
    pub(super) background: Option<(Option<usize>, usize)>,
    pub(super) sky: Option<(Option<usize>, usize)>,
    pub(super) fog: Option<(Option<usize>, usize)>,
    moving: Vec<(usize, usize)>,
    materials: Vec<(usize, usize)>,
    groups: Vec<(usize, usize)>,
}

impl Reach {
    const NONE: Self = Self { distance: 0.0, scale: 1.0 };

    /// Returns bounds on distance and scale after `row` moves a group with this reach.
    pub(super) fn placed(self, row: &Row) -> (f64, f64) {
        let [x, y, z] = [0, 1, 2].map(|i| row.largest(i).unwrap_or(0.0));
        let scale = row.largest(6).unwrap_or(1.0);
        (libm::hypot(libm::hypot(x, y), z) + scale * self.distance, scale * self.scale)
    }
}

impl<'a> Parser<'a> {
    /// Returns the number of a material or group. If there is none, returns `None` and reports that.
    pub(super) fn refer(&mut self, kind: Kinds, line: Line<'a>, span: Range<usize>) -> Option<usize> {
        let name = std::str::from_utf8(&line.bytes[span.clone()]).unwrap_or_default();
        let number = match kind {
            Kinds::Materials => self.materials.refer(name),
            Kinds::Groups => self.groups.refer(name),
        };
        if number.is_none() {
            if kind == Kinds::Groups && self.group.as_ref().is_some_and(|group| group.name == name) {
                self.report.error(line, span, || wording::uses_itself(name));
            } else {
                // It may be defined later, which is reported at the end.
                self.unresolved.push((kind, line, span));
            }
        }
        number
    }

    /// Reports the names that were not defined before they were used.
    pub(super) fn tell_unresolved(&mut self) {
        for (kind, line, span) in std::mem::take(&mut self.unresolved) {
            let name = std::str::from_utf8(&line.bytes[span.clone()]).unwrap_or_default();
            let later = match kind {
                Kinds::Materials => self.materials.line_of(name),
                Kinds::Groups => self.groups.line_of(name),
            };
            if later.is_some() {
                match kind {
                    Kinds::Materials => self.materials.refer(name),
                    Kinds::Groups => self.groups.refer(name),
                };
            }
            let nearest = match kind {
                _ if later.is_some() || !self.report.describes_next() => None,
                Kinds::Materials => self.materials.nearest(name),
                Kinds::Groups => self.groups.nearest(name),
            };
            self.report.error(line, span, || wording::unknown_name(kind, name, later, nearest));
        }
    }

    pub(super) fn tell_unused_names(&mut self) {
        self.tell_unresolved();
        // What uses them may be in a faulty line.
        if self.has_errors() {
            return;
        }
        for named in self.materials.all().iter().filter(|named| !named.is_used) {
            self.report.warning(named.line, named.span.clone(), || wording::unused_name(Kinds::Materials));
        }
        for named in self.groups.all().iter().filter(|named| !named.is_used) {
            self.report.warning(named.line, named.span.clone(), || wording::unused_name(Kinds::Groups));
        }
    }

    /// Defines the name of a faulty line, so that references to it are not reported as well.
    pub(super) fn define_faulty(
        &mut self,
        line: Line<'a>,
        text: &'a str,
        command: Command,
        subject: Option<Range<usize>>,
    ) {
        let Some(subject) = subject else { return };
        let name = &text[subject.clone()];
        // It is also marked as used, so that it is not reported as unused.
        match command.effect() {
            Effect::Material => {
                if self.materials.refer(name).is_none()
                    && self.materials.define(name, line, subject, None).is_ok()
                {
                    self.materials.refer(name);
                }
            }
            Effect::Group => {
                if self.groups.refer(name).is_none() && self.groups.define(name, line, subject, None).is_ok()
                {
                    self.groups.refer(name);
                }
            }
            Effect::Use => {
                self.groups.refer(name);
            }
            Effect::Screen
            | Effect::Camera(_)
            | Effect::Background
            | Effect::Sky
            | Effect::SkyPicture
            | Effect::Fog
            | Effect::Lens
            | Effect::Samples
            | Effect::Shutter
            | Effect::Tone
            | Effect::Depth
            | Effect::Indirect
            | Effect::Frames
            | Effect::End
            | Effect::Object(_)
            | Effect::Mesh
            | Effect::Text
            | Effect::Light(_)
            | Effect::Clear
            | Effect::Trace => {}
        }
    }

    pub(super) fn material(&mut self, s: &Statement<'a, '_>) {
        let (Some(name), Some(subject)) = (s.name(), s.subject.clone()) else { return };
        let errors_before = self.report.error_count();
        let (clauses, moving) = self.clauses(s, subject.end);
        let is_plain =
            |line: &ClauseLine| matches!(line.clause, Clause::Ambient | Clause::Diffuse | Clause::Mirror);
        let is_good = self.report.error_count() == errors_before;
        let other = clauses.iter().find_map(|line| line.other);
        let is_constant = clauses.iter().all(|line| line.row.is_constant())
            && other.is_none_or(|other| {
                self.materials.get(other).value.as_ref().is_some_and(|info| info.still.is_some())
            })
            && !clauses.iter().any(|line| line.row.depends_on_tone());
        let other_looks = other.and_then(|other| Some(self.materials.get(other).value.as_ref()?.looks));
        let mut named = NamedMaterial { name: name.into(), clauses, still: None };
        if is_constant && is_good {
            let coefficients = |other: usize| {
                let info = self.materials.get(other).value.as_ref();
                Ok(info.and_then(|info| info.still.clone()).unwrap_or_default())
            };
            named.still = named.at(0.0, Tone::Plain, coefficients).ok();
        }
        let is_in_use =
            |line: &ClauseLine| matches!(line.clause, Clause::Mirror | Clause::Glass) || line.other.is_some();
        if is_good
            && let Some(place) = self.place_of_clause(s, subject.end, Clause::Rough)
            && named.clauses.iter().any(ClauseLine::is_rough)
            && !named.clauses.iter().any(is_in_use)
        {
            self.report.warning(s.line, place, rough_without_mirror);
        }
        let info = MaterialInfo {
            still: named.still.clone(),
            is_plain: named.clauses.iter().all(is_plain),
            looks: Looks::of(&named.clauses, other_looks),
            other,
            moving,
            visible_span: None,
        };
        match self.materials.define(name, s.line, subject.clone(), is_good.then_some(info)) {
            Ok(number) if is_good => {
                debug_assert_eq!(self.materials.get(number).name, name);
                self.record(|recorder| recorder.add_material(named));
            }
            Ok(_) => {
                self.materials.refer(name);
            }
            Err(first) => {
                self.report.error(s.line, subject, || wording::defined_twice(Kinds::Materials, name, first));
            }
        }
    }

    /// Returns the place of the name of a clause after byte `at`.
    fn place_of_clause(&self, s: &Statement<'a, '_>, at: usize, clause: Clause) -> Option<Range<usize>> {
        let words = Parameters::read(s.text.as_bytes(), at).words;
        words.into_iter().find(|word| Clause::from_name(&s.text[word.clone()]) == Some(clause))
    }

    /// Parses the clauses after byte `at`. Returns them, and those with curves as indices of all lines with curves.
    /// Warns of a doubtful comment after them.
    fn clauses(&mut self, s: &Statement<'a, '_>, at: usize) -> (Vec<ClauseLine>, Vec<usize>) {
        let errors_before = self.report.error_count();
        let mut parameters = Parameters::read(s.text.as_bytes(), at);
        let (mut lines, mut moving): (Vec<ClauseLine>, Vec<usize>) = (Vec::new(), Vec::new());
        if parameters.words.is_empty() {
            self.report.error(s.line, at..at, wording::no_clause);
        }
        let mut next = 0;
        while let Some(place) = parameters.words.get(next).cloned() {
            let word = &s.text[place.clone()];
            next += 1;
            let Some(clause) = Clause::from_name(word) else {
                self.report.error(s.line, place, || wording::unknown_clause(word));
                // The numbers after an unknown clause are not reported.
                next += parameters.words[next..]
                    .iter()
                    .take_while(|word| Clause::from_name(&s.text[(*word).clone()]).is_none())
                    .count();
                continue;
            };
            if let Some(first) = lines
                .iter()
                .find(|line| line.clause == clause || line.clause.is_pattern() && clause.is_pattern())
            {
                let first = first.clause;
                self.report.error(s.line, place.clone(), || wording::clause_twice(clause, first));
            }
            if clause == Clause::Image {
                let Some((image, row, spans)) = self.clause_image(s, &place, &parameters.words, &mut next)
                else {
                    continue;
                };
                if row.is_constant() {
                    self.check_clause(s, clause, &row, &spans);
                } else {
                    moving.push(self.keep_moving(s.line, spans, Origin::Clause(clause), &row));
                }
                lines.push(ClauseLine { clause, row, other: None, image: Some(image) });
                continue;
            }
            let (row, spans) = self.clause_numbers(s, clause, &place, &mut parameters, &mut next);
            let other = match clause.form().ends_with {
                Some(_) => self.clause_material(s, clause, &place, &parameters.words, &mut next),
                None => Some(None),
            };
            if let (Some(row), Some(other)) = (row, other) {
                self.doubt_colors(
                    s,
                    clause.form(),
                    |i| row.largest(i),
                    |numbers| spans[numbers.start].start..spans[numbers.end - 1].end,
                );
                if row.is_constant() {
                    self.check_clause(s, clause, &row, &spans);
                } else {
                    moving.push(self.keep_moving(s.line, spans, Origin::Clause(clause), &row));
                }
                lines.push(ClauseLine { clause, row, other, image: None });
            }
        }
        if self.report.error_count() == errors_before {
            self.doubt_comment(s, s.text.len() - parameters.comment().len());
        }
        (lines, moving)
    }

    /// Parses the numbers of a clause. If there is a fault, returns `None` and reports it.
    fn clause_numbers(
        &mut self,
        s: &Statement<'a, '_>,
        clause: Clause,
        place: &Range<usize>,
        parameters: &mut Parameters<'_>,
        next: &mut usize,
    ) -> (Option<Row>, Vec<Range<usize>>) {
        let form = clause.form();
        let (mut numbers, mut spans) = (Vec::new(), Vec::new());
        let mut good = true;
        for (i, (name, _)) in form.numbers().enumerate() {
            if *next == parameters.words.len() && form.takes_color(i, false) {
                parameters.read_color();
            }
            let words = &parameters.words;
            let word = words.get(*next).map(|span| (span.clone(), &s.text[span.clone()]));
            let levels = word.as_ref().and_then(|(_, word)| color_levels(word.as_bytes()));
            let number = match (&word, levels) {
                (Some((span, _)), Some(levels)) => {
                    let channel = spans.iter().rev().take_while(|before| *before == span).count();
                    Ok(Number::Level(levels[channel]))
                }
                (Some((span, word)), None) if word.starts_with('(') => curve::parse(s.text, span.clone())
                    .map_err(|(span, fault)| (span, wording::curve(fault, name))),
                (Some((span, word)), None) => number::parse(word)
                    .map(Number::Constant)
                    .map_err(|fault| (span.clone(), wording::bad_number(fault, name, word, false))),
                (None, _) => Err((0..0, wording::no_clause())),
            };
            let is_next = word.as_ref().is_none_or(|(_, word)| Clause::from_name(word).is_some());
            match number {
                Ok(number) => numbers.push(number),
                Err(_) if is_next => {
                    let end = words[..*next].last().map_or(place.end, |word| word.end);
                    let found = spans.len();
                    let color = std::str::from_utf8(parameters.comment()).ok().and_then(wording::color_at);
                    self.report
                        .error(s.line, end..end, || wording::clause_too_short(clause, name, found, color));
                    return (None, spans);
                }
                Err((span, fault)) => {
                    good = false;
                    self.report.error(s.line, span, || fault);
                }
            }
            spans.extend(word.map(|(span, _)| span));
            *next += 1;
        }
        (good.then(|| Row::new(numbers)), spans)
    }

    /// Returns the material that a pattern names. Returns `Some(None)` for an unknown name, and `None` for a fault
    /// after which the definition cannot continue. Both are reported.
    fn clause_material(
        &mut self,
        s: &Statement<'a, '_>,
        clause: Clause,
        place: &Range<usize>,
        words: &[Range<usize>],
        next: &mut usize,
    ) -> Option<Option<usize>> {
        let Some(span) = words.get(*next).filter(|span| is_name(&s.text[(*span).clone()])).cloned() else {
            let end = words[..*next].last().map_or(place.end, |word| word.end);
            self.report.error(s.line, end..end, || wording::no_pattern_material(clause));
            return None;
        };
        *next += 1;
        let number = self.refer(Kinds::Materials, s.line, span.clone())?;
        if self.materials.get(number).value.as_ref().is_some_and(|info| !info.is_plain) {
            let name = &s.text[span.clone()];
            self.report.error(s.line, span, || wording::unfit_material(name));
        }
        Some(Some(number))
    }

    /// Reports the errors in the numbers of a clause.
    fn check_clause(&mut self, s: &Statement<'a, '_>, clause: Clause, row: &Row, spans: &[Range<usize>]) {
        let values = row.at(0.0, Tone::Plain);
        let mut clauses = crate::model::Clauses::default();
        let mut numbers = Numbers::new(&values, row.len(), None);
        let Err(faults) = clauses.add(clause, &mut numbers, Coefficients::default()) else { return };
        for fault in faults.0 {
            let form = clause.form();
            let place = form.place(|name, parameter| fault.is_about(parameter, name));
            let (name, field) = form.number(place.start);
            let span = spans[place.start].start..spans[place.end - 1].end;
            let word = &s.text[span.clone()];
            self.report.error(s.line, span, || wording::invalid(fault, name, field, word));
        }
    }

    pub(super) fn open_group(&mut self, s: &Statement<'a, '_>) {
        let (Some(name), Some(subject)) = (s.name(), s.subject.clone()) else { return };
        if let Some(first) = self.groups.line_of(name) {
            let span = subject.clone();
            self.report.error(s.line, span, || wording::defined_twice(Kinds::Groups, name, first));
        }
        self.group = Some(OpenGroup {
            name,
            line: s.line,
            command: s.words.command.clone(),
            subject,
            recorder: GroupRecorder::default(),
            drawn: 0,
            uses: 0,
            looks: Looks::default(),
            reach: Reach::NONE,
            models: Models::default(),
            contents: Contents::default(),
        });
    }

    pub(super) fn end_group(&mut self, s: &Statement<'a, '_>) {
        if self.group.is_none() && !self.line_lost {
            self.report.error(s.line, s.words.command.clone(), wording::end_without_group);
        }
        self.close_group();
    }

    /// Ends the group at a command that is not allowed in it, so that the following lines are not faulty as well.
    pub(super) fn leave_group_at(&mut self, s: &Statement<'a, '_>) {
        if let Some(group) = &self.group {
            let (name, number) = (group.name, group.line.number);
            if !self.line_lost {
                let command = s.command;
                self.report
                    .error(s.line, s.words.command.clone(), || wording::not_in_group(command, name, number));
            }
            self.line_lost = true;
            self.close_group();
        }
    }

    /// Reports a group that is still open at the end of the text.
    pub(super) fn close_forgotten_group(&mut self) {
        if let Some(group) = &self.group
            && !self.line_lost
        {
            let (line, span, name) = (group.line, group.command.clone(), group.name);
            self.report.error(line, span, wording::group_not_ended);
            self.close_group();
            self.groups.refer(name);
        }
        self.close_group();
    }

    pub(super) fn close_group(&mut self) {
        let Some(group) = self.group.take() else { return };
        let OpenGroup { name, line, subject, recorder, drawn, uses, looks, reach, models, contents, .. } =
            group;
        let info = GroupInfo { drawn, uses, looks, reach, models, contents, visible_span: None };
        if self.groups.define(name, line, subject, Some(info)).is_ok() {
            self.record(|script| script.add_group(recorder.finish(name, drawn)));
        }
    }

    /// Stores a line with curves. Returns its index among them.
    pub(super) fn keep_moving(
        &mut self,
        line: Line<'a>,
        spans: Vec<Range<usize>>,
        origin: Origin,
        row: &Row,
    ) -> usize {
        self.is_fresh = true;
        self.moving.push(Animated { line, spans, row: row.clone(), origin, visible_span: None });
        self.moving.len() - 1
    }

    /// Records that a line with curves is drawn, in the open group or in the scene.
    pub(super) fn see_moving(&mut self, number: usize) {
        match &mut self.group {
            Some(group) => group.contents.moving.push(number),
            None => self.pending.moving.push((number, self.exposures.len())),
        }
    }

    /// Records that a material with curves is visible.
    pub(super) fn see_material(&mut self, number: usize) {
        self.is_fresh = true;
        match &mut self.group {
            Some(group) => group.contents.materials.push(number),
            None => {
                if self.pending.materials.last().is_none_or(|(last, _)| *last != number) {
                    self.pending.materials.push((number, self.exposures.len()));
                }
            }
        }
    }

    /// Records that a group is drawn, at this distance and scale.
    pub(super) fn see_group(&mut self, number: usize, distance: f64, scale: f64) {
        self.is_fresh = true;
        match &mut self.group {
            Some(group) => {
                let Reach { distance: d, scale: s } = group.reach;
                group.reach = Reach { distance: d.max(distance), scale: s.max(scale) };
                group.contents.groups.push(number);
            }
            None => self.pending.groups.push((number, self.exposures.len())),
        }
    }

    /// A setting is replaced: records the Traces that rendered with it.
    pub(super) fn settle(&mut self, old: Option<(Option<usize>, usize)>) {
        if let Some((Some(number), since)) = old {
            join(&mut self.moving[number].visible_span, Suffix::of(&self.exposures).from(since));
        }
    }

    /// The scene is cleared: records which Traces rendered each of its lines.
    pub(super) fn settle_scene(&mut self) {
        for old in [self.pending.background.take(), self.pending.sky.take()] {
            self.settle(old);
        }
        let mut suffix = Suffix::of(&self.exposures);
        for (number, since) in self.pending.moving.drain(..).rev() {
            join(&mut self.moving[number].visible_span, suffix.from(since));
        }
        let mut suffix = Suffix::of(&self.exposures);
        for (number, since) in self.pending.materials.drain(..).rev() {
            if let Some(info) = self.materials.value_mut(number) {
                join(&mut info.visible_span, suffix.from(since));
            }
        }
        let mut suffix = Suffix::of(&self.exposures);
        for (number, since) in self.pending.groups.drain(..).rev() {
            if let Some(info) = self.groups.value_mut(number) {
                join(&mut info.visible_span, suffix.from(since));
            }
        }
    }

    /// Records at the end of the text which Traces rendered each line.
    pub(super) fn settle_all(&mut self) {
        self.settle_scene();
        for old in [self.pending.camera.take(), self.pending.lens.take(), self.pending.fog.take()] {
            self.settle(old);
        }
        // A group or a material refers only to earlier ones.
        for number in (0..self.groups.all().len()).rev() {
            let Some(GroupInfo { visible_span, contents, .. }) = self.groups.value_mut(number) else {
                continue;
            };
            let (visible_span, contents) = (visible_span.take(), std::mem::take(contents));
            for number in contents.moving {
                join(&mut self.moving[number].visible_span, visible_span.as_ref());
            }
            for number in contents.materials {
                if let Some(info) = self.materials.value_mut(number) {
                    join(&mut info.visible_span, visible_span.as_ref());
                }
            }
            for number in contents.groups {
                if let Some(info) = self.groups.value_mut(number) {
                    join(&mut info.visible_span, visible_span.as_ref());
                }
            }
        }
        for number in (0..self.materials.all().len()).rev() {
            let Some(info) = self.materials.value_mut(number) else { continue };
            let (visible_span, moving) = (info.visible_span.take(), std::mem::take(&mut info.moving));
            let other = info.other;
            for number in moving {
                join(&mut self.moving[number].visible_span, visible_span.as_ref());
            }
            if let Some(info) = other.and_then(|other| self.materials.value_mut(other)) {
                join(&mut info.visible_span, visible_span.as_ref());
            }
        }
    }
}
