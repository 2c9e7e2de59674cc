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
/// Curves are followed around fans of triangles, as if fans that touch only at a vertex were apart: two holes that touch at
/// a vertex are one loop that passes it twice. A curve begins at its first edge in the order of [`Edges`] and runs as
/// the triangle there does: the surface lies to the left, seen from the side from which triangles turn counter-clockwise.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    #[test]
    fn the_boundary_of_a_rectangle_runs_once_around_it_with_the_surface_on_the_left() {
        let loops = boundary_loops(&shapes::rectangle(2, 1, 2.0, 1.0));
        assert_eq!(
            loops,
            [BoundaryLoop {
                vertices: vec![0, 1, 2, 5, 4, 3],
                closed: true
            }]
        );
        assert_eq!(loops[0].edge_count(), 6);
    }

    #[test]
    fn two_holes_that_touch_at_a_vertex_are_one_loop_that_passes_it_twice() {
        // A grid of 4 × 4 cells without the cells (1, 1) and (2, 2), which share one corner.
        let grid = shapes::rectangle(4, 4, 1.0, 1.0);
        let removed = |t: usize| [5, 10].contains(&(t / 2));
        let kept = (0..grid.triangle_count())
            .filter(|&t| !removed(t))
            .map(|t| grid.triangles()[t])
            .collect();
        let mesh = TriMesh::new(grid.positions().to_vec(), kept).unwrap();
        let loops = boundary_loops(&mesh);
        assert_eq!(
            loops.iter().map(BoundaryLoop::edge_count).collect::<Vec<_>>(),
            [16, 8]
        );
        assert_eq!(loops[1].vertices.iter().filter(|&&v| v == 12).count(), 2);
    }

    #[test]
    fn non_manifold_edges_cut_the_boundary_into_open_curves() {
        let curves = boundary_loops(&shapes::shuffled(&shapes::book(3), 8));
        assert_eq!(curves.len(), 3);
        assert!(
            curves
                .iter()
                .all(|curve| !curve.closed && curve.edge_count() == 3)
        );
    }

    #[test]
    fn a_one_sided_strip_has_one_loop_and_triangles_that_face_either_way_change_no_loop() {
        let loops = boundary_loops(&shapes::moebius_strip(7));
        assert_eq!(
            (loops.len(), loops[0].edge_count(), loops[0].closed),
            (1, 14, true)
        );
        let grid = shapes::rectangle(3, 3, 1.0, 1.0);
        let turn = |(t, &[a, b, c]): (usize, &[u32; 3])| if t % 3 == 0 { [a, c, b] } else { [a, b, c] };
        let turned = grid.triangles().iter().enumerate().map(turn).collect();
        let loops = boundary_loops(&TriMesh::new(grid.positions().to_vec(), turned).unwrap());
        assert_eq!(
            (loops.len(), loops[0].edge_count(), loops[0].closed),
            (1, 12, true)
        );
    }
}
