use anyhow::Result;
use clap::CommandFactory;

use crate::{
    Answer,
    args::{Arguments, Completions},
    report,
};

pub(crate) fn run(arguments: &Completions) -> Result<Answer> {
    let mut script = Vec::new();
    let mut command = Arguments::command();
    let name = command.get_name().to_string();
    clap_complete::generate(arguments.shell, &mut command, name, &mut script);
    report::write(&script)?;
    Ok(Answer::Yes)
}
