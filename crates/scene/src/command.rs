//! The commands of the language, and the correction of misspelt ones.
//!
//! This is the only list of commands, except that the list of shapes is in [`shapes`]. Each command refers to its
//! [`Form`], which is defined beside the type that the command makes.

use std::fmt;
use std::ops::Range;

use crate::form::{Form, Names, Numbers, Scripted, Subject};
use crate::model::{
    Background, Camera, Clause, Depth, DirectionalLight, Faults, Fog, FrameNumbers, Indirect, InvalidValue,
    Lamp, Lens, Light, Look, MATERIAL, MESH, Material, ORTHOCAMERA, Object, Pinhole, Placement, Samples,
    Screen, Shutter, SkyColors, SkyTurn, TEXT, Tone, USE, letter_plate, letter_surface, mesh_surface, shapes,
    with_shapes,
};

/// The effect of a command.
#[derive(Clone, Copy)]
pub(crate) enum Effect {
    Screen,
    Camera(Reader<Camera>),
    /// Sets the colour of rays that hit nothing.
    Background,
    /// Sets a sky of colours.
    Sky,
    /// Sets a sky that is a picture of a file.
    SkyPicture,
    /// Sets the fog.
    Fog,
    Lens,
    /// Sets the number of rays per pixel.
    Samples,
    /// Sets the exposure time of a frame.
    Shutter,
    /// Sets the conversion of colours to levels.
    Tone,
    /// Sets the largest number of bounces.
    Depth,
    /// Sets the largest number of diffuse reflections.
    Indirect,
    /// Sets the frame numbers of a `Trace`.
    Frames,
    /// Defines a named material.
    Material,
    Group,
    End,
    Use,
    Object(Reader<Object>),
    /// Draws a model of a file.
    Mesh,
    /// Draws letters.
    Text,
    Light(Reader<Light>),
    /// Removes objects and lights.
    Clear,
    Trace,
}

/// A function that makes an item from the numbers of a line, or returns all errors in them.
pub(crate) type Reader<T> = fn(&mut Numbers<'_>) -> Result<T, Faults>;

fn read<T: Scripted + Into<U>, U>(numbers: &mut Numbers<'_>) -> Result<U, Faults> {
    T::read(numbers).map(Into::into)
}

/// Defines [`Command`] from its names, so that the list of all commands is complete.
macro_rules! commands {
    (
        before { $($before:tt)* }
        after { $($after:tt)* }
        shapes { $($module:ident::$Shape:ident: $summary:literal;)* }
    ) => {
        commands! {
            $($before)*
            $($Shape: shapes::$Shape::FORM, Effect::Object(read::<shapes::$Shape, _>), $summary;)*
            $($after)*
        }
    };
    ($($command:ident: $form:expr, $effect:expr, $summary:literal;)*) => {
        /// A command of the scene language.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum Command {
            $(#[doc = $summary] $command,)*
        }

        impl Command {
            /// All commands, in the order of the documentation.
            pub const ALL: &[Self] = &[$(Self::$command,)*];

            /// Returns the syntax of the command.
            pub const fn form(self) -> &'static Form {
                match self {
                    $(Self::$command => &const { $form },)*
                }
            }

            /// Returns a one-line summary of the command.
            pub const fn summary(self) -> &'static str {
                match self {
                    $(Self::$command => $summary,)*
                }
            }

            /// Returns the effect of the command.
            pub(crate) const fn effect(self) -> Effect {
                match self {
                    $(Self::$command => $effect,)*
                }
            }
        }
    };
}

const fn group(name: &'static str) -> Form {
    Form::new(name, &[]).with_subject(Subject::Defines(Names::Groups))
}

with_shapes! { commands! {
    before {
        Screen: Screen::FORM, Effect::Screen, "The size of the image.";
        Orthocamera: ORTHOCAMERA, Effect::Camera(|_| Ok(Camera::Orthographic)), "A parallel projection.";
        Camera: Pinhole::FORM, Effect::Camera(read::<Pinhole, _>), "A pinhole camera.";
        Look: Look::FORM, Effect::Camera(read::<Look, _>), "A camera that looks at a target.";
        Lens: Lens::FORM, Effect::Lens, "A lens that is in focus at one distance.";
        Background: Background::FORM, Effect::Background, "The colour of rays that hit nothing.";
        Sky: SkyColors::FORM, Effect::Sky, "The light around the scene.";
        SkyPicture: SkyTurn::FORM, Effect::SkyPicture, "A picture as the light around the scene.";
        Fog: Fog::FORM, Effect::Fog, "The colour that rays take on over their length.";
        Samples: Samples::FORM, Effect::Samples, "The number of rays per pixel.";
        Shutter: Shutter::FORM, Effect::Shutter, "The share of a frame's time that the shutter is open.";
        Tone: Tone::FORM, Effect::Tone, "The conversion of colours to levels.";
        Depth: Depth::FORM, Effect::Depth, "The largest number of reflections and refractions of a ray.";
        Indirect: Indirect::FORM, Effect::Indirect, "The largest number of diffuse reflections of a ray.";
    }
    after {
        Mesh: MESH, Effect::Mesh, "The triangles of a model in a file.";
        Text: TEXT, Effect::Text, "Letters cut out of a plate.";
        Material: MATERIAL, Effect::Material, "A surface material with a name.";
        Group: group("Group"), Effect::Group, "Names the objects up to its `End`.";
        End: Form::new("End", &[]), Effect::End, "Ends a group.";
        Use: USE, Effect::Use, "Draws a group.";
        Ilight: DirectionalLight::FORM, Effect::Light(read::<DirectionalLight, _>), "A directional light.";
        Plight: Lamp::FORM, Effect::Light(read::<Lamp, _>), "A light with a position.";
        Frames: FrameNumbers::FORM, Effect::Frames, "The frame numbers of a `Trace`.";
        Clear: Form::new("Clear", &[]), Effect::Clear, "Removes objects and lights.";
        Trace: Form::new("Trace", &[]), Effect::Trace, "Renders a frame.";
    }
} }

impl fmt::Display for Command {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The largest count of numbers that a command takes.
pub(crate) const MAX_NUMBERS: usize = {
    let (mut most, mut i) = (0, 0);
    while i < Command::ALL.len() {
        let (_, count) = Command::ALL[i].form().arity();
        most = if count > most { count } else { most };
        i += 1;
    }
    most
};

/// An index of the commands by the first letter of their names. Each letter has a chain: `first` is the index in
/// [`Command::ALL`] of its first command, and `next` that of the one after each. `NONE` ends a chain.
struct Index {
    first: [u8; 26],
    next: [u8; Command::ALL.len()],
}

const NONE: u8 = u8::MAX;

/// With this index, the command of a line is found with one or two comparisons.
const INDEX: Index = {
    let mut index = Index { first: [NONE; 26], next: [NONE; Command::ALL.len()] };
    let mut i = Command::ALL.len();
    while i > 0 {
        i -= 1;
        let letter = (Command::ALL[i].name().as_bytes()[0].to_ascii_lowercase() - b'a') as usize;
        index.next[i] = index.first[letter];
        index.first[letter] = i as u8;
    }
    index
};

impl Command {
    /// Returns the name of the command.
    pub const fn name(self) -> &'static str {
        self.form().name
    }

    /// Returns the command with this name, in any letter case. For `Sky`, which is the name of two commands, it returns
    /// the one with colours.
    pub fn from_name(name: &str) -> Option<Self> {
        let letter = name.bytes().next()?.to_ascii_lowercase().wrapping_sub(b'a');
        let first = *INDEX.first.get(usize::from(letter))?;
        let chain = || {
            std::iter::successors(Some(first), |place| INDEX.next.get(usize::from(*place)).copied())
                .map_while(|place| Self::ALL.get(usize::from(place)).copied())
        };
        // Most scripts use the documentation's letter case, which is compared faster.
        chain().find(|c| c.name() == name).or_else(|| chain().find(|c| c.name().eq_ignore_ascii_case(name)))
    }

    /// Returns the command whose line has this word after its name. One of the two commands named `Sky` takes the name
    /// of a file.
    pub fn with_first_word(self, word: Option<&str>) -> Self {
        match (self, word) {
            (Self::Sky, Some(word)) if names_file(word) => Self::SkyPicture,
            _ => self,
        }
    }

    /// Returns whether a colour in the form `#rrggbb` may follow these parameters, which are given without the name
    /// before them. A colour counts as three equal words.
    pub fn takes_color(self, words: &[&str]) -> bool {
        let is_behind_color = words.last().is_some_and(|word| word.starts_with('#'));
        if !matches!(self.effect(), Effect::Material) {
            return self.form().takes_color(words.len(), is_behind_color);
        }
        let last = words.iter().enumerate().rev().find_map(|(at, word)| Some((at, Clause::from_name(word)?)));
        last.is_some_and(|(at, clause)| clause.form().takes_color(words.len() - at - 1, is_behind_color))
    }

    /// Returns the errors in the numbers of a line without curves, each with the range of the numbers that it is about.
    /// `numbers` has as many numbers as the form takes, without those from [`Form::surface`] on if a material is named.
    pub fn check(self, numbers: &[f64]) -> Vec<(InvalidValue, Range<usize>)> {
        let form = self.form();
        let mut values = [0.0; MAX_NUMBERS];
        values[..numbers.len()].copy_from_slice(numbers);
        form.show(&mut values);
        let surface = form.surface().filter(|&first| numbers.len() <= first).map(|_| Material::default());
        let faults = self.faults(&mut Numbers::new(&values, numbers.len(), surface.as_ref()));
        let placed =
            |fault: InvalidValue| (fault, form.place(|name, parameter| fault.is_about(parameter, name)));
        faults.map(|faults| faults.0.into_iter().map(placed).collect()).unwrap_or_default()
    }

    /// Returns the errors in the numbers of a line.
    pub(crate) fn faults(self, numbers: &mut Numbers<'_>) -> Option<Faults> {
        match self.effect() {
            Effect::Screen => Screen::read(numbers).err(),
            Effect::Camera(read) => read(numbers).err(),
            Effect::Background => Background::read(numbers).err(),
            Effect::Sky => SkyColors::read(numbers).err(),
            Effect::SkyPicture => SkyTurn::read(numbers).err(),
            Effect::Fog => Fog::read(numbers).err(),
            Effect::Lens => Lens::read(numbers).err(),
            Effect::Samples => Samples::read(numbers).err(),
            Effect::Shutter => Shutter::read(numbers).err(),
            Effect::Tone => Tone::read(numbers).err(),
            Effect::Depth => Depth::read(numbers).err(),
            Effect::Indirect => Indirect::read(numbers).err(),
            Effect::Frames => FrameNumbers::read(numbers).err(),
            Effect::Object(read) => read(numbers).err(),
            Effect::Light(read) => read(numbers).err(),
            Effect::Use => Placement::read(numbers).err(),
            // Without numbers it has the surface of its file.
            Effect::Mesh if numbers.is_word() => None,
            Effect::Mesh => mesh_surface(numbers).err(),
            Effect::Text => letter_faults(numbers),
            Effect::Material | Effect::Group | Effect::End | Effect::Clear | Effect::Trace => None,
        }
    }

    /// Returns the command that was probably meant: one with a similar name, or one that starts with `name`.
    pub(crate) fn nearest(name: &str) -> Option<Self> {
        // A longer word is no typo, and the distance takes quadratic time.
        if name.len() > 40 {
            return None;
        }
        let name: String =
            name.chars().filter(|c| !c.is_control() && *c != '\u{feff}').collect::<String>().to_lowercase();
        let distance = |c: &Self| strsim::osa_distance(&name, &c.name().to_lowercase());
        let cut_short = |c: &Self| name.chars().count() >= 3 && c.name().to_lowercase().starts_with(&name);
        let near = Self::ALL.iter().copied().min_by_key(distance)?;
        let slips = if near.name().len() < 5 { 1 } else { near.name().len().div_ceil(3) };
        if distance(&near) <= slips.min(name.chars().count().saturating_sub(1)) {
            return Some(near);
        }
        Self::ALL.iter().copied().find(cut_short)
    }
}

/// Returns whether a word is in quotes, or is a name of a picture that lacks them.
fn names_file(word: &str) -> bool {
    let is_picture = |end: &str| {
        ["png", "jpg", "jpeg", "webp", "hdr", "exr"].iter().any(|known| known.eq_ignore_ascii_case(end))
    };
    word.starts_with('"') || word.rsplit_once('.').is_some_and(|(_, end)| is_picture(end))
}

/// Returns the errors in the numbers of a text.
fn letter_faults(numbers: &mut Numbers<'_>) -> Option<Faults> {
    let plate = letter_plate(&mut numbers.clone()).err();
    // Without further numbers it has the colour .8.
    let surface = if numbers.count() > 2 { letter_surface(numbers).err() } else { None };
    match (plate, surface) {
        (Some(plate), Some(surface)) => Some(Faults(plate.0.into_iter().chain(surface.0).collect())),
        (plate, surface) => plate.or(surface),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Parameter;

    #[test]
    fn names_are_not_shared() {
        for command in Command::ALL.iter().filter(|command| **command != Command::SkyPicture) {
            assert_eq!(Command::from_name(&command.name().to_uppercase()), Some(*command));
            assert_eq!(Command::from_name(&command.name().to_lowercase()), Some(*command));
        }
        for none in ["", "S", "Zoom", "Äpfel", "{", "@", "Spheres", "spher", "1"] {
            assert_eq!(Command::from_name(none), None, "{none}");
        }
    }

    #[test]
    fn numbers_are_checked_without_a_line() {
        let ball = [-1.0, 0.0, f64::NAN, 0.0];
        assert_eq!(Command::Sphere.check(&ball), [(InvalidValue::Negative(Parameter::Radius), 0..1)]);
        assert_eq!(
            Command::Sphere.check(&[1.0, 0.0, f64::NAN, 0.0]),
            [(InvalidValue::NotFinite(Parameter::Center), 1..4)]
        );
        assert_eq!(Command::Sphere.check(&[1.0, 0.0, 0.0, 0.0]), []);
        assert_eq!(Command::Frames.check(&[7.0, 3.0]), [(InvalidValue::FramesBackwards, 0..2)]);
        assert_eq!(Command::Frames.check(&[7.0]), []);
        assert_eq!(Command::Trace.check(&[]), []);
    }

    #[test]
    fn nearest_means_near() {
        let check = |name, nearest| {
            assert_eq!(Command::nearest(name).map(Command::name), nearest, "{name}");
        };
        check("Spere", Some("Sphere"));
        check("TRCAE", Some("Trace"));
        check("Light", Some("Ilight"));
        check("llight", Some("Ilight"));
        check("Bx", Some("Box"));
        check("Ortho", Some("Orthocamera"));
        check("Orthographic", None);
        check("trianlge", Some("Triangle"));
        check("Backgruond", Some("Background"));
        check("\u{feff}Clear", Some("Clear"));
        check("Move", None);
        check("Draw", None);
        check("Rotate", None);
        check("12.5", None);
        check("x", None);
        check("ä", None);
    }

    #[test]
    fn colours_stand_where_one_must_or_behind_one_written_so() {
        let check = |command: Command, words: &str, expect: bool| {
            let words: Vec<_> = words.split_whitespace().collect();
            assert_eq!(command.takes_color(&words), expect, "{command} {words:?}");
        };
        check(Command::Background, "", true);
        check(Command::Background, "1 2 3", false);
        check(Command::Background, "#112233 #112233 #112233", true);
        check(Command::Sphere, "1 0 0 0", true);
        check(Command::Sphere, "1 0 0", false);
        check(Command::Sphere, "1 0 0 0 1 2 3 #112233 #112233 #112233", true);
        check(Command::Sphere, "1 0 0 0 1 2 3 1 2 3", false);
        check(Command::Ilight, "", true);
        check(Command::Ilight, "#112233 #112233 #112233", false);
        check(Command::Material, "", false);
        check(Command::Material, "diffuse", true);
        check(Command::Material, "diffuse #112233 #112233 #112233", false);
        check(Command::Material, "diffuse 1 2 3 shine", true);
        check(Command::Material, "checker", false);
    }
}
