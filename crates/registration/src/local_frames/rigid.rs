//! Parts of a region that were moved as a whole.
//!
//! What somebody drags or poses often leaves much as it was: a limb that turned, the rest of a figure whose ear was pulled. There y = s R (x + δ) + t is known by seven numbers. Such parts are found by consensus (Fischler and Bolles 1981):
//! the similarity of a few vertices that lie together is fitted again and again to all that it meets, and what it meets in the end is a part if no more is left there than noise. It may still be bent by as much as that. A polynomial of
//! degree 2 over all of the part follows such a bend; what it leaves is seen, which is nearly all of δ.

use mesh::{Edges, TriMesh, Vec3, VertexStars};

use super::{
    fit::{Around, QUADRATIC, RIDGE, cholesky, constants_free, monomials, similarity, solve},
    windows::spread,
};
use crate::matrix::Mat3;

/// A part.
pub(super) struct RigidPart {
    /// Its vertices, and what a polynomial of degree 2 over them leaves of where each was beside its place before the whole was moved: δᵢ − Σⱼ sᵢⱼ δⱼ.
    pub(super) beside: Vec<(usize, Vec3)>,
    /// j and sᵢⱼ of each of these vertices.
    pub(super) shares: Vec<Vec<(u32, f32)>>,
}

/// Vertices around a seed by which its part is first known.
const SEED: usize = 24;

/// So many seeds are tried, each as far from the others as can be.
const SEEDS: usize = 100;

/// How often a part and its similarity follow from each other.
const ROUNDS: usize = 6;

/// So many times as far off as noise, a vertex belongs to no part; twice as far in the first two rounds.
const TOLERANCE: f64 = 3.0;

/// A polynomial is fitted to about so many of a part's vertices: it has ten unknowns.
const FITTED: usize = 200;

/// A part of which more is left than so many times the noise is bent.
const BENT: f64 = 1.25;

/// Parts have at least so many vertices, and so large a share of those that are seen.
const FEWEST: usize = 30;
const LEAST_SHARE: f64 = 0.05;

/// More parts of one region are not looked for.
const MOST_PARTS: usize = 8;

/// The parts of a region, the largest first, given where its vertices are seen, about how far they lie beside what was moved as a whole, and −1 for mirrored suspects.
pub(super) fn parts(region: &TriMesh, seen: &[Option<[f64; 3]>], noise: f64, hand: f64) -> Vec<RigidPart> {
    let around = Edges::of(region).neighbours();
    let mut free: Vec<usize> = (0..seen.len()).filter(|&v| seen[v].is_some()).collect();
    let fewest = FEWEST.max((LEAST_SHARE * free.len() as f64) as usize);
    let mut parts = Vec::new();
    while parts.len() < MOST_PARTS && free.len() >= fewest {
        let search = Search {
            region,
            seen,
            free: &free,
            noise,
            hand,
        };
        let mut is_free = vec![false; seen.len()];
        free.iter().for_each(|&v| is_free[v] = true);
        let found = spread(region, &is_free, SEEDS)
            .into_iter()
            .filter_map(|seed| search.grown_from(seed as usize, &around))
            .filter(|part| part.len() >= fewest)
            .max_by_key(Vec::len);
        let Some(found) = found.and_then(|part| search.straightened(&part)) else {
            break;
        };
        found.beside.iter().for_each(|&(v, _)| is_free[v] = false);
        free.retain(|&v| is_free[v]);
        parts.push(found);
    }
    parts
}

/// Where parts are looked for.
struct Search<'a> {
    region: &'a TriMesh,
    seen: &'a [Option<[f64; 3]>],
    /// Vertices that are seen, and belong to no part.
    free: &'a [usize],
    noise: f64,
    hand: f64,
}

impl Search<'_> {
    /// The part around a vertex, with where each of its vertices is beside its place; none where something bent it.
    fn grown_from(&self, seed: usize, neighbours: &VertexStars) -> Option<Vec<(usize, Vec3)>> {
        let centre = self.region.point(seed);
        let apart = |&v: &usize| (self.region.point(v) - centre).squared();
        let mut part = self.free.to_vec();
        if part.len() > SEED {
            part.select_nth_unstable_by(SEED, |a, b| apart(a).total_cmp(&apart(b)));
            part.truncate(SEED);
        }
        let mut beside = Vec::new();
        for round in 0..ROUNDS {
            if part.len() < SEED / 2 {
                return None;
            }
            let tolerance = self.noise * TOLERANCE * if round < 2 { 2.0 } else { 1.0 };
            beside = self.beside(&part)?;
            beside.retain(|(_, beside)| beside.norm() < tolerance);
            part = beside.iter().map(|&(v, _)| v).collect();
        }
        // What lies at the edge of a part may be bent already.
        let mut is_inside = vec![false; self.seen.len()];
        part.iter().for_each(|&v| is_inside[v] = true);
        beside.retain(|&(v, _)| neighbours.of(v).iter().all(|&other| is_inside[other as usize]));
        let squares: f64 = beside.iter().map(|(_, beside)| beside.squared()).sum();
        let left = (squares / beside.len().max(1) as f64).sqrt();
        (left < BENT * self.noise).then_some(beside)
    }

    /// A part without what a polynomial of degree 2 over all of it makes of where its vertices are beside their places.
    fn straightened(&self, part: &[(usize, Vec3)]) -> Option<RigidPart> {
        let here = |v: usize| self.region.point(v);
        let middle = part.iter().map(|&(v, _)| here(v)).sum::<Vec3>() / part.len() as f64;
        let farthest = part
            .iter()
            .map(|&(v, _)| (here(v) - middle).norm())
            .fold(0.0, f64::max);
        let row = |v: usize| monomials::<QUADRATIC>((here(v) - middle) * (1.0 / farthest));
        let fitted = part.iter().step_by(part.len().div_ceil(FITTED));
        let fitted: Vec<_> = fitted.map(|&(v, beside)| (v, row(v), beside)).collect();
        let mut normal = [[0.0; QUADRATIC]; QUADRATIC];
        for (_, row, _) in &fitted {
            for i in 0..QUADRATIC {
                (0..=i).for_each(|j| normal[i][j] += row[i] * row[j]);
            }
        }
        let factor = cholesky(&normal, constants_free(RIDGE * fitted.len() as f64))?;
        let (mut beside, mut shares) = (Vec::new(), Vec::new());
        for &(v, before) in part {
            let shares_of = solve(&factor, row(v));
            let share = |row: &[f64; QUADRATIC]| row.iter().zip(&shares_of).map(|(a, b)| a * b).sum::<f64>();
            let mut left = before;
            let mut own = Vec::with_capacity(fitted.len());
            for (other, row, beside) in &fitted {
                let share = share(row);
                left -= *beside * share;
                own.push((*other as u32, share as f32));
            }
            beside.push((v, left));
            shares.push(own);
        }
        Some(RigidPart { beside, shares })
    }

    /// All free vertices, and what they have beside where the best similarity of some has them, in the region's unit.
    fn beside(&self, part: &[usize]) -> Option<Vec<(usize, Vec3)>> {
        let here = |v: usize| self.region.point(v);
        let there = |v: usize| Vec3(self.seen[v].unwrap_or_default());
        let pairs: Vec<Around> = part.iter().map(|&v| (v as u32, 1.0, here(v), there(v))).collect();
        let motion = similarity(&pairs, pairs.len() as f64, self.hand);
        let back = inverse_of_similarity(&motion)?;
        let mean = |of: &dyn Fn(usize) -> Vec3| {
            let sum: Vec3 = part.iter().map(|&v| of(v)).sum();
            sum * (1.0 / part.len() as f64)
        };
        let (here_mean, there_mean) = (mean(&here), mean(&there));
        let beside = |&v: &usize| (v, back * (there(v) - there_mean) - (here(v) - here_mean));
        Some(self.free.iter().map(beside).collect())
    }
}

/// (s R)⁻¹ = (s R)ᵀ / s².
fn inverse_of_similarity(motion: &Mat3) -> Option<Mat3> {
    let scale = motion.0.iter().map(|row| row.squared()).sum::<f64>() / 3.0;
    let Mat3(rows) = motion.transposed();
    scale
        .is_normal()
        .then(|| Mat3(rows.map(|row| row * (1.0 / scale))))
}
