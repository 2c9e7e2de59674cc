//! The pose by the surfaces alone: guesses from cheap to dear, each refined and measured; the best is refined
//! with care.

use crate::align::{AlignOptions, Alignment, Basis};
use crate::field::{Field, rough_score};
use crate::icp::{self, Effort, Ends};
use crate::observer::{Observer, Stage, begin, go_on};
use crate::overlap::Overlap;
use crate::sampled::Sampled;
use crate::vector::{norm, sub};
use crate::{RegistrationError, congruent, guesses, threads};
use mesh::{Similarity, TriMesh};

/// Samples of each surface.
const SAMPLES: usize = 20_000;

/// First look at a guess: few samples, few steps, a wide gate.
const GLANCE: Effort = Effort {
    samples: 250,
    steps: 12,
    gate: 0.15,
};

/// Second look, at the best guesses.
const LOOK: Effort = Effort {
    samples: 2_000,
    steps: 25,
    gate: 0.05,
};

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

/// Rotations tried when principal axes fail, and how many of them are refined.
const ROTATIONS: usize = 576;
const REFINED: usize = 32;
const FINALISTS: usize = 4;

/// Samples of each surface by which rotations are ranked.
const ROUGH_SAMPLES: usize = 200;

/// Guesses that score less than this fraction of the best at a glance are dropped.
const WORTH_A_LOOK: f64 = 0.7;

/// A share of overlap at which no other guess is needed.
const CONVINCING: f64 = 0.97;

/// A score below which further refinement is not worth its time.
const HOPELESS: f64 = 0.3;

/// Guesses that score at least this fraction of the best fit about as well.
const ABOUT_AS_WELL: f64 = 0.98;

/// The least overlapping directions of a plane: two of translation, one of rotation, and scale.
const PLANE: usize = 4;

/// Guesses with their scores, the best first.
type Ranked = Vec<(f64, Similarity)>;

pub(crate) struct Search<'a> {
    original: Sampled,
    suspect: Sampled,
    options: &'a AlignOptions,
    observer: &'a dyn Observer,
}

impl<'a> Search<'a> {
    pub(crate) fn new(
        original: &TriMesh,
        suspect: &TriMesh,
        options: &'a AlignOptions,
        observer: &'a dyn Observer,
    ) -> Result<Self, RegistrationError> {
        let original = Sampled::of(original, "original", SAMPLES)?;
        go_on(observer)?;
        let suspect = Sampled::of(suspect, "suspect", SAMPLES)?;
        go_on(observer)?;
        Ok(Self {
            original,
            suspect,
            options,
            observer,
        })
    }

    /// The best pose that guesses of all kinds lead to.
    pub(crate) fn by_surface(&self) -> Result<Alignment, RegistrationError> {
        let mut cheap = vec![Similarity::IDENTITY];
        cheap.extend(guesses::principal_axes(&self.original, &self.suspect));
        let mut ranked = self.finalists(cheap)?;
        if !self.convinced(&ranked) {
            let fields = [Field::of(&self.original), Field::of(&self.suspect)];
            let rotations = guesses::all_rotations(&self.original, &self.suspect, ROTATIONS);
            ranked.extend(self.finalists(self.promising(rotations, &fields))?);
            if !self.convinced(&ranked) {
                go_on(self.observer)?;
                let partial = congruent::guesses(&self.original, &self.suspect, &fields[0], REFINED);
                ranked.extend(self.finalists(partial)?);
            }
        }
        self.settled(ranked, Basis::Surface)
    }

    /// The best pose that given guesses lead to.
    pub(crate) fn from_guesses(&self, guesses: Vec<Similarity>) -> Result<Alignment, RegistrationError> {
        let near = self.refined(guesses, LOOK)?;
        self.settled(near, Basis::Points)
    }

    /// Refines the best guess, and judges it.
    fn settled(&self, mut ranked: Ranked, basis: Basis) -> Result<Alignment, RegistrationError> {
        ranked.sort_by(|x, y| y.0.total_cmp(&x.0));
        begin(self.observer, Stage::Refinement)?;
        let Some(&(score, best)) = ranked.first() else {
            return Ok(self.judged(Similarity::IDENTITY, basis));
        };
        let transform = if score > HOPELESS {
            self.cared_for(best)?
        } else {
            best
        };
        let alternatives = self.alternatives(&ranked, score, &transform);
        Ok(Alignment {
            alternatives,
            ..self.judged(transform, basis)
        })
    }

    /// Refines the best guess by samples of both surfaces and by the suspect's vertices, and keeps what
    /// agrees better.
    fn cared_for(&self, guess: Similarity) -> Result<Similarity, RegistrationError> {
        let refined = |start: Similarity, effort: Effort, ends: Ends| {
            go_on(self.observer)?;
            let refined = icp::refine(&self.original, &self.suspect, start, effort, ends);
            Ok::<_, RegistrationError>(refined)
        };
        let start = refined(guess, CARE[0], Ends::Samples)?.map_or(guess, |refined| refined.transform);
        let by_samples = refined(start, CARE[1], Ends::Samples)?;
        let by_vertices = refined(start, CARE[1], Ends::Vertices)?;
        let both = [by_samples, by_vertices].into_iter().flatten();
        let better = both.min_by(|x, y| x.deviation.total_cmp(&y.deviation));
        Ok(better.map_or(start, |refined| refined.transform))
    }

    /// Refines guesses at a glance, and the best of them with a longer look.
    fn finalists(&self, guesses: Vec<Similarity>) -> Result<Ranked, RegistrationError> {
        let mut glanced = self.refined(guesses, GLANCE)?;
        let best = glanced.first().map_or(0.0, |(score, _)| *score);
        if best < HOPELESS {
            glanced.truncate(1);
            return Ok(glanced);
        }
        glanced.retain(|(score, _)| *score >= WORTH_A_LOOK * best);
        glanced.truncate(FINALISTS);
        let guesses = glanced.into_iter().map(|(_, guess)| guess).collect();
        self.refined(guesses, LOOK)
    }

    /// Refines guesses and ranks the results, the best first.
    fn refined(&self, guesses: Vec<Similarity>, effort: Effort) -> Result<Ranked, RegistrationError> {
        let total = guesses.len();
        let mut refined = Vec::new();
        for (done, guess) in guesses.into_iter().enumerate() {
            begin(self.observer, Stage::Guesses { done, total })?;
            let better = icp::refine(&self.original, &self.suspect, guess, effort, Ends::Samples);
            refined.extend(better.map(|better| better.transform));
        }
        Ok(self.ranked(refined, effort.samples, self.options.tolerance))
    }

    fn ranked(&self, guesses: Vec<Similarity>, samples: usize, tolerance: f64) -> Ranked {
        let score =
            |t: &Similarity| Overlap::measure(&self.original, &self.suspect, t, tolerance, samples).score;
        let mut ranked: Ranked = guesses.into_iter().map(|guess| (score(&guess), guess)).collect();
        ranked.sort_by(|x, y| y.0.total_cmp(&x.0));
        ranked
    }

    /// The guesses that look best from afar.
    fn promising(&self, guesses: Vec<Similarity>, [original, suspect]: &[Field<'_>; 2]) -> Vec<Similarity> {
        let tolerance = 10.0 * self.options.tolerance;
        let scores = threads::map(guesses.len(), |i| {
            rough_score(original, suspect, &guesses[i], tolerance, ROUGH_SAMPLES)
        });
        let mut order: Vec<usize> = (0..guesses.len()).collect();
        order.sort_by(|&i, &j| scores[j].total_cmp(&scores[i]));
        order.into_iter().take(REFINED).map(|i| guesses[i]).collect()
    }

    /// Whether one of the guesses so far leaves little to be wished.
    fn convinced(&self, ranked: &Ranked) -> bool {
        ranked.iter().any(|(_, guess)| {
            let &AlignOptions { tolerance, .. } = self.options;
            let overlap = Overlap::measure(&self.original, &self.suspect, guess, tolerance, LOOK.samples);
            overlap.of_suspect >= CONVINCING
        })
    }

    /// Transforms that score about as well as the best and differ from it by more than the tolerance.
    fn alternatives(&self, ranked: &Ranked, best: f64, transform: &Similarity) -> Vec<Similarity> {
        let mut others: Vec<Similarity> = Vec::new();
        for (score, other) in ranked {
            let differs = |from: &Similarity| {
                let apart = |i: usize| {
                    let p = self.suspect.points[i];
                    norm(sub(other.apply(p), from.apply(p)))
                };
                self.suspect
                    .some(100)
                    .any(|i| apart(i) > 2.0 * self.options.tolerance * self.original.diagonal)
            };
            if *score >= ABOUT_AS_WELL * best && differs(transform) && others.iter().all(differs) {
                others.push(*other);
            }
        }
        others
    }

    /// The alignment by a transform, without correspondence and alternatives.
    pub(crate) fn judged(&self, transform: Similarity, basis: Basis) -> Alignment {
        let &AlignOptions {
            tolerance,
            least_overlap,
            ..
        } = self.options;
        let overlap = Overlap::measure(&self.original, &self.suspect, &transform, tolerance, SAMPLES);
        let free_directions = match basis {
            Basis::Connectivity | Basis::Surroundings => 0,
            Basis::Surface | Basis::Points => {
                icp::free_directions(&self.original, &self.suspect, &transform, tolerance)
            }
        };
        Alignment {
            transform,
            basis,
            overlap: overlap.of_suspect,
            coverage: overlap.of_original,
            residual: overlap.residual,
            aligned: overlap.of_suspect >= least_overlap && free_directions < PLANE,
            correspondence: None,
            alternatives: Vec::new(),
            free_directions,
        }
    }
}
