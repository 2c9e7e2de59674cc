/// An affine map from a file's own coordinates to those of its scene, and the way back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Placement {
    linear: [[f64; 3]; 3],
    offset: [f64; 3],
    inverse: [[f64; 3]; 3],
}

impl Placement {
    /// The map of a 4 × 4 matrix whose columns follow each other; `None` if it flattens space or is not finite.
    pub(crate) fn of_columns(matrix: &[f64; 16]) -> Option<Self> {
        let linear: [[f64; 3]; 3] =
            std::array::from_fn(|row| std::array::from_fn(|column| matrix[4 * column + row]));
        let offset = [matrix[12], matrix[13], matrix[14]];
        let inverse = inverted(&linear)?;
        let numbers = inverse.as_flattened().iter().chain(&offset);
        numbers.copied().all(f64::is_finite).then_some(Self {
            linear,
            offset,
            inverse,
        })
    }

    pub(crate) fn is_identity(&self) -> bool {
        self.linear == [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] && self.offset == [0.0; 3]
    }

    /// This one, then another.
    pub(crate) fn then(&self, next: &Self) -> Option<Self> {
        let image = |axis: usize| {
            let unit = std::array::from_fn(|i| if i == axis { 1.0 } else { 0.0 });
            let [p, o] = [unit, [0.0; 3]].map(|point| next.apply(self.apply(point)));
            [p[0] - o[0], p[1] - o[1], p[2] - o[2], 0.0]
        };
        let [x, y, z] = next.apply(self.apply([0.0; 3]));
        let columns = [image(0), image(1), image(2), [x, y, z, 1.0]];
        Self::of_columns(columns.as_flattened().try_into().ok()?)
    }

    /// Whether it turns a surface inside out.
    pub(crate) fn mirrors(&self) -> bool {
        determinant(&self.linear) < 0.0
    }

    pub(crate) fn apply(&self, point: [f64; 3]) -> [f64; 3] {
        let turned = product(&self.linear, point);
        std::array::from_fn(|axis| turned[axis] + self.offset[axis])
    }

    pub(crate) fn undo(&self, point: [f64; 3]) -> [f64; 3] {
        product(
            &self.inverse,
            std::array::from_fn(|axis| point[axis] - self.offset[axis]),
        )
    }

    /// Where a vector goes that leads from a point to another: A v for the linear part A.
    pub(crate) fn apply_vector(&self, vector: [f64; 3]) -> [f64; 3] {
        product(&self.linear, vector)
    }

    pub(crate) fn undo_vector(&self, vector: [f64; 3]) -> [f64; 3] {
        product(&self.inverse, vector)
    }

    /// The direction of the normal of a surface that had this one: A⁻ᵀ n. Its length means nothing.
    pub(crate) fn apply_normal(&self, normal: [f64; 3]) -> [f64; 3] {
        product(&transposed(&self.inverse), normal)
    }

    pub(crate) fn undo_normal(&self, normal: [f64; 3]) -> [f64; 3] {
        product(&transposed(&self.linear), normal)
    }

    /// Whether it scales all directions alike, to the precision of the matrices in files: AᵀA is a multiple of the identity.
    pub(crate) fn keeps_angles(&self) -> bool {
        const TOLERANCE: f64 = 1e-4;
        let columns = transposed(&self.linear);
        let dot = |i: usize, j: usize| (0..3).map(|k| columns[i][k] * columns[j][k]).sum::<f64>();
        let mean = (dot(0, 0) + dot(1, 1) + dot(2, 2)) / 3.0;
        let pairs = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
        pairs.iter().all(|&(i, j)| {
            let wanted = if i == j { mean } else { 0.0 };
            (dot(i, j) - wanted).abs() <= TOLERANCE * mean
        })
    }
}

fn transposed(m: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| std::array::from_fn(|j| m[j][i]))
}

fn product(matrix: &[[f64; 3]; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| row[0] * x + row[1] * y + row[2] * z)
}

fn determinant(m: &[[f64; 3]; 3]) -> f64 {
    (0..3).map(|i| m[0][i] * cofactor(m, 0, i)).sum()
}

fn cofactor(m: &[[f64; 3]; 3], row: usize, column: usize) -> f64 {
    let [r, s] = [(row + 1) % 3, (row + 2) % 3];
    let [c, d] = [(column + 1) % 3, (column + 2) % 3];
    m[r][c] * m[s][d] - m[r][d] * m[s][c]
}

/// By Cramer's rule; `None` of a matrix that is singular to working precision.
fn inverted(m: &[[f64; 3]; 3]) -> Option<[[f64; 3]; 3]> {
    let determinant = determinant(m);
    let lengths: f64 = m
        .iter()
        .map(|row| row.iter().map(|x| x * x).sum::<f64>().sqrt())
        .product();
    let is_regular = determinant.abs() > 1e-12 * lengths && determinant.is_normal();
    is_regular.then(|| std::array::from_fn(|i| std::array::from_fn(|j| cofactor(m, j, i) / determinant)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Turned by 30° about z, scaled by 2, 3 and −4, moved.
    fn columns() -> [f64; 16] {
        let (s, c) = (0.5, 0.75_f64.sqrt());
        [
            2.0 * c,
            2.0 * s,
            0.0,
            0.0,
            -3.0 * s,
            3.0 * c,
            0.0,
            0.0,
            0.0,
            0.0,
            -4.0,
            0.0,
            10.0,
            20.0,
            30.0,
            1.0,
        ]
    }

    #[test]
    fn what_was_placed_is_brought_back() {
        let placement = Placement::of_columns(&columns()).unwrap();
        assert!(placement.mirrors() && !placement.is_identity());
        assert_eq!(placement.apply([0.0; 3]), [10.0, 20.0, 30.0]);
        let point = [0.3, -7.0, 11.0];
        let back = placement.undo(placement.apply(point));
        assert!((0..3).all(|axis| (back[axis] - point[axis]).abs() < 1e-13));
    }

    #[test]
    fn normals_stay_at_right_angles_to_what_was_placed() {
        let placement = Placement::of_columns(&columns()).unwrap();
        let (along, normal) = ([1.0, 2.0, 3.0], [3.0, 0.0, -1.0]);
        let [along, placed] = [placement.apply_vector(along), placement.apply_normal(normal)];
        let dot: f64 = (0..3).map(|axis| along[axis] * placed[axis]).sum();
        assert!(dot.abs() < 1e-13);
        let back = placement.undo_normal(placed);
        assert!((0..3).all(|axis| (back[axis] - normal[axis]).abs() < 1e-13));
        assert!(!placement.keeps_angles());
        let mut even = [0.0; 16];
        (even[1], even[4], even[10], even[15]) = (2.0, -2.0, 2.0, 1.0);
        assert!(Placement::of_columns(&even).unwrap().keeps_angles());
    }

    #[test]
    fn what_flattens_space_is_no_placement() {
        let mut flat = columns();
        flat[10] = 0.0;
        assert_eq!(Placement::of_columns(&flat), None);
        flat[10] = f64::NAN;
        assert_eq!(Placement::of_columns(&flat), None);
        let mut identity = [0.0; 16];
        (0..4).for_each(|i| identity[5 * i] = 1.0);
        assert!(Placement::of_columns(&identity).unwrap().is_identity());
    }
}
