//! The same shape in every format, and what each format means.

use glam::DVec3;
use rayfold_assets::{AssetError, Closure, Library, MemoryFiles, Model, Smoothing};

/// A tetrahedron, its faces seen counterclockwise from outside.
const CORNERS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
const FACES: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

fn model(name: &str, bytes: Vec<u8>) -> std::sync::Arc<Model> {
    let library = Library::new(MemoryFiles::from([(name, bytes)]));
    library.model(name, Smoothing::OfFile).unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn fault(bytes: impl Into<Vec<u8>>) -> String {
    let library = Library::new(MemoryFiles::from([("x", bytes.into())]));
    library.model("x", Smoothing::OfFile).map(|_| ()).unwrap_err().to_string()
}

/// The corners of all triangles, in order.
fn triangles(model: &Model) -> Vec<[DVec3; 3]> {
    (0..model.triangle_count()).map(|k| model.corners(k)).collect()
}

fn expected() -> Vec<[DVec3; 3]> {
    FACES.map(|face| face.map(|i| DVec3::from(CORNERS[i as usize].map(f64::from)))).to_vec()
}

fn obj() -> Vec<u8> {
    let corners = CORNERS.map(|[x, y, z]| format!("v {x} {y} {z}\n")).concat();
    let faces = FACES.map(|[a, b, c]| format!("f {} {} {}\n", a + 1, b + 1, c + 1)).concat();
    (corners + &faces).into_bytes()
}

fn ply_text() -> Vec<u8> {
    let head = "ply\nformat ascii 1.0\ncomment x\nelement vertex 4\nproperty float x\nproperty float y\nproperty float \
                z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n";
    let corners = CORNERS.map(|[x, y, z]| format!("{x} {y} {z}\n")).concat();
    let faces = FACES.map(|[a, b, c]| format!("3 {a} {b} {c}\n")).concat();
    format!("{head}{corners}{faces}").into_bytes()
}

fn ply_binary(little: bool) -> Vec<u8> {
    let order = if little { "little" } else { "big" };
    let mut bytes = format!(
        "ply\nformat binary_{order}_endian 1.0\nelement vertex 4\nproperty float x\nproperty double y\nproperty float \
         z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nelement face 4\nproperty uchar \
         flags\nproperty list uchar ushort vertex_index\nend_header\n"
    )
    .into_bytes();
    let ordered = |mut bytes: Vec<u8>| {
        if !little {
            bytes.reverse();
        }
        bytes
    };
    for [x, y, z] in CORNERS {
        bytes.extend(ordered(x.to_le_bytes().to_vec()));
        bytes.extend(ordered(f64::from(y).to_le_bytes().to_vec()));
        bytes.extend(ordered(z.to_le_bytes().to_vec()));
        bytes.extend([255, 51, 0]);
    }
    for face in FACES {
        bytes.extend([7, 3]);
        face.iter().for_each(|i| bytes.extend(ordered((*i as u16).to_le_bytes().to_vec())));
    }
    bytes
}

fn stl_binary() -> Vec<u8> {
    let mut bytes = b"solid that is binary".to_vec();
    bytes.resize(80, 0);
    bytes.extend(4u32.to_le_bytes());
    for face in FACES {
        bytes.extend([0; 12]);
        face.iter().flat_map(|i| CORNERS[*i as usize]).for_each(|x| bytes.extend(x.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

fn stl_text() -> Vec<u8> {
    let facet = |face: [u32; 3]| {
        let corners =
            face.map(|i| CORNERS[i as usize]).map(|[x, y, z]| format!("vertex {x} {y} {z}\n")).concat();
        format!("facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\n")
    };
    format!("solid a\n{}endsolid a\n", FACES.map(facet).concat()).into_bytes()
}

/// A binary glTF: positions with a stride of 16, then 16-bit indices.
fn glb(node: &str) -> Vec<u8> {
    let mut buffer: Vec<u8> = vec![];
    for corner in CORNERS {
        corner.iter().for_each(|x| buffer.extend(x.to_le_bytes()));
        buffer.extend([0xff; 4]);
    }
    FACES.iter().flatten().for_each(|i| buffer.extend((*i as u16).to_le_bytes()));
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{node}],"meshes":[{{"primitives":
        [{{"attributes":{{"POSITION":0}},"indices":1,"material":0}}]}}],"materials":[{{"pbrMetallicRoughness":
        {{"baseColorFactor":[0.5,0.25,1,1]}},"emissiveFactor":[0,1,0]}}],"accessors":[{{"bufferView":0,"componentType":
        5126,"count":4,"type":"VEC3"}},{{"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}}],
        "bufferViews":[{{"buffer":0,"byteLength":64,"byteStride":16}},{{"buffer":0,"byteOffset":64,"byteLength":24}}],
        "buffers":[{{"byteLength":{}}}]}}"#,
        buffer.len()
    );
    let mut json = json.into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let total = 12 + 8 + json.len() + 8 + buffer.len();
    let mut bytes = b"glTF".to_vec();
    bytes.extend(2u32.to_le_bytes());
    bytes.extend((total as u32).to_le_bytes());
    bytes.extend((json.len() as u32).to_le_bytes());
    bytes.extend(b"JSON");
    bytes.extend(json);
    bytes.extend((buffer.len() as u32).to_le_bytes());
    bytes.extend(b"BIN\0");
    bytes.extend(buffer);
    bytes
}

/// Returns the colour of the first triangle at a place, without a picture.
fn color_at(model: &Model, weights: [f64; 3], linear: bool) -> DVec3 {
    model.color(model.look(0), model.vertex_colors(0), weights, DVec3::ONE, linear)
}

#[test]
fn all_formats_give_the_same_triangles() {
    for (name, bytes) in [
        ("a.obj", obj()),
        ("a.ply", ply_text()),
        ("a.ply", ply_binary(true)),
        ("a.ply", ply_binary(false)),
        ("a.stl", stl_binary()),
        ("a.stl", stl_text()),
        ("a.glb", glb(r#"{"mesh":0}"#)),
        // The content decides.
        ("a.obj", glb(r#"{"mesh":0}"#)),
    ] {
        let model = model(name, bytes);
        assert_eq!(triangles(&model), expected(), "{name}");
        assert_eq!(*model.closure(), Closure::Closed, "{name}");
        assert!(model.normals(0).is_none() && !model.has_normals());
    }
}

#[test]
fn polygons_are_fans_and_indices_may_be_negative() {
    let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 2\nf -4//1 -3//1 \\\n 3//-1 4//1\n";
    let model = model("a.obj", text.into());
    let corner = |x: f64, y: f64| DVec3::new(x, y, 0.0);
    let (a, b, c, d) = (corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0));
    assert_eq!(triangles(&model), [[a, b, c], [a, c, d]]);
    assert_eq!(model.normals(1), Some([DVec3::Z; 3]));
}

#[test]
fn colours_are_what_the_formats_say() {
    let colored = model("a.ply", ply_binary(true));
    let color = color_at(&colored, [0.2, 0.3, 0.5], false);
    assert!((color - DVec3::new(1.0, 0.2, 0.0)).length() < 1e-6, "{color}");
    let linear = color_at(&colored, [0.2, 0.3, 0.5], true);
    assert!((linear.y - 0.0331).abs() < 1e-4, "levels are decoded: {linear}");
    let gltf = model("a.glb", glb(r#"{"mesh":0}"#));
    assert_eq!(color_at(&gltf, [1.0, 0.0, 0.0], true), DVec3::new(0.5, 0.25, 1.0));
    assert!((color_at(&gltf, [1.0, 0.0, 0.0], false).x - 0.735).abs() < 1e-3, "encoded");
    assert_eq!(gltf.glow(gltf.look(0), DVec3::ONE, true), DVec3::Y);
    let plain = model("a.obj", obj());
    assert_eq!(
        (plain.look_color(0, false), plain.look_color(0, true)),
        (DVec3::splat(0.8), DVec3::splat(0.8))
    );
    let half = model("a.obj", b"v 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".to_vec());
    assert_eq!(
        color_at(&half, [0.0, 1.0, 0.0], true),
        DVec3::ONE,
        "a vertex without a colour beside others is white"
    );
}

#[test]
fn nodes_move_and_mirrors_turn_faces() {
    let moved = model("a.glb", glb(r#"{"mesh":0,"translation":[1,2,3],"scale":[2,2,2]}"#));
    assert_eq!(moved.corners(3)[0], DVec3::new(3.0, 2.0, 3.0));
    let mirrored = model("a.glb", glb(r#"{"mesh":0,"scale":[-1,1,1]}"#));
    assert_eq!(*mirrored.closure(), Closure::Closed, "not inside out");
    let nested =
        model("a.glb", glb(r#"{"children":[1],"translation":[0,1,0]},{"mesh":0,"translation":[1,0,0]}"#));
    assert_eq!(nested.corners(0)[0], DVec3::new(1.0, 1.0, 0.0));
}

/// A glTF of one triangle, whose positions are in a buffer at this address.
fn gltf(uri: &str) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"attributes":
        {{"POSITION":0}}}}]}}],"accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}}],"buffers":[{{"uri":"{uri}","byteLength":36}}]}}"#
    )
}

/// The address of a buffer that is data: three corners.
fn corners_as_data() -> String {
    let corners: Vec<u8> = CORNERS[..3].iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    format!("data:application/octet-stream;base64,{}", base64_simd::STANDARD.encode_to_string(&corners))
}

#[test]
fn data_and_files_are_buffers() {
    let corners: Vec<u8> = CORNERS[..3].iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    let data = gltf(&corners_as_data());
    assert_eq!(model("a.gltf", data.into_bytes()).triangle_count(), 1);
    let files = MemoryFiles::from([("a.gltf", gltf("./parts/a%20b.bin").into_bytes()), ("a b.bin", corners)]);
    let library = Library::new(files);
    assert_eq!(library.model("a.gltf", Smoothing::OfFile).unwrap().triangle_count(), 1);
    assert_eq!(library.sources("a.gltf")[1], ("a b.bin".to_string(), "parts/a b.bin".to_string()));
    let alone = Library::new(MemoryFiles::from([("a.gltf", gltf("a.bin").into_bytes())]));
    let error = alone.model("a.gltf", Smoothing::OfFile).unwrap_err();
    assert_eq!(error, AssetError::Absent { name: "a.bin".into(), similar: None });
}

#[test]
fn materials_of_an_obj_come_from_its_files() {
    let text = "mtllib my colours.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl blue paint\nf 1 2 3\nusemtl none\nf 3 2 1\n";
    let files = MemoryFiles::from([
        ("a.obj", text.into()),
        ("my colours.mtl", b"newmtl blue paint\nKd 0 .5 1\nKs 1 1 1\nd .5\nnewmtl none\nKs 1 1 1".to_vec()),
    ]);
    let model = Library::new(files).model("a.obj", Smoothing::OfFile).unwrap();
    assert_eq!(model.look_color(model.look(0), false), DVec3::new(0.0, 0.5, 1.0));
    assert_eq!(model.look_color(model.look(1), false), DVec3::splat(0.8), "an entry without Kd");
    assert!(model.warnings().is_empty(), "{:?}", model.warnings());
}

#[test]
fn what_is_wrong_is_said() {
    for (bytes, message) in [
        (&b"v 0 0 0\nf 1 2 3\n"[..], "`x`, line 2: position 2 of 1"),
        (b"v 0 0 nan\n", "`x`, line 1: `nan` is not a finite number"),
        (b"v 0 0\n", "`x`, line 1: 2 of 3 numbers"),
        (b"v 0 0 0\nv 1 0 0\nf 1 2\n", "`x`, line 3: a face of 2 corners"),
        (
            b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n",
            "`x` has no triangle with an area: a model is drawn by its faces",
        ),
        (b"hello\n", "`x`: it is no model: expected OBJ, PLY, STL or glTF"),
        (b"\x7fELF\0\0", "`x`: it is no model: expected OBJ, PLY, STL or glTF"),
        (b"ply\nformat ascii 2.0\n", "`x`, line 2: `format ascii 2.0` is no line of a header"),
        (b"{}", "`x`: it is not glTF of version 2"),
        (
            b"{\n\"nodes\": 7}",
            "`x`, line 2: its JSON: invalid type: integer `7`, expected a sequence at line 2 column 10",
        ),
        (
            br#"{"asset":{"version":"1.0"},"scene":"defaultScene","nodes":{"a":{}}}"#,
            "`x`: it is glTF of version 1.0, not 2",
        ),
        (
            br#"{"asset":{"version":"2.0"},"extensionsRequired":["KHR_draco_mesh_compression"]}"#,
            "`x` needs the glTF extension KHR_draco_mesh_compression",
        ),
    ] {
        assert_eq!(fault(bytes), message);
    }
}

#[test]
fn texts_of_other_systems_are_read() {
    let read = |text: &str, name: &str| {
        let mtl = b"newmtl red\rKd 1 0 0\r".to_vec();
        let files = MemoryFiles::from([(name, text.as_bytes().to_vec()), ("a.mtl", mtl)]);
        Library::new(files).model(name, Smoothing::OfFile).unwrap_or_else(|error| panic!("{name}: {error}"))
    };
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    for (name, text) in [("x.obj", text(obj())), ("x.ply", text(ply_text())), ("x.stl", text(stl_text()))] {
        for other in [format!("\u{feff}{text}"), text.replace('\n', "\r\n"), text.replace('\n', "\r")] {
            assert_eq!(triangles(&read(&other, name)), expected(), "{name}");
        }
    }
    let red = read(&format!("mtllib a.mtl\rusemtl red\r{}", text(obj()).replace('\n', "\r")), "x.obj");
    assert_eq!(red.look_color(red.look(0), false), DVec3::X);
}

#[test]
fn a_binary_stl_of_another_length_is_said() {
    let fault = |bytes: Vec<u8>| {
        let library = Library::new(MemoryFiles::from([("x.stl", bytes)]));
        library.model("x.stl", Smoothing::OfFile).map(|_| ()).unwrap_err().to_string()
    };
    let [mut longer, mut shorter] = [stl_binary(), stl_binary()];
    longer.push(b'\n');
    shorter.pop();
    assert_eq!(
        fault(longer),
        "`x.stl`: it has 285 bytes of 284 for 4 triangles: it is too long, or no binary STL"
    );
    assert_eq!(
        fault(shorter),
        "`x.stl`: it has 283 bytes of 284 for 4 triangles: it is cut off, or no binary STL"
    );
}

#[test]
fn what_of_a_gltf_is_not_used_is_named() {
    let warnings = |extensions: &str| {
        let extended = gltf(&corners_as_data()).replacen(
            '{',
            &format!("{{\"skins\":[{{}}],\"extensionsUsed\":[{extensions}],"),
            1,
        );
        model("x.gltf", extended.into()).warnings().join("\n")
    };
    assert_eq!(warnings(r#""KHR_materials_unlit""#), "its skins are not used");
    // These have other data beside theirs, unless they are required.
    assert_eq!(warnings(r#""KHR_draco_mesh_compression""#), "its skins are not used");
    assert_eq!(
        warnings(r#""KHR_lights_punctual","KHR_materials_pbrSpecularGlossiness","EXT_mesh_gpu_instancing""#),
        "its skins, lights, KHR_materials_pbrSpecularGlossiness, EXT_mesh_gpu_instancing are not used"
    );
    let many: Vec<_> = (0..9).map(|k| format!("\"EXT_{k}\"")).collect();
    assert_eq!(
        warnings(&many.join(",")),
        "its skins, EXT_0, EXT_1, EXT_2, EXT_3, EXT_4, 4 more extensions are not used"
    );
}

/// Returns a binary PLY of the tetrahedron whose faces are lists of `kind`, each with its corners.
fn ply_with_faces(little: bool, kind: &str, faces: &[Vec<u32>]) -> Vec<u8> {
    let order = if little { "little" } else { "big" };
    let mut bytes = format!(
        "ply\nformat binary_{order}_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float \
         z\nelement face {}\nproperty list uchar {kind} vertex_indices\nend_header\n",
        faces.len()
    )
    .into_bytes();
    let mut put = |number: [u8; 4]| {
        bytes.extend(if little { number } else { [number[3], number[2], number[1], number[0]] });
    };
    CORNERS.as_flattened().iter().for_each(|x| put(x.to_le_bytes()));
    for face in faces {
        bytes.push(face.len() as u8);
        for corner in face {
            let number = corner.to_le_bytes();
            bytes.extend(if little { number } else { corner.to_be_bytes() });
        }
    }
    bytes
}

#[test]
fn triangles_of_a_binary_ply_may_be_among_other_faces() {
    let of = |faces: &[Vec<u32>]| faces.to_vec();
    let [a, b, c, d] = FACES.map(|face| face.to_vec());
    let cases = [
        (of(&[a.clone(), b.clone(), c.clone(), d.clone()]), 4),
        (of(&[a.clone(), vec![0, 1, 3, 2], d.clone()]), 4),
        (of(&[vec![0, 1, 3, 2], a.clone(), d.clone()]), 4),
        (of(&[a.clone(), b, c, vec![1, 2]]), 3),
    ];
    for (faces, count) in cases {
        let expected = triangles(&model("x.ply", ply_with_faces(true, "int", &faces)));
        assert_eq!(expected.len(), count);
        assert_eq!(expected[0], corners_of(&faces[0]));
        for (little, kind) in [(false, "int"), (true, "uint"), (false, "uint")] {
            assert_eq!(triangles(&model("x.ply", ply_with_faces(little, kind, &faces))), expected);
        }
    }
    let negative = of(&[a.clone(), vec![0, 1, u32::MAX]]);
    assert_eq!(fault(ply_with_faces(true, "int", &negative)), "`x`: a face has the corner -1");
    let outside = of(&[a.clone(), vec![0, 1, 4]]);
    assert_eq!(fault(ply_with_faces(true, "int", &outside)), "`x`: an index is out of range: 4 of 4, from 0");
    let mut cut = ply_with_faces(true, "int", &of(&[a.clone(), a.clone()]));
    cut.truncate(cut.len() - 1);
    assert_eq!(fault(cut), "`x`: it ends before the numbers that its header promises");
}

fn corners_of(face: &[u32]) -> [DVec3; 3] {
    [0, 1, 2].map(|k| DVec3::from(CORNERS[face[k] as usize].map(f64::from)))
}

#[test]
fn what_only_some_lines_of_an_obj_have_is_that_of_these_lines() {
    let text = "v 0 0 0\nv 1 0 0 1 1 1\nv 0 1 0\nvn 0 0 1\nvt 0 1\nf 1 2 3\nf 1//1 2//1 3//1\nusemtl a\nf 1/1 2/1 3/1\n";
    let model = model("a.obj", text.into());
    assert_eq!([0, 1, 2].map(|k| model.look(k)), [0, 0, 1]);
    assert_eq!([0, 1, 2].map(|k| model.normals(k).is_some()), [false, true, false]);
    assert_eq!(model.rounded_normals(1).unwrap()[2].to_array(), [0.0, 0.0, 1.0]);
    assert_eq!(model.rounded_normals(2), None);
    assert_eq!(
        model.vertex_colors(0).unwrap(),
        [glam::Vec3::ONE; 3],
        "white of its own, not what has no colour"
    );
    assert_eq!([0, 2].map(|k| model.uvs(k).unwrap()[0].y), [0.0, 1.0]);
}

#[test]
fn a_comment_of_an_obj_neither_goes_on_nor_counts() {
    let plain = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt .5\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\n";
    let commented = "# from C:\\models\\\nv 0 0 0 # here\nv 1 0 0 # C:\\models\\\nv 0 1 \\  \n 0 #1\\\n\
                     vt .5 # u\nvn 0 0 1 #\nf 1/1/1 2/1/1 3/1/1 # 4/4/4\n";
    let [plain, commented] = [plain, commented].map(|text| model("a.obj", text.into()));
    assert_eq!(triangles(&plain), triangles(&commented));
    assert_eq!(plain.normals(0), commented.normals(0));
}

#[test]
fn elements_of_a_ply_come_in_any_order() {
    let vertex = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\nproperty \
                  float ny\nproperty float nz\nproperty float s\nproperty float t\n";
    let face = "element face 1\nproperty list uchar int vertex_indices\n";
    let (vertices, faces) = ("0 0 0 0 .6 .8 0 0\n1 0 0 0 0 1 1 0\n0 1 0 0 0 1 0 1\n", "3 0 1 2\n");
    let whole = |head: [&str; 2], body: [&str; 2]| {
        let text = format!("ply\nformat ascii 1.0\n{}end_header\n{}", head.concat(), body.concat());
        model("a.ply", text.into())
    };
    let [usual, other] = [whole([vertex, face], [vertices, faces]), whole([face, vertex], [faces, vertices])];
    assert!(usual.normals(0).is_some());
    assert_eq!(usual.normals(0), other.normals(0));
    assert_eq!(usual.uvs(0), other.uvs(0));
}

#[test]
fn a_line_names_one_library_or_several() {
    let faces = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\nusemtl blue\nf 1 2 3\n";
    let read = |line: &str, names: &[&str]| {
        let mut files = MemoryFiles::from([("x.obj", format!("{line}\n{faces}").into_bytes())]);
        let libraries = ["newmtl red\nKd 1 0 0\n", "newmtl blue\nKd 0 0 1\n"];
        names.iter().zip(libraries).for_each(|(name, text)| files.insert(name, text.into()));
        let library = Library::new(files);
        let model = library.model("x.obj", Smoothing::OfFile).unwrap();
        let colors = [0, 1].map(|k| model.look_color(model.look(k), false));
        let sources: Vec<_> = library.sources("x.obj").into_iter().map(|(name, _)| name).collect();
        (colors, model.warnings().to_vec(), sources[1..].join(" | "))
    };
    let [red, blue, grey] = [DVec3::X, DVec3::Z, DVec3::splat(0.8)];
    let both = |sources: &str| ([red, blue], vec![], sources.to_string());
    assert_eq!(read("mtllib lib/a.mtl lib/b.mtl", &["a.mtl", "b.mtl"]), both("a.mtl | b.mtl"));
    assert_eq!(read("mtllib a.mtl b.mtl", &["a.mtl", "b.mtl"]), both("a.mtl | a.mtl b.mtl | b.mtl"));
    assert_eq!(read("mtllib a.mtl\nmtllib a.mtl\nmtllib b.mtl", &["a.mtl", "b.mtl"]), both("a.mtl | b.mtl"));
    let (colors, warnings, sources) = read("mtllib my lib/a.mtl", &["a.mtl"]);
    assert_eq!((colors[0], warnings.len(), sources.as_str()), (red, 1, "a.mtl"));
    assert_eq!(warnings[0], "no library has the material `blue`: what has it is grey");
    // Any of these may come later.
    let (colors, warnings, sources) = read("mtllib a.mtl b.mtl\nmtllib a.mtl b.mtl", &[]);
    assert_eq!((colors, warnings.len(), sources.as_str()), ([grey; 2], 1, "a.mtl | a.mtl b.mtl | b.mtl"));
    let (_, warnings, sources) = read("mtllib", &[]);
    assert_eq!((warnings.len(), sources.as_str()), (0, ""));
}
