//! Intrinsic Delaunay triangulation of the tufted cover (Sharp and Crane, A Laplacian for nonmanifold triangle meshes, 2020).
//!
//! Every triangle is taken twice, front and back. Around each edge, whatever the number of its triangles, each side is
//! glued to the side that it faces, so that the cover is a closed, oriented manifold with the same vertices, also over
//! boundaries and non-manifold edges. Its edges are flipped, in their intrinsic metric, until all are Delaunay: then no
//! cotangent weight is negative. Half of the cover's stiffness and mass are the mesh's.

use std::collections::BTreeMap;

use mesh::TriMesh;

use crate::triangle::{Triangle, edge_lengths};

/// Slack in the triangle inequality after mollification, as a fraction of the mean edge length.
pub(crate) const MOLLIFICATION: f64 = 1e-5;

/// Cotangent weights above minus this count as Delaunay, so that cocircular points do not flip to and fro.
const FLAT: f64 = 1e-10;

/// A side of a triangle: from corner `side` to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Side {
    triangle: usize,
    side: usize,
}

impl Side {
    /// The next side of the same triangle.
    fn next(self) -> Self {
        Self {
            side: (self.side + 1) % 3,
            ..self
        }
    }
}

/// A closed, oriented triangulation with a length on every edge.
struct Cover {
    vertices: Vec<[u32; 3]>,
    /// Length of side s, from corner s to corner s + 1.
    lengths: Vec<[f64; 3]>,
    /// The side of another triangle (or the same) that a side is glued to.
    twins: Vec<[Side; 3]>,
}

/// Triangles of the intrinsic Delaunay triangulation of the mesh's tufted cover: vertices, and shapes of half the area
/// and half the cotangents, so that assembling them gives the Laplacian of the mesh.
pub(crate) fn tufted_delaunay(mesh: &TriMesh) -> (Vec<[u32; 3]>, Vec<Triangle>) {
    let mut cover = Cover::tufted(mesh);
    cover.make_delaunay();
    let shapes = (0..cover.vertices.len())
        .map(|t| cover.shape(t).halved())
        .collect();
    (cover.vertices, shapes)
}

impl Cover {
    /// Triangle f of the mesh is triangle 2 f from the front, and 2 f + 1, with reversed corners, from behind.
    fn tufted(mesh: &TriMesh) -> Self {
        let lengths = mollified_lengths(mesh);
        let nowhere = Side {
            triangle: usize::MAX,
            side: 0,
        };
        let mut cover = Self {
            vertices: mesh
                .triangles()
                .iter()
                .flat_map(|&[a, b, c]| [[a, b, c], [a, c, b]])
                .collect(),
            lengths: lengths
                .iter()
                .flat_map(|&[ab, bc, ca]| [[ab, bc, ca], [ca, bc, ab]])
                .collect(),
            twins: vec![[nowhere; 3]; 2 * mesh.triangle_count()],
        };
        let mut edges: BTreeMap<(u32, u32), Vec<(usize, usize)>> = BTreeMap::new();
        for (f, corners) in mesh.triangles().iter().enumerate() {
            for side in 0..3 {
                let (i, j) = (corners[side], corners[(side + 1) % 3]);
                edges.entry((i.min(j), i.max(j))).or_default().push((f, side));
            }
        }
        for (&(i, j), incident) in &mut edges {
            sort_around(mesh, i, j, incident);
            for (m, &here) in incident.iter().enumerate() {
                let there = incident[(m + 1) % incident.len()];
                let (a, b) = (sides(mesh, here, i).0, sides(mesh, there, i).1);
                cover.glue(a, b);
            }
        }
        cover
    }

    fn glue(&mut self, a: Side, b: Side) {
        self.twins[a.triangle][a.side] = b;
        self.twins[b.triangle][b.side] = a;
    }

    fn twin(&self, side: Side) -> Side {
        self.twins[side.triangle][side.side]
    }

    fn length(&self, side: Side) -> f64 {
        self.lengths[side.triangle][side.side]
    }

    fn vertex(&self, side: Side) -> u32 {
        self.vertices[side.triangle][side.side]
    }

    fn shape(&self, triangle: usize) -> Triangle {
        let [ab, bc, ca] = self.lengths[triangle];
        Triangle::from_lengths([bc, ca, ab])
    }

    /// Flips edges until none has a negative cotangent weight. Rounding could let nearly cocircular corners flip for
    /// ever, so there is a limit, which no mesh has been seen to reach.
    fn make_delaunay(&mut self) {
        let mut stack: Vec<Side> = (0..self.vertices.len())
            .flat_map(|triangle| (0..3).map(move |side| Side { triangle, side }))
            .filter(|&side| is_first(side, self.twin(side)))
            .collect();
        let mut budget = 100 * stack.len();
        while let Some(side) = stack.pop() {
            let twin = self.twin(side);
            let opposite = |s: Side| self.shape(s.triangle).cotangents[(s.side + 2) % 3];
            if twin.triangle == side.triangle || opposite(side) + opposite(twin) >= -FLAT {
                continue;
            }
            self.flip(side);
            budget -= 1;
            if budget == 0 {
                break;
            }
            let [t, u] = [side.triangle, twin.triangle];
            stack.extend(
                [t, u]
                    .into_iter()
                    .flat_map(|triangle| [0, 1].map(|side| Side { triangle, side })),
            );
        }
    }

    /// Replaces the edge between triangles a b c and b a d, given by its side a b, by the edge c d.
    fn flip(&mut self, ab: Side) {
        let ba = self.twin(ab);
        let (bc, ca, ad, db) = (ab.next(), ab.next().next(), ba.next(), ba.next().next());
        let [a, b, c, d] = [ab, ba, ca, db].map(|side| self.vertex(side));
        let new_length = self.diagonal(ab, ba);
        let old = [ca, ad, db, bc];
        let lengths = old.map(|side| self.length(side));
        let twins = old.map(|side| self.twin(side));
        let (t, u) = (ab.triangle, ba.triangle);
        let new = [
            Side { triangle: t, side: 0 },
            Side { triangle: t, side: 1 },
            Side { triangle: u, side: 0 },
            Side { triangle: u, side: 1 },
        ];
        self.vertices[t] = [c, a, d];
        self.vertices[u] = [d, b, c];
        self.lengths[t] = [lengths[0], lengths[1], new_length];
        self.lengths[u] = [lengths[2], lengths[3], new_length];
        for (k, &side) in new.iter().enumerate() {
            // The four outer sides may be glued to one another.
            let moved = old.iter().position(|&o| o == twins[k]);
            self.glue(side, moved.map_or(twins[k], |m| new[m]));
        }
        self.glue(Side { triangle: t, side: 2 }, Side { triangle: u, side: 2 });
    }

    /// Distance of c and d when the triangles a b c and b a d lie in a plane, with a at 0 and b on the first axis.
    fn diagonal(&self, ab: Side, ba: Side) -> f64 {
        let base = self.length(ab);
        let apex = |to_a: f64, to_b: f64, triangle: usize| {
            let along = (base * base + (to_a - to_b) * (to_a + to_b)) / (2.0 * base);
            (along, 2.0 * self.shape(triangle).area / base)
        };
        let c = apex(self.length(ab.next().next()), self.length(ab.next()), ab.triangle);
        let d = apex(self.length(ba.next()), self.length(ba.next().next()), ba.triangle);
        (c.0 - d.0).hypot(c.1 + d.1)
    }
}

fn is_first(side: Side, twin: Side) -> bool {
    (side.triangle, side.side) < (twin.triangle, twin.side)
}

/// Lengths of the sides ab, bc, ca of each triangle, all lengthened by the least equal amount that leaves every triangle
/// some slack in the triangle inequality (section 4.5 of the paper); by nothing if all have it.
fn mollified_lengths(mesh: &TriMesh) -> Vec<[f64; 3]> {
    let mut lengths: Vec<[f64; 3]> = (0..mesh.triangle_count())
        .map(|t| edge_lengths(mesh.corners(t)))
        .map(|[bc, ca, ab]| [ab, bc, ca])
        .collect();
    let mean = lengths.iter().flatten().sum::<f64>() / (3 * lengths.len()) as f64;
    let shortfall = |l: &[f64; 3]| {
        let longest = l.iter().copied().fold(0.0, f64::max);
        MOLLIFICATION * mean + 2.0 * longest - l.iter().sum::<f64>()
    };
    let epsilon = lengths.iter().map(shortfall).fold(0.0, f64::max);
    lengths.iter_mut().flatten().for_each(|l| *l += epsilon);
    lengths
}

/// Sorts the triangles at edge (i, j) by their angle around it, counter-clockwise seen from j.
fn sort_around(mesh: &TriMesh, i: u32, j: u32, incident: &mut [(usize, usize)]) {
    if incident.len() < 3 {
        return;
    }
    let point = |v: u32| mesh.point(v as usize);
    let axis = point(j) - point(i);
    let arm = |&(f, side): &(usize, usize)| {
        let apex = mesh.triangles()[f][(side + 2) % 3];
        point(apex) - point(i)
    };
    let reference = axis.cross(arm(&incident[0]));
    let angle = |at: &(usize, usize)| {
        let normal = axis.cross(arm(at));
        (reference.cross(normal).dot(axis) / axis.norm()).atan2(reference.dot(normal))
    };
    incident.sort_by(|a, b| angle(a).total_cmp(&angle(b)).then(a.cmp(b)));
}

/// The two sides of the cover over side `at` of a mesh's triangle: that which faces counter-clockwise around the edge
/// from its lower vertex i, and the other.
fn sides(mesh: &TriMesh, at: (usize, usize), i: u32) -> (Side, Side) {
    let (f, side) = at;
    let front = Side {
        triangle: 2 * f,
        side,
    };
    // Behind, the corners are a c b: its sides ac, cb, ba lie over sides 2, 1, 0.
    let back = Side {
        triangle: 2 * f + 1,
        side: 2 - side,
    };
    if mesh.triangles()[f][side] == i {
        (front, back)
    } else {
        (back, front)
    }
}
