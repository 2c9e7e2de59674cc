/// What lies at each vertex: its neighbours, its edges or its triangles, in compressed rows.
///
/// [`TriMesh::neighbours`](crate::TriMesh::neighbours), [`TriMesh::vertex_triangles`](crate::TriMesh::vertex_triangles) and
/// [`Edges::at_vertices`](crate::Edges::at_vertices) make them, in O(#V + #F) time.
///
/// ```
/// let square = mesh::shapes::rectangle(1, 1, 1.0, 1.0); // triangles 0 1 3 and 0 3 2
/// assert_eq!(square.neighbours().of(0), [1, 2, 3]);
/// assert_eq!(square.vertex_triangles().of(0), [0, 1]);
/// assert_eq!(square.vertex_triangles().of(1), [0]);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct VertexStars {
    offsets: Vec<usize>,
    entries: Vec<u32>,
}

impl VertexStars {
    /// Sorts pairs of a vertex and an entry by vertex; a row keeps the order in which its entries come.
    pub(crate) fn gather(vertex_count: usize, pairs: impl Iterator<Item = (u32, u32)> + Clone) -> Self {
        let mut offsets = vec![0; vertex_count + 1];
        for (v, _) in pairs.clone() {
            offsets[v as usize + 1] += 1;
        }
        for v in 0..vertex_count {
            offsets[v + 1] += offsets[v];
        }
        let mut next = offsets.clone();
        let mut entries = vec![0; offsets[vertex_count]];
        for (v, entry) in pairs {
            entries[next[v as usize]] = entry;
            next[v as usize] += 1;
        }
        Self { offsets, entries }
    }

    /// The row of a vertex, ascending; empty where no triangle uses the vertex.
    pub fn of(&self, vertex: usize) -> &[u32] {
        &self.entries[self.offsets[vertex]..self.offsets[vertex + 1]]
    }

    /// Where each vertex's row begins in [`Self::entries`]; #V + 1 numbers.
    pub fn offsets(&self) -> &[usize] {
        &self.offsets
    }

    /// All rows, one after another.
    pub fn entries(&self) -> &[u32] {
        &self.entries
    }

    /// #V.
    pub fn vertex_count(&self) -> usize {
        self.offsets.len() - 1
    }
}
