use mhb_core::Spectrum;

/// The manifold harmonics of a patch in the scale-free convention: the patch is taken to unit area, so that Σ Dᵢᵢ = 1 and
/// every basis function has mean square 1. Coefficients keep the unit of length of the model.
#[derive(Debug)]
pub struct PatchBasis {
    spectrum: Spectrum,
    area: f64,
}

impl PatchBasis {
    pub(crate) fn new(spectrum: Spectrum) -> Self {
        let area = spectrum.mass().iter().sum();
        Self { spectrum, area }
    }

    /// The spectrum in the model's own unit.
    pub fn spectrum(&self) -> &Spectrum {
        &self.spectrum
    }

    /// The patch's area in the square of the model's unit.
    pub fn area(&self) -> f64 {
        self.area
    }

    /// The highest eigenvalue at unit area: tells whether two programs compute the same basis.
    pub fn last_eigenvalue(&self) -> f64 {
        self.spectrum.eigenvalues().last().copied().unwrap_or(0.0) * self.area
    }

    /// Coefficients of a vector field over the patch's vertices (MHT, eq. 6): m by 3.
    pub fn transform(&self, field: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let unit = self.area.sqrt().recip();
        let rows = self.spectrum.transform_positions(field).into_iter();
        rows.map(|row| row.map(|x| unit * x)).collect()
    }

    /// The vector field with given coefficients (IMHT, eq. 7): #V by 3.
    pub fn inverse_transform(&self, coefficients: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let unit = self.area.sqrt();
        let rows = self
            .spectrum
            .inverse_transform_positions(coefficients)
            .into_iter();
        rows.map(|row| row.map(|x| unit * x)).collect()
    }
}
