//! Guesses for a suspect of which much is missing and no vertex survived: congruent sets of oriented points.
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
//! 10⁶ pairs for a base (measured on half a horse of 202 sites: 100 000 guesses from its rarest bases, 590 of
//! them within 15 % of the diagonal of the right pose).

use crate::sampled::{GRAIN, Sampled};
use crate::vector::{Mat3, Vec3, add, apply, cross, dot, norm, product, scaled, squared, sub, transposed};
use job::{Job, JobError};
use mesh::Similarity;
use std::f64::consts::PI;

/// Sites on the original, close enough together that every site of a suspect has one nearby.
const SITES: usize = 1_000;

/// Sites on the suspect.
const SUSPECT_SITES: usize = 300;

/// Samples that agree on a site's normal lie within this fraction of the diagonal.
const NEIGHBOURHOOD: f64 = 0.03;

/// Pairs of the suspect that bases are chosen from, bases, and guesses made from them.
const PAIRS: usize = 20_000;
const BASES: usize = 300;
const GUESSES: usize = 100_000;

/// The points of a base are at least this fraction of the suspect's diagonal apart.
const NARROWEST: f64 = 0.2;

/// The least |m·(d × n)|: below, a pair does not fix its frame well.
const TWISTED: f64 = 0.25;

/// Bins for each of the three angles.
const BINS: usize = 16;

/// Partners agree in each angle to this many radians.
const ALIKE: f64 = 0.14;

/// A guess must bring sites this near, as a fraction of the moved suspect's diagonal.
const NEAR: f64 = 0.08;

/// Sites that all guesses are scored by at first, guesses that are scored again, and sites for that.
const FIRST_LOOK: usize = 10;
const SECOND_LOOKS: usize = 2_000;
const SECOND_LOOK: usize = 100;

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
    /// Between first normal and direction, second normal and direction, and both normals.
    angles: Vec3,
    twist: f64,
}

/// The `count` best guesses.
pub(crate) fn guesses(
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
        .filter(|guess| plausible(guess, original, suspect))
        .take(GUESSES)
        .collect();
    job.go_on()?;
    let glanced = ranked(
        candidates,
        |guess| score(original, &sites, guess, suspect.diagonal, FIRST_LOOK),
        job,
    )?;
    let promising = glanced.into_iter().take(SECOND_LOOKS).collect();
    let looked = ranked(
        promising,
        |guess| score(original, &sites, guess, suspect.diagonal, SECOND_LOOK),
        job,
    )?;
    Ok(distinct(looked.into_iter(), suspect, original.diagonal, count))
}

/// The widest twisted pairs of the suspect that have partners, those with the fewest first.
fn bases(index: &Index, sites: &[Site], diagonal: f64) -> Vec<Pair> {
    let mut wide: Vec<(f64, Pair)> = Vec::new();
    for (i, j) in spread_pairs(sites.len()) {
        let apart = norm(sub(sites[j].point, sites[i].point));
        let pair = Pair::of(sites[i], sites[j]).filter(|pair| pair.twist.abs() > TWISTED);
        wide.extend(
            pair.filter(|_| apart >= NARROWEST * diagonal)
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

/// Guesses by descending score.
fn ranked(
    guesses: Vec<Similarity>,
    score: impl Fn(&Similarity) -> f64 + Sync + Send,
    job: &Job,
) -> Result<Vec<Similarity>, JobError> {
    let scores = job.map(guesses.len(), GRAIN, |i| score(&guesses[i]))?;
    let mut order: Vec<usize> = (0..guesses.len()).collect();
    order.sort_by(|&i, &j| scores[j].total_cmp(&scores[i]));
    Ok(order.into_iter().map(|i| guesses[i]).collect())
}

/// Sites with their normals, without those where the surface bends too much to have one.
fn sites(of: &Sampled, count: usize, job: &Job) -> Result<Vec<Site>, JobError> {
    let picked: Vec<usize> = of.some(count).collect();
    let radius = (NEIGHBOURHOOD * of.diagonal).powi(2);
    let normal = |i: usize| of.normals[of.triangles[i] as usize];
    let sites = job.map(picked.len(), GRAIN, |k| {
        let (point, own) = (of.points[picked[k]], normal(picked[k]));
        let near = (0..of.points.len()).filter(|&i| squared(sub(of.points[i], point)) < radius);
        let facing = near.map(normal).filter(|&n| dot(n, own) > 0.0);
        let (sum, count) = facing.fold(([0.0; 3], 0.0), |(sum, count), n| (add(sum, n), count + 1.0));
        let length = norm(sum);
        (length > 0.85 * count && count > 0.0).then(|| Site {
            point,
            normal: scaled(sum, 1.0 / length),
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
        let difference = sub(second.point, first.point);
        let length = norm(difference);
        if length == 0.0 {
            return None;
        }
        let d = scaled(difference, 1.0 / length);
        let (m, n) = (first.normal, second.normal);
        let angle = |a: Vec3, b: Vec3| dot(a, b).clamp(-1.0, 1.0).acos();
        Some(Self {
            first,
            second,
            angles: [angle(m, d), angle(n, d), angle(m, n)],
            twist: dot(m, cross(d, n)),
        })
    }

    /// The same pair on the surface turned inside out.
    fn turned(&self) -> Self {
        let turned = |site: Site| Site {
            normal: scaled(site.normal, -1.0),
            ..site
        };
        let [a, b, c] = self.angles;
        Self {
            first: turned(self.first),
            second: turned(self.second),
            angles: [PI - a, PI - b, c],
            twist: self.twist,
        }
    }

    /// An orthonormal frame that moves with the pair: along it, along what its normals have in common across
    /// it, and the third direction, on the side that the twist gives.
    fn frame(&self) -> Mat3 {
        let unit = |v: Vec3| scaled(v, 1.0 / norm(v).max(f64::MIN_POSITIVE));
        let d = unit(sub(self.second.point, self.first.point));
        let across = |n: Vec3| unit(sub(n, scaled(d, dot(n, d))));
        let middle = unit(add(across(self.first.normal), across(self.second.normal)));
        [d, middle, scaled(cross(d, middle), self.twist.signum())]
    }
}

/// The similarity that takes one pair to another; a mirror when their twists differ in sign.
fn onto(from: &Pair, to: &Pair) -> Similarity {
    let length = |pair: &Pair| norm(sub(pair.second.point, pair.first.point));
    let middle = |pair: &Pair| scaled(add(pair.first.point, pair.second.point), 0.5);
    let scale = length(to) / length(from);
    let rotation = product(&transposed(&to.frame()), &from.frame());
    let translation = sub(middle(to), scaled(apply(&rotation, middle(from)), scale));
    Similarity {
        scale,
        rotation,
        translation,
    }
}

/// Whether a guess leaves the suspect neither much larger than the original nor a dot on it.
fn plausible(guess: &Similarity, original: &Sampled, suspect: &Sampled) -> bool {
    (0.15..1.1).contains(&(guess.scale * suspect.diagonal / original.diagonal))
}

/// The pairs of the original's sites, filed under their angles.
struct Index {
    sites: Vec<Site>,
    pairs: Vec<[u16; 2]>,
    starts: Vec<usize>,
}

impl Index {
    fn of(sites: Vec<Site>) -> Self {
        let mut filed: Vec<(usize, [u16; 2])> = Vec::new();
        for (i, &first) in sites.iter().enumerate() {
            for (j, &second) in sites.iter().enumerate() {
                let pair = if i == j { None } else { Pair::of(first, second) };
                if let Some(pair) = pair.filter(|pair| pair.twist.abs() > 0.5 * TWISTED) {
                    let [a, b, c] = pair.angles.map(bin);
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
        }
    }

    /// The pairs whose angles are like those of another.
    fn partners<'a>(&'a self, base: &'a Pair) -> impl Iterator<Item = Pair> + 'a {
        let [a, b, c] = base.angles.map(|angle| bin(angle - ALIKE)..=bin(angle + ALIKE));
        let bins = a.flat_map(move |a| {
            let c = c.clone();
            b.clone()
                .flat_map(move |b| c.clone().map(move |c| (a * BINS + b) * BINS + c))
        });
        let filed = bins.flat_map(|bin| &self.pairs[self.starts[bin]..self.starts[bin + 1]]);
        let pairs =
            filed.filter_map(|&[i, j]| Pair::of(self.sites[usize::from(i)], self.sites[usize::from(j)]));
        pairs.filter(|pair| (0..3).all(|k| (pair.angles[k] - base.angles[k]).abs() <= ALIKE))
    }
}

fn bin(angle: f64) -> usize {
    // A negative angle saturates to bin 0.
    ((angle / PI * BINS as f64) as usize).min(BINS - 1)
}

/// The mean over about `count` sites of |cos| (1 − (distance / limit)²), cos being that of the angle between
/// the normals, over the sites that face the original's way or over those that face the opposite way,
/// whichever is more.
fn score(original: &Sampled, sites: &[Site], guess: &Similarity, diagonal: f64, count: usize) -> f64 {
    let limit = NEAR * guess.scale * diagonal;
    let mut sums = [0.0_f64; 2];
    let picked = sites.iter().step_by((sites.len() / count).max(1));
    for site in picked.clone() {
        let near = original
            .near(guess.apply(site.point))
            .filter(|(_, distance)| *distance < limit);
        if let Some((sample, distance)) = near {
            let normal = apply(&guess.rotation, site.normal);
            let cosine = dot(normal, original.normals[original.triangles[sample] as usize]);
            sums[usize::from(cosine < 0.0)] += cosine.abs() * (1.0 - (distance / limit).powi(2));
        }
    }
    sums[0].max(sums[1]) / picked.len().max(1) as f64
}

/// The first `count` guesses that move the suspect to places clearly apart.
fn distinct(
    guesses: impl Iterator<Item = Similarity>,
    suspect: &Sampled,
    diagonal: f64,
    count: usize,
) -> Vec<Similarity> {
    let marks: Vec<Vec3> = suspect.some(8).map(|i| suspect.points[i]).collect();
    let mut kept: Vec<Similarity> = Vec::new();
    for guess in guesses {
        let apart = |other: &Similarity| {
            marks
                .iter()
                .any(|&p| norm(sub(guess.apply(p), other.apply(p))) > 0.05 * diagonal)
        };
        if kept.iter().all(apart) {
            kept.push(guess);
            if kept.len() == count {
                break;
            }
        }
    }
    kept
}
