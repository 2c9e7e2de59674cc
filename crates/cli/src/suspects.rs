//! Suspects, judged one after the other: what `verify` and `trace` have in common.

use std::{
    cell::Cell,
    path::{Path, PathBuf},
    sync::Arc,
};

use anyhow::Result;
use job::Job;
use mesh_io::Asset;
use serde_json::{Value, json};

use crate::{
    Answer,
    args::{Common, TimeLimit},
    batch::{self, Found},
    files::{self, Output},
    interrupt,
    progress::Progress,
    report::{self, Lines},
};

/// What is asked of every suspect.
pub(crate) trait Inquiry {
    /// What `--report` writes.
    type Page: ReportPage;

    /// Judges a suspect and prints the answer; tells whether it is yes.
    fn judge(&self, path: &Path, progress: &Arc<Progress>, page: Option<&mut Self::Page>) -> Result<bool>;
}

/// A page that grows by a section a suspect.
pub(crate) trait ReportPage {
    /// A suspect could not be judged.
    fn failed(&mut self, path: &Path, error: &str);

    /// The file.
    fn html(&self) -> String;
}

/// A run of a command over suspects.
pub(crate) struct Session<'a> {
    report: Option<&'a Path>,
    force: bool,
    time_limit: &'a TimeLimit,
    common: &'a Common,
    /// The first suspect's time begins with that of what all are compared with.
    first: Cell<Option<Arc<Progress>>>,
}

impl<'a> Session<'a> {
    /// Begins to read.
    pub(crate) fn begin(
        report: Option<&'a PathBuf>,
        force: bool,
        time_limit: &'a TimeLimit,
        common: &'a Common,
    ) -> Self {
        Self {
            report: report.map(PathBuf::as_path),
            force,
            time_limit,
            common,
            first: Cell::new(Some(Arc::new(begun(time_limit)))),
        }
    }

    /// A report can be written, and replaces none of the files that were named to be read.
    pub(crate) fn check_report(&self, named: &[(Option<&PathBuf>, &str)]) -> Result<()> {
        let Some(report) = self.report else {
            return Ok(());
        };
        for (input, what) in named {
            input.map_or(Ok(()), |input| files::check_apart(report, input, what))?;
        }
        files::check_free(report, self.force)
    }

    /// The report replaces none of the files of a mesh.
    pub(crate) fn check_apart_from(&self, path: &Path, what: &str, asset: &Asset) -> Result<()> {
        let Some(report) = self.report else {
            return Ok(());
        };
        files::check_apart(report, path, what)?;
        let part = format!("a part of {}", path.display());
        let mut companions = asset.companions();
        companions.try_for_each(|(name, _)| files::check_apart(report, &path.with_file_name(name), &part))
    }

    /// The report replaces none of these files.
    pub(crate) fn check_apart_from_all(&self, paths: &[PathBuf], what: &str) -> Result<()> {
        let Some(report) = self.report else {
            return Ok(());
        };
        paths
            .iter()
            .try_for_each(|path| files::check_apart(report, path, what))
    }

    /// The suspects that were named, or lie in folders that were.
    pub(crate) fn listed(&self, suspects: &[PathBuf]) -> Result<Vec<Found>> {
        let suspects = batch::meshes(suspects, None)?;
        let paths: Vec<PathBuf> = suspects.iter().map(|found| found.path.clone()).collect();
        self.check_apart_from_all(&paths, "a suspect")?;
        Ok(suspects)
    }

    /// What came of work that a time limit may have cut short.
    pub(crate) fn within_limit<T>(&self, result: Result<T>, job: &Job) -> Result<T> {
        result.map_err(|error| match job.is_cancelled() {
            true => self.time_limit.exceeded(),
            false => error,
        })
    }

    /// The same of work on a suspect.
    pub(crate) fn within_limit_at<T>(&self, suspect: &Path, result: Result<T>, job: &Job) -> Result<T> {
        result.map_err(|error| match job.is_cancelled() {
            true => self.time_limit.exceeded_at(suspect),
            false => error,
        })
    }

    /// Reads what all suspects are compared with.
    pub(crate) fn read<T>(&self, read: impl FnOnce(&Job) -> Result<T>) -> Result<T> {
        let progress = self.begun();
        let job = progress.job(self.common.threads());
        let read = self.within_limit(read(&job), &job);
        self.first.set(Some(progress));
        read
    }

    /// The first suspect's progress, which goes on, or that of another.
    fn begun(&self) -> Arc<Progress> {
        let another = || Arc::new(begun(self.time_limit));
        self.first.take().unwrap_or_else(another)
    }

    /// Judges all, writes the report, and counts where there were several: how many, after these words.
    pub(crate) fn judge<I: Inquiry>(
        &self,
        inquiry: &I,
        suspects: &[Found],
        mut page: Option<I::Page>,
        counted_as: &str,
    ) -> Result<Answer> {
        let (mut found, mut failed) = (0, 0);
        for (i, Found { path, .. }) in suspects.iter().enumerate() {
            let progress = self.begun();
            progress.number(i + 1, suspects.len());
            match inquiry.judge(path, &progress, page.as_mut()) {
                Ok(is_yes) => found += usize::from(is_yes),
                // The others may be what they may.
                Err(error) if suspects.len() > 1 && !interrupt::is_asked_for() => {
                    failed += 1;
                    drop(progress);
                    self.failed(path, &error, page.as_mut())?;
                }
                Err(error) => return Err(error),
            }
        }
        let total = total(counted_as, found, failed, suspects.len());
        self.conclude((suspects.len() > 1).then_some(total), page)?;
        Ok(match (failed, found) {
            (1.., _) => Answer::Failed,
            (0, 1..) => Answer::Yes,
            (0, 0) => Answer::No,
        })
    }

    /// Says of one of several suspects why it could not be judged.
    fn failed(&self, path: &Path, error: &anyhow::Error, page: Option<&mut impl ReportPage>) -> Result<()> {
        report::failure(error);
        let error = report::in_one_line(error);
        if let Some(page) = page {
            page.failed(path, &error);
        }
        match self.common.json {
            true => report::print(true, &json!({ "suspect": path, "error": error }), &Lines::new("")),
            false => Ok(()),
        }
    }

    /// Writes the report, if there is one, and says so after the total.
    fn conclude(&self, mut lines: Option<Lines>, page: Option<impl ReportPage>) -> Result<()> {
        if let (Some(path), Some(page)) = (self.report, page) {
            let html = page.html();
            // It says what the certificate does.
            let page = Output {
                path,
                bytes: html.as_bytes(),
                private: true,
            };
            files::write_together(&[page], self.force)?;
            let written = format!("The report is in {}", path.display());
            match &mut lines {
                Some(lines) => lines.line(written),
                None => lines = Some(Lines::new(written)),
            }
        }
        match lines.filter(|_| !self.common.json) {
            Some(lines) => report::print(false, &Value::Null, &lines),
            None => Ok(()),
        }
    }
}

fn begun(limit: &TimeLimit) -> Progress {
    let progress = Progress::within(limit.duration());
    progress.begin("reading", "reading");
    progress
}

fn total(counted_as: &str, found: usize, failed: usize, suspects: usize) -> Lines {
    let failed = match failed {
        0 => String::new(),
        failed => format!("; {} could not be judged", report::grouped(failed)),
    };
    let (found, suspects) = (report::grouped(found), report::grouped(suspects));
    Lines::new(format!("{counted_as} {found} of {suspects}{failed}"))
}
