use crate::Vec3;

/// A similarity transform, p ↦ s R p + t.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
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

    /// Where a point goes, given as a [`Vec3`] or as an array.
    #[inline]
    pub fn apply<P: From<Vec3> + Into<Vec3>>(&self, p: P) -> P {
        let p = p.into();
        let turned = Vec3(self.rotation.map(|row| Vec3(row).dot(p)));
        P::from(turned * self.scale + Vec3(self.translation))
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
            translation: (-back.apply(Vec3(self.translation))).into(),
            ..back
        }
    }

    /// First this transform, then `next`.
    pub fn then(&self, next: &Self) -> Self {
        let columns = transposed(self.rotation);
        Self {
            scale: next.scale * self.scale,
            rotation: next
                .rotation
                .map(|row| columns.map(|column| Vec3(row).dot(Vec3(column)))),
            translation: next.apply(self.translation),
        }
    }

    /// Whether left becomes right: the determinant of R is negative.
    pub fn mirrors(&self) -> bool {
        let [a, b, c] = self.rotation.map(Vec3);
        a.dot(b.cross(c)) < 0.0
    }

    /// The 4 by 4 matrix for homogeneous column vectors, row by row: s R beside t, over 0 0 0 1.
    pub fn to_matrix(&self) -> [[f64; 4]; 4] {
        let mut matrix = [[0.0, 0.0, 0.0, 1.0]; 4];
        for i in 0..3 {
            let [x, y, z] = self.rotation[i].map(|r| r * self.scale);
            matrix[i] = [x, y, z, self.translation[i]];
        }
        matrix
    }
}

fn transposed(m: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| std::array::from_fn(|j| m[j][i]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn points(size: f64) -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(-size..size).prop_map(Vec3)
    }

    fn similarities() -> impl Strategy<Value = Similarity> {
        let quaternion = prop::array::uniform4(-1.0..1.0)
            .prop_filter("not zero", |q| q.iter().any(|x: &f64| x.abs() > 0.1));
        (
            quaternion,
            1e-3..1e3,
            prop::array::uniform3(-1e2..1e2),
            any::<bool>(),
        )
            .prop_map(|(q, scale, translation, mirror)| {
                let mut rotation = Similarity::from_quaternion(q).rotation;
                if mirror {
                    rotation[1] = rotation[1].map(|x: f64| -x);
                }
                Similarity {
                    scale,
                    rotation,
                    translation,
                }
            })
    }

    proptest! {
        #[test]
        fn the_inverse_brings_every_point_back(s in similarities(), p in points(1e2)) {
            prop_assert!((s.inverse().apply(s.apply(p)) - p).norm() < 1e-9);
            prop_assert!((s.then(&s.inverse()).apply(p) - p).norm() < 1e-9);
        }

        #[test]
        fn a_chain_of_transforms_does_what_they_do_one_after_the_other(
            s in similarities(), t in similarities(), p in points(1e2)
        ) {
            let there = t.apply(s.apply(p));
            let size = there.norm() + t.scale * Vec3(s.translation).norm() + Vec3(t.translation).norm();
            prop_assert!((s.then(&t).apply(p) - there).norm() < 1e-12 * size);
            prop_assert_eq!(s.then(&t).mirrors(), s.mirrors() != t.mirrors());
        }

        #[test]
        fn distances_are_multiplied_by_the_scale(s in similarities(), p in points(1.0)) {
            let moved = (s.apply(p) - s.apply(Vec3::ZERO)).norm();
            prop_assert!((moved - s.scale * p.norm()).abs() < 1e-12 * (s.scale + Vec3(s.translation).norm()));
        }

        #[test]
        fn the_matrix_does_what_the_transform_does(s in similarities(), [x, y, z] in prop::array::uniform3(-1.0..1.0)) {
            let [i, j, k, one] = s.to_matrix().map(|row| row[0] * x + row[1] * y + row[2] * z + row[3]);
            prop_assert_eq!(one, 1.0);
            let apart = Vec3(s.apply([x, y, z])) - Vec3([i, j, k]);
            prop_assert!(apart.norm() < 1e-12 * (s.scale + Vec3(s.translation).norm()));
        }
    }

    #[test]
    fn a_quaternion_turns_counter_clockwise_about_its_axis() {
        let quarter_about_z = Similarity::from_quaternion([1.0, 0.0, 0.0, 1.0]);
        assert!((quarter_about_z.apply(Vec3::X) - Vec3::Y).norm() < 1e-15);
        assert!(!quarter_about_z.mirrors());
    }
}
