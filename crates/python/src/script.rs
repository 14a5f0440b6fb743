//! A scene as the text of its script, line by line.
//!
//! The text is the only copy of the scene, and Python draws the same as `rayfold render` from it. Each call checks its
//! arguments and adds a line. The text is parsed when frames are requested, and the parsed script is kept until the
//! next line.
//!
//! Invariants: a call that fails adds nothing, except perhaps an unused material. A material is defined outside of
//! groups and before its use.

use std::path::Path;
use std::sync::Arc;

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString, PyTuple};
use rayfold_files::library_beside;
use rayfold_scene::assets::{file_name, limits::FILES};
use rayfold_scene::{
    Command, Diagnostic as SceneDiagnostic, Form, Limits, Names, Quotes, Script as Parsed, Subject,
    parse_with_files, quoted_word,
};

use crate::arrays::picture_of;
use crate::error::{Diagnostic, guarded, scene_error};
use crate::given::{Given as Handed, Givens, library_with_given};
use crate::material::{
    Material, Materials, Value as Clause, clause_of, name_from, surface_of, surface_of_color,
};
use crate::place::{Place, flag_of, quoted, shown};
use crate::signature::{METHODS, Role, Signature, aligns};
use crate::value::{Numbers, check_alone, refused, write_number};

/// The name of a script that has none.
const UNNAMED: &str = "scene";

/// The text of a scene. Python's `Scene` adds the methods.
#[pyclass(subclass, module = "rayfold")]
#[derive(Clone)]
pub(crate) struct Script {
    name: String,
    text: String,
    /// The first byte of the open group, before which materials are defined.
    group: Option<usize>,
    groups: Vec<String>,
    materials: Materials,
    /// Whether lines follow the last `Trace`, or there is none.
    is_open: bool,
    /// The first byte of the `Trace` that ends a text that was parsed. The next line takes its place.
    last_trace: Option<usize>,
    /// The files that were handed over as arrays, among those that the script names.
    given: Givens,
    parsed: Option<Arc<Parsed>>,
    /// The lines before they are added; kept for their memory.
    line: String,
    definitions: String,
}

impl Script {
    fn empty(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            text: String::new(),
            group: None,
            groups: Vec::new(),
            materials: Materials::default(),
            is_open: true,
            last_trace: None,
            given: Givens::new(),
            parsed: None,
            line: String::new(),
            definitions: String::new(),
        }
    }

    /// Returns the parsed script.
    ///
    /// # Errors
    /// Fails if the script has an error.
    pub(crate) fn parsed(&mut self, py: Python<'_>) -> PyResult<Arc<Parsed>> {
        if let Some(parsed) = &self.parsed {
            return Ok(parsed.clone());
        }
        let text = self.whole();
        let result = self.parse(py, &text)?;
        let warnings = |d: &SceneDiagnostic| !d.is_error();
        match result.script {
            Some(script) => {
                for warning in result.diagnostics.into_iter().filter(warnings) {
                    warn(py, warning)?;
                }
                let script = Arc::new(script);
                self.parsed = Some(script.clone());
                Ok(script)
            }
            None => Err(scene_error(py, result.diagnostics)),
        }
    }

    /// Parses a text, with the files of the script's folder and those that were passed as arrays.
    fn parse(&self, py: Python<'_>, text: &str) -> PyResult<rayfold_scene::Parsed> {
        let name = &self.name;
        let of_script = if self.given.is_empty() { library_beside } else { library_with_given };
        let library = of_script(Path::new(name));
        py.detach(|| guarded(|| parse_with_files(name, text.as_bytes(), &Limits::default(), &library)))
    }

    /// Returns the text with its last `Trace`.
    fn whole(&self) -> String {
        let mut text = String::with_capacity(self.text.len() + 6);
        text += &self.text;
        if self.is_open {
            text += "Trace\n";
        }
        text
    }

    /// Adds the definitions and the line that were prepared.
    fn commit(&mut self) {
        self.commit_definitions();
        self.text += &self.line;
        self.text.push('\n');
    }

    /// Adds the definitions of materials that were prepared.
    fn commit_definitions(&mut self) {
        if let Some(start) = self.last_trace.take() {
            self.text.truncate(start);
            self.is_open = true;
        }
        if !self.text.is_empty() && !self.text.ends_with('\n') {
            self.text.push('\n');
        }
        if !self.definitions.is_empty() {
            match &mut self.group {
                None => self.text += &self.definitions,
                Some(start) => {
                    self.text.insert_str(*start, &self.definitions);
                    *start += self.definitions.len();
                }
            }
            self.definitions.clear();
        }
        self.parsed = None;
    }

    /// Records the changes by a line that was added.
    fn note(&mut self, command: Command, name: Option<String>) {
        self.is_open = command != Command::Trace;
        match command {
            Command::Group => {
                self.group = Some(self.text.len() - self.line.len() - 1);
                self.groups.extend(name);
            }
            Command::End => self.group = None,
            _ => {}
        }
    }

    fn write_line(
        &mut self,
        method: &Signature,
        args: &Bound<'_, PyTuple>,
        kwargs: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Option<String>> {
        let form = method.command.form();
        self.definitions.clear();
        if let Some(word) = form.word
            && is_only(word, args, kwargs)
        {
            self.line.clear();
            self.line += &format!("{} {word}", form.name);
            return Ok(None);
        }
        let given = Given::bind(method, args, kwargs)?;
        let mut line = std::mem::take(&mut self.line);
        line.clear();
        line += form.name;
        let mut numbers = Numbers::new();
        let mut subject = None;
        let mut surface = None;
        let mut options = String::new();
        for (i, parameter) in method.parameters.iter().enumerate() {
            let place = Place { method: &method.method, parameter: &parameter.name };
            match (parameter.role, &given.values[i]) {
                (Role::Name(_), Some(value))
                    if method.command == Command::SkyPicture
                        && !value.is_instance_of::<PyString>()
                        && let Some(file) = picture_of(value, place, "sky")? =>
                {
                    line.push(' ');
                    line += &self.take(&file, place)?;
                }
                (Role::Name(kind), Some(value)) => {
                    let name = self.name_of(kind, value, place)?;
                    line.push(' ');
                    line += &name;
                    subject = Some(name);
                }
                (Role::Field(field), Some(value)) => {
                    numbers.field(&mut line, value, form, &form.fields[field], place)?;
                }
                (Role::Field(field), None) => {
                    let later = (i + 1..method.parameters.len()).find(|&k| {
                        matches!(method.parameters[k].role, Role::Field(_)) && given.values[k].is_some()
                    });
                    if let Some(later) = later {
                        let later = &method.parameters[later].name;
                        numbers.default(&mut line, &form.fields[field], place, later)?;
                    }
                }
                (Role::Material(_), value) => surface = Some(value.clone()),
                (Role::Smooth, Some(value)) => options = smooth(value, place)?,
                (Role::Flat, Some(value)) => match (flag_of(value, place)?, options.is_empty()) {
                    (true, true) => options.push_str(" flat"),
                    (true, false) => {
                        return Err(PyTypeError::new_err(format!(
                            "{place}: a mesh is either smooth or flat"
                        )));
                    }
                    (false, _) => {}
                },
                (Role::Align, Some(value)) => options += &align(value, form, place)?,
                (Role::Font, Some(value)) => {
                    let file = self.name_of(Subject::Quotes(Quotes::File), value, place)?;
                    options += &format!(" font {file}");
                }
                (Role::Name(_) | Role::Smooth | Role::Flat | Role::Align | Role::Font, _) => {}
            }
        }
        let names =
            || method.parameters.iter().filter(|p| matches!(p.role, Role::Field(_))).map(|p| p.name.as_str());
        if numbers.moves {
            check_alone(&method.method, form, &names().collect::<Vec<_>>(), numbers.values())?;
        } else if let Some(fault) = method.command.check(numbers.values()).into_iter().next() {
            return Err(refused(&method.method, form, &names().collect::<Vec<_>>(), numbers.values(), fault));
        }
        let is_bare = form.is_bare(numbers.values().len()) && given.clauses.is_empty();
        if let Some(value) = surface.filter(|value| !is_bare || value.is_some()) {
            line.push(' ');
            self.material_of(method, value.as_ref(), given.clauses, &mut line)?;
        }
        line += &options;
        self.line = line;
        Ok(subject)
    }

    /// Returns the name that a line defines or refers to.
    ///
    /// # Errors
    /// Fails if the name is invalid, is already defined, or is not yet defined.
    fn name_of(&mut self, kind: Subject, value: &Bound<'_, PyAny>, place: Place<'_>) -> PyResult<String> {
        if matches!(kind, Subject::Quotes(Quotes::File)) {
            if let Ok(file) = value.cast::<Handed>() {
                return self.take(file.get(), place);
            }
            let name = value
                .extract::<String>()
                .map_err(|_| PyTypeError::new_err(format!("{place} is a str, not {}", shown(value))))?;
            file_name(&name).map_err(|fault| PyValueError::new_err(format!("{place}: {fault}")))?;
            return Ok(quoted_word(&name));
        }
        if matches!(kind, Subject::Quotes(Quotes::Words)) {
            let words = value
                .extract::<String>()
                .map_err(|_| PyTypeError::new_err(format!("{place} is a str, not {}", shown(value))))?;
            let control = words.chars().find(|c| c.is_control() && *c != '\n');
            if let Some(control) = control {
                let message = format!("{place} has the control character U+{:04X}", u32::from(control));
                return Err(PyValueError::new_err(message));
            }
            return Ok(quoted_word(&words));
        }
        let name = name_from(value, place)?;
        let (is_known, noun) = match kind {
            Subject::Defines(names) | Subject::Refers(names) => match names {
                Names::Materials => (self.materials.has(&name), names.noun()),
                Names::Groups => (self.groups.contains(&name), names.noun()),
            },
            Subject::Quotes(_) => return Ok(quoted_word(&name)),
        };
        match (kind, is_known) {
            (Subject::Defines(_), true) => Err(PyValueError::new_err(format!(
                "{place}: there is a {noun} with the name {} already",
                quoted(&name)
            ))),
            (Subject::Refers(_), false) => {
                Err(PyValueError::new_err(format!("{place}: no {noun} has the name {} yet", quoted(&name))))
            }
            _ => Ok(name),
        }
    }

    /// Takes a file that was passed as an array, and returns its name for the script.
    ///
    /// # Errors
    /// Fails if a script may have no more.
    fn take(&mut self, file: &Handed, place: Place<'_>) -> PyResult<String> {
        let name = file.name_of();
        if self.given.len() >= FILES && !self.given.contains_key(name) {
            return Err(PyValueError::new_err(format!(
                "{place}: a scene has at most {FILES} meshes and pictures from arrays: join the meshes that have one material"
            )));
        }
        self.given.insert(name.to_owned(), file.clone());
        Ok(quoted_word(name))
    }

    /// Adds the name of an object's material to `line`. The material is defined if it is new.
    ///
    /// # Errors
    /// Fails if the value is none.
    fn material_of(
        &mut self,
        method: &Signature,
        value: Option<&Bound<'_, PyAny>>,
        clauses: Vec<Clause<'_>>,
        line: &mut String,
    ) -> PyResult<()> {
        let method = &method.method;
        let surface;
        let surface = match (value, clauses.is_empty()) {
            (Some(_), false) => {
                let message = format!("{method}() takes either `material` or the clauses of one");
                return Err(PyTypeError::new_err(message));
            }
            (None, true) => {
                let message =
                    format!("{method}() lacks a material, or a clause of one such as diffuse=\"#c04020\"");
                return Err(PyTypeError::new_err(message));
            }
            (None, false) => {
                surface = surface_of(method, None, clauses)?;
                &surface
            }
            (Some(value), true) => {
                if let Ok(material) = value.cast::<Material>() {
                    &material.get().0
                } else {
                    let Ok(name) = value.cast::<PyString>() else {
                        return Err(PyTypeError::new_err(format!(
                            "{method}(): material is a Material, the name of one or a colour, not {}",
                            shown(value)
                        )));
                    };
                    let text = name.to_string_lossy();
                    if !text.starts_with('#') {
                        *line += self.materials.known(Place { method, parameter: "material" }, &text)?;
                        return Ok(());
                    }
                    surface = surface_of_color(name, Place { method, parameter: "material" })?;
                    &surface
                }
            }
        };
        if let Some(file) = surface.given() {
            self.take(file, Place { method, parameter: "image" })?;
        }
        self.materials.define(method, surface, line, &mut self.definitions)
    }
}

/// The arguments of a call, by parameter.
struct Given<'py> {
    values: Vec<Option<Bound<'py, PyAny>>>,
    clauses: Vec<Clause<'py>>,
}

impl<'py> Given<'py> {
    fn bind(
        method: &Signature,
        args: &Bound<'py, PyTuple>,
        kwargs: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Self> {
        let Signature { method: name, parameters, .. } = method;
        if args.len() > parameters.len() {
            return Err(PyTypeError::new_err(format!(
                "{name}() takes {} at most, not {}: ({})",
                count(parameters.len(), "argument"),
                args.len(),
                names_of(method).join(", ")
            )));
        }
        let present = |value: Bound<'py, PyAny>| (!value.is_none()).then_some(value);
        let mut values: Vec<Option<Bound<'py, PyAny>>> = Vec::with_capacity(parameters.len());
        values.extend(args.iter().map(present));
        values.resize(parameters.len(), None);
        let mut clauses = Vec::new();
        for (key, value) in kwargs.into_iter().flatten() {
            let key = key.cast_into::<PyString>()?;
            let text = key.to_string_lossy();
            if let Some(i) = parameters.iter().position(|parameter| parameter.name == text) {
                if i < args.len() {
                    return Err(PyTypeError::new_err(format!("{name}() got two values for {text}")));
                }
                values[i] = present(value);
            } else if method.has_clauses() {
                let index = clause_of(name, &key)?;
                if !value.is_none() {
                    clauses.push((index, value));
                }
            } else {
                return Err(PyTypeError::new_err(format!(
                    "{name}() has no parameter {text:?}; its parameters are ({})",
                    names_of(method).join(", ")
                )));
            }
        }
        for (parameter, value) in parameters.iter().zip(&values) {
            if parameter.is_required && value.is_none() {
                return Err(PyTypeError::new_err(format!(
                    "{name}() lacks {}: ({})",
                    parameter.name,
                    names_of(method).join(", ")
                )));
            }
        }
        Ok(Self { values, clauses })
    }
}

#[pymethods]
impl Script {
    #[new]
    #[pyo3(signature = (*_args, **_kwargs))]
    fn new(_args: &Bound<'_, PyTuple>, _kwargs: Option<&Bound<'_, PyDict>>) -> Self {
        Self::empty(UNNAMED)
    }

    /// Adds the line of a command, by its index in `methods()`. Returns the material that it defines.
    #[pyo3(signature = (index, args, kwargs))]
    fn _add(
        &mut self,
        index: usize,
        args: &Bound<'_, PyTuple>,
        kwargs: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Option<Material>> {
        let method = &METHODS[index];
        if method.command == Command::Material {
            return self.material(method, args, kwargs).map(Some);
        }
        if self.group.is_some() && method.command == Command::Group {
            return Err(PyValueError::new_err(
                "group(): a group is open, which end() closes before the next begins",
            ));
        }
        if self.group.is_none() && method.command == Command::End {
            return Err(PyValueError::new_err("end(): no group is open"));
        }
        let name = self.write_line(method, args, kwargs);
        if name.is_err() && !self.definitions.is_empty() {
            self.commit_definitions();
        }
        let name = name?;
        self.commit();
        self.note(method.command, name);
        Ok(None)
    }

    /// Makes this the script of a text. Returns nothing; a faulty text is an error.
    fn _read(&mut self, py: Python<'_>, text: &str, name: &str) -> PyResult<()> {
        let mut read = Self::empty(name);
        text.clone_into(&mut read.text);
        read.given = Handed::in_text(text, Path::new(name));
        read.is_open = false;
        read.parsed(py)?;
        let mut offset = 0;
        for line in text.split_inclusive('\n') {
            let mut words = line.split('#').next().unwrap_or_default().split([' ', '\t', '\r', '\n', ',']);
            let mut words = words.by_ref().filter(|word| !word.is_empty());
            if let Some(command) =
                words.next().and_then(|word| Command::from_name(word.trim_start_matches('\u{feff}')))
            {
                read.last_trace = (command == Command::Trace).then_some(offset);
                match (command, words.next()) {
                    (Command::Material, Some(name)) => read.materials.note(name),
                    (Command::Group, Some(name)) => read.groups.push(name.to_owned()),
                    _ => {}
                }
            }
            offset += line.len();
        }
        *self = read;
        Ok(())
    }

    /// Returns the folder of the script, the names of the files in it that the script names, and those of its files that were
    /// handed over.
    fn _files(&self, py: Python<'_>) -> PyResult<(String, Vec<String>, Vec<Handed>)> {
        let folder = Path::new(&self.name).parent().unwrap_or(Path::new("")).display().to_string();
        let named = if self.text.contains('"') { self.parse(py, &self.whole())?.files } else { Vec::new() };
        let (given, files): (Vec<_>, Vec<_>) =
            named.into_iter().partition(|name| self.given.contains_key(name));
        Ok((folder, files, given.iter().filter_map(|name| self.given.get(name).cloned()).collect()))
    }

    /// Returns the files that were handed over.
    #[getter]
    fn _given(&self) -> Vec<Handed> {
        self.given.values().cloned().collect()
    }

    fn _assign(&mut self, other: &Self) {
        *self = other.clone();
    }

    #[getter]
    fn _name(&self) -> &str {
        &self.name
    }

    fn __str__(&self) -> String {
        self.whole()
    }

    fn __repr__(&self) -> String {
        format!("<rayfold.Scene: {}>", count(self.text.lines().count(), "line"))
    }

    /// The number of frames.
    ///
    /// Raises
    /// ------
    /// SceneError
    ///     if the script has an error.
    #[getter]
    fn frame_count(&mut self, py: Python<'_>) -> PyResult<usize> {
        Ok(self.parsed(py)?.frame_count())
    }

    /// Returns whether a frame has no background.
    fn _has_clear_frames(&mut self, py: Python<'_>) -> PyResult<bool> {
        Ok(self.parsed(py)?.shots().any(|shot| shot.is_clear))
    }

    /// Returns the columns and rows of a frame, counted from 0, and the largest number of objects in it.
    fn _shape(&mut self, py: Python<'_>, frame: usize) -> PyResult<(u32, u32, usize)> {
        let script = self.parsed(py)?;
        let mut before = 0;
        for shot in script.shots() {
            before += shot.frame_count;
            if frame < before {
                return Ok((shot.screen.width(), shot.screen.height(), shot.objects));
            }
        }
        Err(PyValueError::new_err(format!(
            "there is no frame {}: the scene has {}",
            frame + 1,
            count(before, "frame")
        )))
    }

    /// Returns the columns and rows of the frames, without those that are as the one before.
    fn _sizes(&mut self, py: Python<'_>) -> PyResult<Vec<(u32, u32)>> {
        let script = self.parsed(py)?;
        let mut sizes: Vec<_> =
            script.shots().map(|shot| (shot.screen.width(), shot.screen.height())).collect();
        sizes.dedup();
        Ok(sizes)
    }

    /// Returns all errors and warnings about the script, without drawing it.
    fn check(&self, py: Python<'_>) -> PyResult<Vec<Diagnostic>> {
        let text = self.whole();
        let result = self.parse(py, &text)?;
        Ok(result.diagnostics.into_iter().map(Diagnostic).collect())
    }
}

impl Script {
    fn material(
        &mut self,
        method: &Signature,
        args: &Bound<'_, PyTuple>,
        kwargs: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Material> {
        let given = Given::bind(method, args, kwargs)?;
        let Some(name) = &given.values[0] else { return Err(PyTypeError::new_err("material() lacks name")) };
        let place = Place { method: "material", parameter: "name" };
        let name = self.name_of(Subject::Defines(Names::Materials), name, place)?;
        let surface = surface_of("material", Some(name), given.clauses)?;
        let mut name = String::new();
        if let Some(file) = surface.given() {
            self.take(file, Place { method: "material", parameter: "image" })?;
        }
        let defined = self.materials.define("material", &surface, &mut name, &mut self.definitions);
        self.commit_definitions();
        self.is_open = true;
        defined.map(|()| Material(surface))
    }
}

/// Returns the words that make a mesh smooth.
///
/// # Errors
/// Fails if the value is no such angle.
fn smooth(angle: &Bound<'_, PyAny>, place: Place<'_>) -> PyResult<String> {
    let degrees: f64 = angle.extract().map_err(|_| {
        PyTypeError::new_err(format!("{place} takes a number of degrees, not {}", shown(angle)))
    })?;
    if !(0.0..=180.0).contains(&degrees) {
        return Err(PyValueError::new_err(format!("{place}={degrees}: the angle must be from 0 to 180")));
    }
    let mut words = " smooth ".to_owned();
    write_number(&mut words, degrees);
    Ok(words)
}

/// Returns the word for the alignment of the lines of a text: one of those that the command takes before `font`.
///
/// # Errors
/// Fails for another word.
fn align(value: &Bound<'_, PyAny>, form: &Form, place: Place<'_>) -> PyResult<String> {
    let words = aligns(form);
    let word = value.extract::<String>().ok().filter(|word| words.contains(&word.as_str()));
    let word = word.ok_or_else(|| {
        PyValueError::new_err(format!("{place} is one of {}, not {}", words.join(", "), shown(value)))
    })?;
    Ok(format!(" {word}"))
}

/// Returns whether a word is the only argument.
fn is_only(word: &str, args: &Bound<'_, PyTuple>, kwargs: Option<&Bound<'_, PyDict>>) -> bool {
    let is_word =
        |value: Bound<'_, PyAny>| value.extract::<String>().is_ok_and(|text| text.eq_ignore_ascii_case(word));
    args.len() == 1 && kwargs.is_none_or(|kwargs| kwargs.is_empty()) && args.get_item(0).is_ok_and(is_word)
}

fn names_of(method: &Signature) -> Vec<&str> {
    let names = method.parameters.iter().map(|parameter| parameter.name.as_str());
    names.chain(method.has_clauses().then_some("clauses of a material")).collect()
}

fn count(number: usize, noun: &str) -> String {
    if number == 1 { format!("1 {noun}") } else { format!("{number} {noun}s") }
}

/// Shows a warning in Python's way.
fn warn(py: Python<'_>, warning: SceneDiagnostic) -> PyResult<()> {
    let category = py.import("rayfold._errors")?.getattr("SceneWarning")?;
    let text = warning.render(false);
    py.import("warnings")?.call_method1("warn", (text, category, 3)).map(drop)
}
