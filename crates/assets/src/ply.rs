//! PLY, as text and in both binary byte orders.

use glam::{DVec3, Vec2, Vec3};

use crate::error::Fault;
use crate::limits;
use crate::model::{Colors, Parts, too_many_triangles, unit};

/// The type of a number.
#[derive(Clone, Copy, PartialEq)]
enum Type {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Type {
    fn of(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Returns the largest whole number of the type; 1 for fractions.
    fn largest(self) -> f64 {
        match self {
            Self::I8 => f64::from(i8::MAX),
            Self::U8 => f64::from(u8::MAX),
            Self::I16 => f64::from(i16::MAX),
            Self::U16 => f64::from(u16::MAX),
            Self::I32 => f64::from(i32::MAX),
            Self::U32 => f64::from(u32::MAX),
            Self::F32 | Self::F64 => 1.0,
        }
    }
}

struct Property {
    name: String,
    of: Type,
    /// The type of a list's count.
    count: Option<Type>,
}

struct Element {
    name: String,
    count: u64,
    properties: Vec<Property>,
}

#[derive(Clone, Copy, PartialEq)]
enum Format {
    Text,
    Little,
    Big,
}

/// The values after the header.
struct Values<'a> {
    rest: &'a [u8],
    format: Format,
}

impl Values<'_> {
    #[inline]
    fn next(&mut self, of: Type) -> Result<f64, Fault> {
        let ends = || Fault::new("it ends before the numbers that its header promises");
        if self.format == Format::Text {
            let start = self.rest.iter().position(|b| !b.is_ascii_whitespace()).ok_or_else(ends)?;
            let rest = &self.rest[start..];
            let end = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
            self.rest = &rest[end..];
            let word = std::str::from_utf8(&rest[..end]).ok();
            return word.and_then(|word| word.parse().ok()).ok_or_else(|| {
                Fault::new(format!("`{}` is not a number", String::from_utf8_lossy(&rest[..end.min(40)])))
            });
        }
        let (bytes, rest) = self.rest.split_at_checked(of.bytes()).ok_or_else(ends)?;
        self.rest = rest;
        Ok(number(of, bytes, self.format))
    }

    fn count(&mut self, of: Type) -> Result<usize, Fault> {
        let count = self.next(of)?;
        let most = (self.rest.len() + 1) as f64;
        if count < 0.0 || count.fract() != 0.0 || count > most {
            return Err(Fault::new(format!("a list of {count} numbers")));
        }
        Ok(count as usize)
    }
}

/// Returns the number of a type in the first bytes of a binary file's rest.
#[inline]
fn number(of: Type, bytes: &[u8], format: Format) -> f64 {
    /// Returns the bytes of a number in the order of little-endian files.
    fn ordered<const N: usize>(bytes: &[u8], format: Format) -> [u8; N] {
        let mut own = [0; N];
        own.copy_from_slice(&bytes[..N]);
        if format == Format::Big {
            own.reverse();
        }
        own
    }
    match of {
        Type::I8 => f64::from(bytes[0].cast_signed()),
        Type::U8 => f64::from(bytes[0]),
        Type::I16 => f64::from(i16::from_le_bytes(ordered(bytes, format))),
        Type::U16 => f64::from(u16::from_le_bytes(ordered(bytes, format))),
        Type::I32 => f64::from(i32::from_le_bytes(ordered(bytes, format))),
        Type::U32 => f64::from(u32::from_le_bytes(ordered(bytes, format))),
        Type::F32 => f64::from(f32::from_le_bytes(ordered(bytes, format))),
        Type::F64 => f64::from_le_bytes(ordered(bytes, format)),
    }
}

/// Reads a PLY file.
pub(crate) fn read(bytes: &[u8]) -> Result<Parts, Fault> {
    let (format, elements, start) = header(bytes)?;
    let mut values = Values { rest: &bytes[start..], format };
    let mut parts = Parts { space: Colors::Levels, ..Parts::default() };
    let mut has_other = false;
    for element in &elements {
        bounded(element, values.rest.len(), format)?;
        match element.name.as_str() {
            "vertex" => vertices(element, &mut values, &mut parts)?,
            "face" | "tristrips" => faces(element, &mut values, &mut parts)?,
            name => {
                has_other |= name == "edge" && element.count > 0;
                for _ in 0..element.count {
                    skip(element, &mut values)?;
                }
            }
        }
    }
    // A vertex has one normal and one place on the texture.
    if !parts.normals.is_empty() {
        parts.normal_of = parts.triangles.clone();
    }
    if !parts.uvs.is_empty() {
        parts.uv_of = parts.triangles.clone();
    }
    if has_other {
        parts.warnings.push("lines are left out".into());
    }
    Ok(parts)
}

fn header(bytes: &[u8]) -> Result<(Format, Vec<Element>, usize), Fault> {
    let mut start = 0;
    let (mut format, mut elements) = (None, Vec::<Element>::new());
    for number in 1.. {
        let rest = &bytes[start..];
        let end = memchr::memchr2(b'\n', b'\r', &rest[..rest.len().min(4096)])
            .ok_or_else(|| Fault::at(number, "the header has no `end_header`"))?;
        start += end + if rest[end..].starts_with(b"\r\n") { 2 } else { 1 };
        let line = std::str::from_utf8(&rest[..end]).unwrap_or("comment");
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        let unknown = || Fault::at(number, format!("`{line}` is no line of a header"));
        match words[..] {
            [] | ["ply" | "comment" | "obj_info", ..] => {}
            ["format", name, "1.0"] => {
                format = Some(match name {
                    "ascii" => Format::Text,
                    "binary_little_endian" => Format::Little,
                    "binary_big_endian" => Format::Big,
                    _ => return Err(unknown()),
                });
            }
            ["element", name, count] => {
                let count = count.parse().map_err(|_| unknown())?;
                elements.push(Element { name: name.into(), count, properties: Vec::new() });
            }
            ["property", "list", count, of, name] => {
                let element = elements.last_mut().ok_or_else(unknown)?;
                let count = Some(Type::of(count).ok_or_else(unknown)?);
                let of = Type::of(of).ok_or_else(unknown)?;
                element.properties.push(Property { name: name.into(), of, count });
            }
            ["property", of, name] => {
                let element = elements.last_mut().ok_or_else(unknown)?;
                let of = Type::of(of).ok_or_else(unknown)?;
                element.properties.push(Property { name: name.into(), of, count: None });
            }
            ["end_header"] => {
                let format = format.ok_or_else(|| Fault::at(number, "the header has no `format`"))?;
                return Ok((format, elements, start));
            }
            _ => return Err(unknown()),
        }
        if elements.iter().map(|element| element.properties.len() + 1).sum::<usize>() > 1000 {
            return Err(Fault::at(number, "more than 1000 properties"));
        }
    }
    unreachable!("the lines do not end")
}

/// Compares what the header says with the bytes that there are.
fn bounded(element: &Element, bytes: usize, format: Format) -> Result<(), Fault> {
    let least = |property: &Property| match format {
        // A digit and a blank, but for the last number.
        Format::Text => 2,
        _ => property.count.unwrap_or(property.of).bytes() as u64,
    };
    let each: u64 = element.properties.iter().map(least).sum();
    let most = match element.name.as_str() {
        "vertex" => limits::VERTICES,
        "face" | "tristrips" => limits::TRIANGLES,
        _ => usize::MAX,
    };
    if element.count > most as u64 {
        return Err(Fault::new(format!("{} times `{}`, more than {most}", element.count, element.name)));
    }
    if element.count.saturating_mul(each) > bytes as u64 + 1 || each == 0 && element.count > 0 {
        return Err(Fault::new(format!(
            "the header promises {} times `{}`, but only {bytes} bytes are left",
            element.count, element.name
        )));
    }
    Ok(())
}

fn skip(element: &Element, values: &mut Values<'_>) -> Result<(), Fault> {
    for property in &element.properties {
        let count = property.count.map_or(Ok(1), |of| values.count(of))?;
        for _ in 0..count {
            values.next(property.of)?;
        }
    }
    Ok(())
}

/// The slots of a vertex: position, normal, colour, texture coordinates.
const SLOTS: [&[&str]; 11] = [
    &["x"],
    &["y"],
    &["z"],
    &["nx"],
    &["ny"],
    &["nz"],
    &["red", "r", "diffuse_red"],
    &["green", "g", "diffuse_green"],
    &["blue", "b", "diffuse_blue"],
    &["s", "u", "texture_u"],
    &["t", "v", "texture_v"],
];

fn vertices(element: &Element, values: &mut Values<'_>, parts: &mut Parts) -> Result<(), Fault> {
    let slot = |property: &Property| SLOTS.iter().position(|names| names.contains(&property.name.as_str()));
    let slots: Vec<Option<usize>> = element.properties.iter().map(slot).collect();
    let has = |range: std::ops::Range<usize>| range.into_iter().all(|slot| slots.contains(&Some(slot)));
    if !has(0..3) {
        return Err(Fault::new("its vertices have no x, y and z"));
    }
    let (normals, colors, uvs) = (has(3..6), has(6..9), has(9..11));
    // Without lists the rows of a binary file are of one length.
    let row: usize = element.properties.iter().map(|property| property.of.bytes()).sum();
    let is_even = values.format != Format::Text && element.properties.iter().all(|p| p.count.is_none());
    for _ in 0..element.count {
        let mut of = [0.0; SLOTS.len()];
        let mut put = |property: &Property, slot: &Option<usize>, value: f64| {
            if let Some(slot) = slot {
                let is_color = (6..9).contains(slot);
                of[*slot] = if is_color { value / property.of.largest() } else { value };
            }
        };
        if is_even && let Some((mut bytes, rest)) = values.rest.split_at_checked(row) {
            values.rest = rest;
            for (property, slot) in element.properties.iter().zip(&slots) {
                put(property, slot, number(property.of, bytes, values.format));
                bytes = &bytes[property.of.bytes()..];
            }
        } else {
            for (property, slot) in element.properties.iter().zip(&slots) {
                if let Some(count) = property.count {
                    for _ in 0..values.count(count)? {
                        values.next(property.of)?;
                    }
                    continue;
                }
                let value = values.next(property.of)?;
                put(property, slot, value);
            }
        }
        parts.positions.push(DVec3::new(of[0], of[1], of[2]));
        if normals {
            parts.normals.push(unit(DVec3::new(of[3], of[4], of[5]).as_vec3()));
        }
        if colors {
            parts.colors.push(Vec3::new(of[6] as f32, of[7] as f32, of[8] as f32));
        }
        if uvs {
            parts.uvs.push(Vec2::new(of[9] as f32, of[10] as f32));
        }
    }
    Ok(())
}

/// Takes the triangles with which the faces of a binary file begin, as nearly all programs write them, and returns
/// their number. It stops before the first other or faulty face.
fn triangles(element: &Element, values: &mut Values<'_>, parts: &mut Parts) -> u64 {
    const ROW: usize = 13;
    let is_plain = values.format != Format::Text
        && matches!(
            &element.properties[..],
            [Property { of: Type::I32 | Type::U32, count: Some(Type::I8 | Type::U8), .. }]
        );
    let most = if is_plain { element.count } else { 0 };
    let room = limits::TRIANGLES - parts.triangles.len();
    let before = parts.triangles.len();
    for row in values.rest.as_chunks::<ROW>().0.iter().take(room.min(most as usize)) {
        let corner = |k: usize| number(Type::U32, &row[1 + 4 * k..], values.format) as u32;
        let corners = [corner(0), corner(1), corner(2)];
        if row[0] != 3 || corners.iter().any(|corner| *corner > i32::MAX.cast_unsigned()) {
            break;
        }
        parts.triangles.push(corners);
    }
    let taken = parts.triangles.len() - before;
    values.rest = &values.rest[ROW * taken..];
    taken as u64
}

fn faces(element: &Element, values: &mut Values<'_>, parts: &mut Parts) -> Result<(), Fault> {
    let is_corners = |property: &Property| {
        property.count.is_some() && matches!(property.name.as_str(), "vertex_indices" | "vertex_index")
    };
    if element.count > 0 && !element.properties.iter().any(is_corners) {
        return Err(Fault::new(format!("its `{}` has no list `vertex_indices`", element.name)));
    }
    let is_strip = element.name == "tristrips";
    let taken = if is_strip { 0 } else { triangles(element, values, parts) };
    let mut corners: Vec<u32> = Vec::new();
    for _ in taken..element.count {
        for property in &element.properties {
            let count = property.count.map_or(Ok(1), |of| values.count(of))?;
            if !is_corners(property) {
                for _ in 0..count {
                    values.next(property.of)?;
                }
                continue;
            }
            corners.clear();
            for _ in 0..count {
                let value = values.next(property.of)?;
                if is_strip && value == -1.0 {
                    strip(&corners, parts)?;
                    corners.clear();
                    continue;
                }
                if !(0.0..f64::from(u32::MAX)).contains(&value) || value.fract() != 0.0 {
                    return Err(Fault::new(format!("a face has the corner {value}")));
                }
                corners.push(value as u32);
            }
            if is_strip {
                strip(&corners, parts)?;
            } else {
                for pair in corners.get(1..).unwrap_or_default().windows(2) {
                    add(parts, [corners[0], pair[0], pair[1]])?;
                }
            }
        }
    }
    Ok(())
}

/// Adds a strip of triangles, every second one turned over.
fn strip(corners: &[u32], parts: &mut Parts) -> Result<(), Fault> {
    for (k, of) in corners.windows(3).enumerate() {
        add(parts, if k % 2 == 0 { [of[0], of[1], of[2]] } else { [of[1], of[0], of[2]] })?;
    }
    Ok(())
}

fn add(parts: &mut Parts, triangle: [u32; 3]) -> Result<(), Fault> {
    if parts.triangles.len() >= limits::TRIANGLES {
        return Err(too_many_triangles());
    }
    parts.triangles.push(triangle);
    Ok(())
}
