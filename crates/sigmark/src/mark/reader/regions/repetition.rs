//! Regions by decimation that is done again.

use std::borrow::Cow;

use decimation::Connectivity;
use job::Job;
use mesh::TriMesh;

use super::{
    Overlay, Place, Regions,
    candidates::Candidates,
    survivors::{Survivor, survivors},
};
use crate::mark::MarkError;

/// What a survivor is certain by whose corners are known.
const SURE: f64 = 0.9;

/// What a pair of triangles is worth more for each corner that is in the right region.
const WORTH_OF_A_CORNER: f32 = 2.0;

/// How often survivors and regions are told from each other.
const TURNS: usize = 2;

/// Regions by what becomes of the original, or of what has its connectivity; none where nothing was seen as a whole. Survivors are those that candidates tell alone.
pub(super) fn repeated(
    overlay: Overlay<'_>,
    decimated: &TriMesh,
    candidates: &Candidates,
    survivors: &[Option<Survivor>],
    job: &Job,
) -> Result<Option<Regions>, MarkError> {
    let Some(part) = Part::seen(decimated, overlay.places) else {
        return Ok(None);
    };
    let mut survivors = Cow::Borrowed(survivors);
    for _ in 0..TURNS {
        let regions = part.decimated(&known(overlay, &survivors, SURE), job)?;
        let mut candidates = candidates.clone();
        candidates.prefer(overlay, &[regions], |_, _| true, WORTH_OF_A_CORNER);
        survivors = self::survivors(overlay, &candidates, true, job)?.into();
    }
    part.decimated(&known(overlay, &survivors, 0.0), job).map(Some)
}

/// For each vertex of the original, the region that is known of it (#V): of corners of survivors that are certain by so much, by the most certain one.
pub(super) fn known(overlay: Overlay<'_>, survivors: &[Option<Survivor>], least: f64) -> Regions {
    let mut known: Vec<Option<(f64, u32)>> = vec![None; overlay.places.len()];
    let corners = overlay.corners(survivors);
    for (Survivor { certainty, .. }, v, region) in corners.filter(|(of, _, _)| of.certainty >= least) {
        let known = &mut known[v as usize];
        if known.is_none_or(|(before, _)| before < certainty) {
            *known = Some((certainty, region));
        }
    }
    known.into_iter().map(|known| Some(known?.1)).collect()
}

/// The triangles of a mesh with three corners that are asked for.
pub(super) struct Part {
    mesh: TriMesh,
    connectivity: Connectivity,
    /// The whole's number of each triangle, ascending.
    triangles: Vec<u32>,
    /// The whole's number of each vertex, ascending.
    vertices: Vec<u32>,
    /// How many the whole has.
    whole: usize,
}

impl Part {
    /// None where there is no such triangle.
    pub(super) fn seen(whole: &TriMesh, places: &[Option<Place>]) -> Option<Self> {
        let is_asked = |corners: &&[u32; 3]| corners.iter().all(|&v| places[v as usize].is_some());
        let numbers = (0..).zip(whole.triangles());
        let (numbers, mut triangles): (Vec<u32>, Vec<[u32; 3]>) =
            numbers.filter(|(_, corners)| is_asked(corners)).unzip();
        let mut vertices: Vec<u32> = triangles.as_flattened().to_vec();
        vertices.sort_unstable();
        vertices.dedup();
        for corner in triangles.as_flattened_mut() {
            *corner = vertices.partition_point(|v| v < corner) as u32;
        }
        let positions = vertices.iter().map(|&v| whole.positions()[v as usize]);
        let mesh = TriMesh::new(positions.collect(), triangles).ok()?;
        Some(Self {
            connectivity: Connectivity::of(&mesh),
            mesh,
            triangles: numbers,
            vertices,
            whole: whole.vertex_count(),
        })
    }

    /// How many triangles it has.
    pub(super) fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// The same part of what has the whole's connectivity.
    fn of(&self, whole: &TriMesh) -> Result<TriMesh, MarkError> {
        let positions = self.vertices.iter().map(|&v| whole.positions()[v as usize]);
        Ok(self.mesh.with_positions(positions.collect())?)
    }

    /// Those of the whole's triangles that are left when the same part of what has the whole's connectivity is decimated to so many.
    pub(super) fn survivors(&self, whole: &TriMesh, target: usize, job: &Job) -> Result<Vec<u32>, MarkError> {
        let left = decimation::survivors(&self.of(whole)?, &self.connectivity, target, job)?;
        Ok(left.into_iter().map(|t| self.triangles[t as usize]).collect())
    }

    /// As [`decimated`](Self::decimated), the same part of what has the whole's connectivity.
    pub(super) fn decimated_as(
        &self,
        whole: &TriMesh,
        known: &[Option<u32>],
        job: &Job,
    ) -> Result<Regions, MarkError> {
        self.labelled(&self.of(whole)?, known, job)
    }

    /// Into which regions the whole's vertices go that are in the part, given those that are known.
    fn decimated(&self, known: &[Option<u32>], job: &Job) -> Result<Regions, MarkError> {
        self.labelled(&self.mesh, known, job)
    }

    fn labelled(&self, mesh: &TriMesh, known: &[Option<u32>], job: &Job) -> Result<Regions, MarkError> {
        let known: Vec<Option<u32>> = self.vertices.iter().map(|&v| known[v as usize]).collect();
        let told = decimation::labels(mesh, &self.connectivity, &known, job)?;
        let mut regions = vec![None; self.whole];
        for (&v, region) in self.vertices.iter().zip(told) {
            regions[v as usize] = region;
        }
        Ok(regions)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes;

    #[test]
    fn where_nothing_was_seen_there_is_nothing_to_decimate() {
        let mesh = shapes::bumpy_sphere(2, 1);
        let none: Vec<Option<Place>> = vec![None; mesh.vertex_count()];
        assert!(Part::seen(&mesh, &none).is_none());
    }
}
