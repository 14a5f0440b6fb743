//! Script text to frames and diagnostics.
//!
//! Parsing never stops at a fault: what can be said about a text is said in one go. A line is understood alone; only
//! `Trace` looks at what came before. Nothing is allocated for a line that is in order, and nothing is kept of a
//! script that has an error.
//!
//! Follows `docs/language.md`, where the forms of numbers, blanks and line ends are decided.

mod command;
mod number;
mod report;

use std::ops::Range;

use glam::{DVec2, DVec3};

use crate::diagnostic::{Code, Diagnostic};
use crate::limits::Limits;
use crate::model::{
    Cuboid, DirectionalLight, InvalidValue, Light, Material, Object, Pinhole, Screen, Sphere, Triangle,
};
use crate::script::{Recorder, Script};
use command::{Command, MAX_PARAMETERS};
use report::{Fault, Line, Report, grouped, quoted};

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
    let mut parser = Parser {
        limits,
        report: Report::new(name, limits.max_described),
        recorder: Recorder::default(),
        screen: ScreenState::Unset,
        objects: 0,
        lights: 0,
        traces: 0,
        trace_misspelt: false,
        unused: None,
    };
    if bytes.len() > limits.max_script_bytes {
        let line = Line { number: 1, offset: 0, bytes: &[] };
        parser.report.error(line, 0..0, too_large(bytes.len(), limits.max_script_bytes));
        return Parsed { script: None, diagnostics: parser.report.finish() };
    }
    if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") {
        let line = Line { number: 1, offset: 0, bytes: &bytes[..2] };
        let fault = Fault::new(Code::NotUtf8, "the script is UTF-16 text").help("save it as UTF-8");
        parser.report.error(line, 0..2, fault);
        return Parsed { script: None, diagnostics: parser.report.finish() };
    }
    let mut last = Line { number: 1, offset: 0, bytes: &[] };
    for line in lines(bytes) {
        parser.line(line);
        last = line;
    }
    parser.finish(last)
}

/// The lines of a text without their ends and without the byte-order mark. The last one is empty when the text ends
/// with a line feed.
fn lines(bytes: &[u8]) -> impl Iterator<Item = Line<'_>> {
    const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";
    let mut offset = if bytes.starts_with(BYTE_ORDER_MARK) { BYTE_ORDER_MARK.len() } else { 0 };
    bytes[offset..].split(|&b| b == b'\n').enumerate().map(move |(i, whole)| {
        let line = Line { number: i + 1, offset, bytes: whole.strip_suffix(b"\r").unwrap_or(whole) };
        offset += whole.len() + 1;
        line
    })
}

struct Parser<'a> {
    limits: &'a Limits,
    report: Report<'a>,
    recorder: Recorder,
    screen: ScreenState,
    /// Objects and lights of the scene as it stands.
    objects: usize,
    lights: usize,
    traces: usize,
    /// Whether a line was probably meant to be a `Trace`.
    trace_misspelt: bool,
    /// The first command since the last `Trace` that draws nothing if no other `Trace` comes.
    unused: Option<(Line<'a>, Range<usize>)>,
}

#[derive(Clone, Copy)]
enum ScreenState {
    Unset,
    /// Set by a command with an error, which has been reported.
    Faulty,
    Set(Screen),
}

/// The words of a line: its command and the parameters, of which those beyond the most that any command takes are
/// only counted.
struct Words {
    command: Range<usize>,
    parameters: [Range<usize>; MAX_PARAMETERS],
    count: usize,
    /// End of the last word.
    end: usize,
}

fn is_separator(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | b',')
}

/// `None` for a line without a command.
fn words(line: &[u8]) -> Option<Words> {
    const NOWHERE: Range<usize> = 0..0;
    let mut words = Words { command: NOWHERE, parameters: [NOWHERE; MAX_PARAMETERS], count: 0, end: 0 };
    let mut at = 0;
    let mut next = || {
        while at < line.len() && is_separator(line[at]) {
            at += 1;
        }
        let start = at;
        while at < line.len() && !is_separator(line[at]) && line[at] != b'#' {
            at += 1;
        }
        (at > start).then_some(start..at)
    };
    words.command = next()?;
    words.end = words.command.end;
    while let Some(word) = next() {
        words.end = word.end;
        if let Some(slot) = words.parameters.get_mut(words.count) {
            *slot = word;
        }
        words.count += 1;
    }
    Some(words)
}

impl<'a> Parser<'a> {
    fn line(&mut self, line: Line<'a>) {
        let text = match std::str::from_utf8(line.bytes) {
            Ok(text) => text,
            Err(error) => return self.not_utf8(line, error),
        };
        let Some(words) = words(line.bytes) else {
            return self.lone_carriage_return(line, text);
        };
        if text.contains('\r') {
            return self.lone_carriage_return(line, text);
        }
        let name = &text[words.command.clone()];
        let Some(command) = Command::from_name(name) else {
            return self.unknown_command(line, name, words.command);
        };
        match self.parameters(line, text, command, &words) {
            Some(values) => self.run(line, command, &words, &values),
            None => match command {
                Command::Screen if matches!(self.screen, ScreenState::Unset) => {
                    self.screen = ScreenState::Faulty;
                }
                Command::Trace => {
                    self.traces += 1;
                    self.unused = None;
                }
                _ => {}
            },
        }
    }

    /// The values of the parameters, missing ones 0; `None` if there was something wrong with them.
    fn parameters(
        &mut self,
        line: Line<'a>,
        text: &str,
        command: Command,
        words: &Words,
    ) -> Option<[f64; MAX_PARAMETERS]> {
        let mut values = [0.0; MAX_PARAMETERS];
        let mut good = true;
        let names = command.parameters();
        for ((value, word), name) in
            values.iter_mut().zip(&words.parameters[..words.count.min(names.len())]).zip(names)
        {
            match number::parse(&text[word.clone()]) {
                Ok(x) => *value = x,
                Err(fault) => {
                    good = false;
                    self.report.error(line, word.clone(), fault.of(name, &text[word.clone()]));
                }
            }
        }
        if !command.arity().contains(&words.count) {
            good = false;
            self.wrong_count(line, command, words);
        }
        good.then_some(values)
    }

    fn run(&mut self, line: Line<'a>, command: Command, words: &Words, values: &[f64; MAX_PARAMETERS]) {
        let v3 = |i: usize| DVec3::new(values[i], values[i + 1], values[i + 2]);
        let matte = |i: usize| Material::new(v3(i), v3(i + 3), DVec3::ZERO);
        if !matches!(command, Command::Trace | Command::Clear) && self.unused.is_none() {
            self.unused = Some((line, words.command.clone()));
        }
        match command {
            Command::Screen => self.set_screen(line, words, values),
            Command::Orthocamera => self.recorder.set_camera(crate::Camera::Orthographic),
            Command::Camera => {
                let (a, b) = (DVec2::new(values[10], values[11]), DVec2::new(values[12], values[13]));
                match Pinhole::checked(v3(0), v3(3), v3(6), values[9], a, b) {
                    Ok(pinhole) => self.recorder.set_camera(crate::Camera::Pinhole(pinhole)),
                    Err(faults) => {
                        faults.into_iter().for_each(|fault| self.invalid(line, command, words, fault));
                    }
                }
            }
            Command::Background => self.recorder.set_background(v3(0)),
            Command::Sphere => {
                let sphere =
                    Material::new(v3(4), v3(7), v3(10)).and_then(|m| Sphere::new(values[0], v3(1), m));
                self.add_object(line, command, words, sphere.map(Object::Sphere));
            }
            Command::Triangle => {
                let triangle = matte(9).and_then(|m| Triangle::new([v3(0), v3(3), v3(6)], m));
                if triangle.is_ok_and(|t| t.is_degenerate()) {
                    let fault =
                        Fault::new(Code::DegenerateTriangle, "this triangle has no area and is never hit")
                            .expected("these three points lie on a line");
                    let span = words.parameters[0].start..words.parameters[8].end;
                    self.report.warning(line, span, fault);
                }
                self.add_object(line, command, words, triangle.map(Object::Triangle));
            }
            Command::Cuboid => {
                let cuboid = matte(6).and_then(|m| Cuboid::new([v3(0), v3(3)], m));
                self.add_object(line, command, words, cuboid.map(Object::Cuboid));
            }
            Command::Ilight => match DirectionalLight::new(v3(0), v3(3)) {
                Ok(light) => {
                    self.lights += 1;
                    self.keep(line, words, self.lights, self.limits.max_lights, "lights", |recorder| {
                        recorder.add_light(Light::Directional(light));
                    });
                }
                Err(fault) => self.invalid(line, command, words, fault),
            },
            Command::Clear => {
                (self.objects, self.lights) = (0, 0);
                self.unused = None;
                self.recorder.clear();
            }
            Command::Trace => self.trace(line, words),
        }
    }

    fn add_object(
        &mut self,
        line: Line<'a>,
        command: Command,
        words: &Words,
        object: Result<Object, InvalidValue>,
    ) {
        match object {
            Ok(object) => {
                self.objects += 1;
                self.keep(line, words, self.objects, self.limits.max_objects, "objects", |recorder| {
                    recorder.add_object(object);
                });
            }
            Err(fault) => self.invalid(line, command, words, fault),
        }
    }

    /// Records unless there are more than the limit, which is reported once for each scene, or the script has an
    /// error, so that it will not be used.
    fn keep(
        &mut self,
        line: Line<'a>,
        words: &Words,
        count: usize,
        limit: usize,
        what: &str,
        record: impl FnOnce(&mut Recorder),
    ) {
        if count == limit.saturating_add(1) {
            let fault = Fault::new(
                Code::LimitExceeded,
                format!("more than {} {what} in a scene", grouped(limit as u64)),
            )
            .expected("one more than the limit");
            self.report.error(line, words.command.clone(), fault);
        }
        if self.report.has_errors() {
            self.recorder = Recorder::default();
        } else {
            record(&mut self.recorder);
        }
    }

    fn set_screen(&mut self, line: Line<'a>, words: &Words, values: &[f64; MAX_PARAMETERS]) {
        self.screen = match self.sides(line, words, values) {
            Some(screen) => ScreenState::Set(screen),
            None => ScreenState::Faulty,
        };
    }

    fn sides(&mut self, line: Line<'a>, words: &Words, values: &[f64; MAX_PARAMETERS]) -> Option<Screen> {
        let mut sides = [0; 2];
        let mut good = true;
        for (i, side) in sides.iter_mut().enumerate() {
            if values[i] >= 1.0 && values[i].fract() == 0.0 && values[i] <= f64::from(u32::MAX) {
                *side = values[i] as u32;
                continue;
            }
            good = false;
            let name = Command::Screen.parameters()[i];
            let message = if values[i] > f64::from(u32::MAX) {
                format!("`{name}` must be at most {}", grouped(u32::MAX.into()))
            } else {
                format!("`{name}` must be a whole number from 1")
            };
            let fault = Fault::new(Code::InvalidValue, message).expected("expected a number of pixels");
            self.report.error(line, words.parameters[i].clone(), fault);
        }
        let screen = if good { Screen::new(sides[0], sides[1]).ok()? } else { return None };
        if screen.pixels() > self.limits.max_pixels {
            let [pixels, limit] = [screen.pixels(), self.limits.max_pixels].map(grouped);
            let fault = Fault::new(
                Code::LimitExceeded,
                format!("the image has {pixels} pixels, the limit is {limit}"),
            )
            .expected("this is too large")
            .help("make it smaller, or raise the limit on pixels");
            self.report.error(line, words.parameters[0].start..words.parameters[1].end, fault);
            return None;
        }
        Some(screen)
    }

    fn trace(&mut self, line: Line<'a>, words: &Words) {
        self.traces += 1;
        self.unused = None;
        if self.limits.max_frames.is_some_and(|limit| self.traces == limit.saturating_add(1)) {
            let fault = Fault::new(
                Code::LimitExceeded,
                format!("more than {} frames", grouped(self.traces as u64 - 1)),
            )
            .expected("one more than the limit");
            self.report.error(line, words.command.clone(), fault);
        }
        match self.screen {
            ScreenState::Set(screen) if !self.report.has_errors() => self.recorder.trace(screen),
            ScreenState::Unset => {
                let fault = Fault::new(Code::NoScreen, "the size of the image is not known yet")
                    .expected("expected a `Screen` command before this")
                    .help("for example `Screen 640 480`");
                self.report.error(line, words.command.clone(), fault);
                self.screen = ScreenState::Faulty;
            }
            _ => {}
        }
    }

    fn finish(mut self, last: Line<'a>) -> Parsed {
        let end = last.bytes.len();
        if self.traces == 0 && !self.trace_misspelt {
            let fault = Fault::new(Code::NoTrace, "nothing is rendered: the script has no `Trace`")
                .expected("expected a `Trace`")
                .help("`Trace` renders a frame of everything that stands before it");
            self.report.error(last, end..end, fault);
        } else if let Some((line, span)) = self.unused.take() {
            let fault = Fault::new(Code::Unused, "this has no effect: no `Trace` follows")
                .help("`Trace` renders a frame of everything that stands before it");
            self.report.warning(line, span, fault);
        }
        let script = if self.report.has_errors() { None } else { self.recorder.finish() };
        Parsed { script, diagnostics: self.report.finish() }
    }

    fn not_utf8(&mut self, line: Line<'a>, error: std::str::Utf8Error) {
        let start = error.valid_up_to();
        let end = error.error_len().map_or(line.bytes.len(), |length| start + length);
        let bytes: Vec<_> = line.bytes[start..end].iter().map(|b| format!("0x{b:02X}")).collect();
        let fault = Fault::new(Code::NotUtf8, format!("not UTF-8 text: {}", bytes.join(" ")))
            .expected("expected UTF-8")
            .help("save the script as UTF-8");
        self.report.error(line, start..end, fault);
    }

    fn lone_carriage_return(&mut self, line: Line<'a>, text: &str) {
        if let Some(at) = text.find('\r') {
            let fault = Fault::new(Code::LoneCarriageReturn, "a carriage return without a line feed")
                .expected("expected a line feed here")
                .help("lines end with LF or CR LF; save the script with either");
            self.report.error(line, at..at + 1, fault);
        }
    }

    fn unknown_command(&mut self, line: Line<'a>, name: &str, span: Range<usize>) {
        let nearest = Command::nearest(name);
        let fault = Fault::new(Code::UnknownCommand, format!("unknown command {}", quoted(name)));
        let fault = match nearest {
            Some(command) => fault.help(format!("did you mean `{}`?", command.name())),
            None if number::parse(name).is_ok() => {
                fault.help("a command and all its parameters stand on one line")
            }
            None => {
                let names: Vec<_> = Command::ALL.iter().map(|c| c.name()).collect();
                fault.help(format!("the commands are {}", names.join(", ")))
            }
        };
        self.trace_misspelt |= nearest == Some(Command::Trace);
        if nearest == Some(Command::Screen) && matches!(self.screen, ScreenState::Unset) {
            self.screen = ScreenState::Faulty;
        }
        self.report.error(line, span, fault.expected("expected a command"));
    }

    fn wrong_count(&mut self, line: Line<'a>, command: Command, words: &Words) {
        let name = command.name();
        let (least, most) = command.arity().into_inner();
        let takes = match (least, most) {
            (0, 0) => "no parameters".to_string(),
            (a, b) if a == b => format!("{a} numbers"),
            (a, b) => format!("{a} to {b} numbers"),
        };
        let count = words.count;
        let usage = format!("write `{}`", command.usage());
        if count < least {
            let found = if count == 0 { "none".to_string() } else { count.to_string() };
            let fault = Fault::new(Code::TooFewParameters, format!("`{name}` takes {takes}, found {found}"))
                .expected(format!("expected `{}` here", command.parameters()[count]))
                .help(usage);
            self.report.error(line, words.end..words.end, fault);
        } else {
            let start = words.parameters.get(most).map_or(words.end, |word| word.start);
            let fault = Fault::new(Code::TooManyParameters, format!("`{name}` takes {takes}, found {count}"))
                .expected("expected the end of the line")
                .help(usage);
            self.report.error(line, start..words.end, fault);
        }
    }

    fn invalid(&mut self, line: Line<'a>, command: Command, words: &Words, fault: InvalidValue) {
        let place = command.place_of(fault);
        let span = words.parameters[place.start].start..words.parameters[place.end - 1].end;
        self.report.error(line, span, Fault::new(Code::InvalidValue, fault.to_string()));
    }
}

fn too_large(size: usize, limit: usize) -> Fault {
    let [size, limit] = [size, limit].map(|bytes| grouped(bytes as u64));
    Fault::new(Code::TextTooLarge, format!("the script has {size} bytes, the limit is {limit}"))
}
