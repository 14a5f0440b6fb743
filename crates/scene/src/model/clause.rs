//! The clauses of a `Material`.

use std::ops::Range;

use glam::DVec3;

use super::image::{AXES, Image, MAPS};
use super::invalid::{Faults, InvalidValue, Parameter, finite, positive};
use super::material::{Coefficients, Finish, Glass, Material, Pattern, Rough, Shine, Weight};
use super::surface::{AMBIENT, DIFFUSE, MIRROR};
use crate::form::{Constraint, Field, Form, Kind, Names, Numbers, Presence, Quotes, Subject, Values, Words};

/// The command that defines a material.
pub(crate) const MATERIAL: Form = Form::new("Material", &[]).with_subject(Subject::Defines(Names::Materials));

/// Defines [`Clause`] from its names, so that the list of all clauses is complete.
macro_rules! clauses {
    ($($clause:ident: $form:expr, $summary:literal;)*) => {
        /// A clause of a `Material`, each at most once.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum Clause {
            $(#[doc = $summary] $clause,)*
        }

        impl Clause {
            /// All clauses, in the order of the documentation.
            pub const ALL: &[Self] = &[$(Self::$clause,)*];

            /// Returns the syntax of the clause.
            pub const fn form(self) -> &'static Form {
                match self {
                    $(Self::$clause => &const { $form },)*
                }
            }

            /// Returns a one-line summary of the clause.
            pub const fn summary(self) -> &'static str {
                match self {
                    $(Self::$clause => $summary,)*
                }
            }
        }
    };
}

const SIZE: &[Field] = &[Field::new(Parameter::CellSize, &["s"], Kind::Length, Values::Positive)];

const WIDTH: &[Field] = &[Field::new(Parameter::PictureWidth, &["s"], Kind::Length, Values::Positive)
    .optional("stands behind `flat` alone")];

const AXIS_WORDS: [&str; 3] = [AXES[0].0, AXES[1].0, AXES[2].0];

/// Only a flat picture has a width and axes.
const IMAGE_WORDS: Words = Words {
    before: Field::new(Parameter::PictureMap, &["map"], Kind::Word, Values::OneOf(&MAPS)),
    with_numbers: MAPS[1],
    behind: Field::new(Parameter::PictureAxes, &["axes"], Kind::Word, Values::OneOf(&AXIS_WORDS))
        .optional(AXIS_WORDS[0]),
};

const WHOLE_MIRROR: &[Field] = &[Field { presence: Presence::Required, ..MIRROR }];
const SHINE: &[Field] = &[
    Field::new(Parameter::Shine, &["r", "g", "b"], Kind::Coefficients, Values::Any),
    Field::new(Parameter::ShineExponent, &["n"], Kind::Plain, Values::AtLeastOne),
];
const GLASS: &[Field] = &[
    Field::new(Parameter::Glass, &["r", "g", "b"], Kind::Coefficients, Values::Any),
    Field::new(Parameter::Ior, &["ior"], Kind::Plain, Values::Positive),
];
const GLOW: &[Field] = &[Field::new(Parameter::Glow, &["r", "g", "b"], Kind::Coefficients, Values::Any)];
const ROUGH: &[Field] = &[Field::new(Parameter::Roughness, &["a"], Kind::Plain, Values::Share)];
const ENDS: &[Field] = &[
    Field::new(Parameter::GradientStart, &["a"], Kind::Position, Values::Any),
    Field::new(Parameter::GradientEnd, &["b"], Kind::Position, Values::Any),
];

clauses! {
    Ambient: Form::new("ambient", &[AMBIENT]), "The colour without light.";
    Diffuse: Form::new("diffuse", &[DIFFUSE]), "The diffuse reflectance.";
    Mirror: Form::new("mirror", WHOLE_MIRROR), "The share of the colour along the reflected ray.";
    Shine: Form::new("shine", SHINE), "Specular highlights.";
    Glass: Form::new("glass", GLASS), "The transmitted share of light, and the index of refraction.";
    Checker: Form::new("checker", SIZE).ending_with(Names::Materials), "Another material in every other cell.";
    Stripes: Form::new("stripes", SIZE).ending_with(Names::Materials), "Another material in every other stripe along x.";
    Noise: Form::new("noise", SIZE).ending_with(Names::Materials), "Another material in a random pattern.";
    Gradient: Form::new("gradient", ENDS).with(&[Constraint::Differ(0, 1)]).ending_with(Names::Materials), "Another material from height a to height b.";
    Image: Form::new("image", WIDTH).with_subject(Subject::Quotes(Quotes::File)).with_words(IMAGE_WORDS).with_usage("image \"FILE\" uv or flat s [xy or xz or zy] or ball"), "A picture as a factor of ambient and diffuse.";
    Own: Form::new("own", &[]), "The colours of a model's file as factors.";
    Glow: Form::new("glow", GLOW), "The light that the surface gives off.";
    Rough: Form::new("rough", ROUGH), "The roughness of mirror and glass.";
}

impl Clause {
    /// Returns the name of the clause.
    pub const fn name(self) -> &'static str {
        self.form().name
    }

    /// Returns the clause with this name, in any letter case.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|c| c.name().eq_ignore_ascii_case(name))
    }

    /// Returns the errors in the numbers of a clause without curves, each with the range of the numbers that it is about.
    /// `numbers` are as many as the form takes.
    pub fn check(self, numbers: &[f64]) -> Vec<(InvalidValue, Range<usize>)> {
        let form = self.form();
        let mut numbers = Numbers::new(numbers, numbers.len(), None);
        let added = Clauses::default().add(self, &mut numbers, Coefficients::default());
        let placed =
            |fault: InvalidValue| (fault, form.place(|name, parameter| fault.is_about(parameter, name)));
        added.map_or_else(|faults| faults.0.into_iter().map(placed).collect(), |()| Vec::new())
    }

    /// Returns whether the clause is a pattern. A material has at most one.
    pub(crate) fn is_pattern(self) -> bool {
        self.form().ends_with.is_some() || self == Self::Image
    }
}

/// A material that is assembled from its clauses.
#[derive(Clone, Debug, Default)]
pub(crate) struct Clauses {
    ambient: DVec3,
    diffuse: DVec3,
    mirror: DVec3,
    finish: Finish,
}

impl Clauses {
    /// Adds a clause. `other` is the material that a pattern names.
    pub(crate) fn add(
        &mut self,
        clause: Clause,
        numbers: &mut Numbers<'_>,
        other: Coefficients,
    ) -> Result<(), Faults> {
        let pattern =
            |weight: Weight| Ok::<_, InvalidValue>(Some(Pattern { weight: weight.checked()?, other }));
        match clause {
            Clause::Ambient => self.ambient = finite(Parameter::Ambient, numbers.vector())?,
            Clause::Diffuse => self.diffuse = finite(Parameter::Diffuse, numbers.vector())?,
            Clause::Mirror => self.mirror = finite(Parameter::Mirror, numbers.vector())?,
            Clause::Shine => self.finish.shine = Some(Shine::new(numbers.vector(), numbers.number())?),
            Clause::Glass => self.finish.glass = Some(Glass::new(numbers.vector(), numbers.number())?),
            Clause::Checker => self.finish.pattern = pattern(Weight::Checker(numbers.number()))?,
            Clause::Stripes => self.finish.pattern = pattern(Weight::Stripes(numbers.number()))?,
            Clause::Noise => self.finish.pattern = pattern(Weight::Noise(numbers.number()))?,
            Clause::Gradient => {
                self.finish.pattern = pattern(Weight::Gradient(numbers.number(), numbers.number()))?;
            }
            // The picture is added on its own.
            Clause::Image => {
                if let Some(width) = numbers.optional_number() {
                    positive(Parameter::PictureWidth, width)?;
                }
            }
            Clause::Own => self.finish.own = true,
            Clause::Rough => {
                let rough = Rough::new(numbers.number())?;
                self.finish.rough = Some(rough).filter(|rough| rough.given() > 0.0);
            }
            Clause::Glow => self.finish.glow = finite(Parameter::Glow, numbers.vector())?,
        }
        Ok(())
    }

    /// Adds the picture of a clause `image`.
    pub(crate) fn add_image(&mut self, image: Image) {
        self.finish.image = Some(image);
    }

    /// Keeps a roughness of 0, which is that of a curve at a moment.
    pub(crate) fn keep_rough(&mut self) {
        self.finish.rough.get_or_insert(Rough::NONE);
    }

    /// Returns the assembled material.
    pub(crate) fn material(self) -> Result<Material, InvalidValue> {
        let coefficients = Coefficients::new(self.ambient, self.diffuse, self.mirror)?;
        Ok(Material::finished(coefficients, self.finish))
    }
}
