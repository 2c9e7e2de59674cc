//! A rig as a tree of joints, and points of the surface that say where each is.

use mesh::{Rig, TriMesh, Vec3};

use super::Row;
use crate::{PreparedMesh, RegistrationError};

/// What a joint moves nearly alone, and the least share of what it moves most of which that is said.
const ALONE: f64 = 0.85;
const LEAST_ALONE: usize = 4;

/// Fewer triangles are not aligned by themselves.
const FEWEST_TRIANGLES: usize = 500;

/// A joint is told by what it moves so much more than what hangs on it does, or by so many samples of which that is truest.
const MUCH: f64 = 0.4;
const FEWEST: usize = 60;

/// Joints with less of a vertex do not have it.
const LEAST_SHARE: f64 = 0.05;

/// A vertex that stands for as much of the surface as any other.
pub(super) struct Sample<'a> {
    pub(super) row: Row<'a>,
    pub(super) normal: Vec3,
}

/// Where two joints move the same vertices, or vertices beside each other.
#[derive(Clone, Copy)]
pub(super) struct Link {
    pub(super) joints: [usize; 2],
    /// How much they share.
    pub(super) strength: f64,
    /// Where, in diagonals from the original's centre.
    pub(super) pivot: Vec3,
}

pub(super) struct Skeleton<'a> {
    rig: &'a Rig,
    pub(super) samples: Vec<Sample<'a>>,
    pub(super) links: Vec<Link>,
    /// The samples of each joint.
    pub(super) of_joint: Vec<Vec<usize>>,
    /// Those that it moves nearly alone, or a quarter, where these are fewer.
    pub(super) core_of_joint: Vec<Vec<usize>>,
    diagonal: f64,
    centre: Vec3,
}

impl<'a> Skeleton<'a> {
    pub(super) fn of(original: &PreparedMesh, rig: &'a Rig) -> Result<Self, RegistrationError> {
        let mesh = original.mesh();
        let sampled = original.sampled("original")?;
        let mut vertices: Vec<u32> = (0..sampled.points.len())
            .map(|i| nearest_corner(mesh, sampled.triangle(i), sampled.points[i]))
            .collect();
        vertices.sort_unstable();
        vertices.dedup();
        let mut skeleton = Self {
            rig,
            samples: Vec::with_capacity(vertices.len()),
            links: Vec::new(),
            of_joint: vec![Vec::new(); rig.joints()],
            core_of_joint: Vec::new(),
            diagonal: sampled.diagonal,
            centre: sampled.centroid,
        };
        for v in vertices.into_iter().map(|v| v as usize) {
            let weights = rig.weights_of(v);
            let Some(&(main, _)) = weights.iter().max_by(|a, b| a.1.total_cmp(&b.1)) else {
                continue;
            };
            skeleton.of_joint[main as usize].push(skeleton.samples.len());
            skeleton.samples.push(Sample {
                row: skeleton.row(mesh.point(v), weights),
                normal: Vec3(original.vertex_normals()[v]),
            });
        }
        let core = |(joint, own): (usize, &Vec<usize>)| {
            let share = |i: &usize| {
                let weights = &skeleton.samples[*i].row.weights;
                weights
                    .iter()
                    .find(|(j, _)| *j as usize == joint)
                    .map_or(0.0, |&(_, share)| share)
            };
            let mut core = own.clone();
            core.sort_by(|a, b| share(b).total_cmp(&share(a)));
            let alone = core.iter().filter(|i| share(i) > ALONE).count();
            core.truncate(alone.max(own.len() / LEAST_ALONE));
            core.sort_unstable();
            core
        };
        skeleton.core_of_joint = skeleton.of_joint.iter().enumerate().map(core).collect();
        skeleton.link(mesh);
        Ok(skeleton)
    }

    /// Joints that share samples; and where each vertex has one joint, as of robots, those on both sides of an edge.
    fn link(&mut self, mesh: &TriMesh) {
        let joints = self.rig.joints();
        let mut sums = vec![(0.0, Vec3::ZERO); joints * joints];
        let mut add = |a: u32, b: u32, shared: f64, at: Vec3| {
            let (strength, pivot) = &mut sums[a.min(b) as usize * joints + a.max(b) as usize];
            *strength += shared;
            *pivot += at * shared;
        };
        for sample in &self.samples {
            for (i, &(a, share_a)) in sample.row.weights.iter().enumerate() {
                for &(b, share_b) in &sample.row.weights[i + 1..] {
                    if share_a.min(share_b) > LEAST_SHARE {
                        add(a, b, share_a * share_b, sample.row.x);
                    }
                }
            }
        }
        let an_edge = self.samples.len() as f64 / mesh.vertex_count() as f64;
        for &[a, b, c] in mesh.triangles() {
            for [v, w] in [[a, b], [b, c], [c, a]] {
                if let (&[(here, _)], &[(there, _)]) =
                    (self.rig.weights_of(v as usize), self.rig.weights_of(w as usize))
                    && here != there
                {
                    let middle = (mesh.point(v as usize) + mesh.point(w as usize)) * 0.5;
                    add(here, there, an_edge, (middle - self.centre) / self.diagonal);
                }
            }
        }
        let pairs = sums
            .into_iter()
            .enumerate()
            .filter(|(_, (strength, _))| *strength > 0.0);
        self.links = pairs
            .map(|(pair, (strength, pivot))| Link {
                joints: [pair / joints, pair % joints],
                strength,
                pivot: pivot / strength,
            })
            .collect();
    }

    /// A vertex of the original by itself.
    pub(super) fn row(&self, point: Vec3, weights: &'a [(u32, f64)]) -> Row<'a> {
        Row {
            vertex: 0,
            x: (point - self.centre) / self.diagonal,
            y: Vec3::ZERO,
            weights,
            offsets: Vec::new(),
        }
    }

    pub(super) fn joints(&self) -> usize {
        self.rig.joints()
    }

    pub(super) fn diagonal(&self) -> f64 {
        self.diagonal
    }

    pub(super) fn centre(&self) -> Vec3 {
        self.centre
    }

    /// The samples that tell where a joint is while others hang on it: it moves them much, these little.
    pub(super) fn telling(&self, joint: usize, hanging: &[usize]) -> Vec<usize> {
        let mut sign = vec![0.0; self.joints()];
        hanging.iter().for_each(|&other| sign[other] = -1.0);
        sign[joint] = 1.0;
        let told = |sample: &Sample<'_>| -> f64 {
            let weights = sample.row.weights.iter();
            weights.map(|&(joint, share)| sign[joint as usize] * share).sum()
        };
        let told = self.samples.iter().map(told).zip(0..);
        let mut told: Vec<(f64, usize)> = told.filter(|(told, _)| *told > LEAST_SHARE).collect();
        told.sort_by(|a, b| b.0.total_cmp(&a.0));
        let much = told.iter().filter(|(told, _)| *told > MUCH).count();
        told.truncate(much.max(FEWEST));
        told.into_iter().map(|(_, i)| i).collect()
    }

    /// The joints that move most of the surface nearly alone, the first of them first.
    pub(super) fn largest(&self, count: usize) -> Vec<usize> {
        let mut joints: Vec<usize> = (0..self.joints()).collect();
        joints.sort_by_key(|&joint| std::cmp::Reverse(self.core_of_joint[joint].len()));
        joints.truncate(count);
        joints
    }

    /// The triangles of which a joint moves all corners nearly alone, or where these are few, more than any other does.
    pub(super) fn part(&self, mesh: &TriMesh, joint: usize) -> Option<TriMesh> {
        let main = |v: u32| {
            let weights = self.rig.weights_of(v as usize).iter();
            weights
                .max_by(|a, b| a.1.total_cmp(&b.1))
                .map(|&(main, _)| main as usize)
        };
        let alone = |v: u32| {
            let mut weights = self.rig.weights_of(v as usize).iter();
            weights.any(|&(other, share)| other as usize == joint && share > ALONE)
        };
        let of = |is_own: &dyn Fn(u32) -> bool| -> Vec<[u32; 3]> {
            let own = |corners: &&[u32; 3]| corners.iter().all(|&v| is_own(v));
            mesh.triangles().iter().filter(own).copied().collect()
        };
        let mut triangles = of(&alone);
        if triangles.len() < FEWEST_TRIANGLES {
            triangles = of(&|v| main(v) == Some(joint));
        }
        let mut numbers = vec![u32::MAX; mesh.vertex_count()];
        let mut positions = Vec::new();
        let mut number = |v: u32| {
            if numbers[v as usize] == u32::MAX {
                numbers[v as usize] = positions.len() as u32;
                positions.push(mesh.positions()[v as usize]);
            }
            numbers[v as usize]
        };
        let triangles = triangles
            .into_iter()
            .map(|corners| corners.map(&mut number))
            .collect();
        TriMesh::new(positions, triangles).ok()
    }
}

fn nearest_corner(mesh: &TriMesh, triangle: usize, p: Vec3) -> u32 {
    let corners = mesh.triangles()[triangle];
    let distance = |v: &u32| (mesh.point(*v as usize) - p).squared();
    corners
        .into_iter()
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
        .unwrap_or(corners[0])
}
