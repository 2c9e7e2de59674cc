//! One alignment: what came out, and whether it is right.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{
    reading::{BitRates, ReadingRule},
    trial::PoseTrial,
};
use crate::measure::{greatest, median};

/// Root mean square error as a fraction of the diagonal where geometry is unchanged. What is exact comes back to 1e-13
/// (`results/registration.md`); marks move vertices by 1e-4 and more.
pub(crate) const EXACT: f64 = 1e-6;

/// A pose that is off by less than this is the right one, if not exactly: three times what smoothing, the worst of the attacks, makes the right
/// pose seem to be off (`results/registration.md`), and far less than any wrong pose is.
pub(crate) const RIGHT_POSE: f64 = 5e-3;

/// The true transform may read so much more of the bits: two of 512.
pub(crate) const LOST_RATE: f64 = 0.005;

/// One suspect in one random pose, as it is kept.
#[derive(Serialize, Deserialize)]
pub(crate) struct PoseDraw {
    pub(crate) aligned: bool,
    /// Root mean square distance of the suspect's vertices from where they belong, over the original's diagonal.
    pub(crate) error: f64,
    /// That of the unmarked suspect, where it lies exactly on the original.
    pub(crate) exact_error: Option<f64>,
    pub(crate) hand_recognised: bool,
    /// None for strangers, and for what did not align.
    pub(crate) rates: Option<BitRates>,
    pub(crate) overlap: f64,
    /// CPU seconds of the alignment.
    pub(crate) cpu: f64,
    /// What else the alignment says, for whoever looks into a draw that is not right.
    pub(crate) diagnostics: Value,
}

impl PoseDraw {
    /// Extraction rates with the found transform and with the true one.
    pub(crate) fn rates(&self, rule: ReadingRule) -> Option<[f64; 2]> {
        self.rates.map(|rates| rates.by(rule))
    }

    pub(crate) fn is_right(&self, trial: PoseTrial, rule: ReadingRule) -> bool {
        if trial.is_stranger() {
            return !self.aligned;
        }
        let as_good = |[found, truth]: [f64; 2]| found >= truth - LOST_RATE - 1e-12;
        let reads = self.rates(rule).is_some_and(as_good);
        let exact = self.exact_error.is_none_or(|error| error <= EXACT);
        self.aligned && self.hand_recognised && self.error < RIGHT_POSE && reads && exact
    }

    /// By how many points the true transform reads more than the found one.
    pub(crate) fn shortfall(&self, rule: ReadingRule) -> Option<f64> {
        self.rates(rule).map(|[found, truth]| 100.0 * (truth - found))
    }
}

/// The draws of one mesh and trial.
pub(crate) struct TrialDraws {
    pub(crate) mesh: String,
    pub(crate) vertices: usize,
    pub(crate) trial: PoseTrial,
    pub(crate) draws: Vec<PoseDraw>,
}

impl TrialDraws {
    /// How many draws are right.
    pub(crate) fn right(&self, rule: ReadingRule) -> usize {
        let right = |draw: &&PoseDraw| draw.is_right(self.trial, rule);
        self.draws.iter().filter(right).count()
    }

    /// A line of progress.
    pub(crate) fn words(&self) -> String {
        let errors = || self.draws.iter().map(|draw| draw.error);
        let seconds = || self.draws.iter().map(|draw| draw.cpu);
        format!(
            "{}, {}: {} of {} right, error {:.1e} (worst {:.1e}), {:.2} s (worst {:.2})",
            self.mesh,
            self.trial.name(),
            self.right(ReadingRule::LeastSquares),
            self.draws.len(),
            median(errors()),
            greatest(errors()),
            median(seconds()),
            greatest(seconds()),
        )
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::{super::reading::ReadingRule::LeastSquares, *};
    use serde_json::json;

    /// Aligned, so far off, with these extraction rates in the found and in the true pose.
    pub(crate) fn draw(error: f64, rates: [f64; 2]) -> PoseDraw {
        let kept = json!({
            "aligned": true,
            "error": error,
            "exact_error": null,
            "hand_recognised": true,
            "rates": {"least_squares": rates, "paper": rates},
            "overlap": 1.0,
            "cpu": 2.0,
            "diagnostics": {},
        });
        serde_json::from_value(kept).unwrap()
    }

    #[test]
    fn a_draw_is_right_that_lies_where_it_belongs_and_reads_as_the_true_pose_does() {
        let trial = PoseTrial::all().next().unwrap();
        let is_right = |draw: &PoseDraw| draw.is_right(trial, LeastSquares);
        assert!(is_right(&draw(1e-4, [0.995, 1.0])) && is_right(&draw(1e-4, [1.0, 0.9])));
        assert!(!is_right(&draw(1e-4, [0.99, 1.0])) && !is_right(&draw(0.1, [1.0, 1.0])));
        let sound = || draw(1e-4, [1.0, 1.0]);
        let wrong = [
            PoseDraw {
                aligned: false,
                ..sound()
            },
            PoseDraw {
                hand_recognised: false,
                ..sound()
            },
            PoseDraw {
                exact_error: Some(1e-5),
                ..sound()
            },
            PoseDraw {
                rates: None,
                ..sound()
            },
        ];
        assert!(is_right(&sound()) && !wrong.iter().any(is_right));
    }

    #[test]
    fn a_stranger_is_right_when_it_does_not_align() {
        let aligned = draw(1e-4, [1.0, 1.0]);
        assert!(!aligned.is_right(PoseTrial::Stranger, LeastSquares));
        let refused = PoseDraw {
            aligned: false,
            ..aligned
        };
        assert!(refused.is_right(PoseTrial::Stranger, LeastSquares));
    }
}
