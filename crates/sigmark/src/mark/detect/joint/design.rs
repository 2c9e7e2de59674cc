//! The design matrix: a row an observation, a column an unknown.

use faer::Mat;
use mesh::{Similarity, Vec3};
use registration::{LeftOfScalar, LocalFrames};

use super::{
    Bending, JointModel,
    fields::{
        BENDING_FIELDS, FIELDS, RIGID_FIELDS, SIMILARITY_FIELDS, SURFACE_FIELDS, bending_fields,
        similarity_fields,
    },
    gains::BANDS,
    observations::Observation,
};
use crate::mark::{
    Chip, MarkLayout, Original, Patch, PatchBasis, PatchRotation, Registered, Settling, SettlingOfPatch,
};

/// What the rows of all patches have in common.
pub(super) struct Design<'a> {
    /// See [`surface_fields`](super::fields::surface_fields).
    surface: &'a [[Vec3; SURFACE_FIELDS]],
    centre: Vec3,
    pub(super) diagonal: f64,
    /// To the frame in which the centre is 0 and the diagonal 1.
    to_unit: Similarity,
    /// Which fields there are.
    pub(super) model: JointModel,
    /// Those that each patch is seen in, if it is seen so; all are where one is.
    frames: Option<&'a [Option<LocalFrames>]>,
    /// How the suspect follows the original, if it was decimated.
    settling: Option<&'a Settling>,
}

/// The patch of some observations, and where its chips are. Its unknowns come first, then the fields: where chips are [spread](crate::mark::Rotation) over harmonics the part of the mark
/// in each coefficient, else the bits.
pub(super) struct View<'a> {
    /// α φ.
    amplitude: [f64; 3],
    chips: &'a [Chip],
    /// The bit of each unknown, or, where chips are spread, of the chip in its place.
    bits: Vec<usize>,
    /// The unknown that each chip's place belongs to.
    columns: Vec<usize>,
    rotation: Option<PatchRotation>,
    pub(super) patch: &'a Patch,
    pub(super) basis: &'a PatchBasis,
    left: Left,
}

/// What is seen of the harmonics of a patch, by their numbers from 0.
enum Left {
    /// All.
    All,
    /// What local frames leave of each.
    InFrames(Vec<LeftOfScalar>),
    /// What each does to the vertices of a decimated suspect.
    Settled(SettlingOfPatch, Vec<Vec<Option<[Vec3; 3]>>>),
}

impl Left {
    fn of(frames: &LocalFrames, basis: &PatchBasis, count: usize) -> Self {
        let harmonics = (0..count).map(|k| basis.spectrum().eigenfunction(k));
        Self::InFrames(harmonics.map(|f| frames.left_of_scalar(f)).collect())
    }

    fn settled(settling: &Settling, patch: &Patch, basis: &PatchBasis, count: usize) -> Self {
        let settling = settling.of_patch(patch);
        let harmonics = (0..count).map(|k| basis.spectrum().eigenfunction(k));
        let moved = harmonics.map(|f| settling.moved_by(f)).collect();
        Self::Settled(settling, moved)
    }
}

impl<'a> View<'a> {
    pub(super) fn new(
        design: &Design<'_>,
        layout: &'a MarkLayout,
        index: usize,
        patch: &'a Patch,
        basis: &'a PatchBasis,
    ) -> Self {
        let chips = layout.chips(index);
        let count = chips.iter().map(|chip| chip.frequency + 1).max().unwrap_or(0);
        let rotation = layout.rotation(index);
        let mut bits: Vec<usize> = chips.iter().map(|chip| chip.bit).collect();
        let columns = match rotation {
            Some(_) => (0..chips.len()).collect(),
            None => {
                bits.sort_unstable();
                bits.dedup();
                let column = |chip: &Chip| bits.partition_point(|&bit| bit < chip.bit);
                chips.iter().map(column).collect()
            }
        };
        Self {
            amplitude: layout.amplitude(index),
            chips,
            bits,
            columns,
            rotation,
            patch,
            basis,
            left: match (design.frames_of(index), design.settling) {
                (Some(frames), _) => Left::of(frames, basis, count),
                (None, Some(settling)) => Left::settled(settling, patch, basis, count),
                (None, None) => Left::All,
            },
        }
    }

    /// What an observation tells of a harmonic along an axis.
    fn told(&self, k: usize, axis: usize) -> impl Fn(&Observation) -> f64 {
        let harmonic = self.basis.spectrum().eigenfunction(k);
        move |observation| {
            let Observation { vertex, along, .. } = *observation;
            let all = along[axis] * harmonic[vertex];
            match &self.left {
                Left::All => all,
                Left::InFrames(left) => match &left[k] {
                    LeftOfScalar::Alike(left) => along[axis] * left[vertex],
                    LeftOfScalar::Along(left) => left[vertex][axis],
                    LeftOfScalar::OfAxes(left) => along.dot(left[axis][vertex]),
                },
                Left::Settled(settling, moved) => {
                    settling.seen_along(&moved[k], vertex, axis, along).unwrap_or(all)
                }
            }
        }
    }

    pub(super) fn bits(&self) -> &[usize] {
        &self.bits
    }

    pub(super) fn rotation(&self) -> Option<PatchRotation> {
        self.rotation.clone()
    }

    /// The band of each unknown's frequency; none where it has several.
    pub(super) fn bands(&self) -> Option<Vec<usize>> {
        if self.bits.len() < self.chips.len() {
            return None;
        }
        let highest = self.chips.iter().map(|chip| chip.frequency).max()?;
        let mut bands = vec![0; self.bits.len()];
        for (chip, &column) in self.chips.iter().zip(&self.columns) {
            bands[column] = BANDS * (chip.frequency - 1) / highest;
        }
        Some(bands)
    }

    /// How many bits and fields there are without the optional ones.
    pub(super) fn rigid_unknowns(&self) -> usize {
        self.bits.len() + RIGID_FIELDS
    }

    fn columns(&self) -> usize {
        self.bits.len() + FIELDS + 1
    }
}

impl<'a> Design<'a> {
    pub(super) fn new(
        original: &'a Original,
        surface: &'a [[Vec3; SURFACE_FIELDS]],
        model: JointModel,
        suspect: &'a Registered,
        frames: Option<&'a [Option<LocalFrames>]>,
    ) -> Self {
        let bounds = original.mesh().bounding_box();
        Self {
            surface,
            centre: Vec3(bounds.centre()),
            diagonal: bounds.diagonal(),
            to_unit: bounds.to_unit_frame(),
            model,
            frames,
            settling: suspect.settling.as_deref(),
        }
    }

    pub(super) fn frames_of(&self, patch: usize) -> Option<&LocalFrames> {
        self.frames?.get(patch)?.as_ref()
    }

    /// X, G and u·d, one row an observation, without weights.
    pub(super) fn rows(&self, view: &View<'_>, block: &[Observation]) -> Mat<f64> {
        let View { basis, patch, .. } = view;
        let scale = basis.area().sqrt() / self.diagonal;
        let amplitude = view.amplitude.map(|amplitude| scale * amplitude);
        let bits = view.bits.len();
        let mut rows = Mat::<f64>::zeros(block.len(), view.columns());
        for (chip, &column) in view.chips.iter().zip(&view.columns) {
            let told = view.told(chip.frequency, chip.axis);
            let column = rows.col_as_slice_mut(column).iter_mut();
            for (entry, observation) in column.zip(block) {
                *entry += amplitude[chip.axis] * told(observation);
            }
        }
        for (i, observation) in block.iter().enumerate() {
            let place = (patch.mesh().point(observation.vertex) - self.centre) / self.diagonal;
            let [normal, smoothing @ ..] = self.surface[patch.vertices()[observation.vertex] as usize];
            let fields = similarity_fields(place, observation.along).into_iter();
            let fields = fields.chain(smoothing.map(|field| observation.along.dot(field)));
            // A column of zeros is no unknown.
            let has_interference = self.model.has_interference() && self.frames.is_none();
            let fields = fields.map(|value| if has_interference { value } else { 0.0 });
            let fields = fields.chain(observation.tessellation_bias);
            let fields = fields.chain([observation.along.dot(normal)]);
            let fields = fields.chain(bending_fields(place, observation.along));
            for (j, value) in fields.chain([observation.displacement]).enumerate() {
                rows[(i, bits + j)] = value;
            }
        }
        rows
    }

    /// The bending with these coefficients.
    pub(super) fn bending(&self, coefficients: [f64; BENDING_FIELDS]) -> Bending {
        Bending {
            coefficients,
            centre: self.centre,
            diagonal: self.diagonal,
        }
    }

    /// The similarity with parameters θ of that frame.
    pub(super) fn similarity(&self, [scale, a, b, c, x, y, z]: [f64; SIMILARITY_FIELDS]) -> Similarity {
        let turn = Similarity {
            scale: 1.0 + scale,
            translation: [x, y, z],
            ..Similarity::from_quaternion([1.0, a / 2.0, b / 2.0, c / 2.0])
        };
        self.to_unit.then(&turn).then(&self.to_unit.inverse())
    }
}
