use std::sync::Arc;

use mesh::{Similarity, Vec3};
use registration::AlignOptions;

use crate::mark::{AttackModel, JointEstimate, MarkLayout, Registered, SoftBits};

/// What was read of a suspect, and in which pose.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Reading {
    /// The bits, or the coefficients.
    pub soft: SoftBits,
    /// Takes the suspect to the original.
    pub transform: Similarity,
    /// The share of the original's vertices at which the suspect has no surface, from 0 to 1.
    pub missing: f64,
    /// Of the vertices that were seen, the share that lies within the [tolerance](AlignOptions::tolerance) of where they belong, from 0 to 1.
    pub in_place: f64,
    /// Whether each vertex of the original was seen where it belongs, within the same tolerance, #V.
    pub seen: Arc<[bool]>,
    /// Root mean square distance of corresponding points, in the original's unit.
    pub residual: f64,
    /// What moved the suspect; none where the joint estimate was not asked.
    pub attack_model: Option<AttackModel>,
    /// 1 − v of each soft value, from 0 to 1: how much of what it may be the suspect tells; none where another detector than the joint estimate read them.
    pub known: Arc<[f64]>,
    /// Of how many patches it is.
    pub patches_read: usize,
    /// Of how many readings this could have been chosen: what a p-value is to be multiplied by.
    pub tries: usize,
}

impl Reading {
    pub(super) fn new(
        layout: &MarkLayout,
        registered: &Registered,
        transform: Similarity,
        soft: SoftBits,
    ) -> Self {
        let original = layout.original().mesh();
        let pairs = registered.positions.iter().zip(original.positions());
        let square = |(r, &v): (&Option<[f64; 3]>, &[f64; 3])| r.map(|r| (Vec3(r) - Vec3(v)).squared());
        let all: Vec<Option<f64>> = pairs.map(square).collect();
        let bound = (AlignOptions::default().tolerance * original.bounding_box().diagonal()).powi(2);
        let seen: Arc<[bool]> = all
            .iter()
            .map(|square| square.is_some_and(|square| square <= bound))
            .collect();
        let squares: Vec<f64> = all.into_iter().flatten().collect();
        let near = seen.iter().filter(|&&seen| seen).count();
        Self {
            soft,
            in_place: near as f64 / squares.len().max(1) as f64,
            transform,
            residual: (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt(),
            missing: registered.missing(),
            seen,
            attack_model: None,
            known: Arc::default(),
            patches_read: layout.patches_seen(&registered.positions).len(),
            tries: 1,
        }
    }

    /// That of a joint estimate.
    pub(super) fn of(
        layout: &MarkLayout,
        registered: &Registered,
        transform: Similarity,
        estimate: &JointEstimate,
    ) -> Self {
        Self {
            attack_model: Some(estimate.attack_model),
            known: estimate.known.as_slice().into(),
            ..Self::new(layout, registered, transform, estimate.soft.clone())
        }
    }

    /// The same, where places that are another shape are not where they belong; nothing is told of places of which too little was seen.
    pub(super) fn where_it_is_one_shape(self, is_so: &[Option<bool>]) -> Self {
        let was_seen = is_so.iter().flatten().count().max(1) as f64;
        let seen: Arc<[bool]> = self
            .seen
            .iter()
            .zip(is_so)
            .map(|(&seen, &is_so)| seen && is_so == Some(true))
            .collect();
        let in_place = seen.iter().filter(|&&seen| seen).count() as f64 / was_seen;
        Self {
            seen,
            in_place,
            ..self
        }
    }

    /// The same, with what another detector reads in that pose.
    pub(super) fn with_soft(self, soft: SoftBits) -> Self {
        let known = Arc::default();
        Self { soft, known, ..self }
    }
}
