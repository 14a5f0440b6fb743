//! The session of a page, and the work that it gives to drawing workers.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use rayfold_scene::{Name, SETTINGS_FILE, natural_cmp, script_name};

use super::drawer::Task;
use super::packet::File;
use super::painter::Painter;
use crate::error::Error;
use crate::output::scripts_zip;
use crate::project::Project;
use crate::protocol::{ClientMessage, MovieFormat, ServerMessage};
use crate::session::{Answer, Output, Session};
use crate::storage::Memory;

/// An action for the page's scripts.
#[derive(Debug)]
pub enum Effect {
    /// Send this message to the page.
    Tell(String),
    /// Show this picture on the page.
    Show(Vec<u8>),
    /// Send a file to a drawing worker.
    Put(usize, String, Vec<u8>),
    /// Let a drawing worker do this task.
    Draw(usize, String),
    /// Keep a file.
    Save(String, Vec<u8>),
    /// Answer the request with this number. An empty answer means that there is nothing.
    Answer(u32, Vec<u8>),
    /// Call again after this many milliseconds.
    Wake(u32),
    /// Render the animation in this format, or stop rendering if there is none.
    Film(Option<&'static str>),
}

/// The session of a page.
#[derive(Debug)]
pub struct Desk {
    project: Project,
    session: Session,
    files: Memory,
    painter: Painter,
    workers: Vec<Worker>,
    /// Small pictures that wait, each with the number of its request.
    waiting: VecDeque<(u32, usize, Task)>,
    /// The texts of scripts that drawing workers have, each with a number that changes with the text.
    texts: BTreeMap<String, (u64, Vec<u8>)>,
    effects: Vec<Effect>,
}

/// A drawing worker.
#[derive(Debug, Default)]
struct Worker {
    busy: Option<Work>,
    /// The tags of the files that the worker has.
    has: BTreeMap<String, u64>,
}

#[derive(Debug)]
enum Work {
    Rows(u64, (u32, u32)),
    Answer(u32),
}

/// Returns a project of files, and the files.
pub(super) fn project_of(name: &str, files: Vec<File>) -> Result<(Project, Memory), Error> {
    let memory = Memory::default();
    let mut names: Vec<String> = Vec::new();
    for (name, content) in files {
        if matches!(Name::of(&name), Name::Script(_)) {
            names.push(name.clone());
        }
        memory.insert(&name, content);
    }
    let order = |name: &String| script_name(name).unwrap_or(name).to_owned();
    names.sort_by(|a, b| natural_cmp(&order(a), &order(b)));
    let project = Project::of(name.into(), Arc::new(memory.clone()), names, true)?;
    Ok((project, memory))
}

impl Desk {
    /// Opens a project of these files, for this many drawing workers.
    ///
    /// # Errors
    /// Fails if the files exceed the limit of the studio, or if `animation.json` is invalid.
    pub fn open(name: &str, files: Vec<File>, workers: usize) -> Result<Self, Error> {
        let (project, files) = project_of(name, files)?;
        let (session, mut answer) = Session::open(&project);
        answer.tell.can_submit = Some(false);
        let mut desk = Self {
            project,
            session,
            files,
            painter: Painter::new(workers),
            workers: (0..workers.max(1)).map(|_| Worker::default()).collect(),
            waiting: VecDeque::new(),
            texts: BTreeMap::new(),
            effects: Vec::new(),
        };
        desk.follow(answer);
        Ok(desk)
    }

    /// Returns the actions since the last call.
    pub fn effects(&mut self) -> Vec<Effect> {
        self.hand_out();
        let written = self.files.take_written();
        self.effects.extend(written.into_iter().map(|(name, content)| Effect::Save(name, content.to_vec())));
        std::mem::take(&mut self.effects)
    }

    /// Takes a message of the page.
    pub fn hear(&mut self, message: &str) {
        let answer = match serde_json::from_str::<ClientMessage>(message) {
            Ok(ask) => self.session.ask(&mut self.project, ask),
            Err(error) => {
                let notice = Some(format!("the page said what is not understood: {error}"));
                Answer { tell: ServerMessage { notice, ..ServerMessage::default() }, ..Answer::default() }
            }
        };
        self.follow(answer);
    }

    /// Looks for changes of files, and writes files that have not changed for a while, or all if `now`.
    pub fn tick(&mut self, now: bool) {
        if now {
            self.project.save(true);
        }
        if let Some(answer) = self.session.tick(&mut self.project) {
            self.follow(answer);
        }
    }

    /// Takes a file from outside, in place of an older one.
    pub fn put(&self, name: &str, content: Vec<u8>) {
        self.files.insert(name, content);
    }

    /// Takes the result of a drawing worker.
    pub fn drawn(&mut self, worker: usize, drawn: Vec<u8>) {
        let effects = &mut self.effects;
        match self.workers.get_mut(worker).and_then(|worker| worker.busy.take()) {
            Some(Work::Rows(id, rows)) => {
                self.painter.drawn(id, rows, &drawn, &mut |picture| effects.push(Effect::Show(picture)));
            }
            Some(Work::Answer(number)) => effects.push(Effect::Answer(number, drawn)),
            None => {}
        }
    }

    /// Records that a drawing worker has failed, and that a new one without files replaces it.
    pub fn lost(&mut self, worker: usize) {
        if let Some(worker) = self.workers.get_mut(worker) {
            worker.has.clear();
        }
        self.drawn(worker, Vec::new());
    }

    /// Takes a request of the page for a file, by the same address as with a server. The answer is an
    /// [`Effect::Answer`].
    pub fn get(&mut self, number: u32, address: &str) {
        let (name, query) = address.split_once('?').unwrap_or((address, ""));
        let mut numbers = query.split(',').map(|number| number.parse().unwrap_or(0usize));
        let mut next = || numbers.next().unwrap_or(0);
        let first = next();
        let script = self.project.files.get(first).map(|file| file.name.clone());
        let task = match (name, script) {
            ("scripts.zip", _) => {
                let zip = scripts_zip(&self.project).unwrap_or_default();
                return self.effects.push(Effect::Answer(number, zip));
            }
            ("script.txt", _) => {
                let text = self.project.files.get(first).map(|file| file.document.bytes());
                return self.effects.push(Effect::Answer(number, text.unwrap_or_default()));
            }
            ("preset.png", _) => Some((first, Task::Preset { name: query.into() })),
            ("frame.png", _) => {
                let place = self.project.place(first);
                let script = self.project.files[place.file].name.clone();
                Some((place.file, Task::Frame { script, frame: place.frame }))
            }
            ("thumbnail.png", Some(script)) => Some((first, Task::Thumbnail { script })),
            ("material.png", Some(script)) => {
                let (line, frame) = (next(), u32::try_from(next()).unwrap_or(u32::MAX));
                Some((first, Task::Material { script, line, frame }))
            }
            _ => None,
        };
        match task {
            Some((file, task)) => self.waiting.push_back((number, file, task)),
            None => self.effects.push(Effect::Answer(number, Vec::new())),
        }
    }

    /// Returns the name of the project, and all its files as they are on the page.
    pub fn files(&self) -> (String, Vec<File>) {
        let of = |name: &String| self.project.files.iter().find(|file| file.name == *name);
        let kept = self.files.all().into_iter();
        let mut files: BTreeMap<String, Vec<u8>> = kept
            .filter(|(name, ..)| of(name).is_none())
            .map(|(name, _, content)| (name, content.to_vec()))
            .collect();
        files.extend(self.project.files.iter().map(|file| (file.name.clone(), file.document.bytes())));
        (self.project.name.clone(), files.into_iter().collect())
    }

    fn follow(&mut self, answer: Answer) {
        if answer.shown {
            return self.painter.shown();
        }
        if let Some(wanted) = answer.picture {
            self.painter.want(wanted);
        }
        match answer.output {
            Some(Output::Cancel) => self.effects.push(Effect::Film(None)),
            Some(Output::Render(format)) => self.effects.push(Effect::Film(Some(match format {
                MovieFormat::Gif => "gif",
                MovieFormat::Apng => "apng",
                MovieFormat::Webp => "webp",
            }))),
            None => {}
        }
        // Numbers, texts and lists of them can always be written as JSON.
        self.effects.push(Effect::Tell(serde_json::to_string(&answer.tell).unwrap_or_default()));
    }

    /// Gives work to idle workers: rows of the picture before small pictures.
    fn hand_out(&mut self) {
        while let Some(worker) = self.workers.iter().position(|worker| worker.busy.is_none()) {
            let effects = &mut self.effects;
            let piece = self.painter.next(&mut |picture| effects.push(Effect::Show(picture)));
            let (work, file, task) = match piece {
                Some(piece) => {
                    let mut rows = piece.rows;
                    let Some(file) = self.project.files.get(piece.file) else { break };
                    rows.script.clone_from(&file.name);
                    (Work::Rows(piece.id, rows.rows), piece.file, Task::Rows(rows))
                }
                None => match self.waiting.pop_front() {
                    Some((number, file, task)) => (Work::Answer(number), file, task),
                    None => break,
                },
            };
            self.put_files(worker, file);
            self.workers[worker].busy = Some(work);
            let task = serde_json::to_string(&task).unwrap_or_default();
            self.effects.push(Effect::Draw(worker, task));
        }
        if let Some(pause) = self.painter.pause() {
            self.effects.push(Effect::Wake(pause.as_millis() as u32 + 1));
        }
    }

    /// Sends to a worker what it lacks: the text of a script, and files that are no scripts.
    fn put_files(&mut self, worker: usize, file: usize) {
        let worker_files = &mut self.workers[worker].has;
        let mut put = |name: &str, tag: u64, content: &[u8]| {
            if worker_files.get(name) != Some(&tag) {
                worker_files.insert(name.into(), tag);
                self.effects.push(Effect::Put(worker, name.into(), content.into()));
            }
        };
        for (name, tag, content) in self.files.all() {
            if !matches!(Name::of(&name), Name::Script(_)) && name != SETTINGS_FILE {
                put(&name, tag, &content);
            }
        }
        let Some(file) = self.project.files.get(file) else { return };
        // While a text has an error, its last valid one is drawn.
        if file.is_sound() {
            let text = file.document.bytes();
            let kept = self.texts.entry(file.name.clone()).or_default();
            if kept.1 != text || kept.0 == 0 {
                *kept = (kept.0 + 1, text);
            }
        }
        if let Some((tag, text)) = self.texts.get(&file.name) {
            put(&file.name, *tag, text);
        }
    }
}

#[cfg(test)]
mod tests {
    use rayfold_scene::{Limits, parse};
    use rayfold_tracer::{RenderOptions, picture_of_frame};

    use super::*;
    use crate::browser::drawer::Drawer;
    use crate::packing::tests::Shown;

    const TEXT: &str = "Screen 96 64\nLook 0 1 6  0 0 0  50\nIlight 1 1 1  1 -1 -1\n\
                        Sphere 1  0 0 0  0.2 0.1 0.1  0.7 0.5 0.3\nTrace\n";

    /// A page with workers that do each task at once.
    struct Stage {
        desk: Desk,
        drawers: Vec<Drawer>,
        shown: Shown,
        told: Vec<serde_json::Value>,
        saved: BTreeMap<String, Vec<u8>>,
        answers: BTreeMap<u32, Vec<u8>>,
        qualities: Vec<u8>,
    }

    impl Stage {
        fn new(files: &[(&str, &str)], workers: usize) -> Self {
            let files = files.iter().map(|&(name, text)| (name.to_owned(), text.into())).collect();
            let desk = Desk::open("film", files, workers).unwrap();
            let drawers = (0..workers).map(|_| Drawer::default()).collect();
            let (shown, told, qualities) = (Shown::default(), Vec::new(), Vec::new());
            let (saved, answers) = (BTreeMap::new(), BTreeMap::new());
            Self { desk, drawers, shown, told, saved, answers, qualities }
        }

        /// Executes all actions until there are none left.
        fn settle(&mut self) {
            loop {
                let effects = self.desk.effects();
                if effects.iter().all(|effect| matches!(effect, Effect::Wake(_))) {
                    return;
                }
                for effect in effects {
                    match effect {
                        Effect::Tell(text) => self.told.push(serde_json::from_str(&text).unwrap()),
                        Effect::Show(picture) => {
                            self.qualities.push(picture[16]);
                            self.shown.put(&picture);
                            self.desk.hear(r#"{"ask":"shown"}"#);
                        }
                        Effect::Put(worker, name, content) => self.drawers[worker].put(&name, content),
                        Effect::Draw(worker, task) => {
                            let drawn = self.drawers[worker].draw(&task).unwrap();
                            self.desk.drawn(worker, drawn);
                        }
                        Effect::Save(name, content) => drop(self.saved.insert(name, content)),
                        Effect::Answer(number, content) => drop(self.answers.insert(number, content)),
                        Effect::Wake(_) | Effect::Film(_) => {}
                    }
                }
            }
        }

        fn hear(&mut self, message: &str) {
            self.desk.hear(message);
            self.settle();
        }
    }

    fn expected(text: &str) -> image::RgbaImage {
        let script = parse("a", text.as_bytes(), &Limits::default()).script.unwrap();
        picture_of_frame(&script, 0, &RenderOptions::default()).unwrap().unwrap().into_rgba8()
    }

    #[test]
    fn any_number_of_workers_draws_the_tracers_picture() {
        let sampled = TEXT.replace("Trace", "Samples 16 0.02\nTrace");
        for text in [TEXT, &sampled] {
            for workers in [1, 2, 5] {
                let mut stage = Stage::new(&[("a.txt", text)], workers);
                stage.hear(r#"{"ask":"size","width":96,"height":64}"#);
                assert_eq!(stage.qualities.last(), Some(&1), "the last one is final");
                assert!(stage.qualities.len() > 1, "sketches come before it");
                assert!(stage.shown.0 == expected(text), "{workers} workers");
            }
        }
    }

    #[test]
    fn what_is_dragged_is_drawn_and_kept() {
        let mut stage = Stage::new(&[("a.txt", TEXT)], 2);
        stage.hear(r#"{"ask":"size","width":96,"height":64}"#);
        stage.hear(r#"{"ask":"press","x":48,"y":32,"extend":false,"grip":null,"line":null}"#);
        stage.hear(r#"{"ask":"drag","x":60,"y":32,"upright":false,"snap":false,"whole":false}"#);
        assert_ne!(stage.qualities.last(), Some(&1));
        stage.hear(r#"{"ask":"release"}"#);
        let text = String::from_utf8(stage.desk.project.files[0].document.bytes()).unwrap();
        assert_ne!(text, TEXT);
        assert!(stage.shown.0 == expected(&text));
        stage.desk.tick(true);
        stage.settle();
        assert_eq!(stage.saved.get("a.txt").map(Vec::as_slice), Some(text.as_bytes()));
        // A faulty text is not drawn, and what was drawn stays.
        let version = stage.told.iter().rev().find_map(|tell| tell["text"]["version"].as_u64()).unwrap();
        stage.hear(&format!(
            r#"{{"ask":"edit","file":0,"version":{version},"changes":[{{"at":3,"removed":1,"lines":["Spear 1"]}}]}}"#
        ));
        assert!(stage.shown.0 == expected(&text));
    }

    #[test]
    fn small_pictures_and_files_are_answered() {
        let mut stage = Stage::new(&[("b10.txt", TEXT), ("b9.txt", TEXT), ("note.md", "x")], 1);
        let asked = ["thumbnail.png?1,0", "preset.png?gold", "frame.png?1", "scripts.zip", "script.txt?0"];
        (0u32..).zip(asked).for_each(|(number, address)| stage.desk.get(number, address));
        stage.desk.get(9, "../secret");
        stage.settle();
        let is_png = |number| stage.answers[&number].starts_with(b"\x89PNG");
        assert!(is_png(0) && is_png(1) && is_png(2));
        assert_eq!(super::super::unzipped(&stage.answers[&3]).unwrap().0[0].0, "b9.txt", "natural order");
        assert_eq!(stage.answers[&4], TEXT.as_bytes());
        assert!(stage.answers[&9].is_empty());
        let (name, files) = stage.desk.files();
        assert_eq!((name.as_str(), files.len()), ("film", 3));
    }
}
