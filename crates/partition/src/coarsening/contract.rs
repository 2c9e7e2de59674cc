//! Contraction of a matching: pairs become vertices, parallel edges become one with the sum of their weights.

use job::{Job, JobError};

use crate::Graph;

/// Coarse vertex of each vertex, numbered in the order of the first of each pair: neighbours stay close in memory.
pub(crate) fn number_pairs(partner: &[u32]) -> (Vec<u32>, usize) {
    let mut coarse_of = vec![0; partner.len()];
    let mut count = 0;
    for v in 0..partner.len() {
        let other = partner[v] as usize;
        if other < v {
            coarse_of[v] = coarse_of[other];
        } else {
            coarse_of[v] = count;
            count += 1;
        }
    }
    (coarse_of, count as usize)
}

/// The coarse graph. Threads write the rows of ranges of vertices, which are then joined.
pub(crate) fn contract(
    graph: &Graph,
    partner: &[u32],
    coarse_of: &[u32],
    count: usize,
    job: &Job,
) -> Result<Graph, JobError> {
    let ranges = if graph.vertex_count() < PARALLEL {
        1
    } else {
        job.threads()
    };
    let bound = |i: usize| graph.vertex_count() * i / ranges;
    let rows = job.map(ranges, 1, |i| {
        contract_rows(graph, partner, coarse_of, count, bound(i)..bound(i + 1))
    })?;
    Ok(join_rows(rows))
}

/// Vertices below which the rows of one thread are not worth joining with another's; no result depends on it.
const PARALLEL: usize = 5_000;

/// The rows of the pairs whose first vertex lies in `range`. A marker per coarse vertex says where its entry stands in
/// the row being written, so that every edge costs one look-up; edges inside a pair gather in the row's first entry,
/// which is dropped in the end.
fn contract_rows(
    graph: &Graph,
    partner: &[u32],
    coarse_of: &[u32],
    count: usize,
    range: std::ops::Range<usize>,
) -> Graph {
    let entries = graph.offsets[range.end] - graph.offsets[range.start];
    let mut offsets = Vec::with_capacity(range.len() + 1);
    let mut vertex_weights = Vec::with_capacity(range.len());
    let mut neighbours: Vec<u32> = Vec::with_capacity(entries + 1);
    let mut edge_weights: Vec<i32> = Vec::with_capacity(entries + 1);
    // One past the entry's position, so that 0 means "not met".
    let mut place = vec![0u32; count];
    offsets.push(0);
    for v in range {
        let other = partner[v] as usize;
        if other < v {
            continue;
        }
        let start = neighbours.len();
        let mut add = |coarse: u32, weight: i32| {
            let at = place[coarse as usize] as usize;
            if at > start {
                edge_weights[at - 1] += weight;
            } else {
                neighbours.push(coarse);
                edge_weights.push(weight);
                place[coarse as usize] = neighbours.len() as u32;
            }
        };
        add(coarse_of[v], 0);
        graph.edges(v).for_each(|(u, weight)| add(coarse_of[u], weight));
        if other != v {
            graph
                .edges(other)
                .for_each(|(u, weight)| add(coarse_of[u], weight));
        }
        neighbours.swap_remove(start);
        edge_weights.swap_remove(start);
        place[coarse_of[v] as usize] = 0;
        if let Some(&moved) = neighbours.get(start) {
            place[moved as usize] = start as u32 + 1;
        }
        let alone = if other == v {
            0
        } else {
            graph.vertex_weights[other]
        };
        vertex_weights.push(graph.vertex_weights[v] + alone);
        offsets.push(neighbours.len());
    }
    Graph {
        offsets,
        neighbours,
        vertex_weights,
        edge_weights,
    }
}

/// The rows of all ranges, in order.
fn join_rows(rows: Vec<Graph>) -> Graph {
    let mut rows = rows.into_iter();
    let mut all = rows.next().unwrap_or_else(|| Graph {
        offsets: vec![0],
        neighbours: Vec::new(),
        vertex_weights: Vec::new(),
        edge_weights: Vec::new(),
    });
    for part in rows {
        let before = all.neighbours.len();
        all.offsets
            .extend(part.offsets[1..].iter().map(|offset| before + offset));
        all.neighbours.extend(part.neighbours);
        all.vertex_weights.extend(part.vertex_weights);
        all.edge_weights.extend(part.edge_weights);
    }
    all
}
