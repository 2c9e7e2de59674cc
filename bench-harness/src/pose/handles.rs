//! Surfaces dragged by handles, as rigid as possible (Sorkine and Alexa 2007).
//!
//! Around each vertex i the surface is turned by some Rᵢ; places p′ are sought for which Σ wᵢⱼ |p′ᵢ − p′ⱼ − Rᵢ (pᵢ − pⱼ)|² is least, over both ends of all edges with their cotangent weights: in turn the Rᵢ for given
//! places, and the places for given Rᵢ, by one factorised matrix.

use anyhow::Result;
use evaluation::attacks::random_similarity;
use faer::{
    Mat, Side,
    linalg::solvers::Solve,
    sparse::{SparseColMat, Triplet},
};
use mesh::{TriMesh, Vec3, shapes};
use mhb_core::Laplacian;

use super::skinning::turned;

/// So large a share of the length is held at either end.
const HELD: f64 = 0.1;
/// Turns and places are sought in turn so many times, which makes most of the way.
const ROUNDS: usize = 60;
/// How much a vertex is drawn to where it was, beside the weights of its edges: parts of which nothing is held go nowhere.
const DRAWN: f64 = 1e-8;
/// Weights of obtuse triangles are raised to so much, of needles lowered.
const WEIGHTS: [f64; 2] = [1e-3, 1e3];

/// A model of which one end is held, along its longest side, and the other is turned by so many degrees about a line across the middle; moved, turned and scaled as a whole, its vertices in another order.
pub(super) fn posed(mesh: &TriMesh, degrees: f64, seed: u64) -> Result<TriMesh> {
    let bounds = mesh.bounding_box();
    let size = bounds.size();
    let longest = (0..3).fold(
        0,
        |longest, axis| if size[axis] > size[longest] { axis } else { longest },
    );
    let (mut across, centre) = (Vec3::ZERO, Vec3(bounds.centre()));
    across[(longest + 1) % 3] = degrees.to_radians();
    let held = |v: usize| {
        let p = mesh.point(v);
        let height = (p[longest] - bounds.min[longest]) / size[longest];
        let turned = || centre + turned(p - centre, across);
        if height < HELD {
            Some(p)
        } else {
            (height > 1.0 - HELD).then(turned)
        }
    };
    let held: Vec<Option<Vec3>> = (0..mesh.vertex_count()).map(held).collect();
    let places = dragged(mesh, &held)?;
    let posed = mesh.with_positions(places.into_iter().map(Into::into).collect())?;
    Ok(shapes::shuffled(
        &shapes::moved(&posed, &random_similarity(&posed, seed)),
        seed,
    ))
}

/// The places of all vertices, those of the held ones being given.
fn dragged(mesh: &TriMesh, held: &[Option<Vec3>]) -> Result<Vec<Vec3>> {
    let edges = weighted_edges(mesh)?;
    let mut free = vec![None; held.len()];
    for (row, v) in (0..held.len()).filter(|&v| held[v].is_none()).enumerate() {
        free[v] = Some(row);
    }
    let count = free.iter().flatten().count();
    let mut diagonal = vec![DRAWN; count];
    let mut triplets = Vec::new();
    for &(v, w, weight) in &edges {
        for end in [v, w] {
            if let Some(row) = free[end] {
                diagonal[row] += weight;
            }
        }
        if let (Some(row), Some(column)) = (free[v], free[w]) {
            triplets.push(Triplet::new(row.max(column), row.min(column), -weight));
        }
    }
    triplets.extend(
        diagonal
            .iter()
            .enumerate()
            .map(|(row, &value)| Triplet::new(row, row, value)),
    );
    let matrix = SparseColMat::<usize, f64>::try_new_from_triplets(count, count, &triplets)?;
    let factor = matrix.sp_cholesky(Side::Lower)?;
    let identity: [Vec3; 3] = std::array::from_fn(|axis| {
        let mut column = Vec3::ZERO;
        column[axis] = 1.0;
        column
    });
    let mut turns = vec![identity; held.len()];
    let mut places: Vec<Vec3> = (0..held.len())
        .map(|v| held[v].unwrap_or(mesh.point(v)))
        .collect();
    for _ in 0..ROUNDS {
        let mut right = Mat::<f64>::zeros(count, 3);
        let mut add = |row: usize, x: Vec3| (0..3).for_each(|axis| right[(row, axis)] += x[axis]);
        for v in 0..held.len() {
            if let Some(row) = free[v] {
                add(row, mesh.point(v) * DRAWN);
            }
        }
        for &(v, w, weight) in &edges {
            let step = mesh.point(v) - mesh.point(w);
            let step = (rotated(&turns[v], step) + rotated(&turns[w], step)) * (0.5 * weight);
            for (end, other, step) in [(v, w, step), (w, v, step * -1.0)] {
                let Some(row) = free[end] else { continue };
                add(row, step + held[other].map_or(Vec3::ZERO, |place| place * weight));
            }
        }
        let solved = factor.solve(&right);
        for (place, row) in places.iter_mut().zip(&free) {
            if let Some(row) = *row {
                *place = Vec3(std::array::from_fn(|axis| solved[(row, axis)]));
            }
        }
        turn(&mut turns, mesh, &edges, &places);
    }
    Ok(places)
}

/// Each edge with its cotangent weight, the stiffness of it but for the sign.
fn weighted_edges(mesh: &TriMesh) -> Result<Vec<(usize, usize, f64)>> {
    let laplacian = Laplacian::cotangent(mesh)?;
    let entries = laplacian.stiffness().iter().filter(|(_, (v, w))| v < w);
    let edge = |(&entry, (v, w)): (&f64, (usize, usize))| (v, w, f64::clamp(-entry, WEIGHTS[0], WEIGHTS[1]));
    Ok(entries.map(edge).collect())
}

fn rotated(columns: &[Vec3; 3], x: Vec3) -> Vec3 {
    columns[0] * x[0] + columns[1] * x[1] + columns[2] * x[2]
}

/// Turns each vertex's surroundings on to where its edges went, by steps that end at the rotation of the polar decomposition (Müller and others 2016).
fn turn(turns: &mut [[Vec3; 3]], mesh: &TriMesh, edges: &[(usize, usize, f64)], places: &[Vec3]) {
    let mut covariances = vec![[Vec3::ZERO; 3]; turns.len()];
    for &(v, w, weight) in edges {
        let (before, after) = (mesh.point(v) - mesh.point(w), (places[v] - places[w]) * weight);
        for end in [v, w] {
            for (axis, column) in covariances[end].iter_mut().enumerate() {
                *column += after * before[axis];
            }
        }
    }
    for (columns, covariance) in turns.iter_mut().zip(&covariances) {
        for _ in 0..4 {
            let pairs = || columns.iter().zip(covariance);
            let along: f64 = pairs().map(|(r, a)| r.dot(*a)).sum();
            let step = pairs().map(|(r, a)| r.cross(*a)).sum::<Vec3>() / (along.abs() + f64::MIN_POSITIVE);
            if step.norm() < 1e-9 {
                break;
            }
            *columns = columns.map(|column| turned(column, step));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_held_as_it_would_lie_if_all_was_turned_turns_all() {
        let mesh = shapes::bumpy_torus(24, 16, 1);
        let turn = Vec3([0.3, -0.4, 0.2]);
        let held: Vec<Option<Vec3>> = (0..mesh.vertex_count())
            .map(|v| (v % 9 == 0).then(|| turned(mesh.point(v), turn)))
            .collect();
        let places = dragged(&mesh, &held).unwrap().into_iter().enumerate();
        let off = |(v, place): (usize, Vec3)| (place - turned(mesh.point(v), turn)).norm();
        let most = places.map(off).fold(0.0, f64::max);
        assert!(most < 1e-3 * mesh.bounding_box().diagonal(), "{most}");
    }

    #[test]
    fn one_end_stays_and_the_other_is_turned_and_edges_keep_their_lengths_nearly() {
        let mesh = shapes::bumpy_torus(48, 24, 1);
        let posed = posed(&mesh, 60.0, 1).unwrap();
        let mean = |mesh: &TriMesh| mesh.area().sqrt();
        let scale = mean(&posed) / mean(&mesh);
        let lengths = |mesh: &TriMesh, scale: f64| {
            let edges = weighted_edges(mesh).unwrap().into_iter();
            let mut lengths: Vec<f64> = edges
                .map(|(v, w, _)| (mesh.point(v) - mesh.point(w)).norm() / scale)
                .collect();
            lengths.sort_by(f64::total_cmp);
            lengths
        };
        let pairs = lengths(&mesh, 1.0).into_iter().zip(lengths(&posed, scale));
        let off: Vec<f64> = pairs.map(|(a, b)| (b / a - 1.0).abs()).collect();
        assert!(off.iter().sum::<f64>() / (off.len() as f64) < 0.05);
    }
}
