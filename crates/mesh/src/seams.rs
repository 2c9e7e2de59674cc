use crate::{Edges, TriMesh, Welded, union_find::UnionFind};

/// Copies differ by the rounding of single precision at most, a few times over: this fraction of the largest coordinate.
const ROUNDED: f64 = 4.0 / (1 << 24) as f64;

/// So many pairs of vertices are looked at for each: copies are few, and where as many lie as near, rounding is not what they differ by.
const MOST_PAIRS: usize = 64;

/// Cells are so many times larger than the distance of copies, so that few vertices lie near a border.
const ROOMY: f64 = 1000.0;

/// A mesh whose vertices were split along seams, with the copies of a vertex as one again.
///
/// Files repeat a vertex wherever its texture or its normal changes, and conversions round the copies; those at equal positions are merged by [`Welded`],
/// and here those that differ by no more than rounding to single precision.
#[derive(Clone, Debug)]
pub struct Closed {
    mesh: TriMesh,
    vertex_of: Vec<u32>,
}

impl Closed {
    /// Copies in parts that a scene places differ by the rounding of their placements, too: this fraction of the largest coordinate.
    pub const PLACED: f64 = 5e-7;

    /// Merges vertices on open borders; `None` if none of them are copies, or nearly all lie as near to each other as copies.
    pub fn along_borders(mesh: &TriMesh, edges: &Edges) -> Option<Self> {
        let ends = edges.vertices().iter().enumerate();
        let mut on_border: Vec<u32> = ends
            .filter(|(e, _)| edges.triangles(*e).len() == 1)
            .flat_map(|(_, ends)| *ends)
            .collect();
        on_border.sort_unstable();
        on_border.dedup();
        Self::of(mesh, &on_border, ROUNDED)
    }

    /// The same wherever they are, such as those of parts that touch.
    pub fn everywhere(mesh: &TriMesh) -> Option<Self> {
        let all: Vec<u32> = (0..mesh.vertex_count() as u32).collect();
        Self::of(mesh, &all, Self::PLACED)
    }

    fn of(mesh: &TriMesh, chosen: &[u32], apart: f64) -> Option<Self> {
        let positions = mesh.positions();
        let largest = positions
            .as_flattened()
            .iter()
            .fold(0.0_f64, |m, x| m.max(x.abs()));
        let first = first_copies(positions, chosen, apart * largest)?;
        if first.iter().enumerate().all(|(v, &first)| v == first as usize) {
            return None;
        }
        let moved: Vec<[f64; 3]> = first.iter().map(|&v| positions[v as usize]).collect();
        let welded = Welded::new(&moved, mesh.triangles()).ok()?;
        let mut vertex_of = vec![u32::MAX; welded.mesh().vertex_count()];
        for (v, kept) in (0..).zip(welded.vertex_of()) {
            if let Some(kept) = kept {
                let source = &mut vertex_of[*kept as usize];
                *source = (*source).min(v);
            }
        }
        Some(Self {
            vertex_of,
            mesh: welded.into_mesh(),
        })
    }

    /// The closed mesh.
    pub fn mesh(&self) -> &TriMesh {
        &self.mesh
    }

    /// For each of its vertices, the first of the given mesh that became it.
    pub fn vertex_of(&self) -> &[u32] {
        &self.vertex_of
    }
}

/// For each vertex the first of those that lie within `near` of it along every axis, or of others that do of those; itself for
/// all but the `chosen`. `None` if too many do.
fn first_copies(positions: &[[f64; 3]], chosen: &[u32], near: f64) -> Option<Vec<u32>> {
    let cell = ROOMY * near;
    if !(cell > 0.0 && cell.is_finite()) {
        return None;
    }
    let mut filed: Vec<([i64; 3], u32)> = Vec::with_capacity(chosen.len());
    for &v in chosen {
        let [low, high] =
            [-near, near].map(|off| positions[v as usize].map(|x| ((x + off) / cell).floor() as i64));
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                filed.extend((low[2]..=high[2]).map(|z| ([x, y, z], v)));
            }
        }
    }
    let x = |v: u32| positions[v as usize][0];
    filed.sort_by(|a, b| a.0.cmp(&b.0).then(x(a.1).total_cmp(&x(b.1))));
    let mut copies = UnionFind::new(positions.len());
    let mut pairs_left = MOST_PAIRS * filed.len();
    for cell in filed.chunk_by(|a, b| a.0 == b.0) {
        for (i, &(_, v)) in cell.iter().enumerate() {
            let neighbours = cell[i + 1..].iter().take_while(|(_, w)| x(*w) - x(v) <= near);
            for &(_, w) in neighbours {
                pairs_left = pairs_left.checked_sub(1)?;
                let (p, q) = (positions[v as usize], positions[w as usize]);
                if (0..3).all(|axis| (p[axis] - q[axis]).abs() <= near) {
                    copies.join(v, w);
                }
            }
        }
    }
    Some((0..positions.len() as u32).map(|v| copies.find(v)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    /// Every triangle by itself.
    fn loose(mesh: &TriMesh) -> TriMesh {
        let rounded = |p: [f64; 3], t: usize| p.map(|x| x * (1.0 + 1e-8 * (t % 7) as f64));
        let corners = (0..mesh.triangle_count()).flat_map(|t| mesh.corners(t).map(|p| rounded(p.into(), t)));
        let triangles = (0..mesh.triangle_count() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
        TriMesh::new(corners.collect(), triangles.collect()).unwrap()
    }

    #[test]
    fn copies_that_were_rounded_are_one_vertex_again() {
        let mesh = shapes::bumpy_sphere(3, 1);
        let loose = loose(&mesh);
        let closed = Closed::along_borders(&loose, &Edges::of(&loose)).unwrap();
        assert_eq!(closed.mesh().vertex_count(), mesh.vertex_count());
    }

    /// Far from the origin rounding to single precision is as large as the mesh, and all pairs of vertices are as near as copies.
    #[test]
    fn where_everything_is_as_near_as_copies_nothing_is_one() {
        let near = loose(&shapes::bumpy_sphere(5, 1));
        let far = near.positions().iter().map(|[x, y, z]| [x + 1e8, *y, *z]);
        let far = near.with_positions(far.collect()).unwrap();
        assert!(Closed::along_borders(&far, &Edges::of(&far)).is_none());
        assert!(Closed::everywhere(&far).is_none());
    }
}
