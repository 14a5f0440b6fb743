//! `rayfold completions`: scripts that make a shell complete rayfold's command line.

use clap_complete::Shell;

use crate::console::Console;
use crate::outcome::Outcome;

/// Print a completion script for a shell
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  rayfold completions bash > ~/.local/share/bash-completion/completions/rayfold
  rayfold completions zsh > ~/.zfunc/_rayfold
  rayfold completions fish > ~/.config/fish/completions/rayfold.fish")]
pub(crate) struct Args {
    /// The shell to complete in
    shell: Shell,
}

/// Prints the script for `command`, which is the whole command line.
pub(crate) fn run(args: &Args, mut command: clap::Command, console: &Console) -> anyhow::Result<Outcome> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, "rayfold", &mut script);
    console.print(&script)?;
    Ok(Outcome::Done)
}
