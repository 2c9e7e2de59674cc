use job::{Job, JobError};

use crate::options::Balance;
use crate::{Graph, PartitionError};

/// A division of the vertices, with the figures by which it is judged.
#[derive(Clone, Debug, PartialEq)]
pub struct Partition {
    /// Part of each vertex, from 0.
    pub part_of: Vec<u32>,
    /// Total weight of the edges between parts.
    pub cut: i64,
    /// Vertex weight of each part.
    pub weights: Vec<i64>,
    /// Greatest ratio of a part's weight to its target, less 1.
    pub imbalance: f64,
    /// Whether every part is within its limit. When not, the weights allow nothing better that the search could find.
    pub balanced: bool,
    /// Connected components of each part; 0 for an empty part.
    pub components: Vec<usize>,
    /// Sum over the vertices of the number of other parts that they touch.
    pub communication_volume: u64,
}

impl Partition {
    /// Judges a given division into as many parts as there are targets (relative weights of any sum).
    ///
    /// # Errors
    /// When a part is out of range, the lengths differ, a target is not positive, or the job's threads cannot be started.
    pub fn evaluate(
        graph: &Graph,
        part_of: Vec<u32>,
        options: &crate::Options,
        job: &Job,
    ) -> Result<Self, PartitionError> {
        let balance = Balance::new(graph, options)?;
        if part_of.len() != graph.vertex_count() {
            let (what, given) = ("the array of parts", part_of.len());
            return Err(PartitionError::Length {
                what,
                given,
                expected: graph.vertex_count(),
            });
        }
        let parts = options.parts;
        if let Some(vertex) = part_of.iter().position(|&p| p as usize >= parts) {
            return Err(PartitionError::PartOutOfRange {
                vertex,
                part: part_of[vertex] as usize,
                parts,
            });
        }
        Ok(Self::of(graph, part_of, &balance, job)?)
    }

    /// `part_of` must be in range.
    pub(crate) fn of(
        graph: &Graph,
        part_of: Vec<u32>,
        balance: &Balance,
        job: &Job,
    ) -> Result<Self, JobError> {
        let mut weights = vec![0i64; balance.parts()];
        for (v, &p) in part_of.iter().enumerate() {
            weights[p as usize] += i64::from(graph.vertex_weights[v]);
        }
        let ratio = |(&w, &t): (&i64, &f64)| if t > 0.0 { w as f64 / t - 1.0 } else { 0.0 };
        let imbalance = weights
            .iter()
            .zip(&balance.targets)
            .map(ratio)
            .fold(f64::NEG_INFINITY, f64::max);
        let balanced = weights.iter().zip(&balance.limits).all(|(w, limit)| w <= limit);
        let ((communication_volume, cut), components) = job.join(
            || borders(graph, &part_of, balance.parts()),
            || components_of_parts(graph, &part_of, balance.parts()),
        )?;
        Ok(Self {
            cut,
            weights,
            imbalance: imbalance.max(0.0),
            balanced,
            components,
            communication_volume,
            part_of,
        })
    }

    /// Number of parts.
    pub fn parts(&self) -> usize {
        self.weights.len()
    }
}

fn components_of_parts(graph: &Graph, part_of: &[u32], parts: usize) -> Vec<usize> {
    let first = first_connected(graph, |u, v| part_of[u] == part_of[v]);
    let mut components = vec![0; parts];
    for v in (0..part_of.len()).filter(|&v| first[v] as usize == v) {
        components[part_of[v] as usize] += 1;
    }
    components
}

/// For each vertex the first one that a path of edges whose ends are `alike` leads to.
///
/// By sets that are joined along the edges, in one run over the rows: a search would jump about in memory.
pub(crate) fn first_connected(graph: &Graph, alike: impl Fn(usize, usize) -> bool) -> Vec<u32> {
    let mut parent: Vec<u32> = (0..graph.vertex_count() as u32).collect();
    for v in 0..parent.len() {
        let mut root = v;
        let neighbours = graph.neighbours(v).iter().map(|&u| u as usize);
        // Rows of graphs that were contracted are in no order.
        for u in neighbours.filter(|&u| u < v && alike(u, v)) {
            let other = find(&mut parent, u);
            let (first, second) = (root.min(other), root.max(other));
            parent[second] = first as u32;
            root = first;
        }
    }
    // A parent comes before its children, so that it has its own root already.
    for v in 0..parent.len() {
        parent[v] = parent[parent[v] as usize];
    }
    parent
}

/// The root of a set, with the way to it halved.
fn find(parent: &mut [u32], mut v: usize) -> usize {
    while parent[v] as usize != v {
        let up = parent[parent[v] as usize];
        parent[v] = up;
        v = up as usize;
    }
    v
}

/// The communication volume and the cut.
fn borders(graph: &Graph, part_of: &[u32], parts: usize) -> (u64, i64) {
    let mut last_seen = vec![u32::MAX; parts];
    let (mut volume, mut twice_cut) = (0, 0);
    for v in 0..part_of.len() {
        last_seen[part_of[v] as usize] = v as u32;
        for (u, weight) in graph.edges(v) {
            if part_of[u] != part_of[v] {
                twice_cut += i64::from(weight);
                let seen = std::mem::replace(&mut last_seen[part_of[u] as usize], v as u32);
                volume += u64::from(seen != v as u32);
            }
        }
    }
    (volume, twice_cut / 2)
}
