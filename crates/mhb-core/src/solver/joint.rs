//! One orthonormal basis out of the bands' vectors.

use faer::{Mat, MatMut, MatRef};
use rayon::prelude::*;

use super::bands::Certified;
use crate::dense;

/// Rows and columns that one task works on; fixed, so that results do not depend on the number of threads.
const ROWS: usize = 1024;
const COLUMNS: usize = 128;

/// Vectors whose inner products are below this are orthonormal.
const ORTHONORMAL: f64 = 1e-13;

/// The first `kept` of the kernel's vectors and the bands', in the mesh's ordering, made orthonormal.
pub(crate) fn join(kernel: MatRef<'_, f64>, certified: Certified, kept: usize, forward: &[u32]) -> Mat<f64> {
    let mut joined = Mat::zeros(kernel.nrows(), kept);
    let zeros = kernel.ncols().min(kept);
    joined
        .as_mut()
        .subcols_mut(0, zeros)
        .copy_from(kernel.subcols(0, zeros));
    let mut residuals = vec![0.0; zeros];
    for pair in certified.pairs.iter().take(kept - zeros) {
        let column = joined.col_as_slice_mut(residuals.len());
        for (&old, y) in forward
            .iter()
            .zip(certified.vectors[pair.matrix].column(pair.column))
        {
            column[old as usize] = y;
        }
        residuals.push(pair.residual);
    }
    drop(certified);
    orthonormalise(&mut joined, &residuals);
    joined
}

/// Newton's iteration towards an orthonormal set: x_j ← x_j − Σ_i w_ij (x_iᵀx_j − δ_ij) x_i with w_ij + w_ji = 1.
///
/// Equal weights give X (XᵀX)^-1/2. Weighting by the residuals, w_ij = r_j / (r_i + r_j), lets the less accurate vector
/// of two give way, so that pairs from the middle of a band are not spoilt by those from the edge of another.
fn orthonormalise(x: &mut Mat<f64>, residuals: &[f64]) {
    for _ in 0..6 {
        let mut correction = gram(x.as_ref());
        let mut defect: f64 = 0.0;
        for j in 0..correction.ncols() {
            for i in 0..correction.nrows() {
                let unit = f64::from(u8::from(i == j));
                let overlap = correction[(i, j)] - unit;
                defect = defect.max(overlap.abs());
                let total = residuals[i] + residuals[j];
                let weight = if total > 0.0 { residuals[j] / total } else { 0.5 };
                correction[(i, j)] = unit - weight * overlap;
            }
        }
        if defect < ORTHONORMAL {
            return;
        }
        multiply(x, correction.as_ref());
        if defect * defect < 0.1 * ORTHONORMAL {
            return;
        }
    }
}

/// XᵀX by blocks of columns.
fn gram(x: MatRef<'_, f64>) -> Mat<f64> {
    let k = x.ncols();
    let blocks: Vec<_> = (0..k)
        .step_by(COLUMNS)
        .map(|start| (start, COLUMNS.min(k - start)))
        .collect();
    let pairs: Vec<_> = blocks
        .iter()
        .flat_map(|&a| blocks.iter().map(move |&b| (a, b)))
        .filter(|(a, b)| a >= b)
        .collect();
    let products: Vec<Mat<f64>> = pairs
        .par_iter()
        .map(|&((i, height), (j, width))| {
            if i == j {
                dense::gram(x.subcols(i, height))
            } else {
                dense::product(x.subcols(i, height).transpose(), x.subcols(j, width))
            }
        })
        .collect();
    let mut gram = Mat::zeros(k, k);
    for (((i, height), (j, width)), product) in pairs.into_iter().zip(&products) {
        gram.as_mut()
            .submatrix_mut(i, j, height, width)
            .copy_from(product);
        gram.as_mut()
            .submatrix_mut(j, i, width, height)
            .copy_from(product.transpose());
    }
    gram
}

/// X ← X C, by blocks of rows.
fn multiply(x: &mut Mat<f64>, c: MatRef<'_, f64>) {
    let mut blocks: Vec<MatMut<'_, f64>> = Vec::new();
    let mut rest = x.as_mut();
    while rest.nrows() > ROWS {
        let (block, below) = rest.split_at_row_mut(ROWS);
        blocks.push(block);
        rest = below;
    }
    blocks.push(rest);
    blocks.into_par_iter().for_each(|mut block| {
        let product = dense::product(block.as_ref(), c);
        block.copy_from(&product);
    });
}
