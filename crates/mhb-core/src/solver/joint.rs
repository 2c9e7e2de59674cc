//! One orthonormal basis out of the bands' vectors.

use faer::reborrow::ReborrowMut;
use faer::{Mat, MatMut, MatRef};
use job::{Job, JobError};

use super::bands::Certified;
use super::tall::LANES;
use crate::dense;
use crate::operator::Operator;

/// Rows and columns that one task works on; fixed, so that results do not depend on the number of threads.
const ROWS: usize = 512;
const COLUMNS: usize = 32;

/// Vectors whose inner products are below this are orthonormal, whatever tolerance was asked for.
const ORTHONORMAL: f64 = 2e-11;

/// Inner products that may be left, over the tolerance of the residuals. Vectors with a relative residual of τ are known to some τ k anyway.
const SLACK: f64 = 0.1;

/// The first `kept` of the kernel's vectors and the bands', in the mesh's ordering, made orthonormal as far as pairs of
/// this tolerance need it.
pub(crate) fn join(
    operator: &Operator,
    kernel: MatRef<'_, f64>,
    certified: Certified,
    kept: usize,
    inverse: &[u32],
    tolerance: f64,
    job: &Job,
) -> Result<Mat<f64>, JobError> {
    let mut joined = Mat::zeros(kernel.nrows(), kept);
    let zeros = kernel.ncols().min(kept);
    joined
        .as_mut()
        .subcols_mut(0, zeros)
        .copy_from(kernel.subcols(0, zeros));
    let mut residuals = vec![0.0; zeros];
    let pairs = &certified.pairs[..kept - zeros];
    residuals.extend(pairs.iter().map(|pair| pair.residual));
    let mut columns: Vec<&mut [f64]> = joined
        .as_mut()
        .subcols_mut(zeros, pairs.len())
        .col_iter_mut()
        .map(dense::contiguous)
        .collect();
    // Vertices in the order of the targets; eight columns at a time share the cache lines that they are read from.
    job.for_chunks(&mut columns, LANES, |chunk, columns| {
        for (old, &i) in inverse.iter().enumerate() {
            for (column, pair) in columns.iter_mut().zip(&pairs[chunk * LANES..]) {
                column[old] = certified.vectors[pair.matrix].at(i as usize, pair.column);
            }
        }
    })?;
    drop(columns);
    drop(certified);
    let goal = ORTHONORMAL.max(SLACK * tolerance);
    orthonormalise(operator, &mut joined, &residuals, goal, job)?;
    Ok(joined)
}

/// Newton's iteration towards an orthonormal set: x_j ← x_j − Σ_i w_ij (x_iᵀMx_j − δ_ij) x_i with w_ij + w_ji = 1.
///
/// Equal weights give X (XᵀMX)^-1/2. Weighting by the residuals, w_ij = r_j / (r_i + r_j), lets the less accurate vector
/// of two give way, so that pairs from the middle of a band are not spoilt by those from the edge of another. Inner products
/// of `goal` are let pass.
fn orthonormalise(
    operator: &Operator,
    x: &mut Mat<f64>,
    residuals: &[f64],
    goal: f64,
    job: &Job,
) -> Result<(), JobError> {
    for _ in 0..6 {
        job.go_on()?;
        let weighted = operator.full_mass_times(x.as_ref());
        let mut correction = gram(x.as_ref(), weighted.as_ref().map_or(x.as_ref(), Mat::as_ref), job)?;
        let mut defect: f64 = 0.0;
        for j in 0..correction.ncols() {
            for i in 0..correction.nrows() {
                let overlap = correction[(i, j)] - f64::from(u8::from(i == j));
                defect = defect.max(overlap.abs());
                let total = residuals[i] + residuals[j];
                let weight = if total > 0.0 { residuals[j] / total } else { 0.5 };
                correction[(i, j)] = -weight * overlap;
            }
        }
        if defect < goal {
            break;
        }
        // Of the two corrections of a pair, what is left out stays below half of the goal together.
        add_multiple(x, correction.as_ref(), 0.25 * goal, job)?;
        // What is left is of second order: a few columns overlap with the same one.
        if 8.0 * defect * defect < goal {
            break;
        }
    }
    Ok(())
}

/// Ranges that cover 0..k.
fn blocks(k: usize, width: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..k)
        .step_by(width)
        .map(move |start| (start, width.min(k - start)))
}

/// XᵀMX by blocks of columns, of X and M X.
fn gram(x: MatRef<'_, f64>, mx: MatRef<'_, f64>, job: &Job) -> Result<Mat<f64>, JobError> {
    let k = x.ncols();
    let blocks: Vec<_> = blocks(k, 4 * COLUMNS).collect();
    let strips = job.map(blocks.len(), 1, |i| {
        let (j, width) = blocks[i];
        dense::product(x.subcols(j, k - j).transpose(), mx.subcols(j, width))
    })?;
    let mut gram = Mat::zeros(k, k);
    for ((j, width), strip) in blocks.into_iter().zip(&strips) {
        gram.as_mut().submatrix_mut(j, j, k - j, width).copy_from(strip);
        gram.as_mut()
            .submatrix_mut(j, j, width, k - j)
            .copy_from(strip.transpose());
    }
    Ok(gram)
}

/// X ← X + X C, by blocks of rows, without the blocks of C whose entries are all below `negligible`.
fn add_multiple(x: &mut Mat<f64>, c: MatRef<'_, f64>, negligible: f64, job: &Job) -> Result<(), JobError> {
    let k = x.ncols();
    let tiles: Vec<_> = blocks(k, COLUMNS)
        .flat_map(|source| blocks(k, COLUMNS).map(move |target| (source, target)))
        .filter(|&((i, height), (j, width))| c.submatrix(i, j, height, width).norm_max() > negligible)
        .collect();
    let mut row_blocks: Vec<MatMut<'_, f64>> = Vec::new();
    let mut rest = x.as_mut();
    while rest.nrows() > ROWS {
        let (block, below) = rest.split_at_row_mut(ROWS);
        row_blocks.push(block);
        rest = below;
    }
    row_blocks.push(rest);
    job.for_chunks(&mut row_blocks, 1, |_, blocks| {
        for block in blocks {
            let before = block.to_owned();
            for &((i, height), (j, width)) in &tiles {
                dense::add_product(
                    block.rb_mut().subcols_mut(j, width),
                    1.0,
                    before.as_ref().subcols(i, height),
                    c.submatrix(i, j, height, width),
                );
            }
        }
    })
}
