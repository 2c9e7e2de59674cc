//! The pose of a suspect whose vertices are known to correspond to the original's.
//!
//! Plain least squares is pulled by the mark itself: the mark is not orthogonal to the coordinate functions, whose own
//! coefficients are far larger than a chip, so a little scale and rotation can swallow some bits. Generalised least squares
//! is not: to the fit, the mark is noise of known covariance. With e the residual field of the suspect under a
//! similarity, a = α φ the amplitude of a chip and σ² the variance of the noise at a vertex, the similarity minimises
//!
//! Σ over patches: area · ( ‖e⊥‖² + Σₖ s²/(s² + a²) êₖ² ),  s² = σ²/#V,
//!
//! where ê are the coefficients that chips modulate and e⊥ is what these do not span. Signs of bits do not enter.
//!
//! Every component of e is a combination of seven fields: the suspect's coordinates, the indicator of where it was seen, and
//! the original's coordinates there. Their Gram matrices are all that the minimisation needs of a patch.

use faer::{Mat, Side};
use job::Job;
use mesh::Similarity;
use registration::{Correspondence, PreparedMesh};

use crate::mark::{MarkError, MarkLayout, Patch, PatchBasis};

/// Gauss–Newton steps. The first fit is off by the size of the mark, and steps converge quadratically.
const STEPS: usize = 4;

/// The generalised least-squares fit of the suspect to the original, to which a mark of this layout is noise.
pub(super) fn fit(
    layout: &MarkLayout,
    suspect: &PreparedMesh,
    map: &Correspondence,
    job: &Job,
) -> Result<Similarity, MarkError> {
    let (original, suspect) = (layout.original(), suspect.mesh());
    let coarse = map.fit(original.mesh(), suspect)?.transform;
    let bounds = original.mesh().bounding_box();
    let (centre, diagonal) = (bounds.centre(), bounds.diagonal());
    let unit = |p: [f64; 3]| std::array::from_fn(|axis| (p[axis] - centre[axis]) / diagonal);
    let seen: Vec<Option<[f64; 3]>> = map
        .carry(suspect)
        .iter()
        .map(|s| s.map(|s| unit(coarse.apply(s))))
        .collect();

    let products = |index: usize, patch: &Patch, basis: &PatchBasis| {
        let reference: Vec<[f64; 3]> = patch.mesh().positions().iter().map(|&p| unit(p)).collect();
        let amplitude = layout.amplitude(index).map(|amplitude| amplitude / diagonal);
        PatchProducts::of(patch, basis, &patch.gather(&seen), &reference, amplitude)
    };
    let products = layout.map_seen(&seen, products, job)?;

    let mut fine = Similarity::IDENTITY;
    for _ in 0..STEPS {
        fine = fine.then(&step(&products, &fine)?);
    }
    let to_unit = bounds.to_unit_frame();
    Ok(coarse.then(&to_unit).then(&fine).then(&to_unit.inverse()))
}

/// Suspect x, y, z; indicator; original x, y, z.
const FIELDS: usize = 7;
const INDICATOR: usize = 3;
const REFERENCE: usize = 4;

type Gram = [[f64; FIELDS]; FIELDS];

/// What the minimisation needs of a patch, over unit area.
struct PatchProducts {
    area: f64,
    vertices: usize,
    /// a, along each axis.
    amplitude: [f64; 3],
    /// Of the coefficients that chips modulate.
    inside: Gram,
    /// Of what these do not span.
    outside: Gram,
}

impl PatchProducts {
    fn of(
        patch: &Patch,
        basis: &PatchBasis,
        seen: &[Option<[f64; 3]>],
        reference: &[[f64; 3]],
        amplitude: [f64; 3],
    ) -> Self {
        let vectors: [Vec<[f64; 3]>; 3] = [
            seen.iter().map(|s| s.unwrap_or([0.0; 3])).collect(),
            seen.iter()
                .map(|s| [f64::from(u8::from(s.is_some())), 0.0, 0.0])
                .collect(),
            seen.iter()
                .zip(reference)
                .map(|(s, &v)| s.map_or([0.0; 3], |_| v))
                .collect(),
        ];
        let coefficients = vectors.each_ref().map(|vector| {
            let mut coefficients = basis.transform(vector);
            coefficients[0] = [0.0; 3]; // no chip sits on the constant function
            coefficients
        });
        let rests: [Vec<[f64; 3]>; 3] = std::array::from_fn(|i| {
            let inside = basis.inverse_transform(&coefficients[i]);
            vectors[i]
                .iter()
                .zip(inside)
                .map(|(v, f)| std::array::from_fn(|axis| v[axis] - f[axis]))
                .collect()
        });
        let ones = vec![1.0; coefficients[0].len()];
        let masses: Vec<f64> = basis
            .spectrum()
            .mass()
            .iter()
            .map(|mass| mass / basis.area())
            .collect();
        Self {
            area: basis.area(),
            vertices: patch.vertices().len(),
            amplitude,
            inside: gram(&coefficients, &ones),
            outside: gram(&rests, &masses),
        }
    }

    /// Σ wₐ ⟨fₐ, gₐ⟩ over the axes, f and g given as combinations of the fields.
    fn product(&self, f: &[[f64; FIELDS]; 3], g: &[[f64; FIELDS]; 3], weight: [f64; 3]) -> f64 {
        let mut sum = 0.0;
        for axis in 0..3 {
            for i in 0..FIELDS {
                for j in 0..FIELDS {
                    let gram = self.outside[i][j] + weight[axis] * self.inside[i][j];
                    sum += f[axis][i] * gram * g[axis][j];
                }
            }
        }
        sum
    }

    /// s²/(s² + a²) along each axis, the noise estimated from the rest of the residual.
    fn weight(&self, residual: &[[f64; FIELDS]; 3]) -> [f64; 3] {
        let noise = self.product(residual, residual, [0.0; 3]).max(0.0) / (3 * self.vertices) as f64;
        self.amplitude
            .map(|a| noise / (noise + a * a).max(f64::MIN_POSITIVE))
    }
}

/// Gram matrix of the seven fields that three vector fields hold.
fn gram(vectors: &[Vec<[f64; 3]>; 3], weights: &[f64]) -> Gram {
    let mut gram = [[0.0; FIELDS]; FIELDS];
    for (k, &w) in weights.iter().enumerate() {
        let ([x, y, z], one, [u, v, t]) = (vectors[0][k], vectors[1][k][0], vectors[2][k]);
        let row = [x, y, z, one, u, v, t];
        for i in 0..FIELDS {
            for j in 0..FIELDS {
                gram[i][j] += w * row[i] * row[j];
            }
        }
    }
    gram
}

/// Parameters of a small similarity: one of scale, three of rotation, three of translation.
const PARAMETERS: usize = 7;

/// The small similarity after `fine` that lessens the generalised sum of squares most.
fn step(patches: &[PatchProducts], fine: &Similarity) -> Result<Similarity, MarkError> {
    // Rows: the suspect's x, y, z under `fine` as combinations of the fields.
    let moved: [[f64; FIELDS]; 3] = std::array::from_fn(|axis| {
        let [x, y, z] = fine.rotation[axis].map(|r| fine.scale * r);
        [x, y, z, fine.translation[axis], 0.0, 0.0, 0.0]
    });
    let mut residual = moved;
    for axis in 0..3 {
        residual[axis][REFERENCE + axis] -= 1.0;
    }
    let derivatives: [[[f64; FIELDS]; 3]; PARAMETERS] = std::array::from_fn(|p| derivative(p, &moved));
    let mut normal = [[0.0; PARAMETERS]; PARAMETERS];
    let mut gradient = [0.0; PARAMETERS];
    for patch in patches {
        let weight = patch.weight(&residual);
        for i in 0..PARAMETERS {
            gradient[i] += patch.area * patch.product(&derivatives[i], &residual, weight);
            for j in 0..=i {
                normal[i][j] += patch.area * patch.product(&derivatives[i], &derivatives[j], weight);
            }
        }
    }
    let [scale, a, b, c, x, y, z] = solve(normal, gradient)?;
    let rotation = Similarity::from_quaternion([1.0, a / 2.0, b / 2.0, c / 2.0]);
    Ok(Similarity {
        scale: 1.0 + scale,
        translation: [x, y, z],
        ..rotation
    })
}

/// How points move with a parameter: p, ω × p, or along an axis.
fn derivative(parameter: usize, [x, y, z]: &[[f64; FIELDS]; 3]) -> [[f64; FIELDS]; 3] {
    let (zero, minus) = ([0.0; FIELDS], |row: &[f64; FIELDS]| row.map(|value| -value));
    match parameter {
        0 => [*x, *y, *z],
        1 => [zero, minus(z), *y],
        2 => [*z, zero, minus(x)],
        3 => [minus(y), *x, zero],
        along => {
            let mut rows = [zero; 3];
            rows[along - 4][INDICATOR] = 1.0;
            rows
        }
    }
}

/// An eigenvalue of the scaled normal equations below this is rounding.
const UNDETERMINED: f64 = 1e-13;

/// θ of normal · θ = −gradient, `normal` given by its lower triangle. Directions that the equations do not determine, such as
/// a turn of a sphere, stay zero.
fn solve(
    normal: [[f64; PARAMETERS]; PARAMETERS],
    gradient: [f64; PARAMETERS],
) -> Result<[f64; PARAMETERS], MarkError> {
    let root: [f64; PARAMETERS] = std::array::from_fn(|i| normal[i][i].sqrt().max(f64::MIN_POSITIVE));
    let scaled = Mat::from_fn(PARAMETERS, PARAMETERS, |i, j| {
        normal[i.max(j)][i.min(j)] / (root[i] * root[j])
    });
    let eigen = scaled
        .self_adjoint_eigen(Side::Lower)
        .map_err(|_| MarkError::Alignment)?;
    let (vectors, values) = (eigen.U(), eigen.S().column_vector());
    let mut theta = [0.0; PARAMETERS];
    for k in 0..PARAMETERS {
        if values[k] > UNDETERMINED {
            let along: f64 = (0..PARAMETERS)
                .map(|i| vectors[(i, k)] * gradient[i] / root[i])
                .sum();
            for i in 0..PARAMETERS {
                theta[i] -= vectors[(i, k)] * along / (values[k] * root[i]);
            }
        }
    }
    Ok(theta)
}
