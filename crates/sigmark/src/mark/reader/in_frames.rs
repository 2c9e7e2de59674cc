//! Reading a suspect that was bent, dragged or posed, whatever did it: at its vertices, each seen from its own surroundings.

use job::Job;
use mesh::{TriMesh, Vec3};
use registration::{Correspondence, FrameOptions, LocalFrames, PreparedMesh};

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

/// A place where lengths became so many times larger, or smaller, than they did in the median is another shape.
const BEARABLE_STRETCH: f64 = 2.0;

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
    let off = median(&mut off);
    let mark = layout.distortion_rms() * original.bounding_box().diagonal();
    off > MORE_THAN_A_MARK * mark && off > SMOOTHER_THAN_NOISE * median(&mut varying)
}

/// Of maps that nothing rigid tells apart, those read in frames stretch edges by no more than so many times what the best does.
const ALIKE: f64 = 2.0;

/// Edges that tell how far a map stretches.
const EDGES: usize = 4096;

/// The maps under which the original was stretched about as evenly as under the best, in their order: a pose hardly stretches, another way round a net that maps onto itself does,
/// unless the shape is as symmetric as the net. No bits are looked at.
pub(super) fn likeliest<'m>(
    original: &TriMesh,
    suspect: &TriMesh,
    maps: &'m [Correspondence],
) -> Vec<&'m Correspondence> {
    let step = original.triangle_count().div_ceil(EDGES).max(1);
    let unevenness = |map: &Correspondence| {
        let edges = original
            .triangles()
            .iter()
            .step_by(step)
            .filter_map(|&[a, b, _]| {
                let [p, q] = [a, b].map(|v| original.point(v as usize));
                let there = |v: u32| Some(suspect.point(map.suspect_of[v as usize]? as usize));
                let stretch = (there(a)? - there(b)?).norm() / (p - q).norm();
                Some(stretch.ln()).filter(|stretch| stretch.is_finite())
            });
        let mut stretches: Vec<f64> = edges.collect();
        let middle = median(&mut stretches);
        let mut off: Vec<f64> = stretches.iter().map(|stretch| (stretch - middle).abs()).collect();
        median(&mut off)
    };
    let unevenness: Vec<f64> = maps.iter().map(unevenness).collect();
    let least = unevenness.iter().copied().fold(f64::INFINITY, f64::min);
    let of_both = maps.iter().zip(unevenness);
    of_both
        .filter(|(_, unevenness)| *unevenness <= ALIKE * least)
        .map(|(map, _)| map)
        .collect()
}

/// 0 of nothing.
fn median(values: &mut [f64]) -> f64 {
    match values.len() {
        0 => 0.0,
        count => *values.select_nth_unstable_by(count / 2, f64::total_cmp).1,
    }
}

impl InFrames {
    /// A suspect under a map of its vertices.
    pub(super) fn of(
        layout: &MarkLayout,
        suspect: &PreparedMesh,
        map: &Correspondence,
        job: &Job,
    ) -> Result<Self, MarkError> {
        let original = layout.original();
        let seen = map.carry(suspect.mesh());
        let fit = |index: usize, patch: &Patch, _: &PatchBasis| {
            let functions = original.functions()[index].max(1) as f64;
            let wavelength = (std::f64::consts::PI * patch.mesh().area() / functions).sqrt();
            let options = FrameOptions {
                reach: REACH * wavelength,
                noise: layout.distortion_rms() * original.mesh().bounding_box().diagonal(),
            };
            (
                index,
                LocalFrames::fit(patch.mesh(), &patch.gather(&seen), &options),
            )
        };
        let mut frames: Vec<Option<LocalFrames>> = vec![None; original.patches().len()];
        for (index, fitted) in layout.map_seen(&seen, fit, job)? {
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
            registered: Registered::by_vertices(positions),
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

/// Whether each vertex was stretched bearably; none where too little was seen around it. Where space was folded it was not.
fn bearable(stretch: &[[f64; 2]]) -> Vec<Option<bool>> {
    let is_told = |[most, _]: &&[f64; 2]| *most > 0.0;
    let mut middle: Vec<f64> = stretch
        .iter()
        .filter(is_told)
        .map(|[most, least]| (most * least).sqrt())
        .collect();
    if middle.is_empty() {
        return vec![None; stretch.len()];
    }
    let scale = median(&mut middle);
    let is_bearable =
        |[most, least]: &[f64; 2]| *most <= BEARABLE_STRETCH * scale && least * BEARABLE_STRETCH >= scale;
    let of_one = |stretch: &[f64; 2]| Some(stretch).filter(is_told).map(is_bearable);
    stretch.iter().map(of_one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes;

    /// The vertices of a torus of `m` by `n`, so many steps on along each.
    fn shifted(m: u32, n: u32, by: [u32; 2]) -> Correspondence {
        let at = |i: u32, j: u32| Some((j + by[1]) % n * m + (i + by[0]) % m);
        let suspect_of = (0..m * n).map(|v| at(v % m, v / m)).collect();
        Correspondence { suspect_of }
    }

    fn twisted(mesh: &TriMesh) -> TriMesh {
        let place = |p: &[f64; 3]| {
            let (sin, cos) = (0.15 * p[0]).sin_cos();
            [p[0], cos * p[1] - sin * p[2], sin * p[1] + cos * p[2]]
        };
        mesh.with_positions(mesh.positions().iter().map(place).collect())
            .unwrap()
    }

    #[test]
    fn the_way_in_which_a_bent_shape_lies_is_told_by_its_edges_unless_it_is_symmetric() {
        let (m, n) = (40_u32, 20_u32);
        let lathe = shapes::torus(m, n, 1.0, 0.4);
        let bumpy = shapes::bumped(&lathe, 0.25, 3);
        let maps: Vec<Correspondence> = (0..8).map(|k| shifted(m, n, [5 * k, k])).collect();
        let triangles = |map: &Correspondence, mesh: &TriMesh| -> Vec<[u32; 3]> {
            let to = |v: u32| map.suspect_of[v as usize].unwrap();
            mesh.triangles().iter().map(|t| t.map(to)).collect()
        };
        let net: std::collections::BTreeSet<[u32; 3]> =
            bumpy.triangles().iter().map(|t| sorted(*t)).collect();
        for map in &maps {
            assert!(
                triangles(map, &bumpy)
                    .into_iter()
                    .all(|t| net.contains(&sorted(t)))
            );
        }
        let kept = likeliest(&bumpy, &twisted(&bumpy), &maps);
        assert!(kept == [&maps[0]], "{} of them", kept.len());
        let turns: Vec<Correspondence> = (0..8).map(|k| shifted(m, n, [5 * k, 0])).collect();
        assert_eq!(likeliest(&lathe, &twisted(&lathe), &turns).len(), 8);
    }

    fn sorted(mut triangle: [u32; 3]) -> [u32; 3] {
        triangle.sort_unstable();
        triangle
    }
}
