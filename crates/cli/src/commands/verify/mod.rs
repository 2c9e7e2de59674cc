mod words;

use std::{path::Path, sync::Arc, time::SystemTime};

use anyhow::{Result, anyhow, ensure};
use job::JobError;
use serde_json::{Map, Value, json};
use sigmark::{GeometryDigest, Outcome, SigmarkError, Verdict, Verifier, claim::EVIDENCE, mark::MarkError};

use crate::{
    Answer,
    args::{Profile, Verify},
    batch::Found,
    claims::{Claim, ClaimFiles},
    figures, files,
    progress::Progress,
    report,
    report_page::Page,
    stamps::Stamps,
    suspects::{Inquiry, Session},
};

pub(crate) use words::{caveat, found_parts, probability, recognised_by, registered, remark};

pub(crate) fn run(arguments: &Verify) -> Result<Answer> {
    check_enough(arguments)?;
    let report = arguments.report.as_ref();
    let session = Session::begin(report, arguments.force, &arguments.time_limit, &arguments.common);
    session.check_report(&[
        (Some(&arguments.certificate), "the certificate"),
        (arguments.original.as_ref(), "the original"),
        (arguments.public_key.as_ref(), "the public key"),
        (arguments.stamp_roots.as_ref(), "the list of root certificates"),
    ])?;
    let files = ClaimFiles {
        certificate: arguments.certificate.clone(),
        original: arguments.original.clone(),
        public_key: arguments.public_key.clone(),
    };
    let claim = files.read()?;
    let roots = arguments.stamp_roots.as_deref();
    let stamps = Stamps::of(&claim.certificate, roots)?;
    // What was looked for.
    session.check_apart_from(&claim.original_path, "the original", &claim.original)?;
    let suspects = session.listed(&arguments.suspects)?;
    let inquiry = Judging::new(arguments, &session, claim, stamps, &suspects)?;
    let page = arguments.report.as_ref().map(|_| inquiry.page());
    session.judge(&&inquiry, &suspects, page, "Found in")
}

/// Nobody stops looking where nothing is found yet.
fn check_enough(arguments: &Verify) -> Result<()> {
    let Some(enough) = arguments.enough else {
        return Ok(());
    };
    let bound = arguments.p_bound;
    ensure!(
        enough <= bound,
        "--enough {enough:e} is too much: nothing counts as detected above --p-bound {bound:e}"
    );
    ensure!(
        !arguments.dispute || enough <= EVIDENCE,
        "--enough {enough:e} is too much for --dispute, which asks for evidence: give {EVIDENCE:.1e} at most"
    );
    Ok(())
}

/// A claim, by which suspects are judged one after the other.
pub(crate) struct Judging<'a> {
    arguments: &'a Verify,
    session: &'a Session<'a>,
    claim: Claim,
    stamps: Stamps,
    verifier: Verifier,
    /// Among so many claims this one was chosen by what was read of the suspect.
    among: usize,
}

impl<'a> Judging<'a> {
    pub(crate) fn new(
        arguments: &'a Verify,
        session: &'a Session<'a>,
        claim: Claim,
        stamps: Stamps,
        suspects: &[Found],
    ) -> Result<Self> {
        let verifier = claim.verifier_for_owner().map_err(|error| {
            let certificate = || arguments.certificate.clone();
            let first = suspects
                .first()
                .map_or_else(certificate, |found| found.path.clone());
            the_wrong_way_round(&error, suspects, &claim)
                .unwrap_or_else(|| blame(error, arguments, &claim, &first))
        })?;
        let verifier = verifier
            .p_bound(arguments.p_bound)
            .enough(arguments.enough)
            .paper_profile(arguments.profile == Some(Profile::Paper));
        Ok(Self {
            arguments,
            session,
            claim,
            stamps,
            verifier,
            among: 1,
        })
    }

    /// The same, of a claim that was chosen among so many by what was read of the suspect: p counts them all, and is compared with so many times the bound of one.
    pub(crate) fn among(self, claims: usize) -> Self {
        Self {
            among: claims.max(1),
            ..self
        }
    }

    /// A page that nobody was judged on yet.
    fn page(&self) -> Page<'_> {
        Page::new(self.arguments, &self.claim, &self.stamps, SystemTime::now())
    }
}

impl<'a> Inquiry for &'a Judging<'_> {
    type Page = Page<'a>;

    fn judge(&self, path: &Path, progress: &Arc<Progress>, page: Option<&mut Page<'a>>) -> Result<bool> {
        let Judging {
            arguments,
            session,
            claim,
            stamps,
            verifier,
            among,
        } = self;
        let suspect = files::open_mesh(path)?;
        session.check_apart_from(path, "a suspect", &suspect)?;
        let job = progress.job(arguments.common.threads());
        let verdict = verifier
            .verify(&*suspect.scene()?, &job)
            .map_err(|error| blame(error, arguments, claim, path))?;
        let verdict = counting(verdict, *among);
        if let Some(page) = page {
            progress.begin("report", "drawing");
            let judged = page.judged(path, &suspect, &verdict, &job);
            session.within_limit(judged, &job)?;
        }
        let seconds = progress.finish();
        let mut object = described(&verdict, claim);
        object.insert("suspect".into(), json!(path));
        object.insert("stamps".into(), stamps.json());
        object.insert("stamps_refused".into(), stamps.refused_json());
        object.insert("seconds".into(), report::seconds_json(&seconds));
        let lines = words::summary(path, arguments, &verdict, claim, stamps, &seconds);
        report::print(arguments.common.json, &object.into(), &lines)?;
        Ok(is_answered_with_yes(arguments, &verdict))
    }
}

/// The verdict, with a probability that counts so many claims.
fn counting(mut verdict: Verdict, claims: usize) -> Verdict {
    let times = |p: f64| (claims as f64 * p).min(1.0);
    verdict.p_value = times(verdict.p_value);
    verdict.outcome = match verdict.outcome {
        Outcome::Detected { p } => Outcome::Detected { p: times(p) },
        Outcome::NotFound { p } => Outcome::NotFound { p: times(p) },
        read => read,
    };
    verdict
}

/// Whether a suspect bears what was asked for: the mark, or evidence.
pub(crate) fn is_answered_with_yes(arguments: &Verify, verdict: &Verdict) -> bool {
    match arguments.dispute {
        true => verdict.is_evidence(),
        false => verdict.outcome.is_found(),
    }
}

/// A verdict as `--json` prints it, but for the time that it took.
pub(crate) fn described(verdict: &Verdict, claim: &Claim) -> Map<String, Value> {
    let mut object = figures::of_verdict(verdict, claim.certificate.statement(), claim.own_key);
    object.extend(figures::members(json!({
        "remark": verdict.mismatch.map(remark),
        "parts": verdict.parts.iter().map(|part| json!({
            "part": part.part,
            "name": claim.original.name_of(part.vertex),
            "seen": part.seen,
            "transform": part.transform.map(|transform| transform.to_matrix()),
        })).collect::<Vec<_>>(),
        "original": claim.original_path,
    })));
    object
}

/// The error with the name of the file that it is about.
fn blame(error: SigmarkError, arguments: &Verify, claim: &Claim, suspect: &Path) -> anyhow::Error {
    let file: &Path = match error {
        SigmarkError::Job(JobError::Cancelled) => return arguments.time_limit.exceeded_at(suspect),
        SigmarkError::PaperProfile => {
            let certificate = arguments.certificate.display();
            return anyhow!("{certificate}: {error}; ask for --profile paper to have it read all the same");
        }
        SigmarkError::AnotherKey { .. } => arguments.public_key.as_deref().unwrap_or(&arguments.certificate),
        SigmarkError::Certificate(_) => &arguments.certificate,
        SigmarkError::Mark(MarkError::Registration(_) | MarkError::Mesh(_)) => suspect,
        _ => &claim.original_path,
    };
    anyhow::Error::new(error).context(file.display().to_string())
}

/// Where a suspect is the original that the certificate names.
fn the_wrong_way_round(error: &SigmarkError, suspects: &[Found], claim: &Claim) -> Option<anyhow::Error> {
    let digest = claim.certificate.statement().original.digest;
    let is_original = |found: &&Found| {
        files::open_mesh(&found.path).is_ok_and(|asset| GeometryDigest::of(asset.mesh()) == digest)
    };
    let SigmarkError::AnotherOriginal { .. } = error else {
        return None;
    };
    let suspect = suspects.iter().find(is_original)?.path.display();
    let original = claim.original_path.display();
    Some(anyhow!(
        "{suspect}: is the original, and {original} is not: the two are the wrong way round; \
         try `sigmark verify {original} --original {suspect} …`"
    ))
}
