//! An order of the vertices that the triangles alone determine, whatever order a file has them in.

use mesh::{Edges, TriMesh};

/// A walk over all triangles of a mesh, from neighbour to neighbour.
///
/// From a first triangle it goes on, breadth first, over edges with two triangles; what it can't reach is walked from a next first triangle. Vertices
/// are numbered as they are met: their *ranks*. Nothing but the first triangles depends on the order of vertices, of triangles or of their corners, or on which
/// side of them is outside.
pub(super) struct Traversal<'a> {
    mesh: &'a TriMesh,
    edges: &'a Edges,
    walked: Vec<bool>,
    rank: Vec<u32>,
    order: Vec<u32>,
}

const NONE: u32 = u32::MAX;

impl<'a> Traversal<'a> {
    /// Before the first step.
    pub(super) fn new(mesh: &'a TriMesh, edges: &'a Edges) -> Self {
        Self {
            edges,
            walked: vec![false; mesh.triangle_count()],
            rank: vec![NONE; mesh.vertex_count()],
            order: Vec::with_capacity(mesh.vertex_count()),
            mesh,
        }
    }

    /// The whole walk, each first triangle being the next of the mesh that was not reached, with the corners of those triangles.
    pub(super) fn whole(mesh: &'a TriMesh, edges: &'a Edges) -> (Self, Vec<[u32; 3]>) {
        let mut traversal = Self::new(mesh, edges);
        let mut first = Vec::new();
        for (t, &corners) in mesh.triangles().iter().enumerate() {
            if !traversal.walked[t] {
                first.push(corners);
                traversal.walk(t, corners);
            }
        }
        (traversal, first)
    }

    /// The vertices in the order of their ranks, as far as they were met.
    pub(super) fn order(&self) -> &[u32] {
        &self.order
    }

    /// The rank of each vertex; `u32::MAX` where it was not met.
    pub(super) fn ranks(&self) -> &[u32] {
        &self.rank
    }

    /// Which triangles were walked.
    pub(super) fn walked(&self) -> &[bool] {
        &self.walked
    }

    /// Walks from a triangle, whose corners are met in this order.
    pub(super) fn walk(&mut self, triangle: usize, corners: [u32; 3]) {
        self.walked[triangle] = true;
        let mut queue = std::collections::VecDeque::from([(triangle, corners)]);
        while let Some((triangle, corners)) = queue.pop_front() {
            corners.iter().for_each(|&v| self.meet(v));
            for side in 0..3 {
                let [a, b] = [corners[side], corners[(side + 1) % 3]];
                if let Some(next) = self.across(triangle, [a, b])
                    && !self.walked[next]
                {
                    self.walked[next] = true;
                    let third = self.mesh.triangles()[next]
                        .into_iter()
                        .find(|&v| v != a && v != b);
                    queue.push_back((next, [b, a, third.unwrap_or(a)]));
                }
            }
        }
    }

    fn meet(&mut self, vertex: u32) {
        let rank = &mut self.rank[vertex as usize];
        if *rank == NONE {
            *rank = self.order.len() as u32;
            self.order.push(vertex);
        }
    }

    /// The triangle on the other side of an edge of a triangle; none where the edge does not have two.
    fn across(&self, triangle: usize, ends: [u32; 2]) -> Option<usize> {
        let edges = self.edges.of_triangle()[triangle];
        let is_it = |&&edge: &&u32| {
            let [a, b] = self.edges.vertices()[edge as usize];
            [a, b] == ends || [b, a] == ends
        };
        let edge = edges.iter().find(is_it)?;
        let &[p, q] = self.edges.triangles(*edge as usize) else {
            return None;
        };
        Some((if p as usize == triangle { q } else { p }) as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes;
    use proptest::prelude::*;

    fn hard_meshes() -> Vec<TriMesh> {
        vec![
            shapes::bumpy_sphere(2, 1),
            shapes::book(4),
            shapes::moebius_strip(5),
            shapes::soup(7, 2),
            shapes::disjoint_union(&[shapes::icosphere(1), shapes::tetrahedron()]),
        ]
    }

    #[test]
    fn every_vertex_that_a_triangle_uses_is_met_once() {
        for mesh in hard_meshes() {
            let edges = Edges::of(&mesh);
            let (traversal, _) = Traversal::whole(&mesh, &edges);
            let used = mesh.used_vertices().iter().filter(|&&used| used).count();
            assert!(!traversal.walked().contains(&false));
            assert_eq!(traversal.order().len(), used);
            for (rank, &v) in traversal.order().iter().enumerate() {
                assert_eq!(traversal.ranks()[v as usize] as usize, rank);
            }
        }
    }

    proptest! {
        /// Corners turned, triangles flipped and in another order, vertices renamed.
        #[test]
        fn from_the_same_first_triangle_ranks_are_the_same_in_every_order(seed in 0u64..1000, flip: bool) {
            let mesh = shapes::bumpy_sphere(2, 3);
            let n = mesh.triangle_count();
            let shuffled = shapes::shuffled(&mesh, seed);
            // Positions tell which vertex is which.
            let of: std::collections::HashMap<[u64; 3], u32> = (0..)
                .zip(shuffled.positions())
                .map(|(v, p)| (p.map(f64::to_bits), v))
                .collect();
            let there = |v: u32| of[&mesh.positions()[v as usize].map(f64::to_bits)];
            let triangles = shuffled.triangles().iter().map(|&[a, b, c]| if flip { [b, a, c] } else { [c, a, b] });
            let other = TriMesh::new(shuffled.positions().to_vec(), triangles.collect()).unwrap();
            let [edges, edges_there] = [&mesh, &other].map(Edges::of);
            let (here, first) = Traversal::whole(&mesh, &edges);
            prop_assert_eq!(first.len(), 1);
            let corners = first[0].map(there);
            let is_first = |t: &usize| corners.iter().all(|v| other.triangles()[*t].contains(v));
            let mut traversal = Traversal::new(&other, &edges_there);
            traversal.walk((0..n).find(is_first).unwrap(), corners);
            let expected: Vec<u32> = here.order().iter().map(|&v| there(v)).collect();
            prop_assert_eq!(traversal.order(), expected);
        }
    }
}
