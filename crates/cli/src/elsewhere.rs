//! The message of a program without the feature `network` about the subcommands that it lacks.

use clap::error::{ContextKind, ContextValue, ErrorKind};

/// The subcommands of the feature `network`.
const SUBCOMMANDS: [&str; 8] = ["studio", "cost", "submit", "status", "fetch", "retry", "remove", "dev"];

/// The text at the end of the help page.
pub(crate) const HELP: &str = "\
Examples:
  rayfold render scenes/hello -o hello.gif
      render a folder of scripts to an animation
  rayfold check scenes/hello
      show what is wrong with its scripts

This is the renderer alone. studio, cost, submit, status, fetch, retry, remove and dev come with the
whole program: `cargo install --path crates/cli`, or `cargo rayfold` in place of `cargo render`.

Exit codes: 0 done, 1 the input or the rendering failed, 2 wrong usage, 130 interrupted.";

/// Returns a message that says which program has the requested subcommand, if rayfold has such a subcommand.
pub(crate) fn missing(error: &clap::Error) -> Option<String> {
    let name = match error.get(ContextKind::InvalidSubcommand) {
        Some(ContextValue::String(name)) if error.kind() == ErrorKind::InvalidSubcommand => name,
        _ => return None,
    };
    SUBCOMMANDS.contains(&name.as_str()).then(|| {
        format!(
            "error: this program is the renderer alone, without `{name}`\n\n  tip: `cargo rayfold {name}` builds the \
             whole where the sources are, `cargo install --path crates/cli` installs it"
        )
    })
}

#[cfg(test)]
mod tests {
    use clap::Command;

    use super::*;

    fn asked_for(name: &str) -> clap::Error {
        let renderer = Command::new("rayfold").subcommand_required(true).subcommand(Command::new("render"));
        renderer.try_get_matches_from(["rayfold", name]).unwrap_err()
    }

    #[test]
    #[cfg(all(unix, feature = "network"))]
    fn these_are_the_subcommands_of_the_whole_program() {
        let whole =
            <crate::network::Command as clap::Subcommand>::augment_subcommands(Command::new("rayfold"));
        let names: Vec<_> = whole.get_subcommands().map(Command::get_name).collect();
        assert_eq!(names, SUBCOMMANDS);
    }

    #[test]
    fn the_help_names_each_and_where_it_is() {
        for name in SUBCOMMANDS {
            assert!(HELP.contains(name), "{name}");
            assert!(
                missing(&asked_for(name)).unwrap().contains(&format!("`cargo rayfold {name}`")),
                "{name}"
            );
        }
    }

    #[test]
    fn of_what_no_program_has_it_says_nothing() {
        for name in ["rendr", "", "--studio"] {
            assert_eq!(missing(&asked_for(name)), None, "{name}");
        }
    }
}
