//! Script text to frames and diagnostics.
//!
//! Parsing never stops at a fault: what can be said about a text is said in one go. A line is understood alone; only
//! `Trace` looks at what came before. Nothing is allocated for a line that is in order, and nothing is kept of a
//! script that has an error. A fault is told once: what follows from one that was told is not.
//!
//! Follows `docs/language.md`, where the forms of numbers, blanks and line ends are decided.

mod number;
mod text;
mod wording;

use std::ops::Range;
use std::str::Utf8Error;

use crate::command::{Command, MAX_NUMBERS};
use crate::diagnostic::Diagnostic;
use crate::form::{Numbers, Scripted};
use crate::limits::Limits;
use crate::model::{
    Camera, Cone, Cuboid, Cylinder, DirectionalLight, Disc, InvalidValue, Lamp, Light, Object, Plane, Screen,
    Sphere, Torus, Triangle,
};
use crate::report::{Fault, Line, Report};
use crate::script::{Recorder, Script};
use text::{Words, lines};

/// What a text turned out to be.
#[derive(Clone, Debug)]
pub struct Parsed {
    /// The script; `None` exactly when there is an error.
    pub script: Option<Script>,
    /// Errors and warnings in the order of the text.
    pub diagnostics: Vec<Diagnostic>,
}

/// Parses the script `bytes`; `name` is what diagnostics call it.
///
/// The `Trace` commands become the frames of the script; there is at least one.
pub fn parse(name: &str, bytes: &[u8], limits: &Limits) -> Parsed {
    let mut report = Report::new(name, limits.max_described);
    if bytes.len() > limits.max_script_bytes {
        if let Some(line) = lines(bytes).next() {
            report.error(line, 0..0, || wording::too_large(limits.max_script_bytes));
        }
    } else if let Some(mark @ (b"\xff\xfe" | b"\xfe\xff")) = bytes.get(..2) {
        report.error(Line { number: 1, offset: 0, bytes: mark }, 0..2, wording::utf16);
    } else {
        return Parser::new(limits, report).text(bytes);
    }
    Parsed { script: None, diagnostics: report.finish() }
}

struct Parser<'a> {
    limits: &'a Limits,
    report: Report<'a>,
    recorder: Recorder,
    screen: ScreenState,
    /// Objects of the scene as it stands.
    objects: usize,
    /// Lights of the scene as it stands.
    lights: usize,
    traces: usize,
    /// Whether a word was probably meant to be a `Trace`.
    trace_misspelt: bool,
    /// Where the first command since the last `Trace` stands that has no effect if no other `Trace` comes.
    unseen: Unseen<(Line<'a>, Range<usize>)>,
}

/// What no `Trace` has shown yet.
struct Unseen<T> {
    /// Of what a `Clear` leaves: screen and camera.
    lasting: Option<T>,
    /// Of what a `Clear` removes.
    removable: Option<T>,
}

impl<T> Unseen<T> {
    const NOTHING: Self = Self { lasting: None, removable: None };
}

#[derive(Clone, Copy)]
enum ScreenState {
    Unset,
    /// Whatever is wrong with it has been told.
    Faulty,
    Set(Screen),
}

/// A command whose words are numbers, and as many as it takes.
struct Statement<'a> {
    line: Line<'a>,
    command: Command,
    words: Words,
    /// Of the parameters; 0 for optional ones that are missing.
    values: [f64; MAX_NUMBERS],
}

/// The first parameter that was probably written with a comma for a point: `1,5`, in a line that would have as many
/// numbers as its command takes if only blanks separated them.
fn decimal_comma(text: &str, command: Command, words: &Words) -> Option<Range<usize>> {
    // Most lines have no comma, which is quickly seen.
    if !text.contains(',') {
        return None;
    }
    let start = words.command.end;
    let parameters = text[start..].split('#').next().unwrap_or_default();
    let is_decimal = |part: &&str| {
        let digits = |part: &str| part.bytes().all(|b| b.is_ascii_digit()) && !part.is_empty();
        part.split_once(',')
            .is_some_and(|(whole, fraction)| digits(whole.trim_start_matches(['+', '-'])) && digits(fraction))
    };
    let parts = || parameters.split([' ', '\t']).filter(|part| !part.is_empty());
    let first = parts().find(is_decimal)?;
    let at = first.as_ptr().addr() - text.as_ptr().addr();
    let count = parts().filter(|part| *part != ",").count();
    command.form().arity().contains(&count).then_some(at..at + first.len())
}

impl<'a> Statement<'a> {
    /// Of its command.
    fn place(&self) -> (Line<'a>, Range<usize>) {
        (self.line, self.words.command.clone())
    }
}

impl<'a> Parser<'a> {
    fn new(limits: &'a Limits, report: Report<'a>) -> Self {
        Self {
            limits,
            report,
            recorder: Recorder::default(),
            screen: ScreenState::Unset,
            objects: 0,
            lights: 0,
            traces: 0,
            trace_misspelt: false,
            unseen: Unseen::NOTHING,
        }
    }

    fn text(mut self, bytes: &'a [u8]) -> Parsed {
        let mut last = Line { number: 1, offset: 0, bytes: &[] };
        for line in lines(bytes) {
            if let Some(statement) = self.statement(line) {
                self.run(&statement);
            }
            last = line;
        }
        self.finish(last)
    }

    fn finish(mut self, last: Line<'a>) -> Parsed {
        if self.traces == 0 && !self.trace_misspelt {
            let end = last.bytes.len();
            self.report.error(last, end..end, wording::no_trace);
        } else {
            let Unseen { lasting, removable } = std::mem::replace(&mut self.unseen, Unseen::NOTHING);
            let unseen = lasting.into_iter().chain(removable);
            if let Some((line, span)) = unseen.min_by_key(|(line, _)| line.number) {
                self.report.warning(line, span, wording::unused);
            }
        }
        let script = if self.report.has_errors() { None } else { self.recorder.finish() };
        Parsed { script, diagnostics: self.report.finish() }
    }

    /// `None` for a line without a command and for one with a fault, which is reported.
    fn statement(&mut self, line: Line<'a>) -> Option<Statement<'a>> {
        let text = match std::str::from_utf8(line.bytes) {
            Ok(text) => text,
            Err(error) => self.not_utf8(line, error)?,
        };
        if let Some(at) = text.find('\r') {
            self.report.error(line, at..at + 1, wording::lone_carriage_return);
            self.expect_no_more();
            return None;
        }
        let words = Words::of(text.as_bytes())?;
        let name = &text[words.command.clone()];
        let Some(command) = Command::from_name(name) else {
            self.unknown_command(line, name, words.command);
            return None;
        };
        let values = self.values(line, text, command, &words);
        if values.is_none() {
            self.expect_no_more_of(command);
        } else if words.count() > *command.form().arity().start()
            && let Some(comma) = decimal_comma(text, command, &words)
        {
            self.report.warning(line, comma.clone(), || wording::decimal_comma(&text[comma]));
        }
        values.map(|values| Statement { line, command, words, values })
    }

    /// The readable start of the line if only its comment is faulty.
    fn not_utf8(&mut self, line: Line<'a>, error: Utf8Error) -> Option<&'a str> {
        let start = error.valid_up_to();
        let end = error.error_len().map_or(line.bytes.len(), |length| start + length);
        self.report.error(line, start..end, || Fault::not_utf8(line, start..end, "script"));
        let text = std::str::from_utf8(&line.bytes[..start]).ok().filter(|text| text.contains('#'));
        if text.is_none() {
            self.expect_no_more();
        }
        text
    }

    fn unknown_command(&mut self, line: Line<'a>, name: &str, span: Range<usize>) {
        // Looking for it takes longer than parsing a line.
        let nearest = if self.report.describes_next() { Command::nearest(name) } else { None };
        self.report.error(line, span, || wording::unknown_command(name, nearest));
        if let Some(command) = nearest {
            self.expect_no_more_of(command);
        }
    }

    /// A line could not be read: what is missing may stand in it.
    fn expect_no_more(&mut self) {
        self.expect_no_more_of(Command::Screen);
        self.expect_no_more_of(Command::Trace);
    }

    /// A command was there, though faulty: that it is missing would be told in vain.
    fn expect_no_more_of(&mut self, command: Command) {
        match command {
            Command::Trace => {
                self.trace_misspelt = true;
                self.unseen = Unseen::NOTHING;
            }
            Command::Screen => {
                if matches!(self.screen, ScreenState::Unset) {
                    self.screen = ScreenState::Faulty;
                }
            }
            Command::Orthocamera
            | Command::Camera
            | Command::Background
            | Command::Sphere
            | Command::Triangle
            | Command::Cuboid
            | Command::Look
            | Command::Plane
            | Command::Disc
            | Command::Cylinder
            | Command::Cone
            | Command::Torus
            | Command::Ilight
            | Command::Plight
            | Command::Clear => {}
        }
    }

    /// The values of the parameters; `None` if there is a fault in them or in their number, which is reported.
    fn values(
        &mut self,
        line: Line<'a>,
        text: &str,
        command: Command,
        words: &Words,
    ) -> Option<[f64; MAX_NUMBERS]> {
        let mut values = [0.0; MAX_NUMBERS];
        let mut good = true;
        let (least, most) = command.form().arity().into_inner();
        for (i, span) in words.parameters().iter().take(most).enumerate() {
            let word = &text[span.clone()];
            match number::parse(word) {
                Ok(value) => values[i] = value,
                Err(fault) => {
                    good = false;
                    self.report.error(line, span.clone(), || {
                        wording::bad_number(fault, command.form().number(i).0, word)
                    });
                }
            }
        }
        if words.count() < least {
            good = false;
            self.report.error(line, words.end(), || wording::too_few(command, words));
        } else if words.count() > most {
            good = false;
            self.report.error(line, words.rest(most), || {
                let first = words.parameters().get(most).map_or("", |span| &text[span.clone()]);
                wording::too_many(
                    command,
                    words,
                    first,
                    decimal_comma(text, command, words).map(|comma| &text[comma]),
                )
            });
        }
        good.then_some(values)
    }

    fn run(&mut self, s: &Statement<'a>) {
        match s.command {
            Command::Screen => self.screen(s),
            Command::Orthocamera => self.camera(s, Some(Camera::Orthographic)),
            Command::Camera => {
                let pinhole = self.read(s).map(Camera::Pinhole);
                self.camera(s, pinhole);
            }
            Command::Look => {
                let look = self.read(s).map(Camera::Look);
                self.camera(s, look);
            }
            Command::Background => self.background(s),
            Command::Sphere => self.object::<Sphere>(s),
            Command::Triangle => self.object::<Triangle>(s),
            Command::Cuboid => self.object::<Cuboid>(s),
            Command::Plane => self.object::<Plane>(s),
            Command::Disc => self.object::<Disc>(s),
            Command::Cylinder => self.object::<Cylinder>(s),
            Command::Cone => self.object::<Cone>(s),
            Command::Torus => self.object::<Torus>(s),
            Command::Ilight => self.light::<DirectionalLight>(s),
            Command::Plight => self.light::<Lamp>(s),
            Command::Clear => self.clear(),
            Command::Trace => self.trace(s),
        }
    }

    /// What the line holds; `None` for what is no such thing, which is reported.
    fn read<T: Scripted>(&mut self, s: &Statement<'a>) -> Option<T> {
        match T::read(&mut Numbers::new(&s.values)) {
            Ok(item) => Some(item),
            Err(faults) => {
                faults.0.into_iter().for_each(|fault| self.invalid(s, fault));
                None
            }
        }
    }

    fn screen(&mut self, s: &Statement<'a>) {
        self.unseen.lasting.get_or_insert_with(|| s.place());
        let limit = self.limits.max_pixels;
        self.screen = match self.read::<Screen>(s) {
            Some(screen) if screen.pixels() <= limit => ScreenState::Set(screen),
            Some(screen) => {
                let span = s.words.span(0..2);
                self.report.error(s.line, span, || wording::too_many_pixels(screen.pixels(), limit));
                ScreenState::Faulty
            }
            None => ScreenState::Faulty,
        };
    }

    fn camera(&mut self, s: &Statement<'a>, camera: Option<Camera>) {
        self.unseen.lasting.get_or_insert_with(|| s.place());
        if let Some(camera) = camera {
            self.recorder.set_camera(camera);
        }
    }

    fn background(&mut self, s: &Statement<'a>) {
        self.unseen.removable.get_or_insert_with(|| s.place());
        if let Some(background) = self.read(s) {
            self.recorder.set_background(background);
        }
    }

    fn object<T: Scripted + Into<Object>>(&mut self, s: &Statement<'a>) {
        self.unseen.removable.get_or_insert_with(|| s.place());
        let Some(object) = self.read::<T>(s).map(Into::into) else { return };
        if let Some(doubt) = object.doubt() {
            let place = s.command.form().place(|_, parameter| parameter == doubt.parameter());
            self.report.warning(s.line, s.words.span(place), || wording::doubtful(doubt));
        }
        self.objects += 1;
        self.check_limit(s, self.objects, self.limits.max_objects, "objects in a scene");
        self.record(|recorder| recorder.add_object(object));
    }

    fn light<T: Scripted + Into<Light>>(&mut self, s: &Statement<'a>) {
        self.unseen.removable.get_or_insert_with(|| s.place());
        let Some(light) = self.read::<T>(s).map(Into::into) else { return };
        self.lights += 1;
        self.check_limit(s, self.lights, self.limits.max_lights, "lights in a scene");
        self.record(|recorder| recorder.add_light(light));
    }

    fn clear(&mut self) {
        (self.objects, self.lights) = (0, 0);
        if let Some((line, span)) = self.unseen.removable.take() {
            self.report.warning(line, span, wording::cleared);
        }
        self.recorder.clear();
    }

    fn trace(&mut self, s: &Statement<'a>) {
        self.traces += 1;
        self.unseen = Unseen::NOTHING;
        self.check_limit(s, self.traces, self.limits.max_frames.unwrap_or(usize::MAX), "frames");
        match self.screen {
            ScreenState::Set(screen) => self.record(|recorder| recorder.trace(screen)),
            ScreenState::Unset => {
                self.report.error(s.line, s.words.command.clone(), wording::no_screen);
                self.screen = ScreenState::Faulty;
            }
            ScreenState::Faulty => {}
        }
    }

    fn invalid(&mut self, s: &Statement<'a>, fault: InvalidValue) {
        let form = s.command.form();
        let place = form.place(|name, parameter| fault.is_about(parameter, name));
        let (name, _) = form.number(place.start);
        let span = s.words.span(place);
        self.report.error(s.line, span.clone(), || {
            wording::invalid(fault, name, &String::from_utf8_lossy(&s.line.bytes[span]))
        });
    }

    /// Reports the first command beyond a limit.
    fn check_limit(&mut self, s: &Statement<'a>, count: usize, limit: usize, what: &str) {
        if count.checked_sub(1) == Some(limit) {
            self.report.error(s.line, s.words.command.clone(), || wording::beyond_limit(limit, what));
        }
    }

    /// Records something, unless the script has an error: then it will not be used, and its memory is given back.
    fn record(&mut self, what: impl FnOnce(&mut Recorder)) {
        if self.report.has_errors() {
            self.recorder = Recorder::default();
        } else {
            what(&mut self.recorder);
        }
    }
}
