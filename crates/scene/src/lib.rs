//! Parser and writer of scene scripts: text to typed scenes and back, with all diagnostics.
//!
//! The crate does no I/O: text comes in, scenes and diagnostics go out. It uses only one other crate of the project,
//! `rayfold-assets`, which decodes the files that scripts name. The caller provides their bytes ([`parse_with_files`]).
//! Frames are lazy: a frame is a few indices, and its [`Scene`] is built when a caller asks for it.
//!
//! Invariants:
//!
//! - [`parse`] returns a script if and only if it reports no error.
//! - A valid line without curves and names allocates nothing.
//! - The size of the text bounds time and memory, whatever the errors, the nesting of groups or the number of frames.
//!
//! ```
//! use rayfold_scene::{Limits, parse};
//!
//! let parsed = parse("red.txt", b"Screen 4 3\nSphere 1 0 0 -5 1 0 0 0 0 0\nTrace", &Limits::default());
//! assert_eq!(parsed.script.unwrap().frame_count(), 1);
//!
//! let parsed = parse("red.txt", b"Screen 4 3\nSpere 1 0 0 -5 1 0 0 0 0 0\nTrace", &Limits::default());
//! assert!(parsed.script.is_none());
//! assert_eq!(parsed.diagnostics[0].help.as_deref(), Some("did you mean `Sphere`?"));
//! ```
//!
//! # Inside
//!
//! - `command` is the one table of all commands. Parser, writer, hints, editors and the test of `docs/language.md` read
//!   it.
//! - `form` has the syntax of a command. A type that a line can hold implements `Scripted`. `form/color` decides where
//!   a colour may be `#rrggbb`.
//! - `model` is the typed scene, with a file per shape in `shapes` and per light in `lights`. Values with constraints
//!   have constructors that check them.
//! - `parse` reads lines (`line`), and names and groups (`definitions`). It checks lines with curves (`visibility`),
//!   and warns about lines that lack their intended effect (`doubts`). It recognises files in other formats
//!   (`foreign`), and writes the messages (`wording`).
//! - `curve` is a number as a curve. `row` has the numbers of a line, and the conditions that they provably satisfy.
//! - `script` has frames as ranges of one shared object list. `moment` evaluates curves and groups for one frame.
//!   `origins` numbers its objects and has their lines.
//! - `diagnostic` is an error or a warning with its place and text. `report` is a list of them, of limited length.
//! - `language` is the table of commands as data for editors.
//! - `name` has the classes of file names, `natural` the order of frames, and `limits` the limits. `settings` reads
//!   `animation.json`, and `container` has the kinds of files that it can ask for.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

mod command;
mod container;
mod curve;
pub mod diagnostic;
mod form;
mod language;
mod limits;
pub mod model;
mod name;
mod natural;
mod parse;
mod report;
mod row;
mod script;
mod settings;
mod shared_slice;
mod shown;

pub use command::Command;
pub use container::{Container, UnknownContainer};
pub use curve::{Curve, Key, Mode};
pub use diagnostic::{Code, Diagnostic, Severity};
pub use form::{
    Constraint, Field, Form, Kind, Names, Presence, Quotes, Subject, Unit, Values, Words, color_levels,
    quoted_word,
};
pub use language::{CommandEntry, Language, ModeEntry, ParameterEntry, SubjectEntry, language};
pub use limits::Limits;
pub use model::shapes::{Instance, Mesh, Motion, Object, Outline, Placement, Source};
pub use model::{
    Axes, Background, Camera, Clause, Coefficients, Depth, DirectionalLight, Finish, Fog, Glass, Image,
    ImageMap, Indirect, InvalidValue, Lamp, Lens, Light, Look, Material, Parameter, Pattern, PictureFile,
    Pinhole, Rough, Samples, Scene, Screen, Shine, Shutter, Sky, SkyColors, SkyTurn, Tone, Weight,
};
pub use name::{Name, SETTINGS_FILE, script_name};
pub use natural::natural_cmp;
pub use parse::{Parsed, is_name, parse, parse_curve, parse_with_files, unquoted_word};
pub use rayfold_assets as assets;
pub use script::{Origin, Script, ShotSummary};
pub use settings::{AnimationSettings, ParsedSettings, SETTINGS_FIELDS, fraction, parse_settings};
pub use shared_slice::SharedSlice;

/// Exports the shapes.
macro_rules! export {
    (shapes { $($module:ident::$Shape:ident: $summary:literal;)* }) => {
        $(pub use model::shapes::$Shape;)*
    };
}
model::with_shapes! { export! {} }

/// The example of the README is compiled and run with the tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
