//! A page at work: what it looks at, what it has selected and what it drags; each of its wishes becomes changes of the
//! project and what it is told of them.
//!
//! Knows no socket and no thread: wishes come in, values go out, so that tests need neither.

mod loading;

use glam::{DVec2, DVec3};
use rayfold_scene::{Camera, Command, Pinhole, Scene, Screen};

use crate::document::Splice;
use crate::edits;
use crate::examples;
use crate::handles::{Drag, Grip, Manner, Values, handles};
use crate::line::Line;
use crate::pictures::Wanted;
use crate::project::{Place, Project};
use crate::protocol::{
    Ask, FaultState, FileState, Inspected, LineState, LinesChanged, Navigation, Standpoint, State, Tell,
};
use crate::silhouette;
use crate::stage::Stage;
use crate::tables::{Role, commands, fields, role};
use crate::view::{Bounds, Orbit, Projection};

/// Pixels of a picture, at most.
const PIXELS: u64 = 8 << 20;

/// Bytes of a text that the page sends for a line.
const TEXT: usize = 1 << 20;

/// Lines of the grid in each direction from the middle.
const GRID: i32 = 10;

/// What the pointer holds.
#[derive(Debug)]
enum Held {
    /// Lines.
    Drag(Drag, DVec2),
    /// The free camera; where the pointer was last.
    Turn(DVec2),
}

/// A page at work.
#[derive(Debug)]
pub(crate) struct Session {
    size: (u32, u32),
    frame: usize,
    /// The free camera, if one looks through it.
    free: Option<Orbit>,
    selection: Vec<usize>,
    held: Option<Held>,
    /// How many wishes were heard.
    asked: u32,
    gestures: u64,
    /// The line that is being typed in, and its gesture.
    typing: Option<(usize, u64)>,
    pictures: u32,
    /// What the page was told last.
    files: Vec<FileState>,
    shown_file: usize,
    /// What the server is to do about the GIF.
    output: Option<Output>,
}

/// What the server is to do about the GIF.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Output {
    /// Begin.
    Render,
    /// Stop.
    Cancel,
}

/// What follows from a wish.
#[derive(Debug, Default)]
pub(crate) struct Answer {
    /// What the page is told.
    pub(crate) tell: Tell,
    /// The picture that it gets.
    pub(crate) picture: Option<Wanted>,
    /// The page has shown a picture.
    pub(crate) shown: bool,
    /// What to do about the GIF.
    pub(crate) output: Option<Output>,
}

/// What a wish has changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Change {
    Nothing,
    /// The picture changes and soon will again.
    Moving,
    /// The picture changes.
    Still,
}

impl Session {
    /// A page that has just opened, and what it is told first.
    pub(crate) fn open(project: &Project) -> (Self, Answer) {
        let mut session = Self {
            size: (960, 540),
            frame: 0,
            free: None,
            selection: Vec::new(),
            held: None,
            asked: 0,
            gestures: 0,
            typing: None,
            pictures: 0,
            files: Vec::new(),
            shown_file: 0,
            output: None,
        };
        let tell = Tell {
            tables: Some(commands()),
            examples: Some(examples::names()),
            can_create: Some(project.can_create()),
            lines: Some(session.lines(project)),
            notice: None,
            ..Tell::default()
        };
        let answer = session.answer(project, tell, Change::Nothing);
        (session, answer)
    }

    /// Does what the page asks for.
    pub(crate) fn ask(&mut self, project: &mut Project, ask: Ask) -> Answer {
        self.asked = self.asked.wrapping_add(1);
        let mut tell = Tell::default();
        let change = self.run(project, ask, &mut tell);
        match change {
            None => Answer { shown: true, ..Answer::default() },
            Some(change) => {
                let output = self.output.take();
                Answer { output, ..self.answer(project, tell, change) }
            }
        }
    }

    /// Looks whether others have written the file that is shown, and writes what has rested.
    pub(crate) fn tick(&mut self, project: &mut Project) -> Option<Answer> {
        let saved = project.save(false);
        let place = self.place(project);
        let looked = if self.held.is_none() { project.files[place.file].look() } else { None };
        if looked.is_none() && !saved {
            return None;
        }
        let mut tell = Tell::default();
        let change = match looked {
            Some(splices) if !splices.is_empty() => {
                tell.notice = Some(format!("{} was changed on the disk", project.files[place.file].name));
                self.told(splices, &mut tell);
                Change::Still
            }
            _ => Change::Nothing,
        };
        Some(self.answer(project, tell, change))
    }

    /// `None` where there is nothing to tell.
    fn run(&mut self, project: &mut Project, ask: Ask, tell: &mut Tell) -> Option<Change> {
        if !matches!(ask, Ask::Shown | Ask::Size { .. } | Ask::Hover { .. } | Ask::Text { .. }) {
            self.typing = None;
        }
        Some(match ask {
            Ask::Shown => return None,
            Ask::Size { width, height } => {
                self.size = (width.max(1), height.max(1));
                Change::Still
            }
            Ask::Frame { frame, moving } => {
                self.show(project, frame, tell);
                if moving { Change::Moving } else { Change::Still }
            }
            Ask::Select { lines } => {
                self.select(project, lines);
                self.outline(project, tell);
                Change::Nothing
            }
            Ask::Hover { x, y } => {
                tell.hovered = Some(self.pick(project, x, y).map(|(line, _)| line));
                Change::Nothing
            }
            Ask::Press { x, y, extend, grip, line } => {
                self.press(project, DVec2::new(x, y), extend, grip.zip(line));
                self.outline(project, tell);
                Change::Nothing
            }
            Ask::Drag { x, y, manner } => self.drag(project, DVec2::new(x, y), manner, tell),
            Ask::Release => {
                self.held = None;
                self.outline(project, tell);
                Change::Still
            }
            Ask::Navigate { how, x, y } => {
                self.navigate(project, how, DVec2::new(x, y));
                tell.outline = Some(String::new());
                Change::Moving
            }
            Ask::Look { at } => {
                self.look(project, at);
                self.outline(project, tell);
                Change::Still
            }
            Ask::KeepCamera => self.keep_camera(project, tell),
            Ask::Set { line, first, values, gesture } => {
                let to = self.line(project, line).and_then(|line| whole(line, first, &values));
                let is_fit = values.iter().all(|value| value.is_finite()) && first + values.len() <= 64;
                match to {
                    // The page's own gestures and the pointer's are not to meet.
                    Some(to) if is_fit => {
                        self.edit(project, vec![edits::set(line, to)], gesture.map(|g| g << 1 | 1), tell);
                        if gesture.is_some() { Change::Moving } else { Change::Still }
                    }
                    _ => Change::Nothing,
                }
            }
            Ask::Text { line, text } => {
                let old = self.line(project, line).cloned().unwrap_or_default();
                if text.len() <= TEXT && old.text() != text {
                    let mut inserted: Vec<_> = text.split('\n').map(Line::new).collect();
                    if let Some(last) = inserted.pop() {
                        inserted.push(last.with_end(old.end()));
                    }
                    let removed = usize::from(self.line(project, line).is_some());
                    let gesture = match self.typing {
                        Some((typed, gesture)) if typed == line && inserted.len() == 1 => gesture,
                        _ => self.next_gesture(),
                    };
                    self.typing = (inserted.len() == 1).then_some((line, gesture));
                    let splice = Splice { at: line, removed, inserted };
                    self.edit(project, vec![splice], Some(gesture), tell);
                }
                Change::Still
            }
            Ask::Insert { at, text } => {
                if text.len() <= TEXT {
                    let inserted = text.split('\n').map(Line::new).collect();
                    self.edit(project, vec![Splice { at, removed: 0, inserted }], None, tell);
                }
                Change::Still
            }
            Ask::Remove { lines } => {
                self.edit(project, edits::remove(&lines), None, tell);
                self.select(project, Vec::new());
                Change::Still
            }
            Ask::Duplicate { lines } => {
                let size = self.step(project) * 40.0;
                let (splices, copies) = edits::duplicate(self.file_lines(project), &lines, size);
                self.edit(project, splices, None, tell);
                self.select(project, copies);
                self.outline(project, tell);
                Change::Still
            }
            Ask::Reorder { line, down } => {
                let stage = self.stage(project);
                if let Some((splices, at)) = edits::reorder(self.file_lines(project), &stage, line, down) {
                    self.edit(project, splices, None, tell);
                    self.select(project, vec![at]);
                }
                Change::Still
            }
            Ask::Rename { line, name } => {
                if let Some(to) = self.line(project, line).and_then(|line| line.named(&name)) {
                    self.edit(project, vec![edits::set(line, to)], None, tell);
                }
                Change::Nothing
            }
            Ask::Hide { lines } => {
                let splices = edits::hide(self.file_lines(project), &lines);
                self.edit(project, splices, None, tell);
                self.outline(project, tell);
                Change::Still
            }
            Ask::Drop { lines } => {
                let stage = self.stage(project);
                if let Some(scene) = self.sound_scene(project, &stage) {
                    let splices = edits::drop_down(self.file_lines(project), &stage, &scene, &lines);
                    self.edit(project, splices, None, tell);
                    self.outline(project, tell);
                }
                Change::Still
            }
            Ask::Nudge { lines, by } => {
                let by = DVec3::from(by) * self.step(project) * 10.0;
                let splices = lines
                    .iter()
                    .filter_map(|&at| Some(edits::set(at, edits::moved(self.line(project, at)?, by)?)))
                    .collect();
                self.edit(project, splices, None, tell);
                self.outline(project, tell);
                Change::Still
            }
            Ask::Add { command, at } => {
                self.add(project, &command, at.map(DVec2::from), tell);
                Change::Still
            }
            Ask::Undo | Ask::Redo => {
                let file = self.place(project).file;
                let opened = &mut project.files[file];
                let splices = if matches!(ask, Ask::Undo) { opened.undo() } else { opened.redo() };
                self.told(splices, tell);
                self.select(project, self.selection.clone());
                self.outline(project, tell);
                Change::Still
            }
            Ask::Resolve { keep_mine } => {
                let file = self.place(project).file;
                let splices = project.files[file].resolve(keep_mine);
                self.told(splices, tell);
                Change::Still
            }
            Ask::Load { from, new } => self.load(project, from, new.as_deref(), tell),
            Ask::Render => {
                self.output = Some(Output::Render);
                Change::Nothing
            }
            Ask::Cancel => {
                self.output = Some(Output::Cancel);
                Change::Nothing
            }
        })
    }

    fn answer(&mut self, project: &Project, mut tell: Tell, change: Change) -> Answer {
        let files: Vec<_> = project
            .files
            .iter()
            .map(|file| FileState {
                name: file.name.clone(),
                frames: file.frame_count(),
                faulty: !file.is_sound(),
            })
            .collect();
        if files != self.files {
            tell.files = Some(files.clone());
            self.files = files;
        }
        let scene = self.scene(project);
        let picture = match (change, &scene) {
            (Change::Nothing, _) | (_, None) => None,
            (change, Some(scene)) => {
                self.pictures = self.pictures.wrapping_add(1);
                let moving = change == Change::Moving;
                Some(Wanted { scene: scene.clone(), moving, number: self.pictures })
            }
        };
        tell.state = Some(self.state(project, scene.as_ref()));
        Answer { tell, picture, shown: false, output: None }
    }

    fn state(&self, project: &Project, scene: Option<&Scene>) -> State {
        let place = self.place(project);
        let file = &project.files[place.file];
        let lines = file.document.lines();
        let mut shown = Vec::new();
        let mut grid = String::new();
        if let Some(scene) = scene {
            let projection = Projection::new(scene);
            let around = self.around(project);
            if !matches!(self.held, Some(Held::Turn(_)))
                && let Some(&line) = self.selection.last()
                && let Some(text) = lines.get(line)
            {
                shown = handles(line, text, &projection, around);
            }
            if self.free.is_some() {
                grid = grid_path(&projection, self.bounds(project));
            }
        }
        let inspected = self.selection.last().and_then(|&line| {
            let text = lines.get(line)?;
            let (values, words) = (Values::of(text)?, text.words()?);
            let numbers = (0..words.parameters.len()).map(|at| values.number(at)).collect();
            Some(Inspected { line, command: values.command.name(), values: numbers })
        });
        let faults = file
            .diagnostics
            .iter()
            .map(|fault| FaultState {
                line: fault.line - 1,
                column: fault.column - 1,
                length: fault.excerpt.text.get(fault.excerpt.marked.clone()).map_or(0, |t| t.chars().count()),
                error: fault.is_error(),
                message: fault.message.clone(),
                help: fault.help.clone().or_else(|| fault.expected.clone()).unwrap_or_default(),
            })
            .collect();
        State {
            asked: self.asked,
            title: project.name.clone(),
            fps: project.settings.fps(),
            frame: self.frame.min(project.frame_count() - 1),
            frames: project.frame_count(),
            file: place.file,
            saved: file.saved(),
            can_undo: file.document.can_undo(),
            can_redo: file.document.can_redo(),
            selection: self.selection.clone(),
            inspected,
            faults,
            handles: shown,
            grid,
            free: self.free.is_some(),
            picture: scene.map(|scene| (self.pictures, scene.screen.width(), scene.screen.height())),
        }
    }

    fn place(&self, project: &Project) -> Place {
        project.place(self.frame)
    }

    fn file_lines<'a>(&self, project: &'a Project) -> &'a [Line] {
        project.files[self.place(project).file].document.lines()
    }

    fn line<'a>(&self, project: &'a Project, at: usize) -> Option<&'a Line> {
        self.file_lines(project).get(at)
    }

    fn stage(&self, project: &Project) -> Stage {
        Stage::of(self.file_lines(project), self.place(project).frame)
    }

    fn lines(&self, project: &Project) -> Vec<LineState> {
        self.file_lines(project).iter().map(line_state).collect()
    }

    /// Makes changes of the file that is shown, as one step.
    fn edit(&mut self, project: &mut Project, splices: Vec<Splice>, gesture: Option<u64>, tell: &mut Tell) {
        let file = self.place(project).file;
        let lines = project.files[file].document.lines();
        let is_new =
            |splice: &Splice| lines.get(splice.at..splice.at + splice.removed) != Some(&splice.inserted[..]);
        let splices: Vec<_> = splices.into_iter().filter(is_new).collect();
        if splices.is_empty() {
            return;
        }
        // Several splices are one step also where there is no gesture.
        let gesture = gesture.unwrap_or_else(|| self.next_gesture());
        let done = project.files[file].apply(splices, Some(gesture));
        self.told(done, tell);
    }

    /// The pointer's gestures are even.
    fn next_gesture(&mut self) -> u64 {
        self.gestures += 1;
        self.gestures << 1
    }

    /// The selection stays with its lines.
    fn told(&mut self, splices: Vec<Splice>, tell: &mut Tell) {
        for splice in &splices {
            let (end, inserted) = (splice.at + splice.removed, splice.inserted.len());
            self.selection.retain(|&line| line < splice.at || line >= end || inserted == splice.removed);
            for line in self.selection.iter_mut().filter(|line| **line >= end) {
                *line = *line + inserted - splice.removed;
            }
        }
        tell.splices.extend(splices.into_iter().map(|splice| LinesChanged {
            at: splice.at,
            removed: splice.removed,
            lines: splice.inserted.iter().map(line_state).collect(),
        }));
    }

    fn select(&mut self, project: &Project, lines: Vec<usize>) {
        let count = self.file_lines(project).len();
        self.selection.clear();
        for line in lines.into_iter().filter(|&line| line < count) {
            self.selection.retain(|&other| other != line);
            self.selection.push(line);
        }
    }

    fn show(&mut self, project: &Project, frame: usize, tell: &mut Tell) {
        self.frame = frame.min(project.frame_count() - 1);
        let file = self.place(project).file;
        if file != self.shown_file {
            self.shown_file = file;
            tell.lines = Some(self.lines(project));
            let kept = self.selection.clone();
            self.select(project, kept);
        }
    }

    /// What the viewport shows.
    fn scene(&self, project: &Project) -> Option<Scene> {
        let place = self.place(project);
        let mut scene = project.files[place.file].script.as_ref()?.frame(place.frame)?;
        let (width, height) = (f64::from(self.size.0), f64::from(self.size.1));
        match (&self.free, &scene.camera) {
            (Some(orbit), _) => {
                scene.screen = fitted(width, height)?;
                scene.camera = Camera::Pinhole(orbit.camera(width / height).ok()?);
            }
            // Its pixels are world units.
            (None, Camera::Orthographic) => {}
            (None, _) => {
                let (columns, rows) = (f64::from(scene.screen.width()), f64::from(scene.screen.height()));
                let scale = (width / columns).min(height / rows);
                scene.screen = fitted(columns * scale, rows * scale)?;
            }
        }
        Some(scene)
    }

    /// The same, if its objects are those of the lines.
    fn sound_scene(&self, project: &Project, stage: &Stage) -> Option<Scene> {
        let is_sound = project.files[self.place(project).file].is_sound();
        self.scene(project).filter(|scene| is_sound && scene.objects.len() == stage.objects.len())
    }

    fn bounds(&self, project: &Project) -> Bounds {
        let lines = self.file_lines(project);
        let stage = self.stage(project);
        let objects = stage.objects.iter().filter_map(|&line| lines.get(line));
        edits::bounds(objects).unwrap_or(Bounds { low: DVec3::splat(-1.0), high: DVec3::splat(1.0) })
    }

    /// Where lights without a place are shown.
    fn around(&self, project: &Project) -> DVec3 {
        self.free.map_or_else(|| self.bounds(project).center(), |orbit| orbit.target)
    }

    /// What a pixel spans in the middle of the scene, as a power of ten.
    fn step(&self, project: &Project) -> f64 {
        let pixel = self.scene(project).map(|scene| Projection::new(&scene).pixel_at(self.around(project)));
        let pixel = pixel.filter(|pixel| pixel.is_normal()).unwrap_or(0.01);
        10f64.powi(pixel.log10().floor().clamp(-12.0, 12.0) as i32)
    }

    /// The line of the object under a point of the picture, and where it was hit.
    fn pick(&self, project: &Project, x: f64, y: f64) -> Option<(usize, DVec3)> {
        let stage = self.stage(project);
        let scene = self.sound_scene(project, &stage)?;
        let (column, row) = (x.floor(), y.floor());
        let inside = (0.0..f64::from(scene.screen.width())).contains(&column)
            && (0.0..f64::from(scene.screen.height())).contains(&row);
        let found = if inside { silhouette::pick(&scene, column, row).ok().flatten()? } else { return None };
        let (origin, direction) = Projection::new(&scene).ray(DVec2::new(column + 0.5, row + 0.5));
        Some((*stage.objects.get(found.object)?, origin + found.distance * direction))
    }

    fn outline(&self, project: &Project, tell: &mut Tell) {
        let stage = self.stage(project);
        let scene = self.sound_scene(project, &stage);
        let is_in =
            |object: usize| stage.objects.get(object).is_some_and(|line| self.selection.contains(line));
        let any = self.selection.iter().any(|line| stage.objects.contains(line));
        let path = scene.filter(|_| any).and_then(|scene| silhouette::outline(&scene, is_in).ok());
        tell.outline = Some(path.unwrap_or_default());
    }

    fn press(&mut self, project: &Project, at: DVec2, extend: bool, handle: Option<(Grip, usize)>) {
        self.gestures += 1;
        let around = self.around(project);
        let (grip, grabbed) = match handle {
            Some((grip, line)) => {
                if !self.selection.contains(&line) {
                    self.select(project, vec![line]);
                }
                (grip, None)
            }
            None => {
                let Some((line, point)) = self.pick(project, at.x, at.y) else {
                    if !extend {
                        self.selection.clear();
                    }
                    self.held = Some(Held::Turn(at));
                    return;
                };
                let mut selection = if extend || self.selection.contains(&line) {
                    self.selection.clone()
                } else {
                    Vec::new()
                };
                selection.push(line);
                self.select(project, selection);
                (Grip::Body, Some(point))
            }
        };
        let all = matches!(grip, Grip::Body | Grip::Axis { .. });
        let main = self.selection.last().copied();
        let lines = self.selection.iter().rev().copied().filter(|&line| all || Some(line) == main);
        let lines = lines.filter_map(|line| Some((line, self.line(project, line)?.clone()))).collect();
        self.held = Drag::new(grip, lines, grabbed, around).map(|drag| Held::Drag(drag, at));
    }

    fn drag(&mut self, project: &mut Project, at: DVec2, manner: Manner, tell: &mut Tell) -> Change {
        let Some(scene) = self.scene(project) else { return Change::Nothing };
        match &mut self.held {
            None => Change::Nothing,
            Some(Held::Turn(last)) => {
                let moved = (at - *last) / f64::from(scene.screen.height());
                *last = at;
                self.navigate(project, Navigation::Turn, moved);
                tell.outline = Some(String::new());
                Change::Moving
            }
            Some(Held::Drag(drag, start)) => {
                let changed = drag.to(&Projection::new(&scene), *start, at, manner);
                let gesture = self.gestures << 1;
                let splices = changed
                    .into_iter()
                    .filter(|(line, text)| self.line(project, *line).is_some_and(|old| old != text))
                    .map(|(line, text)| edits::set(line, text))
                    .collect();
                self.edit(project, splices, Some(gesture), tell);
                tell.outline = Some(String::new());
                Change::Moving
            }
        }
    }

    fn navigate(&mut self, project: &Project, how: Navigation, moved: DVec2) {
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

    /// A free camera where one looks from now.
    fn orbit(&self, project: &Project) -> Option<Orbit> {
        let scene = self.scene(project)?;
        Some(self.free.unwrap_or_else(|| Orbit::from_camera(&scene.camera, self.bounds(project))))
    }

    fn look(&mut self, project: &Project, at: Standpoint) {
        let bounds = self.bounds(project);
        let quarter = std::f64::consts::FRAC_PI_2;
        self.free = match at {
            Standpoint::Script => None,
            Standpoint::Free => self.orbit(project),
            Standpoint::Front => Some(Orbit::at(bounds, 0.0, 0.0)),
            Standpoint::Side => Some(Orbit::at(bounds, quarter, 0.0)),
            Standpoint::Top => Some(Orbit::at(bounds, 0.0, quarter)),
            Standpoint::Selection => {
                let lines = self.selection.iter().filter_map(|&line| self.line(project, line));
                let what = edits::bounds(lines).unwrap_or(bounds);
                let from = self.orbit(project);
                from.map(|from| Orbit { half_fov: from.half_fov, ..Orbit::at(what, from.yaw, from.pitch) })
            }
        };
    }

    fn keep_camera(&mut self, project: &mut Project, tell: &mut Tell) -> Change {
        let place = self.place(project);
        let Some(screen) =
            project.files[place.file].script.as_ref().and_then(|script| script.frame(place.frame))
        else {
            return Change::Nothing;
        };
        let aspect = f64::from(screen.screen.width()) / f64::from(screen.screen.height());
        let Some(Ok(camera)) = self.free.map(|orbit| orbit.camera(aspect)) else { return Change::Nothing };
        let stage = self.stage(project);
        let lines = self.file_lines(project);
        let numbers = camera_numbers(&camera, self.step(project));
        let old = stage.camera.filter(|&at| lines[at].command() == Some(Command::Camera));
        let splice = match old {
            Some(at) => lines[at].with_numbers(0, &numbers).map(|line| edits::set(at, line)),
            None => {
                let line = Line::new(Command::Camera.name()).with_numbers(0, &numbers);
                let at = stage.camera.or(stage.screen).map_or(0, |at| at + 1);
                line.map(|line| Splice { at, removed: 0, inserted: vec![line] })
            }
        };
        self.edit(project, splice.into_iter().collect(), None, tell);
        self.free = None;
        Change::Still
    }

    fn add(&mut self, project: &mut Project, name: &str, at: Option<DVec2>, tell: &mut Tell) {
        let Some(command) = Command::from_name(name) else { return };
        if !matches!(role(command), Role::Object | Role::Light) {
            return;
        }
        let stage = self.stage(project);
        let (mut ground, mut size) = (DVec3::ZERO, 1.0);
        if let Some(scene) = self.scene(project) {
            let projection = Projection::new(&scene);
            let (width, height) = (f64::from(scene.screen.width()), f64::from(scene.screen.height()));
            let at = at.unwrap_or(DVec2::new(0.5 * width, 0.6 * height));
            let bounds = self.bounds(project);
            let (origin, direction) = projection.ray(at);
            let below = bounds.low.y.min(0.0);
            let distance = (below - origin.y) / direction.y;
            let hit = self.pick(project, at.x, at.y).map(|(_, point)| point);
            let on_ground = || {
                let near =
                    distance > 0.0 && distance < 20.0 * bounds.radius() + origin.distance(bounds.center());
                near.then_some(origin + distance * direction)
            };
            ground = hit.or_else(on_ground).unwrap_or(bounds.center());
            size = projection.pixel_at(ground) * height * 0.07;
            let step = 10f64.powi(size.log10().floor() as i32);
            size = (size / step).round() * step;
        }
        if !(size.is_normal() && ground.is_finite()) {
            (ground, size) = (DVec3::ZERO, 1.0);
        }
        let count = stage.objects.len() + stage.lights.len();
        let line = edits::new_line(command, ground, size, count);
        let (splices, place) = edits::add(self.file_lines(project), &stage, line);
        self.edit(project, splices, None, tell);
        self.select(project, vec![place]);
        self.outline(project, tell);
    }
}

fn line_state(line: &Line) -> LineState {
    let text = line.text();
    let hidden = if text.trim_start().starts_with('#') { edits::hidden(line) } else { None };
    let of = hidden.as_ref().unwrap_or(line);
    let command = of.command();
    LineState {
        text,
        command: command.map(Command::name),
        role: command.map(role),
        name: of.name(),
        hidden: hidden.is_some(),
    }
}

/// A line with other numbers; a parameter that was left out is there whole then.
fn whole(line: &Line, first: usize, values: &[f64]) -> Option<Line> {
    let line = line.with_numbers(first, values)?;
    let (command, words) = (line.command()?, line.words()?.parameters.len());
    let cut = fields(command).map(|(first, field)| (first, first + field.names.len()));
    match cut.into_iter().find(|&(first, end)| first < words && words < end) {
        Some((_, end)) => line.with_numbers(words, &vec![0.0; end - words]),
        None => Some(line),
    }
}

/// A size of a picture, smaller than asked for where that is too large.
fn fitted(width: f64, height: f64) -> Option<Screen> {
    let scale = (PIXELS as f64 / (width * height)).sqrt().min(1.0);
    let side = |side: f64| (side * scale).round().max(1.0) as u32;
    Screen::new(side(width), side(height)).ok()
}

/// The numbers of `Camera`, rounded to what can be seen.
fn camera_numbers(camera: &Pinhole, step: f64) -> Vec<f64> {
    let decimals = |step: f64| (-step.log10()).ceil().clamp(0.0, 12.0) as usize;
    let round = |x: f64, decimals: usize| format!("{x:.decimals$}").parse().unwrap_or(x);
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

/// Lines on the height 0 around a scene.
fn grid_path(projection: &Projection, bounds: Bounds) -> String {
    let step = 10f64.powf((bounds.radius() / 4.0).log10().round());
    let reach = step * f64::from(GRID);
    let middle = (bounds.center() / step).round() * step;
    let at = |x: f64, z: f64| projection.point(DVec3::new(middle.x + x, 0.0, middle.z + z));
    let mut path = String::new();
    for line in -GRID..=GRID {
        let off = step * f64::from(line);
        for flip in [false, true] {
            // In pieces: one that goes behind the eye is left out.
            for piece in -GRID..GRID {
                let (from, to) = (step * f64::from(piece), step * f64::from(piece + 1));
                let ends = if flip { (at(off, from), at(off, to)) } else { (at(from, off), at(to, off)) };
                if let ((Some(a), Some(b)), true) = (ends, reach.is_finite()) {
                    path.push_str(&format!("M{:.1} {:.1}L{:.1} {:.1}", a.x, a.y, b.x, b.y));
                }
            }
        }
    }
    path
}

#[cfg(test)]
#[path = "session/tests.rs"]
mod tests;
