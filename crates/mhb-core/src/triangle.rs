use mesh::Vec3;

/// What a triangle contributes to the Laplacian: its area and the cotangents of its corners' angles.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triangle {
    pub(crate) area: f64,
    /// cot of the angle at corner 0, 1, 2.
    pub(crate) cotangents: [f64; 3],
}

/// A triangle whose height is below this fraction of its longest edge is degenerate: rounding has eaten its angles.
const DEGENERATE: f64 = 1e-10;

impl Triangle {
    /// cot α = u·v / |u × v| for the edges u, v that leave the corner. `None` for a degenerate triangle.
    pub(crate) fn from_corners([a, b, c]: [Vec3; 3]) -> Option<Self> {
        let [ab, bc, ca] = [b - a, c - b, a - c];
        let twice_area = ab.cross(bc).norm();
        let longest = [ab, bc, ca].map(Vec3::squared).into_iter().fold(0.0, f64::max);
        (twice_area > DEGENERATE * longest && twice_area.is_normal()).then(|| Self {
            area: twice_area / 2.0,
            cotangents: [-ca.dot(ab), -ab.dot(bc), -bc.dot(ca)].map(|d| d / twice_area),
        })
    }

    /// The same from edge lengths, `lengths[i]` opposite corner i, which must satisfy the strict triangle inequality.
    /// The area is Kahan's form of Heron's formula, which is accurate for needles.
    pub(crate) fn from_lengths(lengths: [f64; 3]) -> Self {
        let mut sorted = lengths;
        sorted.sort_by(f64::total_cmp);
        let [c, b, a] = sorted;
        let area = ((a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c)))
            .max(0.0)
            .sqrt()
            / 4.0;
        let cotangent = |i: usize| {
            let [a, b, c] = [lengths[i], lengths[(i + 1) % 3], lengths[(i + 2) % 3]];
            (b * b + (c - a) * (c + a)) / (4.0 * area)
        };
        Self {
            area,
            cotangents: [cotangent(0), cotangent(1), cotangent(2)],
        }
    }

    /// Half the area and half the cotangents: this triangle's part where it is counted twice.
    pub(crate) fn halved(self) -> Self {
        Self {
            area: self.area / 2.0,
            cotangents: self.cotangents.map(|c| c / 2.0),
        }
    }

    /// Lengthens the edges of a degenerate triangle by the least equal amount that leaves a slack of `delta` in the
    /// triangle inequality (intrinsic mollification, Sharp and Crane 2020, section 4.5, one triangle at a time).
    pub(crate) fn mollified(corners: [Vec3; 3], delta: f64) -> Self {
        let lengths = edge_lengths(corners);
        let longest = lengths.into_iter().fold(0.0, f64::max);
        let shortfall = delta + 2.0 * longest - lengths.iter().sum::<f64>();
        Self::from_lengths(lengths.map(|l| l + shortfall.max(0.0)))
    }
}

/// Length of the edge opposite each corner.
pub(crate) fn edge_lengths(corners: [Vec3; 3]) -> [f64; 3] {
    std::array::from_fn(|i| {
        let [p, q] = [corners[(i + 1) % 3], corners[(i + 2) % 3]];
        (q - p).norm()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_and_lengths_give_the_same_triangle() {
        let corners = [[0.3, 0.1, -0.2], [1.7, 0.4, 0.9], [-0.5, 2.0, 0.3]].map(Vec3);
        let (a, b) = (
            Triangle::from_corners(corners).unwrap(),
            Triangle::from_lengths(edge_lengths(corners)),
        );
        assert!((a.area - b.area).abs() < 1e-15);
        for i in 0..3 {
            assert!((a.cotangents[i] - b.cotangents[i]).abs() < 1e-14);
        }
    }

    #[test]
    fn a_needle_keeps_its_cotangents() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1e-6, 0.0]].map(Vec3);
        let needle = Triangle::from_corners(corners).unwrap();
        assert!((needle.cotangents[0] - 1e6).abs() < 1e-4);
        assert!(needle.cotangents[1].abs() < 1e-15);
        assert!((needle.cotangents[2] - 1e-6).abs() < 1e-15);
    }

    #[test]
    fn degenerate_triangles_are_refused_and_mollified_to_finite_shapes() {
        for corners in [
            [[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]],
            [[0.0; 3], [0.0; 3], [1.0, 0.0, 0.0]],
            [[1.0; 3], [1.0; 3], [1.0; 3]],
        ] {
            let corners = corners.map(Vec3);
            assert!(Triangle::from_corners(corners).is_none());
            let mended = Triangle::mollified(corners, 1e-5);
            assert!(
                mended.area > 0.0 && mended.cotangents.iter().all(|c| c.is_finite()),
                "{mended:?}"
            );
        }
    }
}
