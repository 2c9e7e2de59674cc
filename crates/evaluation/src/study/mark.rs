//! What a mark does to a mesh: its distortion by the metrics of the tables, and where it lies.

use std::time::Instant;

use anyhow::Result;
use quality::vertex_distances;
use serde_json::{Value, json};

use super::{Mark, Study, Target, metrics};

impl Study<'_> {
    fn mark_inputs(&self, signature: usize, alpha: f64) -> Value {
        self.inputs(json!({"alpha": alpha, "signature": self.signature(signature).to_hex()}))
    }

    /// A mark's distortion.
    pub(crate) fn mark(&self, Target { signature, alpha, .. }: Target) -> Result<Mark> {
        let mut inputs = self.mark_inputs(signature, alpha);
        inputs["metrics"] = metrics::figures().map(|figure| figure.id).collect();
        if let Some(kept) = self.store().get("mark", &inputs) {
            return Ok(kept);
        }
        self.prepare()?;
        let begun = Instant::now();
        let marked = self.marked(signature, alpha)?;
        let seconds = begun.elapsed().as_secs_f64();
        let begun = Instant::now();
        let metrics = self.scene.metrics()?;
        let mark = Mark {
            alpha,
            figures: metrics.measured(self.original(), &marked, signature, &self.job())?,
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
