use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, Index, IndexMut, Mul, Neg, Sub, SubAssign};

/// A vector of three coordinates, so that equations read as equations.
///
/// Lists of points are stored as `[f64; 3]`; a vector begins where arithmetic does. Its operations are those of the formula,
/// from left to right, and nothing is fused: a sum of three products is (x x' + y y') + z z' on every machine.
///
/// ```
/// use mesh::Vec3;
/// let [a, b, c] = [Vec3::ZERO, 2.0 * Vec3::X, Vec3::from([0.0, 3.0, 0.0])];
/// let normal = (b - a).cross(c - a);
/// assert_eq!(normal, 6.0 * Vec3::Z);
/// assert_eq!((normal.norm(), normal.unit()[2], normal.dot(b)), (6.0, 1.0, 0.0));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(transparent)]
pub struct Vec3(pub [f64; 3]);

// Everything is inline, for the loops of other crates: a call in each would double their time.
impl Vec3 {
    /// 0, 0, 0.
    pub const ZERO: Self = Self([0.0; 3]);
    /// The unit vector along the x axis.
    pub const X: Self = Self([1.0, 0.0, 0.0]);
    /// The unit vector along the y axis.
    pub const Y: Self = Self([0.0, 1.0, 0.0]);
    /// The unit vector along the z axis.
    pub const Z: Self = Self([0.0, 0.0, 1.0]);
    /// All three unit vectors.
    pub const AXES: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// a · b.
    #[inline]
    pub fn dot(self, other: Self) -> f64 {
        let (Self(a), Self(b)) = (self, other);
        a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    }

    /// a × b.
    #[inline]
    pub fn cross(self, other: Self) -> Self {
        let (Self(a), Self(b)) = (self, other);
        Self([
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ])
    }

    /// a · a.
    #[inline]
    pub fn squared(self) -> f64 {
        self.dot(self)
    }

    /// The length, √(a · a).
    #[inline]
    pub fn norm(self) -> f64 {
        self.squared().sqrt()
    }

    /// The unit vector of the same direction; zero for zero.
    #[inline]
    pub fn unit(self) -> Self {
        let length = self.norm();
        if length > 0.0 {
            self * (1.0 / length)
        } else {
            Self::ZERO
        }
    }

    /// f of each coordinate.
    #[inline]
    pub fn map(self, f: impl FnMut(f64) -> f64) -> Self {
        Self(self.0.map(f))
    }
}

impl From<[f64; 3]> for Vec3 {
    #[inline]
    fn from(coordinates: [f64; 3]) -> Self {
        Self(coordinates)
    }
}

impl From<Vec3> for [f64; 3] {
    #[inline]
    fn from(vector: Vec3) -> Self {
        vector.0
    }
}

impl Add for Vec3 {
    type Output = Self;

    #[inline]
    fn add(self, Self(b): Self) -> Self {
        let Self(a) = self;
        Self([a[0] + b[0], a[1] + b[1], a[2] + b[2]])
    }
}

impl Sub for Vec3 {
    type Output = Self;

    #[inline]
    fn sub(self, Self(b): Self) -> Self {
        let Self(a) = self;
        Self([a[0] - b[0], a[1] - b[1], a[2] - b[2]])
    }
}

impl Neg for Vec3 {
    type Output = Self;

    #[inline]
    fn neg(self) -> Self {
        self.map(|x| -x)
    }
}

impl Mul<f64> for Vec3 {
    type Output = Self;

    #[inline]
    fn mul(self, s: f64) -> Self {
        self.map(|x| x * s)
    }
}

impl Mul<Vec3> for f64 {
    type Output = Vec3;

    #[inline]
    fn mul(self, vector: Vec3) -> Vec3 {
        vector * self
    }
}

impl Div<f64> for Vec3 {
    type Output = Self;

    #[inline]
    fn div(self, s: f64) -> Self {
        self.map(|x| x / s)
    }
}

impl AddAssign for Vec3 {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Vec3 {
    #[inline]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl Sum for Vec3 {
    #[inline]
    fn sum<I: Iterator<Item = Self>>(vectors: I) -> Self {
        vectors.fold(Self::ZERO, Add::add)
    }
}

impl Index<usize> for Vec3 {
    type Output = f64;

    #[inline]
    fn index(&self, axis: usize) -> &f64 {
        &self.0[axis]
    }
}

impl IndexMut<usize> for Vec3 {
    #[inline]
    fn index_mut(&mut self, axis: usize) -> &mut f64 {
        &mut self.0[axis]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn vectors() -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(-10.0..10.0).prop_map(Vec3)
    }

    proptest! {
        #[test]
        fn the_cross_product_stands_upright_on_both_and_is_as_long_as_the_parallelogram_is_large(a in vectors(), b in vectors()) {
            let across = a.cross(b);
            prop_assert!(across.dot(a).abs().max(across.dot(b).abs()) < 1e-11);
            prop_assert!((across.squared() + a.dot(b) * a.dot(b) - a.squared() * b.squared()).abs() < 1e-9);
            prop_assert_eq!(b.cross(a), -across);
        }

        #[test]
        fn a_vector_is_its_length_times_its_direction(a in vectors()) {
            prop_assert!((a - a.norm() * a.unit()).norm() < 1e-14);
            prop_assert!((a.unit().norm() - 1.0).abs() < 1e-15 || a == Vec3::ZERO);
        }

        #[test]
        fn sums_go_from_left_to_right(a in vectors(), b in vectors(), c in vectors()) {
            let mut total = a;
            total += b;
            total -= -c;
            prop_assert_eq!([a, b, c].into_iter().sum::<Vec3>(), total);
            prop_assert_eq!(total / 2.0, 0.5 * total);
        }
    }

    #[test]
    fn axes_turn_into_each_other_and_zero_has_no_direction() {
        assert_eq!(Vec3::X.cross(Vec3::Y), Vec3::Z);
        assert_eq!(Vec3::Y.cross(Vec3::Z), Vec3::X);
        assert_eq!(Vec3::ZERO.unit(), Vec3::ZERO);
        assert_eq!(<[f64; 3]>::from(Vec3::default()), [0.0; 3]);
    }
}
