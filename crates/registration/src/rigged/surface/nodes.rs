//! A rig for a model that has none: nodes all over its surface, each of which moves what lies around it.

use std::{cmp::Reverse, collections::BinaryHeap};

use job::{Job, JobError};
use mesh::{Components, Edges, Rig, Surface, TriMesh, Vec3, VertexStars, components};

/// How nodes are spread.
#[derive(Clone, Copy)]
pub(super) struct Spread {
    pub(super) nodes: usize,
    /// How far a node moves vertices, beside how far the vertex is from its node that is farthest from any.
    pub(super) reach: f64,
    /// Weights fall as (1 − d²)ᵖ, d from 0 to 1 there.
    pub(super) power: i32,
}

/// With fewer vertices to a node than this, nodes could move them one by one.
const FEWEST_VERTICES: usize = 8;

/// Nodes of a mesh, and what each moves.
pub(super) struct Nodes {
    pub(super) rig: Rig,
    /// The vertex of each node.
    pub(super) vertices: Vec<u32>,
}

impl Nodes {
    /// Nodes over the largest connected part, each as far along the edges from those before it as any vertex; other parts move as what is nearest to them there. None where that has too few vertices.
    pub(super) fn over(mesh: &TriMesh, spread: Spread, job: &Job) -> Result<Option<Self>, JobError> {
        let ways = Ways {
            mesh,
            around: Edges::of(mesh).neighbours(),
        };
        let parts = components(mesh);
        let largest = (0..parts.count)
            .max_by_key(|&part| parts.sizes[part])
            .unwrap_or(0) as u32;
        let own = |v: &u32| parts.of_vertex[*v as usize] == largest;
        let own: Vec<u32> = (0..mesh.vertex_count() as u32).filter(own).collect();
        if own.len() < FEWEST_VERTICES * spread.nodes {
            return Ok(None);
        }
        let (vertices, farthest) = ways.spread(&own, spread.nodes, job)?;
        let reach = spread.reach * farthest;
        let mut weights = vec![Vec::new(); mesh.vertex_count()];
        let mut apart = vec![f64::INFINITY; mesh.vertex_count()];
        for (node, &vertex) in (0..).zip(&vertices) {
            job.go_on()?;
            for v in ways.within(vertex, reach, &mut apart) {
                let beside = apart[v as usize] / reach;
                weights[v as usize].push((node, (1.0 - beside * beside).powi(spread.power)));
                apart[v as usize] = f64::INFINITY;
            }
        }
        if parts.count > 1 {
            follow(mesh, &parts, largest, &mut weights);
        }
        let rig = Rig::new(&weights);
        Ok((rig.joints() == vertices.len()).then_some(Self { rig, vertices }))
    }
}

/// Gives each vertex of other parts the weights of the nearest vertex of the largest.
fn follow(mesh: &TriMesh, parts: &Components, largest: u32, weights: &mut [Vec<(u32, f64)>]) {
    let part_of = |v: u32| parts.of_vertex[v as usize];
    let own = mesh
        .triangles()
        .iter()
        .filter(|corners| part_of(corners[0]) == largest);
    let Ok(part) = TriMesh::new(mesh.positions().to_vec(), own.copied().collect()) else {
        return;
    };
    let surface = Surface::new(&part);
    for v in (0..mesh.vertex_count() as u32).filter(|&v| part_of(v) != largest) {
        let near = surface.nearest(mesh.positions()[v as usize]);
        let foot = Vec3(near.point);
        let corners = part.triangles()[near.triangle as usize];
        let apart = |v: &u32| (mesh.point(*v as usize) - foot).squared();
        let nearest = corners.into_iter().min_by(|a, b| apart(a).total_cmp(&apart(b)));
        if let Some(nearest) = nearest {
            weights[v as usize] = weights[nearest as usize].clone();
        }
    }
}

/// Ways along the edges of a mesh (Dijkstra 1959).
struct Ways<'a> {
    mesh: &'a TriMesh,
    around: VertexStars,
}

impl Ways<'_> {
    /// So many of these vertices, each as far from those before it as any; and how far the vertex is from the nearest that is farthest from any.
    fn spread(&self, among: &[u32], count: usize, job: &Job) -> Result<(Vec<u32>, f64), JobError> {
        let mut apart = vec![f64::INFINITY; self.mesh.vertex_count()];
        let mut spread = Vec::with_capacity(count);
        let mut next = among.first().copied();
        let mut farthest = 0.0;
        while let Some(node) = next.filter(|_| spread.len() < count) {
            job.go_on()?;
            spread.push(node);
            self.go(node, f64::INFINITY, &mut apart, |_| {});
            let away = |v: &u32| apart[*v as usize];
            next = among
                .iter()
                .copied()
                .max_by(|a, b| away(a).total_cmp(&away(b)))
                .filter(|v| away(v) > 0.0);
            farthest = next.map_or(0.0, |v| away(&v));
        }
        Ok((spread, farthest))
    }

    /// The vertices within a reach of one, ascending, and in `apart`, which is infinite before, how far each is.
    fn within(&self, from: u32, reach: f64, apart: &mut [f64]) -> Vec<u32> {
        let mut met = Vec::new();
        self.go(from, reach, apart, |v| met.push(v));
        met.sort_unstable();
        met.dedup();
        met
    }

    /// Goes from a vertex to all within a reach to which no shorter way is known.
    fn go(&self, from: u32, reach: f64, apart: &mut [f64], mut meet: impl FnMut(u32)) {
        // Distances are not negative, and sort as their bits do.
        let mut open = BinaryHeap::from([(Reverse(0.0_f64.to_bits()), from)]);
        apart[from as usize] = 0.0;
        meet(from);
        while let Some((Reverse(bits), v)) = open.pop() {
            let here = f64::from_bits(bits);
            if here > apart[v as usize] {
                continue;
            }
            for &next in self.around.of(v as usize) {
                let step = (self.mesh.point(v as usize) - self.mesh.point(next as usize)).norm();
                let there = here + step;
                if there < reach && there < apart[next as usize] {
                    apart[next as usize] = there;
                    meet(next);
                    open.push((Reverse(there.to_bits()), next));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use mesh::{Similarity, shapes};

    use super::*;

    const SPREAD: Spread = Spread {
        nodes: 20,
        reach: 1.5,
        power: 2,
    };

    fn over(mesh: &TriMesh) -> Option<Nodes> {
        Nodes::over(mesh, SPREAD, &Job::default()).unwrap()
    }

    #[test]
    fn nodes_lie_apart_and_every_vertex_follows_those_around_it() {
        let mesh = shapes::bumpy_torus(60, 40, 1);
        let Nodes { rig, vertices } = over(&mesh).unwrap();
        assert_eq!((rig.joints(), vertices.len()), (20, 20));
        let apart = |a: u32, b: u32| (mesh.point(a as usize) - mesh.point(b as usize)).norm();
        for (i, &a) in vertices.iter().enumerate() {
            let heaviest = rig
                .weights_of(a as usize)
                .iter()
                .max_by(|a, b| a.1.total_cmp(&b.1));
            assert_eq!(heaviest.unwrap().0, i as u32);
            assert!(vertices[..i].iter().all(|&b| apart(a, b) > 0.1));
        }
        assert!((0..mesh.vertex_count()).all(|v| !rig.weights_of(v).is_empty()));
    }

    #[test]
    fn small_parts_follow_the_largest_and_small_meshes_have_no_nodes() {
        let body = shapes::bumpy_torus(60, 40, 1);
        let small = shapes::moved(
            &shapes::bumpy_sphere(1, 1),
            &Similarity {
                scale: 0.05,
                translation: body.positions()[700],
                ..Similarity::IDENTITY
            },
        );
        assert!(over(&small).is_none());
        let count = body.vertex_count() as u32;
        let others = small.triangles().iter().map(|corners| corners.map(|v| v + count));
        let both = TriMesh::new(
            body.positions()
                .iter()
                .chain(small.positions())
                .copied()
                .collect(),
            body.triangles().iter().copied().chain(others).collect(),
        )
        .unwrap();
        let rig = over(&both).unwrap().rig;
        let main = |v: usize| {
            let weights = rig.weights_of(v).iter();
            weights.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap().0
        };
        let near: Vec<u32> = (0..body.vertex_count())
            .filter(|&v| (body.point(v) - body.point(700)).norm() < 0.2)
            .map(main)
            .collect();
        assert!((count as usize..both.vertex_count()).all(|v| near.contains(&main(v))));
    }
}
