//! The metrics of the tables: the one list of what is measured of every mark, and of how tables show it.

use std::collections::BTreeMap;

use anyhow::Result;
use job::Job;
use mesh::TriMesh;
use quality::{DistanceMetric, Metric, Msdm2Metric, ShapeDna, ShapeDnaMetric};

use crate::paper::Printed;

/// A metric, and which of its figures stand in tables.
struct Listed {
    /// Some know their reference, so that it is looked at once for all marks.
    make: fn(&TriMesh) -> Result<Box<dyn Metric>>,
    /// Whether other signatures' marks than the first's, and large meshes, are left out.
    costly: bool,
    figures: &'static [Figure],
}

/// A figure of a metric: a column of tables.
pub(crate) struct Figure {
    /// What kept marks know it by.
    pub(crate) id: &'static str,
    pub(crate) header: &'static str,
    /// Its name among those of the metric, and what it is multiplied by.
    source: (&'static str, f64),
    /// Behind the point; in the sweep, whose marks may be faint.
    pub(crate) digits: [usize; 2],
    /// What the paper prints of it.
    pub(crate) printed: Option<fn(&Printed) -> f64>,
}

const PLAIN: Figure = Figure {
    id: "",
    header: "",
    source: ("", 1.0),
    digits: [3, 3],
    printed: None,
};

/// Eq. 21, by which α is chosen.
pub(crate) const D_RMSE: &str = "d_rmse";

static LIST: [Listed; 3] = [
    Listed {
        make: |_| {
            let options = Default::default();
            let both_ways = false;
            Ok(Box::new(DistanceMetric { options, both_ways }))
        },
        costly: false,
        figures: &[
            Figure {
                id: D_RMSE,
                header: "d_rmse (%)",
                source: ("d_rmse", 100.0),
                digits: [4, 4],
                printed: Some(|row| row.d_rmse),
            },
            Figure {
                id: "hausdorff",
                header: "Hausdorff (%)",
                source: ("hausdorff_forward", 100.0),
                digits: [3, 4],
                ..PLAIN
            },
        ],
    },
    Listed {
        make: |original| {
            let mut metric = ShapeDnaMetric::default();
            metric.reference = Some(ShapeDna::of(original, &metric.options, &Job::default())?);
            Ok(Box::new(metric))
        },
        costly: false,
        figures: &[Figure {
            id: "d_2_50",
            header: "d_2,50",
            source: ("distance", 1.0),
            printed: Some(|row| row.d_2_50),
            ..PLAIN
        }],
    },
    Listed {
        make: |_| Ok(Box::new(Msdm2Metric)),
        costly: true,
        figures: &[Figure {
            id: "msdm2",
            header: "MSDM2",
            source: ("symmetric", 1.0),
            ..PLAIN
        }],
    },
];

/// MSDM2 takes a minute and a half of a million vertices, and there are dozens of marks; the paper has none of it.
const MOST_IF_COSTLY: usize = 200_000;

/// The columns of the tables.
pub(crate) fn figures() -> impl Iterator<Item = &'static Figure> {
    LIST.iter().flat_map(|listed| listed.figures)
}

/// The metrics, made for one original.
pub(super) struct Metrics(Vec<(&'static Listed, Box<dyn Metric>)>);

impl Metrics {
    pub(super) fn of(original: &TriMesh) -> Result<Self> {
        let made = LIST.iter().map(|listed| Ok((listed, (listed.make)(original)?)));
        Ok(Self(made.collect::<Result<_>>()?))
    }

    /// All figures of a marked mesh, by their ids.
    pub(super) fn measured(
        &self,
        original: &TriMesh,
        marked: &TriMesh,
        signature: usize,
        job: &Job,
    ) -> Result<BTreeMap<String, f64>> {
        let all = signature == 0 && marked.vertex_count() <= MOST_IF_COSTLY;
        let mut figures = BTreeMap::new();
        for (listed, metric) in self.0.iter().filter(|(listed, _)| all || !listed.costly) {
            let found = metric.measure(original, marked, job)?;
            for Figure {
                id,
                source: (name, factor),
                ..
            } in listed.figures
            {
                figures.insert((*id).into(), factor * found.number(name));
            }
        }
        Ok(figures)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes;

    #[test]
    fn every_metric_has_the_figures_that_are_asked_of_it() {
        let original = shapes::bumpy_sphere(3, 1);
        let marked = shapes::jittered(&original, 0.05, 2);
        let metrics = Metrics::of(&original).unwrap();
        let of = |signature| {
            metrics
                .measured(&original, &marked, signature, &Job::default())
                .unwrap()
        };
        assert!(of(0).values().all(|figure| figure.is_finite()));
        assert_eq!(of(0).len(), figures().count());
        assert!(of(1).len() < of(0).len() && of(1).contains_key(D_RMSE));
    }
}
