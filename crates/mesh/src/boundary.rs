use crate::{Edges, TriMesh};

/// How many curves the boundary of a mesh is: the edges with one triangle, joined.
///
/// Curves are followed around fans of triangles, as if fans that touch only at a vertex were apart: two holes that touch at
/// a vertex are one curve that passes it twice. A curve that ends at non-manifold edges is open.
pub(crate) fn boundary_curves(mesh: &TriMesh, edges: &Edges) -> usize {
    let mut done = vec![false; edges.count()];
    let mut curves = 0;
    for start in 0..edges.count() {
        if done[start] || edges.triangles(start).len() != 1 {
            continue;
        }
        curves += 1;
        let [tail, head] = edges.vertices()[start];
        if !follow(mesh, edges, start, head, &mut done) {
            follow(mesh, edges, start, tail, &mut done);
        }
    }
    curves
}

/// Takes the edges of a curve one by one, from `start` beyond its end `head`; true if the curve comes back to `start`.
fn follow(mesh: &TriMesh, edges: &Edges, start: usize, mut head: u32, done: &mut [bool]) -> bool {
    let mut edge = start;
    loop {
        done[edge] = true;
        match across_the_fan(mesh, edges, edge, head) {
            Some(next) if next == start => return true,
            Some(next) => {
                head = edges.other_end(next, head);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    fn curves(mesh: &TriMesh) -> usize {
        boundary_curves(mesh, &Edges::of(mesh))
    }

    #[test]
    fn a_rectangle_has_one_curve_around_it_and_a_tube_one_at_each_end() {
        assert_eq!(curves(&shapes::rectangle(2, 1, 2.0, 1.0)), 1);
        assert_eq!(curves(&shapes::cylinder(5, 2, 1.0, 2.0)), 2);
    }

    #[test]
    fn two_holes_that_touch_at_a_vertex_are_one_curve() {
        // A grid of 4 × 4 cells without the cells (1, 1) and (2, 2), which share one corner.
        let grid = shapes::rectangle(4, 4, 1.0, 1.0);
        let removed = |t: usize| [5, 10].contains(&(t / 2));
        let kept = (0..grid.triangle_count())
            .filter(|&t| !removed(t))
            .map(|t| grid.triangles()[t])
            .collect();
        assert_eq!(curves(&TriMesh::new(grid.positions().to_vec(), kept).unwrap()), 2);
    }

    #[test]
    fn non_manifold_edges_cut_the_boundary_into_open_curves() {
        assert_eq!(curves(&shapes::shuffled(&shapes::book(3), 8)), 3);
    }

    #[test]
    fn a_one_sided_strip_has_one_curve_and_triangles_that_face_either_way_change_none() {
        assert_eq!(curves(&shapes::moebius_strip(7)), 1);
        let grid = shapes::rectangle(3, 3, 1.0, 1.0);
        let turn = |(t, &[a, b, c]): (usize, &[u32; 3])| if t % 3 == 0 { [a, c, b] } else { [a, b, c] };
        let turned = grid.triangles().iter().enumerate().map(turn).collect();
        assert_eq!(
            curves(&TriMesh::new(grid.positions().to_vec(), turned).unwrap()),
            1
        );
    }
}
