//! The pose by the surfaces alone: hypotheses are refined from coarse to fine, fewer at every level, and the best is
//! refined finely.
//!
//! Numbers without another source were chosen on the fourteen meshes of `results/registration.md`, all of whose draws
//! come out right with them. What comments say of other values, here and in the other modules of the alignment, was measured by
//! halving and doubling each number by itself, or nearly so, on harder suspects of five of these meshes: none keeps the
//! original's net, all are posed at random, and every other one is mirrored.
//!
//! - 25 mixed suspects: meshes and halves with clustered vertices, halves, quarters with noise of 0.5 %, and other models. Of the
//!   first 20, 16 come out right; all of the others are refused. Some numbers were tried on 15 or 9 of them, of three meshes.
//! - 20 cut suspects: quarters, eighths, halves with noise, and quarters with clustered vertices; 16 come out right.
//! - 8 finely refined ones, half of them exact, from poses that are off by a hundredth. The others are judged before that.
//!
//! Two suspects more or less are chance, and so are 5 % of the time, which is the CPU's.

use job::{Job, JobError};
use mesh::{Similarity, Vec3};

use crate::{
    RegistrationStage,
    alignment::{AlignOptions, Alignment, MatchedBy},
    congruent, hypotheses,
    icp::{self, Effort, Pairing},
    overlap::{Overlap, coarse_score},
    sampled::{GRAIN, SAMPLES, Sampled},
};

/// Coarse refinement of every hypothesis: few samples, few steps, a wide gate. With half or twice as many samples or steps, or
/// as wide a gate, none of 25 mixed suspects changes; twice as many samples take 1.1 times as long.
pub(crate) const COARSE: Effort = Effort {
    samples: 500,
    steps: 15,
    gate: 0.15,
};

/// Samples of each surface by which hypotheses are ranked after the coarse refinement. With half or twice as many none of 25
/// mixed suspects changes.
pub(crate) const COARSE_RANKING: usize = 250;

/// Medium refinement: first by the grid, then by exact nearest points. With half or twice as many samples or steps, or as wide
/// a gate, none of 9 mixed suspects changes; half or twice as many samples or steps among exact points take 0.8 and 1.5 of the time.
pub(crate) const MEDIUM: [Effort; 2] = [
    Effort {
        samples: 2_000,
        steps: 15,
        gate: 0.05,
    },
    Effort {
        samples: 2_000,
        steps: 15,
        gate: 0.02,
    },
];

/// Fine refinement: first with some samples, then with all. With half or twice as many of the former, or of their steps, or as
/// wide a gate, errors stay the same, in 0.7 to 1.5 of the time. With half of all samples those of noisy suspects grow by a
/// fifth, with three steps that of one from 1e-6 to 4e-5; twelve steps bring that to rounding in 1.3 times the time. A gate
/// of 0.005 or 0.02 makes none worse.
pub(crate) const FINE: [Effort; 2] = [
    Effort {
        samples: 4_000,
        steps: 40,
        gate: 0.02,
    },
    Effort {
        samples: SAMPLES,
        steps: 6,
        gate: 0.01,
    },
];

/// Rotations tried where principal axes are not enough; each also mirrored. With half or twice as many none of 15 mixed suspects
/// changes; twice as many take 1.2 times as long.
const ROTATIONS: usize = 576;

/// Of the rotations, and of the congruent pairs, so many are refined coarsely. With half or twice as many 16 of 20
/// cut suspects are right, in 0.9 and 1.2 of the time.
const COARSE_HYPOTHESES: usize = 64;

/// Samples of each surface by which rotations are ranked before. With half or twice as many none of 15 mixed suspects changes.
const ROTATION_RANKING: usize = 200;

/// So many of each kind are refined medium. With half or twice as many none of 25 mixed suspects changes.
const MEDIUM_HYPOTHESES: usize = 6;

/// So many of those are refined by exact nearest points. With 1 or 4 none of 25 mixed suspects changes, in 0.9 and 1.05 of the
/// time.
const EXACT_HYPOTHESES: usize = 2;

/// After the coarse refinement, hypotheses that score less than this fraction of the best are dropped. With 0.5 or 0.9 none of
/// 25 mixed suspects changes, in the same time and 0.9 of it.
pub(crate) const KEPT: f64 = 0.7;

/// Where the best coarse score is less, no hypothesis of this kind is refined further: another model is told apart in a
/// fifth of the time. With 0.15 or 0.6 none of 15 mixed suspects changes, in 1.6 and 0.8 of the time.
const LEAST_COARSE_SCORE: f64 = 0.3;

/// Where the best medium score is less, the suspect is another model, and its pose is not refined finely. A perfect fit of
/// all of the original scores 1.25. With half or 1.5 times as much none of 20 suspects,
/// half of them other models, changes; half as much takes twice as long.
const LEAST_MEDIUM_SCORE: f64 = 0.5;

/// No other kind of hypotheses is tried once this share of the suspect lies on the original. With 0.94 or 0.985 none of 15 mixed
/// suspects changes; 0.985 takes 1.1 times as long.
const ENOUGH_OVERLAP: f64 = 0.97;

/// Poses that score at least this fraction of the best fit about as well. With 0.96 or 0.99 all poses of ten symmetric
/// and other shapes are found, and all of six halves of nearly symmetric animals.
pub(crate) const EQUIVALENT: f64 = 0.98;

/// Of two deviations, one is much smaller if it is less than this fraction of the other. With 0.25 or 1 no error of 8 finely
/// refined suspects changes; of 50 that keep some of the net 50 and 49 come back, with 1 in 1.7 times the time.
const MUCH_SMALLER: f64 = 0.5;

/// Surfaces that deviate by less than this fraction of the diagonal coincide. From 1e-8 to 1e-4 none of 60 suspects that
/// keep some of the net, or are other models, changes.
const COINCIDENT: f64 = 1e-6;

/// Poses differ if they move a sample apart by more than so many tolerances. With half or twice as many all poses of ten
/// symmetric and other shapes are found.
const TOLERANCES_APART: f64 = 2.0;

/// The least overlapping directions of a plane: two of translation, one of rotation, and scale.
const PLANE: usize = 4;

/// Poses with their scores, the best first.
pub(crate) type Ranked = Vec<(f64, Similarity)>;

/// A suspect to be brought onto an original.
pub(crate) struct Search<'a> {
    pub(crate) original: &'a Sampled,
    pub(crate) suspect: &'a Sampled,
    pub(crate) options: &'a AlignOptions,
    pub(crate) job: &'a Job,
}

impl Search<'_> {
    /// The best pose that hypotheses of all kinds lead to: the given pose and principal axes; where these are not enough,
    /// rotations all around; where these are not, either, congruent pairs of oriented points.
    pub(crate) fn by_surface(&self) -> Result<Alignment, JobError> {
        let mut first = vec![Similarity::IDENTITY];
        first.extend(hypotheses::principal_axes(self.original, self.suspect));
        let mut ranked = self.refined_to_medium(first)?;
        if !self.overlaps_enough(&ranked)? {
            ranked.extend(self.refined_to_medium(self.best_rotations()?)?);
            if !self.overlaps_enough(&ranked)? {
                let pairs = congruent::hypotheses(self.original, self.suspect, COARSE_HYPOTHESES, self.job)?;
                ranked.extend(self.refined_to_medium(pairs)?);
            }
        }
        self.concluded(ranked, MatchedBy::Surface)
    }

    /// The best pose that given hypotheses lead to.
    pub(crate) fn best_of_hypotheses(&self, hypotheses: Vec<Similarity>) -> Result<Alignment, JobError> {
        let ranked = self.medium(hypotheses)?;
        self.concluded(ranked, MatchedBy::Points)
    }

    /// The rotations that look best on the grid.
    pub(crate) fn best_rotations(&self) -> Result<Vec<Similarity>, JobError> {
        let rotations = hypotheses::all_rotations(self.original, self.suspect, ROTATIONS);
        let tolerance = 10.0 * self.options.tolerance;
        let (original, suspect) = (self.original, self.suspect);
        let score = |i: usize| coarse_score(original, suspect, &rotations[i], tolerance, ROTATION_RANKING);
        let scores = self.job.map(rotations.len(), GRAIN, score)?;
        let mut order: Vec<usize> = (0..rotations.len()).collect();
        order.sort_by(|&i, &j| scores[j].total_cmp(&scores[i]));
        let best = order.into_iter().take(COARSE_HYPOTHESES);
        Ok(best.map(|i| rotations[i]).collect())
    }

    /// Refines hypotheses coarsely, and the best of them medium.
    fn refined_to_medium(&self, hypotheses: Vec<Similarity>) -> Result<Ranked, JobError> {
        let coarse = self.refined(hypotheses, COARSE, Pairing::Grid)?;
        let mut coarse = self.ranked(coarse, COARSE_RANKING)?;
        let best = coarse.first().map_or(0.0, |(score, _)| *score);
        if best < LEAST_COARSE_SCORE {
            coarse.truncate(1);
            return Ok(coarse);
        }
        coarse.retain(|(score, _)| *score >= KEPT * best);
        coarse.truncate(MEDIUM_HYPOTHESES);
        self.medium(poses(coarse))
    }

    /// Medium refinement; only of the best by exact nearest points.
    fn medium(&self, hypotheses: Vec<Similarity>) -> Result<Ranked, JobError> {
        let by_grid = self.refined(hypotheses, MEDIUM[0], Pairing::Grid)?;
        let mut by_grid = self.ranked(by_grid, COARSE_RANKING)?;
        by_grid.truncate(EXACT_HYPOTHESES);
        let exact = self.refined(poses(by_grid), MEDIUM[1], Pairing::Surfaces)?;
        self.ranked(exact, MEDIUM[1].samples)
    }

    /// What becomes of each hypothesis that can be refined.
    pub(crate) fn refined(
        &self,
        hypotheses: Vec<Similarity>,
        effort: Effort,
        pairing: Pairing,
    ) -> Result<Vec<Similarity>, JobError> {
        self.job.begin(RegistrationStage::Hypotheses)?;
        let total = hypotheses.len() as f64;
        let mut refined = Vec::new();
        for (done, start) in (1..).zip(hypotheses) {
            let found = self.refine(start, effort, pairing)?;
            refined.extend(found.map(|found| found.transform));
            self.job.progress(f64::from(done) / total)?;
        }
        Ok(refined)
    }

    fn refine(
        &self,
        start: Similarity,
        effort: Effort,
        pairing: Pairing,
    ) -> Result<Option<icp::Refined>, JobError> {
        self.job.go_on()?;
        icp::refine(self.original, self.suspect, start, effort, pairing, self.job)
    }

    /// Refines the best pose finely, and judges it.
    fn concluded(&self, mut ranked: Ranked, matched_by: MatchedBy) -> Result<Alignment, JobError> {
        ranked.sort_by(|x, y| y.0.total_cmp(&x.0));
        self.job.begin(RegistrationStage::Refinement)?;
        let Some(&(score, best)) = ranked.first() else {
            return self.judged(Similarity::IDENTITY, matched_by);
        };
        let transform = if score > LEAST_MEDIUM_SCORE {
            self.fine(best)?
        } else {
            best
        };
        Ok(Alignment {
            alternatives: self.alternatives(&ranked, score, &transform),
            ..self.judged(transform, matched_by)?
        })
    }

    /// Fine refinement by samples of both surfaces, or by the suspect's vertices if they agree far better: those of a
    /// re-meshed suspect lie on the original, those of a simplified one beside it on the outside of bends, which
    /// shrinks the suspect.
    pub(crate) fn fine(&self, start: Similarity) -> Result<Similarity, JobError> {
        let first = self.refine(start, FINE[0], Pairing::Surfaces)?;
        let start = first.map_or(start, |refined| refined.transform);
        let by_samples = self.refine(start, FINE[1], Pairing::Surfaces)?;
        let by_vertices = self.refine(start, FINE[1], Pairing::Vertices)?;
        let bound = by_samples.map_or(f64::INFINITY, |refined| MUCH_SMALLER * refined.deviation);
        let better = by_vertices
            .filter(|refined| refined.deviation <= bound)
            .or(by_samples);
        Ok(better.map_or(start, |refined| refined.transform))
    }

    /// Whether the surfaces lie in a pose about as well as in any near it.
    pub(crate) fn is_at_rest(&self, pose: &Similarity) -> Result<bool, JobError> {
        let deviation = |effort: Effort| {
            let refined = self.refine(*pose, effort, Pairing::Surfaces)?;
            Ok::<_, JobError>(refined.map_or(f64::INFINITY, |refined| refined.deviation))
        };
        let here = deviation(Effort { steps: 1, ..FINE[0] })?;
        Ok(here <= COINCIDENT || (here.is_finite() && deviation(FINE[0])? > MUCH_SMALLER * here))
    }

    /// Whether a pose so far leaves little to be wished.
    fn overlaps_enough(&self, ranked: &Ranked) -> Result<bool, JobError> {
        for (_, pose) in ranked {
            if self.overlap(pose, FINE[0].samples)?.of_suspect >= ENOUGH_OVERLAP {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Poses that score about as well as the best and differ from it.
    fn alternatives(&self, ranked: &Ranked, best: f64, transform: &Similarity) -> Vec<Similarity> {
        let mut others: Vec<Similarity> = Vec::new();
        for (score, other) in ranked {
            let differs = |from: &Similarity| self.differ(from, other);
            if *score >= EQUIVALENT * best && differs(transform) && others.iter().all(differs) {
                others.push(*other);
            }
        }
        others
    }

    /// Whether two transforms take the suspect to places that are apart.
    pub(crate) fn differ(&self, one: &Similarity, other: &Similarity) -> bool {
        let apart = |p: Vec3| (one.apply(p) - other.apply(p)).norm();
        let bound = TOLERANCES_APART * self.options.tolerance * self.original.diagonal;
        self.suspect
            .some(100)
            .any(|i| apart(self.suspect.points[i]) > bound)
    }

    /// Poses with their scores, the best first.
    pub(crate) fn ranked(&self, poses: Vec<Similarity>, samples: usize) -> Result<Ranked, JobError> {
        let scored = |pose: Similarity| Ok((self.overlap(&pose, samples)?.score, pose));
        let mut ranked = poses
            .into_iter()
            .map(scored)
            .collect::<Result<Ranked, JobError>>()?;
        ranked.sort_by(|x, y| y.0.total_cmp(&x.0));
        Ok(ranked)
    }

    /// [`Overlap`] by so many samples of each surface.
    pub(crate) fn overlap(&self, pose: &Similarity, samples: usize) -> Result<Overlap, JobError> {
        let &AlignOptions { tolerance, .. } = self.options;
        Overlap::measure(self.original, self.suspect, pose, tolerance, samples, self.job)
    }

    /// In how many directions the surfaces slide on each other.
    pub(crate) fn free_directions(&self, pose: &Similarity) -> Result<usize, JobError> {
        let &AlignOptions { tolerance, .. } = self.options;
        icp::free_directions(self.original, self.suspect, pose, tolerance, self.job)
    }

    /// The alignment by a transform, without correspondence and alternatives.
    pub(crate) fn judged(&self, transform: Similarity, matched_by: MatchedBy) -> Result<Alignment, JobError> {
        let overlap = self.overlap(&transform, SAMPLES)?;
        let free_directions = match matched_by {
            MatchedBy::Connectivity
            | MatchedBy::Surroundings
            | MatchedBy::Rig
            | MatchedBy::RigSurface
            | MatchedBy::LocalFrames
            | MatchedBy::BentSurface => 0,
            MatchedBy::Surface | MatchedBy::Points | MatchedBy::Parts => self.free_directions(&transform)?,
        };
        Ok(Alignment {
            transform,
            matched_by,
            overlap: overlap.of_suspect,
            coverage: overlap.of_original,
            residual: overlap.residual,
            aligned: overlap.of_suspect >= self.options.least_overlap && free_directions < PLANE,
            correspondence: None,
            alternatives: Vec::new(),
            free_directions,
        })
    }
}

/// Ranked poses without their scores.
pub(crate) fn poses(ranked: Ranked) -> Vec<Similarity> {
    ranked.into_iter().map(|(_, pose)| pose).collect()
}
