//! What the user named as INPUT, as a list of scripts.
//!
//! A folder stands for its scripts (`*.txt`) in natural order and for the settings beside them; a file is a script
//! whatever its name; `-` is a script on standard input. Reading and parsing are apart from listing, so that many or
//! large scripts need not be in memory at once.

use std::borrow::Cow;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::Context;
use rayfold_scene::{Limits, Parsed, SETTINGS_FILE, natural_cmp, script_name};

use crate::outcome::Usage;

/// Scripts in the order of their frames.
#[derive(Debug)]
pub(crate) struct Input {
    /// At least one.
    pub(crate) scripts: Vec<ScriptFile>,
    /// Where a folder's settings lie, if it has any.
    pub(crate) settings: Option<PathBuf>,
}

/// A script that can be read, also more than once.
#[derive(Clone, Debug)]
pub(crate) struct ScriptFile {
    /// As messages name it.
    pub(crate) name: String,
    place: Place,
}

#[derive(Clone, Debug)]
enum Place {
    File(PathBuf),
    /// Standard input gives its text only once.
    Read(Arc<[u8]>),
}

impl Input {
    /// Of an animation: one folder, or scripts.
    ///
    /// # Errors
    /// When something is not there or not readable, a folder holds no script, or folders are mixed with others.
    pub(crate) fn animation(inputs: &[PathBuf], limits: &Limits) -> anyhow::Result<Self> {
        if inputs.iter().filter(|input| is_stdin(input)).count() > 1 {
            return Err(Usage("standard input (-) can be read only once".into()).into());
        }
        if let ([_, _, ..], Some(folder)) = (inputs, inputs.iter().find(|input| input.is_dir())) {
            return Err(Usage(format!(
                "{} is a folder, which is an animation by itself: give it alone, or give script files",
                folder.display()
            ))
            .into());
        }
        let mut parts = Self::each(inputs, limits).collect::<anyhow::Result<Vec<_>>>()?;
        let settings = parts.first_mut().and_then(|part| part.settings.take());
        Ok(Self { scripts: parts.into_iter().flat_map(|part| part.scripts).collect(), settings })
    }

    /// Every input by itself; an error in place of one that is a folder which cannot be listed or holds no script.
    pub(crate) fn each(inputs: &[PathBuf], limits: &Limits) -> impl Iterator<Item = anyhow::Result<Self>> {
        inputs.iter().map(|input| Self::one(input, limits))
    }

    fn one(input: &Path, limits: &Limits) -> anyhow::Result<Self> {
        if is_stdin(input) {
            let mut text = Vec::new();
            read_limited(std::io::stdin().lock(), &mut text, limits).context("cannot read standard input")?;
            let script = ScriptFile { name: "<stdin>".into(), place: Place::Read(text.into()) };
            return Ok(Self { scripts: vec![script], settings: None });
        }
        if !input.is_dir() {
            // One that is not there is found out when it is read, together with the faults of the others.
            return Ok(Self { scripts: vec![ScriptFile::at(input.to_path_buf())], settings: None });
        }
        folder(input)
    }
}

impl ScriptFile {
    fn at(path: PathBuf) -> Self {
        Self { name: path.display().to_string(), place: Place::File(path) }
    }

    /// Its file; standard input has none.
    pub(crate) fn path(&self) -> Option<&Path> {
        match &self.place {
            Place::File(path) => Some(path),
            Place::Read(_) => None,
        }
    }

    /// Its text, cut off just beyond the size limit.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub(crate) fn read(&self, limits: &Limits) -> anyhow::Result<Cow<'_, [u8]>> {
        match &self.place {
            Place::Read(text) => Ok(Cow::Borrowed(text)),
            Place::File(path) => {
                let mut text = Vec::new();
                File::open(path)
                    .and_then(|file| read_limited(file, &mut text, limits))
                    .with_context(|| format!("cannot read {}", self.name))?;
                Ok(Cow::Owned(text))
            }
        }
    }

    /// What it says, and all that is wrong with it.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub(crate) fn parse(&self, limits: &Limits) -> anyhow::Result<Parsed> {
        Ok(rayfold_scene::parse(&self.name, &self.read(limits)?, limits))
    }
}

/// One byte more than the limit is enough for the parser to refuse the text.
fn read_limited(from: impl Read, into: &mut Vec<u8>, limits: &Limits) -> std::io::Result<()> {
    from.take(limits.max_script_bytes as u64 + 1).read_to_end(into).map(drop)
}

/// It is `-`, which is no file.
pub(crate) fn is_stdin(input: &Path) -> bool {
    input.as_os_str() == "-"
}

/// By its name, something in a folder is a script or the settings.
pub(crate) fn is_part_of_animation(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name == SETTINGS_FILE || name.ends_with(".txt")
}

fn folder(path: &Path) -> anyhow::Result<Input> {
    let shown = path.display();
    let cannot_list = || format!("cannot list the folder {shown}");
    let mut scripts = Vec::new();
    let mut settings = None;
    let mut empty = true;
    for entry in std::fs::read_dir(path).with_context(cannot_list)? {
        let entry = entry.with_context(cannot_list)?;
        empty = false;
        let path = entry.path();
        let name = entry.file_name().to_string_lossy().into_owned();
        if name == SETTINGS_FILE {
            settings = Some(path);
        } else if is_part_of_animation(&path) && !path.is_dir() {
            scripts.push((name, ScriptFile::at(path)));
        }
    }
    if empty {
        anyhow::bail!("the folder {shown} is empty: expected scene scripts (*.txt)");
    }
    if scripts.is_empty() {
        anyhow::bail!("the folder {shown} holds no scene scripts (*.txt)");
    }
    scripts.sort_by(|(a, _), (b, _)| natural_cmp(script_name(a).unwrap_or(a), script_name(b).unwrap_or(b)));
    Ok(Input { scripts: scripts.into_iter().map(|(_, script)| script).collect(), settings })
}
