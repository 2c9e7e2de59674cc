//! Figs. 4 and 5: where on its original each algorithm's mark lies.

use anyhow::Result;
use baselines::AlgorithmId;
use quality::{Scale, heatmap};

use crate::{models::Standin, paper::ModelId, results::Illustration};

/// Collects the distances of a model's marked meshes from their original, for pictures with one scale.
pub(crate) struct Heat<'a> {
    standin: &'a Standin,
    fields: Vec<(String, Vec<f64>)>,
}

impl<'a> Heat<'a> {
    pub(crate) fn new(standin: &'a Standin) -> Self {
        Self {
            standin,
            fields: Vec::new(),
        }
    }

    /// The figure that shows the model; the bunny stands in where it is alone.
    fn figure(&self) -> Option<&'static str> {
        match self.standin.model.id {
            ModelId::Teddy => Some("Fig. 4"),
            ModelId::Lion => Some("Fig. 5"),
            ModelId::Bunny => Some("As Figs. 4 and 5"),
            _ => None,
        }
    }

    /// Whether a figure shows this algorithm's mark.
    pub(crate) fn wants(&self, algorithm: &AlgorithmId) -> bool {
        self.figure().is_some() && self.standin.model.printed(algorithm).is_some()
    }

    /// Distances of an algorithm's mark, in the mesh's unit, #V.
    pub(crate) fn add(&mut self, algorithm: &str, distances: Vec<f64>) {
        self.fields.push((algorithm.into(), distances));
    }

    /// The algorithms' pictures, red where any of them is farthest.
    pub(crate) fn painted(&self) -> Result<Vec<Illustration>> {
        let Some(figure) = self.figure() else {
            return Ok(Vec::new());
        };
        let diagonal = self.standin.mesh.bounding_box().diagonal();
        let all = self.fields.iter().flat_map(|(_, field)| field);
        let greatest = all.copied().fold(0.0, f64::max) / diagonal;
        let painted = |(algorithm, field): &(String, Vec<f64>)| {
            let shares: Vec<f64> = field.iter().map(|distance| distance / diagonal).collect();
            let own = 100.0 * shares.iter().copied().fold(0.0, f64::max);
            let Standin { file, mesh, .. } = self.standin;
            let scale = Scale::up_to(greatest);
            Ok(Illustration {
                file: format!("heat_{file}_{}.png", algorithm.to_lowercase()),
                title: format!("{figure}: {file}, {algorithm}"),
                caption: format!(
                    "Distance from the original's surface, at most {own:.4} % of the diagonal. The algorithms' pictures share one scale."
                ),
                bytes: heatmap(mesh, &shares, scale, 300, "% of the diagonal", 100.0).to_png()?,
            })
        };
        self.fields.iter().map(painted).collect()
    }
}
