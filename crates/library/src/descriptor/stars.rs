//! Which vertices a file has: what is left of a tessellation where a model was cut, posed or put into a scene.
//!
//! Away from a cut a crop has the very vertices and triangles of its original. A vertex's *word* is the hash of how triangles hang together around it, by the refinement of Weisfeiler and Leman:
//! h₀(v) is the number of its triangles, and hₜ₊₁(v) hashes hₜ(v) with the sum of the hashes hₜ of its triangles' other corners. It depends on triangles t steps away at most, and on no coordinate: neither noise nor
//! rounding nor a pose changes it. Models that were made of one another have it in common; so of a vertex its *shape* is kept, too: how lengths and areas around it compare, free of scale.
//!
//! An original keeps those of its vertices that have the least words (Broder's sketch by the smallest hashes), so that a crop, of which all words are known, has those that lie in it. It keeps as many of each of its
//! [regions](super::regions), so that every crop has some, and a part that was added does not take all. Words that are rare in it come first; where triangles are regular, vertices with words that several have are kept,
//! too, since the shapes tell these apart.

use mesh::{TriMesh, Vec3};

use super::regions::{REGIONS, regions};

/// Vertices that an original keeps.
pub(crate) const STARS: usize = 192;
/// How far around a vertex one looks; farthest where triangles are so regular that there are too few words.
const STEPS: [usize; 4] = [2, 3, 4, 6];
const ENOUGH: usize = 4;
/// Models of so few vertices are looked at by single steps, too, and keep so many of these stars: of a crop's vertices most lie less than three steps from its border.
const SMALL: usize = 1024;
const OF_ONE_STEP: usize = 128;
/// Words that so few of an original's vertices have are rare, and those that more than so many have tell nothing: their shapes alone would tell them apart.
const ALIKE: usize = 2;
const MOST_ALIKE: usize = 128;
/// A suspect may have several copies of an original.
const MANY: usize = 4 * MOST_ALIKE;
/// A suspect may be a scene with much beside an original: so many of its vertices are looked up, for each number of steps.
const ASKED: usize = 8192;
/// Numbers of a shape.
pub(crate) const SHAPE: usize = 8;
/// Bytes of a star in a library.
pub(crate) const STAR: usize = 4 + SHAPE + SHAPE / 2;

/// A vertex with what is around it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Star {
    pub(crate) word: u32,
    /// Numbers of 12 bits: the upper 8 of each, then the lower 4, two in a byte.
    pub(crate) shape: [u8; SHAPE],
    rest: [u8; SHAPE / 2],
}

impl Star {
    pub(crate) fn new(word: u32, numbers: [f64; SHAPE]) -> Self {
        let numbers = numbers.map(|x| (FINE_UNITS * x).round().clamp(0.0, 4095.0) as u16);
        Self {
            word,
            shape: numbers.map(|x| (x >> 4) as u8),
            rest: std::array::from_fn(|i| ((numbers[2 * i] & 15) | (numbers[2 * i + 1] & 15) << 4) as u8),
        }
    }

    pub(crate) fn bytes(&self) -> impl Iterator<Item = u8> {
        self.word
            .to_le_bytes()
            .into_iter()
            .chain(self.shape)
            .chain(self.rest)
    }

    pub(crate) fn of(bytes: &[u8; STAR]) -> Self {
        Self {
            word: u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
            shape: std::array::from_fn(|i| bytes[4 + i]),
            rest: std::array::from_fn(|i| bytes[4 + SHAPE + i]),
        }
    }

    /// A number of its shape, of 12 bits.
    fn number(&self, i: usize) -> u16 {
        let rest = self.rest[i / 2] >> (4 * (i % 2)) & 15;
        u16::from(self.shape[i]) << 4 | u16::from(rest)
    }

    /// Whether the other has the very shape, but for a file's rounding.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        let differences = (0..SHAPE).map(|i| self.number(i).abs_diff(other.number(i)));
        differences.sum::<u16>() <= SAME
    }

    /// The sums of every second number: of shapes that are the same they differ by [`SAME`] at most.
    pub(crate) fn sums(&self) -> [u16; 2] {
        [0, 1].map(|first| (first..SHAPE).step_by(2).map(|i| self.number(i)).sum())
    }
}

/// The stars that an original keeps, sorted.
pub(super) fn of_original(mesh: &TriMesh) -> Vec<Star> {
    let regions = regions(mesh);
    // Of a single step, and of more.
    let mut offered: [Vec<Vec<Offered>>; 2] = std::array::from_fn(|_| vec![Vec::new(); REGIONS]);
    refined(mesh, |step, words| {
        let offered = &mut offered[usize::from(step > 1)];
        for alike in words.chunk_by(|a, b| a.0 == b.0) {
            let rank = match alike.len() {
                0..=ALIKE => step,
                repeated => STEPS[STEPS.len() - 1] + repeated,
            };
            for &(word, vertex) in alike.iter().filter(|_| alike.len() <= MOST_ALIKE) {
                offered[regions[vertex as usize] as usize].push(Offered { rank, word, vertex });
            }
        }
        let has_enough = |offered: &Vec<Offered>| {
            offered.iter().filter(|offered| offered.rank <= step).count() >= STARS / REGIONS
        };
        step < ENOUGH || !offered.iter().all(has_enough)
    });
    let [of_one_step, of_more] = offered;
    let mut kept = chosen(of_one_step, OF_ONE_STEP);
    kept.extend(chosen(of_more, STARS - kept.len()));
    stars(mesh, &kept)
}

/// A vertex that may be kept; the least are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Offered {
    /// Of rare words that of fewer steps comes first, of others that which fewer vertices have.
    rank: usize,
    word: u32,
    vertex: u32,
}

/// So many of the vertices that regions offer, each with its first word: of every region as many, and of the rest the least.
fn chosen(offered: Vec<Vec<Offered>>, most: usize) -> Vec<(u32, u32)> {
    let (mut kept, mut rest) = (Vec::new(), Vec::new());
    for mut offered in offered {
        offered.sort_unstable_by_key(|offered| (offered.vertex, *offered));
        offered.dedup_by_key(|offered| offered.vertex);
        offered.sort_unstable();
        rest.extend(offered.split_off((most / REGIONS).min(offered.len())));
        kept.extend(offered);
    }
    rest.sort_unstable();
    rest.truncate(most - kept.len());
    kept.extend(rest);
    kept.iter()
        .map(|offered| (offered.word, offered.vertex))
        .collect()
}

/// The stars of a suspect that are looked up, sorted.
pub(super) fn of_suspect(mesh: &TriMesh) -> Vec<Star> {
    let mut asked = Vec::new();
    refined(mesh, |_, words| {
        asked.extend_from_slice(words);
        true
    });
    stars(mesh, &asked)
}

/// Hands over the least words of a mesh with their vertices, sorted, for one number of steps after the other while more are asked for.
fn refined(mesh: &TriMesh, mut take: impl FnMut(usize, &[(u32, u32)]) -> bool) {
    let count = mesh.vertex_count();
    let mut hashes = vec![0_u64; count];
    let used = mesh.used_vertices();
    mesh.triangles()
        .iter()
        .flatten()
        .for_each(|&v| hashes[v as usize] += 1);
    for step in 1..=STEPS[STEPS.len() - 1] {
        let others: Vec<u64> = hashes.iter().map(|&hash| mixed(hash)).collect();
        for &[a, b, c] in mesh.triangles() {
            let [a, b, c] = [a, b, c].map(|v| v as usize);
            for (v, w, x) in [(a, b, c), (b, c, a), (c, a, b)] {
                hashes[v] = hashes[v].wrapping_add(others[w]).wrapping_add(others[x]);
            }
        }
        hashes
            .iter_mut()
            .for_each(|hash| *hash = mixed(*hash ^ step as u64));
        if STEPS.contains(&step) || (step == 1 && count <= SMALL) {
            let words = (0..count).filter(|&v| used[v]);
            let words = words.map(|v| ((hashes[v] >> 32) as u32, v as u32)).collect();
            if !take(step, &least(words)) {
                return;
            }
        }
    }
}

/// The least words that tell something, [`ASKED`] of them, sorted.
fn least(mut words: Vec<(u32, u32)>) -> Vec<(u32, u32)> {
    let mut kept: Vec<(u32, u32)> = Vec::new();
    let mut count = ASKED;
    while !words.is_empty() && kept.len() < ASKED {
        // The least of what is left; where a grid's vertices are all alike there is much to pass over.
        let mut rest = match count < words.len() {
            true => {
                words.select_nth_unstable(count);
                words.split_off(count)
            }
            false => Vec::new(),
        };
        if let Some(&(last, _)) = words.iter().max() {
            words.extend(rest.iter().filter(|(word, _)| *word == last));
            rest.retain(|(word, _)| *word != last);
        }
        words.sort_unstable();
        let telling = words.chunk_by(|a, b| a.0 == b.0);
        kept.extend(telling.filter(|alike| alike.len() <= MANY).flatten());
        words = rest;
        count *= 2;
    }
    kept.truncate(ASKED);
    kept
}

/// The finaliser of Steele, Lea and Flood's SplitMix64.
fn mixed(mut x: u64) -> u64 {
    x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// Sums over a vertex's triangles.
#[derive(Clone, Copy, Default)]
struct Fan {
    triangles: f64,
    /// Of the edges to it, and their squares: each is in two triangles.
    lengths: f64,
    squares: f64,
    /// Of the edges across.
    rim: f64,
    areas: f64,
    /// Of the other corners from it.
    mean: Vec3,
}

/// A fan free of scale.
#[derive(Clone, Copy, Default)]
struct Shape {
    /// The mean edge, and the mean area.
    edge: f64,
    area: f64,
    /// In mean edges: their spread, the edges across, how far the vertex lies from the mean of its neighbours.
    spread: f64,
    rim: f64,
    off: f64,
}

impl Fan {
    fn shape(&self) -> Shape {
        let n = self.triangles.max(1.0);
        let edge = self.lengths / (2.0 * n);
        let unit = edge.max(f64::MIN_POSITIVE);
        Shape {
            edge,
            area: self.areas / n,
            spread: (self.squares / (2.0 * n) - edge * edge).max(0.0).sqrt() / unit,
            rim: self.rim / n / unit,
            off: self.mean.norm() / (2.0 * n) / unit,
        }
    }
}

/// The shapes of some vertices with their words, sorted.
fn stars(mesh: &TriMesh, chosen: &[(u32, u32)]) -> Vec<Star> {
    // Any finite coordinates are legal, and squares of large ones are not finite.
    let bounds = mesh.bounding_box();
    let extent = (0..3).fold(0.0_f64, |most, axis| {
        most.max(bounds.max[axis] / 2.0 - bounds.min[axis] / 2.0)
    });
    let scale = if extent > 0.0 { 1.0 / extent } else { 1.0 };
    let mut is_chosen = vec![false; mesh.vertex_count()];
    chosen.iter().for_each(|&(_, v)| is_chosen[v as usize] = true);
    let touches = |is: &[bool], corners: &[u32; 3]| corners.iter().any(|&v| is[v as usize]);
    let mut is_near = vec![false; mesh.vertex_count()];
    for corners in mesh
        .triangles()
        .iter()
        .filter(|corners| touches(&is_chosen, corners))
    {
        corners.iter().for_each(|&v| is_near[v as usize] = true);
    }
    let mut fans = vec![Fan::default(); mesh.vertex_count()];
    for corners in mesh
        .triangles()
        .iter()
        .filter(|corners| touches(&is_near, corners))
    {
        let points = corners.map(|v| Vec3(mesh.point(v as usize).0.map(|x| x * scale)));
        let edge = |i: usize| points[(i + 1) % 3] - points[i % 3];
        let lengths: [f64; 3] = std::array::from_fn(|i| edge(i).norm());
        let area = edge(0).cross(edge(1)).norm();
        for i in 0..3 {
            let fan = &mut fans[corners[i] as usize];
            let (out, back) = (lengths[i], lengths[(i + 2) % 3]);
            fan.triangles += 1.0;
            fan.lengths += out + back;
            fan.squares += out * out + back * back;
            fan.rim += lengths[(i + 1) % 3];
            fan.areas += area;
            fan.mean += edge(i) - edge(i + 2);
        }
    }
    let mut rings = vec![(0.0, Shape::default()); mesh.vertex_count()];
    for corners in mesh
        .triangles()
        .iter()
        .filter(|corners| touches(&is_chosen, corners))
    {
        for i in 0..3 {
            let (count, ring) = &mut rings[corners[i] as usize];
            for other in [corners[(i + 1) % 3], corners[(i + 2) % 3]] {
                let shape = fans[other as usize].shape();
                *count += 1.0;
                ring.edge += shape.edge;
                ring.area += shape.area;
                ring.spread += shape.spread;
                ring.off += shape.off;
            }
        }
    }
    let star = |&(word, v): &(u32, u32)| {
        let own = fans[v as usize].shape();
        let (count, ring) = rings[v as usize];
        let quotient = |a: f64, b: f64| {
            let quotient =
                (a.max(f64::MIN_POSITIVE) / (b / f64::max(count, 1.0)).max(f64::MIN_POSITIVE)).ln();
            1.0 + quotient
        };
        let mean = |sum: f64| sum / f64::max(count, 1.0);
        let square = (own.edge * own.edge).max(f64::MIN_POSITIVE);
        let numbers = [
            quotient(own.edge, ring.edge),
            quotient(own.area, ring.area),
            own.spread,
            own.rim - 0.5,
            2.0 * own.off,
            own.area / square,
            mean(ring.spread),
            2.0 * mean(ring.off),
        ];
        Star::new(word, numbers)
    };
    let mut stars: Vec<Star> = chosen.iter().map(star).collect();
    stars.sort_unstable();
    stars
}

/// Steps of 12 bits in 1; a byte has 128.
const FINE_UNITS: f64 = 2048.0;
/// Shapes are the same whose numbers differ by no more, in all: what single precision rounds is less, and what sets two models of the same triangles apart is nearly always more.
pub(crate) const SAME: u16 = 8;

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::{Similarity, Welded, shapes};
    use proptest::prelude::*;

    fn irregular(seed: u64) -> TriMesh {
        shapes::flipped(&shapes::bumpy_sphere(4, seed), seed)
    }

    /// How many of an original's stars a suspect has, with the same shapes.
    fn shared(original: &TriMesh, suspect: &TriMesh) -> usize {
        let asked = of_suspect(suspect);
        let is_asked = |star: &&Star| {
            asked
                .iter()
                .any(|other| other.word == star.word && other.is_same(star))
        };
        of_original(original).iter().filter(is_asked).count()
    }

    /// What is left of a mesh beyond a plane, above which so large a share of its vertices lies.
    fn cropped(mesh: &TriMesh, direction: Vec3, share: f64) -> TriMesh {
        let mut heights: Vec<f64> = mesh.positions().iter().map(|&p| Vec3(p).dot(direction)).collect();
        heights.sort_by(f64::total_cmp);
        let limit = heights[((1.0 - share) * heights.len() as f64) as usize];
        let is_kept = |corners: &&[u32; 3]| {
            corners
                .iter()
                .all(|&v| mesh.point(v as usize).dot(direction) >= limit)
        };
        let kept: Vec<[u32; 3]> = mesh.triangles().iter().filter(is_kept).copied().collect();
        Welded::new(mesh.positions(), &kept).unwrap().into_mesh()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(16))]

        #[test]
        fn neither_numbering_nor_a_similarity_nor_rounding_changes_stars(seed in 0..50_u64, angles in prop::array::uniform4(-1.0..1.0_f64), scale in 1e-2..1e2_f64) {
            prop_assume!(angles.iter().map(|x| x * x).sum::<f64>() > 0.01);
            let mesh = irregular(seed);
            let transform = Similarity { scale, translation: [3.0, -2.0, 5.0], ..Similarity::from_quaternion(angles) };
            let moved = shapes::moved(&shapes::shuffled(&mesh, seed), &transform);
            // A file of single precision.
            let rounded = moved.positions().iter().map(|p| p.map(|x| f64::from(x as f32))).collect();
            let moved = moved.with_positions(rounded).unwrap();
            prop_assert_eq!(of_original(&mesh).len(), STARS);
            prop_assert_eq!(shared(&mesh, &moved), STARS);
        }

        #[test]
        fn noise_changes_no_word(seed in 0..50_u64) {
            let mesh = irregular(seed);
            let asked = of_suspect(&shapes::jittered(&mesh, 0.3, seed));
            let is_asked = |star: &Star| asked.iter().any(|other| other.word == star.word);
            prop_assert!(of_original(&mesh).iter().all(is_asked));
        }

        #[test]
        fn what_is_left_of_a_model_has_its_stars_away_from_the_cut(seed in 0..50_u64, direction in prop::array::uniform3(-1.0..1.0_f64)) {
            prop_assume!(Vec3(direction).norm() > 0.1);
            let mesh = irregular(seed);
            for (share, least) in [(0.5, STARS / 4), (0.25, STARS / 16)] {
                let count = shared(&mesh, &cropped(&mesh, Vec3(direction).unit(), share));
                prop_assert!(count > least, "{count} of {STARS}");
            }
        }

        #[test]
        fn so_has_a_quarter_of_a_small_one(seed in 0..50_u64, direction in prop::array::uniform3(-1.0..1.0_f64)) {
            prop_assume!(Vec3(direction).norm() > 0.1);
            let mesh = shapes::flipped(&shapes::bumpy_sphere(3, seed), seed);
            let count = shared(&mesh, &cropped(&mesh, Vec3(direction).unit(), 0.25));
            prop_assert!(count > 8, "{count} of {STARS}");
        }

        #[test]
        fn each_of_two_parts_has_stars(seed in 0..50_u64) {
            // Of one all words are rare, of the other none.
            let parts = [irregular(seed), shapes::scaled(&shapes::bumpy_sphere(4, seed), 0.2)];
            let both = shapes::disjoint_union(&parts);
            for part in parts {
                let count = shared(&both, &part);
                prop_assert!(count > STARS / 8, "{count}");
            }
        }
    }

    #[test]
    fn a_grid_without_a_vertex_of_its_own_has_no_stars() {
        assert!(of_original(&shapes::torus(40, 20, 1.0, 0.3)).is_empty());
    }

    #[test]
    fn stars_are_read_as_they_were_written() {
        for star in of_original(&irregular(3)) {
            let bytes: Vec<u8> = star.bytes().collect();
            assert_eq!(Star::of(&bytes.try_into().unwrap()), star);
        }
    }
}
