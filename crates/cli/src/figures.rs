//! What `--json` prints of marks, verdicts and traces, but for the names of files, the remarks and the time: the same for the command and for the Python package.

use serde_json::{Map, Value, json};
use sigmark::{Compared, Prediction, Prepared, Statement, Verdict, claim::Trace};

/// What `embed` says of a mark, which is foretold, or as it was made.
pub fn of_mark(prepared: &Prepared, prediction: &Prediction, laplacian: &str) -> Map<String, Value> {
    let (layout, original) = (prepared.layout(), prepared.original());
    members(json!({
        "scheme": prepared.statement_for("").scheme,
        "payload": prediction.payload.name(),
        "bits": prediction.payload_bits,
        "code_bits": layout.bits(),
        "chips": layout.chip_count(),
        "laplacian": laplacian,
        "functions": original.functions(),
        "patches": original.patches().len(),
        "unmarked_vertices": original.patches().unmarked_vertices(),
        "alpha": layout.alpha(),
        "distortion_rms": layout.distortion_rms(),
        "margin_predicted": prediction.margin,
        "margin_read": prediction.margin_read,
        "noise_read": prediction.noise_read,
        "noise_evidence": prediction.noise_evidence,
        "noise_detected": prediction.noise_detected,
    }))
}

/// What `verify` says of a suspect; `own_key` where nobody said whose key it has to be.
pub fn of_verdict(verdict: &Verdict, statement: &Statement, own_key: bool) -> Map<String, Value> {
    members(json!({
        "outcome": verdict.outcome.name(),
        "evidence": verdict.is_evidence(),
        "scheme": statement.scheme,
        "signed": if verdict.binds_original { "statement" } else { "message" },
        "extraction_rate": verdict.extraction_rate,
        "p_value": verdict.p_value,
        "p_dispute": verdict.p_dispute(),
        "correlation": verdict.correlation,
        "margin": verdict.margin,
        "payload": verdict.payload.name(),
        "bits": verdict.bits,
        "bit_errors": verdict.bit_errors,
        "patches_read": verdict.patches_read,
        "tries": verdict.tries,
        "registration": verdict.registration(),
        "poses": verdict.poses,
        "overlap": verdict.overlap,
        "coverage": verdict.coverage,
        "missing": verdict.missing,
        "residual": verdict.residual,
        "transform": verdict.transform.map(|transform| transform.to_matrix()),
        "mirrored": verdict.transform.map(|transform| transform.mirrors()),
        "attack_model": verdict.attack_model.filter(|_| verdict.outcome.is_found()),
        "marked_parts": verdict.marked_parts,
        "original_is": match verdict.compared_with {
            Compared::Original => "file",
            _ => "geometry",
        },
        "message": statement.message,
        "recipient": statement.recipient,
        "public_key": statement.public_key.fingerprint(),
        "own_key": own_key,
    }))
}

/// What `trace` says of a suspect, but for those whose copies it names.
pub fn of_trace(trace: &Trace) -> Map<String, Value> {
    members(json!({
        "candidates": trace.candidates,
        "registration": trace.registration(),
        "poses": trace.poses,
        "overlap": trace.overlap,
        "coverage": trace.coverage,
        "missing": trace.missing,
        "transform": trace.transform.map(|transform| transform.to_matrix()),
        "mirrored": trace.transform.map(|transform| transform.mirrors()),
        "attack_model": trace.attack_model,
    }))
}

/// The members of an object.
pub fn members(object: Value) -> Map<String, Value> {
    match object {
        Value::Object(members) => members,
        _ => Map::new(),
    }
}
