//! The pathtracer program.

use std::process::ExitCode;

fn main() -> ExitCode {
    pt_cli::program(std::env::args_os())
}
