use sha2::{Digest, Sha256};

/// F_h: a permutation of 512-bit strings, keyed by the hash h of a statement. Nobody can choose a bit of what comes out by choosing
/// some bits of what goes in.
///
/// Four Feistel rounds with SHA-256 (Luby & Rackoff 1988): (L, R) ← (R, L ⊕ SHA-256(domain ‖ h ‖ i ‖ R)), i = 0 … 3. In ECDSA a
/// signer chooses r before there is anything to sign; here every bit depends on r, on s and on h.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Permutation {
    key: [u8; 32],
}

const ROUNDS: u8 = 4;

impl Permutation {
    /// The permutation of a statement by its hash.
    pub fn keyed(key: [u8; 32]) -> Self {
        Self { key }
    }

    /// F_h(L ‖ R).
    pub fn apply(&self, [mut left, mut right]: [[u8; 32]; 2]) -> [[u8; 32]; 2] {
        for round in 0..ROUNDS {
            (left, right) = (right, xor(left, self.round(round, &right)));
        }
        [left, right]
    }

    /// F_h⁻¹(L ‖ R).
    pub fn invert(&self, [mut left, mut right]: [[u8; 32]; 2]) -> [[u8; 32]; 2] {
        for round in (0..ROUNDS).rev() {
            (left, right) = (xor(right, self.round(round, &left)), left);
        }
        [left, right]
    }

    fn round(&self, round: u8, half: &[u8; 32]) -> [u8; 32] {
        let hash = Sha256::new()
            .chain_update(b"sigmark payload v3\0")
            .chain_update(self.key)
            .chain_update([round])
            .chain_update(half);
        hash.finalize().into()
    }
}

fn xor(a: [u8; 32], b: [u8; 32]) -> [u8; 32] {
    std::array::from_fn(|i| a[i] ^ b[i])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn differing_bits(a: [[u8; 32]; 2], b: [[u8; 32]; 2]) -> u32 {
        let pairs = a.as_flattened().iter().zip(b.as_flattened());
        pairs.map(|(x, y)| (x ^ y).count_ones()).sum()
    }

    proptest! {
        #[test]
        fn it_is_a_permutation(key: [u8; 32], left: [u8; 32], right: [u8; 32]) {
            let permutation = Permutation::keyed(key);
            prop_assert_eq!(permutation.invert(permutation.apply([left, right])), [left, right]);
            prop_assert_eq!(permutation.apply(permutation.invert([left, right])), [left, right]);
        }

        /// 256 of 512 bits in the mean, with a standard deviation of 11: eight of them allow for all cases of the test together.
        #[test]
        fn one_bit_of_key_or_input_changes_half_of_the_output(key: [u8; 32], left: [u8; 32], right: [u8; 32], bit in 0usize..256) {
            let flipped = |mut half: [u8; 32]| { half[bit / 8] ^= 1 << (bit % 8); half };
            let out = Permutation::keyed(key).apply([left, right]);
            for other in [
                Permutation::keyed(flipped(key)).apply([left, right]),
                Permutation::keyed(key).apply([flipped(left), right]),
                Permutation::keyed(key).apply([left, flipped(right)]),
            ] {
                prop_assert!((168..=344).contains(&differing_bits(out, other)));
            }
        }
    }

    #[test]
    fn the_rounds_are_those_that_the_certificate_page_prints() {
        let [left, right] = [[1; 32], [2; 32]];
        let mut halves = [left, right];
        for round in 0..4u8 {
            let input = [b"sigmark payload v3\0", &[7; 32][..], &[round], &halves[1]].concat();
            let hash: [u8; 32] = Sha256::digest(input).into();
            halves = [halves[1], xor(halves[0], hash)];
        }
        assert_eq!(Permutation::keyed([7; 32]).apply([left, right]), halves);
    }
}
