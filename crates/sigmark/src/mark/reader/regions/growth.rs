//! Regions from the corners of triangles that survived alone.

use std::mem;

use job::Job;
use mesh::VertexStars;

use super::{CHUNK, Overlay, Regions, survivors::Survivor};
use crate::mark::MarkError;

/// Each vertex joins the corner that is nearest along the edges to its neighbours, of several as near the one of the smallest number.
///
/// Threads share the way there by taking one step from all vertices that came nearer in the last round (Bellman and Ford); regions are a few edges wide.
pub(super) fn grown(
    overlay: Overlay<'_>,
    neighbours: &VertexStars,
    survivors: &[Option<Survivor>],
    job: &Job,
) -> Result<Regions, MarkError> {
    let Overlay { original, places, .. } = overlay;
    // How far the corner is, and its region.
    let mut nearest = vec![(f64::INFINITY, u32::MAX); places.len()];
    let mut came_nearer = vec![false; places.len()];
    let mut reached = Vec::new();
    let is_seen = |v: u32| places[v as usize].is_some();
    let corners = overlay.corners(survivors);
    let corners = corners.map(|(_, v, region)| (v, (0.0, region)));
    let mut offers = vec![corners.filter(|&(v, _)| is_seen(v)).collect::<Vec<_>>()];
    while !offers.is_empty() {
        reached.clear();
        for (v, offer) in offers.into_iter().flatten() {
            let v = v as usize;
            if offer < nearest[v] {
                nearest[v] = offer;
                if !mem::replace(&mut came_nearer[v], true) {
                    reached.push(v);
                }
            }
        }
        reached.iter().for_each(|&v| came_nearer[v] = false);
        offers = job.quiet().map_chunks(reached.len(), CHUNK, |range| {
            let mut offers = Vec::new();
            for &here in &reached[range] {
                let (distance, region) = nearest[here];
                for &next in neighbours.of(here) {
                    let step = (original.point(here) - original.point(next as usize)).norm();
                    let offer = (distance + step, region);
                    if offer < nearest[next as usize] && is_seen(next) {
                        offers.push((next, offer));
                    }
                }
            }
            offers
        })?;
    }
    let region = |(_, region): (f64, u32)| (region != u32::MAX).then_some(region);
    Ok(nearest.into_iter().map(region).collect())
}
