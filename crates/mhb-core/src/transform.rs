use crate::Spectrum;
use faer::{Accum, MatMut, MatRef, Par, linalg::matmul::matmul};

/// The manifold harmonic transform and its inverse.
///
/// Functions have one value a vertex (#V), coefficients one a pair (m); positions are three functions, x, y and z.
impl Spectrum {
    /// MHT (eq. 6): x̃_k = Σ_i x_i D_ii H_i^k (with full mass Σ_ij x_i B_ij H_j^k), for a function given by its `values` at the vertices.
    ///
    /// # Panics
    /// If there is not one value a vertex.
    pub fn transform(&self, values: &[f64]) -> Vec<f64> {
        let columns: Vec<[f64; 1]> = values.iter().map(|&x| [x]).collect();
        self.analyse(&columns).into_iter().map(|[x]| x).collect()
    }

    /// IMHT (eq. 7): x′_i = Σ_k x̃_k H_i^k.
    ///
    /// # Panics
    /// If there are more coefficients than pairs. Fewer stand for zeros at the end.
    pub fn inverse_transform(&self, coefficients: &[f64]) -> Vec<f64> {
        let columns: Vec<[f64; 1]> = coefficients.iter().map(|&x| [x]).collect();
        self.synthesise(&columns).into_iter().map(|[x]| x).collect()
    }

    /// MHT of x, y and z at once: row k holds (x̃_k, ỹ_k, z̃_k).
    ///
    /// # Panics
    /// If there is not one position a vertex.
    pub fn transform_positions(&self, positions: &[[f64; 3]]) -> Vec<[f64; 3]> {
        self.analyse(positions)
    }

    /// IMHT of x, y and z at once: the mesh M′ that the coefficients describe.
    ///
    /// # Panics
    /// If there are more coefficients than pairs. Fewer stand for zeros at the end.
    pub fn inverse_transform_positions(&self, coefficients: &[[f64; 3]]) -> Vec<[f64; 3]> {
        self.synthesise(coefficients)
    }

    /// Reconstruction difference (eq. 8): ΔM = M − IMHT(MHT(M)), what the m pairs do not span.
    ///
    /// # Panics
    /// If there is not one position a vertex.
    pub fn reconstruction_difference(&self, positions: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let reconstructed = self.synthesise(&self.analyse(positions));
        positions
            .iter()
            .zip(reconstructed)
            .map(|(p, q)| [p[0] - q[0], p[1] - q[1], p[2] - q[2]])
            .collect()
    }

    /// Hᵀ B X.
    fn analyse<const C: usize>(&self, values: &[[f64; C]]) -> Vec<[f64; C]> {
        let weighted = self.weighted(values);
        let mut coefficients = vec![[0.0; C]; self.len()];
        matmul(
            MatMut::from_row_major_slice_mut(coefficients.as_flattened_mut(), self.len(), C),
            Accum::Replace,
            self.eigenfunctions().transpose(),
            MatRef::from_row_major_slice(weighted.as_flattened(), values.len(), C),
            1.0,
            Par::Seq,
        );
        coefficients
    }

    /// B X.
    fn weighted<const C: usize>(&self, values: &[[f64; C]]) -> Vec<[f64; C]> {
        let Some(mass) = self.full_mass() else {
            let pairs = values.iter().zip(self.mass());
            return pairs.map(|(row, &mass)| row.map(|x| x * mass)).collect();
        };
        let entry = |sum: [f64; C], (j, m): (usize, &f64)| std::array::from_fn(|c| sum[c] + m * values[j][c]);
        mass.outer_iterator()
            .map(|row| row.iter().fold([0.0; C], entry))
            .collect()
    }

    /// H X̃.
    fn synthesise<const C: usize>(&self, coefficients: &[[f64; C]]) -> Vec<[f64; C]> {
        let mut values = vec![[0.0; C]; self.mass().len()];
        matmul(
            MatMut::from_row_major_slice_mut(values.as_flattened_mut(), self.mass().len(), C),
            Accum::Replace,
            self.eigenfunctions().subcols(0, coefficients.len()),
            MatRef::from_row_major_slice(coefficients.as_flattened(), coefficients.len(), C),
            1.0,
            Par::Seq,
        );
        values
    }
}
