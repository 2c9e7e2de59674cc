//! Pose hypotheses for a suspect of which much is missing and no vertex survived: congruent sets of oriented points.
//!
//! As 4-points congruent sets (Aiger, Mitra, Cohen-Or 2008), with two points and their normals in place of
//! four points (Drost et al. 2010). Under similarities a pair p, q with normals m, n and direction d = (q −
//! p)/|q − p| keeps m·d, n·d and m·n, and the sign of m·(d × n) unless it is mirrored. A pair in the suspect
//! and a pair in the original that agree in these fix a similarity, scale included. All pairs of sites in the
//! original are filed under the three angles; bases are the pairs in the suspect with the fewest partners.
//! What is left of the original is all in the suspect, so any base will do, and two good sites are enough
//! where four points would need four.
//!
//! The scale is unknown, and that is what 4-points congruent sets suffer from. They first collect the pairs of
//! the original that are as long as a base's two diagonals; without a scale these are all N² pairs, and the
//! sets are all couples of pairs whose intersections, as the base's ratios have them, lie within ε of each
//! other: about N⁴ (ε/D)³ for a diagonal D, 10⁶ for each base at N = 1000 and ε = D/100, of which each has to
//! be checked. Normals take over what the lengths cannot do: three angles kept to ±8° leave about 1500 of the
//! 10⁶ pairs for a base (measured on half a horse of 202 sites: 100 000 hypotheses from its rarest bases, 590
//! of them within 15 % of the diagonal of the right pose).

use std::{f64::consts::PI, ops::RangeInclusive};

use job::{Job, JobError};
use mesh::{Similarity, Vec3};

use crate::{
    matrix::Mat3,
    sampled::{GRAIN, Sampled},
};

// How these numbers were chosen and what was measured of others, the comment of the module `search` says: 16 of its 20 cut
// suspects come out right with all of them.

/// Sites on the original, close enough together that every site of a suspect has one nearby.
/// With half as many 17 of 20 cut suspects are right, and 35 of 45 more quarters, eighths and noisy halves instead of 32, in 0.7
/// of the time; with twice as many 7 of 20 in 2.2 times.
const SITES: usize = 1_000;

/// Sites on the suspect. With half as many 16 of 20 cut suspects are right, with twice as many 15.
const SUSPECT_SITES: usize = 300;

/// Samples that agree on a site's normal lie within this fraction of the diagonal. With half as much 16 of 20 cut suspects are
/// right in 1.2 times the time, with twice as much 13 in 0.8 of it.
const NEIGHBOURHOOD: f64 = 0.03;

/// Pairs of the suspect that bases are chosen from. With half as many 16 of 20 cut suspects are right, with twice as many 15.
const PAIRS: usize = 20_000;

/// Bases. With half as many 15 of 20 cut suspects are right in 0.9 of the time, with twice as many 14 in 1.3 times.
const BASES: usize = 300;

/// Hypotheses made from them. With half as many 13 of 20 cut suspects are right, with twice as many 16 in 1.1 times the time.
const HYPOTHESES: usize = 100_000;

/// The points of a base are at least this fraction of the suspect's diagonal apart. Flat halves have none that are much
/// wider and twisted. With half or twice as much no cut suspect changes.
const LEAST_WIDTH: f64 = 0.2;

/// The least |m·(d × n)|: below, a pair does not fix its frame well. With half or twice as much 16 of 20 cut suspects are right.
const LEAST_TWIST: f64 = 0.25;

/// Bins for each of the three angles. No cut suspect depends on them; 8 take 1.5 times as long, 32 take 0.8 of the time.
const BINS: usize = 16;

/// Partners agree in each angle to this many radians: 8°. With half as much 17 of 20 cut suspects are right, and 36 of 45
/// more quarters, eighths and noisy halves instead of 32, in 0.9 of the time; with twice as much 7 of 20 in 1.6 times.
const ANGLE_TOLERANCE: f64 = 0.14;

/// A hypothesis must bring sites this near, as a fraction of the moved suspect's diagonal. With half or twice as much 16 of 20
/// cut suspects are right.
const NEAR: f64 = 0.08;

/// Sites by which all hypotheses are scored. With half or twice as many 16 of 20 cut suspects are right in the same time.
const COARSE_SITES: usize = 10;

/// The best of them are scored again. With half as many 15 of 20 cut suspects are right, with twice as many 16.
const FINE_HYPOTHESES: usize = 2_000;

/// By so many sites. With half or twice as many no cut suspect changes.
const FINE_SITES: usize = 100;

/// A site has a normal if the mean of the unit normals around it is longer than this. With 0.7 15 of 20 cut suspects are right in
/// 1.3 times the time, with 0.95 16 in 0.75 of it.
const LEAST_MEAN_NORMAL: f64 = 0.85;

/// Poses are apart if they move one of the sites by this fraction of the original's diagonal: coarse refinement takes
/// those that are nearer to one place. With half as much 16 of 20 cut suspects are right, with twice as much 17.
const APART: f64 = 0.05;

/// A moved suspect is at least this many of the original's diagonals long: no smaller part is looked for. With half as much 15 of
/// 20 cut suspects are right, with twice as much 16.
const LEAST_SIZE: f64 = 0.15;

/// And at most so many: a part is not larger than the whole. With 0.8 17 of 20 cut suspects are right, with 2 16.
const MOST_SIZE: f64 = 1.1;

/// A point of a surface with the mean normal around it.
#[derive(Clone, Copy)]
struct Site {
    point: Vec3,
    normal: Vec3,
}

/// Two sites with what a similarity leaves of them.
#[derive(Clone, Copy)]
struct Pair {
    first: Site,
    second: Site,
    /// Cosines of the angles between first normal and direction, second normal and direction, and both normals.
    cosines: [f64; 3],
    twist: f64,
}

/// The `count` best hypotheses.
pub(crate) fn hypotheses(
    original: &Sampled,
    suspect: &Sampled,
    count: usize,
    job: &Job,
) -> Result<Vec<Similarity>, JobError> {
    let index = Index::of(sites(original, SITES, job)?);
    let sites = sites(suspect, SUSPECT_SITES, job)?;
    let bases = bases(&index, &sites, suspect.diagonal);
    let candidates: Vec<Similarity> = bases
        .iter()
        .flat_map(|base| index.partners(base).map(move |partner| onto(base, &partner)))
        .filter(|pose| is_plausible(pose, original, suspect))
        .take(HYPOTHESES)
        .collect();
    job.go_on()?;
    let score = |pose: &Similarity, count| score(original, &sites, pose, suspect.diagonal, count);
    let mut coarse = ranked(candidates, |pose| score(pose, COARSE_SITES), job)?;
    coarse.truncate(FINE_HYPOTHESES);
    let fine = ranked(coarse, |pose| score(pose, FINE_SITES), job)?;
    Ok(distinct(fine.into_iter(), suspect, original.diagonal, count))
}

/// The widest twisted pairs of the suspect that have partners, those with the fewest first.
fn bases(index: &Index, sites: &[Site], diagonal: f64) -> Vec<Pair> {
    let mut wide: Vec<(f64, Pair)> = Vec::new();
    for (i, j) in spread_pairs(sites.len()) {
        let apart = (sites[j].point - sites[i].point).norm();
        let pair = Pair::of(sites[i], sites[j]).filter(|pair| pair.twist.abs() > LEAST_TWIST);
        wide.extend(
            pair.filter(|_| apart >= LEAST_WIDTH * diagonal)
                .map(|pair| (apart, pair)),
        );
    }
    wide.sort_by(|x, y| y.0.total_cmp(&x.0));
    wide.truncate(BASES);
    // The suspect may be inside out: its normals count with both signs.
    let both_ways = wide.into_iter().flat_map(|(_, pair)| [pair, pair.turned()]);
    let counted = both_ways.map(|pair| (index.partners(&pair).count(), pair));
    let mut bases: Vec<(usize, Pair)> = counted.filter(|(partners, _)| *partners > 0).collect();
    bases.sort_by_key(|(partners, _)| *partners);
    bases.into_iter().map(|(_, pair)| pair).collect()
}

/// Poses by descending score.
fn ranked(
    poses: Vec<Similarity>,
    score: impl Fn(&Similarity) -> f64 + Sync + Send,
    job: &Job,
) -> Result<Vec<Similarity>, JobError> {
    let scores = job.map(poses.len(), GRAIN, |i| score(&poses[i]))?;
    let mut order: Vec<usize> = (0..poses.len()).collect();
    order.sort_by(|&i, &j| scores[j].total_cmp(&scores[i]));
    Ok(order.into_iter().map(|i| poses[i]).collect())
}

/// Sites with their normals, without those where the surface bends too much to have one.
fn sites(of: &Sampled, count: usize, job: &Job) -> Result<Vec<Site>, JobError> {
    let picked: Vec<usize> = of.some(count).collect();
    let radius = (NEIGHBOURHOOD * of.diagonal).powi(2);
    let sites = job.map(picked.len(), GRAIN, |k| {
        let (point, own) = (of.points[picked[k]], of.normal(picked[k]));
        let near = (0..of.points.len()).filter(|&i| (of.points[i] - point).squared() < radius);
        let facing = near.map(|i| of.normal(i)).filter(|n| n.dot(own) > 0.0);
        let (sum, count) = facing.fold((Vec3::ZERO, 0.0), |(sum, count), n| (sum + n, count + 1.0));
        (sum.norm() > LEAST_MEAN_NORMAL * count && count > 0.0).then(|| Site {
            point,
            normal: sum.unit(),
        })
    })?;
    Ok(sites.into_iter().flatten().collect())
}

/// Pairs i, j of 0..n, all of them or an even choice of [`PAIRS`].
fn spread_pairs(n: usize) -> impl Iterator<Item = (usize, usize)> {
    let all = n * n;
    // A step with no common divisor with most numbers, near the golden section of the whole, visits pairs far
    // apart.
    let step = ((all as f64 * 0.618_033_988_749_895) as usize) | 1;
    (0..all.min(PAIRS))
        .map(move |k| (k * step) % all)
        .map(move |k| (k / n, k % n))
        .filter(|(i, j)| i != j)
}

impl Pair {
    fn of(first: Site, second: Site) -> Option<Self> {
        let difference = second.point - first.point;
        if difference == Vec3::ZERO {
            return None;
        }
        let d = difference.unit();
        let (m, n) = (first.normal, second.normal);
        Some(Self {
            first,
            second,
            cosines: [m.dot(d), n.dot(d), m.dot(n)],
            twist: m.dot(d.cross(n)),
        })
    }

    /// The same pair on the surface turned inside out.
    fn turned(&self) -> Self {
        let turned = |site: Site| Site {
            normal: -site.normal,
            ..site
        };
        let [a, b, c] = self.cosines;
        Self {
            first: turned(self.first),
            second: turned(self.second),
            cosines: [-a, -b, c],
            twist: self.twist,
        }
    }

    /// An orthonormal frame that moves with the pair: along it, along what its normals have in common across
    /// it, and the third direction, on the side that the twist gives.
    fn frame(&self) -> Mat3 {
        let d = (self.second.point - self.first.point).unit();
        let across = |n: Vec3| (n - d * n.dot(d)).unit();
        let middle = (across(self.first.normal) + across(self.second.normal)).unit();
        Mat3([d, middle, d.cross(middle) * self.twist.signum()])
    }
}

/// The similarity that takes one pair to another; a mirror when their twists differ in sign.
fn onto(from: &Pair, to: &Pair) -> Similarity {
    let length = |pair: &Pair| (pair.second.point - pair.first.point).norm();
    let middle = |pair: &Pair| (pair.first.point + pair.second.point) * 0.5;
    let scale = length(to) / length(from);
    let rotation = to.frame().transposed() * from.frame();
    let translation = middle(to) - rotation * middle(from) * scale;
    Similarity {
        scale,
        rotation: rotation.rows(),
        translation: translation.0,
    }
}

/// Whether a pose leaves the suspect neither much larger than the original nor a dot on it.
fn is_plausible(pose: &Similarity, original: &Sampled, suspect: &Sampled) -> bool {
    (LEAST_SIZE..MOST_SIZE).contains(&(pose.scale * suspect.diagonal / original.diagonal))
}

/// The pairs of the original's sites, filed under their angles.
struct Index {
    sites: Vec<Site>,
    pairs: Vec<[u16; 2]>,
    starts: Vec<usize>,
    bins: Bins,
}

impl Index {
    fn of(sites: Vec<Site>) -> Self {
        let bins = Bins::new();
        let mut filed: Vec<(usize, [u16; 2])> = Vec::new();
        for (i, &first) in sites.iter().enumerate() {
            for (j, &second) in sites.iter().enumerate() {
                let pair = if i == j { None } else { Pair::of(first, second) };
                if let Some(pair) = pair.filter(|pair| pair.twist.abs() > 0.5 * LEAST_TWIST) {
                    let [a, b, c] = pair.cosines.map(|cosine| bins.of(cosine));
                    filed.push(((a * BINS + b) * BINS + c, [i as u16, j as u16]));
                }
            }
        }
        filed.sort_unstable();
        let mut starts = vec![0; BINS * BINS * BINS + 1];
        for (bin, _) in &filed {
            starts[bin + 1] += 1;
        }
        for bin in 1..starts.len() {
            starts[bin] += starts[bin - 1];
        }
        Self {
            sites,
            pairs: filed.into_iter().map(|(_, pair)| pair).collect(),
            starts,
            bins,
        }
    }

    /// The pairs whose angles are like those of another.
    fn partners<'a>(&'a self, base: &Pair) -> impl Iterator<Item = Pair> + 'a {
        let alike = base.cosines.map(cosines_near);
        let [a, b, c] = alike
            .clone()
            .map(|near| self.bins.of(*near.end())..=self.bins.of(*near.start()));
        let bins = a.flat_map(move |a| {
            let c = c.clone();
            b.clone()
                .flat_map(move |b| c.clone().map(move |c| (a * BINS + b) * BINS + c))
        });
        let filed = bins.flat_map(|bin| &self.pairs[self.starts[bin]..self.starts[bin + 1]]);
        let pairs =
            filed.filter_map(|&[i, j]| Pair::of(self.sites[usize::from(i)], self.sites[usize::from(j)]));
        pairs.filter(move |pair| (0..3).all(|k| alike[k].contains(&pair.cosines[k])))
    }
}

/// The cosines of the angles that are within the tolerance of that of a cosine.
fn cosines_near(cosine: f64) -> RangeInclusive<f64> {
    let angle = cosine.clamp(-1.0, 1.0).acos();
    let [least, most] = [angle - ANGLE_TOLERANCE, angle + ANGLE_TOLERANCE];
    // Rounding may take cosines beyond ±1.
    let from = if most < PI { most.cos() } else { f64::NEG_INFINITY };
    let to = if least > 0.0 { least.cos() } else { f64::INFINITY };
    from..=to
}

/// Equal bins for an angle from 0 to π, told by its cosine: arc cosines would take most of the time.
struct Bins {
    /// Cosines of the angles at which all bins but the first begin.
    begin: [f64; BINS - 1],
}

impl Bins {
    fn new() -> Self {
        Self {
            begin: std::array::from_fn(|k| (PI * (k + 1) as f64 / BINS as f64).cos()),
        }
    }

    fn of(&self, cosine: f64) -> usize {
        self.begin.iter().map(|&begin| usize::from(cosine <= begin)).sum()
    }
}

/// The mean over about `count` sites of |cos| (1 − (distance / limit)²), cos being that of the angle between
/// the normals, over the sites that face the original's way or over those that face the opposite way,
/// whichever is more.
fn score(original: &Sampled, sites: &[Site], pose: &Similarity, diagonal: f64, count: usize) -> f64 {
    let (limit, rotation) = (NEAR * pose.scale * diagonal, Mat3::from(pose.rotation));
    let mut sums = [0.0_f64; 2];
    let picked = sites.iter().step_by((sites.len() / count).max(1));
    for site in picked.clone() {
        let near = original
            .near(pose.apply(site.point))
            .filter(|(_, distance)| *distance < limit);
        if let Some((sample, distance)) = near {
            let cosine = (rotation * site.normal).dot(original.normal(sample));
            sums[usize::from(cosine < 0.0)] += cosine.abs() * (1.0 - (distance / limit).powi(2));
        }
    }
    sums[0].max(sums[1]) / picked.len().max(1) as f64
}

/// The first `count` poses that move the suspect to places clearly apart.
fn distinct(
    poses: impl Iterator<Item = Similarity>,
    suspect: &Sampled,
    diagonal: f64,
    count: usize,
) -> Vec<Similarity> {
    let marks: Vec<Vec3> = suspect.some(8).map(|i| suspect.points[i]).collect();
    let mut kept: Vec<Similarity> = Vec::new();
    for pose in poses {
        let moved = |other: &Similarity, p: Vec3| (pose.apply(p) - other.apply(p)).norm();
        let apart = |other: &Similarity| marks.iter().any(|&p| moved(other, p) > APART * diagonal);
        if kept.iter().all(apart) {
            kept.push(pose);
            if kept.len() == count {
                break;
            }
        }
    }
    kept
}
