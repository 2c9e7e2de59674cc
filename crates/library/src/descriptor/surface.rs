//! What is kept of an original's surface, for suspects to be laid on: samples with normals, and places with what balls around them see.

use mesh::Vec3;

use super::{
    cloud::{Cloud, FINE},
    places::{LEVELS, Place},
    words::CODE,
};
use crate::LibraryError;

/// Samples that are kept. Every so many of them is a place.
const KEPT: usize = 2048;
/// Bytes of a place.
const PLACE: usize = 2 + CODE;

/// Bytes: the least corner and the edge of the samples' box in single precision; of each sample three coordinates and a normal; of each place a normal and a code.
pub(crate) const SURFACE_LENGTH: usize = 16 + 5 * KEPT + PLACE * (LEVELS[0].places + LEVELS[1].places);

/// Samples and places of an original, in roots of its area.
pub(crate) struct Surface {
    pub(crate) points: Vec<Vec3>,
    pub(crate) normals: Vec<Vec3>,
    /// For each of the [`LEVELS`].
    pub(crate) places: [Vec<Place>; 2],
}

/// The bytes of a cloud in roots of its area, and its places.
pub(super) fn pack(cloud: &Cloud, places: &[Vec<Place>; 2]) -> Vec<u8> {
    let points: Vec<Vec3> = (0..KEPT).map(|k| cloud.points[k * (FINE / KEPT)]).collect();
    let corner = |pick: fn(f64, f64) -> f64, start: f64| -> [f64; 3] {
        std::array::from_fn(|axis| points.iter().fold(start, |m, p| pick(m, p.0[axis])))
    };
    let (least, most) = (
        corner(f64::min, f64::INFINITY),
        corner(f64::max, f64::NEG_INFINITY),
    );
    let edge = (0..3).fold(1e-9_f64, |edge, axis| edge.max(most[axis] - least[axis]));
    let mut bytes = Vec::with_capacity(SURFACE_LENGTH);
    for x in least.into_iter().chain([edge]) {
        bytes.extend((x as f32).to_le_bytes());
    }
    for (k, p) in points.iter().enumerate() {
        bytes.extend((0..3).map(|axis| (255.0 * (p.0[axis] - least[axis]) / edge).round() as u8));
        bytes.extend(octahedral(cloud.normals[k * (FINE / KEPT)]));
    }
    for place in places.iter().flatten() {
        bytes.extend(octahedral(place.normal));
        bytes.extend(place.code);
    }
    bytes
}

impl Surface {
    /// From its bytes.
    pub(crate) fn of(bytes: &[u8]) -> Result<Self, LibraryError> {
        let damaged = || LibraryError::Geometry {
            problem: "a surface of another length than it has, or none".into(),
        };
        if bytes.len() != SURFACE_LENGTH {
            return Err(damaged());
        }
        let (header, rest) = bytes.split_at(16);
        let (samples, places) = rest.split_at(5 * KEPT);
        let number = |i: usize| f64::from(f32::from_le_bytes(std::array::from_fn(|k| header[4 * i + k])));
        let (least, edge) = (Vec3([number(0), number(1), number(2)]), number(3));
        if !(least.norm().is_finite() && edge.is_finite()) {
            return Err(damaged());
        }
        let sample = |sample: &[u8]| {
            let p = Vec3([sample[0], sample[1], sample[2]].map(f64::from));
            least + p * (edge / 255.0)
        };
        let points: Vec<Vec3> = samples.chunks_exact(5).map(sample).collect();
        let normals = samples
            .chunks_exact(5)
            .map(|sample| direction([sample[3], sample[4]]));
        let (small, large) = places.split_at(PLACE * LEVELS[0].places);
        let of_level = |bytes: &[u8]| -> Vec<Place> {
            let between = KEPT / (bytes.len() / PLACE);
            let places = bytes.chunks_exact(PLACE).enumerate();
            places
                .map(|(k, place)| Place {
                    point: points[k * between],
                    normal: direction([place[0], place[1]]),
                    code: std::array::from_fn(|i| place[2 + i]),
                })
                .collect()
        };
        Ok(Self {
            places: [of_level(small), of_level(large)],
            normals: normals.collect(),
            points,
        })
    }
}

/// A direction as a point of an octahedron that is laid flat.
fn octahedral(n: Vec3) -> [u8; 2] {
    let Vec3([x, y, z]) = n;
    let sum = (x.abs() + y.abs() + z.abs()).max(1e-12);
    let (u, v) = (x / sum, y / sum);
    let (u, v) = match z < 0.0 {
        true => ((1.0 - v.abs()).copysign(u), (1.0 - u.abs()).copysign(v)),
        false => (u, v),
    };
    [u, v].map(|t| (127.5 + 127.5 * t).round() as u8)
}

fn direction(bytes: [u8; 2]) -> Vec3 {
    let [u, v] = bytes.map(|byte| (f64::from(byte) - 127.5) / 127.5);
    let z = 1.0 - u.abs() - v.abs();
    let fold = (-z).max(0.0);
    Vec3([u - fold.copysign(u), v - fold.copysign(v), z]).unit()
}
