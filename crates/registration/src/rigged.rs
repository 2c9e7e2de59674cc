//! The pose of a model by its own rig.
//!
//! With linear blend skinning a posed vertex is y = Σⱼ wⱼ Aⱼ x, linear in the joints' affine maps Aⱼ (3 × 4): robust least squares over all vertices finds them. What moves each vertex, M = Σⱼ wⱼ Aⱼ, is then undone.
//! Twelve numbers a joint are few beside the vertices that it moves, so a mark stays; nothing is assumed smooth.

use faer::{Mat, Side, linalg::solvers::Solve};
use mesh::{Rig, TriMesh, Vec3};

use crate::{Correspondence, matrix::Mat3};

/// A suspect brought back into the original's pose.
#[derive(Clone, Debug)]
pub struct Unposed {
    /// Where the suspect's vertices were before it was posed (#V of the suspect); those of no partner stay. In the original's frame.
    pub positions: Vec<[f64; 3]>,
    /// The partners whose place could be undone: others were folded away.
    pub map: Correspondence,
    /// The median distance of posed vertices from where the rig takes them, in diagonals of the original.
    pub residual: f64,
}

/// More unknowns than this are not solved for: joints are tens, rarely hundreds.
const MOST_JOINTS: usize = 1024;

/// Rounds of robust weights.
const ROUNDS: usize = 8;

/// Directions in which nothing is told of a joint: this much of the mean of what is told holds it to the whole model's motion.
const RIDGE: f64 = 1e-10;

/// What is pressed flatter than this, beside the whole model's scale, is not stretched again: noise would be, too.
const FLATTEST: f64 = 0.1;

/// Brings a suspect, whose vertices were found again, back into the original's pose; none where the rig has too many joints or says nothing of enough vertices.
///
/// Blind to what a mark says: only places and weights are looked at.
pub fn unpose(original: &TriMesh, rig: &Rig, suspect: &TriMesh, map: &Correspondence) -> Option<Unposed> {
    let fits = rig.vertices() == original.vertex_count() && (1..=MOST_JOINTS).contains(&rig.joints());
    let pairs = Pairs::of(original, rig, suspect, map);
    if !fits || pairs.rows.len() < 12 {
        return None;
    }
    let mut weights = vec![1.0; pairs.rows.len()];
    let mut pose = pairs.solve(&weights)?;
    let mut median = pairs.reweigh(&pose, &mut weights);
    for _round in 1..ROUNDS {
        if median <= 1e-14 * pairs.size {
            break;
        }
        pose = pairs.solve(&weights)?;
        median = pairs.reweigh(&pose, &mut weights);
    }
    Some(pairs.undone(&pose, suspect, map, median))
}

/// One vertex in both poses.
struct Row<'a> {
    vertex: usize,
    /// In the original, from its centre, in diagonals.
    x: Vec3,
    /// In the suspect, from its centre.
    y: Vec3,
    weights: &'a [(u32, f64)],
}

/// All vertices that have a partner and a joint.
struct Pairs<'a> {
    rows: Vec<Row<'a>>,
    joints: usize,
    diagonal: f64,
    centre: Vec3,
    /// Of the suspect, root mean square.
    size: f64,
}

/// Where a joint takes [x; 1]: four columns.
type Affine = [Vec3; 4];

impl<'a> Pairs<'a> {
    fn of(original: &TriMesh, rig: &'a Rig, suspect: &TriMesh, map: &Correspondence) -> Self {
        let diagonal = original.bounding_box().diagonal();
        let found = map.suspect_of.iter().enumerate().take(rig.vertices());
        let mut rows: Vec<Row<'a>> = found
            .filter_map(|(vertex, partner)| {
                let weights = rig.weights_of(vertex);
                let y = Vec3(suspect.positions()[(*partner)? as usize]);
                let x = original.point(vertex) * (1.0 / diagonal);
                (!weights.is_empty()).then_some(Row {
                    vertex,
                    x,
                    y,
                    weights,
                })
            })
            .collect();
        let mean = |of: fn(&Row<'_>) -> Vec3| {
            let sum = rows.iter().map(of).fold(Vec3([0.0; 3]), |sum, v| sum + v);
            sum * (1.0 / rows.len().max(1) as f64)
        };
        let (centre, suspect_centre) = (mean(|row| row.x), mean(|row| row.y));
        for row in &mut rows {
            row.x = row.x - centre;
            row.y = row.y - suspect_centre;
        }
        let squares: f64 = rows.iter().map(|row| row.y.squared()).sum();
        Self {
            size: (squares / rows.len().max(1) as f64).sqrt(),
            joints: rig.joints(),
            rows,
            diagonal,
            centre,
        }
    }

    /// The weighted least squares of Σⱼ wⱼ Aⱼ [x; 1] − y: first of one affine map for all, then of what joints add to it.
    fn solve(&self, robust: &[f64]) -> Option<Vec<Affine>> {
        let whole = self.normal_equations(1, robust, |_| &[(0, 1.0)], |row| row.y)?;
        let rest = |row: &Row<'_>| row.y - apply(&whole[0], row.x);
        let own = self.normal_equations(self.joints, robust, |row| row.weights, rest)?;
        let add = |joint: Affine| std::array::from_fn(|k| joint[k] + whole[0][k]);
        Some(own.into_iter().map(add).collect())
    }

    fn normal_equations<'r>(
        &'r self,
        joints: usize,
        robust: &[f64],
        weights_of: impl Fn(&'r Row<'a>) -> &'r [(u32, f64)],
        target: impl Fn(&'r Row<'a>) -> Vec3,
    ) -> Option<Vec<Affine>> {
        let size = 4 * joints;
        let (mut normal, mut right) = (Mat::<f64>::zeros(size, size), Mat::<f64>::zeros(size, 3));
        for (row, &weight) in self.rows.iter().zip(robust).filter(|(_, weight)| **weight > 0.0) {
            let Vec3([x, y, z]) = row.x;
            let (place, goal) = ([x, y, z, 1.0], target(row));
            let own = weights_of(row);
            for &(a, share_a) in own {
                let a = 4 * a as usize;
                for (i, p) in place.iter().enumerate() {
                    let row_weight = weight * share_a * p;
                    for axis in 0..3 {
                        right[(a + i, axis)] += row_weight * goal.0[axis];
                    }
                    for &(b, share_b) in own {
                        let b = 4 * b as usize;
                        for (k, q) in place.iter().enumerate() {
                            normal[(a + i, b + k)] += row_weight * share_b * q;
                        }
                    }
                }
            }
        }
        let trace: f64 = (0..size).map(|i| normal[(i, i)]).sum();
        let ridge = (RIDGE * trace / size as f64).max(f64::MIN_POSITIVE);
        (0..size).for_each(|i| normal[(i, i)] += ridge);
        let solved = normal.llt(Side::Lower).ok()?.solve(&right);
        let column = |joint: usize, k: usize| Vec3(std::array::from_fn(|axis| solved[(4 * joint + k, axis)]));
        let found: Vec<Affine> = (0..joints)
            .map(|joint| std::array::from_fn(|k| column(joint, k)))
            .collect();
        let is_finite = found.iter().flatten().all(|v| v.0.iter().all(|x| x.is_finite()));
        is_finite.then_some(found)
    }

    /// Welsch's weights by the distances that a pose leaves, and their median.
    fn reweigh(&self, pose: &[Affine], weights: &mut [f64]) -> f64 {
        let left = |row: &Row<'_>| (apply(&blend(pose, row.weights), row.x) - row.y).norm();
        let distances: Vec<f64> = self.rows.iter().map(left).collect();
        let mut sorted = distances.clone();
        let middle = sorted.len() / 2;
        let (_, &mut median, _) = sorted.select_nth_unstable_by(middle, f64::total_cmp);
        for (weight, distance) in weights.iter_mut().zip(&distances) {
            let beside = distance / median.max(f64::MIN_POSITIVE);
            *weight = (-0.125 * beside * beside).exp();
        }
        median
    }

    /// The suspect before it was posed.
    fn undone(&self, pose: &[Affine], suspect: &TriMesh, map: &Correspondence, median: f64) -> Unposed {
        let scale = self.scale(pose);
        let mut positions = suspect.positions().to_vec();
        let mut found = vec![None; map.suspect_of.len()];
        for row in &self.rows {
            let motion = blend(pose, row.weights);
            let partner = map.suspect_of[row.vertex];
            let (Some(x), Some(partner)) = (inverse(&motion, row.y, FLATTEST * scale), partner) else {
                continue;
            };
            positions[partner as usize] = ((x + self.centre) * self.diagonal).into();
            found[row.vertex] = Some(partner);
        }
        Unposed {
            positions,
            map: Correspondence { suspect_of: found },
            residual: median / scale,
        }
    }

    /// By how much the pose scales, in the median of the vertices.
    fn scale(&self, pose: &[Affine]) -> f64 {
        let volume = |row: &Row<'_>| {
            let [a, b, c, _] = blend(pose, row.weights);
            a.dot(b.cross(c)).abs().cbrt()
        };
        let mut scales: Vec<f64> = self.rows.iter().map(volume).collect();
        let middle = scales.len() / 2;
        *scales.select_nth_unstable_by(middle, f64::total_cmp).1
    }
}

fn blend(pose: &[Affine], weights: &[(u32, f64)]) -> Affine {
    let mut sum = [Vec3([0.0; 3]); 4];
    for &(joint, weight) in weights {
        for (total, column) in sum.iter_mut().zip(pose[joint as usize]) {
            *total = *total + column * weight;
        }
    }
    sum
}

fn apply([a, b, c, t]: &Affine, Vec3([x, y, z]): Vec3) -> Vec3 {
    *a * x + *b * y + *c * z + *t
}

/// Where a motion takes a point from; none where it presses some direction flatter than a factor.
fn inverse([a, b, c, t]: &Affine, y: Vec3, flattest: f64) -> Option<Vec3> {
    let decomposed = crate::matrix::svd(&Mat3([*a, *b, *c]).transposed());
    if decomposed.values[2].is_nan() || decomposed.values[2] <= flattest {
        return None;
    }
    let (Mat3(left), Mat3(right)) = (decomposed.left, decomposed.right);
    let offset = y - *t;
    let steps = (0..3).map(|i| right[i] * (left[i].dot(offset) / decomposed.values[i]));
    Some(steps.fold(Vec3([0.0; 3]), |sum, step| sum + step))
}

#[cfg(test)]
mod tests {
    use mesh::shapes;

    use super::*;

    const JOINTS: usize = 5;

    /// A torus that bends at five places, and hats as weights.
    fn rigged() -> (TriMesh, Rig) {
        let mesh = shapes::bumpy_torus(60, 40, 1);
        let weights = |p: &[f64; 3]| {
            let turn = (p[1].atan2(p[0]) / std::f64::consts::TAU + 0.5) * JOINTS as f64;
            let (joint, share) = (turn.floor(), turn.fract());
            let [here, next] = [joint as u32, joint as u32 + 1].map(|joint| joint % JOINTS as u32);
            vec![(here, 1.0 - share), (next, share)]
        };
        let rig = Rig::new(&mesh.positions().iter().map(weights).collect::<Vec<_>>());
        (mesh, rig)
    }

    fn turned(axis: usize, angle: f64, offset: f64) -> Affine {
        let (sin, cos) = angle.sin_cos();
        let mut columns = [[0.0; 3]; 3];
        columns[axis][axis] = 1.0;
        let [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
        (columns[a][a], columns[a][b], columns[b][a], columns[b][b]) = (cos, sin, -sin, cos);
        let [a, b, c] = columns.map(|column| Vec3(column) * 3.0);
        [a, b, c, Vec3([10.0 * offset, -offset, offset])]
    }

    fn posed(mesh: &TriMesh, rig: &Rig, angle: f64) -> TriMesh {
        let joint = |j: usize| turned(j % 3, angle * (j as f64 - 2.0) / 2.0, j as f64);
        let pose: Vec<Affine> = (0..JOINTS).map(joint).collect();
        let place = |v: usize| apply(&blend(&pose, rig.weights_of(v)), mesh.point(v)).into();
        mesh.with_positions((0..mesh.vertex_count()).map(place).collect())
            .unwrap()
    }

    fn identity(vertices: usize) -> Correspondence {
        Correspondence {
            suspect_of: (0..vertices as u32).map(Some).collect(),
        }
    }

    #[test]
    fn a_pose_is_undone_and_what_was_marked_before_it_stays() {
        let (mesh, rig) = rigged();
        let diagonal = mesh.bounding_box().diagonal();
        // A mark of alternating sign, which no joint can imitate.
        let mark = |v: usize| 4e-4 * diagonal * if (v * 7919) % 13 < 6 { 1.0 } else { -1.0 };
        let marked = (0..mesh.vertex_count()).map(|v| (mesh.point(v) * (1.0 + mark(v))).into());
        let marked = mesh.with_positions(marked.collect()).unwrap();
        for angle in [0.0, 1.0, 2.0] {
            let suspect = posed(&marked, &rig, angle);
            let map = identity(mesh.vertex_count());
            let found = unpose(&mesh, &rig, &suspect, &map).unwrap();
            let (mut wrong, mut sizes) = (0.0, 0.0);
            for v in (0..mesh.vertex_count()).filter(|&v| found.map.suspect_of[v].is_some()) {
                wrong += (Vec3(found.positions[v]) - marked.point(v)).squared();
                sizes += (marked.point(v) - mesh.point(v)).squared();
            }
            assert!(found.map.matched() > mesh.vertex_count() * 19 / 20);
            assert!(wrong < 0.05 * sizes, "angle {angle}: {wrong} of {sizes}");
            assert!(found.residual < 1e-3 * diagonal);
        }
    }

    #[test]
    fn another_shape_of_the_same_net_is_not_explained() {
        let (mesh, rig) = rigged();
        let other = shapes::bumpy_torus(60, 40, 2);
        let suspect = posed(&other, &rig, 1.0);
        let found = unpose(&mesh, &rig, &suspect, &identity(mesh.vertex_count())).unwrap();
        assert!(found.residual > 1e-3, "{}", found.residual);
    }

    #[test]
    fn a_joint_of_one_vertex_and_a_flat_part_are_no_trouble() {
        let (mesh, _) = rigged();
        let flat = |p: &[f64; 3]| [p[0], p[1], 0.0];
        let flat = mesh
            .with_positions(mesh.positions().iter().map(flat).collect())
            .unwrap();
        let weights = |v| vec![(u32::from(v > 0) + u32::from(v > 1000), 1.0)];
        let rig = Rig::new(&(0..mesh.vertex_count()).map(weights).collect::<Vec<_>>());
        let found = unpose(
            &flat,
            &rig,
            &shapes::scaled(&flat, 5.0),
            &identity(mesh.vertex_count()),
        )
        .unwrap();
        assert!(found.residual < 1e-7, "{}", found.residual);
    }
}
