//! Regions by decimation that is done again.

use std::borrow::Cow;

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
        candidates.prefer(overlay, &regions);
        survivors = self::survivors(overlay, &candidates, true, job)?.into();
    }
    part.decimated(&known(overlay, &survivors, 0.0), job).map(Some)
}

/// For each vertex of the original, the region that is known of it (#V): of corners of survivors that are certain by so much, by the most certain one.
fn known(overlay: Overlay<'_>, survivors: &[Option<Survivor>], least: f64) -> Regions {
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
struct Part {
    mesh: TriMesh,
    /// The whole's number of each vertex, ascending.
    vertices: Vec<u32>,
    /// How many the whole has.
    of: usize,
}

impl Part {
    /// None where there is no such triangle.
    fn seen(whole: &TriMesh, places: &[Option<Place>]) -> Option<Self> {
        let is_asked = |corners: &&[u32; 3]| corners.iter().all(|&v| places[v as usize].is_some());
        let mut triangles: Vec<[u32; 3]> = whole.triangles().iter().filter(is_asked).copied().collect();
        let mut vertices: Vec<u32> = triangles.as_flattened().to_vec();
        vertices.sort_unstable();
        vertices.dedup();
        for corner in triangles.as_flattened_mut() {
            *corner = vertices.partition_point(|v| v < corner) as u32;
        }
        let positions = vertices.iter().map(|&v| whole.positions()[v as usize]);
        Some(Self {
            mesh: TriMesh::new(positions.collect(), triangles).ok()?,
            vertices,
            of: whole.vertex_count(),
        })
    }

    /// Into which regions the whole's vertices go that are in the part, given those that are known.
    fn decimated(&self, known: &[Option<u32>], job: &Job) -> Result<Regions, MarkError> {
        let known: Vec<Option<u32>> = self.vertices.iter().map(|&v| known[v as usize]).collect();
        let told = decimation::labels(&self.mesh, &known, job)?;
        let mut regions = vec![None; self.of];
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
