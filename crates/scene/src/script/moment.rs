//! The scene of a script at a moment: evaluates lines with curves and draws groups.
//!
//! Each material and group is evaluated once per moment, however often it is used. Groups are drawn without
//! recursion, so that deeply nested groups do not exhaust the stack.

use std::sync::Arc;

use super::origins::{Counter, Origins};
use super::{Drawn, Extent, Group, NamedMaterial, Script, Shot, SkyLine, Template, Value};
use crate::command::{Effect, Reader};
use crate::form::{Numbers, Scripted};
use crate::model::{
    Clauses, Coefficients, Faults, Instance, Light, Material, Mesh, Object, Placement, Scene, Sky, Tone,
    mesh_surface,
};
use crate::row::Row;
use crate::shared_slice::SharedSlice;

/// A script at a time and in a tone, with the results evaluated so far.
struct Moment<'a> {
    script: &'a Script,
    frame: f64,
    tone: Tone,
    /// The evaluated materials that have curves.
    materials: Vec<Option<Material>>,
    /// The objects of each group, without those of the groups that it uses.
    groups: Vec<Option<SharedSlice<Object>>>,
}

/// The state of drawing a group.
struct Level {
    group: usize,
    placement: Arc<Placement>,
    /// The next constant object, the next other line, and the next of all objects.
    still: usize,
    other: usize,
    object: usize,
    counter: Counter,
}

impl Script {
    pub(super) fn scene(&self, shot: &Shot, frame: f64) -> Result<Scene, Faults> {
        let view = &self.views[shot.view];
        let camera = view.camera.at(frame, view.tone, |effect| match effect {
            Effect::Camera(read) => Some(read),
            _ => None,
        })?;
        let mut scene = Scene::new(view.screen, camera);
        scene.background = view.background.at(frame, view.tone, |_| Some(Scripted::read))?;
        scene.sky = match &view.sky {
            Some(SkyLine::Colors(colors)) => {
                Some(Sky::Colors(colors.at(frame, view.tone, |_| Some(Scripted::read))?))
            }
            Some(SkyLine::Picture(file, turn)) => {
                let turn = turn.at(frame, view.tone, |_| Some(Scripted::read))?;
                Some(Sky::Picture(file.clone(), turn))
            }
            None => None,
        };
        scene.lens = view.lens.at(frame, view.tone, |_| Some(Scripted::read))?;
        scene.fog = view.fog.at(frame, view.tone, |_| Some(Scripted::read))?;
        (scene.samples, scene.shutter) = (view.samples, view.shutter);
        (scene.tone, scene.depth, scene.indirect) = (view.tone, view.depth, view.indirect);
        scene.objects = self.objects_at(&shot.objects, frame, view.tone, None)?;
        scene.hides_rough = self.is_rough(&shot.objects) && !scene.shows_rough();
        scene.lights = self.lights_at(&shot.lights, frame, view.tone)?;
        Ok(scene)
    }

    fn lights_at(&self, extent: &Extent, frame: f64, tone: Tone) -> Result<SharedSlice<Light>, Faults> {
        let Extent { still, others } = extent.clone();
        if others.is_empty() {
            return Ok(self.lights.still.part(still));
        }
        let mut lights = Vec::with_capacity(still.len() + others.len());
        let mut next = still.start;
        for (before, template) in &self.lights.others[others] {
            lights.extend_from_slice(&self.lights.still[next..*before]);
            next = *before;
            lights.push(template.light(frame, tone)?);
        }
        lights.extend_from_slice(&self.lights.still[next..still.end]);
        Ok(lights.into())
    }

    /// Returns the objects of a frame, and adds their origins to `origins`.
    pub(super) fn objects_at(
        &self,
        extent: &Extent,
        frame: f64,
        tone: Tone,
        mut origins: Option<&mut Origins>,
    ) -> Result<SharedSlice<Object>, Faults> {
        let list = &self.objects.list;
        let Extent { still, others } = extent.clone();
        let mut counter = Counter::start();
        if others.is_empty() {
            if let Some(origins) = origins {
                counter.add_still(&self.objects, still.clone(), origins);
            }
            return Ok(list.still.part(still));
        }
        let mut moment = Moment {
            script: self,
            frame,
            tone,
            materials: vec![None; self.materials.len()],
            groups: vec![None; self.groups.len()],
        };
        let mut objects = Vec::new();
        let mut next = still.start;
        for (i, (before, drawn)) in others.clone().zip(&list.others[others]) {
            objects.extend_from_slice(&list.still[next..*before]);
            if let Some(origins) = origins.as_deref_mut() {
                counter.add_still(&self.objects, next..*before, origins);
            }
            next = *before;
            let count = objects.len();
            match drawn {
                Drawn::Object { template, surface } => objects.extend(moment.object(template, *surface)?),
                Drawn::Use { group, row } => {
                    let within = origins.as_deref_mut().map(|origins| {
                        let inner = counter.enter(&self.objects, i, *group, origins);
                        (inner, origins)
                    });
                    moment.draw(*group, row, &mut objects, within)?;
                    continue;
                }
                Drawn::Mesh { mesh, surface, row } => objects.push(moment.mesh(mesh, *surface, row)?),
            }
            if let Some(origins) = origins.as_deref_mut() {
                counter.add_other(&self.objects, i, objects.len() > count, origins);
            }
        }
        objects.extend_from_slice(&list.still[next..still.end]);
        if let Some(origins) = origins {
            counter.add_still(&self.objects, next..still.end, origins);
        }
        Ok(objects.into())
    }
}

impl Moment<'_> {
    /// Returns an object, unless it is hidden.
    fn object(&mut self, template: &Template, surface: Option<usize>) -> Result<Option<Object>, Faults> {
        let surface = surface.map(|material| self.material(material)).transpose()?;
        template.object(self.frame, self.tone, surface.as_ref())
    }

    fn mesh(&mut self, mesh: &Mesh, surface: Option<usize>, row: &Row) -> Result<Object, Faults> {
        let material = match surface {
            Some(material) => self.material(material)?,
            None => {
                let values = row.at(self.frame, self.tone);
                mesh_surface(&mut Numbers::new(&values, row.len(), None))?
            }
        };
        Ok(mesh.with_material(material).into())
    }

    fn material(&mut self, i: usize) -> Result<Material, Faults> {
        if let Some(material) = self.script.materials[i].still.as_ref().or(self.materials[i].as_ref()) {
            return Ok(material.clone());
        }
        let named = &self.script.materials[i];
        // The material that a pattern names has no pattern, so the recursion ends here.
        let material = named.at(self.frame, self.tone, |other| self.material(other))?;
        self.materials[i] = Some(material.clone());
        Ok(material)
    }

    /// Returns the objects of a group, without those of the groups that it uses.
    fn objects_of(&mut self, i: usize) -> Result<SharedSlice<Object>, Faults> {
        if let Some(objects) = &self.groups[i] {
            return Ok(objects.clone());
        }
        let script = self.script;
        let list = &script.groups[i].objects.list;
        let moves = |(_, drawn): &(usize, Drawn)| !matches!(drawn, Drawn::Use { .. });
        let objects = if list.others.iter().any(moves) {
            let mut objects = Vec::with_capacity(list.still.len() + list.others.len());
            let mut next = 0;
            for (before, drawn) in &list.others {
                objects.extend_from_slice(&list.still[next..*before]);
                next = *before;
                match drawn {
                    Drawn::Object { template, surface } => objects.extend(self.object(template, *surface)?),
                    Drawn::Mesh { mesh, surface, row } => {
                        objects.push(self.mesh(mesh, *surface, row)?);
                    }
                    Drawn::Use { .. } => {}
                }
            }
            objects.extend_from_slice(&list.still[next..]);
            objects.into()
        } else {
            list.still.clone()
        };
        self.groups[i] = Some(objects);
        Ok(self.groups[i].clone().unwrap_or_default())
    }

    /// Adds the objects of a group as placed by `row`, in the order of the text, and their origins.
    fn draw(
        &mut self,
        group: usize,
        row: &Row,
        into: &mut Vec<Object>,
        origins: Option<(Counter, &mut Origins)>,
    ) -> Result<(), Faults> {
        let Some(placement) = self.placement(group, row, None)? else { return Ok(()) };
        let (counter, mut origins) = match origins {
            Some((counter, origins)) => (counter, Some(origins)),
            None => (Counter::default(), None),
        };
        let mut stack = vec![Level { group, placement, still: 0, other: 0, object: 0, counter }];
        while let Some(level) = stack.last_mut() {
            let Group { objects, .. } = &self.script.groups[level.group];
            let other = objects.list.others.get(level.other);
            let still = other.map_or(objects.list.still.len(), |(before, _)| *before);
            let (first, nth) = (level.still, level.other);
            let mut count = still - first;
            (level.still, level.other) = (still, nth + 1);
            let is_seen = match other {
                Some((_, Drawn::Object { template, .. })) => !template.is_hidden(self.frame, self.tone),
                Some((_, Drawn::Mesh { .. })) => true,
                Some((_, Drawn::Use { .. })) | None => false,
            };
            if is_seen {
                count += 1;
            }
            if count > 0 {
                let own = self.objects_of(level.group)?;
                let range = level.object..level.object + count;
                level.object = range.end;
                into.extend(range.map(|i| Object::from(Instance::new(&own, i, &level.placement))));
            }
            if let Some(origins) = origins.as_deref_mut() {
                level.counter.add_still(objects, first..still, origins);
                if matches!(other, Some((_, Drawn::Object { .. } | Drawn::Mesh { .. }))) {
                    level.counter.add_other(objects, nth, is_seen, origins);
                }
            }
            match other {
                Some((_, Drawn::Object { .. } | Drawn::Mesh { .. })) => {}
                Some((_, Drawn::Use { group, row })) => {
                    let outer = Arc::clone(&level.placement);
                    let counter = match origins.as_deref_mut() {
                        Some(origins) => level.counter.enter(objects, nth, *group, origins),
                        None => Counter::default(),
                    };
                    if let Some(placement) = self.placement(*group, row, Some(&outer))? {
                        let group = *group;
                        stack.push(Level { group, placement, still: 0, other: 0, object: 0, counter });
                    }
                }
                None => {
                    stack.pop();
                }
            }
        }
        Ok(())
    }

    /// Returns the placement of a group within another, or `None` if it is hidden.
    fn placement(
        &self,
        group: usize,
        row: &Row,
        outer: Option<&Placement>,
    ) -> Result<Option<Arc<Placement>>, Faults> {
        if self.script.groups[group].drawn == 0 {
            return Ok(None);
        }
        let values = row.at(self.frame, self.tone);
        let Some(own) = Placement::read(&mut Numbers::new(&values, row.len(), None))? else {
            return Ok(None);
        };
        Ok(match outer {
            // A group whose scale underflows is hidden.
            Some(outer) if own.scale() * outer.scale() == 0.0 => None,
            Some(outer) => Some(Arc::new(own.within(outer)?)),
            None => Some(Arc::new(own)),
        })
    }
}

impl NamedMaterial {
    /// Returns the material at a time. `other` returns another material.
    pub(crate) fn at(
        &self,
        frame: f64,
        tone: Tone,
        mut other: impl FnMut(usize) -> Result<Material, Faults>,
    ) -> Result<Material, Faults> {
        let mut clauses = Clauses::default();
        for line in &self.clauses {
            let coefficients = match line.other {
                Some(material) => other(material)?.coefficients(),
                None => Coefficients::default(),
            };
            let values = line.row.at(frame, tone);
            clauses.add(line.clause, &mut Numbers::new(&values, line.row.len(), None), coefficients)?;
            if let Some(image) = &line.image {
                clauses.add_image(image.with_width(values[..line.row.len()].first().copied())?);
            }
            if line.is_rough() {
                clauses.keep_rough();
            }
        }
        Ok(clauses.material()?)
    }
}

impl Template {
    /// Makes the item from the numbers at a time.
    pub(crate) fn at<T>(
        &self,
        frame: f64,
        tone: Tone,
        surface: Option<&Material>,
        reader: Reader<T>,
    ) -> Result<T, Faults> {
        let values = self.row.at(frame, tone);
        reader(&mut Numbers::new(&values, self.row.len(), surface))
    }

    /// Returns whether it is an object that is hidden because its radii are 0.
    fn is_hidden(&self, frame: f64, tone: Tone) -> bool {
        self.command.form().hides(&self.row.at(frame, tone))
    }

    /// Returns the object, unless it is hidden.
    pub(crate) fn object(
        &self,
        frame: f64,
        tone: Tone,
        surface: Option<&Material>,
    ) -> Result<Option<Object>, Faults> {
        if self.is_hidden(frame, tone) {
            return Ok(None);
        }
        let Effect::Object(read) = self.command.effect() else {
            unreachable!("`{}` is no object", self.command)
        };
        self.at(frame, tone, surface, read).map(Some)
    }

    pub(crate) fn light(&self, frame: f64, tone: Tone) -> Result<Light, Faults> {
        let Effect::Light(read) = self.command.effect() else {
            unreachable!("`{}` is no light", self.command)
        };
        self.at(frame, tone, None, read)
    }
}

impl<T: Clone> Value<T> {
    /// Evaluates the value. `reader` selects the function that reads it from the effect of its command.
    fn at(&self, frame: f64, tone: Tone, reader: impl Fn(Effect) -> Option<Reader<T>>) -> Result<T, Faults> {
        match self {
            Self::Constant(value) => Ok(value.clone()),
            Self::Animated(template) => match reader(template.command.effect()) {
                Some(read) => template.at(frame, tone, None, read),
                None => unreachable!("`{}` is no such thing", template.command),
            },
        }
    }
}
