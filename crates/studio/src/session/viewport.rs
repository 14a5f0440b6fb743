//! The viewport: its scene, the object under a point of it, and its camera.

use std::collections::HashSet;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use rayfold_scene::{Command, Pinhole, Scene};

use super::{Change, Session};
use crate::document::Splice;
use crate::edits;
use crate::extent;
use crate::line::Line;
use crate::project::Project;
use crate::protocol::{Navigation, ServerMessage, ViewPreset};
use crate::silhouette::View;
use crate::view::{Bounds, Orbit, Projection};
use crate::wanted::{Motion, ViewSettings};

/// The number of grid lines in each direction from the middle.
const GRID: i32 = 10;

/// The depth of the drawn camera, in radii of the scene.
const FRUSTUM: f64 = 0.4;

/// The number of pieces of the whole horizon.
const HORIZON: i32 = 72;

/// The distance of the horizon from the middle of the grid, in widths of the grid.
const FAR: f64 = 1e6;

/// A point at least this many pixels away is not in the picture.
const BEYOND: f64 = 1e5;

impl Session {
    /// Returns the scene in the viewport.
    pub(super) fn scene(&self, project: &Project) -> Option<Scene> {
        self.view().of(self.shown(project).scene.clone()?)
    }

    /// Returns the view of the viewport.
    pub(super) fn view(&self) -> ViewSettings {
        ViewSettings { size: self.size, free: self.free, is_draft: self.is_draft }
    }

    /// Returns the motion of the scene while its shutter is open.
    pub(super) fn motion(&self, project: &Project, scene: &Scene) -> Option<Motion> {
        let place = self.place(project);
        let script = project.files[place.file].script.as_ref().filter(|_| scene.shutter.open() > 0.0)?;
        Some(Motion { script: Arc::clone(script), frame: place.frame, is_free: self.free.is_some() })
    }

    /// Returns the scene if its objects are those of the lines.
    pub(super) fn sound_scene(&self, project: &Project) -> Option<Scene> {
        let is_sound = project.files[self.place(project).file].is_sound();
        let count = self.shown(project).source_map.object_count();
        self.scene(project).filter(|scene| is_sound && scene.objects.len() == count)
    }

    pub(super) fn bounds(&self, project: &Project) -> Bounds {
        let shown = self.shown(project);
        let lamps = || {
            let lines = self.file_lines(project);
            let lights = shown.source_map.lights.iter().filter_map(|&line| lines.get(line));
            edits::places(lights.collect::<Vec<_>>(), shown.time)
        };
        shown.bounds().or_else(lamps).unwrap_or(Bounds { low: DVec3::splat(-1.0), high: DVec3::splat(1.0) })
    }

    /// Returns the bounds of the selection.
    fn selected_bounds(&self, project: &Project) -> Option<Bounds> {
        let (shown, chosen) = (self.shown(project), self.chosen());
        let objects = self.sound_scene(project).and_then(|scene| {
            let own =
                scene.objects.iter().enumerate().filter(|(at, _)| {
                    shown.source_map.line_of(*at).is_some_and(|line| chosen.contains(&line))
                });
            extent::bounds(own.map(|(_, object)| object))
        });
        let lights = shown.source_map.lights.iter().filter(|line| chosen.contains(*line));
        let lights = lights.filter_map(|&line| self.line(project, line));
        objects.or_else(|| edits::places(lights.collect::<Vec<_>>(), shown.time))
    }

    /// Returns the radius of the objects that a `Use` draws, which is not in its numbers.
    pub(super) fn drawn_size(&self, project: &Project, line: usize) -> Option<f64> {
        self.line(project, line).filter(|line| line.command() == Some(Command::Use))?;
        let (shown, scene) = (self.shown(project), self.sound_scene(project)?);
        let own = scene.objects.iter().enumerate();
        let own = own.filter(|(at, _)| shown.source_map.line_of(*at) == Some(line));
        extent::bounds(own.map(|(_, object)| object)).map(|bounds| bounds.radius())
    }

    /// Returns whether a line draws a single object without an end, such as a floor.
    pub(super) fn is_endless(&self, project: &Project, line: usize) -> bool {
        let (shown, scene) = (self.shown(project), self.sound_scene(project));
        let objects = scene.iter().flat_map(|scene| scene.objects.iter().enumerate());
        let mut own = objects.filter(|(at, _)| shown.source_map.line_of(*at) == Some(line));
        own.any(|(_, object)| extent::bounds([object]).is_none())
    }

    /// Returns the selected lines as a set.
    pub(super) fn chosen(&self) -> HashSet<usize> {
        self.selection.iter().copied().collect()
    }

    /// Returns the point where lights without a position are shown.
    pub(super) fn around(&self, project: &Project) -> DVec3 {
        self.free.map_or_else(|| self.bounds(project).center(), |orbit| orbit.target)
    }

    /// Returns the extent of a pixel in the middle of the scene, as a power of ten.
    pub(super) fn step(&self, project: &Project) -> f64 {
        let pixel = self.scene(project).map(|scene| Projection::new(&scene).pixel_at(self.around(project)));
        let pixel = pixel.filter(|pixel| pixel.is_normal()).unwrap_or(0.01);
        10f64.powi(pixel.log10().floor().clamp(-12.0, 12.0) as i32)
    }

    /// Returns the line of the object under a point of the picture, and the point that was hit.
    pub(super) fn pick(&self, project: &Project, x: f64, y: f64) -> Option<(usize, DVec3)> {
        let shown = self.shown(project);
        let scene = self.sound_scene(project)?;
        let (column, row) = (x.floor(), y.floor());
        let inside = (0.0..f64::from(scene.screen.width())).contains(&column)
            && (0.0..f64::from(scene.screen.height())).contains(&row);
        let view = View { scene: &scene, boxes: shown.boxes() };
        let found = if inside { view.pick(column, row).ok().flatten()? } else { return None };
        let (origin, direction) = Projection::new(&scene).ray(DVec2::new(column + 0.5, row + 0.5));
        let line = shown.source_map.line_of(found.object)?;
        (!self.is_locked(project, line)).then(|| (line, origin + found.distance * direction))
    }

    /// Returns the lines that are drawn and have an end, each with its box.
    pub(super) fn boxes(&self, project: &Project, is_in: impl Fn(usize) -> bool) -> Vec<(usize, Bounds)> {
        let (shown, Some(scene)) = (self.shown(project), self.sound_scene(project)) else {
            return Vec::new();
        };
        let mut boxes: Vec<(usize, Bounds)> = Vec::new();
        for (at, object) in scene.objects.iter().enumerate() {
            let (Some(line), Some(bounds)) = (shown.source_map.line_of(at), extent::bounds([object])) else {
                continue;
            };
            match boxes.last_mut() {
                Some((last, all)) if *last == line => *all = all.with(bounds),
                _ if is_in(line) => boxes.push((line, bounds)),
                _ => {}
            }
        }
        boxes
    }

    /// Selects the objects whose middles are in a rectangle, besides those that are selected if `extend`.
    pub(super) fn select_box(&mut self, project: &Project, from: DVec2, to: DVec2, extend: bool) {
        let Some(scene) = self.scene(project) else { return };
        let (low, high) = (from.min(to), from.max(to));
        let projection = Projection::new(&scene);
        let is_inside = |at: DVec2| at.cmpge(low).all() && at.cmple(high).all();
        let found = self.boxes(project, |line| !self.is_locked(project, line));
        let found = found.into_iter().filter(|(_, of)| projection.point(of.center()).is_some_and(is_inside));
        let mut lines = if extend { self.selection.clone() } else { Vec::new() };
        lines.extend(found.map(|(line, _)| line));
        self.select(project, lines);
    }

    /// Returns the outline of the objects of some lines.
    fn outline_of(&self, project: &Project, is_in: impl Fn(usize) -> bool) -> Option<String> {
        let shown = self.shown(project);
        if !shown.source_map.objects.iter().any(|&line| is_in(line)) {
            return None;
        }
        let scene = self.sound_scene(project)?;
        let view = View { scene: &scene, boxes: shown.boxes() };
        view.outline(|object| shown.source_map.line_of(object).is_some_and(&is_in)).ok()
    }

    /// Adds the line under the pointer to the reply, and its outline if that has changed.
    pub(super) fn hover(&mut self, project: &Project, x: f64, y: f64, tell: &mut ServerMessage) {
        let line = self.pick(project, x, y).map(|(line, _)| line);
        tell.hovered = Some(line);
        if line != self.hovered {
            self.hovered = line;
            let path = line.filter(|line| !self.selection.contains(line));
            let path = path.and_then(|line| self.outline_of(project, |other| other == line));
            tell.hover_outline = Some(path.unwrap_or_default());
        }
    }

    pub(super) fn outline(&self, project: &Project, tell: &mut ServerMessage) {
        let chosen = self.chosen();
        let path = self.outline_of(project, |line| chosen.contains(&line));
        tell.outline = Some(path.unwrap_or_default());
        tell.ghosts = Some(self.ghosts(project));
    }

    pub(super) fn navigate(&mut self, project: &Project, how: Navigation, moved: DVec2) {
        if !moved.is_finite() {
            return;
        }
        let bounds = self.bounds(project);
        let Some(mut orbit) = self.free.or_else(|| self.orbit(project)) else { return };
        match how {
            Navigation::Turn => orbit.turn(moved),
            Navigation::Pan => orbit.pan(moved),
            Navigation::Zoom => orbit.zoom(moved.y.clamp(-2.0, 2.0).exp(), bounds.radius()),
        }
        self.free = Some(orbit);
    }

    /// Returns the free camera, or one at the current view.
    pub(super) fn orbit(&self, project: &Project) -> Option<Orbit> {
        let scene = self.scene(project)?;
        Some(self.free.unwrap_or_else(|| Orbit::from_camera(&scene.camera, self.bounds(project))))
    }

    pub(super) fn look(&mut self, project: &Project, at: ViewPreset) {
        let bounds = self.bounds(project);
        let quarter = std::f64::consts::FRAC_PI_2;
        self.free = match at {
            ViewPreset::Script => None,
            ViewPreset::Free => self.orbit(project),
            ViewPreset::Front => Some(Orbit::at(bounds, 0.0, 0.0)),
            ViewPreset::Side => Some(Orbit::at(bounds, quarter, 0.0)),
            ViewPreset::Top => Some(Orbit::at(bounds, 0.0, quarter)),
            ViewPreset::Opposite => self.orbit(project).map(Orbit::opposite),
            ViewPreset::Selection => {
                let what = self.selected_bounds(project).unwrap_or(bounds);
                let from = self.orbit(project);
                from.map(|from| Orbit { half_fov: from.half_fov, ..Orbit::at(what, from.yaw, from.pitch) })
            }
        };
    }

    /// Turns the camera to the object under a point, if there is one.
    pub(super) fn aim(&mut self, project: &Project, at: Option<DVec2>) {
        let target = at.and_then(|at| self.pick(project, at.x, at.y)).map(|(_, point)| point);
        self.free = self.orbit(project).map(|orbit| match target {
            Some(target) => orbit.aimed(target),
            None => orbit,
        });
    }

    /// Writes the view into the script as its camera, of this kind or of the present one.
    pub(super) fn keep_camera(
        &mut self,
        project: &mut Project,
        kind: Option<Command>,
        tell: &mut ServerMessage,
    ) -> Change {
        let shown = self.shown(project);
        let (Some(scene), Some(orbit)) = (&shown.scene, self.orbit(project)) else { return Change::Nothing };
        let aspect = f64::from(scene.screen.width()) / f64::from(scene.screen.height());
        let lines = self.file_lines(project);
        let old = shown.source_map.camera;
        let had = old.and_then(|at| lines[at].command()).filter(|&command| command != Command::Orthocamera);
        let kind = kind.or(had).unwrap_or(Command::Camera);
        let numbers = match (kind, orbit.camera(aspect)) {
            (Command::Orthocamera, _) => Vec::new(),
            (Command::Look, _) => look_numbers(&orbit, self.step(project)),
            (_, Ok(camera)) => camera_numbers(&camera, self.step(project)),
            (_, Err(_)) => return Change::Nothing,
        };
        let splice = match old.filter(|&at| lines[at].command() == Some(kind)) {
            Some(at) => lines[at].with_numbers(0, &numbers).map(|line| edits::set(at, line)),
            None => {
                let name = old.and_then(|at| lines[at].name()).unwrap_or_default();
                let line =
                    Line::new(kind.name()).with_numbers(0, &numbers).and_then(|line| line.named(&name));
                let at = old.unwrap_or_else(|| shown.source_map.start());
                let removed = usize::from(old.is_some());
                line.map(|line| Splice { at, removed, inserted: vec![line] })
            }
        };
        self.edit(project, splice.into_iter().collect(), None, tell);
        self.free = None;
        Change::Still
    }
}

/// Returns the scene of another frame with the current camera and screen.
pub(super) fn picture_of(scene: Scene, now: &Scene) -> Scene {
    Scene { screen: now.screen, camera: now.camera, ..scene }
}

/// Returns the number of decimals of a position that a pixel of this size shows.
fn decimals(step: f64) -> usize {
    (-step.log10()).ceil().clamp(0.0, 12.0) as usize
}

fn round(x: f64, decimals: usize) -> f64 {
    format!("{x:.decimals$}").parse().unwrap_or(x)
}

/// Returns the numbers of `Look` without its `up`, rounded to a visible precision.
fn look_numbers(orbit: &Orbit, step: f64) -> Vec<f64> {
    let places = decimals(step);
    let positions = [orbit.eye(), orbit.target].into_iter().flat_map(|at| at.to_array());
    positions.map(|x| round(x, places)).chain([round(2.0 * orbit.half_fov.to_degrees(), 2)]).collect()
}

/// Returns the numbers of `Camera`, rounded to a visible precision.
fn camera_numbers(camera: &Pinhole, step: f64) -> Vec<f64> {
    let places = decimals(step);
    let mut numbers: Vec<f64> = camera.eye().to_array().map(|x| round(x, places)).into();
    for direction in [camera.gaze(), camera.up()] {
        numbers.extend(direction.to_array().map(|x| round(x, 5)));
    }
    numbers.push(camera.distance());
    for corner in [camera.lower_left(), camera.upper_right()] {
        numbers.extend(corner.to_array().map(|x| round(x, 5)));
    }
    numbers
}

/// Returns grid lines on the height 0 around a scene, and the horizon.
pub(super) fn grid_path(projection: &Projection, bounds: Bounds) -> String {
    let step = 10f64.powf((bounds.radius() / 4.0).log10().round());
    let reach = step * f64::from(GRID);
    let middle = (bounds.center() / step).round() * step;
    let at = |x: f64, z: f64| projection.point(DVec3::new(middle.x + x, 0.0, middle.z + z));
    let mut path = String::new();
    for line in -GRID..=GRID {
        let off = step * f64::from(line);
        for flip in [false, true] {
            // In pieces: one that reaches behind the eye is left out.
            for piece in -GRID..GRID {
                let (from, to) = (step * f64::from(piece), step * f64::from(piece + 1));
                let ends = if flip { (at(off, from), at(off, to)) } else { (at(from, off), at(to, off)) };
                if let ((Some(a), Some(b)), true) = (ends, reach.is_finite()) {
                    path.push_str(&segment_path(a, b));
                }
            }
        }
    }
    for turn in 0..HORIZON {
        let far = |turn: i32| {
            let (sin, cos) = (f64::from(turn) / f64::from(HORIZON) * std::f64::consts::TAU).sin_cos();
            at(FAR * reach * cos, FAR * reach * sin).filter(|seen| seen.abs().max_element() < BEYOND)
        };
        if let (Some(a), Some(b)) = (far(turn), far(turn + 1)) {
            path.push_str(&segment_path(a, b));
        }
    }
    path
}

/// Returns a straight line between two points of the picture as an SVG path.
fn segment_path(from: DVec2, to: DVec2) -> String {
    format!("M{:.1} {:.1}L{:.1} {:.1}", from.x, from.y, to.x, to.y)
}

/// Returns the lines between pairs of points in the world, as an SVG path.
pub(super) fn lines_path(projection: &Projection, guides: &[[DVec3; 2]]) -> String {
    let segment =
        |[from, to]: &[DVec3; 2]| Some(segment_path(projection.point(*from)?, projection.point(*to)?));
    guides.iter().filter_map(segment).collect()
}

/// Returns the edges of the volume that a scene's camera sees, from its eye.
pub(super) fn frustum_path(projection: &Projection, scene: &Scene, bounds: Bounds) -> String {
    let (width, height) = (f64::from(scene.screen.width()), f64::from(scene.screen.height()));
    let own = Projection::new(scene);
    let (_, _, back) = own.axes();
    let reach = FRUSTUM * bounds.radius();
    let corners = [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)].map(|(x, y)| {
        let (eye, way) = own.ray(DVec2::new(x, y));
        (eye, eye + way * (reach / way.dot(-back)))
    });
    let mut path = String::new();
    let mut line = |from: DVec3, to: DVec3| path.push_str(&lines_path(projection, &[[from, to]]));
    for (at, (eye, corner)) in corners.into_iter().enumerate() {
        line(eye, corner);
        line(corner, corners[(at + 1) % corners.len()].1);
    }
    path
}
