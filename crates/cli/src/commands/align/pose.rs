//! A suspect in the original's pose.

use std::path::Path;

use anyhow::{Context, Result, bail};
use job::Job;
use mesh::TriMesh;
use mesh_io::Asset;
use registration::{Aligner, Alignment, MatchedBy, PreparedMesh, UnposedSuspect, unpose_placed};

use crate::claims;

/// A suspect that was brought back into the original's pose.
pub(super) struct Brought {
    /// Its vertices, in the original's frame.
    pub(super) positions: Vec<[f64; 3]>,
    /// How the pose was undone.
    pub(super) by: MatchedBy,
    /// How many vertices were laid between their neighbours, since the pose could not be undone for them.
    pub(super) between: usize,
}

/// The suspect before it was posed, and how it lies on the original then; none where no pose of the joints explains it.
pub(super) fn undone(
    aligner: &Aligner,
    (original, path): (&Asset, &Path),
    suspect: &TriMesh,
    job: &Job,
) -> Result<Option<(Brought, Alignment)>> {
    let Some(rig) = claims::rig_of(original, path) else {
        bail!(
            "{}: has no joints or morph targets by which a pose could be undone; give the glTF that has them",
            path.display()
        );
    };
    let placement = aligner.find(suspect, job)?;
    let [reference, prepared] = [original.mesh(), suspect].map(|mesh| PreparedMesh::from(mesh.clone()));
    let (positions, between, by) = match unpose_placed(&reference, &rig, &prepared, &placement, job)? {
        None => return Ok(None),
        Some(UnposedSuspect::ByVertices(found)) => {
            let (positions, between) = found.completed(suspect);
            (positions, between, MatchedBy::Rig)
        }
        Some(UnposedSuspect::BySurface(found)) => (found.positions, 0, MatchedBy::RigSurface),
    };
    let back = suspect.with_positions(positions.clone());
    let back = back.with_context(|| format!("{}: its pose can't be undone", path.display()))?;
    let alignment = aligner.align(back, job)?;
    Ok(Some((
        Brought {
            positions,
            by,
            between,
        },
        alignment,
    )))
}
