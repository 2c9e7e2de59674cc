//! The field GF(2¹⁶³) = GF(2)[t] / (t¹⁶³ + t⁷ + t⁶ + t³ + 1).

use std::ops::{Add, Mul};

/// The degree m of the field.
pub(crate) const M: usize = 163;

/// t⁷ + t⁶ + t³ + 1, to which t¹⁶³ is congruent.
const REDUCTION: u64 = 0b1100_1001;

/// The bits of the last word that belong to an element: m - 128 of them.
const TOP_MASK: u64 = (1 << (M - 128)) - 1;

/// A polynomial over GF(2) of degree below 163; bit `i % 64` of word `i / 64` is the coefficient of tⁱ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct FieldElement([u64; 3]);

impl FieldElement {
    pub(crate) const ZERO: FieldElement = FieldElement([0, 0, 0]);
    pub(crate) const ONE: FieldElement = FieldElement([1, 0, 0]);

    /// The element whose words are given, the most significant first, as standards print them.
    pub(crate) const fn from_words(words: [u64; 3]) -> Self {
        assert!(words[0] <= TOP_MASK);
        FieldElement([words[2], words[1], words[0]])
    }

    /// The element encoded by 21 big-endian octets, unless bits beyond the field are set.
    pub(crate) fn from_octets(octets: &[u8; 21]) -> Option<Self> {
        let mut words = [0u64; 3];
        for (i, &octet) in octets.iter().rev().enumerate() {
            words[i / 8] |= u64::from(octet) << (8 * (i % 8));
        }
        (words[2] <= TOP_MASK).then_some(FieldElement(words))
    }

    /// The 21 big-endian octets.
    pub(crate) fn to_octets(self) -> [u8; 21] {
        std::array::from_fn(|i| {
            let position = 20 - i;
            self.0[position / 8].to_le_bytes()[position % 8]
        })
    }

    pub(crate) fn is_zero(self) -> bool {
        self == FieldElement::ZERO
    }

    /// The coefficient of tⁱ.
    pub(crate) fn bit(self, i: usize) -> bool {
        (self.0[i / 64] >> (i % 64)) & 1 == 1
    }

    pub(crate) fn square(self) -> Self {
        self * self
    }

    /// The element to the power of 2ⁿ.
    fn square_times(self, n: usize) -> Self {
        (0..n).fold(self, |a, _| a.square())
    }

    /// a⁻¹ = a^(2^m - 2) = (a^(2^(m-1) - 1))², by Fermat's little theorem; zero is mapped to zero.
    pub(crate) fn invert(self) -> Self {
        (0..M - 2).fold(self, |power, _| power.square() * self).square()
    }

    /// The only square root, a^(2^(m-1)).
    pub(crate) fn sqrt(self) -> Self {
        self.square_times(M - 1)
    }

    /// The half-trace Σ a^(4ⁱ), i = 0 … (m-1)/2: it solves z² + z = a where there is a solution (m is odd).
    pub(crate) fn half_trace(self) -> Self {
        let mut power = self;
        let mut sum = self;
        for _ in 0..(M - 1) / 2 {
            power = power.square_times(2);
            sum = sum + power;
        }
        sum
    }

    /// t · a.
    fn times_t(self) -> Self {
        let [low, middle, high] = self.0;
        let overflow = high >> (M - 1 - 128);
        FieldElement([
            (low << 1) ^ (REDUCTION * overflow),
            (middle << 1) | (low >> 63),
            ((high << 1) | (middle >> 63)) & TOP_MASK,
        ])
    }
}

/// Also subtraction: the characteristic is 2.
impl Add for FieldElement {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        FieldElement(std::array::from_fn(|i| self.0[i] ^ other.0[i]))
    }
}

/// a · b = Σ aᵢ (tⁱ b), term by term.
impl Mul for FieldElement {
    type Output = Self;

    #[expect(clippy::suspicious_arithmetic_impl, reason = "a product is a sum of shifts")]
    fn mul(self, other: Self) -> Self {
        let mut product = FieldElement::ZERO;
        let mut shifted = other;
        for i in 0..M {
            if self.bit(i) {
                product = product + shifted;
            }
            shifted = shifted.times_t();
        }
        product
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn element() -> impl Strategy<Value = FieldElement> {
        let sparse = (0..M).prop_map(|i| {
            let mut words = [0; 3];
            words[i / 64] = 1 << (i % 64);
            FieldElement(words)
        });
        let any = any::<[u64; 3]>().prop_map(|[a, b, c]| FieldElement([a, b, c & TOP_MASK]));
        prop_oneof![
            1 => Just(FieldElement::ZERO),
            1 => Just(FieldElement::ONE),
            1 => Just(FieldElement([u64::MAX, u64::MAX, TOP_MASK])),
            2 => sparse,
            8 => any,
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn addition_and_multiplication_make_a_commutative_ring(a in element(), b in element(), c in element()) {
            prop_assert_eq!(a + b, b + a);
            prop_assert_eq!((a + b) + c, a + (b + c));
            prop_assert_eq!(a + FieldElement::ZERO, a);
            prop_assert_eq!(a + a, FieldElement::ZERO);
            prop_assert_eq!(a * b, b * a);
            prop_assert_eq!((a * b) * c, a * (b * c));
            prop_assert_eq!(a * FieldElement::ONE, a);
            prop_assert_eq!(a * (b + c), a * b + a * c);
        }

        #[test]
        fn every_element_but_zero_has_an_inverse(a in element()) {
            let product = a * a.invert();
            prop_assert_eq!(product, if a.is_zero() { FieldElement::ZERO } else { FieldElement::ONE });
        }

        #[test]
        fn squaring_is_additive_and_a_bijection_of_order_163(a in element(), b in element()) {
            prop_assert_eq!((a + b).square(), a.square() + b.square());
            prop_assert_eq!(a.sqrt().square(), a);
            prop_assert_eq!(a.square_times(M), a);
        }

        #[test]
        fn the_half_trace_solves_the_quadratic_equation(z in element()) {
            let a = z.square() + z;
            let root = a.half_trace();
            prop_assert!(root == z || root == z + FieldElement::ONE);
        }

        #[test]
        fn octets_are_a_faithful_encoding(a in element()) {
            prop_assert_eq!(FieldElement::from_octets(&a.to_octets()), Some(a));
        }
    }

    #[test]
    fn t_to_the_163_is_t7_t6_t3_1() {
        let t = FieldElement([2, 0, 0]);
        let power = (0..M).fold(FieldElement::ONE, |a, _| a * t);
        assert_eq!(power, FieldElement([REDUCTION, 0, 0]));
    }

    #[test]
    fn octets_beyond_the_field_are_refused() {
        let mut octets = [0xff; 21];
        assert_eq!(FieldElement::from_octets(&octets), None);
        octets[0] = 0x08; // t^163
        assert_eq!(FieldElement::from_octets(&octets), None);
        octets[0] = 0x07;
        assert!(FieldElement::from_octets(&octets).is_some());
    }
}
