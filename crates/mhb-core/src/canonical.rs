//! One basis among all that span the same eigenspaces, so that a watermark is the same on every machine.
//!
//! Eigenvectors are defined up to sign, and in a cluster of k close eigenvalues up to a rotation. Let F be k fixed
//! reference functions, white noise that depends on the vertex's index alone, and V any orthonormal basis of the
//! cluster's space E. The basis W = V·polar(Vᵀ F) is the one closest to F: it depends on E alone, and continuously,
//! wherever Vᵀ F is regular, which noise is with probability one. For k = 1 it fixes the sign.

use std::ops::Range;

use faer::reborrow::Reborrow;
use faer::{Mat, MatMut, MatRef};

use crate::SpectrumError;
use crate::dense;
use crate::noise::Noise;

/// Two neighbouring eigenvalues belong to one cluster if they differ by less than this fraction of the larger.
///
/// Far above the accuracy of eigenvalues (1e-12), far below their usual distance (1 / count), and no larger than the
/// residual that users ask for, since a rotated vector of a cluster of relative width w has a residual of w/2.
pub(crate) const CLUSTER_GAP: f64 = 1e-6;

/// Maximal runs of ascending `eigenvalues` whose neighbours are closer than [`CLUSTER_GAP`].
pub(crate) fn clusters(eigenvalues: &[f64]) -> Vec<Range<usize>> {
    let mut clusters = Vec::new();
    let mut start = 0;
    for k in 1..=eigenvalues.len() {
        if k == eigenvalues.len() || !in_one_cluster(eigenvalues[k - 1], eigenvalues[k]) {
            clusters.push(start..k);
            start = k;
        }
    }
    clusters
}

/// Whether eigenvalue `upper` continues the cluster of its predecessor `lower`.
pub(crate) fn in_one_cluster(lower: f64, upper: f64) -> bool {
    upper - lower <= CLUSTER_GAP * upper
}

/// The reference by which signs of single eigenfunctions are chosen, for `n` vertices.
pub(crate) fn reference_of_signs(n: usize) -> impl Iterator<Item = f64> {
    let mut noise = Noise::new(REFERENCE_SEED, 0);
    (0..n).map(move |_| noise.next())
}

/// Fixed white noise, one column after another as clusters need them: column j is the same for every cluster.
pub(crate) struct References(Mat<f64>);

impl References {
    /// For `n` vertices.
    pub(crate) fn new(n: usize) -> Self {
        Self(Mat::zeros(n, 0))
    }

    /// The first `k` columns.
    fn first(&mut self, k: usize) -> MatRef<'_, f64> {
        while self.0.ncols() < k {
            let mut noise = Noise::new(REFERENCE_SEED, self.0.ncols() as u64);
            self.0
                .resize_with(self.0.nrows(), self.0.ncols() + 1, |_, _| noise.next());
        }
        self.0.as_ref().subcols(0, k)
    }

    /// Replaces the orthonormal basis of one eigenspace, #V by k, by its canonical one.
    pub(crate) fn canonicalise(&mut self, mut basis: MatMut<'_, f64>) -> Result<(), SpectrumError> {
        let references = self.first(basis.ncols());
        let overlap = dense::product(basis.rb().transpose(), references);
        if basis.ncols() == 1 {
            if overlap[(0, 0)] < 0.0 {
                dense::contiguous(basis.col_mut(0))
                    .iter_mut()
                    .for_each(|y| *y = -*y);
            }
            return Ok(());
        }
        let rotated = dense::product(basis.rb(), dense::polar(overlap.as_ref())?.as_ref());
        basis.copy_from(&rotated);
        Ok(())
    }
}

const REFERENCE_SEED: u64 = 0x4d61_6e69_666f_6c64;
