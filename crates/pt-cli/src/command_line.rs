//! From the arguments of the program to what it does.

use std::ffi::OsString;
use std::io::ErrorKind;
use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches, Parser};

use crate::args::Cli;
use crate::command_args::Command;
use crate::job::RenderJob;
use crate::resolve::{self, EarlierRun};
use crate::{message, sort};

/// Parsed command line.
pub(crate) enum Action {
    /// Print a text.
    Print(Vec<u8>),
    /// Render an image.
    Render(Box<RenderJob>),
    /// Render several images with these options, which are those of the arguments.
    Sequence(Box<Cli>, Vec<String>),
    /// Run one of the other commands.
    Command(Command),
}

/// Reason for which a command line is rejected.
pub(crate) enum ArgsError {
    /// Result of the parser: an error, or help or version, which are no errors.
    Clap(clap::Error),
    /// Message of a check that the parser does not make.
    Message(String),
}

impl ArgsError {
    /// Prints the error, the help or the version, and returns the exit status.
    pub(crate) fn report(&self) -> ExitCode {
        match self {
            Self::Clap(error) if !error.use_stderr() => {
                return match error.print() {
                    Err(e) if e.kind() != ErrorKind::BrokenPipe => {
                        report!("error: cannot print: {e}");
                        ExitCode::from(crate::FAILURE)
                    }
                    _ => ExitCode::SUCCESS,
                };
            }
            Self::Clap(error) => report!("error: {}", message::of_parser(error)),
            Self::Message(message) => report!("error: {message}"),
        }
        report!("help: pathtracer --help lists all options");
        ExitCode::from(crate::FAILURE)
    }
}

/// Reads the command line.
///
/// # Errors
/// If the command line is invalid; also for help and version.
pub(crate) fn parse(args: impl IntoIterator<Item = OsString>) -> Result<Action, ArgsError> {
    let args: Vec<_> = args.into_iter().collect();
    let name = args.get(1).and_then(|first| first.to_str());
    if name.is_some_and(Command::is_one) {
        let command = Command::try_parse_from(args).map_err(ArgsError::Clap)?;
        return Ok(Action::Command(command));
    }
    let (cli, command) = options(args)?;
    if let Some(shell) = cli.completions {
        return Ok(Action::Print(completions(shell)));
    }
    if cli.man {
        return man_page().map(Action::Print).map_err(ArgsError::Message);
    }
    if cli.sequence.is_requested() {
        return Ok(Action::Sequence(Box::new(cli), command));
    }
    let job = resolved(cli, command).map_err(ArgsError::Message)?;
    Ok(Action::Render(Box::new(job)))
}

/// Parses the options of a render, and returns them with their arguments.
fn options(mut args: Vec<OsString>) -> Result<(Cli, Vec<String>), ArgsError> {
    if args.get(1).is_some_and(|first| first == "render") {
        args.remove(1);
    }
    let command = args.iter().skip(1).map(|arg| arg.to_string_lossy().into_owned()).collect();
    let matches = Cli::command().try_get_matches_from(args).map_err(ArgsError::Clap)?;
    let cli = Cli::from_arg_matches(&matches).map_err(ArgsError::Clap)?;
    Ok((cli, command))
}

/// Parses the options of a render from the arguments of an earlier one; `None` if this version does
/// not support them.
pub(crate) fn stored_options(arguments: &[String]) -> Option<Cli> {
    let name = std::iter::once("pathtracer".into());
    let (mut cli, _) = options(name.chain(arguments.iter().map(Into::into)).collect()).ok()?;
    sort::paths(&mut cli).ok()?;
    sort::cameras(&mut cli).ok()?;
    (cli.completions.is_none() && !cli.man).then_some(cli)
}

/// Resolves the options of a render; `command` contains the arguments.
///
/// # Errors
/// A message if the options are invalid.
pub(crate) fn resolved(mut cli: Cli, command: Vec<String>) -> Result<RenderJob, String> {
    sort::paths(&mut cli)?;
    sort::cameras(&mut cli)?;
    resolve::resolve(cli, command, EarlierRun::default())
}

fn completions(shell: clap_complete::Shell) -> Vec<u8> {
    let mut text = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "pathtracer", &mut text);
    text
}

fn man_page() -> Result<Vec<u8>, String> {
    let mut text = Vec::new();
    let written = clap_mangen::Man::new(Cli::command()).render(&mut text);
    written.map(|()| text).map_err(|e| format!("cannot create the man page: {e}"))
}
