use std::{ops::Range, sync::Arc};

use sha2::{Digest, Sha256};

/// The keyed rotation R of a mark: what chips say is spread over neighbouring harmonics, so that none of them sits on one that is known.
///
/// Who compares three signed copies of a model could see which sign each harmonic has in each, and take the rarer one: that erases a mark whose
/// chips sit on harmonics, at no cost to the model. Through a rotation that only the statement tells, a harmonic's part in a mark is a number of a bell curve, and
/// there is no rarer sign to take.
///
/// Of each patch the chips of one axis, in the order of their frequencies, are multiplied by random signs and go through Hadamard matrices of [`GROUP`](Self::GROUP) neighbours,
/// or as many as there are; once in blocks from the lowest frequency on, once in blocks from the highest one down, so that none is left over. R is orthogonal: chips
/// are as strong in all, and are found again by its transpose.
#[derive(Clone, Debug)]
pub struct Rotation {
    /// Where the chips of each patch begin, and where the last one's end.
    starts: Vec<usize>,
    /// ±1 before each of the two rounds, for all chips.
    signs: [Vec<f64>; 2],
}

impl Rotation {
    /// How many neighbours are mixed, a power of two. Smoothing leaves much of some harmonics and nothing of others: the more are mixed, the less a reader can make of the former. After thirty steps on the bunny T₀ is 34 without a
    /// rotation, 30 with 16 and 30 with 64; noise and decimation make no difference.
    pub const GROUP: usize = 16;

    /// The rotation of a key for patches with these numbers of harmonics, each of which has [three chips a harmonic](super::ChipPlan) but the constant one.
    ///
    /// The signs are the bits of SHA-256(domain ‖ key ‖ i), i = 0, 1, … as 64-bit little-endian integers, most significant first, 1 for −1: those of the first round for all chips, patch after patch, then
    /// those of the second.
    pub fn keyed(key: &[u8; 32], functions: &[usize]) -> Self {
        let mut starts = vec![0];
        for m in functions {
            starts.push(starts[starts.len() - 1] + 3 * m.saturating_sub(1));
        }
        let chips = starts[starts.len() - 1];
        let mut signs = Vec::with_capacity(2 * chips + 256);
        for i in 0_u64.. {
            if signs.len() >= 2 * chips {
                break;
            }
            let hash = Sha256::new_with_prefix(b"sigmark rotation v7\0")
                .chain_update(key)
                .chain_update(i.to_le_bytes())
                .finalize();
            let of_byte = |byte: &u8| {
                let byte = *byte;
                (0..8).map(move |bit| if byte << bit & 128 == 0 { 1.0 } else { -1.0 })
            };
            signs.extend(hash.iter().flat_map(of_byte));
        }
        signs.truncate(2 * chips);
        let second = signs.split_off(chips);
        Self {
            starts,
            signs: [signs, second],
        }
    }

    /// How many chips there are in all patches.
    pub fn len(&self) -> usize {
        self.signs[0].len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// R x, what chips x of all patches add to the coefficients, in units of the amplitude; both in the order of the chips.
    ///
    /// # Panics
    /// When there is not one number a chip.
    pub fn coefficients(&self, x: &[f64]) -> Vec<f64> {
        self.by_patch(x, coefficients)
    }

    /// Rᵀ u, what coefficients u of all patches say of the chips.
    ///
    /// # Panics
    /// When there is not one number a chip.
    pub fn chips(&self, u: &[f64]) -> Vec<f64> {
        self.by_patch(u, chips)
    }

    fn by_patch(&self, x: &[f64], turn: Turn) -> Vec<f64> {
        assert_eq!(x.len(), self.len(), "a number a chip");
        let mut turned = vec![0.0; x.len()];
        for patch in 0..self.starts.len() - 1 {
            let range = self.range(patch);
            self.turn(patch, &x[range.clone()], turn, &mut turned[range]);
        }
        turned
    }

    /// Chips of the three axes take turns in their order.
    fn turn(&self, patch: usize, x: &[f64], turn: Turn, turned: &mut [f64]) {
        let every_third =
            |all: &[f64], axis: usize| -> Vec<f64> { all.iter().skip(axis).step_by(3).copied().collect() };
        for axis in 0..3 {
            let mut run = every_third(x, axis);
            let [first, second] =
                [0, 1].map(|round| every_third(&self.signs[round][self.range(patch)], axis));
            turn([&first, &second], &mut run);
            for (place, value) in turned.iter_mut().skip(axis).step_by(3).zip(run) {
                *place = value;
            }
        }
    }

    fn range(&self, patch: usize) -> Range<usize> {
        self.starts[patch]..self.starts[patch + 1]
    }
}

/// The rotation of one patch.
#[derive(Clone, Debug)]
pub struct PatchRotation {
    all: Arc<Rotation>,
    patch: usize,
}

impl PatchRotation {
    /// That of a patch, by its number from 0.
    pub(super) fn new(all: &Arc<Rotation>, patch: usize) -> Self {
        let all = Arc::clone(all);
        Self { all, patch }
    }

    /// R x.
    ///
    /// # Panics
    /// When there is not one number a chip.
    pub fn coefficients(&self, x: &[f64]) -> Vec<f64> {
        self.turned(x, coefficients)
    }

    /// Rᵀ u.
    ///
    /// # Panics
    /// When there is not one number a chip.
    pub fn chips(&self, u: &[f64]) -> Vec<f64> {
        self.turned(u, chips)
    }

    fn turned(&self, x: &[f64], turn: Turn) -> Vec<f64> {
        assert_eq!(x.len(), self.all.range(self.patch).len(), "a number a chip");
        let mut turned = vec![0.0; x.len()];
        self.all.turn(self.patch, x, turn, &mut turned);
        turned
    }
}

/// What turns the chips of one axis, given the signs of both rounds.
type Turn = fn([&[f64]; 2], &mut [f64]);

fn coefficients(signs: [&[f64]; 2], x: &mut [f64]) {
    multiply(x, signs[0]);
    from_below(x);
    multiply(x, signs[1]);
    from_above(x);
}

fn chips(signs: [&[f64]; 2], u: &mut [f64]) {
    from_above(u);
    multiply(u, signs[1]);
    from_below(u);
    multiply(u, signs[0]);
}

fn multiply(x: &mut [f64], signs: &[f64]) {
    x.iter_mut().zip(signs).for_each(|(x, sign)| *x *= sign);
}

/// How many of so many neighbours a Hadamard matrix mixes.
fn block(neighbours: usize) -> usize {
    match neighbours {
        0 => 1,
        n => (1 << n.ilog2()).min(Rotation::GROUP),
    }
}

fn from_below(x: &mut [f64]) {
    let block = block(x.len());
    x.chunks_exact_mut(block).for_each(hadamard);
}

fn from_above(x: &mut [f64]) {
    let block = block(x.len());
    x.rchunks_exact_mut(block).for_each(hadamard);
}

/// The orthogonal Walsh–Hadamard transform of 2ⁿ numbers, which is its own inverse.
fn hadamard(x: &mut [f64]) {
    let mut half = 1;
    while half < x.len() {
        for pair in x.chunks_exact_mut(2 * half) {
            let (low, high) = pair.split_at_mut(half);
            for (a, b) in low.iter_mut().zip(high) {
                (*a, *b) = (*a + *b, *a - *b);
            }
        }
        half *= 2;
    }
    let unit = (x.len() as f64).sqrt().recip();
    x.iter_mut().for_each(|x| *x *= unit);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn numbers(count: usize, seed: u64) -> Vec<f64> {
        let one = |i: usize| ((i as u64 + 1) * (2 * seed + 1)).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40;
        (0..count).map(|i| one(i) as f64 / 8_388_608.0 - 1.0).collect()
    }

    fn dot(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| a * b).sum()
    }

    proptest! {
        #[test]
        fn it_is_orthogonal(key: [u8; 32], functions in prop::collection::vec(1usize..120, 1..6), seed in 0u64..1000) {
            let rotation = Rotation::keyed(&key, &functions);
            prop_assert_eq!(rotation.len(), functions.iter().map(|m| 3 * (m - 1)).sum::<usize>());
            let x = numbers(rotation.len(), seed);
            let y = numbers(rotation.len(), seed + 1);
            let back = rotation.chips(&rotation.coefficients(&x));
            prop_assert!(back.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-12));
            let (left, right) = (dot(&rotation.coefficients(&x), &y), dot(&x, &rotation.chips(&y)));
            prop_assert!((left - right).abs() < 1e-9 * (1.0 + left.abs()));
        }
    }

    /// Which harmonics a chip moves, and that it stays with its patch, its axis and its neighbours.
    #[test]
    fn a_chip_is_spread_over_neighbours_of_its_own_patch_and_axis() {
        let functions = [3, 96, 30];
        let rotation = Rotation::keyed(&[9; 32], &functions);
        for chip in [
            0,
            3,
            6,
            6 + 4,
            6 + 3 * 50 + 1,
            6 + 3 * 94,
            6 + 285 + 2,
            rotation.len() - 1,
        ] {
            let mut x = vec![0.0; rotation.len()];
            x[chip] = 1.0;
            let patch = (0..3).find(|&i| chip < rotation.starts[i + 1]).unwrap();
            let moved: Vec<usize> = (0..x.len())
                .zip(rotation.coefficients(&x))
                .filter(|(_, u)| u.abs() > 1e-12)
                .map(|(i, _)| i)
                .collect();
            let range = rotation.starts[patch]..rotation.starts[patch + 1];
            assert!(moved.iter().all(|i| range.contains(i) && (i % 3) == chip % 3));
            let of_axis = functions[patch] - 1;
            assert!(
                moved.len() >= block(of_axis) / 2 && moved.len() <= 2 * Rotation::GROUP,
                "{moved:?}"
            );
        }
    }

    #[test]
    fn the_signs_are_those_that_the_certificate_page_prints() {
        let rotation = Rotation::keyed(&[7; 32], &[40, 60]);
        let bytes: Vec<u8> = (0..3_u64)
            .flat_map(|i| Sha256::digest([b"sigmark rotation v7\0", &[7; 32][..], &i.to_le_bytes()].concat()))
            .collect();
        let signs = rotation.signs.concat();
        for (i, sign) in signs.iter().enumerate().take(8 * bytes.len()) {
            let bit = bytes[i / 8] >> (7 - i % 8) & 1;
            assert_eq!(*sign, if bit == 1 { -1.0 } else { 1.0 });
        }
        assert_eq!(signs.len(), 2 * 3 * (39 + 59));
    }
}
