use std::ops::{Add, AddAssign};

use mesh::Vec3;

/// A sum of weighted squared distances from planes, as a function of a point: Q(x) = xᵀ A x − 2 b·x + c.
///
/// ```
/// use decimation::Quadric;
/// use mesh::Vec3;
/// // The planes x = 1, y = 2 and z = 3 meet in one point.
/// let planes = [(Vec3::X, 1.0), (Vec3::Y, 2.0), (Vec3::Z, 3.0)];
/// let sum = planes.iter().fold(Quadric::ZERO, |sum, &(normal, offset)| sum + Quadric::of_plane(normal, offset));
/// assert_eq!(sum.minimum(), Some(Vec3([1.0, 2.0, 3.0])));
/// assert_eq!(sum.at(Vec3::ZERO), 14.0);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quadric {
    /// xx, xy, xz, yy, yz, zz of A.
    a: [f64; 6],
    b: Vec3,
    c: f64,
}

impl Quadric {
    /// Zero everywhere.
    pub const ZERO: Self = Self {
        a: [0.0; 6],
        b: Vec3::ZERO,
        c: 0.0,
    };

    /// (n·x − d)², for a normal n of any length: its square is the weight of the plane.
    #[inline]
    pub fn of_plane(normal: Vec3, offset: f64) -> Self {
        let Vec3([x, y, z]) = normal;
        Self {
            a: [x * x, x * y, x * z, y * y, y * z, z * z],
            b: normal * offset,
            c: offset * offset,
        }
    }

    /// Q(x).
    #[inline]
    pub fn at(&self, point: Vec3) -> f64 {
        let Vec3([x, y, z]) = point;
        let [xx, xy, xz, yy, yz, zz] = self.a;
        let quadratic = xx * x * x + yy * y * y + zz * z * z + 2.0 * (xy * x * y + xz * x * z + yz * y * z);
        quadratic - 2.0 * self.b.dot(point) + self.c
    }

    /// Where Q is least, by Cramer's rule; none where no one point is, as for parallel planes, or where it can't be told.
    #[inline]
    pub fn minimum(&self) -> Option<Vec3> {
        let [xx, xy, xz, yy, yz, zz] = self.a;
        let (p, q, r) = (Vec3([xx, xy, xz]), Vec3([xy, yy, yz]), Vec3([xz, yz, zz]));
        let determinant = p.dot(q.cross(r));
        let of_adjugate = [q.cross(r), r.cross(p), p.cross(q)];
        let sum = (0..3).fold(Vec3::ZERO, |sum, i| sum + of_adjugate[i] * self.b[i]);
        let point = sum / determinant;
        (determinant != 0.0 && point.0.iter().all(|x| x.is_finite())).then_some(point)
    }
}

impl Add for Quadric {
    type Output = Self;

    #[inline]
    fn add(mut self, other: Self) -> Self {
        self += other;
        self
    }
}

impl AddAssign for Quadric {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        for (sum, entry) in self.a.iter_mut().zip(other.a) {
            *sum += entry;
        }
        self.b += other.b;
        self.c += other.c;
    }
}
