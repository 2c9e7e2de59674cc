//! The command line `sigmark`: sign 3D models, and find the signature again.
//!
//! [`run`] carries out one command and gives its exit code: 0 for yes, 1 for no, 2 if it could not be done, 130 after
//! Ctrl-C. What failed, where and what to do goes to standard error; results go to standard output.
//!
//! It is a library so that the program of this package and the command of the Python package are the same code.

mod args;
mod batch;
mod capacity;
mod claims;
mod commands;
pub mod figures;
mod files;
mod interrupt;
mod keys;
mod npz;
mod points;
mod progress;
mod report;
mod report_page;
mod stamps;
mod suspects;
mod usage;

use std::ffi::OsString;

use args::Command;
use commands::{
    align, compare, completions, dispute, embed, inspect, keygen, library, man, partition, spectrum, stamp,
    trace, verify,
};

/// What a command that was carried out has to say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Answer {
    /// Done; or, of a question: yes.
    Yes,
    /// The question was answered with no.
    No,
    /// Of several things some could not be done; why was said of each.
    Failed,
}

/// Carries out a command line, the program's name first. Takes over Ctrl-C when work begins: the process is to do nothing else.
pub fn run(command_line: impl IntoIterator<Item = OsString>) -> u8 {
    let command_line: Vec<OsString> = command_line.into_iter().collect();
    let arguments = match usage::parse(&command_line) {
        Ok(arguments) => arguments,
        Err(code) => return code,
    };
    let answer = match &arguments.command {
        Command::Keygen(arguments) => keygen::run(arguments),
        Command::Embed(arguments) => embed::run(arguments),
        Command::Verify(arguments) => verify::run(arguments),
        Command::Trace(arguments) => trace::run(arguments),
        Command::Library(arguments) => library::run(arguments),
        Command::Stamp(arguments) => stamp::run(arguments),
        Command::Dispute(arguments) => dispute::run(arguments),
        Command::Align(arguments) => align::run(arguments),
        Command::Compare(arguments) => compare::run(arguments),
        Command::Inspect(arguments) => inspect::run(arguments),
        Command::Spectrum(arguments) => spectrum::run(arguments),
        Command::Partition(arguments) => partition::run(arguments),
        Command::Completions(arguments) => completions::run(arguments),
        Command::Man(arguments) => man::run(arguments),
    };
    match answer {
        Ok(Answer::Yes) => 0,
        Ok(Answer::No) => 1,
        Ok(Answer::Failed) => 2,
        Err(_) if interrupt::is_asked_for() => {
            interrupt::say();
            interrupt::EXIT_CODE
        }
        Err(error) => {
            report::failure(&error);
            2
        }
    }
}
