//! What a mesh has room for, and what a mark in it would survive.

use std::sync::Arc;

use job::Job;
use mesh::TriMesh;
use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
use serde_json::{Value, json};
use sigmark::{
    Curve, Embedder, Prediction, SigmarkError, SigningKey, Strength,
    mark::{MarkError, Original},
};

use crate::{
    commands::embed::{held, limits},
    report::{self, Lines},
};

/// Models of so few vertices are signed to see what is left where triangles would turn too far: large ones have next to none.
const TRIED: usize = 20_000;

/// As `embed --strength` names them.
const STRENGTHS: [(&str, Strength); 3] = [
    ("subtle", Strength::SUBTLE),
    ("standard", Strength::STANDARD),
    ("strong", Strength::STRONG),
];

/// What `embed` would do, but for its options: at each strength in the order of [`STRENGTHS`].
pub(crate) struct Capacity(Result<(Arc<Original>, [Prediction; STRENGTHS.len()]), SigmarkError>);

impl Capacity {
    pub(crate) fn of(mesh: &TriMesh) -> Self {
        // A key that signs nothing, and the same each time: so is what is said of a model.
        let key = SigningKey::generate(Curve::P256, &mut ChaCha20Rng::from_seed([0; 32]));
        let embedder = Embedder::new(&key);
        let job = Job::default();
        let at = |original: &Arc<Original>, strength: Strength| {
            let embedder = embedder.clone().strength(strength);
            match mesh.vertex_count() <= TRIED {
                true => Ok(*embedder.embed_in(original, &job)?.prediction()),
                false => embedder.predict(original),
            }
        };
        let of = || {
            let original = Arc::new(embedder.cut(mesh, &job)?);
            let [subtle, standard, strong] = STRENGTHS.map(|(_, strength)| at(&original, strength));
            Ok((original, [subtle?, standard?, strong?]))
        };
        Self(of())
    }

    pub(crate) fn json(&self) -> Value {
        match &self.0 {
            Ok((original, predictions)) => {
                let named = STRENGTHS.iter().zip(predictions);
                let strengths: Vec<Value> = named
                    .map(|((name, _), prediction)| {
                        json!({
                            "strength": name,
                            "distortion_rms": prediction.distortion_rms,
                            "payload": prediction.payload.name(),
                            "margin_predicted": prediction.margin,
                            "margin_read": prediction.margin_read,
                            "noise_read": prediction.noise_read,
                            "noise_evidence": prediction.noise_evidence,
                            "noise_detected": prediction.noise_detected,
                        })
                    })
                    .collect();
                let [_, standard, _] = predictions;
                json!({
                    "chips": standard.chips,
                    "payload": standard.payload.name(),
                    "patches": original.patches().len(),
                    "unmarked_vertices": original.patches().unmarked_vertices(),
                    "strengths": strengths,
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
            Ok((_, predictions)) => {
                let [_, standard, _] = predictions;
                let chips = report::counted(standard.chips, "chip", "chips");
                let held = held(standard.payload, standard.payload_bits);
                lines.field("capacity", format!("{chips}, for {held}"));
                let row = |[payload, read, found, margin]: [&str; 4]| {
                    format!("{payload:<11} {read:<25} {found:<25} {margin}")
                };
                let head = [
                    "payload",
                    "read up to noise of",
                    "found up to noise of",
                    "T0 at noise of 0.1 %",
                ];
                lines.field("strength", row(head));
                for ((name, _), prediction) in STRENGTHS.iter().zip(predictions) {
                    let Prediction {
                        payload,
                        margin,
                        margin_read,
                        noise_read,
                        noise_detected,
                        ..
                    } = prediction;
                    let [read, found] = [noise_read, noise_detected]
                        .map(|&noise| limits(noise, "or").unwrap_or_else(|| "nothing".into()));
                    let margin = format!("{margin:.0}, and {margin_read:.0} is enough");
                    lines.field(name, row([payload.name(), &read, &found, &margin]));
                }
            }
            Err(error) => lines.field("capacity", format!("none: {error}")),
        }
    }
}
