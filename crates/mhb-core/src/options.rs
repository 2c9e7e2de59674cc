use crate::{LaplacianKind, Mass, SpectrumError};

/// What to compute, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct SpectrumOptions {
    /// How many of the lowest pairs: m.
    pub count: usize,
    /// Which Laplacian of the mesh.
    pub laplacian: LaplacianKind,
    /// Which mass matrix B: lumped, or full.
    pub mass: Mass,
    /// Largest relative residual ‖S h − λ B h‖ / λ (in the norm of D⁻¹, for h of B-norm 1) that counts as converged. Eigenfunctions
    /// are orthonormal to a tenth of it.
    pub tolerance: f64,
    /// Width of the blocks that the solver iterates with, 1 to 64, rounded up to a multiple of 8. Changes the time, and the
    /// result within the tolerance.
    pub block: usize,
    /// How many pairs a band should hold, at least 1. Changes the time, and the result within the tolerance.
    pub band: usize,
}

impl Default for SpectrumOptions {
    fn default() -> Self {
        Self {
            count: 325,
            laplacian: LaplacianKind::Cotangent,
            mass: Mass::Lumped,
            tolerance: 1e-10,
            block: 8,
            band: 88,
        }
    }
}

impl SpectrumOptions {
    /// The same with every setting within its range, if a mesh of so many vertices has what is asked for.
    pub(crate) fn checked(&self, vertices: usize) -> Result<Self, SpectrumError> {
        let (count, tolerance) = (self.count, self.tolerance);
        if count == 0 || count > vertices {
            return Err(SpectrumError::Count { count, vertices });
        }
        if !(tolerance > 0.0 && tolerance < 1.0) {
            return Err(SpectrumError::Tolerance { tolerance });
        }
        Ok(Self {
            block: self.block.clamp(1, 64),
            band: self.band.max(1),
            ..self.clone()
        })
    }
}
