//! The messages as TypeScript types. This module writes `web/src/protocol.ts`.
//!
//! `SNAPSHOTS=overwrite cargo test -p rayfold-studio typescript` writes the file.

use std::path::Path;

use rayfold_scene as scene;
use ts_rs::{Config, TS};

use super::*;
use crate::handles::DragOptions;
use crate::packing::HEADER;
use crate::runs::{sending, updates};
use crate::tracks::Track;

/// Defines types of another crate again, with their own fields: a missing or an added field does not compile.
macro_rules! mirror {
    ($($name:ident of $other:ident { $($(#[$attr:meta])* $field:ident: $kind:ty,)* })*) => {
        $(
            #[derive(TS)]
            #[ts(optional_fields)]
            #[allow(dead_code, reason = "only the type is used")]
            pub(super) struct $name { $($(#[$attr])* $field: $kind,)* }

            impl From<scene::$other> for $name {
                fn from(scene::$other { $($field,)* }: scene::$other) -> Self {
                    Self { $($field,)* }
                }
            }
        )*
    };
}

mirror! {
    Language of Language {
        version: u32,
        #[ts(as = "Vec<LanguageEntry>")]
        commands: Vec<scene::CommandEntry>,
        #[ts(as = "Vec<LanguageEntry>")]
        clauses: Vec<scene::CommandEntry>,
        #[ts(as = "Vec<CurveMode>")]
        curve_modes: Vec<scene::ModeEntry>,
    }
    LanguageEntry of CommandEntry {
        name: &'static str,
        usage: String,
        about: &'static str,
        #[ts(as = "Option<LanguageSubject>")]
        subject: Option<scene::SubjectEntry>,
        #[ts(as = "Vec<LanguageParameter>")]
        parameters: Vec<scene::ParameterEntry>,
        #[ts(as = "Option<_>")]
        together: Vec<String>,
        curves: bool,
        material_instead_from: Option<&'static str>,
        word_instead: Option<&'static str>,
        ends_with: Option<&'static str>,
    }
    LanguageSubject of SubjectEntry {
        role: &'static str,
        of: &'static str,
    }
    LanguageParameter of ParameterEntry {
        names: &'static [&'static str],
        meaning: String,
        kind: String,
        unit: String,
        range: String,
        minimum: Option<f64>,
        #[ts(as = "Option<_>")]
        above_minimum: bool,
        maximum: Option<f64>,
        #[ts(as = "Option<_>")]
        below_maximum: bool,
        #[ts(as = "Option<_>")]
        whole: bool,
        #[ts(as = "Option<_>")]
        words: &'static [&'static str],
        presence: &'static str,
        default: Option<&'static str>,
        #[ts(as = "Option<_>")]
        fixed: bool,
    }
    CurveMode of ModeEntry {
        name: &'static str,
        about: &'static str,
    }
}

const HEAD: &str = "// The messages between page and server. Made of the server's types by\n\
                    // `SNAPSHOTS=overwrite cargo test -p rayfold-studio typescript`.\n\
                    //\n\
                    // Points are in pixels of the picture. Lines count from 0.\n";

const FOOT: &str = "/**\n * Bytes before the pixels of a picture: number, width, height, microseconds, 1 if it is final or 2 if it is simplified;\n \
                    * then left, top, width and height of the part that differs from the previous picture, whose pixels follow;\n \
                    * little-endian.\n */\n";

/// Returns the declaration of a type. The page does not change messages, so all lists are read-only.
fn declared<T: TS>(config: &Config) -> String {
    let declaration = T::decl(config).replace("Array<", "ReadonlyArray<").replace(": [", ": readonly [");
    format!("\n{}export {declaration}\n", T::docs().unwrap_or_default())
}

/// Writes each comment of one line in one line.
fn compacted(text: &str) -> String {
    let mut parts = text.split("/**\n * ");
    let mut written = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        match part.split_once("\n */") {
            Some((comment, rest)) if !comment.contains('\n') => written += &format!("/** {comment} */{rest}"),
            _ => written += &format!("/**\n * {part}"),
        }
    }
    written
}

fn written() -> String {
    let config = Config::new().with_large_int("number");
    macro_rules! all {
        ($($kind:ty),* $(,)?) => { [$(declared::<$kind>(&config)),*].concat() };
    }
    let types = all![
        ClientMessage,
        Source,
        TimelineEdit,
        Switch,
        Navigation,
        ViewPreset,
        DragOptions,
        TextChange,
        KeyPlace,
        ServerMessage,
        FileState,
        LineState,
        TextState,
        LinesChanged,
        State,
        Inspected,
        TimeState,
        Ghost,
        FaultState,
        OutputState,
        MovieFormat,
        Saved,
        Alignment,
        HandleKind,
        Handle,
        Role,
        CommandTable,
        FieldTable,
        Track,
        Tracks,
        Language,
        LanguageEntry,
        LanguageSubject,
        LanguageParameter,
        CurveMode,
        updates::Summary,
        updates::RunFile,
        updates::RunUpdate,
        updates::RunState,
        updates::FrameUpdate,
        updates::FrameStatus,
        updates::FaultInfo,
        sending::UploadProgress,
    ];
    let types = compacted(&types);
    format!("{HEAD}{types}\n{FOOT}export const PICTURE_HEADER = {HEADER};\n")
}

#[test]
fn the_page_has_the_types_of_the_server_in_typescript() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("web/src/protocol.ts");
    let written = written();
    if std::env::var("SNAPSHOTS").is_ok_and(|value| value == "overwrite") {
        std::fs::write(&path, &written).unwrap();
    }
    let committed = std::fs::read_to_string(&path).unwrap();
    assert!(
        committed == written,
        "web/src/protocol.ts: SNAPSHOTS=overwrite cargo test -p rayfold-studio typescript"
    );
}
