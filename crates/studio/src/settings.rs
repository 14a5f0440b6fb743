//! `animation.json`: the frame rate of a folder's animation.
//!
//! Only the number of `fps` is changed; every other byte stays. The file is read before each change, so that changes
//! by other programs stay, too. A single script has no such file: its frame rate lasts as long as the program.

use std::sync::Arc;

use rayfold_scene::{AnimationSettings, SETTINGS_FILE, parse_settings};
use serde::Deserialize;
use serde_json::value::RawValue;

use crate::error::Error;
use crate::line::written;
use crate::storage::Storage;

/// The settings of the animation, and their file.
#[derive(Debug)]
pub(crate) struct Settings {
    /// The folder of the file; `None` for a single script.
    folder: Option<Arc<dyn Storage>>,
    /// The content of the file when it was last read or written; `None` if it did not exist.
    on_disk: Option<Vec<u8>>,
    now: AnimationSettings,
}

impl Settings {
    /// Reads the settings of a folder. A single script has the default settings.
    ///
    /// # Errors
    /// Fails if the file cannot be read or is invalid.
    pub(crate) fn open(folder: Option<Arc<dyn Storage>>) -> Result<Self, Error> {
        let on_disk = folder.as_deref().map(|folder| folder.read(SETTINGS_FILE)).transpose()?.flatten();
        let now = parsed(on_disk.as_deref())?;
        Ok(Self { folder, on_disk, now })
    }

    pub(crate) fn now(&self) -> AnimationSettings {
        self.now.clone()
    }

    /// Sets the frame rate. The rest of the file stays unchanged.
    ///
    /// # Errors
    /// Fails if an animation cannot have the frame rate, or if the file cannot be read or written.
    pub(crate) fn set_fps(&mut self, fps: f64) -> Result<(), Error> {
        let held = match &self.folder {
            Some(folder) => folder.read(SETTINGS_FILE)?,
            None => None,
        };
        let there = parsed(held.as_deref())?;
        let of = if self.folder.is_some() { there.clone() } else { self.now.clone() };
        let next = of.with_fps(fps).map_err(|error| Error::Output(error.to_string()))?;
        if let Some(folder) = &self.folder
            && next != there
        {
            let text = with_fps(held.as_deref().unwrap_or_default(), fps);
            folder.write(SETTINGS_FILE, &text)?;
            self.on_disk = Some(text);
        } else {
            self.on_disk = held;
        }
        self.now = next;
        Ok(())
    }

    /// Checks whether another program has written the file. Returns whether the settings have changed.
    ///
    /// # Errors
    /// Fails if the new file is invalid. The old settings stay in effect, and the error is reported once.
    pub(crate) fn look(&mut self) -> Result<bool, Error> {
        let Some(folder) = &self.folder else { return Ok(false) };
        // A file that cannot be read now is checked again later.
        let Ok(theirs) = folder.read(SETTINGS_FILE) else { return Ok(false) };
        if theirs == self.on_disk {
            return Ok(false);
        }
        self.on_disk = theirs;
        let before = self.now.clone();
        self.now = parsed(self.on_disk.as_deref())?;
        Ok(self.now != before)
    }
}

fn parsed(text: Option<&[u8]>) -> Result<AnimationSettings, Error> {
    let Some(text) = text else { return Ok(AnimationSettings::default()) };
    let parsed = parse_settings(SETTINGS_FILE, text);
    parsed.settings.ok_or_else(|| {
        let faults = parsed.diagnostics.iter().filter(|fault| fault.is_error());
        let faults: Vec<_> = faults.map(|fault| fault.render(false)).collect();
        Error::Settings(faults.join("\n"))
    })
}

/// The field of the settings that is changed here.
#[derive(Deserialize)]
struct Pace<'a> {
    #[serde(borrow)]
    fps: Option<&'a RawValue>,
}

/// Returns settings with another frame rate. The old settings must be valid or empty.
fn with_fps(bytes: &[u8], fps: f64) -> Vec<u8> {
    let number = written(fps);
    let whole = std::str::from_utf8(bytes).unwrap_or_default();
    let text = whole.strip_prefix('\u{feff}').unwrap_or(whole);
    let Ok(pace) = serde_json::from_str::<Pace<'_>>(text) else {
        return format!("{{\n  \"fps\": {number}\n}}\n").into();
    };
    let (at, removed, inserted) = match pace.fps {
        Some(value) => (value.get().as_ptr().addr() - whole.as_ptr().addr(), value.get().len(), number),
        None => {
            // After the bracket, with the whitespace of the next field.
            let open = text.find('{').unwrap_or_default() + 1;
            let rest = &text[open..];
            let blank = &rest[..rest.len() - rest.trim_start().len()];
            let comma = if rest.trim_start().starts_with('}') { "" } else { "," };
            let field = format!("{blank}\"fps\": {number}{comma}");
            (whole.len() - text.len() + open, 0, field)
        }
    };
    [&whole[..at], &inserted, &whole[at + removed..]].concat().into()
}

#[cfg(feature = "server")]
#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use super::*;
    use crate::disk::Disk;

    fn open(folder: &Path) -> Result<Settings, Error> {
        Settings::open(Some(Arc::new(Disk::new(folder))))
    }

    #[test]
    fn only_the_number_changes() {
        for (before, after) in [
            ("", "{\n  \"fps\": 24.5\n}\n"),
            ("{}", "{\"fps\": 24.5}"),
            ("\u{feff}{ \"fps\" :10 , \"loop\": 3}\r\n", "\u{feff}{ \"fps\" :24.5 , \"loop\": 3}\r\n"),
            (
                "{\n\t\"frames\": 10,\n\t\"loop\": 1\n}\n",
                "{\n\t\"fps\": 24.5,\n\t\"frames\": 10,\n\t\"loop\": 1\n}\n",
            ),
            ("{\"f\\u0070s\": 1e1}", "{\"f\\u0070s\": 24.5}"),
        ] {
            let text = String::from_utf8(with_fps(before.as_bytes(), 24.5)).unwrap();
            assert_eq!(text, after);
            let old = parse_settings("a", if before.is_empty() { b"{}" } else { before.as_bytes() });
            let new = parse_settings("a", text.as_bytes()).settings.unwrap();
            let old = old.settings.unwrap();
            assert_eq!((new.frames(), new.fps(), new.loops()), (old.frames(), 24.5, old.loops()));
        }
    }

    #[test]
    fn what_others_have_written_meanwhile_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(SETTINGS_FILE);
        let mut settings = open(folder.path()).unwrap();
        settings.set_fps(10.0).unwrap();
        assert!(!path.exists(), "what holds anyway is not written");
        settings.set_fps(20.0).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "{\n  \"fps\": 20\n}\n");
        fs::write(&path, "{\"loop\": 2}").unwrap();
        settings.set_fps(25.0).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "{\"fps\": 25,\"loop\": 2}");
        assert_eq!((settings.now().fps(), settings.now().loops()), (25.0, 2));
        assert!(!settings.look().unwrap());
        fs::write(&path, "{\"fps\": 50}").unwrap();
        assert!(settings.look().unwrap());
        assert_eq!(settings.now().fps(), 50.0);
        fs::write(&path, "{\"fps\": 0}").unwrap();
        assert!(settings.look().unwrap_err().to_string().contains("expected a number from 0.01 to 1000"));
        assert_eq!((settings.look().unwrap(), settings.now().fps()), (false, 50.0), "reported once");
        assert!(settings.set_fps(30.0).is_err());
        assert_eq!(fs::read_to_string(&path).unwrap(), "{\"fps\": 0}");
        assert!(matches!(open(folder.path()), Err(Error::Settings(_))));
    }

    #[test]
    fn one_script_has_a_pace_that_lasts_as_long_as_the_program() {
        let mut settings = Settings::open(None).unwrap();
        settings.set_fps(25.0).unwrap();
        assert_eq!(settings.now().fps(), 25.0);
        for bad in [0.0, -1.0, 1001.0, f64::NAN] {
            assert!(settings.set_fps(bad).is_err(), "{bad}");
        }
        assert_eq!(settings.now().fps(), 25.0);
    }
}
