//! Loading of whole texts: an example, an empty scene, a file chosen in the browser, a copy of the shown script. A
//! text replaces the shown one, as one step that can be undone, or becomes a new script of the folder.

use super::{Change, Session};
use crate::examples;
use crate::project::Project;
use crate::protocol::{ServerMessage, Source};

impl Session {
    /// Loads a text in place of the shown one, or into a new file of this name.
    pub(super) fn load(
        &mut self,
        project: &mut Project,
        from: Source,
        new: Option<&str>,
        tell: &mut ServerMessage,
    ) -> Change {
        let file = self.place(project).file;
        let text = match from {
            Source::Empty => Vec::new(),
            Source::Example { name } => match examples::text(&name) {
                Some(text) => text.into(),
                None => return Change::Nothing,
            },
            Source::Text { text } => text.into_bytes(),
            Source::Shown => project.files[file].document.bytes(),
        };
        self.held = None;
        match new {
            None => {
                let splices = project.files[file].replace(&text);
                self.keep_file(project);
                self.send_splices(splices, tell);
                self.select(project, Vec::new());
            }
            Some(name) => match project.create(name, &text) {
                Ok(file) => {
                    self.selection.clear();
                    (0..project.files.len()).for_each(|file| self.text_changed(file));
                    // Other files have other indices now, so the whole state is sent again.
                    self.shown_file = usize::MAX;
                    let first = project.first_frame(file);
                    self.show(project, first, tell);
                }
                Err(error) => {
                    tell.notice = Some(error.to_string());
                    return Change::Nothing;
                }
            },
        }
        tell.outline = Some(String::new());
        Change::Still
    }
}
