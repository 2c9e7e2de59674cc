use std::sync::OnceLock;

use job::{Job, JobError};
use mesh::TriMesh;

use crate::{
    AlignOptions, Alignment, Correspondence, PointPair, PreparedMesh, RegistrationError, RegistrationStage,
    connectivity::{Connectivity, Survivors, survivors},
    points::{POINTS_APART, fits},
    sampled::Sampled,
    search::Search,
    survivors::{ByVertices, NEARLY},
    symmetries::Symmetries,
};

/// Finds the similarity that takes the suspect to the original, mirrored if need be, wherever the suspect lies.
///
/// Vertices that survived are used when there are enough of them and the surfaces agree; else the surfaces are
/// aligned, from the given pose, from principal axes and from rotations all around. Another model comes back
/// with `aligned` false and the overlap measured. [`Aligner`] keeps what it knows of an original for the next
/// suspect.
///
/// # Errors
/// When a mesh has no area, or an option is out of range; [`RegistrationError::Job`].
pub fn align(
    original: impl Into<PreparedMesh>,
    suspect: impl Into<PreparedMesh>,
    options: &AlignOptions,
    job: &Job,
) -> Result<Alignment, RegistrationError> {
    Aligner::new(original, options)?.align(suspect, job)
}

/// As [`align`], from at least three pairs of corresponding points instead of hypotheses, for suspects that
/// [`align`] cannot bring back.
///
/// The pairs need be no better than a few hundredths of the diagonal: the same fine alignment follows. Three
/// pairs, or pairs in one plane, do not tell a mirrored copy from one that is not; then both are tried, and
/// the surfaces decide. Of the maps of a symmetric net, the pairs choose the nearest.
///
/// ```
/// use mesh::shapes;
/// use registration::{PointPair, align_points};
///
/// let original = shapes::bumpy_torus(24, 16, 1);
/// let suspect = shapes::scaled(&original, 100.0);
/// let pairs = [0, 100, 200].map(|v| PointPair {
///     suspect: suspect.positions()[v].map(|x| x + 2.0),
///     original: original.positions()[v],
/// });
/// let found = align_points(&original, &suspect, &pairs, &Default::default(), &Default::default())?;
/// assert!(found.aligned && (found.transform.scale - 0.01).abs() < 1e-12);
/// # Ok::<(), registration::RegistrationError>(())
/// ```
///
/// # Errors
/// As [`align`]; when there are fewer than three pairs, when a coordinate is not finite, and when the points of
/// either mesh lie on one line.
pub fn align_points(
    original: impl Into<PreparedMesh>,
    suspect: impl Into<PreparedMesh>,
    pairs: &[PointPair],
    options: &AlignOptions,
    job: &Job,
) -> Result<Alignment, RegistrationError> {
    Aligner::new(original, options)?.align_points(suspect, pairs, job)
}

/// How a suspect was found to lie on the original.
#[derive(Clone, Debug, PartialEq)]
pub enum Placement {
    /// It has the original's connectivity, or all but a hundredth of it. These are the maps of the vertices that geometry can't tell apart,
    /// the best first, at most [`Aligner::MOST_MAPS`] of them and at least one. Where the vertices lie was not
    /// judged: another shape may have the same connectivity.
    ByVertices(Vec<Correspondence>),
    /// It hasn't. Whether it lies on the original at all, [`Alignment::aligned`] says; which vertices are left,
    /// [`Alignment::correspondence`].
    BySurface(Alignment),
}

/// Whether two numbers of vertices differ by less than a hundredth.
fn nearly_as_many(a: &TriMesh, b: &TriMesh) -> bool {
    let [a, b] = [a, b].map(TriMesh::vertex_count);
    NEARLY * a.abs_diff(b) <= a.min(b)
}

/// An original to which suspects are brought back, with what does not depend on the suspect.
///
/// ```
/// use mesh::shapes;
/// use registration::{Aligner, Placement, PreparedMesh};
///
/// let original = shapes::bumpy_torus(24, 16, 1);
/// let aligner = Aligner::new(&original, &Default::default())?;
/// let copy = shapes::shuffled(&original, 1);
/// let Placement::ByVertices(maps) = aligner.find(&copy, &Default::default())? else { panic!() };
/// assert_eq!(maps[0].matched(), original.vertex_count());
/// # Ok::<(), registration::RegistrationError>(())
/// ```
pub struct Aligner {
    original: PreparedMesh,
    options: AlignOptions,
    /// Each of these is computed when it is first needed.
    connectivity: OnceLock<Connectivity>,
    symmetries: OnceLock<Symmetries>,
}

impl Aligner {
    /// Maps of symmetric meshes onto themselves that are told apart. An icosahedron has 120; more come from rings
    /// of more than 32 equal sectors and from equal pieces.
    pub const MOST_MAPS: usize = 128;

    /// Nothing is computed yet.
    ///
    /// # Errors
    /// When an option is out of range.
    pub fn new(original: impl Into<PreparedMesh>, options: &AlignOptions) -> Result<Self, RegistrationError> {
        options.check()?;
        Ok(Self {
            original: original.into(),
            options: *options,
            connectivity: OnceLock::new(),
            symmetries: OnceLock::new(),
        })
    }

    /// The original, with the search tree and the normals that alignment and resampling share.
    pub fn original(&self) -> &PreparedMesh {
        &self.original
    }

    /// As [`align`](crate::align).
    ///
    /// # Errors
    /// As [`align`](crate::align).
    pub fn align(&self, suspect: impl Into<PreparedMesh>, job: &Job) -> Result<Alignment, RegistrationError> {
        let suspect = suspect.into();
        let (maps, search) = self.prepared(&suspect, job)?;
        self.concluded(maps, &search)
    }

    /// As [`align`](crate::align), but what has all of the original's vertices, and doesn't lie on it by them, was bent: its surface is not
    /// looked at. Nor is it where it is known that nothing was re-meshed. None then.
    pub(crate) fn align_piece(
        &self,
        suspect: &PreparedMesh,
        is_same_net: bool,
        job: &Job,
    ) -> Result<Option<Alignment>, RegistrationError> {
        let (maps, search) = self.prepared(suspect, job)?;
        match maps {
            Some(maps) if maps.is_of_all() => Ok(maps.judged(&search, 0)?),
            _ if is_same_net => Ok(None),
            maps => Ok(Some(self.concluded(maps, &search)?)),
        }
    }

    /// Whether a suspect has all of the original's triangles between vertices.
    pub(crate) fn has_same_net(&self, suspect: &TriMesh, job: &Job) -> Result<bool, RegistrationError> {
        Ok(matches!(self.survivors(suspect, job)?, Survivors::All(_)))
    }

    /// Looks for the original's vertices, and aligns by what is left of them, or by the surface, only where they
    /// are not all there.
    ///
    /// Connectivity is matched once, and no search tree is built of suspects that have it.
    ///
    /// # Errors
    /// As [`align`](crate::align); when a mesh has no area only where the surfaces are needed.
    pub fn find(&self, suspect: impl Into<PreparedMesh>, job: &Job) -> Result<Placement, RegistrationError> {
        job.begin(RegistrationStage::Connectivity)?;
        let suspect = suspect.into();
        let part = match self.survivors(suspect.mesh(), job)? {
            Survivors::All(maps) => return Ok(Placement::ByVertices(maps)),
            Survivors::Some(part) => part,
        };
        let of_some = || ByVertices::of_some(&part, self.original.mesh(), suspect.mesh(), job);
        let (part, (original, suspect)) = if nearly_as_many(self.original.mesh(), suspect.mesh()) {
            // As after rounding that merged a few: no search tree is needed if all others are there.
            let part = of_some()?;
            if let Some(map) = part.as_ref().and_then(ByVertices::nearly_all) {
                return Ok(Placement::ByVertices(vec![map.clone()]));
            }
            (part, self.sampled(&suspect, job)?)
        } else {
            let (part, sampled) = job.join(of_some, || self.sampled(&suspect, job))?;
            (part?, sampled?)
        };
        job.begin(RegistrationStage::Preparation)?;
        let search = self.search(original, suspect, job);
        Ok(Placement::BySurface(self.concluded(part, &search)?))
    }

    /// As [`align_points`](crate::align_points).
    ///
    /// # Errors
    /// As [`align_points`](crate::align_points).
    pub fn align_points(
        &self,
        suspect: impl Into<PreparedMesh>,
        pairs: &[PointPair],
        job: &Job,
    ) -> Result<Alignment, RegistrationError> {
        let diagonal = self.original.mesh().bounding_box().diagonal();
        let hypotheses = fits(diagonal, pairs)?;
        let suspect = suspect.into();
        let (maps, search) = self.prepared(&suspect, job)?;
        if let Some(maps) = maps {
            let (chosen, off) = maps.nearest(pairs);
            if off <= POINTS_APART * diagonal
                && let Some(found) = maps.judged(&search, chosen)?
            {
                return Ok(found);
            }
        }
        Ok(search.best_of_hypotheses(hypotheses)?)
    }

    fn search<'a>(&'a self, original: &'a Sampled, suspect: &'a Sampled, job: &'a Job) -> Search<'a> {
        Search {
            original,
            suspect,
            options: &self.options,
            job,
        }
    }

    /// By what is left of the vertices, if the surfaces agree, else by the surfaces.
    fn concluded(
        &self,
        maps: Option<ByVertices>,
        search: &Search<'_>,
    ) -> Result<Alignment, RegistrationError> {
        if let Some(maps) = maps
            && let Some(found) = maps.judged(search, 0)?
        {
            return Ok(found);
        }
        let found = search.by_surface()?;
        if !found.aligned {
            return Ok(found);
        }
        let job = search.job.quiet();
        let symmetries = self.symmetries(&job)?;
        Ok(Search { job: &job, ..*search }.with_symmetries(found, symmetries)?)
    }

    /// The motions that take the original onto itself.
    fn symmetries(&self, job: &Job) -> Result<&Symmetries, RegistrationError> {
        if let Some(symmetries) = self.symmetries.get() {
            return Ok(symmetries);
        }
        let original = self.original.sampled("original")?;
        let found = self.search(original, original, job).symmetries()?;
        // Whoever was first has found the same.
        Ok(self.symmetries.get_or_init(|| found))
    }

    /// Which vertices of the original the suspect still has.
    fn survivors<'a>(&'a self, suspect: &'a TriMesh, job: &Job) -> Result<Survivors<'a>, JobError> {
        let original = self.original.mesh();
        let connectivity = || self.connectivity.get_or_init(|| Connectivity::of(original));
        let (from, onto) = job.join(connectivity, || Connectivity::of(suspect))?;
        survivors(from.graph(original), suspect, onto, Self::MOST_MAPS, job)
    }

    /// What surviving vertices say, and both surfaces ready to be searched.
    fn prepared<'a>(
        &'a self,
        suspect: &'a PreparedMesh,
        job: &'a Job,
    ) -> Result<(Option<ByVertices>, Search<'a>), RegistrationError> {
        job.begin(RegistrationStage::Connectivity)?;
        let (maps, sampled) = job.join(
            || self.by_vertices(suspect.mesh(), job),
            || self.sampled(suspect, job),
        )?;
        let (maps, (original, suspect)) = (maps?, sampled?);
        job.begin(RegistrationStage::Preparation)?;
        Ok((maps, self.search(original, suspect, job)))
    }

    /// Samples of both surfaces.
    fn sampled<'a>(
        &'a self,
        suspect: &'a PreparedMesh,
        job: &Job,
    ) -> Result<(&'a Sampled, &'a Sampled), RegistrationError> {
        let (original, suspect) = job.join(
            || self.original.sampled("original"),
            || suspect.sampled("suspect"),
        )?;
        Ok((original?, suspect?))
    }

    /// The similarities between vertices that survived, if enough did.
    fn by_vertices(&self, suspect: &TriMesh, job: &Job) -> Result<Option<ByVertices>, RegistrationError> {
        match self.survivors(suspect, job)? {
            Survivors::All(maps) => Ok(ByVertices::of_all(maps, self.original.mesh(), suspect)),
            Survivors::Some(part) => Ok(ByVertices::of_some(&part, self.original.mesh(), suspect, job)?),
        }
    }
}
