//! What came out, before it is written.

use baselines::{AlgorithmId, DetectorId};

use crate::{
    attacks::Attack,
    paper::{Model, Printed},
    study::{Cell, Mark, Preparation, Rated, Strength, Target, product::VERIFIER},
};

/// Everything that the pages are made of.
pub(crate) struct Results {
    pub(crate) outcomes: Vec<Outcome>,
    /// What could not be done, in words.
    pub(crate) failures: Vec<String>,
    pub(crate) signatures: usize,
    /// The heat maps of Figs. 4 and 5.
    pub(crate) pictures: Vec<Illustration>,
    pub(crate) foot: String,
}

/// What came out for one model.
pub(crate) struct Outcome {
    pub(crate) model: Model,
    pub(crate) file: String,
    pub(crate) digest: String,
    pub(crate) vertices: usize,
    pub(crate) columns: Vec<Column>,
}

/// What came out for one algorithm on one model.
pub(crate) struct Column {
    pub(crate) algorithm: AlgorithmId,
    /// The algorithm's, for people.
    pub(crate) name: String,
    /// d_rmse that was aimed at, in per cent.
    pub(crate) distortion: f64,
    pub(crate) preparation: Option<Preparation>,
    pub(crate) strength: Option<Strength>,
    pub(crate) marks: Vec<Mark>,
    pub(crate) trials: Vec<Trial>,
    /// At several strengths, in ascending order: Fig. 2.
    pub(crate) sweep: Vec<(Mark, Vec<Trial>)>,
}

/// A cell that is finished.
pub(crate) struct Trial {
    pub(crate) target: Target,
    pub(crate) attack: &'static Attack,
    pub(crate) cell: Cell,
    /// Of the suspect, as PNG, where a figure wants it.
    pub(crate) picture: Option<Vec<u8>>,
}

/// A picture with a caption, for the page.
#[derive(Clone)]
pub(crate) struct Illustration {
    /// With its extension: .png or .svg.
    pub(crate) file: String,
    pub(crate) title: String,
    pub(crate) caption: String,
    pub(crate) bytes: Vec<u8>,
}

impl Results {
    /// Every algorithm on every model.
    pub(crate) fn columns(&self) -> impl Iterator<Item = (&Outcome, &Column)> {
        let outcomes = self.outcomes.iter();
        outcomes.flat_map(|outcome| outcome.columns.iter().map(move |column| (outcome, column)))
    }
}

impl Outcome {
    pub(crate) fn printed(&self, column: &Column) -> Option<&Printed> {
        self.model.printed(&column.algorithm)
    }

    pub(crate) fn title(&self) -> String {
        format!("{} ({})", self.model.name, self.file)
    }
}

impl Column {
    /// Those of the α that the tables have, and of the sweep.
    pub(crate) fn all_marks(&self) -> impl Iterator<Item = &Mark> {
        self.marks.iter().chain(self.sweep.iter().map(|(mark, _)| mark))
    }

    /// As [`all_marks`](Self::all_marks).
    pub(crate) fn all_trials(&self) -> impl Iterator<Item = &Trial> {
        let swept = self.sweep.iter().flat_map(|(_, trials)| trials);
        self.trials.iter().chain(swept)
    }

    /// Those of marked meshes.
    pub(crate) fn marked(&self) -> impl Iterator<Item = &Trial> {
        self.trials.iter().filter(|trial| trial.target.is_marked)
    }

    /// What a detector read from the marked meshes after an attack.
    pub(crate) fn rated<'a>(
        &'a self,
        attack: &'a Attack,
        detector: &'a DetectorId,
    ) -> impl Iterator<Item = (&'a Trial, &'a Rated)> {
        self.marked()
            .filter(move |trial| trial.attack == attack)
            .flat_map(move |trial| trial.rated(detector).map(move |rated| (trial, rated)))
    }

    /// The rates of a detector after an attack, in per cent.
    pub(crate) fn rates(&self, attack: &Attack, detector: &DetectorId) -> Vec<f64> {
        let rated = self.rated(attack, detector);
        rated.map(|(_, rated)| 100.0 * rated.rate).collect()
    }

    /// T₀ of a detector after an attack, where it is known.
    pub(crate) fn margins(&self, attack: &Attack, detector: &DetectorId) -> Vec<f64> {
        let rated = self.rated(attack, detector);
        rated.filter_map(|(_, rated)| rated.margin).collect()
    }

    /// Whether T₀ of its readings is known.
    pub(crate) fn has_margins(&self) -> bool {
        let mut readings = self.trials.iter().flat_map(|trial| &trial.cell.readings);
        readings.any(|rated| rated.margin.is_some())
    }

    /// The detectors that read this algorithm's marks, the paper's first.
    pub(crate) fn detectors(&self) -> Vec<DetectorId> {
        let Some(trial) = self.trials.first() else {
            return vec![DetectorId::PAPER];
        };
        let readings = trial.cell.readings.iter();
        readings.map(|rated| rated.detector.clone()).collect()
    }

    /// As a table's row is called.
    pub(crate) fn title(&self, detector: &DetectorId) -> String {
        if *detector == DetectorId::PAPER || *detector == VERIFIER {
            self.name.clone()
        } else {
            format!("{}, {}", self.name, detector.name())
        }
    }
}

impl Trial {
    pub(crate) fn rated(&self, detector: &DetectorId) -> impl Iterator<Item = &Rated> {
        let readings = self.cell.readings.iter();
        readings.filter(move |rated| rated.detector == *detector)
    }
}
