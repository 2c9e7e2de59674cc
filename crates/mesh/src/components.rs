use crate::TriMesh;
use crate::union_find::UnionFind;

/// The connected parts of a mesh, or of any graph: two vertices lie in one part when a path of edges joins them.
///
/// Parts are numbered from 0 in the order of their smallest vertices. A vertex that no triangle uses is a part by itself.
#[derive(Clone, Debug, PartialEq)]
pub struct Components {
    /// How many parts there are.
    pub count: usize,
    /// The part of each vertex, #V.
    pub of_vertex: Vec<u32>,
    /// How many vertices each part has.
    pub sizes: Vec<usize>,
}

/// Finds the connected parts of a mesh.
pub fn components(mesh: &TriMesh) -> Components {
    Components::of_triangles(mesh.vertex_count(), mesh.triangles())
}

impl Components {
    /// The parts of `count` vertices under triangles that need not make a mesh.
    pub fn of_triangles(count: usize, triangles: &[[u32; 3]]) -> Self {
        Self::of_pairs(count, triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c]]))
    }

    /// The parts of `count` vertices of which pairs are joined, in any order: the edges of a graph, or the entries of a matrix.
    ///
    /// # Panics
    /// If a pair names a vertex that is not below `count`.
    pub fn of_pairs(count: usize, pairs: impl IntoIterator<Item = [u32; 2]>) -> Self {
        let mut sets = UnionFind::new(count);
        for [a, b] in pairs {
            sets.join(a, b);
        }
        let mut of_vertex = Vec::with_capacity(count);
        let mut sizes = Vec::new();
        for v in 0..count as u32 {
            // The representative is the smallest member, so it has been numbered already, or is v itself.
            let part = match sets.find(v) {
                first if first < v => of_vertex[first as usize],
                _ => {
                    sizes.push(0);
                    sizes.len() as u32 - 1
                }
            };
            sizes[part as usize] += 1;
            of_vertex.push(part);
        }
        Self {
            count: sizes.len(),
            of_vertex,
            sizes,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    #[test]
    fn parts_are_numbered_in_the_order_of_their_smallest_vertices() {
        let parts = components(&shapes::disjoint_union(&[
            shapes::cube(1.0),
            shapes::tetrahedron(),
            shapes::icosphere(0),
        ]));
        assert_eq!(parts.sizes, [8, 4, 12]);
        assert!(parts.of_vertex.is_sorted());
        let parts = components(&shapes::shuffled(&shapes::soup(20, 3), 4));
        let firsts = (0..20).map(|part| parts.of_vertex.iter().position(|&p| p == part).unwrap());
        assert!(firsts.is_sorted());
        assert_eq!(parts.sizes, [3; 20]);
    }

    #[test]
    fn an_unused_vertex_is_a_part_by_itself() {
        let mesh = TriMesh::new(
            vec![[0., 0., 0.], [9., 9., 9.], [1., 0., 0.], [0., 1., 0.]],
            vec![[0, 2, 3]],
        )
        .unwrap();
        let expected = Components {
            count: 2,
            of_vertex: vec![0, 1, 0, 0],
            sizes: vec![3, 1],
        };
        assert_eq!(components(&mesh), expected);
    }
}
