use std::borrow::Cow;
use std::ops::Range;

use faer::{Mat, MatRef};
use mesh::Components;
use sprs::CsMat;

use crate::{Laplacian, dense};

/// The eigenproblem that the solver works on, with masses scaled to a total of 1.
///
/// A y = λ M y with A = D^-½ S D^-½, M = D^-½ B D^-½ and y = D^½ h. For lumped mass B is D, M the identity, and the problem a standard one.
/// For full mass M lies between 1/4 and 1, because B does so of D in every triangle: |t|/12 (I + J) of |t|/3 I, where J is all ones.
/// Eigenvalues are free of the mesh's unit: Weyl's law puts the k-th near 4πk.
#[derive(Clone, Debug)]
pub(crate) struct Operator {
    column_starts: Vec<u32>,
    rows: Vec<u32>,
    /// Entries of A, symmetric, so that compressed columns are compressed rows.
    values: Vec<f64>,
    /// Entries of M beside those of A; none for lumped mass.
    full_mass: Option<Vec<f64>>,
    /// Where each column's diagonal entry stands.
    diagonal: Vec<u32>,
    /// √D, total mass 1.
    root_mass: Vec<f64>,
    total_mass: f64,
}

/// Eigenvalues of M are not below this.
const LEAST_MASS: f64 = 0.25;

impl Operator {
    pub(crate) fn new(laplacian: &Laplacian) -> Self {
        let mass = laplacian.mass();
        let total_mass: f64 = mass.iter().sum();
        let root_mass: Vec<f64> = mass.iter().map(|m| (m / total_mass).sqrt()).collect();
        let stiffness = laplacian.stiffness();
        let mut operator = Self {
            column_starts: vec![0],
            rows: Vec::with_capacity(stiffness.nnz()),
            values: Vec::with_capacity(stiffness.nnz()),
            full_mass: None,
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
        operator.full_mass = laplacian.full_mass().map(|mass| operator.scaled_mass(mass));
        operator
    }

    /// Entries of M. Stiffness and mass both couple the vertices that share a triangle, so their structures are one.
    fn scaled_mass(&self, mass: &CsMat<f64>) -> Vec<f64> {
        let entry = |(i, j): (usize, usize)| {
            let value = mass.get(i, j).copied().unwrap_or(0.0);
            value / (self.root_mass[i] * self.root_mass[j] * self.total_mass)
        };
        (0..self.size())
            .flat_map(|j| self.entries(j).map(move |e| (self.rows[e] as usize, j)))
            .map(entry)
            .collect()
    }

    /// The same operator with vertices renumbered: new vertex i is old vertex `forward[i]`, `inverse` undoes it.
    pub(crate) fn permuted(&self, forward: &[u32], inverse: &[u32]) -> Self {
        let mut permuted = Self {
            column_starts: vec![0],
            rows: Vec::with_capacity(self.rows.len()),
            values: Vec::with_capacity(self.values.len()),
            full_mass: None,
            diagonal: Vec::with_capacity(self.size()),
            root_mass: forward.iter().map(|&old| self.root_mass[old as usize]).collect(),
            total_mass: self.total_mass,
        };
        // Where each entry stood.
        let mut origin = Vec::with_capacity(self.rows.len());
        let mut column = Vec::new();
        for (j, &old) in forward.iter().enumerate() {
            column.clear();
            column.extend(
                self.entries(old as usize)
                    .map(|e| (inverse[self.rows[e] as usize], e)),
            );
            column.sort_unstable_by_key(|&(i, _)| i);
            for &(i, entry) in &column {
                if i as usize == j {
                    permuted.diagonal.push(permuted.rows.len() as u32);
                }
                permuted.rows.push(i);
                origin.push(entry);
            }
            permuted.column_starts.push(permuted.rows.len() as u32);
        }
        permuted.values = origin.iter().map(|&e| self.values[e]).collect();
        let full_mass = self.full_mass.as_ref();
        permuted.full_mass = full_mass.map(|mass| origin.iter().map(|&e| mass[e]).collect());
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

    /// Entries of A − σ M, in the order of [`rows`](Self::rows).
    pub(crate) fn shifted(&self, shift: f64) -> Vec<f64> {
        let mut values = self.values.clone();
        match &self.full_mass {
            None => {
                for &d in &self.diagonal {
                    values[d as usize] -= shift;
                }
            }
            Some(mass) => {
                for (value, m) in values.iter_mut().zip(mass) {
                    *value -= shift * m;
                }
            }
        }
        values
    }

    /// Where the entries of column j stand.
    fn entries(&self, j: usize) -> Range<usize> {
        self.column_starts[j] as usize..self.column_starts[j + 1] as usize
    }

    /// Row and value of each entry of column j of A.
    pub(crate) fn column(&self, j: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.column_of(&self.values, j)
    }

    fn column_of<'a>(&'a self, values: &'a [f64], j: usize) -> impl Iterator<Item = (usize, f64)> + 'a {
        let range = self.entries(j);
        self.rows[range.clone()]
            .iter()
            .zip(&values[range])
            .map(|(&i, &value)| (i as usize, value))
    }

    /// M X, where blocks of #V rows of L values each follow one another. X itself for lumped mass.
    pub(crate) fn mass_times<'a, const L: usize>(&self, x: &'a [f64]) -> Cow<'a, [f64]> {
        let Some(mass) = &self.full_mass else {
            return Cow::Borrowed(x);
        };
        let mut product = Vec::with_capacity(x.len());
        for block in x.chunks_exact(L * self.size()) {
            let (rows, _) = block.as_chunks::<L>();
            for j in 0..self.size() {
                let mut sum = [0.0; L];
                for (i, m) in self.column_of(mass, j) {
                    (0..L).for_each(|lane| sum[lane] += m * rows[i][lane]);
                }
                product.extend_from_slice(&sum);
            }
        }
        Cow::Owned(product)
    }

    /// M X; `None` for lumped mass, where that is X.
    pub(crate) fn full_mass_times(&self, x: MatRef<'_, f64>) -> Option<Mat<f64>> {
        let mass = self.full_mass.as_ref()?;
        let mut product = Mat::zeros(x.nrows(), x.ncols());
        for k in 0..x.ncols() {
            let column = dense::column(x, k);
            for (j, target) in product.col_as_slice_mut(k).iter_mut().enumerate() {
                *target = self.column_of(mass, j).map(|(i, m)| m * column[i]).sum();
            }
        }
        Some(product)
    }

    /// An upper bound of the eigenvalues: the largest absolute row sum of A, over the least eigenvalue of M.
    pub(crate) fn norm_bound(&self) -> f64 {
        let norm = (0..self.size())
            .map(|j| self.column(j).map(|(_, value)| value.abs()).sum())
            .fold(0.0, f64::max);
        match self.full_mass {
            None => norm,
            Some(_) => norm / LEAST_MASS,
        }
    }

    /// A as a dense matrix.
    pub(crate) fn to_dense(&self) -> Mat<f64> {
        self.dense_of(&self.values)
    }

    /// M as a dense matrix; `None` for lumped mass.
    pub(crate) fn full_mass_to_dense(&self) -> Option<Mat<f64>> {
        self.full_mass.as_ref().map(|mass| self.dense_of(mass))
    }

    fn dense_of(&self, values: &[f64]) -> Mat<f64> {
        let mut a = Mat::zeros(self.size(), self.size());
        for j in 0..self.size() {
            for (i, value) in self.column_of(values, j) {
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
