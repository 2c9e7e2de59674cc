use job::{Job, JobError};
use mesh::{Closed, TriMesh};

use super::{
    colours,
    correspondence::Correspondence,
    graph::{Connectivity, Graph},
    placement, surroundings,
};

/// A suspect of whose vertices no more than this share was found again was not cut alone.
const MOSTLY: f64 = 0.6;

/// Why a suspect does not have the original's connectivity.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Difference {
    /// Vertices were added or removed.
    #[error("connectivity differs: the original has {original} vertices in use, the suspect {suspect}")]
    VertexCount {
        /// Vertices that triangles of the original use.
        original: usize,
        /// Vertices that triangles of the suspect use.
        suspect: usize,
    },
    /// Triangles were added or removed.
    #[error("connectivity differs: the original has {original} triangles, the suspect {suspect}")]
    TriangleCount {
        /// #F of the original.
        original: usize,
        /// #F of the suspect.
        suspect: usize,
    },
    /// The counts agree, but vertices have other numbers of neighbours, or of neighbours of neighbours, and
    /// so on.
    #[error(
        "connectivity differs: {vertices} vertices of the original have surroundings that no suspect vertex has left for them"
    )]
    Surroundings {
        /// How many vertices of the original have no counterpart.
        vertices: usize,
    },
    /// The surroundings agree everywhere, but no map of the vertices takes triangles to triangles.
    #[error(
        "connectivity differs: {vertices} vertices of the original lie in parts that could not be mapped onto the suspect"
    )]
    Unmapped {
        /// How many vertices of the original have no counterpart.
        vertices: usize,
    },
    /// The search was cancelled.
    #[error(transparent)]
    Job(#[from] JobError),
}

/// Finds the map of vertices that takes the original's triangles to the suspect's.
///
/// Order of vertices, order of faces, rotation of corners and orientation of faces are immaterial, and so is
/// geometry (noise, smoothing, any transform), as long as the connectivity is unambiguous. A symmetric mesh
/// has several such maps, and so have equal pieces: then the map whose best similarity, mirrored or not,
/// leaves the smallest residual is chosen. The result is exact: it maps the triangles of the original one to
/// one onto those of the suspect, copies of a vertex along seams being one vertex, up to the rounding of single
/// precision.
///
/// # Errors
/// Says how the connectivities differ; [`Difference::Job`] when the job was cancelled.
///
/// ```
/// use mesh::{Closed, TriMesh};
/// let points = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 3.0, 0.0]];
/// let original = TriMesh::new(points.clone(), vec![[0, 1, 2], [0, 2, 3]])?;
/// let suspect = TriMesh::new(vec![points[3], points[2], points[1], points[0]], vec![[3, 1, 0], [3, 2, 1]])?;
/// let map = registration::match_connectivity(&original, &suspect, &Default::default())?;
/// assert_eq!(map.suspect_of, [Some(3), Some(2), Some(1), Some(0)]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn match_connectivity(
    original: &TriMesh,
    suspect: &TriMesh,
    job: &Job,
) -> Result<Correspondence, Difference> {
    Ok(match_candidates(original, suspect, 1, job)?.swap_remove(0))
}

/// As [`match_connectivity`], but all maps that geometry cannot tell apart, at most `limit`, the best first.
///
/// A map is kept when its residual is at most twice the best one. A regular icosphere has 120 of them, a scan
/// one.
///
/// # Errors
/// Says how the connectivities differ; [`Difference::Job`] when the job was cancelled.
pub fn match_candidates(
    original: &TriMesh,
    suspect: &TriMesh,
    limit: usize,
    job: &Job,
) -> Result<Vec<Correspondence>, Difference> {
    if limit <= 1
        && let Some(same_order) = identity(original, suspect)
    {
        return Ok(vec![same_order]);
    }
    let (from, onto) = job.join(|| Connectivity::of(original), || Connectivity::of(suspect))?;
    match survivors(from.graph(original), suspect, onto, limit, job)? {
        Survivors::All(maps) => Ok(maps),
        Survivors::Some(part) => Err(part.difference),
    }
}

/// Which of the original's vertices a suspect still has.
pub(crate) enum Survivors<'a> {
    /// All of them, by maps that geometry can't tell apart, the best first.
    All(Vec<Correspondence>),
    /// Not all.
    Some(Box<Remainder<'a>>),
}

/// A suspect onto which the original's vertices can't all be mapped.
pub(crate) struct Remainder<'a> {
    from: Graph<'a>,
    suspect: &'a TriMesh,
    /// Of the suspect, or of the suspect with its seams closed, if it has seams.
    onto: Connectivity,
    closed: Option<Closed>,
    /// Why they can't.
    difference: Difference,
}

impl Remainder<'_> {
    /// As [`match_surroundings`].
    pub(crate) fn correspondence(&self, job: &Job) -> Result<Correspondence, JobError> {
        let Some(closed) = &self.closed else {
            return surroundings::correspondence(&self.from, &self.onto.graph(self.suspect), job);
        };
        let map = surroundings::correspondence(&self.from, &self.onto.graph(closed.mesh()), job)?;
        Ok(map.opened(closed))
    }

    /// How many vertices the suspect has, copies along seams being one.
    fn vertices(&self) -> usize {
        let mesh = self.closed.as_ref().map_or(self.suspect, Closed::mesh);
        self.onto.graph(mesh).used_vertices
    }
}

/// Looks for maps of all vertices, at most `limit`. `onto` is the suspect's connectivity.
pub(crate) fn survivors<'a>(
    from: Graph<'a>,
    suspect: &'a TriMesh,
    onto: Connectivity,
    limit: usize,
    job: &Job,
) -> Result<Survivors<'a>, JobError> {
    let difference = match map_candidates(&from, &onto.graph(suspect), limit, job) {
        Ok(maps) => return Ok(Survivors::All(maps)),
        Err(Difference::Job(error)) => return Err(error),
        Err(difference) => difference,
    };
    let part = |onto, closed| {
        Ok(Survivors::Some(Box::new(Remainder {
            from,
            suspect,
            onto,
            closed,
            difference,
        })))
    };
    let Some(closed) = Closed::along_borders(suspect, &onto.edges) else {
        return part(onto, None);
    };
    let onto = Connectivity::of(closed.mesh());
    match map_candidates(&from, &onto.graph(closed.mesh()), limit, job) {
        Ok(maps) => Ok(Survivors::All(
            maps.into_iter().map(|map| map.opened(&closed)).collect(),
        )),
        Err(Difference::Job(error)) => Err(error),
        Err(_) => part(onto, Some(closed)),
    }
}

/// As [`match_candidates`], of vertices as they are.
fn map_candidates(
    from: &Graph<'_>,
    onto: &Graph<'_>,
    limit: usize,
    job: &Job,
) -> Result<Vec<Correspondence>, Difference> {
    compare_counts(from, onto)?;
    let colours = colours::refine(from, onto, job)?;
    match colours.unmatched() {
        0 => {}
        vertices => return Err(Difference::Surroundings { vertices }),
    }
    let mut maps = placement::candidates(from, onto, &colours, limit.max(1), job)?;
    let vertices = from.used_vertices - maps.first().map_or(0, Correspondence::matched);
    if vertices > 0 {
        return Err(Difference::Unmapped { vertices });
    }
    maps.retain(|map| map.matched() == from.used_vertices);
    Ok(maps)
}

/// As [`match_connectivity`], for a suspect that was cut or altered in places: maps the regions that are left
/// unaltered.
///
/// Vertices whose surroundings are unique in both meshes are paired, and pairs grow across shared edges.
/// Nothing proves the result: near altered places a pair may be wrong, and a re-meshed suspect gives few
/// pairs or none. Fit robustly, and look at the residuals.
///
/// # Errors
/// When the job was cancelled.
pub fn match_surroundings(
    original: &TriMesh,
    suspect: &TriMesh,
    job: &Job,
) -> Result<Correspondence, JobError> {
    let (here, there) = (Connectivity::of(original), Connectivity::of(suspect));
    surroundings::correspondence(&here.graph(original), &there.graph(suspect), job)
}

/// As [`match_surroundings`], of a suspect that was cut and little else, copies of a vertex along seams being one: none where not most of its own vertices, three in five, are found again.
///
/// # Errors
/// When the job was cancelled.
pub fn match_cut(
    original: &TriMesh,
    suspect: &TriMesh,
    job: &Job,
) -> Result<Option<Correspondence>, JobError> {
    let (from, onto) = job.join(|| Connectivity::of(original), || Connectivity::of(suspect))?;
    match survivors(from.graph(original), suspect, onto, 1, job)? {
        Survivors::All(maps) => Ok(maps.into_iter().next()),
        Survivors::Some(part) => {
            let left = part.correspondence(job)?;
            let is_cut = left.matched() as f64 > MOSTLY * part.vertices() as f64;
            Ok(is_cut.then_some(left))
        }
    }
}

/// The map of each vertex to itself, if that is right.
fn identity(original: &TriMesh, suspect: &TriMesh) -> Option<Correspondence> {
    let same =
        original.vertex_count() == suspect.vertex_count() && original.triangles() == suspect.triangles();
    same.then(|| {
        let in_use = (0..).zip(original.used_vertices());
        Correspondence {
            suspect_of: in_use.map(|(v, used)| used.then_some(v)).collect(),
        }
    })
}

fn compare_counts(from: &Graph<'_>, onto: &Graph<'_>) -> Result<(), Difference> {
    let (original, suspect) = (from.used_vertices, onto.used_vertices);
    if original != suspect {
        return Err(Difference::VertexCount { original, suspect });
    }
    let (original, suspect) = (from.mesh.triangle_count(), onto.mesh.triangle_count());
    if original != suspect {
        return Err(Difference::TriangleCount { original, suspect });
    }
    Ok(())
}
