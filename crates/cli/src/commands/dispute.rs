use std::{path::Path, sync::Arc};

use anyhow::{Context, Result};
use job::JobError;
use mesh_io::Asset;
use registration::{MatchedBy, PreparedMesh};
use serde_json::json;
use sigmark::{
    Dispute, Precedence, SigmarkError, Verdict, Verifier,
    claim::{Read, Tie},
};

use super::verify::{caveat, described, probability, recognised_by, remark};
use crate::{
    Answer, args,
    claims::{Claim, ClaimFiles},
    files,
    progress::Progress,
    report::{self, Lines, Seconds},
    stamps::Stamps,
};

pub(crate) fn run(arguments: &args::Dispute) -> Result<Answer> {
    let progress = Arc::new(Progress::within(arguments.time_limit.duration()));
    progress.begin("reading", "reading");
    let paths = [&*arguments.first, &*arguments.second];
    let [first, second] = paths.map(|path| ClaimFiles::listed_in(path)?.read());
    let claims = [first?, second?];
    let roots = arguments.stamp_roots.as_deref();
    let [first, second] = claims
        .each_ref()
        .map(|claim| Stamps::of(&claim.certificate, roots));
    let stamps = [first?, second?];
    let [first, second] = [0, 1].map(|i| verifier(&claims[i], paths[i]));
    let verifiers = [first?, second?];
    let suspect = arguments.suspect.as_deref().map(files::open_mesh).transpose()?;
    let suspect = suspect.as_ref().map(Asset::scene).transpose()?;
    let suspect = suspect.map(|mesh| PreparedMesh::from(mesh.into_owned()));
    let job = progress.job(arguments.common.threads());
    let dispute = Dispute::between(&verifiers[0], &verifiers[1], suspect.as_ref(), &job);
    let dispute = dispute.map_err(|error| match error {
        SigmarkError::Job(JobError::Cancelled) => arguments.time_limit.exceeded(),
        error => error.into(),
    })?;
    let seconds = progress.finish();

    let described = |read: &Read, i: usize| match read {
        Ok(verdict) => json!(described(verdict, &claims[i])),
        Err(error) => json!({ "error": error.to_string() }),
    };
    let suspect = dispute.in_suspect.as_ref();
    let object = json!({
        "outcome": dispute.outcome.name(),
        "reasons": reasons(&dispute, paths),
        "first_in_second": described(&dispute.first_in_second, 0),
        "second_in_first": described(&dispute.second_in_first, 1),
        "first_in_suspect": suspect.map(|[first, _]| described(first, 0)),
        "second_in_suspect": suspect.map(|[_, second]| described(second, 1)),
        "stamps": stamps.each_ref().map(Stamps::json),
        "stamps_refused": stamps.each_ref().map(Stamps::refused_json),
        "seconds": report::seconds_json(&seconds),
    });
    let lines = summary(arguments, &dispute, &claims, &stamps, &seconds);
    report::print(arguments.common.json, &object, &lines)?;
    Ok(match dispute.outcome {
        Precedence::First | Precedence::Second => Answer::Yes,
        _ => Answer::No,
    })
}

fn verifier(claim: &Claim, path: &Path) -> Result<Verifier> {
    claim.verifier().with_context(|| path.display().to_string())
}

fn summary(
    arguments: &args::Dispute,
    dispute: &Dispute,
    claims: &[Claim; 2],
    stamps: &[Stamps; 2],
    seconds: &Seconds,
) -> Lines {
    let first = arguments.first.display();
    let headline = match dispute.outcome {
        Precedence::First => format!("FIRST: the claim of {first} came first"),
        Precedence::Second => format!("SECOND: the claim of {} came first", arguments.second.display()),
        _ => "UNDECIDED: the originals do not say which claim came first".into(),
    };
    let mut lines = Lines::new(headline);
    for reason in reasons(dispute, [&arguments.first, &arguments.second]) {
        lines.field("reason", reason);
    }
    let mut reading = |name: &str, read: &Read| lines.field(name, how_read(read));
    reading("1st in 2nd", &dispute.first_in_second);
    reading("2nd in 1st", &dispute.second_in_first);
    if let Some([first, second]) = &dispute.in_suspect {
        reading("1st in suspect", first);
        reading("2nd in suspect", second);
    }
    for (name, claim) in ["1st key", "2nd key"].into_iter().zip(claims) {
        lines.field(name, claim.public_key.fingerprint());
    }
    for (name, stamps) in ["1st existed", "2nd existed"].into_iter().zip(stamps) {
        stamps.tell(name, &mut lines);
    }
    lines.field("time", report::seconds_text(seconds));
    lines
}

/// How a mark was read in an original or in the suspect.
fn how_read(read: &Read) -> String {
    let verdict = match read {
        Ok(verdict) => verdict,
        Err(error) => return format!("it can't be read there: {error}"),
    };
    let p = probability(verdict.p_value);
    match (verdict.mismatch, verdict.is_evidence()) {
        (Some(mismatch), _) => remark(mismatch),
        (None, true) => {
            let by = bent(verdict).map(|by| format!(" ({})", recognised_by(by)));
            let by = by.unwrap_or_default();
            format!("its mark is there{by}: chance explains it with probability {p} at most")
        }
        (None, false) => format!("its mark is not proven there: p = {p}, and 2^-120 is asked for"),
    }
}

/// By what a mark was read of a mesh in another pose.
fn bent(verdict: &Verdict) -> Option<MatchedBy> {
    verdict.registration().filter(|by| by.is_bent())
}

/// What the outcome rests on, and what would decide where nothing does.
fn reasons(dispute: &Dispute, [first, second]: [&Path; 2]) -> Vec<String> {
    let mut reasons = vec![String::from(match dispute.outcome {
        Precedence::First => "the first's mark is in the second's original, whose mark is not in the first's",
        Precedence::Second => {
            "the second's mark is in the first's original, whose mark is not in the second's"
        }
        Precedence::Undecided(Tie::Both) => {
            "each original bears the other's mark, so both were made from models that were signed before: the originals that \
             bear no mark would decide"
        }
        Precedence::Undecided(Tie::Unrelated) => {
            "the two originals are different shapes: both claims can be true, each of its own model"
        }
        Precedence::Undecided(Tie::Unread) => {
            "neither bears the other's mark as far as the claims can be read, and one of them can't"
        }
        _ => {
            "the originals are the same shape, and neither bears the other's mark: time stamps from before the dispute would \
             decide, or an earlier state of the model"
        }
    })];
    let crosswise = [
        (&dispute.first_in_second, first),
        (&dispute.second_in_first, second),
    ];
    for (read, claim) in crosswise {
        match read {
            Ok(verdict) if verdict.is_evidence() => {
                let caveat = bent(verdict).and_then(caveat);
                reasons.extend(caveat.map(|caveat| format!("of the mark of {}: {caveat}", claim.display())));
            }
            Ok(_) => {}
            Err(error) => reasons.push(format!(
                "the mark of {} can't be read, and proves nothing: {error}",
                claim.display()
            )),
        }
    }
    reasons.extend(dispute.suspect_bears().map(|bears| {
        String::from(match bears {
            [true, true] => "the suspect bears both marks",
            [true, false] => "the suspect bears the first's mark, and not the second's",
            [false, true] => "the suspect bears the second's mark, and not the first's",
            [false, false] => "the suspect bears neither mark",
        })
    }));
    reasons
}
