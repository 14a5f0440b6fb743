//! Wavefront OBJ, and the colours and pictures of its MTL files.
//!
//! A long text is cut into chunks at ends of lines, which are read side by side. The lines of each chunk are counted
//! first, so that indices and the lines of faults are the same for any number of chunks. The meaning of a line about
//! materials depends on all such lines before it, so these lines are kept, and read in order after the chunks.

mod lines;
mod materials;

use std::collections::{HashMap, HashSet};

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

use self::lines::{Lines, before_comment, field, index, numbers, words};
use self::materials::Map;
use crate::error::Fault;
use crate::limits;
use crate::model::{Colors, Look, NONE, Parts, too_many_triangles, unit};
use crate::referred::Referred;

/// Returns the place of an index among `count` items. Indices count from 1, negative ones from the last item back.
fn place(line: usize, index: i64, count: usize, what: &str) -> Result<u32, Fault> {
    let place = if index < 0 { index + count as i64 } else { index - 1 };
    match u32::try_from(place) {
        Ok(place) if index != 0 && (place as usize) < count => Ok(place),
        _ => Err(Fault::at(line, format!("{what} {index} of {count}"))),
    }
}

/// The counts of the items before a place in the text.
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
    /// The looks that a library of materials defines, the libraries that were read, and whether one is missing.
    defined: HashSet<u32>,
    libraries: HashSet<String>,
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

/// Reads an OBJ file in at most `chunks` chunks.
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
    let is_empty = read.iter().all(|chunk| chunk.positions.is_empty() && chunk.fault.is_none());
    reader.join(read, refer)?;
    if is_empty {
        return Err(Fault::no_model());
    }
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
            if !line.trim_ascii_end().ends_with(b"\\") {
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
        for word in before_comment(words) {
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
}

/// Adds the last of `count` values to a list. The list stays empty as long as all values are missing; later, a missing
/// value is `usual`.
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

/// Joins lists, each of which is empty or as long as its counterpart in `others`. If all are empty, so is the result;
/// otherwise a missing value is `usual`.
fn joined_late<T: Copy, U>(mut lists: Vec<Vec<T>>, others: &[Vec<U>], usual: T) -> Vec<T> {
    if lists.iter().any(|list| !list.is_empty()) {
        lists.iter_mut().zip(others).for_each(|(list, other)| list.resize(other.len(), usual));
    }
    joined(lists)
}

fn bounded(line: usize, count: usize, what: &str) -> Result<(), Fault> {
    if count > limits::VERTICES {
        return Err(Fault::at(line, format!("more than {} {what}", limits::VERTICES)));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::MemoryFiles;

    /// Returns the result of reading in `chunks` chunks, or the fault.
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
}
