//! The scenes for which instructions are counted. Each lacks some features, and uses many others or few.

use anyhow::{Context, Result, bail};
use glam::DVec3;
use rayfold_scene::assets::{Library, MemoryFiles};
use rayfold_scene::{Limits, Object, Scene, parse_with_files};

use super::parts::is_mirror;
use crate::scenes::{cloud, example, rock, table};

/// A scene, and the precision with which it is drawn.
pub(super) struct Subject {
    pub(super) name: &'static str,
    pub(super) precision: &'static str,
    /// The scene of its first frame.
    pub(super) scene: Scene,
    pub(super) script: String,
    pub(super) is_of_version_2: bool,
}

/// Returns all scenes.
///
/// # Errors
/// Fails if an example of the project cannot be read.
pub(super) fn subjects() -> Result<Vec<Subject>> {
    let mut subjects = of_version_1()?;
    for (name, lines) in OF_VERSION_2 {
        let script = format!("{BEFORE}{lines}Trace\n");
        let files = MemoryFiles::from([("model.obj", MODEL.to_vec()), ("sky.png", SKY.to_vec())]);
        let library = Library::new(files);
        let parsed = parse_with_files(name, script.as_bytes(), &Limits::default(), &library);
        let scene = parsed.script.and_then(|script| script.frame(0));
        let scene = scene.with_context(|| format!("{name}: {:?}", parsed.diagnostics))?;
        subjects.push(Subject { name, precision: "auto", scene, script, is_of_version_2: true });
    }
    Ok(subjects)
}

/// A panorama, which scenes name as `sky.png`.
pub(crate) const SKY: &[u8] = include_bytes!("../../../../docs/models/dusk.png");

/// The camera and the sun of the scenes of version 2.
const BEFORE: &str = "\
Screen 160 120
Camera 0 2 8   0 -0.2 -1   0 1 0   1   -0.6 -0.45 0.6 0.45
Ilight 0.9 0.9 0.8   -1 -2 -1
";

/// A model with normals, which scenes name as `model.obj`: an octahedron.
pub(super) const MODEL: &[u8] = b"v 1 0 0\nv -1 0 0\nv 0 1 0\nv 0 -1 0\nv 0 0 1\nv 0 0 -1
vn 1 0 0\nvn -1 0 0\nvn 0 1 0\nvn 0 -1 0\nvn 0 0 1\nvn 0 0 -1
f 1//1 3//3 5//5\nf 3//3 2//2 5//5\nf 2//2 4//4 5//5\nf 4//4 1//1 5//5
f 3//3 1//1 6//6\nf 2//2 3//3 6//6\nf 4//4 2//2 6//6\nf 1//1 4//4 6//6
";

/// The scenes of version 2. Each has as little as possible besides the feature that its name mentions.
const OF_VERSION_2: [(&str, &str); 25] = [
    (
        "a plane and balls",
        "Plane 0 -1 0  0 1 0  .1 .1 .1  .6 .6 .6
Sphere 1  -1 0 0  .1 .1 .1  .6 .2 .2
Sphere 1   1 0 -2  .1 .1 .1  .2 .6 .2
",
    ),
    (
        "discs",
        "Disc 2  -1 0 0  .2 1 .1  .1 .1 .1  .6 .2 .2
Disc 2   1 1 -2  -.2 .5 1  .1 .1 .1  .2 .6 .2
",
    ),
    (
        "a cylinder and a cone",
        "Cylinder .8  -1.5 -1 0  -1 1.5 0  .1 .1 .1  .6 .2 .2
Cone 1 0   1.5 -1 -1  1.5 2 -1  .1 .1 .1  .2 .6 .2
",
    ),
    (
        "tori",
        "Torus 1.2 .4  -1 0 0  .2 1 .1  .1 .1 .1  .6 .2 .2
Torus 1.2 .2   1 1 -2  -.2 .5 1  .1 .1 .1  .2 .6 .2
",
    ),
    (
        "capsules",
        "Capsule .8  -1.5 -1 0  -1 1.5 0  .1 .1 .1  .6 .2 .2
Capsule .5   1.5 -1 -1  1.5 2 -1  .1 .1 .1  .2 .6 .2
",
    ),
    (
        "boxes with round edges",
        "Roundbox -2 -1 -1  -.5 1 .5  .3  .1 .1 .1  .6 .2 .2
Roundbox .5 -1 -1.5  2 2 .5  .6  .1 .1 .1  .2 .6 .2
",
    ),
    (
        "turned boxes",
        "Group brick
Box -1 -.5 -1  1 .5 1  .1 .1 .1  .6 .2 .2
End
Use brick  -1 0 0  10 20 30
Use brick  1.5 1 -2  40 50 60
",
    ),
    (
        "a mesh with normals",
        "Mesh \"model.obj\"
Sphere 1   1 0 -2  .1 .1 .1  .2 .6 .2
",
    ),
    (
        "letters",
        "Text \"A&\" 2 .5 .1 .1 .1  .6 .2 .2 centre
Sphere 1   1 0 -2  .1 .1 .1  .2 .6 .2
",
    ),
    (
        "groups of balls",
        "Group pair
Sphere .7  -.7 0 0  .1 .1 .1  .6 .2 .2
Sphere .7   .7 0 0  .1 .1 .1  .2 .6 .2
End
Use pair  -1 0 0  0 30 0
Use pair  1.5 1 -2  0 0 90
",
    ),
    (
        "highlights on balls",
        "Material glossy  diffuse .6 .2 .2  shine .8 .8 .8 50
Sphere 1  -1 0 0  glossy
Sphere 1   1 0 -2  glossy
",
    ),
    (
        "balls that glow",
        "Material lit  diffuse .6 .2 .2  glow .2 .3 .1
Sphere 1  -1 0 0  lit
Sphere 1   1 0 -2  lit
",
    ),
    (
        "balls that light each other",
        "Samples 16 0
Indirect 2
Background .6 .7 .8
Sphere 1  -1 0 0  0 0 0  .6 .2 .2
Sphere 1   1 0 -2  0 0 0  .2 .6 .2
",
    ),
    (
        "patterns on balls",
        "Material other  diffuse .1 .1 .1
Material board  diffuse .6 .6 .2  checker .3 other
Sphere 1  -1 0 0  board
Sphere 1   1 0 -2  board
",
    ),
    (
        "balls in lamplight",
        "Plight 1 1 1  0 3 2
Sphere 1  -1 0 0  .1 .1 .1  .6 .2 .2
Sphere 1   1 0 -2  .1 .1 .1  .2 .6 .2
",
    ),
    (
        "balls below a sky",
        "Background .8 .8 .8  .2 .4 .9
Sphere 1  -1 0 0  .1 .1 .1  .6 .2 .2
Sphere 1   1 0 -2  .1 .1 .1  .2 .6 .2
",
    ),
    (
        "balls below a picture",
        "Sky \"sky.png\" 1 30
Sphere 1  -1 0 0  .1 .1 .1  .6 .2 .2
Sphere 1   1 0 -2  .1 .1 .1  .2 .6 .2
",
    ),
    (
        "balls in fog",
        "Fog .5 .5 .6 20
Sphere 1  -1 0 0  .1 .1 .1  .6 .2 .2
Sphere 1   1 0 -2  .1 .1 .1  .2 .6 .2
",
    ),
    (
        "balls before nothing",
        "Background none
Sphere 1  -1 0 0  .1 .1 .1  .6 .2 .2
Sphere 1   1 0 -2  .1 .1 .1  .2 .6 .2
",
    ),
    (
        "balls in sRGB",
        "Tone srgb
Sphere 1  -1 0 0  .1 .1 .1  .6 .2 .2
Sphere 1   1 0 -2  .1 .1 .1  .2 .6 .2
",
    ),
    (
        "balls of glass",
        "Material clear  glass .9 .95 .9 1.5
Sphere 1  -1 0 0  clear
Sphere 1   1 0 -2  .1 .1 .1  .2 .6 .2
",
    ),
    (
        "samples of balls",
        "Samples 8 0
Sphere 1  -1 0 0  .1 .1 .1  .6 .2 .2
Sphere 1   1 0 -2  .1 .1 .1  .2 .6 .2
",
    ),
    (
        "balls through a lens",
        "Samples 8 0
Lens .2 8
Sphere 1  -1 0 0  .1 .1 .1  .6 .2 .2
Sphere 1   1 0 -2  .1 .1 .1  .2 .6 .2
",
    ),
    (
        "balls that move",
        "Samples 8 0
Shutter 1
Sphere 1  (1:-1 2:0) 0 0  .1 .1 .1  .6 .2 .2
Sphere 1   1 0 -2  .1 .1 .1  .2 .6 .2
",
    ),
    (
        "balls below a wide sun",
        "Samples 8 0
Clear
Ilight 0.9 0.9 0.8   -1 -2 -1  10
Sphere 1  -1 0 0  .1 .1 .1  .6 .2 .2
Sphere 1   1 0 -2  .1 .1 .1  .2 .6 .2
",
    ),
];

fn of_version_1() -> Result<Vec<Subject>> {
    let whole = table(320, 240)?;
    let only = |keep: fn(&Object) -> bool| {
        let mut scene = whole.clone();
        scene.objects = whole.objects.iter().filter(|o| keep(o)).cloned().collect();
        scene
    };
    let unlit = |scene: &Scene| {
        let mut scene = scene.clone();
        scene.lights = Vec::new().into();
        scene
    };
    let mut one = only(is_ball);
    one.objects = one.objects.iter().filter(|o| !is_mirror(o)).take(1).cloned().collect();
    let mut together = rock(1280, 320, 240)?;
    together.objects = together.objects.iter().chain(whole.objects.iter().skip(1)).cloned().collect();
    let mut blocks = cloud(200, 320, 240)?;
    blocks.objects = blocks.objects.iter().map(boxed).collect::<Result<Vec<_>>>()?.into();
    let scenes = [
        ("balls", only(|o| is_ball(o) && !is_mirror(o))),
        ("balls and mirrors", only(is_ball)),
        ("boxes and mirrors", only(|o| !matches!(o, Object::Triangle(_)))),
        ("triangles and mirrors", only(|o| !matches!(o, Object::Cuboid(_)))),
        ("boxes", only(|o| !matches!(o, Object::Triangle(_)) && !is_mirror(o))),
        ("triangles", only(|o| !matches!(o, Object::Cuboid(_)) && !is_mirror(o))),
        ("all but mirrors", only(|o| !is_mirror(o))),
        ("all", whole.clone()),
        ("balls, unlit", unlit(&only(|o| is_ball(o) && !is_mirror(o)))),
        ("all, unlit", unlit(&whole)),
        ("one ball", one),
        ("hello", example("hello")?),
        ("1,000 balls and mirrors", cloud(1000, 320, 240)?),
        ("200 boxes", blocks),
        ("1,280 triangles", rock(1280, 320, 240)?),
        ("1,280 triangles, unlit", unlit(&rock(1280, 320, 240)?)),
        ("1,280 triangles, mirrors, a box", together),
    ];
    let subject = |name, precision, scene: Scene| {
        let script = scene.to_string();
        Subject { name, precision, scene, script, is_of_version_2: false }
    };
    let mut subjects: Vec<_> = scenes.into_iter().map(|(name, scene)| subject(name, "auto", scene)).collect();
    subjects.push(subject("balls, f64", "f64", only(is_ball)));
    let boxes = only(|o| !is_mirror(o) && !matches!(o, Object::Triangle(_)));
    subjects.push(subject("boxes, f64", "f64", boxes));
    Ok(subjects)
}

fn is_ball(object: &Object) -> bool {
    matches!(object, Object::Sphere(_))
}

/// Returns the bounding box of a sphere, without its mirror.
fn boxed(object: &Object) -> Result<Object> {
    let Object::Sphere(ball) = object else { bail!("not a ball") };
    let reach = DVec3::splat(0.8 * ball.radius());
    let material = crate::scenes::material(ball.material().diffuse(), 0.0)?;
    let corners = [ball.center() - reach, ball.center() + reach];
    Ok(Object::Cuboid(rayfold_scene::Cuboid::new(corners, material)?))
}
