use std::path::Path;

use anyhow::{Context, Result, bail};
use serde_json::json;
use sigmark::{
    Embedder, Signed,
    signature::{Scheme, SigningKey},
};

use crate::{
    Answer,
    args::{Embed, Profile},
    files::{self, Output},
    keys,
    progress::Progress,
    report,
};

pub(crate) fn run(arguments: &Embed) -> Result<Answer> {
    let certificate_path = arguments
        .certificate
        .clone()
        .unwrap_or_else(|| files::with_suffix(&arguments.output, ".cert.json"));
    check_outputs(arguments, &certificate_path)?;
    let progress = Progress::new();
    progress.begin("reading", "reading");
    let asset = files::open_mesh(&arguments.model)?;
    asset.check_name(&arguments.output)?;
    let key = keys::read_private(&arguments.key)?;
    let embedder = embedder(arguments, &key)?;

    let signed = embedder
        .embed_observed(asset.mesh(), &progress)
        .with_context(|| arguments.model.display().to_string())?;
    progress.begin("writing", "writing");
    let marked = asset.with_positions(signed.positions())?;
    // What counts is what the file holds: its precision may be coarser than the mark.
    let read_back = signed.read_back(marked.mesh().positions());
    if read_back < 1.0 {
        bail!(
            "{}: only {:.1} % of the bits survive the precision of this file; mark more strongly with --distortion, \
             or use a file with more digits",
            arguments.output.display(),
            100.0 * read_back
        );
    }
    let certificate = signed.certificate().to_json()?;
    let (mesh_file, certificate_file) = (marked.to_bytes(), certificate.as_bytes());
    let outputs = [
        (&arguments.output, &*mesh_file),
        (&certificate_path, certificate_file),
    ];
    let outputs = outputs.map(|(path, bytes)| Output {
        path,
        bytes,
        private: false,
    });
    files::write_together(&outputs, arguments.force)?;
    let seconds = progress.finish();

    let (bits, patches) = (
        signed.signature().scheme().bits(),
        signed.original().bases().len(),
    );
    if arguments.json {
        report::json(&json!({
            "output": arguments.output,
            "certificate": certificate_path,
            "scheme": signed.signature().scheme(),
            "bits": bits,
            "chip_rate": arguments.chip_rate,
            "functions": signed.original().layout().functions(),
            "patches": patches,
            "unmarked_vertices": signed.original().unmarked_vertices(),
            "alpha": signed.alpha(),
            "distortion_rms": signed.distortion_rms(),
            "read_back": read_back,
            "seconds": report::seconds_json(&seconds),
        }))?;
        return Ok(Answer::Yes);
    }
    report::lines(&summary(arguments, &signed, &certificate_path, &seconds))?;
    Ok(Answer::Yes)
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

fn embedder<'k>(arguments: &Embed, key: &'k SigningKey) -> Result<Embedder<'k>> {
    let mut embedder = Embedder::new(key)
        .message(&arguments.message)
        .chip_rate(arguments.chip_rate)
        .strength(arguments.strength())
        .threads(arguments.threads.count());
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
        embedder = embedder.scheme(profile.scheme()).coverage(profile.coverage());
    }
    if arguments.sha1 {
        embedder = match key.curve() {
            sigmark::signature::Curve::P256 => embedder.scheme(Scheme::EcdsaP256Sha1),
            sigmark::signature::Curve::B163 => embedder, // which hashes with SHA-1 anyway
        };
    }
    Ok(embedder)
}

fn summary(
    arguments: &Embed,
    signed: &Signed,
    certificate: &Path,
    seconds: &[(&'static str, f64)],
) -> Vec<String> {
    let scheme = signed.signature().scheme();
    let original = signed.original();
    let mut lines = vec![
        format!("Signed {}", arguments.model.display()),
        report::field(
            "signature",
            format!(
                "{scheme}, {} bits, all read back from the file as written",
                scheme.bits()
            ),
        ),
        report::field(
            "mark",
            format!(
                "{}, {} manifold harmonics in each, every bit {}",
                report::counted(original.bases().len(), "patch", "patches"),
                original.layout().functions(),
                report::counted(arguments.chip_rate, "time", "times")
            ),
        ),
        report::field(
            "distortion",
            format!(
                "RMS {:.4} % of the diagonal (α = {:.3e})",
                100.0 * signed.distortion_rms(),
                signed.alpha()
            ),
        ),
    ];
    if original.unmarked_vertices() > 0 {
        lines.push(report::field(
            "left unmarked",
            format!(
                "{} in pieces too small for the signature",
                report::counted(original.unmarked_vertices(), "vertex", "vertices")
            ),
        ));
    }
    lines.extend([
        report::field("time", report::seconds_text(seconds)),
        report::field(
            "written",
            format!("{} and {}", arguments.output.display(), certificate.display()),
        ),
        format!(
            "Keep {} and the certificate: both are needed to verify, and whoever has both can remove the mark.",
            arguments.model.display()
        ),
    ]);
    lines
}
