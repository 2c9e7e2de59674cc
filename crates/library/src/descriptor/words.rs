//! Codes of what balls see, and words of codes.

use super::balls::NUMBERS;

/// Bytes of a place's code.
pub(crate) const CODE: usize = 8;
/// A step of a code, in standard deviations between neighbouring places.
const STEPS: f64 = 4.0;

/// How wide cells are, in standard deviations; so near to the next cell that is looked up, too, and along so many axes at once.
const WIDTH: f64 = 2.5;
const BESIDE: f64 = 1.0;
const MOST_BESIDE: usize = 4;

/// How numbers become codes, and these words.
#[derive(Debug)]
pub(super) struct Axes {
    mean: [f64; NUMBERS],
    projection: [[f64; NUMBERS]; CODE],
    /// How many cells an axis has.
    cells: [usize; CODE],
}

impl Axes {
    /// How many words there are.
    pub(super) const fn words(&self) -> usize {
        let (mut words, mut axis) = (1, 0);
        while axis < CODE {
            words *= self.cells[axis];
            axis += 1;
        }
        words
    }

    /// The code of what is seen: differences between an original and what was cropped of it have a standard deviation of [`STEPS`] along each axis.
    pub(super) fn code(&self, numbers: &[f64; NUMBERS]) -> [u8; CODE] {
        std::array::from_fn(|axis| {
            let along = self.projection[axis].iter().zip(numbers.iter().zip(&self.mean));
            let y: f64 = along.map(|(p, (number, mean))| p * (number - mean)).sum();
            (127.5 + STEPS * y).round().clamp(0.0, 255.0) as u8
        })
    }

    /// Where a code lies along an axis, in cells, and in which.
    fn cell(&self, code: &[u8; CODE], axis: usize) -> (f64, usize) {
        let count = self.cells[axis];
        let place = (f64::from(code[axis]) - 127.5) / (STEPS * WIDTH) + 0.5 * count as f64;
        (place, (place.floor().max(0.0) as usize).min(count - 1))
    }
}

impl Axes {
    /// The number of a code's cell.
    pub(super) fn word(&self, code: &[u8; CODE]) -> usize {
        (0..CODE).fold(0, |word, axis| word * self.cells[axis] + self.cell(code, axis).1)
    }

    /// The word of a code and those of cells that are close.
    pub(super) fn probes(&self, code: &[u8; CODE]) -> Vec<usize> {
        let mut beside: Vec<(f64, i64)> = Vec::new();
        let mut unit = self.words() as i64;
        for (axis, count) in self.cells.into_iter().enumerate() {
            unit /= count as i64;
            let (place, own) = self.cell(code, axis);
            for (distance, side) in [(place - own as f64, -1), ((own + 1) as f64 - place, 1)] {
                let is_there = own as i64 + side >= 0 && own as i64 + side < count as i64;
                if is_there && distance.abs() * WIDTH < BESIDE {
                    beside.push((distance.abs() * WIDTH, side * unit));
                }
            }
        }
        beside.sort_by(|a, b| a.0.total_cmp(&b.0));
        beside.truncate(MOST_BESIDE);
        let own = self.word(code) as i64;
        (0..1_usize << beside.len())
            .map(|chosen| {
                let steps = beside.iter().enumerate().filter(|(i, _)| chosen >> i & 1 == 1);
                (own + steps.map(|(_, (_, step))| step).sum::<i64>()) as usize
            })
            .collect()
    }
}

/// Mean and axes of small balls on half of the models of `cargo xtask bench library`: those of Fisher's linear discriminant, between all places, and between those of an original and the nearest of what was cropped of it.
pub(super) const SMALL: Axes = Axes {
    mean: [
        1.1697, -0.0406, 0.0704, 0.0237, 0.0017, 1.2389, -0.1111, 0.1379, 0.0583, 0.0105, 1.2571, -0.1812,
        0.1952, 0.1128, 0.0294, 0.0147,
    ],
    projection: [
        [
            -16.886, -0.675, 71.959, -17.970, -14.554, -10.618, 12.858, 9.621, -0.289, 26.205, 1.684, 0.233,
            3.558, -3.967, -1.279, 11.950,
        ],
        [
            -6.131, 13.115, 62.460, 13.024, -139.470, -1.430, -5.658, 10.492, 8.850, -58.111, 1.883, -2.861,
            2.593, 5.573, -0.155, -10.133,
        ],
        [
            -13.299, 28.953, -38.787, -0.700, 110.615, 0.199, -11.659, 9.597, -11.164, -54.234, 13.627,
            -1.843, 6.537, -1.447, -5.488, -5.376,
        ],
        [
            5.170, 11.697, -41.854, 18.439, 230.957, -4.595, -5.488, 18.706, 7.911, -4.204, -0.225, -13.926,
            -4.412, 1.807, -12.480, 4.060,
        ],
        [
            7.646, 21.534, -38.197, 9.091, 604.145, -4.688, -0.888, -0.966, 8.598, 71.075, -0.738, 1.869,
            16.304, -0.954, 10.556, 10.961,
        ],
        [
            5.972, -23.677, -50.751, -4.529, 86.953, 2.982, -15.324, 35.533, -8.929, -82.786, -8.288, 10.955,
            6.717, -8.771, -10.712, -5.743,
        ],
        [
            -6.673, 40.749, -25.745, 2.629, 96.329, 12.276, -55.395, 30.998, 10.950, 22.519, -6.186, 28.806,
            -24.115, 0.334, 23.667, 8.359,
        ],
        [
            2.380, -54.377, -28.656, 15.036, 202.586, -8.782, -1.278, 2.492, 3.048, 33.905, 7.703, 12.437,
            1.218, -0.879, -6.160, -8.107,
        ],
    ],
    cells: [12, 7, 5, 4, 4, 3, 1, 1],
};
/// Those of large balls.
pub(super) const LARGE: Axes = Axes {
    mean: [
        1.2307, -0.0654, 0.0880, 0.0326, 0.0021, 1.2447, -0.1793, 0.1615, 0.0859, 0.0121, 1.2087, -0.2940,
        0.2161, 0.1675, 0.0370, 0.0219,
    ],
    projection: [
        [
            26.654, -33.103, 13.341, 12.546, 111.533, 28.173, -7.084, 7.847, 8.416, 26.686, 13.952, -1.015,
            -8.455, 1.699, -0.452, 0.972,
        ],
        [
            -20.839, 6.793, 19.141, -2.438, 32.966, 8.600, 1.484, -3.284, -1.177, -4.111, 19.227, 2.064,
            4.133, -2.967, -7.689, 0.539,
        ],
        [
            -2.117, -1.485, 39.481, 8.783, 360.103, -8.565, -18.781, 23.295, 14.093, -3.407, -0.163, 4.931,
            0.468, 1.210, 5.849, 2.410,
        ],
        [
            5.121, -14.188, 7.895, -5.664, 329.914, -4.530, -4.417, 5.933, -10.119, 24.104, -3.571, 21.301,
            17.116, -14.409, 0.217, 12.411,
        ],
        [
            -9.136, 11.820, -37.504, 7.968, 98.213, 13.964, -50.113, 3.814, 10.842, 25.205, -4.312, 30.575,
            -9.803, -1.337, 10.871, -12.609,
        ],
        [
            -7.094, -32.397, 16.017, 9.082, -239.085, 17.700, 17.817, -18.738, -8.237, -12.510, -14.751,
            -8.985, 19.054, -4.673, -5.006, -2.972,
        ],
        [
            -4.182, 41.634, -21.993, 11.731, 405.646, 11.740, -4.652, 34.410, 11.834, 24.845, -10.727,
            -3.202, -16.516, -3.372, 2.675, 2.786,
        ],
        [
            6.665, 4.287, -67.202, 37.615, 149.698, -7.359, -21.805, 23.317, -1.671, -65.314, 2.910, 4.262,
            11.495, -7.788, 5.225, 2.841,
        ],
    ],
    cells: [14, 9, 6, 5, 4, 3, 1, 1],
};
