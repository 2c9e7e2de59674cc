//! What came out, before it is written.

use crate::{
    figures::Shown,
    paper::{Attack, Model},
    study::{Cell, Mark, Preparation, Strength, Target},
};

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
    pub(crate) algorithm: String,
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

/// Everything that the tables are made of.
pub(crate) struct Results {
    pub(crate) outcomes: Vec<Outcome>,
    /// What could not be done, in words.
    pub(crate) failures: Vec<String>,
    pub(crate) signatures: usize,
    /// The heat maps of Figs. 4 and 5.
    pub(crate) pictures: Vec<Shown>,
    pub(crate) foot: String,
}
