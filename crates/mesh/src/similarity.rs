use crate::vector::{add, dot, scale};

/// A similarity transform, p ↦ s R p + t.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Similarity {
    /// s, greater than zero.
    pub scale: f64,
    /// R, row by row: orthogonal, of determinant 1, or −1 where the transform mirrors.
    pub rotation: [[f64; 3]; 3],
    /// t.
    pub translation: [f64; 3],
}

impl Default for Similarity {
    fn default() -> Self {
        Self::IDENTITY
    }
}

impl Similarity {
    /// The transform that moves nothing.
    pub const IDENTITY: Self = Self {
        scale: 1.0,
        rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        translation: [0.0; 3],
    };

    /// The rotation of a quaternion w + xi + yj + zk of any length but zero.
    ///
    /// A quaternion that is uniform on the unit sphere (four normal deviates) gives a uniformly random rotation.
    pub fn from_quaternion([w, x, y, z]: [f64; 4]) -> Self {
        let n = 2.0 / (w * w + x * x + y * y + z * z);
        let rotation = [
            [
                1.0 - n * (y * y + z * z),
                n * (x * y - w * z),
                n * (x * z + w * y),
            ],
            [
                n * (x * y + w * z),
                1.0 - n * (x * x + z * z),
                n * (y * z - w * x),
            ],
            [
                n * (x * z - w * y),
                n * (y * z + w * x),
                1.0 - n * (x * x + y * y),
            ],
        ];
        Self {
            rotation,
            ..Self::IDENTITY
        }
    }

    /// Where a point goes.
    pub fn apply(&self, p: [f64; 3]) -> [f64; 3] {
        add(
            scale(self.scale, self.rotation.map(|row| dot(row, p))),
            self.translation,
        )
    }

    /// Where many points go.
    pub fn apply_all(&self, points: &[[f64; 3]]) -> Vec<[f64; 3]> {
        points.iter().map(|&p| self.apply(p)).collect()
    }

    /// The transform that undoes this one.
    pub fn inverse(&self) -> Self {
        let back = Self {
            scale: 1.0 / self.scale,
            rotation: transposed(self.rotation),
            translation: [0.0; 3],
        };
        Self {
            translation: scale(-1.0, back.apply(self.translation)),
            ..back
        }
    }

    /// First this transform, then `next`.
    pub fn then(&self, next: &Self) -> Self {
        let columns = transposed(self.rotation);
        Self {
            scale: next.scale * self.scale,
            rotation: next.rotation.map(|row| columns.map(|column| dot(row, column))),
            translation: next.apply(self.translation),
        }
    }

    /// Whether left becomes right: the determinant of R is negative.
    pub fn mirrors(&self) -> bool {
        let [a, b, c] = self.rotation;
        dot(a, crate::vector::cross(b, c)) < 0.0
    }

    /// The 4 by 4 matrix for homogeneous column vectors, row by row: s R beside t, over 0 0 0 1.
    pub fn to_matrix(&self) -> [[f64; 4]; 4] {
        let mut matrix = [[0.0, 0.0, 0.0, 1.0]; 4];
        for i in 0..3 {
            let [x, y, z] = scale(self.scale, self.rotation[i]);
            matrix[i] = [x, y, z, self.translation[i]];
        }
        matrix
    }
}

fn transposed(m: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| std::array::from_fn(|j| m[j][i]))
}
