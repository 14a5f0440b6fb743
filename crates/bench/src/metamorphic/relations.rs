//! Scenes that show the same picture as a given scene: one function per relation.

use std::sync::Arc;

use anyhow::{Context, Result};
use fastrand::Rng;
use glam::{DMat3, DVec3};
use rayfold_scene::{
    Camera, DirectionalLight, Instance, Lamp, Light, Limits, Look, Object, Outline, Pinhole, Placement,
    Scene, Script, Triangle, parse,
};

use super::placed::{place, right_turns, turn, written_out};
use crate::hard_cases::{fog_scaled, scaled};

/// A relation between scenes.
pub(super) struct Relation {
    pub(super) name: &'static str,
    /// The description of the relation in the report.
    pub(super) about: &'static str,
    /// Whether pictures are the same bit for bit.
    pub(super) is_exact: bool,
    pub(super) other: Other,
}

/// A scene that must show the same picture; `None` if the relation does not apply.
type Related = Result<Option<Scene>>;

/// The scenes that a relation compares.
pub(super) enum Other {
    /// The scene itself, drawn by the plain tracer.
    Plain,
    /// Another scene.
    Made(fn(&Scene, &mut Rng) -> Related),
    /// Two other scenes, with each other.
    Both(fn(&Scene, &mut Rng) -> Result<Option<[Scene; 2]>>),
}

/// All relations.
pub(super) const RELATIONS: [Relation; 7] = [
    Relation {
        name: "the plain tracer",
        about: "the same scene, drawn by the reference in `f64`, which tests every object for every ray",
        is_exact: false,
        other: Other::Plain,
    },
    Relation {
        name: "scaled",
        about: "all lengths multiplied by a power of two from 2^-60 to 2^60",
        is_exact: true,
        other: Other::Made(scaled_by_two),
    },
    Relation {
        name: "turned",
        about: "the objects as a group, the camera and the lights, all turned by right angles",
        is_exact: false,
        other: Other::Made(turned),
    },
    Relation {
        name: "permuted",
        about: "the objects in another order; if two surfaces coincide, another one may be visible",
        is_exact: false,
        other: Other::Made(permuted),
    },
    Relation {
        name: "taken apart",
        about: "each opaque triangle divided in two at the middle of its longest edge",
        is_exact: false,
        other: Other::Made(taken_apart),
    },
    Relation {
        name: "split",
        about: "the scene as the second of three frames of a script with curves, and then as `rayfold split` writes \
                that frame",
        is_exact: true,
        other: Other::Made(split),
    },
    Relation {
        name: "groups",
        about: "the scene moved, turned by right angles and scaled as a group, against the same numbers written out \
                (patterns are left out, because groups carry them along)",
        is_exact: false,
        other: Other::Both(grouped),
    },
];

fn scaled_by_two(scene: &Scene, rng: &mut Rng) -> Related {
    // Pixels of a parallel projection have the size 1; what is far or tiny leaves the range of numbers, and what it draws is
    // in units of its own.
    let is_ordinary = |x: f64| x == 0.0 || (2f64.powi(-100)..2f64.powi(100)).contains(&x.abs());
    let is_in_range = lengths(scene).into_iter().all(is_ordinary);
    if matches!(scene.camera, Camera::Orthographic) || !is_in_range {
        return Ok(None);
    }
    scaled(scene, 2f64.powi(rng.i32(-60..=60))).map(Some)
}

/// Returns lengths of the scene: the coordinates of boxes around the objects. They are not all of its lengths, but have
/// about their size.
fn lengths(scene: &Scene) -> Vec<f64> {
    let eye = match &scene.camera {
        Camera::Look(look) => look.eye(),
        Camera::Pinhole(pinhole) => pinhole.eye(),
        Camera::Orthographic => DVec3::ZERO,
    };
    let lamps = scene.lights.iter().filter_map(|light| match light {
        Light::Lamp(lamp) => Some(lamp.position()),
        Light::Directional(_) => None,
    });
    let of_objects = scene.objects.iter().flat_map(|object| match object {
        Object::Mesh(o) => o.model().positions().to_vec(),
        Object::Instance(o) => vec![o.placement().translation(), DVec3::splat(o.placement().scale())],
        _ => object.outline().map_or(vec![], |outline| match outline {
            Outline::Ball { center, radius } | Outline::Disc { center, radius, .. } => {
                vec![center, DVec3::splat(radius)]
            }
            Outline::Triangle(corners) => corners.to_vec(),
            Outline::Box { corners: [low, high], radius } => vec![low, high, DVec3::splat(radius)],
            Outline::Plane(point) => vec![point],
            Outline::Rod { radii: [a, b], ends: [from, to], .. } => vec![from, to, DVec3::new(a, b, 0.0)],
            Outline::Ring { thickness, center, .. } => vec![center, DVec3::splat(thickness)],
        }),
    });
    std::iter::once(eye).chain(lamps).chain(of_objects).flat_map(|v| v.to_array()).collect()
}

/// Returns a rotation, which keeps the height if the sky depends on it.
fn right_turn(scene: &Scene, rng: &mut Rng) -> DMat3 {
    let mut turns = right_turns();
    if scene.one_color().is_none() {
        turns.retain(|turn| turn.y_axis == DVec3::Y);
    }
    turns[rng.usize(0..turns.len())]
}

fn turned(scene: &Scene, rng: &mut Rng) -> Related {
    if matches!(scene.camera, Camera::Orthographic) {
        return Ok(None);
    }
    let placement = Placement::new(DVec3::ZERO, right_turn(scene, rng), 1.0)?;
    let mut turned = seen_along(scene, &placement)?;
    turned.objects = in_group(scene, &placement)?.into();
    Ok(Some(turned))
}

/// Returns the scene with all its objects in one group.
fn in_group(scene: &Scene, placement: &Placement) -> Result<Vec<Object>> {
    let own = Arc::new(*placement);
    scene
        .objects
        .iter()
        .map(|object| {
            let (inner, placement) = match object {
                Object::Instance(instance) => {
                    (instance.object().clone(), Arc::new(instance.placement().within(placement)?))
                }
                object => (object.clone(), own.clone()),
            };
            Ok(Instance::new(&vec![inner].into(), 0, &placement).into())
        })
        .collect()
}

/// Returns the scene without its objects, with camera and lights moved.
fn seen_along(scene: &Scene, by: &Placement) -> Result<Scene> {
    let mut moved = scene.clone();
    moved.objects = Vec::new().into();
    moved.camera = match &scene.camera {
        Camera::Look(look) => {
            let (eye, target) = (place(by, look.eye()), place(by, look.target()));
            Camera::Look(Look::new(eye, target, look.field_of_view(), Some(turn(by, look.up())))?)
        }
        Camera::Pinhole(o) => Camera::Pinhole(Pinhole::new(
            place(by, o.eye()),
            turn(by, o.gaze()),
            turn(by, o.up()),
            o.distance(),
            o.lower_left(),
            o.upper_right(),
        )?),
        Camera::Orthographic => Camera::Orthographic,
    };
    let lights = scene.lights.iter().map(|light| {
        Ok(match light {
            Light::Directional(sun) => {
                let sun_there = DirectionalLight::new(sun.color(), turn(by, sun.direction()))?;
                Light::Directional(sun_there.spanning(sun.angle())?)
            }
            Light::Lamp(lamp) => {
                let (radius, reach) = (by.scale() * lamp.radius(), by.scale() * lamp.reach());
                Light::Lamp(Lamp::new(lamp.color(), place(by, lamp.position()), radius, reach)?)
            }
        })
    });
    moved.lights = lights.collect::<Result<Vec<_>>>()?.into();
    moved.fog = fog_scaled(scene, by.scale())?;
    Ok(moved)
}

fn permuted(scene: &Scene, rng: &mut Rng) -> Related {
    if scene.objects.len() < 2 {
        return Ok(None);
    }
    let mut permuted = scene.clone();
    let mut objects = scene.objects.to_vec();
    rng.shuffle(&mut objects);
    permuted.objects = objects.into();
    Ok(Some(permuted))
}

fn taken_apart(scene: &Scene, _: &mut Rng) -> Related {
    let is_opaque = |object: &Object| object.material().finish().is_none_or(|finish| finish.glass.is_none());
    let is_split = |object: &&Object| matches!(object, Object::Triangle(_)) && is_opaque(object);
    if !scene.objects.iter().any(|object| is_split(&object)) {
        return Ok(None);
    }
    let mut apart = scene.clone();
    let mut objects = Vec::new();
    for object in scene.objects.iter() {
        match object {
            Object::Triangle(triangle) if is_opaque(object) => {
                let [u, v, w] = *triangle.vertices();
                let turns = [[u, v, w], [v, w, u], [w, u, v]];
                let longest = turns
                    .into_iter()
                    .max_by(|a, b| a[0].distance_squared(a[1]).total_cmp(&b[0].distance_squared(b[1])));
                let [from, to, top] = longest.context("three edges")?;
                // Also where the sum is no number.
                let middle = 0.5 * from + 0.5 * to;
                for part in [[from, middle, top], [middle, to, top]] {
                    objects.push(Triangle::new(part, object.material().clone())?.into());
                }
            }
            other => objects.push(other.clone()),
        }
    }
    apart.objects = objects.into();
    Ok(Some(apart))
}

/// Returns the scene as a frame among others, and that frame alone.
fn split(scene: &Scene, _: &mut Rng) -> Related {
    // What is turned is written as angles, which round.
    if scene.objects.iter().any(|object| matches!(object, Object::Instance(_))) {
        return Ok(None);
    }
    let script = moving(&scene.to_string())?;
    let alone = read(&script.only(1).context("the second frame")?.to_string())?;
    let frame = alone.frame(0).context("a frame")?;
    anyhow::ensure!(Some(&frame) == script.frame(1).as_ref(), "another frame alone than among others");
    Ok(Some(frame))
}

/// Returns the script with three frames, in which lights, background and balls change. The second frame is the script's
/// own.
fn moving(text: &str) -> Result<Script> {
    let mut moving = String::new();
    for line in text.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some(command @ ("Ilight" | "Plight" | "Background" | "Sphere")) => {
                moving += command;
                for word in words {
                    let changing = word.parse::<f64>().ok().map(|x| [0.5 * x, 1.5 * x]);
                    match changing.filter(|[less, more]| (*less != 0.0 && more.is_finite()) || word == "0") {
                        Some([less, more]) => moving += &format!(" (1:{less:e} 2:{word} 3:{more:e})"),
                        None => moving += &format!(" {word}"),
                    }
                }
                moving += "\n";
            }
            Some("Trace") => moving += "Frames 3\nTrace\n",
            _ => {
                moving += line;
                moving += "\n";
            }
        }
    }
    read(&moving)
}

fn read(text: &str) -> Result<Script> {
    let parsed = parse("metamorphic.txt", text.as_bytes(), &Limits::default());
    let faults = || parsed.diagnostics.iter().take(3).map(|d| d.render(false)).collect::<String>();
    parsed.script.with_context(faults)
}

fn grouped(scene: &Scene, rng: &mut Rng) -> Result<Option<[Scene; 2]>> {
    let has_instances = scene.objects.iter().any(|object| matches!(object, Object::Instance(_)));
    let has_pattern =
        |object: &Object| object.material().finish().is_some_and(|finish| finish.pattern.is_some());
    if matches!(scene.camera, Camera::Orthographic) || has_instances || scene.objects.iter().any(has_pattern)
    {
        return Ok(None);
    }
    let size = lengths(scene).into_iter().fold(0.0, |size: f64, x| size.max(x.abs()));
    let aside = DVec3::new(rng.f64() - 0.5, rng.f64() - 0.5, rng.f64() - 0.5) * size;
    let scale = if rng.bool() { 2f64.powi(rng.i32(-3..=3)) } else { 0.1 + 3.0 * rng.f64() };
    let placement = Placement::new(aside, right_turn(scene, rng), scale)?;
    let mut written = seen_along(scene, &placement)?;
    let mut grouped = written.clone();
    let objects = scene.objects.iter().map(|object| written_out(object, &placement));
    // What is too small or too large when it is moved is not drawn as a group either, but cannot be written out.
    let Ok(objects) = objects.collect::<Result<Vec<_>>>() else { return Ok(None) };
    written.objects = objects.into();
    grouped.objects = in_group(scene, &placement)?.into();
    Ok(Some([grouped, written]))
}
