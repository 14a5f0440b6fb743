//! Foreign bytes: cut off, changed, with huge headers and circles. Each is an error, a model or a picture, in little memory.

use std::io::Cursor;
use std::sync::LazyLock;

use exr::prelude::{Compression, Encoding, Image, Layer, LayerAttributes, SpecificChannels, WritableImage};
use proptest::prelude::*;
use rayfold_assets::{Align, LetterError, Lettering, Library, MemoryFiles, Purpose, Slot, Smoothing};

fn error(bytes: impl Into<Vec<u8>>) -> String {
    let library = Library::new(MemoryFiles::from([("x", bytes.into())]));
    library.model("x", Smoothing::OfFile).map(|model| model.triangle_count()).unwrap_err().to_string()
}

fn attempt(bytes: &[u8]) {
    let library = Library::new(MemoryFiles::from([
        ("x", bytes.to_vec()),
        ("m", b"newmtl a\nKd 1 .5 0\nmap_Kd p\n".to_vec()),
        ("p", PICTURES[0].clone()),
    ]));
    for smoothing in [Smoothing::OfFile, Smoothing::Within(30.0)] {
        if let Ok(model) = library.model("x", smoothing) {
            for triangle in 0..model.triangle_count() {
                assert!(model.corners(triangle).iter().all(|p| p.is_finite()));
                assert!(model.normals(triangle).is_none_or(|n| n.iter().all(|n| n.is_finite())));
                for slot in [Slot::Color, Slot::Glow] {
                    let uvs = model.picture_uvs(triangle, slot);
                    assert!(uvs.iter().all(|uv| uv.is_finite()));
                }
                assert!(model.vertex_alphas(triangle).iter().all(|alpha| alpha.is_finite()));
                let color = model.color(
                    model.look(triangle),
                    model.vertex_colors(triangle),
                    [0.25, 0.25, 0.5],
                    glam::DVec3::splat(0.7),
                    true,
                );
                assert!(color.min_element() >= 0.0 && color.max_element() <= 1.0, "{color}");
            }
            let _ = model.closure();
        }
    }
}

const PLY: &[u8] = b"ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty \
float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x80\x3f\0\0\0\0\0\0\
\0\0\0\0\0\0\0\0\x80\x3f\0\0\0\0\x03\0\0\0\0\x01\0\0\0\x02\0\0\0";

const GLTF: &[u8] = br#"{"asset":{"version":"2.0"},"nodes":[{"mesh":0},{"children":[0],"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,5,
6,7,1]}],"meshes":[{"primitives":[{"attributes":{"POSITION":0,"COLOR_0":0},"mode":4}]}],"accessors":[{"bufferView":0,
"componentType":5126,"count":3,"type":"VEC3","sparse":{"count":1,"indices":{"bufferView":1,"componentType":5121},"values":
{"bufferView":0}}}],"bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteLength":1,"byteOffset":4}],"buffers":[{"uri":
"data:;base64,AACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/","byteLength":36}]}"#;

/// A triangle with pictures and holes.
const SHOWN: &[u8] = br#"{"asset":{"version":"2.0"},"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0,
"TEXCOORD_1":1,"COLOR_0":2},"material":0}]}],"materials":[{"alphaMode":"MASK","alphaCutoff":0.2,"pbrMetallicRoughness":
{"baseColorTexture":{"index":0,"texCoord":1,"extensions":{"KHR_texture_transform":{"scale":[2,3]}}}},"emissiveFactor":[1,1,1],
"emissiveTexture":{"index":1}}],"textures":[{"source":0,"sampler":0},{"extensions":{"EXT_texture_webp":{"source":1}}}],
"samplers":[{"wrapS":33071,"wrapT":33648}],"images":[{"uri":"p"},{"uri":"./p"}],"accessors":[{"bufferView":0,
"componentType":5126,"count":3,"type":"VEC3"},{"bufferView":0,"componentType":5126,"count":3,"type":"VEC2"},{"bufferView":0,
"componentType":5121,"normalized":true,"count":3,"type":"VEC4"}],"bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"uri":
"data:;base64,AACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/","byteLength":36}]}"#;

const OBJ: &[u8] =
    b"mtllib m\nv 0 0 0\nv 1 0 0 1 .5 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nusemtl a\nf 1/1/1 2/1/1 -1//-1\nl 1 2\n";

#[test]
fn the_samples_are_models() {
    for bytes in [PLY, GLTF, OBJ, SHOWN] {
        let library = Library::new(MemoryFiles::from([("x", bytes.to_vec())]));
        let model = library.model("x", Smoothing::OfFile).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(model.triangle_count(), 1);
    }
}

#[test]
fn headers_promise_no_more_than_there_is() {
    let ply = |vertices: &str, faces: &str| {
        format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty \
             float z\nelement face {faces}\nproperty list uint int vertex_indices\nend_header\n\0"
        )
    };
    assert!(error(ply("29000000", "1")).contains("only 1 bytes are left"));
    assert!(error(ply("18446744073709551615", "1")).contains("more than"));
    assert!(error(ply("0", "10000000")).contains("only 1 bytes are left"));
    assert!(error("ply\nformat ascii 1.0\nelement vertex 9999999999\nend_header\n").contains("more than"));
    assert!(error("ply\nformat ascii 1.0\nelement other 9999999999\nend_header\n").contains("promises"));
    let list = "ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list uint int vertex_indices\nend_header\n";
    assert!(
        error([list.as_bytes(), &[0xff, 0xff, 0xff, 0x7f]].concat()).contains("a list of 2147483647 numbers")
    );
    let mut stl = vec![0; 80];
    stl.extend(u32::MAX.to_le_bytes());
    assert!(error(stl).contains("no model"));
    let text = String::from_utf8_lossy(GLTF).into_owned();
    assert!(error(text.replace("\"count\":3", "\"count\":4")).contains("outside of its buffer"));
    assert!(error(text.replace("\"count\":3", "\"count\":30000001")).contains("more than 30000000 vertices"));
    assert!(error(text.replace("\"count\":1", "\"count\":2")).contains("outside of its buffer"));
    assert!(error(text.replace("\"byteLength\":36}]", "\"byteLength\":37}]")).contains("cut off"));
    assert!(
        error(text.replace("\"byteOffset\":4", "\"byteOffset\":18446744073709551615")).contains("outside")
    );
    assert!(error(text.replace("5126", "5999")).contains("component type 5999"));
}

#[test]
fn circles_and_missing_nodes_are_errors() {
    let text = String::from_utf8_lossy(GLTF).into_owned();
    let within = text.replace("{\"mesh\":0}", "{\"mesh\":0,\"children\":[1]}");
    assert!(
        error(within.replace("\"nodes\":", "\"scenes\":[{\"nodes\":[0]}],\"nodes\":"))
            .contains("within itself")
    );
    assert!(error(text.replace("\"children\":[0]", "\"children\":[9]")).contains("no node 9"));
    assert!(error(text.replace("\"children\":[0]", "\"children\":[0,0]")).contains("two parents"));
    assert!(error(text.replace("\"mesh\":0", "\"mesh\":3")).contains("no mesh 3"));
    let deep = "[".repeat(100_000);
    assert!(error(format!("{{\"skins\":{deep}")).contains("its JSON"));
}

#[test]
fn what_would_fill_the_memory_is_refused_before() {
    let many = |item: &str, count: usize| {
        format!("{{\"asset\":{{\"version\":\"2.0\"}},\"materials\":[{}]}}", vec![item; count].join(","))
    };
    assert!(error(many("{}", 1 << 21)).contains("more than 2097152 objects"));
    assert!(error(many("{}", (1 << 20) + 1)).contains("more than 1048576 materials"));
    let text = String::from_utf8_lossy(GLTF).into_owned();
    let zeros = text.replace("\"bufferView\":0,", "").replace("\"count\":3", "\"count\":1048577");
    assert!(error(zeros).contains("1048577 items, more than 1048576"));
}

#[test]
fn a_message_quotes_little_of_a_file() {
    let long = "x".repeat(5_000_000);
    for text in [format!("v {long} 0 0\n"), format!("v 0 0 0\nf {long} 1 1\n")] {
        assert!(error(text).len() < 500);
    }
    let faces = (0..3000).map(|k| format!("usemtl {k}{long:.100}\nf 1 2 3\n")).collect::<String>();
    let text = format!("mtllib m\nv 0 0 0\nv 1 0 0\nv 0 1 0\n{faces}");
    let files = MemoryFiles::from([("x", text.into_bytes()), ("m", b"newmtl a\n".to_vec())]);
    let model = Library::new(files).model("x", Smoothing::OfFile).unwrap();
    assert_eq!(model.warnings().len(), 1);
    assert!(model.warnings()[0].ends_with("and 2995 more: what has them is grey"));
    assert!(model.warnings()[0].len() < 500);
}

#[test]
fn numbers_that_are_none_are_errors() {
    let mut bytes = PLY.to_vec();
    let at = bytes.len() - 13 - 36;
    bytes[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(error(bytes).contains("not a finite number"));
    let mut bytes = PLY.to_vec();
    let at = bytes.len() - 4;
    bytes[at] = 200;
    assert!(error(bytes).contains("index is out of range"));
    assert!(
        error(String::from_utf8_lossy(GLTF).replace("[1,0,0,0,0", "[1e999,0,0,0,0"))
            .contains("number out of range")
    );
    assert!(
        error(String::from_utf8_lossy(OBJ).replace("v 0 1 0", "v 0 1e999 0")).contains("not a finite number")
    );
}

/// Looks at all pixels of what may be a picture.
fn attempt_picture(bytes: &[u8]) {
    let library = Library::new(MemoryFiles::from([("x", bytes.to_vec())]));
    let Ok(picture) = library.picture("x", Purpose::Sky) else { return };
    for y in 0..picture.height().min(50) {
        for x in 0..picture.width().min(50) {
            let level = picture.level(x, y, true);
            assert!(level.is_finite() && level.min_element() >= 0.0, "{level}");
            assert!(picture.is_light() || picture.factor(x, y, false).max_element() <= 1.0);
        }
    }
}

fn exr(compression: Compression, tiles: Option<usize>) -> Vec<u8> {
    let blocks =
        tiles.map_or(exr::image::Blocks::ScanLines, |of| exr::image::Blocks::Tiles(exr::math::Vec2(of, of)));
    let encoding = Encoding { compression, blocks, ..Encoding::UNCOMPRESSED };
    let channels = SpecificChannels::rgb(|at: exr::math::Vec2<usize>| {
        (exr::prelude::f16::from_f32(at.0 as f32), at.1 as f32, 0.5f32)
    });
    let image = Image::from_layer(Layer::new((9, 7), LayerAttributes::named("a"), encoding, channels));
    let mut bytes = Cursor::new(Vec::new());
    image.write().non_parallel().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

/// The reader of these panics on malformed data.
#[test]
fn the_compression_b44_is_refused_by_its_name() {
    let library = Library::new(MemoryFiles::from([("x", exr(Compression::B44, None))]));
    let error = library.picture("x", Purpose::Sky).unwrap_err().to_string();
    assert!(error.contains("its compression is B44: save it with"), "{error}");
}

/// A picture in each format.
static PICTURES: LazyLock<Vec<Vec<u8>>> = LazyLock::new(|| {
    let colors =
        image::RgbaImage::from_fn(9, 7, |x, y| image::Rgba([x as u8 * 20, y as u8 * 30, 99, 250 - x as u8]));
    let colors = image::DynamicImage::from(colors);
    let mut all = Vec::new();
    for (image, format) in [
        (colors.clone(), image::ImageFormat::Png),
        (colors.to_luma16().into(), image::ImageFormat::Png),
        (colors.to_rgb8().into(), image::ImageFormat::Jpeg),
        (colors.to_luma8().into(), image::ImageFormat::Jpeg),
        (colors.clone(), image::ImageFormat::WebP),
    ] {
        let mut bytes = Cursor::new(Vec::new());
        image.write_to(&mut bytes, format).unwrap();
        all.push(bytes.into_inner());
    }
    for (compression, tiles) in [
        (Compression::Uncompressed, None),
        (Compression::RLE, None),
        (Compression::ZIP16, None),
        (Compression::PIZ, Some(4)),
        (Compression::PXR24, None),
        (Compression::ZIP1, Some(5)),
    ] {
        all.push(exr(compression, tiles));
    }
    let mut hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 9\n".to_vec();
    for _ in 0..2 {
        hdr.extend([
            2,
            2,
            0,
            9,
            128 + 9,
            7,
            9,
            1,
            2,
            3,
            4,
            5,
            6,
            7,
            8,
            9,
            128 + 4,
            6,
            5,
            1,
            1,
            1,
            1,
            1,
            128 + 9,
            136,
        ]);
    }
    all.push(hdr);
    all.push(
        b"#?RGBE\n\n-Y 2 +X 3\n\x01\x02\x03\x80\x01\x01\x01\x02\x05\x06\x07\x80\x01\x01\x01\x02".to_vec(),
    );
    all
});

#[test]
fn the_samples_are_pictures() {
    for (k, bytes) in PICTURES.iter().enumerate() {
        let library = Library::new(MemoryFiles::from([("x", bytes.clone())]));
        let picture = library.picture("x", Purpose::Sky);
        picture.unwrap_or_else(|error| panic!("sample {k}: {error}"));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(10_000))]

    #[test]
    fn changed_pictures_do_no_harm(
        sample in 0..13usize,
        cut in 0.0..1.0f64,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
    ) {
        let mut bytes = PICTURES[sample].clone();
        for (at, byte) in changes {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        attempt_picture(&bytes);
        bytes.truncate((cut * bytes.len() as f64) as usize);
        attempt_picture(&bytes);
    }
}

/// Cuts letters with a font. Returns the error, if there is one.
fn letters(font: &[u8]) -> Option<LetterError> {
    let library = Library::new(MemoryFiles::from([("f", font.to_vec())]));
    let font = Some("f".to_string());
    let lettering =
        Lettering { text: "AVfi\u{e9}%\n8".into(), size: 1.0, depth: 0.1, align: Align::Center, font };
    let model = library.letters(&lettering);
    if let Ok(Some(model)) = &model {
        let _ = model.closure();
        assert!((0..model.triangle_count()).all(|k| model.corners(k).iter().all(|p| p.is_finite())));
    }
    model.err()
}

/// A font without some of its tables is drawn otherwise.
#[test]
fn a_font_that_is_cut_off_is_an_error() {
    let font = dejavu::sans::regular();
    assert_eq!(letters(font), None);
    for part in 0..200 {
        let end = font.len() * part / 200;
        assert!(letters(&font[..end]).is_some(), "{end} of {} bytes", font.len());
    }
    let error = letters(&font[..font.len() - 4]).unwrap().to_string();
    assert!(error.contains("the file is cut off"), "{error}");
}

#[test]
fn a_faulty_glyph_is_a_fault_of_its_font() {
    let mut font = dejavu::sans::regular().to_vec();
    let count = usize::from(u16::from_be_bytes([font[4], font[5]]));
    let entry = (0..count).map(|k| 12 + 16 * k).find(|at| &font[*at..at + 4] == b"glyf").unwrap();
    let number = |at: usize| u32::from_be_bytes(font[at..at + 4].try_into().unwrap()) as usize;
    let (start, length) = (number(entry + 8), number(entry + 12));
    font[start..start + length].iter_mut().step_by(7).for_each(|byte| *byte ^= 0x55);
    let error = letters(&font).unwrap();
    assert!(error.to_string().starts_with("`f`: glyph "), "{error}");
    assert!(error.to_string().contains(" of the font is faulty ("), "{error}");
    assert_eq!(error.help().unwrap(), "fonts are TrueType and OpenType (.ttf, .otf, .ttc)");
}

#[test]
fn fonts_that_are_none_are_errors() {
    let said = |bytes: &[u8]| letters(bytes).unwrap().to_string();
    let font = dejavu::sans::bold();
    assert!(said(b"").contains("no font"));
    assert!(said(b"wOF2 and more").contains("WOFF is not read"));
    assert!(said(b"%!PS-AdobeFont-1.0: Some").contains("no font"));
    assert!(said(PLY).contains("no font"));
    for length in [4, 12, 100, 1000] {
        said(&font[..length]);
    }
    // Every table at 0.
    let mut mad = font.to_vec();
    let tables = usize::from(u16::from_be_bytes([mad[4], mad[5]]));
    (0..tables).for_each(|k| mad[12 + 16 * k + 8..][..8].fill(0));
    said(&mad);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn changed_fonts_do_no_harm(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..60),
        // Most are in the tables before the outlines.
        within in prop::sample::select(vec![2_000, 40_000, notosans::BOLD_TTF.len()]),
        cut in 0.0..2.0f64,
    ) {
        let mut bytes = notosans::BOLD_TTF.to_vec();
        for (at, byte) in changes {
            let at = at.index(within);
            bytes[at] = byte;
        }
        bytes.truncate((cut * bytes.len() as f64) as usize);
        letters(&bytes);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3000))]

    #[test]
    fn changed_bytes_do_no_harm(
        sample in prop::sample::select(vec![PLY, GLTF, OBJ, SHOWN]),
        cut in 0.0..1.0f64,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
    ) {
        let mut bytes = sample.to_vec();
        for (at, byte) in changes {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        attempt(&bytes);
        bytes.truncate((cut * bytes.len() as f64) as usize);
        attempt(&bytes);
    }

    #[test]
    fn any_bytes_do_no_harm(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        attempt(&bytes);
        attempt(&[b"ply\n", &bytes[..]].concat());
        attempt(&[b"glTF\x02\0\0\0", &bytes[..]].concat());
    }
}
