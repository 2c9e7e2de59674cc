//! Several models, or folders of them, signed into one folder.

use std::path::PathBuf;

use anyhow::{Result, bail};
use serde_json::{Value, json};

use super::{Task, companions, embedder};
use crate::{
    Answer,
    args::Embed,
    batch::{self, Found},
    files, interrupt, keys,
    progress::Progress,
    report::{self, Lines},
};

/// Signs what can be signed, and says of everything else why it could not be.
pub(super) fn run(arguments: &Embed) -> Result<Answer> {
    let tasks = tasks(arguments)?;
    let embedder = embedder(arguments, &keys::read_private(&arguments.key)?)?;
    let (json, mut signed) = (arguments.common.json, 0);
    for (i, task) in tasks.iter().enumerate() {
        let progress = Progress::new();
        progress.number(i + 1, tasks.len());
        let done = task
            .prepare(arguments)
            .and_then(|()| task.sign(arguments, embedder.clone(), progress, false));
        match done {
            Ok(mut done) => {
                signed += 1;
                done.object["model"] = json!(task.model);
                report::print(json, &done.object, &told(task, done.seconds))?;
            }
            Err(error) if interrupt::is_asked_for() => return Err(error),
            Err(error) => failed(arguments, task, &error)?,
        }
    }
    if !json {
        report::print(json, &Value::Null, &summary(signed, tasks.len() - signed))?;
    }
    Ok(match signed == tasks.len() {
        true => Answer::Yes,
        false => Answer::Failed,
    })
}

/// Every model with its files under the folder of the outputs; refused where one would be written twice, or over what is read.
fn tasks(arguments: &Embed) -> Result<Vec<Task>> {
    let folder = &arguments.output;
    if folder.exists() && !folder.is_dir() {
        bail!(
            "{}: is a file; several models are signed into a folder, so give -o the name of one",
            folder.display()
        );
    }
    if arguments.certificate.is_some() {
        bail!("--certificate is for one model; of several, every certificate lies beside its signed copy");
    }
    let models = batch::meshes(&arguments.models, Some(folder))?;
    batch::check_apart(&models)?;
    let tasks: Vec<Task> = models
        .into_iter()
        .map(|model| task(folder.join(&model.relative), model))
        .collect();
    let inputs: Vec<PathBuf> = tasks.iter().map(|task| files::resolved(&task.model)).collect();
    for task in &tasks {
        if inputs.contains(&files::resolved(&task.output)) {
            bail!(
                "{}: is one of the models, which you need as they are to verify; choose another folder",
                task.output.display()
            );
        }
    }
    companions::check_apart(&tasks, &arguments.key)?;
    Ok(tasks)
}

fn task(output: PathBuf, model: Found) -> Task {
    Task {
        model: model.path,
        certificate: files::with_suffix(&output, ".cert.json"),
        output,
    }
}

impl Task {
    /// Makes the folder, and looks whether the files can be written.
    fn prepare(&self, arguments: &Embed) -> Result<()> {
        batch::make_folder_of(&self.output)?;
        self.check(arguments)
    }
}

fn failed(arguments: &Embed, task: &Task, error: &anyhow::Error) -> Result<()> {
    report::failure(error);
    match arguments.common.json {
        true => {
            let object = json!({ "model": task.model, "error": report::in_one_line(error) });
            report::print(true, &object, &Lines::new(""))
        }
        false => Ok(()),
    }
}

/// What was done, in a line.
fn told(task: &Task, seconds: f64) -> Lines {
    let [model, output, certificate] =
        [&task.model, &task.output, &task.certificate].map(|path| path.display());
    Lines::new(format!(
        "Signed {model}: {output} and {certificate} ({seconds:.2} s)"
    ))
}

fn summary(signed: usize, failed: usize) -> Lines {
    let mut lines = Lines::new(format!(
        "{} signed, {} failed",
        report::grouped(signed),
        report::grouped(failed)
    ));
    if signed > 0 {
        lines.line(
            "Keep the originals and the certificates: both are needed to verify, and whoever has both can remove the marks.",
        );
    }
    lines
}
