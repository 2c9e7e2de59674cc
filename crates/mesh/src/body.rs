//! What of a mesh is a model, where other things were put beside it or far away.

use std::cmp::Reverse;

use crate::{Components, TriMesh, Welded, components};

/// What lies farther from the middle than so many times the median distance of all vertices is no part of a model: sight does not find it
/// there, and a search tree in single precision has hardly a digit left for the rest.
const FAR: f64 = 300.0;

/// A part is large that has this share of all vertices.
const LARGE: f64 = 0.1;
/// Of the large parts, the largest.
const MOST_PARTS: usize = 4;

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

/// The connected parts of a mesh with at least a tenth of all vertices, the largest four of them, where there is more than one part.
///
/// Parts are large by vertices and not by area, since a floor of two triangles has any area.
#[derive(Debug)]
pub struct LargeParts<'a> {
    mesh: &'a TriMesh,
    parts: Components,
    large: Vec<u32>,
}

impl<'a> LargeParts<'a> {
    /// Those of a mesh.
    pub fn of(mesh: &'a TriMesh) -> Self {
        let parts = components(mesh);
        let size = |&part: &u32| parts.sizes[part as usize];
        let is_large = |part: &u32| size(part) as f64 >= LARGE * mesh.vertex_count() as f64;
        let mut large: Vec<u32> = match parts.count {
            1 => Vec::new(),
            count => (0..count as u32).filter(is_large).collect(),
        };
        large.sort_by_key(|part| Reverse(size(part)));
        large.truncate(MOST_PARTS);
        Self { mesh, parts, large }
    }

    /// How many, from 0 to 4.
    pub fn count(&self) -> usize {
        self.large.len()
    }

    /// Each that has an area as a mesh of its own, the largest first.
    pub fn meshes(&self) -> impl Iterator<Item = TriMesh> {
        let of_vertex = &self.parts.of_vertex;
        self.large
            .iter()
            .filter_map(|&large| part(self.mesh, |v| of_vertex[v as usize] == large))
    }
}

/// The triangles all of whose vertices belong to a part; none if they are no surface.
fn part(mesh: &TriMesh, belongs: impl Fn(u32) -> bool) -> Option<TriMesh> {
    let kept = mesh
        .triangles()
        .iter()
        .copied()
        .filter(|corners| corners.iter().all(|&v| belongs(v)));
    let kept: Vec<[u32; 3]> = kept.collect();
    let part = Welded::new(mesh.positions(), &kept).ok()?.into_mesh();
    (part.area() > 0.0).then_some(part)
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
        }
        assert!(near_part(&sphere).is_none());
    }

    #[test]
    fn large_parts_are_the_four_with_most_vertices() {
        let sizes = |meshes: &[TriMesh]| -> Vec<usize> {
            let all = shapes::disjoint_union(meshes);
            let parts = LargeParts::of(&all);
            let sizes: Vec<usize> = parts.meshes().map(|part| part.vertex_count()).collect();
            assert_eq!(parts.count(), sizes.len());
            sizes
        };
        let [small, middle, large] = [0, 1, 2].map(shapes::icosphere);
        let cubes = vec![shapes::cube(1.0); 6];
        assert_eq!(sizes(std::slice::from_ref(&large)), []);
        assert_eq!(sizes(&[small.clone(), large.clone()]), [162]);
        assert_eq!(sizes(&[small, middle, large]), [162, 42]);
        assert_eq!(sizes(&cubes), [8; 4]);
    }

    #[test]
    fn what_has_no_area_is_no_part() {
        let points = (0..40).map(|i| [f64::from(i), 9.0, 0.0]).collect();
        let line = TriMesh::new(points, (0..38).map(|i| [i, i + 1, i + 2]).collect()).unwrap();
        let all = shapes::disjoint_union(&[line, shapes::cube(1.0)]);
        let parts = LargeParts::of(&all);
        let sizes: Vec<usize> = parts.meshes().map(|part| part.vertex_count()).collect();
        assert_eq!((parts.count(), sizes), (2, vec![8]));
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
