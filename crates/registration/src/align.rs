//! From a suspect in unknown pose to the similarity that brings it back.

use crate::connectivity::{Connectivity, Correspondence, Remainder, Survivors, survivors};
use crate::sampled::Sampled;
use crate::search::Search;
use crate::vector::{norm, squared, sub};
use crate::{Handedness, PreparedMesh, RegistrationError, RegistrationStage, fit_similarity};
use job::{Job, JobError};
use mesh::{Similarity, TriMesh};
use std::sync::OnceLock;

/// How to align.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlignOptions {
    /// How near the surfaces must be to count as overlapping, as a fraction of the smaller bounding-box
    /// diagonal.
    pub tolerance: f64,
    /// The least share of the suspect's area that must overlap for the suspect to count as aligned.
    pub least_overlap: f64,
}

impl Default for AlignOptions {
    fn default() -> Self {
        Self {
            tolerance: 0.01,
            least_overlap: 0.8,
        }
    }
}

/// What the alignment rests on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum MatchedBy {
    /// All vertices of the original were found again.
    Connectivity,
    /// Part of the original's net was found again: at least a quarter of the vertices of the smaller mesh.
    Surroundings,
    /// The surfaces alone.
    Surface,
    /// The surfaces, from pairs of points that were given.
    Points,
}

/// A point of the suspect and the point of the original where it belongs: on the surfaces or near them, not
/// necessarily vertices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointPair {
    /// In the suspect's coordinates.
    pub suspect: [f64; 3],
    /// In the original's coordinates.
    pub original: [f64; 3],
}

/// Where the suspect belongs, and how well it fits there.
#[derive(Clone, Debug, PartialEq)]
pub struct Alignment {
    /// Takes the suspect to the original.
    pub transform: Similarity,
    /// What it rests on.
    pub matched_by: MatchedBy,
    /// Share of the suspect's area that lies on the original, 0 to 1.
    pub overlap: f64,
    /// Share of the original's area that lies on the suspect, 0 to 1.
    pub coverage: f64,
    /// Root mean square distance of the overlapping surface, as a fraction of the original's diagonal.
    pub residual: f64,
    /// Whether the overlap is large enough to call the suspect aligned. A plane never is when the surfaces
    /// alone speak for it, since it lies on any flat place.
    pub aligned: bool,
    /// The vertices that were found again, if any.
    pub correspondence: Option<Correspondence>,
    /// Other transforms that fit about as well: the shape is symmetric, or nearly so.
    pub alternatives: Vec<Similarity>,
    /// In how many of the seven directions (three of rotation, three of translation, one of scale) the
    /// surfaces slide on each other: 3 for a sphere, 1 for another surface of revolution, 4 for a plane. 0
    /// when vertices were found again.
    pub free_directions: usize,
}

impl Alignment {
    /// Whether the suspect is a mirrored copy: det R = −1. The transform mirrors it back.
    pub fn mirrored(&self) -> bool {
        self.transform.mirrors()
    }

    /// Whether other poses fit about as well: the [alternatives](Self::alternatives), or, when there are
    /// [free directions](Self::free_directions), infinitely many.
    pub fn ambiguous(&self) -> bool {
        self.free_directions > 0 || !self.alternatives.is_empty()
    }
}

/// Finds the similarity that takes the suspect to the original, mirrored if need be, without an initial
/// guess.
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

/// As [`align`], from at least three pairs of corresponding points instead of guesses, for suspects that
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
#[non_exhaustive]
pub enum Placement {
    /// It has the original's connectivity. These are the maps of the vertices that geometry can't tell apart,
    /// the best first, at most [`Aligner::MOST_MAPS`] of them and at least one. Where the vertices lie was not
    /// judged: another shape may have the same connectivity.
    ByVertices(Vec<Correspondence>),
    /// It hasn't. Whether it lies on the original at all, [`Alignment::aligned`] says; which vertices are left,
    /// [`Alignment::correspondence`].
    BySurface(Alignment),
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
    symmetries: OnceLock<Vec<Similarity>>,
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
        check(options)?;
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
        let (maps, original, suspect) = self.prepared(&suspect, job)?;
        let search = Search::new(original, suspect, &self.options, job);
        match maps.map(|maps| maps.judged(&search, 0)).transpose()?.flatten() {
            Some(found) => Ok(found),
            None => self.by_surface(&search),
        }
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
        let (part, sampled) = job.join(
            || self.by_survivors(&part, suspect.mesh(), job),
            || self.sampled(&suspect, job),
        )?;
        let (part, (original, suspect)) = (part?, sampled?);
        job.begin(RegistrationStage::Preparation)?;
        let search = Search::new(original, suspect, &self.options, job);
        match part.map(|part| part.judged(&search, 0)).transpose()?.flatten() {
            Some(found) => Ok(Placement::BySurface(found)),
            None => Ok(Placement::BySurface(self.by_surface(&search)?)),
        }
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
        let (maps, original, suspect) = self.prepared(&suspect, job)?;
        let search = Search::new(original, suspect, &self.options, job);
        if let Some(maps) = maps {
            let (chosen, off) = maps.nearest(pairs);
            if off <= POINTS_OFF * diagonal
                && let Some(found) = maps.judged(&search, chosen)?
            {
                return Ok(found);
            }
        }
        Ok(search.at_guesses(hypotheses)?)
    }

    fn by_surface(&self, search: &Search<'_>) -> Result<Alignment, RegistrationError> {
        let found = search.by_surface()?;
        if !found.aligned {
            return Ok(found);
        }
        let symmetries = self.symmetries(search.job())?;
        Ok(search.with_symmetries(found, symmetries)?)
    }

    /// The motions that take the original onto itself.
    fn symmetries(&self, job: &Job) -> Result<&[Similarity], RegistrationError> {
        if self.symmetries.get().is_none() {
            let (original, job) = (self.original.sampled("original")?, job.quiet());
            let search = Search::new(original, original, &self.options, &job);
            // Whoever was first has found the same.
            let _ = self.symmetries.set(search.symmetries()?);
        }
        Ok(self.symmetries.get().map_or(&[], Vec::as_slice))
    }

    /// Which vertices of the original the suspect still has.
    fn survivors<'a>(&'a self, suspect: &'a TriMesh, job: &Job) -> Result<Survivors<'a>, JobError> {
        let original = self.original.mesh();
        let connectivity = || self.connectivity.get_or_init(|| Connectivity::of(original));
        let (from, onto) = job.join(connectivity, || Connectivity::of(suspect))?;
        survivors(from.graph(original), suspect, onto, Self::MOST_MAPS, job)
    }

    /// What surviving vertices say, and both surfaces ready to be searched.
    #[expect(clippy::type_complexity)]
    fn prepared<'a>(
        &'a self,
        suspect: &'a PreparedMesh,
        job: &Job,
    ) -> Result<(Option<ByVertices>, &'a Sampled, &'a Sampled), RegistrationError> {
        job.begin(RegistrationStage::Connectivity)?;
        let (maps, sampled) = job.join(
            || self.by_vertices(suspect.mesh(), job),
            || self.sampled(suspect, job),
        )?;
        let (maps, (original, suspect)) = (maps?, sampled?);
        job.begin(RegistrationStage::Preparation)?;
        Ok((maps, original, suspect))
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
            Survivors::All(maps) => Ok(self.fitted(maps, MatchedBy::Connectivity, suspect)),
            Survivors::Some(part) => self.by_survivors(&part, suspect, job),
        }
    }

    /// The similarity between the vertices that are left, if enough are.
    fn by_survivors(
        &self,
        part: &Remainder<'_>,
        suspect: &TriMesh,
        job: &Job,
    ) -> Result<Option<ByVertices>, RegistrationError> {
        let original = self.original.mesh();
        let least = LEAST_SHARE * original.vertex_count().min(suspect.vertex_count()) as f64;
        let part = without_strays(part.correspondence(job)?, original, suspect);
        let part = part.filter(|part| part.matched() as f64 >= least);
        Ok(self.fitted(part.into_iter().collect(), MatchedBy::Surroundings, suspect))
    }

    fn fitted(
        &self,
        maps: Vec<Correspondence>,
        matched_by: MatchedBy,
        suspect: &TriMesh,
    ) -> Option<ByVertices> {
        let fitted = |map: Correspondence| {
            let fit = map
                .fit_robustly(self.original.mesh(), suspect, Handedness::Either)
                .ok()?;
            Some((fit.transform, map))
        };
        let maps: Vec<_> = maps.into_iter().filter_map(fitted).collect();
        (!maps.is_empty()).then_some(ByVertices { matched_by, maps })
    }
}

/// Given points that lie farther off than this, root mean square, as a fraction of the original's diagonal,
/// speak for another pose.
const POINTS_OFF: f64 = 0.1;

/// Points given by hand are off by about this fraction of the diagonal.
const CARELESS: f64 = 0.01;

/// The similarities that pairs of points leave open: one of each hand, or one alone if the other hand does
/// not fit the pairs.
fn fits(diagonal: f64, pairs: &[PointPair]) -> Result<Vec<Similarity>, RegistrationError> {
    let (from, onto): (Vec<_>, Vec<_>) = pairs.iter().map(|pair| (pair.suspect, pair.original)).unzip();
    let proper = fit_similarity(&from, &onto, None, Handedness::Proper)?;
    let careless = CARELESS * diagonal;
    let bound = 2.0 * proper.residual.min(proper.mirrored_residual) + careless;
    let mut open = Vec::new();
    if proper.residual <= bound {
        open.push(proper.transform);
    }
    if proper.mirrored_residual <= bound {
        open.push(fit_similarity(&from, &onto, None, Handedness::Mirrored)?.transform);
    }
    Ok(open)
}

fn check(options: &AlignOptions) -> Result<(), RegistrationError> {
    let &AlignOptions {
        tolerance,
        least_overlap,
    } = options;
    if !(tolerance > 0.0 && tolerance < 1.0) {
        let range = "greater than 0 and less than 1";
        return Err(RegistrationError::Option {
            name: "tolerance",
            value: tolerance,
            range,
        });
    }
    if !(0.0..=1.0).contains(&least_overlap) {
        let range = "between 0 and 1";
        return Err(RegistrationError::Option {
            name: "least_overlap",
            value: least_overlap,
            range,
        });
    }
    Ok(())
}

/// Fewer surviving vertices than this are taken for chance.
const FEWEST_SURVIVORS: usize = 30;

/// Survivors that are a smaller share than this of the smaller mesh place it less well than its surface does.
const LEAST_SHARE: f64 = 0.25;

/// Pairs farther apart than this many medians are strays.
const STRAY: f64 = 5.0;

/// What surviving vertices say.
struct ByVertices {
    matched_by: MatchedBy,
    /// Not empty; several where the net is symmetric, the best first.
    maps: Vec<(Similarity, Correspondence)>,
}

impl ByVertices {
    /// The map that brings given points nearest to where they belong, and how near, root mean square.
    fn nearest(&self, pairs: &[PointPair]) -> (usize, f64) {
        let off = |transform: &Similarity| {
            let apart = pairs
                .iter()
                .map(|pair| squared(sub(transform.apply(pair.suspect), pair.original)));
            (apart.sum::<f64>() / pairs.len() as f64).sqrt()
        };
        let distances = self.maps.iter().map(|(transform, _)| off(transform));
        let nearest = distances.enumerate().min_by(|x, y| x.1.total_cmp(&y.1));
        nearest.unwrap_or((0, f64::INFINITY))
    }

    /// The alignment by one of the maps, if the surfaces agree.
    fn judged(mut self, search: &Search<'_>, chosen: usize) -> Result<Option<Alignment>, JobError> {
        let (transform, correspondence) = self.maps.remove(chosen);
        if self.matched_by == MatchedBy::Surroundings && !search.rests_at(&transform)? {
            return Ok(None);
        }
        let alternatives = self.maps.into_iter().map(|(transform, _)| transform).collect();
        let found = Alignment {
            correspondence: Some(correspondence),
            alternatives,
            ..search.judged(transform, self.matched_by)?
        };
        Ok(found.aligned.then_some(found))
    }
}

/// Drops pairs that lie far off the similarity of all, until the rest agree; none when too few are left.
fn without_strays(mut map: Correspondence, original: &TriMesh, suspect: &TriMesh) -> Option<Correspondence> {
    let rounding = 1e-12 * original.bounding_box().diagonal();
    let mut before = usize::MAX;
    while map.matched() >= FEWEST_SURVIVORS && map.matched() < before {
        before = map.matched();
        let to_original = map.fit(original, suspect, Handedness::Either).ok()?.transform;
        let place = |w: u32| to_original.apply(suspect.positions()[w as usize]);
        let off = |v: usize, w: u32| norm(sub(place(w), original.positions()[v]));
        let pairs = map.suspect_of.iter().enumerate();
        let mut distances: Vec<f64> = pairs.filter_map(|(v, w)| w.map(|w| off(v, w))).collect();
        let middle = distances.len() / 2;
        let (_, &mut median, _) = distances.select_nth_unstable_by(middle, f64::total_cmp);
        for (v, slot) in map.suspect_of.iter_mut().enumerate() {
            *slot = slot.filter(|&w| off(v, w) <= STRAY * median + rounding);
        }
    }
    (map.matched() >= FEWEST_SURVIVORS).then_some(map)
}
