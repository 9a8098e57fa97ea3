//! The pathtracer program.

#![deny(clippy::print_stdout, clippy::print_stderr, reason = "they panic if their reader has gone")]

#[macro_use]
mod message;

mod args;
mod check;
mod commands;
mod config;
mod console;
mod convert;
mod course;
mod cpu;
mod denoise;
mod describe;
mod environment;
mod examine;
mod explain;
mod fault;
mod formats;
mod info;
mod keeping;
mod light_groups;
mod limits;
mod loading;
mod lock;
mod machine;
mod merge;
mod opacity;
mod output;
mod render;
mod rerender;
mod resume;
mod seal;
mod sort;
mod summary;
mod target;
mod tev;
mod trust;

use std::process::ExitCode;

use commands::Command;

/// Exit status of wrong arguments, files and environments.
const FAILURE: u8 = 2;

fn main() -> ExitCode {
    pathtracer::memory::return_large_arrays();
    fault::silence();
    fault::guarded(run)
}

/// The program, but for its faults.
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
        args::Action::Render(request) => render::run(&request),
        args::Action::Command(Command::Resume(resume)) => resume::run(&resume),
        args::Action::Command(Command::Merge(merge)) => merge::run(&merge),
        args::Action::Command(Command::Info(info)) => info::run(&info),
        args::Action::Command(Command::Check(check)) => examine::run(&check),
        args::Action::Command(Command::Rerender(rerender)) => rerender::run(&rerender),
        args::Action::Command(Command::Explain(explain)) => explain::run(*explain),
        args::Action::Command(Command::Convert(convert)) => convert::run(&convert),
    };
    done.unwrap_or_else(|error| {
        report!("pathtracer: {}", message::of_error(&error));
        ExitCode::from(FAILURE)
    })
}
