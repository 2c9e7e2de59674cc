//! MSDM2 (Lavoué, *A multiscale metric for 3D mesh visual quality assessment*, SGP 2011).

use mesh::TriMesh;
use registration::Surface;
use serde::Serialize;

use super::balls::Balls;
use super::curvature::Bending;
use crate::QualityError;
use crate::work::{Observer, by_chunks, in_pool, unobserved};
use mesh::vector::{Vec3, cross, dot, norm, sub};

/// Radii of the windows over which curvature is compared, as fractions of the longest edge of the bounding box: the paper's 2ε, 3ε
/// and 4ε with ε = 0.5 %.
const WINDOWS: [f64; 3] = [0.010, 0.015, 0.020];

/// Radius over which curvature itself is measured, as a fraction of the window's, so that a window holds detail: 0.2, 0.3 and
/// 0.4 % of that edge, the radii of the author's implementation.
const CURVATURE: f64 = 0.2;

/// Standard deviation of the Gaussian weights in a window, as a fraction of its radius: the window ends where the weight is 1 %.
const DEVIATION: f64 = 1.0 / 3.0;

/// K, which keeps the three terms stable where there is no curvature.
const STABILITY: f64 = 1.0;

/// Weights of luminance-like, contrast-like and structure-like terms, α = β = 1 and γ = 1/2 over their sum.
const TERMS: [f64; 3] = [0.4, 0.4, 0.2];

/// Exponent of the Minkowski sum over the surface.
const POOLING: f64 = 3.0;

/// Vertices that one task works on.
const CHUNK: usize = 4096;

/// How much of the distortion between two meshes people notice, from 0 (none) towards 1 (all is changed).
///
/// Curvature amplitudes (|k_1| + |k_2|)/2, scaled by the longest edge of the reference's bounding box, are compared in windows
/// around each vertex v of one mesh: in the window's vertices, and where these lie on the other mesh (nearest points). With means
/// μ, deviations σ and covariance under Gaussian weights,
///
/// > L = |μ − μ̂| / (max(μ, μ̂) + K),  C = |σ − σ̂| / (max(σ, σ̂) + K),  S = |σ σ̂ − cov| / (σ σ̂ + K),  K = 1,
///
/// the local distortion is 0.4 L + 0.4 C + 0.2 S, averaged over windows of radius 1, 1.5 and 2 % of that longest edge; the global
/// one its Minkowski sum of exponent 3 over the surface, weighted by area. Connectivities may differ; the meshes must be in the
/// same place and size.
///
/// Where this departs from the author's implementation: windows hold whole vertices (it adds points where edges leave the window),
/// and curvature is never measured over less than the edges at a vertex.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Msdm2 {
    /// From the distorted mesh to the reference.
    pub forward: f64,
    /// From the reference to the distorted mesh.
    pub backward: f64,
    /// Their mean: the symmetric MSDM2.
    pub symmetric: f64,
    /// The local distortion at each vertex of the distorted mesh.
    #[serde(skip)]
    pub local: Vec<f64>,
}

impl Msdm2 {
    /// Compares both ways.
    ///
    /// ```
    /// let smooth = mesh::shapes::icosphere(4);
    /// let [slightly, badly] = [0.01, 0.1].map(|amount| mesh::shapes::jittered(&smooth, amount, 1));
    /// let noticed = |distorted| quality::Msdm2::between(distorted, &smooth, 1).unwrap().symmetric;
    /// assert!(noticed(&smooth) < 1e-9 && noticed(&slightly) < noticed(&badly));
    /// ```
    ///
    /// # Errors
    /// [`QualityError::NoSurface`] if a mesh has no area.
    pub fn between(distorted: &TriMesh, reference: &TriMesh, threads: usize) -> Result<Self, QualityError> {
        Self::between_observed(distorted, reference, threads, &unobserved)
    }

    /// As [`between`](Self::between), watched.
    ///
    /// # Errors
    /// As [`between`](Self::between), and [`QualityError::Cancelled`].
    pub fn between_observed(
        distorted: &TriMesh,
        reference: &TriMesh,
        threads: usize,
        observer: Observer<'_>,
    ) -> Result<Self, QualityError> {
        for mesh in [distorted, reference] {
            let area = mesh.area();
            if !area.is_normal() {
                return Err(QualityError::NoSurface { area });
            }
        }
        let size = reference.bounding_box().size().into_iter().fold(0.0, f64::max);
        in_pool(threads, || {
            let sides = [distorted, reference].map(Bending::new);
            let across = [
                Matched::new(distorted, reference, &|done| observer(0.05 * done))?,
                Matched::new(reference, distorted, &|done| observer(0.05 + 0.05 * done))?,
            ];
            let mut local = [
                vec![0.0; distorted.vertex_count()],
                vec![0.0; reference.vertex_count()],
            ];
            for (scale, window) in WINDOWS.into_iter().enumerate() {
                let begun = 0.1 + 0.3 * scale as f64;
                let part = |from: f64| move |done: f64| observer(begun + from + 0.075 * done);
                let radius = window * size;
                let amplitudes = [
                    sides[0].amplitudes(CURVATURE * radius, &part(0.0))?,
                    sides[1].amplitudes(CURVATURE * radius, &part(0.075))?,
                ]
                .map(|k| k.into_iter().map(|k| k * size).collect::<Vec<f64>>());
                for (here, there) in [(0, 1), (1, 0)] {
                    let seen = across[here].interpolate(&amplitudes[there]);
                    let watch = part(0.15 + 0.075 * here as f64);
                    let distortions = sides[here].distortions(radius, &amplitudes[here], &seen, &watch)?;
                    for (sum, distortion) in local[here].iter_mut().zip(distortions) {
                        *sum += distortion / WINDOWS.len() as f64;
                    }
                }
            }
            let (forward, backward) = (pooled(distorted, &local[0]), pooled(reference, &local[1]));
            let [local, _] = local;
            Ok(Self {
                forward,
                backward,
                symmetric: 0.5 * (forward + backward),
                local,
            })
        })
    }
}

/// Where the vertices of one mesh lie on another: corners of a triangle with barycentric weights.
struct Matched {
    places: Vec<([u32; 3], [f64; 3])>,
}

impl Matched {
    fn new(from: &TriMesh, to: &TriMesh, observer: Observer<'_>) -> Result<Self, QualityError> {
        let surface = Surface::new(to);
        let places = crate::work::map(from.vertex_count(), observer, |v| {
            let nearest = surface.nearest(from.positions()[v]);
            let corners = to.corners(nearest.triangle as usize);
            (
                to.triangles()[nearest.triangle as usize],
                barycentric(corners, nearest.point),
            )
        })?;
        Ok(Self { places })
    }

    fn interpolate(&self, values: &[f64]) -> Vec<f64> {
        let at = |(corners, weights): &([u32; 3], [f64; 3])| {
            (0..3).map(|i| weights[i] * values[corners[i] as usize]).sum()
        };
        self.places.iter().map(at).collect()
    }
}

/// The weights of the corners at a point of the triangle; those of the nearest corner if it has no area.
fn barycentric(corners: [Vec3; 3], p: Vec3) -> [f64; 3] {
    let [a, b, c] = corners;
    let normal = cross(sub(b, a), sub(c, a));
    let square = dot(normal, normal);
    let part = |from: Vec3, to: Vec3| dot(cross(sub(to, from), sub(p, from)), normal) / square;
    let weights = [part(b, c), part(c, a), part(a, b)].map(|w| w.clamp(0.0, 1.0));
    let sum: f64 = weights.iter().sum();
    if sum.is_finite() && sum > 0.0 {
        return weights.map(|w| w / sum);
    }
    let nearest = (0..3).min_by(|&i, &j| norm(sub(corners[i], p)).total_cmp(&norm(sub(corners[j], p))));
    let mut weights = [0.0; 3];
    weights[nearest.unwrap_or(0)] = 1.0;
    weights
}

impl Bending<'_> {
    /// The local distortion at each vertex for one window radius; `own` are amplitudes here, `seen` those at the same places of the
    /// other mesh.
    fn distortions(
        &self,
        radius: f64,
        own: &[f64],
        seen: &[f64],
        observer: Observer<'_>,
    ) -> Result<Vec<f64>, QualityError> {
        let chunks = by_chunks(self.mesh.vertex_count(), CHUNK, observer, |vertices| {
            let mut balls = Balls::new(self.mesh, &self.edges, &self.star);
            let mut local = Vec::with_capacity(vertices.len());
            for v in vertices {
                let centre = self.mesh.positions()[v];
                let weight = |&u: &u32| {
                    let d = norm(sub(self.mesh.positions()[u as usize], centre)) / (DEVIATION * radius);
                    (u as usize, (-0.5 * d * d).exp())
                };
                let window: Vec<(usize, f64)> = balls.around(v as u32, radius).iter().map(weight).collect();
                local.push(distortion(&window, own, seen));
            }
            local
        })?;
        Ok(chunks.concat())
    }
}

/// 0.4 L + 0.4 C + 0.2 S over a window of vertices with weights.
fn distortion(window: &[(usize, f64)], x: &[f64], y: &[f64]) -> f64 {
    let total: f64 = window.iter().map(|(_, w)| w).sum();
    let mean = |f: &dyn Fn(usize) -> f64| window.iter().map(|&(u, w)| w * f(u)).sum::<f64>() / total;
    let (mx, my) = (mean(&|u| x[u]), mean(&|u| y[u]));
    let sx = mean(&|u| (x[u] - mx).powi(2)).sqrt();
    let sy = mean(&|u| (y[u] - my).powi(2)).sqrt();
    let covariance = mean(&|u| (x[u] - mx) * (y[u] - my));
    let terms = [
        (mx - my).abs() / (mx.max(my) + STABILITY),
        (sx - sy).abs() / (sx.max(sy) + STABILITY),
        (sx * sy - covariance).abs() / (sx * sy + STABILITY),
    ];
    TERMS.iter().zip(terms).map(|(weight, term)| weight * term).sum()
}

/// (Σ aᵢ dᵢ³ / Σ aᵢ)^⅓ with a third of the area around each vertex as aᵢ.
fn pooled(mesh: &TriMesh, local: &[f64]) -> f64 {
    let (mut sum, mut total) = (0.0, 0.0);
    for (t, corners) in mesh.triangles().iter().enumerate() {
        let share = mesh.triangle_area(t) / 3.0;
        for &v in corners {
            sum += share * local[v as usize].powf(POOLING);
            total += share;
        }
    }
    (sum / total).powf(1.0 / POOLING)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::{Similarity, shapes};
    use proptest::prelude::*;

    #[test]
    fn more_noise_is_noticed_more_and_the_symmetric_value_is_the_mean_of_both_ways() {
        let smooth = shapes::bumpy_torus(96, 60, 4);
        let mut last = 0.0;
        for amount in [0.0, 0.02, 0.05, 0.1, 0.2] {
            let noisy = shapes::jittered(&smooth, amount, 2);
            let value = Msdm2::between(&noisy, &smooth, 2).unwrap();
            assert_eq!(value.symmetric, 0.5 * (value.forward + value.backward));
            assert!(value.symmetric > last || amount == 0.0, "{amount} {value:?}");
            assert!(value.local.iter().all(|d| (0.0..1.2).contains(d)));
            let back = Msdm2::between(&smooth, &noisy, 1).unwrap();
            assert!((back.symmetric - value.symmetric).abs() < 0.05 * value.symmetric + 1e-12);
            last = value.symmetric;
        }
    }

    #[test]
    fn the_same_surface_with_other_triangles_is_nearer_than_a_noisy_one() {
        let flat = shapes::rectangle(30, 30, 1.0, 1.0);
        let other = shapes::rectangle(41, 23, 1.0, 1.0);
        assert!(Msdm2::between(&other, &flat, 1).unwrap().symmetric < 1e-12);
        let noisy = shapes::jittered(&flat, 0.1, 1);
        assert!(Msdm2::between(&noisy, &flat, 1).unwrap().symmetric > 0.01);
    }

    #[test]
    fn surfaces_without_area_are_refused() {
        let flat = TriMesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]], vec![[0, 1, 2]]).unwrap();
        let refused = Msdm2::between(&flat, &shapes::cube(1.0), 1);
        assert!(matches!(refused, Err(QualityError::NoSurface { .. })));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(8))]

        #[test]
        fn identical_meshes_have_none_and_scaling_and_shifting_both_changes_nothing(seed in 0..99_u64, scale in 0.01..100.0_f64) {
            let a = shapes::bumpy_sphere(3, seed);
            prop_assert!(Msdm2::between(&a, &a, 1).unwrap().symmetric < 1e-7);
            let b = shapes::jittered(&a, 0.1, seed);
            let moved = Similarity { scale, translation: [1.0, -2.0, 3.0], ..Similarity::IDENTITY };
            let before = Msdm2::between(&b, &a, 1).unwrap();
            let after = Msdm2::between(&shapes::moved(&b, &moved), &shapes::moved(&a, &moved), 2).unwrap();
            prop_assert!((before.symmetric - after.symmetric).abs() < 1e-6);
        }
    }
}
