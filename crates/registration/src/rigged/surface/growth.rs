//! Joints one after the other, each from its neighbour; and nodes, from where they all move as one.

use job::{Job, JobError};
use mesh::{Similarity, Vec3};

use super::{
    BLENDINGS, Blending, Motion, Pose, Rigid,
    fit::{COARSE, FINE, Fit, HELD, PLACED, SPREADING},
    placing::{LEAST, NARROW, WIDE},
    skeleton::Link,
};
use crate::{RegistrationError, matrix::Mat3};

/// Rounds in which all that are placed so far are moved together.
const SO_FAR: usize = 4;

/// How often joints that lie badly are looked for again, which lie well, and by how much more has to lie there.
const PASSES: usize = 5;
const WELL: f64 = 0.85;
const BETTER: f64 = 0.03;

/// Of so many joints that could be placed next the one that lies best is; of rigs with many joints fewer, so that these are placed no more often in all than this.
const MOST_TRIED: usize = 4;
const MOST_PLACED: usize = 96;

/// With so much of a suspect on the original, all nodes lie well; with so little, it is another model.
const ALL: f64 = 0.98;
const LEAST_SPREAD: f64 = 0.5;

/// By this power of how many samples tell of a joint, its place is worth more.
const WORTH: f64 = 0.125;

/// A joint from which all others are looked for.
pub(super) struct Beginning {
    joint: usize,
    motion: Motion,
    /// Of the whole suspect, to a diagonal of the original.
    scale: f64,
    /// How much of what the joint moves nearly alone lies on the suspect, 0 to 1.
    pub(super) score: f64,
}

/// A joint that was placed, by the link to which of its neighbours.
struct Placed {
    joint: usize,
    from: usize,
    pivot: Vec3,
}

impl Fit<'_> {
    /// Where a transform of the suspect to the original puts a joint, or if it isn't said which, the one that lies best there. None where nearly nothing lies there.
    pub(super) fn beginning(&self, seed: &Similarity, joint: Option<usize>) -> Option<Beginning> {
        let (motion, scale) = self.motion(seed);
        let worth = |&joint: &usize| {
            let size = self.skeleton.of_joint[joint].len() as f64;
            self.score(joint, &motion, scale, WIDE) * size.sqrt()
        };
        let best = || (0..self.skeleton.joints()).max_by(|a, b| worth(a).total_cmp(&worth(b)));
        let joint = joint.or_else(best)?;
        let (motion, scale) = self.settled(joint, motion, scale);
        let begun = Beginning {
            joint,
            motion,
            scale,
            score: self.score(joint, &motion, scale, NARROW),
        };
        (self.score(joint, &motion, scale, WIDE) > LEAST).then_some(begun)
    }

    /// The pose of all nodes, from where a transform of the suspect puts them all: what lies on it there takes the others along.
    pub(super) fn spread(&self, seed: &Similarity, job: &Job) -> Result<Rigid, JobError> {
        let (motion, scale) = self.motion(seed);
        let joints = vec![motion; self.skeleton.joints()];
        self.together(Rigid::of_joints(Blending::Linear, joints, scale), &SPREADING, job)
    }

    /// Nodes that lie badly are looked for again from those around them: of each pass the pose by which most of the suspect lies on the original, as a measure from 0 to 1 has it. None where too little does from the beginning.
    pub(super) fn spread_on(
        &self,
        mut pose: Rigid,
        share: impl Fn(&Rigid) -> Result<f64, RegistrationError>,
        job: &Job,
    ) -> Result<Option<Rigid>, RegistrationError> {
        let mut most = share(&pose)?;
        if most < LEAST_SPREAD {
            return Ok(None);
        }
        let lies = |&joint: &usize| self.score_in(&pose, joint, NARROW);
        let first = (0..self.skeleton.joints()).max_by(|a, b| lies(a).total_cmp(&lies(b)));
        let order = self.order_from(first.unwrap_or(0));
        let mut now = pose.clone();
        for _pass in 0..PASSES {
            if most > ALL || !self.placed_again(&mut now, &order, job)? {
                break;
            }
            now = self.together(now, &PLACED, job)?;
            let reached = share(&now)?;
            if reached > most {
                (most, pose) = (reached, now.clone());
            }
        }
        Ok(Some(pose))
    }

    /// All joints but one, each after that to which its link is strongest of those before it.
    fn order_from(&self, first: usize) -> Vec<Placed> {
        let mut is_placed = vec![false; self.skeleton.joints()];
        is_placed[first] = true;
        let mut order = Vec::new();
        while let Some(next) = self.next(&is_placed).into_iter().next() {
            is_placed[next.joint] = true;
            order.push(next);
        }
        order
    }

    /// The pose of all joints, from one of them; none where it is not it once they are placed.
    pub(super) fn grown(
        &self,
        begun: &Beginning,
        is_it: impl Fn(&Rigid) -> bool,
        job: &Job,
    ) -> Result<Option<Rigid>, JobError> {
        let (mut pose, order) = self.placed_by_either(begun, job)?;
        for _pass in 0..PASSES {
            pose = self.together(pose, &COARSE, job)?;
            if !is_it(&pose) {
                return Ok(None);
            }
            if !self.placed_again(&mut pose, &order, job)? {
                break;
            }
        }
        let mut best: Option<(f64, Rigid)> = None;
        for blending in BLENDINGS {
            let mut fitted = self.together(pose.blended(blending), &FINE, job)?;
            if self.placed_again(&mut fitted, &order, job)? {
                fitted = self.together(self.together(fitted, &COARSE, job)?, &FINE, job)?;
            }
            let off = self.off(&fitted, job)?;
            if best.as_ref().is_none_or(|(least, _)| off < *least) {
                best = Some((off, fitted));
            }
        }
        Ok(best.map(|(_, pose)| pose))
    }

    /// All joints placed from one of them, by the blending by which more of the original lies on the suspect then: where joints turn far, what both make of the surface between them lies far apart.
    fn placed_by_either(&self, begun: &Beginning, job: &Job) -> Result<(Rigid, Vec<Placed>), JobError> {
        let [linear, dual] = BLENDINGS.map(|blending| {
            let joints = vec![begun.motion; self.skeleton.joints()];
            let mut pose = Rigid::of_joints(blending, joints, begun.scale);
            let order = self.place_all(&mut pose, begun.joint, job)?;
            Ok((pose, order))
        });
        let (linear, dual) = (linear?, dual?);
        let is_linear = self.lies(&linear.0) >= self.lies(&dual.0);
        Ok(if is_linear { linear } else { dual })
    }

    /// One joint after the other, that which lies best first, until nothing is linked to those that are placed; in the order in which they were.
    fn place_all(&self, pose: &mut Rigid, first: usize, job: &Job) -> Result<Vec<Placed>, JobError> {
        let joints = self.skeleton.joints();
        let mut is_placed = vec![false; joints];
        is_placed[first] = true;
        let mut order = Vec::new();
        loop {
            job.go_on()?;
            let open: Vec<usize> = (0..joints).filter(|&joint| !is_placed[joint]).collect();
            let mut best: Option<(f64, Placed, Motion)> = None;
            for next in self.next(&is_placed) {
                let base = pose.joints()[next.from];
                let told = self.skeleton.telling(next.joint, &open).len() as f64;
                let found = self.placed(next.joint, &base, next.pivot, pose, &open, job)?;
                let (score, motion) = found.unwrap_or((0.0, base));
                let worth = score * told.powf(WORTH);
                if best.as_ref().is_none_or(|(most, ..)| worth > *most) {
                    best = Some((worth, next, motion));
                }
            }
            let Some((_, placed, motion)) = best else {
                return Ok(order);
            };
            open.iter().for_each(|&joint| pose.set_joint(joint, motion));
            is_placed[placed.joint] = true;
            order.push(placed);
            *pose = self.descend(
                pose.clone(),
                &self.samples_of(&is_placed),
                WIDE,
                SO_FAR,
                HELD,
                job,
            )?;
        }
    }

    /// How much of the original lies on the suspect, 0 to 1.
    pub(super) fn lies(&self, pose: &Rigid) -> f64 {
        let joints = 0..self.skeleton.joints();
        let sum: f64 = joints
            .map(|joint| self.score_in(pose, joint, NARROW) * self.skeleton.of_joint[joint].len() as f64)
            .sum();
        sum / self.skeleton.samples.len().max(1) as f64
    }

    /// Joints that lie badly are looked for anew from where the neighbours are by now, with what hangs on them; whether any was placed better.
    fn placed_again(&self, pose: &mut Rigid, order: &[Placed], job: &Job) -> Result<bool, JobError> {
        let mut changed = vec![false; self.skeleton.joints()];
        for placed in order {
            let lies_well = self.score_in(pose, placed.joint, NARROW) > WELL && !changed[placed.from];
            if lies_well || self.skeleton.of_joint[placed.joint].is_empty() {
                continue;
            }
            if let Some(better) = self.placed_better(pose, placed, order, job)? {
                (*pose, changed[placed.joint]) = (better, true);
            }
        }
        Ok(changed.contains(&true))
    }

    /// The pose with a joint placed anew, if that lies better there.
    fn placed_better(
        &self,
        pose: &Rigid,
        &Placed { joint, from, pivot }: &Placed,
        order: &[Placed],
        job: &Job,
    ) -> Result<Option<Rigid>, JobError> {
        let mut hanging = vec![joint];
        for other in order {
            if hanging.contains(&other.from) {
                hanging.push(other.joint);
            }
        }
        let own = self.score_in(pose, joint, NARROW);
        // What hangs on it may lie well already; what lies nowhere may be cut off.
        let alone = self.search.alone && hanging.len() > 1 && own > LEAST;
        let alone = alone.then_some(&hanging[..1]);
        let mut best = (own + BETTER, None);
        for moved in [Some(&hanging[..]), alone].into_iter().flatten() {
            for (from, pivot) in self.neighbours(joint, moved, (from, pivot)) {
                let base = pose.joints()[from];
                let Some((_, found)) = self.placed(joint, &base, pivot, pose, moved, job)? else {
                    continue;
                };
                let mut tried = pose.clone();
                moved.iter().for_each(|&joint| tried.set_joint(joint, found));
                let reached = self.score_in(&tried, joint, NARROW);
                if reached > best.0 {
                    best = (reached, Some(tried));
                }
            }
        }
        Ok(best.1)
    }

    /// From whom a joint may be placed again, and about which place: the one it was placed from, and those with the strongest links that don't hang on it.
    fn neighbours(&self, joint: usize, hanging: &[usize], first: (usize, Vec3)) -> Vec<(usize, Vec3)> {
        let mut links: Vec<&Link> = self
            .skeleton
            .links
            .iter()
            .filter(|link| link.joints.contains(&joint))
            .collect();
        links.sort_by(|a, b| b.strength.total_cmp(&a.strength));
        let others = links
            .into_iter()
            .map(|link| (link.joints[usize::from(link.joints[0] == joint)], link.pivot));
        let others = others.filter(|(other, _)| *other != first.0 && !hanging.contains(other));
        let most = self.most_tried();
        std::iter::once(first).chain(others).take(most).collect()
    }

    /// Of so many ways to place a joint the best is taken.
    fn most_tried(&self) -> usize {
        (MOST_PLACED / self.skeleton.joints()).clamp(1, MOST_TRIED)
    }

    /// The motion of the whole original by which a transform of the suspect is undone, and the suspect's size to a diagonal of the original.
    fn motion(&self, seed: &Similarity) -> (Motion, f64) {
        let back = seed.inverse();
        let scale = back.scale * self.skeleton.diagonal();
        let middle = back.apply(self.skeleton.centre()) - self.centre();
        (Motion::of(Mat3::from(back.rotation), middle / scale), scale)
    }

    /// What may be placed next, by the strongest link to what is placed: joints with the strongest links first.
    fn next(&self, is_placed: &[bool]) -> Vec<Placed> {
        let open = |link: &&Link| is_placed[link.joints[0]] != is_placed[link.joints[1]];
        let mut links: Vec<&Link> = self.skeleton.links.iter().filter(open).collect();
        links.sort_by(|a, b| b.strength.total_cmp(&a.strength));
        let mut next: Vec<Placed> = Vec::new();
        for link in links {
            let [a, b] = link.joints;
            let (joint, from) = if is_placed[a] { (b, a) } else { (a, b) };
            if next.iter().all(|other| other.joint != joint) {
                next.push(Placed {
                    joint,
                    from,
                    pivot: link.pivot,
                });
            }
        }
        next.truncate(self.most_tried());
        next
    }

    /// Samples that only joints move which are placed.
    fn samples_of(&self, is_placed: &[bool]) -> Vec<usize> {
        const MOST: usize = 3000;
        let all = self.skeleton.samples.iter().enumerate();
        let own = all.filter(|(_, sample)| {
            let mut weights = sample.row.weights.iter();
            weights.all(|&(joint, share)| is_placed[joint as usize] || share < 0.05)
        });
        let own: Vec<usize> = own.map(|(i, _)| i).collect();
        own.iter().step_by((own.len() / MOST).max(1)).copied().collect()
    }

    /// How far samples are off, in diagonals, none more than the narrow tolerance.
    pub(super) fn off(&self, pose: &Rigid, job: &Job) -> Result<f64, JobError> {
        const LIMIT: f64 = 0.002;
        let samples: Vec<usize> = (0..self.skeleton.samples.len()).collect();
        let matches = self.matches(pose, &samples, LIMIT, job)?;
        let limit = LIMIT * pose.scale();
        let near: f64 = matches.iter().map(|found| (found.distance / limit).powi(2)).sum();
        Ok(near + (samples.len() - matches.len()) as f64)
    }
}
