use crate::{Similarity, Vec3};

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct BoundingBox {
    /// Least x, y and z.
    pub min: [f64; 3],
    /// Greatest x, y and z.
    pub max: [f64; 3],
}

impl BoundingBox {
    /// The box of no points.
    pub const EMPTY: Self = Self {
        min: [f64::INFINITY; 3],
        max: [f64::NEG_INFINITY; 3],
    };

    /// The box of a set of points; of none, [`EMPTY`](Self::EMPTY).
    pub fn of<P: Copy + Into<Vec3>>(points: &[P]) -> Self {
        let mut bounds = Self::EMPTY;
        for &p in points {
            bounds.include_point(p.into());
        }
        bounds
    }

    /// Grows to hold a point, too.
    #[inline]
    pub fn include_point(&mut self, p: Vec3) {
        for axis in 0..3 {
            self.min[axis] = self.min[axis].min(p[axis]);
            self.max[axis] = self.max[axis].max(p[axis]);
        }
    }

    /// Grows to hold another box, too.
    #[inline]
    pub fn include(&mut self, other: &Self) {
        for axis in 0..3 {
            self.min[axis] = self.min[axis].min(other.min[axis]);
            self.max[axis] = self.max[axis].max(other.max[axis]);
        }
    }

    /// Edge lengths (φ of eq. 12).
    pub fn size(&self) -> [f64; 3] {
        std::array::from_fn(|axis| self.max[axis] - self.min[axis])
    }

    /// The point in the middle.
    pub fn centre(&self) -> [f64; 3] {
        std::array::from_fn(|axis| 0.5 * self.min[axis] + 0.5 * self.max[axis])
    }

    /// To the frame in which the centre is 0 and the diagonal 1; its inverse leads back.
    pub fn to_unit_frame(&self) -> Similarity {
        let diagonal = self.diagonal();
        Similarity {
            scale: 1.0 / diagonal,
            translation: self.centre().map(|x| -x / diagonal),
            ..Similarity::IDENTITY
        }
    }

    /// Length of the diagonal, the yardstick of every relative distance in this project.
    pub fn diagonal(&self) -> f64 {
        self.size().iter().map(|s| s * s).sum::<f64>().sqrt()
    }
}
