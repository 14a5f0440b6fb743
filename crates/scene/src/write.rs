//! Scenes and scripts back to text.
//!
//! What is written reads back as the same script, every number bit for bit. It is not the text that was read:
//! comments, spelling, and what no frame sees are gone.
//!
//! ```
//! let text = "Screen 4 3\nSphere 1 0 0 -5 .1 .1 .1 1 1 1\nTrace\nTrace";
//! let script = rayfold_scene::parse("a.txt", text.as_bytes(), &Default::default()).script.unwrap();
//! let again = rayfold_scene::parse("b.txt", script.to_string().as_bytes(), &Default::default()).script;
//! assert_eq!(again, Some(script));
//! ```

use std::fmt::{self, Display, Formatter};

use glam::DVec3;

use crate::model::{Camera, Light, Material, Object, Scene, Screen};
use crate::script::{Frame, Script, View};

/// As a script: each frame as what changed since the one before, and a `Trace`.
impl Display for Script {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let mut last: Option<(&View, &Frame)> = None;
        for (view, frame) in self.parts() {
            let (mut old_view, mut objects, mut lights) = (None, frame.objects.clone(), frame.lights.clone());
            let mut background = DVec3::ZERO;
            if let Some((v, seen)) = last {
                old_view = Some(v);
                if seen.objects.start == objects.start && seen.lights.start == lights.start {
                    background = v.background;
                    objects.start = seen.objects.end;
                    lights.start = seen.lights.end;
                } else {
                    f.write_str("Clear\n")?;
                }
            }
            if old_view.map(|v| v.screen) != Some(view.screen) {
                write_screen(f, view.screen)?;
            }
            if old_view.map_or(Camera::default(), |v| v.camera) != view.camera {
                write_camera(f, &view.camera)?;
            }
            if background != view.background {
                write_command(f, "Background", [view.background])?;
            }
            self.lights()[lights].iter().try_for_each(|light| write_light(f, light))?;
            self.objects()[objects].iter().try_for_each(|object| write_object(f, object))?;
            f.write_str("Trace\n")?;
            last = Some((view, frame));
        }
        Ok(())
    }
}

/// As a script of one frame.
impl Display for Scene {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write_screen(f, self.screen)?;
        write_camera(f, &self.camera)?;
        if self.background() != DVec3::ZERO {
            write_command(f, "Background", [self.background()])?;
        }
        self.lights.iter().try_for_each(|light| write_light(f, light))?;
        self.objects.iter().try_for_each(|object| write_object(f, object))?;
        f.write_str("Trace\n")
    }
}

fn write_screen(f: &mut Formatter<'_>, screen: Screen) -> fmt::Result {
    writeln!(f, "Screen {} {}", screen.width(), screen.height())
}

fn write_camera(f: &mut Formatter<'_>, camera: &Camera) -> fmt::Result {
    match camera {
        Camera::Orthographic => f.write_str("Orthocamera\n"),
        Camera::Pinhole(p) => {
            let (a, b) = (p.lower_left(), p.upper_right());
            f.write_str("Camera")?;
            [p.eye(), p.gaze(), p.up()].iter().try_for_each(|v| write_vector(f, *v))?;
            [p.distance(), a.x, a.y, b.x, b.y].iter().try_for_each(|x| write_number(f, *x))?;
            f.write_str("\n")
        }
    }
}

fn write_light(f: &mut Formatter<'_>, light: &Light) -> fmt::Result {
    match light {
        Light::Directional(l) => write_command(f, "Ilight", [l.color(), l.direction()]),
    }
}

fn write_object(f: &mut Formatter<'_>, object: &Object) -> fmt::Result {
    match object {
        Object::Sphere(o) => {
            f.write_str("Sphere")?;
            write_number(f, o.radius())?;
            write_vector(f, o.center())?;
            write_matte(f, o.material())?;
            // A mirror of -0 is written, so that it reads back as that.
            if o.material().mirror().to_array().map(f64::to_bits) != [0; 3] {
                write_vector(f, o.material().mirror())?;
            }
        }
        Object::Triangle(o) => {
            f.write_str("Triangle")?;
            o.vertices().iter().try_for_each(|v| write_vector(f, *v))?;
            write_matte(f, o.material())?;
        }
        Object::Cuboid(o) => {
            f.write_str("Box")?;
            o.corners().iter().try_for_each(|v| write_vector(f, *v))?;
            write_matte(f, o.material())?;
        }
    }
    f.write_str("\n")
}

fn write_matte(f: &mut Formatter<'_>, material: &Material) -> fmt::Result {
    write_vector(f, material.ambient())?;
    write_vector(f, material.diffuse())
}

fn write_command<const N: usize>(f: &mut Formatter<'_>, name: &str, vectors: [DVec3; N]) -> fmt::Result {
    f.write_str(name)?;
    vectors.iter().try_for_each(|v| write_vector(f, *v))?;
    f.write_str("\n")
}

fn write_vector(f: &mut Formatter<'_>, v: DVec3) -> fmt::Result {
    v.to_array().iter().try_for_each(|x| write_number(f, *x))
}

/// A blank and the shortest decimal that reads back as `x`.
fn write_number(f: &mut Formatter<'_>, x: f64) -> fmt::Result {
    if x == 0.0 || (1e-5..1e16).contains(&x.abs()) { write!(f, " {x}") } else { write!(f, " {x:e}") }
}
