use std::sync::Arc;

use faer::{Mat, Side, linalg::solvers::Solve};
use sha2::{Digest, Sha256};

use crate::mark::{MarkLayout, Reading, Rotation, correlation};

/// In which order the chips of all marks of one layout go to the coefficients, before the [rotation](Rotation) of each.
#[derive(Clone, Debug)]
pub struct Order {
    functions: Vec<usize>,
    /// The chip in each place of the [runs](Rotation::in_runs), in whose order everything here is kept.
    chips: Vec<usize>,
    /// Its bit.
    bits: Vec<usize>,
    /// l.
    count: usize,
}

impl Order {
    /// That of a layout whose chips are pooled.
    pub fn of(layout: &MarkLayout) -> Self {
        let patches = 0..layout.alphas().len();
        let bits: Vec<usize> = patches
            .flat_map(|patch| layout.chips(patch).iter())
            .map(|chip| chip.bit)
            .collect();
        let functions = layout.original().functions().to_vec();
        let chips = Rotation::keyed(&[0; 32], &functions).in_runs();
        Self {
            bits: chips.iter().map(|&chip| bits[chip]).collect(),
            chips,
            functions,
            count: layout.bits(),
        }
    }

    /// What belongs to chips, in the order of runs.
    fn in_runs(&self, of_chips: &[f64]) -> Vec<f64> {
        self.chips.iter().map(|&chip| of_chips[chip]).collect()
    }

    /// What stands in the order of runs, in that of chips.
    fn of_chips(&self, in_runs: &[f64]) -> Vec<f64> {
        let mut of_chips = vec![0.0; in_runs.len()];
        for (&chip, &value) in self.chips.iter().zip(in_runs) {
            of_chips[chip] = value;
        }
        of_chips
    }

    /// How many chips there are, and coefficients.
    pub fn chips(&self) -> usize {
        self.bits.len()
    }

    /// l, how many bits a mark has.
    pub fn bits(&self) -> usize {
        self.count
    }
}

/// What distinguishes a copy from all others: its statement's hash, and its bits.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pattern {
    /// h, which the [rotation](Rotation) follows from.
    pub hash: [u8; 32],
    /// l of them.
    pub bits: Vec<bool>,
}

impl Pattern {
    /// One of l = `bits` that nobody has, the same for the same seed and number.
    pub fn decoy(seed: u64, number: u64, bits: usize) -> Self {
        let seed = Sha256::new_with_prefix(b"sigmark decoy\0").chain_update(seed.to_le_bytes());
        let hash: [u8; 32] = seed.chain_update(number.to_le_bytes()).finalize().into();
        let mut drawn = Vec::with_capacity(bits + 256);
        for i in 0_u64..(bits as u64).div_ceil(256) {
            let block = Sha256::new_with_prefix(hash).chain_update(i.to_le_bytes());
            for byte in block.finalize() {
                drawn.extend_from_slice(&[0, 1, 2, 3, 4, 5, 6, 7].map(|bit| byte >> bit & 1 == 1));
            }
        }
        drawn.truncate(bits);
        Self { hash, bits: drawn }
    }

    /// What the mark adds to each coefficient, in units of its amplitude and in the order of chips.
    pub fn coefficients(&self, order: &Order) -> Vec<f64> {
        order.of_chips(&self.in_runs(order))
    }

    fn in_runs(&self, order: &Order) -> Vec<f64> {
        let sign = |&bit: &usize| if self.bits[bit] { 1.0 } else { -1.0 };
        let mut all: Vec<f64> = order.bits.iter().map(sign).collect();
        Rotation::keyed(&self.hash, &order.functions).to_coefficients(&mut all);
        all
    }
}

/// What was read of a suspect's coefficients, less the patterns that were found in it.
///
/// With a prior variance of 1 the means are Σ⁻¹ û: what the suspect says of the coefficients, weighed by the inverse of all that may be in them, other copies' patterns and noise. So the correlation of a pattern with
/// them is the best linear test for it, whatever else is there. Where patterns s are known to be in it, û − S a takes the place of û, with the generalised least-squares a = (Sᵀ Σ⁻¹ S)⁻¹ Sᵀ Σ⁻¹ û; Σ⁻¹ is taken for diagonal, 1 − v.
#[derive(Clone, Debug)]
pub struct Residue {
    order: Arc<Order>,
    /// Σ⁻¹ û.
    means: Vec<f64>,
    /// The diagonal of Σ⁻¹.
    known: Vec<f64>,
    /// S.
    found: Vec<Vec<f64>>,
    /// Σ⁻¹ (û − S a).
    left: Vec<f64>,
}

impl Residue {
    /// What a reading of coefficients says; none where it is of another layout.
    pub fn of(reading: &Reading, order: &Arc<Order>) -> Option<Self> {
        let (means, known) = (reading.soft.values(), &reading.known);
        (means.len() == order.chips() && known.len() == order.chips()).then(|| {
            let means = order.in_runs(means);
            Self {
                order: Arc::clone(order),
                left: means.clone(),
                means,
                known: order.in_runs(known),
                found: Vec::new(),
            }
        })
    }

    /// T = Σ bₜ yₜ / √(Σ yₜ²) of a pattern, where yₜ is what its own chips of bit t show: a Rademacher sum for a pattern that has nothing to do with the suspect, whatever was done to that.
    ///
    /// # Panics
    /// When the pattern has not l bits.
    pub fn correlation(&self, pattern: &Pattern) -> f64 {
        correlation(&pattern.bits, &self.said(pattern))
    }

    /// What is said of each coefficient, in the order of chips: Σ⁻¹ û, less what was taken out.
    pub fn values(&self) -> Vec<f64> {
        self.order.of_chips(&self.left)
    }

    /// yₜ of a pattern's bits, l of them.
    fn said(&self, pattern: &Pattern) -> Vec<f64> {
        let Order {
            functions,
            bits,
            count,
            ..
        } = &*self.order;
        let mut chips = self.left.clone();
        Rotation::keyed(&pattern.hash, functions).to_chips(&mut chips);
        let mut said = vec![0.0; *count];
        for (&bit, chip) in bits.iter().zip(chips) {
            said[bit] += chip;
        }
        said
    }

    /// Of how many bits something is said.
    pub fn bits_seen(&self, pattern: &Pattern) -> usize {
        self.said(pattern).iter().filter(|y| **y != 0.0).count()
    }

    /// Takes a pattern out that is in the suspect, together with those before.
    pub fn take_out(&mut self, pattern: &Pattern) {
        self.found.push(pattern.in_runs(&self.order));
        let count = self.found.len();
        let weighed = |a: &[f64], b: &[f64]| -> f64 {
            let products = a.iter().zip(b).zip(&self.known);
            products.map(|((a, b), known)| a * b * known).sum()
        };
        let gram = Mat::from_fn(count, count, |i, j| weighed(&self.found[i], &self.found[j]));
        let right = Mat::from_fn(count, 1, |i, _| {
            self.found[i]
                .iter()
                .zip(&self.means)
                .map(|(s, x)| s * x)
                .sum::<f64>()
        });
        // Random patterns are all but orthogonal; one that was taken out twice leaves what was there.
        let Ok(factor) = gram.llt(Side::Lower) else {
            self.found.pop();
            return;
        };
        let strengths = factor.solve(&right);
        self.left.clone_from(&self.means);
        for (i, pattern) in self.found.iter().enumerate() {
            for ((left, s), known) in self.left.iter_mut().zip(pattern).zip(&self.known) {
                *left -= strengths[(i, 0)] * known * s;
            }
        }
    }
}
