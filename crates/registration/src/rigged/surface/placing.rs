//! One joint, laid on the suspect where its neighbours lie already.

use faer::Mat;
use job::{Job, JobError};
use mesh::Vec3;

use super::{
    Motion, Pose, Rigid,
    equations::NormalEquations,
    fit::{Fit, turned_about},
};

/// How it is found where joints lie.
pub(super) struct Search {
    /// Turns that are tried about a joint: about so many axes, by these angles in degrees, and no turn.
    axes: usize,
    angles: &'static [f64],
    /// From so many turns, the best, it is fitted roughly, by few samples; and from so many of what comes of them, in full.
    roughly: usize,
    fitted: usize,
    /// Whether a joint that lies badly is placed without what hangs on it, too.
    pub(super) alone: bool,
    /// What is off by this share of the tolerance pulls, too, however little most is off: else what lies badly stays where it is once most lies well. More of it would pull to a cut what was cut off.
    pub(super) pulled: f64,
}

/// Turns are coarse, and about a place that only weights tell.
pub(super) const OF_JOINTS: Search = Search {
    axes: 42,
    angles: &[15.0, 30.0, 45.0, 60.0, 75.0, 90.0, 105.0, 125.0, 150.0],
    roughly: 32,
    fitted: 8,
    alone: true,
    pulled: 0.33,
};
/// What bends turns little from node to node; turned more, a part that is round would lie as well.
pub(super) const OF_NODES: Search = Search {
    axes: 14,
    angles: &[12.0, 25.0, 45.0, 75.0],
    roughly: 4,
    fitted: 4,
    alone: false,
    pulled: 0.08,
};

/// How near, in diagonals, a joint's samples have to come to count, while turns are tried and in the end.
pub(super) const WIDE: f64 = 0.03;
pub(super) const NARROW: f64 = 0.01;

/// At which tolerances a joint is fitted, and rounds at each.
const TOLERANCES: [f64; 3] = [0.12, 0.06, 0.03];
const ROUNDS: usize = 8;
/// A step in which nothing turns or moves more, in radians and diagonals, is the last at a tolerance.
const SETTLED: f64 = 1e-4;

/// Samples of a joint that are looked at, and where it is fitted roughly.
const A_FEW: usize = 200;
const FEWER: usize = 60;

/// A joint by itself is damped by this much: where nothing is told of a direction, it stays.
const HELD_ALONE: f64 = 1e-4;

/// A joint of which no more than this lies on the suspect stays as its neighbour moves it: it may be cut off.
pub(super) const LEAST: f64 = 0.15;

impl Fit<'_> {
    /// A joint turned about the place that it shares with its neighbour until it lies on the suspect, with what hangs on it; and how much of what tells where it is does, 0 to 1. None where nearly nothing does.
    pub(super) fn placed(
        &self,
        joint: usize,
        base: &Motion,
        pivot: Vec3,
        pose: &Rigid,
        hanging: &[usize],
        job: &Job,
    ) -> Result<Option<(f64, Motion)>, JobError> {
        let turns = self.search.turns();
        let told = self.skeleton.telling(joint, hanging);
        let score = |motion: &Motion, tolerance| {
            let mut tried = pose.clone();
            hanging.iter().for_each(|&joint| tried.set_joint(joint, *motion));
            self.score_of(&tried, &told, tolerance)
        };
        let tried = job.quiet().map(turns.len(), 8, |i| {
            let motion = turned_about(base, pivot, turns[i]);
            (score(&motion, WIDE), motion)
        })?;
        let begun = best_of(tried, self.search.roughly);
        let fewer: Vec<usize> = told
            .iter()
            .copied()
            .step_by((told.len() / FEWER).max(1))
            .collect();
        let rough = job.quiet().map(begun.len(), 1, |i| {
            let motion = self.settled_with(joint, begun[i], pose, hanging, (&fewer, &TOLERANCES[..1]));
            (score(&motion, WIDE), motion)
        })?;
        let begun = best_of(rough, self.search.fitted);
        let fitted = job.quiet().map(begun.len(), 1, |i| {
            let motion = self.settled_with(joint, begun[i], pose, hanging, (&told, &TOLERANCES));
            (score(&motion, NARROW), motion)
        })?;
        let best = fitted.into_iter().max_by(|a, b| a.0.total_cmp(&b.0));
        Ok(best.filter(|(score, _)| *score > LEAST))
    }

    /// A joint, with what hangs on it, laid on the suspect where it and all others take its samples, point to plane.
    fn settled_with(
        &self,
        joint: usize,
        motion: Motion,
        pose: &Rigid,
        hanging: &[usize],
        (told, tolerances): (&[usize], &[f64]),
    ) -> Motion {
        let mut now = pose.clone();
        hanging.iter().for_each(|&joint| now.set_joint(joint, motion));
        let mut best = (self.score_of(&now, told, NARROW), motion);
        for &tolerance in tolerances {
            for _round in 0..ROUNDS {
                let Some(step) = self.step_with(told, &now, hanging, tolerance) else {
                    return best.1;
                };
                let mut all = Mat::<f64>::zeros(now.unknowns(), 1);
                for &joint in hanging {
                    (0..6).for_each(|i| all[(6 * joint + i, 0)] = step[(i, 0)]);
                }
                now = now.stepped(&all);
                if (0..6).all(|i| step[(i, 0)].abs() < SETTLED) {
                    break;
                }
            }
            let score = self.score_of(&now, told, NARROW);
            if score > best.0 {
                best = (score, now.joints()[joint]);
            }
        }
        best.1
    }

    /// The least squares of what a joint's samples leave over a turn and a shift of all that hang together; none where nothing is near.
    fn step_with(&self, told: &[usize], pose: &Rigid, hanging: &[usize], tolerance: f64) -> Option<Mat<f64>> {
        let mut sum = NormalEquations::of_unknowns(6);
        let limit = tolerance * pose.scale();
        let mut hangs = vec![false; self.skeleton.joints() + 1];
        hanging.iter().for_each(|&joint| hangs[joint] = true);
        let mut columns = Vec::new();
        for &i in told.iter().step_by((told.len() / A_FEW).max(1)) {
            let sample = &self.skeleton.samples[i];
            let (place, facing) = pose.moved_with(&sample.row, sample.normal);
            let Some((across, rest, distance)) = self.near(place, facing, limit) else {
                continue;
            };
            columns.clear();
            pose.columns(&sample.row, &mut columns);
            let mut numbers = [0.0; 6];
            // The last is the scale's, which stays.
            for &(k, column) in &columns {
                if hangs[k / 6] {
                    numbers[k % 6] += column.dot(across);
                }
            }
            let numbers: Vec<(usize, f64)> = numbers.into_iter().enumerate().collect();
            let weight = (1.0 - (distance / limit).powi(2)).max(0.0).powi(2);
            sum.add(&numbers, rest, weight);
        }
        sum.solved(HELD_ALONE)
    }

    /// A joint's samples laid on the suspect by themselves, point to plane; they say how large the suspect is, too.
    pub(super) fn settled(&self, joint: usize, motion: Motion, scale: f64) -> (Motion, f64) {
        let mut best = (motion, scale);
        let mut score = self.score(joint, &motion, scale, NARROW);
        let (mut now, mut size) = best;
        for round in 0..2 * ROUNDS {
            let tolerance = if round < ROUNDS { WIDE } else { NARROW };
            let Some(step) = self.step_alone(joint, &now, size, tolerance) else {
                break;
            };
            let [turn, shift] = [0, 3].map(|first| Vec3(std::array::from_fn(|axis| step[(first + axis, 0)])));
            now = now.turned(turn).shifted(shift);
            size *= step[(6, 0)].clamp(-0.1, 0.1).exp();
            let reached = self.score(joint, &now, size, NARROW);
            if reached > score {
                (best, score) = ((now, size), reached);
            }
        }
        best
    }

    /// The least squares of what a joint's samples leave, over a turn, a shift and the logarithm of the scale; none where nothing is near.
    fn step_alone(&self, joint: usize, motion: &Motion, scale: f64, tolerance: f64) -> Option<Mat<f64>> {
        let mut sum = NormalEquations::of_unknowns(7);
        let origin = motion.apply(Vec3::ZERO);
        for i in self.few_of(joint) {
            let sample = &self.skeleton.samples[i];
            let place = motion.apply(sample.row.x);
            let facing = motion.apply(sample.normal) - origin;
            let limit = tolerance * scale;
            let Some((across, rest, distance)) = self.near(place * scale, facing, limit) else {
                continue;
            };
            let weight = (1.0 - (distance / limit).powi(2)).max(0.0).powi(2);
            let Vec3([x, y, z]) = place.cross(across);
            let numbers = [x, y, z, across[0], across[1], across[2], across.dot(place)];
            let numbers: Vec<(usize, f64)> = numbers.into_iter().enumerate().collect();
            sum.add(&numbers, rest / scale, weight);
        }
        sum.solved(HELD_ALONE)
    }

    fn few_of(&self, joint: usize) -> impl Iterator<Item = usize> + '_ {
        let own = &self.skeleton.core_of_joint[joint];
        own.iter().step_by((own.len() / A_FEW).max(1)).copied()
    }

    /// How much of a joint's samples lies on the suspect, 0 to 1; the nearer the more.
    pub(super) fn score(&self, joint: usize, motion: &Motion, scale: f64, tolerance: f64) -> f64 {
        let origin = motion.apply(Vec3::ZERO);
        let limit = tolerance * scale;
        let (mut sum, mut count) = (0.0, 0.0);
        for i in self.few_of(joint) {
            let sample = &self.skeleton.samples[i];
            let place = motion.apply(sample.row.x) * scale;
            let facing = motion.apply(sample.normal) - origin;
            if let Some((_, _, distance)) = self.near(place, facing, limit) {
                sum += 1.0 - (distance / limit).powi(2);
            }
            count += 1.0;
        }
        sum / f64::max(count, 1.0)
    }

    /// As [`score`](Self::score), of a joint's samples where all joints take them.
    pub(super) fn score_in(&self, pose: &Rigid, joint: usize, tolerance: f64) -> f64 {
        self.score_of(pose, &self.skeleton.of_joint[joint], tolerance)
    }

    /// As [`score_in`](Self::score_in), of any samples.
    fn score_of(&self, pose: &Rigid, own: &[usize], tolerance: f64) -> f64 {
        let limit = tolerance * pose.scale();
        let (mut sum, mut count) = (0.0, 0.0);
        for &i in own.iter().step_by((own.len() / A_FEW).max(1)) {
            let sample = &self.skeleton.samples[i];
            let (place, facing) = pose.moved_with(&sample.row, sample.normal);
            if let Some((_, _, distance)) = self.near(place, facing, limit) {
                sum += 1.0 - (distance / limit).powi(2);
            }
            count += 1.0;
        }
        sum / f64::max(count, 1.0)
    }
}

/// So many motions of the highest scores.
fn best_of(mut scored: Vec<(f64, Motion)>, count: usize) -> Vec<Motion> {
    scored.sort_by(|a, b| b.0.total_cmp(&a.0));
    scored.into_iter().take(count).map(|(_, motion)| motion).collect()
}

impl Search {
    /// Turns all around: axes evenly over the sphere (Fibonacci's lattice).
    fn turns(&self) -> Vec<Vec3> {
        const GOLDEN: f64 = 2.399_963_229_728_653;
        let axis = |i: usize| {
            let z = 1.0 - (2.0 * i as f64 + 1.0) / self.axes as f64;
            let (radius, angle) = ((1.0 - z * z).sqrt(), GOLDEN * i as f64);
            Vec3([radius * angle.cos(), radius * angle.sin(), z])
        };
        let turns = |i: usize| self.angles.iter().map(move |angle| axis(i) * angle.to_radians());
        std::iter::once(Vec3::ZERO)
            .chain((0..self.axes).flat_map(turns))
            .collect()
    }
}
