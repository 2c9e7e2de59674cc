//! From a suspect in unknown pose to the similarity that brings it back.

use crate::connectivity::{Correspondence, match_candidates, match_surroundings};
use crate::field::{Field, rough_score};
use crate::icp::{self, Effort, Ends};
use crate::overlap::Overlap;
use crate::sampled::Sampled;
use crate::vector::{norm, sub};
use crate::{Handedness, RegistrationError, congruent, guesses, threads};
use mesh::{Similarity, TriMesh};
use std::ops::ControlFlow;

/// How to align.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlignOptions {
    /// How near the surfaces must be to count as overlapping, as a fraction of the smaller bounding-box
    /// diagonal.
    pub tolerance: f64,
    /// The least share of the suspect's area that must overlap for the suspect to count as aligned.
    pub least_overlap: f64,
    /// Threads to use; the result does not depend on it.
    pub threads: usize,
}

impl Default for AlignOptions {
    fn default() -> Self {
        Self {
            tolerance: 0.01,
            least_overlap: 0.8,
            threads: 1,
        }
    }
}

/// What the alignment rests on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Basis {
    /// All vertices of the original were found again.
    Connectivity,
    /// Part of the original's net was found again.
    Surroundings,
    /// The surfaces alone.
    Surface,
}

/// What is being done, for progress displays; the caller may stop at each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Stage {
    /// Looking for vertices that survived.
    Connectivity,
    /// Sampling surfaces and building search trees.
    Preparation,
    /// Trying first guesses.
    Guesses {
        /// How many were tried.
        done: usize,
        /// How many there are in this round.
        total: usize,
    },
    /// Refining the best guess.
    Refinement,
}

/// Where the suspect belongs, and how well it fits there.
#[derive(Clone, Debug, PartialEq)]
pub struct Alignment {
    /// Takes the suspect to the original.
    pub transform: Similarity,
    /// What it rests on.
    pub basis: Basis,
    /// Share of the suspect's area that lies on the original, 0 to 1.
    pub overlap: f64,
    /// Share of the original's area that lies on the suspect, 0 to 1.
    pub coverage: f64,
    /// Root mean square distance of the overlapping surface, as a fraction of the original's diagonal.
    pub residual: f64,
    /// Whether the overlap is large enough to call the suspect aligned.
    pub aligned: bool,
    /// The vertices that were found again, if any.
    pub correspondence: Option<Correspondence>,
    /// Other transforms that fit about as well: the shape is symmetric, or nearly so.
    pub alternatives: Vec<Similarity>,
}

/// Finds the similarity that takes the suspect to the original, mirrored if need be, without an initial
/// guess.
///
/// Vertices that survived are used when there are enough of them; else the surfaces are aligned, from the
/// given pose, from principal axes and from rotations all around. Another model comes back with `aligned`
/// false and the overlap measured.
///
/// # Errors
/// When a mesh has no area, or an option is out of range.
pub fn align(
    original: &TriMesh,
    suspect: &TriMesh,
    options: &AlignOptions,
) -> Result<Alignment, RegistrationError> {
    align_until(original, suspect, options, &mut |_| ControlFlow::Continue(()))
}

/// As [`align`]; `watch` hears of each stage and may stop the search, by the clock for instance.
///
/// # Errors
/// As [`align`], and [`RegistrationError::Stopped`].
pub fn align_until(
    original: &TriMesh,
    suspect: &TriMesh,
    options: &AlignOptions,
    watch: &mut (dyn FnMut(Stage) -> ControlFlow<()> + Send),
) -> Result<Alignment, RegistrationError> {
    check(options)?;
    threads::in_pool(options.threads, || {
        let mut at = |stage| match watch(stage) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(RegistrationError::Stopped),
        };
        at(Stage::Connectivity)?;
        let by_vertices = by_vertices(original, suspect);
        at(Stage::Preparation)?;
        let pair = Pair {
            original: Sampled::of(original, "original", SAMPLES)?,
            suspect: Sampled::of(suspect, "suspect", SAMPLES)?,
            options,
        };
        if let Some(ByVertices {
            transform,
            basis,
            correspondence,
            alternatives,
        }) = by_vertices
        {
            let found = pair.judged(transform, basis, Some(correspondence), alternatives);
            if found.aligned {
                return Ok(found);
            }
        }
        pair.by_surface(&mut at)
    })?
}

/// Samples of each surface.
const SAMPLES: usize = 20_000;

fn check(options: &AlignOptions) -> Result<(), RegistrationError> {
    let &AlignOptions {
        tolerance,
        least_overlap,
        ..
    } = options;
    if !(tolerance > 0.0 && tolerance < 1.0) {
        let range = "greater than 0 and less than 1";
        return Err(RegistrationError::Option {
            name: "tolerance",
            value: tolerance,
            range,
        });
    }
    if !(0.0..=1.0).contains(&least_overlap) {
        let range = "between 0 and 1";
        return Err(RegistrationError::Option {
            name: "least_overlap",
            value: least_overlap,
            range,
        });
    }
    Ok(())
}

/// Fewer surviving vertices than this are taken for chance.
const FEWEST_SURVIVORS: usize = 30;

/// Pairs farther apart than this many medians are strays.
const STRAY: f64 = 5.0;

/// Maps of symmetric meshes onto themselves that are told apart.
const MOST_MAPS: usize = 128;

/// What surviving vertices say.
struct ByVertices {
    transform: Similarity,
    basis: Basis,
    correspondence: Correspondence,
    alternatives: Vec<Similarity>,
}

/// The similarity between vertices that survived, if enough did.
fn by_vertices(original: &TriMesh, suspect: &TriMesh) -> Option<ByVertices> {
    let fit = |map: &Correspondence| map.fit_robustly(original, suspect, Handedness::Either);
    if let Ok(maps) = match_candidates(original, suspect, MOST_MAPS) {
        let mut maps = maps.into_iter();
        let correspondence = maps.next()?;
        let transform = fit(&correspondence).ok()?.transform;
        let alternatives = maps.filter_map(|map| Some(fit(&map).ok()?.transform)).collect();
        return Some(ByVertices {
            transform,
            basis: Basis::Connectivity,
            correspondence,
            alternatives,
        });
    }
    let correspondence = without_strays(match_surroundings(original, suspect), original, suspect)?;
    let transform = fit(&correspondence).ok()?.transform;
    Some(ByVertices {
        transform,
        basis: Basis::Surroundings,
        correspondence,
        alternatives: Vec::new(),
    })
}

/// Drops pairs that lie far off the similarity of all, until the rest agree; none when too few are left.
fn without_strays(mut map: Correspondence, original: &TriMesh, suspect: &TriMesh) -> Option<Correspondence> {
    let rounding = 1e-12 * original.bounding_box().diagonal();
    let mut before = usize::MAX;
    while map.matched() >= FEWEST_SURVIVORS && map.matched() < before {
        before = map.matched();
        let to_original = map.fit(original, suspect, Handedness::Either).ok()?.transform;
        let place = |w: u32| to_original.apply(suspect.positions()[w as usize]);
        let off = |v: usize, w: u32| norm(sub(place(w), original.positions()[v]));
        let pairs = map.suspect_of.iter().enumerate();
        let mut distances: Vec<f64> = pairs.filter_map(|(v, w)| w.map(|w| off(v, w))).collect();
        let middle = distances.len() / 2;
        let (_, &mut median, _) = distances.select_nth_unstable_by(middle, f64::total_cmp);
        for (v, slot) in map.suspect_of.iter_mut().enumerate() {
            *slot = slot.filter(|&w| off(v, w) <= STRAY * median + rounding);
        }
    }
    (map.matched() >= FEWEST_SURVIVORS).then_some(map)
}

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

struct Pair<'a> {
    original: Sampled,
    suspect: Sampled,
    options: &'a AlignOptions,
}

type Ranked = Vec<(f64, Similarity)>;

impl Pair<'_> {
    fn by_surface(
        &self,
        at: &mut dyn FnMut(Stage) -> Result<(), RegistrationError>,
    ) -> Result<Alignment, RegistrationError> {
        let mut cheap = vec![Similarity::IDENTITY];
        cheap.extend(guesses::principal_axes(&self.original, &self.suspect));
        let mut ranked = self.finalists(cheap, at)?;
        if !self.convinced(&ranked) {
            let fields = [Field::of(&self.original), Field::of(&self.suspect)];
            let rotations = guesses::all_rotations(&self.original, &self.suspect, ROTATIONS);
            ranked.extend(self.finalists(self.promising(rotations, &fields), at)?);
            if !self.convinced(&ranked) {
                let partial = congruent::guesses(&self.original, &self.suspect, &fields[0], REFINED);
                ranked.extend(self.finalists(partial, at)?);
            }
        }
        ranked.sort_by(|x, y| y.0.total_cmp(&x.0));
        at(Stage::Refinement)?;
        let Some(&(score, best)) = ranked.first() else {
            return Ok(self.judged(Similarity::IDENTITY, Basis::Surface, None, Vec::new()));
        };
        let transform = if score > HOPELESS {
            self.cared_for(best)
        } else {
            best
        };
        let alternatives = self.alternatives(&ranked, score, &transform);
        Ok(self.judged(transform, Basis::Surface, None, alternatives))
    }

    /// Refines the best guess by samples of both surfaces and by the suspect's vertices, and keeps what
    /// agrees better.
    fn cared_for(&self, guess: Similarity) -> Similarity {
        let refined = |start: Similarity, effort: Effort, ends: Ends| {
            icp::refine(&self.original, &self.suspect, start, effort, ends)
        };
        let start = refined(guess, CARE[0], Ends::Samples).map_or(guess, |refined| refined.transform);
        let by_samples = refined(start, CARE[1], Ends::Samples);
        let by_vertices = refined(start, CARE[1], Ends::Vertices);
        let both = [by_samples, by_vertices].into_iter().flatten();
        let better = both.min_by(|x, y| x.deviation.total_cmp(&y.deviation));
        better.map_or(start, |refined| refined.transform)
    }

    /// Refines guesses at a glance, and the best of them with a longer look.
    fn finalists(
        &self,
        guesses: Vec<Similarity>,
        at: &mut dyn FnMut(Stage) -> Result<(), RegistrationError>,
    ) -> Result<Ranked, RegistrationError> {
        let mut glanced = self.refined(guesses, GLANCE, at)?;
        let best = glanced.first().map_or(0.0, |(score, _)| *score);
        if best < HOPELESS {
            glanced.truncate(1);
            return Ok(glanced);
        }
        glanced.retain(|(score, _)| *score >= WORTH_A_LOOK * best);
        glanced.truncate(FINALISTS);
        let guesses = glanced.into_iter().map(|(_, guess)| guess).collect();
        self.refined(guesses, LOOK, at)
    }

    /// Refines guesses and ranks the results, the best first.
    fn refined(
        &self,
        guesses: Vec<Similarity>,
        effort: Effort,
        at: &mut dyn FnMut(Stage) -> Result<(), RegistrationError>,
    ) -> Result<Ranked, RegistrationError> {
        let total = guesses.len();
        let mut refined = Vec::new();
        for (done, guess) in guesses.into_iter().enumerate() {
            at(Stage::Guesses { done, total })?;
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
            if *score >= 0.98 * best && differs(transform) && others.iter().all(differs) {
                others.push(*other);
            }
        }
        others
    }

    fn judged(
        &self,
        transform: Similarity,
        basis: Basis,
        correspondence: Option<Correspondence>,
        alternatives: Vec<Similarity>,
    ) -> Alignment {
        let overlap = Overlap::measure(
            &self.original,
            &self.suspect,
            &transform,
            self.options.tolerance,
            SAMPLES,
        );
        Alignment {
            transform,
            basis,
            overlap: overlap.of_suspect,
            coverage: overlap.of_original,
            residual: overlap.residual,
            aligned: overlap.of_suspect >= self.options.least_overlap,
            correspondence,
            alternatives,
        }
    }
}
