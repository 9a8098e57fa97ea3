//! The program `pathtracer` as a library: [`program`] runs it, and [`RenderRequest`] resolves its
//! options for scenes in memory.

#![deny(clippy::print_stdout, clippy::print_stderr, reason = "they panic if their reader has gone")]

#[macro_use]
mod message;

mod arg_values;
mod args;
mod checkpointing;
mod command_args;
mod command_line;
mod commands;
mod compat;
mod config;
mod console;
mod cpu;
mod crop;
mod denoise;
mod environment;
mod film_commands;
mod film_header;
mod hints;
mod image_commands;
mod image_options;
mod job;
mod keywords;
mod limits;
mod loading;
mod lock;
mod machine;
mod opacity;
#[cfg(test)]
mod options_page;
mod origin;
mod output;
mod output_pattern;
mod panic;
mod parse;
mod parts;
mod policies;
mod provenance;
mod request;
mod resolve;
mod seal;
mod sequence_args;
mod settings;
mod sort;
mod stop_options;
mod summary;
mod targets;
mod tev;
mod trust;
mod views;

use std::ffi::OsString;
use std::process::ExitCode;

use command_args::Command;
pub use commands::explain::{PixelRequest, explain};
pub use film_commands::{CommandError, FilmImage, merge, rerender, resume, view_numbers};
pub use image_commands::{ImageFiles, denoise, develop, join};
pub use origin::SceneOrigin;
pub use parts::{ClusterCommand, FilmKeeper, cluster_commands};
pub use provenance::{denoised, provenance};
pub use request::{
    Keyword, PreparedRender, Purpose, RenderRequest, SaveRequest, Side, Words, keywords,
};

/// Exit status for invalid arguments, files and environments.
const FAILURE: u8 = 2;

/// Runs the program with its arguments, the first of which is its name, and returns its exit
/// status. Panics are reported as internal errors.
pub fn program(args: impl IntoIterator<Item = OsString>) -> ExitCode {
    pathtracer::memory::return_large_arrays();
    panic::silence();
    panic::guarded(|| run(args))
}

/// Runs the program; panics are handled by the caller.
fn run(args: impl IntoIterator<Item = OsString>) -> ExitCode {
    if let Err(message) = cpu::check() {
        report!("error: {message}");
        return ExitCode::from(FAILURE);
    }
    let action = match command_line::parse(args) {
        Ok(action) => action,
        Err(error) => return error.report(),
    };
    if !matches!(action, command_line::Action::Print(_))
        && let Err(error) = config::read()
    {
        report!("error: {error:#}");
        return ExitCode::from(FAILURE);
    }
    limits::watch();
    let done = match action {
        command_line::Action::Print(text) => output::print_as_is(&text),
        command_line::Action::Render(job) => commands::render::run(*job),
        command_line::Action::Sequence(cli, words) => commands::sequence::run(&cli, &words),
        command_line::Action::Command(Command::Resume(resume)) => commands::resume::run(&resume),
        command_line::Action::Command(Command::Merge(merge)) => commands::merge::run(&merge),
        command_line::Action::Command(Command::Info(info)) => commands::info_image::run(&info),
        command_line::Action::Command(Command::Check(check)) => commands::check::run(&check),
        command_line::Action::Command(Command::Rerender(rerender)) => {
            commands::rerender::run(&rerender)
        }
        command_line::Action::Command(Command::Explain(explain)) => {
            commands::explain::run(*explain)
        }
        command_line::Action::Command(Command::Convert(convert)) => {
            commands::convert::run(&convert)
        }
        command_line::Action::Command(Command::Develop(develop)) => {
            commands::develop::run(&develop)
        }
        command_line::Action::Command(Command::Denoise(denoise)) => {
            commands::denoise::run(&denoise)
        }
        command_line::Action::Command(Command::Join(join)) => commands::join::run(&join),
    };
    done.unwrap_or_else(|error| {
        message::report_error(&error);
        hints::report_for(&error);
        ExitCode::from(FAILURE)
    })
}
