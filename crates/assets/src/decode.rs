//! A model from the bytes of its file, whose content decides what it is.

use crate::error::{AssetError, Fault};
use crate::model::{Model, Parts};
use crate::referred::Referred;
use crate::text::{unmarked, with_line_feeds};
use crate::{gltf, obj, ply, stl};

/// Makes a model of the bytes of the file with this name, with the normals of the file.
///
/// # Errors
/// Fails if the content of the file, or of a file that it requires, is faulty.
pub fn decode(name: &str, bytes: &[u8], referred: &mut Referred<'_>) -> Result<Model, AssetError> {
    let parts = read(name, bytes, referred);
    let parts = parts.map_err(|fault| referred.error.take().unwrap_or_else(|| fault.of(name)))?;
    let model = Model::new(parts).map_err(|fault| fault.of(name))?;
    model.ok_or_else(|| AssetError::NoTriangle { name: name.into() })
}

fn read(name: &str, bytes: &[u8], referred: &mut Referred<'_>) -> Result<Parts, Fault> {
    if bytes.starts_with(b"glTF") {
        return gltf::read_binary(name, bytes, referred);
    }
    let text = unmarked(bytes);
    if text.starts_with(b"ply") {
        return ply::read(text);
    }
    if stl::is_binary(bytes) {
        return stl::read_binary(bytes);
    }
    let text = &*with_line_feeds(text);
    if text.trim_ascii_start().starts_with(b"{") {
        return gltf::read_text(name, text, referred);
    }
    if stl::is_text(text) {
        return stl::read_text(text);
    }
    // Foreign bytes would be lines that say nothing.
    if text[..text.len().min(4096)].contains(&0) {
        return Err(stl::of_another_length(name, bytes).unwrap_or_else(Fault::no_model));
    }
    obj::read(text, referred)
}
