//! Files to which models refer by name, and of which copies go beside the outputs: what these may not replace.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Result, bail};

use super::Task;
use crate::{batch, files};

/// A file beside a model, and where its copy goes.
struct Companion<'a> {
    task: &'a Task,
    name: String,
    source: PathBuf,
    target: PathBuf,
    /// Whether it may hold positions, so that the copy is another file.
    changes: bool,
}

/// Refuses copies that would replace what is read, another output, or each other. Copies that are the same may be one. A model that can't be
/// read has none here, and why is said when its turn comes.
pub(super) fn check_apart(tasks: &[Task], key: &Path) -> Result<()> {
    let named = |task: &Task| mesh_io::companions_of(&task.model).unwrap_or_default();
    let companions: Vec<Companion<'_>> = tasks
        .iter()
        .flat_map(|task| companions(task, named(task)))
        .collect();
    let inputs = inputs(tasks, &companions, key);
    for companion in &companions {
        companion.check_source(key)?;
        companion.check_inputs(&inputs)?;
        companion.check_outputs(tasks)?;
    }
    let key = |companion: &Companion<'_>| batch::name_key(&files::resolved(&companion.target));
    let mut sorted: Vec<(PathBuf, &Companion<'_>)> = companions.iter().map(|c| (key(c), c)).collect();
    sorted.sort_by(|(a, _), (b, _)| a.cmp(b));
    for pair in sorted.windows(2) {
        if let [(target, first), (other, second)] = pair
            && target == other
            && (first.changes || second.changes || !same_content(&first.source, &second.source))
        {
            bail!(
                "{} and {} would both write {}, and not the same; sign them into two folders, or save them as GLB",
                first.task.model.display(),
                second.task.model.display(),
                first.target.display()
            );
        }
    }
    Ok(())
}

/// The same for copies of one model, each in a folder of its own, so that they can't meet.
pub(super) fn check_copies<'a>(
    tasks: impl Iterator<Item = &'a Task>,
    model: &Path,
    key: &Path,
) -> Result<()> {
    let named = mesh_io::companions_of(model).unwrap_or_default();
    for task in tasks {
        let (companions, task) = (companions(task, named.clone()), std::slice::from_ref(task));
        let inputs = inputs(task, &companions, key);
        for companion in &companions {
            companion.check_source(key)?;
            companion.check_inputs(&inputs)?;
            companion.check_outputs(task)?;
        }
    }
    Ok(())
}

/// What is read, by its real path.
fn inputs(tasks: &[Task], companions: &[Companion<'_>], key: &Path) -> Vec<PathBuf> {
    let models = tasks.iter().map(|task| &*task.model);
    let sources = companions.iter().map(|companion| &*companion.source);
    models.chain(sources).chain([key]).map(files::resolved).collect()
}

/// Those that are there: what is missing was missing before.
fn companions(task: &Task, named: Vec<mesh_io::Companion>) -> Vec<Companion<'_>> {
    let companions = named.into_iter().map(|companion| Companion {
        task,
        source: task.model.with_file_name(&companion.name),
        target: task.output.with_file_name(&companion.name),
        name: companion.name,
        changes: companion.is_buffer,
    });
    companions
        .filter(|companion| companion.source.is_file())
        .collect()
}

impl Companion<'_> {
    /// A model of a stranger could name the key, a copy of which would go to whoever gets the signed model.
    fn check_source(&self, key: &Path) -> Result<()> {
        if files::resolved(&self.source) == files::resolved(key) {
            bail!(
                "{}: refers to {}, which is the private key; keep the key in a folder of its own, and mind where this model is from",
                self.task.model.display(),
                self.source.display()
            );
        }
        Ok(())
    }

    fn check_inputs(&self, inputs: &[PathBuf]) -> Result<()> {
        let target = files::resolved(&self.target);
        // What is the same already is not written.
        let is_written = self.changes || !same_content(&self.source, &self.target);
        if !is_written || !inputs.contains(&target) {
            return Ok(());
        }
        let (output, name) = (self.task.output.display(), &self.name);
        if target == files::resolved(&self.source) {
            bail!(
                "{output}: the model refers to {name}, which would change; write to another folder, or save the model as GLB"
            );
        }
        bail!(
            "{output}: the copy of {} would replace {}, which is read; choose another folder",
            self.source.display(),
            self.target.display()
        );
    }

    fn check_outputs(&self, tasks: &[Task]) -> Result<()> {
        let key = |path: &Path| batch::name_key(&files::resolved(path));
        let target = key(&self.target);
        let outputs = tasks.iter().flat_map(|task| [&task.output, &task.certificate]);
        for output in outputs {
            if key(output) == target {
                bail!(
                    "{}: the copy of {} would have this name, too; choose another",
                    output.display(),
                    self.source.display()
                );
            }
        }
        Ok(())
    }
}

/// Whether two files that can be read hold the same.
fn same_content(a: &Path, b: &Path) -> bool {
    let size = |path: &Path| fs::metadata(path).map(|metadata| metadata.len()).ok();
    files::resolved(a) == files::resolved(b)
        || size(a).is_some() && size(a) == size(b) && fs::read(a).ok() == fs::read(b).ok()
}
