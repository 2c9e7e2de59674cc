//! Shorter borders between the parts of one graph, within the limits of their weights: local searches, minimum cuts
//! between pairs of parts, and what restores balance and connected parts.

mod contiguity;
mod flow;
mod gain_cache;
mod greedy;
mod kway;
mod local_search;
mod max_flow;
mod rebalance;

pub(crate) use contiguity::{fill_empty_parts, join_stray_pieces, make_contiguous};
pub(crate) use flow::{FlowSearch, refine as refine_by_flows};
pub(crate) use kway::{KWay, cut};
pub(crate) use local_search::{LocalSearch, Searches};
pub(crate) use rebalance::rebalance;
