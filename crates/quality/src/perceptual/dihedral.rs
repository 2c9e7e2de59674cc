//! The angles by which a surface bends at its edges.

use mesh::{Edges, TriMesh, Vec3};

/// The bend at each edge, #E: the angle between the normals of its two triangles, from −π to π.
///
/// Positive where the surface is convex as seen from the side from which triangles turn counter-clockwise. None at boundaries, at
/// edges of three triangles and more, between triangles that face opposite ways, and where a triangle has no area.
pub(crate) fn bends(mesh: &TriMesh, edges: &Edges) -> Vec<Option<f64>> {
    (0..edges.count()).map(|e| bend(mesh, edges, e)).collect()
}

fn bend(mesh: &TriMesh, edges: &Edges, edge: usize) -> Option<f64> {
    let &[s, t] = edges.triangles(edge) else {
        return None;
    };
    let [a, b] = edges.vertices()[edge];
    let runs_forward = |t: u32| {
        let c = mesh.triangles()[t as usize];
        (0..3).any(|i| [c[i], c[(i + 1) % 3]] == [a, b])
    };
    // The left triangle runs along the edge from a to b, the right one back.
    let (left, right) = match (runs_forward(s), runs_forward(t)) {
        (true, false) => (s, t),
        (false, true) => (t, s),
        _ => return None,
    };
    let (n, m) = (normal(mesh, left)?, normal(mesh, right)?);
    let axis = (mesh.point(b as usize) - mesh.point(a as usize)).unit();
    Some(n.cross(m).dot(axis).atan2(n.dot(m)))
}

fn normal(mesh: &TriMesh, triangle: u32) -> Option<Vec3> {
    let [a, b, c] = mesh.corners(triangle as usize);
    let n = (b - a).cross(c - a).unit();
    (n.norm() > 0.0).then_some(n)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes;

    #[test]
    fn edges_of_a_cube_bend_by_a_right_angle_outward_and_diagonals_not_at_all() {
        let cube = shapes::cube(1.0);
        let edges = Edges::of(&cube);
        let mut angles: Vec<f64> = bends(&cube, &edges).into_iter().flatten().collect();
        angles.sort_by(f64::total_cmp);
        for (i, angle) in angles.iter().enumerate() {
            let expected = if i < 6 { 0.0 } else { std::f64::consts::FRAC_PI_2 };
            assert!((angle - expected).abs() < 1e-15);
        }
        let inside_out = shapes::inside_out(&cube);
        let turned = bends(&inside_out, &Edges::of(&inside_out));
        assert!(turned.into_iter().flatten().all(|angle| angle < 1e-15));
    }

    #[test]
    fn boundaries_and_bindings_have_no_angle() {
        let book = shapes::book(3);
        assert!(
            bends(&book, &Edges::of(&book))
                .iter()
                .flatten()
                .all(|&angle| angle == 0.0)
        );
        let strip = shapes::rectangle(1, 1, 1.0, 1.0);
        assert_eq!(bends(&strip, &Edges::of(&strip)).iter().flatten().count(), 1);
    }
}
