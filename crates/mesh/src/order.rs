//! Vertices in the order of their places: what lies together in space lies together in memory.

use crate::TriMesh;

/// Meshes with fewer vertices are in the processor's cache, whatever their order.
const SMALL: usize = 100_000;

/// Where neighbours are farther apart in the list than one part in so many of it, in the mean, its order has nothing to do with the surface.
/// Random order makes it a third; files of programs have a hundredth and less.
const SCATTERED: usize = 20;

/// Bits of a coordinate in a place's number.
const DEPTH: u32 = 21;

impl TriMesh {
    /// The same mesh with its vertices, and its triangles, along a Z-order curve (Morton 1966) through its bounding box, if they are many and their order has
    /// nothing to do with the surface; none if they may stay as they are.
    ///
    /// Whatever walks over the surface takes several times longer where each step is a cache miss.
    pub fn gathered(&self) -> Option<Self> {
        if self.vertex_count() < SMALL || self.mean_gap() * SCATTERED < self.vertex_count() {
            return None;
        }
        let bounds = self.bounding_box();
        let (min, size) = (bounds.min, bounds.size());
        let place = |v: usize| {
            let cell = |axis: usize| {
                let along = (self.positions()[v][axis] - min[axis]) / size[axis];
                // NaN, of a flat axis, is 0.
                (along * f64::from((1u32 << DEPTH) - 1)) as u64
            };
            spread(cell(0)) | spread(cell(1)) << 1 | spread(cell(2)) << 2
        };
        let mut order: Vec<(u64, u32)> = (0..self.vertex_count()).map(|v| (place(v), v as u32)).collect();
        order.sort_unstable();
        let mut number = vec![0u32; order.len()];
        for (new, &(_, old)) in order.iter().enumerate() {
            number[old as usize] = new as u32;
        }
        let positions = order
            .iter()
            .map(|&(_, old)| self.positions()[old as usize])
            .collect();
        let mut triangles: Vec<[u32; 3]> = self
            .triangles()
            .iter()
            .map(|triangle| triangle.map(|v| number[v as usize]))
            .collect();
        triangles.sort_unstable_by_key(|triangle| (triangle.iter().min().copied(), *triangle));
        Self::new(positions, triangles).ok()
    }

    /// How far the corners of triangles are apart in the list of vertices, in the mean.
    fn mean_gap(&self) -> usize {
        let gaps = self.triangles().iter().map(|[a, b, _]| a.abs_diff(*b) as usize);
        gaps.sum::<usize>() / self.triangle_count()
    }
}

/// Two zeros between every two of the lowest 21 bits.
fn spread(bits: u64) -> u64 {
    let mut x = bits & 0x1f_ffff;
    for (shift, mask) in [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ] {
        x = (x | x << shift) & mask;
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    #[test]
    fn bits_are_spread_over_every_third_place() {
        for x in [0, 1, 0b101, 0x1f_ffff, 0x12_3456] {
            let expected = (0..21).fold(0, |sum, i| sum | (x >> i & 1) << (3 * i));
            assert_eq!(spread(x), expected);
        }
    }

    #[test]
    fn a_shuffled_mesh_is_gathered_and_stays_the_same_surface() {
        let mesh = shapes::bumpy_torus(400, 300, 2);
        assert!(mesh.gathered().is_none());
        let shuffled = shapes::shuffled(&mesh, 3);
        let gathered = shuffled.gathered().unwrap();
        assert!(gathered.mean_gap() * 20 < shuffled.mean_gap());
        assert!((gathered.area() / mesh.area() - 1.0).abs() < 1e-12);
        assert!((gathered.signed_volume() / mesh.signed_volume() - 1.0).abs() < 1e-9);
        let corners = |mesh: &TriMesh| {
            let mut all: Vec<[u64; 3]> = mesh.positions().iter().map(|p| p.map(f64::to_bits)).collect();
            all.sort_unstable();
            all
        };
        assert_eq!(corners(&gathered), corners(&mesh));
        assert!(gathered.gathered().is_none());
    }
}
