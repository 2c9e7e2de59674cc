//! Decimation of triangle meshes by quadric error metrics.
//!
//! Edges are collapsed to a point, one after the other. What a collapse costs is told by a [`Quadric`],
//!
//! Q(x) = Σ wᵢ (nᵢ·x − dᵢ)² = xᵀ A x − 2 b·x + c,
//!
//! the weighted squared distances of x from the planes of all triangles that went into it. Where Q is least, the two ends meet. Two programs'
//! ways to do this are here, each with that program's defaults, so that what these do to a mesh can be foretold: [`Decimator::Queue`]
//! and [`Decimator::Threshold`].
//!
//! ```
//! use decimation::{Decimator, decimate};
//!
//! let ball = mesh::shapes::icosphere(4);
//! let coarse = decimate(&ball, 512, Decimator::Queue, &job::Job::default())?;
//! assert_eq!((ball.triangle_count(), coarse.triangle_count()), (5120, 512));
//! assert!((coarse.signed_volume() / ball.signed_volume() - 1.0).abs() < 0.02);
//! # Ok::<(), job::JobError>(())
//! ```
//!
//! **Conventions.** Positions are in the model's unit, and in the model's unit both programs set bounds: a mesh and the same mesh a thousand times larger are
//! decimated differently. Vertices and triangles that are left keep their order; nothing is random. Borders stay about where they are, holes may close,
//! and edges may get more than two triangles, as in the programs.
//!
//! **Cost.** O(#F log #F) for the queue and O(#F) a round of thresholds, on one thread; `decimate` of many meshes is what runs side by side.
//!
//! # Source
//! Garland and Heckbert, *Surface simplification using quadric error metrics*, SIGGRAPH 1997.

mod collapsing;
mod quadric;
mod queue;
mod threshold;

pub use quadric::Quadric;
pub use threshold::Connectivity;

use job::{Job, JobError};
use mesh::TriMesh;

/// Which edges are collapsed, in which order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Decimator {
    /// The cheapest edge first, as MeshLab's quadric edge collapse does it: planes weigh as their triangles' areas, borders are held
    /// by planes across them, and a collapse that makes thin triangles counts as dearer.
    Queue,
    /// All edges below a threshold in the order of the triangles, then below a higher one, as in Forstmann's fast quadric mesh simplification, which
    /// fast-simplification wraps: planes weigh alike, borders are collapsed along themselves, and no triangle turns by much.
    Threshold,
}

impl Decimator {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Queue, Self::Threshold];
}

/// A mesh with at most `target` triangles, or as few as the decimator comes to; at least one. Unused vertices are left out.
///
/// # Errors
/// [`JobError::Cancelled`].
pub fn decimate(mesh: &TriMesh, target: usize, decimator: Decimator, job: &Job) -> Result<TriMesh, JobError> {
    match decimator {
        Decimator::Queue => queue::decimate(mesh, target, job),
        Decimator::Threshold => threshold::decimate(mesh, target, job),
    }
}

/// The triangles that [`Decimator::Threshold`] leaves of a mesh, ascending: no more than so many, if collapses of edges get there.
///
/// # Panics
/// Where the connectivity is that of another number of vertices or triangles.
///
/// # Errors
/// [`JobError::Cancelled`].
pub fn survivors(
    mesh: &TriMesh,
    connectivity: &Connectivity,
    target: usize,
    job: &Job,
) -> Result<Vec<u32>, JobError> {
    threshold::survivors(mesh, connectivity, target, job)
}

/// What [`Decimator::Threshold`] does where it is known of some vertices what became of them: the label that each vertex comes to (#V), if vertices of different labels never meet, and some have one from the
/// start (#V). None where no collapse leads to one.
///
/// # Panics
/// Where the connectivity is that of another number of vertices or triangles.
///
/// # Errors
/// [`JobError::Cancelled`].
pub fn labels(
    mesh: &TriMesh,
    connectivity: &Connectivity,
    known: &[Option<u32>],
    job: &Job,
) -> Result<Vec<Option<u32>>, JobError> {
    threshold::labels(mesh, connectivity, known, job)
}
