//! Successive cancellation with a list of paths, in the domain of log-likelihood ratios (Balatsoukas-Stimming, Bastani Parizi and Burg 2015).
//!
//! All paths are at the same step of the plan, so that whatever a step writes it writes for all of them, path p in slot p. Only
//! [forks](fork) move paths: there they change from which slot each path reads what was written before. That is Tal and Vardy's lazy
//! copy (2015), without counting who shares a slot, since all paths write a slot anew at the same time.

mod fork;
mod stage;

use self::{fork::Choice, stage::Stage};
use crate::{
    candidates::{Candidates, History},
    kernels,
    plan::Step,
    precode::Precoder,
    transform::{ones, transform_word},
};

/// The paths of one decoding.
pub(crate) struct Paths<'a> {
    /// Ratios of the code bits, which are the root's.
    channel: &'a [f32],
    precoder: Precoder,
    list: usize,
    /// Below the root, from single bits upwards.
    stages: Vec<Stage>,
    /// −ln P of each path's bits so far.
    metrics: Vec<f32>,
    /// What each path's payload adds to the bits to come.
    registers: Vec<u64>,
    history: History,
    choice: Choice,
}

impl<'a> Paths<'a> {
    /// One path, before the first bit.
    pub(crate) fn new(channel: &'a [f32], precoder: Precoder, list: usize) -> Self {
        let stages = channel.len().trailing_zeros() as usize;
        Self {
            channel,
            precoder,
            list,
            stages: (0..stages).map(|stage| Stage::new(stage, list)).collect(),
            metrics: vec![0.0],
            registers: vec![0],
            history: History::default(),
            choice: Choice::default(),
        }
    }

    /// Takes all steps, with accurate check nodes or min-sum.
    pub(crate) fn run<const ACCURATE: bool>(mut self, steps: &[Step]) -> Candidates {
        for &step in steps {
            match step {
                Step::Check { stage } => self.check::<ACCURATE>(stage),
                Step::Variable { stage } => self.variable(stage),
                Step::Frozen { stage, left } => self.frozen::<ACCURATE>(stage, left),
                Step::Fork { stage, position } => self.fork::<ACCURATE>(stage, position),
                Step::Combine { stage, left } => self.combine(stage, left),
            }
        }
        Candidates::new(self.history, self.metrics)
    }

    fn check<const ACCURATE: bool>(&mut self, stage: usize) {
        let paths = self.metrics.len();
        let (below, above) = self.stages.split_at_mut(stage + 1);
        let child = &mut below[stage];
        child.ratio_slots.own(paths);
        let children = &mut child.ratios[..paths << stage];
        match above.first() {
            // The parent was written just before: path p is in slot p.
            Some(parent) => kernels::check_all::<ACCURATE>(stage, &parent.ratios, children),
            None => {
                for child in children.chunks_exact_mut(1 << stage) {
                    kernels::check::<ACCURATE>(self.channel, child);
                }
            }
        }
    }

    fn variable(&mut self, stage: usize) {
        let paths = self.metrics.len();
        let (below, above) = self.stages.split_at_mut(stage + 1);
        let Stage {
            ratios,
            ratio_slots,
            left,
            left_slots,
            ..
        } = &mut below[stage];
        ratio_slots.own(paths);
        let size = 1 << stage;
        for (p, child) in ratios.chunks_exact_mut(size).take(paths).enumerate() {
            let parent = match above.first() {
                Some(parent) => &parent.ratios[2 * size * parent.ratio_slots.of(p)..][..2 * size],
                None => self.channel,
            };
            kernels::variable(parent, left.at(left_slots.of(p)), child);
        }
    }

    fn frozen<const ACCURATE: bool>(&mut self, stage: usize, left: bool) {
        let (size, paths) = (1 << stage, self.metrics.len());
        let at = &mut self.stages[stage];
        if left {
            at.left_slots.own(paths);
        }
        let bits = if left { &mut at.left } else { &mut at.right };
        let leaves = at.ratios.chunks_exact(size).zip(bits.words());
        let state = self.metrics.iter_mut().zip(&mut self.registers);
        for ((metric, register), (ratios, word)) in state.zip(leaves) {
            *word = transform_word(*register & ones(stage), stage);
            *register = register.checked_shr(size as u32).unwrap_or(0);
            *metric += kernels::penalties::<ACCURATE>(ratios, *word)[0];
        }
    }

    /// (l, r) become (l ⊕ r, r).
    fn combine(&mut self, stage: usize, left: bool) {
        let paths = self.metrics.len();
        let (below, above) = self.stages.split_at_mut(stage);
        // Nobody asks for the bits of the root.
        let Some(parent) = above.first_mut() else { return };
        let child = &below[stage - 1];
        let half = 1usize << (stage - 1);
        if left {
            parent.left_slots.own(paths);
        }
        let out = if left { &mut parent.left } else { &mut parent.right };
        for p in 0..paths {
            let (l, r) = (child.left.at(child.left_slots.of(p)), child.right.at(p));
            let out = out.at_mut(p);
            if half < 64 {
                out[0] = (l[0] ^ r[0]) | r[0] << half;
                continue;
            }
            let (first, second) = out.split_at_mut(l.len());
            second.copy_from_slice(r);
            for ((out, l), r) in first.iter_mut().zip(l).zip(r) {
                *out = l ^ r;
            }
        }
    }
}
