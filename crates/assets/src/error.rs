//! The reasons why a file that a script names cannot be used.

use crate::files::likeness;
use crate::limits;

/// The reason why a file cannot be used. It names the file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AssetError {
    /// No file has this name.
    #[error("there is no file `{name}` in the script's folder")]
    Absent {
        /// The wanted name.
        name: String,
        /// The name of a file that differs only in letter case or in its Unicode normal form.
        similar: Option<String>,
    },
    /// The file exists, but cannot be read.
    #[error("cannot read the file `{name}`: {why}")]
    Unreadable {
        /// The name of the file.
        name: String,
        /// The reason.
        why: String,
    },
    /// Files cannot be read here at all.
    #[error("files are not read here: `{name}` is one")]
    NotHere {
        /// The wanted name.
        name: String,
    },
    /// The file is larger than the limit.
    #[error("the file `{name}` has {bytes} bytes, more than {}", limits::FILE_BYTES)]
    TooLarge {
        /// The name of the file.
        name: String,
        /// The size of the file in bytes.
        bytes: u64,
    },
    /// The content of the file is faulty.
    #[error("`{name}`{}: {what}", at(*.line))]
    Malformed {
        /// The name of the file.
        name: String,
        /// The line of the fault, from 1, in a text.
        line: Option<usize>,
        /// The description of the fault.
        what: String,
    },
    /// The content of the file is no font that can be used.
    #[error("`{name}`: {what}")]
    NoFont {
        /// The name of the file.
        name: String,
        /// The description of the fault.
        what: String,
    },
    /// The content of a picture is faulty, or of a kind that is not read.
    #[error("`{name}`: {what}")]
    Picture {
        /// The name of the file.
        name: String,
        /// The description of the fault.
        what: String,
    },
    /// The picture holds light without an upper bound, but levels from 0 to 1 are required.
    #[error("`{name}` is a picture of light (HDR or EXR), which only a `Sky` takes")]
    Light {
        /// The name of the file.
        name: String,
    },
    /// The model has no triangle that can be seen.
    #[error("`{name}` has no triangle with an area: a model is drawn by its faces")]
    NoTriangle {
        /// The name of the file.
        name: String,
    },
    /// The file needs an extension that is not known.
    #[error("`{name}` needs the glTF extension {extension}")]
    Extension {
        /// The name of the file.
        name: String,
        /// The name of the extension.
        extension: String,
    },
}

impl AssetError {
    /// Returns advice for a correction.
    pub fn help(&self) -> Option<String> {
        Some(match self {
            Self::Absent { similar: Some(similar), name } => likeness(similar, name),
            Self::Extension { extension, .. } => match extension.as_str() {
                "KHR_draco_mesh_compression" => {
                    "export without compression: in Blender, clear `Compression` under `Data`".into()
                }
                "EXT_meshopt_compression" | "KHR_meshopt_compression" => {
                    "export without compression: gltfpack compresses only with `-c` or `-cc`".into()
                }
                "KHR_texture_basisu" => {
                    "export PNG or JPEG pictures: gltfpack writes Basis only with `-tc`, toktx only if called"
                        .into()
                }
                _ => "export without this extension".into(),
            },
            Self::Picture { .. } => {
                "pictures are PNG, JPEG and WebP, those of a `Sky` also HDR and EXR".into()
            }
            Self::Light { .. } => "save it as PNG, JPEG or WebP".into(),
            Self::Malformed { .. } | Self::NoTriangle { .. } => {
                "models are OBJ, PLY, STL, glTF (.gltf) and binary glTF (.glb)".into()
            }
            Self::NoFont { .. } => "fonts are TrueType and OpenType (.ttf, .otf, .ttc)".into(),
            _ => return None,
        })
    }
}

fn at(line: Option<usize>) -> String {
    line.map(|line| format!(", line {line}")).unwrap_or_default()
}

/// The maximum number of characters of a file that a message quotes, and of a message.
const QUOTED: usize = 60;
const MESSAGE: usize = 400;

fn shortened_to(text: &str, most: usize) -> String {
    match text.char_indices().nth(most) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.into(),
    }
}

/// Returns a text of a file as a message quotes it.
pub(crate) fn shortened(text: &str) -> String {
    shortened_to(text, QUOTED)
}

/// The description of a fault, with the line in a text. The caller adds the name of the file.
#[derive(Debug)]
pub(crate) struct Fault {
    pub(crate) line: Option<usize>,
    pub(crate) what: String,
}

impl Fault {
    pub(crate) fn new(what: impl Into<String>) -> Self {
        Self { line: None, what: shortened_to(&what.into(), MESSAGE) }
    }

    pub(crate) fn at(line: usize, what: impl Into<String>) -> Self {
        Self { line: Some(line), ..Self::new(what) }
    }

    /// The content is that of no model.
    pub(crate) fn no_model() -> Self {
        Self::new("it is no model: expected OBJ, PLY, STL or glTF")
    }

    pub(crate) fn of_font(self, name: &str) -> AssetError {
        AssetError::NoFont { name: name.into(), what: self.what }
    }

    pub(crate) fn of(self, name: &str) -> AssetError {
        AssetError::Malformed { name: name.into(), line: self.line, what: self.what }
    }
}
