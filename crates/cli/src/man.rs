//! `rayfold man`: the manual pages, one per subcommand.

use std::path::PathBuf;

use anyhow::Context;

use crate::console::Console;
use crate::outcome::Outcome;

/// Write the manual pages into a folder
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  rayfold man ~/.local/share/man/man1
  man rayfold-render")]
pub(crate) struct Args {
    /// The folder; it is made if it is missing
    folder: PathBuf,
}

/// Writes the pages of `command`, which is the whole command line.
pub(crate) fn run(args: &Args, command: clap::Command, console: &Console) -> anyhow::Result<Outcome> {
    std::fs::create_dir_all(&args.folder)
        .with_context(|| format!("cannot make the folder {}", args.folder.display()))?;
    clap_mangen::generate_to(command, &args.folder)
        .with_context(|| format!("cannot write the manual pages into {}", args.folder.display()))?;
    console.note(format_args!("the manual pages are in {}", args.folder.display()));
    Ok(Outcome::Done)
}
