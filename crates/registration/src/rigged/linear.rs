//! Linear blend skinning.

use faer::{Mat, Side, linalg::solvers::Solve};
use job::{Job, JobError};
use mesh::Vec3;

use super::{Pairs, Pose, Row, median, robust_weights};
use crate::matrix::{Mat3, svd};

/// Rounds of robust weights.
const ROUNDS: usize = 8;

/// Directions in which nothing is told of a joint: this much of the mean of what is told holds it to the whole model's motion.
const RIDGE: f64 = 1e-10;

/// What is pressed flatter than this, beside the whole model's scale, is not stretched again: noise would be, too.
const FLATTEST: f64 = 0.1;

/// Where a joint takes [x; 1]: four columns.
pub(super) type Affine = [Vec3; 4];

/// An affine map for each joint.
pub(super) struct Linear {
    pub(super) joints: Vec<Affine>,
    scale: f64,
}

impl Linear {
    /// The robust least squares of Σⱼ wⱼ Aⱼ [x; 1] − y.
    pub(super) fn fit(pairs: &Pairs<'_>, job: &Job) -> Result<Option<Self>, JobError> {
        let Some(mut pose) = Self::solve(pairs, &vec![1.0; pairs.rows.len()]) else {
            return Ok(None);
        };
        for _round in 1..ROUNDS {
            job.go_on()?;
            let (weights, median) = robust_weights(pairs.distances(&pose));
            if pairs.is_exact(median) {
                break;
            }
            let Some(better) = Self::solve(pairs, &weights) else {
                return Ok(None);
            };
            pose = better;
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

    /// First one affine map for all, then what joints add to it.
    fn solve(pairs: &Pairs<'_>, robust: &[f64]) -> Option<Self> {
        let whole = normal_equations(pairs, 1, robust, |_| &[(0, 1.0)], |row| row.y)?;
        let rest = |row: &Row<'_>| row.y - apply(&whole[0], row.x);
        let own = normal_equations(pairs, pairs.joints, robust, |row| row.weights, rest)?;
        let add = |joint: Affine| std::array::from_fn(|k| joint[k] + whole[0][k]);
        Some(Self {
            joints: own.into_iter().map(add).collect(),
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
        apply(&self.blend(row.weights), row.x)
    }

    fn undone(&self, row: &Row<'_>) -> Option<Vec3> {
        let [a, b, c, t] = self.blend(row.weights);
        let motion = svd(&Mat3([a, b, c]).transposed());
        if motion.values[2].is_nan() || motion.values[2] <= FLATTEST * self.scale {
            return None;
        }
        let (Mat3(left), Mat3(right)) = (motion.left, motion.right);
        let offset = row.y - t;
        let steps = (0..3).map(|i| right[i] * (left[i].dot(offset) / motion.values[i]));
        Some(steps.sum())
    }

    fn scale(&self) -> f64 {
        self.scale
    }
}

/// The least squares of Σⱼ wⱼ Aⱼ [x; 1] − target.
fn normal_equations<'r, 'a>(
    pairs: &'r Pairs<'a>,
    joints: usize,
    robust: &[f64],
    weights_of: impl Fn(&'r Row<'a>) -> &'r [(u32, f64)],
    target: impl Fn(&'r Row<'a>) -> Vec3,
) -> Option<Vec<Affine>> {
    let size = 4 * joints;
    let (mut normal, mut right) = (Mat::<f64>::zeros(size, size), Mat::<f64>::zeros(size, 3));
    for (row, &weight) in pairs.rows.iter().zip(robust).filter(|(_, weight)| **weight > 0.0) {
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

fn apply([a, b, c, t]: &Affine, Vec3([x, y, z]): Vec3) -> Vec3 {
    *a * x + *b * y + *c * z + *t
}
