//! What speaks for an original, and when it is enough to look closer.
//!
//! Each measure has a *gate*, which a model that is in no library seldom passes, and which the originals of attacked ones nearly always pass by one measure at least; an original's score is how far beyond the gate it
//! comes by the best of them. Where distances are to be small is a question of how many there are: what counts is a distance beside that of the [`TENTH`] nearest original.
//!
//! Gates were chosen on half of the models of `cargo xtask bench library`.

use crate::OriginalId;

/// By what an original is near.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum By {
    /// The whole shape.
    Whole,
    /// Its surface, on which the suspect lies.
    Surface,
    /// Small shapes, wherever they lie.
    Local,
    /// Vertices that the files have in common.
    Tessellation,
}

impl By {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Whole, Self::Surface, Self::Local, Self::Tessellation];

    /// The name in reports for programs.
    pub fn name(self) -> &'static str {
        match self {
            Self::Whole => "whole",
            Self::Surface => "surface",
            Self::Local => "local",
            Self::Tessellation => "tessellation",
        }
    }
}

/// An original that a suspect may have been made of.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Candidate {
    /// Its number.
    pub original: OriginalId,
    /// What speaks most for it.
    pub by: By,
    /// How much that is: from 1, the same, to 0, no more than may speak for a stranger's model.
    pub score: f64,
    /// Whether an alignment is worth its while: of those that score, of the likeliest few, and of those on which most of the suspect lies.
    pub is_worth_a_look: bool,
    /// How near it is by each of [`By::ALL`], from 1, the same, to 0.
    pub likeness: [f64; 4],
}

/// The nearest original by which distances are measured, counted from 1.
pub(super) const TENTH: usize = 10;

/// What is known of a suspect and an original.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measures {
    /// Mean differences of bytes of the whole, and of small shapes.
    pub(super) whole: f64,
    pub(super) local: f64,
    /// The share of the suspect that lies on the original.
    pub(super) share: f64,
    /// [`Shared::score`](super::tessellation::Shared::score).
    pub(super) tessellation: f64,
}

/// How distances by one measure are judged.
struct Distances {
    /// At which nothing is said any more, however far others are.
    farthest: f64,
    /// Is added to distances, so that small ones are alike.
    least: f64,
    /// The logarithm of the quotient of the tenth nearest distance to this one, at which the gate is.
    gate: f64,
    /// Distances that pass wherever others are: ten versions of a model may be in a library.
    near: f64,
}

const WHOLE: Distances = Distances {
    farthest: 8.0,
    least: 0.3,
    gate: 0.28,
    near: 0.6,
};
const LOCAL: Distances = Distances {
    farthest: 10.0,
    least: 0.5,
    gate: 0.6,
    near: 0.4,
};
/// Shares of a suspect on an original, and what vertices say, that pass.
const SURFACE_GATE: f64 = 0.5;
const TESSELLATION_GATE: f64 = 0.45;

impl Distances {
    fn likeness(&self, distance: f64) -> f64 {
        (1.0 - distance / self.farthest).max(0.0)
    }

    /// How far beyond the gate a distance is, at most 1.
    fn beyond(&self, distance: f64, tenth: f64) -> f64 {
        let farther = |other: f64| ((other + self.least) / (distance + self.least)).ln() - self.gate;
        let most = ((self.farthest + self.least) / self.least).ln() - self.gate;
        let beside = farther(tenth.min(self.farthest)) / most;
        beside.max(1.0 - distance / self.near)
    }
}

impl Measures {
    /// How far beyond its gate an original is by each of [`By::ALL`], and how like it is; `tenth` is of the originals that are tenth nearest by the whole and by small shapes.
    pub(super) fn candidate(&self, original: OriginalId, tenth: [f64; 2]) -> (f64, Candidate) {
        let beyond = [
            WHOLE.beyond(self.whole, tenth[0]),
            (self.share - SURFACE_GATE) / (1.0 - SURFACE_GATE),
            LOCAL.beyond(self.local, tenth[1]),
            (self.tessellation - TESSELLATION_GATE) / (1.0 - TESSELLATION_GATE),
        ];
        let best = (1..4).fold(0, |best, k| if beyond[k] > beyond[best] { k } else { best });
        let candidate = Candidate {
            original,
            by: By::ALL[best],
            score: beyond[best].clamp(0.0, 1.0),
            is_worth_a_look: beyond[best] > 0.0,
            likeness: [
                WHOLE.likeness(self.whole),
                self.share,
                LOCAL.likeness(self.local),
                self.tessellation,
            ],
        };
        (beyond[best], candidate)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn score(whole: f64, share: f64, tessellation: f64, tenth: f64) -> f64 {
        let measures = Measures {
            whole,
            local: 20.0,
            share,
            tessellation,
        };
        measures.candidate(OriginalId(1), [tenth, 5.0]).1.score
    }

    #[test]
    fn the_same_shape_scores_one_however_many_versions_of_it_there_are() {
        for tenth in [0.0, 0.1, 3.0, f64::INFINITY] {
            assert_eq!(score(0.0, 0.0, 0.0, tenth), 1.0);
        }
    }

    #[test]
    fn one_of_many_that_are_as_near_is_not_looked_at() {
        assert_eq!(score(3.0, 0.4, 0.3, 3.2), 0.0);
        assert!(score(1.0, 0.4, 0.3, 3.2) > 0.0);
    }

    #[test]
    fn any_one_measure_is_enough() {
        assert!(score(20.0, 0.8, 0.0, 15.0) > 0.5);
        assert!(score(20.0, 0.0, 0.9, 15.0) > 0.5);
        assert_eq!(score(20.0, 0.0, 0.0, 15.0), 0.0);
    }

    #[test]
    fn nearer_is_never_less() {
        let scores: Vec<f64> = (0..100)
            .map(|k| score(f64::from(k) * 0.1, 0.0, 0.0, 6.0))
            .collect();
        assert!(scores.is_sorted_by(|a, b| a >= b));
    }
}
