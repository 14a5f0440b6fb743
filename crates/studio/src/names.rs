//! Names: of materials and groups, which lines refer to, and of objects, which are the comments at the ends of lines.

use rayfold_scene::{Clause, Command, Quotes, Subject, quoted_word};

use crate::document::Splice;
use crate::edits::set;
use crate::line::Line;

/// Renames a line. A material or a group gets its new name in every line that names it.
///
/// # Errors
/// Returns the reason if a material or a group cannot have the name.
pub(crate) fn rename(lines: &[Line], at: usize, name: &str) -> Result<Vec<Splice>, String> {
    let Some(line) = lines.get(at) else { return Ok(Vec::new()) };
    let command = line.command().filter(|command| matches!(command, Command::Material | Command::Group));
    let (Some(command), Some(old)) = (command, line.subject().filter(|old| !old.is_empty())) else {
        return Ok(line.named(name).map(|line| set(at, line)).into_iter().collect());
    };
    let name = name.trim();
    if name == old {
        return Ok(Vec::new());
    }
    let kind = command.name().to_lowercase();
    if !is_name(name) || Clause::from_name(name).is_some() {
        return Err(format!("A {kind} is named by a letter, then letters, digits, `-` and `_`."));
    }
    let defines = |line: &Line| line.command() == Some(command) && line.subject() == Some(name);
    if lines.iter().any(defines) {
        return Err(format!("There is a {kind} `{name}` already."));
    }
    let renamed = lines.iter().enumerate().filter_map(|(at, line)| {
        let to = if command == Command::Group { group(line, old, name) } else { material(line, old, name) };
        Some(set(at, to?))
    });
    Ok(renamed.collect())
}

/// Sets the words of a text. A line without words stays as it is.
pub(crate) fn set_words(lines: &[Line], at: usize, text: &str) -> Option<Splice> {
    let line = lines.get(at)?;
    let has_words = line.command()?.form().subject == Some(Subject::Quotes(Quotes::Words));
    // What a text field may hold and a script may not.
    let text: String = text.chars().filter(|c| !c.is_control() || *c == '\n').collect();
    has_words.then(|| Some(set(at, line.with_subject(&quoted_word(&text))?)))?
}

/// Returns a line that refers to a group, or begins it, with its new name.
fn group(line: &Line, old: &str, name: &str) -> Option<Line> {
    let refers = matches!(line.command()?, Command::Group | Command::Use) && line.subject()? == old;
    refers.then(|| line.with_subject(name))?
}

/// Returns a line that refers to a material, or defines it, with its new name.
fn material(line: &Line, old: &str, name: &str) -> Option<Line> {
    let (command, words) = (line.command()?, line.words()?);
    let is_old = |at: usize| words.parameters.get(at).is_some_and(|word| line.word(word) == old);
    if command != Command::Material {
        let at = command.form().surface()?;
        let refers = words.parameters.len() == at + 1 && is_old(at);
        return refers.then(|| line.with_words(&[(at, name.to_owned())]))?;
    }
    let changes: Vec<_> =
        (0..words.parameters.len()).filter(|&at| is_old(at)).map(|at| (at, name.to_owned())).collect();
    let defines = line.subject() == Some(old);
    if changes.is_empty() && !defines {
        return None;
    }
    let line = line.with_words(&changes)?;
    if defines { line.with_subject(name) } else { Some(line) }
}

/// Returns whether a material or a group can have this name.
pub(crate) fn is_name(word: &str) -> bool {
    word.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
        && word.bytes().all(|byte| byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'-'))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::Document;

    const TEXT: &str = "Material dark diffuse .1 .1 .1\r\nMaterial tile  checker .4 dark diffuse 1 1 1 # dark\n\
                        Sphere 1  0 0 0  dark # dark\nGroup dark\nSphere 1  0 0 0  tile\nEnd\nUse dark  1 2 3\nTrace";

    fn after(at: usize, name: &str) -> Result<String, String> {
        let mut document = Document::new(TEXT.as_bytes());
        for splice in rename(document.lines(), at, name)? {
            document.apply(splice, None);
        }
        Ok(String::from_utf8(document.bytes()).unwrap())
    }

    #[test]
    fn the_words_of_a_text_are_set() {
        let lines = Line::split(b"Text \"a\" 1 .2 right # sign\nSphere 1  0 0 0  1 1 1  0 0 0\n");
        let after = |at, text: &str| Some(set_words(&lines, at, text)?.inserted[0].text());
        let set = after(0, "b \"c\"\n\t\\ #");
        assert_eq!(set.as_deref(), Some(r##"Text "b \"c\"\n\\ #" 1 .2 right # sign"##));
        assert_eq!(after(1, "b"), None);
        assert_eq!(after(7, "b"), None);
    }

    #[test]
    fn a_material_and_a_group_are_renamed_wherever_they_are_named() {
        let expected = TEXT
            .replace("Material dark", "Material night")
            .replace(".4 dark", ".4 night")
            .replace("0  dark", "0  night");
        assert_eq!(after(0, " night "), Ok(expected));
        let expected = TEXT.replace("Group dark", "Group night").replace("Use dark", "Use night");
        assert_eq!(after(3, "night"), Ok(expected));
        assert_eq!(after(0, "dark"), Ok(TEXT.into()));
    }

    #[test]
    fn an_object_is_named_by_its_comment() {
        assert_eq!(after(2, "ball"), Ok(TEXT.replace("0  dark # dark", "0  dark # ball")));
    }

    #[test]
    fn names_that_are_taken_or_cannot_be_are_refused() {
        for (at, name, why) in [
            (0, "tile", "already"),
            (0, "a b", "letter"),
            (0, "", "letter"),
            (3, "1a", "letter"),
            (0, "diffuse", "letter"),
        ] {
            assert!(after(at, name).unwrap_err().contains(why), "{name}");
        }
    }
}
