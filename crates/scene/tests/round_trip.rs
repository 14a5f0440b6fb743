//! What is written reads back as the same, and scripts mean what replaying them by hand gives.
//!
//! A failure prints its seed as a line for a `.proptest-regressions` file.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails, also in the functions that tests share")]

use glam::{DVec2, DVec3};
use proptest::prelude::*;
use rayfold_scene::{
    Camera, Cuboid, DirectionalLight, Light, Limits, Material, Object, Pinhole, Scene, Screen, Script,
    Sphere, Triangle, parse,
};

fn script(text: &str) -> Script {
    let parsed = parse("a.txt", text.as_bytes(), &Limits::default());
    let shown: Vec<_> = parsed.diagnostics.iter().map(|d| d.render(false)).collect();
    parsed.script.unwrap_or_else(|| panic!("{text}\n{}", shown.join("\n")))
}

/// Any finite number, or one that people write.
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

fn material(mirror: impl Strategy<Value = DVec3>) -> impl Strategy<Value = Material> {
    (vector(), vector(), mirror).prop_map(|(a, r, s)| Material::new(a, r, s).unwrap())
}

fn object() -> impl Strategy<Value = Object> {
    let matte = || material(Just(DVec3::ZERO));
    prop_oneof![
        (number(), vector(), material(prop_oneof![Just(DVec3::ZERO), vector()]))
            .prop_filter_map("a radius above 0", |(r, c, m)| Sphere::new(r.abs(), c, m)
                .ok()
                .map(Object::Sphere)),
        ([vector(), vector(), vector()], matte())
            .prop_map(|(v, m)| Object::Triangle(Triangle::new(v, m).unwrap())),
        ([vector(), vector()], matte()).prop_map(|(c, m)| Object::Cuboid(Cuboid::new(c, m).unwrap())),
    ]
}

fn light() -> impl Strategy<Value = Light> {
    (vector(), vector()).prop_filter_map("a direction", |(color, direction)| {
        DirectionalLight::new(color, direction).ok().map(Light::Directional)
    })
}

fn camera() -> impl Strategy<Value = Camera> {
    let corner = || [number(), number()].prop_map(DVec2::from);
    let pinhole = (vector(), vector(), vector(), number(), corner(), corner());
    prop_oneof![
        Just(Camera::Orthographic),
        pinhole.prop_filter_map("a camera", |(e, g, up, s, a, b)| {
            Pinhole::new(e, g, up, s.abs(), a, b).ok().map(Camera::Pinhole)
        }),
    ]
}

fn screen() -> impl Strategy<Value = Screen> {
    (1..=8000u32, 1..=8000u32).prop_map(|(width, height)| Screen::new(width, height).unwrap())
}

/// A command and what it does to a scene.
#[derive(Clone, Debug)]
enum Step {
    Screen(Screen),
    Camera(Camera),
    Background(DVec3),
    Object(Object),
    Light(Light),
    Clear,
    Trace,
}

fn step() -> impl Strategy<Value = Step> {
    prop_oneof![
        1 => screen().prop_map(Step::Screen),
        1 => camera().prop_map(Step::Camera),
        1 => vector().prop_map(Step::Background),
        3 => object().prop_map(Step::Object),
        2 => light().prop_map(Step::Light),
        2 => Just(Step::Clear),
        3 => Just(Step::Trace),
    ]
}

/// The one line of a written scene that starts with `command`.
fn line(scene: &Scene, command: &str) -> String {
    let text = scene.to_string();
    text.lines().find(|line| line.starts_with(command)).unwrap_or_default().to_string()
}

/// The steps as text, and the scenes that they trace, kept in the plainest way.
fn replay(steps: &[Step]) -> (String, Vec<Scene>) {
    let empty = Scene::new(Screen::new(4, 3).unwrap(), Camera::Orthographic);
    let (mut scene, mut objects, mut lights) = (empty.clone(), Vec::new(), Vec::new());
    let (mut text, mut frames) = (String::from("Screen 4 3\n"), Vec::new());
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
                line(&one, if *camera == Camera::Orthographic { "Orthocamera" } else { "Camera" })
            }
            Step::Background(color) => {
                scene.set_background(*color).unwrap();
                format!("BACKGROUND {:e},{:e},{:e}", color.x, color.y, color.z)
            }
            Step::Object(object) => {
                objects.push(object.clone());
                one.objects = vec![object.clone()].into();
                let text = one.to_string();
                text.lines().nth(2).unwrap_or_default().to_string()
            }
            Step::Light(light) => {
                lights.push(*light);
                one.lights = vec![*light].into();
                line(&one, "Ilight")
            }
            Step::Clear => {
                scene.set_background(DVec3::ZERO).unwrap();
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
        background in vector(),
        objects in prop::collection::vec(object(), 0..4),
        lights in prop::collection::vec(light(), 0..4),
    ) {
        let mut scene = Scene::new(screen, camera);
        scene.set_background(background).unwrap();
        scene.objects = objects.into();
        scene.lights = lights.into();
        let frames: Vec<_> = script(&scene.to_string()).frames().collect();
        // The texts of two numbers differ where their bits do; `==` takes 0 and -0 for the same.
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
