//! Reading a suspect that was bent, dragged or posed, whatever did it: at its vertices, each seen from its own surroundings.

use job::Job;
use mesh::{TriMesh, Vec3};
use registration::{Correspondence, FrameOptions, LocalFrames, PreparedMesh, bearable};

use super::{Reading, ReadingMethod};
use crate::mark::{MarkError, MarkLayout, Patch, PatchBasis, Registered};

/// A suspect in local frames, those of each patch by themselves.
pub(super) struct InFrames {
    /// By the numbers of patches; none where nothing of a patch was seen.
    frames: Vec<Option<LocalFrames>>,
    /// The suspect as the frames leave it: each vertex of the original, and what it has beside it there.
    registered: Registered,
    /// Whether each vertex was stretched by little enough to be the same shape in another pose, #V; none where too little was seen around it.
    bearable: Vec<Option<bool>>,
}

/// How far surroundings go, in wavelengths of a patch's highest harmonic: what varies over much more is taken for the pose.
const REACH: f64 = 1.0;

/// Of the maps that no similarity tells apart so many are tried: each takes as long as one.
const MOST_MAPS: usize = 8;

/// What is left by a similarity has to be so many times as large as a mark, or nothing was bent.
const MORE_THAN_A_MARK: f64 = 3.0;

/// And so many times as large as what it varies by from a vertex to its neighbours, or it is noise.
const SMOOTHER_THAN_NOISE: f64 = 4.0;

/// Whether a suspect lies beside its original, in the best pose, as if it was bent: by more than a mark, and nearly as its neighbours do. No bits are looked at.
pub(super) fn is_bent(layout: &MarkLayout, suspect: &PreparedMesh, map: &Correspondence) -> bool {
    let original = layout.original().mesh();
    let Ok(fit) = map.fit(original, suspect.mesh()) else {
        return false;
    };
    let beside: Vec<Option<Vec3>> = map
        .carry(suspect.mesh())
        .into_iter()
        .enumerate()
        .map(|(v, place)| Some(Vec3(fit.transform.apply(place?)) - original.point(v)))
        .collect();
    let (mut off, mut varying) = (Vec::new(), Vec::new());
    for &[a, b, c] in original.triangles() {
        if let [Some(a), Some(b), Some(c)] = [a, b, c].map(|v| beside[v as usize]) {
            off.push(a.norm());
            varying.push((a - (b + c) * 0.5).norm());
        }
    }
    if off.is_empty() {
        return false;
    }
    let middle = |mut values: Vec<f64>| {
        let middle = values.len() / 2;
        *values.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    let off = middle(off);
    let mark = layout.distortion_rms() * original.bounding_box().diagonal();
    off > MORE_THAN_A_MARK * mark && off > SMOOTHER_THAN_NOISE * middle(varying)
}

/// The maps that stretch edges least, but for one scale, the least first. What was posed keeps lengths nearly; where triangles repeat, as those of a sphere that somebody sculpted, another map than the right one lays them on others. No
/// bits are looked at.
pub(super) fn least_stretching(
    original: &TriMesh,
    suspect: &TriMesh,
    maps: &[Correspondence],
) -> Vec<Correspondence> {
    let mut order: Vec<(f64, &Correspondence)> = maps
        .iter()
        .map(|map| (stretching(original, suspect, map), map))
        .collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    order
        .into_iter()
        .take(MOST_MAPS)
        .map(|(_, map)| map.clone())
        .collect()
}

/// The mean of |ln (length there / length here)| less the median, over the edges of triangles; infinite where there is none.
fn stretching(original: &TriMesh, suspect: &TriMesh, map: &Correspondence) -> f64 {
    let quotient = |v: u32, w: u32| -> Option<f64> {
        let [there, other] = [v, w].map(|v| map.suspect_of[v as usize]);
        let there = (suspect.point(there? as usize) - suspect.point(other? as usize)).norm();
        let here = (original.point(v as usize) - original.point(w as usize)).norm();
        Some((there / here).ln()).filter(|quotient| quotient.is_finite())
    };
    let edges = original
        .triangles()
        .iter()
        .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
    let mut quotients: Vec<f64> = edges.filter_map(|(v, w)| quotient(v, w)).collect();
    if quotients.is_empty() {
        return f64::INFINITY;
    }
    let middle = quotients.len() / 2;
    let median = *quotients.select_nth_unstable_by(middle, f64::total_cmp).1;
    let sum: f64 = quotients.iter().map(|quotient| (quotient - median).abs()).sum();
    sum / quotients.len() as f64
}

impl InFrames {
    /// A suspect under a map of its vertices.
    pub(super) fn of(
        layout: &MarkLayout,
        suspect: &PreparedMesh,
        map: &Correspondence,
        job: &Job,
    ) -> Result<Self, MarkError> {
        Self::seen(layout, Registered::by_vertices(map.carry(suspect.mesh())), job)
    }

    /// A suspect whose surface was brought back.
    pub(super) fn seen(layout: &MarkLayout, registered: Registered, job: &Job) -> Result<Self, MarkError> {
        let original = layout.original();
        let seen = &registered.positions;
        let fit = |index: usize, patch: &Patch, _: &PatchBasis| {
            let functions = original.functions()[index].max(1) as f64;
            let wavelength = (std::f64::consts::PI * patch.mesh().area() / functions).sqrt();
            let options = FrameOptions {
                reach: REACH * wavelength,
                noise: layout.distortion_rms() * original.mesh().bounding_box().diagonal(),
            };
            let own = patch.gather(seen);
            let along = patch.gather(&registered.along);
            if along.iter().all(Option::is_none) {
                return (index, LocalFrames::fit(patch.mesh(), &own, &options));
            }
            let line = |v: usize| {
                let u = Vec3(along[v]?);
                Some((u, u.dot(Vec3(own[v]?) - patch.mesh().point(v))))
            };
            let lines: Vec<Option<(Vec3, f64)>> = (0..own.len()).map(line).collect();
            (index, LocalFrames::fit_along(patch.mesh(), &lines, &options))
        };
        let mut frames: Vec<Option<LocalFrames>> = vec![None; original.patches().len()];
        for (index, fitted) in layout.map_seen(seen, fit, job)? {
            frames[index] = Some(fitted);
        }
        let mut positions = vec![None; original.mesh().vertex_count()];
        let mut stretch = vec![[0.0; 2]; positions.len()];
        for (patch, frames) in original.patches().iter().zip(&frames) {
            let Some(frames) = frames else { continue };
            for ((&v, beside), &stretched) in
                patch.vertices().iter().zip(frames.beside()).zip(frames.stretch())
            {
                let place = |beside: Vec3| (original.mesh().point(v as usize) + beside).into();
                positions[v as usize] = beside.map(place);
                stretch[v as usize] = stretched;
            }
        }
        Ok(Self {
            frames,
            bearable: bearable(&stretch),
            registered: Registered {
                positions,
                ..registered
            },
        })
    }

    /// The bits by the joint estimate.
    pub(super) fn read(&self, method: &ReadingMethod, job: &Job) -> Result<Reading, MarkError> {
        let estimate = method
            .estimator()
            .estimate_in_frames(&self.registered, &self.frames, job)?;
        let reading = Reading::of(
            method.layout(),
            &self.registered,
            estimate.misalignment,
            &estimate,
        );
        Ok(reading.where_it_is_one_shape(&self.bearable))
    }
}
