//! What is timed of a mesh.

use std::{
    fmt,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result};
use evaluation::{process::output, python::Python};
use serde::{Deserialize, Serialize};

use super::{
    files::MeshFiles,
    program::{self, Report, Sigmark, Spent},
};
use crate::kept::{self, Key};

/// How marks are laid out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Layout {
    Default,
    /// Patches below 30 000 vertices, with 325 harmonics each; all of them are read.
    Paper,
}

impl Layout {
    /// What says so on the command line.
    fn words(self) -> &'static [&'static str] {
        match self {
            Self::Default => &[],
            Self::Paper => &["--profile", "paper"],
        }
    }

    /// What is verified of it; `least` is the share of the triangles, in per cent, that the strongest decimation leaves.
    fn verifications(self, least: u32) -> Vec<Work> {
        let decimated = [Work::Decimated(30), Work::Decimated(least)];
        match self {
            Self::Default => [Work::Untouched, Work::Moved]
                .into_iter()
                .chain(decimated)
                .collect(),
            Self::Paper => vec![Work::Untouched, Work::Decimated(30)],
        }
    }
}

impl fmt::Display for Layout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Default => "default",
            Self::Paper => "paper",
        })
    }
}

/// What the program is asked to do: to embed, or to verify a copy.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Work {
    Embed,
    Untouched,
    Moved,
    /// To so many per cent of its triangles.
    Decimated(u32),
}

impl fmt::Display for Work {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Embed => f.write_str("embed"),
            Self::Untouched => f.write_str("verify, untouched"),
            Self::Moved => f.write_str("verify, moved and in random order"),
            Self::Decimated(share) => write!(f, "verify, decimated to {share} %"),
        }
    }
}

/// What a command took, and what it said.
#[derive(Serialize, Deserialize)]
pub(super) struct Timed {
    pub(super) mesh: String,
    pub(super) vertices: usize,
    pub(super) layout: Layout,
    pub(super) work: Work,
    pub(super) answer: String,
    /// Those of the mark.
    pub(super) patches: usize,
    /// Those that were looked at; none where the program does not say.
    pub(super) patches_read: Option<usize>,
    pub(super) rounds: usize,
    pub(super) spent: Spent,
}

/// A mesh, and what its runs need.
pub(super) struct MeshRuns<'a> {
    pub(super) program: &'a Sigmark,
    pub(super) attacks: &'a Python,
    /// Where finished figures are kept.
    pub(super) figures: &'a Path,
    pub(super) name: String,
    /// What tells the code and the mesh from others.
    pub(super) key: String,
    pub(super) vertices: usize,
    pub(super) files: MeshFiles,
    pub(super) rounds: usize,
    /// The share of the triangles, in per cent, that the strongest decimation leaves.
    pub(super) least: u32,
}

impl MeshRuns<'_> {
    /// All commands with these layouts, in the order of the table.
    pub(super) fn all(&self, layouts: &[Layout]) -> Result<Vec<Timed>> {
        let mut all = Vec::new();
        for &layout in layouts {
            // Copies are made of what it wrote.
            let has_written = |_: &Timed| {
                let written = [self.files.marked(layout), self.files.certificate(layout)];
                written.iter().all(|path| path.is_file())
            };
            let key = self.key_of(layout, Work::Embed);
            let embedded = kept::figures_if(self.figures, &key, has_written, || self.embed(layout))?;
            let patches = embedded.patches;
            all.push(embedded);
            for work in layout.verifications(self.least) {
                let key = self.key_of(layout, work);
                all.push(kept::figures(self.figures, &key, || {
                    self.verify(layout, work, patches)
                })?);
            }
        }
        Ok(all)
    }

    /// By which figures are kept.
    fn key_of(&self, layout: Layout, work: Work) -> Key {
        let work = work.to_string().replace([',', '%'], "");
        let work: Vec<&str> = work.split_whitespace().collect();
        let words = format!("{}-{layout}-{}-{}", self.name, work.join("-"), self.rounds);
        Key::new(words).of(self.key.as_bytes())
    }

    fn embed(&self, layout: Layout) -> Result<Timed> {
        let mut command = self.program.command("embed");
        command.arg(self.files.model()).args(layout.words());
        command.arg("--key").arg(self.key(layout)?);
        command.arg("--output").arg(self.files.marked(layout));
        // Of a round before.
        command.arg("--force");
        let (report, spent) = program::run(&mut command, self.rounds)?;
        let patches = report
            .patches
            .context("the program does not say how many patches there are")?;
        self.timed(layout, Work::Embed, patches, &report, spent)
    }

    fn verify(&self, layout: Layout, work: Work, patches: usize) -> Result<Timed> {
        let suspect = self.files.suspect(layout, work, self.attacks)?;
        let mut command = self.program.command("verify");
        command.arg(suspect).args(layout.words());
        command.arg("--certificate").arg(self.files.certificate(layout));
        command.arg("--original").arg(self.files.model());
        let (report, spent) = program::run(&mut command, self.rounds)?;
        self.timed(layout, work, patches, &report, spent)
    }

    /// A private key for marks of this layout: the same ever after, so that the same code writes the same marks.
    fn key(&self, layout: Layout) -> Result<PathBuf> {
        let key = kept::folder("seconds/keys")?.join(format!("{layout}.pem"));
        if !key.is_file() {
            let mut keygen = self.program.command("keygen");
            output(keygen.args(layout.words()).arg("--output").arg(&key))?;
        }
        Ok(key)
    }

    /// Put together, and told.
    fn timed(
        &self,
        layout: Layout,
        work: Work,
        patches: usize,
        report: &Report,
        spent: Spent,
    ) -> Result<Timed> {
        let timed = Timed {
            mesh: self.name.clone(),
            vertices: self.vertices,
            layout,
            work,
            answer: answer(report),
            patches,
            patches_read: report.patches_read,
            rounds: self.rounds,
            spent,
        };
        println!("{}", serde_json::to_string(&timed)?);
        Ok(timed)
    }
}

/// The outcome of a verification, with the share of the bits where that is not all that is to be said.
fn answer(report: &Report) -> String {
    match (report.outcome.as_deref(), report.extraction_rate) {
        (None, _) => "signed".into(),
        (Some("detected"), Some(rate)) => format!("detected, {:.1} % of the bits", 100.0 * rate),
        (Some(outcome), _) => outcome.replace('_', " "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reports_are_understood_whether_or_not_they_say_what_was_read() {
        let report = |text| serde_json::from_str::<Report>(text).unwrap();
        let embedded = report(r#"{"patches":11,"bits":512}"#);
        assert_eq!(
            (answer(&embedded).as_str(), embedded.patches),
            ("signed", Some(11))
        );
        let detected = report(r#"{"outcome":"detected","extraction_rate":0.9141,"patches_read":4}"#);
        assert_eq!(answer(&detected), "detected, 91.4 % of the bits");
        assert_eq!(detected.patches_read, Some(4));
        let lost = report(r#"{"outcome":"not_found","extraction_rate":null}"#);
        assert_eq!((answer(&lost).as_str(), lost.patches_read), ("not found", None));
    }
}
