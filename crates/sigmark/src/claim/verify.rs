use std::sync::Arc;

use job::Job;
use mesh::{LargeParts, Rig, TriMesh, components};
use registration::{AlignOptions, Alignment, MatchedBy, PreparedMesh};

use super::{
    Certificate, Compared, Mismatch, Outcome, SigmarkError, Statement, Verdict,
    decoder::Decoder,
    error::check_bound,
    keys::PublicKey,
    marked_part::MarkedPart,
    statistics::{correlation, margin, p_of_chosen, read_and_wrong},
};
use crate::{
    mark::{
        Detector, Found, FoundParts, JointEstimator, MarkLayout, Original, Patches, Reader, Reading,
        ReadingMethod, Recognised, SoftBits, Wanted,
    },
    payload::GeometryDigest,
};

/// Judges suspects against one original and its certificate.
///
/// What it computes of the original is kept for the next suspect.
#[derive(Clone, Debug)]
pub struct Verifier {
    reader: Arc<Reader>,
    method: ReadingMethod,
    certificate: Arc<Certificate>,
    parts: Arc<[MarkedPart]>,
    /// The given file, where it is not the one that was signed.
    recognised: Option<Arc<Recognised>>,
    rig: Option<Arc<Rig>>,
    p_bound: f64,
    enough: Option<f64>,
    paper_profile: bool,
}

impl Verifier {
    /// Checks that original, certificate and public key belong together, and cuts the original as the certificate says.
    ///
    /// # Errors
    /// [`SigmarkError::AnotherKey`], [`SigmarkError::AnotherOriginal`] or [`SigmarkError::AnotherCut`] where they don't.
    pub fn new(
        original: &TriMesh,
        certificate: &Certificate,
        public_key: &PublicKey,
    ) -> Result<Self, SigmarkError> {
        check_key(certificate, public_key)?;
        check_digest(certificate, GeometryDigest::of(original))?;
        Self::expecting(&cut_as(original, certificate.statement())?, certificate)
    }

    /// As [`new`](Self::new), with a file of the original's geometry in another order, at another precision, in another unit or with another axis upward, which is
    /// recognised by the certificate's [sketch](Certificate::sketch_for). For the owner's information: verdicts say so, and none is evidence.
    ///
    /// # Errors
    /// As [`new`](Self::new); [`SigmarkError::AnotherOriginal`] where the geometry is not recognised.
    pub fn for_owner(
        given: &TriMesh,
        certificate: &Certificate,
        public_key: &PublicKey,
    ) -> Result<Self, SigmarkError> {
        check_key(certificate, public_key)?;
        let statement = certificate.statement();
        let unknown = || another_original(certificate, GeometryDigest::of(given));
        let sketch = certificate.sketch_for(given).ok_or_else(unknown)?;
        let recognised = sketch.recognise(given).ok_or_else(unknown)?;
        let patches = Patches::from_labels(&recognised.mesh, sketch.labels())?;
        if patches.labels() != sketch.labels() {
            return Err(unknown());
        }
        let mesh = recognised.mesh.clone();
        let original = Original::with_patches(mesh, patches, statement.functions.clone())?
            .with_laplacian(statement.laplacian)
            .with_borders(statement.carrier.borders())
            .resembling(certificate.last_eigenvalues().to_vec(), sketch.opposite())?;
        let mut verifier = Self::of(Arc::new(original), certificate)?;
        let numbers = components(given).of_vertex;
        let mut parts = verifier.parts.to_vec();
        for part in &mut parts {
            part.vertex = recognised.vertex_of[part.vertex] as usize;
            part.number = numbers[part.vertex] as usize;
        }
        verifier.parts = parts.into();
        verifier.recognised = Some(Arc::new(recognised));
        Ok(verifier)
    }

    /// As [`new`](Self::new), with an original that was cut into patches already, and its bases if it keeps them.
    ///
    /// # Errors
    /// As [`new`](Self::new); when it was cut for another number of bits or chips.
    pub fn with_original(
        original: &Original,
        certificate: &Certificate,
        public_key: &PublicKey,
    ) -> Result<Self, SigmarkError> {
        check_key(certificate, public_key)?;
        check_digest(certificate, GeometryDigest::of(original.mesh()))?;
        let statement = certificate.statement();
        let labels = statement.labels.unpack(original.mesh().vertex_count())?;
        if labels != original.patches().labels()
            || statement.functions != original.functions()
            || statement.laplacian != original.laplacian()
            || statement.carrier.borders() != original.borders()
        {
            return Err(SigmarkError::AnotherCut);
        }
        Self::expecting(original, certificate)
    }

    fn expecting(original: &Original, certificate: &Certificate) -> Result<Self, SigmarkError> {
        let original = original.expecting(certificate.last_eigenvalues().to_vec())?;
        Self::of(Arc::new(original), certificate)
    }

    fn of(original: Arc<Original>, certificate: &Certificate) -> Result<Self, SigmarkError> {
        let statement = certificate.statement();
        let plan = statement.plan(*certificate.statement_hash())?;
        let layout = MarkLayout::new(Arc::clone(&original), plan, statement.alphas.clone())?;
        let layout = Arc::new(layout);
        let method = ReadingMethod::joint(Arc::new(JointEstimator::new(&layout)));
        let method = match statement.scheme.is_of_paper() {
            true => method.with_papers_rule(),
            false => method,
        };
        Ok(Self {
            reader: Arc::new(Reader::new(original.mesh())?),
            method,
            certificate: Arc::new(certificate.clone()),
            parts: MarkedPart::all_of(&original).into(),
            recognised: None,
            rig: None,
            p_bound: 1e-6,
            enough: None,
            paper_profile: false,
        })
    }

    /// What poses the original: a suspect that it posed is read as it was before. That is one more way to the same bits, which every probability counts. A rig that [the certificate does not bind](Certificate::binds) is passed over: it
    /// could have been made to bring the bits about.
    pub fn with_rig(mut self, rig: Option<Rig>) -> Self {
        // A file that was only recognised has its vertices in another order.
        let is_usable = |rig: &Rig| self.recognised.is_none() && self.certificate.binds(rig);
        self.rig = rig.filter(is_usable).map(Arc::new);
        self
    }

    /// The largest p-value that counts as detected; 10⁻⁶ by default.
    pub fn p_bound(mut self, bound: f64) -> Self {
        self.p_bound = bound;
        self
    }

    /// The p-value at which nothing more of a suspect is looked at, though its payload is not read: the answer is then [`Outcome::Detected`], and took fewer patches. None, which is the default, reads on
    /// until the payload is read, or all was looked at. What is above the [bound](Self::p_bound) for being detected counts as that.
    ///
    /// The p-value may be believed as any other: it is multiplied by all looks that there might have been, not by those that were taken.
    pub fn enough(mut self, p: Option<f64>) -> Self {
        self.enough = p;
        self
    }

    /// Judges marks of the paper's profile, too, whose signature is over the message alone: it does not say of which model. Without this
    /// they are refused.
    pub fn paper_profile(mut self, accepted: bool) -> Self {
        self.paper_profile = accepted;
        self
    }

    /// The detector that reads the bits, made for the layout of the mark.
    ///
    /// By default it is the paper's ([`CoefficientDetector`](crate::mark::CoefficientDetector)) for marks of the paper's profile, and the joint estimate
    /// ([`JointEstimator`]) for others. Where all vertices were found again, the paper's, being cheap, comes first.
    pub fn detector<D: Detector + 'static>(mut self, detector: impl FnOnce(&Arc<MarkLayout>) -> D) -> Self {
        let detector = Arc::new(detector(self.method.layout()));
        self.method = self.method.with_detector(detector);
        self
    }

    /// Judges a suspect. The original's bases are computed the first time that they are needed, and kept if they are not huge.
    ///
    /// # Errors
    /// When the original's bases can't be computed or are not those of the certificate; [`SigmarkError::PaperProfile`];
    /// [`SigmarkError::Bound`]; [`SigmarkError::Job`].
    pub fn verify(&self, suspect: impl Into<PreparedMesh>, job: &Job) -> Result<Verdict, SigmarkError> {
        if !self.paper_profile && !self.certificate.statement().binds_original() {
            return Err(SigmarkError::PaperProfile);
        }
        check_bound(self.p_bound)?;
        let verdict = self.verify_in_place(&suspect.into(), job)?;
        Ok(match &self.recognised {
            Some(recognised) => in_given_file(verdict, recognised),
            None => verdict,
        })
    }

    fn verify_in_place(&self, suspect: &PreparedMesh, job: &Job) -> Result<Verdict, SigmarkError> {
        let found = self.reader.find(suspect, job)?;
        let bent = found.in_local_frames(self.method.layout(), job)?;
        // A cropped copy may stand among other things, unless it lies as one on an original that is one.
        let is_whole = self.parts.len() == 1 && found.lies_as_one();
        let large = (!is_whole).then(|| LargeParts::of(suspect.mesh()));
        let has_parts = large.is_some() && (self.parts.len() > 1 || components(suspect.mesh()).count > 1);
        // Each is a way to the same bits, whether or not it is taken: any counts as often as there are.
        let is_bent = bent.is_some() || found.may_be_bent();
        let ways = [has_parts, self.rig.is_some(), is_bent];
        let ways = 1
            + large.as_ref().map_or(0, LargeParts::count)
            + ways.into_iter().map(usize::from).sum::<usize>();
        let expected = self.certificate.bits();
        let decoder = Decoder::new(&self.certificate, &expected).enough(ways, self.least_p());
        let mut verdict = self.weighed(self.verify_whole(&found, &decoder, job)?, ways);
        if let Some(rig) = self.rig.as_ref().filter(|_| !self.is_enough(&verdict))
            && let Some(unposed) = found.unposed(rig, job)?
        {
            let by_rig = self.verify_whole(&unposed, &decoder, job)?;
            verdict = better(verdict, self.weighed(by_rig, ways));
        }
        if has_parts && !self.is_enough(&verdict) {
            let parts = self.reader.find_parts(suspect, self.method.layout(), job)?;
            if !parts.is_empty() {
                let in_parts = self.verify_parts(&parts, &decoder, job)?;
                verdict = better(verdict, self.weighed(in_parts, ways));
            }
        }
        for part in large.iter().flat_map(LargeParts::meshes) {
            if self.is_enough(&verdict) {
                break;
            }
            let share = part.area() / suspect.mesh().area();
            let found = self.reader.find(part, job)?;
            let mut alone = self.weighed(self.verify_whole(&found, &decoder, job)?, ways);
            alone.overlap *= share;
            verdict = better(verdict, alone);
        }
        // Last, since parts that were put back say where each went.
        if let Some(bent) = bent.filter(|_| !self.is_enough(&verdict)) {
            let in_frames = self.verify_whole(&bent, &decoder, job)?;
            verdict = better(verdict, self.weighed(in_frames, ways));
        }
        if !self.is_enough(&verdict)
            && let Some(unbent) = found.unbent(job)?
        {
            let by_surface = self.verify_whole(&unbent, &decoder, job)?;
            verdict = better(verdict, self.weighed(by_surface, ways));
        }
        Ok(verdict)
    }

    /// The p-value at which reading ends; 0 where only the payload will do.
    fn least_p(&self) -> f64 {
        self.enough.map_or(0.0, |p| p.min(self.p_bound))
    }

    /// Whether nothing else is to be tried.
    fn is_enough(&self, verdict: &Verdict) -> bool {
        verdict.outcome == Outcome::Verified
            || verdict.outcome.is_found() && verdict.p_value <= self.least_p()
    }

    /// Judges a suspect as one.
    fn verify_whole(&self, found: &Found, decoder: &Decoder<'_>, job: &Job) -> Result<Verdict, SigmarkError> {
        if let Some(alignment) = found.alignment().filter(|alignment| !alignment.aligned) {
            return Ok(self.does_not_align(alignment));
        }
        let is_enough = |soft: &SoftBits, tries| decoder.is_enough(soft, tries);
        let wanted = Wanted::until(decoder.expected(), &is_enough);
        let reading = found.read(&self.method, wanted, job)?;
        let mut verdict = self.judge(&reading, decoder);
        (verdict.poses, verdict.matched_by) = (found.poses(), found.matched_by());
        if verdict.matched_by.is_bent() {
            verdict.transform = None;
        }
        match found.alignment() {
            Some(alignment) => {
                (verdict.overlap, verdict.coverage) = (alignment.overlap, alignment.coverage);
            }
            None => {
                let by_vertices = ByVertices::of(&reading);
                (verdict.overlap, verdict.coverage) = (by_vertices.overlap, by_vertices.coverage);
                if let Some(mismatch) = by_vertices.mismatch {
                    verdict = self.of_another_shape(verdict, mismatch);
                }
            }
        }
        Ok(verdict)
    }

    /// The verdict on a suspect that has the original's triangles and is another shape: how it lies, and nothing of what was read. A mark can be copied onto any mesh with these triangles, and that does not make
    /// it this model.
    fn of_another_shape(&self, read: Verdict, mismatch: Mismatch) -> Verdict {
        Verdict {
            matched_by: read.matched_by,
            poses: read.poses,
            overlap: read.overlap,
            coverage: read.coverage,
            missing: read.missing,
            residual: read.residual,
            transform: read.transform,
            parts: read.parts,
            ..self.nothing_read(mismatch)
        }
    }

    /// Judges parts of a suspect, each put back by itself.
    fn verify_parts(
        &self,
        found: &FoundParts,
        decoder: &Decoder<'_>,
        job: &Job,
    ) -> Result<Verdict, SigmarkError> {
        let is_enough = |soft: &SoftBits, tries| decoder.is_enough(soft, tries);
        let wanted = Wanted::until(decoder.expected(), &is_enough);
        let read = found.read(&self.method, wanted, job)?;
        let mut verdict = self.judge(&read.reading, decoder);
        verdict.matched_by = MatchedBy::Parts;
        (verdict.overlap, verdict.coverage) = (read.overlap, read.coverage);
        for part in &mut verdict.parts {
            let own = read.parts.iter().find(|(number, _)| *number == part.part);
            part.transform = own.map(|&(_, transform)| transform);
        }
        Ok(verdict)
    }

    /// A verdict that could have been reached in so many ways: its probability counts as often.
    fn weighed(&self, verdict: Verdict, ways: usize) -> Verdict {
        // What is another shape was not read, and nothing was chosen.
        if ways < 2 || verdict.mismatch.is_some() {
            return verdict;
        }
        let p = (ways as f64 * verdict.p_value).min(1.0);
        let outcome = match verdict.outcome {
            Outcome::Detected { .. } if p <= self.p_bound => Outcome::Detected { p },
            Outcome::Verified => Outcome::Verified,
            _ => Outcome::NotFound { p },
        };
        Verdict {
            outcome,
            p_value: p,
            tries: ways.saturating_mul(verdict.tries),
            ..verdict
        }
    }

    /// The original, with its search structures.
    pub fn original(&self) -> &PreparedMesh {
        self.reader.reference()
    }

    /// How many connected parts of the original carry the mark.
    pub fn marked_parts(&self) -> usize {
        self.parts.len()
    }

    /// The claim that is judged.
    pub fn certificate(&self) -> &Certificate {
        &self.certificate
    }

    /// The verdict on a reading, as if by vertices in one pose. To choose it by T gave chance as many tries as there were.
    fn judge(&self, reading: &Reading, decoder: &Decoder<'_>) -> Verdict {
        let expected = decoder.expected();
        let soft = &reading.soft.weights();
        let p = p_of_chosen(expected, reading);
        let [bits, wrong] = read_and_wrong(expected, soft);
        let outcome = match (decoder.is_read(&reading.soft), p <= self.p_bound) {
            (true, _) => Outcome::Verified,
            (false, true) => Outcome::Detected { p },
            (false, false) => Outcome::NotFound { p },
        };
        let diagonal = self.reader.reference().mesh().bounding_box().diagonal();
        Verdict {
            outcome,
            binds_original: self.certificate.statement().binds_original(),
            compared_with: self.compared_with(),
            extraction_rate: Some((bits - wrong) as f64 / bits.max(1) as f64),
            p_value: p,
            correlation: correlation(expected, soft),
            margin: Some(margin(expected, soft)),
            payload: self.certificate.statement().payload,
            soft: Some(reading.soft.clone()),
            bits,
            bit_errors: Some(wrong),
            patches_read: reading.patches_read,
            tries: reading.tries,
            matched_by: MatchedBy::Connectivity,
            poses: 1,
            overlap: 1.0,
            coverage: 1.0,
            missing: reading.missing,
            residual: Some(reading.residual / diagonal),
            transform: Some(reading.transform),
            attack_model: reading.attack_model,
            parts: self
                .parts
                .iter()
                .filter_map(|part| part.found(&reading.seen))
                .collect(),
            marked_parts: self.parts.len(),
            mismatch: None,
        }
    }

    fn compared_with(&self) -> Compared {
        match &self.recognised {
            Some(recognised) => Compared::SameGeometry {
                residual: recognised.residual,
            },
            None => Compared::Original,
        }
    }

    fn does_not_align(&self, alignment: &Alignment) -> Verdict {
        Verdict {
            matched_by: alignment.matched_by,
            overlap: alignment.overlap,
            coverage: alignment.coverage,
            ..self.nothing_read(Mismatch::Surface {
                overlap: alignment.overlap,
                least: AlignOptions::default().least_overlap,
            })
        }
    }

    /// The verdict on another shape, of which nothing is known yet.
    fn nothing_read(&self, mismatch: Mismatch) -> Verdict {
        Verdict {
            outcome: Outcome::NotFound { p: 1.0 },
            binds_original: self.certificate.statement().binds_original(),
            compared_with: self.compared_with(),
            extraction_rate: None,
            p_value: 1.0,
            correlation: 0.0,
            margin: None,
            payload: self.certificate.statement().payload,
            soft: None,
            bits: 0,
            bit_errors: None,
            patches_read: 0,
            tries: 1,
            matched_by: MatchedBy::Surface,
            poses: 0,
            overlap: 0.0,
            coverage: 0.0,
            missing: 1.0,
            residual: None,
            transform: None,
            attack_model: None,
            parts: Vec::new(),
            marked_parts: self.parts.len(),
            mismatch: Some(mismatch),
        }
    }
}

/// How a suspect lies on the original, as its vertices tell, one by one.
pub(super) struct ByVertices {
    /// Share of the suspect's that lie where those of the original do.
    pub(super) overlap: f64,
    /// Share of the original's that are seen there.
    pub(super) coverage: f64,
    /// Whether it is another shape.
    pub(super) mismatch: Option<Mismatch>,
}

impl ByVertices {
    pub(super) fn of(reading: &Reading) -> Self {
        let in_place = reading.in_place;
        let least = AlignOptions::default().least_overlap;
        Self {
            overlap: in_place,
            coverage: in_place * (1.0 - reading.missing),
            mismatch: (in_place < least).then_some(Mismatch::Shape { in_place, least }),
        }
    }
}

/// The second verdict where it says more, but never in place of evidence one that is none. Another shape is not found, however well its vertices agree: brought back from its pose, or part by part, it may
/// be.
fn better(first: Verdict, second: Verdict) -> Verdict {
    let is_evidence_alone = first.is_evidence() && !second.is_evidence();
    let says_more =
        !first.outcome.is_found() || second.outcome == Outcome::Verified || second.p_value < first.p_value;
    match second.outcome.is_found() && says_more && !is_evidence_alone {
        true => second,
        false => first,
    }
}

pub(super) fn check_key(certificate: &Certificate, given: &PublicKey) -> Result<(), SigmarkError> {
    if certificate.public_key() == given {
        return Ok(());
    }
    Err(SigmarkError::AnotherKey {
        certificate: certificate.public_key().fingerprint(),
        given: given.fingerprint(),
    })
}

/// An original with the patches of a statement.
pub(super) fn cut_as(original: &TriMesh, statement: &Statement) -> Result<Original, SigmarkError> {
    let labels = statement.labels.unpack(original.vertex_count())?;
    let patches = Patches::from_labels(original, &labels)?;
    if patches.labels() != labels {
        return Err(SigmarkError::AnotherCut);
    }
    let original = Original::with_patches(original.clone(), patches, statement.functions.clone())?;
    Ok(original
        .with_laplacian(statement.laplacian)
        .with_borders(statement.carrier.borders()))
}

/// Whether a certificate is of the original with a digest.
pub(super) fn check_digest(certificate: &Certificate, found: GeometryDigest) -> Result<(), SigmarkError> {
    match certificate.statement().original.digest == found {
        true => Ok(()),
        false => Err(another_original(certificate, found)),
    }
}

fn another_original(certificate: &Certificate, found: GeometryDigest) -> SigmarkError {
    SigmarkError::AnotherOriginal {
        expected: certificate.statement().original.digest.to_string(),
        found: found.to_string(),
    }
}

/// The verdict with transforms that lead to the given file and not to the one that was signed.
fn in_given_file(mut verdict: Verdict, recognised: &Recognised) -> Verdict {
    let back = recognised.transform.inverse();
    verdict.transform = verdict.transform.map(|transform| transform.then(&back));
    for part in &mut verdict.parts {
        part.transform = part.transform.map(|transform| transform.then(&back));
    }
    verdict
}
