//! From a suspect to its original: candidates by descriptors, then alignment and reading, the nearest first.

use std::{cell::Cell, path::Path};

use anyhow::{Context, Result};
use job::{Job, JobError};
use library::{Candidate, Index, Library, OriginalRecord, Query};
use mesh::{Rig, Similarity, TriMesh};
use registration::{AlignOptions, MatchedBy, PreparedMesh};
use sigmark::{
    Certificate, GeometryDigest, Outcome, PublicKey, SigmarkError, Verdict, Verifier,
    claim::{EVIDENCE, Tracer},
    mark::MarkError,
};

use crate::{args::Searching, files, interrupt, keys, report};

/// A library that suspects are looked up in.
pub(super) struct Catalogue {
    pub(super) library: Library,
    pub(super) index: Index,
    /// Whose certificates count, if not everybody's.
    pub(super) key: Option<PublicKey>,
    p_bound: f64,
    most: usize,
    /// Whether somebody was told of an original without geometry.
    told: Cell<bool>,
}

/// What is known of a candidate.
pub(super) struct Looked {
    pub(super) candidate: Candidate,
    pub(super) record: OriginalRecord,
    pub(super) certificates: Vec<Certificate>,
    /// None where it was not read.
    pub(super) finding: Option<Finding>,
}

/// What came of laying a suspect onto a candidate.
pub(super) enum Finding {
    /// A mark of one of the certificates.
    Marked(Box<Marked>),
    /// The shape alone.
    Shape(Lying),
    /// It is another shape.
    Another,
}

/// A mark that was found.
pub(super) struct Marked {
    pub(super) verdict: Verdict,
    /// The certificate's number among the candidate's.
    pub(super) certificate: usize,
    /// Of this original's certificates; a search asks for more.
    p_value: f64,
    pub(super) margin: Option<f64>,
}

/// How a suspect lies on an original.
#[derive(Clone, Copy)]
pub(super) struct Lying {
    pub(super) overlap: f64,
    pub(super) coverage: f64,
    pub(super) transform: Option<Similarity>,
    /// What it was recognised by.
    pub(super) registration: Option<MatchedBy>,
}

/// What was found of a suspect.
pub(super) struct LookedUp {
    /// The nearest first.
    pub(super) candidates: Vec<Looked>,
    /// The number of the one that it is.
    pub(super) best: Option<usize>,
    /// With how many certificates, or groups of them that are read at once, it was read, or would have been had nothing been found.
    pub(super) readings: usize,
}

impl Finding {
    /// As `--json` has it.
    pub(super) fn name(&self) -> &'static str {
        match self {
            Self::Marked(marked) if marked.verdict.outcome == Outcome::Verified => "verified",
            Self::Marked(_) => "detected",
            Self::Shape(_) => "shape",
            Self::Another => "another_shape",
        }
    }

    pub(super) fn lying(&self) -> Option<Lying> {
        match self {
            Self::Marked(marked) => Some(Lying {
                overlap: marked.verdict.overlap,
                coverage: marked.verdict.coverage,
                transform: marked.verdict.transform,
                registration: marked.verdict.registration(),
            }),
            Self::Shape(lying) => Some(*lying),
            Self::Another => None,
        }
    }
}

impl LookedUp {
    /// The original that it is.
    pub(super) fn best(&self) -> Option<&Looked> {
        self.candidates.get(self.best?)
    }

    /// p of a mark, all readings counted.
    pub(super) fn p_value(&self, marked: &Marked) -> f64 {
        (marked.p_value * self.readings.max(1) as f64).min(1.0)
    }

    /// Whether it is evidence against strangers, all readings counted.
    pub(super) fn is_evidence(&self, marked: &Marked) -> bool {
        marked.verdict.is_evidence() && self.p_value(marked) <= EVIDENCE
    }
}

impl Catalogue {
    /// Opens a library and reads its descriptors.
    pub(super) fn open(arguments: &Searching) -> Result<Self> {
        let key = match &arguments.public_key {
            Some(path) => Some(keys::read_public(path)?.0),
            None => None,
        };
        let library = Library::open(&arguments.library)?;
        Ok(Self {
            index: Index::load(&library)?,
            library,
            key,
            p_bound: arguments.p_bound,
            most: arguments.candidates,
            told: Cell::new(false),
        })
    }

    /// Looks a suspect up.
    pub(super) fn look_up(&self, suspect: &TriMesh, path: &Path, job: &Job) -> Result<LookedUp> {
        let shown = || path.display().to_string();
        let query = Query::of(suspect, job).with_context(shown)?;
        let nearest = self.index.search(&self.library, &query, self.most, job)?;
        let candidates = nearest.into_iter().map(|candidate| self.candidate(candidate));
        let mut candidates: Vec<Looked> = candidates.collect::<Result<_>>()?;
        let is_near = |looked: &&mut Looked| looked.candidate.is_worth_a_look;
        let readings: usize = candidates
            .iter_mut()
            .filter(is_near)
            .map(|looked| groups(&looked.certificates).len())
            .sum();
        let suspect = PreparedMesh::from(suspect);
        let p_bound = self.p_bound / readings.max(1) as f64;
        let mut best = None;
        for (number, looked) in candidates
            .iter_mut()
            .enumerate()
            .filter(|(_, looked)| looked.candidate.is_worth_a_look)
        {
            // Once the shape is known, another original is asked only for its marks.
            if best.is_some() && looked.certificates.is_empty() {
                continue;
            }
            let found = self.judge(looked, &suspect, p_bound, job).with_context(shown)?;
            looked.finding = found;
            match &looked.finding {
                Some(Finding::Marked(_)) => {
                    best = Some(number);
                    break;
                }
                // Of shapes without a mark the first stands, which is the nearest, while another may have one.
                Some(Finding::Shape(_)) if best.is_none() => best = Some(number),
                _ => {}
            }
        }
        Ok(LookedUp {
            candidates,
            best,
            readings,
        })
    }

    fn candidate(&self, candidate: Candidate) -> Result<Looked> {
        let record = self.library.original(candidate.original)?;
        let mut certificates = Vec::new();
        for stored in self.library.certificates(&record.digest)? {
            // They were checked when they were added; the file may have been anywhere since.
            match Certificate::from_json(&stored.text) {
                Ok(certificate) if self.key.is_none_or(|key| key == *certificate.public_key()) => {
                    certificates.push(certificate);
                }
                Ok(_) => {}
                Err(error) => report::warning(&format!(
                    "{}: a certificate of {} is passed over: {error}",
                    self.library.path().display(),
                    record.name
                )),
            }
        }
        Ok(Looked {
            candidate,
            record,
            certificates,
            finding: None,
        })
    }

    /// The geometry of an original: what is kept, or else what its files hold, if it is still the same.
    pub(super) fn geometry(&self, record: &OriginalRecord) -> Result<Option<TriMesh>> {
        if let Some(mesh) = self.library.geometry(record)? {
            return Ok(Some(mesh));
        }
        for file in self.library.files(record.id)? {
            if let Ok(asset) = files::open_mesh(Path::new(&file.path))
                && GeometryDigest::of(asset.mesh()) == record.digest
            {
                return Ok(Some(asset.mesh().clone()));
            }
        }
        if !self.told.replace(true) {
            report::warning(&format!(
                "{}: the geometry of {} was not kept, and its file is gone or has changed; add it again",
                self.library.path().display(),
                record.name
            ));
        }
        Ok(None)
    }

    /// What poses an original, as one of its files says where a certificate binds it: the library keeps geometry alone.
    pub(super) fn rig(&self, looked: &Looked) -> Result<Option<Rig>> {
        let is_bound = |certificate: &Certificate| certificate.statement().original.rig.is_some();
        if !looked.certificates.iter().any(is_bound) {
            return Ok(None);
        }
        for file in self.library.files(looked.record.id)? {
            let asset = files::open_mesh(Path::new(&file.path)).ok();
            let rig = asset.and_then(|asset| asset.rig().unwrap_or_default());
            if let Some(rig) = rig.filter(|rig| looked.certificates.iter().any(|known| known.binds(rig))) {
                return Ok(Some(rig));
            }
        }
        Ok(None)
    }

    fn judge(
        &self,
        looked: &Looked,
        suspect: &PreparedMesh,
        p_bound: f64,
        job: &Job,
    ) -> Result<Option<Finding>> {
        let Some(mesh) = self.geometry(&looked.record)? else {
            return Ok(None);
        };
        let rig = self.rig(looked)?;
        let original = (&mesh, rig.as_ref());
        let mut best = None;
        for group in groups(&looked.certificates) {
            let found = match group.as_slice() {
                [one] => verify(original, &looked.certificates, *one, suspect, p_bound, job),
                several => trace(original, &looked.certificates, several, suspect, p_bound, job),
            };
            match found {
                Ok(found @ Finding::Marked(_)) => return Ok(Some(found)),
                Ok(found) => best = best.or(Some(found)),
                Err(error @ SigmarkError::Job(_)) => return Err(error.into()),
                Err(error @ SigmarkError::Mark(MarkError::Registration(_) | MarkError::Mesh(_))) => {
                    return Err(error.into());
                }
                Err(error) => {
                    let name = &looked.record.name;
                    report::warning(&format!("a certificate of {name} can't be read with: {error}"));
                }
            }
        }
        match best {
            Some(found) => Ok(Some(found)),
            None => Ok(Some(align(&mesh, suspect, job)?)),
        }
    }
}

/// An original, and what poses it.
type Posable<'a> = (&'a TriMesh, Option<&'a Rig>);

/// The certificates that are read at once: those of one key.
fn groups(certificates: &[Certificate]) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (number, certificate) in certificates.iter().enumerate() {
        let key = |group: &&mut Vec<usize>| certificates[group[0]].public_key() == certificate.public_key();
        match groups.iter_mut().find(key) {
            Some(group) => group.push(number),
            None => groups.push(vec![number]),
        }
    }
    groups
}

/// Judges by one certificate, as `sigmark verify` does.
fn verify(
    (mesh, rig): Posable<'_>,
    certificates: &[Certificate],
    number: usize,
    suspect: &PreparedMesh,
    p_bound: f64,
    job: &Job,
) -> Result<Finding, SigmarkError> {
    let certificate = &certificates[number];
    let verifier = Verifier::new(mesh, certificate, certificate.public_key())?.with_rig(rig.cloned());
    let verdict = verifier.p_bound(p_bound).verify(suspect, job)?;
    Ok(match (verdict.outcome.is_found(), verdict.mismatch) {
        (true, _) => Finding::Marked(Box::new(Marked {
            p_value: verdict.p_value,
            margin: verdict.margin,
            verdict,
            certificate: number,
        })),
        (false, None) => Finding::Shape(Lying {
            overlap: verdict.overlap,
            coverage: verdict.coverage,
            transform: verdict.transform,
            registration: verdict.registration(),
        }),
        (false, Some(_)) => Finding::Another,
    })
}

/// Names the buyer, as `sigmark trace` does, and judges by his certificate.
fn trace(
    (mesh, rig): Posable<'_>,
    certificates: &[Certificate],
    group: &[usize],
    suspect: &PreparedMesh,
    p_bound: f64,
    job: &Job,
) -> Result<Finding, SigmarkError> {
    let tracer = Tracer::new(mesh, certificates[group[0]].public_key())?;
    let mut tracer = tracer.p_bound(p_bound).with_rig(rig.cloned());
    let mut added = Vec::new();
    for &number in group {
        match tracer.add(&certificates[number].clone().into()) {
            Ok(_) => added.push(number),
            // Marks of the paper's profile tell no copies apart.
            Err(SigmarkError::PaperProfile) => {}
            Err(error) => return Err(error),
        }
    }
    let trace = tracer.trace(suspect, job)?;
    let Some((accused, &number)) = trace
        .accused
        .first()
        .and_then(|accused| Some((accused, added.get(accused.candidate)?)))
    else {
        let lying = Lying {
            overlap: trace.overlap,
            coverage: trace.coverage,
            transform: trace.transform,
            registration: trace.registration(),
        };
        return Ok(match trace.mismatch.is_none() && trace.registration().is_some() {
            true => Finding::Shape(lying),
            false => Finding::Another,
        });
    };
    let certificate = &certificates[number];
    let verdict = Verifier::new(mesh, certificate, certificate.public_key())?
        .with_rig(rig.cloned())
        .p_bound(p_bound)
        .verify(suspect, job)?;
    Ok(Finding::Marked(Box::new(Marked {
        verdict,
        certificate: number,
        p_value: accused.p_value,
        margin: Some(accused.margin),
    })))
}

/// Without a certificate the surface is all there is to compare.
fn align(mesh: &TriMesh, suspect: &PreparedMesh, job: &Job) -> Result<Finding> {
    let aligned = registration::align(mesh, suspect, &AlignOptions::default(), job)?;
    Ok(match aligned.aligned {
        true => Finding::Shape(Lying {
            overlap: aligned.overlap,
            coverage: aligned.coverage,
            transform: Some(aligned.transform),
            registration: Some(aligned.matched_by),
        }),
        false => Finding::Another,
    })
}

/// Whether work was stopped, and by the time limit.
pub(super) fn was_stopped(error: &anyhow::Error) -> bool {
    let is_cancelled = |cause: &(dyn std::error::Error + 'static)| {
        cause.downcast_ref::<JobError>() == Some(&JobError::Cancelled)
            || matches!(
                cause.downcast_ref::<SigmarkError>(),
                Some(SigmarkError::Job(JobError::Cancelled))
            )
    };
    !interrupt::is_asked_for() && error.chain().any(is_cancelled)
}
