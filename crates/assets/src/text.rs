//! The texts of models, as other systems and editors write them.

use std::borrow::Cow;

/// Returns a text without the byte-order mark before it.
pub(crate) fn unmarked(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}

/// Returns a text whose lines end with line feeds. All lines of old Macs end with carriage returns alone.
pub(crate) fn with_line_feeds(text: &[u8]) -> Cow<'_, [u8]> {
    if memchr::memchr(b'\n', text).is_some() || memchr::memchr(b'\r', text).is_none() {
        return text.into();
    }
    text.iter().map(|byte| if *byte == b'\r' { b'\n' } else { *byte }).collect()
}
