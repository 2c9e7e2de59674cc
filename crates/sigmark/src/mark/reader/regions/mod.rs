//! Regions: which vertices of an original went into which vertex of a decimated suspect.
//!
//! A triangle that outlives the collapse of edges is one of the original's, whose corners went into three different vertices. Programs write what is left in
//! the order in which they read it: the suspect's triangles are a subsequence of the original's, corner by corner. Which one it is, is the
//! heaviest increasing subsequence of candidates that lie where they should, by dynamic programming. The corners of those are known; where the order was changed, a vertex belongs to the corner of the suspect that weighs most at its place.
//!
//! The vertices between are known from the decimation itself, which is done again: never are vertices joined of which it is known that they went into different ones. What comes of that says more of which triangles are left than their places do, so both are told in turns,
//! at first from those that are certain alone. A mark that nobody knows yet changed which edges were the cheapest, so the original is decimated with marks of random bits, too: where a region does not
//! depend on them it comes out alike, and of those that differ a vertex of the suspect [tells](super::quadrics) which it has. Where few are known, so that what is done again soon goes its own way, a vertex belongs to the nearest that is known.
//!
//! None of them is right everywhere. Where all patches are read, and the suspect is of the decimator that can be done again, regions are also [drawn](draws), many times, and what the draws differ by says how little is known of each vertex.

mod candidates;
mod draws;
mod growth;
mod repetition;
mod survivors;

use std::ops::Range;

use job::Job;
use mesh::TriMesh;

pub(super) use self::draws::{Draws, draws};
use self::{
    candidates::Candidates,
    growth::grown,
    repetition::repeated,
    survivors::{Survivor, survivors},
};
use crate::mark::{MarkError, MarkLayout, MarkStage};

/// Where a vertex of the original was seen: a triangle of the suspect, and the weights of its corners there.
pub(super) type Place = (u32, [f64; 3]);

/// For each vertex of the original, the suspect's vertex into which it went (#V); none where nothing was seen, or is not asked for.
pub(super) type Regions = Vec<Option<u32>>;

/// A suspect that lies on its original.
#[derive(Clone, Copy)]
pub(super) struct Overlay<'a> {
    pub(super) original: &'a TriMesh,
    pub(super) suspect: &'a TriMesh,
    /// Where the original's vertices were seen, if that is asked (#V).
    pub(super) places: &'a [Option<Place>],
}

/// The suspect's share of the original's triangles for which decimation is done again. Where more are left there is enough to read without; where fewer are, too few of what is done again are as they were.
const COARSER: Range<f64> = 0.025..0.12;

/// With less certainty in the mean, the original alone hardly tells more, and is not decimated again.
const CERTAIN: f64 = 0.4;

/// How many marks of random bits the original is decimated with; eight tell hardly more.
const LIKENESSES: usize = 3;

/// Triangles between two questions to the job.
const CHUNK: usize = 1024;

/// Regions of a suspect's vertices as they may be, at least once; each vertex has at most one of them. More is told if it is known which layout the mark has that may have been in what was decimated.
pub(super) fn regions(
    overlay: Overlay<'_>,
    layout: Option<&MarkLayout>,
    job: &Job,
) -> Result<Vec<Regions>, MarkError> {
    let may_repeat = COARSER.contains(&overlay.triangles_left());
    let candidates = Candidates::of(overlay, job)?;
    let (survivors, neighbours) = job.join(
        || survivors(overlay, &candidates, may_repeat, job),
        || overlay.original.neighbours(),
    )?;
    let survivors = survivors?;
    let Some(certain) = overlay.certainty(&survivors) else {
        return Ok(vec![overlay.heaviest_corners()]);
    };
    let mut all = vec![grown(overlay, &neighbours, &survivors, job)?];
    if may_repeat && (layout.is_some() || certain >= CERTAIN) {
        let likenesses = match layout {
            Some(layout) => layout.likenesses(0..LIKENESSES, overlay.places, job)?,
            None => Vec::new(),
        };
        job.begin(MarkStage::Resampling)?;
        let alone = job.alone().quiet();
        let of = |i: usize| {
            let decimated = i.checked_sub(1).map_or(overlay.original, |i| &likenesses[i]);
            repeated(overlay, decimated, &candidates, &survivors, &alone)
        };
        for regions in job.map(1 + likenesses.len(), 1, of)? {
            all.extend(regions?);
        }
    }
    Ok(all)
}

impl Overlay<'_> {
    /// Whether a vertex was seen in each triangle of the suspect (#F).
    fn seen_triangles(&self) -> Vec<bool> {
        let mut is_seen = vec![false; self.suspect.triangle_count()];
        let places = self.places.iter().flatten();
        places.for_each(|(t, _)| is_seen[*t as usize] = true);
        is_seen
    }

    /// The suspect's share of the original's triangles where it was seen, which are about two a vertex.
    fn triangles_left(&self) -> f64 {
        let seen = self.seen_triangles().into_iter().filter(|is_seen| *is_seen);
        seen.count() as f64 / (2.0 * self.places.iter().flatten().count() as f64)
    }

    /// How certain the survivors are in the mean of those in which a vertex was seen; none where more than half of those have none, as if the order were lost.
    fn certainty(&self, survivors: &[Option<Survivor>]) -> Option<f64> {
        let is_seen = self.seen_triangles();
        let seen = survivors.iter().zip(&is_seen).filter(|(_, is_seen)| **is_seen);
        let found: Vec<f64> = seen
            .filter_map(|(survivor, _)| Some((*survivor)?.certainty))
            .collect();
        let is_kept = 2 * found.len() >= is_seen.iter().filter(|is_seen| **is_seen).count();
        is_kept.then(|| found.iter().sum::<f64>() / found.len().max(1) as f64)
    }

    /// The corners of triangles that survived: the survivor, its corner in the original, and the suspect's vertex into which that went.
    fn corners<'s>(
        &'s self,
        survivors: &'s [Option<Survivor>],
    ) -> impl Iterator<Item = (Survivor, u32, u32)> + 's {
        let survivors = self.suspect.triangles().iter().zip(survivors);
        survivors
            .filter_map(|(corners, survivor)| Some((corners, (*survivor)?)))
            .flat_map(|(corners, survivor)| {
                let was = self.original.triangles()[survivor.triangle as usize];
                let pairs = was.into_iter().zip(*corners);
                pairs.map(move |(v, region)| (survivor, v, region))
            })
    }

    /// Regions by place alone: every vertex belongs to the corner that weighs most where it was seen.
    fn heaviest_corners(&self) -> Regions {
        let heaviest = |&(t, weights): &Place| {
            let greater = |i: usize, j: usize| if weights[j] > weights[i] { j } else { i };
            self.suspect.triangles()[t as usize][greater(greater(0, 1), 2)]
        };
        let places = self.places.iter();
        places.map(|place| place.as_ref().map(heaviest)).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;
    use decimation::{Decimator, decimate};
    use mesh::{Vec3, shapes};

    use crate::mark::settling::barycentric;

    pub(super) fn places_of(original: &TriMesh, suspect: &TriMesh) -> Vec<Option<Place>> {
        let surface = mesh::Surface::new(suspect);
        let nearest = |&p: &[f64; 3]| {
            let t = surface.nearest(p).triangle;
            let weights = barycentric(suspect.corners(t as usize), Vec3(p));
            Some((t, weights))
        };
        original.positions().iter().map(nearest).collect()
    }

    fn overlay<'a>(original: &'a TriMesh, suspect: &'a TriMesh, places: &'a [Option<Place>]) -> Overlay<'a> {
        Overlay {
            original,
            suspect,
            places,
        }
    }

    fn survivors_of(overlay: Overlay<'_>) -> Vec<Option<Survivor>> {
        let job = Job::default();
        let candidates = Candidates::of(overlay, &job).unwrap();
        survivors(overlay, &candidates, false, &job).unwrap()
    }

    fn alternatives(overlay: Overlay<'_>) -> Vec<Regions> {
        regions(overlay, None, &Job::default()).unwrap()
    }

    #[test]
    fn what_two_decimators_leave_is_found_in_the_order_of_the_original() {
        let original = shapes::bumpy_sphere(5, 3);
        for decimator in Decimator::ALL {
            let job = Job::default();
            let suspect = decimate(&original, 4000, decimator, &job).unwrap();
            let found = survivors_of(overlay(&original, &suspect, &places_of(&original, &suspect)));
            let ascending: Vec<u32> = found.iter().flatten().map(|survivor| survivor.triangle).collect();
            assert!(ascending.is_sorted());
            assert!(ascending.len() * 10 > 9 * found.len(), "{}", ascending.len());

            let shuffled = shapes::shuffled(&suspect, 1);
            let lost = survivors_of(overlay(&original, &shuffled, &places_of(&original, &shuffled)));
            assert!(2 * lost.iter().flatten().count() < lost.len());
        }
    }

    #[test]
    fn every_vertex_joins_the_region_of_the_shortest_way_to_a_seed() {
        let original = shapes::bumpy_sphere(4, 5);
        let suspect = decimate(&original, 300, Decimator::ALL[0], &Job::default()).unwrap();
        let mut places = places_of(&original, &suspect);
        (0..places.len()).step_by(7).for_each(|v| places[v] = None);
        let overlay = overlay(&original, &suspect, &places);
        let (survivors, neighbours) = (survivors_of(overlay), original.neighbours());
        let seeds: Vec<(u32, u32)> = suspect
            .triangles()
            .iter()
            .zip(&survivors)
            .filter_map(|(corners, survivor)| {
                Some((*corners, original.triangles()[(*survivor)?.triangle as usize]))
            })
            .flat_map(|(corners, was)| was.into_iter().zip(corners))
            .collect();
        // Dijkstra's way, one vertex after the other.
        let mut open: Vec<(f64, u32, u32)> = seeds.iter().map(|&(v, region)| (0.0, region, v)).collect();
        let mut expected = vec![None; places.len()];
        while let Some(first) = (0..open.len()).min_by(|&i, &j| open[i].partial_cmp(&open[j]).unwrap()) {
            let (distance, region, v) = open.swap_remove(first);
            let here = v as usize;
            if places[here].is_some() && expected[here].is_none() {
                expected[here] = Some(region);
                let step = |w: u32| (original.point(here) - original.point(w as usize)).norm();
                let next = neighbours
                    .of(here)
                    .iter()
                    .filter(|&&w| expected[w as usize].is_none());
                open.extend(next.map(|&w| (distance + step(w), region, w)));
            }
        }
        assert!(expected.iter().flatten().count() > 1000);
        for threads in [1, 3] {
            let grown = grown(overlay, &neighbours, &survivors, &Job::new(threads)).unwrap();
            assert_eq!(grown, expected);
        }
    }

    #[test]
    fn decimation_that_is_done_again_tells_more_of_regions_than_the_nearest_seed() {
        let (original, job) = (shapes::bumpy_sphere(5, 3), Job::default());
        // What a mark does to it.
        let wave = |&[x, y, z]: &[f64; 3]| 1.0 + 1e-3 * (9.0 * x - 7.0 * y + 5.0 * z).sin();
        let displaced = original.positions().iter().map(|p| p.map(|x| x * wave(p)));
        let signed = original.with_positions(displaced.collect()).unwrap();
        let suspect = decimate(
            &signed,
            original.triangle_count() / 10,
            Decimator::Threshold,
            &job,
        )
        .unwrap();
        let places = places_of(&original, &suspect);
        let all = alternatives(overlay(&original, &suspect, &places));
        assert_eq!(all.len(), 2);

        // With the right regions every triangle that has three is one of the suspect's.
        let own: HashSet<[u32; 3]> = suspect.triangles().iter().copied().collect();
        let is_torn = |regions: &Regions, corners: &[u32; 3]| match corners.map(|v| regions[v as usize]) {
            [Some(a), Some(b), Some(c)] => a != b && b != c && c != a && !own.contains(&[a, b, c]),
            _ => false,
        };
        let torn = |regions: &Regions| {
            original
                .triangles()
                .iter()
                .filter(|t| is_torn(regions, t))
                .count()
        };
        let [nearest, again] = [&all[0], &all[1]].map(torn);
        assert!(5 * again < 4 * nearest, "{again}, {nearest}");
    }

    #[test]
    fn a_vertex_belongs_to_its_nearest_seed() {
        let original = shapes::rectangle(8, 8, 1.0, 1.0);
        let suspect = shapes::rectangle(1, 1, 1.0, 1.0);
        let places = places_of(&original, &suspect);
        let regions = alternatives(overlay(&original, &suspect, &places)).swap_remove(0);
        assert!(regions.iter().all(Option::is_some));
        for (corner, w) in [(0, 0), (8, 1), (72, 2), (80, 3)] {
            assert_eq!(regions[corner], Some(w));
        }
    }
}
