//! Distances between surfaces (eq. 21) by ours and by MeshLab's filter.

use std::ffi::OsStr;

use anyhow::Result;
use evaluation::{python::Python, table::Table};
use job::Job;
use quality::{DistanceOptions, SurfaceDistance, surface_distance};
use serde::{Deserialize, Serialize};

use super::inputs::SharedMesh;
use crate::{
    kept::Key,
    measure::{greatest, median, timed_in_rounds},
};

/// One pair of meshes, measured by both.
pub(crate) struct ComparedDistance {
    name: String,
    pub(crate) ours: SurfaceDistance,
    diagonal: f64,
    cpu: f64,
    pub(crate) theirs: Option<FilterReport>,
}

/// What the filter says, as `peers/quality.py` prints it.
#[derive(Serialize, Deserialize)]
pub(crate) struct FilterReport {
    rms: f64,
    mean: f64,
    max: f64,
    samples: f64,
    cpu: f64,
}

impl ComparedDistance {
    /// From the distorted mesh to the original; times are medians over the rounds.
    pub(crate) fn of(
        distorted: &SharedMesh,
        original: &SharedMesh,
        python: Option<&Python>,
        rounds: usize,
    ) -> Result<Self> {
        let (options, job) = (DistanceOptions::default(), Job::default());
        let measure = || surface_distance(&distorted.mesh, &original.mesh, &options, &job);
        let (ours, cpu) = timed_in_rounds(rounds, measure)?;
        Ok(Self {
            name: distorted.name.clone(),
            diagonal: original.mesh.bounding_box().diagonal(),
            cpu,
            theirs: python
                .map(|python| filter(python, distorted, original, &ours, rounds))
                .transpose()?,
            ours,
        })
    }

    /// Our CPU time over theirs.
    pub(crate) fn ratio(&self) -> Option<f64> {
        self.theirs.as_ref().map(|theirs| self.cpu / theirs.cpu)
    }

    /// The largest relative difference between theirs and ours.
    pub(crate) fn difference(&self) -> Option<f64> {
        let (theirs, ours) = (self.theirs.as_ref()?, &self.ours);
        let figures = [
            (theirs.rms, ours.rmse),
            (theirs.mean, ours.mean),
            (theirs.max, ours.maximum),
        ];
        let differences = figures.map(|(theirs, ours)| (theirs / ours - 1.0).abs());
        Some(greatest(differences))
    }

    /// A line of progress.
    pub(crate) fn words(&self) -> String {
        let cent = |length: f64| 100.0 * length / self.diagonal;
        let theirs = self.theirs.as_ref();
        let theirs = theirs.map(|t| format!("; MeshLab {:.5} %, CPU {:.2} s", cent(t.rms), t.cpu));
        format!(
            "{}: d_rmse {:.5} %, CPU {:.2} s{}",
            self.name,
            cent(self.ours.rmse),
            self.cpu,
            theirs.unwrap_or_default(),
        )
    }
}

/// MeshLab's filter with as many samples as the interval asks for: area / interval². Medians over the rounds.
fn filter(
    python: &Python,
    from: &SharedMesh,
    to: &SharedMesh,
    ours: &SurfaceDistance,
    rounds: usize,
) -> Result<FilterReport> {
    let samples = (ours.area / ours.interval.powi(2)).round();
    let round = |round: usize| {
        let samples = samples.to_string();
        let [from_folder, to_folder] = [from, to].map(|mesh| mesh.folder.as_os_str());
        let arguments = [OsStr::new("hausdorff"), from_folder, to_folder, samples.as_ref()];
        let key = Key::new(format!("hausdorff-{samples}-{round}")).of_mesh(&to.mesh);
        from.asked(python, &key, &arguments)
    };
    let reports: Vec<FilterReport> = (0..rounds).map(round).collect::<Result<_>>()?;
    let figure = |of: fn(&FilterReport) -> f64| median(reports.iter().map(of));
    Ok(FilterReport {
        rms: figure(|report| report.rms),
        mean: figure(|report| report.mean),
        max: figure(|report| report.max),
        samples: figure(|report| report.samples),
        cpu: figure(|report| report.cpu),
    })
}

/// Two lines a pair: ours, and MeshLab's.
pub(crate) fn table(pairs: &[ComparedDistance]) -> Table {
    let header = "pair | who | samples | d_rmse (%) | mean (%) | Hausdorff, forward (%) | largest difference (%) | CPU (s) | CPU / theirs";
    let mut table = Table::new("Distances", header.split(" | "));
    for pair in pairs {
        let cent = |length: f64| format!("{:.6}", 100.0 * length / pair.diagonal);
        let shown = |figure: Option<f64>| figure.map_or_else(String::new, |x| format!("{x:.3}"));
        let ours = &pair.ours;
        table.row([
            pair.name.clone(),
            "ours".into(),
            ours.samples.to_string(),
            cent(ours.rmse),
            cent(ours.mean),
            cent(ours.maximum),
            String::new(),
            format!("{:.2}", pair.cpu),
            shown(pair.ratio()),
        ]);
        let Some(theirs) = &pair.theirs else { continue };
        table.row([
            pair.name.clone(),
            "MeshLab".into(),
            theirs.samples.to_string(),
            cent(theirs.rms),
            cent(theirs.mean),
            cent(theirs.max),
            shown(pair.difference().map(|difference| 100.0 * difference)),
            format!("{:.2}", theirs.cpu),
            String::new(),
        ]);
    }
    table
}
