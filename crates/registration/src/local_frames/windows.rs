//! What lies around each vertex: well-spread samples that can be reached over the surface without leaving a ball.

use mesh::{Edges, TriMesh};

use super::Neighbour;

/// More samples of a region are not taken: what is fitted to them has far fewer unknowns.
const MOST_SAMPLES: usize = 4000;

/// The surroundings of each vertex of a region.
pub(super) struct Windows {
    samples: Vec<u32>,
    neighbours: Vec<Vec<Neighbour>>,
}

impl Windows {
    /// Those within so far of each vertex, about so many, among vertices that are seen.
    pub(super) fn around(region: &TriMesh, is_seen: &[bool], reach: f64, within: f64) -> Self {
        let ball = std::f64::consts::PI * reach * reach;
        let wanted = within * region.area() / ball.max(f64::MIN_POSITIVE);
        let wanted = (wanted.ceil() as usize).clamp(1, MOST_SAMPLES);
        let samples = spread(region, is_seen, wanted);
        let around = Edges::of(region).neighbours();
        let mut neighbours = vec![Vec::new(); region.vertex_count()];
        let (mut reached_by, mut stack) = (vec![u32::MAX; region.vertex_count()], Vec::new());
        for &sample in &samples {
            let centre = region.point(sample as usize);
            stack.push(sample);
            reached_by[sample as usize] = sample;
            while let Some(vertex) = stack.pop() {
                let apart = (region.point(vertex as usize) - centre).squared() / (reach * reach);
                if apart >= 1.0 {
                    continue;
                }
                neighbours[vertex as usize].push(Neighbour {
                    vertex: sample,
                    weight: (1.0 - apart).powi(2),
                });
                for &next in around.of(vertex as usize) {
                    if reached_by[next as usize] != sample {
                        reached_by[next as usize] = sample;
                        stack.push(next);
                    }
                }
            }
        }
        Self { samples, neighbours }
    }

    /// The samples that surroundings are made of.
    pub(super) fn samples(&self) -> &[u32] {
        &self.samples
    }

    /// What lies around a vertex.
    pub(super) fn of(&self, vertex: u32) -> &[Neighbour] {
        &self.neighbours[vertex as usize]
    }
}

/// So many vertices of those that are seen, each as far from those before it as any: all of them, where they aren't more.
pub(super) fn spread(region: &TriMesh, is_seen: &[bool], wanted: usize) -> Vec<u32> {
    let seen: Vec<u32> = (0..)
        .zip(is_seen)
        .filter_map(|(v, &seen)| seen.then_some(v))
        .collect();
    if seen.len() <= wanted {
        return seen;
    }
    let mut apart = vec![f64::INFINITY; seen.len()];
    let mut samples = Vec::with_capacity(wanted);
    let mut next = 0;
    for _ in 0..wanted {
        samples.push(seen[next]);
        let centre = region.point(seen[next] as usize);
        let mut farthest = (-1.0, 0);
        for (i, (apart, &v)) in apart.iter_mut().zip(&seen).enumerate() {
            *apart = apart.min((region.point(v as usize) - centre).squared());
            if *apart > farthest.0 {
                farthest = (*apart, i);
            }
        }
        next = farthest.1;
    }
    samples.sort_unstable();
    samples
}
