//! The one way in which the project's programs write and read a user's files.
//!
//! A file is written under a short random name in the folder of its place and renamed when it is complete. Whatever ends
//! the run before that (an error, a full disk, Ctrl-C) leaves what was there before. A run that is killed leaves its
//! temporary file behind; a later run that writes into the same folder removes it ([`leftover`]).
//!
//! A folder is read as an animation ([`Folder`]): its scripts, its settings, and the files that are not called as either.
//!
//! This crate knows neither pictures nor signals, and of scenes only the names. A program that ends at once calls [`remove_unfinished`].
//!
//! ```
//! use std::io::Write;
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("hello.gif");
//! let mut out = rayfold_files::OutputFile::create(&path)?;
//! out.write_all(b"GIF89a")?;
//! out.finish(false)?; // hello.gif is there from now on
//! assert_eq!(std::fs::read(&path)?, b"GIF89a");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod folder;
mod input;
mod leftover;
mod output;

pub use folder::{Folder, NotRead};
pub use input::{NotAFile, open};
pub use output::{Error, OutputFile, probe, remove_unfinished};
