//! Keys in events: form-encoded, with `+` for a space.

use percent_encoding::percent_decode;

use crate::{Error, Result};

/// Decodes the key of an S3 event (`application/x-www-form-urlencoded`; AWS and MinIO alike).
///
/// ```
/// use rayfold_pipeline::keys::decode_event_key;
/// assert_eq!(decode_event_key("scripts/a+b/%C3%BC%2B1.txt")?, "scripts/a b/ü+1.txt");
/// # Ok::<(), rayfold_pipeline::Error>(())
/// ```
///
/// Fails on a key that is not UTF-8.
pub fn decode_event_key(encoded: &str) -> Result<String> {
    let blanks: Vec<u8> = encoded.bytes().map(|byte| if byte == b'+' { b' ' } else { byte }).collect();
    let decoded = percent_decode(&blanks).decode_utf8();
    Ok(decoded.map_err(|_| Error::key(encoded, "the key is not UTF-8"))?.into_owned())
}
