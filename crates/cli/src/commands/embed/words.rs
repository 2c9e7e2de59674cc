//! What `embed` says to people.

use quality::{FacetTurn, TurnSummary};
use sigmark::{Prediction, Signed, claim::bits_for, mark::Original};

use super::Task;
use crate::report::{self, Lines, Seconds};

/// What is about to be done, and what it will be good for.
pub(super) fn planned(task: &Task, original: &Original, prediction: &Prediction, is_raised: bool) -> Lines {
    let mut lines = Lines::new(format!("Signing {}", task.model.display()));
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
    let scheme = signed.certificate().statement().scheme;
    let model = task.model.display();
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
    let written = format!("{} and {}", task.output.display(), task.certificate.display());
    lines.field("written", written);
    lines.line(format!(
        "Keep {model} and the certificate: both are needed to verify, and whoever has both can remove the mark."
    ));
    lines
}
