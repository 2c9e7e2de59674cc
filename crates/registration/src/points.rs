use mesh::Similarity;

use crate::{Handedness, RegistrationError, fit_similarity};

/// A point of the suspect and the point of the original where it belongs: on the surfaces or near them, not
/// necessarily vertices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointPair {
    /// In the suspect's coordinates.
    pub suspect: [f64; 3],
    /// In the original's coordinates.
    pub original: [f64; 3],
}

/// Given points that lie farther off than this, root mean square, as a fraction of the original's diagonal, speak for
/// another pose than that of the vertices: fine alignment forgives a few hundredths.
pub(crate) const POINTS_APART: f64 = 0.1;

/// Points given by hand are off by about this fraction of the diagonal.
const BY_HAND: f64 = 0.01;

/// The similarities that pairs of points leave open: one of each hand, or one alone if the other hand does
/// not fit the pairs.
pub(crate) fn fits(diagonal: f64, pairs: &[PointPair]) -> Result<Vec<Similarity>, RegistrationError> {
    let (from, onto): (Vec<_>, Vec<_>) = pairs.iter().map(|pair| (pair.suspect, pair.original)).unzip();
    let proper = fit_similarity(&from, &onto, None, Handedness::Proper)?;
    let bound = 2.0 * proper.residual.min(proper.mirrored_residual) + BY_HAND * diagonal;
    let mut open = Vec::new();
    if proper.residual <= bound {
        open.push(proper.transform);
    }
    if proper.mirrored_residual <= bound {
        open.push(fit_similarity(&from, &onto, None, Handedness::Mirrored)?.transform);
    }
    Ok(open)
}
