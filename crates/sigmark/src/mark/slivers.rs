//! Slivers: triangles so thin that a displacement which is smooth everywhere else turns them about. A shader shows each as a spot.
//!
//! The corners of a triangle that a mark would turn too far get one displacement in common, and so do those of its neighbours where that turns these.
//! A reader is not told: to him these few vertices are noise.

use mesh::{TriMesh, Vec3};

/// No triangle turns further, in degrees; files round positions, which turns slivers a little more.
const STEEPEST: f64 = 15.0;

/// Where more than one triangle in so many would turn too far, the mark is too strong for these triangles, and levelling would only hide
/// that.
const MOST: usize = 50;

/// Triangles that turn too far once their neighbours were levelled are few, and fewer in every round.
const ROUNDS: usize = 40;

/// Levels a displacement, #V, where it turns slivers. Tells how many vertices it changed.
pub(super) fn level(mesh: &TriMesh, displacement: &mut [[f64; 3]]) -> usize {
    let given = displacement.to_vec();
    let mut groups = Groups((0..displacement.len() as u32).collect());
    for round in 0..ROUNDS {
        let turned: Vec<&[u32; 3]> = mesh
            .triangles()
            .iter()
            .filter(|triangle| turns(mesh, triangle, displacement))
            .collect();
        if turned.is_empty() {
            break;
        }
        if round == 0 && turned.len() * MOST > mesh.triangle_count() {
            return 0;
        }
        for [a, b, c] in turned {
            groups.join(*a, *b);
            groups.join(*a, *c);
        }
        groups.take_means(&given, displacement);
    }
    displacement
        .iter()
        .zip(&given)
        .filter(|(now, before)| now != before)
        .count()
}

/// Whether a displacement turns a triangle too far; one without area has no direction to turn from.
fn turns(mesh: &TriMesh, triangle: &[u32; 3], displacement: &[[f64; 3]]) -> bool {
    let before = triangle.map(|v| mesh.point(v as usize));
    let after: [Vec3; 3] = std::array::from_fn(|i| before[i] + Vec3(displacement[triangle[i] as usize]));
    let [before, after] = [before, after].map(|[a, b, c]| (b - a).cross(c - a));
    let angle = before.cross(after).norm().atan2(before.dot(after));
    before.squared() > 0.0 && angle > STEEPEST.to_radians()
}

/// Vertices that move as one: each has another of its group, the first has itself.
struct Groups(Vec<u32>);

impl Groups {
    fn first(&mut self, v: u32) -> u32 {
        let mut first = v;
        while self.0[first as usize] != first {
            first = self.0[first as usize];
        }
        self.0[v as usize] = first;
        first
    }

    fn join(&mut self, a: u32, b: u32) {
        let [a, b] = [self.first(a), self.first(b)];
        self.0[a.max(b) as usize] = a.min(b);
    }

    /// Gives every vertex the mean displacement of its group.
    fn take_means(&mut self, given: &[[f64; 3]], displacement: &mut [[f64; 3]]) {
        let mut sums = std::collections::BTreeMap::<u32, (Vec3, usize)>::new();
        let first_of: Vec<u32> = (0..given.len() as u32).map(|v| self.first(v)).collect();
        for (v, &first) in first_of
            .iter()
            .enumerate()
            .filter(|&(v, &first)| v as u32 != first)
        {
            let sum = sums.entry(first).or_insert((Vec3(given[first as usize]), 1));
            *sum = (sum.0 + Vec3(given[v]), sum.1 + 1);
        }
        for (v, first) in first_of.iter().enumerate() {
            if let Some(&(sum, count)) = sums.get(first) {
                displacement[v] = (sum / count as f64).into();
            }
        }
    }
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
    fn no_triangle_with_area_turns_too_far_and_few_vertices_change() {
        let (mesh, wave) = wave_over_a_needle();
        let turned = |field: &[[f64; 3]]| mesh.triangles().iter().filter(|t| turns(&mesh, t, field)).count();
        assert!(turned(&wave) > 0);
        let mut levelled = wave.clone();
        let changed = level(&mesh, &mut levelled);
        assert_eq!(turned(&levelled), 0);
        assert!((1..=12).contains(&changed), "{changed}");
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
