//! Fine alignment: iterated closest points on both surfaces, point to plane, with scale.
//!
//! With T the transform so far, every sample p of the suspect is paired with the nearest point q of the
//! original, n its triangle's normal, and every sample q of the original, n its normal, with the nearest
//! point p of the suspect. A step x ↦ c + e^σ R(ω)(x − c) + τ then minimises, to first order, Σ wᵢ rᵢ² with
//! rᵢ = nᵢ·(T pᵢ − qᵢ) + ω·((T pᵢ − c) × nᵢ) + τ·nᵢ + σ nᵢ·(T pᵢ − c). Pairs in both directions keep the
//! scale from shrinking where the surfaces overlap in part: a shrunken suspect leaves samples of the original
//! without partner. Weights are Welsch's, exp(−r²/2ν²) with ν the robust standard deviation, since attacks
//! move a surface most where it bends; pairs farther apart than a closing gate, and pairs whose difference is
//! not along the normal, as on a border, are left out.
//!
//! Where the surfaces agree, r goes to zero and the steps converge quadratically to rounding (Pottmann et al.
//! 2006).

use faer::{Mat, Side};
use job::{Job, JobError};
use mesh::{Similarity, Vec3};

use crate::sampled::{GRAIN, Sampled};

/// How much work to put into a refinement.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    /// Samples of each surface.
    pub(crate) samples: usize,
    /// Most steps.
    pub(crate) steps: usize,
    /// Pairs farther apart at first are left out, as a fraction of the original's diagonal.
    pub(crate) gate: f64,
}

/// Which points are paired with the other surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Pairing {
    /// Samples of both surfaces, each with a sample of the other about nearest to it: quick, and right to the
    /// samples' spacing.
    Grid,
    /// Samples of both surfaces, each with the nearest point of the other.
    Surfaces,
    /// The suspect's vertices alone: re-meshing leaves them on the surface, and cuts the corners in between.
    Vertices,
}

/// Where a refinement ended.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Refined {
    pub(crate) transform: Similarity,
    /// Robust standard deviation of the residuals, as a fraction of the original's diagonal.
    pub(crate) deviation: f64,
}

// How these numbers were chosen and what was measured of others, the comment of the module `search` says.

/// Least |cos| between a pair's difference and the normal. With 0.35 the errors of noisy suspects are a tenth smaller, with 0.9 a
/// fifth larger.
const ALONG_NORMAL: f64 = 0.7;

/// The gate never closes below this fraction of the diagonal. With a tenth or ten times as much no error of 8 finely refined
/// suspects changes.
const NARROWEST_GATE: f64 = 1e-4;

/// Fewer pairs than this are no basis for seven unknowns. With half or twice as many no error of 8 finely refined suspects
/// changes, nor what slides.
const FEWEST_PAIRS: usize = 20;

/// Directions in which the surfaces slide on each other almost freely, by their share of the stiffest, are not moved
/// along: what the equations say of them is rounding. With 1e-13 or 1e-9 no error of 8 finely refined suspects changes.
const SLIPPERY: f64 = 1e-11;

/// How far beside each other samples that are about nearest may lie, as a fraction of the diagonal. With half or twice as much
/// none of 15 mixed suspects changes, in 1.2 and 0.8 of the time.
const SPACING: f64 = 0.03;

type Row = ([f64; 7], f64);

/// Refines `start`; none when too few pairs remain or the scale runs away.
pub(crate) fn refine(
    original: &Sampled,
    suspect: &Sampled,
    start: Similarity,
    effort: Effort,
    pairing: Pairing,
    job: &Job,
) -> Result<Option<Refined>, JobError> {
    let mut transform = start;
    let mut deviation = f64::INFINITY;
    let mut gate = effort.gate * original.diagonal;
    let mut last = f64::INFINITY;
    for step in 0..effort.steps {
        let laid = Laid {
            original,
            suspect,
            transform: &transform,
            gate,
        };
        let rows = match pairing {
            Pairing::Grid => laid.grid_rows(effort.samples),
            Pairing::Surfaces => laid.sample_rows(effort.samples, job)?,
            Pairing::Vertices => laid.vertex_rows(job)?,
        };
        if rows.len() < FEWEST_PAIRS {
            return Ok(None);
        }
        deviation = robust_deviation(&rows);
        let Some(change) = solve(&rows, deviation.max(1e-15)) else {
            return Ok(None);
        };
        let (moved, size) = moved(&transform, &change, original);
        transform = moved;
        if !(transform.scale.is_finite() && transform.scale > 0.0) {
            return Ok(None);
        }
        // A step far smaller than the error of an estimate from so many rows says nothing; nor does one of
        // rounding.
        let insignificant = 0.01 * deviation / (rows.len() as f64).sqrt();
        if size < insignificant.max(1e-15) || (step > 4 && size < 1e-12 && size >= 0.5 * last) {
            break;
        }
        last = size;
        gate = (0.7 * gate).max((6.0 * deviation).max(NARROWEST_GATE) * original.diagonal);
    }
    Ok(Some(Refined { transform, deviation }))
}

/// A suspect laid onto its original by a transform, of which points are paired that are no farther apart than the gate.
struct Laid<'a> {
    original: &'a Sampled,
    suspect: &'a Sampled,
    transform: &'a Similarity,
    gate: f64,
}

impl Laid<'_> {
    /// The row of a moved suspect point p and a point q of the original with normal n, lengths in units of the
    /// original's diagonal.
    fn row(&self, p: Vec3, q: Vec3, n: Vec3) -> Option<Row> {
        let difference = p - q;
        let (distance, along) = (difference.norm(), n.dot(difference));
        if distance > 1e-9 * self.original.diagonal && along.abs() < ALONG_NORMAL * distance {
            return None;
        }
        Some(self.plain_row(p, n, along))
    }

    fn plain_row(&self, p: Vec3, n: Vec3, along: f64) -> Row {
        let arm = (p - self.original.centroid) * (1.0 / self.original.diagonal);
        let (Vec3([a, b, c]), Vec3([x, y, z])) = (arm.cross(n), n);
        ([a, b, c, x, y, z, n.dot(arm)], along / self.original.diagonal)
    }

    /// The rows of `count` points of the suspect, each with the nearest point of the original.
    fn forward(
        &self,
        count: usize,
        point: impl Fn(usize) -> Vec3 + Sync + Send,
        job: &Job,
    ) -> Result<Vec<Row>, JobError> {
        let row = |i: usize| {
            let p = self.transform.apply(point(i));
            let nearest = self.original.surface.nearest_within(p.0, self.gate)?;
            let normal = self.original.triangle_normal(nearest.triangle);
            self.row(p, Vec3(nearest.point), normal)
        };
        Ok(job.map(count, GRAIN, row)?.into_iter().flatten().collect())
    }

    fn vertex_rows(&self, job: &Job) -> Result<Vec<Row>, JobError> {
        let vertices = &self.suspect.vertices;
        self.forward(vertices.len(), |i| vertices[i], job)
    }

    /// The rows of samples of the suspect.
    fn forward_rows(&self, samples: usize, job: &Job) -> Result<Vec<Row>, JobError> {
        let picked: Vec<usize> = self.suspect.some(samples).collect();
        self.forward(picked.len(), |i| self.suspect.points[picked[i]], job)
    }

    fn sample_rows(&self, samples: usize, job: &Job) -> Result<Vec<Row>, JobError> {
        let (original, inverse) = (self.original, self.transform.inverse());
        let picked: Vec<usize> = original.some(samples).collect();
        let back = job.map(picked.len(), GRAIN, |i| {
            let q = original.points[picked[i]];
            let (there, gate) = (inverse.apply(q), self.gate * inverse.scale);
            let nearest = self.suspect.surface.nearest_within(there.0, gate)?;
            let p = self.transform.apply(Vec3(nearest.point));
            self.row(p, q, original.normal(picked[i]))
        })?;
        let mut rows = self.forward_rows(samples, job)?;
        rows.extend(back.into_iter().flatten());
        Ok(rows)
    }

    fn grid_rows(&self, samples: usize) -> Vec<Row> {
        let (original, suspect, inverse) = (self.original, self.suspect, self.transform.inverse());
        let spaced = SPACING * original.diagonal;
        let pair = |p: Vec3, q: usize| {
            let (q, normal) = (original.points[q], original.normal(q));
            let along = normal.dot(p - q);
            let beside = (p - q).squared() - along * along;
            let near = along.abs() <= self.gate && beside <= spaced * spaced;
            near.then(|| self.plain_row(p, normal, along))
        };
        let there = suspect.some(samples).filter_map(|i| {
            let p = self.transform.apply(suspect.points[i]);
            pair(p, original.near(p)?.0)
        });
        let back = original.some(samples).filter_map(|i| {
            let (near, _) = suspect.near(inverse.apply(original.points[i]))?;
            pair(self.transform.apply(suspect.points[near]), i)
        });
        there.chain(back).collect()
    }
}

/// 1.4826 times the median of |r|: the standard deviation, if the residuals are normal.
fn robust_deviation(rows: &[Row]) -> f64 {
    let mut sizes: Vec<f64> = rows.iter().map(|(_, r)| r.abs()).collect();
    let middle = sizes.len() / 2;
    let (_, median, _) = sizes.select_nth_unstable_by(middle, f64::total_cmp);
    1.4826 * *median
}

/// Directions in which the suspect can slide on the original, if only a little: how many eigenvalues of the
/// mean of JᵀJ vanish (Gelfand et al., *Geometrically stable sampling for the ICP algorithm*, 3DIM 2003).
/// All seven when the surfaces hardly meet.
pub(crate) fn free_directions(
    original: &Sampled,
    suspect: &Sampled,
    transform: &Similarity,
    tolerance: f64,
    job: &Job,
) -> Result<usize, JobError> {
    let laid = Laid {
        original,
        suspect,
        transform,
        gate: tolerance * original.diagonal.min(transform.scale * suspect.diagonal),
    };
    // Where the original goes on beyond a border of the suspect does not hold the suspect.
    let rows = laid.forward_rows(SLIDING_SAMPLES, job)?;
    if rows.len() < FEWEST_PAIRS {
        return Ok(7);
    }
    let (normal, _) = normal_equations(&rows, f64::INFINITY);
    let Ok(eigen) = normal.self_adjoint_eigen(Side::Lower) else {
        return Ok(7);
    };
    let values = eigen.S().column_vector();
    let bound = SLIDING * rows.len() as f64;
    Ok((0..7).filter(|&k| values[k] < bound).count())
}

/// Samples of the suspect that say whether the surfaces slide. With half or twice as many the free directions of 28 shapes and
/// parts of meshes stay the same.
const SLIDING_SAMPLES: usize = 2_000;

/// Mean square distance from the original, per square of the motion, below which a motion counts as sliding;
/// lengths in units of the diagonal, angles in radians. Of 28 shapes and parts of meshes, free
/// directions are right of 26 and one too many of two parts; with twice as much right of 22, from 1e-4 to 5e-4 of all.
const SLIDING: f64 = 1e-3;

/// Σ w J Jᵀ and −Σ w J r, lengths in units of the original's diagonal, w = exp(−r²/2ν²) with ν the spread.
fn normal_equations(rows: &[Row], spread: f64) -> (Mat<f64>, [f64; 7]) {
    let mut normal = [[0.0; 7]; 7];
    let mut right = [0.0; 7];
    for (jacobian, r) in rows {
        let weight = (-0.5 * (r / spread) * (r / spread)).exp();
        for i in 0..7 {
            let scaled = weight * jacobian[i];
            for j in 0..=i {
                normal[i][j] += scaled * jacobian[j];
            }
            right[i] -= scaled * r;
        }
    }
    (Mat::from_fn(7, 7, |i, j| normal[i.max(j)][i.min(j)]), right)
}

/// The weighted least-squares step (ω, τ, σ); it does not move along directions that the rows leave
/// undetermined.
fn solve(rows: &[Row], spread: f64) -> Option<[f64; 7]> {
    let (normal, right) = normal_equations(rows, spread);
    let eigen = normal.self_adjoint_eigen(Side::Lower).ok()?;
    let (values, vectors) = (eigen.S().column_vector(), eigen.U());
    let mut step = [0.0; 7];
    for k in 0..7 {
        if values[k] > SLIPPERY * values[6] {
            let along: f64 = (0..7).map(|i| vectors[(i, k)] * right[i]).sum();
            for i in 0..7 {
                step[i] += along / values[k] * vectors[(i, k)];
            }
        }
    }
    step.iter().all(|x| x.is_finite()).then_some(step)
}

/// The transform after a step, no larger than a fifth of a radian and of the diagonal; with the step's
/// length.
fn moved(transform: &Similarity, step: &[f64; 7], original: &Sampled) -> (Similarity, f64) {
    let size = step.iter().map(|x| x * x).sum::<f64>().sqrt();
    let shorten = if size > 0.2 { 0.2 / size } else { 1.0 };
    let step = step.map(|x| x * shorten);
    let omega = Vec3([step[0], step[1], step[2]]);
    let half = 0.5 * omega.norm();
    let sinc = if half < 1e-8 {
        0.5
    } else {
        half.sin() / (2.0 * half)
    };
    let turn = Similarity::from_quaternion([half.cos(), sinc * omega[0], sinc * omega[1], sinc * omega[2]]);
    let to_centre = Similarity {
        translation: (-original.centroid).0,
        ..Similarity::IDENTITY
    };
    let turned = Similarity {
        scale: step[6].exp(),
        ..turn
    };
    let offset = Vec3([step[3], step[4], step[5]]) * original.diagonal;
    let back = Similarity {
        translation: (original.centroid + offset).0,
        ..Similarity::IDENTITY
    };
    (transform.then(&to_centre).then(&turned).then(&back), size)
}
