//! What balls around places of a surface see: what is left of a model that was cropped.
//!
//! Around a point with normal n (a mean over the inner ball) every other point d of a ball of radius r, in units of r, has a height z = n·d and a place (x, y) in the plane across n, whose axes are anybody's. Of the
//! points of each of three shells about the centre (hat functions of |d|)
//! - the mass, 1 for a plane,
//! - the mean and the spread of z,
//! - |mean of (x + i y)|, and |mean of z (x + i y)²|: to which side the surface lies, and how differently it bends along and across,
//!
//! and of the outermost |mean of z (x + i y)³|. Turning (x, y) changes none.

use std::{f64::consts::PI, sync::OnceLock};

use mesh::{Edges, TriMesh, Vec3};

use super::{
    cloud::{Cloud, FINE},
    grid::Grid,
};

/// Balls of one radius.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Level {
    /// In roots of the original's area.
    radius: f64,
    /// Of an original's samples every so many is seen.
    seen: f64,
    /// Places of an original, and of a suspect at most.
    pub(crate) places: usize,
    asked: usize,
    axes: &'static Axes,
    /// The number of the first word.
    first: usize,
}

/// How numbers become codes, and these words.
#[derive(Debug)]
struct Axes {
    mean: [f64; NUMBERS],
    projection: [[f64; NUMBERS]; CODE],
    /// How many cells an axis has.
    cells: [usize; CODE],
}

/// Small balls and large ones.
pub(crate) const LEVELS: [Level; 2] = [
    Level {
        radius: 0.1,
        seen: 2.0,
        places: 1024,
        asked: 128,
        axes: &SMALL,
        first: 0,
    },
    Level {
        radius: 0.2,
        seen: 8.0,
        places: 512,
        asked: 96,
        axes: &LARGE,
        first: SMALL.words(),
    },
];

/// Radii at which a shell counts fully; within the first and beyond the last it goes on so.
const SHELLS: [f64; 3] = [0.3, 0.6, 0.9];
/// The normal's ball.
const INNER: f64 = 0.4;

/// Numbers of a place.
const NUMBERS: usize = 16;

/// Samples of a suspect of which places are chosen, those that see least of a border, and how many are taken although they see some.
const OFFERED: usize = 512;
const BORDERED: usize = 24;

/// Samples of a suspect that are laid on originals.
const LAID: usize = 192;

/// A suspect may be what is left of an original: the root of the original's area is so many times the suspect's, from 1 on by this factor.
const SIZES: usize = 14;
const GROWTH: f64 = 1.08;

/// Bytes of a place's code.
pub(crate) const CODE: usize = 8;
/// A step of a code, in standard deviations between neighbouring places.
const STEPS: f64 = 4.0;

/// A place of a surface.
#[derive(Clone, Debug)]
pub(crate) struct Place {
    pub(crate) point: Vec3,
    pub(crate) normal: Vec3,
    pub(crate) code: [u8; CODE],
}

/// What is sought of a suspect of some size, in roots of the original's area.
#[derive(Clone, Debug)]
pub(crate) struct Sought {
    pub(crate) places: [Vec<Place>; 2],
    /// Of each place, its word and those that lie close by.
    pub(crate) words: Vec<Vec<u16>>,
    pub(crate) samples: Vec<(Vec3, Vec3)>,
}

/// The places of an original in roots of its area.
pub(super) fn of_original(cloud: &Cloud) -> [Vec<Place>; 2] {
    LEVELS.map(|level| {
        let mut seer = Seer::new(cloud, &level, 1.0);
        let places = 0..level.places;
        places.map(|k| seer.place(k * (FINE / level.places))).collect()
    })
}

/// The words of places, sorted.
pub(super) fn words(places: &[Vec<Place>; 2]) -> Vec<u16> {
    let of_level = |(level, places): (&'static Level, &Vec<Place>)| -> Vec<u16> {
        places.iter().map(|place| level.word(&place.code)).collect()
    };
    let mut words: Vec<u16> = LEVELS.iter().zip(places).flat_map(of_level).collect();
    words.sort_unstable();
    words
}

/// What is sought of a suspect in roots of its own area, in all sizes.
pub(super) fn sought(cloud: &Cloud, borders: &[Vec3]) -> Vec<Sought> {
    (0..SIZES)
        .map(|size| of_size(cloud, borders, GROWTH.powi(size as i32)))
        .collect()
}

fn of_size(cloud: &Cloud, borders: &[Vec3], growth: f64) -> Sought {
    let places = LEVELS.map(|level| {
        let chosen = chosen(cloud, borders, level.radius * growth, level.asked);
        let mut seer = Seer::new(cloud, &level, growth);
        let place = |i: usize| {
            let place = seer.place(i);
            Place {
                point: place.point / growth,
                ..place
            }
        };
        chosen.into_iter().map(place).collect::<Vec<Place>>()
    });
    let samples = (0..LAID)
        .map(|k| k * FINE / LAID)
        .map(|i| (cloud.points[i] / growth, cloud.normals[i]));
    let words = LEVELS.iter().zip(&places);
    Sought {
        words: words
            .flat_map(|(level, places)| places.iter().map(|place| level.probes(&place.code)))
            .collect(),
        samples: samples.collect(),
        places,
    }
}

/// Samples whose balls see no border, which may be that of the cut, or least of it.
fn chosen(cloud: &Cloud, borders: &[Vec3], radius: f64, most: usize) -> Vec<usize> {
    let grid = Grid::new(borders.to_vec(), radius);
    let mut offered: Vec<(usize, usize)> = (0..FINE)
        .step_by(FINE / OFFERED)
        .map(|i| {
            let mut count = 0;
            grid.near(cloud.points[i], |_| count += 1);
            (count, i)
        })
        .collect();
    offered.sort_unstable();
    let whole = offered.iter().filter(|(count, _)| *count == 0).count();
    offered.truncate(whole.max(BORDERED));
    let count = most.min(offered.len());
    (0..count).map(|k| offered[k * offered.len() / count].1).collect()
}

/// The middles of edges at which a surface ends, in roots of its area.
pub(super) fn borders(mesh: &TriMesh, edges: &Edges, cloud: &Cloud) -> Vec<Vec3> {
    let open = (0..edges.count()).filter(|&e| edges.triangles(e).len() == 1);
    open.map(|e| {
        let [a, b] = edges.vertices()[e].map(|v| mesh.point(v as usize));
        cloud.place(a * 0.5 + b * 0.5)
    })
    .collect()
}

/// What is seen from samples of a cloud in roots of its area.
struct Seer<'a> {
    cloud: &'a Cloud,
    /// Every `step`th sample.
    grid: Grid,
    step: usize,
    radius: f64,
    /// One over the samples that the ball has on a plane.
    unit: f64,
    near: Vec<usize>,
    axes: &'static Axes,
}

impl<'a> Seer<'a> {
    fn new(cloud: &'a Cloud, level: &Level, growth: f64) -> Self {
        let radius = level.radius * growth;
        let step = (level.seen * growth * growth).round() as usize;
        let points: Vec<Vec3> = cloud.points.iter().step_by(step).copied().collect();
        Self {
            cloud,
            unit: 1.0 / (PI * radius * radius * points.len() as f64),
            grid: Grid::new(points, radius),
            step,
            radius,
            near: Vec::new(),
            axes: level.axes,
        }
    }

    fn place(&mut self, centre: usize) -> Place {
        let (numbers, normal) = self.see(centre);
        Place {
            point: self.cloud.points[centre],
            normal,
            code: self.axes.code(&numbers),
        }
    }

    fn see(&mut self, centre: usize) -> ([f64; NUMBERS], Vec3) {
        let p = self.cloud.points[centre];
        self.near.clear();
        let (near, step) = (&mut self.near, self.step);
        self.grid.near(p, |i| near.push(i * step));
        let mut normal = Vec3::ZERO;
        for &i in &self.near {
            let weight = 1.0 - (self.cloud.points[i] - p).norm() / (INNER * self.radius);
            if weight > 0.0 {
                normal += self.cloud.normals[i] * weight;
            }
        }
        let normal = normal.unit();
        let [a, b] = super::across(normal);
        let mut sums = [[0.0; 9]; 3];
        let mut third = [0.0; 2];
        for &i in &self.near {
            let d = (self.cloud.points[i] - p) * (1.0 / self.radius);
            let (x, y, z) = (d.dot(a), d.dot(b), d.dot(normal));
            let (shell, upper) = shell(d.norm());
            let (xx, xy) = (x * x - y * y, 2.0 * x * y);
            let terms = [1.0, z, z * z, x, y, z * xx, z * xy];
            for (sum, term) in sums[shell].iter_mut().zip(terms) {
                *sum += (1.0 - upper) * term;
            }
            if upper > 0.0 {
                for (sum, term) in sums[shell + 1].iter_mut().zip(terms) {
                    *sum += upper * term;
                }
            }
            let outer = if shell == 2 {
                1.0
            } else if shell == 1 {
                upper
            } else {
                0.0
            };
            third[0] += outer * z * (xx * x - xy * y);
            third[1] += outer * z * (xx * y + xy * x);
        }
        let mut numbers = [0.0; NUMBERS];
        for (s, sums) in sums.iter().enumerate() {
            let [m, z, zz, x, y, u, v, ..] = *sums;
            let whole = f64::max(m, 1e-9);
            let mean = z / whole;
            numbers[5 * s] = (m * self.unit / planar()[s]).sqrt();
            numbers[5 * s + 1] = mean;
            numbers[5 * s + 2] = (zz / whole - mean * mean).max(0.0).sqrt();
            numbers[5 * s + 3] = x.hypot(y) / whole;
            numbers[5 * s + 4] = u.hypot(v) / whole;
        }
        numbers[15] = third[0].hypot(third[1]) / f64::max(sums[2][0], 1e-9);
        (numbers, normal)
    }
}

/// The shell below a radius, and the share of the one above.
fn shell(radius: f64) -> (usize, f64) {
    match SHELLS.iter().position(|&node| radius < node) {
        Some(0) => (0, 0.0),
        Some(i) => (i - 1, (radius - SHELLS[i - 1]) / (SHELLS[i] - SHELLS[i - 1])),
        None => (2, 0.0),
    }
}

/// The shares of a disc that the shells have.
fn planar() -> &'static [f64; 3] {
    static SHARES: OnceLock<[f64; 3]> = OnceLock::new();
    SHARES.get_or_init(|| {
        let mut shares = [0.0; 3];
        let steps = 4000;
        for k in 0..steps {
            let r = (f64::from(k) + 0.5) / f64::from(steps);
            let (s, upper) = shell(r);
            shares[s] += (1.0 - upper) * 2.0 * r / f64::from(steps);
            if upper > 0.0 {
                shares[s + 1] += upper * 2.0 * r / f64::from(steps);
            }
        }
        shares
    })
}

impl Axes {
    const fn words(&self) -> usize {
        let (mut words, mut axis) = (1, 0);
        while axis < CODE {
            words *= self.cells[axis];
            axis += 1;
        }
        words
    }

    /// The code of what is seen: differences between an original and what was cropped of it have a standard deviation of [`STEPS`] along each axis.
    fn code(&self, numbers: &[f64; NUMBERS]) -> [u8; CODE] {
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

/// How wide cells are, in standard deviations; so near to the next cell that is looked up, too, and along so many axes at once.
const WIDTH: f64 = 2.5;
const BESIDE: f64 = 1.0;
const MOST_BESIDE: usize = 4;

/// How many words there are.
pub(crate) const WORDS: usize = SMALL.words() + LARGE.words();

impl Level {
    fn word(&self, code: &[u8; CODE]) -> u16 {
        let word = (0..CODE).fold(0, |word, axis| {
            word * self.axes.cells[axis] + self.axes.cell(code, axis).1
        });
        (self.first + word) as u16
    }

    /// The word of a code and those of cells that are close.
    fn probes(&self, code: &[u8; CODE]) -> Vec<u16> {
        let mut beside: Vec<(f64, i64)> = Vec::new();
        let mut unit = self.axes.words() as i64;
        for (axis, count) in self.axes.cells.into_iter().enumerate() {
            unit /= count as i64;
            let (place, own) = self.axes.cell(code, axis);
            for (distance, side) in [(place - own as f64, -1), ((own + 1) as f64 - place, 1)] {
                let is_there = own as i64 + side >= 0 && own as i64 + side < count as i64;
                if is_there && distance.abs() * WIDTH < BESIDE {
                    beside.push((distance.abs() * WIDTH, side * unit));
                }
            }
        }
        beside.sort_by(|a, b| a.0.total_cmp(&b.0));
        beside.truncate(MOST_BESIDE);
        let own = i64::from(self.word(code));
        (0..1_usize << beside.len())
            .map(|chosen| {
                let steps = beside.iter().enumerate().filter(|(i, _)| chosen >> i & 1 == 1);
                (own + steps.map(|(_, (_, step))| step).sum::<i64>()) as u16
            })
            .collect()
    }
}

/// Mean and axes of small balls on half of the models of `cargo xtask bench library`: those of Fisher's linear discriminant, between all places, and between those of an original and the nearest of what was cropped of it.
const SMALL: Axes = Axes {
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
const LARGE: Axes = Axes {
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

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::{Similarity, shapes};
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(8))]

        #[test]
        fn place_size_and_position_change_no_place(seed in 0..50_u64, angles in prop::array::uniform4(-1.0..1.0_f64), scale in 1e-2..1e2_f64) {
            prop_assume!(angles.iter().map(|x| x * x).sum::<f64>() > 0.01);
            let mesh = shapes::bumpy_sphere(3, seed);
            let transform = Similarity { scale, translation: [1.0, -2.0, 5.0], ..Similarity::from_quaternion(angles) };
            let places = |mesh: &TriMesh| of_original(&Cloud::fine(mesh).unwrap().in_roots());
            let (a, b) = (places(&mesh), places(&shapes::moved(&mesh, &transform)));
            let turn = Similarity::from_quaternion(angles);
            for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
                // A sample on the very edge of a ball may be seen or not.
                prop_assert!((0..CODE).all(|axis| a.code[axis].abs_diff(b.code[axis]) <= 3));
                prop_assert!((turn.apply(a.point) - b.point).norm() < 1e-6);
                prop_assert!(turn.apply(a.normal).dot(b.normal) > 0.999);
            }
        }

        #[test]
        fn a_word_is_looked_up_with_those_beside_it(code in prop::array::uniform8(any::<u8>())) {
            for level in &LEVELS {
                let (word, probes) = (level.word(&code), level.probes(&code));
                prop_assert_eq!(probes[0], word);
                prop_assert!(probes.iter().all(|&probe| usize::from(probe) < WORDS && usize::from(probe) >= level.first));
                let mut distinct = probes.clone();
                distinct.sort_unstable();
                distinct.dedup();
                prop_assert_eq!(distinct.len(), probes.len());
            }
        }
    }

    #[test]
    fn shells_share_a_disc() {
        assert!((planar().iter().sum::<f64>() - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_plane_has_the_mass_of_a_plane_and_no_height() {
        let cloud = Cloud::fine(&shapes::rectangle(8, 8, 1.0, 1.0))
            .unwrap()
            .in_roots();
        let centre = (0..FINE)
            .min_by(|&a, &b| cloud.points[a].norm().total_cmp(&cloud.points[b].norm()))
            .unwrap();
        let (numbers, normal) = Seer::new(&cloud, &LEVELS[0], 1.0).see(centre);
        assert!((normal.0[2].abs() - 1.0).abs() < 1e-9);
        for shell in 0..3 {
            assert!((numbers[5 * shell] - 1.0).abs() < 0.1, "{numbers:?}");
            assert!(numbers[5 * shell + 1].abs() < 1e-9 && numbers[5 * shell + 2] < 1e-6);
        }
    }

    #[test]
    fn places_far_from_the_border_are_chosen_first() {
        let mesh = shapes::rectangle(16, 16, 1.0, 1.0);
        let cloud = Cloud::fine(&mesh).unwrap().in_roots();
        let borders = borders(&mesh, &Edges::of(&mesh), &cloud);
        for i in chosen(&cloud, &borders, 0.2, 64) {
            assert!(
                borders
                    .iter()
                    .all(|&border| (border - cloud.points[i]).norm() > 0.2)
            );
        }
    }
}
