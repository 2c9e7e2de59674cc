//! The pose by the surfaces alone: guesses from cheap to dear, each refined and measured; the best is refined
//! with care.

use crate::align::{AlignOptions, Alignment, MatchedBy};
use crate::field::rough_score;
use crate::icp::{self, Effort, Ends};
use crate::overlap::Overlap;
use crate::sampled::{GRAIN, SAMPLES, Sampled};
use crate::stage::RegistrationStage;
use crate::vector::{norm, sub};
use crate::{congruent, guesses};
use job::{Job, JobError};
use mesh::Similarity;

/// First look at a guess: few samples, few steps, a wide gate.
const GLANCE: Effort = Effort {
    samples: 500,
    steps: 15,
    gate: 0.15,
};

/// Samples by which guesses are ranked after a glance.
const GLANCED_SAMPLES: usize = 250;

/// Second look, at the best guesses, first roughly.
const LOOK: [Effort; 2] = [
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

/// Refinement of the best, first with some samples and then with all.
const CARE: [Effort; 2] = [
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

/// Of two deviations, one is far better if it is less than this fraction of the other.
const FAR_BETTER: f64 = 0.5;

/// Surfaces that deviate by less than this fraction of the diagonal lie on each other.
const SURELY: f64 = 1e-6;

/// Rotations tried when principal axes fail, and guesses of a kind that get a glance.
const ROTATIONS: usize = 576;
const REFINED: usize = 64;

/// Guesses that get a longer look, and those of them whose look is not only rough.
const LOOKED_AT: usize = 6;
const FINALISTS: usize = 2;

/// Samples of each surface by which rotations are ranked.
const ROUGH_SAMPLES: usize = 200;

/// Guesses that score less than this fraction of the best at a glance are dropped.
const WORTH_A_LOOK: f64 = 0.7;

/// A share of overlap at which no other guess is needed.
const CONVINCING: f64 = 0.97;

/// Scores below which a guess is not worth a longer look, and the best not worth care.
const HOPELESS: f64 = 0.3;
const NOT_ALIGNED: f64 = 0.5;

/// Guesses that score at least this fraction of the best fit about as well.
const ABOUT_AS_WELL: f64 = 0.98;

/// Glances at poses that score less than this fraction of a perfect fit do not suggest a symmetry.
const PERHAPS_AS_WELL: f64 = 0.8;

/// Symmetries that are told apart: those of a dodecahedron are 120.
const MOST_SYMMETRIES: usize = 128;

/// The least overlapping directions of a plane: two of translation, one of rotation, and scale.
const PLANE: usize = 4;

/// Guesses with their scores, the best first.
type Ranked = Vec<(f64, Similarity)>;

pub(crate) struct Search<'a> {
    original: &'a Sampled,
    suspect: &'a Sampled,
    options: &'a AlignOptions,
    job: &'a Job,
}

impl<'a> Search<'a> {
    pub(crate) fn new(
        original: &'a Sampled,
        suspect: &'a Sampled,
        options: &'a AlignOptions,
        job: &'a Job,
    ) -> Self {
        Self {
            original,
            suspect,
            options,
            job,
        }
    }

    pub(crate) fn job(&self) -> &Job {
        self.job
    }

    /// The best pose that guesses of all kinds lead to.
    pub(crate) fn by_surface(&self) -> Result<Alignment, JobError> {
        let mut cheap = vec![Similarity::IDENTITY];
        cheap.extend(guesses::principal_axes(self.original, self.suspect));
        let mut ranked = self.finalists(cheap)?;
        if !self.convinced(&ranked)? {
            let rotations = guesses::all_rotations(self.original, self.suspect, ROTATIONS);
            ranked.extend(self.finalists(self.promising(rotations)?)?);
            if !self.convinced(&ranked)? {
                let partial = congruent::guesses(self.original, self.suspect, REFINED, self.job)?;
                ranked.extend(self.finalists(partial)?);
            }
        }
        self.settled(ranked, MatchedBy::Surface)
    }

    /// The poses that fit as well as a found one because the original is symmetric.
    pub(crate) fn with_symmetries(
        &self,
        mut found: Alignment,
        symmetries: &[Similarity],
    ) -> Result<Alignment, JobError> {
        let score = |t: &Similarity| Ok::<_, JobError>(self.overlap(t, LOOK[1].samples)?.score);
        let least = ABOUT_AS_WELL * score(&found.transform)?;
        // Exact to rounding where the original is, unlike the same pose found from another guess.
        let composed = symmetries.iter().map(|symmetry| found.transform.then(symmetry));
        let others = composed.chain(std::mem::take(&mut found.alternatives));
        let mut poses = vec![found.transform];
        for other in others {
            if poses.iter().all(|pose| self.differ(pose, &other)) && score(&other)? >= least {
                poses.push(other);
            }
        }
        found.alternatives = poses.split_off(1);
        Ok(found)
    }

    fn overlap(&self, transform: &Similarity, samples: usize) -> Result<Overlap, JobError> {
        let &AlignOptions { tolerance, .. } = self.options;
        Overlap::measure(
            self.original,
            self.suspect,
            transform,
            tolerance,
            samples,
            self.job,
        )
    }

    /// The motions that take the original onto itself, apart from none at all, the suspect being the original too: those
    /// that guesses lead to, and their products. None of a shape that slides on itself.
    pub(crate) fn symmetries(&self) -> Result<Vec<Similarity>, JobError> {
        let &AlignOptions { tolerance, .. } = self.options;
        let free = icp::free_directions(
            self.original,
            self.suspect,
            &Similarity::IDENTITY,
            tolerance,
            self.job,
        )?;
        if free > 0 {
            return Ok(Vec::new());
        }
        let mut guesses = guesses::principal_axes(self.original, self.suspect);
        if !guesses::axes_are_distinct(self.original) {
            let rotations = guesses::all_rotations(self.original, self.suspect, ROTATIONS);
            guesses.extend(self.promising(rotations)?);
        }
        let glanced = self.each(guesses, |guess| self.refined(guess, GLANCE, Ends::Rough))?;
        let perfect = self.ranked(vec![Similarity::IDENTITY], GLANCED_SAMPLES)?[0].0;
        let mut near = Vec::new();
        for (score, guess) in self.ranked(glanced, GLANCED_SAMPLES)? {
            let new = std::iter::once(&Similarity::IDENTITY)
                .chain(&near)
                .all(|other| self.differ(other, &guess));
            if new && score >= PERHAPS_AS_WELL * perfect {
                near.push(guess);
            }
        }
        let refined = self.each(near, |guess| self.refined(guess, CARE[0], Ends::Samples))?;
        let mut group = vec![Similarity::IDENTITY];
        for symmetry in refined {
            self.add(&mut group, symmetry)?;
        }
        let mut done = 1;
        while done < group.len() && group.len() < MOST_SYMMETRIES {
            self.job.go_on()?;
            for other in 1..=done {
                let products = [group[done].then(&group[other]), group[other].then(&group[done])];
                for product in products {
                    self.add(&mut group, product)?;
                }
            }
            done += 1;
        }
        group.truncate(MOST_SYMMETRIES);
        Ok(group.split_off(1))
    }

    /// Adds a pose if it is new and fits about as well as the first.
    fn add(&self, group: &mut Vec<Similarity>, pose: Similarity) -> Result<(), JobError> {
        let samples = LOOK[1].samples;
        let score = |pose| Ok::<_, JobError>(self.ranked(vec![pose], samples)?[0].0);
        if group.iter().all(|other| self.differ(other, &pose))
            && score(pose)? >= ABOUT_AS_WELL * score(group[0])?
        {
            group.push(pose);
        }
        Ok(())
    }

    /// Whether two transforms take the suspect to places that are apart.
    fn differ(&self, one: &Similarity, other: &Similarity) -> bool {
        let apart = |i: usize| {
            let p = self.suspect.points[i];
            norm(sub(one.apply(p), other.apply(p)))
        };
        let bound = 2.0 * self.options.tolerance * self.original.diagonal;
        self.suspect.some(100).any(|i| apart(i) > bound)
    }

    /// The best pose that given guesses lead to.
    pub(crate) fn at_guesses(&self, guesses: Vec<Similarity>) -> Result<Alignment, JobError> {
        let near = self.looked_at(guesses)?;
        self.settled(near, MatchedBy::Points)
    }

    /// Refines the best guess, and judges it.
    fn settled(&self, mut ranked: Ranked, matched_by: MatchedBy) -> Result<Alignment, JobError> {
        ranked.sort_by(|x, y| y.0.total_cmp(&x.0));
        self.job.begin(RegistrationStage::Refinement)?;
        let Some(&(score, best)) = ranked.first() else {
            return self.judged(Similarity::IDENTITY, matched_by);
        };
        let transform = if score > NOT_ALIGNED {
            self.cared_for(best)?
        } else {
            best
        };
        let alternatives = self.alternatives(&ranked, score, &transform);
        Ok(Alignment {
            alternatives,
            ..self.judged(transform, matched_by)?
        })
    }

    /// Refines the best guess by samples of both surfaces, or by the suspect's vertices if they agree far better:
    /// those of a re-meshed suspect lie on the original, those of a simplified one beside it on the outside of
    /// bends, which shrinks the suspect.
    fn cared_for(&self, guess: Similarity) -> Result<Similarity, JobError> {
        let refined = |start: Similarity, effort: Effort, ends: Ends| {
            self.job.go_on()?;
            icp::refine(self.original, self.suspect, start, effort, ends, self.job)
        };
        let start = refined(guess, CARE[0], Ends::Samples)?.map_or(guess, |refined| refined.transform);
        let by_samples = refined(start, CARE[1], Ends::Samples)?;
        let by_vertices = refined(start, CARE[1], Ends::Vertices)?;
        let bound = by_samples.map_or(f64::INFINITY, |refined| FAR_BETTER * refined.deviation);
        let better = by_vertices
            .filter(|refined| refined.deviation <= bound)
            .or(by_samples);
        Ok(better.map_or(start, |refined| refined.transform))
    }

    /// Whether the surfaces lie in a pose about as well as in any near it.
    pub(crate) fn rests_at(&self, pose: &Similarity) -> Result<bool, JobError> {
        let deviation = |effort: Effort| {
            let refined = icp::refine(
                self.original,
                self.suspect,
                *pose,
                effort,
                Ends::Samples,
                self.job,
            )?;
            Ok::<_, JobError>(refined.map_or(f64::INFINITY, |refined| refined.deviation))
        };
        let here = deviation(Effort { steps: 1, ..CARE[0] })?;
        Ok(here <= SURELY || (here.is_finite() && deviation(CARE[0])? > FAR_BETTER * here))
    }

    /// Refines guesses at a glance, and the best of them with a longer look.
    fn finalists(&self, guesses: Vec<Similarity>) -> Result<Ranked, JobError> {
        let glanced = self.each(guesses, |guess| self.refined(guess, GLANCE, Ends::Rough))?;
        let mut glanced = self.ranked(glanced, GLANCED_SAMPLES)?;
        let best = glanced.first().map_or(0.0, |(score, _)| *score);
        if best < HOPELESS {
            glanced.truncate(1);
            return Ok(glanced);
        }
        glanced.retain(|(score, _)| *score >= WORTH_A_LOOK * best);
        glanced.truncate(LOOKED_AT);
        self.looked_at(glanced.into_iter().map(|(_, guess)| guess).collect())
    }

    /// Refines guesses with a longer look.
    fn looked_at(&self, guesses: Vec<Similarity>) -> Result<Ranked, JobError> {
        let rough = self.each(guesses, |guess| self.refined(guess, LOOK[0], Ends::Rough))?;
        let best = self.ranked(rough, GLANCED_SAMPLES)?.into_iter().take(FINALISTS);
        let best = best.map(|(_, guess)| guess).collect();
        let exact = self.each(best, |guess| self.refined(guess, LOOK[1], Ends::Samples))?;
        self.ranked(exact, LOOK[1].samples)
    }

    /// What becomes of each guess.
    fn each(
        &self,
        guesses: Vec<Similarity>,
        refined: impl Fn(Similarity) -> Result<Option<Similarity>, JobError>,
    ) -> Result<Vec<Similarity>, JobError> {
        self.job.begin(RegistrationStage::Hypotheses)?;
        let total = guesses.len() as f64;
        let mut better = Vec::new();
        for (done, guess) in (1..).zip(guesses) {
            better.extend(refined(guess)?);
            self.job.progress(f64::from(done) / total)?;
        }
        Ok(better)
    }

    fn refined(&self, guess: Similarity, effort: Effort, ends: Ends) -> Result<Option<Similarity>, JobError> {
        let better = icp::refine(self.original, self.suspect, guess, effort, ends, self.job)?;
        Ok(better.map(|better| better.transform))
    }

    /// Guesses with their scores, the best first.
    fn ranked(&self, guesses: Vec<Similarity>, samples: usize) -> Result<Ranked, JobError> {
        let scored = |guess: Similarity| Ok((self.overlap(&guess, samples)?.score, guess));
        let mut ranked = guesses
            .into_iter()
            .map(scored)
            .collect::<Result<Ranked, JobError>>()?;
        ranked.sort_by(|x, y| y.0.total_cmp(&x.0));
        Ok(ranked)
    }

    /// The guesses that look best from afar.
    fn promising(&self, guesses: Vec<Similarity>) -> Result<Vec<Similarity>, JobError> {
        let tolerance = 10.0 * self.options.tolerance;
        let scores = self.job.map(guesses.len(), GRAIN, |i| {
            rough_score(self.original, self.suspect, &guesses[i], tolerance, ROUGH_SAMPLES)
        })?;
        let mut order: Vec<usize> = (0..guesses.len()).collect();
        order.sort_by(|&i, &j| scores[j].total_cmp(&scores[i]));
        Ok(order.into_iter().take(REFINED).map(|i| guesses[i]).collect())
    }

    /// Whether one of the guesses so far leaves little to be wished.
    fn convinced(&self, ranked: &Ranked) -> Result<bool, JobError> {
        for (_, guess) in ranked {
            if self.overlap(guess, CARE[0].samples)?.of_suspect >= CONVINCING {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Transforms that score about as well as the best and differ from it by more than the tolerance.
    fn alternatives(&self, ranked: &Ranked, best: f64, transform: &Similarity) -> Vec<Similarity> {
        let mut others: Vec<Similarity> = Vec::new();
        for (score, other) in ranked {
            let differs = |from: &Similarity| self.differ(from, other);
            if *score >= ABOUT_AS_WELL * best && differs(transform) && others.iter().all(differs) {
                others.push(*other);
            }
        }
        others
    }

    /// The alignment by a transform, without correspondence and alternatives.
    pub(crate) fn judged(&self, transform: Similarity, matched_by: MatchedBy) -> Result<Alignment, JobError> {
        let &AlignOptions {
            tolerance,
            least_overlap,
        } = self.options;
        let overlap = self.overlap(&transform, SAMPLES)?;
        let free_directions = match matched_by {
            MatchedBy::Connectivity | MatchedBy::Surroundings => 0,
            MatchedBy::Surface | MatchedBy::Points => {
                icp::free_directions(self.original, self.suspect, &transform, tolerance, self.job)?
            }
        };
        Ok(Alignment {
            transform,
            matched_by,
            overlap: overlap.of_suspect,
            coverage: overlap.of_original,
            residual: overlap.residual,
            aligned: overlap.of_suspect >= least_overlap && free_directions < PLANE,
            correspondence: None,
            alternatives: Vec::new(),
            free_directions,
        })
    }
}
