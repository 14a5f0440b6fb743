//! The single way in which the project's programs read and write a user's files.
//!
//! A file is written under a short random name in its target folder, and renamed when it is complete ([`OutputFile`]).
//! If anything ends the run before that (an error, a full disk, Ctrl-C), the old file stays. A run that is killed
//! leaves its temporary file behind. A later run that writes into the same folder removes it (`leftover`).
//!
//! [`Folder`] reads a folder as an animation: its scripts, its settings, and misnamed files. [`library_beside`] returns
//! the models in the folder of a script. [`files_beside`] returns the files alone, for a library that also has others.
//! [`open`] accepts regular files only.
//!
//! This crate knows neither pictures nor signals, and of scenes only the names of files. A program that exits without
//! unwinding calls [`remove_unfinished`].
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

mod beside;
mod folder;
mod input;
mod leftover;
mod output;

pub use beside::{files_beside, library_beside, named_by_scripts};
pub use folder::{Folder, NotRead};
pub use input::{NotAFile, open};
pub use output::{Error, OutputFile, probe, remove_unfinished};
