//! Texts: letters cut out of a plate.

use std::ops::Range;
use std::sync::Arc;

use rayfold_assets::{Align, LetterError, Lettering};

use super::line::Statement;
use super::{Parser, wording};
use crate::model::{FONT, Mesh, Source, align_from_word, letter_plate, letter_surface};

/// The file of a font, and its place in the line.
struct FontFile {
    name: String,
    span: Range<usize>,
}

impl<'a> Parser<'a> {
    /// Draws letters.
    pub(super) fn lettering(&mut self, s: &Statement<'a, '_>) {
        if self.group.is_none() {
            self.unseen.removable.get_or_insert_with(|| s.place());
        }
        let Some(subject) = s.subject.clone() else { return };
        let text = self.quoted(s, subject.clone());
        let options = self.text_options(s);
        let plate = self.read(s, None, letter_plate);
        if let Some(word) =
            s.surface.clone().filter(|word| s.text[word.clone()].eq_ignore_ascii_case("center"))
            && self.materials.refer(&s.text[word.clone()]).is_none()
        {
            self.report.error(s.line, word.clone(), || wording::unknown_text_option(&s.text[word]));
            return;
        }
        let (Some(text), Some((align, font)), Some((size, depth))) = (text, options, plate) else { return };
        let Some((surface, looks)) = self.mesh_surface(s, letter_surface) else { return };
        let (font, font_span) = font.map_or((None, None), |file| (Some(file.name), Some(file.span)));
        let lettering = Lettering { text, size, depth, align, font };
        let model = match self.library.letters(&lettering) {
            Ok(model) => model,
            Err(error) => {
                let span = match &error {
                    LetterError::Font(error) => {
                        self.note_absent(error);
                        font_span.unwrap_or(subject)
                    }
                    _ => subject,
                };
                self.report.error(s.line, span, || wording::unusable_letters(&error));
                return;
            }
        };
        let Some(model) = model else {
            self.report.warning(s.line, subject, wording::blank_text);
            return;
        };
        let mesh = Mesh::new(Source::Text(Arc::new(lettering)), model, None);
        self.draw_mesh(s, mesh, surface, looks);
    }

    /// Reads the words after the surface: the alignment of the lines, and the file of the font with its place. If there
    /// is a fault, returns `None` and reports it.
    fn text_options(&mut self, s: &Statement<'a, '_>) -> Option<(Align, Option<FontFile>)> {
        let (mut align, mut font) = (None, None);
        let mut words = s.options.iter();
        while let Some(span) = words.next() {
            let word = &s.text[span.clone()];
            let is_again = if word.eq_ignore_ascii_case(FONT) { font.is_some() } else { align.is_some() };
            if is_again && s.command.form().is_option(word) {
                self.report.error(s.line, span.clone(), || wording::text_option_again(word));
                return None;
            }
            if word.eq_ignore_ascii_case(FONT) {
                let file = words.next();
                let Some(file) = file.filter(|file| s.text[(*file).clone()].starts_with('"')) else {
                    let place = file.cloned().unwrap_or(span.end..span.end);
                    self.report
                        .error(s.line, place, || wording::no_font(file.map(|file| &s.text[file.clone()])));
                    return None;
                };
                font = Some(FontFile { name: self.file(s, file.clone())?, span: file.clone() });
                continue;
            }
            align = align_from_word(word);
            if align.is_none() {
                self.report.error(s.line, span.clone(), || wording::unknown_text_option(word));
                return None;
            }
        }
        Some((align.unwrap_or_default(), font))
    }
}
