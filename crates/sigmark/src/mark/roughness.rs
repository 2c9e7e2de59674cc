//! How rough a surface is, and how much more of a mark it takes for that: a bump among bumps is not seen, and one on a smooth cheek is, when a
//! highlight passes over it.

use mesh::{TriMesh, Vec3};

use super::Original;

/// How the strength of a mark grows with roughness. With 1 the smooth parts of a model show less still, and what is read after decimation is
/// 4 to 15 % weaker; with 1/2 it is 2 to 6 % (T₀; horse and bunny), for the most part of the gain.
const GROWTH: f64 = 0.5;

/// The strength of a patch in relation to that of the one of median roughness, or its inverse, is at most this.
const MOST: f64 = 2.0;

/// How strongly each patch is marked in relation to the others.
pub(super) fn weights(original: &Original) -> Vec<f64> {
    let patches = original.patches().iter();
    let roughness: Vec<f64> = patches.map(|patch| roughness(patch.mesh())).collect();
    let mut sorted = roughness.clone();
    sorted.sort_by(f64::total_cmp);
    let median = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
    let weight = |roughness: f64| (roughness / median).powf(GROWTH).clamp(1.0 / MOST, MOST);
    roughness
        .into_iter()
        .map(|roughness| if median > 0.0 { weight(roughness) } else { 1.0 })
        .collect()
}

/// The root mean square sine of half the angle between a triangle's normal and the mean normal at one of its corners, over the area.
fn roughness(mesh: &TriMesh) -> f64 {
    let normal = |t: usize| {
        let [a, b, c] = mesh.corners(t);
        (b - a).cross(c - a)
    };
    let mut around = vec![Vec3::ZERO; mesh.vertex_count()];
    for (t, triangle) in mesh.triangles().iter().enumerate() {
        triangle.iter().for_each(|&v| around[v as usize] += normal(t));
    }
    let (mut squares, mut area) = (0.0, 0.0);
    for (t, triangle) in mesh.triangles().iter().enumerate() {
        let normal = normal(t);
        let weight = normal.norm();
        for &v in triangle {
            squares += weight * (normal.unit() - around[v as usize].unit()).squared() / 4.0;
            area += weight;
        }
    }
    if area > 0.0 { (squares / area).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes;

    #[test]
    fn a_plane_is_smooth_and_noise_is_rough_whatever_its_size() {
        let plane = shapes::rectangle(20, 20, 1.0, 1.0);
        assert!(roughness(&plane) < 1e-7);
        let rough = shapes::jittered(&shapes::icosphere(4), 0.5, 1);
        assert!(roughness(&rough) > 2.0 * roughness(&shapes::icosphere(4)));
        let scaled = roughness(&shapes::scaled(&rough, 1e3));
        assert!((scaled / roughness(&rough) - 1.0).abs() < 1e-12);
    }
}
