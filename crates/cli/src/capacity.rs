//! What a mesh has room for, and what a mark in it would survive.

use std::sync::Arc;

use getrandom::SysRng;
use job::Job;
use mesh::TriMesh;
use rand_core::UnwrapErr;
use serde_json::{Value, json};
use sigmark::{
    Curve, Embedder, Prediction, SigmarkError, SigningKey,
    mark::{MarkError, Original},
};

use crate::{
    commands::embed::{held, survival},
    report::{self, Lines},
};

/// Models of so few vertices are signed to see what is left where triangles would turn too far: large ones have next to none.
const TRIED: usize = 20_000;

/// What `embed` would do by default.
pub(crate) struct Capacity(Result<(Arc<Original>, Prediction), SigmarkError>);

impl Capacity {
    pub(crate) fn of(mesh: &TriMesh) -> Self {
        // A key that signs nothing.
        let embedder = Embedder::new(&SigningKey::generate(Curve::P256, &mut UnwrapErr(SysRng)));
        let of = || {
            let original = Arc::new(embedder.cut(mesh, &Job::default())?);
            let prediction = match mesh.vertex_count() <= TRIED {
                true => *embedder.embed_in(&original, &Job::default())?.prediction(),
                false => embedder.predict(&original)?,
            };
            Ok((original, prediction))
        };
        Self(of())
    }

    pub(crate) fn json(&self) -> Value {
        match &self.0 {
            Ok((original, prediction)) => {
                json!({
                    "chips": prediction.chips,
                    "payload": prediction.payload.name(),
                    "patches": original.patches().len(),
                    "unmarked_vertices": original.patches().unmarked_vertices(),
                    "margin_predicted": prediction.margin,
                    "margin_read": prediction.margin_read,
                    "noise_read": prediction.noise_read,
                    "noise_evidence": prediction.noise_evidence,
                    "noise_detected": prediction.noise_detected,
                })
            }
            Err(SigmarkError::Mark(MarkError::Room { found, .. })) => {
                json!({ "chips": found, "payload": null })
            }
            Err(_) => json!({ "chips": 0, "payload": null }),
        }
    }

    pub(crate) fn tell(&self, lines: &mut Lines) {
        match &self.0 {
            Ok((_, prediction)) => {
                let chips = report::counted(prediction.chips, "chip", "chips");
                let held = held(prediction.payload, prediction.payload_bits);
                lines.field("capacity", format!("{chips}, for {held}"));
                survival(lines, prediction);
            }
            Err(error) => lines.field("capacity", format!("none: {error}")),
        }
    }
}
