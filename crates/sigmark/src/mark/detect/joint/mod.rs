//! The joint estimate: the bits and whatever else moved the suspect, estimated together from all that was seen of it.
//!
//! At a vertex of the original the suspect's displacement d, in diagonals, is known along some unit vectors u: along all axes
//! where the vertex itself was found again, along the normal where the surface was sampled. Each is an observation
//!
//! u·d = Σₜ Xₜ bₜ + Σᵧ Gᵧ θᵧ + e,  Xₜ = Σ α φ Hᵏ u_axis over the chips of bit t,
//!
//! with bits b = ±1, fields G of a small similarity, of smoothing and of tessellation bias with coefficients θ, and noise e. The
//! estimate minimises
//!
//! Σ w e² + σ² Σ b²,  σ² the mean square of e,
//!
//! which is the best linear one where noise has no pattern, bits being as often 1 as −1. Samples of a suspect coarser than the
//! original are not independent: σ² is then as many times larger as there are samples to a vertex of the suspect. Vertices that
//! were not seen take no part. The mark is noise to θ, and θ takes nothing from the bits.
//!
//! **Coefficients.** A mark of a pooled layout goes to the coefficients through a keyed rotation. Patches are set up for what it adds to each coefficient; bits follow from these by the transposed rotation. Whoever asks for many marks of one original at once solves for the coefficients themselves (`patchwise.rs`).
//!
//! **Soft bits.** vₜ is the variance that is left to bₜ where it was 1 before. Without the prior the observations would say bₜ / (1 − vₜ) with the variance
//! vₜ / (1 − vₜ), and ln P(1) / P(0) is twice the one by the other, 2 bₜ / vₜ. Noise is not all in e: neighbouring samples err alike, and another mark may lie on the same harmonics. But the mean of bₜ² would be 1 − vₜ, so σ² grows until
//! it is.
//!
//! **Smoothing.** Smoothing, decimation and subdivision move a surface towards the mean of its neighbourhood. With L x the way
//! from each vertex to the mean of its neighbours, k steps x ← x + λ L x with any λ, of either sign, displace by a polynomial
//! of degree k of L. So G has the fields L x, L² x, …, too: what any few steps do to the original is known but for these
//! coefficients, and is taken out. Without them a change of scale would have to account for it.
//!
//! **Offset.** A constant growth along the normals is a field, too: a scan that was made solid has two walls, of which each lies beside the original, and printers add a little everywhere. It is left out unless it explains
//! more than the mark would, since on a round model it is all but a scale.
//!
//! **Bending.** So are stretches, shears and all polynomials of degree 2 and 3 of a place: affine maps, bends and twists by some degrees are close to that. A degree is left out unless it explains more than the
//! mark would, since on a small model it has much in common with the lowest harmonics, and on a round one with a similarity.
//!
//! **Gains.** What is left of the mark in each band of frequencies is estimated first (`gains.rs`), and is the amplitude that the equations expect.
//!
//! **Tessellation bias.** A coarser suspect's flat triangles cut the corners of the original. What that does to each sample is known
//! for vertices on the original ([`Registered::tessellation_bias`]), and is a field, too. Its coefficient is 1 for re-meshed suspects.
//! Decimation by quadrics puts vertices outside, so that the bias cancels in the mean: what harmonics hold of the field, which is
//! where the bits are, has a coefficient of its own.
//!
//! **Quadric bias.** Where decimation puts vertices follows from which of the original's went into them ([`Registered::quadric_bias`]), as well as that is known:
//! two more fields, for planes that weigh alike and by area. What a vertex is off from there along the surface, its misfit, says how well it is known. Of a suspect that was decimated X has what the mark does to its vertices in place of what it does to the original's
//! (`mark/settling.rs`).
//!
//! **Balance.** Where it is known how regions may lie, as after decimation that can be drawn again, the suspect is also seen without samples: each vertex of the suspect has three observations, of how the planes of its region pull at it, whitened by
//! what draws of its region leave open (`mark/balance.rs`), if the bits are known better so. X and G are the pulls of the original's planes where a displacement was there before the decimation; what the mark does to the part of a region that lies in other patches is noise.
//!
//! **Robust weights.** w is the area that an observation stands for, times a weight for its residual. A sample of a surface stands
//! for the mass of its vertex, since errors of samples that are near each other are alike. A vertex that was found again has an error
//! of its own, however little surface there is around it: each stands for the mean mass. Where a surface was decimated or re-meshed,
//! most samples are good and a few, at edges and tips, are far off; and noise or rounding that follows the bounding box differs from
//! axis to axis. Noise is therefore taken for Student's t distribution, of the degrees of freedom ν and scale s that the residuals
//! of each kind of observations in a patch make likeliest: w ∝ mass · (ν + 1) / (ν s² + e²) (Lange, Little and Taylor 1989). Beside a misfit m,
//! s is √(1 + m²/m₀²) times as large, with the likeliest m₀.
//! Residuals are of a first estimate from the patch alone, or, where it has too few observations for one, from all patches together.
//! Within a patch weights have the mean 1, so that none loses its bits to a smooth place in it; in the end each patch counts by the noise that an estimate from all of them leaves in it: decimation
//! leaves more where the surface is rough.

mod design;
mod equations;
mod factor;
mod fields;
mod gains;
mod model;
mod observations;
mod patch;
mod patchwise;
mod robust;
mod solving;
mod system;

use std::{
    collections::BTreeMap,
    ops::RangeInclusive,
    sync::{Arc, OnceLock},
};

use job::Job;
use mesh::{Similarity, Vec3};
use registration::LocalFrames;
use serde::Serialize;

use super::Detector;
#[cfg(doc)]
use crate::mark::ChipPlan;
use crate::mark::{Balances, MarkError, MarkLayout, Patch, PatchBasis, Registered, SoftBits};
pub use model::JointModel;

use design::{Design, View};
use equations::NormalEquations;
use fields::{
    BENDING_FIELDS, OFFSET_FIELDS, OPTIONAL_FIELDS, OPTIONAL_LEVELS, OriginalSurface, SURFACE_FIELDS,
    bending_fields,
};
use observations::Observation;
use patch::PatchEquations;
use patchwise::PatchwiseEquations;
use solving::{Solving, number_bits, places};

/// Estimates the bits together with a misalignment, smoothing and tessellation bias, by robust least squares over what was seen.
///
/// Where the suspect's surface was sampled along normals, or parts of it are missing, chips disturb each other; this takes them
/// apart. What smoothing did to the shape is estimated and taken out, and samples that are far off count for little. Costs
/// #V l² operations.
#[derive(Debug)]
pub struct JointEstimator {
    layout: Arc<MarkLayout>,
    unknowns: Unknowns,
    model: JointModel,
    /// Built when it is first needed.
    surface: Arc<OnceLock<OriginalSurface>>,
}

/// What is estimated of a mark.
#[derive(Clone, Copy, Debug)]
enum Unknowns {
    /// The bits, each of which has chips in several patches.
    Bits,
    /// What the mark adds to each coefficient, whatever its bits and its key are.
    Coefficients,
}

/// What the equations say.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct JointEstimate {
    /// ln P(bit t is 1) / P(it is 0) as the observations have it, cut off at ±[`MOST_CERTAIN`](Self::MOST_CERTAIN); 0 where
    /// none of the bit's chips was seen. Of [coefficients](JointEstimator::of_coefficients) what the mark adds to each, in units of its amplitude.
    pub soft: SoftBits,
    /// 1 − v of each of these, from 0 to 1: how much of what it may be the observations tell.
    pub known: Vec<f64>,
    /// The small similarity by which the suspect is off, in the original's frame.
    pub misalignment: Similarity,
    /// How space was bent besides; none where that explains less than the mark does.
    pub bending: Option<Bending>,
    /// The root mean square of e, in diagonals.
    pub noise: f64,
    /// What moved the suspect.
    pub attack_model: AttackModel,
    /// The coefficients of the offset and of L x, L² x, …
    of_surface: [f64; SURFACE_FIELDS],
}

impl JointEstimate {
    /// Beyond this, a ratio says less of the bit than of how well noise is known: a few hundred that are all but certain would drown thousands that are not.
    pub const MOST_CERTAIN: f64 = 12.0;

    /// How much the observations tell of a bit in the mean, as they have it themselves, from 0 to 1: no bit that is looked for has a say.
    pub(crate) fn tells(&self) -> f64 {
        self.known.iter().sum::<f64>() / self.known.len().max(1) as f64
    }

    /// Whichever of two tells more; the first of equals.
    pub(crate) fn or(self, other: Self) -> Self {
        match other.tells() > self.tells() {
            true => other,
            false => self,
        }
    }
}

/// A mild bending of space: p moves by a polynomial of degree 3 of its place.
#[derive(Clone, Debug)]
pub struct Bending {
    coefficients: [f64; BENDING_FIELDS],
    centre: Vec3,
    diagonal: f64,
}

impl Bending {
    /// So many fields of degree 2 there are at most, with the offset before them.
    pub(crate) const OF_DEGREE_2: usize = OPTIONAL_LEVELS[1];

    /// So many fields there are at most, likewise.
    pub(crate) const MOST: usize = OPTIONAL_FIELDS;

    /// How many fields it has, likewise.
    pub(crate) fn fields(&self) -> usize {
        let last = self.coefficients.iter().rposition(|&c| c != 0.0);
        last.map_or(0, |last| OFFSET_FIELDS + last + 1)
    }

    /// Where a point of the original's frame was before, to first order.
    pub fn undone(&self, p: [f64; 3]) -> [f64; 3] {
        let place = (Vec3(p) - self.centre) / self.diagonal;
        let moved = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| {
            let fields = bending_fields(place, axis);
            fields.iter().zip(&self.coefficients).map(|(f, c)| f * c).sum()
        });
        (Vec3(p) - Vec3(moved) * self.diagonal).into()
    }
}

/// What moved a suspect from the original, as the joint estimate has it: of each cause, the share of the weighted squares of all
/// observed displacements that it explains. The shares add up to 1; one below 0 says that a cause was cancelled by others.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct AttackModel {
    /// The mark itself.
    pub mark: f64,
    /// A similarity that was left over by the registration.
    pub misalignment: f64,
    /// A growth along the normals that is the same everywhere; 0 where that would explain less than the mark does.
    pub offset: f64,
    /// Smoothing, or sharpening.
    pub smoothing: f64,
    /// Flat triangles that are not the original's.
    pub tessellation_bias: f64,
    /// A stretch, a shear, a bend or a twist of space, as far as polynomials of degree 3 follow it.
    pub bending: f64,
    /// Nothing of these.
    pub noise: f64,
}

impl JointEstimator {
    /// An estimator for marks of this layout.
    pub fn new(layout: &Arc<MarkLayout>) -> Self {
        Self {
            layout: Arc::clone(layout),
            unknowns: Unknowns::Bits,
            model: JointModel::default(),
            surface: Arc::default(),
        }
    }

    /// An estimator for what any mark of a pooled layout adds to the coefficients, one value a chip in the [order](ChipPlan::Pooled) of chips, in units of the amplitude: the same for all keys, so that one
    /// reading serves all marks of one original.
    pub fn of_coefficients(layout: &Arc<MarkLayout>) -> Self {
        Self {
            unknowns: Unknowns::Coefficients,
            ..Self::new(layout)
        }
    }

    /// The same estimator that takes less into account, to compare with.
    pub fn with_model(self, model: JointModel) -> Self {
        Self { model, ..self }
    }

    /// Where the marks lie, and how strong they are.
    pub fn layout(&self) -> &Arc<MarkLayout> {
        &self.layout
    }

    /// The same estimator, which reads some patches only, numbered from 0 and ascending.
    pub(crate) fn among(&self, patches: &[usize]) -> Self {
        Self {
            layout: Arc::new(self.layout.among(patches)),
            unknowns: self.unknowns,
            model: self.model,
            surface: Arc::clone(&self.surface),
        }
    }

    /// What a registered suspect says.
    ///
    /// # Errors
    /// When there is not one observation a vertex of the original, its bases can't be computed, or its coordinates not be squared;
    /// [`MarkError::Job`].
    pub fn estimate(&self, suspect: &Registered, job: &Job) -> Result<JointEstimate, MarkError> {
        self.estimate_with(suspect, &(0..=OPTIONAL_FIELDS), job)
    }

    /// As [`estimate`](Self::estimate), with at least so many optional fields, however little they explain, and at most so many.
    pub(crate) fn estimate_with(
        &self,
        suspect: &Registered,
        optional: &RangeInclusive<usize>,
        job: &Job,
    ) -> Result<JointEstimate, MarkError> {
        self.estimated(suspect, None, None, optional, job)
    }

    /// As [`estimate_with`](Self::estimate_with), by what the suspect's vertices say of the planes that went into them, instead of by samples.
    pub(crate) fn estimate_by(
        &self,
        balances: &Balances,
        suspect: &Registered,
        optional: &RangeInclusive<usize>,
        job: &Job,
    ) -> Result<JointEstimate, MarkError> {
        self.estimated(suspect, None, Some(balances), optional, job)
    }

    /// A suspect in the pose of its estimate, where it would be seen if nobody had smoothed it, or made it grow along its normals, to first order.
    pub(crate) fn unsmoothed(
        &self,
        mut suspect: Registered,
        estimate: &JointEstimate,
        job: &Job,
    ) -> Result<Registered, MarkError> {
        let original = self.layout.original();
        let patches = original.patches().iter().map(Patch::vertices);
        let mut is_in_patch = vec![false; original.mesh().vertex_count()];
        patches
            .clone()
            .flatten()
            .for_each(|&v| is_in_patch[v as usize] = true);
        let others: Vec<u32> = (0..)
            .zip(is_in_patch)
            .filter_map(|(v, is)| (!is).then_some(v))
            .collect();
        let parts: Vec<&[u32]> = patches.chain([others.as_slice()]).collect();
        let of_vertex = |fields: [Vec3; SURFACE_FIELDS]| -> Vec3 {
            let terms = fields.into_iter().zip(estimate.of_surface);
            terms.map(|(field, coefficient)| field * coefficient).sum()
        };
        let surface = self.surface();
        let of_part = |i: usize| -> Vec<Vec3> {
            let fields = surface.fields(parts[i]).into_iter();
            fields.map(of_vertex).collect()
        };
        let moved = job.map(parts.len(), 1, of_part)?;
        let diagonal = original.mesh().bounding_box().diagonal();
        let seen = suspect.positions.clone();
        for (&v, moved) in parts
            .iter()
            .zip(moved)
            .flat_map(|(part, moved)| part.iter().zip(moved))
        {
            let before = seen[v as usize].map(|p| (Vec3(p) - moved * diagonal).into());
            suspect.positions[v as usize] = before;
        }
        Ok(suspect)
    }

    /// What a suspect says that is seen in [local frames](registration::LocalFrames), one for each patch of which something is seen: it lies where its own surroundings would have it, but for what they leave.
    /// Whatever else moves a surface is taken to be gone with what is smooth.
    pub(crate) fn estimate_in_frames(
        &self,
        suspect: &Registered,
        frames: &[Option<LocalFrames>],
        job: &Job,
    ) -> Result<JointEstimate, MarkError> {
        self.estimated(suspect, Some(frames), None, &(0..=0), job)
    }

    /// Computes what it asks of the original's surface now, and not when it is first needed.
    pub(crate) fn prepare(&self) {
        self.surface();
    }

    fn surface(&self) -> &OriginalSurface {
        let of = || OriginalSurface::of(self.layout.original().mesh());
        self.surface.get_or_init(of)
    }

    fn estimated(
        &self,
        suspect: &Registered,
        frames: Option<&[Option<LocalFrames>]>,
        balances: Option<&Balances>,
        optional: &RangeInclusive<usize>,
        job: &Job,
    ) -> Result<JointEstimate, MarkError> {
        let layout = &*self.layout;
        let original = layout.original();
        suspect.check(original.mesh().vertex_count())?;
        let design = Design::new(original, self.surface(), self.model, suspect, frames, balances);
        let redundancy = design.redundancy();
        let of_patch = |index: usize, patch: &Patch, basis: &PatchBasis| {
            let view = View::new(&design, layout, index, patch, basis);
            let mut seen = view.observations(&design, suspect);
            if let Some(frames) = design.frames_of(index) {
                let across = |seen: Observation| seen.across(frames.hidden(seen.vertex));
                seen = seen.into_iter().filter_map(across).collect();
            }
            seen.iter_mut()
                .for_each(|observation| self.model.limit(observation));
            Ok((index, PatchEquations::new(&design, &view, seen, redundancy)?))
        };
        let patches = layout.map_seen(&suspect.positions, of_patch, job)?;
        let mut patches: BTreeMap<usize, PatchEquations> =
            patches.into_iter().collect::<Result<_, MarkError>>()?;
        let solving = |bits| Solving {
            design: &design,
            layout,
            model: self.model,
            suspect,
            bits,
            optional,
        };
        match self.unknowns {
            Unknowns::Bits => {
                let seen = number_bits(&mut patches);
                let solving = solving(seen.len());
                let mut estimate = solving.estimate::<NormalEquations>(patches, job)?;
                estimate.place_among(&seen, layout.bits());
                Ok(estimate)
            }
            Unknowns::Coefficients => {
                let places = places(layout, patches.keys());
                let solving = solving(0);
                let mut estimate = solving.estimate::<PatchwiseEquations>(patches, job)?;
                estimate.place_among(&places, layout.chip_count());
                Ok(estimate)
            }
        }
    }
}

impl Detector for JointEstimator {
    fn detect(&self, suspect: &Registered, job: &Job) -> Result<SoftBits, MarkError> {
        Ok(self.estimate(suspect, job)?.soft)
    }
}

impl JointEstimate {
    /// Puts what was estimated where it belongs among so many values, of which nothing else is known.
    fn place_among(&mut self, places: &[usize], count: usize) {
        let (mut values, mut known) = (vec![0.0; count], vec![0.0; count]);
        for (i, &place) in places.iter().enumerate() {
            values[place] = self.soft.values()[i];
            known[place] = self.known[i];
        }
        self.soft = self.soft.with_values(values);
        self.known = known;
    }
}
