//! The design matrix: a row an observation, a column an unknown.

use std::sync::Arc;

use faer::Mat;
use mesh::{Similarity, Vec3};
use registration::{LeftOfScalar, LocalFrames};

use super::{
    Bending, JointModel,
    equations::BLOCK,
    fields::{
        BENDING_FIELDS, FIELDS, OriginalSurface, RIGID_FIELDS, SIMILARITY_FIELDS, SURFACE_FIELDS,
        bending_fields, similarity_fields,
    },
    gains::BANDS,
    observations::{Observation, observations, of_balances},
};
use crate::mark::{
    Balances, BalancesOfPatch, Chip, MarkLayout, Original, Patch, PatchBasis, PatchRotation, Registered,
    Settling, SettlingOfPatch,
};

/// Rows whose fields are computed at a time: columns lie far apart in memory, and this many entries of one side by side.
const FEW: usize = 8;

/// What the rows of all patches have in common.
pub(super) struct Design<'a> {
    surface: &'a OriginalSurface,
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
    /// What its vertices say of planes; then nothing else is seen.
    balances: Option<&'a Balances>,
    redundancy: f64,
}

/// The patch of some observations, and where its chips are. Its unknowns come first, then the fields: where chips are [spread](crate::mark::Rotation) over harmonics the part of the mark
/// in each coefficient, else the bits.
pub(super) struct View<'a> {
    /// α φ, in diagonals where the harmonic is 1.
    amplitude: [f64; 3],
    chips: &'a [Chip],
    /// The bit of each unknown, or, where chips are spread, of the chip in its place.
    bits: Vec<usize>,
    /// The unknown that each chip's place belongs to.
    columns: Vec<usize>,
    rotation: Option<PatchRotation>,
    pub(super) patch: &'a Patch,
    pub(super) basis: &'a PatchBasis,
    /// The fields of the original's surface, of each vertex of the patch.
    surface: Vec<[Vec3; SURFACE_FIELDS]>,
    sight: Sight<'a>,
    /// What is seen of each harmonic, by their numbers from 0.
    seen: Vec<Seen<'a>>,
}

/// How functions that displace a patch along axes are seen.
enum Sight<'a> {
    /// As they are.
    All,
    /// What local frames leave of them.
    InFrames(&'a LocalFrames),
    /// What they do to the vertices of a decimated suspect.
    Settled(Arc<SettlingOfPatch>),
    /// The pulls of the original's planes at those, had they been there before the decimation.
    Balanced(Arc<BalancesOfPatch>),
}

/// What is seen of one of them.
enum Seen<'f> {
    All(&'f [f64]),
    InFrames(LeftOfScalar),
    /// How far it moves the suspect's vertices.
    Settled(&'f [f64], Arc<SettlingOfPatch>, Vec<[Vec3; 3]>),
    /// The pulls of planes at them.
    Balanced(Vec<[Vec3; 3]>),
}

impl Sight<'_> {
    fn of<'f>(&self, function: &'f [f64]) -> Seen<'f> {
        match self {
            Self::All => Seen::All(function),
            Self::InFrames(frames) => Seen::InFrames(frames.left_of_scalar(function)),
            Self::Settled(settling) => {
                Seen::Settled(function, Arc::clone(settling), settling.moved_by(function))
            }
            Self::Balanced(balances) => Seen::Balanced(balances.moved_by(function)),
        }
    }
}

impl Seen<'_> {
    /// Adds to an entry for each observation what that tells of the function, so many times as large, along an axis.
    fn add(&self, axis: usize, times: f64, block: &Block<'_>, to: &mut [f64]) {
        let along = |values: &[f64], to: &mut [f64]| {
            for ((entry, &v), along) in to.iter_mut().zip(&block.vertices).zip(&block.along[axis]) {
                *entry += times * along * values[v];
            }
        };
        let entries = to.iter_mut().zip(block.observations);
        match self {
            Self::All(values) => along(values, to),
            Self::InFrames(LeftOfScalar::Alike(left)) => along(left, to),
            Self::InFrames(LeftOfScalar::Along(left)) => {
                entries.for_each(|(entry, o)| *entry += times * left[o.vertex][axis]);
            }
            Self::InFrames(LeftOfScalar::OfAxes(left)) => {
                entries.for_each(|(entry, o)| *entry += times * o.along.dot(left[axis][o.vertex]));
            }
            Self::Settled(values, settling, moved) => entries.for_each(|(entry, o)| {
                let seen = settling.seen_along(moved, o.vertex, axis, o.along);
                *entry += times * seen.unwrap_or_else(|| o.along[axis] * values[o.vertex]);
            }),
            Self::Balanced(moved) => {
                entries.for_each(|(entry, o)| *entry += times * o.along.dot(moved[o.vertex][axis]));
            }
        }
    }
}

/// Observations whose rows are made at a time, and what all columns need of them.
struct Block<'o> {
    observations: &'o [Observation],
    vertices: Vec<usize>,
    /// u, by components.
    along: [Vec<f64>; 3],
}

impl<'o> Block<'o> {
    fn of(observations: &'o [Observation]) -> Self {
        Self {
            observations,
            vertices: observations.iter().map(|o| o.vertex).collect(),
            along: std::array::from_fn(|axis| observations.iter().map(|o| o.along[axis]).collect()),
        }
    }
}

impl<'a> View<'a> {
    pub(super) fn new(
        design: &Design<'a>,
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
        let sight = match (design.frames_of(index), design.balances, design.settling) {
            (Some(frames), ..) => Sight::InFrames(frames),
            (None, Some(balances), _) => Sight::Balanced(balances.of_patch(patch).into()),
            (None, None, Some(settling)) => Sight::Settled(settling.of_patch(patch).into()),
            (None, None, None) => Sight::All,
        };
        let surface = design.surface.fields(patch.vertices());
        let surface = match &sight {
            Sight::Balanced(balances) => balances.moved_by_fields(&surface),
            _ => surface,
        };
        let harmonics = (0..count).map(|k| basis.spectrum().eigenfunction(k));
        let scale = basis.area().sqrt() / design.diagonal;
        Self {
            amplitude: layout.amplitude(index).map(|amplitude| scale * amplitude),
            chips,
            bits,
            columns,
            rotation,
            surface,
            patch,
            basis,
            seen: harmonics.map(|harmonic| sight.of(harmonic)).collect(),
            sight,
        }
    }

    /// Where an observation along a vector is made, and along which one it sees what is the same all around.
    fn seen_from(&self, vertex: usize, along: Vec3) -> (Vec3, Vec3) {
        let equations = match &self.sight {
            Sight::Balanced(balances) => balances.equations()[vertex],
            _ => None,
        };
        match equations {
            Some(equations) => (equations.point, equations.of_shift(along)),
            None => (self.patch.mesh().point(vertex), along),
        }
    }

    /// How far the unknowns, if they are these, displace each vertex of the patch along each axis, in diagonals.
    fn displaced(&self, unknowns: &[f64]) -> [Vec<f64>; 3] {
        let mut coefficients = vec![[0.0; 3]; self.seen.len()];
        for (chip, &column) in self.chips.iter().zip(&self.columns) {
            coefficients[chip.frequency][chip.axis] += self.amplitude[chip.axis] * unknowns[column];
        }
        // A loop would round more, and rounding is all that is left of a suspect without noise.
        let displaced = self.basis.spectrum().inverse_transform_positions(&coefficients);
        std::array::from_fn(|axis| displaced.iter().map(|d| d[axis]).collect())
    }

    /// All observations of the patch.
    pub(super) fn observations(&self, design: &Design<'_>, suspect: &Registered) -> Vec<Observation> {
        match &self.sight {
            Sight::Balanced(balances) => of_balances(balances, design.diagonal),
            _ => observations(self.patch, self.basis, suspect, design.diagonal),
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
        surface: &'a OriginalSurface,
        model: JointModel,
        suspect: &'a Registered,
        frames: Option<&'a [Option<LocalFrames>]>,
        balances: Option<&'a Balances>,
    ) -> Self {
        let bounds = original.mesh().bounding_box();
        let balances = balances.filter(|_| model.has_optional());
        Self {
            surface,
            centre: Vec3(bounds.centre()),
            diagonal: bounds.diagonal(),
            to_unit: bounds.to_unit_frame(),
            model,
            frames,
            settling: suspect.settling.as_deref(),
            balances,
            redundancy: if balances.is_some() {
                1.0
            } else {
                suspect.redundancy()
            },
        }
    }

    /// Observations to an independent one.
    pub(super) fn redundancy(&self) -> f64 {
        self.redundancy
    }

    pub(super) fn frames_of(&self, patch: usize) -> Option<&'a LocalFrames> {
        self.frames?.get(patch)?.as_ref()
    }

    /// X, G and u·d, one row an observation, without weights.
    pub(super) fn rows(&self, view: &View<'_>, observations: &[Observation]) -> Mat<f64> {
        let bits = view.bits.len();
        let mut rows = Mat::<f64>::zeros(observations.len(), view.columns());
        let block = Block::of(observations);
        for (chip, &column) in view.chips.iter().zip(&view.columns) {
            let (axis, column) = (chip.axis, rows.col_as_slice_mut(column));
            view.seen[chip.frequency].add(axis, view.amplitude[axis], &block, column);
        }
        for (i, few) in observations.chunks(FEW).enumerate() {
            let fields: Vec<[f64; FIELDS]> = few.iter().map(|o| self.fields(view, o)).collect();
            for j in 0..FIELDS {
                let column = rows.col_as_slice_mut(bits + j)[i * FEW..].iter_mut();
                column.zip(&fields).for_each(|(entry, fields)| *entry = fields[j]);
            }
        }
        let displacements = rows.col_as_slice_mut(bits + FIELDS).iter_mut().zip(observations);
        displacements.for_each(|(entry, o)| *entry = o.displacement);
        rows
    }

    /// G of an observation.
    fn fields(&self, view: &View<'_>, observation: &Observation) -> [f64; FIELDS] {
        let Observation { vertex, along, .. } = *observation;
        let (point, of_shift) = view.seen_from(vertex, along);
        let place = (point - self.centre) / self.diagonal;
        let [normal, smoothing @ ..] = view.surface[vertex];
        let interference = similarity_fields(place, of_shift).into_iter();
        let interference = interference.chain(smoothing.map(|field| along.dot(field)));
        // A column of zeros is no unknown.
        let has_interference = self.model.has_interference() && self.frames.is_none();
        let interference = interference.map(|value| if has_interference { value } else { 0.0 });
        let fields = interference.chain(observation.tessellation_bias);
        let fields = fields.chain([along.dot(normal)]);
        let mut fields = fields.chain(bending_fields(place, of_shift));
        std::array::from_fn(|_| fields.next().unwrap_or(0.0))
    }

    /// What values of the unknowns of a patch leave of each observation, u·d − X b − G θ. [`rows`](Self::rows) would say the same; here harmonics are summed first, so that each observation costs as little as its fields.
    pub(super) fn residuals(
        &self,
        view: &View<'_>,
        observations: &[Observation],
        solution: &Mat<f64>,
    ) -> Vec<f64> {
        let (own, theta) = solution.col_as_slice(0).split_at(view.bits.len());
        let without_fields = |o: &Observation| {
            let fields = self.fields(view, o).into_iter().zip(theta);
            o.displacement - fields.map(|(field, theta)| field * theta).sum::<f64>()
        };
        let mut residuals: Vec<f64> = observations.iter().map(without_fields).collect();
        let displaced = view.displaced(own);
        let seen = displaced.each_ref().map(|function| view.sight.of(function));
        for (observations, residuals) in observations.chunks(BLOCK).zip(residuals.chunks_mut(BLOCK)) {
            let block = Block::of(observations);
            for (axis, seen) in seen.iter().enumerate() {
                seen.add(axis, -1.0, &block, residuals);
            }
        }
        residuals
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

#[cfg(test)]
mod tests {
    use decimation::{Decimator, decimate};
    use job::Job;
    use mesh::{TriMesh, shapes};
    use registration::{Degree, FrameOptions};

    use super::*;
    use crate::mark::{ChipLayout, ChipPlan, Reader, Strength};

    /// Residuals of values of the unknowns without rule, and the same as rows leave them, in all patches, with the largest of them.
    fn off(
        layout: &MarkLayout,
        suspect: &Registered,
        frames: Option<FrameOptions>,
        balances: Option<&Balances>,
    ) -> [f64; 2] {
        let (original, job) = (layout.original(), Job::default());
        let of_patch = |index: usize| {
            let patch = &original.patches()[index];
            let seen = patch.gather(&suspect.positions);
            frames.map(|options| LocalFrames::fit(patch.mesh(), &seen, &options))
        };
        let frames: Vec<Option<LocalFrames>> = (0..original.patches().len()).map(of_patch).collect();
        let frames = frames[0].is_some().then_some(frames.as_slice());
        let surface = OriginalSurface::of(original.mesh());
        let design = Design::new(
            original,
            &surface,
            JointModel::default(),
            suspect,
            frames,
            balances,
        );
        let of_patch = |index: usize, patch: &Patch, basis: &PatchBasis| {
            let view = View::new(&design, layout, index, patch, basis);
            let seen = view.observations(&design, suspect);
            let unknowns = view.columns() - 1;
            let solution = Mat::from_fn(unknowns, 1, |i, _| (1.0 + 7.0 * i as f64).sin());
            let rows = design.rows(&view, &seen);
            let fitted = rows.get(.., ..unknowns) * &solution;
            let residuals = design.residuals(&view, &seen, &solution).into_iter().enumerate();
            residuals.fold([0.0_f64; 2], |[off, most], (i, residual)| {
                let left = rows[(i, unknowns)] - fitted[(i, 0)];
                [off.max((residual - left).abs()), most.max(left.abs())]
            })
        };
        let all = layout.map_seen(&suspect.positions, of_patch, &job).unwrap();
        all.into_iter()
            .fold([0.0; 2], |[a, b], [off, most]| [a.max(off), b.max(most)])
    }

    #[test]
    fn residuals_are_what_rows_leave_however_functions_are_seen() {
        let (mesh, job) = (shapes::bumpy_sphere(4, 3), Job::default());
        let coarse = decimate(&mesh, 600, Decimator::Threshold, &job).unwrap();
        let sampled = |suspect: &TriMesh| {
            let suspect = Reader::new(&mesh).unwrap().surface(suspect);
            suspect.sample(&Similarity::IDENTITY, &job).unwrap()
        };
        let decimated = sampled(&coarse);
        assert!(decimated.settling.is_some());
        let nearest = |places: &[usize]| {
            let region = |v: usize| {
                let apart = |w: &usize| (coarse.point(*w) - mesh.point(v)).squared();
                let mut order: Vec<usize> = (0..coarse.vertex_count()).collect();
                order.sort_by(|a, b| apart(a).total_cmp(&apart(b)));
                Some(order[places[v % places.len()]] as u32)
            };
            (0..mesh.vertex_count()).map(region).collect::<Vec<_>>()
        };
        let draws = [nearest(&[0]), nearest(&[0, 0, 1, 0, 2])];
        let balances = Balances::of(&mesh, &coarse, &draws, 1e-3, &job).unwrap();
        let found_again = Registered::by_vertices(mesh.positions().iter().copied().map(Some).collect());
        let options = FrameOptions {
            reach: 0.35,
            noise: 2e-3,
            degree: Degree::Quadratic,
        };
        let bits = 64;
        let pooled = Original::pooled(mesh.clone(), bits, Default::default(), &job).unwrap();
        let pooled = (pooled, ChipPlan::pooled(bits, [1; 32]));
        let chips = ChipLayout::new(bits, 3).unwrap();
        let repeated = Original::cut(mesh.clone(), chips.functions(), Default::default(), &job).unwrap();
        let repeated = (repeated, ChipPlan::EveryPatch(chips));
        for (original, plan) in [pooled, repeated] {
            let layout = MarkLayout::with_strength(original.into(), plan, Strength::default()).unwrap();
            for (suspect, frames, balances) in [
                (&decimated, None, None),
                (&decimated, None, Some(&balances)),
                (&found_again, None, None),
                (&found_again, Some(options), None),
            ] {
                let [off, most] = off(&layout, suspect, frames, balances);
                assert!(most > 0.1 && off < 1e-12 * most, "{off} of {most}");
            }
        }
    }
}
