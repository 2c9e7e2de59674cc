//! The page of the spectra in Python.

use anyhow::Result;
use evaluation::{machine, python::Python, table::Table};

use super::{Measured, OPERATORS, Outcome, PythonBench};
use crate::{
    measure::{least, median},
    results,
};

/// Writes the page and its CSV file.
pub(crate) fn write(measured: &[Measured], options: &PythonBench, python: &Python) -> Result<()> {
    let folder = results::folder()?;
    let table = table(measured);
    table.write_csv(&folder.join("python.csv"))?;
    let (tolerance, rounds, limit) = (options.tolerance, options.rounds.max(1), options.limit);
    let page = format!(
        "# The Laplace–Beltrami spectrum in Python\n\nWritten by `cargo xtask bench python`, which runs `bench-harness/peers/python/spectrum.py`: everyone gets the same two arrays, of a mesh of unit area, \
         assembles matrices of its own and solves for the lowest pairs, on one thread, in a process of its own. CPU seconds are user and system time of both; medians of {rounds} round(s) of ours, one of the peers, who are stopped \
         after {limit} s. The residual is the worst ‖S h − λ M h‖ / λ, in the norm of the inverse lumped mass, of each one's own matrices. {tolerance:e} is asked for; LaPy's solver takes no tolerance and goes on to the precision of the machine, \
         and ARPACK, which all four peers call by scipy's `eigsh` in shift-invert mode with σ = −0.01 (LaPy's) and the factorisation that scipy picks, ends below what it is asked for. \
         Peers stand below ours for the same operator, and *eigenvalues differ* says how far theirs are from those, relatively: robust_laplacian lengthens edges of every mesh by a hundred-thousandth, ours only those of degenerate ones. \
         No peer proves that no pair is missing; ours does, within its time.\n\n{}\n{}\n{}; {}; {}.\n",
        summary(measured),
        table.markdown(),
        machine::description(),
        python.versions()?,
        machine::load(),
    );
    results::write_page(&folder.join("python.md"), &page)
}

fn table(measured: &[Measured]) -> Table {
    let header = [
        "mesh",
        "operator",
        "by",
        "n",
        "pairs",
        "CPU (s)",
        "wall (s)",
        "worst residual",
        "eigenvalues differ",
        "CPU / ours",
    ];
    let mut table = Table::new("The lowest pairs of S h = λ M h", header).text_columns(3);
    for line in measured {
        let [cpu, wall, residual] = match &line.outcome {
            Outcome::Done {
                cpu, wall, residual, ..
            } => [
                format!("{cpu:.2}"),
                format!("{wall:.2}"),
                format!("{residual:.1e}"),
            ],
            Outcome::Stopped { after } => [format!("> {after:.0}"), "–".into(), "–".into()],
        };
        let difference = line.beside.and_then(|(_, difference)| difference);
        let more = if matches!(line.outcome, Outcome::Stopped { .. }) {
            "> "
        } else {
            ""
        };
        table.row([
            line.mesh.clone(),
            line.operator.into(),
            line.name.into(),
            line.vertices.to_string(),
            line.count.to_string(),
            cpu,
            wall,
            residual,
            difference.map_or("–".into(), |difference| format!("{difference:.1e}")),
            line.beside
                .map_or("1.0".into(), |(ratio, _)| format!("{more}{ratio:.1}")),
        ]);
    }
    table
}

/// How many times our CPU time each peer takes, in words.
fn summary(measured: &[Measured]) -> String {
    let mut counts: Vec<usize> = measured.iter().map(|line| line.count).collect();
    counts.sort_unstable();
    counts.dedup();
    let mut text = String::new();
    for peer in OPERATORS.iter().flat_map(|operator| operator.peers) {
        for &count in &counts {
            let of_peer = measured
                .iter()
                .filter(|line| line.name == peer.name && line.count == count);
            let ratios: Vec<f64> = of_peer.filter_map(|line| Some(line.beside?.0)).collect();
            if !ratios.is_empty() {
                text += &format!(
                    "- {} takes {:.1} times our CPU time for {count} pairs (median of {} mesh(es); least {:.1})\n",
                    peer.name,
                    median(ratios.iter().copied()),
                    ratios.len(),
                    least(ratios.iter().copied()),
                );
            }
        }
    }
    text
}
