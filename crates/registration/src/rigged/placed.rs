//! The pose of a suspect that was found, whether it kept its vertices or not.

use job::Job;
use mesh::{Rig, Similarity};

use super::{Unposed, UnposedSurface, unpose_any, unpose_surface};
use crate::{Alignment, Placement, PreparedMesh, RegistrationError, match_cut};

/// A suspect that was brought back into the original's pose.
#[derive(Clone, Debug)]
pub enum UnposedSuspect {
    /// By its vertices.
    ByVertices(Unposed),
    /// By its surface.
    BySurface(UnposedSurface),
}

/// A suspect of which more of the surface lies on the original was not posed.
const NOT_POSED: f64 = 0.99;

/// Where joints leave more than this of the vertices that are left, in diagonals, these were not theirs.
const UNDONE: f64 = 1e-3;

/// From so many of the ways in which its surface may lie a pose is looked for.
const MOST_SEEDS: usize = 4;

/// Undoes the pose of a suspect that was [found](crate::Aligner::find): by its vertices where these were found again, or by those that are left where most of its own are, as after a cut, else by its surface. None where the rig says nothing of it, or its surface lies on the
/// original as it is.
///
/// # Errors
/// As [`unpose_surface`].
pub fn unpose_placed(
    original: &PreparedMesh,
    rig: &Rig,
    suspect: &PreparedMesh,
    placement: &Placement,
    job: &Job,
) -> Result<Option<UnposedSuspect>, RegistrationError> {
    match placement {
        Placement::ByVertices(maps) => {
            let found = unpose_any(original.mesh(), rig, suspect.mesh(), maps, job)?;
            Ok(found.map(UnposedSuspect::ByVertices))
        }
        Placement::BySurface(alignment) if alignment.overlap > NOT_POSED => Ok(None),
        Placement::BySurface(alignment) => unpose_changed(original, rig, suspect, alignment, job),
    }
}

/// Of a suspect that lost vertices, or got others.
fn unpose_changed(
    original: &PreparedMesh,
    rig: &Rig,
    suspect: &PreparedMesh,
    alignment: &Alignment,
    job: &Job,
) -> Result<Option<UnposedSuspect>, RegistrationError> {
    let (reference, mesh) = (original.mesh(), suspect.mesh());
    if let Some(left) = match_cut(reference, mesh, job)? {
        // What the rig does not say of vertices it does not say of the surface between them.
        let found = unpose_any(reference, rig, mesh, &[left], job)?;
        let found = found.filter(|found| found.residual < UNDONE);
        return Ok(found.map(UnposedSuspect::ByVertices));
    }
    let found = unpose_surface(original, rig, suspect, &seeds(alignment), job)?;
    Ok(found.map(UnposedSuspect::BySurface))
}

/// The ways in which a surface may lie from which a pose is looked for.
pub(super) fn seeds(alignment: &Alignment) -> Vec<Similarity> {
    let ways = std::iter::once(&alignment.transform).chain(&alignment.alternatives);
    ways.take(MOST_SEEDS).copied().collect()
}
