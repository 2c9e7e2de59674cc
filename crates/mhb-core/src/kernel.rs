//! The kernel of a Laplacian is known: functions that are constant on each connected component.

use faer::Mat;
use mesh::Components;

use crate::operator::Operator;

/// Orthonormal kernel vectors of A, #V by `components`, in a canonical order: the constant, then for each further
/// component (in order of first vertex) the contrast between it and all components before it.
pub(crate) fn kernel(operator: &Operator) -> Mat<f64> {
    let Components {
        count,
        of_vertex: label,
        ..
    } = operator.components();
    let root_mass = operator.root_mass();
    let mut mass = vec![0.0; count];
    for (&c, r) in label.iter().zip(root_mass) {
        mass[c as usize] += r * r;
    }
    let mut basis = Mat::zeros(operator.size(), count);
    let total: f64 = mass.iter().sum();
    for (i, r) in root_mass.iter().enumerate() {
        basis[(i, 0)] = r / total.sqrt();
    }
    let mut before = mass.first().copied().unwrap_or(0.0);
    for k in 1..count {
        let scale = (before * mass[k] * (before + mass[k])).sqrt();
        for (i, r) in root_mass.iter().enumerate() {
            let c = label[i] as usize;
            if c < k {
                basis[(i, k)] = -r * mass[k] / scale;
            } else if c == k {
                basis[(i, k)] = r * before / scale;
            }
        }
        before += mass[k];
    }
    basis
}
