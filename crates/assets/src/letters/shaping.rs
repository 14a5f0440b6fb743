//! A line of words to glyphs at their places, in both directions.

use harfrust::unicode::script;
use harfrust::{Buffer, Direction, Script, ShapeOptions, ShaperFont, shape};
use unicode_bidi::BidiInfo;

use super::{Font, LetterError, Lettering};

/// A glyph and the place of its origin, in units of the font.
pub(super) struct Glyph {
    pub(super) glyph: u32,
    pub(super) x: i64,
    pub(super) y: i64,
}

/// A line from left to right, and its width in units of the font.
#[derive(Default)]
pub(super) struct Line {
    pub(super) glyphs: Vec<Glyph>,
    pub(super) width: i64,
    /// The first letter that the font lacks, and its place in the text.
    missing: Option<(usize, char)>,
}

/// Shapes one line of a text. Its direction is that of its first strong letter.
pub(super) fn line(text: &str, font: &Font, lettering: &Lettering) -> Result<Line, LetterError> {
    let shaper = ShaperFont::new(&font.font);
    let scripts = scripts(text);
    let bidi = BidiInfo::new(text, None);
    let mut line = Line::default();
    for paragraph in &bidi.paragraphs {
        let (levels, runs) = bidi.visual_runs(paragraph, paragraph.range.clone());
        for run in runs {
            let is_leftward = levels[run.start].is_rtl();
            let mut parts = parts(text, run, &scripts);
            if is_leftward {
                parts.reverse();
            }
            for (part, script) in parts {
                let direction = if is_leftward { Direction::RightToLeft } else { Direction::LeftToRight };
                add(&mut line, text, part, script, direction, &shaper)?;
            }
        }
    }
    match line.missing {
        Some((_, letter)) => Err(LetterError::Missing { letter, font: lettering.font.clone() }),
        None => Ok(line),
    }
}

/// Returns the script of the letter at each byte at which one starts. A letter without a script has that of the letter
/// before it; at the start, that of the first letter with a script.
fn scripts(text: &str) -> Vec<Option<Script>> {
    let own = |c: char| match script(u32::from(c)) {
        Script::COMMON | Script::INHERITED | Script::UNKNOWN => None,
        script => Some(script),
    };
    let mut last = text.chars().find_map(own);
    let mut scripts = vec![None; text.len()];
    for (at, c) in text.char_indices() {
        last = own(c).or(last);
        scripts[at] = last;
    }
    scripts
}

/// Splits a run into parts of one script, in the order of the text.
fn parts(
    text: &str,
    run: std::ops::Range<usize>,
    scripts: &[Option<Script>],
) -> Vec<(std::ops::Range<usize>, Option<Script>)> {
    let mut parts: Vec<(std::ops::Range<usize>, Option<Script>)> = Vec::new();
    for (at, c) in text[run.clone()].char_indices() {
        let (at, end) = (run.start + at, run.start + at + c.len_utf8());
        match parts.last_mut() {
            Some((part, script)) if *script == scripts[at] => part.end = end,
            _ => parts.push((at..end, scripts[at])),
        }
    }
    parts
}

/// Shapes a part of one script and direction, and adds it to the right end of the line.
fn add(
    line: &mut Line,
    text: &str,
    part: std::ops::Range<usize>,
    script: Option<Script>,
    direction: Direction,
    shaper: &ShaperFont<'_, '_>,
) -> Result<(), LetterError> {
    let mut buffer = Buffer::new();
    buffer.set_pre_context(&text[..part.start]);
    for (at, c) in text[part.clone()].char_indices() {
        buffer.push(u32::from(c), (part.start + at) as u32);
    }
    buffer.set_post_context(&text[part.end..]);
    buffer.set_direction(direction);
    buffer.set_script(script);
    let intricate = || LetterError::Intricate("the font's rules for them do not end".into());
    shape(shaper, &mut buffer, ShapeOptions::new()).map_err(|_| intricate())?;
    if !buffer.allocation_successful() {
        return Err(intricate());
    }
    let mut starts: Vec<u32> = buffer.glyph_infos().iter().map(|info| info.cluster).collect();
    starts.sort_unstable();
    starts.dedup();
    for (info, position) in buffer.glyph_infos().iter().zip(buffer.glyph_positions()) {
        if info.glyph_id == 0 {
            let next = starts.get(starts.partition_point(|start| *start <= info.cluster));
            let end = next.map_or(part.end, |next| *next as usize);
            let letters = text.get(info.cluster as usize..end).unwrap_or_default();
            let lacks =
                |c: &char| shaper.nominal_glyph(u32::from(*c)).is_none_or(|glyph| glyph.to_u32() == 0);
            if let Some(letter) = letters.chars().filter(|c| !is_ignored(*c)).find(lacks) {
                let found = (info.cluster as usize, letter);
                line.missing = Some(line.missing.map_or(found, |first| first.min(found)));
            }
            if letters.chars().all(is_ignored) {
                continue;
            }
        }
        let (x, y) = (i64::from(position.x_offset), i64::from(position.y_offset));
        line.glyphs.push(Glyph { glyph: info.glyph_id, x: line.width + x, y });
        line.width += i64::from(position.x_advance);
    }
    Ok(())
}

/// Returns whether a letter is one that is not seen where a font lacks it (Unicode's `Default_Ignorable_Code_Point`).
fn is_ignored(letter: char) -> bool {
    matches!(u32::from(letter),
        0xad | 0x34f | 0x61c | 0x115f..=0x1160 | 0x17b4..=0x17b5 | 0x180b..=0x180f | 0x200b..=0x200f
        | 0x202a..=0x202e | 0x2060..=0x206f | 0x3164 | 0xfe00..=0xfe0f | 0xfeff | 0xffa0 | 0xfff0..=0xfff8
        | 0x1bca0..=0x1bca3 | 0x1d173..=0x1d17a | 0xe0000..=0xe0fff)
}
