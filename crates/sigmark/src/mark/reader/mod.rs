//! From a suspect in unknown pose to soft bits: registration, sampling, refinement of the pose, detection.

mod by_vertices;
mod generalised;
mod in_frames;
mod looks;
mod method;
mod parts;
mod quadrics;
mod reading;
mod readings;
mod regions;
mod suspect;
mod tessellation;
mod wanted;

pub use method::ReadingMethod;
pub use parts::{FoundParts, ReadParts};
pub use reading::Reading;
pub use readings::Readings;
pub use suspect::Suspect;
pub use wanted::Wanted;

use std::fmt;

use job::Job;
use mesh::{Rig, Similarity, components, near_part, undivided};
use registration::{
    AlignOptions, Aligner, Alignment, Correspondence, MatchedBy, Placement, PreparedMesh, RegistrationStage,
    UnposedSurface, UnposedSuspect, match_cut, unpose_bent, unpose_placed,
};

use super::{MarkError, MarkLayout, MarkStage};
use suspect::SeenBy;

/// A suspect of whose surface more lies on the reference was bent nowhere, or in a small part.
const MOSTLY_THERE: f64 = 0.9;

/// Where one part has this share of a suspect's area, and so much of its vertices that no other is [large](mesh::LargeParts), the others are dust: shells in many layers have any area, and are to hide nothing beside them.
const ALL_BUT_DUST: f64 = 0.99;
const ALL_BUT_DUSTY_VERTICES: f64 = 0.9;

/// Brings suspects onto a reference and reads them there. What does not depend on the suspect is computed once, when it is first
/// needed, and kept.
///
/// ```
/// use std::sync::Arc;
/// use mesh::shapes;
/// use sigmark::mark::{ChipPlan, JointEstimator, MarkLayout, Original, Pool, Reader, ReadingMethod, Strength};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let (mesh, job) = (shapes::bumpy_sphere(4, 1), job::Job::default());
/// let original = Original::pooled(mesh, 24, Pool::default(), &job)?;
/// let plan = ChipPlan::pooled(24, [1; 32]);
/// let layout = Arc::new(MarkLayout::with_strength(Arc::new(original), plan, Strength::default())?);
/// let bits: Vec<bool> = (0..24).map(|t| t % 3 == 0).collect();
/// let marked = layout.original().mesh().with_positions(layout.write(&bits, &job)?.positions(layout.original()))?;
///
/// let reader = Reader::new(layout.original().mesh())?;
/// let method = ReadingMethod::joint(JointEstimator::new(&layout).into());
/// let found = reader.find(&shapes::scaled(&marked, 7.0), &job)?;
/// assert_eq!(found.read(&method, &bits, &job)?.soft.hard(), bits);
/// # Ok(())
/// # }
/// ```
pub struct Reader {
    aligner: Aligner,
}

impl Reader {
    /// A reader by a reference, which is the original for most marks. Nothing is computed yet.
    ///
    /// # Errors
    /// None that the options of this library can cause.
    pub fn new(reference: impl Into<PreparedMesh>) -> Result<Self, MarkError> {
        Ok(Self {
            aligner: Aligner::new(reference, &AlignOptions::default())?,
        })
    }

    /// The reference, with its search structures.
    pub fn reference(&self) -> &PreparedMesh {
        self.aligner.original()
    }

    /// Finds how a suspect lies on the reference: by its vertices where all are there, whatever its shape, else by its surface. Triangles that
    /// reach hundreds of times as far away as the rest are passed over; what was subdivided is taken back to what it was before.
    ///
    /// # Errors
    /// As [`Aligner::find`].
    pub fn find(&self, suspect: impl Into<PreparedMesh>, job: &Job) -> Result<Found, MarkError> {
        job.begin(MarkStage::Registration)?;
        let mut suspect = near(suspect.into());
        if let Some(gathered) = suspect.mesh().gathered() {
            suspect = gathered.into();
        }
        let job = job.within(RegistrationStage::Hypotheses);
        let mut placement = self.aligner.find(&suspect, &job)?;
        while matches!(placement, Placement::BySurface(_))
            && let Some(before) = before_subdivision(&suspect, self.reference())
        {
            let placed = self.aligner.find(&before, &job)?;
            // Of an original that was itself subdivided, parts have vertices that would be lost.
            if vertices_found(&placed) < vertices_found(&placement) {
                break;
            }
            (suspect, placement) = (before, placed);
        }
        Ok(Found {
            reference: self.reference().clone(),
            placement,
            suspect,
            brought_back: BroughtBack::AsItIs,
        })
    }

    /// As [`find`](Self::find), with the overlap of the surfaces measured even where all vertices are there, and vertices not
    /// trusted where the surfaces disagree.
    ///
    /// # Errors
    /// As [`Aligner::align`].
    pub fn align(&self, suspect: impl Into<PreparedMesh>, job: &Job) -> Result<Alignment, MarkError> {
        job.begin(MarkStage::Registration)?;
        let job = job.within(RegistrationStage::Hypotheses);
        Ok(self.aligner.align(suspect, &job)?)
    }

    /// A suspect that was aligned, to be looked at in any pose: at its vertices where those of the reference were found again,
    /// elsewhere at its surface.
    pub fn suspect(&self, mesh: impl Into<PreparedMesh>, alignment: &Alignment) -> Suspect {
        let survivors = alignment.correspondence.clone();
        let seen_by = match (alignment.matched_by, survivors) {
            (MatchedBy::Connectivity, Some(map)) => SeenBy::Vertices(map),
            (_, survivors) => SeenBy::Surface(survivors),
        };
        Suspect::new(self.reference().clone(), mesh.into(), seen_by)
    }

    /// A suspect of which only the surface is looked at, in any pose.
    pub fn surface(&self, mesh: impl Into<PreparedMesh>) -> Suspect {
        Suspect::new(self.reference().clone(), mesh.into(), SeenBy::Surface(None))
    }
}

impl fmt::Debug for Reader {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mesh = self.reference().mesh();
        f.debug_struct("Reader")
            .field("vertices", &mesh.vertex_count())
            .finish_non_exhaustive()
    }
}

/// A suspect without triangles that reach far away from all the rest.
fn near(suspect: PreparedMesh) -> PreparedMesh {
    match near_part(suspect.mesh()) {
        Some(near) => near.into(),
        None => suspect,
    }
}

/// How many vertices of the reference were found again.
fn vertices_found(placement: &Placement) -> usize {
    let map = match placement {
        Placement::ByVertices(maps) => maps.first(),
        Placement::BySurface(alignment) => alignment.correspondence.as_ref(),
    };
    map.map_or(0, Correspondence::matched)
}

/// How far a subdivided suspect's vertices may be from where the rule puts them, in mean edges of what was there before: what was smoothed or shaken a little since
/// is further from the rule than this only where there are details that subdivision does not make.
const SUBDIVIDED: f64 = 0.03;

/// The same where the reference was itself subdivided, and another rule's suspects of it can be cut into tiles, too: what nobody touched since, but for rounding in a file.
const SUBDIVIDED_ONLY: f64 = 1e-4;

/// The suspect before its triangles were split in four. A mark that was in it before has nothing to say through the vertices that were added: they follow from the others.
fn before_subdivision(suspect: &PreparedMesh, reference: &PreparedMesh) -> Option<PreparedMesh> {
    let found = undivided(suspect.mesh()).filter(|found| found.residual <= SUBDIVIDED)?;
    let is_sure = found.residual <= SUBDIVIDED_ONLY || undivided(reference.mesh()).is_none();
    is_sure.then(|| found.mesh.into())
}

/// A suspect that was brought onto a reference, in all the ways that it can lie there.
pub struct Found {
    reference: PreparedMesh,
    suspect: PreparedMesh,
    placement: Placement,
    brought_back: BroughtBack,
}

/// Where a suspect lies whose surface was brought back from a pose.
fn placed(found: &UnposedSurface, by: MatchedBy) -> Placement {
    Placement::BySurface(Alignment {
        transform: Similarity::IDENTITY,
        matched_by: by,
        overlap: found.overlap,
        coverage: found.coverage,
        residual: found.residual,
        aligned: found.overlap >= AlignOptions::default().least_overlap,
        correspondence: None,
        alternatives: Vec::new(),
        free_directions: 0,
    })
}

/// What was undone before a suspect is read.
#[derive(Clone, Copy, PartialEq, Eq)]
enum BroughtBack {
    /// Nothing.
    AsItIs,
    /// A pose by the rig of the reference: the suspect is here as it was before.
    ByRig,
    /// Whatever is smooth in the surroundings of each vertex: the suspect is here as it is, and read in local frames.
    InFrames,
}

impl Found {
    /// The suspect as it is read: its vertices are [gathered](mesh::TriMesh::gathered) if they were scattered, and those that a subdivision added are [taken away](mesh::undivided).
    pub fn suspect(&self) -> &PreparedMesh {
        &self.suspect
    }

    /// The alignment of the surfaces; none where the suspect was found by its vertices. It numbers the vertices of [`suspect`](Self::suspect).
    pub fn alignment(&self) -> Option<&Alignment> {
        match &self.placement {
            Placement::ByVertices(_) => None,
            Placement::BySurface(alignment) => Some(alignment),
        }
    }

    /// The suspect brought back from the pose in which the joints of the reference's rig had put it: by whichever map of its vertices they explain best, or where not all of these were found again, by those that are left or by its surface. No bits are looked at. None
    /// where the rig says nothing of it, or its surface lies on the reference as it is.
    ///
    /// # Errors
    /// [`MarkError::Job`]; as [`unpose_placed`].
    pub fn unposed(&self, rig: &Rig, job: &Job) -> Result<Option<Self>, MarkError> {
        let found = unpose_placed(&self.reference, rig, &self.suspect, &self.placement, job)?;
        let (positions, placement) = match found {
            None => return Ok(None),
            Some(UnposedSuspect::ByVertices(found)) => {
                (found.positions, Placement::ByVertices(vec![found.map]))
            }
            Some(UnposedSuspect::BySurface(found)) => {
                let placement = placed(&found, MatchedBy::RigSurface);
                (found.positions, placement)
            }
        };
        Ok(Some(Self {
            reference: self.reference.clone(),
            suspect: self.suspect.mesh().with_positions(positions)?.into(),
            placement,
            brought_back: BroughtBack::ByRig,
        }))
    }

    /// The same suspect, to be read in the frames of each vertex' own surroundings: whatever bent, dragged or posed it; under the maps of its vertices that stretch it least. None where its vertices were not found again, or lie as if nothing had: which looks at no bits.
    ///
    /// Of a suspect that was cut, those that are left are taken where its surface lies on the reference all the same; where it doesn't, [`unbent`](Self::unbent) takes them.
    ///
    /// # Errors
    /// [`MarkError::Job`].
    pub fn in_local_frames(&self, layout: &MarkLayout, job: &Job) -> Result<Option<Self>, MarkError> {
        let left;
        let maps = match &self.placement {
            Placement::ByVertices(maps) => maps,
            Placement::BySurface(alignment) => {
                let some = alignment.correspondence.as_ref();
                let is_bent = some.is_some_and(|some| in_frames::is_bent(layout, &self.suspect, some));
                if !is_bent || self.may_be_bent() {
                    return Ok(None);
                }
                // Those that were found again are without what lies far off in any one pose.
                left = match_cut(self.reference.mesh(), self.suspect.mesh(), job)?;
                left.as_slice()
            }
        };
        let is_bent = |map| in_frames::is_bent(layout, &self.suspect, map);
        if !maps.first().is_some_and(is_bent) {
            return Ok(None);
        }
        let maps = in_frames::least_stretching(self.reference.mesh(), self.suspect.mesh(), maps);
        Ok(Some(self.at_vertices_in_frames(maps)))
    }

    fn at_vertices_in_frames(&self, maps: Vec<Correspondence>) -> Self {
        Self {
            reference: self.reference.clone(),
            suspect: self.suspect.clone(),
            placement: Placement::ByVertices(maps),
            brought_back: BroughtBack::InFrames,
        }
    }

    /// Whether its surface lies so little on the reference that something may have bent it, or posed it: where most of it does, that is read as it is.
    pub fn may_be_bent(&self) -> bool {
        match &self.placement {
            Placement::ByVertices(_) => false,
            Placement::BySurface(alignment) => {
                self.brought_back == BroughtBack::AsItIs && alignment.overlap < MOSTLY_THERE
            }
        }
    }

    /// The suspect brought back from whatever had bent or posed it, to be read in the frames of each vertex' own surroundings: by the vertices that are left where these are most of its own, as after a cut, else by its surface. None where it [is not](Self::may_be_bent), or can't be laid there. No bits are looked at.
    ///
    /// # Errors
    /// As [`unposed`](Self::unposed).
    pub fn unbent(&self, job: &Job) -> Result<Option<Self>, MarkError> {
        let Placement::BySurface(alignment) = &self.placement else {
            return Ok(None);
        };
        if !self.may_be_bent() {
            return Ok(None);
        }
        if let Some(left) = match_cut(self.reference.mesh(), self.suspect.mesh(), job)? {
            return Ok(Some(self.at_vertices_in_frames(vec![left])));
        }
        let Some(found) = unpose_bent(&self.reference, &self.suspect, alignment, job)? else {
            return Ok(None);
        };
        let placement = placed(&found, MatchedBy::BentSurface);
        Ok(Some(Self {
            reference: self.reference.clone(),
            suspect: self.suspect.mesh().with_positions(found.positions)?.into(),
            placement,
            brought_back: BroughtBack::InFrames,
        }))
    }

    /// Whether its surface lies on the reference and is one connected part, but for dust: of a reference of one part, parts by themselves say no more of it than the whole does. One of several that are alike may lie in the place of another. No bits are looked at.
    pub fn lies_as_one(&self) -> bool {
        let Placement::BySurface(alignment) = &self.placement else {
            return false;
        };
        if alignment.overlap < ALL_BUT_DUST {
            return false;
        }
        let mesh = self.suspect.mesh();
        let parts = components(mesh);
        let mut areas = vec![0.0; parts.count];
        for (t, &[corner, ..]) in mesh.triangles().iter().enumerate() {
            areas[parts.of_vertex[corner as usize] as usize] += mesh.triangle_area(t);
        }
        let (largest, all) = areas.iter().fold((0.0, 0.0), |(largest, all), &area| {
            (f64::max(largest, area), all + area)
        });
        let most = parts.sizes.iter().copied().max().unwrap_or(0);
        largest >= ALL_BUT_DUST * all && most as f64 > ALL_BUT_DUSTY_VERTICES * mesh.vertex_count() as f64
    }

    /// What of it was found again.
    pub fn matched_by(&self) -> MatchedBy {
        match &self.placement {
            Placement::ByVertices(_) if self.brought_back == BroughtBack::InFrames => MatchedBy::LocalFrames,
            Placement::ByVertices(_) if self.brought_back == BroughtBack::ByRig => MatchedBy::Rig,
            Placement::ByVertices(maps) => {
                let all = |map: &Correspondence| map.matched() == map.suspect_of.len();
                match maps.iter().all(all) {
                    true => MatchedBy::Connectivity,
                    false => MatchedBy::Surroundings,
                }
            }
            Placement::BySurface(alignment) => alignment.matched_by,
        }
    }

    /// In how many ways it can lie there; above 1 for symmetric shapes.
    pub fn poses(&self) -> usize {
        match &self.placement {
            Placement::ByVertices(maps) => maps.len(),
            Placement::BySurface(alignment) => 1 + alignment.alternatives.len(),
        }
    }

    /// All that can be read of the suspect in all the ways that it can lie, whatever the bits are that will be looked for.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn readings<'a>(&'a self, method: &'a ReadingMethod, job: &Job) -> Result<Readings<'a>, MarkError> {
        Readings::of(self, method, job)
    }

    /// The [reading](Readings::best) of all that agrees best with the bits that are looked for.
    ///
    /// # Errors
    /// When the original's bases can't be computed or aren't those that are expected; [`MarkError::Alignment`]; [`MarkError::Job`].
    pub fn read<'w>(
        &self,
        method: &ReadingMethod,
        wanted: impl Into<Wanted<'w>>,
        job: &Job,
    ) -> Result<Reading, MarkError> {
        self.readings(method, job)?.best(wanted, job)
    }
}
