//! The parameters of a line that depend on more than its command: those of a material's clauses, and names.

use rayfold_scene::{Command, Names, Quotes, Subject, quoted_word};

use super::Session;
use crate::clauses::{self, Offers};
use crate::edits::set;
use crate::line::Line;
use crate::materials;
use crate::project::Project;
use crate::protocol::ServerMessage;
use crate::tables::{FieldTable, command_fields};

impl Session {
    /// Returns the parameters of a line; none if they are those of its command's table.
    pub(super) fn own_fields(&self, project: &Project, at: usize) -> Vec<FieldTable> {
        let lines = self.file_lines(project);
        let Some((line, command)) = lines.get(at).and_then(|line| Some((line, line.command()?))) else {
            return Vec::new();
        };
        let file = &project.files[self.place(project).file];
        if command == Command::Material {
            let offers =
                Offers { materials: materials::plain_names(lines, at), pictures: file.surface_pictures() };
            return clauses::fields(line, &offers);
        }
        let quoted = |names: Vec<String>| names.iter().map(|name| quoted_word(name)).collect();
        let (label, names) = match command.form().subject {
            Some(Subject::Quotes(Quotes::File)) if command == Command::Mesh => {
                ("model", quoted(file.models()))
            }
            Some(Subject::Quotes(Quotes::File)) => ("picture", quoted(file.pictures())),
            Some(Subject::Refers(Names::Groups)) => ("group", groups(&lines[..at])),
            _ => return Vec::new(),
        };
        let mut fields = vec![FieldTable::of_names(label, subject_number(command), names)];
        fields.extend(command_fields(command));
        fields
    }

    /// Sets a word of a line to one of those that its parameter offers.
    pub(super) fn set_word(
        &mut self,
        project: &mut Project,
        at: usize,
        number: usize,
        word: &str,
        tell: &mut ServerMessage,
    ) {
        let own = self.own_fields(project, at);
        let Some((line, command)) = self.line(project, at).and_then(|line| Some((line, line.command()?)))
        else {
            return;
        };
        let fields = if own.is_empty() { command_fields(command) } else { own };
        let is_offered =
            fields.iter().any(|field| field.first == number && field.words.iter().any(|of| of == word));
        let to = match command {
            Command::Material => clauses::with_word(line, &fields, number, word),
            _ if !is_offered => None,
            _ if number == subject_number(command) => line.with_subject(word),
            _ => line.with_words(&[(number, word.to_owned())]),
        };
        self.edit(project, to.map(|to| set(at, to)).into_iter().collect(), None, tell);
    }
}

/// Returns the name to which a line refers before its numbers, with the index that stands for it.
pub(super) fn subject_word(line: &Line) -> Option<(usize, String)> {
    let command = line.command()?;
    let refers = matches!(command.form().subject, Some(Subject::Refers(_) | Subject::Quotes(Quotes::File)));
    refers.then(|| Some((subject_number(command), line.subject()?.to_owned())))?
}

/// Returns the index that stands for the name before the numbers: it follows those of all numbers.
fn subject_number(command: Command) -> usize {
    command.form().numbers().count()
}

/// Returns the groups that are completely defined by some lines.
fn groups(lines: &[Line]) -> Vec<String> {
    let end = lines.iter().rposition(|line| line.command() == Some(Command::End)).unwrap_or(0);
    let starts = lines[..end].iter().filter(|line| line.command() == Some(Command::Group));
    starts.filter_map(|line| line.subject().map(str::to_owned)).collect()
}
