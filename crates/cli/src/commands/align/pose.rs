//! A suspect in the original's pose.

use std::path::Path;

use anyhow::{Context, Result};
use job::Job;
use mesh::TriMesh;
use mesh_io::Asset;
use registration::{
    Aligner, Alignment, MatchedBy, Placement, PreparedMesh, UnposedSuspect, unpose_bent, unpose_placed,
};

use crate::claims;

/// A suspect of which more of the surface lies on the original as it is was not bent.
const NOT_BENT: f64 = 0.99;

/// A suspect that was brought back into the original's pose.
pub(super) struct Brought {
    /// Its vertices, in the original's frame.
    pub(super) positions: Vec<[f64; 3]>,
    /// How the pose was undone.
    pub(super) by: MatchedBy,
    /// How many vertices were laid between their neighbours, since the pose could not be undone for them.
    pub(super) between: usize,
}

/// The suspect before it was posed, and how it lies on the original then: by the joints and morph targets of the original's file, and else, by its surface, whatever posed it. None where no pose explains it.
pub(super) fn undone(
    aligner: &Aligner,
    (original, path): (&Asset, &Path),
    suspect: &TriMesh,
    job: &Job,
) -> Result<Option<(Brought, Alignment)>> {
    let placement = aligner.find(suspect, job)?;
    let [reference, prepared] = [original.mesh(), suspect].map(|mesh| PreparedMesh::from(mesh.clone()));
    let laid = |brought: Brought| -> Result<(Brought, Alignment)> {
        let back = suspect.with_positions(brought.positions.clone());
        let back = back.with_context(|| format!("{}: its pose can't be undone", path.display()))?;
        let alignment = aligner.align(back, job)?;
        Ok((brought, alignment))
    };
    let by_rig = match claims::rig_of(original, path) {
        Some(rig) => unpose_placed(&reference, &rig, &prepared, &placement, job)?,
        None => None,
    };
    let by_rig = by_rig.map(|found| laid(of_rig(found, suspect))).transpose()?;
    if by_rig.as_ref().is_some_and(|(_, alignment)| alignment.aligned) {
        return Ok(by_rig);
    }
    let alignment = match placement {
        Placement::BySurface(alignment) => alignment,
        Placement::ByVertices(_) => aligner.align(suspect.clone(), job)?,
    };
    if alignment.overlap > NOT_BENT {
        return Ok(by_rig);
    }
    let bent = unpose_bent(&reference, &prepared, &alignment, job)?.map(|found| Brought {
        positions: found.positions,
        by: MatchedBy::BentSurface,
        between: 0,
    });
    Ok(bent.map(laid).transpose()?.or(by_rig))
}

fn of_rig(found: UnposedSuspect, suspect: &TriMesh) -> Brought {
    match found {
        UnposedSuspect::ByVertices(found) => {
            let (positions, between) = found.completed(suspect);
            Brought {
                positions,
                by: MatchedBy::Rig,
                between,
            }
        }
        UnposedSuspect::BySurface(found) => Brought {
            positions: found.positions,
            by: MatchedBy::RigSurface,
            between: 0,
        },
    }
}
