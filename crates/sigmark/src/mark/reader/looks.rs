//! Reading on: a look at few patches, then at more, and at all in the end.
//!
//! Patches that follow each other carry every bit once. So the first look is at the patches of a run of chips that is enough for what the bits hold, the next at those of [`GROWTH`] times as
//! many, and so on. Which ones come first depends on what is seen of the suspect, never on bits; how many looks at patches there are, on the layout alone.

use crate::mark::{ChipPlan, MarkLayout};

/// Runs of chips in a look, to those in the one before.
const GROWTH: usize = 8;

/// The patches of every look, each ascending. Where each patch carries all bits, there is one look, at all.
pub(super) fn looks(layout: &MarkLayout, is_seen: impl Fn(usize) -> bool) -> Vec<Vec<usize>> {
    let patches = layout.original().patches();
    let every: Vec<usize> = (0..patches.len()).collect();
    let ChipPlan::Pooled { enough, .. } = layout.plan() else {
        return vec![every];
    };
    let mut ends = Vec::with_capacity(every.len());
    let mut chips = 0;
    for &patch in &every {
        chips += layout.chips(patch).len();
        ends.push(chips);
    }
    let seen: Vec<usize> = patches
        .iter()
        .map(|patch| patch.vertices().iter().filter(|&&v| is_seen(v as usize)).count())
        .collect();
    let mut runs: Vec<std::ops::Range<usize>> = (0..chips / enough)
        .map(|j| {
            let holding = |chip: usize| ends.partition_point(|&end| end <= chip);
            holding(j * enough)..holding((j + 1) * enough - 1) + 1
        })
        .collect();
    let share = |run: &std::ops::Range<usize>| {
        let vertices: usize = patches[run.clone()]
            .iter()
            .map(|patch| patch.vertices().len())
            .sum();
        seen[run.clone()].iter().sum::<usize>() as f64 / vertices.max(1) as f64
    };
    runs.sort_by(|a, b| share(b).total_cmp(&share(a)));
    let mut looks = Vec::new();
    let mut size = 1;
    while size < runs.len() {
        let mut look: Vec<usize> = runs[..size].iter().cloned().flatten().collect();
        look.sort_unstable();
        look.dedup();
        looks.push(look);
        size = size.saturating_mul(GROWTH);
    }
    looks.push(every);
    looks
}
