//! What a mesh has room for, and what a mark in it would survive.

use std::sync::Arc;

use job::Job;
use mesh::TriMesh;
use serde_json::{Value, json};
use sigmark::{
    Prediction, Scheme, Strength,
    mark::{ChipPlan, MarkError, MarkLayout, Original, Pool},
};

use crate::{
    commands::embed::survival,
    report::{self, Lines},
};

/// A mark as `embed` would write it by default, up to its bits.
pub(crate) struct Capacity(Result<MarkLayout, MarkError>);

impl Capacity {
    pub(crate) fn of(mesh: &TriMesh) -> Self {
        let bits = Scheme::EcdsaP256Sha256.bits();
        let plan = ChipPlan::Pooled { bits, key: [0; 32] };
        let original = Original::pooled(mesh.clone(), bits, Pool::default(), &Job::default());
        Self(
            original.and_then(|original| {
                MarkLayout::with_strength(Arc::new(original), plan, Strength::default())
            }),
        )
    }

    pub(crate) fn json(&self) -> Value {
        match &self.0 {
            Ok(layout) => {
                let prediction = Prediction::of(layout);
                json!({
                    "chips": layout.chip_count(),
                    "payload": "signature",
                    "patches": layout.original().patches().len(),
                    "unmarked_vertices": layout.original().patches().unmarked_vertices(),
                    "margin_predicted": prediction.margin,
                    "noise_read": prediction.noise_read,
                    "noise_evidence": prediction.noise_evidence,
                    "noise_detected": prediction.noise_detected,
                })
            }
            Err(MarkError::Room { found, .. }) => json!({ "chips": found, "payload": null }),
            Err(_) => json!({ "chips": 0, "payload": null }),
        }
    }

    pub(crate) fn tell(&self, lines: &mut Lines) {
        match &self.0 {
            Ok(layout) => {
                let (chips, bits) = (layout.chip_count(), layout.bits());
                let times = chips as f64 / bits as f64;
                let chips = report::counted(chips, "chip", "chips");
                let capacity = format!("{chips}: a signature of {bits} bits, every one {times:.1} times");
                lines.field("capacity", capacity);
                survival(lines, &Prediction::of(layout));
            }
            Err(error) => lines.field("capacity", format!("no signature: {error}")),
        }
    }
}
