//! What all metrics have in common, so that programs and tables can ask any of them.

use job::Job;
use mesh::TriMesh;
use serde::{Serialize, Serializer};

use crate::QualityError;

/// A way to tell how far a mesh is from a reference.
///
/// ```
/// use job::Job;
/// use quality::{DameMetric, DistanceMetric, Metric, Msdm2Metric, ShapeDnaMetric};
///
/// let original = mesh::shapes::bumpy_sphere(3, 1);
/// let marked = mesh::shapes::jittered(&original, 0.05, 2);
/// let metrics: [&dyn Metric; 4] = [
///     &DistanceMetric::default(),
///     &ShapeDnaMetric::default(),
///     &Msdm2Metric,
///     &DameMetric::default(),
/// ];
/// for metric in metrics {
///     let measurement = metric.measure(&original, &marked, &Job::new(2))?;
///     for (name, figure) in measurement.figures() {
///         println!("{}: {name} = {figure:?}", metric.name());
///     }
/// }
/// # Ok::<(), quality::QualityError>(())
/// ```
pub trait Metric: Send + Sync {
    /// One lower-case word, as JSON reports name it. No other metric has it.
    fn name(&self) -> &'static str;

    /// What the two meshes must have in common.
    fn needs(&self) -> Needs;

    /// Compares `other` with `reference`. Progress is told as that of the caller's stage.
    ///
    /// # Errors
    /// Why the two can't be compared: [`QualityError::Mesh`] where one of them is the reason.
    fn measure(&self, reference: &TriMesh, other: &TriMesh, job: &Job) -> Result<Measurement, QualityError>;
}

/// What two meshes must have in common to be compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Needs {
    /// Nothing: place, pose, size and connectivity do not count.
    Nothing,
    /// The surfaces lie in the same place. Their triangles may differ.
    SamePlace,
    /// The same triangles over the same vertices, in the same order.
    SameConnectivity,
}

/// A number that a metric found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
#[non_exhaustive]
pub enum Figure {
    /// A real number.
    Number(f64),
    /// How many of something.
    Count(usize),
    /// How many of something in either mesh.
    Counts([usize; 2]),
}

impl From<f64> for Figure {
    fn from(number: f64) -> Self {
        Self::Number(number)
    }
}

impl From<usize> for Figure {
    fn from(count: usize) -> Self {
        Self::Count(count)
    }
}

impl From<[usize; 2]> for Figure {
    fn from(counts: [usize; 2]) -> Self {
        Self::Counts(counts)
    }
}

/// What a metric found of two meshes. Serialises as an object of its figures.
#[derive(Clone, Debug, PartialEq)]
pub struct Measurement {
    figures: Vec<(&'static str, Figure)>,
    local: Option<Vec<f64>>,
}

impl Measurement {
    /// Figures by their names. Lengths are fractions of the diagonal of the reference's bounding box.
    pub fn new(figures: impl Into<Vec<(&'static str, Figure)>>) -> Self {
        Self {
            figures: figures.into(),
            local: None,
        }
    }

    /// The same with what was found at each vertex of the other mesh, #V.
    pub fn with_local(self, values: Vec<f64>) -> Self {
        Self {
            local: Some(values),
            ..self
        }
    }

    /// All figures, each with its name.
    pub fn figures(&self) -> &[(&'static str, Figure)] {
        &self.figures
    }

    /// The figure of a name.
    pub fn figure(&self, name: &str) -> Option<Figure> {
        let found = self.figures.iter().find(|(own, _)| *own == name);
        found.map(|&(_, figure)| figure)
    }

    /// The number of a name; NaN where there is none, which no comparison passes.
    pub fn number(&self, name: &str) -> f64 {
        match self.figure(name) {
            Some(Figure::Number(number)) => number,
            Some(Figure::Count(count)) => count as f64,
            _ => f64::NAN,
        }
    }

    /// The counts of a name in either mesh; zeros where there are none.
    pub fn counts(&self, name: &str) -> [usize; 2] {
        match self.figure(name) {
            Some(Figure::Counts(counts)) => counts,
            _ => [0; 2],
        }
    }

    /// What was found at each vertex of the other mesh, #V, by metrics that look at places.
    pub fn local(&self) -> Option<&[f64]> {
        self.local.as_deref()
    }
}

impl Serialize for Measurement {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.figures.iter().copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Dame, DameMetric, DistanceMetric, Msdm2Metric, Normalisation, ShapeDna, ShapeDnaMetric,
        ShapeDnaOptions, Side, SymmetricDistance, Visibility,
    };
    use mesh::shapes;

    #[test]
    fn a_metric_finds_what_its_functions_find() {
        let reference = shapes::bumpy_sphere(2, 3);
        let other = shapes::jittered(&reference, 0.1, 1);
        let job = Job::default();
        let metric = DistanceMetric::default();
        let both = SymmetricDistance::between(&other, &reference, &metric.options, &job).unwrap();
        let found = metric.measure(&reference, &other, &job).unwrap();
        assert_eq!(found.number("d_rmse"), both.forward.rmse / both.diagonal);
        assert_eq!(found.number("hausdorff"), both.hausdorff() / both.diagonal);
        assert_eq!(
            found.counts("samples"),
            [both.forward.samples, both.backward.samples]
        );
        let one_way = DistanceMetric {
            both_ways: false,
            ..metric
        };
        let forward = one_way.measure(&reference, &other, &job).unwrap();
        assert_eq!(forward.number("d_rmse"), found.number("d_rmse"));
        assert!(forward.number("hausdorff").is_nan());

        let dame = Dame::between(&other, &reference, Visibility::Seen, &job).unwrap();
        let found = DameMetric::default().measure(&reference, &other, &job).unwrap();
        assert_eq!(found.number("error"), dame.error);

        let [a, b] =
            [&reference, &other].map(|mesh| ShapeDna::of(mesh, &ShapeDnaOptions::default(), &job).unwrap());
        let distance = b.distance(&a, 2.0, Normalisation::FirstEigenvalue).unwrap();
        for known in [None, Some(a)] {
            let metric = ShapeDnaMetric {
                reference: known,
                ..Default::default()
            };
            let found = metric.measure(&reference, &other, &Job::new(2)).unwrap();
            assert_eq!(found.number("distance"), distance);
        }

        let found = Msdm2Metric.measure(&reference, &other, &job).unwrap();
        assert_eq!(found.local().map(<[f64]>::len), Some(other.vertex_count()));
    }

    #[test]
    fn the_mesh_that_is_the_reason_is_named() {
        let ball = shapes::icosphere(2);
        let flat = TriMesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]], vec![[0, 1, 2]]).unwrap();
        let metrics: [&dyn Metric; 3] = [
            &DistanceMetric::default(),
            &ShapeDnaMetric::default(),
            &Msdm2Metric,
        ];
        for metric in metrics {
            for (reference, other, expected) in [(&flat, &ball, Side::Reference), (&ball, &flat, Side::Other)]
            {
                let refused = metric.measure(reference, other, &Job::default());
                assert!(matches!(refused, Err(QualityError::Mesh { side, .. }) if side == expected));
            }
        }
    }
}
