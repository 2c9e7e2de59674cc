//! From a suspect in unknown pose to the similarity that brings it back.

use crate::connectivity::{Correspondence, Graph, Survivors, survivors};
use crate::observer::{Observer, Quiet, Stage, Watch, begin, go_on};
use crate::sampled::Sampled;
use crate::search::{SAMPLES, Search};
use crate::vector::{norm, squared, sub};
use crate::{Handedness, RegistrationError, fit_similarity, threads};
use mesh::{Similarity, TriMesh};
use std::ops::ControlFlow;
use std::sync::OnceLock;

/// How to align.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlignOptions {
    /// How near the surfaces must be to count as overlapping, as a fraction of the smaller bounding-box
    /// diagonal.
    pub tolerance: f64,
    /// The least share of the suspect's area that must overlap for the suspect to count as aligned.
    pub least_overlap: f64,
    /// Threads to use; the result does not depend on it.
    pub threads: usize,
}

impl Default for AlignOptions {
    fn default() -> Self {
        Self {
            tolerance: 0.01,
            least_overlap: 0.8,
            threads: 1,
        }
    }
}

/// What the alignment rests on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Basis {
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
    pub basis: Basis,
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
/// Vertices that survived are used when there are enough of them and the surfaces agree; else the surfaces are aligned, from the
/// given pose, from principal axes and from rotations all around. Another model comes back with `aligned`
/// false and the overlap measured.
///
/// # Errors
/// When a mesh has no area, or an option is out of range.
pub fn align(
    original: &TriMesh,
    suspect: &TriMesh,
    options: &AlignOptions,
) -> Result<Alignment, RegistrationError> {
    align_observed(original, suspect, options, &())
}

/// As [`align`]; `watch` hears of each stage and may stop the search there.
///
/// # Errors
/// As [`align_observed`].
pub fn align_until(
    original: &TriMesh,
    suspect: &TriMesh,
    options: &AlignOptions,
    watch: &mut (dyn FnMut(Stage) -> ControlFlow<()> + Send),
) -> Result<Alignment, RegistrationError> {
    align_observed(original, suspect, options, &Watch::new(watch))
}

/// As [`align`], told to an observer, which may end it at any time.
///
/// # Errors
/// As [`align`], and [`RegistrationError::Stopped`].
pub fn align_observed(
    original: &TriMesh,
    suspect: &TriMesh,
    options: &AlignOptions,
    observer: &dyn Observer,
) -> Result<Alignment, RegistrationError> {
    go_on(observer)?;
    Aligner::new(original, options)?.align(suspect, observer)
}

/// As [`align_observed`], from at least three pairs of corresponding points instead of guesses, for suspects
/// that [`align`] cannot bring back.
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
/// let found = align_points(&original, &suspect, &pairs, &Default::default(), &())?;
/// assert!(found.aligned && (found.transform.scale - 0.01).abs() < 1e-12);
/// # Ok::<(), registration::RegistrationError>(())
/// ```
///
/// # Errors
/// As [`align_observed`]; when there are fewer than three pairs, when a coordinate is not finite, and when the
/// points of either mesh lie on one line.
pub fn align_points(
    original: &TriMesh,
    suspect: &TriMesh,
    pairs: &[PointPair],
    options: &AlignOptions,
    observer: &dyn Observer,
) -> Result<Alignment, RegistrationError> {
    go_on(observer)?;
    Aligner::new(original, options)?.align_points(suspect, pairs, observer)
}

/// An original with what does not depend on the suspect, for who has many suspects of one original.
pub struct Aligner<'a> {
    graph: Graph<'a>,
    sampled: Sampled,
    options: AlignOptions,
    symmetries: OnceLock<Vec<Similarity>>,
}

impl<'a> Aligner<'a> {
    /// Builds the original's search structures.
    ///
    /// # Errors
    /// When the original has no area, or an option is out of range.
    pub fn new(original: &'a TriMesh, options: &AlignOptions) -> Result<Self, RegistrationError> {
        check(options)?;
        let build = || {
            rayon::join(
                || Graph::of(original),
                || Sampled::of(original, "original", SAMPLES),
            )
        };
        let (graph, sampled) = threads::in_pool(options.threads, build)?;
        Ok(Self {
            graph,
            sampled: sampled?,
            options: *options,
            symmetries: OnceLock::new(),
        })
    }

    /// As [`align_observed`].
    ///
    /// # Errors
    /// As [`align_observed`].
    pub fn align(&self, suspect: &TriMesh, observer: &dyn Observer) -> Result<Alignment, RegistrationError> {
        threads::in_pool(self.options.threads, || {
            let (maps, suspect) = self.prepared(suspect, observer)?;
            let search = Search::new(&self.sampled, &suspect, &self.options, observer);
            if let Some(found) = maps.and_then(|maps| maps.judged(&search, 0)) {
                return Ok(found);
            }
            let found = search.by_surface()?;
            if found.aligned {
                Ok(search.with_symmetries(found, self.symmetries(observer)?))
            } else {
                Ok(found)
            }
        })?
    }

    /// The motions that take the original onto itself.
    fn symmetries(&self, observer: &dyn Observer) -> Result<&[Similarity], RegistrationError> {
        if self.symmetries.get().is_none() {
            let quiet = Quiet(observer);
            let search = Search::new(&self.sampled, &self.sampled, &self.options, &quiet);
            // Whoever was first has found the same.
            let _ = self.symmetries.set(search.symmetries()?);
        }
        Ok(self.symmetries.get().map_or(&[], Vec::as_slice))
    }

    /// As [`align_points`](crate::align_points).
    ///
    /// # Errors
    /// As [`align_points`](crate::align_points).
    pub fn align_points(
        &self,
        suspect: &TriMesh,
        pairs: &[PointPair],
        observer: &dyn Observer,
    ) -> Result<Alignment, RegistrationError> {
        let guesses = fits(self.sampled.diagonal, pairs)?;
        threads::in_pool(self.options.threads, || {
            let (maps, suspect) = self.prepared(suspect, observer)?;
            let search = Search::new(&self.sampled, &suspect, &self.options, observer);
            if let Some(maps) = maps {
                let (chosen, off) = maps.nearest(pairs);
                let agrees = off <= POINTS_OFF * self.sampled.diagonal;
                if let Some(found) = maps.judged(&search, chosen).filter(|_| agrees) {
                    return Ok(found);
                }
            }
            search.at_guesses(guesses)
        })?
    }

    /// What surviving vertices say, and the suspect ready to be searched.
    fn prepared(
        &self,
        suspect: &TriMesh,
        observer: &dyn Observer,
    ) -> Result<(Option<ByVertices>, Sampled), RegistrationError> {
        begin(observer, Stage::Connectivity)?;
        let (maps, sampled) = rayon::join(
            || by_vertices(&self.graph, suspect, observer),
            || Sampled::of(suspect, "suspect", SAMPLES),
        );
        let (maps, suspect) = (maps?, sampled?);
        begin(observer, Stage::Preparation)?;
        Ok((maps, suspect))
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
        ..
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

/// Maps of symmetric meshes onto themselves that are told apart.
const MOST_MAPS: usize = 128;

/// What surviving vertices say.
struct ByVertices {
    basis: Basis,
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
    fn judged(mut self, search: &Search<'_>, chosen: usize) -> Option<Alignment> {
        let (transform, correspondence) = self.maps.remove(chosen);
        if self.basis == Basis::Surroundings && !search.rests_at(&transform) {
            return None;
        }
        let alternatives = self.maps.into_iter().map(|(transform, _)| transform).collect();
        let found = Alignment {
            correspondence: Some(correspondence),
            alternatives,
            ..search.judged(transform, self.basis)
        };
        found.aligned.then_some(found)
    }
}

/// The similarities between vertices that survived, if enough did.
fn by_vertices(
    graph: &Graph<'_>,
    suspect: &TriMesh,
    observer: &dyn Observer,
) -> Result<Option<ByVertices>, RegistrationError> {
    let original = graph.mesh;
    let fitted = |map: Correspondence| {
        let fit = map.fit_robustly(original, suspect, Handedness::Either).ok()?;
        Some((fit.transform, map))
    };
    let (basis, maps) = match survivors(graph, suspect, MOST_MAPS, observer) {
        Survivors::All(maps) => (Basis::Connectivity, maps),
        Survivors::Some(part) => {
            let least = LEAST_SHARE * original.vertex_count().min(suspect.vertex_count()) as f64;
            let part = without_strays(part, original, suspect);
            let part = part.filter(|part| part.matched() as f64 >= least);
            (Basis::Surroundings, part.into_iter().collect())
        }
    };
    go_on(observer)?;
    let maps: Vec<_> = maps.into_iter().filter_map(fitted).collect();
    Ok((!maps.is_empty()).then_some(ByVertices { basis, maps }))
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
