//! Parts of a mesh with as many vertices each, by halving boxes.

use mesh::TriMesh;

/// How often the vertices are halved, and how many regions that makes.
const HALVINGS: u32 = 4;
pub(super) const REGIONS: usize = 1 << HALVINGS;

/// The region of each vertex, below [`REGIONS`]; vertices of no triangle are in the first. Where there are fewer vertices some regions have none.
pub(super) fn regions(mesh: &TriMesh) -> Vec<u8> {
    let used = mesh.used_vertices();
    let mut vertices: Vec<usize> = (0..mesh.vertex_count()).filter(|&v| used[v]).collect();
    let mut regions = vec![0; mesh.vertex_count()];
    halve(mesh, &mut vertices, 0..REGIONS, &mut regions);
    regions
}

/// Halves vertices across the longest edge of their box until each part has one number.
fn halve(mesh: &TriMesh, vertices: &mut [usize], numbers: std::ops::Range<usize>, regions: &mut [u8]) {
    if numbers.len() == 1 || vertices.is_empty() {
        vertices.iter().for_each(|&v| regions[v] = numbers.start as u8);
        return;
    }
    let place = |v: usize, axis: usize| mesh.positions()[v][axis];
    // Halves, since differences of large coordinates may not be finite.
    let extent = |axis: usize| {
        let (low, high) = vertices
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &v| {
                (low.min(place(v, axis)), high.max(place(v, axis)))
            });
        high / 2.0 - low / 2.0
    };
    let extents = [0, 1, 2].map(extent);
    let axis = (1..3).fold(0, |longest, axis| {
        if extents[axis] > extents[longest] {
            axis
        } else {
            longest
        }
    });
    let half = vertices.len() / 2;
    vertices.select_nth_unstable_by(half, |&a, &b| {
        place(a, axis).total_cmp(&place(b, axis)).then(a.cmp(&b))
    });
    let (low, high) = vertices.split_at_mut(half);
    let middle = numbers.start + numbers.len() / 2;
    halve(mesh, low, numbers.start..middle, regions);
    halve(mesh, high, middle..numbers.end, regions);
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(16))]

        #[test]
        fn every_region_has_as_many_vertices_and_lies_in_a_box_of_its_own(seed in 0..1000_u64) {
            let mesh = shapes::bumpy_sphere(3, seed);
            let regions = regions(&mesh);
            let mut counts = [0_usize; REGIONS];
            regions.iter().for_each(|&region| counts[region as usize] += 1);
            prop_assert!(counts.iter().max().unwrap() - counts.iter().min().unwrap() <= 1, "{counts:?}");
            let volume = |of: &dyn Fn(usize) -> bool| {
                let points = (0..mesh.vertex_count()).filter(|&v| of(v)).map(|v| mesh.positions()[v]);
                let bounds = mesh::BoundingBox::of(&points.collect::<Vec<_>>());
                (0..3).map(|axis| bounds.max[axis] - bounds.min[axis]).product::<f64>()
            };
            let boxes: f64 = (0..REGIONS).map(|region| volume(&|v| regions[v] as usize == region)).sum();
            prop_assert!(boxes <= volume(&|_| true) * (1.0 + 1e-12));
        }
    }

    #[test]
    fn few_vertices_have_few_regions() {
        let regions = regions(&shapes::icosphere(0));
        assert_eq!(regions.len(), 12);
        assert!(regions.iter().all(|&region| usize::from(region) < REGIONS));
    }
}
