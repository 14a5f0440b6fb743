//! The markers of a JPEG: a file that is cut off, or of a kind that is not read, is refused before it is decoded.

use super::size::check_size;
use crate::error::Fault;

/// Checks the frames of a JPEG, and that it has an end.
pub(super) fn check(bytes: &[u8]) -> Result<(), Fault> {
    walk(bytes, check_frame)
}

/// Returns what is wrong with the markers of a JPEG whose end is missing.
#[must_use]
pub fn jpeg_fault(bytes: &[u8]) -> Option<String> {
    walk(bytes, |_| Ok(())).err().map(|fault| fault.what)
}

/// Goes from marker to marker, and hands each frame's header to `frame`.
fn walk(bytes: &[u8], frame: impl Fn(&[u8]) -> Result<(), Fault>) -> Result<(), Fault> {
    let cut_off = || Fault::new("the file is cut off");
    let mut rest = bytes;
    let mut has_frame = false;
    loop {
        // Any bytes may stand before a marker, and 255 again and again.
        let at = memchr::memchr(0xff, rest).ok_or_else(cut_off)?;
        let (&marker, behind) = rest[at + 1..].split_first().ok_or_else(cut_off)?;
        rest = if marker == 0xff { &rest[at + 1..] } else { behind };
        match marker {
            // Data, a part of a scan, or the start.
            0x00 | 0x01 | 0xd0..=0xd8 | 0xff => continue,
            0xd9 if has_frame => return Ok(()),
            0xd9 => return Err(Fault::new("it ends before its pixels")),
            _ => {}
        }
        let length = rest.first_chunk().map(|length| usize::from(u16::from_be_bytes(*length)));
        let (segment, behind) =
            length.and_then(|length| rest.split_at_checked(length)).ok_or_else(cut_off)?;
        if matches!(marker, 0xc0..=0xcf) && !matches!(marker, 0xc4 | 0xc8 | 0xcc) {
            frame(segment)?;
            has_frame = true;
        }
        rest = behind;
    }
}

fn check_frame(segment: &[u8]) -> Result<(), Fault> {
    let Some(&[_, _, bits, h1, h0, w1, w0, components]) = segment.first_chunk() else {
        return Err(Fault::new("its frame is cut off"));
    };
    if bits != 8 {
        return Err(Fault::new(format!("it has {bits} bits for a level: JPEGs of 8 bits are read")));
    }
    if components == 4 {
        return Err(Fault::new("it is a JPEG of four inks (CMYK): save it as RGB"));
    }
    check_size(u32::from(u16::from_be_bytes([w1, w0])), u32::from(u16::from_be_bytes([h1, h0])))
}
