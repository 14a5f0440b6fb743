//! The text of the page's editor, which sends each of its changes.
//!
//! A change applies to one version of a text. The version changes with every other change of the text: a drag, undo,
//! another program. The page then adapts the changes that it has sent meanwhile, and sends them again. So no typed text
//! is lost, and both sides have the changes in the same order.

use super::{Change, Session, TEXT};
use crate::project::Project;
use crate::protocol::{ServerMessage, TextState};
use crate::text_edit::{self, TextChange};

impl Session {
    /// Changes the text of a file, unless the changes are those of another version.
    pub(super) fn edit_text(
        &mut self,
        project: &mut Project,
        file: usize,
        version: u32,
        changes: &[TextChange],
        tell: &mut ServerMessage,
    ) -> Change {
        let size: usize = changes.iter().flat_map(|change| &change.lines).map(String::len).sum();
        let is_known = file < project.files.len() && version == self.version_of(file) && size <= TEXT;
        tell.accepted = Some(is_known);
        if !is_known {
            return Change::Nothing;
        }
        let line = match changes {
            [only] if only.removed == 1 && only.lines.len() == 1 => Some(only.at),
            _ => None,
        };
        // What is typed in a line is one step.
        let gesture = match self.typing {
            Some((typed, gesture)) if Some(typed) == line => gesture,
            _ => self.next_gesture(),
        };
        self.typing = line.map(|line| (line, gesture));
        let Some(splices) = project.files[file].edit_text(changes, gesture) else {
            // The page gets the text that is here.
            tell.accepted = Some(false);
            self.text_changed(file);
            tell.lines = (file == self.shown_file).then(|| self.lines(project));
            return Change::Still;
        };
        self.keep_file(project);
        self.follow(file, splices, tell);
        if file == self.shown_file { Change::Still } else { Change::Nothing }
    }

    /// Records that a text has changed other than in the page's editor.
    pub(super) fn text_changed(&mut self, file: usize) {
        self.version = self.version.wrapping_add(1);
        self.versions.insert(file, self.version);
    }

    fn version_of(&self, file: usize) -> u32 {
        self.versions.get(&file).copied().unwrap_or(0)
    }

    /// Returns the version of the shown text.
    pub(super) fn text_state(&self, project: &Project) -> TextState {
        let file = self.shown_file;
        TextState {
            file,
            version: self.version_of(file),
            ends: text_edit::ends(project.files[file].document.lines()),
        }
    }
}
