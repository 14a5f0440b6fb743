//! The parser: script text to frames and diagnostics.
//!
//! Parsing never stops at a fault, so all faults are reported at once. Each line is parsed on its own, except for
//! the names that it refers to. `Trace` checks the lines before it, and the end of the text checks the lines with
//! curves over the time in which they are visible (`visibility`). Nothing is allocated for a valid line without
//! curves or names, and nothing is kept of a script with an error. A fault is reported once: consequences of a
//! reported fault are not reported.
//!
//! Follows `docs/language.md`, which defines the forms of numbers, whitespace and line ends.

mod curve;
mod definitions;
mod doubts;
mod foreign;
mod images;
mod lettering;
mod line;
mod meshes;
mod names;
mod number;
mod picture;
mod surroundings;
mod text;
mod visibility;
mod wording;

use std::ops::Range;

use rayfold_assets::Library;

use crate::command::{Command, Effect, Reader};
use crate::diagnostic::Diagnostic;
use crate::form::{Names as Kinds, Numbers, Scripted};
use crate::limits::Limits;
use crate::model::{Camera, Faults, InvalidValue, Lens, Light, Lint, Material, Object, Placement, Screen};
use crate::report::{Line, Report};
use crate::script::{Drawn, Recorder, Script, Template, Value};
pub use curve::parse_curve;
use definitions::{GroupInfo, MaterialInfo, OpenGroup, Pending};
use doubts::{Doubts, Looks, looks_in, looks_of};
use line::Statement;
use meshes::Named;
use names::Names;
use picture::Picture;
use text::{Words, lines};
pub use text::{is_name, unquoted_word};
use visibility::{Animated, Exposure, Origin};

/// The result of parsing a text.
#[derive(Clone, Debug)]
pub struct Parsed {
    /// The script; `None` if and only if there is an error.
    pub script: Option<Script>,
    /// Errors and warnings in the order of the text.
    pub diagnostics: Vec<Diagnostic>,
    /// The names of the files that the script names, and of those that its models refer to, in order. Some may be absent.
    pub files: Vec<String>,
}

/// Parses the script `bytes` for a caller that reads no files: a script that names one is faulty. `name` is its name in
/// diagnostics.
///
/// The `Trace` commands become the frames of the script. There is at least one frame.
pub fn parse(name: &str, bytes: &[u8], limits: &Limits) -> Parsed {
    parse_with_files(name, bytes, limits, &Library::none())
}

/// Parses the script `bytes`, as [`parse`] does, with the models of `library`: the files of the script's own folder.
pub fn parse_with_files(name: &str, bytes: &[u8], limits: &Limits, library: &Library) -> Parsed {
    let mut report = Report::new(name, limits.max_described);
    if bytes.len() > limits.max_script_bytes {
        if let Some(line) = lines(bytes).next() {
            report.error(line, 0..0, || wording::too_large(limits.max_script_bytes));
        }
    } else if let Some(mark @ (b"\xff\xfe" | b"\xfe\xff")) = bytes.get(..2) {
        report.error(Line { number: 1, offset: 0, bytes: mark }, 0..2, wording::utf16);
    } else if let Some(what) = foreign::not_text(bytes) {
        report.error(Line { number: 1, offset: 0, bytes: &[] }, 0..0, || wording::not_text(what));
    } else {
        return Parser::new(limits, report, library).text(bytes);
    }
    Parsed { script: None, diagnostics: report.finish(), files: Vec::new() }
}

struct Parser<'a> {
    limits: &'a Limits,
    library: &'a Library,
    named: Named,
    report: Report<'a>,
    recorder: Recorder,
    screen: ScreenState,
    picture: Picture<'a>,
    doubts: Doubts<'a>,
    /// The number of lines that could be read, and of those with an unknown command.
    read: usize,
    unknown: usize,
    /// The number of objects that the current scene draws.
    objects: usize,
    /// The number of groups that the current scene draws, each as often as it is drawn.
    uses: usize,
    /// The number of lights of the current scene.
    lights: usize,
    /// The number of frames so far.
    frames: u64,
    /// The Traces so far. Consecutive equal Traces without curves between them are stored as one.
    exposures: Vec<Exposure>,
    /// Whether a line with curves was added since the last `Trace`.
    is_fresh: bool,
    trace_misspelt: bool,
    /// Whether a line could not be read, which may have been an `End` or a `Group`.
    line_lost: bool,
    /// The text, unless a part of it is not UTF-8.
    whole: Option<&'a str>,
    /// Whether the text contains a carriage return.
    has_returns: bool,
    /// The first command since the last `Trace` that has no effect if no other `Trace` follows.
    unseen: Unseen<(Line<'a>, Range<usize>)>,
    materials: Names<'a, MaterialInfo>,
    groups: Names<'a, GroupInfo>,
    group: Option<OpenGroup<'a>>,
    /// All lines with curves, and the visibility of the current scene that is not recorded yet.
    moving: Vec<Animated<'a>>,
    pending: Pending,
    /// The names that were not defined before their use, with their kind and place.
    unresolved: Vec<(Kinds, Line<'a>, Range<usize>)>,
}

/// The commands that no `Trace` has rendered yet.
struct Unseen<T> {
    /// The first command that a `Clear` keeps: screen, camera or another setting.
    lasting: Option<T>,
    /// The first command whose item a `Clear` removes.
    removable: Option<T>,
}

impl<T> Unseen<T> {
    const NOTHING: Self = Self { lasting: None, removable: None };
}

#[derive(Clone, Copy)]
enum ScreenState {
    Unset,
    /// All errors about it have been reported.
    Faulty,
    Set(Screen),
}

impl<'a> Parser<'a> {
    fn new(limits: &'a Limits, report: Report<'a>, library: &'a Library) -> Self {
        Self {
            limits,
            library,
            named: Named::default(),
            report,
            recorder: Recorder::default(),
            screen: ScreenState::Unset,
            picture: Picture::default(),
            doubts: Doubts::default(),
            read: 0,
            unknown: 0,
            objects: 0,
            uses: 0,
            lights: 0,
            frames: 0,
            exposures: Vec::new(),
            is_fresh: false,
            trace_misspelt: false,
            line_lost: false,
            whole: None,
            has_returns: false,
            unseen: Unseen::NOTHING,
            materials: Names::new(),
            groups: Names::new(),
            group: None,
            moving: Vec::new(),
            pending: Pending::default(),
            unresolved: Vec::new(),
        }
    }

    fn text(mut self, bytes: &'a [u8]) -> Parsed {
        let mut last = Line { number: 1, offset: 0, bytes: &[] };
        self.whole = std::str::from_utf8(bytes).ok();
        self.has_returns = memchr::memchr(b'\r', bytes).is_some();
        let mut words = Words::new();
        for line in lines(bytes) {
            self.line(line, &mut words);
            last = line;
        }
        self.finish(last)
    }

    fn finish(mut self, last: Line<'a>) -> Parsed {
        self.close_forgotten_group();
        if self.exposures.is_empty() && !self.trace_misspelt {
            let end = last.bytes.len();
            self.report.error(last, end..end, wording::no_trace);
        } else {
            let Unseen { lasting, removable } = std::mem::replace(&mut self.unseen, Unseen::NOTHING);
            let unseen = lasting.into_iter().chain(removable);
            if let Some((line, span)) = unseen.min_by_key(|(line, _)| line.number) {
                self.report.warning(line, span, wording::unused);
            }
        }
        self.tell_unused_names();
        self.settle_all();
        self.doubt_curves();
        visibility::check(&self.moving, &self.exposures, &mut self.report);
        let script = if self.report.has_errors() { None } else { self.recorder.finish() };
        // Of a file in another language, the first errors say all.
        if self.unknown > self.read {
            self.report.describe_at_most(foreign::DESCRIBED);
        }
        Parsed { script, diagnostics: self.report.finish(), files: self.named.into_files() }
    }

    /// Records that a line could not be read. It may contain anything that is missing.
    fn expect_no_more(&mut self) {
        self.line_lost = true;
        self.expect_no_more_of(Command::Screen);
        self.expect_no_more_of(Command::Trace);
    }

    /// Records that there was a faulty line with a command, so that its absence is not reported.
    fn expect_no_more_of(&mut self, command: Command) {
        match command.effect() {
            Effect::Trace => {
                self.trace_misspelt = true;
                self.unseen = Unseen::NOTHING;
            }
            Effect::Screen => {
                if matches!(self.screen, ScreenState::Unset) {
                    self.screen = ScreenState::Faulty;
                }
            }
            Effect::Group => self.line_lost = true,
            Effect::End => self.close_group(),
            Effect::Camera(_)
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
            | Effect::Material
            | Effect::Use
            | Effect::Object(_)
            | Effect::Mesh
            | Effect::Text
            | Effect::Light(_)
            | Effect::Clear => {}
        }
    }

    fn run(&mut self, s: &Statement<'a, '_>) {
        let effect = s.command.effect();
        self.recorder.line = s.line.number;
        if let Some(group) = &mut self.group {
            group.recorder.line = s.line.number;
        }
        if self.group.is_some()
            && !matches!(effect, Effect::Object(_) | Effect::Mesh | Effect::Text | Effect::Use | Effect::End)
        {
            self.leave_group_at(s);
        }
        match effect {
            Effect::Screen => self.screen(s),
            Effect::Camera(read) => self.camera(s, read),
            Effect::Background => self.background(s),
            Effect::Sky => self.sky(s),
            Effect::SkyPicture => self.sky_picture(s),
            Effect::Fog => self.fog(s),
            Effect::Lens => self.lens(s),
            Effect::Samples => {
                self.set(s, |recorder, samples| recorder.samples = samples);
            }
            Effect::Shutter => {
                self.set(s, |recorder, shutter| recorder.shutter = shutter);
                self.doubt_shutter(s);
            }
            Effect::Tone => self.set(s, |recorder, tone| recorder.tone = tone),
            Effect::Depth => self.set(s, |recorder, depth| recorder.depth = depth),
            Effect::Indirect => {
                self.set(s, |recorder, indirect| recorder.indirect = indirect);
                self.doubt_indirect(s);
            }
            Effect::Frames => {
                self.set(s, |recorder, numbers| recorder.numbers = numbers);
                self.doubts.has_frames = true;
            }
            Effect::Material => self.material(s),
            Effect::Group => self.open_group(s),
            Effect::End => self.end_group(s),
            Effect::Use => self.draw_group(s),
            Effect::Object(read) => self.object(s, read),
            Effect::Mesh => self.mesh(s),
            Effect::Text => self.lettering(s),
            Effect::Light(read) => self.light(s, read),
            Effect::Clear => self.clear(),
            Effect::Trace => self.trace(s),
        }
    }

    /// Makes the item of the line. If its numbers are invalid, returns `None` and reports that. A hidden object gets a
    /// radius.
    fn read<T>(&mut self, s: &Statement<'a, '_>, surface: Option<&Material>, reader: Reader<T>) -> Option<T> {
        let mut shown;
        let values = if s.command.form().hides(s.values) {
            shown = *s.values;
            s.command.form().show(&mut shown);
            &shown
        } else {
            s.values
        };
        match reader(&mut Numbers::new(values, s.count(), surface)) {
            Ok(item) => Some(item),
            Err(faults) => {
                self.invalid(s, faults);
                None
            }
        }
    }

    /// Makes the item of the line, or keeps the line if it has curves, which is validated once its visibility is
    /// known. Returns also the index of the line among those with curves.
    fn read_value<T>(
        &mut self,
        s: &Statement<'a, '_>,
        reader: Reader<T>,
    ) -> Option<(Value<T>, Option<usize>)> {
        match &s.row {
            None => self.read(s, None, reader).map(|value| (Value::Constant(value), None)),
            Some(row) => {
                let template = Template { command: s.command, row: row.clone() };
                let number = if row.is_constant() {
                    self.read(s, None, reader)?;
                    None
                } else {
                    let spans = s.words.parameters().to_vec();
                    Some(self.keep_moving(s.line, spans, Origin::Command(s.command), row))
                };
                Some((Value::Animated(template), number))
            }
        }
    }

    fn screen(&mut self, s: &Statement<'a, '_>) {
        self.unseen.lasting.get_or_insert_with(|| s.place());
        let limit = self.limits.max_pixels;
        self.screen = match self.read(s, None, Screen::read) {
            Some(screen) if screen.pixels() <= limit => ScreenState::Set(screen),
            Some(screen) => {
                let span = s.words.span(0..2);
                self.report.error(s.line, span, || wording::too_many_pixels(screen.pixels(), limit));
                ScreenState::Faulty
            }
            None => ScreenState::Faulty,
        };
        self.picture.screen_set();
    }

    fn camera(&mut self, s: &Statement<'a, '_>, read: Reader<Camera>) {
        self.unseen.lasting.get_or_insert_with(|| s.place());
        let Some((camera, moving)) = self.read_value(s, read) else {
            self.picture.camera_faulty();
            return;
        };
        self.picture.camera_set(s, &camera);
        self.doubt_camera(s, &camera);
        let old = self.pending.camera.replace((moving, self.exposures.len()));
        self.settle(old);
        self.record(|recorder| recorder.set_camera(camera));
    }

    fn lens(&mut self, s: &Statement<'a, '_>) {
        self.unseen.lasting.get_or_insert_with(|| s.place());
        let Some((lens, moving)) = self.read_value(s, Lens::read) else { return };
        let is_point = matches!(&lens, Value::Constant(lens) if lens.radius() == 0.0);
        self.picture.lens_set(s, is_point);
        self.doubt_lens(s, is_point);
        let old = self.pending.lens.replace((moving, self.exposures.len()));
        self.settle(old);
        self.record(|recorder| recorder.set_lens(lens));
    }

    /// Applies a setting that a `Clear` keeps.
    fn set<T: Scripted>(&mut self, s: &Statement<'a, '_>, set: impl FnOnce(&mut Recorder, T)) {
        self.unseen.lasting.get_or_insert_with(|| s.place());
        if let Some(value) = self.read(s, None, T::read) {
            // Also in a script with errors, because the data of a `Trace` is used later.
            set(&mut self.recorder, value);
        }
    }

    fn object(&mut self, s: &Statement<'a, '_>, read: Reader<Object>) {
        if self.group.is_none() {
            self.unseen.removable.get_or_insert_with(|| s.place());
        }
        let surface = s.surface.clone().map(|span| self.refer(Kinds::Materials, s.line, span));
        let (number, material) = match surface {
            None => (None, None),
            Some(Some(number)) => {
                let info = self.materials.get(number).value.as_ref();
                // The line of a material with curves is kept, and nothing of a faulty one.
                (Some(number), info.map(|info| info.still.clone()))
            }
            Some(None) => (None, Some(Some(Material::default()))),
        };
        let moves = matches!(material, Some(None));
        let is_constant = s.row.is_none() && !moves;
        let named_looks = number.and_then(|number| Some(self.materials.get(number).value.as_ref()?.looks));
        let drawn = if is_constant {
            let material = material.flatten().or(number.map(|_| Material::default()));
            let Some(object) = self.read(s, material.as_ref(), read) else { return };
            self.lint_object(s, &object);
            self.doubt_object(s, named_looks.unwrap_or_else(|| looks_of(object.material())));
            self.doubt_own(s, named_looks);
            self.check_uv(s, named_looks.is_some_and(|looks| looks.needs_uv), None);
            if s.command.form().hides(s.values) {
                return;
            }
            Err(object)
        } else {
            let moves = s.row.as_ref().is_some_and(|row| !row.is_constant());
            if !moves {
                let surface = s.surface.is_some().then(Material::default);
                let Some(object) = self.read(s, surface.as_ref(), read) else { return };
                self.lint_object(s, &object);
            }
            let row = s.row.clone().unwrap_or_else(|| s.still_row());
            self.doubt_object(s, named_looks.unwrap_or_else(|| looks_in(s.command.form(), &row)));
            self.doubt_own(s, named_looks);
            self.check_uv(s, named_looks.is_some_and(|looks| looks.needs_uv), None);
            let template = Template { command: s.command, row: row.clone() };
            if moves {
                let spans = s.words.parameters().to_vec();
                let moving = self.keep_moving(s.line, spans, Origin::Command(s.command), &row);
                self.see_moving(moving);
            }
            Ok(Drawn::Object { template, surface: number })
        };
        if let Some(number) = number.filter(|_| moves) {
            self.see_material(number);
        }
        self.count_drawn(s, 1, 0);
        let is_good = !self.has_errors();
        match (&mut self.group, drawn) {
            (Some(group), Err(object)) if is_good => group.recorder.add_object(object, number),
            (Some(group), Ok(drawn)) if is_good => group.recorder.add_drawn(drawn),
            (Some(_), _) => {}
            (None, Err(object)) => self.record(|recorder| recorder.add_object(object, number)),
            (None, Ok(drawn)) => self.record(|recorder| recorder.add_drawn(drawn)),
        }
    }

    /// Warns of a valid object that is probably a mistake.
    fn lint_object(&mut self, s: &Statement<'a, '_>, object: &Object) {
        let is_hidden = s.command.form().hides(s.values);
        if let Some(lint) = if is_hidden { Some(Lint::NoRadius) } else { object.lint() } {
            let place = s.command.form().place(|_, parameter| lint.is_about(parameter));
            self.report.warning(s.line, s.words.span(place), || wording::lint_fault(lint));
        }
    }

    fn light(&mut self, s: &Statement<'a, '_>, read: Reader<Light>) {
        self.unseen.removable.get_or_insert_with(|| s.place());
        let Some((light, moving)) = self.read_value(s, read) else { return };
        if let Some(moving) = moving {
            self.see_moving(moving);
        }
        self.doubt_light(s, &light);
        self.lights += 1;
        let (count, limit) = (self.lights, self.limits.max_lights);
        self.check_limit(s, count - 1, count, limit, "lights in a scene");
        self.record(|recorder| recorder.add_light(light));
    }

    fn clear(&mut self) {
        (self.objects, self.uses, self.lights) = (0, 0, 0);
        self.named.models = Default::default();
        self.doubt_no_more_of_scene();
        if let Some((line, span)) = self.unseen.removable.take() {
            self.report.warning(line, span, wording::cleared);
        }
        self.settle_scene();
        self.recorder.clear();
    }

    fn trace(&mut self, s: &Statement<'a, '_>) {
        self.unseen = Unseen::NOTHING;
        let (numbers, shutter) = (self.recorder.numbers, self.recorder.shutter);
        let before = self.frames;
        self.frames = before.saturating_add(numbers.count());
        let limit = match self.limits.max_frames {
            Some(limit) => limit as u64,
            None if numbers.count() > 1 => Limits::FRAMES,
            None => u64::MAX,
        };
        if self.frames > limit && (before <= limit || self.limits.max_frames.is_none()) {
            let frames = self.frames;
            self.report.error(s.line, s.words.command.clone(), || wording::too_many_frames(frames, limit));
        }
        let exposure = Exposure { numbers, open: shutter.open() };
        if std::mem::take(&mut self.is_fresh) || self.exposures.last() != Some(&exposure) {
            self.exposures.push(exposure);
        }
        match self.screen {
            ScreenState::Set(screen) => {
                self.picture.check(screen, &mut self.report);
                self.doubt_picture(s);
                // Each triangle of a mesh takes the memory of an object.
                let drawn = self.objects.saturating_add(self.named.models.drawn());
                self.record(|recorder| recorder.trace(screen, drawn));
            }
            ScreenState::Unset => {
                self.report.error(s.line, s.words.command.clone(), wording::no_screen);
                self.screen = ScreenState::Faulty;
            }
            ScreenState::Faulty => {}
        }
    }

    fn draw_group(&mut self, s: &Statement<'a, '_>) {
        if self.group.is_none() {
            self.unseen.removable.get_or_insert_with(|| s.place());
        }
        let Some(name) = s.subject.clone() else { return };
        let number = self.refer(Kinds::Groups, s.line, name);
        let still = match &s.row {
            None => match self.read(s, None, Placement::read) {
                Some(placement) => Some(placement),
                None => return,
            },
            Some(row) => {
                let spans = s.words.parameters().to_vec();
                let moving = self.keep_moving(s.line, spans, Origin::Command(s.command), row);
                self.see_moving(moving);
                None
            }
        };
        let Some(number) = number else { return };
        let row = s.row.clone().unwrap_or_else(|| s.still_row());
        let Some(info) = self.groups.get(number).value.as_ref() else { return };
        let (reach, scale) = info.reach.placed(&row);
        let looks = if still == Some(None) { Looks::default() } else { info.looks };
        let is_hidden = still == Some(None) || info.drawn == 0;
        let (drawn, uses) = if is_hidden { (0, 0) } else { (info.drawn, info.uses.saturating_add(1)) };
        if !is_hidden && !(4.0 * reach).is_finite() || !scale.is_finite() {
            let whole = s.words.command.start..s.words.end().end;
            let span = if s.words.count() == 0 { whole } else { s.words.rest(0) };
            self.report.error(s.line, span, wording::too_far);
        }
        let models = if is_hidden { Default::default() } else { info.models.clone() };
        self.see_group(number, reach, scale);
        self.doubt_group(s, looks);
        let before = self.named.models.clone();
        match &mut self.group {
            Some(group) => group.models.extend(&models),
            None => self.named.models.extend(&models),
        }
        self.check_triangles(s, &before);
        self.count_drawn(s, drawn, uses);
        let drawn = Drawn::Use { group: number, row };
        match &mut self.group {
            Some(group) => group.recorder.add_drawn(drawn),
            None => self.record(|recorder| recorder.add_drawn(drawn)),
        }
    }

    /// Counts drawn objects and groups, in the open group or in the scene.
    fn count_drawn(&mut self, s: &Statement<'a, '_>, drawn: usize, uses: usize) {
        if let Some(group) = &mut self.group {
            group.drawn = group.drawn.saturating_add(drawn);
            group.uses = group.uses.saturating_add(uses);
            return;
        }
        let (objects, used) = (self.objects, self.uses);
        self.objects = objects.saturating_add(drawn);
        self.uses = used.saturating_add(uses);
        let limit = self.limits.max_objects;
        self.check_limit(s, objects, self.objects, limit, "objects in a scene");
        let limit = limit.saturating_mul(Limits::USES_PER_OBJECT);
        self.check_limit(s, used, self.uses, limit, "groups drawn in a scene");
    }

    fn invalid(&mut self, s: &Statement<'a, '_>, faults: Faults) {
        faults.0.into_iter().for_each(|fault| self.invalid_value(s, fault));
    }

    fn invalid_value(&mut self, s: &Statement<'a, '_>, fault: InvalidValue) {
        let form = s.command.form();
        let place = form.place(|name, parameter| fault.is_about(parameter, name));
        let (name, field) = form.number(place.start);
        let span = s.words.span(place);
        self.report.error(s.line, span.clone(), || {
            wording::invalid(fault, name, field, &String::from_utf8_lossy(&s.line.bytes[span]))
        });
    }

    /// Reports the command that exceeds a limit.
    fn check_limit(&mut self, s: &Statement<'a, '_>, before: usize, count: usize, limit: usize, what: &str) {
        if before <= limit && count > limit {
            let span = s.words.command.clone();
            self.report.error(s.line, span, || wording::beyond_limit(count - before, count, limit, what));
        }
    }

    /// Returns whether there is a fault, including those not reported yet.
    fn has_errors(&self) -> bool {
        self.report.has_errors() || !self.unresolved.is_empty()
    }

    /// Records an item, unless the script has an error. In that case the recorded data is not needed, and its memory is
    /// freed.
    fn record(&mut self, what: impl FnOnce(&mut Recorder)) {
        if self.has_errors() {
            self.recorder.forget();
        } else {
            what(&mut self.recorder);
        }
    }
}
