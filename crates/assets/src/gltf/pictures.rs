//! The pictures of materials: in files beside the model, in `data:` addresses, and in buffers.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::accessor::Buffers;
use super::address::{data, decoded_path};
use super::document::{Document, Image, Sampler, TextureInfo, TextureTransform};
use crate::error::Fault;
use crate::limits;
use crate::picture::Picture;
use crate::referred::Referred;
use crate::texture::{Texture, Wrap};

/// The pictures of a document, each decoded once.
pub(super) struct Pictures<'a, 'b> {
    /// The name of the model's file.
    name: &'a str,
    document: &'a Document,
    buffers: &'a Buffers,
    referred: &'a mut Referred<'b>,
    /// The pictures by their numbers; `None` for those whose file is missing.
    made: BTreeMap<usize, Option<Arc<Picture>>>,
    warnings: Vec<String>,
}

impl<'a, 'b> Pictures<'a, 'b> {
    pub(super) fn new(
        name: &'a str,
        document: &'a Document,
        buffers: &'a Buffers,
        referred: &'a mut Referred<'b>,
    ) -> Self {
        Self { name, document, buffers, referred, made: BTreeMap::new(), warnings: Vec::new() }
    }

    /// Returns what is missing: a warning for each picture.
    pub(super) fn into_warnings(self) -> Vec<String> {
        self.warnings
    }

    /// Returns a texture of a material, or `None` if its picture is missing. `effect` describes the consequence, for
    /// the warning.
    pub(super) fn texture(&mut self, info: &TextureInfo, effect: &str) -> Result<Option<Texture>, Fault> {
        let number = info.index;
        let texture = self.document.textures.get(number);
        let texture = texture.ok_or_else(|| Fault::new(format!("there is no texture {number}")))?;
        let webp = texture.extensions.webp.as_ref().and_then(|webp| webp.source);
        let Some(image) = webp.or(texture.source) else {
            self.warn(format!("texture {number} has no picture: {effect}"));
            return Ok(None);
        };
        let Some(picture) = self.picture(image, effect)? else { return Ok(None) };
        let wraps = match texture.sampler {
            None => [Wrap::Repeat; 2],
            Some(number) => {
                let sampler = self.document.samplers.get(number);
                wraps(sampler.ok_or_else(|| Fault::new(format!("there is no sampler {number}")))?)?
            }
        };
        let transform = info.extensions.transform.as_ref().map(rows);
        Ok(Some(Texture { wraps, has_own_uvs: coordinates(info) != 0, transform, ..Texture::new(picture) }))
    }

    fn picture(&mut self, number: usize, effect: &str) -> Result<Option<Arc<Picture>>, Fault> {
        if let Some(known) = self.made.get(&number) {
            return Ok(known.clone());
        }
        let image = self.document.images.get(number);
        let image = image.ok_or_else(|| Fault::new(format!("there is no image {number}")))?;
        let what = format!("image {number}");
        if self.made.len() >= limits::FILES {
            return Err(Fault::new(format!("it has more than {} pictures", limits::FILES)));
        }
        let picture = match image {
            Image { uri: Some(uri), .. } => match data(uri)? {
                Some(bytes) => Some(self.referred.embedded(self.name, &what, &bytes)?),
                None => {
                    let path = decoded_path(uri)?;
                    let picture = self.referred.picture(&path)?;
                    if picture.is_none() {
                        let warning = self.referred.absence(&path, effect);
                        self.warn(warning);
                    }
                    picture
                }
            },
            Image { buffer_view: Some(view), .. } => {
                let bytes = self.buffers.view(self.document, *view)?;
                Some(self.referred.embedded(self.name, &what, bytes)?)
            }
            Image { .. } => return Err(Fault::new(format!("{what} has neither a file nor data"))),
        };
        self.made.insert(number, picture.clone());
        Ok(picture)
    }

    fn warn(&mut self, warning: String) {
        if !self.warnings.contains(&warning) {
            self.warnings.push(warning);
        }
    }
}

/// Returns the number of the texture coordinates that a texture uses.
pub(super) fn coordinates(info: &TextureInfo) -> u32 {
    info.extensions.transform.as_ref().and_then(|t| t.tex_coord).unwrap_or(info.tex_coord)
}

/// Returns the rows of `KHR_texture_transform`.
fn rows(transform: &TextureTransform) -> [[f64; 3]; 2] {
    let TextureTransform { offset: [x, y], rotation, scale, .. } = *transform;
    let [s, t] = scale.unwrap_or([1.0; 2]);
    let (sine, cosine) = (libm::sin(rotation), libm::cos(rotation));
    [[cosine * s, sine * t, x], [-sine * s, cosine * t, y]]
}

fn wraps(sampler: &Sampler) -> Result<[Wrap; 2], Fault> {
    let wrap = |mode: Option<u32>| match mode {
        None | Some(10497) => Ok(Wrap::Repeat),
        Some(33071) => Ok(Wrap::Clamp),
        Some(33648) => Ok(Wrap::Mirror),
        Some(other) => Err(Fault::new(format!("a sampler has the wrap mode {other}"))),
    };
    Ok([wrap(sampler.wrap_s)?, wrap(sampler.wrap_t)?])
}
