//! Changes of the file that is shown.

use glam::{DVec2, DVec3};
use rayfold_scene::{Command, quoted_word};

use super::Session;
use crate::document::Splice;
use crate::edits;
use crate::groups;
use crate::line::Line;
use crate::materials;
use crate::names;
use crate::project::Project;
use crate::protocol::ServerMessage;
use crate::tables::{Role, by_title, role};
use crate::view::Projection;

/// The notice for a mesh where there is no model.
const NO_PICTURE: &str = "There is no picture (.hdr, .exr, .png, .jpg, .webp) beside the script.";
const NO_MODEL: &str = "There is no model (.obj, .ply, .stl, .glb, .gltf) beside the script.";

/// The number of frames of a new animation.
const FRAMES: u32 = 50;

/// Returns the gesture with this number of the page. It differs from all gestures of the pointer.
pub(super) fn of_page(number: u64) -> u64 {
    number << 1 | 1
}

impl Session {
    /// Changes the shown file, as one step.
    pub(super) fn edit(
        &mut self,
        project: &mut Project,
        splices: Vec<Splice>,
        gesture: Option<u64>,
        tell: &mut ServerMessage,
    ) {
        let file = self.place(project).file;
        let lines = project.files[file].document.lines();
        let is_new =
            |splice: &Splice| lines.get(splice.at..splice.at + splice.removed) != Some(&splice.inserted[..]);
        let splices: Vec<_> = splices.into_iter().filter(is_new).collect();
        if splices.is_empty() {
            return;
        }
        // Several splices are one step even without a gesture.
        let gesture = gesture.unwrap_or_else(|| self.next_gesture());
        let done = project.files[file].apply(splices, Some(gesture));
        self.keep_file(project);
        self.send_splices(done, tell);
    }

    /// Takes back the changes of a gesture of the page, or of what the pointer holds.
    pub(super) fn give_up(&mut self, project: &mut Project, gesture: Option<u64>, tell: &mut ServerMessage) {
        let held = self.held.take().is_some();
        let gesture = gesture.map(of_page).or(held.then_some(self.gestures << 1));
        let file = self.place(project).file;
        let splices = gesture.map(|gesture| project.files[file].give_up(gesture)).unwrap_or_default();
        self.keep_file(project);
        self.send_splices(splices, tell);
        tell.guides = Some(String::new());
    }

    /// Returns a new gesture. Those of the pointer are even.
    pub(super) fn next_gesture(&mut self) -> u64 {
        self.gestures += 1;
        self.gestures << 1
    }

    pub(super) fn add(
        &mut self,
        project: &mut Project,
        name: &str,
        at: Option<DVec2>,
        tell: &mut ServerMessage,
    ) {
        let Some(command) = by_title(name) else { return };
        let (_, subject) = name.split_once(' ').unwrap_or((name, ""));
        match role(command) {
            Role::Object if command == Command::Mesh => {
                self.add_mesh(project, tell);
                return;
            }
            Role::Object | Role::Light => {}
            Role::Use if names::is_name(subject) => {}
            Role::Camera => {
                self.aim(project, at);
                self.keep_camera(project, None, tell);
                return;
            }
            Role::Setting if !command.form().fields.is_empty() => {
                self.add_setting(project, command, tell);
                return;
            }
            Role::Material => {
                let (splices, place) = materials::new(self.file_lines(project), &self.selection);
                self.edit(project, splices, None, tell);
                self.select(project, vec![place]);
                return;
            }
            Role::Use | Role::Group | Role::Setting => return,
        }
        let shown = self.shown(project);
        let source_map = &shown.source_map;
        let (mut ground, mut size) = (DVec3::ZERO, 1.0);
        if let Some(scene) = self.scene(project) {
            let projection = Projection::new(&scene);
            let (width, height) = (f64::from(scene.screen.width()), f64::from(scene.screen.height()));
            let dropped = at.is_some();
            let at = at.unwrap_or(DVec2::new(0.5 * width, 0.6 * height));
            let bounds = self.bounds(project);
            let (origin, direction) = projection.ray(at);
            let below = bounds.low.y.min(0.0);
            let distance = (below - origin.y) / direction.y;
            let hit = self.pick(project, at.x, at.y).map(|(_, point)| point);
            let is_endless = command == Command::Plane;
            let on_ground = || {
                let near =
                    distance > 0.0 && distance < 20.0 * bounds.radius() + origin.distance(bounds.center());
                near.then_some(origin + distance * direction)
            };
            let hit = hit.filter(|_| dropped);
            ground = hit.or_else(on_ground).unwrap_or(bounds.center());
            size = projection.pixel_at(ground) * height * 0.07;
            let step = 10f64.powi(size.log10().floor() as i32);
            size = (size / step).round() * step;
            if is_endless {
                ground = DVec3::ZERO;
            } else if !dropped {
                ground = edits::free_place(&scene.objects, ground, size);
            }
        }
        if !(size.is_normal() && ground.is_finite()) {
            (ground, size) = (DVec3::ZERO, 1.0);
        }
        let count = source_map.objects.len() + source_map.lights.len();
        let line = if command == Command::Use {
            groups::use_line(subject, ground)
        } else {
            edits::new_line(command, ground, size, count)
        };
        let (splices, place) = edits::add(self.file_lines(project), source_map, line);
        self.edit(project, splices, None, tell);
        self.select(project, vec![place]);
        self.outline(project, tell);
    }

    /// Adds a mesh of the first model beside the script.
    fn add_mesh(&mut self, project: &mut Project, tell: &mut ServerMessage) {
        let shown = self.shown(project);
        let file = self.place(project).file;
        let Some(model) = project.files.get(file).and_then(|file| file.models().into_iter().next()) else {
            tell.notice = Some(NO_MODEL.into());
            return;
        };
        let line = Line::new(&format!("{} {}", Command::Mesh.name(), quoted_word(&model)));
        let (splices, place) = edits::add(self.file_lines(project), &shown.source_map, line);
        self.edit(project, splices, None, tell);
        self.select(project, vec![place]);
        self.outline(project, tell);
    }

    /// Adds the line of a setting, unless the frame has one.
    fn add_setting(&mut self, project: &mut Project, command: Command, tell: &mut ServerMessage) {
        let shown = self.shown(project);
        let source_map = &shown.source_map;
        let splices = match command {
            _ if source_map.setting(command).is_some() => return,
            Command::SkyPicture => {
                let file = self.place(project).file;
                let Some(picture) =
                    project.files.get(file).and_then(|file| file.pictures().into_iter().next())
                else {
                    tell.notice = Some(NO_PICTURE.into());
                    return;
                };
                let line = Line::new(&format!("{} {}", command.name(), quoted_word(&picture)));
                vec![Splice { at: source_map.start(), removed: 0, inserted: vec![line] }]
            }
            Command::Frames => edits::set_frames(self.file_lines(project), source_map, FRAMES),
            _ => vec![Splice {
                at: source_map.start(),
                removed: 0,
                inserted: vec![edits::new_setting(command)],
            }],
        };
        self.edit(project, splices, None, tell);
    }

    /// Makes a group of lines and selects it.
    pub(super) fn group(&mut self, project: &mut Project, lines: &[usize], tell: &mut ServerMessage) {
        let shown = self.shown(project);
        let Some(scene) = self.sound_scene(project) else { return };
        match groups::group(self.file_lines(project), &shown.source_map, &scene, lines) {
            Ok((splices, place)) => {
                self.edit(project, splices, None, tell);
                self.select(project, vec![place]);
                self.outline(project, tell);
            }
            Err(refusal) => tell.notice = Some(refusal.message().into()),
        }
    }

    /// Takes a group apart and selects its lines.
    pub(super) fn ungroup(&mut self, project: &mut Project, line: usize, tell: &mut ServerMessage) {
        match groups::ungroup(self.file_lines(project), line) {
            Ok((splices, place)) => {
                self.edit(project, splices, None, tell);
                self.select(project, place.collect());
                self.outline(project, tell);
            }
            Err(refusal) => tell.notice = Some(refusal.message().into()),
        }
    }

    /// Returns whether a line cannot be dragged in the picture.
    pub(super) fn is_locked(&self, project: &Project, line: usize) -> bool {
        self.locked.contains(&(self.place(project).file, line))
    }

    /// Returns the lines of the shown file that cannot be dragged.
    pub(super) fn locked_lines(&self, project: &Project) -> Vec<usize> {
        let file = self.place(project).file;
        self.locked.iter().filter(|(of, _)| *of == file).map(|(_, line)| *line).collect()
    }

    /// Locks lines, or unlocks them if all of them are locked.
    pub(super) fn lock(&mut self, project: &Project, lines: &[usize]) {
        let file = self.place(project).file;
        let is_locked = |session: &Self, line: usize| session.locked.contains(&(file, line));
        if lines.iter().all(|&line| is_locked(self, line)) {
            self.locked.retain(|(of, line)| *of != file || !lines.contains(line));
            return;
        }
        let count = self.file_lines(project).len();
        for &line in lines.iter().filter(|&&line| line < count) {
            if !is_locked(self, line) {
                self.locked.push((file, line));
            }
        }
    }
}
