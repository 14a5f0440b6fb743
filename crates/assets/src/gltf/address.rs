//! The addresses of buffers and pictures: paths and `data:`.

use crate::error::{Fault, shortened};

/// Returns the path in a percent-encoded address.
pub(super) fn decoded_path(uri: &str) -> Result<String, Fault> {
    let path = percent_encoding::percent_decode_str(uri).decode_utf8();
    Ok(path.map_err(|_| Fault::new(format!("`{}` is not UTF-8", shortened(uri))))?.into_owned())
}

/// Returns the bytes of a `data:` address; `None` for another address.
pub(super) fn data(uri: &str) -> Result<Option<Vec<u8>>, Fault> {
    let (scheme, rest) = uri.split_at_checked(5).unwrap_or_default();
    if !scheme.eq_ignore_ascii_case("data:") {
        return Ok(None);
    }
    let (head, body) = rest.split_once(',').ok_or_else(|| Fault::new("a `data:` address has no comma"))?;
    let body = std::borrow::Cow::from(percent_encoding::percent_decode_str(body));
    if !head.to_ascii_lowercase().ends_with(";base64") {
        return Ok(Some(body.into_owned()));
    }
    let bytes = base64_simd::forgiving_decode_to_vec(&body);
    Ok(Some(bytes.map_err(|_| Fault::new("the data of a `data:` address is not Base64"))?))
}
