//! Alignment of a suspect whose vertices are known to correspond to the original's.
//!
//! Plain least squares is pulled by the mark itself: the mark is not orthogonal to the coordinate functions, whose own
//! coefficients are far larger than a chip, so a little scale and rotation can swallow some bits. Generalised least squares
//! is not: to the fit, the mark is noise of known covariance. With e the residual field, G its derivatives by the seven
//! parameters θ of a small similarity, a = α φ the amplitude of a chip and σ² the variance of the noise at a vertex, θ minimises
//!
//! Σ over patches: area · ( ‖(e + G θ)⊥‖² + Σₖ s²/(s² + a²) (ê + Ĝ θ)ₖ² ),  s² = σ²/#V,
//!
//! where ^ are the coefficients that chips modulate and ⊥ is what these do not span. Signs of bits do not enter.

use faer::{Mat, Side};
use mesh::{Similarity, TriMesh};
use registration::{Correspondence, Handedness};

use crate::{
    CoefficientDetector, Detector, PatchBasis, PreparedOriginal, Registered, SigmarkError, SoftBits,
};

/// A suspect in the original's frame, and the bits read from it there.
#[derive(Clone, Debug)]
pub(crate) struct Aligned {
    pub(crate) soft: SoftBits,
    /// Takes the suspect to the original.
    pub(crate) transform: Similarity,
    /// Share of the original's vertices that were seen.
    pub(crate) overlap: f64,
    /// RMS distance of corresponding points, in the original's unit.
    pub(crate) residual: f64,
}

/// Gauss–Newton steps. The first fit is off by the size of the mark, and steps converge quadratically.
const STEPS: usize = 3;

/// Aligns the suspect with the original, marked with strengths `alphas`, and reads the bits.
pub(crate) fn align_and_detect(
    original: &PreparedOriginal,
    alphas: &[f64],
    suspect: &TriMesh,
    correspondence: &Correspondence,
) -> Result<Aligned, SigmarkError> {
    let mut transform = correspondence
        .fit(original.mesh(), suspect, Handedness::Either)?
        .transform;
    let seen = correspondence.carry(suspect);
    let place = |transform: &Similarity| Registered {
        positions: seen.iter().map(|s| s.map(|s| transform.apply(s))).collect(),
    };
    for _ in 0..STEPS {
        transform = transform.then(&step(original, alphas, &place(&transform))?);
    }
    let registered = place(&transform);
    let pairs = registered.positions.iter().zip(original.mesh().positions());
    let squares = pairs.filter_map(|(r, v)| r.map(|r| squared_distance(r, *v)));
    let matched = correspondence.matched();
    Ok(Aligned {
        residual: (squares.sum::<f64>() / matched as f64).sqrt(),
        overlap: matched as f64 / seen.len() as f64,
        soft: CoefficientDetector.detect(original, &registered),
        transform,
    })
}

/// Parameters of a small similarity about a centre: one of scale, three of rotation, three of translation.
const PARAMETERS: usize = 7;

/// The small similarity that lessens the generalised sum of squares most.
fn step(
    original: &PreparedOriginal,
    alphas: &[f64],
    suspect: &Registered,
) -> Result<Similarity, SigmarkError> {
    let bounds = original.mesh().bounding_box();
    let (centre, length) = (bounds.centre(), bounds.diagonal());
    let mut normal = [[0.0; PARAMETERS]; PARAMETERS];
    let mut gradient = [0.0; PARAMETERS];
    for (basis, &alpha) in original.bases().iter().zip(alphas) {
        let seen = basis.patch().gather(&suspect.positions);
        let residual = Split::of(
            original,
            basis,
            residual_field(&seen, basis.patch().mesh().positions()),
        );
        let derivatives: [Split; PARAMETERS] = std::array::from_fn(|parameter| {
            let field = seen
                .iter()
                .map(|r| r.map_or([0.0; 3], |r| derivative(parameter, offset(r, centre, length))));
            Split::of(original, basis, field.collect())
        });
        // Both in the measure of unit area, where coefficients have the variance of the noise over the number of vertices.
        let noise = residual.outside_variance() / seen.len() as f64;
        let weight = basis
            .size()
            .map(|phi| noise / (noise + (alpha * phi).powi(2)).max(f64::MIN_POSITIVE));
        for i in 0..PARAMETERS {
            gradient[i] += basis.area() * derivatives[i].product(&residual, basis, weight);
            for j in 0..=i {
                normal[i][j] += basis.area() * derivatives[i].product(&derivatives[j], basis, weight);
            }
        }
    }
    let theta = solve(normal, gradient)?;
    let rotation = Similarity::from_quaternion([1.0, theta[1] / 2.0, theta[2] / 2.0, theta[3] / 2.0]);
    let turned = Similarity {
        scale: 1.0 + theta[0],
        ..rotation
    };
    let moved = turned.apply(centre);
    let translation = std::array::from_fn(|axis| centre[axis] - moved[axis] + length * theta[4 + axis]);
    Ok(Similarity {
        translation,
        ..turned
    })
}

/// Suspect less original; zero where the suspect was not seen.
fn residual_field(seen: &[Option<[f64; 3]>], reference: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let difference = |(r, v): (&Option<[f64; 3]>, &[f64; 3])| {
        r.map_or([0.0; 3], |r| std::array::from_fn(|axis| r[axis] - v[axis]))
    };
    seen.iter().zip(reference).map(difference).collect()
}

/// The place relative to the centre, with the diagonal as the unit, and the diagonal.
fn offset(r: [f64; 3], centre: [f64; 3], length: f64) -> ([f64; 3], f64) {
    (
        std::array::from_fn(|axis| (r[axis] - centre[axis]) / length),
        length,
    )
}

/// How a point moves with a parameter: x, ω × x, or along an axis, times the diagonal.
fn derivative(parameter: usize, ([x, y, z], length): ([f64; 3], f64)) -> [f64; 3] {
    let unit = match parameter {
        0 => [x, y, z],
        1 => [0.0, -z, y],
        2 => [z, 0.0, -x],
        3 => [-y, x, 0.0],
        axis => std::array::from_fn(|i| f64::from(u8::from(i == axis - 4))),
    };
    unit.map(|component| length * component)
}

/// A field over a patch, split into what chips could have written and the rest.
struct Split {
    /// Coefficients that chips modulate, others zero: m by 3.
    inside: Vec<[f64; 3]>,
    /// The field less their reconstruction.
    outside: Vec<[f64; 3]>,
}

impl Split {
    fn of(original: &PreparedOriginal, basis: &PatchBasis, mut field: Vec<[f64; 3]>) -> Self {
        let coefficients = basis.transform(&field);
        let mut inside = vec![[0.0; 3]; coefficients.len()];
        for chip in original.layout().chips() {
            inside[chip.frequency][chip.axis] = coefficients[chip.frequency][chip.axis];
        }
        for (f, r) in field.iter_mut().zip(basis.inverse_transform(&inside)) {
            *f = std::array::from_fn(|axis| f[axis] - r[axis]);
        }
        Self {
            inside,
            outside: field,
        }
    }

    /// Mean square per coordinate of the rest.
    fn outside_variance(&self) -> f64 {
        let sum: f64 = self.outside.iter().flatten().map(|x| x * x).sum();
        sum / (3 * self.outside.len()) as f64
    }

    /// The weighted inner product, over unit area.
    fn product(&self, other: &Self, basis: &PatchBasis, weight: [f64; 3]) -> f64 {
        let dot = |a: &[f64; 3], b: &[f64; 3], w: [f64; 3]| {
            (0..3).map(|axis| w[axis] * a[axis] * b[axis]).sum::<f64>()
        };
        let inside: f64 = self
            .inside
            .iter()
            .zip(&other.inside)
            .map(|(a, b)| dot(a, b, weight))
            .sum();
        let masses = basis.spectrum().mass().iter();
        let outside: f64 = masses
            .zip(&self.outside)
            .zip(&other.outside)
            .map(|((m, a), b)| m * dot(a, b, [1.0; 3]))
            .sum();
        inside + outside / basis.area()
    }
}

/// θ of normal · θ = −gradient, `normal` given by its lower triangle. Directions that the equations do not determine, such as
/// a turn of a sphere, stay zero.
fn solve(
    normal: [[f64; PARAMETERS]; PARAMETERS],
    gradient: [f64; PARAMETERS],
) -> Result<[f64; PARAMETERS], SigmarkError> {
    let root: [f64; PARAMETERS] = std::array::from_fn(|i| normal[i][i].sqrt().max(f64::MIN_POSITIVE));
    let scaled = Mat::from_fn(PARAMETERS, PARAMETERS, |i, j| {
        normal[i.max(j)][i.min(j)] / (root[i] * root[j])
    });
    let eigen = scaled
        .self_adjoint_eigen(Side::Lower)
        .map_err(|_| SigmarkError::Alignment)?;
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

/// An eigenvalue of the scaled normal equations below this is rounding.
const UNDETERMINED: f64 = 1e-13;

fn squared_distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum()
}
