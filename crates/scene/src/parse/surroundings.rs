//! The surroundings of a scene: `Background`, `Sky` and `Fog`.

use std::sync::Arc;

use rayfold_assets::{Picture, Purpose};

use super::line::Statement;
use super::{Parser, wording};
use crate::form::Scripted;
use crate::model::{Background, Fog, PictureFile, SkyColors, SkyTurn};
use crate::script::{SkyLine, Value};

/// The share by which a panorama may be stretched without a warning.
const STRETCH: f64 = 0.05;

impl<'a> Parser<'a> {
    pub(super) fn background(&mut self, s: &Statement<'a, '_>) {
        self.unseen.removable.get_or_insert_with(|| s.place());
        let Some((background, moving)) = self.read_value(s, Background::read) else { return };
        let old = self.pending.background.replace((moving, self.exposures.len()));
        self.settle(old);
        // None takes away a colour, and no sky.
        if background != Value::Constant(Background::NONE) {
            let old = self.pending.sky.take();
            self.settle(old);
            self.doubts.sky = None;
        }
        self.record(|recorder| recorder.set_background(background));
    }

    /// Sets a sky of colours.
    pub(super) fn sky(&mut self, s: &Statement<'a, '_>) {
        self.unseen.removable.get_or_insert_with(|| s.place());
        let Some((colors, moving)) = self.read_value(s, SkyColors::read) else { return };
        self.set_sky(s, SkyLine::Colors(colors), moving);
    }

    /// Sets a sky that is the picture of a file.
    pub(super) fn sky_picture(&mut self, s: &Statement<'a, '_>) {
        self.unseen.removable.get_or_insert_with(|| s.place());
        let turn = self.read_value(s, SkyTurn::read);
        let Some(subject) = s.subject.clone() else { return };
        let Some(name) = self.file(s, subject.clone()) else { return };
        let Some(picture) = self.picture_of(s, &subject, &name, Purpose::Sky) else { return };
        let size @ [width, height] = [picture.width(), picture.height()];
        if (2.0 * f64::from(height) / f64::from(width) - 1.0).abs() > STRETCH {
            self.report.warning(s.line, subject, || wording::no_panorama(&name, size));
        }
        let Some((turn, moving)) = turn else { return };
        self.set_sky(s, SkyLine::Picture(PictureFile::new(&name, picture), turn), moving);
    }

    fn set_sky(&mut self, s: &Statement<'a, '_>, sky: SkyLine, moving: Option<usize>) {
        let old = self.pending.background.take();
        self.settle(old);
        let old = self.pending.sky.replace((moving, self.exposures.len()));
        self.settle(old);
        self.doubts.sky = Some(s.place());
        self.record(|recorder| recorder.set_sky(sky));
    }

    /// Returns the picture in a file. If there is none, returns `None` and reports that.
    pub(super) fn picture_of(
        &mut self,
        s: &Statement<'a, '_>,
        span: &std::ops::Range<usize>,
        name: &str,
        purpose: Purpose,
    ) -> Option<Arc<Picture>> {
        match self.library.picture(name, purpose) {
            Ok(picture) => {
                for warning in picture.warnings() {
                    self.report.warning(s.line, span.clone(), || wording::model_doubt(name, warning));
                }
                Some(picture)
            }
            Err(error) => {
                self.report.error(s.line, span.clone(), || wording::unusable_file(&error));
                None
            }
        }
    }

    pub(super) fn fog(&mut self, s: &Statement<'a, '_>) {
        self.unseen.lasting.get_or_insert_with(|| s.place());
        let Some((fog, moving)) = self.read_value(s, Fog::read) else { return };
        let old = self.pending.fog.replace((moving, self.exposures.len()));
        self.settle(old);
        self.doubts.is_foggy = fog != Value::Constant(Fog::default());
        self.record(|recorder| recorder.set_fog(fog));
    }
}
