//! What the paths know of the nodes at one stage, in slots.

/// Of the node at a stage that is being decoded.
pub(super) struct Stage {
    /// Its ratios, 2^stage to a slot.
    pub(super) ratios: Vec<f32>,
    /// From which slot of `ratios` each path reads.
    pub(super) ratio_slots: Slots,
    /// Code bits of the last left child, which its sister and their parent need.
    pub(super) left: Bits,
    /// From which slot of `left` each path reads.
    pub(super) left_slots: Slots,
    /// Code bits of the last right child, which its parent takes at once: path p reads slot p.
    pub(super) right: Bits,
}

impl Stage {
    /// Room for a list. The system gives memory when it is written to, so that stages through which few paths go cost little.
    pub(super) fn new(stage: usize, list: usize) -> Self {
        Self {
            ratios: vec![0.0; list << stage],
            ratio_slots: Slots(vec![0; list]),
            left: Bits::new(stage, list),
            left_slots: Slots(vec![0; list]),
            right: Bits::new(stage, list),
        }
    }
}

/// From which slot each path reads.
pub(super) struct Slots(Vec<u32>);

impl Slots {
    /// Each path has just written its own slot.
    pub(super) fn own(&mut self, paths: usize) {
        for (p, slot) in self.0[..paths].iter_mut().enumerate() {
            *slot = p as u32;
        }
    }

    #[inline]
    pub(super) fn of(&self, path: usize) -> usize {
        self.0[path] as usize
    }

    /// Path p reads henceforth where path `before(p)` has read.
    pub(super) fn follow(&mut self, before: impl Iterator<Item = usize>, room: &mut Vec<u32>) {
        room.clear();
        room.extend(before.map(|path| self.0[path]));
        self.0[..room.len()].copy_from_slice(room);
    }
}

/// Code bits, from the lowest bit of each slot's first word.
pub(super) struct Bits {
    words: Vec<u64>,
    width: usize,
}

impl Bits {
    fn new(stage: usize, list: usize) -> Self {
        let width = (1usize << stage).div_ceil(64);
        Self {
            words: vec![0; list * width],
            width,
        }
    }

    #[inline]
    pub(super) fn at(&self, slot: usize) -> &[u64] {
        &self.words[slot * self.width..][..self.width]
    }

    #[inline]
    pub(super) fn at_mut(&mut self, slot: usize) -> &mut [u64] {
        &mut self.words[slot * self.width..][..self.width]
    }

    /// One word a slot: of stages up to 64 bits.
    pub(super) fn words(&mut self) -> &mut [u64] {
        &mut self.words
    }
}
