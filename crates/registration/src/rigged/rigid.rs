//! Joints that turn and move, and scale at most as one: their motions are blended linearly, or as dual quaternions (Kavan et al. 2008), which keeps the volume where joints turn.

use faer::{Mat, Side, linalg::solvers::Solve};
use job::{Job, JobError};
use mesh::Vec3;

use super::{
    Pairs, Pose, Row,
    linear::{Affine, FLATTEST, Linear, apply, undo},
    median, robust_weights,
};
use crate::{Handedness, fit_similarity, matrix::Mat3};

/// More joints than this are not solved for: each has six unknowns, in several rounds.
const MOST_JOINTS: usize = 256;

/// Rounds of Gauss–Newton at most, and how small a step ends them.
const ROUNDS: usize = 40;
const LAST_ROUNDS: usize = 4;
const SETTLED: f64 = 1e-9;

/// About so many vertices are looked at while the pose is still far off.
const A_FEW: usize = 6000;

/// The power of its weight by which a vertex tells of one joint's motion alone.
const ALMOST_ALONE: i32 = 4;

/// With more damping than this no step helps.
const MOST_DAMPED: f64 = 1e6;

/// Damping at first, beside the mean of the normal equations' diagonal.
const DAMPING: f64 = 1e-3;

/// w, x, y, z.
type Quaternion = [f64; 4];

/// A rigid motion: q of unit length, and ½ t q.
#[derive(Clone, Copy)]
pub(super) struct Motion {
    real: Quaternion,
    dual: Quaternion,
}

/// How a vertex follows several joints.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Blending {
    /// To the weighted mean of the places to which they take it.
    Linear,
    /// By the motion of the weighted mean of their dual quaternions.
    DualQuaternions,
}

/// A rigid motion for each joint, and one scale; of mirrored suspects after z was turned round.
#[derive(Clone)]
pub(super) struct Rigid {
    blending: Blending,
    joints: Vec<Motion>,
    /// The joints' motions as affine maps.
    maps: Vec<Affine>,
    /// How far each morph target is taken.
    shape: Vec<f64>,
    scale: f64,
    mirrors: bool,
}

impl Rigid {
    /// Joints that move so, of a rig without morph targets.
    pub(super) fn of_joints(blending: Blending, joints: Vec<Motion>, scale: f64) -> Self {
        Self {
            blending,
            maps: joints.iter().map(Motion::map).collect(),
            joints,
            shape: Vec::new(),
            scale,
            mirrors: false,
        }
    }

    /// The motion of each joint.
    pub(super) fn joints(&self) -> &[Motion] {
        &self.joints
    }

    /// Moves one joint otherwise.
    pub(super) fn set_joint(&mut self, joint: usize, motion: Motion) {
        self.joints[joint] = motion;
        self.maps[joint] = motion.map();
    }

    /// The same joints, blended otherwise.
    pub(super) fn blended(&self, blending: Blending) -> Self {
        Self {
            blending,
            ..self.clone()
        }
    }

    /// Gauss–Newton with robust weights from a linear pose, and from another that was fitted before: what leaves the middle one of the vertices nearer; none where the joints are too many.
    pub(super) fn fit(
        pairs: &Pairs<'_>,
        blending: Blending,
        linear: &Linear,
        other: Option<&Self>,
        job: &Job,
    ) -> Result<Option<Self>, JobError> {
        if pairs.joints > MOST_JOINTS {
            return Ok(None);
        }
        let step = (pairs.rows.len() / A_FEW).max(1);
        let few: Vec<&Row<'_>> = pairs.rows.iter().step_by(step).collect();
        let left = |pose: &Self| median(few.iter().map(|row| (pose.moved(row) - row.y).norm()).collect());
        let near = Self::near(pairs, blending, linear);
        let mut best: Option<(f64, Self)> = None;
        for mut pose in near.into_iter().chain(other.map(|pose| pose.blended(blending))) {
            if pose.settle(&few, ROUNDS, job)? {
                let left = left(&pose);
                best = best.filter(|(least, _)| *least <= left).or(Some((left, pose)));
            }
        }
        let Some((_, mut pose)) = best else {
            return Ok(None);
        };
        let all: Vec<&Row<'_>> = pairs.rows.iter().collect();
        let is_found = step == 1 || pose.settle(&all, LAST_ROUNDS, job)?;
        Ok(is_found.then_some(pose))
    }

    /// A pose that turns each joint by another angle.
    #[cfg(test)]
    pub(super) fn for_tests(
        blending: Blending,
        joints: usize,
        angle: f64,
        mirrors: bool,
        shape: &[f64],
    ) -> Self {
        let joint = |j: usize| {
            let turn = Vec3([0.3, 0.5, 0.8]) * (angle * (j as f64 - 2.0) / 2.0);
            let still = Motion::of(Mat3::IDENTITY, Vec3([0.0; 3]));
            still.turned(turn).shifted(Vec3([0.02, -0.01, 0.03]) * j as f64)
        };
        Self {
            shape: shape.to_vec(),
            mirrors,
            ..Self::of_joints(blending, (0..joints).map(joint).collect(), 7.0)
        }
    }

    /// The rigid motions by which the joints take what they move most; of the linear pose, the scale and the hand.
    fn near(pairs: &Pairs<'_>, blending: Blending, linear: &Linear) -> Option<Self> {
        let mirrored = pairs.rows.iter().filter(|row| linear.volume(row) < 0.0).count();
        let mirrors = 2 * mirrored > pairs.rows.len();
        let scale = linear.scale();
        let mut own = vec![(Vec::new(), Vec::new(), Vec::new()); pairs.joints];
        for row in &pairs.rows {
            for &(joint, weight) in row.weights {
                let (from, to, weights) = &mut own[joint as usize];
                from.push(row.place(&linear.shape).into());
                to.push((turned_round(row.y, mirrors) * (1.0 / scale)).into());
                weights.push(weight.powi(ALMOST_ALONE));
            }
        }
        let joint = |(from, to, weights): (Vec<_>, Vec<_>, Vec<_>)| {
            let fit = fit_similarity(&from, &to, Some(&weights), Handedness::Proper).ok();
            let rotation = fit.map_or(Mat3::IDENTITY, |fit| fit.transform.rotation.into());
            let all = weights.iter().sum::<f64>().max(f64::MIN_POSITIVE);
            let middle = |points: &[[f64; 3]]| -> Vec3 {
                let weighed = points.iter().zip(&weights);
                weighed.map(|(&p, weight)| Vec3(p) * (weight / all)).sum()
            };
            Motion::of(rotation, middle(&to) - rotation * middle(&from))
        };
        let joints = own.into_iter().map(joint).collect();
        (scale.is_finite() && scale > 0.0).then(|| Self {
            shape: linear.shape.clone(),
            mirrors,
            ..Self::of_joints(blending, joints, scale)
        })
    }

    /// Takes damped steps while they help; false where they are no numbers.
    fn settle(&mut self, rows: &[&Row<'_>], rounds: usize, job: &Job) -> Result<bool, JobError> {
        let mut damping = DAMPING;
        for _round in 0..rounds {
            job.go_on()?;
            let distances = rows.iter().map(|row| (self.moved(row) - row.y).norm()).collect();
            let (weights, _) = robust_weights(distances);
            let before = self.misfit(rows, &weights);
            let (normal, right) = self.normal_equations(rows, &weights);
            let size = normal.nrows();
            let mean = (0..size).map(|i| normal[(i, i)]).sum::<f64>() / size as f64;
            let mut damped = normal.clone();
            (0..size)
                .for_each(|i| damped[(i, i)] += damping * normal[(i, i)] + 1e-12 * mean + f64::MIN_POSITIVE);
            let Ok(factor) = damped.llt(Side::Lower) else {
                return Ok(false);
            };
            let step = factor.solve(&right);
            let tried = self.stepped(&step);
            if tried.misfit(rows, &weights) < before {
                *self = tried;
                damping *= 0.2;
            } else {
                damping *= 10.0;
            }
            let largest = (0..size).map(|i| step[(i, 0)].abs()).fold(0.0, f64::max);
            if !largest.is_finite() {
                return Ok(false);
            }
            if largest < SETTLED || damping > MOST_DAMPED {
                break;
            }
        }
        Ok(true)
    }

    fn misfit(&self, rows: &[&Row<'_>], weights: &[f64]) -> f64 {
        let squares = rows
            .iter()
            .zip(weights)
            .map(|(row, weight)| weight * (self.moved(row) - row.y).squared());
        squares.sum()
    }

    /// Of the unknowns: for each joint a turn and a shift after its motion, then how far each target is taken, and last the logarithm of the scale.
    fn normal_equations(&self, rows: &[&Row<'_>], weights: &[f64]) -> (Mat<f64>, Mat<f64>) {
        let count = self.unknowns();
        let (mut normal, mut right) = (Mat::zeros(count, count), Mat::zeros(count, 1));
        let mut columns: Vec<(usize, Vec3)> = Vec::new();
        for (row, weight) in rows.iter().zip(weights) {
            columns.clear();
            let place = self.columns(row, &mut columns);
            let rest = turned_round(row.y, self.mirrors) - place;
            for &(i, column) in &columns {
                right[(i, 0)] += weight * column.dot(rest);
                for &(k, other) in &columns {
                    normal[(i, k)] += weight * column.dot(other);
                }
            }
        }
        (normal, right)
    }

    /// How a vertex's place changes with each of the unknowns; with that place, z not turned round.
    pub(super) fn columns(&self, row: &Row<'_>, columns: &mut Vec<(usize, Vec3)>) -> Vec3 {
        let place = match self.blending {
            Blending::Linear => self.linear_columns(row, columns),
            Blending::DualQuaternions => self.dual_columns(row, columns),
        };
        columns.push((self.unknowns() - 1, place));
        place
    }

    /// How a vertex's place changes with joints and targets; with that place.
    fn linear_columns(&self, row: &Row<'_>, columns: &mut Vec<(usize, Vec3)>) -> Vec3 {
        let from = row.place(&self.shape);
        for &(joint, weight) in row.weights {
            let there = apply(&self.maps[joint as usize], from);
            for (axis, unit) in Vec3::AXES.into_iter().enumerate() {
                let first = 6 * joint as usize + axis;
                columns.push((first, unit.cross(there) * (weight * self.scale)));
                columns.push((first + 3, unit * (weight * self.scale)));
            }
        }
        let map = self.linear_blend(row.weights);
        self.target_columns(row, |offset| apply(&map, offset) - map[3], columns);
        apply(&map, from) * self.scale
    }

    /// As [`linear_columns`](Self::linear_columns).
    fn dual_columns(&self, row: &Row<'_>, columns: &mut Vec<(usize, Vec3)>) -> Vec3 {
        let from = row.place(&self.shape);
        let blended = self.blend(row.weights);
        let gradients = blended.gradients(from);
        for (joint, share) in self.shares(row.weights) {
            let Motion { real, dual } = self.joints[joint];
            for axis in 0..3 {
                let (turn, shift) = (half_turn(axis, real), half_turn(axis, dual));
                let along = |real: Quaternion, dual: Quaternion| {
                    let all = real.into_iter().chain(dual).zip(&gradients);
                    all.map(|(change, gradient)| *gradient * (change * share * self.scale))
                        .sum::<Vec3>()
                };
                columns.push((6 * joint + axis, along(turn, shift)));
                columns.push((6 * joint + 3 + axis, along([0.0; 4], turn)));
            }
        }
        let origin = blended.apply(Vec3([0.0; 3]));
        self.target_columns(row, |offset| blended.apply(offset) - origin, columns);
        blended.apply(from) * self.scale
    }

    fn target_columns(&self, row: &Row<'_>, turned: impl Fn(Vec3) -> Vec3, columns: &mut Vec<(usize, Vec3)>) {
        let first = 6 * self.joints.len();
        let moved = row.offsets.iter();
        columns.extend(moved.map(|&(target, offset)| (first + target as usize, turned(offset) * self.scale)));
    }

    /// The weighted mean of the joints' maps, without the scale.
    fn linear_blend(&self, weights: &[(u32, f64)]) -> Affine {
        let mut sum = [Vec3::ZERO; 4];
        for &(joint, weight) in weights {
            let map = &self.maps[joint as usize];
            (0..4).for_each(|i| sum[i] += map[i] * weight);
        }
        sum
    }

    /// After a step of the unknowns.
    pub(super) fn stepped(&self, step: &Mat<f64>) -> Self {
        let number = |i: usize| step[(i, 0)];
        let joints = self.joints.iter().enumerate().map(|(joint, motion)| {
            let [turn, shift] =
                [0, 3].map(|first| Vec3(std::array::from_fn(|axis| number(6 * joint + first + axis))));
            motion.turned(turn).shifted(shift)
        });
        let (first, last) = (6 * self.joints.len(), self.unknowns() - 1);
        let shape = self.shape.iter().enumerate();
        let scale = self.scale * number(last).clamp(-1.0, 1.0).exp();
        Self {
            shape: shape.map(|(k, c)| c + number(first + k)).collect(),
            mirrors: self.mirrors,
            ..Self::of_joints(self.blending, joints.collect(), scale)
        }
    }

    /// The joints of a vertex with their weights, the heaviest first; negative where the other of two equal quaternions is nearer to the sum of those before, as Blender has it.
    fn shares(&self, weights: &[(u32, f64)]) -> Vec<(usize, f64)> {
        let mut shares: Vec<(usize, f64)> = weights
            .iter()
            .map(|&(joint, weight)| (joint as usize, weight))
            .collect();
        shares.sort_by(|a, b| b.1.total_cmp(&a.1));
        let mut sum = [0.0; 4];
        for (joint, share) in &mut shares {
            let real = self.joints[*joint].real;
            if dot(real, sum) < 0.0 {
                *share = -*share;
            }
            (0..4).for_each(|i| sum[i] += *share * real[i]);
        }
        shares
    }

    /// As [`moved`](Pose::moved), with where a direction turns there, of unit length; of what isn't mirrored.
    pub(super) fn moved_with(&self, row: &Row<'_>, direction: Vec3) -> (Vec3, Vec3) {
        let map = match self.blending {
            Blending::Linear => self.linear_blend(row.weights),
            Blending::DualQuaternions => self.blend(row.weights).map(),
        };
        let place = apply(&map, row.place(&self.shape)) * self.scale;
        (place, (apply(&map, direction) - map[3]).unit())
    }

    /// How what has these weights moves, as dual quaternions have it.
    pub(super) fn blended_motion(&self, weights: &[(u32, f64)]) -> Motion {
        let blended = self.blend(weights);
        let (w, v, t) = blended.parts();
        let real = [w, v[0], v[1], v[2]];
        Motion { real, dual: [0.0; 4] }.shifted(t)
    }

    /// Not of unit length.
    fn blend(&self, weights: &[(u32, f64)]) -> Motion {
        let mut sum = Motion {
            real: [0.0; 4],
            dual: [0.0; 4],
        };
        for (joint, share) in self.shares(weights) {
            let Motion { real, dual } = self.joints[joint];
            (0..4).for_each(|i| sum.real[i] += share * real[i]);
            (0..4).for_each(|i| sum.dual[i] += share * dual[i]);
        }
        sum
    }
}

impl Pose for Rigid {
    fn moved(&self, row: &Row<'_>) -> Vec3 {
        let from = row.place(&self.shape);
        let there = match self.blending {
            Blending::Linear => apply(&self.linear_blend(row.weights), from),
            Blending::DualQuaternions => self.blend(row.weights).apply(from),
        };
        turned_round(there * self.scale, self.mirrors)
    }

    fn undone(&self, row: &Row<'_>) -> Option<Vec3> {
        let y = turned_round(row.y, self.mirrors) * (1.0 / self.scale);
        let before = match self.blending {
            Blending::Linear => undo(&self.linear_blend(row.weights), y, FLATTEST)?,
            Blending::DualQuaternions => self.blend(row.weights).undo(y),
        };
        Some(before - row.offset(&self.shape))
    }

    fn scale(&self) -> f64 {
        self.scale
    }

    fn unknowns(&self) -> usize {
        6 * self.joints.len() + self.shape.len() + 1
    }
}

impl Motion {
    pub(super) fn of(rotation: Mat3, offset: Vec3) -> Self {
        let real = quaternion(rotation);
        Self { real, dual: [0.0; 4] }.shifted(offset)
    }

    /// This motion, and then a turn by a vector's length about it.
    pub(super) fn turned(self, turn: Vec3) -> Self {
        let angle = turn.norm();
        let half = 0.5 * angle;
        let factor = if angle > 1e-12 { half.sin() / angle } else { 0.5 };
        let Vec3([x, y, z]) = turn * factor;
        let by = [half.cos(), x, y, z];
        let (real, dual) = (product(by, self.real), product(by, self.dual));
        let length = dot(real, real).sqrt();
        Self {
            real: real.map(|x| x / length),
            dual: dual.map(|x| x / length),
        }
    }

    /// This motion, and then a shift.
    pub(super) fn shifted(self, Vec3([x, y, z]): Vec3) -> Self {
        let change = product([0.0, 0.5 * x, 0.5 * y, 0.5 * z], self.real);
        Self {
            real: self.real,
            dual: std::array::from_fn(|i| self.dual[i] + change[i]),
        }
    }

    /// The rotation and the translation of a blend.
    fn parts(&self) -> (f64, Vec3, Vec3) {
        let length = dot(self.real, self.real).sqrt().max(f64::MIN_POSITIVE);
        let [w, x, y, z] = self.real.map(|x| x / length);
        let [dual_w, dual_x, dual_y, dual_z] = self.dual.map(|x| x / length);
        let (v, dual) = (Vec3([x, y, z]), Vec3([dual_x, dual_y, dual_z]));
        (w, v, (dual * w - v * dual_w + v.cross(dual)) * 2.0)
    }

    pub(super) fn apply(&self, x: Vec3) -> Vec3 {
        let (w, v, t) = self.parts();
        x + v.cross(v.cross(x) + x * w) * 2.0 + t
    }

    /// The same as an affine map.
    fn map(&self) -> Affine {
        let (w, v, t) = self.parts();
        let [a, b, c] = Vec3::AXES.map(|unit| unit + v.cross(v.cross(unit) + unit * w) * 2.0);
        [a, b, c, t]
    }

    fn undo(&self, y: Vec3) -> Vec3 {
        let (w, v, t) = self.parts();
        let (v, x) = (-v, y - t);
        x + v.cross(v.cross(x) + x * w) * 2.0
    }

    /// How the place of a point changes with the eight numbers of a blend, by central differences.
    fn gradients(&self, x: Vec3) -> [Vec3; 8] {
        const STEP: f64 = 1e-6;
        std::array::from_fn(|i| {
            let [forth, back] = [STEP, -STEP].map(|step| {
                let mut changed = *self;
                match i {
                    0..4 => changed.real[i] += step,
                    _ => changed.dual[i - 4] += step,
                }
                changed.apply(x)
            });
            (forth - back) * (0.5 / STEP)
        })
    }
}

/// ½ e q, the change of q with a turn about an axis.
fn half_turn(axis: usize, q: Quaternion) -> Quaternion {
    let mut by = [0.0; 4];
    by[axis + 1] = 0.5;
    product(by, q)
}

fn product([aw, ax, ay, az]: Quaternion, [bw, bx, by, bz]: Quaternion) -> Quaternion {
    [
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    ]
}

fn dot(a: Quaternion, b: Quaternion) -> f64 {
    a.into_iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The quaternion of a rotation: of the four ways to it the one without cancellation (Shepperd 1978).
fn quaternion(rotation: Mat3) -> Quaternion {
    let [[a, b, c], [d, e, f], [g, h, i]] = rotation.rows();
    let squares = [1.0 + a + e + i, 1.0 + a - e - i, 1.0 - a + e - i, 1.0 - a - e + i];
    let largest = (0..4)
        .max_by(|&p, &q| squares[p].total_cmp(&squares[q]))
        .unwrap_or(0);
    let rows = [
        [squares[0], h - f, c - g, d - b],
        [h - f, squares[1], b + d, c + g],
        [c - g, b + d, squares[2], f + h],
        [d - b, c + g, f + h, squares[3]],
    ];
    let length = dot(rows[largest], rows[largest]).sqrt().max(f64::MIN_POSITIVE);
    rows[largest].map(|x| x / length)
}

fn turned_round(Vec3([x, y, z]): Vec3, mirrors: bool) -> Vec3 {
    Vec3([x, y, if mirrors { -z } else { z }])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn which_of_two_equal_quaternions_counts_says_the_sum_of_those_that_weigh_more() {
        let about_z = |w: f64| Motion {
            real: [w, 0.0, 0.0, (1.0 - w * w).sqrt()],
            dual: [0.0; 4],
        };
        // The last is nearer to the opposite of the first, but to the sum of both before it.
        let joints = [-0.1, 0.087, 1.0].map(about_z).to_vec();
        let pose = Rigid::of_joints(Blending::DualQuaternions, joints, 1.0);
        assert!(dot(pose.joints[0].real, pose.joints[2].real) < 0.0);
        let shares = pose.shares(&[(0, 0.25), (1, 0.35), (2, 0.4)]);
        assert_eq!(shares, [(2, 0.4), (1, 0.35), (0, 0.25)]);
        let alone = pose.shares(&[(0, 0.4), (2, 0.6)]);
        assert_eq!(alone, [(2, 0.6), (0, -0.4)]);
    }
}
