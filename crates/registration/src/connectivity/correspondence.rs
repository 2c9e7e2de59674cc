use mesh::{Closed, TriMesh, Vec3};

use crate::{Fit, Handedness, RegistrationError, fit_similarity};

/// Which suspect vertex each original vertex became.
#[derive(Clone, Debug, PartialEq)]
pub struct Correspondence {
    /// The suspect's vertex for each vertex of the original, #V; none where that part of the original was not
    /// found, and for vertices that no triangle uses. No suspect vertex appears twice.
    pub suspect_of: Vec<Option<u32>>,
}

impl Correspondence {
    /// The map of two meshes whose triangles follow each other in the same order, corner by corner, as in files that were exported without a change of order; none where that maps a vertex to two or two to one.
    ///
    /// Where equal pieces have no place by which they could be told, nothing else tells them.
    pub fn by_order(original: &TriMesh, suspect: &TriMesh) -> Option<Self> {
        if original.triangle_count() != suspect.triangle_count() {
            return None;
        }
        let mut suspect_of = vec![None; original.vertex_count()];
        let mut original_of = vec![None; suspect.vertex_count()];
        let corners = original.triangles().as_flattened().iter();
        for (&v, &partner) in corners.zip(suspect.triangles().as_flattened()) {
            let there = *suspect_of[v as usize].get_or_insert(partner);
            let here = *original_of[partner as usize].get_or_insert(v);
            if (here, there) != (v, partner) {
                return None;
            }
        }
        Some(Self { suspect_of })
    }

    /// The map to a suspect that a map to it with closed seams stands for.
    pub(super) fn opened(mut self, closed: &Closed) -> Self {
        for image in self.suspect_of.iter_mut().flatten() {
            *image = closed.vertex_of()[*image as usize];
        }
        self
    }

    /// How many vertices of the original have a partner.
    pub fn matched(&self) -> usize {
        self.suspect_of.iter().flatten().count()
    }

    /// The suspect's position at each matched vertex of the original.
    pub fn carry(&self, suspect: &TriMesh) -> Vec<Option<[f64; 3]>> {
        self.suspect_of
            .iter()
            .map(|v| v.map(|v| suspect.positions()[v as usize]))
            .collect()
    }

    /// The least-squares similarity, of either hand, that takes the suspect's vertices to their partners in the original.
    ///
    /// Squares are summed in the suspect's frame, where its noise is, so that noise does not shrink the
    /// scale.
    ///
    /// # Errors
    /// When the matched vertices do not determine one: see [`fit_similarity`].
    pub fn fit(&self, original: &TriMesh, suspect: &TriMesh) -> Result<Fit, RegistrationError> {
        let (here, there) = self.pairs(original, suspect);
        inverse_fit(&here, &there, None)
    }

    /// As [`Self::fit`], with Welsch's weights exp(−r²/2m²), where m is the median of the distances r.
    ///
    /// Vertices that an attack left nearly in place count for more than those that it moved far, as smoothing
    /// moves those where the surface bends. The residual returned is weighted alike.
    ///
    /// # Errors
    /// As [`Self::fit`].
    pub fn fit_robustly(&self, original: &TriMesh, suspect: &TriMesh) -> Result<Fit, RegistrationError> {
        let (here, there) = self.pairs(original, suspect);
        let mut fit = inverse_fit(&here, &there, None)?;
        for _round in 0..ROBUST_ROUNDS {
            let apart = |(&x, &y): (&[f64; 3], &[f64; 3])| (fit.transform.apply(Vec3(y)) - Vec3(x)).norm();
            let distances: Vec<f64> = here.iter().zip(&there).map(apart).collect();
            let mut sorted = distances.clone();
            let middle = sorted.len() / 2;
            let (_, &mut median, _) = sorted.select_nth_unstable_by(middle, f64::total_cmp);
            if median <= 1e-14 * original.bounding_box().diagonal() {
                break;
            }
            let weights: Vec<f64> = distances
                .iter()
                .map(|r| (-0.5 * (r / median).powi(2)).exp())
                .collect();
            fit = inverse_fit(&here, &there, Some(&weights))?;
        }
        Ok(fit)
    }

    /// The positions of the matched vertices in the original and in the suspect.
    fn pairs(&self, original: &TriMesh, suspect: &TriMesh) -> (Vec<[f64; 3]>, Vec<[f64; 3]>) {
        let pairs = self.suspect_of.iter().zip(original.positions());
        pairs
            .filter_map(|(v, &here)| v.map(|v| (here, suspect.positions()[v as usize])))
            .unzip()
    }
}

/// Rounds of robust weights: a few settle, and none is needed where nothing is left to weigh.
const ROBUST_ROUNDS: usize = 10;

/// The fit of `there` to `here` that has the least squares in the frame of `there`.
fn inverse_fit(
    here: &[[f64; 3]],
    there: &[[f64; 3]],
    weights: Option<&[f64]>,
) -> Result<Fit, RegistrationError> {
    let Fit {
        transform,
        residual,
        mirrored_residual,
    } = fit_similarity(here, there, weights, Handedness::Either)?;
    let unit = 1.0 / transform.scale;
    let transform = transform.inverse();
    Ok(Fit {
        transform,
        residual: unit * residual,
        mirrored_residual: unit * mirrored_residual,
    })
}
