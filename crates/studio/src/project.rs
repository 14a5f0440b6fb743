//! The open scripts and their files.
//!
//! Reads and writes only the files that it was opened with. A file is written whole or not at all, and never over a
//! change by another program. In that case it is in [`Saved::Conflict`] until the user chooses a text.

use std::cell::{OnceCell, RefCell};
#[cfg(feature = "server")]
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

#[cfg(feature = "server")]
use rayfold_files::{Folder, NotRead};
use rayfold_scene::assets::{FileInfo, Library, file_name};
use rayfold_scene::{
    AnimationSettings, Diagnostic, Limits, Script, natural_cmp, parse_with_files, script_name,
};
use serde::Serialize;

use crate::clock::Instant;
#[cfg(feature = "server")]
use crate::disk::{Disk, LINK, leads_out};
use crate::document::{Document, Splice};
use crate::error::{Error, words};
use crate::frame::Frame;
use crate::line::Line;
use crate::settings::Settings;
use crate::storage::{Storage, TEXT};
use crate::text_edit::{self, TextChange};
use crate::tracks::{Tracks, tracks};

/// The endings of models.
const MODELS: [&str; 5] = ["obj", "ply", "stl", "glb", "gltf"];

/// The endings of pictures, those of skies before others.
const PICTURES: [&str; 6] = ["hdr", "exr", "png", "jpg", "jpeg", "webp"];

/// The longest name of a new script in bytes. File systems allow 255, and a receipt in a bucket adds to it.
const NAME: usize = 200;

/// The largest number of errors and warnings of a script that are listed.
const DESCRIBED: usize = 200;

/// The time without changes after which a file is written.
const REST: Duration = Duration::from_millis(400);

/// The initial text of a script that does not exist yet.
const STARTER: &str = include_str!("starter.txt");

/// The script of a folder that has none yet.
const FIRST: &str = "scene.txt";

/// Whether a file on disk has the shown content.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "kebab-case")]
pub enum Saved {
    /// The file has the shown content.
    Yes,
    /// The shown content will be written soon.
    Soon,
    /// Another program changed the file, and so did the page.
    Conflict,
    /// The file cannot be written.
    Failed,
}

/// A script and its file.
#[derive(Debug)]
pub struct Opened {
    /// The name of the file.
    pub name: String,
    /// The lines of the script.
    pub document: Document,
    /// The parsed script; the last valid one if the lines have an error now.
    pub script: Option<Arc<Script>>,
    /// The errors and warnings of the lines.
    pub diagnostics: Vec<Diagnostic>,
    /// The content of the file when it was last read or written; `None` if it did not exist.
    on_disk: Option<Vec<u8>>,
    changed: Option<Instant>,
    saved: Saved,
    /// The error of the last attempt to write the file.
    failure: String,
    /// Results computed from the lines, valid until they change: the frame that was requested last, with its index,
    /// and the numbers that change.
    frame: RefCell<Option<(usize, Arc<Frame>)>>,
    tracks: OnceCell<Tracks>,
    /// The folder of the script, with its models.
    storage: Arc<dyn Storage>,
    library: Arc<Library>,
    /// The files that the script names, each with its state when it was parsed.
    named: Vec<(Option<FileInfo>, String)>,
}

/// The open scripts of an animation.
#[derive(Debug)]
pub struct Project {
    /// The name of the folder or of the file.
    pub name: String,
    /// The scripts in the order of the animation; never empty.
    pub files: Vec<Opened>,
    /// The files that look like a part of the animation but are not read.
    #[cfg(feature = "server")]
    pub not_read: Vec<NotRead>,
    settings: Settings,
    storage: Arc<dyn Storage>,
    /// Scripts may be added.
    can_create: bool,
}

/// A position in the animation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Place {
    /// The index of its file.
    pub file: usize,
    /// The index of its `Trace` in the file.
    pub frame: usize,
}

impl Project {
    /// Opens a folder of scripts, or one script. A script that does not exist yet begins with an example, and so does
    /// a folder without scripts. A missing path without an ending is a new folder. Links that lead out of the folder are
    /// not followed.
    ///
    /// # Errors
    /// Fails if a file cannot be read, the folder of the path does not exist, or its `animation.json` is invalid.
    #[cfg(feature = "server")]
    pub fn open(path: &Path) -> Result<Self, Error> {
        let name = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
        let name = name.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        let read = |source| Error::Read { path: path.to_path_buf(), source };
        let is_new = !path.exists() && !path.is_symlink();
        if let Some(parent) =
            path.parent().filter(|parent| !parent.as_os_str().is_empty() && !parent.is_dir())
        {
            return Err(Error::NoFolder { path: parent.to_path_buf() });
        }
        if is_new && path.extension().is_none() {
            std::fs::create_dir(path).map_err(read)?;
        }
        if !path.is_dir() {
            let disk = Arc::new(Disk::of_script(&name, path));
            return Self::of(name.clone(), disk, vec![name], false);
        }
        let listed = Folder::list(path).map_err(read)?;
        let (mut names, mut not_read) = (Vec::new(), listed.not_read);
        for (_, script) in listed.scripts {
            if leads_out(path, &script) {
                not_read.push(NotRead { path: script, problem: LINK });
                continue;
            }
            names.push(script.file_name().unwrap_or_default().to_string_lossy().into_owned());
        }
        Ok(Self { not_read, ..Self::of(name, Arc::new(Disk::new(path)), names, true)? })
    }

    /// Opens scripts by their names, in the order of the animation. Without any, one begins with an example.
    ///
    /// # Errors
    /// Fails if a file cannot be read, or if `animation.json` is invalid.
    pub(crate) fn of(
        name: String,
        storage: Arc<dyn Storage>,
        mut names: Vec<String>,
        can_create: bool,
    ) -> Result<Self, Error> {
        if names.is_empty() {
            names.push(FIRST.to_owned());
        }
        let mut room = TEXT;
        let files = names
            .into_iter()
            .map(|name| {
                let file = Opened::open(name, &storage)?;
                room = room
                    .checked_sub(file.on_disk.as_ref().map_or(0, |text| text.len() as u64))
                    .ok_or_else(|| Error::TooLarge { path: file.name.clone().into(), limit: TEXT })?;
                Ok(file)
            })
            .collect::<Result<_, Error>>()?;
        let settings = Settings::open(can_create.then(|| Arc::clone(&storage)))?;
        Ok(Self {
            name,
            files,
            #[cfg(feature = "server")]
            not_read: Vec::new(),
            settings,
            storage,
            can_create,
        })
    }

    /// Returns the settings of the animation.
    pub fn settings(&self) -> AnimationSettings {
        self.settings.now()
    }

    /// Sets the frame rate, as a step of a file that can be undone.
    ///
    /// # Errors
    /// Fails if an animation cannot have the frame rate, or if `animation.json` cannot be written.
    pub fn set_fps(&mut self, file: usize, fps: f64) -> Result<(), Error> {
        let before = self.settings.now().fps();
        self.settings.set_fps(fps)?;
        if fps != before {
            self.files[file].document.frame_rate_changed(before);
        }
        Ok(())
    }

    /// Checks whether another program has written `animation.json`. Returns whether the frame rate has changed.
    ///
    /// # Errors
    /// Fails if the file is no longer valid.
    pub fn look_at_settings(&mut self) -> Result<bool, Error> {
        self.settings.look()
    }

    /// Undoes the last step of a file, or redoes it. Returns the changes of its lines.
    ///
    /// # Errors
    /// Fails if the step changes the frame rate and `animation.json` cannot be written.
    pub fn step(&mut self, file: usize, back: bool) -> Result<Vec<Splice>, Error> {
        let mut fps = self.settings.now().fps();
        let opened = &mut self.files[file];
        let done = if back { opened.document.undo(&mut fps) } else { opened.document.redo(&mut fps) };
        if !done.is_empty() {
            opened.touched();
        }
        if fps != self.settings.now().fps() {
            self.settings.set_fps(fps)?;
        }
        Ok(done)
    }

    /// Returns whether scripts can be added, that is, whether a folder was opened.
    pub fn can_create(&self) -> bool {
        self.can_create
    }

    /// Adds a script to the folder under a new name. Returns its index.
    ///
    /// # Errors
    /// Fails if no folder was opened, if the name is invalid or taken, or if the file cannot be written.
    pub fn create(&mut self, name: &str, text: &[u8]) -> Result<usize, Error> {
        let refused = |problem| Error::Name { name: name.chars().take(80).collect(), problem };
        if !self.can_create {
            return Err(refused("one script was opened, and nothing beside it may be written"));
        }
        let is_plain = script_name(name).is_some()
            && name.len() <= NAME
            && !name.chars().any(|c| c.is_control() || "/\\:".contains(c));
        if !is_plain {
            return Err(refused("expected a plain file name that ends with .txt"));
        }
        let held: usize = self.files.iter().filter_map(|file| file.on_disk.as_ref()).map(Vec::len).sum();
        if (held + text.len()) as u64 > TEXT {
            return Err(Error::TooLarge { path: name.into(), limit: TEXT });
        }
        if !self.storage.create(name, text)? {
            return Err(refused("there is such a file already"));
        }
        let order = |name: &str, other: &str| {
            natural_cmp(script_name(name).unwrap_or(name), script_name(other).unwrap_or(other))
        };
        let at = self.files.partition_point(|file| order(&file.name, name).is_lt());
        self.files.insert(at, Opened::open(name.to_owned(), &self.storage)?);
        Ok(at)
    }

    /// Returns the number of frames that can be shown: those of all files, and one for a file without any.
    pub fn frame_count(&self) -> usize {
        self.files.iter().map(Opened::frame_count).sum()
    }

    /// Returns the position of a frame, counted from 0. Beyond the end it is that of the last frame.
    pub fn place(&self, frame: usize) -> Place {
        let mut left = frame;
        for (file, opened) in self.files.iter().enumerate() {
            if left < opened.frame_count() {
                return Place { file, frame: left };
            }
            left -= opened.frame_count();
        }
        let file = self.files.len() - 1;
        Place { file, frame: self.files[file].frame_count() - 1 }
    }

    /// Returns the index of the first frame of a file.
    pub fn first_frame(&self, file: usize) -> usize {
        self.files.iter().take(file).map(Opened::frame_count).sum()
    }

    /// Writes files that have not changed for a while, or all at once if `now`. Returns whether
    /// any displayed state changed.
    pub fn save(&mut self, now: bool) -> bool {
        let due = |changed: Instant| now || changed.elapsed() >= REST;
        let mut changed = false;
        for file in &mut self.files {
            if file.changed.is_some_and(due) {
                changed |= file.save();
            }
        }
        changed
    }
}

impl Opened {
    fn open(name: String, storage: &Arc<dyn Storage>) -> Result<Self, Error> {
        let on_disk = storage.read(&name)?;
        let text = on_disk.clone().unwrap_or_else(|| STARTER.into());
        let mut file = Self {
            name,
            document: Document::new(&text),
            script: None,
            diagnostics: Vec::new(),
            on_disk,
            changed: None,
            saved: Saved::Yes,
            failure: String::new(),
            frame: RefCell::default(),
            tracks: OnceCell::new(),
            storage: Arc::clone(storage),
            library: storage.library(),
            named: Vec::new(),
        };
        file.parse();
        Ok(file)
    }

    fn read(&self) -> Result<Option<Vec<u8>>, Error> {
        self.storage.read(&self.name)
    }

    /// Returns the number of frames that can be shown.
    pub fn frame_count(&self) -> usize {
        self.script.as_ref().map_or(1, |script| script.frame_count())
    }

    /// Returns whether the file on disk has the shown content.
    pub fn saved(&self) -> Saved {
        match self.saved {
            Saved::Yes if self.changed.is_some() => Saved::Soon,
            saved => saved,
        }
    }

    /// Returns whether the current text can be rendered.
    pub fn is_sound(&self) -> bool {
        self.script.is_some() && !self.diagnostics.iter().any(Diagnostic::is_error)
    }

    /// Changes lines. Returns the changes that were made.
    pub fn apply(&mut self, splices: Vec<Splice>, gesture: Option<u64>) -> Vec<Splice> {
        let done = splices.into_iter().map(|splice| self.document.apply(splice, gesture)).collect();
        self.touched();
        done
    }

    /// Takes back the step of a gesture, if it is the last one. Returns the changes of the lines.
    pub fn give_up(&mut self, gesture: u64) -> Vec<Splice> {
        let done = self.document.give_up(gesture);
        if !done.is_empty() {
            self.touched();
        }
        done
    }

    /// Makes changes of a text editor, each of the text that the one before it leaves. Returns the changes of the lines,
    /// or `None` if one of them does not fit; those before it stay.
    pub(crate) fn edit_text(&mut self, changes: &[TextChange], gesture: u64) -> Option<Vec<Splice>> {
        let mut done = Vec::new();
        for change in changes {
            let splice = text_edit::splice(self.document.lines(), change)?;
            done.push(self.document.apply_exactly(splice, Some(gesture)));
        }
        self.touched();
        Some(done)
    }

    /// Replaces the text, as a step that can be undone. Returns the changes of the lines.
    pub fn replace(&mut self, text: &[u8]) -> Vec<Splice> {
        let done = self.become_text(text);
        self.changed = Some(Instant::now());
        done
    }

    fn touched(&mut self) {
        self.parse();
        self.changed = Some(Instant::now());
    }

    fn parse(&mut self) {
        let limits = Limits { max_described: DESCRIBED, ..Limits::default() };
        let parsed = parse_with_files(&self.name, &self.document.bytes(), &limits, &self.library);
        self.named = parsed.files.into_iter().map(|name| (self.storage.look(&name), name)).collect();
        self.diagnostics = parsed.diagnostics;
        if parsed.script.is_some() {
            self.script = parsed.script.map(Arc::new);
        }
        self.frame = RefCell::default();
        self.tracks = OnceCell::new();
    }

    /// Returns the models and pictures in the script's folder.
    #[cfg(feature = "server")]
    pub(crate) fn library(&self) -> &Arc<Library> {
        &self.library
    }

    /// Returns the names of the models in the script's folder, in natural order.
    pub(crate) fn models(&self) -> Vec<String> {
        self.files_with(&MODELS)
    }

    /// Returns the names of the pictures in the script's folder: skies first, and both kinds in natural order.
    pub(crate) fn pictures(&self) -> Vec<String> {
        [self.files_with(&PICTURES[..2]), self.surface_pictures()].concat()
    }

    /// Returns the names of the pictures in the script's folder that can be put on a surface, in natural order.
    pub(crate) fn surface_pictures(&self) -> Vec<String> {
        self.files_with(&PICTURES[2..])
    }

    fn files_with(&self, endings: &[&str]) -> Vec<String> {
        let is_one = |name: &String| {
            let ending = name.rsplit('.').next().unwrap_or_default();
            endings.iter().any(|known| ending.eq_ignore_ascii_case(known)) && file_name(name).is_ok()
        };
        let mut names: Vec<_> = self.storage.names().into_iter().filter(is_one).collect();
        names.sort_by(|a, b| natural_cmp(a, b));
        names
    }

    /// Returns a frame, counted from 0.
    pub(crate) fn frame(&self, frame: usize) -> Arc<Frame> {
        let mut kept = self.frame.borrow_mut();
        match &*kept {
            Some((of, known)) if *of == frame => Arc::clone(known),
            _ => {
                let new = Arc::new(Frame::new(self.script.as_deref(), self.document.lines(), frame));
                *kept = Some((frame, Arc::clone(&new)));
                new
            }
        }
    }

    /// Returns the numbers that change.
    pub(crate) fn tracks(&self) -> &Tracks {
        self.tracks.get_or_init(|| tracks(self.document.lines()))
    }

    /// Checks whether another program has written the file. Its text is adopted as a step that can be undone, unless
    /// there are unwritten changes or the file is gone. Returns the changes of the lines.
    pub fn look(&mut self) -> Option<Vec<Splice>> {
        let theirs = self.read().ok()?;
        if theirs == self.on_disk {
            // The file was gone and is there again.
            let is_back = self.saved == Saved::Conflict && self.changed.is_none();
            self.saved = if is_back { Saved::Yes } else { self.saved };
            // A file that the script names may have changed.
            let is_new = self.named.iter().any(|(state, name)| *state != self.storage.look(name));
            if is_new {
                self.parse();
            }
            return (is_back || is_new).then(Vec::new);
        }
        if self.changed.is_some() || theirs.is_none() {
            let news = self.saved != Saved::Conflict;
            self.saved = Saved::Conflict;
            return news.then(Vec::new);
        }
        let text = theirs.clone()?;
        self.on_disk = theirs;
        Some(self.take_over(&text))
    }

    /// Resolves a conflict, with the text of the page or with that of the file. Returns the changes of the lines.
    pub fn resolve(&mut self, keep_mine: bool) -> Vec<Splice> {
        self.on_disk = self.read().unwrap_or_default();
        self.saved = Saved::Yes;
        if keep_mine {
            self.changed = Some(Instant::now());
            return Vec::new();
        }
        let text = self.on_disk.clone().unwrap_or_default();
        self.take_over(&text)
    }

    /// Adopts the text of the file.
    fn take_over(&mut self, text: &[u8]) -> Vec<Splice> {
        let done = self.become_text(text);
        (self.changed, self.saved) = (None, Saved::Yes);
        done
    }

    /// Replaces the lines by those of a text, with one splice of the part that differs.
    fn become_text(&mut self, text: &[u8]) -> Vec<Splice> {
        let new = Line::split(text);
        let old = self.document.lines();
        let most = old.len().min(new.len());
        let same = old.iter().zip(&new).take_while(|(a, b)| a == b).count();
        let rest =
            old.iter().rev().zip(new.iter().rev()).take(most - same).take_while(|(a, b)| a == b).count();
        let inserted = new[same..new.len() - rest].to_vec();
        let splice = Splice { at: same, removed: old.len() - rest - same, inserted };
        let done = self.document.replace(splice);
        self.parse();
        done
    }

    /// Records that the file could not be written. It is tried again after a while.
    fn failed(&mut self, error: &Error) -> Saved {
        self.failure = words(error);
        self.changed = Some(Instant::now());
        Saved::Failed
    }

    /// Returns the reason why the file cannot be written, as long as that is so.
    pub fn failure(&self) -> &str {
        if self.saved == Saved::Failed { &self.failure } else { "" }
    }

    /// Writes the file, unless another program has. Returns whether its state has changed.
    fn save(&mut self) -> bool {
        let before = self.saved();
        if self.saved == Saved::Conflict {
            return false;
        }
        let text = self.document.bytes();
        self.saved = match self.read() {
            Ok(theirs) if theirs != self.on_disk => Saved::Conflict,
            Ok(theirs) if theirs.as_ref() == Some(&text) => {
                self.changed = None;
                Saved::Yes
            }
            Ok(_) => match self.storage.write(&self.name, &text) {
                Ok(()) => {
                    (self.on_disk, self.changed) = (Some(text), None);
                    Saved::Yes
                }
                Err(error) => self.failed(&error),
            },
            Err(error) => self.failed(&error),
        };
        before != self.saved()
    }
}

#[cfg(feature = "server")]
#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::PathBuf;

    use super::*;

    #[test]
    fn a_folder_without_scripts_and_a_new_one_begin_with_a_scene() {
        let folder = tempfile::tempdir().unwrap();
        for path in [folder.path().to_path_buf(), folder.path().join("new")] {
            let mut project = Project::open(&path).unwrap();
            assert!(project.can_create() && project.files[0].is_sound());
            assert!(!path.join(FIRST).exists(), "nothing is written before a change");
            project.files[0].apply(set(0, "# mine"), None);
            project.save(true);
            assert!(fs::read_to_string(path.join(FIRST)).unwrap().starts_with("# mine\n"));
        }
        let error = Project::open(&folder.path().join("no/new.txt")).unwrap_err();
        assert_eq!(
            error.to_string(),
            format!("the folder {} does not exist", folder.path().join("no").display())
        );
        assert!(Project::open(&folder.path().join("single.txt")).is_ok_and(|project| !project.can_create()));
    }

    #[cfg(unix)]
    #[test]
    fn links_out_of_the_folder_are_not_followed() {
        use std::os::unix::fs::symlink;

        let (outside, folder) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let secret = outside.path().join("secret.txt");
        fs::write(&secret, "Screen 4 3\nTrace\n").unwrap();
        fs::write(folder.path().join("a.txt"), "Screen 4 3\nTrace\n").unwrap();
        symlink("a.txt", folder.path().join("b.txt")).unwrap();
        symlink(&secret, folder.path().join("c.txt")).unwrap();
        symlink(outside.path().join("missing"), folder.path().join("d.txt")).unwrap();
        let mut project = Project::open(folder.path()).unwrap();
        let names: Vec<_> = project.files.iter().map(|file| file.name.as_str()).collect();
        assert_eq!(names, ["a.txt", "b.txt"], "a link within the folder is a script");
        assert_eq!(project.not_read.len(), 2);
        // A link that comes later is neither read nor written.
        fs::remove_file(folder.path().join("a.txt")).unwrap();
        symlink(&secret, folder.path().join("a.txt")).unwrap();
        assert_eq!(project.files[0].look(), None);
        project.files[0].apply(set(0, "# mine"), None);
        project.save(true);
        assert_eq!(project.files[0].saved(), Saved::Failed);
        assert_eq!(fs::read_to_string(&secret).unwrap(), "Screen 4 3\nTrace\n");
        // Neither are the settings.
        symlink(outside.path().join("theirs"), folder.path().join("animation.json")).unwrap();
        assert!(project.set_fps(0, 24.0).is_err() && !outside.path().join("theirs").exists());
        assert!(Project::open(folder.path()).is_err());
    }

    fn set(at: usize, text: &str) -> Vec<Splice> {
        vec![Splice { at, removed: 1, inserted: vec![Line::new(text)] }]
    }

    fn one(text: &str) -> (tempfile::TempDir, PathBuf, Project) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        fs::write(&path, text).unwrap();
        let project = Project::open(&path).unwrap();
        (folder, path, project)
    }

    #[test]
    fn what_is_not_there_yet_begins_with_a_scene_and_is_written_when_it_is_changed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new.txt");
        let mut project = Project::open(&path).unwrap();
        assert!(project.files[0].is_sound() && project.files[0].diagnostics.is_empty());
        assert!(!project.save(true) && !path.exists(), "opening writes nothing");
        project.files[0].apply(set(0, "# mine"), None);
        assert_eq!(project.files[0].saved(), Saved::Soon);
        assert!(project.save(true));
        assert!(fs::read_to_string(&path).unwrap().starts_with("# mine\n"));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "no litter");
    }

    #[test]
    fn what_others_wrote_meanwhile_is_never_overwritten() {
        let (_folder, path, mut project) = one("a\nb\nc\n");
        project.files[0].apply(set(1, "mine"), None);
        fs::write(&path, "a\ntheirs\nc\n").unwrap();
        project.save(true);
        assert_eq!(project.files[0].saved(), Saved::Conflict);
        project.files[0].apply(set(0, "more"), None);
        assert!(!project.save(true));
        assert_eq!(fs::read_to_string(&path).unwrap(), "a\ntheirs\nc\n");
        project.files[0].resolve(true);
        project.save(true);
        assert_eq!(fs::read_to_string(&path).unwrap(), "more\nmine\nc\n");
    }

    #[test]
    fn what_others_wrote_is_shown_and_can_be_undone() {
        let (_folder, path, mut project) = one("a\nb\nc\n");
        assert!(project.files[0].look().is_none());
        fs::write(&path, "a\nx\ny\nc\n").unwrap();
        let splices = project.files[0].look().unwrap();
        assert_eq!((splices[0].at, splices[0].removed, splices[0].inserted.len()), (1, 1, 2));
        assert_eq!(project.files[0].document.bytes(), b"a\nx\ny\nc\n");
        assert_eq!(project.files[0].saved(), Saved::Yes);
        project.step(0, true).unwrap();
        assert_eq!(project.files[0].document.bytes(), b"a\nb\nc\n");
        project.save(true);
        assert_eq!(fs::read_to_string(&path).unwrap(), "a\nb\nc\n");
    }

    #[test]
    fn a_file_that_has_gone_is_told_of_and_not_made_again_unasked() {
        let (_folder, path, mut project) = one("a\nb\n");
        fs::remove_file(&path).unwrap();
        assert_eq!(project.files[0].look(), Some(Vec::new()));
        assert_eq!(project.files[0].saved(), Saved::Conflict);
        assert_eq!(project.files[0].look(), None, "once");
        fs::write(&path, "a\nb\n").unwrap();
        assert_eq!(project.files[0].look(), Some(Vec::new()));
        assert_eq!(project.files[0].saved(), Saved::Yes, "it is back");
        fs::remove_file(&path).unwrap();
        project.files[0].look();
        project.files[0].apply(set(0, "mine"), None);
        assert!(!project.save(true) && !path.exists());
        project.files[0].resolve(true);
        project.save(true);
        assert_eq!(
            (fs::read_to_string(&path).unwrap().as_str(), project.files[0].saved()),
            ("mine\nb\n", Saved::Yes)
        );
    }

    #[test]
    fn what_is_read_only_is_not_replaced_and_the_reason_is_told() {
        let (_folder, path, mut project) = one("a\n");
        let writable = fs::metadata(&path).unwrap().permissions();
        let mut locked = writable.clone();
        locked.set_readonly(true);
        fs::set_permissions(&path, locked).unwrap();
        project.files[0].apply(set(0, "mine"), None);
        project.save(true);
        assert_eq!(
            (fs::read_to_string(&path).unwrap().as_str(), project.files[0].saved()),
            ("a\n", Saved::Failed)
        );
        assert!(project.files[0].failure().ends_with("it is read-only"), "{}", project.files[0].failure());
        fs::set_permissions(&path, writable).unwrap();
        project.save(true);
        assert_eq!((fs::read_to_string(&path).unwrap().as_str(), project.files[0].failure()), ("mine\n", ""));
    }

    #[test]
    fn theirs_can_be_taken() {
        let (_folder, path, mut project) = one("a\nb");
        project.files[0].apply(set(0, "mine"), None);
        fs::write(&path, "theirs").unwrap();
        assert_eq!(project.files[0].look(), Some(Vec::new()), "the page learns of the conflict");
        project.files[0].resolve(false);
        assert_eq!(project.files[0].document.bytes(), b"theirs");
        assert!(!project.save(true));
        assert_eq!(fs::read_to_string(&path).unwrap(), "theirs");
    }

    #[test]
    fn a_new_script_goes_into_the_folder_that_was_opened_and_over_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let inner = folder.path().join("film");
        fs::create_dir(&inner).unwrap();
        for name in ["f1.txt", "f10.txt"] {
            fs::write(inner.join(name), "Screen 1 1\nTrace").unwrap();
        }
        fs::write(inner.join("f3.txt.bak"), "").unwrap();
        let mut project = Project::open(&inner).unwrap();
        assert_eq!(project.create("f2.txt", b"# two\n").unwrap(), 1);
        assert_eq!(fs::read(inner.join("f2.txt")).unwrap(), b"# two\n");
        fs::write(inner.join("theirs.txt"), "theirs").unwrap();
        for name in ["f2.txt", "theirs.txt"] {
            let error = project.create(name, b"mine").unwrap_err();
            assert!(error.to_string().contains("there is such a file already"), "{error}");
        }
        assert_eq!(fs::read(inner.join("theirs.txt")).unwrap(), b"theirs");
        let long = format!("{}.txt", "x".repeat(NAME));
        let bad = [
            "", ".txt", "..txt", "a", "a.md", "../a.txt", "/a.txt", "b/a.txt", "b\\a.txt", "a\n.txt",
            "a\0.txt", ".a.txt", "c:a.txt", &long,
        ];
        for name in bad {
            assert!(matches!(project.create(name, b""), Err(Error::Name { .. })), "{name:?}");
        }
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing beside the folder");
        assert_eq!(fs::read_dir(&inner).unwrap().count(), 5, "no litter");
        let names: Vec<_> = project.files.iter().map(|file| file.name.as_str()).collect();
        assert_eq!(names, ["f1.txt", "f2.txt", "f10.txt"]);
        let mut single = Project::open(&inner.join("f1.txt")).unwrap();
        assert!(single.create("f4.txt", b"").is_err() && !single.can_create());
    }

    #[test]
    fn frames_are_those_of_all_files_in_natural_order() {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in
            [("f10.txt", "Screen 1 1\nTrace"), ("f2.txt", "Screen 1 1\nTrace\nTrace"), ("f3.txt", "")]
        {
            fs::write(folder.path().join(name), text).unwrap();
        }
        let project = Project::open(folder.path()).unwrap();
        let names: Vec<_> = project.files.iter().map(|file| file.name.as_str()).collect();
        assert_eq!((names, project.frame_count()), (vec!["f2.txt", "f3.txt", "f10.txt"], 4));
        let places: Vec<_> =
            [0, 1, 2, 3, 9].map(|frame| project.place(frame)).map(|p| (p.file, p.frame)).into();
        assert_eq!(places, [(0, 0), (0, 1), (1, 0), (2, 0), (2, 0)]);
        assert_eq!(project.first_frame(2), 3);
    }
}
