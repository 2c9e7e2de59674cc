//! What is asked of a solver, and what becomes of it.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize};

use crate::measure::{greatest, median};

/// How many pairs, and how accurate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct EigenTask {
    pub(crate) count: usize,
    pub(crate) tolerance: f64,
}

/// What became of one computation, as it is kept: seconds, and the worst residual.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub(crate) enum SolveOutcome {
    Done {
        cpu: f64,
        wall: f64,
        #[serde(deserialize_with = "number_or_infinity")]
        residual: f64,
    },
    /// Stopped after so many CPU seconds.
    Stopped {
        #[serde(rename = "stopped")]
        after: f64,
    },
}

/// JSON has no infinity, and null in its place.
fn number_or_infinity<'de, D: Deserializer<'de>>(number: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(number)?.unwrap_or(f64::INFINITY))
}

impl SolveOutcome {
    /// Medians of the times, the worst of the residuals; of rounds of which one was stopped, that.
    pub(crate) fn median(rounds: &[Self]) -> Self {
        let stopped = rounds.iter().find(|round| matches!(round, Self::Stopped { .. }));
        if let Some(&stopped) = stopped {
            return stopped;
        }
        let figure = |which: fn(f64, f64, f64) -> f64| {
            rounds.iter().filter_map(move |round| match *round {
                Self::Done { cpu, wall, residual } => Some(which(cpu, wall, residual)),
                Self::Stopped { .. } => None,
            })
        };
        Self::Done {
            cpu: median(figure(|cpu, _, _| cpu)),
            wall: median(figure(|_, wall, _| wall)),
            residual: greatest(figure(|_, _, residual| residual)),
        }
    }

    /// CPU seconds; of a computation that was stopped, those until then.
    pub(crate) fn cpu(&self) -> f64 {
        match *self {
            Self::Done { cpu, .. } => cpu,
            Self::Stopped { after } => after,
        }
    }
}

impl fmt::Display for SolveOutcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Done { cpu, wall, residual } => {
                write!(
                    f,
                    "CPU {cpu:.2} s, wall {wall:.2} s, worst residual {residual:.1e}"
                )
            }
            Self::Stopped { after } => write!(f, "stopped after {after:.0} CPU seconds"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn done(cpu: f64, residual: f64) -> SolveOutcome {
        SolveOutcome::Done {
            cpu,
            wall: cpu,
            residual,
        }
    }

    #[test]
    fn a_round_that_was_stopped_leaves_no_median_and_a_bad_residual_shows() {
        let rounds = [done(3.0, 1e-7), done(1.0, 1e-3), done(2.0, 1e-8)];
        assert_eq!(SolveOutcome::median(&rounds), done(2.0, 1e-3));
        let stopped = SolveOutcome::Stopped { after: 900.0 };
        assert_eq!(SolveOutcome::median(&[rounds[0], stopped]), stopped);
    }

    #[test]
    fn outcomes_are_kept_by_what_they_are() {
        for outcome in [done(1.5, 1e-7), SolveOutcome::Stopped { after: 900.0 }] {
            let text = serde_json::to_string(&outcome).unwrap();
            assert_eq!(serde_json::from_str::<SolveOutcome>(&text).unwrap(), outcome);
        }
        let limit = serde_json::from_str::<SolveOutcome>("{\"stopped\":900}").unwrap();
        assert_eq!(limit, SolveOutcome::Stopped { after: 900.0 });
    }
}
