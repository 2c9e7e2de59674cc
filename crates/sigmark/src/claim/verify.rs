use std::sync::Arc;

use job::Job;
use mesh::{TriMesh, Vec3};
use registration::{AlignOptions, Alignment, MatchedBy, PreparedMesh};

use super::{
    Certificate, Mismatch, Outcome, SigmarkError, Verdict,
    keys::PublicKey,
    statistics::{correlation, extraction_rate, p_value},
};
use crate::{
    mark::{
        ChipLayout, Detector, JointEstimator, MarkLayout, Original, Patches, Reader, Reading, ReadingMethod,
        Registered,
    },
    payload::{GeometryDigest, Signature},
};

/// Judges suspects against one original and its certificate.
///
/// What it computes of the original is kept for the next suspect.
#[derive(Clone, Debug)]
pub struct Verifier {
    reader: Arc<Reader>,
    method: ReadingMethod,
    certificate: Arc<Certificate>,
    p_bound: f64,
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
        check_digest(certificate, original)?;
        let mark = certificate.mark();
        let patches = Patches::from_labels(original, &mark.labels.unpack(original.vertex_count())?)?;
        if patches.len() != mark.patches.len() {
            return Err(SigmarkError::AnotherCut);
        }
        let original = Original::with_patches(original.clone(), layout(certificate)?, patches);
        Self::of(&original.with_laplacian(mark.laplacian), certificate)
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
        check_digest(certificate, original.mesh())?;
        original.layout().check(&layout(certificate)?)?;
        let mark = certificate.mark();
        let labels = mark.labels.unpack(original.mesh().vertex_count())?;
        if labels != original.patches().labels() || mark.laplacian != original.laplacian() {
            return Err(SigmarkError::AnotherCut);
        }
        Self::of(original, certificate)
    }

    fn of(original: &Original, certificate: &Certificate) -> Result<Self, SigmarkError> {
        let mark = certificate.mark();
        let eigenvalues = mark.patches.iter().map(|patch| patch.last_eigenvalue);
        let alphas = mark.patches.iter().map(|patch| patch.alpha);
        let original = Arc::new(original.expecting(eigenvalues.collect())?);
        let layout = Arc::new(MarkLayout::new(Arc::clone(&original), alphas.collect())?);
        let method = ReadingMethod::joint(Arc::new(JointEstimator::new(&layout)));
        let method = match mark.signature.scheme().is_of_paper() {
            true => method.with_papers_rule(),
            false => method,
        };
        Ok(Self {
            reader: Arc::new(Reader::new(original.mesh())?),
            method,
            certificate: Arc::new(certificate.clone()),
            p_bound: 1e-6,
        })
    }

    /// The largest p-value that counts as detected; 10⁻⁶ by default.
    pub fn p_bound(mut self, bound: f64) -> Self {
        self.p_bound = bound;
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
    /// When the original's bases can't be computed or are not those of the certificate; [`SigmarkError::Job`].
    pub fn verify(&self, suspect: impl Into<PreparedMesh>, job: &Job) -> Result<Verdict, SigmarkError> {
        let found = self.reader.find(suspect, job)?;
        if let Some(alignment) = found.alignment().filter(|alignment| !alignment.aligned) {
            return Ok(self.does_not_align(alignment));
        }
        let expected = self.certificate.mark().signature.bits();
        let reading = found.read(&self.method, &expected, job)?;
        let mut verdict = self.judge(&reading, &expected)?;
        verdict.poses = found.poses();
        match found.alignment() {
            Some(alignment) => {
                verdict.matched_by = alignment.matched_by;
                (verdict.overlap, verdict.coverage) = (alignment.overlap, alignment.coverage);
            }
            None => {
                let in_place = self.in_place(&reading.registered);
                (verdict.overlap, verdict.coverage) = (in_place, in_place);
                let least = AlignOptions::default().least_overlap;
                let elsewhere = matches!(verdict.outcome, Outcome::NotFound { .. }) && in_place < least;
                verdict.mismatch = elsewhere.then_some(Mismatch::Shape { in_place, least });
            }
        }
        Ok(verdict)
    }

    /// The share of the vertices that lie near where they belong.
    fn in_place(&self, registered: &Registered) -> f64 {
        let original = self.reader.reference().mesh();
        let bound = AlignOptions::default().tolerance * original.bounding_box().diagonal();
        let pairs = registered.positions.iter().zip(original.positions());
        let distances: Vec<f64> = pairs
            .filter_map(|(r, &v)| r.map(|r| (Vec3(r) - Vec3(v)).norm()))
            .collect();
        let near = distances.iter().filter(|&&distance| distance <= bound);
        near.count() as f64 / distances.len().max(1) as f64
    }

    /// The verdict on a reading, as if by vertices in one pose. To choose it by T gave chance as many tries as there were.
    fn judge(&self, reading: &Reading, expected: &[bool]) -> Result<Verdict, SigmarkError> {
        let extracted = reading.soft.hard();
        let p = (p_value(expected, &reading.soft.0) * reading.tries as f64).min(1.0);
        let read = Signature::from_bits(self.certificate.mark().signature.scheme(), &extracted)?;
        let checks = self
            .certificate
            .public_key()
            .verify(&self.certificate.signed_bytes(), &read)
            .is_ok();
        let outcome = match (checks, p <= self.p_bound) {
            (true, _) => Outcome::Verified,
            (false, true) => Outcome::Detected { p },
            (false, false) => Outcome::NotFound { p },
        };
        let diagonal = self.reader.reference().mesh().bounding_box().diagonal();
        Ok(Verdict {
            outcome,
            extraction_rate: Some(extraction_rate(expected, &extracted)),
            p_value: p,
            correlation: correlation(expected, &reading.soft.0),
            bits: expected.len(),
            bit_errors: Some(expected.iter().zip(&extracted).filter(|(s, e)| s != e).count()),
            matched_by: MatchedBy::Connectivity,
            poses: 1,
            overlap: 1.0,
            coverage: 1.0,
            missing: reading.registered.missing(),
            residual: Some(reading.residual / diagonal),
            transform: Some(reading.transform),
            attack_model: reading.attack_model,
            mismatch: None,
        })
    }

    fn does_not_align(&self, alignment: &Alignment) -> Verdict {
        Verdict {
            outcome: Outcome::NotFound { p: 1.0 },
            extraction_rate: None,
            p_value: 1.0,
            correlation: 0.0,
            bits: self.certificate.mark().signature.scheme().bits(),
            bit_errors: None,
            matched_by: alignment.matched_by,
            poses: 0,
            overlap: alignment.overlap,
            coverage: alignment.coverage,
            missing: 1.0,
            residual: None,
            transform: None,
            attack_model: None,
            mismatch: Some(Mismatch::Surface {
                overlap: alignment.overlap,
                least: AlignOptions::default().least_overlap,
            }),
        }
    }
}

fn layout(certificate: &Certificate) -> Result<ChipLayout, SigmarkError> {
    let mark = certificate.mark();
    Ok(ChipLayout::new(mark.signature.scheme().bits(), mark.chip_rate)?)
}

fn check_key(certificate: &Certificate, given: &PublicKey) -> Result<(), SigmarkError> {
    if certificate.public_key() == given {
        return Ok(());
    }
    Err(SigmarkError::AnotherKey {
        certificate: certificate.public_key().fingerprint(),
        given: given.fingerprint(),
    })
}

fn check_digest(certificate: &Certificate, original: &TriMesh) -> Result<(), SigmarkError> {
    let (expected, found) = (certificate.original().digest, GeometryDigest::of(original));
    if expected == found {
        return Ok(());
    }
    Err(SigmarkError::AnotherOriginal {
        expected: expected.to_string(),
        found: found.to_string(),
    })
}
