//! DAME (Váša and Rus, *Dihedral Angle Mesh Error: a fast perception correlated distortion measure for fixed connectivity triangle
//! meshes*, SGP 2012).

use job::{Job, JobError};
use mesh::{Edges, TriMesh};
use serde::Serialize;

use super::dihedral::bends;
use crate::picture::visible_samples;
use crate::{Measurement, Metric, Needs, QualityError};

/// What is left of the weight of an edge where the surface is folded flat onto itself: κ = √(ln 0.2)/π.
const FOLDED: f64 = 0.2;

/// Samples along each side of a view in which visibility is counted.
const VIEW: usize = 512;

/// How much a triangle counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Visibility {
    /// By how much of it can be seen from around: as in the paper.
    #[default]
    Seen,
    /// All alike.
    Uniform,
}

/// How far two meshes of the same connectivity differ in how they bend at their edges, in radians.
///
/// > DAME = Σ |α_e − ᾱ_e| m_e (w_s + w_t) / Σ (w_s + w_t),  m_e = exp((κ α_e)²),  κ² = ln 0.2 / π²
///
/// over the edges e between two triangles s and t. α is the oriented dihedral angle of the reference, 0 where it is flat, from −π to
/// π; ᾱ that of the other mesh. m masks: where a surface is rough already, less is noticed. w is visibility: how many samples of
/// the triangle are seen from twelve directions, the corners of an icosahedron.
///
/// The sum is over the weights' own, so that the number and size of the views do not count. Not symmetric: the reference masks.
///
/// Edges that have no angle in either mesh (boundaries, non-manifold edges, triangles without area) do not count.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Dame {
    /// The error, in radians.
    pub error: f64,
    /// How many edges were compared.
    pub edges: usize,
}

impl Dame {
    /// Compares a mesh with a reference of the same triangles over the same vertices.
    ///
    /// ```
    /// use job::Job;
    /// use quality::{Dame, Visibility};
    /// let job = Job::default();
    /// let smooth = mesh::shapes::icosphere(3);
    /// let noisy = mesh::shapes::jittered(&smooth, 0.05, 1);
    /// assert_eq!(Dame::between(&smooth, &smooth, Visibility::Seen, &job)?.error, 0.0);
    /// assert!(Dame::between(&noisy, &smooth, Visibility::Seen, &job)?.error > 0.02);
    /// # Ok::<(), quality::QualityError>(())
    /// ```
    ///
    /// # Errors
    /// [`QualityError::Connectivity`] if the triangles differ; [`QualityError::Job`].
    pub fn between(
        distorted: &TriMesh,
        reference: &TriMesh,
        visibility: Visibility,
        job: &Job,
    ) -> Result<Self, QualityError> {
        same_connectivity(distorted, reference)?;
        let edges = Edges::of(reference);
        let (before, after) = (bends(reference, &edges), bends(distorted, &edges));
        let weights = match visibility {
            Visibility::Uniform => vec![1.0; reference.triangle_count()],
            Visibility::Seen => seen(reference, job)?,
        };
        let (mut sum, mut total, mut compared) = (0.0, 0.0, 0);
        for (e, angles) in before.into_iter().zip(after).enumerate() {
            let ((Some(alpha), Some(other)), [s, t]) = (angles, edges.triangles(e)) else {
                continue;
            };
            let weight = weights[*s as usize] + weights[*t as usize];
            let mask = (FOLDED.ln() * (alpha / std::f64::consts::PI).powi(2)).exp();
            sum += weight * mask * (alpha - other).abs();
            total += weight;
            compared += 1;
        }
        Ok(Self {
            error: if total > 0.0 { sum / total } else { 0.0 },
            edges: compared,
        })
    }
}

/// [`Dame`] as a metric.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DameMetric {
    /// How much each triangle counts.
    pub visibility: Visibility,
}

impl Metric for DameMetric {
    fn name(&self) -> &'static str {
        "dame"
    }

    fn needs(&self) -> Needs {
        Needs::SameConnectivity
    }

    fn measure(&self, reference: &TriMesh, other: &TriMesh, job: &Job) -> Result<Measurement, QualityError> {
        let Dame { error, edges } = Dame::between(other, reference, self.visibility, job)?;
        Ok(Measurement::new([
            ("error", error.into()),
            ("edges", edges.into()),
        ]))
    }
}

/// Whether two meshes have the same triangles over the same vertices, in the same order.
///
/// # Errors
/// [`QualityError::Connectivity`] says what the first difference is.
pub fn same_connectivity(a: &TriMesh, b: &TriMesh) -> Result<(), QualityError> {
    let counts = [
        (a.vertex_count(), b.vertex_count(), "vertices"),
        (a.triangle_count(), b.triangle_count(), "triangles"),
    ];
    for (x, y, what) in counts {
        if x != y {
            let difference = format!("{x} and {y} {what}");
            return Err(QualityError::Connectivity { difference });
        }
    }
    match a.triangles().iter().zip(b.triangles()).position(|(s, t)| s != t) {
        None => Ok(()),
        Some(t) => Err(QualityError::Connectivity {
            difference: format!("triangle {t} joins other vertices"),
        }),
    }
}

/// How many samples of each triangle are seen, over twelve views.
fn seen(mesh: &TriMesh, job: &Job) -> Result<Vec<f64>, JobError> {
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut counts = vec![0.0; mesh.triangle_count()];
    for (axes, (i, j)) in [(0, 1), (1, 2), (2, 0)].into_iter().enumerate() {
        for (x, y) in [(1.0, golden), (1.0, -golden), (-1.0, golden), (-1.0, -golden)] {
            let mut eye = [0.0; 3];
            (eye[i], eye[j]) = (x, y);
            for triangle in visible_samples(mesh, eye, VIEW) {
                counts[triangle as usize] += 1.0;
            }
            job.go_on()?;
        }
        job.progress((axes + 1) as f64 / 3.0)?;
    }
    Ok(counts)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::{Similarity, shapes};
    use proptest::prelude::*;

    /// A strip of two triangles over a unit square, folded along its diagonal by an angle.
    fn folded(angle: f64) -> TriMesh {
        let h = 0.5_f64.sqrt();
        let apex = [
            0.5 + h * 0.5_f64.sqrt() * angle.cos(),
            0.5 - h * 0.5_f64.sqrt() * angle.cos(),
            -h * angle.sin(),
        ];
        TriMesh::new(
            vec![[0.0; 3], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], apex],
            vec![[0, 1, 2], [1, 0, 3]],
        )
        .unwrap()
    }

    #[test]
    fn folding_one_edge_costs_its_angle_masked_by_the_angle_that_it_had() {
        for (before, after) in [(0.0, 0.3), (0.0, -0.3), (1.0, 1.2), (1.0, -0.5), (3.0, -3.0)] {
            let dame = Dame::between(
                &folded(after),
                &folded(before),
                Visibility::Uniform,
                &Job::default(),
            )
            .unwrap();
            let mask = 0.2_f64.powf((before / std::f64::consts::PI).powi(2));
            assert!(
                (dame.error - mask * (after - before).abs()).abs() < 1e-12,
                "{dame:?}"
            );
            assert_eq!(dame.edges, 1);
        }
    }

    #[test]
    fn nothing_costs_more_than_half_a_turn_twice_and_turning_both_inside_out_changes_nothing() {
        let smooth = shapes::bumpy_sphere(3, 2);
        for amount in [0.1, 0.5, 2.0] {
            let noisy = shapes::jittered(&smooth, amount, 3);
            let [there, turned] = [
                (noisy.clone(), smooth.clone()),
                (shapes::inside_out(&noisy), shapes::inside_out(&smooth)),
            ]
            .map(|(a, b)| {
                Dame::between(&a, &b, Visibility::Uniform, &Job::default())
                    .unwrap()
                    .error
            });
            assert!(0.0 < there && there < std::f64::consts::TAU, "{there}");
            assert!((there - turned).abs() < 1e-12, "{there} {turned}");
        }
    }

    #[test]
    fn what_can_not_be_seen_does_not_count() {
        let outside = shapes::scaled(&shapes::icosphere(2), 3.0);
        let inside = shapes::icosphere(2);
        let both = shapes::disjoint_union(&[outside.clone(), inside.clone()]);
        let crumpled = shapes::disjoint_union(&[outside, shapes::jittered(&inside, 0.2, 1)]);
        assert_eq!(
            Dame::between(&crumpled, &both, Visibility::Seen, &Job::default())
                .unwrap()
                .error,
            0.0
        );
        assert!(
            Dame::between(&crumpled, &both, Visibility::Uniform, &Job::default())
                .unwrap()
                .error
                > 0.05
        );
    }

    #[test]
    fn other_connectivity_is_refused_with_the_difference() {
        let cube = shapes::cube(1.0);
        let refused = |other: &TriMesh| {
            Dame::between(other, &cube, Visibility::Seen, &Job::default())
                .unwrap_err()
                .to_string()
        };
        assert!(refused(&shapes::tetrahedron()).contains("4 and 8 vertices"));
        assert!(refused(&shapes::inside_out(&cube)).contains("triangle 0"));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]

        #[test]
        fn noise_costs_the_more_the_stronger_and_moving_both_changes_nothing(seed in 0..99_u64, angles in prop::array::uniform4(-1.0..1.0_f64), scale in 0.01..100.0_f64) {
            let smooth = shapes::bumpy_sphere(3, seed);
            let [weak, strong] = [0.02, 0.1].map(|amount| shapes::jittered(&smooth, amount, seed));
            let error = |mesh: &TriMesh| Dame::between(mesh, &smooth, Visibility::Seen, &Job::default()).unwrap().error;
            prop_assert_eq!(error(&smooth), 0.0);
            prop_assert!(error(&weak) < error(&strong));
            let moved = Similarity { scale, translation: [1.0, 2.0, 3.0], ..Similarity::from_quaternion(angles) };
            let after = |visibility| Dame::between(&shapes::moved(&strong, &moved), &shapes::moved(&smooth, &moved), visibility, &Job::default()).unwrap().error;
            let before = Dame::between(&strong, &smooth, Visibility::Uniform, &Job::default()).unwrap().error;
            prop_assert!((after(Visibility::Uniform) - before).abs() < 1e-9);
            // The views do not turn with the mesh.
            prop_assert!((after(Visibility::Seen) / error(&strong) - 1.0).abs() < 0.1);
        }
    }
}
