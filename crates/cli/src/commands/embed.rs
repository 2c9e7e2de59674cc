use std::{path::Path, sync::Arc};

use anyhow::{Context, Result, bail};
use job::Job;
use mesh_io::Asset;
use quality::{FacetTurn, TurnSummary};
use serde_json::{Value, json};
use sigmark::{Curve, Embedder, Prediction, Scheme, Signed, SigningKey, claim::bits_for, mark::Original};

use crate::{
    Answer,
    args::{Embed, Profile},
    files::{self, Output},
    keys,
    progress::Progress,
    report::{self, Lines, Seconds},
};

pub(crate) fn run(arguments: &Embed) -> Result<Answer> {
    let certificate_path = arguments
        .certificate
        .clone()
        .unwrap_or_else(|| files::with_suffix(&arguments.output, ".cert.json"));
    check_outputs(arguments, &certificate_path)?;
    // Before there is a progress bar, which would run over a question for the passphrase.
    let key = keys::read_private(&arguments.key)?;
    let embedder = embedder(arguments, &key)?;

    let progress = Arc::new(Progress::new());
    let job = progress.job(arguments.common.threads());
    progress.begin("reading", "reading");
    let asset = files::open_mesh(&arguments.model)?;
    asset.check_name(&arguments.output)?;
    let model = || arguments.model.display().to_string();
    let original = Arc::new(embedder.cut(asset.mesh(), &job).with_context(model)?);
    let prediction = embedder.predict(&original).with_context(model)?;
    if !arguments.common.json {
        progress.tell(&planned(arguments, &original, &prediction))?;
    }
    let signed = embedder.embed_in(&original, &job).with_context(model)?;
    progress.begin("writing", "writing");
    let turn = write(arguments, &certificate_path, &asset, &signed, &job)?;
    let seconds = progress.finish();

    let object = object(
        arguments,
        &signed,
        &certificate_path,
        &prediction,
        &turn,
        &seconds,
    );
    let lines = summary(arguments, &signed, &certificate_path, &turn, &seconds);
    report::print(arguments.common.json, &object, &lines)?;
    Ok(Answer::Yes)
}

/// Writes the signed mesh and the certificate, if the whole signature can be read back from the one as the file holds it. Tells how far its
/// facets turned.
fn write(
    arguments: &Embed,
    certificate: &Path,
    asset: &Asset,
    signed: &Signed,
    job: &Job,
) -> Result<FacetTurn> {
    let marked = asset.with_positions(signed.positions())?;
    // What counts is what the file holds: its precision may be coarser than the mark.
    let read_back = signed.read_back(marked.mesh().positions(), job)?;
    if read_back < 1.0 {
        bail!(
            "{}: only {:.1} % of the bits survive the precision of this file; mark more strongly with --distortion, \
             or use a file with more digits",
            arguments.output.display(),
            100.0 * read_back
        );
    }
    let (mesh, json) = (marked.to_bytes(), signed.certificate().to_json()?);
    let outputs = [
        (&*arguments.output, &*mesh, false),
        (certificate, json.as_bytes(), true),
    ];
    let outputs = outputs.map(|(path, bytes, private)| Output { path, bytes, private });
    let turn = FacetTurn::between(asset.mesh(), marked.mesh())?;
    files::write_together(&outputs, arguments.force)?;
    Ok(turn)
}

/// What `--json` prints.
fn object(
    arguments: &Embed,
    signed: &Signed,
    certificate: &Path,
    prediction: &Prediction,
    turn: &FacetTurn,
    seconds: &Seconds,
) -> Value {
    let statement = signed.certificate().statement();
    let scheme = statement.scheme;
    json!({
        "output": arguments.output,
        "certificate": certificate,
        "scheme": scheme,
        "payload": statement.payload_kind().name(),
        "bits": scheme.bits(),
        "chips": signed.layout().chip_count(),
        "laplacian": arguments.laplacian.name(),
        "functions": signed.original().functions(),
        "patches": signed.original().patches().len(),
        "unmarked_vertices": signed.original().patches().unmarked_vertices(),
        "alpha": signed.layout().alpha(),
        "distortion_rms": signed.layout().distortion_rms(),
        "margin_predicted": prediction.margin,
        "noise_read": prediction.noise_read,
        "noise_evidence": prediction.noise_evidence,
        "noise_detected": prediction.noise_detected,
        "facet_turn": turn.summary(),
        "flipped": turn.flipped(),
        "seconds": report::seconds_json(seconds),
    })
}

/// Both files can be written, and replace nothing that is read.
fn check_outputs(arguments: &Embed, certificate: &Path) -> Result<()> {
    let (model, key) = (&arguments.model, &arguments.key);
    for output in [&arguments.output, certificate] {
        files::check_apart(output, model, "the model, which you need as it is to verify")?;
        files::check_apart(output, key, "the private key")?;
    }
    files::check_apart(
        certificate,
        &arguments.output,
        "to be both the signed mesh and the certificate",
    )?;
    files::check_free(&arguments.output, arguments.force)?;
    files::check_free(certificate, arguments.force)
}

fn embedder(arguments: &Embed, key: &SigningKey) -> Result<Embedder> {
    let mut embedder = Embedder::new(key)
        .message(&arguments.message)
        .recipient(&arguments.recipient)
        .original_name(file_name(&arguments.model))
        .strength(arguments.strength())
        .laplacian(arguments.laplacian.kind());
    if let Some(rate) = arguments.chip_rate {
        embedder = embedder.chip_rate(rate);
    }
    if let Some(patches) = arguments.patches {
        embedder = embedder.patches(patches);
    }
    if let Some(profile) = arguments.profile {
        if profile.curve() != key.curve() {
            let name = if profile == Profile::Paper {
                "paper"
            } else {
                "standard"
            };
            bail!(
                "{}: this key is on {}, but the {name} profile signs on {}; make a key with `sigmark keygen --profile {name}`",
                arguments.key.display(),
                key.curve(),
                profile.curve()
            );
        }
        embedder = embedder.scheme(profile.scheme());
    }
    // On the paper's curve the scheme hashes with SHA-1 anyway.
    if arguments.sha1 && key.curve() == Curve::P256 {
        embedder = embedder.scheme(Scheme::EcdsaP256Sha1);
    }
    Ok(embedder)
}

/// How far facets turned, in words.
fn turned(turn: &FacetTurn) -> String {
    let TurnSummary { median, p99, max, .. } = turn.summary();
    let flipped = match turn.flipped() {
        0 => "none flips".into(),
        flipped => format!("{} over", report::counted(flipped, "flips", "flip")),
    };
    format!("{median:.1}° in the median, 99 of 100 by less than {p99:.1}°, {max:.0}° at most; {flipped}")
}

/// What of a path is in its folder; nothing of what is no text.
fn file_name(path: &Path) -> &str {
    path.file_name()
        .and_then(|name| name.to_str())
        .unwrap_or_default()
}

/// What is about to be done, and what it will be good for.
fn planned(arguments: &Embed, original: &Original, prediction: &Prediction) -> Lines {
    let mut lines = Lines::new(format!("Signing {}", arguments.model.display()));
    let patches = report::counted(original.patches().len(), "patch", "patches");
    let harmonics: usize = original.functions().iter().sum();
    let mark = format!(
        "{patches}, {} manifold harmonics in all",
        report::grouped(harmonics)
    );
    lines.field("mark", mark);
    let unmarked = original.patches().unmarked_vertices();
    if unmarked > 0 {
        let vertices = report::counted(unmarked, "vertex", "vertices");
        let where_from = format!("{vertices} between patches, or in parts too small to carry anything");
        lines.field("left unmarked", where_from);
    }
    let distortion = format!("RMS {:.4} % of the diagonal", 100.0 * prediction.distortion_rms);
    lines.field("distortion", distortion);
    survival(&mut lines, prediction);
    lines
}

/// What a mark survives, in words.
pub(crate) fn survival(lines: &mut Lines, prediction: &Prediction) {
    let withstands = |noise: f64| match noise.is_finite() && noise > 0.0 {
        true => format!(
            "noise of {} % of the size, or {} bits a coordinate",
            significant(100.0 * noise),
            bits_for(noise).max(1)
        ),
        false => "nothing".into(),
    };
    lines.field("read up to", withstands(prediction.noise_read));
    lines.field("found up to", withstands(prediction.noise_detected));
    let margin = format!("T0 = {:.0} under noise of 0.1 %", prediction.margin);
    lines.field("margin", margin);
}

/// Two digits.
fn significant(x: f64) -> String {
    let digits = (1 - x.log10().floor() as i32).clamp(0, 12) as usize;
    format!("{x:.digits$}")
}

fn summary(
    arguments: &Embed,
    signed: &Signed,
    certificate: &Path,
    turn: &FacetTurn,
    seconds: &Seconds,
) -> Lines {
    let scheme = signed.certificate().statement().scheme;
    let model = arguments.model.display();
    let mut lines = Lines::new(format!("Signed {model}"));
    let bits = scheme.bits();
    let times = signed.layout().chip_count() as f64 / bits as f64;
    let signature =
        format!("{scheme}, {bits} bits, every one {times:.1} times, all read back from the file as written");
    lines.field("signature", signature);
    let (rms, alpha) = (signed.layout().distortion_rms(), signed.layout().alpha());
    let distortion = format!("RMS {:.4} % of the diagonal (α = {alpha:.3e})", 100.0 * rms);
    lines.field("distortion", distortion);
    lines.field("facets turn", turned(turn));
    lines.field("time", report::seconds_text(seconds));
    let written = format!("{} and {}", arguments.output.display(), certificate.display());
    lines.field("written", written);
    lines.line(format!(
        "Keep {model} and the certificate: both are needed to verify, and whoever has both can remove the mark."
    ));
    lines
}
