//! Our own linear blend skinning.

use anyhow::Result;
use evaluation::attacks::random_similarity;
use mesh::{
    Rig, TriMesh, Vec3,
    shapes::{self, turned},
};
use rand_chacha::{
    ChaCha20Rng,
    rand_core::{Rng, SeedableRng},
};

/// A model with every joint turned about the middle of what it shares with others, by up to so many degrees about an axis at random, and every morph target taken as far as a number from 0 to 1 says; moved, turned and scaled as a
/// whole, its vertices in another order, rounded to a grid of so many bits along the longest side.
pub(super) fn posed(
    mesh: &TriMesh,
    rig: &Rig,
    degrees: f64,
    seed: u64,
    bits: Option<u32>,
) -> Result<TriMesh> {
    let mut rng = ChaCha20Rng::seed_from_u64(seed);
    let mut uniform = || f64::from(rng.next_u32()) / f64::from(u32::MAX);
    let mut points: Vec<Vec3> = (0..mesh.vertex_count()).map(|v| mesh.point(v)).collect();
    for target in rig.targets() {
        let share = uniform();
        for &(vertex, offset) in target {
            points[vertex as usize] += Vec3(offset) * share;
        }
    }
    let turns: Vec<(Vec3, Vec3)> = pivots(&points, rig)
        .into_iter()
        .map(|pivot| {
            let axis = Vec3([0; 3].map(|_| 2.0 * uniform() - 1.0));
            let angle = degrees.to_radians() * (2.0 * uniform() - 1.0);
            (pivot, axis * (angle / axis.norm().max(1e-9)))
        })
        .collect();
    let place = |v: usize| -> [f64; 3] {
        let moved = rig.weights_of(v).iter().map(|&(joint, weight)| {
            let (pivot, turn) = turns[joint as usize];
            (pivot + turned(points[v] - pivot, turn)) * weight
        });
        match rig.weights_of(v) {
            [] => points[v].into(),
            _ => moved.sum::<Vec3>().into(),
        }
    };
    let posed = mesh.with_positions((0..points.len()).map(place).collect())?;
    let posed = shapes::shuffled(&shapes::moved(&posed, &random_similarity(&posed, seed)), seed);
    Ok(match bits {
        Some(bits) => rounded(&posed, bits)?,
        None => posed,
    })
}

/// Of each joint the middle of the vertices that it shares with others, or else of all its own.
fn pivots(points: &[Vec3], rig: &Rig) -> Vec<Vec3> {
    let mut sums = vec![[(Vec3([0.0; 3]), 0.0); 2]; rig.joints()];
    for (v, &point) in points.iter().enumerate() {
        for &(joint, weight) in rig.weights_of(v) {
            for (sum, share) in sums[joint as usize]
                .iter_mut()
                .zip([weight * (1.0 - weight), weight])
            {
                sum.0 += point * share;
                sum.1 += share;
            }
        }
    }
    let middle = |[shared, own]: [(Vec3, f64); 2]| {
        let (sum, share) = if shared.1 > 1e-9 * own.1 { shared } else { own };
        sum * (1.0 / share.max(f64::MIN_POSITIVE))
    };
    sums.into_iter().map(middle).collect()
}

fn rounded(mesh: &TriMesh, bits: u32) -> Result<TriMesh> {
    let bounds = mesh.bounding_box();
    let step = bounds.size().into_iter().fold(0.0, f64::max) / (2f64.powi(bits as i32) - 1.0);
    let round = |p: &[f64; 3]| {
        std::array::from_fn(|i| bounds.min[i] + ((p[i] - bounds.min[i]) / step).round() * step)
    };
    Ok(mesh.with_positions(mesh.positions().iter().map(round).collect())?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turning_keeps_lengths_and_the_same_seed_gives_the_same_pose() {
        let step = Vec3([0.3, -0.2, 0.9]);
        assert!((turned(step, Vec3([1.0, 2.0, -0.5])).norm() - step.norm()).abs() < 1e-12);
        let mesh = shapes::bumpy_torus(24, 16, 1);
        let rig = Rig::new(&vec![vec![(0, 1.0)]; mesh.vertex_count()]);
        let [one, again, other] = [3, 3, 4].map(|seed| posed(&mesh, &rig, 90.0, seed, Some(14)).unwrap());
        assert_eq!(one.positions(), again.positions());
        assert_ne!(one.positions(), other.positions());
    }
}
