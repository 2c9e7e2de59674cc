use std::ops::{Add, AddAssign, Mul};

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
/// assert_eq!(sum.inverse(), Some([Vec3::X, Vec3::Y, Vec3::Z]));
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

    /// w |x − p|².
    pub fn of_point(point: Vec3, weight: f64) -> Self {
        Self {
            a: [weight, 0.0, 0.0, weight, 0.0, weight],
            b: point * weight,
            c: weight * point.squared(),
        }
    }

    /// The trace of A: the sum of the planes' weights.
    pub fn weight(&self) -> f64 {
        self.a[0] + self.a[3] + self.a[5]
    }

    /// Half of Q's gradient, A x − b.
    fn half_gradient(&self, point: Vec3) -> Vec3 {
        let Vec3([x, y, z]) = point;
        let [xx, xy, xz, yy, yz, zz] = self.a;
        let product = [
            xx * x + xy * y + xz * z,
            xy * x + yy * y + yz * z,
            xz * x + yz * y + zz * z,
        ];
        Vec3(product) - self.b
    }

    /// The s for which Q(x + s u) is least; none where none is.
    pub fn way_along(&self, point: Vec3, direction: Vec3) -> Option<f64> {
        let without_planes = Self {
            b: Vec3::ZERO,
            ..*self
        };
        let curvature = direction.dot(without_planes.half_gradient(direction));
        let way = -direction.dot(self.half_gradient(point)) / curvature;
        way.is_finite().then_some(way)
    }

    /// Q(x).
    #[inline]
    pub fn at(&self, point: Vec3) -> f64 {
        let Vec3([x, y, z]) = point;
        let [xx, xy, xz, yy, yz, zz] = self.a;
        let quadratic = xx * x * x + yy * y * y + zz * z * z + 2.0 * (xy * x * y + xz * x * z + yz * y * z);
        quadratic - 2.0 * self.b.dot(point) + self.c
    }

    /// A⁻¹, by rows; none where A has none, or it can't be told.
    pub fn inverse(&self) -> Option<[Vec3; 3]> {
        let [xx, xy, xz, yy, yz, zz] = self.a;
        let (p, q, r) = (Vec3([xx, xy, xz]), Vec3([xy, yy, yz]), Vec3([xz, yz, zz]));
        let determinant = p.dot(q.cross(r));
        let rows = [q.cross(r), r.cross(p), p.cross(q)].map(|row| row / determinant);
        let is_finite = rows.iter().all(|row| row.0.iter().all(|x| x.is_finite()));
        (determinant != 0.0 && is_finite).then_some(rows)
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

impl Mul<f64> for Quadric {
    type Output = Self;

    #[inline]
    fn mul(self, weight: f64) -> Self {
        Self {
            a: self.a.map(|entry| entry * weight),
            b: self.b * weight,
            c: self.c * weight,
        }
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
