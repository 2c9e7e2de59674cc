//! Where a payload bit stands: every path goes on with 0 and with 1, and the best of them are kept.

use super::{Paths, Stage};
use crate::{
    kernels,
    transform::{ones, transform_word},
};

/// Room that every fork uses anew.
#[derive(Default)]
pub(super) struct Choice {
    /// Of path p with v = 0 at 2 p, with v = 1 at 2 p + 1.
    metrics: Vec<f32>,
    /// Code bits of each path's leaf with v = 0.
    words: Vec<u64>,
    /// Metrics and places, to be compared as whole numbers.
    keys: Vec<u64>,
    /// Places in `metrics` that go on, in ascending order.
    kept: Vec<u32>,
    slots: Vec<u32>,
    registers: Vec<u64>,
}

impl Paths<'_> {
    /// The leaf at this stage whose first bit is at `position`, and whose last is payload.
    pub(super) fn fork<const ACCURATE: bool>(&mut self, stage: usize, position: usize) {
        let size = 1usize << stage;
        let choice = &mut self.choice;
        choice.metrics.clear();
        choice.words.clear();
        for (p, (metric, register)) in self.metrics.iter().zip(&self.registers).enumerate() {
            let ratios = match self.stages.get(stage) {
                Some(at) => &at.ratios[p << stage..][..size],
                None => self.channel,
            };
            let word = transform_word(register & ones(stage), stage);
            let penalties = kernels::penalties::<ACCURATE>(ratios, word);
            choice.metrics.extend(penalties.map(|penalty| metric + penalty));
            choice.words.push(word);
        }
        choice.keep(self.list);
        self.metrics.clear();
        self.metrics
            .extend(choice.kept.iter().map(|&kept| choice.metrics[kept as usize]));
        self.write_leaf(stage, position);
        self.follow(stage, position + size - 1);
        self.history.push(&self.choice.kept);
    }

    /// Code bits and registers of the paths that were kept. The last bit of a leaf is in all of its code bits.
    fn write_leaf(&mut self, stage: usize, position: usize) {
        let choice = &mut self.choice;
        if let Some(at) = self.stages.get_mut(stage) {
            let left = position >> stage & 1 == 0;
            if left {
                at.left_slots.own(choice.kept.len());
            }
            let bits = if left { &mut at.left } else { &mut at.right };
            for (word, &kept) in bits.words().iter_mut().zip(&choice.kept) {
                *word = choice.words[path(kept)] ^ if bit(kept) { ones(stage) } else { 0 };
            }
        }
        let before_last = (1u32 << stage) - 1;
        choice.registers.clear();
        for &kept in &choice.kept {
            let register = self.registers[path(kept)] >> before_last;
            choice.registers.push(self.precoder.after(register, bit(kept)));
        }
        std::mem::swap(&mut self.registers, &mut choice.registers);
    }

    /// Paths read where those did that they go on. `position` is the last of the leaf.
    ///
    /// Of the nodes above it, those that are left children will need their parent's ratios once more, and those that are right children the bits of
    /// their sister; all else that was written is done with.
    fn follow(&mut self, stage: usize, position: usize) {
        let Choice { kept, slots, .. } = &mut self.choice;
        for s in stage..self.stages.len() {
            let moved = match self.stages.get_mut(s..) {
                Some([Stage { left_slots, .. }, ..]) if position >> s & 1 == 1 => left_slots,
                Some([_, Stage { ratio_slots, .. }, ..]) => ratio_slots,
                // The root's ratios are those of the channel.
                _ => continue,
            };
            moved.follow(kept.iter().map(|&kept| path(kept)), slots);
        }
    }
}

/// The path that goes on.
#[inline]
fn path(kept: u32) -> usize {
    kept as usize >> 1
}

/// And with which payload bit.
#[inline]
fn bit(kept: u32) -> bool {
    kept & 1 == 1
}

impl Choice {
    /// The `list` least metrics; of equal ones the first. In ascending order, so that neighbours go on reading neighbouring slots.
    fn keep(&mut self, list: usize) {
        self.kept.clear();
        let count = self.metrics.len() as u32;
        if count as usize <= list {
            self.kept.extend(0..count);
            return;
        }
        self.keys.clear();
        let keys = (0..)
            .zip(&self.metrics)
            .map(|(place, &metric)| key(place, metric));
        self.keys.extend(keys);
        let (_, &mut last, _) = self.keys.select_nth_unstable(list - 1);
        let kept = (0..count).zip(&self.metrics);
        let kept = kept.filter(|&(place, &metric)| key(place, metric) <= last);
        self.kept.extend(kept.map(|(place, _)| place));
    }
}

/// Metrics are not negative, so that their bits are in the order of the numbers.
#[inline]
fn key(place: u32, metric: f32) -> u64 {
    u64::from(metric.to_bits()) << 32 | u64::from(place)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_are_kept_in_order_and_of_equal_ones_the_first() {
        let metrics = vec![3.0, 1.0, 2.0, 2.0, 0.0, 2.0];
        let mut choice = Choice {
            metrics,
            ..Default::default()
        };
        for (list, kept) in [
            (1, vec![4]),
            (3, vec![1, 2, 4]),
            (4, vec![1, 2, 3, 4]),
            (6, vec![0, 1, 2, 3, 4, 5]),
        ] {
            choice.keep(list);
            assert_eq!(choice.kept, kept);
        }
    }
}
