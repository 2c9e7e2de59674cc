//! Windows that take a mark back where its patch ends: the rival of harmonics that are zero there.

use std::{cmp::Reverse, collections::BinaryHeap};

use super::Patch;

/// How wide the rise from 0 to 1 is, as a share of the radius of a disc of the patch's area.
const WIDTH: f64 = 0.15;

/// 3 t² − 2 t³ of each vertex's distance to the border with another patch, along edges and in units of the width; 1 from there on, and everywhere on a patch without such a border.
pub(super) fn window(patch: &Patch) -> Vec<f64> {
    let width = WIDTH * (patch.mesh().area() / std::f64::consts::PI).sqrt();
    let step = |distance: f64| {
        let t = (distance / width).min(1.0);
        t * t * (3.0 - 2.0 * t)
    };
    distances(patch).into_iter().map(step).collect()
}

/// Of each vertex to the next at the border (Dijkstra); infinite where there is none.
fn distances(patch: &Patch) -> Vec<f64> {
    let (mesh, neighbours) = (patch.mesh(), patch.mesh().neighbours());
    let mut distance = vec![f64::INFINITY; mesh.vertex_count()];
    let mut next = BinaryHeap::new();
    for (v, _) in patch.at_border().iter().enumerate().filter(|(_, at)| **at) {
        distance[v] = 0.0;
        // The bits of numbers that are not negative are in their order.
        next.push(Reverse((0_u64, v)));
    }
    while let Some(Reverse((bits, v))) = next.pop() {
        let so_far = f64::from_bits(bits);
        if so_far > distance[v] {
            continue;
        }
        for &w in neighbours.of(v) {
            let w = w as usize;
            let reached = so_far + (mesh.point(w) - mesh.point(v)).norm();
            if reached < distance[w] {
                distance[w] = reached;
                next.push(Reverse((reached.to_bits(), w)));
            }
        }
    }
    distance
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mark::Patches;
    use mesh::shapes;

    #[test]
    fn a_window_rises_from_zero_at_the_border_with_another_patch_alone() {
        let mesh = shapes::rectangle(40, 20, 2.0, 1.0);
        let halves: Vec<u32> = mesh
            .positions()
            .iter()
            .map(|p| if p[0] < 1.0 { 1 } else { 2 })
            .collect();
        let patches = Patches::from_labels(&mesh, &halves).unwrap();
        for patch in patches.iter() {
            let window = window(patch);
            for ((p, w), at_border) in patch
                .mesh()
                .positions()
                .iter()
                .zip(&window)
                .zip(patch.at_border())
            {
                assert!((0.0..=1.0).contains(w) && (*w == 0.0) == *at_border, "{p:?}: {w}");
                assert!((p[0] - 1.0).abs() < 0.3 || *w == 1.0, "{p:?}: {w}");
            }
        }
        let whole = Patches::from_labels(&mesh, &vec![1; mesh.vertex_count()]).unwrap();
        assert!(window(&whole[0]).iter().all(|&w| w == 1.0));
    }
}
