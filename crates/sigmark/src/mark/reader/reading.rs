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
        let squares = squares(layout, registered);
        let sum: f64 = squares.iter().flatten().sum();
        let (seen, in_place) = in_place(layout, &squares);
        Self {
            soft,
            in_place,
            transform,
            residual: (sum / squares.iter().flatten().count().max(1) as f64).sqrt(),
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

    /// The same, of which it was found out where it would be seen but for what is known to have moved it.
    pub(super) fn where_it_would_be(self, layout: &MarkLayout, registered: &Registered) -> Self {
        let (seen, in_place) = in_place(layout, &squares(layout, registered));
        Self {
            seen,
            in_place,
            ..self
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

/// The squared distance of each vertex of the original from where it was seen, #V.
fn squares(layout: &MarkLayout, registered: &Registered) -> Vec<Option<f64>> {
    let places = layout.original().mesh().positions();
    let pairs = registered.positions.iter().zip(places);
    let square = |(r, &v): (&Option<[f64; 3]>, &[f64; 3])| r.map(|r| (Vec3(r) - Vec3(v)).squared());
    pairs.map(square).collect()
}

/// Which vertices were seen where they belong, and what share they are of those that were seen.
fn in_place(layout: &MarkLayout, squares: &[Option<f64>]) -> (Arc<[bool]>, f64) {
    let diagonal = layout.original().mesh().bounding_box().diagonal();
    let bound = (AlignOptions::default().tolerance * diagonal).powi(2);
    let is_near = |square: &Option<f64>| square.is_some_and(|square| square <= bound);
    let seen: Arc<[bool]> = squares.iter().map(is_near).collect();
    let near = seen.iter().filter(|&&seen| seen).count();
    (seen, near as f64 / squares.iter().flatten().count().max(1) as f64)
}
