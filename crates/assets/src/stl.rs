//! STL, in binary and as text. Its normals are those of faces, and are not used.

use glam::{DVec3, Vec3};

use crate::error::Fault;
use crate::limits;
use crate::model::{Parts, too_many_triangles};

/// The bytes before the first triangle, and those of a triangle.
const HEAD: usize = 84;
const TRIANGLE: usize = 50;

/// Returns whether the bytes are a binary file: its header says how long it is.
pub(crate) fn is_binary(bytes: &[u8]) -> bool {
    let Some(count) = bytes.get(80..HEAD) else { return false };
    let count = u32::from_le_bytes([count[0], count[1], count[2], count[3]]);
    bytes.len() as u64 == HEAD as u64 + TRIANGLE as u64 * u64::from(count)
}

/// Returns the fault of a binary file that is not as long as its header says. Any bytes can look like one, so its name decides.
pub(crate) fn of_another_length(name: &str, bytes: &[u8]) -> Option<Fault> {
    let count = bytes.get(80..HEAD).filter(|_| name.to_ascii_lowercase().ends_with(".stl"))?;
    let count = u64::from(u32::from_le_bytes([count[0], count[1], count[2], count[3]]));
    let (whole, there) = (HEAD as u64 + TRIANGLE as u64 * count, bytes.len() as u64);
    let why = if there < whole { "cut off" } else { "too long" };
    let what =
        format!("it has {there} bytes of {whole} for {count} triangles: it is {why}, or no binary STL");
    (there != whole).then(|| Fault::new(what))
}

/// Returns whether the bytes are a text: it begins with `solid`, and has a facet or an end.
pub(crate) fn is_text(bytes: &[u8]) -> bool {
    let start = bytes.trim_ascii_start();
    start.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"))
        && start.split(|b| *b == b'\n').take(8).any(|line| {
            let line = line.trim_ascii();
            line.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"facet"))
        })
}

pub(crate) fn read_binary(bytes: &[u8]) -> Result<Parts, Fault> {
    let triangles = bytes.get(HEAD..).unwrap_or_default().chunks_exact(TRIANGLE);
    if triangles.len() > limits::TRIANGLES {
        return Err(too_many_triangles());
    }
    let mut parts = Parts::default();
    parts.positions.reserve(3 * triangles.len());
    parts.triangles.reserve(triangles.len());
    for triangle in triangles {
        let number = |k: usize| {
            let at = 12 + 4 * k;
            f32::from_le_bytes([triangle[at], triangle[at + 1], triangle[at + 2], triangle[at + 3]])
        };
        add(&mut parts, [0, 3, 6].map(|k| Vec3::new(number(k), number(k + 1), number(k + 2)).as_dvec3()));
    }
    Ok(parts)
}

fn add(parts: &mut Parts, corners: [DVec3; 3]) {
    let first = parts.positions.len() as u32;
    parts.positions.extend(corners);
    parts.triangles.push([first, first + 1, first + 2]);
}

pub(crate) fn read_text(bytes: &[u8]) -> Result<Parts, Fault> {
    let mut parts = Parts::default();
    let mut corners: Vec<DVec3> = Vec::new();
    for (line, text) in (1..).zip(bytes.split(|b| *b == b'\n')) {
        let mut words = text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        let Some(word) = words.next() else { continue };
        if word.eq_ignore_ascii_case(b"vertex") {
            let mut number = || {
                let text = words.next().and_then(|word| std::str::from_utf8(word).ok());
                let number = text.and_then(|text| text.parse::<f64>().ok()).filter(|x| x.is_finite());
                number.ok_or_else(|| Fault::at(line, "a vertex has three finite numbers"))
            };
            corners.push(DVec3::new(number()?, number()?, number()?));
            if corners.len() > 3 {
                return Err(Fault::at(line, "a facet has three vertices"));
            }
        } else if word.eq_ignore_ascii_case(b"endfacet") {
            let Ok(three) = <[DVec3; 3]>::try_from(&corners[..]) else {
                return Err(Fault::at(line, "a facet has three vertices"));
            };
            corners.clear();
            add(&mut parts, three);
            if parts.triangles.len() > limits::TRIANGLES {
                return Err(too_many_triangles());
            }
        }
    }
    if !corners.is_empty() {
        return Err(Fault::new("it ends within a facet"));
    }
    Ok(parts)
}
