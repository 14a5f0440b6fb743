//! Converts a scene to a script of one frame, with names for its materials and groups.

use glam::{DMat3, DVec3};

use super::{ClauseLine, Drawn, GroupRecorder, NamedMaterial, Recorder, Script, SkyLine, Value};
use crate::model::{
    Clause, Coefficients, FrameNumbers, ImageMap, Instance, Material, Object, Pattern, Placement, Scene, Sky,
    Weight,
};
use crate::row::{Number, Row};

/// The names given so far.
#[derive(Default)]
struct Namer {
    recorder: Recorder,
    materials: usize,
    groups: usize,
    /// The last material that got a name, and its number, because neighbours often have the same one.
    last_material: Option<(Material, usize)>,
    /// The last object of a group, and the number of the group that was made for it.
    last_group: Option<(Object, usize)>,
}

impl From<&Scene> for Script {
    fn from(scene: &Scene) -> Self {
        let mut namer = Namer::default();
        for object in scene.objects.iter() {
            namer.add(object);
        }
        let mut recorder = namer.recorder;
        recorder.set_camera(Value::Constant(scene.camera));
        recorder.set_background(Value::Constant(scene.background));
        match scene.sky.clone() {
            Some(Sky::Colors(colors)) => recorder.set_sky(SkyLine::Colors(Value::Constant(colors))),
            Some(Sky::Picture(file, turn)) => {
                recorder.set_sky(SkyLine::Picture(file, Value::Constant(turn)));
            }
            None => {}
        }
        recorder.set_lens(Value::Constant(scene.lens));
        recorder.set_fog(Value::Constant(scene.fog));
        (recorder.samples, recorder.shutter) = (scene.samples, scene.shutter);
        (recorder.tone, recorder.depth) = (scene.tone, scene.depth);
        recorder.indirect = scene.indirect;
        recorder.numbers = FrameNumbers::default();
        scene.lights.iter().for_each(|light| recorder.add_light(Value::Constant(*light)));
        recorder.trace(scene.screen, scene.objects.len());
        recorder.finish().unwrap_or_else(|| unreachable!("a frame was recorded"))
    }
}

impl Namer {
    fn add(&mut self, object: &Object) {
        match object {
            Object::Instance(instance) => self.add_instance(instance),
            _ => {
                let surface = self.surface_of(object);
                self.recorder.add_object(object.clone(), surface);
            }
        }
    }

    fn add_instance(&mut self, instance: &Instance) {
        let object = instance.object();
        let group = match &self.last_group {
            Some((last, group)) if last == object => *group,
            _ => {
                let surface = self.surface_of(object);
                let mut group = GroupRecorder::default();
                group.add_object(object.clone(), surface);
                self.groups += 1;
                self.recorder.add_group(group.finish(&format!("g{}", self.groups), 1));
                self.last_group = Some((object.clone(), self.groups - 1));
                self.groups - 1
            }
        };
        self.recorder.add_drawn(Drawn::Use { group, row: row_of(instance.placement()) });
    }

    /// Returns the number of the name of an object's material, or `None` if it needs none.
    fn surface_of(&mut self, object: &Object) -> Option<usize> {
        match object {
            Object::Mesh(mesh) if !mesh.has_material() => None,
            _ => self.surface(object.material()),
        }
    }

    /// Returns the number of a material's name, or `None` if it needs none.
    fn surface(&mut self, material: &Material) -> Option<usize> {
        material.finish()?;
        if let Some((last, number)) = &self.last_material
            && last == material
        {
            return Some(*number);
        }
        let finish = material.finish()?.clone();
        let mut clauses = coefficients(material.coefficients());
        if let Some(shine) = finish.shine {
            clauses.push(line(Clause::Shine, &[&shine.color().to_array(), &[shine.exponent()]], None));
        }
        if let Some(glass) = finish.glass {
            clauses.push(line(Clause::Glass, &[&glass.color().to_array(), &[glass.ior()]], None));
        }
        if let Some(Pattern { weight, other }) = finish.pattern {
            let other = self.name(coefficients(other), other.into());
            let (clause, numbers) = match weight {
                Weight::Checker(size) => (Clause::Checker, vec![size]),
                Weight::Stripes(size) => (Clause::Stripes, vec![size]),
                Weight::Noise(size) => (Clause::Noise, vec![size]),
                Weight::Gradient(start, end) => (Clause::Gradient, vec![start, end]),
            };
            clauses.push(line(clause, &[&numbers], Some(other)));
        }
        if let Some(image) = finish.image {
            let width = match image.map() {
                ImageMap::Flat(width, _) => vec![width],
                ImageMap::Uv | ImageMap::Ball => vec![],
            };
            clauses.push(ClauseLine { image: Some(image), ..line(Clause::Image, &[&width], None) });
        }
        if finish.own {
            clauses.push(line(Clause::Own, &[], None));
        }
        // A glow of -0 is written, too: the script then reads back bit for bit.
        if finish.glow.to_array().iter().any(|x| x.to_bits() != 0) {
            clauses.push(line(Clause::Glow, &[&finish.glow.to_array()], None));
        }
        if let Some(rough) = finish.rough {
            clauses.push(line(Clause::Rough, &[&[rough.given()]], None));
        }
        let number = self.name(clauses, material.clone());
        self.last_material = Some((material.clone(), number));
        Some(number)
    }

    fn name(&mut self, clauses: Vec<ClauseLine>, material: Material) -> usize {
        self.materials += 1;
        let name = format!("m{}", self.materials).into();
        self.recorder.add_material(NamedMaterial { name, clauses, still: Some(material) });
        self.materials - 1
    }
}

fn coefficients(own: Coefficients) -> Vec<ClauseLine> {
    [(Clause::Ambient, own.ambient()), (Clause::Diffuse, own.diffuse()), (Clause::Mirror, own.mirror())]
        .map(|(clause, color)| line(clause, &[&color.to_array()], None))
        .to_vec()
}

fn line(clause: Clause, numbers: &[&[f64]], other: Option<usize>) -> ClauseLine {
    ClauseLine { clause, row: row(numbers), other, image: None }
}

fn row(numbers: &[&[f64]]) -> Row {
    Row::new(numbers.concat().into_iter().map(Number::Constant).collect())
}

fn row_of(placement: &Placement) -> Row {
    let degrees = angles(placement.rotation());
    row(&[&placement.translation().to_array(), &degrees.to_array(), &[placement.scale()]])
}

/// Returns the angles of Rz·Ry·Rx in degrees.
fn angles(rotation: DMat3) -> DVec3 {
    let [x, y, z] = [rotation.x_axis, rotation.y_axis, rotation.z_axis];
    let about_y = libm::atan2(-x.z, libm::hypot(x.x, x.y));
    // Seen from above or below, rotations about x and z are the same: x gets the whole angle.
    let (about_x, about_z) = if libm::hypot(x.x, x.y) > 1e-12 {
        (libm::atan2(y.z, z.z), libm::atan2(x.y, x.x))
    } else {
        (libm::atan2(-z.y, y.y), 0.0)
    };
    DVec3::new(about_x, about_y, about_z).map(f64::to_degrees)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::model::shapes::Sphere;
    use crate::model::{Camera, Screen};
    use crate::shared_slice::SharedSlice;

    #[test]
    fn a_scene_with_groups_is_written_as_it_is_but_for_rounding() {
        for degrees in ["10 20 30", "-170 80 5", "90 90 0", "12 -90 0", "0 0 180"] {
            let text = format!(
                "Screen 4 3\nMaterial glassy glass .9 .9 1 1.5 shine 1 1 1 40\nGroup a\nSphere 1 2 3 4 glassy\nEnd\nUse \
                 a 1 2 3 {degrees} 2\nTrace"
            );
            let read = |text: &str| {
                let parsed = crate::parse("a.txt", text.as_bytes(), &Default::default());
                parsed.script.unwrap_or_else(|| panic!("{text}: {:?}", parsed.diagnostics)).frame(0).unwrap()
            };
            let scene = read(&text);
            let again = read(&scene.to_string());
            assert_eq!((scene.objects.len(), again.objects.len()), (1, 1));
            let [Object::Instance(a), Object::Instance(b)] = [&scene.objects[0], &again.objects[0]] else {
                panic!("{text}")
            };
            assert_eq!(a.object(), b.object());
            let place = |i: &Instance| i.placement().point(DVec3::new(1.0, 2.0, 3.0));
            assert!(place(a).distance(place(b)) < 1e-13, "{degrees}: {} {}", place(a), place(b));
        }
    }

    #[test]
    fn instances_of_one_object_share_a_group() {
        let objects: SharedSlice<Object> =
            vec![Sphere::new(1.0, DVec3::ZERO, Material::default()).unwrap().into()].into();
        let at = |x| {
            let placement = Placement::new(DVec3::X * x, DMat3::IDENTITY, 1.0).unwrap();
            Object::from(Instance::new(&objects, 0, &Arc::new(placement)))
        };
        let mut scene = Scene::new(Screen::new(4, 3).unwrap(), Camera::Orthographic);
        scene.objects = vec![at(1.0), at(2.0)].into();
        let text = scene.to_string();
        assert_eq!(text.matches("Group").count(), 1, "{text}");
    }
}
