//! A copy, what stands where it belongs, and how it is written.

use std::{fs, path::Path, time::SystemTime};

use anyhow::{Context, Result, bail};
use mesh_io::Asset;
use sigmark::{PayloadKind, Prepared, Statement};

use super::super::{Attempt, Task, check_sound};
use crate::{
    batch, claims,
    files::{self, Output},
};

/// A copy for a recipient.
pub(in super::super) struct Copy {
    pub(in super::super) recipient: String,
    pub(in super::super) task: Task,
    pub(super) there: There,
}

/// What stands in the place of a copy.
pub(super) enum There {
    /// No certificate.
    Nothing,
    /// A mesh without a certificate, as an interrupted run leaves it.
    MeshAlone,
    /// A certificate, and whether the mesh is there with all that it refers to.
    Certificate { stated: Stated, has_mesh: bool },
    /// No certificate that can be read, and why not.
    Unreadable(anyhow::Error),
}

/// What a certificate states, beside what is to be stated.
pub(super) struct Stated {
    /// In what the two differ, however strong the mark is.
    other: Option<&'static str>,
    payload: PayloadKind,
    alphas: Vec<f64>,
}

impl There {
    pub(super) fn at(copy: &Copy, prepared: &Prepared, asset: &Asset) -> Self {
        let task = &copy.task;
        let is_there = |path: &Path| fs::symlink_metadata(path).is_ok();
        if !is_there(&task.certificate) {
            return match is_there(&task.output) {
                true => Self::MeshAlone,
                false => Self::Nothing,
            };
        }
        let mut companions = asset.companions();
        let has_mesh =
            is_there(&task.output) && companions.all(|(name, _)| is_there(&task.output.with_file_name(name)));
        match claims::read_certificate(&task.certificate) {
            Ok(certificate) => Self::Certificate {
                stated: Stated::of(certificate.statement(), prepared.statement_for(&copy.recipient)),
                has_mesh,
            },
            Err(error) => Self::Unreadable(error),
        }
    }
}

impl Stated {
    fn of(found: &Statement, expected: Statement) -> Self {
        let (payload, alphas) = (found.payload, found.alphas.clone());
        let other = if found.recipient != expected.recipient {
            Some("recipient")
        } else if found.message != expected.message {
            Some("message")
        } else if found.public_key != expected.public_key {
            Some("key")
        } else if found.original != expected.original {
            Some("original")
        } else {
            // These two follow from the strength, which is not settled yet.
            let alike = Statement {
                payload,
                alphas: alphas.clone(),
                ..expected
            };
            (*found != alike).then_some("mark")
        };
        Self {
            other,
            payload,
            alphas,
        }
    }

    fn is_of(&self, prepared: &Prepared) -> bool {
        let (payload, alphas) = (prepared.prediction().payload, prepared.layout().alphas());
        self.other.is_none() && self.payload == payload && self.alphas == alphas
    }
}

impl Copy {
    /// Whether its certificate says what a new one would.
    fn is_certified(&self, prepared: &Prepared) -> bool {
        matches!(&self.there, There::Certificate { stated, .. } if stated.is_of(prepared))
    }

    /// Whether it is there, by its certificate and the names of files: their contents are not looked at.
    pub(super) fn is_complete(&self, prepared: &Prepared) -> bool {
        matches!(self.there, There::Certificate { has_mesh: true, .. }) && self.is_certified(prepared)
    }

    /// Refuses what is no certificate of this copy, whatever the strength.
    pub(super) fn check_possible(&self) -> Result<()> {
        match &self.there {
            There::Unreadable(error) => bail!("{error:#}; or use --force to replace it"),
            There::Certificate { stated, .. } => stated.other.map_or(Ok(()), |what| self.refused(what)),
            There::Nothing | There::MeshAlone => Ok(()),
        }
    }

    /// Refuses what is not its certificate.
    pub(super) fn check(&self, prepared: &Prepared) -> Result<()> {
        match &self.there {
            There::Certificate { stated, .. } if !stated.is_of(prepared) => self.refused("mark"),
            _ => self.check_possible(),
        }
    }

    fn refused(&self, what: &str) -> Result<()> {
        bail!(
            "{}: is of a copy with another {what} than the one to be made for {}; use --force to replace both, or another folder",
            self.task.certificate.display(),
            self.recipient
        )
    }

    /// Writes what is missing of a copy: mesh and companions with the time of the model, so that nobody reads off them when they were made, then the
    /// certificate. Returns whether anything was.
    pub(super) fn write(&self, attempt: &Attempt, prepared: &Prepared, rules: &Rules) -> Result<bool> {
        let task = &self.task;
        check_sound(&attempt.read_back, &task.output)?;
        batch::make_folder_of(&task.output)?;
        let is_certified = self.is_certified(prepared);
        if !is_certified && rules.force {
            // It would say of another mesh that it is whole.
            remove(&task.certificate)?;
        }
        let is_written = self.write_mesh(attempt, rules)?;
        if is_certified {
            set_folder_time(files::folder_of(&task.output), rules.modified)?;
            return Ok(is_written);
        }
        let json = attempt.signed.certificate().to_json()?;
        let certificate = Output {
            path: &task.certificate,
            bytes: json.as_bytes(),
            private: true,
        };
        files::write_together(&[certificate], rules.force)?;
        set_folder_time(files::folder_of(&task.output), rules.modified)?;
        Ok(true)
    }

    fn write_mesh(&self, attempt: &Attempt, rules: &Rules) -> Result<bool> {
        let (task, mesh) = (&self.task, attempt.marked.to_bytes());
        let companions = task.companions(&attempt.marked)?;
        let companions = companions.iter();
        let mut outputs: Vec<Output<'_>> = companions
            .map(|(path, bytes)| Output::public((path, bytes)))
            .collect();
        match fs::read(&task.output) {
            // As an interrupted run left it.
            Ok(there) if there == *mesh => {}
            Ok(_) if !rules.force => bail!(
                "{}: is another mesh than the copy to be made; use --force to replace it, or another folder",
                task.output.display()
            ),
            _ => outputs.push(Output::public((&task.output, &mesh))),
        }
        files::write_together(&outputs, rules.force)?;
        for (name, _) in attempt.marked.companions() {
            set_time(&task.output.with_file_name(name), rules.modified)?;
        }
        set_time(&task.output, rules.modified)?;
        Ok(!outputs.is_empty())
    }
}

/// How copies are written.
pub(super) struct Rules {
    /// The time that they all have.
    pub(super) modified: SystemTime,
    /// Whether what stands there may be replaced.
    pub(super) force: bool,
}

fn remove(path: &Path) -> Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(error).with_context(|| format!("{}: can't be replaced", path.display()))
        }
        _ => Ok(()),
    }
}

/// A folder's own time would tell in which order copies were made, too.
#[cfg(unix)]
fn set_folder_time(folder: &Path, modified: SystemTime) -> Result<()> {
    let file = fs::File::open(folder);
    file.and_then(|file| file.set_modified(modified))
        .with_context(|| format!("{}: its time can't be set to that of the model", folder.display()))
}

/// Elsewhere a folder can't be opened as a file is.
#[cfg(not(unix))]
fn set_folder_time(_: &Path, _: SystemTime) -> Result<()> {
    Ok(())
}

fn set_time(path: &Path, modified: SystemTime) -> Result<()> {
    let file = fs::File::options().write(true).open(path);
    file.and_then(|file| file.set_modified(modified))
        .with_context(|| {
            format!(
                "{}: its time can't be set to that of the model; allow it with chmod",
                path.display()
            )
        })
}
