use mesh::Similarity;
use registration::{AlignOptions, Alignment, MatchedBy};

use crate::{
    claim::{Mismatch, verify::ByVertices},
    mark::{AttackModel, Found, ReadParts, Reading},
};

/// Whose copy a suspect is, or that nobody was found.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Trace {
    /// Those whose copies are in it, the surest first.
    pub accused: Vec<Accused>,
    /// Candidates, by their numbers, whose certificates would have been named, but are not signed by the key.
    pub unsigned: Vec<usize>,
    /// Where nobody is named, the other candidates whose certificates are not signed by the key: they were edited or damaged, and the marks that they were issued with were not asked for.
    pub altered: Vec<usize>,
    /// How many candidates were asked for.
    pub candidates: usize,
    /// In how many ways the suspect could lie on the original.
    pub poses: usize,
    /// How it was laid onto the original.
    pub matched_by: MatchedBy,
    /// Share of the suspect's surface that lies on the original, from 0 to 1.
    pub overlap: f64,
    /// Share of the original's surface that lies on the suspect, from 0 to 1.
    pub coverage: f64,
    /// Share of the original's vertices at which the suspect has no surface, from 0 to 1.
    pub missing: f64,
    /// Takes the suspect to the original; none where it does not fit, or was [bent](MatchedBy::is_bent): then no one transform does.
    pub transform: Option<Similarity>,
    /// What moved the suspect beside the marks.
    pub attack_model: Option<AttackModel>,
    /// Why the suspect is another shape, if it is: nobody is named then.
    pub mismatch: Option<Mismatch>,
    /// Whether it was laid onto the original and read there.
    is_laid: bool,
}

/// One whose copy is in a suspect.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Accused {
    /// The candidate's [number](super::Tracer::add).
    pub candidate: usize,
    /// The probability that anybody at all who is innocent would be named before or with him, an upper bound: it counts all candidates, poses and rounds.
    pub p_value: f64,
    /// T, beside those that were found before.
    pub correlation: f64,
    /// T₀ = T / √(1 − T²/l).
    pub margin: f64,
}

impl Trace {
    /// What is known of a suspect before anything is read.
    pub(super) fn unread(found: &Found, candidates: usize) -> Self {
        let alignment = found.alignment();
        let does_not_fit = alignment.filter(|alignment| !alignment.aligned);
        let share = |of: fn(&Alignment) -> f64| alignment.map_or(1.0, of);
        Self {
            poses: found.poses(),
            matched_by: found.matched_by(),
            overlap: share(|alignment| alignment.overlap),
            coverage: share(|alignment| alignment.coverage),
            mismatch: does_not_fit.map(|alignment| Mismatch::Surface {
                overlap: alignment.overlap,
                least: AlignOptions::default().least_overlap,
            }),
            ..Self::of_parts(candidates)
        }
    }

    /// What is known of a suspect's parts before any is read.
    pub(super) fn of_parts(candidates: usize) -> Self {
        Self {
            accused: Vec::new(),
            unsigned: Vec::new(),
            altered: Vec::new(),
            candidates,
            poses: 0,
            matched_by: MatchedBy::Parts,
            overlap: 0.0,
            coverage: 0.0,
            missing: 1.0,
            transform: None,
            attack_model: None,
            mismatch: None,
            is_laid: false,
        }
    }

    /// How the suspect was laid onto the original; none where it does not fit.
    pub fn registration(&self) -> Option<MatchedBy> {
        self.is_laid.then_some(self.matched_by)
    }

    /// Whether anybody was named.
    pub fn is_found(&self) -> bool {
        !self.accused.is_empty()
    }

    /// Takes over what the readings of all ways tell of the suspect, of which the one that sees most is said.
    pub(super) fn describe(&mut self, readings: &[&Reading], by_vertices: bool) {
        let Some(first) = readings.iter().max_by(|a, b| a.in_place.total_cmp(&b.in_place)) else {
            return;
        };
        self.is_laid = true;
        self.missing = first.missing;
        self.transform = (!self.matched_by.is_bent()).then_some(first.transform);
        self.attack_model = first.attack_model;
        if by_vertices {
            let ByVertices {
                overlap,
                coverage,
                mismatch,
            } = ByVertices::of(first);
            (self.overlap, self.coverage) = (overlap, coverage);
            self.mismatch = mismatch.or(self.mismatch);
        }
    }

    /// Takes over what the parts that were put back tell of the suspect, in the first of the ways in which they may belong.
    pub(super) fn describe_parts(&mut self, ways: &[ReadParts]) {
        self.poses = self.poses.max(ways.len());
        let Some(first) = ways.first() else {
            return;
        };
        (self.overlap, self.coverage) = (first.overlap, first.coverage);
        self.is_laid = true;
        self.missing = first.reading.missing;
        self.transform = Some(first.reading.transform);
        self.attack_model = first.reading.attack_model;
    }
}
