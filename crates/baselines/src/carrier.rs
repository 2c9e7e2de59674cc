//! What a rival's mark is made of, whatever basis it comes from, and how it is written and read.

use faer::{Accum, Mat, MatMut, MatRef, Par, linalg::matmul::matmul};
use job::Job;
use sigmark::mark::{ChipLayout, Registered, SoftBits};

use crate::{
    BaselineError, Prepared,
    algorithm::{check_alpha, check_bits},
};

/// A chip, and how far α = 1 moves its coefficient.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chip {
    pub(crate) bit: usize,
    /// Column of the basis, from 0.
    pub(crate) function: usize,
    pub(crate) axis: usize,
    /// In the mesh's unit. Its sign belongs to what a 1 does.
    pub(crate) amplitude: f64,
}

/// A piece of a mesh with the functions that carry its mark.
#[derive(Debug)]
pub(crate) struct Carrier {
    /// The mesh vertex of each row.
    pub(crate) vertices: Vec<u32>,
    /// Orthonormal columns.
    pub(crate) functions: Mat<f64>,
    pub(crate) chips: Vec<Chip>,
}

impl Carrier {
    /// What the mark adds to each vertex of the piece: α Σ s amplitude f, along the chips' axes.
    fn displacement(&self, bits: &[bool], alpha: f64) -> Vec<[f64; 3]> {
        let mut coefficients = vec![[0.0; 3]; self.functions.ncols()];
        for chip in &self.chips {
            let sign = if bits[chip.bit] { 1.0 } else { -1.0 };
            coefficients[chip.function][chip.axis] += alpha * sign * chip.amplitude;
        }
        multiply(self.functions.as_ref(), &coefficients)
    }

    /// Adds, for each chip, how far its coefficient went the way of a 1.
    fn read(&self, difference: &[[f64; 3]], sums: &mut [f64]) {
        let here: Vec<[f64; 3]> = self.vertices.iter().map(|&v| difference[v as usize]).collect();
        let coefficients = coefficients(self.functions.as_ref(), &here);
        for chip in &self.chips {
            sums[chip.bit] += chip.amplitude.signum() * coefficients[chip.function][chip.axis];
        }
    }
}

/// The chips of a layout (eqs. 11–13) on functions without a constant one; `amplitude` of function and axis.
pub(crate) fn chips(layout: &ChipLayout, amplitude: impl Fn(usize, usize) -> f64) -> Vec<Chip> {
    layout
        .chips()
        .map(|chip| Chip {
            bit: chip.bit,
            function: chip.frequency - 1,
            axis: chip.axis,
            amplitude: amplitude(chip.frequency - 1, chip.axis),
        })
        .collect()
}

/// A mesh prepared for a rival.
#[derive(Debug)]
pub(crate) struct PreparedCarriers {
    pub(crate) bits: usize,
    /// How many functions were computed for each carrier.
    pub(crate) functions: usize,
    /// #V: what stands in the original's place, and bears the mark.
    pub(crate) base: Vec<[f64; 3]>,
    /// #V: what suspects are compared with.
    pub(crate) original: Vec<[f64; 3]>,
    pub(crate) carriers: Vec<Carrier>,
}

impl Prepared for PreparedCarriers {
    fn patches(&self) -> usize {
        self.carriers.len()
    }

    fn functions(&self) -> usize {
        self.functions
    }

    fn embed(&self, bits: &[bool], alpha: f64, _job: &Job) -> Result<Vec<[f64; 3]>, BaselineError> {
        check_bits(bits.len(), self.bits)?;
        check_alpha(alpha)?;
        let mut positions = self.base.clone();
        for carrier in &self.carriers {
            for (&v, added) in carrier.vertices.iter().zip(carrier.displacement(bits, alpha)) {
                let position = &mut positions[v as usize];
                *position = std::array::from_fn(|axis| position[axis] + added[axis]);
            }
        }
        Ok(positions)
    }

    /// Where the suspect was not seen, the original's vertex takes its place, as in section 4.4.1.
    fn extract(&self, suspect: &Registered, alpha: f64, _job: &Job) -> Result<SoftBits, BaselineError> {
        check_alpha(alpha)?;
        suspect.check(self.original.len())?;
        let pairs = suspect.positions.iter().zip(&self.original);
        let difference: Vec<[f64; 3]> = pairs
            .map(|(seen, v)| seen.map_or([0.0; 3], |r| std::array::from_fn(|axis| r[axis] - v[axis])))
            .collect();
        let mut sums = vec![0.0; self.bits];
        for carrier in &self.carriers {
            carrier.read(&difference, &mut sums);
        }
        Ok(SoftBits::new(sums))
    }
}

/// Fᵀ X: the coefficients of three functions, one row a basis function.
pub(crate) fn coefficients(functions: MatRef<'_, f64>, values: &[[f64; 3]]) -> Vec<[f64; 3]> {
    multiply(functions.transpose(), values)
}

/// A X for X with three columns.
fn multiply(a: MatRef<'_, f64>, x: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let mut product = vec![[0.0; 3]; a.nrows()];
    matmul(
        MatMut::from_row_major_slice_mut(product.as_flattened_mut(), a.nrows(), 3),
        Accum::Replace,
        a,
        MatRef::from_row_major_slice(x.as_flattened(), x.len(), 3),
        1.0,
        Par::Seq,
    );
    product
}
