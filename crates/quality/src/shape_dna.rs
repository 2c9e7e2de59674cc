//! Shape-DNA: the lower Laplace–Beltrami spectrum as a fingerprint of a shape (eqs. 22–24).

use job::Job;
use mesh::{TriMesh, components};
use mhb_core::{Laplacian, LaplacianKind, Mass, Spectrum, SpectrumOptions, SpectrumStage};
use serde::Serialize;

use crate::{Measurement, Metric, Needs, QualityError, Side};

/// How a Shape-DNA is computed.
#[derive(Clone, Debug, PartialEq)]
pub struct ShapeDnaOptions {
    /// m: how many eigenvalues, zeros not counted.
    pub count: usize,
    /// The mass matrix: full in the paper and in LaPy.
    pub mass: Mass,
}

impl Default for ShapeDnaOptions {
    fn default() -> Self {
        Self {
            count: 50,
            mass: Mass::Full,
        }
    }
}

/// Largest relative residual of an eigenpair; the eigenvalue is accurate to about its square.
const TOLERANCE: f64 = 1e-8;

/// Eigenfunctions of more numbers than this, 8 GiB, are refused.
const MOST_ENTRIES: usize = 1 << 30;

/// Eigenvalues 0, squared, times vertices: what it takes to keep eigenfunctions orthogonal to all constants. More than this, minutes, is refused.
const MOST_WORK: u64 = 1 << 40;

/// What frees eigenvalues from the size of the shape.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Normalisation {
    /// Division by the first non-zero eigenvalue, as in the paper.
    #[default]
    FirstEigenvalue,
    /// Multiplication by the area, as in LaPy.
    Area,
}

/// The m lowest non-zero eigenvalues of S h = λ B h (eq. 23 without its λ_0 = 0).
///
/// Every connected component has one eigenvalue 0; all are left out, so that λ_1 is the first that says something of the shape.
/// On one component this is the paper's numbering.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ShapeDna {
    eigenvalues: Vec<f64>,
    components: usize,
    area: f64,
}

impl ShapeDna {
    /// The Shape-DNA of a mesh. That no eigenvalue is missing is proved by inertia.
    ///
    /// See [`mhb_core`] for how, and what it costs.
    ///
    /// # Errors
    /// [`QualityError::TooFewEigenvalues`], [`QualityError::TooManyEigenvalues`], [`QualityError::TooManyComponents`], [`QualityError::Spectrum`] of surfaces without area or with
    /// unused vertices, and where extreme triangles leave a pair missing.
    pub fn of(mesh: &TriMesh, options: &ShapeDnaOptions, job: &Job) -> Result<Self, QualityError> {
        let laplacian = Laplacian::of(mesh, LaplacianKind::Cotangent, options.mass)?;
        let components = components(mesh).count;
        let pairs = SpectrumOptions {
            count: pairs(options.count, mesh.vertex_count(), components)?,
            tolerance: TOLERANCE,
            ..Default::default()
        };
        let spectrum = Spectrum::of_laplacian(&laplacian, &pairs, &job.within(SpectrumStage::Solving))?;
        Ok(Self {
            eigenvalues: spectrum.eigenvalues()[components..].to_vec(),
            components,
            area: laplacian.mass().iter().sum(),
        })
    }

    /// λ_1 ≤ … ≤ λ_m, in the inverse square of the mesh's unit.
    pub fn eigenvalues(&self) -> &[f64] {
        &self.eigenvalues
    }

    /// Connected components of the mesh: how many eigenvalues 0 were left out.
    pub fn components(&self) -> usize {
        self.components
    }

    /// The eigenvalues without the size of the shape.
    pub fn normalised(&self, normalisation: Normalisation) -> Vec<f64> {
        let unit = match normalisation {
            Normalisation::FirstEigenvalue => self.eigenvalues[0],
            Normalisation::Area => 1.0 / self.area,
        };
        self.eigenvalues.iter().map(|l| l / unit).collect()
    }

    /// d_{p,m} of eq. 24, the p-norm of the difference of the normalised eigenvalues; p ≥ 1.
    ///
    /// # Errors
    /// [`QualityError::Lengths`] if the two differ in m, [`QualityError::Option`] of another p.
    pub fn distance(&self, other: &Self, p: f64, normalisation: Normalisation) -> Result<f64, QualityError> {
        let (left, right) = (self.eigenvalues.len(), other.eigenvalues.len());
        if left != right {
            return Err(QualityError::Lengths { left, right });
        }
        if !(p >= 1.0 && p.is_finite()) {
            return Err(QualityError::Option {
                name: "p",
                value: p,
                range: "at least 1",
            });
        }
        let (x, y) = (self.normalised(normalisation), other.normalised(normalisation));
        let sum: f64 = x.iter().zip(&y).map(|(x, y)| (x - y).abs().powf(p)).sum();
        Ok(sum.powf(1.0 / p))
    }
}

/// d_{p,m} of eq. 24.
#[derive(Clone, Debug, PartialEq)]
pub struct ShapeDnaMetric {
    /// How both Shape-DNAs are computed; m is `options.count`.
    pub options: ShapeDnaOptions,
    /// p.
    pub p: f64,
    /// What frees eigenvalues from the size of the shapes.
    pub normalisation: Normalisation,
    /// The reference's Shape-DNA, where it is known already.
    pub reference: Option<ShapeDna>,
}

impl Default for ShapeDnaMetric {
    /// The paper's d_{2,50}.
    fn default() -> Self {
        Self {
            options: ShapeDnaOptions::default(),
            p: 2.0,
            normalisation: Normalisation::default(),
            reference: None,
        }
    }
}

impl Metric for ShapeDnaMetric {
    fn name(&self) -> &'static str {
        "shape_dna"
    }

    fn needs(&self) -> Needs {
        Needs::Nothing
    }

    fn measure(&self, reference: &TriMesh, other: &TriMesh, job: &Job) -> Result<Measurement, QualityError> {
        let of = |mesh: &TriMesh, side: Side, job: &Job| {
            ShapeDna::of(mesh, &self.options, job).map_err(|error| error.of(side))
        };
        let known = || match &self.reference {
            Some(known) => Ok(known.clone()),
            None => of(reference, Side::Reference, &job.quiet()),
        };
        let (known, own) = job.join(known, || of(other, Side::Other, job))?;
        let (known, own) = (known?, own?);
        Ok(Measurement::new([
            ("p", self.p.into()),
            ("m", self.options.count.into()),
            (
                "distance",
                own.distance(&known, self.p, self.normalisation)?.into(),
            ),
            ("components", [known.components, own.components].into()),
        ]))
    }
}

/// How many of the lowest pairs hold `count` that are not 0.
fn pairs(count: usize, vertices: usize, components: usize) -> Result<usize, QualityError> {
    let available = vertices - components;
    if count == 0 || count > available {
        return Err(QualityError::TooFewEigenvalues {
            count,
            vertices,
            components,
            available,
        });
    }
    let most = (MOST_ENTRIES / vertices).saturating_sub(components);
    if count > most {
        return Err(QualityError::TooManyEigenvalues {
            count,
            vertices,
            components,
            most,
        });
    }
    let most = (MOST_WORK / vertices as u64).isqrt() as usize;
    if components > most {
        return Err(QualityError::TooManyComponents {
            vertices,
            components,
            most,
        });
    }
    Ok(components + count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::{Similarity, shapes};
    use proptest::prelude::*;

    fn dna(mesh: &TriMesh, count: usize, mass: Mass) -> Vec<f64> {
        let dna = ShapeDna::of(mesh, &ShapeDnaOptions { count, mass }, &Job::default()).unwrap();
        dna.eigenvalues().to_vec()
    }

    fn agree(x: &[f64], y: &[f64], tolerance: f64) {
        assert_eq!(x.len(), y.len());
        for (x, y) in x.iter().zip(y) {
            assert!((x / y - 1.0).abs() < tolerance, "{x} {y}");
        }
    }

    /// With edges of length 2 every area is √3 and every cotangent 1/√3, so S = (4 I − J)/√3, B = √3/6 (2 I + J) and D = √3 I,
    /// where J is all ones: on the complement of constants λ = 4 and 4/3.
    #[test]
    fn the_regular_tetrahedron_has_the_eigenvalues_of_the_formula() {
        let tetrahedron = shapes::scaled(&shapes::tetrahedron(), 0.5_f64.sqrt());
        agree(&dna(&tetrahedron, 3, Mass::Full), &[4.0; 3], 1e-13);
        agree(&dna(&tetrahedron, 3, Mass::Lumped), &[4.0 / 3.0; 3], 1e-13);
    }

    #[test]
    fn eigenvalues_of_a_sphere_approach_those_of_the_formula_from_above() {
        let ball = dna(&shapes::icosphere(4), 8, Mass::Full);
        let exact = [2.0, 2.0, 2.0, 6.0, 6.0, 6.0, 6.0, 6.0];
        agree(&ball, &exact, 0.01);
        // Conforming elements overestimate; the mesh lies inside the sphere, which adds to it.
        assert!(ball.iter().zip(exact).all(|(l, exact)| *l > exact));
    }

    #[test]
    fn lumped_eigenvalues_are_those_of_the_manifold_harmonics() {
        let mesh = shapes::bumpy_torus(40, 30, 3);
        let options = mhb_core::SpectrumOptions {
            count: 31,
            ..Default::default()
        };
        let harmonics = mhb_core::Spectrum::compute(&mesh, &options, &Job::default()).unwrap();
        agree(
            &dna(&mesh, 30, Mass::Lumped),
            &harmonics.eigenvalues()[1..],
            1e-11,
        );
    }

    #[test]
    fn many_equal_pieces_have_each_eigenvalue_as_often_as_there_are_pieces() {
        let pieces = 90;
        let cubes = shapes::disjoint_union(&vec![shapes::cube(2.0); pieces]);
        let one = dna(&shapes::cube(2.0), 2, Mass::Full);
        let all = ShapeDna::of(
            &cubes,
            &ShapeDnaOptions {
                count: 95,
                ..Default::default()
            },
            &Job::default(),
        )
        .unwrap();
        assert_eq!(all.components(), pieces);
        agree(&all.eigenvalues()[..pieces], &vec![one[0]; pieces], 1e-9);
        agree(&all.eigenvalues()[pieces..], &[one[1]; 5], 1e-9);
    }

    #[test]
    fn what_has_no_shape_dna_is_refused() {
        let cube = shapes::cube(1.0);
        for count in [0, 8] {
            let refused = ShapeDna::of(
                &cube,
                &ShapeDnaOptions {
                    count,
                    ..Default::default()
                },
                &Job::default(),
            );
            assert!(matches!(
                refused,
                Err(QualityError::TooFewEigenvalues { available: 7, .. })
            ));
        }
        assert!(pairs(26_000, 40_962, 1).is_ok());
        let refused = pairs(30_000, 40_962, 1);
        assert!(
            matches!(
                refused,
                Err(QualityError::TooManyEigenvalues { most: 26_212, .. })
            ),
            "{refused:?}"
        );
        // A heap of unconnected triangles.
        assert!(pairs(50, 3 * 7_000, 7_000).is_ok());
        let refused = pairs(50, 3 * 10_000, 10_000).unwrap_err().to_string();
        assert!(
            refused.contains("10000 components") && refused.contains("6053"),
            "{refused}"
        );
        let refused = pairs(50, 3 * 100_000, 100_000).unwrap_err().to_string();
        assert!(refused.contains("100000 component(s)"), "{refused}");
        let mut positions = cube.positions().to_vec();
        positions.push([5.0; 3]);
        let unused = TriMesh::new(positions, cube.triangles().to_vec()).unwrap();
        assert!(matches!(
            ShapeDna::of(&unused, &ShapeDnaOptions::default(), &Job::default()),
            Err(QualityError::Spectrum(_))
        ));
        let [x, y] = [3, 4].map(|count| {
            ShapeDna::of(
                &cube,
                &ShapeDnaOptions {
                    count,
                    ..Default::default()
                },
                &Job::default(),
            )
            .unwrap()
        });
        assert_eq!(
            x.distance(&y, 2.0, Normalisation::Area),
            Err(QualityError::Lengths { left: 3, right: 4 })
        );
        assert!(x.distance(&x, 0.5, Normalisation::Area).is_err());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]

        #[test]
        fn the_distance_is_a_metric_that_similarity_transforms_do_not_change(seed in 0..99_u64, angles in prop::array::uniform4(-1.0..1.0_f64), scale in 0.01..100.0_f64, p in 1.0..4.0_f64) {
            let options = ShapeDnaOptions { count: 12, ..Default::default() };
            let of = |mesh: &TriMesh| ShapeDna::of(mesh, &options, &Job::default()).unwrap();
            let base = shapes::bumpy_sphere(3, seed);
            let moved = shapes::moved(&base, &Similarity { scale, translation: [1.0, 2.0, 3.0], ..Similarity::from_quaternion(angles) });
            let [a, b, c] = [of(&base), of(&shapes::bumpy_sphere(3, seed + 1)), of(&shapes::bumped(&base, 0.02, seed))];
            for normalisation in [Normalisation::FirstEigenvalue, Normalisation::Area] {
                let distance = |x: &ShapeDna, y: &ShapeDna| x.distance(y, p, normalisation).unwrap();
                prop_assert!(distance(&a, &of(&moved)) < 1e-9 * distance(&a, &b));
                prop_assert_eq!(distance(&a, &b), distance(&b, &a));
                prop_assert!(distance(&a, &b) <= distance(&a, &c) + distance(&c, &b) + 1e-12);
            }
        }
    }
}
