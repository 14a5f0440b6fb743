//! The clause `image`: files, ways and widths; what is written reads back.

use std::sync::LazyLock;

use rayfold_scene::assets::{Library, MemoryFiles};
use rayfold_scene::{Axes, Image, ImageMap, Limits, Parsed, Script, parse_with_files};

static LIBRARY: LazyLock<Library> = LazyLock::new(|| {
    let light = b"#?RADIANCE\n\n-Y 1 +X 1\n\x01\x02\x03\x80".to_vec();
    let bare = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".to_vec();
    let mapped = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n".to_vec();
    let picture = include_bytes!("../pixel.png").to_vec();
    Library::new(MemoryFiles::from([
        ("a b.png", picture),
        ("light.hdr", light),
        ("bare.obj", bare),
        ("mapped.obj", mapped),
    ]))
});

fn parsed(text: &str) -> Parsed {
    parse_with_files("a.txt", text.as_bytes(), &Limits::default(), &LIBRARY)
}

fn script(lines: &str) -> Script {
    let Parsed { script, diagnostics, .. } = parsed(&format!("Screen 4 3\n{lines}Trace\n"));
    script.unwrap_or_else(|| panic!("{lines}\n{diagnostics:?}"))
}

fn messages(lines: &str) -> Vec<String> {
    let text = format!("Screen 4 3\nIlight 1 1 1 0 -1 0\n{lines}\nTrace\n");
    parsed(&text).diagnostics.into_iter().map(|diagnostic| diagnostic.message).collect()
}

fn image(script: &Script, frame: usize) -> Image {
    let scene = script.frame(frame).unwrap();
    scene.objects[0].material().finish().unwrap().image.clone().unwrap()
}

#[test]
fn a_picture_has_a_file_and_a_way() {
    for (words, map) in [
        ("ball", ImageMap::Ball),
        ("BALL", ImageMap::Ball),
        ("flat 2.5", ImageMap::Flat(2.5, Axes::Xy)),
        ("flat 1 xy", ImageMap::Flat(1.0, Axes::Xy)),
        ("Flat 1 xz", ImageMap::Flat(1.0, Axes::Xz)),
        ("flat 1 ZY", ImageMap::Flat(1.0, Axes::Zy)),
    ] {
        let own = script(&format!(
            "Ilight 1 1 1 0 -1 0\nMaterial m diffuse 1 1 1 image \"a b.png\" {words} shine 1 1 1 9 # \"x\n\
             Sphere 1 0 0 0 m\n"
        ));
        let found = image(&own, 0);
        assert_eq!((found.file().file(), found.map()), ("a b.png", map), "{words}");
        let again = parsed(&own.to_string()).script.unwrap();
        assert_eq!(again, own, "{own}");
        let of_scene = own.frame(0).unwrap().to_string();
        assert_eq!(image(&parsed(&of_scene).script.unwrap(), 0), found, "{of_scene}");
    }
}

#[test]
fn a_width_may_be_a_curve() {
    let moving =
        script("Frames 3\nMaterial m diffuse 1 1 1 image \"a b.png\" flat (1:1 3:5) xz\nSphere 1 0 0 0 m\n");
    assert_eq!(image(&moving, 1).map(), ImageMap::Flat(3.0, Axes::Xz));
    assert_eq!(parsed(&moving.to_string()).script.unwrap(), moving);
    let narrow = messages("Frames 3\nMaterial m image \"a b.png\" flat (1:1 3:-1)\nSphere 1 0 0 0 m");
    assert_eq!(narrow.len(), 1, "{narrow:?}");
}

#[test]
fn texture_coordinates_are_those_of_a_mesh() {
    let material = "Material m diffuse 1 1 1 image \"a b.png\" uv\n";
    assert_eq!(messages(&format!("{material}Mesh \"mapped.obj\" m")), [""; 0]);
    assert_eq!(messages(&format!("{material}Group g\nMesh \"mapped.obj\" m\nEnd\nUse g")), [""; 0]);
    assert_eq!(
        messages(&format!("{material}Mesh \"bare.obj\" m")),
        ["the model `bare.obj` has no texture coordinates, which a picture with `uv` needs"]
    );
    assert_eq!(
        messages(&format!("{material}Torus 1 .5 0 0 0 0 1 0 m")),
        ["a `Torus` has no texture coordinates, which a picture with `uv` needs"]
    );
    let moving = "Frames 2\nMaterial m diffuse (1:0 2:1) 1 1 image \"a b.png\" uv\nSphere (1:1 2:2) 0 0 0 m";
    assert_eq!(messages(moving).len(), 1);
}

#[test]
fn what_is_wrong_is_said() {
    let fault = |clause: &str| {
        let messages = messages(&format!("Material m diffuse 1 1 1 {clause}\nSphere 1 0 0 0 m"));
        assert_eq!(messages.len(), 1, "{clause}: {messages:?}");
        messages[0].clone()
    };
    assert_eq!(fault("image"), "`image` names no file");
    assert_eq!(fault("image shine 1 1 1 9"), "`image` names no file");
    assert!(fault("image a.png ball").contains("is not in quotes"));
    assert!(fault("image \"c.png\" ball").contains("there is no file `c.png`"));
    assert!(fault("image \"bare.obj\" ball").contains("it is no picture"));
    assert!(fault("image \"light.hdr\" ball").contains("only a `Sky` takes"));
    assert_eq!(fault("image \"a b.png\""), "`image` does not say how the picture lies");
    assert!(fault("image \"a b.png\" cube").contains("is no way in which a picture lies"));
    assert_eq!(fault("image \"a b.png\" flat"), "`flat` lacks the width of the picture");
    assert!(fault("image \"a b.png\" flat x").contains("not a number"));
    assert_eq!(fault("image \"a b.png\" flat 0"), "the width s must be greater than zero");
    assert!(fault("image \"a b.png\" flat 1 yz").contains("unknown material clause"));
    assert!(fault("image \"a b.png\" ball image \"a b.png\" ball").contains("image"));
    let two = "Material n diffuse 1 1 1\nMaterial m checker 1 n image \"a b.png\" ball\nSphere 1 0 0 0 m";
    assert_eq!(messages(two).len(), 1);
    // The material of a pattern has none.
    let nested = "Material n diffuse 1 1 1 image \"a b.png\" ball\nMaterial m checker 1 n\nSphere 1 0 0 0 m";
    assert_eq!(messages(nested).len(), 1);
    assert_eq!(
        parsed("Screen 4 3\nMaterial m image \"c.png\" ball\nSphere 1 0 0 0 m\nTrace\n").files,
        ["c.png"]
    );
}
