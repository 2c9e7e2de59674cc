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
        let narrowed = |bearable: f64| -> Squares {
            let narrow = |&(mass, e, misfit): &(f64, f64, f64)| (mass, e * e / widening(misfit, bearable));
            residuals.iter().map(narrow).collect()
        };
        let plain = || Self {
            student: StudentT::of(&narrowed(f64::INFINITY)),
            bearable: f64::INFINITY,
        };
        if residuals.iter().all(|&(_, _, misfit)| misfit == 0.0) {
            return plain();
        }
        let likelihood = |bearable: f64| -> f64 {
            let wide: Squares = residuals
                .iter()
                .map(|&(mass, _, misfit)| (mass, widening(misfit, bearable)))
                .collect();
            StudentT::with_freedom(JUDGE, &narrowed(bearable)).1 - 0.5 * wide.mean(f64::ln)
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
        self.student.weight(residual * residual / widening) / widening
    }
}

/// What an observation weighs beside a misfit before residuals are known: as after most decimations.
pub(super) fn first_weight(misfit: f64) -> f64 {
    1.0 / widening(misfit, BEARABLE[3])
}

/// How many times as large squares of residuals are beside a misfit: 1 + (misfit / bearable)².
fn widening(misfit: f64, bearable: f64) -> f64 {
    1.0 + (misfit / bearable).powi(2)
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

/// Steps towards the likeliest scale, which come near to it at once, and what share of it the last one may be.
const SCALE_STEPS: usize = 12;
const LAST_STEP: f64 = 1e-4;

/// Squares of residuals, and their masses.
struct Squares {
    masses: Vec<f64>,
    squares: Vec<f64>,
    /// The sum of all masses.
    mass: f64,
}

impl FromIterator<(f64, f64)> for Squares {
    fn from_iter<I: IntoIterator<Item = (f64, f64)>>(pairs: I) -> Self {
        let (masses, squares): (Vec<f64>, Vec<f64>) = pairs.into_iter().unzip();
        let mass = masses.iter().sum();
        Self {
            masses,
            squares,
            mass,
        }
    }
}

/// Sums that are added up side by side, as processors do it.
const LANES: usize = 8;

impl Squares {
    /// The mean of f(e²) over the masses.
    fn mean(&self, f: impl Fn(f64) -> f64) -> f64 {
        let mut sums = [0.0; LANES];
        for (masses, squares) in self.masses.chunks(LANES).zip(self.squares.chunks(LANES)) {
            for ((sum, &mass), &square) in sums.iter_mut().zip(masses).zip(squares) {
                *sum += mass * f(square);
            }
        }
        sums.iter().sum::<f64>() / self.mass
    }
}

impl StudentT {
    /// The likeliest of [`FREEDOMS`] for residuals, with the likeliest scale; scale 0 where nothing is left.
    fn of(residuals: &Squares) -> Self {
        let exact = Self {
            freedom: f64::INFINITY,
            scale: 0.0,
        };
        if residuals
            .masses
            .iter()
            .zip(&residuals.squares)
            .all(|(mass, square)| mass * square == 0.0)
        {
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
    fn with_freedom((freedom, peak): (f64, f64), residuals: &Squares) -> (Self, f64) {
        let mut noise = Self {
            freedom,
            scale: residuals.mean(|square| square).sqrt(),
        };
        for _ in 0..SCALE_STEPS {
            let before = noise.scale;
            noise.scale = residuals.mean(|square| square * noise.weight(square)).sqrt();
            if (noise.scale - before).abs() <= LAST_STEP * before {
                break;
            }
        }
        let likelihood = (peak / noise.scale).ln() - residuals.mean(|square| noise.fall(square));
        (noise, likelihood)
    }

    /// (ν + 1) / (ν + e²/s²), of e².
    fn weight(&self, square: f64) -> f64 {
        if self.freedom.is_infinite() {
            1.0
        } else {
            (self.freedom + 1.0) / (self.freedom + square / self.scale.powi(2))
        }
    }

    /// By how much the logarithm of the density is below that at 0.
    fn fall(&self, square: f64) -> f64 {
        let square = square / self.scale.powi(2);
        if self.freedom.is_infinite() {
            square / 2.0
        } else {
            // In a mean, ln_1p would tell no more.
            (self.freedom + 1.0) / 2.0 * (1.0 + square / self.freedom).ln()
        }
    }
}
