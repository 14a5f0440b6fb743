//! Models and pictures by name, and letters by their words, each made once.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::fmt;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use crate::decode::decode;
use crate::error::AssetError;
use crate::files::{FileInfo, Files, NoFiles};
use crate::letters::{Font, LetterError, Lettering, cut};
use crate::limits;
use crate::model::{Model, Smoothing};
use crate::picture::{self, Picture};
use crate::referred::{Referred, absent, content};

/// The models and pictures of a folder, and letters. One is made again only if its files have changed.
pub struct Library {
    files: Box<dyn Files>,
    models: Mutex<Models>,
    /// Wakes threads when a model has been made.
    made: Condvar,
    /// The files that faulty models refer to, by the names of the models.
    faulty: Mutex<BTreeMap<String, Vec<(String, String)>>>,
    pictures: Mutex<Vec<KeptPicture>>,
    letters: Mutex<Letters>,
}

/// The use of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// The levels of a surface, from 0 to 1.
    Surface,
    /// The light of a sky, which may be brighter.
    Sky,
}

/// A decoded picture, and its file as it was.
struct KeptPicture {
    name: String,
    info: FileInfo,
    picture: Arc<Picture>,
}

/// Letters that were made, and their fonts.
#[derive(Default)]
struct Letters {
    kept: Vec<KeptLetters>,
    /// Fonts, the latest last, by the names and states of their files.
    fonts: Vec<(Option<(String, FileInfo)>, Font)>,
}

/// A model of letters, and the state of their font's file; `None` as the model if no letter has an outline.
struct KeptLetters {
    lettering: Lettering,
    info: Option<FileInfo>,
    model: Option<Arc<Model>>,
}

/// The most fonts that are kept, and models of letters.
const FONTS: usize = 4;
const LETTERINGS: usize = 1024;

/// The models that were made, and the names of those that threads are making.
#[derive(Default)]
struct Models {
    kept: Vec<Kept>,
    making: Vec<String>,
}

thread_local! {
    /// The number of models that this thread is making.
    static MAKING: Cell<usize> = const { Cell::new(0) };
}

/// Marks a model as being made, until it is dropped.
struct Making<'a> {
    library: &'a Library,
    name: &'a str,
}

impl Drop for Making<'_> {
    fn drop(&mut self) {
        MAKING.set(MAKING.get() - 1);
        let mut models = self.library.models.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(at) = models.making.iter().position(|name| name == self.name) {
            models.making.swap_remove(at);
        }
        self.library.made.notify_all();
    }
}

/// A decoded model, and the files that it was made of.
#[derive(Clone)]
struct Kept {
    name: String,
    smoothing: Smoothing,
    sources: Sources,
    model: Arc<Model>,
}

/// The files that a model was made of.
#[derive(Clone)]
struct Sources {
    /// The names and paths of the model and of the files that it refers to.
    named: Vec<(String, String)>,
    /// All files that were looked for, as they were, in the order of the looks. A comparison in another order could look
    /// for files that the model no longer refers to.
    looked: Vec<(String, Option<FileInfo>)>,
}

impl Library {
    /// Makes the library of some files.
    pub fn new(files: impl Files + 'static) -> Self {
        Self {
            files: Box::new(files),
            models: Mutex::default(),
            made: Condvar::new(),
            faulty: Mutex::default(),
            pictures: Mutex::default(),
            letters: Mutex::default(),
        }
    }

    /// Makes a library for callers that read no files: every model and picture is an error that says so.
    pub fn none() -> Self {
        Self::new(NoFiles)
    }

    /// Returns the model in the file of this name.
    ///
    /// # Errors
    /// If the file is absent, or is no model.
    pub fn model(&self, name: &str, smoothing: Smoothing) -> Result<Arc<Model>, AssetError> {
        if !self.files.are_readable() {
            return Err(AssetError::NotHere { name: name.into() });
        }
        let mut models = self.made(name);
        models.kept.retain(|kept| kept.name != name || self.is_current(&kept.sources));
        if let Some(kept) = models.find(name, smoothing) {
            return Ok(kept.model.clone());
        }
        let of_file = models.find(name, Smoothing::OfFile).cloned();
        models.making.push(name.into());
        MAKING.set(MAKING.get() + 1);
        // Nothing is locked meanwhile: several models are read at the same time, each by several threads.
        drop(models);
        let making = Making { library: self, name };
        let of_file = match of_file {
            Some(of_file) => of_file,
            None => {
                let (model, sources) = self.decode(name)?;
                Kept { name: name.into(), smoothing: Smoothing::OfFile, sources, model: Arc::new(model) }
            }
        };
        let made = match smoothing {
            Smoothing::OfFile => of_file.clone(),
            _ => Kept { smoothing, model: Arc::new(of_file.model.with(smoothing)), ..of_file.clone() },
        };
        let mut models = self.models.lock().unwrap_or_else(PoisonError::into_inner);
        for made in [of_file, made.clone()] {
            if models.find(name, made.smoothing).is_none() {
                models.kept.push(made);
            }
        }
        // Another call may have made it meanwhile: all have the same one.
        let model = models.find(name, smoothing).map_or(made.model, |kept| kept.model.clone());
        forget_unused(&mut models.kept);
        drop((models, making));
        Ok(model)
    }

    /// Waits until no other thread is making the model of this name, then locks the models. A thread that makes a model
    /// itself does not wait: while others work for it, it may take up work that needs another model, and two threads
    /// would wait for each other.
    fn made(&self, name: &str) -> MutexGuard<'_, Models> {
        let models = self.models.lock().unwrap_or_else(PoisonError::into_inner);
        let waits = |models: &mut Models| MAKING.get() == 0 && models.making.iter().any(|of| of == name);
        self.made.wait_while(models, waits).unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the picture in the file of this name.
    ///
    /// # Errors
    /// If the file is absent, or is no picture for this purpose.
    pub fn picture(&self, name: &str, purpose: Purpose) -> Result<Arc<Picture>, AssetError> {
        if !self.files.are_readable() {
            return Err(AssetError::NotHere { name: name.into() });
        }
        let mut kept = self.pictures.lock().unwrap_or_else(PoisonError::into_inner);
        let info = self.look(name)?;
        kept.retain(|kept| kept.name != name || Some(kept.info) == info);
        let info = info.ok_or_else(|| absent(&*self.files, name))?;
        let known = kept.iter().find(|kept| kept.name == name).map(|kept| kept.picture.clone());
        let picture = match known {
            Some(picture) => picture,
            None => {
                let picture = Arc::new(picture::decode(name, &content(&*self.files, name)?)?);
                kept.push(KeptPicture { name: name.into(), info, picture: picture.clone() });
                picture
            }
        };
        forget_unused(&mut kept);
        if purpose == Purpose::Surface && picture.is_light() {
            return Err(AssetError::Light { name: name.into() });
        }
        Ok(picture)
    }

    /// Returns letters cut out of a plate, or `None` if none has an outline.
    ///
    /// # Errors
    /// If a letter cannot be drawn, or there is no such font.
    pub fn letters(&self, lettering: &Lettering) -> Result<Option<Arc<Model>>, LetterError> {
        let info = match &lettering.font {
            None => None,
            Some(name) if !self.files.are_readable() => {
                return Err(AssetError::NotHere { name: name.clone() }.into());
            }
            Some(name) => Some(self.look(name)?.ok_or_else(|| absent(&*self.files, name))?),
        };
        let mut letters = self.letters.lock().unwrap_or_else(PoisonError::into_inner);
        let known = letters.kept.iter().find(|kept| kept.lettering == *lettering && kept.info == info);
        if let Some(known) = known {
            return Ok(known.model.clone());
        }
        let font = self.font(&mut letters, lettering.font.as_deref().zip(info))?;
        let model = cut(lettering, &font)?.map(Arc::new);
        letters.kept.push(KeptLetters { lettering: lettering.clone(), info, model: model.clone() });
        forget_unused_letters(&mut letters.kept);
        Ok(model)
    }

    fn font(&self, letters: &mut Letters, file: Option<(&str, FileInfo)>) -> Result<Font, AssetError> {
        let key = file.map(|(name, info)| (name.to_string(), info));
        if let Some((_, font)) = letters.fonts.iter().find(|(of, _)| *of == key) {
            return Ok(font.clone());
        }
        let font = match file {
            None => Font::built_in().map_err(|fault| fault.of_font("NotoSans-Bold.ttf"))?,
            Some((name, _)) => {
                Font::read(content(&*self.files, name)?).map_err(|fault| fault.of_font(name))?
            }
        };
        if letters.fonts.len() >= FONTS {
            letters.fonts.remove(0);
        }
        letters.fonts.push((key, font.clone()));
        Ok(font)
    }

    /// Returns the names of the files that a model was made of, or lacks, with their paths in the model: the model's
    /// own first, then those to which it refers. For a faulty model these are the files to which it refers before the
    /// fault. There are none for a model that no caller has requested.
    pub fn sources(&self, name: &str) -> Vec<(String, String)> {
        let models = self.made(name);
        match models.kept.iter().find(|kept| kept.name == name) {
            Some(kept) => kept.sources.named.clone(),
            None => {
                let faulty = self.faulty.lock().unwrap_or_else(PoisonError::into_inner);
                faulty.get(name).cloned().unwrap_or_default()
            }
        }
    }

    /// Drops the model and the picture of this name, as far as no script uses them. For files that are gone for good.
    pub fn forget(&self, name: &str) {
        self.made(name).kept.retain(|kept| kept.name != name);
        self.faulty.lock().unwrap_or_else(PoisonError::into_inner).remove(name);
        self.pictures.lock().unwrap_or_else(PoisonError::into_inner).retain(|kept| kept.name != name);
    }

    fn decode(&self, name: &str) -> Result<(Model, Sources), AssetError> {
        let info = self.look(name)?.ok_or_else(|| absent(&*self.files, name))?;
        let bytes = content(&*self.files, name)?;
        let picture = |name: &str| self.picture(name, Purpose::Surface);
        let mut referred = Referred::with_pictures(&*self.files, &picture);
        let model = decode(name, &bytes, &mut referred);
        let mut named = vec![(name.to_string(), name.to_string())];
        named.extend(referred.sources().map(|(name, path)| (name.into(), path.into())));
        let mut looked = vec![(name.to_string(), Some(info))];
        looked.extend(referred.looked());
        let mut faulty = self.faulty.lock().unwrap_or_else(PoisonError::into_inner);
        faulty.remove(name);
        match model {
            Ok(model) => Ok((model, Sources { named, looked })),
            Err(error) => {
                faulty.insert(name.into(), named);
                Err(error)
            }
        }
    }

    fn look(&self, name: &str) -> Result<Option<FileInfo>, AssetError> {
        self.files.look(name).map_err(|why| AssetError::Unreadable { name: name.into(), why })
    }

    fn is_current(&self, sources: &Sources) -> bool {
        sources.looked.iter().all(|(name, info)| self.files.look(name) == Ok(*info))
    }
}

impl Models {
    fn find(&self, name: &str, smoothing: Smoothing) -> Option<&Kept> {
        self.kept.iter().find(|kept| kept.name == name && kept.smoothing == smoothing)
    }
}

impl fmt::Debug for Library {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Library").finish_non_exhaustive()
    }
}

/// A thing that is kept while it is used, and a while longer.
trait Keepable {
    fn bytes(&self) -> usize;
    fn is_used(&self) -> bool;
}

impl Keepable for Kept {
    fn bytes(&self) -> usize {
        self.model.bytes()
    }

    fn is_used(&self) -> bool {
        Arc::strong_count(&self.model) > 1
    }
}

impl Keepable for KeptPicture {
    fn bytes(&self) -> usize {
        self.picture.bytes()
    }

    fn is_used(&self) -> bool {
        Arc::strong_count(&self.picture) > 1
    }
}

/// Drops the oldest things that no one uses, until the others are within the bound.
fn forget_unused(kept: &mut Vec<impl Keepable>) {
    let mut bytes: usize = kept.iter().map(Keepable::bytes).sum();
    kept.retain(|kept| {
        let is_dropped = bytes > limits::KEPT_BYTES && !kept.is_used();
        if is_dropped {
            bytes -= kept.bytes();
        }
        !is_dropped
    });
}

/// Drops the oldest letters, until the others are within the bounds. Those that a script uses stay in its memory.
fn forget_unused_letters(kept: &mut Vec<KeptLetters>) {
    let bytes_of = |kept: &KeptLetters| kept.model.as_ref().map_or(0, |model| model.bytes());
    let (mut bytes, mut count) = (kept.iter().map(bytes_of).sum::<usize>(), kept.len());
    kept.retain(|kept| {
        let is_dropped = bytes > limits::KEPT_BYTES / 2 || count > LETTERINGS;
        if is_dropped {
            bytes -= bytes_of(kept);
            count -= 1;
        }
        !is_dropped
    });
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;
    use crate::files::MemoryFiles;

    const CORNER: &[u8] = b"mtllib c.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n";

    /// Counts how often a file is read.
    struct Counted(Arc<Mutex<MemoryFiles>>, Arc<AtomicUsize>);

    impl Files for Counted {
        fn names(&self) -> Vec<String> {
            self.0.lock().unwrap().names()
        }

        fn look(&self, name: &str) -> Result<Option<FileInfo>, String> {
            self.0.lock().unwrap().look(name)
        }

        fn read(&self, name: &str) -> Result<Vec<u8>, String> {
            self.1.fetch_add(1, Ordering::Relaxed);
            self.0.lock().unwrap().read(name)
        }
    }

    #[test]
    fn a_model_is_decoded_once_until_one_of_its_files_changes() {
        let files = Arc::new(Mutex::new(MemoryFiles::from([("c.obj", CORNER.to_vec())])));
        let reads = Arc::new(AtomicUsize::new(0));
        let library = Library::new(Counted(files.clone(), reads.clone()));
        let first = library.model("c.obj", Smoothing::OfFile).unwrap();
        assert!(Arc::ptr_eq(&first, &library.model("c.obj", Smoothing::OfFile).unwrap()));
        assert_eq!(library.model("c.obj", Smoothing::Within(30.0)).unwrap().triangle_count(), 1);
        assert_eq!(reads.load(Ordering::Relaxed), 1);
        assert_eq!(first.look_color(first.look(0), true), glam::DVec3::splat(0.8), "the library is absent");
        assert_eq!(first.warnings().len(), 1);
        files.lock().unwrap().insert("c.mtl", b"newmtl red\nKd 1 0 0\n".to_vec());
        let second = library.model("c.obj", Smoothing::OfFile).unwrap();
        assert_eq!(second.look_color(second.look(0), true), glam::DVec3::X);
        assert_eq!(reads.load(Ordering::Relaxed), 3);
        let names: Vec<_> = library.sources("c.obj").into_iter().map(|(name, _)| name).collect();
        assert_eq!(names, ["c.obj", "c.mtl"]);
    }

    /// Waits until another model is being read, so that both are read at the same time.
    struct Meeting(MemoryFiles, std::sync::Barrier, AtomicUsize);

    impl Files for Meeting {
        fn names(&self) -> Vec<String> {
            self.0.names()
        }

        fn look(&self, name: &str) -> Result<Option<FileInfo>, String> {
            self.0.look(name)
        }

        fn read(&self, name: &str) -> Result<Vec<u8>, String> {
            assert!(self.2.fetch_add(1, Ordering::Relaxed) < 2, "each model is read once");
            self.1.wait();
            self.0.read(name)
        }
    }

    #[test]
    fn several_models_are_read_at_the_same_time_and_each_once() {
        let plain = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".to_vec();
        let files = MemoryFiles::from([("a.obj", plain.clone()), ("b.obj", plain)]);
        let library = Library::new(Meeting(files, std::sync::Barrier::new(2), AtomicUsize::new(0)));
        let read = |name| library.model(name, Smoothing::OfFile).unwrap();
        let read = &read;
        let models: Vec<_> = std::thread::scope(|scope| {
            let names = ["a.obj", "b.obj", "a.obj", "b.obj"];
            let threads = names.map(|name| scope.spawn(move || read(name)));
            threads.into_iter().map(|thread| thread.join().unwrap()).collect()
        });
        assert!(Arc::ptr_eq(&models[0], &models[2]) && Arc::ptr_eq(&models[1], &models[3]));
    }

    #[test]
    fn what_is_forgotten_is_freed_and_decoded_anew() {
        let files = Arc::new(Mutex::new(MemoryFiles::from([("c.obj", CORNER.to_vec())])));
        let reads = Arc::new(AtomicUsize::new(0));
        let library = Library::new(Counted(files, reads.clone()));
        let model = Arc::downgrade(&library.model("c.obj", Smoothing::Flat).unwrap());
        library.forget("other.obj");
        assert!(model.upgrade().is_some());
        library.forget("c.obj");
        assert!(model.upgrade().is_none());
        assert_eq!(library.model("c.obj", Smoothing::Flat).unwrap().triangle_count(), 1);
        assert_eq!(reads.load(Ordering::Relaxed), 2);
    }

    #[test]
    fn a_name_in_other_letter_case_is_found_for_the_message() {
        let library = Library::new(MemoryFiles::from([("Corner.OBJ", CORNER.to_vec())]));
        let error = library.model("corner.obj", Smoothing::Flat).unwrap_err();
        assert_eq!(error.help().unwrap(), "there is `Corner.OBJ`: names are compared byte for byte");
        let library = Library::new(MemoryFiles::from([("u\u{308}.obj", CORNER.to_vec())]));
        let error = library.model("\u{fc}.obj", Smoothing::Flat).unwrap_err();
        let help = "there is `u\u{308}.obj`, whose letters are in another Unicode normal form: names are compared byte for byte";
        assert_eq!(error.help().unwrap(), help);
        let error = Library::none().model("corner.obj", Smoothing::Flat).unwrap_err();
        assert!(error.to_string().contains("files are not read here"), "{error}");
    }
}
