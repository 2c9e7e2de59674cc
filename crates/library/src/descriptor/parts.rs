//! What a plane leaves of an original: described beforehand for some planes, and for the best of them again with the plane fitted to a suspect.

use mesh::Vec3;

use super::{
    cloud::{Cloud, SAMPLES},
    harmonics::{FITTED, PART},
};
use crate::LibraryError;

/// Directions of planes, and the shares of the mass that they leave.
const DIRECTIONS: usize = 64;
const SHARES: [f64; 4] = [0.7, 0.5, 0.35, 0.24];

/// Of the samples every so many is enough for them.
const STEP: usize = 2;

/// How many parts are described, and in how many bytes each.
pub(crate) const PARTS: usize = DIRECTIONS * SHARES.len();
pub(crate) const PART_LENGTH: usize = PART.length();

/// Samples that are kept to be cut, and of how many of them planes are fitted first.
const KEPT: usize = SAMPLES;
const ROUGH: usize = 4;
/// Bytes of them: the least corner and the edge of their box in single precision, then three coordinates and a weight each.
pub(crate) const KEPT_LENGTH: usize = 16 + 4 * KEPT;

/// Steps in which a plane is turned (radians) and shifted (radii) first, and how often they are halved.
const FIRST_STEP: f64 = 0.3;
const HALVINGS: usize = 3;
/// Planes that are tried at most.
const MOST_TRIES: usize = 48;

/// Nothing is said of less than this share of the mass.
const LEAST_SHARE: f64 = 0.08;

/// What is looked up of a suspect among the parts.
pub(super) fn as_part(cloud: &Cloud) -> [u8; PART_LENGTH] {
    PART.bytes(&cloud.points, &cloud.weights)
}

/// A suspect, to which planes are fitted.
pub(super) fn fitted(cloud: &Cloud) -> Vec<f64> {
    FITTED.describe(&cloud.points, &cloud.weights)
}

/// Directions evenly over the sphere: Fibonacci's spiral.
fn direction(i: usize) -> Vec3 {
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let z = 1.0 - (2 * i + 1) as f64 / DIRECTIONS as f64;
    let (sine, cosine) = (golden * i as f64).sin_cos();
    let across = (1.0 - z * z).sqrt();
    Vec3([across * cosine, across * sine, z])
}

/// The bytes of all parts, [`PART_LENGTH`] each.
pub(super) fn describe(cloud: &Cloud) -> Vec<u8> {
    let cloud = &cloud.thinned(STEP);
    let mut bytes = Vec::with_capacity(PARTS * PART_LENGTH);
    let mut order: Vec<usize> = (0..cloud.points.len()).collect();
    for i in 0..DIRECTIONS {
        let n = direction(i);
        let heights: Vec<f64> = cloud.points.iter().map(|p| p.dot(n)).collect();
        order.sort_by(|&a, &b| heights[b].total_cmp(&heights[a]).then(a.cmp(&b)));
        for share in SHARES {
            let (mut mass, mut part) = (0.0, Cloud::default());
            for &k in &order {
                if mass >= share {
                    break;
                }
                mass += cloud.weights[k];
                part.points.push(cloud.points[k]);
                part.weights.push(cloud.weights[k]);
            }
            part.normalise();
            let part: [u8; PART_LENGTH] = PART.bytes(&part.points, &part.weights);
            bytes.extend(part);
        }
    }
    bytes
}

/// The samples that are kept.
pub(super) fn kept(cloud: &Cloud) -> Vec<u8> {
    let corner = |pick: fn(f64, f64) -> f64, start: f64| -> [f64; 3] {
        std::array::from_fn(|axis| cloud.points.iter().fold(start, |m, p| pick(m, p.0[axis])))
    };
    let (least, most) = (
        corner(f64::min, f64::INFINITY),
        corner(f64::max, f64::NEG_INFINITY),
    );
    let edge = (0..3).fold(1e-9_f64, |edge, axis| edge.max(most[axis] - least[axis]));
    let heaviest = cloud.weights.iter().fold(0.0_f64, |m, &w| m.max(w));
    let mut bytes = Vec::with_capacity(KEPT_LENGTH);
    for x in least.into_iter().chain([edge]) {
        bytes.extend((x as f32).to_le_bytes());
    }
    let step = cloud.points.len() / KEPT;
    for k in (0..KEPT).map(|k| k * step) {
        let p = cloud.points[k];
        bytes.extend((0..3).map(|axis| (255.0 * (p.0[axis] - least[axis]) / edge).round() as u8));
        bytes.push((255.0 * cloud.weights[k] / heaviest).round().max(1.0) as u8);
    }
    bytes
}

/// An original's samples, to be cut by planes.
pub(crate) struct Cuttable {
    points: Vec<Vec3>,
    weights: Vec<f64>,
}

/// What a plane leaves of an original: the side to which the normal points, from a height on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cut {
    /// From the suspect.
    pub(crate) distance: f64,
    normal: Vec3,
    height: f64,
}

impl Cuttable {
    /// The samples that were [kept].
    pub(crate) fn of(bytes: &[u8]) -> Result<Self, LibraryError> {
        let damaged = || LibraryError::Geometry {
            problem: "samples of another length than they have, or none".into(),
        };
        if bytes.len() != KEPT_LENGTH {
            return Err(damaged());
        }
        let (header, samples) = bytes.split_at(16);
        let number = |i: usize| f64::from(f32::from_le_bytes(std::array::from_fn(|k| header[4 * i + k])));
        let (least, edge) = (Vec3([number(0), number(1), number(2)]), number(3));
        if !(least.norm().is_finite() && edge.is_finite()) {
            return Err(damaged());
        }
        let mut cloud = Cloud::default();
        for sample in samples.chunks_exact(4) {
            let p = Vec3([sample[0], sample[1], sample[2]].map(f64::from));
            cloud.points.push(least + p * (edge / 255.0));
            cloud.weights.push(f64::from(sample[3].max(1)));
        }
        cloud.normalise();
        Ok(Self {
            points: cloud.points,
            weights: cloud.weights,
        })
    }

    /// The best plane near that of a described part, by some of the samples.
    pub(crate) fn fit(&self, wanted: &[f64], part: usize) -> Cut {
        let normal = direction(part / SHARES.len() % DIRECTIONS);
        let height = self.height_of(normal, SHARES[part % SHARES.len()]);
        self.best_near(wanted, normal, height, FIRST_STEP, ROUGH)
    }

    /// The best plane near one that was fitted, by all samples.
    pub(crate) fn refit(&self, wanted: &[f64], cut: &Cut) -> Cut {
        self.best_near(wanted, cut.normal, cut.height, FIRST_STEP / 4.0, 1)
    }

    fn best_near(&self, wanted: &[f64], normal: Vec3, height: f64, mut step: f64, every: usize) -> Cut {
        let cut = |normal: Vec3, height: f64| Cut {
            distance: self.distance(wanted, normal, height, every),
            normal,
            height,
        };
        let mut best = cut(normal, height);
        let (mut halvings, mut tries) = (0, 1);
        while halvings <= HALVINGS && tries < MOST_TRIES {
            let [a, b] = across(best.normal);
            let turned = |axis: Vec3| cut((best.normal + axis).unit(), best.height);
            let moves = [
                turned(a * step),
                turned(a * -step),
                turned(b * step),
                turned(b * -step),
                cut(best.normal, best.height + 0.5 * step),
                cut(best.normal, best.height - 0.5 * step),
            ];
            tries += moves.len();
            let nearest = moves.into_iter().min_by(|x, y| x.distance.total_cmp(&y.distance));
            match nearest.filter(|nearest| nearest.distance < best.distance) {
                Some(nearest) => best = nearest,
                None => {
                    step *= 0.5;
                    halvings += 1;
                }
            }
        }
        best
    }

    /// How high a plane lies that leaves a share.
    fn height_of(&self, n: Vec3, share: f64) -> f64 {
        let mut heights: Vec<(f64, f64)> = self
            .points
            .iter()
            .zip(&self.weights)
            .map(|(p, &w)| (p.dot(n), w))
            .collect();
        heights.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut mass = 0.0;
        for (height, w) in heights {
            mass += w;
            if mass >= share {
                return height;
            }
        }
        f64::NEG_INFINITY
    }

    fn distance(&self, wanted: &[f64], n: Vec3, height: f64, every: usize) -> f64 {
        let mut part = Cloud::default();
        let mut mass = 0.0;
        for (&p, &w) in self.points.iter().zip(&self.weights).step_by(every) {
            if p.dot(n) >= height {
                part.points.push(p);
                part.weights.push(w);
                mass += w;
            }
        }
        if mass * (every as f64) < LEAST_SHARE {
            return f64::INFINITY;
        }
        part.normalise();
        let found = FITTED.describe(&part.points, &part.weights);
        let sum: f64 = found.iter().zip(wanted).map(|(a, b)| (a - b).abs()).sum();
        600.0 * sum / wanted.len() as f64
    }
}

/// Two directions across a third, and each other.
fn across(n: Vec3) -> [Vec3; 2] {
    let least = (0..3).fold(0, |least, axis| {
        if n.0[axis].abs() < n.0[least].abs() {
            axis
        } else {
            least
        }
    });
    let mut axis = Vec3([0.0; 3]);
    axis[least] = 1.0;
    let a = n.cross(axis).unit();
    [a, n.cross(a)]
}
