//! Writes scenes and scripts as text.
//!
//! The text reads back as the same script, every number bit for bit. It is not the original text: comments, spelling,
//! and items that no frame sees are lost.
//!
//! ```
//! let text = "Screen 4 3\nSphere 1 0 0 -5 .1 .1 .1 1 1 1\nTrace\nTrace";
//! let script = rayfold_scene::parse("a.txt", text.as_bytes(), &Default::default()).script.unwrap();
//! let again = rayfold_scene::parse("b.txt", script.to_string().as_bytes(), &Default::default()).script;
//! assert_eq!(again, Some(script));
//! ```

use std::fmt::{self, Display, Formatter};

use super::{Drawn, Extent, NamedMaterial, Objects, Script, Shot, SkyLine, Template, Value, View};
use crate::command::Command;
use crate::form::{Line, Scripted, quoted_word, write_line};
use crate::model::{
    AXES, Axes, Background, Camera, Fog, FrameNumbers, Image, ImageMap, Lens, MAPS, Scene, Screen,
};
use crate::row::Row;

/// Writes a script: materials and groups, then for each shot the changes since the previous one, and a `Trace`.
impl Display for Script {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        self.materials.iter().try_for_each(|material| self.write_material(f, material))?;
        for group in &self.groups {
            writeln!(f, "{} {}", Command::Group, group.name)?;
            self.write_objects(f, &group.objects, &group.objects.list.whole())?;
            write_name(f, Command::End)?;
        }
        let first = View::new(self.views[0].screen);
        let (mut last, mut seen): (&View, Option<&Shot>) = (&first, None);
        for shot in &self.shots {
            let view = &self.views[shot.view];
            let (mut objects, mut lights) = (shot.objects.clone(), shot.lights.clone());
            let before = Value::Constant(Background::default());
            let (mut background, mut sky) = (&before, &None);
            if let Some(seen) = seen {
                if seen.objects.starts_with(&objects) && seen.lights.starts_with(&lights) {
                    (background, sky) = (&last.background, &last.sky);
                    objects = objects.behind(&seen.objects);
                    lights = lights.behind(&seen.lights);
                } else {
                    write_name(f, Command::Clear)?;
                }
            }
            if seen.is_none() || last.screen != view.screen {
                write_line(f, &view.screen, None)?;
            }
            view.write_changes(f, last)?;
            if seen.map_or(FrameNumbers::default(), |seen| seen.numbers) != shot.numbers {
                write_line(f, &shot.numbers, None)?;
            }
            view.write_surroundings(f, background, sky)?;
            self.write_lights(f, &lights)?;
            self.write_objects(f, &self.objects, &objects)?;
            (0..shot.times).try_for_each(|_| write_name(f, Command::Trace))?;
            (last, seen) = (view, Some(shot));
        }
        Ok(())
    }
}

/// Writes a script of one frame. Materials and groups get names. The rotation of a group is written as angles, which
/// read back as the same rotation except for rounding.
impl Display for Scene {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        Script::from(self).fmt(f)
    }
}

impl Script {
    fn write_material(&self, f: &mut Formatter<'_>, material: &NamedMaterial) -> fmt::Result {
        write!(f, "{} {}", Command::Material, material.name)?;
        for line in &material.clauses {
            write!(f, " {}", line.clause.name())?;
            match &line.image {
                Some(image) => write_image(f, image, &line.row)?,
                None => line.row.write(f)?,
            }
            if let Some(other) = line.other {
                write!(f, " {}", self.materials[other].name)?;
            }
        }
        writeln!(f)
    }

    fn write_lights(&self, f: &mut Formatter<'_>, extent: &Extent) -> fmt::Result {
        let mut next = extent.still.start;
        for (before, template) in &self.lights.others[extent.others.clone()] {
            self.lights.still[next..*before].iter().try_for_each(|light| light.write(f))?;
            next = *before;
            template.write(f, None)?;
        }
        self.lights.still[next..extent.still.end].iter().try_for_each(|light| light.write(f))
    }

    fn write_objects(&self, f: &mut Formatter<'_>, objects: &Objects, extent: &Extent) -> fmt::Result {
        let name = |surface: Option<usize>| surface.map(|material| &*self.materials[material].name);
        let first = objects.surfaces.partition_point(|(from, _)| *from <= extent.still.start);
        let mut runs = objects.surfaces[first.saturating_sub(1)..].iter().peekable();
        let mut surface = None;
        let mut next = extent.still.start;
        let mut write_still = |f: &mut Formatter<'_>, until: usize| {
            for i in next..until {
                while let Some((_, run)) = runs.next_if(|(from, _)| *from <= i) {
                    surface = *run;
                }
                objects.list.still[i].write(f, name(surface))?;
            }
            next = until;
            Ok(())
        };
        for (before, drawn) in &objects.list.others[extent.others.clone()] {
            write_still(f, *before)?;
            match drawn {
                Drawn::Object { template, surface } => template.write(f, name(*surface))?,
                Drawn::Mesh { mesh, surface: None, row } => mesh.write_with(f, |f| row.write(f))?,
                Drawn::Mesh { mesh, surface, .. } => mesh.write(f, name(*surface))?,
                Drawn::Use { group, row } => {
                    write!(f, "{} {}", Command::Use, self.groups[*group].name)?;
                    row.write(f)?;
                    writeln!(f)?;
                }
            }
        }
        write_still(f, extent.still.end)
    }
}

impl View {
    /// Makes the view before any command.
    fn new(screen: Screen) -> Self {
        Self {
            screen,
            camera: Value::default(),
            background: Value::default(),
            sky: None,
            lens: Value::default(),
            fog: Value::default(),
            samples: Default::default(),
            shutter: Default::default(),
            tone: Default::default(),
            depth: Default::default(),
            indirect: Default::default(),
        }
    }

    /// Writes the changes of the surroundings: a colour or a sky, and whether rays from the camera see them.
    fn write_surroundings(
        &self,
        f: &mut Formatter<'_>,
        background: &Value<Background>,
        sky: &Option<SkyLine>,
    ) -> fmt::Result {
        let none = Value::Constant(Background::NONE);
        let (is_hidden, was_hidden) = (self.background == none, *background == none);
        let write_background = |f: &mut Formatter<'_>, background: &Value<Background>| match background {
            Value::Constant(background) => write_line(f, background, None),
            Value::Animated(template) => template.write(f, None),
        };
        let Some(line) = &self.sky else {
            if sky.is_some() && is_hidden {
                write_background(f, &Value::default())?;
            }
            return if sky.is_some() || *background != self.background {
                write_background(f, &self.background)
            } else {
                Ok(())
            };
        };
        let is_shown_again = was_hidden && !is_hidden;
        if is_shown_again {
            write_background(f, &Value::default())?;
        }
        if is_shown_again || self.sky != *sky {
            line.write(f)?;
        }
        if is_hidden && !was_hidden { write_background(f, &none) } else { Ok(()) }
    }

    /// Writes the changes of settings that a `Clear` keeps, except the screen.
    fn write_changes(&self, f: &mut Formatter<'_>, last: &Self) -> fmt::Result {
        if self.camera != last.camera {
            match &self.camera {
                Value::Constant(camera) => Camera::write(camera, f)?,
                Value::Animated(template) => template.write(f, None)?,
            }
        }
        if self.lens != last.lens {
            match &self.lens {
                Value::Constant(lens) => write_line::<Lens>(f, lens, None)?,
                Value::Animated(template) => template.write(f, None)?,
            }
        }
        if self.fog != last.fog {
            match &self.fog {
                Value::Constant(fog) => write_line::<Fog>(f, fog, None)?,
                Value::Animated(template) => template.write(f, None)?,
            }
        }
        if self.samples != last.samples {
            write_line(f, &self.samples, None)?;
        }
        if self.shutter != last.shutter {
            write_line(f, &self.shutter, None)?;
        }
        if self.tone != last.tone {
            write_line(f, &self.tone, None)?;
        }
        if self.depth != last.depth {
            write_line(f, &self.depth, None)?;
        }
        if self.indirect != last.indirect {
            write_line(f, &self.indirect, None)?;
        }
        Ok(())
    }
}

impl SkyLine {
    fn write(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Colors(Value::Constant(colors)) => write_line(f, colors, None),
            Self::Colors(Value::Animated(template)) => template.write(f, None),
            Self::Picture(file, turn) => {
                write!(f, "{} {}", Command::SkyPicture, quoted_word(file.file()))?;
                match turn {
                    Value::Constant(turn) => turn.write(&mut Line::new(f, None))?,
                    Value::Animated(template) => template.row.write(f)?,
                }
                writeln!(f)
            }
        }
    }
}

impl Extent {
    /// Returns whether `other` starts at the same position.
    fn starts_with(&self, other: &Self) -> bool {
        (self.still.start, self.others.start) == (other.still.start, other.others.start)
    }

    /// Returns the part after `seen`, which starts at the same position.
    fn behind(&self, seen: &Self) -> Self {
        Self { still: seen.still.end..self.still.end, others: seen.others.end..self.others.end }
    }
}

impl Template {
    fn write(&self, f: &mut Formatter<'_>, surface: Option<&str>) -> fmt::Result {
        write!(f, "{}", self.command)?;
        self.row.write(f)?;
        if let Some(name) = surface {
            write!(f, " {name}")?;
        }
        writeln!(f)
    }
}

/// Writes the words of a clause `image`. Its width is in the row.
fn write_image(f: &mut Formatter<'_>, image: &Image, width: &Row) -> fmt::Result {
    write!(f, " {} ", quoted_word(image.file().file()))?;
    match image.map() {
        ImageMap::Uv => f.write_str(MAPS[0]),
        ImageMap::Ball => f.write_str(MAPS[2]),
        ImageMap::Flat(_, axes) => {
            f.write_str(MAPS[1])?;
            width.write(f)?;
            let named = AXES.iter().find(|(_, of)| *of == axes && axes != Axes::default());
            named.map_or(Ok(()), |(name, _)| write!(f, " {name}"))
        }
    }
}

/// Writes a line of a command without parameters.
fn write_name(f: &mut Formatter<'_>, command: Command) -> fmt::Result {
    writeln!(f, "{command}")
}
