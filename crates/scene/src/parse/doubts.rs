//! Warnings about valid lines that do not have the effect that was probably meant.
//!
//! No such warning is reported in a script with errors before it: the missing part may be in a faulty line.

use std::ops::Range;

use super::line::{Statement, decimal_comma};
use super::visibility::Animated;
use super::{Parser, wording};
use crate::command::{Command, Effect};
use crate::diagnostic::Code;
use crate::form::{Form, Kind};
use crate::model::{Camera, Clause, ImageMap, Light, Material, Parameter};
use crate::report::{Fault, Line};
use crate::row::{Number, Row};
use crate::script::{ClauseLine, Value};

/// The bound from which a coefficient of a surface is probably a level from 0 to 255.
const FAR_ABOVE_ONE: f64 = 10.0;

/// The bound from which a colour of a light, or a glow, is probably a level from 0 to 255. It is higher, because bright lights are
/// usual.
const FAR_TOO_BRIGHT: f64 = 32.0;

/// The field of view below which it is probably in radians.
const NARROWEST: f64 = 2.0;

/// The smallest number of triangles that can close a body.
const CLOSED_BODY: usize = 4;

type Place<'a> = (Line<'a>, Range<usize>);

/// The lines whose effect is in doubt.
#[derive(Default)]
pub(super) struct Doubts<'a> {
    /// The lines of the lens, of the shutter and of a light of the scene, if they were not rendered yet. All three need
    /// several rays per pixel.
    lens: Option<Place<'a>>,
    shutter: Option<Place<'a>>,
    light: Option<Place<'a>>,
    /// The line of the last `Indirect` above 0.
    indirect: Option<Place<'a>>,
    /// Whether that `Indirect` has not been rendered yet.
    is_indirect_new: bool,
    /// The first object of the scene with ambient light, until a warning was given.
    ambient: Option<Place<'a>>,
    /// The first rough object of the scene, until a warning was given.
    rough: Option<Place<'a>>,
    is_ambient_told: bool,
    /// The number of glass triangles so far, and the first of them.
    panes: usize,
    first_pane: Option<Place<'a>>,
    /// Whether an object of the scene has a colour that needs light.
    needs_light: bool,
    is_dark_told: bool,
    /// The line of the sky, until it is known whether rays see it; and whether there is fog.
    pub(super) sky: Option<Place<'a>>,
    pub(super) is_foggy: bool,
    /// Whether the script says how many frames there are.
    pub(super) has_frames: bool,
}

/// The properties of a material on which warnings depend.
#[derive(Clone, Copy, Default)]
pub(super) struct Looks {
    pub(super) is_diffuse: bool,
    pub(super) refracts: bool,
    /// Whether it has the colours of a file.
    pub(super) is_own: bool,
    /// Whether it has ambient light.
    pub(super) is_ambient: bool,
    /// Whether it is rough.
    pub(super) is_rough: bool,
    /// Whether it has a picture by texture coordinates.
    pub(super) needs_uv: bool,
}

impl Looks {
    /// Returns the looks of several objects.
    pub(super) fn and(self, other: Self) -> Self {
        Self {
            is_diffuse: self.is_diffuse || other.is_diffuse,
            refracts: self.refracts || other.refracts,
            is_own: self.is_own || other.is_own,
            is_ambient: self.is_ambient || other.is_ambient,
            is_rough: self.is_rough || other.is_rough,
            needs_uv: self.needs_uv || other.needs_uv,
        }
    }
}

impl Looks {
    /// Returns the looks of a material with these clauses. `other` are the looks of its pattern's material.
    pub(super) fn of(clauses: &[ClauseLine], other: Option<Self>) -> Self {
        let has = |clause| clauses.iter().find(|line| line.clause == clause);
        let is_bright = |line: &ClauseLine| (0..3).any(|i| line.row.largest(i) != Some(0.0));
        let is_diffuse = [Clause::Diffuse, Clause::Shine].into_iter().filter_map(has).any(is_bright);
        let refracts = has(Clause::Glass)
            .is_some_and(|line| !matches!(line.row.numbers().get(3), Some(Number::Constant(1.0))));
        Self {
            is_diffuse: is_diffuse || other.is_some_and(|other| other.is_diffuse),
            refracts,
            is_own: has(Clause::Own).is_some(),
            needs_uv: has(Clause::Image)
                .and_then(|line| line.image.as_ref())
                .is_some_and(|image| image.map() == ImageMap::Uv),
            is_rough: clauses.iter().any(ClauseLine::is_rough),
            is_ambient: has(Clause::Ambient).is_some_and(is_bright)
                || other.is_some_and(|other| other.is_ambient),
        }
    }
}

impl<'a> Parser<'a> {
    /// Warns of colours far above 1, and of a comment directly after a word.
    pub(super) fn doubt_line(&mut self, s: &Statement<'a, '_>) {
        let is_comma = s.row.is_none() && decimal_comma(s.text, s.command, s.words).is_some();
        if !is_comma && !matches!(s.command.effect(), Effect::Material) {
            let count = s.count();
            self.doubt_colors(
                s,
                s.command.form(),
                |i| match &s.row {
                    Some(row) => row.largest(i),
                    None => (i < count).then(|| s.values[i].abs()),
                },
                |numbers| s.words.span(numbers),
            );
        }
        if !matches!(s.command.effect(), Effect::Material) {
            self.doubt_comment(s, s.words.comment());
        }
    }

    /// Warns of a comment directly after a word, or one that looks like a colour. It starts at byte `at`.
    pub(super) fn doubt_comment(&mut self, s: &Statement<'a, '_>, at: usize) {
        if at < s.text.len()
            && (wording::color_at(&s.text[at..]).is_some()
                || !matches!(s.text.as_bytes().get(at.wrapping_sub(1)), Some(b' ' | b'\t' | b',')))
        {
            let comment = &s.text[at..];
            let end = comment.find([' ', '\t']).unwrap_or(comment.len());
            self.report.warning(s.line, at..at + end, || wording::glued_comment(wording::color_at(comment)));
        }
    }

    /// Warns of colours far above 1. `largest` returns an upper bound of each number.
    pub(super) fn doubt_colors(
        &mut self,
        s: &Statement<'a, '_>,
        form: &'static Form,
        largest: impl Fn(usize) -> Option<f64>,
        place: impl Fn(Range<usize>) -> Range<usize>,
    ) {
        for (i, field) in form.fields.iter().enumerate() {
            let least = match (field.kind, field.parameter) {
                (_, Parameter::LightColor | Parameter::Sky | Parameter::SkyTop | Parameter::Glow) => {
                    FAR_TOO_BRIGHT
                }
                (Kind::Color | Kind::Coefficients, _) => FAR_ABOVE_ONE,
                _ => continue,
            };
            let numbers = form.span(i);
            let is_above = numbers.clone().any(|i| largest(i).is_some_and(|value| value >= least));
            // With a reach, the colour is the one at a distance that the script chooses.
            let reach = form.numbers().position(|(_, field)| field.parameter == Parameter::Reach);
            if !is_above || reach.and_then(&largest).is_some_and(|reach| reach > 0.0) {
                continue;
            }
            let span = place(numbers);
            let written = String::from_utf8_lossy(&s.line.bytes[span.clone()]);
            self.report.warning(s.line, span, || wording::far_above_one(&written));
        }
    }

    /// Warns of a camera whose field of view is probably in radians.
    pub(super) fn doubt_camera(&mut self, s: &Statement<'a, '_>, camera: &Value<Camera>) {
        let widest = match camera {
            Value::Constant(Camera::Look(look)) => look.field_of_view(),
            Value::Animated(template) if template.command == Command::Look => {
                template.row.largest(6).unwrap_or(NARROWEST)
            }
            Value::Constant(Camera::Pinhole(_) | Camera::Orthographic) | Value::Animated(_) => return,
        };
        if widest < NARROWEST {
            self.report.warning(s.line, s.words.span(6..7), || wording::narrow_view(widest));
        }
    }

    pub(super) fn doubt_lens(&mut self, s: &Statement<'a, '_>, is_point: bool) {
        self.doubts.lens = (!is_point).then(|| s.place());
    }

    pub(super) fn doubt_shutter(&mut self, s: &Statement<'a, '_>) {
        self.doubts.shutter = (self.recorder.shutter.open() > 0.0).then(|| s.place());
    }

    pub(super) fn doubt_light(&mut self, s: &Statement<'a, '_>, light: &Value<Light>) {
        let is_soft = match light {
            Value::Constant(light) => light.has_extent(),
            Value::Animated(template) => template.row.largest(6).is_some_and(|size| size > 0.0),
        };
        if is_soft && self.doubts.light.is_none() {
            self.doubts.light = Some((s.line, s.words.span(6..7)));
        }
    }

    /// Records an object with `looks`, which is drawn or part of a group.
    pub(super) fn doubt_object(&mut self, s: &Statement<'a, '_>, looks: Looks) {
        self.doubt_group(s, looks);
        if !looks.refracts || s.command != Command::Triangle {
            return;
        }
        self.doubts.panes += 1;
        let first = self.doubts.first_pane.get_or_insert_with(|| s.place());
        if self.doubts.panes == CLOSED_BODY {
            let (line, span) = first.clone();
            self.report.warning(line, span, wording::glass_panes);
        }
    }

    /// Warns of the colours of a file on an object that has no file.
    pub(super) fn doubt_own(&mut self, s: &Statement<'a, '_>, looks: Option<Looks>) {
        if looks.is_some_and(|looks| looks.is_own) {
            let span = s.surface.clone().unwrap_or_else(|| s.words.command.clone());
            self.report.warning(s.line, span, || wording::own_without_file(s.command));
        }
    }

    /// Records a group that is drawn.
    pub(super) fn doubt_group(&mut self, s: &Statement<'a, '_>, looks: Looks) {
        match &mut self.group {
            Some(group) => group.looks = group.looks.and(looks),
            None => {
                self.doubts.needs_light |= looks.is_diffuse;
                let span = || s.surface.clone().unwrap_or_else(|| s.words.command.clone());
                if looks.is_ambient {
                    self.doubts.ambient.get_or_insert_with(|| (s.line, span()));
                }
                if looks.is_rough {
                    self.doubts.rough.get_or_insert_with(|| (s.line, span()));
                }
            }
        }
    }

    pub(super) fn doubt_indirect(&mut self, s: &Statement<'a, '_>) {
        self.doubts.indirect = (self.recorder.indirect.bounces() > 0).then(|| s.place());
        self.doubts.is_indirect_new = true;
    }

    /// Warns of a curve in a script whose frames were probably forgotten, because there is only one moment.
    pub(super) fn doubt_curves(&mut self) {
        let is_open = self.exposures.iter().any(|exposure| exposure.open > 0.0);
        if self.doubts.has_frames || is_open || self.has_errors() {
            return;
        }
        let changing = |animated: &Animated<'a>| {
            let is_curve = |number: &Number| match number {
                Number::Animated(curve) => curve.keys().windows(2).any(|pair| pair[0].value != pair[1].value),
                Number::Constant(_) | Number::Level(_) => false,
            };
            let at = animated.row.numbers().iter().position(is_curve)?;
            Some((animated.line, animated.spans.get(at)?.clone()))
        };
        if let Some((line, span)) = self.moving.iter().find_map(changing) {
            self.report.warning(line, span, wording::curve_without_frames);
        }
    }

    pub(super) fn doubt_no_more_of_scene(&mut self) {
        (self.doubts.light, self.doubts.needs_light, self.doubts.sky) = (None, false, None);
        (self.doubts.ambient, self.doubts.rough) = (None, None);
    }

    /// Warns of settings and lights without an effect in the picture that is rendered now, each only once.
    pub(super) fn doubt_picture(&mut self, s: &Statement<'a, '_>) {
        let Doubts { lens, shutter, light, .. } = &mut self.doubts;
        let (lens, shutter, light) = (lens.take(), shutter.take(), light.take());
        let rough = self.doubts.rough.take();
        let is_new = std::mem::take(&mut self.doubts.is_indirect_new);
        let indirect = self.doubts.indirect.clone();
        if self.has_errors() {
            return;
        }
        if self.recorder.samples.most() == 1 {
            let lens = lens.filter(|_| self.picture.has_lens_effect());
            let found = [
                (lens, "the lens"),
                (shutter, "the shutter"),
                (light, "the size of the light"),
                (indirect.filter(|_| is_new), "indirect light"),
                (rough, "the roughness"),
            ];
            for (place, what) in found {
                let Some((line, span)) = place else { continue };
                self.report.warning(line, span, || wording::needs_samples(what));
            }
        }
        if self.doubts.is_foggy
            && let Some((line, span)) = self.doubts.sky.take()
        {
            self.report.warning(line, span, wording::sky_in_fog);
        }
        let goes_round = self.recorder.samples.most() > 1 && self.doubts.indirect.is_some();
        if goes_round
            && let Some((line, span)) = self.doubts.ambient.take()
            && !std::mem::replace(&mut self.doubts.is_ambient_told, true)
        {
            self.report.warning(line, span, ambient_beside_indirect);
        }
        if self.lights == 0
            && !goes_round
            && self.doubts.needs_light
            && !std::mem::replace(&mut self.doubts.is_dark_told, true)
        {
            self.report.warning(s.line, s.words.command.clone(), wording::no_light);
        }
    }
}

/// Returns the looks of an object whose coefficients are numbers of its line.
pub(super) fn looks_of(material: &Material) -> Looks {
    Looks {
        is_diffuse: material.diffuse() != glam::DVec3::ZERO
            || material.finish().is_some_and(|finish| finish.shine.is_some() || finish.pattern.is_some()),
        refracts: material.finish().and_then(|finish| finish.glass).is_some_and(|glass| glass.ior() != 1.0),
        is_own: material.finish().is_some_and(|finish| finish.own),
        needs_uv: false,
        is_rough: material.finish().is_some_and(|finish| finish.rough.is_some()),
        is_ambient: material.ambient() != glam::DVec3::ZERO
            || material
                .finish()
                .and_then(|finish| finish.pattern)
                .is_some_and(|pattern| pattern.other.ambient() != glam::DVec3::ZERO),
    }
}

/// Returns the looks of an object whose coefficients are in `row`.
pub(super) fn looks_in(form: &Form, row: &Row) -> Looks {
    let is_seen = |parameter: Parameter| {
        let mut of = form.numbers().enumerate().filter(|(_, (_, field))| field.parameter == parameter);
        of.any(|(i, _)| row.largest(i).is_some_and(|value| value != 0.0))
    };
    let mut diffuse =
        form.numbers().enumerate().filter(|(_, (_, field))| field.parameter == Parameter::Diffuse);
    Looks {
        is_diffuse: diffuse.any(|(i, _)| row.largest(i) != Some(0.0)),
        refracts: false,
        is_own: false,
        is_ambient: is_seen(Parameter::Ambient),
        is_rough: false,
        needs_uv: false,
    }
}

pub(super) fn rough_without_mirror() -> Fault {
    Fault::new(Code::NoEffect, "`rough` has no effect: the material has neither `mirror` nor `glass`")
        .expected("expected `mirror` or `glass` beside it")
}

fn ambient_beside_indirect() -> Fault {
    Fault::new(
        Code::AmbientLight,
        "ambient light comes from nowhere, beside the light that `Indirect` sends round",
    )
    .expected("expected `ambient` 0 0 0")
}
