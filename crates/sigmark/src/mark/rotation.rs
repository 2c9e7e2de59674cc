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
    /// m − 1 of each patch: how many chips it has along each axis.
    useful: Vec<usize>,
    /// Where the chips of each patch begin, and where the last one's end.
    starts: Vec<usize>,
    /// 1 for −1 before each of the two rounds, for all chips in the order of [runs](Self::in_runs).
    signs: [Vec<u8>; 2],
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
        let useful: Vec<usize> = functions.iter().map(|m| m.saturating_sub(1)).collect();
        let mut starts = vec![0];
        useful
            .iter()
            .for_each(|useful| starts.push(starts[starts.len() - 1] + 3 * useful));
        let chips = starts[starts.len() - 1];
        let drawn = signs(key, 2 * chips);
        let of_round = |drawn: &[u8]| {
            let mut signs = Vec::with_capacity(chips);
            for (&useful, &start) in useful.iter().zip(&starts) {
                let drawn = &drawn[start..start + 3 * useful];
                (0..3).for_each(|axis| signs.extend(drawn.chunks_exact(3).map(|chip| chip[axis])));
            }
            signs
        };
        let signs = [of_round(&drawn[..chips]), of_round(&drawn[chips..])];
        Self {
            useful,
            starts,
            signs,
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

    /// Turns what chips of all patches say into what they add to the coefficients, in units of the amplitude: R x. Both in the order of [runs](Self::in_runs).
    ///
    /// # Panics
    /// When there is not one number a chip.
    pub fn to_coefficients(&self, x: &mut [f64]) {
        self.turn(0..self.useful.len(), x, coefficients);
    }

    /// Turns coefficients of all patches into what they say of the chips: Rᵀ u. Both in the order of [runs](Self::in_runs).
    ///
    /// # Panics
    /// When there is not one number a chip.
    pub fn to_chips(&self, u: &mut [f64]) {
        self.turn(0..self.useful.len(), u, chips);
    }

    /// The numbers of all chips in the order of runs: patch after patch, and in each axis after axis, where the chips of an axis stand in the order of their frequencies.
    pub fn in_runs(&self) -> Vec<usize> {
        let patches = self.useful.iter().zip(&self.starts);
        let of_patch = |(&useful, &start)| (0..3 * useful).map(move |i| start + in_run(i, useful));
        patches.flat_map(of_patch).collect()
    }

    fn turn(&self, patches: Range<usize>, x: &mut [f64], turn: Turn) {
        let first = self.starts[patches.start];
        assert_eq!(x.len(), self.starts[patches.end] - first, "a number a chip");
        for patch in patches {
            let useful = self.useful[patch];
            for axis in 0..3 {
                let start = self.starts[patch] + axis * useful;
                let run = start..start + useful;
                let signs = [&self.signs[0][run.clone()], &self.signs[1][run]];
                turn(signs, &mut x[start - first..start - first + useful]);
            }
        }
    }
}

/// The chip of a patch that stands in a place of its runs.
fn in_run(place: usize, useful: usize) -> usize {
    3 * (place % useful) + place / useful
}

/// So many signs, or a few more, that follow from a key: 1 for −1.
fn signs(key: &[u8; 32], count: usize) -> Vec<u8> {
    let mut signs = Vec::with_capacity(count + 256);
    for i in 0_u64.. {
        if signs.len() >= count {
            break;
        }
        let hash = Sha256::new_with_prefix(b"sigmark rotation v7\0")
            .chain_update(key)
            .chain_update(i.to_le_bytes());
        for byte in hash.finalize() {
            signs.extend_from_slice(&BITS[usize::from(byte)]);
        }
    }
    signs
}

/// The bits of each byte: a tracer draws millions.
static BITS: [[u8; 8]; 256] = {
    let mut bits = [[0; 8]; 256];
    let mut i = 0;
    while i < 8 * 256 {
        bits[i / 8][i % 8] = ((i / 8) >> (7 - i % 8) & 1) as u8;
        i += 1;
    }
    bits
};

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
        let useful = self.all.useful[self.patch];
        assert_eq!(x.len(), 3 * useful, "a number a chip");
        let mut runs: Vec<f64> = (0..x.len()).map(|i| x[in_run(i, useful)]).collect();
        self.all.turn(self.patch..self.patch + 1, &mut runs, turn);
        let mut turned = vec![0.0; x.len()];
        for (i, value) in runs.into_iter().enumerate() {
            turned[in_run(i, useful)] = value;
        }
        turned
    }
}

/// What turns the chips of one axis, given the signs of both rounds.
type Turn = fn([&[u8]; 2], &mut [f64]);

fn coefficients(signs: [&[u8]; 2], x: &mut [f64]) {
    multiply(x, signs[0]);
    from_below(x);
    multiply(x, signs[1]);
    from_above(x);
}

fn chips(signs: [&[u8]; 2], u: &mut [f64]) {
    from_above(u);
    multiply(u, signs[1]);
    from_below(u);
    multiply(u, signs[0]);
}

fn multiply(x: &mut [f64], signs: &[u8]) {
    for (x, &sign) in x.iter_mut().zip(signs) {
        *x = f64::from_bits(x.to_bits() ^ u64::from(sign) << 63);
    }
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
    match x.as_chunks_mut::<{ Rotation::GROUP }>() {
        // Of a known length it is made of vector instructions.
        ([whole], []) => butterflies(whole),
        _ => butterflies(x),
    }
}

#[inline(always)]
fn butterflies(x: &mut [f64]) {
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

    fn turned(rotation: &Rotation, x: &[f64], forth: bool) -> Vec<f64> {
        let mut turned = x.to_vec();
        match forth {
            true => rotation.to_coefficients(&mut turned),
            false => rotation.to_chips(&mut turned),
        }
        turned
    }

    proptest! {
        #[test]
        fn it_is_orthogonal(key: [u8; 32], functions in prop::collection::vec(1usize..120, 1..6), seed in 0u64..1000) {
            let rotation = Rotation::keyed(&key, &functions);
            prop_assert_eq!(rotation.len(), functions.iter().map(|m| 3 * (m - 1)).sum::<usize>());
            let (x, y) = (numbers(rotation.len(), seed), numbers(rotation.len(), seed + 1));
            let u = turned(&rotation, &x, true);
            let back = turned(&rotation, &u, false);
            prop_assert!(back.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-12));
            let (left, right) = (dot(&u, &y), dot(&x, &turned(&rotation, &y, false)));
            prop_assert!((left - right).abs() < 1e-9 * (1.0 + left.abs()));
        }

        /// In the order of chips, patch by patch, it is the same rotation.
        #[test]
        fn patches_turn_alone_as_they_do_together(key: [u8; 32], functions in prop::collection::vec(1usize..60, 1..5), seed in 0u64..1000) {
            let rotation = Arc::new(Rotation::keyed(&key, &functions));
            let (x, order) = (numbers(rotation.len(), seed), rotation.in_runs());
            let runs: Vec<f64> = order.iter().map(|&i| x[i]).collect();
            let together = turned(&rotation, &runs, true);
            let mut alone = Vec::new();
            for patch in 0..functions.len() {
                let range = rotation.starts[patch]..rotation.starts[patch + 1];
                alone.extend(PatchRotation::new(&rotation, patch).coefficients(&x[range]));
            }
            prop_assert!(order.iter().zip(&together).all(|(&i, u)| (alone[i] - u).abs() < 1e-12));
        }
    }

    /// Which harmonics a chip moves, and that it stays with its patch, its axis and its neighbours.
    #[test]
    fn a_chip_is_spread_over_neighbours_of_its_own_patch_and_axis() {
        let functions = [3, 96, 30];
        let rotation = Rotation::keyed(&[9; 32], &functions);
        let runs = rotation.useful.iter().flat_map(|&useful| [useful; 3]);
        let mut start = 0;
        for useful in runs {
            for chip in start..start + useful {
                let mut x = vec![0.0; rotation.len()];
                x[chip] = 1.0;
                let moved: Vec<usize> = (0..x.len())
                    .zip(turned(&rotation, &x, true))
                    .filter(|(_, u)| u.abs() > 1e-12)
                    .map(|(i, _)| i)
                    .collect();
                assert!(moved.iter().all(|i| (start..start + useful).contains(i)));
                let near = |&i: &usize| i.abs_diff(chip) < 3 * Rotation::GROUP;
                assert!(moved.iter().all(near));
                assert!(
                    moved.len() >= block(useful) / 2 && moved.len() <= 2 * Rotation::GROUP,
                    "{moved:?}"
                );
            }
            start += useful;
        }
    }

    #[test]
    fn the_signs_are_those_that_the_certificate_page_prints() {
        let rotation = Rotation::keyed(&[7; 32], &[40, 60]);
        let bytes: Vec<u8> = (0..4_u64)
            .flat_map(|i| Sha256::digest([b"sigmark rotation v7\0", &[7; 32][..], &i.to_le_bytes()].concat()))
            .collect();
        let order = rotation.in_runs();
        let signs = rotation.signs.concat();
        for (i, sign) in signs.iter().enumerate() {
            let place = i / order.len() * order.len() + order[i % order.len()];
            let bit = bytes[place / 8] >> (7 - place % 8) & 1;
            assert_eq!(*sign, bit);
        }
        assert_eq!(signs.len(), 2 * 3 * (39 + 59));
    }
}
