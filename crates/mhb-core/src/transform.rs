use crate::Spectrum;
use faer::{Accum, MatMut, MatRef, Par, linalg::matmul::matmul};

/// The manifold harmonic transform and its inverse.
///
/// Functions have one value a vertex (#V), coefficients one a pair (m); positions are three functions, x, y and z.
impl Spectrum {
    /// MHT (eq. 6): x̃_k = Σ_i x_i D_ii H_i^k (with full mass Σ_ij x_i B_ij H_j^k), of x, y and z at once: row k holds
    /// (x̃_k, ỹ_k, z̃_k).
    ///
    /// # Panics
    /// If there is not one position a vertex.
    pub fn transform_positions(&self, positions: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let (weighted, size) = (self.weighted(positions), self.eigenvalues().len());
        let mut coefficients = vec![[0.0; 3]; size];
        matmul(
            MatMut::from_row_major_slice_mut(coefficients.as_flattened_mut(), size, 3),
            Accum::Replace,
            self.eigenfunctions().transpose(),
            MatRef::from_row_major_slice(weighted.as_flattened(), positions.len(), 3),
            1.0,
            Par::Seq,
        );
        coefficients
    }

    /// IMHT (eq. 7): x′_i = Σ_k x̃_k H_i^k, of x, y and z at once: the mesh M′ that the coefficients describe.
    ///
    /// # Panics
    /// If there are more coefficients than pairs. Fewer stand for zeros at the end.
    pub fn inverse_transform_positions(&self, coefficients: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let size = self.mass().len();
        let mut positions = vec![[0.0; 3]; size];
        matmul(
            MatMut::from_row_major_slice_mut(positions.as_flattened_mut(), size, 3),
            Accum::Replace,
            self.eigenfunctions().subcols(0, coefficients.len()),
            MatRef::from_row_major_slice(coefficients.as_flattened(), coefficients.len(), 3),
            1.0,
            Par::Seq,
        );
        positions
    }

    /// Reconstruction difference (eq. 8): ΔM = M − IMHT(MHT(M)), what the m pairs do not span.
    ///
    /// # Panics
    /// If there is not one position a vertex.
    pub fn reconstruction_difference(&self, positions: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let reconstructed = self.inverse_transform_positions(&self.transform_positions(positions));
        positions
            .iter()
            .zip(reconstructed)
            .map(|(p, q)| [p[0] - q[0], p[1] - q[1], p[2] - q[2]])
            .collect()
    }

    /// B X.
    fn weighted(&self, values: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let Some(mass) = self.full_mass() else {
            let pairs = values.iter().zip(self.mass());
            return pairs.map(|(row, &mass)| row.map(|x| x * mass)).collect();
        };
        let entry = |sum: [f64; 3], (j, m): (usize, &f64)| [0, 1, 2].map(|c| sum[c] + m * values[j][c]);
        mass.outer_iterator()
            .map(|row| row.iter().fold([0.0; 3], entry))
            .collect()
    }
}
