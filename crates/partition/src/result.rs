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

/// By sets that are joined along the edges, in one run over the rows: a search would jump about in memory.
fn components_of_parts(graph: &Graph, part_of: &[u32], parts: usize) -> Vec<usize> {
    let mut parent: Vec<u32> = (0..part_of.len() as u32).collect();
    for v in 0..part_of.len() {
        let mut root = v;
        let smaller = graph.neighbours(v).iter().map(|&u| u as usize);
        for u in smaller.take_while(|&u| u < v) {
            if part_of[u] == part_of[v] {
                let other = find(&mut parent, u);
                let (first, second) = (root.min(other), root.max(other));
                parent[second] = first as u32;
                root = first;
            }
        }
    }
    let mut components = vec![0; parts];
    for v in (0..part_of.len()).filter(|&v| parent[v] as usize == v) {
        components[part_of[v] as usize] += 1;
    }
    components
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
