use super::plain::{block, built, icosphere, torus};
use crate::{Edges, TriMesh, Vec3};
use std::collections::HashSet;
use std::f64::consts::TAU;

/// A sphere with smooth bumps and an irregular net: [`icosphere`], jittered, flipped, bumped.
pub fn bumpy_sphere(level: u32, seed: u64) -> TriMesh {
    let sphere = jittered(&icosphere(level), 0.15, seed);
    bumped(&flipped(&sphere, seed), 0.25, seed)
}

/// A torus (R = 1, r = 0.4) with smooth bumps and an irregular net.
pub fn bumpy_torus(nu: u32, nv: u32, seed: u64) -> TriMesh {
    let torus = jittered(&torus(nu, nv, 1.0, 0.4), 0.15, seed);
    bumped(&flipped(&torus, seed), 0.25, seed)
}

/// A rounded [`block`] with `holes` holes, smooth bumps and an irregular net; two holes at resolution 6 have 1 798 vertices.
pub fn bumpy_block(holes: u32, resolution: u32, seed: u64) -> TriMesh {
    let rounded = smoothed(&block(holes, resolution), resolution);
    bumped(&flipped(&jittered(&rounded, 0.15, seed), seed), 0.25, seed)
}

/// `n` triangles of size about 1 in a box of side 10, none with a vertex of another.
pub fn soup(n: u32, seed: u64) -> TriMesh {
    let mut random = Random::new(seed);
    let mut positions = Vec::new();
    for _ in 0..n {
        let centre = Vec3(std::array::from_fn(|_| 10.0 * random.unit()));
        positions.extend((0..3).map(|_| (centre + random.in_cube()).0));
    }
    built(positions, (0..n).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect())
}

/// The mesh with its vertices and triangles in another order, and each triangle begun at another corner.
pub fn shuffled(mesh: &TriMesh, seed: u64) -> TriMesh {
    let mut random = Random::new(seed);
    let order = random.permutation(mesh.vertex_count());
    let mut new_index = vec![0; order.len()];
    for (new, &old) in order.iter().enumerate() {
        new_index[old] = new as u32;
    }
    let positions = order.iter().map(|&old| mesh.positions()[old]).collect();
    let triangles = random.permutation(mesh.triangle_count()).into_iter().map(|t| {
        let mut triangle = mesh.triangles()[t].map(|v| new_index[v as usize]);
        triangle.rotate_left(random.below(3));
        triangle
    });
    built(positions, triangles.collect())
}

/// The mesh with each vertex moved at random along each axis, by up to `amount` of the shortest edge at that vertex.
pub fn jittered(mesh: &TriMesh, amount: f64, seed: u64) -> TriMesh {
    let mut random = Random::new(seed);
    let neighbours = mesh.neighbours();
    let moved = (0..mesh.vertex_count()).map(|v| {
        let p = mesh.point(v);
        let lengths = neighbours
            .of(v)
            .iter()
            .map(|&w| (mesh.point(w as usize) - p).norm());
        let shortest = lengths.fold(f64::INFINITY, f64::min);
        let step = random.in_cube();
        let moved = if shortest.is_finite() {
            p + amount * shortest * step
        } else {
            p
        };
        moved.into()
    });
    built(moved.collect(), mesh.triangles().to_vec())
}

/// The mesh with inner edges flipped in random order, at most one a triangle: triangles a b c and b a d become c d b and
/// d c a.
///
/// Only flips that keep a manifold a manifold and leave two triangles about as flat and not much smaller are made.
pub fn flipped(mesh: &TriMesh, seed: u64) -> TriMesh {
    let edges = Edges::of(mesh);
    let mut random = Random::new(seed);
    let mut triangles = mesh.triangles().to_vec();
    let mut touched = vec![false; triangles.len()];
    let mut created = HashSet::new();
    for e in random.permutation(edges.count()) {
        let [t, u] = *edges.triangles(e) else { continue };
        let (t, u) = (t as usize, u as usize);
        if touched[t] || touched[u] {
            continue;
        }
        let Some(new) = flip(mesh, triangles[t], triangles[u]) else {
            continue;
        };
        let [c, d, _] = new[0];
        if edges.find(c, d).is_none() && created.insert([c.min(d), c.max(d)]) {
            [triangles[t], triangles[u]] = new;
            (touched[t], touched[u]) = (true, true);
        }
    }
    built(mesh.positions().to_vec(), triangles)
}

/// The two triangles on the other diagonal, [c, d, b] and [d, c, a], if the four corners are about flat and well convex.
fn flip(mesh: &TriMesh, first: [u32; 3], second: [u32; 3]) -> Option<[[u32; 3]; 2]> {
    let i = (0..3).find(|&i| !second.contains(&first[i]))?;
    let (c, a, b) = (first[i], first[(i + 1) % 3], first[(i + 2) % 3]);
    let d = *second.iter().find(|v| !first.contains(v))?;
    let new = [[c, d, b], [d, c, a]];
    let [old, other, x, y] = [first, second, new[0], new[1]].map(|t| {
        let [p, q, r] = t.map(|v| mesh.point(v as usize));
        (q - p).cross(r - p)
    });
    let flat = |n: Vec3| n.unit().dot(old.unit()) > 0.5 && n.unit().dot(other.unit()) > 0.5;
    let large = |n: Vec3| n.norm() > 0.1 * (old.norm() + other.norm());
    [x, y].iter().all(|&n| flat(n) && large(n)).then_some(new)
}

/// The mesh with smooth bumps: p ↦ (1 + f(p)) p, where f is a sum of five random waves, |f| ≤ `amount`, of lengths
/// between half the diagonal and twice as much.
pub fn bumped(mesh: &TriMesh, amount: f64, seed: u64) -> TriMesh {
    const WAVES: usize = 5;
    let mut random = Random::new(seed);
    let diagonal = mesh.bounding_box().diagonal();
    let waves: [(Vec3, f64); WAVES] = std::array::from_fn(|_| {
        let frequency = TAU / diagonal * (0.5 + 1.5 * random.unit());
        (frequency * random.in_cube().unit(), TAU * random.unit())
    });
    let centre = Vec3(mesh.bounding_box().centre());
    let bump = |v: usize| {
        let p = mesh.point(v);
        let waves = waves.iter().map(|&(wave, phase)| (wave.dot(p) + phase).sin());
        let f: f64 = waves.sum();
        (centre + (1.0 + amount / WAVES as f64 * f) * (p - centre)).into()
    };
    let positions = (0..mesh.vertex_count()).map(bump).collect();
    built(positions, mesh.triangles().to_vec())
}

/// The mesh with every vertex moved half the way to the mean of its neighbours, `steps` times.
fn smoothed(mesh: &TriMesh, steps: u32) -> TriMesh {
    let neighbours = mesh.neighbours();
    let mut p: Vec<Vec3> = (0..mesh.vertex_count()).map(|v| mesh.point(v)).collect();
    for _ in 0..steps {
        let halfway = |v: usize| {
            let around = neighbours.of(v);
            let sum: Vec3 = around.iter().map(|&w| p[w as usize]).sum();
            0.5 * (p[v] + sum * (1.0 / around.len() as f64))
        };
        p = (0..p.len()).map(halfway).collect();
    }
    built(p.into_iter().map(Into::into).collect(), mesh.triangles().to_vec())
}

/// SplitMix64 (Steele, Lea and Flood 2014): enough for fixtures, the same everywhere for ever.
struct Random(u64);

impl Random {
    fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1).
    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform in [−1, 1)³.
    fn in_cube(&mut self) -> Vec3 {
        Vec3(std::array::from_fn(|_| 2.0 * self.unit() - 1.0))
    }

    /// Uniform in 0..n.
    fn below(&mut self, n: usize) -> usize {
        (self.unit() * n as f64) as usize
    }

    /// A random order of 0..n (Fisher and Yates).
    fn permutation(&mut self, n: usize) -> Vec<usize> {
        let mut order: Vec<usize> = (0..n).collect();
        for i in (1..n).rev() {
            order.swap(i, self.below(i + 1));
        }
        order
    }
}
