//! Radiance HDR: bytes of red, green and blue with a common exponent.

use std::sync::OnceLock;

use image::metadata::Orientation;

use super::size::check_size;
use super::{Levels, Picture, unit};
use crate::error::{Fault, shortened};

/// The bytes of the longest header.
const HEAD: usize = 1 << 16;

/// The widths of rows that are compressed channel by channel.
const WIDTHS: std::ops::Range<usize> = 8..32768;

pub(super) fn read(bytes: &[u8]) -> Result<Picture, Fault> {
    let mut lines = bytes[..bytes.len().min(HEAD)].split_inclusive(|b| *b == b'\n');
    let mut taken = 0;
    let mut line = || {
        let line = lines.next().filter(|line| line.ends_with(b"\n"));
        let line = line.ok_or_else(|| Fault::new("its header has no end"))?;
        taken += line.len();
        Ok((line.trim_ascii(), taken))
    };
    loop {
        let (text, _) = line()?;
        if text.is_empty() {
            break;
        }
        if let Some(format) = text.strip_prefix(b"FORMAT=").map(<[u8]>::trim_ascii)
            && format != b"32-bit_rle_rgbe"
        {
            let format = shortened(&String::from_utf8_lossy(format));
            return Err(Fault::new(format!("its format is `{format}`: 32-bit_rle_rgbe is read")));
        }
    }
    let (text, taken) = line()?;
    let (width, height) = size(text)?;
    check_size(width, height)?;
    let (width, height) = (width as usize, height as usize);
    let mut rest = &bytes[taken..];
    let mut levels: Vec<[u8; 4]> = Vec::new();
    for row in 0..height {
        read_row(&mut rest, width, &mut levels).map_err(|fault| {
            let what = fault.unwrap_or("a run is longer than its row");
            Fault::new(format!("{what}, in row {} of {height}", row + 1))
        })?;
    }
    let stored = [width as u32, height as u32];
    let orientation = Orientation::NoTransforms;
    let most = levels.iter().map(|[r, g, b, exponent]| f64::from(*r.max(g).max(b)) * unit(*exponent));
    let largest = most.fold(1.0, f64::max);
    Ok(Picture {
        stored,
        levels: Levels::Shared(levels),
        orientation,
        largest,
        warnings: Vec::new(),
        is_opaque: OnceLock::new(),
    })
}

/// Reads the line of the size: `-Y rows +X columns`.
fn size(line: &[u8]) -> Result<(u32, u32), Fault> {
    let text = String::from_utf8_lossy(line);
    let words: Vec<&str> = text.split_ascii_whitespace().collect();
    if let ["-Y", height, "+X", width] = words[..]
        && let (Ok(height), Ok(width)) = (height.parse(), width.parse())
    {
        return Ok((width, height));
    }
    let shown: String = text.chars().take(40).collect();
    Err(Fault::new(format!("its size is `{shown}`: `-Y rows +X columns` is read")))
}

/// The description of a fault; `None` if a run is longer than its row.
type RowFault = Option<&'static str>;

/// The file ends too soon.
const CUT_OFF: RowFault = Some("the file is cut off");

fn take<const N: usize>(rest: &mut &[u8]) -> Result<[u8; N], RowFault> {
    let (taken, behind) = rest.split_first_chunk().ok_or(CUT_OFF)?;
    *rest = behind;
    Ok(*taken)
}

/// Reads a row and adds it to `levels`.
fn read_row(rest: &mut &[u8], width: usize, levels: &mut Vec<[u8; 4]>) -> Result<(), RowFault> {
    let start = levels.len();
    if let Some(&[2, 2, high, low]) = rest.first_chunk()
        && high < 128
        && WIDTHS.contains(&width)
    {
        *rest = &rest[4..];
        if usize::from(u16::from_be_bytes([high, low])) != width {
            return Err(Some("a row has another width than the picture"));
        }
        levels.resize(start + width, [0; 4]);
        return (0..4).try_for_each(|channel| read_channel(rest, channel, &mut levels[start..]));
    }
    // Pixels as they stand, of which 1 1 1 n repeats the one before.
    let mut shift = 0;
    while levels.len() < start + width {
        let pixel: [u8; 4] = take(rest)?;
        let [1, 1, 1, count] = pixel else {
            levels.push(pixel);
            shift = 0;
            continue;
        };
        let last = levels[start..].last().copied().ok_or(Some("a row begins with a run of nothing"))?;
        let count = usize::from(count) << shift;
        if shift > 24 || levels.len() + count > start + width {
            return Err(None);
        }
        levels.resize(levels.len() + count, last);
        shift += 8;
    }
    Ok(())
}

/// Reads one number of each pixel of a row, in runs.
fn read_channel(rest: &mut &[u8], channel: usize, row: &mut [[u8; 4]]) -> Result<(), RowFault> {
    let mut at = 0;
    while at < row.len() {
        let [code] = take(rest)?;
        let is_run = code > 128;
        let count = usize::from(if is_run { code - 128 } else { code });
        if count == 0 {
            return Err(Some("a run is empty"));
        }
        let pixels = row.get_mut(at..at + count).ok_or(None)?;
        if is_run {
            let [value] = take(rest)?;
            pixels.iter_mut().for_each(|pixel| pixel[channel] = value);
        } else {
            let (values, behind) = rest.split_at_checked(count).ok_or(CUT_OFF)?;
            *rest = behind;
            pixels.iter_mut().zip(values).for_each(|(pixel, value)| pixel[channel] = *value);
        }
        at += count;
    }
    Ok(())
}
