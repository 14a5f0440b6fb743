//! The page: three files, built from `web` and part of the program. Only developers who change the page need Node.

use std::fs;
use std::path::Path;

use crate::error::Error;

/// The files of the page.
#[derive(Clone, Debug)]
pub struct Page {
    /// The content of `index.html`.
    pub html: Vec<u8>,
    /// The content of `studio.js`.
    pub script: Vec<u8>,
    /// The content of `studio.css`.
    pub style: Vec<u8>,
}

impl Page {
    /// Returns the page of this program.
    pub fn built_in() -> Self {
        Self {
            html: include_bytes!("../web/dist/index.html").to_vec(),
            script: include_bytes!("../web/dist/studio.js").to_vec(),
            style: include_bytes!("../web/dist/studio.css").to_vec(),
        }
    }

    /// Reads a page from a folder, such as `web/dist` while the page is changed.
    ///
    /// # Errors
    /// Fails if one of its files cannot be read.
    pub fn read(folder: &Path) -> Result<Self, Error> {
        let read = |name: &str| {
            let path = folder.join(name);
            fs::read(&path).map_err(|source| Error::Read { path, source })
        };
        Ok(Self { html: read("index.html")?, script: read("studio.js")?, style: read("studio.css")? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_of_the_program_is_that_of_its_folder() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("web/dist");
        let (own, read) = (Page::built_in(), Page::read(&folder).unwrap());
        assert!(own.html == read.html && own.script == read.script && own.style == read.style);
        let html = String::from_utf8(own.html).unwrap();
        for name in ["studio.js", "studio.css"] {
            assert!(html.contains(name), "{name} in {html}");
        }
    }

    #[test]
    fn a_folder_without_a_page_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let error = Page::read(folder.path()).unwrap_err();
        assert!(error.to_string().contains("index.html"), "{error}");
    }
}
