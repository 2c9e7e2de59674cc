//! The equations of one patch, and the weights of its observations.

use faer::Mat;

use super::{
    design::{Design, View},
    equations::{NormalEquations, OBSERVATIONS_AN_UNKNOWN, REWEIGHTINGS, RIDGE, Solved},
    factor::Factor,
    fields::{FIELDS, RIGID_FIELDS},
    gains::Gains,
    observations::Observation,
    robust::reweight,
    system::System,
};
use crate::mark::{MarkError, PatchRotation};

/// The equations of one patch. Large patches weigh their observations by their own residuals; small ones wait for the solution of all patches together.
pub(super) struct PatchEquations {
    /// The bit of each of the first unknowns, or, where chips are spread, of the chip in its place. Numbered among all, or [among those that are seen](Self::number_among).
    pub(super) bits: Vec<usize>,
    /// What spreads the chips over the unknowns.
    rotation: Option<PatchRotation>,
    pub(super) equations: NormalEquations,
    /// Those that wait; none where they were weighed by the patch alone.
    observations: Option<Vec<Observation>>,
    /// How much each of its observations counts beside those of other patches.
    pub(super) weight: f64,
    /// The band of each unknown's frequency, if it has one.
    bands: Option<Vec<usize>>,
    /// What of each unknown's column is left.
    gains: Vec<f64>,
}

impl PatchEquations {
    /// The equations of a patch's observations, with robust weights where there are enough of them. A part of the observations is enough
    /// for the solutions that residuals are left by.
    pub(super) fn new(
        design: &Design<'_>,
        view: &View<'_>,
        mut observations: Vec<Observation>,
        redundancy: f64,
    ) -> Result<Self, MarkError> {
        let (bits, enough) = (
            view.bits().to_vec(),
            OBSERVATIONS_AN_UNKNOWN * view.rigid_unknowns(),
        );
        let of = |observations: &[Observation]| Self {
            gains: vec![1.0; bits.len()],
            bits,
            rotation: view.rotation(),
            equations: NormalEquations::weighted(design, view, observations, redundancy),
            observations: None,
            weight: 1.0,
            bands: view.bands(),
        };
        if !design.model.has_weights() {
            return Ok(of(&observations));
        }
        if observations.len() < enough {
            return Ok(Self {
                observations: Some(observations.clone()),
                ..of(&observations)
            });
        }
        for _ in 0..REWEIGHTINGS {
            // Axes take turns in the list: no stride of threes.
            let stride = observations.len() / enough;
            let stride = stride + usize::from(stride.is_multiple_of(3));
            let part: Vec<Observation> = observations.iter().step_by(stride).copied().collect();
            let equations = NormalEquations::weighted(design, view, &part, redundancy);
            let (solved, _) = equations.with_optional(0).solved(None)?;
            let residuals = design.residuals(view, &observations, &solved.solution);
            reweight(&mut observations, &residuals);
        }
        Ok(of(&observations))
    }

    /// The bits that the patch carries.
    pub(super) fn bits(&self) -> &[usize] {
        &self.bits
    }

    /// Numbers the bits by their places among those that are seen, which are ascending.
    pub(super) fn number_among(&mut self, seen: &[usize]) {
        for bit in &mut self.bits {
            *bit = seen.partition_point(|seen| seen < bit);
        }
    }

    /// The mean square of the noise that is left in this patch by what a solution of all says of its unknowns.
    pub(super) fn noise(&self, own: &Mat<f64>) -> f64 {
        let left = self.equations.squares_left_by(own);
        left / self.equations.observations.max(1) as f64
    }

    /// The Gram matrix, by its lower triangle, of what the observations say, as much as they count and as gains leave of it.
    pub(super) fn gram_of_unknowns(&self) -> Mat<f64> {
        let gram = &self.equations.gram;
        let gain = |i: usize| self.gains.get(i).copied().unwrap_or(1.0);
        let mut left = Mat::zeros(gram.nrows(), gram.ncols());
        for j in 0..gram.ncols() {
            for i in j..gram.nrows() {
                left[(i, j)] = self.weight * gain(i) * gain(j) * gram[(i, j)];
            }
        }
        left
    }

    /// The same with bits for unknowns, one for each place of [`bits`](Self::bits).
    pub(super) fn gram_of_bits(&self) -> Mat<f64> {
        let mut gram = self.gram_of_unknowns();
        if let Some(rotation) = &self.rotation {
            turn(rotation, self.bits.len(), &mut gram);
        }
        gram
    }

    /// What of each unknown's column is left.
    pub(super) fn gains(&self) -> &[f64] {
        &self.gains
    }

    /// What is expected of the square of each coefficient, with its band, from the patch alone with noise of this mean square.
    pub(super) fn squares(&self, noise: f64, gains: &Gains) -> Vec<(usize, f64)> {
        let Some(bands) = &self.bands else {
            return Vec::new();
        };
        let count = bands.len();
        let unknowns = count + RIGID_FIELDS;
        let gram = &self.equations.gram;
        let own = gram.get(..unknowns, ..unknowns);
        let added = |i: usize| {
            let prior = bands
                .get(i)
                .map_or(0.0, |&band| noise / gains.of_band(band).powi(2));
            RIDGE * gram[(i, i)] + prior + f64::MIN_POSITIVE
        };
        let Ok(factor) = Factor::of(own, added, None) else {
            return Vec::new();
        };
        let last = self.equations.unknowns();
        let right = Mat::from_fn(unknowns, 1, |i, _| gram[(last, i)]);
        let solved = Solved {
            solution: factor.solve(right),
            noise,
            factor,
        };
        let variances = solved.variances(count).into_iter();
        let squares = variances
            .enumerate()
            .map(|(i, v)| solved.solution[(i, 0)].powi(2) + v);
        bands.iter().copied().zip(squares).collect()
    }

    /// Expects of each coefficient what the gain of its band leaves.
    pub(super) fn weaken(&mut self, gains: &Gains) {
        if let Some(bands) = &self.bands {
            self.gains = bands.iter().map(|&band| gains.of_band(band)).collect();
        }
    }

    /// Makes each observation of the patch count so many times.
    pub(super) fn weigh(&mut self, weight: f64) {
        self.weight = weight;
    }

    /// What bits and fields of all patches say of the patch's own unknowns.
    pub(super) fn own(&self, solution: &Mat<f64>) -> Mat<f64> {
        let fields = solution.nrows() - FIELDS..solution.nrows();
        let bits: Vec<f64> = self.bits.iter().map(|&i| solution[(i, 0)]).collect();
        let spread = match &self.rotation {
            Some(rotation) => rotation.coefficients(&bits),
            None => bits,
        };
        let left = spread.iter().zip(&self.gains).map(|(u, gain)| gain * u);
        let own: Vec<f64> = left.chain(fields.map(|i| solution[(i, 0)])).collect();
        Mat::from_fn(own.len(), 1, |i, _| own[i])
    }

    /// How many observations wait for weights.
    pub(super) fn waiting(&self) -> usize {
        self.observations.as_ref().map_or(0, Vec::len)
    }

    /// The same patch, if it waits for weights, with those for what is left of its observations by what a solution of all says of its unknowns.
    pub(super) fn weighed_by<'v>(
        &self,
        design: &Design<'v>,
        view: impl FnOnce() -> View<'v>,
        own: impl FnOnce() -> Mat<f64>,
        redundancy: f64,
    ) -> Self {
        let same = || Self {
            bits: self.bits.clone(),
            rotation: self.rotation.clone(),
            equations: self.equations.clone(),
            observations: None,
            weight: self.weight,
            bands: self.bands.clone(),
            gains: self.gains.clone(),
        };
        let Some(mut observations) = self.observations.clone() else {
            return same();
        };
        let view = view();
        let residuals = design.residuals(&view, &observations, &own());
        reweight(&mut observations, &residuals);
        Self {
            equations: NormalEquations::weighted(design, &view, &observations, redundancy),
            observations: Some(observations),
            ..same()
        }
    }
}

/// Rᵀ G R for the first unknowns of a Gram matrix that is known by its lower triangle.
fn turn(rotation: &PatchRotation, unknowns: usize, gram: &mut Mat<f64>) {
    let all = gram.nrows();
    // Rows of the upper triangle are columns of the lower one: first what is beside the unknowns, then these from both sides.
    for row in unknowns..all {
        let turned: Vec<f64> = (0..unknowns).map(|j| gram[(row, j)]).collect();
        for (j, value) in rotation.chips(&turned).into_iter().enumerate() {
            gram[(row, j)] = value;
        }
    }
    let mut half = Mat::zeros(unknowns, unknowns);
    for j in 0..unknowns {
        let column: Vec<f64> = (0..unknowns).map(|i| gram[(i.max(j), i.min(j))]).collect();
        for (i, value) in rotation.chips(&column).into_iter().enumerate() {
            half[(j, i)] = value;
        }
    }
    for j in 0..unknowns {
        let turned = rotation.chips(half.col_as_slice(j));
        for i in j..unknowns {
            gram[(i, j)] = turned[i];
        }
    }
}
