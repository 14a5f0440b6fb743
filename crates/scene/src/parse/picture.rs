//! Warnings about a picture as a whole, from the combination of screen, camera and lens.

use std::ops::Range;

use super::line::Statement;
use super::wording;
use crate::command::Command;
use crate::model::{Camera, Screen, unsquashed};
use crate::report::{Line, Report};
use crate::row::Number;
use crate::script::Value;

/// The current screen, camera and lens, as far as warnings depend on their combination.
#[derive(Default)]
pub(super) struct Picture<'a> {
    /// The corners of the window of a `Camera`, with their position in the text.
    window: Option<(Line<'a>, Range<usize>, [f64; 4])>,
    /// Whether the window was compared with the screen.
    is_compared: bool,
    is_orthographic: bool,
    has_camera: bool,
    /// A lens with a radius with which no picture was rendered.
    lens: Option<(Line<'a>, Range<usize>)>,
}

impl<'a> Picture<'a> {
    pub(super) fn screen_set(&mut self) {
        self.is_compared = false;
    }

    pub(super) fn camera_faulty(&mut self) {
        (self.window, self.has_camera, self.is_orthographic) = (None, true, false);
    }

    pub(super) fn camera_set(&mut self, s: &Statement<'a, '_>, camera: &Value<Camera>) {
        self.is_compared = false;
        self.has_camera = true;
        self.is_orthographic = *camera == Value::Constant(Camera::Orthographic);
        let corners = match camera {
            Value::Constant(Camera::Pinhole(pinhole)) => {
                let (a, b) = (pinhole.lower_left(), pinhole.upper_right());
                Some([a.x, a.y, b.x, b.y])
            }
            Value::Animated(template) if template.command == Command::Camera => {
                let still = |number: &Number| match number {
                    Number::Constant(value) => Some(*value),
                    Number::Animated(_) | Number::Level(_) => None,
                };
                let corners: Option<Vec<_>> = template.row.numbers()[10..].iter().map(still).collect();
                corners.and_then(|corners| corners.try_into().ok())
            }
            Value::Constant(Camera::Orthographic | Camera::Look(_)) | Value::Animated(_) => None,
        };
        self.window = corners.map(|corners| (s.line, s.words.span(10..14), corners));
    }

    /// Returns whether a lens has an effect with the current camera.
    pub(super) fn has_lens_effect(&self) -> bool {
        self.has_camera && !self.is_orthographic
    }

    pub(super) fn lens_set(&mut self, s: &Statement<'a, '_>, is_point: bool) {
        self.lens = (!is_point).then(|| s.place());
    }

    /// Reports warnings about the picture that is rendered now, each only once.
    pub(super) fn check(&mut self, screen: Screen, report: &mut Report<'a>) {
        if !self.has_lens_effect()
            && let Some((line, span)) = self.lens.take()
        {
            report.warning(line, span, wording::lens_without_effect);
        }
        if std::mem::replace(&mut self.is_compared, true) {
            return;
        }
        let Some((line, span, corners)) = &self.window else { return };
        if let Some(better) = unsquashed(*corners, screen) {
            report.warning(*line, span.clone(), || wording::non_square_pixels(screen, better));
        }
    }
}
