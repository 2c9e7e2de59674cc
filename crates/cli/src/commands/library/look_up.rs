//! From a suspect to its original: candidates by descriptors, then alignment and reading, the nearest first.

use std::{
    cell::{OnceCell, RefCell},
    collections::BTreeSet,
    path::Path,
};

use anyhow::{Context, Result, bail};
use job::Job;
use library::{Candidate, Index, Library, OriginalRecord, Query};
use mesh::{LargeParts, Rig, Similarity, TriMesh, near_part};
use mesh_io::Asset;
use registration::{AlignOptions, MatchedBy, PreparedMesh};
use sigmark::{
    Certificate, GeometryDigest, Outcome, PublicKey, SigmarkError, Verdict, Verifier,
    claim::{EVIDENCE, Tracer},
    mark::MarkError,
};

use crate::{args::Searching, files, keys, report};

/// A library that suspects are looked up in.
pub(super) struct Catalogue {
    pub(super) library: Library,
    pub(super) index: Index,
    /// Whose certificates count, if not everybody's.
    pub(super) key: Option<PublicKey>,
    p_bound: f64,
    most: usize,
    /// The warnings that were given, each of which is given once.
    told: RefCell<BTreeSet<String>>,
}

/// What is known of a candidate.
pub(super) struct Looked {
    pub(super) candidate: Candidate,
    pub(super) record: OriginalRecord,
    /// Those that a search reads with.
    pub(super) certificates: Vec<Certificate>,
    /// Those that it does not: of the paper's profile.
    of_paper: usize,
    /// Those by another key than the one that was asked for.
    pub(super) of_others: usize,
    /// With how many certificates it was read.
    pub(super) read: usize,
    /// None where it was not read.
    pub(super) finding: Option<Finding>,
    /// Whether it was to be read, and has no geometry.
    is_unread: bool,
}

impl Looked {
    /// Whether somebody has a certificate of it, even if no search reads with that.
    pub(super) fn is_claimed(&self) -> bool {
        self.of_paper > 0 || !self.certificates.is_empty()
    }
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
    /// How many certificates those are.
    pub(super) certificates: usize,
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
    pub(super) fn open(arguments: &Searching, job: &Job) -> Result<Self> {
        let key = match &arguments.public_key {
            Some(path) => Some(keys::read_public(path)?.0),
            None => None,
        };
        let library = Library::open(&arguments.library)?;
        Ok(Self {
            index: Index::load(&library, job)?,
            library,
            key,
            p_bound: arguments.p_bound,
            most: arguments.candidates,
            told: RefCell::default(),
        })
    }

    /// Looks a suspect up.
    pub(super) fn look_up(&self, suspect: &Asset, path: &Path, job: &Job) -> Result<LookedUp> {
        let shown = || path.display().to_string();
        let suspect = Suspect::of(suspect)?;
        let query = Query::of(suspect.scene.mesh(), job).with_context(shown)?;
        let nearest = self.index.search(&self.library, &query, self.most, job)?;
        let candidates = nearest.into_iter().map(|candidate| self.candidate(candidate));
        let mut candidates: Vec<Looked> = candidates.collect::<Result<_>>()?;
        let is_near = |looked: &&Looked| looked.candidate.is_worth_a_look;
        let (mut readings, mut certificates) = (0, 0);
        for looked in candidates.iter().filter(is_near) {
            readings += groups(&looked.certificates).len();
            certificates += looked.certificates.len();
        }
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
            self.judge(looked, &suspect, p_bound, job).with_context(shown)?;
            looked.is_unread = looked.finding.is_none();
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
        let unread = candidates.iter().filter(|looked| looked.is_unread);
        let unread: Vec<&OriginalRecord> = unread.map(|looked| &looked.record).collect();
        self.tell_unread(&unread, best.is_some(), path)?;
        Ok(LookedUp {
            candidates,
            best,
            readings,
            certificates,
        })
    }

    fn candidate(&self, candidate: Candidate) -> Result<Looked> {
        let record = self.library.original(candidate.original)?;
        let (mut certificates, mut of_paper, mut of_others) = (Vec::new(), 0, 0);
        for stored in self.library.certificates(&record.digest)? {
            // They were checked when they were added; the file may have been anywhere since.
            match Certificate::from_json(&stored.text) {
                Ok(certificate) if self.key.is_some_and(|key| key != *certificate.public_key()) => {
                    of_others += 1;
                }
                Ok(certificate) if certificate.statement().binds_original() => certificates.push(certificate),
                Ok(_) => of_paper += 1,
                Err(error) => report::warning(&format!(
                    "{}: a certificate of {} is passed over: {error}",
                    self.library.path().display(),
                    record.name
                )),
            }
        }
        if of_paper > 0 && candidate.is_worth_a_look {
            self.warn(format!(
                "{}: {} of {} passed over: of the paper's profile, which `sigmark verify --profile paper` reads",
                self.library.path().display(),
                report::counted(of_paper, "certificate", "certificates"),
                record.name
            ));
        }
        Ok(Looked {
            candidate,
            record,
            certificates,
            of_paper,
            of_others,
            read: 0,
            finding: None,
            is_unread: false,
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
        Ok(None)
    }

    /// Says which originals could not be looked at. Where nothing else was found, the suspect may be one of them.
    fn tell_unread(&self, unread: &[&OriginalRecord], is_found: bool, suspect: &Path) -> Result<()> {
        let of = |records: &[&OriginalRecord]| {
            let names: Vec<String> = records.iter().map(|record| record.name.clone()).collect();
            let library = self.library.path().display();
            format!(
                "the geometry of {} was not kept, and its file is gone or has changed; add it again: sigmark library add FILE --library {library}",
                report::listed(&names)
            )
        };
        if !is_found && !unread.is_empty() {
            bail!(
                "{}: can't be judged: it resembles what can't be read: {}",
                suspect.display(),
                of(unread)
            );
        }
        for record in unread {
            self.warn(of(&[record]));
        }
        Ok(())
    }

    fn warn(&self, warning: String) {
        if !self.told.borrow().contains(&warning) {
            report::warning(&warning);
            self.told.borrow_mut().insert(warning);
        }
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

    /// Lays a suspect onto a candidate, and reads it with its certificates until a mark is found. What has no geometry stays without a finding.
    fn judge(&self, looked: &mut Looked, suspect: &Suspect<'_>, p_bound: f64, job: &Job) -> Result<()> {
        let Some(mesh) = self.geometry(&looked.record)? else {
            return Ok(());
        };
        let rig = self.rig(looked)?;
        let original = (&mesh, rig.as_ref());
        for group in groups(&looked.certificates) {
            let found = match group.as_slice() {
                [one] => verify(original, &looked.certificates, *one, &suspect.scene, p_bound, job)
                    .map(|finding| Some((finding, 1))),
                several => self.trace(original, looked, several, &suspect.scene, p_bound, job),
            };
            match found {
                Ok(Some((finding, read))) => {
                    looked.read += read;
                    let is_marked = matches!(finding, Finding::Marked(_));
                    if is_marked || looked.finding.is_none() {
                        looked.finding = Some(finding);
                    }
                    if is_marked {
                        return Ok(());
                    }
                }
                Ok(None) => {}
                Err(error) => self.pass_over(looked, error)?,
            }
        }
        if !matches!(looked.finding, Some(Finding::Marked(_) | Finding::Shape(_))) {
            looked.finding = Some(suspect.laid_on(&mesh, looked.finding.is_none(), job)?);
        }
        Ok(())
    }

    /// Says that a certificate is of no use, unless it is the suspect that can't be read, or nothing is to be read any more.
    fn pass_over(&self, looked: &Looked, error: SigmarkError) -> Result<(), SigmarkError> {
        match error {
            SigmarkError::Job(_) | SigmarkError::Mark(MarkError::Registration(_) | MarkError::Mesh(_)) => {
                Err(error)
            }
            error => {
                let name = &looked.record.name;
                report::warning(&format!("a certificate of {name} can't be read with: {error}"));
                Ok(())
            }
        }
    }

    /// Names the buyer, as `sigmark trace` does, and judges by his certificate. Tells how many were asked for; nothing where none can be.
    fn trace(
        &self,
        (mesh, rig): Posable<'_>,
        looked: &Looked,
        group: &[usize],
        suspect: &PreparedMesh,
        p_bound: f64,
        job: &Job,
    ) -> Result<Option<(Finding, usize)>, SigmarkError> {
        let certificates = &looked.certificates;
        let tracer = Tracer::new(mesh, certificates[group[0]].public_key())?;
        let mut tracer = tracer.p_bound(p_bound).with_rig(rig.cloned());
        let mut added = Vec::new();
        for &number in group {
            match tracer.add(&certificates[number].clone().into()) {
                Ok(_) => added.push(number),
                Err(error) => self.pass_over(looked, error)?,
            }
        }
        if added.is_empty() {
            return Ok(None);
        }
        let trace = tracer.trace(suspect, job)?;
        let accused = trace.accused.first();
        let finding = match accused.and_then(|accused| Some((accused, *added.get(accused.candidate)?))) {
            Some((accused, number)) => Finding::Marked(Box::new(Marked {
                verdict: verdict((mesh, rig), &certificates[number], suspect, p_bound, job)?,
                certificate: number,
                p_value: accused.p_value,
                margin: Some(accused.margin),
            })),
            None if trace.mismatch.is_none() && trace.registration().is_some() => Finding::Shape(Lying {
                overlap: trace.overlap,
                coverage: trace.coverage,
                transform: trace.transform,
                registration: trace.registration(),
            }),
            None => Finding::Another,
        };
        Ok(Some((finding, added.len())))
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
    original: Posable<'_>,
    certificates: &[Certificate],
    number: usize,
    suspect: &PreparedMesh,
    p_bound: f64,
    job: &Job,
) -> Result<Finding, SigmarkError> {
    let verdict = verdict(original, &certificates[number], suspect, p_bound, job)?;
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

/// What `sigmark verify` says by a certificate.
fn verdict(
    (mesh, rig): Posable<'_>,
    certificate: &Certificate,
    suspect: &PreparedMesh,
    p_bound: f64,
    job: &Job,
) -> Result<Verdict, SigmarkError> {
    let verifier = Verifier::new(mesh, certificate, certificate.public_key())?.with_rig(rig.cloned());
    verifier.p_bound(p_bound).verify(suspect, job)
}

/// What is looked up.
struct Suspect<'a> {
    asset: &'a Asset,
    scene: PreparedMesh,
    /// What of it may be an original where all of it is none.
    parts: OnceCell<Vec<PreparedMesh>>,
}

impl<'a> Suspect<'a> {
    fn of(asset: &'a Asset) -> Result<Self> {
        Ok(Self {
            asset,
            scene: asset.scene()?.into_owned().into(),
            parts: OnceCell::new(),
        })
    }

    /// What stands beside other things, and what its file holds once and shows several times, as originals are kept.
    fn parts(&self) -> &[PreparedMesh] {
        self.parts.get_or_init(|| {
            let near = near_part(self.scene.mesh());
            let large = LargeParts::of(near.as_ref().unwrap_or(self.scene.mesh()));
            let mut parts: Vec<PreparedMesh> = large.meshes().map(PreparedMesh::from).collect();
            let once = self.asset.mesh();
            if once.triangle_count() < self.scene.mesh().triangle_count() {
                parts.insert(0, once.into());
            }
            parts.extend(near.map(PreparedMesh::from));
            parts
        })
    }

    /// The surface is all there is to compare, without a certificate or where no mark was found: of all of it, where no certificate asked, and of its parts.
    fn laid_on(&self, mesh: &TriMesh, asks_all: bool, job: &Job) -> Result<Finding> {
        let all = asks_all.then_some(&self.scene).into_iter();
        let parts = std::iter::once_with(|| self.parts()).flatten();
        for suspect in all.chain(parts) {
            let aligned = registration::align(mesh, suspect, &AlignOptions::default(), job)?;
            if aligned.aligned {
                return Ok(Finding::Shape(Lying {
                    overlap: aligned.overlap,
                    coverage: aligned.coverage,
                    transform: Some(aligned.transform),
                    registration: Some(aligned.matched_by),
                }));
            }
        }
        Ok(Finding::Another)
    }
}
