//! glTF 2.0, as JSON with files beside it and as one binary file.
//!
//! The JSON is read by `serde`; its indices, ranges and nodes are checked here where they are used.

mod accessor;
mod address;
mod document;
mod pictures;

use glam::{DMat3, DMat4, DQuat, DVec3, Vec2};

use self::accessor::Buffers;
use self::address::{data, decoded_path};
use self::document::{Document, Material, Node, Primitive, TextureInfo, Versioned};
use self::pictures::{Pictures, coordinates};
use crate::error::{Fault, shortened};
use crate::limits;
use crate::model::{Colors, Look, NONE, Parts, too_many_triangles, unit};
use crate::referred::Referred;
use crate::texture::Slot;

/// The extensions that a file may require.
const KNOWN: [&str; 5] = [
    "KHR_mesh_quantization",
    "EXT_texture_webp",
    "KHR_texture_transform",
    "KHR_materials_emissive_strength",
    "KHR_materials_unlit",
];

/// Reads a binary file: a header, the JSON, and the first buffer.
pub(crate) fn read_binary(name: &str, bytes: &[u8], referred: &mut Referred<'_>) -> Result<Parts, Fault> {
    let cut = || Fault::new("the file is cut off");
    let number = |at: usize| {
        let four = bytes.get(at..at + 4).ok_or_else(cut)?;
        Ok::<_, Fault>(u32::from_le_bytes([four[0], four[1], four[2], four[3]]) as usize)
    };
    if number(4)? != 2 {
        return Err(Fault::new(format!("it is glTF of version {}, not 2", number(4)?)));
    }
    let bytes = bytes.get(..number(8)?).ok_or_else(cut)?;
    let (mut at, mut json, mut binary) = (12, None, None);
    while at < bytes.len() {
        let (length, kind) = (number(at)?, number(at + 4)?);
        let end = (at + 8).checked_add(length).ok_or_else(cut)?;
        let chunk = bytes.get(at + 8..end).ok_or_else(cut)?;
        match kind {
            0x4e4f_534a if json.is_none() => json = Some(chunk),
            0x004e_4942 if binary.is_none() => binary = Some(chunk),
            _ => {}
        }
        // Chunks begin at multiples of four.
        at = end.next_multiple_of(4);
    }
    read(name, json.ok_or_else(|| Fault::new("it has no JSON"))?, binary, referred)
}

/// Reads a JSON file.
pub(crate) fn read_text(name: &str, text: &[u8], referred: &mut Referred<'_>) -> Result<Parts, Fault> {
    read(name, text, None, referred)
}

fn read(name: &str, json: &[u8], binary: Option<&[u8]>, referred: &mut Referred<'_>) -> Result<Parts, Fault> {
    bounded(json)?;
    let document: Document = serde_json::from_slice(json).map_err(|error| {
        // Other versions have other types.
        match serde_json::from_slice(json) {
            Ok(Versioned { asset }) if !asset.version.is_empty() && !asset.version.starts_with("2.") => {
                Fault::new(format!("it is glTF of version {}, not 2", shortened(&asset.version)))
            }
            _ => Fault::at(error.line(), format!("its JSON: {error}")),
        }
    })?;
    if !document.asset.version.starts_with("2.") {
        return Err(Fault::new("it is not glTF of version 2"));
    }
    if let Some(unknown) = document.extensions_required.iter().find(|e| !KNOWN.contains(&e.as_str())) {
        return Err(referred.extension(name, unknown));
    }
    for (count, what) in [(document.nodes.len(), "nodes"), (document.materials.len(), "materials")] {
        if count > limits::NODES {
            return Err(Fault::new(format!("it has more than {} {what}", limits::NODES)));
        }
    }
    let buffers = buffers(&document, binary, referred)?;
    let mut parts = Parts { space: Colors::Linear, ..Parts::default() };
    parts.looks = document.materials.iter().map(look).collect();
    parts.looks.push(Look { factor: Some(DVec3::ONE), ..Look::PLAIN });
    let mut maker =
        Maker { document: &document, buffers: &buffers, parts, has_normals: false, left_out: false };
    maker.scene()?;
    let Maker { mut parts, has_normals, left_out, .. } = maker;
    for own in parts.own_uvs.iter_mut().filter(|own| !own.is_empty()) {
        own.resize(parts.positions.len(), Vec2::ZERO);
    }
    if !parts.colors.is_empty() {
        parts.colors.resize(parts.positions.len(), glam::Vec3::ONE);
    }
    if parts.alphas.iter().all(|alpha| *alpha == 1.0) {
        parts.alphas.clear();
    } else {
        parts.alphas.resize(parts.positions.len(), 1.0);
    }
    paint(name, (&document, &buffers), referred, &mut parts)?;
    if !has_normals {
        parts.normal_of = Vec::new();
    }
    if left_out {
        parts.warnings.push("points and lines are left out".into());
    }
    if let Some(unused) = unused(&document) {
        parts.warnings.push(unused);
    }
    Ok(parts)
}

/// The maximum number of objects and values of a JSON. Each takes up to some hundred bytes once it is read.
const OBJECTS: usize = 1 << 21;
const VALUES: usize = 1 << 25;

/// Refuses a JSON that would fill the memory: a brace begins an object, and a comma separates values.
fn bounded(json: &[u8]) -> Result<(), Fault> {
    for (byte, most, what) in [(b'{', OBJECTS, "objects"), (b',', VALUES, "values")] {
        if memchr::memchr_iter(byte, json).nth(most).is_some() {
            return Err(Fault::new(format!("its JSON has more than {most} {what}")));
        }
    }
    Ok(())
}

/// Returns the contents of the buffers.
fn buffers(
    document: &Document,
    binary: Option<&[u8]>,
    referred: &mut Referred<'_>,
) -> Result<Buffers, Fault> {
    let mut contents = Vec::new();
    let mut left = limits::FILE_BYTES;
    for (number, buffer) in document.buffers.iter().enumerate() {
        let mut content = match (&buffer.uri, binary) {
            (None, Some(binary)) if number == 0 => binary.to_vec(),
            (None, _) => return Err(Fault::new(format!("buffer {number} has neither a file nor data"))),
            (Some(uri), _) => match data(uri)? {
                Some(content) => content,
                None => {
                    let path = decoded_path(uri)?;
                    referred.read(&path)?.ok_or_else(|| referred.absent(&path))?
                }
            },
        };
        if (content.len() as u64) < buffer.byte_length {
            return Err(Fault::new(format!(
                "buffer {number} has {} bytes of {}: it is cut off",
                content.len(),
                buffer.byte_length
            )));
        }
        content.truncate(buffer.byte_length as usize);
        left = left
            .checked_sub(content.len() as u64)
            .ok_or_else(|| Fault::new(format!("its buffers have more than {} bytes", limits::FILE_BYTES)))?;
        contents.push(content);
    }
    Ok(Buffers { contents })
}

/// Returns the colour and glow of a material, without its pictures.
fn look(material: &Material) -> Look {
    let [r, g, b, alpha] = material.pbr_metallic_roughness.base_color_factor.unwrap_or([1.0; 4]);
    let unlit = material.extensions.unlit.is_some();
    let strength = material.extensions.strength.as_ref().and_then(|strength| strength.emissive_strength);
    let glow = DVec3::from(material.emissive_factor.unwrap_or_default()) * strength.unwrap_or(1.0).max(0.0);
    // Light without end would be none.
    let glow = glow.clamp(DVec3::MIN, DVec3::MAX);
    // The colour of what is unlit replaces its light.
    Look {
        factor: Some([r, g, b].into()),
        glow: if unlit { DVec3::ZERO } else { glow },
        unlit,
        alpha,
        cutoff: cutoff(material),
        ..Look::PLAIN
    }
}

/// Returns the texture of a material for a use. That of a glow without light does not count.
fn texture(material: &Material, slot: Slot) -> Option<&TextureInfo> {
    match slot {
        Slot::Color => material.pbr_metallic_roughness.base_color_texture.as_deref(),
        Slot::Glow => material.emissive_texture.as_deref().filter(|_| look(material).glow != DVec3::ZERO),
    }
}

/// Sets the pictures of the looks that faces use.
fn paint(
    name: &str,
    (document, buffers): (&Document, &Buffers),
    referred: &mut Referred<'_>,
    parts: &mut Parts,
) -> Result<(), Fault> {
    let mut is_used = vec![false; parts.looks.len()];
    parts.look_of.iter().for_each(|look| is_used[*look as usize] = true);
    let mut pictures = Pictures::new(name, document, buffers, referred);
    let used = document.materials.iter().zip(&mut parts.looks).zip(is_used).filter(|(_, is_used)| *is_used);
    let mut blends = false;
    for ((material, look), _) in used {
        blends |= material.alpha_mode.as_deref() == Some("BLEND");
        if let Some(info) = texture(material, Slot::Color) {
            look.texture = pictures.texture(info, "what has this picture is grey")?;
            look.is_missing = look.texture.is_none();
        }
        if let Some(info) = texture(material, Slot::Glow) {
            look.glow_texture = pictures.texture(info, "what has this picture of its glow does not glow")?;
            if look.glow_texture.is_none() {
                look.glow = DVec3::ZERO;
            }
        }
    }
    parts.warnings.extend(pictures.into_warnings());
    if blends {
        let warning =
            "what blends (alphaMode BLEND) is opaque where its alpha is .5 or more, and has holes elsewhere";
        parts.warnings.push(warning.into());
    }
    Ok(())
}

/// The most extensions that a warning names.
const NAMED: usize = 5;

/// Names the parts of a file that are not used.
fn unused(document: &Document) -> Option<String> {
    let any = |has: fn(&Material) -> bool| document.materials.iter().any(has);
    let targets = |mesh: &document::Mesh| mesh.primitives.iter().any(|p| !p.targets.is_empty());
    let parts = [
        (!document.skins.is_empty(), "skins"),
        (!document.animations.is_empty(), "animations"),
        (document.meshes.iter().any(targets), "morph targets"),
        (!document.cameras.is_empty(), "cameras"),
        (document.extensions_used.iter().any(|e| e == "KHR_lights_punctual"), "lights"),
        (any(|m| m.pbr_metallic_roughness.metallic_factor.is_some()), "metal"),
        (any(|m| m.pbr_metallic_roughness.roughness_factor.is_some()), "roughness"),
        (
            any(|m| m.pbr_metallic_roughness.metallic_roughness_texture.is_some()),
            "maps of metal and roughness",
        ),
        (any(|m| m.normal_texture.is_some()), "normal maps"),
        (any(|m| m.occlusion_texture.is_some()), "occlusion maps"),
    ];
    let mut names: Vec<String> =
        parts.iter().filter(|(is_there, _)| *is_there).map(|(_, name)| (*name).into()).collect();
    // What is compressed, and not required, is there without compression as well.
    let is_unknown = |extension: &&String| {
        !KNOWN.contains(&extension.as_str())
            && *extension != "KHR_lights_punctual"
            && !extension.ends_with("_compression")
    };
    let unknown: Vec<&String> = document.extensions_used.iter().filter(is_unknown).collect();
    names.extend(unknown.iter().take(NAMED).map(|extension| shortened(extension)));
    if unknown.len() > NAMED {
        names.push(format!("{} more extensions", unknown.len() - NAMED));
    }
    (!names.is_empty()).then(|| format!("its {} are not used", names.join(", ")))
}

/// A model that is made of the nodes of a scene.
struct Maker<'a> {
    document: &'a Document,
    buffers: &'a Buffers,
    parts: Parts,
    has_normals: bool,
    /// Whether there are points or lines.
    left_out: bool,
}

impl Maker<'_> {
    /// Adds the default scene. Without a default it adds the first scene, and without any scene all root nodes.
    fn scene(&mut self) -> Result<(), Fault> {
        let document = self.document;
        let roots = match document.scene {
            Some(number) => {
                let scene = document.scenes.get(number);
                scene.ok_or_else(|| Fault::new(format!("there is no scene {number}")))?.nodes.clone()
            }
            None => match document.scenes.first() {
                Some(scene) => scene.nodes.clone(),
                None => {
                    let mut is_child = vec![false; document.nodes.len()];
                    for child in document.nodes.iter().flat_map(|node| &node.children) {
                        if let Some(is_child) = is_child.get_mut(*child) {
                            *is_child = true;
                        }
                    }
                    (0..document.nodes.len()).filter(|node| !is_child[*node]).collect()
                }
            },
        };
        // A stack instead of recursion, and each node once: neither depth nor circles can hurt.
        let mut is_drawn = vec![false; document.nodes.len()];
        let mut pending: Vec<(usize, DMat4)> =
            roots.into_iter().rev().map(|node| (node, DMat4::IDENTITY)).collect();
        while let Some((number, outer)) = pending.pop() {
            let node = document.nodes.get(number);
            let node = node.ok_or_else(|| Fault::new(format!("there is no node {number}")))?;
            if std::mem::replace(&mut is_drawn[number], true) {
                return Err(Fault::new(format!("node {number} has two parents, or is within itself")));
            }
            let place = outer * transform(node);
            if let Some(mesh) = node.mesh {
                let of = document.meshes.get(mesh);
                let of = of.ok_or_else(|| Fault::new(format!("there is no mesh {mesh}")))?;
                of.primitives.iter().try_for_each(|primitive| self.add(primitive, place))?;
            }
            pending.extend(node.children.iter().rev().map(|child| (*child, place)));
        }
        Ok(())
    }

    fn add(&mut self, primitive: &Primitive, place: DMat4) -> Result<(), Fault> {
        let Self { document, buffers, parts, .. } = self;
        let mode = primitive.mode.unwrap_or(4);
        if mode < 4 {
            self.left_out = true;
            return Ok(());
        }
        let Some(position) = primitive.attributes.get("POSITION") else { return Ok(()) };
        let first = parts.positions.len();
        let most = (limits::VERTICES - first) as u64;
        if document.accessors.get(position).is_some_and(|accessor| accessor.count > most) {
            return Err(Fault::new(format!("it has more than {} vertices", limits::VERTICES)));
        }
        let linear = DMat3::from_mat4(place);
        let mirrors = linear.determinant() < 0.0;
        let side = if mirrors { -1.0 } else { 1.0 };
        let count = buffers.each(document, position, &[("VEC3", 3)], |p: [f64; 3]| {
            parts.positions.push(place.transform_point3(p.into()));
        })?;
        let same = |what: &str, other: usize| match other == count {
            true => Ok(()),
            false => Err(Fault::new(format!("{other} {what} of {count} vertices"))),
        };
        let first_normal = parts.normals.len();
        let normal = primitive.attributes.get("NORMAL");
        if let Some(normal) = normal {
            let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis];
            let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * side;
            let normals = buffers.each(document, normal, &[("VEC3", 3)], |n: [f64; 3]| {
                parts.normals.push(unit((cofactors * DVec3::from(n)).normalize_or_zero().as_vec3()));
            })?;
            same("normals", normals)?;
            self.has_normals = true;
        }
        let look = match primitive.material {
            None => document.materials.len(),
            Some(material) if material < document.materials.len() => material,
            Some(material) => return Err(Fault::new(format!("there is no material {material}"))),
        };
        let first_uv = parts.uvs.len();
        let uv = primitive.attributes.get("TEXCOORD_0");
        if let Some(uv) = uv {
            let uvs = buffers.each(document, uv, &[("VEC2", 2)], |[u, v]: [f64; 2]| {
                parts.uvs.push(Vec2::new(u as f32, v as f32));
            })?;
            same("texture coordinates", uvs)?;
        }
        if let Some(material) = document.materials.get(look) {
            for slot in [Slot::Color, Slot::Glow] {
                let Some(info) = texture(material, slot) else { continue };
                let set = coordinates(info);
                let accessor = primitive.attributes.get(&format!("TEXCOORD_{set}"));
                if accessor.is_none() {
                    let warning = format!("what has no TEXCOORD_{set} shows its picture at (0, 0)");
                    if !parts.warnings.contains(&warning) {
                        parts.warnings.push(warning);
                    }
                }
                if set == 0 {
                    continue;
                }
                let own = &mut parts.own_uvs[slot as usize];
                own.resize(first, Vec2::ZERO);
                if let Some(accessor) = accessor {
                    let uvs = buffers.each(document, accessor, &[("VEC2", 2)], |[u, v]: [f64; 2]| {
                        own.push(Vec2::new(u as f32, v as f32));
                    })?;
                    same("texture coordinates", uvs)?;
                }
                own.resize(first + count, Vec2::ZERO);
            }
        }
        if let Some(color) = primitive.attributes.get("COLOR_0") {
            parts.colors.resize(first, glam::Vec3::ONE);
            let kinds = [("VEC3", 3), ("VEC4", 4)];
            let has_alpha = document.accessors.get(color).is_some_and(|accessor| accessor.kind == "VEC4");
            let is_cut = has_alpha && document.materials.get(look).is_some_and(|m| cutoff(m).is_some());
            if is_cut {
                parts.alphas.resize(first, 1.0);
            }
            let colors = buffers.each(document, color, &kinds, |[r, g, b, alpha]: [f64; 4]| {
                parts.colors.push(DVec3::new(r, g, b).as_vec3());
                if is_cut {
                    parts.alphas.push(alpha as f32);
                }
            })?;
            same("colours", colors)?;
        } else if !parts.colors.is_empty() {
            parts.colors.resize(parts.positions.len(), glam::Vec3::ONE);
        }
        let mut order: Vec<u32> = Vec::new();
        match primitive.indices {
            Some(indices) => {
                buffers.each(document, indices, &[("SCALAR", 1)], |[index]: [f64; 1]| {
                    order.push(index as u32)
                })?;
            }
            None => order.extend(0..count as u32),
        }
        if let Some(index) = order.iter().find(|index| **index as usize >= count) {
            return Err(Fault::new(format!("a triangle has the vertex {index} of {count}")));
        }
        let has = |is_there: bool, first: usize, of: [u32; 3]| {
            if is_there { of.map(|i| first as u32 + i) } else { [NONE; 3] }
        };
        let mut add = |[a, b, c]: [u32; 3]| {
            let of = if mirrors { [b, a, c] } else { [a, b, c] };
            parts.triangles.push(of.map(|i| first as u32 + i));
            parts.normal_of.push(has(normal.is_some(), first_normal, of));
            parts.uv_of.push(has(uv.is_some(), first_uv, of));
            parts.look_of.push(look as u32);
            if parts.triangles.len() > limits::TRIANGLES { Err(too_many_triangles()) } else { Ok(()) }
        };
        match mode {
            4 => order.chunks_exact(3).try_for_each(|of| add([of[0], of[1], of[2]]))?,
            5 => {
                for (k, of) in order.windows(3).enumerate() {
                    add(if k % 2 == 0 { [of[0], of[1], of[2]] } else { [of[1], of[0], of[2]] })?;
                }
            }
            6 => {
                for pair in order.get(1..).unwrap_or_default().windows(2) {
                    add([order[0], pair[0], pair[1]])?;
                }
            }
            _ => return Err(Fault::new(format!("a primitive has the mode {mode}"))),
        }
        if !parts.colors.is_empty() {
            parts.colors.resize(parts.positions.len(), glam::Vec3::ONE);
        }
        Ok(())
    }
}

/// Returns the alpha below which faces of a material have no hits.
fn cutoff(material: &Material) -> Option<f64> {
    match material.alpha_mode.as_deref() {
        Some("MASK") => Some(material.alpha_cutoff.unwrap_or(0.5)),
        Some("BLEND") => Some(0.5),
        _ => None,
    }
}

/// Returns the transform of a node.
fn transform(node: &Node) -> DMat4 {
    if let Some(matrix) = &node.matrix {
        return DMat4::from_cols_array(matrix);
    }
    let scale = node.scale.map_or(DVec3::ONE, DVec3::from);
    let rotation = node.rotation.map_or(DQuat::IDENTITY, |q| {
        let rotation = DQuat::from_array(q);
        if rotation.length_squared() > 0.0 { rotation.normalize() } else { DQuat::IDENTITY }
    });
    DMat4::from_scale_rotation_translation(scale, rotation, node.translation.map_or(DVec3::ZERO, DVec3::from))
}
