//! Pictures of models: where they are found, how they lie, and what is wrong with them.

use std::io::Cursor;
use std::sync::Arc;

use glam::{DVec2, DVec3, Vec2};
use rayfold_assets::{AssetError, Closure, Library, MemoryFiles, Model, Slot, Smoothing, Wrap};

fn picture(width: u32, height: u32, format: image::ImageFormat) -> Vec<u8> {
    let picture = image::RgbImage::from_fn(width, height, |x, y| image::Rgb([x as u8, y as u8, 77]));
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

fn png() -> Vec<u8> {
    picture(4, 2, image::ImageFormat::Png)
}

const OBJ: &str =
    "mtllib a.mtl\nv 0 0 0 1 .5 .5\nv 1 0 0\nv 0 1 0\nvt .1 .2\nvt .3 .4\nusemtl m\nf 1/1 2/2 3/1\n";

/// Reads a model whose picture is that of `mtl`, with a file of this name.
fn read_obj(obj: &str, mtl: &str, name: &str, bytes: Vec<u8>) -> Result<Arc<Model>, AssetError> {
    let files = [("a.obj", obj.into()), ("a.mtl", mtl.into()), (name, bytes)];
    Library::new(MemoryFiles::from(files)).model("a.obj", Smoothing::OfFile)
}

fn color(model: &Model, level: DVec3) -> DVec3 {
    model.color(model.look(0), model.vertex_colors(0), [0.0, 1.0, 0.0], level, false)
}

#[test]
fn a_picture_of_an_obj_is_that_of_its_material() {
    for (path, name) in [
        ("wood.png", "wood.png"),
        (r"C:\Users\me\my wood 2.png", "my wood 2.png"),
        ("./textures/wood.png  ", "wood.png"),
        ("a -s 1.png", "a -s 1.png"),
    ] {
        let mtl = format!("newmtl m\nKd .5 1 1\nmap_Kd {path}\r\n");
        let model = read_obj(OBJ, &mtl, name, png()).unwrap_or_else(|error| panic!("{path}: {error}"));
        let texture = model.looks()[model.look(0)].texture(Slot::Color).unwrap();
        assert_eq!((texture.picture().width(), texture.wraps()), (4, [Wrap::Repeat; 2]), "{path}");
        assert_eq!(model.picture_uvs(0, Slot::Color)[1], Vec2::new(0.3, 0.4));
        assert_eq!(color(&model, DVec3::new(0.5, 0.25, 1.0)), DVec3::new(0.25, 0.25, 1.0), "{path}");
        assert!(model.warnings().is_empty() && !model.has_uvs_from_top(), "{:?}", model.warnings());
    }
}

#[test]
fn what_other_programs_write_is_read_or_said() {
    let warnings = |obj: &str, mtl: &str, name: &str| {
        let model = read_obj(obj, mtl, name, png()).unwrap();
        let has_picture = model.looks()[model.look(0)].texture(Slot::Color).is_some();
        (has_picture, model.warnings().to_vec())
    };
    assert_eq!(warnings(OBJ, "newmtl m\nmap_kd r.png\n", "r.png"), (true, vec![]), "in small letters");
    let other_case = "there is no file `R.PNG` (there is `r.png`: names are compared byte for byte): what has this picture is grey";
    assert_eq!(warnings(OBJ, "newmtl m\nmap_Kd R.PNG\n", "r.png"), (false, vec![other_case.into()]));
    let empty = "line 2 of `a.mtl`: `map_Kd` names no picture";
    assert_eq!(warnings(OBJ, "newmtl m\nmap_Kd\n", "r.png"), (false, vec![empty.into()]));
    let unknown = "no library has the material `m`: what has it is grey";
    let (_, said) = warnings(OBJ, "newmtl other\nKd 1 0 0\n", "r.png");
    assert!(said.contains(&unknown.into()), "{said:?}");
}

#[test]
fn factors_multiply_before_they_are_clamped() {
    let model = read_obj(OBJ, "newmtl m\nKd 2 2 2\nmap_Kd a.png", "a.png", png()).unwrap();
    assert_eq!(color(&model, DVec3::splat(0.25)), DVec3::splat(0.5));
    assert_eq!(color(&model, DVec3::splat(0.75)), DVec3::ONE);
    let half = model.color(model.look(0), model.vertex_colors(0), [1.0, 0.0, 0.0], DVec3::splat(0.1), true);
    assert!(half.x > 0.4 && half.x < half.y * 5.0, "factors are decoded, those above 1 too: {half}");
}

#[test]
fn what_lacks_its_picture_is_grey_whatever_its_factors() {
    let model = read_obj(OBJ, "newmtl m\nKd .1 0 0\nmap_Kd lost/a.png", "b.png", png()).unwrap();
    assert_eq!(color(&model, DVec3::ONE), DVec3::splat(0.8));
    assert_eq!(model.warnings(), ["there is no file `lost/a.png`: what has this picture is grey"]);
    let library = Library::new(MemoryFiles::from([("a.obj", OBJ.into())]));
    let model = library.model("a.obj", Smoothing::OfFile).unwrap();
    assert_eq!(color(&model, DVec3::ONE), DVec3::splat(0.8), "without the .mtl too");
    let unnamed = OBJ.replace("usemtl m\n", "");
    let library = Library::new(MemoryFiles::from([("a.obj", unnamed.into())]));
    let model = library.model("a.obj", Smoothing::OfFile).unwrap();
    assert_eq!(
        model.color(model.look(0), model.vertex_colors(0), [1.0, 0.0, 0.0], DVec3::ONE, false).y,
        0.5,
        "it has no material"
    );
}

#[test]
fn files_of_pictures_are_among_those_of_a_model() {
    let mut files = MemoryFiles::from([
        ("a.obj", OBJ.into()),
        ("a.mtl", b"newmtl m\nmap_Kd x/b.png\nnewmtl n\nmap_Kd c.png".to_vec()),
    ]);
    let sources = |files: &MemoryFiles| {
        let library = Library::new(files.clone());
        library.model("a.obj", Smoothing::OfFile).unwrap();
        library.sources("a.obj").into_iter().map(|(name, _)| name).collect::<Vec<_>>()
    };
    // The picture of a material that no face has is not read.
    assert_eq!(sources(&files), ["a.obj", "a.mtl", "b.png"]);
    files.insert("b.png", png());
    assert_eq!(sources(&files), ["a.obj", "a.mtl", "b.png"]);
}

#[test]
fn a_model_is_made_anew_when_its_picture_comes() {
    use std::sync::Mutex;

    struct Shared(Arc<Mutex<MemoryFiles>>);

    impl rayfold_assets::Files for Shared {
        fn names(&self) -> Vec<String> {
            self.0.lock().unwrap().names()
        }

        fn look(&self, name: &str) -> Result<Option<rayfold_assets::FileInfo>, String> {
            self.0.lock().unwrap().look(name)
        }

        fn read(&self, name: &str) -> Result<Vec<u8>, String> {
            self.0.lock().unwrap().read(name)
        }
    }

    let files = MemoryFiles::from([("a.obj", OBJ.into()), ("a.mtl", b"newmtl m\nmap_Kd b.png".to_vec())]);
    let files = Arc::new(Mutex::new(files));
    let library = Library::new(Shared(files.clone()));
    let has_picture = || {
        let model = library.model("a.obj", Smoothing::OfFile).unwrap();
        model.looks()[model.look(0)].texture(Slot::Color).map(|texture| texture.picture().width())
    };
    assert_eq!(has_picture(), None);
    files.lock().unwrap().insert("b.png", png());
    assert_eq!(has_picture(), Some(4));
    files.lock().unwrap().insert("b.png", picture(7, 1, image::ImageFormat::Jpeg));
    assert_eq!(has_picture(), Some(7));
}

#[test]
fn corners_without_coordinates_are_at_the_corner_of_a_picture() {
    let mtl = "newmtl m\nmap_Kd a.png";
    let none = read_obj(&OBJ.replace("/1", "").replace("/2", ""), mtl, "a.png", png()).unwrap();
    assert_eq!(none.picture_uvs(0, Slot::Color), [Vec2::ZERO; 3]);
    assert_eq!(none.warnings(), ["its pictures are seen at (0, 0): it has no texture coordinates"]);
    let one = read_obj(&OBJ.replace("1/1", "1"), mtl, "a.png", png()).unwrap();
    assert_eq!(one.picture_uvs(0, Slot::Color)[0], Vec2::ZERO);
    assert_eq!(one.warnings(), ["corners without texture coordinates have (0, 0)"]);
}

#[test]
fn what_is_wrong_with_a_picture_of_an_obj_is_said() {
    let hdr = b"#?RGBE\n\n-Y 1 +X 1\n\x01\x02\x03\x80".to_vec();
    for (map, bytes, message) in [
        (
            "-s 2 2 1 a.png",
            png(),
            "`a.obj`: in `a.mtl`, line 2: an option of `map_Kd`: expected a file name alone",
        ),
        (
            "a.png -clamp on",
            png(),
            "`a.obj`: in `a.mtl`, line 2: an option of `map_Kd`: expected a file name alone",
        ),
        ("a.png", b"GIF89a".to_vec(), "`a.png`: it is a GIF"),
        ("a.png", png()[..50].to_vec(), "`a.png`: it cannot be decoded: the file is cut off"),
        ("a.png", hdr, "`a.png` is a picture of light (HDR or EXR), which only a `Sky` takes"),
        (
            "textures/.png",
            png(),
            "`a.obj`: in `a.mtl`, line 2: it refers to `textures/.png`, but the name of a file does not begin with a dot",
        ),
        (
            "b.png\nnewmtl n\nmap_Kd x/a.png\nnewmtl m\nmap_Kd y/a.mtl",
            png(),
            "`a.obj`: in `a.mtl`, line 6: it refers to both `a.mtl` and `y/a.mtl`, which are one file here",
        ),
    ] {
        let error = read_obj(OBJ, &format!("newmtl m\nmap_Kd {map}"), "a.png", bytes).unwrap_err();
        assert_eq!(error.to_string(), message);
    }
}

/// Returns a glTF file of a triangle with a material, and further parts. `{DATA}` is a picture as Base64.
fn gltf(material: &str, parts: &str) -> String {
    let mut bytes: Vec<u8> = Vec::new();
    for number in [
        0.0, 0.0, 0.0, 0.25, 0.5, 0.5, 0.75, 1.0, 0.0, 0.0, 1.0, 0.5, 0.0, 0.25, 0.0, 1.0, 0.0, 0.5, 0.5,
        1.0, 1.0f32,
    ] {
        bytes.extend(number.to_le_bytes());
    }
    let accessor = |offset: usize, kind: &str| {
        format!(r#"{{"bufferView":0,"byteOffset":{offset},"componentType":5126,"count":3,"type":"{kind}"}}"#)
    };
    let encoded = base64_simd::STANDARD.encode_to_string(&bytes);
    format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,
        "TEXCOORD_0":1,"TEXCOORD_1":2}},"material":0}}]}}],"materials":[{{{material}}}],"accessors":[{},{},{}],"bufferViews":
        [{{"buffer":0,"byteLength":84,"byteStride":28}}],"buffers":[{{"byteLength":84,"uri":"data:;base64,{encoded}"}}]{parts}}}"#,
        accessor(0, "VEC3"),
        accessor(12, "VEC2"),
        accessor(20, "VEC2"),
    )
    .replace("{DATA}", &base64_simd::STANDARD.encode_to_string(png()))
}

fn read(text: &str) -> Result<Arc<Model>, AssetError> {
    let files =
        [("a.gltf", text.into()), ("a b.png", png()), ("a.webp", picture(3, 3, image::ImageFormat::WebP))];
    Library::new(MemoryFiles::from(files)).model("a.gltf", Smoothing::OfFile)
}

/// The parts of a file with one picture.
const ONE: &str = r#","textures":[{"source":0}],"images":[{"uri":"data:image/png;base64,{DATA}"}]"#;
const COLOR: &str =
    r#""pbrMetallicRoughness":{"baseColorFactor":[0.5,1,1,1],"baseColorTexture":{"index":0}}"#;

fn width(model: &Model, slot: Slot) -> Option<u32> {
    model.looks()[model.look(0)].texture(slot).map(|texture| texture.picture().width())
}

#[test]
fn pictures_of_gltf_are_in_files_addresses_and_buffers() {
    for (parts, expected) in [
        (ONE, 4),
        (r#","textures":[{"source":0}],"images":[{"uri":"maps/a%20b.png"}]"#, 4),
        (
            r#","textures":[{"source":0,"extensions":{"EXT_texture_webp":{"source":1}}}],"images":[{"uri":"none.png"},{"uri":"a.webp"}]"#,
            3,
        ),
        (
            r#","textures":[{"extensions":{"EXT_texture_webp":{"source":0}}}],"images":[{"uri":"a.webp"}],"extensionsRequired":["EXT_texture_webp"]"#,
            3,
        ),
    ] {
        let model = read(&gltf(COLOR, parts)).unwrap_or_else(|error| panic!("{parts}: {error}"));
        assert_eq!(width(&model, Slot::Color), Some(expected), "{parts}");
        assert_eq!(model.warnings(), &[] as &[String]);
        assert_eq!(
            model.color(model.look(0), model.vertex_colors(0), [1.0, 0.0, 0.0], DVec3::splat(0.5), true),
            DVec3::new(0.25, 0.5, 0.5)
        );
    }
    // In the same buffer as the vertices, as exporters of binary files write it.
    let text =
        gltf(COLOR, r#","textures":[{"source":0}],"images":[{"bufferView":1,"mimeType":"image/png"}]"#);
    let start = text.find("data:;base64,").unwrap();
    let end = start + text[start..].find('"').unwrap();
    let mut buffer = base64_simd::STANDARD.decode_to_vec(&text[start + 13..end]).unwrap();
    let json = format!("{}{}", &text[..start], &text[end..]).replace(r#","uri":"""#, "");
    buffer.extend(png());
    let json = json.replace(
        r#""buffers":[{"byteLength":84}]"#,
        &format!(r#""buffers":[{{"byteLength":{}}}]"#, buffer.len()),
    );
    let view = format!(r#""byteStride":28}},{{"buffer":0,"byteOffset":84,"byteLength":{}}}"#, png().len());
    let mut json = json.replace(r#""byteStride":28}"#, &view).into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((28 + json.len() as u32 + buffer.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &buffer)] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    let binary = read_bytes(bytes).unwrap();
    assert_eq!(width(&binary, Slot::Color), Some(4));
}

fn read_bytes(bytes: Vec<u8>) -> Result<Arc<Model>, AssetError> {
    Library::new(MemoryFiles::from([("a.glb", bytes)])).model("a.glb", Smoothing::OfFile)
}

#[test]
fn textures_of_gltf_have_their_coordinates_and_places() {
    let material = r#""pbrMetallicRoughness":{"baseColorTexture":{"index":0,"texCoord":1,"extensions":{"KHR_texture_transform":
        {"offset":[0.5,0.25],"rotation":1.5707963267948966,"scale":[2,3]}}}},"emissiveFactor":[1,0.5,0],"emissiveTexture":
        {"index":1},"extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":4}}"#;
    let parts = r#","textures":[{"source":0},{"source":0,"sampler":0}],"samplers":[{"wrapS":33071,"wrapT":33648}],"images":
        [{"uri":"data:image/png;base64,{DATA}"}]"#;
    let model = read(&gltf(material, parts)).unwrap();
    assert_eq!(model.picture_uvs(0, Slot::Color)[0], Vec2::new(0.5, 0.75));
    assert_eq!(model.picture_uvs(0, Slot::Glow)[0], Vec2::new(0.25, 0.5));
    assert_eq!(model.uvs(0).unwrap()[0], Vec2::new(0.25, 0.5), "those of an `image`");
    let look = &model.looks()[0];
    let place = look.texture(Slot::Color).unwrap().transformed(DVec2::new(0.5, 0.75));
    assert!((place - DVec2::new(0.5 + 3.0 * 0.75, 0.25 - 2.0 * 0.5)).length() < 1e-12, "{place}");
    let glow = look.texture(Slot::Glow).unwrap();
    assert_eq!((glow.wraps(), glow.transformed(DVec2::X)), ([Wrap::Clamp, Wrap::Mirror], DVec2::X));
    assert_eq!(model.glow(0, DVec3::splat(0.5), true), DVec3::new(2.0, 1.0, 0.0));
    assert!(model.has_uvs_from_top() && model.decodes_pictures(false));
}

#[test]
fn missing_pictures_of_gltf_are_warnings() {
    let parts = r#","textures":[{"source":0},{}],"images":[{"uri":"lost.png"}]"#;
    let model = read(&gltf(COLOR, parts)).unwrap();
    assert_eq!(
        model.color(model.look(0), model.vertex_colors(0), [1.0, 0.0, 0.0], DVec3::ONE, false),
        DVec3::splat(0.8)
    );
    assert_eq!(model.warnings(), ["there is no file `lost.png`: what has this picture is grey"]);
    let glow = r#""emissiveFactor":[1,1,1],"emissiveTexture":{"index":1}"#;
    let model = read(&gltf(glow, parts)).unwrap();
    assert_eq!(model.glow(0, DVec3::ONE, true), DVec3::ZERO);
    assert_eq!(
        model.warnings(),
        ["texture 1 has no picture: what has this picture of its glow does not glow"]
    );
    // Without a factor nothing glows, and the unlit show their colour instead.
    for dark in [
        r#""emissiveTexture":{"index":1}"#,
        r#""emissiveFactor":[1,1,1],"emissiveTexture":{"index":1},"extensions":{"KHR_materials_unlit":{}}"#,
    ] {
        let model = read(&gltf(dark, parts)).unwrap();
        assert_eq!((model.glow(0, DVec3::ONE, true), model.warnings().len()), (DVec3::ZERO, 0), "{dark}");
    }
    let elsewhere = COLOR.replace(r#""index":0"#, r#""index":0,"texCoord":7"#);
    let model = read(&gltf(&elsewhere, ONE)).unwrap();
    assert_eq!(model.picture_uvs(0, Slot::Color), [Vec2::ZERO; 3]);
    assert_eq!(model.warnings(), ["what has no TEXCOORD_7 shows its picture at (0, 0)"]);
}

#[test]
fn what_is_wrong_with_a_picture_of_gltf_is_said() {
    for (parts, message) in [
        ("", "`a.gltf`: there is no texture 0"),
        (r#","textures":[{"source":3}]"#, "`a.gltf`: there is no image 3"),
        (r#","textures":[{"source":0}],"images":[{}]"#, "`a.gltf`: image 0 has neither a file nor data"),
        (r#","textures":[{"source":0}],"images":[{"bufferView":9}]"#, "`a.gltf`: there is no buffer view 9"),
        (r#","textures":[{"source":0}],"images":[{"bufferView":0}]"#, "`a.gltf`: image 0: it is no picture"),
        (r#","textures":[{"source":0}],"images":[{"uri":"data:,GIF89a"}]"#, "`a.gltf`: image 0: it is a GIF"),
        (
            r#","textures":[{"source":0}],"images":[{"uri":"data:,%23%3FRGBE%0A%0A-Y 1 +X 1%0A%01%02%03%80"}]"#,
            "`a.gltf`: image 0 is a picture of light (HDR or EXR)",
        ),
        (
            r#","textures":[{"source":0}],"images":[{"uri":"data:image/png;base64,????"}]"#,
            "`a.gltf`: the data of a `data:` address is not Base64",
        ),
        (
            r#","textures":[{"source":0,"sampler":0}],"images":[{"uri":"a%20b.png"}]"#,
            "`a.gltf`: there is no sampler 0",
        ),
        (
            r#","textures":[{"source":0,"sampler":0}],"images":[{"uri":"a%20b.png"}],"samplers":[{"wrapS":1}]"#,
            "`a.gltf`: a sampler has the wrap mode 1",
        ),
    ] {
        let error = read(&gltf(COLOR, parts)).unwrap_err();
        assert_eq!(error.to_string(), message);
        assert!(error.help().is_some(), "{message}");
    }
}

/// A tetrahedron, one face of which has another material, whose alpha is its factor.
fn masked(mode: &str, alphas: [f64; 2]) -> Arc<Model> {
    let corners = [[0f32; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let positions =
        faces.iter().flatten().flat_map(|i| corners[*i]).flat_map(f32::to_le_bytes).collect::<Vec<u8>>();
    let [a, b] = alphas.map(|alpha| {
        format!(r#"{{"alphaMode":"{mode}","pbrMetallicRoughness":{{"baseColorFactor":[1,1,1,{alpha}]}}}}"#)
    });
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"mesh":0}}],"materials":[{a},{b}],"meshes":[{{"primitives":[
        {{"attributes":{{"POSITION":0}},"material":0}},{{"attributes":{{"POSITION":1}},"material":1}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":9,"type":"VEC3"}},
        {{"bufferView":0,"byteOffset":108,"componentType":5126,"count":3,"type":"VEC3"}}],
        "bufferViews":[{{"buffer":0,"byteLength":144}}],"buffers":[{{"byteLength":144,"uri":"a%20b.bin"}}]}}"#
    );
    let files = MemoryFiles::from([("a.gltf", json.into_bytes()), ("a b.bin", positions)]);
    Library::new(files).model("a.gltf", Smoothing::OfFile).unwrap()
}

#[test]
fn a_face_that_is_a_hole_is_part_of_the_body() {
    for mode in ["MASK", "BLEND"] {
        let holes = |alphas| {
            let model = masked(mode, alphas);
            assert_eq!((model.triangle_count(), model.closure()), (4, &Closure::Closed));
            [0, 3].map(|k| model.looks()[model.look(k)].cutoff)
        };
        assert_eq!(holes([1.0, 0.2]), [None, Some(0.5)], "{mode}");
        assert_eq!(holes([0.3, 0.3]), [Some(0.5); 2], "nothing of it is seen");
        assert_eq!(holes([1.0, 0.9]), [None; 2]);
    }
    assert_eq!(masked("OPAQUE", [0.1, 0.1]).looks()[0].cutoff, None);
}

#[test]
fn addresses_of_data_may_be_percent_encoded() {
    let base64 = base64_simd::STANDARD.encode_to_string(png());
    for address in [
        format!("data:image/png;base64,{base64}"),
        format!(
            "DATA:image/png;BASE64,{}",
            base64.replace('=', "%3D").replace('+', "%2B").replace('/', "%2F")
        ),
    ] {
        let json = format!(
            r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"mesh":0}}],"images":[{{"uri":"{address}"}}],"textures":[{{"source":0}}],
            "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"material":0}}]}}],
            "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}}],"bufferViews":[{{"buffer":0,"byteLength":36}}],
            "buffers":[{{"uri":"data:;base64,AACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/","byteLength":36}}]}}"#
        );
        let model = Library::new(MemoryFiles::from([("a.gltf", json.into_bytes())]));
        let model =
            model.model("a.gltf", Smoothing::OfFile).unwrap_or_else(|error| panic!("{address}: {error}"));
        assert!(model.looks()[model.look(0)].texture(Slot::Color).is_some());
    }
}
