//! The folder that a measurement writes its report to.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use rayfold_files::OutputFile;

/// The option that names the folder.
#[derive(Debug, clap::Args)]
pub struct ReportFolder {
    /// Write the report, with its tables and plots, into this folder
    #[arg(long = "output", value_name = "FOLDER", default_value = "docs/reports")]
    folder: PathBuf,
}

impl ReportFolder {
    /// Makes the folder before anything is measured, so that hours of measuring are not lost.
    pub(crate) fn prepare(&self) -> Result<()> {
        std::fs::create_dir_all(&self.folder).with_context(|| self.folder.display().to_string())
    }

    pub(crate) fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.folder.join(name)
    }

    /// Writes a file of the report whole.
    pub(crate) fn write(&self, name: impl AsRef<Path>, content: impl AsRef<[u8]>) -> Result<()> {
        Ok(OutputFile::write(self.path(name), content, false)?)
    }
}

#[cfg(test)]
impl From<&Path> for ReportFolder {
    fn from(folder: &Path) -> Self {
        Self { folder: folder.to_owned() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_that_cannot_be_made_is_an_error_before_the_measurement() {
        let home = tempfile::tempdir().unwrap();
        let file = home.path().join("a file");
        std::fs::write(&file, "").unwrap();
        let refused = ReportFolder::from(&*file.join("reports")).prepare().unwrap_err();
        assert!(refused.to_string().contains("a file/reports"), "{refused}");
        let made = ReportFolder::from(&*home.path().join("made/here"));
        made.prepare().unwrap();
        made.write("a.md", "# A\n").unwrap();
        assert_eq!(std::fs::read_to_string(made.path("a.md")).unwrap(), "# A\n");
    }
}
