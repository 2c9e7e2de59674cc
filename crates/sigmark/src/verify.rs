use std::sync::{Arc, OnceLock};

use mesh::{Similarity, TriMesh};
use registration::match_candidates;

use crate::{
    Certificate, ChipLayout, CoefficientDetector, Detector, GeometryDigest, Observer, Original, PatchBasis,
    PatchRecord, Patches, SigmarkError, SoftBits, Stage, Work,
    align::{Aligned, align},
    signature::{PublicKey, Signature},
    statistics::{correlation, extraction_rate, p_value},
};

/// The answer to "is this our model?".
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outcome {
    /// The signature was read back from the shape, bit for bit, and checks against the public key.
    Verified,
    /// Not every bit could be read, but a mesh without the mark would agree this well with probability `p` at most.
    Detected {
        /// See [`p_value`].
        p: f64,
    },
    /// Nothing that chance does not explain.
    NotFound {
        /// See [`p_value`]; 1 where the suspect does not fit the original at all.
        p: f64,
    },
}

/// What was found, and how.
#[derive(Clone, Debug)]
pub struct Verdict {
    /// The answer.
    pub outcome: Outcome,
    /// ER (eq. 18), from 0 to 1; `None` if the suspect does not fit the original.
    pub extraction_rate: Option<f64>,
    /// The probability of such agreement without the mark, an upper bound; 1 if the suspect does not fit. Where a symmetric
    /// shape could lie in several ways and all were tried, it is multiplied by their number.
    pub p_value: f64,
    /// T = Σ sₜ xₜ / √(Σ xₜ²).
    pub correlation: f64,
    /// l.
    pub bits: usize,
    /// Bits read wrong; `None` if the suspect does not fit.
    pub bit_errors: Option<usize>,
    /// Share of the original's vertices that were seen on the suspect, from 0 to 1.
    pub overlap: f64,
    /// RMS distance of corresponding points after alignment, as a fraction of the original's diagonal.
    pub residual: Option<f64>,
    /// Takes the suspect to the original.
    pub transform: Option<Similarity>,
    /// Why the suspect does not fit, in words.
    pub remark: Option<String>,
}

/// How many maps of a symmetric shape onto itself are tried: an icosphere has 120.
const MOST_MAPS: usize = 120;

/// Bases that take more are computed anew for every pass over them.
const KEPT_BYTES: usize = 1 << 30;

/// Judges suspects against one original and its certificate.
#[derive(Debug)]
pub struct Verifier<'a> {
    mesh: &'a TriMesh,
    certificate: &'a Certificate,
    p_bound: f64,
    threads: usize,
    cut: OnceLock<Arc<Original>>,
}

impl<'a> Verifier<'a> {
    /// Checks that original, certificate and public key belong together.
    ///
    /// # Errors
    /// [`SigmarkError::AnotherKey`] or [`SigmarkError::AnotherOriginal`] where they don't.
    pub fn new(
        original: &'a TriMesh,
        certificate: &'a Certificate,
        public_key: &PublicKey,
    ) -> Result<Self, SigmarkError> {
        if certificate.public_key() != public_key {
            return Err(SigmarkError::AnotherKey {
                certificate: certificate.public_key().fingerprint(),
                given: public_key.fingerprint(),
            });
        }
        check_digest(certificate, original)?;
        Ok(Self {
            mesh: original,
            certificate,
            p_bound: 1e-6,
            threads: 1,
            cut: OnceLock::new(),
        })
    }

    /// The largest p-value that counts as detected; 10⁻⁶ by default.
    pub fn p_bound(mut self, bound: f64) -> Self {
        self.p_bound = bound;
        self
    }

    /// How many threads may work; 1 by default. The verdict does not depend on it.
    pub fn threads(mut self, threads: usize) -> Self {
        self.threads = threads;
        self
    }

    /// Takes an original that was cut into patches already, with its bases if it keeps them.
    ///
    /// # Errors
    /// [`SigmarkError::AnotherOriginal`], [`SigmarkError::Layout`] or [`SigmarkError::AnotherCut`] if it is not the original
    /// of the certificate.
    pub fn original(self, original: &Arc<Original>) -> Result<Self, SigmarkError> {
        let mark = self.certificate.mark();
        original.check_layout(&ChipLayout::new(mark.signature.scheme().bits(), mark.chip_rate)?)?;
        check_digest(self.certificate, original.mesh())?;
        let labels = mark.labels.unpack(original.mesh().vertex_count())?;
        if labels != original.patches().labels() || mark.laplacian != original.laplacian() {
            return Err(SigmarkError::AnotherCut);
        }
        Ok(Self {
            cut: OnceLock::from(Arc::clone(original)),
            ..self
        })
    }

    /// Judges a suspect. The original's bases are computed the first time that they are needed, and kept if they are not huge.
    ///
    /// # Errors
    /// When the original's bases can't be computed or are not those of the certificate.
    pub fn verify(&self, suspect: &TriMesh) -> Result<Verdict, SigmarkError> {
        self.verify_observed(suspect, &())
    }

    /// As [`verify`](Self::verify), with an observer that sees the progress and may stop it.
    ///
    /// # Errors
    /// As [`verify`](Self::verify); [`SigmarkError::Cancelled`] when the observer stopped it.
    pub fn verify_observed(
        &self,
        suspect: &TriMesh,
        observer: &dyn Observer,
    ) -> Result<Verdict, SigmarkError> {
        observer.stage(Stage::Registration);
        let maps = match match_candidates(self.mesh, suspect, MOST_MAPS) {
            Ok(maps) => maps,
            Err(difference) => return Ok(self.does_not_fit(difference.to_string())),
        };
        let work = Work {
            threads: self.threads,
            observer,
        };
        let original = self.cut()?;
        if original.basis_bytes() <= KEPT_BYTES {
            original.keep_bases(work)?;
        }

        observer.stage(Stage::Detection);
        let mark = self.certificate.mark();
        let alphas: Vec<f64> = mark.patches.iter().map(|patch| patch.alpha).collect();
        let check = |patch: usize, basis: &PatchBasis| check_basis(patch, &mark.patches[patch], basis);
        let expected = mark.signature.bits();
        let mut best: Option<(f64, Aligned, SoftBits)> = None;
        for map in &maps {
            let aligned = align(original, &alphas, suspect, map, work, check)?;
            let soft = CoefficientDetector.detect(original, &aligned.registered, work)?;
            let t = correlation(&expected, &soft.0);
            if best.as_ref().is_none_or(|(most, ..)| t > *most) {
                best = Some((t, aligned, soft));
            }
        }
        match best {
            Some((_, aligned, soft)) => self.judge(&aligned, &soft, maps.len()),
            None => Ok(self.does_not_fit("the suspect could not be mapped onto the original".into())),
        }
    }

    /// The original cut as the certificate says, the first time.
    fn cut(&self) -> Result<&Original, SigmarkError> {
        if let Some(original) = self.cut.get() {
            return Ok(original);
        }
        let mark = self.certificate.mark();
        let layout = ChipLayout::new(mark.signature.scheme().bits(), mark.chip_rate)?;
        let patches = Patches::from_labels(self.mesh, &mark.labels.unpack(self.mesh.vertex_count())?)?;
        if patches.len() != mark.patches.len() {
            return Err(SigmarkError::AnotherCut);
        }
        let original = Original::with_patches(self.mesh, layout, patches).with_laplacian(mark.laplacian);
        Ok(self.cut.get_or_init(|| Arc::new(original)))
    }

    /// The verdict on the best of several readings: choosing it by T gives chance as many tries.
    fn judge(&self, aligned: &Aligned, soft: &SoftBits, tries: usize) -> Result<Verdict, SigmarkError> {
        let mark = self.certificate.mark();
        let expected = mark.signature.bits();
        let extracted = soft.hard();
        let p = (p_value(&expected, &soft.0) * tries as f64).min(1.0);
        let read = Signature::from_bits(mark.signature.scheme(), &extracted)?;
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
        Ok(Verdict {
            outcome,
            extraction_rate: Some(extraction_rate(&expected, &extracted)),
            p_value: p,
            correlation: correlation(&expected, &soft.0),
            bits: expected.len(),
            bit_errors: Some(expected.iter().zip(&extracted).filter(|(s, e)| s != e).count()),
            overlap: aligned.overlap,
            residual: Some(aligned.residual / self.mesh.bounding_box().diagonal()),
            transform: Some(aligned.transform),
            remark: None,
        })
    }

    fn does_not_fit(&self, remark: String) -> Verdict {
        Verdict {
            outcome: Outcome::NotFound { p: 1.0 },
            extraction_rate: None,
            p_value: 1.0,
            correlation: 0.0,
            bits: self.certificate.mark().signature.scheme().bits(),
            bit_errors: None,
            overlap: 0.0,
            residual: None,
            transform: None,
            remark: Some(remark),
        }
    }
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

fn check_basis(patch: usize, record: &PatchRecord, basis: &PatchBasis) -> Result<(), SigmarkError> {
    if record.matches(basis) {
        return Ok(());
    }
    let (recorded, found) = (record.last_eigenvalue, basis.last_eigenvalue());
    Err(SigmarkError::BasisMismatch {
        patch,
        recorded,
        found,
    })
}
