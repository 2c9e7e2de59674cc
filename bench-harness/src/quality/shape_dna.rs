//! Shape-DNA, the lowest eigenvalues with the full mass matrix (eqs. 22–24), by ours and by the peers.

use std::ffi::OsStr;

use anyhow::{Result, ensure};
use evaluation::{python::Python, table::Table};
use job::Job;
use quality::{ShapeDna, ShapeDnaOptions};
use serde::{Deserialize, Serialize};

use super::inputs::SharedMesh;
use crate::{kept::Key, measure::timed_in_rounds};

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
        let measure = || ShapeDna::of(&mesh.mesh, &options, &Job::default());
        let (ours, cpu) = timed_in_rounds(rounds, measure)?;
        let count = COUNT.to_string();
        let beside = |python| {
            PEERS.map(|(name, script)| {
                let arguments = [OsStr::new(script), mesh.folder.as_os_str(), count.as_ref()];
                let key = Key::new(format!("{script}-{count}"));
                let report = mesh.asked(python, &key, &arguments)?;
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
        let peers = self.peers.iter();
        let words = |peer: &ComparedPeer| {
            format!(
                "; {} {:.2} s, off by {:.1e}",
                peer.name, peer.cpu, peer.difference
            )
        };
        let peers: String = peers.map(words).collect();
        format!("{}: Shape-DNA CPU {:.2} s{peers}", self.name, self.cpu)
    }
}

impl ComparedPeer {
    fn of(name: &'static str, report: &SpectrumReport, ours: &[f64], our_cpu: f64) -> Result<Self> {
        let theirs = &report.eigenvalues;
        let (count, wanted) = (theirs.len(), ours.len());
        ensure!(count == wanted, "{name}: {count} eigenvalues instead of {wanted}");
        let pairs = theirs.iter().zip(ours);
        let differences = pairs.map(|(theirs, ours)| (theirs / ours - 1.0).abs());
        // What is no number must show, so it may not be lost in a maximum.
        let worst = |most: f64, difference: f64| match difference.is_nan() {
            true => f64::INFINITY,
            false => most.max(difference),
        };
        Ok(Self {
            name,
            cpu: report.cpu,
            ratio: report.cpu / our_cpu,
            difference: differences.fold(0.0, worst),
        })
    }
}

/// A line for everyone on each mesh.
pub(crate) fn table(spectra: &[ComparedSpectra]) -> Table {
    let header = "mesh | n | who | CPU (s) | CPU / ours | largest difference of an eigenvalue";
    let mut table = Table::new("Shape-DNA", header.split(" | "));
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
