//! Slivers: triangles so thin that a displacement which is smooth everywhere else turns them about. A shader shows each as a spot.
//!
//! The corners of a triangle that a mark would turn too far move less, those of a needle not at all, and around them the mark rises again as smoothly as it does at a border. What turns then is treated
//! likewise. A reader is not told: to him what is missing there is noise.

use std::{cmp::Reverse, collections::BinaryHeap};

use mesh::{TriMesh, Vec3};

/// No triangle turns further, in degrees; files round positions, which turns slivers a little more.
const STEEPEST: f64 = 15.0;

/// In a file as it is written none turns further: what is so small that rounding turns it stays where it is.
const STEEPEST_HELD: f64 = 20.0;

/// How far one turns that would have turned further: a little less, since its neighbours will be held back, too.
const AIM: f64 = 12.0;

/// What is left of a mark where less than this would be left.
const LEAST: f64 = 0.1;

/// Over how many times the root mean square displacement it rises from nothing: so far that facets which lie there turn by some degrees at most.
const RISE: f64 = 25.0;

/// Where more than one triangle in so many would turn too far, a mark of a strength that somebody chose is too strong for these triangles; levelling would hide
/// that.
const MANY: usize = 50;

/// Whether so many triangles turn too far that it can't be for their slenderness.
pub(super) fn turns_many(mesh: &TriMesh, displacement: &[[f64; 3]]) -> bool {
    let triangles = mesh.triangles().iter();
    let far = triangles.filter(|triangle| turn(mesh, triangle, displacement) > STEEPEST);
    far.count() * MANY > mesh.triangle_count()
}

/// The corners of triangles that a displacement which a file holds turns too far, none twice; nothing where these are too many.
pub(super) fn turned_by_rounding(mesh: &TriMesh, held: &[[f64; 3]]) -> Vec<u32> {
    let triangles = mesh.triangles().iter();
    let turned = triangles.filter(|triangle| turn(mesh, triangle, held) > STEEPEST_HELD);
    let mut corners: Vec<u32> = turned.flatten().copied().collect();
    if corners.len() / 3 * MANY > mesh.triangle_count() {
        return Vec::new();
    }
    corners.sort_unstable();
    corners.dedup();
    corners
}

/// Levels a displacement, #V, around vertices that are to stay where they are, and where it turns triangles too far.
pub(super) fn level(mesh: &TriMesh, pinned: &[u32], displacement: &mut [[f64; 3]]) {
    let given = displacement.to_vec();
    let squares: f64 = given.iter().map(|&d| Vec3(d).squared()).sum();
    let rise = RISE * (squares / given.len().max(1) as f64).sqrt();
    let neighbours = mesh.neighbours();
    // How far up the rise each vertex is, from 0 to 1.
    let mut height = vec![1.0_f64; given.len()];
    let mut is_new = vec![true; given.len()];
    let mut lowered: BinaryHeap<_> = pinned.iter().map(|&v| Reverse((0, v))).collect();
    loop {
        for triangle in mesh.triangles() {
            let [a, b, c] = triangle.map(|v| is_new[v as usize]);
            let angle = if a || b || c {
                turn(mesh, triangle, displacement)
            } else {
                0.0
            };
            if angle > STEEPEST {
                let share = AIM.to_radians().tan() / angle.min(85.0).to_radians().tan();
                for &v in triangle {
                    let lower = height_of(share * share_at(height[v as usize]));
                    lowered.push(Reverse((lower.to_bits(), v)));
                }
            }
        }
        // A triangle turns only while one of its corners can come down, by a fifth at least or to nothing: this ends.
        if lowered.is_empty() {
            return;
        }
        is_new.fill(false);
        // Along edges (Dijkstra); the bits of numbers that are not negative are in their order.
        while let Some(Reverse((bits, v))) = lowered.pop() {
            let (here, reached) = (v as usize, f64::from_bits(bits));
            if reached >= height[here] {
                continue;
            }
            height[here] = reached;
            is_new[here] = true;
            displacement[here] = (Vec3(given[here]) * share_at(reached)).into();
            for &w in neighbours.of(here) {
                let step = (mesh.point(w as usize) - mesh.point(here)).norm() / rise;
                if reached + step < height[w as usize] {
                    lowered.push(Reverse(((reached + step).to_bits(), w)));
                }
            }
        }
    }
}

/// What is left of a mark at a height of the rise: 3 t² − 2 t³.
fn share_at(height: f64) -> f64 {
    height * height * (3.0 - 2.0 * height)
}

/// At which height so much is left; 0 for what is not worth keeping.
fn height_of(share: f64) -> f64 {
    if share < LEAST {
        return 0.0;
    }
    0.5 - ((1.0 - 2.0 * share).asin() / 3.0).sin()
}

/// By how many degrees a displacement turns a triangle; one without area has no direction to turn from.
fn turn(mesh: &TriMesh, triangle: &[u32; 3], displacement: &[[f64; 3]]) -> f64 {
    let before = triangle.map(|v| mesh.point(v as usize));
    let after: [Vec3; 3] = std::array::from_fn(|i| before[i] + Vec3(displacement[triangle[i] as usize]));
    let [before, after] = [before, after].map(|[a, b, c]| (b - a).cross(c - a));
    before.cross(after).norm().atan2(before.dot(after)).to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes;
    use proptest::prelude::*;

    /// A plane whose vertices were drawn towards each other at random: needles and caps of all heights, as many as there are other triangles.
    fn crushed(seed: u64, evenness: i32) -> TriMesh {
        let plane = shapes::rectangle(24, 24, 1.0, 1.0);
        let jitter = shapes::jittered(&plane, 2.0, seed);
        let mut positions = plane.positions().to_vec();
        for (v, triangle) in plane.triangles().iter().enumerate().step_by(5) {
            let [a, b, c] = triangle.map(|v| v as usize);
            let middle = (plane.point(b) + plane.point(c)) * 0.5;
            let height = 10f64.powi(-(v as i32 % evenness));
            let side = jitter.point(a) - plane.point(a);
            positions[a] = (middle + (plane.point(a) - middle + side * 0.01) * height).into();
        }
        plane.with_positions(positions).unwrap()
    }

    fn wave(mesh: &TriMesh, height: f64) -> Vec<[f64; 3]> {
        let of = |p: &[f64; 3]| [0.0, 0.0, height * (9.0 * p[0]).sin() * (7.0 * p[1]).cos()];
        mesh.positions().iter().map(of).collect()
    }

    fn farthest(mesh: &TriMesh, field: &[[f64; 3]]) -> f64 {
        let triangles = mesh.triangles().iter();
        triangles.map(|t| turn(mesh, t, field)).fold(0.0, f64::max)
    }

    proptest! {
        #[test]
        fn no_triangle_with_area_turns_too_far_and_no_vertex_moves_further_or_elsewhere(
            seed in any::<u64>(),
            evenness in 1i32..9,
            height in 1e-4..0.1f64,
        ) {
            let mesh = crushed(seed, evenness);
            let whole = wave(&mesh, height);
            let mut levelled = whole.clone();
            level(&mesh, &[], &mut levelled);
            prop_assert!(farthest(&mesh, &levelled) <= STEEPEST);
            for (now, before) in levelled.iter().zip(&whole) {
                prop_assert!(now[2].abs() <= before[2].abs() && now[2] * before[2] >= 0.0);
            }
        }
    }

    #[test]
    fn around_one_needle_few_vertices_change() {
        let plane = shapes::rectangle(20, 20, 1.0, 1.0);
        let mut positions = plane.positions().to_vec();
        let [a, b, c] = plane.triangles()[333].map(|v| v as usize);
        let middle = (plane.point(b) + plane.point(c)) * 0.5;
        positions[a] = (middle + (plane.point(a) - middle) * 1e-6).into();
        let mesh = plane.with_positions(positions).unwrap();
        let whole = wave(&mesh, 1e-3);
        assert!(farthest(&mesh, &whole) > STEEPEST);
        let mut levelled = whole.clone();
        level(&mesh, &[], &mut levelled);
        let changed = whole.iter().zip(&levelled).filter(|(a, b)| a != b).count();
        assert!((1..=60).contains(&changed), "{changed}");
    }

    #[test]
    fn what_turns_nothing_stays_as_it_is() {
        let mesh = shapes::bumpy_sphere(3, 1);
        let whole = wave(&mesh, 1e-4);
        let mut levelled = whole.clone();
        level(&mesh, &[], &mut levelled);
        assert_eq!(levelled, whole);
        assert!(!turns_many(&mesh, &whole));
        assert!(turns_many(&mesh, &wave(&mesh, 0.5)));
    }

    #[test]
    fn a_height_leaves_the_share_that_it_was_looked_up_for() {
        for share in [LEAST, 0.3, 0.5, 0.99, 1.0] {
            assert!((share_at(height_of(share)) - share).abs() < 1e-12);
        }
        assert_eq!(height_of(0.99 * LEAST), 0.0);
    }
}
