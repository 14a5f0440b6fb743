//! The materials of an OBJ: the lines that name them, and the MTL files that define them.

use glam::DVec3;

use super::Reader;
use super::lines::{Lines, numbers, rest_of, words};
use crate::error::{Fault, shortened};
use crate::limits;
use crate::model::Look;
use crate::referred::Referred;
use crate::text::{unmarked, with_line_feeds};
use crate::texture::Texture;

/// A picture that a material names: the library of materials, the line in it, and the path.
pub(super) struct Map {
    library: String,
    line: usize,
    path: String,
}

/// The options of a map.
const OPTIONS: [&[u8]; 13] = [
    b"-blendu",
    b"-blendv",
    b"-boost",
    b"-bm",
    b"-cc",
    b"-clamp",
    b"-colorspace",
    b"-imfchan",
    b"-mm",
    b"-o",
    b"-s",
    b"-t",
    b"-texres",
];

impl Reader {
    pub(super) fn material_line(
        &mut self,
        line: usize,
        text: &[u8],
        refer: &mut Referred<'_>,
    ) -> Result<(), Fault> {
        if words(text).next() == Some(b"mtllib") {
            return self.materials(line, text, refer);
        }
        let name = rest_of(text, b"usemtl").into_bytes();
        let next = self.parts.looks.len() as u32;
        self.look = *self.names.entry(name).or_insert(next);
        if self.look == next {
            // Without its file it has no colour; a file that comes later gives it one.
            self.parts.looks.push(Look::PLAIN);
            bounded_looks(line, self.parts.looks.len())?;
        }
        Ok(())
    }

    /// Reads the libraries of materials that a line names, each once.
    fn materials(&mut self, line: usize, text: &[u8], refer: &mut Referred<'_>) -> Result<(), Fault> {
        for name in libraries(line, text, refer)? {
            if !self.libraries.insert(name.clone()) {
                continue;
            }
            match refer.read(&name)? {
                Some(bytes) => self.read_materials(&name, &bytes, refer)?,
                None => {
                    self.lacks_library = true;
                    let warning = refer.absence(&name, "what has its materials is grey");
                    self.parts.warnings.push(warning);
                }
            }
        }
        Ok(())
    }

    /// Sets the pictures of the looks that faces use. A look whose picture is missing gets the neutral colour.
    pub(super) fn paint(&mut self, refer: &mut Referred<'_>) -> Result<(), Fault> {
        let mut is_used = vec![false; self.parts.looks.len()];
        self.parts.look_of.iter().for_each(|look| is_used[*look as usize] = true);
        self.warn_of_undefined(&is_used);
        for number in (0..self.parts.looks.len() as u32).filter(|look| is_used[*look as usize]) {
            let Some(Map { library, line, path }) = self.pictures.get(&number) else {
                let is_named = number > 0 && !self.defined.contains(&number);
                self.parts.looks[number as usize].is_missing = self.lacks_library && is_named;
                continue;
            };
            let look = &mut self.parts.looks[number as usize];
            match refer
                .picture(path)
                .map_err(|fault| within(library, Fault { line: Some(*line), ..fault }))?
            {
                Some(picture) => look.texture = Some(Texture::new(picture)),
                None => {
                    look.is_missing = true;
                    let warning = refer.absence(path, "what has this picture is grey");
                    if !self.parts.warnings.contains(&warning) {
                        self.parts.warnings.push(warning);
                    }
                }
            }
        }
        Ok(())
    }

    /// Names the materials of faces that no library has.
    fn warn_of_undefined(&mut self, is_used: &[bool]) {
        if self.lacks_library || self.defined.is_empty() {
            return;
        }
        let is_undefined = |look: u32| is_used[look as usize] && !self.defined.contains(&look);
        let undefined = self.names.iter().filter(|(_, look)| is_undefined(**look));
        let mut names: Vec<_> =
            undefined.map(|(name, look)| (*look, String::from_utf8_lossy(name))).collect();
        names.sort_unstable();
        let shown: Vec<_> =
            names.iter().take(NAMED).map(|(_, name)| format!("`{}`", shortened(name))).collect();
        let list = shown.join(", ");
        let warning = match (names.len(), names.len() - shown.len()) {
            (0, _) => return,
            (1, _) => format!("no library has the material {list}: what has it is grey"),
            (_, 0) => format!("no library has the materials {list}: what has them is grey"),
            (_, more) => {
                format!("no library has the materials {list} and {more} more: what has them is grey")
            }
        };
        self.parts.warnings.push(warning);
    }

    fn read_materials(&mut self, file: &str, bytes: &[u8], refer: &mut Referred<'_>) -> Result<(), Fault> {
        let within = |fault: Fault| within(file, fault);
        let mut look: Option<u32> = None;
        let rest = with_line_feeds(unmarked(bytes));
        for (line, text) in (Lines { rest: &rest, number: 0 }) {
            let mut words = words(&text);
            match words.next() {
                Some(b"newmtl") => {
                    let name = rest_of(&text, b"newmtl").into_bytes();
                    let next = self.parts.looks.len() as u32;
                    let place = *self.names.entry(name).or_insert(next);
                    if place == next {
                        self.parts.looks.push(Look::PLAIN);
                        bounded_looks(line, self.parts.looks.len()).map_err(within)?;
                    }
                    self.defined.insert(place);
                    look = Some(place);
                }
                Some(b"Kd") => {
                    if words.clone().next().is_some_and(|word| matches!(word, b"spectral" | b"xyz")) {
                        return Err(within(Fault::at(line, "`Kd` is not red, green and blue")));
                    }
                    // One number alone is that of all channels.
                    let ([r, g, b], count) = numbers::<3>(line, words, 1).map_err(within)?;
                    let color = if count == 1 { DVec3::splat(r) } else { DVec3::new(r, g, b) };
                    if let Some(look) = look {
                        self.parts.looks[look as usize].factor = Some(color);
                    }
                }
                // Some programs write it in small letters.
                Some(word) if word.eq_ignore_ascii_case(b"map_Kd") => {
                    let path = rest_of(&text, b"map_Kd");
                    if path.is_empty() {
                        self.parts
                            .warnings
                            .push(format!("line {line} of `{file}`: `map_Kd` names no picture"));
                        continue;
                    }
                    let begins = words.clone().next().is_some_and(|word| word.len() > 1 && word[0] == b'-');
                    let has_option = words.any(|word| OPTIONS.contains(&word));
                    if begins || has_option && !refer.exists(&path).map_err(within)? {
                        return Err(within(Fault::at(
                            line,
                            "an option of `map_Kd`: expected a file name alone",
                        )));
                    }
                    if let Some(look) = look {
                        self.pictures.insert(look, Map { library: file.into(), line, path });
                    }
                }
                _ => {}
            }
        }
        Ok(())
    }
}

/// The most materials that a warning names.
const NAMED: usize = 5;

/// Returns the paths of the libraries in a line. The rest of the line is one path, if there is such a file. Otherwise
/// each of its words is a path. Its words are also the paths if each of them is a file and the last part of the whole
/// is only the last of them.
fn libraries(line: usize, text: &[u8], refer: &mut Referred<'_>) -> Result<Vec<String>, Fault> {
    let rest = rest_of(text, b"mtllib");
    let words: Vec<String> = rest.split_whitespace().map(Into::into).collect();
    if words.len() > limits::FILES {
        return Err(Fault::at(line, format!("{} libraries of materials", words.len())));
    }
    let mut there = 0;
    for word in &words {
        there += usize::from(refer.exists(word)?);
    }
    let is_path = rest.contains(['/', '\\']);
    let is_whole = refer.exists(&rest)? && !(is_path && there == words.len());
    if words.len() < 2 || is_whole {
        return Ok(if rest.is_empty() { vec![] } else { vec![rest] });
    }
    // What is not there may come later, under any of these names.
    let (used, other) = if there > 0 { (words, vec![rest]) } else { (vec![rest], words) };
    for name in other.iter().filter(|_| !is_path) {
        refer.note(name)?;
    }
    Ok(used)
}

/// Returns a fault of a library of materials.
fn within(library: &str, fault: Fault) -> Fault {
    Fault::new(match fault.line {
        Some(line) => format!("in `{library}`, line {line}: {}", fault.what),
        None => format!("in `{library}`: {}", fault.what),
    })
}

/// The largest number of materials of a model.
const LOOKS: usize = 1 << 20;

fn bounded_looks(line: usize, count: usize) -> Result<(), Fault> {
    if count > LOOKS {
        return Err(Fault::at(line, format!("more than {LOOKS} materials")));
    }
    Ok(())
}
