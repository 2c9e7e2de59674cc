//! The page of the metrics.

use anyhow::Result;
use evaluation::{machine, python::Python};

use super::{
    distances::{self, ComparedDistance},
    shape_dna::{self, COUNT, ComparedPeer, ComparedSpectra, PEERS},
};
use crate::{
    measure::{greatest, median},
    results,
};

/// Writes the page and its CSV files.
pub(crate) fn write(
    pairs: &[ComparedDistance],
    spectra: &[ComparedSpectra],
    rounds: usize,
    python: Option<&Python>,
) -> Result<()> {
    let results = results::folder()?;
    let (distances, shape_dna) = (distances::table(pairs), shape_dna::table(spectra));
    distances.write_csv(&results.join("quality_distances.csv"))?;
    shape_dna.write_csv(&results.join("quality_shape_dna.csv"))?;
    let versions = python.map(Python::versions).transpose()?;
    let versions = versions.map(|versions| format!("; {versions}"));
    let page = format!(
        "# The metrics beside their peers\n\nWritten by `cargo xtask bench quality`. Distances (eq. 21) are from the distorted mesh, sampled every 0.05 % of its diagonal, to the original, \
         in per cent of the original's diagonal; MeshLab's filter (Metro) draws area / interval² samples at random, ours lays them in rows and adds the vertices; \
         theirs is the greatest over both, too. *Waves* move vertices smoothly by up to 0.1 % of the model, *noise* at random by up to 0.3 of the shortest edge. \
         Shape-DNA is the {COUNT} lowest non-zero eigenvalues with the full mass matrix: scipy's `eigsh` (ARPACK, SuperLU) on matrices that the script assembles itself, LaPy on its own. \
         CPU seconds are user and system time on one thread, medians of {rounds} round(s) (of the eigenvalue peers, one). Cells of the peers that an earlier run finished are not measured again.\n\n\
         {}\n{}\n{}\n{}\n{}{}; {}.\n",
        summary(pairs, spectra),
        distances.markdown(),
        shape_dna.markdown(),
        "Differences between ours and MeshLab's are theirs against ours, relatively; those of eigenvalues are the largest of all.\n",
        machine::description(),
        versions.unwrap_or_default(),
        machine::load(),
    );
    results::write_page(&results.join("quality.md"), &page)
}

/// The worst of all, in words.
fn summary(pairs: &[ComparedDistance], spectra: &[ComparedSpectra]) -> String {
    let ratios = || pairs.iter().filter_map(ComparedDistance::ratio);
    let mut text = String::new();
    if ratios().next().is_some() {
        text += &format!(
            "- d_rmse, mean and Hausdorff distance agree with MeshLab's within {:.2} % on {} pairs, in {:.2} of its CPU time (median; most {:.2})\n",
            100.0 * greatest(pairs.iter().filter_map(ComparedDistance::difference)),
            ratios().count(),
            median(ratios()),
            greatest(ratios()),
        );
    }
    for (name, _) in PEERS {
        let all = spectra.iter().flat_map(|mesh| &mesh.peers);
        let of_peer: Vec<&ComparedPeer> = all.filter(|peer| peer.name == name).collect();
        if !of_peer.is_empty() {
            text += &format!(
                "- eigenvalues agree with {name}'s within {:.1e}, relatively; {name} takes {:.1} times our CPU time (median of {})\n",
                greatest(of_peer.iter().map(|peer| peer.difference)),
                median(of_peer.iter().map(|peer| peer.ratio)),
                of_peer.len(),
            );
        }
    }
    text
}
