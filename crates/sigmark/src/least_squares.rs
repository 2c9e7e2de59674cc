//! The bits and what is left of a misalignment, estimated together from whatever was seen of the suspect.
//!
//! At a vertex of the original the suspect's displacement d, in diagonals, is known along some unit vectors u: along all axes
//! where the vertex itself was found again, along the normal where the surface was sampled. Each is an observation
//!
//! u·d = Σₜ Xₜ bₜ + Σᵧ Gᵧ θᵧ + e,  Xₜ = Σ α φ Hᵏ u_axis over the chips of bit t,
//!
//! with bits b = ±1, the seven fields G of a small similarity θ, an eighth of a step of smoothing, and noise e. Smoothing,
//! decimation and subdivision move a surface towards the mean of its neighbourhood; without the eighth field a change of scale
//! would have to account for that. The estimate minimises
//!
//! Σ w e² + σ² Σ b²,  w the mass of the vertex, σ² the mean square of e,
//!
//! which is the best linear one where noise has no pattern, bits being as often 1 as −1. Samples of a suspect coarser than the
//! original are not independent: σ² is then as many times larger as there are samples to a vertex of the suspect. Vertices that were not seen take
//! no part. The mark is noise to θ, and θ takes nothing from the bits.

use faer::{
    Accum, Mat, Par, Side,
    linalg::{
        matmul::triangular::{BlockStructure, matmul},
        solvers::Solve,
    },
};
use mesh::{
    Similarity, TriMesh,
    vector::{add, dot, scaled, sub},
};

use crate::{Detector, Original, Patch, PatchBasis, Registered, SigmarkError, SoftBits, Work};

/// Least squares over what was seen, with a misalignment left free.
///
/// Where the suspect's surface was sampled along normals, or parts of it are missing, chips disturb each other; this takes them
/// apart. Costs #V l² operations.
#[derive(Clone, Copy, Debug, Default)]
pub struct LeastSquaresDetector;

impl Detector for LeastSquaresDetector {
    fn detect(
        &self,
        original: &Original,
        alphas: &[f64],
        suspect: &Registered,
        work: Work<'_>,
    ) -> Result<SoftBits, SigmarkError> {
        let equations = Equations::of(original, alphas, suspect, work, |_, _| Ok(()))?;
        Ok(SoftBits(equations.solve()?.bits))
    }
}

/// What the equations say.
pub(crate) struct Estimate {
    /// b, one a bit.
    pub(crate) bits: Vec<f64>,
    /// The small similarity by which the suspect is off, in the original's frame.
    pub(crate) misalignment: Similarity,
}

/// Scale, three of rotation, three of translation, one of smoothing.
const PARAMETERS: usize = SIMILARITY + 1;
const SIMILARITY: usize = 7;

/// The normal equations: the Gram matrix of all columns X, G and d, by its lower triangle.
pub(crate) struct Equations {
    bits: usize,
    gram: Mat<f64>,
    observations: usize,
    /// Observations to an independent one.
    redundancy: f64,
    centre: [f64; 3],
    diagonal: f64,
    /// From each vertex of the original to the mean of its neighbours, in diagonals.
    smoothing: Vec<[f64; 3]>,
}

/// One observation at a vertex of a patch.
struct Sight {
    vertex: usize,
    along: [f64; 3],
    /// u·d.
    displacement: f64,
    /// √w.
    root_weight: f64,
}

/// Rows of the design matrix that are multiplied at a time.
const BLOCK: usize = 512;

/// A start for the noise, and its refinements, which converge at once.
const ROUNDS: usize = 6;

/// Added to the diagonal, relative to it: what the observations do not determine, such as a turn of a sphere, stays zero.
const RIDGE: f64 = 1e-12;

impl Equations {
    /// Collects what a registered suspect says. `check` sees the basis of each patch.
    pub(crate) fn of(
        original: &Original,
        alphas: &[f64],
        suspect: &Registered,
        work: Work<'_>,
        check: impl Fn(usize, &PatchBasis) -> Result<(), SigmarkError> + Sync,
    ) -> Result<Self, SigmarkError> {
        let bounds = original.mesh().bounding_box();
        let bits = original.layout().bits();
        let mut equations = Self {
            bits,
            gram: Mat::zeros(bits + PARAMETERS + 1, bits + PARAMETERS + 1),
            observations: 0,
            redundancy: suspect.redundancy(),
            centre: bounds.centre(),
            diagonal: bounds.diagonal(),
            smoothing: smoothing(original.mesh()),
        };
        let parts = original.map_bases(work, |index, patch, basis| {
            check(index, basis)?;
            let sights = sights(patch, basis, suspect, equations.diagonal);
            let gram = equations.gram_of(original, alphas[index], patch, basis, &sights);
            Ok::<_, SigmarkError>((gram, sights.len()))
        })?;
        for part in parts {
            let (gram, observations) = part?;
            equations.gram += gram;
            equations.observations += observations;
        }
        Ok(equations)
    }

    /// The Gram matrix of a patch's observations.
    fn gram_of(
        &self,
        original: &Original,
        alpha: f64,
        patch: &Patch,
        basis: &PatchBasis,
        sights: &[Sight],
    ) -> Mat<f64> {
        let amplitude = basis
            .size()
            .map(|phi| alpha * phi * basis.area().sqrt() / self.diagonal);
        let mut gram = Mat::zeros(self.gram.nrows(), self.gram.nrows());
        for block in sights.chunks(BLOCK) {
            let mut rows = Mat::<f64>::zeros(block.len(), gram.nrows());
            for chip in original.layout().chips() {
                let harmonic = basis.spectrum().eigenfunction(chip.frequency);
                for (i, sight) in block.iter().enumerate() {
                    rows[(i, chip.bit)] += amplitude[chip.axis]
                        * sight.root_weight
                        * sight.along[chip.axis]
                        * harmonic[sight.vertex];
                }
            }
            for (i, sight) in block.iter().enumerate() {
                let place = patch.mesh().positions()[sight.vertex];
                let place = std::array::from_fn(|axis| (place[axis] - self.centre[axis]) / self.diagonal);
                let fields = similarity_fields(place, sight.along);
                let smoothed = dot(
                    sight.along,
                    self.smoothing[patch.vertices()[sight.vertex] as usize],
                );
                let last = [smoothed, sight.displacement];
                for (j, value) in fields.into_iter().chain(last).enumerate() {
                    rows[(i, self.bits + j)] = sight.root_weight * value;
                }
            }
            matmul(
                gram.as_mut(),
                BlockStructure::TriangularLower,
                Accum::Add,
                rows.transpose(),
                BlockStructure::Rectangular,
                rows.as_ref(),
                BlockStructure::Rectangular,
                1.0,
                Par::Seq,
            );
        }
        gram
    }

    /// The estimate, the noise estimated with it.
    pub(crate) fn solve(&self) -> Result<Estimate, SigmarkError> {
        let unknowns = self.bits + PARAMETERS;
        let entry = |i: usize, j: usize| self.gram[(i.max(j), i.min(j))];
        let right = Mat::from_fn(unknowns, 1, |i, _| entry(unknowns, i));
        let squares = entry(unknowns, unknowns);
        let mut solution = Mat::zeros(unknowns, 1);
        for _ in 0..ROUNDS {
            let fitted: f64 = (0..unknowns).map(|i| solution[(i, 0)] * right[(i, 0)]).sum();
            let quadratic: f64 = (0..unknowns)
                .map(|i| {
                    let row: f64 = (0..unknowns).map(|j| entry(i, j) * solution[(j, 0)]).sum();
                    solution[(i, 0)] * row
                })
                .sum();
            // σ² for the mean weight; the weights are masses.
            let noise = (squares - 2.0 * fitted + quadratic).max(0.0) / self.observations.max(1) as f64;
            let system = Mat::from_fn(unknowns, unknowns, |i, j| {
                let prior = if i < self.bits {
                    self.redundancy * noise
                } else {
                    0.0
                };
                let ridge = RIDGE * entry(i, i) + prior + f64::MIN_POSITIVE;
                entry(i, j) + if i == j { ridge } else { 0.0 }
            });
            let factor = system.llt(Side::Lower).map_err(|_| SigmarkError::Alignment)?;
            solution = factor.solve(&right);
        }
        let theta: [f64; SIMILARITY] = std::array::from_fn(|j| solution[(self.bits + j, 0)]);
        Ok(Estimate {
            bits: (0..self.bits).map(|t| solution[(t, 0)]).collect(),
            misalignment: self.similarity(theta),
        })
    }

    /// The similarity with parameters θ of the frame in which the original's diagonal is 1 and its centre 0.
    fn similarity(&self, [scale, a, b, c, x, y, z]: [f64; SIMILARITY]) -> Similarity {
        let turn = Similarity {
            scale: 1.0 + scale,
            translation: [x, y, z],
            ..Similarity::from_quaternion([1.0, a / 2.0, b / 2.0, c / 2.0])
        };
        let to_unit = Similarity {
            scale: 1.0 / self.diagonal,
            translation: self.centre.map(|x| -x / self.diagonal),
            ..Similarity::IDENTITY
        };
        to_unit.then(&turn).then(&to_unit.inverse())
    }
}

/// What is known of the suspect at the vertices of a patch.
fn sights(patch: &Patch, basis: &PatchBasis, suspect: &Registered, diagonal: f64) -> Vec<Sight> {
    const AXES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut sights = Vec::new();
    for (vertex, &v) in patch.vertices().iter().enumerate() {
        let Some(seen) = suspect.positions[v as usize] else {
            continue;
        };
        let place = patch.mesh().positions()[vertex];
        let root_weight = basis.spectrum().mass()[vertex].max(0.0).sqrt();
        let mut sight = |along: [f64; 3]| {
            let displacement = (0..3).map(|i| along[i] * (seen[i] - place[i])).sum::<f64>() / diagonal;
            sights.push(Sight {
                vertex,
                along,
                displacement,
                root_weight,
            });
        };
        match suspect.along[v as usize] {
            Some(normal) => sight(normal),
            None => AXES.into_iter().for_each(&mut sight),
        }
    }
    sights
}

/// From each vertex to the mean of its neighbours, in diagonals; neighbours across two triangles, as most are, count twice.
fn smoothing(mesh: &TriMesh) -> Vec<[f64; 3]> {
    let mut sums = vec![([0.0; 3], 0.0); mesh.vertex_count()];
    let positions = mesh.positions();
    for &[a, b, c] in mesh.triangles() {
        for [v, next, last] in [[a, b, c], [b, c, a], [c, a, b]] {
            let here = positions[v as usize];
            let (sum, count) = &mut sums[v as usize];
            for w in [next, last] {
                *sum = add(*sum, sub(positions[w as usize], here));
                *count += 1.0;
            }
        }
    }
    let diagonal = mesh.bounding_box().diagonal();
    sums.into_iter()
        .map(|(sum, count): ([f64; 3], f64)| scaled(sum, 1.0 / (count.max(1.0) * diagonal)))
        .collect()
}

/// u·p, u·(eᵢ × p) and u·eᵢ: how a point p moves along u with each parameter.
fn similarity_fields([x, y, z]: [f64; 3], [u, v, w]: [f64; 3]) -> [f64; SIMILARITY] {
    [
        u * x + v * y + w * z,
        w * y - v * z,
        u * z - w * x,
        v * x - u * y,
        u,
        v,
        w,
    ]
}
