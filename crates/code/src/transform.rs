//! Arıkan's transform x = u F^⊗n over GF(2), F = (1 0; 1 1), without bit reversal. It is its own inverse.

/// In place; the length is a power of two.
pub(crate) fn transform(bits: &mut [bool]) {
    let mut half = 1;
    while half < bits.len() {
        for block in bits.chunks_exact_mut(2 * half) {
            let (left, right) = block.split_at_mut(half);
            for (l, r) in left.iter_mut().zip(right) {
                *l ^= *r;
            }
        }
        half *= 2;
    }
}

/// The positions of a word whose index has bit s = 0.
const LEFT: [u64; 6] = [
    0x5555_5555_5555_5555,
    0x3333_3333_3333_3333,
    0x0F0F_0F0F_0F0F_0F0F,
    0x00FF_00FF_00FF_00FF,
    0x0000_FFFF_0000_FFFF,
    0x0000_0000_FFFF_FFFF,
];

/// The same for the 2^`stage` lowest bits of a word, at most 64; the others are zero.
#[inline]
pub(crate) fn transform_word(mut word: u64, stage: usize) -> u64 {
    for (s, left) in LEFT.iter().enumerate().take(stage) {
        word ^= (word >> (1 << s)) & left;
    }
    word
}
