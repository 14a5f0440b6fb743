//! The clause `image`: a file in quotes, and the mapping of its picture.

use std::ops::Range;

use rayfold_assets::Purpose;

use super::line::Statement;
use super::{Parser, curve, number, wording};
use crate::model::{AXES, Axes, Clause, Image, ImageMap, MAPS, Mesh, PictureFile};
use crate::row::{Number, Row};

/// A picture on a surface, its width as a row of one number or none, and the places of its numbers.
pub(super) type ImageWords = (Image, Row, Vec<Range<usize>>);

impl<'a> Parser<'a> {
    /// Parses the words after `image`. If there is a fault, returns `None` and reports it.
    pub(super) fn clause_image(
        &mut self,
        s: &Statement<'a, '_>,
        place: &Range<usize>,
        words: &[Range<usize>],
        next: &mut usize,
    ) -> Option<ImageWords> {
        let end = |next: usize| words[..next].last().map_or(place.end, |word| word.end);
        let text = |span: &Range<usize>| &s.text[span.clone()];
        let is_clause = |span: &Range<usize>| Clause::from_name(&s.text[span.clone()]).is_some();
        let Some(span) = words.get(*next).filter(|span| !is_clause(span)).cloned() else {
            let at = end(*next);
            self.report.error(s.line, at..at, || wording::no_image_file(None));
            return None;
        };
        *next += 1;
        let name = if text(&span).starts_with('"') {
            self.file(s, span.clone())
        } else {
            self.report.error(s.line, span.clone(), || wording::no_image_file(Some(text(&span))));
            None
        };
        let picture = name.as_ref().and_then(|name| self.picture_of(s, &span, name, Purpose::Surface));
        let map = words.get(*next).filter(|span| !is_clause(span)).cloned();
        let Some(word) = map else {
            let at = end(*next);
            self.report.error(s.line, at..at, || wording::no_map(None));
            return None;
        };
        *next += 1;
        let (mut row, mut spans) = (Row::new(Vec::new()), Vec::new());
        let map = match MAPS.iter().position(|known| known.eq_ignore_ascii_case(text(&word))) {
            Some(0) => ImageMap::Uv,
            Some(1) => {
                let width = self.image_width(s, end(*next), words.get(*next).filter(|span| !is_clause(span)));
                *next += usize::from(words.get(*next).is_some_and(|span| !is_clause(span)));
                spans.extend(width.is_some().then(|| words[*next - 1].clone()));
                row = Row::new(vec![width?]);
                let axes = words
                    .get(*next)
                    .and_then(|span| AXES.iter().find(|(known, _)| known.eq_ignore_ascii_case(text(span))));
                *next += usize::from(axes.is_some());
                ImageMap::Flat(1.0, axes.map_or(Axes::default(), |(_, axes)| *axes))
            }
            Some(_) => ImageMap::Ball,
            None => {
                self.report.error(s.line, word.clone(), || wording::no_map(Some(text(&word))));
                return None;
            }
        };
        let file = PictureFile::new(&name?, picture?);
        let image = Image::new(file, map).unwrap_or_else(|_| unreachable!("a width of 1 is positive"));
        Some((image, row, spans))
    }

    /// Parses the width of a flat picture. If there is a fault, returns `None` and reports it.
    fn image_width(
        &mut self,
        s: &Statement<'a, '_>,
        end: usize,
        span: Option<&Range<usize>>,
    ) -> Option<Number> {
        let Some(span) = span.cloned() else {
            self.report.error(s.line, end..end, wording::no_image_width);
            return None;
        };
        let word = &s.text[span.clone()];
        let parsed = if word.starts_with('(') {
            curve::parse(s.text, span).map_err(|(span, fault)| (span, wording::curve(fault, "s")))
        } else {
            number::parse(word)
                .map(Number::Constant)
                .map_err(|fault| (span, wording::bad_number(fault, "s", word, false)))
        };
        parsed.map_err(|(span, fault)| self.report.error(s.line, span, || fault)).ok()
    }

    /// Reports a picture by texture coordinates on an object that has none.
    pub(super) fn check_uv(&mut self, s: &Statement<'a, '_>, needs_uv: bool, mesh: Option<&Mesh>) {
        if needs_uv && !mesh.is_some_and(|mesh| mesh.model().has_uvs()) {
            let span = s.surface.clone().unwrap_or_else(|| s.words.command.clone());
            self.report.error(s.line, span, || wording::no_uv(s.command, mesh.and_then(Mesh::file)));
        }
    }
}
