//! The pathtracer program.

#![deny(clippy::print_stdout, clippy::print_stderr, reason = "they panic if their reader has gone")]

#[macro_use]
mod message;

mod arg_values;
mod args;
mod checkpointing;
mod commands;
mod config;
mod console;
mod course;
mod cpu;
mod denoise;
mod environment;
mod image_options;
mod light_groups;
mod limits;
mod loading;
mod lock;
mod machine;
mod opacity;
mod output;
mod panic;
mod resolve;
mod seal;
mod sort;
mod stop_options;
mod summary;
mod tev;
mod trust;

use std::process::ExitCode;

use commands::Command;

/// Exit status for invalid arguments, files and environments.
const FAILURE: u8 = 2;

fn main() -> ExitCode {
    pathtracer::memory::return_large_arrays();
    panic::silence();
    panic::guarded(run)
}

/// Runs the program; panics are handled by the caller.
fn run() -> ExitCode {
    if let Err(message) = cpu::check() {
        report!("pathtracer: {message}");
        return ExitCode::from(FAILURE);
    }
    let action = match args::parse(std::env::args_os()) {
        Ok(action) => action,
        Err(error) => return error.report(),
    };
    if !matches!(action, args::Action::Print(_))
        && let Err(error) = config::read()
    {
        report!("pathtracer: {error:#}");
        return ExitCode::from(FAILURE);
    }
    limits::watch();
    let done = match action {
        args::Action::Print(text) => output::print_as_is(&text),
        args::Action::Render(request) => commands::render::run(&request),
        args::Action::Command(Command::Resume(resume)) => commands::resume::run(&resume),
        args::Action::Command(Command::Merge(merge)) => commands::merge::run(&merge),
        args::Action::Command(Command::Info(info)) => commands::info_image::run(&info),
        args::Action::Command(Command::Check(check)) => commands::check::run(&check),
        args::Action::Command(Command::Rerender(rerender)) => commands::rerender::run(&rerender),
        args::Action::Command(Command::Explain(explain)) => commands::explain::run(*explain),
        args::Action::Command(Command::Convert(convert)) => commands::convert::run(&convert),
    };
    done.unwrap_or_else(|error| {
        report!("pathtracer: {}", message::of_error(&error));
        ExitCode::from(FAILURE)
    })
}
