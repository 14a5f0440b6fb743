//! Written scripts read back as the same, and their frames equal those of a manual replay.
//!
//! A failure prints its seed as a line for a `.proptest-regressions` file.

use glam::{DVec2, DVec3};
use proptest::prelude::*;
use rayfold_scene::{
    Background, Camera, Capsule, Coefficients, Cone, Cuboid, Cylinder, Depth, DirectionalLight, Disc, Finish,
    Glass, Indirect, Lamp, Lens, Light, Limits, Look, Material, Object, Pattern, Pinhole, Plane, Rough,
    Roundbox, Samples, Scene, Screen, Script, Shine, Shutter, Sphere, Tone, Torus, Triangle, Weight, parse,
};

fn script(text: &str) -> Script {
    let parsed = parse("a.txt", text.as_bytes(), &Limits::default());
    let shown: Vec<_> = parsed.diagnostics.iter().map(|d| d.render(false)).collect();
    parsed.script.unwrap_or_else(|| panic!("{text}\n{}", shown.join("\n")))
}

/// Any finite number, with a preference for typical ones.
fn number() -> impl Strategy<Value = f64> {
    use prop::num::f64::{NEGATIVE, NORMAL, POSITIVE, SUBNORMAL, ZERO};
    prop_oneof![
        POSITIVE | NEGATIVE | NORMAL | SUBNORMAL | ZERO,
        (-100..=100i32).prop_map(f64::from),
        (-1000..=1000i32).prop_map(|x| f64::from(x) / 100.0),
    ]
}

fn vector() -> impl Strategy<Value = DVec3> {
    [number(), number(), number()].prop_map(DVec3::from)
}

/// A number greater than 0.
fn size() -> impl Strategy<Value = f64> {
    number().prop_map(f64::abs).prop_filter("greater than 0", |x| *x > 0.0)
}

fn matte() -> impl Strategy<Value = Coefficients> {
    (vector(), vector(), prop_oneof![Just(DVec3::ZERO), vector()])
        .prop_map(|(a, r, s)| Coefficients::new(a, r, s).unwrap())
}

fn weight() -> impl Strategy<Value = Weight> {
    prop_oneof![
        size().prop_map(Weight::Checker),
        size().prop_map(Weight::Stripes),
        size().prop_map(Weight::Noise),
        (number(), number())
            .prop_filter("ends that differ", |(a, b)| a != b)
            .prop_map(|(a, b)| Weight::Gradient(a, b)),
    ]
}

fn material() -> BoxedStrategy<Material> {
    let shine = (vector(), 1.0..1e3).prop_map(|(color, n)| Shine::new(color, n).unwrap());
    let glass = (vector(), size()).prop_map(|(color, ior)| Glass::new(color, ior).unwrap());
    let pattern = (weight(), matte()).prop_map(|(weight, other)| Pattern { weight, other });
    let glow = prop_oneof![Just(DVec3::ZERO), vector()];
    let rough = prop_oneof![Just(None), (1e-9..=1.0).prop_map(|alpha| Some(Rough::new(alpha).unwrap()))];
    let finish = (prop::option::of(shine), prop::option::of(glass), prop::option::of(pattern), glow, rough)
        .prop_map(|(shine, glass, pattern, glow, rough)| Finish {
            shine,
            glass,
            pattern,
            image: None,
            own: false,
            glow,
            rough,
        });
    prop_oneof![
        2 => matte().prop_map(Material::from),
        1 => (matte(), finish).prop_map(|(matte, finish)| Material::finished(matte, finish)),
    ]
    .boxed()
}

fn object() -> BoxedStrategy<Object> {
    let ends = || [vector(), vector()];
    prop_oneof![
        (size(), vector(), material()).prop_map(|(r, c, m)| Sphere::new(r, c, m).unwrap().into()),
        ([vector(), vector(), vector()], material())
            .prop_map(|(v, m)| Object::Triangle(Triangle::new(v, m).unwrap())),
        (ends(), material()).prop_map(|(c, m)| Object::Cuboid(Cuboid::new(c, m).unwrap())),
        (vector(), vector(), material())
            .prop_filter_map("a normal", |(p, n, m)| Plane::new(p, n, m).ok().map(Object::from)),
        (size(), vector(), vector(), material()).prop_filter_map("a normal", |(r, c, n, m)| Disc::new(
            r, c, n, m
        )
        .ok()
        .map(Object::from)),
        (size(), ends(), material())
            .prop_filter_map("an axis", |(r, e, m)| Cylinder::new(r, e, m).ok().map(Object::from)),
        ([size(), size()], ends(), material())
            .prop_filter_map("an axis", |(r, e, m)| Cone::new(r, e, m).ok().map(Object::from)),
        (size(), size(), vector(), vector(), material()).prop_filter_map("a ring", |(a, b, c, n, m)| {
            Torus::new(a.max(b), a.min(b), c, n, m).ok().map(Object::from)
        }),
        (size(), ends(), material()).prop_map(|(r, e, m)| Capsule::new(r, e, m).unwrap().into()),
        (0.0..=0.5, ends(), material()).prop_map(|(share, e, m)| {
            let radius = share * (e[1] - e[0]).abs().min_element().min(1e300);
            Roundbox::new(e, radius, m).unwrap().into()
        }),
    ]
    .boxed()
}

fn light() -> BoxedStrategy<Light> {
    let amount = || prop_oneof![Just(0.0), size()];
    prop_oneof![
        (vector(), vector(), prop_oneof![Just(0.0), 0.0..180.0]).prop_filter_map(
            "a direction",
            |(color, direction, angle)| {
                let light = DirectionalLight::new(color, direction).ok()?;
                light.spanning(angle).ok().map(Light::Directional)
            }
        ),
        (vector(), vector(), amount(), amount()).prop_map(|(color, at, radius, reach)| Lamp::new(
            color, at, radius, reach
        )
        .unwrap()
        .into()),
    ]
    .boxed()
}

fn camera() -> BoxedStrategy<Camera> {
    let corner = || [number(), number()].prop_map(DVec2::from);
    let pinhole = (vector(), vector(), vector(), size(), corner(), corner());
    let look = (vector(), vector(), 1e-3..179.9, prop::option::of(vector()));
    prop_oneof![
        Just(Camera::Orthographic),
        pinhole.prop_filter_map("a camera", |(e, g, up, s, a, b)| {
            Pinhole::new(e, g, up, s, a, b).ok().map(Camera::Pinhole)
        }),
        look.prop_filter_map("a camera", |(e, t, fov, up)| Look::new(e, t, fov, up).ok().map(Camera::Look)),
    ]
    .boxed()
}

fn background() -> BoxedStrategy<Background> {
    prop_oneof![
        vector().prop_map(|color| Background::new(color).unwrap()),
        (vector(), vector()).prop_map(|(low, high)| Background::sky(low, high).unwrap()),
        Just(Background::NONE),
    ]
    .boxed()
}

/// A setting of a scene.
#[derive(Clone, Debug)]
enum Setting {
    Samples(Samples),
    Shutter(Shutter),
    Tone(Tone),
    Depth(Depth),
    Indirect(Indirect),
    Lens(Lens),
}

impl Setting {
    fn set(&self, scene: &mut Scene) {
        match *self {
            Self::Samples(samples) => scene.samples = samples,
            Self::Shutter(shutter) => scene.shutter = shutter,
            Self::Tone(tone) => scene.tone = tone,
            Self::Depth(depth) => scene.depth = depth,
            Self::Indirect(indirect) => scene.indirect = indirect,
            Self::Lens(lens) => scene.lens = lens,
        }
    }

    fn line(&self) -> String {
        match self {
            Self::Samples(samples) => format!("samples {} {:e}", samples.most(), samples.error()),
            Self::Shutter(shutter) => format!("Shutter {}", shutter.open()),
            Self::Tone(Tone::Plain) => "Tone PLAIN".into(),
            Self::Tone(Tone::Srgb) => "TONE sRGB".into(),
            Self::Depth(depth) => format!("Depth {}.0", depth.bounces()),
            Self::Indirect(indirect) => format!("indirect {}", indirect.bounces()),
            Self::Lens(lens) => {
                let distance = lens.distance().map_or(String::new(), |d| format!("{d:e}"));
                format!("Lens {:e} {distance}", lens.radius())
            }
        }
    }
}

fn setting() -> BoxedStrategy<Setting> {
    prop_oneof![
        (1u32.., prop_oneof![Just(1.0), Just(0.0), size()])
            .prop_map(|(n, e)| Setting::Samples(Samples::new(n, e).unwrap())),
        (0.0..=1.0).prop_map(|open| Setting::Shutter(Shutter::new(open).unwrap())),
        prop_oneof![Just(Tone::Plain), Just(Tone::Srgb)].prop_map(Setting::Tone),
        (0..=Depth::MOST).prop_map(|n| Setting::Depth(Depth::new(n).unwrap())),
        (0..=Indirect::MOST).prop_map(|n| Setting::Indirect(Indirect::new(n).unwrap())),
        (prop_oneof![Just(0.0), size()], prop::option::of(size()))
            .prop_map(|(radius, distance)| Setting::Lens(Lens::new(radius, distance).unwrap())),
    ]
    .boxed()
}

fn screen() -> impl Strategy<Value = Screen> {
    (1..=8000u32, 1..=8000u32).prop_map(|(width, height)| Screen::new(width, height).unwrap())
}

/// A command and its effect on a scene.
#[derive(Clone, Debug)]
enum Step {
    Screen(Screen),
    Camera(Camera),
    Setting(Setting),
    Background(Background),
    Object(Object),
    Light(Light),
    Clear,
    Trace,
}

fn step() -> BoxedStrategy<Step> {
    prop_oneof![
        1 => screen().prop_map(Step::Screen),
        1 => camera().prop_map(Step::Camera),
        1 => setting().prop_map(Step::Setting),
        1 => background().prop_map(Step::Background),
        3 => object().prop_map(Step::Object),
        2 => light().prop_map(Step::Light),
        2 => Just(Step::Clear),
        3 => Just(Step::Trace),
    ]
    .boxed()
}

/// Writes a scene with one item: the lines that must come before it, and its line.
fn lines(scene: &Scene) -> (String, String) {
    let text = scene.to_string();
    let mut lines: Vec<_> =
        text.lines().filter(|line| !line.starts_with("Screen") && *line != "Trace").collect();
    let last = lines.pop().unwrap_or_default().to_string();
    (lines.join("\n"), last)
}

/// Writes the steps as text, and the scenes that they trace, computed in the simplest way.
fn replay(steps: &[Step]) -> (String, Vec<Scene>) {
    let empty = Scene::new(Screen::new(4, 3).unwrap(), Camera::Orthographic);
    let (mut scene, mut objects, mut lights) = (empty.clone(), Vec::new(), Vec::new());
    let (mut text, mut frames, mut named) = (String::from("Screen 4 3\n"), Vec::new(), 0);
    for step in steps {
        let mut one = empty.clone();
        text += &match step {
            Step::Screen(screen) => {
                scene.screen = *screen;
                format!("screen {}\t{}", screen.width(), screen.height())
            }
            Step::Camera(camera) => {
                scene.camera = *camera;
                one.camera = *camera;
                if *camera == Camera::Orthographic { "ORTHOCAMERA".into() } else { lines(&one).1 }
            }
            Step::Setting(setting) => {
                setting.set(&mut scene);
                setting.line()
            }
            Step::Background(background) => {
                scene.background = *background;
                if background.is_none() {
                    text += "Background NONE\r\n";
                    continue;
                }
                let (low, high) = background.colors();
                let colour = |c: DVec3| format!(" {:e},{:e},{:e}", c.x, c.y, c.z);
                format!("BACKGROUND{}{}", colour(low), high.map_or(String::new(), colour))
            }
            Step::Object(object) => {
                objects.push(object.clone());
                one.objects = vec![object.clone()].into();
                let (materials, line) = lines(&one);
                // Names of materials must be unique.
                named += 1;
                let renamed = |text: String| {
                    text.replace("m1", &format!("a{named}_")).replace("m2", &format!("b{named}"))
                };
                format!("{}\n{}", renamed(materials), renamed(line))
            }
            Step::Light(light) => {
                lights.push(*light);
                one.lights = vec![*light].into();
                lines(&one).1
            }
            Step::Clear => {
                scene.background = Background::default();
                objects.clear();
                lights.clear();
                "Clear # and go on".to_string()
            }
            Step::Trace => {
                scene.objects = objects.clone().into();
                scene.lights = lights.clone().into();
                frames.push(scene.clone());
                "  Trace".to_string()
            }
        };
        text += "\r\n";
    }
    (text, frames)
}

proptest! {
    #[test]
    fn a_scene_reads_back_bit_for_bit(
        screen in screen(),
        camera in camera(),
        background in background(),
        settings in prop::collection::vec(setting(), 0..6),
        objects in prop::collection::vec(object(), 0..4),
        lights in prop::collection::vec(light(), 0..4),
    ) {
        let mut scene = Scene::new(screen, camera);
        scene.background = background;
        settings.iter().for_each(|setting| setting.set(&mut scene));
        scene.objects = objects.into();
        scene.lights = lights.into();
        let frames: Vec<_> = script(&scene.to_string()).frames().collect();
        // The texts of two numbers differ if their bits do, but `==` equates 0 and -0.
        prop_assert_eq!(format!("{frames:?}"), format!("{:?}", [&scene]));
        prop_assert_eq!(frames, [scene]);
    }

    #[test]
    fn a_script_means_what_its_replay_gives_and_reads_back(mut steps in prop::collection::vec(step(), 0..24)) {
        steps.push(Step::Trace);
        let (text, frames) = replay(&steps);
        let script = script(&text);
        prop_assert_eq!(script.frames().collect::<Vec<_>>(), frames.as_slice());
        prop_assert_eq!(script.frame_count(), frames.len());
        for (k, frame) in frames.iter().enumerate() {
            prop_assert_eq!(script.frame(k), Some(frame.clone()));
        }
        prop_assert_eq!(script.frame(frames.len()), None);
        prop_assert_eq!(self::script(&script.to_string()), script);
    }
}

#[test]
fn frames_share_their_objects() {
    let script = script(
        "Screen 4 3\nBox 0 0 0 1 1 1 1 1 1 0 0 0\nTrace\nBackground 1 1 1\nTrace\nSphere 1 0 0 0 1 1 1 0 0 0\nTrace",
    );
    let frames: Vec<_> = script.frames().collect();
    assert!(frames[0].objects.is_same(&frames[1].objects));
    assert!(frames[2].objects.part(0..1).is_same(&frames[0].objects));
}

#[test]
fn a_script_is_written_as_what_changes() {
    let text = "\
Screen 4 3
Ilight 1 1 1 0 0 -1
Sphere 1 0 0 -5 0.1 0.1 0.1 1 1 1 0 0.5 0
Trace
Camera 0 0 5 0 0 -1 0 1 0 1 -1 -1 1 1
Background 0.5 0 1
Trace
Trace
Clear
Screen 8 6
Triangle 0 0 1e-7 1 0 0 0 1 0 1 1 1 0 0 0
Trace
Background 1 1 1
Box 0 0 0 1 1 1 1e300 1 1 0 0 0
Trace
";
    assert_eq!(script(text).to_string(), text);
}
