//! What lies around a vertex within a radius, along edges.

use mesh::{Edges, TriMesh};

use mesh::vector::{norm, sub};

/// The edges at each vertex.
pub(crate) struct Star {
    offsets: Vec<u32>,
    edges: Vec<u32>,
}

impl Star {
    pub(crate) fn new(mesh: &TriMesh, edges: &Edges) -> Self {
        let mut offsets = vec![0; mesh.vertex_count() + 1];
        for &v in edges.vertices().as_flattened() {
            offsets[v as usize + 1] += 1;
        }
        for v in 0..mesh.vertex_count() {
            offsets[v + 1] += offsets[v];
        }
        let mut next = offsets.clone();
        let mut star = vec![0; 2 * edges.count()];
        for (e, ends) in edges.vertices().iter().enumerate() {
            for &v in ends {
                star[next[v as usize] as usize] = e as u32;
                next[v as usize] += 1;
            }
        }
        Self { offsets, edges: star }
    }

    /// The edges at a vertex, ascending.
    pub(crate) fn of(&self, v: u32) -> &[u32] {
        &self.edges[self.offsets[v as usize] as usize..self.offsets[v as usize + 1] as usize]
    }
}

/// Finds the vertices in balls, one ball after the other, with the same memory.
pub(crate) struct Balls<'a> {
    mesh: &'a TriMesh,
    edges: &'a Edges,
    star: &'a Star,
    /// The number of the last ball that a vertex was in.
    last: Vec<u32>,
    ball: u32,
    inside: Vec<u32>,
}

impl<'a> Balls<'a> {
    pub(crate) fn new(mesh: &'a TriMesh, edges: &'a Edges, star: &'a Star) -> Self {
        Self {
            mesh,
            edges,
            star,
            last: vec![0; mesh.vertex_count()],
            ball: 0,
            inside: Vec::new(),
        }
    }

    /// The vertices nearer to `centre` than `radius` that paths of edges inside the ball join to it, itself first.
    pub(crate) fn around(&mut self, centre: u32, radius: f64) -> &[u32] {
        self.ball += 1;
        self.inside.clear();
        self.inside.push(centre);
        self.last[centre as usize] = self.ball;
        let middle = self.mesh.positions()[centre as usize];
        let mut next = 0;
        while let Some(&v) = self.inside.get(next) {
            next += 1;
            for &e in self.star.of(v) {
                let w = other_end(self.edges, e, v);
                let p = self.mesh.positions()[w as usize];
                if self.last[w as usize] != self.ball && norm(sub(p, middle)) < radius {
                    self.last[w as usize] = self.ball;
                    self.inside.push(w);
                }
            }
        }
        &self.inside
    }

    /// Whether a vertex was in the last ball.
    pub(crate) fn holds(&self, v: u32) -> bool {
        self.last[v as usize] == self.ball
    }
}

pub(crate) fn other_end(edges: &Edges, edge: u32, v: u32) -> u32 {
    let [a, b] = edges.vertices()[edge as usize];
    if a == v { b } else { a }
}
