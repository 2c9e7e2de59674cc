//! Which of the original's triangles each of the suspect's may be, by where they lie.

use std::{f64::consts::LN_2, ops::Range};

use job::Job;
use mesh::Vec3;

use super::{CHUNK, Overlay, Regions};
use crate::mark::MarkError;

/// What fits less is not tried: four in five of what is near.
const LEAST: f64 = 1.0;

/// What a pair is worth that fits exactly. With less, fewer of the survivors are found; with more, no more are.
const WORTH: f64 = 8.0;

/// What half of the survivors lie within, as a share of a triangle's doubled area, for the square of the distance from its middle.
const NEAR: f64 = 0.09;

/// How dear distance is, and a turn within the plane: roughly logarithms of how often survivors of both decimators lie so.
const DISTANCE: f64 = 1.5;
const TURN: f64 = 3.0;

/// How many of the suspect's triangles one of the original's may be: those that fit best. A decimated sphere has half as many at most; strangers' triangles may lie on each other by thousands.
const MOST: usize = 32;

/// How many triangles around a vertex are tried. Where there are more, which decimation hardly leaves, what is seen at one of them is tried there alone.
const MOST_AROUND: usize = 128;

/// For each triangle of the suspect, those of the original that are seen at it or at one that it touches and fit there, ascending, and how well each fits.
#[derive(Clone)]
pub(super) struct Candidates {
    /// Where those of each triangle begin, and where the last end.
    offsets: Vec<usize>,
    all: Vec<(u32, f32)>,
}

impl Candidates {
    pub(super) fn of(overlay: Overlay<'_>, job: &Job) -> Result<Self, MarkError> {
        let pairs = pairs(overlay, job)?;
        let count = overlay.suspect.triangle_count();
        let mut offsets = vec![0; count + 1];
        for pair in pairs.iter().flatten() {
            offsets[pair.of_suspect as usize + 1] += 1;
        }
        for s in 0..count {
            offsets[s + 1] += offsets[s];
        }
        let (mut next, mut all) = (offsets.clone(), vec![(0, 0.0); offsets[count]]);
        for pair in pairs.into_iter().flatten() {
            let next = &mut next[pair.of_suspect as usize];
            all[*next] = (pair.of_original, pair.likeness);
            *next += 1;
        }
        Ok(Self { offsets, all })
    }

    /// Of a triangle of the suspect: the original's, and how well each fits.
    pub(super) fn at(&self, triangle: usize) -> &[(u32, f32)] {
        &self.all[self.offsets[triangle]..self.offsets[triangle + 1]]
    }

    /// The number of the first candidate of a triangle among all.
    pub(super) fn first(&self, triangle: usize) -> usize {
        self.offsets[triangle]
    }

    /// How many there are in all.
    pub(super) fn count(&self) -> usize {
        self.all.len()
    }

    /// The original's triangle that a candidate is, and the suspect's for which it is one.
    pub(super) fn pair(&self, candidate: usize) -> (u32, usize) {
        let place = self.offsets.partition_point(|&offset| offset <= candidate) - 1;
        (self.all[candidate].0, place)
    }

    /// Makes pairs worth more by so much for each corner that is in the right region, and less by half as much, in the mean over the regions that have a say of the suspect's triangle, which is given by its number.
    pub(super) fn prefer(
        &mut self,
        overlay: Overlay<'_>,
        regions: &[Regions],
        has_a_say: impl Fn(usize, usize) -> bool,
        worth: f32,
    ) {
        let mut asked: Vec<&Regions> = Vec::with_capacity(regions.len());
        for (s, corners) in overlay.suspect.triangles().iter().enumerate() {
            asked.clear();
            asked.extend(
                regions
                    .iter()
                    .enumerate()
                    .filter(|&(i, _)| has_a_say(i, s))
                    .map(|(_, r)| r),
            );
            let worth = worth / asked.len().max(1) as f32;
            for (t, likeness) in &mut self.all[self.offsets[s]..self.offsets[s + 1]] {
                let was = overlay.original.triangles()[*t as usize];
                for regions in &asked {
                    let of_it = was.into_iter().zip(corners);
                    let right = of_it.filter(|&(v, &region)| regions[v as usize] == Some(region));
                    *likeness += worth * (right.count() as f32 - 1.5);
                }
            }
        }
    }

    /// Makes pairs worth as much more as is told of the original's triangle (#F).
    pub(super) fn add(&mut self, worth: &[f32]) {
        for (t, likeness) in &mut self.all {
            *likeness += worth[*t as usize];
        }
    }
}

/// A triangle of the suspect, and one of the original that it may be.
struct Pair {
    of_suspect: u32,
    of_original: u32,
    likeness: f32,
}

/// What fits, for each of the original's triangles in turn, in parts.
fn pairs(overlay: Overlay<'_>, job: &Job) -> Result<Vec<Vec<Pair>>, MarkError> {
    let Overlay {
        original,
        suspect,
        places,
    } = overlay;
    let stars = suspect.vertex_triangles();
    let facets: Vec<Facet> = (0..suspect.triangle_count())
        .map(|s| Facet::of(suspect.corners(s)))
        .collect();
    let of = |triangles: Range<usize>| {
        let (mut pairs, mut near) = (Vec::new(), Vec::<u32>::new());
        let mut last = [None; 3];
        for t in triangles {
            let seen_at = original.triangles()[t].map(|v| places[v as usize].map(|(s, _)| s));
            // Most lie where the one before does.
            if seen_at != last {
                last = seen_at;
                near.clear();
                for &s in seen_at.iter().flatten() {
                    near.push(s);
                    let around = suspect.triangles()[s as usize].map(|w| stars.of(w as usize));
                    let tried = around.into_iter().filter(|star| star.len() <= MOST_AROUND);
                    tried.for_each(|star| near.extend(star));
                }
                near.sort_unstable();
                near.dedup();
            }
            let own = Facet::of(original.corners(t));
            let first = pairs.len();
            pairs.extend(near.iter().filter_map(|&s| {
                let likeness = facets[s as usize].likeness(&own)?;
                Some(Pair {
                    of_suspect: s,
                    of_original: t as u32,
                    likeness: likeness as f32,
                })
            }));
            keep_best(&mut pairs, first);
        }
        pairs
    };
    Ok(job.quiet().map_chunks(original.triangle_count(), CHUNK, of)?)
}

/// Leaves no more than [`MOST`] from `first` on, those that fit best; of as good ones those with smaller numbers.
fn keep_best(pairs: &mut Vec<Pair>, first: usize) {
    let own = &mut pairs[first..];
    if own.len() > MOST {
        own.select_nth_unstable_by(MOST, |a, b| {
            let better = b.likeness.total_cmp(&a.likeness);
            better.then(a.of_suspect.cmp(&b.of_suspect))
        });
        pairs.truncate(first + MOST);
    }
}

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
        let likeness = WORTH - DISTANCE * (1.0 + distance).ln() - turn;
        (likeness > LEAST).then_some(likeness)
    }
}

/// A lower bound of the logarithm to base 2 of a positive number, less than 0.09 below it: exponent and mantissa as they stand in it, which is linear between powers of 2.
fn log2_at_least(x: f64) -> f64 {
    let one = 1.0_f64.to_bits() as f64;
    (x.to_bits() as f64 - one) / (1_u64 << (f64::MANTISSA_DIGITS - 1)) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use decimation::{Decimator, decimate};
    use mesh::{TriMesh, shapes};

    use crate::mark::reader::regions::tests::places_of;

    #[test]
    fn strange_suspects_have_no_more_candidates_than_decimated_ones_might() {
        let (original, job) = (shapes::bumpy_sphere(4, 3), Job::default());
        let decimated = decimate(&original, 100, Decimator::Threshold, &job).unwrap();
        let repeated = |times| {
            let triangles = decimated.triangles().repeat(times);
            TriMesh::new(decimated.positions().to_vec(), triangles).unwrap()
        };
        for (suspect, most) in [(repeated(1), MOST / 2), (repeated(20), MOST), (repeated(100), 3)] {
            let places = places_of(&original, &suspect);
            let overlay = Overlay {
                original: &original,
                suspect: &suspect,
                places: &places,
            };
            let mut of_original = vec![0; original.triangle_count()];
            for pair in pairs(overlay, &job).unwrap().iter().flatten() {
                of_original[pair.of_original as usize] += 1;
            }
            let greatest = of_original.into_iter().max().unwrap_or(0);
            assert!((1..=most).contains(&greatest), "{greatest}");
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
}
