//! Regions: which vertices of an original went into which vertex of a decimated suspect.
//!
//! A triangle that outlives the collapse of edges is one of the original's, whose corners went into three different vertices. Programs write what is left in
//! the order in which they read it: the suspect's triangles are a subsequence of the original's, corner by corner. Which one it is, is the
//! heaviest increasing subsequence of candidates that lie where they should, by dynamic programming. The corners of those are known; where the order was changed, a vertex belongs to the corner of the suspect that weighs most at its place.
//!
//! The vertices between are known from the decimation itself, which is done again: never are vertices joined of which it is known that they went into different ones. What comes of that says more of which triangles are left than their places do, so both are told in turns,
//! at first from those that are certain alone. A mark that nobody knows yet changed which edges were the cheapest, so the original is decimated with marks of random bits, too: where a region does not
//! depend on them it comes out alike, and of those that differ a vertex of the suspect [tells](super::quadrics) which it has. Where few are known, so that what is done again soon goes its own way, a vertex belongs to the nearest that is known.

use std::{borrow::Cow, f64::consts::LN_2, mem, num::NonZeroU32, ops::Range};

use job::Job;
use mesh::{TriMesh, Vec3};

use crate::mark::{MarkError, MarkLayout, MarkStage};

/// Where a vertex of the original was seen: a triangle of the suspect, and the weights of its corners there.
pub(super) type Place = (u32, [f64; 3]);

/// For each vertex of the original, the suspect's vertex into which it went (#V); none where nothing was seen, or is not asked for.
pub(super) type Regions = Vec<Option<u32>>;

/// Regions as they may be, at least once; each vertex of the suspect has at most one of them. The suspect lies on the original. More are told if it is known which layout the mark has that
/// may have been in what was decimated.
pub(super) fn regions(
    original: &TriMesh,
    layout: Option<&MarkLayout>,
    suspect: &TriMesh,
    places: &[Option<Place>],
    job: &Job,
) -> Result<Vec<Regions>, MarkError> {
    let mut is_seen = vec![false; suspect.triangle_count()];
    places
        .iter()
        .flatten()
        .for_each(|(t, _)| is_seen[*t as usize] = true);
    let seen = is_seen.iter().filter(|is_seen| **is_seen).count();
    let of_original = 2 * places.iter().flatten().count();
    let may_repeat = COARSER.contains(&(seen as f64 / of_original as f64));
    let candidates = candidates(original, suspect, places, job)?;
    let survivors = survivors(original, suspect, &candidates, may_repeat, job)?;
    let found = survivors.iter().zip(&is_seen).filter(|(_, is_seen)| **is_seen);
    let found: Vec<&Survivor> = found.filter_map(|(survivor, _)| survivor.as_ref()).collect();
    if 2 * found.len() < seen {
        let heaviest = |&(t, weights): &Place| {
            let greater = |i: usize, j: usize| if weights[j] > weights[i] { j } else { i };
            suspect.triangles()[t as usize][greater(greater(0, 1), 2)]
        };
        return Ok(vec![
            places.iter().map(|place| place.as_ref().map(heaviest)).collect(),
        ]);
    }
    let certain = found.iter().map(|survivor| survivor.certainty).sum::<f64>() / found.len().max(1) as f64;
    let mut all = vec![grown(original, suspect, &survivors, places, job)?];
    if may_repeat && (layout.is_some() || certain >= CERTAIN) {
        let likenesses = match layout {
            Some(layout) => layout.likenesses(LIKENESSES, places, job)?,
            None => Vec::new(),
        };
        job.begin(MarkStage::Resampling)?;
        let alone = job.alone().quiet();
        let of = |i: usize| {
            let decimated = i.checked_sub(1).map_or(original, |i| &likenesses[i]);
            repeated(
                original,
                decimated,
                suspect,
                &candidates,
                &survivors,
                places,
                &alone,
            )
        };
        for regions in job.map(1 + likenesses.len(), 1, of)? {
            all.extend(regions?);
        }
    }
    Ok(all)
}

/// The suspect's share of the original's triangles for which decimation is done again. Where more are left there is enough to read without; where fewer are, too few of what is done again are as they were.
const COARSER: Range<f64> = 0.025..0.12;

/// With less certainty in the mean, the original alone hardly tells more, and is not decimated again.
const CERTAIN: f64 = 0.4;

/// How many marks of random bits the original is decimated with; eight tell hardly more.
const LIKENESSES: usize = 3;

/// What a survivor is certain by whose corners are known.
const SURE: f64 = 0.9;

/// How often survivors and regions are told from each other.
const TURNS: usize = 2;

/// What a pair of triangles is worth more for each corner that is in the right region, and less for half as many of each that is not.
const WORTH_OF_A_CORNER: f32 = 2.0;

/// Regions by decimation that is done again, of the original or of what has its connectivity; none where nothing was seen as a whole.
fn repeated(
    original: &TriMesh,
    decimated: &TriMesh,
    suspect: &TriMesh,
    candidates: &Candidates,
    survivors: &[Option<Survivor>],
    places: &[Option<Place>],
    job: &Job,
) -> Result<Option<Regions>, MarkError> {
    let Some((part, vertices)) = seen_part(decimated, places) else {
        return Ok(None);
    };
    let again = |survivors: &[Option<Survivor>], least: f64| -> Result<Regions, MarkError> {
        let known = known(original, suspect, survivors, least);
        let known: Vec<Option<u32>> = vertices.iter().map(|&v| known[v as usize]).collect();
        let told = decimation::labels(&part, &known, job)?;
        let mut regions = vec![None; places.len()];
        vertices
            .iter()
            .zip(told)
            .for_each(|(&v, region)| regions[v as usize] = region);
        Ok(regions)
    };
    let mut survivors = Cow::Borrowed(survivors);
    for _ in 0..TURNS {
        let regions = again(&survivors, SURE)?;
        let mut candidates = candidates.clone();
        candidates.prefer(original, suspect, &regions);
        survivors = self::survivors(original, suspect, &candidates, true, job)?.into();
    }
    again(&survivors, 0.0).map(Some)
}

/// The triangles of the original with three corners that are asked for, as a mesh, and the numbers of its vertices; none where there is none.
fn seen_part(original: &TriMesh, places: &[Option<Place>]) -> Option<(TriMesh, Vec<u32>)> {
    let is_asked = |corners: &&[u32; 3]| corners.iter().all(|&v| places[v as usize].is_some());
    let mut triangles: Vec<[u32; 3]> = original.triangles().iter().filter(is_asked).copied().collect();
    let mut vertices: Vec<u32> = triangles.as_flattened().to_vec();
    vertices.sort_unstable();
    vertices.dedup();
    for corner in triangles.as_flattened_mut() {
        *corner = vertices.partition_point(|v| v < corner) as u32;
    }
    let positions = vertices
        .iter()
        .map(|&v| original.positions()[v as usize])
        .collect();
    Some((TriMesh::new(positions, triangles).ok()?, vertices))
}

/// For each vertex of the original, the region that is known of it (#V): of corners of survivors that are certain by so much, by the most certain one.
fn known(
    original: &TriMesh,
    suspect: &TriMesh,
    survivors: &[Option<Survivor>],
    least: f64,
) -> Vec<Option<u32>> {
    let mut known: Vec<Option<(f64, u32)>> = vec![None; original.vertex_count()];
    for (corners, survivor) in suspect.triangles().iter().zip(survivors) {
        let Some(Survivor { triangle, certainty }) = survivor.filter(|survivor| survivor.certainty >= least)
        else {
            continue;
        };
        for (v, &region) in original.triangles()[triangle as usize].into_iter().zip(corners) {
            let known = &mut known[v as usize];
            if known.is_none_or(|(before, _)| before < certainty) {
                *known = Some((certainty, region));
            }
        }
    }
    known.into_iter().map(|known| Some(known?.1)).collect()
}

/// Regions from the corners of triangles that survived: each vertex joins the seed that is nearest along the edges, of several as near the one of the smallest number.
///
/// Threads share the way there by taking one step from all vertices that came nearer in the last round (Bellman and Ford); regions are a few edges wide.
fn grown(
    original: &TriMesh,
    suspect: &TriMesh,
    survivors: &[Option<Survivor>],
    places: &[Option<Place>],
    job: &Job,
) -> Result<Vec<Option<u32>>, MarkError> {
    // How far the seed is, and its region.
    let mut nearest = vec![(f64::INFINITY, u32::MAX); places.len()];
    let mut came_nearer = vec![false; places.len()];
    let mut reached = Vec::new();
    let is_seen = |v: u32| places[v as usize].is_some();
    let mut seeds = Vec::new();
    for (corners, survivor) in suspect.triangles().iter().zip(survivors) {
        if let Some(Survivor { triangle, .. }) = survivor {
            let of_it = original.triangles()[*triangle as usize].into_iter().zip(*corners);
            let seen = of_it.filter(|&(v, _)| is_seen(v));
            seeds.extend(seen.map(|(v, region)| (v, (0.0, region))));
        }
    }
    let neighbours = original.neighbours();
    let mut offers = vec![seeds];
    while !offers.is_empty() {
        reached.clear();
        for (v, offer) in offers.into_iter().flatten() {
            let v = v as usize;
            if offer < nearest[v] {
                nearest[v] = offer;
                if !mem::replace(&mut came_nearer[v], true) {
                    reached.push(v);
                }
            }
        }
        reached.iter().for_each(|&v| came_nearer[v] = false);
        offers = job.quiet().map_chunks(reached.len(), CHUNK, |range| {
            let mut offers = Vec::new();
            for &here in &reached[range] {
                let (distance, region) = nearest[here];
                for &next in neighbours.of(here) {
                    let step = (original.point(here) - original.point(next as usize)).norm();
                    let offer = (distance + step, region);
                    if offer < nearest[next as usize] && is_seen(next) {
                        offers.push((next, offer));
                    }
                }
            }
            offers
        })?;
    }
    let region = |(_, region): (f64, u32)| (region != u32::MAX).then_some(region);
    Ok(nearest.into_iter().map(region).collect())
}

/// Triangles between two questions to the job.
const CHUNK: usize = 1024;

/// A triangle of the original that a suspect's was.
#[derive(Clone, Copy)]
struct Survivor {
    triangle: u32,
    /// From 0 to 1: the likelihood of the best order with it beside those with each of the other candidates; 0 where it was not asked for.
    certainty: f64,
}

/// For each triangle of the suspect, the original's that it was (#F); none where no one fits into the order.
fn survivors(
    original: &TriMesh,
    suspect: &TriMesh,
    candidates: &Candidates,
    how_certain: bool,
    job: &Job,
) -> Result<Vec<Option<Survivor>>, MarkError> {
    let mut lightest = LightestBefore::new(original.triangle_count());
    // Of each candidate: one more than the number of the one before it in the lightest subsequence that ends with it, and what that costs.
    let mut before: Vec<Option<NonZeroU32>> = Vec::with_capacity(candidates.all.len());
    let mut up_to: Vec<f64> = Vec::with_capacity(candidates.all.len());
    for s in 0..suspect.triangle_count() {
        if s.is_multiple_of(CHUNK) {
            job.go_on()?;
        }
        let first = before.len();
        for &(t, gain) in candidates.of(s) {
            let (cost, link) = lightest.before(t);
            up_to.push(cost - f64::from(gain));
            before.push(link);
        }
        for (i, &(t, _)) in (first..).zip(candidates.of(s)) {
            lightest.put(t, up_to[i], i);
        }
    }
    let mut survivors = vec![None; suspect.triangle_count()];
    let (least, mut last) = lightest.before(original.triangle_count() as u32);
    while let Some(link) = last.map(|link| link.get() as usize - 1) {
        survivors[candidates.place(link)] = Some(Survivor {
            triangle: candidates.all[link].0,
            certainty: 0.0,
        });
        last = before[link];
    }
    drop(before);
    if how_certain {
        weigh(&mut survivors, original, candidates, &up_to, least, job)?;
    }
    Ok(survivors)
}

/// Sets how certain survivors are, given what the lightest subsequence costs up to each candidate, and at least.
fn weigh(
    survivors: &mut [Option<Survivor>],
    original: &TriMesh,
    candidates: &Candidates,
    up_to: &[f64],
    least: f64,
    job: &Job,
) -> Result<(), MarkError> {
    let count = original.triangle_count();
    let mut lightest = LightestBefore::new(count);
    let mut from: Vec<f64> = Vec::new();
    for (s, survivor) in survivors.iter_mut().enumerate().rev() {
        if s.is_multiple_of(CHUNK) {
            job.go_on()?;
        }
        let range = candidates.offsets[s]..candidates.offsets[s + 1];
        let mirrored = |t: u32| (count - 1) as u32 - t;
        from.clear();
        from.extend(
            candidates
                .of(s)
                .iter()
                .map(|&(t, _)| lightest.before(mirrored(t)).0),
        );
        if let Some(survivor) = survivor {
            let likelihoods = up_to[range]
                .iter()
                .zip(&from)
                .map(|(up_to, from)| (least - up_to - from).exp());
            survivor.certainty = 1.0 / likelihoods.sum::<f64>().max(1.0);
        }
        for (&(t, gain), from) in candidates.of(s).iter().zip(&from) {
            lightest.put(mirrored(t), from - f64::from(gain), 0);
        }
    }
    Ok(())
}

/// For each triangle of the suspect, those of the original that are seen at it or at one that it touches and fit there, ascending, and how well each fits.
#[derive(Clone)]
struct Candidates {
    /// Where those of each triangle begin, and where the last end.
    offsets: Vec<usize>,
    all: Vec<(u32, f32)>,
}

impl Candidates {
    fn of(&self, triangle: usize) -> &[(u32, f32)] {
        &self.all[self.offsets[triangle]..self.offsets[triangle + 1]]
    }

    /// The triangle of the suspect that a candidate is one of.
    fn place(&self, candidate: usize) -> usize {
        self.offsets.partition_point(|&offset| offset <= candidate) - 1
    }

    /// Makes pairs worth more whose corners are in the right regions.
    fn prefer(&mut self, original: &TriMesh, suspect: &TriMesh, regions: &[Option<u32>]) {
        for (s, corners) in suspect.triangles().iter().enumerate() {
            for (t, likeness) in &mut self.all[self.offsets[s]..self.offsets[s + 1]] {
                let of_it = original.triangles()[*t as usize].into_iter().zip(corners);
                let right = of_it.filter(|&(v, &region)| regions[v as usize] == Some(region));
                *likeness += WORTH_OF_A_CORNER * (right.count() as f32 - 1.5);
            }
        }
    }
}

fn candidates(
    original: &TriMesh,
    suspect: &TriMesh,
    places: &[Option<Place>],
    job: &Job,
) -> Result<Candidates, MarkError> {
    let stars = suspect.vertex_triangles();
    let facets: Vec<Facet> = (0..suspect.triangle_count())
        .map(|s| Facet::of(suspect.corners(s)))
        .collect();
    // Of some of the original's triangles: the suspect's, their own, how well they fit.
    let pairs = job
        .quiet()
        .map_chunks(original.triangle_count(), CHUNK, |triangles| {
            let (mut pairs, mut near) = (Vec::new(), Vec::<u32>::new());
            let mut last = [None; 3];
            for t in triangles {
                let seen_at = original.triangles()[t].map(|v| places[v as usize].map(|(s, _)| s));
                // Most lie where the one before does.
                if seen_at != last {
                    last = seen_at;
                    near.clear();
                    for &w in seen_at
                        .iter()
                        .flatten()
                        .flat_map(|&s| &suspect.triangles()[s as usize])
                    {
                        near.extend(stars.of(w as usize));
                    }
                    near.sort_unstable();
                    near.dedup();
                }
                let own = Facet::of(original.corners(t));
                for &s in &near {
                    if let Some(likeness) = facets[s as usize].likeness(&own) {
                        pairs.push((s, t as u32, likeness as f32));
                    }
                }
            }
            pairs
        })?;
    let mut offsets = vec![0; suspect.triangle_count() + 1];
    for &(s, _, _) in pairs.iter().flatten() {
        offsets[s as usize + 1] += 1;
    }
    for s in 0..suspect.triangle_count() {
        offsets[s + 1] += offsets[s];
    }
    let (mut next, mut all) = (offsets.clone(), vec![(0, 0.0); offsets[suspect.triangle_count()]]);
    for (s, t, likeness) in pairs.into_iter().flatten() {
        all[next[s as usize]] = (t, likeness);
        next[s as usize] += 1;
    }
    Ok(Candidates { offsets, all })
}

/// What fits less is not tried: four in five of what is near.
const LEAST: f64 = 1.0;

/// What a pair is worth that fits exactly. With less, fewer of the survivors are found; with more, no more are.
const WORTH: f64 = 8.0;

/// What half of the survivors lie within, as a share of a triangle's doubled area, for the square of the distance from its middle.
const NEAR: f64 = 0.09;

/// How dear distance is, and a turn within the plane: roughly logarithms of how often survivors of both decimators lie so.
const DISTANCE: f64 = 1.5;
const TURN: f64 = 3.0;

/// A triangle, as it is compared with others.
struct Facet {
    middle: Vec3,
    /// Unit vectors from the middle to the corners.
    sides: [Vec3; 3],
    /// Its doubled area.
    size: f64,
}

impl Facet {
    fn of(corners: [Vec3; 3]) -> Self {
        let [a, b, c] = corners;
        let middle = (a + b + c) / 3.0;
        Self {
            middle,
            sides: corners.map(|corner| (corner - middle).unit()),
            size: (b - a).cross(c - a).norm(),
        }
    }

    /// How well an original's triangle fits into this place of a suspect's: it lies near the middle, and its corners lie to the same sides. None where that is not more than [`LEAST`].
    fn likeness(&self, own: &Self) -> Option<f64> {
        let distance = (own.middle - self.middle).squared() / (NEAR * self.size);
        // Most pairs need no logarithm, and many no directions.
        let at_most = WORTH - DISTANCE * LN_2 * log2_at_least(1.0 + distance);
        if at_most <= LEAST {
            return None;
        }
        let cosines: f64 = (0..3).map(|k| own.sides[k].dot(self.sides[k])).sum();
        let turn = TURN * (1.0 - cosines / 3.0);
        if at_most - turn <= LEAST {
            return None;
        }
        let likeness = WORTH - DISTANCE * distance.ln_1p() - turn;
        (likeness > LEAST).then_some(likeness)
    }
}

/// A lower bound of the logarithm to base 2 of a positive number, less than 0.09 below it: exponent and mantissa as they stand in it, which is linear between powers of 2.
fn log2_at_least(x: f64) -> f64 {
    let one = 1.0_f64.to_bits() as f64;
    (x.to_bits() as f64 - one) / (1_u64 << (f64::MANTISSA_DIGITS - 1)) as f64
}

/// The lightest of what was put at smaller indices (Fenwick's tree): its cost, and which it is.
struct LightestBefore {
    costs: Vec<f64>,
    /// One more than the number of each.
    links: Vec<Option<NonZeroU32>>,
}

impl LightestBefore {
    fn new(count: usize) -> Self {
        Self {
            costs: vec![0.0; count + 1],
            links: vec![None; count + 1],
        }
    }

    /// Its cost, and one more than its number.
    fn before(&self, index: u32) -> (f64, Option<NonZeroU32>) {
        let (mut i, mut lightest) = (index as usize, 0);
        while i > 0 {
            if self.costs[i] < self.costs[lightest] {
                lightest = i;
            }
            i &= i - 1;
        }
        (self.costs[lightest], self.links[lightest])
    }

    fn put(&mut self, index: u32, cost: f64, link: usize) {
        let mut i = index as usize + 1;
        // Who has more below it is no heavier.
        while i < self.costs.len() && cost < self.costs[i] {
            self.costs[i] = cost;
            self.links[i] = NonZeroU32::new(link as u32 + 1);
            i += i & i.wrapping_neg();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;
    use decimation::{Decimator, decimate};
    use mesh::shapes;

    use crate::mark::settling::barycentric;

    fn places_of(original: &TriMesh, suspect: &TriMesh) -> Vec<Option<Place>> {
        let surface = mesh::Surface::new(suspect);
        let nearest = |&p: &[f64; 3]| {
            let t = surface.nearest(p).triangle;
            let weights = barycentric(suspect.corners(t as usize), Vec3(p));
            Some((t, weights))
        };
        original.positions().iter().map(nearest).collect()
    }

    fn survivors_of(
        original: &TriMesh,
        suspect: &TriMesh,
        places: &[Option<Place>],
    ) -> Vec<Option<Survivor>> {
        let job = Job::default();
        let candidates = candidates(original, suspect, places, &job).unwrap();
        survivors(original, suspect, &candidates, false, &job).unwrap()
    }

    #[test]
    fn what_two_decimators_leave_is_found_in_the_order_of_the_original() {
        let original = shapes::bumpy_sphere(5, 3);
        for decimator in Decimator::ALL {
            let job = Job::default();
            let suspect = decimate(&original, 4000, decimator, &job).unwrap();
            let found = survivors_of(&original, &suspect, &places_of(&original, &suspect));
            let ascending: Vec<u32> = found.iter().flatten().map(|survivor| survivor.triangle).collect();
            assert!(ascending.is_sorted());
            assert!(ascending.len() * 10 > 9 * found.len(), "{}", ascending.len());

            let shuffled = shapes::shuffled(&suspect, 1);
            let lost = survivors_of(&original, &shuffled, &places_of(&original, &shuffled));
            assert!(2 * lost.iter().flatten().count() < lost.len());
        }
    }

    #[test]
    fn every_vertex_joins_the_region_of_the_shortest_way_to_a_seed() {
        let original = shapes::bumpy_sphere(4, 5);
        let suspect = decimate(&original, 300, Decimator::ALL[0], &Job::default()).unwrap();
        let mut places = places_of(&original, &suspect);
        (0..places.len()).step_by(7).for_each(|v| places[v] = None);
        let survivors = survivors_of(&original, &suspect, &places);
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
        let neighbours = original.neighbours();
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
            let grown = grown(&original, &suspect, &survivors, &places, &Job::new(threads)).unwrap();
            assert_eq!(grown, expected);
        }
    }

    #[test]
    fn the_bound_of_a_logarithm_is_near_and_never_above() {
        for i in 0..=10_000 {
            let x = 1.0 + 1.01_f64.powi(i) - 1.0;
            let (bound, log) = (log2_at_least(x), x.log2());
            if x.is_finite() {
                assert!(
                    bound <= log + 1e-12 && bound > log - 0.0861,
                    "{x}: {bound} for {log}"
                );
            }
        }
        assert!(log2_at_least(f64::INFINITY) > 1e3 && log2_at_least(f64::NAN) > 1e3);
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
        let all = regions(&original, None, &suspect, &places, &job).unwrap();
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

        let none: Vec<Option<Place>> = vec![None; places.len()];
        assert!(seen_part(&original, &none).is_none());
    }

    #[test]
    fn a_vertex_belongs_to_its_nearest_seed() {
        let original = shapes::rectangle(8, 8, 1.0, 1.0);
        let suspect = shapes::rectangle(1, 1, 1.0, 1.0);
        let places = places_of(&original, &suspect);
        let regions = regions(&original, None, &suspect, &places, &Job::default())
            .unwrap()
            .swap_remove(0);
        assert!(regions.iter().all(Option::is_some));
        for (corner, w) in [(0, 0), (8, 1), (72, 2), (80, 3)] {
            assert_eq!(regions[corner], Some(w));
        }
    }
}
