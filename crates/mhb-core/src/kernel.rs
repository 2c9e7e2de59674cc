//! The kernel of a Laplacian is known: functions that are constant on each connected component without a vertex that is held fixed.

use faer::Mat;
use job::{Job, JobError};
use mesh::Components;

use crate::operator::Operator;

/// Orthonormal kernel vectors of A, #V by number, in a canonical order: the constant, then for each further
/// component (in order of first vertex) the contrast between it and all components before it. Components with a vertex that
/// is `grounded`, beside one that is held fixed, have none. Of more than `most` vectors these are the first.
pub(crate) fn kernel(
    operator: &Operator,
    grounded: impl Fn(usize) -> bool,
    most: usize,
    job: &Job,
) -> Result<Mat<f64>, JobError> {
    let Components {
        count,
        of_vertex: label,
        ..
    } = operator.components();
    let mut is_free = vec![true; count];
    for (v, &c) in label.iter().enumerate() {
        is_free[c as usize] &= !grounded(v);
    }
    // The number of each free component among them.
    let mut number = vec![None; count];
    let mut free = 0;
    for c in (0..count).filter(|&c| is_free[c]) {
        number[c] = Some(free);
        free += 1;
    }
    let root_mass = operator.root_mass();
    let mut mass = vec![0.0; free];
    for (&c, r) in label.iter().zip(root_mass) {
        if let Some(c) = number[c as usize] {
            mass[c] += r * r;
        }
    }
    let mut basis = Mat::zeros(operator.size(), free.min(most));
    let total: f64 = mass.iter().sum();
    let mut before = 0.0;
    for k in 0..basis.ncols() {
        job.go_on()?;
        let scale = (before * mass[k] * (before + mass[k])).sqrt();
        for (i, r) in root_mass.iter().enumerate() {
            let Some(c) = number[label[i] as usize] else {
                continue;
            };
            basis[(i, k)] = match k {
                0 => r / total.sqrt(),
                _ if c < k => -r * mass[k] / scale,
                _ if c == k => r * before / scale,
                _ => 0.0,
            };
        }
        before += mass[k];
    }
    Ok(basis)
}
