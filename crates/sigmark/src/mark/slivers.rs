//! Slivers: triangles so thin that a displacement which is smooth everywhere else turns them about. A shader shows each as a spot.
//!
//! The corners of a triangle that a mark would turn too far stay where they are, and around them the mark rises from nothing as smoothly as it does at a border. What lies there and turns then is treated
//! likewise. A reader is not told: to him these few vertices are noise.

use std::{cmp::Reverse, collections::BinaryHeap};

use mesh::{TriMesh, Vec3};

/// No triangle turns further, in degrees; files round positions, which turns slivers a little more.
const STEEPEST: f64 = 15.0;

/// Where more than one triangle in so many would turn too far, the mark is too strong for these triangles, and levelling would only hide
/// that.
const MOST: usize = 50;

/// Triangles that turn too far once the mark rises around others are few, and fewer in every round.
const ROUNDS: usize = 40;

/// Over how many times the root mean square displacement it rises: so far that facets which lie there turn by some degrees at most.
const RISE: f64 = 25.0;

/// Levels a displacement, #V, where it turns slivers. Tells how many vertices it changed.
pub(super) fn level(mesh: &TriMesh, displacement: &mut [[f64; 3]]) -> usize {
    let given = displacement.to_vec();
    let squares: f64 = given.iter().map(|&d| Vec3(d).squared()).sum();
    let rise = RISE * (squares / given.len().max(1) as f64).sqrt();
    let neighbours = mesh.neighbours();
    let mut distance = vec![f64::INFINITY; given.len()];
    for round in 0..ROUNDS {
        let triangles = mesh.triangles().iter();
        let turned: Vec<&[u32; 3]> = triangles
            .filter(|triangle| turns(mesh, triangle, displacement))
            .collect();
        if turned.is_empty() || round == 0 && turned.len() * MOST > mesh.triangle_count() {
            break;
        }
        // Along edges (Dijkstra); the bits of numbers that are not negative are in their order.
        let mut next = BinaryHeap::new();
        for &v in turned.into_iter().flatten() {
            distance[v as usize] = 0.0;
            next.push(Reverse((0_u64, v)));
        }
        while let Some(Reverse((bits, v))) = next.pop() {
            let (here, so_far) = (v as usize, f64::from_bits(bits));
            if so_far > distance[here] || so_far >= rise {
                continue;
            }
            let t = so_far / rise;
            displacement[here] = (Vec3(given[here]) * (t * t * (3.0 - 2.0 * t))).into();
            for &w in neighbours.of(here) {
                let reached = so_far + (mesh.point(w as usize) - mesh.point(here)).norm();
                if reached < distance[w as usize] {
                    distance[w as usize] = reached;
                    next.push(Reverse((reached.to_bits(), w)));
                }
            }
        }
    }
    let pairs = displacement.iter().zip(&given);
    pairs.filter(|(now, before)| now != before).count()
}

/// Whether a displacement turns a triangle too far; one without area has no direction to turn from.
fn turns(mesh: &TriMesh, triangle: &[u32; 3], displacement: &[[f64; 3]]) -> bool {
    let before = triangle.map(|v| mesh.point(v as usize));
    let after: [Vec3; 3] = std::array::from_fn(|i| before[i] + Vec3(displacement[triangle[i] as usize]));
    let [before, after] = [before, after].map(|[a, b, c]| (b - a).cross(c - a));
    let angle = before.cross(after).norm().atan2(before.dot(after));
    before.squared() > 0.0 && angle > STEEPEST.to_radians()
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes;

    /// A wave over a plane with a needle: one vertex almost on the edge across.
    fn wave_over_a_needle() -> (TriMesh, Vec<[f64; 3]>) {
        let plane = shapes::rectangle(20, 20, 1.0, 1.0);
        let mut positions = plane.positions().to_vec();
        let [a, b, c] = plane.triangles()[333].map(|v| v as usize);
        let middle = (plane.point(b) + plane.point(c)) * 0.5;
        positions[a] = (middle + (plane.point(a) - middle) * 1e-6).into();
        let mesh = plane.with_positions(positions).unwrap();
        let wave = mesh
            .positions()
            .iter()
            .map(|p| [0.0, 0.0, 1e-3 * (9.0 * p[0]).sin() * (7.0 * p[1]).cos()]);
        let wave = wave.collect();
        (mesh, wave)
    }

    #[test]
    fn no_triangle_with_area_turns_too_far_and_only_what_is_near_changes() {
        let (mesh, wave) = wave_over_a_needle();
        let turned = |field: &[[f64; 3]]| mesh.triangles().iter().filter(|t| turns(&mesh, t, field)).count();
        assert!(turned(&wave) > 0);
        let mut levelled = wave.clone();
        let changed = level(&mesh, &mut levelled);
        assert_eq!(turned(&levelled), 0);
        assert!((1..=60).contains(&changed), "{changed}");
        let moved = wave.iter().zip(&levelled).filter(|(a, b)| a != b).count();
        assert_eq!(moved, changed);
    }

    #[test]
    fn what_turns_nothing_and_what_turns_all_stay_as_they_are() {
        let mesh = shapes::bumpy_sphere(3, 1);
        for scale in [1e-4, 0.5] {
            let field: Vec<[f64; 3]> = (0..mesh.vertex_count())
                .map(|v| [0.0, 0.0, scale * ((v * v % 7) as f64 - 3.0)])
                .collect();
            let mut levelled = field.clone();
            assert_eq!(level(&mesh, &mut levelled), 0);
            assert_eq!(levelled, field);
        }
    }
}
