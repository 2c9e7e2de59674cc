//! From the equations of patches to what they say together: weights, noise, and the solution, for bits or for coefficients.

use std::{
    collections::BTreeMap,
    ops::{Range, RangeInclusive},
};

use faer::Mat;
use job::Job;

use super::{
    AttackModel, JointEstimate, JointModel,
    design::{Design, View},
    equations::REWEIGHTINGS,
    fields::{BENDING_FIELDS, FIELDS, OFFSET_FIELDS, RIGID_FIELDS, SIMILARITY_FIELDS, SMOOTHING_FIELDS},
    gains::Gains,
    patch::PatchEquations,
    system::System,
};
use crate::mark::{MarkError, MarkLayout, Patch, PatchBasis, Registered, SoftBits};

/// Beside the noisiest patch none counts as less noisy than this: one without noise would be all that counts.
const LEAST_NOISE: f64 = 1e-6;

/// Numbers the bits of patches among those that any of them carries, which are returned, ascending.
pub(super) fn number_bits(patches: &mut BTreeMap<usize, PatchEquations>) -> Vec<usize> {
    let bits = patches.values().flat_map(|patch| patch.bits().iter().copied());
    let mut seen: Vec<usize> = bits.collect();
    seen.sort_unstable();
    seen.dedup();
    patches.values_mut().for_each(|patch| patch.number_among(&seen));
    seen
}

/// The places of some patches' chips among those of all.
pub(super) fn places<'a>(layout: &MarkLayout, patches: impl Iterator<Item = &'a usize>) -> Vec<usize> {
    let counts: Vec<usize> = (0..layout.alphas().len())
        .map(|i| layout.chips(i).len())
        .collect();
    let start = |i: usize| counts[..i].iter().sum::<usize>();
    patches.flat_map(|&i| start(i)..start(i) + counts[i]).collect()
}

/// What all patches are solved with.
pub(super) struct Solving<'a> {
    pub(super) design: &'a Design<'a>,
    pub(super) layout: &'a MarkLayout,
    pub(super) model: JointModel,
    pub(super) suspect: &'a Registered,
    /// How many bits there are.
    pub(super) bits: usize,
    /// How many optional fields there are to be at least and at most.
    pub(super) optional: &'a RangeInclusive<usize>,
}

impl Solving<'_> {
    /// Weighs observations and patches, and solves.
    pub(super) fn estimate<S: System>(
        &self,
        mut patches: BTreeMap<usize, PatchEquations>,
        job: &Job,
    ) -> Result<JointEstimate, MarkError> {
        let redundancy = self.design.redundancy();
        let mut system: S = self.system(&patches);
        let mut noise = None;
        let waiting: usize = patches.values().map(PatchEquations::waiting).sum();
        if self.model.has_weights() && system.can_weigh(waiting) {
            for _ in 0..REWEIGHTINGS {
                let (solution, left) = system.solved(noise)?;
                noise = Some(left);
                let of_patch = |index: usize, patch: &Patch, basis: &PatchBasis| {
                    let equations = &patches[&index];
                    let own = || system.own(index, equations, &solution);
                    let view = || View::new(self.design, self.layout, index, patch, basis);
                    (index, equations.weighed_by(self.design, view, own, redundancy))
                };
                let seen = &self.suspect.positions;
                patches = self.layout.map_seen(seen, of_patch, job)?.into_iter().collect();
                system = self.system(&patches);
            }
        }
        if self.model.has_weights() {
            let (solution, _) = system.solved(noise)?;
            let own = |index: usize, patch: &PatchEquations| system.own(index, patch, &solution);
            noise = Some(redundancy * weigh(&mut patches, own, redundancy));
            system = self.system(&patches);
        }
        self.solved(&system, noise)
    }

    fn system<S: System>(&self, patches: &BTreeMap<usize, PatchEquations>) -> S {
        let none = 0..=0;
        let optional = if self.model.has_optional() {
            self.optional
        } else {
            &none
        };
        S::of(patches, self.bits, self.design.redundancy(), optional)
    }

    /// What the equations of all patches say, beginning with so much noise.
    fn solved<S: System>(&self, system: &S, noise: Option<f64>) -> Result<JointEstimate, MarkError> {
        let (solution, variances) = system.posterior(noise)?;
        let (theta, fields, squares) = (system.theta(&solution), system.fields(), system.squares());
        let of_similarity: [f64; SIMILARITY_FIELDS] = std::array::from_fn(|j| theta[j]);
        let bending: [f64; BENDING_FIELDS] = std::array::from_fn(|j| theta[FIELDS - BENDING_FIELDS + j]);
        let share = |explained: f64| if squares > 0.0 { explained / squares } else { 0.0 };
        let explained = |of: Range<usize>| share(of.map(|j| theta[j] * fields[(FIELDS, j)]).sum());
        let smoothing = SIMILARITY_FIELDS + SMOOTHING_FIELDS;
        let offset = RIGID_FIELDS + OFFSET_FIELDS;
        let mark = share(system.mark_explains(&solution));
        // The fields of translation are the components of u, which has length 1 or little more.
        let weight: f64 = (SIMILARITY_FIELDS - 3..SIMILARITY_FIELDS)
            .map(|j| fields[(j, j)])
            .sum();
        let means = system.means(&solution);
        let values = match S::IS_OF_BITS {
            true => SoftBits::ratios(log_likelihood_ratios(means, &variances)),
            false => SoftBits::new(means),
        };
        Ok(JointEstimate {
            noise: (system.squares_left(&solution) / weight.max(f64::MIN_POSITIVE)).sqrt(),
            known: variances.iter().map(|v| (1.0 - v).clamp(0.0, 1.0)).collect(),
            soft: values,
            misalignment: self.design.similarity(of_similarity),
            of_surface: std::array::from_fn(|j| match j.checked_sub(OFFSET_FIELDS) {
                None => theta[RIGID_FIELDS + j],
                Some(k) => theta[SIMILARITY_FIELDS + k],
            }),
            bending: bending
                .iter()
                .any(|&c| c != 0.0)
                .then(|| self.design.bending(bending)),
            attack_model: AttackModel {
                mark,
                misalignment: explained(0..SIMILARITY_FIELDS),
                offset: explained(RIGID_FIELDS..offset),
                smoothing: explained(SIMILARITY_FIELDS..smoothing),
                tessellation_bias: explained(smoothing..RIGID_FIELDS),
                bending: explained(offset..FIELDS),
                noise: 1.0 - mark - explained(0..FIELDS),
            },
        })
    }
}

/// Makes each patch count by the noise that is left in it by what a solution says of its own unknowns, and expects of its coefficients what the gains leave; gives the largest noise.
fn weigh(
    patches: &mut BTreeMap<usize, PatchEquations>,
    own: impl Fn(usize, &PatchEquations) -> Mat<f64>,
    redundancy: f64,
) -> f64 {
    let noise = |(&index, patch): (&usize, &PatchEquations)| patch.noise(&own(index, patch));
    let mut noises: Vec<f64> = patches.iter().map(noise).collect();
    let largest = noises.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    noises
        .iter_mut()
        .for_each(|noise| *noise = noise.max(LEAST_NOISE * largest));
    let with_noise = noises.iter().map(|noise| redundancy * noise);
    let gains = Gains::of(patches.values().zip(with_noise));
    for (patch, noise) in patches.values_mut().zip(&noises) {
        patch.weigh(largest / noise);
        patch.weaken(&gains);
    }
    largest
}

/// Of bits with these posterior means and variances.
fn log_likelihood_ratios(means: Vec<f64>, variances: &[f64]) -> Vec<f64> {
    let most = JointEstimate::MOST_CERTAIN;
    let ratio = |(b, &v): (f64, &f64)| (2.0 * b / v.max(f64::MIN_POSITIVE)).clamp(-most, most);
    means.into_iter().zip(variances).map(ratio).collect()
}
