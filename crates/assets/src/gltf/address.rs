//! The addresses of buffers and pictures: paths, and data.

use crate::error::Fault;

/// Returns the path that a percent-encoded address is.
pub(super) fn decoded_path(uri: &str) -> Result<String, Fault> {
    let path = percent_encoding::percent_decode_str(uri).decode_utf8();
    Ok(path.map_err(|_| Fault::new(format!("`{uri}` is not UTF-8")))?.into_owned())
}

/// Returns the bytes of a `data:` address.
pub(super) fn data(uri: &str) -> Result<Vec<u8>, Fault> {
    let (head, body) = uri.split_once(',').ok_or_else(|| Fault::new("a `data:` address has no comma"))?;
    if !head.to_ascii_lowercase().ends_with(";base64") {
        return Ok(percent_encoding::percent_decode_str(body).collect());
    }
    base64_simd::forgiving_decode_to_vec(body.as_bytes())
        .map_err(|_| Fault::new("the data of a `data:` address is not Base64"))
}
