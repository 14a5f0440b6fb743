//! Scenes and scripts back to text.
//!
//! What is written reads back as the same script, every number bit for bit. It is not the text that was read:
//! comments, spelling, and what no frame sees are gone.
//!
//! ```
//! let text = "Screen 4 3\nSphere 1 0 0 -5 .1 .1 .1 1 1 1\nTrace\nTrace";
//! let script = rayfold_scene::parse("a.txt", text.as_bytes(), &Default::default()).script.unwrap();
//! let again = rayfold_scene::parse("b.txt", script.to_string().as_bytes(), &Default::default()).script;
//! assert_eq!(again, Some(script));
//! ```

use std::fmt::{self, Display, Formatter};

use crate::command::Command;
use crate::form::write_line;
use crate::model::{Background, Camera, Scene};
use crate::script::{Frame, Script, View};

/// As a script: each frame as what changed since the one before, and a `Trace`.
impl Display for Script {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let mut last: Option<(&View, &Frame)> = None;
        for (view, frame) in self.parts() {
            let (mut old_view, mut objects, mut lights) = (None, frame.objects.clone(), frame.lights.clone());
            let mut background = Background::default();
            if let Some((v, seen)) = last {
                old_view = Some(v);
                if seen.objects.start == objects.start && seen.lights.start == lights.start {
                    background = v.background;
                    objects.start = seen.objects.end;
                    lights.start = seen.lights.end;
                } else {
                    write_name(f, Command::Clear)?;
                }
            }
            if old_view.map(|v| v.screen) != Some(view.screen) {
                write_line(f, &view.screen)?;
            }
            if old_view.map_or(Camera::default(), |v| v.camera) != view.camera {
                view.camera.write(f)?;
            }
            if background != view.background {
                write_line(f, &view.background)?;
            }
            self.lights()[lights].iter().try_for_each(|light| light.write(f))?;
            self.objects()[objects].iter().try_for_each(|object| object.write(f))?;
            write_name(f, Command::Trace)?;
            last = Some((view, frame));
        }
        Ok(())
    }
}

/// As a script of one frame.
impl Display for Scene {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write_line(f, &self.screen)?;
        self.camera.write(f)?;
        if self.background != Background::default() {
            write_line(f, &self.background)?;
        }
        self.lights.iter().try_for_each(|light| light.write(f))?;
        self.objects.iter().try_for_each(|object| object.write(f))?;
        write_name(f, Command::Trace)
    }
}

/// A line of a command without parameters.
fn write_name(f: &mut Formatter<'_>, command: Command) -> fmt::Result {
    writeln!(f, "{}", command.name())
}
