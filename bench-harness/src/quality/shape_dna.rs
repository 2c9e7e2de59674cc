//! Shape-DNA, the lowest eigenvalues with the full mass matrix (eqs. 22–24), by ours and by the peers.

use std::ffi::OsString;

use anyhow::{Context, Result, ensure};
use evaluation::{python::Python, table::Table};
use job::Job;
use quality::{ShapeDna, ShapeDnaOptions};
use serde::{Deserialize, Serialize};

use super::inputs::SharedMesh;
use crate::{
    kept,
    measure::{median, timed},
};

/// Eigenvalues of a Shape-DNA: those of d_{2,50}.
pub(crate) const COUNT: usize = 50;

/// As they stand in the tables, and as `peers/quality.py` calls them.
pub(crate) const PEERS: [(&str, &str); 2] = [("scipy", "scipy"), ("LaPy", "lapy")];

/// Eigenvalues of one mesh by everyone.
pub(crate) struct ComparedSpectra {
    name: String,
    vertices: usize,
    cpu: f64,
    pub(crate) peers: Vec<ComparedPeer>,
}

/// A peer beside ours.
#[derive(Debug)]
pub(crate) struct ComparedPeer {
    pub(crate) name: &'static str,
    cpu: f64,
    /// CPU time over ours.
    pub(crate) ratio: f64,
    /// The largest relative difference of an eigenvalue from ours.
    pub(crate) difference: f64,
}

/// What `peers/quality.py` prints.
#[derive(Serialize, Deserialize)]
struct SpectrumReport {
    eigenvalues: Vec<f64>,
    cpu: f64,
}

impl ComparedSpectra {
    /// Our times are medians over the rounds; the peers are asked once.
    pub(crate) fn of(mesh: &SharedMesh, python: Option<&Python>, rounds: usize) -> Result<Self> {
        let options = ShapeDnaOptions {
            count: COUNT,
            ..Default::default()
        };
        let measure = || timed(|| ShapeDna::of(&mesh.mesh, &options, &Job::default()));
        let (ours, first) = measure();
        let more = (1..rounds).map(|_| measure().1);
        let cpu = median([first].into_iter().chain(more).map(|cost| cost.cpu));
        let ours = ours?;
        let beside = |python| {
            PEERS.map(|(name, script)| {
                let report = asked(python, script, mesh)?;
                ComparedPeer::of(name, &report, ours.eigenvalues(), cpu)
            })
        };
        let peers = python.into_iter().flat_map(beside);
        Ok(Self {
            name: mesh.name.clone(),
            vertices: mesh.mesh.vertex_count(),
            cpu,
            peers: peers.collect::<Result<_>>()?,
        })
    }

    /// A line of progress.
    pub(crate) fn words(&self) -> String {
        let peers: String = self
            .peers
            .iter()
            .map(|peer| {
                format!(
                    "; {} {:.2} s, off by {:.1e}",
                    peer.name, peer.cpu, peer.difference
                )
            })
            .collect();
        format!("{}: Shape-DNA CPU {:.2} s{peers}", self.name, self.cpu)
    }
}

impl ComparedPeer {
    fn of(name: &'static str, report: &SpectrumReport, ours: &[f64], our_cpu: f64) -> Result<Self> {
        let theirs = &report.eigenvalues;
        ensure!(
            theirs.len() == ours.len(),
            "{name}: {} eigenvalues instead of {}",
            theirs.len(),
            ours.len()
        );
        let differences = theirs
            .iter()
            .zip(ours)
            .map(|(theirs, ours)| (theirs / ours - 1.0).abs());
        // What is no number must show, so it may not be lost in a maximum.
        let worst = |most: f64, difference: f64| {
            if difference.is_nan() {
                f64::INFINITY
            } else {
                most.max(difference)
            }
        };
        Ok(Self {
            name,
            cpu: report.cpu,
            ratio: report.cpu / our_cpu,
            difference: differences.fold(0.0, worst),
        })
    }
}

/// What a peer says, once.
fn asked(python: &Python, script: &str, mesh: &SharedMesh) -> Result<SpectrumReport> {
    kept::figures(&mesh.folder, script, || {
        let arguments: [OsString; 3] = [
            script.into(),
            mesh.folder.clone().into(),
            COUNT.to_string().into(),
        ];
        let report = python.run("quality.py", arguments)?;
        serde_json::from_str(&report).context("the report of quality.py")
    })
}

/// A line for everyone on each mesh.
pub(crate) fn table(spectra: &[ComparedSpectra]) -> Table {
    let header = [
        "mesh",
        "n",
        "who",
        "CPU (s)",
        "CPU / ours",
        "largest difference of an eigenvalue",
    ];
    let mut table = Table::new("Shape-DNA", &header);
    for mesh in spectra {
        let mut row = |who: &str, cpu: f64, beside: [String; 2]| {
            let first = [mesh.name.clone(), mesh.vertices.to_string()];
            let own = [who.into(), format!("{cpu:.2}")];
            table.row(first.into_iter().chain(own).chain(beside));
        };
        row("ours", mesh.cpu, [String::new(), String::new()]);
        for peer in &mesh.peers {
            let beside = [format!("{:.1}", peer.ratio), format!("{:.1e}", peer.difference)];
            row(peer.name, peer.cpu, beside);
        }
    }
    table
}
