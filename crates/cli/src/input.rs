//! The INPUT that the user named, as a list of scripts.
//!
//! A folder stands for its scripts (`*.txt`) in natural order, and for the settings beside them. A file is a script
//! whatever its name, and `-` is a script on standard input. Listing is separate from reading and parsing, so that many
//! or large scripts need not be in memory at once.

use std::borrow::Cow;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::Context;
use rayfold_files::{Folder, NotRead, library_beside};
use rayfold_scene::{Limits, Name, Parsed, parse_with_files};

use crate::interrupt;
use crate::outcome::Usage;

/// Scripts in the order of their frames.
#[derive(Debug, Default)]
pub(crate) struct Input {
    /// The scripts, at least one, in the order of the frames.
    pub(crate) scripts: Vec<ScriptFile>,
    /// The path of a folder's settings, if it has any.
    pub(crate) settings: Option<PathBuf>,
    /// The files in a folder that look like a part of the animation but are not read.
    pub(crate) not_read: Vec<NotRead>,
}

/// A script that can be read, even more than once.
#[derive(Clone, Debug)]
pub(crate) struct ScriptFile {
    /// The name of the script in messages.
    pub(crate) name: String,
    place: Place,
}

#[derive(Clone, Debug)]
enum Place {
    File(PathBuf),
    /// Standard input, which gives its text only once.
    Read(Arc<[u8]>),
}

impl Input {
    /// The files that are read.
    pub(crate) fn files(&self) -> impl Iterator<Item = &Path> {
        self.scripts.iter().filter_map(ScriptFile::path).chain(self.settings.as_deref())
    }

    /// Lists the scripts of an animation: of one folder, or the named ones.
    ///
    /// # Errors
    /// Fails if a path does not exist or cannot be read, a folder holds no script, or folders are mixed with files.
    pub(crate) fn animation(inputs: &[PathBuf], limits: &Limits) -> anyhow::Result<Self> {
        stdin_once(inputs)?;
        if let ([_, _, ..], Some(folder)) = (inputs, inputs.iter().find(|input| input.is_dir())) {
            return Err(Usage(format!(
                "{} is a folder, which is an animation by itself: give it alone, or give script files",
                folder.display()
            ))
            .into());
        }
        let mut parts = Self::each(inputs, limits).collect::<anyhow::Result<Vec<_>>>()?;
        if let [only] = &mut parts[..] {
            return Ok(std::mem::take(only));
        }
        Ok(Self::of(parts.into_iter().flat_map(|part| part.scripts).collect()))
    }

    /// Lists every input by itself. A folder that cannot be listed or holds no script becomes an error in its place.
    pub(crate) fn each(inputs: &[PathBuf], limits: &Limits) -> impl Iterator<Item = anyhow::Result<Self>> {
        inputs.iter().map(|input| Self::one(input, limits))
    }

    fn of(scripts: Vec<ScriptFile>) -> Self {
        Self { scripts, ..Self::default() }
    }

    fn one(input: &Path, limits: &Limits) -> anyhow::Result<Self> {
        if is_stdin(input) {
            let text = read_patiently(|| Ok(std::io::stdin().lock()), limits)
                .context("cannot read standard input")?;
            let script = ScriptFile { name: "<stdin>".into(), place: Place::Read(text.into()) };
            return Ok(Self::of(vec![script]));
        }
        #[cfg(unix)]
        if is_nameless_pipe(input) {
            let name = input.display().to_string();
            let path = input.to_path_buf();
            let text =
                read_patiently(|| File::open(path), limits).with_context(|| format!("cannot read {name}"))?;
            return Ok(Self::of(vec![ScriptFile { name, place: Place::Read(text.into()) }]));
        }
        if !input.is_dir() {
            // One that is not there is found out when it is read, together with the faults of the others.
            return Ok(Self::of(vec![ScriptFile::at(input.to_path_buf())]));
        }
        folder(input)
    }
}

impl ScriptFile {
    fn at(path: PathBuf) -> Self {
        Self { name: path.display().to_string(), place: Place::File(path) }
    }

    /// Returns its file; standard input has none.
    pub(crate) fn path(&self) -> Option<&Path> {
        match &self.place {
            Place::File(path) => Some(path),
            Place::Read(_) => None,
        }
    }

    /// Reads its text, cut off just beyond the size limit.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub(crate) fn read(&self, limits: &Limits) -> anyhow::Result<Cow<'_, [u8]>> {
        match &self.place {
            Place::Read(text) => Ok(Cow::Borrowed(text)),
            Place::File(path) => {
                let mut text = Vec::new();
                rayfold_files::open(path)
                    .and_then(|file| read_limited(file, &mut text, limits))
                    .with_context(|| format!("cannot read {}", self.name))?;
                Ok(Cow::Owned(text))
            }
        }
    }

    /// Returns the parsed script, with all its faults.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub(crate) fn parse(&self, limits: &Limits) -> anyhow::Result<Parsed> {
        // The script on standard input has its files in the working directory.
        let library = library_beside(self.path().unwrap_or(Path::new("")));
        Ok(parse_with_files(&self.name, &self.read(limits)?, limits, &library))
    }
}

/// One byte more than the limit, so that the parser refuses the text.
fn read_limited(from: impl Read, into: &mut Vec<u8>, limits: &Limits) -> std::io::Result<()> {
    from.take(limits.max_script_bytes as u64 + 1).read_to_end(into).map(drop)
}

/// # Errors
/// Fails if standard input is named twice, because the second reading would find nothing.
pub(crate) fn stdin_once(inputs: &[PathBuf]) -> Result<(), Usage> {
    match inputs.iter().filter(|input| is_stdin(input)).count() {
        0 | 1 => Ok(()),
        _ => Err(Usage("standard input (-) can be read only once".into())),
    }
}

/// Reads the output of another program or the input of a user. Returns early if a signal asks to stop.
fn read_patiently<R: Read>(
    open: impl FnOnce() -> std::io::Result<R> + Send + 'static,
    limits: &Limits,
) -> anyhow::Result<Vec<u8>> {
    let limits = *limits;
    let text = interrupt::wait_for(move || {
        let mut text = Vec::new();
        open().and_then(|from| read_limited(from, &mut text, &limits)).map(|()| text)
    })?;
    Ok(text?)
}

/// A pipe that a shell made for this run, such as `<(generate)`: it is in no folder.
#[cfg(unix)]
fn is_nameless_pipe(input: &Path) -> bool {
    use std::os::unix::fs::FileTypeExt;
    let is_pipe = input.metadata().is_ok_and(|metadata| metadata.file_type().is_fifo());
    is_pipe && (input.starts_with("/dev/fd") || input.canonicalize().is_err())
}

/// # Errors
/// Fails if there is a file of this name.
pub(crate) fn must_be_new(output: &Path) -> anyhow::Result<()> {
    let is_there = output.symlink_metadata().is_ok();
    anyhow::ensure!(!is_there, "{} exists already, and --no-clobber keeps it", output.display());
    Ok(())
}

/// # Errors
/// Fails if the output file is one of the files that are read.
pub(crate) fn must_not_replace<'a>(
    output: &Path,
    mut inputs: impl Iterator<Item = &'a Path>,
) -> Result<(), Usage> {
    let Ok(place) = output.canonicalize() else { return Ok(()) };
    match inputs.find(|input| input.canonicalize().is_ok_and(|input| input == place)) {
        None => Ok(()),
        Some(input) if input == output => {
            Err(Usage(format!("{} would replace its input: expected another output", output.display())))
        }
        Some(input) => Err(Usage(format!(
            "{} would replace the input {}: expected another output",
            output.display(),
            input.display()
        ))),
    }
}

/// The path is `-`, which is no file.
pub(crate) fn is_stdin(input: &Path) -> bool {
    input.as_os_str() == "-"
}

/// A file in a folder is a script or the settings because of its name.
pub(crate) fn is_part_of_animation(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    matches!(Name::of(&name), Name::Script(_) | Name::Settings)
}

fn folder(path: &Path) -> anyhow::Result<Input> {
    let shown = path.display();
    let Folder { scripts, settings, not_read, is_empty } =
        Folder::list(path).with_context(|| format!("cannot list the folder {shown}"))?;
    if is_empty {
        anyhow::bail!("the folder {shown} is empty: expected scene scripts (*.txt)");
    }
    if scripts.is_empty() {
        let near = not_read.first().map(|not| format!("; {}: {not}", not.path.display())).unwrap_or_default();
        anyhow::bail!("the folder {shown} holds no scene scripts (*.txt){near}");
    }
    let scripts = scripts.into_iter().map(|(_, path)| ScriptFile::at(path)).collect();
    Ok(Input { scripts, settings, not_read })
}
