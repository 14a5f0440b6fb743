//! The commands of the language, and which is meant by a misspelt one.
//!
//! The one list of them: each refers to its [`Form`], which stands with what the command makes.

use crate::form::{Form, Scripted};
use crate::model::{
    Background, Cone, Cuboid, Cylinder, DirectionalLight, Disc, Lamp, Look, ORTHOCAMERA, Pinhole, Plane,
    Screen, Sphere, Torus, Triangle,
};

/// Defines [`Command`] from its names, so that the list of all is whole.
macro_rules! commands {
    ($($command:ident: $form:expr, $about:literal;)*) => {
        /// A command of the scene language.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum Command {
            $(#[doc = $about] $command,)*
        }

        impl Command {
            /// All of them, in the order of the documentation.
            pub const ALL: &[Self] = &[$(Self::$command,)*];

            /// How it is written.
            pub const fn form(self) -> &'static Form {
                match self {
                    $(Self::$command => &const { $form },)*
                }
            }
        }
    };
}

commands! {
    Screen: Screen::FORM, "The size of the image.";
    Orthocamera: ORTHOCAMERA, "A parallel projection.";
    Camera: Pinhole::FORM, "A pinhole camera.";
    Look: Look::FORM, "A camera that looks at a target.";
    Background: Background::FORM, "What a ray sees that hits nothing.";
    Sphere: Sphere::FORM, "A sphere.";
    Triangle: Triangle::FORM, "A triangle.";
    Cuboid: Cuboid::FORM, "A box along the axes.";
    Plane: Plane::FORM, "A plane without end.";
    Disc: Disc::FORM, "A flat, round disc.";
    Cylinder: Cylinder::FORM, "A closed cylinder.";
    Cone: Cone::FORM, "A closed cone, also cut off.";
    Torus: Torus::FORM, "A ring.";
    Ilight: DirectionalLight::FORM, "A light at infinity.";
    Plight: Lamp::FORM, "A light at a place.";
    Clear: Form::new("Clear", &[]), "Removes objects and lights.";
    Trace: Form::new("Trace", &[]), "Renders a frame.";
}

/// The most numbers that a command takes.
pub(crate) const MAX_NUMBERS: usize = {
    let (mut most, mut i) = (0, 0);
    while i < Command::ALL.len() {
        let count = *Command::ALL[i].form().arity().end();
        most = if count > most { count } else { most };
        i += 1;
    }
    most
};

impl Command {
    /// Its name.
    pub const fn name(self) -> &'static str {
        self.form().name
    }

    /// The command of this name, in any letter case.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|c| c.name().eq_ignore_ascii_case(name))
    }

    /// The command that was probably meant: a slip or two away, or cut short.
    pub(crate) fn nearest(name: &str) -> Option<Self> {
        // Longer than that and it is no slip; the distance is quadratic in the length.
        if name.len() > 40 {
            return None;
        }
        let name: String =
            name.chars().filter(|c| !c.is_control() && *c != '\u{feff}').collect::<String>().to_lowercase();
        let distance = |c: &Self| strsim::osa_distance(&name, &c.name().to_lowercase());
        let cut_short = |c: &Self| name.chars().count() >= 3 && c.name().to_lowercase().starts_with(&name);
        let near = Self::ALL.iter().copied().min_by_key(distance)?;
        let slips = near.name().len().div_ceil(3);
        if distance(&near) <= slips.min(name.chars().count().saturating_sub(1)) {
            return Some(near);
        }
        Self::ALL.iter().copied().find(cut_short)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_not_shared() {
        for command in Command::ALL {
            assert_eq!(Command::from_name(&command.name().to_uppercase()), Some(*command));
        }
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
}
