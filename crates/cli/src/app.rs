//! The command line: its flags, and the module that runs each subcommand.

use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{CommandFactory, Parser, Subcommand};

use crate::console::{Color, Console};
#[cfg(not(feature = "network"))]
use crate::elsewhere;
#[cfg(feature = "network")]
use crate::network;
use crate::outcome::{Outcome, exit_code};
use crate::{check, completions, encode, interrupt, man, render, split};

/// Ray-traced animations from a folder of scene scripts.
#[derive(Debug, Parser)]
#[command(
    name = "rayfold",
    version,
    max_term_width = 100,
    subcommand_required = true,
    arg_required_else_help = true,
    after_help = "\
Examples:
  rayfold render scenes/hello -o hello.gif
      render a folder of scripts to an animation
  rayfold check scenes/hello
      show what is wrong with its scripts
  rayfold submit scenes/hello --bucket my-bucket
      render it in the cloud

Exit codes: 0 done, 1 the input or the rendering failed, 2 wrong usage, 130 interrupted."
)]
#[cfg_attr(not(feature = "network"), command(after_help = elsewhere::HELP))]
pub(crate) struct App {
    #[command(flatten)]
    global: Global,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, clap::Args)]
struct Global {
    /// Say nothing but errors
    #[arg(long, short, global = true)]
    quiet: bool,
    /// When to write in colour; auto: on a terminal, unless NO_COLOR is set
    #[arg(long, global = true, value_name = "WHEN", value_enum, default_value_t)]
    color: Color,
}

#[derive(Debug, Subcommand)]
enum Command {
    Render(render::Args),
    Check(check::Args),
    Split(split::Args),
    Encode(encode::Args),
    #[cfg(feature = "network")]
    #[command(flatten)]
    Network(network::Command),
    Completions(completions::Args),
    Man(man::Args),
}

impl Command {
    fn run(self, console: &Console) -> anyhow::Result<Outcome> {
        match self {
            Self::Render(args) => render::run(&args, console),
            Self::Check(args) => check::run(&args, console),
            Self::Split(args) => split::run(&args, console),
            Self::Encode(args) => encode::run(&args, console),
            #[cfg(feature = "network")]
            Self::Network(command) => command.run(console),
            Self::Completions(args) => completions::run(&args, App::command(), console),
            Self::Man(args) => man::run(&args, App::command(), console),
        }
    }
}

/// Replaces a misleading tip: no argument may begin with a dash.
fn correct(error: &mut clap::Error) {
    if error.kind() != ErrorKind::UnknownArgument {
        return;
    }
    error.remove(ContextKind::Suggested);
    let is_json =
        matches!(error.get(ContextKind::InvalidArg), Some(ContextValue::String(name)) if name == "--json");
    if is_json {
        let tip = "the flag is '--format json', for commands that have it";
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip.into()]));
    }
}

/// Parses the arguments, runs the subcommand, and reports errors.
pub fn run(args: impl IntoIterator<Item = OsString>) -> ExitCode {
    let mut args: Vec<OsString> = args.into_iter().collect();
    if args.get(1).is_some_and(|command| command == "help") {
        // The help of `help` is the help of the arguments after it.
        args.retain(|arg| arg != "--help" && arg != "-h");
    }
    let app = match App::try_parse_from(args) {
        Ok(app) => app,
        Err(mut e) => {
            correct(&mut e);
            #[cfg(not(feature = "network"))]
            if let Some(message) = elsewhere::missing(&e) {
                let _ = writeln!(std::io::stderr(), "{message}");
                return ExitCode::from(2);
            }
            // Help and version go to standard output and are no failure.
            let printed = e.print().and_then(|()| std::io::stdout().flush());
            return ExitCode::from(match printed {
                _ if e.use_stderr() => 2,
                Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
                    let _ = writeln!(std::io::stderr(), "error: cannot write to standard output: {error}");
                    1
                }
                _ => 0,
            });
        }
    };
    let console = Console::resolve(app.global.quiet, app.global.color);
    let result =
        interrupt::listen(&console).map_err(anyhow::Error::new).and_then(|()| app.command.run(&console));
    match result {
        Ok(Outcome::Failed) if interrupt::signalled() => Outcome::Interrupted.into(),
        Ok(outcome) => outcome.into(),
        Err(_) if interrupt::signalled() => {
            console.note("interrupted");
            Outcome::Interrupted.into()
        }
        Err(error) => {
            console.error(&error);
            exit_code(&error)
        }
    }
}
