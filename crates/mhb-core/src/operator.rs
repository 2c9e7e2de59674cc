use faer::Mat;
use mesh::Components;

use crate::{Laplacian, SpectrumError};

/// The standard eigenproblem that the solver works on: A = D^-1/2 S D^-1/2 with D scaled to total mass 1.
///
/// A y = λ y with y = D^1/2 h. Eigenvalues are free of the mesh's unit: Weyl's law puts the k-th near 4πk.
#[derive(Clone, Debug)]
pub(crate) struct Operator {
    column_starts: Vec<u32>,
    rows: Vec<u32>,
    /// Entries of A, symmetric, so that compressed columns are compressed rows.
    values: Vec<f64>,
    /// Where each column's diagonal entry stands.
    diagonal: Vec<u32>,
    /// √D, total mass 1.
    root_mass: Vec<f64>,
    total_mass: f64,
}

impl Operator {
    pub(crate) fn new(laplacian: &Laplacian) -> Result<Self, SpectrumError> {
        let mass = laplacian.mass();
        if let Some(vertex) = mass.iter().position(|m| !m.is_normal() || *m < 0.0) {
            return Err(SpectrumError::Mass {
                vertex,
                mass: mass[vertex],
            });
        }
        let total_mass: f64 = mass.iter().sum();
        if !total_mass.is_normal() {
            return Err(SpectrumError::Area { area: total_mass });
        }
        let root_mass: Vec<f64> = mass.iter().map(|m| (m / total_mass).sqrt()).collect();
        let stiffness = laplacian.stiffness();
        let mut operator = Self {
            column_starts: vec![0],
            rows: Vec::with_capacity(stiffness.nnz()),
            values: Vec::with_capacity(stiffness.nnz()),
            diagonal: Vec::with_capacity(mass.len()),
            root_mass,
            total_mass,
        };
        for (j, column) in stiffness.outer_iterator().enumerate() {
            operator.diagonal.push(u32::MAX);
            for (i, &value) in column.iter() {
                if i == j {
                    operator.diagonal[j] = operator.rows.len() as u32;
                }
                operator.rows.push(i as u32);
                operator
                    .values
                    .push(value / (operator.root_mass[i] * operator.root_mass[j]));
            }
            if operator.diagonal[j] == u32::MAX {
                operator.diagonal[j] = operator.rows.len() as u32;
                operator.rows.push(j as u32);
                operator.values.push(0.0);
            }
            operator.column_starts.push(operator.rows.len() as u32);
        }
        Ok(operator)
    }

    /// The same operator with vertices renumbered: new vertex i is old vertex `forward[i]`, `inverse` undoes it.
    pub(crate) fn permuted(&self, forward: &[u32], inverse: &[u32]) -> Self {
        let mut permuted = Self {
            column_starts: vec![0],
            rows: Vec::with_capacity(self.rows.len()),
            values: Vec::with_capacity(self.values.len()),
            diagonal: Vec::with_capacity(self.size()),
            root_mass: forward.iter().map(|&old| self.root_mass[old as usize]).collect(),
            total_mass: self.total_mass,
        };
        let mut column = Vec::new();
        for (j, &old) in forward.iter().enumerate() {
            column.clear();
            column.extend(self.column(old as usize).map(|(i, value)| (inverse[i], value)));
            column.sort_unstable_by_key(|&(i, _)| i);
            for &(i, value) in &column {
                if i as usize == j {
                    permuted.diagonal.push(permuted.rows.len() as u32);
                }
                permuted.rows.push(i);
                permuted.values.push(value);
            }
            permuted.column_starts.push(permuted.rows.len() as u32);
        }
        permuted
    }

    /// #V.
    pub(crate) fn size(&self) -> usize {
        self.root_mass.len()
    }

    pub(crate) fn column_starts(&self) -> &[u32] {
        &self.column_starts
    }

    pub(crate) fn rows(&self) -> &[u32] {
        &self.rows
    }

    /// √D, scaled to total mass 1.
    pub(crate) fn root_mass(&self) -> &[f64] {
        &self.root_mass
    }

    /// The mass of the whole, in the caller's unit.
    pub(crate) fn total_mass(&self) -> f64 {
        self.total_mass
    }

    /// Entries of A − σ I, in the order of [`rows`](Self::rows).
    pub(crate) fn shifted(&self, shift: f64) -> Vec<f64> {
        let mut values = self.values.clone();
        for &d in &self.diagonal {
            values[d as usize] -= shift;
        }
        values
    }

    /// Row and value of each entry of column j.
    pub(crate) fn column(&self, j: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.column_starts[j] as usize..self.column_starts[j + 1] as usize;
        self.rows[range.clone()]
            .iter()
            .zip(&self.values[range])
            .map(|(&i, &value)| (i as usize, value))
    }

    /// An upper bound of the eigenvalues: the largest absolute row sum.
    pub(crate) fn norm_bound(&self) -> f64 {
        (0..self.size())
            .map(|j| self.column(j).map(|(_, value)| value.abs()).sum())
            .fold(0.0, f64::max)
    }

    /// A as a dense matrix.
    pub(crate) fn to_dense(&self) -> Mat<f64> {
        let mut a = Mat::zeros(self.size(), self.size());
        for j in 0..self.size() {
            for (i, value) in self.column(j) {
                a[(i, j)] = value;
            }
        }
        a
    }

    /// The connected components of the matrix.
    pub(crate) fn components(&self) -> Components {
        let column = |j: usize| self.column(j).map(move |(i, _)| [i as u32, j as u32]);
        Components::of_pairs(self.size(), (0..self.size()).flat_map(column))
    }
}
