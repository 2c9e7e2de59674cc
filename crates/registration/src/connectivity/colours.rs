//! Colour refinement (Weisfeiler and Leman 1968): vertices with different surroundings get different colours.
//!
//! A vertex starts with the numbers of triangles on its edges, and in every round takes in the colours of the
//! pairs of vertices that complete its triangles. Sums of well-mixed 64-bit numbers stand for multisets, so
//! the colours do not depend on any order. A collision can only make two vertices look alike that are not;
//! the matching then finds out.

use super::graph::Graph;
use job::{Job, JobError};

/// After so many rounds a colour describes all that lies within 16 edges: what is still alike is left to the
/// matching.
const ROUNDS: usize = 16;

/// The colours of two meshes after the same number of rounds.
pub(super) struct Colours {
    pub(super) original: Colouring,
    pub(super) suspect: Colouring,
}

pub(super) struct Colouring {
    pub(super) of_vertex: Vec<u64>,
    /// Vertices in use with their colours, sorted: a class is a run of equal colours.
    sorted: Vec<(u64, u32)>,
    /// For each connected part a number that isomorphic parts share.
    pub(super) of_part: Vec<u64>,
}

/// The colours of one mesh after some rounds.
pub(super) struct Refinement(Vec<u64>);

pub(super) fn refine(original: &Graph<'_>, suspect: &Graph<'_>, job: &Job) -> Result<Colours, JobError> {
    let (mut here, mut there) = (Refinement::start(original), Refinement::start(suspect));
    let mut classes = 0;
    for _round in 0..ROUNDS {
        let sorted = here.sorted(original);
        let count = sorted.chunk_by(|x, y| x.0 == y.0).count();
        job.go_on()?;
        if count == classes || enough(original, &sorted) {
            break;
        }
        classes = count;
        here.refine(original);
        there.refine(suspect);
    }
    Ok(Colours {
        original: Colouring::of(original, here),
        suspect: Colouring::of(suspect, there),
    })
}

impl Colours {
    /// How many vertices of the original have a colour that the suspect has too few of.
    pub(super) fn unmatched(&self) -> usize {
        let wanted = self.original.sorted.chunk_by(|x, y| x.0 == y.0);
        wanted
            .map(|class| class.len().saturating_sub(self.suspect.class(class[0].0).len()))
            .sum()
    }
}

impl Colouring {
    fn of(graph: &Graph<'_>, colours: Refinement) -> Self {
        let sorted = colours.sorted(graph);
        let Refinement(of_vertex) = colours;
        let mut of_part: Vec<u64> = graph
            .part_triangles
            .iter()
            .map(|&count| mix(count as u64))
            .collect();
        for (v, &colour) in of_vertex.iter().enumerate() {
            let part = &mut of_part[graph.part_of(v as u32)];
            *part = part.wrapping_add(mix(colour));
        }
        Self {
            sorted,
            of_vertex,
            of_part,
        }
    }

    /// The vertices of a colour, ascending.
    pub(super) fn class(&self, colour: u64) -> &[(u64, u32)] {
        let first = self.sorted.partition_point(|x| x.0 < colour);
        let rest = &self.sorted[first..];
        &rest[..rest.partition_point(|x| x.0 == colour)]
    }

    /// For each part the vertex with the rarest colour in the whole mesh; the first of several.
    pub(super) fn rarest(&self, graph: &Graph<'_>) -> Vec<Option<u32>> {
        let mut rarest = vec![(usize::MAX, u32::MAX); graph.parts.count];
        for class in self.sorted.chunk_by(|x, y| x.0 == y.0) {
            for &(_, v) in class {
                let slot = &mut rarest[graph.part_of(v)];
                *slot = (*slot).min((class.len(), v));
            }
        }
        rarest
            .into_iter()
            .map(|(size, v)| (size < usize::MAX).then_some(v))
            .collect()
    }
}

/// Whether every part has a vertex of unique colour, and every edge says how to go on from there.
fn enough(graph: &Graph<'_>, sorted: &[(u64, u32)]) -> bool {
    let mut unique = vec![false; graph.parts.count];
    for class in sorted.chunk_by(|x, y| x.0 == y.0) {
        if let &[(_, v)] = class {
            unique[graph.part_of(v)] = true;
        }
    }
    unique
        .iter()
        .zip(&graph.part_triangles)
        .all(|(&unique, &triangles)| unique || triangles == 0)
        && (0..graph.edges.count()).all(|e| graph.edges.triangles(e).len() <= 2)
}

impl Refinement {
    /// The colours before the first round.
    pub(super) fn start(graph: &Graph<'_>) -> Self {
        let mut colours = vec![0_u64; graph.mesh.vertex_count()];
        for (e, ends) in graph.edges.vertices().iter().enumerate() {
            let kind = mix(graph.edges.triangles(e).len() as u64);
            for &v in ends {
                colours[v as usize] = colours[v as usize].wrapping_add(kind);
            }
        }
        Self(colours)
    }

    /// The colour of a vertex.
    pub(super) fn of(&self, v: u32) -> u64 {
        self.0[v as usize]
    }

    /// One round.
    pub(super) fn refine(&mut self, graph: &Graph<'_>) {
        let Self(colours) = self;
        let mut next: Vec<u64> = colours.iter().map(|&c| mix(c)).collect();
        for triangle in graph.mesh.triangles() {
            let [a, b, c] = triangle.map(|v| mix(colours[v as usize] ^ OTHER));
            let others = [b.wrapping_add(c), c.wrapping_add(a), a.wrapping_add(b)];
            for (&v, pair) in triangle.iter().zip(others) {
                next[v as usize] = next[v as usize].wrapping_add(mix(pair));
            }
        }
        self.0 = next;
    }

    /// The vertices in use with their colours, sorted by colour.
    pub(super) fn sorted(&self, graph: &Graph<'_>) -> Vec<(u64, u32)> {
        let used = (0..self.0.len() as u32).filter(|&v| !graph.fan(v).is_empty());
        let mut sorted: Vec<_> = used.map(|v| (self.0[v as usize], v)).collect();
        sorted.sort_unstable();
        sorted
    }
}

/// Makes the colour of a neighbour count for something else than a vertex's own.
const OTHER: u64 = 0x5851_f42d_4c95_7f2d;

/// The finaliser of SplitMix64: a fixed bijection of 64-bit numbers in which every input bit moves every
/// output bit.
fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}
