//! The page of the eigen-solver.

use anyhow::Result;
use evaluation::{machine, table::Table};

use super::{
    EigenBench, loose,
    measurement::{self, SolveMeasurement},
};
use crate::results;

/// All that was measured; written again after every step, so that a run that ends early leaves what it has.
pub(crate) struct EigenPage<'a> {
    pub(crate) options: &'a EigenBench,
    pub(crate) comparison: Vec<SolveMeasurement>,
    pub(crate) loose: Option<Table>,
    /// Against patches, and against pairs.
    pub(crate) scaling: Vec<Table>,
    /// Of what the peers are made of, each behind a semicolon.
    pub(crate) versions: String,
}

impl EigenPage<'_> {
    /// Writes `eigen.md`, its chart and its CSV files.
    pub(crate) fn write(&self) -> Result<()> {
        let (folder, mut sections) = (&self.options.output, Vec::new());
        if !self.comparison.is_empty() {
            let table = measurement::table(&self.comparison);
            table.write_csv(&folder.join("eigen.csv"))?;
            let chart = measurement::chart(&self.comparison);
            results::write(&folder.join("eigen.svg"), chart.svg())?;
            sections.push(format!(
                "![CPU seconds](eigen.svg)\n\n{}\n{}",
                measurement::summary(&self.comparison),
                table.markdown()
            ));
        }
        if let Some(table) = &self.loose {
            table.write_csv(&folder.join("eigen_loose.csv"))?;
            sections.push(format!("{}\n{}\n", table.markdown(), loose::WORDS));
        }
        for (table, name) in self.scaling.iter().zip(["eigen_patches.csv", "eigen_pairs.csv"]) {
            table.write_csv(&folder.join(name))?;
            sections.push(table.markdown());
        }
        let EigenBench {
            rounds, peer_rounds, ..
        } = self.options;
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
        results::write(&folder.join("eigen.md"), page)
    }
}
