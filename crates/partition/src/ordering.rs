//! Nested dissection (George 1973): separators last, halves before them, and so on in the halves; small leaves by minimum
//! fill, the separators around them counted.

use crate::bisect::induced;
use crate::min_fill::min_fill;
use crate::rng::Rng;
use crate::separator::{SEPARATOR, separate};
use crate::team::Team;
use crate::{Graph, PartitionError};

/// How a graph is ordered.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OrderingOptions {
    /// Equal seeds give equal orderings, on any number of threads.
    pub seed: u64,
    /// Graphs of at most this many vertices are ordered by minimum fill; at most 1000 is sensible.
    pub leaf_size: usize,
    /// Separators tried in each step (half as many on small graphs); the lightest is kept.
    pub tries: usize,
    /// Threads to use, at least 1.
    pub threads: usize,
}

impl Default for OrderingOptions {
    fn default() -> Self {
        Self {
            seed: 0,
            leaf_size: 80,
            tries: 2,
            threads: 1,
        }
    }
}

/// An elimination order and its inverse.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ordering {
    /// The vertex that is eliminated at each position.
    pub order: Vec<u32>,
    /// The position at which each vertex is eliminated.
    pub position: Vec<u32>,
}

impl Ordering {
    /// The ordering with this `order`; none when it is no permutation.
    pub fn from_order(order: Vec<u32>) -> Option<Self> {
        let mut position = vec![u32::MAX; order.len()];
        for (i, &v) in order.iter().enumerate() {
            let place = position.get_mut(v as usize)?;
            if *place != u32::MAX {
                return None;
            }
            *place = i as u32;
        }
        Some(Self { order, position })
    }
}

/// A fill-reducing order for the Cholesky factorisation of symmetric matrices with this graph. Edge weights do not
/// matter; vertices of weight 0 count as 1.
///
/// ```
/// # use partition::{Graph, OrderingOptions, column_counts, nested_dissection};
/// let path = Graph::from_edges(1000, &(0..999).map(|i| (i, i + 1, 1)).collect::<Vec<_>>())?;
/// let ordering = nested_dissection(&path, &OrderingOptions::default())?;
/// assert!(column_counts(&path, &ordering).iter().sum::<u64>() < 3000);
/// # Ok::<(), partition::PartitionError>(())
/// ```
///
/// # Errors
/// When the threads cannot be started.
pub fn nested_dissection(graph: &Graph, options: &OrderingOptions) -> Result<Ordering, PartitionError> {
    let team = Team::new(options.threads)?;
    let mut unit = graph.clone();
    unit.vertex_weights.fill(1);
    unit.edge_weights.fill(1);
    let dissection = Dissection {
        options,
        team: &team,
        whole: &unit,
    };
    let all = (0..unit.vertex_count() as u32).collect();
    let order = dissection.order(&unit, all, &Rng::new(options.seed));
    let mut position = vec![0; order.len()];
    order
        .iter()
        .enumerate()
        .for_each(|(i, &v)| position[v as usize] = i as u32);
    Ok(Ordering { order, position })
}

/// Smaller graphs get half of the tries: they are many, and their separators fill in little.
const SMALL: usize = 1000;

struct Dissection<'a> {
    options: &'a OrderingOptions,
    team: &'a Team,
    whole: &'a Graph,
}

impl Dissection<'_> {
    /// The `vertices` of the whole graph in order of elimination; `graph` is what they induce.
    fn order(&self, graph: &Graph, vertices: Vec<u32>, rng: &Rng) -> Vec<u32> {
        if graph.vertex_count() <= self.options.leaf_size.max(1) {
            return min_fill(self.whole, &vertices);
        }
        if graph.neighbours.is_empty() {
            return vertices;
        }
        let tries = self
            .options
            .tries
            .div_ceil(if graph.vertex_count() < SMALL { 2 } else { 1 });
        let separation = separate(graph, tries, self.team, &mut rng.fork(0));
        if separation.weight[0] == 0 || separation.weight[1] == 0 {
            return by_degree(graph, vertices);
        }
        let half = |side: u8| {
            let (subgraph, places) = induced(graph, &separation.side, side);
            let inside = places.iter().map(|&place| vertices[place as usize]).collect();
            self.order(&subgraph, inside, &rng.fork(1 + u64::from(side)))
        };
        let (mut order, second) = self.team.join(|| half(0), || half(1));
        order.extend(second);
        let separator = vertices
            .iter()
            .zip(&separation.side)
            .filter(|(_, side)| **side == SEPARATOR);
        order.extend(separator.map(|(v, _)| v));
        order
    }
}

/// For graphs that have no separator worth the name, such as cliques.
fn by_degree(graph: &Graph, vertices: Vec<u32>) -> Vec<u32> {
    let mut places: Vec<usize> = (0..vertices.len()).collect();
    places.sort_by_key(|&place| graph.degree(place));
    places.into_iter().map(|place| vertices[place]).collect()
}
