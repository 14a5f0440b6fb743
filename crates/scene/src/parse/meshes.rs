//! Meshes: words in quotes, files, and the models in them.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use rayfold_assets::{AssetError, Closure, Model, Smoothing, file_name};

use super::doubts::{Looks, looks_in, looks_of};
use super::line::Statement;
use super::text::unquoted;
use super::visibility::Origin;
use super::{Parser, number, wording};
use crate::form::{Names as Kinds, Numbers};
use crate::limits::Limits;
use crate::model::{FLAT, Faults, Material, Mesh, Object, Source, mesh_surface};
use crate::row::Row;
use crate::script::Drawn;

/// The files that a script names, and the models of the current scene.
#[derive(Default)]
pub(super) struct Named {
    /// The names of the files, including those to which models refer. Each has its path in a model, if one refers to
    /// it.
    files: BTreeMap<String, Option<String>>,
    is_limit_told: bool,
    /// The models that the current scene draws.
    pub(super) models: Models,
}

impl Named {
    /// Returns the names in order.
    pub(super) fn into_files(self) -> Vec<String> {
        self.files.into_keys().collect()
    }
}

/// The drawn models, each once, and the number of triangles, counted as often as they are drawn.
#[derive(Clone, Default)]
pub(super) struct Models {
    of: Vec<Arc<Model>>,
    drawn: usize,
}

impl Models {
    /// Adds a model, drawn once.
    fn add(&mut self, model: &Arc<Model>) {
        self.drawn = self.drawn.saturating_add(model.triangle_count());
        if !self.of.iter().any(|known| Arc::ptr_eq(known, model)) {
            self.of.push(model.clone());
        }
    }

    /// Adds those of a group.
    pub(super) fn extend(&mut self, other: &Self) {
        let drawn = self.drawn;
        other.of.iter().for_each(|model| self.add(model));
        self.drawn = drawn.saturating_add(other.drawn);
    }

    /// Returns the number of triangles, counted as often as they are drawn.
    pub(super) fn drawn(&self) -> usize {
        self.drawn
    }

    fn triangles(&self) -> usize {
        self.of.iter().map(|model| model.triangle_count()).sum()
    }
}

/// The surface of a mesh, as its line gives it.
pub(super) enum Surface {
    OfFile,
    /// A named material; `None` if it has curves.
    Named(usize, Option<Material>),
    Numbers(Material),
    /// Numbers that are evaluated at each moment.
    Row(Row),
}

impl<'a> Parser<'a> {
    /// Draws the model of a file.
    pub(super) fn mesh(&mut self, s: &Statement<'a, '_>) {
        if self.group.is_none() {
            self.unseen.removable.get_or_insert_with(|| s.place());
        }
        let Some(subject) = s.subject.clone() else { return };
        let smoothing = self.smoothing(s);
        let name = self.file(s, subject.clone());
        let surface = self.mesh_surface(s, mesh_surface);
        let (Some(smoothing), Some(name), Some((surface, looks))) = (smoothing, name, surface) else {
            return;
        };
        let Some(model) = self.model(s, &subject, &name, smoothing) else { return };
        let mesh = Mesh::new(Source::File { name: name.into(), smoothing }, model, None);
        self.draw_mesh(s, mesh, surface, looks);
    }

    /// Draws triangles with a surface.
    pub(super) fn draw_mesh(
        &mut self,
        s: &Statement<'a, '_>,
        mesh: Mesh,
        surface: Surface,
        looks: Option<Looks>,
    ) {
        self.doubt_object(s, looks.unwrap_or_else(|| looks_of(mesh.material())));
        self.check_uv(s, looks.is_some_and(|looks| looks.needs_uv), Some(&mesh));
        if looks.is_some_and(|looks| looks.refracts)
            && let Some(subject) = &s.subject
        {
            self.doubt_glass_mesh(s, &mesh, subject);
        }
        self.add_mesh(s, mesh, surface);
    }

    /// Returns the surface and its looks. The looks are `None` if they are those of the file. If there is a fault,
    /// returns `None` and reports it.
    pub(super) fn mesh_surface(
        &mut self,
        s: &Statement<'a, '_>,
        reader: fn(&mut Numbers<'_>) -> Result<Material, Faults>,
    ) -> Option<(Surface, Option<Looks>)> {
        if let Some(span) = s.surface.clone() {
            let number = self.refer(Kinds::Materials, s.line, span)?;
            let info = self.materials.get(number).value.as_ref()?;
            let (still, looks) = (info.still.clone(), info.looks);
            if still.is_none() {
                self.see_material(number);
            }
            return Some((Surface::Named(number, still), Some(looks)));
        }
        let form = s.command.form();
        if form.is_bare(s.count()) {
            return Some((Surface::OfFile, None));
        }
        let is_moving = s.row.as_ref().is_some_and(|row| !row.is_constant());
        let material = if is_moving { None } else { Some(self.read(s, None, reader)?) };
        match (&s.row, material) {
            (None, Some(material)) => {
                let looks = looks_of(&material);
                Some((Surface::Numbers(material), Some(looks)))
            }
            (row, _) => {
                let row = row.clone().unwrap_or_else(|| s.still_row());
                if is_moving {
                    let spans = s.words.parameters().to_vec();
                    let moving = self.keep_moving(s.line, spans, Origin::Command(s.command), &row);
                    self.see_moving(moving);
                }
                let looks = looks_in(form, &row);
                let first = form.surface().unwrap_or_default();
                let row = Row::new(row.numbers().iter().skip(first).cloned().collect());
                Some((Surface::Row(row), Some(looks)))
            }
        }
    }

    fn add_mesh(&mut self, s: &Statement<'a, '_>, mesh: Mesh, surface: Surface) {
        let before = self.named.models.clone();
        match &mut self.group {
            Some(group) => group.models.add(mesh.model()),
            None => self.named.models.add(mesh.model()),
        }
        self.check_triangles(s, &before);
        self.count_drawn(s, 1, 0);
        if self.has_errors() {
            self.recorder.forget();
            return;
        }
        let (number, object) = match surface {
            Surface::OfFile => (None, Ok(Object::from(mesh))),
            Surface::Numbers(material) => (None, Ok(mesh.with_material(material).into())),
            Surface::Named(number, Some(material)) => (Some(number), Ok(mesh.with_material(material).into())),
            Surface::Named(number, None) => {
                let row = Row::new(Vec::new());
                (None, Err(Drawn::Mesh { mesh, surface: Some(number), row }))
            }
            Surface::Row(row) => (None, Err(Drawn::Mesh { mesh, surface: None, row })),
        };
        match (&mut self.group, object) {
            (Some(group), Ok(object)) => group.recorder.add_object(object, number),
            (Some(group), Err(drawn)) => group.recorder.add_drawn(drawn),
            (None, Ok(object)) => self.recorder.add_object(object, number),
            (None, Err(drawn)) => self.recorder.add_drawn(drawn),
        }
    }

    /// Reports models that exceed the limits together with the earlier ones.
    pub(super) fn check_triangles(&mut self, s: &Statement<'a, '_>, before: &Models) {
        let (was, is) = (before.triangles(), self.named.models.triangles());
        let limit = rayfold_assets::limits::TRIANGLES;
        self.check_limit(s, was, is, limit, "triangles in the models of a scene");
        let (was, is) = (before.drawn, self.named.models.drawn);
        self.check_limit(s, was, is, Limits::DRAWN_TRIANGLES, "triangles of models drawn in a scene");
    }

    /// Reads the words after the surface. If there is a fault, returns `None` and reports it.
    fn smoothing(&mut self, s: &Statement<'a, '_>) -> Option<Smoothing> {
        let mut words = s.options.iter();
        let text = |span: &Range<usize>| &s.text[span.clone()];
        let smoothing = match words.next() {
            None => Smoothing::OfFile,
            Some(word) if text(word).eq_ignore_ascii_case(FLAT) => Smoothing::Flat,
            Some(word) => {
                let Some(angle) = words.next() else {
                    self.report.error(s.line, word.end..word.end, wording::no_smooth_angle);
                    return None;
                };
                match number::parse(text(angle)) {
                    Ok(degrees) if (0.0..=180.0).contains(&degrees) => Smoothing::Within(degrees),
                    _ => {
                        self.report.error(s.line, angle.clone(), || wording::bad_smooth_angle(text(angle)));
                        return None;
                    }
                }
            }
        };
        if let Some(span) = words.next() {
            let rest = span.start..s.options.last().unwrap_or(span).end;
            self.report.error(s.line, rest, wording::too_many_mesh_options);
            return None;
        }
        Some(smoothing)
    }

    /// Returns the name of a file in quotes. If there is a fault, returns `None` and reports it.
    pub(super) fn file(&mut self, s: &Statement<'a, '_>, span: Range<usize>) -> Option<String> {
        let name = self.quoted(s, span.clone())?;
        if let Err(fault) = file_name(&name) {
            self.report.error(s.line, span, || wording::no_file_name(fault));
            return None;
        }
        self.name_file(s, &span, &name, None).then_some(name)
    }

    /// Returns the text of a word in quotes. If there is a fault, returns `None` and reports it.
    pub(super) fn quoted(&mut self, s: &Statement<'a, '_>, span: Range<usize>) -> Option<String> {
        match unquoted(&s.text[span.clone()]) {
            Ok(text) => Some(text),
            Err(fault) => {
                self.report.error(s.line, span, || wording::malformed_quote(fault));
                None
            }
        }
    }

    /// Records that the file of a name is missing, so that a caller can wait for it.
    pub(super) fn note_absent(&mut self, error: &AssetError) {
        if let AssetError::Absent { name, .. } = error {
            self.named.files.entry(name.clone()).or_default();
        }
    }

    /// Records a file that the script names. `path` is its path in a model that refers to it. Returns whether the file
    /// can be used.
    fn name_file(
        &mut self,
        s: &Statement<'a, '_>,
        span: &Range<usize>,
        name: &str,
        path: Option<&str>,
    ) -> bool {
        if let Some(known) = self.named.files.get_mut(name) {
            match (&known, path) {
                (Some(other), Some(path)) if other != path => {
                    let other = other.clone();
                    self.report.error(s.line, span.clone(), || wording::two_paths(&other, path));
                    return false;
                }
                (None, Some(path)) => *known = Some(path.into()),
                (Some(_) | None, _) => {}
            }
            return true;
        }
        self.named.files.insert(name.into(), path.map(Into::into));
        let limit = rayfold_assets::limits::FILES;
        let count = self.named.files.len();
        if count > limit && !std::mem::replace(&mut self.named.is_limit_told, true) {
            self.report.error(s.line, span.clone(), || {
                wording::beyond_limit(1, count, limit, "files that a script names")
            });
            return false;
        }
        count <= limit
    }

    /// Returns the model in a file. If there is none, returns `None` and reports that.
    fn model(
        &mut self,
        s: &Statement<'a, '_>,
        span: &Range<usize>,
        name: &str,
        smoothing: Smoothing,
    ) -> Option<Arc<Model>> {
        let model = match self.library.model(name, smoothing) {
            Ok(model) => model,
            Err(error) => {
                self.note_absent(&error);
                // A changed file that it refers to may mend it.
                for (name, _) in self.library.sources(name) {
                    self.named.files.entry(name).or_default();
                }
                self.report.error(s.line, span.clone(), || wording::unusable_file(&error));
                return None;
            }
        };
        for warning in model.warnings() {
            self.report.warning(s.line, span.clone(), || wording::model_doubt(name, warning));
        }
        let sources = self.library.sources(name);
        let is_good = sources
            .iter()
            .skip(1)
            .fold(true, |is_good, (name, path)| self.name_file(s, span, name, Some(path)) && is_good);
        is_good.then_some(model)
    }

    /// Warns of glass that consists of panes, because the model is not closed.
    fn doubt_glass_mesh(&mut self, s: &Statement<'a, '_>, mesh: &Mesh, span: &Range<usize>) {
        let closure = mesh.model().closure();
        if *closure != Closure::Closed {
            let what = match mesh.source() {
                Source::File { name, .. } => format!("`{name}`"),
                Source::Text(_) => "the text without depth".to_string(),
            };
            self.report.warning(s.line, span.clone(), || wording::open_glass(&what, closure));
        }
    }
}
