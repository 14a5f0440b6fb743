//! Wavefront OBJ, and the colours and pictures of its MTL files.
//!
//! A long text is cut into chunks at ends of lines, which are read side by side. The lines of each chunk are counted first, so that
//! indices and the lines of faults are the same for any number of chunks. What a line about materials means depends on
//! all such lines before it: these are kept, and read in order after the chunks.

use std::collections::{HashMap, HashSet};

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

use crate::error::Fault;
use crate::limits;
use crate::model::{Colors, Look, NONE, Parts, too_many_triangles, unit};
use crate::referred::Referred;
use crate::texture::Texture;

/// A line of the text, with those that a backslash joins to it: its number and its words.
struct Lines<'a> {
    rest: &'a [u8],
    number: usize,
}

impl<'a> Iterator for Lines<'a> {
    type Item = (usize, std::borrow::Cow<'a, [u8]>);

    fn next(&mut self) -> Option<Self::Item> {
        if self.rest.is_empty() {
            return None;
        }
        let first = self.number + 1;
        let mut whole: Option<Vec<u8>> = None;
        loop {
            self.number += 1;
            let (line, rest) = match memchr::memchr(b'\n', self.rest) {
                Some(end) => (&self.rest[..end], &self.rest[end + 1..]),
                None => (self.rest, &[][..]),
            };
            self.rest = rest;
            let line = line.strip_suffix(b"\r").unwrap_or(line);
            let (line, goes_on) = match line.strip_suffix(b"\\") {
                Some(line) => (line, !rest.is_empty()),
                None => (line, false),
            };
            match &mut whole {
                None if !goes_on => return Some((first, line.into())),
                None => whole = Some([line, b" "].concat()),
                Some(whole) => {
                    whole.extend_from_slice(line);
                    whole.push(b' ');
                }
            }
            if !goes_on {
                return whole.map(|whole| (first, whole.into()));
            }
        }
    }
}

fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> + Clone {
    line.split(|b| matches!(b, b' ' | b'\t')).filter(|word| !word.is_empty())
}

/// Returns the text of a line after its first word, without blanks around it.
fn rest_of(line: &[u8], word: &[u8]) -> String {
    let is_word = |window: &[u8]| window.eq_ignore_ascii_case(word);
    let at = line.windows(word.len()).position(is_word).unwrap_or_default() + word.len();
    String::from_utf8_lossy(&line[at..]).trim().to_string()
}

fn number(word: &[u8]) -> Option<f64> {
    if let Some(number) = short_number(word) {
        return Some(number);
    }
    let text = std::str::from_utf8(word).ok()?;
    text.parse().ok().filter(|x: &f64| x.is_finite())
}

/// Returns the number of a word of a sign, digits and a point, if they are few. The digits and the power of ten are then exact,
/// so that the quotient is rounded once, to the number that the word is nearest to (Clinger, 1990).
fn short_number(word: &[u8]) -> Option<f64> {
    const POWERS: [f64; 16] =
        [1., 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];
    let (is_negative, digits) = match word {
        [b'-', digits @ ..] => (true, digits),
        digits => (false, digits),
    };
    let (mut whole, mut point) = (0u64, None);
    if !(1..=16).contains(&digits.len()) {
        return None;
    }
    for (at, byte) in digits.iter().enumerate() {
        match byte.wrapping_sub(b'0') {
            digit @ 0..=9 => whole = 10 * whole + u64::from(digit),
            _ if *byte == b'.' && point.is_none() && digits.len() > 1 => point = Some(at),
            _ => return None,
        }
    }
    let places = point.map_or(0, |at| digits.len() - 1 - at);
    // Sixteen digits may be more than a number holds.
    let number = (whole < 1 << 53).then(|| whole as f64 / POWERS[places])?;
    Some(if is_negative { -number } else { number })
}

/// Reads numbers, at most `N`. Returns how many there are.
fn numbers<'a, const N: usize>(
    line: usize,
    words: impl Iterator<Item = &'a [u8]>,
    least: usize,
) -> Result<([f64; N], usize), Fault> {
    let (mut all, mut count) = ([0.0; N], 0);
    for word in words {
        let Some(place) = all.get_mut(count) else { break };
        *place = number(word).ok_or_else(|| {
            Fault::at(line, format!("`{}` is not a finite number", String::from_utf8_lossy(word)))
        })?;
        count += 1;
    }
    if count < least {
        return Err(Fault::at(line, format!("{count} of {least} numbers")));
    }
    Ok((all, count))
}

/// Returns the place of an index among `count` items. Indices count from 1, negative ones from the last item back.
fn place(line: usize, index: i64, count: usize, what: &str) -> Result<u32, Fault> {
    let place = if index < 0 { index + count as i64 } else { index - 1 };
    match u32::try_from(place) {
        Ok(place) if index != 0 && (place as usize) < count => Ok(place),
        _ => Err(Fault::at(line, format!("{what} {index} of {count}"))),
    }
}

fn index(line: usize, text: &[u8]) -> Result<i64, Fault> {
    let (digits, sign) = match text {
        [b'-', digits @ ..] => (digits, -1),
        digits => (digits, 1),
    };
    let (mut number, mut is_number) = (0u32, (1..=9).contains(&digits.len()));
    for byte in digits.iter().take(9) {
        let digit = byte.wrapping_sub(b'0');
        is_number &= digit < 10;
        number = number.wrapping_mul(10).wrapping_add(u32::from(digit));
    }
    if !is_number {
        return Err(Fault::at(line, format!("`{}` is no index", String::from_utf8_lossy(text))));
    }
    Ok(sign * i64::from(number))
}

/// Returns a word up to a slash, and what is behind it.
fn field(word: &[u8]) -> (&[u8], &[u8]) {
    match word.iter().position(|b| *b == b'/') {
        Some(end) => (&word[..end], &word[end + 1..]),
        None => (word, &[]),
    }
}

/// A picture that a material names: the library of materials, the line in it, and the path.
struct Map {
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

/// The counts of what stands before a place in the text.
#[derive(Clone, Copy, Default)]
struct Counts {
    lines: usize,
    positions: usize,
    uvs: usize,
    normals: usize,
}

impl Counts {
    /// Counts the lines of a text, and those that add to the lists to which indices refer.
    fn of(text: &[u8]) -> Self {
        let mut counts = Self::default();
        let mut lines = Lines { rest: text, number: 0 };
        for (_, line) in lines.by_ref() {
            match words(&line).next() {
                Some(b"v") => counts.positions += 1,
                Some(b"vt") => counts.uvs += 1,
                Some(b"vn") => counts.normals += 1,
                _ => {}
            }
        }
        counts.lines = lines.number;
        counts
    }

    fn plus(self, other: Self) -> Self {
        Self {
            lines: self.lines + other.lines,
            positions: self.positions + other.positions,
            uvs: self.uvs + other.uvs,
            normals: self.normals + other.normals,
        }
    }
}

/// A line that gives the faces after it another material, or reads a library of materials.
struct MaterialLine {
    /// The number of triangles of its chunk before it.
    triangles: usize,
    number: usize,
    text: Vec<u8>,
}

/// Whole lines of the text, and what they hold up to the first fault.
#[derive(Default)]
struct Chunk {
    before: Counts,
    positions: Vec<DVec3>,
    /// Empty, or one for each position.
    colors: Vec<Vec3>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    /// Both empty, or one for each triangle.
    uv_of: Vec<[u32; 3]>,
    normal_of: Vec<[u32; 3]>,
    material_lines: Vec<MaterialLine>,
    lacks_uvs: bool,
    left_out: Vec<&'static str>,
    fault: Option<Fault>,
}

#[derive(Default)]
struct Reader {
    parts: Parts,
    names: HashMap<Vec<u8>, u32>,
    /// The pictures of looks.
    pictures: HashMap<u32, Map>,
    /// The looks that a library of materials defines, and whether a library is missing.
    defined: HashSet<u32>,
    lacks_library: bool,
    /// The look of the latest line, and the number of triangles that have one.
    look: u32,
    triangles: usize,
}

/// The least length of a chunk in bytes, if there is more than one.
const CHUNK: usize = 1 << 18;

/// The number of chunks for each thread, so that none waits long for another.
const CHUNKS_OF_ONE: usize = 4;

/// Reads an OBJ file. `refer` returns the content of files that it refers to.
pub(crate) fn read(bytes: &[u8], refer: &mut Referred<'_>) -> Result<Parts, Fault> {
    let most = match rayon::current_num_threads() {
        1 => 1,
        threads => CHUNKS_OF_ONE * threads,
    };
    read_in(bytes, most.min(bytes.len() / CHUNK), refer)
}

/// Reads an OBJ file in so many chunks, or fewer.
fn read_in(bytes: &[u8], chunks: usize, refer: &mut Referred<'_>) -> Result<Parts, Fault> {
    let texts = cut(bytes, chunks);
    let counts: Vec<Counts> = match &texts[..] {
        [_] => vec![Counts::default()],
        texts => texts.par_iter().map(|text| Counts::of(text)).collect(),
    };
    let mut before = Counts::default();
    let befores = counts.into_iter().map(|own| {
        let after = before.plus(own);
        std::mem::replace(&mut before, after)
    });
    let begun: Vec<_> = texts.iter().zip(befores).collect();
    // All chunks together may hold twice as many triangles as a model.
    let most = if texts.len() == 1 { limits::TRIANGLES } else { 2 * limits::TRIANGLES / texts.len() };
    let read = begun.into_par_iter().map(|(text, before)| Chunk::read(text, before, most));
    let read: Vec<Chunk> = read.collect();
    if texts.len() > 1 && read.iter().any(|chunk| chunk.triangles.len() > most) {
        return read_in(bytes, 1, refer);
    }
    let mut reader =
        Reader { parts: Parts { space: Colors::Levels, ..Parts::default() }, ..Reader::default() };
    reader.parts.looks.push(Look::PLAIN);
    let lacks_uvs = read.iter().any(|chunk| chunk.lacks_uvs);
    let mut left_out: Vec<&str> = Vec::new();
    read.iter().flat_map(|chunk| &chunk.left_out).for_each(|what| add_once(&mut left_out, what));
    reader.join(read, refer)?;
    reader.paint(refer)?;
    let mut parts = reader.parts;
    if parts.uv_of.is_empty() {
        if parts.looks.iter().any(|look| look.texture.is_some()) {
            parts.warnings.push("its pictures are seen at (0, 0): it has no texture coordinates".into());
        }
    } else if lacks_uvs {
        parts.warnings.push("corners without texture coordinates have (0, 0)".into());
    }
    if !left_out.is_empty() {
        parts.warnings.push(format!("{} are left out", left_out.join(", ")));
    }
    Ok(parts)
}

/// Cuts a text at ends of lines into pieces of about the same length, at least one.
fn cut(text: &[u8], count: usize) -> Vec<&[u8]> {
    let mut pieces = Vec::new();
    let mut from = 0;
    for piece in 1..count {
        let mut at = from.max(text.len() / count * piece);
        while let Some(end) = memchr::memchr(b'\n', &text[at..]) {
            let line = &text[from..at + end];
            at += end + 1;
            // A backslash joins the next line.
            if !line.strip_suffix(b"\r").unwrap_or(line).ends_with(b"\\") {
                pieces.push(&text[from..at]);
                from = at;
                break;
            }
        }
    }
    pieces.push(&text[from..]);
    pieces
}

fn add_once(all: &mut Vec<&'static str>, what: &'static str) {
    if !all.contains(&what) {
        all.push(what);
    }
}

impl Chunk {
    /// Reads a text up to its first fault, or until it has more than `most` triangles.
    fn read(text: &[u8], before: Counts, most: usize) -> Self {
        let mut chunk = Self { before, ..Self::default() };
        for (number, line) in (Lines { rest: text, number: before.lines }) {
            if let Err(fault) = chunk.line(number, &line, most) {
                chunk.fault = Some(fault);
                break;
            }
        }
        chunk
    }

    fn line(&mut self, line: usize, text: &[u8], most: usize) -> Result<(), Fault> {
        let mut words = words(text);
        match words.next() {
            Some(b"v") => {
                let ([x, y, z, r, g, b], count) = numbers::<6>(line, words, 3)?;
                self.positions.push(DVec3::new(x, y, z));
                let color = if count == 6 { DVec3::new(r, g, b).as_vec3() } else { Vec3::ONE };
                push_late(&mut self.colors, self.positions.len(), color, (Vec3::ONE, count < 6));
                bounded(line, self.before.positions + self.positions.len(), "positions")?;
            }
            Some(b"vn") => {
                let ([x, y, z], _) = numbers::<3>(line, words, 3)?;
                self.normals.push(unit(DVec3::new(x, y, z).normalize_or_zero().as_vec3()));
                bounded(line, self.before.normals + self.normals.len(), "normals")?;
            }
            Some(b"vt") => {
                let ([u, v], _) = numbers::<2>(line, words, 1)?;
                self.uvs.push(Vec2::new(u as f32, v as f32));
                bounded(line, self.before.uvs + self.uvs.len(), "texture coordinates")?;
            }
            Some(b"f") => self.face(line, words, most)?,
            Some(b"usemtl" | b"mtllib") => {
                let triangles = self.triangles.len();
                self.material_lines.push(MaterialLine { triangles, number: line, text: text.to_vec() });
            }
            Some(b"p") => add_once(&mut self.left_out, "points"),
            Some(b"l") => add_once(&mut self.left_out, "lines"),
            Some(b"curv" | b"curv2" | b"surf") => {
                add_once(&mut self.left_out, "curves and free-form surfaces");
            }
            _ => {}
        }
        Ok(())
    }

    /// Adds a polygon as a fan from its first corner.
    fn face<'a>(
        &mut self,
        line: usize,
        words: impl Iterator<Item = &'a [u8]>,
        most: usize,
    ) -> Result<(), Fault> {
        let positions = self.before.positions + self.positions.len();
        let uvs = self.before.uvs + self.uvs.len();
        let normals = self.before.normals + self.normals.len();
        let (mut first, mut last, mut count) = (None, None, 0);
        for word in words {
            let (of_position, rest) = field(word);
            let (of_uv, rest) = field(rest);
            let position = place(line, index(line, of_position)?, positions, "position")?;
            let optional = |field: &[u8], count: usize, what: &str| match field {
                b"" => Ok(NONE),
                field => place(line, index(line, field)?, count, what),
            };
            let uv = optional(of_uv, uvs, "texture coordinate")?;
            let normal = optional(rest, normals, "normal")?;
            self.lacks_uvs |= uv == NONE;
            let corner = [position, uv, normal];
            count += 1;
            if let (Some(first), Some(last)) = (first, last) {
                let of = |k: usize| [first, last, corner].map(|c: [u32; 3]| c[k]);
                self.triangles.push(of(0));
                let count = self.triangles.len();
                push_late(&mut self.uv_of, count, of(1), ([NONE; 3], of(1) == [NONE; 3]));
                push_late(&mut self.normal_of, count, of(2), ([NONE; 3], of(2) == [NONE; 3]));
                if count > most {
                    return Err(too_many_triangles());
                }
            }
            if first.is_none() {
                first = Some(corner);
            } else {
                last = Some(corner);
            }
        }
        if count < 3 {
            return Err(Fault::at(line, format!("a face of {count} corners")));
        }
        Ok(())
    }
}

impl Reader {
    /// Joins chunks in order, up to the first fault.
    fn join(&mut self, mut chunks: Vec<Chunk>, refer: &mut Referred<'_>) -> Result<(), Fault> {
        for chunk in &mut chunks {
            let before = self.triangles;
            for MaterialLine { triangles, number, text } in chunk.material_lines.drain(..) {
                self.look_up_to(before + triangles)?;
                self.material_line(number, &text, refer)?;
            }
            self.look_up_to(before + chunk.triangles.len())?;
            if let Some(fault) = chunk.fault.take() {
                return Err(fault);
            }
        }
        let positions = taken(&mut chunks, |chunk| &mut chunk.positions);
        let colors = taken(&mut chunks, |chunk| &mut chunk.colors);
        let uvs = taken(&mut chunks, |chunk| &mut chunk.uvs);
        let normals = taken(&mut chunks, |chunk| &mut chunk.normals);
        let triangles = taken(&mut chunks, |chunk| &mut chunk.triangles);
        let uv_of = taken(&mut chunks, |chunk| &mut chunk.uv_of);
        let normal_of = taken(&mut chunks, |chunk| &mut chunk.normal_of);
        let parts = &mut self.parts;
        parts.colors = joined_late(colors, &positions, Vec3::ONE);
        parts.uv_of = joined_late(uv_of, &triangles, [NONE; 3]);
        parts.normal_of = joined_late(normal_of, &triangles, [NONE; 3]);
        (parts.uvs, parts.normals) = (joined(uvs), joined(normals));
        (parts.positions, parts.triangles) = rayon::join(|| joined(positions), || joined(triangles));
        Ok(())
    }

    /// Gives the look of the latest line to the triangles before this number that have none yet.
    fn look_up_to(&mut self, count: usize) -> Result<(), Fault> {
        if count > limits::TRIANGLES {
            return Err(too_many_triangles());
        }
        let look_of = &mut self.parts.look_of;
        if count > self.triangles && (self.look > 0 || !look_of.is_empty()) {
            look_of.resize(self.triangles, 0);
            look_of.resize(count, self.look);
        }
        self.triangles = count;
        Ok(())
    }

    fn material_line(&mut self, line: usize, text: &[u8], refer: &mut Referred<'_>) -> Result<(), Fault> {
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

    /// Reads a library of materials. The rest of the line is one name, unless there is no such file: then its words are.
    fn materials(&mut self, line: usize, text: &[u8], refer: &mut Referred<'_>) -> Result<(), Fault> {
        let rest = rest_of(text, b"mtllib");
        let names: Vec<String> = match refer.exists(&rest)? {
            true => vec![rest],
            false => {
                let words: Vec<String> = rest.split_whitespace().map(Into::into).collect();
                if words.len() > 1 && words.iter().any(|word| refer.exists(word).unwrap_or(false)) {
                    words
                } else {
                    vec![rest]
                }
            }
        };
        if names.len() > limits::FILES {
            return Err(Fault::at(line, format!("{} libraries of materials", names.len())));
        }
        for name in names {
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

    /// Gives the looks that faces have their pictures, and the colour of what has none to those whose file is missing.
    fn paint(&mut self, refer: &mut Referred<'_>) -> Result<(), Fault> {
        let mut is_used = vec![false; self.parts.looks.len()];
        self.parts.look_of.iter().for_each(|look| is_used[*look as usize] = true);
        for number in (0..self.parts.looks.len() as u32).filter(|look| is_used[*look as usize]) {
            let Some(Map { library, line, path }) = self.pictures.get(&number) else {
                let is_named = number > 0 && !self.defined.contains(&number);
                self.parts.looks[number as usize].is_missing = self.lacks_library && is_named;
                if is_named && !self.lacks_library && !self.defined.is_empty() {
                    let name = self.names.iter().find(|(_, of)| **of == number).map(|(name, _)| name);
                    let name = String::from_utf8_lossy(name.map_or(b"", Vec::as_slice));
                    let warning = format!("no library has the material `{name}`: what has it is grey");
                    self.parts.warnings.push(warning);
                }
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

    fn read_materials(&mut self, file: &str, bytes: &[u8], refer: &Referred<'_>) -> Result<(), Fault> {
        let within = |fault: Fault| within(file, fault);
        let mut look: Option<u32> = None;
        let rest = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        for (line, text) in (Lines { rest, number: 0 }) {
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

/// Adds the last of `count` values. As long as all are missing there are none; later a missing one is the `usual` one.
#[inline]
fn push_late<T: Copy>(all: &mut Vec<T>, count: usize, value: T, (usual, is_missing): (T, bool)) {
    if all.is_empty() {
        if is_missing {
            return;
        }
        all.resize(count - 1, usual);
    }
    all.push(value);
}

/// Takes a list from each chunk.
fn taken<T>(chunks: &mut [Chunk], list: fn(&mut Chunk) -> &mut Vec<T>) -> Vec<Vec<T>> {
    chunks.iter_mut().map(|chunk| std::mem::take(list(chunk))).collect()
}

fn joined<T: Copy>(mut lists: Vec<Vec<T>>) -> Vec<T> {
    if lists.len() == 1 { lists.swap_remove(0) } else { lists.concat() }
}

/// Joins lists that are each empty or as long as one of `others`. If all are empty the result is, too; otherwise what is missing
/// is the `usual` value.
fn joined_late<T: Copy, U>(mut lists: Vec<Vec<T>>, others: &[Vec<U>], usual: T) -> Vec<T> {
    if lists.iter().any(|list| !list.is_empty()) {
        lists.iter_mut().zip(others).for_each(|(list, other)| list.resize(other.len(), usual));
    }
    joined(lists)
}

/// Returns a fault of a library of materials.
fn within(library: &str, fault: Fault) -> Fault {
    Fault::new(match fault.line {
        Some(line) => format!("in `{library}`, line {line}: {}", fault.what),
        None => format!("in `{library}`: {}", fault.what),
    })
}

fn bounded(line: usize, count: usize, what: &str) -> Result<(), Fault> {
    if count > limits::VERTICES {
        return Err(Fault::at(line, format!("more than {} {what}", limits::VERTICES)));
    }
    Ok(())
}

/// The largest number of materials of a model.
const LOOKS: usize = 1 << 20;

fn bounded_looks(line: usize, count: usize) -> Result<(), Fault> {
    if count > LOOKS {
        return Err(Fault::at(line, format!("more than {LOOKS} materials")));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::MemoryFiles;

    #[test]
    fn short_numbers_are_those_of_the_standard_library() {
        let words = [
            "0",
            "-0",
            "1.",
            ".5",
            "-.25",
            "0.1",
            "-3.141593",
            "123456789012345",
            "9007199254740991",
            "9007199254740993",
            "0.30000000000001",
            "00012.5000",
            "1e5",
            "-1.5E-3",
            "inf",
            "nan",
            "",
            "-",
            ".",
            "-.",
            "1.2.3",
            "+1",
            "1x",
            "--1",
        ];
        for word in words {
            let expected = word.parse().ok().filter(|x: &f64| x.is_finite()).map(f64::to_bits);
            assert_eq!(number(word.as_bytes()).map(f64::to_bits), expected, "{word}");
        }
        let mut state = 1u64;
        for _ in 0..20_000 {
            state = state.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(1);
            let (digits, places) = (state >> (11 + state % 50), (state >> 7) as usize % 8);
            let word = format!("{:.places$}", digits as f64 / 1e3);
            assert_eq!(number(word.as_bytes()), word.parse().ok(), "{word}");
        }
    }

    /// Returns what is read in so many chunks, or the fault.
    fn outcome(text: &str, chunks: usize) -> String {
        let files = MemoryFiles::from([("m.mtl", b"newmtl red\nKd 1 0 0\n".to_vec())]);
        let mut referred = Referred::new(&files);
        let parts = read_in(text.as_bytes(), chunks, &mut referred);
        let sources: Vec<_> = referred.sources().map(|(name, ..)| name.to_string()).collect();
        match parts {
            Ok(parts) => format!("{parts:?} {sources:?}"),
            Err(fault) => format!("{:?} {} {sources:?}", fault.line, fault.what),
        }
    }

    #[test]
    fn a_text_is_the_same_in_any_number_of_chunks() {
        let lines = [
            "v 1 2 3",
            "v 4 5 6",
            "v 7 8 10 .5 .25 1",
            "vn 0 0 1",
            "vt .5 .5",
            "f 1 2 3",
            "f -1 -2 -3",
            "f 1/1 2/1/1 3//1 1",
            "f 1//1 2//1 3//1",
            "usemtl red",
            "usemtl blue",
            "mtllib m.mtl",
            "mtllib absent.mtl",
            "l 1 2",
            "p 1",
            "f 1 \\\r\n 2 \\\n 3",
            "",
        ];
        let faults = ["v 1 2", "f 1 2 999", "vn 1 x 0", "f 1 2", "f 1 2 -9999"];
        let mut rng = 1u64;
        let mut below = |count: usize| {
            rng = rng.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(1);
            (rng >> 33) as usize % count
        };
        let mut faulty = 0;
        for round in 0..300 {
            let mut text: String = lines[..5].iter().flat_map(|line| [*line, "\n"]).collect();
            for _ in 0..below(60) {
                let has_fault = round % 2 == 0 && below(40) == 0;
                let line = if has_fault { faults[below(faults.len())] } else { lines[below(lines.len())] };
                text += line;
                text += ["\n", "\r\n"][below(2)];
            }
            let expected = outcome(&text, 1);
            faulty += usize::from(expected.starts_with("Some"));
            for chunks in [2, 3, 7, 40] {
                assert_eq!(outcome(&text, chunks), expected, "{chunks} chunks: {text}");
            }
        }
        assert!((50..250).contains(&faulty), "{faulty} of 300 have a fault");
    }

    #[test]
    fn chunks_are_whole_lines() {
        let text = b"v 1 2 3\nf 1 \\\n2 \\\r\n3\n\n# end\\\n";
        for count in 0..40 {
            let pieces = cut(text, count);
            assert_eq!(pieces.concat(), text);
            assert!(pieces.len() <= count.max(1), "{count}");
            for piece in &pieces[..pieces.len() - 1] {
                assert!(piece.ends_with(b"\n") && !piece.ends_with(b"\\\n") && !piece.ends_with(b"\\\r\n"));
            }
        }
        assert!(cut(text, 3).len() > 1);
    }

    #[test]
    fn indices_have_nine_digits_at_most() {
        assert_eq!(index(1, b"-123456789").unwrap(), -123_456_789);
        assert_eq!(index(1, b"000000007").unwrap(), 7);
        for word in ["", "-", "1234567890", "1.5", "+1", "4294967297", "--1", "1 "] {
            assert!(index(1, word.as_bytes()).is_err(), "{word}");
        }
    }
}
