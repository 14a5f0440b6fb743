//! The commands of the language: names, parameters, and which is meant by a misspelt one.

use std::ops::{Range, RangeInclusive};

use crate::model::{InvalidValue, Parameter};

/// The most parameters that a command takes.
pub(super) const MAX_PARAMETERS: usize = 15;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Command {
    Screen,
    Orthocamera,
    Camera,
    Background,
    Sphere,
    Triangle,
    Cuboid,
    Ilight,
    Clear,
    Trace,
}

/// How a command is written.
struct Form {
    name: &'static str,
    /// The required parameters, then the optional ones.
    parameters: &'static [&'static str],
    required: usize,
}

const fn form(name: &'static str, parameters: &'static [&'static str]) -> Form {
    Form { name, parameters, required: parameters.len() }
}

impl Command {
    pub(super) const ALL: [Self; 10] = [
        Self::Screen,
        Self::Orthocamera,
        Self::Camera,
        Self::Background,
        Self::Sphere,
        Self::Triangle,
        Self::Cuboid,
        Self::Ilight,
        Self::Clear,
        Self::Trace,
    ];

    fn form(self) -> &'static Form {
        const SPHERE: Form =
            form("Sphere", &["R", "cx", "cy", "cz", "ar", "ag", "ab", "rr", "rg", "rb", "sr", "sg", "sb"]);
        match self {
            Self::Screen => &const { form("Screen", &["nx", "ny"]) },
            Self::Orthocamera => &const { form("Orthocamera", &[]) },
            Self::Camera => {
                &const {
                    form(
                        "Camera",
                        &[
                            "ex", "ey", "ez", "gx", "gy", "gz", "upx", "upy", "upz", "s", "au", "av", "bu",
                            "bv",
                        ],
                    )
                }
            }
            Self::Background => &const { form("Background", &["r", "g", "b"]) },
            Self::Sphere => &const { Form { required: 10, ..SPHERE } },
            Self::Triangle => {
                &const {
                    form(
                        "Triangle",
                        &[
                            "ux", "uy", "uz", "vx", "vy", "vz", "wx", "wy", "wz", "ar", "ag", "ab", "rr",
                            "rg", "rb",
                        ],
                    )
                }
            }
            Self::Cuboid => {
                &const { form("Box", &["ux", "uy", "uz", "vx", "vy", "vz", "ar", "ag", "ab", "rr", "rg", "rb"]) }
            }
            Self::Ilight => &const { form("Ilight", &["lr", "lg", "lb", "dx", "dy", "dz"]) },
            Self::Clear => &const { form("Clear", &[]) },
            Self::Trace => &const { form("Trace", &[]) },
        }
    }

    pub(super) fn name(self) -> &'static str {
        self.form().name
    }

    /// The names of its parameters, the optional ones last.
    pub(super) fn parameters(self) -> &'static [&'static str] {
        self.form().parameters
    }

    /// How many parameters it takes.
    pub(super) fn arity(self) -> RangeInclusive<usize> {
        self.form().required..=self.form().parameters.len()
    }

    /// `Sphere R cx cy cz ar ag ab rr rg rb [sr sg sb]`.
    pub(super) fn usage(self) -> String {
        let Form { name, parameters, required } = self.form();
        let (needed, optional) = parameters.split_at(*required);
        let mut usage = name.to_string();
        for parameter in needed {
            usage.push(' ');
            usage.push_str(parameter);
        }
        if !optional.is_empty() {
            usage.push_str(&format!(" [{}]", optional.join(" ")));
        }
        usage
    }

    pub(super) fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|c| c.name().eq_ignore_ascii_case(name))
    }

    /// The command that was probably meant: a slip or two away, or cut short.
    pub(super) fn nearest(name: &str) -> Option<Self> {
        // Longer than that and it is no slip; the distance is quadratic in the length.
        if name.len() > 40 {
            return None;
        }
        let name: String =
            name.chars().filter(|c| !c.is_control() && *c != '\u{feff}').collect::<String>().to_lowercase();
        let distance = |c: &Self| strsim::osa_distance(&name, &c.name().to_lowercase());
        let cut_short = |c: &Self| name.chars().count() >= 3 && c.name().to_lowercase().starts_with(&name);
        let near = Self::ALL.into_iter().min_by_key(distance)?;
        let slips = near.name().len().div_ceil(3);
        if distance(&near) <= slips.min(name.chars().count().saturating_sub(1)) {
            return Some(near);
        }
        Self::ALL.into_iter().find(cut_short)
    }

    /// Which of its parameters a fault is about.
    pub(super) fn place_of(self, fault: InvalidValue) -> Range<usize> {
        use InvalidValue as V;
        match (self, fault) {
            (Self::Screen, V::Zero(Parameter::ScreenWidth)) => 0..1,
            (Self::Screen, V::Zero(Parameter::ScreenHeight)) => 1..2,
            (Self::Camera, V::ZeroDirection(Parameter::Gaze)) => 3..6,
            (Self::Camera, V::ZeroDirection(Parameter::Up)) => 6..9,
            (Self::Camera, V::GazeParallelToUp) => 3..9,
            (Self::Camera, V::NotPositive(Parameter::WindowDistance)) => 9..10,
            (Self::Camera, V::EmptyWindowWidth) => 10..13,
            (Self::Camera, V::EmptyWindowHeight) => 11..14,
            (Self::Sphere, V::NotPositive(Parameter::Radius)) => 0..1,
            (Self::Ilight, V::ZeroDirection(Parameter::LightDirection)) => 3..6,
            _ => 0..self.parameters().len(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_command_fits() {
        assert_eq!(Command::ALL.iter().map(|c| *c.arity().end()).max(), Some(MAX_PARAMETERS));
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
