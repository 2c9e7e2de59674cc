use job::{Job, JobError};
use mesh::{Similarity, TriMesh, Vec3};

use crate::{Alignment, Correspondence, MatchedBy, PointPair, connectivity::Remainder, search::Search};

// These three were chosen on the fourteen meshes of `results/registration.md`. What other values do was measured on 50 suspects
// of five of them that keep some of the net, from a seventh to all of it, with noise and with strays, and on 10 other models: 50 and
// 10 come out right.

/// Fewer surviving vertices than this are taken for chance. Of 30 pieces of 20 to 100 vertices, 20 come out right with this and
/// with half as many, 19 with twice as many.
const FEWEST_SURVIVORS: usize = 30;

/// Survivors that are a smaller share than this of the smaller mesh place it less well than its surface does: a few true ones
/// of a re-meshed copy grow into thousands of wrong pairs. With half or twice as much all 60 stay right, in 0.9 and 1.3 of the
/// time.
const LEAST_SHARE: f64 = 0.25;

/// Pairs farther apart than this many medians are strays. With half or twice as many all 60 stay right in the same time.
const STRAY: f64 = 5.0;

/// One part in so many may be missing of what is nearly all.
pub(crate) const NEARLY: usize = 100;

/// What surviving vertices say of the pose.
pub(crate) struct ByVertices {
    matched_by: MatchedBy,
    /// Not empty; several where the net is symmetric, the best first.
    maps: Vec<(Similarity, Correspondence)>,
}

impl ByVertices {
    /// By maps of all vertices; none if they do not determine a similarity.
    pub(crate) fn of_all(maps: Vec<Correspondence>, original: &TriMesh, suspect: &TriMesh) -> Option<Self> {
        Self::fitted(MatchedBy::Connectivity, maps, original, suspect)
    }

    /// By the vertices that are left, if enough are.
    pub(crate) fn of_some(
        remainder: &Remainder<'_>,
        original: &TriMesh,
        suspect: &TriMesh,
        job: &Job,
    ) -> Result<Option<Self>, JobError> {
        let least = LEAST_SHARE * original.vertex_count().min(suspect.vertex_count()) as f64;
        let left = without_strays(remainder.correspondence(job)?, original, suspect);
        let left = left.filter(|left| left.matched() as f64 >= least);
        let maps = left.into_iter().collect();
        Ok(Self::fitted(MatchedBy::Surroundings, maps, original, suspect))
    }

    fn fitted(
        matched_by: MatchedBy,
        maps: Vec<Correspondence>,
        original: &TriMesh,
        suspect: &TriMesh,
    ) -> Option<Self> {
        let fitted = |map: Correspondence| {
            let fit = map.fit_robustly(original, suspect).ok()?;
            Some((fit.transform, map))
        };
        let maps: Vec<_> = maps.into_iter().filter_map(fitted).collect();
        (!maps.is_empty()).then_some(Self { matched_by, maps })
    }

    /// Whether it is by maps of all vertices.
    pub(crate) fn is_of_all(&self) -> bool {
        self.matched_by == MatchedBy::Connectivity
    }

    /// The map of the vertices that are left, if that is all but a hundredth of them: their surroundings are unique, so that no symmetry makes
    /// another.
    pub(crate) fn nearly_all(&self) -> Option<&Correspondence> {
        let [(_, map)] = &self.maps[..] else { return None };
        let lost = map.suspect_of.len() - map.matched();
        (NEARLY * lost <= map.suspect_of.len()).then_some(map)
    }

    /// The map that brings given points nearest to where they belong, and how near, root mean square.
    pub(crate) fn nearest(&self, pairs: &[PointPair]) -> (usize, f64) {
        let off = |transform: &Similarity| {
            let apart = pairs
                .iter()
                .map(|pair| (transform.apply(Vec3(pair.suspect)) - Vec3(pair.original)).squared());
            (apart.sum::<f64>() / pairs.len() as f64).sqrt()
        };
        let distances = self.maps.iter().map(|(transform, _)| off(transform));
        let nearest = distances.enumerate().min_by(|x, y| x.1.total_cmp(&y.1));
        nearest.unwrap_or((0, f64::INFINITY))
    }

    /// The alignment by one of the maps, if the surfaces agree.
    pub(crate) fn judged(
        mut self,
        search: &Search<'_>,
        chosen: usize,
    ) -> Result<Option<Alignment>, JobError> {
        let (transform, correspondence) = self.maps.remove(chosen);
        if self.matched_by == MatchedBy::Surroundings && !search.is_at_rest(&transform)? {
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
        let to_original = map.fit(original, suspect).ok()?.transform;
        let off =
            |v: usize, w: u32| (to_original.apply(suspect.point(w as usize)) - original.point(v)).norm();
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
