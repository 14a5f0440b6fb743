//! The scripts that are open, and their files.
//!
//! Reads and writes what it was opened with and nothing else. A file is written whole or not at all, and never over
//! what somebody else wrote meanwhile: then it is in [`Saved::Conflict`] until it is said whose text stays.

use std::cell::{OnceCell, RefCell};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use rayfold_files::{Folder, NotRead, OutputFile};
use rayfold_scene::{AnimationSettings, Diagnostic, Limits, Script, natural_cmp, parse, script_name};
use serde::Serialize;

use crate::document::{Document, Splice};
use crate::error::{Error, words};
use crate::files::{TEXT, read};
use crate::frame::Frame;
use crate::line::Line;
use crate::settings::Settings;
use crate::tracks::{Tracks, tracks};

/// Bytes of a new script's name; file systems take 255, and a receipt in a bucket adds to it.
const NAME: usize = 200;

/// Faults of a script that are told one by one.
const DESCRIBED: usize = 200;

/// A file is written when nothing was changed for so long.
const REST: Duration = Duration::from_millis(400);

/// What a script begins with that is not there yet.
const STARTER: &str = include_str!("starter.txt");

/// Whether a file holds what is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Saved {
    /// It does.
    Yes,
    /// It soon will.
    Soon,
    /// Somebody else changed it, and so did the page.
    Conflict,
    /// It cannot be written.
    Failed,
}

/// A script and its file.
#[derive(Debug)]
pub struct Opened {
    /// How it is called: its file name.
    pub name: String,
    path: PathBuf,
    /// Its lines.
    pub document: Document,
    /// What the lines mean; what they meant last, where they have an error now.
    pub script: Option<Arc<Script>>,
    /// What is wrong with them.
    pub diagnostics: Vec<Diagnostic>,
    /// What the file held when it was last read or written; `None` if it was not there.
    on_disk: Option<Vec<u8>>,
    changed: Option<Instant>,
    saved: Saved,
    /// Why it could not be written last.
    failure: String,
    /// What was worked out of the lines, as long as they stay: the frame that was asked for last, with its index, and the numbers
    /// that change.
    frame: RefCell<Option<(usize, Arc<Frame>)>>,
    tracks: OnceCell<Tracks>,
}

/// All that is open.
#[derive(Debug)]
pub struct Project {
    /// How it is called: the folder's or the file's name.
    pub name: String,
    /// In their order in the animation; never empty.
    pub files: Vec<Opened>,
    /// What in the folder looks like a part of the animation and is not read.
    pub not_read: Vec<NotRead>,
    settings: Settings,
    /// The folder, where one was opened.
    folder: Option<PathBuf>,
}

/// A frame of the animation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Index of its file.
    pub file: usize,
    /// Index of its `Trace` in the file.
    pub frame: usize,
}

impl Project {
    /// Opens a folder of scripts, or one script; a script that is not there yet begins with an example.
    ///
    /// # Errors
    /// When a file cannot be read, the folder has no script, or its `animation.json` is none.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let name = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
        let name = name.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        let read = |source| Error::Read { path: path.to_path_buf(), source };
        let (mut paths, mut not_read) = (Vec::new(), Vec::new());
        if path.is_dir() {
            let listed = Folder::list(path).map_err(read)?;
            not_read = listed.not_read;
            for (_, path) in listed.scripts {
                let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
                paths.push((name, path));
            }
            if paths.is_empty() {
                return Err(Error::NoScripts { path: path.to_path_buf() });
            }
        } else {
            paths.push((name.clone(), path.to_path_buf()));
        }
        let mut room = TEXT;
        let files = paths
            .into_iter()
            .map(|(name, path)| {
                let file = Opened::open(name, path)?;
                room = room
                    .checked_sub(file.on_disk.as_ref().map_or(0, |text| text.len() as u64))
                    .ok_or_else(|| Error::TooLarge { path: file.path.clone(), limit: TEXT })?;
                Ok(file)
            })
            .collect::<Result<_, Error>>()?;
        let folder = path.is_dir().then(|| path.to_path_buf());
        let settings = Settings::open(folder.as_deref())?;
        Ok(Self { name, files, not_read, settings, folder })
    }

    /// What is said of the whole animation.
    pub fn settings(&self) -> AnimationSettings {
        self.settings.now()
    }

    /// Sets the frames a second, as a step of a file that can be undone.
    ///
    /// # Errors
    /// For a pace that an animation cannot have, and when `animation.json` cannot be written.
    pub fn set_fps(&mut self, file: usize, fps: f64) -> Result<(), Error> {
        let before = self.settings.now().fps();
        self.settings.set_fps(fps)?;
        if fps != before {
            self.files[file].document.frame_rate_changed(before);
        }
        Ok(())
    }

    /// Looks whether somebody else has written `animation.json`; whether another pace holds now.
    ///
    /// # Errors
    /// When it is none any more.
    pub fn look_at_settings(&mut self) -> Result<bool, Error> {
        self.settings.look()
    }

    /// Takes the last step of a file back, or makes it again; what was done to its lines.
    ///
    /// # Errors
    /// When it has changed the pace, and `animation.json` cannot be written.
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

    /// Whether scripts can be added: a folder was opened, and what was opened may be written.
    pub fn can_create(&self) -> bool {
        self.folder.is_some()
    }

    /// Adds a script to the folder, under a name that nothing has there; its index.
    ///
    /// # Errors
    /// Where no folder was opened, for a name that is none of a script, or taken, and when the file cannot be written.
    pub fn create(&mut self, name: &str, text: &[u8]) -> Result<usize, Error> {
        let refused = |problem| Error::Name { name: name.chars().take(80).collect(), problem };
        let Some(folder) = &self.folder else {
            return Err(refused("one script was opened, and nothing beside it may be written"));
        };
        let is_plain = script_name(name).is_some()
            && name.len() <= NAME
            && !name.chars().any(|c| c.is_control() || "/\\:".contains(c));
        if !is_plain {
            return Err(refused("expected a plain file name that ends with .txt"));
        }
        let held: usize = self.files.iter().filter_map(|file| file.on_disk.as_ref()).map(Vec::len).sum();
        let path = folder.join(name);
        if (held + text.len()) as u64 > TEXT {
            return Err(Error::TooLarge { path, limit: TEXT });
        }
        OutputFile::write_new(&path, text).map_err(|error| {
            if error.is_taken() { refused("there is such a file already") } else { error.into() }
        })?;
        let order = |name: &str, other: &str| {
            natural_cmp(script_name(name).unwrap_or(name), script_name(other).unwrap_or(other))
        };
        let at = self.files.partition_point(|file| order(&file.name, name).is_lt());
        self.files.insert(at, Opened::open(name.to_owned(), path)?);
        Ok(at)
    }

    /// How many frames can be shown: those of all files, and one for a file that has none.
    pub fn frame_count(&self) -> usize {
        self.files.iter().map(Opened::frame_count).sum()
    }

    /// Where a frame is, counted from 0; the last one beyond the end.
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

    /// The first frame of a file.
    pub fn first_frame(&self, file: usize) -> usize {
        self.files.iter().take(file).map(Opened::frame_count).sum()
    }

    /// Writes what has rested for a while, or at once if `now`; whether anything has changed that is shown.
    pub fn save(&mut self, now: bool) -> bool {
        let due = |changed: Instant| now || changed.elapsed() >= REST;
        let mut told = false;
        for file in &mut self.files {
            if file.changed.is_some_and(due) {
                told |= file.save();
            }
        }
        told
    }
}

impl Opened {
    fn open(name: String, path: PathBuf) -> Result<Self, Error> {
        // So that a link keeps pointing to what is written.
        let path = path.canonicalize().unwrap_or(path);
        let on_disk = read(&path)?;
        let text = on_disk.clone().unwrap_or_else(|| STARTER.into());
        let mut file = Self {
            name,
            path,
            document: Document::new(&text),
            script: None,
            diagnostics: Vec::new(),
            on_disk,
            changed: None,
            saved: Saved::Yes,
            failure: String::new(),
            frame: RefCell::default(),
            tracks: OnceCell::new(),
        };
        file.parse();
        Ok(file)
    }

    /// How many frames can be shown.
    pub fn frame_count(&self) -> usize {
        self.script.as_ref().map_or(1, |script| script.frame_count())
    }

    /// Whether the file holds what is shown.
    pub fn saved(&self) -> Saved {
        match self.saved {
            Saved::Yes if self.changed.is_some() => Saved::Soon,
            saved => saved,
        }
    }

    /// Whether its text can be rendered as it stands.
    pub fn is_sound(&self) -> bool {
        self.script.is_some() && !self.diagnostics.iter().any(Diagnostic::is_error)
    }

    /// Changes lines; what was done.
    pub fn apply(&mut self, splices: Vec<Splice>, gesture: Option<u64>) -> Vec<Splice> {
        let done = splices.into_iter().map(|splice| self.document.apply(splice, gesture)).collect();
        self.touched();
        done
    }

    /// Its text becomes another, as a step that can be undone; what was done to the lines.
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
        let parsed = parse(&self.name, &self.document.bytes(), &limits);
        self.diagnostics = parsed.diagnostics;
        if parsed.script.is_some() {
            self.script = parsed.script.map(Arc::new);
        }
        self.frame = RefCell::default();
        self.tracks = OnceCell::new();
    }

    /// A frame, counted from 0.
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

    /// The numbers that change.
    pub(crate) fn tracks(&self) -> &Tracks {
        self.tracks.get_or_init(|| tracks(self.document.lines()))
    }

    /// Looks whether somebody else has written the file: their text is taken over as a step that can be undone, unless
    /// there are changes that are not written yet, or the file has gone. What was done to the lines.
    pub fn look(&mut self) -> Option<Vec<Splice>> {
        let theirs = read(&self.path).ok()?;
        if theirs == self.on_disk {
            // It had gone, and is there again.
            let is_back = self.saved == Saved::Conflict && self.changed.is_none();
            self.saved = if is_back { Saved::Yes } else { self.saved };
            return is_back.then(Vec::new);
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

    /// Ends a conflict: with the text of the page, or with that of the file. What was done to the lines.
    pub fn resolve(&mut self, keep_mine: bool) -> Vec<Splice> {
        self.on_disk = read(&self.path).unwrap_or_default();
        self.saved = Saved::Yes;
        if keep_mine {
            self.changed = Some(Instant::now());
            return Vec::new();
        }
        let text = self.on_disk.clone().unwrap_or_default();
        self.take_over(&text)
    }

    /// The lines become those that the file holds.
    fn take_over(&mut self, text: &[u8]) -> Vec<Splice> {
        let done = self.become_text(text);
        (self.changed, self.saved) = (None, Saved::Yes);
        done
    }

    /// The lines become those of a text, by one splice of what differs.
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

    /// It could not be written, and will be tried again after a while.
    fn failed(&mut self, error: &Error) -> Saved {
        self.failure = words(error);
        self.changed = Some(Instant::now());
        Saved::Failed
    }

    /// Why it could not be written, as long as that is so.
    pub fn failure(&self) -> &str {
        if self.saved == Saved::Failed { &self.failure } else { "" }
    }

    /// Writes the file, if nobody else has; whether it stands otherwise than before.
    fn save(&mut self) -> bool {
        let before = self.saved();
        if self.saved == Saved::Conflict {
            return false;
        }
        let text = self.document.bytes();
        self.saved = match read(&self.path) {
            Ok(theirs) if theirs != self.on_disk => Saved::Conflict,
            Ok(theirs) if theirs.as_ref() == Some(&text) => {
                self.changed = None;
                Saved::Yes
            }
            Ok(_) => match OutputFile::write(&self.path, &text, true) {
                Ok(()) => {
                    (self.on_disk, self.changed) = (Some(text), None);
                    Saved::Yes
                }
                Err(error) => self.failed(&error.into()),
            },
            Err(error) => self.failed(&error),
        };
        before != self.saved()
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

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
        let told = project.files[0].look().unwrap();
        assert_eq!((told[0].at, told[0].removed, told[0].inserted.len()), (1, 1, 2));
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
        assert_eq!(project.files[0].look(), Some(Vec::new()), "the page is told of the conflict");
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
