//! What becomes of an original on its way: the attacks of Table 4 and beyond, made here, so that thousands cost minutes.

use anyhow::Result;
use decimation::{Decimator, decimate};
use evaluation::attacks::random_similarity;
use job::Job;
use mesh::{Edges, Subdivision, TriMesh, Vec3, Welded, shapes};

use super::{
    draw::Draw,
    models::{across, bent, cut, turned, twisted, with},
};

/// What is asked of an attack.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Group {
    /// The paper's Table 4: 99.9 %.
    Table4,
    /// Crops: 99 %.
    Crop,
    /// Poses: 97 %.
    Pose,
    /// Nothing is asked.
    Beyond,
}

impl Group {
    pub(super) fn asked(self) -> Option<f64> {
        match self {
            Self::Table4 => Some(0.999),
            Self::Crop => Some(0.99),
            Self::Pose => Some(0.97),
            Self::Beyond => None,
        }
    }
}

/// An attack; every suspect is turned, scaled and moved at random afterwards.
pub(super) struct Attack {
    pub(super) name: &'static str,
    pub(super) group: Group,
    does: fn(&TriMesh, &mut Draw) -> Result<TriMesh>,
}

/// All of them.
pub(super) const ATTACKS: [Attack; 21] = [
    Attack {
        name: "similarity",
        group: Group::Table4,
        does: |mesh, _| Ok(mesh.clone()),
    },
    Attack {
        name: "noise 0.5 %",
        group: Group::Table4,
        does: |mesh, draw| Ok(noisy(mesh, 0.005, draw)),
    },
    Attack {
        name: "noise 0.1 %",
        group: Group::Table4,
        does: |mesh, draw| Ok(noisy(mesh, 0.001, draw)),
    },
    Attack {
        name: "Laplacian ×5",
        group: Group::Table4,
        does: |mesh, _| Ok(smoothed(mesh, &[0.9; 5])),
    },
    Attack {
        name: "Taubin ×10",
        group: Group::Table4,
        does: |mesh, _| Ok(smoothed(mesh, &[0.5, -0.53].repeat(10))),
    },
    Attack {
        name: "re-meshing",
        group: Group::Table4,
        does: |mesh, _| clustered(mesh),
    },
    Attack {
        name: "Loop",
        group: Group::Table4,
        does: |mesh, _| Ok(Subdivision::Loop.of(mesh)),
    },
    Attack {
        name: "simplified to 50 %",
        group: Group::Table4,
        does: |mesh, _| simplified(mesh, 0.5),
    },
    Attack {
        name: "simplified to 10 %",
        group: Group::Table4,
        does: |mesh, _| simplified(mesh, 0.1),
    },
    Attack {
        name: "simplified to 5 %",
        group: Group::Table4,
        does: |mesh, _| simplified(mesh, 0.05),
    },
    Attack {
        name: "simplified to 1 %",
        group: Group::Beyond,
        does: |mesh, _| simplified(mesh, 0.01),
    },
    Attack {
        name: "crop to 50 %",
        group: Group::Crop,
        does: |mesh, draw| Ok(cropped(mesh, 0.5, draw)),
    },
    Attack {
        name: "crop to 35 %",
        group: Group::Crop,
        does: |mesh, draw| Ok(cropped(mesh, 0.35, draw)),
    },
    Attack {
        name: "crop to 25 %",
        group: Group::Crop,
        does: |mesh, draw| Ok(cropped(mesh, 0.25, draw)),
    },
    Attack {
        name: "crop to 50 %, simplified to 10 %",
        group: Group::Beyond,
        does: |mesh, draw| simplified(&cropped(mesh, 0.5, draw), 0.1),
    },
    Attack {
        name: "crop to 50 %, re-meshed",
        group: Group::Beyond,
        does: |mesh, draw| clustered(&cropped(mesh, 0.5, draw)),
    },
    Attack {
        name: "crop to 25 %, re-meshed",
        group: Group::Beyond,
        does: |mesh, draw| clustered(&cropped(mesh, 0.25, draw)),
    },
    Attack {
        name: "one joint, 60°",
        group: Group::Pose,
        does: |mesh, draw| Ok(posed(mesh, 60.0, draw)),
    },
    Attack {
        name: "two joints, 45°",
        group: Group::Pose,
        does: |mesh, draw| Ok(posed(&posed(mesh, 45.0, draw), 45.0, draw)),
    },
    Attack {
        name: "bend 45°",
        group: Group::Pose,
        does: |mesh, _| Ok(bent(mesh, longest(mesh), 45.0)),
    },
    Attack {
        name: "twist 45°",
        group: Group::Pose,
        does: |mesh, _| Ok(twisted(mesh, longest(mesh), 45.0)),
    },
];

impl Attack {
    /// What comes of an original, moved at random.
    pub(super) fn on(&self, mesh: &TriMesh, seed: u64) -> Result<TriMesh> {
        let attacked = (self.does)(mesh, &mut Draw::new(23, seed))?;
        Ok(shapes::moved(&attacked, &random_similarity(&attacked, seed)))
    }
}

/// Each coordinate off by a uniform share of the box's edge, at most `amount`: the paper's noise.
fn noisy(mesh: &TriMesh, amount: f64, draw: &mut Draw) -> TriMesh {
    let bounds = mesh.bounding_box();
    let edges: [f64; 3] = std::array::from_fn(|axis| bounds.max[axis] - bounds.min[axis]);
    let positions = mesh
        .positions()
        .iter()
        .map(|p| std::array::from_fn(|axis| p[axis] + amount * edges[axis] * draw.between(-1.0, 1.0)));
    let positions: Vec<[f64; 3]> = positions.collect();
    mesh.with_positions(positions).unwrap_or_else(|_| mesh.clone())
}

/// Steps of the umbrella operator.
fn smoothed(mesh: &TriMesh, steps: &[f64]) -> TriMesh {
    let edges = Edges::of(mesh);
    let mut positions: Vec<Vec3> = mesh.positions().iter().map(|&p| Vec3(p)).collect();
    for step in steps {
        let (mut sums, mut counts) = (vec![Vec3::ZERO; positions.len()], vec![0.0; positions.len()]);
        for ends in edges.vertices() {
            let [a, b] = ends.map(|v| v as usize);
            sums[a] += positions[b];
            sums[b] += positions[a];
            counts[a] += 1.0;
            counts[b] += 1.0;
        }
        for (v, p) in positions.iter_mut().enumerate() {
            if counts[v] > 0.0 {
                *p += (sums[v] / counts[v] - *p) * *step;
            }
        }
    }
    let positions = positions.into_iter().map(|p| p.0).collect();
    mesh.with_positions(positions).unwrap_or_else(|_| mesh.clone())
}

/// Other vertices and triangles: all vertices of a cell of a grid of 80 along the diagonal are one, at their mean.
fn clustered(mesh: &TriMesh) -> Result<TriMesh> {
    use std::collections::HashMap;
    let bounds = mesh.bounding_box();
    let cell = bounds.diagonal() / 80.0;
    // Where triangles are larger than cells they are cut first.
    let mut fine = mesh.clone();
    while fine.triangle_count() < 40_000 {
        fine = shapes::divided(&fine);
    }
    let mut cells: HashMap<[i64; 3], (Vec3, f64, u32)> = HashMap::new();
    let mut cluster = Vec::with_capacity(fine.vertex_count());
    for &p in fine.positions() {
        let key = std::array::from_fn(|axis| ((p[axis] - bounds.min[axis]) / cell).floor() as i64);
        let next = cells.len() as u32;
        let own = cells.entry(key).or_insert((Vec3::ZERO, 0.0, next));
        own.0 += Vec3(p);
        own.1 += 1.0;
        cluster.push(own.2);
    }
    let mut positions = vec![[0.0; 3]; cells.len()];
    for (sum, count, number) in cells.into_values() {
        positions[number as usize] = (sum / count).0;
    }
    let merged = fine
        .triangles()
        .iter()
        .map(|corners| corners.map(|v| cluster[v as usize]));
    let mut triangles: Vec<[u32; 3]> = merged.filter(|[a, b, c]| a != b && b != c && c != a).collect();
    let sorted = |corners: &[u32; 3]| {
        let mut corners = *corners;
        corners.sort_unstable();
        corners
    };
    triangles.sort_by_key(sorted);
    triangles.dedup_by_key(|corners| sorted(corners));
    Ok(Welded::new(&positions, &triangles)?.into_mesh())
}

/// Quadric error metrics, as fast-simplification has them, to a share of the triangles.
fn simplified(mesh: &TriMesh, share: f64) -> Result<TriMesh> {
    let target = ((mesh.triangle_count() as f64 * share) as usize).max(4);
    Ok(decimate(mesh, target, Decimator::Threshold, &Job::default())?)
}

/// A plane in a random direction leaves a share of the vertices.
fn cropped(mesh: &TriMesh, share: f64, draw: &mut Draw) -> TriMesh {
    cut(mesh, draw.direction(), share).unwrap_or_else(|| mesh.clone())
}

/// A limb is turned about a joint, smoothly over a tenth of the model: linear blend skinning of one joint. Joints are where models are thin: of 32 planes that leave a tenth to two fifths of the
/// model beyond them, it is the one at which the model is thinnest.
fn posed(mesh: &TriMesh, degrees: f64, draw: &mut Draw) -> TriMesh {
    let points: Vec<Vec3> = mesh.positions().iter().map(|&p| Vec3(p)).collect();
    let step = points.len().div_ceil(3000);
    let plane = |draw: &mut Draw| {
        let axis = draw.direction();
        let mut heights: Vec<f64> = points.iter().step_by(step).map(|p| p.dot(axis)).collect();
        heights.sort_by(f64::total_cmp);
        let place = heights[(heights.len() as f64 * draw.between(0.6, 0.9)) as usize];
        (axis, place)
    };
    let width = 0.05 * mesh.bounding_box().diagonal();
    let near = |axis: Vec3, place: f64| -> Vec<Vec3> {
        let all = points.iter().copied();
        all.filter(|p| (p.dot(axis) - place).abs() < width).collect()
    };
    let middle = |near: &[Vec3]| near.iter().copied().sum::<Vec3>() / near.len() as f64;
    let thickness = |near: &[Vec3]| {
        let centre = middle(near);
        near.iter().map(|&p| (p - centre).squared()).sum::<f64>() / near.len() as f64
    };
    let mut thinnest: Option<(f64, Vec3, f64, Vec3)> = None;
    for _ in 0..32 {
        let (axis, place) = plane(draw);
        let near = near(axis, place);
        if near.len() < 8 {
            continue;
        }
        let found = thickness(&near);
        if thinnest.is_none_or(|(least, ..)| found < least) {
            thinnest = Some((found, axis, place, middle(&near)));
        }
    }
    let Some((_, axis, place, centre)) = thinnest else {
        return mesh.clone();
    };
    let hinge = turned(across(axis), axis, draw.between(0.0, std::f64::consts::TAU));
    with(mesh, |p| {
        let share = ((p.dot(axis) - place) / (2.0 * width)).clamp(-0.5, 0.5) + 0.5;
        let smooth = share * share * (3.0 - 2.0 * share);
        centre + turned(p - centre, hinge, degrees.to_radians() * smooth)
    })
}

/// The direction of the longest edge of the box.
fn longest(mesh: &TriMesh) -> Vec3 {
    let bounds = mesh.bounding_box();
    let edge = |axis: usize| bounds.max[axis] - bounds.min[axis];
    let axis = (0..3).fold(
        0,
        |longest, axis| if edge(axis) > edge(longest) { axis } else { longest },
    );
    let mut direction = Vec3::ZERO;
    direction[axis] = 1.0;
    direction
}
