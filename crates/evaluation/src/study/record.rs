//! What a study finds, as it is kept.

use std::collections::BTreeMap;

use baselines::DetectorId;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::metrics::D_RMSE;

/// What is attacked.
#[derive(Clone, Copy)]
pub(crate) struct Target {
    /// From 0: the signature that the mesh has. The original is read as if it had the first.
    pub(crate) signature: usize,
    /// Of the mark, or of the one that is looked for.
    pub(crate) alpha: f64,
    pub(crate) is_marked: bool,
}

impl Target {
    pub(crate) fn marked(signature: usize, alpha: f64) -> Self {
        Self {
            signature,
            alpha,
            is_marked: true,
        }
    }

    pub(crate) fn unmarked(alpha: f64) -> Self {
        Self {
            signature: 0,
            alpha,
            is_marked: false,
        }
    }

    /// Whether it is the one that figures show.
    pub(crate) fn is_first(self) -> bool {
        self.is_marked && self.signature == 0
    }
}

/// α, and whether the mark then has the distortion that was asked for.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct Strength {
    pub(crate) alpha: f64,
    /// Whether α is the one that the paper gives.
    pub(crate) printed: bool,
    /// False where even α = 0 distorts more: then α is the paper's.
    pub(crate) reached: bool,
}

/// The time for everything that does not depend on the signature.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct Preparation {
    pub(crate) patches: usize,
    pub(crate) functions: usize,
    pub(crate) seconds: f64,
    pub(crate) threads: usize,
}

/// A marked mesh beside its original.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Mark {
    pub(crate) alpha: f64,
    /// What the [metrics](super::metrics) say of it, by ids.
    pub(crate) figures: BTreeMap<String, f64>,
    /// What it took to make it.
    pub(crate) seconds: f64,
    /// What it took to compute these metrics.
    pub(crate) measuring_seconds: f64,
}

impl Mark {
    /// In per cent of the diagonal.
    pub(crate) fn d_rmse(&self) -> f64 {
        self.figures.get(D_RMSE).copied().unwrap_or(f64::NAN)
    }
}

/// What one attack left of one mark.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Cell {
    /// What the attack reported of itself.
    pub(crate) attack: Value,
    pub(crate) vertices: usize,
    pub(crate) aligned: bool,
    /// What the alignment rests on.
    pub(crate) basis: String,
    pub(crate) overlap: f64,
    /// The share of the reference's vertices that were not seen.
    pub(crate) missing: f64,
    /// By each way to read them, the paper's first.
    pub(crate) readings: Vec<Rated>,
    /// By ever better readers, where they were asked.
    pub(crate) steps: Vec<Step>,
    pub(crate) attack_seconds: f64,
    /// The reference's search structures, which the cells of a mesh share.
    pub(crate) reference_seconds: f64,
    pub(crate) registration_seconds: f64,
    /// Sampling and reading, all detectors together.
    pub(crate) reading_seconds: f64,
}

impl Cell {
    /// What each detector read, for people.
    pub(crate) fn rates_in_words(&self) -> String {
        let readings = self.readings.iter();
        let words: Vec<String> = readings
            .map(|rated| format!("{:.2} % ({})", 100.0 * rated.rate, rated.detector.name()))
            .collect();
        words.join(", ")
    }
}

/// What a detector read, judged.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Rated {
    pub(crate) detector: DetectorId,
    /// Eq. 18, from 0 to 1.
    pub(crate) rate: f64,
    /// T₀ of what was read; none where the suspect did not fit the original.
    pub(crate) margin: Option<f64>,
    /// How likely chance agrees as well, at most.
    pub(crate) p_value: f64,
    /// Of how many readings this could have been chosen: what the p-value was multiplied by.
    pub(crate) tries: usize,
    /// With the true transform in place of the one found; none where it is not known, or where the paper's rule read all bits.
    pub(crate) rate_in_true_pose: Option<f64>,
    /// Agreement with signatures that are in no mesh.
    pub(crate) strangers: Vec<f64>,
    /// Whether the bits are a signature of the message (eqs. 19, 20), or Sigmark's verdict.
    pub(crate) verified: bool,
}

/// What one of the [readers](super::steps::READERS) read.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Step {
    pub(crate) reader: DetectorId,
    /// As [`Rated::rate`].
    pub(crate) rate: f64,
    /// T₀.
    pub(crate) margin: f64,
}
