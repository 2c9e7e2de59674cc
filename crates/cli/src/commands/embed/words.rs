//! What `embed` says to people.

use std::path::Path;

use quality::{FacetTurn, TurnSummary};
use sigmark::{PayloadKind, Prediction, Prepared, Signed, claim::bits_for};

use super::{Task, copies::Made};
use crate::report::{self, Lines, Seconds};

pub(super) const MANIFEST_DROPPED: &str = "The model's C2PA manifest is left out: it says who made the file by a digest of every byte, and no longer holds.";

/// What is about to be done, and what it will be good for.
pub(super) fn planned(model: &Path, prepared: &Prepared, is_raised: bool) -> Lines {
    let (original, prediction) = (prepared.original(), &prepared.prediction());
    let mut lines = Lines::new(format!("Signing {}", model.display()));
    let patches = report::counted(original.patches().len(), "patch", "patches");
    let harmonics: usize = original.functions().iter().sum();
    let mark = format!(
        "{patches}, {} manifold harmonics in all",
        report::grouped(harmonics)
    );
    lines.field("mark", mark);
    if prediction.payload == PayloadKind::Tag {
        lines.field("payload", held(prediction.payload, prediction.payload_bits));
    }
    let unmarked = original.patches().unmarked_vertices();
    if unmarked > 0 {
        let vertices = report::counted(unmarked, "vertex", "vertices");
        let where_from = format!("{vertices} between patches, or in parts too small to carry anything");
        lines.field("left unmarked", where_from);
    }
    let why = if is_raised {
        ", strong, since the file's precision is coarse"
    } else {
        ""
    };
    let distortion = format!(
        "RMS {:.4} % of the diagonal{why}",
        100.0 * prediction.distortion_rms
    );
    lines.field("distortion", distortion);
    survival(&mut lines, prediction);
    lines
}

/// That the mark is weaker than was planned, and what it is good for all the same.
pub(super) fn held_back(model: &Path, signed: &Signed) -> Lines {
    let mut lines = Lines::new(format!(
        "Held back in {}, where it would turn triangles by more than 15°",
        model.display()
    ));
    survival(&mut lines, signed.prediction());
    lines
}

/// So much noise, and the fewest bits a coordinate that are no worse; none where not even a file without noise would do.
pub(crate) fn limits(noise: f64, or: &str) -> Option<String> {
    let bits = || bits_for(noise).max(1);
    (noise.is_finite() && noise > 0.0)
        .then(|| format!("{} % {or} {} bits", significant(100.0 * noise), bits()))
}

/// What a mark survives, in words.
pub(crate) fn survival(lines: &mut Lines, prediction: &Prediction) {
    let withstands = |noise| match limits(noise, "of the size, or") {
        Some(limits) => format!("noise of {limits} a coordinate"),
        None => "nothing".into(),
    };
    lines.field("read up to", withstands(prediction.noise_read));
    lines.field("found up to", withstands(prediction.noise_detected));
    let margin = format!(
        "T0 = {:.0} under noise of 0.1 %; {:.0} is enough to read all",
        prediction.margin, prediction.margin_read
    );
    lines.field("margin", margin);
}

/// What the mark holds, in words.
pub(crate) fn held(payload: PayloadKind, bits: usize) -> String {
    match payload {
        PayloadKind::Tag => {
            format!("a tag of {bits} bits, which stands for the signature where there is little room")
        }
        _ => format!("the whole signature of {bits} bits"),
    }
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

/// Two digits.
fn significant(x: f64) -> String {
    let digits = (1 - x.log10().floor() as i32).clamp(0, 12) as usize;
    format!("{x:.digits$}")
}

/// What was done, of one model.
pub(super) fn summary(task: &Task, signed: &Signed, turn: &FacetTurn, seconds: &Seconds) -> Lines {
    let statement = signed.certificate().statement();
    let model = task.model.display();
    let mut lines = Lines::new(format!("Signed {model}"));
    let bits = statement.payload.bits(statement.scheme);
    let chips = report::counted(signed.layout().chip_count(), "chip", "chips");
    let signature = format!(
        "{}, {bits} bits in {chips}, read back from the file as written",
        statement.scheme
    );
    lines.field("signature", signature);
    let (rms, alpha) = (signed.layout().distortion_rms(), signed.layout().alpha());
    let distortion = format!("RMS {:.4} % of the diagonal (α = {alpha:.3e})", 100.0 * rms);
    lines.field("distortion", distortion);
    lines.field("facets turn", turned(turn));
    lines.field("time", report::seconds_text(seconds));
    let written = format!("{} and {}", task.output.display(), task.certificate.display());
    lines.field("written", written);
    lines.line(format!(
        "Keep {model} and the certificate: both are needed to verify, and whoever has both can remove the mark."
    ));
    lines
}

/// What was done, of many copies.
pub(super) fn copies(model: &Path, made: &Made<'_>, seconds: &Seconds) -> Lines {
    let (new, all) = (made.new_ones(), made.copies.len());
    let model = model.display();
    let headline = format!("Made {} of {model}", report::counted(new, "copy", "copies"));
    let mut lines = Lines::new(match new == all {
        true => headline,
        false => format!(
            "{headline}; {} of {} were there",
            report::grouped(all - new),
            report::grouped(all)
        ),
    });
    let (prediction, layout) = (made.prepared.prediction(), made.prepared.layout());
    let chips = report::counted(prediction.chips, "chip", "chips");
    let bits = prediction.payload_bits;
    let signature = format!("{bits} bits in {chips}, read back from every new file as written");
    lines.field("signatures", signature);
    lines.field(
        "distortion",
        format!(
            "RMS {:.4} % of the diagonal (α = {:.3e})",
            100.0 * prediction.distortion_rms,
            layout.alpha()
        ),
    );
    lines.field("time", report::seconds_text(seconds));
    lines.field("who has which", made.index.display());
    if let Some(copy) = made.copies.first() {
        let (name, output) = (&copy.recipient, copy.task.output.display());
        lines.line(format!(
            "Send all that lies in a recipient's folder but the certificate, such as {output} to {name}."
        ));
    }
    lines.line(format!(
        "Keep {model}, the certificates and the list to yourself: original and certificate are needed to verify, and whoever has both can remove the mark."
    ));
    lines
}
