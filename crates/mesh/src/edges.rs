use crate::{TriMesh, VertexStars};

/// The edges of a mesh, each once, with the triangles on them.
///
/// Edge e joins `vertices()[e] = [a, b]`, a < b; edges are sorted by (a, b). An edge has one triangle on a boundary, two
/// inside a surface, more where the surface is not a manifold. Built in O(#V + #F) time and about 40 bytes a triangle.
#[derive(Clone, Debug, PartialEq)]
pub struct Edges {
    vertices: Vec<[u32; 2]>,
    offsets: Vec<u32>,
    triangles: Vec<u32>,
    of_triangle: Vec<[u32; 3]>,
    vertex_count: usize,
}

impl Edges {
    /// Collects the edges of a mesh.
    pub fn of(mesh: &TriMesh) -> Self {
        let starts = bucket_starts(mesh);
        let mut sides = vec![(0, 0); 3 * mesh.triangle_count()];
        let mut next = starts.clone();
        for_each_side(mesh, |[a, b], side| {
            let slot = &mut next[a as usize];
            sides[*slot as usize] = (b, side);
            *slot += 1;
        });

        let mut edges = Self {
            vertices: Vec::with_capacity(sides.len() / 2),
            offsets: Vec::with_capacity(sides.len() / 2 + 1),
            triangles: Vec::with_capacity(sides.len()),
            of_triangle: vec![[0; 3]; mesh.triangle_count()],
            vertex_count: mesh.vertex_count(),
        };
        for a in 0..mesh.vertex_count() {
            let bucket = &mut sides[starts[a] as usize..starts[a + 1] as usize];
            bucket.sort_unstable();
            for of_one_edge in bucket.chunk_by(|x, y| x.0 == y.0) {
                edges.push([a as u32, of_one_edge[0].0], of_one_edge);
            }
        }
        edges.offsets.push(edges.triangles.len() as u32);
        edges
    }

    fn push(&mut self, vertices: [u32; 2], sides: &[(u32, u32)]) {
        let edge = self.vertices.len() as u32;
        self.vertices.push(vertices);
        self.offsets.push(self.triangles.len() as u32);
        for &(_, side) in sides {
            self.triangles.push(side / 3);
            self.of_triangle[side as usize / 3][side as usize % 3] = edge;
        }
    }

    /// #E.
    pub fn count(&self) -> usize {
        self.vertices.len()
    }

    /// The two vertices of each edge, #E by 2, the smaller first, sorted.
    pub fn vertices(&self) -> &[[u32; 2]] {
        &self.vertices
    }

    /// The triangles on an edge, ascending; at least one.
    #[inline]
    pub fn triangles(&self, edge: usize) -> &[u32] {
        &self.triangles[self.offsets[edge] as usize..self.offsets[edge + 1] as usize]
    }

    /// The edges of each triangle, #F by 3: edge i joins its corners i and i + 1 (mod 3).
    #[inline]
    pub fn of_triangle(&self) -> &[[u32; 3]] {
        &self.of_triangle
    }

    /// The edge between two vertices, in either order.
    pub fn find(&self, a: u32, b: u32) -> Option<usize> {
        self.vertices.binary_search(&[a.min(b), a.max(b)]).ok()
    }

    /// The end of an edge that is not `vertex`, which is the other one.
    pub fn other_end(&self, edge: usize, vertex: u32) -> u32 {
        let [a, b] = self.vertices[edge];
        if a == vertex { b } else { a }
    }

    /// Whether each vertex is on a boundary, where an edge has one triangle: #V.
    ///
    /// ```
    /// let rectangle = mesh::shapes::rectangle(2, 2, 1.0, 1.0);
    /// let at_border = mesh::Edges::of(&rectangle).at_border();
    /// assert_eq!(at_border, [true, true, true, true, false, true, true, true, true]);
    /// ```
    pub fn at_border(&self) -> Vec<bool> {
        let mut at_border = vec![false; self.vertex_count];
        let open = (0..self.count()).filter(|&edge| self.triangles(edge).len() == 1);
        for v in open.flat_map(|edge| self.vertices[edge]) {
            at_border[v as usize] = true;
        }
        at_border
    }

    /// The edges at each vertex.
    pub fn at_vertices(&self) -> VertexStars {
        let ends = (0..).zip(&self.vertices);
        let pairs = ends.flat_map(|(e, &[a, b])| [(a, e), (b, e)]);
        VertexStars::gather(self.vertex_count, pairs)
    }

    /// The vertices at the other ends of each vertex's edges: symmetric, no vertex its own neighbour.
    pub fn neighbours(&self) -> VertexStars {
        // Edges are sorted, so each row receives its smaller neighbours in order and then its larger ones in order.
        let pairs = self.vertices.iter().flat_map(|&[a, b]| [(a, b), (b, a)]);
        VertexStars::gather(self.vertex_count, pairs)
    }
}

impl TriMesh {
    /// ½ Σ cot over the angles opposite to each of the mesh's edges, which is negative across obtuse ones; huge beside degenerate triangles.
    pub fn cotangent_weights(&self, edges: &Edges) -> Vec<f64> {
        let mut weights = vec![0.0; edges.count()];
        for (triangle, sides) in edges.of_triangle().iter().enumerate() {
            let corners = self.corners(triangle);
            for (i, &side) in sides.iter().enumerate() {
                let apex = corners[(i + 2) % 3];
                let (a, b) = (corners[i] - apex, corners[(i + 1) % 3] - apex);
                weights[side as usize] += 0.5 * a.dot(b) / a.cross(b).norm().max(f64::MIN_POSITIVE);
            }
        }
        weights
    }

    /// Which vertices share an edge with which.
    pub fn neighbours(&self) -> VertexStars {
        Edges::of(self).neighbours()
    }
}

/// Calls `visit([smaller, larger], 3 t + i)` for the side i, from corner i to corner i + 1, of every triangle t.
fn for_each_side(mesh: &TriMesh, mut visit: impl FnMut([u32; 2], u32)) {
    for (t, corners) in mesh.triangles().iter().enumerate() {
        for i in 0..3 {
            let (a, b) = (corners[i], corners[(i + 1) % 3]);
            visit([a.min(b), a.max(b)], (3 * t + i) as u32);
        }
    }
}

/// Where the sides with smaller vertex a begin in a list sorted by a, #V + 1 entries.
fn bucket_starts(mesh: &TriMesh) -> Vec<u32> {
    let mut starts = vec![0; mesh.vertex_count() + 1];
    for_each_side(mesh, |[a, _], _| starts[a as usize + 1] += 1);
    for a in 0..mesh.vertex_count() {
        starts[a + 1] += starts[a];
    }
    starts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;
    use std::collections::BTreeSet;

    fn meshes() -> Vec<TriMesh> {
        vec![
            shapes::bumpy_sphere(2, 1),
            shapes::book(4),
            shapes::moebius_strip(5),
            shapes::soup(7, 2),
        ]
    }

    #[test]
    fn each_side_of_each_triangle_is_on_one_edge() {
        for mesh in meshes() {
            let edges = Edges::of(&mesh);
            for (t, corners) in mesh.triangles().iter().enumerate() {
                for i in 0..3 {
                    let (a, b) = (corners[i], corners[(i + 1) % 3]);
                    let e = edges.of_triangle()[t][i] as usize;
                    assert_eq!(edges.vertices()[e], [a.min(b), a.max(b)]);
                    assert_eq!(edges.find(b, a), Some(e));
                    assert!(edges.triangles(e).contains(&(t as u32)));
                }
            }
            let sides: usize = (0..edges.count()).map(|e| edges.triangles(e).len()).sum();
            assert_eq!(sides, 3 * mesh.triangle_count());
            assert!(edges.vertices().is_sorted_by(|x, y| x < y));
        }
    }

    #[test]
    fn neighbours_are_the_pairs_that_share_a_triangle() {
        for mesh in meshes() {
            let mut pairs = BTreeSet::new();
            for &[a, b, c] in mesh.triangles() {
                pairs.extend([(a, b), (b, a), (b, c), (c, b), (c, a), (a, c)]);
            }
            let adjacency = mesh.neighbours();
            let rows =
                (0..mesh.vertex_count()).flat_map(|v| adjacency.of(v).iter().map(move |&w| (v as u32, w)));
            assert!(rows.eq(pairs), "rows are sorted and complete");
        }
    }

    #[test]
    fn stars_hold_what_touches_the_vertex_in_ascending_order() {
        for mesh in meshes() {
            let edges = Edges::of(&mesh);
            let (of_edges, of_triangles) = (edges.at_vertices(), mesh.vertex_triangles());
            assert_eq!(of_edges.entries().len(), 2 * edges.count());
            assert_eq!(of_triangles.entries().len(), 3 * mesh.triangle_count());
            for v in 0..mesh.vertex_count() {
                assert!(
                    of_edges.of(v).is_sorted_by(|e, f| e < f)
                        && of_triangles.of(v).is_sorted_by(|t, u| t < u)
                );
                let touches = |&t: &u32| mesh.triangles()[t as usize].contains(&(v as u32));
                assert!(of_triangles.of(v).iter().all(touches));
                let others = of_edges
                    .of(v)
                    .iter()
                    .map(|&e| edges.other_end(e as usize, v as u32));
                assert!(others.eq(edges.neighbours().of(v).iter().copied()));
            }
        }
    }

    #[test]
    fn vertices_that_nothing_joins_have_no_edge() {
        let mesh = TriMesh::new(
            vec![[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [2., 2., 2.]],
            vec![[0, 1, 2]],
        )
        .unwrap();
        assert_eq!(Edges::of(&mesh).find(0, 3), None);
        assert!(mesh.neighbours().of(3).is_empty());
    }
}
