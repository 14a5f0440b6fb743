//! Letters cut out of a plate: from words to a closed model.
//!
//! A line of words becomes glyphs at their places (`shaping`), each glyph contours without curves on a grid (`outline`),
//! overlapping contours one (`plate`), and the plate a model with sides. Everything behind the outlines is exact on the grid, so
//! front, back and sides have the very same points.

mod outline;
mod plate;
mod shaping;

use std::collections::HashMap;
use std::ops::Range;

use glam::{DVec2, DVec3, I64Vec2, Vec3};

use crate::error::{AssetError, Fault};
use crate::limits;
use crate::model::{Model, NONE, Parts, too_many_triangles};
use outline::contours;
use plate::Plate;
use shaping::Glyph;

/// The point of each line of letters that is at x = 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Align {
    /// The beginning of the line.
    #[default]
    Left,
    /// The middle of the line.
    Center,
    /// The end of the line.
    Right,
}

/// Words, and the plate that their letters are cut out of.
#[derive(Clone, Debug, PartialEq)]
pub struct Lettering {
    /// The words; a line feed begins a line.
    pub text: String,
    /// The length of the em, greater than 0.
    pub size: f64,
    /// The thickness of the plate, at least 0. At 0 there is a front alone.
    pub depth: f64,
    /// The place of the lines.
    pub align: Align,
    /// The name of the file of the font; `None` for the one that comes with the program.
    pub font: Option<String>,
}

/// The reason why words cannot be drawn.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LetterError {
    /// The file of the font cannot be used.
    #[error(transparent)]
    Font(#[from] AssetError),
    /// The font has no such letter.
    #[error("{} has no letter {}", font_name(.font.as_deref()), named(*.letter))]
    Missing {
        /// The letter.
        letter: char,
        /// The file of the font; `None` for the one that comes with the program.
        font: Option<String>,
    },
    /// A control character.
    #[error("the control character U+{:04X} cannot be drawn", u32::from(*.0))]
    Control(char),
    /// More code points than the limit, as many as this.
    #[error("the text has {count} code points, more than {}", limits::CODE_POINTS, count = .0)]
    TooLong(usize),
    /// The outlines cannot be joined within bounds of time and memory, or the triangles are too many.
    #[error("the letters are too intricate: {0}")]
    Intricate(String),
}

impl LetterError {
    /// Returns advice for a correction.
    pub fn help(&self) -> Option<String> {
        match self {
            Self::Font(error) => error.help(),
            Self::Missing { .. } => Some("`font \"FILE\"` names a font that has the letter".into()),
            Self::Control(_) => Some("`\\n` begins a line".into()),
            Self::TooLong(_) | Self::Intricate(_) => Some("draw it as several texts".into()),
        }
    }
}

fn font_name(font: Option<&str>) -> String {
    font.map_or_else(|| "the font that comes with rayfold".into(), |name| format!("the font `{name}`"))
}

fn named(letter: char) -> String {
    if letter.is_alphanumeric() || letter.is_ascii_graphic() {
        format!("`{letter}` (U+{:04X})", u32::from(letter))
    } else {
        format!("U+{:04X}", u32::from(letter))
    }
}

/// Returns the font of letters that name no font.
#[cfg(not(all(target_arch = "wasm32", target_os = "unknown")))]
#[expect(clippy::unnecessary_wraps, reason = "a page may lack it")]
fn bold() -> Option<&'static [u8]> {
    Some(notosans::BOLD_TTF)
}

/// A page loads the font beside the module, which is a tenth smaller without it.
#[cfg(all(target_arch = "wasm32", target_os = "unknown"))]
static BOLD: std::sync::OnceLock<Vec<u8>> = std::sync::OnceLock::new();

#[cfg(all(target_arch = "wasm32", target_os = "unknown"))]
fn bold() -> Option<&'static [u8]> {
    BOLD.get().map(Vec::as_slice)
}

/// Provides the font of letters that name no font, once. In a browser this font is no part of the program.
#[cfg(all(target_arch = "wasm32", target_os = "unknown"))]
pub fn provide_font(bytes: Vec<u8>) {
    let _ = BOLD.set(bytes);
}

/// A font, ready for shaping.
#[derive(Clone)]
pub(crate) struct Font {
    font: harfrust::Font,
    /// The number of grid units per em.
    em: i64,
    /// The number of grid units per unit of the font.
    unit: i64,
}

/// The minimum number of grid units per em. A rounded point is off by less than an em / 2¹⁵.
const FINENESS: i64 = 1 << 15;

impl Font {
    /// Returns the font that comes with the program.
    pub(crate) fn built_in() -> Result<Self, Fault> {
        let font = bold().and_then(|bytes| harfrust::Font::new(bytes, 0));
        Self::of(font.ok_or_else(|| Fault::new("the font that comes with rayfold was not loaded"))?)
    }

    /// Reads a TrueType or OpenType font; of a collection the first one.
    pub(crate) fn read(bytes: Vec<u8>) -> Result<Self, Fault> {
        const WOFF: &str = "WOFF is not read: a font is TrueType or OpenType (.ttf, .otf, .ttc)";
        if bytes.starts_with(b"wOF") {
            return Err(Fault::new(WOFF));
        }
        let is_font = harfrust::font::Format::new(&bytes).is_some_and(|format| format.is_sfnt());
        if let Some(table) = is_font.then(|| cut_table(&bytes)).flatten() {
            return Err(Fault::new(format!(
                "its table `{table}` ends behind the end of the file: the file is cut off"
            )));
        }
        let font = is_font.then(|| harfrust::Font::new(bytes, 0)).flatten();
        let font = font.ok_or_else(|| Fault::new("it is no font: a font is TrueType or OpenType"))?;
        Self::of(font)
    }

    fn of(font: harfrust::Font) -> Result<Self, Fault> {
        let units = i64::from(font.units_per_em());
        if !(16..=16384).contains(&units) {
            return Err(Fault::new(format!("its em has {units} units, not 16 to 16384")));
        }
        if font.outline_glyphs().is_empty() {
            return Err(Fault::new("it has no outlines"));
        }
        let mut unit = 1;
        while units * unit < FINENESS {
            unit *= 2;
        }
        Ok(Self { font, em: units * unit, unit })
    }
}

/// Returns the name of a truncated table of the first face, if there is one.
fn cut_table(bytes: &[u8]) -> Option<String> {
    let number = |at: usize| {
        let four = bytes.get(at..at.checked_add(4)?)?;
        Some(u32::from_be_bytes([four[0], four[1], four[2], four[3]]) as usize)
    };
    let face = if bytes.starts_with(b"ttcf") { number(12)? } else { 0 };
    let count = number(face.checked_add(4)?)? >> 16;
    let entries = (0..count).filter_map(|k| {
        let at = face.checked_add(12 + 16 * k)?;
        Some((bytes.get(at..at.checked_add(4)?)?, number(at + 8)?.checked_add(number(at + 12)?)?))
    });
    let (name, _) = entries.into_iter().find(|(_, end)| *end > bytes.len())?;
    Some(String::from_utf8_lossy(name).trim_end().into())
}

/// The maximum number of pairs of glyphs that are tested for contact.
const PAIRS: usize = 300_000_000;

/// A glyph at its place on the grid.
#[derive(Clone, Copy)]
struct Placed {
    glyph: u32,
    at: I64Vec2,
}

/// Cuts letters out of a plate. Returns `None` if none has an outline.
pub(crate) fn cut(lettering: &Lettering, font: &Font) -> Result<Option<Model>, LetterError> {
    let count = lettering.text.chars().count();
    if count > limits::CODE_POINTS {
        return Err(LetterError::TooLong(count));
    }
    if let Some(control) = lettering.text.chars().find(|c| c.is_control() && *c != '\n') {
        return Err(LetterError::Control(control));
    }
    let intricate = |fault: Fault| LetterError::Intricate(fault.what);
    let mut plates: HashMap<u32, Plate> = HashMap::new();
    let mut placed = Vec::new();
    for (number, line) in (0i64..).zip(lettering.text.split('\n')) {
        let line = shaping::line(line, font, lettering)?;
        let start = match lettering.align {
            Align::Left => 0,
            Align::Center => -line.width * font.unit / 2,
            Align::Right => -line.width * font.unit,
        };
        let down = (1.2 * (number * font.em) as f64).round() as i64;
        for Glyph { glyph, x, y } in line.glyphs {
            if let std::collections::hash_map::Entry::Vacant(entry) = plates.entry(glyph) {
                let contours = contours(font, glyph).map_err(|fault| match &lettering.font {
                    Some(name) => fault.of_font(name).into(),
                    None => intricate(fault),
                })?;
                entry.insert(Plate::new(contours).map_err(intricate)?);
            }
            if !plates[&glyph].is_empty() {
                placed.push(Placed { glyph, at: I64Vec2::new(start + x * font.unit, y * font.unit - down) });
            }
        }
    }
    if placed.is_empty() {
        return Ok(None);
    }
    let mut solid = Solid::new(lettering, font);
    for cluster in clusters(&placed, &plates)? {
        match &cluster[..] {
            [alone] => solid.add(&plates[&alone.glyph], alone.at).map_err(intricate)?,
            several => {
                let origin = several[0].at;
                let parts = several.iter().map(|part| (&plates[&part.glyph], part.at - origin));
                let joined = Plate::joined(&parts.collect::<Vec<_>>()).map_err(intricate)?;
                solid.add(&joined, origin).map_err(intricate)?;
            }
        }
    }
    Model::new(solid.parts).map_err(|_| LetterError::Intricate("a position overflows".into()))
}

/// Returns the glyphs in groups whose boxes overlap or touch, in the order of their first ones.
fn clusters(placed: &[Placed], plates: &HashMap<u32, Plate>) -> Result<Vec<Vec<Placed>>, LetterError> {
    let bounds: Vec<[I64Vec2; 2]> =
        placed.iter().map(|part| plates[&part.glyph].bounds().map(|corner| corner + part.at)).collect();
    let mut order: Vec<usize> = (0..placed.len()).collect();
    order.sort_by_key(|i| bounds[*i][0].x);
    let mut parent: Vec<usize> = (0..placed.len()).collect();
    let mut open: Vec<usize> = Vec::new();
    let mut pairs = 0;
    for &i in &order {
        let [low, high] = bounds[i];
        pairs += open.len();
        if pairs > PAIRS {
            return Err(LetterError::Intricate("too many lie above one another".into()));
        }
        open.retain(|j| bounds[*j][1].x >= low.x);
        for &j in &open {
            if bounds[j][0].y <= high.y && low.y <= bounds[j][1].y {
                let (a, b) = (root(&mut parent, i), root(&mut parent, j));
                parent[a.max(b)] = a.min(b);
            }
        }
        open.push(i);
    }
    let mut groups: Vec<Vec<Placed>> = Vec::new();
    let mut group_of: HashMap<usize, usize> = HashMap::new();
    for (i, part) in placed.iter().enumerate() {
        let root = root(&mut parent, i);
        let group = *group_of.entry(root).or_insert_with(|| {
            groups.push(Vec::new());
            groups.len() - 1
        });
        groups[group].push(*part);
    }
    Ok(groups)
}

fn root(parent: &mut [usize], mut at: usize) -> usize {
    while parent[at] != at {
        parent[at] = parent[parent[at]];
        at = parent[at];
    }
    at
}

/// The model as it grows, plate by plate.
struct Solid {
    size: f64,
    depth: f64,
    em: f64,
    parts: Parts,
}

impl Solid {
    fn new(lettering: &Lettering, font: &Font) -> Self {
        let (size, depth) = (lettering.size, lettering.depth);
        Self { size, depth, em: font.em as f64, parts: Parts::default() }
    }

    fn add(&mut self, plate: &Plate, at: I64Vec2) -> Result<(), Fault> {
        let is_solid = self.depth > 0.0;
        let faces = plate.triangles().len();
        let triangles = if is_solid { 2 * faces + 2 * plate.sides().len() } else { faces };
        if self.parts.triangles.len() + triangles > limits::TRIANGLES {
            return Err(too_many_triangles());
        }
        let front = self.add_points(plate, at, 0.0);
        for triangle in plate.triangles() {
            self.add_flat(triangle.map(|i| front.start + i));
        }
        if !is_solid {
            return Ok(());
        }
        let back = self.add_points(plate, at, -self.depth);
        for [a, b, c] in plate.triangles() {
            self.add_flat([a, c, b].map(|i| back.start + i));
        }
        for side in plate.sides() {
            let normals = side.normals.map(|n| self.add_normal(n));
            let [[a, b], [c, d]] = [&front, &back].map(|face| side.ends.map(|i| face.start + i));
            let [from, to] = normals;
            self.parts.triangles.extend([[b, a, c], [b, c, d]]);
            self.parts.normal_of.extend([[to, from, from], [to, from, to]]);
        }
        Ok(())
    }

    fn add_points(&mut self, plate: &Plate, at: I64Vec2, z: f64) -> Range<u32> {
        let first = self.parts.positions.len() as u32;
        let (size, em) = (self.size, self.em);
        self.parts.positions.extend(plate.points().iter().map(|p| {
            let p = (at + *p).as_dvec2() / em * size;
            DVec3::new(p.x, p.y, z)
        }));
        first..self.parts.positions.len() as u32
    }

    fn add_flat(&mut self, triangle: [u32; 3]) {
        self.parts.triangles.push(triangle);
        self.parts.normal_of.push([NONE; 3]);
    }

    fn add_normal(&mut self, normal: DVec2) -> u32 {
        self.parts.normals.push(Vec3::new(normal.x as f32, normal.y as f32, 0.0));
        self.parts.normals.len() as u32 - 1
    }
}
