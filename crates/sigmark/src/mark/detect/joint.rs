//! The bits and what is left of a misalignment, estimated together from whatever was seen of the suspect.
//!
//! At a vertex of the original the suspect's displacement d, in diagonals, is known along some unit vectors u: along all axes
//! where the vertex itself was found again, along the normal where the surface was sampled. Each is an observation
//!
//! u·d = Σₜ Xₜ bₜ + Σᵧ Gᵧ θᵧ + e,  Xₜ = Σ α φ Hᵏ u_axis over the chips of bit t,
//!
//! with bits b = ±1, the seven fields G of a small similarity θ, fields of smoothing, and noise e. The estimate minimises
//!
//! Σ w e² + σ² Σ b²,  σ² the mean square of e,
//!
//! which is the best linear one where noise has no pattern, bits being as often 1 as −1. Samples of a suspect coarser than the
//! original are not independent: σ² is then as many times larger as there are samples to a vertex of the suspect. Vertices that
//! were not seen take no part. The mark is noise to θ, and θ takes nothing from the bits.
//!
//! **Smoothing.** Smoothing, decimation and subdivision move a surface towards the mean of its neighbourhood. With L x the way
//! from each vertex to the mean of its neighbours, k steps x ← x + λ L x with any λ, of either sign, displace by a polynomial
//! of degree k of L. So G has the fields L x, L² x, …, too: what any few steps do to the original is known but for these
//! coefficients, and is taken out. Without them a change of scale would have to account for it.
//!
//! **Facets.** A coarser suspect's flat triangles cut the corners of the original. What that does to each sample is known for
//! vertices on the original ([`Registered::facets`]), and is a field, too. Its coefficient is 1 for re-meshed suspects. Decimation
//! by quadrics puts vertices outside, so that facets cancel in the mean: what harmonics hold of the field, which is where the bits
//! are, has a coefficient of its own.
//!
//! **Weights.** w is what an observation stands for, times what its residual deserves. A sample of a surface stands for the mass
//! of its vertex, since errors of samples that are near each other are alike. A vertex that was found again has an error of its
//! own, however little surface there is around it: each stands for the mean mass. Where a surface was decimated or re-meshed, most
//! samples are good and a few, at edges and tips, are far off; and noise or rounding that follows the bounding box differs from
//! axis to axis. Noise is therefore taken for Student's t distribution, of the degrees of freedom ν and scale s that the residuals
//! of each [`Kind`] in a patch make likeliest: w ∝ mass · (ν + 1) / (ν s² + e²) (Lange, Little and Taylor 1989).

use std::f64::consts::{FRAC_1_PI, FRAC_1_SQRT_2};

use faer::{
    Accum, Mat, Par, Side,
    linalg::{
        matmul::triangular::{BlockStructure, matmul},
        solvers::Solve,
    },
};
use job::Job;
use mesh::{
    Similarity, TriMesh,
    vector::{add, dot, scaled, sub},
};

use super::Detector;
use crate::mark::{ChipLayout, MarkError, Original, Patch, PatchBasis, Registered, SoftBits};

/// Least squares over what was seen, with a misalignment left free.
///
/// Where the suspect's surface was sampled along normals, or parts of it are missing, chips disturb each other; this takes them
/// apart. What smoothing did to the shape is estimated and taken out, and samples that are far off count for little. Costs
/// #V l² operations.
#[derive(Clone, Copy, Debug, Default)]
pub struct LeastSquaresDetector;

impl Detector for LeastSquaresDetector {
    fn detect(
        &self,
        original: &Original,
        alphas: &[f64],
        suspect: &Registered,
        job: &Job,
    ) -> Result<SoftBits, MarkError> {
        let equations = Equations::of(original, alphas, suspect, job)?;
        Ok(SoftBits(equations.solve()?.bits))
    }
}

/// What the equations say.
pub(crate) struct Estimate {
    /// b, one a bit.
    pub(crate) bits: Vec<f64>,
    /// The small similarity by which the suspect is off, in the original's frame.
    pub(crate) misalignment: Similarity,
    /// The root mean square of e.
    pub(crate) noise: f64,
}

/// Scale, three of rotation, three of translation, those of smoothing, and those of facets.
const PARAMETERS: usize = SIMILARITY + SMOOTHINGS + FACETS;
const SIMILARITY: usize = 7;
/// Degree of the polynomial of L. Ten steps of Laplacian smoothing are known well with 8, and no better with 10.
const SMOOTHINGS: usize = 8;
/// What facets do, and what harmonics that carry chips hold of it.
const FACETS: usize = 2;

/// The normal equations: the Gram matrix of all columns X, G and d, by its lower triangle.
pub(crate) struct Equations {
    bits: usize,
    gram: Mat<f64>,
    observations: usize,
    /// Observations to an independent one.
    redundancy: f64,
    centre: [f64; 3],
    diagonal: f64,
    /// To the frame in which the centre is 0 and the diagonal 1.
    to_unit: Similarity,
    /// L x, L² x, … at each vertex of the original, in diagonals.
    smoothings: Vec<[[f64; 3]; SMOOTHINGS]>,
}

/// One observation at a vertex of a patch.
#[derive(Clone, Copy)]
struct Sight {
    vertex: usize,
    along: [f64; 3],
    /// u·d.
    displacement: f64,
    /// What facets do to u·d, and what harmonics hold of that.
    facets: [f64; FACETS],
    kind: Kind,
    /// What it stands for.
    mass: f64,
    /// What its residual deserves.
    trust: f64,
}

/// Observations of a kind have one distribution of noise.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// Coordinates of vertices that were found again.
    X,
    Y,
    Z,
    /// Samples of the surface.
    Surface,
}

/// The patch of some observations, and where its chips are.
struct View<'a> {
    layout: &'a ChipLayout,
    alpha: f64,
    patch: &'a Patch,
    basis: &'a PatchBasis,
}

/// Rows of the design matrix that are multiplied at a time.
const BLOCK: usize = 512;

/// A start for the noise, and its refinements, which converge at once.
const ROUNDS: usize = 6;

/// How often weights follow from residuals; they are all but settled then.
const REWEIGHTINGS: usize = 2;

/// With fewer observations, residuals say little about noise; more change weights by little.
const OBSERVATIONS_AN_UNKNOWN: usize = 8;

/// Added to the diagonal, relative to it: what the observations do not determine, such as a turn of a sphere, stays zero.
const RIDGE: f64 = 1e-12;

impl Equations {
    /// Collects what a registered suspect says.
    pub(crate) fn of(
        original: &Original,
        alphas: &[f64],
        suspect: &Registered,
        job: &Job,
    ) -> Result<Self, MarkError> {
        let bounds = original.mesh().bounding_box();
        let bits = original.layout().bits();
        let mut equations = Self {
            bits,
            gram: Mat::zeros(bits + PARAMETERS + 1, bits + PARAMETERS + 1),
            observations: 0,
            redundancy: suspect.redundancy(),
            centre: bounds.centre(),
            diagonal: bounds.diagonal(),
            to_unit: bounds.to_unit_frame(),
            smoothings: smoothings(original.mesh()),
        };
        let part = |index: usize, patch: &Patch, basis: &PatchBasis| {
            let view = View {
                layout: original.layout(),
                alpha: alphas[index],
                patch,
                basis,
            };
            let mut sights = sights(patch, basis, suspect, equations.diagonal);
            Ok::<_, MarkError>((equations.reweighted(&view, &mut sights)?, sights.len()))
        };
        for part in original.map_bases(part, job)? {
            let (gram, observations) = part?;
            equations.gram += gram;
            equations.observations += observations;
        }
        Ok(equations)
    }

    /// The Gram matrix of a patch's observations, each trusted as its residual deserves. Some of them are enough for the solutions
    /// that residuals are left by.
    fn reweighted(&self, view: &View<'_>, sights: &mut [Sight]) -> Result<Mat<f64>, MarkError> {
        let enough = OBSERVATIONS_AN_UNKNOWN * (self.bits + PARAMETERS);
        let rounds = if sights.len() < enough { 0 } else { REWEIGHTINGS };
        for _ in 0..rounds {
            // Axes take turns in the list: no stride of threes.
            let stride = sights.len() / enough;
            let stride = stride + usize::from(stride.is_multiple_of(3));
            let some: Vec<Sight> = sights.iter().step_by(stride).copied().collect();
            let solution = self.solution(&self.gram_of(view, &some), some.len())?;
            let residuals = self.residuals(view, sights, &solution);
            trust(sights, &residuals);
        }
        Ok(self.gram_of(view, sights))
    }

    /// The Gram matrix of a patch's observations.
    fn gram_of(&self, view: &View<'_>, sights: &[Sight]) -> Mat<f64> {
        let mut gram = Mat::zeros(self.gram.nrows(), self.gram.nrows());
        for block in sights.chunks(BLOCK) {
            let mut rows = self.rows(view, block);
            let roots: Vec<f64> = block
                .iter()
                .map(|sight| (sight.mass * sight.trust).sqrt())
                .collect();
            for j in 0..rows.ncols() {
                let column = rows.col_as_slice_mut(j).iter_mut();
                column.zip(&roots).for_each(|(entry, root)| *entry *= root);
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

    /// What a solution leaves of each observation.
    fn residuals(&self, view: &View<'_>, sights: &[Sight], solution: &Mat<f64>) -> Vec<f64> {
        let last = solution.nrows();
        let mut residuals = Vec::with_capacity(sights.len());
        for block in sights.chunks(BLOCK) {
            let rows = self.rows(view, block);
            let fitted = rows.get(.., ..last) * solution;
            residuals.extend((0..block.len()).map(|i| rows[(i, last)] - fitted[(i, 0)]));
        }
        residuals
    }

    /// X, G and u·d, one row an observation, without weights.
    fn rows(&self, view: &View<'_>, block: &[Sight]) -> Mat<f64> {
        let View { basis, patch, .. } = view;
        let amplitude = basis
            .size()
            .map(|phi| view.alpha * phi * basis.area().sqrt() / self.diagonal);
        let mut rows = Mat::<f64>::zeros(block.len(), self.gram.nrows());
        for chip in view.layout.chips() {
            let harmonic = basis.spectrum().eigenfunction(chip.frequency);
            let column = rows.col_as_slice_mut(chip.bit).iter_mut();
            for (entry, sight) in column.zip(block) {
                *entry += amplitude[chip.axis] * sight.along[chip.axis] * harmonic[sight.vertex];
            }
        }
        for (i, sight) in block.iter().enumerate() {
            let place = patch.mesh().positions()[sight.vertex];
            let place = std::array::from_fn(|axis| (place[axis] - self.centre[axis]) / self.diagonal);
            let smoothings = self.smoothings[patch.vertices()[sight.vertex] as usize];
            let fields = similarity_fields(place, sight.along).into_iter();
            let fields = fields.chain(smoothings.map(|field| dot(sight.along, field)));
            let fields = fields.chain(sight.facets);
            for (j, value) in fields.chain([sight.displacement]).enumerate() {
                rows[(i, self.bits + j)] = value;
            }
        }
        rows
    }

    /// What the equations say.
    pub(crate) fn solve(&self) -> Result<Estimate, MarkError> {
        let solution = self.solution(&self.gram, self.observations)?;
        let theta: [f64; SIMILARITY] = std::array::from_fn(|j| solution[(self.bits + j, 0)]);
        // The fields of translation are the components of u, which has length 1 or little more.
        let translations = self.bits + SIMILARITY - 3..self.bits + SIMILARITY;
        let weight: f64 = translations.map(|j| self.gram[(j, j)]).sum();
        Ok(Estimate {
            noise: (squares_left(&self.gram, &solution) / weight).sqrt(),
            bits: (0..self.bits).map(|t| solution[(t, 0)]).collect(),
            misalignment: self.similarity(theta),
        })
    }

    /// The unknowns that a Gram matrix of so many observations makes least, the noise estimated with them.
    fn solution(&self, gram: &Mat<f64>, observations: usize) -> Result<Mat<f64>, MarkError> {
        let unknowns = self.bits + PARAMETERS;
        let entry = |i: usize, j: usize| gram[(i.max(j), i.min(j))];
        let right = Mat::from_fn(unknowns, 1, |i, _| entry(unknowns, i));
        let mut solution = Mat::zeros(unknowns, 1);
        for _ in 0..ROUNDS {
            // σ² for the mean weight; the weights hold masses.
            let noise = squares_left(gram, &solution) / observations.max(1) as f64;
            let system = Mat::from_fn(unknowns, unknowns, |i, j| {
                let prior = if i < self.bits {
                    self.redundancy * noise
                } else {
                    0.0
                };
                let ridge = RIDGE * entry(i, i) + prior + f64::MIN_POSITIVE;
                entry(i, j) + if i == j { ridge } else { 0.0 }
            });
            let factor = system.llt(Side::Lower).map_err(|_| MarkError::Alignment)?;
            solution = factor.solve(&right);
        }
        Ok(solution)
    }

    /// The similarity with parameters θ of the frame in which the original's diagonal is 1 and its centre 0.
    fn similarity(&self, [scale, a, b, c, x, y, z]: [f64; SIMILARITY]) -> Similarity {
        let turn = Similarity {
            scale: 1.0 + scale,
            translation: [x, y, z],
            ..Similarity::from_quaternion([1.0, a / 2.0, b / 2.0, c / 2.0])
        };
        self.to_unit.then(&turn).then(&self.to_unit.inverse())
    }
}

/// Σ w e² of a solution.
fn squares_left(gram: &Mat<f64>, solution: &Mat<f64>) -> f64 {
    let unknowns = solution.nrows();
    let entry = |i: usize, j: usize| gram[(i.max(j), i.min(j))];
    let fitted: f64 = (0..unknowns).map(|i| solution[(i, 0)] * entry(unknowns, i)).sum();
    let quadratic: f64 = (0..unknowns)
        .map(|i| {
            let row: f64 = (0..unknowns).map(|j| entry(i, j) * solution[(j, 0)]).sum();
            solution[(i, 0)] * row
        })
        .sum();
    (entry(unknowns, unknowns) - 2.0 * fitted + quadratic).max(0.0)
}

/// What is known of the suspect at the vertices of a patch.
fn sights(patch: &Patch, basis: &PatchBasis, suspect: &Registered, diagonal: f64) -> Vec<Sight> {
    const AXES: [(Kind, [f64; 3]); 3] = [
        (Kind::X, [1.0, 0.0, 0.0]),
        (Kind::Y, [0.0, 1.0, 0.0]),
        (Kind::Z, [0.0, 0.0, 1.0]),
    ];
    let masses = basis.spectrum().mass();
    let mean_mass = masses.iter().sum::<f64>() / masses.len().max(1) as f64;
    let facets: Vec<[f64; 3]> = patch
        .gather(&suspect.facets)
        .iter()
        .map(|&f| [f, 0.0, 0.0])
        .collect();
    let held = basis.inverse_transform(&basis.transform(&facets));
    let mut sights = Vec::new();
    for (vertex, &v) in patch.vertices().iter().enumerate() {
        let Some(seen) = suspect.positions[v as usize] else {
            continue;
        };
        let place = patch.mesh().positions()[vertex];
        let mass = masses[vertex].max(0.0);
        let facets = [facets[vertex], held[vertex]].map(|[facet, ..]| facet / diagonal);
        let mut sight = |kind: Kind, along: [f64; 3], mass: f64| {
            let displacement = (0..3).map(|i| along[i] * (seen[i] - place[i])).sum::<f64>() / diagonal;
            sights.push(Sight {
                vertex,
                along,
                displacement,
                facets,
                kind,
                mass,
                trust: 1.0,
            });
        };
        match suspect.along[v as usize] {
            Some(normal) => sight(Kind::Surface, normal, mass),
            None => AXES
                .into_iter()
                .for_each(|(kind, along)| sight(kind, along, mean_mass)),
        }
    }
    sights
}

/// Gives observations the trust that their residuals deserve; the mean weight stays what it was without.
fn trust(sights: &mut [Sight], residuals: &[f64]) {
    let noises = [Kind::X, Kind::Y, Kind::Z, Kind::Surface].map(|kind| {
        let of_kind = sights
            .iter()
            .zip(residuals)
            .filter(|(sight, _)| sight.kind == kind);
        let weighted: Vec<(f64, f64)> = of_kind.map(|(sight, &e)| (sight.mass, e)).collect();
        StudentT::of(&weighted)
    });
    let largest = noises.iter().map(|noise| noise.scale).fold(0.0, f64::max);
    if largest == 0.0 {
        return;
    }
    let (mut before, mut after) = (0.0, 0.0);
    for (sight, &residual) in sights.iter_mut().zip(residuals) {
        let noise = &noises[sight.kind as usize];
        let relative = (noise.scale / largest).max(LEAST_SCALE);
        sight.trust = noise.weight(residual) / relative.powi(2);
        before += sight.mass;
        after += sight.mass * sight.trust;
    }
    let change = before / after;
    sights.iter_mut().for_each(|sight| sight.trust *= change);
}

/// Beside the least exact kind of observations, none counts as more exact than that: one without errors would be all that counts.
const LEAST_SCALE: f64 = 1e-3;

/// Student's t distribution of noise.
struct StudentT {
    /// Degrees of freedom; infinitely many are a normal distribution.
    freedom: f64,
    scale: f64,
}

/// Degrees of freedom to choose from, and the density at 0 for scale 1: Γ((ν + 1)/2) / (Γ(ν/2) √(νπ)).
const FREEDOMS: [(f64, f64); 6] = [
    (1.0, FRAC_1_PI),
    (2.0, FRAC_1_SQRT_2 / 2.0),
    (4.0, 3.0 / 8.0),
    (8.0, 0.386_699_020_961_393),
    (16.0, 0.392_761_230_468_75),
    (f64::INFINITY, 0.398_942_280_401_432_7),
];

/// Steps towards the likeliest scale, which come near to it at once.
const SCALE_STEPS: usize = 12;

impl StudentT {
    /// The likeliest of [`FREEDOMS`] for residuals with masses (mass, e), with the likeliest scale; scale 0 where nothing is left.
    fn of(residuals: &[(f64, f64)]) -> Self {
        let mass: f64 = residuals.iter().map(|&(mass, _)| mass).sum();
        let mean = |f: &dyn Fn(f64) -> f64| {
            let terms = residuals.iter().map(|&(mass, e)| mass * f(e * e));
            terms.sum::<f64>() / mass
        };
        let square = mean(&|square| square);
        let exact = Self {
            freedom: f64::INFINITY,
            scale: 0.0,
        };
        if residuals.is_empty() || square == 0.0 {
            return exact;
        }
        let mut best = (f64::NEG_INFINITY, exact);
        for (freedom, peak) in FREEDOMS {
            let mut noise = Self {
                freedom,
                scale: square.sqrt(),
            };
            for _ in 0..SCALE_STEPS {
                noise.scale = mean(&|square| square * noise.weight(square.sqrt())).sqrt();
            }
            let likelihood = (peak / noise.scale).ln() - mean(&|square| noise.fall(square));
            if likelihood > best.0 {
                best = (likelihood, noise);
            }
        }
        best.1
    }

    /// (ν + 1) / (ν + e²/s²).
    fn weight(&self, residual: f64) -> f64 {
        if self.freedom.is_infinite() {
            1.0
        } else {
            (self.freedom + 1.0) / (self.freedom + (residual / self.scale).powi(2))
        }
    }

    /// By how much the logarithm of the density is below that at 0.
    fn fall(&self, square: f64) -> f64 {
        let square = square / self.scale.powi(2);
        if self.freedom.is_infinite() {
            square / 2.0
        } else {
            (self.freedom + 1.0) / 2.0 * (square / self.freedom).ln_1p()
        }
    }
}

/// L x, L² x, … at each vertex, in diagonals.
fn smoothings(mesh: &TriMesh) -> Vec<[[f64; 3]; SMOOTHINGS]> {
    let diagonal = mesh.bounding_box().diagonal();
    let mut field: Vec<[f64; 3]> = mesh
        .positions()
        .iter()
        .map(|&p| scaled(p, 1.0 / diagonal))
        .collect();
    let mut all = vec![[[0.0; 3]; SMOOTHINGS]; mesh.vertex_count()];
    for k in 0..SMOOTHINGS {
        field = to_neighbours(mesh, &field);
        for (powers, &value) in all.iter_mut().zip(&field) {
            powers[k] = value;
        }
    }
    all
}

/// L applied to a field: from its value at each vertex to the mean of those at the neighbours; neighbours across two triangles, as
/// most are, count twice.
fn to_neighbours(mesh: &TriMesh, field: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let mut sums = vec![([0.0; 3], 0.0); field.len()];
    for &[a, b, c] in mesh.triangles() {
        for [v, next, last] in [[a, b, c], [b, c, a], [c, a, b]] {
            let (sum, count) = &mut sums[v as usize];
            for w in [next, last] {
                *sum = add(*sum, sub(field[w as usize], field[v as usize]));
                *count += 1.0;
            }
        }
    }
    sums.into_iter()
        .map(|(sum, count): ([f64; 3], f64)| scaled(sum, 1.0 / count.max(1.0)))
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
