use crate::{Graph, PartitionError};

/// How a graph is to be divided.
///
/// ```
/// let options = partition::Options { parts: 8, contiguous: true, ..Default::default() };
/// assert_eq!(options.imbalance, 0.03);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Number of parts k, from 1 to #V.
    pub parts: usize,
    /// ε: part p may weigh max(⌊(1 + ε) t_p⌋, ⌈t_p⌉), where t_p is its share of the total weight.
    pub imbalance: f64,
    /// Relative sizes of the parts, k positive numbers of any sum; equal when absent.
    pub target_weights: Option<Vec<f64>>,
    /// Equal seeds give equal partitions.
    pub seed: u64,
    /// Every part shall be connected. When the graph itself is not, every part is connected inside each component of
    /// the graph: it has at most one piece there, and as many pieces in all as balance asks for.
    pub contiguous: bool,
    /// Time spent on a smaller cut.
    pub effort: Effort,
    /// How parts are made.
    pub method: Method,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            parts: 2,
            imbalance: 0.03,
            target_weights: None,
            seed: 0,
            contiguous: false,
            effort: Effort::Default,
            method: Method::Direct,
        }
    }
}

/// Time spent on a smaller cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Effort {
    /// One multilevel cycle with little search.
    Fast,
    /// About 1.4 times the time of METIS, and shorter borders.
    Default,
    /// Less than ten times the time of METIS: several partitions, combined and refined again.
    High,
}

/// How parts are made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Method {
    /// All parts at once: recursive bisection of the coarsest graph, then k-way refinement on every level.
    Direct,
    /// Halves of halves, each bisection multilevel, then one k-way refinement of the result.
    RecursiveBisection,
}

/// The balance constraint in units of vertex weight.
#[derive(Clone, Debug)]
pub(crate) struct Balance {
    /// t_p, summing to the total weight.
    pub(crate) targets: Vec<f64>,
    /// Heaviest allowed weight of each part.
    pub(crate) limits: Vec<i64>,
}

impl Balance {
    pub(crate) fn new(graph: &Graph, options: &Options) -> Result<Self, PartitionError> {
        let (parts, vertices) = (options.parts, graph.vertex_count());
        if parts == 0 || parts > vertices {
            return Err(PartitionError::Parts { parts, vertices });
        }
        if !(options.imbalance >= 0.0 && options.imbalance.is_finite()) {
            return Err(PartitionError::Imbalance {
                imbalance: options.imbalance,
            });
        }
        let shares = match &options.target_weights {
            None => vec![1.0; parts],
            Some(weights) => check_targets(weights, parts)?,
        };
        let total = graph.total_vertex_weight() as f64;
        let sum: f64 = shares.iter().sum();
        let targets = shares.iter().map(|share| share / sum * total).collect();
        Ok(Self::of_targets(targets, options.imbalance))
    }

    /// The bound of [`Options::imbalance`].
    pub(crate) fn of_targets(targets: Vec<f64>, imbalance: f64) -> Self {
        // Rounding may put a target a hair off an integer; the limit is meant for the integer.
        let whole = |x: f64| {
            if (x - x.round()).abs() < 1e-9 * x.max(1.0) {
                x.round()
            } else {
                x
            }
        };
        let limits = targets
            .iter()
            .map(|&t| whole((1.0 + imbalance) * t).floor().max(whole(t).ceil()) as i64)
            .collect();
        Self { targets, limits }
    }

    pub(crate) fn parts(&self) -> usize {
        self.targets.len()
    }
}

/// The shares, scaled so that their sum is finite.
fn check_targets(weights: &[f64], parts: usize) -> Result<Vec<f64>, PartitionError> {
    if weights.len() != parts {
        let what = "the array of target weights";
        return Err(PartitionError::Length {
            what,
            given: weights.len(),
            expected: parts,
        });
    }
    if let Some(part) = weights.iter().position(|&w| !(w > 0.0 && w.is_finite())) {
        return Err(PartitionError::TargetWeight {
            part,
            weight: weights[part],
        });
    }
    let largest = weights.iter().fold(0.0, |a: f64, &b| a.max(b));
    Ok(weights.iter().map(|w| w / largest).collect())
}
