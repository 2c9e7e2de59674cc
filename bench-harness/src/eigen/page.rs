//! The page of the eigen-solver.

use std::path::PathBuf;

use anyhow::Result;
use evaluation::{machine, table::Table};

use super::{
    loose,
    measurement::{self, SolveMeasurement},
};
use crate::results;

/// All that was measured; written again after every step, so that a run that ends early leaves what it has.
pub(crate) struct EigenPage {
    /// Where it goes.
    pub(crate) folder: PathBuf,
    /// Of ours, and of the peers'.
    pub(crate) rounds: [usize; 2],
    pub(crate) comparison: Vec<SolveMeasurement>,
    /// The tolerances that the comparison is summed up at.
    pub(crate) tolerances: [f64; 2],
    pub(crate) loose: Option<Table>,
    /// Against patches, and against pairs.
    pub(crate) scaling: Vec<Table>,
    /// Of what the peers are made of, each behind a semicolon.
    pub(crate) versions: String,
}

impl EigenPage {
    /// Writes `eigen.md`, its chart and its CSV files.
    pub(crate) fn write(&self) -> Result<()> {
        let mut sections = Vec::new();
        if !self.comparison.is_empty() {
            let table = measurement::table(&self.comparison);
            table.write_csv(&self.folder.join("eigen.csv"))?;
            let chart = measurement::chart(&self.comparison);
            results::write(&self.folder.join("eigen.svg"), chart.svg())?;
            sections.push(format!(
                "![CPU seconds](eigen.svg)\n\n{}\n{}",
                measurement::summary(&self.comparison, &self.tolerances),
                table.markdown()
            ));
        }
        if let Some(table) = &self.loose {
            table.write_csv(&self.folder.join("eigen_loose.csv"))?;
            sections.push(format!("{}\n{}\n", table.markdown(), loose::WORDS));
        }
        for (table, name) in self.scaling.iter().zip(["eigen_patches.csv", "eigen_pairs.csv"]) {
            table.write_csv(&self.folder.join(name))?;
            sections.push(table.markdown());
        }
        let [rounds, peer_rounds] = self.rounds;
        let page = format!(
            "# The eigen-solver beside its peers\n\nWritten by `cargo xtask bench eigen`. Everyone solves the same matrices, cotangent stiffness and lumped mass, for the lowest pairs; \
             one judge takes the residual max ‖S h − λ D h‖_{{D⁻¹}} / λ of what they return. CPU seconds are user and system time of the solve, factorisation included, \
             on one thread unless said otherwise; medians of {rounds} round(s) of ours and {peer_rounds} of the peers'. Lanczos methods run in shift-invert mode, σ = −0.01 on unit area, \
             with as many vectors as their makers advise, twice the pairs. LOBPCG has the exact inverse as preconditioner, a fifth more vectors than pairs, and ends after 60 steps at the latest. \
             Ours proves by inertia that no pair is missing. Cells of the peers that an earlier run finished are not measured again.\n\n{}\n{}{}; {}.\n",
            sections.join("\n"),
            machine::description(),
            self.versions,
            machine::load(),
        );
        results::write(&self.folder.join("eigen.md"), page)
    }
}
