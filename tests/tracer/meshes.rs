//! Meshes are drawn like the triangles of their files. Normals, colours and glass are drawn by the packets like by the
//! reference tracer, and like shapes without triangles.

use std::fmt::Write;

use glam::DVec3;
use image::RgbImage;
use rayfold_scene::assets::{Library, MemoryFiles};
use rayfold_scene::{Limits, Object, Scene, parse_with_files};
use rayfold_tracer::probe::nearest_hits;
use rayfold_tracer::{
    Exposure, Precision, RenderOptions, first_hits, precision, reference, render, render_picture,
};

/// The triangles of a ball of radius 1, seen counterclockwise from outside, of about 2n² triangles.
fn ball(n: usize) -> Vec<[DVec3; 3]> {
    let point = |i: usize, j: usize| {
        let (across, around) = (2.0 * n as f64, n as f64);
        let (longitude, latitude) =
            (std::f64::consts::TAU * (i % (2 * n)) as f64 / across, std::f64::consts::PI * j as f64 / around);
        match j {
            0 => DVec3::Y,
            _ if j == n => DVec3::NEG_Y,
            _ => DVec3::new(
                latitude.sin() * longitude.cos(),
                latitude.cos(),
                -latitude.sin() * longitude.sin(),
            ),
        }
    };
    let mut all = vec![];
    for j in 0..n {
        for i in 0..2 * n {
            let [a, b, c, d] = [point(i, j), point(i, j + 1), point(i + 1, j + 1), point(i + 1, j)];
            if j + 1 < n {
                all.push([a, b, c]);
            }
            if j > 0 {
                all.push([a, c, d]);
            }
        }
    }
    all
}

/// Writes triangles as OBJ; with the normals of the ball, and a colour for each vertex.
fn obj(triangles: &[[DVec3; 3]], with_normals: bool, with_colors: bool) -> Vec<u8> {
    let mut text = String::new();
    for p in triangles.iter().flatten() {
        write!(text, "v {} {} {}", p.x, p.y, p.z).unwrap();
        if with_colors {
            let c = 0.5 + 0.5 * *p;
            write!(text, " {} {} {}", c.x, c.y, c.z).unwrap();
        }
        writeln!(text).unwrap();
        writeln!(text, "vn {} {} {}", p.x, p.y, p.z).unwrap();
    }
    for k in 0..triangles.len() {
        let corners = [3 * k + 1, 3 * k + 2, 3 * k + 3];
        let corner = |i: usize| if with_normals { format!(" {i}//{i}") } else { format!(" {i}") };
        writeln!(text, "f{}", corners.map(corner).concat()).unwrap();
    }
    text.into_bytes()
}

fn library() -> Library {
    let open: Vec<_> = ball(6).into_iter().filter(|t| t[0].y < 0.4).collect();
    Library::new(MemoryFiles::from([
        ("flat.obj", obj(&ball(6), false, false)),
        ("round.obj", obj(&ball(6), true, false)),
        ("fine.obj", obj(&ball(40), true, false)),
        ("colored.obj", obj(&ball(6), true, true)),
        ("open.obj", obj(&open, true, false)),
        ("sheets.obj", sheets(0.1)),
        ("near.obj", sheets(1e-8)),
        ("quads.obj", QUADS.to_vec()),
        (
            "quads.mtl",
            b"newmtl wood\nKd .9 .8 1\nmap_Kd textures\\my wood.png\nnewmtl plain\nKd .2 .3 .9\n".to_vec(),
        ),
        ("my wood.png", png(&levels(5, 3))),
        ("quads.gltf", quads_gltf(r#""baseColorTexture":{"index":0}"#)),
        ("turned.gltf", quads_gltf(TURNED)),
        ("wood.obj", [&b"mtllib wood.mtl\nusemtl m\n"[..], ONE_LOOK].concat()),
        ("wood.mtl", b"newmtl m\nKd .9 1 .7\nmap_Kd my wood.png\n".to_vec()),
        ("bare.obj", ONE_LOOK.to_vec()),
        (
            "mirrored.gltf",
            colorless(quads_gltf(r#""baseColorTexture":{"index":1},"baseColorFactor":[1,0.5,0.8,1]"#)),
        ),
        ("leaf.png", leaf()),
        ("leaf.gltf", quads_gltf(LEAF)),
    ]))
}

/// Two squares, one before the other, whose normals are not the same.
fn sheets(apart: f64) -> Vec<u8> {
    let mut text = String::from("vn .3 .1 1\nvn -.5 .2 1\n");
    for z in [0.0, apart] {
        for [x, y] in [[-1, -1], [1, -1], [1, 1], [-1, 1]] {
            writeln!(text, "v {x} {y} {z}").unwrap();
        }
    }
    (text + "f 1//1 2//1 3//1 4//1\nf 5//2 6//2 7//2 8//2\n").into_bytes()
}

/// Two squares that stand in the corner of a room, one of them with a picture; and normals that are those of no face.
const QUADS: &[u8] = b"mtllib quads.mtl\nv -1 -1 -.4 1 1 .5\nv 1 -1 -.4 .6 1 1\nv 1 1 -.4\nv -1 1 -.4\nv 1 -1 1.2\nv 1 1 1.2\n\
    vt -.3 .1\nvt 1.4 .2\nvt 1.2 1.7\nvt .1 .9\nvn .1 .2 1\nusemtl wood\nf 1/1/1 2/2/1 3/3/1 4/4/1\nusemtl plain\nf 2 5 6 3\n";

/// The colour of a material whose picture is turned and mirrored, and glows.
const TURNED: &str = r#""baseColorFactor":[0.9,0.7,0.8,1],"baseColorTexture":{"index":1,"texCoord":1,"extensions":
    {"KHR_texture_transform":{"offset":[0.2,-0.1],"rotation":0.4,"scale":[1.5,-2.5]}}}},"emissiveFactor":[0.2,0.1,0.3],
    "emissiveTexture":{"index":0},"extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":2}"#;

/// Two triangles with normals, whose texture coordinates go beyond a picture.
const ONE_LOOK: &[u8] =
    b"v -1 -1 .3\nv 1 -1 0\nv 1 1 .1\nv -1 1 0\nvt -.7 -.2\nvt 1.6 .1\nvt 1.2 2.1\nvt -1.1 .9\nvn 0 .1 1\n\
    vn .3 0 1\nf 1/1/1 2/2/2 3/3/1\nf 1/1/1 3/3/1 4/4/2\n";

/// Returns a model without its colours.
fn colorless(gltf: Vec<u8>) -> Vec<u8> {
    String::from_utf8(gltf).unwrap().replace(r#","COLOR_0":3"#, "").into_bytes()
}

/// A material with holes.
const LEAF: &str = r#""baseColorTexture":{"index":2},"baseColorFactor":[1,1,1,0.9]},"alphaMode":"MASK","alphaCutoff":0.4,"extras":{"#;

/// Returns a picture whose alpha goes up and down.
fn leaf() -> Vec<u8> {
    let picture = image::RgbaImage::from_fn(9, 7, |x, y| {
        let k = x + 9 * y;
        image::Rgba([(k * 4) as u8, 200, (k * 29 % 256) as u8, (k * 101 % 256) as u8])
    });
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// The address of data.
fn data(bytes: &[u8]) -> String {
    bytes.iter().fold("data:,".to_string(), |text, byte| text + &format!("%{byte:02x}"))
}

/// Returns a model of a square from (-1, -1) to (1, 1), with two sets of texture coordinates and colours, whose material is
/// given. Texture 0 repeats, and texture 1 is mirrored across and clamped down.
fn quads_gltf(material: &str) -> Vec<u8> {
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0f32]];
    let uvs = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0f32]];
    let mut bytes: Vec<u8> = Vec::new();
    for ([x, y], [u, v]) in corners.into_iter().zip(uvs) {
        let vertex = [x, y, 0.0, u, v, 2.0 * u - 0.7, 1.5 * v - 0.2, 1.0, 0.5 + 0.5 * u, 1.0];
        vertex.iter().for_each(|number| bytes.extend(number.to_le_bytes()));
    }
    [0u16, 1, 2, 0, 2, 3].iter().for_each(|index| bytes.extend(index.to_le_bytes()));
    let accessor = |offset: usize, kind: &str| {
        format!(r#"{{"bufferView":0,"byteOffset":{offset},"componentType":5126,"count":4,"type":"{kind}"}}"#)
    };
    format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,
        "TEXCOORD_0":1,"TEXCOORD_1":2,"COLOR_0":3}},"indices":4,"material":0}}]}}],"materials":
        [{{"pbrMetallicRoughness":{{{material}}}}}],"textures":[{{"source":0}},{{"source":0,"sampler":0}},{{"source":1}}],"samplers":
        [{{"wrapS":33648,"wrapT":33071}}],"images":[{{"uri":"my%20wood.png"}},{{"uri":"leaf.png"}}],"accessors":[{},{},{},{},
        {{"bufferView":1,"componentType":5123,"count":6,"type":"SCALAR"}}],"bufferViews":[{{"buffer":0,"byteLength":160,
        "byteStride":40}},{{"buffer":0,"byteOffset":160,"byteLength":12}}],"buffers":[{{"byteLength":172,"uri":"{}"}}]}}"#,
        accessor(0, "VEC3"),
        accessor(12, "VEC2"),
        accessor(20, "VEC2"),
        accessor(28, "VEC3"),
        data(&bytes),
    )
    .into_bytes()
}

/// Returns a picture of all kinds of levels.
fn levels(width: u32, height: u32) -> RgbImage {
    RgbImage::from_fn(width, height, |x, y| {
        let k = x + width * y;
        image::Rgb([k * 97, k * 31 + 7, 2 * k * 53 + 90].map(|level| (level % 256) as u8))
    })
}

fn png(picture: &RgbImage) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

const STAGE: &str = "Screen 80 60\nLook 3 2.5 5 0 .2 0 32\nBackground .9 .95 1 .3 .5 .9\nIlight .8 .8 .7 -1 -2 -1\nPlight .5 .4 .4 \
                     2 3 2\nMaterial floor ambient .1 .1 .1 diffuse .5 .5 .5\nMaterial red ambient .1 0 0 diffuse .8 .2 .1 shine .4 \
                     .4 .4 30\nMaterial chrome diffuse .1 .1 .1 mirror .8 .8 .8\nMaterial glassy glass .95 .97 1 1.5 shine .5 .5 .5 \
                     60\nMaterial own diffuse 1 1 1 own\nMaterial checks diffuse .9 .9 .9 checker .3 floor\nMaterial mixed own ambient .2 .2 .2 diffuse .9 .8 .7 checker .3 floor \
                     mirror .2 .2 .2\nPlane 0 -1.05 0 0.02 1 \
                     .01 floor\n";

/// Materials with pictures.
const PICTURED: &str = "Material wooden ambient .3 .2 .2 diffuse .6 .8 .7 image \"my wood.png\" uv\nMaterial leafy diffuse .8 .8 .7 \
                        mirror .2 .2 .2 image \"leaf.png\" uv\n";

fn scene(lines: &str) -> Scene {
    first_frame(&format!("{STAGE}{lines}\nTrace"))
}

fn first_frame(text: &str) -> Scene {
    let parsed = parse_with_files("a.txt", text.as_bytes(), &Limits::default(), &library());
    parsed.script.unwrap_or_else(|| panic!("{:?}", parsed.diagnostics)).frame(0).unwrap()
}

fn drawn(scene: &Scene) -> RgbImage {
    render(scene, &RenderOptions::default()).unwrap()
}

/// The lines of the triangles that a mesh is.
fn written_out(triangles: &[[DVec3; 3]], material: &str) -> String {
    let line = |[a, b, c]: &[DVec3; 3]| {
        format!(
            "Triangle {} {} {} {} {} {} {} {} {} {material}\n",
            a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z
        )
    };
    triangles.iter().map(line).collect()
}

#[test]
fn a_flat_mesh_has_the_pixels_of_its_triangles() {
    for material in ["red", "chrome", "checks", ".1 .1 .2 .5 .5 .9"] {
        let (defined, name) = match material.starts_with('.') {
            true => ("Material own2 ambient .1 .1 .2 diffuse .5 .5 .9\n", "own2"),
            false => ("", material),
        };
        for samples in ["", "Samples 4 0\n"] {
            let of = |object: &str| drawn(&scene(&format!("{samples}{defined}{object}")));
            let mesh = of(&format!("Mesh \"flat.obj\" {name}"));
            assert!(mesh == of(&written_out(&ball(6), material)), "{material} {samples}");
            let flat = of(&format!("Mesh \"round.obj\" {name} flat"));
            assert!(mesh == flat, "{material} {samples}: normals of the file are not used");
            let used = |inner: &str| of(&format!("Group g\n{inner}\nEnd\nUse g .3 .1 -.4 10 20 30 .8"));
            let group = used(&format!("Mesh \"flat.obj\" {name}"));
            assert!(group == used(&written_out(&ball(6), material)), "{material} {samples}: in a group");
            assert!(group != mesh);
        }
    }
}

#[test]
fn without_a_material_a_mesh_has_the_colours_of_its_file() {
    let neutral = "Material neutral ambient .08000000000000002 .08000000000000002 .08000000000000002 diffuse .7200000000000001 \
                   .7200000000000001 .7200000000000001\n";
    for tone in ["", "Tone srgb\n"] {
        let mesh = drawn(&scene(&format!("{tone}Mesh \"flat.obj\"")));
        let named = drawn(&scene(&format!("{tone}{neutral}Mesh \"flat.obj\" neutral")));
        assert!(mesh == named, "{tone}");
    }
}

/// Compares the packets with the reference tracer: at most one level, but for some pixels at outlines. Models are written
/// out, and drawn from trees of their own.
fn compare(lines: &str) {
    compare_scene(&scene(lines), lines);
}

fn compare_scene(scene: &Scene, lines: &str) {
    let plain = reference::render(scene, &RenderOptions::default()).unwrap();
    for models in [None, Some(true)] {
        let fast = render(scene, &RenderOptions { models, ..RenderOptions::default() }).unwrap();
        let is_off =
            |(a, b): (&image::Rgb<u8>, &image::Rgb<u8>)| a.0.iter().zip(b.0).any(|(a, b)| a.abs_diff(b) > 1);
        let off = fast.pixels().zip(plain.pixels()).filter(|pair| is_off(*pair)).count();
        assert!(off <= 2, "{off} pixels of {lines} with {models:?}");
    }
}

#[test]
fn the_packets_draw_meshes_like_the_reference() {
    for tone in ["", "Tone srgb\n"] {
        for mesh in [
            "Mesh \"round.obj\"",
            "Mesh \"round.obj\" red",
            "Mesh \"flat.obj\" red smooth 180",
            "Mesh \"flat.obj\" red smooth 25",
            "Mesh \"round.obj\" chrome",
            "Mesh \"round.obj\" checks",
            "Mesh \"colored.obj\"",
            "Mesh \"colored.obj\" own flat",
            "Mesh \"open.obj\" red",
            "Mesh \"open.obj\" glassy",
            "Mesh \"round.obj\" glassy",
            "Mesh \"flat.obj\" glassy",
            "Sphere .5 0 0 0 red\nMesh \"round.obj\" glassy",
            "Mesh \"round.obj\" .1 .1 .2 .5 .5 .9 .2 .2 .2 smooth 90",
            "Mesh \"quads.obj\"",
            "Mesh \"quads.obj\" own flat",
            "Mesh \"quads.obj\" red",
            "Mesh \"wood.obj\"",
            "Mesh \"wood.obj\" own flat",
            "Mesh \"wood.obj\" wooden",
            "Mesh \"bare.obj\" wooden",
            "Mesh \"bare.obj\" leafy",
            "Sphere .4 .5 0 .3 red\nMesh \"mirrored.gltf\"\nMesh \"wood.obj\"",
            "Mesh \"quads.gltf\"",
            "Mesh \"turned.gltf\"",
            "Mesh \"turned.gltf\" mixed",
            "Mesh \"leaf.gltf\"",
            "Mesh \"leaf.gltf\" red",
            "Mesh \"leaf.gltf\" glassy",
            "Sphere .5 0 0 -.9 red\nMesh \"leaf.gltf\" chrome",
        ] {
            compare(&format!("{tone}{PICTURED}{mesh}"));
            compare(&format!(
                "{tone}{PICTURED}Group g\n{mesh}\nEnd\nUse g .3 .1 -.4 10 20 30 .8\nUse g -1.2 .2 0 0 40 0 .5"
            ));
        }
    }
}

#[test]
fn normals_are_drawn_in_single_precision_where_that_is_enough() {
    let plain = |lines: &str| {
        first_frame(&format!(
            "Screen 48 36\nLook .6 1.2 4  0 0 0  36\nBackground .8 .9 1\nIlight .9 .9 .85  -1 -2 -1.5\n\
             Ilight .2 .1 .3  1 .3 -1\n{lines}\nTrace"
        ))
    };
    let floor = "Triangle -9 -1.1 -9  0 -1.2 9  9 -1 -9  .1 .1 .1 .5 .6 .5\n";
    for mesh in ["round.obj", "fine.obj", "sheets.obj", "open.obj"] {
        for object in [
            format!("Mesh \"{mesh}\" .1 .1 .1 .7 .7 .6"),
            format!("{floor}Mesh \"{mesh}\" .1 .1 .1 .7 .7 .6"),
            format!(
                "{floor}Sphere .3 .2 .9 1.3 .1 .1 .1 .5 .5 .5\nMesh \"{mesh}\" .1 .1 .1 .7 .7 .6 smooth 60"
            ),
            format!(
                "{floor}Group g\nMesh \"{mesh}\" .1 .1 .1 .7 .7 .6\nEnd\nUse g .3 .1 -.4 10 20 30 .8\nUse g -1 .2 0 0 40 0 .5"
            ),
        ] {
            let scene = plain(&object);
            assert_eq!(precision(&scene), Precision::F32, "{object}");
            compare_scene(&scene, &object);
            for tile in [(4, 4), (16, 16)] {
                let options = RenderOptions { tile: Some(tile), ..RenderOptions::default() };
                assert!(render(&scene, &options).unwrap() == drawn(&scene), "{tile:?} {object}");
            }
        }
    }
    for object in [
        "Mesh \"near.obj\" .1 .1 .1 .7 .7 .6",
        "Mesh \"round.obj\" .1 .1 .1 .4 .4 .4 .3 .3 .3",
        "Mesh \"colored.obj\"",
    ] {
        let scene = plain(object);
        assert_eq!(precision(&scene), Precision::F64, "{object}");
        compare_scene(&scene, object);
    }
    let sampled = plain("Samples 4 0\nMesh \"round.obj\" .1 .1 .1 .7 .7 .6");
    assert_eq!(precision(&sampled), Precision::F64);
    let flat = plain("Mesh \"near.obj\" .1 .1 .1 .7 .7 .6 flat");
    assert_eq!(precision(&flat), Precision::F32, "both sheets look alike");
}

#[test]
fn the_packets_draw_letters_like_the_reference() {
    for text in [
        "Text \"B&\" 1.2 .4",
        "Text \"8\\ng\" 1 .3 red centre",
        "Text \"O\" 1.5 .5 chrome centre",
        "Text \"S\" 1.5 .5 glassy centre",
        "Text \"R\" 1.5 0 glassy right",
        "Text \"Q\" 1.5 .2 checks",
        "Text \"a\" 2 .2 own centre",
    ] {
        compare(text);
        compare(&format!("Tone srgb\nGroup g\n{text}\nEnd\nUse g .3 .1 -.4 10 20 30 .8"));
    }
}

#[test]
fn a_letter_that_is_a_box_is_drawn_as_one() {
    // The hyphen of the font is a rectangle.
    let letter = scene("Text \"-\" 6 .5 centre");
    let [low, high] = letter.objects.iter().find(|o| matches!(o, Object::Mesh(_))).unwrap().bounds().unwrap();
    let [low, high] = [low, high].map(|p| format!("{} {} {}", p.x, p.y, p.z));
    for (material, most) in [("red", 0.01), ("chrome", 0.01), ("glassy", 0.02), ("checks", 0.01)] {
        let used =
            |inner: &str| drawn(&scene(&format!("Group g\n{inner}\nEnd\nUse g .3 -.7 .4 10 25 15 .8")));
        let text = used(&format!("Text \"-\" 6 .5 {material} centre"));
        let cuboid = used(&format!("Box {low} {high} {material}"));
        let off = difference(&text, &cuboid);
        assert!(off < most, "{material}: {off} levels");
        assert!(difference(&text, &used("")) > 1.0, "{material}: it is seen");
    }
}

#[test]
fn fog_lies_before_meshes() {
    for mesh in ["\"colored.obj\"", "\"round.obj\" chrome", "\"round.obj\" glassy", "\"open.obj\" glassy"] {
        compare(&format!("Fog .5 .6 .7 4\nMesh {mesh}"));
    }
}

/// Returns the mean difference of the channels of two pictures, in levels.
fn difference(a: &RgbImage, b: &RgbImage) -> f64 {
    let sum: u64 = a.as_raw().iter().zip(b.as_raw()).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    sum as f64 / a.as_raw().len() as f64
}

#[test]
fn a_fine_ball_with_normals_looks_like_a_sphere() {
    for (material, most) in [("red", 0.7), ("chrome", 1.0), ("glassy", 2.0)] {
        let sphere = drawn(&scene(&format!("Sphere 1 0 0 0 {material}")));
        let mesh = drawn(&scene(&format!("Mesh \"fine.obj\" {material}")));
        let off = difference(&sphere, &mesh);
        assert!(off < most, "{material}: {off} levels");
        // The faces alone are further off.
        let flat = difference(&sphere, &drawn(&scene(&format!("Mesh \"fine.obj\" {material} flat"))));
        assert!(flat > off, "{material}: {flat} levels");
    }
}

#[test]
fn a_coarse_ball_with_normals_has_no_dark_terminator() {
    // Light from the side: nothing between full light and the terminator may be black.
    let lines = "Clear\nIlight 1 1 1 -1 0 -.6\nMaterial white diffuse 1 1 1\nMesh \"round.obj\" white";
    let scene = scene(lines);
    let picture = drawn(&scene);
    let expected = drawn(&self::scene(&lines.replace("Mesh \"round.obj\"", "Sphere 1 0 0 0")));
    let dark =
        picture.pixels().zip(expected.pixels()).filter(|(mesh, ball)| ball.0[0] > 60 && mesh.0[0] == 0);
    // Only the outline differs.
    assert!(dark.count() < 60, "shadows of faces on themselves");
}

#[test]
fn rays_find_the_object_that_a_mesh_is() {
    let scene = scene("Sphere .2 0 3 0 red\nMesh \"round.obj\" red\nSphere .2 0 -3 9 red");
    let from = |target: DVec3| {
        let origin = DVec3::new(0.0, 0.0, 9.0);
        (origin, (target - origin).normalize())
    };
    let rays =
        [from(DVec3::new(0.0, 3.0, 0.0)), from(DVec3::ZERO), (DVec3::new(0.0, -3.0, 20.0), DVec3::NEG_Z)];
    let found = nearest_hits(&scene, &rays, &RenderOptions::default()).unwrap();
    assert_eq!(found.map_objects(), [Some(1), Some(2), Some(3)]);
    let hit = reference::nearest(&scene.objects, rays[1].0, rays[1].1).unwrap();
    assert_eq!(hit.object, 2);
}

/// The positions of the objects that were found.
trait Objects {
    fn map_objects(&self) -> Vec<Option<usize>>;
}

impl Objects for Vec<Option<rayfold_tracer::probe::Found>> {
    fn map_objects(&self) -> Vec<Option<usize>> {
        self.iter().map(|found| found.as_ref().map(|found| found.object)).collect()
    }
}

/// A model whose pixels are those of the screen, in each format, and its picture.
fn screen_wide(picture: &RgbImage) -> Library {
    let (right, top) = (f64::from(picture.width()) - 0.5, f64::from(picture.height()) - 0.5);
    let obj = format!(
        "mtllib a.mtl\nv -.5 -.5 -1\nv {right} -.5 -1\nv {right} {top} -1\nv -.5 {top} -1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
         usemtl m\nf 1/1 2/2 3/3 4/4\n"
    );
    let gltf = String::from_utf8(quads_gltf(r#""baseColorTexture":{"index":0}"#)).unwrap();
    let (across, up) = (0.5 * f64::from(picture.width()), 0.5 * f64::from(picture.height()));
    let node =
        format!(r#"{{"mesh":0,"scale":[{across},{up},1],"translation":[{},{},-1]}}"#, across - 0.5, up - 0.5);
    let gltf = gltf.replace(r#"{"mesh":0}"#, &node).replace(r#","COLOR_0":3"#, "");
    Library::new(MemoryFiles::from([
        ("a.obj", obj.into_bytes()),
        ("a.mtl", b"newmtl m\nmap_Kd my wood.png\n".to_vec()),
        ("a.gltf", gltf.into_bytes()),
        ("my wood.png", png(picture)),
    ]))
}

#[test]
fn pictures_of_models_are_exact_at_the_middles_of_their_pixels() {
    let picture = levels(23, 17);
    let library = screen_wide(&picture);
    for (file, tone) in
        ["a.obj", "a.gltf"].into_iter().flat_map(|file| ["plain", "srgb"].map(|tone| (file, tone)))
    {
        let text = format!(
            "Screen 23 17\nOrthocamera\nTone {tone}\nMaterial shown own ambient 1 1 1\nMesh \"{file}\" shown\nTrace"
        );
        let parsed = parse_with_files("a.txt", text.as_bytes(), &Limits::default(), &library);
        let scene = parsed.script.unwrap_or_else(|| panic!("{:?}", parsed.diagnostics)).frame(0).unwrap();
        assert!(drawn(&scene) == picture, "{file} {tone}");
        assert!(reference::render(&scene, &RenderOptions::default()).unwrap() == picture, "{file} {tone}");
    }
}

#[test]
fn faces_have_no_hits_in_their_holes() {
    // Every pixel of the screen is one of the picture; behind it is the background, and the light through the holes.
    let gltf = String::from_utf8(quads_gltf(LEAF)).unwrap();
    let node = r#"{"mesh":0,"scale":[4.5,3.5,1],"translation":[4,3,-1]}"#;
    let gltf = gltf.replace(r#"{"mesh":0}"#, node).replace(r#","COLOR_0":3"#, "");
    let library = Library::new(MemoryFiles::from([("a.gltf", gltf.into_bytes()), ("leaf.png", leaf())]));
    let picture = image::load_from_memory(&leaf()).unwrap().to_rgba8();
    for surface in ["shown", "own", "green"] {
        let text = format!(
            "Screen 9 7\nOrthocamera\nBackground 0 0 1\nMaterial shown own ambient 1 1 1\nMaterial own own ambient 1 1 1 \
             diffuse 0 0 0\nMaterial green ambient 0 1 0\nMesh \"a.gltf\" {surface}\nTrace"
        );
        let parsed = parse_with_files("a.txt", text.as_bytes(), &Limits::default(), &library);
        let scene = parsed.script.unwrap_or_else(|| panic!("{:?}", parsed.diagnostics)).frame(0).unwrap();
        let plain = reference::render(&scene, &RenderOptions::default()).unwrap();
        assert!(drawn(&scene) == plain, "{surface}");
        let mut holes = 0;
        for (x, y, pixel) in picture.enumerate_pixels() {
            let [r, g, b, alpha] = pixel.0;
            let is_hole = 0.9 * f64::from(alpha) / 255.0 < 0.4;
            let shown = if surface == "green" { [0, 255, 0] } else { [r, g, b] };
            assert_eq!(plain.get_pixel(x, y).0, if is_hole { [0, 0, 255] } else { shown }, "{x} {y}");
            holes += usize::from(is_hole);
        }
        assert!((20..50).contains(&holes), "{holes}");
    }
}

#[test]
fn light_goes_through_holes() {
    // The shadow of a leaf on the floor, of a sun and of a lamp, through glass, in pictures of one sample and of several; and of
    // many leaves, which no mask has bits for.
    for lines in [
        "Mesh \"leaf.gltf\" red",
        "Box -2 1.5 -2 2 1.6 2 glassy\nMesh \"leaf.gltf\" red",
        "Samples 4 0\nMesh \"leaf.gltf\"",
    ] {
        let of = |mesh: &str| {
            let leaf = format!("{lines}\nEnd\nUse g 0 .3 0 -70 0 0 .7").replace("Mesh \"leaf.gltf\"", mesh);
            let at = leaf.find("Mesh").unwrap();
            scene(&format!("{}Group g\n{}", &leaf[..at], &leaf[at..]))
        };
        let (leaf, plate) = (drawn(&of("Mesh \"leaf.gltf\"")), drawn(&of("Mesh \"quads.gltf\"")));
        assert!(difference(&leaf, &plate) > 1.0, "{lines}");
    }
    compare("Group g\nMesh \"leaf.gltf\" red\nEnd\nUse g 0 .3 0 -70 0 0 .7");
    compare("Box -2 1.5 -2 2 1.6 2 glassy\nGroup g\nMesh \"leaf.gltf\" red\nEnd\nUse g 0 .3 0 -70 0 0 .7");
    let many =
        (0..60).map(|k| format!("Use g {} {} {} {} {} 0 .3\n", k % 8 - 3, k % 3, k % 7 - 4, 23 * k, 31 * k));
    compare(&format!("Group g\nMesh \"leaf.gltf\"\nEnd\n{}", many.collect::<String>()));
}

#[test]
fn pictures_and_holes_are_the_same_bytes_for_all_tiles_and_trees() {
    for lines in [
        "Mesh \"leaf.gltf\"",
        "Mesh \"turned.gltf\"",
        "Samples 5 0\nMesh \"leaf.gltf\" red",
        "Mesh \"quads.obj\"",
    ] {
        let scene = scene(&format!("Tone srgb\n{lines}\nSphere .4 .9 -.6 .8 chrome"));
        for models in [Some(false), Some(true)] {
            let usual = RenderOptions { models, ..RenderOptions::default() };
            let picture = render(&scene, &usual).unwrap();
            for (tile, tree) in [(Some((4, 4)), None), (Some((64, 4)), Some(true)), (None, Some(false))] {
                let options = RenderOptions { tile, tree, ..usual };
                assert!(render(&scene, &options).unwrap() == picture, "{lines} {tile:?} {tree:?} {models:?}");
            }
        }
    }
}

/// A pixel is clear where its ray meets nothing, and where it meets a hole.
#[test]
fn first_hits_pass_through_holes() {
    let text = "Screen 80 60\nLook .4 .3 4 0 0 0 32\nBackground none\nMesh \"leaf.gltf\"\nTrace";
    let scene = first_frame(text);
    let hits = first_hits(&scene, &RenderOptions::default()).unwrap();
    let picture = render_picture(Exposure::still(&scene), &RenderOptions::default()).unwrap().into_rgba8();
    let (mut seen, mut holes) = (0, 0);
    for (pixel, hit) in picture.pixels().zip(&hits) {
        assert_eq!(pixel.0[3] > 0, hit.object == 1, "{pixel:?} {hit:?}");
        seen += u32::from(hit.object == 1);
    }
    // Within the square that the model is.
    let square = first_frame(&text.replace("Mesh \"leaf.gltf\"", "Mesh \"quads.gltf\""));
    for (hit, of_square) in hits.iter().zip(first_hits(&square, &RenderOptions::default()).unwrap()) {
        holes += u32::from(of_square.object == 1 && hit.object == 0);
        assert!(of_square.object == 1 || hit.object == 0);
    }
    assert!(seen > 100 && holes > 100, "{seen} {holes}");
}

/// 64 balls of 5,280 triangles each: as their model's tree draws them, and written out, which is what balls of other
/// colours in a pattern of one colour are.
#[test]
fn a_model_that_is_used_often_is_drawn_as_written_out() {
    let uses: String = (0..64)
        .map(|k| {
            let (x, z) = (f64::from(k % 8) - 3.5, f64::from(k / 8) - 4.0);
            format!(
                "Use g {} {} {} {} {} 5 .{}\n",
                0.5 * x,
                0.2 * x * z,
                0.6 * z,
                7 * k,
                11 * k,
                15 + k % 4 * 5
            )
        })
        .collect();
    let library = Library::new(MemoryFiles::from([("fine.obj", obj(&ball(52), true, true))]));
    let drawn = |material: &str, smooth: &str, options: &RenderOptions| {
        let text = format!(
            "{STAGE}{material}\nGroup g\nMesh \"fine.obj\" fine {smooth}\nEnd\n{uses}Sphere .6 0 1 1 chrome\nTrace"
        );
        let parsed = parse_with_files("a.txt", text.as_bytes(), &Limits::default(), &library);
        let scene = parsed.script.unwrap_or_else(|| panic!("{:?}", parsed.diagnostics)).frame(0).unwrap();
        render(&scene, options).unwrap()
    };
    let fine = "Material fine ambient .1 .1 .2 diffuse .7 .6 .8 mirror .1 .1 .1 own shine .2 .2 .2 9";
    let (usual, by_tree) =
        (RenderOptions::default(), RenderOptions { models: Some(true), ..Default::default() });
    let written = RenderOptions { models: Some(false), ..Default::default() };
    let is_taken = super::one_in::one_in(2);
    for (_, smooth) in ["", "flat"].into_iter().enumerate().filter(|(k, _)| is_taken(*k)) {
        println!("{smooth}");
        let picture = drawn(fine, smooth, &usual);
        assert!(picture == drawn(fine, smooth, &by_tree), "there are many triangles");
        let off = difference(&picture, &drawn(fine, smooth, &written));
        assert!(off < 0.01, "{off} levels {smooth}");
        let painted =
            format!("Material two ambient .1 .1 .2 diffuse .7 .6 .8 mirror .1 .1 .1\n{fine} checker .3 two");
        let painted = drawn(&painted, smooth, &by_tree);
        assert!(
            painted == drawn(fine, smooth, &written),
            "patterns are drawn on triangles that are written out"
        );
    }
}

/// Large, small and far from the origin, and seen from within.
#[test]
fn models_with_trees_of_their_own_are_exact_at_every_scale() {
    for (scale, at) in [(1.0, 0.0), (1e-5, 0.0), (1e4, 0.0), (1.0, 1e4), (1e-3, 40.0), (300.0, -7e3)] {
        let place =
            |x: f64, y: f64, z: f64| format!("{} {} {}", at + scale * x, at + scale * y, at + scale * z);
        let lines = |eye: String, object: &str| {
            first_frame(&format!(
                "Screen 96 72\nLook {eye} {} 40\nBackground .2 .3 .5\nIlight .8 .8 .7 -.4 -1 -.3\nMaterial red ambient .1 0 0 \
                 diffuse .8 .2 .1\nMaterial chrome diffuse .1 .1 .1 mirror .8 .8 .8\nGroup g\nMesh {object}\nEnd\n\
                 Use g {} 10 50 30 {}\nUse g {} 80 5 0 {}\nTriangle {} {} {} .1 .1 .1 .6 .6 .6\nTrace",
                place(0.0, 0.0, 0.0),
                place(-0.9, 0.1, 0.0),
                0.8 * scale,
                place(1.0, -0.2, -0.5),
                scale,
                place(-9.0, -1.5, -9.0),
                place(9.0, -1.5, -9.0),
                place(0.0, -1.5, 9.0),
            ))
        };
        for object in ["\"round.obj\" red", "\"flat.obj\" chrome", "\"colored.obj\"", "\"quads.obj\""] {
            for eye in [place(0.3, 0.9, 5.0), place(-0.8, 0.2, 0.1)] {
                compare_scene(&lines(eye.clone(), object), &format!("{object} {scale} {at} {eye}"));
            }
        }
    }
}

/// Each of several pictures that begin together may make the tree of a model. The threads that make it share the work, and
/// take up further pictures while they wait.
#[test]
fn pictures_that_begin_together_share_a_model() {
    let library = Library::new(MemoryFiles::from([("fine.obj", obj(&ball(80), true, false))]));
    let text = format!("{STAGE}Mesh \"fine.obj\" red\nTrace");
    let parsed = parse_with_files("a.txt", text.as_bytes(), &Limits::default(), &library);
    let scene = parsed.script.unwrap().frame(0).unwrap();
    let options = RenderOptions { models: Some(true), ..RenderOptions::default() };
    let (sender, receiver) = std::sync::mpsc::channel();
    for _ in 0..8 {
        let (scene, sender) = (scene.clone(), sender.clone());
        rayon::spawn(move || sender.send(render(&scene, &options).unwrap()).unwrap());
    }
    let next =
        || receiver.recv_timeout(std::time::Duration::from_secs(120)).expect("no thread waits for ever");
    let first = next();
    assert!((1..8).all(|_| next() == first));
}
