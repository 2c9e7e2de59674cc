//! S h = λ B h with a mass matrix that is not diagonal.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LdltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, Mat, MatMut, MatRef, Par, Side};
use mesh::TriMesh;
use mhb_core::{SpectrumError, full_mass, lumped_mass, stiffness};

use super::Mass;
use crate::QualityError;

/// Stiffness S and mass B of a mesh scaled to unit area, entry by entry over one structure, and the kernel of S.
pub(crate) struct Pencil {
    column_starts: Vec<u32>,
    rows: Vec<u32>,
    stiffness: Vec<f64>,
    mass: Vec<f64>,
    /// The component of each vertex.
    component: Vec<u32>,
    /// B times one: what each vertex weighs.
    weight: Vec<f64>,
    /// The weight of each component.
    component_weight: Vec<f64>,
    area: f64,
}

impl Pencil {
    pub(crate) fn new(mesh: &TriMesh, mass: Mass) -> Result<Self, QualityError> {
        let s = stiffness(mesh)?;
        let weight = lumped_mass(mesh)?;
        if let Some(vertex) = weight.iter().position(|&m| !m.is_normal()) {
            let mass = weight[vertex];
            return Err(SpectrumError::Mass { vertex, mass }.into());
        }
        let area: f64 = weight.iter().sum();
        let full = full_mass(mesh)?;
        let mut pencil = Self {
            column_starts: vec![0],
            rows: Vec::with_capacity(full.nnz()),
            stiffness: Vec::with_capacity(full.nnz()),
            mass: Vec::with_capacity(full.nnz()),
            component: Vec::new(),
            weight: weight.iter().map(|m| m / area).collect(),
            component_weight: Vec::new(),
            area,
        };
        // Both matrices couple the vertices that share a triangle; what cancels in S is an entry of value 0.
        for (j, column) in full.outer_iterator().enumerate() {
            let (mut diagonal, mut others) = (0.0, 0.0);
            let first = pencil.rows.len();
            let mut place = first;
            for (i, &b) in column.iter() {
                if i == j {
                    place = pencil.rows.len();
                } else {
                    others += s.get(i, j).copied().unwrap_or(0.0);
                }
                pencil.rows.push(i as u32);
                pencil.stiffness.push(s.get(i, j).copied().unwrap_or(0.0));
                pencil.mass.push(match mass {
                    Mass::Full => b / area,
                    Mass::Lumped if i == j => weight[j] / area,
                    Mass::Lumped => 0.0,
                });
                diagonal = -others;
            }
            // Rows that sum to zero exactly: constants are in the kernel to the last digit.
            pencil.stiffness[place] = diagonal;
            pencil.column_starts.push(pencil.rows.len() as u32);
        }
        pencil.label_components();
        Ok(pencil)
    }

    fn label_components(&mut self) {
        const NONE: u32 = u32::MAX;
        let mut component = vec![NONE; self.size()];
        let mut open = Vec::new();
        for start in 0..self.size() {
            if component[start] != NONE {
                continue;
            }
            let label = self.component_weight.len() as u32;
            self.component_weight.push(0.0);
            component[start] = label;
            open.push(start);
            while let Some(j) = open.pop() {
                self.component_weight[label as usize] += self.weight[j];
                for &i in &self.rows[self.column(j)] {
                    if component[i as usize] == NONE {
                        component[i as usize] = label;
                        open.push(i as usize);
                    }
                }
            }
        }
        self.component = component;
    }

    fn column(&self, j: usize) -> std::ops::Range<usize> {
        self.column_starts[j] as usize..self.column_starts[j + 1] as usize
    }

    /// #V.
    pub(crate) fn size(&self) -> usize {
        self.weight.len()
    }

    /// Connected components: the dimension of the kernel.
    pub(crate) fn components(&self) -> usize {
        self.component_weight.len()
    }

    /// Of the mesh as it is: eigenvalues of the pencil, divided by it, are the mesh's.
    pub(crate) fn area(&self) -> f64 {
        self.area
    }

    /// B X.
    pub(crate) fn mass_times(&self, x: MatRef<'_, f64>) -> Mat<f64> {
        let mut y = Mat::zeros(x.nrows(), x.ncols());
        for c in 0..x.ncols() {
            for j in 0..self.size() {
                let entries = self.column(j);
                y[(j, c)] = self.rows[entries.clone()]
                    .iter()
                    .zip(&self.mass[entries])
                    .map(|(&i, b)| b * x[(i as usize, c)])
                    .sum();
            }
        }
        y
    }

    /// Takes the kernel out of each column: on every component, its mean.
    pub(crate) fn remove_kernel(&self, mut x: MatMut<'_, f64>) {
        let mut mean = vec![0.0; self.components()];
        for c in 0..x.ncols() {
            mean.fill(0.0);
            for (i, (&label, weight)) in self.component.iter().zip(&self.weight).enumerate() {
                mean[label as usize] += weight * x[(i, c)];
            }
            mean.iter_mut()
                .zip(&self.component_weight)
                .for_each(|(m, w)| *m /= w);
            for (i, &label) in self.component.iter().enumerate() {
                x[(i, c)] -= mean[label as usize];
            }
        }
    }

    /// S and B as dense matrices.
    pub(crate) fn dense(&self) -> (Mat<f64>, Mat<f64>) {
        let n = self.size();
        let (mut s, mut b) = (Mat::zeros(n, n), Mat::zeros(n, n));
        for j in 0..n {
            for entry in self.column(j) {
                let i = self.rows[entry] as usize;
                s[(i, j)] = self.stiffness[entry];
                b[(i, j)] = self.mass[entry];
            }
        }
        (s, b)
    }
}

/// Fill-reducing ordering and structure of the factors of S − σ B, the same for every σ.
pub(crate) struct Analysis<'a> {
    pencil: &'a Pencil,
    symbolic: SymbolicCholesky<u32>,
}

impl<'a> Analysis<'a> {
    pub(crate) fn new(pencil: &'a Pencil) -> Result<Self, QualityError> {
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        let symbolic =
            factorize_symbolic_cholesky(pencil.structure(), Side::Lower, SymmetricOrdering::Amd, params);
        Ok(Self {
            pencil,
            symbolic: symbolic.map_err(|_| QualityError::Memory { size: pencil.size() })?,
        })
    }

    /// L E Lᵀ = S − σ B.
    pub(crate) fn factorise(&self, shift: f64) -> Result<Factor<'_>, QualityError> {
        let pencil = self.pencil;
        let shifted: Vec<f64> = pencil
            .stiffness
            .iter()
            .zip(&pencil.mass)
            .map(|(s, b)| s - shift * b)
            .collect();
        let mut values = vec![0.0; self.symbolic.len_val()];
        let scratch = self
            .symbolic
            .factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Default::default());
        self.symbolic
            .factorize_numeric_ldlt(
                &mut values,
                SparseColMatRef::new(pencil.structure(), &shifted),
                Side::Lower,
                Default::default(),
                Par::Seq,
                MemStack::new(&mut MemBuffer::new(scratch)),
                Default::default(),
            )
            .map_err(|_| QualityError::Factorisation { shift })?;
        if values.iter().any(|x| !x.is_finite()) {
            return Err(QualityError::Factorisation { shift });
        }
        Ok(Factor {
            symbolic: &self.symbolic,
            values,
        })
    }

    /// How many eigenvalues lie below σ: the negative pivots of S − σ B, by Sylvester's law of inertia.
    pub(crate) fn count_below(&self, shift: f64) -> Result<usize, QualityError> {
        let factor = self.factorise(shift)?;
        let SymbolicCholeskyRaw::Supernodal(structure) = self.symbolic.raw() else {
            return Err(QualityError::Factorisation { shift });
        };
        let mut below = 0;
        for s in 0..structure.n_supernodes() {
            let width = (structure.supernode_end()[s] - structure.supernode_begin()[s]) as usize;
            let height = width + structure.supernode(s).pattern().len();
            let first = structure.col_ptr_for_val()[s] as usize;
            below += (0..width)
                .filter(|k| factor.values[first + k * (height + 1)] < 0.0)
                .count();
        }
        Ok(below)
    }
}

impl Pencil {
    fn structure(&self) -> SymbolicSparseColMatRef<'_, u32> {
        SymbolicSparseColMatRef::new_checked(self.size(), self.size(), &self.column_starts, None, &self.rows)
    }
}

/// A factorisation of S − σ B.
pub(crate) struct Factor<'a> {
    symbolic: &'a SymbolicCholesky<u32>,
    values: Vec<f64>,
}

impl Factor<'_> {
    /// X ← (S − σ B)⁻¹ X.
    pub(crate) fn solve(&self, x: MatMut<'_, f64>) {
        let scratch = self.symbolic.solve_in_place_scratch::<f64>(x.ncols(), Par::Seq);
        LdltRef::new(self.symbolic, &self.values).solve_in_place_with_conj(
            Conj::No,
            x,
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
        );
    }
}
