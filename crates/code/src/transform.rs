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

/// Places of a word whose number has bit s = 0, for each s.
const LEFT: [u64; 6] = [
    0x5555_5555_5555_5555,
    0x3333_3333_3333_3333,
    0x0F0F_0F0F_0F0F_0F0F,
    0x00FF_00FF_00FF_00FF,
    0x0000_FFFF_0000_FFFF,
    0x0000_0000_FFFF_FFFF,
];

/// Of the 2^`stage` lowest bits of a word, at most 64; the others are zero.
#[inline]
pub(crate) fn transform_word(mut word: u64, stage: usize) -> u64 {
    for (s, left) in LEFT.iter().enumerate().take(stage) {
        word ^= (word >> (1 << s)) & left;
    }
    word
}

/// A word whose 2^`stage` lowest bits are 1, at most 64.
#[inline]
pub(crate) fn ones(stage: usize) -> u64 {
    u64::MAX >> (64 - (1 << stage))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_its_own_inverse_and_words_agree_with_lists_of_bits() {
        for stage in 0..=6 {
            let word = 0x9E37_79B9_7F4A_7C15 & ones(stage);
            let mut bits: Vec<bool> = (0..1 << stage).map(|i| word >> i & 1 == 1).collect();
            let before = bits.clone();
            transform(&mut bits);
            let transformed = transform_word(word, stage);
            assert!((0..1 << stage).all(|i| bits[i] == (transformed >> i & 1 == 1)));
            transform(&mut bits);
            assert_eq!((bits, transform_word(transformed, stage)), (before, word));
        }
    }

    #[test]
    fn row_i_of_the_matrix_has_ones_where_the_column_is_a_part_of_i() {
        for i in 0..32 {
            let mut bits = [false; 32];
            bits[i] = true;
            transform(&mut bits);
            assert!((0..32).all(|column| bits[column] == (column & i == column)));
        }
    }
}
