//! The one source of randomness: SplitMix64 (Steele, Lea, Flood 2014), always seeded by the caller.

/// A small generator; equal seeds give equal streams everywhere.
#[derive(Clone, Debug)]
pub(crate) struct Rng(u64);

impl Rng {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed ^ 0x6a09_e667_f3bc_c908)
    }

    /// An independent stream for sub-task `stream`, so that tasks may run in any order.
    pub(crate) fn fork(&self, stream: u64) -> Self {
        let mut child = Self(self.0 ^ stream.wrapping_add(1).wrapping_mul(0xd6e8_feb8_6659_fd93));
        child.0 = child.next_u64();
        child
    }

    pub(crate) fn next_u64(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in `0..count` up to a bias of `count` / 2^32; `count` at least 1.
    pub(crate) fn below(&mut self, count: usize) -> usize {
        (((self.next_u64() >> 32) * count as u64) >> 32) as usize
    }

    /// Fisher–Yates.
    pub(crate) fn shuffle(&mut self, items: &mut [u32]) {
        for i in (1..items.len()).rev() {
            items.swap(i, self.below(i + 1));
        }
    }
}
