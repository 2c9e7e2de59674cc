use std::ops::Deref;

use mesh::{Components, Edges, TriMesh, Vec3, VertexStars, components};

/// What of a mesh is beside what.
pub(crate) struct Connectivity {
    pub(super) edges: Edges,
    pub(super) parts: Components,
    /// How many triangles each part has.
    pub(super) part_triangles: Vec<usize>,
    /// How many vertices have a triangle.
    pub(super) used_vertices: usize,
    fans: VertexStars,
}

impl Connectivity {
    pub(crate) fn of(mesh: &TriMesh) -> Self {
        let parts = components(mesh);
        let mut part_triangles = vec![0; parts.count];
        for &[a, ..] in mesh.triangles() {
            part_triangles[parts.of_vertex[a as usize] as usize] += 1;
        }
        let fans = mesh.vertex_triangles();
        let used_vertices = fans.offsets().windows(2).filter(|w| w[0] < w[1]).count();
        Self {
            edges: Edges::of(mesh),
            parts,
            part_triangles,
            used_vertices,
            fans,
        }
    }

    /// The connectivity together with its mesh.
    pub(crate) fn graph<'a>(&'a self, mesh: &'a TriMesh) -> Graph<'a> {
        Graph {
            mesh,
            connectivity: self,
        }
    }

    /// The triangles at a vertex, ascending.
    pub(super) fn fan(&self, v: u32) -> &[u32] {
        self.fans.of(v as usize)
    }

    pub(super) fn part_of(&self, v: u32) -> usize {
        self.parts.of_vertex[v as usize] as usize
    }
}

/// A mesh with what the matching asks of it.
#[derive(Clone, Copy)]
pub(crate) struct Graph<'a> {
    pub(crate) mesh: &'a TriMesh,
    connectivity: &'a Connectivity,
}

impl Deref for Graph<'_> {
    type Target = Connectivity;

    fn deref(&self) -> &Connectivity {
        self.connectivity
    }
}

impl Graph<'_> {
    pub(super) fn triangle(&self, t: u32) -> [u32; 3] {
        self.mesh.triangles()[t as usize]
    }

    /// The edge of a triangle that joins two of its corners.
    pub(super) fn edge(&self, triangle: u32, [a, b]: [u32; 2]) -> usize {
        let corners = self.triangle(triangle);
        let joins = |side: usize| {
            let (x, y) = (corners[side], corners[(side + 1) % 3]);
            (x, y) == (a, b) || (y, x) == (a, b)
        };
        let side = if joins(0) {
            0
        } else if joins(1) {
            1
        } else {
            2
        };
        self.edges.of_triangle()[triangle as usize][side] as usize
    }

    /// The corner of a triangle that is neither of two others.
    pub(super) fn third(&self, triangle: u32, [a, b]: [u32; 2]) -> u32 {
        self.triangle(triangle)
            .into_iter()
            .find(|&v| v != a && v != b)
            .unwrap_or(a)
    }

    /// The triangle on the other side of an edge, and its third corner; none where the edge does not have two
    /// triangles.
    pub(super) fn across(&self, triangle: u32, ends: [u32; 2]) -> Option<(u32, u32)> {
        let &[p, q] = self.edges.triangles(self.edge(triangle, ends)) else {
            return None;
        };
        let other = if p == triangle { q } else { p };
        Some((other, self.third(other, ends)))
    }

    pub(super) fn position(&self, v: u32) -> Vec3 {
        self.mesh.point(v as usize)
    }
}
