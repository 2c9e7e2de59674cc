//! Successive cancellation with a list of paths.

use crate::{
    candidates::{Candidates, History},
    kernels,
    plan::Step,
    precode::Precoder,
    transform::transform_word,
};

/// What the paths know of the nodes at one stage.
///
/// All paths are at the same step, so that whatever a step writes it writes for all of them, path p in slot p. Only forks
/// move paths; they change from which slot a path reads (Tal and Vardy's lazy copies, without counting who shares a slot).
struct Stage {
    /// Numbers of the node that is being decoded, 2^s for each slot.
    ratios: Vec<f32>,
    /// From which slot each path reads them.
    ratio_slots: Vec<u32>,
    /// Code bits of the last left child, in words.
    left: Vec<u64>,
    /// From which slot each path reads them.
    left_slots: Vec<u32>,
    /// Code bits of the last right child, which are used at once.
    right: Vec<u64>,
    words: usize,
}

impl Stage {
    fn new(stage: usize, list: usize) -> Self {
        let words = (1usize << stage).div_ceil(64);
        Self {
            ratios: vec![0.0; list << stage],
            ratio_slots: vec![0; list],
            left: vec![0; list * words],
            left_slots: vec![0; list],
            right: vec![0; list * words],
            words,
        }
    }

    fn bits(&mut self, left: bool) -> &mut [u64] {
        if left { &mut self.left } else { &mut self.right }
    }
}

fn identity(slots: &mut [u32]) {
    for (p, slot) in slots.iter_mut().enumerate() {
        *slot = p as u32;
    }
}

/// The paths of one decoding.
pub(crate) struct Paths<'a> {
    channel: &'a [f32],
    precoder: Precoder,
    list: usize,
    stages: Vec<Stage>,
    /// −ln P of each path's bits so far.
    metrics: Vec<f32>,
    /// What each path's payload adds to the next bits.
    registers: Vec<u64>,
    history: History,
    fork: ForkRoom,
}

/// Room that every fork uses anew.
#[derive(Default)]
struct ForkRoom {
    metrics: Vec<f32>,
    keys: Vec<u64>,
    kept: Vec<u32>,
    words: Vec<u64>,
    slots: Vec<u32>,
}

impl<'a> Paths<'a> {
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
            fork: ForkRoom::default(),
        }
    }

    pub(crate) fn run<const EXACT: bool>(mut self, steps: &[Step]) -> Candidates {
        for &step in steps {
            match step {
                Step::Check { stage } => self.check::<EXACT>(stage),
                Step::Variable { stage } => self.variable(stage),
                Step::Frozen { stage, left } => self.frozen::<EXACT>(stage, left),
                Step::Fork { stage, position } => self.fork::<EXACT>(stage, position),
                Step::Combine { stage, left } => self.combine(stage, left),
            }
        }
        Candidates::new(self.history, self.metrics)
    }

    fn check<const EXACT: bool>(&mut self, stage: usize) {
        let paths = self.metrics.len();
        let (below, above) = self.stages.split_at_mut(stage + 1);
        let child = &mut below[stage];
        identity(&mut child.ratio_slots[..paths]);
        match above.first() {
            Some(parent) => match stage {
                0 => check_all::<EXACT, 1>(paths, &parent.ratios, &mut child.ratios),
                1 => check_all::<EXACT, 2>(paths, &parent.ratios, &mut child.ratios),
                2 => check_all::<EXACT, 4>(paths, &parent.ratios, &mut child.ratios),
                _ => {
                    let pairs = child.ratios.chunks_exact_mut(1 << stage);
                    for (child, parent) in pairs.zip(parent.ratios.chunks_exact(2 << stage)).take(paths) {
                        kernels::check::<EXACT>(parent, child);
                    }
                }
            },
            None => {
                for child in child.ratios.chunks_exact_mut(1 << stage).take(paths) {
                    kernels::check::<EXACT>(self.channel, child);
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
            words,
            ..
        } = &mut below[stage];
        identity(&mut ratio_slots[..paths]);
        let size = 1 << stage;
        let children = ratios.chunks_exact_mut(size).take(paths);
        for (p, child) in children.enumerate() {
            let parent = match above.first() {
                Some(parent) => {
                    let slot = parent.ratio_slots[p] as usize;
                    &parent.ratios[2 * size * slot..][..2 * size]
                }
                None => self.channel,
            };
            let sister = left_slots[p] as usize * *words;
            let sister = &left[sister..sister + *words];
            match stage {
                0 => kernels::variable(&parent[..2], sister, &mut child[..1]),
                1 => kernels::variable(&parent[..4], sister, &mut child[..2]),
                2 => kernels::variable(&parent[..8], sister, &mut child[..4]),
                _ => kernels::variable(parent, sister, child),
            }
        }
    }

    fn frozen<const EXACT: bool>(&mut self, stage: usize, left: bool) {
        let size = 1 << stage;
        let paths = self.metrics.len();
        let all: u64 = if size == 64 { !0 } else { (1 << size) - 1 };
        let Self { stages, channel, .. } = self;
        let Some(at) = stages.get_mut(stage) else {
            // Only a code without payload is one frozen leaf.
            let _ = channel;
            return;
        };
        if left {
            identity(&mut at.left_slots[..paths]);
        }
        for p in 0..paths {
            let register = self.registers[p];
            let bits = transform_word(register & all, stage);
            self.registers[p] = if size == 64 { 0 } else { register >> size };
            let ratios = &at.ratios[p * size..][..size];
            self.metrics[p] += kernels::penalties::<EXACT>(ratios, bits)[0];
            if left {
                at.left[p] = bits;
            } else {
                at.right[p] = bits;
            }
        }
    }

    fn combine(&mut self, stage: usize, left: bool) {
        let paths = self.metrics.len();
        let (below, above) = self.stages.split_at_mut(stage);
        let Some(parent) = above.first_mut() else { return };
        let child = &below[stage - 1];
        let (words, half) = (child.words, 1usize << (stage - 1));
        if left {
            identity(&mut parent.left_slots[..paths]);
        }
        let width = parent.words;
        let out = parent.bits(left);
        for p in 0..paths {
            let slot = child.left_slots[p] as usize;
            if half < 64 {
                let (l, r) = (child.left[slot], child.right[p]);
                out[p] = (l ^ r) | r << half;
                continue;
            }
            let l = &child.left[slot * words..][..words];
            let r = &child.right[p * words..][..words];
            let (first, second) = out[p * width..][..width].split_at_mut(words);
            for k in 0..words {
                first[k] = l[k] ^ r[k];
                second[k] = r[k];
            }
        }
    }

    fn fork<const EXACT: bool>(&mut self, stage: usize, position: usize) {
        let size = 1usize << stage;
        let paths = self.metrics.len();
        let before: u64 = (1u64 << (size - 1)) - 1;
        let room = &mut self.fork;
        room.metrics.clear();
        room.words.clear();
        for p in 0..paths {
            let ratios = match self.stages.get(stage) {
                Some(at) => &at.ratios[p * size..][..size],
                None => self.channel,
            };
            // The bits before the last are known; the last, u = v ⊕ register, turns all code bits.
            let known = transform_word(self.registers[p] & (before << 1 | 1), stage);
            let [zero, one] = match stage {
                0 => kernels::penalties::<EXACT>(&ratios[..1], known),
                1 => kernels::penalties::<EXACT>(&ratios[..2], known),
                2 => kernels::penalties::<EXACT>(&ratios[..4], known),
                _ => kernels::penalties::<EXACT>(ratios, known),
            };
            room.metrics.push(self.metrics[p] + zero);
            room.metrics.push(self.metrics[p] + one);
            room.words.push(known);
        }
        room.select(self.list);
        self.follow(stage, position);
    }

    /// Paths become those that were kept: 2 p + v says that path p goes on with v.
    fn follow(&mut self, stage: usize, position: usize) {
        let Self {
            stages,
            fork: room,
            registers,
            metrics,
            precoder,
            ..
        } = self;
        let size = 1usize << stage;
        let all = if size == 64 { !0 } else { (1u64 << size) - 1 };
        metrics.clear();
        metrics.extend(room.kept.iter().map(|&kept| room.metrics[kept as usize]));
        if let Some(at) = stages.get_mut(stage) {
            let left = position >> stage & 1 == 0;
            if left {
                identity(&mut at.left_slots[..room.kept.len()]);
            }
            let bits = at.bits(left);
            for (out, &kept) in bits.iter_mut().zip(&room.kept) {
                *out = room.words[kept as usize >> 1] ^ if kept & 1 == 1 { all } else { 0 };
            }
        }
        room.words.clear();
        for &kept in &room.kept {
            let register = registers[kept as usize >> 1] >> (size - 1);
            room.words.push(precoder.after(register, kept & 1 == 1));
        }
        std::mem::swap(registers, &mut room.words);
        let last = position + size - 1;
        // Above, a node that is a left child will need its parent's ratios again, a right child its sister's bits.
        for s in stage..stages.len() {
            let slots = if last >> s & 1 == 1 {
                &mut stages[s].left_slots
            } else if s + 1 < stages.len() {
                &mut stages[s + 1].ratio_slots
            } else {
                continue;
            };
            room.slots.clear();
            room.slots.extend(room.kept.iter().map(|&kept| slots[kept as usize >> 1]));
            slots[..room.slots.len()].copy_from_slice(&room.slots);
        }
        self.history.push(&room.kept);
    }
}

impl ForkRoom {
    /// The `list` least metrics; of equal ones the first. They stay in order, so that neighbours go on reading neighbouring slots.
    fn select(&mut self, list: usize) {
        self.kept.clear();
        let count = self.metrics.len() as u32;
        if count as usize <= list {
            self.kept.extend(0..count);
            return;
        }
        // Metrics are not negative, so that their bits are in the order of the numbers.
        let key = |index: u32, metric: f32| u64::from(metric.to_bits()) << 32 | u64::from(index);
        self.keys.clear();
        self.keys.extend(self.metrics.iter().enumerate().map(|(i, &metric)| key(i as u32, metric)));
        let (_, &mut last, _) = self.keys.select_nth_unstable(list - 1);
        let kept = (0..count).filter(|&i| key(i, self.metrics[i as usize]) <= last);
        self.kept.extend(kept);
    }
}

/// Check nodes of small stages, their size known to the compiler.
fn check_all<const EXACT: bool, const SIZE: usize>(paths: usize, parents: &[f32], children: &mut [f32]) {
    let pairs = children.chunks_exact_mut(SIZE).zip(parents.chunks_exact(2 * SIZE));
    for (child, parent) in pairs.take(paths) {
        kernels::check::<EXACT>(parent, child);
    }
}
