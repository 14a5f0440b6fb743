//! The colours of models: factors, vertices and pictures. They have an error of some roundoffs of `f64`.

use glam::DVec3;
use rayfold_scene::assets::{Colors, Model, Slot, Texture, Wrap};

/// A place on a triangle of a model, by its barycentric weights.
pub(super) struct At<'a> {
    pub(super) model: &'a Model,
    pub(super) triangle: usize,
    pub(super) weights: [f64; 3],
    /// Whether the picture that is drawn is computed in linear light.
    pub(super) linear: bool,
}

impl At<'_> {
    /// Returns the colour of the file.
    pub(super) fn color(&self) -> DVec3 {
        let look = &self.model.looks()[self.model.look(self.triangle)];
        let light = |color: DVec3| match (self.model.colors(), self.linear) {
            (Colors::Levels, true) => color.map(to_light),
            (Colors::Levels, false) | (Colors::Linear, _) => color,
        };
        let of_vertices = self
            .model
            .vertex_colors(self.triangle)
            .map(|corners| self.mixed(corners.map(|corner| light(corner.as_dvec3()))));
        let of_picture = self.level(Slot::Color);
        let factors = [look.factor.map(light), of_vertices, of_picture];
        if look.is_missing || factors.iter().all(Option::is_none) {
            return DVec3::splat(0.8);
        }
        let product = factors.into_iter().flatten().fold(DVec3::ONE, |product, factor| product * factor);
        self.shown(product.clamp(DVec3::ZERO, DVec3::ONE))
    }

    /// Returns the light that the file gives off.
    pub(super) fn glow(&self) -> DVec3 {
        let glow = self.model.looks()[self.model.look(self.triangle)].glow;
        self.shown(glow * self.level(Slot::Glow).unwrap_or(DVec3::ONE))
    }

    /// Returns whether the place is a hole, where the triangle has no hits.
    pub(super) fn is_hole(&self) -> bool {
        let look = &self.model.looks()[self.model.look(self.triangle)];
        let of_vertices = self.mixed(self.model.vertex_alphas(self.triangle).map(DVec3::splat)).x;
        let of_picture = || {
            self.texel(Slot::Color, |texture, column, row| DVec3::splat(texture.picture().alpha(column, row)))
        };
        look.cutoff.is_some_and(|cutoff| {
            look.alpha * of_vertices * of_picture().map_or(1.0, |alpha| alpha.x) < cutoff
        })
    }

    /// Returns the level of a picture.
    fn level(&self, slot: Slot) -> Option<DVec3> {
        let decodes = self.linear || self.model.colors() == Colors::Linear;
        self.texel(slot, |texture, column, row| texture.picture().level(column, row, decodes))
    }

    /// Returns the interpolated value of a picture.
    fn texel(&self, slot: Slot, of: impl Fn(&Texture, u32, u32) -> DVec3) -> Option<DVec3> {
        let texture = self.model.looks()[self.model.look(self.triangle)].texture(slot)?;
        let uvs = self.model.picture_uvs(self.triangle, slot);
        let [u, v] = [0, 1].map(|axis: usize| self.mixed(uvs.map(|uv| DVec3::splat(f64::from(uv[axis])))).x);
        let place = texture.transformed(glam::DVec2::new(u, v));
        let v = if self.model.has_uvs_from_top() { place.y } else { -place.y };
        Some(level(texture, [place.x, v], |column, row| of(texture, column, row)))
    }

    fn mixed(&self, corners: [DVec3; 3]) -> DVec3 {
        corners.into_iter().zip(self.weights).map(|(corner, weight)| corner * weight).sum()
    }

    /// Returns light of a glTF file as the numbers of the picture that is drawn.
    fn shown(&self, light: DVec3) -> DVec3 {
        let encodes = self.model.colors() == Colors::Linear && !self.linear;
        let encoded = |x: f64| if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
        if encodes { light.map(encoded) } else { light }
    }
}

fn to_light(x: f64) -> f64 {
    if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

/// Returns the bilinear mean of the pixels around a place. Pixels beyond the edges are those that the wrap modes name.
fn level(texture: &Texture, [u, v]: [f64; 2], pixel: impl Fn(u32, u32) -> DVec3) -> DVec3 {
    let size = [texture.picture().width(), texture.picture().height()].map(i64::from);
    let wrapped = |axis: usize, at: i64| {
        let count = size[axis];
        let at = match texture.wraps()[axis] {
            Wrap::Repeat => at.rem_euclid(count),
            Wrap::Clamp => at.clamp(0, count - 1),
            Wrap::Mirror => {
                let at = at.rem_euclid(2 * count);
                at.min(2 * count - 1 - at)
            }
        };
        at as u32
    };
    let around = |axis: usize, place: f64| {
        let at = place * size[axis] as f64 - 0.5;
        let share = at - at.floor();
        [(wrapped(axis, at.floor() as i64), 1.0 - share), (wrapped(axis, at.floor() as i64 + 1), share)]
    };
    let mut sum = DVec3::ZERO;
    for (row, of_row) in around(1, v) {
        for (column, share) in around(0, u) {
            sum += of_row * share * pixel(column, row);
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use rayfold_scene::assets::{Library, MemoryFiles};
    use rayfold_scene::{Limits, parse_with_files};
    use rayfold_tracer::reference;

    use crate::oracle;
    use crate::oracle::image::tests::png;

    /// Three faces, of which two have pictures; the third has a picture that is missing.
    const OBJ: &[u8] = b"mtllib a.mtl\nv -1.2 -1 0 1 .4 .5\nv 0 -1 .2 .6 1 1\nv 0 1 0\nv -1 1 0\nv 1.2 -1 0\nv 1.1 1 .3\nv 0 1.6 .2\n\
        vt -.3 .1\nvt 1.4 .2\nvt 1.2 1.7\nvt .1 .9\nvn .1 .2 1\nusemtl dim\nf 1/1/1 2/2/1 3/3/1 4/4/1\nusemtl bare\nf 2/1 5/2 6/4 \
        3/3\nusemtl lost\nf 4 3 7\n";
    const MTL: &[u8] =
        b"newmtl dim\nKd .5 .6 1.4\nmap_Kd a.png\nnewmtl bare\nmap_Kd ./a.png\nnewmtl lost\nKd 1 0 0\nmap_Kd lost.png\n";

    fn data(bytes: &[u8]) -> String {
        bytes.iter().fold("data:,".to_string(), |text, byte| text + &format!("%{byte:02x}"))
    }

    /// A glTF file of six triangles: with a transform, wrap modes and colours; with glow by other coordinates; unlit; with a
    /// picture of glow alone; and with holes by vertices and by a picture.
    fn gltf() -> Vec<u8> {
        let mut bytes: Vec<u8> = Vec::new();
        for [x, y, u, v] in [[-1.0, -1.0, -0.4, 0.1], [1.0, -1.0, 1.7, 0.3], [-0.9, 0.9, 0.2, 2.1f32]] {
            let vertex = [x, y, 0.1, u, v, 3.0 * v - 1.0, u, 1.0, v.abs().min(1.0), 0.5];
            vertex.iter().for_each(|number: &f32| bytes.extend(number.to_le_bytes()));
        }
        let accessor = |offset: usize, kind: &str| {
            format!(
                r#"{{"bufferView":0,"byteOffset":{offset},"componentType":5126,"count":3,"type":"{kind}"}}"#
            )
        };
        let mesh = |material: usize, colors: &str| {
            format!(
                r#"{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":1,"TEXCOORD_1":2{colors}}},"material":{material}}}]}}"#
            )
        };
        let colors = r#","COLOR_0":3"#;
        let meshes = [
            mesh(0, colors),
            mesh(1, ""),
            mesh(2, colors),
            mesh(3, ""),
            mesh(4, r#","COLOR_0":4"#),
            mesh(5, ""),
        ]
        .join(",");
        format!(
            r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"mesh":0}},{{"mesh":1,"rotation":[0,0,1,0]}},{{"mesh":2,"translation":
            [1.6,0,0]}},{{"mesh":3,"translation":[-1.8,0.5,0],"scale":[0.7,0.7,-0.7]}},
            {{"mesh":4,"translation":[0.3,0.2,0.6]}},{{"mesh":5,"translation":[-0.5,-0.2,0.9]}}],"meshes":[{meshes}],"materials":[
            {{"pbrMetallicRoughness":{{"baseColorFactor":[0.9,1.3,0.7,0.2],"baseColorTexture":{{"index":1,"extensions":
            {{"KHR_texture_transform":{{"offset":[0.3,0.2],"rotation":0.7,"scale":[1.5,-0.6]}}}}}}}}}},
            {{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0,"texCoord":1}}}},"emissiveFactor":[0.2,0.5,0.1],
            "emissiveTexture":{{"index":1,"extensions":{{"KHR_texture_transform":{{"texCoord":1}}}}}},"extensions":
            {{"KHR_materials_emissive_strength":{{"emissiveStrength":3}}}}}},
            {{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":2}}}},"emissiveFactor":[1,1,1],"extensions":
            {{"KHR_materials_unlit":{{}}}}}},
            {{"pbrMetallicRoughness":{{"baseColorFactor":[0.3,0.2,0.9,1]}},"emissiveFactor":[0.5,0.5,0.4],"emissiveTexture":
            {{"index":0}}}},
            {{"alphaMode":"MASK","alphaCutoff":0.35}},
            {{"alphaMode":"BLEND","pbrMetallicRoughness":{{"baseColorFactor":[0.6,0.9,0.8,0.7],"baseColorTexture":{{"index":1}}}}}}],
            "textures":[{{"source":0}},{{"source":0,"sampler":0}},{{"source":0,"sampler":1}}],"samplers":[{{"wrapS":33648,"wrapT":
            33071}},{{"wrapS":33071,"wrapT":33648}}],"images":[{{"uri":"{}"}}],"accessors":[{},{},{},{},{}],
            "bufferViews":[{{"buffer":0,"byteLength":120,"byteStride":40}}],"buffers":[{{"byteLength":120,"uri":"{}"}}]}}"#,
            data(&png()),
            accessor(0, "VEC3"),
            accessor(12, "VEC2"),
            accessor(20, "VEC2"),
            accessor(28, "VEC3"),
            accessor(20, "VEC4"),
            data(&bytes)
        )
        .into_bytes()
    }

    #[test]
    fn the_reference_colours_models_like_the_oracle() {
        let library = Library::new(MemoryFiles::from([
            ("a.obj", OBJ.to_vec()),
            ("a.mtl", MTL.to_vec()),
            ("a.png", png()),
            ("a.gltf", gltf()),
        ]));
        let stage = "Screen 19 15\nLook .4 .5 5 0 .1 0 44\nIlight .8 .8 .7 -1 -2 -3\nPlight .3 .3 .4 2 2 3\n\
            Material mine own ambient .2 .3 .2 diffuse .6 .7 .8 mirror .1 .1 .1\n\
            Material other diffuse .9 .1 .1\n\
            Material checks own ambient .2 .3 .2 diffuse .6 .7 .8 checker .31 other\n";
        for (file, tone) in ["a.obj", "a.gltf"].into_iter().flat_map(|f| ["plain", "srgb"].map(|t| (f, t))) {
            for surface in ["", " mine", " checks", " flat"] {
                for used in [false, true] {
                    let line = format!("Mesh \"{file}\"{surface}\n");
                    let line = match used {
                        true => format!("Group g\n{line}End\nUse g .1 .2 -.3 10 20 30 .8\n"),
                        false => line,
                    };
                    let text = format!("{stage}Tone {tone}\n{line}Trace");
                    let parsed = parse_with_files("a.txt", text.as_bytes(), &Limits::default(), &library);
                    let script = parsed.script.unwrap_or_else(|| panic!("{:?}", parsed.diagnostics));
                    let scene = script.frame(0).unwrap();
                    let (mut off, mut lit) = (0, 0);
                    for (i, j) in (0..19).flat_map(|i| (0..15).map(move |j| (i, j))) {
                        let (exact, found) = (oracle::color(&scene, i, j), reference::color(&scene, i, j));
                        off += u32::from((exact - found).abs().max_element() > 1e-6);
                        lit += u32::from(exact != glam::DVec3::ZERO);
                    }
                    assert!(lit > 30, "{text}: {lit} pixels are lit");
                    // A ray may pass an edge on the other side.
                    assert!(off <= 1, "{text}: {off} pixels");
                }
            }
        }
    }
}
