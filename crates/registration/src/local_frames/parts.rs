//! Parts of a region whose move is known by a few numbers.
//!
//! What somebody drags or poses often leaves much as it was: a limb that turned, the rest of a figure whose ear was pulled. There y = s R (x + δ) + t is known by seven numbers, and all of δ is seen.
//!
//! Where a brush or an edit with a falloff pulled, y = A (x + δ) + t + w d: the way d is the same for all vertices, and how far each went along it, w, is anybody's guess. But across the way nothing happened: for each n across d a linear relation n·y = a·x + c holds, and what is left of it is a·δ for a = Aᵀ n. Two such relations see all of
//! δ but what lies along A⁻¹ d, which is hidden.
//!
//! Parts are found by consensus (Fischler and Bolles 1981): the similarity, or the two best relations, of a few vertices that lie together are fitted again and again to all that they meet, and what they meet in the end is a part if no more is
//! left there than noise. It may still be bent by as much as that. A polynomial of degree 2 over all of the part follows such a bend; what it leaves is seen, which is nearly all of δ.

use faer::{Mat, Side};
use mesh::{Edges, TriMesh, Vec3, VertexStars};

use super::{
    fit::{Around, QUADRATIC, RIDGE, cholesky, constants_free, monomials, similarity, solve},
    windows::spread,
};
use crate::matrix::Mat3;

/// A part.
pub(super) struct Part {
    /// Its vertices, and what a polynomial of degree 2 over them leaves of where each was beside its place before the move: δᵢ − Σⱼ sᵢⱼ δⱼ, less what is hidden.
    pub(super) beside: Vec<(usize, Vec3)>,
    /// j and sᵢⱼ of each of these vertices.
    pub(super) shares: Vec<Vec<(u32, f32)>>,
    /// The unit vector along which nothing is seen of δ; none where all of it is.
    pub(super) hidden: Option<Vec3>,
}

/// How a part moved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Move {
    /// By a similarity.
    AsAWhole,
    /// Each vertex by as much as it may be, all along one line.
    AlongALine,
}

/// Vertices around a seed by which its part is first known.
const SEED: usize = 24;

/// So many seeds are tried, each as far from the others as can be.
const SEEDS: usize = 100;

/// How often a part and its move follow from each other.
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

/// What was pulled by less than so many times the noise was not pulled, and other relations than those that were found hold as well.
const PULLED: f64 = 3.0;

/// Relations say more of where vertices are in the suspect than this share of what they say of where they were, or the region is flat.
const FLATTEST: f64 = 0.05;

/// Where parts are looked for.
pub(super) struct Parts<'a> {
    region: &'a TriMesh,
    seen: &'a [Option<[f64; 3]>],
    /// About how far vertices lie beside what was moved.
    noise: f64,
    /// −1 for mirrored suspects.
    hand: f64,
    neighbours: VertexStars,
    /// Vertices that are seen, and belong to no part.
    free: Vec<usize>,
    fewest: usize,
}

/// A vertex, what is seen of what it has beside where a move has it, and about how far it went along the line; 0 where there is none.
type Beside = (usize, Vec3, f64);

/// What a move leaves of all vertices.
struct Left {
    beside: Vec<Beside>,
    hidden: Option<Vec3>,
}

impl<'a> Parts<'a> {
    pub(super) fn of(region: &'a TriMesh, seen: &'a [Option<[f64; 3]>], noise: f64, hand: f64) -> Self {
        let free: Vec<usize> = (0..seen.len()).filter(|&v| seen[v].is_some()).collect();
        Self {
            region,
            seen,
            noise,
            hand,
            neighbours: Edges::of(region).neighbours(),
            fewest: FEWEST.max((LEAST_SHARE * free.len() as f64) as usize),
            free,
        }
    }

    /// Takes those that moved so, the largest first.
    pub(super) fn take(&mut self, by: Move) -> Vec<Part> {
        let mut parts = Vec::new();
        while parts.len() < MOST_PARTS && self.free.len() >= self.fewest {
            let mut is_free = vec![false; self.seen.len()];
            self.free.iter().for_each(|&v| is_free[v] = true);
            let found = self
                .seeds(&is_free)
                .into_iter()
                .filter_map(|seed| self.grown_from(seed, by))
                .filter(|part| part.beside.len() >= self.fewest)
                .max_by_key(|part| part.beside.len());
            let Some(found) = found.and_then(|part| self.straightened(&part)) else {
                break;
            };
            found.beside.iter().for_each(|&(v, _)| is_free[v] = false);
            self.free.retain(|&v| is_free[v]);
            parts.push(found);
        }
        parts
    }

    /// Some free vertices around each of many.
    fn seeds(&self, is_free: &[bool]) -> Vec<Vec<usize>> {
        let around = |seed: u32| {
            let centre = self.region.point(seed as usize);
            let apart = |&v: &usize| (self.region.point(v) - centre).squared();
            let mut some = self.free.clone();
            if some.len() > SEED {
                some.select_nth_unstable_by(SEED, |a, b| apart(a).total_cmp(&apart(b)));
                some.truncate(SEED);
            }
            some
        };
        spread(self.region, is_free, SEEDS)
            .into_iter()
            .map(around)
            .collect()
    }

    /// The part that some vertices lead to, with what each of its vertices has beside its place; none where something bent it.
    fn grown_from(&self, mut part: Vec<usize>, by: Move) -> Option<Left> {
        let mut left = None;
        for round in 0..ROUNDS {
            if part.len() < SEED / 2 {
                return None;
            }
            let tolerance = self.noise * TOLERANCE * if round < 2 { 2.0 } else { 1.0 };
            let mut now = match by {
                Move::AsAWhole => self.beside_similarity(&part)?,
                Move::AlongALine => self.beside_relations(&part)?,
            };
            now.beside.retain(|(_, beside, _)| beside.norm() < tolerance);
            part = now.beside.iter().map(|&(v, ..)| v).collect();
            left = Some(now);
        }
        let mut left = left?;
        // What lies at the edge of a part may be bent already.
        let mut is_inside = vec![false; self.seen.len()];
        part.iter().for_each(|&v| is_inside[v] = true);
        let around = |v: usize| self.neighbours.of(v).iter();
        left.beside
            .retain(|&(v, ..)| around(v).all(|&other| is_inside[other as usize]));
        let rms = |of: fn(&Beside) -> f64| {
            let squares: f64 = left.beside.iter().map(of).sum();
            (squares / left.beside.len().max(1) as f64).sqrt()
        };
        let is_bent = rms(|(_, beside, _)| beside.squared()) >= BENT * self.noise;
        let is_pulled = by == Move::AsAWhole || rms(|(.., w)| w * w) > PULLED * self.noise;
        (is_pulled && !is_bent).then_some(left)
    }

    /// A part without what a polynomial of degree 2 over all of it, and how far each vertex was pulled, make of where its vertices are beside their places.
    fn straightened(&self, part: &Left) -> Option<Part> {
        const COLUMNS: usize = QUADRATIC + 1;
        let here = |v: usize| self.region.point(v);
        let vertices = || part.beside.iter().map(|&(v, ..)| v);
        let middle = vertices().map(here).sum::<Vec3>() / part.beside.len() as f64;
        let farthest = vertices().map(|v| (here(v) - middle).norm()).fold(0.0, f64::max);
        let most_pulled = part.beside.iter().map(|(.., w)| w.abs()).fold(0.0, f64::max);
        let row = |v: usize, w: f64| -> [f64; COLUMNS] {
            let monomials = monomials::<QUADRATIC>((here(v) - middle) * (1.0 / farthest));
            let pull = if most_pulled > 0.0 { w / most_pulled } else { 0.0 };
            std::array::from_fn(|i| monomials.get(i).copied().unwrap_or(pull))
        };
        let fitted = part.beside.iter().step_by(part.beside.len().div_ceil(FITTED));
        let fitted: Vec<_> = fitted.map(|&(v, beside, w)| (v, row(v, w), beside)).collect();
        let mut normal = [[0.0; COLUMNS]; COLUMNS];
        for (_, row, _) in &fitted {
            for i in 0..COLUMNS {
                (0..=i).for_each(|j| normal[i][j] += row[i] * row[j]);
            }
        }
        let factor = cholesky(&normal, constants_free(RIDGE * fitted.len() as f64))?;
        let (mut beside, mut shares) = (Vec::new(), Vec::new());
        for &(v, before, w) in &part.beside {
            let shares_of = solve(&factor, row(v, w));
            let share = |row: &[f64; COLUMNS]| row.iter().zip(&shares_of).map(|(a, b)| a * b).sum::<f64>();
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
        Some(Part {
            beside,
            shares,
            hidden: part.hidden,
        })
    }

    fn there(&self, v: usize) -> Vec3 {
        Vec3(self.seen[v].unwrap_or_default())
    }

    /// The means of some vertices' places, in the region and in the suspect.
    fn middles(&self, part: &[usize]) -> [Vec3; 2] {
        let mean = |of: &dyn Fn(usize) -> Vec3| {
            let sum: Vec3 = part.iter().map(|&v| of(v)).sum();
            sum * (1.0 / part.len() as f64)
        };
        [mean(&|v| self.region.point(v)), mean(&|v| self.there(v))]
    }

    /// What the best similarity of some vertices leaves of all that are free, in the region's unit.
    fn beside_similarity(&self, part: &[usize]) -> Option<Left> {
        let here = |v: usize| self.region.point(v);
        let pairs: Vec<Around> = part
            .iter()
            .map(|&v| (v as u32, 1.0, here(v), self.there(v)))
            .collect();
        let motion = similarity(&pairs, pairs.len() as f64, self.hand);
        let back = inverse_of_similarity(&motion)?;
        let [here_mean, there_mean] = self.middles(part);
        let beside = |&v: &usize| {
            let beside = back * (self.there(v) - there_mean) - (here(v) - here_mean);
            (v, beside, 0.0)
        };
        Some(Left {
            beside: self.free.iter().map(beside).collect(),
            hidden: None,
        })
    }

    /// What the two best linear relations of some vertices leave of all that are free: the part of δ across the line, in the region's unit.
    ///
    /// By total least squares: relations are the directions in which the places (y, x) of all vertices, as far apart in either, extend least.
    fn beside_relations(&self, part: &[usize]) -> Option<Left> {
        let [here_mean, there_mean] = self.middles(part);
        let apart = |v: usize| [self.there(v) - there_mean, self.region.point(v) - here_mean];
        let [there, here] = [0, 1].map(|i| part.iter().map(|&v| apart(v)[i].squared()).sum::<f64>());
        let scale = (here / there).sqrt();
        let place = |v: usize| -> [f64; 6] {
            let [Vec3(there), Vec3(here)] = apart(v);
            std::array::from_fn(|i| if i < 3 { there[i] * scale } else { here[i - 3] })
        };
        let mut extent = Mat::<f64>::zeros(6, 6);
        for &v in part {
            let place = place(v);
            for i in 0..6 {
                (0..=i).for_each(|j| extent[(i, j)] += place[i] * place[j]);
            }
        }
        let eigen = extent.self_adjoint_eigen(Side::Lower).ok()?;
        let way = |k: usize| -> [f64; 6] { std::array::from_fn(|i| eigen.U()[(i, k)]) };
        let [first, second, pulled] = [way(0), way(1), way(2)];
        let half = |way: &[f64; 6], start: usize| Vec3([way[start], way[start + 1], way[start + 2]]);
        let (a, b) = (-half(&first, 3), -half(&second, 3));
        let line = a.cross(b);
        let is_flat = half(&first, 0).cross(half(&second, 0)).norm() < FLATTEST * line.norm();
        if is_flat || !line.norm().is_normal() {
            return None;
        }
        // Across the line: what has the product 1 with a and 0 with b, and the other way round.
        let unit = 1.0 / line.squared();
        let (of_a, of_b) = (b.cross(line) * unit, line.cross(a) * unit);
        let beside = |&v: &usize| {
            let place = place(v);
            let along = |way: &[f64; 6]| place.iter().zip(way).map(|(x, n)| x * n).sum::<f64>();
            let beside = of_a * along(&first) + of_b * along(&second);
            (v, beside, along(&pulled))
        };
        Some(Left {
            beside: self.free.iter().map(beside).collect(),
            hidden: Some(line * (1.0 / line.norm())),
        })
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
