//! Linear blend skinning, with morph targets.

use faer::{Mat, Side, linalg::solvers::Solve};
use job::{Job, JobError};
use mesh::Vec3;

use super::{Pairs, Pose, Row, median, robust_weights};
use crate::matrix::{Mat3, svd};

/// Rounds of robust weights.
const ROUNDS: usize = 8;

/// Rounds at most, before that, until morph targets are settled, and by how much less than all a round has to leave.
const ROUNDS_OF_TARGETS: usize = 24;
const SETTLED: f64 = 1e-6;

/// How far a step of the targets is taken: less, where the whole does not help.
const SHARES: [f64; 4] = [1.0, 0.5, 0.25, 0.0625];

/// What joints can do as well, and what is said twice, is held where it is by this much of what is told of a target.
const RIDGE_OF_TARGETS: f64 = 1e-8;

/// Directions in which nothing is told of a joint: this much of the mean of what is told holds it to the whole model's motion.
const RIDGE: f64 = 1e-10;

/// What is pressed flatter than this, beside the whole model's scale, is not stretched again: noise would be, too.
pub(super) const FLATTEST: f64 = 0.1;

/// Where a joint takes [x; 1]: four columns.
pub(super) type Affine = [Vec3; 4];

/// An affine map for each joint.
pub(super) struct Linear {
    pub(super) joints: Vec<Affine>,
    /// How far each morph target is taken.
    pub(super) shape: Vec<f64>,
    scale: f64,
}

impl Linear {
    /// The robust least squares of Σⱼ wⱼ Aⱼ [x + Σₖ cₖ dₖ; 1] − y.
    pub(super) fn fit(pairs: &Pairs<'_>, job: &Job) -> Result<Option<Self>, JobError> {
        let alike = vec![1.0; pairs.rows.len()];
        let Some(mut pose) = Self::solve(pairs, &alike, vec![0.0; pairs.targets]) else {
            return Ok(None);
        };
        // What a target moves far must not be taken for what fits nothing.
        for _round in 0..ROUNDS_OF_TARGETS {
            job.go_on()?;
            if pairs.targets == 0 || !pose.settle_targets(pairs, &alike) {
                break;
            }
        }
        for _round in 1..ROUNDS {
            job.go_on()?;
            let (weights, median) = robust_weights(pairs.distances(&pose));
            if pairs.is_exact(median) {
                break;
            }
            let Some(better) = Self::solve(pairs, &weights, pose.shape) else {
                return Ok(None);
            };
            pose = better;
            if pairs.targets > 0 {
                pose.settle_targets(pairs, &weights);
            }
        }
        // The middle one of three singular values tells of flat models, too.
        let stretch = |row: &Row<'_>| {
            let [a, b, c, _] = pose.blend(row.weights);
            svd(&Mat3([a, b, c])).values[1]
        };
        let scale = median(pairs.rows.iter().map(stretch).collect());
        Ok(Some(Self { scale, ..pose }))
    }

    /// How the volume around a row's vertex grows; negative where it is mirrored.
    pub(super) fn volume(&self, row: &Row<'_>) -> f64 {
        let [a, b, c, _] = self.blend(row.weights);
        a.dot(b.cross(c))
    }

    /// A step of Gauss–Newton in how far the targets are taken, joints eliminated (Golub and Pereyra 1973, without the derivative of the projection); false where none helps much.
    fn settle_targets(&mut self, pairs: &Pairs<'_>, robust: &[f64]) -> bool {
        let before = self.misfit(pairs, robust);
        let Some(step) = self.step_of_targets(pairs, robust) else {
            return false;
        };
        for share in SHARES {
            let shape = self.shape.iter().zip(&step);
            let shape = shape.map(|(c, step)| c + share * step).collect();
            let tried = Self::solve(pairs, robust, shape);
            let after = tried
                .as_ref()
                .map_or(f64::NAN, |tried| tried.misfit(pairs, robust));
            if let Some(tried) = tried.filter(|_| after < before) {
                *self = tried;
                return after < (1.0 - SETTLED) * before;
            }
        }
        false
    }

    fn misfit(&self, pairs: &Pairs<'_>, robust: &[f64]) -> f64 {
        let rows = pairs.rows.iter().zip(robust);
        rows.map(|(row, weight)| weight * (self.moved(row) - row.y).squared())
            .sum()
    }

    /// Least squares of what is left, over what the targets add to it and joints can't.
    fn step_of_targets(&self, pairs: &Pairs<'_>, robust: &[f64]) -> Option<Vec<f64>> {
        let (size, targets) = (4 * pairs.joints, pairs.targets);
        let mut normal = Mat::<f64>::zeros(size, size);
        let mut between: [Mat<f64>; 3] = std::array::from_fn(|_| Mat::zeros(size, targets));
        let (mut own, mut right) = (Mat::<f64>::zeros(targets, targets), Mat::<f64>::zeros(targets, 1));
        for (row, &weight) in pairs.rows.iter().zip(robust).filter(|(_, weight)| **weight > 0.0) {
            let Vec3([x, y, z]) = row.place(&self.shape);
            let place = [x, y, z, 1.0];
            add_joints(&mut normal, row.weights, &place, weight);
            let [a, b, c, _] = self.blend(row.weights);
            let turned = |&(target, offset): &(u32, Vec3)| {
                (
                    target as usize,
                    a * offset.0[0] + b * offset.0[1] + c * offset.0[2],
                )
            };
            let columns: Vec<(usize, Vec3)> = row.offsets.iter().map(turned).collect();
            let rest = row.y - self.moved(row);
            for &(k, column) in &columns {
                right[(k, 0)] += weight * column.dot(rest);
                columns
                    .iter()
                    .for_each(|&(l, other)| own[(k, l)] += weight * column.dot(other));
                for &(joint, share) in row.weights {
                    for (i, p) in place.iter().enumerate() {
                        for (axis, between) in between.iter_mut().enumerate() {
                            between[(4 * joint as usize + i, k)] += weight * share * p * column.0[axis];
                        }
                    }
                }
            }
        }
        add_ridge(&mut normal);
        let factor = normal.llt(Side::Lower).ok()?;
        let told: Vec<f64> = (0..targets).map(|k| own[(k, k)]).collect();
        for between in &between {
            own -= between.transpose() * factor.solve(between);
        }
        for (k, told) in told.into_iter().enumerate() {
            own[(k, k)] += RIDGE_OF_TARGETS * told + f64::MIN_POSITIVE;
        }
        let step = own.llt(Side::Lower).ok()?.solve(&right);
        let step: Vec<f64> = (0..targets).map(|k| step[(k, 0)]).collect();
        step.iter().all(|x| x.is_finite()).then_some(step)
    }

    /// First one affine map for all, then what joints add to it.
    fn solve(pairs: &Pairs<'_>, robust: &[f64], shape: Vec<f64>) -> Option<Self> {
        let place = |row: &Row<'_>| row.place(&shape);
        let whole = normal_equations(pairs, 1, robust, |_| &[(0, 1.0)], |row| (place(row), row.y))?;
        let rest = |row: &Row<'_>| (place(row), row.y - apply(&whole[0], place(row)));
        let own = normal_equations(pairs, pairs.joints, robust, |row| row.weights, rest)?;
        let add = |joint: Affine| std::array::from_fn(|k| joint[k] + whole[0][k]);
        Some(Self {
            joints: own.into_iter().map(add).collect(),
            shape,
            scale: 1.0,
        })
    }

    fn blend(&self, weights: &[(u32, f64)]) -> Affine {
        let mut sum = [Vec3([0.0; 3]); 4];
        for &(joint, weight) in weights {
            for (total, column) in sum.iter_mut().zip(self.joints[joint as usize]) {
                *total += column * weight;
            }
        }
        sum
    }
}

impl Pose for Linear {
    fn moved(&self, row: &Row<'_>) -> Vec3 {
        apply(&self.blend(row.weights), row.place(&self.shape))
    }

    fn undone(&self, row: &Row<'_>) -> Option<Vec3> {
        let before = undo(&self.blend(row.weights), row.y, FLATTEST * self.scale)?;
        Some(before - row.offset(&self.shape))
    }

    fn scale(&self) -> f64 {
        self.scale
    }

    fn unknowns(&self) -> usize {
        12 * self.joints.len() + self.shape.len()
    }
}

/// Where a map takes y from; none where it presses flatter than allowed.
pub(super) fn undo([a, b, c, t]: &Affine, y: Vec3, flattest: f64) -> Option<Vec3> {
    let motion = svd(&Mat3([*a, *b, *c]).transposed());
    if motion.values[2].is_nan() || motion.values[2] <= flattest {
        return None;
    }
    let (Mat3(left), Mat3(right)) = (motion.left, motion.right);
    let offset = y - *t;
    let steps = (0..3).map(|i| right[i] * (left[i].dot(offset) / motion.values[i]));
    Some(steps.sum())
}

/// The least squares of Σⱼ wⱼ Aⱼ [x; 1] − target, given x and target.
fn normal_equations<'r, 'a>(
    pairs: &'r Pairs<'a>,
    joints: usize,
    robust: &[f64],
    weights_of: impl Fn(&'r Row<'a>) -> &'r [(u32, f64)],
    place_and_target: impl Fn(&'r Row<'a>) -> (Vec3, Vec3),
) -> Option<Vec<Affine>> {
    let size = 4 * joints;
    let (mut normal, mut right) = (Mat::<f64>::zeros(size, size), Mat::<f64>::zeros(size, 3));
    for (row, &weight) in pairs.rows.iter().zip(robust).filter(|(_, weight)| **weight > 0.0) {
        let (Vec3([x, y, z]), goal) = place_and_target(row);
        let place = [x, y, z, 1.0];
        let own = weights_of(row);
        add_joints(&mut normal, own, &place, weight);
        for &(a, share) in own {
            for (i, p) in place.iter().enumerate() {
                for axis in 0..3 {
                    right[(4 * a as usize + i, axis)] += weight * share * p * goal.0[axis];
                }
            }
        }
    }
    add_ridge(&mut normal);
    let solved = normal.llt(Side::Lower).ok()?.solve(&right);
    let column = |joint: usize, k: usize| Vec3(std::array::from_fn(|axis| solved[(4 * joint + k, axis)]));
    let found: Vec<Affine> = (0..joints)
        .map(|joint| std::array::from_fn(|k| column(joint, k)))
        .collect();
    let is_finite = found.iter().flatten().all(|v| v.0.iter().all(|x| x.is_finite()));
    is_finite.then_some(found)
}

/// Adds the products of a vertex's columns, one a joint and coordinate.
fn add_joints(normal: &mut Mat<f64>, own: &[(u32, f64)], place: &[f64; 4], weight: f64) {
    for &(a, share_a) in own {
        for &(b, share_b) in own {
            let (a, b) = (4 * a as usize, 4 * b as usize);
            for (i, p) in place.iter().enumerate() {
                for (k, q) in place.iter().enumerate() {
                    normal[(a + i, b + k)] += weight * share_a * p * share_b * q;
                }
            }
        }
    }
}

fn add_ridge(normal: &mut Mat<f64>) {
    let size = normal.nrows();
    let trace: f64 = (0..size).map(|i| normal[(i, i)]).sum();
    let ridge = (RIDGE * trace / size as f64).max(f64::MIN_POSITIVE);
    (0..size).for_each(|i| normal[(i, i)] += ridge);
}

pub(super) fn apply([a, b, c, t]: &Affine, Vec3([x, y, z]): Vec3) -> Vec3 {
    *a * x + *b * y + *c * z + *t
}
