use crate::{Edges, TriMesh};

/// One curve of boundary edges.
#[derive(Clone, Debug, PartialEq)]
pub struct BoundaryLoop {
    /// The vertices along the curve; of a closed one, the first is not repeated.
    pub vertices: Vec<u32>,
    /// False when the curve ends at non-manifold edges.
    pub closed: bool,
}

impl BoundaryLoop {
    /// How many edges the curve has.
    pub fn edge_count(&self) -> usize {
        self.vertices.len() - usize::from(!self.closed)
    }
}

/// The boundary of a mesh: the edges with one triangle, joined into curves.
///
/// Each curve is followed around its fans of triangles, so two holes that touch at one vertex are two loops. Each begins at
/// its first edge in the order of [`Edges`] and runs in the direction in which the triangle there has it: the surface
/// lies to the left, seen from the side from which its triangles turn counter-clockwise.
pub fn boundary_loops(mesh: &TriMesh) -> Vec<BoundaryLoop> {
    trace_boundaries(mesh, &Edges::of(mesh))
}

pub(crate) fn trace_boundaries(mesh: &TriMesh, edges: &Edges) -> Vec<BoundaryLoop> {
    let mut done = vec![false; edges.count()];
    let mut loops = Vec::new();
    for start in 0..edges.count() {
        if done[start] || edges.triangles(start).len() != 1 {
            continue;
        }
        let [tail, head] = as_in_its_triangle(mesh, edges, start);
        let mut vertices = vec![tail, head];
        let closed = follow(mesh, edges, start, &mut vertices, &mut done);
        if closed {
            vertices.pop();
        } else {
            vertices.reverse();
            follow(mesh, edges, start, &mut vertices, &mut done);
            vertices.reverse();
        }
        loops.push(BoundaryLoop { vertices, closed });
    }
    loops
}

/// Extends `vertices` edge by edge from the edge `start` at their end; true if the curve comes back to `start`.
fn follow(mesh: &TriMesh, edges: &Edges, start: usize, vertices: &mut Vec<u32>, done: &mut [bool]) -> bool {
    let mut edge = start;
    let mut head = vertices[vertices.len() - 1];
    loop {
        done[edge] = true;
        match across_the_fan(mesh, edges, edge, head) {
            Some(next) if next == start => return true,
            Some(next) => {
                let [a, b] = edges.vertices()[next];
                head = if a == head { b } else { a };
                vertices.push(head);
                edge = next;
            }
            None => return false,
        }
    }
}

/// The boundary edge at the other end of the fan of triangles around `pivot` that begins with the boundary edge `edge`;
/// `None` when a non-manifold edge ends the fan.
fn across_the_fan(mesh: &TriMesh, edges: &Edges, mut edge: usize, pivot: u32) -> Option<usize> {
    let mut triangle = edges.triangles(edge)[0];
    loop {
        edge = other_edge_at(mesh, edges, triangle, pivot, edge);
        match *edges.triangles(edge) {
            [_] => return Some(edge),
            [t, u] => triangle = if t == triangle { u } else { t },
            _ => return None,
        }
    }
}

/// Of the two edges of a triangle that meet at `pivot`, the one that is not `edge`.
fn other_edge_at(mesh: &TriMesh, edges: &Edges, triangle: u32, pivot: u32, edge: usize) -> usize {
    let corner = mesh.triangles()[triangle as usize]
        .iter()
        .position(|&v| v == pivot)
        .unwrap_or_default();
    let sides = edges.of_triangle()[triangle as usize];
    let (after, before) = (sides[corner] as usize, sides[(corner + 2) % 3] as usize);
    if after == edge { before } else { after }
}

/// The two vertices of an edge in the order in which its first triangle has them.
fn as_in_its_triangle(mesh: &TriMesh, edges: &Edges, edge: usize) -> [u32; 2] {
    let [a, b] = edges.vertices()[edge];
    if runs_forward(mesh, edges, edge, edges.triangles(edge)[0]) {
        [a, b]
    } else {
        [b, a]
    }
}

/// Whether a triangle on an edge passes it from its smaller vertex to its larger one.
pub(crate) fn runs_forward(mesh: &TriMesh, edges: &Edges, edge: usize, triangle: u32) -> bool {
    let [a, b] = edges.vertices()[edge];
    let corners = mesh.triangles()[triangle as usize];
    (0..3).any(|i| [corners[i], corners[(i + 1) % 3]] == [a, b])
}
