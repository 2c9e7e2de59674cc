use std::{iter, sync::Arc};

use job::Job;
use mesh::{
    Similarity, TriMesh,
    vector::{norm, sub},
};
use registration::{
    AlignOptions, Alignment, Correspondence, Difference, MatchedBy, RegistrationStage, match_candidates,
};

use super::{Certificate, Outcome, SigmarkError, Verdict, keys::PublicKey, statistics::p_value};
use crate::{
    mark::{
        Aligned, ChipLayout, CoefficientDetector, Detector, Equations, MarkError, MarkStage, Original,
        Patches, Registered, Sampler, SoftBits, align, correlation, extraction_rate,
    },
    payload::{GeometryDigest, Signature},
};

/// How many maps of a symmetric shape onto itself are tried: an icosphere has 120.
const MOST_MAPS: usize = 120;

/// Bases that take more are computed anew for every pass over them.
const KEPT_BYTES: usize = 1 << 30;

/// Judges suspects against one original and its certificate.
#[derive(Clone, Debug)]
pub struct Verifier {
    original: Arc<Original>,
    certificate: Certificate,
    p_bound: f64,
    detector: Option<Arc<dyn Detector>>,
}

impl Verifier {
    /// Checks that original, certificate and public key belong together, and cuts the original as the certificate says.
    ///
    /// # Errors
    /// [`SigmarkError::AnotherKey`] or [`SigmarkError::AnotherOriginal`] where they don't.
    pub fn new(
        original: &TriMesh,
        certificate: &Certificate,
        public_key: &PublicKey,
    ) -> Result<Self, SigmarkError> {
        check_key(certificate, public_key)?;
        check_digest(certificate, original)?;
        let mark = certificate.mark();
        let layout = ChipLayout::new(mark.signature.scheme().bits(), mark.chip_rate)?;
        let patches = Patches::from_labels(original, &mark.labels.unpack(original.vertex_count())?)?;
        if patches.len() != mark.patches.len() {
            return Err(SigmarkError::AnotherCut);
        }
        let original = Original::with_patches(original.clone(), layout, patches);
        Self::of(original.with_laplacian(mark.laplacian), certificate)
    }

    /// As [`new`](Self::new), with an original that was cut into patches already, and its bases if it keeps them.
    ///
    /// # Errors
    /// As [`new`](Self::new); when it was cut for another number of bits or chips; [`SigmarkError::AnotherCut`] if not as the
    /// certificate says.
    pub fn with_original(
        original: &Original,
        certificate: &Certificate,
        public_key: &PublicKey,
    ) -> Result<Self, SigmarkError> {
        check_key(certificate, public_key)?;
        check_digest(certificate, original.mesh())?;
        let mark = certificate.mark();
        let layout = ChipLayout::new(mark.signature.scheme().bits(), mark.chip_rate)?;
        original.layout().check(&layout)?;
        let labels = mark.labels.unpack(original.mesh().vertex_count())?;
        if labels != original.patches().labels() || mark.laplacian != original.laplacian() {
            return Err(SigmarkError::AnotherCut);
        }
        Self::of(original.clone(), certificate)
    }

    fn of(original: Original, certificate: &Certificate) -> Result<Self, SigmarkError> {
        let patches = certificate.mark().patches.iter();
        let eigenvalues = patches.map(|patch| patch.last_eigenvalue).collect();
        Ok(Self {
            original: Arc::new(original.expecting(eigenvalues)?),
            certificate: certificate.clone(),
            p_bound: 1e-6,
            detector: None,
        })
    }

    /// The largest p-value that counts as detected; 10⁻⁶ by default.
    pub fn p_bound(mut self, bound: f64) -> Self {
        self.p_bound = bound;
        self
    }

    /// The detector that reads the bits. By default it is the paper's ([`CoefficientDetector`]) for marks of the paper's
    /// profile, and [`LeastSquaresDetector`](crate::mark::LeastSquaresDetector) for others. Where all vertices were found again, the paper's, being cheap, comes
    /// first.
    pub fn detector(mut self, detector: Arc<dyn Detector>) -> Self {
        self.detector = Some(detector);
        self
    }

    /// Judges a suspect. The original's bases are computed the first time that they are needed, and kept if they are not huge.
    ///
    /// # Errors
    /// When the original's bases can't be computed or are not those of the certificate; [`SigmarkError::Job`].
    pub fn verify(&self, suspect: &TriMesh, job: &Job) -> Result<Verdict, SigmarkError> {
        job.begin(MarkStage::Registration)?;
        match match_candidates(self.original.mesh(), suspect, MOST_MAPS, &job.quiet()) {
            Ok(maps) => self.by_vertices(suspect, &maps, job),
            Err(Difference::Job(error)) => Err(error.into()),
            Err(_) => self.by_surface(suspect, job),
        }
    }

    /// Judges a suspect that has the original's connectivity, its vertices being the original's by one of these maps.
    fn by_vertices(
        &self,
        suspect: &TriMesh,
        maps: &[Correspondence],
        job: &Job,
    ) -> Result<Verdict, SigmarkError> {
        let (original, alphas) = (self.prepared(job)?, self.alphas());
        job.begin(MarkStage::Detection)?;
        let detector = self.detector.as_deref().unwrap_or(&CoefficientDetector);
        let readings = maps.iter().map(|map| {
            let aligned = align(original, &alphas, suspect, map, job)?;
            self.read(aligned, detector, job)
        });
        let mut reading = self.best(readings)?;
        if reading.soft.hard() != self.certificate.mark().signature.bits() {
            let Aligned {
                registered,
                transform,
                ..
            } = &reading.aligned;
            let together = self.together(registered.clone(), transform, job)?;
            let again = match self.alone() {
                Some(detector) => self.read(
                    together.aligned.carried(self.original.mesh(), transform),
                    detector,
                    job,
                )?,
                None => together,
            };
            reading = self.better_of(reading, again);
        }
        let options = AlignOptions::default();
        let overlap = self.in_place(&reading.aligned.registered, &options);
        let fit = Fit {
            basis: MatchedBy::Connectivity,
            poses: maps.len(),
            overlap,
            coverage: overlap,
        };
        let mut verdict = self.judge(&reading, fit)?;
        if matches!(verdict.outcome, Outcome::NotFound { .. }) && overlap < options.least_overlap {
            verdict.remark = Some(format!(
                "another shape: it has the original's triangles, but {:.1} % of its vertices lie where those of the original do",
                100.0 * overlap
            ));
        }
        Ok(verdict)
    }

    /// The share of the vertices that lie near where they belong.
    fn in_place(&self, registered: &Registered, options: &AlignOptions) -> f64 {
        let bound = options.tolerance * self.original.mesh().bounding_box().diagonal();
        let pairs = registered.positions.iter().zip(self.original.mesh().positions());
        let distances: Vec<f64> = pairs.filter_map(|(r, &v)| r.map(|r| norm(sub(r, v)))).collect();
        let near = distances.iter().filter(|&&distance| distance <= bound);
        near.count() as f64 / distances.len().max(1) as f64
    }

    /// Judges a suspect by its surface.
    fn by_surface(&self, suspect: &TriMesh, job: &Job) -> Result<Verdict, SigmarkError> {
        let options = AlignOptions::default();
        let alignment = registration::align(
            self.original.mesh(),
            suspect,
            &options,
            &job.within(RegistrationStage::Hypotheses),
        )
        .map_err(MarkError::from)?;
        let fit = Fit::of(&alignment);
        if !alignment.aligned {
            return Ok(self.does_not_align(fit, &options));
        }
        let (original, alphas) = (self.prepared(job)?, self.alphas());
        let mut sampler = Sampler::new(self.original.mesh(), suspect);
        if let Some(survivors) = &alignment.correspondence {
            sampler = sampler.survivors(survivors);
        }
        let poses = iter::once(&alignment.transform).chain(&alignment.alternatives);
        let readings = poses.map(|pose| {
            let Some(detector) = self.alone() else {
                let (registered, soft, transform) = sampler.read(original, &alphas, pose, job)?;
                return Ok(Reading {
                    aligned: Aligned::new(self.original.mesh(), registered, transform),
                    soft,
                    tries: 1,
                });
            };
            job.begin(MarkStage::Resampling)?;
            let transform = sampler.refine(original, &alphas, pose, job)?;
            let registered = sampler.sample(&transform, job)?;
            self.read(
                Aligned::new(self.original.mesh(), registered, transform),
                detector,
                job,
            )
        });
        let reading = self.best(readings)?;
        self.judge(&reading, fit)
    }

    /// The detector that reads bits by itself, if it is not to be least squares, which estimates a misalignment with them.
    fn alone(&self) -> Option<&dyn Detector> {
        self.detector
            .as_deref()
            .or(match self.certificate.mark().signature.scheme() {
                #[cfg(feature = "paper")]
                crate::payload::Scheme::EcdsaB163Sha1 => Some(&CoefficientDetector),
                _ => None,
            })
    }

    fn read(&self, aligned: Aligned, detector: &dyn Detector, job: &Job) -> Result<Reading, SigmarkError> {
        job.begin(MarkStage::Detection)?;
        let soft = detector.detect(&self.original, &self.alphas(), &aligned.registered, job)?;
        Ok(Reading {
            aligned,
            soft,
            tries: 1,
        })
    }

    /// Bits and misalignment of vertices that lie by this pose, by least squares.
    fn together(
        &self,
        registered: Registered,
        pose: &Similarity,
        job: &Job,
    ) -> Result<Reading, SigmarkError> {
        job.begin(MarkStage::Detection)?;
        let estimate = Equations::of(&self.original, &self.alphas(), &registered, job)?.solve()?;
        let transform = pose.then(&estimate.misalignment.inverse());
        Ok(Reading {
            aligned: Aligned::new(self.original.mesh(), registered, transform),
            soft: SoftBits(estimate.bits),
            tries: 1,
        })
    }

    /// The reading that agrees best with the signature.
    fn best(
        &self,
        readings: impl Iterator<Item = Result<Reading, SigmarkError>>,
    ) -> Result<Reading, SigmarkError> {
        let mut best: Option<Reading> = None;
        for reading in readings {
            let reading = reading?;
            best = Some(match best {
                Some(best) => self.better_of(best, reading),
                None => reading,
            });
        }
        best.ok_or(MarkError::Alignment.into())
    }

    /// The one that agrees better with the signature, having taken the tries of both.
    fn better_of(&self, first: Reading, second: Reading) -> Reading {
        let expected = self.certificate.mark().signature.bits();
        let tries = first.tries + second.tries;
        let [t, u] = [&first, &second].map(|reading| correlation(&expected, &reading.soft.0));
        let better = if u > t { second } else { first };
        Reading { tries, ..better }
    }

    /// The original with its bases, if they are not huge.
    fn prepared(&self, job: &Job) -> Result<&Original, SigmarkError> {
        if self.original.basis_bytes() <= KEPT_BYTES {
            self.original.keep_bases(job)?;
        }
        Ok(&self.original)
    }

    fn alphas(&self) -> Vec<f64> {
        let patches = &self.certificate.mark().patches;
        patches.iter().map(|patch| patch.alpha).collect()
    }

    /// The verdict on the best of several readings: choosing it by T gives chance as many tries.
    fn judge(&self, reading: &Reading, fit: Fit) -> Result<Verdict, SigmarkError> {
        let Reading { aligned, soft, tries } = reading;
        let mark = self.certificate.mark();
        let expected = mark.signature.bits();
        let extracted = soft.hard();
        let p = (p_value(&expected, &soft.0) * *tries as f64).min(1.0);
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
            basis: fit.basis,
            poses: fit.poses,
            overlap: fit.overlap,
            coverage: fit.coverage,
            missing: aligned.registered.missing(),
            residual: Some(aligned.residual / self.original.mesh().bounding_box().diagonal()),
            transform: Some(aligned.transform),
            remark: None,
        })
    }

    fn does_not_align(&self, fit: Fit, options: &AlignOptions) -> Verdict {
        let remark = format!(
            "does not align: in the best position, {:.1} % of the suspect's surface lies on the original; {:.0} % are needed",
            100.0 * fit.overlap,
            100.0 * options.least_overlap
        );
        Verdict {
            outcome: Outcome::NotFound { p: 1.0 },
            extraction_rate: None,
            p_value: 1.0,
            correlation: 0.0,
            bits: self.certificate.mark().signature.scheme().bits(),
            bit_errors: None,
            basis: fit.basis,
            poses: 0,
            overlap: fit.overlap,
            coverage: fit.coverage,
            missing: 1.0,
            residual: None,
            transform: None,
            remark: Some(remark),
        }
    }
}

/// How a suspect and the original cover each other.
#[derive(Clone, Copy)]
struct Fit {
    basis: MatchedBy,
    /// In how many ways.
    poses: usize,
    overlap: f64,
    coverage: f64,
}

impl Fit {
    fn of(alignment: &Alignment) -> Self {
        Self {
            basis: alignment.matched_by,
            poses: 1 + alignment.alternatives.len(),
            overlap: alignment.overlap,
            coverage: alignment.coverage,
        }
    }
}

/// The best of several readings.
struct Reading {
    aligned: Aligned,
    soft: SoftBits,
    tries: usize,
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
