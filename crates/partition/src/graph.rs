use crate::PartitionError;

/// An undirected weighted graph in compressed rows: the neighbours of vertex v are
/// `neighbours[offsets[v]..offsets[v + 1]]`, in ascending order.
///
/// Always valid: symmetric with equal weights on both sides, no loops, no repeated edges, edge weights at least 1,
/// vertex weights at least 0, and both sums (each edge counted once) at most 2³¹ − 1. Weights have 32 bits because
/// reading them is what bounds the speed of the partitioner.
///
/// ```
/// let path = partition::Graph::from_edges(3, &[(0, 1, 1), (1, 2, 5)])?;
/// assert_eq!(path.neighbours(1), &[0, 2]);
/// assert_eq!(path.edge_weights(1), &[1, 5]);
/// # Ok::<(), partition::PartitionError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Graph {
    pub(crate) offsets: Vec<usize>,
    pub(crate) neighbours: Vec<u32>,
    pub(crate) vertex_weights: Vec<i32>,
    pub(crate) edge_weights: Vec<i32>,
}

impl Graph {
    /// Checks and takes compressed rows: #V + 1 offsets, one neighbour and one edge weight per entry (each edge is
    /// listed from both ends), one weight per vertex. Missing weights are 1.
    ///
    /// # Errors
    /// Says which vertex or edge breaks which of the invariants above; the order of a row does not matter.
    pub fn new(
        offsets: Vec<usize>,
        neighbours: Vec<u32>,
        vertex_weights: Option<Vec<i32>>,
        edge_weights: Option<Vec<i32>>,
    ) -> Result<Self, PartitionError> {
        check_offsets(&offsets, neighbours.len())?;
        let count = offsets.len() - 1;
        let vertex_weights = vertex_weights.unwrap_or_else(|| vec![1; count]);
        let edge_weights = edge_weights.unwrap_or_else(|| vec![1; neighbours.len()]);
        check_length("the array of vertex weights", vertex_weights.len(), count)?;
        check_length("the array of edge weights", edge_weights.len(), neighbours.len())?;
        let mut graph = Self {
            offsets,
            neighbours,
            vertex_weights,
            edge_weights,
        };
        graph.check_weights()?;
        graph.sort_rows();
        graph.check_rows()?;
        graph.check_symmetry()?;
        Ok(graph)
    }

    /// The graph of a list of edges (vertex, vertex, weight) over unit vertex weights: each edge may be listed from
    /// one end or both or repeatedly. Repetitions in the same direction add up, of the two directions the heavier
    /// counts, and loops are dropped.
    ///
    /// # Errors
    /// When an end is no vertex, a weight is not positive, or sums do not fit.
    pub fn from_edges(vertex_count: usize, edges: &[(u32, u32, i32)]) -> Result<Self, PartitionError> {
        check_size("vertices", vertex_count)?;
        check_size("adjacency entries", edges.len().saturating_mul(2))?;
        for &(a, b, weight) in edges {
            for (vertex, neighbour) in [(a, b), (b, a)] {
                if neighbour as usize >= vertex_count {
                    return Err(PartitionError::NeighbourOutOfRange {
                        vertex: vertex as usize,
                        neighbour: neighbour as usize,
                        count: vertex_count,
                    });
                }
            }
            if weight <= 0 {
                let (vertex, neighbour, weight) = (a as usize, b as usize, weight.into());
                return Err(PartitionError::EdgeWeight {
                    vertex,
                    neighbour,
                    weight,
                });
            }
        }
        let merged = merge_edges(edges)?;
        Ok(Self::from_sorted_edges(vertex_count, &merged))
    }

    /// `edges`: sorted, unique, first end below the second.
    fn from_sorted_edges(vertex_count: usize, edges: &[(u32, u32, i32)]) -> Self {
        let mut offsets = vec![0usize; vertex_count + 1];
        for &(a, b, _) in edges {
            offsets[a as usize + 1] += 1;
            offsets[b as usize + 1] += 1;
        }
        for v in 0..vertex_count {
            offsets[v + 1] += offsets[v];
        }
        let mut cursor = offsets.clone();
        let mut neighbours = vec![0; 2 * edges.len()];
        let mut edge_weights = vec![0; 2 * edges.len()];
        let mut put = |row: u32, neighbour: u32, weight: i32| {
            let at = &mut cursor[row as usize];
            neighbours[*at] = neighbour;
            edge_weights[*at] = weight;
            *at += 1;
        };
        // Smaller neighbours first, then larger ones: every row comes out sorted.
        for &(a, b, weight) in edges {
            put(b, a, weight);
        }
        for &(a, b, weight) in edges {
            put(a, b, weight);
        }
        Self {
            offsets,
            neighbours,
            vertex_weights: vec![1; vertex_count],
            edge_weights,
        }
    }

    /// The same graph with other vertex weights.
    ///
    /// # Errors
    /// When there is not one weight per vertex, one is negative, or their sum does not fit.
    pub fn with_vertex_weights(mut self, vertex_weights: Vec<i32>) -> Result<Self, PartitionError> {
        check_length(
            "the array of vertex weights",
            vertex_weights.len(),
            self.vertex_count(),
        )?;
        self.vertex_weights = vertex_weights;
        self.check_weights()?;
        Ok(self)
    }

    /// #V.
    pub fn vertex_count(&self) -> usize {
        self.vertex_weights.len()
    }

    /// #E, each edge once.
    pub fn edge_count(&self) -> usize {
        self.neighbours.len() / 2
    }

    /// The neighbours of a vertex, ascending.
    pub fn neighbours(&self, vertex: usize) -> &[u32] {
        &self.neighbours[self.offsets[vertex]..self.offsets[vertex + 1]]
    }

    /// The weights of the edges to [`Graph::neighbours`].
    pub fn edge_weights(&self, vertex: usize) -> &[i32] {
        &self.edge_weights[self.offsets[vertex]..self.offsets[vertex + 1]]
    }

    /// Weights of all vertices.
    pub fn vertex_weights(&self) -> &[i32] {
        &self.vertex_weights
    }

    /// Sum of the vertex weights.
    pub fn total_vertex_weight(&self) -> i64 {
        self.vertex_weights.iter().map(|&w| i64::from(w)).sum()
    }

    /// Sum of the edge weights, each edge once.
    pub fn total_edge_weight(&self) -> i64 {
        self.edge_weights.iter().map(|&w| i64::from(w)).sum::<i64>() / 2
    }

    /// Number of edges at a vertex.
    pub(crate) fn degree(&self, vertex: usize) -> usize {
        self.offsets[vertex + 1] - self.offsets[vertex]
    }

    /// Pairs (neighbour, weight) of a vertex.
    #[inline]
    pub(crate) fn edges(&self, vertex: usize) -> impl Iterator<Item = (usize, i32)> + '_ {
        let row = self.offsets[vertex]..self.offsets[vertex + 1];
        self.neighbours[row.clone()]
            .iter()
            .map(|&u| u as usize)
            .zip(self.edge_weights[row].iter().copied())
    }

    /// Largest sum of edge weights at one vertex: the bound of every gain.
    pub(crate) fn max_weighted_degree(&self) -> i32 {
        if self.edge_weights.iter().all(|&weight| weight == 1) {
            let degrees = self.offsets.windows(2).map(|pair| pair[1] - pair[0]);
            return degrees.max().unwrap_or(0) as i32;
        }
        (0..self.vertex_count())
            .map(|v| self.edge_weights(v).iter().sum())
            .max()
            .unwrap_or(0)
    }

    fn check_weights(&self) -> Result<(), PartitionError> {
        if let Some(vertex) = self.vertex_weights.iter().position(|&w| w < 0) {
            return Err(PartitionError::VertexWeight {
                vertex,
                weight: self.vertex_weights[vertex].into(),
            });
        }
        if let Some(entry) = self.edge_weights.iter().position(|&w| w <= 0) {
            let vertex = self.offsets.partition_point(|&o| o <= entry) - 1;
            let neighbour = self.neighbours[entry] as usize;
            let weight = self.edge_weights[entry].into();
            return Err(PartitionError::EdgeWeight {
                vertex,
                neighbour,
                weight,
            });
        }
        for (what, total) in [
            ("vertices", self.total_vertex_weight()),
            ("edges", self.total_edge_weight()),
        ] {
            if total > i64::from(i32::MAX) {
                return Err(PartitionError::WeightSum { what, total });
            }
        }
        Ok(())
    }

    fn sort_rows(&mut self) {
        let mut row: Vec<(u32, i32)> = Vec::new();
        for v in 0..self.vertex_count() {
            let range = self.offsets[v]..self.offsets[v + 1];
            if self.neighbours[range.clone()].is_sorted() {
                continue;
            }
            row.clear();
            row.extend(range.clone().map(|e| (self.neighbours[e], self.edge_weights[e])));
            row.sort_unstable();
            for (e, &(u, w)) in range.zip(&row) {
                self.neighbours[e] = u;
                self.edge_weights[e] = w;
            }
        }
    }

    fn check_rows(&self) -> Result<(), PartitionError> {
        let count = self.vertex_count();
        for vertex in 0..count {
            let row = self.neighbours(vertex);
            if let Some(&last) = row.last()
                && last as usize >= count
            {
                return Err(PartitionError::NeighbourOutOfRange {
                    vertex,
                    neighbour: last as usize,
                    count,
                });
            }
            if row.binary_search(&(vertex as u32)).is_ok() {
                return Err(PartitionError::SelfLoop { vertex });
            }
            if let Some(pair) = row.windows(2).find(|pair| pair[0] == pair[1]) {
                return Err(PartitionError::DuplicateEdge {
                    vertex,
                    neighbour: pair[0] as usize,
                });
            }
        }
        Ok(())
    }

    /// With sorted rows, visiting the edges v < u in order of v must meet the smaller neighbours of every u one by one.
    fn check_symmetry(&self) -> Result<(), PartitionError> {
        let mut met: Vec<usize> = self.offsets[..self.vertex_count()].to_vec();
        for v in 0..self.vertex_count() {
            let entry = met[v];
            if entry < self.offsets[v + 1] && (self.neighbours[entry] as usize) < v {
                return Err(PartitionError::Asymmetric {
                    vertex: v,
                    neighbour: self.neighbours[entry] as usize,
                });
            }
            for (u, weight) in self.edges(v).filter(|&(u, _)| u > v) {
                let entry = met[u];
                let same = entry < self.offsets[u + 1]
                    && self.neighbours[entry] as usize == v
                    && self.edge_weights[entry] == weight;
                if !same {
                    return Err(PartitionError::Asymmetric {
                        vertex: v,
                        neighbour: u,
                    });
                }
                met[u] += 1;
            }
        }
        Ok(())
    }
}

fn check_offsets(offsets: &[usize], entries: usize) -> Result<(), PartitionError> {
    check_length("the array of offsets", offsets.len(), offsets.len().max(1))?;
    check_size("vertices", offsets.len() - 1)?;
    check_size("adjacency entries", entries)?;
    let wrong = |index: usize| PartitionError::Offsets {
        index,
        value: offsets[index],
    };
    if offsets[0] != 0 {
        return Err(wrong(0));
    }
    if let Some(index) = (1..offsets.len()).find(|&i| offsets[i] < offsets[i - 1]) {
        return Err(wrong(index));
    }
    if offsets[offsets.len() - 1] != entries {
        return Err(wrong(offsets.len() - 1));
    }
    Ok(())
}

fn check_length(what: &'static str, given: usize, expected: usize) -> Result<(), PartitionError> {
    if given == expected {
        Ok(())
    } else {
        Err(PartitionError::Length {
            what,
            given,
            expected,
        })
    }
}

/// One index stays free to mean "none".
fn check_size(what: &'static str, count: usize) -> Result<(), PartitionError> {
    if count < u32::MAX as usize {
        Ok(())
    } else {
        Err(PartitionError::TooLarge { what, count })
    }
}

/// Sorted unique edges with the smaller end first.
fn merge_edges(edges: &[(u32, u32, i32)]) -> Result<Vec<(u32, u32, i32)>, PartitionError> {
    let mut sorted: Vec<(u32, u32, bool, i32)> = edges
        .iter()
        .filter(|(a, b, _)| a != b)
        .map(|&(a, b, w)| if a < b { (a, b, false, w) } else { (b, a, true, w) })
        .collect();
    sorted.sort_unstable();
    let mut merged = Vec::new();
    let mut total = 0i64;
    for group in sorted.chunk_by(|x, y| (x.0, x.1) == (y.0, y.1)) {
        let sum = |reversed: bool| -> i64 {
            group
                .iter()
                .filter(|edge| edge.2 == reversed)
                .map(|edge| i64::from(edge.3))
                .sum()
        };
        let weight = sum(false).max(sum(true));
        total += weight;
        merged.push((group[0].0, group[0].1, i32::try_from(weight).unwrap_or(i32::MAX)));
    }
    if total > i64::from(i32::MAX) {
        return Err(PartitionError::WeightSum { what: "edges", total });
    }
    Ok(merged)
}
