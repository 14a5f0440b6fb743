//! The inputs of a drawing: a script, and the files that it names.

use std::collections::BTreeMap;
use std::sync::Arc;

use bytes::Bytes;

use crate::keys::{Part, ScriptName};
use crate::store::ETag;

/// The files that a drawing reads, by their names; `None` for a file that is absent.
pub type Files = Arc<BTreeMap<String, Option<File>>>;

/// A file beside a script.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct File {
    /// The entity tag of the file.
    pub version: ETag,
    /// The content. If the file is larger than the renderer reads, only its beginning.
    pub body: Bytes,
}

/// The inputs of a drawing.
#[derive(Debug, Clone, PartialEq)]
pub struct Source {
    /// The name of the script, for messages.
    pub name: ScriptName,
    /// The text of the script.
    pub script: Bytes,
    /// The files that the script names, and those that they refer to.
    pub files: Files,
    /// The frame in the script; `None` if the script is one frame, or the number of its frames is not known yet.
    pub part: Part,
}
