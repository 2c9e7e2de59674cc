//! What of a mesh is a model, where other things were put beside it or far away.

use crate::{TriMesh, Welded, components};

/// What lies farther from the middle than so many times the median distance of all vertices is no part of a model: sight does not find it
/// there, and a search tree in single precision has hardly a digit left for the rest.
const FAR: f64 = 300.0;

/// A mesh without triangles that reach 300 times as far from the middle of all vertices as their median; none if there are none.
///
/// Middle and distance are medians over vertices, axis by axis, so that fewer than half of them, wherever they lie, decide nothing.
pub fn near_part(mesh: &TriMesh) -> Option<TriMesh> {
    let axis = |axis: usize| median(mesh.positions().iter().map(|p| p[axis]).collect());
    let middle = [axis(0), axis(1), axis(2)];
    let off = |p: &[f64; 3]| (0..3).map(|i| (p[i] - middle[i]).abs()).fold(0.0, f64::max);
    let reach = FAR * median(mesh.positions().iter().map(off).collect());
    if reach == 0.0 || mesh.positions().iter().all(|p| off(p) <= reach) {
        return None;
    }
    part(mesh, |v| off(&mesh.positions()[v as usize]) <= reach)
}

/// The connected part with more than half of all vertices, where there are other parts.
pub fn main_part(mesh: &TriMesh) -> Option<TriMesh> {
    let parts = components(mesh);
    if parts.count < 2 {
        return None;
    }
    let is_main = |&size: &usize| 2 * size > mesh.vertex_count();
    let main = parts.sizes.iter().position(is_main)? as u32;
    part(mesh, |v| parts.of_vertex[v as usize] == main)
}

/// The triangles all of whose vertices belong to a part.
fn part(mesh: &TriMesh, belongs: impl Fn(u32) -> bool) -> Option<TriMesh> {
    let kept = mesh
        .triangles()
        .iter()
        .copied()
        .filter(|corners| corners.iter().all(|&v| belongs(v)));
    let kept: Vec<[u32; 3]> = kept.collect();
    Welded::new(mesh.positions(), &kept).ok().map(Welded::into_mesh)
}

fn median(mut values: Vec<f64>) -> f64 {
    let half = values.len() / 2;
    *values.select_nth_unstable_by(half, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    /// A mesh and a cube of 8 vertices at `far` on the first axis.
    fn with_a_cube(mesh: &TriMesh, far: f64) -> TriMesh {
        let cube = shapes::translated(&shapes::cube(1.0), [far, 0.0, 0.0]);
        shapes::disjoint_union(&[mesh.clone(), cube])
    }

    #[test]
    fn what_is_far_away_is_left_out_and_what_is_beside_is_not() {
        let sphere = shapes::icosphere(2);
        for (far, is_far) in [(3.0, false), (100.0, false), (1e3, true), (1e30, true)] {
            let both = with_a_cube(&sphere, far);
            let near = near_part(&both).map(|near| near.vertex_count());
            assert_eq!(near, is_far.then_some(sphere.vertex_count()), "{far}");
            assert_eq!(main_part(&both).unwrap().vertex_count(), sphere.vertex_count());
        }
        assert!(near_part(&sphere).is_none() && main_part(&sphere).is_none());
    }

    #[test]
    fn of_two_equal_parts_none_is_the_main_one() {
        let cube = shapes::cube(1.0);
        assert!(main_part(&with_a_cube(&cube, 5.0)).is_none());
    }

    #[test]
    fn a_corner_that_was_dragged_away_takes_its_triangles_alone() {
        let sphere = shapes::icosphere(2);
        let mut positions = sphere.positions().to_vec();
        positions[20] = [1e20, -1e35, 7.0];
        let near = near_part(&sphere.with_positions(positions).unwrap()).unwrap();
        assert_eq!(near.vertex_count(), sphere.vertex_count() - 1);
    }
}
