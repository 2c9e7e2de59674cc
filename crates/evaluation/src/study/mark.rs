//! What a mark does to a mesh: its distortion by the metrics of the tables, and where it lies.

use std::time::Instant;

use anyhow::Result;
use mesh::TriMesh;
use quality::{DistanceOptions, Measurement, Metric, Msdm2Metric, surface_distance, vertex_distances};
use serde_json::{Value, json};

use super::{Mark, Study};

/// MSDM2 takes a minute and a half of a million vertices, and there are dozens of marks; the paper has none of it.
const MOST_FOR_MSDM2: usize = 200_000;

impl Study<'_> {
    fn mark_inputs(&self, signature: usize, alpha: f64) -> Value {
        self.inputs(json!({"alpha": alpha, "signature": self.signature(signature).to_hex()}))
    }

    /// d_rmse, and the greatest distance: per cent of the original's diagonal.
    pub(super) fn d_rmse(&self, marked: &TriMesh) -> Result<(f64, f64)> {
        let distance = surface_distance(marked, self.original(), &DistanceOptions::default(), &self.job())?;
        let per_cent = 100.0 / self.original().bounding_box().diagonal();
        Ok((per_cent * distance.rmse, per_cent * distance.maximum))
    }

    fn measured(&self, metric: &dyn Metric, marked: &TriMesh) -> Result<Measurement> {
        Ok(metric.measure(self.original(), marked, &self.job())?)
    }

    /// A mark's distortion.
    pub(crate) fn mark(&self, signature: usize, alpha: f64) -> Result<Mark> {
        let inputs = self.mark_inputs(signature, alpha);
        if let Some(kept) = self.store().get("mark", &inputs) {
            return Ok(kept);
        }
        self.prepare()?;
        let begun = Instant::now();
        let marked = self.marked(signature, alpha)?;
        let seconds = begun.elapsed().as_secs_f64();
        let begun = Instant::now();
        let (d_rmse, hausdorff) = self.d_rmse(&marked)?;
        let msdm2 = (signature == 0 && marked.vertex_count() <= MOST_FOR_MSDM2)
            .then(|| self.measured(&Msdm2Metric, &marked))
            .transpose()?;
        let d_2_50 = self.measured(self.scene.shape_dna()?, &marked)?;
        let mark = Mark {
            alpha,
            d_rmse,
            hausdorff,
            d_2_50: d_2_50.number("distance"),
            msdm2: msdm2.map(|found| found.number("symmetric")),
            seconds,
            measuring_seconds: begun.elapsed().as_secs_f64(),
        };
        self.store().put("mark", &inputs, &mark)?;
        Ok(mark)
    }

    /// How far each vertex of a marked mesh lies from the original's surface, #V, in the mesh's unit.
    pub(crate) fn distances(&self, signature: usize, alpha: f64) -> Result<Vec<f64>> {
        let inputs = self.mark_inputs(signature, alpha);
        let store = self.store();
        // Bytes don't know which code computed them; the entry beside them does.
        let finished: Option<()> = store.get("distances", &inputs);
        if let Some(kept) = finished.and_then(|()| store.bytes("distances", &inputs, "f32")) {
            let numbers = kept.as_chunks::<4>().0.iter();
            return Ok(numbers
                .map(|&octets| f64::from(f32::from_le_bytes(octets)))
                .collect());
        }
        let distances = vertex_distances(&self.marked(signature, alpha)?, self.original(), &self.job())?;
        let octets: Vec<u8> = distances.iter().flat_map(|&d| (d as f32).to_le_bytes()).collect();
        store.put_bytes("distances", &inputs, "f32", &octets)?;
        store.put("distances", &inputs, &())?;
        Ok(distances)
    }
}
