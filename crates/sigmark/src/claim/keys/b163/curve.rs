//! The group of points of y² + xy = x³ + a x² + b over GF(2¹⁶³), with a = 1.

use crypto_bigint::U192;

use super::field::FieldElement;
use crate::claim::keys::error::PointError;

/// b.
const B: FieldElement =
    FieldElement::from_words([0x2_0a60_1907, 0xb8c9_53ca_1481_eb10, 0x512f_7874_4a32_05fd]);

/// The order `d` of the base point, a prime of 163 bits that exceeds 2¹⁶² by about 2⁸¹.
pub(crate) const ORDER: U192 = U192::from_be_hex("000000040000000000000000000292fe77e70c12a4234c33");

/// The base point (the paper's `A`), of order `d`.
pub(crate) const GENERATOR: AffinePoint = AffinePoint {
    x: FieldElement::from_words([0x3_f0eb_a162, 0x86a2_d57e_a099_1168, 0xd499_4637_e834_3e36]),
    y: FieldElement::from_words([0x0_d51f_bc6c, 0x71a0_094f_a2cd_d545, 0xb11c_5c0c_7973_24f1]),
};

/// A point other than the neutral element, which is `None` where it can occur.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct AffinePoint {
    pub(crate) x: FieldElement,
    pub(crate) y: FieldElement,
}

impl AffinePoint {
    /// Decodes and validates a public key (SEC 1, 2.3.4 and 3.2.2.1): on the curve and, the cofactor being 2, of order `d`.
    pub(crate) fn from_sec1(octets: &[u8]) -> Result<Self, PointError> {
        let point = match octets {
            [] => return Err(PointError::Encoding("it is empty")),
            [0] => return Err(PointError::Infinity),
            [4, coordinates @ ..] if coordinates.len() == 42 => {
                let (x, y) = coordinates.split_at(21);
                let (x, y) = (coordinate(x)?, coordinate(y)?);
                AffinePoint { x, y }
            }
            [tag @ (2 | 3), x @ ..] if x.len() == 21 => decompress(coordinate(x)?, *tag == 3)?,
            [0 | 2 | 3 | 4, ..] => return Err(PointError::Encoding("its length is wrong")),
            _ => return Err(PointError::Encoding("its first octet is not 0, 2, 3 or 4")),
        };
        if !point.is_on_curve() {
            return Err(PointError::NotOnCurve);
        }
        match point.mul(&ORDER) {
            None => Ok(point),
            Some(_) => Err(PointError::WrongOrder),
        }
    }

    /// The uncompressed encoding 04 || x || y.
    pub(crate) fn to_sec1(self) -> [u8; 43] {
        let mut octets = [4; 43];
        octets[1..22].copy_from_slice(&self.x.to_octets());
        octets[22..].copy_from_slice(&self.y.to_octets());
        octets
    }

    pub(crate) fn is_on_curve(self) -> bool {
        let AffinePoint { x, y } = self;
        y.square() + x * y == (x + FieldElement::ONE) * x.square() + B
    }

    /// k P.
    pub(crate) fn mul(self, k: &U192) -> Option<Self> {
        self.mul_projective(k).to_affine()
    }

    /// k P + l Q.
    pub(crate) fn mul_add(self, k: &U192, other: Self, l: &U192) -> Option<Self> {
        let sum = self.mul_projective(k);
        match other.mul(l) {
            Some(point) => sum.add(point).to_affine(),
            None => sum.to_affine(),
        }
    }

    /// Double and add, from the most significant bit.
    fn mul_projective(self, k: &U192) -> ProjectivePoint {
        (0..k.bits_vartime())
            .rev()
            .fold(ProjectivePoint::INFINITY, |sum, i| {
                let doubled = sum.double();
                if k.bit_vartime(i) {
                    doubled.add(self)
                } else {
                    doubled
                }
            })
    }
}

/// A coordinate of 21 octets.
fn coordinate(octets: &[u8]) -> Result<FieldElement, PointError> {
    octets
        .try_into()
        .ok()
        .and_then(FieldElement::from_octets)
        .ok_or(PointError::Encoding("a coordinate exceeds 163 bits"))
}

/// The point with this x whose y/x ends in the bit `odd` (SEC 1, 2.3.4).
///
/// With y = xz the equation becomes z² + z = x + a + b/x².
fn decompress(x: FieldElement, odd: bool) -> Result<AffinePoint, PointError> {
    if x.is_zero() {
        return Ok(AffinePoint { x, y: B.sqrt() });
    }
    let c = x + FieldElement::ONE + B * x.square().invert();
    let mut z = c.half_trace();
    if z.square() + z != c {
        return Err(PointError::NotOnCurve);
    }
    if z.bit(0) != odd {
        z = z + FieldElement::ONE;
    }
    Ok(AffinePoint { x, y: x * z })
}

/// López–Dahab coordinates: x = X/Z, y = Y/Z², so that only the last step divides; Z = 0 is the neutral element.
#[derive(Clone, Copy, Debug)]
struct ProjectivePoint {
    x: FieldElement,
    y: FieldElement,
    z: FieldElement,
}

impl ProjectivePoint {
    const INFINITY: ProjectivePoint = ProjectivePoint {
        x: FieldElement::ONE,
        y: FieldElement::ZERO,
        z: FieldElement::ZERO,
    };

    fn to_affine(self) -> Option<AffinePoint> {
        if self.z.is_zero() {
            return None;
        }
        let inverse = self.z.invert();
        Some(AffinePoint {
            x: self.x * inverse,
            y: self.y * inverse.square(),
        })
    }

    /// 2 P (Hankerson, Menezes, Vanstone: Guide to Elliptic Curve Cryptography, algorithm 3.24).
    fn double(self) -> Self {
        let x1_2 = self.x.square();
        let z1_2 = self.z.square();
        let b_z1_4 = B * z1_2.square();
        let z3 = x1_2 * z1_2;
        let x3 = x1_2.square() + b_z1_4;
        let y3 = b_z1_4 * z3 + x3 * (z3 + self.y.square() + b_z1_4);
        ProjectivePoint { x: x3, y: y3, z: z3 }
    }

    /// P + Q, with Q affine (the same book, algorithm 3.25).
    fn add(self, q: AffinePoint) -> Self {
        if self.z.is_zero() {
            return ProjectivePoint {
                x: q.x,
                y: q.y,
                z: FieldElement::ONE,
            };
        }
        let z1_2 = self.z.square();
        let a = q.y * z1_2 + self.y;
        let b = q.x * self.z + self.x;
        if b.is_zero() {
            // The same x: either Q = P, or Q = -P.
            return if a.is_zero() {
                self.double()
            } else {
                ProjectivePoint::INFINITY
            };
        }
        let c = self.z * b;
        let d = b.square() * (c + z1_2);
        let z3 = c.square();
        let e = a * c;
        let x3 = a.square() + d + e;
        let f = x3 + q.x * z3;
        let g = (q.x + q.y) * z3.square();
        let y3 = (e + z3) * f + g;
        ProjectivePoint { x: x3, y: y3, z: z3 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// P + Q by the chord-and-tangent rule in affine coordinates, the definition (SEC 1, 2.2.2).
    fn add(p: Option<AffinePoint>, q: Option<AffinePoint>) -> Option<AffinePoint> {
        let (Some(p), Some(q)) = (p, q) else {
            return p.or(q);
        };
        let (lambda, x) = if p.x != q.x {
            let lambda = (p.y + q.y) * (p.x + q.x).invert();
            (lambda, lambda.square() + lambda + p.x + q.x + FieldElement::ONE)
        } else if p.y == q.y && !p.x.is_zero() {
            let lambda = p.x + p.y * p.x.invert();
            (lambda, lambda.square() + lambda + FieldElement::ONE)
        } else {
            return None;
        };
        Some(AffinePoint {
            x,
            y: lambda * (p.x + x) + x + p.y,
        })
    }

    fn negated(p: AffinePoint) -> AffinePoint {
        AffinePoint { x: p.x, y: p.x + p.y }
    }

    /// The only point of order 2.
    fn two_torsion() -> AffinePoint {
        AffinePoint {
            x: FieldElement::ZERO,
            y: B.sqrt(),
        }
    }

    fn scalar() -> impl Strategy<Value = U192> {
        prop_oneof![
            1 => (0u64..5).prop_map(U192::from),
            1 => (0u64..5).prop_map(|k| ORDER.wrapping_sub(&U192::from(k))),
            3 => any::<[u64; 3]>().prop_map(|[a, b, c]| U192::from_words([a, b, c & 7])),
        ]
    }

    fn decoded(octets: &[u8]) -> Result<AffinePoint, PointError> {
        AffinePoint::from_sec1(octets)
    }

    #[test]
    fn the_base_point_lies_on_the_curve_and_has_order_d() {
        assert!(GENERATOR.is_on_curve());
        assert_eq!(GENERATOR.mul(&ORDER), None);
        let before = ORDER.wrapping_sub(&U192::ONE);
        assert_eq!(GENERATOR.mul(&before), Some(negated(GENERATOR)));
        assert_eq!(GENERATOR.mul(&U192::ZERO), None);
        assert_eq!(GENERATOR.mul(&U192::ONE), Some(GENERATOR));
    }

    #[test]
    fn small_multiples_are_repeated_sums() {
        let mut sum = None;
        for k in 0u64..40 {
            assert_eq!(GENERATOR.mul(&U192::from(k)), sum, "{k} A");
            sum = add(sum, Some(GENERATOR));
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn multiplication_is_a_homomorphism_from_the_integers(k in scalar(), l in scalar()) {
            let (p, q) = (GENERATOR.mul(&k), GENERATOR.mul(&l));
            let sum = GENERATOR.mul(&k.wrapping_add(&l));
            prop_assert_eq!(add(p, q), sum);
            prop_assert_eq!(add(q, p), sum);
            prop_assert_eq!(GENERATOR.mul_add(&k, GENERATOR, &l), sum);
            prop_assert!(sum.is_none_or(AffinePoint::is_on_curve));
        }

        #[test]
        fn a_point_survives_both_encodings(k in scalar()) {
            let Some(point) = GENERATOR.mul(&k) else { return Ok(()) };
            let octets = point.to_sec1();
            prop_assert_eq!(decoded(&octets), Ok(point));
            let z = point.y * point.x.invert();
            let mut compressed = octets[..22].to_vec();
            compressed[0] = 2 + u8::from(z.bit(0));
            prop_assert_eq!(decoded(&compressed), Ok(point));
            compressed[0] ^= 1;
            prop_assert_eq!(decoded(&compressed), Ok(negated(point)));
        }
    }

    #[test]
    fn points_outside_the_subgroup_are_refused() {
        let small = two_torsion();
        assert!(small.is_on_curve());
        assert_eq!(add(Some(small), Some(small)), None);
        assert_eq!(decoded(&small.to_sec1()), Err(PointError::WrongOrder));
        assert_eq!(
            decoded(&[2; 1].into_iter().chain([0; 21]).collect::<Vec<_>>()),
            Err(PointError::WrongOrder)
        );
        let outside = add(Some(small), Some(GENERATOR)).expect("the sum of two different points");
        assert!(outside.is_on_curve());
        assert_eq!(decoded(&outside.to_sec1()), Err(PointError::WrongOrder));
    }

    #[test]
    fn encodings_that_are_no_points_are_refused() {
        let good = GENERATOR.to_sec1();
        assert_eq!(decoded(&[0]), Err(PointError::Infinity));
        for tag in [1, 5, 6, 7, 255] {
            let mut octets = good;
            octets[0] = tag;
            assert!(matches!(decoded(&octets), Err(PointError::Encoding(_))), "{tag}");
        }
        for length in (0..43).filter(|&length| length != 22) {
            let octets = &good[..length];
            assert!(
                matches!(decoded(octets), Err(PointError::Encoding(_))),
                "{length}"
            );
        }
        for bit in 0..8 * 42 {
            let mut octets = good;
            octets[1 + bit / 8] ^= 1 << (bit % 8);
            assert!(
                matches!(
                    decoded(&octets),
                    Err(PointError::NotOnCurve | PointError::Encoding(_))
                ),
                "{bit}"
            );
        }
    }

    #[test]
    fn an_x_coordinate_without_a_point_is_refused() {
        let refused = (1u8..40)
            .filter(|&x| {
                let mut octets = [0; 22];
                octets[0] = 2;
                octets[21] = x;
                decoded(&octets) == Err(PointError::NotOnCurve)
            })
            .count();
        // Half of all x have no y.
        assert!((8..32).contains(&refused), "{refused} of 39");
    }
}
