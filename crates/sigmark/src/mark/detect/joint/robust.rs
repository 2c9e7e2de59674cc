//! Robust weights: how much an observation counts, from what a first estimate left of it.

use std::f64::consts::{FRAC_1_PI, FRAC_1_SQRT_2};

use super::observations::{Observation, ObservationKind};

/// Gives observations the weights of Student's t distribution for their residuals, one distribution a kind; the mean weight stays
/// what it was without.
pub(super) fn reweight(observations: &mut [Observation], residuals: &[f64]) {
    let noises = ObservationKind::ALL.map(|kind| {
        let of_kind = observations.iter().zip(residuals);
        let of_kind = of_kind.filter(|(observation, _)| observation.kind == kind);
        Noise::of(&of_kind.map(|(o, &e)| (o.mass, e, o.misfit)).collect::<Vec<_>>())
    });
    let largest = noises.iter().map(|noise| noise.student.scale).fold(0.0, f64::max);
    if largest == 0.0 {
        return;
    }
    let (mut before, mut after) = (0.0, 0.0);
    for (observation, &residual) in observations.iter_mut().zip(residuals) {
        let noise = &noises[observation.kind as usize];
        let relative = (noise.student.scale / largest).max(LEAST_SCALE);
        observation.robust_weight = noise.weight(residual, observation.misfit) / relative.powi(2);
        before += observation.mass;
        after += observation.mass * observation.robust_weight;
    }
    let change = before / after;
    for observation in observations {
        observation.robust_weight *= change;
    }
}

/// The noise of a kind of observations: Student's t distribution, √(1 + (misfit / bearable)²) times as wide where a misfit is.
struct Noise {
    student: StudentT,
    /// In diagonals.
    bearable: f64,
}

/// Misfits to choose from that are bearable, in diagonals. Where regions say nothing, as those of a suspect that was not decimated, any is.
const BEARABLE: [f64; 6] = [f64::INFINITY, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5];

impl Noise {
    /// The likeliest for residuals with masses and misfits (mass, e, misfit).
    fn of(residuals: &[(f64, f64, f64)]) -> Self {
        let narrowed = |bearable: f64| -> Vec<(f64, f64)> {
            let narrow = |&(mass, e, misfit): &(f64, f64, f64)| (mass, e / widening(misfit, bearable));
            residuals.iter().map(narrow).collect()
        };
        let plain = || Self {
            student: StudentT::of(&narrowed(f64::INFINITY)),
            bearable: f64::INFINITY,
        };
        if residuals.iter().all(|&(_, _, misfit)| misfit == 0.0) {
            return plain();
        }
        let all: f64 = residuals.iter().map(|&(mass, ..)| mass).sum();
        let likelihood = |bearable: f64| -> f64 {
            let narrowed = narrowed(bearable);
            let wide = residuals
                .iter()
                .map(|&(mass, _, misfit)| mass * widening(misfit, bearable).ln());
            StudentT::with_freedom(JUDGE, &narrowed).1 - wide.sum::<f64>() / all
        };
        let likeliest = BEARABLE.map(|bearable| (likelihood(bearable), bearable));
        // Not a number, where nothing is left: then it is plain.
        let best = likeliest
            .into_iter()
            .fold((f64::NEG_INFINITY, f64::INFINITY), |best, next| {
                if next.0 > best.0 { next } else { best }
            });
        match best.1.is_finite() {
            true => Self {
                student: StudentT::of(&narrowed(best.1)),
                bearable: best.1,
            },
            false => plain(),
        }
    }

    /// Of a residual beside a misfit.
    fn weight(&self, residual: f64, misfit: f64) -> f64 {
        let widening = widening(misfit, self.bearable);
        self.student.weight(residual / widening) / widening.powi(2)
    }
}

/// What an observation weighs beside a misfit before residuals are known: as after most decimations.
pub(super) fn first_weight(misfit: f64) -> f64 {
    widening(misfit, BEARABLE[3]).powi(-2)
}

/// √(1 + (misfit / bearable)²).
fn widening(misfit: f64, bearable: f64) -> f64 {
    (1.0 + (misfit / bearable).powi(2)).sqrt()
}

/// Beside the least exact kind of observations, none counts as more exact than that: one without errors would be all that counts.
const LEAST_SCALE: f64 = 1e-3;

/// Student's t distribution of noise.
struct StudentT {
    /// Degrees of freedom; infinitely many are a normal distribution.
    freedom: f64,
    scale: f64,
}

/// Degrees of freedom to choose from, and the density at 0 for scale 1: Γ((ν + 1)/2) / (Γ(ν/2) √(νπ)).
const FREEDOMS: [(f64, f64); 6] = [
    (1.0, FRAC_1_PI),
    (2.0, FRAC_1_SQRT_2 / 2.0),
    (4.0, 3.0 / 8.0),
    (8.0, 0.386_699_020_961_393),
    (16.0, 0.392_761_230_468_75),
    (f64::INFINITY, 0.398_942_280_401_432_7),
];

/// Of these, the one by which bearable misfits are chosen: heavy tails, as decimation has.
const JUDGE: (f64, f64) = FREEDOMS[1];

/// Steps towards the likeliest scale, which come near to it at once.
const SCALE_STEPS: usize = 12;

impl StudentT {
    /// The likeliest of [`FREEDOMS`] for residuals with masses (mass, e), with the likeliest scale; scale 0 where nothing is left.
    fn of(residuals: &[(f64, f64)]) -> Self {
        let exact = Self {
            freedom: f64::INFINITY,
            scale: 0.0,
        };
        if residuals.iter().all(|&(mass, e)| mass * e * e == 0.0) {
            return exact;
        }
        let mut best = (f64::NEG_INFINITY, exact);
        for freedom in FREEDOMS {
            let (noise, likelihood) = Self::with_freedom(freedom, residuals);
            if likelihood > best.0 {
                best = (likelihood, noise);
            }
        }
        best.1
    }

    /// The one with these degrees of freedom, and this density at 0, that has the likeliest scale; and the mean logarithm of the residuals' density.
    fn with_freedom((freedom, peak): (f64, f64), residuals: &[(f64, f64)]) -> (Self, f64) {
        let mass: f64 = residuals.iter().map(|&(mass, _)| mass).sum();
        let mean = |f: &dyn Fn(f64) -> f64| {
            let terms = residuals.iter().map(|&(mass, e)| mass * f(e * e));
            terms.sum::<f64>() / mass
        };
        let mut noise = Self {
            freedom,
            scale: mean(&|square| square).sqrt(),
        };
        for _ in 0..SCALE_STEPS {
            noise.scale = mean(&|square| square * noise.weight(square.sqrt())).sqrt();
        }
        let likelihood = (peak / noise.scale).ln() - mean(&|square| noise.fall(square));
        (noise, likelihood)
    }

    /// (ν + 1) / (ν + e²/s²).
    fn weight(&self, residual: f64) -> f64 {
        if self.freedom.is_infinite() {
            1.0
        } else {
            (self.freedom + 1.0) / (self.freedom + (residual / self.scale).powi(2))
        }
    }

    /// By how much the logarithm of the density is below that at 0.
    fn fall(&self, square: f64) -> f64 {
        let square = square / self.scale.powi(2);
        if self.freedom.is_infinite() {
            square / 2.0
        } else {
            (self.freedom + 1.0) / 2.0 * (square / self.freedom).ln_1p()
        }
    }
}
