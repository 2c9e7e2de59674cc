//! The program `sigmark`. All of it is in the library beside this file.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(sigmark_cli::run(std::env::args_os()))
}
