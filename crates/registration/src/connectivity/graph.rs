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

    /// The side of a triangle that joins two of its corners: 0 from the first to the second.
    fn side(&self, triangle: u32, [a, b]: [u32; 2]) -> usize {
        let [x, y, z] = self.triangle(triangle);
        if (x == a && y == b) || (x == b && y == a) {
            0
        } else if (y == a && z == b) || (y == b && z == a) {
            1
        } else {
            2
        }
    }

    /// The triangle on the other side of the edge that joins two corners of a triangle, and its third corner; how many triangles the
    /// edge has where that is not two.
    pub(super) fn across(&self, triangle: u32, ends: [u32; 2]) -> Result<(u32, u32), usize> {
        self.across_side(triangle, self.side(triangle, ends), ends)
    }

    /// The same, where it is known which side joins the corners.
    pub(super) fn across_side(
        &self,
        triangle: u32,
        side: usize,
        [a, b]: [u32; 2],
    ) -> Result<(u32, u32), usize> {
        let edge = self.edges.of_triangle()[triangle as usize][side] as usize;
        let triangles = self.edges.triangles(edge);
        let &[p, q] = triangles else {
            return Err(triangles.len());
        };
        let other = if p == triangle { q } else { p };
        let [x, y, z] = self.triangle(other);
        let third = if x != a && x != b {
            x
        } else if y != a && y != b {
            y
        } else if z != a && z != b {
            z
        } else {
            a
        };
        Ok((other, third))
    }

    pub(super) fn position(&self, v: u32) -> Vec3 {
        self.mesh.point(v as usize)
    }
}
