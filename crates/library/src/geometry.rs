//! Meshes in few bytes, without loss.
//!
//! A header of 24 bytes: the text `sgm1`, a byte that says how coordinates are stored (4: all are single-precision numbers, 8: doubles), three zeros, #V, #F. Then, deflated together: of each
//! coordinate's bits the difference from the vertex before, axis by axis; of each corner the difference from the corner before, negative ones folded between the others; both with the first bytes of all numbers
//! first, then the second bytes, …, so that what hardly changes lies together. −0 stays −0.

use std::io::{Read, Write};

use flate2::{Compression, read::DeflateDecoder, write::DeflateEncoder};
use mesh::TriMesh;

use crate::LibraryError;

/// The most bytes that geometry unpacks to, as of the files it comes from.
pub const MOST_GEOMETRY: u64 = 4 << 30;

const MAGIC: [u8; 4] = *b"sgm1";
const HEADER: usize = 24;

/// Deflate makes at most 1032 bytes of one.
const LARGEST_RATIO: u64 = 1032;

/// Level 1: higher ones take three times as long and save a tenth.
const LEVEL: u32 = 1;

/// A mesh's positions and triangles, bit by bit.
///
/// ```
/// let mesh = mesh::shapes::bumpy_torus(24, 16, 1);
/// let packed = library::pack_geometry(&mesh);
/// assert_eq!(library::unpack_geometry(&packed)?, mesh);
/// # Ok::<(), library::LibraryError>(())
/// ```
pub fn pack_geometry(mesh: &TriMesh) -> Vec<u8> {
    let (positions, triangles) = (mesh.positions(), mesh.triangles());
    let is_single = |x: &f64| (f64::from(*x as f32)).to_bits() == x.to_bits();
    let width: u8 = match positions.as_flattened().iter().all(is_single) {
        true => 4,
        false => 8,
    };
    let mut packed = Vec::with_capacity(HEADER + positions.len() * 12);
    packed.extend(MAGIC);
    packed.extend([width, 0, 0, 0]);
    packed.extend((positions.len() as u64).to_le_bytes());
    packed.extend((triangles.len() as u64).to_le_bytes());
    let mut raw = Vec::with_capacity(raw_length(positions.len(), triangles.len(), width) as usize);
    for axis in 0..3 {
        let own = positions.iter().map(|p| p[axis]);
        match width {
            4 => {
                let mut before = 0_u32;
                let deltas = own.map(|x| {
                    let bits = (x as f32).to_bits();
                    bits.wrapping_sub(std::mem::replace(&mut before, bits))
                        .to_le_bytes()
                });
                shuffle(&deltas.collect::<Vec<_>>(), &mut raw);
            }
            _ => {
                let mut before = 0_u64;
                let deltas = own.map(|x| {
                    let bits = x.to_bits();
                    bits.wrapping_sub(std::mem::replace(&mut before, bits))
                        .to_le_bytes()
                });
                shuffle(&deltas.collect::<Vec<_>>(), &mut raw);
            }
        }
    }
    let mut before = 0_u32;
    let deltas = triangles.as_flattened().iter().map(|&v| {
        let delta = v.wrapping_sub(std::mem::replace(&mut before, v)) as i32;
        (((delta << 1) ^ (delta >> 31)) as u32).to_le_bytes()
    });
    shuffle(&deltas.collect::<Vec<_>>(), &mut raw);
    let mut encoder = DeflateEncoder::new(packed, Compression::new(LEVEL));
    // A Vec takes every byte.
    let _ = encoder.write_all(&raw);
    encoder.finish().unwrap_or_default()
}

/// The mesh that was [packed](pack_geometry). Memory is bounded by the length of what is given.
///
/// # Errors
/// [`LibraryError::Geometry`], whatever the bytes are.
pub fn unpack_geometry(packed: &[u8]) -> Result<TriMesh, LibraryError> {
    let damaged = |problem: &str| LibraryError::Geometry {
        problem: problem.into(),
    };
    let (header, body) = packed
        .split_at_checked(HEADER)
        .ok_or_else(|| damaged("it ends within its header"))?;
    let number = |from: usize| {
        let bytes: [u8; 8] = std::array::from_fn(|i| header[from + i]);
        usize::try_from(u64::from_le_bytes(bytes)).map_err(|_| damaged("its counts are too large"))
    };
    if header[..4] != MAGIC {
        return Err(damaged("it begins otherwise"));
    }
    let width = header[4];
    if width != 4 && width != 8 {
        return Err(damaged("numbers have another width than 4 or 8 bytes"));
    }
    let (vertices, triangles) = (number(8)?, number(16)?);
    if vertices.max(triangles) > u32::MAX as usize {
        return Err(damaged("its counts are too large"));
    }
    let length = raw_length(vertices, triangles, width);
    if length > MOST_GEOMETRY || length > (body.len() as u64 + 1) * LARGEST_RATIO {
        return Err(damaged("so few bytes can't hold so many vertices"));
    }
    let mut raw = Vec::new();
    DeflateDecoder::new(body)
        .take(length + 1)
        .read_to_end(&mut raw)
        .map_err(|error| damaged(&error.to_string()))?;
    if raw.len() as u64 != length {
        return Err(damaged("it holds another number of bytes than its counts say"));
    }
    let per_axis = vertices * usize::from(width);
    let mut positions = vec![[0.0; 3]; vertices];
    for axis in 0..3 {
        let plane = &raw[axis * per_axis..(axis + 1) * per_axis];
        if width == 4 {
            let mut before = 0_u32;
            for (i, position) in positions.iter_mut().enumerate() {
                before = before.wrapping_add(u32::from_le_bytes(gathered(plane, vertices, i)));
                position[axis] = f64::from(f32::from_bits(before));
            }
        } else {
            let mut before = 0_u64;
            for (i, position) in positions.iter_mut().enumerate() {
                before = before.wrapping_add(u64::from_le_bytes(gathered(plane, vertices, i)));
                position[axis] = f64::from_bits(before);
            }
        }
    }
    let plane = &raw[3 * per_axis..];
    let mut before = 0_u32;
    let mut corner = |i: usize| {
        let folded = u32::from_le_bytes(gathered(plane, 3 * triangles, i));
        before = before.wrapping_add((folded >> 1) ^ (folded & 1).wrapping_neg());
        before
    };
    let triangles = (0..triangles).map(|t| [corner(3 * t), corner(3 * t + 1), corner(3 * t + 2)]);
    let triangles = triangles.collect();
    TriMesh::new(positions, triangles).map_err(|error| damaged(&error.to_string()))
}

fn raw_length(vertices: usize, triangles: usize, width: u8) -> u64 {
    3 * (vertices as u64 * u64::from(width) + triangles as u64 * 4)
}

/// Adds the first bytes of all numbers, then the second, …
fn shuffle<const N: usize>(numbers: &[[u8; N]], raw: &mut Vec<u8>) {
    for byte in 0..N {
        raw.extend(numbers.iter().map(|number| number[byte]));
    }
}

/// The bytes of the `i`th of so many numbers.
fn gathered<const N: usize>(plane: &[u8], count: usize, i: usize) -> [u8; N] {
    std::array::from_fn(|byte| plane[byte * count + i])
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::{LARGEST_COORDINATE, shapes};
    use proptest::prelude::*;

    fn bits(mesh: &TriMesh) -> Vec<u64> {
        mesh.positions()
            .as_flattened()
            .iter()
            .map(|x| x.to_bits())
            .collect()
    }

    fn any_mesh() -> impl Strategy<Value = TriMesh> {
        (0..5_u8, any::<u64>()).prop_map(|(kind, seed)| match kind {
            0 => shapes::soup(1 + (seed % 60) as u32, seed),
            1 => shapes::book_of_slivers(5, 1e-7),
            2 => shapes::translated(&shapes::bumpy_sphere(2, seed), [1e9, -1e-9, 0.0]),
            3 => shapes::shuffled(&shapes::bumpy_torus(12, 9, seed), seed),
            _ => {
                let mesh = shapes::bumpy_sphere(2, seed);
                let single = mesh.positions().iter().map(|p| p.map(|x| f64::from(x as f32)));
                mesh.with_positions(single.collect()).unwrap()
            }
        })
    }

    proptest! {
        #[test]
        fn geometry_comes_back_bit_by_bit(mesh in any_mesh()) {
            let packed = pack_geometry(&mesh);
            let back = unpack_geometry(&packed).unwrap();
            prop_assert_eq!(bits(&back), bits(&mesh));
            prop_assert_eq!(back.triangles(), mesh.triangles());
        }

        #[test]
        fn damaged_geometry_is_refused_or_another_mesh_and_never_a_panic(mesh in any_mesh(), place in any::<prop::sample::Index>(), value in any::<u8>(), cut in any::<prop::sample::Index>()) {
            let mut packed = pack_geometry(&mesh);
            let at = place.index(packed.len());
            packed[at] = value;
            let _ = unpack_geometry(&packed);
            packed.truncate(cut.index(packed.len()));
            prop_assert!(unpack_geometry(&packed).is_err());
        }

        #[test]
        fn any_bytes_are_refused_or_a_mesh(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            let _ = unpack_geometry(&bytes);
            let _ = unpack_geometry(&[&MAGIC[..], &[4, 0, 0, 0], &bytes].concat());
        }
    }

    #[test]
    fn extreme_numbers_come_back() {
        let positions = vec![
            [0.0, -0.0, LARGEST_COORDINATE],
            [f64::MIN_POSITIVE, 5e-324, -LARGEST_COORDINATE],
            [1.0 / 3.0, -1e-300, 1.0],
        ];
        let mesh = TriMesh::new(positions, vec![[0, 1, 2], [2, 1, 0]]).unwrap();
        assert_eq!(
            bits(&unpack_geometry(&pack_geometry(&mesh)).unwrap()),
            bits(&mesh)
        );
    }

    #[test]
    fn counts_that_the_bytes_cannot_hold_cost_nothing() {
        let mut packed = pack_geometry(&shapes::cube(1.0));
        packed[8..16].copy_from_slice(&u64::from(u32::MAX).to_le_bytes());
        let refused = unpack_geometry(&packed).unwrap_err().to_string();
        assert!(refused.contains("so few bytes"), "{refused}");
    }
}
